"""The operator's routes with people and a feed that tests decide about."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import httpx2 as httpx
from starlette.applications import Starlette

from tests.unit.screen.people import TOKEN, People
from thermaxis.runtime import MachineConfiguration, Role, SystemClock, read_machine
from thermaxis.screen.access import Outcome, ScreenParts
from thermaxis.screen.feed import StatusFeed, Told
from thermaxis.screen.pages import operator_page as _operator_page

if TYPE_CHECKING:
    from thermaxis.screen.access import Persons

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
    def latest(self) -> Told:
        """Return the present look."""
        return Told(1, "{}", {}, 0.0, None, not self.why, self.why)


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
        persons=cast("Persons", somebody.people),
        program="this run",
    )
    application = Starlette(routes=_operator_page.routes(parts))
    application.state.parts = parts
    headers = {"X-Thermaxis-Token": token, "Accept-Language": "en", **options.pop("headers", {})}
    async with httpx.AsyncClient(
        transport=httpx.ASGITransport(application), base_url="http://screen"
    ) as client:
        return await client.request(method, path, headers=headers, **options)
