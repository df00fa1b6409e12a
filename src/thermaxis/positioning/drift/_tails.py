"""Tell noise with heavy tails from normal noise, and state its scale."""

import numpy as np

from thermaxis.positioning.drift._drift_tests import special
from thermaxis.positioning.drift._smooth_terms import IntArray, sums_per
from thermaxis.positioning.run import FloatArray

LEAST_GAIN = 5.0
"""Gain of heavy tails over normal noise that one run in a hundred with normal noise has."""
_FREEDOMS = np.array([1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 7.0, 10.0, 15.0, 30.0])
"""Degrees of freedom of Student's t that are tried. [1]"""
_MOST = 2000
"""Residuals that are looked at; of more of them, so many quantiles. [1]"""
_ITERATIONS = 30
_TINY = 1e-300


def _scales(square: FloatArray, freedom: FloatArray) -> FloatArray:
    """Return the likeliest scale of t-distributed residuals for each number of freedom.

    Notes
    -----
    scale² = mean of (n + 1) r² / (n + r² / scale²), by repetition.
    """
    n, scale = freedom[:, None], np.full((freedom.size, 1), float(np.median(square)))
    for _ in range(_ITERATIONS):
        scale = np.mean((n + 1.0) * square / (n + square / scale), axis=1, keepdims=True)
        scale = np.maximum(scale, _TINY)
    return scale[:, 0] ** 0.5


def tails_of(residual: FloatArray) -> tuple[float, float]:
    """Return the gain of heavy tails and the freedom of the likeliest t distribution.

    The gain is twice the logarithm of its likelihood over that of normal noise.
    """
    square = np.sort(residual**2)[:: -(-residual.size // _MOST)]
    square = square[square > 0.0]
    scale, n = _scales(square, _FREEDOMS), _FREEDOMS
    gammaln, half = special().gammaln, 0.5 * (n + 1.0)
    constant = gammaln(half) - gammaln(0.5 * n) - 0.5 * np.log(0.5 * n) - np.log(scale)
    density = constant - half * np.mean(np.log1p(square / (n * scale**2)[:, None]).T, axis=0)
    gain = 2.0 * residual.size * (density + 0.5 + 0.5 * np.log(np.mean(square)))
    best = int(np.argmax(gain))
    return float(gain[best]), float(n[best])


def robust_std(residual: FloatArray, left: FloatArray, level: IntArray, freedom: float) -> float:
    """Return the robust standard deviation: that of normal noise with the same quartiles.

    Every level is centred anew by the likelihood of the t distribution: what disturbs its mean
    moves all of its residuals. `left` is what a fit leaves of each reading.
    """
    size, n = int(np.max(level)) + 1, np.array([freedom])
    centred = residual
    for _ in range(_ITERATIONS):
        scale = float(_scales(centred**2, n)[0])
        weight = (freedom + 1.0) / (freedom + (centred / scale) ** 2)
        total = np.maximum(sums_per(level, weight, size), _TINY)
        centred = residual - (sums_per(level, weight * residual, size) / total)[level]
    scale = float(_scales(centred**2 / left, n)[0])
    return scale * float(special().stdtrit(freedom, 0.75) / special().ndtri(0.75))
