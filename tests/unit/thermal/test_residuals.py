"""Residuals: bands that hold, effective rows, poles and step responses with their deviations."""

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import f as f_distribution

from tests.refusals import refused
from thermaxis.thermal import (
    Experiment,
    PolynomialModel,
    TransferFunction,
    analyse_residuals,
    arx,
    check_linearity,
    frequency_deviations,
    pole_zero_map,
    simulate_polynomial,
    step_responses,
)
from thermaxis.thermal.transfer_function._residuals import correlation


def slow(rng: np.random.Generator, n: int, pole: float) -> np.ndarray:
    return lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], rng.normal(size=n + 500))[500:]


def test_correlations_are_the_sums_over_the_pairs_that_are_present() -> None:
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=50), rng.normal(size=50)
    a[[3, 20]] = np.nan
    values, pairs = correlation([a], [b], 5)
    for lag in range(-5, 6):
        products = [
            a[k + lag] * b[k] for k in range(50) if 0 <= k + lag < 50 and not np.isnan(a[k + lag])
        ]
        assert pairs[lag + 5] == len(products)
        scale = np.sqrt(np.nanmean(a**2) * np.mean(b**2))
        wanted = np.mean(products) * (50 - abs(lag)) / 50 / scale
        assert values[lag + 5] == pytest.approx(wanted, abs=1e-12)


def test_a_white_residual_stays_within_its_bands_and_a_coloured_one_does_not() -> None:
    inside, white = [], 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        result = analyse_residuals([rng.normal(size=800)], [rng.normal(size=(800, 1))])
        white += result.white
        inside.append(np.abs(result.autocorrelation[1:]) <= result.autocorrelation_band[1:])
    assert white >= 36
    assert 0.975 < np.mean(inside) < 1.0
    rng = np.random.default_rng(1)
    coloured = analyse_residuals([slow(rng, 800, 0.9)], [rng.normal(size=(800, 1))])
    assert not coloured.white
    assert coloured.residual_effective_rows < 200
    wave = np.sin(np.linspace(0.0, 2.0 * np.pi, 400))  # negative correlations as large as positive
    once = analyse_residuals([wave + 0.1 * rng.normal(size=400)], [rng.normal(size=(400, 1))])
    assert once.residual_effective_rows < 10


def test_slow_but_independent_series_are_not_called_dependent() -> None:
    found, naive = 0, 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        e, u = slow(rng, 1000, 0.97), slow(rng, 1000, 0.97)
        found += not analyse_residuals([e], [u[:, None]]).independent[0]
        naive += bool(np.any(np.abs(correlation([e], [u], 25)[0]) > 3.3 / np.sqrt(1000)))
    assert found <= 4
    assert naive > 20


def test_levels_of_several_tests_are_no_influence() -> None:
    found = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        e = [rng.normal(size=400) + rng.normal(0.0, 2.0) for _ in range(4)]
        u = [slow(rng, 400, 0.97)[:, None] + rng.normal(0.0, 5.0) for _ in range(4)]
        found += not analyse_residuals(e, u).independent[0]
    assert found <= 2


def test_a_random_walk_below_noise_is_not_called_dependent() -> None:
    found = 0
    for seed in range(150):
        rng = np.random.default_rng(seed)
        u = slow(rng, 400, 0.97)[:, None]
        e = 0.07 * np.cumsum(rng.normal(size=400)) + rng.normal(size=400)
        found += not analyse_residuals([e], [u]).independent[0]
    assert found <= 8


def test_a_residual_that_follows_an_input_is_seen_at_its_lag() -> None:
    rng = np.random.default_rng(2)
    u = rng.normal(size=(500, 2))
    e = slow(rng, 500, 0.8)
    e[2:] += 0.5 * u[:-2, 0]
    result = analyse_residuals([e], [u])
    assert result.independent == (False, True)
    assert result.input_lags[0] == 2.0
    # the F test of two regressions, with and without the input, at the order of least AIC
    own = [e[16 - k : 500 - k] for k in range(1, 16)]
    past = [u[16 - k : 500 - k, 1] for k in (0, 1, 2, 4, 8, 16)]

    def squares(order: int, more: list[np.ndarray]) -> float:
        table = np.column_stack([np.ones(484), *own[:order], *more])
        return float(np.linalg.lstsq(table, e[16:], rcond=None)[1][0])

    order = min(range(5, 16), key=lambda m: 483 * np.log(squares(m, [])) + 2 * m)
    free = 484 - order - 7
    ratio = (squares(order, []) / squares(order, past) - 1.0) * free / 6
    assert result.input_p[1] == pytest.approx(f_distribution.sf(ratio, 6, free))


def test_series_that_do_not_fit_are_refused() -> None:
    with refused("wrong_shape"):
        analyse_residuals([np.zeros(5)], [])
    with refused("wrong_shape"):
        analyse_residuals([np.zeros(50)], [np.zeros((40, 1))])
    with refused("too_few_residuals"):
        analyse_residuals([np.zeros(10)], [np.zeros((10, 1))])


def fitted(seed: int) -> object:
    rng = np.random.default_rng(seed)
    u, e = np.repeat(rng.normal(size=60), 10), rng.normal(size=600) * 0.3
    y = np.zeros(600)
    for k in range(1, 600):
        y[k] = 0.9 * y[k - 1] + u[k] + 0.5 * u[k - 1] + e[k]
    return arx([Experiment(2.0, u[:, None], y)], 1, 2)


def test_deviations_of_step_response_dc_gain_and_time_constant_are_those_over_seeds() -> None:
    results = [fitted(seed) for seed in range(80)]
    steps = np.array([step_responses(r, 200).response[:, 0] for r in results])
    stated = np.array([step_responses(r, 200).std[:, 0] for r in results])
    ratio = np.std(steps, axis=0) / np.mean(stated, axis=0)
    assert 0.8 < ratio.min()
    assert ratio.max() < 1.25
    hz = np.array([1e-4, 0.01, 0.1])
    turn = np.exp(-2j * np.pi * hz * 2.0)
    parts = [r.model.transfer_functions[0] for r in results]
    sines = np.array([np.polyval(p.numerator[::-1], turn) for p in parts])
    sines /= np.array([np.polyval(p.denominator[::-1], turn) for p in parts])
    off = sines - np.mean(sines, axis=0)
    expected = [frequency_deviations(r, hz) for r in results]
    plain, square = (np.mean([e[k][:, 0] for e in expected], axis=0) for k in (0, 1))
    np.testing.assert_allclose(np.mean(np.abs(off) ** 2, axis=0), plain, rtol=0.4)
    np.testing.assert_allclose(np.abs(np.mean(off**2, axis=0) - square) / plain, 0.0, atol=0.4)
    gains = np.array([r.dc_gain[0] for r in results])
    assert np.std(gains) == pytest.approx(np.mean([r.dc_gain_std[0] for r in results]), rel=0.25)
    maps = [pole_zero_map(r)[0] for r in results]
    taus = [m.time_constants_s[0] for m in maps]
    assert np.std(taus) == pytest.approx(
        np.mean([m.time_constants_std_s[0] for m in maps]), rel=0.25
    )
    np.testing.assert_allclose(step_responses(results[0], 3).times_s, [0.0, 2.0, 4.0])


def test_a_step_response_ends_at_the_dc_gain() -> None:
    result = fitted(0)
    assert step_responses(result, 2000).response[-1, 0] == pytest.approx(result.dc_gain[0])
    with refused("not_positive", key="rows"):
        step_responses(result, 0)


def test_a_pole_that_a_zero_cancels_is_named() -> None:
    rng = np.random.default_rng(3)
    u = rng.normal(size=(400, 1))
    truth = PolynomialModel(("a",), (TransferFunction([1.0, -0.2], [1.0, -0.9]),), 1.0)
    y = simulate_polynomial(truth, u) + rng.normal(size=400) * 1e-6
    found = pole_zero_map(arx([Experiment(1.0, u, y)], 1, 2))[0]
    assert found.cancelling == ()
    assert found.poles[0].real == pytest.approx(0.9, abs=1e-4)
    assert found.zeros[0].real == pytest.approx(0.2, abs=1e-4)


def heated_and_cooled(ratio: float, seed: int) -> tuple[Experiment, np.ndarray]:
    rng = np.random.default_rng(seed)
    n = 2000
    u = np.concatenate([np.full(n // 2, 10.0), np.zeros(n // 2)])
    simulated = 20.0 * lfilter([0.0, 1 / 400], [1.0, -1 + 1 / 400], u)
    y = np.cumsum(np.diff(simulated, prepend=0.0) * np.where(u > 0, 1.0, ratio))
    y += 1.5 * slow(rng, n, 0.99) + rng.normal(size=n) * 0.4
    return Experiment(10.0, u[:, None], y), simulated


def test_a_machine_that_cools_otherwise_is_found_and_a_linear_one_is_left_alone() -> None:
    found = 0
    for seed in range(25):
        test, simulated = heated_and_cooled(1.0, seed)
        found += not check_linearity([test], [simulated]).linear
    assert found <= 2
    test, simulated = heated_and_cooled(0.85, 0)
    result = check_linearity([test], [simulated])
    assert not result.linear
    assert result.heating_gain == pytest.approx(1.0, abs=0.03)
    assert result.cooling_gain == pytest.approx(0.85, abs=0.03)
    assert result.heating_um == pytest.approx(200.0, rel=0.1)


def test_one_phase_alone_is_refused() -> None:
    test, simulated = heated_and_cooled(1.0, 0)
    half = Experiment(10.0, test.u[:1000], test.y[:1000])
    with refused("phase_too_short"):
        check_linearity([half], [simulated[:1000]])
    with refused("wrong_shape", key="simulated_um"):
        check_linearity([test], [simulated[:10]])
