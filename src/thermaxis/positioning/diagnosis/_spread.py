"""Targets that scatter more than the others."""

from dataclasses import dataclass
from math import erf, sqrt
from typing import TYPE_CHECKING, final

import numpy as np

from thermaxis.positioning.diagnosis._levels import FEWEST_TARGETS, LEVEL, SPREAD_LEVEL, f_tail
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


def within_one_step(test: PositioningTest, target: int) -> bool:
    """Say whether the readings of a target lie in two neighbouring steps of the display."""
    readings = test.deviation[target]
    apart = np.nanmax(readings, axis=0, initial=-np.inf) - np.nanmin(
        readings, axis=0, initial=np.inf
    )
    return bool(np.max(apart) < 1.5 * test.resolution)


def frozen_targets(test: PositioningTest) -> list[tuple[int, float, float]]:
    """Return targets that repeat exactly, the others' standard deviation and the probability.

    With the step q and the standard deviation s of the others a reading falls into the same step
    as the others of its target with at most erf(q / (2 sqrt(2) s)).
    """
    square, free = _squares(test.deviation)
    others = float(np.median(np.sqrt(square[free > 0.0] / free[free > 0.0]))) if free.any() else 0.0
    if others == 0.0:
        return []
    alike = erf(max(test.resolution, 1e-6) / (2.0 * sqrt(2.0) * others))
    found = [(int(i), test.target.size * alike ** float(free[i])) for i in np.flatnonzero(free)]
    return [(i, others, p) for i, p in found if square[i] < 1e-12 and p < LEVEL]


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
