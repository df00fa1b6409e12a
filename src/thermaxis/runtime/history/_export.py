"""A span of a history as a thermal log; a whole history looked through, or copied."""

import shutil
import sqlite3
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Final, final

import polars as pl

from thermaxis.errors import ConfigurationError, DataError
from thermaxis.files.table import protected
from thermaxis.runtime.history._columns import ACTIVE, ID, TIME
from thermaxis.runtime.history._integrity import check_file
from thermaxis.runtime.history._parts import days_of, parts_of
from thermaxis.runtime.history._reader import HistoryReader
from thermaxis.runtime.history._url import check_url, history_folder

LOG_TIME: Final = "time"
"""Heading of the times, as readers of thermal logs know it."""
_OWN = frozenset({ID, TIME, "number", "monotonic_s"})
_OF_ALL = ("_age_s", "_used_C", "_used_K", "_used_um", "_at_limit")
Report = Callable[[str, int, int], None]


@final
@dataclass(frozen=True, slots=True)
class Export:
    """What was written."""

    rows: int
    """Cycles. [1]"""
    columns: tuple[str, ...]
    """Headings, without that of the times."""


def export_history(
    reader: HistoryReader,
    path: Path,
    *,
    first: datetime | None = None,
    last: datetime | None = None,
    patterns: Sequence[str] = (),
    everything: bool = False,
) -> Export:
    """Write a span of a history as a thermal log.

    Times are UTC. Memory does not grow with the span.

    Parameters
    ----------
    path : Path
        The file, ``.parquet`` or ``.csv``; it is replaced when everything has been written.
    first : datetime, optional
        Begin of the span. Default: that of the history.
    last : datetime, optional
        End, not included. Default: that of the history.
    patterns : sequence of str
        Headings that are wanted, with ``*`` and ``?``; empty for all.
    everything : bool
        Whether codes, statuses, ages and what the model was given are written as well. Default:
        no.

    Raises
    ------
    DataError
        If the history cannot be read, or has nothing in the span or of the patterns.
    OSError
        If the file cannot be written.
    """
    if not reader.retried(lambda: _count(reader.cycles(first, last, ()))):
        raise _no_cycle(reader)
    known = _headings(reader.columns(first, last), everything=everything)
    wanted = [name for name in known if not patterns or _matches(name, patterns)]
    if not wanted:
        raise DataError("no_matching_column", known=tuple(known), file=reader.where)
    part = path.with_name(f"{path.name}.part")
    as_text = path.suffix.casefold() == ".csv"

    def written() -> int:
        found = reader.cycles(first, last, wanted).select(
            pl.col(TIME).alias(LOG_TIME), *[_as_log(name) for name in wanted]
        )
        if as_text:
            found = found.rename({name: protected(name) for name in wanted})
            found = found.with_columns(pl.col(pl.String()).map_elements(protected, pl.String()))
            found.sink_csv(part, datetime_format="%Y-%m-%dT%H:%M:%S%.6fZ")
            return _count(pl.scan_csv(part))
        found.sink_parquet(part)
        return _count(pl.scan_parquet(part))

    try:
        rows = reader.retried(written)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
    return Export(rows, tuple(wanted))


def _count(cycles: pl.LazyFrame) -> int:
    return int(cycles.select(pl.len()).collect().item())


def _as_log(name: str) -> pl.Expr:
    return pl.col(name).cast(pl.Float64) if name == ACTIVE else pl.col(name)


def _headings(schema: pl.Schema, *, everything: bool) -> list[str]:
    """Return the columns of an export: inputs, corrections and their parts, or all there are."""
    if everything:
        return [name for name in schema if name not in {ID, TIME}]
    return [
        name
        for name, kind in schema.items()
        if kind in {pl.Float64(), pl.Boolean()} and name not in _OWN and not name.endswith(_OF_ALL)
    ]


def _matches(name: str, patterns: Sequence[str]) -> bool:
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def _no_cycle(reader: HistoryReader) -> DataError:
    found = reader.span()
    if found is None:
        return DataError("history_empty", file=reader.where)
    first, last = (moment.isoformat() for moment in found)
    return DataError("no_cycle_in_span", first=first, last=last, file=reader.where)


# ---- a whole history ----------------------------------------------------------------------------


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
    """How often the loop was started. [1]"""
    events: int
    """Events. [1]"""
    lost_cycles: int
    """Cycles that the history itself says were lost. [1]"""
    lost_events: int
    """Events that it says were lost. [1]"""
    size_bytes: int
    """Size of the files, with SQLite's; without a server's tables. [byte]"""


def check_history(
    url: str, password: str = "", *, report: Report = lambda _step, _done, _total: None
) -> Condition:
    """Read everything that a history holds, beside the loop that writes it.

    That it returns means that every page, file and event could be read: damage is a `DataError`.
    """
    path = check_url(url, key="HISTORY")
    if path is not None and path.is_file():
        report("checking the file", 0, 0)
        damage = check_file(path)
        if damage:
            raise DataError("history_damaged", detail=damage, file=path)
    with HistoryReader(url, password) as reader:
        report("reading the cycles", 0, 0)
        every = pl.len().alias(""), pl.all().hash().sum()  # a sum of all reads all
        cycles = reader.retried(lambda: reader.cycles().select(*every).collect().item(0, 0))
        reader.retried(lambda: _read_minutes(reader.folder))
        events = reader.events()
        losses = [event.details for event in events if event.kind == "loss"]
        span = reader.span() or (None, None)
        own = () if path is None else (path, path.with_name(f"{path.name}-wal"))
        return Condition(
            *span,
            cycles=int(cycles),
            starts=sum(event.code == "event-loop_started" for event in events),
            events=len(events),
            lost_cycles=sum(int(details.get("cycles") or 0) for details in losses),
            lost_events=sum(int(details.get("events") or 0) for details in losses),
            size_bytes=_size_of((*own, *reader.folder.glob("day=*/*.parquet"))),
        )


def _read_minutes(folder: Path) -> None:
    for part in (part for day in days_of(folder).values() for part in parts_of(day)):
        pl.scan_parquet(part.minutes).select(pl.all().hash().sum()).collect()


def _size_of(files: Sequence[Path]) -> int:
    return sum(file.stat().st_size for file in files if file.exists())


def copy_history(url: str, target: Path) -> None:
    """Copy a history of SQLite while the loop writes to it; the copy is whole and clean.

    Copying the files of a running database one after the other is no way: the log may be emptied
    between the two. The finished parts are copied into a folder beside the copy.
    """
    path = check_url(url, key="HISTORY")
    if path is None:
        raise ConfigurationError("server_history_copied", file=url)
    folder, part = (
        history_folder(f"sqlite:///{target}", None),
        target.with_name(f"{target.name}.part"),
    )
    for taken in (target, folder, part):
        if taken.exists():
            raise ConfigurationError("file_exists", file=taken)

    def copied() -> None:
        part.unlink(missing_ok=True)
        _copy_database(path, part)  # first: of what is in files by now it may have rows as well
        shutil.rmtree(folder, ignore_errors=True)
        for file in reader.folder.glob("day=*/*.parquet"):
            copy = folder / file.relative_to(reader.folder.parent)
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(file, copy)

    try:
        with HistoryReader(url) as reader:
            reader.span()  # refuses where the folder is gone
            reader.retried(copied)
        part.rename(target)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    finally:
        part.unlink(missing_ok=True)


def _copy_database(path: Path, part: Path) -> None:
    source = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True, timeout=5.0)
    try:
        source.execute("VACUUM INTO ?", (str(part),))
        with sqlite3.connect(part) as copy:
            copy.execute("UPDATE history SET value = '' WHERE name = 'folder'")
        copy.close()
    except sqlite3.Error as error:
        raise OSError(f"{part}: {error}") from error
    finally:
        source.close()
