"""The operator's page in a browser: one screen in every state, size, language and theme."""

import shutil
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, sync_playwright

from tests.system.screen.operator_stand_in import StandIn, an_input, an_output, made_up, served
from thermaxis.compensation import Part, SampleQuality
from thermaxis.compensation._model_step import gain_of
from thermaxis.compensation._thermal_model import GainPoint
from thermaxis.runtime._users import Role
from thermaxis.screen._persons import Outcome

pytestmark = pytest.mark.system

SIZES = ((1024, 600), (1366, 768), (1920, 1080))
LOCALES = {"en": "en-GB", "de": "de-DE", "cs": "cs-CZ"}
SINCE = datetime.now(UTC) - timedelta(minutes=42)
TWENTY = (
    "spindle_front spindle_rear table_bearing_lower_side column ball_screw_nut_z motor_z oil_tank "
    "air_1 air_2 bed_left bed_right bed_front coolant_in coolant_out hydraulics cabinet scale_z "
    "scale_x turret chuck"
).split()

# What stands out of its box: text cut at its right, or a part that leaves its section.
CUT = """() => {
  const found = [];
  const may = ".op-card-name, .op-alarm-line, .op-alarm-line *, .chart-legend *, .unseen";
  const seen = (e) => e.getClientRects().length > 0 && getComputedStyle(e).visibility !== "hidden";
  for (const e of document.querySelectorAll(".op *")) {
    const own = [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
    if (!own || !seen(e) || e.matches(may) || e.closest("script")) continue;
    const box = e.getBoundingClientRect();
    const inside = e.closest(".op-card, .op-rows, .op-chart, .op > *").getBoundingClientRect();
    const out = box.left < inside.left - 1 || box.right > inside.right + 1
      || box.top < inside.top - 1 || box.bottom > inside.bottom + 1;
    const cut = getComputedStyle(e).display !== "inline" && e.clientWidth > 0
      && !e.closest("svg") && e.scrollWidth > e.clientWidth + 1;
    const name = e.id || String(e.className?.baseVal ?? e.className);
    if (out || cut) found.push(`${out ? "out" : "cut"} ${name}: ${e.textContent}`);
  }
  return found;
}"""
SCROLLS = """() => {
  const root = document.scrollingElement, main = document.querySelector("main");
  return [root.scrollHeight - innerHeight, root.scrollWidth - innerWidth,
    main.scrollHeight - main.clientHeight, main.scrollWidth - main.clientWidth];
}"""
# Texts that overlap one another within the same panel.
OVERLAPS = """() => {
  const found = [];
  for (const box of document.querySelectorAll(".op-scale, .op-card-head, .op-state, .op-strip")) {
    const texts = [...box.querySelectorAll("b, span, p")]
      .filter((e) => [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim()))
      .map((e) => {
        const range = document.createRange();
        range.selectNodeContents(e);
        return [e.textContent, range.getBoundingClientRect()];
      }).filter(([, r]) => r.width > 0);
    for (let i = 0; i < texts.length; i += 1) {
      for (let k = i + 1; k < texts.length; k += 1) {
        const [a, b] = [texts[i][1], texts[k][1]];
        const wide = Math.min(a.right, b.right) - Math.max(a.left, b.left);
        const high = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
        if (wide > 1 && high > 5) found.push(`${texts[i][0]} / ${texts[k][0]}`);
      }
    }
  }
  return found;
}"""


def an_alarm(priority: str, text: str, cause: str, remedy: str, code: str = "") -> dict[str, Any]:
    """Return an alarm; without a code it is shown as the loop said it."""
    since = SINCE.isoformat()
    told = {"text": text, "cause": cause, "remedy": remedy, "values": {}}
    return {"key": text, "priority": priority, "code": code, "since": since, **told}


ALARMS = (
    an_alarm(
        "critical",
        "The machine does not report the offset that was written.",
        "The connection, the sign or unit of the node, or somebody else who writes the offset.",
        "The correction fades out. Check the connection and who else writes the offset, "
        "reference the axis again if in doubt, then acknowledge.",
        "fault_read_back_differs",
    ),
    an_alarm(
        "high",
        "Sensor T_table_bearing_lower_side_C: the value is not plausible.",
        "A broken or short-circuited sensor, or another unit. 212.4 was read, status Good.",
        "The correction of Z_um is held for 5 min, then it fades. Check wire and sensor.",
    ),
    an_alarm("medium", "W" * 300, "W" * 300, "W" * 300),
    an_alarm("low", "A cycle came 2.0 s late.", "The computer was busy.", "Look for other work."),
)


def many() -> dict[str, Any]:
    """Return four outputs with long names, twenty inputs of every quality, every alarm."""
    outputs = ("X_um", "Y_um", "Z_um", "an_output_with_a_very_long_name_um")
    told = made_up(
        outputs=outputs,
        state="Fault",
        reasons=("the machine does not report the offset that was written",),
        alarms=ALARMS,
    )
    qualities = [quality.value for quality in SampleQuality]
    told["inputs"] = {
        f"T_{name}_C": an_input(k, quality=qualities[k % len(qualities)])
        for k, name in enumerate(TWENTY)
    }
    low = {"correction_um": -235.0, "at_soft_limit": True}
    trim = {"trim_um": -12.5, "trim_owner": "a.long.name.of.a.person", "trim_left_s": 27000.0}
    told["outputs"]["Y_um"] = an_output(1, **low, **trim)
    high = {"correction_um": 280.0, "at_soft_limit": True, "at_limit": True}
    told["outputs"]["Z_um"] = an_output(2, **high, weight=0.4)
    return told | {"quality": "held", "source_connected": False, "sink_connected": False}


def states() -> list[dict[str, Any]]:
    """Return a status for every state and number of outputs, the worst at the end."""
    long_reason = "the offset found in the machine lies outside the limits"
    two = made_up(outputs=("X_um", "Z_um"), state="Holding", reasons=["an operator holds it"])
    two["outputs"]["X_um"] = an_output(trim_um=5.0, trim_owner="novak", trim_left_s=2400.0)
    nothing = {
        key: None if value is None or isinstance(value, float) else value
        for key, value in an_output().items()
    }
    empty = made_up(state="Warming", reasons=["the model has not run for long enough"])
    empty["outputs"]["Z_um"] = nothing | {"limits": None, "parts_um": {}}
    empty["inputs"]["T_spindle_C"] = an_input(value_c=None, age_s=None, quality="there is no value")
    return [
        made_up(),
        made_up(state="Off", reasons=["nobody has enabled it"], diameter_mm=None),
        empty,
        two | {"alarms": list(ALARMS[2:])},
        made_up(outputs=("X_um", "Y_um", "Z_um"), state="Fading", reasons=[long_reason]),
        made_up(outputs=("A_um", "B_um", "C_um", "X_um", "Y_um", "Z_um"), state="Off"),
        many(),
    ]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Return a headless browser."""
    program = shutil.which("chromium")
    if program is None:
        pytest.skip("no chromium is installed")
    with sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield found
        found.close()


@pytest.fixture
def stand_in() -> Iterator[StandIn]:
    """Return a served stand-in."""
    with served(StandIn()) as found:
        yield found


def opened(context: BrowserContext, stand_in: StandIn) -> tuple[Page, list[str]]:
    """Return the page, with what its console complains of."""
    page = context.new_page()
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on(
        "console",
        lambda said: wrong.append(said.text) if said.type in {"error", "warning"} else None,
    )
    page.goto(stand_in.address + "/")
    page.wait_for_selector(".op-card")
    page.wait_for_selector("#trend svg text")
    return page, wrong


def shown(page: Page, stand_in: StandIn, status: dict[str, Any]) -> None:
    """Let the loop say something and wait until the page shows it."""
    number = 100_000 * (1 + stand_in.status["number"] // 100_000)
    sha256 = stand_in.status["model_sha256"]
    stand_in.status = status | {"number": number, "model_sha256": sha256}
    page.wait_for_function(
        "n => Number(document.getElementById('beat-text').textContent.match(/\\d{6,}/)) >= n",
        arg=number,
    )
    page.wait_for_timeout(60)  # the chart is drawn at the next picture


def context_of(browser: Browser, language: str, theme: Any = "light") -> BrowserContext:
    """Return a browser's context in a language and a theme."""
    return browser.new_context(
        viewport={"width": 1024, "height": 600}, locale=LOCALES[language], color_scheme=theme
    )


@pytest.mark.parametrize("language", LOCALES)
def test_nothing_scrolls_and_nothing_is_cut_in_any_state_and_size(
    browser: Browser, stand_in: StandIn, language: str
) -> None:
    with context_of(browser, language) as context:
        page, wrong = opened(context, stand_in)
        found: list[str] = []
        for width, height in SIZES:
            page.set_viewport_size({"width": width, "height": height})
            for k, status in enumerate(states()):
                shown(page, stand_in, status)
                for script in (CUT, OVERLAPS):
                    found += [f"{width} state {k}: {one}" for one in page.evaluate(script)]
                assert max(page.evaluate(SCROLLS)) <= 0, (width, k)
        assert found == []
        assert wrong == []
