"""Who is let through to which page, and what every page has."""

import asyncio
import gzip
import json
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product
from typing import Any, cast

import pytest
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import BaseRoute, Route
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from tests.unit.screen.people import PASSWORD, TOKEN, People
from tests.unit.screen.stand import (
    SMALL,
    Feed,
    client,
    lathe,
    parts,
    settings_with,
)
from thermaxis.messages import LANGUAGES, sentence
from thermaxis.runtime import Role
from thermaxis.screen import _live_socket
from thermaxis.screen._application import build_application
from thermaxis.screen._live_socket import MOST_VIEWERS
from thermaxis.screen._server import allowed_hosts
from thermaxis.screen.access import ScreenParts, login_routes, needs
from thermaxis.screen.access._user_sessions import (
    FULL,
    NO_PANEL,
    REFUSED,
    TOO_MANY,
    TOO_MANY_FROM_HERE,
    Refusal,
)
from thermaxis.web import Assets, for_script, modules_of, static_address

LIVE = "ws://127.0.0.1:8450/live"
HOSTS = ("127.0.0.1:8450",)
ROLES = (Role.VIEWER, Role.OPERATOR, Role.ENGINEER)


SAMPLE = {"quality": "good", "value_c": 21.5}


def alarm(priority: str) -> dict[str, object]:
    return {"code": "late", "priority": priority, "since": "", "values": {"lateness_s": 1.5}}


def guarded(role: Role, **more: bool) -> Callable[[ScreenParts], list[BaseRoute]]:
    """Return a page's routes: one address, guarded."""

    @needs(role, **more)
    async def answer(request: Request) -> Response:
        return JSONResponse({"through": True})

    return lambda _: [Route("/guarded", answer, methods=["GET", "POST"])]


# ---- who may ------------------------------------------------------------------------------------


def test_a_role_lets_through_whoever_has_it_or_more() -> None:
    for view, wanted, who in product((True, False), ROLES, ("", *ROLES)):
        has = Role(who) if who else Role.VIEWER if view else Role.NONE
        browser = client(parts(view_without_login=view), guarded(wanted), name=who)
        expected = 200 if has.at_least(wanted) else 403 if who else 401
        assert browser.get("/guarded").status_code == expected, (view, wanted, who)
    for who, expected in (("", 401), ("viewer", 200)):  # what needs a name
        browser = client(parts(), guarded(Role.VIEWER, named=True), name=who)
        assert browser.get("/guarded").status_code == expected


PAGES = ("", "model", "sensors", "history", "probe", "positioning")
VALUES = (
    *("/model/values", "/sensors/values", "/history/series", "/history/trend"),
    *("/history/events", "/trend8", "/probe/values"),
)
OF_ENGINEERS = tuple(
    f"/positioning/{name}" for name in ("results", "result/a", "report/a", "certificate/a")
)


def whole(who: str = "", **settings: Any) -> TestClient:
    """Return a browser before all pages of the example's lathe."""
    given = parts(lathe(), **settings)
    routes = cast("Starlette", cast("Any", build_application(given, HOSTS))._app).routes
    return client(given, lambda _: routes, name=who)


def test_without_a_log_in_pages_lead_to_it_and_values_are_told_to_nobody() -> None:
    nobody = whole(view_without_login=False)
    for page in PAGES:
        answer = nobody.get(f"/{page}")
        assert (answer.status_code, answer.headers["location"]) == (303, f"/login?next=/{page}")
    for address in (*VALUES, *OF_ENGINEERS):
        answer = nobody.get(address)
        assert (answer.status_code, answer.json()["error"]) == (401, "login-needed"), address


@pytest.mark.parametrize("who", ["", *ROLES])
def test_every_page_is_there_for_whoever_may_look_in_each_language(who: str) -> None:
    browser = whole(who)
    for page, language in product(PAGES, LANGUAGES):
        answer = browser.get(f"/{page}", headers={"accept-language": language})
        assert answer.status_code == 200, page
        assert f'<html lang="{language}' in answer.text
        title = sentence(f"common-page_{page or 'operator'}", language=language)
        assert f"<title>{title} – " in answer.text
        assert re.search(r"\{\{|>[a-z]+-[a-z_]+<", answer.text) is None
    status = 401 if not who else 403 if Role(who) is not Role.ENGINEER else None
    for address in OF_ENGINEERS if status else ():
        assert browser.get(address).status_code == status, address


def test_pages_and_requests_are_signs_of_a_person_and_what_a_page_asks_by_itself_is_none() -> None:
    for page, expected in ((True, 1), (False, 0)):
        given = parts()
        client(given, guarded(Role.VIEWER, page=page), name="viewer").get("/guarded")
        assert len(cast("People", given.persons).touched) == expected


def test_a_request_after_the_end_of_a_log_in_is_told_why_it_ended() -> None:
    routes = guarded(Role.OPERATOR)
    given = parts()
    people = cast("People", given.persons)
    browser = client(given, routes, name="operator")
    people.end(people.standing["cookie-operator"], "login-loop_gone")
    answer = browser.get("/guarded")
    assert (answer.status_code, answer.json()["error"]) == (401, "login-loop_gone")


def test_a_page_and_what_it_is_told_call_an_input_as_people_do() -> None:
    given = parts()
    headline = {"code": "headline-input_lost", "values": {"name": "T1_C"}}
    cast("Feed", given.feed).tell(headline=headline)
    page = client(given, login_routes).get("/login").text
    assert "Bearing &lt;front&gt;" in page
    assert "Bearing <front>" not in page
    with client(given, _live_socket.routes).websocket_connect(LIVE) as socket:
        socket.receive_json()
        said = socket.receive_json()["status"]["headline_said"]["text"]
    assert said.startswith("Bearing <front> ")


def test_the_log_in_page_holds_names_and_configuration_only_for_whoever_may_look() -> None:
    for view in (True, False):
        given = replace(parts(view_without_login=view), configuration_sha256="ab" * 32)
        page = client(given, login_routes).get("/login").text
        assert [one in page for one in ("Bearing", "ab" * 32)] == [view, view]


def test_a_role_that_the_loop_changes_is_told_to_an_open_page() -> None:
    given = parts(view_without_login=False)
    browser = client(given, _live_socket.routes, name="engineer")
    with browser.websocket_connect(LIVE) as socket:
        socket.receive_json()
        socket.receive_json()
        cast("People", given.persons).standing["cookie-engineer"].role = Role.OPERATOR
        cast("Feed", given.feed).tell()
        said = socket.receive_json()
    assert said["kind"] == "ended"
    assert "operator" in said["text"]


# ---- why a log-in is needed ---------------------------------------------------------------------


def why_of(given: ScreenParts, cookie: str | None) -> str:
    browser = client(given, login_routes)
    if cookie is not None:
        browser.cookies.set("thermaxis_8450", cookie)
    found = re.search(r'id="why"[^>]*>([^<]*)<', browser.get("/login").text)
    return "" if found is None else found[1]


def test_the_log_in_page_tells_why_somebody_has_to_log_in() -> None:
    given = parts(view_without_login=False)
    people = cast("People", given.persons)
    assert why_of(given, None) == ""
    assert why_of(given, "of another run") == sentence("login-started_anew")
    people.end_cookie("cookie-x", "login-idle")
    assert why_of(given, "cookie-x") == sentence("login-idle")
    client(given, login_routes, name="operator")
    assert why_of(given, "cookie-operator") == ""


def test_whoever_may_not_look_is_told_the_state_and_how_many_alarms_and_nothing_else() -> None:
    given = parts(view_without_login=False)
    feed = cast("Feed", given.feed)
    alarms = [alarm("high"), alarm("low")]
    feed.tell(alarms=alarms, state="Holding", reasons=["input_bad"], inputs={"T1_C": SAMPLE})
    with client(given, _live_socket.routes).websocket_connect(LIVE) as socket:
        assert socket.receive_json()["role"] == "none"
        said = socket.receive_json()["status"]
        feed.tell(why="feed-no_connection")
        assert socket.receive_json()["text"] == sentence("feed-no_connection")
    assert said == {
        **{key: SMALL[key] for key in ("number", "utc", "cycle_s")},
        "state": "Holding",
        "state_said": sentence("state-Holding"),
        "alarms": [{"priority": "high", "text": sentence("common-alarms", {"count": 2})}],
    }


# ---- log-in -------------------------------------------------------------------------------------


def log_in(browser: TestClient, name: str, password: str) -> Response:
    return cast("Response", browser.post("/login", json={"name": name, "password": password}))


@pytest.mark.parametrize("secure", [True, False])
def test_a_log_in_sets_a_cookie_that_scripts_and_other_sites_do_not_get(*, secure: bool) -> None:
    browser = client(parts(view_without_login=False, secure=secure), login_routes)
    answer = log_in(browser, "operator", PASSWORD)
    assert answer.status_code == 200
    cookie = answer.headers["set-cookie"].lower()
    assert "httponly" in cookie
    assert "samesite=strict" in cookie
    assert "path=/" in cookie
    assert ("secure" in cookie) is secure
    assert cookie.startswith("__host-thermaxis_8450=" if secure else "thermaxis_8450=")


@pytest.mark.parametrize(
    ("refusal", "status"),
    [
        (None, 401),
        (Refusal(TOO_MANY, left_s=48), 429),
        (Refusal(TOO_MANY_FROM_HERE, left_s=48), 429),
        (Refusal(FULL), 503),
    ],
)
def test_a_refused_log_in_says_why_and_sets_no_cookie(refusal: Refusal | None, status: int) -> None:
    given = parts()
    cast("People", given.persons).refusal = refusal
    answer = log_in(client(given, login_routes), "operator", "wrong")
    assert answer.status_code == status
    assert "set-cookie" not in answer.headers
    assert ("48 s" in answer.json()["text"]) is (status == 429)
    assert answer.headers.get("retry-after") == ("48" if status == 429 else None)


@pytest.mark.parametrize(
    ("refusal", "key"),
    [
        (Refusal(REFUSED), "login-pin_refused"),
        (Refusal(TOO_MANY, left_s=48), "login-pin_too_many"),
        (Refusal(TOO_MANY_FROM_HERE, left_s=48), "login-pin_too_many"),
        (Refusal(NO_PANEL), "login-no_panel"),
    ],
)
def test_a_refused_pin_is_said_as_such_and_leaves_the_password(refusal: Refusal, key: str) -> None:
    given = parts()
    cast("People", given.persons).refusal = refusal
    answer = client(given, login_routes).post("/login", json={"name": "a", "pin": "000000"})
    assert answer.json()["error"] == key


def test_a_log_out_needs_the_token_and_ends_the_log_in() -> None:
    given = parts()
    browser = client(given, login_routes, name="operator")
    assert browser.post("/logout").status_code == 403
    assert cast("People", given.persons).standing
    assert browser.post("/logout", headers={"X-Thermaxis-Token": TOKEN}).status_code == 200
    assert not cast("People", given.persons).standing


def test_a_chosen_language_is_kept_and_an_unknown_one_refused() -> None:
    browser = client(parts(), login_routes)
    assert browser.post("/language", json={"language": "cs"}).status_code == 200
    assert 'lang="cs"' in browser.get("/login").text
    assert browser.post("/language", json={"language": "xx"}).status_code == 400


def test_the_name_of_a_machine_is_text_and_no_page_has_a_script_or_style_within_it() -> None:
    page = client(parts(), login_routes).get("/login").text
    assert "lathe &lt;3&gt;" in page
    assert "lathe <3>" not in page
    assert re.findall(r"<script(?![^>]*(?: src=|application/json))", page) == []
    assert re.findall(r"\son\w+=|<style|style=", page) == []


def test_words_inside_a_script_element_cannot_end_it() -> None:
    assert for_script({"a": "</script><!--&"}) == '{"a":"\\u003c/script\\u003e\\u003c!--\\u0026"}'


# ---- files --------------------------------------------------------------------------------------


def files(browser_headers: dict[str, str], name: str) -> Response:
    application = Starlette(routes=[Route("/static/{name:path}", Assets().answer)])
    browser = TestClient(application)
    return cast("Response", browser.get(f"/static/{name}", headers=browser_headers))


def test_no_request_packs_or_unpacks_what_was_read_at_the_start(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assets = Assets()
    assets.read()
    for name in ("compress", "decompress"):
        monkeypatch.delattr(gzip, name)
    for encoding in (b"gzip", b"identity"):
        scope = {
            "type": "http",
            "headers": [(b"accept-encoding", encoding)],
            "path_params": {"name": "base.css"},
        }
        answer = asyncio.run(assets.answer(Request(scope)))
        assert (b"--line-1" in answer.body) is (encoding == b"identity")


def test_a_file_is_sent_once_and_then_only_named_packed_or_plain() -> None:
    for name in ("base.css", "live.js", "icon.svg"):
        first = files({}, name)
        assert first.status_code == 200
        again = files({"If-None-Match": first.headers["etag"]}, name)
        assert (again.status_code, again.content) == (304, b"")
    plain = files({"Accept-Encoding": "identity"}, "base.css")
    packed = files({"Accept-Encoding": "gzip"}, "base.css")
    assert packed.headers["content-encoding"] == "gzip"
    assert plain.content == packed.content
    assert "content-encoding" not in plain.headers
    for name in ("../_access.py", "..%2F_access.py", "_access.py", "", "0123456789abcdef/live.js"):
        assert files({}, name).status_code == 404, name


def test_a_file_is_kept_for_ever_only_at_an_address_that_no_other_version_of_it_has() -> None:
    address = static_address("live.js").removeprefix("/static/")
    kept, asked = files({}, address), files({}, "live.js")
    assert kept.content == asked.content
    assert "immutable" in kept.headers["cache-control"]
    assert asked.headers["cache-control"] == "no-cache"


def test_a_page_names_each_script_that_it_will_load_and_gets_the_words_of_these_alone() -> None:
    page = whole().get("/sensors").text
    named = re.findall(rf'"{static_address("")}([^"]+\.js)"', page)
    assert set(named) == set(modules_of("theme.js", "model/sensors.js", "frame.js"))
    assert {"chart/draw.js", "asked.js", "words.js"} < set(named)
    told = re.search(r'id="words">(.*?)</script>', page)
    assert told is not None
    words = json.loads(told[1])
    assert {"sensors-redundant", "chart-nothing", "common-no_data"} < set(words)
    assert not [key for key in words if key.startswith(("positioning-", "operator-trim"))]


def test_pages_and_values_are_packed_for_browsers_that_take_it_and_files_are_not() -> None:
    async def much(request: Request) -> Response:
        del request
        return PlainTextResponse(10_000 * "x")

    given = parts()
    application = build_application(given, ["testserver"])
    starlette = cast("Starlette", cast("Any", application)._app)
    starlette.router.routes += [Route("/much", much), Route("/positioning/much", much)]
    browser = TestClient(application)
    for path, encoding, packed in (
        ("/much", "gzip", True),
        ("/much", "identity", False),
        ("/positioning/much", "gzip", False),
        ("/alive", "gzip", False),
    ):
        answer = browser.get(path, headers={"Accept-Encoding": encoding})
        assert ("content-encoding" in answer.headers) is packed, path
        assert packed or int(answer.headers["content-length"]) == len(answer.content)


# ---- the open page ------------------------------------------------------------------------------


def test_an_open_page_is_told_who_it_is_then_every_look_then_why_there_is_none() -> None:
    given = parts()
    feed = cast("Feed", given.feed)
    with client(given, _live_socket.routes).websocket_connect(LIVE) as socket:
        hello = socket.receive_json()
        assert hello == {
            "kind": "hello",
            "program": "run-1",
            "name": "",
            "role": "viewer",
        }
        first = socket.receive_json()
        assert (first["kind"], first["status"]["number"]) == ("status", 7)
        assert 0.0 <= first["age_s"] < 5.0
        received_s = first["sent_s"] - first["age_s"]  # by the server's own clock
        assert received_s == pytest.approx(feed.latest.received_s, abs=2e-3)
        feed.tell(number=8)
        assert socket.receive_json()["status"]["number"] == 8
        feed.tell(why="feed-stands_still")
        none = socket.receive_json()
    assert (none["kind"], none["since"]) == ("no_data", "2026-11-20T10:00:00.000+00:00")
    assert none["text"] == sentence("feed-stands_still")
    assert "status" not in none  # the page has it
    with client(given, _live_socket.routes).websocket_connect(LIVE) as late:
        late.receive_json()
        opened = late.receive_json()
    assert (opened["kind"], opened["status"]["number"]) == ("no_data", 8)
    assert opened["age_s"] >= 0.0


def test_an_open_page_is_told_when_its_log_in_ends() -> None:
    given = parts()
    people, feed = cast("People", given.persons), cast("Feed", given.feed)
    browser = client(given, _live_socket.routes, name="operator")
    with browser.websocket_connect(LIVE) as socket:
        assert socket.receive_json()["name"] == "operator"
        socket.receive_json()
        people.end(people.standing["cookie-operator"], "login-idle")
        feed.tell()
        ended = socket.receive_json()
        assert ended == {"kind": "ended", "text": sentence("login-idle")}
        with pytest.raises(WebSocketDisconnect):
            socket.receive_json()


def test_a_page_that_says_something_is_cut_off() -> None:
    with client(parts(), _live_socket.routes).websocket_connect(LIVE) as socket:
        socket.receive_json()
        socket.receive_json()
        socket.send_text("Enable")
        with pytest.raises(WebSocketDisconnect):
            socket.receive_json()


def test_no_more_pages_than_the_bound_are_connected_and_a_closed_one_makes_room(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(_live_socket, "MOST_VIEWERS", 3)
    monkeypatch.setattr(_live_socket, "KEPT_FOR_PERSONS", 1)
    browser = client(parts(), _live_socket.routes)
    with browser, browser.websocket_connect(LIVE) as one:
        one.receive_json()
        with browser.websocket_connect(LIVE) as two:
            two.receive_json()
            assert_too_many(browser)
        with browser.websocket_connect(LIVE) as three:
            assert three.receive_json()["kind"] == "hello"
    assert MOST_VIEWERS >= 20


def assert_too_many(browser: TestClient, language: str = "en") -> None:
    """Assert that a page is told why it is told nothing."""
    with browser.websocket_connect(LIVE, headers={"accept-language": language}) as refused:
        said = refused.receive_json()
        expected = sentence("common-too_many_pages", language=language)
        assert (said["kind"], said["text"], said["since"]) == ("no_data", expected, None)
        with pytest.raises(WebSocketDisconnect) as ended:
            refused.receive_json()
        assert ended.value.code == 1013


def test_places_are_kept_for_those_who_have_logged_in(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_live_socket, "MOST_VIEWERS", 2)
    monkeypatch.setattr(_live_socket, "KEPT_FOR_PERSONS", 1)
    browser = client(parts(), _live_socket.routes, name="operator")
    cookies = dict(browser.cookies)
    browser.cookies.clear()
    with browser, browser.websocket_connect(LIVE) as looking:
        looking.receive_json()
        assert_too_many(browser, "de")
        browser.cookies.update(cookies)
        with browser.websocket_connect(LIVE) as acting:
            assert acting.receive_json()["name"] == "operator"
            assert_too_many(browser)  # and these are bounded too


def test_no_address_and_no_person_has_all_pages(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_live_socket, "MOST_OF_ONE", 1)
    browser = client(parts(), _live_socket.routes, name="operator")
    with browser, browser.websocket_connect(LIVE) as acting:
        acting.receive_json()
        assert_too_many(browser)
        browser.cookies.clear()
        with browser.websocket_connect(LIVE) as looking:
            looking.receive_json()
            assert_too_many(browser)


# ---- hosts --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("address", "names", "port", "secure", "expected"),
    [
        ("127.0.0.1", (), 8450, False, {"127.0.0.1:8450", "localhost:8450", "[::1]:8450"}),
        ("0.0.0.0", ("pc-3",), 443, True, {"pc-3:443", "pc-3"}),  # noqa: S104 - not bound
        ("192.168.1.7", ("gate:9000",), 80, True, {"192.168.1.7:80", "gate:9000"}),
        ("fd00::7", (), 8450, True, {"[fd00::7]:8450"}),
    ],
)
def test_a_browser_may_call_the_screen_by_its_own_names_only(
    address: str, names: Sequence[str], port: int, expected: set[str], *, secure: bool
) -> None:
    settings = settings_with(address=address, hosts=tuple(names))
    assert set(allowed_hosts(settings, port, secure=secure)) == expected
