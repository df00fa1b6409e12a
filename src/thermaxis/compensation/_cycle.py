"""One cycle of the compensation: inputs and requests in, a limited correction out.

The only function that acts on a machine: it judges the inputs, advances the model, asks the
supervisor and limits the correction. Standard library only, no clock, no input or output, no
exception. The exported PLC block does the same.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, TypeVar

from thermaxis.compensation._compensation import (
    LONGEST_STEP_CYCLES,
    NO_TRIM,
    Compensation,
    Trim,
)
from thermaxis.compensation._model_step import (
    LATEST_S,
    ModelOutput,
    Reading,
    ThermalState,
    advance,
    initial_state,
    model_step,
)
from thermaxis.compensation._quality import (
    LARGEST_RULE,
    Outcome,
    Quality,
    Sample,
    SampleQuality,
    SensorState,
    judge,
)
from thermaxis.compensation._requests import Answer, Request, RequestKind
from thermaxis.compensation._supervisor import (
    Memory,
    Reason,
    Signals,
    SupervisorState,
    supervisor_step,
)
from thermaxis.compensation._thermal_model import STATED, range_of

_Floats = tuple[float, ...]


class CycleReading(NamedTuple):
    """What one cycle gets. Whatever a source sends, `cycle` survives it."""

    time_s: float
    """Time of the cycle, of a clock that only goes forward. [s]"""
    samples: tuple[Sample, ...]
    """One per channel of the model, in its order."""
    spares: tuple[Sample | None, ...] = ()
    """The second sensors, in the same order; None where there is none; may be empty."""
    interlocks: tuple[bool | None, ...] = ()
    """Whether each interlock is met, in the order of the compensation; None where that could not
    be read, which counts as a lost input; a missing one is not met."""
    connected: bool = True
    """Whether the machine can be written to."""
    read_back_um: tuple[float | None, ...] | None = None
    """What the machine reports as the offset that was written in the last cycle, one per output;
    None where nothing could be read. While it differs nothing moves on; once that is a fault,
    the correction goes to zero no further than the machine follows. [µm]"""
    found_um: tuple[float | None, ...] | None = None
    """Offsets found in the machine at the start, after a lost connection, and by the caller in
    every cycle in which it was Off before, because nothing was written then and anybody may have
    changed them: the correction goes on from there. None where the last one written still stands;
    an output whose offset was not found counts as one that is not read back. [µm]"""
    other_compensation: bool | None = False
    """Whether another compensation is active on an axis; None where that could not be read, which
    counts as a lost input."""
    requests: tuple[Request, ...] = ()
    """What is asked, oldest first."""


class CycleState(NamedTuple):
    """What a cycle leaves for the next one: numbers and words only, so that it can be stored."""

    thermal: ThermalState
    """The model's state."""
    sensors: tuple[SensorState, ...]
    """Memory of the sensors, in the order of the channels."""
    spares: tuple[SensorState, ...]
    """Memory of the second sensors, in the same order."""
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
    """Whether the model asks for more than the magnitude allows, by output."""
    values: tuple[float | None, ...]
    """Values that the model was given, by channel; None where there was none. [degC]"""
    qualities: tuple[SampleQuality, ...]
    """What was wrong with each, by channel."""
    quality: Quality
    """Whether the model's output may be used."""
    outcomes: tuple[Outcome, ...]
    """What was out of the ordinary in the model."""
    answers: tuple[Answer, ...]
    """Answers to the requests, in their order."""

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


_MISSING = Sample(None, good=False, age_s=None)
_UNKNOWN_SENSOR = SensorState()
_RESTARTS = frozenset(
    {
        Outcome.STARTED,
        Outcome.WAITING,
        Outcome.GAP,
        Outcome.CLOCK_BACKWARD,
        Outcome.STATE_UNUSABLE,
    }
)
_TO_ZERO = frozenset({SupervisorState.FADING, SupervisorState.FAULT})
LARGEST_DIAMETER_MM = 1e5
"""Largest clamping diameter: a hundred metres. [mm]"""


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
    channels, outputs = len(compensation.rules), len(compensation.bounds)
    return CycleState(
        initial_state(compensation.model, reference_c),
        (_UNKNOWN_SENSOR,) * channels,
        (_UNKNOWN_SENSOR,) * channels,
        Memory(),
        math.nan,
        (0.0,) * outputs,
        (0.0,) * outputs,
        compensation.no_trims,
    )


def cycle(
    compensation: Compensation, state: CycleState, reading: CycleReading
) -> tuple[CycleState, CycleOutput]:
    """Advance the compensation by one cycle.

    Requests are answered, every input is judged, the model is advanced, the supervisor decides,
    and the correction goes where it is allowed to go: towards minus the weighted model plus the
    trim while active, nowhere while it is held or off, towards zero while it fades; never by more
    than the rate, never beyond the total. A correction that was found beyond the total stays
    while it is off, and else comes back at the rate.

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
    # Taken apart once: to ask a tuple for its fields by name costs a tenth of the cycle.
    before, sensors, spares, memory, before_s, in_force, old_goal_um, trims, diameter_mm = state
    read_s, _, _, interlocks, connected, read_back_um, found_um, other, requests = reading
    time_s, elapsed_s = _clock(before_s, read_s)
    if found_um is not None:
        in_force = _rebased(in_force, found_um)
    # A calm cycle has left its corrections inside.
    outside = (not memory.calm or found_um is not None) and _outside(compensation, in_force)
    if outside:
        in_force = _finite(in_force)
    if trims is not compensation.no_trims:
        trims = _aged(compensation, trims, elapsed_s)
    answers: tuple[Answer, ...] = ()
    if requests:
        asked = _Asked(compensation, memory, trims, diameter_mm, in_force, reading)
        answers = tuple([asked.answer(request) for request in requests])
        memory, trims, diameter_mm = asked.memory, asked.trims, asked.diameter_mm
        if asked.acknowledged:
            sensors = spares = (_UNKNOWN_SENSOR,) * len(sensors)
    values, qualities, sensors, spares = _judged(
        compensation, sensors, spares, reading, (time_s, elapsed_s)
    )
    thermal, model = advance(compensation.model, before, read_s, values, diameter_mm)
    _, model_um, contribution_um, quality, outcomes = model
    weights = compensation.ones if not outcomes else _weights(compensation, thermal, model)
    wanted_um, at_limit = _wanted(compensation, weights, model_um, trims)
    agrees = read_back_um == in_force or _agrees(compensation, in_force, reading)
    reasons: tuple[Reason, ...] = ()
    calm = (
        memory.calm
        and not outcomes
        and agrees
        and at_limit is compensation.falses
        and not outside
        and connected is True
        and other is False
        and interlocks == compensation.met
    )
    goal_um, said_s, since_s = wanted_um, time_s, memory.since_s
    if not calm:
        signals = Signals(
            inputs_usable=elapsed_s > 0.0 and _inputs_usable(reading, values, quality),
            model_runs=_RESTARTS.isdisjoint(outcomes),
            connected=connected is True,
            interlocks_met=_met(compensation, reading),
            read_back_agrees=agrees,
            at_limit=True in at_limit,
            other_compensation=other is True,
            offset_outside=outside,
            at_zero=not any(in_force),
        )
        counted_s = elapsed_s or compensation.cycle_s
        memory, reasons = supervisor_step(
            compensation.supervisor, memory, signals, time_s, counted_s
        )
        if memory.state is not SupervisorState.ACTIVE or quality is Quality.BAD or not agrees:
            goal_um = _goal_unless_active(compensation, memory.state, in_force, reading, agrees)
        said_s, since_s = _number_or_zero(time_s), _number_or_zero(memory.since_s)
    longest_s = LONGEST_STEP_CYCLES * compensation.cycle_s
    step_s = min(longest_s, elapsed_s)
    goal_um, correction_um = _limited(compensation, in_force, old_goal_um, goal_um, step_s)
    new = CycleState(
        thermal, sensors, spares, memory, time_s, correction_um, goal_um, trims, diameter_mm
    )
    return new, CycleOutput(
        said_s,
        memory.state,
        since_s,
        reasons,
        correction_um,
        wanted_um,
        model_um,
        contribution_um,
        weights,
        compensation.zeros if trims is compensation.no_trims else _trims_um(trims),
        in_force,
        elapsed_s,
        at_limit,
        values,
        qualities,
        quality,
        outcomes,
        answers,
    )


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
        tuple(_of(channels, state.sensors, c, _UNKNOWN_SENSOR) for c in new.model.channels),
        tuple(_of(channels, state.spares, c, _UNKNOWN_SENSOR) for c in new.model.channels),
        state.memory._replace(running_s=0.0, ready_s=0.0, calm=False),
        state.time_s,
        tuple(_of(names, state.correction_um, o.name, 0.0) for o in new.model.outputs),
        tuple(_of(names, state.goal_um, o.name, 0.0) for o in new.model.outputs),
        tuple(_of(names, state.trims, o.name, NO_TRIM) for o in new.model.outputs),
        state.diameter_mm,
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
        spares=tuple(_sensor_shifted(sensor, by_s) for sensor in state.spares),
        memory=state.memory._replace(since_s=state.memory.since_s + by_s),
        time_s=state.time_s + by_s,
    )


def _sensor_shifted(sensor: SensorState, by_s: float) -> SensorState:
    return sensor._replace(changed_s=sensor.changed_s + by_s)


_T = TypeVar("_T")


def _of(names: Sequence[str], values: Sequence[_T], name: str, otherwise: _T) -> _T:
    return values[names.index(name)] if name in names else otherwise


# ---- reading ------------------------------------------------------------------------------------


def _clock(before_s: float, time_s: float) -> tuple[float, float]:
    """Return the time of the cycle and the time since the last one, never negative."""
    if type(time_s) is not float or not -LATEST_S <= time_s <= LATEST_S:
        usable_s = _usable(time_s, LATEST_S)
        if usable_s is None:
            return before_s, 0.0
        time_s = usable_s
    elapsed_s = time_s - before_s
    return time_s, max(0.0, elapsed_s)


def _usable(value: object, largest: float = LARGEST_RULE) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if abs(value) <= largest else None


def _rebased(in_force: _Floats, found_um: tuple[float | None, ...]) -> _Floats:
    """Return the corrections in force where the machine was found elsewhere."""
    found = [_usable(f) for f in (*found_um, *(None,) * len(in_force))]
    return tuple(c if f is None else f for c, f in zip(in_force, found, strict=False))


def _number_or_zero(value: float) -> float:
    """Return a finite number: zero for a time before any was read, or a stored state's NaN."""
    return value if math.isfinite(value) else 0.0


def _finite(in_force: _Floats) -> _Floats:
    """Return the corrections in force, those of a stored state of any origin too."""
    return tuple([_number_or_zero(c) for c in in_force])


_Judged = tuple[
    tuple[float | None, ...],
    tuple[SampleQuality, ...],
    tuple[SensorState, ...],
    tuple[SensorState, ...],
]


def _judged(
    compensation: Compensation,
    sensors: tuple[SensorState, ...],
    spares: tuple[SensorState, ...],
    reading: CycleReading,
    clock: tuple[float, float],
) -> _Judged:
    """Return value and quality of every channel, and what the judgement remembers."""
    time_s, elapsed_s = clock
    samples = reading.samples
    if len(samples) != len(sensors):
        samples = (*samples, *(_MISSING,) * len(sensors))[: len(sensors)]
    values: list[float | None] = []
    qualities: tuple[SampleQuality, ...] = compensation.all_good
    remembered: list[SensorState] = []
    for rules, sensor, sample in zip(compensation.rules, sensors, samples):
        if type(sample) is not Sample:
            sample = _MISSING  # noqa: PLW2901 - whatever a source sends
        quality, remembers = judge(rules, sensor, sample, time_s, elapsed_s)
        remembered.append(remembers)
        if quality is SampleQuality.GOOD:
            values.append(sample[0])
        else:
            k = len(values)
            values.append(None)
            qualities = (*qualities[:k], quality, *qualities[k + 1 :])
    if compensation.spares:
        found = list(qualities)
        spares = _with_spares(compensation, spares, reading, clock, (values, found))
        qualities = tuple(found)
    return tuple(values), qualities, tuple(remembered), spares


def _with_spares(
    compensation: Compensation,
    spares: tuple[SensorState, ...],
    reading: CycleReading,
    clock: tuple[float, float],
    judged: tuple[list[float | None], list[SampleQuality]],
) -> tuple[SensorState, ...]:
    """Let spare sensors stand in, or contradict; return what their judgement remembers."""
    values, qualities = judged
    remembered = list(spares)
    samples = (*reading.spares, *(None,) * len(spares))
    for k, channel in enumerate(compensation.model.channels):
        if channel not in compensation.spares:
            continue
        rules, sample = compensation.rules[k], samples[k]
        if type(sample) is not Sample:
            sample = _MISSING
        quality, remembered[k] = judge(rules, spares[k], sample, *clock)
        if quality is not SampleQuality.GOOD or sample.value is None:
            continue
        value = values[k]
        if value is None:
            values[k], qualities[k] = sample.value, SampleQuality.SPARE
        elif abs(value - sample.value) > rules.largest_difference_k:
            values[k], qualities[k] = None, SampleQuality.DISAGREES
    return tuple(remembered)


def _weights(compensation: Compensation, thermal: ThermalState, model: ModelOutput) -> _Floats:
    """Return the weight of every output: less than 1 where an input is outside its range."""
    if Outcome.OUTSIDE_VALIDITY not in model.outcomes:
        return compensation.ones
    margin_k, lowest = compensation.validity_margin_k, compensation.lowest_weight
    layout = compensation.model.layout
    weights: list[float] = []
    for first, behind, _ in layout.spans:
        outside_k = 0.0
        for k in range(first, behind):
            low, high = range_of(layout.parts[k])
            u = thermal.raw[layout.driven[k]]
            outside_k = max(outside_k, low - u, u - high)
        weights.append(max(lowest, 1.0 - outside_k / margin_k))
    return tuple(weights)


# ---- signals ------------------------------------------------------------------------------------


def _inputs_usable(
    reading: CycleReading, values: tuple[float | None, ...], quality: Quality
) -> bool:
    return (
        None not in values
        and quality is not Quality.BAD
        and None not in reading.interlocks
        and reading.other_compensation is not None
    )


def _met(compensation: Compensation, reading: CycleReading) -> bool:
    wanted = len(compensation.interlocks)
    if not wanted:
        return True
    met = reading.interlocks
    return len(met) >= wanted and all(one in (True, None) for one in met[:wanted])


def _agrees(compensation: Compensation, in_force: _Floats, reading: CycleReading) -> bool:
    tolerance_um = compensation.supervisor.read_back_tolerance_um
    found_um = reading.found_um or ()
    for k, (said, written) in enumerate(zip(_read_back(in_force, reading), in_force)):
        if k < len(found_um) and _usable(found_um[k]) is not None:
            continue
        if said is None or abs(said - written) > tolerance_um:
            return False
    return True


def _read_back(in_force: _Floats, reading: CycleReading) -> tuple[float | None, ...]:
    """Return what the machine reports, by output; None where that is no number."""
    read = reading.read_back_um
    if read is None or len(read) != len(in_force):
        return (None,) * len(in_force)
    return tuple([_usable(said) for said in read])


def _outside(compensation: Compensation, in_force: _Floats) -> bool:
    """Whether a correction in force lies outside its total, or is no number."""
    for (_, total, _, _), c in zip(compensation.rows, in_force):  # noqa: SIM110 - half the time of any()
        if not -total <= c <= total:
            return True
    return False


# ---- requests -----------------------------------------------------------------------------------


def _aged(
    compensation: Compensation, trims: tuple[Trim, ...], elapsed_s: float
) -> tuple[Trim, ...]:
    """Return the trims that have not expired."""
    left = tuple(
        [
            trim._replace(left_s=trim.left_s - elapsed_s) if trim.left_s > elapsed_s else NO_TRIM
            for trim in trims
        ]
    )
    return left if any(trim.value_um for trim in left) else compensation.no_trims


class _Asked:
    """Answers the requests of one cycle, one after the other."""

    def __init__(
        self,
        compensation: Compensation,
        memory: Memory,
        trims: tuple[Trim, ...],
        diameter_mm: float | None,
        in_force: _Floats,
        reading: CycleReading,
    ) -> None:
        self.compensation = compensation
        self.memory = memory
        self.trims = trims
        self.diameter_mm = diameter_mm
        self.in_force = in_force
        self.reading = reading
        self.acknowledged = False
        self.answers: dict[object, Callable[[Request], tuple[bool, str]]] = {
            RequestKind.ENABLE: self._enable,
            RequestKind.DISABLE: self._disable,
            RequestKind.HOLD: self._hold,
            RequestKind.RESUME: self._resume,
            RequestKind.TRIM: self._trim,
            RequestKind.DIAMETER: self._diameter,
            RequestKind.ACKNOWLEDGE: self._acknowledge,
        }

    def answer(self, request: Request) -> Answer:
        """Return the answer; what follows from it is in the fields."""
        answer = None
        if isinstance(request, Request) and isinstance(request.kind, str):  # pyright: ignore[reportUnnecessaryIsInstance] - whatever is sent
            answer = self.answers.get(request.kind)
        if answer is None:
            return Answer(request, accepted=False, reason="nobody here can do that")
        return Answer(request, *answer(request))

    def _enable(self, _: Request) -> tuple[bool, str]:
        memory = self.memory
        if memory.state is SupervisorState.FAULT:
            return False, "it is in the state Fault: remove the cause and acknowledge first"
        if self.reading.other_compensation is None:
            return False, "whether another compensation is active cannot be read"
        if self.reading.other_compensation is not False:
            return False, f"{Reason.DOUBLE_COMPENSATION}: switch one off"
        if _outside(self.compensation, self.in_force):
            return False, f"{Reason.OFFSET_OUTSIDE}: bring it back within them first"
        if memory.enabled:
            return True, "it was enabled already"
        self.memory = memory._replace(calm=False, enabled=True, held=False, ready_s=0.0)
        return True, "it is active as soon as everything is there"

    def _disable(self, _: Request) -> tuple[bool, str]:
        self.memory = self.memory._replace(calm=False, enabled=False, held=False)
        return True, "the correction fades at the allowed rate"

    def _hold(self, _: Request) -> tuple[bool, str]:
        memory = self.memory
        if not memory.enabled or memory.state is SupervisorState.FAULT:
            return False, "there is nothing to hold: it is not enabled, or in the state Fault"
        if not memory.held:
            self.memory = memory._replace(calm=False, held=True, held_s=0.0)
        longest_s = self.compensation.supervisor.hold_operator_s
        return True, f"it is held, for at most {longest_s:g} s"

    def _resume(self, _: Request) -> tuple[bool, str]:
        self.memory = self.memory._replace(calm=False, held=False)
        return True, "the hold is ended"

    def _trim(self, request: Request) -> tuple[bool, str]:
        names = [output.name for output in self.compensation.model.outputs]
        if request.output not in names:
            return False, f"outputs are {', '.join(names)}"
        k = names.index(request.output)
        value, duration_s = _usable(request.value), _usable(request.duration_s)
        largest_um = self.compensation.bounds[k].largest_trim_um
        longest_s = self.compensation.supervisor.longest_trim_s
        if value == 0.0:  # to take back is always allowed
            trim, said = NO_TRIM, "the trim is taken back"
        elif self.memory.state is SupervisorState.FAULT:
            return False, "it is in the state Fault"
        elif value is None or abs(value) > largest_um:
            return False, f"a trim is a number from {-largest_um:g} to {largest_um:g} um"
        elif duration_s is None or not 0.0 < duration_s <= longest_s:
            return False, f"a trim expires within {longest_s:g} s: state when"
        else:
            trim, said = Trim(value, str(request.who), duration_s), "the trim is added"
            replaced = self.trims[k]
            if replaced.value_um:
                said = f"the trim of {replaced.who or 'nobody'} is replaced"
        trims = (*self.trims[:k], trim, *self.trims[k + 1 :])
        some = any(one is not NO_TRIM for one in trims)
        self.trims = trims if some else self.compensation.no_trims
        return True, said

    def _diameter(self, request: Request) -> tuple[bool, str]:
        value = None if request.value is None else _usable(request.value)
        if request.value is not None and not (
            value is not None and 0.0 <= value <= LARGEST_DIAMETER_MM
        ):
            return False, f"a diameter is a number from 0 to {LARGEST_DIAMETER_MM:g} mm"
        self.diameter_mm = value
        return True, "the gain follows at the allowed rate"

    def _acknowledge(self, _: Request) -> tuple[bool, str]:
        memory = self.memory
        if memory.state is not SupervisorState.FAULT:
            self.acknowledged = True
            return True, "there is no fault; the present values of the sensors are accepted"
        stands = self._still_stands(memory.fault)
        if stands:
            return False, stands
        self.acknowledged = True
        self.memory = memory._replace(
            state=SupervisorState.FADING,
            since_s=math.nan,
            enabled=False,
            held=False,
            fault=None,
            differs_s=0.0,
        )
        return True, "the fault is acknowledged; it is off until it is enabled"

    def _still_stands(self, fault: Reason | None) -> str:
        reading = self.reading
        if fault is Reason.DOUBLE_COMPENSATION and reading.other_compensation is not False:
            return f"{fault} still: switch one off"
        if fault is Reason.OFFSET_OUTSIDE and _outside(self.compensation, self.in_force):
            return f"{fault} still; it comes back at the allowed rate"
        agrees = _agrees(self.compensation, self.in_force, reading)
        if fault is Reason.READ_BACK_DIFFERS and not (agrees and reading.connected is True):
            return f"{fault} still: check the connection and the axis"
        return ""


# ---- corrections --------------------------------------------------------------------------------


def _goal_unless_active(
    compensation: Compensation,
    state: SupervisorState,
    in_force: _Floats,
    reading: CycleReading,
    agrees: bool,  # noqa: FBT001 - a signal
) -> _Floats:
    """Return where the corrections go when they do not follow the model."""
    if state not in _TO_ZERO:
        return in_force
    if agrees or reading.connected is not True:
        return compensation.zeros
    return (
        in_force if state is SupervisorState.FADING else _followed(compensation, in_force, reading)
    )


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


def _wanted(
    compensation: Compensation, weights: _Floats, model_um: _Floats, trims: tuple[Trim, ...]
) -> tuple[_Floats, tuple[bool, ...]]:
    """Return what the corrections should be, and whether the model asks for more than allowed.

    Minus the weighted model within its magnitude, trimmed, within the total.
    """
    wanted_um: list[float] = []
    at_limit = compensation.falses
    for (largest, _, _, _), weight, y in zip(compensation.rows, weights, model_um):
        c = -weight * y
        if not -largest <= c <= largest:
            c = largest if c > 0.0 else -largest
            k = len(wanted_um)
            at_limit = (*at_limit[:k], True, *at_limit[k + 1 :])
        wanted_um.append(c)
    if trims is not compensation.no_trims:
        for k, (trim, (_, total, _, _)) in enumerate(zip(trims, compensation.rows)):
            wanted_um[k] = min(max(wanted_um[k] + trim.value_um, -total), total)
    return tuple(wanted_um), at_limit


def _limited(
    compensation: Compensation,
    in_force: _Floats,
    before_um: _Floats,
    goal_um: _Floats,
    step_s: float,
) -> tuple[_Floats, _Floats]:
    """Return goals and corrections: `limit_step` for every output at once.

    A goal stays until another is wanted that differs by more than the deadband; zero and the
    correction in force are goals that no deadband keeps away.
    """
    if goal_um is in_force:
        return in_force, in_force
    goals: list[float] = []
    corrections: list[float] = []
    for (_, total, deadband, rate), c, before, wanted in zip(
        compensation.rows, in_force, before_um, goal_um
    ):
        goal = wanted
        if deadband and -deadband <= wanted - before <= deadband and wanted not in {0.0, c}:
            goal = before
        step = rate * step_s
        after = goal
        if not -total <= goal <= total:
            after = total if goal > 0.0 else -total
        if after > c + step:
            after = c + step
        elif after < c - step:
            after = c - step
        goals.append(goal)
        corrections.append(after)
    return tuple(goals), tuple(corrections)


def _trims_um(trims: tuple[Trim, ...]) -> _Floats:
    return tuple([trim.value_um for trim in trims])
