"""The loop in virtual time: what it writes, survives and remembers, and tells of all that."""

import asyncio
import json
import math
import random
from collections.abc import Mapping
from dataclasses import replace
from datetime import timedelta
from itertools import pairwise
from typing import Any

import pytest

from tests.proofs import quick_first
from tests.unit.runtime.simulated import (
    FLAGS,
    GOAL_UM,
    LARGEST,
    RATE,
    ROUNDED_UM,
    SHA,
    TOLERANCE_UM,
    WATCHDOG_S,
    Rig,
    SimulatedMachine,
    SimulatedSink,
    SimulatedSource,
    alarms_of,
    ask,
    enabled_for,
    freeze,
    state_of,
)
from thermaxis.codes import Message, Place
from thermaxis.compensation import (
    Limits,
    Reason,
    Request,
    RequestKind,
    SupervisorState,
)
from thermaxis.runtime import (
    DIAMETER,
    OTHER_COMPENSATION,
    START_UTC,
    Applied,
    AtStop,
    CompensationLoop,
    HistorianStatus,
    LoopAnswer,
    SourceSample,
    VirtualClock,
    run_in_virtual_time,
)
from thermaxis.runtime.loop import TESTED_EVERY_S, UNREAD_AFTER_S
from thermaxis.runtime.status import AgedOffset

VIRTUAL_TIME = True
NEAR_GOAL = pytest.approx(GOAL_UM, abs=0.01)


# ---- out and back -------------------------------------------------------------------------------


async def test_the_offset_goes_to_minus_the_model_at_the_allowed_rate_and_back_at_the_end() -> None:
    bench = Rig()
    async with bench.running() as loop:
        await enabled_for(loop, 200.0)
        assert state_of(loop) is SupervisorState.ACTIVE
        assert bench.machine.z_um == GOAL_UM
        assert loop.status is not None
        assert loop.status.configuration_sha256 == SHA
    assert bench.machine.z_um == 0.0
    bench.assert_law(late_cycles=1.0)
    assert min(w.after_um - w.before_um for w in bench.machine.writes) == -RATE
    assert bench.historian.closed


def test_a_loop_that_ends_after_some_cycles_fades_first_and_says_what_it_leaves() -> None:
    bench = Rig()

    async def play(within_s: float) -> dict[str, float]:
        loop = bench.loop(stop_within_s=within_s)
        running = asyncio.ensure_future(loop.run(asyncio.Event(), cycles=100))
        assert await ask(loop, RequestKind.ENABLE)
        return dict(await running)

    assert run_in_virtual_time(play(300.0)) == {"Z_um": 0.0}
    assert bench.machine.z_um == 0.0
    bench.machine.come_back()
    standing = run_in_virtual_time(play(10.0))
    assert standing["Z_um"] == bench.machine.z_um < -20.0
    last = bench.historian.events[-1]
    assert (last.code, str(last.values["standing"])[:6]) == ("event-loop_ended_standing", "Z_um -")


def test_at_the_end_an_offset_may_be_left_where_it_is() -> None:
    bench = Rig()
    bench.play(lambda _, loop: enabled_for(loop, 60.0), at_stop=AtStop.LEAVE)
    assert bench.machine.writes[-1].after_um < -20.0
    assert bench.file.saved is not None
    assert bench.file.saved.enabled


async def test_a_loop_that_nobody_enabled_leaves_a_found_offset_alone() -> None:
    bench = Rig()
    bench.machine.set_offset(Z_um=-12.0)

    async with bench.running() as loop:
        await asyncio.sleep(30.0)
        assert not bench.machine.writes
        assert loop.status is not None
        assert loop.status.output.correction_um == (-12.0,)
        await enabled_for(loop, 100.0)
    bench.assert_law(late_cycles=1.0)


@pytest.mark.parametrize("every_s", [1.0, 3600.0])  # somebody's decision waits for neither
@pytest.mark.parametrize("disabled", [False, True])
def test_after_a_kill_the_loop_goes_on_from_the_offset_in_the_machine(
    disabled: bool, every_s: float
) -> None:
    bench = Rig()
    bench.file.every_s = every_s

    async def until_it_is_killed(_: Rig, loop: CompensationLoop) -> None:
        await enabled_for(loop, 80.0)
        if disabled:
            assert await ask(loop, RequestKind.DISABLE)
            await asyncio.sleep(10.0)

    bench.play_and_kill(until_it_is_killed)
    before_um = bench.machine.z_um
    assert before_um < -30.0
    bench.machine.come_back()
    bench.machine.writes.clear()

    async def script(bench: Rig, loop: CompensationLoop) -> None:
        await asyncio.sleep(100.0)
        assert state_of(loop) is (SupervisorState.OFF if disabled else SupervisorState.ACTIVE)
        assert loop.status is not None
        assert loop.status.enabled is not disabled

    bench.play(script, at_stop=AtStop.LEAVE)
    assert bench.machine.writes[0].before_um == before_um
    assert bench.machine.z_um == (0.0 if disabled else NEAR_GOAL)
    bench.assert_law()


def test_a_fault_survives_a_clock_that_was_set_back() -> None:
    bench = Rig()

    async def faulty(bench: Rig, loop: CompensationLoop) -> None:
        await enabled_for(loop, 60.0)
        bench.machine.obeys = False
        await asyncio.sleep(30.0)

    bench.play(faulty, at_stop=AtStop.LEAVE)
    bench.machine.obeys = True
    bench.machine.come_back()
    bench.clock = VirtualClock(START_UTC - timedelta(days=1))

    async def again(_: Rig, loop: CompensationLoop) -> None:
        await asyncio.sleep(5.0)
        assert state_of(loop) is SupervisorState.FAULT
        assert not await ask(loop, RequestKind.ENABLE)

    bench.play(again)


# ---- time ---------------------------------------------------------------------------------------


async def test_cycles_that_are_missed_are_counted_and_cost_no_step() -> None:
    bench = Rig()
    async with bench.running() as loop:
        await enabled_for(loop, 20.0)
        freeze(7.3)
        await asyncio.sleep(10.0)
        assert state_of(loop) is SupervisorState.ACTIVE
    records = bench.historian.records
    grid = round(records[-1].monotonic_s - records[0].monotonic_s)
    assert loop.status is not None
    assert loop.status.overruns == grid + 1 - len(records) > 4
    assert max(record.lateness_s for record in records) == pytest.approx(7.3, abs=1.0)
    begun = [r.monotonic_s for r in records if r.lateness_s == 0.0]
    assert all(b - a == pytest.approx(round(b - a)) for a, b in pairwise(begun))  # still in step
    bench.assert_law()


@pytest.mark.parametrize(
    ("frozen_s", "cycle_s"), quick_first(2, [(1.6, 1.0), (3000.0, 1.0), (2.9, 0.1), (5.0, 0.1)])
)
async def test_a_loop_that_was_frozen_goes_on_from_where_the_watchdog_left_the_offset(
    frozen_s: float, cycle_s: float
) -> None:
    bench = Rig(cycle_s=cycle_s)
    bench.machine.watched = True

    async with bench.running() as loop:
        await enabled_for(loop, 50.0)
        assert bench.machine.z_um < -20.0
        bench.machine.freezes_s = frozen_s  # in the midst of a cycle
        await asyncio.sleep(frozen_s + 8.0)
        assert state_of(loop) is SupervisorState.ACTIVE
        freeze(frozen_s)  # between two
        await asyncio.sleep(85.0)
        assert state_of(loop) is SupervisorState.ACTIVE
        assert bench.machine.z_um == NEAR_GOAL
    bench.assert_law()
    assert SupervisorState.FAULT not in bench.states()


@pytest.mark.parametrize(("looks", "watched"), [(2, True), (10, False), (60, True)])
async def test_looks_without_an_answer_after_a_silence_are_repeated_until_there_is_one(
    looks: int, watched: bool
) -> None:
    bench = Rig()
    bench.machine.watched = watched

    async with bench.running() as loop:
        await enabled_for(loop, 60.0)
        freeze(3.0)
        bench.machine.unanswered = looks
        told: set[str] = set()
        while bench.machine.unanswered:
            await asyncio.sleep(0.5)
            told |= alarms_of(loop)
        assert ("offset_unread" in told) is (looks > UNREAD_AFTER_S)
        await asyncio.sleep(120.0)
        assert state_of(loop) is SupervisorState.ACTIVE
        assert bench.machine.z_um == NEAR_GOAL
        assert "offset_unread" not in alarms_of(loop)
        assert SupervisorState.FAULT not in bench.states()
        assert (SupervisorState.FADING in bench.states()) is (looks > 20)  # longer than it is held
    bench.assert_law()


async def test_what_is_no_offset_is_looked_at_until_somebody_has_mended_it() -> None:
    bench = Rig()
    bench.machine.set_offset(Z_um=2e5)  # another unit

    async with bench.running() as loop:
        await asyncio.sleep(30.0)
        assert bench.machine.writes == []
        assert "offset_unread" in alarms_of(loop)
        bench.machine.set_offset(Z_um=-3.0)
        await asyncio.sleep(3.0)
        assert "offset_unread" not in alarms_of(loop)
        assert await ask(loop, RequestKind.ACKNOWLEDGE)
        await enabled_for(loop, 60.0)
        assert state_of(loop) is SupervisorState.ACTIVE
    bench.assert_law()
    assert [e.code for e in bench.said("alarm")].count("event-offset_unusable") == 1


async def test_a_computer_that_slept_is_noticed_by_the_time_of_day() -> None:
    bench = Rig()
    bench.machine.watched = True

    async with bench.running() as loop:
        await enabled_for(loop, 60.0)
        bench.clock.change_time_of_day(by_s=3600.0)  # while the monotonic clock stood still
        bench.machine.offset_um["Z_um"] = 0.0
        await asyncio.sleep(10.0)
    bench.assert_law()


async def test_a_freeze_between_the_look_and_the_write_writes_nothing() -> None:
    class Freezing(SimulatedSink):
        frozen = 0

        async def read_back(self, deadline_s: float) -> Mapping[str, Applied]:
            found = await super().read_back(deadline_s)
            if self.machine.freezes_s:
                self.machine.freezes_s, frozen_s = 0.0, self.machine.freezes_s
                freeze(frozen_s)
                self.frozen += 1
            return found

    class Calm(SimulatedSource):
        async def read(self, deadline_s: float) -> Mapping[str, SourceSample]:
            self.machine.freezes_s, frozen_s = 0.0, self.machine.freezes_s
            found = await super().read(deadline_s)
            self.machine.freezes_s = frozen_s
            return found

    bench = Rig(sink=Freezing)
    bench.machine.watched = True

    async with bench.running(Calm(bench.machine)) as loop:
        await enabled_for(loop, 60.0)
        assert bench.machine.z_um < -20.0
        bench.machine.freezes_s = 10.0
        freeze(2.0)  # so that it looks, and what it sees grows old before it writes
        await asyncio.sleep(30.0)
        assert isinstance(loop.sink, Freezing)
        assert loop.sink.frozen == 1
        assert state_of(loop) is SupervisorState.ACTIVE
    bench.assert_law()


@pytest.mark.parametrize("left_s", [0.05, 0.25, 0.35])
async def test_an_offset_that_the_watchdog_takes_back_during_the_self_test_is_looked_at_again(
    left_s: float,
) -> None:
    bench = Rig(cycle_s=0.1)
    bench.machine.watched = True

    async def self_test() -> tuple[Message, ...]:
        await asyncio.sleep(0.3)
        return ()

    bench.self_test = self_test

    bench.machine.set_offset(Z_um=-20.0)  # left by a loop that was killed
    bench.machine.heard_s += left_s - WATCHDOG_S
    loop = bench.loop()
    running = asyncio.ensure_future(loop.run(asyncio.Event(), cycles=30))
    await ask(loop, RequestKind.ENABLE)
    await running
    assert bench.machine.writes
    bench.assert_law()


async def test_a_source_that_hangs_up_to_its_deadline_is_held_for_and_the_loop_keeps_its_pace() -> (
    None
):
    bench = Rig(hold_input_s=10.0)
    bench.machine.watched = True

    async with bench.running() as loop:
        await enabled_for(loop, 60.0)
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
    bench.assert_law()
    # the heartbeat never rests: a machine with a watchdog keeps its offset meanwhile
    assert max(b.at_s - a.at_s for a, b in pairwise(bench.machine.writes)) < WATCHDOG_S


# ---- the machine --------------------------------------------------------------------------------


async def test_a_lost_machine_is_held_then_faded_and_comes_back_without_a_step() -> None:
    bench = Rig()
    seen: list[SupervisorState] = []

    async with bench.running() as loop:
        loop.listeners.append(lambda status: seen.append(status.output.state))
        await enabled_for(loop, 100.0)
        bench.machine.lose()
        await asyncio.sleep(10.0)
        assert seen[-1] is SupervisorState.HOLDING
        await asyncio.sleep(15.0)
        assert seen[-1] is SupervisorState.FADING
        bench.machine.come_back(0.0)
        before = len(bench.machine.writes)
        await asyncio.sleep(2.0)
        assert seen[-1] is SupervisorState.ACTIVE
        assert abs(bench.machine.writes[before].after_um) <= RATE + ROUNDED_UM
        await asyncio.sleep(100.0)
        assert bench.machine.z_um == GOAL_UM
    bench.assert_law(late_cycles=1.0)


async def test_what_is_not_known_of_an_offset_is_none_and_what_is_known_has_its_age() -> None:
    bench = Rig()
    unknown = AgedOffset(None, None)
    async with bench.running() as loop:
        await asyncio.sleep(5.0)
        assert loop.status is not None
        stands = AgedOffset(0.0, 0.0)  # nothing was written, and it is read all the same
        assert loop.status.offsets["Z_um"][:4] == (unknown, stands, stands, stands)
        await enabled_for(loop, 100.0)
        acting = AgedOffset(GOAL_UM, 0.0)
        written = AgedOffset(NEAR_GOAL, 0.0)
        assert loop.status.offsets["Z_um"][:4] == (written, acting, acting, acting)
        assert loop.status.acting_known("Z_um")
        bench.machine.write_late_s = 0.2
        await asyncio.sleep(2.0)
        assert loop.status.offsets["Z_um"].commanded.age_s == pytest.approx(0.2)
        bench.machine.write_late_s = 0.0
        await asyncio.sleep(2.0)
        bench.machine.lose()
        await asyncio.sleep(10.0)
        left, last = AgedOffset(NEAR_GOAL, 10.0), AgedOffset(GOAL_UM, 10.0)
        assert loop.status.offsets["Z_um"][:4] == (left, unknown, unknown, last)
        assert not loop.status.acting_known("Z_um")


async def test_the_status_carries_why_the_machines_are_not_reached() -> None:
    bench, why = Rig(), Message("error-joint_not_homed", {"joints": ("2",)})
    async with bench.running() as loop:
        await asyncio.sleep(3.0)
        assert loop.status is not None
        assert (loop.status.source_reason, loop.status.sink_reason) == (None, None)
        loop.sink.failure = why
        await asyncio.sleep(3.0)
        assert (loop.status.source_reason, loop.status.sink_reason) == (None, why)
        assert await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(3.0)
        assert "write_refused" in alarms_of(loop)
        bench.machine.lose()
        await asyncio.sleep(3.0)
        lost = next(alarm for alarm in loop.status.alarms if alarm.code == "sink_lost")
        assert lost.values["reason"] == why
        loop.sink.failure = None
        await asyncio.sleep(3.0)
        loop.sink.failure = why
        await asyncio.sleep(3.0)
        bench.machine.come_back()
        loop.sink.failure = None
    told = [e.values for e in bench.said("connection") if e.code == "event-sink_reason"]
    assert told == [{"reason": why}], "once in a minute"


@pytest.mark.parametrize(
    ("faulty", "watched"),
    [({"refuses": True}, False), ({"refuses": True}, True), ({"obeys": False}, False)],
)
async def test_a_machine_that_does_not_obey_is_a_fault_until_it_is_acknowledged_and_costs_no_step(
    faulty: dict[str, bool], watched: bool
) -> None:
    bench = Rig()
    bench.machine.watched = watched

    async with bench.running() as loop:
        await enabled_for(loop, 40.0)
        for name, value in faulty.items():
            setattr(bench.machine, name, value)
        await asyncio.sleep(30.0)
        assert state_of(loop) is SupervisorState.FAULT
        assert loop.status is not None
        assert loop.status.output.reasons == (Reason.READ_BACK_DIFFERS,)
        assert not await ask(loop, RequestKind.ACKNOWLEDGE)
        stuck_um = bench.machine.z_um
        most_um = RATE + TOLERANCE_UM
        assert watched or abs(bench.machine.written[-1]["Z_um"] - stuck_um) <= most_um
        bench.machine.refuses, bench.machine.obeys = False, True
        await asyncio.sleep(0.5)
        assert abs(bench.machine.z_um - stuck_um) <= most_um
        await asyncio.sleep(4.5)
        assert await ask(loop, RequestKind.ACKNOWLEDGE)
        await asyncio.sleep(120.0)
        assert state_of(loop) is SupervisorState.OFF
        assert bench.machine.z_um == 0.0
        await enabled_for(loop, 30.0)
        assert state_of(loop) is SupervisorState.ACTIVE
    bench.assert_law(tolerance_um=TOLERANCE_UM)
    asked = [e.details["accepted"] for e in bench.said("request") if e.who == "Jana"]
    assert asked == [True, False, True, True]


async def test_an_acknowledge_is_answered_with_the_alarms_that_it_took_as_seen_and_no_other() -> (
    None
):
    bench = Rig()

    async def seen() -> list[str]:
        await asyncio.sleep(10.0)
        outcome = await loop.submit(Request(RequestKind.ACKNOWLEDGE, "Jana"))
        assert outcome.accepted
        said = outcome.values["alarms"] or ()
        assert isinstance(said, tuple)
        return [one.code.removeprefix("alarm-") for one in said if isinstance(one, Message)]

    async with bench.running() as loop:
        await enabled_for(loop, 40.0)
        bench.historian.told = HistorianStatus(storing=False, waiting=7)
        assert await seen() == []
        bench.machine.values["s"] = 60.0
        assert await seen() == ["sensor_bad"]
        bench.machine.values["s"] = 1000.0  # is right for nobody
        assert await seen() == []
        bench.machine.values["s"] = 60.0
        bench.machine.come_back(0.0)
        assert await seen() == ["offset_mismatch"]
        bench.machine.obeys = False
        await asyncio.sleep(30.0)
        bench.machine.obeys = True
        assert await seen() == ["fault_read_back_differs"]
    told = bench.said("request")[-2].text  # before the end of the loop
    assert told.endswith("taken as seen: The machine does not report the offset that was written.")


async def test_a_short_refusal_beside_a_watchdog_costs_no_step() -> None:
    bench = Rig()
    bench.machine.watched = True

    async with bench.running() as loop:
        await enabled_for(loop, 100.0)
        assert bench.machine.z_um == NEAR_GOAL
        bench.machine.refuses = True
        await asyncio.sleep(WATCHDOG_S + 3.0)
        assert bench.machine.z_um == 0.0
        bench.machine.refuses = False
        await asyncio.sleep(20.0)
        assert state_of(loop) is SupervisorState.ACTIVE
    bench.assert_law(tolerance_um=TOLERANCE_UM)


async def test_a_machine_that_takes_offsets_over_after_its_answer_is_moved_as_fast_as_allowed() -> (
    None
):
    class Slow(SimulatedMachine):
        def take(self, correction_um: Mapping[str, float]) -> None:
            asyncio.get_running_loop().call_later(0.2, super().take, correction_um)

    # more in a cycle than the read-back may differ
    bench = Rig(machine=Slow({"s": 23.0, "c": 20.0, **FLAGS}), limits=Limits(LARGEST, 2.0))
    async with bench.running() as loop:
        await enabled_for(loop, 6.0)
        begun_um = bench.machine.z_um
        await asyncio.sleep(10.0)
        assert bench.machine.z_um - begun_um == pytest.approx(-20.0, abs=0.01)


@pytest.mark.parametrize("beyond_um", [1e-9, 0.4, 0.6])
async def test_an_offset_found_at_the_limit_is_no_fault_for_a_rounding(beyond_um: float) -> None:
    bench = Rig()
    bench.machine.set_offset(Z_um=-LARGEST - beyond_um)

    async with bench.running() as loop:
        await asyncio.sleep(2.0)
        accepted = await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(8.0)
        assert accepted is (beyond_um <= TOLERANCE_UM)
        assert state_of(loop) is (SupervisorState.ACTIVE if accepted else SupervisorState.OFF)
    assert all(abs(w.after_um - w.before_um) <= RATE + beyond_um for w in bench.machine.writes)


async def test_the_diameter_that_the_machine_states_is_taken_over_and_recorded() -> None:
    bench = Rig()
    async with bench.running() as loop:
        bench.machine.values[DIAMETER] = 1500.0
        await asyncio.sleep(3.0)
        assert loop.status is not None
        assert loop.status.diameter_mm == 1500.0
        assert await ask(loop, RequestKind.DIAMETER, value=800.0)
        await asyncio.sleep(3.0)
        assert loop.status.diameter_mm == 800.0  # a person's word stands until the machine's moves
        for unusable in (None, -1.0):
            bench.machine.values[DIAMETER] = unusable
            await asyncio.sleep(3.0)
        assert loop.status.diameter_mm == 800.0
    told = [(e.who, e.details["value"], e.details["accepted"]) for e in bench.said("request")]
    assert told[:-1] == [
        ("the machine", 1500.0, True),
        ("Jana", 800.0, True),
        ("the machine", -1.0, False),
    ]


# ---- people -------------------------------------------------------------------------------------


async def test_another_model_takes_over_without_a_bump_and_a_wrong_one_is_refused() -> None:
    bench = Rig()
    async with bench.running() as loop:
        await enabled_for(loop, 100.0)
        for name in ("outside.json", "other-output.json"):
            assert not await ask(loop, RequestKind.MODEL, text=name)
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
        assert bench.machine.z_um == pytest.approx(-27.0, abs=0.01)
    bench.assert_law(late_cycles=1.0)
    assert {record.channels for record in bench.historian.records} == {("s", "c")}
    told = [(e.who, e.details["text"], e.details["accepted"]) for e in bench.said("request")]
    assert told[1:4] == [
        ("Jana", "outside.json", False),
        ("Jana", "other-output.json", False),
        ("Jana", "new.json", True),
    ]
    assert "the model gives X; the machine needs Z" in bench.said("request")[2].text


async def test_an_equal_model_that_takes_over_changes_nothing() -> None:
    bench = Rig(rise_s=300.0)
    async with bench.running() as loop:
        await enabled_for(loop, 0.0)
        for k in range(1500):  # the machine warms up all the time
            bench.machine.values["s"] = 20.0 + 0.002 * k
            await asyncio.sleep(1.0)
        assert loop.status is not None
        before = loop.status.output.model_um[0]
        assert before > 15.0
        assert await ask(loop, RequestKind.MODEL, text="copy.json")
        await asyncio.sleep(1.0)
        assert loop.status.model_file == "copy.json"
        assert abs(loop.status.output.model_um[0] - before) < 1.0  # the steady state is 36 um


async def test_a_trim_is_added_at_the_rate_and_expires_by_itself() -> None:
    bench = Rig()
    async with bench.running() as loop:
        await enabled_for(loop, 100.0)
        assert not await ask(loop, RequestKind.TRIM, output="Z_um", value=5.1, duration_s=60.0)
        assert not await ask(loop, RequestKind.TRIM, output="Z_um", value=1.0)
        assert not await ask(loop, RequestKind.TRIM, output="Q_um", value=1.0, duration_s=60.0)
        assert await ask(loop, RequestKind.TRIM, output="Z_um", value=4.0, duration_s=60.0)
        await asyncio.sleep(30.0)
        assert bench.machine.z_um == pytest.approx(-32.0, abs=0.01)
        assert loop.status is not None
        assert loop.status.trim_owner == {"Z_um": "Jana"}
        assert loop.status.trim_left_s["Z_um"] == pytest.approx(30.0, abs=2.0)
        await asyncio.sleep(45.0)
        assert bench.machine.z_um == NEAR_GOAL
        assert loop.status.trim_owner == {"Z_um": ""}
    bench.assert_law(late_cycles=1.0)


async def test_what_cannot_be_meant_is_refused_once_and_recorded_as_it_can_be_shown() -> None:
    bench = Rig()
    numbers = (math.nan, math.inf, -math.inf)
    asked = [
        *((Request(RequestKind.TRIM, "a", "Z_um", x, 60.0), "number_not_finite") for x in numbers),
        *((Request(RequestKind.TRIM, "a", "Z_um", 1.0, x), "number_not_finite") for x in numbers),
        *((Request(RequestKind.DIAMETER, "a", value=x), "number_not_finite") for x in numbers),
        (Request(RequestKind.TRIM, "a", "\x1b[2J", 1.0, 60.0), "name_unusable"),
        (Request(RequestKind.TRIM, "a", "x" * 201, 1.0, 60.0), "name_unusable"),
        (Request(RequestKind.TRIM, "a", "", 1.0, 60.0), "unknown_output"),
        (Request(RequestKind.MODEL, "a", text="a\u202egpj.nosj"), "name_unusable"),
        (Request(RequestKind.MODEL, "a", text="outside.json"), "model_unusable"),
    ]
    async with bench.running() as loop:
        await asyncio.sleep(3.0)
        for request, code in asked:
            outcome = await loop.submit(request)
            assert (outcome.accepted, outcome.code) == (False, code), request
    told = [event.details for event in bench.said("request") if event.who == "a"]
    assert len(told) == len(asked)
    json.dumps(told, allow_nan=False)
    texts = [value for details in told for value in details.values() if isinstance(value, str)]
    assert all(text.isprintable() and len(text) <= 200 for text in texts)


async def test_nothing_is_taken_while_the_loop_ends_and_nobody_waits_for_ever() -> None:
    bench = Rig()
    answers: list[object] = []

    loop, stop = bench.loop(), asyncio.Event()
    running = asyncio.ensure_future(loop.run(stop))
    await enabled_for(loop, 60.0)
    stop.set()
    await asyncio.sleep(3.0)
    assert state_of(loop) is SupervisorState.FADING
    for kind in RequestKind:
        answer = await loop.submit(Request(kind, "Jana", text="new.json"))
        answers.append(answer.code)
    await running
    answers.append((await loop.submit(Request(RequestKind.ENABLE, "Jana"))).code)
    assert set(answers) == {LoopAnswer.ENDING}
    assert bench.machine.z_um == 0.0
    bench.assert_law(late_cycles=1.0)


async def test_a_model_that_is_still_read_when_the_loop_ends_is_refused() -> None:
    bench = Rig()

    loop, stop = bench.loop(), asyncio.Event()
    running = asyncio.ensure_future(loop.run(stop, cycles=3))
    asked = asyncio.ensure_future(loop.submit(Request(RequestKind.MODEL, "Jana", text="new.json")))
    loop._requests.closed = True
    # as it is when the loop ends while a thread reads the file
    answer = await asked
    assert not answer.accepted
    await running


async def test_a_self_test_that_fails_forbids_until_it_passes() -> None:
    bench = Rig()
    finding = Message("self_test-output_not_writable", {}, Place(key="output.Z_um"))
    findings: list[tuple[Message, ...]] = [(finding,), (replace(finding, values={"n": 2}),), ()]
    tested_s: list[float] = []

    async def self_test() -> tuple[Message, ...]:
        tested_s.append(asyncio.get_running_loop().time())
        await asyncio.sleep(0.3)
        if len(tested_s) == 3:
            raise ValueError("of a defect")
        return findings[min(len(tested_s), len(findings)) - 1]

    bench.self_test = self_test

    async with bench.running() as loop:
        assert await ask(loop, RequestKind.ENABLE)
        await asyncio.sleep(TESTED_EVERY_S + 3.0)
        assert state_of(loop) is SupervisorState.WARMING
        assert {w.after_um for w in bench.machine.writes} <= {0.0}
        assert loop.status is not None
        assert "self_test" in [alarm.code for alarm in loop.status.alarms]
        await asyncio.sleep(2.0 * TESTED_EVERY_S + 8.0)
        assert state_of(loop) is SupervisorState.ACTIVE
    assert len(tested_s) == 4
    assert min(b - a for a, b in pairwise(tested_s)) >= TESTED_EVERY_S
    alarms = [e.values for e in bench.said("alarm") if e.code == "event-self_test"]
    failed = Message("self_test-failed", {"cause": "ValueError: of a defect"})
    assert alarms == [{"finding": finding}, {"finding": failed}]
    assert "event-self_test_passed" in [e.code for e in bench.said("start")]
    bench.assert_law()


async def test_everything_that_happens_is_recorded_with_who_and_when() -> None:
    bench = Rig()
    async with bench.running() as loop:
        await enabled_for(loop, 30.0)
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

    def __init__(self, seed: int, *, watched: bool, cycle_s: float) -> None:
        self.chance = random.Random(seed)  # noqa: S311 - repeatable
        self.bench = Rig(cycle_s=cycle_s, hold_input_s=30.0, at_limit_s=120.0)
        self.bench.machine.watched = watched
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
        machine.refuses, machine.obeys = False, True
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

    async def on_another_writer(self) -> None:
        self.bench.machine.set_offset(Z_um=self.chance.uniform(-50.0, 50.0))

    async def on_refused(self) -> None:
        self.bench.machine.refuses = True

    async def on_deaf(self) -> None:
        self.bench.machine.obeys = False

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
        saved = self.bench.file.saved
        self.running.cancel()
        await asyncio.gather(self.running, return_exceptions=True)
        self.bench.file.saved = saved
        await asyncio.sleep(self.chance.choice((0.5, 2.0, 10.0)))
        self.bench.machine.generation += 1
        self.loop = self.bench.loop()
        self.running = asyncio.ensure_future(self.loop.run(asyncio.Event()))


@pytest.mark.parametrize(
    ("seed", "watched", "cycle_s"),
    [
        (0, False, 1.0),
        pytest.param(1, True, 1.0, marks=pytest.mark.proof),
        pytest.param(5, True, 0.25, marks=pytest.mark.proof),
    ],
)
def test_hours_of_faults_move_the_tool_never_faster_and_never_further_than_allowed(
    seed: int, watched: bool, cycle_s: float
) -> None:
    async def life() -> Chaos:
        chaos = Chaos(seed, watched=watched, cycle_s=cycle_s)
        await chaos.live(hours=1.0 if cycle_s == 1.0 else 0.5)
        return chaos

    chaos = run_in_virtual_time(life())
    bench = chaos.bench
    for write in bench.machine.writes:
        inward = abs(write.after_um) <= abs(write.before_um)
        assert inward or abs(write.after_um) <= LARGEST + ROUNDED_UM, write
    bench.assert_law(tolerance_um=TOLERANCE_UM)
    assert bench.states() == set(SupervisorState)
    assert len(chaos.happened) > 14
    travelled_um = sum(abs(w.after_um - w.before_um) for w in bench.machine.writes)
    assert travelled_um > 200.0
