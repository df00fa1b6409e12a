"""The loop in virtual time: what it writes, what it survives, what it remembers."""

import asyncio
from collections.abc import Callable, Coroutine
from datetime import timedelta
from itertools import pairwise
from pathlib import Path
from typing import Any

from tests.unit.runtime.simulated import (
    SimulatedHistorian,
    SimulatedMachine,
    SimulatedSink,
    SimulatedSource,
)
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
from thermaxis.runtime import (
    AtStop,
    CompensationLoop,
    LoopSettings,
    Ports,
    StateFile,
    VirtualClock,
    run_in_virtual_time,
)
from thermaxis.runtime._virtual_time import START_UTC

RATE = 0.5
LARGEST = 60.0


def compensation(**rules: float) -> Compensation:
    model = CompensationModel(
        outputs=(Output("Z_um", (Part("spindle", "s", "c", 2.0, (Section(10.0, 300.0),)),)),),
        reference="stated",
        reference_c={"s": 20.0, "c": 20.0},
    )
    return Compensation(
        model=model,
        sensors={n: SensorRules(lowest_c=1.0, highest_c=90.0) for n in ("s", "c")},
        limits={"Z_um": Limits(LARGEST, RATE)},
        supervisor=SupervisorRules(settle_s=5.0, hold_connection_s=20.0, **rules),
        interlocks=("referenced",),
    )


class Rig:
    """A loop beside a simulated machine."""

    def __init__(self, state_file: Path | None = None, **rules: float) -> None:
        self.machine = SimulatedMachine(
            {"s": 23.0, "c": 20.0, "interlock.referenced": 1.0}, ("Z_um",)
        )
        self.historian = SimulatedHistorian()
        self.clock = VirtualClock()
        self.state_file = state_file
        self.rules = rules

    def loop(self, **settings: Any) -> CompensationLoop:
        return CompensationLoop(
            compensation(**self.rules),
            LoopSettings(machine="lathe", model_file="m.json", model_sha256="0", **settings),
            Ports(
                SimulatedSource(self.machine),
                SimulatedSink(self.machine),
                self.historian,
                self.clock,
            ),
            state_file=None if self.state_file is None else StateFile(self.state_file),
        )

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

    def steps_um(self) -> list[float]:
        written = [0.0, *(w["Z_um"] for w in self.machine.written)]
        return [b - a for a, b in pairwise(written)]


async def enable(loop: CompensationLoop) -> None:
    answer = await loop.submit(Request(RequestKind.ENABLE, "Jana"))
    assert answer.accepted, answer.code


def test_the_offset_goes_to_minus_the_model_at_the_allowed_rate_and_back_at_the_end() -> None:
    bench = Rig()

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await enable(loop)
        await asyncio.sleep(200.0)
        assert loop.status is not None
        assert loop.status.output.state is SupervisorState.ACTIVE
        assert bench.machine.offset_um["Z_um"] == -36.0

    bench.play(script)
    assert bench.machine.offset_um["Z_um"] == 0.0
    assert max(map(abs, bench.steps_um())) <= RATE + 1e-9
    assert min(bench.steps_um()) == -RATE
    assert bench.historian.closed


def test_a_lost_machine_is_held_then_faded_and_comes_back_without_a_step() -> None:
    bench = Rig()
    seen: list[SupervisorState] = []

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        loop.listeners.append(lambda status: seen.append(status.output.state))
        await enable(loop)
        await asyncio.sleep(100.0)
        bench.machine.lose()
        await asyncio.sleep(10.0)
        assert seen[-1] is SupervisorState.HOLDING
        await asyncio.sleep(15.0)
        assert seen[-1] is SupervisorState.FADING
        bench.machine.come_back(offset_um=0.0)
        before = len(bench.machine.written)
        await asyncio.sleep(2.0)
        assert seen[-1] is SupervisorState.ACTIVE
        first = bench.machine.written[before]["Z_um"]
        assert abs(first) <= RATE + 1e-9
        await asyncio.sleep(100.0)
        assert bench.machine.offset_um["Z_um"] == -36.0

    bench.play(script)


def test_a_machine_that_does_not_obey_is_a_fault_until_it_is_acknowledged() -> None:
    bench = Rig()

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await enable(loop)
        await asyncio.sleep(60.0)
        bench.machine.obeys = False
        await asyncio.sleep(30.0)
        assert loop.status is not None
        assert loop.status.output.state is SupervisorState.FAULT
        assert loop.status.output.reasons == (Reason.READ_BACK_DIFFERS,)
        refused = await loop.submit(Request(RequestKind.ACKNOWLEDGE, "Jana"))
        assert not refused.accepted
        stuck_um = bench.machine.offset_um["Z_um"]
        most_um = RATE + SupervisorRules().read_back_tolerance_um
        assert abs(bench.machine.written[-1]["Z_um"] - stuck_um) <= most_um
        bench.machine.obeys = True
        await asyncio.sleep(0.5)
        assert abs(bench.machine.offset_um["Z_um"] - stuck_um) <= most_um
        await asyncio.sleep(5.0)
        answer = await loop.submit(Request(RequestKind.ACKNOWLEDGE, "Jana"))
        assert answer.accepted
        await asyncio.sleep(120.0)
        assert loop.status.output.state is SupervisorState.OFF
        assert bench.machine.offset_um["Z_um"] == 0.0

    bench.play(script)
    said = [e for e in bench.historian.events if e.kind == "request" and e.who == "Jana"]
    assert [e.details["accepted"] for e in said] == [True, False, True]


def test_after_a_kill_the_loop_goes_on_from_the_offset_in_the_machine(tmp_path: Path) -> None:
    bench = Rig(tmp_path / "state.json")

    async def killed() -> None:
        loop = bench.loop()
        task = asyncio.ensure_future(loop.run(asyncio.Event()))
        await enable(loop)
        await asyncio.sleep(80.0)
        loop._state_file = None  # a kill saves nothing any more
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    run_in_virtual_time(killed())
    before = bench.machine.offset_um["Z_um"]
    assert before < -30.0
    bench.machine.come_back()
    bench.machine.written.clear()
    bench.clock = VirtualClock(START_UTC + timedelta(seconds=100.0))

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await asyncio.sleep(20.0)
        assert loop.status is not None
        assert loop.status.output.state is SupervisorState.ACTIVE
        assert loop.status.enabled

    bench.play(script, at_stop=AtStop.LEAVE)
    written = [before, *(w["Z_um"] for w in bench.machine.written)]
    assert max(abs(b - a) for a, b in pairwise(written)) <= RATE + 1e-9


def test_a_loop_that_nobody_enabled_leaves_a_found_offset_alone() -> None:
    bench = Rig()
    bench.machine.offset_um["Z_um"] = -12.0

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await asyncio.sleep(30.0)
        assert not bench.machine.written
        assert loop.status is not None
        assert loop.status.output.correction_um == (-12.0,)
        await enable(loop)
        await asyncio.sleep(100.0)

    bench.play(script)
    written = [-12.0, *(w["Z_um"] for w in bench.machine.written)]
    assert max(abs(b - a) for a, b in pairwise(written)) <= RATE + 1e-9


def test_an_open_interlock_fades_at_once_and_heals() -> None:
    bench = Rig()

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await enable(loop)
        await asyncio.sleep(100.0)
        bench.machine.values["interlock.referenced"] = 0.0
        await asyncio.sleep(2.5)
        assert loop.status is not None
        assert loop.status.output.state is SupervisorState.FADING
        assert loop.status.output.reasons == (Reason.INTERLOCK_OPEN,)
        bench.machine.values["interlock.referenced"] = 1.0
        await asyncio.sleep(3.0)
        assert loop.status.output.state is SupervisorState.ACTIVE

    bench.play(script)


def test_a_loop_that_ends_after_some_cycles_fades_first_and_says_what_it_leaves() -> None:
    bench = Rig()

    async def play(within_s: float) -> dict[str, float]:
        loop = bench.loop(stop_within_s=within_s)
        running = asyncio.ensure_future(loop.run(asyncio.Event(), cycles=100))
        await enable(loop)
        return dict(await running)

    assert run_in_virtual_time(play(300.0)) == {"Z_um": 0.0}
    assert bench.machine.offset_um["Z_um"] == 0.0
    bench.machine.generation += 1
    standing = run_in_virtual_time(play(10.0))
    assert standing["Z_um"] == bench.machine.offset_um["Z_um"] < -20.0
    assert "left in the machine: Z_um -" in bench.historian.events[-1].text


def test_a_fault_survives_a_clock_that_was_set_back(tmp_path: Path) -> None:
    bench = Rig(tmp_path / "state.json")

    async def faulty(bench: Rig, loop: CompensationLoop) -> None:
        await enable(loop)
        await asyncio.sleep(60.0)
        bench.machine.obeys = False
        await asyncio.sleep(30.0)

    bench.play(faulty, at_stop=AtStop.LEAVE)
    bench.machine.obeys = True
    bench.machine.generation += 1
    bench.clock = VirtualClock(START_UTC - timedelta(days=1))

    async def again(bench: Rig, loop: CompensationLoop) -> None:
        await asyncio.sleep(5.0)
        assert loop.status is not None
        assert loop.status.output.state is SupervisorState.FAULT
        refused = await loop.submit(Request(RequestKind.ENABLE, "Jana"))
        assert not refused.accepted

    bench.play(again)


def test_an_offset_in_the_wrong_unit_is_never_written_over() -> None:
    bench = Rig()
    bench.machine.offset_um["Z_um"] = 1e7

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await asyncio.sleep(10.0)
        assert not bench.machine.written

    bench.play(script)
    assert any("is no offset" in e.text for e in bench.historian.events)


def test_an_equal_model_that_takes_over_changes_nothing(tmp_path: Path) -> None:
    bench = Rig()

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        loop._models = lambda _: (compensation(), "other")
        await enable(loop)
        for k in range(1500):  # the machine warms up all the time
            bench.machine.values["s"] = 20.0 + 0.002 * k
            await asyncio.sleep(1.0)
        assert loop.status is not None
        before = loop.status.output.model_um[0]
        assert before > 15.0
        answer = await loop.submit(Request(RequestKind.MODEL, "Petr", text="copy.json"))
        assert answer.accepted
        await asyncio.sleep(1.0)
        assert loop.status.model_file == "copy.json"
        assert abs(loop.status.output.model_um[0] - before) < 1.0  # the steady state is 36 um

    bench.play(script)


def test_a_fade_that_was_cut_short_by_a_kill_goes_on(tmp_path: Path) -> None:
    bench = Rig(tmp_path / "state.json")

    async def killed() -> None:
        loop = bench.loop()
        task = asyncio.ensure_future(loop.run(asyncio.Event()))
        await enable(loop)
        await asyncio.sleep(80.0)
        assert (await loop.submit(Request(RequestKind.DISABLE, "Jana"))).accepted
        await asyncio.sleep(10.0)
        loop._state_file = None  # a kill saves nothing any more
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    run_in_virtual_time(killed())
    assert bench.machine.offset_um["Z_um"] < -20.0
    bench.machine.come_back()
    bench.clock = VirtualClock(START_UTC + timedelta(seconds=110.0))

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await asyncio.sleep(100.0)
        assert loop.status is not None
        assert loop.status.output.state is SupervisorState.OFF

    bench.play(script, at_stop=AtStop.LEAVE)
    assert bench.machine.offset_um["Z_um"] == 0.0
