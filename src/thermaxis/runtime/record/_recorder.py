"""The recorder: reads nodes at their rates, and hands rows to the files once a second.

One task gives the times, one per rate and connection reads, one writes. A server that is slow or
gone delays nobody else; a disk that is full or slow delays no reading: rows wait in memory, and
what does not fit there is lost from the oldest on, which the log states.

Not protected: a computer that is too slow misses readings (the log shows gaps); rows of the last
second are lost when the program is killed, those of the last ten seconds when the power fails.
"""

import asyncio
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple, final

from thermaxis import __version__
from thermaxis.codes import Message, Value
from thermaxis.runtime._backlog import Backlog
from thermaxis.runtime._ports import Clock
from thermaxis.runtime.record._clock import LogClock, as_text
from thermaxis.runtime.record._config import ChannelSettings, RecordSettings
from thermaxis.runtime.record._files import Entry, RecordingFiles, mark
from thermaxis.runtime.record._rows import NO_ANSWER, Cells, ChannelReader

if TYPE_CHECKING:
    from thermaxis.runtime.opcua import OpcUaSession

WRITE_EVERY_S: Final = 1.0
"""Rows are written so often: what a killed program may lose. [s]"""
CONNECT_WITHIN_S: Final = 5.0
"""The first row waits so long for the connections. [s]"""
LATE_SHARE: Final = 0.1
"""A row that is later than this share of the shortest period gets its own time. [1]"""
UNCHANGED_WARNING_S: Final = 60.0
"""A source time stamp that stands still for so long is told. [s]"""
TRY_AGAIN_S: Final = 2.0
"""Time between the two readings of a trial. [s]"""
_UNKNOWN: Final = Message("error-machine_silent")
_LONGEST_SLEEP_S = 60.0
_POLL_S = 0.05
_EARLY_US = 500
_FEWEST_UNCHANGED = 5


@final
@dataclass(slots=True, eq=False)
class _Group:
    """Channels of one connection and one rate: one read request."""

    session: "OpcUaSession"
    deadline_s: float
    period_us: int
    readers: dict[int, ChannelReader]
    due_us: int = 0
    busy: bool = False

    def last_due(self, now_us: int) -> int:
        """Return when it was due last. [µs since 1970]"""
        return (now_us + _EARLY_US) // self.period_us * self.period_us

    async def read(self, log_us: int, cells: list[Cells]) -> None:
        """Put the answers to the request into their columns."""
        settings = [reader.settings for reader in self.readers.values()]
        counters = [one.counter_node for one in settings if one.counter_node]
        nodes = *(one.node for one in settings), *counters
        answers = iter(await self.session.read(nodes, self.deadline_s) or [None] * len(nodes))
        answered = [(*one, next(answers)) for one in self.readers.items()]
        for column, reader, answer in answered:
            counter = next(answers) if reader.settings.counter_node else None
            cells[column] = reader.read(answer, log_us, counter)


def _groups_of(
    settings: RecordSettings,
    sessions: "Mapping[str, OpcUaSession]",
    readers: Sequence[ChannelReader],
) -> tuple[_Group, ...]:
    found: dict[tuple[str, int], _Group] = {}
    for column, reader in enumerate(readers):
        name, period_ms = key = reader.settings.connection, reader.settings.period_ms
        deadline_s = settings.connections[name].timeout_s
        group = _Group(sessions[name], deadline_s, 1000 * period_ms, {})
        found.setdefault(key, group).readers[column] = reader
    return tuple(found.values())


def _counter_of(channel: ChannelSettings) -> Iterator[ChannelSettings]:
    """Yield the counter of a channel, if it has one, as a channel of its own."""
    if (node := channel.counter_node) is not None:
        bare = {"unit": "", "factor": 1.0, "offset": 0.0, "counter_node": None}
        yield replace(channel, name=f"{channel.name} counter", node=node, **bare)


def _entry_of(log_us: int, row: Sequence[Cells]) -> Entry:
    time = as_text(log_us)
    log = ",".join([time, *(cells.value for cells in row)])
    sources = ",".join([time, *(text for cells in row for text in cells[1:])])
    return Entry(log_us, f"{log}\n".encode("ascii"), f"{sources}\n".encode("ascii"))


@final
@dataclass(frozen=True, slots=True)
class RecordSummary:
    """What a recording came to."""

    rows: int
    """Rows that were written. [1]"""
    lost: int
    """Rows that were lost, those included that could not be written in the end. [1]"""
    channels: tuple[ChannelReader, ...]
    files: tuple[Path, ...]
    """Logs that were written, in order."""
    error: str
    """Why rows could not be written in the end; empty if all were."""


def bytes_per_day(settings: RecordSettings) -> float:
    """Return how much a recording writes in a day, about. [byte]

    Measured: 25 bytes a row in each file, and 38 bytes a reading, source time stamp included.
    """
    rows = 86_400_000.0 / settings.fastest_ms
    readings = sum(86_400_000.0 / channel.period_ms for channel in settings.channels)
    return (50.0 + 4.0 * len(settings.channels)) * rows + 34.0 * readings


class TriedChannel(NamedTuple):
    """What a node said when it was tried."""

    settings: ChannelSettings
    value: str
    """Value as it would be recorded; empty if it would not be."""
    status: str
    remark: Message | None
    """What is out of the ordinary; None if nothing is."""


async def try_once(
    settings: RecordSettings, sessions: "Mapping[str, OpcUaSession]", clock: Clock
) -> tuple[TriedChannel, ...]:
    """Read every node twice, to see what it says and whether its source time stamp moves."""
    readers = [
        ChannelReader(one)
        for channel in settings.channels
        for one in (replace(channel, counter_node=None), *_counter_of(channel))
    ]
    cells, values = [Cells()] * len(readers), [""] * len(readers)
    await _connections(sessions, clock)
    for wait_s in (0.0, TRY_AGAIN_S):
        await clock.sleep_until(clock.monotonic_s() + wait_s)
        for group in _groups_of(settings, sessions, readers):
            await group.read(round(1e6 * clock.monotonic_s()), cells)
        values = [one.value or before for one, before in zip(cells, values, strict=True)]
    tried: list[TriedChannel] = []
    for channel, value, last in zip(readers, values, cells, strict=True):
        remark = Message("remark-beside_value", {"said": last.remark}) if last.remark else None
        if channel.unchanged:
            remark = Message("remark-stamp_stood_still", {"lasts_s": TRY_AGAIN_S})
        elif channel.unstamped:
            remark = Message("remark-no_stamp")
        tried.append(TriedChannel(channel.settings, value, last.status, remark))
    return tuple(tried)


async def _connections(sessions: "Mapping[str, OpcUaSession]", clock: Clock) -> None:
    """Wait for the connections, so that the first reading has values."""
    end_s = clock.monotonic_s() + CONNECT_WITHIN_S
    while clock.monotonic_s() < end_s and not all(s.connected for s in sessions.values()):
        await clock.sleep_until(clock.monotonic_s() + _POLL_S)


@final
class Recorder:
    """Records until its time is over or it is told to stop.

    Parameters
    ----------
    settings : RecordSettings
        What is recorded.
    sessions : mapping of str to OpcUaSession
        The connections by name; opened and closed by the caller.
    clock : Clock
        Monotonic time and time of day.
    files : RecordingFiles
        Where rows go; called in a thread, one call at a time.
    tell : callable
        Takes what happens, for whoever watches. Default: nobody does.
    """

    def __init__(
        self,
        settings: RecordSettings,
        sessions: "Mapping[str, OpcUaSession]",
        clock: Clock,
        files: RecordingFiles,
        *,
        tell: Callable[[Message], None] = lambda _: None,
    ) -> None:
        self._fastest_us = 1000 * settings.fastest_ms
        self._sessions = sessions
        self._clock = clock
        self._files = files
        self._tell = tell
        self._time = LogClock(clock)
        self._channels = tuple(ChannelReader(channel) for channel in settings.channels)
        self._groups = _groups_of(settings, sessions, self._channels)
        self._row: asyncio.Task[None] | None = None
        self._backlog = Backlog[Entry](round(1e6 * settings.memory_mb))
        self._arrived, self._writing = asyncio.Event(), asyncio.Lock()
        self._connected: dict[str, int | None] = dict.fromkeys(sessions)
        self._warned: set[tuple[str | float, ...]] = set()
        self._error = ""
        self._written_rows = 0
        self._last_us = 0

    async def run(self, duration_s: float | None, stop: asyncio.Event) -> RecordSummary:
        """Record for a time from the first row on [s], or until it is told to stop.

        Returns after the last row was written, or could not be.
        """
        async with asyncio.TaskGroup() as tasks:
            writing = tasks.create_task(self._write_regularly())
            reading = tasks.create_task(self._read_regularly(duration_s, tasks))
            ending = tasks.create_task(stop.wait())
            await asyncio.wait({reading, ending}, return_when=asyncio.FIRST_COMPLETED)
            reading.cancel()
            ending.cancel()
            if self._row is not None:
                await self._row  # the last answers, or their time is over
            async with self._writing:  # no thread writes now
                writing.cancel()
        now_us, _ = self._time.read()
        self._add(mark(max(now_us, self._last_us), Message("recording-ended")))
        await self._write()
        await asyncio.to_thread(self._files.close)
        self._backlog.give_up()
        return RecordSummary(
            rows=self._written_rows,
            lost=self._backlog.lost.rows,
            channels=self._channels,
            files=tuple(self._files.written),
            error=self._error,
        )

    # Reading ---------------------------------------------------------------------------------

    async def _read_regularly(self, duration_s: float | None, tasks: asyncio.TaskGroup) -> None:
        await _connections(self._sessions, self._clock)
        # All channels are due at the next full period of the fastest one.
        tick_us = -(-self._time.read()[0] // self._fastest_us) * self._fastest_us
        self._add(mark(tick_us, Message("recording-began", {"version": __version__})))
        end_s = math.inf if duration_s is None else self._time.monotonic_of(tick_us) + duration_s
        while self._time.monotonic_of(tick_us) < end_s - 1e-3:
            now_us = await self._until(tick_us)
            self._look_at_connections(now_us)
            due = [group for group in self._groups if group.due_us <= now_us + _EARLY_US]
            row_us = max(group.last_due(now_us) for group in due)
            if now_us - row_us > LATE_SHARE * self._fastest_us:
                row_us = round(now_us, -3)
            for group in due:
                group.due_us = group.last_due(now_us) + group.period_us
            free = [group for group in due if not group.busy]
            if free and row_us > self._last_us:
                self._last_us = row_us
                self._row = tasks.create_task(self._read_row(free, row_us, self._row))
            tick_us = min(group.due_us for group in self._groups)
        if math.isfinite(end_s):  # so that 8 h of recording last 8 h
            await self._clock.sleep_until(end_s)

    async def _until(self, log_us: int) -> int:
        """Wait for a time of the log; return the log's time then, which may be later."""
        while True:
            now_us, change = self._time.read()
            if change is not None:
                self._note(now_us, change)
            if now_us >= log_us - _EARLY_US:
                return now_us
            longest_s = self._clock.monotonic_s() + _LONGEST_SLEEP_S
            await self._clock.sleep_until(min(self._time.monotonic_of(log_us), longest_s))

    async def _read_row(
        self, groups: Sequence[_Group], row_us: int, before: asyncio.Task[None] | None
    ) -> None:
        """Send one request for each group; the row follows the one before."""
        row = [Cells()] * len(self._channels)
        await asyncio.gather(*(self._answer(group, row_us, row) for group in groups))
        if before is not None:
            await before
        self._add(_entry_of(row_us, row))

    async def _answer(self, group: _Group, row_us: int, row: list[Cells]) -> None:
        group.busy = True
        await group.read(row_us, row)
        group.busy = False
        for reader in group.readers.values():
            self._warn_of(reader)

    # What is told ----------------------------------------------------------------------------

    def _note(self, log_us: int, message: Message) -> None:
        """Tell what happened, and let a line of the log say it."""
        self._add(mark(log_us, message))
        self._tell(message)

    def _look_at_connections(self, now_us: int) -> None:
        for name, session in self._sessions.items():
            state = session.generation if session.connected else -1
            if state == self._connected[name]:
                continue
            self._connected[name] = state
            code, values = "connected", dict[str, Value](name=name)
            ahead_s = session.clock_difference_s
            if state < 0:
                code, values["why"] = "connection_lost", session.failure or _UNKNOWN
            elif ahead_s is not None:
                code = "connected_ahead" if ahead_s >= 0.0 else "connected_behind"
                values["by_s"] = abs(ahead_s)
            self._note(now_us, Message(f"recording-{code}", values))

    def _warn_of(self, channel: ChannelReader) -> None:
        name = channel.settings.name
        for status in channel.not_good.keys() - {NO_ANSWER}:
            self._warn("not_good", name=name, status=status)
        if channel.unstamped:
            self._warn("unstamped", name=name)
        stands_still = (
            channel.unchanged_in_a_row >= _FEWEST_UNCHANGED
            and channel.unchanged_for_s >= UNCHANGED_WARNING_S
        )
        if stands_still and not channel.settings.repeat_unchanged_s:
            self._warn("stands_still", name=name, lasts_s=UNCHANGED_WARNING_S)

    def _warn(self, code: str, **values: str | float) -> None:
        """Tell something once."""
        key = (code, *values.values())
        if key not in self._warned:
            self._warned.add(key)
            self._tell(Message(f"recording-{code}", values))

    # Writing ---------------------------------------------------------------------------------

    def _add(self, entry: Entry) -> None:
        self._backlog.add(entry)
        self._arrived.set()

    async def _write_regularly(self) -> None:
        written_s = -math.inf
        while True:
            await self._arrived.wait()
            await self._clock.sleep_until(written_s + WRITE_EVERY_S)
            written_s = self._clock.monotonic_s()
            async with self._writing:
                await self._write()

    async def _write(self) -> None:
        """Store what waits, in a thread: a slow disk delays no reading."""
        self._arrived.clear()
        error = await asyncio.to_thread(self._store)
        if error and not self._error:
            self._tell(Message("recording-rows_unwritten", {"cause": error}))
        elif self._error and not error:
            self._tell(Message("recording-rows_written_again"))
        if error:
            self._arrived.set()
        self._error = error

    def _store(self) -> str:
        """Store what waits, after a line on what was lost; return why not all, in words."""
        while entries := self._backlog.take(1):
            (entry,), loss = entries, self._backlog.unstated
            if loss.rows:
                span = {"first": as_text(loss.first_us), "last": as_text(loss.last_us)}
                lost = Message("recording-lost", {"rows": loss.rows, **span})
                entry = entry._replace(log=mark(loss.last_us, lost).log + entry.log)
            try:
                self._files.store(entry)
            except OSError as error:
                self._backlog.put_back()
                return error.strerror or type(error).__name__
            self._backlog.stored(loss)
            self._written_rows += entry.is_row
        return ""
