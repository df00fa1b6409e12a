"""Average fits of a run over the smoothness that its drift may have.

How smooth a drift is, a run tells only roughly. So it is not chosen: every smoothness counts with
its restricted likelihood as weight, and the bands hold the differences between the fits as well.
The prior is flat: on the logarithm of the departure from a straight line, and over five times
in which the functions may be smooth, from plain time to one that runs four hundred times faster at
the start, as a warming does.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias, final

import numpy as np

from thermaxis.positioning.drift._smooth_terms import (
    Fit,
    Readings,
    Sums,
    drift_of,
    fit,
    functions_at,
    levels_at,
    parameters_of,
    penalty_of,
    rows_at,
    solved,
    variances_at,
)
from thermaxis.positioning.run import FloatArray

TIMES = ((0.0, 1.0), (1600.0, 0.9), (20.0, 0.0), (100.0, 0.0), (400.0, 0.0))
"""Times that are averaged over, as warm-up and share of plain time: plain, plain with a quick
start, and logarithmic. A time that runs so much faster at the start resolves time constants down
to about the run over this number. [1]"""
PLAIN_TIME = ((0.0, 1.0),)
"""Plain time alone. [1]"""
LEAST_DEPARTURE = 0.02
"""Prior root mean square departure from a straight line, in units of the noise, below which it
cannot be seen. [1]"""
_STEP = 3000.0**0.1
"""Ratio of neighbouring departures. [1]"""
LINE_CRITERION = 4.0
"""Restricted likelihood ratio (minus twice the logarithm) below which a straight line is kept:
about the 95 % point with two variances at their border. [1]"""
_NEGLIGIBLE = 12.0
"""A smoothness whose criterion is this much larger has a weight of a four-hundredth. [1]"""
_COARSE = 5
"""The search starts on a grid of every fifth departure. [1]"""

_Cell: TypeAlias = tuple[int, int, int]
"""Departure of a, departure of the other functions, and time, as indices."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Average:
    """Fits of different smoothness with their weights."""

    fits: tuple[Fit, ...]
    weight: FloatArray
    """Their weights, one in sum. [1]"""
    line: Fit
    """The fit that is practically a straight line."""
    line_is_enough: bool
    """Whether nothing more than a line is supported."""
    best: Fit
    best_departure: FloatArray
    """Its departures, (C,). [1]"""
    evidence: float
    """Minus twice the logarithm of the restricted likelihood, all smoothness together."""


def largest_departure(intervals: int) -> float:
    """Return the departure that follows whatever a run does; more swings pass in a longer run."""
    return 60.0 * max(1.0, intervals / 60.0) ** 2


class _Search:
    """Fits by their cell, each made once."""

    def __init__(self, all_sums: Sequence[Sums]) -> None:
        largest = largest_departure(all_sums[0].intervals)
        steps = round(math.log(largest / LEAST_DEPARTURE) / math.log(_STEP))
        self.departures = [LEAST_DEPARTURE * _STEP**k for k in range(steps + 1)]
        self.known: dict[_Cell, Fit] = {}
        self._spread: set[_Cell] = set()
        self._sums = all_sums
        self._penalty = penalty_of(all_sums[0].intervals)

    def departure(self, cell: _Cell) -> FloatArray:
        others = [self.departures[cell[1]]] * (self._sums[0].shapes - 1)
        return np.array([self.departures[cell[0]], *others])

    def fit(self, cell: _Cell) -> None:
        inside = 0 <= cell[0] < len(self.departures) and 0 <= cell[1] < len(self.departures)
        if inside and cell not in self.known:
            self.known[cell] = fit(self._sums[cell[2]], self._penalty, self.departure(cell))

    def likely(self) -> list[_Cell]:
        lowest = min(fitted.criterion for fitted in self.known.values())
        return [c for c, f in self.known.items() if f.criterion < lowest + _NEGLIGIBLE]

    def spread(self) -> bool:
        """Fit the neighbours of what is likely; return whether there were new ones."""
        before = len(self.known)
        fresh = [cell for cell in self.likely() if cell not in self._spread]
        self._spread.update(fresh)
        for a, b, time in fresh:
            for cell in ((a + 1, b, time), (a - 1, b, time), (a, b + 1, time), (a, b - 1, time)):
                self.fit(cell)
            for other in range(len(self._sums)):
                self.fit((a, b, other))
        return len(self.known) > before


def average_over_smoothness(all_sums: Sequence[Sums]) -> Average:
    """Fit a run with every smoothness that matters, in every time whose sums are given."""
    search = _Search(all_sums)
    coarse = range(0, len(search.departures), _COARSE)
    for a in coarse:
        for b in coarse:
            search.fit((a, b, 0))
    while search.spread():
        pass
    kept = search.likely()
    fits = tuple(search.known[cell] for cell in kept)
    criterion = np.array([fitted.criterion for fitted in fits])
    lowest = int(np.argmin(criterion))
    weight = np.exp(-0.5 * (criterion - criterion[lowest]))
    line = search.known[0, 0, 0]
    return Average(
        fits=fits,
        weight=weight / np.sum(weight),
        line=line,
        line_is_enough=bool(line.criterion < criterion[lowest] + LINE_CRITERION),
        best=fits[lowest],
        best_departure=search.departure(kept[lowest]),
        evidence=float(criterion[lowest] - 2.0 * np.log(np.sum(weight))),
    )


def effective_parameters(average: Average) -> float:
    """Return the effective number of parameters, levels too, at the likeliest smoothness."""
    if average.line_is_enough:
        sums = average.line.sums
        return float(sums.level_sum.size + sums.shapes)
    sums = average.best.sums
    more = parameters_of(sums, penalty_of(sums.intervals), average.best_departure)
    return sums.level_sum.size + more


@final
@dataclass(frozen=True, slots=True, eq=False)
class Reported:
    """Fits whose weighted sum is the drift that is reported; none where there is no drift."""

    fits: tuple[Fit, ...]
    """One for each time, with the mean splines and steps; or the line alone."""
    weight: tuple[float, ...]
    """Their weights, one in sum. [1]"""

    def drift(self, readings: Readings, reference: float) -> FloatArray:
        """Return the drift of every reading relative to a reference time, (N,)."""
        drift = np.zeros(readings.value.size)
        for weight, fitted in zip(self.weight, self.fits, strict=True):
            drift += weight * drift_of(fitted, readings, reference)
        return drift

    def functions(self, shapes: int, time: FloatArray, reference: float) -> FloatArray:
        """Return the functions of time relative to a reference time, (C, T)."""
        value = np.zeros((shapes, time.size))
        for weight, fitted in zip(self.weight, self.fits, strict=True):
            value += weight * functions_at(fitted, rows_at(fitted.sums, time, reference))
        return value


NO_DRIFT = Reported((), ())
"""What is reported of a run that does not drift."""


def reported(average: Average) -> Reported:
    """Return the mean of the fits, or the line alone where it is enough."""
    if average.line_is_enough:
        return Reported((average.line,), (1.0,))
    fits: list[Fit] = []
    weights: list[float] = []
    for sums in {id(fitted.sums): fitted.sums for fitted in average.fits}.values():
        own = [(w, f) for w, f in zip(average.weight, average.fits, strict=True) if f.sums is sums]
        weight = float(sum(w for w, _ in own))
        spline = np.asarray(sum(w * f.spline for w, f in own), dtype=np.float64) / weight
        level = np.asarray(sum(w * f.level for w, f in own), dtype=np.float64) / weight
        fits.append(replace(own[0][1], spline=spline, level=level))
        weights.append(weight)
    return Reported(tuple(fits), tuple(weights))


def _rows(average: Average, time: FloatArray, reference: float | None = None) -> list[FloatArray]:
    """Return the rows of spline values of every fit; those of one time are one array."""
    all_sums = {id(fitted.sums): fitted.sums for fitted in average.fits}
    rows = {key: rows_at(sums, time, reference) for key, sums in all_sums.items()}
    return [rows[id(fitted.sums)] for fitted in average.fits]


def level_errors(
    average: Average, level: FloatArray, reference: float, shape_of_level: FloatArray
) -> FloatArray:
    """Return the mean square errors of stated levels, averaged over the smoothness.

    Notes
    -----
    With weights w_k ~ exp(-criterion_k / 2), levels l_k and covariances V_k of the fits, and the
    stated levels l: sum over k of w_k (V_k + (l_k - l)(l_k - l)').
    """
    spread = np.zeros((level.size, level.size))
    rows = _rows(average, np.array([reference]))
    for w, fitted, row in zip(average.weight, average.fits, rows, strict=True):
        mean, covariance = levels_at(fitted, row[0], shape_of_level)
        spread += w * (covariance + np.outer(mean - level, mean - level))
    return spread


def step_sizes(average: Average, stated: Reported) -> tuple[FloatArray, FloatArray]:
    """Return the sizes of the steps that are reported, and their root mean square errors, (E,)."""
    n = average.line.sums.levels
    size = np.asarray(sum(w * f.level[n:] for w, f in zip(stated.weight, stated.fits, strict=True)))
    square = np.zeros_like(size)
    for w, fitted in zip(average.weight, average.fits, strict=True):
        level = np.eye(fitted.level.size)[:, n:]
        _, through, back = solved(fitted, level, np.zeros((fitted.spline.size, size.size)))
        variance = fitted.variance * np.sum(through * back, axis=0)
        square += w * (variance + (fitted.level[n:] - size) ** 2)
    return size, np.sqrt(square)


def function_errors(
    average: Average, stated: FloatArray, time: FloatArray, reference: float
) -> FloatArray:
    """Return the mean square errors of stated functions, averaged over the smoothness."""
    square = np.zeros_like(stated)
    rows = _rows(average, time, reference)
    for w, fitted, own in zip(average.weight, average.fits, rows, strict=True):
        square += w * (variances_at(fitted, own) + (functions_at(fitted, own) - stated) ** 2)
    return square
