"""Find noise that is correlated in time, such as turbulent air or a swing too fast to follow."""

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from thermaxis.positioning.drift._smooth_terms import (
    Correlation,
    Readings,
    fit,
    penalty_of,
    residual_of,
    sums_of,
)
from thermaxis.positioning.drift._smoothness import LEAST_DEPARTURE, Average

_LEAST_SIGHT = (-1.5, 1.5)
"""Correlation of successive residuals, in standard deviations, from which the noise may be
correlated: beside a curve, which may have followed it, and beside a line. [1]"""
_LEAST_CORRELATION = 0.04
"""Correlation of successive residuals that matters, beyond that. [1]"""
LEAST_GAIN, LEAST_GAIN_SAID = 2.0, 5.0
"""Gains from which correlated noise is part of the model, and from which it is named: about one
run in twenty and one in a hundred with independent noise reach them, as measured."""
_LENGTHS = (2.0, 4.0, 8.0, 16.0)
"""Correlation times that are tried, in units of the time between readings. [1]"""
_RATIOS = (0.25, 0.5, 2.0, 4.0)
"""Variances of the correlated part over that of the rest that are tried, beside one. [1]"""
_STEP = 4.0
"""Ratio of neighbouring departures that are tried. [1]"""


@final
@dataclass(frozen=True, slots=True)
class _Tried:
    correlation: Correlation
    criterion: float


def find_correlation(readings: Readings, average: Average) -> Correlation | None:
    """Return the correlation of the noise, or None where the readings show none.

    Its time and ratio are those of the highest restricted likelihood on a cross of a grid, each
    with the likeliest departure of a(t).
    """
    sums, size = average.best.sums, readings.value.size
    order = np.argsort(readings.time, kind="stable")
    residual = residual_of(average.best, readings)[order]
    step = float(np.median(np.diff(readings.time[order])))
    least = _LEAST_CORRELATION + _LEAST_SIGHT[average.line_is_enough] / np.sqrt(size)
    if step == 0.0 or residual[1:] @ residual[:-1] <= least * (residual @ residual):
        return None
    penalty = penalty_of(sums.intervals)

    def tried(length: float, ratio: float) -> _Tried:
        correlation = Correlation(length=length * step, ratio=ratio)
        alike = replace(readings, correlation=correlation)
        own = sums_of(alike, sums.intervals, sums.warm_up, sums.plain)
        departure = average.best_departure.copy()
        lowest = np.inf
        while departure[0] > LEAST_DEPARTURE / _STEP:
            lowest = min(lowest, fit(own, penalty, departure).criterion)
            departure[0] /= _STEP
        return _Tried(correlation, lowest)

    best = min((tried(length, 1.0) for length in _LENGTHS), key=lambda t: t.criterion)
    length = best.correlation.length / step
    best = min([best, *(tried(length, r) for r in _RATIOS)], key=lambda t: t.criterion)
    gain = average.best.criterion - best.criterion
    return replace(best.correlation, gain=gain) if gain > LEAST_GAIN else None
