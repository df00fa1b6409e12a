"""Levels of an axis as the tests of the diagnosis see them, and what the tests share."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.positioning.run import BACKWARD, FORWARD, FloatArray, PositioningTest
from thermaxis.positioning.standard import local_deviation_contrasts
from thermaxis.quantities import AxisKind

if TYPE_CHECKING:
    from thermaxis.positioning.drift import DriftResult

LEVEL = 0.005
"""Largest probability that one test names a healthy axis, the spread's test excepted. [1]"""
SPREAD_LEVEL = 0.02
"""The same for the spread of all targets together. [1]"""
LEAST_EFFECT = 1.0
"""Reversal value, step or variation of it, and error at the end of the axis that is no finding;
own choice, what a good axis with a laser's set-up leaves. [µm or arcsec]"""
FEWEST_TARGETS = 5
"""With fewer targets nothing is said of how an error runs along the axis. [1]"""

FEWEST_TARGETS_OF_A_TURN = 8
"""With fewer targets waves are not told from a line. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Axis:
    """Levels as the tests see them."""

    test: PositioningTest
    drift: "DriftResult | None"
    target: FloatArray
    """Targets whose levels are known, (m,). [mm or deg]"""
    mean: FloatArray
    """Mean of the measured approaches, (m,). [µm or arcsec]"""
    mean_covariance: FloatArray
    """(m, m). [µm² or arcsec²]"""
    reversal: FloatArray | None
    """Reversal values, (m,); None in a unidirectional run. [µm or arcsec]"""
    reversal_covariance: FloatArray
    """(m, m). [µm² or arcsec²]"""
    free: float
    """Degrees of freedom of the noise. [1]"""

    @property
    def length(self) -> float:
        return float(self.target[-1] - self.target[0])

    @property
    def full_turn(self) -> bool:
        """Whether the targets go once around, whether or not the first is measured again."""
        if self.test.kind is AxisKind.LINEAR or self.target.size < FEWEST_TARGETS_OF_A_TURN:
            return False
        return 360.0 - 1.5 * float(np.max(np.diff(self.target))) < self.length < 360.5

    @property
    def closed(self) -> bool:
        """Whether the last target is the place of the first."""
        return self.full_turn and self.length > 359.5

    @property
    def unit(self) -> str:
        return self.test.kind.units.deviation

    @property
    def units(self) -> dict[str, str]:
        """Units of deviations and positions, as messages state them."""
        return {"unit": self.unit, "position_unit": self.test.kind.units.position}


def upper_tail(t: float, free: float) -> float:
    """Return the probability that Student's t is larger."""
    from scipy.special import stdtr  # noqa: PLC0415  it takes longer to import than a whole run

    return float(stdtr(free, -t))


def f_tail(ratio: float, more: float, free: float) -> float:
    """Return the probability that F with these degrees of freedom is larger."""
    from scipy.special import fdtrc  # noqa: PLC0415  it takes longer to import than a whole run

    return float(fdtrc(more, free, max(ratio, 0.0)))


def smooth_basis(target: FloatArray, degree: int) -> FloatArray:
    """Return orthonormal polynomials of the position, (m, degree + 1)."""
    x = 2.0 * (target - target[0]) / (target[-1] - target[0]) - 1.0
    columns = np.asarray(np.polynomial.legendre.legvander(x, degree), dtype=np.float64)
    basis, _ = np.linalg.qr(columns)
    return np.asarray(basis, dtype=np.float64)


def _plain_levels(test: PositioningTest) -> tuple[FloatArray, FloatArray, float]:
    """Return plain means, their variances (NaN for one cycle) and the degrees of freedom."""
    count = test.readings
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.nansum(test.deviation, axis=1) / count
        square = float(np.nansum((test.deviation - mean[:, None, :]) ** 2))
        free = float(np.sum(np.maximum(count - 1.0, 0.0)))
        variance = square / free / count if free > 0.0 else np.full(count.shape, np.nan)
    return mean, variance, free


def _variance_along(target: FloatArray, value: FloatArray) -> float:
    """Return the variance of values about the lines through their neighbours."""
    contrast = local_deviation_contrasts(target)
    local = contrast @ value / np.sqrt(np.sum(contrast**2, axis=1))
    return float(np.median(local**2)) / 0.4549  # median of chi-squared with one degree of freedom


def _combined(
    covariance: FloatArray, known: NDArray[np.bool_], approaches: int
) -> tuple[FloatArray, FloatArray]:
    """Return the covariances of the means of both approaches and of the reversal values."""
    m = known.size
    kept = np.ix_(known, known)
    forward = covariance[:m, :m][kept]
    if approaches == 1:
        return forward, forward
    backward = covariance[m:, m:][kept]
    across = covariance[:m, m:][kept]
    own, shared = forward + backward, across + across.T
    return (own + shared) / 4.0, own - shared


def axis_of(test: PositioningTest, drift: "DriftResult | None") -> Axis | None:
    """Return the levels with their covariance; None where nothing tells their noise."""
    approaches = [a for a, measured in enumerate(test.measured_approaches) if measured]
    if drift is not None:
        level, covariance = drift.level, drift.level_covariance
        free = float(np.sum(test.readings)) - drift.effective_parameters
    else:
        level, variance, free = _plain_levels(test)
        covariance = np.diag(variance[:, approaches].T.ravel())
    known = np.all(np.isfinite(level[:, approaches]), axis=1)
    if int(np.sum(known)) < 3:
        return None
    target = test.target[known]
    mean = np.mean(level[np.ix_(known, approaches)], axis=1)
    reversal = level[known, FORWARD] - level[known, BACKWARD] if len(approaches) == 2 else None
    if free > 0.0:
        mean_covariance, reversal_covariance = _combined(covariance, known, len(approaches))
    elif target.size >= FEWEST_TARGETS:  # one cycle: the axis itself must tell what is noise
        free = 0.5 * target.size
        mean_covariance = np.eye(target.size) * _variance_along(target, mean)
        along = mean if reversal is None else reversal
        reversal_covariance = np.eye(target.size) * _variance_along(target, along)
    else:
        return None
    return Axis(
        test=test,
        drift=drift,
        target=target,
        mean=mean,
        mean_covariance=mean_covariance,
        reversal=reversal,
        reversal_covariance=reversal_covariance,
        free=free,
    )
