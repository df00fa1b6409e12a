"""What a machine does to a compensation: stops, other workpieces, a weekend off.

Every error that is left is told: `settled` is never said while more than 1 um is missing. The
numbers are those that any other control with the same model and limits has to show.
"""

import asyncio
import json
import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest

from tests.unit.compensation import bench
from tests.unit.runtime import simulated
from tests.unit.runtime.status_server_parts import offsets, output, status
from thermaxis.compensation import (
    LONGEST_REST,
    SETTLED_UM,
    WITNESS_S,
    Compensation,
    CycleReading,
    GainPoint,
    Limits,
    Outcome,
    Output,
    Part,
    Request,
    RequestKind,
    Sample,
    SampleQuality,
    Section,
    SensorRules,
    SupervisorState,
    cycle,
    cycle_state,
)
from thermaxis.runtime.history import Columns
from thermaxis.runtime.status import Headlines, as_json

RATE_UM_PER_S = 0.3
LIMITS = Limits(150.0, RATE_UM_PER_S)
WARM_K = 5.0
HOUR_S = 3600.0


class Rig(bench.Rig):
    """A warm machine whose correction has settled; it keeps every cycle from then on."""

    def __init__(self, compensation: Compensation, warm_k: float = WARM_K) -> None:
        super().__init__(compensation)
        self.warmth_k = warm_k
        self.step(RequestKind.ENABLE, found_um=(0.0,))
        while not self.output.settled:
            self.step()
        self.seen = [self.output]

    def step(self, *requests: RequestKind | Request, seconds: float = 1.0, **changes: Any) -> Any:
        output = super().step(*requests, seconds=seconds, **changes)
        if hasattr(self, "seen"):
            self.seen.append(output)
        return output

    def until_settled(self) -> float:
        """Return for how long the error is above 1 um from now on until it has settled. [s]"""
        left_s = 0.0
        while not self.step().settled:
            left_s += self.output.to_go_um[0] > SETTLED_UM
        return left_s

    def assert_nothing_unreported(self) -> None:
        for one in self.seen:
            assert one.to_go_um == (abs(one.wanted_um[0] - one.correction_um[0]),)
            assert not one.settled or one.to_go_um[0] <= SETTLED_UM
        for a, b in pairwise(self.seen):
            moved_um = abs(b.correction_um[0] - a.correction_um[0])
            assert moved_um <= RATE_UM_PER_S * b.elapsed_s + 1e-9


def lathe(part: Part | None = None, **options: Any) -> Compensation:
    return bench.lathe(LIMITS, part or Part("s", "s", "", 14.0), **options)


@pytest.mark.parametrize(("hold_s", "stands_um", "left_s"), [(0.0, 0.0, 231), (600.0, -70.0, 0)])
def test_after_an_emergency_stop_it_has_not_settled_until_it_is_back(
    hold_s: float, stands_um: float, left_s: float
) -> None:
    rig = Rig(lathe(hold_interlock_s=hold_s))
    assert rig.um == pytest.approx(-70.0, abs=SETTLED_UM)
    rig.steps(10)
    rig.steps(300, interlocks=(False,))
    assert rig.um == pytest.approx(stands_um, abs=1e-9)
    assert not any(one.settled for one in rig.seen[-300:])
    assert rig.until_settled() == pytest.approx(left_s, abs=2.0)
    rig.assert_nothing_unreported()


def test_a_hold_at_an_emergency_stop_ends_and_fades() -> None:
    rig = Rig(lathe(hold_interlock_s=600.0)).steps(10)
    rig.steps(600, interlocks=(False,))
    assert (rig.now, rig.um) == (SupervisorState.HOLDING, pytest.approx(-70.0))
    rig.steps(1 + 240, interlocks=(False,))
    assert (rig.now, rig.um) == (SupervisorState.WARMING, 0.0)


def test_another_workpiece_has_not_settled_until_the_correction_is_there() -> None:
    gains = (GainPoint(0.0, 1.0), GainPoint(3000.0, 0.45))
    rig = Rig(lathe(Part("s", "s", "", 14.0, gain_by_diameter=gains)))
    rig.step(Request(RequestKind.DIAMETER, "me", value=0.0))
    rig.until_settled()
    rig.step(Request(RequestKind.DIAMETER, "me", value=3000.0))
    assert rig.output.to_go_um[0] == pytest.approx(38.5, abs=SETTLED_UM)
    assert rig.until_settled() == pytest.approx(124.0, abs=2.0)
    rig.assert_nothing_unreported()


def test_settled_is_told_neither_at_a_limit_nor_held_nor_while_the_machine_does_not_follow() -> (
    None
):
    rig = Rig(lathe(at_limit_s=600.0))
    assert not rig.step(read_back_um=(rig.um + 3.0,)).settled
    assert rig.step().settled
    assert not rig.step(RequestKind.HOLD).settled
    rig.step(RequestKind.RESUME)
    assert rig.until_settled() == 0
    rig.warmth_k = 10.72  # asks for 150.08 um
    rig.steps(400)
    assert (rig.now, rig.output.at_limit) == (SupervisorState.ACTIVE, (True,))
    assert rig.output.to_go_um == (0.0,)
    assert not rig.output.settled
    rig.assert_nothing_unreported()


def test_what_a_deadband_keeps_away_has_settled() -> None:
    rig = Rig(bench.lathe(Limits(150.0, RATE_UM_PER_S, deadband_um=5.0), Part("s", "s", "", 14.0)))
    rig.steps(60)
    rig.warmth_k += 4.5 / 14.0
    assert (rig.step().settled, rig.output.to_go_um) == (True, (pytest.approx(4.5),))


def test_the_headline_says_on_its_way_as_long_as_an_active_one_has_not_settled() -> None:
    rig, seen = simulated.Rig(), []

    async def stops(rig: simulated.Rig, loop: Any) -> None:
        loop.listeners.append(seen.append)
        await simulated.enabled_for(loop, 200.0)
        rig.machine.values["interlock.referenced"] = 0.0
        await asyncio.sleep(100.0)
        rig.machine.values["interlock.referenced"] = 1.0
        await asyncio.sleep(100.0)

    rig.play(stops)
    headlines = Headlines()
    said = {(one.output.state, one.settled, headlines.headline_of(one)[0].code) for one in seen}
    assert {one for one in said if one[0] is SupervisorState.ACTIVE} == {
        (SupervisorState.ACTIVE, False, "headline-on_its_way"),
        (SupervisorState.ACTIVE, True, "headline-active"),
    }
    assert {state for state, settled, _ in said if settled} == {SupervisorState.ACTIVE}


def test_a_status_is_settled_only_where_what_acts_is_there() -> None:
    there = status(output=output()._replace(settled=True))  # wants -13.0
    assert there.settled
    for far in (offsets(-13.0, -13.0, -11.9), offsets(-13.0, -13.0, -13.0, age_s=60.0)):
        assert not replace(there, offsets={"Z_um": far}).settled
    assert not replace(there, offsets={}).settled
    assert not replace(there, output=output()).settled


# ---- a weekend off ---------------------------------------------------------------------------

SLOW = Part("s", "s", "", 0.0, (Section(15.0, 3.0 * HOUR_S),))


@pytest.mark.parametrize("found_um", [None, -112.5, 0.0])
def test_after_a_weekend_off_it_starts_anew_where_the_cold_machine_is(
    found_um: float | None,
) -> None:
    rig = Rig(lathe(SLOW, longest_gap_s=HOUR_S), warm_k=7.5).steps(10)
    assert rig.um == pytest.approx(-112.5)
    rig.warmth_k = 2.6 / 15.0
    rig.step(seconds=64 * HOUR_S, found_um=None if found_um is None else (found_um,))
    assert Outcome.GAP in rig.output.outcomes
    assert rig.output.wanted_um == (pytest.approx(-2.6),), "the settled value, not the old one"
    stood_um = -112.5 if found_um is None else found_um
    assert (rig.now, rig.um) == (SupervisorState.HOLDING, pytest.approx(stood_um))
    before = len(rig.seen)
    left_s = rig.until_settled()
    settle_s = rig.compensation.supervisor.settle_s
    assert left_s <= settle_s + abs(stood_um + 2.6) / RATE_UM_PER_S + 1.0
    rig.steps(10)
    assert rig.um == pytest.approx(-2.6)
    away_um = [abs(one.correction_um[0] + 2.6) for one in rig.seen[before:]]
    assert away_um == sorted(away_um, reverse=True), "it goes there straight"
    rig.assert_nothing_unreported()


def test_after_a_break_within_the_longest_gap_the_model_goes_on() -> None:
    rig = Rig(lathe(SLOW, longest_gap_s=HOUR_S), warm_k=7.5).steps(10)
    rig.warmth_k = 2.5
    rig.step(seconds=HOUR_S)
    assert Outcome.GAP not in rig.output.outcomes
    assert rig.output.wanted_um == (pytest.approx(-112.5),), "the input before the break acted"
    rig.step(seconds=HOUR_S)
    assert rig.output.wanted_um == (pytest.approx(-37.5 - 75.0 * 0.7165313105737893),)


def test_a_value_stands_only_while_somebody_sees_it() -> None:
    rig = Rig(lathe(SLOW, longest_gap_s=HOUR_S))
    rig.warmth_k -= 0.1
    rig.steps(1 + 2, seconds=HOUR_S)
    rig.step(seconds=64 * HOUR_S)
    assert rig.output.qualities == (SampleQuality.GOOD,), "the same 0.1 K as on Friday"
    rig.steps(2, seconds=HOUR_S)
    assert rig.output.qualities == (SampleQuality.GOOD,)
    assert rig.step().qualities == (SampleQuality.FROZEN,), "four hours that were seen"


def test_an_offset_of_yesterday_that_nobody_commands_is_told() -> None:
    rig = simulated.Rig()
    rig.machine.set_offset(Z_um=-40.0)

    async def look(_: simulated.Rig, loop: Any) -> None:
        await asyncio.sleep(30.0)
        assert simulated.state_of(loop) is SupervisorState.OFF
        assert "standing_offset" in simulated.alarms_of(loop)
        told = json.loads(as_json(loop.status))
        axis = told["outputs"]["Z_um"]
        assert (told["settled"], axis["acting_um"]) == (False, -40.0)
        assert axis["to_go_um"] == pytest.approx(abs(axis["wanted_um"] + 40.0))

    rig.play(look)
    assert rig.machine.z_um == -40.0, "a compensation that is off moves nothing"


# ---- a sensor of 0.1 K in an air-conditioned hall ----------------------------------------------

FROZEN_S = SensorRules(lowest_c=1.0, highest_c=60.0).frozen_s


def hall(**witness: Any) -> Compensation:
    """Return a compensation whose column may stand while the air around it does."""
    parts = (Part("s", "s", "", 14.0), Part("c", "c", "", -3.0))
    rules = SensorRules(lowest_c=1.0, highest_c=60.0, step_k=50.0)
    plain = bench.lathe(LIMITS)
    model = replace(
        plain.model,
        outputs=(Output("Z_um", parts),),
        reference_c={"s": 20.0, "c": 20.0},
    )
    sensors = {"s": rules, "c": replace(rules, **witness)}
    sensors |= {"room": rules} if witness else {}
    return replace(plain, model=model, sensors=sensors)


def first_frozen_s(compensation: Compensation, room_c: Any, hours: float) -> float:
    """Return when a column that stands at 20 degC is called frozen; the spindle flickers. [s]"""
    state = cycle_state(compensation)
    for i in range(int(hours * 60.0)):
        samples = (Sample(25.0 + 0.1 * (i % 2)), Sample(20.0), Sample(room_c(i / 60.0)))
        state, output = cycle(
            compensation, state, CycleReading(60.0 * i, samples[: len(state.sensors)])
        )
        if output.qualities[1] is SampleQuality.FROZEN:
            return 60.0 * i
        assert output.qualities[0] is SampleQuality.GOOD
    return float("inf")


def test_a_column_of_coarse_steps_is_not_called_frozen_for_a_day_while_the_air_hardly_moves() -> (
    None
):
    rests, alone = hall(moves_with="room", rests_k=0.8), hall()

    def controlled(hour: float) -> float:
        return round(20.0 + 0.3 * math.sin(2.0 * math.pi * 3.0 * hour), 1)

    assert first_frozen_s(alone, controlled, 24.0) == FROZEN_S + 60.0
    assert first_frozen_s(rests, controlled, 72.0) == LONGEST_REST * FROZEN_S + 60.0


@pytest.mark.parametrize("begins_h", [0.0, 2.0, 3.9, 9.0])
def test_a_stuck_column_is_noticed_when_the_air_has_moved_and_no_later_than_without(
    begins_h: float,
) -> None:
    rests, alone = hall(moves_with="room", rests_k=0.8), hall()

    def warms(hour: float) -> float:
        return round(20.0 + 1.0 * max(0.0, hour - begins_h), 1)

    found_s = first_frozen_s(rests, warms, 24.0)
    gone_s = WITNESS_S + 3600.0 * (begins_h + 0.8)
    assert found_s <= max(first_frozen_s(alone, warms, 24.0), gone_s)


def test_a_redundant_column_may_stand_as_the_first_one_may() -> None:
    compensation = replace(hall(moves_with="room", rests_k=0.8), redundant=frozenset({"c"}))
    state = cycle_state(compensation)
    for i in range(6 * 60):
        samples = (Sample(25.0 + 0.1 * (i % 2)), Sample(None), Sample(flickers(i / 60.0)))
        reading = CycleReading(60.0 * i, samples, (None, Sample(20.0)))
        state, output = cycle(compensation, state, reading)
    assert output.qualities[1] is SampleQuality.REDUNDANT


def test_a_lost_witness_that_the_model_does_without_is_told_and_stops_nothing() -> None:
    rig, columns = simulated.Rig(), Columns()
    rules = rig.compensation.sensors["c"]
    rests = {"c": replace(rules, moves_with="room", rests_k=1.0), "room": rules}
    rig.compensation = replace(rig.compensation, sensors={**rig.compensation.sensors, **rests})
    rig.machine.values["room"] = None

    async def look(_: simulated.Rig, loop: Any) -> None:
        await simulated.enabled_for(loop, 200.0)
        assert simulated.state_of(loop) is SupervisorState.ACTIVE
        assert simulated.alarms_of(loop) == {"witness_bad"}

    rig.play(look)
    columns.outputs = ("Z_um",)
    row = columns.row_of(rig.historian.records[-1]).values()
    assert (row["c_quality"], row["room"]) == ("good", None)


def flickers(hour: float) -> float:
    return 20.0 + 0.1 * (hour % 0.5 > 0.2)


def test_all_that_stand_together_are_frozen_as_ever_and_a_lost_witness_says_nothing() -> None:
    rests = hall(moves_with="room", rests_k=0.8)
    assert first_frozen_s(rests, lambda _: 20.0, 24.0) <= FROZEN_S + 120.0, "a cycle after the air"
    for wrong_c in (None, 99.0):
        lost_s = first_frozen_s(rests, lambda h, c=wrong_c: flickers(h) if h < 6.0 else c, 24.0)
        assert 6.0 * HOUR_S < lost_s <= 6.0 * HOUR_S + WITNESS_S, wrong_c
        early_s = first_frozen_s(rests, lambda h, c=wrong_c: flickers(h) if h < 3.0 else c, 24.0)
        assert early_s == FROZEN_S + 60.0, "not before its own time"
    pauses = first_frozen_s(rests, lambda h: None if 6.0 < h < 6.5 else flickers(h), 23.0)
    assert pauses == math.inf, "a lively one may be unread for a while"
