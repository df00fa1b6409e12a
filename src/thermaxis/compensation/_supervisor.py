"""The supervisor: when the machine is compensated, and what follows when something fails."""

import math
from dataclasses import dataclass, field, fields
from enum import StrEnum
from typing import NamedTuple, final

from thermaxis.errors import ConfigurationError

LONGEST_RULE_S = 86_400.0
"""Longest time in a rule: a day. [s]"""
MOST_SECONDS = 1e9
"""Times are counted no further: thirty years. [s]"""


class SupervisorState(StrEnum):
    """State of the compensation.

    The names are the same everywhere; the operator's page says "Compensating" for Active, and has
    its own words in other languages.
    """

    OFF = "Off"
    """Nobody has enabled the compensation; the offset is left as it is."""
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


_AT_WORK = frozenset({SupervisorState.ACTIVE, SupervisorState.HOLDING})
_WAITING = frozenset({SupervisorState.WARMING, SupervisorState.HOLDING, SupervisorState.FADING})
_WATCHED = frozenset(set(SupervisorState) - {SupervisorState.OFF})


class Reason(StrEnum):
    """Why the compensation is not active; the value is its sentence."""

    DISABLED = "nobody has enabled it"
    SETTLING = "the model has not run for long enough"
    HEALING = "everything is there again; it must stay so for a moment"
    INPUT_BAD = "an input has no usable value"
    CONNECTION_LOST = "the connection to the machine is lost"
    INTERLOCK_OPEN = "an interlock is not met"
    OPERATOR_HOLD = "an operator holds it"
    HOLD_EXPIRED = "it was held for as long as it may be"
    READ_BACK_DIFFERS = "the machine does not report the offset that was written"
    LONG_AT_LIMIT = "the correction stood at its limit for too long"
    DOUBLE_COMPENSATION = "another compensation is active on the axis"
    OFFSET_OUTSIDE = "the offset found in the machine lies outside the limits"


@final
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
    heal_s: float = 1.0
    """Time that everything must be there again after a loss. Default: a second. [s]"""
    grace_s: float = 2.0
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
    """Time at the magnitude's limit that is a fault. Default: ten minutes. [s]"""
    read_back_tolerance_um: float = 0.5
    """Difference of read-back and written correction that is believed. Default: half of what a
    control displays. [µm]"""
    read_back_s: float = 10.0
    """Time for which they may differ, or nothing be read back, before it is a fault. Default: ten
    cycles. [s]"""
    longest_trim_s: float = 28_800.0
    """Longest time after which a trim expires. Default: a shift. [s]"""
    patience_s: float = field(init=False, repr=False, compare=False)
    """Time for which the correction is held at most, whatever comes and goes meanwhile: the
    longest of the times above, and what it takes to settle and to heal. [s]"""
    calm: tuple[object, ...] = field(init=False, repr=False, compare=False)
    """What the memory holds behind state and time while nothing is out of the ordinary."""

    def __post_init__(self) -> None:
        """Check the numbers."""
        for entry in fields(self):
            if not entry.init:
                continue
            value = getattr(self, entry.name)
            if not 0.0 <= value <= LONGEST_RULE_S:
                raise ConfigurationError(
                    f"not a number from 0 to {LONGEST_RULE_S:g}", where=entry.name
                )
        if self.read_back_tolerance_um <= 0.0:
            raise ConfigurationError("not a positive number", where="read_back_tolerance_um")
        calm = (True, False, None, self.settle_s, self.heal_s, *(0.0,) * 7)
        object.__setattr__(self, "calm", calm)
        longest_s = max(
            self.hold_input_s, self.hold_connection_s, self.hold_interlock_s, self.hold_operator_s
        )
        patience_s = self.settle_s + self.heal_s + self.grace_s + longest_s
        object.__setattr__(self, "patience_s", patience_s)


class Memory(NamedTuple):
    """What the supervisor remembers. Durations are counted, no further than the rules ask for."""

    state: SupervisorState = SupervisorState.OFF
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
    """Time for which everything has been there, at most what it takes to heal. [s]"""
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
    """Time for which the model has asked for more than the magnitude. [s]"""
    halted_s: float = 0.0
    """Time for which an enabled compensation has not been active. [s]"""
    calm: bool = False
    """Whether it is active and nothing is counted: then a cycle in which everything is well
    leaves the memory as it is."""


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
    """Whether the model asks for more than the magnitude of an output allows."""
    other_compensation: bool
    """Whether another compensation is active on an axis."""
    offset_outside: bool
    """Whether a correction in force lies outside its total."""
    at_zero: bool
    """Whether every correction in force is zero."""


class Blockers(NamedTuple):
    """What keeps the compensation from being active."""

    reasons: tuple[Reason, ...]
    """The reasons, the gravest first."""
    expired: bool
    """Whether one of them has lasted longer than it may be held."""


def blockers_of(rules: SupervisorRules, memory: Memory) -> Blockers:
    """Return what keeps an enabled compensation from being active.

    Parameters
    ----------
    rules : SupervisorRules
        The rules.
    memory : Memory
        Memory with the times of this cycle.

    Returns
    -------
    Blockers
        Reasons, and whether one has lasted for too long to be held.
    """
    reasons: list[Reason] = []
    expired = False
    if memory.connection_lost_s > 0.0:
        reasons.append(Reason.CONNECTION_LOST)
        expired = memory.connection_lost_s > rules.hold_connection_s
    if memory.interlock_open_s > 0.0:
        reasons.append(Reason.INTERLOCK_OPEN)
        expired = expired or memory.interlock_open_s > rules.hold_interlock_s
    if memory.input_lost_s > rules.grace_s:
        reasons.append(Reason.INPUT_BAD)
        expired = expired or memory.input_lost_s > rules.grace_s + rules.hold_input_s
    if memory.running_s < rules.settle_s:
        reasons.append(Reason.SETTLING)
    if memory.held:
        expired = expired or memory.held_s > rules.hold_operator_s
        reasons.append(
            Reason.HOLD_EXPIRED if memory.held_s > rules.hold_operator_s else Reason.OPERATOR_HOLD
        )
    expired = expired or memory.halted_s > rules.patience_s
    return Blockers(tuple(reasons), expired)


def fault_of(rules: SupervisorRules, memory: Memory, signals: Signals) -> Reason | None:
    """Return why the compensation must go to the state Fault, or None.

    Parameters
    ----------
    rules : SupervisorRules
        The rules.
    memory : Memory
        Memory with the times of this cycle.
    signals : Signals
        What is so in this cycle.

    Returns
    -------
    Reason or None
        The gravest fault.
    """
    if signals.other_compensation:
        return Reason.DOUBLE_COMPENSATION
    if memory.differs_s > rules.read_back_s:
        return Reason.READ_BACK_DIFFERS
    if signals.offset_outside:
        return Reason.OFFSET_OUTSIDE
    if memory.at_limit_s > rules.at_limit_s:
        return Reason.LONG_AT_LIMIT
    return None


def supervisor_step(
    rules: SupervisorRules, memory: Memory, signals: Signals, time_s: float, elapsed_s: float
) -> tuple[Memory, tuple[Reason, ...]]:
    """Advance the supervisor by one cycle.

    The transitions are those of the table in ``docs/theory/supervisor.md``; requests have been
    applied to `enabled`, `held` and `fault` before.

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
    memory : Memory
        For the next cycle.
    reasons : tuple of Reason
        Why the compensation is not active; empty while it is.
    """
    memory = _counted(rules, memory, signals, elapsed_s)
    if memory.since_s != memory.since_s:
        memory = memory._replace(since_s=time_s)
    blockers = blockers_of(rules, memory)
    state = memory.state
    if state is SupervisorState.FAULT:
        return memory, (memory.fault or Reason.OFFSET_OUTSIDE,)
    if state is not SupervisorState.OFF:
        fault = fault_of(rules, memory, signals)
        if fault is not None:
            return _entered(memory, SupervisorState.FAULT, time_s, fault), (fault,)
    wanted = _next_state(rules, memory, signals, blockers)
    if wanted is not state:
        memory = _entered(memory, wanted, time_s)
    memory = memory._replace(calm=memory[2:-1] == rules.calm and wanted is SupervisorState.ACTIVE)
    return memory, _reasons(memory, blockers)


def _counted(rules: SupervisorRules, memory: Memory, signals: Signals, elapsed_s: float) -> Memory:
    """Return the memory with every duration counted on, or set back to zero."""
    ready = (
        signals.inputs_usable
        and signals.connected
        and signals.interlocks_met
        and signals.model_runs
    )
    # A condition that fails counts from its first cycle on, however short that was; but no fault
    # follows from a single cycle, however long that was.
    first_s = max(elapsed_s, 1e-9)
    watched = memory.state in _WATCHED and signals.connected
    at_work = memory.state in _AT_WORK
    differs_s = elapsed_s if memory.differs_s else min(elapsed_s, rules.read_back_s)
    at_limit_s = elapsed_s if memory.at_limit_s else min(elapsed_s, rules.at_limit_s)
    return Memory(
        memory.state,
        memory.since_s,
        memory.enabled,
        memory.held,
        memory.fault,
        min(memory.running_s + elapsed_s, rules.settle_s) if signals.model_runs else 0.0,
        min(memory.ready_s + elapsed_s, rules.heal_s) if ready else 0.0,
        _grown(memory.input_lost_s, first_s, on=not signals.inputs_usable),
        _grown(memory.connection_lost_s, first_s, on=not signals.connected),
        _grown(memory.interlock_open_s, first_s, on=not signals.interlocks_met),
        _grown(memory.held_s, first_s, on=memory.held),
        _grown(memory.differs_s, differs_s, on=watched and not signals.read_back_agrees),
        _grown(memory.at_limit_s, at_limit_s, on=at_work and signals.at_limit),
        _grown(memory.halted_s, first_s, on=memory.enabled and memory.state in _WAITING),
    )


def _grown(seconds: float, elapsed_s: float, *, on: bool) -> float:
    return min(seconds + elapsed_s, MOST_SECONDS) if on else 0.0


def _next_state(
    rules: SupervisorRules, memory: Memory, signals: Signals, blockers: Blockers
) -> SupervisorState:
    """Return the state of this cycle: the table of transitions, faults apart."""
    state = memory.state
    # While the machine cannot be reached nobody knows that its offset is zero.
    known_zero = signals.at_zero and signals.connected
    if not memory.enabled:
        still = known_zero or state is SupervisorState.OFF
        return SupervisorState.OFF if still else SupervisorState.FADING
    if state is SupervisorState.OFF:
        return SupervisorState.WARMING
    if not blockers.reasons and (state is SupervisorState.ACTIVE or memory.ready_s >= rules.heal_s):
        return SupervisorState.ACTIVE
    if state is SupervisorState.FADING:
        return SupervisorState.WARMING if known_zero else state
    if blockers.expired and not (signals.at_zero and state is SupervisorState.WARMING):
        return SupervisorState.FADING
    return SupervisorState.HOLDING if state is SupervisorState.ACTIVE else state


def _entered(
    memory: Memory, state: SupervisorState, time_s: float, fault: Reason | None = None
) -> Memory:
    return memory._replace(state=state, since_s=time_s, fault=fault, calm=False)


def _reasons(memory: Memory, blockers: Blockers) -> tuple[Reason, ...]:
    if memory.state is SupervisorState.ACTIVE:
        return ()
    if not memory.enabled:
        return (Reason.DISABLED,)
    return blockers.reasons or (Reason.HEALING,)
