"""Source and sink of the virtual lathe, as the loop sees them."""

import asyncio
import math

import pytest

from tests.refusals import refused
from thermaxis.runtime import (
    DIAMETER,
    OTHER_COMPENSATION,
    START_S,
    VirtualClock,
    interlock_name,
    redundant_name,
    run_in_virtual_time,
)
from thermaxis.virtual import FAULTY, LatheSink, LatheSource, VirtualLathe, parse_fault
from thermaxis.virtual.lathe import INTERLOCKS


def lathe_with(*sentences: str, scenario: str = "calibration-spindle") -> VirtualLathe:
    return VirtualLathe(scenario, 1, faults=[parse_fault(s, FAULTY) for s in sentences])


def test_everything_that_a_loop_asks_for_is_read_under_its_name() -> None:
    lathe = lathe_with()

    async def read() -> None:
        source = LatheSource(lathe)
        assert not source.connected
        await source.open()
        samples = await source.read(1.0)
        assert source.connected
        assert samples["T_spindle_C"].value == lathe.readings()["T_spindle_C"].value
        redundant = samples[redundant_name("T_spindle_C")]
        assert redundant.value == lathe.readings()["T_spindle_2_C"].value
        assert samples[OTHER_COMPENSATION].value == 0.0
        assert samples[DIAMETER].value == 0.0
        for interlock in INTERLOCKS:
            assert samples[interlock_name(interlock)].value == 1.0
        assert all(s.good and s.age_s == 0.0 for s in samples.values())
        await source.close()

    asyncio.run(read())


def test_an_interlock_opens_with_its_flag() -> None:
    for flag, value, interlock in (
        ("referenced", False, "referenced"),
        ("machine_on", False, "machine on"),
        ("homing", True, "not homing"),
        ("emergency_stop", True, "no emergency stop"),
    ):
        lathe = lathe_with()
        lathe.set_flag(flag, value=value)
        samples = asyncio.run(LatheSource(lathe).read(1.0))
        opened = [i for i in INTERLOCKS if samples[interlock_name(i)].value == 0.0]
        assert opened == [interlock]


def test_faults_reach_the_loop_with_status_and_age() -> None:
    lathe = lathe_with("bad T_spindle", "stale T_table at 10s", "nan T_column", "missing T_hall")
    lathe.step(30.0)
    samples = asyncio.run(LatheSource(lathe).read(1.0))
    assert samples["T_spindle_C"][:3] == (0.0, False, "BadSensorFailure")
    assert samples["T_table_C"].good
    assert samples["T_table_C"].age_s == pytest.approx(20.0)
    value = samples["T_column_C"].value
    assert value is not None
    assert math.isnan(value)
    assert samples["T_hall_C"][:3] == (None, False, "BadNoCommunication")


def test_the_lathe_goes_with_the_clock_and_stamps_its_values() -> None:
    lathe = lathe_with("stale T_table at 50s")

    async def run() -> None:
        clock = VirtualClock()
        source = LatheSource(lathe, clock)
        await clock.sleep_until(START_S + 90.0)
        samples = await source.read(1.0)
        assert lathe.time_s == pytest.approx(90.0)
        stamp = samples["T_spindle_C"].source_time
        assert stamp == clock.utc()
        old = samples["T_table_C"].source_time
        assert old is not None
        assert (clock.utc() - old).total_seconds() == pytest.approx(40.0)

    run_in_virtual_time(run())


def test_the_sink_writes_micrometres_and_a_heartbeat_and_reads_three_numbers() -> None:
    lathe = lathe_with()

    async def run() -> None:
        clock = VirtualClock()
        sink = LatheSink(lathe, clock)
        await sink.open()
        assert sink.connected
        assert not await sink.write({"Z_um": 5.0}, 1.0)  # nothing before found was read
        assert await sink.found(1.0) == {"Z_um": 0.0}
        assert await sink.found(1.0) is None
        for second in range(1, 11):
            assert await sink.write({"Z_um": 12.5}, 1.0)
            await clock.sleep_until(START_S + second)
        applied = (await sink.read_back(1.0))["Z_um"]
        assert applied == (12.5, pytest.approx(12.5), pytest.approx(12.5))
        assert lathe.axis.heartbeat == 10
        assert lathe.true_um[0] - lathe.uncorrected_um[0] == pytest.approx(12.5)
        assert not await sink.write({"Z_um": math.nan}, 1.0)
        assert not await sink.write({"X_um": 1.0}, 1.0)
        await sink.close()
        # the writer is gone: the lathe's watchdog takes the offset back
        await clock.sleep_until(START_S + 60.0)
        assert (await sink.read_back(1.0))["Z_um"].effective_um == pytest.approx(0.0)
        assert (await sink.read_back(1.0))["Z_um"].accepted_um == pytest.approx(12.5)

    run_in_virtual_time(run())


def test_after_a_lost_network_the_offset_that_stands_is_news_before_anything_is_written() -> None:
    lathe = lathe_with("restart at 20s for 5s", "pause at 40s for 5s")

    async def run() -> None:
        clock = VirtualClock()
        source, sink = LatheSource(lathe, clock), LatheSink(lathe, clock)
        assert await sink.found(1.0) == {"Z_um": 0.0}
        await sink.write({"Z_um": 4.0}, 1.0)
        for lost_s in (22.0, 42.0):
            await clock.sleep_until(START_S + lost_s)
            samples = await source.read(1.0)
            assert {s.status for s in samples.values()} == {"BadNoCommunication"}
            assert not source.connected
            assert not sink.connected
            assert not await sink.write({"Z_um": 9.0}, 1.0)
            assert (await sink.read_back(1.0))["Z_um"][1:] == (None, None)
            assert await sink.found(1.0) is None
            await clock.sleep_until(START_S + lost_s + 5.0)
            assert not await sink.write({"Z_um": 9.0}, 1.0)
            assert await sink.found(1.0) == {"Z_um": pytest.approx(4.0)}
            assert await sink.write({"Z_um": 4.0}, 1.0)

    run_in_virtual_time(run())


def test_a_name_that_is_not_there_is_refused() -> None:
    with refused("unknown_name"):
        LatheSource(lathe_with(), names={"T": "T_turret"})
    with refused("unknown_name"):
        LatheSource(lathe_with(), interlocks=("door",))
