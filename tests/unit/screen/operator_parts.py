"""The operator's routes with people and a feed that tests decide about."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import httpx2 as httpx
from starlette.applications import Starlette

from thermaxis.runtime._config import read_machine
from thermaxis.runtime._config_settings import MachineConfiguration
from thermaxis.runtime._ports import SystemClock
from thermaxis.runtime._users import Role
from thermaxis.screen import _operator_page
from thermaxis.screen._parts import ScreenParts
from thermaxis.screen._persons import Outcome, Persons
from thermaxis.screen._status_feed import StatusFeed, Told
from thermaxis.screen._words import Words

EXAMPLE = Path(__file__).parents[3] / "examples" / "machine" / "lathe.toml"
TOKEN = "the token of the page"  # noqa: S105 - of a page that nobody else reaches


@dataclass
class Somebody:
    """Whoever asks, and everything around: feed, log-ins and the loop's answer."""

    role: Role | None = Role.OPERATOR
    """Role of the log-in; None without one."""
    why: str = ""
    """Why there are no data; empty while there are."""
    answer: Outcome = field(
        default_factory=lambda: Outcome(accepted=True, reason="the hold is ended")
    )
    """What the loop answers."""
    asked: list[tuple[str, tuple[float | str, ...]]] = field(default_factory=list)
    """What reached the loop."""
    name: str = "novak"
    token: str = TOKEN
    lost: str = ""

    @property
    def latest(self) -> Told:
        """Return the present look."""
        return Told(1, "{}", {}, 0.0, None, not self.why, self.why, "")

    def why_ended(self, cookie: str | None) -> str:
        """Return why a log-in has ended: none has."""
        del cookie
        return ""

    def of(self, cookie: str | None, *, touch: bool = False) -> "Somebody | None":
        """Return who looks."""
        del cookie, touch
        return self if self.role is not None else None

    async def ask(self, person: object, method: str, arguments: Sequence[float | str]) -> Outcome:
        """Note what is asked and answer it."""
        assert person is self
        self.asked.append((method, tuple(arguments)))
        return self.answer


def configuration() -> MachineConfiguration:
    """Return the configuration of the example."""
    return read_machine(EXAMPLE)


async def sent(
    somebody: Somebody, method: str, path: str, *, token: str = TOKEN, **options: Any
) -> httpx.Response:
    """Return the answer of the operator's routes to a request."""
    found = configuration()
    assert found.screen is not None
    parts = ScreenParts(
        configuration=found,
        settings=found.screen,
        clock=SystemClock(),
        feed=cast("StatusFeed", somebody),
        persons=cast("Persons", somebody),
        words=Words.read(),
        program="this run",
    )
    application = Starlette(routes=_operator_page.routes(parts))
    application.state.parts = parts
    headers = {"X-Thermaxis-Token": token, "Accept-Language": "en", **options.pop("headers", {})}
    async with httpx.AsyncClient(
        transport=httpx.ASGITransport(application), base_url="http://screen"
    ) as client:
        return await client.request(method, path, headers=headers, **options)
