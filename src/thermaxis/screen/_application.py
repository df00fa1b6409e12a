"""The application: every page's routes behind one guard."""

from collections.abc import AsyncGenerator, Sequence
from contextlib import AsyncExitStack, asynccontextmanager

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import BaseRoute, Route
from starlette.types import ASGIApp

from thermaxis.screen import (
    _history_page,
    _live_socket,
    _login_page,
    _model_page,
    _operator_page,
    _positioning_page,
    _probe_page,
    _sensors_page,
)
from thermaxis.screen._assets import Assets
from thermaxis.screen._guard import Guard
from thermaxis.screen._history import close_history
from thermaxis.screen._parts import ScreenParts
from thermaxis.screen._work import close_work

_PAGES = (
    _operator_page,
    _login_page,
    _live_socket,
    _model_page,
    _sensors_page,
    _history_page,
    _probe_page,
    _positioning_page,
)


def build_application(parts: ScreenParts, hosts: Sequence[str]) -> ASGIApp:
    """Put the pages together.

    Parameters
    ----------
    parts : ScreenParts
        What the pages share; feed and log-ins are opened and closed with the application.
    hosts : sequence of str
        What the header ``Host`` of a request may be.

    Returns
    -------
    ASGIApp
        The application, guarded.
    """
    assets = Assets()

    async def asset(request: Request) -> Response:
        return assets.answer(request)

    async def alive(request: Request) -> Response:
        del request
        return JSONResponse({"program": parts.program})

    found: list[BaseRoute] = [
        Route("/static/{name}", asset, methods=["GET"]),
        Route("/alive", alive, methods=["GET"]),
    ]
    for page in _PAGES:
        found += page.routes(parts)

    @asynccontextmanager
    async def life(_: Starlette) -> AsyncGenerator[None]:
        async with AsyncExitStack() as closing:
            await parts.persons.open()
            closing.push_async_callback(parts.persons.close)
            await parts.feed.open()
            closing.push_async_callback(parts.feed.close)
            closing.push_async_callback(close_history, application.state)
            closing.callback(close_work, application.state)
            yield

    application = Starlette(routes=found, lifespan=life)
    application.state.parts = parts
    return Guard(application, hosts, secure=parts.secure)
