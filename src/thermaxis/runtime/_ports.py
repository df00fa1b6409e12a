"""The ports of the runtime: where readings come from, where corrections go, who remembers.

Each border is small, has a simulated twin, and says in its contract what may be expected of every
implementation. Nothing here is the machine's protocol.
"""

import asyncio
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from types import MappingProxyType
from typing import NamedTuple, Protocol, final

from thermaxis.codes import Message, Value
from thermaxis.compensation import AnswerCode, CycleOutput, Request
from thermaxis.messages import sentence_of


class Clock(Protocol):
    """Time, injected so that tests run in virtual time.

    Not protected: the monotonic time does not count while the computer sleeps on some systems.
    """

    def monotonic_s(self) -> float:
        """Return a time that only goes forward. [s]"""
        ...

    def utc(self) -> datetime:
        """Return the time of day, aware, in UTC."""
        ...

    async def sleep_until(self, monotonic_s: float) -> None:
        """Wait until a monotonic time; return at once if it has passed."""
        ...


class SourceSample(NamedTuple):
    """What was read of one channel, as the source said it."""

    value: float | None
    """Value in the channel's unit; None where there is none or it is no number."""
    good: bool
    """Whether the status is good."""
    status: str = "Good"
    """Name of the status, such as ``Good`` or ``BadSensorFailure``."""
    age_s: float | None = 0.0
    """Time since the source stamped the value, by clocks whose difference was taken at the
    connection; None where it has no time stamp. [s]"""
    source_time: datetime | None = None
    """Time stamp of the source, aware."""


NOT_READ = SourceSample(None, good=False, status="BadNoCommunication", age_s=None)
"""What a source says of a channel that it could not read."""


class Source(ABC):
    """Where values come from.

    Every implementation: `read` returns a sample for every name that it was made for, never
    raises for a lost connection (the samples say so), never returns an old value as fresh, and
    returns within `deadline_s`. A lost connection is tried again by itself, without an end.
    """

    @abstractmethod
    async def open(self) -> None:
        """Begin; a machine that is not there is no error, it is waited for."""

    @abstractmethod
    async def read(self, deadline_s: float) -> Mapping[str, SourceSample]:
        """Read every channel, interlock and flag by its name, within a time. [s]"""

    @property
    @abstractmethod
    def connected(self) -> bool:
        """Whether the last read reached its machine."""

    @property
    def failure(self) -> Message | None:
        """Why it is not connected; None if nothing is wrong, or nothing is known of it."""
        return None

    @property
    def ended(self) -> bool:
        """Whether nothing more will come, as at the end of a replayed log."""
        return False

    @abstractmethod
    async def close(self) -> None:
        """End; nothing of it runs on."""


class Applied(NamedTuple):
    """What the machine says about one offset. Three numbers, never one."""

    requested_um: float | None
    """What was written last. [µm]"""
    accepted_um: float | None
    """What it reports as set; None where it cannot be read. [µm]"""
    effective_um: float | None = None
    """What it reports as acting now; None where it does not say. [µm]"""


class Sink(ABC):
    """Where corrections go.

    Every implementation: `write` and `read_back` never raise for a lost connection and return
    within `deadline_s`; nothing is written that is not a finite number; nothing is written after
    a lost connection before `found` was read. Sign and unit of the machine are the sink's: the
    runtime speaks micrometres of correction only.

    Not protected: a sink writes what it is told. Limits stand before it, and should stand behind
    it on the machine as well, with a watchdog on the heartbeat.
    """

    failure: Message | None = None
    """Why it is not connected, or its last write was refused; None if nothing is wrong."""
    tells_effective: frozenset[str] = frozenset()
    """Outputs of which the machine is asked for what acts."""

    @abstractmethod
    async def open(self) -> None:
        """Begin; a machine that is not there is no error, it is waited for. Writes nothing."""

    @property
    @abstractmethod
    def connected(self) -> bool:
        """Whether the machine can be written to."""

    @abstractmethod
    async def found(self, deadline_s: float) -> Mapping[str, float | None] | None:
        """Return the offsets that stand in the machine, by output [µm], when they are news.

        News they are once after `open` and once after every lost connection; otherwise None.
        """

    @abstractmethod
    async def write(self, correction_um: Mapping[str, float], deadline_s: float) -> bool:
        """Write corrections [µm] and a moved heartbeat; return whether all were accepted."""

    @abstractmethod
    async def read_back(self, deadline_s: float) -> Mapping[str, Applied]:
        """Return what the machine says about every output."""

    @abstractmethod
    async def close(self) -> None:
        """End; nothing of it runs on. Writes nothing."""


@final
@dataclass(frozen=True, slots=True)
class CycleRecord:
    """Everything that is recorded of one cycle."""

    number: int
    """Number of the cycle since the start of the loop. [1]"""
    utc: datetime
    """Time of day, aware, in UTC."""
    monotonic_s: float
    """Monotonic time. [s]"""
    samples: Mapping[str, SourceSample]
    """Every channel, interlock and flag that was read."""
    output: CycleOutput
    applied: Mapping[str, Applied]
    """What the machine said after the write."""
    lateness_s: float
    """How late the cycle began. [s]"""
    channels: tuple[str, ...] = ()
    """Names of the model's channels, in the order of the output's values."""
    parts: tuple[tuple[str, ...], ...] = ()
    """Names of the model's parts, by output, as in the output's contributions."""
    diameter_mm: float | None = None
    """Clamping diameter of the workpiece; None for the tool centre point. [mm]"""
    source_reason: str = ""
    """Code of why the values' machine was not reached; empty while it is."""
    sink_reason: str = ""
    """Code of why the offsets' machine was not reached, or what it refused last; empty while
    nothing is wrong."""
    touched: Mapping[str, str] = field(default_factory=dict[str, str])
    """What became of a touch in this cycle, by output."""


@final
@dataclass(frozen=True, slots=True)
class EventRecord:
    """Something that happened at one time: a state, a request, a lost connection, a start."""

    utc: datetime
    """Time of day, aware, in UTC."""
    kind: str
    """``start``, ``stop``, ``state``, ``request``, ``connection``, ``alarm``, ``commission``,
    ``loss``, ``touch``."""
    who: str
    """Who caused it; empty for the machine itself."""
    text: str
    """What happened, as an English sentence."""
    details: Mapping[str, str | float | bool | None] = field(
        default_factory=dict[str, str | float | bool | None]
    )
    """Numbers and words that belong to it."""
    code: str = ""
    """Key of the sentence in every catalogue; empty where it has none."""
    values: Mapping[str, Value] = field(default_factory=dict[str, Value])
    """What the sentence says, by name."""

    @classmethod
    def of(
        cls,
        utc: datetime,
        kind: str,
        who: str,
        message: Message,
        details: Mapping[str, str | float | bool | None] | None = None,
    ) -> "EventRecord":
        """Return the event of a message, with its English sentence."""
        text = sentence_of(message)
        return cls(utc, kind, who, text, details or {}, message.code, message.values)


class Historian(ABC):
    """Who remembers.

    Every implementation: `record` and `event` return at once and never raise or wait for a disk
    or a network; what cannot be stored is kept up to a bound, stored later, and a loss is stated.
    """

    @abstractmethod
    async def open(self, outputs: Sequence[str]) -> None:
        """Begin to store; a database that is not there is waited for."""

    @abstractmethod
    def record(self, record: CycleRecord) -> None:
        """Take a cycle."""

    @abstractmethod
    def event(self, event: EventRecord) -> None:
        """Take an event."""

    @property
    @abstractmethod
    def status(self) -> "HistorianStatus":
        """How it fares."""

    @abstractmethod
    async def close(self, deadline_s: float) -> None:
        """Store what is left, as far as a time allows [s], and end."""


class HistorianStatus(NamedTuple):
    """How the historian fares."""

    storing: bool = True
    """Whether the last attempt to store succeeded."""
    waiting: int = 0
    """Records that are kept until they can be stored. [1]"""
    lost: int = 0
    """Records that were lost since the start. [1]"""
    failure: Message | None = None
    """What keeps records from being stored; None if nothing does."""


@final
class SystemClock:
    """The computer's clock."""

    def monotonic_s(self) -> float:
        """Return the monotonic time of the event loop's clock. [s]"""
        return time.monotonic()

    def utc(self) -> datetime:
        """Return the time of day in UTC."""
        from datetime import UTC  # noqa: PLC0415 - beside its only use

        return datetime.now(UTC)

    async def sleep_until(self, monotonic_s: float) -> None:
        """Wait until a monotonic time."""
        await asyncio.sleep(max(0.0, monotonic_s - time.monotonic()))


class LoopAnswer(StrEnum):
    """How the loop or its status server answers a request, beside what `AnswerCode` says."""

    SENSOR_ALARM_MEANWHILE = "sensor_alarm_meanwhile"
    """A sensor's alarm came that the person cannot have seen."""
    ENDING = "ending"
    """The loop is being ended."""
    ENDED = "ended"
    """The loop has ended."""
    NO_MODEL_FOLDER = "no_model_folder"
    """No folder of models is configured."""
    MODEL_UNUSABLE = "model_unusable"
    """The model cannot be used; ``why`` says why."""
    MODEL_OUTPUTS = "model_outputs"
    """The model gives ``names``; the machine needs ``needed``."""
    MODEL_SETTLES = "model_settles"
    """The new model takes over once it has settled."""
    NAME_UNUSABLE = "name_unusable"
    """A name has signs that cannot be shown, or is too long."""
    NUMBER_NOT_FINITE = "number_not_finite"
    """A number is not finite."""
    NOT_AT_COMPUTER = "not_at_computer"
    """The configuration does not allow it to be asked for at the computer itself."""
    NO_ANSWER = "no_answer"
    """The loop has not answered in time; the request may still take effect."""


class RequestOutcome(NamedTuple):
    """How a request of the status server was answered."""

    accepted: bool
    code: AnswerCode | LoopAnswer
    """Why not, or what follows."""
    values: Mapping[str, Value] = MappingProxyType({})
    """Values that belong to the code, each with its unit in its name."""

    @property
    def message(self) -> Message:
        """The answer as a message."""
        return Message(f"answer-{self.code}", self.values)


class RequestBox(Protocol):
    """Where the status server puts requests; the loop answers them in its next cycle."""

    async def submit(self, request: Request) -> RequestOutcome:
        """Hand in a request and wait for its answer."""
        ...


# ---- names by which a source is asked -----------------------------------------------------------

OTHER_COMPENSATION = "other_compensation"
"""Name of the flag that says whether another compensation is active."""
DATUM = "datum"
"""Name of the number that changes when a datum is set, or an axis referenced anew."""
DIAMETER = "diameter"
"""Name of the workpiece's clamping diameter, where the machine states it. [mm]"""


def redundant_name(channel: str) -> str:
    """Return the name under which a channel's redundant sensor is read."""
    return f"{channel}.redundant"


def probe_name(output: str) -> str:
    """Return the name under which a displacement is read that is measured at an output."""
    return f"probe.{output}"


def counter_name(output: str) -> str:
    """Return the name of the counter that rises with every touch at an output."""
    return f"probe.{output}.counter"


def interlock_name(interlock: str) -> str:
    """Return the name under which an interlock is read."""
    return f"interlock.{interlock}"
