"""Poles as their distances from one, so that slow ones keep their digits."""

from math import comb, fsum
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from thermaxis.thermal._field import FloatArray

ComplexArray: TypeAlias = NDArray[np.complex128]

_POLISHING_STEPS = 4


def _about_one(coefficients: FloatArray) -> FloatArray:
    """Return the polynomial in w = 1 - z of one in falling powers of z, rising powers of w.

    Slow poles are small numbers in w, so they keep their digits.
    """
    m = coefficients.size - 1
    return np.array(
        [
            (-1.0) ** k * fsum(float(coefficients[i]) * comb(m - i, k) for i in range(m - k + 1))
            for k in range(m + 1)
        ]
    )


def distances_from_one(coefficients: FloatArray) -> ComplexArray:
    """Return one minus each root of a polynomial, to full relative precision near one.

    Parameters
    ----------
    coefficients : FloatArray
        Coefficients of a polynomial in falling powers of z, the first one not zero, (m + 1,). [any]

    Returns
    -------
    ComplexArray
        1 - z for every root z, (m,), slowest first. [1]
    """
    shifted = _about_one(np.asarray(coefficients, dtype=np.float64))
    roots = np.asarray(np.roots(shifted[::-1]), dtype=np.complex128)
    slope = np.polynomial.polynomial.polyder(shifted)
    for _ in range(_POLISHING_STEPS):
        value = np.polynomial.polynomial.polyval(roots, shifted)
        gradient = np.polynomial.polynomial.polyval(roots, slope)
        step = np.divide(value, gradient, out=np.zeros_like(value), where=gradient != 0)
        near = np.abs(step) <= 1e-3 * np.abs(roots)  # a multiple root is left as it is
        roots = roots - np.where(near, step, 0.0)
    real = np.abs(roots.imag) <= 1e-14 * np.abs(roots)
    roots = np.where(real, roots.real + 0j, roots)
    return roots[np.argsort(np.abs(roots), kind="stable")]
