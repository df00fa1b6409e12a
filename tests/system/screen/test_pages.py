"""Every page in a real browser: it opens, asks nobody else, fits, and speaks three languages."""

import re
from collections.abc import Callable
from typing import Final

import pytest
from playwright.sync_api import Page

from tests.system.screen.conftest import Looked
from tests.system.screen.stand import Rig, Visitor, wait_until

Look = Callable[..., Looked]
Pictured = Callable[[Page, str], None]
PAGES: Final = {
    "operator": "/",
    "model": "/model",
    "sensors": "/sensors",
    "history": "/history",
    "probe": "/probe",
    "positioning": "/positioning",
}
SIZES: Final = ((1024, 600), (1366, 768), (1920, 1080))
CHARTS: Final = ("operator", "model", "history", "probe")
WORDS: Final = {"en": "Hold", "de": "Halten", "cs": "Podržet"}


@pytest.fixture(scope="module", autouse=True)
def active(stand: Rig, people: Callable[[str], Visitor]) -> None:
    """Let the loop compensate, so that the pages have something to show."""
    people("operator").enable()
    wait_until("an offset in the lathe", lambda: abs(stand.offset_um()) > 5.0)


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("name", PAGES)
def test_a_page_opens_asks_no_other_address_and_fits_its_width_at_three_sizes(
    look: Look, pictured: Pictured, name: str, theme: str
) -> None:
    seen = look("engineer", color_scheme=theme)
    page = seen.open(PAGES[name])
    seen.wait_live()
    if name in CHARTS:
        page.wait_for_selector(".chart-plot svg", state="attached")
    seen.wait_idle()
    assert page.evaluate("document.documentElement.dataset.theme") == theme
    assert page.locator("nav.pages a").count() == len(PAGES)
    assert page.locator('nav.pages a[aria-current="page"]').get_attribute("href") == PAGES[name]
    assert seen.wrong == []
    for width, height in SIZES:
        page.set_viewport_size({"width": width, "height": height})
        seen.until(f"innerWidth === {width}")
        pictured(page, f"{name}-{theme}-{width}x{height}")
        over = page.evaluate(
            "[document.scrollingElement.scrollWidth - innerWidth,"
            " document.scrollingElement.scrollHeight - innerHeight]"
        )
        assert over[0] <= 0, f"{width} x {height}: {over[0]} px too wide"
        assert name != "operator" or over[1] <= 0, f"{width} x {height}: {over[1]} px too high"


def test_what_can_be_touched_is_large_enough_for_a_glove(look: Look) -> None:
    seen = look("engineer")
    small = """() => [...document.querySelectorAll('button, a[href], select, input, [role=button]')]
      .filter((e) => !e.closest('svg, .modebar') && e.getClientRects().length)
      .map((e) => [e.id || e.name || e.textContent.trim().slice(0, 30),
        // what is drawn before a button may spread its touch over the panel that it opens
        (getComputedStyle(e, "::before").position === "absolute" && e.offsetParent
          || e.closest('label') || e).getBoundingClientRect()])
      .filter(([, box]) => Math.min(box.width, box.height) < 40 && box.width > 1)
      .map(([name, box]) => `${name}: ${box.width.toFixed(0)} x ${box.height.toFixed(0)}`)"""
    found = {}
    for name, path in PAGES.items():
        page = seen.open(path)
        seen.wait_live()
        found[name] = page.evaluate(small)
    assert not any(found.values()), found


@pytest.mark.parametrize(("language", "hold"), WORDS.items())
def test_another_language_changes_words_and_the_decimal_sign(
    look: Look, language: str, hold: str
) -> None:
    seen = look("viewer")
    page = seen.open("/")
    if language != "en":
        with page.expect_navigation():
            page.select_option("#language", language)
    seen.wait_live()
    assert page.evaluate("document.documentElement.lang.slice(0, 2)") == language
    assert page.locator('[data-ask="Hold"] b').inner_text() == hold
    text = page.locator("#cards").inner_text()
    sign = "." if language == "en" else ","
    other = "," if sign == "." else "."
    assert re.search(rf"\d\{sign}\d", text), text
    assert not re.search(rf"\d\{other}\d", text), text


def test_the_theme_is_switched_kept_and_seen_by_the_charts(look: Look) -> None:
    seen = look("viewer", color_scheme="light")
    page = seen.open("/")
    seen.wait_live()
    page.wait_for_selector("#trend .chart-plot svg", state="attached")
    fill = "getComputedStyle(document.querySelector('#trend .chart-plot svg text')).fill"
    paper = "getComputedStyle(document.body).backgroundColor"
    light = page.evaluate(f"[{fill}, {paper}]")
    page.click("#theme")
    seen.until("document.documentElement.dataset.theme === 'dark'")
    seen.until(f"{fill} !== '{light[0]}'")
    assert page.evaluate(paper) != light[1]
    page.reload()
    assert page.evaluate("document.documentElement.dataset.theme") == "dark"
    assert seen.wrong == []


def test_what_the_page_shows_is_what_the_lathe_has(look: Look, stand: Rig) -> None:
    seen = look("viewer")
    page = seen.open("/")
    seen.wait_live()

    def shown() -> float:
        text = page.locator("#cards").inner_text().replace("\u2212", "-")
        found = re.search(r"([+-]?\d+\.\d)", text)
        return float(found.group(1)) if found else float("nan")

    wait_until("the correction of the lathe", lambda: abs(shown() - stand.offset_um()) <= 0.6)
