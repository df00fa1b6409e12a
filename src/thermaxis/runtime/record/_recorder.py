"""The recorder: reads nodes at their rates, and hands rows to the files once a second.

One task gives the times, one per rate and connection reads, one writes. A server that is slow or
gone delays nobody else; a disk that is full or slow delays no reading: rows wait in memory, and
what does not fit there is lost from the oldest on, which the log states.

Not protected: a computer that is too slow misses readings (the log shows gaps); rows of the last
second are lost when the program is killed, those of the last ten seconds when the power fails.
"""

import asyncio
import math
from collections import deque
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple, final

from thermaxis import __version__
from thermaxis.codes import Message
from thermaxis.runtime._ports import Clock
from thermaxis.runtime.record._clock import LogClock, as_text
from thermaxis.runtime.record._config import ChannelSettings, RecordSettings
from thermaxis.runtime.record._files import Entry, RecordingFiles, Stored, mark
from thermaxis.runtime.record._rows import NO_ANSWER, NOT_ASKED, Cells, ChannelReader

if TYPE_CHECKING:
    from asyncua import ua

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
_LAST_ANSWERS_S = 1.0
_EARLY_MS = 0.5
_FEWEST_UNCHANGED = 5


@final
@dataclass(slots=True, eq=False)
class _Group:
    """Channels of one connection and one rate: one read request."""

    connection: str
    period_ms: int
    columns: tuple[int, ...]
    nodes: tuple[str, ...]
    deadline_s: float
    due_ms: int = 0
    busy: bool = False


@final
@dataclass(slots=True, eq=False)
class _Row:
    """A row that waits for its answers."""

    log_ms: float
    cells: list[Cells]
    open: int
    """Requests without an answer yet. [1]"""


@final
@dataclass(frozen=True, slots=True)
class RecordSummary:
    """What a recording came to."""

    rows: int
    """Rows that were written. [1]"""
    lost: int
    """Rows that were lost, those included that could not be written in the end. [1]"""
    channels: tuple[ChannelReader, ...]
    """Counts by channel."""
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
    separators = rows * len(settings.channels) * 4.0
    return 50.0 * rows + 34.0 * readings + separators


class TriedChannel(NamedTuple):
    """What a node said when it was tried."""

    settings: ChannelSettings
    """The channel."""
    value: str
    """Value as it would be recorded; empty if it would not be."""
    status: str
    """Name of its status."""
    remark: Message | None
    """What is out of the ordinary; None if nothing is."""


async def try_once(
    settings: RecordSettings, sessions: "Mapping[str, OpcUaSession]", clock: Clock
) -> tuple[TriedChannel, ...]:
    """Read every node twice, to see what it says and whether its source time stamp moves."""
    channels = tuple(ChannelReader(channel) for channel in settings.channels)
    cells, values = [NOT_ASKED] * len(channels), [""] * len(channels)
    await _connections(sessions, clock)
    for wait_s in (0.0, TRY_AGAIN_S):
        await clock.sleep_until(clock.monotonic_s() + wait_s)
        for group in _groups_of(settings):
            answers = await sessions[group.connection].read(group.nodes, group.deadline_s)
            _fill(cells, group, channels, answers, clock.monotonic_s() * 1000.0)
        values = [one.value or before for one, before in zip(cells, values, strict=True)]
    tried: list[TriedChannel] = []
    for channel, value, last in zip(channels, values, cells, strict=True):
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
    while not all(session.connected for session in sessions.values()):
        now_s = clock.monotonic_s()
        if now_s >= end_s:
            return
        await clock.sleep_until(now_s + _POLL_S)


def _fill(
    cells: list[Cells],
    group: "_Group",
    channels: Sequence[ChannelReader],
    answers: "Sequence[ua.DataValue] | None",
    log_ms: float,
) -> None:
    """Put the answers to one request into their columns."""
    for place, column in enumerate(group.columns):
        channel = channels[column]
        if answers is None or len(answers) != len(group.nodes):
            cells[column] = channel.no_answer()
        else:
            cells[column] = channel.read(answers[place], log_ms)


def _ignore(_: Message) -> None:
    pass


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
        tell: Callable[[Message], None] = _ignore,
    ) -> None:
        self._settings = settings
        self._sessions = sessions
        self._clock = clock
        self._files = files
        self._tell = tell
        self._time = LogClock(clock)
        self._channels = tuple(ChannelReader(channel) for channel in settings.channels)
        self._groups = _groups_of(settings)
        self._rows: deque[_Row] = deque()
        self._waiting = _Waiting(1e6 * settings.memory_mb)
        self._writing = asyncio.Lock()
        self._connected: dict[str, int | None] = dict.fromkeys(sessions)
        self._asking: set[asyncio.Task[None]] = set()
        self._warned: set[tuple[str | float, ...]] = set()
        self._error = ""
        self._last_ms = -math.inf

    async def run(self, duration_s: float | None, stop: asyncio.Event) -> RecordSummary:
        """Record.

        Parameters
        ----------
        duration_s : float, optional
            Time from the first row on. Default: until it is told to stop. [s]
        stop : asyncio.Event
            Ends the recording when it is set.

        Returns
        -------
        RecordSummary
            After the last row was written, or could not be.
        """
        ending = asyncio.create_task(stop.wait())
        try:
            async with asyncio.TaskGroup() as tasks:
                writing = tasks.create_task(self._write_regularly())
                reading = tasks.create_task(self._read_regularly(duration_s, tasks))
                await asyncio.wait({reading, ending}, return_when=asyncio.FIRST_COMPLETED)
                reading.cancel()
                if self._asking:
                    await asyncio.wait(self._asking, timeout=_LAST_ANSWERS_S)
                for task in self._asking:
                    task.cancel()
                async with self._writing:  # no thread writes now
                    writing.cancel()
        finally:
            ending.cancel()
        return await self._end()

    # Reading ---------------------------------------------------------------------------------

    async def _read_regularly(self, duration_s: float | None, tasks: asyncio.TaskGroup) -> None:
        await _connections(self._sessions, self._clock)
        tick_ms = self._begin()
        end_s = math.inf if duration_s is None else self._time.monotonic_of(tick_ms) + duration_s
        while self._time.monotonic_of(tick_ms) < end_s - 1e-3:
            now_ms = await self._until(tick_ms)
            self._look_at_connections(now_ms)
            due = [group for group in self._groups if group.due_ms <= now_ms + _EARLY_MS]
            row_ms = self._row_time(due, now_ms)
            for group in due:
                group.due_ms = _last_due(group, now_ms) + group.period_ms
            self._ask([group for group in due if not group.busy], row_ms, tasks)
            tick_ms = min(group.due_ms for group in self._groups)
        if math.isfinite(end_s):  # so that 8 h of recording last 8 h
            await self._clock.sleep_until(end_s)

    def _begin(self) -> int:
        """Let all channels be due at the next full period of the fastest one. [ms since 1970]"""
        now_ms, _ = self._time.read()
        fastest_ms = self._settings.fastest_ms
        tick_ms = math.ceil(now_ms / fastest_ms) * fastest_ms
        for group in self._groups:
            group.due_ms = tick_ms
        began = Message("recording-began", {"version": __version__})
        self._waiting.add(mark(tick_ms, began))
        return tick_ms

    async def _until(self, log_ms: float) -> float:
        """Wait for a time of the log; return the log's time then, which may be later."""
        while True:
            now_ms, change = self._time.read()
            if change is not None:
                self._note(now_ms, change)
            if now_ms >= log_ms - _EARLY_MS:
                return now_ms
            longest_s = self._clock.monotonic_s() + _LONGEST_SLEEP_S
            await self._clock.sleep_until(min(self._time.monotonic_of(log_ms), longest_s))

    def _row_time(self, due: Sequence["_Group"], now_ms: float) -> float:
        """Return the time of a row: the one that was meant, unless it is late. [ms since 1970]"""
        meant_ms = max(_last_due(group, now_ms) for group in due)
        late_ms = now_ms - meant_ms
        return meant_ms if late_ms <= LATE_SHARE * self._settings.fastest_ms else round(now_ms)

    def _ask(self, groups: Sequence["_Group"], row_ms: float, tasks: asyncio.TaskGroup) -> None:
        """Send one request for each group; what none is asked for makes no row."""
        if not groups or row_ms <= self._last_ms:
            return
        self._last_ms = row_ms
        row = _Row(row_ms, [NOT_ASKED] * len(self._channels), len(groups))
        self._rows.append(row)
        for group in groups:
            group.busy = True
            task = tasks.create_task(self._answer(group, row))
            self._asking.add(task)
            task.add_done_callback(self._asking.discard)

    async def _answer(self, group: "_Group", row: _Row) -> None:
        answers = await self._sessions[group.connection].read(group.nodes, group.deadline_s)
        _fill(row.cells, group, self._channels, answers, row.log_ms)
        for column in group.columns:
            self._warn_of(self._channels[column])
        group.busy = False
        row.open -= 1
        while self._rows and self._rows[0].open == 0:
            self._waiting.add(_entry_of(self._rows.popleft()))

    # What is told ----------------------------------------------------------------------------

    def _note(self, log_ms: float, message: Message) -> None:
        """Tell what happened, and let a line of the log say it."""
        self._waiting.add(mark(log_ms, message))
        self._tell(message)

    def _look_at_connections(self, now_ms: float) -> None:
        for name, session in self._sessions.items():
            state = session.generation if session.connected else -1
            if state == self._connected[name]:
                continue
            self._connected[name] = state
            ahead_s = session.clock_difference_s
            if state < 0:
                values = {"name": name, "why": session.failure or _UNKNOWN}
                message = Message("recording-connection_lost", values)
            elif ahead_s is None:
                message = Message("recording-connected", {"name": name})
            else:
                side = "ahead" if ahead_s >= 0.0 else "behind"
                values = {"name": name, "by_s": abs(ahead_s)}
                message = Message(f"recording-connected_{side}", values)
            self._note(now_ms, message)

    def _warn_of(self, channel: ChannelReader) -> None:
        name = channel.settings.name
        for status in channel.not_good:
            if status != NO_ANSWER:
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

    async def _write_regularly(self) -> None:
        written_s = -math.inf
        while True:
            await self._waiting.arrived.wait()
            await self._clock.sleep_until(written_s + WRITE_EVERY_S)
            written_s = self._clock.monotonic_s()
            async with self._writing:
                await self._write()

    async def _write(self) -> None:
        """Store what waits, in a thread: a slow disk delays no reading."""
        stored = await self._waiting.give(
            lambda entries: asyncio.to_thread(self._files.store, entries)
        )
        if stored.error and not self._error:
            self._tell(Message("recording-rows_unwritten", {"cause": stored.error}))
        elif self._error and not stored.error:
            self._tell(Message("recording-rows_written_again"))
        self._error = stored.error

    async def _end(self) -> RecordSummary:
        for row in self._rows:
            if any(cells is not NOT_ASKED for cells in row.cells):
                self._waiting.add(_entry_of(row))
        now_ms, _ = self._time.read()
        self._waiting.add(mark(max(now_ms, self._last_ms), Message("recording-ended")))
        await self._write()
        await asyncio.to_thread(self._files.close)
        return RecordSummary(
            rows=self._waiting.written_rows,
            lost=self._waiting.lost_rows,
            channels=self._channels,
            files=tuple(self._files.written),
            error=self._error,
        )


class _Loss(NamedTuple):
    """Rows that were given up while they could not be written."""

    rows: int = 0
    first_ms: float = math.inf
    last_ms: float = -math.inf

    def and_(self, rows: int, first_ms: float, last_ms: float) -> "_Loss":
        """Return this and another loss as one."""
        first, last = min(self.first_ms, first_ms), max(self.last_ms, last_ms)
        return _Loss(self.rows + rows, first, last)

    def marks(self) -> list[Entry]:
        """Return the line that says it, if there is anything to say."""
        if not self.rows:
            return []
        values = {"first": as_text(self.first_ms), "last": as_text(self.last_ms)}
        return [mark(self.last_ms, Message("recording-lost", {"rows": self.rows, **values}))]


@final
class _Waiting:
    """Entries that wait to be written, up to a size; the oldest ones give way."""

    def __init__(self, largest_bytes: float) -> None:
        self._entries: deque[Entry] = deque()
        self._size = 0
        self._largest_bytes = largest_bytes
        self._given = 0
        self._untold = _Loss()
        self._lost_rows = 0
        self.written_rows = 0
        """Rows that were stored. [1]"""
        self.arrived = asyncio.Event()
        """Whether something waits."""

    @property
    def lost_rows(self) -> int:
        """Rows that gave way, and rows that still wait. [1]"""
        return self._lost_rows + sum(entry.is_row for entry in self._entries)

    def add(self, entry: Entry) -> None:
        self._entries.append(entry)
        self._size += entry.size
        self.arrived.set()
        self._give_way()

    async def give(self, store: Callable[[Sequence[Entry]], Awaitable[Stored]]) -> Stored:
        """Let everything be stored, after a line on what was lost; keep what was not."""
        self.arrived.clear()
        loss, self._untold = self._untold, _Loss()
        marks = loss.marks()
        self._given = len(self._entries)
        stored = await store([*marks, *self._entries])
        self._given = 0
        if not stored.entries:
            self._untold = loss.and_(*self._untold)
        for _ in range(stored.entries - len(marks)):
            entry = self._entries.popleft()
            self._size -= entry.size
            self.written_rows += entry.is_row
        if self._entries:
            self.arrived.set()
        self._give_way()
        return stored

    def _give_way(self) -> None:
        """Give up the oldest ones that are not being stored."""
        while self._size > self._largest_bytes and len(self._entries) > self._given + 1:
            oldest = self._entries[self._given]
            del self._entries[self._given]
            self._size -= oldest.size
            if oldest.is_row:
                self._lost_rows += 1
                self._untold = self._untold.and_(1, oldest.log_ms, oldest.log_ms)


def _groups_of(settings: RecordSettings) -> tuple[_Group, ...]:
    found: dict[tuple[str, int], list[int]] = {}
    for column, channel in enumerate(settings.channels):
        found.setdefault((channel.connection, channel.period_ms), []).append(column)
    return tuple(
        _Group(
            connection=connection,
            period_ms=period_ms,
            columns=tuple(columns),
            nodes=tuple(settings.channels[column].node for column in columns),
            deadline_s=settings.connections[connection].timeout_s,
        )
        for (connection, period_ms), columns in found.items()
    )


def _last_due(group: _Group, now_ms: float) -> int:
    return math.floor((now_ms + _EARLY_MS) / group.period_ms) * group.period_ms


def _entry_of(row: _Row) -> Entry:
    time = as_text(row.log_ms)
    log = ",".join([time, *(cells.value for cells in row.cells)])
    sources = ",".join([time, *(cells.of_source for cells in row.cells)])
    return Entry(row.log_ms, f"{log}\n".encode("ascii"), f"{sources}\n".encode("ascii"))
