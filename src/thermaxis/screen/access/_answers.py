"""A request to the loop as its server takes it, and what is known of how it was answered."""

import json
import math
from collections.abc import Mapping, Sequence
from enum import StrEnum
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, NamedTuple

from asyncua import ua

from thermaxis.codes import Value, printable, values_of_json
from thermaxis.messages import sentence_of
from thermaxis.runtime import LoopAnswer
from thermaxis.runtime.opcua import MethodAnswer
from thermaxis.runtime.status import ASKS, Ask, Kind, refusal_of

if TYPE_CHECKING:
    from thermaxis.screen.access._persons import Person

NO_ANSWER: Final = "ask.no_answer"
"""No answer in time; the request may still take effect."""
LOST: Final = "ask.lost"
"""The connection was lost before the answer; the request may still take effect."""
NOT_ALLOWED: Final = "ask.role"
"""The server says that the person may not."""
UNKNOWN: Final = "ask.unknown"
"""There is no such request."""
ARGUMENTS: Final = "ask.arguments"
"""The arguments are of the wrong number or kind."""
TOO_MANY_ASKED: Final = "ask.too_many"
"""The person already waits for the answers to several requests."""
NOT_TAKEN: Final = "ask.not_taken"
"""The server refuses for another reason, which is told in English."""

MAY_STILL: Final = "the request may still take effect"
"""End of a reason where that is so."""
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

    accepted: bool
    """Whether it takes effect."""
    reason: str
    """Why not, or what follows, in English: the loop's own words, where it has answered."""
    key: str = ""
    """Key of the words where the loop itself has not answered; empty where it has."""
    code: str = ""
    """The loop's answer as a code; empty where it has not answered."""
    values: Mapping[str, Value] = MappingProxyType({})
    """Values that belong to the code."""

    @property
    def answer(self) -> Answer:
        """Accepted, refused, or neither."""
        if self.key in {NO_ANSWER, LOST}:
            return Answer.UNKNOWN
        return Answer.ACCEPTED if self.accepted else Answer.REFUSED


def variants_of(method: str, arguments: Sequence[float | str]) -> list[ua.Variant] | Outcome:
    """Return arguments as the server takes them, or why it would not."""
    ask = _ASKS.get(method)
    if ask is None:
        return Outcome(accepted=False, reason="there is no such request", key=UNKNOWN)
    wrong = f"{method} takes other arguments"
    if len(arguments) != len(ask.arguments):
        return Outcome(accepted=False, reason=wrong, key=ARGUMENTS)
    values: list[float | str] = []
    variants: list[ua.Variant] = []
    for wanted, given in zip(ask.arguments, arguments, strict=True):
        value = _as_kind(wanted.kind, given)
        if value is None:
            return Outcome(accepted=False, reason=wrong, key=ARGUMENTS)
        kind = ua.VariantType.String if isinstance(value, str) else ua.VariantType.Double
        values.append(value)
        variants.append(ua.Variant(value, kind))
    refused = refusal_of(values)
    if refused is None:
        return variants
    reason = sentence_of(refused.message)
    return Outcome(accepted=False, reason=reason, key=ARGUMENTS, code=refused.code)


def _as_kind(kind: Kind, given: object) -> float | str | None:
    """Return an argument from a browser in its kind; None if it is of another."""
    if kind is Kind.TEXT:
        return given if isinstance(given, str) else None
    if isinstance(given, bool) or not isinstance(given, int | float):
        return None
    try:
        number = float(given)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def _told(values: Sequence[object]) -> Outcome | None:
    """Return what the loop itself answered; None where that is not understood."""
    if len(values) != 4 or not isinstance(values[0], bool):
        return None
    texts = [one for one in values[1:] if isinstance(one, str)]
    if len(texts) != 3:
        return None
    reason, code, given = texts
    try:
        said = values_of_json(json.loads(given))
    except (ValueError, RecursionError):
        return None
    key = NO_ANSWER if code == LoopAnswer.NO_ANSWER else ""
    return Outcome(values[0], printable(reason, 400), key, printable(code, 80), said)


def outcome_of(answer: MethodAnswer, method: str, person: "Person") -> Outcome:
    """Return what is known of a request after the server's answer."""
    values = answer.values
    if answer.status == "BadUserAccessDenied":
        reason = f"the role {person.role.value} may not ask for {method}"
        return Outcome(accepted=False, reason=reason, key=NOT_ALLOWED)
    if answer.status in _WRONG_ARGUMENTS:
        return Outcome(accepted=False, reason=f"{method} takes other arguments", key=ARGUMENTS)
    told = _told(values)
    if told is not None:
        return told
    shown = printable(answer.status, 80)
    reason = f"the loop's server answers {shown}, which is not understood"
    if answer.status in _MAY_HAVE_RUN:
        return Outcome(accepted=False, reason=f"{reason}; {MAY_STILL}", key=NO_ANSWER)
    return Outcome(accepted=False, reason=reason, key=NOT_TAKEN)
