"""Positioning runs evaluated on the machine: a file is sent, figures and certificate come back.

The file goes through no code of the screen: it is stored under a name of ours, and a process of its
own reads it. What it holds, and its name, are shown as text.
"""

import asyncio
import contextlib
import json
import logging
import re
import signal
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple, cast

from starlette.requests import ClientDisconnect, HTTPConnection, Request
from starlette.responses import FileResponse, Response
from starlette.routing import BaseRoute, Route

from thermaxis.codes import Message, printable, value_of_json, values_of_json
from thermaxis.messages import sentence, text_of
from thermaxis.runtime import Role
from thermaxis.screen.access import needs, parts_of, render, visitor_of
from thermaxis.screen.pages.positioning._results import (
    MOST_OF_A_PERSON,
    Json,
    KeptResults,
    Result,
    shown_of,
)
from thermaxis.web import RefusedError, answer_json, refuse, spoken
from thermaxis.web.work import (
    BusyError,
    Ending,
    Limits,
    Outcome,
    Work,
    WorkFolder,
    remove_leftovers,
    work_of,
)

if TYPE_CHECKING:
    from thermaxis.screen.access import ScreenParts, UserSession

LARGEST_BYTES: Final = 20_000_000
"""Largest upload, the run with what goes along. [byte]"""
LARGEST_TABLE_BYTES: Final = 64_000
"""Largest head and largest file of limits. [byte]"""
UPLOAD_S: Final = 60.0
"""Time in which an upload must have come. [s]"""
LONGEST_NAME: Final = 120
"""Characters of a file's name that are shown. [1]"""
_LARGEST_JSON_BYTES = 8_000_000
"""Largest result, which the command prints. [byte]"""
_EXTENSIONS = (".rtl", ".csv", ".dat", ".xlsx", ".txt")
_HTML, _PDF = "report.html", "certificate.pdf"
_HEAD, _LIMITS = "head.toml", "limits.toml"
_CYCLES = ("standard", "pilgrim", "step")
_EDITIONS = ("2014", "2006", "1997", "1988", "vdi3441")
_LACKS_MEMORY = re.compile(r"\bMemoryError\b|\bmemory allocation\b|\bbad_alloc\b")
_UNAUTHORIZED = 401
_BAD_REQUEST, _NOT_FOUND, _TOO_SLOW, _TOO_LARGE = 400, 404, 408, 413
_NOT_EVALUATED, _BUSY, _NO_ROOM = 422, 429, 507
_REFUSED = 2
_NOT_ALLOWED_IN_NAME = re.compile(r"[^A-Za-z0-9_-]+")
_REPORT_HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; style-src 'unsafe-inline'; img-src data:; form-action 'none';"
        " base-uri 'none'; frame-ancestors 'self'; sandbox"
    ),
    "Cache-Control": "no-store",
}
_log = logging.getLogger(__name__)


class _Asked(NamedTuple):
    """What an upload asks for."""

    name: str
    """Name of the file, fit to be shown."""
    stored: str
    """Name under which it is stored: ours."""
    head_bytes: int
    """How many bytes of the body after the run are the head of the certificate. [byte]"""
    limits_bytes: int
    """How many bytes after that are the limits. [byte]"""
    words: tuple[str, ...]
    """Options of the command."""


def routes(parts: "ScreenParts") -> list[BaseRoute]:
    """Return the routes of the page."""
    del parts
    remove_leftovers()
    return [
        Route("/positioning", _page, methods=["GET"]),
        Route("/positioning/results", _results, methods=["GET"]),
        Route("/positioning/upload", _upload, methods=["POST"]),
        Route("/positioning/result/{id}", _result, methods=["GET"]),
        Route("/positioning/report/{id}", _report, methods=["GET"]),
        Route("/positioning/certificate/{id}", _certificate, methods=["GET"]),
    ]


@needs(Role.VIEWER, page=True)
async def _page(request: Request) -> Response:
    parts, visitor = parts_of(request), visitor_of(request)
    return render(
        request,
        "positioning.html",
        page="positioning",
        may=visitor.person is not None and visitor.role.at_least(Role.ENGINEER),
        extensions=",".join(_EXTENSIONS),
        megabytes=LARGEST_BYTES // 1_000_000,
        largest_bytes=LARGEST_BYTES,
        limit_s=parts.settings.evaluation_s,
        most=MOST_OF_A_PERSON,
    )


@needs(Role.ENGINEER, named=True)
async def _results(request: Request) -> Response:
    found = _kept(request).all_of(visitor_of(request).person)
    rows = [{"id": one.id, "name": one.name, "at": one.at_utc.isoformat()} for one in found]
    return answer_json({"results": rows})


@needs(Role.ENGINEER, named=True)
async def _upload(request: Request) -> Response:
    person = visitor_of(request).person
    work = work_of(request)
    if person is None:
        return refuse(request, _UNAUTHORIZED, "login-needed")
    try:
        asked = asked_of(request)
        with work.place(person.name, kind="evaluation"):
            return answer_json(
                _told(await _evaluated(request, work, asked, person), spoken(request))
            )
    except BusyError as error:
        return refuse(request, _BUSY, "positioning-own" if error.own else "positioning-busy")
    except OSError as error:
        _log.warning("an upload could not be stored: %s", printable(str(error), 500))
        return refuse(request, _NO_ROOM, "positioning-not_stored")
    except ClientDisconnect:
        return Response(status_code=_BAD_REQUEST)  # nobody reads it


@needs(Role.ENGINEER, named=True)
async def _result(request: Request) -> Response:
    return answer_json(_told(_found(request), spoken(request)))


@needs(Role.ENGINEER, named=True)
async def _report(request: Request) -> Response:
    kind = "text/html; charset=utf-8"
    return FileResponse(_found(request).report, media_type=kind, headers=_REPORT_HEADERS)


@needs(Role.ENGINEER, named=True)
async def _certificate(request: Request) -> Response:
    found = _found(request)
    return FileResponse(
        found.certificate,
        media_type="application/pdf",
        filename=f"{file_stem(found.name)}-certificate.pdf",
        headers={"Cache-Control": "no-store"},
    )


def _kept(connection: HTTPConnection) -> KeptResults:
    """Return the results that are kept; made at the first question."""
    state = connection.app.state
    if not hasattr(state, "positioning_results"):
        state.positioning_results = KeptResults(parts_of(connection).clock)
    return cast("KeptResults", state.positioning_results)


def _found(request: Request) -> Result:
    found = _kept(request).of(visitor_of(request).person, request.path_params["id"])
    if found is None:
        raise RefusedError(_NOT_FOUND, "positioning-gone")
    return found


def _told(result: Result, language: str) -> Json:
    return {
        "id": result.id,
        "name": result.name,
        "at": result.at_utc.isoformat(),
        **result.shown,
        **{
            key: [
                sentence(one["code"], values_of_json(one["values"]), language=language)
                for one in result.shown[key]
            ]
            for key in ("left_out", "diagnosis")
        },
    }


# ---- what is asked ------------------------------------------------------------------------------


def asked_of(request: Request) -> _Asked:
    """Return what an upload asks for."""
    query = request.query_params
    given = query.get("name", "")
    words: list[str] = []
    for option, allowed in (("cycle", _CYCLES), ("edition", _EDITIONS)):
        value = query.get(option, "")
        if value and value not in allowed:
            raise _no_option(option)
        words += [f"--{option}={value}"] if value else []
    words += _reference(query.get("reference_cycle", ""), query.get("reference_hours", ""))
    for option, flag in (("no_drift", "--no-drift"), ("full", "--full")):
        value = query.get(option, "no")
        if value not in ("yes", "no"):
            raise _no_option(option)
        words += [flag] if value == "yes" else []
    head_bytes = _size_of(query.get("head_bytes", "0"), "head")
    limits_bytes = _size_of(query.get("limits_bytes", "0"), "limits")
    words += [f"--header={_HEAD}"] if head_bytes else []
    words += [f"--limits={_LIMITS}"] if limits_bytes else []
    return _Asked(shown_name(given), stored_name(given), head_bytes, limits_bytes, tuple(words))


def shown_name(given: str) -> str:
    """Return the name of an uploaded file as it is shown: never longer, never obeyed."""
    last = re.split(r"[/\\]", given)[-1].strip()
    return printable(last[: 4 * LONGEST_NAME], LONGEST_NAME) or "run"


def stored_name(given: str) -> str:
    """Return the name under which an uploaded file is stored: one of six."""
    lower = given[-16:].lower()
    if lower.endswith("_iso230.dat"):
        return "run_ISO230.dat"
    return "run" + next((one for one in _EXTENSIONS if lower.endswith(one)), ".txt")


def file_stem(name: str) -> str:
    """Return a name for a download that every system and header takes."""
    return _NOT_ALLOWED_IN_NAME.sub("_", Path(name).stem).strip("_")[:60] or "run"


def _no_option(option: str) -> RefusedError:
    return RefusedError(_BAD_REQUEST, "positioning-bad_option", option=option)


def _reference(cycle: str, hours: str) -> list[str]:
    if cycle and hours:
        raise _no_option("reference_cycle, reference_hours")
    if cycle:
        if not (cycle.isascii() and cycle.isdecimal() and len(cycle) < 8 and int(cycle) > 0):
            raise _no_option("reference_cycle")
        return [f"--reference-cycle={int(cycle)}"]
    if hours:
        if not re.fullmatch(r"[0-9]{1,6}(\.[0-9]{1,6})?", hours):
            raise _no_option("reference_hours")
        return [f"--reference-time={hours}"]
    return []


def _size_of(text: str, option: str) -> int:
    if not (text.isascii() and text.isdecimal() and len(text) < 12):
        raise _no_option(option)
    if int(text) > LARGEST_TABLE_BYTES:
        raise RefusedError(
            _TOO_LARGE, "positioning-table_too_large", largest=LARGEST_TABLE_BYTES // 1000
        )
    return int(text)


# ---- upload and evaluation ----------------------------------------------------------------------


async def _evaluated(request: Request, work: Work, asked: _Asked, person: "UserSession") -> Result:
    """Store the upload, run the command and keep what came."""
    folder = work.folder()
    async with contextlib.AsyncExitStack() as undone:
        undone.push_async_callback(asyncio.to_thread, folder.remove)
        await _stored(request, folder.path, asked)
        parts = parts_of(request)
        today = parts.clock.utc().astimezone().date().isoformat()
        outcome = await work.run_command(
            [
                *("evaluate", asked.stored, "--json=-", f"--report={_HTML}"),
                *(f"--report={_PDF}", f"--date={today}", f"--source-name={asked.name}"),
                *asked.words,
            ],
            limits=Limits(parts.settings.evaluation_s, said_bytes=_LARGEST_JSON_BYTES),
            outputs=(_HTML, _PDF),
            folder=folder,
        )
        found = await asyncio.to_thread(_judged, outcome, asked, parts.settings.evaluation_s)
        stays = (outcome.files[_HTML], outcome.files[_PDF])
        await asyncio.to_thread(folder.leave_only, stays)
        kept = _kept(request)
        result = kept.keep(person, asked.name, found, stays, folder)
        undone.pop_all()
    return result


async def _stored(request: Request, folder: Path, asked: _Asked) -> None:
    """Write the body to a file as it comes, and take from its end what goes along."""
    received = 0
    try:
        async with asyncio.timeout(UPLOAD_S):
            with (folder / asked.stored).open("xb") as stream:
                async for chunk in request.stream():
                    received += len(chunk)
                    if received > LARGEST_BYTES:
                        raise RefusedError(_TOO_LARGE, "positioning-too_large")
                    stream.write(chunk)
    except TimeoutError:
        raise RefusedError(_TOO_SLOW, "positioning-too_slow", limit=UPLOAD_S) from None
    run_bytes = received - asked.head_bytes - asked.limits_bytes
    if run_bytes <= 0:
        raise RefusedError(_BAD_REQUEST, "positioning-empty")
    with (folder / asked.stored).open("r+b") as stream:
        stream.seek(run_bytes)
        for name, size in ((_HEAD, asked.head_bytes), (_LIMITS, asked.limits_bytes)):
            if size:
                (folder / name).write_bytes(stream.read(size))
        stream.truncate(run_bytes)


def _judged(outcome: Outcome, asked: _Asked, longest_s: float) -> Json:
    """Return what the page shows of an evaluation."""
    if outcome.ending is Ending.TOO_LONG:
        raise RefusedError(_NOT_EVALUATED, "positioning-too_long", limit=longest_s)
    if outcome.ending is Ending.TOO_MUCH:
        raise RefusedError(_NOT_EVALUATED, "positioning-too_much")
    printed = _printed(outcome.printed)
    if outcome.code == _REFUSED and "error" in printed:
        said = text_of(_message_of(without_paths(printed["error"], outcome.folder, asked)))
        raise RefusedError(_NOT_EVALUATED, "positioning-refused", said=said)
    if outcome.code == -signal.SIGKILL or _LACKS_MEMORY.search(outcome.said):
        raise RefusedError(_NOT_EVALUATED, "positioning-too_hungry")
    if outcome.code == 0 and printed and set(outcome.files) == {_HTML, _PDF}:
        return shown_of(printed)
    said = printable(outcome.said.strip()[-2000:], 2000)
    _log.warning("the evaluation failed with code %s: %s", outcome.code, said)
    raise RefusedError(_NOT_EVALUATED, "positioning-crashed")


def _printed(text: str) -> Json:
    """Return the result or the error that the command has printed; nothing where it is neither."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return cast("Json", found) if isinstance(found, dict) else {}


def _message_of(error: object) -> Message:
    """Return the error of a command."""
    found = value_of_json(error)
    if not isinstance(found, Message):
        return Message("ask-told", {"said": str(found)})
    return replace(found, code=f"error-{found.code}")


def without_paths(said: object, folder: WorkFolder, asked: _Asked) -> object:
    """Return what the command says with the file's own name, and no place of this computer."""
    if isinstance(said, dict):
        table = cast("dict[str, object]", said)
        return {name: without_paths(one, folder, asked) for name, one in table.items()}
    if isinstance(said, list):
        return [without_paths(one, folder, asked) for one in cast("list[object]", said)]
    if not isinstance(said, str):
        return said
    places = {
        str(folder.path.resolve()),
        str(folder.path),
        tempfile.gettempdir(),
        str(Path(__file__).parents[4]),
        sys.prefix,
        sys.base_prefix,
        str(Path.home()),
    }
    for place in sorted(places - {"/"}, key=len, reverse=True):
        said = said.replace(f"{place}/", "").replace(place, "")
    return said.replace(asked.stored, asked.name)
