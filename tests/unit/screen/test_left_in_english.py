"""What of the loop's words stays English in German and Czech: it is known, to be marked as such."""

import asyncio

import pytest
from hypothesis import given, strategies as st

from tests.unit.screen.operator_parts import Somebody, sent
from thermaxis.screen import LANGUAGES, Words
from thermaxis.screen._words import gaps_of
from thermaxis.screen.access import LOST, Outcome
from thermaxis.screen.pages.history._events import said_in

WORDS = Words.read()
FOREIGN = ("de", "cs")
FINDING = "[input.T_spindle_C]: the server does not know the node. Look at the address."
PLAIN = [
    (group, english)
    for group, phrases in WORDS.said.items()
    for english in phrases
    if not gaps_of(english)
]


@pytest.mark.parametrize("language", FOREIGN)
@pytest.mark.parametrize(
    ("group", "english", "left"),
    [
        ("event_alarm", f"self-test: {FINDING}", (FINDING,)),
        ("answer", "no outputs are given by lathe.json", ("no outputs are given by lathe.json",)),
        ("answer", "it is held, for at most 60 s", ()),
        ("answer", "outputs are X_um, Z_um", ()),
        ("event_start", "no saved state: there is no file", ()),
        ("event_start", "no saved state: a.json is damaged (no JSON)", ("no JSON",)),
        ("event_start", "no saved state: the disk is full", ("the disk is full",)),
        ("event_state", "Holding: an operator holds it", ()),
        ("answer", "", ()),
    ],
)
def test_free_text_stays_english_and_names_numbers_and_phrases_do_not(
    language: str, group: str, english: str, left: tuple[str, ...]
) -> None:
    assert WORDS.left_in_english(language, group, english) == left


@pytest.mark.parametrize("language", FOREIGN)
def test_nothing_is_left_of_what_has_no_gaps(language: str) -> None:
    assert len(PLAIN) > 50
    assert [one for one in PLAIN if WORDS.left_in_english(language, *one)] == []


def test_in_english_nothing_is_marked() -> None:
    assert WORDS.left_in_english("en", "answer", "a sentence that nobody knows") == ()


@given(
    st.sampled_from(sorted(WORDS.said)),
    st.sampled_from([english for _, english in PLAIN]) | st.text(max_size=40),
    st.sampled_from(FOREIGN),
)
def test_what_is_left_stands_as_it_is_in_the_translation(
    group: str, english: str, language: str
) -> None:
    for part in WORDS.left_in_english(language, group, english):
        assert part in english
        assert part in WORDS.phrase(language, group, english)


def test_an_event_says_which_of_its_words_are_english() -> None:
    events = [
        {"kind": "alarm", "text": f"self-test: {FINDING}"},
        {"kind": "request", "text": "model: refused, x", "reason": "x is no model"},
        {"kind": "state", "text": "Off"},
    ]
    alarm, request, state = said_in("de", WORDS, events)
    assert alarm["said"] == f"Selbsttest: {FINDING}"
    assert alarm["english"] == (FINDING,)
    assert (request["said_reason"], request["english"]) == ("x is no model", ("x is no model",))
    assert "english" not in state
    assert not any("english" in one for one in said_in("en", WORDS, events))


@pytest.mark.parametrize("language", LANGUAGES)
def test_an_answer_of_the_loop_that_has_no_translation_is_marked(language: str) -> None:
    reason = "the model is no JSON, in models/lathe.json. Write it again."
    somebody = Somebody(answer=Outcome(accepted=False, reason=reason))
    headers = {"Accept-Language": language}
    question = {"method": "Hold", "arguments": []}
    answer = asyncio.run(sent(somebody, "POST", "/ask", json=question, headers=headers)).json()
    assert answer["reason"] == answer["reason_en"] == reason
    assert answer.get("english") == (None if language == "en" else [reason])


def test_what_the_screen_says_itself_is_in_the_pages_language() -> None:
    somebody = Somebody(answer=Outcome(accepted=False, reason="it was lost", key=LOST))
    question = {"method": "Hold", "arguments": []}
    headers = {"Accept-Language": "cs"}
    answer = asyncio.run(sent(somebody, "POST", "/ask", json=question, headers=headers)).json()
    assert "english" not in answer
