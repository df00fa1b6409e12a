"""The loop with the LinuxCNC sink beside a HAL in memory: what freezes and goes, heals itself."""

import asyncio
from collections.abc import Awaitable, Callable
from itertools import pairwise

import pytest

from tests.unit.runtime.linuxcnc_hal import PERIOD_S, MemoryHal, freeze
from tests.unit.runtime.simulated import SimulatedHistorian, SimulatedMachine, SimulatedSource
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
    TOWARDS,
    CompensationLoop,
    LoopSettings,
    Ports,
    VirtualClock,
    run_in_virtual_time,
)
from thermaxis.runtime.sinks import LinuxCncOutput, LinuxCncSettings, LinuxCncSink, hal_text

GAIN_UM_PER_K, RISE_K = 10.0, 3.0
LIMITS = Limits(60.0, 2.0)
SETTINGS = LinuxCncSettings(outputs={"Z_um": LinuxCncOutput(2, "mm", TOWARDS, LIMITS)})
FREEZES = (
    "",
    "gets thermaxis-ok",
    "gets thermaxis-request-2",
    "gets thermaxis-heartbeat",
    "getp thermaxis-limit-2.min",
)
"""Where the loop may be when it is frozen: asleep, or in the midst of a write or a read."""
OFFSET_MM = 1e-3 * GAIN_UM_PER_K * RISE_K
"""Minus the model, and towards the workpiece: plus once more."""


class Rig:
    """A loop, a HAL, and every offset that stood in it."""

    def __init__(self) -> None:
        self.hal = MemoryHal(hal_text(SETTINGS))
        self.offsets: list[float] = []
        update = self.hal.behaviour["thermaxis-shift-2.update-output"]

        def record() -> None:
            update()
            self.offsets.append(self.hal.pin("thermaxis-shift-2.offset"))

        self.hal.behaviour["thermaxis-shift-2.update-output"] = record

    def build(self) -> None:
        machine = SimulatedMachine({"s": 20.0 + RISE_K, "c": 20.0}, ("Z_um",))
        part = Part("spindle", "s", "c", GAIN_UM_PER_K, (Section(0.0, 300.0),))
        model = CompensationModel(
            outputs=(Output("Z_um", (part,)),),
            reference="stated",
            reference_c={"s": 20.0, "c": 20.0},
        )
        clock = VirtualClock()
        self.sink = LinuxCncSink(SETTINGS, clock, self.hal.attach)
        self.loop = CompensationLoop(
            Compensation(
                model=model,
                sensors={n: SensorRules(lowest_c=1.0, highest_c=90.0) for n in ("s", "c")},
                limits={"Z_um": LIMITS},
                supervisor=SupervisorRules(settle_s=5.0, read_back_s=3.0),
            ),
            LoopSettings(machine="mill", model_file="m.json", model_sha256="0"),
            Ports(SimulatedSource(machine), self.sink, SimulatedHistorian(), clock),
        )

    def play(self, script: Callable[["Rig"], Awaitable[None]]) -> None:
        async def both() -> None:
            self.build()
            stop = asyncio.Event()
            async with asyncio.TaskGroup() as group:
                group.create_task(self.loop.run(stop))
                answer = await self.loop.submit(Request(RequestKind.ENABLE, "Jana"))
                assert answer.accepted
                await script(self)
                stop.set()

        run_in_virtual_time(both())

    @property
    def state(self) -> SupervisorState:
        assert self.loop.status is not None
        return self.loop.status.output.state

    @property
    def offset_mm(self) -> float:
        return self.hal.pin("thermaxis-shift-2.offset")


async def later(hal: MemoryHal) -> None:
    """Let the machine alone for a minute."""
    now_s = asyncio.get_running_loop().time()
    hal.run_until(now_s)
    hal.run_until(now_s + 60.0)


def largest_step(offsets: list[float]) -> float:
    return max(abs(b - a) for a, b in pairwise([0.0, *offsets]))


def test_the_loop_takes_the_machine_to_its_goal_and_back_at_the_end() -> None:
    bench = Rig()

    async def script(bench: Rig) -> None:
        await asyncio.sleep(40.0)
        assert bench.state is SupervisorState.ACTIVE
        assert bench.offset_mm == pytest.approx(OFFSET_MM, rel=1e-6)

    bench.play(script)
    assert bench.offset_mm <= 1.001e-3 * LIMITS.largest_rate_um_per_s  # one cycle behind
    run_in_virtual_time(later(bench.hal))
    assert bench.offset_mm == 0.0
    rate_mm_per_s = 1e-3 * LIMITS.largest_rate_um_per_s
    assert largest_step(bench.offsets) == pytest.approx(rate_mm_per_s * PERIOD_S, rel=1e-6)


def test_a_ramp_that_the_machine_follows_behind_is_no_difference_of_the_read_back() -> None:
    bench = Rig()
    states: set[SupervisorState] = set()

    async def script(bench: Rig) -> None:
        bench.loop.listeners.append(lambda status: states.add(status.output.state))
        await asyncio.sleep(40.0)

    bench.play(script)
    assert SupervisorState.FAULT not in states


def test_a_loop_that_was_frozen_heals_by_itself_without_a_step() -> None:
    bench = Rig()

    async def script(bench: Rig) -> None:
        await asyncio.sleep(40.0)
        for command in FREEZES:
            begin = len(bench.offsets)
            if command:
                bench.hal.freezes[command] = 10.0
            else:
                freeze(10.0)
            await asyncio.sleep(30.0)
            assert bench.hal.freezes == {}
            assert min(bench.offsets[begin:]) < 0.6 * OFFSET_MM  # eight seconds on its way to zero
            assert bench.state is SupervisorState.ACTIVE
            assert bench.offset_mm == pytest.approx(OFFSET_MM, rel=1e-6)

    bench.play(script)
    assert largest_step(bench.offsets) <= 1.000001e-3 * LIMITS.largest_rate_um_per_s * PERIOD_S


def test_a_machine_that_goes_is_held_for_and_gone_on_with_from_what_is_found() -> None:
    bench = Rig()

    async def script(bench: Rig) -> None:
        await asyncio.sleep(40.0)
        bench.hal.running = False
        await asyncio.sleep(5.0)
        assert bench.loop.status is not None
        assert bench.loop.status.output.reasons == (Reason.CONNECTION_LOST,)
        bench.hal.put("thermaxis-limit-2.out", 0.0)  # started anew
        bench.hal.put("thermaxis-arm", 0.0)
        bench.offsets.clear()
        bench.hal.running = True
        await asyncio.sleep(1.6)
        assert bench.offset_mm < 0.2 * OFFSET_MM
        await asyncio.sleep(40.0)
        assert bench.state is SupervisorState.ACTIVE
        assert bench.offset_mm == pytest.approx(OFFSET_MM, rel=1e-6)

    bench.play(script)
    assert largest_step(bench.offsets) <= 1.000001e-3 * LIMITS.largest_rate_um_per_s * PERIOD_S


def test_a_clamp_that_is_narrower_than_the_configuration_becomes_a_fault() -> None:
    bench = Rig()
    bench.hal.values["thermaxis-limit-2.max"] = 0.010

    async def script(bench: Rig) -> None:
        await asyncio.sleep(40.0)
        assert bench.state is SupervisorState.FAULT
        assert bench.loop.status is not None
        assert Reason.READ_BACK_DIFFERS in bench.loop.status.output.reasons

    bench.play(script)
    assert max(bench.offsets) <= 0.010 + 1e-12


def test_a_cycle_longer_than_the_watchdog_s_default_gets_a_longer_one() -> None:
    slow = LinuxCncSettings(outputs=SETTINGS.outputs, cycle_s=30.0)
    hal = MemoryHal(hal_text(slow))

    async def life() -> None:
        sink = LinuxCncSink(slow, VirtualClock(), hal.attach)
        await sink.open()
        await asyncio.sleep(1.0)
        assert await sink.found(1.0) is not None
        for _ in range(3):
            assert await sink.write({"Z_um": -5.0}, 1.0)
            await asyncio.sleep(30.0)
        await sink.close()

    run_in_virtual_time(life())
    assert hal.pin("thermaxis-shift-2.offset") == pytest.approx(0.005)
