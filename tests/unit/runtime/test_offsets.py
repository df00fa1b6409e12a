"""An offset that has moved by itself is told until somebody says so, and gone on from."""

import asyncio
import math
from collections.abc import Sequence
from datetime import timedelta

import pytest
from hypothesis import given, settings, strategies as st

from tests.proofs import quick_first
from tests.unit.runtime.simulated import (
    GOAL_UM,
    RATE,
    TOLERANCE_UM,
    Rig,
    alarms_of,
    ask,
    compensation,
    enabled_for,
    freeze,
    state_of,
)
from tests.unit.runtime.taking_over import NOON, LateControl, compensate
from thermaxis.compensation import Limits, Reason, Request, RequestKind, SupervisorState
from thermaxis.runtime import Alarm, Applied, AtStop, CompensationLoop, LoopAnswer
from thermaxis.runtime._offsets import (
    Found,
    Look,
    OffsetMismatch,
    OffsetRules,
    OffsetsState,
    OutputOffset,
    acknowledged,
    is_stale,
    look_step,
    rest_step,
    standing,
    write_step,
)

VIRTUAL_TIME = True
FROZEN_S = 12.0


def told(loop: CompensationLoop) -> list[Alarm]:
    assert loop.status is not None
    return [alarm for alarm in loop.status.alarms if alarm.code == "offset_mismatch"]


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


# ---- latched ------------------------------------------------------------------------------------


async def test_a_latched_mismatch_fades_and_stays_off_until_somebody_acknowledges_it() -> None:
    bench = Rig()
    bench.machine.watched = True
    async with bench.running(latch_offset_mismatch=True) as loop:
        await enabled_for(loop, 60.0)
        freeze(FROZEN_S)
        await asyncio.sleep(3.0)
        assert len(told(loop)) == 1
        await asyncio.sleep(120.0)
        assert state_of(loop) is SupervisorState.WARMING
        assert bench.machine.z_um == 0.0
        assert loop.status is not None
        assert loop.status.output.reasons == (Reason.INTERLOCK_OPEN,)
        assert await ask(loop, RequestKind.ACKNOWLEDGE)
        await asyncio.sleep(120.0)
        assert state_of(loop) is SupervisorState.ACTIVE
        assert bench.machine.z_um == pytest.approx(GOAL_UM, abs=0.01)
    bench.assert_law(late_cycles=2.0)


def test_a_watchdog_that_trips_while_no_loop_runs_is_latched_and_so_is_a_latched_restart() -> None:
    bench = Rig()
    states: list[SupervisorState] = []

    async def first(_: Rig, loop: CompensationLoop) -> None:
        await enabled_for(loop, 60.0)

    async def later(_: Rig, loop: CompensationLoop) -> None:
        await asyncio.sleep(60.0)
        states.append(state_of(loop))

    bench.play_and_kill(first)
    assert bench.machine.z_um < -20.0
    bench.machine.come_back(0.0)
    for _ in range(2):
        bench.play(later, latch_offset_mismatch=True, at_stop=AtStop.LEAVE)
    assert states == [SupervisorState.WARMING, SupervisorState.OFF]
    assert bench.machine.z_um == 0.0


def test_a_fade_that_a_latch_began_goes_on_after_a_restart() -> None:
    bench = Rig()

    async def first(_: Rig, loop: CompensationLoop) -> None:
        await enabled_for(loop, 60.0)
        bench.machine.set_offset(Z_um=40.0)
        await asyncio.sleep(20.0)
        assert state_of(loop) is SupervisorState.FADING

    async def later(_: Rig, loop: CompensationLoop) -> None:
        await asyncio.sleep(120.0)
        assert state_of(loop) is SupervisorState.OFF

    bench.play_and_kill(first, latch_offset_mismatch=True)
    assert bench.machine.z_um > 20.0
    bench.play(later, latch_offset_mismatch=True)
    assert bench.machine.z_um == 0.0


def test_what_nobody_has_acknowledged_is_told_after_a_restart_and_since_when() -> None:
    bench, found = Rig(), list[Alarm]()

    async def first(_: Rig, loop: CompensationLoop) -> None:
        await enabled_for(loop, 60.0)
        bench.machine.set_offset(Z_um=-20.0)
        await asyncio.sleep(5.0)
        found.extend(others(loop))

    async def later(_: Rig, loop: CompensationLoop) -> None:
        await asyncio.sleep(20.0)
        assert others(loop) == found
        assert await ask(loop, RequestKind.ACKNOWLEDGE)
        await asyncio.sleep(2.0)
        assert others(loop) == []

    async def last(_: Rig, loop: CompensationLoop) -> None:
        await asyncio.sleep(5.0)
        assert others(loop) == []

    bench.play_and_kill(first)
    assert len(found) == 1
    for script in (later, last):
        bench.play_and_kill(script)


def others(loop: CompensationLoop) -> list[Alarm]:
    assert loop.status is not None
    return [alarm for alarm in loop.status.alarms if alarm.code == "another_writer"]


# ---- another writer -----------------------------------------------------------------------------


@pytest.mark.parametrize("others_um", quick_first(1, [5.0, 40.0, -50.0]))
async def test_the_correction_goes_on_at_the_rate_from_what_another_writer_set(
    others_um: float,
) -> None:
    bench = Rig()
    async with bench.running() as loop:
        await enabled_for(loop, 60.0)
        bench.machine.set_offset(Z_um=others_um)
        await asyncio.sleep(2.0)
        assert "another_writer" in alarms_of(loop)
        assert abs(bench.machine.z_um - others_um) <= 3.0 * RATE
        assert state_of(loop) is SupervisorState.ACTIVE
        await asyncio.sleep(200.0)
        assert bench.machine.z_um == pytest.approx(-36.0, abs=0.01)
        assert await ask(loop, RequestKind.ACKNOWLEDGE)
        await asyncio.sleep(2.0)
        assert "another_writer" not in alarms_of(loop)
    bench.assert_law(late_cycles=1.0)
    came = [e for e in bench.said("alarm") if "Something else" in e.text]
    assert [e.text.startswith("high: ") for e in came] == [True, False]


@pytest.mark.parametrize("period_s", quick_first(1, [0.3, 5.0, 30.0]))
async def test_a_writer_that_comes_again_and_again_is_a_fault_at_the_third_time_in_a_minute(
    period_s: float,
) -> None:
    bench = Rig(cycle_s=0.1)
    async with bench.running() as loop:
        await enabled_for(loop, 60.0)
        for k in range(3 if period_s > 1.0 else 20):
            assert (state_of(loop) is SupervisorState.FAULT) <= (k > 2)
            bench.machine.set_offset(Z_um=(20.0, -55.0)[k % 2])
            await asyncio.sleep(period_s)
        assert loop.status is not None
        assert loop.status.output.reasons == (Reason.DOUBLE_COMPENSATION,)
        if period_s < 30.0:
            assert not await ask(loop, RequestKind.ACKNOWLEDGE), "it was there just now"
        await asyncio.sleep(61.0)
        assert await ask(loop, RequestKind.ACKNOWLEDGE)
    bench.assert_law(late_cycles=1.0)
    came = [e for e in bench.said("alarm") if e.text.startswith("high: Something else")]
    assert len(came) == 3, "and then the fault says it"


async def test_two_writers_in_two_minutes_are_no_fault() -> None:
    bench = Rig()
    async with bench.running() as loop:
        await enabled_for(loop, 60.0)
        for _ in range(4):
            bench.machine.set_offset(Z_um=30.0)
            await asyncio.sleep(31.0)
        assert state_of(loop) is SupervisorState.ACTIVE


@pytest.mark.parametrize("zero_um", [0.0, 0.3])
async def test_a_watchdog_that_trips_between_two_writes_is_no_other_writer(zero_um: float) -> None:
    bench = Rig()
    async with bench.running() as loop:
        await enabled_for(loop, 60.0)
        for _ in range(4):
            bench.machine.set_offset(Z_um=zero_um)
            await asyncio.sleep(10.0)
        assert state_of(loop) is SupervisorState.ACTIVE
        assert "offset_mismatch" in alarms_of(loop)
        assert "another_writer" not in alarms_of(loop)
    bench.assert_law(late_cycles=1.0)


async def test_what_acts_may_not_stand_while_what_is_accepted_moves() -> None:
    bench = Rig(cycle_s=0.1)
    async with bench.running() as loop:
        await enabled_for(loop, 30.0)
        stood_um = bench.machine.z_um
        assert stood_um < -5.0

        def accept_only(**offset_um: float) -> None:
            bench.machine.accepted_um.update(offset_um)

        bench.machine.set_offset = accept_only
        await asyncio.sleep(8.0)
        released_um = abs(bench.machine.accepted_um["Z_um"] - stood_um)
        assert TOLERANCE_UM < released_um <= TOLERANCE_UM + 0.6 * RATE, "no more is let go at once"
        assert state_of(loop) is SupervisorState.ACTIVE
        await asyncio.sleep(4.0)
        assert loop.status is not None
        assert loop.status.output.reasons == (Reason.READ_BACK_DIFFERS,)


# ---- the step itself ----------------------------------------------------------------------------

_UM = st.floats(-300.0, 300.0)
RULES = OffsetRules(("Z_um",), (60.0,), 0.5, 10.0, 0.5)


class Steps:
    """A machine's answers and writes, one after the other, ten times a second."""

    def __init__(self, rules: OffsetRules = RULES) -> None:
        self.rules, self.now_s, self.number = rules, 100.0, 0
        self.state = OffsetsState((OutputOffset(),) * len(rules.names), late_s=0.0)

    def look(
        self,
        accepted_um: float | None,
        effective_um: float | None = None,
        *,
        news_um: float | None = None,
        connected: bool = True,
        after_s: float = 0.1,
    ) -> Found:
        self.now_s, self.number = self.now_s + after_s, self.number + 1
        news = None if news_um is None else {"Z_um": news_um}
        applied = {"Z_um": Applied(None, accepted_um, effective_um)}
        utc = NOON + timedelta(seconds=self.now_s)
        look = Look(self.number, self.now_s, utc, connected, news, applied)
        self.state, found = look_step(self.rules, self.state, look)
        return found

    def write(self, *um: float) -> None:
        at = self.now_s, NOON + timedelta(seconds=self.now_s)
        for one in um:
            self.state = write_step(self.rules, self.state, (one,), at)

    def begin(self, um: float = 0.0) -> "Steps":
        """Connect to a machine that stands somewhere."""
        assert self.look(um, news_um=um).found_um == (um,)
        return self


@given(_UM, st.lists(_UM, max_size=5), _UM, st.floats(0.05, 5.0))
def test_an_offset_has_moved_by_itself_when_it_is_outside_of_all_that_was_written(
    begun_um: float, written_um: Sequence[float], seen_um: float, tolerance_um: float
) -> None:
    steps = Steps(RULES._replace(tolerance_um=tolerance_um, total_um=(1e4,))).begin(begun_um)
    steps.write(*written_um)
    found = steps.look(seen_um)
    low_um, high_um = min(begun_um, *written_um, 1e9), max(begun_um, *written_um, -1e9)
    moved = seen_um < low_um and low_um - seen_um > tolerance_um
    moved = moved or (seen_um > high_um and seen_um - high_um > tolerance_um)
    assert found.found_um == ((seen_um,) if moved else None)
    assert found.read_back_um == (seen_um,)
    left_um = written_um[-1] if written_um else begun_um
    nearer = min(low_um, 0.0) - tolerance_um <= seen_um <= max(high_um, 0.0) + tolerance_um
    another = False if abs(seen_um) <= tolerance_um else None if nearer else True
    told = tuple(one[:-1] for one in found.told)
    assert told == ((("Z_um", seen_um, left_um, 2, another),) if moved else ())
    assert steps.state.mismatches == found.told
    steps.state = acknowledged(steps.state, {"offset mismatch Z_um 3", "offset mismatch X_um 2"})
    assert steps.state.mismatches == found.told
    steps.state = acknowledged(steps.state, {"offset mismatch Z_um 2"})
    assert steps.state.mismatches == ()


@pytest.mark.proof
@settings(max_examples=20)
@given(
    late_s=st.floats(0.05, 1.5),
    sampled=st.booleans(),
    ramp=st.sampled_from((0.5, 2.0, math.inf)),
    follow_s=st.floats(0.0, 3.0),
    tenths=st.booleans(),
    freeze_s=st.sampled_from((0.0, 3.0, 5.0)),
    cycle_s=st.sampled_from((0.1, 0.5)),
)
def test_a_control_that_takes_offsets_over_late_is_never_taken_for_another_writer(
    late_s: float,
    sampled: bool,
    ramp: float,
    follow_s: float,
    tenths: bool,
    freeze_s: float,
    cycle_s: float,
) -> None:
    plant = compensation(cycle_s=cycle_s, limits=Limits(60.0, 2.0))
    control = LateControl(late_s, sampled, ramp, follow_s, tenths, watchdog_s=2.0)
    shift = compensate(plant, control, hours=0.02, freeze_s=freeze_s)
    assert not any(one.another for one in shift.told)
    assert freeze_s > 0.0 or shift.told == []
    assert shift.states == {SupervisorState.WARMING, SupervisorState.ACTIVE}
    assert shift.furthest_um > 10.0


@pytest.mark.proof
@settings(max_examples=20)
@given(
    late_s=st.floats(0.05, 2.0),
    sampled=st.booleans(),
    ramp=st.sampled_from((10.0, math.inf)),
    tenths=st.booleans(),
    other=st.tuples(st.floats(25.0, 60.0), st.floats(-50.0, 50.0)),
    cycle_s=st.sampled_from((0.1, 0.2, 1.0)),
)
def test_one_foreign_write_between_late_own_ones_never_makes_the_loop_go_back_and_forth(
    late_s: float,
    sampled: bool,
    ramp: float,
    tenths: bool,
    other: tuple[float, float],
    cycle_s: float,
) -> None:
    plant = compensation(cycle_s=cycle_s, limits=Limits(60.0, 1.0))
    control = LateControl(late_s, sampled, ramp, tenths=tenths)
    shift = compensate(plant, control, hours=0.03, other=other)
    assert len(shift.changed) <= 1, "it goes on from there, or from its newest own write"
    assert len({one.key for one in shift.told}) <= 1
    assert all(abs(one.found_um - one.left_um) > TOLERANCE_UM for one in shift.told)
    assert SupervisorState.FAULT not in shift.states


def test_nothing_is_written_while_an_own_write_may_still_be_under_way() -> None:
    """Accepted after 1.2 s, a cycle of one second, and one foreign write."""
    for comes_back in (True, False):
        steps = Steps(RULES._replace(silence_s=1.5)).begin(0.0)
        for k in range(1, 8):
            assert not steps.look(-1.0 * max(k - 2, 0), after_s=1.0).rests
            steps.write(-1.0 * k)
        found = steps.look(25.0, after_s=1.0)
        assert (found.rests, found.found_um) == (True, (-7.0,)), "no step from 25 um"
        assert [one.another for one in found.told] == [True]
        found = steps.look(-7.0 if comes_back else 25.0, after_s=1.0)
        assert (found.rests, found.told) == (not comes_back, ())
        for _ in range(3):
            found = steps.look(-7.0 if comes_back else 25.0, after_s=1.0)
            assert found.told == ()
        assert not found.rests
        assert steps.state.outputs[0].path[-1].um == (-7.0 if comes_back else 25.0)
        assert len(steps.state.others_s) == 1


def test_a_write_before_a_silence_may_have_arrived_or_not() -> None:
    for seen_um, says in ((10.0, False), (12.0, False), (10.9, False), (13.0, True), (9.0, True)):
        steps = Steps().begin(10.0)
        steps.write(12.0)
        found = steps.look(seen_um, after_s=3.0)  # a silence: it is found anew
        assert found.found_um == (seen_um,)
        assert [one.left_um for one in found.told] == ([12.0] if says else [])


def test_what_the_machine_has_passed_counts_no_more_and_the_rest_for_read_back_s() -> None:
    at_once, late = Steps().begin(0.0), Steps().begin(0.0)
    for k in range(1, 60):  # at half a micrometre a second
        for steps, seen_um in ((at_once, 0.05 * (k - 1)), (late, max(0.0, 0.05 * (k - 15)))):
            assert steps.look(seen_um).found_um is None
            steps.write(0.05 * k)
    assert at_once.look(2.95 - 0.05 - 0.55).found_um == (pytest.approx(2.35),)
    assert late.look(0.05 * 45 - 0.4).found_um is None
    assert late.look(0.05 * 45 - 0.8).found_um is not None
    stands = Steps().begin(0.0)
    for k in range(1, 1000):  # back and forth, and nothing of it is taken over
        assert stands.look(0.0).found_um is None
        stands.write(5.0 * math.sin(k))
    assert len(stands.state.outputs[0].path) <= 103


@pytest.mark.parametrize("fall_um", [0.2, 3.0])
def test_a_way_to_zero_is_a_watchdog_s_though_writes_are_answered(fall_um: float) -> None:
    steps = Steps().begin(20.0)
    told: list[OffsetMismatch] = []
    stands_um, written_um = 20.0, 20.0
    while stands_um > 2.0:
        steps.write(written_um)
        stands_um -= fall_um
        found = steps.look(stands_um)
        told += found.told
        if found.found_um is not None:
            assert found.found_um == (stands_um,)
            written_um = stands_um + 0.1
    assert 20.0 - told[0].found_um <= 0.5 + fall_um + 1e-9
    assert [one.another for one in told] == [None], "told once, and no other writer"
    assert steps.state.others_s == ()
    for _ in range(5):  # and is taken up again where it is
        steps.write(written_um)
        assert steps.look(written_um) == Found(None, (written_um,))
        written_um += 0.2


@pytest.mark.parametrize("follows", [True, False])
def test_a_value_nearer_to_zero_that_stays_or_follows_is_another_writer_s(follows: bool) -> None:
    steps = Steps().begin(20.0)
    steps.write(20.0)
    (told,) = steps.look(12.0).told
    assert told.another is None
    told_s: list[float] = []
    for k in range(1, 120):
        um = 12.0 + 0.2 * k if follows else 12.0
        steps.write(um)
        for one in steps.look(um).told:
            assert one == told._replace(another=True)
            told_s.append(0.1 * k)
    assert told_s == [pytest.approx(0.1 if follows else RULES.read_back_s, abs=0.11)]
    assert len(steps.state.others_s) == 1
    assert [one.another for one in steps.state.mismatches] == [True]


def test_a_write_that_a_network_delivers_after_a_connection_was_lost_is_no_other_writer() -> None:
    steps = Steps().begin(10.0)
    steps.write(10.2, 10.4)
    steps.look(10.4, connected=False)
    assert not steps.state.known
    steps.state = rest_step(steps.state, off=False)
    assert [one.another for one in steps.look(0.0, news_um=0.0).told] == [False]
    steps.write(0.2)
    found = steps.look(10.4)  # what had been on its way for seconds
    assert (found.found_um, found.read_back_um) == (None, (10.4,)), "it is waited for"
    steps.write(0.4)
    assert [one.another for one in steps.look(25.0).told] == [True]
    steps.write(24.8)
    assert [one.another for one in steps.look(10.4).told] == [], "it counts once a second"
    for _ in range(10):
        steps.write(10.2)
        assert steps.look(10.2).found_um is None
    steps.write(10.2)
    assert [one.another for one in steps.look(30.0).told] == [True]
    steps.state = steps.state._replace(others_s=steps.state.others_s[:1] * 3)
    assert steps.look(50.0) == Found((50.0,), (50.0,), other_writer=True), "the fault says it"


def test_an_own_value_that_comes_after_a_newer_one_was_seen_is_gone_on_from_at_once() -> None:
    steps = Steps().begin(10.0)
    steps.write(10.4)
    assert steps.look(0.0, after_s=3.0).found_um == (0.0,)  # the watchdog tripped meanwhile
    steps.write(0.2)
    assert steps.look(0.2).found_um is None
    steps.write(0.4)
    found = steps.look(10.4)
    assert found.found_um == (10.4,)
    assert [one.another for one in found.told] == [False]


def test_a_writer_that_comes_again_at_once_is_not_waited_for() -> None:
    steps = Steps().begin(20.0)
    steps.write(20.0)
    for um in (12.0, 18.0, 5.0, 19.0):
        assert steps.look(um).found_um == (um,)
        steps.write(um + 0.1)


def test_what_acts_is_found_where_the_machine_alone_moved_it() -> None:
    steps = Steps().begin(10.0)
    steps.write(10.2)
    assert steps.look(10.2, 10.0).found_um is None
    found = steps.look(10.2, 9.0)  # a release was taken away: it goes to zero by itself
    assert found.found_um == (9.0,)
    assert [one.another for one in found.told] == [False]
    again = steps.look(10.2, 7.0)
    assert (again.found_um, again.told) == ((7.0,), ()), "told once, as long as it goes on"


def test_what_acts_stands_only_once_it_has_come_no_nearer_for_ten_seconds() -> None:
    steps, stood_s = Steps().begin(50.0), 0.0
    assert steps.look(50.0, 0.0, news_um=50.0).found_um == (50.0,)
    for k in range(1, 400):  # it follows at a micrometre a second, and stands from 20 um on
        steps.write(50.0)
        steps.look(50.0, min(0.1 * k, 20.0))
        stood_s = max(0.0, 0.1 * k - 20.0)
        if abs(stood_s - 10.0) > 0.2:
            assert standing(RULES, steps.state) == ({"Z_um"} if stood_s > 10.0 else set())
    assert stood_s > 19.0


def test_what_was_seen_on_its_way_is_not_explained_back_where_it_began() -> None:
    """The release is taken away twice: the way from zero to 8 um explains no second zero."""
    steps = Steps().begin(8.0)
    steps.write(8.0)
    steps.look(8.0, 8.0)
    assert steps.look(8.0, 0.0).found_um == (0.0,)
    for k in range(1, 6):
        steps.write(0.5 * k)
        assert steps.look(0.5 * k, 0.5 * k).found_um is None
    steps.write(3.0)
    assert steps.look(2.5, 0.0).found_um == (0.0,)


def test_nothing_is_believed_after_a_look_without_an_answer() -> None:
    steps = Steps().begin(10.0)
    steps.write(10.0)
    assert steps.look(None) == Found(None, None)
    assert steps.state.doubtful
    assert steps.look(None).found_um == (None,)
    assert not steps.state.known
    assert steps.look(4.0).found_um == (4.0,)
    assert (steps.state.known, steps.state.doubtful) == (True, False)


def test_what_is_no_offset_is_told_once_and_what_is_rounded_at_the_limit_is_the_limit() -> None:
    steps = Steps()
    assert steps.look(2e5, news_um=2e5).unusable
    assert not steps.look(2e5).unusable
    assert not steps.state.known
    assert steps.look(-60.4).found_um == (-60.0,)
    assert steps.look(0.0, connected=False).found_um is None
    assert steps.look(60.6, news_um=60.6).found_um == (60.6,)


def test_a_silence_is_noticed_by_either_clock() -> None:
    steps = Steps().begin()
    for by_s, by_day_s, silent in ((0.5, 0.5, False), (0.51, 0.0, True), (0.0, 0.51, True)):
        utc = NOON + timedelta(seconds=steps.now_s + by_day_s)
        assert is_stale(RULES, steps.state, steps.now_s + by_s, utc) is silent


def test_switched_off_an_offset_may_be_anybodys() -> None:
    steps = Steps().begin(10.0)
    steps.write(10.0)
    steps.state = rest_step(steps.state, off=True)
    found = steps.look(33.0)
    assert (found.found_um, found.told) == ((33.0,), ())
