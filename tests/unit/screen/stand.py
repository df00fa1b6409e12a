"""The one stand of the pages: a feed and log-ins that a test moves by hand, and a browser."""

import asyncio
import json
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from types import MappingProxyType, SimpleNamespace
from typing import Any, cast

import numpy as np
from starlette.applications import Starlette
from starlette.routing import BaseRoute
from starlette.testclient import TestClient

from tests.unit.screen.people import HERE, PASSWORD, People
from thermaxis.runtime import Role, ScreenSettings, Secret, SystemClock
from thermaxis.screen.access import ScreenParts
from thermaxis.screen.feed import StatusSnapshot, parse_status

NO_DATA = "feed-no_connection"


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


def told(look: int, *, live: bool = True, why: str = "", **changes: object) -> StatusSnapshot:
    """Return a look at the loop."""
    found, now_s = status(**changes), SystemClock().monotonic_s()
    utc = datetime(2026, 11, 20, 10, tzinfo=UTC)
    return StatusSnapshot(look, json.dumps(found), MappingProxyType(found), now_s, utc, live, why)


class Feed:
    """A feed that tells what it is given."""

    def __init__(self, latest: StatusSnapshot | None = None) -> None:
        self.latest = latest or told(1)
        self._news = asyncio.Event()

    def tell(self, look: StatusSnapshot) -> None:
        """Tell something new."""
        self.latest = look
        self._news.set()

    async def after(self, number: int) -> StatusSnapshot:
        """Wait for something newer; it is told from another thread, so it is looked for anew."""
        while self.latest.number <= number:
            self._news.clear()
            try:
                async with asyncio.timeout(0.02):
                    await self._news.wait()
            except TimeoutError:
                continue
        return self.latest


class KnownFeed:
    """Says the status that it was given, and what it was given of the minutes before."""

    def __init__(self, status: Mapping[str, Any] | None) -> None:
        self.status = status
        self.raw: dict[str, tuple[tuple[float, float], ...]] = {}
        self.number = 1
        self.live = status is not None

    @property
    def latest(self) -> StatusSnapshot:
        if self.status is None:
            return StatusSnapshot(1, "", {}, 0.0, None, live=False, why=NO_DATA)
        text = json.dumps(self.status)
        parsed = parse_status(text)
        why = "" if self.live else NO_DATA
        utc = datetime.fromisoformat(parsed["utc"])
        return StatusSnapshot(self.number, text, parsed, 1000.0, utc, live=self.live, why=why)

    def recent(self, name: str) -> tuple[tuple[float, float], ...]:
        return self.raw.get(name, ())

    def fill(self, names: tuple[str, ...], level_c: float, deviation_k: float, count: int) -> None:
        drawn = np.random.default_rng(7)
        for name in names:
            self.raw[name] = tuple(
                (
                    1000.0 - count + 1 + k,
                    level_c + 0.002 * k + float(drawn.normal(0.0, deviation_k)),
                )
                for k in range(count)
            )


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
        "evaluation_s": 100.0,
    }
    return ScreenSettings(**{**usual, **changes})


def parts(
    configuration: Any = None,
    feed: Any = None,
    role: Role | None = None,
    *,
    people: Any = None,
    clock: Any = None,
    secure: bool = False,
    users: bool = True,
    **settings: Any,
) -> ScreenParts:
    """Return what the pages share; whoever has a role sits before the browser without a cookie."""
    if configuration is None:
        server = SimpleNamespace(users=Path("users.toml") if users else None)
        configuration = SimpleNamespace(name="lathe <3>", server=server)
    clock = clock or SystemClock()
    return ScreenParts(
        configuration=configuration,
        settings=settings_with(**{"view_without_login": True, **settings}),
        clock=clock,
        feed=feed or cast("Any", Feed()),
        persons=people or cast("Any", People(clock).come(role)),
        program="run-1",
        secure=secure,
    )


def application(given: ScreenParts, routes: list[BaseRoute]) -> Starlette:
    """Return an application around some routes."""
    found = Starlette(routes=routes)
    found.state.parts = given
    return found


def client(
    given: ScreenParts, *routes: Callable[[ScreenParts], list[BaseRoute]], name: str = ""
) -> TestClient:
    """Return a browser without scripts, logged in under a name if one is given."""
    app = application(given, [one for make in routes for one in make(given)])
    scheme = "https" if given.secure else "http"
    browser = TestClient(app, base_url=f"{scheme}://127.0.0.1:8450", follow_redirects=False)
    if name:
        people = cast("People", given.persons)
        asyncio.run(people.log_in(name, PASSWORD, HERE))
        browser.cookies.set(f"{'__Host-' if given.secure else ''}thermaxis_8450", f"cookie-{name}")
    return browser
