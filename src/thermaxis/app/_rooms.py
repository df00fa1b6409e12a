"""What the rooms of the app share: who opens them, what is received, and what a command says.

A room is some routes over the one worker, a template and a script. It is opened by a program that
says who may enter and how its pages look: the app itself, or the screen of a machine.
"""

import asyncio
import json
import logging
import os
import re
import sys
import tempfile
from collections.abc import Awaitable, Callable, Coroutine, Mapping
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any, Final, Protocol, TypeVar, cast

from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response

from thermaxis.codes import Message, printable, value_of_json
from thermaxis.messages import text_of
from thermaxis.web import RefusedError
from thermaxis.web.work import Ending, Outcome, WorkFolder

UPLOAD_S: Final = 60.0
"""Time in which an upload must have come. [s]"""
LONGEST_NAME: Final = 120
"""Characters of a file's name that are shown. [1]"""
LARGEST_JSON_BYTES: Final = 8_000_000
"""Largest result, which a command prints. [byte]"""
_LACKS_MEMORY = re.compile(r"\bMemoryError\b|\bmemory allocation\b|\bbad_alloc\b")
_BAD_REQUEST, _TOO_SLOW, _TOO_LARGE, _NOT_EVALUATED = 400, 408, 413, 422
_REFUSED, _SIGKILL = 2, -9
_NOT_ALLOWED_IN_NAME = re.compile(r"[^A-Za-z0-9_-]+")
_log = logging.getLogger(__name__)

Json = dict[str, Any]
"""An object of JSON."""
Endpoint = Callable[[Request], Awaitable[Response]]
"""What answers a request."""
_Found = TypeVar("_Found")


class Owner(Protocol):
    """Somebody whom results belong to."""

    @property
    def name(self) -> str:
        """What they are called."""
        ...

    @property
    def ended(self) -> object:
        """Whether they have left: what was theirs goes with what is not empty here."""
        ...


class RoomHost(Protocol):
    """What a program gives to the rooms that it opens."""

    @property
    def longest_s(self) -> float:
        """Longest time of a command. [s]"""
        ...

    def monotonic_s(self) -> float:
        """Return a time that only rises. [s]"""
        ...

    def utc(self) -> datetime:
        """Return the time by the calendar."""
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


def shown_name(given: str) -> str:
    """Return the name of an uploaded file as it is shown: never longer, never obeyed."""
    last = re.split(r"[/\\]", given)[-1].strip()
    return printable(last[: 4 * LONGEST_NAME], LONGEST_NAME) or "run"


def file_stem(name: str) -> str:
    """Return a name for a download that every system and header takes."""
    return _NOT_ALLOWED_IN_NAME.sub("_", Path(name).stem).strip("_")[:60] or "run"


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
                        raise RefusedError(_TOO_LARGE, "positioning-too_large")
                    stream.write(chunk)
    except TimeoutError:
        raise RefusedError(_TOO_SLOW, "positioning-too_slow", limit=UPLOAD_S) from None
    first_bytes = received - sum(others.values())
    if first_bytes <= 0:
        raise RefusedError(_BAD_REQUEST, "positioning-empty")
    with (folder / first).open("r+b") as stream:
        stream.seek(first_bytes)
        for name, size in others.items():
            (folder / name).write_bytes(stream.read(size))
        stream.truncate(first_bytes)


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


def printed_of(outcome: Outcome, names: Mapping[str, str], longest_s: float) -> Json:
    """Return the JSON that a command has printed, or refuse in words what came instead.

    Parameters
    ----------
    outcome : Outcome
        How the command ended.
    names : mapping of str to str
        What people call the files, by the names under which they are stored.
    longest_s : float
        Time that it was given. [s]

    Raises
    ------
    RefusedError
        If it has printed no result.
    """
    printed = _printed(outcome.printed)
    _check_ending(outcome, longest_s)
    if outcome.code == _REFUSED and "error" in printed:
        said = text_of(_message_of(without_paths(printed["error"], outcome.folder, names)))
        raise RefusedError(_NOT_EVALUATED, "positioning-refused", said=said)
    if outcome.code == 0 and printed:
        return printed
    raise _crashed(outcome)


def said_of(outcome: Outcome, names: Mapping[str, str], longest_s: float) -> str:
    """Return the text that a command has printed beside its files, or refuse as `printed_of`."""
    _check_ending(outcome, longest_s)
    if outcome.code == _REFUSED and outcome.said:
        said = without_paths(outcome.said, outcome.folder, names)
        text = printable(str(said).removeprefix("thermaxis: error: ").strip(), 2000)
        raise RefusedError(_NOT_EVALUATED, "positioning-refused_plainly", said=text)
    if outcome.code == 0 and outcome.files:
        return str(without_paths(outcome.printed, outcome.folder, names))
    raise _crashed(outcome)


def _check_ending(outcome: Outcome, longest_s: float) -> None:
    if outcome.ending is Ending.TOO_LONG:
        raise RefusedError(_NOT_EVALUATED, "positioning-too_long", limit=longest_s)
    if outcome.ending is Ending.TOO_MUCH:
        raise RefusedError(_NOT_EVALUATED, "positioning-too_much")
    if outcome.code == _SIGKILL or _LACKS_MEMORY.search(outcome.said):
        raise RefusedError(_NOT_EVALUATED, "positioning-too_hungry")


def _crashed(outcome: Outcome) -> RefusedError:
    said = printable(outcome.said.strip()[-2000:], 2000)
    _log.warning("the command failed with code %s: %s", outcome.code, said)
    return RefusedError(_NOT_EVALUATED, "positioning-crashed")


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
        str(Path.home()),
    }
    for place in sorted(places - {"/"}, key=len, reverse=True):
        said = said.replace(f"{place}{os.sep}", "").replace(place, "")
    for stored, name in names.items():
        said = said.replace(stored, name)
    return said
