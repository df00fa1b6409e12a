"""Output error: exact recovery, colour, starts, covariance, stability."""

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.printed_digits import PAPER_SPINDLE, PAPER_TABLE
from tests.proofs import quick_first
from tests.refusals import refused
from thermaxis.codes import Message
from thermaxis.thermal import (
    Experiment,
    OeOptions,
    PolynomialModel,
    Start,
    TransferFunction,
    oe,
    simulate_polynomial,
    simulate_transfer_function,
)
from thermaxis.thermal.transfer_function._oe_start import stabilised

TRUTH = PolynomialModel(
    ("spindle", "table"),
    (
        TransferFunction([1.0, -0.9, 0.1], [1.0, -1.5, 0.56]),
        TransferFunction([0.0, 0.0, 2.0, 0.4], [1.0, -0.95]),
    ),
    10.0,
)
COEFFICIENTS = [1.0, -0.9, 0.1, -1.5, 0.56, 2.0, 0.4, -0.95]


def cut_tests(sizes: tuple[int, ...], cut: int) -> list[Experiment]:
    rng = np.random.default_rng(0)
    made = []
    for n in sizes:
        u = np.cumsum(rng.normal(size=(n, 2)), axis=0)
        y = simulate_polynomial(TRUTH, u)
        y[rng.random(n) < 0.05] = np.nan
        made.append(Experiment(10.0, u[cut:], y[cut:]))
    return made


def test_the_papers_coefficients_come_back_from_their_own_record() -> None:
    u = np.cumsum(np.random.default_rng(0).normal(size=3000))
    for tf in (PAPER_SPINDLE.transfer_function, PAPER_TABLE.transfer_function):
        y = simulate_transfer_function(tf, u)
        result = oe([Experiment(1.0, u[:, None], y)], 3, 2, options=OeOptions(start=Start.REST))
        wanted = np.concatenate([tf.numerator[:2], tf.denominator[1:]])
        np.testing.assert_allclose(result.parameters, wanted, atol=1e-10)
        assert Message("warning-pole_oscillates", {"inputs": ("u1",)}) in result.warnings


def test_two_inputs_with_own_denominators_come_back_exactly() -> None:
    for start, cut in ((Start.STEADY, 0), (Start.FREE, 60)):
        result = oe(
            cut_tests((300, 200), cut),
            *((2, 1), (3, 2), (0, 2)),
            input_names=TRUTH.input_names,
            options=OeOptions(start=start),
        )
        np.testing.assert_allclose(result.parameters, COEFFICIENTS, atol=1e-10)
        assert result.stable
        assert result.fit_percent == pytest.approx(100.0, abs=1e-6)


def test_an_offset_and_a_pure_gain_come_back() -> None:
    u = np.random.default_rng(1).normal(size=(60, 1))
    result = oe([Experiment(1.0, u, 3.0 * u[:, 0] + 5.0)], 0, 1, options=OeOptions(constant=True))
    np.testing.assert_allclose(result.parameters, [3.0, 5.0], atol=1e-10)
    assert result.model.offset_um == pytest.approx(5.0)


def test_slow_lags_at_one_second_are_found_through_rounded_sensors() -> None:
    rng = np.random.default_rng(3)
    n = 10_000
    u = np.repeat(rng.uniform(0.0, 15.0, 20), 500)
    alpha = -np.expm1(-1.0 / 1500.0)
    u = lfilter([alpha], [1.0, alpha - 1.0], u)

    def lag(tau: float) -> np.ndarray:
        a = -np.expm1(-1.0 / tau)
        return lfilter([0.0, a], [1.0, a - 1.0], u)

    y = 14.0 * lag(100.0) + 26.0 * lag(1500.0) + rng.normal(size=n) * 0.4
    logged = np.round(u + rng.normal(size=n) * 0.02, 1)
    result = oe([Experiment(1.0, logged[:, None], y)], 2, 3)
    taus = result.model.transfer_functions[0].time_constants_s(1.0)
    np.testing.assert_allclose(taus, [1500.0, 100.0], rtol=0.1)
    assert result.dc_gain[0] == pytest.approx(40.0, abs=0.05)
    assert 0.0 < result.dc_gain_std[0] < 1.0
    assert result.noise_std_um == pytest.approx(0.4, rel=0.1)


@pytest.mark.parametrize(("colour", "low"), quick_first(1, [(0.0, 0.85), (0.95, 0.75)]))
def test_intervals_cover_the_truth_whatever_the_colour(colour: float, low: float) -> None:
    model = PolynomialModel(("a",), (TransferFunction([8.0, -7.7], [1.0, -0.99]),), 10.0)
    inside, ratios = [], []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        u = lfilter([0.02], [1.0, -0.98], np.repeat(rng.normal(size=20) * 4.0, 75))[:, None]
        e = rng.normal(size=1500) * np.sqrt(1.0 - colour**2)
        y = simulate_polynomial(model, u) + lfilter([1.0], [1.0, -colour], e)
        result = oe([Experiment(10.0, u, y)], 1, 2)
        error = result.parameters - [8.0, -7.7, -0.99]
        inside.append(np.abs(error) < 1.96 * result.std)
        ratios.append((result.dc_gain[0] - 30.0) / result.dc_gain_std[0])
    assert np.mean(inside) > low
    # white-residual theory gives 8.5 with the colour
    assert 0.6 < np.sqrt(np.mean(np.square(ratios))) < 1.7


def test_outputs_that_are_seen_rarely_give_honest_deviations() -> None:
    model = PolynomialModel(("a",), (TransferFunction([8.0, -7.7], [1.0, -0.99]),), 10.0)
    ratios = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        u = lfilter([0.02], [1.0, -0.98], np.repeat(rng.normal(size=40) * 4.0, 75))[:, None]
        noise = lfilter([1.0], [1.0, -0.95], rng.normal(size=3000) * np.sqrt(1.0 - 0.95**2))
        y = simulate_polynomial(model, u) + noise
        y[np.arange(3000) % 40 >= 4] = np.nan
        result = oe([Experiment(10.0, u, y)], 1, 2)
        ratios.append((result.dc_gain[0] - 30.0) / result.dc_gain_std[0])
    assert 0.5 < np.sqrt(np.mean(np.square(ratios))) < 2.0


def test_the_search_runs_free_as_well_as_the_truth() -> None:
    """Not with three lags a tenth apart, 842, 1069 and 1176 s, that make one of 1000 s."""
    model = PolynomialModel(("a",), (TransferFunction([8.0, -7.7], [1.0, -0.99]),), 10.0)
    rng = np.random.default_rng(4)
    u = np.repeat(rng.normal(size=12) * 4.0, 20)[:, None]
    y = simulate_polynomial(model, u) + rng.normal(size=240) * 0.3
    result = oe([Experiment(10.0, u, y)])
    (chosen,) = [trial for trial in result.search if trial.chosen]
    assert (chosen.numerator_order, chosen.denominator_order) == (1, 1)
    assert chosen.rmse_um < 0.4


def test_poles_outside_come_back_inside() -> None:
    for b in ([1.0, -1.02], [1.0, -2.3, 1.32], [1.0, 0.0, 1.44], [1.0, -1.0]):
        inside = stabilised(np.array(b), 0.9999)
        assert np.max(np.abs(np.roots(inside))) <= 0.9999 + 1e-12
    np.testing.assert_allclose(stabilised(np.array([1.0, -2.0]), 0.9999), [1.0, -0.5])
    kept = np.array([1.0, -0.5])
    assert stabilised(kept, 0.9999) is kept


def test_an_unstable_truth_gives_a_stable_model() -> None:
    u = np.random.default_rng(5).normal(size=80)
    y = np.zeros(80)
    for k in range(1, 80):
        y[k] = 1.03 * y[k - 1] + u[k]
    result = oe([Experiment(1.0, u[:, None], y)], 1, 1)
    assert result.stable


def test_a_time_constant_that_the_record_does_not_show_is_said() -> None:
    u = np.ones((200, 1)) * np.arange(200)[:, None] ** 0.5
    y = np.cumsum(u[:, 0]) * 0.01
    result = oe([Experiment(1.0, u, y)], 1, 2)
    assert "warning-extrapolated" in [warning.code for warning in result.warnings]


def test_a_dc_gain_that_the_record_does_not_determine_is_said() -> None:
    rng = np.random.default_rng(11)
    u = np.concatenate([[0.0], np.full(299, 5.0)])
    y = 5.0 * 20.0 * (1.0 - np.exp(-np.arange(300) / 3000.0)) + rng.normal(size=300)
    result = oe([Experiment(1.0, u[:, None], y)], 1, 2)
    assert "warning-dc_gain_undetermined" in [warning.code for warning in result.warnings]


def test_structures_that_make_no_sense_and_more_parameters_than_rows_are_refused() -> None:
    u = np.random.default_rng(8).normal(size=(10, 1))
    for arguments, options, code in (
        ((1,), OeOptions(), "half_orders"),
        ((1, 1), OeOptions(noise_order=-1), "oe_options_outside"),
        ((0, 0), OeOptions(), "no_coefficient"),
        ((1, -1), OeOptions(), "outside_range"),
        ((5, 5), OeOptions(), "rows_not_enough"),
    ):
        with refused(code):
            oe([Experiment(1.0, u, u[:, 0].copy())], *arguments, options=options)
