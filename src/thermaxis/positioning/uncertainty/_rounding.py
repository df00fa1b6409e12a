"""What the rounding of the readings does to means and standard deviations.

A reading x that is rounded to a multiple of the step q has the error, with x uniform within steps,

    e(x) = (q / pi) sum over k of (-1)^k sin(2 pi k x / q) / k,    variance q^2 / 12

(GUM 4.3.7 with half widths of q / 2). Of two readings of one level, with noise of the standard
deviation sigma and the drifts d and d', the errors have the covariance

    c = (q^2 / 2 pi^2) sum over k of exp(-(2 pi k sigma / q)^2) cos(2 pi k (d - d') / q) / k^2

which is q^2 / 12 without noise and drift: the readings of a target are then all rounded alike, and
their mean is wrong by as much as one of them. Where noise or drift is a third of the step or more,
c is nearly zero. The variance (n - 1) of the readings is sigma^2 + q^2 / 12 - c.
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.positioning.run import FloatArray

_ORDER = np.arange(1.0, 61.0)[:, None]
_SHARE = _ORDER**-2 / np.sum(_ORDER**-2)


@final
@dataclass(frozen=True, slots=True, eq=False)
class Rounding:
    """Rounding of the readings of one run."""

    step: float
    """[µm or arcsec]"""
    alike: FloatArray
    """Mean of cos(2 pi k (d - d') / q) over all pairs of readings of each level, (K, L). [1]"""

    @property
    def variance(self) -> float:
        """Variance of the error of one reading."""
        return self.step**2 / 12.0

    def _in_common(self, std: FloatArray, alike: FloatArray) -> FloatArray:
        decay = np.exp(-((2.0 * np.pi / self.step * _ORDER * std) ** 2))
        return self.variance * np.sum(_SHARE * decay * alike, axis=0)

    def of_mean(self, seen: FloatArray) -> FloatArray:
        """Return the variance of the error of each level that its readings share, (L,).

        `seen` are their variances (n - 1).
        """
        shared = self._in_common(np.sqrt(seen - self.in_scatter(seen)), self.alike)
        return np.maximum(shared, 0.0)  # a drift may turn the error round: no help is counted on

    def in_scatter(self, seen: FloatArray) -> FloatArray:
        """Return the part of variances (n - 1) of readings that is rounding."""
        std = self.step * np.geomspace(1e-3, 3.0, 300)
        part = self.variance - self._in_common(std, np.mean(self.alike, axis=1, keepdims=True))
        return np.minimum(np.interp(seen, std**2 + part, part), seen)

    def told_together(
        self, variance: FloatArray, free: FloatArray, readings: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return variances and their degrees of freedom with those averaged that tell little.

        Where readings lie within one step, how they scatter says where between two steps the level
        is rather than how large the noise is. How much their mean tells follows from how much they
        differ.
        """
        within = free * variance <= (0.25 + 1e-6) * self.step**2 * readings
        number = int(np.sum(within))
        if number < 2:
            return variance, free
        least = self.step**2 / float(np.sum(readings[within]))  # one reading in the next step
        mean = max(float(np.mean(variance[within])), least)
        tells = 2.0 * mean**2 / max(float(np.var(variance[within], ddof=1)), 1e-300)
        variance, free = variance.copy(), free.copy()
        variance[within] = mean
        free[within] = np.minimum(free[within], tells)
        return variance, free


def rounding_of(step: float, drift: FloatArray) -> Rounding | None:
    """Return the rounding of readings with these drifts, (L, n), NaN where one is missing."""
    if step == 0.0:
        return None
    there = ~np.isnan(drift)
    count = np.maximum(np.sum(there, axis=1), 2.0)
    turn = np.exp(2j * np.pi / step * _ORDER[..., None] * np.where(there, drift, 0.0)) * there
    square = np.abs(np.sum(turn, axis=2)) ** 2
    return Rounding(step, (square - count) / (count * (count - 1.0)))
