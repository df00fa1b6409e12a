"""The one stand of the pages: a feed and log-ins that a test moves by hand, and a browser."""

import asyncio
import functools
import json
import shutil
from collections.abc import Callable, Mapping
from datetime import datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
from httpx2 import Response
from starlette.applications import Starlette
from starlette.routing import BaseRoute
from starlette.testclient import TestClient

from tests.unit.screen.people import HERE, PASSWORD, TOKEN, People
from thermaxis.runtime import (
    MachineConfiguration,
    Role,
    ScreenSettings,
    Secret,
    SystemClock,
    read_machine,
)
from thermaxis.screen.access import Outcome, ScreenParts
from thermaxis.screen.feed import StatusSnapshot
from thermaxis.screen.pages import operator_page

LATHE = Path(__file__).parents[3] / "examples" / "machine" / "lathe.toml"
NO_DATA = "feed-no_connection"
SMALL: Mapping[str, Any] = {
    "utc": "2026-11-20T10:00:00.000+00:00",
    "number": 7,
    "cycle_s": 1.0,
    "state": "Off",
    "reasons": ["disabled"],
    "inputs": {},
    "alarms": [],
}
"""A status as small as one can be."""


@functools.cache
def lathe() -> MachineConfiguration:
    """Return the configuration of the example."""
    return read_machine(LATHE)


def copied_lathe(folder: Path) -> MachineConfiguration:
    """Return the example's configuration in a folder that may be changed."""
    shutil.copy(LATHE, folder / LATHE.name)
    shutil.copytree(LATHE.parent / "models", folder / "models")
    return read_machine(folder / LATHE.name)


class Feed:
    """A feed that says the status that it was given, and raw values of the minutes before."""

    def __init__(self, status: Mapping[str, Any] | None = SMALL, *, why: str = "") -> None:
        self.status = status
        self.why = why or ("" if status is not None else NO_DATA)
        """Why there are no data; empty while there are."""
        self.raw: dict[str, tuple[tuple[float, float], ...]] = {}
        self.number = 1
        self.seen_s = SystemClock().monotonic_s()
        self._news = asyncio.Event()

    @property
    def latest(self) -> StatusSnapshot:
        """The present look."""
        if self.status is None:
            return StatusSnapshot(self.number, "", {}, 0.0, None, live=False, why=self.why)
        text = json.dumps(self.status)
        utc = datetime.fromisoformat(self.status["utc"])
        live = not self.why
        return StatusSnapshot(
            self.number, text, json.loads(text), self.seen_s, utc, live=live, why=self.why
        )

    def tell(self, *, why: str = "", **changes: object) -> None:
        """Say something new."""
        self.status, self.why = {**(self.status or SMALL), **changes}, why
        self.seen_s = SystemClock().monotonic_s()
        self.number += 1
        self._news.set()

    async def after(self, number: int) -> StatusSnapshot:
        """Wait for something newer; it is told from another thread, so it is looked for anew."""
        while self.number <= number:
            self._news.clear()
            try:
                async with asyncio.timeout(0.02):
                    await self._news.wait()
            except TimeoutError:
                continue
        return self.latest

    def recent(self, name: str) -> tuple[tuple[float, float], ...]:
        """Return the raw values of the last minutes."""
        return self.raw.get(name, ())

    def fill(self, names: tuple[str, ...], level_c: float, deviation_k: float, count: int) -> None:
        """Make up raw values, one each second."""
        drawn = np.random.default_rng(7)
        for name in names:
            self.raw[name] = tuple(
                (
                    self.seen_s - count + 1 + k,
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
        configuration = SimpleNamespace(
            name="lathe <3>", server=server, shown_names=lambda *_: {"T1_C": "Bearing <front>"}
        )
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


class Somebody:
    """Whoever is before the operator's page, with the feed behind it and what the loop answers."""

    def __init__(
        self,
        role: Role | None = Role.OPERATOR,
        *,
        why: str = "",
        answer: Outcome | None = None,
        configuration: MachineConfiguration | None = None,
    ) -> None:
        self.people = People().come(role)
        if answer is not None:
            self.people.answer = answer
        self.given = parts(configuration or lathe(), Feed(why=why), people=self.people)
        self._browser = client(self.given, operator_page.routes)

    @property
    def asked(self) -> list[tuple[str, tuple[float | str, ...]]]:
        """What reached the loop, all of it from whoever asks."""
        assert all(person is self.people.in_front for person, _, _ in self.people.asked)
        return [(method, arguments) for _, method, arguments in self.people.asked]

    def send(
        self, method: str, path: str, *, token: str = TOKEN, language: str = "en", **options: Any
    ) -> Response:
        """Return the answer of the operator's routes to a request."""
        headers = {"X-Thermaxis-Token": token, "Accept-Language": language}
        return self._browser.request(method, path, headers=headers, **options)

    def ask(self, question: object, **options: Any) -> Response:
        """Return the answer to a question."""
        return self.send("POST", "/ask", json=question, **options)
