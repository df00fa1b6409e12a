"""The machine's side of the offset: clamp, rate, watchdog, interlocks; and the tool follows."""

import math

import pytest
from hypothesis import given, strategies as st

from tests.refusals import refused
from thermaxis.errors import ConfigurationError
from thermaxis.virtual import (
    Fault,
    FaultKind,
    LatheSettings,
    OffsetRules,
    Scenario,
    Stage,
    VirtualLathe,
)
from thermaxis.virtual.lathe._axis import OffsetAxis

FREE = OffsetRules(watchdog_s=None)


def lathe_that_rests(rules: OffsetRules = FREE, faults: tuple[Fault, ...] = ()) -> VirtualLathe:
    rest = Scenario("rest", "nothing", (Stage(86_400.0),))
    return VirtualLathe(rest, 1, LatheSettings(offset=rules), faults)


def go(axis: OffsetAxis, seconds: float, *, moves: bool = True, permitted: bool = True) -> None:
    axis.step(seconds, moves=moves, permitted=permitted, own_goal_um=0.0)


def test_a_written_offset_moves_the_tool_point_away_at_every_position() -> None:
    lathe = lathe_that_rests()
    assert lathe.write_offset(0.02)
    lathe.step(5.0)
    assert lathe.true_um - lathe.uncorrected_um == pytest.approx([10.0] * 4)
    lathe.step(5.0)
    assert lathe.true_um - lathe.uncorrected_um == pytest.approx([20.0] * 4)
    lathe.step(100.0)
    assert lathe.true_um - lathe.uncorrected_um == pytest.approx([20.0] * 4)
    shown = lathe.readings()
    assert shown["offset_mm"].value == 0.02
    assert shown["offset_effective_mm"].value == pytest.approx(0.02)
    assert shown["Z_true_um"].value == pytest.approx(lathe.true_um[0])


def test_the_offset_does_not_change_the_physics() -> None:
    one, other = lathe_that_rests(), lathe_that_rests()
    one.write_offset(0.3)
    one.step(3600.0)
    other.step(3600.0)
    assert one.uncorrected_um == pytest.approx(other.uncorrected_um, abs=1e-12)


written = st.lists(
    st.tuples(
        st.floats(-2.0, 2.0) | st.just(math.nan) | st.just(math.inf),
        st.integers(0, 3),
        st.floats(0.0, 30.0),
        st.booleans(),
        st.booleans(),
    ),
    max_size=40,
)


@given(moments=written, watchdog=st.none() | st.floats(0.5, 10.0))
def test_clamp_and_rate_are_never_passed(
    moments: list[tuple[float, int, float, bool, bool]], watchdog: float | None
) -> None:
    axis = OffsetAxis(OffsetRules(largest_um=120.0, rate_um_per_s=1.5, watchdog_s=watchdog))
    for offset_mm, beat, seconds, moves, permitted in moments:
        axis.write_offset(offset_mm)
        axis.write_heartbeat(beat)
        before = axis.effective_um
        go(axis, seconds, moves=moves, permitted=permitted)
        assert abs(axis.effective_um) <= 120.0
        assert abs(axis.effective_um - before) <= 1.5 * seconds + 1e-9
        assert moves or axis.effective_um == before
        assert abs(axis.accepted_um) <= 120.0


@given(goal=st.floats(-0.4, 0.4), cuts=st.lists(st.floats(0.01, 50.0), min_size=1, max_size=20))
def test_an_allowed_goal_is_reached_as_fast_as_the_rate_allows(
    goal: float, cuts: list[float]
) -> None:
    axis = OffsetAxis(FREE)
    axis.write_offset(goal)
    for seconds in cuts:
        go(axis, seconds)
    expected = math.copysign(min(abs(1e3 * goal), 2.0 * sum(cuts)), goal)
    assert axis.effective_um == pytest.approx(expected)


@given(cuts=st.lists(st.floats(0.01, 3.0), min_size=1, max_size=12))
def test_the_watchdog_acts_at_its_moment_however_the_time_is_divided(cuts: list[float]) -> None:
    axis, whole = (OffsetAxis(OffsetRules(rate_um_per_s=10.0)) for _ in range(2))
    for each in (axis, whole):
        each.write_offset(0.1)
        each.write_heartbeat(1)
    for seconds in cuts:
        go(axis, seconds)
    go(whole, sum(cuts))
    assert axis.effective_um == pytest.approx(whole.effective_um)


def test_without_a_moved_heartbeat_the_offset_goes_back_to_zero() -> None:
    axis = OffsetAxis(OffsetRules())
    axis.write_offset(0.01)
    go(axis, 10.0)
    assert axis.effective_um == 0.0  # nobody has ever beaten
    for beat in range(1, 11):
        axis.write_heartbeat(beat)
        go(axis, 1.0)
    assert axis.effective_um == pytest.approx(10.0)
    for _ in range(4):
        axis.write_heartbeat(10)  # the same number is no beat
        go(axis, 1.0)
    assert not axis.alive
    # the last beat was 1 s old: one second more at the goal, three seconds back at 2 um/s
    assert axis.effective_um == pytest.approx(4.0)
    go(axis, 10.0)
    assert axis.effective_um == 0.0
    assert axis.accepted_um == pytest.approx(10.0)
    axis.write_heartbeat(11)
    go(axis, 1.0)
    assert axis.alive
    assert axis.effective_um == pytest.approx(2.0)


def test_a_machine_served_faster_counts_the_watchdog_in_real_time() -> None:
    axis = OffsetAxis(OffsetRules())
    axis.speed = 60.0
    axis.write_heartbeat(1)
    go(axis, 119.0)
    assert axis.alive
    go(axis, 2.0)
    assert not axis.alive


def test_the_watchdog_goes_on_counting_where_the_machine_is_served_faster_or_slower() -> None:
    axis = OffsetAxis(OffsetRules(watchdog_s=10.0))
    axis.speed = 60.0
    axis.write_heartbeat(1)
    go(axis, 300.0)
    axis.speed = 1.0
    go(axis, 4.9)
    assert axis.alive
    go(axis, 0.2)
    assert not axis.alive


def test_the_heartbeat_goes_round_at_32_bits() -> None:
    axis = OffsetAxis(OffsetRules())
    axis.write_heartbeat(2**32 - 1)
    go(axis, 1.5)
    axis.write_heartbeat(2**32)
    assert axis.heartbeat == 0
    go(axis, 1.5)
    assert axis.alive


def test_what_is_no_number_is_not_taken() -> None:
    lathe = lathe_that_rests()
    lathe.write_offset(0.005)
    for wrong in (math.nan, math.inf, -math.inf):
        assert not lathe.write_offset(wrong)
    assert lathe.axis.written_mm == 0.005
    lathe.step(60.0)
    assert lathe.axis.effective_um == pytest.approx(5.0)


def test_too_large_an_offset_is_clamped_and_said() -> None:
    lathe = lathe_that_rests()
    lathe.write_offset(-3.0)
    shown = lathe.readings()
    assert shown["offset_mm"].value == -3.0
    assert shown["offset_accepted_mm"].value == pytest.approx(-0.4)


def test_without_a_reference_the_offset_goes_to_zero_and_with_drives_off_it_stays() -> None:
    lathe = lathe_that_rests()
    lathe.write_offset(0.02)
    lathe.step(60.0)
    lathe.set_flag("machine_on", value=False)
    lathe.step(60.0)
    assert lathe.axis.effective_um == pytest.approx(20.0)
    lathe.set_flag("machine_on", value=None)
    lathe.set_flag("homing", value=True)
    lathe.step(4.0)
    assert lathe.axis.effective_um == pytest.approx(12.0)
    lathe.set_flag("homing", value=None)
    lathe.set_flag("referenced", value=False)
    lathe.step(60.0)
    assert lathe.axis.effective_um == 0.0
    lathe.set_flag("referenced", value=None)
    lathe.step(60.0)
    assert lathe.axis.effective_um == pytest.approx(20.0)


def test_an_emergency_stop_stops_everything_that_turns_or_moves() -> None:
    stop = Fault(FaultKind.SET, ("emergency_stop",), at_s=1800.0, for_s=60.0, amount=1.0)
    settings = LatheSettings(offset=FREE)
    lathe = VirtualLathe("calibration-spindle", 1, settings, (stop,))
    lathe.step(1795.0)
    assert lathe.spindle_rpm == 3500.0
    lathe.write_offset(0.1)
    lathe.step(5.0)
    assert lathe.axis.effective_um == pytest.approx(10.0)
    lathe.step(59.0)
    assert lathe.spindle_rpm == 0.0
    assert lathe.axis.effective_um == pytest.approx(10.0)
    lathe.step(2.0)
    assert lathe.spindle_rpm == 3500.0
    assert lathe.axis.effective_um == pytest.approx(12.0)


def test_the_builders_own_compensation_moves_the_tool_as_well() -> None:
    lathe = VirtualLathe("calibration-spindle", 1)
    lathe.step(3.0 * 3600.0)
    alone = lathe.true_um.copy()
    lathe.set_flag("own_compensation", value=True)
    assert lathe.readings()["own_compensation"].value is True
    lathe.step(60.0)
    assert lathe.axis.own_um > 60.0
    assert abs(lathe.true_um[0]) < 0.6 * abs(alone[0])
    lathe.set_flag("own_compensation", value=None)
    lathe.step(120.0)
    assert lathe.axis.own_um == 0.0


def test_rules_that_cannot_be_are_refused() -> None:
    for wrong in (
        {"largest_um": 0.0},
        {"rate_um_per_s": -1.0},
        {"rate_um_per_s": math.inf},
        {"watchdog_s": 0.0},
        {"own_um_per_k": math.nan},
    ):
        with pytest.raises(ConfigurationError):
            OffsetRules(**wrong)


def test_a_flag_that_is_not_there_is_refused() -> None:
    with refused("unknown_name"):
        lathe_that_rests().set_flag("turret", value=True)
