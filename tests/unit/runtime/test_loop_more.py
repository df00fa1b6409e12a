"""The loop in virtual time beside a machine that is late, deaf, gone, frozen or on its own way.

The machine takes what it is told at once, so that whatever it shows the loop has done; without a
moved heartbeat it takes its offset back, at once as well.
"""

import asyncio
import math
import random
from collections.abc import Callable, Coroutine, Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple, cast

import pytest

from tests.unit.runtime.linuxcnc_hal import freeze
from tests.unit.runtime.simulated import SimulatedHistorian
from thermaxis.codes import Message, Place
from thermaxis.compensation import (
    Compensation,
    CompensationModel,
    Limits,
    Output,
    Part,
    Reason,
    Request,
    RequestKind,
    Section,
    SensorRules,
    SupervisorRules,
    SupervisorState,
)
from thermaxis.errors import ConfigurationError
from thermaxis.runtime import (
    DIAMETER,
    NOT_READ,
    OTHER_COMPENSATION,
    Applied,
    AtStop,
    CompensationLoop,
    EventRecord,
    LoopAnswer,
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
from thermaxis.runtime.loop._loop import TESTED_EVERY_S, UNREAD_AFTER_S

RATE, LARGEST, TRIM = 0.5, 60.0, 5.0
TOLERANCE_UM = SupervisorRules().read_back_tolerance_um
LIMITS = Limits(LARGEST, RATE)
WATCHDOG_S = 3.0
ROUNDED_UM = 1e-9
FLAGS = {"interlock.referenced": 1.0, OTHER_COMPENSATION: 0.0}


def compensation(gain: float = 2.0, cycle_s: float = 1.0, **rules: float) -> Compensation:
    part = Part("spindle", "s", "c", gain, (Section(10.0, 30.0),))
    model = CompensationModel(
        outputs=(Output("Z_um", (part,)),), reference="stated", reference_c={"s": 20.0, "c": 20.0}
    )
    return Compensation(
        model=model,
        sensors={n: SensorRules(lowest_c=1.0, highest_c=90.0) for n in ("s", "c")},
        limits={"Z_um": LIMITS},
        supervisor=SupervisorRules(**{"settle_s": 5.0, "hold_connection_s": 20.0, **rules}),
        interlocks=("referenced",),
        cycle_s=cycle_s,
    )


class Write(NamedTuple):
    """What the machine took over."""

    at_s: float
    """When. [s]"""
    before_um: float
    """Where the tool stood. [µm]"""
    after_um: float
    """Where it went at once. [µm]"""


class RoughMachine:
    """A machine with everything that a machine has against a program."""

    def __init__(self) -> None:
        self.values: dict[str, float | None] = {"s": 23.0, "c": 20.0, **FLAGS}
        self.there, self.generation = True, 1
        self.refuses = self.deaf = self.watched = False
        self.source_late_s = self.write_late_s = self.freezes_s = 0.0
        self.hangs = False
        self.unanswered = 0
        self.accepted_um = self.acting_um = 0.0
        self.heard_s = 1000.0
        self.writes: list[Write] = []

    @property
    def effective_um(self) -> float:
        now_s = asyncio.get_running_loop().time()
        if self.watched and now_s - self.heard_s > WATCHDOG_S:
            self.acting_um = 0.0
        return self.acting_um

    def take(self, correction_um: float) -> None:
        before_um = self.effective_um
        self.heard_s = asyncio.get_running_loop().time()
        if not self.deaf:
            self.accepted_um = self.acting_um = correction_um
        self.writes.append(Write(self.heard_s, before_um, self.acting_um))

    def set_offset(self, offset_um: float) -> None:
        self.accepted_um = self.acting_um = offset_um
        self.heard_s = asyncio.get_running_loop().time()

    def lose(self) -> None:
        self.there = False

    def come_back(self, offset_um: float | None = None) -> None:
        self.there, self.generation = True, self.generation + 1
        if offset_um is not None:
            self.set_offset(offset_um)


class RoughSource(Source):
    def __init__(self, machine: RoughMachine) -> None:
        self.machine = machine

    async def open(self) -> None: ...

    @property
    def connected(self) -> bool:
        return self.machine.there

    async def read(self, deadline_s: float) -> Mapping[str, SourceSample]:
        machine = self.machine
        if machine.freezes_s:
            machine.freezes_s, frozen_s = 0.0, machine.freezes_s
            freeze(frozen_s)
        await asyncio.sleep(min(machine.source_late_s, deadline_s))
        if not machine.there or machine.source_late_s > deadline_s:
            return dict.fromkeys(machine.values, NOT_READ)
        return {
            name: NOT_READ if value is None else SourceSample(value, good=True)
            for name, value in machine.values.items()
        }

    async def close(self) -> None: ...


class RoughSink(Sink):
    def __init__(self, machine: RoughMachine) -> None:
        self.machine = machine
        self._told = 0
        self._requested: float | None = None

    async def open(self) -> None: ...

    @property
    def connected(self) -> bool:
        return self.machine.there

    async def found(self, deadline_s: float) -> Mapping[str, float | None] | None:
        if not self.machine.there or self._told == self.machine.generation:
            return None
        self._told = self.machine.generation
        return {"Z_um": self.machine.effective_um}

    async def write(self, correction_um: Mapping[str, float], deadline_s: float) -> bool:
        machine = self.machine
        assert self._told == machine.generation or not machine.there, "written before it was read"
        await asyncio.sleep(min(machine.write_late_s, deadline_s))
        late = machine.write_late_s > deadline_s
        if not machine.there or machine.refuses or self._told != machine.generation or late:
            return False
        self._requested = correction_um["Z_um"]
        machine.take(self._requested)
        return True

    async def read_back(self, deadline_s: float) -> Mapping[str, Applied]:
        machine = self.machine
        unanswered = machine.unanswered > 0
        machine.unanswered -= unanswered
        if not machine.there or unanswered:
            return {"Z_um": Applied(self._requested, None)}
        return {"Z_um": Applied(self._requested, machine.accepted_um, machine.effective_um)}

    async def close(self) -> None: ...


class Memory:
    """A state file that no disk holds up."""

    def __init__(self) -> None:
        self.saved: SavedState | None = None
        self.failure: Message | None = None

    def save(self, saved: SavedState, _: Compensation) -> bool:
        self.saved = saved
        return True

    def load(self, _: Compensation) -> tuple[SavedState | None, Message | None]:
        return self.saved, Message("why-no_file")


class Rig:
    """Loops beside one machine."""

    def __init__(self, machine_compensation: Compensation | None = None, **rules: float) -> None:
        self.compensation = machine_compensation or compensation(**rules)
        self.machine = RoughMachine()
        self.historian = SimulatedHistorian()
        self.clock = VirtualClock()
        self.file = Memory()
        self.self_test: Callable[[], Coroutine[Any, Any, tuple[str, ...]]] | None = None

    def loop(self, **settings: Any) -> CompensationLoop:
        return CompensationLoop(
            self.compensation,
            LoopSettings(
                machine="lathe",
                model_file="m.json",
                model_sha256="00",
                other_active=True,
                reads_diameter=True,
                **settings,
            ),
            Ports(RoughSource(self.machine), RoughSink(self.machine), self.historian, self.clock),
            state_file=cast("StateFile", self.file),
            models=self.models,
            self_test=self.self_test,
        )

    def models(self, name: str) -> tuple[Compensation, str]:
        """Return a model of the folder, as the configuration would."""
        if name == "outside.json":
            raise ConfigurationError("file_outside_folder", place=Place(name))
        model = compensation(gain=-1.0).model
        if name == "other-output.json":
            model = replace(model, outputs=(replace(model.outputs[0], name="X_um"),))
            return replace(self.compensation, model=model, limits={"X_um": LIMITS}), "22"
        return replace(self.compensation, model=model), "11"

    def play(
        self,
        script: Callable[["Rig", CompensationLoop], Coroutine[Any, Any, None]],
        **settings: Any,
    ) -> CompensationLoop:
        async def both() -> CompensationLoop:
            loop, stop = self.loop(**settings), asyncio.Event()
            async with asyncio.TaskGroup() as group:
                group.create_task(loop.run(stop))
                await script(self, loop)
                stop.set()
            return loop

        return run_in_virtual_time(both())

    def said(self, kind: str) -> list[EventRecord]:
        return [event for event in self.historian.events if event.kind == kind]

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


async def ask(loop: CompensationLoop, kind: RequestKind, **fields: Any) -> bool:
    return (await loop.submit(Request(kind, "Jana", **fields))).accepted


# ---- time ---------------------------------------------------------------------------------------


def test_cycles_that_are_missed_are_counted_and_cost_no_step() -> None:
    bench = Rig()

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(20.0)
        freeze(7.3)
        await asyncio.sleep(10.0)
        assert state_of(loop) is SupervisorState.ACTIVE

    loop = bench.play(script)
    grid = round(bench.historian.records[-1].monotonic_s - bench.historian.records[0].monotonic_s)
    assert loop.status is not None
    assert loop.status.overruns == grid + 1 - len(bench.historian.records) > 4
    late = [record.lateness_s for record in bench.historian.records]
    assert max(late) == pytest.approx(7.3, abs=1.0)
    begun = [r.monotonic_s for r in bench.historian.records if r.lateness_s == 0.0]
    assert all(b - a == pytest.approx(round(b - a)) for a, b in pairwise(begun))  # still in step
    bench.assert_law()


@pytest.mark.parametrize("frozen_s", [1.6, 2.9, 5.0, 60.0, 3000.0])
@pytest.mark.parametrize("cycle_s", [0.1, 1.0])
def test_a_loop_that_was_frozen_goes_on_from_where_the_watchdog_left_the_offset(
    frozen_s: float, cycle_s: float
) -> None:
    bench = Rig(cycle_s=cycle_s)
    bench.machine.watched = True

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(60.0)
        assert bench.machine.effective_um < -20.0
        bench.machine.freezes_s = frozen_s  # in the midst of a cycle
        await asyncio.sleep(frozen_s + 8.0)
        assert state_of(loop) is SupervisorState.ACTIVE
        freeze(frozen_s)  # between two
        await asyncio.sleep(90.0)
        assert state_of(loop) is SupervisorState.ACTIVE
        assert bench.machine.effective_um == pytest.approx(-36.0, abs=0.01)

    bench.play(script)
    bench.assert_law()
    assert SupervisorState.FAULT not in {r.output.state for r in bench.historian.records}


@pytest.mark.parametrize("looks", [1, 2, 10, 60])
@pytest.mark.parametrize("watched", [False, True])
def test_looks_without_an_answer_after_a_silence_are_repeated_until_there_is_one(
    looks: int, watched: bool
) -> None:
    bench = Rig()
    bench.machine.watched = watched

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(60.0)
        freeze(3.0)
        bench.machine.unanswered = looks
        told: set[str] = set()
        while bench.machine.unanswered:
            await asyncio.sleep(0.5)
            assert loop.status is not None
            told |= {alarm.code for alarm in loop.status.alarms}
        assert ("offset_unread" in told) is (looks > UNREAD_AFTER_S)
        await asyncio.sleep(120.0)
        assert state_of(loop) is SupervisorState.ACTIVE
        assert bench.machine.effective_um == pytest.approx(-36.0, abs=0.01)
        assert loop.status is not None
        assert "offset_unread" not in {alarm.code for alarm in loop.status.alarms}
        states = {record.output.state for record in bench.historian.records}
        assert SupervisorState.FAULT not in states
        assert (SupervisorState.FADING in states) is (looks > 20)  # longer than it is held

    bench.play(script)
    bench.assert_law()


def test_what_is_no_offset_is_looked_at_until_somebody_has_mended_it() -> None:
    bench = Rig()
    bench.machine.accepted_um = bench.machine.acting_um = 2e5

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await asyncio.sleep(30.0)
        assert bench.machine.writes == []
        assert loop.status is not None
        assert "offset_unread" in {alarm.code for alarm in loop.status.alarms}
        bench.machine.set_offset(-3.0)
        await asyncio.sleep(3.0)
        assert "offset_unread" not in {alarm.code for alarm in loop.status.alarms}
        assert await ask(loop, RequestKind.ACKNOWLEDGE)
        assert await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(60.0)
        assert state_of(loop) is SupervisorState.ACTIVE

    bench.play(script)
    bench.assert_law()
    said = [event.text for event in bench.said("alarm") if "is no offset" in event.text]
    assert len(said) == 1


def test_a_computer_that_slept_is_noticed_by_the_time_of_day() -> None:
    bench = Rig()
    bench.machine.watched = True

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(60.0)
        bench.clock.change_time_of_day(by_s=3600.0)  # while the monotonic clock stood still
        bench.machine.acting_um = 0.0
        await asyncio.sleep(10.0)

    bench.play(script)
    bench.assert_law()


def test_a_freeze_between_the_look_and_the_write_writes_nothing() -> None:
    bench = Rig()
    bench.machine.watched = True

    class Freezing(RoughSink):
        frozen = 0

        async def read_back(self, deadline_s: float) -> Mapping[str, Applied]:
            found = await super().read_back(deadline_s)
            if self.machine.freezes_s:
                self.machine.freezes_s, frozen_s = 0.0, self.machine.freezes_s
                freeze(frozen_s)
                self.frozen += 1
            return found

    class Calm(RoughSource):
        async def read(self, deadline_s: float) -> Mapping[str, SourceSample]:
            self.machine.freezes_s, frozen_s = 0.0, self.machine.freezes_s
            found = await super().read(deadline_s)
            self.machine.freezes_s = frozen_s
            return found

    async def life() -> None:
        loop, stop = bench.loop(), asyncio.Event()
        sink = loop.sink = Freezing(bench.machine)
        loop.source = Calm(bench.machine)
        async with asyncio.TaskGroup() as group:
            group.create_task(loop.run(stop))
            await ask(loop, RequestKind.ENABLE)
            await asyncio.sleep(60.0)
            assert bench.machine.effective_um < -20.0
            bench.machine.freezes_s = 10.0
            freeze(2.0)  # so that it looks, and what it sees grows old before it writes
            await asyncio.sleep(30.0)
            assert sink.frozen == 1
            assert state_of(loop) is SupervisorState.ACTIVE
            stop.set()

    run_in_virtual_time(life())
    bench.assert_law()


@pytest.mark.parametrize("left_s", [0.05, 0.15, 0.25, 0.35])
def test_an_offset_that_the_watchdog_takes_back_during_the_self_test_is_looked_at_again(
    left_s: float,
) -> None:
    bench = Rig(cycle_s=0.1)
    bench.machine.watched = True

    async def self_test() -> tuple[str, ...]:
        await asyncio.sleep(0.3)
        return ()

    bench.self_test = self_test

    async def life() -> None:
        bench.machine.set_offset(-20.0)  # left by a loop that was killed
        bench.machine.heard_s += left_s - WATCHDOG_S
        loop = bench.loop()
        running = asyncio.ensure_future(loop.run(asyncio.Event(), cycles=30))
        await loop.submit(Request(RequestKind.ENABLE, "Jana"))
        await running

    run_in_virtual_time(life())
    assert bench.machine.writes
    bench.assert_law()


def test_a_source_that_hangs_up_to_its_deadline_is_held_for_and_the_loop_keeps_its_pace() -> None:
    bench = Rig(hold_input_s=10.0)
    bench.machine.watched = True

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(60.0)
        bench.machine.source_late_s = math.inf
        await asyncio.sleep(8.0)
        assert state_of(loop) is SupervisorState.HOLDING
        await asyncio.sleep(10.0)
        assert state_of(loop) is SupervisorState.FADING
        assert loop.status is not None
        assert loop.status.overruns == 0
        bench.machine.source_late_s = 0.0
        await asyncio.sleep(5.0)
        assert state_of(loop) is SupervisorState.ACTIVE

    bench.play(script)
    bench.assert_law()
    # the heartbeat never rests: a machine with a watchdog keeps its offset meanwhile
    assert max(b.at_s - a.at_s for a, b in pairwise(bench.machine.writes)) < WATCHDOG_S


# ---- the machine --------------------------------------------------------------------------------


@pytest.mark.parametrize("watched", [False, True])
def test_a_sink_that_refuses_writes_becomes_a_fault_and_no_step_when_it_takes_them_again(
    watched: bool,
) -> None:
    bench = Rig()
    bench.machine.watched = watched

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(40.0)
        bench.machine.refuses = True
        await asyncio.sleep(30.0)
        assert state_of(loop) is SupervisorState.FAULT
        assert loop.status is not None
        assert loop.status.output.reasons == (Reason.READ_BACK_DIFFERS,)
        assert not await ask(loop, RequestKind.ACKNOWLEDGE)
        bench.machine.refuses = False
        await asyncio.sleep(5.0)
        assert await ask(loop, RequestKind.ACKNOWLEDGE)
        await asyncio.sleep(120.0)
        assert bench.machine.effective_um == 0.0
        assert await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(30.0)
        assert state_of(loop) is SupervisorState.ACTIVE

    bench.play(script)
    bench.assert_law(tolerance_um=TOLERANCE_UM)


def test_a_short_refusal_beside_a_watchdog_costs_no_step() -> None:
    bench = Rig()
    bench.machine.watched = True

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(100.0)
        assert bench.machine.effective_um == pytest.approx(-36.0, abs=0.1)
        bench.machine.refuses = True
        await asyncio.sleep(WATCHDOG_S + 3.0)
        assert bench.machine.effective_um == 0.0
        bench.machine.refuses = False
        await asyncio.sleep(20.0)
        assert state_of(loop) is SupervisorState.ACTIVE

    bench.play(script)
    bench.assert_law(tolerance_um=TOLERANCE_UM)


def test_a_machine_that_takes_offsets_over_after_its_answer_is_moved_as_fast_as_allowed() -> None:
    class Slow(RoughMachine):
        def take(self, correction_um: float) -> None:
            loop = asyncio.get_running_loop()
            loop.call_later(0.2, super().take, correction_um)

    bench = Rig()
    bench.machine = Slow()
    bench.compensation = replace(
        bench.compensation, limits={"Z_um": Limits(LARGEST, 2.0)}
    )  # more in a cycle than the read-back may differ

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(6.0)
        begun_um = bench.machine.effective_um
        await asyncio.sleep(10.0)
        assert bench.machine.effective_um - begun_um == pytest.approx(-20.0, abs=0.01)

    bench.play(script)


@pytest.mark.parametrize("beyond_um", [1e-9, 0.4, 0.6])
def test_an_offset_found_at_the_limit_is_no_fault_for_a_rounding(beyond_um: float) -> None:
    bench = Rig()

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        bench.machine.set_offset(-LARGEST - beyond_um)
        await asyncio.sleep(2.0)
        accepted = await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(8.0)
        assert accepted is (beyond_um <= TOLERANCE_UM)
        wanted = SupervisorState.ACTIVE if accepted else SupervisorState.OFF
        assert state_of(loop) is wanted

    async def first(bench: Rig) -> None:
        loop, stop = bench.loop(), asyncio.Event()
        bench.machine.set_offset(-LARGEST - beyond_um)
        async with asyncio.TaskGroup() as group:
            group.create_task(loop.run(stop))
            await script(bench, loop)
            stop.set()

    run_in_virtual_time(first(bench))
    assert all(abs(w.after_um - w.before_um) <= RATE + beyond_um for w in bench.machine.writes)


def test_the_diameter_that_the_machine_states_is_taken_over_and_recorded() -> None:
    bench = Rig()

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        bench.machine.values[DIAMETER] = 1500.0
        await asyncio.sleep(3.0)
        assert loop.status is not None
        assert loop.status.diameter_mm == 1500.0
        assert await ask(loop, RequestKind.DIAMETER, value=800.0)
        await asyncio.sleep(3.0)
        assert loop.status.diameter_mm == 800.0  # a person's word stands until the machine's moves
        bench.machine.values[DIAMETER] = None
        await asyncio.sleep(3.0)
        bench.machine.values[DIAMETER] = -1.0
        await asyncio.sleep(3.0)
        assert loop.status.diameter_mm == 800.0

    bench.play(script)
    told = [(e.who, e.details["value"], e.details["accepted"]) for e in bench.said("request")]
    assert told[:-1] == [
        ("the machine", 1500.0, True),
        ("Jana", 800.0, True),
        ("the machine", -1.0, False),
    ]


# ---- people -------------------------------------------------------------------------------------


def test_another_model_takes_over_without_a_bump_and_a_wrong_one_is_refused() -> None:
    bench = Rig()

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(100.0)
        for name in ("outside.json", "other-output.json"):
            answer = await loop.submit(Request(RequestKind.MODEL, "Jana", text=name))
            assert not answer.accepted
            assert loop.status is not None
            assert loop.status.model_file == "m.json"
        assert state_of(loop) is SupervisorState.ACTIVE
        before = len(bench.machine.writes)
        assert await ask(loop, RequestKind.MODEL, text="new.json")
        await asyncio.sleep(3.0)
        assert state_of(loop) is SupervisorState.HOLDING
        assert {w.after_um for w in bench.machine.writes[before:-1]} == {
            bench.machine.writes[before].after_um
        }
        await asyncio.sleep(100.0)
        assert (loop.status.model_file, loop.status.model_sha256) == ("new.json", "11")
        assert bench.machine.effective_um == pytest.approx(-27.0, abs=0.01)

    bench.play(script)
    bench.assert_law(late_cycles=1.0)
    told = [(e.who, e.details["text"], e.details["accepted"]) for e in bench.said("request")]
    assert told[1:4] == [
        ("Jana", "outside.json", False),
        ("Jana", "other-output.json", False),
        ("Jana", "new.json", True),
    ]
    assert "the model gives X; the machine needs Z" in bench.said("request")[2].text


def test_a_trim_is_added_at_the_rate_and_expires_by_itself() -> None:
    bench = Rig()

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(100.0)
        assert not await ask(loop, RequestKind.TRIM, output="Z_um", value=5.1, duration_s=60.0)
        assert not await ask(loop, RequestKind.TRIM, output="Z_um", value=1.0)
        assert not await ask(loop, RequestKind.TRIM, output="Q_um", value=1.0, duration_s=60.0)
        assert await ask(loop, RequestKind.TRIM, output="Z_um", value=4.0, duration_s=60.0)
        await asyncio.sleep(30.0)
        assert bench.machine.effective_um == pytest.approx(-32.0, abs=0.01)
        assert loop.status is not None
        assert loop.status.trim_owner == {"Z_um": "Jana"}
        assert loop.status.trim_left_s["Z_um"] == pytest.approx(30.0, abs=2.0)
        await asyncio.sleep(45.0)
        assert bench.machine.effective_um == pytest.approx(-36.0, abs=0.01)
        assert loop.status.trim_owner == {"Z_um": ""}

    bench.play(script)
    bench.assert_law(late_cycles=1.0)


def test_nothing_is_taken_while_the_loop_ends_and_nobody_waits_for_ever() -> None:
    bench = Rig()
    answers: list[object] = []

    async def life() -> None:
        loop, stop = bench.loop(), asyncio.Event()
        running = asyncio.ensure_future(loop.run(stop))
        await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(60.0)
        stop.set()
        await asyncio.sleep(3.0)
        assert state_of(loop) is SupervisorState.FADING
        for kind in RequestKind:
            answer = await loop.submit(Request(kind, "Jana", text="new.json"))
            assert not answer.accepted
            answers.append(answer.code)
        await running
        answer = await loop.submit(Request(RequestKind.ENABLE, "Jana"))
        assert not answer.accepted
        answers.append(answer.code)

    run_in_virtual_time(life())
    assert set(answers) == {LoopAnswer.ENDING}
    assert bench.machine.acting_um == 0.0
    bench.assert_law(late_cycles=1.0)


def test_a_model_that_is_still_read_when_the_loop_ends_is_refused() -> None:
    bench = Rig()

    async def life() -> None:
        loop, stop = bench.loop(), asyncio.Event()
        running = asyncio.ensure_future(loop.run(stop, cycles=3))
        asked = asyncio.ensure_future(
            loop.submit(Request(RequestKind.MODEL, "Jana", text="new.json"))
        )
        loop._ended = True
        # as it is when the loop ends while a thread reads the file
        answer = await asked
        assert not answer.accepted
        await running

    run_in_virtual_time(life())


def test_a_self_test_that_fails_forbids_until_it_passes() -> None:
    bench = Rig()
    finding = Message("self_test-output_not_writable", {}, Place(key="output.Z_um"))
    findings: list[tuple[Message, ...]] = [(finding,), (replace(finding, values={"n": 2}),), ()]
    tested_s: list[float] = []

    async def self_test() -> tuple[Message, ...]:
        tested_s.append(asyncio.get_running_loop().time())
        await asyncio.sleep(0.3)
        return findings[min(len(tested_s), len(findings)) - 1]

    bench.self_test = self_test

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        assert await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(TESTED_EVERY_S + 3.0)
        assert state_of(loop) is SupervisorState.WARMING
        assert {w.after_um for w in bench.machine.writes} <= {0.0}
        assert loop.status is not None
        assert "self_test" in [alarm.code for alarm in loop.status.alarms]
        await asyncio.sleep(TESTED_EVERY_S + 8.0)
        assert state_of(loop) is SupervisorState.ACTIVE

    bench.play(script)
    assert len(tested_s) == 3
    assert min(b - a for a, b in pairwise(tested_s)) >= TESTED_EVERY_S
    alarms = [e.values for e in bench.said("alarm") if e.code == "event-self_test"]
    assert alarms == [{"finding": finding}]
    assert "event-self_test_passed" in [e.code for e in bench.said("start")]
    bench.assert_law()


def test_everything_that_happens_is_recorded_with_who_and_when() -> None:
    bench = Rig()

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(30.0)
        await ask(loop, RequestKind.HOLD)
        await asyncio.sleep(5.0)
        await ask(loop, RequestKind.RESUME)
        await asyncio.sleep(5.0)
        bench.machine.lose()
        await asyncio.sleep(5.0)
        bench.machine.come_back()
        await asyncio.sleep(10.0)
        bench.machine.values["interlock.referenced"] = 0.0
        await asyncio.sleep(10.0)
        bench.machine.values["interlock.referenced"] = 1.0
        await asyncio.sleep(10.0)
        bench.machine.values[OTHER_COMPENSATION] = 1.0
        await asyncio.sleep(10.0)
        bench.machine.values[OTHER_COMPENSATION] = 0.0
        await asyncio.sleep(1.0)
        await ask(loop, RequestKind.ACKNOWLEDGE)
        await asyncio.sleep(90.0)

    bench.play(script)
    events = bench.historian.events
    states = [(e.values["state"], e.values.get("reasons", ())) for e in bench.said("state")]
    assert states == [
        ("Warming", (Reason.SETTLING,)),
        ("Active", ()),
        ("Holding", (Reason.OPERATOR_HOLD,)),
        ("Active", ()),
        ("Holding", (Reason.CONNECTION_LOST,)),
        ("Active", ()),
        ("Fading", (Reason.INTERLOCK_OPEN,)),
        ("Active", ()),
        ("Fault", (Reason.DOUBLE_COMPENSATION,)),
        ("Fading", (Reason.DISABLED,)),
        ("Off", (Reason.DISABLED,)),
    ]
    assert [e.code for e in bench.said("connection")] == [
        "event-source_lost",
        "event-sink_lost",
        "event-source_connected",
        "event-sink_connected",
    ]
    asked = [(e.who, e.details["kind"]) for e in bench.said("request")]
    assert asked[:4] == [
        ("Jana", "enable"),
        ("Jana", "hold"),
        ("Jana", "resume"),
        ("Jana", "acknowledge"),
    ]
    alarms = [e.text for e in bench.said("alarm")]
    for words in ("cannot be written to", "cannot be read", "another compensation"):
        came = [k for k, text in enumerate(alarms) if words in text.lower()]
        assert came, (words, alarms)
        gone = [k for k in came if alarms[k].startswith("gone: ")]
        assert gone, (words, alarms)
        assert came[0] < gone[-1]
    assert events[-1].kind == "stop"
    assert [e.utc for e in events] == sorted(e.utc for e in events)
    assert all(e.utc.tzinfo is not None for e in events)
    numbers = [r.number for r in bench.historian.records]
    assert numbers == list(range(1, len(numbers) + 1))


# ---- hours of everything ------------------------------------------------------------------------


class Chaos:
    """Hours in which everything goes wrong, one after the other and at once."""

    def __init__(self, seed: int, cycle_s: float) -> None:
        self.chance = random.Random(seed)  # noqa: S311 - repeatable
        self.bench = Rig(cycle_s=cycle_s, hold_input_s=30.0, at_limit_s=120.0)
        self.bench.machine.watched = bool(seed % 2)
        self.loop = self.bench.loop()
        self.running: asyncio.Future[Any] = asyncio.ensure_future(self.loop.run(asyncio.Event()))
        self.happened: dict[str, int] = {}

    async def live(self, hours: float) -> None:
        end_s = asyncio.get_running_loop().time() + 3600.0 * hours
        names = [name for name in dir(self) if name.startswith("on_")]
        while asyncio.get_running_loop().time() < end_s:
            await asyncio.sleep(self.chance.expovariate(1.0 / 15.0))
            name = self.chance.choice(names)
            self.happened[name] = self.happened.get(name, 0) + 1
            await getattr(self, name)()
            if self.chance.random() < 0.5:
                self.calm()
            assert not self.running.done(), self.running
        self.running.cancel()
        await asyncio.gather(self.running, return_exceptions=True)

    def calm(self) -> None:
        machine = self.bench.machine
        machine.refuses = machine.deaf = False
        machine.source_late_s = machine.write_late_s = 0.0
        machine.values.update({"s": self.chance.uniform(15.0, 26.0), "c": 20.0, **FLAGS})
        if not machine.there:
            machine.come_back(self.chance.choice((None, 0.0, self.chance.uniform(-50.0, 50.0))))

    async def ask(self, kind: RequestKind, **fields: Any) -> None:
        asked = asyncio.ensure_future(self.loop.submit(Request(kind, "Jana", **fields)))
        await asyncio.wait({asked}, timeout=10.0)
        asked.cancel()

    async def on_temperature(self) -> None:
        self.bench.machine.values["s"] = self.chance.uniform(15.0, 32.0)
        await self.ask(RequestKind.ACKNOWLEDGE)

    async def on_bad_value(self) -> None:
        bad = (None, math.nan, math.inf, 0.0, 1e300)
        self.bench.machine.values[self.chance.choice(("s", "c"))] = self.chance.choice(bad)

    async def on_interlock(self) -> None:
        self.bench.machine.values["interlock.referenced"] = self.chance.choice((0.0, None))

    async def on_other_compensation(self) -> None:
        self.bench.machine.values[OTHER_COMPENSATION] = self.chance.choice((1.0, None))

    async def on_lost(self) -> None:
        self.bench.machine.lose()

    async def on_flicker(self) -> None:
        for _ in range(5):
            self.bench.machine.lose()
            await asyncio.sleep(self.chance.uniform(0.0, 1.0))
            self.bench.machine.come_back()
            await asyncio.sleep(self.chance.uniform(0.0, 1.0))

    async def on_refused(self) -> None:
        self.bench.machine.refuses = True

    async def on_deaf(self) -> None:
        self.bench.machine.deaf = True

    async def on_late(self) -> None:
        self.bench.machine.source_late_s = self.chance.choice((0.1, 0.4, math.inf))
        self.bench.machine.write_late_s = self.chance.choice((0.0, 0.1, 0.4))

    async def on_frozen(self) -> None:
        freeze(self.chance.choice((0.5, 1.2, 2.0, 5.0, 100.0)))

    async def on_frozen_within(self) -> None:
        self.bench.machine.freezes_s = self.chance.choice((0.5, 1.2, 2.0, 5.0, 100.0))

    async def on_clock(self) -> None:
        self.bench.clock.change_time_of_day(by_s=self.chance.uniform(-100.0, 100.0))

    async def on_people(self) -> None:
        kinds = [kind for kind in RequestKind if kind is not RequestKind.MODEL]
        await self.ask(
            self.chance.choice(kinds),
            output="Z_um",
            value=self.chance.uniform(-6.0, 6.0),
            duration_s=self.chance.uniform(0.0, 100.0),
        )

    async def on_enabled(self) -> None:
        self.calm()
        await self.ask(RequestKind.ACKNOWLEDGE)
        await self.ask(RequestKind.ENABLE)
        await asyncio.sleep(self.chance.uniform(0.0, 120.0))

    on_enabled_again = on_enabled

    async def on_model(self) -> None:
        await self.ask(RequestKind.MODEL, text=self.chance.choice(("a", "outside.json")))

    async def on_killed(self) -> None:
        kept = self.bench.file.saved
        self.running.cancel()
        await asyncio.gather(self.running, return_exceptions=True)
        self.bench.file.saved = kept
        await asyncio.sleep(self.chance.choice((0.5, 2.0, 10.0)))
        self.bench.machine.generation += 1
        self.loop = self.bench.loop()
        self.running = asyncio.ensure_future(self.loop.run(asyncio.Event()))


@pytest.mark.parametrize("seed", range(6))
def test_hours_of_faults_move_the_tool_never_faster_and_never_further_than_allowed(
    seed: int,
) -> None:
    async def life() -> Chaos:
        chaos = Chaos(seed, cycle_s=0.25 if seed % 3 == 2 else 1.0)
        await chaos.live(hours=1.5)
        return chaos

    chaos = run_in_virtual_time(life())
    bench = chaos.bench
    for write in bench.machine.writes:
        inward = abs(write.after_um) <= abs(write.before_um)
        assert inward or abs(write.after_um) <= LARGEST + ROUNDED_UM, write
    bench.assert_law(tolerance_um=TOLERANCE_UM)
    states = {record.output.state for record in bench.historian.records}
    assert states == set(SupervisorState)
    assert len(chaos.happened) > 14
    travelled_um = sum(abs(w.after_um - w.before_um) for w in bench.machine.writes)
    assert travelled_um > 200.0


def test_at_the_end_an_offset_may_be_left_where_it_is() -> None:
    bench = Rig()

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(60.0)

    bench.play(script, at_stop=AtStop.LEAVE)
    assert bench.machine.writes[-1].after_um < -20.0
    assert bench.file.saved is not None
    assert bench.file.saved.enabled
