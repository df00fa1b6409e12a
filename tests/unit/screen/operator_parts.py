"""The operator's routes with people and a feed that tests decide about."""

from pathlib import Path
from typing import Any

import httpx2 as httpx

from tests.unit.screen.people import TOKEN, People
from tests.unit.screen.stand import application, parts
from thermaxis.runtime import MachineConfiguration, Role, read_machine
from thermaxis.screen.access import Outcome
from thermaxis.screen.feed import StatusSnapshot
from thermaxis.screen.pages import operator_page as _operator_page

EXAMPLE = Path(__file__).parents[3] / "examples" / "machine" / "lathe.toml"


class Somebody:
    """Whoever asks, and everything around: feed, log-ins and the loop's answer."""

    def __init__(
        self, role: Role | None = Role.OPERATOR, *, why: str = "", answer: Outcome | None = None
    ) -> None:
        self.why = why
        """Why there are no data; empty while there are."""
        self.people = People().come(role)
        if answer is not None:
            self.people.answer = answer

    @property
    def asked(self) -> list[tuple[str, tuple[float | str, ...]]]:
        """What reached the loop, all of it from whoever asks."""
        assert all(person is self.people.in_front for person, _, _ in self.people.asked)
        return [(method, arguments) for _, method, arguments in self.people.asked]

    @property
    def latest(self) -> StatusSnapshot:
        """Return the present look."""
        return StatusSnapshot(1, "{}", {}, 0.0, None, not self.why, self.why)


def configuration() -> MachineConfiguration:
    """Return the configuration of the example."""
    return read_machine(EXAMPLE)


async def sent(
    somebody: Somebody, method: str, path: str, *, token: str = TOKEN, **options: Any
) -> httpx.Response:
    """Return the answer of the operator's routes to a request."""
    found = configuration()
    assert found.screen is not None
    given = parts(
        found, somebody, people=somebody.people, view_without_login=found.screen.view_without_login
    )
    app = application(given, _operator_page.routes(given))
    headers = {"X-Thermaxis-Token": token, "Accept-Language": "en", **options.pop("headers", {})}
    async with httpx.AsyncClient(
        transport=httpx.ASGITransport(app), base_url="http://screen"
    ) as client:
        return await client.request(method, path, headers=headers, **options)
