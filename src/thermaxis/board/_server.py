"""The web server of the board: the registry behind pages, log-in against a file of users."""

import asyncio
from collections.abc import AsyncGenerator, Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.routing import Route
from starlette.types import ASGIApp

from thermaxis.board._pages import routes
from thermaxis.board._parts import BoardParts
from thermaxis.fleet import Registry
from thermaxis.runtime import Clock, Secret, SystemClock
from thermaxis.runtime.config import ScreenSettings, check_pages
from thermaxis.runtime.host import is_loopback
from thermaxis.runtime.users import Users, read_users
from thermaxis.screen import serve_pages
from thermaxis.screen.access import FileSession, UserSessions, login_routes
from thermaxis.web import Assets, Guard, Packed, answer_mistake, answer_no_route

PORT: Final = 8470
"""Usual port. [1]"""


def board_settings(
    address: str = "127.0.0.1",
    port: int = PORT,
    hosts: Sequence[str] = (),
    certificate: Path | None = None,
    private_key: Path | None = None,
) -> ScreenSettings:
    """Return how a board is served, as ``[screen]`` states it of a machine's pages.

    Raises
    ------
    ConfigurationError
        If a name is none, or passwords would leave this computer without TLS.
    """
    stated = ScreenSettings(
        address=address,
        port=port,
        hosts=tuple(hosts),
        certificate=certificate,
        private_key=private_key,
    )
    check_pages(stated)
    # with a further name nobody logs in by a PIN, which is for the machine's own panel
    return replace(stated, hosts=(*stated.hosts, "localhost"))


def board_application(
    registry: Registry,
    settings: ScreenSettings,
    hosts: Sequence[str],
    users: Path | None = None,
    clock: Clock | None = None,
) -> ASGIApp:
    """Put the board's pages together behind guard and log-in.

    Parameters
    ----------
    registry : Registry
        What is known of the machines; used in one thread.
    settings : ScreenSettings
        How it is served: see `board_settings`.
    hosts : sequence of str
        Names with ports by which browsers reach it.
    users : Path, optional
        File of users: engineers decide, all may look. Without it everybody may look and nobody
        decides.
    clock : Clock, optional
        Time.
    """
    assets, time = Assets(), clock or SystemClock()
    known = None if users is None else Users(users, time)

    async def session_of(name: str, password: Secret) -> FileSession | None:
        return None if known is None else await FileSession.log_in(known, name, password)

    here = is_loopback(settings.address) and settings.hosts == ("localhost",)
    parts = BoardParts(
        settings=replace(settings, view_without_login=known is None or here),
        registry=registry,
        thread=ThreadPoolExecutor(1, "registry"),
        people=known is not None,
        secure=settings.secure,
        persons=UserSessions(
            session_of, time, idle_s=settings.idle_s, longest_s=settings.longest_login_s
        ),
    )

    @asynccontextmanager
    async def life(_: Starlette) -> AsyncGenerator[None]:
        await asyncio.to_thread(assets.read)
        await parts.persons.open()
        yield
        await parts.persons.close()
        if known is not None:
            await known.close()
        parts.thread.shutdown()

    application = Starlette(
        routes=[
            Route("/static/{name:path}", assets.answer, methods=["GET"]),
            *login_routes(parts),
            *routes(),
        ],
        lifespan=life,
        middleware=[Middleware(Packed, ("/model",))],
        exception_handlers={HTTPException: answer_no_route, Exception: answer_mistake},
    )
    application.state.parts = parts
    return Guard(
        application, hosts, secure=settings.secure, json_paths=("/login", "/decide", "/language")
    )


async def serve_board(
    registry: Registry,
    settings: ScreenSettings,
    tell: Callable[[str], None],
    users: Path | None = None,
) -> None:
    """Serve the board until told to end: see `board_application`.

    Raises
    ------
    ConfigurationError
        If the file of users or a certificate cannot be used, or the address is taken.
    """
    if users is not None:
        read_users(users)
    await serve_pages(
        settings, lambda hosts: board_application(registry, settings, hosts, users), tell
    )
