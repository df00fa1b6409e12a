"""`thermaxis demo`: one command from nothing to a living page, and every button of it."""

import json
import re
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Generator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.in_time import in_time
from tests.system.programs import Program
from tests.system.screen.stand import PATIENCE_S, START_S
from thermaxis.messages import sentence

STARTS_S = 20.0
"""From the start to a living page, as the docs say. [s]"""
SHOWN = {
    "sensor": sentence("headline-held_for_input", {"name": "Spindle"}),
    "network": sentence("headline-unreachable"),
    "server": sentence("headline-unreachable"),
    "stop": sentence("headline-interlock", {"names": "Emergency stop"}),
    "chip": "which does not fit what is known",
    "loop": sentence("common-no_data"),
}
FAST = sentence("operator-model_good", {"file": "lathe, time x 60"})
"""What the head of the page says where something is broken."""
BEGUN = re.compile(r"Cycle [5-9],")
"""A loop that was started anew, and was asked what its command line asks."""


@pytest.fixture
def demo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Generator[Program]:
    """Yield the program; what it keeps lies in a folder of the test."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    program = Program(["demo", "--no-browser"], tmp_path)
    try:
        yield program
    finally:
        program.signal(signal.SIGTERM)
        program.wait(PATIENCE_S)


def sent(address: str, given: object, origin: str) -> int:
    """Return the status of a press without a browser. [1]"""
    body, headers = json.dumps(given).encode(), {"Origin": origin}
    request = urllib.request.Request(f"{address}demo/break", body, headers)  # noqa: S310 - our own
    try:
        with urllib.request.urlopen(request, timeout=PATIENCE_S) as answer:  # noqa: S310 - our own
            return int(answer.status)
    except urllib.error.HTTPError as error:
        with error:
            return error.code


def works_after_a_log_in_elsewhere(page: Page, other: Page, address: str, said: str) -> None:
    """Log in on another page, and press a button of this one, which knows nothing of that."""
    other.goto(f"{address}login")
    name, password = re.findall(r"log in as (operator), password (\w+)", said)[0]
    other.fill("[name=name]", name)
    other.fill("[name=password]", password)
    other.click("#login button")
    expect(other.locator("body")).to_have_attribute("data-role", "operator")
    other.close()
    page.locator("[data-break=stop]").click()
    expect(page.locator("#gist")).to_contain_text(SHOWN["stop"])


def stays_disabled(page: Page, address: str) -> None:
    """Mend all, and see that a loop that is started anew after a disable stays off."""
    page.goto(address)
    page.click("[data-ask=Disable]")
    page.click("dialog .main")
    expect(page.locator("[data-ask=Enable]")).to_be_enabled()
    page.goto(f"{address}demo")
    for name in ("stop", "time"):
        page.locator(f"[data-break={name}]").click()
        expect(page.locator(f"[data-break={name}]")).to_have_attribute("aria-pressed", "false")
    page.goto(address)
    expect(page.locator("#beat-text")).to_contain_text(BEGUN)
    expect(page.locator("#model-told")).not_to_contain_text(FAST)
    expect(page.locator("[data-ask=Enable]")).to_be_enabled()


@pytest.mark.real_time
def test_the_demo_lives_soon_breaks_by_every_button_and_leaves_nothing(
    demo: Program, browser: Browser, tmp_path: Path
) -> None:
    address = demo.wait_for("demo: ", START_S).text.split()[-1]
    demo.wait_for("Ctrl+C", START_S)
    said = "\n".join(one.text for one in demo.said)
    context = browser.new_context(locale="en-GB")
    page = context.new_page()
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.goto(f"{address}demo")
    page.wait_for_selector('body[data-live="yes"]')
    assert in_time(time.monotonic() - demo.began_s, STARTS_S)
    gist = page.locator("#gist")
    expect(gist).to_contain_text("Compensating")
    buttons = page.locator("[data-break]")
    assert {one.get_attribute("data-break") for one in buttons.all()} == {*SHOWN, "time"}
    for name, words in SHOWN.items():
        button = page.locator(f"[data-break={name}]")
        button.click()
        expect(button).to_have_attribute("aria-pressed", "true")
        expect(page.locator("#no-data:visible") if name == "loop" else gist).to_contain_text(words)
        button.click()
        expect(button).to_have_attribute("aria-pressed", "false")
        expect(page.locator("body")).to_have_attribute("data-live", "yes")
        expect(gist).to_contain_text("Compensating")

    operator = context.new_page()
    operator.goto(address)
    page.locator("[data-break=time]").click()
    expect(operator.locator("#model-told")).to_contain_text(FAST)
    expect(gist).to_contain_text("Compensating")
    operator.close()
    own = address.rstrip("/")
    press = {"name": "stop", "broken": False}
    for given, origin, status in (
        (press, own, 200),
        (press, "http://example.com", 403),
        ({"name": "__class__", "broken": True}, own, 400),
        ({"name": "stop", "broken": 1}, own, 400),
    ):
        assert sent(address, given, origin) == status
    works_after_a_log_in_elsewhere(page, context.new_page(), address, said)
    stays_disabled(page, address)
    assert wrong == []
    context.close()

    (folder,) = tmp_path.glob("thermaxis-work-*")
    assert folder.stat().st_mode & 0o777 == 0o700
    demo.signal(signal.SIGINT)
    assert demo.wait(PATIENCE_S) == 0
    assert not folder.exists()


def test_what_a_killed_demo_leaves_goes_with_the_next_one(demo: Program, tmp_path: Path) -> None:
    demo.wait_for("a shift", START_S)
    (left,) = tmp_path.glob("thermaxis-*")
    demo.signal(signal.SIGKILL)
    demo.wait(PATIENCE_S)
    assert left.exists()
    another = Program(["demo", "--no-browser"], tmp_path)
    another.wait_for("a shift", START_S)
    assert not left.exists()
    another.signal(signal.SIGKILL)
    another.wait(PATIENCE_S)


def test_what_the_demo_starts_ends_with_the_demo() -> None:
    command = [sys.executable, "-m", "thermaxis.cli.machine._with_parent", "machine"]
    with subprocess.Popen(
        [*command, "--port", "0"], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as child:
        assert child.stdin is not None
        assert child.stdout is not None
        assert any(b"endpoint: " in line for line in child.stdout)
        child.stdin.close()  # as the system does, however a program ends
        assert child.wait(PATIENCE_S) == 1
