"""The operator's page over a stand-in in a browser: open it, let the loop speak, look at it."""

from datetime import UTC, datetime, timedelta
from typing import Any

from playwright.sync_api import Browser, BrowserContext, Page

from tests.system.screen.operator_stand_in import StandIn, made_up

LOCALES = {"en": "en-GB", "de": "de-DE", "cs": "cs-CZ"}
SINCE = datetime.now(UTC) - timedelta(minutes=42)
TRIM = {"trim_um": 5.0, "trim_owner": "svoboda", "trim_left_s": 2400.0}

# What stands out of its box: text cut at its right, or a part that leaves its section.
CUT = """() => {
  const found = [];
  const may = ".op-card-name *, .op-open, .op-fit *, .op-alarm-line, .op-alarm-line *,"
    + " .chart-legend *, .op-request *, .unseen";
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
# Texts that overlap one another within the same panel, line by line.
OVERLAPS = """() => {
  const found = [];
  for (const box of document.querySelectorAll(".op-card, .op-headline, .op-strip")) {
    const lines = [...box.querySelectorAll("b, span, p")].flatMap((e) =>
      [...e.childNodes].filter((n) => n.nodeType === 3 && n.textContent.trim()).flatMap((n) => {
        const range = document.createRange();
        range.selectNodeContents(n);
        const large = e.closest(".op-fit") !== null; // of these the digits count, not their line
        return [...range.getClientRects()].map((r) => ({ text: n.textContent,
          left: r.left, right: r.right, top: r.top + (large ? 0.15 : 0) * r.height,
          bottom: r.bottom - (large ? 0.22 : 0) * r.height }));
      }));
    lines.forEach((a, i) => lines.slice(i + 1).forEach((b) => {
      const wide = Math.min(a.right, b.right) - Math.max(a.left, b.left);
      const high = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
      if (a.text !== b.text && wide > 1 && high > 5) found.push(`${a.text} / ${b.text}`);
    }));
  }
  return found;
}"""
# Texts whose contrast with what is behind them is below WCAG AA: 4.5, or 3 where they are large.
FAINT = """() => {
  const paint = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const rgba = (colour) => {
    paint.clearRect(0, 0, 1, 1);
    paint.fillStyle = colour;
    paint.fillRect(0, 0, 1, 1);
    return [...paint.getImageData(0, 0, 1, 1).data];
  };
  const light = ([r, g, b]) => [r, g, b].map((v) => v / 255)
    .map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4))
    .reduce((sum, v, k) => sum + v * [0.2126, 0.7152, 0.0722][k], 0);
  const behind = (e) => {
    for (let at = e; at; at = at.parentElement) {
      const found = rgba(getComputedStyle(at).backgroundColor);
      if (found[3] === 255) return found;
    }
    return [255, 255, 255, 255];
  };
  const faint = [];
  for (const e of document.querySelectorAll(".op *")) {
    const own = [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
    if (!own || !e.getClientRects().length || e.closest("svg, script, button:disabled")) continue;
    const style = getComputedStyle(e);
    const [a, b] = [light(rgba(style.color)), light(behind(e))].sort((x, y) => y - x);
    const size = parseFloat(style.fontSize);
    const large = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
    const contrast = (a + 0.05) / (b + 0.05);
    if (contrast < (large ? 3 : 4.5)) faint.push(`${contrast.toFixed(2)} ${e.textContent}`);
  }
  return faint;
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
    page.wait_for_selector("#trend svg text", state="attached")  # a notice may hide it
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
    drawn(page)


def drawn(page: Page) -> None:
    """Wait until what the page knows is drawn: charts are at the next picture."""
    page.evaluate("new Promise((d) => requestAnimationFrame(() => requestAnimationFrame(d)))")


def context_of(browser: Browser, language: str, theme: Any = "light") -> BrowserContext:
    """Return a browser's context in a language and a theme."""
    return browser.new_context(
        viewport={"width": 1024, "height": 600}, locale=LOCALES[language], color_scheme=theme
    )


def ask(page: Page, method: str) -> None:
    """Ask for something that needs no value, and wait until it is accepted."""
    page.click(f'[data-ask="{method}"]')
    page.click("dialog .main")
    page.wait_for_selector('#request[data-answer="accepted"]')


def trimmed(**changed: Any) -> dict[str, Any]:
    """Return a status in which the model asks for -35.5 um and a person has added 5 um."""
    told = made_up(**changed)
    told["outputs"]["Z_um"] |= TRIM | {"model_um": 35.5, "wanted_um": -30.5}
    return told
