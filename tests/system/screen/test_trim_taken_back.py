"""A trim can be taken back in every state, and nothing is asked of an output that is no more."""

from dataclasses import replace
from typing import Any

import pytest
from playwright.sync_api import Browser, Page

from tests.system.screen import operator_stand_in
from tests.system.screen.operator_browser import TRIM, context_of, opened, shown, trimmed
from tests.system.screen.operator_stand_in import StandIn, made_up, served
from thermaxis.runtime import read_machine
from thermaxis.web import static_address

pytestmark = pytest.mark.system

FAULT: dict[str, Any] = {
    "state": "Fault",
    "reasons": ["double_compensation"],
}


def ready(page: Page) -> bool:
    """Return whether the dialog can be confirmed."""
    return page.locator("dialog[open] .main").is_enabled()


def test_in_fault_a_trim_can_be_taken_back_and_none_can_be_set(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, wrong = opened(context, stand_in)
        button = page.locator('[data-ask="Trim"]')
        shown(page, stand_in, made_up(**FAULT))
        assert button.is_disabled()
        assert "acknowledge first" in button.inner_text()
        shown(page, stand_in, trimmed(**FAULT))
        assert button.is_enabled()
        button.click()
        assert page.inner_text("dialog output") == "0.0\xa0µm"
        steps = page.locator("dialog .op-steps button")
        assert [steps.nth(k).is_enabled() for k in range(steps.count())] == [False] * 4
        page.click("dialog .main")
        text = page.inner_text("dialog[open]")
        assert "the trim of svoboda, +5.0 µm, is taken back" in text
        assert "as soon as the compensation is active" not in text
        page.click("dialog .main")
        page.wait_for_selector('#request[data-answer="accepted"]')
        assert stand_in.asked == [("Trim", ("Z_um", 0.0, 3600.0))]
        assert wrong == []


def test_a_trim_is_for_the_axis_that_is_chosen_and_begins_with_what_is_set_there(
    browser: Browser, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = read_machine(operator_stand_in.EXAMPLE)
    two = replace(machine, outputs=dict.fromkeys(("X_um", "Z_um"), machine.outputs["Z_um"]))
    monkeypatch.setattr(operator_stand_in, "read_machine", lambda _: two)
    told = made_up(outputs=("X_um", "Z_um"))
    told["outputs"]["Z_um"] |= TRIM
    with served(StandIn(told)) as stand_in, context_of(browser, "en") as context:
        page, wrong = opened(context, stand_in)
        page.wait_for_selector('body[data-live="yes"]')
        page.click('[data-ask="Trim"]')
        value = page.locator("dialog output")
        assert value.inner_text() == "0.0\xa0µm"
        page.click("dialog label:has-text('Z')")
        assert value.inner_text() == "+5.0\xa0µm"
        page.click("dialog .op-steps button:has-text('−1')")
        page.click("dialog .main")
        page.click("dialog .main")
        page.wait_for_selector('#request[data-answer="accepted"]')
        assert stand_in.asked == [("Trim", ("Z_um", 4.0, 3600.0))]
        assert wrong == []


def test_a_trim_that_was_chosen_before_a_fault_cannot_be_asked_in_it(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        shown(page, stand_in, trimmed())
        page.click('[data-ask="Trim"]')
        page.click("dialog .op-steps button:has-text('−1')")
        page.click("dialog .main")
        assert ready(page)
        shown(page, stand_in, trimmed(**FAULT))
        page.get_by_text("nothing to ask for any more: acknowledge first").wait_for()
        assert not ready(page)
        shown(page, stand_in, trimmed())
        page.wait_for_function("!document.querySelector('dialog[open] .main').disabled")


def test_what_somebody_else_has_taken_back_is_not_asked_for_again(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        shown(page, stand_in, trimmed())
        page.click('[data-ask="Trim"]')
        page.click("dialog .op-steps + button")
        page.click("dialog .main")
        assert ready(page)
        shown(page, stand_in, made_up())
        page.get_by_text("nothing to ask for any more: no trim is set").wait_for()
        assert not ready(page)


def test_a_confirmation_whose_output_is_no_more_says_so_and_cannot_be_confirmed(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, wrong = opened(context, stand_in)
        page.click('[data-ask="Trim"]')
        page.click("dialog .op-steps button:has-text('+1')")
        page.click("dialog .main")
        assert ready(page)
        shown(page, stand_in, made_up(outputs=("X_um",)))
        page.get_by_text("nothing to ask for any more: this output is no more").wait_for()
        assert not ready(page)
        assert wrong == []


def test_a_confirmation_that_cannot_be_drawn_cannot_be_confirmed(
    browser: Browser, stand_in: StandIn
) -> None:
    script = """async () => {
      const { ask } = await import("ASK");
      let known = true;
      const text = () => { if (known) return ["it is known"]; throw new Error("not any more"); };
      void ask("Hold", [], { title: "Hold", text });
      const confirm = document.querySelector("dialog[open] .main");
      const before = confirm.disabled;
      known = false;
      await new Promise((go) => { addEventListener("error", go, { once: true }); });
      return [before, confirm.disabled];
    }""".replace("ASK", static_address("ask/ask.js"))
    with context_of(browser, "en") as context:
        page, wrong = opened(context, stand_in)
        page.wait_for_selector('body[data-live="yes"]')
        assert page.evaluate(script) == [False, True]
        assert any("not any more" in one for one in wrong)
