"""The generator of runs keeps its own laws: its sum, its clock, its order of visits, its seed."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.refusals import refused
from thermaxis.errors import ConfigurationError
from thermaxis.positioning import BACKWARD, FORWARD, Cycle, TimeSource, visits_of
from thermaxis.quantities import AxisKind
from thermaxis.virtual import (
    PAPER_X_AXIS,
    AxisGeometry,
    AxisThermal,
    LocalSpread,
    ReadingScatter,
    RunPlan,
    VirtualAxis,
    WarmUp,
    generate_positioning_run,
    paper_x_axis,
    paper_y_axis,
)

SMALL = VirtualAxis(
    plan=RunPlan(targets=3, interval=30.0, cycles=4, dwell_s=2.0, recording_s=1.0, overrun=6.0),
    scatter=ReadingScatter(noise=0.5),
)


def with_plan(axis=SMALL, **changes):
    return replace(axis, plan=replace(axis.plan, **changes))


def with_scatter(axis=SMALL, **changes):
    return replace(axis, scatter=replace(axis.scatter, **changes))


def test_a_reading_is_the_rounded_sum_of_its_parts():
    run = paper_x_axis(cycles=7)
    total = run.level[:, None, :] + run.drift + run.noise + run.outlier
    assert np.array_equal(run.test.deviation, np.round(total, 2))
    assert np.abs(run.test.deviation * 100 - np.rint(run.test.deviation * 100)).max() < 1e-9


def test_no_reading_is_a_negative_zero():
    run = generate_positioning_run(with_scatter(noise=0.001), seed=3)
    assert not np.signbit(run.test.deviation).any()


def test_the_same_seed_gives_the_same_run_and_another_seed_another_one():
    first, again, other = (generate_positioning_run(PAPER_X_AXIS, seed=s) for s in (5, 5, 6))
    assert np.array_equal(first.test.deviation, again.test.deviation)
    assert np.array_equal(first.test.time_s, again.test.time_s)
    assert not np.array_equal(first.test.target, other.test.target)
    assert not np.array_equal(first.noise, other.noise)


def test_lost_readings_and_outliers_leave_everything_else_as_it_was():
    plain = generate_positioning_run(SMALL, seed=1)
    spoilt = generate_positioning_run(with_scatter(missing=3, outliers=2), seed=1)
    kept = ~np.isnan(spoilt.test.deviation)
    assert np.count_nonzero(~kept) == 3
    assert np.count_nonzero(spoilt.outlier) == 2
    assert np.array_equal(plain.noise, spoilt.noise)
    assert np.array_equal(plain.motion_time_s, spoilt.motion_time_s)
    regular = kept & (spoilt.outlier == 0)
    assert np.array_equal(plain.test.deviation[regular], spoilt.test.deviation[regular])
    assert set(np.abs(spoilt.outlier[spoilt.outlier != 0])) == {50.0}


def test_two_readings_of_every_target_and_approach_and_both_ends_always_stay():
    run = generate_positioning_run(with_scatter(missing=10), seed=2)
    assert run.test.readings.min() >= 2
    measured = ~np.isnan(run.test.deviation)
    assert measured[0, 0, FORWARD]
    assert measured[0, -1, BACKWARD]
    assert sorted(run.test.order[measured]) == list(range(1, 15))
    with refused("outside_range"):
        generate_positioning_run(with_scatter(missing=13), seed=2)


@given(
    interval=st.floats(1.0, 500.0),
    part=st.floats(0.0, 0.49),
    first=st.floats(-1000.0, 1000.0),
    seed=st.integers(0, 2**32),
)
@settings(derandomize=True, max_examples=50)
def test_every_target_lies_within_the_random_part_of_its_place(interval, part, first, seed):
    plan = RunPlan(targets=9, interval=interval, random_part=part * interval, first=first, cycles=1)
    target = generate_positioning_run(VirtualAxis(plan=plan), seed=seed).test.target
    offset = target - (first + interval * np.arange(9))
    assert np.abs(offset).max() <= part * interval + 0.0005 + 1e-9
    assert (np.diff(target) > 0).all()


def test_the_clock_adds_travel_dwell_recording_and_overrun():
    """By hand: 30 mm at 300 mm/min take 6 s, each stop 3 s, a reversal 12 mm or 2.4 s."""
    test = generate_positioning_run(SMALL, seed=1).test
    assert test.time_source is TimeSource.FILE
    assert np.allclose(test.time_s[:, 0, FORWARD], [0.0, 9.0, 18.0])
    assert np.allclose(test.time_s[:, 0, BACKWARD], [41.4, 32.4, 23.4])
    assert np.allclose(test.time_s[:, 1, FORWARD], [46.8, 55.8, 64.8])


def test_the_warming_starts_with_the_motion_before_the_first_reading():
    run = generate_positioning_run(SMALL, seed=1)
    assert np.isclose(run.motion_time_s[0, 0, FORWARD], 6.0 / 5.0 + 3.0)
    assert np.allclose(run.motion_time_s - run.motion_time_s[0, 0, 0], run.test.time_s)


def test_start_and_end_are_those_of_the_first_and_the_last_reading():
    start = datetime(2025, 1, 2, 3, 4, 5, tzinfo=UTC)
    test = generate_positioning_run(replace(SMALL, start=start), seed=1).test
    assert test.start == start
    assert test.end == start + timedelta(seconds=float(np.nanmax(test.time_s)))


@given(
    targets=st.integers(2, 9),
    cycles=st.integers(1, 12),
    mode=st.sampled_from(list(Cycle)),
    approaches=st.sampled_from([(FORWARD, BACKWARD), (FORWARD,), (BACKWARD,)]),
)
@settings(derandomize=True, max_examples=60)
def test_every_reading_of_every_mode_is_taken_once_and_the_clock_only_advances(
    targets, cycles, mode, approaches
):
    plan = RunPlan(targets=targets, cycles=cycles, mode=mode, approaches=approaches)
    test = generate_positioning_run(VirtualAxis(plan=plan), seed=0).test
    measured = ~np.isnan(test.deviation)
    assert measured.all(axis=(0, 1)).tolist() == [FORWARD in approaches, BACKWARD in approaches]
    assert (measured.any(axis=(0, 1)) == measured.all(axis=(0, 1))).all()
    by_order = np.argsort(test.order[measured])
    visits = visits_of(targets, cycles, approaches, mode)
    assert test.cycle is mode
    assert test.order[visits.place].tolist() == list(range(1, measured.sum() + 1))
    # no approach is shorter than an overrun (1 s) or one interval (4 s), and each stop dwells 2 s
    assert np.diff(test.time_s[measured][by_order]).min() >= 3.0 - 1e-9
    # the cycles of a target follow each other
    assert (np.diff(test.time_s[:, :, list(approaches)], axis=1) > 0).all()


def test_a_unidirectional_run_returns_over_the_whole_axis():
    run = generate_positioning_run(with_plan(approaches=(FORWARD,)), seed=1)
    assert run.test.unidirectional
    # back over 60 mm and the overrun, the overrun again: 72 mm or 14.4 s, then 3 s
    assert np.isclose(run.test.time_s[0, 1, 0] - run.test.time_s[2, 0, 0], 17.4)
    assert np.isnan(run.drift[:, :, BACKWARD]).all()


def test_levels_carry_the_reversal_value_and_the_straight_line():
    geometry = AxisGeometry(straight_line_um_per_m=100.0, reversal=-4.0, reversal_variation=1.0)
    run = generate_positioning_run(replace(SMALL, geometry=geometry), seed=1)
    assert np.allclose(run.level[:, FORWARD] - run.level[:, BACKWARD], [-3.0, -4.0, -5.0])
    assert np.allclose(run.level.mean(axis=1) - run.level[0].mean(), [0.0, 3.0, 6.0])
    assert run.level[0, FORWARD] == 0.0


def test_the_periodic_error_repeats_with_the_pitch():
    geometry = AxisGeometry(periodic_error=2.0, period=5.0)
    plan = RunPlan(targets=41, interval=1.0, cycles=1)
    axis = VirtualAxis(plan=plan, geometry=geometry)
    level = generate_positioning_run(axis, seed=8).level[:, FORWARD]
    assert np.allclose(level[5:], level[:-5], atol=1e-9)
    assert 3.5 < np.ptp(level) <= 4.0


def test_a_warm_up_reaches_63_percent_after_its_time_constant():
    term = WarmUp(-5.0, 600.0)
    assert np.allclose(term.displacement(np.array([0.0, 600.0, 1e9])), [0.0, -3.16060279, -5.0])


def test_the_screw_expands_from_its_fixed_bearing():
    thermal = AxisThermal(
        screw_expansion_um_per_m=20.0, screw_time_constant_s=60.0, fixed_bearing=100.0
    )
    drift = thermal.drift(np.array([0.0, 100.0, 200.0]), np.array(1e9))
    assert np.allclose(drift, [-2.0, 0.0, 2.0])


def test_the_drift_is_zero_when_the_motion_starts_whatever_the_phase_of_the_hall():
    thermal = replace(PAPER_X_AXIS.thermal, hall_phase_rad=1.0)
    assert np.array_equal(thermal.drift(np.array([0.0, 300.0]), np.zeros(2)), [0.0, 0.0])


def test_the_hall_enters_the_drift_and_the_environment():
    thermal = AxisThermal(
        ambient_c=22.0, hall_swing_k=1.5, hall_period_s=4 * 64.2, hall_sensitivity=2.0
    )
    run = generate_positioning_run(replace(SMALL, thermal=thermal), seed=1)
    air_c = thermal.hall_temperature_c(run.motion_time_s)
    assert np.allclose(run.drift, 2.0 * (air_c - 22.0))
    stated = run.test.environment["air_temperature_c"]
    assert stated.start == round(float(air_c[0, 0, FORWARD]), 2)
    assert stated.end == round(float(air_c[0, -1, BACKWARD]), 2)


def test_a_local_spread_is_found_where_it_was_put_and_nowhere_else():
    axis = with_plan(with_scatter(local=(LocalSpread(2, 1.2),)), cycles=3000)
    spread = generate_positioning_run(axis, seed=4).noise.std(axis=1)
    assert np.allclose(spread[[0, 2]], 0.5, rtol=0.06)
    assert np.allclose(spread[1], 1.3, rtol=0.06)


def test_a_rotary_axis_has_degrees_and_no_error_per_metre():
    plan = RunPlan(targets=8, interval=45.0, feed=720.0, overrun=2.0)
    geometry = AxisGeometry(periodic_error=3.0, period=360.0, reversal=-4.0)
    axis = VirtualAxis(kind=AxisKind.ROTARY, axis="C", plan=plan, geometry=geometry)
    test = generate_positioning_run(axis, seed=1).test
    assert test.kind is AxisKind.ROTARY
    assert test.header["feed"] == "720 deg/min"
    with refused("rotary_error_per_metre"):
        replace(axis, geometry=AxisGeometry(straight_line_um_per_m=1.0))
    with refused("rotary_error_per_metre"):
        replace(axis, thermal=AxisThermal(screw_expansion_um_per_m=1.0))


def test_the_header_says_that_no_machine_was_measured_and_names_the_seed():
    for run in (paper_x_axis(cycles=2), paper_y_axis(cycles=2)):
        assert f"seed {run.seed}" in run.test.header["title"]
        assert "no machine was measured" in run.test.header["title"]
        assert "virtual" in run.test.header["machine"]


def test_what_cannot_be_is_refused():
    for part, changes in (
        (RunPlan, {"targets": 1}),
        (RunPlan, {"cycles": 0}),
        (RunPlan, {"cycles": 10**9}),
        (RunPlan, {"interval": 0.0}),
        (RunPlan, {"interval": float("nan")}),
        (RunPlan, {"random_part": 10.0}),
        (RunPlan, {"random_part": -1.0}),
        (RunPlan, {"feed": 0.0}),
        (RunPlan, {"feed": float("inf")}),
        (RunPlan, {"overrun": 0.0}),
        (RunPlan, {"dwell_s": -1.0}),
        (RunPlan, {"recording_s": -1.0}),
        (RunPlan, {"approaches": (BACKWARD, FORWARD)}),
        (RunPlan, {"approaches": ()}),
        (AxisGeometry, {"pitch_error": -1.0}),
        (AxisGeometry, {"pitch_error_waves": -1}),
        (AxisGeometry, {"periodic_error": -1.0}),
        (AxisGeometry, {"period": 0.0}),
        (WarmUp, {"amplitude": 1.0, "time_constant_s": 0.0}),
        (AxisThermal, {"screw_expansion_um_per_m": -1.0}),
        (AxisThermal, {"screw_time_constant_s": -1.0}),
        (AxisThermal, {"hall_period_s": 0.0}),
        (ReadingScatter, {"noise": -0.1}),
        (ReadingScatter, {"noise": float("nan")}),
        (ReadingScatter, {"local": (LocalSpread(1, -1.0),)}),
        (ReadingScatter, {"local": (LocalSpread(1, float("inf")),)}),
        (ReadingScatter, {"outliers": -1}),
        (ReadingScatter, {"missing": -1}),
        (ReadingScatter, {"decimals": 10}),
        (VirtualAxis, {"scatter": ReadingScatter(local=(LocalSpread(17, 1.0),))}),
        (VirtualAxis, {"scatter": ReadingScatter(local=(LocalSpread(0, 1.0),))}),
    ):
        with pytest.raises(ConfigurationError):
            part(**changes)


def test_a_negative_seed_too_many_outliers_and_coinciding_targets_are_refused():
    with refused("negative"):
        generate_positioning_run(SMALL, seed=-1)
    with refused("outside_range"):
        generate_positioning_run(with_scatter(outliers=25), seed=1)
    with refused("not_rising"):
        generate_positioning_run(with_plan(interval=0.0002), seed=1)
