"""Tests of what a run says about its drift: whether it drifts, bows, or drifts at one target only.

All look for the functions of the drift model itself, in noise or beside the fitted drift.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from thermaxis.positioning.drift._smooth_terms import (
    Fit,
    IntArray,
    Readings,
    Sums,
    dense_of,
    generalised_eigenvalues,
    left_by,
    penalty_of,
    rows_at,
    sums_per,
)
from thermaxis.positioning.run import FloatArray

SIGNIFICANCE = 0.01
"""Level of every test. [1]"""
FEWEST_TARGETS_BOW = 5
"""With fewer targets a bow is not looked for. [1]"""
FEWEST_CYCLES_BOW = 3.0
"""With fewer cycles a bow is not looked for. [1]"""
FEWEST_TARGETS_ALONE = 4
"""With fewer targets nobody can say which of them drifts otherwise. [1]"""
_LEAST_DEPARTURE, _STEP = 0.1, 4.0
"""Departures that are tested: the least, and the ratio of neighbours, at which the shortest wave
that counts changes by two. [1]"""
_NEGLIGIBLE = 1e-9
"""Eigenvalues below this share of the largest one count as zero. [1]"""
_LEAST_LEFT = 1e-14
"""Share of the sum of squares that is left at least: the rest is rounding. [1]"""
_MOST_ALIKE = 0.99
"""Members of the family that are less probable to differ from noise count as this. [1]"""
_DEPENDENCE = 1.15
"""Cauchy's combination of dependent probabilities is too small by up to this factor near one
percent, as measured by benchmarks/drift_calibration.py. [1]"""
_HALVINGS = 50
_NEAR_MEAN = 1e-3


def special() -> Any:
    """Return the module without its annotations, which are incomplete."""
    from scipy import special  # noqa: PLC0415 - it takes longer to import than most runs take

    return special


@final
@dataclass(frozen=True, slots=True)
class DriftTest:
    """What a run says for a drift and against it."""

    probability: float
    """Probability of readings that vary so much in time, without any drift. [1]"""
    bayes_factor: float
    """Likelihood of a drift over that of none. [1]"""

    @property
    def found(self) -> bool:
        """Whether the run drifts, at the 1 % level."""
        return self.probability < SIGNIFICANCE


def drift_test(all_sums: Iterable[Sums], largest_departure: float) -> DriftTest:
    """Test whether anything in the run varies with time as the functions of the model do.

    Notes
    -----
    A function f of time with the departure d is a line with a normal rise of variance 12 d² and
    an integrated random walk about it: each has a root mean square of d times the noise. With the
    levels taken out, its splines have the Gram matrix G, the prior precision Q / d² and the right
    side g. With G v = lambda Q v and v'Q v = 1 the likelihood ratio against noise alone is

        log ratio = -1/2 sum of log(1 + d² lambda) - f/2 log(1 - x),
        x = sum of d² (v'g)² / (1 + d² lambda) / sum of squares.

    Without drift x is a ratio of quadratic forms of normal numbers, with known coefficients. Its
    probability is their saddlepoint approximation; those of all functions, departures and times
    are combined by Cauchy's distribution, which needs nothing of how they depend on each other.

    References
    ----------
    R. Lugannani and S. Rice 1980; Y. Liu and J. Xie 2020 (Cauchy combination); from memory.
    """
    steps = 1 + int(np.log(largest_departure / _LEAST_DEPARTURE) / np.log(_STEP))
    square = (_LEAST_DEPARTURE * _STEP ** np.arange(steps)[:, None]) ** 2
    probability: list[FloatArray] = []
    log_ratio: list[FloatArray] = []
    for sums in all_sums:
        free = sums.readings - sums.levels
        total = sums.square - float(sums.level_sum @ np.linalg.solve(sums.normal, sums.level_sum))
        if total <= _LEAST_LEFT * sums.square:
            return DriftTest(probability=1.0, bayes_factor=0.0)
        for c in range(sums.shapes):
            value, score = _spectrum(sums, c)
            share = 1.0 / (1.0 + square * value)
            gain = np.sum(square * share * score, axis=1) / total
            gain = np.clip(gain, _LEAST_LEFT, 1.0 - _LEAST_LEFT)
            ratio = 0.5 * np.sum(np.log(share), axis=1) - 0.5 * free * np.log1p(-gain)
            rest = np.full((steps, 1), float(max(free - value.size, 0)))
            forms = np.hstack((1.0 - share, np.zeros((steps, 1)))) - gain[:, None]
            number = np.hstack((np.ones_like(share), rest))
            probability.append(exceeded(forms, number))
            log_ratio.append(ratio)
    p = np.minimum(np.concatenate(probability), _MOST_ALIKE)
    with np.errstate(divide="ignore", over="ignore"):
        cauchy = float(np.mean(1.0 / np.tan(np.pi * p)))
        bayes_factor = float(np.mean(np.exp(np.concatenate(log_ratio))))
    p_no_drift = min(1.0, _DEPENDENCE * float(np.arctan2(1.0, cauchy)) / np.pi)
    return DriftTest(p_no_drift, bayes_factor)


def _spectrum(sums: Sums, shape: int) -> tuple[FloatArray, FloatArray]:
    """Return the eigenvalues of one function and the squared sums of its readings."""
    every = slice(shape, None, sums.shapes)
    cross = sums.cross[:, every]
    mean = np.linalg.solve(sums.normal, cross)
    gram = dense_of(sums.gram[:: sums.shapes, every]) - cross.T @ mean
    rise = rows_at(sums, np.ones(1), 0.0) / np.sqrt(12.0)
    precision = dense_of(penalty_of(sums.intervals)) + rise.T @ rise
    free = np.ones(cross.shape[1], dtype=bool)
    free[sums.pinned[0] // sums.shapes] = False
    value, vector = generalised_eigenvalues(gram[free][:, free], precision[free][:, free])
    right = (sums.right[every] - sums.level_sum @ mean)[free]
    large = value > _NEGLIGIBLE * value[-1]
    return value[large], (right @ vector[:, large]) ** 2


def exceeded(form: FloatArray, number: FloatArray) -> FloatArray:
    """Return the probability of a positive sum of form times chi-square, for each row.

    Notes
    -----
    With K(t) = -1/2 sum of n log(1 - 2 t e) and its lowest point t: w = sign(t) sqrt(-2 K),
    v = t sqrt(K''), and p = 1 - Phi(w) + phi(w) (1/v - 1/w). Near t = 0 the bracket tends to
    minus the third derivative over 6 K''^(3/2).
    """
    counts = number > 0.0
    form = np.where(counts, form, 0.0)
    low = 0.5 / np.min(form, axis=1, initial=0.0, where=counts)
    high = 0.5 / np.max(form, axis=1, initial=0.0, where=counts)
    t = 0.5 * (low + high)
    own = form
    for _ in range(_HALVINGS):
        own = form / (1.0 - 2.0 * t[:, None] * form)
        rising = np.sum(number * own, axis=1) > 0.0
        low, high = np.where(rising, low, t), np.where(rising, t, high)
        t = np.asarray(0.5 * (low + high), dtype=np.float64)
    second = 2.0 * np.sum(number * own**2, axis=1)
    third = 8.0 * np.sum(number * own**3, axis=1)
    logarithm = np.sum(number * np.log1p(-2.0 * t[:, None] * form), axis=1)
    w = np.sign(t) * np.sqrt(np.maximum(logarithm, 0.0))
    middle = np.abs(w) < _NEAR_MEAN
    with np.errstate(divide="ignore", invalid="ignore"):
        beside = np.asarray(1.0 / (t * np.sqrt(second)) - 1.0 / w)
    beside[middle] = -(third / (6.0 * second**1.5))[middle]
    density = np.exp(-0.5 * w**2) / np.sqrt(2.0 * np.pi)
    normal = np.asarray(special().ndtr(-w), dtype=np.float64)
    return np.clip(normal + density * beside, 0.0, 1.0)


def apart(fitted: Fit, readings: Readings, part: IntArray, shape: FloatArray) -> FloatArray:
    """Return for every part of the readings how probable its own drift is without one.

    The own drift is `shape` times a parabola of time, beside levels and the fitted functions; its
    test is the F test of generalised least squares with the smoothness of the fit.

    Notes
    -----
    With the rows X of the own drift, the residuals r of the fit and its sum of squares S, and the
    part (X'X)' of X'X that levels and functions do not take: g = X'r, gain = g' (X'X)'^-1 g, and
    F = gain / k over (S - gain) / (free - k).
    """
    x = 2.0 * readings.time - 1.0
    rows = [shape * x, shape * (1.5 * x**2 - 0.5)]
    product, score, taken = left_by(fitted, readings, part, rows)
    value, vector = np.linalg.eigh(product - taken)
    large = value > _NEGLIGIBLE * np.trace(product, axis1=1, axis2=2)[:, None]
    along = np.einsum("gkj,gk->gj", vector, score) ** 2
    gain = np.sum(np.where(large, along / np.where(large, value, 1.0), 0.0), axis=1)
    number = np.sum(large, axis=1)
    free = readings.value.size - fitted.level.size - readings.shape.shape[0]
    left = np.maximum(fitted.variance * free - gain, _LEAST_LEFT * fitted.sums.square)
    ratio = gain / np.maximum(number, 1) / (left / np.maximum(free - number, 1))
    p = special().fdtrc(np.maximum(number, 1), np.maximum(free - number, 1), ratio)
    return np.asarray(np.where((number > 0) & (free > number) & (left > 0.0), p, 1.0))


def moved_alone(
    readings: Readings, residual: FloatArray, own: IntArray, parameters: float, known: int
) -> tuple[float, FloatArray, float]:
    """Return what the targets' own movements, of index `own`, leave of the residuals of a fit.

    These are the probability of such movements by chance, the residuals without them, and the
    parameters that they take. Every target has a parabola of time; the functions of the fit, of
    `parameters` with the levels, took `known` of these terms already.
    """
    level, levels, targets = readings.level, readings.levels, int(np.max(own)) + 1
    count = sums_per(level, np.ones(level.size), levels)
    rows: list[FloatArray] = []
    for power in (1, 2):
        row: FloatArray = np.asarray((2.0 * readings.time - 1.0) ** power, dtype=np.float64)
        rows.append(row - (sums_per(level, row, levels) / count)[level])
    product = np.empty((targets, 2, 2))
    for j, k in np.ndindex(2, 2):
        product[:, j, k] = sums_per(own, rows[int(j)] * rows[int(k)], targets)
    right = np.stack([sums_per(own, residual * row, targets) for row in rows], axis=1)
    size = np.einsum("tjk,tk->tj", np.linalg.pinv(product, hermitian=True), right)
    rest = residual - size[own, 0] * rows[0] - size[own, 1] * rows[1]
    number = 2.0 * targets - known
    free = residual.size - parameters - number
    if number <= 0.0 or free <= 0.0:
        return 1.0, residual, 0.0
    left = max(float(readings.weight @ rest**2), _LEAST_LEFT * float(readings.weight @ residual**2))
    gain = float(readings.weight @ residual**2) - left
    ratio = gain / number / (max(left, 1e-300) / free)
    return float(special().fdtrc(number, free, max(ratio, 0.0))), rest, number
