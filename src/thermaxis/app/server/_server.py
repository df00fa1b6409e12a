"""The app's own server: this computer alone, an address with a token, until it is ended."""

import asyncio
import hmac
import os
import secrets
import sys
import time
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from datetime import UTC, datetime
from functools import wraps
from pathlib import Path
from types import SimpleNamespace
from typing import Final, NamedTuple, final

from starlette.applications import Starlette
from starlette.datastructures import MutableHeaders
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.requests import HTTPConnection, Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import BaseRoute, Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from thermaxis.app._rooms import Endpoint
from thermaxis.app.axis import AxisRoom
from thermaxis.app.thermal import ThermalRoom
from thermaxis.messages import LANGUAGES, short_names
from thermaxis.web import (
    Assets,
    Guard,
    Listener,
    Packed,
    RefusedError,
    Server,
    answer_json,
    answer_mistake,
    answer_no_route,
    choose_language,
    refuse,
    spoken,
    text_of_template,
)
from thermaxis.web.work import Work, close_work

ADDRESS: Final = "127.0.0.1"
"""This computer alone."""
LONGEST_S: Final = 600.0
"""Longest time of a command. [s]"""
ROOMS: Final = (("positioning", "/"), ("thermal", "/thermal"))
"""Rooms in the order of their buttons: key of their name, and address."""
_FORBIDDEN = 403
_OPEN = ("/static/",)


class _Someone(NamedTuple):
    """Whoever opened the address: one person, who never leaves."""

    name: str = "app"
    ended: bool = False


def settings_folder() -> Path | None:
    """Return the user's own folder of settings of this program, which may not be there."""
    stated = os.environ.get("APPDATA" if sys.platform == "win32" else "XDG_CONFIG_HOME", "")
    try:
        base = Path(stated) if Path(stated).is_absolute() else Path.home() / ".config"
    except RuntimeError:  # a user without a home
        return None
    return base / "thermaxis"


@final
class AppHost:
    """The app, as a room sees it: everything belongs to whoever came in."""

    longest_s = LONGEST_S
    _someone = _Someone()

    def __init__(self) -> None:
        self.settings = settings_folder()

    def monotonic_s(self) -> float:
        """Return a time that only rises. [s]"""
        return time.monotonic()

    def utc(self) -> datetime:
        """Return the time by the calendar."""
        return datetime.now(UTC)

    def guarded(self, endpoint: Endpoint) -> Endpoint:
        """Return an endpoint whose refusals are answered in words."""

        @wraps(endpoint)
        async def answered(request: Request) -> Response:
            try:
                return await endpoint(request)
            except RefusedError as error:
                return refuse(request, error.status, error.key, **error.values)

        return answered

    paged = guarded

    def owner_of(self, request: Request) -> _Someone:
        """Return who works."""
        del request
        return self._someone

    def page(self, request: Request, template: str, *, page: str, **context: object) -> Response:
        """Return a page of the app."""
        text = text_of_template(
            template,
            spoken(request),
            short_names,
            base="app.html",
            rooms=ROOMS,
            machine="thermaxis",
            page=page,
            **context,
        )
        return HTMLResponse(text)


@final
class Entrance:
    """Lets in who has opened the address with the token, and afterwards their browser alone.

    Not protected: another program of the same user, which can read the address where the browser
    was told it.
    """

    def __init__(self, app: ASGIApp, token: str, cookie: str) -> None:
        self._app, self._token, self._cookie = app, token, cookie

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer, or refuse in words."""
        if scope["type"] != "http" or scope["path"].startswith(_OPEN):
            await self._app(scope, receive, send)
            return
        connection = HTTPConnection(scope)
        stated = connection.query_params.get("token", "") if scope["path"] == "/" else ""

        async def marked(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).append(
                    "Set-Cookie",
                    f"{self._cookie}={self._token}; Path=/; HttpOnly; SameSite=Strict",
                )
            await send(message)

        if self._is_ours(stated):
            await self._app(scope, receive, marked)
        elif self._is_ours(connection.cookies.get(self._cookie, "")):
            await self._app(scope, receive, send)
        else:
            await refuse(connection, _FORBIDDEN, "app-no_token")(scope, receive, send)

    def _is_ours(self, token: str) -> bool:
        return hmac.compare_digest(token.encode(), self._token.encode())


def build_app(token: str, port: int, end: Callable[[], None]) -> ASGIApp:
    """Put the rooms together behind guard and entrance.

    Parameters
    ----------
    port : int
        Port of the server. [1]
    """
    assets, host = Assets(), AppHost()
    room = AxisRoom(host)

    async def leave(_: Request) -> Response:
        end()
        return answer_json({})

    routes: list[BaseRoute] = [
        Route("/static/{name:path}", assets.answer, methods=["GET"]),
        Route("/language", choose_language, methods=["POST"]),
        Route("/end", leave, methods=["POST"]),
        *room.routes(),
        *ThermalRoom(host).routes(),
        Route("/", host.paged(room.page), methods=["GET"]),
    ]

    @asynccontextmanager
    async def life(_: Starlette) -> AsyncGenerator[None]:
        await asyncio.to_thread(assets.read)
        yield
        close_work(application.state)

    application = Starlette(
        routes=routes,
        lifespan=life,
        middleware=[
            Middleware(Entrance, token, f"thermaxis_app_{port}"),
            Middleware(Packed, (*AxisRoom.files, *ThermalRoom.files)),
        ],
        exception_handlers={HTTPException: answer_no_route, Exception: answer_mistake},
    )
    application.state.parts = SimpleNamespace(language=LANGUAGES[0])
    application.state.work = Work(nice=0)  # there is no loop that it could stand back behind
    return Guard(
        application,
        [f"{ADDRESS}:{port}", f"localhost:{port}"],
        secure=False,
        largest_bytes={**AxisRoom.largest_bytes, **ThermalRoom.largest_bytes},
    )


async def serve_app(port: int, tell: Callable[[str], None]) -> None:
    """Serve the app on this computer until it is ended.

    Parameters
    ----------
    port : int
        Port; 0: any that is free. [1]

    Raises
    ------
    ConfigurationError
        If the port is taken.
    """
    with Listener.at(ADDRESS, port, "app_cannot_listen") as listener:
        token, port = secrets.token_urlsafe(24), int(listener.getsockname()[1])

        def end() -> None:
            server.should_exit = True

        server = Server(
            build_app(token, port, end), lambda: tell(f"http://{ADDRESS}:{port}/?token={token}")
        )
        await server.serve(sockets=[listener])
