"""A stand, and visitors who have logged in."""

from collections.abc import Callable, Generator
from contextlib import suppress
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import (
    Browser,
    BrowserContext,
    ConsoleMessage,
    Error as PlaywrightError,
    Page,
    Request,
    TimeoutError as PlaywrightTimeout,
)

from tests.system.screen.operator_stand_in import StandIn, served
from tests.system.screen.stand import PATIENCE_S, Rig, Visitor, wait_until

WIDTH, HEIGHT = 1366, 768
EXPECTED_WITHOUT_SERVER = ("WebSocket connection to", "net::ERR_CONNECTION_REFUSED", "net::ERR_")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--screens", metavar="DIR", help="folder for pictures of every page")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Every test here is a system test."""
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.system)


@pytest.fixture(scope="session")
def pictured(request: pytest.FixtureRequest) -> Callable[[Page, str], None]:
    """Return what keeps a picture of a page by its name, where a folder was named for them."""
    folder = request.config.getoption("--screens", default=None)

    def keep(page: Page, name: str) -> None:
        if folder is not None:
            page.screenshot(path=Path(folder) / f"{name}.png")

    return keep


@pytest.fixture(scope="session")
def stand(tmp_path_factory: pytest.TempPathFactory) -> Generator[Rig]:
    """Yield a lathe, its loop and its screen, on which everybody must log in."""
    with Rig(tmp_path_factory.mktemp("stand")) as found:
        yield found


@pytest.fixture(scope="session")
def people(stand: Rig) -> Callable[[str], Visitor]:
    """Return visitors by role, logged in once, and again where their log-in is gone."""
    known: dict[str, Visitor] = {}

    def person(role: str) -> Visitor:
        found = known.get(role)
        if found is None or found.ask("/").status != 200:
            found = known[role] = stand.visitor()
            assert found.log_in(role).status == 200
        return found

    return person


@pytest.fixture
def stand_in() -> Generator[StandIn]:
    """Yield an operator's page over made-up statuses."""
    with served(StandIn()) as found:
        yield found


class Looked:
    """A page that is open, and everything that went wrong on it.

    Parameters
    ----------
    context : BrowserContext
        Of one visitor.
    address : str
        Address of the screen; no other one may be asked.
    """

    def __init__(self, context: BrowserContext, address: str) -> None:
        self.context, self.address = context, address
        self.page: Page = context.new_page()
        self.wrong: list[str] = []
        self.loads = 0
        self.page.on("console", self._console)
        self.page.on("pageerror", lambda error: self.wrong.append(f"error: {error}"))
        self.page.on("request", self._request)
        self.page.on("load", self._load)

    def _console(self, message: ConsoleMessage) -> None:
        if message.type in {"error", "warning"}:
            self.wrong.append(f"console {message.type}: {message.text}")

    def _load(self, _: Page) -> None:
        self.loads += 1

    def _request(self, request: Request) -> None:
        asked = urlsplit(request.url)
        if (
            asked.scheme not in {"data", "blob", "about"}
            and asked.netloc != urlsplit(self.address).netloc
        ):
            self.wrong.append(f"foreign address: {request.url}")

    def open(self, path: str) -> Page:
        """Open a page and return it; one that loads itself again just then is asked once more."""
        try:
            self.page.goto(f"{self.address}{path}")
        except PlaywrightError as error:
            if "ERR_ABORTED" not in str(error):
                raise
            self.page.goto(f"{self.address}{path}")
        return self.page

    def wait_live(self, limit_s: float = PATIENCE_S) -> None:
        """Wait for fresh values."""
        self.page.wait_for_selector('body[data-live="yes"]', timeout=1e3 * limit_s)

    def wait_idle(self) -> None:
        """Wait until nothing is asked for half a second; where everything takes long, ten."""
        with suppress(PlaywrightTimeout):
            self.page.wait_for_load_state("networkidle", timeout=10_000)

    def until(self, expression: str, limit_s: float = PATIENCE_S) -> None:
        """Wait until an expression is true on the page; the page itself may not evaluate any."""
        wait_until(expression, lambda: self.page.evaluate(expression), limit_s)

    def unexpected(self) -> list[str]:
        """Return what went wrong other than that a server was gone for a while."""
        return [one for one in self.wrong if not any(e in one for e in EXPECTED_WITHOUT_SERVER)]


@pytest.fixture
def look(
    browser: Browser, stand: Rig, people: Callable[[str], Visitor]
) -> Generator[Callable[..., Looked]]:
    """Return a function that opens a browser for a role, or for nobody; all are closed after."""
    opened: list[BrowserContext] = []

    def begin(role: str = "", *, of: Rig = stand, **options: object) -> Looked:
        settings: dict[str, object] = {
            "viewport": {"width": WIDTH, "height": HEIGHT},
            "locale": "en-GB",
            **options,
        }
        context = browser.new_context(**settings)
        opened.append(context)
        if role:
            context.add_cookies(
                [
                    {"name": one.name, "value": one.value or "", "url": of.address}
                    for one in people(role).cookies
                ]
            )
        return Looked(context, of.address)

    yield begin
    for context in opened:
        context.close()
