"""What the loop tells, sent on to every open page each second."""

import contextlib
import json
from typing import final

import anyio
from starlette.routing import BaseRoute, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from thermaxis.runtime._users import Role
from thermaxis.screen._access import Visitor, visitor_of
from thermaxis.screen._parts import ScreenParts
from thermaxis.screen._persons import OUT, Person
from thermaxis.screen._status_feed import Told

MOST_VIEWERS = 64
"""Pages that are open at once. Default: three times what a shop needs. [1]"""
_POLICY, _TOO_MANY = 1008, 1013


def routes(parts: ScreenParts) -> list[BaseRoute]:
    """Return the route of the open pages.

    Parameters
    ----------
    parts : ScreenParts
        What the pages share.

    Returns
    -------
    list of BaseRoute
        ``/live``.
    """
    return [WebSocketRoute("/live", LiveSocket(parts).serve)]


@final
class LiveSocket:
    """Sends every look at the loop to every open page.

    A page that is slow gets the newest look when it is ready, and none in between; it delays no
    other. A page has nothing to say here: whatever it sends ends its connection. When its log-in
    ends, or the role changes, it is told so once, and loads itself again.

    Parameters
    ----------
    parts : ScreenParts
        What the pages share.
    """

    def __init__(self, parts: ScreenParts) -> None:
        self._parts = parts
        self._viewers = 0

    async def serve(self, socket: WebSocket) -> None:
        """Serve one page until it is closed.

        Parameters
        ----------
        socket : WebSocket
            The page's connection.
        """
        visitor = visitor_of(socket)
        if not visitor.role.at_least(Role.VIEWER):
            await socket.close(_POLICY)
            return
        if self._viewers >= MOST_VIEWERS:
            await socket.close(_TOO_MANY)
            return
        await socket.accept()
        self._viewers += 1
        try:
            async with anyio.create_task_group() as group:
                group.start_soon(_listen, socket, group.cancel_scope)
                await self._send(socket, visitor)
                group.cancel_scope.cancel()
        finally:
            self._viewers -= 1
        with contextlib.suppress(RuntimeError, WebSocketDisconnect):
            await socket.close()

    async def _send(self, socket: WebSocket, visitor: Visitor) -> None:
        hello = {
            "kind": "hello",
            "program": self._parts.program,
            "name": visitor.name,
            "role": visitor.role.value,
            "lost": self._lost(visitor),
        }
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):
            await socket.send_text(json.dumps(hello))
            told = self._parts.feed.latest
            while True:
                now = visitor_of(socket)
                if visitor.person is not None and now.person is None:
                    await socket.send_text(self._ended(visitor.person, visitor.language))
                    return
                if now.role is not visitor.role:
                    await socket.send_text(self._changed(now))
                    return
                await socket.send_text(self._message(told, visitor.language))
                told = await self._parts.feed.after(told.number)

    def _message(self, told: Told, language: str) -> str:
        if told.live:
            age_s = max(0.0, self._parts.clock.monotonic_s() - told.received_s)
            return f'{{"kind":"status","age_s":{age_s:.3f},"status":{told.text}}}'
        key = told.why or "feed.starting"
        return json.dumps(
            {
                "kind": "no_data",
                "key": key,
                "text": self._parts.words.say(language, key),
                "since": told.status.get("utc"),
            }
        )

    def _lost(self, visitor: Visitor) -> str:
        """Say why a person may only look on; empty where that is not so."""
        key = "" if visitor.person is None else visitor.person.lost
        return self._parts.words.say(visitor.language, key) if key else ""

    def _changed(self, now: Visitor) -> str:
        words, language = self._parts.words, now.language
        role = words.say(language, f"common.role_{now.role.value}")
        text = self._lost(now) or words.say(language, "login.role_changed", role=role)
        return json.dumps({"kind": "role", "role": now.role.value, "text": text})

    def _ended(self, person: Person, language: str) -> str:
        text = self._parts.words.say(language, person.ended or OUT)
        return json.dumps({"kind": "ended", "text": text})


async def _listen(socket: WebSocket, scope: anyio.CancelScope) -> None:
    """End the connection when the page is closed, or says something."""
    with contextlib.suppress(WebSocketDisconnect, RuntimeError):
        await socket.receive()
    scope.cancel()
