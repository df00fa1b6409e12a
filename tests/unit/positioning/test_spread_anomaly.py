"""The test for positions whose spread stands out: level, power, exact distribution."""

import numpy as np
import pytest
from scipy import stats

from thermaxis.positioning import find_spread_anomalies
from thermaxis.positioning.standard import local_deviation_contrasts
from thermaxis.positioning.standard._spread_anomaly import (
    probability_positive,
    spread_can_be_tested,
)


def targets(m: int, rng: np.random.Generator) -> np.ndarray:
    return np.arange(m) * 20.0 + rng.uniform(-4.0, 4.0, m)


def drift(m: int, n: int, position: np.ndarray) -> np.ndarray:
    """Return a warm-up of 6 µm in common and 30 µm/m, neither of them a polynomial."""
    t = np.linspace(0.0, 3.0, n)
    return 6.0 * np.exp(-t) + 0.03 * position[:, None] * (1.0 - np.exp(-2.0 * t))


@pytest.mark.proof
@pytest.mark.parametrize(("m", "n"), [(5, 5), (16, 10)])
def test_at_most_five_percent_of_healthy_runs_get_an_anomaly(m: int, n: int) -> None:
    rng = np.random.default_rng(m * 1000 + n)
    repetitions = 200
    named = 0
    for _ in range(repetitions):
        position = targets(m, rng)
        x = rng.normal(size=(2, m, n)) + drift(m, n, position)
        named += any(find_spread_anomalies(position, way, level=0.025) for way in x)
    highest = stats.binom.ppf(0.999, repetitions, 0.05)
    assert named <= highest
    assert named >= stats.binom.ppf(0.001, repetitions, 0.02)  # nor is the test asleep


@pytest.mark.parametrize("wrong", [1, 9])
def test_a_position_that_scatters_is_named_first(wrong: int) -> None:
    rng = np.random.default_rng(wrong)
    found = 0
    for _ in range(60):
        position = targets(16, rng)
        x = rng.normal(size=(16, 100)) + drift(16, 100, position)
        x[wrong - 1] += np.sqrt(3.0) * rng.normal(size=100)  # twice the spread of the others
        anomalies = find_spread_anomalies(position, x, level=0.025)
        found += bool(anomalies) and anomalies[0].position == wrong
    assert found >= 57


def test_two_positions_are_both_named_and_so_is_one_that_drifts_by_itself() -> None:
    rng = np.random.default_rng(8)
    position = targets(16, rng)
    x = rng.normal(size=(16, 100))
    x[3] *= 4.0
    x[11] *= 3.0
    assert {a.position for a in find_spread_anomalies(position, x, level=0.025)} == {4, 12}
    x = 0.4 * rng.normal(size=(16, 50)) + drift(16, 50, position)
    x[6] -= np.linspace(0.0, 3.0, 50)  # a target that drifts by itself
    assert find_spread_anomalies(position, x, level=0.025)[0].position == 7


def test_common_and_proportional_drift_drop_out_exactly() -> None:
    rng = np.random.default_rng(10)
    position = targets(9, rng)
    contrast = local_deviation_contrasts(position)
    assert contrast @ np.ones(9) == pytest.approx(np.zeros(9), abs=1e-12)
    assert contrast @ position == pytest.approx(np.zeros(9), abs=1e-12)
    assert np.count_nonzero(contrast, axis=1).tolist() == [5, *[3] * 7, 5]  # and stays local


def test_too_few_positions_or_cycles_and_silent_axes_name_nothing() -> None:
    rng = np.random.default_rng(11)
    assert find_spread_anomalies(np.arange(4.0), rng.normal(size=(4, 50)), level=0.05) == ()
    assert find_spread_anomalies(np.arange(9.0), rng.normal(size=(9, 2)), level=0.05) == ()
    assert find_spread_anomalies(np.arange(9.0), np.zeros((9, 20)), level=0.05) == ()


def test_cycles_with_a_missing_reading_are_left_out() -> None:
    rng = np.random.default_rng(12)
    x = rng.normal(size=(9, 20))
    x[4] *= 5.0
    holed = np.concatenate((x, np.full((9, 1), 100.0)), axis=1)
    holed[2, 20] = np.nan
    assert find_spread_anomalies(np.arange(9.0), holed, level=0.05) == find_spread_anomalies(
        np.arange(9.0), x, level=0.05
    )


def test_the_distribution_of_a_weighted_sum_is_that_of_f() -> None:
    """A difference of two chi-squared variables is positive as often as F exceeds a quotient."""
    assert probability_positive(np.zeros(3), 4) == 0.0
    for a, b, nu in [(1.0, -3.0, 4), (1.0, -0.5, 9), (2.0, -7.0, 99), (1.0, -20.0, 2)]:
        exact = stats.f.sf(-b / a, nu, nu)
        weight = np.array([a, b])
        assert probability_positive(weight, nu) == pytest.approx(exact, abs=1e-7)


def test_an_axis_with_very_many_positions_is_left_untested_and_says_so() -> None:
    rng = np.random.default_rng(14)
    x = rng.normal(size=(5000, 3))
    assert not spread_can_be_tested(x)
    assert find_spread_anomalies(np.arange(5000.0), x, level=0.05) == ()
    assert spread_can_be_tested(x[:500])
    assert not spread_can_be_tested(x[:500, :2])


def test_a_slightly_larger_spread_is_not_named_however_many_cycles_there_are() -> None:
    rng = np.random.default_rng(15)
    x = rng.normal(size=(16, 3000))
    x[5] *= 1.2
    assert find_spread_anomalies(np.arange(16.0), x, level=0.05) == ()
    x[5] *= 1.5
    assert [a.position for a in find_spread_anomalies(np.arange(16.0), x, level=0.05)] == [6]
