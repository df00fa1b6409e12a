"""Look through a whole history: is it sound, what is in it, what was lost."""

import sqlite3
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import final

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.runtime.historian._database import parse_url, sqlite_path
from thermaxis.runtime.historian._integrity import check_file
from thermaxis.runtime.historian._reading import HistoryReader

Report = Callable[[str, int, int], None]


@final
@dataclass(frozen=True, slots=True)
class Condition:
    """What a look through a history has found."""

    first: datetime | None
    """Earliest time of a cycle; None where there is none."""
    last: datetime | None
    """Latest time of a cycle."""
    cycles: int
    """Cycles. [1]"""
    starts: int
    """How often a program began to write. [1]"""
    events: int
    """Events. [1]"""
    lost_cycles: int
    """Cycles that the history itself says were lost. [1]"""
    lost_events: int
    """Events that it says were lost. [1]"""
    size_bytes: int | None
    """Size of the file with its log; None for a server. [byte]"""


def _no_report(_step: str, _done: int, _total: int) -> None:
    """Tell nobody."""


def check_history(url: str, password: str = "", *, report: Report = _no_report) -> Condition:
    """Read everything that a history holds, beside the loop that writes it.

    That it returns means that every page, block and event could be read: damage is a `DataError`.
    """
    path = sqlite_path(parse_url(url, password))
    if path is not None and path.is_file():
        report("checking the file", 0, 0)
        found = check_file(path, float("inf"))
        if not found.sound:
            raise DataError("history_damaged", detail=found.text, place=Place(str(path)))
    with HistoryReader(url, password) as reader:
        cycles = 0
        for number, piece in enumerate(reader.pieces()):
            cycles += len(piece.array())
            report("reading the cycles", number, 0)
        events = reader.events()
        losses = [event.details for event in events if event.kind == "loss"]
        span = reader.span()
        return Condition(
            first=None if span is None else span[0],
            last=None if span is None else span[1],
            cycles=cycles,
            starts=reader.starts(),
            events=len(events),
            lost_cycles=sum(int(details.get("cycles") or 0) for details in losses),
            lost_events=sum(int(details.get("events") or 0) for details in losses),
            size_bytes=None if path is None else _size_of(path),
        )


def _size_of(path: Path) -> int:
    parts = (path, path.with_name(path.name + "-wal"))
    return sum(part.stat().st_size for part in parts if part.exists())


def copy_history(url: str, target: Path) -> None:
    """Copy a history of SQLite while the loop writes to it; the copy is whole and clean.

    Copying the files of a running database one after the other is no way: the log may be emptied
    between the two.
    """
    path = sqlite_path(parse_url(url))
    if path is None:
        raise ConfigurationError("server_history_copied", place=Place(url))
    if target.exists():
        raise ConfigurationError("file_exists", place=Place(str(target)))
    with HistoryReader(url):
        pass  # it is there, a history, and of no newer program
    source = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True, timeout=5.0)
    part = target.with_name(target.name + ".part")
    try:
        part.touch(exist_ok=False)
        copy = sqlite3.connect(part)
        try:
            source.backup(copy, pages=2000)
            copy.execute("PRAGMA journal_mode=DELETE").close()
        finally:
            copy.close()
        part.rename(target)
    except sqlite3.Error as error:
        raise OSError(f"{target}: {error}") from error
    finally:
        source.close()
        part.unlink(missing_ok=True)
