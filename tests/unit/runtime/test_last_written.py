"""An offset that the machine has moved while nobody looked is told until somebody says so."""

import asyncio

import pytest
from hypothesis import given, strategies as st

from tests.unit.runtime.simulated import (
    TOLERANCE_UM,
    Rig,
    ask,
    enabled_for,
    freeze,
    state_of,
)
from thermaxis.compensation import Request, RequestKind, SupervisorState
from thermaxis.runtime import Alarm, Applied, CompensationLoop, LoopAnswer
from thermaxis.runtime.loop._last_written import LastWrittenOffsets

VIRTUAL_TIME = True
FROZEN_S = 12.0


def told(loop: CompensationLoop) -> list[Alarm]:
    assert loop.status is not None
    return [alarm for alarm in loop.status.alarms if alarm.code == "found_elsewhere"]


async def held(bench: Rig, loop: CompensationLoop) -> float:
    """Compensate for a while, hold, and return where."""
    await enabled_for(loop, 60.0)
    await ask(loop, RequestKind.HOLD)
    await asyncio.sleep(5.0)
    assert state_of(loop) is SupervisorState.HOLDING
    assert told(loop) == []
    return bench.machine.z_um


async def test_a_hold_that_lost_its_value_while_the_loop_stood_still_is_told_and_goes_on() -> None:
    bench = Rig()
    bench.machine.watched = True

    async with bench.running() as loop:
        held_um = await held(bench, loop)
        assert held_um < -20.0
        freeze(FROZEN_S)
        await asyncio.sleep(5.0)
        assert state_of(loop) is SupervisorState.HOLDING
        assert bench.machine.z_um == pytest.approx(0.0, abs=0.01)
        (alarm,) = told(loop)
        assert alarm.priority == "high"
        assert alarm.values == {
            "name": "Z_um",
            "found_um": pytest.approx(0.0, abs=0.01),
            "left_um": pytest.approx(held_um, abs=0.01),
        }
        await asyncio.sleep(600.0)
        assert told(loop) == [alarm], "it stays, and says since when"
    bench.assert_law()
    assert sum("had been left at" in event.text for event in bench.said("alarm")) == 1


async def test_it_is_told_until_somebody_acknowledges_it_and_once_more_when_it_happens_again() -> (
    None
):
    bench = Rig()
    bench.machine.watched = True

    async with bench.running() as loop:
        await held(bench, loop)
        freeze(FROZEN_S)
        await asyncio.sleep(5.0)
        assert len(told(loop)) == 1
        assert await ask(loop, RequestKind.ACKNOWLEDGE)
        await asyncio.sleep(2.0)
        assert told(loop) == []
        freeze(FROZEN_S)
        await asyncio.sleep(5.0)
        assert told(loop) == [], "it was held at zero, where the watchdog leaves it"
        await ask(loop, RequestKind.RESUME)
        await asyncio.sleep(30.0)
        for times in (1, 2):
            freeze(FROZEN_S)
            await asyncio.sleep(30.0)
            assert len(told(loop)) == 1, "the last one"
            found = [event for event in bench.said("alarm") if "had been left" in event.text]
            assert sum(not event.text.startswith("gone") for event in found) == 1 + times


async def test_an_acknowledge_that_waited_while_the_loop_stood_still_takes_nothing_unseen() -> None:
    bench = Rig()
    bench.machine.watched = True

    async with bench.running() as loop:
        await held(bench, loop)
        asked = asyncio.ensure_future(ask(loop, RequestKind.ACKNOWLEDGE))
        await asyncio.sleep(0.0)
        freeze(FROZEN_S)
        assert await asked, "there is no fault, and nothing that was shown"
        await asyncio.sleep(3.0)
        assert len(told(loop)) == 1
        assert sum("had been left at" in event.text for event in bench.said("alarm")) == 1
        assert await ask(loop, RequestKind.ACKNOWLEDGE)
        await asyncio.sleep(2.0)
        assert told(loop) == []


async def test_what_is_found_is_in_the_history_even_where_no_alarm_was_made_meanwhile() -> None:
    bench = Rig(cycle_s=0.2)
    async with bench.running() as loop:
        held_um = await held(bench, loop)
        for times in range(1, 6):  # faster than alarms are looked for
            bench.machine.come_back(held_um + 5.0 * times)
            await asyncio.sleep(0.25)
        await asyncio.sleep(3.0)
        assert len(told(loop)) == 1
        said = [e.text for e in bench.said("alarm") if "had been left at" in e.text]
        assert sum(text.startswith("high: ") for text in said) == 5


async def test_an_acknowledge_accepts_no_sensor_that_jumped_while_the_loop_stood_still() -> None:
    bench = Rig()
    async with bench.running() as loop:
        await enabled_for(loop, 60.0)
        request = Request(RequestKind.ACKNOWLEDGE, "Jana")
        asked = asyncio.ensure_future(loop.submit(request))
        await asyncio.sleep(0.0)
        freeze(FROZEN_S)
        bench.machine.values["s"] = 60.0
        outcome = await asked
        assert not outcome.accepted
        assert outcome.code is LoopAnswer.SENSOR_ALARM_MEANWHILE
        await asyncio.sleep(3.0)
        assert loop.status is not None
        assert "sensor s" in {alarm.key for alarm in loop.status.alarms}
        assert await ask(loop, RequestKind.ACKNOWLEDGE), "now it was shown"
        await asyncio.sleep(3.0)
        assert "sensor s" not in {alarm.key for alarm in loop.status.alarms}
    said = [event.text for event in bench.said("request") if "came meanwhile" in event.text]
    assert len(said) == 1


@pytest.mark.parametrize(("moved_um", "says"), [(0.9, False), (1.1, True)])
async def test_after_a_lost_connection_only_an_offset_that_moved_by_more_than_the_tolerance_is_told(
    moved_um: float, says: bool
) -> None:
    bench = Rig()
    async with bench.running() as loop:
        held_um = await held(bench, loop)
        bench.machine.lose()
        await asyncio.sleep(8.0)
        bench.machine.come_back(held_um + moved_um * TOLERANCE_UM)
        await asyncio.sleep(4.0)
        assert bool(told(loop)) is says


async def test_an_offset_that_somebody_moves_while_the_compensation_is_off_is_no_loss() -> None:
    bench = Rig()
    async with bench.running() as loop:
        await enabled_for(loop, 60.0)
        await ask(loop, RequestKind.DISABLE)
        await asyncio.sleep(120.0)
        assert state_of(loop) is SupervisorState.OFF
        bench.machine.lose()
        await asyncio.sleep(8.0)
        bench.machine.come_back(15.0)
        await asyncio.sleep(8.0)
        assert told(loop) == []


async def test_a_silence_that_the_watchdog_bears_is_not_told() -> None:
    bench = Rig()
    bench.machine.watched = True

    async with bench.running() as loop:
        await enabled_for(loop, 20.0)  # it moves by half a micrometre in each cycle
        freeze(1.9)
        await asyncio.sleep(5.0)
        assert told(loop) == []


@pytest.mark.parametrize("stood_um", [0.0, None])
def test_a_hold_that_a_killed_loop_takes_up_again_is_told_where_it_lost_its_value(
    stood_um: float | None,
) -> None:
    bench = Rig()

    left_um: list[float] = []

    async def first(bench: Rig, loop: CompensationLoop) -> None:
        left_um.append(await held(bench, loop))
        await asyncio.sleep(2.0)

    async def second(_: Rig, loop: CompensationLoop) -> None:
        await asyncio.sleep(20.0)
        stood = left_um[0] if stood_um is None else stood_um
        assert bench.machine.z_um == pytest.approx(stood, abs=0.01), "it is still held"
        lefts = [alarm.values["left_um"] for alarm in told(loop)]
        assert lefts == ([] if stood_um is None else [pytest.approx(left_um[0], abs=0.01)])

    bench.play_and_kill(first)
    bench.machine.come_back(stood_um)
    bench.play(second)


# ---- the comparison itself ----------------------------------------------------------------------

_UM = st.floats(-300.0, 300.0)


@given(_UM, _UM, _UM, st.floats(0.05, 5.0))
def test_an_offset_is_elsewhere_when_it_is_outside_of_all_that_was_known_by_the_tolerance(
    written_um: float, effective_um: float, found_um: float, tolerance_um: float
) -> None:
    offsets = LastWrittenOffsets()
    offsets.leave({"Z_um": written_um}, {"Z_um": Applied(written_um, None, effective_um)})
    new = offsets.compare({"Z_um": found_um}, tolerance_um, number=3)
    low_um, high_um = sorted((written_um, effective_um))
    beyond = found_um < low_um and low_um - found_um > tolerance_um
    beyond = beyond or (found_um > high_um and found_um - high_um > tolerance_um)
    assert new == ((("Z_um", found_um, written_um, 3),) if beyond else ())
    assert offsets.elsewhere() == new
    offsets.acknowledge({"found elsewhere Z_um 2", "found elsewhere X_um 3"})
    assert offsets.elsewhere() == new
    offsets.acknowledge({"found elsewhere Z_um 3"})
    assert offsets.elsewhere() == ()


def test_a_write_without_an_answer_may_have_arrived_or_not() -> None:
    for found_um, says in ((10.0, False), (12.0, False), (10.9, False), (13.0, True), (9.0, True)):
        offsets = LastWrittenOffsets()
        offsets.leave({"Z_um": 10.0}, {"Z_um": Applied(10.0, 10.0, 10.0)})
        offsets.leave({"Z_um": 12.0}, {}, refused=True)
        offsets.compare({"Z_um": found_um}, 0.5, number=1)
        assert [one.left_um for one in offsets.elsewhere()] == ([10.0] if says else [])


def test_what_is_not_known_or_was_never_left_is_compared_with_nothing() -> None:
    offsets = LastWrittenOffsets()
    offsets.compare({"Z_um": 50.0}, 0.5, number=1)
    offsets.leave({"Z_um": 10.0}, {})
    offsets.compare({"Z_um": None, "X_um": 3.0}, 0.5, number=2)
    offsets.forget()
    offsets.compare({"Z_um": 90.0}, 0.5, number=3)
    assert offsets.elsewhere() == ()
