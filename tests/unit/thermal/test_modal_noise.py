"""Block means and the coloured noise, each against a slow and plain second way."""

import numpy as np
import pytest
from scipy.signal import lfilter

from thermaxis.thermal import Experiment, SlowNoise
from thermaxis.thermal.modal import segments_of
from thermaxis.thermal.modal._evidence import Design, Sizes, log_evidence_of
from thermaxis.thermal.modal._lags import compared
from thermaxis.thermal.modal._slow_noise import WALK_PARTS, Weighing, drift_basis

TAUS_S = np.array([30.0, 700.0, 20000.0])


def _series(rows: int = 601) -> Experiment:
    rng = np.random.default_rng(0)
    u = 20.0 + np.cumsum(rng.normal(size=(rows, 2)), axis=0)
    return Experiment(10.0, u, rng.normal(size=rows))


def _lagged(u: np.ndarray, tau_s: float) -> np.ndarray:
    keep = np.exp(-10.0 / tau_s)
    return lfilter([0.0, 1.0 - keep], [1.0, -keep], u, zi=[u[0]])[0]


def test_block_means_of_lags_are_means_of_the_lags_at_full_rate():
    experiment = _series()
    (segment,) = segments_of([experiment], 120.0, (0.0, 0.0))
    assert segment.rows == 12
    for column in range(2):
        means = segment.lag_means(column, TAUS_S)
        for j, tau_s in enumerate(TAUS_S):
            full = _lagged(experiment.u[:600, column], tau_s).reshape(-1, 12).mean(axis=1)
            assert means[:, j] == pytest.approx(full, abs=1e-9)
    for j, tau_s in enumerate(TAUS_S):
        full = np.exp(-10.0 * np.arange(600) / tau_s).reshape(-1, 12).mean(axis=1)
        assert segment.fading_means(TAUS_S)[:, j] == pytest.approx(full, abs=1e-12)


def test_block_means_over_measured_rows_take_the_same_rows_of_the_lags():
    whole = _series(600)
    y = whole.y.copy()
    gone = np.random.default_rng(1).random(600) < 0.4
    gone[24:36] = True
    y[gone] = np.nan
    (segment,) = segments_of([Experiment(10.0, whole.u, y)], 120.0, (0.0, 0.0))
    assert segment.count[2] == 0
    means = segment.lag_means(0, TAUS_S)
    fading = segment.fading_means(TAUS_S)
    for j, tau_s in enumerate(TAUS_S):
        full = np.where(gone, np.nan, _lagged(whole.u[:, 0], tau_s)).reshape(-1, 12)
        start = np.where(gone, np.nan, np.exp(-10.0 * np.arange(600) / tau_s)).reshape(-1, 12)
        for block in np.flatnonzero(segment.count > 0):
            assert means[block, j] == pytest.approx(np.nanmean(full[block]), abs=1e-9)
            assert fading[block, j] == pytest.approx(np.nanmean(start[block]), abs=1e-12)


def test_lags_of_a_machine_at_its_reference_begin_at_zero_whatever_the_first_reading_says():
    u = np.cumsum(np.random.default_rng(3).normal(size=(600, 1)), axis=0) - 0.3
    (segment,) = segments_of([Experiment(10.0, u, np.ones(600))], 10.0, (0.0,))
    assert segment.u[0][0] != 0.0
    assert segment.lag_means(0, TAUS_S)[0].tolist() == [0.0, 0.0, 0.0]


def test_the_zero_has_no_rows_behind_the_last_whole_block():
    u = np.ones((10_005, 1))
    one = Experiment(10.0, u, np.ones(u.size), "", None, 1e6)
    (segment,) = segments_of([one], 100.0, (0.0,))
    assert segment.zero[-1] < segment.u[0].size < u.size
    assert segment.lag_zero(0, TAUS_S)[0] == 1.0


def test_a_delay_shifts_an_input_by_whole_rows():
    experiment = _series(600)
    (segment,) = segments_of([experiment], 10.0, (90.0, 0.0))
    assert segment.u[0][9:] == pytest.approx(experiment.u[:-9, 0])
    assert segment.u[0][:9] == pytest.approx(np.full(9, experiment.u[0, 0]))


def test_products_equal_those_of_the_full_covariance():
    rng = np.random.default_rng(2)
    times = np.cumsum(rng.uniform(50.0, 300.0, 120))
    columns, white = rng.normal(size=(120, 4)), rng.uniform(0.5, 2.0, 120)
    for ratio, fast_ratio in ((0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (0.0, 2.0)):
        noise = SlowNoise(ratio, 7200.0, fast_ratio, 600.0)
        covariance = np.diag(white)
        for share, correlation_s in noise.parts:
            covariance += share * np.exp(-np.abs(times[:, None] - times) / correlation_s)
        found = Weighing(columns, white, times).products(noise)
        products = columns.T @ np.linalg.solve(covariance, columns)
        assert found.gram == pytest.approx(products, rel=1e-9), noise
        assert found.log_determinant == pytest.approx(np.linalg.slogdet(covariance)[1], rel=1e-9)


def test_the_evidence_is_the_density_of_the_record_with_all_gains_integrated_out() -> None:
    """By dense algebra: y is normal with v (K + F L^-1 F'), the offset as large as the noise."""
    rng = np.random.default_rng(7)
    n, y = 40, np.cumsum(rng.normal(size=40))
    f = rng.normal(size=(n, 3))
    times_s = np.arange(n) * 200.0
    rows = np.column_stack((f, np.ones(n), y))
    zeros, zero_variance = np.zeros((1, 5)), np.array([3.0])
    basis = drift_basis(times_s, n * 200.0, rng.normal(size=(n, 2)))
    white = (np.ones(n),)
    design = Design((rows,), white, (times_s,), 1, 2, 0, zeros, zero_variance, (basis,))
    distance = np.abs(times_s[:, None] - times_s)
    found, expected = [], []
    for log_gain, ratio in ((-1.0, 0.5), (0.5, 8.0), (2.0, 30.0)):
        drifts = ratio * np.array([3.0, 0.7, 0.3, 2.0])
        sizes = Sizes(
            log_gain, (), np.log(ratio), np.log(3000.0), np.log(1e-9), 900.0, *np.log(drifts)
        )
        w = np.eye(n) + ratio * np.exp(-distance / 3000.0) + np.exp(2.0 * log_gain) * f @ f.T
        w += (ratio + 3.0) * np.ones((n, n)) + basis * np.repeat(
            drifts, [1, WALK_PARTS, 1, 1]
        ) @ basis.T
        square = float(y @ np.linalg.solve(w, y))
        expected.append(-0.5 * (n * np.log(square / n) + np.linalg.slogdet(w)[1]))
        products = design.products(sizes.noise)
        found.append(log_evidence_of(design, products, sizes))
        (both,) = compared(design, products, sizes, np.array([[0, 1]])).log_evidence
        assert both == pytest.approx(found[-1], rel=1e-9)
    assert found == pytest.approx(expected, rel=1e-6)


def test_the_basis_holds_a_line_and_a_walk_from_the_first_reading() -> None:
    times_s = np.linspace(0.0, 1000.0, 401)
    basis = drift_basis(times_s, 1000.0, np.empty((401, 0)))
    assert np.all(basis[0] == 0.0)
    assert basis[:, 0] == pytest.approx(times_s / 1000.0)
    walk = basis[:, 1:] @ basis[:, 1:].T
    wanted = np.minimum(times_s[:, None], times_s) / 1000.0
    assert np.max(np.abs(walk - wanted)) < 2.1 / (np.pi**2 * WALK_PARTS)


def test_what_the_ambients_sensor_does_vanishes_at_rest_and_a_lag_of_the_ambient_does_not() -> None:
    count = 4000
    step = (np.arange(count) >= 5).astype(np.float64)
    experiment = Experiment(100.0, np.ones((count, 1)), np.ones(count), ambient_k=step)
    (segment,) = segments_of([experiment], 500.0, (0.0,))
    assert segment.ambient[-1] == pytest.approx([1.0, 0.0, 0.0, 0.0], abs=1e-5)
    # The differences are of the channel and its lags, the next slower one each.
    lagged = [1.0 - np.exp(-segment.times_s / tau_s) for tau_s in (1800.0, 7200.0)]
    assert segment.ambient[:, 0] == pytest.approx(lagged[1], abs=1e-9)
    assert segment.ambient[1:, 1] == pytest.approx(1.0 - lagged[0][1:], abs=1e-9)
    assert segment.ambient[:, 2] == pytest.approx(lagged[0] - lagged[1], abs=1e-9)


def test_the_zero_is_that_of_the_time_which_displacements_count_from() -> None:
    y = np.arange(600.0)
    for reference_s, mean in ((60.0, 3.0), (600.0, 30.0)):
        record = Experiment(10.0, np.ones((600, 1)), y, reference_s=reference_s)
        (segment,) = segments_of([record], 100.0, (0.0,))
        assert segment.zero_um == mean
