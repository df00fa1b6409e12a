"""The board, the story of a machine, and what a person decides on a proposal."""

from collections.abc import Mapping, Sequence
from datetime import date
from http import HTTPStatus
from typing import Any, cast

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from thermaxis.board._board import MOST_LINES, Line, lines_of, messages_of, worst_of
from thermaxis.board._parts import parts_of
from thermaxis.codes import Message, printable
from thermaxis.errors import ConfigurationError
from thermaxis.fleet import (
    ADDED,
    IN_FORCE,
    SISTERS,
    Evidence,
    Judgement,
    Registry,
    StoredModel,
    StoredNight,
    StoredProposal,
    axis_trends,
    evidence_of,
)
from thermaxis.messages import remedy_of, sentence, sentence_of, short_names
from thermaxis.runtime import Role
from thermaxis.screen.access import needs, render, visitor_of
from thermaxis.web import RefusedError, answer_json, for_script, object_of

MOST_NIGHTS = 400
"""Nights of a machine that stand in the table; the chart has all. [1]"""
_LONGEST_WHY = 1000
_HASH = 12


def routes() -> list[BaseRoute]:
    """Return the routes of the pages."""
    return [
        Route("/", _board, methods=["GET"]),
        Route("/machine", _machine, methods=["GET"]),
        Route("/model", _model, methods=["GET"]),
        Route("/decide", _decide, methods=["POST"]),
    ]


@needs(Role.VIEWER, page=True)
async def _board(request: Request) -> Response:
    kind, text = (request.query_params.get(name, "") for name in ("kind", "text"))
    lines = await parts_of(request).asked(_lines)
    kinds = sorted({line.kind for line in lines})
    days = [line.day for line in lines if line.day is not None]
    chosen = [
        line
        for line in lines
        if (not kind or line.kind == kind) and text.lower() in line.machine.lower()
    ]
    named = [line for line in chosen if line.needs]
    quiet = chosen[len(named) :]
    newest = max(days, default=None)
    compared = sum(day == newest for day in days)
    return render(
        request,
        "board.html",
        page="fleet",
        here=_here(request),
        day=newest,
        lists=[(True, named[:MOST_LINES], len(named)), (False, quiet[:MOST_LINES], len(quiet))],
        all=len(lines),
        few={"count": compared, "least": SISTERS} if 0 < compared < SISTERS else None,
        kinds=kinds,
        kind=kind,
        text=text,
        **_words(request),
    )


def _lines(registry: Registry, machine: str | None = None) -> list[Line]:
    day = registry.last_judged()  # while nights of the next one come, those named stay
    judged = [] if day is None else registry.judgements(day)
    return lines_of(registry.standings(machine), judged, day)


@needs(Role.VIEWER, page=True)
async def _machine(request: Request) -> Response:
    name = request.query_params.get("name", "")

    def read(registry: Registry) -> tuple[list[Line], *tuple[Any, ...]]:
        lines, nights = _lines(registry, name), registry.nights(machine=name)
        axes = axis_trends(registry.axis_runs(name)) if lines else ()
        named = registry.judgements(machine=name)
        return lines, nights, registry.models(name), registry.proposals(name), named, axes

    lines, nights, models, proposals, named, axes = await parts_of(request).asked(read)
    if not lines:
        raise RefusedError(HTTPStatus.NOT_FOUND, "fleet-no_machine")
    (line,) = lines
    latest = {night.day: night for night in nights}
    evidence = [] if line.judgement is None else evidence_of(line.judgement, nights)
    visitor = visitor_of(request)
    return render(
        request,
        "machine.html",
        page="fleet",
        here=_here(request),
        line=line,
        proposal=next((p for p in proposals if p.sha256 == line.proposed_sha256), None),
        proposals=proposals[::-1],
        models=models[::-1],
        nights=list(latest.values())[: -MOST_NIGHTS - 1 : -1],
        decides=visitor.person is not None and visitor.role.at_least(Role.ENGINEER),
        story=for_script(
            {
                **_story(latest, models, proposals, named, visitor.language),
                "evidence": [_shown(one, visitor.language) for one in evidence],
            }
        ),
        evidence=evidence,
        axes=axes,
        worst_of=worst_of,
        messages_of=messages_of,
        **_words(request),
    )


def _here(request: Request) -> str:
    return request.url.path + (f"?{request.url.query}" if request.url.query else "")


def _words(request: Request) -> dict[str, object]:
    """Return what makes sentences of messages in a page's language."""
    language = visitor_of(request).language

    def said(message: Message) -> str:
        return sentence_of(message, language=language)

    def remedy(message: Message) -> str:
        return remedy_of(message, language=language)

    def reason(why: str) -> str:
        return _reason(why, language)

    return {"said": said, "remedy": remedy, "reason": reason}


def _story(
    nights: Mapping[date, StoredNight],
    models: Sequence[StoredModel],
    proposals: Sequence[StoredProposal],
    named: Sequence[Judgement],
    language: str,
) -> dict[str, object]:
    """Return what the charts show: figures by output over the nights, and what happened."""
    outputs: dict[str, list[tuple[str, Mapping[str, Any]]]] = {}
    for day, night in nights.items():
        some = cast("Mapping[str, Mapping[str, Any]]", night.result["outputs"])
        for name, figures in some.items():
            outputs.setdefault(name, []).append((_noon(day), figures))
    marks = [
        *(
            _mark(
                *(m.added_utc.isoformat(), "model", language, m.sha256),
                why=_reason(m.why, language),
            )
            for m in models
        ),
        *(
            _mark(_noon(p.day), "proposed", language, p.sha256)
            for p in proposals
            if p.decided_utc is None
        ),
        *(
            _mark(p.decided_utc.isoformat(), key, language, p.sha256, who=p.who, why=p.why)
            for p in proposals
            if p.decided_utc is not None
            for key in ["accepted" if p.accepted else "rejected"]
        ),
        *(
            {"x": _noon(one.day), "text": text, "kind": "alarm"}
            for before, one in zip([None, *named], named, strict=False)
            if before is None or before.causes[:1] != one.causes[:1]
            for cause in [sentence(f"cause-{one.causes[0]}", language=language)]
            for text in [sentence("fleet-mark_named", {"cause": cause}, language=language)]
        ),
    ]
    return {
        "outputs": {
            name: {
                "t": [time for time, _ in some],
                **{
                    key: [figures[f"{key}_um"] for _, figures in some]
                    for key in ("rmse", "mean", "offset_mae")
                },
            }
            for name, some in outputs.items()
        },
        "marks": marks,
    }


def _shown(one: Evidence, language: str) -> dict[str, object]:
    """Return what a chart shows of a sign that departs."""
    cause = sentence(f"cause-{one.cause}", language=language)
    return {
        "title": f"{cause}: {short_names(one.of.replace(',', ', '))}",
        "unit": one.unit,
        "t": [_noon(day) for day in one.days],
        "y": one.departures,
        "low": [low for low, _ in one.twice_std],
        "high": [high for _, high in one.twice_std],
        "limits": one.limits,
    }


def _reason(why: str, language: str) -> str:
    """Return why a model was taken, where that is a word of the registry in the page's language."""
    key = {ADDED: "fleet-why_added", IN_FORCE: "fleet-why_in_force"}.get(why)
    return why if key is None else sentence(key, language=language)


def _noon(day: date) -> str:
    return f"{day.isoformat()}T12:00:00Z"


def _mark(time: str, key: str, language: str, sha256: str, **values: str | None) -> dict[str, str]:
    short = {"sha256": sha256[:_HASH], **values}
    text = sentence(f"fleet-mark_{key}", short, language=language)
    return {"x": time, "text": text, "kind": "request" if values.get("who") else ""}


@needs(Role.VIEWER)
async def _model(request: Request) -> Response:
    """Return an accepted model as the file that a machine's folder of models takes."""
    name, sha256 = (request.query_params.get(key, "") for key in ("name", "sha256"))
    proposals = await parts_of(request).asked(lambda registry: registry.proposals(name))
    found = [o for o in proposals if o.accepted and not o.withdrawn and o.sha256 == sha256]
    if not found:
        raise RefusedError(HTTPStatus.NOT_FOUND, "fleet-no_model")
    headers = {"Content-Disposition": f'attachment; filename="model-{sha256[:_HASH]}.json"'}
    return Response(found[0].content, media_type="application/json", headers=headers)


@needs(Role.ENGINEER, named=True)
async def _decide(request: Request) -> Response:
    """Store what a person decides on the proposal that was seen, by the code of `fleet accept`."""
    asked = await object_of(request)
    machine, sha256, why = (asked.get(key) for key in ("machine", "sha256", "why"))
    accepted, who = asked.get("accepted"), visitor_of(request).name
    if not (isinstance(accepted, bool) and isinstance(machine, str) and isinstance(sha256, str)):
        raise RefusedError(HTTPStatus.BAD_REQUEST, "fleet-no_decision")
    reason = printable(why.strip(), _LONGEST_WHY) if isinstance(why, str) else ""
    if not (reason and sha256):
        raise RefusedError(HTTPStatus.BAD_REQUEST, "fleet-no_why")

    def decide(registry: Registry) -> bool:
        try:
            registry.decide(machine, accepted=accepted, who=who, why=reason, sha256=sha256)
        except ConfigurationError:
            return False
        return True

    if not await parts_of(request).asked(decide):
        raise RefusedError(HTTPStatus.CONFLICT, "fleet-decided_before")
    return answer_json({})
