"""What the loop tells, sent on to every open page each second."""

import contextlib
import json
from collections import Counter
from collections.abc import Mapping
from typing import Any, final

import anyio
from starlette.routing import BaseRoute, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from thermaxis.codes import Message
from thermaxis.messages import sentence
from thermaxis.runtime import Role
from thermaxis.screen.access import OUT, ScreenParts, UserSession, Visitor, visitor_of
from thermaxis.screen.feed import StatusSnapshot, said_code, said_status

MOST_VIEWERS = 64
"""Pages that are open at once. Default: three times what a shop needs. [1]"""
KEPT_FOR_PERSONS = 16
"""Of these, those that only somebody who has logged in can have. [1]"""
MOST_OF_ONE = 24
"""Pages that one address has open without a log-in, or one person with it. [1]"""
_TOO_MANY = 1013


def routes(parts: ScreenParts) -> list[BaseRoute]:
    """Return the route of the open pages."""
    return [WebSocketRoute("/live", LiveSocket(parts).serve)]


@final
class LiveSocket:
    """Sends every look at the loop to every open page.

    A page that is slow gets the newest look when it is ready, and none in between; it delays no
    other. A page has nothing to say here: whatever it sends ends its connection. When its log-in
    ends, or the role changes, it is told so once, and loads itself again. Whoever may not look is
    told the state, how many alarms there are and how grave, for a log-in page must not hide them;
    no value, no name and no reason.
    """

    def __init__(self, parts: ScreenParts) -> None:
        self._parts = parts
        self._open: Counter[tuple[bool, str]] = Counter()
        self._said: dict[tuple[str, bool], tuple[str, str]] = {}

    async def serve(self, socket: WebSocket) -> None:
        """Serve one page until it is closed."""
        visitor = visitor_of(socket)
        await socket.accept()
        whose = _whose(socket, visitor)
        if not self._has_room(whose):
            await self._refuse(socket, visitor.language)
            return
        self._open[whose] += 1
        try:
            async with anyio.create_task_group() as group:
                group.start_soon(_listen, socket, group.cancel_scope)
                await self._send(socket, visitor)
                group.cancel_scope.cancel()
        finally:
            self._open[whose] -= 1
            if not self._open[whose]:
                del self._open[whose]
        with contextlib.suppress(RuntimeError, WebSocketDisconnect):
            await socket.close()

    def _has_room(self, whose: tuple[bool, str]) -> bool:
        logged_in, _ = whose
        most = MOST_VIEWERS if logged_in else MOST_VIEWERS - KEPT_FOR_PERSONS
        # who has logged in is not kept out by those who only look, nor takes their places away
        others = self._open.total() if logged_in else self._without_log_in()
        return others < most and self._open[whose] < MOST_OF_ONE

    def _without_log_in(self) -> int:
        return sum(count for (logged_in, _), count in self._open.items() if not logged_in)

    async def _refuse(self, socket: WebSocket, language: str) -> None:
        """Say to a page why it is told nothing; it asks again by itself."""
        key = "common-too_many_pages"
        text = sentence(key, language=language)
        said = json.dumps({"kind": "no_data", "key": key, "text": text, "since": None})
        with contextlib.suppress(RuntimeError, WebSocketDisconnect):
            await socket.send_text(said)
            await socket.close(_TOO_MANY)

    async def _send(self, socket: WebSocket, visitor: Visitor) -> None:
        hello = {
            "kind": "hello",
            "program": self._parts.program,
            "name": visitor.name,
            "role": visitor.role.value,
        }
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):
            await socket.send_text(json.dumps(hello))
            told, last = self._parts.feed.latest, True
            while True:
                now = visitor_of(socket)
                if (now.person, now.role) != (visitor.person, visitor.role):
                    await socket.send_text(_ended(visitor.person, now))
                    return
                await socket.send_text(self._message(told, visitor, last=last))
                last = False
                told = await self._parts.feed.after(told.number)

    def _message(self, told: StatusSnapshot, visitor: Visitor, *, last: bool) -> str:
        """Return a look; without data with the status of before, for a page that has seen none."""
        said: dict[str, Any] = {"kind": "status"}
        if not told.live:
            key = told.why or "feed-starting"
            text, since = sentence(key, language=visitor.language), told.status.get("utc")
            said = {"kind": "no_data", "key": key, "text": text, "since": since}
        if told.live or (last and told.text):
            now_s = self._parts.clock.monotonic_s()
            age_s = round(max(0.0, now_s - told.received_s), 3)
            said |= {"age_s": age_s, "sent_s": round(now_s, 3)}
            head = json.dumps(said, separators=(",", ":"))[:-1]
            return f'{head},"status":{self._status(told, visitor)}}}'
        return json.dumps(said)

    def _status(self, told: StatusSnapshot, visitor: Visitor) -> str:
        """Return the status with its sentences in a language; made once for all its pages."""
        looks = visitor.role.at_least(Role.VIEWER)
        whose = visitor.language, looks
        known = self._said.get(whose)
        if known is None or known[0] != told.text:
            names = self._parts.shown_names(visitor.language)
            said = said_status(told.status, visitor.language, names)
            shown = said if looks else _gist(said, visitor.language)
            known = told.text, json.dumps(shown, separators=(",", ":"))
            self._said[whose] = known
        return known[1]


def _gist(said: Mapping[str, Any], language: str) -> dict[str, Any]:
    """Return what stands at the head of a log-in page."""
    gravest, count = said["alarms"][:1], len(said["alarms"])
    text = sentence("common-alarms", {"count": count}, language=language)
    shown = {key: said[key] for key in ("number", "utc", "cycle_s", "state")}
    shown["state_said"] = said_code("state-", said["state"], language)
    alarms = [{"priority": one["priority"], "text": text} for one in gravest]
    return {**shown, "alarms": alarms}


def _ended(before: UserSession | None, now: Visitor) -> str:
    """Return why a page is another one's now: its log-in has ended, or the role has changed."""
    key, values = "login-role_changed", {"role": Message(f"common-role_{now.role.value}")}
    if before is not None and now.person is not before:
        key, values = before.ended or OUT, {}
    return json.dumps({"kind": "ended", "text": sentence(key, values, language=now.language)})


def _whose(socket: WebSocket, visitor: Visitor) -> tuple[bool, str]:
    """Return whose page it is: a person's, or of an address."""
    if visitor.person is not None:
        return True, visitor.name
    return False, "" if socket.client is None else socket.client.host


async def _listen(socket: WebSocket, scope: anyio.CancelScope) -> None:
    """End the connection when the page is closed, or says something."""
    with contextlib.suppress(WebSocketDisconnect, RuntimeError):
        await socket.receive()
    scope.cancel()
