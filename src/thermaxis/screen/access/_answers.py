"""A request to the loop, passed on as it is, and what is known of how it was answered."""

import json
from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import Final, NamedTuple, cast

from thermaxis.codes import Message, printable, values_of_json
from thermaxis.messages import LANGUAGES, keys
from thermaxis.runtime import LoopAnswer
from thermaxis.runtime.opcua import MethodAnswer
from thermaxis.runtime.status import ASKS, Ask

NO_ANSWER: Final = "ask-no_answer"
"""No answer in time; the request may still take effect."""
LOST: Final = "ask-lost"
"""The connection was lost before the answer; the request may still take effect."""
NOT_ALLOWED: Final = "ask-role"
ARGUMENTS: Final = "ask-arguments"
TOO_MANY_ASKED: Final = "ask-too_many"
NOT_TAKEN: Final = "ask-not_taken"
TOLD: Final = "ask-told"
"""The loop answers by a code that is newer than this screen: its own English words."""

_ASKS: Final[Mapping[str, Ask]] = {ask.name: ask for ask in ASKS}
_MAY_HAVE_RUN: Final = frozenset(
    {"Good", "BadInternalError", "BadUnexpectedError", "BadTimeout", "BadRequestTimeout"}
)
_WRONG_ARGUMENTS: Final = frozenset(
    {"BadArgumentsMissing", "BadTooManyArguments", "BadInvalidArgument"}
)


class Answer(StrEnum):
    """What is known of a request that was sent."""

    ACCEPTED = "accepted"
    """The loop takes it."""
    REFUSED = "refused"
    """It changes nothing."""
    UNKNOWN = "unknown"
    """There is no answer: it may still take effect."""


class Outcome(NamedTuple):
    """How a request was answered."""

    answer: Answer
    message: Message
    """Why not, or what follows: the loop's answer, or why there is none."""


class Question(NamedTuple):
    """What a page asks of the loop."""

    ask: Ask
    arguments: tuple[float | str, ...]
    """Its arguments: texts and numbers."""


def question_of(question: Mapping[str, object]) -> Question | Message:
    """Return what a page asks, or why that is no question."""
    if set(question) != {"method", "arguments"}:
        return Message("operator-ask_form")
    method, given = question["method"], question["arguments"]
    ask = _ASKS.get(method) if isinstance(method, str) else None
    if ask is None:
        return Message("operator-ask_method")
    if not isinstance(given, list):
        return Message("operator-ask_arguments")
    try:
        return Question(ask, tuple(map(_passed_on, cast("list[object]", given))))
    except (TypeError, ValueError, OverflowError):
        return Message("operator-ask_arguments")


def _passed_on(value: object) -> float | str:
    """Return a text or a number as it can be sent; whether it is the right one, the loop knows."""
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise TypeError
    if isinstance(value, str):
        value.encode()  # half a pair of surrogates is no text
        return value
    return float(value)


def outcome_of(answer: MethodAnswer) -> Outcome:
    """Return what is known of a request after the server's answer."""
    if answer.status == "BadUserAccessDenied":
        return refused(NOT_ALLOWED)
    if answer.status in _WRONG_ARGUMENTS:
        return refused(ARGUMENTS)
    told = _told(answer.values)
    if told is not None:
        return told
    return unknown(NO_ANSWER) if answer.status in _MAY_HAVE_RUN else refused(NOT_TAKEN)


def refused(code: str) -> Outcome:
    """Return that a request changes nothing."""
    return Outcome(Answer.REFUSED, Message(code))


def unknown(code: str) -> Outcome:
    """Return that nobody knows whether a request takes effect."""
    return Outcome(Answer.UNKNOWN, Message(code))


def _told(values: Sequence[object]) -> Outcome | None:
    """Return what the loop itself answered; None where that is not understood."""
    match values:
        case (bool() as accepted, str() as reason, str() as code, str() as given):
            pass
        case _:
            return None
    try:
        said = values_of_json(json.loads(given))
    except (ValueError, RecursionError):
        return None
    if code == LoopAnswer.NO_ANSWER:
        return unknown(NO_ANSWER)
    message = Message(f"answer-{code}", said)
    if message.code not in keys(LANGUAGES[0]):
        message = Message(TOLD, {"said": printable(reason, 400)})
    return Outcome(Answer.ACCEPTED if accepted else Answer.REFUSED, message)
