"""Figures of a night by which causes are told apart, of the day and of the days before it."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import combinations
from typing import Final, NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.compensation import CompensationModel, Output, TouchFilter
from thermaxis.runtime import DATUM
from thermaxis.thermal import ThermalLog, simulate_log

_F = NDArray[np.float64]
_I = NDArray[np.intp]

FEWEST: Final = 4
"""Fewer touches of a day say nothing. [1]"""
REST_HOURS: Final = 4
"""Sensors are compared in so many hours in a row, those of a day in which least changes. [1]"""
FEWEST_MINUTES: Final = 30
"""An hour has so many minutes at least. [1]"""
MOST_PAIRED: Final = 6
"""Among more channels of an output none are tried as swapped. [1]"""
_CLIPPED, _DELTA = 4.0, 0.25
_MORE_UM = (0.0, 0.5, 1.0, 2.0, 4.0)
_SIZES_UM = (0.3, 0.6, 1.0, 1.7, 3.0, 6.0, 12.0)
_MEMORIES_S = (3600.0, 10_800.0, 32_400.0, 97_200.0)


@final
class SignKind(StrEnum):
    """What a sign measures."""

    LEVEL = "level"
    """A channel less the median of the others, at rest. [K]"""
    SWAP = "swap"
    """How far the displacement lies from the model as it is (0) to the one with two channels
    exchanged (1). [1]"""
    GAIN = "gain"
    """By what share of its contribution a part answers more. [1]"""
    TIME_CONSTANT = "time_constant"
    """Logarithm of the factor by which it answers slower. [1]"""
    MEAN = "mean"
    """Mean of what the free run leaves, less that of the days before; before: of the last one of
    these. [µm]"""
    REST = "rest"
    """Logarithm of the innovations' root mean square over their standard deviation. [1]"""


@final
@dataclass(frozen=True, slots=True)
class Sign:
    """One figure of a night."""

    sign: SignKind
    """What it measures."""
    output: str
    """The output; empty for a sensor."""
    of: str
    """The part or channel, two with a comma; empty for the output itself."""
    value: float
    """On the day."""
    std: float
    """Its standard deviation: by the touches, or as it was from day to day."""
    before: float
    """On the days before, as the same run has it."""
    before_std: float
    """Its standard deviation."""


def signs_of(
    log: ThermalLog, model: CompensationModel, measured: dict[str, _I], rows: int
) -> tuple[Sign, ...]:
    """Return the signs of the last day of a log.

    Parameters
    ----------
    log : ThermalLog
        Minutes of the day and of days before, without faults: channels of the model, and outputs.
    model : CompensationModel
        The model in force.
    measured : dict of str to int array
        Rows of the touches by output.
    rows : int
        Rows of the day. [1]

    Returns
    -------
    tuple of Sign
        What can be said; nothing without days before.
    """
    last_s = float(log.time_s[-rows])
    hour = np.floor((log.time_s - last_s) / 3600.0).astype(np.intp)
    day = hour // 24
    found = list(_levels(log, model, hour))
    for output in model.outputs:
        if output.name in measured:
            alone = replace(model, outputs=(output,))
            found += _Touched(log, alone, output, day, measured[output.name]).signs()
    return tuple(found)


def _levels(log: ThermalLog, model: CompensationModel, hour: _I) -> Iterator[Sign]:
    """Yield where each channel lies among the others while least changes, as it does at rest."""
    names = [name for name in model.channels if not np.all(np.isnan(log.columns[name]))]
    values = np.column_stack([log.columns[name] for name in names] or [hour])
    rows = ~np.isnan(values).any(axis=1)
    if len(names) < 2 or not rows.any():
        return
    apart = [values[rows, c] - np.median(np.delete(values[rows], c, 1), axis=1)
             for c in range(len(names))]  # fmt: skip
    hours, of_row, count = np.unique(hour[rows], return_inverse=True, return_counts=True)
    hourly = np.column_stack([np.bincount(of_row, one) / count for one in apart])
    change = np.append(np.sum(np.abs(np.diff(hourly, axis=0)), axis=1), np.inf)
    days = np.unique([*hours // 24, 0])
    levels = np.full((days.size, len(names)), np.nan)
    for k, one in enumerate(days.tolist()):
        own = np.flatnonzero((hours // 24 == one) & (count >= FEWEST_MINUTES))
        if own.size >= REST_HOURS:
            moved = np.convolve(change[own[:-1]], np.ones(REST_HOURS - 1), "valid")
            begin = int(np.argmin(moved))
            levels[k] = np.mean(hourly[own[begin : begin + REST_HOURS]], axis=0)
    for c, name in enumerate(names):
        yield from _by_days(SignKind.LEVEL, "", name, levels[:, c], 0.05)


def _by_days(
    kind: SignKind, output: str, of: str, daily: NDArray[np.floating], least: float
) -> Iterator[Sign]:
    """Yield the sign of a figure of each day, the last one the day, by how it went before."""
    known = daily[:-1][~np.isnan(daily[:-1])]
    if known.size < 2 or np.isnan(daily[-1]):
        return
    std = max(float(np.std(known, ddof=1)), least)
    figures = (float(daily[-1]), std, float(np.mean(known)), std / known.size**0.5)
    yield Sign(kind, output, of, *figures)


@final
class _Touched:
    """One output at its touches."""

    def __init__(
        self, log: ThermalLog, model: CompensationModel, output: Output, day: _I, rows: _I
    ) -> None:
        run = simulate_log(model, log, steady=True)
        said_um = run.outputs[output.name].displacement_um
        rows = rows[~(np.isnan(said_um[rows]) | run.bad[rows])]
        self._log, self._model, self._output, self._rows = log, model, output, rows
        self._said_um = said_um[rows]
        self._own_um = run.outputs[output.name].contribution_um[rows]
        self._left_um = log.column(output.name, unit="um")[rows] - self._said_um
        self._day = day[rows]
        anew = np.flatnonzero(log.columns.get(DATUM, np.zeros(0)) == 1.0)
        self._datums = np.searchsorted(anew, rows, side="right")
        self._names = [part.name for part in output.parts]

    def signs(self) -> Iterator[Sign]:
        """Yield what touches tell."""
        today, before = self._day == 0, self._day < 0
        if min(np.count_nonzero(today), np.count_nonzero(before)) < FEWEST:
            return
        left_um = self._over_level(before)
        kept = _likeliest(self._log.time_s[self._rows], left_um, before)
        e = kept.of(left_um)
        slower = self._run(replace(self._model, outputs=(_slower(self._output),)), self._log)
        columns = [
            *((SignKind.GAIN, name, self._own_um[:, k]) for k, name in enumerate(self._names)),
            *(
                (SignKind.TIME_CONSTANT, name, slope)
                for k, name in enumerate(self._names)
                for slope in [(slower[1][:, k] - self._own_um[:, k]) / np.log1p(_DELTA)]
            ),
            *((SignKind.SWAP, pair, other - self._said_um) for pair, other in self._swapped()),
        ]
        steady = kept.of(np.ones_like(left_um))
        for kind, of, column_um in columns:
            g = kept.of(column_um - np.mean(column_um))
            (value, std), (earlier, earlier_std) = (
                _share(e[rows], g[rows], steady[rows]) for rows in (today, before)
            )
            if max(std, earlier_std) < np.inf:
                yield Sign(kind, self._output.name, of, value, std, earlier, earlier_std)
        yield from self._of_days(e, steady)

    def _over_level(self, before: NDArray[np.bool_]) -> _F:
        """Return what the model leaves over its median before the day; a datum sets it anew."""
        left_um = self._left_um.copy()
        for datum in np.unique(self._datums):
            own = self._datums == datum
            known = own & before
            few = 2 * np.count_nonzero(known) < np.count_nonzero(own) and datum > self._datums[0]
            left_um[own] -= np.median(left_um[own if few else known])
        return left_um

    def _of_days(self, e: _F, steady: _F) -> Iterator[Sign]:
        days = np.unique(self._day)
        days = days[[int(np.count_nonzero(self._day == d)) >= FEWEST for d in days]]
        # the run begins as if the machine had rested: its first day is not asked
        later = (self._day < 0) & (self._day > days[0])
        if days[-1] == 0 and later.any():
            was, was_std = _share(e[later], steady[later])
            (value, std), (last, _) = (
                _share(e[self._day == d], steady[self._day == d]) for d in (0, days[-2])
            )
            yield Sign(SignKind.MEAN, self._output.name, "", value - was, std, last - was, was_std)
        far = np.minimum(np.abs(e), _CLIPPED)
        rest = np.array([0.5 * np.log(np.mean(far[self._day == d] ** 2) + 1e-3) for d in days])
        yield from _by_days(SignKind.REST, self._output.name, "", rest, 0.05)

    def _run(self, model: CompensationModel, log: ThermalLog) -> tuple[_F, _F]:
        found = simulate_log(model, log, steady=True).outputs[self._output.name]
        return found.displacement_um[self._rows], found.contribution_um[self._rows]

    def _swapped(self) -> Iterator[tuple[str, _F]]:
        """Yield what the model says with two channels exchanged on the day and before."""
        names = self._model.channels
        for a, b in combinations(names, 2) if len(names) <= MOST_PAIRED else ():
            columns = {**self._log.columns, a: self._log.columns[b], b: self._log.columns[a]}
            said_um, _ = self._run(self._model, replace(self._log, columns=columns))
            if not np.isnan(said_um).any():
                yield f"{a},{b}", said_um


@final
class _Memory(NamedTuple):
    """The filter of touches whose residual has a memory: each as an innovation, in its size."""

    decay: _F
    """What is left of the residual since the touch before, (m,). [1]"""
    gain: _F
    """Kalman gains, (m,). [1]"""
    std_um: _F
    """Standard deviations of the innovations, (m,). [µm]"""

    def of(self, left_um: _F) -> _F:
        """Return the innovations of what a model leaves, (m,), in their sizes. [1]"""
        found, state = np.empty_like(left_um), 0.0
        each = zip(left_um.tolist(), self.decay.tolist(), self.gain.tolist(), strict=True)
        for k, (left, decay, gain) in enumerate(each):
            state *= decay
            found[k] = left - state
            state += gain * found[k]
        return found / self.std_um


def _likeliest(time_s: _F, left_um: _F, learnt: NDArray[np.bool_]) -> _Memory:
    """Return the filter with the noise, size and memory that make some touches likeliest.

    The residual is a first-order Markov process, which is measured with noise.
    """
    least_um = TouchFilter().noise_um
    every = [np.ravel(one) for one in np.meshgrid(_MORE_UM, _SIZES_UM, _MEMORIES_S)]
    noise_um2, size_um2, memory_s = least_um**2 + every[0] ** 2, every[1] ** 2, every[2]
    apart_s = np.diff(time_s, prepend=time_s[:1])
    state, p_um2, likelihood = np.zeros_like(size_um2), size_um2, np.zeros_like(size_um2)
    history = np.empty((time_s.size, 3, state.size))
    for k, left in enumerate(left_um.tolist()):
        decay = np.exp(-apart_s[k] / memory_s)
        p_um2 = decay**2 * p_um2 + (1.0 - decay**2) * size_um2
        s_um2 = p_um2 + noise_um2
        gain = p_um2 / s_um2
        innovation = left - decay * state
        state = decay * state + gain * innovation
        p_um2 = (1.0 - gain) * p_um2
        history[k] = decay, gain, s_um2
        if learnt[k]:
            far = np.minimum(innovation**2 / s_um2, _CLIPPED**2)
            likelihood -= 0.5 * (far + np.log(s_um2))
    decay, gain, s_um2 = history[:, :, int(np.argmax(likelihood))].T
    return _Memory(decay, gain, np.sqrt(s_um2))


def _share(e: _F, g: _F, steady: _F | None = None) -> tuple[float, float]:
    """Return by what share of g innovations grow with it, beside a level, and how surely.

    Far ones weigh less.
    """
    w = np.minimum(1.0, _CLIPPED / np.maximum(np.abs(e), 1e-9))
    if steady is not None:
        g = g - steady * np.sum(w * steady * g) / np.sum(w * steady**2)
    total = float(np.sum(w * g**2))
    return (float(np.sum(w * e * g)) / total, total**-0.5) if total > 0.0 else (0.0, np.inf)


def _slower(output: Output) -> Output:
    """Return an output whose time constants are longer."""
    parts = tuple(
        replace(
            part,
            sections=tuple(
                replace(s, time_constant_s=(1.0 + _DELTA) * s.time_constant_s)
                for s in part.sections
            ),
        )
        for part in output.parts
    )
    return replace(output, parts=parts)
