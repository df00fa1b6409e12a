"""The tests of drift against dense algebra, exact distributions and simulated noise."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.stats import beta, f as f_distribution, norm, t as student

from tests.proofs import quick_first
from thermaxis.positioning import FloatArray, evaluate_drift
from thermaxis.positioning.drift import Readings, fit, penalty_of, sums_of
from thermaxis.positioning.drift._drift_tests import apart, drift_test, exceeded, moved_alone
from thermaxis.positioning.drift._smooth_terms import (
    Correlation,
    Step,
    curvature_energy,
    warped,
)
from thermaxis.positioning.drift._tails import LEAST_GAIN, tails_of

from .builders import codes_of, run, stop_times, values_said
from .test_smooth_terms import (
    INTERVALS,
    TARGETS,
    dense_fit,
    dense_rows,
    full,
    made_readings,
    scale_of_energy,
)

LARGEST = 30.0
DEPARTURES = 0.1 * 4.0 ** np.arange(5)  # up to the largest


def dense_log_ratio(readings: Readings, shape: FloatArray, departure: float) -> float:
    """Return the logarithm of the likelihood ratio of one function against noise alone."""
    rows = dense_rows(readings.time, INTERVALS) * shape[:, None]
    rise = (dense_rows(np.ones(1), INTERVALS) - dense_rows(np.zeros(1), INTERVALS))[0]
    energy = full(curvature_energy(INTERVALS)) + np.outer(rise, rise) / 12.0
    value, vector = np.linalg.eigh(energy)  # the constant has no energy, and the levels take it
    prior = departure**2 * (vector[:, 1:] / value[1:]) @ vector[:, 1:].T
    root = np.sqrt(readings.weight)
    levels = np.eye(readings.levels)[readings.level] * root[:, None]
    free = null_space(levels.T)
    rows, reading = free.T @ (rows * root[:, None]), free.T @ (readings.value * root)
    covariance = np.eye(free.shape[1]) + rows @ prior @ rows.T
    with_drift = reading @ np.linalg.solve(covariance, reading)
    half = -0.5 * np.linalg.slogdet(covariance)[1]
    return float(half - 0.5 * free.shape[1] * np.log(with_drift / (reading @ reading)))


def test_the_likelihood_ratio_is_that_of_dense_algebra() -> None:
    readings = made_readings(3, 2, weighted=True)
    tested = drift_test([sums_of(readings, INTERVALS, 0.0)], LARGEST)
    ratios = [dense_log_ratio(readings, s, d) for s in readings.shape for d in DEPARTURES]
    assert tested.bayes_factor == pytest.approx(float(np.mean(np.exp(ratios))), rel=1e-6)


@pytest.mark.parametrize(("number", "rest"), [(1, 30), (5, 30), (40, 3000)])
def test_the_probability_of_a_share_of_squares_is_nearly_that_of_the_beta_distribution(
    number: int, rest: int
) -> None:
    for probability in (0.9, 0.3, 0.01, 1e-6):
        share = float(beta.isf(probability, number / 2, rest / 2))
        p = exceeded(np.array([[1.0 - share, -share]]), np.array([[number, rest]], dtype=float))
        assert float(p[0]) == pytest.approx(probability, rel=0.1)


def silent(seed: int, targets: int, cycles: int) -> Readings:
    rng = np.random.default_rng(seed)
    one_cycle = np.concatenate((np.arange(targets), 2 * targets - 1 - np.arange(targets)))
    level = np.tile(one_cycle, cycles)
    x = (level % targets - 0.5 * (targets - 1)) / targets
    return Readings(
        value=rng.normal(size=level.size),
        level=level.astype(np.intp),
        time=np.arange(level.size) / (level.size - 1.0),
        shape=np.stack((np.ones_like(x), x)),
        weight=np.ones(level.size),
        levels=2 * targets,
    )


@pytest.mark.proof
def test_without_drift_a_small_probability_is_as_rare_as_it_says() -> None:
    p = []
    for seed in range(200):
        readings = silent(seed, 6, 5)
        p.append(drift_test([sums_of(readings, 10, w, 0.0) for w in (0.0, 20.0)], 60.0).probability)
    # of 200, one in ten is 20 with a standard deviation of 4.2
    assert 7 <= sum(one < 0.1 for one in p) <= 33
    assert sum(one < 0.01 for one in p) <= 7


CORRELATION = Correlation(length=0.07, ratio=1.5)


def of_noise(readings: Readings, correlation: Correlation = CORRELATION) -> FloatArray:
    """Return the covariance of the correlated part of the noise."""
    apart_by = np.abs(np.subtract.outer(readings.time, readings.time))
    return correlation.ratio * np.exp(-apart_by / correlation.length)


@pytest.mark.parametrize("long", [False, True])
def test_sums_with_correlated_noise_are_those_of_dense_algebra(long: bool) -> None:
    readings = made_readings(12, 2, weighted=True)
    intervals, correlation = INTERVALS, CORRELATION
    if long:  # so long that few splines reach into every part of it
        intervals, correlation = 60, Correlation(length=0.004, ratio=4.0)
        readings = replace(silent(5, 6, 95), steps=(Step(0.3, 1),))
        weight = np.linspace(0.5, 2.0, readings.levels)[readings.level]
        time = readings.time + 0.2 * (readings.time > 0.4)  # a pause
        readings = replace(readings, time=time / np.max(time), weight=weight)
    white = sums_of(readings, intervals, 20.0)
    sums = sums_of(replace(readings, correlation=correlation), intervals, 20.0)
    rows = dense_rows(warped(readings.time, 20.0), intervals)
    spline = np.stack([rows * s[:, None] for s in readings.shape], axis=2).reshape(len(rows), -1)
    spline[:, white.pinned] = 0.0
    level = np.column_stack((np.eye(readings.levels)[readings.level], *readings.columns))
    noise = np.diag(1.0 / readings.weight) + of_noise(readings, correlation)
    inverse = np.linalg.inv(noise)
    np.testing.assert_allclose(sums.normal, level.T @ inverse @ level, atol=1e-9)
    np.testing.assert_allclose(sums.cross, level.T @ inverse @ spline, atol=1e-9)
    np.testing.assert_allclose(sums.right, spline.T @ inverse @ readings.value, atol=1e-9)
    gram = spline.T @ inverse @ spline
    gram[white.pinned, white.pinned] = 1.0
    np.testing.assert_allclose(full(sums.gram), gram, atol=1e-9)
    constant = float(np.sum(np.log(readings.weight)))
    assert sums.log_noise == pytest.approx(np.linalg.slogdet(noise)[1] + constant)


@pytest.mark.parametrize("correlated", [False, True])
def test_a_target_of_its_own_is_tested_as_by_dense_generalised_least_squares(
    correlated: bool,
) -> None:
    readings = made_readings(11, 2, weighted=True)
    departure = np.array([3.0, 0.5])
    if correlated:
        readings = replace(readings, correlation=CORRELATION)
    fitted = fit(sums_of(readings, INTERVALS, 0.0), penalty_of(INTERVALS), departure)
    dense, _ = dense_fit(readings, departure, 0.0, scale_of_energy())
    inverse = np.linalg.inv(dense.covariance + correlated * of_noise(readings))

    def square(columns: FloatArray) -> float:
        solved = np.linalg.solve(
            columns.T @ inverse @ columns, columns.T @ inverse @ readings.value
        )
        rest = readings.value - columns @ solved
        return float(rest @ inverse @ rest)

    own = readings.level % TARGETS
    p = apart(fitted, readings, own, np.ones(own.size))
    for target in range(TARGETS):
        mine = (own == target) * 1.0
        more = np.column_stack((dense.fixed, mine * readings.time, mine * readings.time**2))
        free = readings.value.size - more.shape[1]
        gain = (square(dense.fixed) - square(more)) / 2.0
        expected = f_distribution.sf(gain / (square(more) / free), 2, free)
        assert p[target] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    ("cycles", "period_min"), quick_first(2, [(5, 10.0), (10, 15.0), (30, 10.0), (60, 20.0)])
)
def test_a_swing_of_the_hall_is_found_in_short_and_long_runs(
    cycles: int, period_min: float
) -> None:
    time = stop_times(16, cycles, 252.0 / 32.0)
    rng = np.random.default_rng(cycles)
    noise = 0.4 * rng.normal(size=time.shape)
    test = run(noise + np.sin(2.0 * np.pi * time / (60.0 * period_min) + 1.0), time_s=time)
    result = evaluate_drift(test)
    assert result.significant
    assert result.p_no_drift < 1e-6
    assert float(np.sqrt(np.mean(result.noise_std**2))) == pytest.approx(0.4, rel=0.12)
    assert evaluate_drift(replace(test, deviation=noise)).p_no_drift > 0.01


def test_turbulent_air_is_named_with_its_time_and_makes_neighbours_alike() -> None:
    time = stop_times(16, 10, 252.0 / 32.0)
    rng = np.random.default_rng(21)
    independent, air = rng.normal(size=(2, time.size))
    keep = np.exp(-252.0 / 32.0 / 60.0)
    for k in range(1, air.size):
        air[k] = keep * air[k - 1] + np.sqrt(1.0 - keep**2) * air[k]
    order = np.argsort(np.argsort(time, axis=None))
    still = run(0.4 * independent[order].reshape(time.shape), time_s=time)
    noise = 0.4 * np.sqrt(0.5) * (independent + air)[order].reshape(time.shape)
    found, calm = evaluate_drift(run(noise, time_s=time)), evaluate_drift(still)
    assert codes_of(calm.warnings) == []
    assert codes_of(found.warnings) == ["noise_correlated"]
    said = values_said(found.warnings, "noise_correlated")
    assert 25.0 < said["time"] < 150.0
    assert 0.14 < said["std"] < 0.56
    neighbours = [
        result.level_covariance[4, 5] / result.level_covariance[4, 4] for result in (found, calm)
    ]
    assert neighbours[0] > 0.25  # exp(-7.9 s / 60 s) / 2 = 0.44 with the true time and share
    assert neighbours[1] < 0.15
    assert not found.significant


@pytest.mark.parametrize(("period_min", "too_fast"), [(5.0, True), (10.0, False)])
def test_a_swing_of_about_a_cycle_is_said_to_be_too_fast(period_min: float, too_fast: bool) -> None:
    time = stop_times(16, 10, 252.0 / 32.0)
    noise = 0.4 * np.random.default_rng(33).normal(size=time.shape)
    result = evaluate_drift(run(noise + np.sin(time * np.pi / (30.0 * period_min)), time_s=time))
    assert ("swing_too_fast" in codes_of(result.warnings)) == too_fast
    if too_fast:
        said = values_said(result.warnings, "swing_too_fast")
        assert said["time"] == pytest.approx(period_min, rel=0.2)
        assert said["cycles"] == pytest.approx(period_min / 4.2, rel=0.2)


def test_the_gain_of_heavy_tails_is_that_of_the_likelihoods() -> None:
    residual = np.random.default_rng(1).standard_t(3.0, 300)
    gain, freedom = tails_of(residual)
    scale = student.fit(residual, fdf=freedom, floc=0.0)[2]
    heavy = student.logpdf(residual, freedom, scale=scale).sum()
    normal = norm.logpdf(residual, scale=np.sqrt(np.mean(residual**2))).sum()
    assert gain == pytest.approx(2.0 * (heavy - normal), rel=1e-4)
    assert gain > LEAST_GAIN > tails_of(np.random.default_rng(1).normal(size=300))[0]


def test_what_targets_do_by_themselves_is_taken_out_as_by_least_squares() -> None:
    readings = made_readings(7, 2)
    own = readings.level % TARGETS
    levels = np.eye(readings.levels)[readings.level]
    residual = readings.value - levels @ np.linalg.lstsq(levels, readings.value)[0]
    alone = np.eye(TARGETS)[own]
    time = readings.time[:, None]
    every = np.column_stack((levels, alone * time, alone * time**2))
    expected = residual - every @ np.linalg.lstsq(every, residual)[0]
    p, rest, taken = moved_alone(readings, residual, own, readings.levels, 0)
    np.testing.assert_allclose(rest, expected, atol=1e-9)
    free = residual.size - readings.levels - 2 * TARGETS
    ratio = (residual @ residual - rest @ rest) / taken / (rest @ rest / free)
    assert taken == 2 * TARGETS
    assert p == pytest.approx(f_distribution.sf(ratio, taken, free), rel=1e-6)
