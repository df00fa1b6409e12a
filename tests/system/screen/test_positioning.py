"""A positioning run evaluated in a real browser: real server, guard, worker and report."""

import asyncio
import json
import re
import socket
import threading
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, Literal, Self

import pytest
import uvicorn
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, BrowserContext, Page, Route as Asked, expect
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from tests.system.screen.stand import wait_until
from tests.unit.screen.people import People
from tests.unit.screen.stand import application, parts
from thermaxis.app.axis import AxisRoom
from thermaxis.messages import LANGUAGES, sentence
from thermaxis.runtime import Role
from thermaxis.screen.pages import positioning_page as _positioning_page
from thermaxis.web import Assets, Guard

pytestmark = [
    pytest.mark.system,
]

EXAMPLES = Path(__file__).parents[3] / "examples"
SIZES = ((1024, 600), (1366, 768), (1920, 1080))
LONGEST_MS = 300_000


class Server:
    """The page behind the real guard, on a port of this computer, for one engineer."""

    def __init__(self) -> None:
        self.people = People().come(Role.ENGINEER, "Nováková")
        given = parts(people=self.people, evaluation_s=280.0)
        assets = Assets()

        async def live(connection: WebSocket) -> None:
            await connection.accept()
            status = {
                "state": "Active",
                "state_said": "",
                "reasons_said": [],
                "cycle_s": 1.0,
                "alarms": [],
                "utc": None,
            }
            try:
                while True:
                    message = {
                        "kind": "status",
                        "age_s": 0.1,
                        "sent_s": time.monotonic(),
                        "status": status,
                    }
                    await connection.send_text(json.dumps(message))
                    await asyncio.sleep(0.5)
            except WebSocketDisconnect:
                return

        pages = _positioning_page.routes(given)
        routes = [
            *pages,
            Route("/static/{name:path}", assets.answer),
            WebSocketRoute("/live", live),
        ]
        self.listener = socket.create_server(("127.0.0.1", 0))
        port = self.listener.getsockname()[1]
        self.address = f"http://127.0.0.1:{port}"
        guard = Guard(
            application(given, routes),
            [f"127.0.0.1:{port}"],
            secure=False,
            largest_bytes=AxisRoom.largest_bytes,
        )
        self.server = uvicorn.Server(
            uvicorn.Config(guard, log_level="error", timeout_graceful_shutdown=1, lifespan="off")
        )
        self.thread = threading.Thread(target=self._serve)

    def _serve(self) -> None:
        asyncio.run(self.server.serve(sockets=[self.listener]))

    def __enter__(self) -> Self:
        self.thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.server.should_exit = True
        self.thread.join(20)
        self.listener.close()


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    with Server() as made:
        yield made


class Visit:
    """A page that remembers every fault of its scripts and every host that it asks."""

    def __init__(self, context: BrowserContext, server: Server) -> None:
        self.faults: list[str] = []
        self.page: Page = context.new_page()
        self.page.on("pageerror", lambda error: self.faults.append(str(error)))
        self.page.on("console", self._console)
        self.page.on("request", self._request)
        self.server = server

    def _console(self, message: Any) -> None:
        expected = "status of 4" in message.text  # a refusal that the page shows in words
        if message.type in ("error", "warning") and not expected:
            self.faults.append(message.text)

    def _request(self, request: Any) -> None:
        if not request.url.startswith((self.server.address, "blob:", "data:")):
            self.faults.append(request.url)

    def open(self) -> Page:
        self.page.goto(f"{self.server.address}/positioning")
        return self.page

    def send(self, run: Path, limits: Path | None = None) -> None:
        self.page.set_input_files("input[name=file]", run)
        if limits is not None:
            self.page.set_input_files("input[name=limits]", limits)
        self.page.click("#run-submit")


@pytest.fixture
def visit(browser: Browser, server: Server) -> Iterator[Visit]:
    context = browser.new_context(
        viewport={"width": 1366, "height": 768}, locale="de-DE", timezone_id="Europe/Prague"
    )
    made = Visit(context, server)
    yield made
    context.close()
    assert made.faults == []


@pytest.fixture
def kept(visit: Visit) -> None:
    """Let a run be evaluated, unless one is kept already."""
    with visit.page.expect_response("**/positioning/results") as told:
        visit.open()
    if not told.value.json()["results"]:
        visit.send(EXAMPLES / "x_axis_100_cycles.csv", EXAMPLES / "limits.toml")
    expect(visit.page.locator("#run-name")).to_have_text(
        "x_axis_100_cycles.csv", timeout=LONGEST_MS
    )


def test_a_run_goes_in_and_figures_report_and_certificate_come_out(
    visit: Visit, tmp_path: Path
) -> None:
    page = visit.open()
    visit.send(EXAMPLES / "x_axis_100_cycles.csv", EXAMPLES / "limits.toml")
    expect(page.locator("#run-submit")).to_be_disabled()
    expect(page.locator("#run-name")).to_have_text("x_axis_100_cycles.csv", timeout=LONGEST_MS)
    row = page.locator("#run-shown table tbody tr").last
    expect(row).to_contain_text("A Genauigkeit, zweiseitig")
    expect(row).to_contain_text("21,77")  # as measured, as the evaluation has it
    expect(row).to_contain_text("17,89")  # with the drift eliminated
    expect(row).to_contain_text("✓ bestanden")
    expect(page.locator("#run-submit")).to_be_enabled()
    expect(page.locator("#run-kept button")).to_have_count(1)

    page.click("#run-report")
    frame = page.frame_locator("#run-frame")
    expect(frame.locator("h1").first).to_be_visible(timeout=LONGEST_MS)
    expect(frame.locator("svg, img").first).to_be_visible(timeout=LONGEST_MS)
    expect(page.locator("#run-shown")).to_be_hidden()

    with page.expect_download() as coming:
        page.click("#run-certificate")
    assert coming.value.suggested_filename == "x_axis_100_cycles-certificate.pdf"
    path = tmp_path / "certificate.pdf"
    coming.value.save_as(path)
    assert path.read_bytes().startswith(b"%PDF-")

    page.reload()  # what was evaluated is still there
    expect(page.locator("#run-name")).to_have_text("x_axis_100_cycles.csv")

    empty = tmp_path / "empty.csv"
    empty.touch()
    visit.send(empty)
    expect(page.locator("#wrong")).to_have_text("Die Datei ist leer.")
    expect(page.locator("#wrong")).to_be_in_viewport(ratio=1.0)
    expect(page.locator("#run-result")).to_be_hidden()  # no figures beside a refusal
    page.click("#run-kept button")
    expect(page.locator("#run-name")).to_have_text("x_axis_100_cycles.csv")


def test_a_file_that_is_no_run_is_refused_in_words_under_its_own_name(
    visit: Visit, tmp_path: Path
) -> None:
    path = tmp_path / "<img src=x onerror=alert(1)>.csv"
    path.write_bytes(b"no run\n")
    page = visit.open()
    visit.send(path)
    wrong = page.locator("#wrong")
    expect(wrong).to_be_visible(timeout=LONGEST_MS)
    expect(wrong).to_contain_text("Das geht nicht: <img src=x onerror")
    assert "/" not in re.sub(r"docs/\w+\.md", "", wrong.inner_text())
    assert page.locator("#wrong img").count() == 0


@pytest.mark.usefixtures("kept")
def test_figures_of_an_earlier_run_never_stand_for_the_one_that_was_sent(
    visit: Visit, tmp_path: Path
) -> None:
    path = tmp_path / "no_run.csv"
    path.write_bytes(b"no run\n")
    page = visit.open()
    expect(page.locator("#run-name")).to_have_text("x_axis_100_cycles.csv")
    sent: list[Asked] = []
    page.route("**/positioning/upload*", partial(list.append, sent), times=1)
    visit.send(path)
    expect(page.locator("#work")).to_be_visible()
    expect(page.locator("#run-result")).to_be_hidden()  # the answer is not even there
    wait_until("the upload", lambda: page.evaluate("true") and sent)
    sent[0].continue_()
    expect(page.locator("#wrong")).to_be_visible(timeout=LONGEST_MS)

    asked: list[Asked] = []
    page.route("**/positioning/result/*", partial(list.append, asked), times=1)
    page.reload()
    wait_until("the kept run", lambda: page.evaluate("true") and asked)
    visit.send(path)
    expect(page.locator("#wrong")).to_be_visible(timeout=LONGEST_MS)
    with page.expect_response("**/positioning/result/*"):
        asked[0].continue_()  # the kept run arrives after the refusal of the later one
    page.evaluate("() => new Promise((done) => setTimeout(done, 50))")
    expect(page.locator("#wrong")).to_be_visible()
    expect(page.locator("#run-result")).to_be_hidden()


def test_a_file_that_is_too_large_is_refused_before_it_is_sent(
    visit: Visit, tmp_path: Path
) -> None:
    path = tmp_path / "long.csv"
    path.write_bytes(b"x" * 20_000_001)
    page = visit.open()
    visit.send(path)
    expect(page.locator("#wrong")).to_contain_text("größer als 20 MB")


def test_a_refused_result_leaves_the_page_as_it_was(visit: Visit) -> None:
    page = visit.open()
    page.fill("input[name=reference_cycle]", "x")
    visit.send(EXAMPLES / "y_axis_50_cycles.rtl")
    named = sentence("positioning-reference_cycle", language="de")  # and not --reference-cycle
    expect(page.locator("#wrong")).to_contain_text(named, timeout=LONGEST_MS)


@pytest.mark.usefixtures("kept")
@pytest.mark.parametrize("language", LANGUAGES)
def test_every_size_shows_all_of_it_without_scrolling_sideways(
    browser: Browser, server: Server, language: str
) -> None:
    for width, height in SIZES:
        context = browser.new_context(
            viewport={"width": width, "height": height},
            locale=language,
            color_scheme="dark" if height == 768 else "light",
        )
        visit = Visit(context, server)
        page = visit.open()
        expect(page.locator("#run-name")).to_have_text("x_axis_100_cycles.csv")
        wide = page.evaluate(
            "() => document.documentElement.scrollWidth > innerWidth"
            " || document.querySelector('main').scrollWidth > document.querySelector('main')"
            ".clientWidth"
        )
        assert not wide, (language, width)
        tallest = page.evaluate(
            "() => Math.max(...[...document.querySelectorAll('#run-shown tr')]"
            ".map((one) => one.offsetHeight))"
        )
        assert tallest < 110, (language, width)  # no name of a figure is squeezed into a column
        cut = page.evaluate(
            "() => [...document.querySelectorAll('.room-scroll')]"
            ".filter((one) => one.scrollWidth > one.clientWidth).length"
        )
        assert cut == 0, (language, width)
        small = page.evaluate(
            "() => [...document.querySelectorAll('main button, main select, main a.button,"
            " main input:not([type=checkbox], .unseen), main label.room-check')]"
            ".filter((one) => one.offsetParent && one.getBoundingClientRect().height < 44)"
            ".map((one) => one.outerHTML)"
        )
        assert small == []
        assert visit.faults == []
        context.close()


@pytest.mark.usefixtures("kept")
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_shown_result_is_readable_for_everybody(
    browser: Browser, server: Server, scheme: Literal["light", "dark"]
) -> None:
    context = browser.new_context(color_scheme=scheme, locale="en-GB")
    visit = Visit(context, server)
    page = visit.open()
    expect(page.locator("#run-name")).to_have_text("x_axis_100_cycles.csv")
    found = Axe().run(page, options={"runOnly": ["wcag2a", "wcag2aa"]}).response
    assert [one["id"] for one in found["violations"]] == []
    context.close()


def test_what_lacks_is_said_before_anything_is_sent(visit: Visit) -> None:
    visit.page.route("**/positioning/results", lambda one: one.fulfill(json={"results": []}))
    page = visit.open()
    expect(page.locator(".room-file-name").first).to_have_text("keine Datei gewählt")
    page.click("#run-submit")
    expect(page.locator("#wrong")).to_have_text("Zuerst einen gemessenen Lauf wählen.")
    visit.page.set_input_files("input[name=file]", EXAMPLES / "y_axis_50_cycles.rtl")
    expect(page.locator(".room-file-name").first).to_have_text("y_axis_50_cycles.rtl")


def test_a_viewer_is_told_who_may(browser: Browser, server: Server) -> None:
    context = browser.new_context(locale="cs-CZ")
    engineer = server.people.in_front
    server.people.come(Role.VIEWER)
    try:
        visit = Visit(context, server)
        page = visit.open()
        expect(page.locator("main")).to_contain_text("jen přihlášeným technologům")
        assert page.locator("form").count() == 0
        assert visit.faults == []
    finally:
        server.people.in_front = engineer
        context.close()
