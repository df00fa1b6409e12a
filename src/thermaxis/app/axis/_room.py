"""Axis: a measured run is dropped, figures come back, and everything that is made of it.

A file goes through no code of the pages: it is stored under a name of ours, and a command in a
process of its own reads it. What the page shows is the JSON that the command prints. What a file
holds, and its name, are shown as text.
"""

import asyncio
import contextlib
import logging
import re
import shutil
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final, NamedTuple, cast

from starlette.datastructures import QueryParams
from starlette.requests import ClientDisconnect, HTTPConnection, Request
from starlette.responses import FileResponse, Response
from starlette.routing import BaseRoute, Route

from thermaxis.app._rooms import (
    LARGEST_JSON_BYTES,
    Endpoint,
    Json,
    Owner,
    RoomHost,
    file_stem,
    printed_of,
    receive_files,
    said_of,
    shown_name,
    unless_gone,
    without_paths,
)
from thermaxis.app.axis._forms import forms
from thermaxis.app.axis._results import MOST_OF_A_PERSON, KeptResults, Result, shown_of
from thermaxis.codes import printable, values_of_json
from thermaxis.controls import control_names
from thermaxis.messages import sentence
from thermaxis.web import RefusedError, answer_json, for_script, refuse, spoken
from thermaxis.web.work import BusyError, Limits, Work, WorkFolder, remove_leftovers, work_of

LARGEST_BYTES: Final = 20_000_000
"""Largest upload, the run with what goes along. [byte]"""
LARGEST_TABLE_BYTES: Final = 64_000
"""Largest head, file of limits, budget or mapping. [byte]"""
LARGEST_PLAN_BYTES: Final = 2_000_000
"""Largest plan. [byte]"""
MOST_RUNS: Final = 50
"""Runs of one trend. [1]"""
_EXTENSIONS = (".rtl", ".csv", ".dat", ".xlsx", ".xls", ".md", ".txt")
_UNAUTHORIZED = 401
_BAD_REQUEST, _NOT_FOUND, _TOO_LARGE, _BUSY, _NO_ROOM = 400, 404, 413, 429, 507
_RESULTS, _PLAN, _TABLE, _PROGRAM = "results.json", "plan.json", "table.txt", "program.txt"
_CHARTS = "charts"
_log = logging.getLogger(__name__)

_NUMBER = r"[0-9]{1,6}(\.[0-9]{1,6})?"
_OPTIONS: Final[Mapping[str, tuple[str, str]]] = {
    "cycle": ("--cycle", "standard|pilgrim|step"),
    "edition": ("--edition", "2014|2006|1997|1988|vdi3441"),
    "reference_cycle": ("--reference-cycle", "[1-9][0-9]{0,6}"),
    "reference_hours": ("--reference-time", _NUMBER),
    "no_drift": ("--no-drift", ""),
    "full": ("--full", ""),
}
"""Options of an evaluation: the command's word, and what may stand there; a flag has nothing."""
_READING: Final[Mapping[str, tuple[str, str]]] = {
    "decimal": ("--decimal", "point|comma"),
    "date_order": ("--date-order", "day|month|year"),
    "units": ("--units", "[A-Za-z]{1,8},[A-Za-z]{1,8}"),
    "target_tolerance": ("--target-tolerance", _NUMBER),
}
"""How a file is read, for every command that reads it."""
_TABLE_OPTIONS: Final[Mapping[str, tuple[str, str]]] = {
    "axis": ("--axis", "[A-Za-z][A-Za-z0-9_]{0,15}"),
    "points": ("--points", "[0-9]{1,5}"),
    "backlash": ("--backlash", ""),
    "drift_free": ("--drift-free", ""),
}
_SIGNED = rf"-?{_NUMBER}"
_PLAN_OPTIONS: Final[Mapping[str, tuple[str, str]]] = {
    "length": ("--length", _NUMBER),
    "targets": ("--targets", "[0-9]{1,5}"),
    "start": ("--start", _SIGNED),
    "axis": ("--axis", "[A-Za-z][A-Za-z0-9_]{0,15}"),
    "pitch": ("--pitch", _NUMBER),
    "feed": ("--feed", _NUMBER),
    "dwell": ("--dwell", _NUMBER),
    "cycles": ("--cycles", "[0-9]{1,4}"),
    "mode": ("--mode", "bidirectional|unidirectional|pilgrim|step"),
    "rotary": ("--rotary", ""),
}
_PROGRAM_OPTIONS: Final[Mapping[str, tuple[str, str]]] = {
    "travel": ("--travel", rf"{_SIGNED}:{_SIGNED}"),
    "warm_up": ("--warm-up", "[0-9]{1,4}"),
}
_TABLES: Final[Mapping[str, tuple[str, str, int]]] = {
    "head": ("--header", "head.toml", LARGEST_TABLE_BYTES),
    "limits": ("--limits", "limits.toml", LARGEST_TABLE_BYTES),
    "budget": ("--budget", "budget.toml", LARGEST_TABLE_BYTES),
    "plan": ("--plan", _PLAN, LARGEST_PLAN_BYTES),
}
"""Files that go along behind the run, in this order."""


class _Kind(NamedTuple):
    """What can be made of an evaluated run."""

    file: str
    """The file that the command writes, or the page offers."""
    words: tuple[str, ...]
    """Words of the evaluation that writes it; none: another way."""
    media: str
    """Its kind."""
    headers: Mapping[str, str] = {}
    """More headers; a file with its own policy is shown in the page, not offered."""


_REPORT_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; form-action 'none';"
    " base-uri 'none'; frame-ancestors 'self'; sandbox"
)
_KINDS: Final[Mapping[str, _Kind]] = {
    "report": _Kind(
        "report.html",
        ("--report=report.html",),
        "text/html; charset=utf-8",
        {"Content-Security-Policy": _REPORT_POLICY},
    ),
    "certificate": _Kind("certificate.pdf", ("--report=certificate.pdf",), "application/pdf"),
    "page": _Kind("certificate.html", ("--report=certificate.html",), "application/octet-stream"),
    "dcc": _Kind("certificate.xml", ("--report=certificate.xml",), "application/octet-stream"),
    "charts": _Kind(f"{_CHARTS}.zip", (f"--figures={_CHARTS}",), "application/zip"),
    "csv": _Kind("run.tidy.csv", (), "text/csv"),
    "json": _Kind(_RESULTS, (), "application/json"),
}


class Asked(NamedTuple):
    """What an upload asks for."""

    name: str
    """Name of the file, fit to be shown."""
    stored: str
    """Name under which it is stored: ours."""
    others: Mapping[str, int]
    """Sizes of the files behind it, by the names under which they are stored. [byte]"""
    words: tuple[str, ...]
    """Options of the evaluation."""
    reading: tuple[str, ...]
    """Options of how the file is read."""


class AxisRoom:
    """The routes of the room, opened by a program."""

    largest_bytes: Final[Mapping[str, int]] = {
        "/positioning/upload": LARGEST_BYTES,
        "/positioning/trend": 3 * LARGEST_BYTES,
        "/positioning/program": LARGEST_PLAN_BYTES,
        "/positioning/toml": LARGEST_TABLE_BYTES,
    }
    """Largest bodies by path, where they are larger than a usual request's. [byte]"""
    files: Final = ("/positioning/",)
    """Below these paths there are files."""

    def __init__(self, host: RoomHost) -> None:
        self._host = host

    def routes(self) -> list[BaseRoute]:
        """Return the routes."""
        remove_leftovers()
        may = self._host.guarded

        def at(path: str, endpoint: Endpoint, method: str = "GET") -> Route:
            return Route(f"/positioning{path}", may(self._answered(endpoint)), methods=[method])

        return [
            Route("/positioning", self._host.paged(self.page), methods=["GET"]),
            at("/results", self._results),
            at("/upload", self._upload, "POST"),
            at("/trend", self._trend, "POST"),
            at("/toml", self._toml, "POST"),
            at("/plan", self._plan, "POST"),
            at("/program", self._program, "POST"),
            at("/table/{id}", self._table, "POST"),
            at("/result/{id}", self._result),
            at("/{kind}/{id}", self._file),
        ]

    def _answered(self, endpoint: Endpoint) -> Endpoint:
        """Return an endpoint that says in words what any work can meet."""

        async def answered(request: Request) -> Response:
            try:
                return await endpoint(request)
            except BusyError as error:
                return refuse(
                    request, _BUSY, "positioning-own" if error.own else "positioning-busy"
                )
            except OSError as error:
                _log.warning("a file could not be stored: %s", printable(str(error), 500))
                return refuse(request, _NO_ROOM, "positioning-not_stored")
            except ClientDisconnect:
                return Response(status_code=_BAD_REQUEST)  # nobody reads it

        return answered

    async def page(self, request: Request) -> Response:
        """Return the page."""
        return self._host.page(
            request,
            "axis.html",
            page="positioning",
            may=self._host.owner_of(request) is not None,
            extensions=",".join((*_EXTENSIONS, ".toml", ".json")),
            megabytes=LARGEST_BYTES // 1_000_000,
            largest_bytes=LARGEST_BYTES,
            limit_s=self._host.longest_s,
            most=MOST_OF_A_PERSON,
            forms=for_script(forms()),
            controls=control_names(),
        )

    async def _results(self, request: Request) -> Response:
        found = self._kept(request).all_of(self._host.owner_of(request))
        rows = [{"id": one.id, "name": one.name, "at": one.at_utc.isoformat()} for one in found]
        return answer_json({"results": rows})

    async def _result(self, request: Request) -> Response:
        return answer_json(_told(self._found(request), spoken(request)))

    # ---- evaluation ----------------------------------------------------------------------------

    async def _upload(self, request: Request) -> Response:
        owner, work = self._owner(request), work_of(request)
        asked = asked_of(request.query_params)
        with work.place(owner.name, kind="evaluation"):
            result = await self._evaluated(request, work, asked, owner)
        return answer_json(_told(result, spoken(request)))

    async def _evaluated(self, request: Request, work: Work, asked: Asked, owner: Owner) -> Result:
        """Store the upload, run the command and keep what came."""
        folder = work.folder()
        async with contextlib.AsyncExitStack() as undone:
            undone.push_async_callback(asyncio.to_thread, folder.remove)
            await receive_files(request, folder.path, asked.stored, asked.others, LARGEST_BYTES)
            words = self._evaluation(asked)
            names = {asked.stored: asked.name}
            evaluated = await unless_gone(request, self._json(work, words, folder, names))
            shown = await asyncio.to_thread(shown_of, evaluated)
            result = self._kept(request).keep(owner, asked.name, shown, asked, folder)
            undone.pop_all()
        return result

    def _evaluation(self, asked: Asked) -> list[str]:
        today = self._host.utc().astimezone().date().isoformat()
        source = f"--source-name={asked.name}"
        stated = (f"--date={today}", source, *asked.words, *asked.reading)
        return ["evaluate", asked.stored, f"--json={_RESULTS}", *stated]

    async def _json(
        self, work: Work, words: Sequence[str], folder: WorkFolder, names: Mapping[str, str]
    ) -> Json:
        """Run a command and return the JSON that it prints; what it prints is kept beside it."""
        longest_s = self._host.longest_s
        told = [word.replace(f"--json={_RESULTS}", "--json=-") for word in words]
        limits = Limits(longest_s, said_bytes=LARGEST_JSON_BYTES)
        outcome = await work.run_command(told, limits=limits, folder=folder)
        if told != list(words):
            (folder.path / _RESULTS).write_text(outcome.printed, "utf-8")
        return await asyncio.to_thread(printed_of, outcome, names, longest_s)

    async def _file(self, request: Request) -> Response:
        """Return what is made of a run when it is first asked for."""
        kind = _KINDS.get(request.path_params["kind"])
        found = self._found(request)
        if kind is None:
            raise RefusedError(_NOT_FOUND, "positioning-gone")
        path = found.folder.path / kind.file
        if not path.exists():
            work = work_of(request)
            with work.place(kind="evaluation"):  # several of one person wait for each other
                await unless_gone(request, self._make(work, found, kind))
        offered = f"{file_stem(found.name)}-{kind.file}"
        return FileResponse(
            path,
            media_type=kind.media,
            filename=None if kind.headers else offered,
            headers={"Cache-Control": "no-store", **kind.headers},
        )

    async def _make(self, work: Work, found: Result, kind: _Kind) -> None:
        asked, folder = found.asked, found.folder
        if kind.words:
            words = [*self._evaluation(asked), *kind.words]
            await self._json(work, words, folder, {asked.stored: asked.name})
        else:
            words = ["convert", asked.stored, f"--output={kind.file}", *asked.reading]
            await work.run_command(words, limits=Limits(self._host.longest_s), folder=folder)
        charts = folder.path / _CHARTS
        if charts.is_dir():
            await asyncio.to_thread(shutil.make_archive, str(charts), "zip", charts)
        if not (folder.path / kind.file).exists():
            raise RefusedError(_NO_ROOM, "positioning-crashed")

    # ---- several runs --------------------------------------------------------------------------

    async def _trend(self, request: Request) -> Response:
        """Return the trend of several runs, as its command prints it."""
        owner, work, query = self._owner(request), work_of(request), request.query_params
        names, sizes = query.getlist("name"), query.getlist("bytes")
        if not 2 <= len(names) == len(sizes) <= MOST_RUNS:
            raise RefusedError(_BAD_REQUEST, "positioning-runs_wrong", most=MOST_RUNS)
        stored = [f"{k}-{stored_name(name)}" for k, name in enumerate(names)]
        others = {
            file: _size_of(size, "bytes", LARGEST_BYTES)
            for file, size in zip(stored[1:], sizes[1:], strict=True)
        }
        shown = {file: shown_name(name) for file, name in zip(stored, names, strict=True)}
        with work.place(owner.name, kind="evaluation"):
            folder = work.folder()
            try:
                await receive_files(request, folder.path, stored[0], others, 3 * LARGEST_BYTES)
                words = ["trend", *stored, "--json=-", *words_of(query, _READING)]
                found = await unless_gone(request, self._json(work, words, folder, shown))
            finally:
                await asyncio.to_thread(folder.remove)
        return answer_json(without_paths(found, folder, shown))

    # ---- tables and plans ----------------------------------------------------------------------

    async def _table(self, request: Request) -> Response:
        """Return a control's table of a run, with what the command says of it."""
        found, query = self._found(request), request.query_params
        run, name = found.asked.stored, found.asked.name
        words = ["correct", run, f"--control={_control(query)}", f"--output={_TABLE}"]
        words += [*words_of(query, _TABLE_OPTIONS), *found.asked.reading]
        inputs = {run: found.folder.path / run}
        return await self._written(request, words, _TABLE, inputs, {run: name})

    async def _plan(self, request: Request) -> Response:
        """Return a plan of a run."""
        words = ["plan", f"--output={_PLAN}", *words_of(request.query_params, _PLAN_OPTIONS)]
        return await self._written(request, words, _PLAN, {}, {})

    async def _program(self, request: Request) -> Response:
        """Return the NC program of the plan that is the body."""
        query, body = request.query_params, await request.body()
        words = ["program", _PLAN, f"--output={_PROGRAM}", f"--control={_control(query)}"]
        words += words_of(query, _PROGRAM_OPTIONS)
        return await self._written(request, words, _PROGRAM, {_PLAN: body}, {_PLAN: "plan"})

    async def _written(
        self,
        request: Request,
        words: Sequence[str],
        file: str,
        inputs: Mapping[str, bytes | Path],
        names: Mapping[str, str],
    ) -> Response:
        """Return the file that a command writes, with what it prints."""
        work, limits = work_of(request), Limits(self._host.longest_s)
        with work.place(self._owner(request).name, kind="evaluation"):
            folder = work.folder()
            try:
                await request.body()
                run = work.run_command(
                    words, limits=limits, inputs=inputs, outputs=(file,), folder=folder
                )
                outcome = await unless_gone(request, run)
                text = said_of(outcome, names, limits.longest_s)
                content = outcome.files[file].read_bytes().decode("utf-8", "replace")
            finally:
                await asyncio.to_thread(folder.remove)
        return answer_json({"file": content, "said": text})

    async def _toml(self, request: Request) -> Response:
        """Return what a TOML file states, for the forms."""
        body = await request.body()
        try:
            found = tomllib.loads(body[:LARGEST_TABLE_BYTES].decode())
        except (ValueError, RecursionError):
            raise RefusedError(_BAD_REQUEST, "positioning-no_toml") from None
        return answer_json(_texts(found))

    # ---- what is kept --------------------------------------------------------------------------

    def _owner(self, request: Request) -> Owner:
        owner = self._host.owner_of(request)
        if owner is None:
            raise RefusedError(_UNAUTHORIZED, "login-needed")
        return owner

    def _kept(self, connection: HTTPConnection) -> KeptResults:
        """Return the results that are kept; made at the first question."""
        state = connection.app.state
        if not hasattr(state, "positioning_results"):
            state.positioning_results = KeptResults(self._host)
        return cast("KeptResults", state.positioning_results)

    def _found(self, request: Request) -> Result:
        person = self._host.owner_of(request)
        found = self._kept(request).of(person, request.path_params["id"])
        if found is None:
            raise RefusedError(_NOT_FOUND, "positioning-gone")
        return found


# ---- what is asked ------------------------------------------------------------------------------


def asked_of(query: QueryParams) -> Asked:
    """Return what an upload asks for."""
    given = query.get("name", "")
    if query.get("reference_cycle") and query.get("reference_hours"):
        raise _no_option("reference_cycle, reference_hours")
    words, others = words_of(query, _OPTIONS), dict[str, int]()
    for table, (word, file, largest) in _TABLES.items():
        size = _size_of(query.get(f"{table}_bytes", "0"), table, largest)
        if size:
            others[file] = size
            words.append(f"{word}={file}")
    reading = tuple(words_of(query, _READING))
    return Asked(shown_name(given), stored_name(given), others, tuple(words), reading)


def words_of(query: QueryParams, options: Mapping[str, tuple[str, str]]) -> list[str]:
    """Return words of a command, each of a fixed list and with nothing but what may stand there."""
    words: list[str] = []
    for option, (word, pattern) in options.items():
        value = query.get(option, "")
        if not pattern and value not in ("", "no", "yes"):
            raise _no_option(option)
        if not pattern:
            words += [word] if value == "yes" else []
        elif value:
            if not re.fullmatch(pattern, value, re.ASCII):
                raise _no_option(option)
            words.append(f"{word}={value}")
    return words


def stored_name(given: str) -> str:
    """Return the name under which an uploaded file is stored: one of a few."""
    lower = given[-16:].lower()
    if lower.endswith("_iso230.dat"):
        return "run_ISO230.dat"
    return "run" + next((one for one in _EXTENSIONS if lower.endswith(one)), ".txt")


def _control(query: QueryParams) -> str:
    control = query.get("control", "")
    if control not in control_names():
        raise _no_option("control")
    return control


def _size_of(text: str, option: str, largest_bytes: int) -> int:
    if not (text.isascii() and text.isdecimal() and len(text) < 12):
        raise _no_option(option)
    if int(text) > largest_bytes:
        raise RefusedError(_TOO_LARGE, "positioning-table_too_large", largest=largest_bytes // 1000)
    return int(text)


def _no_option(option: str) -> RefusedError:
    return RefusedError(_BAD_REQUEST, "positioning-bad_option", option=option)


# ---- what is told -------------------------------------------------------------------------------


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


def _texts(found: Mapping[str, object]) -> dict[str, dict[str, str]]:
    """Return the tables of a TOML file with their values as TOML writes them."""
    return {
        name: {key: _text(value) for key, value in cast("Json", table).items()}
        for name, table in found.items()
        if isinstance(table, dict)
    }


def _text(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
