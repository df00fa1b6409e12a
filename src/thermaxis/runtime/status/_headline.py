"""What is the matter, in one line: the cause goes before the state."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, TypeAlias, final

from thermaxis.codes import Message, Value
from thermaxis.compensation import Reason, SampleQuality, SupervisorState
from thermaxis.runtime._ports import OTHER_COMPENSATION
from thermaxis.runtime.status._status import RuntimeStatus

if TYPE_CHECKING:
    from datetime import datetime

_Causes: TypeAlias = Iterator[tuple[str, str, Mapping[str, Value]]]
_USABLE = frozenset({SampleQuality.GOOD, SampleQuality.REDUNDANT})


@final
class Headlines:
    """Names the cause that matters most, and since when it has stood."""

    def __init__(self) -> None:
        self._since: dict[str, datetime] = {}

    def headline_of(
        self, status: RuntimeStatus, left_s: float, held_by: str
    ) -> "tuple[Message, datetime]":
        """Return the headline of a status, and since when its cause has stood.

        Parameters
        ----------
        status : RuntimeStatus
            Status of a cycle.
        left_s : float
            Time after which it is active, if all stays as it is. [s]
        held_by : str
            Who holds it; empty where that is not known.
        """
        causes = [*_causes(status, left_s, held_by)]
        self._since = {key: self._since.get(key, status.utc) for key, _, _ in causes}
        key, code, values = causes[0]
        return Message(f"headline-{code}", values), self._since[key]


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


def _causes(status: RuntimeStatus, left_s: float, held_by: str) -> _Causes:
    """Yield what is the matter, what matters most first: what it is, its code and its values.

    The last one is always there.
    """
    state, reasons = status.output.state, status.output.reasons
    if not status.sink_connected or not all(map(status.acting_known, status.outputs)):
        yield "sink", "unreachable", {}
    if state is SupervisorState.OFF:
        yield "state", "off", {}
        return
    if state is SupervisorState.FAULT:
        yield "fault", "fault", {"reason": reasons[0].value if reasons else ""}
    opened = status.open_interlocks
    for name in opened:
        yield f"interlock {name}", "interlock", {"name": name, "names": opened}
    blocked = Reason.INTERLOCK_OPEN in reasons and not opened
    if blocked or Reason.CONNECTION_LOST in reasons:
        yield "release", "not_released", {}
    if not status.enabled:
        yield "state", "fading", {}
    elif state is not SupervisorState.FAULT:
        yield from _of_enabled(status, left_s, held_by)


def _of_enabled(status: RuntimeStatus, left_s: float, held_by: str) -> _Causes:
    """Yield the same of what should compensate and is released."""
    state, reasons = status.output.state, status.output.reasons
    if not status.source_connected:
        yield "source", "inputs_unreachable", {}
    held = "held_for_input" if state is SupervisorState.HOLDING else "input_lost"
    for name in _lost_inputs(status):
        yield f"input {name}", held, {"name": name}
    if Reason.OPERATOR_HOLD in reasons:
        yield "hold", "held_by_person", {"who": held_by or None}
    elif Reason.HOLD_EXPIRED in reasons:
        yield "hold", "hold_expired", {}
    if state is not SupervisorState.ACTIVE:
        yield "start", "warming", {"left_s": left_s}
        return
    for name, at_limit in zip(status.outputs, status.output.at_limit, strict=True):
        if at_limit:
            yield f"limit {name}", "at_limit", {"name": name}
    yield "state", "active", {}


def _lost_inputs(status: RuntimeStatus) -> Iterator[str]:
    """Yield the names of everything that the correction needs and that cannot be read."""
    lost = False
    for name, quality in zip(status.channels, status.output.qualities, strict=False):
        if quality not in _USABLE:
            lost = True
            yield name
    for name, met in status.interlocks.items():
        if met is None:
            lost = True
            yield name
    if not lost and Reason.INPUT_BAD in status.output.reasons:
        yield OTHER_COMPENSATION
