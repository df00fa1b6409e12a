"""What the rooms of the app share: who opens them, what is received, and what a command says.

A room is some routes over the one worker, a template and a script. It is opened by a program that
says who may enter and how its pages look: the app itself, or the screen of a machine. A file goes
through no code of the pages: a command in a process of its own reads it. What a page shows is the
JSON that the command prints; sentences come from their codes, in the page's language.
"""

import asyncio
import json
import logging
import os
import re
import shutil
import sys
import tempfile
from collections.abc import AsyncGenerator, Awaitable, Callable, Coroutine, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol, TypeGuard, TypeVar, cast

from starlette.datastructures import QueryParams
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, Response
from starlette.routing import Route

from thermaxis.app._shelf import Clock, Entry, Owner, Shelf
from thermaxis.codes import Message, printable, value_of_json, values_of_json
from thermaxis.errors import ThermaxisError
from thermaxis.messages import LANGUAGES, remedy_of, sentence_of, text_of
from thermaxis.web import RefusedError, answer_json, refuse, spoken
from thermaxis.web.work import (
    PROGRESS,
    BusyError,
    Ending,
    Limits,
    Outcome,
    WorkFolder,
    is_file,
    work_of,
)

UPLOAD_S: Final = 60.0
"""Time in which an upload must have come. [s]"""
LONGEST_NAME: Final = 120
"""Characters of a file's name that are shown. [1]"""
LARGEST_JSON_BYTES: Final = 8_000_000
"""Largest result, which a command prints. [byte]"""
RESULTS: Final = "results.json"
"""File in which the JSON of a command lies beside what it has made."""
_VALUE = re.compile(r"-?[A-Za-z0-9µμ°″][A-Za-z0-9µμ°″_.,:+ -]{0,39}")
"""What may stand in an option: nothing that is a path or another option."""
_OF_TERMINAL = re.compile(
    r"^thermaxis[ \w-]*: error: (argument )?| \(see thermaxis [ \w-]*--help\)$"
)
"""What a command says around an error for who has typed it."""
_LACKS_MEMORY = re.compile(r"\bMemoryError\b|\bmemory allocation\b|\bbad_alloc\b")
_BAD_REQUEST, _UNAUTHORIZED, _NOT_FOUND, _TOO_SLOW, _TOO_LARGE = 400, 401, 404, 408, 413
_NOT_EVALUATED, _BUSY, _NO_ROOM = 422, 429, 507
_REFUSED, _SIGKILL = 2, -9
_NOT_ALLOWED_IN_NAME = re.compile(r"[^\w-]+")
_MEDIA = {".html": "text/html", ".json": "application/json", ".pdf": "application/pdf"}
_log = logging.getLogger(__name__)

Json = dict[str, Any]
"""An object of JSON."""
Endpoint = Callable[[Request], Awaitable[Response]]
"""What answers a request."""
_Found = TypeVar("_Found")


class RoomHost(Clock, Protocol):
    """What a program gives to the rooms that it opens."""

    @property
    def longest_s(self) -> float:
        """Longest time of a command. [s]"""
        ...

    @property
    def settings(self) -> Path | None:
        """Folder where forms are kept for the next time; none: as long as the program runs."""
        ...

    def guarded(self, endpoint: Endpoint) -> Endpoint:
        """Return an endpoint for those alone who may work; `RefusedError` is answered in words."""
        ...

    def paged(self, endpoint: Endpoint) -> Endpoint:
        """Return an endpoint that shows a page."""
        ...

    def owner_of(self, request: Request) -> Owner | None:
        """Return who works; nobody, where they only look."""
        ...

    def page(self, request: Request, template: str, *, page: str, **context: object) -> Response:
        """Return a page of this program."""
        ...


class Kind(NamedTuple):
    """A file that can be made of an entry."""

    file: str
    """The file that a command writes, or the page offers; empty: what was dropped."""
    words: tuple[str, ...] = ()
    """Words with which the command of the entry writes it; none: it is there, or made otherwise."""
    headers: Mapping[str, str] = {}
    """More headers; a file with its own policy is shown in the page, not offered."""


class Room:
    """What every room does: asks commands, keeps what comes, and says in words what cannot be."""

    def __init__(self, host: RoomHost, name: str, shelf: Shelf, kinds: Mapping[str, Kind]) -> None:
        self.host, self.name, self.shelf, self._kinds = host, name, shelf, kinds
        self._works: WorkFolder | None = None

    def at(self, path: str, endpoint: Endpoint, method: str = "GET") -> Route:
        """Return a route below the room's name, for those who may work."""
        answered = self.host.guarded(self._answered(endpoint))
        return Route(f"/{self.name}{path}", answered, methods=[method])

    def _answered(self, endpoint: Endpoint) -> Endpoint:
        """Return an endpoint that says in words what any work can meet."""

        async def answered(request: Request) -> Response:
            try:
                return await endpoint(request)
            except BusyError as error:
                return refuse(request, _BUSY, "room-own" if error.own else "room-busy")
            except OSError as error:
                _log.warning("a file could not be stored: %s", printable(str(error), 500))
                return refuse(request, _NO_ROOM, "room-not_stored")
            except ClientDisconnect:
                return Response(status_code=_BAD_REQUEST)  # nobody reads it

        return answered

    def owner(self, request: Request) -> Owner:
        """Return who works."""
        owner = self.host.owner_of(request)
        if owner is None:
            raise RefusedError(_UNAUTHORIZED, "login-needed")
        return owner

    def found(self, request: Request, key: object = None) -> Entry:
        """Return the entry that is asked for."""
        wanted = str(request.path_params.get("id") if key is None else key)
        found = self.shelf.of(self.host.owner_of(request), wanted)
        if found is None:
            raise RefusedError(_NOT_FOUND, "room-gone")
        return found

    def keep(self, entry: Entry) -> Entry:
        """Keep an entry with its folder, and beside its files what its command printed."""
        (entry.folder.path / RESULTS).write_text(json.dumps(entry.told, indent=2), "utf-8")
        return self.shelf.keep(entry)

    @asynccontextmanager
    async def work(self, request: Request) -> AsyncGenerator[WorkFolder]:
        """Take a place and a folder, which goes afterwards unless it was kept."""
        works = work_of(request)
        with works.place(self.owner(request).name, kind=self.name):
            folder = works.folder()
            try:
                yield folder
            finally:
                if not self.shelf.keeps(folder):
                    await asyncio.to_thread(folder.remove)

    async def ask(
        self,
        request: Request,
        words: Sequence[str],
        folder: WorkFolder,
        *,
        names: Mapping[str, str] | None = None,
        inputs: Mapping[str, bytes | Path] | None = None,
    ) -> Json:
        """Return what a command prints: JSON, or its text as ``said``; folders that it made packed.

        `names` are what people call the files, by the names under which they are stored.
        """
        limits = Limits(self.host.longest_s, said_bytes=LARGEST_JSON_BYTES)
        self._works = folder
        try:
            run = work_of(request).run_command(words, limits=limits, inputs=inputs, folder=folder)
            outcome = await unless_gone(request, run)
        finally:
            self._works = None
        language = spoken(request)
        return await asyncio.to_thread(_told_of, outcome, names or {}, limits.longest_s, language)

    async def progress(self, request: Request) -> Response:
        """Return the step at which the command is that runs, and whether who asks has work."""
        try:
            text = (self._works.path / PROGRESS).read_text() if self._works else "{}"
            found = cast("Json", json.loads(text))
        except (OSError, ValueError):
            found = {}
        held = work_of(request).is_held_by(self.owner(request).name)
        return answer_json({**found, "held": held})

    async def file(self, request: Request) -> Response:
        """Return a file of an entry, made when it is first asked for."""
        kind, entry = self._kinds.get(request.path_params["kind"]), self.found(request)
        if kind is None:
            raise RefusedError(_NOT_FOUND, "room-gone")
        path = entry.folder.path / (kind.file or next(iter(entry.inputs), ""))
        words = self.words_for(entry, kind)
        if not is_file(path) and words:
            works = work_of(request)
            with works.place(kind=self.name):  # several of one person wait for each other
                folder = works.folder()  # half a file is never the entry's
                own = {p.name: p for p in entry.folder.path.glob("[!.]*") if is_file(p)}
                try:
                    await self.ask(request, words, folder, inputs={**own, **entry.inputs})
                    await asyncio.to_thread((folder.path / kind.file).replace, path)
                finally:
                    await asyncio.to_thread(folder.remove)
        if not is_file(path):
            raise RefusedError(_NOT_FOUND, "room-gone")
        return FileResponse(
            path,
            media_type=_MEDIA.get(path.suffix, "application/octet-stream"),
            filename=None if kind.headers else f"{file_stem(entry.name)}-{kind.file or path.name}",
            headers={"Cache-Control": "no-store", **kind.headers},
        )

    def words_for(self, entry: Entry, kind: Kind) -> list[str]:
        """Return the words of the command that writes a file of an entry."""
        return [*entry.words, *kind.words] if kind.words and entry.words else []


def shown_name(given: str) -> str:
    """Return the name of an uploaded file as it is shown: never longer, never obeyed."""
    last = re.split(r"[/\\]", given)[-1].strip()
    return printable(last[: 4 * LONGEST_NAME], LONGEST_NAME) or "run"


def file_stem(name: str) -> str:
    """Return a name for a file that every system takes, with the letters of any language."""
    return _NOT_ALLOWED_IN_NAME.sub("_", Path(name).stem).strip("_")[:60] or "run"


Along = Mapping[str, tuple[str, str, int]]
"""Files that go along behind the first, in their order: option, name, largest size [byte]."""


def along(query: QueryParams, files: Along) -> tuple[dict[str, int], list[str]]:
    """Return sizes of the files that go along, by their names, and the words that name them."""
    others, words = dict[str, int](), list[str]()
    for key, (word, file, largest) in files.items():
        if size := size_of(query.get(f"{key}_bytes", "0"), key, largest):
            others[file] = size
            words.append(f"{word}={file}")
    return others, words


def size_of(text: str, option: str, largest_bytes: int) -> int:
    """Return the size of a file that goes along. [byte]"""
    if not (text.isascii() and text.isdecimal() and len(text) < 12):
        raise no_option(option)
    if int(text) > largest_bytes:
        raise RefusedError(_TOO_LARGE, "positioning-table_too_large", largest=largest_bytes // 1000)
    return int(text)


async def receive_files(
    request: Request, folder: Path, first: str, others: Mapping[str, int], largest_bytes: int
) -> None:
    """Write the body to a file as it comes, and take from its end the files that go along."""
    received = 0
    try:
        async with asyncio.timeout(UPLOAD_S):
            with (folder / first).open("xb") as stream:
                async for chunk in request.stream():
                    received += len(chunk)
                    if received > largest_bytes:
                        raise RefusedError(
                            _TOO_LARGE, "room-too_large", megabytes=largest_bytes // 1_000_000
                        )
                    stream.write(chunk)
    except TimeoutError:
        raise RefusedError(_TOO_SLOW, "room-too_slow", limit=UPLOAD_S) from None
    first_bytes = received - sum(others.values())
    if first_bytes <= 0:
        raise RefusedError(_BAD_REQUEST, "room-empty")
    with (folder / first).open("r+b") as stream:
        stream.seek(first_bytes)
        for name, size in others.items():
            (folder / name).write_bytes(stream.read(size))
        stream.truncate(first_bytes)


def read_small(
    read: Callable[[Path], _Found], path: Path, name: str, language: str = LANGUAGES[0]
) -> _Found:
    """Return what a model or a file of settings says, or refuse it in words."""
    try:
        return read(path)
    except ThermaxisError as error:
        said = text_of(error.message, language=language).replace(str(path), name)
        raise RefusedError(_NOT_EVALUATED, "room-refused", said=said) from None


async def unless_gone(request: Request, work: Coroutine[Any, Any, _Found]) -> _Found:
    """Return what comes of some work; end it where nobody waits for it any more.

    Raises
    ------
    ClientDisconnect
        If who asked has gone. The body of the request must have been read.
    """

    async def gone() -> None:
        while (await request.receive())["type"] != "http.disconnect":
            pass

    working, leaving = asyncio.ensure_future(work), asyncio.ensure_future(gone())
    try:
        await asyncio.wait({working, leaving}, return_when=asyncio.FIRST_COMPLETED)
        if not working.done():
            raise ClientDisconnect
        return working.result()
    finally:
        for task in (working, leaving):
            task.cancel()
        await asyncio.gather(working, leaving, return_exceptions=True)


def words_of(
    asked: Mapping[str, object], options: Sequence[str], *, flags: Sequence[str] = ()
) -> list[str]:
    """Return words of a command: options of a fixed list, whose sense the command itself judges."""
    words: list[str] = []
    for option in (*options, *flags):
        value = asked.get(option) or ""
        if value == "" or (value == "no" and option in flags):
            continue
        if not isinstance(value, str) or not _VALUE.fullmatch(value):
            raise no_option(option)
        if option in flags and value != "yes":
            raise no_option(option)
        word = f"--{option.replace('_', '-')}"
        words.append(word if option in flags else f"{word}={value}")
    return words


def no_option(option: str) -> RefusedError:
    """Return the refusal of what the page never sends."""
    return RefusedError(_BAD_REQUEST, "room-bad_option", option=f"--{option.replace('_', '-')}")


def spoken_as(told: object, language: str) -> Any:
    """Return what a command printed, what has a code said in a language.

    A list ``x_codes`` takes the place of the texts ``xs`` or ``x``, but for those that stand before
    them and have no code; ``x_code`` that of the text ``x``; an object with ``code`` and ``text``
    speaks itself, one with ``message`` and ``text`` by that.
    """
    if isinstance(told, list):
        return [spoken_as(one, language) for one in cast("list[object]", told)]
    if not isinstance(told, dict):
        return told
    found = cast("Json", told)
    table = {key: spoken_as(one, language) for key, one in found.items()}
    message = found if _is_message(found) else found.get("message")
    if "text" in found and _is_message(message):
        said = Message(message["code"], values_of_json(message.get("values")))
        table["text"] = sentence_of(said, language=language)
        table["remedy"] = remedy_of(said, language=language)
    for key, one in found.items():
        stem, _, end = key.rpartition("_")
        if end == "codes" and stem != "reading" and isinstance(one, list):
            codes = cast("list[object]", one)
            name = stem if stem in table else f"{stem}s"
            found_texts = table.get(name)
            texts = cast("list[object]", found_texts) if isinstance(found_texts, list) else []
            bare = texts[: -len(codes) or None]
            table[name] = [*bare, *(_text_of(code, language) for code in codes)]
        elif end == "code" and (isinstance(one, str) or _is_message(one)):
            table[stem] = _text_of(one, language)
    if "reading_codes" in table and "warnings" in table:  # there they stand as bare texts
        pairs = zip(found["reading_codes"], table["reading_codes"], strict=True)
        said = {
            f"{one['log']}: {one['text']}": f"{one['log']}: {own['text']}" for one, own in pairs
        }
        if "findings" in table:  # those of sensors: no other bare texts stand among the warnings
            coded = [_text_of(one, language) for one in found["warning_codes"]]
            table["warnings"] = [*said.values(), *coded]
        else:
            table["warnings"] = [said.get(one, one) for one in table["warnings"]]
    return table


def _is_message(found: object) -> TypeGuard[Json]:
    """Tell a code with its values from what stands below a name that a file gave."""
    return isinstance(found, dict) and isinstance(cast("Json", found).get("code"), str)


def _text_of(code: object, language: str) -> str:
    found = value_of_json(code)
    return text_of(found, language=language) if isinstance(found, Message) else str(found)


def _told_of(outcome: Outcome, names: Mapping[str, str], longest_s: float, language: str) -> Json:
    """Return what a command has printed, or refuse in words what came instead."""
    if outcome.ending is Ending.TOO_LONG:
        raise RefusedError(_NOT_EVALUATED, "room-too_long", limit=longest_s)
    if outcome.ending is Ending.TOO_MUCH:
        raise RefusedError(_NOT_EVALUATED, "room-too_much")
    if outcome.code == _SIGKILL or _LACKS_MEMORY.search(outcome.said):
        raise RefusedError(_NOT_EVALUATED, "room-too_hungry")
    try:
        printed: object = json.loads(outcome.printed)
    except (ValueError, RecursionError):
        printed = {"said": outcome.printed} if outcome.code == 0 else {}
    told = cast("Json", without_paths(printed, outcome.folder, names))
    if outcome.code == 0 and isinstance(printed, dict):
        for path in outcome.folder.path.glob("[!.]*/"):
            shutil.make_archive(str(path), "zip", path)
            shutil.rmtree(path)
        return told
    if outcome.code == _REFUSED and isinstance(printed, dict) and "error" in printed:
        found = value_of_json(told["error"])
        if isinstance(found, Message):
            found = text_of(replace(found, code=f"error-{found.code}"), language=language)
        raise RefusedError(_NOT_EVALUATED, "room-refused", said=str(found))
    said = str(without_paths(outcome.said, outcome.folder, names))
    text = printable(_OF_TERMINAL.sub("", said.strip())[-2000:], 2000)
    if outcome.code == _REFUSED and printed == {} and text:
        raise RefusedError(_NOT_EVALUATED, "room-refused", said=text)
    _log.warning("the command failed with code %s: %s", outcome.code, text)
    raise RefusedError(_NOT_EVALUATED, "room-crashed")


def without_paths(said: object, folder: WorkFolder, names: Mapping[str, str]) -> object:
    """Return what a command says with the files' own names, and no place of this computer."""
    if isinstance(said, dict):
        table = cast("dict[str, object]", said)
        return {name: without_paths(one, folder, names) for name, one in table.items()}
    if isinstance(said, list):
        return [without_paths(one, folder, names) for one in cast("list[object]", said)]
    if not isinstance(said, str):
        return said
    places = {
        str(folder.path.resolve()),
        str(folder.path),
        tempfile.gettempdir(),
        str(Path(__file__).parents[2]),
        sys.prefix,
        sys.base_prefix,
        os.path.expanduser("~"),  # noqa: PTH111 - Path raises where there is no home
    }
    for place in sorted(places - {"/", "~"}, key=len, reverse=True):
        said = said.replace(f"{place}{os.sep}", "").replace(place, "")
    for stored, name in names.items():
        said = said.replace(stored, name)
    return said
