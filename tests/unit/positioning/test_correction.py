from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.refusals import refused
from tests.unit.positioning.builders import closed_form, run
from thermaxis.codes import Message
from thermaxis.positioning import (
    AxisLevels,
    CompensationTable,
    axis_levels,
    compensation_table,
    evaluate_correction,
    figures_by_key,
    interpolation_bound,
    iso230_2_figures,
    measured_levels,
    merge_tables,
    table_points,
    values_at_points,
)
from thermaxis.quantities import AxisKind

LINEAR = AxisKind.LINEAR


def levels_of(target: list[float], forward: list[float], backward: list[float]) -> AxisLevels:
    return axis_levels(np.array(target), np.stack((forward, backward), axis=1).astype(float))


def table_of(levels: AxisLevels, position: np.ndarray, **more: object) -> CompensationTable:
    return compensation_table(
        levels, position, kind=LINEAR, axis="X", **{"reference_position": 0.0, **more}
    )


def line_by_hand(x: float, xs: list[float], ys: list[float]) -> float:
    """Return the value of a polyline, end values held: a second way, without numpy."""
    if x <= xs[0]:
        return ys[0]
    for x0, x1, y0, y1 in zip(xs, xs[1:], ys, ys[1:], strict=False):
        if x <= x1:
            return y0 + (y1 - y0) * (x - x0) / (x1 - x0)
    return ys[-1]


# ---- levels -------------------------------------------------------------------------------------


def test_measured_levels_are_the_means_of_both_approaches_or_one_stands_for_both() -> None:
    deviation = closed_form(4, 3.0, 0.5, 0.1)
    levels = measured_levels(run(deviation))
    np.testing.assert_allclose(levels.level[:, 0], 3.0 * np.arange(4) + 0.5, atol=1e-12)
    np.testing.assert_allclose(levels.level[:, 1], 3.0 * np.arange(4) - 0.5, atol=1e-12)
    assert (levels.bidirectional, levels.remarks) == (True, ())
    deviation[..., 1] = np.nan
    one_way = measured_levels(run(deviation))
    np.testing.assert_array_equal(one_way.level, levels.level[:, :1] * np.ones((1, 2)))
    assert not one_way.bidirectional
    assert one_way.remarks == (Message("remark-one_approach_for_both", {"approach": "forward"}),)


def test_a_target_without_readings_is_left_out_and_named() -> None:
    deviation = closed_form(4, 1.0, 0.5, 0.1)
    deviation[2, :, 1] = np.nan
    levels = measured_levels(run(deviation))
    np.testing.assert_array_equal(levels.target, [0.0, 20.0, 60.0])
    assert levels.remarks == (Message("remark-targets_left_out", {"targets": "3"}),)
    level = np.full((3, 2), np.nan)
    level[1] = 4.0
    with refused("too_few_targets"):
        axis_levels(np.arange(3.0), level)


# ---- points -------------------------------------------------------------------------------------


def test_equidistant_points_cover_the_targets() -> None:
    for asked, expected in (
        ({}, [1.0, 4.0, 7.0]),
        ({"points": 4}, [1.0, 3.0, 5.0, 7.0]),
        ({"spacing": 4.0}, [1.0, 5.0, 9.0]),
        ({"spacing": 3.0}, [1.0, 4.0, 7.0]),
        ({"spacing": 4.0, "through": 0.0}, [0.0, 4.0, 8.0]),
        ({"spacing": 3.0, "through": 100.0}, [1.0, 4.0, 7.0]),
        ({"points": 3, "decimals": 0}, [1.0, 4.0, 7.0]),
        ({"spacing": 50.0}, [1.0, 51.0]),
    ):
        np.testing.assert_allclose(table_points(np.array([1.0, 2.0, 7.0]), **asked), expected)


@given(
    first=st.floats(-500, 500),
    steps=st.lists(st.floats(0.5, 90), min_size=1, max_size=12),
    count=st.integers(2, 60),
    through=st.one_of(st.none(), st.floats(-600, 600)),
    decimals=st.integers(2, 5),
)
def test_points_are_equidistant_cover_the_targets_and_pass_through_the_reference(
    first: float, steps: list[float], count: int, through: float | None, decimals: int
) -> None:
    target = first + np.concatenate(([0.0], np.cumsum(steps)))
    points = table_points(target, points=count, through=through, decimals=decimals)
    half = 0.5 * 10.0**-decimals
    step = (points[-1] - points[0]) / (points.size - 1)
    np.testing.assert_allclose(np.diff(points), step, atol=1e-6)
    assert step == pytest.approx(round(step, decimals), abs=1e-7)
    assert points[0] <= target[0] + half
    assert points[-1] >= target[-1] - half * count - half
    if through is None:
        assert points.size == count
    else:
        off = (through - points[0]) / step
        assert abs(off - round(off)) * step <= half + 1e-6
        assert points.size <= max(count, 3)


def test_as_many_points_as_were_asked_for_are_enough_to_pass_through_the_reference() -> None:
    for count in (3, 4, 7, 64, 128, 1000):
        for through in (-80.0, 0.0, 1.234, 300.0, 417.77, 498.715, 900.0):
            target = np.array([1.234, 24.0, 300.1, 498.715])
            points = table_points(target, points=count, through=through, decimals=3)
            step = float(points[1] - points[0])
            off = (through - points[0]) / step
            assert points.size in {count - 1, count}
            assert abs(off - round(off)) * step <= 0.0005 + 1e-6
            assert points[0] <= 1.2345
            assert points[-1] >= 498.7145
            # one digit less, and the points from the reference on would be too few
            shorter = step - 0.001
            needed = [np.ceil(abs(end - through) / shorter - 1e-9) for end in (1.234, 498.715)]
            if 1.234 <= through <= 498.715:
                assert sum(needed) + 1 > count


def test_points_that_cannot_be_are_refused() -> None:
    for code, key, asked in (
        ("only_one_of", "points, spacing", {"points": 3, "spacing": 1.0}),
        ("outside_count", "points", {"points": 1}),
        ("outside_count", "points", {"points": 100_001}),
        ("not_positive_up_to", "spacing", {"spacing": 0.0}),
        ("not_positive_up_to", "spacing", {"spacing": -1.0}),
        ("not_positive_up_to", "spacing", {"spacing": float("nan")}),
        ("points_too_near", "spacing", {"spacing": 1e-5}),
        ("points_too_near", "spacing", {"spacing": 0.0001, "decimals": 3}),
    ):
        with refused(code, key=key):
            table_points(np.array([0.0, 50.0, 100.0]), **asked)


def test_a_point_beyond_the_last_target_continues_the_line_so_that_the_target_is_met() -> None:
    levels = levels_of([0.0, 10.0, 15.0], [0.0, 10.0, 20.0], [0.0, 10.0, 20.0])
    position = np.array([-20.0, -10.0, 0.0, 10.0, 20.0, 30.0])
    value = values_at_points(levels, position)
    np.testing.assert_allclose(value[:, 0], [0.0, 0.0, 0.0, 10.0, 30.0, 30.0])
    assert np.interp(15.0, position, value[:, 0]) == pytest.approx(20.0)


def test_a_short_piece_at_the_end_is_not_stretched_over_a_whole_spacing() -> None:
    levels = levels_of([0.0, 50.0, 50.4], [0.0, 10.0, 11.0], [0.0, 10.0, 9.0])
    position = np.array([0.0, 50.02, 100.04])
    value = values_at_points(levels, position)
    np.testing.assert_allclose(value[2], [11.0, 9.0])
    bound = interpolation_bound(levels, position)
    for approach in (0, 1):
        held = np.interp(levels.target, position, value[:, approach])
        assert np.all(np.abs(levels.level[:, approach] - held) <= bound + 1e-12)
    levels = levels_of([24.9, 25.1], [0.0, 2.0], [0.0, 2.0])  # all targets within one spacing
    np.testing.assert_allclose(values_at_points(levels, np.array([0.0, 50.0]))[:, 0], [0.0, 2.0])


def test_between_the_targets_values_lie_on_the_line_of_the_levels() -> None:
    targets, forward, backward = [0.0, 7.0, 30.0], [1.0, -4.0, 9.0], [0.0, 5.0, 2.0]
    levels = levels_of(targets, forward, backward)
    places = np.linspace(0.0, 30.0, 17)
    value = values_at_points(levels, places)
    by_hand = [
        [line_by_hand(x, targets, forward), line_by_hand(x, targets, backward)]
        for x in places.tolist()
    ]
    np.testing.assert_allclose(value, by_hand, atol=1e-12)


# ---- tables -------------------------------------------------------------------------------------


def test_a_table_is_zero_in_the_mean_at_its_reference_point_and_keeps_every_difference() -> None:
    levels = levels_of([0.0, 10.0, 20.0], [3.0, 5.0, 9.0], [1.0, 1.0, 1.0])
    table = table_of(levels, levels.target, reference_position=10.0)
    assert np.interp(10.0, table.position, table.mean) == pytest.approx(0.0)
    np.testing.assert_allclose(table.deviation, levels.level - 3.0)
    assert table.per_direction
    assert table.reference_position == 10.0


def test_one_value_per_point_is_the_mean_and_the_reversal_stands_apart() -> None:
    levels = levels_of([0.0, 10.0], [3.0, 5.0], [1.0, 2.0])
    table = table_of(levels, levels.target, per_direction=False, backlash=True)
    assert not table.per_direction
    np.testing.assert_allclose(table.mean, [0.0, 1.5])
    assert table.backlash == pytest.approx(2.5)
    np.testing.assert_allclose(
        table.deviation_at(np.array([0.0, 10.0])), [[1.25, -1.25], [2.75, 0.25]]
    )
    assert table_of(levels, levels.target, per_direction=False).backlash is None


def plain_table(
    position: list[float], deviation: np.ndarray, backlash: float | None = None
) -> CompensationTable:
    return CompensationTable(
        kind=LINEAR, axis="X", position=np.array(position), deviation=deviation, backlash=backlash
    )


def test_a_table_that_cannot_be_is_refused_and_arrays_are_frozen() -> None:
    for code, position, deviation, backlash in (
        ("wrong_shape", [], np.zeros((0, 2)), None),
        ("not_rising", [0.0, 0.0], np.zeros((2, 2)), None),
        ("not_rising", [1.0, 0.0], np.zeros((2, 2)), None),
        ("not_rising", [0.0, np.nan], np.zeros((2, 2)), None),
        ("wrong_shape", [0.0, 1.0], np.zeros((2,)), None),
        ("wrong_shape", [0.0, 1.0], np.zeros((2, 3)), None),
        ("not_finite", [0.0, 1.0], np.array([[0.0, np.inf], [0.0, 0.0]]), None),
        ("not_finite", [0.0], np.zeros((1, 2)), float("nan")),
    ):
        with refused(code):
            plain_table(position, deviation, backlash)
    with pytest.raises(ValueError, match="read-only"):
        plain_table([0.0], np.zeros((1, 2))).deviation[0, 0] = 1.0


def test_a_table_knows_its_step_and_the_steeper_direction_and_holds_its_end_values() -> None:
    steep = plain_table([0.0, 10.0, 15.0], np.array([[0.0, 0.0], [2.0, 0.0], [4.0, -5.0]]))
    assert steep.steepest_slope == (1.0, 10.0, 15.0)
    assert steep.step is None
    np.testing.assert_allclose(steep.deviation_at(np.array([-9.0, 5.0, 99.0]))[:, 0], [0, 1, 4])
    assert plain_table([0.0, 2.5, 5.0], np.zeros((3, 2))).step == 2.5
    one_point = plain_table([3.0], np.ones((1, 2)))
    assert one_point.step is None
    np.testing.assert_array_equal(one_point.steepest_slope, (0.0, np.nan, np.nan))


def test_the_merged_table_is_the_sum_of_both() -> None:
    places = np.array([0.0, 10.0, 20.0])
    old = table_of(levels_of([0.0, 20.0], [0.0, 8.0], [0.0, 8.0]), np.array([0.0, 20.0]))
    rest = table_of(levels_of([0.0, 10.0, 20.0], [0.0, 1.0, 0.0], [0.0, 3.0, 0.0]), places)
    merged = merge_tables(old, rest)
    np.testing.assert_allclose(merged.deviation, [[0, 0], [5, 7], [8, 8]])
    np.testing.assert_allclose(
        merged.deviation_at(places), old.deviation_at(places) + rest.deviation_at(places)
    )
    elsewhere = merge_tables(old, replace(rest, reference_position=10.0))
    assert np.interp(10.0, places, elsewhere.mean) == pytest.approx(0.0)
    np.testing.assert_allclose(elsewhere.deviation, merged.deviation - 6.0)
    nowhere = merge_tables(old, replace(rest, reference_position=None))
    np.testing.assert_allclose(nowhere.deviation, merged.deviation)


def test_reversals_that_stand_apart_are_added_and_kinds_are_never_mixed() -> None:
    levels = levels_of([0.0, 10.0], [3.0, 5.0], [1.0, 2.0])
    apart = table_of(levels, levels.target, per_direction=False, backlash=True)
    without = table_of(levels, levels.target, per_direction=False)
    assert merge_tables(apart, apart).backlash == pytest.approx(5.0)
    assert merge_tables(apart, without).backlash == pytest.approx(2.5)
    assert merge_tables(without, without).backlash is None
    np.testing.assert_allclose(merge_tables(apart, apart).mean, 2.0 * apart.mean)
    turning = replace(apart, kind=AxisKind.ROTARY)
    with refused("axes_differ"):
        merge_tables(turning, apart)


# ---- what a table leaves ------------------------------------------------------------------------


def test_the_bound_of_a_peak_between_two_points_is_its_height() -> None:
    levels = levels_of([0.0, 1.0, 2.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0])
    np.testing.assert_allclose(interpolation_bound(levels, np.array([0.0, 2.0])), [0, 1, 0])
    np.testing.assert_allclose(interpolation_bound(levels, levels.target), 0.0)
    # where an end is held, it is slope times distance
    assert interpolation_bound(levels, np.array([0.25, 2.0]))[0] == pytest.approx(0.25)


@st.composite
def cases(draw: st.DrawFn) -> tuple[AxisLevels, np.ndarray, bool, bool]:
    m = draw(st.integers(2, 12))
    value = st.floats(-200, 200)
    steps = draw(st.lists(st.floats(0.1, 90), min_size=m - 1, max_size=m - 1))
    target = draw(st.floats(-300, 300)) + np.concatenate(([0.0], np.cumsum(steps)))
    level = np.array(draw(st.lists(st.tuples(value, value), min_size=m, max_size=m)))
    how = draw(st.sampled_from(["targets", "points", "through", "some"]))
    if how == "targets":
        position = target
    elif how == "points":
        position = table_points(target, points=draw(st.integers(2, 40)))
    elif how == "through":
        spacing = draw(st.floats(0.5, 200))
        position = table_points(target, spacing=spacing, through=draw(st.floats(-400, 400)))
    else:  # a table of any shape, also one that covers the targets in part
        places = draw(st.lists(st.floats(-400, 800), min_size=2, max_size=9, unique=True))
        position = np.unique(np.round(places, 3))
    if position.size < 2:
        position = target
    per_direction = draw(st.booleans())
    return axis_levels(target, level), position, per_direction, draw(st.booleans())


@given(case=cases())
@settings(max_examples=120)
def test_no_table_misses_a_level_by_more_than_the_bound(
    case: tuple[AxisLevels, np.ndarray, bool, bool],
) -> None:
    levels, position, per_direction, backlash = case
    apart = backlash and not per_direction
    bound = interpolation_bound(levels, position, per_direction=per_direction, backlash=apart)
    table = table_of(levels, position, per_direction=per_direction, backlash=apart)
    mean = np.mean(values_at_points(levels, position), axis=1)
    zero = line_by_hand(0.0, position.tolist(), mean.tolist())
    rest = levels.level - zero - table.deviation_at(levels.target)
    assert np.all(np.abs(rest) <= bound[:, None] + 1e-6)


@given(
    level=st.lists(st.tuples(st.floats(-50, 50), st.floats(-50, 50)), min_size=3, max_size=8),
    seed=st.integers(0, 99),
)
def test_a_table_at_the_targets_leaves_nothing_systematic_and_every_scatter(
    level: list[tuple[float, float]], seed: int
) -> None:
    scatter = np.random.default_rng(seed).normal(0.0, 1.0, (len(level), 5, 2))
    scatter -= np.mean(scatter, axis=1, keepdims=True)
    test = run(np.array(level)[:, None, :] + scatter)
    table = table_of(measured_levels(test), test.target)
    effect = evaluate_correction(test, -table.deviation_at(test.target))
    assert float(effect.figures_after.E) == pytest.approx(0.0, abs=1e-9)
    assert float(effect.figures_after.M) == pytest.approx(0.0, abs=1e-9)
    assert float(effect.figures_after.B) == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(effect.figures_after.s, effect.figures_before.s)
    flipped = evaluate_correction(test, table.deviation_at(test.target))
    assert float(flipped.figures_after.E) == pytest.approx(2.0 * float(effect.figures_before.E))


def test_the_figures_after_are_those_of_the_corrected_readings() -> None:
    test = run(closed_form(5, 2.0, 0.5, 0.3))
    correction = np.arange(10.0).reshape(5, 2)
    effect = evaluate_correction(test, correction)
    expected = iso230_2_figures(test.deviation + correction[:, None, :])
    assert figures_by_key(effect.figures_after) == pytest.approx(figures_by_key(expected))
    np.testing.assert_allclose(effect.after, effect.before + correction)
    assert float(effect.figures_before.E) == pytest.approx(2.0 * 4 + 1.0)
    with refused("wrong_shape", key="correction"):
        evaluate_correction(test, correction.T)
