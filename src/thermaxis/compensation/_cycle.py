"""One cycle of the compensation: inputs and requests in, a limited correction out.

The only function that acts on a machine: it answers requests, judges the inputs, advances the
model, believes touches, asks the supervisor and limits the correction. Standard library only, no
clock, no input or output, no exception. The exported PLC block does the same.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple, TypeVar

from thermaxis.compensation._compensation import LONGEST_STEP_CYCLES, Compensation
from thermaxis.compensation._limits import SETTLED_UM, goal_step, limit_step
from thermaxis.compensation._model import STATED
from thermaxis.compensation._requests import (
    Answer,
    Asked,
    Machine,
    Request,
    Trim,
    aged,
    answer_request,
)
from thermaxis.compensation._sensors import (
    LARGEST_RULE,
    WITNESS_S,
    Sample,
    SampleQuality,
    SensorState,
    validate_sample,
)
from thermaxis.compensation._step import (
    ModelOutput,
    Outcome,
    Quality,
    Reading,
    ThermalState,
    initial_state,
    model_step,
    number,
)
from thermaxis.compensation._supervisor import (
    Memory,
    Motion,
    Reason,
    Signals,
    SupervisorState,
    supervisor_step,
)
from thermaxis.compensation._touches import (
    Expected,
    OffsetState,
    Touch,
    TouchOutcome,
    note_step,
    offset_std_um,
    offset_step,
    touches_step,
)

_Floats = tuple[float, ...]
_RESTARTS = {
    Outcome.STARTED,
    Outcome.WAITING,
    Outcome.GAP,
    Outcome.CLOCK_BACKWARD,
    Outcome.STATE_UNUSABLE,
}


class CycleReading(NamedTuple):
    """What one cycle gets. Whatever a source sends, `cycle` survives it."""

    time_s: float
    """Time of the cycle, of a clock that only goes forward. [s]"""
    samples: tuple[Sample, ...]
    """One per name in `judged` of the compensation: the model's channels, then others."""
    redundant: tuple[Sample | None, ...] = ()
    """The redundant sensors, in the same order; None where there is none; may be empty."""
    interlocks: tuple[bool | None, ...] = ()
    """Whether each interlock is met, in the order of the compensation; None (could not be read)
    is a lost input; a missing one is not met."""
    connected: bool = True
    """Whether the machine can be written to."""
    read_back_um: tuple[float | None, ...] | None = None
    """What the machine reports as the offset that was written in the last cycle, one per output;
    None where nothing could be read. [µm]"""
    found_um: tuple[float | None, ...] | None = None
    """Offsets found in the machine: at the start, after a lost connection, a silence or a look
    without an answer, in every cycle after one that was Off, and wherever one has moved by itself.
    The correction goes on from there. None where the last one written still stands; an output
    without one is not read back. [µm]"""
    other_compensation: bool | None = False
    """Whether another compensation is active on an axis; None (could not be read): lost input."""
    requests: tuple[Request, ...] = ()
    """What is asked, oldest first."""
    touches: tuple[Touch, ...] = ()
    """Touches of the probe that have become known since the last cycle, oldest first."""


class CycleState(NamedTuple):
    """What a cycle leaves for the next one: numbers and words only, so that it can be stored."""

    thermal: ThermalState
    """The model's state."""
    sensors: tuple[SensorState, ...]
    """Memory of the sensors, in the order of the samples."""
    redundant: tuple[SensorState, ...]
    """Memory of the redundant sensors, in the same order."""
    memory: Memory
    """Memory of the supervisor."""
    time_s: float
    """Time of the last cycle; NaN before the first. [s]"""
    correction_um: _Floats
    """Corrections in force, by output. [µm]"""
    goal_um: _Floats
    """Where they go. [µm]"""
    trims: tuple[Trim, ...]
    """Trims, by output."""
    diameter_mm: float | None = None
    """Clamping diameter of the workpiece; None for the tool centre point. [mm]"""
    offsets: tuple[OffsetState, ...] = ()
    """What touches have left, by output; empty where none are looked at."""
    expected: Expected = ()
    """What touches should have shown in the last cycles: model and correction in force."""


class CycleOutput(NamedTuple):
    """What one cycle says."""

    time_s: float
    """Time of the cycle. [s]"""
    state: SupervisorState
    """State of the compensation."""
    since_s: float
    """Time of the cycle in which it entered that state. [s]"""
    reasons: tuple[Reason, ...]
    """Why it is not active, the gravest first; empty while it is active."""
    correction_um: _Floats
    """What is to be written, by output: minus the model, weighted, trimmed and limited. [µm]"""
    wanted_um: _Floats
    """The same before rate and supervisor. [µm]"""
    model_um: _Floats
    """Displacement by output: tool point relative to workpiece, positive away from it. [µm]"""
    contribution_um: tuple[_Floats, ...]
    """What every part contributes, by output. [µm]"""
    weight: _Floats
    """Weight of the model by output; below 1 outside the range of its training logs. [1]"""
    trim_um: _Floats
    """Trims in force, by output. [µm]"""
    before_um: _Floats
    """What was in force before, by output. [µm]"""
    elapsed_s: float
    """Time since the last cycle. [s]"""
    at_limit: tuple[bool, ...]
    """Whether the model asks for more than the output limit allows, by output."""
    values: tuple[float | None, ...]
    """Values that the model was given, by channel; None where there was none. [degC]"""
    qualities: tuple[SampleQuality, ...]
    """What was wrong with each, in the order of `judged`: the model's channels, then others."""
    quality: Quality
    """Whether the model's output may be used."""
    outcomes: tuple[Outcome, ...]
    """What was out of the ordinary in the model."""
    answers: tuple[Answer, ...]
    """Answers to the requests, in their order."""
    settled: bool = False
    """Whether what is asked of the machine is what the model asks for: it follows the model, within
    the limits, and every correction has come as near as `SETTLED_UM` beyond its deadband. Not while
    it is held, fades, catches up after that, or waits for a machine that does not follow."""
    offset_um: _Floats = ()
    """What touches add to the corrections, by output; empty where none are looked at. [µm]"""
    offset_std_um: tuple[float | None, ...] = ()
    """Standard uncertainty of the tool point since the last touch, by output; None where none are
    looked at. [µm]"""
    touch_outcomes: tuple[TouchOutcome, ...] = ()
    """What became of the touches, in their order."""

    @property
    def to_go_um(self) -> _Floats:
        """Distance of the correction from what is wanted, by output, whatever the state. [µm]"""
        return tuple(abs(w - c) for w, c in zip(self.wanted_um, self.correction_um))

    @property
    def in_state_s(self) -> float:
        """For how long it has been in its state. [s]"""
        return max(self.time_s - self.since_s, 0.0)

    @property
    def rate_um_per_s(self) -> _Floats:
        """Change of the correction in this cycle, by output. [µm/s]"""
        if self.elapsed_s <= 0.0:
            return (0.0,) * len(self.correction_um)
        pairs = zip(self.before_um, self.correction_um)
        return tuple((b - a) / self.elapsed_s for a, b in pairs)


def cycle_state(
    compensation: Compensation, reference_c: Mapping[str, float] | None = None
) -> CycleState:
    """Return the state before the first cycle: off, with nothing read and nothing written.

    Parameters
    ----------
    compensation : Compensation
        What the machine is compensated with.
    reference_c : mapping, optional
        Reference by channel, as `initial_state` takes it. [degC]

    Returns
    -------
    CycleState
        The state.
    """
    thermal = initial_state(compensation.model, reference_c)
    unknown = (SensorState(),) * len(compensation.rules)
    nothing = (0.0,) * len(compensation.bounds)
    trims = (Trim(),) * len(compensation.bounds)
    return CycleState(thermal, unknown, unknown, Memory(), math.nan, nothing, nothing, trims)


def cycle(
    compensation: Compensation, state: CycleState, reading: CycleReading
) -> tuple[CycleState, CycleOutput]:
    """Advance the compensation by one cycle.

    Requests are answered, every input is validated, the model is advanced, the supervisor decides,
    and the correction goes where it is allowed to go: towards minus the weighted model plus trim
    and offset of touches while active, nowhere while it is held or off, towards zero while it
    fades; never by more than the rate, never beyond the total. A correction that was found beyond
    the total stays while it is off, and else comes back at the rate.

    Not protected: the correction is what is asked of the machine. Sign, unit and obedience of the
    axis are the sink's and the commissioning's. The rate holds from cycle to cycle: at a cycle of
    a minute the machine sees a step of a minute's allowance.

    Parameters
    ----------
    compensation : Compensation
        Model, rules and limits.
    state : CycleState
        What `cycle_state` or the last cycle returned.
    reading : CycleReading
        Time, samples and requests.

    Returns
    -------
    state : CycleState
        For the next cycle.
    output : CycleOutput
        What is to be written, and everything that a person should see.
    """
    read_s = number(reading.time_s)
    time_s = state.time_s if read_s is None else read_s
    elapsed_s = max(0.0, time_s - state.time_s)  # 0 before the first cycle, whose time is NaN
    in_force, outside = _in_force(compensation, state, reading)
    agrees = _agrees(compensation, in_force, reading)

    connected, other = reading.connected is True, reading.other_compensation
    machine = Machine(connected and agrees, outside, other)
    trims = tuple(aged(trim, elapsed_s) for trim in state.trims)
    asked = Asked(state.memory, trims, state.diameter_mm)
    answers: list[Answer] = []
    for request in reading.requests:
        asked, answer = answer_request(compensation, asked, machine, request)
        answers.append(answer)

    validated = _validated(compensation, state, reading, asked, (time_s, elapsed_s))
    values = validated.values
    read = Reading(
        reading.time_s, dict(zip(compensation.model.channels, values)), asked.diameter_mm
    )
    thermal, model = model_step(compensation.model, state.thermal, read)
    weights = _weights(compensation, thermal, model)
    step_s = min(elapsed_s, LONGEST_STEP_CYCLES * compensation.cycle_s)
    runs = _RESTARTS.isdisjoint(model.outcomes)
    follows = connected and agrees and other is False and in_force == state.correction_um
    expected = state.expected if follows and runs and not asked.forgets_touches else ()
    touched = _touched(compensation, state, reading, expected, asked, (time_s, step_s), runs=runs)
    offsets, touch_outcomes = touched
    offset_um = tuple(one.in_force_um for one in offsets)
    wanted_um, at_limit = _wanted(compensation, weights, model, asked.trims, offset_um)

    unread = None in values or None in reading.interlocks or other is None
    signals = Signals(
        inputs_usable=elapsed_s > 0.0 and not unread and model.quality is not Quality.BAD,
        model_runs=runs,
        connected=connected,
        interlocks_met=_met(compensation, reading),
        read_back_agrees=agrees,
        at_limit=any(at_limit),
        other_compensation=other is True,
        offset_outside=outside,
        at_zero=not any(in_force),
        model_usable=model.quality is not Quality.BAD,
    )
    memory, reasons, motion = supervisor_step(
        compensation.supervisor, asked.memory, signals, time_s, elapsed_s or compensation.cycle_s
    )

    goal_um = correction_um = in_force
    if motion is not Motion.STAYS:
        goal_um = {
            Motion.FOLLOWS: wanted_um,
            Motion.TO_ZERO: (0.0,) * len(in_force),
            Motion.TO_ZERO_WITH_MACHINE: _followed(compensation, in_force, reading),
        }[motion]
        rows = zip(compensation.bounds, state.goal_um, goal_um, in_force)
        goal_um = tuple(goal_step(*row) for row in rows)
        rows = zip(compensation.bounds, in_force, goal_um)
        correction_um = tuple(limit_step(*row, step_s) for row in rows)
    rows = zip(compensation.bounds, wanted_um, correction_um)
    near = all(abs(w - c) <= limits.deadband_um + SETTLED_UM for limits, w, c in rows)
    if offsets:
        rows = zip(correction_um, weights, model.model_um)
        row = tuple(c + weight * y for c, weight, y in rows)
        usable = runs and model.quality is not Quality.BAD
        expected = note_step(compensation.probed, expected, time_s, row) if usable else ()

    new = CycleState(
        thermal,
        validated.sensors,
        validated.redundant,
        memory,
        time_s,
        correction_um,
        goal_um,
        asked.trims,
        asked.diameter_mm,
        offsets,
        expected,
    )
    return new, CycleOutput(
        time_s=_finite(time_s),
        state=memory.state,
        since_s=_finite(memory.since_s),
        reasons=reasons,
        correction_um=correction_um,
        wanted_um=wanted_um,
        model_um=model.model_um,
        contribution_um=model.contribution_um,
        weight=weights,
        trim_um=tuple(trim.value_um for trim in asked.trims),
        before_um=in_force,
        elapsed_s=elapsed_s,
        at_limit=at_limit,
        values=values,
        qualities=validated.qualities,
        quality=model.quality,
        outcomes=model.outcomes,
        answers=tuple(answers),
        settled=near and motion is Motion.FOLLOWS and not any(at_limit),
        offset_um=offset_um,
        offset_std_um=tuple(
            None if own is None else offset_std_um(own, one, time_s)
            for own, one in zip(compensation.probed, offsets)
        ),
        touch_outcomes=touch_outcomes,
    )


# ---- what the machine says ----------------------------------------------------------------------


def _numbers(row: Sequence[object] | None, count: int) -> tuple[float | None, ...]:
    """Return so many numbers, None for each that is lacking or none."""
    return (*[number(one, LARGEST_RULE) for one in row or ()], *(None,) * count)[:count]


def _finite(value: float) -> float:
    """Return a finite number: zero for a time before any was read, or a stored state's NaN."""
    return value if math.isfinite(value) else 0.0


def _in_force(
    compensation: Compensation, state: CycleState, reading: CycleReading
) -> tuple[_Floats, bool]:
    """Return the corrections in force, and whether one lies outside its total or is no number."""
    found = _numbers(reading.found_um, len(state.correction_um))
    in_force = [c if f is None else f for c, f in zip(state.correction_um, found)]
    outside = any(not abs(c) <= b.total_um for c, b in zip(in_force, compensation.bounds))
    return tuple(_finite(c) for c in in_force), outside


def _read_back(in_force: _Floats, reading: CycleReading) -> tuple[float | None, ...]:
    """Return what the machine reports, by output; None where that is no number."""
    read = reading.read_back_um
    fits = read is not None and len(read) == len(in_force)
    return _numbers(read if fits else None, len(in_force))


def _agrees(compensation: Compensation, in_force: _Floats, reading: CycleReading) -> bool:
    """Whether every output was found in this cycle, or is read back as it was written."""
    tolerance_um = compensation.supervisor.read_back_tolerance_um
    found = _numbers(reading.found_um, len(in_force))
    return all(
        f is not None or (said is not None and abs(said - c) <= tolerance_um)
        for f, said, c in zip(found, _read_back(in_force, reading), in_force)
    )


def _met(compensation: Compensation, reading: CycleReading) -> bool:
    """Whether no interlock is open; one that could not be read is a lost input instead."""
    wanted = len(compensation.interlocks)
    met = reading.interlocks[:wanted]
    return len(met) == wanted and all(one in (True, None) for one in met)


# ---- inputs -------------------------------------------------------------------------------------


class _Validated(NamedTuple):
    """What was read: values of the model's channels, the rest of everything that is judged."""

    values: tuple[float | None, ...]
    qualities: tuple[SampleQuality, ...]
    sensors: tuple[SensorState, ...]
    redundant: tuple[SensorState, ...]


def _validated(
    compensation: Compensation,
    state: CycleState,
    reading: CycleReading,
    asked: Asked,
    clock: tuple[float, float],
) -> _Validated:
    """Validate every channel; a redundant sensor stands in, or contradicts."""
    sensors, redundant = list(state.sensors), list(state.redundant)
    if asked.accepts_sensors:
        sensors, redundant = [SensorState()] * len(sensors), [SensorState()] * len(redundant)
    if clock[1] > compensation.model.longest_gap_s:  # nobody has seen a value stand meanwhile
        sensors, redundant = (
            [_sensor_shifted(one, clock[1]) for one in ones] for ones in (sensors, redundant)
        )
    values: list[float | None] = []
    qualities: list[SampleQuality] = []
    rows = zip(compensation.judged, compensation.rules, compensation.witnesses)
    for k, (channel, rules, other_k) in enumerate(rows):
        witness = sensors[other_k] if other_k >= 0 else SensorState()
        if clock[0] - witness.changed_s <= min(WITNESS_S, compensation.rules[other_k].frozen_s):
            witness = witness._replace(refused=False)  # lively: one that is not read for a moment
        sample = _sample(reading.samples, k)
        quality, sensors[k] = validate_sample(rules, sensors[k], sample, *clock, witness)
        value = sample.value if quality is SampleQuality.GOOD else None
        if channel in compensation.redundant:
            other = _sample(reading.redundant, k)
            seen, redundant[k] = validate_sample(rules, redundant[k], other, *clock, witness)
            second = other.value if seen is SampleQuality.GOOD else None
            if second is None:
                pass
            elif value is None:
                value, quality = second, SampleQuality.REDUNDANT
            elif abs(value - second) > rules.largest_difference_k:
                value, quality = None, SampleQuality.DISAGREES
        values.append(value)
        qualities.append(quality)
    count = len(compensation.model.channels)
    return _Validated(tuple(values[:count]), tuple(qualities), tuple(sensors), tuple(redundant))


def _sample(samples: Sequence[object], k: int) -> Sample:
    """Return the sample of a channel, whatever a source sent."""
    sample = samples[k] if k < len(samples) else None
    return sample if isinstance(sample, Sample) else Sample(None, good=False, age_s=None)


# ---- corrections --------------------------------------------------------------------------------


def _weights(compensation: Compensation, thermal: ThermalState, model: ModelOutput) -> _Floats:
    """Return the weight of every output: less than 1 where an input is outside its range."""
    if Outcome.OUTSIDE_VALIDITY not in model.outcomes:
        return (1.0,) * len(compensation.bounds)
    layout = compensation.model.layout
    outside_k: list[float] = []
    for part, k in zip(layout.parts, layout.driven):
        low, high = part.range_k
        outside_k.append(max(0.0, low - thermal.raw[k], thermal.raw[k] - high))
    furthest_k = (max(outside_k[first:behind]) for first, behind, _ in layout.spans)
    margin_k, lowest = compensation.validity_margin_k, compensation.lowest_weight
    return tuple(max(lowest, 1.0 - k / margin_k) for k in furthest_k)


def _touched(
    compensation: Compensation,
    state: CycleState,
    reading: CycleReading,
    expected: Expected,
    asked: Asked,
    clock: tuple[float, float],
    *,
    runs: bool,
) -> tuple[tuple[OffsetState, ...], tuple[TouchOutcome, ...]]:
    """Return the offsets that touches leave; none is known of another datum or a new start."""
    probed, (time_s, step_s) = compensation.probed, clock
    if not compensation.touches:
        return (), ()
    before = state.offsets if len(state.offsets) == len(probed) else (OffsetState(),) * len(probed)
    if asked.forgets_touches or not runs:
        before = [one.anew() for one in before]
    if asked.accepts_sensors:
        before = [one.anew()._replace(off=None) if one.off else one for one in before]
    names = [output.name for output in compensation.model.outputs]
    states, outcomes = touches_step(probed, names, before, expected, reading.touches, time_s)
    rows = zip(probed, states)
    moved = (one if own is None else offset_step(own, one, step_s) for own, one in rows)
    return tuple(moved), outcomes


def _wanted(
    compensation: Compensation,
    weights: _Floats,
    model: ModelOutput,
    trims: tuple[Trim, ...],
    offset_um: _Floats,
) -> tuple[_Floats, tuple[bool, ...]]:
    """Return what the corrections should be, and whether the model asks for more than allowed.

    Minus the weighted model within the output limit, with trim and the offset of touches, within
    the total limit.
    """
    wanted_um: list[float] = []
    at_limit: list[bool] = []
    added_um = [trim.value_um for trim in trims]
    if offset_um:
        added_um = [trim_um + own_um for trim_um, own_um in zip(added_um, offset_um)]
    adds = any(added_um)  # as in the PLC: a zero keeps its sign without
    for limits, weight, y, more_um in zip(compensation.bounds, weights, model.model_um, added_um):
        c = min(max(-weight * y, -limits.largest_um), limits.largest_um)
        at_limit.append(abs(weight * y) > limits.largest_um)
        if adds:
            c = min(max(c + more_um, -limits.total_um), limits.total_um)
        wanted_um.append(c)
    return tuple(wanted_um), tuple(at_limit)


def _followed(compensation: Compensation, in_force: _Floats, reading: CycleReading) -> _Floats:
    """Return the goals of a fault: zero, but no further than the machine is seen to follow.

    An offset that the machine keeps although another is written would jump on the day on which
    it is written again. So the correction waits for it, and never moves outward.
    """
    tolerance_um = compensation.supervisor.read_back_tolerance_um
    goals: list[float] = []
    for said, c in zip(_read_back(in_force, reading), in_force):
        if said is None or abs(said - c) <= tolerance_um:
            goals.append(0.0)
        else:
            goals.append(min(max(said, 0.0), c) if c > 0.0 else max(min(said, 0.0), c))
    return tuple(goals)


# ---- another model, another clock ---------------------------------------------------------------


def with_compensation(
    new: Compensation,
    old: Compensation,
    state: CycleState,
    past: Sequence[tuple[float, Mapping[str, float]]] = (),
) -> CycleState:
    """Return the state with which another model goes on, without a bump.

    The correction in force stays and the new model takes over at the allowed rate once it has
    settled. It refers to the temperatures that the old one referred to, as far as it has the same
    channels, and starts at the steady state: the machine is warm already.

    Parameters
    ----------
    new : Compensation
        Model, rules and limits from now on; it has the outputs of the old one.
    old : Compensation
        Those of the state.
    state : CycleState
        State of the old one.
    past : sequence
        Rows of time [s] and values by channel [degC], oldest first: the new model runs along them,
        so that it is where it would be. Default: none; it starts at the steady state of its first
        reading, which a machine that warms up or cools is not in.

    Returns
    -------
    CycleState
        For the next cycle with the new one; of outputs that the old one lacks the correction is
        zero.
    """
    channels = old.model.channels
    references = dict(zip(channels, state.thermal.reference, strict=False))
    if new.model.reference == STATED:
        references = dict(new.model.reference_c)
    known = {c: r for c, r in references.items() if r == r}  # noqa: PLR0124 - NaN is no reference
    names = [output.name for output in old.model.outputs]
    thermal = initial_state(new.model, known)
    if state.thermal.time_s is not None:
        thermal = thermal._replace(warm=True)
    for time_s, values in past:
        if all(channel in values for channel in new.model.channels):
            thermal, _ = model_step(new.model, thermal, Reading(time_s, values))
    return CycleState(
        thermal,
        tuple(_of(old.judged, state.sensors, c, SensorState()) for c in new.judged),
        tuple(_of(old.judged, state.redundant, c, SensorState()) for c in new.judged),
        state.memory._replace(running_s=0.0, ready_s=0.0),
        state.time_s,
        tuple(_of(names, state.correction_um, o.name, 0.0) for o in new.model.outputs),
        tuple(_of(names, state.goal_um, o.name, 0.0) for o in new.model.outputs),
        tuple(_of(names, state.trims, o.name, Trim()) for o in new.model.outputs),
        state.diameter_mm,
        tuple(_of(names, state.offsets, o.name, OffsetState()).anew() for o in new.model.outputs)
        if state.offsets
        else (),
    )


def shifted(state: CycleState, by_s: float) -> CycleState:
    """Return the state on another clock, as after a restart of the computer.

    Parameters
    ----------
    state : CycleState
        The state.
    by_s : float
        What the new clock shows more than the old one at the same moment. [s]

    Returns
    -------
    CycleState
        The same state with every time on the new clock.
    """
    thermal = state.thermal
    moved = thermal._replace(
        time_s=None if thermal.time_s is None else thermal.time_s + by_s,
        good_s=tuple(t + by_s for t in thermal.good_s),
        history=tuple((t + by_s, rows) for t, rows in thermal.history),
    )
    return state._replace(
        thermal=moved,
        sensors=tuple(_sensor_shifted(sensor, by_s) for sensor in state.sensors),
        redundant=tuple(_sensor_shifted(sensor, by_s) for sensor in state.redundant),
        memory=state.memory._replace(since_s=state.memory.since_s + by_s),
        time_s=state.time_s + by_s,
        offsets=tuple(one.shifted(by_s) for one in state.offsets),
        expected=tuple((since_s + by_s, row) for since_s, row in state.expected),
    )


def _sensor_shifted(sensor: SensorState, by_s: float) -> SensorState:
    return sensor._replace(changed_s=sensor.changed_s + by_s)


_T = TypeVar("_T")


def _of(names: Sequence[str], values: Sequence[_T], name: str, otherwise: _T) -> _T:
    return values[names.index(name)] if name in names else otherwise
