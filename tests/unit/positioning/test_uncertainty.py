import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from tests.refusals import refused
from tests.unit.positioning.builders import closed_form, run, stop_times
from thermaxis.codes import Message, Place
from thermaxis.positioning import (
    FIGURE_KEYS,
    DriftResult,
    PositioningTest,
    StartEnd,
    UncertaintyBudget,
    UncertaintyResult,
    evaluate_drift,
    evaluate_iso230_2,
    evaluate_uncertainty,
)
from thermaxis.positioning.standard import arrays_by_key, figures_of
from thermaxis.positioning.uncertainty import PROBABILITY
from thermaxis.positioning.uncertainty._true_values import (
    Estimate,
    draw_levels,
    log_likelihood,
    most_likely,
    scatter_of_levels,
    standing_out,
)
from thermaxis.quantities import AxisKind

NOISE = 0.4
SHOWN = ("B", "E", "R", "A")


def axis_levels(axis: str, amount: float, target: np.ndarray, rng: np.random.Generator):
    """Return levels with independent errors, or a straight line and a constant reversal value."""
    if axis == "random":
        return rng.normal(0.0, amount, (target.size, 2))
    line = amount * (target - target.mean()) / np.ptp(target)
    return line[:, None] + amount * np.array([0.5, -0.5])


def noisy(
    seed: int,
    cycles: int = 5,
    *,
    axis: str = "random",
    amount: float = 0.5,
    drift: float = 0.0,
    targets: int = 16,
) -> tuple[PositioningTest, np.ndarray]:
    """Return a run and its true levels at the mean time; the drift is exponential in time."""
    rng = np.random.default_rng(seed)
    target = 20.0 * np.arange(targets) + rng.uniform(-4.0, 4.0, targets)
    time_s = stop_times(targets, cycles, 8.0)
    level = axis_levels(axis, amount, target, rng)

    def drift_at(t: np.ndarray, x: np.ndarray) -> np.ndarray:
        return drift * (1.0 + (x - target.mean()) / 400.0) * -np.expm1(-t / 1800.0)

    deviation = level[:, None, :] + drift_at(time_s, target[:, None, None])
    deviation = deviation + NOISE * rng.normal(size=deviation.shape)
    truth = level + drift_at(np.mean(time_s), target)[:, None]
    return run(deviation, target, time_s=time_s), truth


def figures_by_key(mean: np.ndarray, s: np.ndarray) -> dict[str, float]:
    return {key: float(value) for key, value in arrays_by_key(figures_of(mean, s)).items()}


def measured_figures(test: PositioningTest) -> dict[str, float]:
    result = evaluate_iso230_2(test)
    return {key: getattr(result, key) for key in FIGURE_KEYS}


@pytest.fixture(scope="module")
def drifting() -> tuple[PositioningTest, DriftResult]:
    test, _ = noisy(3, 5, drift=6.0)
    return test, evaluate_drift(test)


# ---- what is promised ---------------------------------------------------------------------------


@pytest.mark.parametrize(("axis", "cycles", "amount"), [("random", 5, 0.5), ("constant", 5, 3.0)])
def test_the_true_figure_lies_within_u_in_88_to_99_percent(
    axis: str, cycles: int, amount: float
) -> None:
    inside: list[bool] = []
    for seed in range(25):
        test, level = noisy(seed, cycles, axis=axis, amount=amount)
        stated = evaluate_uncertainty(test, None, samples=300, seed=seed).measured
        truth = figures_by_key(level, np.full(level.shape, NOISE))
        figure = measured_figures(test)
        inside += [
            abs(figure[key] - truth[key]) <= stated.expanded_uncertainty[key] for key in SHOWN
        ]
    assert 0.88 <= np.mean(inside) <= 0.99


def test_it_does_so_with_a_drift_for_the_drift_free_and_for_the_measured_figures() -> None:
    free: list[bool] = []
    measured: list[bool] = []
    for seed in range(10):
        test, level = noisy(seed, 5, drift=6.0)
        drift = evaluate_drift(test)
        result = evaluate_uncertainty(test, drift, samples=300, seed=seed)
        truth = figures_by_key(level, np.full(level.shape, NOISE))
        without = {key: float(v) for key, v in arrays_by_key(drift.figures).items()}
        with_drift = measured_figures(test)
        for key in SHOWN:
            u = result.drift_free.expanded_uncertainty[key]
            free.append(abs(without[key] - truth[key]) <= u)
            u = result.measured.expanded_uncertainty[key]
            measured.append(abs(with_drift[key] - truth[key]) <= u)
    assert 0.88 <= np.mean(free) <= 1.0
    assert 0.88 <= np.mean(measured) <= 1.0


def test_the_bias_of_the_largest_s_is_that_of_the_chi_distribution() -> None:
    m, n = 16, 5
    s = np.linspace(0.0, 4.0, 4001)
    largest = stats.chi2.cdf((n - 1) * s**2, n - 1) ** m  # distribution of the largest of m
    expected = 4.0 * NOISE * (np.sum(1.0 - largest) * (s[1] - s[0]) - 1.0)
    stated = [
        evaluate_uncertainty(noisy(seed, n)[0], None, samples=300).measured.bias["R_forward"]
        for seed in range(25)
    ]
    assert np.mean(stated) == pytest.approx(expected, rel=0.15)


def test_figure_less_bias_is_right_on_average_where_the_figure_is_not() -> None:
    error: list[float] = []
    left: list[float] = []
    for seed in range(40):
        test, level = noisy(seed, 5, amount=0.5)
        bias = evaluate_uncertainty(test, None, samples=300).measured.bias["E"]
        truth = figures_by_key(level, np.full(level.shape, NOISE))["E"]
        error.append(measured_figures(test)["E"] - truth)
        left.append(error[-1] - bias)
    assert np.mean(error) > 0.08
    assert abs(np.mean(left)) < 0.05


# ---- what it rests on ---------------------------------------------------------------------------


def test_what_estimates_say_of_true_values_agrees_with_dense_gaussian_algebra() -> None:
    rng = np.random.default_rng(1)
    factor = rng.normal(size=(6, 8))
    covariance = factor @ factor.T
    scatter = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
    line = np.column_stack((np.ones(6), np.arange(6.0)))
    prior = np.diag(1.0 / scatter**2)
    through = prior @ line
    prior -= through @ np.linalg.solve(line.T @ through, through.T)
    inverse = np.linalg.inv(covariance)
    expected = np.linalg.solve(inverse + prior, inverse)
    assert most_likely(covariance, scatter, line) == pytest.approx(expected, abs=1e-9)


def test_the_draws_have_the_covariance_of_the_posterior() -> None:
    rng = np.random.default_rng(2)
    value = rng.normal(size=(8, 1)) * 3.0
    estimate = Estimate(
        position=np.arange(8.0),
        approaches=(0,),
        level=value[:, 0],
        covariance=0.04 * np.eye(8),
        s=np.full(8, 0.4),
        free=np.full(8, 1000.0),
        readings=np.full(8, 4.0),
    )
    drawn = draw_levels(estimate, 20_000, np.random.default_rng(3))
    # the scatter is fifteen times the noise: the estimates are hardly drawn towards the line
    assert np.mean(drawn, axis=0) == pytest.approx(value[:, 0], abs=0.03)
    assert np.std(drawn, axis=0) == pytest.approx(0.2, rel=0.05)


def test_the_likelihood_of_variances_is_that_of_the_f_distribution() -> None:
    variance, free = np.array([0.5, 1.2, 2.0]), np.array([4.0, 4.0, 3.0])
    centre = np.array([0.7, 1.0, 1.9])
    expected = [float(np.sum(stats.f.logpdf(variance / c, free, 7.0) - np.log(c))) for c in centre]
    found = log_likelihood(variance, free, 7.0, centre)
    assert np.diff(found) == pytest.approx(np.diff(expected))


def test_scatter_about_the_line_is_found_and_none_is_found_where_there_is_none() -> None:
    rng = np.random.default_rng(4)
    x = np.column_stack((np.ones(400), np.linspace(-1.0, 1.0, 400)))
    noise = rng.normal(0.0, 0.1, 400)
    found = scatter_of_levels(rng.normal(0.0, 0.5, 400) + noise, 0.01 * np.eye(400), x, 5)
    assert found == pytest.approx(0.5, rel=0.15)
    assert np.max(scatter_of_levels(noise, 0.01 * np.eye(400), x, 5)) < 0.05


def test_a_target_that_stands_out_is_named_and_others_are_not() -> None:
    rng = np.random.default_rng(5)
    line = np.ones((16, 1))
    named = 0
    for _ in range(100):
        value = rng.normal(0.0, 0.25, 16)
        named += bool(standing_out(value, 0.0625 * np.eye(16), line))
        value[7] += 3.0
        assert standing_out(value, 0.0625 * np.eye(16), line)[0] == 7
    assert named <= 5  # 1 % is the level


# ---- terms of the budget ------------------------------------------------------------------------


FULL = UncertaintyBudget(
    device=0.2,
    device_um_per_m=0.5,
    misalignment_mm=1.0,
    material_temperature_interval_k=1.0,
    expansion_coefficient_interval_ppm_per_k=2.0,
    expansion_coefficient_ppm_per_k=12.0,
    largest_difference_to_20_c_k=5.0,
    environmental_variation=1.7,
)


def metre(m: int = 6, n: int = 1) -> PositioningTest:
    """Return an axis of 1 m with 30 µm/m and no scatter at all."""
    target = np.linspace(0.0, 1000.0, m)
    deviation = np.broadcast_to(0.03 * target[:, None, None], (m, n, 2))
    return run(deviation - np.array([0.0, 2.0]), target)


def test_the_terms_have_the_values_that_a_pocket_calculator_gives() -> None:
    terms = {t.key: t for t in evaluate_uncertainty(metre(), None, budget=FULL).measured.terms}
    assert terms["device"].expanded == pytest.approx(0.2 + 0.5)
    assert terms["misalignment"].expanded == pytest.approx(0.3)
    assert terms["material_temperature"].expanded == pytest.approx(7.2)
    assert terms["expansion_coefficient"].expanded == pytest.approx(6.0)
    assert terms["environmental_variation"].expanded == pytest.approx(1.02)
    assert {t.mark for t in terms.values()} == {"own", "M"}
    budget = UncertaintyBudget(device_range=1.0, device_range_um_per_m=2.0)
    (rectangular,) = evaluate_uncertainty(metre(), None, budget=budget).measured.terms
    assert rectangular.expanded == pytest.approx(0.6 * 3.0)


def test_systematic_terms_alone_give_their_root_sum_of_squares_and_nothing_for_the_reversal() -> (
    None
):
    budget = replace(FULL, environmental_variation=None)
    stated = evaluate_uncertainty(metre(), None, budget=budget, samples=20_000).measured
    expected = np.sqrt(0.7**2 + 0.3**2 + 7.2**2 + 6.0**2)
    for key in ("M", "E_forward", "E_backward", "E"):
        assert stated.closed_form[key] == pytest.approx(expected)
        assert stated.expanded_uncertainty[key] == pytest.approx(expected, rel=0.03)
        assert abs(stated.bias[key]) < 0.1
    assert not {"B", "B_mean", "R", "A"} & stated.expanded_uncertainty.keys()
    assert Message("left_out-one_reading") in stated.left_out


def with_extremes_at_one_place(n: int) -> PositioningTest:
    """Return a steep axis whose reversal value and scatter are largest at one target."""
    rng = np.random.default_rng(6)
    target = np.linspace(0.0, 400.0, 5)
    deviation = 0.2 * rng.normal(size=(5, n, 2))
    deviation[2] *= 5.0
    deviation += 0.5 * target[:, None, None]
    deviation[2, :, 1] -= 40.0
    deviation[:, :, 1] -= 20.0
    return run(deviation, target)


def test_the_closed_forms_agree_with_the_monte_carlo_and_with_plain_formulas() -> None:
    n = 4000  # so many that the scatter of the readings does not count beside the budget
    test = with_extremes_at_one_place(n)
    budget = UncertaintyBudget(device=1.0, environmental_variation=20.0 / 0.6)
    stated = evaluate_uncertainty(test, None, budget=budget, samples=20_000).measured
    u_mean, u_s = 20.0 / np.sqrt(n), 20.0 / np.sqrt(n - 1)
    plain = {
        "B": np.sqrt(2.0) * u_mean,
        "B_mean": np.sqrt(2.0) * u_mean / np.sqrt(5.0),
        "M": np.hypot(1.0, u_mean),
        "E_forward": np.hypot(1.0, np.sqrt(2.0) * u_mean),
        "E": np.hypot(1.0, np.sqrt(2.0) * u_mean),
        "R_forward": 4.0 * u_s,
        "R": np.sqrt(2.0 * u_mean**2 + 8.0 * u_s**2),
        "A_forward": np.sqrt(1.0 + 2.0 * u_mean**2 + 8.0 * u_s**2),
        "A": np.sqrt(1.0 + 2.0 * u_mean**2 + 8.0 * u_s**2),
    }
    for key, value in plain.items():
        assert stated.closed_form[key] == pytest.approx(value), key
    for key in ("B", "B_mean", "M", "E_forward", "E_backward", "E", "R_forward", "R"):
        assert stated.expanded_uncertainty[key] == pytest.approx(
            plain.get(key, plain["E"]), rel=0.04
        )


def test_environmental_variation_does_not_touch_the_drift_free_figures(
    drifting: tuple[PositioningTest, DriftResult],
) -> None:
    test, drift = drifting
    without = evaluate_uncertainty(test, drift)
    given = evaluate_uncertainty(test, drift, budget=UncertaintyBudget(environmental_variation=5.0))
    assert given.drift_free.expanded_uncertainty == without.drift_free.expanded_uncertainty
    assert Message("left_out-counted_twice") in given.drift_free.left_out
    assert [t.key for t in given.measured.terms] == ["noise", "drift", "environmental_variation"]
    for key in FIGURE_KEYS:
        before = without.measured.standard_uncertainty[key]
        assert given.measured.standard_uncertainty[key] > before


def test_more_environmental_variation_never_makes_a_figure_more_certain(
    drifting: tuple[PositioningTest, DriftResult],
) -> None:
    budgets = [UncertaintyBudget(environmental_variation=v) for v in (0.0, 0.5, 2.0, 5.0)]
    results = [evaluate_uncertainty(drifting[0], None, budget=b).measured for b in budgets]
    for key in FIGURE_KEYS:
        u = [result.expanded_uncertainty[key] for result in results]
        assert all(b > 0.97 * a for a, b in itertools.pairwise(u)), key  # draws scatter by 3 %
        assert u[-1] > u[0]
        biases = [result.bias[key] for result in results]
        assert biases == pytest.approx([biases[0]] * 4, abs=1e-9)


def test_without_a_budget_the_result_says_what_is_in_it_and_what_is_not(
    drifting: tuple[PositioningTest, DriftResult],
) -> None:
    test, drift = drifting
    result = evaluate_uncertainty(test, drift)
    assert result.label == "GUM"
    for stated in (result.measured, result.drift_free):
        assert [term.key for term in stated.terms] == ["noise", "drift"]
        assert stated.included[0] == "scatter of the readings"
        assert stated.left_out == (Message("left_out-no_budget"),)
        assert not stated.closed_form
        assert list(stated.expanded_uncertainty) == list(FIGURE_KEYS)
    alone = evaluate_uncertainty(test, None)
    assert alone.drift_free is None
    assert Message("left_out-drift_unknown") in alone.measured.left_out


def test_coefficient_and_temperatures_of_the_run_serve_where_the_budget_has_none() -> None:
    budget = UncertaintyBudget(
        material_temperature_interval_k=1.0, expansion_coefficient_interval_ppm_per_k=2.0
    )
    with refused("no_expansion_coefficient"):
        evaluate_uncertainty(metre(), None, budget=budget)
    environment = {"expansion_coefficient_ppm_per_k": StartEnd(12.0, None)}
    with refused("no_material_temperature"):
        evaluate_uncertainty(replace(metre(), environment=environment), None, budget=budget)
    environment["material_temperature_1_c"] = StartEnd(21.0, 17.0)
    test = replace(metre(), environment=environment)
    terms = evaluate_uncertainty(test, None, budget=budget).measured.terms
    assert [term.expanded for term in terms] == pytest.approx([7.2, 0.6 * 3.0 * 2.0])


def test_a_rotary_axis_has_no_terms_of_length() -> None:
    test = run(np.zeros((4, 1, 2)) + np.arange(4.0)[:, None, None], kind=AxisKind.ROTARY)
    stated = evaluate_uncertainty(test, None, budget=UncertaintyBudget(device=0.5)).measured
    assert [term.key for term in stated.terms] == ["device"]
    terms = {str(one.values.get("term", "")) for one in stated.left_out}
    assert not any("expansion" in term or "misalignment" in term for term in terms)
    with refused("linear_axis_only", Place(key="misalignment_mm")):
        evaluate_uncertainty(test, None, budget=UncertaintyBudget(misalignment_mm=1.0))


def test_an_instrument_stated_twice_and_impossible_numbers_are_refused() -> None:
    with refused("instrument_twice"):
        UncertaintyBudget(device=0.1, device_range_um_per_m=1.0)
    for value in (-1.0, np.nan, np.inf):
        with refused("outside_range", Place(key="misalignment_mm")):
            UncertaintyBudget(misalignment_mm=value)
    for code, options in (
        ("outside_range", {"samples": 99}),
        ("outside_range", {"samples": 10**7}),
        ("negative", {"seed": -1}),
    ):
        with refused(code, Place(key=next(iter(options)))):
            evaluate_uncertainty(metre(), None, **options)


# ---- laws ---------------------------------------------------------------------------------------


def test_the_same_seed_gives_the_same_result_and_another_one_nearly_the_same(
    drifting: tuple[PositioningTest, DriftResult],
) -> None:
    test, drift = drifting
    first, again, other = (evaluate_uncertainty(test, drift, seed=s) for s in (1, 1, 2))
    assert first.measured.expanded_uncertainty == again.measured.expanded_uncertainty
    for key in FIGURE_KEYS:
        u = first.measured.expanded_uncertainty[key]
        assert other.measured.expanded_uncertainty[key] == pytest.approx(u, rel=0.12)


def test_a_constant_changes_nothing_and_a_factor_scales_everything() -> None:
    test, _ = noisy(7)
    base = evaluate_uncertainty(test, None).measured
    shifted = evaluate_uncertainty(run(test.deviation + 50.0, test.target), None).measured
    scaled = evaluate_uncertainty(run(3.0 * test.deviation, test.target), None).measured
    for key in FIGURE_KEYS:
        u = base.expanded_uncertainty[key]
        assert shifted.expanded_uncertainty[key] == pytest.approx(u, rel=1e-6)
        assert scaled.expanded_uncertainty[key] == pytest.approx(3.0 * u, rel=1e-6)
        assert scaled.bias[key] == pytest.approx(3.0 * base.bias[key], rel=1e-6, abs=1e-9)


def test_u_and_twice_the_standard_uncertainty_agree_where_nothing_is_an_extreme() -> None:
    stated = evaluate_uncertainty(noisy(8)[0], None, samples=20_000).measured
    u = stated.standard_uncertainty["B_mean"]
    assert stated.expanded_uncertainty["B_mean"] == pytest.approx(2.0 * u, rel=0.03)
    # a mean of 16 differences of means of 5 readings each
    assert u == pytest.approx(NOISE * np.sqrt(2.0 / (5 * 16)), rel=0.2)
    assert abs(stated.bias["B_mean"]) < 0.01
    assert pytest.approx(stats.norm.cdf(2.0) - stats.norm.cdf(-2.0)) == PROBABILITY


def test_the_drift_is_a_bias_of_the_measured_repeatability_and_not_of_the_drift_free_one() -> None:
    test, level = noisy(10, 10, drift=12.0)
    result = evaluate_uncertainty(test, evaluate_drift(test))
    measured, stated = result.measured, result.drift_free
    truth = figures_by_key(level, np.full(level.shape, NOISE))["R"]
    figure = measured_figures(test)["R"]
    assert figure - truth > 2.0
    assert measured.bias["R"] == pytest.approx(figure - truth, abs=0.5)
    assert stated.bias["R"] < 0.6
    assert measured.standard_uncertainty["R"] == pytest.approx(stated.standard_uncertainty["R"])


# ---- runs that are not as usual -----------------------------------------------------------------


def check_sound(result: UncertaintyResult) -> None:
    for stated in (result.measured, result.drift_free):
        if stated is None:
            continue
        assert stated.expanded_uncertainty.keys() == stated.bias.keys()
        for key, value in stated.expanded_uncertainty.items():
            assert np.isfinite(value)
            assert value > 0.0
            assert value + 1e-9 >= abs(stated.bias[key]) - 2.0 * stated.standard_uncertainty[key]


def test_a_unidirectional_run_has_the_figures_of_its_approach() -> None:
    test, _ = noisy(11, drift=6.0)
    deviation = test.deviation.copy()
    deviation[..., 1] = np.nan
    test = replace(test, deviation=deviation)
    result = evaluate_uncertainty(test, evaluate_drift(test))
    check_sound(result)
    assert set(result.measured.bias) == {"E_forward", "R_forward", "A_forward"}


def test_missing_readings_and_few_cycles_or_targets_are_no_obstacle() -> None:
    test, _ = noisy(12, drift=6.0)
    deviation = test.deviation.copy()
    deviation[3, 1, 0] = deviation[7, :3, 1] = np.nan
    test = replace(test, deviation=deviation)
    check_sound(evaluate_uncertainty(test, evaluate_drift(test)))
    for targets, cycles in ((2, 5), (3, 3), (4, 4), (16, 2)):
        check_sound(evaluate_uncertainty(noisy(13, cycles, targets=targets)[0], None))


def test_runs_without_scatter_have_nothing_to_state_and_rounded_ones_something() -> None:
    exact = run(np.broadcast_to(np.arange(6.0)[:, None, None], (6, 5, 2)))
    assert not evaluate_uncertainty(exact, None).measured.expanded_uncertainty
    deviation = closed_form(6, 1.5, 2.0, 0.0)
    deviation[2, 1, 0] += 0.1
    check_sound(evaluate_uncertainty(run(np.repeat(deviation, 1, axis=1)), None))


def test_many_targets_and_many_draws_are_drawn_in_parts() -> None:
    test, _ = noisy(14, 3, targets=80)
    result = evaluate_uncertainty(test, None, samples=4000)
    check_sound(result)
    assert result.measured.standard_uncertainty["B_mean"] < 0.06
