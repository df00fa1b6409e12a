"""What tests of the recorder share: a connection that answers as it is told, in virtual time."""

import asyncio
from collections.abc import Callable, Coroutine, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from asyncua import ua

from thermaxis.codes import Message
from thermaxis.runtime import (
    ChannelSettings,
    ConnectionSettings,
    Recorder,
    RecordSettings,
    RecordSummary,
    VirtualClock,
    run_in_virtual_time,
)
from thermaxis.runtime.record import RecordingFiles

START = datetime(2026, 11, 21, 12, 0, 0, tzinfo=UTC)

Answer = Callable[[str, datetime], ua.DataValue | None]


def good(value: object, stamp: datetime | None, status: str = "Good") -> ua.DataValue:
    """What a server answers for one node."""
    return ua.DataValue(
        Value=ua.Variant(value),
        StatusCode=ua.StatusCode(getattr(ua.StatusCodes, status)),
        SourceTimestamp=None if stamp is None else stamp.replace(tzinfo=None),
    )


def moving(node: str, now: datetime) -> ua.DataValue:
    """A value that is measured anew at every reading: seconds of the day."""
    return good(now.hour * 3600 + now.minute * 60 + now.second + now.microsecond / 1e6, now)


@dataclass
class SimulatedSession:
    """A connection whose answers a test decides."""

    clock: VirtualClock
    answer: Answer = moving
    delay_s: float = 0.0
    connected: bool = True
    generation: int = 1
    failure: Message | None = Message("error-connection_closed")  # noqa: RUF009 - it is frozen
    clock_difference_s: float | None = 0.25
    asked: list[tuple[datetime, tuple[str, ...]]] = field(default_factory=list)

    async def read(self, nodes: Sequence[str], deadline_s: float) -> list[ua.DataValue] | None:
        now = self.clock.utc()
        self.asked.append((now, tuple(nodes)))
        wait_s = min(self.delay_s, deadline_s)
        if wait_s:
            await asyncio.sleep(wait_s)
        if not self.connected or self.delay_s > deadline_s:
            return None
        answers = [self.answer(node, now) for node in nodes]
        return None if None in answers else [a for a in answers if a is not None]


def channel(name: str, period_ms: int = 1000, **more: Any) -> ChannelSettings:
    return ChannelSettings(
        **{
            "name": name,
            "heading": name,
            "unit": "degC",
            "node": f"ns=2;s={name}",
            "connection": "control",
            "period_ms": period_ms,
        }
        | more
    )


def settings(*channels: ChannelSettings, **more: Any) -> RecordSettings:
    names = dict.fromkeys(c.connection for c in channels)
    return RecordSettings(
        **{
            "name": "lathe",
            "channels": channels,
            "connections": {
                name: ConnectionSettings(name=name, url="opc.tcp://127.0.0.1:4840", security="none")
                for name in names
            },
        }
        | more
    )


@dataclass
class Recording:
    """A recording in virtual time, with what may be changed while it runs."""

    settings: RecordSettings
    folder: Path
    start: datetime = START
    sessions: dict[str, SimulatedSession] = field(default_factory=dict)
    told: list[Message] = field(default_factory=list)
    ended: datetime = START

    def codes(self) -> list[str]:
        """Codes of what was told, in order."""
        return [one.code.removeprefix("recording-") for one in self.told]

    def run(
        self,
        duration_s: float | None,
        meanwhile: Callable[["Recording"], Coroutine[Any, Any, None]] | None = None,
        *,
        answer: Answer = moving,
    ) -> RecordSummary:
        return run_in_virtual_time(self._run(duration_s, meanwhile, answer))

    async def _run(
        self,
        duration_s: float | None,
        meanwhile: Callable[["Recording"], Coroutine[Any, Any, None]] | None,
        answer: Answer,
    ) -> RecordSummary:
        self.clock = VirtualClock(self.start)
        self.stop = asyncio.Event()
        self.sessions = {n: SimulatedSession(self.clock, answer) for n in self.settings.connections}
        self.files = RecordingFiles(self.settings, self.folder, self.told.append)
        recorder = Recorder(
            self.settings,
            self.sessions,
            self.clock,
            self.files,
            tell=self.told.append,
        )
        async with asyncio.TaskGroup() as tasks:
            recording = tasks.create_task(recorder.run(duration_s, self.stop))
            if meanwhile is not None:
                tasks.create_task(meanwhile(self))
            summary = await recording
            self.ended = self.clock.utc()
        return summary


def lines_of(path: Path) -> list[str]:
    return path.read_text("ascii").splitlines()


def rows_of(path: Path) -> list[list[str]]:
    """Rows of a log or a file of sources, without comments and headings."""
    return [line.split(",") for line in lines_of(path) if not line.startswith("#")][1:]


def marks_of(path: Path) -> list[str]:
    """What happened between the rows, without the time."""
    head = "# thermaxis record", "# connection ", "# channel "
    return [
        line.split(" ", 2)[2]
        for line in lines_of(path)
        if line.startswith("#") and not line.startswith(head)
    ]


def at(seconds: float, start: datetime = START) -> str:
    moment = start + timedelta(seconds=seconds)
    return moment.strftime("%Y-%m-%dT%H:%M:%S.") + f"{moment.microsecond // 1000:03d}Z"
