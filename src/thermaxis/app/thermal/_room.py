"""Thermal: logs are dropped, a model is identified and verified, and taken along.

A file goes through no code of the pages: a command in a process of its own reads it. What the page
shows is the JSON that the command prints; sentences come from their codes, in the page's language.
"""

import asyncio
import json
import logging
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final, cast

from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, Response
from starlette.routing import BaseRoute, Route

from thermaxis.app._rooms import (
    LARGEST_JSON_BYTES,
    Endpoint,
    Json,
    RoomHost,
    file_stem,
    printed_of,
    receive_files,
    said_of,
    shown_name,
    unless_gone,
)
from thermaxis.app.thermal._asked import (
    export_words,
    identify_words,
    names_of,
    stored_name,
)
from thermaxis.app.thermal._bench import Bench, Entry
from thermaxis.codes import Message, printable, value_of_json, values_of_json
from thermaxis.messages import remedy_of, sentence_of, text_of
from thermaxis.web import RefusedError, answer_json, object_of, refuse, spoken
from thermaxis.web.work import PROGRESS, BusyError, Limits, Outcome, WorkFolder, work_of

LARGEST_BYTES: Final = 60_000_000
"""Largest log. [byte]"""
_BAD_REQUEST, _UNAUTHORIZED, _NOT_FOUND, _BUSY, _NO_ROOM = 400, 401, 404, 429, 507
_MODEL, _SERIES, _PLC, _JSON = "model.json", "series.json", "plc", "results.json"
_REPORTS: Final = ("report.html", "report.pdf")
_MEDIA: Final = {".json": "application/json", ".pdf": "application/pdf", ".html": "text/html"}
_OWN_WORDS: Final[Mapping[str, str]] = {
    "positioning-refused": "thermal-refused",
    "positioning-refused_plainly": "thermal-refused",
    "positioning-too_large": "thermal-too_large",
    "positioning-too_long": "thermal-too_long",
    "positioning-too_hungry": "thermal-too_hungry",
    "positioning-crashed": "thermal-crashed",
}
"""What is said of logs here in place of runs."""
_log = logging.getLogger(__name__)


class ThermalRoom:
    """The routes of the room, opened by a program for one person."""

    largest_bytes: Final[Mapping[str, int]] = {"/thermal/log": LARGEST_BYTES}
    """Largest bodies by path, where they are larger than a usual request's. [byte]"""
    files: Final = ("/thermal/file/",)
    """Below these paths there are files."""

    def __init__(self, host: RoomHost) -> None:
        self._host = host
        self._bench: Bench | None = None
        self._works: WorkFolder | None = None

    def routes(self) -> list[BaseRoute]:
        """Return the routes."""

        def at(path: str, endpoint: Endpoint, method: str = "GET") -> Route:
            answered = self._host.guarded(self._answered(endpoint))
            return Route(f"/thermal{path}", answered, methods=[method])

        return [
            Route("/thermal", self._host.paged(self.page), methods=["GET"]),
            at("/bench", self._told),
            at("/progress", self._progress),
            at("/log", self._upload, "POST"),
            at("/join", self._join, "POST"),
            at("/identify", self._identify, "POST"),
            at("/verify", self._verify, "POST"),
            at("/compare", self._compare, "POST"),
            at("/export", self._export, "POST"),
            at("/remove", self._remove, "POST"),
            at("/file/{id}/{name}", self._file),
        ]

    def _answered(self, endpoint: Endpoint) -> Endpoint:
        """Return an endpoint for who works here, that says in words what any work can meet."""

        async def answered(request: Request) -> Response:
            if self._host.owner_of(request) is None:
                return refuse(request, _UNAUTHORIZED, "login-needed")
            try:
                return await endpoint(request)
            except BusyError as error:
                key = "thermal-own" if error.own else "thermal-busy"
                return refuse(request, _BUSY, key)
            except RefusedError as error:
                key = _OWN_WORDS.get(error.key, error.key)
                return refuse(request, error.status, key, **error.values)
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
            "thermal.html",
            page="thermal",
            megabytes=LARGEST_BYTES // 1_000_000,
            largest_bytes=LARGEST_BYTES,
        )

    # ---- what is there -------------------------------------------------------------------------

    async def _told(self, request: Request) -> Response:
        entries = self._open(request).entries.values()
        language = spoken(request)
        told = await asyncio.to_thread(lambda: [_shown(one, language) for one in entries])
        return answer_json({"entries": told})

    async def _progress(self, _: Request) -> Response:
        """Return the step at which the command is that runs."""
        try:
            text = (self._works.path / PROGRESS).read_text() if self._works else "{}"
            found = cast("Json", json.loads(text))
        except (OSError, ValueError):
            found = {}
        return answer_json(found)

    async def _remove(self, request: Request) -> Response:
        asked = await _asked(request)
        await asyncio.to_thread(self._open(request).remove, str(asked.get("id")))
        return await self._told(request)

    async def _file(self, request: Request) -> Response:
        """Return a file of an entry; a report is made when it is first asked for."""
        name, bench = str(request.path_params["name"]), self._open(request)
        entry = bench.entries.get(str(request.path_params["id"]))
        if entry is None or not (name in entry.files or name in (*_REPORTS, _JSON)):
            raise RefusedError(_NOT_FOUND, "thermal-gone")
        if name == _JSON:
            return answer_json(entry.told)
        if name not in entry.files:
            words = [*entry.words, f"--report={name}"]
            _, folder = await self._run(request, words, entry.inputs, (name,))
            entry = bench.add_file(entry, name, folder.path / name)
            folder.remove()
        return FileResponse(
            entry.files[name],
            media_type=_MEDIA.get(Path(name).suffix, "application/octet-stream"),
            filename=f"{file_stem(entry.name)}-{name}",
        )

    # ---- work ----------------------------------------------------------------------------------

    async def _upload(self, request: Request) -> Response:
        """Keep a log, if the command can read it."""
        given = request.query_params.get("name", "")
        name, work = stored_name(given), work_of(request)
        folder = work.folder()
        try:
            await receive_files(request, folder.path, name, {}, LARGEST_BYTES)
            return await self._taken(request, folder.path / name, shown_name(given))
        finally:
            folder.remove()

    async def _taken(self, request: Request, log: Path, name: str) -> Response:
        """Look at a log, and keep it under a name that no other log has."""
        entries = self._open(request).entries.values()
        known = {file for one in entries for file in one.files}
        stem, number = log.stem, 1
        while log.name in known:
            number += 1
            log = log.rename(log.with_name(f"{stem}-{number}{log.suffix}"))
        entry = Entry("log", name, ("channels", log.name), {log.name: log})
        return await self._keep(request, entry, {_SERIES: "--series"})

    async def _join(self, request: Request) -> Response:
        """Join two logs by time, and keep what comes as one more."""
        first, second = await self._logs(await _asked(request), 2)
        words = ["merge", *first.inputs, *second.inputs, "--output=joined.csv"]
        inputs = {**first.inputs, **second.inputs}
        _, folder = await self._run(request, words, inputs, ("joined.csv",))
        try:
            name = f"{first.name} + {second.name}"
            return await self._taken(request, folder.path / "joined.csv", name)
        finally:
            folder.remove()

    async def _identify(self, request: Request) -> Response:
        asked = await _asked(request)
        logs = await self._logs(asked, 0)
        bench = self._open(request)
        name = f"model-{bench.number()}"
        today = self._host.utc().astimezone().date().isoformat()
        inputs = _inputs_of(logs)
        words = ("identify", *inputs, *identify_words(asked), f"--date={today}")
        entry = Entry("model", name, words, inputs, _ids_of(logs))
        return await self._keep(request, entry, {f"{name}.json": "--model", _SERIES: "--series"})

    async def _verify(self, request: Request) -> Response:
        asked = await _asked(request)
        model, logs = self._entry(asked.get("model"), "model"), await self._logs(asked, 0)
        words = ("verify", *(inputs := _inputs_of([model, *logs])))
        title = ", ".join(one.name for one in logs)
        entry = Entry("verification", title, words, inputs, _ids_of([model, *logs]))
        return await self._keep(request, entry, {_SERIES: "--series"})

    async def _compare(self, request: Request) -> Response:
        asked = await _asked(request)
        (log,) = await self._logs(asked, 1)
        models = [self._entry(one, "model") for one in names_of(asked, "models")]
        inputs = _inputs_of([*models, log])
        entry = Entry("comparison", log.name, ("compare", *inputs), inputs, _ids_of([*models, log]))
        return await self._keep(request, entry, {})

    async def _export(self, request: Request) -> Response:
        """Return the folder of a block for a PLC, packed."""
        asked = await _asked(request)
        model = self._entry(asked.get("model"), "model")
        inputs = _inputs_of([model])
        words = ["export", *inputs, f"--output={_PLC}", *export_words(asked)]
        told, folder = await self._run(request, words, inputs, ())
        try:
            path = folder.path / _PLC
            packed = await asyncio.to_thread(shutil.make_archive, str(path), "zip", path)
            bench = self._open(request)
            bench.add_file(bench.entries[model.id], f"{_PLC}.zip", Path(packed))
        finally:
            folder.remove()
        return answer_json({"report": told, "file": f"{_PLC}.zip"})

    async def _keep(self, request: Request, entry: Entry, made: Mapping[str, str]) -> Response:
        """Run the command of an entry, and keep what it prints and writes, by file and option."""
        bench = self._open(request)
        if bench.is_full:
            raise RefusedError(_NO_ROOM, "thermal-full")
        words = [*entry.words, *(f"{option}={file}" for file, option in made.items())]
        told, folder = await self._run(request, words, entry.inputs, tuple(made))
        try:
            own = (*made, *entry.inputs) if entry.kind == "log" else made
            files = {file: folder.path / file for file in own}
            kept = await asyncio.to_thread(bench.keep, entry._replace(told=told), files)
        finally:
            folder.remove()
        return answer_json({"id": kept.id})

    async def _run(
        self,
        request: Request,
        words: Sequence[str],
        inputs: Mapping[str, Path],
        made: Sequence[str],
    ) -> tuple[Json, WorkFolder]:
        """Return the JSON that a command prints, and the folder in which it worked."""
        work, owner = work_of(request), self._host.owner_of(request)
        limits = Limits(self._host.longest_s, said_bytes=LARGEST_JSON_BYTES)
        with work.place("" if owner is None else owner.name, kind="thermal"):
            folder = self._works = work.folder()
            try:
                run = work.run_command(
                    [*words, "--json=-"], limits=limits, inputs=inputs, outputs=made, folder=folder
                )
                outcome = await unless_gone(request, run)
                told = await asyncio.to_thread(_result_of, outcome, limits.longest_s)
            except BaseException:
                await asyncio.to_thread(folder.remove)
                raise
            finally:
                self._works = None
        return told, folder

    # ---- what is asked for ---------------------------------------------------------------------

    def _open(self, request: Request) -> Bench:
        if self._bench is None:
            self._bench = Bench(work_of(request).folder())
        return self._bench

    def _entry(self, key: object, kind: str) -> Entry:
        found = None if self._bench is None else self._bench.entries.get(str(key))
        if found is None or found.kind != kind:
            raise RefusedError(_NOT_FOUND, "thermal-gone")
        return found

    async def _logs(self, asked: Json, count: int) -> list[Entry]:
        """Return the logs that are asked for: so many, or any number."""
        found = [self._entry(key, "log") for key in names_of(asked, "logs")]
        if not found or (count and len(found) != count):
            raise RefusedError(_BAD_REQUEST, "thermal-choose_logs")
        return found


async def _asked(request: Request) -> Json:
    return await object_of(request)


def _result_of(outcome: Outcome, longest_s: float) -> Json:
    """Return what a command printed; an option that it refused is told on standard error alone."""
    if outcome.code and not outcome.printed.strip():
        said_of(outcome, {}, longest_s)
    return printed_of(outcome, {}, longest_s)


def _inputs_of(entries: Sequence[Entry]) -> dict[str, Path]:
    """Return the files of logs and models, by the names that a command knows."""
    return {
        file: path
        for one in entries
        for file, path in (one.files if one.kind == "model" else one.inputs).items()
        if one.kind == "log" or file == f"{one.name}.json"
    }


def _ids_of(entries: Sequence[Entry]) -> tuple[str, ...]:
    return tuple(one.id for one in entries)


def _shown(entry: Entry, language: str) -> Json:
    return {
        "id": entry.id,
        "kind": entry.kind,
        "name": entry.name,
        "files": sorted(entry.files),
        "made_of": entry.made_of,
        "told": _spoken(entry.told, language),
    }


def _spoken(told: object, language: str) -> object:
    """Return what a command printed, what has a code said in a language.

    A list ``x_codes`` takes the place of the texts ``xs`` or ``x``, ``x_code`` that of the text
    ``x``; an object with ``code`` and ``text`` speaks itself. What stands among the warnings of an
    identification without a code are findings and remarks of reading, which have lists of their
    own.
    """
    if isinstance(told, list):
        return [_spoken(one, language) for one in cast("list[object]", told)]
    if not isinstance(told, dict):
        return told
    found = cast("Json", told)
    table = {key: _spoken(one, language) for key, one in found.items()}
    if "code" in found and "text" in found:
        message = Message(str(found["code"]), values_of_json(found["values"]))
        table["text"] = sentence_of(message, language=language)
        table["remedy"] = remedy_of(message, language=language)
    for key, one in found.items():
        stem, _, end = key.rpartition("_")
        if end == "codes" and stem != "reading":
            texts = [_sentence(code, language) for code in cast("list[object]", one)]
            table[stem if stem in table else f"{stem}s"] = texts
        elif end == "code" and one is not None:
            table[stem] = _sentence(one, language)
    return table


def _sentence(code: object, language: str) -> str:
    found = value_of_json(code)
    return text_of(found, language=language) if isinstance(found, Message) else str(found)
