"""Banded algebra against plain dense algebra of the same Gaussian model."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import BSpline
from scipy.linalg import eigh

from thermaxis.positioning import FloatArray
from thermaxis.positioning.drift import Readings, fit, levels_at, penalty_of, rows_at, sums_of
from thermaxis.positioning.drift._smooth_terms import (
    Fit,
    Step,
    curvature_energy,
    drift_of,
    functions_at,
    leverages_of,
    slowest_rate,
    spline_values,
    variances_at,
    warped,
)
from thermaxis.positioning.drift._smoothness import (
    TIMES,
    average_over_smoothness,
    effective_parameters,
    level_errors,
    reported,
)

TARGETS, CYCLES, INTERVALS = 4, 3, 5
DEPARTURES = (
    [0.3, 2.0, 0.7],
    [5.0, 0.05, 8.0],
    [8.0, 10.0, 1.0],
)  # more would cost the dense way its digits
STEPS = (Step(0.4, 0), Step(0.7, 1))


def made_readings(
    seed: int, shapes: int, *, weighted: bool = False, steps: tuple[Step, ...] = ()
) -> Readings:
    """Return 4 targets x 3 cycles x 2 approaches with one reading missing."""
    rng = np.random.default_rng(seed)
    levels = 2 * TARGETS
    one_cycle = np.concatenate((np.arange(TARGETS), 2 * TARGETS - 1 - np.arange(TARGETS)))
    level = np.delete(np.tile(one_cycle, CYCLES), 7).astype(np.intp)
    time = np.sort(rng.uniform(0.0, 1.0, level.size))
    time[0], time[-1] = 0.0, 1.0
    x = np.array([-1.3, -0.4, 0.5, 1.2])[level % TARGETS]
    value = rng.normal(size=level.size) + 3.0 * np.tanh(3.0 * time) * (1.0 + x)
    weight = rng.uniform(0.5, 2.0, levels)[level] if weighted else np.ones(level.size)
    shape = np.stack((np.ones_like(x), x, x**2 - 1.0))[:shapes]
    return Readings(value, level, time, shape, weight, levels, steps)


def knots(intervals: int) -> FloatArray:
    return (np.arange(intervals + 7) - 3.0) / intervals


def dense_rows(time: FloatArray, intervals: int, derivative: int = 0) -> FloatArray:
    """Return all splines at each time from a library's own splines, (N, K + 3)."""
    columns = []
    for k in range(intervals + 3):
        spline = BSpline(knots(intervals), np.eye(intervals + 3)[k], 3)
        columns.append(spline(time, nu=derivative))
    return np.stack(columns, axis=1)


def dense_energy(intervals: int) -> FloatArray:
    """Return the integral of products of second derivatives, by Simpson's rule: exact here."""
    edges = np.linspace(0.0, 1.0, intervals + 1)
    energy = np.zeros((intervals + 3, intervals + 3))
    for left, right in pairwise(edges.tolist()):
        at = np.array([left, 0.5 * (left + right), right])
        second = dense_rows(at, intervals, 2)
        energy += (right - left) / 6.0 * (second.T * np.array([1.0, 4.0, 1.0])) @ second
    return energy


def full(band: FloatArray) -> FloatArray:
    lower = sum(np.diag(band[k, : band.shape[1] - k], -k) for k in range(band.shape[0]))
    return np.asarray(lower) + np.tril(np.asarray(lower), -1).T


@dataclass(frozen=True)
class Dense:
    """Levels and lines without prior, departures from the lines as a Gaussian random function."""

    fixed: FloatArray
    covariance: FloatArray
    generalised: FloatArray
    rest: FloatArray
    variance: float
    criterion: float
    spline: FloatArray
    readings: Readings
    warm_up: float

    def rows_at(self, level: FloatArray, shape: FloatArray, time: FloatArray) -> FloatArray:
        """Return fixed rows of level weights (J, L), shapes (J, C) and times (J,)."""
        t = warped(time, self.warm_up)
        steps = [shape[:, s.shape] * (time > s.time) for s in self.readings.steps]
        return np.column_stack((level, shape * t[:, None], *steps))

    def predict(
        self, fixed: FloatArray, random: FloatArray, own: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return best predictions and their covariance; `random` is against the readings."""
        inverse = np.linalg.inv(self.covariance)
        value = fixed @ self.generalised + random @ inverse @ self.rest
        left = fixed - random @ inverse @ self.fixed
        of_fixed = np.linalg.inv(self.fixed.T @ inverse @ self.fixed)
        return value, self.variance * (own - random @ inverse @ random.T + left @ of_fixed @ left.T)


def prior_of(departure: FloatArray, energy: FloatArray) -> list[FloatArray]:
    """Return the prior covariance of the coefficients of every function, lines left out."""
    value, vector = eigh(energy)
    unit = (vector[:, 2:] / value[2:]) @ vector[:, 2:].T
    return [d**2 * unit for d in departure]


def dense_fit(
    readings: Readings, departure: FloatArray, warm_up: float, scale: float
) -> tuple[Dense, list[FloatArray]]:
    t = warped(readings.time, warm_up)
    rows = dense_rows(t, INTERVALS)
    prior = prior_of(departure, dense_energy(INTERVALS) * scale)
    covariance = np.diag(1.0 / readings.weight)
    for c, unit in enumerate(prior):
        of_shape = rows * readings.shape[c][:, None]
        covariance = covariance + of_shape @ unit @ of_shape.T
    steps = [readings.shape[s.shape] * (readings.time > s.time) for s in readings.steps]
    level = np.eye(readings.levels)[readings.level]
    fixed = np.column_stack((level, (readings.shape * t).T, *steps))
    inverse = np.linalg.inv(covariance)
    normal = fixed.T @ inverse @ fixed
    generalised = np.linalg.solve(normal, fixed.T @ inverse @ readings.value)
    rest = readings.value - fixed @ generalised
    free = readings.value.size - fixed.shape[1]
    variance = float(rest @ inverse @ rest) / free
    determinants = np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(normal)[1]
    criterion = (free + len(steps)) * np.log(variance) + determinants
    dense = Dense(
        fixed, covariance, generalised, rest, variance, float(criterion), rows, readings, warm_up
    )
    return dense, prior


def scale_of_energy() -> float:
    """Return the factor by which the energy is scaled: its unit is a departure of one."""
    return float(curvature_energy(INTERVALS)[0, 0] / dense_energy(INTERVALS)[0, 0])


def both(seed: int, shapes: int, which: int, warm_up: float) -> tuple[Fit, Dense, list[FloatArray]]:
    readings = made_readings(seed, shapes, weighted=True, steps=STEPS)
    departure = np.array(DEPARTURES[which][:shapes])
    fitted = fit(sums_of(readings, INTERVALS, warm_up), penalty_of(INTERVALS), departure)
    dense, prior = dense_fit(readings, departure, warm_up, scale_of_energy())
    return fitted, dense, prior


def test_the_splines_are_those_of_an_independent_library_and_add_up_to_one() -> None:
    time = np.linspace(0.0, 1.0, 201)
    first, values = spline_values(time, 7)
    dense = np.zeros((time.size, 10))
    dense[np.arange(time.size)[:, None], first[:, None] + np.arange(4)] = values
    np.testing.assert_allclose(dense, dense_rows(time, 7), atol=1e-14)
    np.testing.assert_allclose(np.sum(values, axis=1), 1.0, atol=1e-15)


def test_the_curvature_energy_is_the_integral_of_the_squared_second_derivative() -> None:
    band = full(curvature_energy(INTERVALS))
    np.testing.assert_allclose(
        band, dense_energy(INTERVALS) * scale_of_energy(), atol=1e-12 * np.max(band)
    )


def test_a_unit_random_function_departs_by_one_from_its_straight_line() -> None:
    intervals = 12
    value, vector = eigh(full(curvature_energy(intervals)))
    rng = np.random.default_rng(5)
    draws = (vector[:, 2:] / np.sqrt(value[2:])) @ rng.normal(size=(intervals + 1, 5000))
    time = np.linspace(0.0, 1.0, 301)
    functions = dense_rows(time, intervals) @ draws
    line, _ = np.linalg.qr(np.stack((np.ones_like(time), time), axis=1))
    departure = functions - line @ (line.T @ functions)
    assert np.sqrt(np.mean(departure**2)) == pytest.approx(1.0, rel=0.03)


def test_a_time_of_warming_runs_from_start_to_end_and_never_back() -> None:
    for warm_up, plain in TIMES:
        time = np.linspace(0.0, 1.0, 1001)
        own = warped(time, warm_up, plain)
        assert own[0] == 0.0
        assert own[-1] == pytest.approx(1.0, abs=1e-15)
        rate = np.diff(own) / np.diff(time)
        assert rate[-1] == pytest.approx(slowest_rate(warm_up, plain), rel=1e-3)
        assert np.all(np.diff(rate) < 1e-9)


def test_sums_are_the_products_of_the_dense_design() -> None:
    shapes = 3
    readings = made_readings(1, shapes, weighted=True)
    sums = sums_of(readings, INTERVALS, 20.0)
    rows = dense_rows(warped(readings.time, 20.0), INTERVALS)
    design = np.zeros((readings.value.size, shapes * (INTERVALS + 3)))
    for c in range(shapes):
        design[:, c::shapes] = rows * readings.shape[c][:, None]
    design[:, sums.pinned] = 0.0
    weighted = design * readings.weight[:, None]
    gram = weighted.T @ design
    gram[sums.pinned, sums.pinned] = 1.0
    np.testing.assert_allclose(full(sums.gram), gram, atol=1e-13)
    np.testing.assert_allclose(sums.right, weighted.T @ readings.value, atol=1e-13)
    of_level = np.eye(readings.levels)[readings.level]
    np.testing.assert_allclose(sums.cross, of_level.T @ weighted, atol=1e-13)


@pytest.mark.parametrize(("which", "shapes", "warm_up"), [(0, 3, 20.0), (1, 2, 0.0), (2, 3, 0.0)])
def test_levels_and_their_covariance_are_those_of_dense_algebra(
    which: int, shapes: int, warm_up: float
) -> None:
    fitted, dense, prior = both(2, shapes, which, warm_up)
    readings = dense.readings
    x = np.array([-1.3, -0.4, 0.5, 1.2])
    shape = np.tile(np.stack((np.ones(4), x, x**2 - 1.0))[:shapes], 2)
    for time in (0.0, 0.37, 1.0):
        own_row = rows_at(fitted.sums, np.array([time]))[0]
        level, covariance = levels_at(fitted, own_row, shape)
        row = dense_rows(warped(np.array([time]), warm_up), INTERVALS)[0]
        random = np.zeros((readings.levels, readings.value.size))
        own = np.zeros((readings.levels, readings.levels))
        for c in range(shapes):
            of_shape = dense.spline * readings.shape[c][:, None]
            random += np.outer(shape[c], of_shape @ prior[c] @ row)
            own += np.outer(shape[c], shape[c]) * float(row @ prior[c] @ row)
        fixed = dense.rows_at(np.eye(readings.levels), shape.T, np.full(readings.levels, time))
        expected, expected_covariance = dense.predict(fixed, random, own)
        np.testing.assert_allclose(level, expected, rtol=1e-9, atol=1e-9 * np.max(np.abs(expected)))
        scale = np.max(expected_covariance)
        np.testing.assert_allclose(covariance, expected_covariance, rtol=1e-9, atol=1e-9 * scale)


@pytest.mark.parametrize(("shapes", "warm_up"), [(2, 0.0), (3, 20.0)])
def test_functions_and_their_variances_are_those_of_dense_algebra(
    shapes: int, warm_up: float
) -> None:
    fitted, dense, prior = both(3, shapes, 0, warm_up)
    readings = dense.readings
    time = np.linspace(0.0, 1.0, 40)
    own_rows = rows_at(fitted.sums, time, 0.3)
    value, variance = functions_at(fitted, own_rows), variances_at(fitted, own_rows)
    own_time = warped(time, warm_up)
    start = warped(np.array([0.3]), warm_up)
    rows = dense_rows(own_time, INTERVALS) - dense_rows(start, INTERVALS)
    for c in range(shapes):
        fixed = np.zeros((time.size, dense.fixed.shape[1]))
        fixed[:, readings.levels + c] = own_time - start
        for e, step in enumerate(readings.steps):
            jump = np.asarray(time > step.time, dtype=np.float64) - (step.time < 0.3)
            fixed[:, readings.levels + shapes + e] = jump * (step.shape == c)
        of_shape = dense.spline * readings.shape[c][:, None]
        random = rows @ prior[c] @ of_shape.T
        expected, covariance = dense.predict(fixed, random, rows @ prior[c] @ rows.T)
        np.testing.assert_allclose(value[c], expected, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(variance[c], np.diag(covariance), rtol=1e-9, atol=1e-9)


def test_the_restricted_likelihood_is_that_of_dense_algebra_up_to_a_constant() -> None:
    pairs = [both(4, 3, which, 4.0)[:2] for which in (0, 1, 2)]
    difference = [fitted.criterion - dense.criterion for fitted, dense in pairs]
    scale = max(abs(dense.criterion) for _, dense in pairs)
    np.testing.assert_allclose(difference, difference[0], atol=1e-9 * scale)
    for fitted, dense in pairs:
        assert fitted.variance == pytest.approx(dense.variance, rel=1e-9)


def test_the_drift_of_readings_is_made_of_the_functions() -> None:
    fitted, dense, _ = both(5, 3, 0, 20.0)
    value = functions_at(fitted, rows_at(fitted.sums, dense.readings.time, 0.6))
    expected = np.sum(dense.readings.shape * value, axis=0)
    np.testing.assert_allclose(drift_of(fitted, dense.readings, 0.6), expected, atol=1e-12)


def test_effective_parameters_are_the_trace_of_the_hat_matrix() -> None:
    readings = made_readings(6, 2, steps=STEPS)
    bent = readings.value + 8.0 * np.sin(6.0 * readings.time)
    readings = replace(readings, value=bent)
    average = average_over_smoothness([sums_of(readings, INTERVALS, 0.0)])
    assert not average.line_is_enough
    dense, _ = dense_fit(readings, average.best_departure, 0.0, scale_of_energy())
    inverse = np.linalg.inv(dense.covariance)
    of_fixed = np.linalg.inv(dense.fixed.T @ inverse @ dense.fixed)
    projected = inverse - inverse @ dense.fixed @ of_fixed @ dense.fixed.T @ inverse
    trace = readings.value.size - float(np.trace(projected))
    assert effective_parameters(average) == pytest.approx(trace, rel=1e-4)


def test_leverages_are_the_diagonal_of_the_hat_matrix() -> None:
    fitted, dense, _ = both(9, 3, 0, 4.0)
    inverse = np.linalg.inv(dense.covariance)
    of_fixed = np.linalg.inv(dense.fixed.T @ inverse @ dense.fixed)
    projected = inverse - inverse @ dense.fixed @ of_fixed @ dense.fixed.T @ inverse
    expected = 1.0 - np.diag(projected) / dense.readings.weight
    np.testing.assert_allclose(leverages_of(fitted, dense.readings), expected, rtol=1e-9)


def test_averaged_levels_are_the_means_of_the_readings_without_the_reported_drift() -> None:
    readings = made_readings(7, 2)
    average = average_over_smoothness([sums_of(readings, INTERVALS, *t) for t in TIMES])
    assert float(np.sum(average.weight)) == pytest.approx(1.0)
    shape = np.zeros((2, readings.levels))
    shape[:, readings.level] = readings.shape
    without = readings.value - reported(average).drift(readings, 0.5)
    count = np.bincount(readings.level)
    means = np.bincount(readings.level, without) / count
    fits = zip(average.weight, average.fits, strict=True)
    if average.line_is_enough:
        fits = [(1.0, average.line)]
    half = np.array([0.5])
    averaged = sum(w * levels_at(f, rows_at(f.sums, half)[0], shape)[0] for w, f in fits)
    np.testing.assert_allclose(means, averaged, rtol=1e-8)
    errors = level_errors(average, means, 0.5, shape)
    assert np.min(np.linalg.eigvalsh(errors)) > 0.0


def test_the_search_finds_all_that_a_complete_grid_holds() -> None:
    readings = made_readings(8, 2)
    average = average_over_smoothness([sums_of(readings, INTERVALS, 0.0)])
    sums, penalty = sums_of(readings, INTERVALS, 0.0), penalty_of(INTERVALS)
    grid = 0.02 * 3000.0 ** (np.arange(11) / 10.0)
    criterion = [fit(sums, penalty, np.array([a, b])).criterion for a in grid for b in grid]
    weight = np.exp(-0.5 * (np.array(criterion) - min(criterion)))
    lowest = min(f.criterion for f in average.fits)
    assert lowest == pytest.approx(min(criterion), abs=1e-9)
    kept = sum(np.exp(-0.5 * (f.criterion - min(criterion))) for f in average.fits)
    assert kept == pytest.approx(float(np.sum(weight)), rel=0.01)
