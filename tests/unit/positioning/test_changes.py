"""Steps of a run: the scan against plain fits, and what is said of runs with and without a step."""

from dataclasses import replace

import numpy as np
import pytest

from thermaxis.positioning import (
    ChangeKind,
    FloatArray,
    PositioningTest,
    TimeSource,
    evaluate_drift,
    evaluate_drift_at,
)
from thermaxis.positioning.drift import Readings, fit, penalty_of, sums_of
from thermaxis.positioning.drift._changes import FEWEST_BESIDE, _Columns, _instants
from thermaxis.positioning.drift._smooth_terms import Correlation, Step

from .builders import codes_of, run, stop_times, values_said

TARGETS, CYCLES, STOP_S, NOISE = 12, 8, 9.0, 0.4
TIME_S = stop_times(TARGETS, CYCLES, STOP_S)
X = np.linspace(-1.0, 1.0, TARGETS)[:, None, None]


def warm(seed: int, jump: FloatArray | float = 0.0, time_s: FloatArray = TIME_S) -> PositioningTest:
    """Return a run that warms by 3 µm with a time constant of ten minutes, and jumps."""
    rng = np.random.default_rng(seed)
    drift = -3.0 * np.expm1(-time_s / 600.0) + 0.5 * X * time_s / np.max(time_s)
    level = rng.normal(0.0, 3.0, (TARGETS, 1, 2))
    noise = NOISE * rng.normal(size=TIME_S.shape)
    return run(level + drift + noise + jump, time_s=time_s)


def after(reading: int) -> FloatArray:
    """Return one after so many readings, and zero before."""
    return np.asarray(TIME_S / STOP_S > reading - 0.5, dtype=np.float64)


def readings_of(test: PositioningTest) -> Readings:
    i, j, a = np.nonzero(~np.isnan(test.deviation))
    at = test.time_s[i, j, a]
    shape = np.stack((np.ones(i.size), X[i, 0, 0]))
    value = test.deviation[i, j, a]
    ones = np.ones(i.size)
    return Readings(value, i + TARGETS * a, at / np.max(at), shape, ones, 2 * TARGETS)


@pytest.mark.parametrize("correlation", [None, Correlation(length=0.03, ratio=2.0)])
@pytest.mark.parametrize("shape", [0, 1])
def test_the_scan_gives_the_criterion_of_a_fit_with_the_step(
    shape: int, correlation: Correlation | None
) -> None:
    readings = readings_of(warm(1, 1.0 * after(90)))
    readings = replace(readings, steps=(Step(0.301, 0),), correlation=correlation)
    penalty, departure = penalty_of(9), np.array([2.0, 0.3])
    sums = sums_of(readings, 9, 20.0)
    time = np.array([0.12, 0.46, 0.87])
    scanned = _Columns(readings, sums, time, shape).criteria(fit(sums, penalty, departure))
    for at, criterion in zip(time.tolist(), scanned.tolist(), strict=True):
        more = replace(readings, steps=(*readings.steps, Step(at, shape)))
        fitted = fit(sums_of(more, 9, 20.0), penalty, departure)
        assert criterion == pytest.approx(fitted.criterion, abs=1e-7)


def test_a_ramp_takes_from_the_squares_what_a_regression_on_it_takes() -> None:
    readings = readings_of(warm(2))
    sums = sums_of(readings, 6, 0.0)
    fitted = fit(sums, penalty_of(6), np.array([1e-4, 1e-4]))  # practically straight lines
    time = np.linspace(0.1, 0.9, 9)
    criterion = _Columns(readings, sums, time, 0).criteria(fitted, 2)
    rows = [
        *np.eye(readings.levels)[:, readings.level],
        readings.time,
        X.ravel()[readings.level % TARGETS] * readings.time,
    ]
    free = readings.value.size - readings.levels - 2

    def left(*more: FloatArray) -> float:
        design = np.stack([*rows, *more], axis=1)
        _, (square,), _, _ = np.linalg.lstsq(design, readings.value, rcond=None)
        return float(square)

    for k, start in enumerate(time[:-2].tolist()):
        ramp = np.clip((readings.time - start) / 0.2, 0.0, 1.0)
        projected = ramp - (basis := np.linalg.qr(np.stack(rows, axis=1))[0]) @ (basis.T @ ramp)
        gain = free * np.log(left(ramp) / (free - 1) / (left() / free))
        expected = fitted.criterion + gain + np.log(projected @ projected)
        assert criterion[k] == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize(
    ("jump", "reading", "kind", "size"),
    [
        (3.0 + 0.0 * X, 77, ChangeKind.COMMON, 3.0),
        (-2.0 + 0.0 * X, 2 * TARGETS * 5, ChangeKind.COMMON, -2.0),
        (2.5 * X, 95, ChangeKind.STRETCH, 5.0),
    ],
)
def test_a_step_is_named_with_time_cycle_size_and_kind(
    jump: FloatArray, reading: int, kind: ChangeKind, size: float
) -> None:
    result = evaluate_drift(warm(4, jump * after(reading)))
    (change,) = result.changes
    assert change.kind is kind
    assert change.time_s == pytest.approx(STOP_S * (reading - 0.5), abs=4.1 * STOP_S)
    assert change.cycle == reading // (2 * TARGETS) + 1
    assert change.size == pytest.approx(size, abs=3.0 * change.std)
    assert change.std < 0.15 * abs(size)
    said = values_said(result.warnings, f"change_{kind}")
    assert said["size"] == change.size
    assert result.significant


def test_levels_are_those_on_the_side_of_the_reference_time() -> None:
    test = warm(5, 3.0 * after(100))
    before, behind = evaluate_drift_at(test, (STOP_S * 99.0, STOP_S * 100.0))
    jumped = behind.level - before.level
    np.testing.assert_allclose(jumped, before.changes[0].size, atol=0.1)
    k = int(np.searchsorted(before.time_s, STOP_S * 99.5))
    assert before.common[k] - before.common[k - 1] == pytest.approx(3.0, abs=0.5)


def test_two_steps_and_an_outlier_are_told_apart() -> None:
    test = warm(6, 3.0 * after(60) - 4.0 * after(140))
    deviation = test.deviation.copy()
    deviation[3, 4, 0] += 6.0
    result = evaluate_drift(replace(test, deviation=deviation))
    assert [(o.target, o.cycle, o.approach) for o in result.outliers] == [(4, 5, 0)]
    first, second = result.changes
    assert first.size == pytest.approx(3.0, abs=3.0 * first.std)
    assert second.size == pytest.approx(-4.0, abs=3.0 * second.std)


def test_growth_that_steps_from_a_fixed_point_off_mid_axis_is_named_in_both_its_parts() -> None:
    noise = NOISE * np.random.default_rng(1).normal(size=TIME_S.shape)
    grown = 3.0 * (X - X[0]) * after(95)  # seen alone, either part seems gradual here
    common, growth = evaluate_drift(run(grown + noise, time_s=TIME_S)).changes
    assert (common.kind, growth.kind) == (ChangeKind.COMMON, ChangeKind.STRETCH)
    assert common.time_s == growth.time_s
    assert common.size == pytest.approx(3.0, abs=0.6)
    assert growth.size == pytest.approx(6.0, abs=1.2)


def test_without_times_a_step_is_told_by_its_cycle() -> None:
    test = warm(7, 3.0 * after(100))
    result = evaluate_drift(replace(test, time_s=None, time_source=TimeSource.ORDER))
    (change,) = result.changes
    assert (change.time_s, change.interval_s, change.cycle) == (None, None, 5)
    assert values_said(result.warnings, "change_common")["when"].code == "change-in_order"


def test_a_step_in_a_pause_is_said_to_be_at_once_or_slow() -> None:
    test = warm(8, 6.0 * after(100))
    paused = replace(test, time_s=TIME_S + 600.0 * after(100))
    (change,) = evaluate_drift(paused).changes
    assert change.interval_s == pytest.approx(600.0 + STOP_S)
    when = values_said(evaluate_drift(paused).warnings, "change_common")["when"]
    assert when.code == "change-in_pause"


@pytest.mark.proof
def test_four_steps_in_one_direction_are_no_correlated_noise() -> None:
    places = (35, 70, 115, 160)
    result = evaluate_drift(warm(4, sum(3.0 * after(place) for place in places)))
    assert result.noise_time is None
    named = [change.time_s for change in result.changes]
    assert named == pytest.approx([STOP_S * (place - 0.5) for place in places], abs=1.1 * STOP_S)
    for change in result.changes:
        assert change.size == pytest.approx(3.0, abs=3.0 * change.std)


@pytest.mark.proof
def test_a_step_in_turbulent_air_is_named_beside_the_turbulence() -> None:
    air, keep = np.random.default_rng(12).normal(size=TIME_S.size), np.exp(-STOP_S / 60.0)
    for k in range(1, air.size):
        air[k] = keep * air[k - 1] + np.sqrt(1.0 - keep**2) * air[k]
    turbulent = NOISE * air[np.rint(TIME_S / STOP_S).astype(int)]
    assert evaluate_drift(warm(12, turbulent)).changes == ()
    result = evaluate_drift(warm(12, turbulent + 3.0 * after(100)))
    assert result.noise_time is not None
    (change,) = result.changes
    assert change.time_s == pytest.approx(99.5 * STOP_S, abs=1.1 * STOP_S)
    assert change.size == pytest.approx(3.0, abs=3.0 * change.std)


@pytest.mark.parametrize(("size", "named"), [(0.0, 0), (3.0, 1)])
def test_a_jump_in_a_pause_of_twenty_minutes_is_named(size: float, named: int) -> None:
    paused = warm(13, size * after(100), TIME_S + 1200.0 * after(100))
    changes = evaluate_drift(paused).changes
    assert len(changes) == named
    assert all(c.size == pytest.approx(size, abs=3.0 * c.std) for c in changes)


def test_what_moved_over_a_pause_at_once_or_slowly_is_said_and_is_no_change() -> None:
    result = evaluate_drift(warm(14, 1.5 * after(100), TIME_S + 1200.0 * after(100)))
    assert result.changes == ()
    said = values_said(result.warnings, "change_unsure")
    assert said["size"] == pytest.approx(1.5, abs=1.5 * said["within"])
    assert said["when"].values["pause_min"] == pytest.approx(20.15)


@pytest.mark.parametrize("reading", [0, TIME_S.size - 1])
def test_an_outlier_that_is_the_first_or_last_reading_is_named(reading: int) -> None:
    test = warm(15)
    deviation = test.deviation.copy()
    at = np.unravel_index(np.argmin(np.abs(TIME_S - STOP_S * reading)), TIME_S.shape)
    deviation[at] += 20.0
    (outlier,) = evaluate_drift(replace(test, deviation=deviation)).outliers
    named = (outlier.target - 1, outlier.cycle - 1, outlier.approach)
    assert named == tuple(map(int, at))
    assert outlier.residual == pytest.approx(20.0, abs=2.0)
    assert evaluate_drift(test).outliers == ()


@pytest.mark.proof
def test_outliers_that_stay_in_the_model_are_said() -> None:
    test = warm(16)
    deviation = test.deviation.copy()
    deviation[::2, 3, :] += np.linspace(8.0, 11.0, 12).reshape(6, 2)  # of 192 readings; 9 are 5 %
    result = evaluate_drift(replace(test, deviation=deviation))
    assert len(result.outliers) == 9
    assert values_said(result.warnings, "outliers_in_model")["most"] == 9
    assert "outliers_in_model" not in codes_of(evaluate_drift(test).warnings)


# A few runs; benchmarks/drift_changes.py has hundreds.
@pytest.mark.proof
def test_what_is_smooth_noisy_or_slow_is_no_step() -> None:
    rng = np.random.default_rng(11)
    hall = np.sin(2.0 * np.pi * TIME_S / 1500.0)
    pump = -4.0 * np.expm1(-np.maximum(TIME_S - 700.0, 0.0) / 180.0)
    one = np.zeros_like(TIME_S)
    one[5, 3, 1] = 5.0
    tails = NOISE * rng.standard_t(3.0, TIME_S.shape)
    for seed, drift in enumerate((0.0, hall, pump, hall + pump, one, tails)):
        assert evaluate_drift(warm(20 + seed, drift)).changes == ()


def test_a_step_lies_between_readings_and_has_some_on_both_sides() -> None:
    time = np.repeat(np.linspace(0.0, 1.0, 12), 2)  # times to the minute: two readings share one
    instants = _instants(time)
    assert not set(instants.tolist()) & set(time.tolist())
    sides = [min(np.sum(time < at), np.sum(time > at)) for at in instants.tolist()]
    assert min(sides) >= FEWEST_BESIDE
    assert len(instants) == 7


def test_changes_come_first_among_what_is_said() -> None:
    result = evaluate_drift(warm(10, 3.0 * after(100)))
    assert codes_of(result.warnings)[0] == "change_common"
