"""What a confirmation says before it is asked, and how far a request came, from page to page."""

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.system.screen.operator_browser import (
    LOCALES,
    ask,
    context_of,
    drawn,
    opened,
    shown,
    trimmed,
)
from tests.system.screen.operator_stand_in import StandIn, made_up
from thermaxis.codes import Message
from thermaxis.messages import as_sentence, sentence, sentence_of
from thermaxis.runtime import Role
from thermaxis.screen.access import Answer, Outcome
from thermaxis.web import static_address

pytestmark = pytest.mark.system

HELD = Message("answer-held", {"longest_s": 3600.0})
CHOSEN = """async () => {
  const { begin, take } = await import("REQUESTS");
  const asked = begin("ChooseModel", ["new.json"], null);
  take(asked, { kind: "accepted", reason: {} });
}""".replace("REQUESTS", static_address("ask/requests.js"))


def said(page: Page, button: str) -> str:
    """Return what the dialog of a button says, and leave it."""
    page.click(f'[data-ask="{button}"]')
    text = page.inner_text("dialog[open]")
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog", state="detached")
    return text


def row_of(page: Page, key: str) -> str:
    """Return a row of the first axis in the dialog of all corrections."""
    page.click(".op-card:first-child")
    text = page.inner_text(f'dialog [data-row="{key}"]')
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog", state="detached")
    return text.replace("\n", " ")


@pytest.mark.parametrize(
    ("language", "model", "trim"),
    [
        ("en", "The model asks for −35.5 µm now.", "The trim of svoboda adds +5.0 µm."),
        ("de", "Das Modell verlangt jetzt −35,5 µm.", "Die Trimmung von svoboda fügt +5,0 µm"),
        ("cs", "Model nyní žádá −35,5 µm.", "Ruční posun (vlastník: svoboda) přidává +5,0 µm."),
    ],
)
def test_what_the_model_asks_for_and_what_a_person_adds_are_told_apart(
    browser: Browser, stand_in: StandIn, language: str, model: str, trim: str
) -> None:
    with context_of(browser, language) as context:
        page, _ = opened(context, stand_in)
        for button, state, reason in (
            ("Enable", "Off", "disabled"),
            ("Resume", "Holding", "operator_hold"),
        ):
            shown(page, stand_in, trimmed(state=state, reasons=[reason]))
            text = said(page, button)
            assert model in text
            assert trim in text
        comma = language != "en"
        told = trimmed()
        told["outputs"]["Z_um"] |= {"accepted_age_s": 61.0, "effective_age_s": None}
        shown(page, stand_in, told)
        assert "1\xa0min 1\xa0s" in row_of(page, "accepted")
        assert row_of(page, "effective").endswith("µm")
        assert ("−35,5" if comma else "−35.5") in row_of(page, "model")
        assert ("−30,5" if comma else "−30.5") in row_of(page, "wanted")


def test_a_model_beyond_the_limit_is_said_so_before_the_correction_is_there(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        told = made_up(state="Holding", reasons=["operator_hold"])
        told["outputs"]["Z_um"] |= {"at_limit": True, "correction_um": 18.0, "model_um": -310.0}
        shown(page, stand_in, told)
        card = page.locator(".op-card:first-child")
        assert "model over the limit ±280 µm" in card.inner_text()
        assert "at the limit" not in card.inner_text()
        fill = "getComputedStyle(document.querySelector('[data-row=sum] i')).backgroundColor"
        quiet = page.evaluate(fill)
        resume = said(page, "Resume")
        assert "asks for +310.0 µm now, more than the limit of ±280.0 µm" in resume
        told["outputs"]["Z_um"] |= {"correction_um": 280.0, "at_soft_limit": True}
        shown(page, stand_in, told)
        assert page.evaluate(fill) != quiet


def test_whose_trim_is_replaced_or_taken_back_stands_in_the_confirmation(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        shown(page, stand_in, trimmed())
        page.click('[data-ask="Trim"]')
        assert "+5.0 µm by svoboda, 40\xa0min left" in page.inner_text("dialog[open]")
        page.click("dialog .op-steps button:has-text('−1')")
        page.click("dialog .main")
        text = page.inner_text("dialog[open]")
        assert "the trim of svoboda, +5.0 µm, is replaced by +4.0 µm" in text
        page.keyboard.press("Escape")
        page.wait_for_selector("dialog", state="detached")
        page.click('[data-ask="Trim"]')
        page.click("dialog .op-steps + button")
        page.click("dialog .main")
        text = page.inner_text("dialog[open]")
        assert "the trim of svoboda, +5.0 µm, is taken back" in text
        assert stand_in.asked == []


@pytest.mark.parametrize(
    ("language", "inside", "beyond"),
    [
        ("en", "at 1500.25 mm.", "as at its end at 3000 mm."),
        ("de", "bei 1500,25 mm.", "wie an ihrem Ende bei 3000 mm."),
        ("cs", "při 1500,25 mm", "jako na jejím konci při 3000 mm."),
    ],
)
def test_a_diameter_beyond_the_models_table_says_what_counts(
    browser: Browser, stand_in: StandIn, language: str, inside: str, beyond: str
) -> None:
    with context_of(browser, language) as context:
        page, _ = opened(context, stand_in)
        for typed, expected, gain_of_end in (("1500.25", inside, False), ("99999.9", beyond, True)):
            page.click('[data-ask="Diameter"]')
            page.fill("dialog input", typed)
            page.click("dialog .main")
            text = page.inner_text("dialog[open]").replace("\xa0", " ")
            assert expected in text
            assert (beyond in text) is gain_of_end
            assert sentence("operator-diameter_follows", language=language) in text
            page.keyboard.press("Escape")
            page.wait_for_selector("dialog", state="detached")
        shown(page, stand_in, made_up(diameter_mm=1500.5))
        assert page.inner_text("#diameter-told").replace(",", ".") == "1500.5\xa0mm"


def test_another_model_is_effective_only_once_the_compensation_follows_it(
    browser: Browser, stand_in: StandIn
) -> None:
    mine = {"model_file": "new.json"}
    settles = ["settling"]
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        page.evaluate(CHOSEN)
        for told, expected in (
            (made_up(), "not yet effective"),
            (made_up(state="Holding", reasons=settles, **mine), "loaded, settling"),
            (made_up(state="Warming", reasons=settles, **mine), "loaded, settling"),
            (
                made_up(state="Off", reasons=["disabled"], **mine),
                "loaded; acts once the compensation is active",
            ),
            (made_up(**mine), "✓ effective"),
        ):
            shown(page, stand_in, told)
            assert expected in (page.text_content("#request .ask-stands") or "")


@pytest.mark.parametrize("language", LOCALES)
def test_the_last_requests_stay_from_page_to_page_and_go_on_being_watched(
    browser: Browser, stand_in: StandIn, language: str
) -> None:
    stand_in.answer = Outcome(Answer.ACCEPTED, HELD)
    with context_of(browser, language) as context:
        page, wrong = opened(context, stand_in)
        ask(page, "Hold")
        before = page.text_content("#request b")
        page.goto(stand_in.address + "/login")
        page.goto(stand_in.address + "/")
        page.wait_for_selector('#request[data-answer="accepted"]')
        assert page.text_content("#request b") == before
        assert "✓" not in (page.text_content("#request") or "")
        shown(page, stand_in, made_up(state="Holding", reasons=["operator_hold"]))
        page.wait_for_function("document.getElementById('request').textContent.includes('✓')")
        page.reload()
        page.wait_for_selector("#request b")
        assert "✓" in (page.text_content("#request") or "")
        other = "cs" if language == "de" else "de"
        with page.expect_navigation():
            page.select_option("#language", other)
        texts = page.locator("#request > *")
        expect(texts.first).to_have_text(sentence("operator-hold", language=other))
        expect(texts.last).to_have_text(as_sentence(sentence_of(HELD, language=other)))
        assert wrong == []


def test_a_request_that_waited_when_its_page_was_left_may_still_take_effect(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        page.route("**/ask", lambda _: None)  # never answered
        page.click('[data-ask="Hold"]')
        page.click("dialog .main")
        page.wait_for_selector('#request[data-answer="waits"]')
        page.goto(stand_in.address + "/")
        page.wait_for_selector('#request[data-answer="unknown"]')
        assert "no answer; it may still take effect" in (page.text_content("#request") or "")


def test_another_person_in_the_same_window_finds_no_requests_of_somebody_else(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        ask(page, "Hold")
        stand_in.people.come(Role.OPERATOR, name="svoboda")  # the page loads itself again
        page.wait_for_selector('body[data-name="svoboda"]')
        page.wait_for_selector(".op-card")
        drawn(page)
        assert page.text_content("#request") == ""
        assert page.evaluate("sessionStorage.length") <= 1  # the empty list of who looks now


def test_after_a_log_out_the_list_of_requests_begins_anew(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        ask(page, "Hold")
        with page.expect_navigation():
            page.click("#logout")
        page.wait_for_selector(".op-card")  # the stand-in lets the same person in again
        assert page.text_content("#request") == ""
