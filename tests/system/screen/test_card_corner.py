"""A card that has no room for everything is marked: more is a touch away."""

import pytest
from playwright.sync_api import Browser

from tests.system.screen.operator_browser import context_of, opened, shown
from tests.system.screen.operator_stand_in import StandIn, made_up

pytestmark = pytest.mark.system

MARKED = """() => [...document.querySelectorAll(".op-card")].map((card) => [
  card.dataset.more === "yes",
  getComputedStyle(card).backgroundImage !== "none",
  card.querySelector(".op-line[hidden]") !== null
    || getComputedStyle(card.querySelector(".op-bar")).display === "none",
])"""


def test_the_corner_of_a_card_says_whether_something_is_left_out(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "de") as context:
        page, _ = opened(context, stand_in)
        found: set[bool] = set()
        for names in (("Z_um",), ("W_um", "X_um", "Y_um", "Z_um")):
            for width, height in ((1024, 600), (2400, 1600)):
                page.set_viewport_size({"width": width, "height": height})
                shown(page, stand_in, made_up(outputs=names))
                for marked, seen, left_out in page.evaluate(MARKED):
                    assert marked is seen
                    assert marked or not left_out
                    found.add(marked)
        assert found == {True, False}
