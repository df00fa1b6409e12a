"""Every text on every page is readable: WCAG 2 AA, measured in two ways that share nothing."""

from collections.abc import Callable
from typing import Any, Final

import pytest
from axe_playwright_python.sync_playwright import Axe

from tests.system.screen.conftest import Looked
from tests.system.screen.stand import Rig, Visitor, wait_until
from tests.system.screen.test_pages import CHARTS, PAGES

Look = Callable[..., Looked]
LEAST: Final = 4.5
"""Contrast of text (WCAG 2, 1.4.3). [1]"""
LEAST_LARGE: Final = 3.0
"""Of large text: 24 px, or 18.66 px and bold. [1]"""
WALK: Final = """() => {
  const paint = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const rgba = (text) => {
    paint.clearRect(0, 0, 1, 1);
    paint.fillStyle = text;
    paint.fillRect(0, 0, 1, 1);
    const [r, g, b, a] = paint.getImageData(0, 0, 1, 1).data;
    return [r, g, b, a / 255];
  };
  const over = (top, under) =>
    [0, 1, 2].map((k) => top[k] * top[3] + under[k] * (1 - top[3])).concat(1);
  const light = (colour) => {
    const [r, g, b] = colour.map((c) => c / 255).map((c) =>
      c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const behind = (element) => {
    const layers = [];
    for (let e = element; e; e = e.parentElement) {
      layers.push(rgba(getComputedStyle(e).backgroundColor));
      if (layers.at(-1)[3] === 1) break;
    }
    return layers.reverse().reduce((under, top) => over(top, under), [255, 255, 255, 1]);
  };
  const shown = (e) => e.checkVisibility({ opacityProperty: true, visibilityProperty: true });
  const idle = (e) => e.closest("button:disabled, [aria-disabled=true], :disabled");
  const found = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const text = walker.currentNode.textContent.trim();
    const e = walker.currentNode.parentElement;
    if (!text || e.closest("script, style, option, .unseen") || !shown(e) || idle(e)) continue;
    const range = document.createRange();
    range.selectNode(walker.currentNode);
    const box = range.getBoundingClientRect();
    if (!box.width || !box.height) continue;
    const style = getComputedStyle(e);
    let dim = 1;
    for (let p = e; p; p = p.parentElement) dim *= Number(getComputedStyle(p).opacity);
    const ground = behind(e);
    const ink = rgba(e instanceof SVGElement ? style.fill : style.color);
    const front = over([...ink.slice(0, 3), ink[3] * dim], ground);
    const [high, low] = [light(front), light(ground)].sort((a, b) => b - a);
    const size = parseFloat(style.fontSize);
    const large = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
    const where = `${e.tagName.toLowerCase()}${e.id && "#" + e.id}.${e.getAttribute("class")}`;
    found.push([(high + 0.05) / (low + 0.05), large, `${where}: ${text.slice(0, 40)}`]);
  }
  return found;
}"""


@pytest.fixture(scope="module", autouse=True)
def active(stand: Rig, people: Callable[[str], Visitor]) -> None:
    """Let the loop compensate, with a trim, so that the pages have much to show."""
    operator = people("operator")
    for question in (("Enable",), ("Trim", "Z_um", 1.0, 3600.0)):
        answer = operator.request(*question)
        assert answer["answer"] == "accepted", answer
    wait_until("an offset in the lathe", lambda: abs(stand.offset_um()) > 5.0)


def poor(found: list[Any]) -> list[str]:
    """Return the texts whose contrast is too low."""
    return sorted(
        {
            f"{ratio:.2f} {what}"
            for ratio, large, what in found
            if ratio < (LEAST_LARGE if large else LEAST) - 0.005
        }
    )


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("name", [*PAGES, "login"])
def test_every_text_has_the_contrast_of_wcag_aa(look: Look, name: str, theme: str) -> None:
    seen = look("" if name == "login" else "engineer", color_scheme=theme)
    page = seen.open(PAGES.get(name, "/login"))
    if name != "login":
        seen.wait_live()
    if name in CHARTS:
        page.wait_for_selector(".chart-plot svg", state="attached")
    seen.wait_idle()
    found = page.evaluate(WALK)
    assert len(found) > 5, found
    assert poor(found) == []
    results = Axe().run(page, options={"runOnly": ["wcag2a", "wcag2aa", "wcag21aa", "wcag22aa"]})
    broken = {
        one["id"]: [node["html"][:120] for node in one["nodes"]]
        for one in results.response["violations"]
    }
    assert broken == {}


def test_the_walk_finds_a_text_that_is_too_pale(look: Look) -> None:
    page = look().open("/login")
    page.evaluate("""() => {
      const pale = document.createElement("p");
      pale.textContent = "hardly to be read";
      pale.style.color = "#999";
      pale.style.backgroundColor = "#fff";
      document.querySelector("main").append(pale);
    }""")
    ratios = {what: ratio for ratio, _, what in page.evaluate(WALK)}
    found = [ratio for what, ratio in ratios.items() if "hardly to be read" in what]
    assert found == [pytest.approx(2.849, abs=0.001)]  # #999999 on white, by hand


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_every_dialog_of_the_operator_is_readable_too(look: Look, theme: str) -> None:
    seen = look("operator", color_scheme=theme)
    page = seen.open("/")
    seen.wait_live()
    for name in ("Disable", "Hold", "Trim", "Diameter"):
        page.click(f'[data-ask="{name}"]')
        page.wait_for_selector("dialog[open]")
        assert poor(page.evaluate(WALK)) == [], name
        page.keyboard.press("Escape")
        page.wait_for_selector("dialog[open]", state="detached")
    assert seen.wrong == []
