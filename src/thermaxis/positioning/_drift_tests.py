"""Tests of what a run says about its drift: whether it drifts, bows, or drifts at one target only.

All are F tests of regressions on the levels and on polynomials of time. The levels are taken out
of every column first, so that their number costs nothing.
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.positioning._positioning_test import FloatArray
from thermaxis.positioning._smooth_terms import Readings, sums_per

SIGNIFICANCE = 0.01
"""Level of every test. [1]"""
FEWEST_TARGETS_BOW = 5
"""With fewer targets a bow is not looked for. [1]"""
FEWEST_CYCLES_BOW = 3.0
"""With fewer cycles a bow is not looked for. [1]"""
FEWEST_TARGETS_ALONE = 4
"""With fewer targets nobody can say which of them drifts otherwise. [1]"""
_RANK = 1e-10
"""Eigenvalues below this share of the largest one count as zero. [1]"""


def unexplained_share(square: float, square_with: float, more: int, free: int) -> float:
    """Return the probability of the F test of two nested regressions.

    Parameters
    ----------
    square, square_with : float
        Sums of squared residuals without and with the columns that are tested.
    more : int
        Number of these columns. [1]
    free : int
        Degrees of freedom of the residuals with them. [1]

    Returns
    -------
    float
        Probability of such a gain, or a larger one, by chance. [1]
    """
    if free < 1 or more < 1:
        return 1.0
    if square_with <= 0.0:
        return 0.0 if square > 0.0 else 1.0
    from scipy.special import fdtrc  # noqa: PLC0415 - it takes longer to import than most runs

    ratio = max(square - square_with, 0.0) / more / (square_with / free)
    return float(fdtrc(more, free, ratio))


def without_levels(readings: Readings, columns: FloatArray) -> FloatArray:
    """Take the weighted mean of every level out of each column, and weight what is left.

    Parameters
    ----------
    readings : Readings
        The run.
    columns : FloatArray
        One value per reading and column, (N, k).

    Returns
    -------
    FloatArray
        (N, k).
    """
    count = sums_per(readings.level, readings.weight, readings.levels)
    count[count == 0.0] = 1.0  # levels of other targets, where a part of a run is looked at
    root = np.sqrt(readings.weight)
    out = np.empty_like(columns)
    for k in range(columns.shape[1]):
        mean = sums_per(readings.level, readings.weight * columns[:, k], readings.levels) / count
        out[:, k] = (columns[:, k] - mean[readings.level]) * root
    return out


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Regression:
    columns: FloatArray
    """Without levels, weighted, (N, k)."""
    inverse: FloatArray
    """Of their products, (k, k)."""
    residual: FloatArray
    """(N,)."""
    square: float
    rank: int
    free: int


def _inverse(products: FloatArray) -> tuple[FloatArray, int]:
    """Return the pseudo-inverse of a symmetric matrix and its rank."""
    scale = np.sqrt(np.maximum(np.diag(products), 1e-300))
    value, vector = np.linalg.eigh(products / np.outer(scale, scale))
    large = value > _RANK * value[-1]
    scaled = vector[:, large] / scale[:, None]
    return (scaled / value[large]) @ scaled.T, int(np.sum(large))


def _regress(readings: Readings, columns: FloatArray) -> _Regression:
    projected = without_levels(readings, columns)
    inverse, rank = _inverse(projected.T @ projected)
    residual = without_levels(readings, readings.value[:, None])[:, 0]
    for _ in range(2):  # the second time removes the round-off of the first
        residual = residual - projected @ (inverse @ (projected.T @ residual))
    return _Regression(
        columns=projected,
        inverse=inverse,
        residual=residual,
        square=float(residual @ residual),
        rank=rank,
        free=residual.size - readings.levels - rank,
    )


def polynomials(time: FloatArray, degree: int) -> FloatArray:
    """Return the Legendre polynomials of degree 1 ... `degree` over the run.

    Parameters
    ----------
    time : FloatArray
        Times as a fraction of the run, (N,). [1]
    degree : int
        Highest degree. [1]

    Returns
    -------
    FloatArray
        (N, degree). [1]
    """
    values = np.polynomial.legendre.legvander(2.0 * time - 1.0, degree)[:, 1:]
    return np.asarray(values, dtype=np.float64)


def _highest(degree: int, cycles: float) -> int:
    """Return a degree that so many cycles can tell from the levels."""
    return min(degree, max(1, int(cycles) - 1))


def _drift_columns(readings: Readings, cycles: float) -> FloatArray:
    """Return polynomials for a(t) and b(t): of degree 3 and 2, from ten cycles on 5 and 3."""
    many = cycles >= 10.0
    common = polynomials(readings.time, _highest(5 if many else 3, cycles))
    slope = polynomials(readings.time, _highest(3 if many else 2, cycles))
    return np.column_stack((common, slope * readings.shape[1][:, None]))


def _bow_columns(readings: Readings, degree: int) -> FloatArray:
    return polynomials(readings.time, degree) * (readings.shape[1] ** 2)[:, None]


def probability_without_drift(readings: Readings, cycles: float) -> float:
    """Return the probability of readings that vary so much in time, without any drift.

    Parameters
    ----------
    readings : Readings
        The run; the second shape is the distance from the mean position.
    cycles : float
        Readings per level, in the mean. [1]

    Returns
    -------
    float
        Of the F test against polynomials of time, common and proportional to position. [1]
    """
    value = without_levels(readings, readings.value[:, None])[:, 0]
    drifting = _regress(readings, _drift_columns(readings, cycles))
    return unexplained_share(float(value @ value), drifting.square, drifting.rank, drifting.free)


def probability_without_bow(readings: Readings, targets: int, cycles: float) -> float:
    """Return the probability of readings that bow so much with time, without any bow.

    Parameters
    ----------
    readings : Readings
        The run; the second shape is the distance from the mean position.
    targets : int
        Number of targets. [1]
    cycles : float
        Readings per level, in the mean. [1]

    Returns
    -------
    float
        Of the F test of a parabola of the position that grows with time; 1 where the run is
        too small for it. [1]
    """
    if targets < FEWEST_TARGETS_BOW or cycles < FEWEST_CYCLES_BOW:
        return 1.0
    columns = _drift_columns(readings, cycles)
    without = _regress(readings, columns)
    bow = _bow_columns(readings, _highest(2, cycles))
    bowed = _regress(readings, np.column_stack((columns, bow)))
    return unexplained_share(without.square, bowed.square, bowed.rank - without.rank, bowed.free)


def targets_that_drift_alone(
    readings: Readings, targets: int, cycles: float, *, bow: bool
) -> tuple[int, ...]:
    """Return the targets whose readings drift otherwise than those of the rest.

    Parameters
    ----------
    readings : Readings
        The run; levels are the targets of one approach, then those of the other.
    targets : int
        Number of targets. [1]
    cycles : float
        Readings per level, in the mean. [1]
    bow : bool
        Whether a bow belongs to the drift.

    Returns
    -------
    tuple of int
        Their numbers, from 1: F tests at the 1 % level of the run as a whole (Bonferroni). [1]
    """
    if targets < FEWEST_TARGETS_ALONE:
        return ()
    columns = _drift_columns(readings, cycles)
    if bow:
        columns = np.column_stack((columns, _bow_columns(readings, _highest(3, cycles))))
    base = _regress(readings, columns)
    degree = _highest(2, cycles)
    target = readings.level % targets
    order = np.argsort(target, kind="stable")
    parts = np.split(order, np.cumsum(np.bincount(target, minlength=targets))[:-1])
    alone: list[int] = []
    for number, mine in enumerate(parts, start=1):
        part = Readings(
            value=readings.value[mine],
            level=readings.level[mine],
            time=readings.time[mine],
            shape=readings.shape[:, mine],
            weight=readings.weight[mine],
            levels=readings.levels,
        )
        own = without_levels(part, polynomials(part.time, degree))
        through = base.columns[mine].T @ own
        inverse, more = _inverse(own.T @ own - through.T @ base.inverse @ through)
        right = own.T @ base.residual[mine]
        left = base.square - float(right @ inverse @ right)
        probability = unexplained_share(base.square, left, more, base.free - more)
        if probability * targets < SIGNIFICANCE:
            alone.append(number)
    return tuple(alone)
