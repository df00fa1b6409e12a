"""The cycle once more, plainly: the written rules one after the other, with nothing made fast.

Written from the docstrings and from the table in ``docs/theory/supervisor.md``; it shares the
types and `model_step` with the program, and none of its rules. `cycle` must say the same, bit for
bit.
"""

import math
from typing import Any

from thermaxis.compensation import (
    Answer,
    Compensation,
    CycleOutput,
    CycleReading,
    CycleState,
    Memory,
    Outcome,
    Quality,
    Reading,
    Reason,
    Request,
    RequestKind,
    Sample,
    SampleQuality,
    SensorRules,
    SensorState,
    SupervisorRules,
    SupervisorState,
    Trim,
    model_step,
)

ASIDE = Sample(None, False, None)
OFF, WARMING, ACTIVE = SupervisorState.OFF, SupervisorState.WARMING, SupervisorState.ACTIVE
HOLDING, FADING, FAULT = SupervisorState.HOLDING, SupervisorState.FADING, SupervisorState.FAULT


def number(value: object, largest: float = 1e6) -> float | None:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    return float(value) if abs(value) <= largest else None


def clamped(value: float, largest: float) -> float:
    return max(-largest, min(largest, value))


# ---- sensors ------------------------------------------------------------------------------------


def plain_judge(  # noqa: PLR0911 - one rule after the other
    rules: SensorRules, sensor: SensorState, sample: Sample, time_s: float, elapsed_s: float
) -> tuple[SampleQuality, SensorState]:
    value, good, age_s = sample
    allowed_k = rules.largest_rate_k_per_s * elapsed_s
    unseen = sensor._replace(allowance_k=min(sensor.allowance_k + allowed_k, 1e6))
    if type(value) is not float or math.isnan(value) or math.isinf(value):
        return SampleQuality.MISSING, unseen
    if good is not True:
        return SampleQuality.STATUS_BAD, unseen
    if age_s is None:
        if rules.time_stamp_required:
            return SampleQuality.NO_TIME_STAMP, unseen
    elif type(age_s) is not float or not abs(age_s) <= rules.longest_age_s:
        return SampleQuality.OLD, unseen
    if value < rules.lowest_c or value > rules.highest_c:
        return SampleQuality.OUT_OF_RANGE, unseen
    first = math.isnan(sensor.good_c)
    if value == sensor.good_c:
        if rules.frozen_s > 0.0 and time_s - sensor.changed_s > rules.frozen_s:
            return SampleQuality.FROZEN, sensor
        known = sensor.changed_s <= time_s
        return SampleQuality.GOOD, SensorState(value, sensor.changed_s if known else time_s)
    moved_k = abs(value - sensor.good_c)
    if first or moved_k <= rules.step_k + allowed_k + sensor.allowance_k:
        return SampleQuality.GOOD, SensorState(value, time_s)
    widest_k = max(sensor.allowance_k, 2.0 * rules.step_k)
    return SampleQuality.TOO_FAST, sensor._replace(
        allowance_k=min(sensor.allowance_k + allowed_k, widest_k)
    )


# ---- requests -----------------------------------------------------------------------------------


class World:
    """What changes while requests are answered."""

    def __init__(self, compensation: Compensation, state: CycleState, reading: CycleReading):
        self.compensation = compensation
        self.memory = state.memory
        self.trims = list(state.trims)
        self.diameter_mm = state.diameter_mm
        self.reading = reading
        self.in_force: list[float] = []
        self.accepted_sensors = False

    def outside(self) -> bool:
        return any(
            abs(c) > b.total_um
            for c, b in zip(self.in_force, self.compensation.bounds, strict=True)
        )

    def agrees(self) -> bool:
        if self.reading.read_back_um == tuple(self.in_force):
            return True
        found = list(self.reading.found_um or ())
        tolerance_um = self.compensation.supervisor.read_back_tolerance_um
        for k, (said, c) in enumerate(zip(self.read_back(), self.in_force, strict=True)):
            if k < len(found) and number(found[k]) is not None:
                continue
            if said is None or abs(said - c) > tolerance_um:
                return False
        return True

    def read_back(self) -> list[float | None]:
        read = self.reading.read_back_um
        if read is None or len(read) != len(self.in_force):
            return [None] * len(self.in_force)
        return [number(said) for said in read]

    def answer(self, request: Any) -> Answer:
        if not isinstance(request, Request) or not isinstance(request.kind, str):
            return Answer(request, False, "nobody here can do that")
        accepted, reason = self.answered(request)
        return Answer(request, accepted, reason)

    def answered(self, request: Request) -> tuple[bool, str]:  # noqa: C901, PLR0911, PLR0912 - a plain list
        memory, kind = self.memory, request.kind
        faulty = memory.state is FAULT
        if kind == RequestKind.ENABLE:
            if faulty:
                return False, "it is in the state Fault: remove the cause and acknowledge first"
            if self.reading.other_compensation is None:
                return False, "whether another compensation is active cannot be read"
            if self.reading.other_compensation is not False:
                return False, f"{Reason.DOUBLE_COMPENSATION}: switch one off"
            if self.outside():
                return False, f"{Reason.OFFSET_OUTSIDE}: bring it back within them first"
            if memory.enabled:
                return True, "it was enabled already"
            self.memory = memory._replace(enabled=True, held=False, held_s=0.0, ready_s=0.0)
            return True, "it is active as soon as everything is there"
        if kind == RequestKind.DISABLE:
            self.memory = memory._replace(enabled=False, held=False, held_s=0.0)
            return True, "the correction fades at the allowed rate"
        if kind == RequestKind.HOLD:
            if faulty or not memory.enabled:
                return False, "there is nothing to hold: it is not enabled, or in the state Fault"
            if not memory.held:
                self.memory = memory._replace(held=True, held_s=0.0)
            longest_s = self.compensation.supervisor.hold_operator_s
            return True, f"it is held, for at most {longest_s:g} s"
        if kind == RequestKind.RESUME:
            self.memory = memory._replace(held=False, held_s=0.0)
            return True, "the hold is ended"
        if kind == RequestKind.TRIM:
            return self.trimmed(request)
        if kind == RequestKind.DIAMETER:
            return self.measured(request)
        if kind == RequestKind.ACKNOWLEDGE:
            return self.acknowledged()
        return False, "nobody here can do that"

    def trimmed(self, request: Request) -> tuple[bool, str]:
        names = [output.name for output in self.compensation.model.outputs]
        if request.output not in names:
            return False, f"outputs are {', '.join(names)}"
        k = names.index(request.output)
        value, duration_s = number(request.value), number(request.duration_s)
        largest_um = self.compensation.bounds[k].largest_trim_um
        longest_s = self.compensation.supervisor.longest_trim_s
        if value == 0.0:
            self.trims[k] = Trim()
            return True, "the trim is taken back"
        if self.memory.state is FAULT:
            return False, "it is in the state Fault"
        if value is None or abs(value) > largest_um:
            return False, f"a trim is a number from {-largest_um:g} to {largest_um:g} um"
        if duration_s is None or duration_s <= 0.0 or duration_s > longest_s:
            return False, f"a trim expires within {longest_s:g} s: state when"
        old, self.trims[k] = self.trims[k], Trim(value, str(request.who), duration_s)
        replaced = f"the trim of {old.who or 'nobody'} is replaced"
        return True, replaced if old.value_um else "the trim is added"

    def measured(self, request: Request) -> tuple[bool, str]:
        value = number(request.value)
        if request.value is not None and (value is None or not 0.0 <= value <= 1e5):
            return False, "a diameter is a number from 0 to 100000 mm"
        self.diameter_mm = value
        return True, "the gain follows at the allowed rate"

    def acknowledged(self) -> tuple[bool, str]:
        memory, reading, fault = self.memory, self.reading, self.memory.fault
        if memory.state is not FAULT:
            self.accepted_sensors = True
            return True, "there is no fault; the present values of the sensors are accepted"
        if fault is Reason.DOUBLE_COMPENSATION and reading.other_compensation is not False:
            return False, f"{fault} still: switch one off"
        if fault is Reason.OFFSET_OUTSIDE and self.outside():
            return False, f"{fault} still; it comes back at the allowed rate"
        reached = self.agrees() and reading.connected is True
        if fault is Reason.READ_BACK_DIFFERS and not reached:
            return False, f"{fault} still: check the connection and the axis"
        self.accepted_sensors = True
        self.memory = memory._replace(
            state=FADING,
            since_s=math.nan,
            enabled=False,
            held=False,
            fault=None,
            differs_s=0.0,
            at_limit_s=0.0,
        )
        return True, "the fault is acknowledged; it is off until it is enabled"


# ---- supervisor ---------------------------------------------------------------------------------


def plain_supervisor(  # noqa: C901, PLR0912 - the table, row by row
    rules: SupervisorRules, memory: Memory, now: dict[str, bool], time_s: float, elapsed_s: float
) -> tuple[Memory, tuple[Reason, ...]]:
    state = memory.state
    first_s = max(elapsed_s, 1e-9)

    def counted(before_s: float, on: bool, longest_first_s: float = math.inf) -> float:
        if not on:
            return 0.0
        step_s = first_s if longest_first_s == math.inf else elapsed_s
        return min(before_s + (step_s if before_s else min(step_s, longest_first_s)), 1e9)

    ready = now["inputs"] and now["connected"] and now["met"] and now["runs"]
    watched = state is not OFF and now["connected"]
    halted = memory.enabled and state in (WARMING, HOLDING, FADING)
    memory = memory._replace(
        since_s=time_s if math.isnan(memory.since_s) else memory.since_s,
        running_s=min(memory.running_s + elapsed_s, rules.settle_s) if now["runs"] else 0.0,
        ready_s=min(memory.ready_s + elapsed_s, rules.heal_s) if ready else 0.0,
        input_lost_s=counted(memory.input_lost_s, not now["inputs"]),
        connection_lost_s=counted(memory.connection_lost_s, not now["connected"]),
        interlock_open_s=counted(memory.interlock_open_s, not now["met"]),
        held_s=counted(memory.held_s, memory.held),
        differs_s=counted(
            memory.differs_s, watched and not now["agrees"], longest_first_s=rules.read_back_s
        ),
        at_limit_s=counted(
            memory.at_limit_s,
            state in (ACTIVE, HOLDING) and now["at_limit"],
            longest_first_s=rules.at_limit_s,
        ),
        halted_s=counted(memory.halted_s, halted),
    )
    if state is FAULT:
        return memory, (memory.fault or Reason.OFFSET_OUTSIDE,)
    fault = None
    if state is not OFF:
        for reason, stands in (
            (Reason.LONG_AT_LIMIT, memory.at_limit_s > rules.at_limit_s),
            (Reason.OFFSET_OUTSIDE, now["outside"]),
            (Reason.READ_BACK_DIFFERS, memory.differs_s > rules.read_back_s),
            (Reason.DOUBLE_COMPENSATION, now["other"]),
        ):
            fault = reason if stands else fault
    if fault is not None:
        return memory._replace(state=FAULT, since_s=time_s, fault=fault), (fault,)

    lasts = {
        Reason.CONNECTION_LOST: (memory.connection_lost_s, 0.0, rules.hold_connection_s),
        Reason.INTERLOCK_OPEN: (memory.interlock_open_s, 0.0, rules.hold_interlock_s),
        Reason.INPUT_BAD: (memory.input_lost_s, rules.grace_s, rules.grace_s + rules.hold_input_s),
    }
    reasons = [reason for reason, (t, bridged, _) in lasts.items() if t > bridged]
    expired = any(lasts[reason][0] > lasts[reason][2] for reason in reasons)
    if memory.running_s < rules.settle_s:
        reasons.append(Reason.SETTLING)
    if memory.held and memory.held_s > rules.hold_operator_s:
        reasons.append(Reason.HOLD_EXPIRED)
        expired = True
    elif memory.held:
        reasons.append(Reason.OPERATOR_HOLD)
    longest_s = max(
        rules.hold_input_s, rules.hold_connection_s, rules.hold_interlock_s, rules.hold_operator_s
    )
    if memory.halted_s > rules.settle_s + rules.heal_s + rules.grace_s + longest_s:
        expired = True

    known_zero = now["at_zero"] and now["connected"]
    healed = not reasons and memory.ready_s >= rules.heal_s
    after = state
    if not memory.enabled:
        after = OFF if state is OFF or known_zero else FADING
    elif state is OFF:
        after = WARMING
    elif state is WARMING:
        after = ACTIVE if healed else FADING if expired and not now["at_zero"] else WARMING
    elif state is ACTIVE and reasons:
        after = FADING if expired else HOLDING
    elif state is ACTIVE:
        after = FADING if expired and not healed and reasons else ACTIVE
    elif state is HOLDING:
        after = ACTIVE if healed else FADING if expired else HOLDING
    elif state is FADING:
        after = ACTIVE if healed else WARMING if known_zero else FADING
    if after is not state:
        memory = memory._replace(state=after, since_s=time_s, fault=None)
    if after is ACTIVE:
        return memory, ()
    if not memory.enabled:
        return memory, (Reason.DISABLED,)
    return memory, tuple(reasons) or (Reason.HEALING,)


# ---- the cycle ----------------------------------------------------------------------------------

RESTARTS = {
    Outcome.STARTED,
    Outcome.WAITING,
    Outcome.GAP,
    Outcome.CLOCK_BACKWARD,
    Outcome.STATE_UNUSABLE,
}


def plain_cycle(  # noqa: C901, PLR0912, PLR0915 - one step after the other
    compensation: Compensation, state: CycleState, reading: CycleReading
) -> tuple[CycleState, CycleOutput]:
    model, rules = compensation.model, compensation.supervisor
    channels = model.channels
    outputs = range(len(compensation.bounds))
    asked_s = number(reading.time_s, 1e15)
    time_s = state.time_s if asked_s is None else asked_s
    elapsed_s = time_s - state.time_s
    elapsed_s = max(0.0, elapsed_s)

    world = World(compensation, state, reading)
    found = [number(f) for f in reading.found_um or ()] + [None] * len(outputs)
    for k in outputs:
        place, c = found[k], state.correction_um[k]
        c = c if place is None else place
        world.in_force.append(c if math.isfinite(c) else 0.0)
    in_force = world.in_force
    world.trims = [
        Trim() if t.left_s <= elapsed_s else t._replace(left_s=t.left_s - elapsed_s)
        for t in state.trims
    ]
    answers = tuple(world.answer(request) for request in reading.requests)
    sensors, spares = list(state.sensors), list(state.spares)
    if world.accepted_sensors:
        sensors = spares = [SensorState()] * len(channels)
        spares = list(spares)

    values: list[float | None] = []
    qualities: list[SampleQuality] = []
    for k, channel in enumerate(channels):
        sample: Any = reading.samples[k] if k < len(reading.samples) else ASIDE
        sample = sample if isinstance(sample, Sample) else ASIDE
        channel_rules = compensation.sensors[channel]
        quality, sensors[k] = plain_judge(channel_rules, sensors[k], sample, time_s, elapsed_s)
        value = sample.value if quality is SampleQuality.GOOD else None
        if channel in compensation.spares:
            second: Any = reading.spares[k] if k < len(reading.spares) else ASIDE
            second = second if isinstance(second, Sample) else ASIDE
            good, spares[k] = plain_judge(channel_rules, spares[k], second, time_s, elapsed_s)
            if good is SampleQuality.GOOD:
                if value is None:
                    value, quality = second.value, SampleQuality.SPARE
                elif abs(value - second.value) > channel_rules.largest_difference_k:
                    value, quality = None, SampleQuality.DISAGREES
        values.append(value)
        qualities.append(quality)

    thermal, said = model_step(
        model,
        state.thermal,
        Reading(reading.time_s, dict(zip(channels, values, strict=True)), world.diameter_mm),
    )
    weights, wanted, at_limit = [], [], []
    part = 0
    for k in outputs:
        outside_k = 0.0
        for one in model.outputs[k].parts:
            if one.lowest_k is not None and Outcome.OUTSIDE_VALIDITY in said.outcomes:
                u = thermal.raw[model.layout.driven[part]]
                outside_k = max(outside_k, one.lowest_k - u, u - one.highest_k)
            part += 1
        share = 1.0 - outside_k / compensation.validity_margin_k
        weights.append(max(compensation.lowest_weight, share) if outside_k else 1.0)
        bounds = compensation.bounds[k]
        c = -weights[k] * said.model_um[k]
        at_limit.append(abs(c) > bounds.largest_um)
        c = clamped(c, bounds.largest_um)
        if any(trim.value_um for trim in world.trims):
            c = clamped(c + world.trims[k].value_um, bounds.total_um)
        wanted.append(c)

    agrees = world.agrees()
    met = list(reading.interlocks)[: len(compensation.interlocks)]
    connected = reading.connected is True
    now = {
        "inputs": None not in values
        and said.quality is not Quality.BAD
        and None not in reading.interlocks
        and reading.other_compensation is not None
        and elapsed_s > 0.0,
        "runs": not RESTARTS & set(said.outcomes),
        "connected": connected,
        "met": len(met) == len(compensation.interlocks)
        and all(one is None or one == 1 for one in met),
        "agrees": agrees,
        "at_limit": any(at_limit),
        "other": reading.other_compensation is True,
        "outside": world.outside(),
        "at_zero": all(c == 0.0 for c in in_force),
    }
    memory, reasons = plain_supervisor(
        rules, world.memory, now, time_s, elapsed_s if elapsed_s > 0.0 else compensation.cycle_s
    )

    step_s = min(elapsed_s, 2.0 * compensation.cycle_s)
    goals, corrections = [], []
    for k, c in enumerate(in_force):
        bounds = compensation.bounds[k]
        goal = c
        moves = False
        if memory.state is ACTIVE and agrees and said.quality is not Quality.BAD:
            goal, moves = wanted[k], True
        elif memory.state is FADING and (agrees or not connected):
            goal, moves = 0.0, True
        elif memory.state is FAULT:
            goal, moves = 0.0, True
            read = world.read_back()[k]
            away = read is not None and abs(read - c) > rules.read_back_tolerance_um
            if connected and not agrees and away:
                goal = min(c, max(0.0, read)) if c > 0.0 else max(c, min(0.0, read))
        near = abs(goal - state.goal_um[k]) <= bounds.deadband_um
        if moves and near and goal not in {0.0, c}:
            goal = state.goal_um[k]
        after = c
        if moves:
            step = bounds.largest_rate_um_per_s * step_s
            after = clamped(goal, bounds.total_um)
            after = min(max(after, c - step), c + step)
        goals.append(goal)
        corrections.append(after)

    trims = tuple(world.trims)
    new = CycleState(
        thermal,
        tuple(sensors),
        tuple(spares),
        memory,
        time_s,
        tuple(corrections),
        tuple(goals),
        trims,
        world.diameter_mm,
    )
    return new, CycleOutput(
        0.0 if math.isnan(time_s) else time_s,
        memory.state,
        0.0 if math.isnan(memory.since_s) else memory.since_s,
        reasons,
        tuple(corrections),
        tuple(wanted),
        said.model_um,
        said.contribution_um,
        tuple(weights),
        tuple(trim.value_um for trim in trims),
        tuple(in_force),
        elapsed_s,
        tuple(at_limit),
        tuple(values),
        tuple(qualities),
        said.quality,
        said.outcomes,
        answers,
    )


def same(one: Any, other: Any) -> bool:
    """Return whether two values are equal to the last bit; zeros have no sign, NaN equals NaN."""
    if type(one) is float and type(other) is float:
        return one == other or (math.isnan(one) and math.isnan(other))
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return type(one) is type(other) and (one is other or one == other)
