"""A span that is refused never gets the chart and the events of another one without a word."""

import json
from collections.abc import Callable

import pytest
from playwright.sync_api import Page, Route

from tests.system.screen.conftest import Looked

pytestmark = pytest.mark.system
REFUSAL = json.dumps({"error": "history.too_long", "text": "This took too long."})


def refuse(route: Route) -> None:
    """Answer as the screen does where the history took too long."""
    route.fulfill(status=503, content_type="application/json", body=REFUSAL)


def fill(page: Page, first: str, last: str) -> None:
    """State a span and ask for it."""
    page.fill("#from", first)
    page.fill("#to", last)
    page.click("#span button[type=submit]")


def marked(page: Page) -> bool:
    """Return whether what is shown is marked as that of before, in words and by its looks."""
    former = page.get_attribute("main", "data-former") == "yes"
    assert ("still those of before" in page.text_content("#wrong")) is former
    return former


def is_marked(page: Page, former: str) -> None:
    page.wait_for_selector(f"main[data-former={former}]")
    assert marked(page) is (former == "yes")


@pytest.mark.parametrize(("path", "question"), [("/history", "trend"), ("/probe", "values")])
def test_what_stays_after_a_refused_span_is_marked_as_that_of_before(
    look: Callable[..., Looked], path: str, question: str
) -> None:
    page = look("engineer").open(path)
    page.wait_for_selector("#chart[data-drawn]")
    is_marked(page, "no")
    page.route(f"**{path}/{question}*", refuse)
    fill(page, "2026-01-02T03:00:00", "2026-01-02T04:00:00")
    is_marked(page, "yes")
    said = page.inner_text("#wrong")
    assert said.startswith("This took too long. Chart")
    assert "02/01/2026" not in said  # but the span that the chart is of
    page.unroute(f"**{path}/{question}*")
    fill(page, "2026-01-02T05:00:00", "2026-01-02T04:00:00")  # this is no span at all
    page.get_by_text("no span of time").wait_for()
    assert marked(page)
    page.click("button[data-hours='1']")
    is_marked(page, "no")


def test_what_stays_after_a_refused_choice_is_marked_as_that_of_before(
    look: Callable[..., Looked],
) -> None:
    page = look("engineer").open("/probe")
    page.wait_for_selector("#chart[data-drawn]")
    page.evaluate("document.getElementById('which').add(new Option('X', 'X_um'))")
    page.select_option("#which", "X_um")  # no probe of this machine
    is_marked(page, "yes")
    page.select_option("#which", "Z_um")
    is_marked(page, "no")

    page = look("engineer").open("/history")
    page.wait_for_selector("#chart[data-drawn]")
    page.route("**/history/trend*", refuse)
    page.locator("#series button[aria-pressed=true]").first.click()
    is_marked(page, "yes")
    page.unroute("**/history/trend*")
    page.fill("#days", "1")
    page.press("#days", "Enter")
    is_marked(page, "no")


def test_a_fault_of_the_table_of_events_takes_no_chart_and_is_no_word_for_people(
    look: Callable[..., Looked],
) -> None:
    page = look("engineer").open("/history")
    page.wait_for_selector("#chart[data-drawn]")
    before = int(page.get_attribute("#chart", "data-drawn") or "0")
    page.evaluate("document.getElementById('events').remove()")
    page.click("button[data-hours='1']")
    page.wait_for_function(
        "before => Number(document.getElementById('chart').dataset.drawn) > before", arg=before
    )
    assert page.locator("#wrong").is_hidden()
