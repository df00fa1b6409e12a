"""What is said about a run with drift: known answers, laws, and coverage on generated runs."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm, t as student

from tests.proofs import quick_first
from tests.refusals import refused
from thermaxis.files import read_positioning
from thermaxis.positioning import (
    FIGURE_KEYS,
    DriftModel,
    DriftResult,
    FloatArray,
    PositioningTest,
    TimeSource,
    evaluate_drift,
    evaluate_drift_at,
    evaluate_iso230_2,
    figures_by_key,
)
from thermaxis.positioning.drift import Readings
from thermaxis.positioning.drift._unequal_noise import moderated_variances, weights_of_levels
from thermaxis.positioning.standard import figures_of
from thermaxis.quantities import AxisKind

from .builders import codes_of, run, stop_times, values_said

TARGETS, CYCLES, STEP_S = 8, 6, 20.0
NOISE = 0.4
COVERAGE_FACTOR = 1.959964
SEEDS = range(4)

Times = Callable[[np.random.Generator], FloatArray]
Truth = Callable[[FloatArray, FloatArray], FloatArray]


def standard(rng: np.random.Generator) -> FloatArray:
    return stop_times(TARGETS, CYCLES, STEP_S)


def with_pauses(rng: np.random.Generator) -> FloatArray:
    """Return a run with three pauses of up to half an hour at random places."""
    time = stop_times(TARGETS, CYCLES, STEP_S)
    for start in rng.uniform(0.0, np.max(time), 3):
        time = time + rng.uniform(600.0, 1800.0) * (time > start)
    return time


def step_cycle(rng: np.random.Generator) -> FloatArray:
    """Return a run that takes every target six times from both sides before the next."""
    i = np.arange(TARGETS)[:, None, None]
    j = np.arange(CYCLES)[None, :, None]
    a = np.arange(2)[None, None, :]
    return STEP_S * (2.0 * CYCLES * i + 2.0 * j + a)


def warming(rng: np.random.Generator, duration_s: float, *, size: float = 4.0) -> Truth:
    """Return a drift that saturates and grows with the position from -1 to 1."""
    amplitude = size * rng.uniform(0.7, 1.3, 2) * rng.choice([-1.0, 1.0], 2)
    tau_s = duration_s * rng.uniform(0.15, 0.8, 2)

    def drift(t: FloatArray, x: FloatArray) -> FloatArray:
        common = amplitude[0] * -np.expm1(-t / tau_s[0])
        return np.asarray(common + 0.5 * amplitude[1] * x * -np.expm1(-t / tau_s[1]))

    return drift


def made(
    seed: int, times: Times = standard, *, size: float = 4.0, noise: FloatArray | float = NOISE
) -> tuple[PositioningTest, Callable[[float], FloatArray]]:
    """Return a run of 8 targets, and its true levels at a time."""
    rng = np.random.default_rng(seed)
    time = times(rng)
    x = np.linspace(-1.0, 1.0, TARGETS)
    level = rng.normal(0.0, 5.0, (TARGETS, 2))
    drift = warming(rng, float(np.max(time)), size=size)
    deviation = level[:, None, :] + drift(time, x[:, None, None])
    deviation = deviation + noise * rng.normal(size=deviation.shape)
    return run(deviation, time_s=time), lambda t: level + drift(np.array(t), x)[:, None]


@cache
def standard_run(seed: int) -> tuple[PositioningTest, Callable[[float], FloatArray], DriftResult]:
    """Return a run with its true levels, evaluated once for all tests."""
    test, truth = made(seed)
    return test, truth, evaluate_drift(test)


def inside(result: DriftResult, truth: FloatArray) -> FloatArray:
    """Return whether each level lies inside its 95 % band, for approaches that were measured."""
    measured = ~np.isnan(result.level)
    error = np.abs(result.level - truth)[measured]
    return np.asarray(error <= COVERAGE_FACTOR * result.level_std[measured])


# Four runs of 16 levels each: a share of 0.95 scatters by 0.05, bands half as wide cover 0.67.
# benchmarks/drift_evidence.py has many.
def coverage(
    times: Times = standard,
    change: Callable[[PositioningTest, np.random.Generator], PositioningTest] = lambda t, _: t,
    *,
    noise: FloatArray | float = NOISE,
) -> FloatArray:
    """Return the share of covered levels at the mean time, the first and the last reading."""
    hits: list[list[float]] = []
    for seed in SEEDS:
        test, truth = made(seed, times, noise=noise)
        test = change(test, np.random.default_rng(1000 + seed))
        measured = test.time_s[~np.isnan(test.deviation)]
        ends = (float(np.mean(measured)), float(np.min(measured)), float(np.max(measured)))
        results = evaluate_drift_at(test, ends)
        hits.append(
            [float(np.mean(inside(r, truth(t)))) for r, t in zip(results, ends, strict=True)]
        )
    return np.asarray(np.mean(hits, axis=0))


def without_some(test: PositioningTest, rng: np.random.Generator) -> PositioningTest:
    deviation = test.deviation.copy()
    deviation[rng.uniform(size=deviation.shape) < 0.1] = np.nan
    deviation[:, :3] = test.deviation[:, :3]  # at least three readings per level
    return replace(test, deviation=deviation)


def forward_only(test: PositioningTest) -> PositioningTest:
    deviation = test.deviation.copy()
    deviation[..., 1] = np.nan
    return replace(test, deviation=deviation)


# ---- known answers ------------------------------------------------------------------------------


def test_a_straight_drift_without_noise_is_returned_as_it_is() -> None:
    time = stop_times(6, 5, 10.0)
    x = 20.0 * (np.arange(6) - 2.5)
    level = np.random.default_rng(1).normal(0.0, 10.0, (6, 2))
    slope = 0.002 * x[:, None, None]
    deviation = level[:, None, :] + (0.01 + slope / 100.0) * time
    result = evaluate_drift(run(deviation, time_s=time))
    duration = float(np.max(time))
    assert result.significant
    assert result.total == pytest.approx(0.01 * duration, rel=1e-6)
    assert result.total_per_m == pytest.approx(1000.0 * 0.002 / 100.0 * duration, rel=1e-6)
    mean_time = float(np.mean(time))
    expected = level + (0.01 + slope[:, :, 0] / 100.0) * mean_time
    np.testing.assert_allclose(result.level, expected, atol=1e-6)
    assert result.reference_time_s == pytest.approx(mean_time)
    assert result.residual_std < 1e-6
    reversal = float(np.max(np.abs(level[:, 0] - level[:, 1])))
    assert float(result.figures.B) == pytest.approx(reversal, abs=1e-6)
    assert float(result.figures.R) == pytest.approx(reversal, abs=1e-5)


def test_a_run_without_drift_is_left_as_it_was() -> None:
    test, _ = made(3, size=0.0)
    result = evaluate_drift(test)
    assert result.model is DriftModel.NONE
    assert not result.significant
    np.testing.assert_array_equal(result.deviation, test.deviation)
    assert not np.any(result.drift)
    assert result.total == 0.0
    assert result.total_within == pytest.approx(3.0 * np.sum(result.common_std[[0, -1]]))
    assert figures_by_key(result.figures) == pytest.approx(figures_by_key(evaluate_iso230_2(test)))
    assert result.effective_parameters == 2 * TARGETS
    assert result.degrees_of_freedom == 2 * TARGETS * (CYCLES - 1)


# ---- laws ---------------------------------------------------------------------------------------


def test_an_error_of_the_axis_changes_the_levels_and_nothing_else() -> None:
    test, _ = made(5)
    error = np.random.default_rng(6).normal(0.0, 100.0, (TARGETS, 1, 2))
    first = evaluate_drift(test)
    second = evaluate_drift(replace(test, deviation=test.deviation + error))
    np.testing.assert_allclose(second.level - first.level, error[:, 0], atol=1e-9)
    np.testing.assert_allclose(second.drift, first.drift, atol=1e-9)
    np.testing.assert_allclose(second.level_std, first.level_std, rtol=1e-9)


def test_all_results_scale_with_the_readings() -> None:
    test, _ = made(7)
    first = evaluate_drift(test)
    second = evaluate_drift(replace(test, deviation=-1000.0 * test.deviation))
    np.testing.assert_allclose(second.level, -1000.0 * first.level, rtol=1e-9)
    np.testing.assert_allclose(second.level_std, 1000.0 * first.level_std, rtol=1e-9)
    np.testing.assert_allclose(second.common, -1000.0 * first.common, rtol=1e-9, atol=1e-6)
    assert second.residual_std == pytest.approx(1000.0 * first.residual_std)
    assert second.p_no_drift == pytest.approx(first.p_no_drift)


def test_the_reference_time_shifts_levels_by_the_drift_between_the_times() -> None:
    test, _ = made(9)
    end_s = float(np.max(test.time_s))
    first, middle, last = evaluate_drift_at(test, (0.0, None, end_s))
    x = test.target - np.mean(test.target)
    between = last.common[0] - first.common[0] + (last.slope[0] - first.slope[0]) * x
    np.testing.assert_allclose(first.level - last.level, between[:, None] + 0.0 * first.level)
    np.testing.assert_allclose(
        first.deviation - first.level[:, None], last.deviation - last.level[:, None], atol=1e-9
    )
    assert np.all(middle.level_std < first.level_std)
    assert np.all(middle.level_std < last.level_std)
    assert first.common[0] == 0.0
    assert last.common_std[-1] == pytest.approx(0.0, abs=1e-12)
    again = evaluate_drift(test, reference_time_s=end_s)
    np.testing.assert_array_equal(again.level, last.level)
    np.testing.assert_array_equal(again.level_covariance, last.level_covariance)


def test_levels_are_the_means_without_drift_and_their_covariance_is_in_their_order() -> None:
    one_way = forward_only(made(10)[0])
    results = evaluate_drift(made(10)[0]), evaluate_drift(one_way)
    for result in results:
        np.testing.assert_allclose(result.level, np.mean(result.deviation, axis=1), atol=1e-12)
        np.testing.assert_allclose(result.figures.mean, result.level)
        measured = ~np.isnan(result.level)
        assert result.level_covariance.shape == 2 * (int(np.sum(measured)),)
        std = np.sqrt(np.diag(result.level_covariance))
        np.testing.assert_allclose(std, result.level_std.T[measured.T])
        assert np.min(np.linalg.eigvalsh(result.level_covariance)) > 0.0
    np.testing.assert_array_equal(np.isnan(results[1].level), [[False, True]] * TARGETS)
    np.testing.assert_array_equal(np.isnan(results[1].noise_std), [False, True])
    absent = [key for key, value in figures_by_key(results[1].figures).items() if value is None]
    assert not {"E_forward", "R_forward", "A_forward"} & set(absent)
    assert len(absent) == len(FIGURE_KEYS) - 3


def test_the_order_serves_as_time_and_gives_the_same_levels_as_even_times() -> None:
    timed, _ = made(11)
    ordered = replace(timed, time_source=TimeSource.ORDER, time_s=None)
    expected, result = evaluate_drift(timed), evaluate_drift(ordered)
    np.testing.assert_allclose(result.level, expected.level, atol=1e-9)
    assert result.reference_time_s is None
    assert result.time_source is TimeSource.ORDER
    assert "order_as_time" in codes_of(result.warnings)
    assert result.time_s[0] == 1.0
    assert result.time_s[-1] == 2.0 * TARGETS * CYCLES


# ---- what is refused ----------------------------------------------------------------------------


def test_a_run_that_tells_no_drift_is_refused_with_its_reason() -> None:
    one_way = np.zeros((3, 2, 2))
    one_way[..., 1] = np.nan
    test, _ = made(12)
    untimed = replace(test, time_source=TimeSource.ORDER, time_s=None)
    long_s = 2.0 * TARGETS * CYCLES * STEP_S
    for words, own, reference_time_s in (
        ("no_order", run(np.zeros((5, 5, 2))), None),
        ("too_few_at_target", run(np.zeros((5, 1, 2)), time_s=stop_times(5, 1)), None),
        ("too_few_readings", run(np.zeros((1, 5, 2)), time_s=stop_times(1, 5)), None),
        ("too_few_readings", run(one_way, time_s=stop_times(3, 2)), None),
        ("readings_repeat_exactly", run(np.full((5, 5, 2), 0.1), time_s=stop_times(5, 5)), None),
        ("one_time", replace(test, time_s=np.zeros_like(test.time_s)), None),
        ("reference_outside_run", test, -1.0),
        ("reference_outside_run", test, long_s),
        ("reference_outside_run", test, float("nan")),
        ("readings_without_times", untimed, 10.0),
    ):
        with refused(words):
            evaluate_drift(own, reference_time_s=reference_time_s)


# ---- the tests of drift, bow and single targets -------------------------------------------------


def as_readings(test: PositioningTest) -> Readings:
    i, j, a = np.nonzero(~np.isnan(test.deviation))
    x = (test.target - np.mean(test.target)) / np.std(test.target)
    at = test.time_s[i, j, a]
    return Readings(
        value=test.deviation[i, j, a],
        level=(i + test.target.size * a).astype(np.intp),
        time=at / np.max(at),
        shape=np.stack((np.ones(i.size), x[i])),
        weight=np.ones(i.size),
        levels=2 * test.target.size,
    )


def bent(seed: int, bow: float, alone: float) -> PositioningTest:
    test, _ = made(seed)
    fraction = test.time_s / np.max(test.time_s)
    x = np.linspace(-1.0, 1.0, TARGETS)[:, None, None]
    deviation = test.deviation + bow * fraction * (1.0 - x**2)
    deviation[3] += alone * fraction[3]
    return replace(test, deviation=deviation)


def test_a_bow_is_found_and_becomes_part_of_the_drift() -> None:
    for seed in range(3):
        result = evaluate_drift(bent(seed, 3.0, 0.0))
        assert float(result.bow[-1] - result.bow[0]) == pytest.approx(3.0, abs=1.5)
        assert codes_of(result.warnings) == ["axis_bows"]
        assert result.suspects == ()


def test_a_target_that_drifts_by_itself_is_named() -> None:
    for seed in range(3):
        result = evaluate_drift(bent(seed, 0.0, -4.0))
        assert 4 in result.suspects
        assert "4" in values_said(result.warnings, "target_drifts_otherwise")["targets"]


# ---- coverage and errors on generated runs ------------------------------------------------------


def test_a_step_cycle_is_said_to_hide_drift_and_has_wider_bands() -> None:
    stepped, steady = evaluate_drift(made(19, step_cycle)[0]), evaluate_drift(made(19)[0])
    assert "visits_hide_drift" in codes_of(stepped.warnings)
    assert "visits_hide_drift" not in codes_of(steady.warnings)
    assert np.mean(stepped.level_std) > 2.0 * np.mean(steady.level_std)


@pytest.mark.proof
@pytest.mark.parametrize("times", [with_pauses, step_cycle])
def test_bands_cover_the_truth_in_every_kind_of_run(times: Times) -> None:
    assert np.all(coverage(times) > 0.8)


@pytest.mark.proof
def test_bands_cover_the_truth_with_other_readings() -> None:
    assert np.all(coverage(change=lambda t, rng: forward_only(without_some(t, rng))) > 0.75)
    noise = np.ones((TARGETS, 1, 2)) * 0.3
    noise[2], noise[6] = 1.5, 0.9
    assert np.all(coverage(noise=noise) > 0.8)


@pytest.mark.proof
def test_shift_and_growth_over_the_run_lie_within_their_bands_which_are_no_wider_than_needed() -> (
    None
):
    share: list[float] = []
    for seed in range(8):
        test, truth, result = standard_run(seed)
        duration_s = float(np.max(test.time_s))
        growth, shift = np.polyfit(
            test.target - np.mean(test.target), (truth(duration_s) - truth(0.0))[:, 0], 1
        )
        share.append((result.total - shift) / result.total_within)
        share.append((result.total_per_m - 1000.0 * growth) / result.total_per_m_within)
        assert result.coverage_factor == 2.0
    assert max(map(abs, share)) < 1.1
    assert np.sqrt(np.mean(np.square(share[::2]))) > 0.15
    assert np.sqrt(np.mean(np.square(share[1::2]))) > 0.15


def test_noisy_targets_get_wider_bands_and_less_weight() -> None:
    noise = np.ones((TARGETS, 1, 2)) * 0.2
    noise[2] = 1.5
    result = evaluate_drift(made(14, noise=noise)[0])
    others = np.delete(np.arange(TARGETS), 2)
    assert np.max(result.weight[2]) < 0.5 * np.min(result.weight[others])
    assert np.min(result.level_std[2]) > 1.5 * np.max(result.level_std[others])


def test_levels_are_nearly_as_good_as_if_the_drift_were_known() -> None:
    model, plain, floor, noise = [], [], [], []
    for seed in SEEDS:
        test, truth, result = standard_run(seed)
        expected = truth(result.reference_time_s)
        true_drift = (
            np.stack([truth(t)[i, a] for (i, _, a), t in np.ndenumerate(test.time_s)]).reshape(
                test.time_s.shape
            )
            - expected[:, None, :]
        )
        floor.append(np.mean((np.mean(test.deviation - true_drift, axis=1) - expected) ** 2))
        model.append(np.mean((result.level - expected) ** 2))
        plain.append(np.mean((np.mean(test.deviation, axis=1) - expected) ** 2))
        noise.append(np.sqrt(np.mean(result.noise_std**2)))
    assert np.sqrt(np.mean(model)) < 1.15 * np.sqrt(np.mean(floor))
    assert np.sqrt(np.mean(model)) < 0.8 * np.sqrt(np.mean(plain))
    assert float(np.mean(noise)) == pytest.approx(NOISE, rel=0.08)


def test_an_outlier_is_named_and_its_level_is_that_of_the_other_readings() -> None:
    test, truth = made(15)
    deviation = test.deviation.copy()
    deviation[5, 2, 1] += 8.0
    sound, result = evaluate_drift(test), evaluate_drift(replace(test, deviation=deviation))
    assert sound.outliers == ()
    assert sound.figures_of_all is None
    assert [(o.target, o.cycle, o.approach) for o in result.outliers] == [(6, 3, 1)]
    assert result.outliers[0].residual == pytest.approx(8.0, abs=1.5)
    assert np.isnan(result.deviation[5, 2, 1])
    assert values_said(result.warnings, "outlier_left_out")["target"] == 6
    expected = truth(result.reference_time_s)
    assert abs(result.level - expected)[5, 1] < 4.0 * result.level_std[5, 1]
    np.testing.assert_allclose(result.level, sound.level, atol=3.0 * NOISE / CYCLES)


def test_no_level_loses_so_many_readings_that_no_scatter_is_left() -> None:
    rng = np.random.default_rng(4)
    deviation = NOISE * rng.normal(size=(10, 3, 2))
    deviation[3, :2, 0] += 20.0, -20.0
    result = evaluate_drift(run(deviation, time_s=stop_times(10, 3)))
    assert [(o.target, o.approach) for o in result.outliers] == [(4, 0)]


@pytest.mark.parametrize(("targets", "cycles"), quick_first(1, [(5, 2), (2, 4), (5, 3)]))
def test_a_short_run_of_one_approach_that_drifts_far_is_evaluated(
    targets: int, cycles: int
) -> None:
    time = np.full((targets, cycles, 2), np.nan)
    time[:, :, 0] = np.arange(targets)[:, None] + targets * np.arange(cycles)
    for seed in range(4):
        noise = NOISE * np.random.default_rng(seed).normal(size=time.shape)
        drift = 20.0 * time / np.nanmax(time)
        deviation = np.where(np.isnan(time), np.nan, drift + noise)
        result = evaluate_drift(run(deviation, time_s=time))
        assert result.p_no_drift < 0.01
        assert np.nanmax(np.abs(result.level[:, 0])) > 5.0


@pytest.mark.proof
def test_a_swing_that_a_long_run_resolves_is_found_in_it() -> None:
    time = stop_times(5, 300)
    swing = 2.5 * NOISE * np.sin(2.0 * np.pi * time / 25.0)
    noise = NOISE * np.random.default_rng(2).normal(size=time.shape)
    result = evaluate_drift(run(swing + noise, time_s=time))
    assert result.significant
    assert float(np.mean(result.noise_std)) == pytest.approx(NOISE, rel=0.1)


def test_figures_with_outliers_are_of_all_readings_less_the_same_drift() -> None:
    test, _ = made(15)
    deviation = test.deviation.copy()
    deviation[5, 2, 1] += 8.0
    result = evaluate_drift(replace(test, deviation=deviation))
    near = [(5, 2, 0), (4, 2, 1)]  # visited just after and just before
    drift = result.drift.copy()
    drift[5, 2, 1] = np.mean([drift[place] for place in near])
    expected = figures_of(
        np.mean(deviation - drift, axis=1), np.std(deviation - drift, axis=1, ddof=1)
    )
    assert result.figures_of_all.s[5, 1] > 3.0 * result.figures.s[5, 1]
    assert float(result.figures_of_all.E) == pytest.approx(float(expected.E), abs=0.01)
    taken = 1.0 - result.drift_parameters / (deviation.size - 1 - 2 * TARGETS)
    assert float(result.figures_of_all.s[5, 1]) == pytest.approx(
        float(expected.s[5, 1]) / taken**0.5, rel=0.01
    )


def test_noise_with_heavy_tails_is_said_in_place_of_dozens_of_outliers() -> None:
    test, _ = made(5, noise=0.01)
    rng = np.random.default_rng(5)
    heavy = replace(test, deviation=test.deviation + NOISE * rng.standard_t(1.5, (8, 6, 2)))
    result = evaluate_drift(heavy)
    assert result.outliers
    assert len(result.outliers) <= 0.05 * heavy.deviation.size
    said = values_said(result.warnings, "heavy_tailed_noise")
    assert said["far"] > 3.0 * said["expected"]
    named = codes_of(result.warnings).count("outlier_left_out")
    assert named == min(len(result.outliers), 5)


def test_heavy_tails_have_the_scale_of_normal_noise_with_the_same_quartiles() -> None:
    found = []
    for seed in range(3):
        test, _ = made(seed, noise=0.01)
        heavy = 0.2 * np.random.default_rng(seed).standard_t(3.0, test.deviation.shape)
        found.append(evaluate_drift(replace(test, deviation=test.deviation + heavy)).noise_std)
    quartile = 0.2 * float(student.ppf(0.75, 3.0) / norm.ppf(0.75))
    assert float(np.mean(found)) == pytest.approx(quartile, rel=0.15)


@pytest.mark.parametrize("step", quick_first(1, [3.0, 4.0, 6.0]))
def test_readings_rounded_coarsely_have_a_noise_and_no_heavy_tails(step: float) -> None:
    for seed in range(4):
        rng = np.random.default_rng(seed)
        level = rng.normal(0.0, 3.0, (16, 1, 2)) + rng.normal(0.0, 0.25, (16, 10, 2))
        coarse = step * 0.25 * np.round(level / (step * 0.25))
        result = evaluate_drift(run(coarse, time_s=stop_times(16, 10, 8.0)))
        assert "heavy_tailed_noise" not in codes_of(result.warnings)
        assert np.all(result.noise_std > 0.0)


def test_what_targets_do_by_themselves_is_no_noise() -> None:
    test, _ = made(2)
    place = np.arange(TARGETS)[:, None, None]
    hot = 6.0 * (test.time_s / np.max(test.time_s)) ** 0.7 * (np.cos(1.9 * place) + 0.2)
    result = evaluate_drift(replace(test, deviation=test.deviation + hot))
    codes = {"target_drifts_otherwise", "targets_drift_otherwise"}
    assert codes & set(codes_of(result.warnings))
    assert float(np.mean(result.noise_std)) == pytest.approx(NOISE, rel=0.2)
    assert result.residual_std > 1.3 * NOISE


def test_a_rotary_table_whose_centre_moves_is_named() -> None:
    test, _ = made(4)
    turn = replace(test, kind=AxisKind.ROTARY, target=45.0 * np.arange(TARGETS))
    assert "targets_drift_otherwise" not in codes_of(evaluate_drift(turn).warnings)
    angle = np.deg2rad(turn.target)[:, None, None]
    moved = turn.deviation + 1.5 * np.sin(angle) * turn.time_s / np.max(turn.time_s)
    said = codes_of(evaluate_drift(replace(turn, deviation=moved)).warnings)
    assert {"targets_drift_otherwise", "target_drifts_otherwise"} & set(said)


def test_the_first_reading_may_be_missing() -> None:
    test, _ = made(16)
    deviation = test.deviation.copy()
    deviation[0, 0, 0] = np.nan
    result = evaluate_drift(replace(test, deviation=deviation), reference_time_s=0.0)
    assert result.reference_time_s == STEP_S  # the first reading that there is
    assert result.time_s[0] == STEP_S


@pytest.mark.proof
def test_a_sound_run_has_no_outliers_but_rarely() -> None:
    wrong = sum(bool(standard_run(seed)[2].outliers) for seed in range(8))
    assert wrong <= 1


def test_readings_that_are_rounded_to_the_noise_have_no_outliers() -> None:
    for seed in range(4):
        rng = np.random.default_rng(seed)
        deviation = np.round(rng.normal(size=(8, 5, 2)) + rng.normal(0.0, 5.0, (8, 1, 2)))
        result = evaluate_drift(run(NOISE * deviation, time_s=stop_times(8, 5, STEP_S)))
        assert result.outliers == ()
        assert np.all(result.weight == 1.0)


# ---- unequal noise ------------------------------------------------------------------------------


def test_variances_that_chance_explains_become_alike() -> None:
    free = np.full(8, 5.0)
    variance = np.full(8, 2.0)
    variance[::2] = 2.1
    np.testing.assert_allclose(moderated_variances(variance, free), 2.05)


def test_variances_that_differ_are_drawn_together_and_keep_their_order() -> None:
    rng = np.random.default_rng(19)
    true = 3.0 / rng.chisquare(3.0, 2000)
    free = np.full(2000, 6.0)
    variance = true * rng.chisquare(6.0, 2000) / 6.0
    moderated = moderated_variances(variance, free)
    assert np.all(np.argsort(moderated) == np.argsort(variance))
    expected = (3.0 + 6.0 * variance) / 9.0  # the known prior: three degrees of freedom about one
    np.testing.assert_allclose(moderated, expected, rtol=0.2)


def test_equal_noise_is_not_weighted() -> None:
    weighted = 0
    for seed in range(40):
        readings = as_readings(made(seed, size=0.0)[0])
        mean = np.bincount(readings.level, readings.value) / CYCLES
        weight = weights_of_levels(
            readings.level, readings.value - mean[readings.level], readings.levels, 0.0
        )
        weighted += bool(np.any(weight != 1.0))
    assert weighted <= 2


# ---- a real run ---------------------------------------------------------------------------------


@pytest.mark.real_data
def test_the_drift_of_a_real_warming_axis(real_data: Path) -> None:
    path = real_data / "positioning" / "ess_target_b02_x" / "x_positioning_with_times.csv"
    test = read_positioning(path)
    result = evaluate_drift(test)
    assert result.model is DriftModel.LINE
    assert result.residual_std <= 2.245
    assert result.total == pytest.approx(-7.07, abs=0.05)
    before = evaluate_iso230_2(test).B
    assert before == pytest.approx(33.576, abs=0.001)
    assert float(result.figures.B) == pytest.approx(34.760, abs=0.001)
    assert result.residual_std == pytest.approx(1.805, abs=0.001)
    assert float(result.bow[-1] - result.bow[0]) == pytest.approx(-11.26, abs=0.01)
    assert result.suspects == (4,)
