"""A model in free run along a log, as `cycle` runs it."""

from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import final

import numpy as np
from numpy.typing import NDArray

from thermaxis.compensation import (
    LARGEST_VALUE,
    STATED,
    CompensationModel,
    Outcome,
    Quality,
    Reading,
    ThermalState,
    gain_of,
    initial_state,
    model_step,
)
from thermaxis.thermal._arrays import FloatArray, recursion
from thermaxis.thermal.log import REFERENCE_S, LogLike, ThermalLog, as_thermal_log
from thermaxis.thermal.transfer_function import delayed

_SAME_STEP_S = 1e-6
_OF_DIAMETER = (Outcome.DIAMETER_HELD, Outcome.DIAMETER_UNKNOWN)


@final
@dataclass(frozen=True, slots=True, eq=False)
class SimulatedOutput:
    """An output of the model in free run along a log."""

    displacement_um: FloatArray
    """Displacement, (n,); NaN before the model could start. [µm]"""
    contribution_um: FloatArray
    """What every part contributes, (n, parts). [µm]"""
    parts: tuple[str, ...]


@final
@dataclass(frozen=True, slots=True, eq=False)
class SimulatedLog:
    """A model in free run along a log."""

    time_s: FloatArray
    """Times, (n,). [s]"""
    outputs: Mapping[str, SimulatedOutput]
    outside: Mapping[str, tuple[float, float]]
    """For inputs that left their training range: share of the rows, and by how much at most,
    relative to the width of the range."""
    bad: NDArray[np.bool_]
    """Rows in which an input had failed for too long, (n,)."""
    outcomes: Mapping[Outcome, int]
    """How often something was out of the ordinary."""

    @property
    def bad_share(self) -> float:
        """Share of the rows in which an input had failed for too long. [1]"""
        return float(np.mean(self.bad))


def references_of(
    model: CompensationModel, log: ThermalLog, reference_s: float | None
) -> dict[str, float]:
    """Return the level of every channel at the begin of the log, as `ThermalLog.start_of`."""
    if model.reference == STATED:
        return dict(model.reference_c)
    columns = zip(model.channels, model_columns(model, log), strict=True)
    first = log.time_s <= (reference_s or REFERENCE_S)
    return {
        channel: log.start_of(column, reference_s)
        for channel, column in columns
        if not bool(np.all(np.isnan(column[first])))
    }


def simulate_log(
    model: CompensationModel,
    log: LogLike,
    *,
    diameter_mm: float | None = None,
    reference_s: float | None = None,
    steady: bool = False,
) -> SimulatedLog:
    """Run a model along a log as `cycle` does, its `model_step` on every row.

    Parameters
    ----------
    log : ThermalLog or frame
        The log, as of `as_thermal_log`; it needs every channel of the model.
    diameter_mm : float, optional
        Clamping diameter of the workpiece. Default: the tool centre point. [mm]
    reference_s : float, optional
        The first time, as of `ThermalLog.start_of`: references are taken there, unless the model
        states them. [s]
    steady : bool
        Whether the inputs were for long what they are in the first row. Default: the machine is
        at rest at the references.

    Returns
    -------
    SimulatedLog
        Displacement and contributions, one row per row of the log.

    Raises
    ------
    DataError
        If the log lacks a channel of the model.

    Notes
    -----
    It is solved section by section, a thousand times faster: the same sums in another order. Only
    delays of no whole rows are stepped row by row.

    References
    ----------
    Mareš and Horejš 2021, equations (3) and (8).
    """
    log = as_thermal_log(log)
    columns = model_columns(model, log)
    state = initial_state(model, references_of(model, log, reference_s))._replace(warm=steady)
    # A delay of no whole rows takes its input apart.
    steps_s, delays_s = np.diff(log.time_s), np.array([part.delay_s for part in model.layout.parts])
    even = steps_s.size > 0 and float(np.ptp(steps_s)) <= _SAME_STEP_S
    rows = delays_s / steps_s[0] if even else delays_s
    apart = np.any(np.abs(rows - np.round(rows)) > _SAME_STEP_S) or (
        model.layout.delayed and not even
    )
    free_run = _row_by_row if apart else _by_sections
    shares, displacement, bad, outcomes = free_run(model, log, columns, state, diameter_mm)
    outputs = {
        output.name: SimulatedOutput(
            displacement[:, o],
            shares[:, slice(*model.layout.spans[o][:2])],
            tuple(part.name for part in output.parts),
        )
        for o, output in enumerate(model.outputs)
    }
    return SimulatedLog(
        time_s=log.time_s,
        outputs=outputs,
        outside=_outside(model, log, reference_s),
        bad=bad,
        outcomes=outcomes,
    )


_Run = tuple[FloatArray, FloatArray, NDArray[np.bool_], dict[Outcome, int]]
"""Contributions by part and displacement by output, a row each; bad rows; outcomes."""


def _row_by_row(
    model: CompensationModel,
    log: ThermalLog,
    columns: Sequence[FloatArray],
    state: ThermalState,
    diameter_mm: float | None,
) -> _Run:
    said: list[tuple[float, ...]] = []
    shares: list[tuple[float, ...]] = []
    waiting: list[bool] = []
    bad: list[bool] = []
    outcomes: Counter[Outcome] = Counter()
    table = np.stack(columns, axis=1).tolist()
    for time_s, row in zip(log.time_s.tolist(), table, strict=True):
        reading = Reading(time_s, dict(zip(model.channels, row, strict=True)), diameter_mm)
        state, output = model_step(model, state, reading)
        said.append(output.model_um)
        shares.append(tuple(chain.from_iterable(output.contribution_um)))
        waiting.append(state.time_s is None)
        outcomes.update(output.outcomes)
        bad.append(output.quality is Quality.BAD)
    displacement = np.array(said)
    displacement[np.array(waiting)] = np.nan
    return np.array(shares), displacement, np.array(bad), dict(outcomes)


def _by_sections(
    model: CompensationModel,
    log: ThermalLog,
    columns: Sequence[FloatArray],
    state: ThermalState,
    diameter_mm: float | None,
) -> _Run:
    """Return what `_row_by_row` returns, section by section from each start of the model."""
    layout, time_s = model.layout, log.time_s
    value = np.stack(columns)
    lost, failed = np.zeros((2, log.rows), dtype=np.bool_)
    for own in value:
        bad = ~(np.abs(own) <= LARGEST_VALUE)
        if not bool(np.any(bad)):
            continue
        row = np.arange(own.size, dtype=np.intp)
        last = np.asarray(np.maximum.accumulate(np.where(bad, -1, row)), dtype=np.intp)
        own[:] = np.where(last >= 0, own[last], np.nan)
        lost |= bad
        failed |= (last < 0) | (time_s - time_s[last] > model.longest_hold_s)
    outcomes: Counter[Outcome] = Counter()
    outcomes[Outcome.INPUT_FAILED] = int(np.count_nonzero(failed))
    outcomes[Outcome.INPUT_HELD] = int(np.count_nonzero(lost)) - outcomes[Outcome.INPUT_FAILED]
    shares = np.zeros((log.rows, len(layout.parts)))
    displacement = np.full((log.rows, len(layout.spans)), np.nan)
    reference = np.array(state.reference)
    for why, begin, end in _starts(time_s, failed, model.longest_gap_s):
        outcomes[why] += 1
        reference = np.where(np.isnan(reference), value[:, begin], reference)
        first = Reading(0.0, dict(zip(model.channels, value[:, begin].tolist(), strict=True)))
        begun = state._replace(reference=tuple(reference.tolist()))
        begun = begun._replace(warm=state.warm or why is not Outcome.STARTED)
        begun, said = model_step(model, begun, replace(first, diameter_mm=diameter_mm))
        of_diameter = [o for o in said.outcomes if o in _OF_DIAMETER]
        outcomes.update(dict.fromkeys(of_diameter, end - begin))
        rise = value[:, begin:end] - reference[:, None]
        raw = [
            rise[plus] - rise[minus] if minus >= 0 else rise[plus] for plus, minus in layout.wires
        ]
        outside = np.zeros(end - begin, dtype=np.bool_)
        for u, (low, high) in zip(raw, layout.ranges, strict=True):
            outside |= (u < low) | (u > high)
        outcomes[Outcome.OUTSIDE_VALIDITY] += int(np.count_nonzero(outside))
        steps_s = np.diff(time_s[begin:end])
        even_s = float(steps_s[0]) if steps_s.size and not np.ptp(steps_s) else steps_s
        filtered = raw
        if model.input_filter_s > 0.0:
            filtered = [_lag(u, even_s, model.input_filter_s, float(u[0])) for u in raw]
        sections = iter(begun.sections)
        for k, (part, wire) in enumerate(zip(layout.parts, layout.driven, strict=True)):
            u = delayed(filtered[wire], part.delay_s, float(steps_s[0]) if steps_s.size else 1.0)
            y = part.direct_gain_um_per_k * u
            for section in part.sections:
                lag = _lag(u, even_s, section.time_constant_s, next(sections))
                y += section.gain_um_per_k * lag
            shares[begin:end, k] = y * gain_of(part, diameter_mm)
        for o, (a, b, offset_um) in enumerate(layout.spans):
            displacement[begin:end, o] = offset_um + np.sum(shares[begin:end, a:b], axis=1)
    outcomes[Outcome.WAITING] = int(np.count_nonzero(np.isnan(displacement[:, 0])))
    return shares, displacement, failed, {o: count for o, count in outcomes.items() if count}


def _starts(
    time_s: FloatArray, failed: NDArray[np.bool_], longest_gap_s: float
) -> Iterator[tuple[Outcome, int, int]]:
    """Yield why and in which row the model starts, and the row behind its last one."""
    gaps = [*(1 + np.flatnonzero(np.diff(time_s) > longest_gap_s)).tolist(), failed.size]
    good = np.flatnonzero(~failed)
    why, row = Outcome.STARTED, 0
    while row < failed.size:
        if failed[row]:  # it waits, and then starts as if for the first time
            later = np.searchsorted(good, row)
            if later == good.size:
                return
            why, row = Outcome.STARTED, int(good[later])
        end = gaps[bisect_right(gaps, row)]
        yield why, row, end
        why, row = Outcome.GAP, end


def _lag(u: FloatArray, steps_s: FloatArray | float, tau_s: float, start: float) -> FloatArray:
    """Return the state of a lag: x(0) = start, x(k+1) - (1 - alpha) x(k) = alpha u(k)."""
    alpha = -np.expm1(-steps_s / tau_s)
    return recursion(1.0 - alpha, alpha * u[:-1], start)


def model_columns(model: CompensationModel, log: ThermalLog) -> list[FloatArray]:
    """Return the channels of the model, temperatures in degC whatever the log's unit."""
    return [log.plain_column(channel) for channel in model.channels]


def _outside(
    model: CompensationModel, log: ThermalLog, reference_s: float | None
) -> dict[str, tuple[float, float]]:
    """Return which inputs leave their training range, how often and by how much."""
    reference = references_of(model, log, reference_s)
    relative = {
        channel: values - reference.get(channel, np.nan)
        for channel, values in zip(model.channels, model_columns(model, log), strict=True)
    }
    found: dict[str, tuple[float, float]] = {}
    for output in model.outputs:
        for part in output.parts:
            if part.lowest_k is None or part.highest_k is None:
                continue
            u = relative[part.plus] - (relative[part.minus] if part.minus else 0.0)
            beyond = np.maximum(part.lowest_k - u, u - part.highest_k)
            share = float(np.mean(beyond > 0))
            if share > 0:
                width = max(part.highest_k - part.lowest_k, 1e-9)
                known = found.get(part.name, (0.0, 0.0))
                far = float(np.nanmax(beyond)) / width
                found[part.name] = (max(share, known[0]), max(far, known[1]))
    return found
