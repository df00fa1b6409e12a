"""What is the matter, in one line: the cause goes before the state."""

from collections.abc import Iterator, Mapping
from datetime import datetime, timedelta
from typing import TypeAlias, final

from thermaxis.codes import Message, Value
from thermaxis.compensation import Reason, SampleQuality, SupervisorState
from thermaxis.runtime._ports import OTHER_COMPENSATION
from thermaxis.runtime.status._status import RuntimeStatus

_Causes: TypeAlias = Iterator[tuple[str, str, Mapping[str, Value]]]
_USABLE = frozenset({SampleQuality.GOOD, SampleQuality.REDUNDANT})
_DOUBTFUL = frozenset({"not_acting", "inputs_unreachable", "input_lost"})
"""What a single missed read looks like, too."""
_STANDING = frozenset({"headline-active", "headline-at_limit", "headline-interlock"})
"""What is told on meanwhile, in the same state."""


@final
class Headlines:
    """Names the cause that matters most, and since when it has stood.

    A look whose gravest cause is doubtful, as a busy computer misses a read now and then, changes
    nothing until no other look has been seen for the status's patience.
    """

    def __init__(self) -> None:
        self._since: dict[str, datetime] = {}
        self._state = SupervisorState.OFF
        self._told: tuple[Message, datetime] | None = None
        self._looked = False
        self._sure_s = float("-inf")

    def headline_of(self, status: RuntimeStatus) -> tuple[Message, datetime]:
        """Return the headline of a status, and since when its cause has stood.

        What stood at the first look at the machine has stood since the loop was started, or for
        longer.

        Parameters
        ----------
        status : RuntimeStatus
            Status of a cycle.
        """
        causes, state = [*_causes(status)], status.output.state
        came = status.utc if self._looked else status.started
        since = {key: self._since.get(key, came) for key, _, _ in causes}
        if "hold" in since and "hold" not in self._since:
            since["hold"] = status.utc - timedelta(seconds=status.held_s)
        self._looked = self._looked or status.source_connected
        if causes[0][1] not in _DOUBTFUL:
            self._sure_s = status.output.time_s
        doubted = status.output.time_s - self._sure_s <= status.patience_s
        key, code, values = next(one for one in causes if not (doubted and one[1] == "not_acting"))
        if doubted and self._told and self._state is state and code in _DOUBTFUL:
            told, _ = self._told
            unread = status.interlocks.get(str(told.values.get("name"))) is None
            if told.code in _STANDING and unread:
                self._since |= since
                return self._told
        self._since, self._state = since, state
        self._told = Message(f"headline-{code}", values), since[key]
        return self._told


def state_message(status: RuntimeStatus) -> Message:
    """Return the state with its reasons, and the names of interlocks and inputs that matter."""
    output = status.output
    state, reasons = output.state.value, tuple(reason.value for reason in output.reasons)
    if not reasons:
        return Message("event-state", {"state": state})
    names: tuple[str, ...] = ()
    if Reason.INTERLOCK_OPEN in output.reasons:
        names = status.open_interlocks
    if Reason.INPUT_BAD in output.reasons and status.source_connected:
        names += tuple(_lost_inputs(status))
    values: dict[str, Value] = {"state": state, "reasons": reasons}
    if not names:
        return Message("event-state_reasons", values)
    return Message("event-state_named", {**values, "names": names})


def _causes(status: RuntimeStatus) -> _Causes:
    """Yield what is the matter, what matters most first: what it is, its code and its values.

    The last one is always there.
    """
    state, reasons = status.output.state, status.output.reasons
    if not status.sink_connected or not all(map(status.acting_known, status.outputs)):
        yield "sink", "unreachable", {}
    if state is SupervisorState.OFF:
        yield "off", "off", {}
        return
    if state is SupervisorState.FAULT:
        yield "fault", "fault", {"reason": reasons[0].value if reasons else ""}
    opened = status.open_interlocks
    then = _then(status)
    for name in opened:
        yield f"interlock {name}", "interlock", {"name": name, "names": opened, **then}
    if Reason.CONNECTION_LOST in reasons and status.source_connected:
        yield "sink", "unreachable", {}
    if Reason.INTERLOCK_OPEN in reasons and not opened:
        yield "release", "not_released", {}
    unlike = status.outputs if status.sink_reason is not None else status.differing
    if unlike:
        yield "acting", "not_acting", {"names": unlike}
    if not status.enabled:
        yield "fading", "fading", {}
    elif state is not SupervisorState.FAULT:
        yield from _of_enabled(status, then)


def _then(status: RuntimeStatus) -> Mapping[str, Value]:
    """Return what it takes to go on once the cause is gone."""
    if not status.enabled:
        return {"then": "enable"}
    held = {Reason.OPERATOR_HOLD, Reason.HOLD_EXPIRED} & {*status.output.reasons}
    return {"then": "resume" if held else "wait"}


def _of_enabled(status: RuntimeStatus, then: Mapping[str, Value]) -> _Causes:
    """Yield the same of what should compensate and is released."""
    state, reasons = status.output.state, status.output.reasons
    if not status.source_connected:
        yield "source", "inputs_unreachable", then
    held = "held_for_input" if state is SupervisorState.HOLDING else "input_lost"
    for name in _lost_inputs(status):
        yield f"input {name}", held, {"name": name, **then}
    if Reason.OPERATOR_HOLD in reasons:
        yield "hold", "held_by_person", {"who": status.held_by or None}
    elif Reason.HOLD_EXPIRED in reasons:
        yield "hold", "hold_expired", {}
    if state is not SupervisorState.ACTIVE:
        yield "start", "warming", {"left_s": status.active_in_s}
        return
    for name, at_limit in zip(status.outputs, status.output.at_limit, strict=True):
        if at_limit:
            yield f"limit {name}", "at_limit", {"name": name}
    yield "active", "active", {}


def _lost_inputs(status: RuntimeStatus) -> Iterator[str]:
    """Yield the names of everything that the correction needs and that cannot be read."""
    for name, quality in zip(status.channels, status.output.qualities, strict=False):
        if quality not in _USABLE:
            yield name
    for name, met in status.interlocks.items():
        if met is None:
            yield name
    other = status.samples.get(OTHER_COMPENSATION)
    if other is not None and (other.value is None or not other.good):
        yield OTHER_COMPENSATION
