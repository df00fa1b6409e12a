"""Find where a run jumps: a laser set to zero anew, a knock at the optics, coolant switched on.

A step of the common drift, or of the growth, may lie between any two consecutive readings. Each
candidate is one column more in the normal equations of `_smooth_terms`, and what it gains follows
from sums over the readings after it, so that all of them are looked at together. The smooth
functions follow a step if they are rough enough: so the smoothness is averaged over anew with the
best candidate, and a step with smooth functions is weighed against rough functions alone.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from thermaxis.positioning.drift._smooth_terms import (
    Fit,
    IntArray,
    Readings,
    Step,
    Sums,
    against_splines,
    fit,
    penalty_of,
    residual_of,
    solved,
    spline_values,
    sums_of,
    sums_per,
    warped,
)
from thermaxis.positioning.drift._smoothness import Average
from thermaxis.positioning.run import FloatArray

LEAST_GAIN = 9.0
"""Least gain in minus twice the logarithm of the restricted likelihood, averaged over the
smoothness, beyond twice the logarithm of the number of candidates."""
FEWEST_BESIDE = 5
"""Readings that must lie before and after a step. [1]"""
RAMPS = ((0.75, 1.5), (1.5,))
"""A change of the common drift, or of the growth, that is likelier to have taken so long, in
cycles, is no step: a pump's onset takes minutes. Growth hardly shows at mid-axis. [1]"""
PAUSE = 5.0
"""An interval so many times the mean one is a pause. [1]"""
CLEAR = (6.0, 0.0)
"""How far the criterion of a ramp must lie above that of the step, of both functions."""
_MOST_INSTANTS = 500
"""Instants that are looked at together. [1]"""
_REACH = 4
"""Cycles about the best of them that are looked at. [1]"""
_DEPARTURES = (0.02, 0.2, 2.0, 20.0)
"""Smoothness of the scan. [1]"""
_SLACK = 8.0
"""What averaging over the smoothness may add to a gain."""
_SHAPES = 2
"""Functions that may jump: the common drift and the growth. [1]"""
_CONFOUNDED = 1e-2
"""Share of a step that the other terms must leave. [1]"""


def _instants(time: FloatArray) -> FloatArray:
    """Return the middle of every interval that leaves enough readings on both sides."""
    order = np.sort(time)
    after = np.arange(FEWEST_BESIDE, time.size - FEWEST_BESIDE + 1)
    left, right = order[after - 1], order[after]
    return (0.5 * (left + right))[right > left]


def _later(value: FloatArray) -> FloatArray:
    """Return sums over what comes later: of n + 1 values, the sums of the last n ... 1."""
    return np.cumsum(value[..., :0:-1], axis=-1)[..., ::-1]


def _thinned(time: FloatArray) -> FloatArray:
    return time[:: -(-time.size // _MOST_INSTANTS)]


class _Columns:
    """Products of the step, or the ramp, at every instant with everything else."""

    def __init__(self, readings: Readings, sums: Sums, time: FloatArray, shape: int) -> None:
        self.sums, self.time = sums, time
        self._readings, self._shape = readings, shape
        self._before: IntArray = np.searchsorted(time, readings.time)
        within = spline_values(warped(readings.time, sums.warm_up, sums.plain), sums.intervals)
        self._fixed: list[FloatArray] = []
        self._spline: list[FloatArray] = []
        self._square: list[FloatArray] = []
        n, column = time.size + 1, readings.weight * readings.shape[shape]
        for _ in range(3):  # powers of time: a ramp is a difference of two kinks
            self._square.append(self._after(column * readings.shape[shape]))
            level = sums_per(readings.level * n + self._before, column, sums.levels * n)
            steps = [self._after(column * step) for step in readings.columns]
            self._fixed.append(np.vstack((_later(level.reshape(-1, n)), *steps)))
            spline = _later(against_splines(readings, within, column, self._before, n))
            spline[sums.pinned] = 0.0
            self._spline.append(spline)
            column = column * readings.time

    def _after(self, value: FloatArray) -> FloatArray:
        """Return the sums of the values after each instant, (J,)."""
        return _later(sums_per(self._before, value, self.time.size + 1))

    def _ramp(self, products: list[FloatArray], ramp: int) -> FloatArray:
        """Return products of ramps from sums after each instant of powers 0 and 1 of time."""
        if not ramp:
            return products[0]
        time = self.time
        kink = products[1] - time * products[0]
        return (kink[..., :-ramp] - kink[..., ramp:]) / (time[ramp:] - time[:-ramp])

    def _ramp_square(self, ramp: int) -> FloatArray:
        if not ramp:
            return self._square[0]
        start, end = self.time[:-ramp], self.time[ramp:]
        zero, one, two = (s[:-ramp] - s[ramp:] for s in self._square)
        rising = (two - 2.0 * start * one + start**2 * zero) / (end - start) ** 2
        return rising + self._square[0][ramp:]

    def criteria(self, fitted: Fit, ramp: int = 0) -> FloatArray:
        """Return the criterion of a fit with the step at each instant added, (J - ramp,).

        Notes
        -----
        With the residuals r of the fit, a column z takes (z'r)^2 / q from the weighted sum of
        squares, with q = z'z less what levels, steps and splines take of it; log q joins the
        log-determinant.
        """
        readings, sums = self._readings, self.sums
        column = readings.weight * readings.shape[self._shape] * residual_of(fitted, readings)
        product = self._ramp([self._after(column), self._after(column * readings.time)], ramp)
        own, spline = self._ramp(self._fixed, ramp), self._ramp(self._spline, ramp)
        through_splines, through, back = solved(fitted, own, spline)
        square = self._ramp_square(ramp)
        q = square - np.sum(spline * through_splines, axis=0) - np.sum(through * back, axis=0)
        free = sums.readings - sums.levels - sums.shapes
        steps = len(sums.steps)
        left_over = fitted.variance * (free - steps)
        known = q > _CONFOUNDED * square
        q = np.where(known, q, 1.0)
        left = np.maximum(left_over - product**2 / q, 1e-14 * left_over) / (free - steps - 1)
        criterion = fitted.criterion + free * np.log(left / fitted.variance) + np.log(q)
        return np.where(known, criterion, np.inf)


def find_step(
    readings: Readings, average: Average, averaged: Callable[[Readings], Average]
) -> tuple[Step, float] | None:
    """Return the likeliest step of a run beside those it has, and its gain; None without one."""
    every = _instants(readings.time)
    if every.size == 0:
        return None
    time, fits = _thinned(every), list(_fits_of_scan(average))
    likeliest, criterion = _likeliest(readings, fits, time)
    least = LEAST_GAIN + 2.0 * float(np.log(_SHAPES * every.size))
    if average.best.criterion - criterion < least - _SLACK:
        return None
    near, reach = int(np.searchsorted(every, likeliest.time)), 1 + every.size // _MOST_INSTANTS
    reach = max(reach, _REACH * readings.levels)
    time = _thinned(every[max(near - reach, 0) : near + reach])
    after = averaged(replace(readings, steps=(*readings.steps, likeliest)))
    best = after.best.sums  # the smoothness that the run has with the step
    sums = sums_of(readings, best.intervals, best.warm_up, best.plain)
    without = fit(sums, penalty_of(best.intervals), after.best_departure)
    step, _ = _likeliest(readings, [without], time)
    if step != likeliest:
        after = averaged(replace(readings, steps=(*readings.steps, step)))
    gain = average.evidence - after.evidence
    if gain < least:
        return None
    if not _gradual(readings, [*fits, without], time, step):
        return step, gain
    other = Step(step.time, 1 - step.shape)
    if other in readings.steps:
        return None
    beside = replace(readings, steps=(*readings.steps, other))
    both = averaged(replace(beside, steps=(*beside.steps, step)))
    # what steps in both functions seems gradual in each alone
    explained = after.evidence - both.evidence >= least
    fits = [*_fits_of_scan(averaged(beside))] if explained else []
    return (step, gain) if explained and not _gradual(beside, fits, time, step) else None


def _scan(
    readings: Readings, fits: list[Fit], time: FloatArray, shape: int
) -> list[tuple[_Columns, Fit]]:
    """Return every fit with the columns of its sums, each made once."""
    all_sums = {id(fitted.sums): fitted.sums for fitted in fits}
    columns = {key: _Columns(readings, sums, time, shape) for key, sums in all_sums.items()}
    return [(columns[id(fitted.sums)], fitted) for fitted in fits]


def _likeliest(readings: Readings, fits: list[Fit], time: FloatArray) -> tuple[Step, float]:
    """Return the step whose criterion is lowest with one of the fits, and its criterion."""
    criterion = np.stack(
        [
            np.min([own.criteria(f) for own, f in _scan(readings, fits, time, c)], axis=0)
            for c in range(_SHAPES)
        ]
    )
    shape, at = np.unravel_index(np.argmin(criterion), criterion.shape)
    return Step(float(time[at]), int(shape)), float(criterion[shape, at])


def _fits_of_scan(average: Average) -> Iterator[Fit]:
    """Yield fits of different smoothness, in plain time and in the likeliest."""
    yield average.best
    for sums in {id(f.sums): f.sums for f in (average.line, average.best)}.values():
        penalty = penalty_of(sums.intervals)
        for departure in _DEPARTURES:
            yield fit(sums, penalty, np.full(sums.shapes, departure))


def _gradual(readings: Readings, fits: list[Fit], time: FloatArray, step: Step) -> bool:
    """Return whether a ramp about an instant is likelier than the step there."""
    at = int(np.searchsorted(time, step.time))
    between = np.sum((readings.time > time[0]) & (readings.time < time[-1]))
    scan = _scan(readings, fits, time, step.shape)
    sharp = min(float(own.criteria(fitted)[at]) for own, fitted in scan)
    left = np.max(readings.time, where=readings.time < step.time, initial=0.0)
    right = np.min(readings.time, where=readings.time > step.time, initial=1.0)
    paused = (right - left) * readings.time.size > PAUSE  # in a pause both are nearly the same
    clear = 0.0 if paused else CLEAR[step.shape]
    for cycles in RAMPS[step.shape]:
        ramp = max(1, round(cycles * readings.levels * time.size / max(int(between), 1)))
        near = slice(max(at - 2 * ramp, 0), at + ramp)
        for own, fitted in scan:
            if np.min(own.criteria(fitted, ramp)[near], initial=np.inf) < sharp + clear:
                return True
    return False
