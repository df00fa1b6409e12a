"""The files of a recording: rows are appended, whole lines only, whatever the disk says.

::

    FOLDER/lathe-2026-11-21.csv             the log: time and one column per channel
    FOLDER/lathe-2026-11-21-2.csv           the next one of that day, if there is one
    FOLDER/sources/lathe-2026-11-21.csv     the same rows: status, source time stamp, remark

Lines that begin with ``#`` say what happened between two rows: gaps, losses, jumps of the clock,
connections. Readers of the log pass over them.

Not protected: a disk that reports a write as done and loses it; a folder on a network that hangs.
"""

import os
import re
from collections.abc import Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from pathlib import Path
from typing import Final, NamedTuple, TypeGuard, final

from thermaxis.codes import Message, Place
from thermaxis.errors import ConfigurationError
from thermaxis.messages import sentence_of
from thermaxis.runtime.host import held_lock
from thermaxis.runtime.record._clock import as_text, moment_of

SOURCES_FOLDER: Final = "sources"
"""Folder of the files of sources, inside that of the logs: `*.csv` means logs only."""
GAP_STEPS: Final = 2.5
"""A time between rows of more steps than this is marked as a gap; the check of logs calls it one
as well. [1]"""
SYNC_EVERY_MS: Final = 10_000.0
"""What was written reaches the disk itself so often, as far as the log's time tells. [ms]"""
_MOST_AT_ONCE = 50
_TAIL_BYTES = 4_000_000
_APPEND = os.O_WRONLY | os.O_APPEND | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)


class Entry(NamedTuple):
    """A row, or a line that says what happened before the next row."""

    log_ms: float
    """Time of the log. [ms since 1970]"""
    log: bytes
    """Line of the log, with its end."""
    sources: bytes
    """Line of the file of sources; empty for what is no row."""

    @property
    def is_row(self) -> bool:
        """Whether it is a row."""
        return bool(self.sources)

    @property
    def size(self) -> int:
        """Size of both lines. [byte]"""
        return len(self.log) + len(self.sources)


class Stored(NamedTuple):
    """How an attempt to store went."""

    entries: int
    """Entries that were written, from the first on. [1]"""
    error: str = ""
    """Why no more were written, in words; empty if all were."""


class Heads(NamedTuple):
    """First lines of both files, with their ends."""

    log: bytes
    """Comments and headings of the log."""
    sources: bytes
    """Comments and headings of the file of sources."""
    channels: int
    """Columns of the log beside the time. [1]"""


def mark(log_ms: float, message: Message) -> Entry:
    """Return a line that says what happened at a time [ms since 1970]."""
    plain = "".join(c if c.isascii() and c.isprintable() else "?" for c in sentence_of(message))
    return Entry(log_ms, f"# {as_text(log_ms)} {plain}\n".encode("ascii"), b"")


@final
@dataclass(slots=True)
class _File:
    """A file that grows by whole lines."""

    path: Path
    size: int

    def append(self, content: bytes, *, sync: bool) -> None:
        """Write all of it, or nothing."""
        descriptor = os.open(self.path, _APPEND)
        try:
            left = memoryview(content)
            while left:
                left = left[os.write(descriptor, left) :]
            if sync:
                os.fsync(descriptor)
        except OSError:
            os.ftruncate(descriptor, self.size)
            raise
        finally:
            os.close(descriptor)
        self.size += len(content)

    def cut(self, size: int) -> None:
        """Make it as long as it was."""
        os.truncate(self.path, size)
        self.size = size

    def is_as_left(self) -> bool:
        """Return whether it has its name still, and nobody else has written to it."""
        try:
            return self.path.stat().st_size == self.size
        except FileNotFoundError:
            return False


@final
@dataclass(slots=True)
class _Pair:
    """The log and the file of sources that are written now."""

    first_day: date
    log: _File
    sources: _File
    last_row_ms: float | None = None
    """Time of the last row in the log; None before the first. [ms since 1970]"""
    note: bytes = b""
    """Lines that stand before the next entry in the log."""

    def append(self, log: bytes, sources: bytes, *, sync: bool) -> None:
        """Write both, or nothing."""
        before = self.sources.size
        self.sources.append(sources, sync=sync)
        try:
            self.log.append(log, sync=sync)
        except OSError:
            self.sources.cut(before)
            raise


@final
class RecordingFiles:
    """Writes entries to files by day and size, and goes on where an earlier recording ended."""

    def __init__(
        self,
        folder: Path,
        name: str,
        heads: Heads,
        *,
        days_per_file: int,
        largest_bytes: int,
        step_ms: int,
    ) -> None:
        self._folder = folder
        self._name = name
        self._heads = heads
        self._days = days_per_file
        self._largest_bytes = largest_bytes
        self._step_ms = step_ms
        self._pair: _Pair | None = None
        self._last_row_ms: float | None = None
        self._synced_ms = 0.0
        self._finished: list[Path] = []
        self.written: list[Path] = []
        """Logs that were begun or went on, in order."""

    def take_finished(self) -> list[Path]:
        """Return the logs that are complete since the last call."""
        finished, self._finished = self._finished, []
        return finished

    def store(self, entries: Sequence[Entry]) -> Stored:
        """Write entries, as far as the disk takes them."""
        done = 0
        try:
            while done < len(entries):
                done += self._store_some(entries[done : done + _MOST_AT_ONCE])
        except OSError as error:
            return Stored(done, error.strerror or type(error).__name__)
        return Stored(done)

    def _store_some(self, entries: Sequence[Entry]) -> int:
        """Write the first entries, those of one pair of files; return how many. [1]"""
        pair = self._pair_for(entries[0])
        log, sources = bytearray(pair.note), bytearray()
        last_ms = pair.last_row_ms
        count = 0
        for entry in entries:
            if count and self._is_full(pair, entry, len(log), len(sources)):
                break
            if entry.is_row:
                if self._is_gap(last_ms, entry.log_ms):
                    self._mark_gap(last_ms, entry.log_ms, log, sources)
                last_ms = entry.log_ms
            log += entry.log
            sources += entry.sources
            count += 1
        sync = abs(entries[0].log_ms - self._synced_ms) >= SYNC_EVERY_MS
        pair.append(bytes(log), bytes(sources), sync=sync)
        if sync:
            self._synced_ms = entries[0].log_ms
        pair.note = b""
        pair.last_row_ms = last_ms
        self._last_row_ms = self._last_row_ms if last_ms is None else last_ms
        return count

    def close(self) -> None:
        """End: the files are complete."""
        if self._pair is not None:
            with suppress(OSError):
                self._pair.append(b"", b"", sync=True)
            self._finished.append(self._pair.log.path)
            self._pair = None

    # Which file ------------------------------------------------------------------------------

    def _pair_for(self, entry: Entry) -> _Pair:
        pair = self._pair
        if pair is not None and not (pair.log.is_as_left() and pair.sources.is_as_left()):
            pair = None
        elif pair is not None and self._is_full(pair, entry):
            self.close()
            pair = None
        if pair is None:
            day = moment_of(entry.log_ms).date()
            pair = self._resume(day, entry.log_ms) or self._begin(day, entry.log_ms)
            self.written.append(pair.log.path)
        self._pair = pair
        return pair

    def _is_full(self, pair: _Pair, entry: Entry, log: int = 0, sources: int = 0) -> bool:
        """Return whether a row belongs into other files; what happened never begins one.

        Beside what the files have, so many bytes will be written before it.
        """
        if not entry.is_row:
            return False
        size = max(
            pair.log.size + log + len(entry.log), pair.sources.size + sources + len(entry.sources)
        )
        too_large = size > self._largest_bytes and (pair.last_row_ms is not None or sources > 0)
        return too_large or not self._covers(pair.first_day, moment_of(entry.log_ms).date())

    def _covers(self, first: date, day: date) -> bool:
        return 0 <= (day - first).days < self._days

    def _begin(self, day: date, log_ms: float) -> _Pair:
        """Make new files; no file that is there is touched."""
        beside = self._folder / SOURCES_FOLDER
        beside.mkdir(parents=True, exist_ok=True)
        number = 1 + max((n for first, n, _ in self._names(every=True) if first == day), default=0)
        name = f"{self._name}-{day.isoformat()}{'' if number == 1 else f'-{number}'}.csv"
        made: list[_File] = []
        try:
            for folder, head in (
                (beside, self._heads.sources),
                (self._folder, self._heads.log),
            ):
                with (folder / name).open("xb") as stream:
                    made.append(_File(folder / name, len(head)))
                    stream.write(head)
        except OSError:
            for file in made:
                file.path.unlink(missing_ok=True)
            raise
        pair = _Pair(day, made[1], made[0])
        if self._is_gap(self._last_row_ms, log_ms):
            pair.note = _gap_mark(self._last_row_ms, log_ms)
        return pair

    def _resume(self, day: date, log_ms: float) -> _Pair | None:
        """Return the last files of an earlier recording if the row can follow theirs."""
        names = [found for found in self._names() if self._covers(found[0], day)]
        if self.written or not names:
            return None
        first, _, path = max(names)
        beside = self._folder / SOURCES_FOLDER / path.name
        channels = self._heads.channels
        log_end = _end_of(path, self._heads.log, channels + 1)
        sources_end = _end_of(beside, self._heads.sources, 3 * channels + 1)
        if log_end is None or sources_end is None:
            return None
        last_ms = log_end.last_row_ms
        if last_ms is not None and last_ms >= log_ms:
            return None
        if max(log_end.size, sources_end.size) >= self._largest_bytes:
            return None
        torn = path.stat().st_size - log_end.size
        pair = _Pair(first, _File(path, log_end.size), _File(beside, sources_end.size), last_ms)
        pair.log.cut(log_end.size)
        pair.sources.cut(sources_end.size)
        if torn:
            pair.note = mark(log_ms, Message("recording-repaired", {"bytes": torn})).log
        return pair

    def _names(self, *, every: bool = False) -> list[tuple[date, int, Path]]:
        """Return first day, number and path of the logs in the folder.

        With `every` also of names that only a file of sources or a Parquet file has: their
        numbers are taken as well.
        """
        form = re.compile(
            re.escape(self._name)
            + r"-([0-9]{4}-[0-9]{2}-[0-9]{2})(?:-([0-9]{1,6}))?\."
            + ("(?:csv|parquet)" if every else "csv")
        )
        folders = (self._folder, self._folder / SOURCES_FOLDER) if every else (self._folder,)
        found: list[tuple[date, int, Path]] = []
        for path in (path for folder in folders if folder.is_dir() for path in folder.iterdir()):
            match = form.fullmatch(path.name)
            if match is not None:
                with suppress(ValueError):
                    found.append((date.fromisoformat(match[1]), int(match[2] or 1), path))
        return found

    def delete_before(self, day: date) -> None:
        """Delete files whose last day lies before another day."""
        kept = None if self._pair is None else self._pair.log.path.name
        for first, _, path in self._names(every=True):
            if first + timedelta(days=self._days - 1) < day and path.name != kept:
                with suppress(OSError):
                    path.unlink()

    # Gaps ------------------------------------------------------------------------------------

    def _is_gap(self, last_ms: float | None, next_ms: float) -> TypeGuard[float]:
        return last_ms is not None and next_ms - last_ms > GAP_STEPS * self._step_ms

    def _mark_gap(self, last_ms: float, next_ms: float, log: bytearray, sources: bytearray) -> None:
        """Write what happened, and a row without values: no line is drawn across it."""
        log += _gap_mark(last_ms, next_ms)
        time = as_text(last_ms + self._step_ms).encode("ascii")
        log += time + b"," * self._heads.channels + b"\n"
        sources += time + b"," * (3 * self._heads.channels) + b"\n"


def _gap_mark(last_ms: float, next_ms: float) -> bytes:
    values = {"since": as_text(last_ms), "lasted_s": (next_ms - last_ms) / 1000.0}
    return mark(next_ms, Message("recording-gap", values)).log


class _End(NamedTuple):
    """Where the whole lines of a file end."""

    size: int
    """Length up to there. [byte]"""
    last_row_ms: float | None
    """Time of the last row; None without one. [ms since 1970]"""


def _end_of(path: Path, head: bytes, cells: int) -> _End | None:
    """Find the last whole line of a file of ours; None if it is another's, or too damaged."""
    try:
        with path.open("rb") as stream:
            if stream.read(len(head)) != head:
                return None
            size = stream.seek(0, os.SEEK_END)
            begin = stream.seek(max(len(head), size - _TAIL_BYTES))
            lines = stream.read().split(b"\n")
    except FileNotFoundError:
        return None
    size -= len(lines.pop())
    while lines and not (lines[-1].startswith(b"#") or _row_ms(lines[-1], cells) is not None):
        size -= len(lines.pop()) + 1
    rows = (found for line in reversed(lines) if (found := _row_ms(line, cells)) is not None)
    last_ms = next(rows, None)
    return None if last_ms is None and begin > len(head) else _End(size, last_ms)


def _row_ms(line: bytes, cells: int) -> float | None:
    """Return the time of a row; None if the line is no whole row. [ms since 1970]"""
    if line.count(b",") != cells - 1 or b"\x00" in line:
        return None
    try:
        moment = datetime.fromisoformat(line.partition(b",")[0].decode("ascii"))
    except ValueError:
        return None
    return None if moment.tzinfo is None else moment.timestamp() * 1000.0


def sole_writer(folder: Path, name: str) -> AbstractContextManager[None]:
    """Keep other recordings of the same name out of a folder, as long as this one runs."""
    taken = ConfigurationError("recording_in_use", name=name, pid="", place=Place(str(folder)))
    return held_lock(folder / f".{name}.lock", taken, required=False)
