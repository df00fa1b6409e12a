"""The application: every page's routes behind one guard."""

import asyncio
from collections.abc import AsyncGenerator, Sequence
from contextlib import AsyncExitStack, asynccontextmanager

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route
from starlette.types import ASGIApp

from thermaxis.app.axis import AxisRoom
from thermaxis.screen import _live_socket
from thermaxis.screen.access import ScreenParts, login_routes, render
from thermaxis.screen.pages import (
    operator_page as _operator_page,
    positioning_page as _positioning_page,
    probe_page as _probe_page,
    sensors_page as _sensors_page,
)
from thermaxis.screen.pages.history import close_history, page as _history_page
from thermaxis.screen.pages.model import page as _model_page
from thermaxis.web import Assets, Guard, Packed, answer_json, answer_mistake, refuse, wants_page
from thermaxis.web.work import close_work

_NOT_FOUND = 404
_PAGES = (
    _operator_page,
    _live_socket,
    _model_page,
    _sensors_page,
    _history_page,
    _probe_page,
    _positioning_page,
)


def build_application(
    parts: ScreenParts, hosts: Sequence[str], more: Sequence[BaseRoute] = ()
) -> ASGIApp:
    """Put the pages together, and what else is served behind the same guard."""
    assets = Assets()

    async def alive(request: Request) -> Response:
        del request
        return answer_json({"program": parts.program})

    found: list[BaseRoute] = [
        Route("/static/{name:path}", assets.answer, methods=["GET"]),
        Route("/alive", alive, methods=["GET"]),
        *login_routes(parts),
    ]
    for page in _PAGES:
        found += page.routes(parts)
    found += more

    @asynccontextmanager
    async def life(_: Starlette) -> AsyncGenerator[None]:
        async with AsyncExitStack() as closing:
            await asyncio.to_thread(assets.read)
            await parts.persons.open()
            closing.push_async_callback(parts.persons.close)
            await parts.feed.open()
            closing.push_async_callback(parts.feed.close)
            closing.push_async_callback(close_history, application.state)
            closing.callback(close_work, application.state)
            yield

    application = Starlette(
        routes=found,
        lifespan=life,
        middleware=[Middleware(Packed, ("/history/export", *AxisRoom.files))],
        exception_handlers={HTTPException: _no_route, Exception: answer_mistake},
    )
    application.state.parts = parts
    return Guard(
        application,
        hosts,
        secure=parts.secure,
        language=parts.settings.language,
        largest_bytes=AxisRoom.largest_bytes,
        json_paths=("/ask", "/login"),
    )


async def _no_route(request: Request, error: Exception) -> Response:
    """Answer what no route takes: a page with the way to every other, or JSON for a script."""
    status = error.status_code if isinstance(error, HTTPException) else _NOT_FOUND
    if status != _NOT_FOUND:
        answer = refuse(request, status, "common-refused_method")
        answer.headers.update(getattr(error, "headers", None) or {})
        return answer
    if not wants_page(request):
        return refuse(request, status, "common-no_page")
    found = render(request, "missing.html", page="missing")
    found.status_code = status
    return found
