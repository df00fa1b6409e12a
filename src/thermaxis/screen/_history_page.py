"""The history: trends, events and exports of any span, and the operator's trend of hours."""

from datetime import timedelta
from typing import TYPE_CHECKING, Final, cast

from starlette.requests import HTTPConnection, Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from thermaxis.runtime._users import Role
from thermaxis.screen._access import answer_json, needs, parts_of, refuse, visitor_of
from thermaxis.screen._history import (
    EVENT_KINDS,
    TREND_KEPT_S,
    Json,
    Kept,
    NoHistoryError,
    events_of,
    history_of,
    lines_of,
    names_now,
    span_of,
    to_ms,
    trend8,
    unit_of,
)

if TYPE_CHECKING:
    from thermaxis.runtime.historian._reading import HistoryReader
    from thermaxis.screen._parts import ScreenParts

MOST_SERIES: Final = 8
"""Series of one question. [1]"""
MOST_POINTS: Final = 4000
"""Steps of one question. [1]"""
LONGEST: Final = timedelta(days=3660)
"""Longest span of one question."""
_BAD_REQUEST, _UNAVAILABLE = 400, 503


def routes(parts: "ScreenParts") -> list[BaseRoute]:
    """Return the routes of the history.

    Parameters
    ----------
    parts : ScreenParts
        What the pages share.

    Returns
    -------
    list of BaseRoute
        The routes.
    """
    del parts
    return [
        Route("/history", _page, methods=["GET"]),
        Route("/history/series", _series, methods=["GET"]),
        Route("/history/trend", _trend, methods=["GET"]),
        Route("/history/events", _events, methods=["GET"]),
        Route("/trend8", _trend8, methods=["GET"]),
    ]


@needs(Role.VIEWER, page=True)
async def _page(request: Request) -> Response:
    return parts_of(request).render(request, "history.html", page="history", charts=True)


def away(connection: HTTPConnection, error: NoHistoryError) -> Response:
    """Return the refusal of a question that the history did not answer.

    Parameters
    ----------
    connection : HTTPConnection
        Who asked.
    error : NoHistoryError
        Why.

    Returns
    -------
    Response
        Status 503 with the reason in words.
    """
    return refuse(connection, _UNAVAILABLE, error.key, **error.values)


def points_of(connection: HTTPConnection) -> int:
    """Return the number of steps that a request asks for, within bounds. [1]"""
    text = connection.query_params.get("points", "")
    return min(max(int(text), 50), MOST_POINTS) if text.isdecimal() and len(text) < 8 else 1000


@needs(Role.VIEWER)
async def _series(request: Request) -> Response:
    def found(reader: "HistoryReader") -> Json:
        span = reader.span()
        return {
            "series": {name: unit_of(name, unit) for name, unit in reader.series().items()},
            "first": None if span is None else to_ms(span[0]),
            "last": None if span is None else to_ms(span[1]),
        }

    try:
        return answer_json(await history_of(request).ask(found))
    except NoHistoryError as error:
        return away(request, error)


@needs(Role.VIEWER)
async def _trend(request: Request) -> Response:
    span = span_of(request)
    names = request.query_params.getlist("names")
    if span is None or span[1] - span[0] > LONGEST:
        return refuse(request, _BAD_REQUEST, "history.no_span")
    if not names:
        return refuse(request, _BAD_REQUEST, "history.no_series")
    if len(names) > MOST_SERIES:
        return refuse(request, _BAD_REQUEST, "history.too_many", most=str(MOST_SERIES))
    cycle_s = parts_of(request).configuration.rules.cycle_s
    points = points_of(request)

    def found(reader: "HistoryReader") -> Json:
        series = lines_of(reader, names, span, cycle_s, points)
        return {"first": to_ms(span[0]), "last": to_ms(span[1]), "series": series}

    try:
        answer = await history_of(request).ask(found)
    except NoHistoryError as error:
        return away(request, error)
    unknown = [name for name in names if name not in answer["series"]]
    if unknown:
        return refuse(request, _BAD_REQUEST, "history.unknown_series", name=unknown[0][:80])
    return answer_json(answer)


@needs(Role.VIEWER)
async def _events(request: Request) -> Response:
    span = span_of(request)
    kinds = [kind for kind in request.query_params.getlist("kinds") if kind in EVENT_KINDS]
    if span is None:
        return refuse(request, _BAD_REQUEST, "history.no_span")
    try:
        events, more = await history_of(request).ask(lambda reader: events_of(reader, span, kinds))
    except NoHistoryError as error:
        return away(request, error)
    return answer_json({"events": events, "more": more})


@needs(Role.VIEWER)
async def _trend8(request: Request) -> Response:
    found = await _kept_trend(request).get()
    if isinstance(found, NoHistoryError):
        language = visitor_of(request).language  # the answer is everybody's, its words are not
        text = parts_of(request).words.say(language, found.key, **found.values)
        return answer_json({"series": {}, "events": [], "error": text})
    return answer_json(found)


def _kept_trend(connection: HTTPConnection) -> "Kept[Json | NoHistoryError]":
    """Return the operator's trend that all viewers share; it is made at the first question."""
    state = connection.app.state
    if not hasattr(state, "trend8"):
        parts, history = parts_of(connection), history_of(connection)
        compensation = parts.configuration.compensation
        outputs = tuple(output.name for output in compensation.model.outputs)

        async def made() -> Json | NoHistoryError:
            status = parts.feed.latest.status
            shown = (
                names_now(status, "outputs", outputs),
                names_now(status, "inputs", compensation.model.channels),
            )
            now = parts.clock.utc()
            try:
                return await history.ask(lambda r: trend8(r, now, compensation.cycle_s, *shown))
            except NoHistoryError as error:
                return error

        state.trend8 = Kept(made, parts.clock, TREND_KEPT_S)
    return cast("Kept[Json | NoHistoryError]", state.trend8)
