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
from contextlib import AbstractContextManager, ExitStack, suppress
from dataclasses import dataclass
from datetime import date, datetime
from pathlib import Path
from typing import Final, NamedTuple, final

from thermaxis.codes import Message
from thermaxis.errors import ConfigurationError
from thermaxis.messages import sentence_of
from thermaxis.runtime._backlog import from_us, to_us
from thermaxis.runtime.host import held_lock, whole_file
from thermaxis.runtime.record._clock import as_text
from thermaxis.runtime.record._config import RecordSettings

SOURCES_FOLDER: Final = "sources"
"""Folder of the files of sources, inside that of the logs: `*.csv` means logs only."""
GAP_STEPS: Final = 2.5
"""A time between rows of more steps than this is marked as a gap; the check of logs calls it one
as well. [1]"""
SYNC_EVERY_US: Final = 10_000_000
"""What was written reaches the disk itself so often, as far as the log's time tells. [µs]"""
_TAIL_BYTES = 4_000_000
_TIME_FORMAT = "%Y-%m-%dT%H:%M:%S%.3fZ"


class Entry(NamedTuple):
    """A row, or a line that says what happened before the next row."""

    utc_us: int
    """Time of the log. [µs since 1970]"""
    log: bytes
    """Lines of the log, with their ends."""
    sources: bytes = b""
    """Line of the file of sources; empty for what is no row."""

    @property
    def is_row(self) -> bool:
        """Whether it is a row."""
        return bool(self.sources)

    @property
    def size(self) -> int:
        """Size of all lines. [byte]"""
        return len(self.log) + len(self.sources)


def mark(log_us: int, message: Message) -> Entry:
    """Return a line that says what happened at a time [µs since 1970]."""
    return Entry(log_us, _plain(f"# {as_text(log_us)} {sentence_of(message)}"))


def _plain(line: str) -> bytes:
    text = "".join(c if c.isascii() and c.isprintable() else "?" for c in line)
    return f"{text}\n".encode("ascii")


def heads_of(settings: RecordSettings) -> tuple[bytes, bytes]:
    """Return the first lines of log and file of sources, with their ends."""
    lines = [f"# thermaxis record 1: {settings.name}"]
    for name, connection in settings.connections.items():
        lines.append(f"# connection {name}: {connection.url}, security {connection.security}")
    log, sources = "time", "time"
    for channel in settings.channels:
        words = f"# channel {channel.name}: {channel.node} of {channel.connection}, unit"
        words += f" {channel.unit or '1'}, every {channel.period_ms / 1000.0:g} s"
        if (channel.factor, channel.offset) != (1.0, 0.0):
            words += f", value * {channel.factor!r} + {channel.offset!r}"
        lines.append(words)
        log += f",{channel.heading}"
        sources += "".join(f",{channel.name} {w}" for w in ("status", "source_time", "remark"))
    head = b"".join(map(_plain, lines))
    return head + _plain(log), head + _plain(sources)


@final
@dataclass(slots=True)
class _Pair:
    """The log and the file of sources that are written now."""

    first_day: date
    paths: Sequence[Path]
    sizes: Sequence[int]
    has_rows: bool = False
    note: bytes = b""
    """Lines that stand before the next entry in the log."""

    def append(self, *lines: bytes, sync: bool) -> None:
        """Write to both, or nothing; a row of the log that a kill leaves has its sources."""
        lines = self.note + lines[0], lines[1]
        with ExitStack() as opened:
            files = [opened.enter_context(path.open("r+b", buffering=0)) for path in self.paths]
            try:
                for file, content in reversed([*zip(files, lines, strict=True)]):
                    file.seek(0, os.SEEK_END)
                    left = memoryview(content)
                    while left:
                        left = left[os.write(file.fileno(), left) :]
                    if sync:
                        os.fsync(file.fileno())
            except OSError:
                for file, size in zip(files, self.sizes, strict=True):
                    os.ftruncate(file.fileno(), size)
                raise
        self.note, self.sizes = b"", self.sizes_with(lines)

    def sizes_with(self, lines: Sequence[bytes]) -> Sequence[int]:
        """Return the sizes after lines were written. [byte]"""
        return [size + len(more) for size, more in zip(self.sizes, lines, strict=True)]

    def is_as_left(self) -> bool:
        """Return whether both have their names still, and nobody else has written to them."""
        try:
            return [path.stat().st_size for path in self.paths] == self.sizes
        except FileNotFoundError:
            return False


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
        self._folders = folder, folder / SOURCES_FOLDER
        self._tell = tell
        self._heads = heads_of(settings)
        self._step_us = 1000 * settings.fastest_ms
        self._pair: _Pair | None = None
        self._last_us = 0
        self._synced_us = 0
        self.written: list[Path] = []
        """Logs that were begun or went on, in order."""

    def store(self, entry: Entry) -> None:
        """Write an entry, all of it or nothing.

        Raises
        ------
        OSError
            If the disk does not take it.
        """
        pair = self._pair_for(entry)
        _, log, sources = entry
        last_us = self._last_us
        if entry.is_row and 0 < last_us < entry.utc_us - GAP_STEPS * self._step_us:
            lasted_s = (entry.utc_us - last_us) / 1e6
            gap = Message("recording-gap", {"since": as_text(last_us), "lasted_s": lasted_s})
            empty = b"", b""
            if pair.has_rows:  # a row without values: no line is drawn across
                time = as_text(last_us + self._step_us)
                channels = len(self._settings.channels)
                empty = _plain(time + "," * channels), _plain(time + "," * 3 * channels)
            log, sources = mark(entry.utc_us, gap).log + empty[0] + log, empty[1] + sources
        sync = abs(entry.utc_us - self._synced_us) >= SYNC_EVERY_US
        pair.append(log, sources, sync=sync)
        if sync:
            self._synced_us = entry.utc_us
        if entry.is_row:
            pair.has_rows, self._last_us = True, entry.utc_us

    def close(self) -> None:
        """End: the files are complete, and what is older than is kept goes."""
        pair, self._pair = self._pair, None
        if pair is None:
            return
        with suppress(OSError):
            pair.append(b"", b"", sync=True)
        if self._settings.parquet:
            try:
                write_parquet(*pair.paths)
            except OSError as error:
                values = {"file": pair.paths[0].name, "cause": error.strerror or str(error)}
                self._tell(Message("recording-parquet_unwritten", values))
        if self._settings.keep_days is not None:
            self._retire(pair.first_day, self._settings.keep_days)

    # Which file ------------------------------------------------------------------------------

    def _pair_for(self, entry: Entry) -> _Pair:
        pair = self._pair
        if pair is not None and not pair.is_as_left():
            pair = None
        elif pair is not None and entry.is_row and self._is_full(pair, entry):
            self.close()
            pair = None
        if pair is None:
            day = from_us(entry.utc_us).date()
            pair = self._resume(day, entry.utc_us) or self._begin(day)
            self.written.append(pair.paths[0])
        self._pair = pair
        return pair

    def _is_full(self, pair: _Pair, entry: Entry) -> bool:
        """Return whether a row belongs into other files; what happened never begins one."""
        size = max(pair.sizes_with((entry.log, entry.sources)))
        too_large = pair.has_rows and size > 1e6 * self._settings.largest_mb
        return too_large or not self._covers(pair.first_day, from_us(entry.utc_us).date())

    def _covers(self, first: date, day: date) -> bool:
        return 0 <= (day - first).days < self._settings.days_per_file

    def _begin(self, day: date) -> _Pair:
        """Make new files; no file that is there is touched."""
        self._folders[1].mkdir(parents=True, exist_ok=True)
        number = 1 + max((n for first, n, _ in self._names() if first == day), default=0)
        name = f"{self._settings.name}-{day.isoformat()}{'' if number == 1 else f'-{number}'}.csv"
        paths, made = [folder / name for folder in self._folders], list[Path]()
        try:
            for path, head in zip(paths, self._heads, strict=True):
                with path.open("xb") as stream:
                    made.append(path)
                    stream.write(head)
        except OSError:
            for path in made:
                path.unlink(missing_ok=True)
            raise
        return _Pair(day, paths, list(map(len, self._heads)))

    def _resume(self, day: date, log_us: int) -> _Pair | None:
        """Return the last files of an earlier recording if the row can follow theirs."""
        folder, beside = self._folders
        known = [one for one in self._names() if self._covers(one[0], day)]
        logs = [one for one in known if one[2].parent == folder and one[2].suffix == ".csv"]
        if self.written or not logs:
            return None
        first, _, path = max(logs)
        paths = path, beside / path.name
        log, sources = map(_end_of, paths, self._heads)
        if log is None or sources is None or log[1] >= log_us:
            return None
        sizes, last_us = [log[0], sources[0]], log[1]
        if max(sizes) >= 1e6 * self._settings.largest_mb:
            return None
        torn = path.stat().st_size - sizes[0]
        for one, size in zip(paths, sizes, strict=True):
            os.truncate(one, size)
        self._last_us = last_us
        repaired = mark(log_us, Message("recording-repaired", {"bytes": torn})).log
        return _Pair(first, paths, sizes, last_us > 0, repaired if torn else b"")

    def _names(self) -> list[tuple[date, int, Path]]:
        """Return first day, number and path of every file of ours, those of Parquet included."""
        day, number = r"([0-9]{4}-[0-9]{2}-[0-9]{2})", r"(?:-([0-9]{1,6}))?"
        form = re.compile(rf"{re.escape(self._settings.name)}-{day}{number}\.(?:csv|parquet)")
        found: list[tuple[date, int, Path]] = []
        for path in (path for folder in self._folders for path in folder.glob("*")):
            if match := form.fullmatch(path.name):
                with suppress(ValueError):
                    found.append((date.fromisoformat(match[1]), int(match[2] or 1), path))
        return found

    def _retire(self, day: date, keep_days: int) -> None:
        """Of the files before a day keep the newest, so many as have the days to be kept.

        Days without files do not count: a clock that jumps forward takes nothing away.
        """
        files = [found for found in self._names() if found[0] < day]
        days = sorted({first for first, _, _ in files})
        old = days[: max(0, len(days) - -(-keep_days // self._settings.days_per_file))]
        for path in (path for first, _, path in files if first in old):
            with suppress(OSError):
                path.unlink()


def _end_of(path: Path, head: bytes) -> tuple[int, int] | None:
    """Return where a file's whole lines end [byte], and the time of its last row, 0 without one.

    None if it is another's, or damaged otherwise than by a torn last line.
    """
    try:
        with path.open("rb") as stream:
            if stream.read(len(head)) != head:
                return None
            size = stream.seek(0, os.SEEK_END)
            begin = stream.seek(max(len(head), size - _TAIL_BYTES))
            lines = stream.read().split(b"\n")
        size -= len(lines.pop())
        row = next((line for line in reversed(lines) if not line.startswith(b"#")), b"")
        if not row and begin == len(head):
            return size, 0
        return size, to_us(datetime.fromisoformat(row.partition(b",")[0].decode("ascii")))
    except (FileNotFoundError, ValueError, TypeError):  # TypeError: a time without a zone
        return None


def write_parquet(log: Path, sources: Path) -> None:
    """Write a log and its file of sources as Parquet; the CSV files stay.

    Raises
    ------
    OSError
        If a file cannot be written, or a CSV file has what cannot be read.
    """
    import polars as pl  # noqa: PLC0415 - takes a tenth of a second, and most write no Parquet

    numbers = pl.exclude("time").cast(pl.Float64())
    moments = pl.col("^.* source_time$").str.to_datetime(_TIME_FORMAT, time_zone="UTC")
    for path, values in ((log, numbers), (sources, moments)):
        try:
            frame = pl.read_csv(path, comment_prefix="#", infer_schema=False).with_columns(
                pl.col("time").str.to_datetime(_TIME_FORMAT, time_zone="UTC"), values
            )
        except pl.exceptions.PolarsError as error:
            raise OSError(str(error).partition("\n")[0]) from None
        with whole_file(path.with_suffix(".parquet")) as stream:
            frame.write_parquet(stream)


def sole_writer(folder: Path, name: str) -> AbstractContextManager[None]:
    """Keep other recordings of the same name out of a folder, as long as this one runs."""
    taken = ConfigurationError("recording_in_use", name=name, pid="", file=folder)
    return held_lock(folder / f".{name}.lock", taken, required=False)
