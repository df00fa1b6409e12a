"""The blocks of requests and of the supervisor: `thermaxis.compensation.supervisor_step`."""

from thermaxis.compensation import SupervisorState
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.blocks._draft import Draft, numbered
from thermaxis.plc.tree import Block, Kind

REQUESTS = "tx_requests"
"""Name of the block that answers requests."""
SUPERVISOR = "tx_supervisor"
"""Name of the block of the supervisor."""

_COUNTED = {
    "input_lost_s": ("hold_input_s", "not inputs_usable"),
    "connection_lost_s": ("hold_connection_s", "not connected"),
    "interlock_open_s": ("hold_interlock_s", "not interlocks_met"),
    "held_s": ("hold_operator_s", "held"),
    "differs_s": (
        "read_back_s",
        "not state == State.OFF and connected and not read_back_agrees",
    ),
    "at_limit_s": (
        "longest_at_limit_s",
        "(state == State.ACTIVE or state == State.HOLDING) and at_limit",
    ),
    "halted_s": (
        "max_hold_s",
        "enabled and (state == State.WARMING or state == State.HOLDING or state == State.FADING)",
    ),
}
"""Durations: what each is compared with, and when it is counted, else set back."""
_FIRST = {"differs_s": "first_differs_s", "at_limit_s": "first_at_limit_s"}
"""What the first cycle counts, where it is no whole one."""


def requests_block(*, double: bool) -> Block:
    """Return the block that answers the requests of a call."""
    draft = Draft(
        REQUESTS,
        "Answers requests: every one is an edge of its input, so there is none in the first call,",
        "but for hold: while that is TRUE, whatever is enabled and without a fault is held. First",
        "reset, which acknowledges a fault whose cause is gone, then enable, then hold.",
        double=double,
    )

    draft.input("first", "whether this is the first call", Kind.BOOL)
    draft.input("reset", "rising: acknowledge", Kind.BOOL)
    draft.input("enable", "rising: enable, falling: disable", Kind.BOOL)
    draft.input("hold", "while it is TRUE: hold, falling: resume", Kind.BOOL)
    draft.input("state", "state before the call", Kind.INT)
    draft.input("fault", "why it is in the state Fault", Kind.INT)
    draft.input("other_compensation", "whether another compensation is active", Kind.BOOL)
    draft.input("offset_outside", "whether a correction lies outside its total", Kind.BOOL)
    draft.input("read_back_agrees", "whether the machine reports what was written", Kind.BOOL)
    draft.input("connected", "whether the machine can be written to", Kind.BOOL)
    draft.output("enabled", "whether somebody has enabled the compensation", Kind.BOOL)
    draft.output("held", "whether an operator holds it", Kind.BOOL)
    draft.output("refused", "whether a request of this call was refused", Kind.BOOL)
    draft.output("forget", "whether the sensors take their present values", Kind.BOOL)
    draft.output("acknowledged", "whether a fault was acknowledged", Kind.BOOL)
    draft.output("enabled_anew", "whether it was enabled in this call", Kind.BOOL)
    draft.state("is_enabled", "whether somebody has enabled it", Kind.BOOL)
    draft.state("is_held", "whether an operator holds it", Kind.BOOL)
    draft.temporary("in_fault", "whether it is in the state Fault", Kind.BOOL)
    for name in ("reset", "enable", "hold"):
        draft.state(f"{name}_before", f"{name} in the last call", Kind.BOOL)
    return draft.block(
        """
        refused = False
        forget = False
        acknowledged = False
        enabled_anew = False
        in_fault = state == State.FAULT
        if first:
            # A level that stands when the PLC starts asks for nothing.
            reset_before = reset
            enable_before = enable
            hold_before = hold
        if reset and not reset_before:
            if in_fault and (
                (fault == Reason.DOUBLE_COMPENSATION and other_compensation)
                or (fault == Reason.OFFSET_OUTSIDE and offset_outside)
                or (fault == Reason.READ_BACK_DIFFERS and not (read_back_agrees and connected))
            ):
                refused = True
            elif in_fault:
                forget = True
                acknowledged = True
                in_fault = False
                is_enabled = False
                is_held = False
            else:
                forget = True
        if enable and not enable_before:
            if in_fault or other_compensation or offset_outside:
                refused = True
            elif not is_enabled:
                is_enabled = True
                is_held = False
                enabled_anew = True
        elif enable_before and not enable:
            is_enabled = False
            is_held = False
        if hold and is_enabled and not in_fault:
            is_held = True
        elif hold and not hold_before:
            refused = True
        elif hold_before and not hold:
            is_held = False
        reset_before = reset
        enable_before = enable
        hold_before = hold
        enabled = is_enabled
        held = is_held
        """
    )


_SIGNALS = {
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
    for name, text in _SIGNALS.items():
        draft.input(name, text, Kind.INT if name.endswith("_before") else Kind.BOOL)
    draft.output("state", "state, see above", Kind.INT)
    draft.output("fault", "why it is in the state Fault, as in the fault word", Kind.INT)
    draft.output("fault_word", "sum of the reasons, see the head", Kind.INT)
    draft.constant("zero", "nothing", 0.0)
    draft.constant("cycle_s", "time from call to call [s]", settings.cycle_s)
    _declare_times(draft, settings)
    draft.temporary("expired", "whether it was held for too long", Kind.BOOL)
    draft.temporary("blocked", "sum of the reasons that keep it inactive", Kind.INT)
    draft.temporary("known_zero", "whether the machine stands at zero", Kind.BOOL)
    draft.temporary("ready", "whether everything is there", Kind.BOOL)
    counted = "".join(
        _up_to(*times)
        for times in (
            ("running_s", "settle_s", "model_runs"),
            ("ready_s", "recovery_delay_s", "ready"),
        )
    )
    counted += """
        # Of the next ones no fault follows from a single cycle, however long that is."""
    counted += "".join(_counted(name, *how) for name, how in _COUNTED.items())
    faults = "".join(
        f"""
        elif not state == State.OFF and {condition}:
            state = State.FAULT
            fault = Reason.{reason}
            fault_word = Reason.{reason}"""
        for condition, reason in (
            ("other_compensation", "DOUBLE_COMPENSATION"),
            ("differs_s > read_back_s", "READ_BACK_DIFFERS"),
            ("offset_outside", "OFFSET_OUTSIDE"),
            ("at_limit_s > longest_at_limit_s", "LONG_AT_LIMIT"),
        )
    )
    return draft.block(
        f"""
        state = state_before
        fault = fault_before
        if acknowledged:
            state = State.FADING
            fault = 0
            differs_s = zero
        if enabled_anew:
            ready_s = zero
        ready = inputs_usable and connected and interlocks_met and model_runs{counted}
        blocked = 0
        expired = halted_s > max_hold_s
        if connection_lost_s > zero:
            blocked += Reason.CONNECTION_LOST
            if connection_lost_s > hold_connection_s:
                expired = True
        if interlock_open_s > zero:
            blocked += Reason.INTERLOCK_OPEN
            if interlock_open_s > hold_interlock_s:
                expired = True
        if input_lost_s > input_timeout_s:
            blocked += Reason.INPUT_BAD
            if input_lost_s > hold_input_s:
                expired = True
        if running_s < settle_s:
            blocked += Reason.SETTLING
        if held and held_s > hold_operator_s:
            blocked += Reason.HOLD_EXPIRED
            expired = True
        elif held:
            blocked += Reason.OPERATOR_HOLD
        known_zero = at_zero and connected
        if state == State.FAULT:
            # It stays so until it is acknowledged.
            fault_word = fault{faults}
        else:
            if not enabled:
                if known_zero or state == State.OFF:
                    state = State.OFF
                else:
                    state = State.FADING
            elif state == State.OFF:
                state = State.WARMING
            elif blocked == 0 and (state == State.ACTIVE or ready_s >= recovery_delay_s):
                state = State.ACTIVE
            elif state == State.FADING:
                if known_zero:
                    state = State.WARMING
            elif expired and not (at_zero and state == State.WARMING):
                state = State.FADING
            elif state == State.ACTIVE:
                state = State.HOLDING
            if state == State.ACTIVE:
                fault_word = 0
            elif not enabled:
                fault_word = Reason.DISABLED
            elif blocked == 0:
                fault_word = Reason.RECOVERING
            else:
                fault_word = blocked
        """
    )


def _declare_times(draft: Draft, settings: PlcSettings) -> None:
    """Declare the durations of the supervisor and what they are compared with."""
    rules, cycle_s = settings.compensation.supervisor, settings.cycle_s
    for name, text in (
        ("running", "the model has run since it started"),
        ("ready", "everything has been there"),
        ("input_lost", "an input has had no usable value"),
        ("connection_lost", "the connection has been lost"),
        ("interlock_open", "an interlock has not been met"),
        ("held", "an operator has held it"),
        ("differs", "the read-back has differed"),
        ("at_limit", "the model has asked for too much"),
        ("halted", "it has been enabled and not active"),
    ):
        draft.state(f"{name}_s", f"time for which {text} [s]")
    for name, text, value_s in (
        ("settle", "the model settles for", rules.settle_s),
        ("recovery_delay", "everything must be there for", rules.recovery_delay_s),
        ("input_timeout", "a lost input is bridged for", rules.input_timeout_s),
        (
            "hold_input",
            "timeout and hold of a lost input",
            rules.input_timeout_s + rules.hold_input_s,
        ),
        ("hold_connection", "hold without a connection", rules.hold_connection_s),
        ("hold_interlock", "hold with an interlock open", rules.hold_interlock_s),
        ("hold_operator", "longest hold", rules.hold_operator_s),
        ("read_back", "the read-back may differ for", rules.read_back_s),
        ("longest_at_limit", "it may stand at the limit for", rules.at_limit_s),
        ("max_hold", "held at most, whatever comes", rules.max_hold_s),
        ("first_differs", "what the first cycle counts of it", min(cycle_s, rules.read_back_s)),
        ("first_at_limit", "what the first cycle counts of it", min(cycle_s, rules.at_limit_s)),
    ):
        draft.constant(f"{name}_s", f"{text} [s]", value_s, "supervisor")


def _up_to(seconds: str, longest: str, condition: str) -> str:
    """Count up to a limit and not beyond."""
    return f"""
        if {condition}:
            {seconds} += cycle_s
            if {seconds} > {longest}:
                {seconds} = {longest}
        else:
            {seconds} = zero"""


def _counted(seconds: str, longest: str, condition: str) -> str:
    """Count on until the limit is passed, and no further."""
    count = f"""if {seconds} <= {longest}:
                {seconds} += cycle_s"""
    if seconds in _FIRST:
        count = f"""if zero <= {seconds} <= zero:
                {seconds} = {_FIRST[seconds]}
            el{count}"""
    return f"""
        if {condition}:
            {count}
        else:
            {seconds} = zero"""
