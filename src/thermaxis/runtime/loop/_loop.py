"""The loop: each cycle reads, computes, writes, reads back and records; nothing waits for ever."""

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import AsyncExitStack
from dataclasses import replace
from typing import TYPE_CHECKING, Final, final

from thermaxis.codes import Message, Value
from thermaxis.compensation import (
    Answer,
    Compensation,
    CycleOutput,
    CycleReading,
    Request,
    RequestKind,
    SampleQuality,
    SupervisorState,
    cycle,
    cycle_state,
    with_compensation,
)
from thermaxis.runtime._offsets import Found, acknowledged, offset_rules, standing
from thermaxis.runtime._ports import DATUM, DIAMETER, NOT_READ, RequestOutcome, SourceSample
from thermaxis.runtime.loop._journal import Journal
from thermaxis.runtime.loop._machine import Machine
from thermaxis.runtime.loop._reading import reading_of
from thermaxis.runtime.loop._requests import Requests, Waiting
from thermaxis.runtime.loop._saved_state import SavedState, Saver, StateFile, take_up
from thermaxis.runtime.loop._self_test import SELF_TEST, SelfTest, with_self_test
from thermaxis.runtime.loop._settings import AtStop, LoopSettings, Models, Ports
from thermaxis.runtime.loop._telling import differing, record_of, status_of
from thermaxis.runtime.loop._touches import Touches, judged_touches
from thermaxis.runtime.status import Alarm, RuntimeStatus, alarms_of, sensor_key, state_message

if TYPE_CHECKING:
    from datetime import datetime

SHORTEST_WAIT_S = 0.25
"""Time that a request to the machine is given at least, however short the cycle. [s]"""
LONGEST_WAIT_S = 1.0
"""Time that it is given at most. [s]"""
PAST_EVERY_S = 60.0
"""Inputs are kept so often for a model that takes over later. [s]"""
PAST_ROWS = 1440
"""So many of them: a day. [1]"""
ALARMS_EVERY_S = 1.0
"""Alarms are looked for so often, and at once where a headline may change. [s]"""
UNREAD_AFTER_S = 5.0
"""It is told when a machine that is there does not tell its offsets for so long. [s]"""
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
        Awaited after the first connection; what it returns forbids a correction, each a message,
        and so does that it fails. Default: nothing is tested.

    Notes
    -----
    Not protected: the loop is one program on one computer. When it is frozen or killed the last
    offset stands until the machine's own watchdog takes it back; a machine without a watchdog
    keeps it. It looks where the machine stands before every write and goes on from there; only
    what happens between that look and the write, a few milliseconds, is not noticed. It tells by
    an alarm where that is not where it had left the offset: a hold holds what was found.
    A listener that raises ends it.
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
        own = self_test is not None or settings.latch_offset_mismatch
        self.compensation = with_self_test(compensation) if own else compensation
        self.source, self.sink = ports.source, ports.sink
        self.historian, self.clock = ports.historian, ports.clock
        self.status: RuntimeStatus | None = None
        self.certificates: Mapping[str, datetime] = {}  # until when they are valid, by key
        self.listeners: list[Callable[[RuntimeStatus], None]] = []
        self._journal = Journal(self.historian, self.clock)
        self._requests = Requests(models, self._journal.request)
        self._saver = Saver(state_file, lambda m: self._journal.event("alarm", m.code, m.values))
        self._state_file = state_file
        self._state = cycle_state(self.compensation)
        self._names = tuple(output.name for output in compensation.model.outputs)
        self._machine = Machine(ports, self._journal, self.compensation)
        self._interlocks: Mapping[str, bool | None] = {}
        self._held_by, self._differing = "", tuple[str, ...]()
        self._known_s = 0.0
        self._test = SelfTest(self_test, self._journal)
        self._touches = Touches(settings)
        self._diameter: float | None = None
        self._datum: float | None = None
        self._number = self._overruns = 0
        self._other_state: Message | None = None
        self._alarms: tuple[Alarm, ...] = ()
        self._alarms_s = self._past_s = float("-inf")
        self._signs: object = None
        self._resume = self._stopping = False
        self._state_since = self._started = self.clock.utc()
        self._past: deque[tuple[float, Mapping[str, float]]] = deque(maxlen=PAST_ROWS)

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
        alarms = () if self.status is None else self.status.alarms
        return await self._requests.submit(request, alarms, self._names)

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
            await self.historian.open(self._names)
            closing.push_async_callback(self.historian.close, 5.0)
            self._restore()
            self._journal.event("start", "event-loop_started", {"machine": self.settings.machine})
            closing.push_async_callback(self.sink.close)
            closing.push_async_callback(self.source.close)
            await self.source.open()
            await self.sink.open()
            try:
                await self._cycles(stop, cycles)
            finally:
                self._test.cancel()
                self._requests.close()
                await self._saver.save_last(self._saved, self.compensation)
                self._tell_end()
        return self._correction_um()

    def _restore(self) -> None:
        if self._state_file is None:
            return
        taken = take_up(self._state_file, self.compensation, self.settings, self.clock)
        self._other_state = taken.other_version
        self._journal.event("start", taken.event.code, taken.event.values)
        if taken.state is None:
            return
        self._state, self._diameter = taken.state, taken.state.diameter_mm
        self._held_by = taken.held_by
        offsets = self._machine.offsets
        self._machine.offsets = offsets._replace(mismatches=taken.mismatches)
        memory, latches = self._state.memory, self.settings.latch_offset_mismatch
        if memory.held or (memory.enabled and latches):  # it should stand where it was
            self._machine.left_at(self._state.correction_um)

    def _tell_end(self) -> None:
        """Tell what stands in the machine when the loop ends."""
        left = [f"{name} {value:+.2f} um" for name, value in self._correction_um().items() if value]
        values: dict[str, Value] = {"machine": self.settings.machine}
        if left:
            values["standing"] = ", ".join(left)
        self._journal.event(
            "stop", "event-loop_ended_standing" if left else "event-loop_ended", values
        )

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
        self._stopping = self._requests.closed = True
        self._resume = self._state.memory.enabled
        if self.settings.at_stop is AtStop.FADE:
            self._requests.own.append(Request(RequestKind.DISABLE, who="the end of the loop"))

    def _at_rest(self) -> bool:
        if self.settings.at_stop is AtStop.LEAVE or not self.sink.connected:
            return True
        memory = self._state.memory
        resting = memory.state is SupervisorState.OFF or not any(self._state.correction_um)
        return resting and not memory.enabled and not self._requests.own

    # ---- one cycle ------------------------------------------------------------------------------

    async def _cycle(self, now_s: float, lateness_s: float) -> None:
        """Read, judge and compute, write, read back, record."""
        self._number += 1
        wait_s = min(max(0.5 * self.compensation.cycle_s, SHORTEST_WAIT_S), LONGEST_WAIT_S)
        samples = await self.source.read(wait_s)
        found = await self._machine.look(self._number, wait_s)
        self._test.watch(now_s, there=self.source.connected and self.sink.connected)
        samples, output = self._compute(now_s, samples, found)
        await self._machine.write(output, wait_s, ready=self._ready)
        self._record(now_s, lateness_s, samples, output)
        memory = self._state.memory
        decided = memory.enabled, memory.fault, self._latched, self.settings.model_sha256
        decided = *decided, *(one.off for one in self._state.offsets)
        self._saver.save(self._saved, self.compensation, now_s, decided)

    @property
    def _latched(self) -> bool:
        """Whether an offset was not where it had been left, and nobody has acknowledged it."""
        return self.settings.latch_offset_mismatch and bool(self._machine.offsets.mismatches)

    @property
    def _ready(self) -> bool:
        """Whether the machine is there, tested, and told its offsets."""
        return (
            self.sink.connected and self._test.forbidden is not None and self._machine.offsets.known
        )

    def _compute(
        self,
        now_s: float,
        samples: Mapping[str, SourceSample],
        found: Found,
    ) -> tuple[Mapping[str, SourceSample], CycleOutput]:
        """Answer requests, take touches, advance the model and limit the correction."""
        if self._ready or not self.sink.connected or self._test.forbidden is None:
            self._known_s = now_s
        waiting, own = self._requests.take()
        for one in waiting:
            self._change_model(one)
        own.extend(self._changed_diameter(samples))
        own.extend(self._changed_datum(samples))
        reading = reading_of(
            self.compensation,
            self.settings,
            samples,
            found,
            time_s=now_s,
            connected=self._ready,
            tested=self._test.passed and not self._latched,
        )
        met = dict(zip(self.compensation.interlocks, reading.interlocks, strict=True))
        self._interlocks = {name: one for name, one in met.items() if name != SELF_TEST}
        if False in self._interlocks.values():
            self._machine.interlocked_s = now_s
        waiting = self._requests.without_unseen(waiting, self._doubted(reading, waiting))
        asked = [one.request for one in waiting if one.change is None]
        typed = [one for one in asked if one.kind is RequestKind.TOUCH and one.value is not None]
        typed = typed if self.compensation.touches else []
        asked = [one for one in asked if one not in typed]
        samples, touches = self._touches.take(self.compensation, samples, self._state, now_s, typed)
        reading = reading._replace(requests=(*asked, *own), touches=touches)
        self._state, output = cycle(self.compensation, self._state, reading)
        unlike = {*differing(self.compensation, self._state.memory, found, output)}
        unlike |= standing(self._machine.rules, self._machine.offsets)
        self._differing = tuple(name for name in self._names if name in unlike)
        answers = (*output.answers, *judged_touches(typed, output))
        self._requests.answer(waiting, answers)
        self._heed(waiting, answers)
        self._touches.judged(self._journal, touches, output, self.clock.utc())
        return samples, output

    # ---- what is asked -------------------------------------------------------------------------

    def _changed_diameter(self, samples: Mapping[str, SourceSample]) -> list[Request]:
        if not self.settings.reads_diameter:
            return []
        sample = samples.get(DIAMETER, NOT_READ)
        if not sample.good or sample.value is None or sample.value == self._diameter:
            return []
        self._diameter = sample.value
        return [Request(RequestKind.DIAMETER, who="the machine", value=sample.value)]

    def _changed_datum(self, samples: Mapping[str, SourceSample]) -> list[Request]:
        sample = samples.get(DATUM, NOT_READ)
        if not sample.good or sample.value is None or sample.value == self._datum:
            return []
        known, self._datum = self._datum is not None, sample.value
        return [Request(RequestKind.DATUM, who="the machine")] if known else []

    def _change_model(self, waiting: Waiting) -> None:
        if waiting.change is None:
            return
        new, sha256 = waiting.change
        if SELF_TEST in self.compensation.interlocks:
            new = with_self_test(new)
        self._state = with_compensation(new, self.compensation, self._state, tuple(self._past))
        self.compensation, self._machine.rules = new, offset_rules(new)
        self.settings = replace(self.settings, model_file=waiting.request.text, model_sha256=sha256)

    def _doubted(self, reading: CycleReading, waiting: Sequence[Waiting]) -> set[str]:
        """Return the alarms that an Acknowledge would end, of sensors and touches, if asked."""
        if not any(one.request.kind is RequestKind.ACKNOWLEDGE for one in waiting):
            return set()
        _, output = cycle(self.compensation, self._state, reading)
        rows = zip(self.compensation.judged, output.qualities, strict=True)
        doubted = {sensor_key(name) for name, quality in rows if quality in _ACCEPTED_ANEW}
        void = (k for k, one in enumerate(self._state.offsets) if one.off)
        return doubted | {f"touch void {self._names[k]}" for k in void}

    def _heed(self, waiting: Sequence[Waiting], answers: Sequence[Answer]) -> None:
        """Tell no more of what somebody has seen or decided."""
        shown = {one.request.identity: one.shown for one in waiting}
        for answer in answers:
            if answer.accepted and answer.request.kind in _DECIDES:
                self._other_state = None
            if answer.accepted and answer.request.kind is RequestKind.HOLD:
                self._held_by = answer.request.who
            if answer.accepted and answer.request.kind is RequestKind.ACKNOWLEDGE:
                seen = shown.get(answer.request.identity, ())
                self._machine.offsets = acknowledged(self._machine.offsets, seen)

    # ---- record ---------------------------------------------------------------------------------

    def _record(
        self,
        now_s: float,
        lateness_s: float,
        samples: Mapping[str, SourceSample],
        output: CycleOutput,
    ) -> None:
        """Record the cycle, tell what has changed, and keep inputs for a model that takes over."""
        utc = self.clock.utc()
        changed = self.status is None or self.status.output.state is not output.state
        if changed:
            self._state_since = utc
        status = status_of(
            self.compensation,
            self.settings,
            self._state,
            output,
            started=self._started,
            utc=utc,
            number=self._number,
            lateness_s=lateness_s,
            overruns=self._overruns,
            state_since=self._state_since,
            samples=samples,
            source_connected=self.source.connected,
            sink_connected=self.sink.connected,
            alarms=self._alarms,
            historian=self.historian.status,
            certificates=self.certificates,
            offsets=self._machine.aged(),
            interlocks=self._interlocks,
            held_by=self._held_by,
            touches=self._touches.told(self.compensation, self._state, output),
            differing=self._differing,
            source_reason=self.source.failure,
            sink_reason=self.sink.failure,
        )
        if changed:
            told = state_message(status)
            self._journal.event("state", told.code, told.values)
        touched = self._touches.outcomes
        self.historian.record(record_of(status, now_s, self._machine.applied, touched))
        self._journal.connections(self.status, status)
        known = tuple(map(status.acting_known, self._names))
        signs = (known, status.sink_connected, output.reasons, output.at_limit, output.state)
        signs = (*signs, self._machine.offsets.mismatches)
        if signs != self._signs or now_s - self._alarms_s >= ALARMS_EVERY_S:
            self._alarms_s, self._signs = now_s, signs
            self._alarms = alarms_of(
                status,
                self.compensation,
                self._test.forbidden or (),
                self._machine.offsets.mismatches,
                standing=standing(self._machine.rules, self._machine.offsets),
                unread=now_s - self._known_s >= UNREAD_AFTER_S,
                other_state=self._other_state,
            )
            self._journal.alarms(status.alarms, self._alarms)
        status = replace(status, alarms=self._alarms)
        if now_s - self._past_s >= PAST_EVERY_S and None not in output.values:
            self._past_s = now_s
            rows = zip(status.channels, output.values, strict=True)
            self._past.append((now_s, {c: v for c, v in rows if v is not None}))
        self.status = status
        for listener in self.listeners:
            listener(status)

    def _saved(self) -> SavedState:
        return SavedState(
            self.clock.utc(),
            self.clock.monotonic_s(),
            self.settings.model_sha256,
            self.settings.model_file,
            not self._latched and (self._resume if self._stopping else self._state.memory.enabled),
            self._state,
            self._held_by,
            self._machine.offsets.mismatches,
        )
