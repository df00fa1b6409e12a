"""What is never out of sight, also on the smallest screen with everything at once.

Offsets and trims of the outputs that are shown, the buttons, what came of the newest request.
"""

from typing import Any

import pytest
from playwright.sync_api import Browser

from tests.system.screen.operator_browser import (
    ALARMS,
    CUT,
    LOCALES,
    OVERLAPS,
    SCROLLS,
    ask,
    context_of,
    opened,
    shown,
)
from tests.system.screen.operator_stand_in import StandIn, made_up

pytestmark = pytest.mark.system

SIZES = ((1024, 600), (1280, 800), (1920, 1080))
NOTICE = "The connection to the compensation was lost. Whoever is logged in may only look on. " * 2
TRIM = {"trim_um": -12.5, "trim_owner": "a.long.name.of.a.person", "trim_left_s": 27_000.0}
# The rows of every card that are whole in it and not covered by anything.
ROWS = """() => [...document.querySelectorAll(".op-card")].map((card) => {
  const room = card.getBoundingClientRect();
  return [...card.querySelectorAll("[data-row]")].filter((line) => {
    const box = line.lastElementChild.getBoundingClientRect();
    if (box.width === 0 || box.bottom > room.bottom || box.right > room.right) return false;
    const top = document.elementFromPoint(box.left + box.width / 2, box.top + box.height / 2);
    return card.contains(top);
  }).map((line) => line.dataset.row);
})"""
# Pairs of buttons and lines of the list of requests of which one lies over the other.
COVERED = """() => {
  const boxes = (found) => [...document.querySelectorAll(found)]
    .map((e) => [e.textContent.trim(), e.getBoundingClientRect()]).filter(([, r]) => r.height > 0);
  const list = document.getElementById("request").getBoundingClientRect();
  const found = [];
  for (const [name, a] of boxes(".op-buttons button")) {
    for (const [text, b] of boxes("#request, #request > *")) {
      if (a.bottom > b.top + 1 && b.bottom > a.top + 1) found.push(`${name} / ${text}`);
    }
  }
  for (const [text, b] of boxes("#request > *")) if (b.bottom > list.bottom) found.push(text);
  return found;
}"""
STANDS = """() => {
  const [list, line] = ["#request", "#request .ask-stands"]
    .map((one) => document.querySelector(one).getBoundingClientRect());
  return line.height > 0 && line.bottom <= list.bottom;
}"""


def with_trims(count: int) -> dict[str, Any]:
    """Return a status with outputs that are all trimmed, one of them beyond its limit."""
    told = made_up(outputs=("W_um", "X_um", "Y_um", "Z_um")[:count], alarms=ALARMS[:1])
    for output in told["outputs"].values():
        output.update(TRIM)
    told["outputs"]["W_um"] |= {"at_limit": True, "correction_um": 18.0, "rest_um": 5.0}
    return told


@pytest.mark.parametrize("language", LOCALES)
def test_offsets_trims_and_buttons_stay_with_notice_alarm_and_three_requests(
    browser: Browser, stand_in: StandIn, language: str
) -> None:
    with context_of(browser, language) as context:
        page, wrong = opened(context, stand_in)
        page.evaluate("text => sessionStorage.setItem('notice', text)", NOTICE)
        page.reload()
        page.wait_for_selector(".op-card")
        for _ in range(3):
            ask(page, "Hold")
        found: list[str] = []
        for width, height in SIZES:
            page.set_viewport_size({"width": width, "height": height})
            for count in (1, 2, 4):
                shown(page, stand_in, with_trims(count))
                at = f"{width}, {count} outputs"
                assert page.locator("#notice").is_visible()
                for rows in page.evaluate(ROWS):
                    assert {"acting", "commanded", "wanted", "trim"} <= set(rows), at
                found += [f"{at}: {e}" for script in (CUT, OVERLAPS) for e in page.evaluate(script)]
                found += [f"{at} covered: {one}" for one in page.evaluate(COVERED)]
                assert max(page.evaluate(SCROLLS)) <= 0, at
                assert page.evaluate(STANDS), at
        assert not found, "\n".join(found)
        page.click("#notice-close")  # the chart comes back whole
        page.set_viewport_size({"width": 1024, "height": 600})
        page.wait_for_selector("#trend svg text")
        shown(page, stand_in, with_trims(1))
        assert page.evaluate(CUT) == []
        assert wrong == []


def test_a_trim_of_an_axis_without_a_card_is_told_with_the_number_of_such_axes(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        told = made_up(outputs=("A_um", "B_um", "C_um", "X_um", "Y_um", "Z_um"))
        shown(page, stand_in, told)
        assert page.inner_text("#cards-more") == "+2 more axes"
        told["outputs"]["Z_um"] |= TRIM
        shown(page, stand_in, told)
        assert page.inner_text("#cards-more") == "+2 more axes, trim (manual): Z −12.5 µm"
        assert max(page.evaluate(SCROLLS)) <= 0
