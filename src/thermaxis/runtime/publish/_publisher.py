"""What the acting process tells the one that publishes, and hears from it; it never waits."""

import asyncio
import copyreg
import gc
import os
import pickle
import signal
import socket
import sys
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Final,
    Literal,
    NamedTuple,
    NoReturn,
    TypeAlias,
    final,
)

from pydantic import AwareDatetime, Field, TypeAdapter

from thermaxis.codes import Message, value_of_json
from thermaxis.compensation import Request
from thermaxis.errors import ConfigurationError
from thermaxis.runtime._ports import (
    Clock,
    CycleRecord,
    EventRecord,
    Historian,
    HistorianStatus,
)
from thermaxis.runtime.config import MachineConfiguration, certificates_of
from thermaxis.runtime.status import RuntimeStatus

if TYPE_CHECKING:
    from thermaxis.runtime.loop import CompensationLoop

HEADER: Final = 4
"""Bytes that tell how long a pickled list is. [byte]"""
SILENT_S: Final = 10.0
"""It is told when the other process has said nothing for so long. [s]"""
ENDED_AFTER_S: Final = 60.0
"""It is ended and begun anew when it has said nothing for so long. [s]"""
BEGIN_S: Final = 60.0
"""Time in which it must be ready. [s]"""
_ENDED = "event-publisher_ended"
_PAUSE_S = 1.0
_LONGEST_PAUSE_S = 60.0
_LONGEST_LINE = 100_000
_MOST_ASKED = 50
_ENDING_S = 2.0
_TERMINAL = frozenset({signal.SIGINT, signal.SIGTERM, signal.SIGHUP})


def _as_dict(shown: MappingProxyType[Any, Any]) -> tuple[Any, tuple[dict[Any, Any]]]:
    return dict, (dict(shown),)


copyreg.pickle(MappingProxyType, _as_dict)


Serve: TypeAlias = Callable[[MachineConfiguration, Clock, socket.socket], None]
"""What the copy does: `serve`, which it alone loads."""


class Servers(NamedTuple):
    """What the other process says when it is ready."""

    url: str = ""
    """Address of the status server; empty where none is configured."""
    metrics_port: int = 0
    """Port of the metrics; 0 where none is configured. [1]"""
    unrecorded: Message | None = None
    """Why nothing is recorded; None where nothing is wrong."""
    refused: Message | None = None
    """Why a server is not open; None where every one is that is configured."""


# ---- what the other process may say, a line of JSON each: all that is believed of it -------------

_Count: TypeAlias = Annotated[int, Field(strict=True, ge=0, lt=2**53)]
_Text: TypeAlias = Annotated[str, Field(max_length=4000)]
_Whole: TypeAlias = Annotated[int, Field(gt=-(2**53), lt=2**53)]
_Plain: TypeAlias = _Whole | Annotated[float, Field(allow_inf_nan=False)] | _Text | None
_Part: TypeAlias = Literal["code", "values", "place"]
_Cause: TypeAlias = dict[_Part, _Text | dict[_Text, _Plain]]
_Why: TypeAlias = dict[_Part, _Text | dict[_Text, _Plain | _Cause]]


@dataclass(frozen=True, slots=True)
class _Ready:
    url: _Text
    metrics_port: _Count
    unrecorded: _Why | None
    refused: _Why | None = None


@dataclass(frozen=True, slots=True)
class _Asked:
    request: Request
    number: _Count


@dataclass(frozen=True, slots=True)
class _Certificates:
    certificates: dict[str, AwareDatetime]


@dataclass(frozen=True, slots=True)
class _History:
    historian: tuple[bool, _Count, _Count, _Why | None]
    stored: _Count = 0


_SAID: TypeAdapter[_Ready | _Asked | _Certificates | _History] = TypeAdapter(
    _Ready | _Asked | _Certificates | _History
)


class _Frame(NamedTuple):
    data: bytes
    cycles: int
    events: int
    utc: datetime


@final
class Publisher(Historian):
    """Hands every cycle, event and status to a process of its own, and answers its requests.

    The other process is this one's copy, which loads status server, metrics and history, and has
    nothing else of this one open. It is begun anew when it dies. What it does not take in time
    waits up to `HistorianSettings.largest_waiting_bytes`; then the oldest is lost, counted and
    told. When this process ends or is killed, the other one stores what it was given, and ends.

    Not protected: what the other process had been given and not yet stored is lost when it is
    killed: half a second, or what waits for a database. It is counted and told, with what was
    stored since it last said so. Whoever takes it over can ask for what an engineer may ask for.
    """

    def __init__(self, configuration: MachineConfiguration, clock: Clock, serve: Serve) -> None:
        self.loop: CompensationLoop | None = None
        self._configuration, self._clock, self._serve = configuration, clock, serve
        self._items: list[object] = []
        self._frames: deque[_Frame] = deque()
        self._bytes = self._lost = 0
        self._unstated: list[_Frame] = []
        self._given = 0
        self._unstored: deque[tuple[int, _Frame]] = deque()  # with how many were given until then
        self._arrived = asyncio.Event()
        self._told = HistorianStatus()
        self._failure: Message | None = None
        self._heard_s = time.monotonic()
        self._pid = 0
        self._asked: set[asyncio.Task[None]] = set()
        self._task: asyncio.Task[None] | None = None
        self._closing = asyncio.Event()

    # ---- what the loop tells --------------------------------------------------------------------

    async def open(self, outputs: Sequence[str]) -> None:
        """Nothing: it was begun before the loop."""

    def record(self, record: CycleRecord) -> None:
        """Take a cycle."""
        self._take(record)

    def event(self, event: EventRecord) -> None:
        """Take an event."""
        self._take(event)

    def publish(self, status: RuntimeStatus) -> None:
        """Take a status."""
        self._take(status)

    def _take(self, item: object) -> None:
        if not self._items:
            asyncio.get_running_loop().call_soon(self._pack)  # all of a cycle together
        self._items.append(item)

    def _pack(self) -> None:
        items, self._items = self._items, []
        if not items:  # they went at the closing
            return
        data = pickle.dumps(items, pickle.HIGHEST_PROTOCOL)
        cycles = sum(isinstance(one, CycleRecord) for one in items)
        events = sum(isinstance(one, EventRecord) for one in items)
        self._frames.append(_Frame(data, cycles, events, self._clock.utc()))
        self._bytes += len(data)
        while self._bytes > self._configuration.historian.largest_waiting_bytes:
            self._lose(self._frames.popleft())
        self._arrived.set()

    def _lose(self, frame: _Frame) -> None:
        self._bytes -= len(frame.data)
        self._lost += frame.cycles + frame.events
        self._unstated.append(frame._replace(data=b""))

    @property
    def status(self) -> HistorianStatus:
        """How the history fares, as far as is known."""
        told, failure = self._told, self._failure
        silent_s = time.monotonic() - self._heard_s
        if failure is None and silent_s > SILENT_S:
            failure = Message("failure-publisher_silent", {"lasts_s": silent_s})
        return HistorianStatus(
            told.storing and failure is None,
            told.waiting + sum(frame.cycles + frame.events for frame in self._frames),
            told.lost + self._lost,
            failure or told.failure,
        )

    # ---- life -----------------------------------------------------------------------------------

    async def begin(self) -> Servers:
        """Begin the other process.

        Raises
        ------
        ConfigurationError
            If a server cannot be opened as it is configured.
        """
        connected, servers = await self._begun()
        if servers.refused is not None:
            await self._end(connected[1])
            raise ConfigurationError.of(servers.refused)
        self._task = asyncio.create_task(self._watch(*connected), name="publisher")
        return servers

    async def _begun(self) -> tuple[tuple[asyncio.StreamReader, asyncio.StreamWriter], Servers]:
        here: socket.socket | None = None
        try:
            here, there = socket.socketpair()
            with there:
                serve = partial(self._serve, self._configuration, self._clock, there)
                self._pid = _forked(serve, there)
            reader, writer = await asyncio.open_connection(sock=here, limit=_LONGEST_LINE)
        except OSError:
            if here is not None:
                here.close()
            raise ConfigurationError("publisher_unbegun") from None
        writer.transport.set_write_buffer_limits(0)
        servers = None
        with suppress(OSError, TimeoutError, ValueError):
            async with asyncio.timeout(BEGIN_S):
                said = _SAID.validate_json(await reader.readline())
            if isinstance(said, _Ready):
                unrecorded, refused = _message(said.unrecorded), _message(said.refused)
                servers = Servers(said.url, said.metrics_port, unrecorded, refused)
        if servers is None:
            await self._end(writer)
            raise ConfigurationError("publisher_unbegun")
        self._heard_s = time.monotonic()
        return (reader, writer), servers

    async def close(self, deadline_s: float) -> None:
        """Hand over what waits, and let the other process store it and end."""
        if self._task is None:
            return
        self._closing.set()
        if self._items:
            self._pack()
        self._arrived.set()
        _, late = await asyncio.wait((self._task,), timeout=deadline_s + _ENDING_S)
        self._task = None
        for task in late:
            if self._pid:
                os.kill(self._pid, signal.SIGKILL)
            task.cancel()

    async def _watch(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Feed the other process and hear it, and begin it anew as often as it ends."""
        pause_s = _PAUSE_S
        while True:
            began_s = time.monotonic()
            feeding = asyncio.create_task(self._feed(writer), name="to the publisher")
            with suppress(OSError, TimeoutError, ValueError):
                await self._hear(reader)
            for task in (feeding, *self._asked):
                task.cancel()
            await asyncio.gather(feeding, *self._asked, return_exceptions=True)
            await self._end(writer)
            if self._closing.is_set() and not self._frames:
                return
            missing = [frame for _, frame in self._unstored]
            self._lost += self._told.lost + sum(one.cycles + one.events for one in missing)
            self._unstated += missing
            self._unstored.clear()
            self._given = 0
            self._failure, self._told = Message("failure-publisher_ended"), HistorianStatus()
            self.event(EventRecord.of(self._clock.utc(), "alarm", "", Message(_ENDED)))
            if time.monotonic() - began_s > _LONGEST_PAUSE_S:
                pause_s = _PAUSE_S
            while self._failure is not None:
                with suppress(TimeoutError):
                    await asyncio.wait_for(self._closing.wait(), pause_s)
                pause_s = min(2.0 * pause_s, _LONGEST_PAUSE_S)
                try:
                    (reader, writer), _ = await self._begun()
                except ConfigurationError as error:
                    self._failure = error.message
                    if self._closing.is_set():
                        return
                else:
                    self._failure = None

    async def _feed(self, writer: asyncio.StreamWriter) -> None:
        while True:
            await self._arrived.wait()
            while self._frames:
                frame = self._frames.popleft()
                self._bytes -= len(frame.data)
                self._given += frame.cycles + frame.events
                self._unstored.append((self._given, frame._replace(data=b"")))
                writer.write(len(frame.data).to_bytes(HEADER) + frame.data)
                await writer.drain()
                self._state_loss()
            self._arrived.clear()
            if self._closing.is_set() and not self._items:
                writer.write_eof()
                return

    def _state_loss(self) -> None:
        """Say in the history what is missing from it."""
        lost, self._unstated = self._unstated, []
        if lost:
            values = {"cycles": sum(f.cycles for f in lost), "events": sum(f.events for f in lost)}
            times = [frame.utc for frame in lost if frame.cycles + frame.events]
            if not times:
                return
            details = {"first": min(times).isoformat(), "last": max(times).isoformat()}
            message = Message("event-records_lost", values)
            utc = self._clock.utc()
            self.event(EventRecord.of(utc, "loss", "", message, {**values, **details}))

    # ---- what the other process says ------------------------------------------------------------

    async def _hear(self, reader: asyncio.StreamReader) -> None:
        """Take what is said until it ends, or is no such thing as is said."""
        while True:
            async with asyncio.timeout(ENDED_AFTER_S):
                line = await reader.readline()
            if not line:
                return
            self._heard_s = time.monotonic()
            match _SAID.validate_json(line):
                case _Asked(request, number):
                    if len(self._asked) >= _MOST_ASKED:
                        await asyncio.wait(self._asked, return_when=asyncio.FIRST_COMPLETED)
                    task = asyncio.create_task(self._answer(number, request))
                    self._asked.add(task)
                    task.add_done_callback(self._asked.discard)
                case _Certificates(ends):
                    if not ends.keys() <= dict(certificates_of(self._configuration)).keys():
                        raise ValueError
                    if self.loop is not None:
                        self.loop.certificates = ends
                case _History((storing, waiting, lost, why), stored):
                    while self._unstored and self._unstored[0][0] <= stored:
                        self._unstored.popleft()
                    self._told = HistorianStatus(storing, waiting, lost, _message(why))
                case _:
                    raise ValueError

    async def _answer(self, number: int, request: Request) -> None:
        if self.loop is not None:
            self._take((number, await self.loop.submit(request)))

    async def _end(self, writer: asyncio.StreamWriter) -> None:
        """End the other process, whatever it does."""
        writer.close()
        pid, self._pid = self._pid, 0
        os.kill(pid, signal.SIGKILL)
        await asyncio.to_thread(os.waitpid, pid, 0)


def _message(why: _Why | None) -> Message | None:
    if why is None:
        return None
    said = value_of_json(why)
    if not (isinstance(said, Message) and said.code.startswith(("error-", "failure-"))):
        raise ValueError
    return said


def _forked(serve: Callable[[], None], there: socket.socket) -> int:
    """Return the process that serves, which has nothing of this one open but a socket.

    A copy shares the memory of what both have loaded.
    """
    gc.freeze()  # what is shared stays shared
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _TERMINAL)
    try:
        pid = os.fork()
        if pid == 0:
            _serve(serve, there)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    return pid


def _serve(serve: Callable[[], None], there: socket.socket) -> NoReturn:
    """Serve as a process that ends with the acting one, whatever a terminal says."""
    code = 1
    try:
        with suppress(OSError):  # it gives way to the loop
            os.nice(10)
            Path("/proc/self/oom_score_adj").write_text("500", "ascii")
        signal.set_wakeup_fd(-1)
        for number in _TERMINAL:
            signal.signal(number, signal.SIG_IGN)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _TERMINAL)
        # Each number stays taken: objects of the acting process that close theirs close nothing.
        nothing = os.open(os.devnull, os.O_RDWR)
        for number in {int(one.name) for one in Path("/dev/fd").iterdir()} - {
            2,
            there.fileno(),
            nothing,
        }:
            os.dup2(nothing, number, inheritable=number < 2)
        serve()
        code = 0
    except BaseException as error:  # noqa: BLE001 - nothing that acts may go on in this copy
        sys.excepthook(type(error), error, error.__traceback__)
    finally:
        os._exit(code)
