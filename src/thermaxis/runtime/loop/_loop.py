"""The loop: each cycle reads, computes, writes, reads back and records; nothing waits for ever."""

import asyncio
import math
from collections import deque
from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import AsyncExitStack
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from enum import StrEnum
from typing import Final, Protocol, final

from thermaxis.codes import Message, Place, Value
from thermaxis.compensation import (
    Answer,
    Compensation,
    CycleOutput,
    CycleReading,
    CycleState,
    Memory,
    Request,
    RequestKind,
    Sample,
    SampleQuality,
    SupervisorState,
    cycle,
    cycle_state,
    gain_of,
    shifted,
    with_compensation,
)
from thermaxis.errors import ConfigurationError, ThermaxisError
from thermaxis.runtime._ports import (
    DIAMETER,
    NOT_READ,
    OTHER_COMPENSATION,
    Applied,
    Clock,
    CycleRecord,
    EventRecord,
    Historian,
    LoopAnswer,
    RequestOutcome,
    Sink,
    Source,
    SourceSample,
    interlock_name,
    redundant_name,
)
from thermaxis.runtime.loop._last_written import LastWrittenOffsets
from thermaxis.runtime.loop._saved_state import OTHER_VERSION, SavedState, StateFile
from thermaxis.runtime.status import (
    AgedOffset,
    Alarm,
    AlarmCode,
    OutputOffsets,
    RuntimeStatus,
    alarms_of,
    alarms_of_found,
    message_of,
    sensor_key,
    state_message,
)

SELF_TEST = "self-test passed"
"""Interlock that the loop adds: the start-up self-test found nothing that forbids a correction."""
SHORTEST_WAIT_S = 0.25
"""Time that a request to the machine is given at least, however short the cycle. [s]"""
LONGEST_WAIT_S = 1.0
"""Time that it is given at most. [s]"""
SAVED_EVERY_S = 1.0
"""The state is saved so often: what a kill may cost. [s]"""
TESTED_EVERY_S = 5.0
"""A self-test that failed is tried again so often. [s]"""
SILENCE_CYCLES = 1.5
"""After a silence of so many cycles the machine may have taken its offset back. [1]"""
SHORTEST_SILENCE_S = 0.5
"""A silence is at least so long. [s]"""
CLOCK_STEP_S = 10.0
"""A saved state may be newer than now by so much: a clock that was set. [s]"""
LAST_SAVE_S = 2.0
"""Time that the last save is waited for. [s]"""
PAST_EVERY_S = 60.0
"""Inputs are kept so often for a model that takes over later. [s]"""
PAST_ROWS = 1440
"""So many of them: a day. [1]"""
ALARMS_EVERY_S = 1.0
"""Alarms are looked for so often, and whenever the state changes. [s]"""
UNREAD_AFTER_S = 5.0
"""It is told when a machine that is there does not tell its offsets for so long. [s]"""
LARGEST_FOUND_UM = 1e5
"""A found offset of a hundred millimetres and more is a wrong unit: nothing is written. [µm]"""
_UNKNOWN = Applied(None, None)
_ENDING = RequestOutcome(accepted=False, code=LoopAnswer.ENDING)
_UNSEEN = RequestOutcome(accepted=False, code=LoopAnswer.SENSOR_ALARM_MEANWHILE)
_DECIDES: Final = frozenset({RequestKind.ENABLE, RequestKind.DISABLE, RequestKind.ACKNOWLEDGE})
"""What a person asks to go on after a saved state that was not used."""
_ACCEPTED_ANEW = frozenset(
    {
        SampleQuality.REDUNDANT,
        SampleQuality.TOO_FAST,
        SampleQuality.FROZEN,
        SampleQuality.DISAGREES,
    }
)
"""What is wrong with a sensor whose present value would be accepted by an Acknowledge."""


class AtStop(StrEnum):
    """What becomes of the offset when the loop is ended."""

    FADE = "fade"
    """It fades to zero first, within a bounded time."""
    LEAVE = "leave"
    """It stays; the machine's own watchdog decides."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LoopSettings:
    """What the loop needs besides the compensation."""

    machine: str
    """Name of the machine."""
    model_file: str
    """File name of the model."""
    model_sha256: str
    """Its hash."""
    interlocks_met: Mapping[str, bool] = field(default_factory=dict[str, bool])
    """Value that means met, by interlock."""
    other_active: bool | None = None
    """Value that means that another compensation is active; None where no node tells."""
    reads_diameter: bool = False
    """Whether the machine states the workpiece's diameter."""
    resume_enabled: bool = True
    """Whether a compensation that was enabled is enabled again after a restart."""
    resume_within_s: float = 3600.0
    """The restart must follow so soon. Default: an hour. [s]"""
    at_stop: AtStop = AtStop.FADE
    """What becomes of the offset when the loop is ended."""
    stop_within_s: float = 120.0
    """A fade at the end lasts at most so long. [s]"""
    configuration_sha256: str = ""
    """Hash of the configuration's rules, told with every status; empty where there is none."""


@final
@dataclass(frozen=True, slots=True)
class Ports:
    """What ties the loop to the world."""

    source: Source
    """Where values come from."""
    sink: Sink
    """Where corrections go."""
    historian: Historian
    """Who remembers."""
    clock: Clock
    """Time."""


class Models(Protocol):
    """Where another model comes from."""

    def __call__(self, name: str) -> tuple[Compensation, str]:
        """Return the compensation with a model of the configured folder, and the file's hash."""
        ...


class _Waiting:
    """A request whose answer somebody waits for."""

    def __init__(self, request: Request, shown: frozenset[str]) -> None:
        self.request = request
        self.shown = shown  # keys of the alarms that whoever asks can have seen
        self.change: tuple[Compensation, str] | None = None
        self.answer: asyncio.Future[RequestOutcome] = asyncio.get_running_loop().create_future()


@final
class CompensationLoop:
    """One machine's compensation, cycle after cycle.

    Parameters
    ----------
    compensation : Compensation
        Model, rules and limits.
    settings : LoopSettings
        Names, and what happens at start and end.
    ports : Ports
        Source, sink, historian and clock.
    state_file : StateFile, optional
        Where the state is saved. Default: nowhere; every start is a cold one.
    models : Models, optional
        Where another model comes from. Default: nowhere.
    self_test : callable, optional
        Awaited after the first connection; what it returns forbids a correction, each a message.
        Default: nothing is tested.

    Notes
    -----
    Not protected: the loop is one program on one computer. When it is frozen or killed the last
    offset stands until the machine's own watchdog takes it back; a machine without a watchdog
    keeps it. When it goes on it looks where the machine stands before it writes; only a freeze
    between that look and the write, a few milliseconds, is not noticed. It goes on from there, and
    tells by an alarm where that is not where it had left the offset: a hold holds what was found.
    """

    def __init__(
        self,
        compensation: Compensation,
        settings: LoopSettings,
        ports: Ports,
        *,
        state_file: StateFile | None = None,
        models: Models | None = None,
        self_test: Callable[[], Awaitable[Sequence[Message]]] | None = None,
    ) -> None:
        self.settings = settings
        self.compensation = _with_self_test(compensation) if self_test else compensation
        self.source, self.sink = ports.source, ports.sink
        self.historian, self.clock = ports.historian, ports.clock
        self.status: RuntimeStatus | None = None
        self.listeners: list[Callable[[RuntimeStatus], None]] = []
        self._state_file, self._models, self._self_test = state_file, models, self_test
        self._state = cycle_state(self.compensation)
        self._waiting: list[_Waiting] = []
        self._own_requests: list[Request] = []
        self._applied: Mapping[str, Applied] = {}
        self._applied_s = 0.0
        self._commanded: dict[str, tuple[float, float]] = {}  # [µm] and when [s], by output
        self._left = LastWrittenOffsets()
        self._found_known = False
        self._doubtful = False
        self._known_s = 0.0
        self._refused = False
        self._touched = float("inf"), self.clock.utc()
        self._forbidden: tuple[Message, ...] | None = None if self_test else ()
        self._test_task: asyncio.Task[Sequence[Message]] | None = None
        self._tested_s = float("-inf")
        self._diameter: float | None = None
        self._number = 0
        self._overruns = 0
        self._saved_s = float("-inf")
        self._saving: asyncio.Future[bool] | None = None
        self._unsaved: Message | None = None
        self._other_state: Message | None = None
        self._alarms: tuple[Alarm, ...] = ()
        self._alarms_s = float("-inf")
        self._identity = 0
        self._resume = False
        self._stopping = False
        self._ended = False
        self._started = self.clock.utc()
        self._state_since = self._started
        self._past: deque[tuple[float, Mapping[str, float]]] = deque(maxlen=PAST_ROWS)
        self._past_s = float("-inf")
        self._names = tuple(output.name for output in compensation.model.outputs)

    # ---- what others ask ------------------------------------------------------------------------

    async def submit(self, request: Request) -> RequestOutcome:
        """Hand in a request and wait for its answer, which the next cycle gives.

        Parameters
        ----------
        request : Request
            What is asked, and by whom.

        Returns
        -------
        RequestOutcome
            Whether it takes effect, and why not or what follows.
        """
        if self._stopping or self._ended:
            return _ENDING
        self._identity += 1
        alarms = () if self.status is None else self.status.alarms
        shown = frozenset(alarm.key for alarm in alarms)
        waiting = _Waiting(replace(request, identity=self._identity), shown)
        if request.kind is RequestKind.MODEL:
            refused = await self._load(waiting)
            if refused is not None:
                self._tell(waiting.request, refused)
                return refused
            if self._stopping or self._ended:  # while the model was read
                return _ENDING
        self._waiting.append(waiting)
        return await waiting.answer

    async def _load(self, waiting: _Waiting) -> RequestOutcome | None:
        """Read another model beside the cycles; return how it is refused, or None."""
        if self._models is None:
            return RequestOutcome(accepted=False, code=LoopAnswer.NO_MODEL_FOLDER)
        try:
            change = await asyncio.to_thread(self._models, waiting.request.text)
        except ThermaxisError as error:
            values = {"why": error.message}
            return RequestOutcome(accepted=False, code=LoopAnswer.MODEL_UNUSABLE, values=values)
        compensation, sha256 = change
        names = tuple(output.name for output in compensation.model.outputs)
        if names != self._names:
            values = {"names": names, "needed": self._names}
            return RequestOutcome(accepted=False, code=LoopAnswer.MODEL_OUTPUTS, values=values)
        if self._self_test:
            compensation = _with_self_test(compensation)
        waiting.change = compensation, sha256
        return None

    # ---- life -----------------------------------------------------------------------------------

    async def run(self, stop: asyncio.Event, cycles: int | None = None) -> Mapping[str, float]:
        """Run until told to stop, then fade as configured, and leave everything closed.

        Parameters
        ----------
        stop : asyncio.Event
            Set when the loop is to end.
        cycles : int, optional
            End after so many cycles, as if told to. Default: never. [1]

        Returns
        -------
        mapping
            What stands in the machine at the end, by output, as far as it is known; zero where it
            has faded. [µm]
        """
        async with AsyncExitStack() as closing:
            await self.historian.open(self._names, self._channels())
            closing.push_async_callback(self.historian.close, 5.0)
            self._restore()
            self._event("start", "event-loop_started", {"machine": self.settings.machine})
            closing.push_async_callback(self.sink.close)
            closing.push_async_callback(self.source.close)
            await self.source.open()
            await self.sink.open()
            try:
                await self._cycles(stop, cycles)
            finally:
                self._ended = True
                if self._test_task is not None:
                    self._test_task.cancel()
                self._refuse_waiting()
                await self._save_last()
                self._tell_end()
        return self._correction_um()

    def _tell_end(self) -> None:
        """Tell what stands in the machine when the loop ends."""
        left = [f"{name} {value:+.2f} um" for name, value in self._correction_um().items() if value]
        values: dict[str, Value] = {"machine": self.settings.machine}
        if left:
            values["standing"] = ", ".join(left)
        self._event("stop", "event-loop_ended_standing" if left else "event-loop_ended", values)

    def _correction_um(self) -> dict[str, float]:
        """Return the corrections of now by output. [µm]"""
        return dict(zip(self._names, self._state.correction_um, strict=True))

    async def _cycles(self, stop: asyncio.Event, cycles: int | None) -> None:
        cycle_s = self.compensation.cycle_s
        due_s = self._known_s = self.clock.monotonic_s()
        last_s = float("inf")
        while True:
            now_s = self.clock.monotonic_s()
            await self._cycle(now_s, max(0.0, now_s - due_s))
            if self.source.ended:
                return
            told = stop.is_set() or (cycles is not None and self._number >= cycles)
            if told and not self._stopping:
                self._stopping = True
                last_s = now_s + self.settings.stop_within_s
                self._begin_stop()
            if self._stopping and (self._at_rest() or now_s >= last_s):
                return
            due_s += cycle_s
            late_s = self.clock.monotonic_s() - due_s
            if late_s > cycle_s:
                missed = int(late_s / cycle_s)
                self._overruns += missed
                due_s += missed * cycle_s
            await self.clock.sleep_until(due_s)

    def _begin_stop(self) -> None:
        self._resume = self._state.memory.enabled
        if self.settings.at_stop is AtStop.FADE:
            self._own_requests.append(Request(RequestKind.DISABLE, who="the end of the loop"))

    def _at_rest(self) -> bool:
        if self.settings.at_stop is AtStop.LEAVE or not self.sink.connected:
            return True
        memory = self._state.memory
        resting = memory.state is SupervisorState.OFF or not any(self._state.correction_um)
        return resting and not memory.enabled and not self._own_requests

    # ---- one cycle ------------------------------------------------------------------------------

    async def _cycle(self, now_s: float, lateness_s: float) -> None:
        self._number += 1
        wait_s = min(max(0.5 * self.compensation.cycle_s, SHORTEST_WAIT_S), LONGEST_WAIT_S)
        if self._refused or self._differs():  # it may have taken the offset over meanwhile
            self._applied = await self.sink.read_back(wait_s)
            self._applied_s = self.clock.monotonic_s()
            if self._refused:
                self._go_back()
        samples = await self.source.read(wait_s)
        self._watch_self_test(now_s)
        found = await self._find(wait_s)
        there = self.sink.connected and self._forbidden is not None
        connected = there and self._found_known
        if connected or not there:
            self._known_s = now_s
        waiting, self._waiting = self._waiting, []
        reading = self._reading(now_s, samples, found, waiting, connected=connected)
        reading, waiting = self._without_unseen(reading, waiting)
        before = self._state.memory
        self._state, output = cycle(self.compensation, self._state, reading)
        if connected and not self._silent() and output.state is not SupervisorState.OFF:
            correction_um = dict(zip(self._names, output.correction_um, strict=True))
            self._touched = self.clock.monotonic_s(), self.clock.utc()
            written_s = self.clock.monotonic_s()
            self._commanded = {name: (um, written_s) for name, um in correction_um.items()}
            self._refused = not await self.sink.write(correction_um, wait_s)
            self._applied = await self.sink.read_back(wait_s)
            self._applied_s = self.clock.monotonic_s()
            self._left.leave(correction_um, self._applied, refused=self._refused)
        else:
            if output.state is SupervisorState.OFF:
                self._left.forget()
            self._applied = {}
            self._refused = False
            # without a heartbeat nothing stays where it is; what was not told is asked for again
            self._doubtful = self._doubtful or self._found_known
        self._answer(waiting, output.answers)
        self._remember(now_s, output)
        utc = self.clock.utc()
        self.historian.record(
            CycleRecord(
                self._number,
                utc,
                now_s,
                samples,
                output,
                self._applied,
                lateness_s,
                tuple(tuple(p.name for p in o.parts) for o in self.compensation.model.outputs),
                self._gains(),
                self._state.diameter_mm,
            )
        )
        self._publish(now_s, utc, lateness_s, samples, output, before)
        self._save(now_s)

    def _remember(self, now_s: float, output: CycleOutput) -> None:
        """Keep a row of inputs now and then, for a model that takes over later."""
        if now_s - self._past_s >= PAST_EVERY_S and None not in output.values:
            self._past_s = now_s
            channels = self.compensation.model.channels
            values = {c: v for c, v in zip(channels, output.values, strict=True) if v is not None}
            self._past.append((now_s, values))

    async def _find(self, wait_s: float) -> Mapping[str, float | None] | None:
        """Return the offsets from which the correction goes on, when they are news.

        They are what the sink found at a connection, and what stands in the machine after a
        silence: a program that was frozen finds its connection as it was, but not its offset.
        """
        before = self.clock.monotonic_s(), self.clock.utc()
        found = await self.sink.found(wait_s)
        if not self.sink.connected:
            self._found_known = self._doubtful = False
            return found
        if found is None and self._forbidden is not None:
            self._doubtful = self._doubtful or (self._found_known and self._silent())
            if self._doubtful:
                before = self.clock.monotonic_s(), self.clock.utc()
                applied = await self.sink.read_back(wait_s)
                found = {name: _standing_um(applied.get(name, _UNKNOWN)) for name in self._names}
        if found is not None:
            self._found_known = all(_is_offset(found.get(name)) for name in self._names)
            if not self._found_known and not self._doubtful:
                self._event("alarm", "event-offset_unusable")
            self._doubtful = not self._found_known
            self._touched = before
            self._compare(found)
            found = {name: self._snapped(name, found.get(name)) for name in self._names}
        return found

    def _compare(self, found_um: Mapping[str, float | None]) -> None:
        """Note which offsets are not where they were left; what is no offset is told elsewhere.

        The history has it at once: what is found again before the alarms are made is not lost.
        """
        if self._found_known:
            tolerance_um = self.compensation.supervisor.read_back_tolerance_um
            new = self._left.compare(found_um, tolerance_um, number=self._number)
            for alarm in alarms_of_found(new, self.clock.utc()):
                self._tell_alarm(alarm)

    def _snapped(self, name: str, found_um: float | None) -> float | None:
        """Return an offset that is beyond its total by a rounding of the machine as the total."""
        if found_um is None:
            return None
        total_um = self.compensation.limits[name].total_um
        beyond_um = abs(found_um) - total_um
        if 0.0 < beyond_um <= self.compensation.supervisor.read_back_tolerance_um:
            return math.copysign(total_um, found_um)
        return found_um

    def _silent(self) -> bool:
        """Whether the machine has not been looked at or written to for too long.

        The time of day is asked as well: the other clock stands still while a computer sleeps.
        """
        at_s, at = self._touched
        by_day_s = (self.clock.utc() - at) / timedelta(seconds=1)
        silent_s = max(self.clock.monotonic_s() - at_s, by_day_s)
        return silent_s > max(SILENCE_CYCLES * self.compensation.cycle_s, SHORTEST_SILENCE_S)

    def _go_back(self) -> None:
        """Go on from what acts where the machine refuses writes and took its offset back.

        What it accepted before still stands there, so that it stays a difference, and a fault.
        """
        tolerance_um = self.compensation.supervisor.read_back_tolerance_um
        corrections = list(self._state.correction_um)
        for k, name in enumerate(self._names):
            _, accepted_um, effective_um = self._applied.get(name, _UNKNOWN)
            if accepted_um is None or effective_um is None:
                continue
            if abs(effective_um - accepted_um) > tolerance_um:
                corrections[k] = self._snapped(name, effective_um) or 0.0
        self._state = self._state._replace(correction_um=tuple(corrections))

    def _differs(self) -> bool:
        """Whether the machine did not report what was written when it was last asked."""
        if not self._applied or not self.sink.connected:
            return False
        tolerance_um = self.compensation.supervisor.read_back_tolerance_um
        for name, correction_um in self._correction_um().items():
            accepted_um = self._applied.get(name, _UNKNOWN).accepted_um
            if accepted_um is None or abs(accepted_um - correction_um) > tolerance_um:
                return True
        return False

    def _reading(
        self,
        now_s: float,
        samples: Mapping[str, SourceSample],
        found: Mapping[str, float | None] | None,
        waiting: Sequence[_Waiting],
        *,
        connected: bool,
    ) -> CycleReading:
        compensation, settings = self.compensation, self.settings
        channels = compensation.model.channels
        redundant: tuple[Sample | None, ...] = ()
        if compensation.redundant:
            redundant = tuple(
                _sample(samples, redundant_name(c)) if c in compensation.redundant else None
                for c in channels
            )
        other = samples.get(OTHER_COMPENSATION, NOT_READ)
        active: bool | None = False
        if settings.other_active is not None:
            active = _flag(other, settings.other_active)
        read_back = None
        if self._applied:
            read_back = tuple(
                applied.accepted_um if (applied := self._applied.get(name)) else None
                for name in self._names
            )
        requests = [one.request for one in waiting if one.change is None]
        requests.extend(self._own_requests)
        self._own_requests = []
        requests.extend(self._changed_diameter(samples))
        for one in waiting:
            self._change_model(one)
        return CycleReading(
            now_s,
            tuple([_sample(samples, channel) for channel in channels]),
            redundant,
            tuple([self._met(name, samples) for name in compensation.interlocks]),
            connected,
            read_back,
            None if found is None else tuple(found.get(name) for name in self._names),
            active,
            tuple(requests),
        )

    def _met(self, interlock: str, samples: Mapping[str, SourceSample]) -> bool | None:
        if interlock == SELF_TEST:
            return self._forbidden is not None and not self._forbidden
        sample = samples.get(interlock_name(interlock), NOT_READ)
        return _flag(sample, self.settings.interlocks_met.get(interlock, True))

    def _changed_diameter(self, samples: Mapping[str, SourceSample]) -> list[Request]:
        if not self.settings.reads_diameter:
            return []
        sample = samples.get(DIAMETER, NOT_READ)
        if not sample.good or sample.value is None or sample.value == self._diameter:
            return []
        self._diameter = sample.value
        return [Request(RequestKind.DIAMETER, who="the machine", value=sample.value)]

    def _change_model(self, waiting: _Waiting) -> None:
        if waiting.change is None:
            return
        new, sha256 = waiting.change
        past = tuple(self._past)
        self._state = with_compensation(new, self.compensation, self._state, past)
        self.compensation = new
        self.settings = replace(self.settings, model_file=waiting.request.text, model_sha256=sha256)

    def _without_unseen(
        self, reading: CycleReading, waiting: list[_Waiting]
    ) -> tuple[CycleReading, list[_Waiting]]:
        """Refuse what would accept a value of a sensor whose alarm nobody can have seen.

        Who asks has seen the alarms of before. A request that waited while the loop stood still
        would else take away what came meanwhile, before it is told.
        """
        asked = [one for one in waiting if one.request.kind is RequestKind.ACKNOWLEDGE]
        if not asked:
            return reading, waiting
        others = tuple(r for r in reading.requests if r.kind is not RequestKind.ACKNOWLEDGE)
        _, output = cycle(self.compensation, self._state, reading._replace(requests=others))
        doubted = {
            sensor_key(name)
            for name, quality in zip(self._channels(), output.qualities, strict=True)
            if quality in _ACCEPTED_ANEW
        }
        refused = [one for one in asked if not doubted <= one.shown]
        for one in refused:
            self._tell(one.request, _UNSEEN)
            if not one.answer.done():
                one.answer.set_result(_UNSEEN)
        identities = {one.request.identity for one in refused}
        left = tuple(r for r in reading.requests if r.identity not in identities)
        return reading._replace(requests=left), [one for one in waiting if one not in refused]

    def _answer(self, waiting: Sequence[_Waiting], answers: Sequence[Answer]) -> None:
        by_identity = {answer.request.identity: answer for answer in answers}
        shown = {one.request.identity: one.shown for one in waiting}
        for answer in answers:
            self._tell(answer.request, _outcome_of(answer))
            if answer.accepted and answer.request.kind in _DECIDES:
                self._other_state = None
            if answer.accepted and answer.request.kind is RequestKind.ACKNOWLEDGE:
                self._left.acknowledge(shown.get(answer.request.identity, frozenset()))
        for one in waiting:
            if one.change is not None:
                outcome = RequestOutcome(accepted=True, code=LoopAnswer.MODEL_SETTLES)
                self._tell(one.request, outcome)
            else:
                outcome = _outcome_of(by_identity[one.request.identity])
            if not one.answer.done():
                one.answer.set_result(outcome)

    def _refuse_waiting(self) -> None:
        for one in self._waiting:
            if not one.answer.done():
                one.answer.set_result(RequestOutcome(accepted=False, code=LoopAnswer.ENDED))
        self._waiting = []

    # ---- self-test ------------------------------------------------------------------------------

    def _watch_self_test(self, now_s: float) -> None:
        """Start the self-test once the machine is there, and take its findings."""
        if self._self_test is None:
            return
        task = self._test_task
        if task is not None:
            if task.done():
                self._test_task = None
                self._tested_s = now_s
                self._take_findings(tuple(task.result()))
            return
        again = bool(self._forbidden) and now_s - self._tested_s >= TESTED_EVERY_S
        if self.source.connected and self.sink.connected and (self._forbidden is None or again):
            self._test_task = asyncio.ensure_future(self._self_test())

    def _take_findings(self, findings: tuple[Message, ...]) -> None:
        # their numbers change with every look
        if self._forbidden is None or _kinds(findings) != _kinds(self._forbidden):
            for finding in findings:
                self._event("alarm", "event-self_test", {"finding": finding})
            if not findings:
                self._event("start", "event-self_test_passed")
        self._forbidden = findings

    # ---- telling --------------------------------------------------------------------------------

    def _publish(
        self,
        now_s: float,
        utc: datetime,
        lateness_s: float,
        samples: Mapping[str, SourceSample],
        output: CycleOutput,
        before: Memory,
    ) -> None:
        memory = self._state.memory
        if memory.state is not before.state or self._number == 1:
            self._state_since = utc
            told = state_message(output)
            self._event("state", told.code, told.values)
        compensation, settings, last = self.compensation, self.settings, self.status
        status = RuntimeStatus(
            machine=settings.machine,
            started=self._started,
            utc=utc,
            number=self._number,
            cycle_s=compensation.cycle_s,
            lateness_s=lateness_s,
            overruns=self._overruns,
            state_since=self._state_since,
            enabled=memory.enabled,
            output=output,
            outputs=self._names,
            channels=compensation.model.channels,
            samples=samples,
            applied=self._applied,
            source_connected=self.source.connected,
            sink_connected=self.sink.connected,
            model_file=settings.model_file,
            model_sha256=settings.model_sha256,
            diameter_mm=self._state.diameter_mm,
            reference_c=dict(
                zip(compensation.model.channels, self._state.thermal.reference, strict=False)
            ),
            trim_owner={n: t.who for n, t in zip(self._names, self._state.trims, strict=True)},
            trim_left_s={n: t.left_s for n, t in zip(self._names, self._state.trims, strict=True)},
            alarms=self._alarms,
            historian=self.historian.status,
            offsets=self._offsets(),
            source_reason=self.source.failure,
            sink_reason=self.sink.failure,
            configuration_sha256=settings.configuration_sha256,
        )
        if last is not None:
            self._tell_connections(last, status)
        if now_s - self._alarms_s >= ALARMS_EVERY_S or memory.state is not before.state:
            self._alarms_s = now_s
            self._alarms = alarms_of(
                status,
                compensation,
                self._forbidden or (),
                self._left.elsewhere(),
                unread=now_s - self._known_s >= UNREAD_AFTER_S,
                other_state=self._other_state,
            )
            self._tell_alarms(status.alarms)
            status = replace(status, alarms=self._alarms)
        self.status = status
        for listener in self.listeners:
            listener(status)

    def _offsets(self) -> dict[str, OutputOffsets]:
        """Return what is known of every offset, with the time since it was learned."""
        now_s = self.clock.monotonic_s()
        told: dict[str, OutputOffsets] = {}
        for name in self._names:
            _, *said = self._applied.get(name, _UNKNOWN)
            read = (
                AgedOffset() if um is None else AgedOffset(um, now_s - self._applied_s)
                for um in said
            )
            um, at_s = self._commanded.get(name, (None, 0.0))
            commanded = AgedOffset() if um is None else AgedOffset(um, now_s - at_s)
            told[name] = OutputOffsets(commanded, *read)
        return told

    def _tell_connections(self, last: RuntimeStatus, now: RuntimeStatus) -> None:
        for what, before, after in (
            ("source", last.source_connected, now.source_connected),
            ("sink", last.sink_connected, now.sink_connected),
        ):
            if before is not after:
                self._event("connection", f"event-{what}_{'connected' if after else 'lost'}")

    def _tell_alarms(self, before: Sequence[Alarm]) -> None:
        known = {alarm.key for alarm in before}
        for alarm in self._alarms:
            told = alarm.code == AlarmCode.FOUND_ELSEWHERE  # when it was found
            if alarm.key not in known and not told:
                self._tell_alarm(alarm)
        standing = {alarm.key for alarm in self._alarms}
        for alarm in before:
            if alarm.key not in standing:
                self._event("alarm", "event-alarm_gone", {"alarm": message_of(alarm)})

    def _tell_alarm(self, alarm: Alarm) -> None:
        values = {"priority": alarm.priority, "alarm": message_of(alarm)}
        self._event("alarm", "event-alarm", values)

    def _tell(self, request: Request, outcome: RequestOutcome) -> None:
        accepted = outcome.accepted
        code = "event-request_accepted" if accepted else "event-request_refused"
        values = {"request": str(request.kind), "answer": outcome.message}
        self.historian.event(
            EventRecord.of(
                self.clock.utc(),
                "request",
                request.who,
                Message(code, values),
                {
                    "kind": str(request.kind),
                    "output": request.output,
                    "value": request.value,
                    "duration_s": request.duration_s,
                    "text": request.text,
                    "accepted": accepted,
                },
            )
        )

    def _event(self, kind: str, code: str, values: Mapping[str, Value] | None = None) -> None:
        message = Message(code, values or {})
        self.historian.event(EventRecord.of(self.clock.utc(), kind, "", message))

    def _gains(self) -> tuple[tuple[float, ...], ...]:
        """Return the gain of every part at the workpiece's diameter."""
        diameter_mm = self._state.diameter_mm
        outputs = self.compensation.model.outputs
        return tuple(tuple(gain_of(part, diameter_mm) for part in o.parts) for o in outputs)

    def _channels(self) -> tuple[str, ...]:
        return self.compensation.model.channels

    # ---- state ----------------------------------------------------------------------------------

    def _save(self, now_s: float) -> None:
        """Save the state beside the cycles, which wait for no disk."""
        if self._state_file is None or now_s - self._saved_s < SAVED_EVERY_S:
            return
        saving = self._saving
        if saving is not None:
            if not saving.done():
                return
            self._tell_unsaved(self._state_file.failure)
        self._saved_s = now_s
        self._saving = self._begin_save(self._state_file, now_s)

    def _begin_save(self, file: StateFile, now_s: float) -> "asyncio.Future[bool]":
        enabled = self._resume if self._stopping else self._state.memory.enabled
        saved = SavedState(
            self.clock.utc(),
            now_s,
            self.settings.model_sha256,
            self.settings.model_file,
            enabled,
            self._state,
        )
        return asyncio.ensure_future(asyncio.to_thread(file.save, saved, self.compensation))

    async def _save_last(self) -> None:
        """Save how it ends, as far as the disk answers in time."""
        if self._saving is not None:
            await asyncio.wait({self._saving}, timeout=LAST_SAVE_S)
        if self._state_file is None or (self._saving is not None and not self._saving.done()):
            return
        self._saving = self._begin_save(self._state_file, self.clock.monotonic_s())
        await asyncio.wait({self._saving}, timeout=LAST_SAVE_S)
        self._tell_unsaved(self._state_file.failure)

    def _tell_unsaved(self, failure: Message | None) -> None:
        if failure != self._unsaved:
            if failure is None:
                self._event("alarm", "event-state_saved_again")
            else:
                self._event("alarm", failure.code, failure.values)
        self._unsaved = failure

    def _restore(self) -> None:
        """Take up a saved state as far as its age allows, and say what was taken."""
        if self._state_file is None:
            return
        saved, why = self._state_file.load(self.compensation)
        if saved is None:
            if why is not None and why.code == OTHER_VERSION:
                self._other_state = why
            self._event("start", "event-no_saved_state", {"why": why})
            return
        now, now_s = self.clock.utc(), self.clock.monotonic_s()
        age_s = (now - saved.utc) / timedelta(seconds=1)
        if age_s < -CLOCK_STEP_S:
            old = saved.state.memory
            if old.state is SupervisorState.FAULT:
                self._state = self._state._replace(memory=_latched(old))
                self._event("start", "event-saved_state_newer_fault", {"reason": old.fault})
            else:
                self._event("start", "event-saved_state_newer")
            return
        age_s = max(0.0, age_s)
        self._state, taken = resumed(
            saved, self.compensation, self.settings, now_s=now_s, age_s=age_s
        )
        self._diameter = self._state.diameter_mm
        if self._state.memory.held:  # the hold goes on, and should hold what it held
            self._left.leave(self._correction_um(), {})
        self._event("start", "event-saved_state", {"age_s": age_s, "resumed": taken})


def resumed(
    saved: SavedState,
    compensation: Compensation,
    settings: LoopSettings,
    *,
    now_s: float,
    age_s: float,
) -> tuple[CycleState, Message]:
    """Return the state with which a loop goes on after a restart, and what it is."""
    state = shifted(saved.state, now_s - age_s - saved.monotonic_s)
    old = state.memory
    kept = Message("kept-sections")
    if saved.model_sha256 != settings.model_sha256:
        state = with_compensation(compensation, compensation, state)
        kept = Message("kept-other_model", {"file": saved.model_file})
    elif age_s > compensation.model.longest_gap_s:
        kept = Message("kept-steady_state")
    same = saved.model_sha256 == settings.model_sha256
    soon = age_s <= settings.resume_within_s
    enabled = saved.enabled and settings.resume_enabled and soon and same
    memory = Memory(
        state=_begun(old, enabled=enabled),
        enabled=enabled,
        held=old.held and enabled,
        held_s=old.held_s + age_s if old.held else 0.0,
        running_s=state.memory.running_s,
    )
    taken = Message("resumed-enabled" if enabled else "resumed-off", {"kept": kept})
    if old.state is SupervisorState.FAULT:
        memory = _latched(old)
        taken = Message("resumed-fault", {"kept": kept, "reason": old.fault})
    trims = tuple(
        trim._replace(left_s=trim.left_s - age_s) if trim.left_s > age_s else type(trim)()
        for trim in state.trims
    )
    return state._replace(memory=memory, trims=trims), taken


def _outcome_of(answer: Answer) -> RequestOutcome:
    return RequestOutcome(answer.accepted, answer.code, answer.values)


def _begun(old: Memory, *, enabled: bool) -> SupervisorState:
    """Return the state after a restart: a fade that was asked for goes on."""
    if enabled:
        return SupervisorState.WARMING
    fading = old.state is SupervisorState.FADING and not old.enabled
    return SupervisorState.FADING if fading else SupervisorState.OFF


def _latched(memory: Memory) -> Memory:
    """Return the memory of a fault that no restart forgets."""
    return Memory(state=SupervisorState.FAULT, enabled=memory.enabled, fault=memory.fault)


def _is_offset(found_um: float | None) -> bool:
    """Whether what was found can be an offset at all; another unit gives far larger numbers."""
    return found_um is not None and abs(found_um) <= LARGEST_FOUND_UM


def _kinds(findings: Sequence[Message]) -> list[tuple[str, Place]]:
    return [(finding.code, finding.place) for finding in findings]


def _with_self_test(compensation: Compensation) -> Compensation:
    """Return the compensation with the self-test as its first interlock."""
    if len(compensation.interlocks) and compensation.interlocks[0] == SELF_TEST:
        return compensation
    if SELF_TEST in compensation.interlocks:
        raise ConfigurationError("reserved_name", name=SELF_TEST, place=Place(key="interlock"))
    return replace(compensation, interlocks=(SELF_TEST, *compensation.interlocks))


def _standing_um(applied: Applied) -> float | None:
    """Return where an offset stands: what acts where the machine tells, else what it accepted."""
    return applied.accepted_um if applied.effective_um is None else applied.effective_um


def _flag(sample: SourceSample, meaning: bool) -> bool | None:  # noqa: FBT001 - the value that means yes
    """Return whether a flag has the value that is looked for; None where it was not read."""
    if not sample.good or sample.value is None:
        return None
    return (sample.value != 0.0) is meaning


def _sample(samples: Mapping[str, SourceSample], name: str) -> Sample:
    sample = samples.get(name, NOT_READ)
    return Sample(sample.value, sample.good, sample.age_s)
