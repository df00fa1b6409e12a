"""Poles as their distances from one, so that slow ones keep their digits."""

from functools import lru_cache
from math import comb, fsum
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from thermaxis.thermal._arrays import FloatArray

ComplexArray: TypeAlias = NDArray[np.complex128]

LEAST_LOG_RATIO = 0.2
"""Logarithm of the ratio of neighbouring time constants below which two lags are one: with large
gains of opposite sign they would make a derivative. [1]"""
_POLISHING_STEPS = 4
_REMEMBERED = 64


def _about_one(coefficients: tuple[float, ...]) -> list[float]:
    """Return the polynomial in w = 1 - z of one in falling powers of z, rising powers of w.

    Slow poles are small numbers in w, so they keep their digits.
    """
    m = len(coefficients) - 1
    return [
        (-1.0) ** k * fsum(coefficients[i] * comb(m - i, k) for i in range(m - k + 1))
        for k in range(m + 1)
    ]


def _polished(root: complex, shifted: list[float]) -> complex:
    """Return a root after a few steps of Newton; a multiple root is left as it is."""
    for _ in range(_POLISHING_STEPS):
        value, slope = 0j, 0j
        for coefficient in reversed(shifted):
            slope = slope * root + value
            value = value * root + coefficient
        if slope == 0:
            break
        step = value / slope
        if abs(step) > 1e-3 * abs(root):
            break
        root -= step
    return complex(root.real) if abs(root.imag) <= 1e-14 * abs(root) else root


@lru_cache(maxsize=_REMEMBERED)
def _distances(coefficients: tuple[float, ...]) -> ComplexArray:
    shifted = _about_one(coefficients)
    if len(shifted) == 2:
        roots = np.array([-shifted[0] / shifted[1]], dtype=np.complex128)
    else:
        found = np.asarray(np.roots(shifted[::-1]), dtype=np.complex128)
        roots = np.array([_polished(complex(w), shifted) for w in found], dtype=np.complex128)
    roots = roots[np.argsort(np.abs(roots), kind="stable")]
    roots.setflags(write=False)
    return roots


def distances_from_one(coefficients: FloatArray) -> ComplexArray:
    """Return one minus each root of a polynomial, to full relative precision near one."""
    return _distances(tuple(float(c) for c in coefficients))


def lags_among(distances: ComplexArray) -> NDArray[np.bool_]:
    """Return which poles are first-order lags: real, between zero and one."""
    return (distances.imag == 0.0) & (distances.real > 0.0) & (distances.real < 1.0)


def only_lags(denominator: FloatArray) -> bool:
    """Whether every pole of a denominator is a first-order lag."""
    return denominator.size == 1 or bool(np.all(lags_among(distances_from_one(denominator))))
