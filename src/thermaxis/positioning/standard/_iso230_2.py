"""Figures of ISO 230-2: accuracy and repeatability of positioning."""

from dataclasses import dataclass, fields
from enum import StrEnum
from typing import Any, final

import numpy as np

from thermaxis.codes import NOWHERE, Place
from thermaxis.errors import DataError
from thermaxis.positioning.run import (
    APPROACHES,
    BACKWARD,
    FORWARD,
    FloatArray,
    PositioningTest,
    freeze_arrays,
    require_shape,
)
from thermaxis.quantities import AxisKind

LONG_AXIS_MM = 2000.0
"""Above this length one run per direction is the rule (GOST ISO 230-2-2016, clause 6.2). [mm]"""


FIGURE_KEYS = (
    "B",
    "B_mean",
    "M",
    "E_forward",
    "E_backward",
    "E",
    "R_forward",
    "R_backward",
    "R",
    "A_forward",
    "A_backward",
    "A",
)
"""Figures of the axis in the order in which tables show them."""


class Edition(StrEnum):
    """Editions of ISO 230-2 whose figures have the same formulas; they differ in names."""

    E1997 = "1997"
    E2006 = "2006"
    E2014 = "2014"


@dataclass(frozen=True, slots=True, eq=False)
class Iso230_2Figures:
    """Figures of one run or of many runs at once; NaN where a figure does not exist.

    The leading axes are those of the readings: none for one run, (k,) for k runs.
    """

    B: FloatArray
    """Reversal value of the axis, max over targets of abs(B_i), (...). [µm or arcsec]"""
    B_mean: FloatArray
    """Mean reversal value, with its sign, (...). [µm or arcsec]"""
    M: FloatArray
    """Range of the mean bidirectional positional deviation, (...). [µm or arcsec]"""
    E_unidirectional: FloatArray
    """Unidirectional systematic positional deviation, (..., 2). [µm or arcsec]"""
    E: FloatArray
    """Bidirectional systematic positional deviation, (...). [µm or arcsec]"""
    R_unidirectional: FloatArray
    """Unidirectional repeatability, (..., 2). [µm or arcsec]"""
    R: FloatArray
    """Bidirectional repeatability, (...). [µm or arcsec]"""
    A_unidirectional: FloatArray
    """Unidirectional accuracy, (..., 2). [µm or arcsec]"""
    A: FloatArray
    """Bidirectional accuracy, (...). [µm or arcsec]"""
    mean: FloatArray
    """Mean unidirectional positional deviation per target, (..., m, 2). [µm or arcsec]"""
    mean_bidirectional: FloatArray
    """Mean bidirectional positional deviation per target, (..., m). [µm or arcsec]"""
    s: FloatArray
    """Estimator of the standard deviation per target (n - 1), (..., m, 2). [µm or arcsec]"""
    B_i: FloatArray
    """Reversal value per target, forward minus backward, (..., m). [µm or arcsec]"""
    R_i_unidirectional: FloatArray
    """Unidirectional repeatability per target, (..., m, 2). [µm or arcsec]"""
    R_i: FloatArray
    """Bidirectional repeatability per target, (..., m). [µm or arcsec]"""

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def E_forward(self) -> FloatArray:
        """Systematic positional deviation, forward, (...). [µm or arcsec]"""
        return self.E_unidirectional[..., FORWARD][()]

    @property
    def E_backward(self) -> FloatArray:
        """Systematic positional deviation, backward, (...). [µm or arcsec]"""
        return self.E_unidirectional[..., BACKWARD][()]

    @property
    def R_forward(self) -> FloatArray:
        """Repeatability, forward, (...). [µm or arcsec]"""
        return self.R_unidirectional[..., FORWARD][()]

    @property
    def R_backward(self) -> FloatArray:
        """Repeatability, backward, (...). [µm or arcsec]"""
        return self.R_unidirectional[..., BACKWARD][()]

    @property
    def A_forward(self) -> FloatArray:
        """Accuracy, forward, (...). [µm or arcsec]"""
        return self.A_unidirectional[..., FORWARD][()]

    @property
    def A_backward(self) -> FloatArray:
        """Accuracy, backward, (...). [µm or arcsec]"""
        return self.A_unidirectional[..., BACKWARD][()]


def mean_and_s(deviation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the mean and the standard deviation (n - 1) over the cycles of every target.

    References
    ----------
    ISO 230-2:2014, clause 3 (mean unidirectional positional deviation; estimator of the
    unidirectional axis positioning repeatability at a position).
    """
    measured = ~np.isnan(deviation)
    if bool(np.all(measured)):
        n = deviation.shape[-2]
        mean = np.sum(deviation, axis=-2) / n
        scatter = np.sum((deviation - mean[..., None, :]) ** 2, axis=-2)
        s = np.sqrt(scatter / (n - 1)) if n > 1 else np.full_like(mean, np.nan)
        return mean, s
    count = np.sum(measured, axis=-2, dtype=np.float64)
    total = np.sum(np.where(measured, deviation, 0.0), axis=-2)
    mean = np.where(count > 0, total / np.maximum(count, 1.0), np.nan)
    residual = np.where(measured, deviation - mean[..., None, :], 0.0)
    scatter = np.sum(residual**2, axis=-2)
    s = np.where(count > 1, np.sqrt(scatter / np.maximum(count - 1.0, 1.0)), np.nan)
    return mean, s


def _band_width(mean: FloatArray, half_width: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the extent of mean ± half_width over the targets: each approach, and both together."""
    upper = np.max(mean + half_width, axis=-2)
    lower = np.min(mean - half_width, axis=-2)
    return upper - lower, np.max(upper, axis=-1) - np.min(lower, axis=-1)


def figures_of(mean: FloatArray, s: FloatArray, *, coverage_factor: float = 2.0) -> Iso230_2Figures:
    """Return the figures of ISO 230-2 from means and standard deviations of every target.

    References
    ----------
    ISO 230-2:2014, clause 3.
    """
    k = coverage_factor
    reversal = mean[..., FORWARD] - mean[..., BACKWARD]
    r_i_unidirectional = 2 * k * s
    r_i = np.maximum(
        k * s[..., FORWARD] + k * s[..., BACKWARD] + np.abs(reversal),
        np.max(r_i_unidirectional, axis=-1),
    )
    mean_bidirectional = (mean[..., FORWARD] + mean[..., BACKWARD]) / 2
    e_unidirectional, e = _band_width(mean, np.zeros_like(mean))
    a_unidirectional, a = _band_width(mean, k * s)
    return Iso230_2Figures(
        B=np.max(np.abs(reversal), axis=-1),
        B_mean=np.mean(reversal, axis=-1),
        M=np.max(mean_bidirectional, axis=-1) - np.min(mean_bidirectional, axis=-1),
        E_unidirectional=e_unidirectional,
        E=e,
        R_unidirectional=np.max(r_i_unidirectional, axis=-2),
        R=np.max(r_i, axis=-1),
        A_unidirectional=a_unidirectional,
        A=a,
        mean=mean,
        mean_bidirectional=mean_bidirectional,
        s=s,
        B_i=reversal,
        R_i_unidirectional=r_i_unidirectional,
        R_i=r_i,
    )


def iso230_2_figures(deviation: FloatArray, *, coverage_factor: float = 2.0) -> Iso230_2Figures:
    """Return the figures of ISO 230-2 of one run, or of many runs in one vectorised call.

    Parameters
    ----------
    deviation : FloatArray
        Deviations, (..., m, n, 2): target, cycle, approach (0 forward, 1 backward); NaN where a
        reading is missing. [µm or arcsec]
    coverage_factor : float
        Factor of s in repeatability and accuracy. Default 2, of the editions since 1997. [1]

    Returns
    -------
    Iso230_2Figures
        A figure is NaN where a reading that it needs does not exist: B, M, E, R, A in a
        unidirectional run; s, R, A with one cycle.

    Raises
    ------
    DataError
        If the last axis is not the two approaches, or the array has fewer than three axes.

    References
    ----------
    ISO 230-2:2014, clause 3; the same formulas in the editions 1997 and 2006.
    """
    fits = deviation.ndim >= 3 and deviation.shape[-1] == 2
    require_shape(deviation, "(..., m, n, 2)", Place(key="deviation"), fits=fits)
    return figures_of(*mean_and_s(deviation), coverage_factor=coverage_factor)


def arrays_by_key(figures: Iso230_2Figures) -> dict[str, FloatArray]:
    """Return the figures of one run or many by their keys, NaN where absent."""
    return {key: np.asarray(getattr(figures, key)) for key in FIGURE_KEYS}


def figures_by_key(figures: Iso230_2Figures) -> dict[str, float | None]:
    """Return the figures of one run by `FIGURE_KEYS`; None where absent. [µm or arcsec]"""
    return {key: value_or_none(getattr(figures, key)) for key in FIGURE_KEYS}


@final
@dataclass(frozen=True, slots=True, eq=False)
class Iso230_2Result(Iso230_2Figures):
    """Figures of one run after ISO 230-2; NaN where the standard gives none for this run."""

    edition: Edition
    """Edition whose names are used; the formulas are those of 1997, 2006 and 2014."""
    single_run_rule: bool
    """Whether s, R and A are left out because the axis is longer than 2000 mm."""
    target: FloatArray
    """Target positions, (m,). [mm or deg]"""


def is_single_run_axis(test: PositioningTest) -> bool:
    """Return whether one run per direction is the rule: a linear axis measured over 2000 mm.

    References
    ----------
    GOST ISO 230-2-2016 (ISO 230-2:2014), clause 6.2.
    """
    return test.kind is AxisKind.LINEAR and test.measured_length > LONG_AXIS_MM


def require_readings(test: PositioningTest, needed: int, place: Place = NOWHERE) -> None:
    """Refuse a run with too few readings of a target in a measured approach."""
    for approach in test.approaches:
        readings = test.readings[:, approach]
        short = np.flatnonzero(readings < needed)
        if short.size:
            i = int(short[0])
            raise DataError(
                "too_few_at_target",
                readings=int(readings[i]),
                approach=APPROACHES[approach],
                needed=needed,
                target=i + 1,
                position=float(test.target[i]),
                unit=test.kind.units.position,
                place=place,
            )


def value_or_none(figure: FloatArray | np.floating[Any]) -> float | None:
    """Return a figure as a number, or None where it does not exist (NaN)."""
    number = float(figure)
    return None if np.isnan(number) else number


def evaluate_iso230_2(
    test: PositioningTest, *, edition: Edition = Edition.E2014, full: bool = False
) -> Iso230_2Result:
    """Evaluate a run after ISO 230-2.

    Parameters
    ----------
    edition : Edition
        Edition whose names the result carries; 1997, 2006 and 2014 have the same formulas.
        Default: the latest.
    full : bool
        Evaluate s, R and A also on a linear axis longer than 2000 mm. Default: no, as the
        standard prescribes one run per direction there.

    Returns
    -------
    Iso230_2Result
        Figures in the deviation unit of the axis. On an axis over 2000 mm the means are those
        of all runs that exist, and s, R, A are absent unless `full`.

    Raises
    ------
    DataError
        If a target has fewer than two readings in a measured approach (fewer than one where
        one run is the rule); the error names the target and the approach.

    References
    ----------
    ISO 230-2:2014, clause 3; GOST ISO 230-2-2016, clause 6.2, for axes over 2000 mm.
    """
    single_run_rule = is_single_run_axis(test) and not full
    require_readings(test, 1 if single_run_rule else 2)
    mean, s = mean_and_s(test.deviation)
    figures = figures_of(mean, np.full_like(s, np.nan) if single_run_rule else s)
    values = {field.name: getattr(figures, field.name) for field in fields(figures)}
    return Iso230_2Result(
        **values, edition=edition, single_run_rule=single_run_rule, target=test.target
    )
