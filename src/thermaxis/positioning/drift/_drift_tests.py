"""Tests of what a run says about its drift: whether it drifts, bows, or drifts at one target only.

All are F tests of regressions on the levels and on polynomials of time. The levels are taken out
of every regressor first, so that their number costs nothing.
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.positioning.drift._smooth_terms import IntArray, Readings, sums_per
from thermaxis.positioning.run import FloatArray

SIGNIFICANCE = 0.01
"""Level of every test. [1]"""
FEWEST_TARGETS_BOW = 5
"""With fewer targets a bow is not looked for. [1]"""
FEWEST_CYCLES_BOW = 3.0
"""With fewer cycles a bow is not looked for. [1]"""
FEWEST_TARGETS_ALONE = 4
"""With fewer targets nobody can say which of them drifts otherwise. [1]"""
MANY_CYCLES = 10.0
"""From so many cycles on the polynomials are of higher degree. [1]"""
_RANK = 1e-10
"""Eigenvalues below this share of the largest one count as zero. [1]"""


@final
@dataclass(frozen=True, slots=True)
class FTest:
    """An F test of two nested regressions."""

    ratio: float
    """Mean square of what is tested over that of the noise; about one by chance. [1]"""
    probability: float
    """Probability of such a ratio, or a larger one, by chance. [1]"""

    @property
    def found(self) -> bool:
        """Whether what is tested is there, at the 1 % level."""
        return self.probability < SIGNIFICANCE


_NOT_TESTED = FTest(ratio=0.0, probability=1.0)


def _compare(square: float, square_with: float, more: int, free: int) -> FTest:
    """Compare sums of squared residuals without and with `more` regressors."""
    gained = max(square - square_with, 0.0)
    if free < 1 or more < 1 or gained == 0.0:
        return _NOT_TESTED
    if square_with <= 0.0:
        return FTest(ratio=np.inf, probability=0.0)
    from scipy.special import fdtrc  # noqa: PLC0415 - it takes longer to import than most runs

    ratio = gained / more / (square_with / free)
    return FTest(ratio=ratio, probability=float(fdtrc(more, free, ratio)))


def _without_levels(readings: Readings, rows: FloatArray) -> FloatArray:
    """Take the weighted mean of every level out of each row, (k, N), and weight what is left.

    The rows are changed in place.
    """
    count = sums_per(readings.level, readings.weight, readings.levels)
    count[count == 0.0] = 1.0  # levels of other targets, where a part of a run is looked at
    root = np.sqrt(readings.weight)
    for k in range(rows.shape[0]):
        mean = sums_per(readings.level, readings.weight * rows[k], readings.levels) / count
        rows[k] -= mean[readings.level]
        rows[k] *= root
    return rows


def _inverse(products: FloatArray) -> tuple[FloatArray, int]:
    """Return the pseudo-inverse of a symmetric matrix and its rank."""
    scale = np.sqrt(np.maximum(np.diag(products), 1e-300))
    value, vector = np.linalg.eigh(products / np.outer(scale, scale))
    large = value > _RANK * value[-1]
    scaled = vector[:, large] / scale[:, None]
    return (scaled / value[large]) @ scaled.T, int(np.sum(large))


def polynomials(time: FloatArray, degree: int) -> FloatArray:
    """Return the Legendre polynomials of degree 1 ... `degree` over the run.

    References
    ----------
    Bonnet's recurrence: (k + 1) P_(k+1) = (2 k + 1) x P_k - k P_(k-1).
    """
    x = 2.0 * time - 1.0
    rows = np.empty((degree, time.size))
    rows[0] = x
    if degree > 1:
        rows[1] = 1.5 * x**2 - 0.5
    for k in range(2, degree):
        rows[k] = ((2 * k + 1) * x * rows[k - 1] - k * rows[k - 2]) / (k + 1)
    return rows


def _highest(degree: int, cycles: float) -> int:
    """Return a degree that so many cycles can tell from the levels."""
    return min(degree, max(1, int(cycles) - 1))


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Regression:
    """A regression on the first rows of all regressors."""

    inverse: FloatArray
    residual: FloatArray
    square: float
    rank: int
    free: int


class DriftTests:
    """The tests of one run, which share their regressors."""

    def __init__(self, readings: Readings, targets: int, cycles: float) -> None:
        self._readings = readings
        self._targets = targets
        self._cycles = cycles
        many = cycles >= MANY_CYCLES
        common = _highest(5 if many else 3, cycles)
        slope = _highest(3 if many else 2, cycles)
        bow = _highest(2, cycles)
        self._drifting = common + slope
        self._bowed = common + slope + bow
        powers = polynomials(readings.time, common)
        rows = np.empty((self._bowed, readings.value.size))
        rows[:common] = powers
        rows[common : self._drifting] = powers[:slope] * readings.shape[1]
        rows[self._drifting :] = powers[:bow] * readings.shape[1] ** 2
        self._rows = _without_levels(readings, rows)
        self._value = _without_levels(readings, readings.value[None].copy())[0]
        self._products = self._rows @ self._rows.T
        self._without_bow = self._regress(self._drifting)

    def _regress(self, number: int) -> _Regression:
        rows = self._rows[:number]
        inverse, rank = _inverse(self._products[:number, :number])
        residual = self._value
        for _ in range(2):  # the second time removes the round-off of the first
            residual = residual - (inverse @ (rows @ residual)) @ rows
        return _Regression(
            inverse=inverse,
            residual=residual,
            square=float(residual @ residual),
            rank=rank,
            free=residual.size - self._readings.levels - rank,
        )

    def drift(self) -> FTest:
        """Test whether the run drifts: a(t) of degree 3, b(t) of degree 2 (many cycles: 5, 3)."""
        drifting = self._without_bow
        still = float(self._value @ self._value)
        return _compare(still, drifting.square, drifting.rank, drifting.free)

    def bow(self) -> FTest:
        """Test whether the axis bows: a parabola of the position times degree 2 of time."""
        if self._targets < FEWEST_TARGETS_BOW or self._cycles < FEWEST_CYCLES_BOW:
            return _NOT_TESTED
        straight, bowed = self._without_bow, self._regress(self._bowed)
        return _compare(straight.square, bowed.square, bowed.rank - straight.rank, bowed.free)

    def targets_alone(self, *, bow: bool) -> tuple[int, ...]:
        """Return the targets, from 1, whose readings drift otherwise than those of the rest.

        Each is tested with degree 2 of time of its own, at the 1 % level of the run as a whole
        (Bonferroni); with `bow` a bow belongs to what all targets share.
        """
        if self._targets < FEWEST_TARGETS_ALONE:
            return ()
        base = self._regress(self._bowed) if bow else self._without_bow
        rows = self._rows[: self._bowed if bow else self._drifting]
        target = self._readings.level % self._targets
        order = np.argsort(target, kind="stable")
        parts = np.split(order, np.cumsum(np.bincount(target, minlength=self._targets))[:-1])
        alone: list[int] = []
        for number, mine in enumerate(parts, start=1):
            own = self._own_rows(mine)
            through = own @ rows[:, mine].T
            inverse, more = _inverse(own @ own.T - through @ base.inverse @ through.T)
            right = own @ base.residual[mine]
            left = base.square - float(right @ inverse @ right)
            tested = _compare(base.square, left, more, base.free - more)
            if tested.probability * self._targets < SIGNIFICANCE:
                alone.append(number)
        return tuple(alone)

    def _own_rows(self, mine: IntArray) -> FloatArray:
        """Return polynomials of time of the readings of one target, without levels."""
        readings = self._readings
        part = Readings(
            value=readings.value[mine],
            level=readings.level[mine],
            time=readings.time[mine],
            shape=readings.shape[:, mine],
            weight=readings.weight[mine],
            levels=readings.levels,
        )
        return _without_levels(part, polynomials(part.time, _highest(2, self._cycles)))
