"""Simple models and the figures by which every model is judged."""

import numpy as np
import pytest

from tests.refusals import refused
from thermaxis.thermal import (
    Baseline,
    Experiment,
    ModalPart,
    ThermalModel,
    fit_baseline,
    fit_percent,
    simulate_modal,
)
from thermaxis.thermal.verification import AVERAGE_LAGS_S


def walk(seed: int, n: int) -> np.ndarray:
    return np.cumsum(np.random.default_rng(seed).normal(size=(n, 2)), axis=0)


def test_the_fit_is_equation_4_with_the_mean_of_the_measured_output() -> None:
    measured = np.array([1.0, 2.0, 4.0, np.nan, 9.0])
    simulated = np.array([1.5, 2.0, 3.0, 5.0, 7.0])
    residual = np.array([-0.5, 0.0, 1.0, 2.0])
    about_mean = np.array([1.0, 2.0, 4.0, 9.0]) - 4.0
    wanted = 100.0 * (1.0 - np.sqrt(np.sum(residual**2)) / np.sqrt(np.sum(about_mean**2)))
    assert fit_percent(measured, simulated) == pytest.approx(wanted)


def test_a_perfect_model_fits_100_percent_and_the_mean_0_percent() -> None:
    y = walk(0, 50)[:, 0]
    assert fit_percent(y, y) == 100.0
    assert fit_percent(y, np.full(50, np.mean(y))) == pytest.approx(0.0, abs=1e-9)
    assert fit_percent(y, -5.0 * y) < 0.0
    for measured, code in (
        (np.full(5, 3.0), "fit_undefined"),
        (np.full(5, np.nan), "no_row_to_compare"),
        (np.zeros(4), "wrong_shape"),
    ):
        with refused(code):
            fit_percent(measured, np.zeros(5))


def test_a_static_machine_is_found_by_the_static_regression() -> None:
    u = walk(1, 100)
    y = u @ [3.0, -2.0] + 5.0
    y[::9] = np.nan
    model = fit_baseline(
        Baseline.STATIC, [Experiment(60.0, u[:60], y[:60]), Experiment(60.0, u[60:], y[60:])]
    )
    np.testing.assert_allclose(model.gains_um_per_k, [[3.0], [-2.0]], atol=1e-10)
    assert model.offset_um == pytest.approx(5.0)


def test_averages_find_a_machine_with_their_own_lags_at_any_sample_time() -> None:
    truth = ThermalModel(
        (
            ModalPart("a", 1.0, [2.0, -3.0], [AVERAGE_LAGS_S[0], AVERAGE_LAGS_S[2]]),
            ModalPart("b", 0.5, [4.0], [AVERAGE_LAGS_S[1]]),
        ),
        2.0,
    )
    tests = [
        Experiment(step, walk(seed, 400), simulate_modal(truth, step, walk(seed, 400)))
        for seed, step in ((2, 60.0), (3, 120.0))
    ]
    model = fit_baseline(Baseline.AVERAGES, tests)
    wanted = [[1.0, 2.0, 0.0, -3.0, 0.0], [0.5, 0.0, 4.0, 0.0, 0.0]]
    np.testing.assert_allclose(model.gains_um_per_k, wanted, atol=1e-8)


def test_the_ridge_is_the_solution_of_its_normal_equations_and_bears_repeated_inputs() -> None:
    u = walk(5, 80)
    y = u @ [3.0, -2.0] + np.random.default_rng(6).normal(size=80)
    model = fit_baseline(Baseline.RIDGE, [Experiment(60.0, u, y)], ridge=0.5)
    centred = u - u.mean(axis=0)
    spread = np.diag(centred.std(axis=0) ** 2)
    gains = np.linalg.solve(centred.T @ centred + 0.5 * 80 * spread, centred.T @ (y - y.mean()))
    np.testing.assert_allclose(model.gains_um_per_k[:, 0], gains, rtol=1e-9)
    assert model.offset_um == pytest.approx(y.mean() - u.mean(axis=0) @ gains)
    twice = np.hstack([u[:, :1], u[:, :1]])
    model = fit_baseline(Baseline.RIDGE, [Experiment(60.0, twice, 4.0 * u[:, 0])], ridge=1e-6)
    np.testing.assert_allclose(model.gains_um_per_k[:, 0], [2.0, 2.0], rtol=1e-4)


def test_persistence_holds_the_last_measured_value() -> None:
    y = np.arange(20.0)
    y[-2:] = np.nan
    model = fit_baseline(Baseline.PERSISTENCE, [Experiment(60.0, walk(8, 20), y)])
    assert (model.offset_um, model.gains_um_per_k.size) == (17.0, 0)


def test_missing_inputs_are_held() -> None:
    u = walk(10, 100)
    u[40:43, 0] = u[39, 0]
    gaps = u.copy()
    gaps[40:43, 0] = np.nan
    y = u @ [1.0, 2.0]
    one = fit_baseline(Baseline.AVERAGES, [Experiment(60.0, u, y)])
    other = fit_baseline(Baseline.AVERAGES, [Experiment(60.0, gaps, y)])
    np.testing.assert_array_equal(one.gains_um_per_k, other.gains_um_per_k)


def test_what_makes_no_sense_is_refused() -> None:
    test = Experiment(60.0, walk(11, 9), walk(11, 9)[:, 0])
    with refused("outside_range", key="ridge"):
        fit_baseline(Baseline.RIDGE, [test], ridge=-1.0)
    with refused("not_positive", key="lags_s"):
        fit_baseline(Baseline.AVERAGES, [test], lags_s=(0.0,))
    with refused("rows_not_enough"):
        fit_baseline(Baseline.AVERAGES, [test])


def test_a_rule_without_offset_is_least_squares_through_zero() -> None:
    u = walk(5, 300) + 3.0
    y = u @ [2.0, -1.0] + 7.0
    own = fit_baseline(Baseline.STATIC, [Experiment(60.0, u, y)], offset=False)
    wanted = np.linalg.lstsq(u, y, rcond=None)[0]
    np.testing.assert_allclose(own.gains_um_per_k[:, 0], wanted, rtol=1e-9)
    assert own.offset_um == 0.0
