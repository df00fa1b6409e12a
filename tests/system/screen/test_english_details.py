"""Details that come in English are marked so on pages of other languages, and said once."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, Page

from tests.system.screen.conftest import Looked
from tests.system.screen.operator_browser import LOCALES
from tests.system.screen.operator_stand_in import StandIn, made_up, served
from thermaxis.codes import Message
from thermaxis.messages import sentence, template
from thermaxis.screen.access import Answer, Outcome

Look = Callable[..., Looked]
FINDING = "[input.T_spindle_C]: the server does not know the node. Look at the address."
EXAMPLES = Path(__file__).parents[3] / "examples"
RUN = EXAMPLES / "x_axis_100_cycles.csv"
MARKED = "[...document.querySelectorAll('%s [lang=en]')].map(e => e.textContent)"


def an_alarm(text: str, code: str = "", **values: object) -> dict[str, object]:
    since = "2026-11-21T09:00:00.000+00:00"
    said = {"text": text, "cause": "A cause.", "remedy": "A remedy."}
    return {"key": text, "priority": "high", "since": since, "code": code, "values": values, **said}


@pytest.fixture
def stand_in() -> Iterator[StandIn]:
    alarms = (
        an_alarm(FINDING, "self_test", finding=FINDING),
        an_alarm("Something that this screen does not know."),
    )
    with served(StandIn(made_up(alarms=alarms))) as found:
        yield found


@pytest.fixture(params=LOCALES)
def language(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def context(browser: Browser, language: str) -> Iterator[BrowserContext]:
    found = browser.new_context(locale=LOCALES[language])
    yield found
    found.close()


def opened(context: BrowserContext, stand_in: StandIn) -> Page:
    page = context.new_page()
    page.goto(stand_in.address)
    page.wait_for_selector('body[data-live="yes"]')
    return page


def test_the_sentence_of_a_self_test_is_marked_in_banner_and_list(
    context: BrowserContext, stand_in: StandIn, language: str
) -> None:
    page = opened(context, stand_in)
    page.locator("#alarm-text").get_by_text("does not know the node").wait_for()
    foreign = language != "en"
    assert page.evaluate(MARKED % "#alarm-text") == ([FINDING] if foreign else [])
    page.click("#alarm")
    page.wait_for_selector("dialog .op-alarm-item")
    whole = ["Something that this screen does not know.", "A cause.", "A remedy."]
    assert page.evaluate(MARKED % "dialog") == ([FINDING, *whole] if foreign else [])
    note = page.get_by_text(sentence("common-details_english", language=language))
    assert note.count() == (1 if foreign else 0)


def test_a_reason_without_a_translation_is_marked_in_the_line_and_where_it_is_shown_whole(
    context: BrowserContext, stand_in: StandIn, language: str
) -> None:
    why = "the model is no JSON"
    stand_in.answer = Outcome(Answer.REFUSED, Message("answer-model_unusable", {"why": why}))
    page = opened(context, stand_in)
    page.click('[data-ask="Hold"]')
    page.click("dialog .main")
    page.wait_for_selector('[data-requests][data-answer="refused"]')
    marked = [] if language == "en" else [why]
    assert page.evaluate(MARKED % "#request") == marked
    page.click("#request")
    page.wait_for_selector("dialog[open]")
    assert why in page.inner_text("dialog[open]")
    assert page.evaluate(MARKED % "dialog") == marked


@pytest.mark.parametrize("tongue", ["de", "cs"])
def test_a_refusal_is_marked_and_warnings_and_diagnosis_of_a_run_are_translated(
    look: Look, tmp_path: Path, tongue: str
) -> None:
    seen = look("engineer", locale=LOCALES[tongue])
    page = seen.open("/positioning")
    note = page.get_by_text(sentence("common-details_english", language=tongue))
    assert note.count() == 1
    wrong = tmp_path / "wrong.csv"
    wrong.write_text("this is no measured run\n", "utf-8")
    page.set_input_files("input[name=file]", wrong)
    page.click("#run-submit")
    page.wait_for_selector("#wrong:visible")
    begin = template("room-refused", language=tongue).replace("{said}", "")
    (said,) = page.evaluate(MARKED % "#wrong")
    assert page.inner_text("#wrong") == begin + said
    assert "wrong.csv" in said
    page.set_input_files("input[name=file]", RUN)
    page.click("#run-submit")
    page.wait_for_selector("#run-shown li")
    for key in ("positioning-diagnosis", "positioning-warnings"):
        title = page.get_by_role("heading", name=sentence(key, language=tongue), exact=True)
        part = page.locator("#run-shown section", has=title)
        assert part.locator("li").count() > 0
        assert part.locator("[lang=en]").count() == 0


def test_the_page_of_the_model_says_it_once_where_it_is_not_english(look: Look) -> None:
    for language, locale in LOCALES.items():
        page = look("viewer", locale=locale).open("/model")
        note = page.get_by_text(sentence("common-details_english", language=language))
        assert note.count() == (0 if language == "en" else 1)
