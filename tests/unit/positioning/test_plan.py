from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.proofs import quick_first
from tests.refusals import refused
from tests.unit.positioning.builders import codes_of, values_said
from thermaxis.codes import Message
from thermaxis.positioning import (
    BACKWARD,
    FIGURE_KEYS,
    FORWARD,
    LEVEL_KEY,
    Cycle,
    RunAssumptions,
    TestPlan,
    TimeSource,
    check_against_plan,
    check_plan,
    choose_targets,
    evaluate_drift,
    evaluate_duration,
    expected_uncertainty,
    order_of_visits,
    periodic_error_visibility,
    planned_test,
    shortest_plan,
    simulate_uncertainty,
    why_nothing_is_expected,
)
from thermaxis.positioning.plan import DISTANCE_FROM_MULTIPLE, assumed_levels
from thermaxis.quantities import AxisKind
from thermaxis.virtual import RunPlan, VirtualAxis, generate_positioning_run

BOTH = (FORWARD, BACKWARD)


def plan_of(**changes: object) -> TestPlan:
    fields: dict[str, object] = {
        "kind": AxisKind.LINEAR,
        "axis": "X",
        "target": np.array([0.0, 21.5, 38.0, 61.0, 83.0, 99.0]),
        "cycles": 5,
        "feed": 300.0,
        "dwell_s": 2.0,
        "overrun": 5.0,
    }
    return TestPlan(**{**fields, **changes})


# ---- targets ------------------------------------------------------------------------------------


@given(
    start=st.floats(-1000, 1000),
    length=st.floats(1.0, 5000.0),
    targets=st.integers(2, 60),
    pitch=st.none() | st.floats(0.5, 60.0),
    share=st.none() | st.floats(0.0, 0.45),
    seed=st.integers(0, 2**32),
)
@settings(derandomize=True, max_examples=80, deadline=None)
def test_targets_follow_equation_1_keep_their_order_and_stay_within_the_length(
    start: float, length: float, targets: int, pitch: float | None, share: float | None, seed: int
) -> None:
    choice = choose_targets(
        start=start, length=length, targets=targets, pitch=pitch, random_share=share, seed=seed
    )
    again = choose_targets(
        start=start, length=length, targets=targets, pitch=pitch, random_share=share, seed=seed
    )
    np.testing.assert_array_equal(choice.target, again.target)
    assert choice.target.size == targets
    assert np.all(np.diff(choice.target) > 0)
    assert choice.target[0] >= start - 1e-3
    assert choice.target[-1] <= start + length + 1e-3
    nominal = start + choice.random_part + choice.interval * np.arange(targets)
    assert np.max(np.abs(choice.target - nominal)) <= choice.random_part + 1e-3
    assert choice.random_part < 0.5 * choice.interval
    if pitch is not None and choice.interval >= pitch:
        off = abs(choice.interval / pitch - round(choice.interval / pitch))
        assert off >= DISTANCE_FROM_MULTIPLE - 1e-9


def test_an_interval_that_is_a_multiple_of_the_pitch_is_made_smaller_and_said_so() -> None:
    choice = choose_targets(start=0, length=300, targets=16, pitch=5, random_share=0.0)
    assert choice.interval == pytest.approx(19.5)
    np.testing.assert_allclose(choice.target, 19.5 * np.arange(16))
    said = {"before": 20.0, "interval": 19.5, "pitch": 5, "left": 7.5}
    assert values_said(choice.remarks, "interval_made_smaller") == pytest.approx(said)
    kept = choose_targets(start=0, length=300, targets=16, pitch=7, random_share=0.0)
    assert kept.interval == 20.0
    assert kept.remarks == ()


def test_the_random_part_is_half_the_pitch_where_neighbours_stay_apart() -> None:
    wide = choose_targets(start=0, length=330, targets=16, pitch=4.1)
    assert wide.random_part == pytest.approx(2.05)
    assert wide.remarks == ()
    narrow = choose_targets(start=0, length=300, targets=16, pitch=32)
    assert narrow.random_part == pytest.approx(0.3 * narrow.interval)
    assert codes_of(narrow.remarks) == ["random_part_limited"]
    unknown = choose_targets(start=0, length=300, targets=16)
    assert unknown.random_part == pytest.approx(0.3 * unknown.interval)
    other = choose_targets(start=0, length=300, targets=16, seed=2)
    assert not np.array_equal(other.target, unknown.target)
    assert codes_of(unknown.remarks) == ["pitch_not_stated"]


def test_targets_that_cannot_be_chosen_are_refused_by_the_name_of_the_field() -> None:
    for code, changes, key in (
        ("not_positive_up_to", {"length": 0.0}, "length"),
        ("not_positive_up_to", {"length": float("nan")}, "length"),
        ("outside_range", {"start": float("inf")}, "start"),
        ("outside_count", {"targets": 1}, "targets"),
        ("outside_count", {"targets": 10_001}, "targets"),
        ("not_positive_up_to", {"pitch": -5.0}, "pitch"),
        ("random_share_outside", {"random_share": 0.5}, "random_share"),
        ("outside_range", {"seed": -1}, "seed"),
        ("outside_range", {"seed": 2**32 + 1}, "seed"),
        ("targets_change_places", {"length": 0.01, "targets": 16}, "targets"),
    ):
        arguments = {"start": 0.0, "length": 300.0, "targets": 16, **changes}
        with refused(code, key=key):
            choose_targets(**arguments)


def test_the_visibility_is_that_of_the_worst_phase() -> None:
    target = np.array([0.0, 13.0, 31.0, 38.0, 55.0, 80.0, 91.0])
    x = np.stack((np.ones(7), target), axis=1)
    worst = np.inf
    for phase in np.linspace(0.0, np.pi, 2001):
        wave = np.sin(2 * np.pi * target / 12.0 + phase)
        rest = wave - x @ np.linalg.lstsq(x, wave, rcond=None)[0]
        worst = min(worst, float(np.sqrt(2.0 * np.mean(rest**2))))
    assert periodic_error_visibility(target, 12.0) == pytest.approx(worst, rel=1e-5)
    assert periodic_error_visibility(12.5 * np.arange(16), 5.0) == pytest.approx(0.0, abs=1e-9)
    for pitch in (4.0, 20.0):
        chosen = choose_targets(start=0, length=300, targets=16, pitch=pitch, seed=3).target
        assert periodic_error_visibility(chosen, pitch) > 0.5


# ---- the plan -----------------------------------------------------------------------------------


def test_a_plan_that_cannot_be_driven_is_refused_by_the_name_of_the_field() -> None:
    for code, changes, key in (
        ("outside_count", {"target": np.array([0.0])}, "target"),
        ("targets_not_rising", {"target": np.array([0.0, 10.0, 10.0004])}, "target"),
        ("outside_range", {"target": np.array([0.0, np.nan])}, "target"),
        ("wrong_shape", {"target": np.array([[0.0, 1.0]])}, "target"),
        ("outside_count", {"target": np.arange(10_001.0)}, "target"),
        ("outside_count", {"cycles": 0}, "cycles"),
        ("too_many_stops", {"cycles": 10**6}, "cycles"),
        ("no_approaches", {"approaches": (BACKWARD, FORWARD)}, "approaches"),
        ("no_approaches", {"approaches": ()}, "approaches"),
        ("not_positive_up_to", {"feed": 0.0}, "feed"),
        ("not_positive_up_to", {"feed": float("inf")}, "feed"),
        ("not_positive_up_to", {"overrun": 0.0}, "overrun"),
        ("outside_range", {"dwell_s": -1.0}, "dwell_s"),
        ("outside_range", {"recording_s": float("nan")}, "recording_s"),
        ("not_positive_up_to", {"pitch": 0.0}, "pitch"),
        ("not_positive_up_to", {"interval": -1.0}, "interval"),
        ("outside_range", {"random_part": -1.0}, "random_part"),
        ("outside_range", {"seed": -1}, "seed"),
        ("outside_range", {"seed": 2**32 + 1}, "seed"),
        ("no_axis_name", {"axis": "X G0"}, "axis"),
        ("no_axis_name", {"axis": ""}, "axis"),
        ("title_not_printable", {"title": "two\nlines"}, "title"),
        ("title_too_long", {"title": "x" * 201}, "title"),
    ):
        with refused(code, key=key):
            plan_of(**changes)


@pytest.mark.parametrize("cycle", list(Cycle))
def test_order_and_times_are_those_that_the_virtual_axis_drives(cycle: Cycle) -> None:
    motion = {"cycles": 4, "feed": 250.0, "dwell_s": 1.5, "recording_s": 0.7, "overrun": 3.0}
    for approaches in (BOTH, (FORWARD,), (BACKWARD,)):
        motion["approaches"] = approaches
        driven = RunPlan(targets=7, interval=20.0, random_part=4.0, mode=cycle, **motion)
        run = generate_positioning_run(VirtualAxis(axis="X", plan=driven), seed=3)
        plan = plan_of(target=run.test.target, cycle=cycle, **motion)
        planned = planned_test(plan)
        np.testing.assert_array_equal(planned.order, run.test.order, str(approaches))
        np.testing.assert_allclose(planned.time_s, run.test.time_s, atol=6e-4)
        total = float(np.nanmax(run.motion_time_s))
        assert evaluate_duration(plan).total_s == pytest.approx(total, rel=1e-9)
        assert check_against_plan(run.test, plan) == ()


def test_a_pilgrim_step_goes_a_few_targets_forward_and_fewer_back() -> None:
    visits = order_of_visits(plan_of(target=np.arange(4.0), cycles=2, cycle=Cycle.PILGRIM))
    shown = [f"{t + 1}{'+-'[a]}" for t, a in zip(visits.target, visits.approach, strict=True)]
    assert " ".join(shown) == "1+ 1- 1+ 2+ 2- 1- 2+ 3+ 3- 2- 3+ 4+ 4- 3- 4+ 4-"


def test_the_duration_of_a_standard_cycle_has_a_closed_form() -> None:
    plan = plan_of(cycles=7, recording_s=0.5)
    found = evaluate_duration(plan)
    assert found.moves_s == pytest.approx(7 * 2 * 99.0 / 300.0 * 60.0)
    assert found.overrun_s == pytest.approx((4 * 7 - 1) * 5.0 / 300.0 * 60.0)
    assert found.dwell_s == 7 * 2 * 6 * 2.0
    assert found.recording_s == 7 * 2 * 6 * 0.5
    near = evaluate_duration(replace(plan, target=0.01 * plan.target))  # 0.16 mm apart is ahead too
    assert near.overrun_s == pytest.approx(found.overrun_s)
    alone = evaluate_duration(plan_of(cycles=7, approaches=(BACKWARD,)))
    assert alone.moves_s == pytest.approx((7 + 6) * 99.0 / 300.0 * 60.0)
    assert alone.overrun_s == pytest.approx((1 + 2 * 6) * 5.0 / 300.0 * 60.0)


def test_a_plan_is_held_against_the_rules_of_the_standard() -> None:
    target = choose_targets(start=0, length=300, targets=16, pitch=5).target
    assert check_plan(plan_of(target=target, pitch=5.0)) == ()
    said = check_plan(plan_of(target=np.linspace(0, 1500, 4), cycles=2, pitch=10.0))
    assert codes_of(said) == [
        *("few_targets_linear", "few_cycles", "targets_equidistant", "periodic_error_hidden")
    ]
    assert values_said(said, "periodic_error_hidden")["visible_percent"] < 0.5
    assert codes_of(check_plan(plan_of(cycle=Cycle.STEP))) == ["step_cycle"]


# ---- a run against its plan ---------------------------------------------------------------------


def differences(plan: TestPlan | None = None, **changes: object) -> tuple[Message, ...]:
    """Return what is said of a run that follows the plan but for some changes."""
    plan = plan or plan_of()
    return check_against_plan(replace(planned_test(plan_of()), **changes), plan)


def test_what_a_file_does_not_tell_is_said_not_guessed() -> None:
    for code, changes in (
        ("order_not_known", {"time_source": TimeSource.NONE, "time_s": None, "order": None}),
        ("order_deduced", {"order_deduced": True}),
        ("times_not_stated", {"time_source": TimeSource.ORDER, "time_s": None}),
        ("times_not_stated", {"time_source": TimeSource.INTERPOLATED}),
    ):
        assert codes_of(differences(**changes)) == [code]


def test_missing_readings_are_named_and_the_rest_is_compared_all_the_same() -> None:
    deviation = planned_test(plan_of()).deviation.copy()
    deviation[1, 2, FORWARD] = deviation[4, 0, BACKWARD] = np.nan
    assert differences(deviation=deviation) == tuple(
        Message("warning-planned_readings_missing", {"count": 1, **values})
        for values in (
            {"target": 2, "cycle": 3, "approach": "forward"},
            {"target": 5, "cycle": 1, "approach": "backward"},
        )
    )


def test_another_axis_cycle_number_of_cycles_or_approach_is_told() -> None:
    plan, one_way = plan_of(), plan_of(approaches=(FORWARD,))
    for run, against, code, values in (
        (planned_test(plan_of(cycles=6)), plan, "other_number_of_cycles", {"cycles": 6}),
        (planned_test(plan_of(cycles=2)), plan, "other_number_of_cycles", {"planned": 5}),
        (planned_test(one_way), plan, "approach_not_measured", {"approach": "backward"}),
        (planned_test(plan), one_way, "approach_not_planned", {"approach": "backward"}),
        (replace(planned_test(plan), header={"axis": "Y"}), plan, "other_axis", {"axis": "Y"}),
        (replace(planned_test(plan), kind=AxisKind.ROTARY), plan, "other_kind", {}),
    ):
        said = check_against_plan(run, against)
        assert codes_of(said)[:1] == [code]
        assert values.items() <= values_said(said, code).items()
    assert differences(header={"axis": "x"}) == ()


def test_the_place_is_told_where_the_order_leaves_the_plan() -> None:
    said = check_against_plan(planned_test(plan_of(cycle=Cycle.STEP)), plan_of())
    assert codes_of(said) == ["other_cycle", "order_differs"]
    test = planned_test(plan_of())
    order, time_s = test.order.copy(), test.time_s.copy()
    for values in (order, time_s):  # two readings are exchanged
        values[[2, 3], 1, FORWARD] = values[[3, 2], 1, FORWARD]
    assert values_said(differences(order=order, time_s=time_s), "order_differs") == {
        "reading": 15,
        "target": 4,
        "cycle": 2,
        "approach": "forward",
        "planned_target": 3,
        "planned_cycle": 2,
        "planned_approach": "forward",
        "count": 2,
        "readings": 60,
    }


def test_targets_elsewhere_are_named() -> None:
    plan = plan_of()
    target = plan.target.copy()
    target[[1, 2]] += (0.001, 0.3)
    moved = {"target": 3, "position": 38.3, "planned": 38.0, "unit": "mm"}
    assert differences(target=target) == (
        Message("warning-target_elsewhere", moved),
        Message("warning-targets_differ"),
    )
    assert values_said(differences(target=plan.target + 1.0), "more_targets_elsewhere") == {
        "count": 3
    }
    fewer = check_against_plan(planned_test(plan_of(target=np.delete(plan.target, 2))), plan)
    assert values_said(fewer, "other_number_of_targets") == {"targets": 5, "planned": 6}
    assert values_said(fewer, "targets_not_measured")["position"] == 38.0
    more = differences(plan_of(target=plan.target[:-1]))
    assert values_said(more, "targets_not_planned")["position"] == 99.0


def test_stops_that_were_shorter_or_longer_than_planned_and_pauses_are_told() -> None:
    plan, test = plan_of(), planned_test(plan_of())
    said = check_against_plan(planned_test(replace(plan, dwell_s=1.2)), plan)
    shorter = {"shorter_s": 0.8, "left_s": 1.2, "planned_s": 2.0, "feed": 300.0}
    assert values_said(said, "stops_shorter") == {
        **{key: pytest.approx(value) for key, value in shorter.items()},
        "unit": "mm",
    }
    assert check_against_plan(planned_test(replace(plan, dwell_s=1.95)), plan) == ()
    said = check_against_plan(planned_test(replace(plan, dwell_s=6.0)), plan)
    assert values_said(said, "stops_longer")["longer_s"] == pytest.approx(4.0)
    assert differences(time_s=np.round(test.time_s)) == ()  # whole seconds accuse no dwell
    time_s = test.time_s + np.where(test.order > 30, 720.0, 0.0)
    assert values_said(differences(time_s=time_s), "run_paused") == {
        "count": 1,
        "longest_min": pytest.approx(12.0),
        "target": 6,
        "cycle": 3,
        "approach": "backward",
    }


# ---- expected uncertainty -----------------------------------------------------------------------


def x_axis(**changes: object) -> TestPlan:
    target = choose_targets(start=0, length=300, targets=16, pitch=5).target
    return plan_of(target=target, pitch=5.0, **changes)


@pytest.mark.parametrize("cycle", list(Cycle))
def test_for_a_straight_drift_the_levels_have_the_covariance_of_dense_least_squares(
    cycle: Cycle,
) -> None:
    plan = plan_of(cycle=cycle, cycles=4)
    test = planned_test(plan)
    i, j, a = np.nonzero(~np.isnan(test.deviation))
    time = test.time_s[i, j, a]
    x = plan.target - plan.target.mean()
    reference = time.mean()
    design = np.zeros((i.size, 14))
    design[np.arange(i.size), i + 6 * a] = 1.0
    design[:, 12] = (time - reference) / 100.0
    design[:, 13] = design[:, 12] * x[i] / 50.0
    covariance = 0.4**2 * np.linalg.inv(design.T @ design)
    expected = expected_uncertainty(plan, RunAssumptions(drift=0.0), samples=10)
    assert expected.reference_time_s == pytest.approx(reference)
    dense = np.sqrt(np.diag(covariance)[:12]).reshape(2, 6).T
    np.testing.assert_allclose(expected.level_std, dense, rtol=0.01)


@pytest.mark.parametrize(
    ("cycles", "drift", "hours"), quick_first(1, [(3, 10.0, 1.0), (20, 30.0, 0.5)])
)
def test_the_drift_evaluation_reaches_what_the_covariance_foretells(
    cycles: int, drift: float, hours: float
) -> None:
    plan = x_axis(cycles=cycles)
    assumptions = RunAssumptions(drift=drift, time_constant_s=3600.0 * hours)
    expected = expected_uncertainty(plan, assumptions, samples=10)
    simulated = simulate_uncertainty(plan, assumptions, runs=4, seed=2)

    foretold = float(np.sqrt(np.mean(expected.level_std**2)))
    assert 0.75 * foretold < simulated.level_std < 1.25 * foretold
    assert 0.65 * foretold < simulated.level_error < 1.3 * foretold


@pytest.mark.proof
def test_the_figures_scatter_as_those_of_simulated_runs() -> None:
    target = choose_targets(start=0, length=200, targets=8, pitch=5).target
    plan = plan_of(target=target, cycles=5)
    assumptions = RunAssumptions()
    expected = expected_uncertainty(plan, assumptions)
    test = planned_test(plan)
    level = assumed_levels(plan, assumptions)
    part = (target - target[0]) / np.ptp(target)
    drift = 10.0 * (1.0 - np.exp(-test.time_s / 3600.0)) * (0.5 + part)[:, None, None]
    random = np.random.default_rng(5)
    seen: dict[str, list[float]] = {"B": [], "E": [], "R": [], "A": []}
    for _ in range(20):
        noise = 0.4 * random.standard_normal(test.deviation.shape)
        figures = evaluate_drift(replace(test, deviation=level[:, None, :] + drift + noise)).figures
        for key, values in seen.items():
            values.append(float(getattr(figures, key)))
    # at t0 the warming of the axis is part of its error: E and A have another truth than drawn
    for key, values in seen.items():
        assert np.std(values) == pytest.approx(expected.figures[key].standard_uncertainty, rel=0.35)
    for key, truth in (("B", 1.0), ("R", 1.0 + 4 * 0.4)):
        bias = float(np.mean(seen[key])) - truth
        assert bias == pytest.approx(expected.figures[key].bias, abs=0.12)


def test_the_assumed_axis_has_the_stated_systematic_error_and_reversal_value() -> None:
    plan = plan_of(target=np.linspace(0.0, 100.0, 401))
    level = assumed_levels(plan, RunAssumptions(systematic=3.0, reversal=1.2))
    assert np.ptp(level.mean(axis=1)) == pytest.approx(3.0)
    np.testing.assert_allclose(level[:, FORWARD] - level[:, BACKWARD], 1.2)


def test_a_unidirectional_plan_expects_the_figures_that_it_gives() -> None:
    expected = expected_uncertainty(x_axis(approaches=(BACKWARD,)), samples=50)
    assert set(expected.figures) == {"E_backward", "R_backward", "A_backward"}
    assert np.all(np.isnan(expected.level_std[:, FORWARD]))
    assert expected.of("E") is None
    assert expected.of(LEVEL_KEY) == expected.largest_level_std
    both = expected_uncertainty(x_axis(), samples=50)
    assert set(both.figures) == set(FIGURE_KEYS)


def test_more_cycles_are_never_worse_nor_are_levels_better_than_without_any_drift() -> None:
    found = [expected_uncertainty(x_axis(cycles=n), samples=10) for n in (3, 6, 12, 24)]
    largest = [expected.largest_level_std for expected in found]
    assert largest == sorted(largest, reverse=True)
    for n, expected in zip((3, 6, 12, 24), found, strict=True):
        assert np.all(expected.level_std >= expected.mean_std - 1e-12)
        assert expected.mean_std == pytest.approx(0.4 / np.sqrt(n))


def test_the_error_of_plain_means_is_that_of_the_assumed_drift() -> None:
    plan = plan_of(cycles=2)
    test = planned_test(plan)
    along = 1.0 + (plan.target - 49.5) / 99.0
    drift = 8.0 * (1.0 - np.exp(-test.time_s / 600.0)) * along[:, None, None]
    at = 8.0 * (1.0 - np.exp(-float(test.time_s.mean()) / 600.0)) * along
    wrong = np.max(np.abs(drift.mean(axis=1) - at[:, None]))
    assumptions = RunAssumptions(drift=8.0, time_constant_s=600.0)
    expected = expected_uncertainty(plan, assumptions, samples=10)
    assert expected.drift_in_means == pytest.approx(float(wrong))


def test_a_single_cycle_promises_nothing_and_says_why() -> None:
    plan = x_axis(cycles=1)
    assert why_nothing_is_expected(plan).code == "drift_and_levels_alike"
    assert simulate_uncertainty(plan) is None
    with refused("drift_and_levels_alike", key="expected uncertainty"):
        expected_uncertainty(plan)
    once, again = (simulate_uncertainty(x_axis(cycles=3), runs=1, seed=2) for _ in range(2))
    assert once == again
    wide = plan_of(target=np.arange(60.0), cycles=2)
    assert why_nothing_is_expected(wide) is None
    assert simulate_uncertainty(wide) is None
    many = plan_of(target=np.arange(600.0), cycles=2)
    assert "too large" in str(why_nothing_is_expected(many))


@pytest.mark.parametrize(("key", "wanted"), quick_first(1, [(LEVEL_KEY, 0.12), ("R", 0.2)]))
def test_the_shortest_plan_is_the_first_that_reaches_the_uncertainty(
    key: str, wanted: float
) -> None:
    found = shortest_plan(x_axis(), wanted, key=key)
    assert found.reached
    reached = {
        n: expected_uncertainty(x_axis(cycles=n)).of(key) for n in range(2, found.plan.cycles + 1)
    }
    assert [n for n, u in reached.items() if u is not None and u <= wanted] == [found.plan.cycles]
    assert found.standard_uncertainty == pytest.approx(reached[found.plan.cycles])


def test_the_search_starts_at_two_cycles_or_at_the_standards_five() -> None:
    assert shortest_plan(x_axis(), 0.3).plan.cycles == 2
    assert shortest_plan(x_axis(), 0.3, fewest_cycles=5).plan.cycles == 5
    small = plan_of(target=np.array([0.0, 10.0]), approaches=(FORWARD,))
    assert shortest_plan(small, 100.0).plan.cycles == 4


def test_what_cannot_be_reached_in_time_is_said_with_its_limit() -> None:
    found = shortest_plan(x_axis(), 0.01, longest_s=3600.0)
    assert not found.reached
    assert evaluate_duration(found.plan).total_s <= 3600.0
    longer = replace(found.plan, cycles=found.plan.cycles + 1)
    assert evaluate_duration(longer).total_s > 3600.0
    assert found.standard_uncertainty == min(found.tried.values()) > 0.01


def test_a_search_that_makes_no_sense_is_refused() -> None:
    both, one_way = x_axis(), x_axis(approaches=(FORWARD,))
    for code, key, plan, wanted, options in (
        ("not_positive_up_to", "target_uncertainty", both, 0.0, {}),
        ("not_positive_up_to", "target_uncertainty", both, float("nan"), {}),
        ("unknown_choice", "target_figure", both, 0.3, {"key": "Q"}),
        ("figure_not_given", "target_figure", one_way, 0.3, {"key": "E"}),
        ("cycles_take_longer", "longest", both, 0.3, {"longest_s": 60.0}),
    ):
        with refused(code, key=key):
            shortest_plan(plan, wanted, **options)
    for changes in ({"noise": 0.0}, {"drift": -1.0}, {"time_constant_s": np.nan}):
        with refused("outside_range", key=next(iter(changes))):
            RunAssumptions(**changes)
