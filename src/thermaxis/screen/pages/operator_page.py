"""The operator's page, and the way by which a page asks something of the loop.

Not protected: what is asked here is only asked. The loop's status server decides by the role that
the person has there, the loop by its rules and limits; this page checks before so that a wrong
question is told at once and in words.
"""

from datetime import timedelta
from http import HTTPStatus
from typing import Final

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from thermaxis.codes import Message, values_as_json
from thermaxis.compensation import MOST_EXPECTED, Compensation, CompensationModel
from thermaxis.messages import LANGUAGES, as_sentence, sentence_of
from thermaxis.runtime import MachineConfiguration, Role
from thermaxis.screen.access import ScreenParts, needs, parts_of, question_of, render, visitor_of
from thermaxis.screen.pages.history import found_in_history
from thermaxis.screen.pages.probe_page import comparison
from thermaxis.web import answer_json, for_script, object_of, refuse

EXPIRIES_S: Final = (1800.0, 3600.0, 14_400.0, 28_800.0)
"""Times after which a trim may expire, to choose from: half an hour to a shift. [s]"""
AGES_S: Final = (0.0, 30.0, 60.0, 300.0, 900.0)
"""Times since a touch that is typed, to choose from. [s]"""
SAFE_WITHOUT_DATA: Final = "Disable"
"""What may be asked also while the screen has no data: it is the safe direction."""
HELPED: Final = timedelta(hours=8)
"""Time over which a probe is asked whether the compensation helps: a shift."""


def routes(parts: ScreenParts) -> list[BaseRoute]:
    """Return the operator's page, whether it helps, and the route of every question."""
    del parts
    return [
        Route("/", _page, methods=["GET"]),
        Route("/helps", _helps, methods=["GET"]),
        Route("/ask", _ask, methods=["POST"]),
    ]


def facts_of(configuration: MachineConfiguration) -> dict[str, object]:
    """Return what the page needs of the configuration, and the loop does not tell."""
    rules = configuration.compensation.supervisor
    return {
        "hold_operator_s": rules.hold_operator_s,
        "probed": bool(configuration.probes),
        "touched": {
            name: {
                "acts": rules.acts,
                "largest_um": rules.limits.largest_um,
                "largest_rate_um_per_s": rules.limits.largest_rate_um_per_s,
            }
            for name, rules in configuration.compensation.touches.items()
        },
        "model_sha256": configuration.model.sha256,
        "gains": gains_of(configuration.model.model),
    }


def expiries_of(longest_s: float) -> tuple[float, ...]:
    """Return the times after which a trim may expire, to choose from."""
    return tuple(s for s in EXPIRIES_S if s <= longest_s) or (longest_s,)


def ages_of(compensation: Compensation) -> tuple[float, ...]:
    """Return the times since a touch of which the loop still knows what was in force."""
    known_s = [own.oldest_s for own in compensation.touches.values()]
    most_s = max(*known_s, MOST_EXPECTED * compensation.cycle_s) if known_s else 0.0
    return tuple(s for s in AGES_S if s < most_s)


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
    configuration = parts_of(request).configuration
    every = [part for output in configuration.model.model.outputs for part in output.parts]
    return render(
        request,
        "operator.html",
        page="operator",
        facts=for_script(facts_of(configuration)),
        outputs=tuple(configuration.outputs),
        touched=tuple(configuration.compensation.touches),
        ages_s=ages_of(configuration.compensation),
        expiries_s=expiries_of(configuration.compensation.supervisor.longest_trim_s),
        diameters=[p.diameter_mm for part in every for p in part.gain_by_diameter],
        diameter_read=configuration.diameter is not None,
    )


@needs(Role.VIEWER)
async def _helps(request: Request) -> Response:
    """Tell of each probe what it measured of late with the compensation, and without it."""
    parts = parts_of(request)
    configuration, now = parts.configuration, parts.clock.utc()
    asked = (now - HELPED, now), configuration.rules.cycle_s, 2
    found = await found_in_history(
        request,
        lambda reader: {
            name: comparison(reader, name, *asked)["figures"] for name in configuration.probes
        },
    )
    return answer_json(found)


@needs(Role.VIEWER, named=True)
async def _ask(request: Request) -> Response:
    """Hand a question to the loop under the name of who has logged in."""
    parts = parts_of(request)
    visitor = visitor_of(request)
    question = question_of(await object_of(request))
    if isinstance(question, Message):
        return refuse(request, HTTPStatus.BAD_REQUEST, question.code, **question.values)
    if not visitor.role.at_least(question.ask.role):
        needed = Message(f"common-role_{question.ask.role.value}")
        return refuse(request, HTTPStatus.FORBIDDEN, "login-role_too_low", needed=needed)
    if visitor.person is None:
        return refuse(request, HTTPStatus.UNAUTHORIZED, "login-needed")
    told = parts.feed.latest
    if not told.live and question.ask.name != SAFE_WITHOUT_DATA:
        return refuse(request, HTTPStatus.CONFLICT, told.why or "feed-starting")
    answer, message = await parts.persons.ask(visitor.person, question)
    said = {"code": message.code, "values": values_as_json(message.values)}
    reason = {one: as_sentence(sentence_of(message, language=one)) for one in LANGUAGES}
    return answer_json({"answer": answer, **said, "reason": reason})
