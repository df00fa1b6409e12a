"""ARX: exact recovery, missing rows, the search of orders, what it says about itself."""

import numpy as np
import pytest

from tests.polynomials import polynomial_model_of
from tests.refusals import refused
from thermaxis.thermal import (
    Experiment,
    ModalPart,
    PolynomialModel,
    ThermalModel,
    TransferFunction,
    arx,
    block_means,
    simulate_polynomial,
)

A = [1.0, -1.5, 0.56]
TRUTH = PolynomialModel(
    ("spindle", "table"),
    (TransferFunction([1.0, -0.9, 0.1], A), TransferFunction([0.0, 0.0, 2.0, 0.4], A)),
    10.0,
)
COEFFICIENTS = [-1.5, 0.56, 1.0, -0.9, 0.1, 2.0, 0.4]


def simulated_tests(
    model: PolynomialModel, sizes: list[int], seed: int, missing: float
) -> list[Experiment]:
    rng = np.random.default_rng(seed)
    made = []
    for n in sizes:
        u = np.cumsum(rng.normal(size=(n, len(model.input_names))), axis=0)
        y = simulate_polynomial(model, u)
        y[rng.random(n) < missing] = np.nan
        u[rng.random(u.shape) < missing] = np.nan
        made.append(Experiment(model.sample_time_s, u, y))
    return made


def test_two_tests_with_unequal_orders_and_missing_rows_give_the_coefficients_back() -> None:
    result = arx(
        simulated_tests(TRUTH, [300, 200], 0, 0.03),
        2,
        (3, 2),
        (0, 2),
        input_names=TRUTH.input_names,
    )
    np.testing.assert_allclose(result.parameters, COEFFICIENTS, atol=1e-12)
    assert result.parameter_names == (
        *("b_1", "b_2", "a_0 spindle", "a_1 spindle", "a_2 spindle", "a_2 table", "a_3 table"),
    )
    assert result.stable
    assert result.rows < 500
    np.testing.assert_allclose(result.dc_gain, [0.2 / 0.06, 2.4 / 0.06], rtol=1e-9)


def test_no_autoregression_is_a_regression_on_past_inputs() -> None:
    model = PolynomialModel(("a",), (TransferFunction([2.0, -1.0, 0.5], [1.0]),), 1.0)
    result = arx(simulated_tests(model, [50], 1, 0.0), 0, 3)
    np.testing.assert_allclose(result.parameters, [2.0, -1.0, 0.5], atol=1e-12)
    assert result.model.transfer_functions[0].poles.size == 0


def test_a_constant_becomes_the_offset() -> None:
    model = PolynomialModel(("a",), (TransferFunction([2.0, -1.0], [1.0, -0.9]),), 1.0, 7.0)
    result = arx(simulated_tests(model, [80], 2, 0.0), 1, 2, constant=True)
    assert result.model.offset_um == pytest.approx(7.0, abs=1e-9)
    assert result.fit_percent == pytest.approx(100.0, abs=1e-6)


def test_units_change_the_coefficients_and_nothing_else() -> None:
    made = simulated_tests(TRUTH, [200], 3, 0.0)
    noisy = [Experiment(e.sample_time_s, e.u, e.y + np.sin(np.arange(e.y.size))) for e in made]
    scaled = [Experiment(e.sample_time_s, e.u * [2.0, 1.0], e.y * 1000.0) for e in noisy]
    one, other = arx(noisy, 2, (3, 2), (0, 2)), arx(scaled, 2, (3, 2), (0, 2))
    factor = [1, 1, 500, 500, 500, 1000, 1000]
    np.testing.assert_allclose(other.parameters, one.parameters * factor, rtol=1e-9)
    np.testing.assert_allclose(other.std, one.std * factor, rtol=1e-9)
    assert other.fit_percent == pytest.approx(one.fit_percent, abs=1e-7)


def test_errors_over_stated_standard_deviations_have_unit_spread() -> None:
    ratios = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        u, e = rng.normal(size=400), rng.normal(size=400)
        y = np.zeros(400)
        for k in range(1, 400):
            y[k] = 0.8 * y[k - 1] + u[k] + 0.5 * u[k - 1] + e[k]
        result = arx([Experiment(1.0, u[:, None], y)], 1, 2)
        ratios.append((result.parameters - [-0.8, 1.0, 0.5]) / result.std)
    assert 0.8 < np.sqrt(np.mean(np.square(ratios))) < 1.2


def test_the_search_finds_orders_that_run_free_as_well_as_the_truth() -> None:
    rng = np.random.default_rng(4)
    made = [
        Experiment(e.sample_time_s, e.u, e.y + rng.normal(size=e.y.size) * 0.01)
        for e in simulated_tests(TRUTH, [400, 400], 4, 0.0)
    ]
    result = arx(made)
    chosen = [trial for trial in result.search if trial.chosen]
    assert len(chosen) == 1
    assert len(result.search) == 7
    assert chosen[0].denominator_order >= 2
    best = min(trial.rmse_um for trial in result.search)
    assert chosen[0].rmse_um < 2.0 * best
    assert result.fit_percent > 99.0


def test_an_unstable_fit_says_so() -> None:
    u = np.random.default_rng(5).normal(size=60)
    y = np.zeros(60)
    for k in range(1, 60):
        y[k] = 1.05 * y[k - 1] + u[k]
    result = arx([Experiment(1.0, u[:, None], y)], 1, 1)
    assert not result.stable
    assert [w.code for w in result.warnings] == ["warning-pole_unstable"]
    assert result.warnings[0].values["inputs"] == ("u1",)
    assert result.warnings[0].values["modulus"] == pytest.approx(1.05)


def test_a_short_sample_time_biases_and_is_said_to() -> None:
    model = polynomial_model_of(ThermalModel((ModalPart("a", 0.0, [30.0], [2000.0]),)), 1.0)
    u = np.repeat(np.random.default_rng(6).uniform(0, 10, 12), 1200)[:, None]
    y = simulate_polynomial(model, u) + np.random.default_rng(7).normal(size=u.shape[0]) * 0.4
    own = Experiment(1.0, u, y)
    short, long = (arx([block_means(own, rows)], 1, 2) for rows in (1, 60))
    tau_s = [
        float(r.model.transfer_functions[0].time_constants_s(t)[0])
        for r, t in ((short, 1.0), (long, 60.0))
    ]
    assert abs(long.dc_gain[0] - 30.0) < 0.5
    assert tau_s[1] == pytest.approx(2000.0, rel=0.05)
    assert tau_s[0] < 0.95 * tau_s[1]
    assert short.fit_percent < long.fit_percent - 5.0
    codes = [warning.code for warning in short.warnings]
    assert codes == ["warning-sample_time_short", "warning-residuals_not_white"]


def test_block_means_leave_out_what_is_missing() -> None:
    y = np.arange(40.0)
    y[0:2] = np.nan
    y[4:8] = np.nan
    u = np.ones((40, 1))
    short = block_means(Experiment(1.0, u, y), 4)
    assert short.sample_time_s == 4.0
    assert short.y[0] == 2.5
    assert np.isnan(short.y[1])
    assert short.y[2] == 9.5


def test_inputs_that_repeat_each_other_are_refused_by_name() -> None:
    u = np.random.default_rng(9).normal(size=(60, 1))
    y = np.cumsum(u[:, 0]) * 0.1 + np.random.default_rng(1).normal(size=60)
    with refused("coefficients_undetermined"):
        arx([Experiment(1.0, np.hstack([u, 2.0 * u]), y)], 1, 1)


def test_orders_that_make_no_sense_too_few_rows_and_unequal_sample_times_are_refused() -> None:
    u = np.random.default_rng(10).normal(size=(10, 1))
    test = Experiment(1.0, u, u[:, 0].copy())
    for orders, code in (
        ({"na": 1}, "half_orders"),
        ({"na": -1, "nb": 1}, "outside_range"),
        ({"na": 1, "nb": (1, 1)}, "count_not_inputs"),
        ({"na": 0, "nb": 0}, "no_coefficient"),
        ({"na": 4, "nb": 5}, "rows_not_enough"),
    ):
        with refused(code):
            arx([test], **orders)
    with refused("sample_times_differ"):
        arx([test, Experiment(2.0, u, u[:, 0].copy())], 1, 1)
    with refused("count_not_inputs", key="input_names"):
        arx([test], 1, 1, input_names=("a", "b"))
