"""ISO 230-2:1988 and VDI/DGQ 3441, whose formulas are known from secondary sources only."""

from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.positioning.run import BACKWARD, FORWARD, PositioningTest
from thermaxis.positioning.standard._iso230_2 import (
    evaluate_iso230_2,
    figures_by_key,
    iso230_2_figures,
    value_or_none,
)

UNVERIFIED = "unverified: from memory"
"""Mark of every figure whose formula nobody has yet checked against the standard's text."""


@final
@dataclass(frozen=True, slots=True)
class Iso230_2_1988Result:
    """Figures after ISO 230-2:1988, with bands of three standard deviations."""

    B: float | None
    """Reversal value of the axis. [µm or arcsec]"""
    B_mean: float | None
    """Mean reversal value, with its sign. [µm or arcsec]"""
    R_forward: float | None
    """Repeatability forward, 6 s. [µm or arcsec]"""
    R_backward: float | None
    """Repeatability backward, 6 s. [µm or arcsec]"""
    R: float | None
    """Bidirectional repeatability, bands of 3 s. [µm or arcsec]"""
    A_forward: float | None
    """Accuracy forward, bands of 3 s. [µm or arcsec]"""
    A_backward: float | None
    """Accuracy backward, bands of 3 s. [µm or arcsec]"""
    A: float | None
    """Bidirectional accuracy, bands of 3 s. [µm or arcsec]"""
    mark: str = UNVERIFIED
    """How far the formulas are to be trusted."""


def evaluate_iso230_2_1988(test: PositioningTest) -> Iso230_2_1988Result:
    """Evaluate a run after ISO 230-2:1988; formulas unverified, from memory.

    Parameters
    ----------
    test : PositioningTest
        The measured run, with at least two readings per target and approach.

    Returns
    -------
    Iso230_2_1988Result
        Figures in the deviation unit of the axis; the edition knows no E of its own.

    Raises
    ------
    DataError
        If a target has fewer than two readings in a measured approach.

    References
    ----------
    ISO 230-2:1988 (GOST 27843-88 family), from memory; the change from three to two standard
    deviations in 1997 from a secondary source.
    """
    evaluate_iso230_2(test, full=True)
    figures = iso230_2_figures(test.deviation, coverage_factor=3.0)
    values = figures_by_key(figures)
    kept = {key: value for key, value in values.items() if key[0] in "BRA"}
    return Iso230_2_1988Result(**kept, mark=UNVERIFIED)


@final
@dataclass(frozen=True, slots=True)
class Vdi3441Result:
    """Figures after VDI/DGQ 3441 (1977); absent in a unidirectional run."""

    U_max: float | None
    """Largest reversal error. [µm or arcsec]"""
    U_mean: float | None
    """Mean of the magnitudes of the reversal errors. [µm or arcsec]"""
    Ps_max: float | None
    """Largest positional scatter, 6 times the mean s of both approaches. [µm or arcsec]"""
    Ps_mean: float | None
    """Mean positional scatter. [µm or arcsec]"""
    Pa: float | None
    """Positional deviation: range of the mean bidirectional deviation. [µm or arcsec]"""
    P: float | None
    """Positional uncertainty. [µm or arcsec]"""
    mark: str = UNVERIFIED
    """How far the formulas are to be trusted."""


def evaluate_vdi_dgq_3441(test: PositioningTest) -> Vdi3441Result:
    """Evaluate a run after VDI/DGQ 3441 (1977); formulas unverified, from memory.

    It needs, and refuses, what `evaluate_iso230_2_1988` does.

    References
    ----------
    VDI/DGQ 3441:1977, from memory; the names of the results from a vendor's list of figures.
    """
    result = evaluate_iso230_2(test, full=True)
    reversal = np.abs(result.B_i)
    scatter = 3.0 * (result.s[:, FORWARD] + result.s[:, BACKWARD])
    centre = result.mean_bidirectional
    half_width = (reversal + scatter) / 2.0
    return Vdi3441Result(
        U_max=value_or_none(np.max(reversal)),
        U_mean=value_or_none(np.mean(reversal)),
        Ps_max=value_or_none(np.max(scatter)),
        Ps_mean=value_or_none(np.mean(scatter)),
        Pa=value_or_none(np.max(centre) - np.min(centre)),
        P=value_or_none(np.max(centre + half_width) - np.min(centre - half_width)),
    )
