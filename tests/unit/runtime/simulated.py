"""A machine in memory, and a loop beside it in virtual time: one rig for all tests of the loop.

The machine takes what it is told at once, so that whatever it shows the loop has done; beside a
watchdog it takes its offset back without a moved heartbeat, at once as well.
"""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple, cast

from thermaxis.codes import Message, Place
from thermaxis.compensation import (
    Compensation,
    CompensationModel,
    Limits,
    Output,
    Part,
    Request,
    RequestKind,
    Section,
    SensorRules,
    SupervisorRules,
    SupervisorState,
    TouchRules,
)
from thermaxis.errors import ConfigurationError
from thermaxis.runtime import (
    NOT_READ,
    OTHER_COMPENSATION,
    START_S,
    Applied,
    Clock,
    CompensationLoop,
    CycleRecord,
    EventRecord,
    Historian,
    HistorianStatus,
    LoopSettings,
    Ports,
    SavedState,
    Sink,
    Source,
    SourceSample,
    StateFile,
    VirtualClock,
    run_in_virtual_time,
)

RATE, LARGEST = 0.5, 60.0
LIMITS = Limits(LARGEST, RATE)
TOLERANCE_UM = SupervisorRules().read_back_tolerance_um
WATCHDOG_S = 3.0
ROUNDED_UM = 1e-9
FLAGS = {"interlock.referenced": 1.0, OTHER_COMPENSATION: 0.0}
GOAL_UM = -36.0
"""Minus the model: 12 um/K of 3 K."""
SHA = "ab" * 32


def freeze(duration_s: float) -> None:
    """Let time go on while the whole program stands, as SIGSTOP does."""
    asyncio.get_running_loop()._jumping.now_s += duration_s


def now_s() -> float:
    try:
        return asyncio.get_running_loop().time()
    except RuntimeError:  # before and after the loop
        return START_S


# ---- the machine --------------------------------------------------------------------------------


class Write(NamedTuple):
    """What the machine took over of its first output."""

    at_s: float
    before_um: float
    after_um: float


class SimulatedMachine:
    """A machine with values by name, offsets, and everything that it can have against a program."""

    def __init__(
        self, values: Mapping[str, float | None], outputs: Sequence[str] = ("Z_um",)
    ) -> None:
        self.values = dict(values)
        self.offset_um = dict.fromkeys(outputs, 0.0)
        self.accepted_um = dict(self.offset_um)
        self.there, self.generation = True, 1
        self.obeys, self.refuses, self.watched = True, False, False
        self.source_late_s = self.write_late_s = self.freezes_s = 0.0
        self.unanswered = 0
        self.heard_s = START_S
        self.written: list[dict[str, float]] = []
        self.writes: list[Write] = []

    @property
    def z_um(self) -> float:
        """Where the first offset acts now."""
        if self.watched and now_s() - self.heard_s > WATCHDOG_S:
            self.offset_um = dict.fromkeys(self.offset_um, 0.0)
        return next(iter(self.offset_um.values()))

    def take(self, correction_um: Mapping[str, float]) -> None:
        before_um, self.heard_s = self.z_um, now_s()
        if self.obeys:
            self.set_offset(**correction_um)
        self.written.append(dict(correction_um))
        self.writes.append(Write(self.heard_s, before_um, self.z_um))

    def set_offset(self, **offset_um: float) -> None:
        self.heard_s = now_s()
        self.offset_um.update(offset_um)
        self.accepted_um.update(offset_um)

    def lose(self) -> None:
        self.there = False

    def come_back(self, offset_um: float | None = None) -> None:
        self.there, self.generation = True, self.generation + 1
        if offset_um is not None:
            self.set_offset(**dict.fromkeys(self.offset_um, offset_um))


class SimulatedSource(Source):
    def __init__(self, machine: SimulatedMachine) -> None:
        self.machine = machine

    async def open(self) -> None: ...

    @property
    def connected(self) -> bool:
        return self.machine.there

    async def read(self, deadline_s: float) -> Mapping[str, SourceSample]:
        machine = self.machine
        machine.freezes_s, frozen_s = 0.0, machine.freezes_s
        freeze(frozen_s)
        if machine.source_late_s:
            await asyncio.sleep(min(machine.source_late_s, deadline_s))
        if not machine.there or machine.source_late_s > deadline_s:
            return dict.fromkeys(machine.values, NOT_READ)
        return {
            name: NOT_READ if value is None else SourceSample(value, good=True)
            for name, value in machine.values.items()
        }

    async def close(self) -> None: ...


class SimulatedSink(Sink):
    def __init__(self, machine: SimulatedMachine, _: Clock | None = None) -> None:
        self.machine = machine
        self._told = 0
        self._requested: dict[str, float] = {}

    async def open(self) -> None: ...

    @property
    def connected(self) -> bool:
        return self.machine.there

    async def found(self, deadline_s: float) -> Mapping[str, float | None] | None:
        machine = self.machine
        if not machine.there or self._told == machine.generation:
            return None
        self._told = machine.generation
        assert machine.z_um is not None  # the watchdog acts before it is looked at
        return dict(machine.offset_um)

    async def write(self, correction_um: Mapping[str, float], deadline_s: float) -> bool:
        machine = self.machine
        assert self._told == machine.generation or not machine.there, "written before it was read"
        if machine.write_late_s:
            await asyncio.sleep(min(machine.write_late_s, deadline_s))
        late = machine.write_late_s > deadline_s
        if not machine.there or machine.refuses or self._told != machine.generation or late:
            return False
        self._requested = dict(correction_um)
        machine.take(correction_um)
        return True

    async def read_back(self, deadline_s: float) -> Mapping[str, Applied]:
        machine = self.machine
        silent = not machine.there or machine.unanswered > 0
        machine.unanswered -= machine.unanswered > 0
        assert machine.z_um is not None  # as above
        return {
            name: Applied(self._requested.get(name), None)
            if silent
            else Applied(self._requested.get(name), machine.accepted_um[name], acting_um)
            for name, acting_um in machine.offset_um.items()
        }

    async def close(self) -> None: ...


class SimulatedHistorian(Historian):
    def __init__(self) -> None:
        self.records: list[CycleRecord] = []
        self.events: list[EventRecord] = []
        self.closed = False
        self.told = HistorianStatus()

    async def open(self, outputs: object) -> None: ...

    def record(self, record: CycleRecord) -> None:
        self.records.append(record)

    def event(self, event: EventRecord) -> None:
        self.events.append(event)

    @property
    def status(self) -> HistorianStatus:
        return self.told

    async def close(self, deadline_s: float) -> None:
        self.closed = True


class Memory:
    """A state file that no disk holds up."""

    every_s = 1.0

    def __init__(self) -> None:
        self.saved: SavedState | None = None
        self.failure: Message | None = None

    def save(self, saved: SavedState, _: Compensation) -> bool:
        self.saved = saved
        return True

    def load(self, _: Compensation) -> tuple[SavedState | None, Message | None]:
        return self.saved, Message("why-no_file")


# ---- the loop beside it -------------------------------------------------------------------------


def compensation(
    gain: float = 2.0,
    *,
    rise_s: float = 30.0,
    cycle_s: float = 1.0,
    limits: Limits = LIMITS,
    touches: TouchRules | None = None,
    **rules: float,
) -> Compensation:
    part = Part("spindle", "s", "c", gain, (Section(10.0, rise_s),))
    model = CompensationModel(
        outputs=(Output("Z_um", (part,)),), reference="stated", reference_c={"s": 20.0, "c": 20.0}
    )
    return Compensation(
        model=model,
        sensors={n: SensorRules(lowest_c=1.0, highest_c=90.0) for n in ("s", "c")},
        limits={"Z_um": limits},
        supervisor=SupervisorRules(**{"settle_s": 5.0, "hold_connection_s": 20.0, **rules}),
        interlocks=("referenced",),
        cycle_s=cycle_s,
        touches={} if touches is None else {"Z_um": touches},
    )


class Rig:
    """Loops beside one machine, one after the other, with what they leave behind."""

    def __init__(
        self,
        *,
        machine: SimulatedMachine | None = None,
        sink: Callable[[SimulatedMachine, Clock], Sink] = SimulatedSink,
        **rules: Any,
    ) -> None:
        self.compensation = compensation(**rules)
        self.machine = machine or SimulatedMachine({"s": 23.0, "c": 20.0, **FLAGS})
        self.sink = sink
        self.historian = SimulatedHistorian()
        self.clock = VirtualClock()
        self.file = Memory()
        self.self_test: Callable[[], Awaitable[Sequence[Message]]] | None = None

    def loop(self, source: Source | None = None, **settings: Any) -> CompensationLoop:
        return CompensationLoop(
            self.compensation,
            LoopSettings(
                machine="lathe",
                model_file="m.json",
                model_sha256="00",
                other_active=True,
                reads_diameter=True,
                configuration_sha256=SHA,
                **settings,
            ),
            Ports(
                source or SimulatedSource(self.machine),
                self.sink(self.machine, self.clock),
                self.historian,
                self.clock,
            ),
            state_file=cast("StateFile", self.file),
            models=self.models,
            self_test=self.self_test,
        )

    def models(self, name: str) -> tuple[Compensation, str]:
        """Return a model of the folder, as the configuration would."""
        if name == "outside.json":
            raise ConfigurationError("file_outside_folder", place=Place(name))
        if name == "copy.json":
            return self.compensation, "33"
        model = compensation(gain=-1.0).model
        if name == "other-output.json":
            model = replace(model, outputs=(replace(model.outputs[0], name="X_um"),))
            return replace(self.compensation, model=model, limits={"X_um": LIMITS}), "22"
        return replace(self.compensation, model=model), "11"

    @asynccontextmanager
    async def running(
        self, source: Source | None = None, **settings: Any
    ) -> AsyncIterator[CompensationLoop]:
        """Run a loop meanwhile, and end it then as the settings say."""
        loop, stop = self.loop(source, **settings), asyncio.Event()
        async with asyncio.TaskGroup() as group:
            group.create_task(loop.run(stop))
            yield loop
            stop.set()

    def play(
        self,
        script: Callable[["Rig", CompensationLoop], Coroutine[Any, Any, None]],
        source: Source | None = None,
        **settings: Any,
    ) -> None:
        """Run a loop in virtual time while a script acts."""

        async def both() -> None:
            async with self.running(source, **settings) as loop:
                await script(self, loop)

        run_in_virtual_time(both())

    def play_and_kill(
        self,
        script: Callable[["Rig", CompensationLoop], Coroutine[Any, Any, None]],
        **settings: Any,
    ) -> None:
        """Run a loop while a script acts, and kill it: it saves nothing any more."""

        async def both() -> None:
            loop = self.loop(**settings)
            running = asyncio.ensure_future(loop.run(asyncio.Event()))
            await script(self, loop)
            saved = self.file.saved
            running.cancel()
            await asyncio.gather(running, return_exceptions=True)
            self.file.saved = saved
            self.clock = VirtualClock(self.clock.utc())  # the next loop goes on from here

        run_in_virtual_time(both())

    def said(self, kind: str) -> list[EventRecord]:
        return [event for event in self.historian.events if event.kind == kind]

    def states(self) -> set[SupervisorState]:
        return {record.output.state for record in self.historian.records}

    def assert_law(self, *, tolerance_um: float = 0.0, late_cycles: float = 2.0) -> None:
        """Assert the limits from the machine's side: between writes, and between any two times."""
        step_um = RATE * late_cycles * self.compensation.cycle_s + tolerance_um + ROUNDED_UM
        for write in self.machine.writes:
            assert abs(write.after_um) <= LARGEST + ROUNDED_UM, write
            assert abs(write.after_um - write.before_um) <= step_um, write
        for a, b in pairwise(self.machine.writes):
            if b.before_um == a.after_um:
                moved_um = abs(b.after_um - a.after_um)
                assert moved_um <= RATE * (b.at_s - a.at_s) + step_um


def state_of(loop: CompensationLoop) -> SupervisorState:
    assert loop.status is not None
    return loop.status.output.state


def alarms_of(loop: CompensationLoop) -> set[str]:
    assert loop.status is not None
    return {alarm.code for alarm in loop.status.alarms}


async def ask(loop: CompensationLoop, kind: RequestKind, **fields: Any) -> bool:
    return (await loop.submit(Request(kind, "Jana", **fields))).accepted


async def enabled_for(loop: CompensationLoop, seconds: float) -> None:
    assert await ask(loop, RequestKind.ENABLE)
    await asyncio.sleep(seconds)
