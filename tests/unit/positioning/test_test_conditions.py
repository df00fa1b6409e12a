"""Warnings about runs that were not measured as the standard asks."""

from dataclasses import replace

import numpy as np

from tests.unit.positioning.builders import run, stop_times
from thermaxis.positioning import Cycle, TimeSource, check_test_conditions
from thermaxis.quantities import AxisKind

RNG = np.random.default_rng(30)
RANDOM_TARGETS = np.arange(6) * 50.0 + np.array([0.0, 1.7, -2.1, 0.9, 3.3, -1.2])


def warnings_of(m: int, n: int, target: np.ndarray | None = None, **more: object) -> str:
    return " | ".join(check_test_conditions(run(RNG.normal(size=(m, n, 2)), target, **more)))


def test_each_condition_is_named_in_words() -> None:
    for target, n, words in (
        (RANDOM_TARGETS[:4], 5, "4 targets are fewer than the 5"),
        (RANDOM_TARGETS, 3, "3 cycles, 3 readings of every target, are fewer than the 5"),
        (RANDOM_TARGETS, 50, "50 cycles are more than the 5"),
        (np.arange(6) * 300.0 + RANDOM_TARGETS / 50, 5, "6 targets are fewer than the 8"),
        (np.arange(6) * 50.0, 5, "equidistant (50 mm)"),
        (np.array([0.0, 10.0, 21.0, 33.0, 41.0, 160.0]), 5, "after target 5"),
    ):
        assert words in warnings_of(target.size, n, target)
    assert warnings_of(6, 5, RANDOM_TARGETS) == ""


def test_over_two_metres_the_interval_counts_and_one_run_is_enough() -> None:
    assert "at most 250 mm" in warnings_of(7, 1, np.linspace(0, 2400, 7) + RNG.uniform(0, 3, 7))
    assert warnings_of(12, 1, np.linspace(0, 2400, 12) + RNG.uniform(0, 3, 12)) == ""


def test_rotary_axes_have_their_own_numbers() -> None:
    for span, needed in ((80.0, 3), (170.0, 5), (355.0, 8), (715.0, 16)):
        for count in (needed - 1, needed):
            target = np.linspace(0.0, span, count) + RNG.uniform(0.0, 0.5, count)
            text = warnings_of(count, 5, target, kind=AxisKind.ROTARY)
            assert ("are fewer than" in text) == (count < needed)


def test_step_and_pilgrim_cycles_are_named() -> None:
    test = run(RNG.normal(size=(6, 5, 2)), RANDOM_TARGETS)
    assert "Annex B" in check_test_conditions(replace(test, cycle=Cycle.STEP))[0]
    assert "pilgrim" in check_test_conditions(replace(test, cycle=Cycle.PILGRIM))[0]


def test_missing_readings_are_named_and_counted() -> None:
    x = RNG.normal(size=(6, 5, 2))
    x[1, 2, 0] = x[2, :3, 1] = x[4, 1, 1] = np.nan
    text = " | ".join(check_test_conditions(run(x, RANDOM_TARGETS)))
    assert "1 reading(s) forward are missing (target 2 in cycle 3)" in text
    assert "4 reading(s) backward are missing" in text
    assert "and 1 more" in text


def test_travel_against_the_named_direction_is_reported() -> None:
    time_s = stop_times(6, 5)
    x = RNG.normal(size=(6, 5, 2))
    assert check_test_conditions(run(x, RANDOM_TARGETS, time_s=time_s)) == ()
    wrong = time_s[:, :, ::-1].copy()
    text = " | ".join(check_test_conditions(run(x, RANDOM_TARGETS, time_s=wrong)))
    assert "forward readings of cycle 1, 2, 3, 4, 5" in text
    assert "backward readings" in text
    order = np.arange(60.0).reshape(6, 5, 2)  # cycles that interleave
    text = " | ".join(check_test_conditions(run(x, RANDOM_TARGETS, time_s=order)))
    assert "as in a step cycle" in text


def test_a_deduced_order_is_dropped_for_another_kind_of_cycle() -> None:
    time_s = stop_times(6, 5)
    x = RNG.normal(size=(6, 5, 2))
    stated = run(x, RANDOM_TARGETS, time_s=time_s)
    assert stated.with_cycle(Cycle.STEP).time_source is TimeSource.FILE
    deduced = replace(stated, time_source=TimeSource.INTERPOLATED, order_deduced=True)
    assert deduced.with_cycle(Cycle.STANDARD).time_s is not None
    other = deduced.with_cycle(Cycle.PILGRIM)
    assert (other.time_source, other.time_s, other.order) == (TimeSource.NONE, None, None)
    assert "does not state the order of visits" in other.remarks[-1]


def test_a_target_with_few_readings_is_named_however_many_cycles_there_are() -> None:
    x = RNG.normal(size=(6, 60, 2))
    x[3, 2:, 1] = np.nan
    text = " | ".join(check_test_conditions(run(x, RANDOM_TARGETS)))
    assert "target 4 has 2 readings backward, fewer than the 5" in text
    gaps = RNG.normal(size=(6, 7, 2))
    gaps[:, 1:6] = np.nan
    assert "2 readings of every target, are fewer" in " | ".join(
        check_test_conditions(run(gaps, RANDOM_TARGETS))
    )
