"""What a night says of causes: figures of the day, and least squares of its touches."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import combinations
from typing import Any, Final, NamedTuple, final

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
_REFERENCE_C: Final = 20.0
"""Temperature from which that around the parts counts (ISO 1). [°C]"""
_MORE_UM = (0.0, 0.5, 1.0, 2.0, 4.0)
_SIZES_UM = (0.3, 0.6, 1.0, 1.7, 3.0, 6.0, 12.0)
_MEMORIES_S = (3600.0, 7200.0, 14_400.0, 28_800.0, 86_400.0)


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
    """By how much the displacement lies beside the model, heat or not. [µm]"""
    AMBIENT = "ambient"
    """What a kelvin of the channels that parts subtract does beside the model. [µm/K]"""
    REST = "rest"
    """Logarithm of the innovations' root mean square over their standard deviation. [1]"""


KNOWN: Final = {SignKind.AMBIENT: 1.0, SignKind.GAIN: 0.3, SignKind.TIME_CONSTANT: 0.6}
"""How well a model is known at least, in the sign's unit. [M]"""


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


@final
@dataclass(frozen=True, slots=True)
class NormalEquations:
    """Least squares of touches: `matrix @ x = vector`, in the variance of their innovations."""

    matrix: tuple[float, ...]
    """Its upper triangle, row by row."""
    vector: tuple[float, ...]
    """One number per column."""


@final
@dataclass(frozen=True, slots=True)
class TouchedDay:
    """What the touches of a day say of one output, beside those of the days before."""

    output: str
    """The output."""
    columns: tuple[tuple[SignKind, str], ...]
    """What each unknown is, and of which part or channels; the mean first."""
    day: NormalEquations
    """Of the day."""
    before: NormalEquations
    """Of the days before, as the same run has them."""
    datum_set: bool
    """Whether the zero is another than in the days before; what was before says nothing of it."""


def signs_of(
    log: ThermalLog, model: CompensationModel, measured: dict[str, _I], rows: int
) -> tuple[tuple[Sign, ...], tuple[TouchedDay, ...]]:
    """Return what the last day of a log says.

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
    signs : tuple of Sign
        Figures of sensors and innovations; nothing without days before.
    touched : tuple of TouchedDay
        Outputs with touches enough on the day and before.
    """
    last_s = float(log.time_s[-rows])
    hour = np.floor((log.time_s - last_s) / 3600.0).astype(np.intp)
    day = hour // 24
    signs, touched = list(_levels(log, model, hour)), list[TouchedDay]()
    for output in model.outputs:
        if output.name in measured:
            one = _Touched(
                log, replace(model, outputs=(output,)), output, day, measured[output.name]
            )
            if one.is_enough:
                touched.append(one.equations())
                signs += one.rest()
    return tuple(signs), tuple(touched)


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
        self._before = self._day < 0
        anew = np.flatnonzero(log.columns.get(DATUM, np.zeros(0)) == 1.0)
        self._datums = np.searchsorted(anew, rows, side="right")
        counts = np.count_nonzero(self._day == 0), np.count_nonzero(self._before)
        self.is_enough = min(counts) >= FEWEST
        if self.is_enough:
            left_um, self._zero_um = self._over_level()
            self._columns = tuple(self._base())
            self._kept = _likeliest(log.time_s[rows], left_um, self._before)
            noise_um = left_um - self._explained(left_um)
            self._kept = _likeliest(log.time_s[rows], noise_um, self._before)
            self._innovations = self._kept.of(left_um)

    def _base(self) -> Iterator[tuple[SignKind, str, _F]]:
        """Yield what a machine may do otherwise than its model."""
        slower = self._run(replace(self._model, outputs=(_slower(self._output),)), self._log)
        slower_um = (slower[1] - self._own_um) / np.log1p(_DELTA)
        yield SignKind.MEAN, "", np.ones(self._rows.size)
        around = sorted({part.minus for part in self._output.parts} - {""})
        if around:
            around_c = np.mean([self._held(self._log.columns[name]) for name in around], axis=0)
            yield SignKind.AMBIENT, "", around_c - _REFERENCE_C
        for kind, each_um in ((SignKind.GAIN, self._own_um), (SignKind.TIME_CONSTANT, slower_um)):
            for part, own_um in zip(self._output.parts, each_um.T, strict=True):
                yield kind, part.name, own_um

    def _held(self, column: _F) -> _F:
        """Return a channel at the touches; where it is missing, by its neighbours in time."""
        time_s, known = self._log.time_s, ~np.isnan(column)
        return np.interp(time_s[self._rows], time_s[known], column[known])

    def _explained(self, left_um: _F) -> _F:
        """Return what in the days before another model would explain: it is no noise."""
        x = np.column_stack([column_um for *_, column_um in self._columns])
        g, e = self._kept.of(x)[self._before], self._kept.of(left_um)[self._before]
        known = np.diag([KNOWN.get(kind, 1e6) ** -2.0 for kind, *_ in self._columns])
        weighted = _weights(e) * g.T
        return x @ np.linalg.solve(known + weighted @ g, weighted @ e)

    def equations(self) -> TouchedDay:
        """Return the least squares of the touches on what changes of the model would do."""
        swapped = ((SignKind.SWAP, pair, other - self._said_um) for pair, other in self._swapped())
        columns = (*self._columns, *swapped)
        g = self._kept.of(np.column_stack([column_um for *_, column_um in columns]))
        today = self._day == 0
        return TouchedDay(
            self._output.name,
            tuple((kind, of) for kind, of, _ in columns),
            self._summed(g, today),
            # the run begins as if the machine had rested: its first day is not asked
            self._summed(g, self._before & (self._day > self._day[0])),
            datum_set=bool(self._datums[-1] != self._datums[self._before][-1]),
        )

    def _summed(self, g: _F, rows: NDArray[np.bool_]) -> NormalEquations:
        """Return normal equations of rows; of an older datum the mean says nothing of this one."""
        e = self._innovations + self._zero_um * g[:, 0]
        w = _weights(self._innovations)
        matrix, vector = np.zeros((g.shape[1],) * 2), np.zeros(g.shape[1])
        for datum in np.unique(self._datums[rows]):
            own = rows & (self._datums == datum)
            a, b = (w[own] * g[own].T) @ g[own], (w[own] * g[own].T) @ e[own]
            if datum != self._datums[-1]:
                a, b = without_mean(a, b)
            matrix, vector = matrix + a, vector + b
        upper = matrix[np.triu_indices(g.shape[1])]
        return NormalEquations(_rounded(upper), _rounded(vector))

    def _over_level(self) -> tuple[_F, float]:
        """Return what the model leaves over its median before the day, and that of the last datum.

        A datum sets it anew.
        """
        left_um, zero_um = self._left_um.copy(), 0.0
        for datum in np.unique(self._datums):
            own = self._datums == datum
            known = own & self._before
            few = 2 * np.count_nonzero(known) < np.count_nonzero(own) and datum > self._datums[0]
            zero_um = float(np.median(left_um[own if few else known]))
            left_um[own] -= zero_um
        return left_um, zero_um

    def rest(self) -> Iterator[Sign]:
        """Yield how large the innovations are."""
        days = np.unique(self._day)
        days = days[[int(np.count_nonzero(self._day == d)) >= FEWEST for d in days]]
        far = np.minimum(np.abs(self._innovations), _CLIPPED)
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
        """Return the innovations of what a model leaves, (m,) or (m, p), in their sizes. [1]"""
        found, state = np.empty_like(left_um), np.zeros_like(left_um[0])
        for k, (decay, gain) in enumerate(zip(self.decay, self.gain, strict=True)):
            found[k] = left_um[k] - decay * state
            state = decay * state + gain * found[k]
        return found / (self.std_um if left_um.ndim == 1 else self.std_um[:, None])


def _likeliest(time_s: _F, left_um: _F, learnt: NDArray[np.bool_]) -> _Memory:
    """Return the filter with the noise, size and memory that make some touches likeliest.

    The residual is a first-order Markov process, which is measured with noise.
    """
    least_um = TouchFilter().noise_um
    every = [np.ravel(one) for one in np.meshgrid(_MORE_UM, _SIZES_UM, _MEMORIES_S)]
    noise_um2, size_um2, memory_s = least_um**2 + every[0] ** 2, every[1] ** 2, every[2]
    decay = np.exp(-np.diff(time_s, prepend=time_s[:1])[:, None] / memory_s)
    grown_um2 = (1.0 - decay**2) * size_um2
    gain, s_um2, innovation = (np.empty_like(decay) for _ in range(3))
    state, p_um2 = np.zeros_like(size_um2), size_um2
    for k, left in enumerate(left_um.tolist()):
        p_um2 = decay[k] ** 2 * p_um2 + grown_um2[k]
        s_um2[k] = p_um2 + noise_um2
        gain[k] = p_um2 / s_um2[k]
        state = decay[k] * state
        innovation[k] = left - state
        state = state + gain[k] * innovation[k]
        p_um2 = gain[k] * noise_um2  # (1 - K) P
    far = np.minimum(innovation[learnt] ** 2 / s_um2[learnt], _CLIPPED**2)
    best = int(np.argmin(np.sum(far + np.log(s_um2[learnt]), axis=0)))
    return _Memory(decay[:, best], gain[:, best], np.sqrt(s_um2[:, best]))


def _weights(e: _F) -> _F:
    """Return how much innovations count: far ones less."""
    return np.minimum(1.0, _CLIPPED / np.maximum(np.abs(e), 1e-9))


def _rounded(values: _F) -> tuple[float, ...]:
    """Return numbers as short as they need to be: a night is stored as text."""
    return tuple(float(f"{value:.7g}") for value in values.tolist())


def without_mean(matrix: _F, vector: _F) -> tuple[_F, _F]:
    """Return normal equations with a mean of their own, which says nothing, solved for.

    Parameters
    ----------
    matrix, vector : float array
        Normal equations, (..., p, p) and (..., p); the mean is the first column.

    Notes
    -----
    A' = A - a a' / A_00 and b' = b - a b_0 / A_00 with the column a of the mean.
    """
    mean, total = matrix[..., 0], np.maximum(matrix[..., 0, 0], 1e-12)
    matrix = matrix - mean[..., :, None] * mean[..., None, :] / total[..., None, None]
    return matrix, vector - mean * (vector[..., 0] / total)[..., None]


def equations_of(found: Mapping[str, Any], *, mean: bool = True) -> tuple[_F, _F]:
    """Return stored normal equations, (p, p) and (p,), with or without what the mean says."""
    vector = np.array(found["vector"], float)
    upper = np.zeros((vector.size, vector.size))
    upper[np.triu_indices(vector.size)] = found["matrix"]
    matrix = upper + np.triu(upper, 1).T
    return (matrix, vector) if mean else without_mean(matrix, vector)


def figure_of(
    result: Mapping[str, Any], kind: SignKind, output: str, of: str
) -> tuple[tuple[float, float, float], bool] | None:
    """Return what a stored night says of one sign alone, and whether its zero is a new one.

    Parameters
    ----------
    result : mapping
        The night, as JSON has it.
    kind : SignKind
        The sign.
    output, of : str
        Its output, empty for a sensor, and its part or channels, or again the output.

    Returns
    -------
    tuple or None
        Value, standard deviation, and that of the days before; None where it says nothing.
    """
    for sign in result.get("signs", ()):
        if (sign["sign"], sign["of"] or sign["output"]) == (kind, of):
            return (sign["value"], sign["std"], sign["before"]), False
    for one in result.get("touched", ()):
        columns = [(column, name or one["output"]) for column, name in one["columns"]]
        if one["output"] == output and (kind, of) in columns:
            k, mean = columns.index((kind, of)), kind is SignKind.MEAN
            (a, b), (a_0, b_0) = (
                equations_of(one[which], mean=mean) for which in ("day", "before")
            )
            if a[k, k] <= 0.0:
                return None
            anew = mean and bool(one["datum_set"])
            value = float(b[k] / a[k, k])
            past = float(b_0[k] / a_0[k, k]) if a_0[k, k] > 0.0 and not anew else value
            return (value, float(a[k, k] ** -0.5), past), anew
    return None


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
