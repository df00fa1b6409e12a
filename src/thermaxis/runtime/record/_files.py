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
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from datetime import date, datetime
from pathlib import Path
from typing import Final, NamedTuple, TypeGuard, final

from thermaxis.codes import Message, Place
from thermaxis.errors import ConfigurationError
from thermaxis.messages import sentence_of
from thermaxis.runtime.host import held_lock
from thermaxis.runtime.record._clock import as_text, moment_of
from thermaxis.runtime.record._config import RecordSettings
from thermaxis.runtime.record._parquet import write_parquet

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


def heads_of(settings: RecordSettings) -> tuple[bytes, bytes]:
    """Return the first lines of log and file of sources, with their ends."""
    lines = [f"# thermaxis record 1: {settings.name}"]
    for name, connection in settings.connections.items():
        lines.append(f"# connection {name}: {connection.url}, security {connection.security}")
    for channel in settings.channels:
        words = f"# channel {channel.name}: {channel.node} of {channel.connection}, unit"
        words += f" {channel.unit or '1'}, every {channel.period_ms / 1000.0:g} s"
        if (channel.factor, channel.offset) != (1.0, 0.0):
            words += f", value * {channel.factor!r} + {channel.offset!r}"
        lines.append(words)
    plain = ["".join(c if c.isascii() and c.isprintable() else "?" for c in s) for s in lines]
    head = "\n".join(plain) + "\n"
    names = ",".join(["time", *(channel.heading for channel in settings.channels)])
    beside = ["time"]
    for channel in settings.channels:
        beside += [f"{channel.name} {word}" for word in ("status", "source_time", "remark")]
    return f"{head}{names}\n".encode("ascii"), f"{head}{','.join(beside)}\n".encode("ascii")


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
        settings: RecordSettings,
        folder: Path,
        tell: Callable[[Message], None] = lambda _: None,
    ) -> None:
        self._settings = settings
        self._folder = folder
        self._tell = tell
        self._log_head, self._sources_head = heads_of(settings)
        self._channels = len(settings.channels)
        self._step_ms = settings.fastest_ms
        self._pair: _Pair | None = None
        self._last_row_ms: float | None = None
        self._synced_ms = 0.0
        self.written: list[Path] = []
        """Logs that were begun or went on, in order."""

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
        """End: the files are complete, and what is older than is kept goes."""
        pair, self._pair = self._pair, None
        if pair is None:
            return
        with suppress(OSError):
            pair.append(b"", b"", sync=True)
        path = pair.log.path
        try:
            if self._settings.parquet:
                write_parquet(path, path.parent / SOURCES_FOLDER / path.name)
        except OSError as error:
            values = {"file": path.name, "cause": error.strerror or str(error)}
            self._tell(Message("recording-parquet_unwritten", values))
        if self._settings.keep_days is not None:
            self._retire(pair.first_day, self._settings.keep_days)

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
        too_large = size > 1e6 * self._settings.largest_mb and (
            pair.last_row_ms is not None or sources > 0
        )
        return too_large or not self._covers(pair.first_day, moment_of(entry.log_ms).date())

    def _covers(self, first: date, day: date) -> bool:
        return 0 <= (day - first).days < self._settings.days_per_file

    def _begin(self, day: date, log_ms: float) -> _Pair:
        """Make new files; no file that is there is touched."""
        beside = self._folder / SOURCES_FOLDER
        beside.mkdir(parents=True, exist_ok=True)
        number = 1 + max((n for first, n, _ in self._names(every=True) if first == day), default=0)
        name = f"{self._settings.name}-{day.isoformat()}{'' if number == 1 else f'-{number}'}.csv"
        made: list[_File] = []
        try:
            for folder, head in (
                (beside, self._sources_head),
                (self._folder, self._log_head),
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
        log_end = _end_of(path, self._log_head, self._channels + 1)
        sources_end = _end_of(beside, self._sources_head, 3 * self._channels + 1)
        if log_end is None or sources_end is None:
            return None
        (size, last_ms), (sources_size, _) = log_end, sources_end
        if last_ms is not None and last_ms >= log_ms:
            return None
        if max(size, sources_size) >= 1e6 * self._settings.largest_mb:
            return None
        torn = path.stat().st_size - size
        pair = _Pair(first, _File(path, size), _File(beside, sources_size), last_ms)
        pair.log.cut(size)
        pair.sources.cut(sources_size)
        if torn:
            pair.note = mark(log_ms, Message("recording-repaired", {"bytes": torn})).log
        return pair

    def _names(self, *, every: bool = False) -> list[tuple[date, int, Path]]:
        """Return first day, number and path of the logs in the folder.

        With `every` also of names that only a file of sources or a Parquet file has: their
        numbers are taken as well.
        """
        form = re.compile(
            re.escape(self._settings.name)
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

    def _retire(self, day: date, keep_days: int) -> None:
        """Of the files before a day keep the newest, so many as have the days to be kept.

        Days without files do not count: a clock that jumps forward takes nothing away.
        """
        files = [found for found in self._names(every=True) if found[0] < day]
        days = sorted({first for first, _, _ in files})
        old = days[: max(0, len(days) - -(-keep_days // self._settings.days_per_file))]
        for path in (path for first, _, path in files if first in old):
            with suppress(OSError):
                path.unlink()

    # Gaps ------------------------------------------------------------------------------------

    def _is_gap(self, last_ms: float | None, next_ms: float) -> TypeGuard[float]:
        return last_ms is not None and next_ms - last_ms > GAP_STEPS * self._step_ms

    def _mark_gap(self, last_ms: float, next_ms: float, log: bytearray, sources: bytearray) -> None:
        """Write what happened, and a row without values: no line is drawn across it."""
        log += _gap_mark(last_ms, next_ms)
        time = as_text(last_ms + self._step_ms).encode("ascii")
        log += time + b"," * self._channels + b"\n"
        sources += time + b"," * (3 * self._channels) + b"\n"


def _gap_mark(last_ms: float, next_ms: float) -> bytes:
    values = {"since": as_text(last_ms), "lasted_s": (next_ms - last_ms) / 1000.0}
    return mark(next_ms, Message("recording-gap", values)).log


def _end_of(path: Path, head: bytes, cells: int) -> tuple[int, float | None] | None:
    """Return where the whole lines of a file of ours end, and the time of its last row.

    None if it is another's, or too damaged.
    """
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
    return None if last_ms is None and begin > len(head) else (size, last_ms)


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
