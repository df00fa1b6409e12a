"""What a machine does to a block in a PLC: power off with retained data, stops, old offsets.

The numbers are those of the same scenarios on the computer, in `test_left_and_taken_up`.
"""

import math
from collections.abc import Callable
from typing import Any

import pytest

from tests.scenarios.test_left_and_taken_up import first_frozen_s, flickers, hall
from tests.unit.compensation import bench
from tests.unit.plc.compiled import Compiled
from tests.unit.plc.plc_scenarios import quiet_inputs
from thermaxis.compensation import (
    LONGEST_REST,
    SETTLED_UM,
    Compensation,
    Limits,
    Outcome,
    Part,
    SampleQuality,
    Section,
    SensorRules,
    SupervisorState,
)
from thermaxis.plc import Block, export_settings

RATE_UM_PER_S = 0.3
LIMITS = Limits(150.0, RATE_UM_PER_S)
HOUR_S = 3600.0
OFF, WARMING, ACTIVE, HOLDING = (
    list(SupervisorState).index(SupervisorState(name))
    for name in ("Off", "Warming", "Active", "Holding")
)
GAP, CLOCK = (2 ** list(Outcome).index(one) for one in (Outcome.GAP, Outcome.CLOCK_UNUSABLE))
PLAIN = Part("s", "s", "", 14.0)
SLOW = Part("s", "s", "", 0.0, (Section(15.0, 3.0 * HOUR_S),))


class Rig:
    """A block in a warm machine; the control reports what was written. It may be switched off."""

    def __init__(self, compensation: Compensation, warm_k: float, language: str) -> None:
        self.settings = export_settings(compensation, cycle_s=1.0, name="axis")
        self.block = Compiled(Block(settings=self.settings), language=language)
        self.warmth_k, self.offset_um = warm_k, 0.0
        self.step(enable=False)
        while not self.block.settled:
            self.step()

    def step(self, **told: Any) -> Compiled:
        before_um = self.offset_um
        quiet = quiet_inputs(self.settings, [20.0 + self.warmth_k], (before_um,))
        self.block.tell(quiet | {"init": False} | told)
        if self.block.linked and self.block.state != OFF:
            self.offset_um = self.block.correction_z_um
            most_um = RATE_UM_PER_S + 1e-9
            assert abs(self.offset_um - before_um) <= most_um, "no call moves more than the rate"
        assert not self.block.settled or self.block.to_go_z_um <= SETTLED_UM
        return self.block

    def steps(self, count: int, **told: Any) -> None:
        for _ in range(count):
            self.step(**told)

    def until_settled(self) -> float:
        """Return for how long the error is above 1 um from now on until it has settled. [s]"""
        left_s = 0.0
        while not self.step().settled:
            left_s += self.block.to_go_z_um > SETTLED_UM
        return left_s


both = pytest.mark.parametrize("language", ["st", "c"])


def weekend(language: str) -> Rig:
    """Return a machine that was warm on Friday, with retained data, and is cold on Monday."""
    rig = Rig(bench.lathe(LIMITS, SLOW, longest_gap_s=HOUR_S), 7.5, language)
    rig.until_settled()
    rig.steps(10)
    assert rig.offset_um == pytest.approx(-112.5)
    rig.warmth_k = 2.6 / 15.0
    return rig


@both
@pytest.mark.parametrize("stands_um", [-112.5, 0.0])
def test_in_the_first_scan_after_a_weekend_it_begins_anew_and_waits_for_somebody_to_enable_it(
    language: str, stands_um: float
) -> None:
    rig = weekend(language)
    rig.offset_um = stands_um
    said = rig.step(init=True)
    assert (said.state, said.enabled, said.heartbeat) == (OFF, False, 1)
    assert said.wanted_z_um == pytest.approx(-2.6), "not the -112.5 um of Friday"
    assert (said.correction_z_um, said.standing) == (stands_um, stands_um != 0.0)
    rig.steps(100)
    assert (said.state, rig.offset_um) == (OFF, stands_um), "a level asks for nothing"
    rig.step(enable=False)
    away_um = []
    while not rig.step().settled:
        away_um.append(abs(said.correction_z_um + 2.6))
    assert away_um == sorted(away_um, reverse=True), "it goes there straight"
    rig.steps(10)
    assert (said.state, rig.offset_um) == (ACTIVE, pytest.approx(-2.6))


@both
@pytest.mark.parametrize("stands_um", [-112.5, 0.0])
def test_without_a_first_scan_it_finds_the_gap_itself_as_the_cycle_does(
    language: str, stands_um: float
) -> None:
    rig = weekend(language)
    rig.offset_um = stands_um
    said = rig.step(cycle_time_s=64 * HOUR_S)
    assert said.outcome_word == GAP
    assert (said.state, said.enabled) == (HOLDING, True)
    assert said.wanted_z_um == pytest.approx(-2.6)
    assert said.correction_z_um == pytest.approx(stands_um), "what was read is taken over"
    settle_s = rig.settings.compensation.supervisor.settle_s
    assert rig.until_settled() <= settle_s + abs(stands_um + 2.6) / RATE_UM_PER_S + 1.0
    rig.steps(10)
    assert rig.offset_um == pytest.approx(-2.6)


LAG = Part("s", "s", "", 0.0, (Section(15.0, HOUR_S),))
JUMPS = SensorRules(lowest_c=1.0, highest_c=60.0, step_k=1.0)


def risen_um(seconds: float, from_um: float = 0.0, to_um: float = 49.5) -> float:
    """Return what the lag says so long after a step of its input. [um]"""
    return to_um + (from_um - to_um) * math.exp(-seconds / HOUR_S)


@both
def test_a_call_that_comes_very_late_is_made_up_for_and_nothing_has_settled_until_then(
    language: str,
) -> None:
    rig = Rig(bench.lathe(LIMITS, LAG, longest_gap_s=HOUR_S), 0.0, language)
    rig.warmth_k = 3.3
    rig.steps(1 + 600)
    said = rig.step(cycle_time_s=3000.0)
    assert (said.outcome_word, said.settled) == (CLOCK, False)
    assert said.model_z_um == pytest.approx(risen_um(600.0))
    calls = 0
    while rig.step().outcome_word == CLOCK:
        calls += 1
        assert (said.state, said.settled) == (ACTIVE, False)
    assert calls == 3000 // 9, "nine cycles more than one in a call"
    assert said.model_z_um == pytest.approx(risen_um(600.0 + 3000.0 + calls + 1))
    rig.until_settled()
    assert said.state == ACTIVE


@both
def test_after_a_jump_in_a_late_call_the_time_is_made_up_for_once_the_value_is_believed(
    language: str,
) -> None:
    rig = Rig(bench.lathe(LIMITS, LAG, longest_gap_s=HOUR_S, sensor=JUMPS), 0.0, language)
    for _ in range(66):
        rig.warmth_k += 0.1
        rig.step()
    rig.steps(6 * 3600)
    warm_um = rig.block.model_z_um
    rig.warmth_k = -2.9
    said = rig.step(cycle_time_s=3000.0)
    rig.steps(60)
    assert said.model_z_um == pytest.approx(warm_um, abs=0.5), "nothing is believed"
    rig.step(reset=True)
    calls = 0
    while rig.step().outcome_word == CLOCK:
        calls += 1
        assert not said.settled
    cold_um = risen_um(3000.0 + calls, warm_um, -43.5)
    assert said.model_z_um == pytest.approx(cold_um, abs=0.5), "but for nine cycles before"


@both
def test_a_task_of_which_every_third_call_is_late_leaves_the_model_no_cycle_behind(
    language: str,
) -> None:
    rig = Rig(bench.lathe(LIMITS, LAG, longest_gap_s=HOUR_S), 0.0, language)
    rig.warmth_k = 3.3
    rig.step()
    for _ in range(300):
        rig.steps(2)
        rig.step(cycle_time_s=1.15)
    rig.step()
    assert rig.block.model_z_um == pytest.approx(risen_um(946.0), abs=risen_um(1.0))


@both
def test_an_offset_of_yesterday_that_nobody_commands_is_told_until_it_is_gone(
    language: str,
) -> None:
    rig = Rig(bench.lathe(LIMITS, PLAIN), 5.0, language)
    rig.offset_um = -40.0
    said = rig.step(init=True)
    rig.steps(300)
    assert (said.state, said.standing, rig.offset_um) == (OFF, True, -40.0)
    rig.offset_um = -0.5
    assert not rig.step().standing, "no more than the tolerance of the read-back"
    rig.offset_um = -40.0
    assert rig.step(enable=False).standing
    assert not rig.step().standing, "somebody commands it"
    assert said.state == WARMING


@both
@pytest.mark.parametrize(("hold_s", "stands_um", "left_s"), [(0.0, 0.0, 231), (600.0, -70.0, 0)])
def test_after_an_emergency_stop_it_has_not_settled_until_it_is_back(
    language: str, hold_s: float, stands_um: float, left_s: float
) -> None:
    rig = Rig(bench.lathe(LIMITS, PLAIN, hold_interlock_s=hold_s), 5.0, language)
    rig.steps(10)
    for _ in range(300):
        assert not rig.step(interlocks_met=False).settled
    assert rig.offset_um == pytest.approx(stands_um, abs=1e-9)
    assert rig.until_settled() == pytest.approx(left_s, abs=2.0)


@both
def test_a_hold_at_an_emergency_stop_ends_and_fades(language: str) -> None:
    rig = Rig(bench.lathe(LIMITS, PLAIN, hold_interlock_s=600.0), 5.0, language)
    rig.steps(10)
    rig.steps(600, interlocks_met=False)
    assert (rig.block.state, rig.offset_um) == (HOLDING, pytest.approx(-70.0))
    rig.steps(1 + 240, interlocks_met=False)
    assert (rig.block.state, rig.offset_um) == (WARMING, 0.0)


# ---- a sensor of 0.1 K in an air-conditioned hall ----------------------------------------------


def warms(hour: float) -> float:
    return flickers(hour) + max(0.0, hour - 9.0)


def controlled(hour: float) -> float:
    return round(20.0 + 0.3 * math.sin(2.0 * math.pi * 3.0 * hour), 1)


def lost(hour: float) -> float:
    return flickers(hour) if hour < 6.0 else math.nan


@pytest.mark.parametrize(("language", "double"), [("st", True), ("c", True), ("c", False)])
@pytest.mark.parametrize(
    ("room_c", "witness"),
    [
        (controlled, {}),
        *((air, {"moves_with": "room", "rests_k": 0.8}) for air in (controlled, warms, lost)),
    ],
)
def test_a_column_that_stands_is_called_frozen_when_the_cycle_calls_it_so(
    language: str, double: bool, room_c: Callable[[float], float], witness: dict[str, Any]
) -> None:
    compensation = hall(**witness)
    settings = export_settings(compensation, cycle_s=60.0, name="hall", double=double)
    block = Compiled(Block(settings=settings), language=language)
    frozen = list(SampleQuality).index(SampleQuality.FROZEN)
    found_s = math.inf
    for i in range(26 * 60):
        temperatures = [25.0 + 0.1 * (i % 2), 20.0, room_c(i / 60.0)][: len(compensation.judged)]
        block.tell(quiet_inputs(settings, temperatures, (0.0,)) | {"enable": False})
        assert block.quality_s == 0
        if block.quality_c == frozen:
            found_s = 60.0 * i
            break
    assert found_s == first_frozen_s(compensation, room_c, 26.0)
    longest_s = compensation.sensors["c"].frozen_s * (LONGEST_REST if witness else 1.0)
    assert found_s <= longest_s + 60.0
