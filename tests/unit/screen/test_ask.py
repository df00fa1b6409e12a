"""POST /ask: only what the loop knows, only who may, only while there are data."""

import asyncio
import json
import math

import httpx2 as httpx
import pytest
from hypothesis import given, strategies as st

from tests.unit.screen.operator_parts import Somebody, sent
from tests.unit.screen.people import TOKEN
from thermaxis.codes import Message
from thermaxis.messages import LANGUAGES, as_sentence, keys, sentence, sentence_of
from thermaxis.runtime import Role
from thermaxis.runtime.opcua import MethodAnswer
from thermaxis.runtime.status import ASKS, Kind
from thermaxis.screen.access import (
    LOST,
    NO_ANSWER,
    Answer,
    Outcome,
    Question,
    outcome_of,
    question_of,
)

HOLD: dict[str, object] = {"method": "Hold", "arguments": []}
TRIM: dict[str, object] = {"method": "Trim", "arguments": ["Z_um", 2.0, 3600]}


def ask(somebody: Somebody, question: object, **options: object) -> httpx.Response:
    """Return the answer to a question."""
    return asyncio.run(sent(somebody, "POST", "/ask", json=question, **options))


def test_a_question_reaches_the_loop_under_the_name_of_who_has_logged_in() -> None:
    held = Message("answer-held", {"longest_s": 3600.0})
    somebody = Somebody(answer=Outcome(Answer.ACCEPTED, held))
    answer = ask(somebody, TRIM)
    assert answer.status_code == 200
    assert answer.json() == {
        "answer": "accepted",
        "code": "answer-held",
        "values": {"longest_s": 3600.0},
        "reason": "It is held, for at most 1\N{NO-BREAK SPACE}h.",
    }
    assert somebody.asked == [("Trim", ("Z_um", 2.0, 3600.0))]


def test_a_refusal_of_the_loop_is_told_in_the_language_of_who_asks() -> None:
    code = "answer-acknowledge_first"
    somebody = Somebody(answer=Outcome(Answer.REFUSED, Message(code)))
    for language in LANGUAGES:
        answer = ask(somebody, HOLD, headers={"Accept-Language": language}).json()
        assert (answer["answer"], answer["code"]) == ("refused", code)
        assert answer["reason"] == as_sentence(sentence(code, language=language))


def test_what_the_loop_itself_has_not_answered_is_told_in_words_too() -> None:
    somebody = Somebody(answer=Outcome(Answer.UNKNOWN, Message(LOST)))
    answer = ask(somebody, HOLD, headers={"Accept-Language": "de"}).json()
    assert answer["reason"] == sentence(LOST, language="de")


OUTCOMES = [
    ("Good", (True, "the hold is ended", "resumed", "{}"), "accepted", "answer-resumed"),
    ("Good", (False, "nothing is held", "nothing_to_hold", "{}"), "refused", None),
    ("Good", (False, "nothing came", "no_answer", "{}"), "unknown", NO_ANSWER),
    ("Good", (True, "nothing came", "no_answer", "{}"), "unknown", NO_ANSWER),
    ("Good", (False, "it may still take effect", "in_fault", "{}"), "refused", "answer-in_fault"),
    ("Good", (True, "of tomorrow", "of_tomorrow", "{}"), "accepted", "ask-told"),
    ("Good", (False, "of tomorrow", "of_tomorrow", "{}"), "refused", "ask-told"),
    ("Good", (False, "no values", "in_fault", "no JSON"), "unknown", NO_ANSWER),
    ("Good", (True, "of another program"), "unknown", NO_ANSWER),
    ("Good", (), "unknown", NO_ANSWER),
    ("BadInternalError", (), "unknown", NO_ANSWER),
    ("BadUnexpectedError", (), "unknown", NO_ANSWER),
    ("BadTimeout", (), "unknown", NO_ANSWER),
    ("BadRequestTimeout", (), "unknown", NO_ANSWER),
    ("BadUserAccessDenied", (), "refused", "ask-role"),
    ("BadArgumentsMissing", (), "refused", "ask-arguments"),
    ("BadMethodInvalid", (), "refused", "ask-not_taken"),
]


@pytest.mark.parametrize(("status", "values", "answer", "code"), OUTCOMES)
def test_an_answer_after_which_the_request_may_have_run_is_no_refusal(
    status: str, values: tuple[object, ...], answer: str, code: str | None
) -> None:
    found = outcome_of(MethodAnswer(status, values))
    assert found.answer == answer
    assert code is None or found.message.code == code
    assert found.message.code in keys("en")


def test_the_words_of_an_answer_that_is_newer_than_the_screen_are_the_loops_own() -> None:
    found = outcome_of(MethodAnswer("Good", (False, "of tomorrow", "of_tomorrow", "{}")))
    assert sentence_of(found.message) == "of tomorrow"


@pytest.mark.parametrize("wanted", ASKS, ids=lambda wanted: wanted.name)
def test_every_method_needs_its_role(wanted: object) -> None:
    found = next(one for one in ASKS if one is wanted)
    values = ["name" if argument.kind is Kind.TEXT else 1.0 for argument in found.arguments]
    question = {"method": found.name, "arguments": values}
    for role in Role:
        somebody = Somebody(role)
        allowed = role.at_least(found.role)
        assert ask(somebody, question).status_code == (200 if allowed else 403)
        assert len(somebody.asked) == allowed


def test_nobody_asks_without_a_log_in() -> None:
    somebody = Somebody(role=None)
    answer = ask(somebody, HOLD)
    assert (answer.status_code, answer.json()["error"]) == (401, "login-needed")
    assert somebody.asked == []


@pytest.mark.parametrize("token", ["", "another", TOKEN[:-1]])
def test_a_request_without_the_pages_token_reaches_nobody(token: str) -> None:
    somebody = Somebody()
    assert ask(somebody, HOLD, token=token).status_code == 403
    assert somebody.asked == []


@pytest.mark.parametrize("why", ["feed-stands_still", "feed-no_connection", "feed-old"])
def test_to_disable_is_asked_also_without_data_by_whoever_has_the_role(why: str) -> None:
    disable: dict[str, object] = {"method": "Disable", "arguments": []}
    for role in Role:
        somebody = Somebody(role=role, why=why)
        allowed = role.at_least(Role.OPERATOR)
        assert ask(somebody, disable).status_code == (200 if allowed else 403)
        assert somebody.asked == ([("Disable", ())] if allowed else [])
    for other in (one.name for one in ASKS if one.name != "Disable" and not one.arguments):
        somebody = Somebody(role=Role.ENGINEER, why=why)
        assert ask(somebody, {"method": other, "arguments": []}).status_code == 409
        assert somebody.asked == []


def test_a_question_with_a_key_twice_reaches_nobody() -> None:
    somebody = Somebody()
    twice = '{"method": "Enable", "arguments": [], "method": "Hold"}'
    answer = asyncio.run(sent(somebody, "POST", "/ask", content=twice))
    assert (answer.status_code, somebody.asked) == (400, [])


def test_nothing_is_asked_while_nobody_sees_what_the_loop_says() -> None:
    somebody = Somebody(why="feed-stands_still")
    answer = ask(somebody, HOLD)
    assert (answer.status_code, answer.json()["error"]) == (409, "feed-stands_still")
    assert answer.json()["text"] == sentence("feed-stands_still")
    assert somebody.asked == []


FORM, METHOD, ARGUMENTS, VALUE = ("form", "method", "arguments", "value")


@pytest.mark.parametrize(
    ("question", "why"),
    [
        (None, FORM),
        ([], FORM),
        ("Hold", FORM),
        ({}, FORM),
        ({"method": "Hold"}, FORM),
        ({"method": "Hold", "arguments": [], "who": "somebody else"}, FORM),
        ({"method": "WhoAmI", "arguments": []}, METHOD),
        ({"method": "../WhoAmI", "arguments": []}, METHOD),
        ({"method": "hold", "arguments": []}, METHOD),
        ({"method": ["Hold"], "arguments": []}, METHOD),
        ({"method": "Hold", "arguments": [1.0]}, ARGUMENTS),
        ({"method": "Hold", "arguments": {}}, ARGUMENTS),
        ({"method": "Trim", "arguments": ["Z_um", 1.0]}, ARGUMENTS),
        ({"method": "Trim", "arguments": [1.0, 1.0, 1.0]}, ARGUMENTS),
        ({"method": "Trim", "arguments": ["Z_um", "1.0", 60.0]}, ARGUMENTS),
        ({"method": "Trim", "arguments": ["Z_um", True, 60.0]}, ARGUMENTS),
        ({"method": "Trim", "arguments": ["Z_um", None, 60.0]}, ARGUMENTS),
        ({"method": "Trim", "arguments": ["Z_um", [1.0], 60.0]}, ARGUMENTS),
        ({"method": "Trim", "arguments": ["Z_um", 10**400, 60.0]}, ARGUMENTS),
        ({"method": "Trim", "arguments": ["", 1.0, 60.0]}, VALUE),
        ({"method": "Trim", "arguments": ["../Z_um", 1.0, 60.0]}, VALUE),
        ({"method": "ChooseModel", "arguments": [""]}, VALUE),
        ({"method": "ChooseModel", "arguments": ["folder/model.json"]}, VALUE),
        ({"method": "ChooseModel", "arguments": ["a\u202egpj.nosj"]}, VALUE),
        ({"method": "ChooseModel", "arguments": ["x" * 201]}, VALUE),
    ],
)
def test_what_is_no_request_is_refused_before_anybody_is_asked(question: object, why: str) -> None:
    somebody = Somebody(Role.ENGINEER)
    answer = ask(somebody, question)
    assert (answer.status_code, answer.json()["error"]) == (400, f"operator-ask_{why}")
    assert somebody.asked == []


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"{",
        b"\xff\xfe",
        b"[" * 100_000,
        b'{"method":"Trim","arguments":["Z_um",NaN,60]}',
        b'{"method":"Trim","arguments":["Z_um",1e999,60]}',
        b'{"method":"Trim","arguments":["Z_um",' + b"9" * 5000 + b",60]}",
    ],
)
def test_a_body_that_is_no_json_or_holds_no_number_is_refused(body: bytes) -> None:
    somebody = Somebody()
    answer = asyncio.run(sent(somebody, "POST", "/ask", content=body))
    assert answer.status_code == 400
    assert somebody.asked == []


def test_asking_is_no_reading() -> None:
    somebody = Somebody()
    assert asyncio.run(sent(somebody, "GET", "/ask")).status_code == 405
    assert somebody.asked == []


_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=3)
    ),
    max_leaves=8,
)
_METHODS = st.sampled_from([ask.name for ask in ASKS]) | st.text(max_size=8)


@given(_JSON | st.fixed_dictionaries({"method": _METHODS | _JSON, "arguments": _JSON}))
def test_a_question_that_passes_is_one_that_the_loops_server_takes(found: object) -> None:
    checked = question_of(found)
    if isinstance(checked, Message):
        assert checked.code in keys("en")
        return
    assert isinstance(checked, Question)
    assert checked.ask in ASKS
    assert len(checked.arguments) == len(checked.ask.arguments)
    for argument, value in zip(checked.ask.arguments, checked.arguments, strict=True):
        if argument.kind is Kind.TEXT:
            assert isinstance(value, str)
        else:
            assert isinstance(value, float)
            assert math.isfinite(value)
    assert checked.ask.request("novak", checked.arguments).who == "novak"
    assert json.loads(json.dumps(found)) == found
