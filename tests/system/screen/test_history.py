"""The history and the probe in a real browser: spans, zoom, earlier time, exports, events."""

import csv
import re
from collections.abc import Callable, Generator
from datetime import datetime, timedelta
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import Page

from tests.system.screen.conftest import Looked
from tests.system.screen.stand import Rig, Visitor, wait_until

Look = Callable[..., Looked]


@pytest.fixture(scope="module", autouse=True)
def asked(stand: Rig, people: Callable[[str], Visitor]) -> Generator[None]:
    """Let the loop compensate, with a trim in its history."""
    operator = people("operator")
    for method, arguments in (("Enable", []), ("Trim", ["Z_um", 2.0, 600.0])):

        def accepted(method: str = method, arguments: list[object] = arguments) -> bool:
            found = operator.ask("/ask", {"method": method, "arguments": arguments}).json()
            return bool(found.get("answer") == "accepted")

        wait_until(f"{method} is accepted", accepted)
    wait_until("an offset in the lathe", lambda: abs(stand.offset_um()) > 5.0)
    yield
    operator.ask("/ask", {"method": "Trim", "arguments": ["Z_um", 0.0, 600.0]})


def drawn(page: Page) -> int:
    return int(page.get_attribute("#chart", "data-drawn") or "0")


def after(page: Page, act: Callable[[], object]) -> None:
    """Do something and wait until the chart is drawn again."""
    before = drawn(page)
    act()
    wait_until("the chart is drawn", lambda: drawn(page) > before)


def opened(look: Look, path: str, role: str = "engineer", **options: object) -> Looked:
    seen = look(role, **options)
    page = seen.open(path)
    page.wait_for_selector("#chart[data-drawn]")
    after(page, lambda: page.click("button[data-hours='1']"))
    return seen


@pytest.mark.parametrize("way", ["button", "drag"])
def test_zooming_asks_anew_for_the_finer_span(look: Look, way: str) -> None:
    seen = opened(look, "/history")
    page = seen.page
    spans: list[str] = []
    page.on("request", lambda r: spans.append(r.url) if "/history/trend" in r.url else None)

    def drag() -> None:
        box = page.locator("#chart .chart-frame").first.bounding_box()
        assert box is not None
        y = box["y"] + 0.5 * box["height"]
        page.mouse.move(box["x"] + 0.8 * box["width"], y)
        page.mouse.down()
        page.mouse.move(box["x"] + 0.99 * box["width"], y, steps=5)
        page.mouse.up()

    after(page, drag if way == "drag" else lambda: page.click(".chart-tools button:nth-child(4)"))
    shown = parse_qs(urlsplit(spans[-1]).query)
    length_s = page.evaluate(
        "([first, last]) => (Date.parse(last) - Date.parse(first)) / 1000",
        [shown["first"][0], shown["last"][0]],
    )
    assert length_s == pytest.approx(0.19 * 3600 if way == "drag" else 1800, rel=0.05)
    after(page, lambda: page.click(".chart-tools button:nth-child(5)"))  # all: as before
    whole = parse_qs(urlsplit(spans[-1]).query)
    again_s = page.evaluate(
        "([first, last]) => (Date.parse(last) - Date.parse(first)) / 1000",
        [whole["first"][0], whole["last"][0]],
    )
    assert again_s == pytest.approx(3600, abs=1)
    assert seen.wrong == []


def test_an_earlier_time_is_laid_over_dashed_and_it_is_said_from_when_it_is(look: Look) -> None:
    seen = opened(look, "/history")
    page = seen.page
    lines = page.locator("#chart .chart-line").count()

    def compare(days: str) -> str:
        page.fill("#days", days)
        after(page, lambda: page.press("#days", "Enter"))
        return page.inner_text("#second-told")

    for some in ("1", "1e9"):  # of more days than a span has the most
        assert "Nothing was recorded" in compare(some)
    first = datetime.fromisoformat(page.input_value("#from")) - timedelta(seconds=1)
    assert f"Dashed: what was recorded from {first:%d/%m/%Y, %H:%M:%S}" in compare(str(1 / 86400))
    assert page.locator("#chart .chart-line").count() > lines
    assert compare("") == ""
    assert page.locator("#chart .chart-line").count() == lines
    assert seen.wrong == []


def test_a_request_stands_among_the_events_with_who_asked(look: Look) -> None:
    page = opened(look, "/history", "viewer").page
    rows = page.locator("#events tr").all_inner_texts()
    trim = next(row for row in rows if "+2.0" in row)
    assert "operator" in trim
    assert "accepted" in trim
    assert any(row.split("\t")[1] == "state" for row in rows)


def test_the_span_is_kept_when_the_page_loads_itself_again(look: Look) -> None:
    page = opened(look, "/history").page
    after(page, lambda: page.click(".chart-tools button:nth-child(4)"))
    before = page.inner_text("#told")
    page.reload()
    page.wait_for_selector("#chart[data-drawn]")
    assert page.inner_text("#told") == before


def test_what_does_not_fit_a_chart_is_refused_in_words(look: Look) -> None:
    page = opened(look, "/history", locale="de-DE").page
    page.locator("#series button", has_text="Gewicht").first.click()
    assert "zwei Achsen" in page.inner_text("#wrong")
    page.fill("#from", "2026-11-21T12:00:00")
    page.fill("#to", "2026-11-21T11:00:00")
    page.click("#span button[type=submit]")
    assert "kein Zeitraum" in page.inner_text("#wrong")


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_the_span_is_exported_as_the_loop_recorded_it(
    look: Look, tmp_path: Path, ending: str
) -> None:
    page = opened(look, "/history", "viewer").page
    with page.expect_download() as found:
        page.click(f"button[data-format='{ending}']")
    name = found.value.suggested_filename
    assert re.fullmatch(rf"history-\d{{8}}T\d{{6}}Z-\d{{8}}T\d{{6}}Z\.{ending}", name)
    path = tmp_path / name
    found.value.save_as(path)
    if ending == "parquet":
        content = path.read_bytes()
        assert content[:4] == content[-4:] == b"PAR1"
    else:
        with path.open(encoding="utf-8", newline="") as lines:
            rows = [row for row in csv.reader(lines) if row and not row[0].startswith("#")]
        assert len(rows) > 20
        assert any("probe" in heading for row in rows[:3] for heading in row)
    wait_until("it is said", lambda: name in page.inner_text("#export-told"))


def test_the_probe_shows_what_would_be_without_the_offset(look: Look, stand: Rig) -> None:
    seen = opened(look, "/probe")
    page = seen.page
    seen.wait_live()

    def shown(place: str) -> float:
        text = page.inner_text(place).replace("\N{MINUS SIGN}", "-")
        found = re.match(r"-?\d+\.\d", text)
        return float(found[0]) if found else float("nan")

    def agrees() -> bool:
        truth = stand.lathe_values("Z_true_um", "Z_uncorrected_um")
        told = shown("#now"), shown("#now-without")
        return all(abs(a - b) < 3.0 for a, b in zip(told, truth, strict=True))

    wait_until("what is shown agrees with the lathe's truth", agrees)
    assert int(re.findall(r"\d+", page.inner_text("#told"))[0]) > 0
    assert "%" in page.inner_text("#ratio")
    assert seen.wrong == []
