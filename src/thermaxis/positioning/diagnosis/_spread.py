"""Targets that scatter more than the others."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import numpy as np

from thermaxis.positioning.diagnosis._levels import FEWEST_TARGETS, SPREAD_LEVEL, f_tail
from thermaxis.positioning.run import BACKWARD, FORWARD, FloatArray, PositioningTest
from thermaxis.positioning.standard import find_spread_anomalies

if TYPE_CHECKING:
    from thermaxis.positioning.drift import DriftResult


def _without_means(deviation: FloatArray) -> FloatArray:
    """Return independent contrasts of the complete cycles of one approach, (m, n - 1)."""
    complete = deviation[:, ~np.any(np.isnan(deviation), axis=0)]
    n = complete.shape[1]
    if n < 2:
        return np.empty((deviation.shape[0], 0))
    basis, _ = np.linalg.qr(np.column_stack((np.ones(n), np.eye(n)[:, 1:])))
    return complete @ basis[:, 1:]


@final
@dataclass(frozen=True, slots=True)
class _Spread:
    target: int
    """Index of the target. [1]"""
    std: float
    """Standard deviation of its readings. [µm or arcsec]"""
    ratio: float
    """Spread here over that of the other targets, drift left out. [1]"""
    p_value: float
    """All targets counted. [1]"""


def _squares(deviation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return sums of squares about the means and degrees of freedom per target, (m,) each."""
    count = np.sum(~np.isnan(deviation), axis=1)
    mean = np.nansum(deviation, axis=1) / np.maximum(count, 1)
    square = np.nansum((deviation - mean[:, None, :]) ** 2, axis=(1, 2))
    free = np.sum(np.maximum(count - 1.0, 0.0), axis=1)
    return np.asarray(square, dtype=np.float64), np.asarray(free, dtype=np.float64)


def spreads_without_drift(drift: "DriftResult") -> list[_Spread]:
    """Compare the largest spread with that of the other targets, drift taken out.

    Where all scatter alike, the ratio of their variances is distributed as F (the share of one
    in all of them as beta: Cochran 1941). The largest is left out and the rest tested again.
    """
    square, free = _squares(drift.deviation)
    free = free * (1.0 - drift.drift_parameters / max(float(np.sum(free)), 1.0))
    kept = np.flatnonzero(free > 0.0)
    found: list[_Spread] = []
    while kept.size >= FEWEST_TARGETS:
        own, own_free = square[kept], free[kept]
        rest, rest_free = np.sum(own) - own, np.sum(own_free) - own_free
        if float(np.min(rest)) <= 0.0 or float(np.min(own_free)) < 1.0:
            break
        ratio = own / own_free / (rest / rest_free)
        tail = np.array([f_tail(*f) for f in zip(ratio, own_free, rest_free, strict=True)])
        worst = int(np.argmin(tail))
        p_value = float(tail[worst]) * kept.size
        if p_value >= SPREAD_LEVEL:
            break
        std = float(np.sqrt(own[worst] / own_free[worst]))
        others = float(np.sqrt(rest[worst] / rest_free[worst]))
        found.append(_Spread(int(kept[worst]), std, std / others, p_value))
        kept = np.delete(kept, worst)
    return found


def spreads_with_drift(test: PositioningTest) -> list[_Spread]:
    """Compare local deviations, in which the drift hardly enters; both approaches in one test."""
    contrasts = np.hstack([_without_means(test.deviation[:, :, a]) for a in (FORWARD, BACKWARD)])
    named = find_spread_anomalies(test.target, contrasts, level=SPREAD_LEVEL)
    square, free = _squares(test.deviation)
    with np.errstate(divide="ignore", invalid="ignore"):
        std = np.sqrt(square / free)
    found: list[_Spread] = []
    for k, anomaly in enumerate(named):
        i, tested = anomaly.position - 1, test.target.size - k
        found.append(_Spread(i, float(std[i]), anomaly.statistic, anomaly.p_value * tested))
    return found
