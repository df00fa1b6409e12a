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


@pytest.mark.parametrize(("path", "question"), [("/history", "trend"), ("/probe", "values")])
def test_what_stays_after_a_refused_span_is_marked_as_that_of_the_former_one(
    look: Callable[..., Looked], path: str, question: str
) -> None:
    page = look("engineer").open(path)
    page.wait_for_selector("#chart[data-drawn]")
    said = page.inner_text("#from-said")
    former = page.locator("#former")
    assert not former.is_visible()
    page.route(f"**{path}/{question}*", refuse)
    fill(page, "2026-01-02T03:00:00", "2026-01-02T04:00:00")
    former.wait_for()
    assert page.inner_text("#wrong") == "This took too long."
    assert f"still those from {said}" in former.inner_text()
    assert page.get_attribute("main", "data-former") == "yes"
    page.unroute(f"**{path}/{question}*")
    fill(page, "2026-01-02T05:00:00", "2026-01-02T04:00:00")  # this is no span at all
    assert f"still those from {said}" in former.inner_text()
    page.click("button[data-hours='1']")
    former.wait_for(state="hidden")
    assert page.get_attribute("main", "data-former") == "no"


def test_what_stays_after_a_refused_choice_is_marked_as_that_of_the_former_one(
    look: Callable[..., Looked],
) -> None:
    page = look("engineer").open("/probe")
    page.wait_for_selector("#chart[data-drawn]")
    former = page.locator("#former")
    page.evaluate("document.getElementById('which').add(new Option('X', 'X_um'))")
    page.select_option("#which", "X_um")  # no probe of this machine
    former.wait_for()
    assert former.inner_text().endswith("of Z.")
    assert page.get_attribute("main", "data-former") == "yes"
    page.select_option("#which", "Z_um")
    former.wait_for(state="hidden")

    page = look("engineer").open("/history")
    page.wait_for_selector("#chart[data-drawn]")
    former = page.locator("#former")
    name = page.locator("#series button[aria-pressed=true]").first.inner_text()
    drawn = page.locator("#series button").filter(has_text=name).first
    page.route("**/history/trend*", refuse)
    drawn.click()
    former.wait_for()
    assert f" of {name.partition(' [')[0]}, " in former.inner_text()
    drawn.click()  # as before: what stands there is of it
    former.wait_for(state="hidden")
    page.click("#second-day")
    former.wait_for()
    page.unroute("**/history/trend*")
    page.click("#second-off")
    former.wait_for(state="hidden")


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
