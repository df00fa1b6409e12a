"""Noise of a displacement: white sensor noise and a drift that no input explains.

Its stationary parts are Gauss-Markov series (Ornstein-Uhlenbeck): their correlation falls to 1/e
in the correlation time. Their inverse covariance has three diagonals, so weighting by it costs a
few operations per block, whatever the record's length. What is not stationary (a probe that drifts,
a random walk, what follows the ambient) is a few columns of a basis with a prior, integrated out.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from scipy.linalg import cholesky_banded  # pyright: ignore[reportUnknownVariableType] - no types
from scipy.linalg.lapack import (
    dtbtrs,  # pyright: ignore[reportAttributeAccessIssue, reportUnknownVariableType] - no types
)

from thermaxis.thermal._arrays import FloatArray

WALK_PARTS = 8
"""Parts of a random walk that are kept, the slowest. [1]"""


@final
@dataclass(frozen=True, slots=True)
class SlowNoise:
    """Ratios and speeds of the parts of the noise."""

    ratio: float
    """Variance of the slow drift over that of the white noise of a full block's mean. [1]"""
    correlation_s: float
    """Time in which the drift's correlation falls to 1/e. [s]"""
    fast_ratio: float = 0.0
    """The same ratio of a faster part: what rounded temperatures leave in the displacement. [1]"""
    fast_correlation_s: float = 1.0
    """Time in which the faster part's correlation falls to 1/e. [s]"""
    trend_ratio: float = 0.0
    """The same ratio of a straight line through zero at the first reading, at its end. [1]"""
    walk_ratio: float = 0.0
    """The same ratio of a random walk from the first reading, at its end. [1]"""
    ambient_ratio: float = 0.0
    """The same ratio of what follows the ambient, at unit spread. [1]"""
    reference_ratio: float = 0.0
    """The same ratio of what the ambient's sensor does to all inputs and no rest shows. [1]"""

    @property
    def stationary(self) -> "SlowNoise":
        """The noise without line, walk and ambient."""
        return SlowNoise(self.ratio, self.correlation_s, self.fast_ratio, self.fast_correlation_s)

    @property
    def parts(self) -> tuple[tuple[float, float], ...]:
        """Ratio and correlation time of the parts that there are. [1, s]"""
        both = (
            (self.ratio, self.correlation_s),
            (self.fast_ratio, self.fast_correlation_s),
        )
        return tuple(part for part in both if part[0] > 0)

    def covariance(self, times_s: FloatArray, row_s: float) -> FloatArray:
        """Return the covariance of rows without a known ambient, white noise included, (n, n)."""
        found = np.eye(times_s.size)
        for ratio, correlation_s in self.parts:
            found += ratio * np.exp(-np.abs(times_s[:, None] - times_s) / correlation_s)
        basis = drift_basis(times_s, float(times_s[-1]) + row_s, np.empty((times_s.size, 0)))
        ratios = np.append(self.trend_ratio, np.full(WALK_PARTS, self.walk_ratio))
        return np.asarray(found + (basis * ratios) @ basis.T)


@final
@dataclass(frozen=True, slots=True, eq=False)
class Products:
    """Sums of products under the inverse covariance of the noise, for unit white variance."""

    gram: FloatArray
    """Products of the columns, (p, p)."""
    log_determinant: float
    """Logarithm of the covariance's determinant. [1]"""


def drift_basis(times_s: FloatArray, span_s: float, ambient: FloatArray) -> FloatArray:
    """Return what a drift may follow: a line, a walk, the ambient, (n, 1 + WALK_PARTS + a).

    Notes
    -----
    The slow parts of a random walk from zero of unit variance at the end (Karhunen and Loeve):
    w(t) = sum over k of a_k sqrt(2) sin((k - 1/2) pi t / T) / ((k - 1/2) pi), the a_k independent
    with unit variance. What the parts beyond add is left to the slow drift.
    """
    share = times_s[:, None] / span_s
    rate = np.pi * (np.arange(WALK_PARTS) + 0.5)
    return np.hstack([share, np.sqrt(2.0) * np.sin(share * rate) / rate, ambient])


def with_drift(joint: Products, columns: int, noise: SlowNoise) -> Products:
    """Return the products of the first columns, what the others do being part of the noise.

    Notes
    -----
    With B the basis, R the diagonal of ratios and K the covariance without these parts,
    (K + B R B')^-1 = K^-1 - K^-1 B M^-1 B' K^-1 and |K + B R B'| = |K| |R| |M|,
    M = R^-1 + B' K^-1 B.
    """
    ratios = np.full(joint.gram.shape[0] - columns, noise.reference_ratio)
    ratios[:1] = noise.trend_ratio
    ratios[1 : 1 + WALK_PARTS] = noise.walk_ratio
    ratios[1 + WALK_PARTS : 2 + WALK_PARTS] = noise.ambient_ratio
    kept = columns + np.flatnonzero(ratios > 0)
    ratios = ratios[ratios > 0]
    cross = joint.gram[kept, :columns]
    middle = joint.gram[np.ix_(kept, kept)] + np.diag(1.0 / ratios)
    _, log_middle = np.linalg.slogdet(middle)
    less = cross.T @ np.linalg.solve(middle, cross)
    gram = joint.gram[:columns, :columns] - (less + less.T) / 2.0
    log_determinant = joint.log_determinant + float(log_middle) + float(np.sum(np.log(ratios)))
    return Products(gram, log_determinant)


@final
class Weighing:
    """Products of a segment's columns under one stationary noise after the other.

    Notes
    -----
    With D the white part and Q the inverse covariance of the drift, which has three diagonals, the
    inverse is D^-1 - D^-1 (Q + D^-1)^-1 D^-1. What follows a basis is no part of it (`with_drift`).

    References
    ----------
    Rasmussen and Williams 2006, appendix A.3 (matrix inversion lemma) and B (Markov processes).
    """

    def __init__(
        self, columns: FloatArray, white_variance: FloatArray, times_s: FloatArray
    ) -> None:
        self._weight, self._times_s = 1.0 / white_variance, times_s
        weighted = columns * self._weight[:, None]
        self._white = Products(columns.T @ weighted, float(np.sum(np.log(white_variance))))
        self._transposed = np.ascontiguousarray(weighted.T)

    def products(self, noise: SlowNoise) -> Products:
        """Return the products of the columns under the inverse covariance of the noise."""
        drifts = noise.parts
        if not drifts:
            return self._white
        factor, log_drift = _factor(self._weight, self._times_s, drifts)
        states = np.repeat(self._transposed, len(drifts), axis=1).T
        # With U'U = Q + D^-1, X' (U'U)^-1 X is the square of U'^-1 X.
        whitened = np.asarray(
            dtbtrs(factor, states, uplo="U", trans="T", overwrite_b=True)[0], dtype=np.float64
        )
        gram = self._white.gram - whitened.T @ whitened
        log_determinant = 2.0 * float(np.sum(np.log(factor[-1]))) + log_drift
        return Products((gram + gram.T) / 2.0, self._white.log_determinant + log_determinant)


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
