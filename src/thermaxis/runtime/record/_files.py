"""The files of a recording: rows are appended, whole lines only, whatever the disk says.

::

    FOLDER/lathe-2026-11-21.csv             the log: time and one column per channel
    FOLDER/lathe-2026-11-21-2.csv           the next one of that day, if there is one
    FOLDER/sources/lathe-2026-11-21.csv     the same rows: status, source time stamp, remark

Lines that begin with ``#`` say what happened between two rows: gaps, losses, jumps of the clock,
connections. Readers of the log pass over them.

Not protected: a disk that reports a write as done and loses it; a folder on a network that hangs.
"""

import errno
import os
import re
from collections.abc import Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from pathlib import Path
from typing import Final, NamedTuple, final

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
_CHUNK_BYTES = 256 * 1024
_TAIL_BYTES = 4_000_000
_MOST_TRIES = 1000
_NEW = os.O_CREAT | os.O_EXCL


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
class _AppendFile:
    """A file that grows by whole lines; after a failed write it is as long as before."""

    def __init__(self, path: Path, *, new: bool) -> None:
        flags = os.O_RDWR | os.O_APPEND | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
        self.path = path
        self._fd = os.open(path, flags | (_NEW if new else 0), 0o644)
        self.size = os.fstat(self._fd).st_size

    def append(self, content: bytes) -> None:
        """Write all of it, or nothing."""
        if os.fstat(self._fd).st_size != self.size:
            os.ftruncate(self._fd, self.size)  # what a failed write left behind
        left = memoryview(content)
        try:
            while left:
                left = left[os.write(self._fd, left) :]
        except OSError:
            with suppress(OSError):
                os.ftruncate(self._fd, self.size)
            raise
        self.size += len(content)

    def cut(self, size: int) -> None:
        """Make it shorter: what does not belong there is gone with the next write at the latest."""
        self.size = size
        with suppress(OSError):
            os.ftruncate(self._fd, size)

    def is_there(self) -> bool:
        """Return whether the file still has its name; what nobody finds need not be written."""
        try:
            return os.path.samestat(self.path.stat(), os.fstat(self._fd))
        except FileNotFoundError:
            return False

    def remove(self) -> None:
        """Close and delete a file that could not be begun."""
        self.close()
        with suppress(OSError):
            self.path.unlink()

    def sync(self) -> None:
        os.fsync(self._fd)

    def close(self) -> None:
        with suppress(OSError):
            os.close(self._fd)


@final
@dataclass(slots=True)
class _Pair:
    """The log and the file of sources that are written now."""

    first_day: date
    number: int
    log: _AppendFile
    sources: _AppendFile
    last_row_ms: float | None = None
    """Time of the last row in the log; None before the first. [ms since 1970]"""
    note: bytes = b""
    """Lines that stand before the next entry in the log."""

    def append(self, log: bytes, sources: bytes) -> None:
        """Write both, or nothing."""
        before = self.sources.size
        self.sources.append(sources)
        try:
            self.log.append(log)
        except OSError:
            self.sources.cut(before)
            raise

    def close(self) -> None:
        self.log.close()
        self.sources.close()


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
        self.folder = folder
        self._name = name
        self._heads = heads
        self._days = days_per_file
        self._largest_bytes = largest_bytes
        self._gap_ms = GAP_STEPS * step_ms
        self._step_ms = step_ms
        self._pair: _Pair | None = None
        self._resumed = False
        self._last_row_ms: float | None = None
        self._synced_ms = 0.0
        self._chunk_bytes = _CHUNK_BYTES
        self._finished: list[Path] = []
        self.written: list[Path] = []
        """Logs that were begun or went on, in order."""

    @property
    def current(self) -> Path | None:
        """The log that is written now."""
        return None if self._pair is None else self._pair.log.path

    def take_finished(self) -> list[Path]:
        """Return the logs that are complete since the last call."""
        finished, self._finished = self._finished, []
        return finished

    def store(self, entries: Sequence[Entry]) -> Stored:
        """Write entries, as far as the disk takes them."""
        done = 0
        try:
            while done < len(entries):
                done += self._store_some(entries, done)
            self._sync(entries[-1].log_ms if entries else 0.0)
        except OSError as error:
            return Stored(done, error.strerror or type(error).__name__)
        return Stored(done)

    def _store_some(self, entries: Sequence[Entry], begin: int) -> int:
        """Write some entries into one pair of files; return how many. [1]"""
        pair = self._pair_for(entries[begin])
        while True:
            count, log, sources = self._chunk(pair, entries, begin)
            try:
                pair.append(log, sources)
            except OSError:
                if count == 1:
                    raise
                self._chunk_bytes = (len(log) + len(sources)) // 2  # what room is left is used
                continue
            self._chunk_bytes = min(_CHUNK_BYTES, 2 * self._chunk_bytes + 1)
            pair.note = b""
            rows = [entry.log_ms for entry in entries[begin : begin + count] if entry.is_row]
            if rows:
                pair.last_row_ms = self._last_row_ms = rows[-1]
            return count

    def close(self) -> None:
        """End: the files are complete."""
        if self._pair is not None:
            with suppress(OSError):
                self._pair.log.sync()
                self._pair.sources.sync()
            self._finish()

    # Which file ------------------------------------------------------------------------------

    def _pair_for(self, entry: Entry) -> _Pair:
        pair = self._pair
        day = moment_of(entry.log_ms).date()
        if pair is not None and not (pair.log.is_there() and pair.sources.is_there()):
            pair.close()
            self._pair = pair = None
        if pair is not None and self._is_full(pair, entry):
            self._finish()
            pair = None
        if pair is None:
            pair = self._resume(day, entry.log_ms) or self._begin(day, entry.log_ms)
            self._pair = pair
            self.written.append(pair.log.path)
        return pair

    def _is_full(self, pair: _Pair, entry: Entry) -> bool:
        """Return whether a row belongs into other files; what happened never begins one."""
        if not entry.is_row:
            return False
        sizes = (pair.log.size + len(entry.log), pair.sources.size + len(entry.sources))
        too_large = max(sizes) > self._largest_bytes and pair.last_row_ms is not None
        return too_large or not self._belongs(pair, entry)

    def _finish(self) -> None:
        if self._pair is not None:
            self._pair.close()
            self._finished.append(self._pair.log.path)
            self._pair = None

    def _begin(self, day: date, log_ms: float) -> _Pair:
        """Make new files; no file that is there is touched."""
        sources = self.folder / SOURCES_FOLDER
        sources.mkdir(parents=True, exist_ok=True)
        taken = [number for first, number, _ in self._names(every=True) if first == day]
        first = max(taken, default=0) + 1
        for number in range(first, first + _MOST_TRIES):
            name = self._file_name(day, number)
            made: list[_AppendFile] = []
            try:
                made.append(_AppendFile(sources / name, new=True))
                made[-1].append(self._heads.sources)
                made.append(_AppendFile(self.folder / name, new=True))
                made[-1].append(self._heads.log)
            except OSError as error:
                for file in made:
                    file.remove()
                if isinstance(error, FileExistsError):
                    continue
                raise
            pair = _Pair(day, number, made[1], made[0])
            if self._last_row_ms is not None and log_ms - self._last_row_ms > self._gap_ms:
                pair.note = _gap_mark(self._last_row_ms, log_ms).log
            return pair
        raise OSError(errno.EEXIST, f"no free name for a file of {day.isoformat()}")

    def _resume(self, day: date, log_ms: float) -> _Pair | None:
        """Open the last files of an earlier recording if the row can follow theirs."""
        if self._resumed:
            return None
        self._resumed = True
        known = [
            (first, number, path)
            for first, number, path in self._names()
            if 0 <= (day - first).days < self._days
        ]
        if not known:
            return None
        first, number, path = max(known)
        beside = self.folder / SOURCES_FOLDER / path.name
        log_end = _end_of(path, self._heads.log, self._heads.channels + 1)
        sources_end = _end_of(beside, self._heads.sources, 3 * self._heads.channels + 1)
        if log_end is None or sources_end is None:
            return None
        last_ms = log_end.last_row_ms
        if last_ms is not None and last_ms >= log_ms:
            return None
        if max(log_end.size, sources_end.size) >= self._largest_bytes:
            return None
        log = _AppendFile(path, new=False)
        try:
            sources = _AppendFile(beside, new=False)
        except OSError:
            log.close()
            raise
        pair = _Pair(first, number, log, sources, last_ms)
        torn = log.size - log_end.size
        if torn:
            pair.note = mark(log_ms, Message("recording-repaired", {"bytes": torn})).log
        log.cut(log_end.size)
        sources.cut(sources_end.size)
        self._last_row_ms = last_ms
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
        folders = (self.folder, self.folder / SOURCES_FOLDER) if every else (self.folder,)
        found: list[tuple[date, int, Path]] = []
        for folder in folders:
            for path in folder.iterdir() if folder.is_dir() else ():
                match = form.fullmatch(path.name)
                if match is not None:
                    with suppress(ValueError):
                        found.append((date.fromisoformat(match[1]), int(match[2] or 1), path))
        return found

    def _file_name(self, day: date, number: int) -> str:
        return f"{self._name}-{day.isoformat()}{'' if number == 1 else f'-{number}'}.csv"

    def delete_before(self, day: date) -> list[Path]:
        """Delete files whose last day lies before another day."""
        gone: list[Path] = []
        kept = self.current
        for first, _, path in self._names(every=True):
            last = first + timedelta(days=self._days - 1)
            if last < day and (kept is None or path.name != kept.name):
                with suppress(OSError):
                    path.unlink()
                    gone.append(path)
        return gone

    # What is written -------------------------------------------------------------------------

    def _chunk(self, pair: _Pair, entries: Sequence[Entry], begin: int) -> tuple[int, bytes, bytes]:
        """Return how many entries come next into these files, and their lines."""
        log, sources = bytearray(pair.note), bytearray()
        count = 0
        last_ms = pair.last_row_ms
        for entry in entries[begin:]:
            largest = max(pair.log.size + len(log), pair.sources.size + len(sources)) + entry.size
            other = entry.is_row and not self._belongs(pair, entry)
            large = entry.is_row and largest > self._largest_bytes
            if count and (
                other or large or len(log) + len(sources) + entry.size > self._chunk_bytes
            ):
                break
            if entry.is_row:
                if last_ms is not None and entry.log_ms - last_ms > self._gap_ms:
                    self._mark_gap(last_ms, entry.log_ms, log, sources)
                last_ms = entry.log_ms
            log += entry.log
            sources += entry.sources
            count += 1
        return count, bytes(log), bytes(sources)

    def _mark_gap(self, last_ms: float, next_ms: float, log: bytearray, sources: bytearray) -> None:
        """Write what happened, and a row without values: no line is drawn across it."""
        log += _gap_mark(last_ms, next_ms).log
        time = as_text(last_ms + self._step_ms).encode("ascii")
        log += time + b"," * self._heads.channels + b"\n"
        sources += time + b"," * (3 * self._heads.channels) + b"\n"

    def _belongs(self, pair: _Pair, entry: Entry) -> bool:
        day = moment_of(entry.log_ms).date()
        return 0 <= (day - pair.first_day).days < self._days

    def _sync(self, log_ms: float) -> None:
        if self._pair is not None and abs(log_ms - self._synced_ms) >= SYNC_EVERY_MS:
            self._synced_ms = log_ms
            self._pair.log.sync()
            self._pair.sources.sync()


def _gap_mark(last_ms: float, next_ms: float) -> Entry:
    values = {"since": as_text(last_ms), "lasted_s": (next_ms - last_ms) / 1000.0}
    return mark(next_ms, Message("recording-gap", values))


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
            tail = stream.read()
    except FileNotFoundError:
        return None
    lines = tail.split(b"\n")
    torn = len(lines.pop())
    while lines and not (lines[-1].startswith(b"#") or _row_ms(lines[-1], cells) is not None):
        torn += len(lines.pop()) + 1
    rows = (found for line in reversed(lines) if (found := _row_ms(line, cells)) is not None)
    last_ms = next(rows, None)
    if last_ms is None and begin > len(head):
        return None
    return _End(size - torn, last_ms)


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
