"""Who was logged in when the loop or the screen went: stays so, or is told why not."""

import json
import signal
import time
from collections.abc import Callable, Generator

import pytest
from playwright.sync_api import Page
from websockets import Origin
from websockets.sync.client import connect

from tests.system.screen.conftest import Looked
from tests.system.screen.stand import PATIENCE_S, Rig, wait_until
from thermaxis.runtime import read_users, write_users

Look = Callable[..., Looked]
PAGES = ("/", "/model", "/sensors", "/history", "/probe", "/positioning")


@pytest.fixture(scope="module")
def closed(tmp_path_factory: pytest.TempPathFactory) -> Generator[Rig]:
    """Yield a stand where nobody looks without a log-in, and whose parts are ended."""
    with Rig(tmp_path_factory.mktemp("somebodys_folder")) as found:
        yield found


def log_in(seen: Looked, stand: Rig, role: str) -> None:
    page = seen.page
    page.fill("input[name=name]", role)
    page.fill("input[name=password]", stand.passwords[role])
    page.click("button.main")
    page.wait_for_selector(f"body[data-role={role}]")


def asked(page: Page, method: str) -> dict[str, str]:
    """Return how the loop answers what a page asks."""
    found: dict[str, str] = page.evaluate(
        """(method) => fetch("/ask", {method: "POST", headers: {"Content-Type": "application/json",
           "X-Thermaxis-Token": document.body.dataset.token},
           body: JSON.stringify({method, arguments: []})}).then((a) => a.json())""",
        method,
    )
    return found


def role_of(seen: Looked) -> str | None:
    return seen.page.locator("body").get_attribute("data-role")


def test_whoever_is_logged_in_stays_so_when_the_loop_begins_anew(look: Look, closed: Rig) -> None:
    seen = look(of=closed)
    page = seen.open("/sensors")
    page.wait_for_selector("body[data-live=yes]")
    log_in(seen, closed, "operator")
    page.wait_for_url("**/sensors")
    seen.wait_live()
    assert role_of(seen) == "operator"
    loads = seen.loads
    closed.kill("run")
    wait_until("NO DATA", lambda: page.locator("#no-data").is_visible())
    refused = asked(page, "Disable")
    assert (refused["answer"], refused["code"]) in (
        ("refused", "login-loop_gone"),
        ("unknown", "ask-lost"),
    )
    closed.start_loop()
    seen.wait_live()
    wait_until(
        "the session is opened anew", lambda: asked(page, "Enable").get("answer") == "accepted"
    )
    assert role_of(seen) == "operator"
    assert seen.loads == loads
    assert not page.locator("#notice").is_visible()


def test_whoever_was_struck_off_while_the_loop_was_away_is_logged_out(
    look: Look, closed: Rig
) -> None:
    seen = look(of=closed)
    page = seen.open("/sensors")
    log_in(seen, closed, "viewer")
    page.wait_for_url("**/sensors")
    seen.wait_live()
    closed.kill("run")
    users = closed.folder / "users.toml"
    before = users.read_bytes()
    write_users([one for one in read_users(users) if one.name != "viewer"], users)
    closed.start_loop()
    page.wait_for_selector("input[name=password]")
    page.wait_for_selector("#why")
    assert "was changed" in page.locator("#why").inner_text()
    users.write_bytes(before)


def test_after_a_restart_of_the_screen_the_log_in_says_why_and_leads_back(
    look: Look, closed: Rig
) -> None:
    seen = look(of=closed)
    page = seen.open("/history")
    log_in(seen, closed, "operator")
    page.wait_for_url("**/history*")
    seen.wait_live()
    closed.kill("screen", signal.SIGTERM)
    closed.start_screen()
    page.wait_for_selector("#why")
    assert "/login?next=/history" in page.url
    assert "started anew" in page.locator("#why").inner_text()
    page.wait_for_selector("body[data-live=yes]")
    assert page.locator("#gist b").inner_text(), "the state is out of sight at the log-in"
    closed.kill("run", signal.SIGTERM)
    page.wait_for_selector("body[data-live=no]")
    assert page.locator("#no-data").inner_text().startswith("NO DATA since")
    closed.start_loop()
    page.wait_for_selector("body[data-live=yes]")
    log_in(seen, closed, "operator")
    page.wait_for_url("**/history*")
    seen.wait_live()


def test_no_page_and_no_answer_tells_the_folders_of_the_computer(closed: Rig) -> None:
    engineer = closed.visitor()
    assert engineer.log_in("engineer").status == 200
    (closed.folder / "models" / "broken.json").write_text("{", "utf-8")
    said: dict[str, bytes] = {}
    for name in ("broken.json", "missing.json", "../machine.toml"):
        said[name] = json.dumps(engineer.request("ChooseModel", name)).encode()
        assert json.loads(said[name]).get("answer") != "accepted"
    span = "first=2026-01-01T00:00:00Z&last=2100-01-01T00:00:00Z"
    asked = [
        *PAGES,
        *("/login", "/nowhere", "/alive", "/trend8", "/model/values"),
        *("/sensors/values", "/history/series", "/probe/values", f"/history/events?{span}"),
        f"/history/trend?names=correction.Z_um&points=100&{span}",
    ]
    with connect(
        f"{closed.address.replace('http', 'ws', 1)}/live",
        origin=Origin(closed.address),
        additional_headers={"Cookie": engineer.cookie},
        proxy=None,
    ) as socket:
        said["live"] = b"".join(str(socket.recv(PATIENCE_S)).encode() for _ in range(3))
    assert b'"kind":"status"' in said["live"]
    history = closed.folder / "history.db"
    for there in (True, False):
        if not there:
            closed.kill("run")
            history.rename(history.with_suffix(".away"))
            time.sleep(1.0)
        for path in asked:
            for accept in ("text/html", "*/*"):
                said[f"{path} {accept} {there}"] = engineer.ask(
                    path, headers={"Accept": accept}
                ).body
    history.with_suffix(".away").rename(history)
    closed.start_loop()
    folders = {str(closed.folder), closed.folder.name}
    found = [name for name, body in said.items() if any(f.encode() in body for f in folders)]
    assert found == []
    assert any(b"history-unreadable" in body for body in said.values()), "nothing was looked for"
