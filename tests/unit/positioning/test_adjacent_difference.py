"""The adjacent-difference method: equations (4) to (6), chart, reference, Student's factor."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from tests.refusals import refused
from tests.unit.positioning.builders import codes_of, run, stop_times, values_said
from thermaxis.codes import Message
from thermaxis.positioning import (
    evaluate_adjacent_difference,
    evaluate_against_cycles,
    evaluate_iso230_2,
    student_factor,
)

RNG = np.random.default_rng(4)


@st.composite
def runs(draw: st.DrawFn) -> np.ndarray:
    m = draw(st.integers(2, 8))
    n = draw(st.integers(2, 7))
    return draw(arrays(np.float64, (m, n, 2), elements=st.floats(-1e3, 1e3, width=32)))


@settings(derandomize=True, max_examples=50, deadline=None)
@given(runs())
def test_equations_4_and_6_transcribed(x: np.ndarray) -> None:
    result = evaluate_adjacent_difference(run(x))
    m, n, _ = x.shape
    for d, approach in enumerate(result.approaches):
        for i in range(m - 1):
            difference = [x[i, j, d] - x[i + 1, j, d] for j in range(n)]
            mean = sum(difference) / n
            square = sum((mean - v) ** 2 for v in difference)
            assert approach.mean_difference[i] == pytest.approx(mean, abs=1e-9)
            assert approach.standard_uncertainty[i] == pytest.approx(
                math.sqrt(square / (n * (n - 1))), abs=1e-9
            )
            assert approach.standard_deviation[i] == pytest.approx(
                math.sqrt(square / (n - 1)), abs=1e-9
            )


@settings(derandomize=True, max_examples=50, deadline=None)
@given(runs(), st.data())
def test_the_chart_telescopes_to_the_classical_means(x: np.ndarray, data: st.DataObject) -> None:
    p, cycle = data.draw(st.integers(1, x.shape[0])), data.draw(st.integers(1, x.shape[1]))
    result = evaluate_adjacent_difference(run(x), reference_cycle=cycle, reference_position=p)
    mean = x.mean(axis=1)
    for d, approach in enumerate(result.approaches):
        assert approach.chart - approach.chart[0] == pytest.approx(
            mean[:, d] - mean[0, d], abs=1e-8
        )
        assert approach.chart[p - 1] == x[p - 1, cycle - 1, d]
        assert np.diff(approach.chart) == pytest.approx(-approach.mean_difference, abs=1e-8)


def test_a_drift_common_to_neighbours_leaves_the_spread_alone() -> None:
    x = RNG.normal(size=(16, 40, 2))
    drift = np.linspace(0.0, 50.0, 40)[None, :, None]
    quiet = evaluate_adjacent_difference(run(x))
    drifting = evaluate_adjacent_difference(run(x + drift))
    for a, b in zip(quiet.approaches, drifting.approaches, strict=True):
        assert b.standard_deviation == pytest.approx(a.standard_deviation, abs=1e-9)
        assert np.all(b.s_ratio > 3 * a.s_ratio)


def test_drift_inside_a_pass_stays_with_opposite_sign_in_both_approaches() -> None:
    """Positioning reference, trap 6: with a constant rate every difference is off by rate * dt."""
    time_s = stop_times(6, 5)
    result = evaluate_adjacent_difference(run(0.3 * time_s, time_s=time_s))
    assert result.forward.mean_difference == pytest.approx(-0.3 * np.ones(5), abs=1e-12)
    assert result.backward.mean_difference == pytest.approx(0.3 * np.ones(5), abs=1e-12)
    both = evaluate_iso230_2(run(0.3 * time_s, time_s=time_s)).mean_bidirectional
    assert both == pytest.approx(np.full(6, both[0]), abs=1e-12)


def test_bounds_take_the_pair_before_and_the_ratio_the_later_position_of_a_pair() -> None:
    x = RNG.normal(size=(5, 40, 2)) * np.array([1, 2, 3, 4, 5])[:, None, None]
    forward = evaluate_adjacent_difference(run(x)).forward
    assert forward.bound[1:] == pytest.approx(2 * forward.standard_uncertainty)
    assert forward.bound[0] == forward.bound[1]
    s = evaluate_iso230_2(run(x)).s
    assert forward.s_ratio == pytest.approx(s[1:, 0] / forward.standard_deviation)


def test_students_factor_has_the_tabled_values() -> None:
    for n, t in (
        *((2, 13.968), (3, 4.526), (4, 3.307), (5, 2.869), (6, 2.649), (7, 2.517), (10, 2.320)),
        *((15, 2.195), (20, 2.140), (25, 2.110)),
    ):
        assert student_factor(n) == pytest.approx(t, abs=6e-4)  # the table is cut, not rounded
    assert student_factor(29) == pytest.approx(2.09, abs=0.01)
    assert student_factor(30) == student_factor(1000) == 2.0
    assert student_factor(1) is None


def test_few_cycles_widen_the_bounds_and_are_named() -> None:
    few = evaluate_adjacent_difference(run(RNG.normal(size=(5, 5, 2))))
    assert few.student_factor == pytest.approx(2.869, abs=5e-4)
    assert values_said(few.warnings, "student_factor")["cycles"] == 5
    assert evaluate_adjacent_difference(run(RNG.normal(size=(5, 30, 2)))).warnings == ()
    x = RNG.normal(size=(5, 60, 2))
    x[3, 4:, 1] = np.nan
    said = values_said(evaluate_adjacent_difference(run(x)).warnings, "student_factor_of_pair")
    assert {**said, "factor": None} == {
        "cycles": 4,
        "enough": 30,
        "factor": None,
        "position": 3,
        "next": 4,
        "approach": "backward",
    }


def test_the_default_reference_is_the_first_cycle_after_two_hours() -> None:
    x = RNG.normal(size=(4, 10, 2))
    time_s = stop_times(4, 10, step_s=300.0)  # one cycle takes 2400 s
    assert evaluate_adjacent_difference(run(x, time_s=time_s)).reference_cycle == 4
    assert evaluate_adjacent_difference(run(x, time_s=time_s / 10)).reference_cycle == 1
    assert evaluate_adjacent_difference(run(x)).reference_cycle == 1
    at = evaluate_adjacent_difference(run(x, time_s=time_s), reference_time_s=2401.0)
    assert at.reference_cycle == 3
    x[0, 0, 1] = np.nan  # a cycle without its reading is skipped
    assert evaluate_adjacent_difference(run(x)).reference_cycle == 2


def test_a_reference_that_does_not_exist_is_an_error() -> None:
    x = RNG.normal(size=(4, 10, 2))
    time_s = stop_times(4, 10)
    x[0, 4, 0] = np.nan
    with refused("outside_range", key="reference cycle"):
        evaluate_adjacent_difference(run(x), reference_cycle=11)
    with refused("cycle_without_reference", key="reference cycle"):
        evaluate_adjacent_difference(run(x), reference_cycle=5)
    with refused("readings_without_times", key="reference time"):
        evaluate_adjacent_difference(run(x), reference_time_s=10.0)
    with refused("no_cycle_after", key="reference time"):
        evaluate_adjacent_difference(run(x, time_s=time_s), reference_time_s=1e6)
    with refused("only_one_of", key="reference"):
        evaluate_adjacent_difference(run(x), reference_cycle=1, reference_time_s=0.0)
    with refused("outside_range", key="reference position"):
        evaluate_adjacent_difference(run(x), reference_position=5)
    with refused("too_few_targets"):
        evaluate_adjacent_difference(run(x[:1]))
    x[1, :5, 0] = x[2, 5:, 0] = np.nan
    with refused("no_pair", position=2, next=3):
        evaluate_adjacent_difference(run(x))


def test_a_cycle_counts_for_a_pair_when_both_readings_exist() -> None:
    x = RNG.normal(size=(4, 6, 2))
    x[1, 2, 0] = np.nan
    result = evaluate_adjacent_difference(run(x))
    assert result.forward.cycles.tolist() == [5, 5, 6]
    kept = [0, 1, 3, 4, 5]
    assert result.forward.mean_difference[0] == pytest.approx(
        np.mean(x[0, kept, 0] - x[1, kept, 0])
    )
    assert result.student_factor == pytest.approx(student_factor(5))


def test_one_approach_and_one_cycle() -> None:
    x = RNG.normal(size=(4, 6, 2))
    x[:, :, 0] = np.nan
    result = evaluate_adjacent_difference(run(x))
    assert result.forward is None
    assert result.backward is not None
    single = evaluate_adjacent_difference(run(RNG.normal(size=(4, 1, 2))))
    assert single.student_factor is None
    assert np.all(np.isnan(single.forward.bound))
    assert np.all(np.isfinite(single.forward.chart))


def test_a_pair_with_one_complete_cycle_is_named_and_the_others_keep_their_bounds() -> None:
    x = RNG.normal(size=(4, 4, 2))
    x[1, 1:, 0] = np.nan
    result = evaluate_adjacent_difference(run(x))
    assert result.student_factor == pytest.approx(student_factor(4))
    assert np.isnan(result.forward.bound[1])
    assert np.isfinite(result.forward.bound[3])
    pair = {"position": 1, "next": 2, "approach": "forward"}
    assert Message("warning-pair_without_spread", pair) in result.warnings


def test_figures_against_cycles_are_those_of_the_first_cycles() -> None:
    many = evaluate_against_cycles(run(RNG.normal(size=(5, 1000, 2)))).cycles
    assert (many.size, many[0], many[-1]) == (200, 2, 1000)
    x = RNG.normal(size=(5, 7, 2))
    against = evaluate_against_cycles(run(x))
    assert against.cycles.tolist() == [2, 3, 4, 5, 6, 7]
    for k, a in zip(against.cycles, against.figures["A"], strict=True):
        assert a == evaluate_iso230_2(run(x[:, : int(k)])).A


def test_an_anchor_that_is_an_outlier_is_named() -> None:
    x = RNG.normal(size=(5, 20, 2))
    assert codes_of(evaluate_adjacent_difference(run(x)).warnings) == ["student_factor"]
    x[0, 0, 0] += 100.0
    said = values_said(evaluate_adjacent_difference(run(x)).warnings, "anchor_outlying")
    assert said == {"position": 1, "approach": "forward", "cycle": 1}
    later = evaluate_adjacent_difference(run(x), reference_cycle=2)
    assert "anchor_outlying" not in codes_of(later.warnings)


def test_a_spread_that_is_only_round_off_has_no_ratio() -> None:
    deviation = np.zeros((5, 5, 2)) + 3.7 * np.arange(5.0)[:, None, None]
    deviation += np.arange(5.0)[None, :, None] / 3.0
    result = evaluate_adjacent_difference(run(deviation)).forward
    assert np.any(result.standard_deviation > 0.0)
    assert np.all(result.standard_deviation < 1e-14)
    assert np.all(np.isnan(result.s_ratio))
    deviation[2, 1, 0] += 1e-9
    assert np.sum(np.isfinite(evaluate_adjacent_difference(run(deviation)).forward.s_ratio)) == 2
