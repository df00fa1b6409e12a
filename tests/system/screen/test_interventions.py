"""Every intervention by a person in a browser, against a loop and a lathe that run.

What the page says is held against the lathe's own nodes, read by a client of their own, and
against the historian: every request stands there with who and when.
"""

import re
import signal
import time
from collections.abc import Callable, Generator
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from typing import Final, NamedTuple

import pytest
from playwright.sync_api import Page

from tests.system.screen.conftest import Looked
from tests.system.screen.stand import (
    CYCLE_S,
    OTHER_MODEL,
    PATIENCE_S,
    RATE_UM_PER_S,
    Rig,
    Visitor,
    wait_until,
)

Look = Callable[..., Looked]
NEAR_UM: Final = 0.6
"""Deadband of the loop and what the model drifts meanwhile. [µm]"""
BUTTONS: Final = ("Enable", "Disable", "Hold", "Resume", "Trim", "Diameter", "Acknowledge")


@pytest.fixture
def operating(look: Look) -> Generator[Looked]:
    """Yield the operator's page of an operator; nothing may have gone wrong on it."""
    seen = look("operator")
    seen.open("/")
    seen.wait_live()
    yield seen
    assert seen.unexpected() == []


def state_of(page: Page) -> str:
    return page.locator("#op").get_attribute("data-state") or ""


def wait_state(page: Page, state: str) -> None:
    page.wait_for_selector(f'#op[data-state="{state}"]')


@pytest.fixture
def active(stand: Rig, people: Callable[[str], Visitor], operating: Looked) -> Looked:
    """Return the operator's page while the loop is active, without trim, hold or diameter."""
    person = people("operator")
    for method, arguments in (
        ("Enable", ()),
        ("Resume", ()),
        ("Trim", ("Z_um", 0.0, 60.0)),
        ("NoDiameter", ()),
    ):
        answer = person.request(method, *arguments)
        assert answer["answer"] == "accepted", answer
    wait_state(operating.page, "Active")
    wait_at_rest(stand)
    return operating


def wait_at_rest(stand: Rig) -> float:
    """Wait until the lathe's offset stands still; return it. [µm]"""

    def look() -> tuple[float, float]:
        offset_mm, beat = stand.lathe_values("offset_effective_mm", "heartbeat")
        return 1e3 * offset_mm, beat

    last = look()

    def rests() -> bool:
        nonlocal last
        now = look()
        if abs(now[0] - last[0]) > 0.3:
            last = now
        return abs(now[1] - last[1]) >= 3  # the loop has written so often, and moved nothing

    wait_until("the offset rests", rests)
    return stand.offset_um()


class Seen(NamedTuple):
    """An offset, and between when it was read."""

    begin_s: float
    offset_um: float
    end_s: float


def look_at(stand: Rig) -> Seen:
    return Seen(time.monotonic(), stand.offset_um(), time.monotonic())


def confirm(page: Page, name: str) -> None:
    """Press a button of the page and confirm what it says."""
    page.click(f'[data-ask="{name}"]')
    page.click("dialog[open] .ask-buttons .main")


def course(page: Page) -> str:
    return page.locator("[data-requests]").inner_text()


def wait_effective(page: Page) -> None:
    """Wait until the page says that the last request was accepted, and is in effect."""
    page.wait_for_selector('[data-requests][data-answer="accepted"]')
    wait_until("it is in effect", lambda: "✓" in course(page))


def wait_recorded(stand: Rig, text: str, since: datetime, who: str = "operator") -> None:
    """Wait until the historian tells of a request, of whom, and when it was."""

    def told() -> bool:
        return any(
            event["kind"] == "request"
            and re.search(text, event["text"])
            and event["who"] == who
            and since <= datetime.fromisoformat(event["utc"]) <= datetime.now(UTC)
            for event in stand.events()
        )

    wait_until(f"'{text}' of {who} in the history", told)


def now() -> datetime:
    return datetime.now(UTC) - timedelta(milliseconds=20)


def test_enabling_makes_it_active_and_moves_the_offset_of_the_lathe(
    stand: Rig, operating: Looked, people: Callable[[str], Visitor]
) -> None:
    people("operator").request("Disable")
    page = operating.page
    wait_state(page, "Off")
    wait_until("no offset", lambda: abs(stand.offset_um()) < 0.1)
    since = now()
    confirm(page, "Enable")
    wait_state(page, "Active")
    wait_effective(page)
    wait_until("an offset in the lathe", lambda: abs(stand.offset_um()) > 5.0)
    wait_recorded(stand, "enable: accepted", since)


def requests_of(stand: Rig) -> list[object]:
    """Return what the loop was asked; other events come when the computer is busy."""
    return [event for event in stand.events() if event["kind"] == "request"]


def test_a_dialog_that_is_left_asks_for_nothing(stand: Rig, active: Looked) -> None:
    page = active.page
    before = requests_of(stand)
    page.click('[data-ask="Disable"]')
    page.wait_for_selector("dialog[open]")
    page.click("dialog[open] .ask-buttons button:not(.main)")
    page.wait_for_selector("dialog[open]", state="detached")
    page.click('[data-ask="Hold"]')
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog[open]", state="detached")
    assert state_of(page) == "Active"
    assert requests_of(stand) == before


def test_holding_keeps_the_offset_and_resuming_lets_it_go_on(stand: Rig, active: Looked) -> None:
    page = active.page
    since = now()
    confirm(page, "Hold")
    wait_state(page, "Holding")
    wait_effective(page)
    held_um = stand.offset_um()
    stand.wait_cycles(3)
    assert stand.offset_um() == pytest.approx(held_um, abs=0.01)
    wait_recorded(stand, "hold: accepted", since)
    since = now()
    confirm(page, "Resume")
    wait_state(page, "Active")
    wait_effective(page)
    wait_recorded(stand, "resume: accepted", since)


def test_a_trim_is_added_shown_as_manual_and_taken_back(stand: Rig, active: Looked) -> None:
    page = active.page
    before_um = wait_at_rest(stand)
    since = now()
    page.click('[data-ask="Trim"]')
    for _ in range(2):
        page.locator("dialog[open] .op-steps button").nth(3).click()  # +5
    page.locator("dialog[open] .op-steps button").nth(1).click()  # -1
    assert "+9.0" in page.locator("dialog[open] .op-pad-value").inner_text()
    page.locator("dialog[open] .op-steps button").nth(3).click()
    assert "+10.0" in page.locator("dialog[open] .op-pad-value").inner_text(), "beyond its bound"
    page.click("dialog[open] .ask-buttons .main")
    page.click("dialog[open] .ask-buttons .main")
    wait_effective(page)
    wait_until(
        "ten more in the lathe",
        lambda: abs(stand.offset_um() - before_um - 10.0) <= NEAR_UM,
    )
    assert re.search(r"manual", page.locator("#cards").inner_text())
    page.locator(".op-card").first.click()
    assert "operator" in page.locator('dialog[open] [data-row="trim"]').inner_text()
    page.keyboard.press("Escape")
    wait_recorded(stand, "trim: accepted", since)
    page.click('[data-ask="Trim"]')
    page.click("dialog[open] .op-steps + button")
    page.click("dialog[open] .ask-buttons .main")
    page.click("dialog[open] .ask-buttons .main")
    wait_effective(page)
    wait_until("as before", lambda: abs(stand.offset_um() - before_um) <= NEAR_UM)


def test_a_diameter_changes_the_gain_of_the_table(
    stand: Rig, active: Looked, people: Callable[[str], Visitor]
) -> None:
    page = active.page
    before_um = wait_at_rest(stand)
    since = now()
    page.click('[data-ask="Diameter"]')
    page.locator("dialog[open] input").fill("3000")
    page.click("dialog[open] .ask-buttons .main")
    page.click("dialog[open] .ask-buttons .main")
    wait_effective(page)
    assert "3000" in page.locator("#diameter-told").inner_text().replace("\u202f", "")
    after_um = wait_at_rest(stand)
    assert abs(after_um - before_um) > 2.0
    wait_recorded(stand, "diameter: accepted", since)
    page.click('[data-ask="Diameter"]')
    page.click("dialog[open] .ask-buttons button:nth-child(2)")
    page.click("dialog[open] .ask-buttons .main")
    wait_effective(page)
    wait_until("as before", lambda: abs(stand.offset_um() - before_um) <= 1.0)


def test_disabling_fades_within_the_rate_and_never_jumps(stand: Rig, active: Looked) -> None:
    page = active.page
    began_um = wait_at_rest(stand)
    assert abs(began_um) > 5.0
    since = now()
    seen = [look_at(stand)]
    confirm(page, "Disable")
    while abs(seen[-1].offset_um) > 0.05:
        seen.append(look_at(stand))
        assert seen[-1].end_s - seen[0].begin_s < 3.0 * PATIENCE_S, seen[-3:]
    whole_s = seen[-1].end_s - seen[0].begin_s
    assert whole_s >= abs(began_um) / RATE_UM_PER_S - 1.5
    # Between two looks: the rate, and two writes that may fall into the one and the other cycle.
    for one, next_one in pairwise(seen):
        between_s = next_one.end_s - one.begin_s
        moved_um = abs(next_one.offset_um - one.offset_um)
        assert moved_um <= RATE_UM_PER_S * (between_s + 2.0 * CYCLE_S) + 1e-6
    wait_state(page, "Off")
    wait_effective(page)
    wait_recorded(stand, "disable: accepted", since)


def test_a_fault_is_shown_and_acknowledged_once_its_cause_is_gone(
    stand: Rig, active: Looked
) -> None:
    page = active.page
    stand.kill("machine", signal.SIGKILL)
    stand.start_lathe("set own_compensation to 1 at 2s for 40s")
    wait_state(page, "Fault")
    alarm = page.locator("#alarm").inner_text()
    assert "another compensation" in alarm.lower() or "compensation" in alarm.lower(), alarm
    assert page.locator("#alarm").get_attribute("data-priority") != "none"
    assert page.locator("#alarm .mark").inner_text() in {"1", "2", "3", "4"}
    since = now()
    confirm(page, "Acknowledge")
    page.wait_for_selector('[data-requests][data-answer="refused"]')
    assert "another compensation or writer is still there" in course(page).lower(), course(page)
    wait_recorded(stand, "acknowledge: refused, another compensation", since)
    since = now()
    wait_until("the flag is gone", lambda: stand.lathe_values("own_compensation") == [0.0])
    stand.wait_cycles(4)
    confirm(page, "Acknowledge")
    page.wait_for_selector('[data-requests][data-answer="accepted"]')
    wait_state(page, "Off")
    wait_recorded(stand, "acknowledge: accepted", since)


def test_an_engineer_chooses_another_model_and_the_operator_may_not(
    look: Look, people: Callable[[str], Visitor], stand: Rig
) -> None:
    refused = people("operator").ask("/ask", {"method": "ChooseModel", "arguments": [OTHER_MODEL]})
    assert refused.status == 403
    people("operator").request("Enable")  # a model is effective only while it is followed
    seen = look("engineer")
    page = seen.open("/model")
    seen.wait_live()
    since = now()
    page.locator("#choice").wait_for()
    if page.locator("#choice").evaluate("e => e.tagName") == "SELECT":
        page.select_option("#choice", OTHER_MODEL)
    else:
        page.locator("#choice").get_by_text(OTHER_MODEL).click()
    page.click("#choose-ask")
    page.click("dialog[open] .ask-buttons .main")
    wait_effective(page)
    seen.until(f"document.getElementById('model-file').textContent.includes('{OTHER_MODEL}')")
    wait_recorded(stand, "model: accepted", since, "engineer")
    answer = people("engineer").request("ChooseModel", "quick.json")
    assert answer["answer"] == "accepted", answer
    assert seen.unexpected() == []


def test_a_viewer_sees_every_button_disabled_and_why(look: Look) -> None:
    seen = look("viewer")
    page = seen.open("/")
    seen.wait_live()
    for name in BUTTONS:
        assert page.locator(f'[data-ask="{name}"]').is_disabled(), name
    assert page.locator("#asks-why").inner_text().strip()
