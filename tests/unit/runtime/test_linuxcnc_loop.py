"""The loop with the LinuxCNC sink beside a HAL in memory: what freezes and goes, heals itself."""

import asyncio
from itertools import pairwise

import pytest

from tests.unit.runtime.linuxcnc_hal import PERIOD_S, MemoryHal
from tests.unit.runtime.simulated import (
    GOAL_UM,
    LARGEST,
    Rig,
    alarms_of,
    enabled_for,
    freeze,
    state_of,
)
from thermaxis.compensation import Limits, Reason, SupervisorState
from thermaxis.runtime import TOWARDS, VirtualClock
from thermaxis.runtime.sinks import LinuxCncOutput, LinuxCncSettings, LinuxCncSink, hal_text

VIRTUAL_TIME = True
RATE_MM_PER_S = 2e-3
LIMITS = Limits(LARGEST, 1e3 * RATE_MM_PER_S)
SETTINGS = LinuxCncSettings(outputs={"Z_um": LinuxCncOutput(2, "mm", TOWARDS, LIMITS)})
FREEZES = ("", "gets thermaxis-request-2", "getp thermaxis-limit-2.min")
"""Where the loop may be when it is frozen: asleep, or in the midst of a write or a read."""
OFFSET_MM = -1e-3 * GOAL_UM
"""Minus the model, and towards the workpiece: plus once more."""
THERE_S = 30.0
"""After so long the offset has arrived. [s]"""


class HalRig(Rig):
    """A loop, a HAL, and every offset that stood in it."""

    def __init__(self) -> None:
        self.hal = MemoryHal(hal_text(SETTINGS))
        super().__init__(
            sink=lambda _, clock: LinuxCncSink(SETTINGS, clock, self.hal.attach),
            limits=LIMITS,
            read_back_s=3.0,
        )
        self.offsets: list[float] = []
        update = self.hal.behaviour["thermaxis-shift-2.update-output"]

        def record() -> None:
            update()
            self.offsets.append(self.offset_mm)

        self.hal.behaviour["thermaxis-shift-2.update-output"] = record

    @property
    def offset_mm(self) -> float:
        return self.hal.pin("thermaxis-shift-2.offset")

    def assert_no_step(self) -> None:
        steps = (abs(b - a) for a, b in pairwise([0.0, *self.offsets]))
        assert max(steps) == pytest.approx(RATE_MM_PER_S * PERIOD_S, rel=1e-6)


async def test_the_loop_takes_the_machine_to_its_goal_and_back_at_the_end() -> None:
    bench = HalRig()
    async with bench.running() as loop:
        await enabled_for(loop, THERE_S)
        assert state_of(loop) is SupervisorState.ACTIVE
        assert bench.offset_mm == pytest.approx(OFFSET_MM, rel=1e-6)
    assert bench.offset_mm <= 1.001 * RATE_MM_PER_S  # one cycle behind
    bench.hal.run_until(asyncio.get_running_loop().time() + 60.0)  # the machine alone
    assert bench.offset_mm == 0.0
    bench.assert_no_step()
    # on a ramp the machine follows behind: no difference of the read-back
    assert SupervisorState.FAULT not in bench.states()


async def test_a_loop_that_was_frozen_heals_by_itself_without_a_step() -> None:
    bench = HalRig()
    async with bench.running() as loop:
        await enabled_for(loop, THERE_S)
        for command in FREEZES:
            begin = len(bench.offsets)
            if command:
                bench.hal.freezes[command] = 10.0
            else:
                freeze(10.0)
            await asyncio.sleep(THERE_S)
            assert bench.hal.freezes == {}
            assert min(bench.offsets[begin:]) < 0.6 * OFFSET_MM  # eight seconds on its way to zero
            assert state_of(loop) is SupervisorState.ACTIVE
            assert bench.offset_mm == pytest.approx(OFFSET_MM, rel=1e-6)
    bench.assert_no_step()


async def test_another_program_that_sets_the_offset_is_told_and_gone_on_from() -> None:
    bench = HalRig()
    async with bench.running() as loop:
        await enabled_for(loop, THERE_S)
        bench.hal.values["thermaxis-request-2"] = -0.02
        await asyncio.sleep(3.0)
        assert "another_writer" in alarms_of(loop)
        await asyncio.sleep(THERE_S)
        assert bench.offset_mm == pytest.approx(OFFSET_MM, rel=1e-6)
    bench.assert_no_step()


async def test_a_machine_that_goes_is_held_for_and_gone_on_with_from_what_is_found() -> None:
    bench = HalRig()
    async with bench.running() as loop:
        await enabled_for(loop, THERE_S)
        bench.hal.running = False
        await asyncio.sleep(5.0)
        assert loop.status is not None
        assert loop.status.output.reasons == (Reason.CONNECTION_LOST,)
        bench.hal.put("thermaxis-limit-2.out", 0.0)  # started anew
        bench.hal.put("thermaxis-arm", 0.0)
        bench.offsets.clear()
        bench.hal.running = True
        await asyncio.sleep(1.6)
        assert bench.offset_mm < 0.2 * OFFSET_MM
        await asyncio.sleep(THERE_S)
        assert state_of(loop) is SupervisorState.ACTIVE
        assert bench.offset_mm == pytest.approx(OFFSET_MM, rel=1e-6)
    bench.assert_no_step()


async def test_a_clamp_that_is_narrower_than_the_configuration_becomes_a_fault() -> None:
    bench = HalRig()
    bench.hal.values["thermaxis-limit-2.max"] = 0.010

    async with bench.running() as loop:
        await enabled_for(loop, THERE_S)
        assert state_of(loop) is SupervisorState.FAULT
        assert loop.status is not None
        assert Reason.READ_BACK_DIFFERS in loop.status.output.reasons
    assert max(bench.offsets) <= 0.010 + 1e-12


async def test_a_cycle_longer_than_the_watchdog_s_default_gets_a_longer_one() -> None:
    slow = LinuxCncSettings(outputs=SETTINGS.outputs, cycle_s=30.0)
    hal = MemoryHal(hal_text(slow))

    sink = LinuxCncSink(slow, VirtualClock(), hal.attach)
    await sink.open()
    await asyncio.sleep(1.0)
    assert await sink.found(1.0) is not None
    for _ in range(3):
        assert await sink.write({"Z_um": -5.0}, 1.0)
        await asyncio.sleep(30.0)
    await sink.close()
    assert hal.pin("thermaxis-shift-2.offset") == pytest.approx(0.005)
