"""What is the matter is seen in two seconds from three metres: sign, word and number, in pictures.

`--screens DIR` keeps every picture.
"""

import io
import re
from collections.abc import Callable
from itertools import combinations
from typing import cast

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Browser, Locator, Page

from tests.system.screen.operator_browser import (
    ALARMS,
    CUT,
    FAINT,
    LOCALES,
    OVERLAPS,
    SCROLLS,
    context_of,
    drawn,
    opened,
    shown,
)
from tests.system.screen.operator_stand_in import StandIn, looks, made_up

pytestmark = pytest.mark.system

SIZES = ((1024, 600), (1366, 768), (1920, 1080))
LEAST_CAPITAL_PX = 60
"""16 arc minutes at 3 m are 14 mm: 65 px of a 10-inch panel; never less than this."""
LEAST_TREND_PX = 150
MOST_ALIKE = 0.75
"""Two signs share at most this part of what either covers."""
# A letter of its own in the place of a text that changes.
BESIDE = """(e, letter) => {
  const one = e.cloneNode();
  one.removeAttribute("id");
  one.className = "measured";
  one.textContent = letter;
  e.after(one);
  e.style.display = "none";
}"""


def ink(found: Locator) -> NDArray[np.bool_]:
    """Return which pixels of an element differ from its corner."""
    with Image.open(io.BytesIO(found.screenshot())) as picture:
        grey = np.asarray(picture.convert("L"), dtype=np.int16)
    return np.abs(grey - grey[0, -1]) > 80


@pytest.mark.parametrize("count", [1, 2])
def test_capitals_and_digits_are_read_from_three_metres(
    browser: Browser, stand_in: StandIn, count: int
) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        shown(page, stand_in, made_up(outputs=("X_um", "Z_um")[:count]))
        for place, letter in (("#state-word", "H"), (".op-value b", "8")):
            page.locator(place).first.evaluate(BESIDE, letter)
            rows = np.flatnonzero(ink(page.locator(".measured").last).any(axis=1))
            assert rows[-1] - rows[0] + 1 >= LEAST_CAPITAL_PX, place
        trend = page.locator(".op-trend").bounding_box()
        assert trend is not None
        assert trend["height"] >= LEAST_TREND_PX
        assert page.locator("#trend .chart-letter").count() == 3  # each mark has room for its text


@pytest.mark.parametrize(
    ("language", "look"),
    [("de", "warming"), ("cs", "warming"), ("cs", "unreachable")],  # LÄUFT AN, NÁBĚH, ODPOJENO
)
def test_what_stands_beyond_capitals_stands_on_the_ground_of_its_state(
    browser: Browser, stand_in: StandIn, language: str, look: str
) -> None:
    with context_of(browser, language) as context:
        page, _ = opened(context, stand_in)
        shown(page, stand_in, looks()[look])
        page.locator(".op-state").evaluate("e => { e.style.outline = 'none'; }")
        ground, word = (page.locator(one).bounding_box() for one in (".op-state", "#state-word"))
        assert ground is not None
        assert word is not None
        left = int(word["x"] - ground["x"])
        rows = np.flatnonzero(ink(page.locator(".op-state"))[:, left:-30].any(axis=1))
        assert rows[0] >= 2
        assert rows[-1] <= ground["height"] - 3


def test_no_two_states_look_alike_even_without_colour(browser: Browser, stand_in: StandIn) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        signs: dict[str, NDArray[np.bool_]] = {}
        words: dict[str, str] = {}
        for name, told in looks().items():
            shown(page, stand_in, told)
            assert page.get_attribute("#op", "data-look") == name
            signs[name] = ink(page.locator(".op-sign"))
            words[name] = page.inner_text("#state-word")
        stand_in.live = False
        page.wait_for_selector('.op[data-look="no_data"]')
        signs["no_data"], words["no_data"] = ink(page.locator(".op-sign")), "No data"
        for a, b in combinations(signs, 2):
            alike = (signs[a] & signs[b]).sum() / (signs[a] | signs[b]).sum()
            if {a, b} == {"input_lost", "inputs_unreachable"}:  # all sensors, or one of them
                assert words[a] != words[b]
            else:
                assert alike <= MOST_ALIKE, (a, b, alike)


@pytest.mark.parametrize(
    ("language", "theme"), [*((one, "light") for one in LOCALES), ("en", "dark")]
)
def test_nothing_is_cut_covered_or_faint_in_any_state(
    browser: Browser,
    stand_in: StandIn,
    language: str,
    theme: str,
    pictured: Callable[[Page, str], None],
) -> None:
    wrong: list[str] = []
    with context_of(browser, language, theme) as context:
        page, console = opened(context, stand_in)
        for width, height in SIZES:
            page.set_viewport_size({"width": width, "height": height})
            stand_in.live = True
            for name, told in {**looks(), "no_data": made_up()}.items():
                calm = name in {"off", "warming", "active", "held_by_person", "fading", "no_data"}
                shown(page, stand_in, told | {"alarms": [] if calm else [ALARMS[1]]})
                if name == "no_data":
                    stand_in.live = False
                    page.wait_for_selector('.op[data-look="no_data"]')
                drawn(page)
                at = f"{name}_{language}_{theme}_{width}"
                pictured(page, f"operator_{at}")
                found = [one for s in (CUT, OVERLAPS, FAINT) for one in page.evaluate(s)]
                wrong += [f"{at}: {one}" for one in found]
                wrong += [at] if "headline-" in page.inner_text("#op") else []
                assert max(page.evaluate(SCROLLS)) <= 0, at
                # Once: what differs between themes, FAINT has looked at.
                if (language, theme, width) == ("en", "light", SIZES[0][0]):
                    results = Axe().run(
                        page, options={"runOnly": ["wcag2a", "wcag2aa", "wcag21aa", "wcag22aa"]}
                    )
                    wrong += [f"{at}: {one['id']}" for one in results.response["violations"]]
        wrong += console
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("language", LOCALES)
def test_what_acts_is_a_number_only_while_it_is_known(
    browser: Browser, stand_in: StandIn, language: str
) -> None:
    minus = "−30,5" if language != "en" else "−30.5"
    with context_of(browser, language) as context:
        page, _ = opened(context, stand_in)
        number, said = page.locator(".op-value b"), page.locator('.op-card [data-row="acting"]')
        told = made_up()
        told["outputs"]["Z_um"] |= {"acting_um": -30.5, "requested_um": 18.0}
        shown(page, stand_in, told)
        assert number.inner_text() == minus  # not what is commanded
        commanded = page.locator('.op-card [data-row="commanded"] .op-said')
        assert "+18" in commanded.inner_text()
        told["outputs"]["Z_um"] |= {"requested_age_s": 20.0}  # what is computed goes on
        shown(page, stand_in, told)
        assert commanded.inner_text() == "–"
        shown(page, stand_in, looks()["unreachable"])
        assert number.inner_text() == "?"
        assert minus in said.inner_text()
        assert "1\xa0min 1\xa0s" in said.inner_text()
        computed = page.locator('.op-share b, .op-card [data-row="wanted"] .op-said')
        assert set(computed.all_inner_texts()) == {"–"}
        shown(page, stand_in, looks()["inputs_unreachable"])
        assert set(computed.all_inner_texts()) == {"–"}
        shown(page, stand_in, looks()["off"])  # nothing is wanted, or comes of the sources
        assert computed.first.inner_text() == "–"
        assert page.locator('.op-share:not([data-row="source"])').count() == 0
        never = looks()["off"]
        never["outputs"]["Z_um"] |= {"acting_um": None, "acting_age_s": None, "acting_known": False}
        shown(page, stand_in, never)
        assert number.inner_text() == "?"
        assert not any(c.isdigit() for c in said.inner_text())
        told["outputs"]["Z_um"] |= {"requested_age_s": 0.1}
        shown(page, stand_in, told)
        stand_in.live = False
        page.wait_for_selector('body[data-live="no"]')
        assert number.inner_text() == "?"
        assert minus in said.inner_text()


def test_what_acts_is_as_old_as_its_read_and_the_status_together(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        told = made_up(cycle_s=10.0)
        told["outputs"]["Z_um"] |= {"acting_um": -30.5, "acting_age_s": 1.5}
        stand_in.old_s = 9.0
        shown(page, stand_in, told)
        said = page.locator('.op-card [data-row="acting"]').inner_text()
        age = re.search(r"(\d+)\xa0s ago", said)
        assert age is not None, said
        assert 10 <= int(age[1]) < 60
        assert page.inner_text(".op-value b") == "−30.5"  # the next cycle is not due yet


def test_what_is_not_known_of_one_source_is_not_known_of_their_sum(
    browser: Browser, stand_in: StandIn
) -> None:
    parts = ("spindle", "table", "column", "ram", "head")
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        told = made_up()
        told["outputs"]["Z_um"] |= {
            "sources_um": dict.fromkeys(parts),
            "differences_k": dict.fromkeys(parts),
            "rest_um": None,
        }
        shown(page, stand_in, told)
        shares = page.locator('.op-share[data-row="source"] b').all_inner_texts()
        assert set(shares) == {"–"}
        assert page.inner_text('.op-card [data-row="wanted"] .op-said') == "–"
        assert len(shares) < len(parts)


def test_what_stood_when_the_loop_began_is_said_to_have_stood_since_then_at_least(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        told = made_up()
        for since, words in ((told["headline_since"], "since "), (told["started"], "since at ")):
            shown(page, stand_in, told | {"headline_since": since})
            assert page.inner_text("#state-since").startswith(words)
            assert ("at least" in page.inner_text("#state-since")) is (since == told["started"])


def test_the_shares_are_bars_that_add_up_to_what_is_computed(
    browser: Browser, stand_in: StandIn
) -> None:
    script = """() => [...document.querySelectorAll(".op-card .op-share")].map((row) => {
      const boxes = [...row.querySelectorAll(".op-bar i")].map((e) => e.getBoundingClientRect());
      const [fill, zero] = boxes;
      return [row.lastElementChild.textContent, fill.left, fill.right, zero.left + 1];
    })"""
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        told = looks()["held_by_person"]
        told["outputs"]["Z_um"] |= {"rest_um": 0.0, "correction_um": -30.2}
        shown(page, stand_in, told)
        rows = cast("list[tuple[str, float, float, float]]", page.evaluate(script))
        values = [float(text.replace("−", "-")) for text, *_ in rows]
        assert sum(values[:-1]) == pytest.approx(values[-1])
        for (_, left, right, _), (_, after_left, after_right, _), um in zip(
            rows, rows[1:], values[1:], strict=False
        ):
            joins = {round(left), round(right)} & {round(after_left), round(after_right)}
            assert joins or um == values[-1]
        _, left, _, zero = rows[-1]
        assert rows[-2][2] == pytest.approx(left, abs=1.0)  # the trim ends where the sum does
        assert rows[-1][2] == pytest.approx(zero, abs=1.0)
        assert "+6.8\xa0K" in page.inner_text(".op-share:first-child")
        assert "(manual)" in page.inner_text('[data-row="trim"]')


def test_nothing_out_of_the_ordinary_is_said_only_while_off_or_compensating(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        for name, told in looks().items():
            shown(page, stand_in, told)
            calm = "ordinary" in page.inner_text("#alarm")
            assert calm is (name in {"off", "active"}), name
            assert page.inner_text("#headline")
            assert bool(page.text_content("#remedy")) is (name not in {"off", "active"}), name
