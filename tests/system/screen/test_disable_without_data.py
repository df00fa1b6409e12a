"""To disable is the safe direction: it is asked without data too, and said as such."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, BrowserContext, Page

from tests.system.screen.operator_browser import LOCALES, SCROLLS
from tests.system.screen.operator_stand_in import StandIn, an_output, made_up
from thermaxis.codes import Message
from thermaxis.messages import sentence
from thermaxis.runtime import Role
from thermaxis.screen.access import LOOP_GONE, NO_ANSWER, Answer, Outcome

OTHERS = ("Enable", "Hold", "Resume", "Trim", "Diameter", "Acknowledge")

# Whether a line of the requests stands above what covers the rest of them.
IN_SIGHT = """(place, text) => {
  const line = [...place.children].find((one) => one.textContent.endsWith(text));
  const top = place.getBoundingClientRect().top;
  return line.clientHeight > 0
    && line.getBoundingClientRect().bottom - top <= place.clientHeight + 1;
}"""


@pytest.fixture
def context(browser: Browser) -> Iterator[BrowserContext]:
    found = browser.new_context(viewport={"width": 1024, "height": 600}, locale="en-GB")
    yield found
    found.close()


def blind(context: BrowserContext, stand_in: StandIn) -> Page:
    """Return the operator's page after its data have ended."""
    page = context.new_page()
    page.goto(stand_in.address)
    page.wait_for_selector('body[data-live="yes"]')
    stand_in.live = False
    page.wait_for_selector('body[data-live="no"]')
    return page


def disable(page: Page) -> None:
    page.click('[data-ask="Disable"]')
    page.click("dialog[open] .main")


def test_without_data_disable_alone_is_offered_and_reaches_the_loop(
    context: BrowserContext, stand_in: StandIn
) -> None:
    page = blind(context, stand_in)
    assert page.locator('[data-ask="Disable"]').is_enabled()
    for name in OTHERS:
        assert page.locator(f'[data-ask="{name}"]').is_disabled(), name
    assert page.inner_text("#asks-why") == "No data: only Disable can be asked."
    page.click('[data-ask="Disable"]')
    told = page.inner_text("dialog[open]")
    assert "does not see what the compensation does now" in told
    assert "look at the control's own offset" in told
    assert stand_in.asked == []
    page.click("dialog[open] .main")
    page.wait_for_selector('[data-requests][data-answer="accepted"]')
    assert stand_in.asked == [("Disable", ())]


def test_without_data_it_is_not_called_effective_before_a_status_shows_it(
    context: BrowserContext, stand_in: StandIn
) -> None:
    page = blind(context, stand_in)
    disable(page)
    line = page.locator("[data-requests]")
    line.get_by_text("effect not known").wait_for()
    stand_in.status = made_up(state="Fading", enabled=False)
    stand_in.live = True
    line.get_by_text("not yet effective").wait_for()
    assert "✓" not in line.inner_text()
    rest = {"correction_um": 0.0, "acting_um": 0.0}
    stand_in.status = made_up(state="Off", outputs=()) | {"outputs": {"Z_um": an_output(**rest)}}
    line.get_by_text("✓ effective").wait_for()


def test_a_question_that_is_open_as_the_data_end_can_still_be_confirmed_if_it_is_to_disable(
    context: BrowserContext, stand_in: StandIn
) -> None:
    page = context.new_page()
    page.goto(stand_in.address)
    page.wait_for_selector('body[data-live="yes"]')
    page.click('[data-ask="Disable"]')
    page.locator("dialog[open]").get_by_text("fades to zero at").wait_for()
    stand_in.live = False
    page.locator("dialog[open]").get_by_text("does not see what").wait_for()
    assert "fades to zero at" not in page.inner_text("dialog[open]"), "old numbers stand"
    page.click("dialog[open] .main")
    page.wait_for_selector('[data-requests][data-answer="accepted"]')
    assert stand_in.asked == [("Disable", ())]


def test_a_question_for_anything_else_is_stopped_as_the_data_end(
    context: BrowserContext, stand_in: StandIn
) -> None:
    page = context.new_page()
    page.goto(stand_in.address)
    page.wait_for_selector('body[data-live="yes"]')
    page.click('[data-ask="Hold"]')
    assert page.locator("dialog[open] .main").is_enabled()
    stand_in.live = False
    page.wait_for_selector("dialog[open] .main:disabled")
    assert "No data" in page.inner_text("dialog[open]")
    stand_in.live = True
    page.wait_for_selector("dialog[open] .main:enabled")


def test_a_request_that_does_not_leave_the_page_is_said_so(
    context: BrowserContext, stand_in: StandIn
) -> None:
    page = blind(context, stand_in)
    page.route("**/ask", lambda route: route.abort())
    disable(page)
    page.wait_for_selector('[data-requests][data-answer="unknown"]')
    said = page.text_content("[data-requests]") or ""
    assert "the request may never have been sent" in said
    assert "effect not known" in said
    assert stand_in.asked == []


def test_a_session_that_is_gone_refuses_and_a_silent_loop_leaves_it_open(
    context: BrowserContext, stand_in: StandIn
) -> None:
    page = blind(context, stand_in)
    stand_in.answer = Outcome(Answer.REFUSED, Message(LOOP_GONE))
    disable(page)
    page.wait_for_selector('[data-requests][data-answer="refused"]')
    assert "it is opened again by itself" in (page.text_content("[data-requests]") or "")
    stand_in.answer = Outcome(Answer.UNKNOWN, Message(NO_ANSWER))
    disable(page)
    page.wait_for_selector('[data-requests][data-answer="unknown"]')
    assert "it may still take effect" in (page.text_content("[data-requests]") or "")


def test_who_may_only_look_cannot_disable_without_data_either(
    context: BrowserContext, stand_in: StandIn
) -> None:
    stand_in.role = Role.VIEWER
    page = blind(context, stand_in)
    assert page.locator(".op-buttons button:enabled").count() == 0
    assert "log in as operator" in page.inner_text("#asks-why")


@pytest.mark.parametrize("language", LOCALES)
def test_the_page_without_data_fits_on_the_smallest_screen(
    browser: Browser, stand_in: StandIn, language: str
) -> None:
    size = {"width": 1024, "height": 600}
    with browser.new_context(viewport=size, locale=LOCALES[language]) as context:
        page = blind(context, stand_in)
        disable(page)
        page.wait_for_selector('[data-requests][data-answer="accepted"]')
        assert max(page.evaluate(SCROLLS)) <= 0
        wide = (
            "[...document.querySelectorAll('.op-asks :not(#request)')].some(e => e.clientWidth > 0"
        )
        assert not page.evaluate(f"{wide} && e.scrollWidth > e.clientWidth + 1)")
        last = page.locator(".op-buttons button").last.bounding_box()
        room = page.locator(".op-buttons").bounding_box()
        assert last is not None
        assert room is not None
        assert last["y"] + last["height"] <= room["y"] + room["height"] + 1, "a button is cut"
        safe = page.locator('[data-ask="Disable"]').bounding_box()
        assert safe is not None
        assert safe["height"] >= 48, "too small for a glove"
        unknown = sentence("operator-effective_unknown", language=language)
        page.locator("#request").get_by_text(unknown).wait_for()
        assert page.locator("#request").evaluate(IN_SIGHT, unknown)
        page.click('[data-ask="Disable"]')
        box = page.locator("dialog[open]").bounding_box()
        assert box is not None
        assert box["y"] >= 0
        assert box["y"] + box["height"] <= 600
