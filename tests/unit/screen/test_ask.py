"""POST /ask: only what the loop knows, only who may, only while there are data."""

import json

import pytest
from asyncua import ua
from asyncua.ua.ua_binary import variant_to_binary
from hypothesis import given, strategies as st

from tests.unit.screen.stand import Somebody
from thermaxis.codes import Message
from thermaxis.messages import LANGUAGES, as_sentence, keys, sentence
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


def test_a_question_reaches_the_loop_under_the_name_of_who_has_logged_in() -> None:
    held = Message("answer-held", {"longest_s": 3600.0})
    somebody = Somebody(answer=Outcome(Answer.ACCEPTED, held))
    answer = somebody.ask(TRIM)
    assert answer.status_code == 200
    assert answer.json() == {
        "answer": "accepted",
        "code": "answer-held",
        "values": {"longest_s": 3600.0},
        "reason": {
            one: as_sentence(sentence(held.code, held.values, language=one)) for one in LANGUAGES
        },
    }
    assert somebody.asked == [("Trim", ("Z_um", 2.0, 3600.0))]


@pytest.mark.parametrize(
    ("how", "code"), [(Answer.REFUSED, "answer-acknowledge_first"), (Answer.UNKNOWN, LOST)]
)
def test_why_not_is_told_in_every_language_as_a_page_may_change_its_own(
    how: Answer, code: str
) -> None:
    answer = Somebody(answer=Outcome(how, Message(code))).ask(HOLD).json()
    assert (answer["answer"], answer["code"]) == (how, code)
    for language in LANGUAGES:
        assert answer["reason"][language] == as_sentence(sentence(code, language=language))


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


@pytest.mark.parametrize("role", [None, *Role])
def test_every_method_needs_its_role(role: Role | None) -> None:
    somebody = Somebody(role)
    for ask in ASKS:
        somebody.people.asked.clear()
        values = ["name" if argument.kind is Kind.TEXT else 1.0 for argument in ask.arguments]
        answer = somebody.ask({"method": ask.name, "arguments": values})
        allowed = role is not None and role.at_least(ask.role)
        assert answer.status_code == (200 if allowed else 403 if role is not None else 401)
        assert len(somebody.asked) == allowed, ask.name


WHY = "feed-stands_still"


@pytest.mark.parametrize("role", list(Role))
def test_to_disable_is_asked_also_without_data_by_whoever_has_the_role(role: Role) -> None:
    somebody = Somebody(role, why=WHY)
    allowed = role.at_least(Role.OPERATOR)
    for ask in (one for one in ASKS if not one.arguments):
        somebody.people.asked.clear()
        answer = somebody.ask({"method": ask.name, "arguments": []})
        if ask.name == "Disable":
            assert answer.status_code == (200 if allowed else 403)
            assert somebody.asked == ([("Disable", ())] if allowed else [])
        elif allowed:
            told = answer.json()
            assert (answer.status_code, told["error"], told["text"]) == (409, WHY, sentence(WHY))
            assert somebody.asked == []


FORM, METHOD, ARGUMENTS = ("form", "method", "arguments")


WRONG = (
    (None, FORM),
    ([], FORM),
    ({}, FORM),
    ({"method": "Hold"}, FORM),
    ({"method": "Hold", "arguments": [], "who": "somebody else"}, FORM),
    ({"method": "WhoAmI", "arguments": []}, METHOD),
    ({"method": "hold", "arguments": []}, METHOD),
    ({"method": ["Hold"], "arguments": []}, METHOD),
    ({"method": "Hold", "arguments": {}}, ARGUMENTS),
    ({"method": "Trim", "arguments": ["Z_um", True, 60.0]}, ARGUMENTS),
    ({"method": "Trim", "arguments": ["Z_um", None, 60.0]}, ARGUMENTS),
    ({"method": "Trim", "arguments": ["Z_um", [1.0], 60.0]}, ARGUMENTS),
    ({"method": "Trim", "arguments": ["Z_um", 10**400, 60.0]}, ARGUMENTS),
    # half a pair of surrogates is no text: JSON can say it, and nothing can write it
    ({"method": "Trim", "arguments": ["\ud800", 1.0, 60.0]}, ARGUMENTS),
    ({"method": "\ud800", "arguments": []}, METHOD),
    ({"method": "Hold", "arguments": [], "\ud800": "\ud800"}, FORM),
)


def test_what_is_no_request_is_refused_before_anybody_is_asked() -> None:
    somebody = Somebody(Role.ENGINEER)
    for question, why in WRONG:
        answer = somebody.send("POST", "/ask", content=json.dumps(question))
        assert (answer.status_code, answer.json()["error"]) == (400, f"operator-ask_{why}"), why
        assert answer.json()["text"]
    assert somebody.asked == []


_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=3)
    ),
    max_leaves=8,
)
_METHODS = st.sampled_from([ask.name for ask in ASKS]) | st.text(max_size=8)


_OBJECTS = st.dictionaries(st.text(max_size=8), _JSON, max_size=3)


@given(_OBJECTS | st.fixed_dictionaries({"method": _METHODS | _JSON, "arguments": _JSON}))
def test_a_question_that_passes_can_be_sent_to_the_loops_server(found: dict[str, object]) -> None:
    checked = question_of(found)
    if isinstance(checked, Message):
        assert checked.code in keys("en")
        return
    assert isinstance(checked, Question)
    assert checked.ask in ASKS
    kinds = {str: ua.VariantType.String, float: ua.VariantType.Double}
    for value in checked.arguments:
        variant = ua.Variant(value)
        assert (variant.Value, variant.VariantType) == (value, kinds[type(value)])
        variant_to_binary(variant)
