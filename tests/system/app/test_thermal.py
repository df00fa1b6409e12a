"""Two logs to a verified model in a real browser, by mouse and by keyboard, as the commands say."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.system.app.stand import (
    DROP,
    EXAMPLES,
    FAULTS,
    LONGEST_MS,
    App,
    command,
    opened,
    readable,
)
from thermaxis.messages import sentence

pytestmark = pytest.mark.system

LOGS = [EXAMPLES / "lathe_spindle.csv", EXAMPLES / "lathe_verification.csv"]
FIGURES = ("fit_percent", "peak_to_peak_um.uncompensated", "peak_to_peak_um.residual")
IDENTIFIED = (*FIGURES, "held_out.fit_percent", "held_out.rmse_um.model", "held_out.rmse_um.static")
VERIFIED = (*FIGURES, "peak_to_peak_um.reduction", "rmse_um", "max_um", "static_rmse_um")
PARTS = ("dc_gain", "direct_gain", "gains", "time_constants_s", "delay_s")


@pytest.fixture
def page(app: App, browser: Browser) -> Iterator[Page]:
    found = opened(browser, app)
    sizes: list[int] = []
    found.on("requestfinished", lambda one: sizes.append(one.sizes()["responseBodySize"]))
    found.on("dialog", lambda asked: asked.accept())
    found.goto(found.url.rstrip("/") + "/thermal", wait_until="networkidle")
    assert 0 < sum(sizes) < 300_000
    yield found
    clear(found)
    assert FAULTS[found] == []
    found.context.close()


def clear(page: Page) -> None:
    """Remove every log, and with it what was made of it."""
    for left in range(page.locator("#logs li").count(), 0, -1):
        page.locator("#logs button").first.click()
        expect(page.locator("#logs li")).to_have_count(left - 1, timeout=LONGEST_MS)
    expect(page.locator("#results > section")).to_have_count(0)


def card(page: Page, kind: str) -> Any:
    found = page.locator(f"section[data-kind={kind}]").first
    expect(found.locator(".chart-plot > svg").first).to_be_visible(timeout=LONGEST_MS)
    return found


def dropped(page: Page) -> None:
    page.set_input_files("#files", LOGS)
    expect(page.locator("#logs li")).to_have_count(2, timeout=LONGEST_MS)
    expect(page.locator("#work")).to_be_hidden(timeout=LONGEST_MS)


def numbers(card: Any, table: int) -> list[list[float]]:
    """Return the first row of a table, with all the digits that the page knows."""
    cells = card.locator("table").nth(table).locator("tbody tr").first.locator("td").all()
    texts = [(cell.get_attribute("data-value") or "").split() for cell in cells]
    return [[float(one) for one in text] for text in texts]


def printed(found_in: dict[str, Any], keys: tuple[str, ...]) -> list[list[float]]:
    found: list[list[float]] = []
    for key in keys:
        value: Any = found_in
        for part in key.split("."):
            value = value[part]
        found.append(value if isinstance(value, list) else [value])
    return found


def told(folder: Path, *words: object) -> dict[str, Any]:
    """Return the JSON of a command."""
    command(*words, "--json", folder / "told.json")
    return json.loads((folder / "told.json").read_text())


def test_two_logs_become_a_verified_model_with_the_numbers_of_the_commands(
    page: Page, tmp_path: Path
) -> None:
    dropped(page)
    page.click("#identify .main")
    model = card(page, "model")
    page.click("#verify .main")
    verification = card(page, "verification")
    file = tmp_path / "model-1.json"
    parts = "spindle=T_spindle_C-T_column_C"
    words = ("identify", str(LOGS[0]), "--output", "Z_um", "--input", parts, "--model", str(file))
    identified = told(tmp_path, *words)["outputs"]["Z_um"]
    assert numbers(model, 0) == printed(identified, IDENTIFIED)
    assert numbers(model, 1) == printed(identified["parts"][0], PARTS)
    verified = told(tmp_path, "verify", file, LOGS[1])["outputs"]["Z_um"]
    assert numbers(verification, 0) == printed(verified, VERIFIED)
    with page.expect_download(timeout=LONGEST_MS) as taken:
        model.get_by_text(sentence("thermal-take_model"), exact=True).click()
    own, theirs = (json.loads(Path(one).read_text()) for one in (taken.value.path(), file))
    assert own["outputs"] == theirs["outputs"]
    readable(page)


def test_the_same_by_keyboard_alone(page: Page) -> None:
    dropped(page)

    def press(selector: str, key: str = "Enter") -> None:
        page.focus(selector)
        page.keyboard.press(key)

    press("#identify .main")
    card(page, "model")
    expect(page.locator("section[data-kind=model] h2")).to_be_focused()
    press("#verify .main")
    verification = card(page, "verification")
    press("section[data-kind=verification] .chart-plot", "ArrowLeft")
    expect(verification.locator(".chart-cursor text")).to_be_visible()
    press("#identify [name=choose]", "Space")
    press("#identify .main")
    expect(page.locator("section[data-kind=model]")).to_have_count(2, timeout=LONGEST_MS)
    press("#compare")
    expect(page.locator("section[data-kind=comparison] tbody tr")).to_have_count(
        2, timeout=LONGEST_MS
    )
    press("section[data-kind=model] summary")
    for name, value in {"limit": "100", "rate": "1", "plausible": "5:60"}.items():
        page.locator(f"section[data-kind=model] [name={name}]").first.fill(value)
    press("section[data-kind=model] form .main")
    taken = page.get_by_text(sentence("thermal-take_plc"))
    expect(taken).to_be_focused(timeout=LONGEST_MS)
    with page.expect_download(timeout=LONGEST_MS) as block:
        page.keyboard.press("Enter")
    assert block.value.suggested_filename.endswith("plc.zip")


def test_a_text_is_refused_and_work_can_be_cancelled_without_loss(page: Page) -> None:
    page.evaluate(DROP, ["#drop", "letter.txt", "Dear colleague, the log follows."])
    wrong = page.locator("#wrong")
    expect(wrong).to_contain_text(sentence("room-refused", {"said": ""})[:20], timeout=LONGEST_MS)
    rows = "".join(f"03/04/2026 08:{k},{20 + k},{k}\n" for k in range(10, 60))
    page.evaluate(DROP, ["#drop", "plain.csv", "time,spindle,probe\n" + rows])
    expect(page.locator("[name=date_order]")).to_be_focused(timeout=LONGEST_MS)
    page.select_option("[name=date_order]", "day")
    page.click("#reading-form button")
    expect(page.locator("#units select")).to_have_count(2, timeout=LONGEST_MS)
    for name, unit in (("spindle", "degC"), ("probe", "um")):
        page.get_by_label(sentence("thermal-unit_of", {"name": name})).select_option(unit)
    page.click("#reading-form button")
    expect(page.locator("#inputs select").first).to_have_value("spindle", timeout=LONGEST_MS)
    probe = page.get_by_label(sentence("thermal-unit_of", {"name": "probe"}))
    expect(probe).to_have_value("um")  # and may be said anew
    assert all("422" in one for one in FAULTS[page])  # the browser tells every refusal
    FAULTS[page].clear()
    clear(page)
    dropped(page)
    page.click("#identify .main")
    page.click("#cancel")
    expect(wrong).to_have_text(sentence("room-cancelled"))
    expect(page.locator("#logs li")).to_have_count(2)
    page.click("#identify .main")
    card(page, "model")
