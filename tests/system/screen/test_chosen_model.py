"""The choice of a model stays with the person."""

from typing import Any

import pytest
from playwright.sync_api import Browser, Page, Route

from tests.system.screen.engineer_browser import opened
from tests.system.screen.stand import wait_until
from tests.system.screen.test_chart import WARM, pages_for
from thermaxis.runtime import Role

pytestmark = pytest.mark.system
END = "</option>"


def with_another(page: Page) -> dict[str, Any]:
    """Return what the server tells of the model, with a second one to choose."""
    found: dict[str, Any] = page.evaluate("fetch('/model/values').then((answer) => answer.json())")
    return found | {"choices": found["choices"].replace(END, f"{END}<option>other.json{END}")}


def test_what_a_person_has_chosen_stays_as_the_values_come_anew_while_it_is_there(
    browser: Browser,
) -> None:
    pages = pages_for(Role.ENGINEER)
    with opened(browser, pages, "/model", locale="en-GB") as page:
        page.locator("#choose-ask").wait_for()
        values = with_another(page)
        loads: list[str] = []

        def answer(route: Route) -> None:
            loads.append("load")
            route.fulfill(json=values)

        def loaded(diameter_mm: float) -> None:
            count = len(loads)
            pages.feed.status = {**WARM, "diameter_mm": diameter_mm}
            pages.tell_until(page, lambda: len(loads) > count)
            page.wait_for_timeout(200)

        page.route("**/model/values", answer)
        choice = page.locator("#choice")
        loaded(1300.0)
        assert choice.input_value() == "lathe.json"
        choice.select_option("other.json")
        loaded(1400.0)
        assert choice.input_value() == "other.json"
        values["choices"] = values["choices"].replace(f"<option>other.json{END}", "")
        loaded(1500.0)
        assert choice.input_value() == "lathe.json"
    assert pages.faults == []


def test_two_quick_clicks_on_a_choice_ask_once(browser: Browser) -> None:
    pages = pages_for(Role.ENGINEER)
    with opened(browser, pages, "/model", locale="en-GB") as page:
        page.locator("#choose-ask").wait_for()
        waiting: list[Route] = []
        page.route("**/model/values", lambda route: waiting.append(route))  # noqa: PLW0108 - playwright marks it
        page.evaluate("for (const _ of [1, 2]) document.getElementById('choose').requestSubmit()")
        wait_until("it is asked", lambda: bool(page.evaluate("1") and waiting))
        assert len(waiting) == 1
        page.unroute("**/model/values")
        waiting[0].fallback()
        page.wait_for_selector("dialog[open]")
        page.wait_for_timeout(200)
        assert page.locator("dialog").count() == 1
        page.keyboard.press("Escape")
        page.wait_for_selector("dialog", state="detached")
        page.click("#choose-ask")  # it can be asked again
        page.wait_for_selector("dialog[open]")
    assert pages.faults == []
