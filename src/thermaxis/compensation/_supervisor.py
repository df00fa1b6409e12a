"""The supervisor: when the machine is compensated, and what follows when something fails.

The law is four tables: what blocks, which fault or transition follows, and what the correction
then does. Two rules:

* The rows are ranked: of those that name the present state, the first whose condition is met
  counts, and a cycle takes one row.
* A condition looks at the rules, the counted times and the signals of the cycle, at nothing else.

``docs/theory/supervisor.md`` shows the same tables.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from enum import StrEnum
from typing import NamedTuple

from thermaxis.errors import require_positive, require_range

LONGEST_RULE_S = 86_400.0
"""Longest time in a rule: a day. [s]"""
MOST_SECONDS = 1e9
"""Times are counted no further: thirty years. [s]"""


class SupervisorState(StrEnum):
    """State of the compensation."""

    OFF = "Off"
    """The compensation is not enabled; the offset is left as it is."""
    WARMING = "Warming"
    """Enabled; something that it needs is not there yet."""
    ACTIVE = "Active"
    """The correction follows the model."""
    HOLDING = "Holding"
    """The correction is kept as it is."""
    FADING = "Fading"
    """The correction goes to zero at the allowed rate."""
    FAULT = "Fault"
    """Something is wrong that a person must look at; the correction goes to zero at the allowed
    rate and stays there until the fault is acknowledged."""


OFF, WARMING, ACTIVE = SupervisorState.OFF, SupervisorState.WARMING, SupervisorState.ACTIVE
HOLDING, FADING, FAULT = SupervisorState.HOLDING, SupervisorState.FADING, SupervisorState.FAULT


class Reason(StrEnum):
    """Why the compensation is not active."""

    DISABLED = "disabled"
    """It is not enabled."""
    SETTLING = "settling"
    """The model has not run for long enough."""
    RECOVERING = "recovering"
    """Everything is there again; it must stay so for a moment."""
    INPUT_BAD = "input_bad"
    """An input has no usable value."""
    CONNECTION_LOST = "connection_lost"
    """The connection to the machine is lost."""
    INTERLOCK_OPEN = "interlock_open"
    """An interlock is not met."""
    OPERATOR_HOLD = "operator_hold"
    """An operator holds it."""
    HOLD_EXPIRED = "hold_expired"
    """It was held for as long as it may be."""
    READ_BACK_DIFFERS = "read_back_differs"
    """The machine does not report the offset that was written."""
    LONG_AT_LIMIT = "long_at_limit"
    """The correction stood at its limit for too long."""
    DOUBLE_COMPENSATION = "double_compensation"
    """Another compensation is active on the axis."""
    OFFSET_OUTSIDE = "offset_outside"
    """The offset found in the machine lies outside the limits."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SupervisorRules:
    """How long what is tolerated. Every default is finite, and none may be set beyond a day.

    Raises
    ------
    ConfigurationError
        If a number is not from 0 to a day, or the read-back's tolerance is not positive.
    """

    settle_s: float = 60.0
    """Time that the model runs with good inputs before the first correction. Default: a minute.
    [s]"""
    recovery_delay_s: float = 1.0
    """Time that everything must be there again after a loss. Default: a second. [s]"""
    input_timeout_s: float = 2.0
    """Time for which a lost input is bridged by its last value. Default: two cycles. [s]"""
    hold_input_s: float = 300.0
    """Time for which the correction is held while an input is lost; then it fades. Default: five
    minutes. [s]"""
    hold_connection_s: float = 300.0
    """The same while the connection is lost. Default: five minutes. [s]"""
    hold_interlock_s: float = 0.0
    """The same while an interlock is not met. Default: it fades at once. [s]"""
    hold_operator_s: float = 3600.0
    """Time after which an operator's hold fades. Default: an hour. [s]"""
    at_limit_s: float = 600.0
    """Time at the output limit that is a fault. Default: ten minutes. [s]"""
    read_back_tolerance_um: float = 0.5
    """Difference of read-back and written correction that is believed. Default: half of what a
    control displays. [µm]"""
    read_back_s: float = 10.0
    """Time for which they may differ, or nothing be read back, before it is a fault. Default: ten
    cycles of a second. [s]"""
    longest_trim_s: float = 28_800.0
    """Longest time after which a trim expires. Default: a shift. [s]"""
    max_hold_s: float = field(init=False, repr=False, compare=False)
    """Time for which the correction is held at most, whatever comes and goes meanwhile: the
    longest of the times above, and what it takes to settle and to recover. [s]"""

    def __post_init__(self) -> None:
        """Check the numbers."""
        for entry in fields(SupervisorRules):
            if entry.init:
                require_range(entry.name, getattr(self, entry.name), 0.0, LONGEST_RULE_S)
        require_positive("read_back_tolerance_um", self.read_back_tolerance_um, LONGEST_RULE_S)
        longest_s = max(
            self.hold_input_s, self.hold_connection_s, self.hold_interlock_s, self.hold_operator_s
        )
        max_hold_s = self.settle_s + self.recovery_delay_s + self.input_timeout_s + longest_s
        object.__setattr__(self, "max_hold_s", max_hold_s)


class Memory(NamedTuple):
    """What the supervisor remembers. Durations are counted, no further than the rules ask for."""

    state: SupervisorState = OFF
    """State."""
    since_s: float = math.nan
    """Time of the cycle in which it was entered; NaN before the first. [s]"""
    enabled: bool = False
    """Whether somebody has enabled the compensation."""
    held: bool = False
    """Whether an operator holds it."""
    fault: Reason | None = None
    """Why it is in the state Fault."""
    running_s: float = 0.0
    """Time for which the model has run since it started, at most what it takes to settle. [s]"""
    ready_s: float = 0.0
    """Time for which everything has been there, at most the recovery delay. [s]"""
    input_lost_s: float = 0.0
    """Time for which an input has had no usable value. [s]"""
    connection_lost_s: float = 0.0
    """Time for which the connection has been lost. [s]"""
    interlock_open_s: float = 0.0
    """Time for which an interlock has not been met. [s]"""
    held_s: float = 0.0
    """Time for which an operator has held it. [s]"""
    differs_s: float = 0.0
    """Time for which the read-back has differed. [s]"""
    at_limit_s: float = 0.0
    """Time for which the model has asked for more than the output limit. [s]"""
    halted_s: float = 0.0
    """Time for which an enabled compensation has not been active. [s]"""


class Signals(NamedTuple):
    """What the supervisor is told in a cycle."""

    inputs_usable: bool
    """Whether every input has a usable value."""
    model_runs: bool
    """Whether the model runs on, and was neither waiting nor started anew."""
    connected: bool
    """Whether the machine can be written to."""
    interlocks_met: bool
    """Whether every interlock is met."""
    read_back_agrees: bool
    """Whether the machine reports what was written."""
    at_limit: bool
    """Whether the model asks for more than an output limit allows."""
    other_compensation: bool
    """Whether another compensation is active on an axis."""
    offset_outside: bool
    """Whether a correction in force lies outside its total."""
    at_zero: bool
    """Whether every correction in force is zero."""
    model_usable: bool = True
    """Whether the model's output may be used."""


# ---- what blocks ---------------------------------------------------------------------------------


class Blocker(NamedTuple):
    """Something that keeps an enabled compensation from being active, and for how long it may."""

    reason: Reason
    lasts_s: float  # for how long it has been so; not above 0 while it is not
    bridged_s: float  # for how long it is as if it were not
    held_s: float  # for how long the correction is then held before it fades


def blockers(rules: SupervisorRules, memory: Memory) -> tuple[Blocker, ...]:
    """Return the table of what may block, the gravest first."""
    hold_s = rules.hold_operator_s
    held = Reason.HOLD_EXPIRED if memory.held_s > hold_s else Reason.OPERATOR_HOLD
    settling_s = rules.settle_s - memory.running_s
    return (
        Blocker(Reason.CONNECTION_LOST, memory.connection_lost_s, 0.0, rules.hold_connection_s),
        Blocker(Reason.INTERLOCK_OPEN, memory.interlock_open_s, 0.0, rules.hold_interlock_s),
        Blocker(Reason.INPUT_BAD, memory.input_lost_s, rules.input_timeout_s, rules.hold_input_s),
        Blocker(Reason.SETTLING, settling_s, 0.0, math.inf),
        Blocker(held, memory.held_s, 0.0, hold_s),
    )


# ---- conditions ----------------------------------------------------------------------------------


class Condition(StrEnum):
    """What a row of the tables below asks for."""

    OTHER_COMPENSATION = "another compensation is active"
    DIFFERS_LONG = "the read-back differs for longer than read_back_s"
    OUTSIDE = "a correction in force lies outside its total"
    LONG_AT_LIMIT = "the model asks for more than the output limit for longer than at_limit_s"
    NOT_ENABLED = "not enabled"
    NOT_ENABLED_AT_ZERO = "not enabled, known to be at zero"
    NOTHING_BLOCKS = "nothing blocks"
    ALL_THERE = "everything there"
    EXPIRED = "expired"
    EXPIRED_NOT_AT_ZERO = "expired, not at zero"
    KNOWN_AT_ZERO = "known to be at zero"
    UNREACHABLE = "the machine cannot be reached"
    DIFFERS = "the read-back differs"
    NOTHING_TO_SAY = "the model has nothing to say"
    OTHERWISE = "otherwise"


def conditions(
    rules: SupervisorRules, memory: Memory, signals: Signals, blocking: Sequence[Blocker]
) -> dict[Condition, bool]:
    """Return which conditions are met in a cycle."""
    # A machine that cannot be reached may have another offset than the last one written.
    known_at_zero = signals.at_zero and signals.connected
    expired = memory.halted_s > rules.max_hold_s or any(
        one.lasts_s > one.bridged_s + one.held_s for one in blocking
    )
    return {
        Condition.OTHER_COMPENSATION: signals.other_compensation,
        Condition.DIFFERS_LONG: memory.differs_s > rules.read_back_s,
        Condition.OUTSIDE: signals.offset_outside,
        Condition.LONG_AT_LIMIT: memory.at_limit_s > rules.at_limit_s,
        Condition.NOT_ENABLED: not memory.enabled,
        Condition.NOT_ENABLED_AT_ZERO: not memory.enabled and known_at_zero,
        Condition.NOTHING_BLOCKS: not blocking,
        Condition.ALL_THERE: not blocking and memory.ready_s >= rules.recovery_delay_s,
        Condition.EXPIRED: expired,
        Condition.EXPIRED_NOT_AT_ZERO: expired and not signals.at_zero,
        Condition.KNOWN_AT_ZERO: known_at_zero,
        Condition.UNREACHABLE: not signals.connected,
        Condition.DIFFERS: not signals.read_back_agrees,
        Condition.NOTHING_TO_SAY: not signals.model_usable,
        Condition.OTHERWISE: True,
    }


# ---- tables --------------------------------------------------------------------------------------


class Transition(NamedTuple):
    """In one of these states, under this condition, that state follows."""

    states: tuple[SupervisorState, ...]
    condition: Condition
    next_state: SupervisorState
    fault: Reason | None = None


_AT_WORK = (ACTIVE, HOLDING)
_ENABLED = (WARMING, ACTIVE, HOLDING, FADING)

FAULTS = (
    Transition(_ENABLED, Condition.OTHER_COMPENSATION, FAULT, Reason.DOUBLE_COMPENSATION),
    Transition(_ENABLED, Condition.DIFFERS_LONG, FAULT, Reason.READ_BACK_DIFFERS),
    Transition(_ENABLED, Condition.OUTSIDE, FAULT, Reason.OFFSET_OUTSIDE),
    Transition(_AT_WORK, Condition.LONG_AT_LIMIT, FAULT, Reason.LONG_AT_LIMIT),
)

TRANSITIONS = (
    *FAULTS,
    Transition((OFF,), Condition.NOT_ENABLED, OFF),
    Transition((OFF,), Condition.OTHERWISE, WARMING),
    Transition(_ENABLED, Condition.NOT_ENABLED_AT_ZERO, OFF),
    Transition(_ENABLED, Condition.NOT_ENABLED, FADING),
    Transition((WARMING,), Condition.ALL_THERE, ACTIVE),
    Transition((WARMING,), Condition.EXPIRED_NOT_AT_ZERO, FADING),
    Transition((WARMING,), Condition.OTHERWISE, WARMING),
    Transition((ACTIVE,), Condition.NOTHING_BLOCKS, ACTIVE),
    Transition((ACTIVE,), Condition.EXPIRED, FADING),
    Transition((ACTIVE,), Condition.OTHERWISE, HOLDING),
    Transition((HOLDING,), Condition.ALL_THERE, ACTIVE),
    Transition((HOLDING,), Condition.EXPIRED, FADING),
    Transition((HOLDING,), Condition.OTHERWISE, HOLDING),
    Transition((FADING,), Condition.ALL_THERE, ACTIVE),
    Transition((FADING,), Condition.KNOWN_AT_ZERO, WARMING),
    Transition((FADING,), Condition.OTHERWISE, FADING),
    Transition((FAULT,), Condition.OTHERWISE, FAULT),  # acknowledged, it is in Fading before
)


class Motion(StrEnum):
    """What the correction does in a cycle."""

    STAYS = "stays"
    FOLLOWS = "follows"
    TO_ZERO = "goes to zero"
    TO_ZERO_WITH_MACHINE = "goes to zero as far as the machine follows"


class Movement(NamedTuple):
    """In one of these states, which a transition has led to, the correction does that."""

    states: tuple[SupervisorState, ...]
    condition: Condition
    motion: Motion


MOVEMENTS = (
    Movement((OFF, WARMING, HOLDING), Condition.OTHERWISE, Motion.STAYS),
    Movement((ACTIVE,), Condition.DIFFERS, Motion.STAYS),
    Movement((ACTIVE,), Condition.NOTHING_TO_SAY, Motion.STAYS),
    Movement((ACTIVE,), Condition.OTHERWISE, Motion.FOLLOWS),
    Movement((FADING, FAULT), Condition.UNREACHABLE, Motion.TO_ZERO),
    Movement((FADING,), Condition.DIFFERS, Motion.STAYS),
    Movement((FAULT,), Condition.DIFFERS, Motion.TO_ZERO_WITH_MACHINE),
    Movement((FADING, FAULT), Condition.OTHERWISE, Motion.TO_ZERO),
)


# ---- the step ------------------------------------------------------------------------------------


class Decision(NamedTuple):
    """What the supervisor decides in a cycle."""

    memory: Memory
    reasons: tuple[Reason, ...]
    motion: Motion


def supervisor_step(
    rules: SupervisorRules, memory: Memory, signals: Signals, time_s: float, elapsed_s: float
) -> Decision:
    """Advance the supervisor by one cycle.

    Requests have been applied to `enabled`, `held` and `fault` before.

    Not protected: the supervisor believes its signals. An interlock that is wired to nothing is
    met or not met for ever.

    Parameters
    ----------
    rules : SupervisorRules
        The rules.
    memory : Memory
        What the last cycle left.
    signals : Signals
        What is so in this cycle.
    time_s : float
        Time of the cycle. [s]
    elapsed_s : float
        Time since the last cycle, positive; the nominal one where the clock did not move on. [s]

    Returns
    -------
    Decision
        Memory for the next cycle, reasons, and what the correction does.
    """
    memory = _counted(rules, memory, signals, elapsed_s)
    if math.isnan(memory.since_s):
        memory = memory._replace(since_s=time_s)
    blocking = [one for one in blockers(rules, memory) if one.lasts_s > one.bridged_s]
    met = conditions(rules, memory, signals, blocking)
    row = next(r for r in TRANSITIONS if memory.state in r.states and met[r.condition])
    if row.next_state is not memory.state:
        memory = memory._replace(state=row.next_state, since_s=time_s, fault=row.fault)
    motion = next(r.motion for r in MOVEMENTS if memory.state in r.states and met[r.condition])
    return Decision(memory, _reasons(memory, blocking), motion)


def _counted(rules: SupervisorRules, memory: Memory, signals: Signals, elapsed_s: float) -> Memory:
    """Return the memory with every duration counted on, or set back to zero."""
    # A condition that fails counts from its first cycle on, however short that was; but no fault
    # follows from a single cycle, however long that was.
    first_s = max(elapsed_s, 1e-9)
    differs_s = elapsed_s if memory.differs_s else min(elapsed_s, rules.read_back_s)
    at_limit_s = elapsed_s if memory.at_limit_s else min(elapsed_s, rules.at_limit_s)
    ready = signals.inputs_usable and signals.model_runs
    ready = ready and signals.connected and signals.interlocks_met
    differs = signals.connected and not signals.read_back_agrees and memory.state is not OFF
    at_limit = signals.at_limit and memory.state in _AT_WORK
    halted = memory.enabled and memory.state in {WARMING, HOLDING, FADING}
    return memory._replace(
        running_s=_grown(memory.running_s, elapsed_s, rules.settle_s, on=signals.model_runs),
        ready_s=_grown(memory.ready_s, elapsed_s, rules.recovery_delay_s, on=ready),
        input_lost_s=_grown(memory.input_lost_s, first_s, on=not signals.inputs_usable),
        connection_lost_s=_grown(memory.connection_lost_s, first_s, on=not signals.connected),
        interlock_open_s=_grown(memory.interlock_open_s, first_s, on=not signals.interlocks_met),
        held_s=_grown(memory.held_s, first_s, on=memory.held),
        differs_s=_grown(memory.differs_s, differs_s, on=differs),
        at_limit_s=_grown(memory.at_limit_s, at_limit_s, on=at_limit),
        halted_s=_grown(memory.halted_s, first_s, on=halted),
    )


def _grown(seconds: float, by_s: float, most_s: float = MOST_SECONDS, *, on: bool) -> float:
    return min(seconds + by_s, most_s) if on else 0.0


def _reasons(memory: Memory, blocking: Sequence[Blocker]) -> tuple[Reason, ...]:
    if memory.state is FAULT:
        return (memory.fault or Reason.OFFSET_OUTSIDE,)
    if memory.state is ACTIVE:
        return ()
    if not memory.enabled:
        return (Reason.DISABLED,)
    return tuple(one.reason for one in blocking) or (Reason.RECOVERING,)
