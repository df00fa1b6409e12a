"""The history: trends, events and exports of any span, and the operator's trend of hours."""

import asyncio
import contextlib
import logging
from collections.abc import Iterable, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Final, cast, final

from starlette.requests import HTTPConnection, Request
from starlette.responses import FileResponse, Response
from starlette.routing import BaseRoute, Route
from starlette.types import Receive, Scope, Send

from thermaxis.codes import printable
from thermaxis.messages import sentence_of
from thermaxis.runtime import EventRecord, Role
from thermaxis.runtime.host import whole_file
from thermaxis.screen.access import needs, parts_of, render, visitor_of
from thermaxis.screen.pages.history._events import (
    EVENT_KINDS,
    TREND_KEPT_S,
    acting_column,
    events_of,
    names_now,
    said_event,
    touch_columns,
    trend8,
)
from thermaxis.screen.pages.history._rows import Kept, NoHistoryError, found_in_history, history_of
from thermaxis.screen.pages.history._series import LONGEST, Json, lines_of, span_of, to_ms, unit_of
from thermaxis.web import answer_json, refuse
from thermaxis.web.work import (
    BusyError,
    Ending,
    Limits,
    Outcome,
    WorkFolder,
    work_of,
)

if TYPE_CHECKING:
    from thermaxis.runtime.history import HistoryReader
    from thermaxis.screen.access import ScreenParts

MOST_SERIES: Final = 8
"""Series of one question. [1]"""
MOST_POINTS: Final = 4000
"""Steps of one question. [1]"""
LENGTHS: Final = (("1h", 1), ("8h", 8), ("1d", 24), ("7d", 168), ("30d", 720), ("all", 0))
"""Buttons of lengths with their hours; 0 is everything."""
EXPORT_S: Final = 120.0
"""Longest work for an export. Default: a day of four outputs at 1 Hz many times over. [s]"""
EXPORT_BYTES: Final = 500_000_000
"""Largest export. [byte]"""
EXPORT_LIMITS: Final = Limits(
    longest_s=EXPORT_S,
    file_bytes=2 * EXPORT_BYTES,  # the folder's limit is met first, and is told from a failure
    folder_bytes=EXPORT_BYTES,
)
"""What an export may use."""
FORMATS: Final = {"csv": "text/csv", "parquet": "application/vnd.apache.parquet"}
"""Kinds of content by the endings of exports."""
EXPORTS: Final = 2
"""Exports that are written, or not yet sent, at once: they bound what lies on the disk. [1]"""
SEND_S: Final = 600.0
"""Time in which an export must have been taken. Default: the largest at 0.8 MB/s. [s]"""
_KIND = "export"
_log = logging.getLogger(__name__)
_BAD_REQUEST, _TOO_LARGE, _TOO_MANY, _UNAVAILABLE = 400, 413, 429, 503


def routes(parts: "ScreenParts") -> list[BaseRoute]:
    """Return the routes of the history."""
    del parts
    return [
        Route("/history", _page, methods=["GET"]),
        Route("/history/series", _series, methods=["GET"]),
        Route("/history/trend", _trend, methods=["GET"]),
        Route("/history/events", _events, methods=["GET"]),
        Route("/history/export", _export, methods=["POST"]),
        Route("/trend8", _trend8, methods=["GET"]),
    ]


@needs(Role.VIEWER, page=True)
async def _page(request: Request) -> Response:
    return render(
        request,
        "history.html",
        page="history",
        lengths=LENGTHS,
        longest_days=LONGEST.days,
        most=MOST_SERIES,
        limit=EXPORT_S,
        size=EXPORT_BYTES // 1_000_000,
    )


def points_of(connection: HTTPConnection) -> int:
    """Return the number of steps that a request asks for, within bounds. [1]"""
    text = connection.query_params.get("points", "")
    return min(max(int(text), 50), MOST_POINTS) if text.isdecimal() and len(text) < 8 else 1000


@needs(Role.VIEWER)
async def _series(request: Request) -> Response:
    parts = parts_of(request)
    acting = _acting(parts, parts.configuration.outputs)

    def found(reader: "HistoryReader") -> Json:
        span = reader.span()
        return {
            "series": {name: unit_of(name) for name in reader.series()},
            "acting": acting,
            "first": None if span is None else to_ms(span[0]),
            "last": None if span is None else to_ms(span[1]),
        }

    return answer_json(await found_in_history(request, found))


@needs(Role.VIEWER)
async def _trend(request: Request) -> Response:
    span, names = span_of(request), request.query_params.getlist("names")
    if not names:
        return refuse(request, _BAD_REQUEST, "history-no_series")
    if len(names) > MOST_SERIES:
        return refuse(request, _BAD_REQUEST, "history-too_many", most=MOST_SERIES)
    cycle_s = parts_of(request).configuration.rules.cycle_s
    points = points_of(request)

    def found(reader: "HistoryReader") -> Json:
        series = lines_of(reader, names, span, cycle_s, points)
        return {"first": to_ms(span[0]), "last": to_ms(span[1]), "series": series}

    answer = await found_in_history(request, found)
    unknown = [name for name in names if name not in answer["series"]]
    if unknown:
        return refuse(request, _BAD_REQUEST, "history-unknown_series", name=unknown[0][:80])
    return answer_json(answer)


@needs(Role.VIEWER)
async def _events(request: Request) -> Response:
    span = span_of(request)
    kinds = [kind for kind in request.query_params.getlist("kinds") if kind in EVENT_KINDS]
    events, more = await found_in_history(request, lambda reader: events_of(reader, span, kinds))
    return answer_json({"events": _said(request, events), "more": more})


@needs(Role.VIEWER)
async def _trend8(request: Request) -> Response:
    found = await _kept_trend(request).get()
    if isinstance(found, NoHistoryError):
        text = sentence_of(found.message, language=visitor_of(request).language)
        return answer_json({"series": {}, "events": [], "error": text})
    return answer_json({**found, "events": _said(request, found["events"])})


def _acting(parts: "ScreenParts", outputs: Iterable[str]) -> tuple[str, ...]:
    return tuple(acting_column(parts.configuration, output) for output in outputs)


def _said(request: Request, events: Sequence[EventRecord]) -> list[Json]:
    language = visitor_of(request).language
    names = parts_of(request).shown_names(language)
    return [said_event(event, language, names) for event in events]


def _kept_trend(connection: HTTPConnection) -> "Kept[Json | NoHistoryError]":
    """Return the operator's trend that all viewers share; it is made at the first question."""
    state = connection.app.state
    if not hasattr(state, "trend8"):
        parts, history = parts_of(connection), history_of(connection)
        compensation = parts.configuration.compensation
        outputs = tuple(output.name for output in compensation.model.outputs)

        async def made() -> Json | NoHistoryError:
            status = parts.feed.latest.status
            acting = _acting(parts, names_now(status, "outputs", outputs))
            columns = (
                *acting,
                *touch_columns(compensation.touches),
                *names_now(status, "inputs", compensation.model.channels),
            )
            now = parts.clock.utc()
            try:
                return await history.ask(lambda r: trend8(r, now, compensation.cycle_s, columns))
            except NoHistoryError as error:
                return error

        state.trend8 = Kept(made, parts.clock, TREND_KEPT_S)
    return cast("Kept[Json | NoHistoryError]", state.trend8)


# ---- export -------------------------------------------------------------------------------------


@needs(Role.VIEWER, named=True)
async def _export(request: Request) -> Response:
    span, ending = span_of(request), request.query_params.get("format", "")
    if ending not in FORMATS:
        return refuse(request, _BAD_REQUEST, "history-export_format")
    if await found_in_history(request, lambda reader: _is_empty(reader, span)):
        return refuse(request, _UNAVAILABLE, "history-export_empty")
    return await _made(request, span, ending)


def _is_empty(reader: "HistoryReader", span: tuple[datetime, datetime]) -> bool:
    return reader.retried(reader.cycles(*span, ()).head(1).collect).is_empty()


async def _made(request: Request, span: tuple[datetime, datetime], ending: str) -> Response:
    work = work_of(request)
    async with contextlib.AsyncExitStack() as held:
        try:
            owner = visitor_of(request).name
            held.enter_context(work.place(owner, kind=_KIND, most=EXPORTS))
            folder = work.folder()
            held.push_async_callback(asyncio.to_thread, folder.remove)
            outcome = await _exported(request, folder, span, ending)
        except BusyError:
            return refuse(request, _TOO_MANY, "history-export_busy")
        except OSError as error:
            _log.warning("an export has failed: %s", printable(str(error), 500))
            return refuse(request, _UNAVAILABLE, "history-export_failed")
        name = f"history.{ending}"
        if outcome.ending is Ending.DONE and outcome.code == 0 and name in outcome.files:
            return _Sent(
                outcome.files[name],
                held.pop_all(),
                kind=FORMATS[ending],
                name=f"history-{span[0]:%Y%m%dT%H%M%SZ}-{span[1]:%Y%m%dT%H%M%SZ}.{ending}",
            )
        return _export_refused(request, outcome)


@final
class _Sent(FileResponse):
    """An export on its way; its place and its folder are held until it has gone, or is given up."""

    def __init__(
        self, path: Path, held: contextlib.AsyncExitStack, *, kind: str, name: str
    ) -> None:
        super().__init__(path, media_type=kind, filename=name)
        self._held = held

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send it."""
        async with self._held:
            try:
                async with asyncio.timeout(SEND_S):
                    await super().__call__(scope, receive, send)
            except TimeoutError:  # what has come of it is short of what was announced
                _log.warning("an export was not taken within %g s, and given up", SEND_S)


async def _exported(
    request: Request, folder: WorkFolder, span: tuple[datetime, datetime], ending: str
) -> Outcome:
    """Let a command of its own write the file; a password goes to it as a file."""
    configuration = parts_of(request).configuration
    times = (moment.isoformat() for moment in span)
    words = ["history", "export", configuration.historian.url, "--output", f"history.{ending}"]
    words += [word for pair in zip(("--from", "--to"), times, strict=True) for word in pair]
    password = configuration.historian.password.reveal()
    if password:
        with whole_file(folder.path / "password", mode=0o600) as file:
            file.write(password.encode())
        words += ["--password-file", "password"]
    return await work_of(request).run_command(
        words, limits=EXPORT_LIMITS, outputs=(f"history.{ending}",), folder=folder
    )


def _export_refused(request: Request, outcome: Outcome) -> Response:
    """Say why an export came to nothing; what the command said may name places of the computer."""
    if outcome.ending is Ending.TOO_LONG:
        return refuse(request, _TOO_LARGE, "history-export_late", limit=EXPORT_S)
    if outcome.ending is Ending.TOO_MUCH:
        size = EXPORT_BYTES // 1_000_000
        return refuse(request, _TOO_LARGE, "history-export_large", size=size)
    said = printable(outcome.said.strip()[-2000:], 500)
    _log.warning("an export has failed (%s, code %s): %s", outcome.ending, outcome.code, said)
    return refuse(request, _UNAVAILABLE, "history-export_failed")
