"""The morning board in a real browser: by keyboard, on a phone, two people at once."""

import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page, expect

from tests.system.app.stand import readable
from tests.unit.fleet.fleet_machines import GAIN, machine_of, model_of
from tests.unit.fleet.test_board import HASH, PASSWORD, STUCK, night_of
from thermaxis.fleet import Registry
from thermaxis.messages import sentence
from thermaxis.runtime import Role, User, write_users

pytestmark = pytest.mark.system
NAMES = ("Lathe 3", "Mill <b>7</b>", "Brno 12")


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Serve three machines with five nights each: one is sound, one stuck, one has a proposal."""
    folder = tmp_path_factory.mktemp("board")
    with Registry.make(f"sqlite:///{folder / 'registry.db'}", "lake") as registry:
        for name in NAMES:
            registry.add(replace(machine_of(name), kind="mill"), "first")
        registry.record(night_of(name, k) for k in range(1, 5) for name in NAMES)
        better = night_of(NAMES[0], proposal=model_of(1.1 * GAIN))
        registry.record([better, night_of(NAMES[1], sensors=(STUCK,)), night_of(NAMES[2])])
    users = [User(name, Role.ENGINEER, HASH) for name in ("anna", "eva")]
    write_users(users, folder / "users.toml")
    words = ["fleet", "page", folder / "registry.db", "--users", folder / "users.toml"]
    with subprocess.Popen(
        [sys.executable, "-m", "thermaxis", *map(str, words), "--port", "0"],
        stdout=subprocess.PIPE,
        text=True,
    ) as program:
        assert program.stdout is not None
        yield program.stdout.readline().removeprefix("fleet: ").strip()
        program.send_signal(signal.SIGINT)
        assert program.wait() == 0


def opened(browser: Browser, address: str, faults: list[str]) -> Page:
    page = browser.new_context(locale="en").new_page()
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.goto(address)
    return page


def logged_in(page: Page, name: str) -> None:
    page.get_by_role("link", name=sentence("common-log_in")).press("Enter")
    page.get_by_label(sentence("login-name")).fill(name)
    page.get_by_label(sentence("login-password")).fill(PASSWORD)
    page.get_by_label(sentence("login-password")).press("Enter")
    expect(page.locator(".who")).to_contain_text(name)


def test_two_people_decide_by_keyboard_and_the_second_one_is_told(
    browser: Browser, address: str
) -> None:
    faults: list[str] = []
    anna, eva = (opened(browser, address, faults) for _ in range(2))
    for page, name in ((anna, "anna"), (eva, "eva")):
        page.get_by_label(sentence("fleet-text")).fill("lathe")
        page.get_by_label(sentence("fleet-text")).press("Enter")
        expect(page.locator(".fleet a")).to_have_count(1)
        page.get_by_role("link", name=NAMES[0]).press("Enter")
        logged_in(page, name)
        expect(page.locator("h1")).to_have_text(NAMES[0])
        page.get_by_label(sentence("fleet-why")).fill("new spindle")
    anna.get_by_label(sentence("fleet-why")).press("Enter")
    expect(anna.locator(".fleet-decided")).to_contain_text("anna has accepted")
    eva.get_by_role("button", name=sentence("fleet-reject")).press("Enter")
    expect(eva.locator("#notice")).to_contain_text(sentence("fleet-decided_before"))
    with anna.expect_download() as download:
        anna.get_by_role("link", name=sentence("fleet-download")).press("Enter")
    assert Path(download.value.suggested_filename).suffix == ".json"
    anna.get_by_role("button", name=sentence("common-log_out")).press("Enter")
    expect(anna.get_by_role("link", name=sentence("common-log_in"))).to_be_visible()
    assert faults == []


def test_both_pages_are_for_everybody_on_a_phone_and_a_desk(browser: Browser, address: str) -> None:
    faults: list[str] = []
    page = opened(browser, address, faults)
    page.set_viewport_size({"width": 390, "height": 844})
    assert Axe().run(page).violations_count == 0
    assert page.evaluate("() => document.documentElement.scrollWidth - innerWidth") <= 0
    page.get_by_role("link", name=re.compile("Mill")).click()
    logged_in(page, "eva")  # the head of the page is full then
    inside = page.get_by_role("button", name=sentence("common-log_out")).bounding_box()
    assert inside is not None
    assert inside["x"] + inside["width"] <= 390
    readable(page)
    assert faults == []
