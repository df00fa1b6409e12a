from dataclasses import replace

import numpy as np
import pytest
from scipy import special, stats

from tests.proofs import quick_first
from tests.refusals import refused
from tests.unit.positioning.builders import closed_form, run, stop_times
from thermaxis.codes import Message
from thermaxis.positioning import (
    FIGURE_KEYS,
    BudgetRow,
    DriftResult,
    FigureUncertainty,
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
from thermaxis.positioning.uncertainty._rounding import rounding_of
from thermaxis.positioning.uncertainty._true_values import (
    Estimate,
    covariances_of_truth,
    draw_levels,
    expected_s,
    log_likelihood,
    split_by_source,
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
) -> tuple[PositioningTest, np.ndarray, np.ndarray]:
    """Return a run, its true levels at the mean time and its drift since, exponential in time."""
    rng = np.random.default_rng(seed)
    target = 20.0 * np.arange(targets) + rng.uniform(-4.0, 4.0, targets)
    time_s = stop_times(targets, cycles, 8.0)
    level = axis_levels(axis, amount, target, rng)

    def drift_at(t: np.ndarray, x: np.ndarray) -> np.ndarray:
        return drift * (1.0 + (x - target.mean()) / 400.0) * -np.expm1(-t / 1800.0)

    drifted = drift_at(time_s, target[:, None, None])
    deviation = level[:, None, :] + drifted + NOISE * rng.normal(size=drifted.shape)
    at_mean = drift_at(np.mean(time_s), target)[:, None]
    return run(deviation, target, time_s=time_s), level + at_mean, drifted - at_mean[:, None, :]


def mean_of_s(drift: np.ndarray) -> np.ndarray:
    """Return the mean of the noncentral chi distribution of s with this drift, (m, 2)."""
    free = drift.shape[1] - 1
    offset = free * np.var(drift, axis=1, ddof=1) / NOISE**2
    factor = np.sqrt(2.0 / free) * special.gamma(0.5 * (free + 1)) / special.gamma(0.5 * free)
    return NOISE * factor * special.hyp1f1(-0.5, 0.5 * free, -0.5 * offset)


def figures_by_key(mean: np.ndarray, s: np.ndarray) -> dict[str, float]:
    return {key: float(value) for key, value in arrays_by_key(figures_of(mean, s)).items()}


def measured_figures(test: PositioningTest) -> dict[str, float]:
    result = evaluate_iso230_2(test)
    return {key: getattr(result, key) for key in FIGURE_KEYS}


@pytest.fixture(scope="module")
def drifting() -> tuple[PositioningTest, DriftResult]:
    test, *_ = noisy(3, 5, drift=6.0)
    return test, evaluate_drift(test)


# ---- what is promised ---------------------------------------------------------------------------


@pytest.mark.proof
@pytest.mark.parametrize(("axis", "cycles", "amount"), [("random", 5, 0.5), ("constant", 5, 3.0)])
def test_the_true_figure_lies_within_u_in_88_to_99_percent(
    axis: str, cycles: int, amount: float
) -> None:
    inside: list[bool] = []
    for seed in range(25):
        test, level, drift = noisy(seed, cycles, axis=axis, amount=amount)
        stated = evaluate_uncertainty(test, None, samples=300, seed=seed).measured
        truth = figures_by_key(level, mean_of_s(drift))
        figure = measured_figures(test)
        inside += [
            abs(figure[key] - truth[key]) <= stated.expanded_uncertainty[key] for key in SHOWN
        ]
    assert 0.88 <= np.mean(inside) <= 0.99


@pytest.mark.proof
def test_it_does_so_with_a_drift_for_all_three_figures_of_a_row() -> None:
    inside = np.zeros(3)
    for seed in range(12):
        test, level, drift = noisy(seed, 5, drift=6.0)
        found = evaluate_drift(test)
        result = evaluate_uncertainty(test, found, samples=300, seed=seed)
        # the run as it was without noise; the levels at t0; the run without noise and drift
        as_it_was = figures_by_key(level + np.mean(drift, axis=1), mean_of_s(drift))
        at_t0 = figures_by_key(level, np.full(level.shape, NOISE))
        still = figures_by_key(level, mean_of_s(0.0 * drift))
        figure = measured_figures(test)
        without = {key: float(v) for key, v in arrays_by_key(found.figures).items()}
        for key in SHOWN:
            effect = figure[key] - without[key] - (as_it_was[key] - still[key])
            inside += (
                abs(figure[key] - as_it_was[key]) <= result.measured.expanded_uncertainty[key],
                abs(without[key] - at_t0[key]) <= result.drift_free.expanded_uncertainty[key],
                abs(effect) <= result.drift_effect[key],
            )
    assert np.all(inside >= 0.85 * 12 * len(SHOWN))


def test_the_expectation_of_s_is_that_of_the_noncentral_chi_distribution() -> None:
    rng = np.random.default_rng(0)
    for cycles in (2, 3, 5, 10, 30):
        for size in (0.0, 0.3, 1.0, 5.0):
            drift = size * rng.normal(size=(4, cycles, 2))
            found = expected_s(
                np.full((4, 2), NOISE), np.var(drift, axis=1, ddof=1), np.full((4, 2), cycles)
            )
            assert found == pytest.approx(mean_of_s(drift), rel=0.05 if cycles == 2 else 0.015)


def test_the_bias_of_the_largest_s_is_that_of_the_chi_distribution() -> None:
    m, n = 16, 5
    s = np.linspace(0.0, 4.0, 4001)
    largest = stats.chi2.cdf((n - 1) * s**2, n - 1) ** m  # distribution of the largest of m
    mean_of_one = stats.chi.mean(n - 1) / np.sqrt(n - 1)
    expected = 4.0 * NOISE * (np.sum(1.0 - largest) * (s[1] - s[0]) - mean_of_one)
    stated = [
        evaluate_uncertainty(noisy(seed, n)[0], None, samples=300).measured.bias["R_forward"]
        for seed in range(25)
    ]
    assert np.mean(stated) == pytest.approx(expected, rel=0.15)


@pytest.mark.proof
def test_figure_less_bias_is_right_on_average_where_the_figure_is_not() -> None:
    error: list[float] = []
    left: list[float] = []
    for seed in range(40):
        test, level, drift = noisy(seed, 5, amount=0.5)
        bias = evaluate_uncertainty(test, None, samples=300).measured.bias["E"]
        truth = figures_by_key(level, mean_of_s(drift))["E"]
        error.append(measured_figures(test)["E"] - truth)
        left.append(error[-1] - bias)
    assert np.mean(error) > 0.08
    assert abs(np.mean(left)) < 0.05


@pytest.mark.parametrize(
    ("targets", "cycles", "amplitude", "least"),
    quick_first(
        1,
        [
            (11, 5, 3.0, {"M": 0.4, "E": 0.5, "A": 0.6, "R": 0.85, "B": 0.85}),
            (21, 10, 1.0, {"M": 0.6, "E": 0.7, "A": 0.7, "R": 0.85, "B": 0.85}),
        ],
    ),
)
def test_the_stated_bias_is_that_of_many_runs_and_no_instrument_changes_it(
    targets: int, cycles: int, amplitude: float, least: dict[str, float]
) -> None:
    rng = np.random.default_rng(20)
    x = np.linspace(0.0, 1.0, targets)
    wave = amplitude * (np.sin(2.0 * np.pi * x) + 4.0 / 3.0 * x)
    truth = wave[:, None] + np.array([0.0, -2.0])
    runs = truth[:, None, :] + NOISE * rng.normal(size=(2000, targets, cycles, 2))
    s = np.std(runs, axis=2, ddof=1)
    many = arrays_by_key(figures_of(np.mean(runs, axis=2), s))
    without_noise = figures_by_key(truth, np.full((targets, 2), np.mean(s)))
    stated: list[FigureUncertainty] = []
    for deviation in runs[:8]:
        test = run(deviation, 500.0 * x)
        stated.append(evaluate_uncertainty(test, None, samples=400).measured)
    other = evaluate_uncertainty(test, None, samples=400, budget=UncertaintyBudget(device=2.0))
    assert other.measured.bias == stated[-1].bias
    for key, share in least.items():
        true_bias = float(np.mean(many[key])) - without_noise[key]
        found = float(np.mean([one.bias[key] for one in stated]))
        assert share * true_bias < found < 1.25 * true_bias, (key, found / true_bias)


# ---- what it rests on ---------------------------------------------------------------------------


def test_what_estimates_say_of_true_values_agrees_with_dense_gaussian_algebra() -> None:
    rng = np.random.default_rng(1)
    noise, drift = (f @ f.T for f in rng.normal(size=(2, 6, 8)))
    scatter = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
    line = np.column_stack((np.ones(6), np.arange(6.0)))
    truth = np.diag(scatter**2) + 0.3
    prior = np.linalg.inv(truth)
    through = prior @ line
    prior -= through @ np.linalg.solve(line.T @ through, through.T)
    inverse = np.linalg.inv(noise + drift)
    expected = np.linalg.solve(inverse + prior, inverse)
    values, errors = split_by_source(noise, drift, truth, line)
    assert values == pytest.approx(expected, abs=1e-9)
    # what is left over is shared out in proportion to the two covariances
    assert errors == pytest.approx(drift @ inverse @ (np.eye(6) - expected), abs=1e-9)


def test_the_draws_have_the_covariance_of_the_posterior() -> None:
    rng = np.random.default_rng(2)
    value = rng.normal(size=(8, 1)) * 3.0
    estimate = Estimate(
        position=np.arange(8.0),
        approaches=(0,),
        level=value[:, 0],
        noise_covariance=0.04 * np.eye(8),
        reading_variance=np.full(8, 0.16),
        share={},
        rounding=None,
        drift_covariance=np.full((8, 8), 0.09),
        drift=np.zeros(8),
        spread=np.zeros(8),
        s=np.full(8, 0.4),
        free=np.full(8, 1000.0),
        readings=np.full(8, 4.0),
    )
    level, by_drift = draw_levels(estimate, 20_000, np.random.default_rng(3))
    # the scatter is fifteen times the noise: the estimates are hardly drawn towards the line
    assert np.mean(level, axis=0) == pytest.approx(value[:, 0], abs=0.03)
    assert np.std(level, axis=0) == pytest.approx(np.hypot(0.2, 0.3), rel=0.05)
    # the levels of the run as it was are certain to the noise alone
    assert np.std(level + by_drift, axis=0) == pytest.approx(0.2, rel=0.05)


def test_the_likelihood_of_variances_is_that_of_the_f_distribution() -> None:
    variance, free = np.array([0.5, 1.2, 2.0]), np.array([4.0, 4.0, 3.0])
    centre = np.array([0.7, 1.0, 1.9])
    expected = [float(np.sum(stats.f.logpdf(variance / c, free, 7.0) - np.log(c))) for c in centre]
    found = log_likelihood(variance, free, 7.0, centre)
    assert np.diff(found) == pytest.approx(np.diff(expected))


def test_scatter_about_the_line_is_found_and_none_is_found_where_there_is_none() -> None:
    rng = np.random.default_rng(4)
    m, position = 150, np.linspace(0.0, 600.0, 150)
    x = np.column_stack((np.ones(m), position / 300.0 - 1.0))
    noise = rng.normal(0.0, 0.1, m)
    own, waves = rng.normal(0.0, 0.5, m), np.sin(position / 60.0)

    def found(value: np.ndarray) -> np.ndarray:
        return covariances_of_truth(value + noise, 0.01 * np.eye(m), x, position, 5)

    # independent from target to target; smooth along the axis; none
    assert np.sqrt(found(own)[:, 0, 0]) == pytest.approx(0.5, rel=0.15)
    assert np.max(found(own)[:, 0, 1]) < 0.05
    assert np.min(found(waves)[:, 0, 1] / found(waves)[:, 0, 0]) > 0.98
    assert np.max(found(0.0 * own)[:, 0, 0]) < 0.05**2


@pytest.mark.proof
def test_a_target_that_stands_out_is_named_and_others_are_not() -> None:
    rng = np.random.default_rng(5)
    line, position = np.ones((16, 1)), np.arange(16.0)
    named = 0
    for _ in range(100):
        value = rng.normal(0.0, 0.25, 16)
        named += bool(standing_out(value, 0.0625 * np.eye(16), line, position))
        value[7] += 3.0
        assert standing_out(value, 0.0625 * np.eye(16), line, position)[0] == 7
    assert named <= 5  # 1 % is the level


def test_noise_that_is_correlated_in_time_makes_the_mean_reversal_value_less_certain(
    drifting: tuple[PositioningTest, DriftResult],
) -> None:
    test, drift = drifting
    independent = evaluate_uncertainty(test, drift).measured.corrected_standard_uncertainty[
        "B_mean"
    ]
    alike = replace(drift, noise_time=60.0, noise_share=0.5)
    found = evaluate_uncertainty(test, alike).measured.corrected_standard_uncertainty["B_mean"]
    # the variance of a mean of readings, forward less backward, summed over all pairs of them
    time = test.time_s.ravel()
    sign = np.broadcast_to([1.0, -1.0], test.time_s.shape).ravel()
    pairs = np.exp(-np.abs(time[:, None] - time) / 60.0)
    ratio = 0.5 + 0.5 * float(sign @ pairs @ sign) / time.size
    assert found / independent == pytest.approx(np.sqrt(ratio), rel=0.05)


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


def budget_of(stated: FigureUncertainty, figure: str) -> dict[str, BudgetRow]:
    return {row.quantity: row for row in stated.budget if row.figure == figure}


def test_the_terms_have_the_values_that_a_pocket_calculator_gives() -> None:
    rows = budget_of(evaluate_uncertainty(metre(), None, budget=FULL).measured, "E")
    third = 1.0 / np.sqrt(12.0)
    for key, value, u, sensitivity in (
        ("device", 0.7, 0.35, 1.0),
        ("misalignment", 0.25, 0.5 * third, 1.0),
        ("material_temperature", 0.5, third, 12.0),
        ("expansion_coefficient", 1.0, 2.0 * third, 5.0),
        ("environmental_variation", 0.85, 1.7 * third, None),
    ):
        row = rows[key]
        assert (row.value, row.standard_uncertainty) == pytest.approx((value, u)), key
        if sensitivity is not None:
            assert row.sensitivity == pytest.approx(sensitivity)
            assert row.contribution == pytest.approx(sensitivity * u)
    budget = UncertaintyBudget(device_range=1.0, device_range_um_per_m=2.0)
    stated = evaluate_uncertainty(metre(), None, budget=budget).measured
    assert budget_of(stated, "M")["device"].contribution == pytest.approx(3.0 * third)


def test_systematic_terms_alone_give_their_root_sum_of_squares_and_nothing_for_the_reversal() -> (
    None
):
    budget = replace(FULL, environmental_variation=None)
    stated = evaluate_uncertainty(metre(), None, budget=budget, samples=20_000).measured
    rectangular = np.array([0.5, 12.0, 10.0]) / np.sqrt(12.0)
    expected = np.sqrt(0.35**2 + np.sum(rectangular**2))
    for key in ("M", "E_forward", "E_backward", "E"):
        assert stated.combined(key) == pytest.approx(expected, rel=0.02)
        assert stated.expanded_uncertainty[key] == pytest.approx(2.0 * expected, rel=0.03)
        assert stated.coverage_factor[key] == pytest.approx(2.0, rel=0.02)
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


def test_a_figure_that_bends_has_a_row_for_it() -> None:
    # the range of an axis without errors is the size of the instrument's error, whatever its sign
    stated = evaluate_uncertainty(
        run(np.zeros((5, 2, 2))), None, budget=UncertaintyBudget(device=1.0), samples=20_000
    ).measured
    rows = budget_of(stated, "M")
    assert rows["nonlinearity"].contribution == pytest.approx(0.5, rel=0.02)
    assert rows["device"].contribution == pytest.approx(0.0, abs=0.02)
    assert (stated.bias["M"], stated.combined("M")) == pytest.approx((0.0, 0.5), rel=0.02)
    assert stated.coverage_factor["M"] == pytest.approx(2.0, rel=0.03)


def test_the_budget_adds_up_and_agrees_with_plain_formulas() -> None:
    n, noise = 40, 0.2
    test = with_extremes_at_one_place(n)
    budget = UncertaintyBudget(device=1.0)
    stated = evaluate_uncertainty(test, None, budget=budget, samples=20_000).measured
    for key in FIGURE_KEYS:
        rows = budget_of(stated, key).values()
        total = np.sqrt(sum(row.contribution**2 for row in rows))
        assert total == pytest.approx(stated.combined(key)), key
        for row in rows:
            assert abs(row.sensitivity) * row.standard_uncertainty == pytest.approx(
                row.contribution
            )
    rows = {key: budget_of(stated, key) for key in FIGURE_KEYS}
    pooled = np.sqrt(np.mean(np.var(test.deviation, axis=1, ddof=1)))
    assert rows["B"]["noise"].value == pytest.approx(pooled, rel=0.01)
    # the largest reversal value is one difference of two means, the range of means as well
    assert rows["B"]["noise"].contribution == pytest.approx(pooled * np.sqrt(2.0 / n), rel=0.1)
    assert rows["E"]["noise"].contribution == pytest.approx(pooled * np.sqrt(2.0 / n), rel=0.2)
    assert rows["M"]["noise"].contribution == pytest.approx(pooled * np.sqrt(1.0 / n), rel=0.2)
    # the scatter of target 3 alone, five times that of the others
    own = 4.0 * 5.0 * noise / np.sqrt(2.0 * (n - 1.0))
    assert rows["R_forward"]["noise"].contribution == pytest.approx(own, rel=0.3)
    assert rows["E"]["device"].contribution == pytest.approx(0.5)
    assert rows["B"]["device"].contribution == 0.0


def test_the_environment_counts_by_what_it_is_more_than_the_scatter_of_the_readings(
    drifting: tuple[PositioningTest, DriftResult],
) -> None:
    test, drift = drifting
    without = evaluate_uncertainty(test, drift)
    quiet, loud = (
        evaluate_uncertainty(test, drift, budget=UncertaintyBudget(environmental_variation=v))
        for v in (0.5, 5.0)
    )
    for which in ("measured", "drift_free"):
        before, within, beyond = (getattr(r, which) for r in (without, quiet, loud))
        assert within.expanded_uncertainty == before.expanded_uncertainty
        assert Message("left_out-in_scatter") in within.left_out
        assert Message("left_out-in_scatter") not in beyond.left_out
        for key in ("B_mean", "M", "E", "A"):
            assert beyond.expanded_uncertainty[key] > before.expanded_uncertainty[key]
    rows = budget_of(loud.measured, "B_mean")
    reading = np.hypot(*(rows[key].contribution for key in ("noise", "environmental_variation")))
    assert reading == pytest.approx(5.0 / np.sqrt(12.0) * np.sqrt(2.0 / (5 * 16)), rel=0.1)


def test_without_a_budget_the_result_says_what_is_in_it_and_what_is_not(
    drifting: tuple[PositioningTest, DriftResult],
) -> None:
    test, drift = drifting
    result = evaluate_uncertainty(test, drift)
    assert result.label == "GUM"
    for stated in (result.measured, result.drift_free):
        assert {row.quantity for row in stated.budget} == {"noise", "extremes"}
        assert stated.left_out == (Message("left_out-no_budget"),)
        assert list(stated.expanded_uncertainty) == list(FIGURE_KEYS)
    alone = evaluate_uncertainty(test, None)
    assert alone.drift_free is None
    assert not alone.drift_effect
    assert Message("left_out-drift_unknown") in alone.measured.left_out


def test_a_stated_uncertainty_comes_in_place_of_the_evaluated_one(
    drifting: tuple[PositioningTest, DriftResult],
) -> None:
    result = evaluate_uncertainty(*drifting)
    assert result.with_stated({}) == result
    stated = result.with_stated({"A": 1.6}).measured
    assert (stated.expanded_uncertainty["A"], stated.combined("A")) == (1.6, 0.8)
    assert stated.stated == ("A",)
    assert not budget_of(stated, "A")
    assert list(stated.expanded_uncertainty) == list(FIGURE_KEYS)
    assert stated.expanded_uncertainty["E"] == result.measured.expanded_uncertainty["E"]


def test_coefficient_and_temperatures_of_the_run_serve_where_the_budget_has_none() -> None:
    budget = UncertaintyBudget(
        material_temperature_interval_k=1.0, expansion_coefficient_interval_ppm_per_k=2.0
    )
    with refused("no_expansion_coefficient"):
        evaluate_uncertainty(metre(), None, budget=budget)
    environment = {"expansion_coefficient_ppm_per_k": StartEnd(12.0, None)}
    with refused("no_material_temperature"):
        evaluate_uncertainty(replace(metre(), environment=environment), None, budget=budget)
    nil = UncertaintyBudget(
        material_temperature_interval_k=0.0, expansion_coefficient_interval_ppm_per_k=0.0
    )  # needs neither
    lacking = evaluate_uncertainty(metre(), None, budget=nil, samples=100).measured.left_out
    terms = {one.values.get("term") for one in lacking}
    assert not terms & {"material_temperature", "expansion_coefficient"}
    environment["material_temperature_1_c"] = StartEnd(21.0, 17.0)
    test = replace(metre(), environment=environment)
    rows = budget_of(evaluate_uncertainty(test, None, budget=budget).measured, "E")
    assert rows["material_temperature"].sensitivity == pytest.approx(12.0)
    assert rows["expansion_coefficient"].sensitivity == pytest.approx(3.0)


def test_a_rotary_axis_has_no_terms_of_length() -> None:
    test = run(np.zeros((4, 1, 2)) + np.arange(4.0)[:, None, None], kind=AxisKind.ROTARY)
    stated = evaluate_uncertainty(test, None, budget=UncertaintyBudget(device=0.5)).measured
    assert set(budget_of(stated, "E")) == {"extremes", "device"}
    terms = {str(one.values.get("term", "")) for one in stated.left_out}
    assert not any("expansion" in term or "misalignment" in term for term in terms)
    with refused("linear_axis_only", key="misalignment_mm"):
        evaluate_uncertainty(test, None, budget=UncertaintyBudget(misalignment_mm=1.0))


def test_an_instrument_stated_twice_and_impossible_numbers_are_refused() -> None:
    with refused("instrument_twice"):
        UncertaintyBudget(device=0.1, device_range_um_per_m=1.0)
    for value in (-1.0, np.nan, np.inf):
        with refused("outside_range", key="misalignment_mm"):
            UncertaintyBudget(misalignment_mm=value)
    for code, options in (
        ("outside_range", {"samples": 99}),
        ("outside_range", {"samples": 10**7}),
        ("negative", {"seed": -1}),
    ):
        with refused(code, key=next(iter(options))):
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
    test, *_ = noisy(7)
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
    u = stated.corrected_standard_uncertainty["B_mean"]
    assert stated.expanded_uncertainty["B_mean"] == pytest.approx(2.0 * u, rel=0.03)
    # a mean of 16 differences of means of 5 readings each
    assert u == pytest.approx(NOISE * np.sqrt(2.0 / (5 * 16)), rel=0.2)
    assert abs(stated.bias["B_mean"]) < 0.01
    assert pytest.approx(stats.norm.cdf(2.0) - stats.norm.cdf(-2.0)) == PROBABILITY


def test_the_drift_is_part_of_the_measured_repeatability_and_its_effect_stands_beside() -> None:
    test, level, drift = noisy(10, 10, drift=12.0)
    found = evaluate_drift(test)
    result = evaluate_uncertainty(test, found)
    figure, without = measured_figures(test)["R"], float(found.figures.R)
    truth = figures_by_key(level + np.mean(drift, axis=1), mean_of_s(drift))["R"]
    still = figures_by_key(level, mean_of_s(0.0 * drift))["R"]
    assert truth - still > 2.0
    assert figure == pytest.approx(truth, abs=result.measured.expanded_uncertainty["R"])
    assert figure - without == pytest.approx(truth - still, abs=result.drift_effect["R"])
    assert abs(result.measured.bias["R"]) < 0.6
    assert result.measured.expanded_uncertainty["R"] < 1.5
    assert result.drift_effect["R"] < 1.5


# ---- runs that are not as usual -----------------------------------------------------------------


def check_sound(result: UncertaintyResult) -> None:
    for stated in (result.measured, result.drift_free):
        if stated is None:
            continue
        assert stated.expanded_uncertainty.keys() == stated.bias.keys()
        for key, value in stated.expanded_uncertainty.items():
            assert np.isfinite(value)
            assert value > 0.0
            assert (
                value + 1e-9
                >= abs(stated.bias[key]) - 2.0 * stated.corrected_standard_uncertainty[key]
            )


def test_a_unidirectional_run_has_the_figures_of_its_approach() -> None:
    test, *_ = noisy(11, drift=6.0)
    deviation = test.deviation.copy()
    deviation[..., 1] = np.nan
    test = replace(test, deviation=deviation)
    result = evaluate_uncertainty(test, evaluate_drift(test))
    check_sound(result)
    assert set(result.measured.bias) == {"E_forward", "R_forward", "A_forward"}


def test_missing_readings_and_few_cycles_or_targets_are_no_obstacle() -> None:
    test, *_ = noisy(12, drift=6.0)
    deviation = test.deviation.copy()
    deviation[3, 1, 0] = deviation[7, :3, 1] = np.nan
    test = replace(test, deviation=deviation)
    check_sound(evaluate_uncertainty(test, evaluate_drift(test)))
    for targets, cycles in ((2, 5), (3, 3), (4, 4), (16, 2)):
        check_sound(evaluate_uncertainty(noisy(13, cycles, targets=targets)[0], None))


def test_runs_without_scatter_have_nothing_to_state_and_rounded_ones_something() -> None:
    exact = run(np.broadcast_to(np.sqrt(np.arange(6.0))[:, None, None], (6, 5, 2)))
    assert exact.resolution == 0.0
    assert not evaluate_uncertainty(exact, None).measured.expanded_uncertainty
    deviation = closed_form(6, 1.5, 2.0, 0.0)
    deviation[2, 1, 0] += 0.1
    check_sound(evaluate_uncertainty(run(np.repeat(deviation, 1, axis=1)), None))


def rounded(seed: int, step: float, cycles: int = 5) -> tuple[PositioningTest, np.ndarray]:
    test, level, _ = noisy(seed, cycles, amount=1.5)
    deviation = step * np.rint(test.deviation / step)
    return run(deviation, test.target, time_s=test.time_s), level


def test_the_step_of_rounded_readings_is_seen_and_none_where_there_is_none() -> None:
    assert noisy(1)[0].resolution == 0.0
    for step in (0.01, 0.3, 1.2, 4.0):
        test, _ = rounded(1, step)
        assert test.resolution == pytest.approx(step)
    counts = np.rint(noisy(1)[0].deviation / 0.6103515625)
    off_the_grid = np.sqrt(np.arange(16.0))[:, None, None]
    assert run(0.6103515625 * counts + off_the_grid).resolution == pytest.approx(0.6103515625)
    alike = run(np.repeat(rounded(1, 4.0)[0].deviation[:, :1], 4, axis=1))  # all readings repeat
    assert alike.resolution == pytest.approx(4.0)


def test_what_readings_share_of_their_rounding_is_as_in_rounded_numbers() -> None:
    rng = np.random.default_rng(3)
    level, drift = rng.uniform(0.0, 50.0, (40_000, 1)), 0.1 * np.arange(5.0)
    for std in (0.05, 0.2, 0.6):
        true = level + drift + std * rng.normal(size=(40_000, 5))
        seen = np.rint(true)
        rounding = rounding_of(1.0, drift[None])
        variance = float(np.mean(np.var(seen - drift, axis=1, ddof=1)))
        assert variance - rounding.in_scatter(np.array([variance])) == pytest.approx(
            std**2, abs=0.004
        )
        error = seen - true
        pairs = (np.sum(error, axis=1) ** 2 - np.sum(error**2, axis=1)) / 20.0
        assert rounding.of_mean(np.array([variance])) == pytest.approx(np.mean(pairs), abs=0.003)


@pytest.mark.parametrize(
    "step", quick_first(1, [1.2, 4.0])
)  # three and ten standard deviations of the noise
def test_coarse_readings_widen_u_and_have_a_row_that_does_not_average_out(step: float) -> None:
    inside: list[bool] = []
    for seed in range(12):
        test, level = rounded(seed, step)
        stated = evaluate_uncertainty(test, None, samples=300, seed=seed).measured
        truth = figures_by_key(level, mean_of_s(np.zeros((16, 5, 2))))
        figure = measured_figures(test)
        inside += [
            abs(figure[key] - truth[key]) <= stated.expanded_uncertainty[key] for key in SHOWN
        ]
    assert np.mean(inside) >= 0.88
    row = budget_of(stated, "B_mean")["resolution"]
    third = step / np.sqrt(12.0)
    assert (row.value, row.standard_uncertainty) == pytest.approx((step / 2.0, third))
    if step == 4.0:  # the readings of a target are all rounded alike: five tell as much as one
        assert row.contribution == pytest.approx(third * np.sqrt(2.0 / 16.0), rel=0.25)


@pytest.mark.proof
def test_many_targets_and_many_draws_are_drawn_in_parts() -> None:
    test, *_ = noisy(14, 3, targets=80)
    result = evaluate_uncertainty(test, None, samples=4000)
    check_sound(result)
    assert result.measured.corrected_standard_uncertainty["B_mean"] < 0.06


def test_a_target_that_scatters_alone_has_the_uncertainty_of_its_own_few_readings() -> None:
    rng = np.random.default_rng(5)
    deviation = rng.normal(size=(8, 5, 2))
    deviation[2, :, 0] = 40.0 * np.array([-0.9, 0.3, 1.1, -0.4, -0.1])
    test = run(deviation, time_s=stop_times(8, 5))
    stated = evaluate_uncertainty(test, None).measured.expanded_uncertainty["R_forward"]
    s = float(np.std(deviation[2, :, 0], ddof=1))
    expected_s = 0.93999 * s * np.sqrt(4.0 / rng.chisquare(4, 100_000))
    alone = float(np.quantile(np.abs(4.0 * (expected_s - s)), 0.9545))
    assert stated == pytest.approx(alone, rel=0.2)
