"""Charts and the engineer's pages in a real browser; no server, no socket."""

from datetime import datetime, timedelta
from typing import Any

import pytest
from playwright.sync_api import Browser, Locator, Page, Route

from tests.system.screen.engineer_browser import Pages, opened
from tests.system.screen.stand import wait_until
from tests.unit.screen.engineer_bench import CHANNELS, told_by_a_loop
from tests.unit.screen.people import TOKEN
from tests.unit.screen.stand import NO_DATA, Feed, lathe, parts
from thermaxis.runtime import Role

MACHINE = lathe()
WARM = told_by_a_loop(MACHINE, {"T_spindle_C": 36.0, "T_table_C": 22.0, "T_column_C": 21.0})

DRAW = """async (chart) => {
  const { drawChart } = await import("/static/chart/chart.js");
  let element = document.getElementById("probe");
  if (!element) {
    element = document.createElement("div");
    element.id = "probe";
    element.style.height = "24rem";
    document.getElementById("content").prepend(element);
  }
  window.spans = [];
  drawChart(element, { ...chart, onSpan: (span) => window.spans.push(span) });
  const turn = () => new Promise((done) => requestAnimationFrame(done));
  do { await turn(); } while (!element.querySelector(".chart-plot svg"));
}"""


def pages_for(role: Role | None = None) -> Pages:
    feed = Feed(dict(WARM))
    feed.fill(("T_spindle_C", "T_spindle_C.redundant"), 36.0, 0.05, 290)
    feed.fill(("T_column_C",), 21.0, 0.02, 12)
    return Pages(parts(MACHINE, feed, role), feed)


def texts(page: Page, selector: str) -> list[str]:
    return [text.strip() for text in page.locator(selector).all_inner_texts()]


def until(page: Page, condition: str) -> None:
    """Wait until an expression is true; the page itself may evaluate no text."""
    wait_until(condition, lambda: page.evaluate(condition))


def drawn_texts(page: Page, selector: str) -> list[str]:
    """Return the texts of a drawing, which has no inner text."""
    return page.locator(selector).all_text_contents()


def attributes(lines: Locator, part: str, name: str) -> list[str]:
    """Return an attribute of a part of every line."""
    parts = lines.locator(part).all()
    return [one.get_attribute(name) or "" for one in parts]


def minutes(first: str, count: int) -> list[str]:
    begin = datetime.fromisoformat(first)
    return [(begin + timedelta(minutes=k)).isoformat() for k in range(count)]


def hours_chart(**changes: Any) -> dict[str, Any]:
    x = minutes("2026-11-20T08:00:00+00:00", 481)
    y: list[float | None] = [k / 10.0 - 20.0 for k in range(481)]
    y[100:140] = [None] * 40
    return {
        "lines": [
            {"name": "Z_um", "unit": "µm", "x": x, "y": y},
            {"name": "T <b>1</b>", "unit": "°C", "axis": "right", "x": x, "y": y[::-1]},
        ],
        "marks": [
            {"x": x[10], "text": "enabled by novak"},
            {"x": x[12], "text": "active"},
            {"x": x[300], "text": "sensor bad", "kind": "alarm"},
        ],
        "bands": [{"low": -10, "high": 10, "text": "allowed"}],
        "yTitle": "Correction [µm]",
        "rightTitle": "Temperature [°C]",
        "time": True,
        **changes,
    }


# ---- charts -------------------------------------------------------------------------------------


def test_a_chart_has_gaps_marks_with_letters_and_a_legend_beside_the_data(browser: Browser) -> None:
    pages = pages_for()
    with opened(browser, pages, "/blank", locale="en-GB") as page:
        page.evaluate(DRAW, hours_chart())
        drawn = page.locator("#probe .chart-line")
        ways = [way.split("M")[1:] for way in attributes(drawn, ".chart-stroke", "d")]
        assert [len(stretches) for stretches in ways] == [2, 2]
        dashes = attributes(drawn, ".chart-stroke", "stroke-dasharray")
        shapes = [way.rpartition("M")[2] for way in attributes(drawn, ".chart-marker", "d")]
        assert len(set(dashes)) == len({shape.partition("m")[2] for shape in shapes}) == 2
        assert texts(page, ".chart-entry") == [
            "Z_um [µm]",
            "T <b>1</b> [°C]",
            "allowed",
            "A\nactive",
            "B\nsensor bad",
            "further marks: 1",  # its neighbour has the letter
        ]
        letters = drawn_texts(page, "#probe .chart-mark-letter")
        assert letters == ["A", "B"]
        box = "document.querySelector('#probe .chart-%s').getBoundingClientRect()"
        plot, legend, tools = (box % part for part in ("plot", "legend", "tools"))
        until(page, f"{legend}.top >= {plot}.bottom - 1 && {tools}.bottom <= {plot}.top + 1")
    assert pages.faults == []


def test_times_are_local_also_in_the_night_in_which_the_clocks_go_back(browser: Browser) -> None:
    ticks = """async ([first, last, most, language]) => {
      const { timeTicks } = await import("/static/chart/time.js");
      return timeTicks(Date.parse(first), Date.parse(last), most, language);
    }"""
    pages = pages_for()
    with opened(browser, pages, "/blank", locale="en-GB") as page:
        night = page.evaluate(ticks, ["2026-10-24T23:00:00Z", "2026-10-25T04:00:00Z", 8, "en-GB"])
        # summer time ends at 01:00 UTC: 02:00 comes twice, the ticks stand once at each full hour
        assert night["texts"] == ["01:00\n25/10", "02:00", "03:00", "04:00", "05:00"]
        steps = [(b - a) / 3.6e6 for a, b in zip(night["at"], night["at"][1:], strict=False)]
        assert steps == [1.0, 2.0, 1.0, 1.0]
        spring = page.evaluate(ticks, ["2026-03-29T00:00:00Z", "2026-03-29T03:00:00Z", 8, "de-DE"])
        assert spring["texts"][0] == "01:00\n29.3."
        assert all(b > a for a, b in zip(spring["at"], spring["at"][1:], strict=False))
        days = page.evaluate(ticks, ["2026-10-20T00:00:00Z", "2026-10-30T00:00:00Z", 12, "de-DE"])
        assert days["texts"] == [f"{day}.10." for day in range(21, 31)]
        year = page.evaluate(ticks, ["2026-01-01T00:00:00Z", "2026-12-31T00:00:00Z", 7, "de-DE"])
        assert 4 <= len(year["texts"]) <= 7
        seconds = page.evaluate(ticks, ["2026-10-20T10:00:00Z", "2026-10-20T10:00:10Z", 6, "en-GB"])
        assert seconds["texts"][1] == "12:00:02"


@pytest.mark.parametrize(("language", "sign"), [("en-GB", "."), ("de-DE", ","), ("cs-CZ", ",")])
def test_the_decimal_sign_at_the_axis_is_that_of_the_language(
    browser: Browser, language: str, sign: str
) -> None:
    pages = pages_for()
    line = {"name": "a", "x": [0, 1, 2], "y": [-0.5, 0.0, 0.5]}
    with opened(browser, pages, "/blank", locale=language) as page:
        page.evaluate(DRAW, {"lines": [line], "xTitle": "h"})
        assert f"\N{MINUS SIGN}0{sign}4" in drawn_texts(page, "#probe .chart-y")
    assert pages.faults == []


def test_tools_are_large_move_the_span_and_tell_it_and_a_still_chart_has_none(
    browser: Browser,
) -> None:
    pages = pages_for()
    with opened(browser, pages, "/blank", locale="en-GB") as page:
        page.evaluate(DRAW, hours_chart())
        buttons = page.locator("#probe .chart-tools button")
        assert buttons.count() == 5
        for k in range(5):
            box = buttons.nth(k).bounding_box()
            assert box is not None
            assert min(box["width"], box["height"]) >= 48.0
        begin, end = (datetime.fromisoformat(f"2026-11-20T{h}:00:00+00:00") for h in ("08", "16"))
        first, last = begin.timestamp() * 1000, end.timestamp() * 1000
        page.get_by_label("Zoom in").click()
        page.get_by_label("Later").click()
        page.get_by_text("All", exact=True).click()
        quarter = (last - first) / 4
        assert page.evaluate("window.spans") == [
            {"first": first + quarter, "last": last - quarter},
            {"first": first + 2 * quarter, "last": last},
            None,
        ]
        page.evaluate(DRAW, hours_chart(still=True))
        assert page.locator("#probe .chart-tools").is_hidden()
    assert pages.faults == []


def test_a_drag_over_the_data_zooms_and_a_point_tells_its_values(browser: Browser) -> None:
    pages = pages_for()
    with opened(browser, pages, "/blank", locale="en-GB") as page:
        page.evaluate(DRAW, hours_chart())
        box = page.locator("#probe .chart-frame").bounding_box()
        assert box is not None
        middle = box["y"] + box["height"] / 2
        page.mouse.move(box["x"] + box["width"] / 2, middle)
        page.wait_for_selector("#probe .chart-entry strong")
        told = [text.replace("\N{MINUS SIGN}", "-") for text in texts(page, ".chart-entry strong")]
        assert [float(value) for value in told] == pytest.approx([4.0, 4.0], abs=0.3)
        page.mouse.move(box["x"] + box["width"] * 0.25, middle)
        page.mouse.down()
        page.mouse.move(box["x"] + box["width"] * 0.75, middle, steps=4)
        page.mouse.up()
        until(page, "window.spans.length === 1")
        span = page.evaluate("window.spans[0]")
        assert (span["last"] - span["first"]) / 3.6e6 == pytest.approx(4.0, rel=0.02)
    assert pages.faults == []


def test_a_theme_and_a_size_that_change_are_drawn_anew(browser: Browser) -> None:
    pages = pages_for()
    color = "getComputedStyle(document.querySelector('#probe .chart-stroke')).stroke"
    width = "Number(document.querySelector('#probe .chart-plot > svg').getAttribute('width'))"
    with opened(browser, pages, "/blank", locale="en-GB", color_scheme="light") as page:
        page.evaluate(DRAW, hours_chart())
        light, wide = page.evaluate(color), page.evaluate(width)
        page.locator("#theme").click()
        until(page, f"{color} !== '{light}'")
        page.set_viewport_size({"width": 700, "height": 600})
        until(page, f"{width} < {wide}")
    assert pages.faults == []


def test_a_chart_without_values_says_so(browser: Browser) -> None:
    pages = pages_for()
    with opened(browser, pages, "/blank", locale="de-DE") as page:
        page.evaluate(DRAW, {"lines": [{"name": "a", "x": [], "y": []}], "time": True})
        assert drawn_texts(page, "#probe svg text") == ["Keine Werte in diesem Zeitraum"]
    assert pages.faults == []


# ---- pages --------------------------------------------------------------------------------------


def test_the_models_page_shows_where_an_input_stands_and_the_loops_weight(browser: Browser) -> None:
    pages = pages_for()
    with opened(browser, pages, "/model", locale="de-DE") as page:
        page.get_by_text("1,2 K außerhalb des geprüften Bereichs").wait_for()
        page.get_by_text("Das Modell wirkt mit 77 % seines Gewichts").wait_for()
        assert page.get_by_text("\N{MINUS SIGN}16,235").count() == 1  # DC gain of the spindle
        assert page.get_by_text("τ 169,1 s").count() == 2
        assert "Ende der längsten Aufzeichnung" in page.locator(".step-chart").inner_text()
        drawn = page.locator(".step-chart .chart-line")
        dashed = [bool(dash) for dash in attributes(drawn, ".chart-stroke", "stroke-dasharray")]
        assert dashed == [False, True, False, True]
        for key in ("End", *8 * ["ArrowLeft"]):  # to where the record still reaches
            page.locator(".step-chart .chart-plot").press(key)
        told = page.locator(".step-chart .chart-entry strong").first.inner_text()
        assert float(told[1:].replace(",", ".")) == pytest.approx(16.2347, abs=0.05)
        assert page.locator("#choose-ask").is_disabled()
        assert page.locator("#choose-why").is_visible()
    assert pages.faults == []


def test_of_another_file_than_the_model_in_force_nothing_is_shown(browser: Browser) -> None:
    pages = pages_for()
    assert pages.feed.status is not None
    pages.feed.status = {**pages.feed.status, "model_sha256": "0" * 64}
    with opened(browser, pages, "/model", locale="en-GB") as page:
        page.get_by_text("The file on this computer has been changed since").wait_for()
        told = page.locator("#model-outputs").inner_text()  # what the status says, none of the file
        assert "ime constant" not in told
        assert "irect gain" not in told
        assert page.locator("#model-provenance").is_hidden()
        pages.feed.status = dict(WARM)
        pages.tell()
        page.get_by_text("1.2 K outside the tested range").wait_for()
        assert page.locator("#model-wrong").is_hidden()
    assert pages.faults == []


def test_the_numbers_of_the_model_before_are_marked_until_the_new_ones_are_there(
    browser: Browser,
) -> None:
    pages = pages_for()
    with opened(browser, pages, "/model", locale="en-GB") as page:
        page.get_by_text("1.2 K outside the tested range").wait_for()
        assert page.locator("#model-old").is_hidden()
        waiting: list[Route] = []
        page.route("**/model/values", lambda route: waiting.append(route))  # noqa: PLW0108 - playwright marks it
        pages.feed.status = {**WARM, "model_sha256": "0" * 64}
        pages.tell()
        page.locator("#model-old").wait_for()
        assert page.locator("#model").get_attribute("data-old") == "yes"
        until(page, "document.getElementById('model-outputs').innerText !== ''")
        pages.tell_until(page, lambda: bool(waiting))
        waiting[0].fulfill(status=500, json={"error": "x", "text": "the file is being replaced"})
        page.get_by_text("the file is being replaced").wait_for()
        assert page.locator("#model-outputs").inner_text() == ""
        assert page.locator("#model-old").is_hidden()
        page.unroute("**/model/values")
        for route in waiting[1:]:
            route.abort()
        pages.feed.status = dict(WARM)
        pages.tell_until(page, page.locator("#model-wrong").is_hidden)
        page.get_by_text("1.2 K outside the tested range").wait_for()


def test_an_engineer_chooses_a_model_after_a_confirmation(browser: Browser) -> None:
    pages = pages_for(Role.ENGINEER)
    with opened(browser, pages, "/model", locale="en-GB") as page:
        page.locator("#choose-ask").click()
        dialog = page.locator("dialog")
        dialog.get_by_text("checks that it fits this machine").wait_for()
        assert pages.asked == []
        dialog.get_by_role("button", name="Model lathe.json").click()
        page.wait_for_selector("[data-requests]")
        assert pages.asked == [(TOKEN, {"method": "ChooseModel", "arguments": ["lathe.json"]})]
    assert pages.faults == []


def test_a_chosen_model_is_effective_when_the_loop_tells_its_name_and_its_hash(
    browser: Browser,
) -> None:
    pages = pages_for(Role.ENGINEER)
    told = pages.feed.status
    assert told is not None
    pages.feed.status = {**told, "model_file": "before.json"}  # the same hash under another name
    with opened(browser, pages, "/model", locale="en-GB") as page:
        page.get_by_text("goes on with the model that it has read").wait_for()
        assert page.inner_text("#model-file") == "before.json"
        shown = page.locator("#model-outputs")
        pages.tell_until(page, lambda: "spindle" in shown.inner_text())  # what the loop tells stays
        page.click("#choose-ask")
        page.click("dialog[open] .main")
        page.wait_for_selector('[data-requests][data-answer="accepted"]')
        place = page.locator("[data-requests]")

        def later(**changes: str) -> None:
            number = (pages.feed.status or told)["number"] + 1
            pages.feed.status = {**told, "number": number, **changes}
            pages.tell()
            page.wait_for_timeout(200)

        later(model_file="before.json")
        assert "✓" not in place.inner_text()
        later(model_file="lathe.json", model_sha256="0" * 64)
        assert "✓" not in place.inner_text()
        later(model_file="lathe.json")
        pages.tell_until(page, lambda: "✓" in place.inner_text())
        assert page.inner_text("#model-file") == "lathe.json"
    assert pages.faults == []


def test_values_that_are_old_get_a_mark_and_lose_their_weight(browser: Browser) -> None:
    pages = pages_for()
    mark = "getComputedStyle(document.querySelector('.sensor h2 .live'), '::after').content"
    with opened(browser, pages, "/sensors", locale="en-GB") as page:
        page.get_by_text("36.0 °C").wait_for()
        assert page.evaluate(mark) == "none"
        pages.feed.why = NO_DATA
        pages.tell()
        until(page, "document.body.dataset.live === 'no'")
        assert page.evaluate(mark) != "none"
        pages.feed.why = ""
        pages.tell()
        until(page, "document.body.dataset.live === 'yes'")
    assert pages.faults == []


def test_the_sensors_page_has_noise_rules_and_conditions(browser: Browser) -> None:
    pages = pages_for()
    with opened(browser, pages, "/sensors", locale="cs-CZ") as page:
        spindle = page.locator('[data-channel="T_spindle_C"]')
        spindle.get_by_text("36,0 °C").wait_for()
        noise = page.locator('[data-channel="T_spindle_C"] tbody td:last-child').first
        pages.tell_until(page, lambda: noise.inner_text().startswith("0,0"))
        assert float(noise.inner_text().replace(",", ".")) == pytest.approx(0.05, rel=0.15)
        assert spindle.get_by_text("5,0 až 80,0 °C").is_visible()
        column = page.locator('[data-channel="T_column_C"]')
        assert column.get_by_text("zatím ne").count() == 2
        assert page.locator("#conditions .verdict[data-good=yes]").count() == 5
        assert page.locator(".sensor").count() == len(CHANNELS)
    assert pages.faults == []


@pytest.mark.parametrize("path", ["/model", "/sensors"])
@pytest.mark.parametrize(
    ("size", "theme"), [((1024, 600), "light"), ((1366, 768), "dark"), ((1920, 1080), "light")]
)
def test_no_page_is_wider_than_the_screen(
    browser: Browser, path: str, size: tuple[int, int], theme: Any
) -> None:
    pages = pages_for(Role.ENGINEER)
    viewport = {"width": size[0], "height": size[1]}
    with opened(
        browser, pages, path, locale="de-DE", viewport=viewport, color_scheme=theme
    ) as page:
        page.wait_for_selector(".chart-plot svg")
        assert page.evaluate("document.querySelector('main').scrollWidth") <= size[0]
        small = page.evaluate(
            "[...document.querySelectorAll('main button, main select')].filter(e => e.offsetParent)"
            ".filter(e => e.getBoundingClientRect().height < 48).map(e => e.textContent)"
        )
        assert small == []
    assert pages.faults == []


SEEN = """() => {
  const found = [];
  const walker = document.createTreeWalker(document.querySelector("main"), NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const text = walker.currentNode.textContent.trim();
    let at = walker.currentNode.parentElement;
    if (!text || !at.getClientRects().length || at.closest("svg, select, .chart")) continue;
    let marked = parseFloat(getComputedStyle(at).fontSize) === 0;
    for (; at; at = at.parentElement) {
      marked ||= getComputedStyle(at).textDecorationStyle === "dotted";
    }
    found.push([text, marked]);
  }
  return found;
}"""


def otherwise(told: Any) -> Any:
    """Return the same with every number, flag and judgement another one."""
    if isinstance(told, dict):
        return {key: otherwise(value) for key, value in told.items()}
    if isinstance(told, bool):
        return not told
    if isinstance(told, float):
        return told + 31.7
    return "the value jumped" if told == "good" else "Bad" if told == "Good" else told


@pytest.mark.parametrize("path", ["/model", "/sensors"])
def test_what_changes_with_the_loop_is_marked_as_old_without_it(
    browser: Browser, path: str
) -> None:
    pages = pages_for()
    with opened(browser, pages, path, locale="en-GB") as page:
        kept = pages.feed.status
        assert kept is not None
        page.wait_for_selector("#model-outputs .output" if path == "/model" else ".sensor")
        pages.tell_until(page, lambda: page.locator("[data-good]").count() > 2)
        page.wait_for_load_state("networkidle")
        before = page.evaluate(SEEN)
        parts = ("outputs", "inputs", "signals")
        pages.feed.status = {**kept, **{part: otherwise(kept[part]) for part in parts}}
        changed: set[int] = set()

        def other() -> bool:
            now = page.evaluate(SEEN)
            assert len(now) == len(before)
            changed.update(k for k, (text, _) in enumerate(now) if text != before[k][0])
            return len(changed) > 8

        pages.tell_until(page, other)
        pages.feed.why = NO_DATA
        pages.tell_until(page, lambda: page.get_attribute("body", "data-live") == "no")
        old = page.evaluate(SEEN)
        assert [old[k][0] for k in sorted(changed) if not old[k][1]] == []
    assert pages.faults == []


def test_marks_say_the_weightiest_first_and_what_was_asked_for_stands_apart(
    browser: Browser,
) -> None:
    begin = 1_763_700_000_000
    hour = 3_600_000
    near = [
        {"x": begin + hour + 1000 * k, "text": "Active", "kind": "state", "rank": 1}
        for k in range(5)
    ]
    marks = [
        *near,
        {"x": begin + hour + 9000, "text": "Sensor broken", "kind": "alarm", "rank": 0},
        {"x": begin + hour + 9500, "text": "Trim (novak)", "kind": "request", "rank": 4},
        *({"x": begin + k * hour, "text": f"gone {k}", "rank": 5} for k in range(3, 7)),
    ]
    lines = [{"name": "Z_um", "x": [begin, begin + 8 * hour], "y": [0.0, 1.0]}]
    pages = pages_for()
    with opened(browser, pages, "/blank", locale="en-GB") as page:
        page.evaluate(DRAW, {"lines": lines, "marks": marks, "time": True, "marksListed": 3})
        assert texts(page, ".chart-entry")[1:] == [
            "A\nSensor broken",
            "B\ngone 6",
            "1\nTrim (novak)",
            "further marks: 8",
        ]
        assert drawn_texts(page, "#probe .chart-mark-letter") == ["A", "B", "1"]
    assert pages.faults == []
