"""Monte Carlo of equation (10): the square root of two, and what a single experiment can say."""

import math
import statistics

import numpy as np
import pytest

from tests.refusals import refused
from thermaxis.positioning import PAPER_RATIO, montecarlo_difference

ROOT_2 = math.sqrt(2.0)


@pytest.fixture(scope="module")
def result():
    return montecarlo_difference()


def test_the_square_root_of_two_lies_in_its_own_interval_and_the_papers_may_be_found(result):
    assert result.samples == 1000
    assert not result.one_sequence.allows(1.30)
    assert not result.one_sequence.allows(1.55)
    for estimate in (result.one_sequence, result.two_sequences):
        assert estimate.allows(PAPER_RATIO)
        low, high = estimate.mean_interval
        assert low < ROOT_2 < high
        assert high - low < 0.003
        assert estimate.theory == pytest.approx(ROOT_2, rel=1e-15)


def test_single_experiments_scatter_as_large_samples_predict(result):
    """sqrt(2) · 1/2 · sqrt((3 + 2 - 4)/n) for one sequence, ... (2 + 2 - 2)/n for two."""
    assert result.one_sequence.scatter == pytest.approx(ROOT_2 / 2 * math.sqrt(1 / 1000), rel=0.06)
    assert result.two_sequences.scatter == pytest.approx(ROOT_2 / 2 * math.sqrt(2 / 1000), rel=0.06)
    low, high = result.one_sequence.single_interval
    assert high - low == pytest.approx(2 * 1.96 * result.one_sequence.scatter, rel=0.08)


@pytest.mark.parametrize("sigma_b", [0.25, 3.0])
def test_the_mean_of_short_sequences_is_where_the_first_order_expects_it(sigma_b):
    result = montecarlo_difference(samples=100, repetitions=40_000, sigma_b=sigma_b, seed=4)
    for estimate in (result.one_sequence, result.two_sequences, result.to_larger):
        deviation = abs(estimate.mean - estimate.expected)
        standard_error = estimate.scatter / math.sqrt(40_000)
        assert deviation < 4 * standard_error + 2 * estimate.theory / 100**2
        assert estimate.expected > estimate.theory


@pytest.mark.parametrize(("sigma_a", "sigma_b"), [(1.0, 2.0), (0.3, 0.1)])
def test_the_ratio_to_the_larger_deviation_is_below_and_to_the_smaller_above_root_two(
    sigma_a, sigma_b
):
    result = montecarlo_difference(sigma_a=sigma_a, sigma_b=sigma_b, repetitions=400)
    assert result.to_larger.single_interval[1] < ROOT_2 < result.to_smaller.single_interval[0]
    true = math.hypot(sigma_a, sigma_b)
    assert result.to_larger.theory == pytest.approx(true / max(sigma_a, sigma_b))
    assert result.to_smaller.theory == pytest.approx(true / min(sigma_a, sigma_b))
    assert result.two_sequences.theory == pytest.approx(true / sigma_a)
    to_a = result.to_larger if sigma_a > sigma_b else result.to_smaller
    assert result.two_sequences == to_a


def test_a_loop_over_single_numbers_gives_the_same_ratios():
    samples, repetitions, sigma_a, sigma_b, seed = 12, 50, 1.5, 0.5, 9
    result = montecarlo_difference(
        samples=samples, repetitions=repetitions, sigma_a=sigma_a, sigma_b=sigma_b, seed=seed
    )
    random_a, random_b = (np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(2))
    one, two, smaller = [], [], []
    for _ in range(repetitions):
        a = [sigma_a * random_a.standard_normal() for _ in range(samples)]
        b = [sigma_b * random_b.standard_normal() for _ in range(samples)]
        neighbours = [a[k] - a[k + 1] for k in range(samples - 1)]
        between = [a[k] - b[k] for k in range(samples)]
        one.append(statistics.stdev(neighbours) / statistics.stdev(a))
        two.append(statistics.stdev(between) / statistics.stdev(a))
        smaller.append(statistics.stdev(between) / statistics.stdev(b))
    for estimate, ratios in (
        (result.one_sequence, one),
        (result.two_sequences, two),
        (result.to_smaller, smaller),
    ):
        assert estimate.first == pytest.approx(ratios[0])
        assert estimate.mean == pytest.approx(statistics.fmean(ratios))
        assert estimate.scatter == pytest.approx(statistics.stdev(ratios))
        half = 1.959964 * statistics.stdev(ratios) / math.sqrt(repetitions)
        assert estimate.mean_interval[1] - estimate.mean == pytest.approx(half)


def test_the_same_seed_gives_the_same_result_and_another_seed_another_one(result):
    again, other = montecarlo_difference(), montecarlo_difference(seed=2)
    assert again.one_sequence == result.one_sequence
    assert np.array_equal(again.derived_counts, result.derived_counts)
    assert other.one_sequence.first != result.one_sequence.first
    # one sequence knows nothing of the second
    assert montecarlo_difference(sigma_b=7.0).one_sequence == result.one_sequence


def test_the_parts_in_which_it_is_computed_do_not_show(monkeypatch):
    whole = montecarlo_difference(samples=50, repetitions=100)
    monkeypatch.setattr("thermaxis.positioning.standard._montecarlo._NUMBERS_AT_A_TIME", 350)
    steps = []
    parts = montecarlo_difference(
        samples=50, repetitions=100, on_progress=lambda _, done, total: steps.append((done, total))
    )
    assert parts.two_sequences == whole.two_sequences
    assert np.array_equal(parts.source_counts, whole.source_counts)
    assert steps[0] == (7, 100)
    assert steps[-1] == (100, 100)


def test_the_histograms_hold_every_number_of_the_first_experiment(result):
    assert result.source_counts.sum() == 1000
    assert result.derived_counts.sum() == 999
    assert result.histogram_edges.size == result.source_counts.size + 1
    assert np.allclose(result.histogram_edges, -result.histogram_edges[::-1])
    assert result.derived_deviation / result.source_deviation == result.one_sequence.first
    centre = (result.histogram_edges[1:] + result.histogram_edges[:-1]) / 2
    for counts, deviation in (
        (result.source_counts, result.source_deviation),
        (result.derived_counts, result.derived_deviation),
    ):
        mean = np.average(centre, weights=counts)
        spread = math.sqrt(np.average((centre - mean) ** 2, weights=counts))
        assert spread == pytest.approx(deviation, rel=0.03)


def test_what_cannot_be_is_refused_by_its_name():
    for bad in (
        {"samples": 2},
        {"samples": 1_000_001},
        {"repetitions": 39},
        {"repetitions": 10_000_000},
        {"sigma_a": 0.0},
        {"sigma_a": float("nan")},
        {"sigma_a": 1e300},
        {"sigma_b": 1e-300},
        {"seed": -1},
    ):
        code = "negative" if "seed" in bad else "outside_range"
        with refused(code, key=next(iter(bad))):
            montecarlo_difference(**bad)
