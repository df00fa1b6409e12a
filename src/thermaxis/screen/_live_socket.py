"""What the loop tells, sent on to every open page each second."""

import contextlib
import json
from collections import Counter
from typing import Any, final

import anyio
from starlette.routing import BaseRoute, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from thermaxis.codes import Message
from thermaxis.messages import sentence
from thermaxis.runtime import Role
from thermaxis.screen.access import OUT, ScreenParts, UserSession, Visitor, visitor_of
from thermaxis.screen.feed import StatusSnapshot, said_status

MOST_VIEWERS = 64
"""Pages that are open at once. Default: three times what a shop needs. [1]"""
KEPT_FOR_PERSONS = 16
"""Of these, those that only somebody who has logged in can have. [1]"""
MOST_OF_ONE = 24
"""Pages that one address has open without a log-in, or one person with it. [1]"""
_POLICY, _TOO_MANY = 1008, 1013


def routes(parts: ScreenParts) -> list[BaseRoute]:
    """Return the route of the open pages."""
    return [WebSocketRoute("/live", LiveSocket(parts).serve)]


@final
class LiveSocket:
    """Sends every look at the loop to every open page.

    A page that is slow gets the newest look when it is ready, and none in between; it delays no
    other. A page has nothing to say here: whatever it sends ends its connection. When its log-in
    ends, or the role changes, it is told so once, and loads itself again.
    """

    def __init__(self, parts: ScreenParts) -> None:
        self._parts = parts
        self._open: Counter[tuple[bool, str]] = Counter()
        self._said: dict[str, tuple[str, str]] = {}

    async def serve(self, socket: WebSocket) -> None:
        """Serve one page until it is closed."""
        visitor = visitor_of(socket)
        if not visitor.role.at_least(Role.VIEWER):
            await socket.close(_POLICY)
            return
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
                if visitor.person is not None and now.person is None:
                    await socket.send_text(self._ended(visitor.person, visitor.language))
                    return
                if now.role is not visitor.role:
                    await socket.send_text(self._changed(now))
                    return
                await socket.send_text(self._message(told, visitor.language, last=last))
                last = False
                told = await self._parts.feed.after(told.number)

    def _message(self, told: StatusSnapshot, language: str, *, last: bool) -> str:
        """Return a look; without data with the status of before, for a page that has seen none."""
        said: dict[str, Any] = {"kind": "status"}
        if not told.live:
            key = told.why or "feed-starting"
            text, since = sentence(key, language=language), told.status.get("utc")
            said = {"kind": "no_data", "key": key, "text": text, "since": since}
        if told.live or (last and told.text):
            now_s = self._parts.clock.monotonic_s()
            age_s = round(max(0.0, now_s - told.received_s), 3)
            said |= {"age_s": age_s, "sent_s": round(now_s, 3)}
            head = json.dumps(said, separators=(",", ":"))[:-1]
            return f'{head},"status":{self._status(told, language)}}}'
        return json.dumps(said)

    def _status(self, told: StatusSnapshot, language: str) -> str:
        """Return the status with its sentences in a language; made once for all its pages."""
        known = self._said.get(language)
        if known is None or known[0] != told.text:
            names = self._parts.configuration.input_names(language)
            said = said_status(told.status, language, names)
            known = told.text, json.dumps(said, separators=(",", ":"))
            self._said[language] = known
        return known[1]

    def _changed(self, now: Visitor) -> str:
        role = Message(f"common-role_{now.role.value}")
        text = sentence("login-role_changed", {"role": role}, language=now.language)
        return json.dumps({"kind": "role", "role": now.role.value, "text": text})

    def _ended(self, person: UserSession, language: str) -> str:
        text = sentence(person.ended or OUT, language=language)
        return json.dumps({"kind": "ended", "text": text})


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
