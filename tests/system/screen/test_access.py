"""Who may do what: log-ins, forged requests, foreign pages, sessions that end."""

import json
import time
from collections.abc import Callable, Generator
from typing import Final

import pytest
from websockets import Origin
from websockets.sync.client import connect

from tests.in_time import in_time
from tests.system.screen.conftest import Looked
from tests.system.screen.stand import Rig, Visitor, wait_until

Look = Callable[..., Looked]
MARK: Final = "getComputedStyle(document.querySelector('#gist b'), '::after').content"
"""What stands behind the state: a mark where it is old."""
ENABLE: Final = {"method": "Enable", "arguments": []}


@pytest.fixture(scope="module")
def open_stand(tmp_path_factory: pytest.TempPathFactory) -> Generator[Rig]:
    """Yield a stand of its own: its log-ins end after a minute."""
    more = "idle_s = 60.0\nlongest_login_s = 60.0\n"
    folder = tmp_path_factory.mktemp("open")
    with Rig(folder, view_without_login=True, anonymous=True, more=more) as found:
        yield found


def test_somebody_without_a_log_in_sees_nothing_but_the_log_in(stand: Rig) -> None:
    nobody = stand.visitor()
    for path in ("/", "/model", "/sensors", "/history", "/probe", "/positioning"):
        answer = nobody.ask(path)
        assert answer.status == 303, path
        assert answer.headers["location"].startswith("/login?next=/"), path
        assert b"virtual lathe" not in answer.body
        assert "server" not in answer.headers
    for path in ("/history/series", "/model/values", "/sensors/values", "/probe/values", "/trend8"):
        assert nobody.ask(path).status == 401, path
    assert nobody.ask("/ask", ENABLE).status == 401
    assert nobody.ask("/history/export?format=csv", method="POST").status == 401
    address = stand.address.replace("http", "ws", 1) + "/live"
    with connect(address, origin=Origin(stand.address), proxy=None) as socket:
        while (told := json.loads(socket.recv(10.0)))["kind"] != "status":
            pass
    head = {"number", "utc", "cycle_s", "state", "state_said", "alarms"}
    assert set(told["status"]) == head


def test_a_person_logs_in_by_the_page_and_out_again(look: Look, stand: Rig) -> None:
    seen = look()
    page = seen.open("/model")
    assert "/login?next=/model" in page.url
    page.fill("input[name=name]", "operator")
    page.fill("input[name=password]", "wrong " + stand.passwords["operator"])
    page.click("button.main")
    page.wait_for_selector("#wrong:not([hidden])")
    assert page.locator("#wrong").inner_text() == "Name or password is wrong."
    page.fill("input[name=password]", stand.passwords["operator"])
    page.click("button.main")
    page.wait_for_url("**/model")
    seen.wait_live()
    assert "operator" in page.locator(".who").inner_text()
    cookies = {one["name"]: one for one in seen.context.cookies()}
    secret = next(one for name, one in cookies.items() if "language" not in name)
    assert secret["httpOnly"]
    assert secret["sameSite"] == "Strict"
    assert page.evaluate("document.cookie") == ""
    page.click("#logout")
    page.wait_for_selector("input[name=password]")
    seen.context.add_cookies([secret])
    assert "/login" in seen.open("/").url, "the cookie of a log-in that has ended still works"


def test_state_reason_and_gravest_alarm_stay_in_sight_on_every_page_and_at_the_log_in(
    look: Look, open_stand: Rig
) -> None:
    seen = look(of=open_stand)
    gist = seen.page.locator("#gist")
    for path in ("/login", "/model", "/sensors", "/history", "/probe"):
        seen.open(path)
        seen.wait_live()
        wait_until("the state", lambda: "Off" in gist.inner_text(), 10.0)
        assert "?" not in seen.page.evaluate(MARK), path
    known = gist.inner_text()
    open_stand.kill("run")
    try:
        seen.page.wait_for_selector('body[data-live="no"]')
        seen.open("/login")  # opened only then
        seen.page.wait_for_selector('body[data-live="no"]')
        assert gist.inner_text() == known
        assert "?" in seen.page.evaluate(MARK)
        assert seen.page.locator("#no-data").inner_text().startswith("NO DATA since")
    finally:
        open_stand.start_loop()


@pytest.mark.parametrize("address", ["//evil.example/", ".//evil.example/"])
def test_a_log_in_never_leads_to_another_address(look: Look, stand: Rig, address: str) -> None:
    seen = look()
    page = seen.open(f"/login?next={address}")
    page.fill("input[name=name]", "viewer")
    page.fill("input[name=password]", stand.passwords["viewer"])
    page.click("button.main")
    page.wait_for_url(lambda url: "/login" not in url)
    assert page.url.startswith(f"{stand.address}/")
    seen.wait_live()
    assert seen.wrong == []
    page.click("#logout")
    page.wait_for_selector("input[name=password]")


def test_a_trim_that_the_loop_refuses_says_why(people: Callable[[str], Visitor]) -> None:
    said = people("operator").request("Trim", "Z_um", 1e3, 60.0)
    assert (said["answer"], said["code"]) == ("refused", "answer-trim_range")
    assert said["values"] == {"lowest_um": -10.0, "largest_um": 10.0}


# ---- with a stand of its own --------------------------------------------------------------------


def test_a_log_in_ends_by_time_and_the_page_says_so(look: Look, open_stand: Rig) -> None:
    visitor = open_stand.visitor()
    began_s = time.monotonic()
    assert visitor.log_in("operator").status == 200
    seen = look(of=open_stand)
    seen.context.add_cookies(
        [
            {"name": one.name, "value": one.value or "", "url": open_stand.address}
            for one in visitor.cookies
        ]
    )
    page = seen.open("/")
    seen.wait_live()
    assert page.locator("body").get_attribute("data-role") == "operator"
    wait_until(
        "the page knows that the log-in has ended",
        lambda: page.locator("body").get_attribute("data-name") == "",
        240.0,
    )
    took_s = time.monotonic() - began_s
    assert took_s >= 58.0
    assert in_time(took_s, 75.0)
    page.wait_for_selector("#notice:not([hidden])")
    assert "The log-in has" in page.locator("#notice").inner_text()
    assert visitor.ask("/ask", ENABLE).status == 401
    assert page.locator('[data-ask="Enable"]').is_disabled()


def test_who_only_looks_needs_no_log_in_where_that_is_configured(
    look: Look, open_stand: Rig
) -> None:
    seen = look(of=open_stand)
    page = seen.open("/")
    seen.wait_live()
    assert page.locator('[data-ask="Enable"]').is_disabled()
    nobody = open_stand.visitor()
    assert nobody.ask("/ask", ENABLE).status == 401
    assert nobody.ask("/history/export?format=csv", method="POST").status == 401
    assert seen.wrong == []
