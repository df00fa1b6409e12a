"""What is the matter, in one line: the cause goes before the state."""

from collections.abc import Iterator, Mapping
from datetime import datetime, timedelta
from typing import TypeAlias, final

from thermaxis.codes import Message, Value
from thermaxis.compensation import Reason, SupervisorState
from thermaxis.runtime.status._status import RuntimeStatus

_Causes: TypeAlias = Iterator[tuple[str, str, Mapping[str, Value]]]
_DOUBTFUL = frozenset({"not_acting", "inputs_unreachable", "input_lost"})
"""What a single missed read looks like, too."""
_STANDING = frozenset(f"headline-{c}" for c in ("active", "on_its_way", "at_limit", "interlock"))
"""What is told on meanwhile, in the same state."""
_WRITER_S = 10.0
"""Another writer is named for so long: to be read. Then its alarm says so. [s]"""
_STANDS_S, _MOVES_UM = 3.0, 0.2
"""What has a way to go and moves less in so long, or in a micrometre's time, does not act."""


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
        self._began: datetime | None = None
        self._looked = False
        self._sure_s = float("-inf")
        self._moved: dict[str, tuple[float, float]] = {}

    def headline_of(self, status: RuntimeStatus) -> tuple[Message, datetime]:
        """Return the headline of a status, and since when its cause has stood.

        What stood at the first look at the machine has stood since the loop was started, or for
        longer; who looks first at a loop that runs knows of no time before.
        """
        standing = self._standing(status)
        causes, state = [*_causes(status, standing)], status.output.state
        if self._told is None and status.number <= 1:
            self._began = status.started
        came = status.utc if self._looked else self._began or status.utc
        since = {key: self._since.get(key, came) for key, _, _ in causes}
        if "hold" in since and not self._looked:
            since["hold"] = _asked(status)
        self._looked = self._looked or status.source_connected
        if causes[0][1] not in _DOUBTFUL:
            self._sure_s = status.output.time_s
        doubted = not standing and status.output.time_s - self._sure_s <= status.patience_s
        key, code, values = next(one for one in causes if not (doubted and one[1] == "not_acting"))
        if doubted and self._told and self._state is state and code in _DOUBTFUL:
            told, _ = self._told
            unread = status.interlocks.get(str(told.values.get("name"))) is None
            if told.code in _STANDING and unread:
                self._since |= since
                return self._told
        if code == "hold_lost":
            values = {"cause": "restart" if since[key] == status.started else "other"}
        self._since, self._state = since, state
        self._told = Message(f"headline-{code}", values), since[key]
        return self._told

    def _standing(self, status: RuntimeStatus) -> tuple[str, ...]:
        """Return the outputs that should move towards what the model asks for, and stand still."""
        now_s, moved, self._moved = status.output.time_s, self._moved, {}
        standing: list[str] = []
        if status.output.state is not SupervisorState.ACTIVE:
            return ()
        at_limit = dict(zip(status.outputs, status.output.at_limit, strict=True))
        for name in status.left_um:
            um = status.offsets_of(name).acting.um
            if um is None or at_limit[name] or not status.acting_known(name):
                continue
            at_s, at_um = moved.get(name, (now_s, um))
            self._moved[name] = (at_s, at_um) if abs(um - at_um) < _MOVES_UM else (now_s, um)
            rate_um_per_s = status.facts[name].limits.largest_rate_um_per_s
            if now_s - self._moved[name][0] > max(_STANDS_S, 1.0 / rate_um_per_s):
                standing.append(name)
        return tuple(standing)


def _causes(status: RuntimeStatus, standing: tuple[str, ...]) -> _Causes:
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
    tests = Reason.INTERLOCK_OPEN in reasons and not opened
    if Reason.CONNECTION_LOST in reasons:
        if status.source_connected:
            yield ("test", "starting", {}) if tests else ("sink", "unreachable", {})
    elif tests:
        yield "release", "not_released", {}
    for name in _written_by_others(status):
        yield f"writer {name}", "another_writer", {"name": name}
    unlike = status.outputs if status.sink_reason is not None else status.differing
    if unlike:
        yield "acting", "not_acting", {"names": unlike}
    if not status.enabled:
        yield "fading", "fading", {}
    elif state is not SupervisorState.FAULT:
        yield from _of_enabled(status, then, standing)


def _then(status: RuntimeStatus) -> Mapping[str, Value]:
    """Return what it takes to go on once the cause is gone."""
    if not status.enabled:
        return {"then": "enable"}
    held = {Reason.OPERATOR_HOLD, Reason.HOLD_EXPIRED} & {*status.output.reasons}
    fades = status.output.state is SupervisorState.FADING
    return {"then": "wait" if not held else "resume_anew" if fades else "resume"}


def _of_enabled(
    status: RuntimeStatus, then: Mapping[str, Value], standing: tuple[str, ...]
) -> _Causes:
    """Yield the same of what should compensate and is released."""
    state, reasons = status.output.state, status.output.reasons
    if not status.source_connected:
        yield "source", "inputs_unreachable", then
    held = "held_for_input" if state is SupervisorState.HOLDING else "input_lost"
    for name in status.lost_inputs:
        yield f"input {name}", held, {"name": name, **then}
    at_zero = state is SupervisorState.WARMING and not any(status.output.correction_um)
    if Reason.OPERATOR_HOLD in reasons and (at_zero or state is SupervisorState.FADING):
        yield "lost", "hold_lost", {}
    elif Reason.OPERATOR_HOLD in reasons:
        yield "hold", "held_by_person", {"who": status.held_by or None}
    elif Reason.HOLD_EXPIRED in reasons:
        yield "expired", "hold_expired", {}
    if state is not SupervisorState.ACTIVE:
        yield "start", "warming", {"left_s": max(1.0, status.active_in_s)}
        return
    yield from [*_not_there(status, standing)] or [("active", "active", {})]


def _not_there(status: RuntimeStatus, standing: tuple[str, ...]) -> _Causes:
    """Yield the outputs that do not follow the model: at their limit, still, or on their way."""
    for name, at_limit in zip(status.outputs, status.output.at_limit, strict=True):
        if at_limit:
            yield f"limit {name}", "at_limit", {"name": name}
    if standing:
        yield "acting", "not_acting", {"names": standing}
    for name, left_um in status.left_um.items():
        left_s = left_um / status.facts[name].limits.largest_rate_um_per_s
        left = {"left_um": left_um, "left_s": left_s}
        yield f"way {name}", "on_its_way", {"name": name, **left}


def _written_by_others(status: RuntimeStatus) -> Iterator[str]:
    """Yield the outputs that another has just written."""
    for alarm in status.alarms:
        lately = 0.0 <= (status.utc - alarm.since).total_seconds() <= _WRITER_S
        if alarm.code == "another_writer" and lately:
            yield str(alarm.values.get("name"))


def _asked(status: RuntimeStatus) -> datetime:
    """Return when the hold was asked for, also before a restart."""
    return status.utc - timedelta(seconds=status.held_s)
