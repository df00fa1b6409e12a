"""Noise of a displacement: white sensor noise and a slow drift that no input explains.

The drift is a stationary Gauss-Markov series (Ornstein-Uhlenbeck): its correlation falls to 1/e
in the correlation time. Its inverse covariance has three diagonals, so weighting by it costs a
few operations per block, whatever the record's length.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from thermaxis.thermal._field import FloatArray


@final
@dataclass(frozen=True, slots=True)
class SlowNoise:
    """Ratio and speed of the slow part of the noise."""

    ratio: float
    """Variance of the slow drift over that of the white noise of one reading. [1]"""
    correlation_s: float
    """Time in which the drift's correlation falls to 1/e. [s]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Products:
    """Sums of products under the inverse covariance of the noise, for unit white variance."""

    gram: FloatArray
    """Products of the columns, (p, p)."""
    log_determinant: float
    """Logarithm of the covariance's determinant. [1]"""


def weighted_products(
    columns: FloatArray, white_variance: FloatArray, times_s: FloatArray, noise: SlowNoise
) -> Products:
    """Return the products of columns under the inverse covariance of one segment's noise.

    Parameters
    ----------
    columns : FloatArray
        Regressors and displacement at the measured blocks of one segment, (n, p).
    white_variance : FloatArray
        Variance of the white noise of every block, as a multiple of that of one reading, (n,). [1]
    times_s : FloatArray
        Times of the blocks, (n,). [s]
    noise : SlowNoise
        The slow part.

    Returns
    -------
    Products
        Under the inverse of D + ratio C, D diagonal and C of a Gauss-Markov series.

    Notes
    -----
    With D the white part and Q the inverse covariance of the drift, which has three diagonals, the
    inverse is D^-1 - D^-1 (Q + D^-1)^-1 D^-1.

    References
    ----------
    Rasmussen and Williams 2006, appendix A.3 (matrix inversion lemma) and B (Markov processes).
    """
    weight = 1.0 / white_variance
    weighted = columns * weight[:, None]
    gram = columns.T @ weighted
    log_determinant = float(np.sum(np.log(white_variance)))
    if noise.ratio <= 0:
        return Products(gram, log_determinant)
    keep = np.exp(-np.diff(times_s) / noise.correlation_s)
    innovation = np.maximum(1.0 - keep**2, 1e-12)
    banded = np.zeros((2, weight.size))
    banded[1] = 1.0
    banded[1, 1:] = 1.0 / innovation
    banded[1, :-1] += keep**2 / innovation
    banded[0, 1:] = -keep / innovation
    banded /= noise.ratio
    banded[1] += weight
    factor = cholesky_banded(banded, check_finite=False)
    gram -= weighted.T @ cho_solve_banded((factor, False), weighted, check_finite=False)
    log_determinant += 2.0 * float(np.sum(np.log(factor[1])))
    log_determinant += weight.size * float(np.log(noise.ratio)) + float(np.sum(np.log(innovation)))
    return Products((gram + gram.T) / 2.0, log_determinant)
