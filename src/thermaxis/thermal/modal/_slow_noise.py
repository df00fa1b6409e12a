"""Noise of a displacement: white sensor noise and a slow drift that no input explains.

The drift is a stationary Gauss-Markov series (Ornstein-Uhlenbeck): its correlation falls to 1/e
in the correlation time. Its inverse covariance has three diagonals, so weighting by it costs a
few operations per block, whatever the record's length.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from scipy.linalg import (
    cho_solve_banded,  # pyright: ignore[reportUnknownVariableType]
    cholesky_banded,  # pyright: ignore[reportUnknownVariableType]
)

from thermaxis.thermal._arrays import FloatArray


@final
@dataclass(frozen=True, slots=True)
class SlowNoise:
    """Ratios and speeds of the two correlated parts of the noise."""

    ratio: float
    """Variance of the slow drift over that of the white noise of a full block's mean. [1]"""
    correlation_s: float
    """Time in which the drift's correlation falls to 1/e. [s]"""
    fast_ratio: float = 0.0
    """The same ratio of a faster part: what rounded temperatures leave in the displacement. [1]"""
    fast_correlation_s: float = 1.0
    """Time in which the faster part's correlation falls to 1/e. [s]"""

    @property
    def parts(self) -> tuple[tuple[float, float], ...]:
        """Ratio and correlation time of the parts that there are. [1, s]"""
        both = (
            (self.ratio, self.correlation_s),
            (self.fast_ratio, self.fast_correlation_s),
        )
        return tuple(part for part in both if part[0] > 0)


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
    parts = noise.parts
    if not parts:
        return Products(gram, log_determinant)
    factor, log_drift = _factor(weight, times_s, parts)
    count = len(parts)
    states = np.repeat(weighted, count, axis=0)
    inner = np.asarray(
        cho_solve_banded((factor, False), states, check_finite=False), dtype=np.float64
    )
    gram -= states.T @ inner
    log_determinant += 2.0 * float(np.sum(np.log(factor[-1]))) + log_drift
    return Products((gram + gram.T) / 2.0, log_determinant)


def _factor(
    weight: FloatArray, times_s: FloatArray, parts: tuple[tuple[float, float], ...]
) -> tuple[FloatArray, float]:
    """Return the banded Cholesky factor of the states' precision and the drift's determinant.

    The states of all parts stand side by side, block after block, so that a state meets its
    neighbour in time at a distance of the number of parts.
    """
    count, blocks = len(parts), weight.size
    banded = np.zeros((count + 1, count * blocks))
    log_drift = 0.0
    for place, (ratio, correlation_s) in enumerate(parts):
        keep = np.exp(-np.diff(times_s) / correlation_s)
        innovation = np.maximum(1.0 - keep**2, 1e-12)
        diagonal = np.ones(blocks)
        diagonal[1:] = 1.0 / innovation
        diagonal[:-1] += keep**2 / innovation
        banded[count, place::count] = diagonal / ratio + weight
        banded[0, count + place :: count] = -keep / (innovation * ratio)
        log_drift += blocks * float(np.log(ratio)) + float(np.sum(np.log(innovation)))
    if count == 2:
        # Both parts are seen in the same reading.
        banded[1, 1::2] += weight
    factor = np.asarray(cholesky_banded(banded, check_finite=False), dtype=np.float64)
    return factor, log_drift
