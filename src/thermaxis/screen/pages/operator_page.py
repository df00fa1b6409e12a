"""The operator's page, and the way by which a page asks something of the loop.

Not protected: what is asked here is only asked. The loop's status server decides by the role that
the person has there, the loop by its rules and limits; this page checks before so that a wrong
question is told at once and in words.
"""

from http import HTTPStatus
from typing import Final, NamedTuple, cast

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from thermaxis.codes import Message, values_as_json
from thermaxis.compensation import CompensationModel
from thermaxis.messages import sentence, sentence_of
from thermaxis.runtime import MachineConfiguration, Role
from thermaxis.runtime.status import ASKS, Ask, Kind, refusal_of
from thermaxis.screen._words import free_text
from thermaxis.screen.access import (
    ScreenParts,
    answer_json,
    for_script,
    json_of,
    needs,
    parts_of,
    refuse,
    visitor_of,
)

EXPIRIES_S: Final = (1800.0, 3600.0, 14_400.0, 28_800.0)
"""Times after which a trim may expire, to choose from: half an hour to a shift. [s]"""
SAFE_WITHOUT_DATA: Final = "Disable"
"""What may be asked also while the screen has no data: it is the safe direction."""
_ASKS: Final = {ask.name: ask for ask in ASKS}


class Question(NamedTuple):
    """What a page asks of the loop, checked."""

    ask: Ask
    """The method."""
    arguments: tuple[float | str, ...]
    """Its arguments, of the right types and count."""


_VALUE: Final = "operator.ask_value"
"""Key of the words for a value that no request takes."""


class Refused(NamedTuple):
    """Why a question cannot be handed to the loop."""

    key: str
    """Key of the words."""
    reason: Message | None = None
    """What the loop would say of it."""


def routes(parts: ScreenParts) -> list[BaseRoute]:
    """Return the operator's page and the route of every question."""
    del parts
    return [Route("/", _page, methods=["GET"]), Route("/ask", _ask, methods=["POST"])]


def question_of(found: object) -> Question | Refused:
    """Return what a page asks, or why that is no question."""
    if not isinstance(found, dict):
        return Refused("operator.ask_form")
    question = cast("dict[object, object]", found)
    if set(question) != {"method", "arguments"}:
        return Refused("operator.ask_form")
    method, given = question["method"], question["arguments"]
    ask = _ASKS.get(method) if isinstance(method, str) else None
    if ask is None:
        return Refused("operator.ask_method")
    arguments = cast("list[object]", given) if isinstance(given, list) else []
    if not isinstance(given, list) or len(arguments) != len(ask.arguments):
        return Refused("operator.ask_arguments")
    values: list[float | str] = []
    for argument, value in zip(ask.arguments, arguments, strict=True):
        fitting = _fitting(argument.kind, value)
        if fitting is None:
            return Refused("operator.ask_arguments")
        values.append(fitting)
    wrong = refusal_of(values)
    return Question(ask, tuple(values)) if wrong is None else Refused(_VALUE, wrong.message)


def _fitting(kind: Kind, value: object) -> float | str | None:
    """Return a value as its argument's type, or None where it is of another one."""
    if kind is Kind.TEXT:
        return value if isinstance(value, str) else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        return float(value)
    except OverflowError:
        return None


def facts_of(configuration: MachineConfiguration) -> dict[str, object]:
    """Return what the page needs of the configuration, and the loop does not tell."""
    rules = configuration.compensation.supervisor
    return {
        "hold_operator_s": rules.hold_operator_s,
        "longest_trim_s": rules.longest_trim_s,
        "expiries_s": expiries_of(rules.longest_trim_s),
        "diameter_read": configuration.diameter is not None,
        "model_sha256": configuration.model.sha256,
        "gains": gains_of(configuration.model.model),
    }


def expiries_of(longest_s: float) -> tuple[float, ...]:
    """Return the times after which a trim may expire, to choose from."""
    return tuple(s for s in EXPIRIES_S if s <= longest_s) or (longest_s,)


def gains_of(model: CompensationModel) -> dict[str, dict[str, object]]:
    """Return the gains by diameter of a model's parts."""
    return {
        output.name: {
            part.name: {
                "points": [[p.diameter_mm, p.gain] for p in part.gain_by_diameter],
                "tool_gain": part.tool_gain,
            }
            for part in output.parts
            if part.gain_by_diameter
        }
        for output in model.outputs
    }


@needs(Role.VIEWER, page=True)
async def _page(request: Request) -> Response:
    parts = parts_of(request)
    return parts.render(
        request,
        "operator.html",
        page="operator",
        charts=True,
        facts=for_script(facts_of(parts.configuration)),
        may_ask=visitor_of(request).role.at_least(Role.OPERATOR),
    )


@needs(Role.VIEWER, named=True)
async def _ask(request: Request) -> Response:
    """Hand a question to the loop under the name of who has logged in."""
    parts = parts_of(request)
    visitor = visitor_of(request)
    question = question_of(await json_of(request))
    if isinstance(question, Refused):
        why = question.reason
        reason = "" if why is None else sentence_of(why, language=visitor.language)
        return refuse(request, HTTPStatus.BAD_REQUEST, question.key, reason=reason)
    if not visitor.role.at_least(question.ask.role):
        needed = parts.words.say(visitor.language, f"common.role_{question.ask.role.value}")
        return refuse(request, HTTPStatus.FORBIDDEN, "login.role_too_low", needed=needed)
    if visitor.person is None:
        return refuse(request, HTTPStatus.UNAUTHORIZED, "login.needed")
    told = parts.feed.latest
    if not told.live and question.ask.name != SAFE_WITHOUT_DATA:
        return refuse(request, HTTPStatus.CONFLICT, told.why or "feed.starting")
    outcome = await parts.persons.ask(visitor.person, question.ask.name, question.arguments)
    words, language = parts.words, visitor.language
    said: dict[str, object] = {"accepted": outcome.accepted, "answer": outcome.answer}
    if outcome.key:
        said["reason"] = words.say(language, outcome.key)
    else:
        code, reason = outcome.code, outcome.reason
        said["reason"] = (
            sentence(f"answer-{code}", outcome.values, language=language) if code else reason
        )
        english = free_text(language, outcome.values)
        if english:
            said["english"] = english
    said |= {"code": outcome.code, "values": values_as_json(outcome.values)}
    return answer_json({**said, "reason_en": outcome.reason})
