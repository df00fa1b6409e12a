"""What the history is told beside the cycles: every change, once."""

import math
from collections.abc import Mapping, Sequence
from typing import Final, final

from thermaxis.codes import Message, Value
from thermaxis.compensation import Request
from thermaxis.runtime._ports import Clock, EventRecord, Historian, RequestOutcome
from thermaxis.runtime.status import Alarm, RuntimeStatus, is_mismatch

REASON_EVERY_S: Final = 60.0
"""Why a machine is not reached, or refuses an offset, is told again so often. [s]"""


@final
class Journal:
    """Writes events to the history."""

    def __init__(self, historian: Historian, clock: Clock) -> None:
        self._historian, self._clock = historian, clock
        self._reasons: dict[tuple[str, str], float] = {}

    def event(self, kind: str, code: str, values: Mapping[str, Value] | None = None) -> None:
        """Tell a message."""
        message = Message(code, values or {})
        self._historian.event(EventRecord.of(self._clock.utc(), kind, "", message))

    def request(self, request: Request, outcome: RequestOutcome) -> None:
        """Tell who asked what, and how it was answered."""
        code = "event-request_accepted" if outcome.accepted else "event-request_refused"
        message = Message(code, {"request": str(request.kind), "answer": outcome.message})
        details = {
            "kind": str(request.kind),
            "output": request.output,
            "value": request.value,
            "duration_s": request.duration_s,
            "text": request.text,
            "accepted": outcome.accepted,
        }
        utc = self._clock.utc()
        self._historian.event(EventRecord.of(utc, "request", request.who, message, details))

    def alarm(self, alarm: Alarm) -> None:
        """Tell an alarm that came."""
        values = {"priority": alarm.priority, "alarm": alarm.message}
        self.event("alarm", "event-alarm", values)

    def alarms(self, before: Sequence[Alarm], now: Sequence[Alarm]) -> None:
        """Tell alarms that came and went; a mismatch was told when it was found."""
        known, standing = {one.key for one in before}, {one.key for one in now}
        for one in now:
            if one.key not in known and not is_mismatch(one):
                self.alarm(one)
        for one in before:
            if one.key not in standing:
                self.event("alarm", "event-alarm_gone", {"alarm": one.message})

    def connections(self, last: RuntimeStatus | None, now: RuntimeStatus) -> None:
        """Tell connections that came and went, and why; the same reason once in a minute."""
        rows = (
            ("source", now.source_connected, last and last.source_connected, now.source_reason),
            ("sink", now.sink_connected, last and last.sink_connected, now.sink_reason),
        )
        for what, connected, before, reason in rows:
            if last is not None and connected is not before:
                self.event("connection", f"event-{what}_{'connected' if connected else 'lost'}")
            if reason is None:
                continue
            now_s = self._clock.monotonic_s()
            if now_s - self._reasons.get((what, reason.code), -math.inf) >= REASON_EVERY_S:
                self._reasons[what, reason.code] = now_s
                self.event("connection", f"event-{what}_reason", {"reason": reason})
