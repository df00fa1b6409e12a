"""`thermaxis demo`: one command from nothing to a living page, and every button of it."""

import json
import re
import signal
import time
import urllib.error
import urllib.request
from collections.abc import Generator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.in_time import in_time
from tests.system.programs import Program
from tests.system.screen.stand import PATIENCE_S, START_S
from thermaxis.messages import sentence

STARTS_S = 20.0
"""From the start to a living page, as the docs say. [s]"""
SHOWN = {
    "sensor": sentence("headline-held_for_input", {"name": "T_spindle_C"}),
    "network": sentence("headline-unreachable"),
    "server": sentence("headline-unreachable"),
    "stop": sentence("headline-interlock", {"names": "no_emergency_stop"}),
    "loop": sentence("common-no_data"),
}
"""What the head of the page says where something is broken."""


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


@pytest.mark.real_time
def test_the_demo_lives_soon_breaks_by_every_button_and_leaves_nothing(
    demo: Program, browser: Browser, tmp_path: Path
) -> None:
    address = demo.wait_for("demo: ", START_S).text.split()[-1]
    demo.wait_for("Ctrl+C", START_S)
    said = "\n".join(one.text for one in demo.said)
    context = browser.new_context(locale="en-GB")
    context.set_default_timeout(1e3 * PATIENCE_S)
    page = context.new_page()
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.goto(f"{address}demo")
    page.wait_for_selector('body[data-live="yes"]')
    assert in_time(time.monotonic() - demo.began_s, STARTS_S)
    gist = page.locator("#gist")
    expect(gist).to_contain_text("Compensating")
    buttons = page.locator("[data-break]")
    assert {one.get_attribute("data-break") for one in buttons.all()} == set(SHOWN)
    for name, words in SHOWN.items():
        button = page.locator(f"[data-break={name}]")
        button.click()
        expect(button).to_have_attribute("aria-pressed", "true")
        expect(page.locator("#no-data:visible") if name == "loop" else gist).to_contain_text(words)
        button.click()
        expect(button).to_have_attribute("aria-pressed", "false")
        expect(page.locator("body")).to_have_attribute("data-live", "yes")
        expect(gist).to_contain_text("Compensating")

    own = address.rstrip("/")
    press = {"name": "stop", "broken": False}
    assert sent(address, press, own) == 200
    assert sent(address, press, "http://example.com") == 403
    assert sent(address, {"name": "__class__", "broken": True}, own) == 400
    assert sent(address, {"name": "stop", "broken": 1}, own) == 400
    page.goto(f"{address}login")
    name, password = re.findall(r"log in as (operator), password (\w+)", said)[0]
    page.fill("[name=name]", name)
    page.fill("[name=password]", password)
    page.click("#login button")
    expect(page.locator("body")).to_have_attribute("data-role", "operator")
    page.goto(f"{address}demo")
    page.locator("[data-break=stop]").click()  # with the token of who has logged in
    expect(gist).to_contain_text(SHOWN["stop"])
    assert wrong == []
    context.close()

    (folder,) = tmp_path.glob("thermaxis-demo-*")
    assert folder.stat().st_mode & 0o777 == 0o700
    demo.signal(signal.SIGINT)
    assert demo.wait(PATIENCE_S) == 0
    assert not folder.exists()
