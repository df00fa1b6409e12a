"""The blocks of requests and of the supervisor: `thermaxis.compensation.supervisor_step`."""

from typing import NamedTuple, final

from thermaxis.compensation import Reason, SupervisorRules, SupervisorState
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.blocks._draft import (
    NO,
    YES,
    Draft,
    above,
    at_least,
    at_most,
    below,
    both,
    choose,
    either,
    equals,
    let,
    no,
    note,
    numbered,
    plus,
    when,
    within,
)
from thermaxis.plc.tree import Block, Count, Expression, If, Kind, Name, Statement

REQUESTS = "tx_requests"
"""Name of the block that answers requests."""
SUPERVISOR = "tx_supervisor"
"""Name of the block of the supervisor."""

_STATES = list(SupervisorState)
_REASONS = list(Reason)


def state_number(state: SupervisorState) -> Count:
    """Return the number of a state: its place among them."""
    return Count(_STATES.index(state))


def reason_bit(reason: Reason) -> Count:
    """Return the number that a reason adds to the fault word."""
    return Count(2 ** _REASONS.index(reason))


_OFF, _WARMING, _ACTIVE, _HOLDING, _FADING, _FAULT = (state_number(s) for s in _STATES)


def requests_block(*, double: bool) -> Block:
    """Return the block that answers the requests of a call."""
    draft = Draft(
        REQUESTS,
        "Answers requests: every one is an edge of its input, so there is none in the first call,",
        "but for hold: while that is TRUE, whatever is enabled and without a fault is held. First",
        "reset, which acknowledges a fault whose cause is gone, then enable, then hold.",
        double=double,
    )

    def told(name: str, text: str, kind: Kind = Kind.BOOL) -> Name:
        return draft.input(name, text, kind)

    def said(name: str, text: str) -> Name:
        return draft.output(name, text, Kind.BOOL)

    first = told("first", "whether this is the first call")
    reset = told("reset", "rising: acknowledge")
    enable = told("enable", "rising: enable, falling: disable")
    hold = told("hold", "while it is TRUE: hold, falling: resume")
    state = told("state", "state before the call", Kind.INT)
    fault = told("fault", "why it is in the state Fault", Kind.INT)
    other = told("other_compensation", "whether another compensation is active")
    outside = told("offset_outside", "whether a correction lies outside its total")
    agrees = told("read_back_agrees", "whether the machine reports what was written")
    connected = told("connected", "whether the machine can be written to")
    enabled_out = said("enabled", "whether somebody has enabled the compensation")
    held_out = said("held", "whether an operator holds it")
    refused = said("refused", "whether a request of this call was refused")
    forget = said("forget", "whether the sensors take their present values")
    cleared = said("acknowledged", "whether a fault was acknowledged")
    anew = said("enabled_anew", "whether it was enabled in this call")
    enabled = draft.state("is_enabled", "whether somebody has enabled it", Kind.BOOL)
    held = draft.state("is_held", "whether an operator holds it", Kind.BOOL)
    in_fault = draft.temporary("in_fault", "whether it is in the state Fault", Kind.BOOL)
    before = {
        name: draft.state(f"{name}_before", f"{name} in the last call", Kind.BOOL)
        for name in ("reset", "enable", "hold")
    }
    stands = either(
        both(equals(fault, reason_bit(Reason.DOUBLE_COMPENSATION)), other),
        both(equals(fault, reason_bit(Reason.OFFSET_OUTSIDE)), outside),
        both(equals(fault, reason_bit(Reason.READ_BACK_DIFFERS)), no(both(agrees, connected))),
    )
    return draft.block(
        *(let(flag, NO) for flag in (refused, forget, cleared, anew)),
        let(in_fault, equals(state, _FAULT)),
        when(
            first,
            note("A level that stands when the PLC starts asks for nothing."),
            let(before["reset"], reset),
            let(before["enable"], enable),
            let(before["hold"], hold),
        ),
        when(
            both(reset, no(before["reset"])),
            choose(
                (both(in_fault, stands), (let(refused, YES),)),
                (
                    in_fault,
                    (
                        let(forget, YES),
                        let(cleared, YES),
                        let(in_fault, NO),
                        let(enabled, NO),
                        let(held, NO),
                    ),
                ),
                otherwise=(let(forget, YES),),
            ),
        ),
        choose(
            (
                both(enable, no(before["enable"])),
                (
                    choose(
                        (either(in_fault, other, outside), (let(refused, YES),)),
                        (no(enabled), (let(enabled, YES), let(held, NO), let(anew, YES))),
                    ),
                ),
            ),
            (both(before["enable"], no(enable)), (let(enabled, NO), let(held, NO))),
        ),
        choose(
            (both(hold, enabled, no(in_fault)), (let(held, YES),)),
            (both(hold, no(before["hold"])), (let(refused, YES),)),
            (both(before["hold"], no(hold)), (let(held, NO),)),
        ),
        let(before["reset"], reset),
        let(before["enable"], enable),
        let(before["hold"], hold),
        let(enabled_out, enabled),
        let(held_out, held),
    )


@final
class _Counter(NamedTuple):
    """A duration that the supervisor counts."""

    seconds: Name
    """The duration. [s]"""
    longest: Name
    """What it is compared with: it is counted no further than beyond that. [s]"""
    on: Expression
    """Whether it is counted; else it is set back."""
    first: Name | None = None
    """What its first cycle counts; None for a whole cycle. [s]"""


@final
class _Signals(NamedTuple):
    """What the supervisor is told."""

    state: Name
    fault: Name
    enabled: Name
    held: Name
    acknowledged: Name
    enabled_anew: Name
    inputs_usable: Name
    model_runs: Name
    connected: Name
    interlocks_met: Name
    read_back_agrees: Name
    at_limit: Name
    other_compensation: Name
    offset_outside: Name
    at_zero: Name


_SIGNAL_TEXTS = {
    "state_before": "state before the call",
    "fault_before": "why it is in the state Fault",
    "enabled": "whether somebody has enabled the compensation",
    "held": "whether an operator holds it",
    "acknowledged": "whether a fault was acknowledged in this call",
    "enabled_anew": "whether it was enabled in this call",
    "inputs_usable": "whether every input has a usable value",
    "model_runs": "whether the model runs on, neither waiting nor started anew",
    "connected": "whether the machine can be written to",
    "interlocks_met": "whether every interlock is met",
    "read_back_agrees": "whether the machine reports what was written",
    "at_limit": "whether the model asks for more than the magnitude allows",
    "other_compensation": "whether another compensation is active on an axis",
    "offset_outside": "whether a correction in force lies outside its total",
    "at_zero": "whether every correction in force is zero",
}


def supervisor_block(settings: PlcSettings) -> Block:
    """Return the block that decides when the machine is compensated.

    Not protected: the supervisor believes its signals. An interlock that is wired to nothing is
    met or not met for ever.
    """
    draft = Draft(
        SUPERVISOR,
        "Decides when the machine is compensated and what follows when something fails. States:",
        numbered(SupervisorState, ", ") + ". Every duration is counted from",
        "the first cycle in which its condition holds, no further than beyond its limit.",
        double=settings.double,
    )
    signals = _Signals(
        *(
            draft.input(name, text, Kind.INT if name.endswith("_before") else Kind.BOOL)
            for name, text in _SIGNAL_TEXTS.items()
        )
    )
    state = draft.output("state", "state, see above", Kind.INT)
    fault = draft.output("fault", "why it is in the state Fault, as in the fault word", Kind.INT)
    word = draft.output("fault_word", "sum of the reasons, see the head", Kind.INT)
    zero = draft.constant("zero", "nothing", 0.0)
    cycle_s = draft.constant("cycle_s", "time from call to call [s]", settings.cycle_s)
    times = _Times(draft, settings.compensation.supervisor, settings.cycle_s)
    expired = draft.temporary("expired", "whether it was held for too long", Kind.BOOL)
    blocked = draft.temporary("blocked", "sum of the reasons that keep it inactive", Kind.INT)
    known_zero = draft.temporary("known_zero", "whether the machine stands at zero", Kind.BOOL)
    ready = draft.temporary("ready", "whether everything is there", Kind.BOOL)
    return draft.block(
        let(state, signals.state),
        let(fault, signals.fault),
        when(
            signals.acknowledged,
            let(state, _FADING),
            let(fault, Count(0)),
            let(times.differs, zero),
        ),
        when(signals.enabled_anew, let(times.ready, zero)),
        *_counted(times, signals, state, ready, zero, cycle_s),
        *_blockers(times, signals, blocked, expired, zero),
        let(known_zero, both(signals.at_zero, signals.connected)),
        choose(
            (
                equals(state, _FAULT),
                (note("It stays so until it is acknowledged."), let(word, fault)),
            ),
            (
                both(no(equals(state, _OFF)), signals.other_compensation),
                _to_fault(state, fault, word, Reason.DOUBLE_COMPENSATION),
            ),
            (
                both(no(equals(state, _OFF)), above(times.differs, times.longest_differs)),
                _to_fault(state, fault, word, Reason.READ_BACK_DIFFERS),
            ),
            (
                both(no(equals(state, _OFF)), signals.offset_outside),
                _to_fault(state, fault, word, Reason.OFFSET_OUTSIDE),
            ),
            (
                both(no(equals(state, _OFF)), above(times.at_limit, times.longest_at_limit)),
                _to_fault(state, fault, word, Reason.LONG_AT_LIMIT),
            ),
            otherwise=(
                _next_state(times, signals, state, (blocked, expired, known_zero)),
                choose(
                    (equals(state, _ACTIVE), (let(word, Count(0)),)),
                    (no(signals.enabled), (let(word, reason_bit(Reason.DISABLED)),)),
                    (equals(blocked, Count(0)), (let(word, reason_bit(Reason.RECOVERING)),)),
                    otherwise=(let(word, blocked),),
                ),
            ),
        ),
    )


def _to_fault(state: Name, fault: Name, word: Name, reason: Reason) -> tuple[Statement, ...]:
    bit = reason_bit(reason)
    return let(state, _FAULT), let(fault, bit), let(word, bit)


@final
class _Times:
    """Durations of the supervisor and what they are compared with."""

    def __init__(self, draft: Draft, rules: SupervisorRules, cycle_s: float) -> None:
        def counted(name: str, text: str) -> Name:
            return draft.state(f"{name}_s", f"time for which {text} [s]")

        def limit(name: str, text: str, value_s: float) -> Name:
            return draft.constant(f"{name}_s", f"{text} [s]", value_s)

        self.running = counted("running", "the model has run since it started")
        self.ready = counted("ready", "everything has been there")
        self.input_lost = counted("input_lost", "an input has had no usable value")
        self.connection_lost = counted("connection_lost", "the connection has been lost")
        self.interlock_open = counted("interlock_open", "an interlock has not been met")
        self.held = counted("held", "an operator has held it")
        self.differs = counted("differs", "the read-back has differed")
        self.at_limit = counted("at_limit", "the model has asked for too much")
        self.halted = counted("halted", "it has been enabled and not active")
        self.settle = limit("settle", "the model settles for", rules.settle_s)
        self.recovery_delay = limit(
            "recovery_delay", "everything must be there for", rules.recovery_delay_s
        )
        self.input_timeout = limit(
            "input_timeout", "a lost input is bridged for", rules.input_timeout_s
        )
        self.longest_input = limit(
            "hold_input",
            "timeout and hold of a lost input",
            rules.input_timeout_s + rules.hold_input_s,
        )
        self.longest_connection = limit(
            "hold_connection", "hold without a connection", rules.hold_connection_s
        )
        self.longest_interlock = limit(
            "hold_interlock", "hold with an interlock open", rules.hold_interlock_s
        )
        self.longest_held = limit("hold_operator", "longest hold", rules.hold_operator_s)
        self.longest_differs = limit("read_back", "the read-back may differ for", rules.read_back_s)
        self.longest_at_limit = limit(
            "longest_at_limit", "it may stand at the limit for", rules.at_limit_s
        )
        self.max_hold = limit("max_hold", "held at most, whatever comes", rules.max_hold_s)
        self.first_differs = limit(
            "first_differs", "what the first cycle counts of it", min(cycle_s, rules.read_back_s)
        )
        self.first_at_limit = limit(
            "first_at_limit", "what the first cycle counts of it", min(cycle_s, rules.at_limit_s)
        )


def _counted(
    times: _Times, signals: _Signals, state: Name, ready: Name, zero: Name, cycle_s: Name
) -> tuple[Statement, ...]:
    """Count every duration on, or set it back."""
    watched = both(no(equals(state, _OFF)), signals.connected)
    at_work = either(equals(state, _ACTIVE), equals(state, _HOLDING))
    waiting = either(equals(state, _WARMING), equals(state, _HOLDING), equals(state, _FADING))
    counters = (
        _Counter(times.input_lost, times.longest_input, no(signals.inputs_usable)),
        _Counter(times.connection_lost, times.longest_connection, no(signals.connected)),
        _Counter(times.interlock_open, times.longest_interlock, no(signals.interlocks_met)),
        _Counter(times.held, times.longest_held, signals.held),
        _Counter(
            times.differs,
            times.longest_differs,
            both(watched, no(signals.read_back_agrees)),
            times.first_differs,
        ),
        _Counter(
            times.at_limit,
            times.longest_at_limit,
            both(at_work, signals.at_limit),
            times.first_at_limit,
        ),
        _Counter(times.halted, times.max_hold, both(signals.enabled, waiting)),
    )
    everything = both(
        signals.inputs_usable, signals.connected, signals.interlocks_met, signals.model_runs
    )
    return (
        let(ready, everything),
        _up_to(times.running, times.settle, signals.model_runs, zero, cycle_s),
        _up_to(times.ready, times.recovery_delay, ready, zero, cycle_s),
        note("Of the next ones no fault follows from a single cycle, however long that is."),
        *(_grown(counter, zero, cycle_s) for counter in counters),
    )


def _up_to(seconds: Name, longest: Name, on: Expression, zero: Name, cycle_s: Name) -> If:
    """Count up to a limit and not beyond."""
    count: tuple[Statement, ...] = (
        let(seconds, plus(seconds, cycle_s)),
        when(above(seconds, longest), let(seconds, longest)),
    )
    return choose((on, count), otherwise=(let(seconds, zero),))


def _grown(counter: _Counter, zero: Name, cycle_s: Name) -> If:
    seconds, longest, on, first = counter
    more = when(at_most(seconds, longest), let(seconds, plus(seconds, cycle_s)))
    if first is not None:
        more = choose(
            (within(seconds, zero, zero), (let(seconds, first),)),
            (at_most(seconds, longest), (let(seconds, plus(seconds, cycle_s)),)),
        )
    return choose((on, (more,)), otherwise=(let(seconds, zero),))


def _blockers(
    times: _Times, signals: _Signals, blocked: Name, expired: Name, zero: Name
) -> tuple[Statement, ...]:
    """Find what keeps an enabled compensation from being active."""

    def add(reason: Reason) -> Statement:
        return let(blocked, plus(blocked, reason_bit(reason)))

    return (
        let(blocked, Count(0)),
        let(expired, above(times.halted, times.max_hold)),
        when(
            above(times.connection_lost, zero),
            add(Reason.CONNECTION_LOST),
            when(above(times.connection_lost, times.longest_connection), let(expired, YES)),
        ),
        when(
            above(times.interlock_open, zero),
            add(Reason.INTERLOCK_OPEN),
            when(above(times.interlock_open, times.longest_interlock), let(expired, YES)),
        ),
        when(
            above(times.input_lost, times.input_timeout),
            add(Reason.INPUT_BAD),
            when(above(times.input_lost, times.longest_input), let(expired, YES)),
        ),
        when(below(times.running, times.settle), add(Reason.SETTLING)),
        choose(
            (
                both(signals.held, above(times.held, times.longest_held)),
                (add(Reason.HOLD_EXPIRED), let(expired, YES)),
            ),
            (signals.held, (add(Reason.OPERATOR_HOLD),)),
        ),
    )


def _next_state(
    times: _Times, signals: _Signals, state: Name, seen: tuple[Name, Name, Name]
) -> Statement:
    """Choose the state of this call: the table of transitions, faults apart."""
    blocked, expired, known_zero = seen
    free = both(
        equals(blocked, Count(0)),
        either(equals(state, _ACTIVE), at_least(times.ready, times.recovery_delay)),
    )
    fades = both(expired, no(both(signals.at_zero, equals(state, _WARMING))))
    return choose(
        (
            no(signals.enabled),
            (
                choose(
                    (either(known_zero, equals(state, _OFF)), (let(state, _OFF),)),
                    otherwise=(let(state, _FADING),),
                ),
            ),
        ),
        (equals(state, _OFF), (let(state, _WARMING),)),
        (free, (let(state, _ACTIVE),)),
        (equals(state, _FADING), (when(known_zero, let(state, _WARMING)),)),
        (fades, (let(state, _FADING),)),
        (equals(state, _ACTIVE), (let(state, _HOLDING),)),
    )
