"""Weigh the levels of a run where some scatter more than others."""

import numpy as np

from thermaxis.positioning.drift._drift_tests import SIGNIFICANCE, special
from thermaxis.positioning.drift._smooth_terms import IntArray, sums_per
from thermaxis.positioning.run import FloatArray

_FEWEST_FREE = 2.0
"""Degrees of freedom that every level must have. [1]"""
_LEAST_SHARE = 1e-12
"""Share of the sum of squares below which a variance is rounding. [1]"""
_ROUNDED = 1.0 / 6.0
"""Least variance of a level of rounded readings, in squares of the rounding: with few readings
all may be alike. [1]"""


def _inverse_trigamma(value: float) -> float:
    """Return x with trigamma(x) = value, by Newton's method on its reciprocal."""
    polygamma = special().polygamma
    x = 0.5 + 1.0 / value
    for _ in range(50):
        trigamma = float(polygamma(1, x))
        step = trigamma * (1.0 - trigamma / value) / float(polygamma(2, x))
        x += step
        if abs(step) < 1e-10 * x:
            break
    return x


def _scatter_alike(variance: FloatArray, free: FloatArray) -> bool:
    """Return whether chance explains how the variances differ, by Bartlett's test."""
    pooled = float(np.sum(variance * free) / np.sum(free))
    statistic = float(np.sum(free * np.log(pooled / variance)))
    correction = float(np.sum(1.0 / free) - 1.0 / np.sum(free)) / (3.0 * (free.size - 1.0))
    probability = float(special().chdtrc(free.size - 1, statistic / (1.0 + correction)))
    return probability > SIGNIFICANCE


def moderated_variances(variance: FloatArray, free: FloatArray) -> FloatArray:
    """Draw variances towards their common value by as much as chance explains.

    References
    ----------
    G. K. Smyth 2004, section 6.2 (fit of a scaled F distribution by its logarithm), from memory.
    """
    digamma, polygamma = special().digamma, special().polygamma
    half = free / 2.0
    z = np.log(variance) - np.asarray(digamma(half), dtype=np.float64) + np.log(half)
    chance = np.asarray(polygamma(1, half), dtype=np.float64)
    excess = float(np.var(z, ddof=1)) - float(np.mean(chance))
    if excess <= 0.0:
        return np.full_like(variance, np.sum(variance * free) / np.sum(free))
    prior = 2.0 * _inverse_trigamma(excess)
    centre = np.exp(float(np.mean(z)) + float(digamma(prior / 2.0)) - np.log(prior / 2.0))
    return (prior * centre + free * variance) / (prior + free)


def weights_of_levels(
    level: IntArray,
    residual: FloatArray,
    levels: int,
    drift_parameters: float,
    resolution: float = 0.0,
) -> FloatArray:
    """Return a weight per level, inverse to its variance, or ones where all scatter alike."""
    alike = np.ones(levels)
    count = sums_per(level, np.ones(residual.size), levels)
    free = count * (1.0 - drift_parameters / residual.size) - 1.0
    square = sums_per(level, residual**2, levels)
    total = float(np.sum(square))
    if levels < 2 or np.min(free) < _FEWEST_FREE or total <= 0.0:
        return alike
    variance = np.maximum(square / free, max(_LEAST_SHARE * total, _ROUNDED * resolution**2))
    if _scatter_alike(variance, free):
        return alike
    return float(variance @ free / np.sum(free)) / moderated_variances(variance, free)
