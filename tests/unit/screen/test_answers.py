"""What is answered where there is nothing to show, and what the terminal is told of it."""

import asyncio
import contextlib
import json
import logging
from itertools import product
from typing import TYPE_CHECKING, cast

import pytest
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route, WebSocketRoute
from starlette.testclient import TestClient
from starlette.websockets import WebSocket
from uvicorn.server import ServerState

from tests.in_time import LONGEST_S
from tests.opcua_server import until
from tests.unit.runtime.status_server_parts import run
from tests.unit.screen.people import TOKEN, People
from tests.unit.screen.stand import parts
from tests.unit.screen.web_server import served
from thermaxis.messages import LANGUAGES, sentence
from thermaxis.runtime import Role
from thermaxis.screen._application import build_application
from thermaxis.web import Guard, _log_lines
from thermaxis.web._log_lines import LOGGERS, SAME_LINE_S, PlainLines, speak_plainly
from thermaxis.web._plain_page import plain_page

if TYPE_CHECKING:
    from starlette.applications import Starlette

HERE = "http://127.0.0.1:8450"
PAGE = {"Accept": "text/html,application/xhtml+xml,*/*;q=0.8"}
SCRIPT = {"Accept": "*/*"}


def with_mistakes(*, hosts: tuple[str, ...] = ("127.0.0.1:8450",)) -> Guard:
    """Return the application, with two routes more that fail as only a mistake does."""
    guard = cast("Guard", build_application(parts(), hosts))

    async def broken(_: Request) -> Response:
        raise KeyError("<b>secret</b> /home/somebody")

    async def broken_socket(_: WebSocket) -> None:
        raise ZeroDivisionError("a socket")

    application = cast("Starlette", guard._app)
    application.router.routes.append(Route("/broken", broken, methods=["GET", "POST"]))
    application.router.routes.append(WebSocketRoute("/broken-live", broken_socket))
    return guard


def browser(base_url: str = HERE) -> TestClient:
    return TestClient(with_mistakes(), base_url=base_url, raise_server_exceptions=False)


# ---- nothing to show ----------------------------------------------------------------------------


def test_an_unknown_page_is_a_page_with_the_way_to_every_other_and_json_for_a_script() -> None:
    for language in LANGUAGES:
        answer = browser().get("/nowhere", headers={**PAGE, "Accept-Language": language})
        text = sentence("common-no_page", language=language)
        assert answer.status_code == 404
        assert text in answer.text
        assert f'<html lang="{language}' in answer.text
        for page in ("/model", "/sensors", "/history", "/probe", "/positioning"):
            assert f'href="{page}"' in answer.text
        answer = browser().get("/nowhere", headers={**SCRIPT, "Accept-Language": language})
        assert answer.status_code == 404
        assert answer.json() == {"error": "common-no_page", "text": text}


def test_a_method_that_a_route_does_not_take_is_refused_in_words() -> None:
    assert browser().get("/ask", headers=PAGE).text.startswith("<!doctype html>")
    answer = browser().get("/ask", headers=SCRIPT)
    assert (answer.status_code, answer.json()["error"]) == (405, "common-refused_method")
    assert "POST" in answer.headers["allow"]


REFUSED = (
    ("http://evil.example", "/", 421, "login-host"),
    (HERE, "/static/%2e%2e/x", 404, "common-no_page"),
    (HERE, "/?" + "x" * 5000, 414, "common-refused_long"),
)


def test_a_refusal_before_any_page_speaks_the_language_of_the_browser() -> None:
    for language, (address, path, status, key) in product(LANGUAGES, REFUSED):
        page = browser(address).get(path, headers={**PAGE, "Accept-Language": language})
        assert page.status_code == status
        assert page.headers["content-type"] == "text/html; charset=utf-8"
        assert f'<html lang="{language}">' in page.text
        assert sentence(key, language=language) in page.text
        assert 'href="/"' in page.text or status == 421
        said = browser(address).get(path, headers={**SCRIPT, "Accept-Language": language})
        assert said.status_code == status
        assert said.json()["text"] == sentence(key, language=language)


def test_a_chosen_language_counts_more_than_that_of_the_browser() -> None:
    visitor = browser()
    visitor.cookies.set("thermaxis_language", "cs")
    answer = visitor.get("/?" + "x" * 5000, headers={**PAGE, "Accept-Language": "de"})
    assert sentence("common-refused_long", language="cs") in answer.text


def test_what_a_plain_page_says_is_text() -> None:
    page = plain_page("en", "<b>", "a < b & c", back='"').decode()
    assert "<h1>&lt;b&gt;</h1>" in page
    assert "a &lt; b &amp; c" in page
    assert "&quot;</a>" in page


# ---- mistakes in the program --------------------------------------------------------------------


def mistake() -> KeyError:
    with pytest.raises(KeyError) as caught:
        {}["x"]
    return caught.value


def test_a_mistake_in_the_program_is_answered_in_words_with_a_reference() -> None:
    for headers in (PAGE, SCRIPT):
        answer = browser().get("/broken", headers={**headers, "Accept-Language": "de"})
        assert answer.status_code == 500
        again = browser().get("/broken", headers={**headers, "Accept-Language": "de"})
        assert answer.text == again.text, "the same mistake has another reference"
        assert "Kennung" in answer.text
        for secret in ("secret", "somebody", "Traceback", "KeyError", "test_answers"):
            assert secret not in answer.text
        assert answer.headers["content-security-policy"]


# ---- what the terminal is told ------------------------------------------------------------------


def record(text: str, error: BaseException | None = None) -> logging.LogRecord:
    found = None if error is None else (type(error), error, error.__traceback__)
    return logging.LogRecord("uvicorn.error", logging.WARNING, __file__, 1, text, (), found)


def test_what_a_stranger_sent_cannot_steer_the_terminal() -> None:
    told = record("odd \x1b[2J\r\nline")
    assert PlainLines().filter(told)
    assert told.getMessage() == r"odd \x1b[2J\r\nline"


def test_work_that_the_end_of_the_program_gave_up_is_no_mistake() -> None:
    told = record("Exception in ASGI application")
    told.exc_info = (asyncio.CancelledError, asyncio.CancelledError(), None)
    assert not PlainLines().filter(told)


def test_the_same_line_is_told_once_a_minute_and_another_one_at_once() -> None:
    now_s = 1000.0
    lines = PlainLines(lambda: now_s)
    told = [lines.filter(record("Invalid HTTP request received.")) for _ in range(100)]
    assert told == [True] + [False] * 99
    assert lines.filter(record("another"))
    now_s += SAME_LINE_S - 0.1
    assert not lines.filter(record("Invalid HTTP request received."))
    now_s += 0.2
    assert lines.filter(record("Invalid HTTP request received."))


def test_lines_are_remembered_within_a_bound() -> None:
    lines = PlainLines(lambda: 1000.0)
    assert all(lines.filter(record(f"line {i}")) for i in range(1000))
    assert len(lines._told) == _log_lines._MOST_LINES


# ---- before the web server that is used ---------------------------------------------------------


@contextlib.contextmanager
def plain_terminal():
    """Put the web server's lines into words as the command does, and end that afterwards."""
    speak_plainly()
    speak_plainly()
    try:
        for name in LOGGERS:
            filters = logging.getLogger(name).filters
            assert sum(isinstance(one, PlainLines) for one in filters) == 1
        yield
    finally:
        for name in LOGGERS:
            logger = logging.getLogger(name)
            for one in [one for one in logger.filters if isinstance(one, PlainLines)]:
                logger.removeFilter(one)


def with_mistakes_at(port: int) -> Guard:
    """Return the application for a port, with an engineer who has logged in."""
    guard = with_mistakes(hosts=(f"127.0.0.1:{port}",))
    people = cast("People", cast("Starlette", guard._app).state.parts.persons)
    people.standing["cookie-engineer"] = people.person(Role.ENGINEER, "engineer")
    return guard


async def send(port: int, head: str, body: bytes, *, cut_off: ServerState | None = None) -> bytes:
    """Send a request; return what came before it was closed, or close it once it has begun."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(head.replace("\n", "\r\n").encode() + b"\r\n" + body)
    await writer.drain()
    answer = b""
    if cut_off is None:
        with contextlib.suppress(ConnectionError):
            answer = await asyncio.wait_for(reader.read(), LONGEST_S)
    else:
        await until(lambda: bool(cut_off.tasks))
    writer.close()
    with contextlib.suppress(ConnectionError):
        await writer.wait_closed()
    return answer


def head_of(port: int, path: str, *, length: int, cookie: bool) -> str:
    here = f"127.0.0.1:{port}"
    who = f"Cookie: thermaxis_{port}=cookie-engineer\nX-Thermaxis-Token: {TOKEN}\n"
    return (
        f"POST {path} HTTP/1.1\nHost: {here}\nOrigin: http://{here}\nConnection: close\n"
        f"Content-Type: application/json\nContent-Length: {length}\n{who if cookie else ''}"
    )


def test_a_body_that_is_cut_off_is_answered_nothing_and_told_to_nobody(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async def scene() -> None:
        async with served(with_mistakes_at) as (port, state):
            for path, cookie in (
                ("/login", False),
                ("/ask", True),
                ("/language", False),
                ("/positioning/upload?name=run.csv", True),
            ):
                head = head_of(port, path, length=500, cookie=cookie)
                assert await send(port, head, b'{"na', cut_off=state) == b""
                await until(lambda: not state.connections and not state.tasks)
            whole = await send(port, f"GET /alive HTTP/1.0\nHost: 127.0.0.1:{port}\n", b"")
            assert b" 200 " in whole

    with plain_terminal():
        run(scene)
    assert [one for one in caplog.records if one.levelno >= logging.WARNING] == []


def test_strangers_that_speak_no_http_fill_no_terminal(caplog: pytest.LogCaptureFixture) -> None:
    async def scene() -> None:
        async with served(with_mistakes_at) as (port, _):
            for _ in range(10):
                await send(port, "\x16\x03\x01 no HTTP\n", b"\xff" * 40)

    with plain_terminal():
        run(scene)
    told = [one.getMessage() for one in caplog.records if one.levelno >= logging.WARNING]
    assert told == ["Invalid HTTP request received."]


def test_a_mistake_behind_the_web_server_is_one_line_and_its_page_names_it(
    caplog: pytest.LogCaptureFixture,
) -> None:
    answers: list[bytes] = []

    async def scene() -> None:
        async with served(with_mistakes_at) as (port, _):
            head = f"GET /broken HTTP/1.0\nHost: 127.0.0.1:{port}\nAccept: application/json\n"
            answers.extend([await send(port, head, b"") for _ in range(3)])

    with plain_terminal():
        run(scene)
    told = [one for one in caplog.records if one.levelno >= logging.WARNING]
    line = logging.Formatter().format(told[0])
    assert len(told) == 1
    assert "\n" not in line
    for answer in answers:
        text = json.loads(answer.partition(b"\r\n\r\n")[2])["text"]
        assert text.partition("reference ")[2].partition(";")[0] in line
