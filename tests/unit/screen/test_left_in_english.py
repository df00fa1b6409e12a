"""What of the loop's words stays English in German and Czech: it is known, to be marked as such."""

import asyncio
from datetime import UTC, datetime

import pytest

from tests.unit.screen.operator_parts import Somebody, sent
from thermaxis.codes import Message, Value
from thermaxis.messages import sentence
from thermaxis.runtime import EventRecord
from thermaxis.screen import LANGUAGES
from thermaxis.screen._words import free_text
from thermaxis.screen.access import LOST, Outcome
from thermaxis.screen.pages.history._events import event_json, said_in

NOW = datetime(2026, 11, 20, tzinfo=UTC)
FINDING = "[input.T_spindle_C]: the server does not know the node. Look at the address."


@pytest.mark.parametrize(
    ("code", "values", "left"),
    [
        ("event-self_test", {"finding": FINDING}, [FINDING]),
        ("event-no_saved_state", {"why": Message("why-no_file")}, []),
        (
            "event-no_saved_state",
            {"why": Message("why-damaged", {"file": "a.json", "detail": "no JSON"})},
            ["no JSON"],
        ),
        ("answer-unknown_output", {"names": ("X_um", "Z_um")}, []),
    ],
)
def test_free_text_stays_english_and_names_numbers_and_codes_do_not(
    code: str, values: dict[str, Value], left: list[str]
) -> None:
    assert free_text("de", values) == left
    assert free_text("en", values) == []
    said = sentence(code, values, language="de")
    assert all(part in said for part in left)


def test_an_event_says_which_of_its_words_are_english() -> None:
    found = Message("event-self_test", {"finding": FINDING})
    refused = Message("answer-model_unusable", {"why": "x is no model"})
    events = [
        event_json(EventRecord.of(NOW, "alarm", "", found)),
        event_json(
            EventRecord.of(
                NOW,
                "request",
                "",
                Message("event-request_refused", {"request": "model", "answer": refused}),
            )
        ),
        event_json(EventRecord.of(NOW, "state", "", Message("event-state", {"state": "Off"}))),
    ]
    alarm, request, state = said_in("de", events)
    assert alarm["said"] == f"Selbsttest: {FINDING}"
    assert alarm["english"] == [FINDING]
    assert request["said_reason"] == "das Modell kann nicht verwendet werden: x is no model"
    assert request["english"] == ["x is no model"]
    assert "english" not in state
    assert not any("english" in one for one in said_in("en", events))


@pytest.mark.parametrize("language", LANGUAGES)
def test_what_of_an_answer_is_free_text_is_marked(language: str) -> None:
    reason = "the model is no JSON, in models/lathe.json. Write it again."
    refused = Outcome(False, reason, "", "model_unusable", {"why": reason})
    somebody = Somebody(answer=refused)
    headers = {"Accept-Language": language}
    question = {"method": "Hold", "arguments": []}
    answer = asyncio.run(sent(somebody, "POST", "/ask", json=question, headers=headers)).json()
    assert reason in answer["reason"]
    assert answer.get("english") == (None if language == "en" else [reason])


def test_what_the_screen_says_itself_is_in_the_pages_language() -> None:
    somebody = Somebody(answer=Outcome(accepted=False, reason="it was lost", key=LOST))
    question = {"method": "Hold", "arguments": []}
    headers = {"Accept-Language": "cs"}
    answer = asyncio.run(sent(somebody, "POST", "/ask", json=question, headers=headers)).json()
    assert "english" not in answer
