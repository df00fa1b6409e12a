"""Warnings about runs that were not measured as the standard asks."""

from dataclasses import replace

import numpy as np

from tests.unit.positioning.builders import codes_of, run, stop_times, values_said
from thermaxis.codes import Message
from thermaxis.positioning import Cycle, TimeSource, check_test_conditions
from thermaxis.quantities import AxisKind

RNG = np.random.default_rng(30)
RANDOM_TARGETS = np.arange(6) * 50.0 + np.array([0.0, 1.7, -2.1, 0.9, 3.3, -1.2])


def warnings_of(n: int, target: np.ndarray, **more: object) -> tuple[Message, ...]:
    return check_test_conditions(run(RNG.normal(size=(target.size, n, 2)), target, **more))


def test_each_condition_that_is_not_met_is_named() -> None:
    assert warnings_of(5, RANDOM_TARGETS) == ()
    for target, n, code, values in (
        (RANDOM_TARGETS[:4], 5, "few_targets_linear", {"targets": 4, "required": 5}),
        (RANDOM_TARGETS, 3, "few_cycles", {"cycles": 3, "required": 5}),
        (RANDOM_TARGETS, 50, "many_cycles", {"cycles": 50}),
        (np.arange(6) * 300.0 + RANDOM_TARGETS / 50, 5, "few_targets_linear", {"required": 8}),
        (np.arange(6) * 50.0, 5, "targets_equidistant", {"mean": 50.0}),
        (np.array([0.0, 10.0, 21.0, 33.0, 41.0, 160.0]), 5, "interval_uneven", {"target": 5}),
    ):
        said = warnings_of(n, target)
        assert values.items() <= values_said(said, code).items()


def test_over_two_metres_the_interval_counts_and_one_run_is_enough() -> None:
    said = warnings_of(1, np.linspace(0, 2400, 7) + RNG.uniform(0, 3, 7))
    assert values_said(said, "interval_too_long")["most_mm"] == 250.0
    assert warnings_of(1, np.linspace(0, 2400, 12) + RNG.uniform(0, 3, 12)) == ()


def test_rotary_axes_have_their_own_numbers() -> None:
    for span, needed in ((80.0, 3), (170.0, 5), (355.0, 8), (715.0, 16)):
        for count in (needed - 1, needed):
            target = np.linspace(0.0, span, count) + RNG.uniform(0.0, 0.5, count)
            said = codes_of(warnings_of(5, target, kind=AxisKind.ROTARY))
            assert ("few_targets_rotary" in said) == (count < needed)


def test_step_and_pilgrim_cycles_are_named() -> None:
    test = run(RNG.normal(size=(6, 5, 2)), RANDOM_TARGETS)
    for cycle in (Cycle.STEP, Cycle.PILGRIM):
        said = check_test_conditions(replace(test, cycle=cycle))
        assert codes_of(said) == [f"{cycle}_cycle"]


def test_missing_readings_are_counted_and_the_first_is_named() -> None:
    x = RNG.normal(size=(6, 5, 2))
    x[1, 2, 0] = x[2, :3, 1] = x[4, 1, 1] = np.nan
    said = check_test_conditions(run(x, RANDOM_TARGETS))
    for values in (
        {"count": 1, "target": 2, "cycle": 3, "approach": "forward"},
        {"count": 4, "target": 3, "cycle": 1, "approach": "backward"},
    ):
        assert Message("warning-readings_missing", values) in said


def test_travel_against_the_named_direction_and_cycles_that_interleave_are_told() -> None:
    time_s = stop_times(6, 5)
    x = RNG.normal(size=(6, 5, 2))
    assert check_test_conditions(run(x, RANDOM_TARGETS, time_s=time_s)) == ()
    wrong = check_test_conditions(run(x, RANDOM_TARGETS, time_s=time_s[:, :, ::-1]))
    assert wrong == tuple(
        Message("warning-travel_reversed", {"approach": way, "cycles": "1, 2, 3, 4, 5"})
        for way in ("forward", "backward")
    )
    order = np.arange(60.0).reshape(6, 5, 2)
    said = check_test_conditions(run(x, RANDOM_TARGETS, time_s=order))
    assert "cycles_interleave" in codes_of(said)


def test_a_deduced_order_is_dropped_for_another_kind_of_cycle() -> None:
    time_s = stop_times(6, 5)
    x = RNG.normal(size=(6, 5, 2))
    stated = run(x, RANDOM_TARGETS, time_s=time_s)
    assert stated.with_cycle(Cycle.STEP).time_source is TimeSource.FILE
    deduced = replace(stated, time_source=TimeSource.INTERPOLATED, order_deduced=True)
    assert deduced.with_cycle(Cycle.STANDARD).time_s is not None
    other = deduced.with_cycle(Cycle.PILGRIM)
    assert (other.time_source, other.time_s, other.order) == (TimeSource.NONE, None, None)
    assert other.remarks[-1].code == "remark-order_of_cycle_unknown"


def test_a_target_with_few_readings_is_named_however_many_cycles_there_are() -> None:
    x = RNG.normal(size=(6, 60, 2))
    x[3, 2:, 1] = np.nan
    said = check_test_conditions(run(x, RANDOM_TARGETS))
    values = {"target": 4, "readings": 2, "approach": "backward", "required": 5}
    assert Message("warning-few_readings", values) in said
    x = RNG.normal(size=(6, 7, 2))
    x[:, 1:6] = np.nan
    assert values_said(check_test_conditions(run(x, RANDOM_TARGETS)), "few_cycles")["cycles"] == 2
