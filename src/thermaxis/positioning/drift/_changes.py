"""Find where a run jumps: a laser set to zero anew, a knock at the optics, coolant switched on.

A step of the common drift, or of the growth, may lie between any two consecutive readings. Each
candidate is one column more in the normal equations of `_smooth_terms`, and what it gains follows
from sums over the readings after it, so that all of them are looked at together. The smooth
functions follow a step if they are rough enough: so the smoothness is averaged over anew with the
best candidate, and a step with smooth functions is weighed against rough functions alone.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from thermaxis.positioning.drift._smooth_terms import (
    Fit,
    IntArray,
    Readings,
    Step,
    Sums,
    against_splines,
    fit,
    leverages_of,
    penalty_of,
    residual_of,
    solved,
    spline_values,
    sums_of,
    sums_per,
    warped,
    with_correlated_noise,
)
from thermaxis.positioning.drift._smoothness import Average
from thermaxis.positioning.run import FloatArray

LEAST_GAIN = 9.0
"""Least gain in minus twice the logarithm of the restricted likelihood, averaged over the
smoothness, beyond twice the logarithm of the number of candidates."""
LEAST_GAIN_PAUSE = 2.0
"""The same from which a step in a pause belongs to the model, though it may be a drift. [1]"""
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
_MOST_CORRELATED = 1_000_000
"""The same, times readings, where the noise is correlated. [1]"""
_SAME = 1e-9
"""Difference of times below which they are one, as fractions of the run. [1]"""
_PATIENCE = 5
"""Steps beside which one more must explain the run together with them. [1]"""
_HOPE = 4.0
"""Gain of a further step against the largest so far; steps in one direction grew 2.7-fold. [1]"""
_REACH = 4
"""Cycles about the best of them that are looked at. [1]"""
_DEPARTURES = (0.02, 0.2, 2.0, 20.0)
"""Smoothness of the scan. [1]"""
_SLACK = 8.0
"""What averaging over the smoothness may add to a gain."""
_SHAPES = 2
"""Functions that may jump: the common drift and the growth. [1]"""
_CONFOUNDED = 1e-2
"""Share of a step, times that of the readings on its shorter side, that the other terms must
leave. [1]"""


def _instants(time: FloatArray) -> FloatArray:
    """Return the middle of every interval that leaves enough readings on both sides."""
    order = np.sort(time)
    after = np.arange(FEWEST_BESIDE, time.size - FEWEST_BESIDE + 1)
    left, right = order[after - 1], order[after]
    return (0.5 * (left + right))[right > left]


def _later(value: FloatArray) -> FloatArray:
    """Return sums over what comes later: of n + 1 values, the sums of the last n ... 1."""
    return np.cumsum(value[..., :0:-1], axis=-1)[..., ::-1]


def _thinned(time: FloatArray, readings: Readings) -> FloatArray:
    most = _MOST_INSTANTS
    if readings.correlation:
        most = int(np.clip(_MOST_CORRELATED / readings.value.size, 100, most))
    return time[:: -(-time.size // most)]


Averaging: TypeAlias = Callable[[Readings], Average]
_Products: TypeAlias = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
"""Products of columns with levels and steps, with splines, with the values, and with themselves."""


class _Columns:
    """Products of the step, or the ramp, at every instant with everything else."""

    def __init__(self, readings: Readings, sums: Sums, time: FloatArray, shape: int) -> None:
        self.sums, self.time = sums, time
        self._readings, self._shape = readings, shape
        self._before: IntArray = np.searchsorted(time, readings.time)
        number = np.bincount(self._before, minlength=time.size)[: time.size]
        self._share = np.cumsum(number) / readings.time.size
        self._powers = [] if readings.correlation else list(self._sums_after())
        self._known: dict[int, _Products] = {}

    def _sums_after(self) -> Iterator[_Products]:
        """Yield products of the steps times powers of time: a ramp is a difference of two kinks."""
        readings, sums = self._readings, self.sums
        within = spline_values(warped(readings.time, sums.warm_up, sums.plain), sums.intervals)
        n, column = self.time.size + 1, readings.weight * readings.shape[self._shape]
        for _ in range(3):
            level = sums_per(readings.level * n + self._before, column, sums.levels * n)
            steps = [self._after(column * step) for step in readings.columns]
            spline = _later(against_splines(readings, within, column, self._before, n))
            spline[sums.pinned] = 0.0
            yield (
                np.vstack((_later(level.reshape(-1, n)), *steps)),
                spline,
                self._after(column * readings.value),
                self._after(column * readings.shape[self._shape]),
            )
            column = column * readings.time

    def _after(self, value: FloatArray) -> FloatArray:
        """Return the sums of the values after each instant, (J,)."""
        return _later(sums_per(self._before, value, self.time.size + 1))

    def _of(self, ramp: int) -> _Products:
        """Return the products of all ramps over so many instants, of steps for none."""
        if ramp not in self._known:
            start, end = self.time[: self.time.size - ramp], self.time[ramp:]
            if self._readings.correlation:
                self._known[ramp] = self._in_correlated_noise(start, end)
            else:
                self._known[ramp] = self._ramps(start, end) if ramp else self._powers[0]
        return self._known[ramp]

    def _ramps(self, start: FloatArray, end: FloatArray) -> _Products:
        zero, one, two = self._powers
        ramp = self.time.size - start.size

        def difference(k: int) -> FloatArray:
            kink = one[k] - self.time * zero[k]
            return (kink[..., :-ramp] - kink[..., ramp:]) / (end - start)

        of_power = [s[3][:-ramp] - s[3][ramp:] for s in (zero, one, two)]
        rising = of_power[2] - 2.0 * start * of_power[1] + start**2 * of_power[0]
        square = rising / (end - start) ** 2 + zero[3][ramp:]
        return difference(0), difference(1), difference(2), square

    def _in_correlated_noise(self, start: FloatArray, end: FloatArray) -> _Products:
        readings, fixed = self._readings, self.sums.level_sum.size

        def own(chosen: IntArray) -> FloatArray:
            since = readings.time[chosen, None] - start
            risen = np.clip(since / np.maximum(end - start, 1e-300), 0.0, 1.0)
            return risen * readings.shape[self._shape, chosen, None]

        product = with_correlated_noise(self.sums, readings, own)
        through = product[: -start.size, -start.size :]
        square = np.diag(product)[-start.size :]
        return through[:fixed], through[fixed:-1], through[-1], square

    def criteria(self, fitted: Fit, ramp: int = 0) -> FloatArray:
        """Return the criterion of a fit with the step at each instant added, (J - ramp,).

        Notes
        -----
        With the residuals r of the fit, a column z takes (z'r)^2 / q from the weighted sum of
        squares, with q = z'z less what levels, steps and splines take of it; log q joins the
        log-determinant.
        """
        if ramp >= self.time.size:
            return np.empty(0)
        sums, (own, spline, right, square) = self.sums, self._of(ramp)
        product = right - fitted.level @ own - fitted.spline @ spline
        through_splines, through, back = solved(fitted, own, spline)
        q = square - np.sum(spline * through_splines, axis=0) - np.sum(through * back, axis=0)
        free = sums.readings - sums.levels - sums.shapes
        steps = len(sums.steps)
        left_over = fitted.variance * (free - steps)
        before = self._share[: q.size]
        known = q > _CONFOUNDED * square * np.minimum(before, 1.0 - before)
        q = np.where(known, q, 1.0)
        left = np.maximum(left_over - product**2 / q, 1e-14 * left_over) / (free - steps - 1)
        criterion = fitted.criterion + free * np.log(left / fitted.variance) + np.log(q)
        return np.where(known, criterion, np.inf)


def find_step(
    readings: Readings, average: Average, averaged: Averaging
) -> tuple[Step, float] | None:
    """Return the likeliest step of a run beside those it has, and its gain; None without one."""
    found = _step_anywhere(readings, average, averaged)
    return found or _step_in_pause(readings, average, averaged)


def _pauses(time: FloatArray) -> FloatArray:
    """Return the middle of every pause."""
    order = np.sort(time)
    long = np.flatnonzero(np.diff(order) * order.size > PAUSE)
    return 0.5 * (order[long] + order[long + 1])


def _step_in_pause(
    readings: Readings, average: Average, averaged: Averaging
) -> tuple[Step, float] | None:
    """Return a step of the common drift in a pause, where few places compete."""
    pauses = _pauses(readings.time)
    if pauses.size == 0:
        return None
    rivals = 2.0 * float(np.log(pauses.size))
    step, criterion = _likeliest(readings, list(_fits_of_scan(average)), pauses, 1)
    if np.isinf(criterion):  # each has one
        return None
    gain = average.evidence - averaged(replace(readings, steps=(*readings.steps, step))).evidence
    if gain < LEAST_GAIN_PAUSE + rivals:
        return None
    return replace(step, sure=gain >= LEAST_GAIN + rivals), gain


def _step_anywhere(
    readings: Readings, average: Average, averaged: Averaging
) -> tuple[Step, float] | None:
    every = _instants(readings.time)
    if every.size == 0:
        return None
    fits = list(_fits_of_scan(average))
    likeliest, criterion = _likeliest(readings, fits, _thinned(every, readings))
    least = _least_gain(every)
    if average.best.criterion - criterion < least - _SLACK:
        return None
    step, after, time = _placed(readings, likeliest, every, averaged)
    gain = average.evidence - after.evidence
    if gain < least:
        return None
    if not _gradual(readings, [*fits, _without(readings, after)], time, step):
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


def find_steps(
    readings: Readings, average: Average, averaged: Averaging, most: int, rival: float
) -> tuple[tuple[Step, ...], float]:
    """Return all steps of a run with those that explain it together, and what these gain.

    Beside one step of several the smooth functions must follow the others, so that it gains little.
    What they gain is beyond what each must. The search ends where those still possible cannot gain
    as much as a rival.
    """
    every, given, largest = _instants(readings.time), readings, 0.0
    best, gain, first, found = readings, 0.0, average.evidence, 0
    for k in range(1, most + 1 if every.size else 0):
        fits = list(_fits_of_scan(average))
        likeliest, _ = _likeliest(given, fits, _thinned(every, given))
        before = average.evidence
        step, average, _ = _placed(given, likeliest, every, averaged)
        given = replace(given, steps=(*given.steps, step))
        largest = max(largest, before - average.evidence)
        if first - average.evidence + _HOPE * largest * (most - k) < rival:
            break
        together = first - average.evidence - k * _least_gain(every)
        if together > gain:
            best, gain, found = given, together, k
        elif k - found == _PATIENCE:
            break
    return steps_that_hold(best, averaged) if found else (), gain


def outlier_at_end(readings: Readings, average: Average) -> tuple[int, float, float]:
    """Return the first or last reading, its residual without it, and what leaving it out gains.

    The curve follows such a reading, as it would a step: so a smooth one is fitted without it too.
    """
    ends = np.array([np.argmin(readings.time), np.argmax(readings.time)])
    alone = readings.of(ends)
    found = (0, 0.0, -np.inf)
    for fitted in _fits_of_scan(average):
        left = np.maximum(1.0 - leverages_of(fitted, alone), _CONFOUNDED)
        residual = residual_of(fitted, alone)
        free = fitted.sums.readings - fitted.sums.levels - fitted.sums.shapes
        share = alone.weight * residual**2 / (left * free * fitted.variance)
        gain = -free * np.log1p(-np.minimum(share, 1.0 - _SAME)) - np.log(left)
        gain += average.best.criterion - fitted.criterion - LEAST_GAIN
        k = int(np.argmax(gain))
        if gain[k] > found[2]:
            found = (int(ends[k]), float(residual[k] / left[k]), float(gain[k]))
    return found


def steps_that_hold(readings: Readings, averaged: Averaging) -> tuple[Step, ...]:
    """Return the steps of a run less those that it explains as well without, the worst first."""
    pauses, least = _pauses(readings.time), _least_gain(_instants(readings.time))
    while readings.steps:
        steps = readings.steps
        fewer = [replace(readings, steps=(*steps[:e], *steps[e + 1 :])) for e in range(len(steps))]
        gains = [averaged(one).evidence for one in fewer]
        worst = int(np.argmin(gains))
        near = np.any(np.abs(pauses - steps[worst].time) < _SAME)
        now, rivals = averaged(readings).evidence, 2.0 * float(np.log(max(pauses.size, 1)))
        if gains[worst] - now >= (LEAST_GAIN_PAUSE + rivals if near else least):
            sure = [
                one.sure and gain - now >= LEAST_GAIN + rivals
                for one, gain in zip(steps, gains, strict=True)
            ]
            return tuple(replace(one, sure=s) for one, s in zip(steps, sure, strict=True))
        readings = fewer[worst]
    return ()


def _least_gain(every: FloatArray) -> float:
    return LEAST_GAIN + 2.0 * float(np.log(_SHAPES * every.size))


def _without(readings: Readings, after: Average) -> Fit:
    """Return the fit without a step, at the smoothness that the run has with it."""
    best = after.best.sums
    sums = sums_of(readings, best.intervals, best.warm_up, best.plain)
    return fit(sums, penalty_of(best.intervals), after.best_departure)


def _placed(
    readings: Readings, likeliest: Step, every: FloatArray, averaged: Averaging
) -> tuple[Step, Average, FloatArray]:
    """Return a step at its likeliest instant, the run with it, and the instants looked at."""
    near, reach = int(np.searchsorted(every, likeliest.time)), 1 + every.size // _MOST_INSTANTS
    reach = max(reach, _REACH * readings.levels)
    time = _thinned(every[max(near - reach, 0) : near + reach], readings)
    after = averaged(replace(readings, steps=(*readings.steps, likeliest)))
    step, _ = _likeliest(readings, [_without(readings, after)], time)
    if step != likeliest:
        after = averaged(replace(readings, steps=(*readings.steps, step)))
    return step, after, time


def _scan(
    readings: Readings, fits: list[Fit], time: FloatArray, shape: int
) -> list[tuple[_Columns, Fit]]:
    """Return every fit with the columns of its sums, each made once."""
    all_sums = {id(fitted.sums): fitted.sums for fitted in fits}
    columns = {key: _Columns(readings, sums, time, shape) for key, sums in all_sums.items()}
    return [(columns[id(fitted.sums)], fitted) for fitted in fits]


def _likeliest(
    readings: Readings, fits: list[Fit], time: FloatArray, shapes: int = _SHAPES
) -> tuple[Step, float]:
    """Return the step whose criterion is lowest with one of the fits, and its criterion."""
    criterion = np.stack(
        [
            np.min([own.criteria(f) for own, f in _scan(readings, fits, time, c)], axis=0)
            for c in range(shapes)
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
