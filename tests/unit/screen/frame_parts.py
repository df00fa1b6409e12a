"""What the pages share, with a feed and log-ins that a test moves by hand."""

import asyncio
import json
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from types import MappingProxyType, SimpleNamespace
from typing import TYPE_CHECKING, Any, cast

from starlette.applications import Starlette
from starlette.routing import BaseRoute
from starlette.testclient import TestClient

from tests.unit.screen.people import HERE, PASSWORD, People
from thermaxis.runtime import MachineConfiguration, ScreenSettings, Secret, SystemClock
from thermaxis.screen.access import ScreenParts
from thermaxis.screen.feed import StatusFeed, Told

if TYPE_CHECKING:
    from thermaxis.screen.access import Persons


def status(**changes: object) -> dict[str, Any]:
    """Return a status as small as one can be."""
    return {
        "utc": "2026-11-20T10:00:00.000+00:00",
        "number": 7,
        "cycle_s": 1.0,
        "state": "Off",
        "reasons": ["disabled"],
        "inputs": {},
        "alarms": [],
        **changes,
    }


def told(look: int, *, live: bool = True, why: str = "", **changes: object) -> Told:
    """Return a look at the loop."""
    found = status(**changes)
    return Told(
        look,
        json.dumps(found),
        MappingProxyType(found),
        SystemClock().monotonic_s(),
        datetime(2026, 11, 20, 10, tzinfo=UTC),
        live,
        why,
    )


class Feed:
    """A feed that tells what it is given."""

    def __init__(self) -> None:
        self.latest = told(1)
        self._news = asyncio.Event()

    def tell(self, look: Told) -> None:
        """Tell something new."""
        self.latest = look
        self._news.set()

    async def after(self, number: int) -> Told:
        """Wait for something newer; it is told from another thread, so it is looked for anew."""
        while self.latest.number <= number:
            self._news.clear()
            try:
                async with asyncio.timeout(0.02):
                    await self._news.wait()
            except TimeoutError:
                continue
        return self.latest


def settings_with(**changes: Any) -> ScreenSettings:
    """Return the settings of a screen, some of them changed."""
    usual: dict[str, Any] = {
        "address": "127.0.0.1",
        "port": 8450,
        "hosts": (),
        "certificate": None,
        "private_key": None,
        "view_without_login": False,
        "language": "en",
        "user": "",
        "password": Secret(""),
        "client_certificate": None,
        "client_private_key": None,
        "idle_s": 900.0,
        "longest_login_s": 28_800.0,
        "evaluation_s": 60.0,
    }
    return ScreenSettings(**{**usual, **changes})


def parts(
    *, view: bool = True, secure: bool = False, users: bool = True, language: str = "en"
) -> ScreenParts:
    """Return what the pages share."""
    settings = settings_with(view_without_login=view, language=language)
    server = SimpleNamespace(users=Path("users.toml") if users else None)
    configuration = SimpleNamespace(name="lathe <3>", server=server, screen=settings)
    return ScreenParts(
        configuration=cast("MachineConfiguration", configuration),
        settings=settings,
        clock=SystemClock(),
        feed=cast("StatusFeed", Feed()),
        persons=cast("Persons", People()),
        program="run-1",
        secure=secure,
    )


def client(
    given: ScreenParts, *routes: Callable[[ScreenParts], list[BaseRoute]], name: str = ""
) -> TestClient:
    """Return a browser without scripts, logged in under a name if one is given."""
    application = Starlette(routes=[one for make in routes for one in make(given)])
    application.state.parts = given
    scheme = "https" if given.secure else "http"
    browser = TestClient(application, base_url=f"{scheme}://127.0.0.1:8450", follow_redirects=False)
    if name:
        people = cast("People", given.persons)
        asyncio.run(people.log_in(name, PASSWORD, HERE))
        browser.cookies.set(f"{'__Host-' if given.secure else ''}thermaxis_8450", f"cookie-{name}")
    return browser
