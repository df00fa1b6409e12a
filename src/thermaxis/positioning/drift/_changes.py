"""Find where a run jumps: a laser set to zero anew, a knock at the optics, coolant switched on.

A step of the common drift, or of the growth, may lie between any two consecutive readings. Each
candidate is one column more in the normal equations of `_smooth_terms`, and what it gains follows
from sums over the readings after it, so that all of them are looked at together. The smooth
functions follow a step if they are rough enough: so the smoothness is averaged over anew with the
best candidate, and a step with smooth functions is weighed against rough functions alone.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from thermaxis.positioning.drift._smooth_terms import (
    ORDER,
    Fit,
    IntArray,
    Readings,
    Step,
    Sums,
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
_MOST_INSTANTS = 2000
"""Instants that are looked at together; near the best of them all are. [1]"""
_DEPARTURES = (0.02, 0.2, 2.0, 20.0)
"""Smoothness of the scan. [1]"""
_SLACK = 8.0
"""What averaging over the smoothness may add to a gain."""
_PEAKS = 3
"""Candidates that are looked at before a run is said to have no step. [1]"""
_SHAPES = 2
"""Functions that may jump: the common drift and the growth. [1]"""
_CONFOUNDED = 1e-6
"""Share of a step that the other terms must leave. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Instants:
    """Times between consecutive readings at which a step is looked for."""

    time: FloatArray
    """(J,). [1]"""
    before: IntArray
    """How many of them lie before each reading, (N,)."""

    def later(self, index: IntArray | int, value: FloatArray, size: int = 1) -> FloatArray:
        """Return the sums of the values after each instant, by index, (size, J)."""
        n = self.time.size + 1
        summed = sums_per(np.asarray(index * n + self.before), value, size * n).reshape(size, n)
        return np.cumsum(summed[:, ::-1], axis=1)[:, -2::-1]


def _instants(time: FloatArray) -> FloatArray:
    """Return the middle of every interval that leaves enough readings on both sides."""
    order = np.sort(time)
    after = np.arange(FEWEST_BESIDE, time.size - FEWEST_BESIDE + 1)
    left, right = order[after - 1], order[after]
    return (0.5 * (left + right))[right > left]


class _Columns:
    """Products of the step, or the ramp, at every instant with everything else."""

    def __init__(self, readings: Readings, sums: Sums, time: FloatArray, shape: int) -> None:
        self.sums, self.instants = sums, _Instants(time, np.searchsorted(time, readings.time))
        self._readings, self._shape = readings, shape
        first, values = spline_values(
            warped(readings.time, sums.warm_up, sums.plain), sums.intervals
        )
        later, size = self.instants.later, sums.intervals + 3
        self._level: list[FloatArray] = []
        self._spline: list[FloatArray] = []
        self._square: list[FloatArray] = []
        column = readings.weight * readings.shape[shape]
        for power in range(3):
            self._square.append(later(0, column * readings.shape[shape])[0])
            if power < 2:
                steps = [later(0, column * step) for step in readings.columns]
                self._level.append(np.vstack((later(readings.level, column, sums.levels), *steps)))
                spline = np.zeros((sums.right.size, time.size))
                for c, other in enumerate(readings.shape[: sums.shapes]):
                    for i in range(ORDER):
                        spline[c :: sums.shapes] += later(
                            first + i, column * other * values[:, i], size
                        )
                spline[sums.pinned] = 0.0
                self._spline.append(spline)
            column = column * readings.time

    def _ramp(self, products: list[FloatArray], ramp: int) -> FloatArray:
        """Return products of ramps from sums after each instant of powers 0 and 1 of time."""
        if not ramp:
            return products[0]
        time = self.instants.time
        kink = products[1] - time * products[0]
        return (kink[..., :-ramp] - kink[..., ramp:]) / (time[ramp:] - time[:-ramp])

    def _ramp_square(self, ramp: int) -> FloatArray:
        if not ramp:
            return self._square[0]
        start, end = self.instants.time[:-ramp], self.instants.time[ramp:]
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
        later = [self.instants.later(0, column)[0]]
        if ramp:
            later.append(self.instants.later(0, column * readings.time)[0])
        product = self._ramp(later, ramp)
        own, spline = self._ramp(self._level, ramp), self._ramp(self._spline, ramp)
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
    time = every[:: -(-every.size // _MOST_INSTANTS)]
    fits = list(_fits_of_scan(average))
    columns = {
        (id(sums), c): _Columns(readings, sums, time, c)
        for sums in {id(f.sums): f.sums for f in fits}.values()
        for c in range(_SHAPES)
    }
    criterion = np.stack(
        [np.min([columns[id(f.sums), c].criteria(f) for f in fits], axis=0) for c in range(_SHAPES)]
    )
    least = LEAST_GAIN + 2.0 * np.log(_SHAPES * every.size)
    for _ in range(_PEAKS):
        shape, at = np.unravel_index(np.argmin(criterion), criterion.shape)
        if average.best.criterion - criterion[shape, at] < least - _SLACK:
            return None
        step = Step(float(time[at]), int(shape))
        step, after = _refined(readings, step, every, averaged)
        gain = average.evidence - after.evidence
        if gain < least:
            return None
        if not _gradual(fits, columns, float(criterion[shape, at]), int(shape), int(at)):
            return step, gain
        near = slice(max(at - readings.levels, 0), at + readings.levels)
        criterion[:, near] = np.inf
    return None


def _fits_of_scan(average: Average) -> Iterator[Fit]:
    """Yield fits of different smoothness, in plain time and in the likeliest."""
    yield average.best
    for sums in {id(f.sums): f.sums for f in (average.line, average.best)}.values():
        penalty = penalty_of(sums.intervals)
        for departure in _DEPARTURES:
            yield fit(sums, penalty, np.full(sums.shapes, departure))


def _refined(
    readings: Readings, step: Step, every: FloatArray, averaged: Callable[[Readings], Average]
) -> tuple[Step, Average]:
    """Move a step to the likeliest instant for the smoothness that the run has with it."""
    for _ in range(3):
        after = averaged(replace(readings, steps=(*readings.steps, step)))
        best = after.best.sums
        sums = sums_of(readings, best.intervals, best.warm_up, best.plain)
        without = fit(sums, penalty_of(best.intervals), after.best_departure)
        near = int(np.searchsorted(every, step.time))
        time = every[max(near - _MOST_INSTANTS // 2, 0) : near + _MOST_INSTANTS // 2]
        criterion = [_Columns(readings, sums, time, c).criteria(without) for c in range(_SHAPES)]
        shape, at = np.unravel_index(np.argmin(criterion), (_SHAPES, time.size))
        better = Step(float(time[at]), int(shape))
        if better == step:
            break
        step = better
    else:
        after = averaged(replace(readings, steps=(*readings.steps, step)))
    return step, after


def _gradual(
    fits: list[Fit], columns: dict[tuple[int, int], _Columns], step: float, shape: int, at: int
) -> bool:
    """Return whether a ramp about an instant is likelier than the step there."""
    for cycles in RAMPS[shape]:
        ramp = round(cycles * fits[0].sums.levels)
        near = slice(max(at - 2 * ramp, 0), at + ramp)
        for fitted in fits:
            criterion = columns[id(fitted.sums), shape].criteria(fitted, ramp)
            if np.min(criterion[near], initial=np.inf) < step:
                return True
    return False
