"""The virtual machine whose thermal tests have a known truth."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.virtual_thermal_test import Heating, ThermalTestPlan, generate_thermal_test
from thermaxis.thermal import ModalPart, ThermalModel, simulate_modal

PLAN = ThermalTestPlan(hours=2.0, sample_time_s=10.0)


def test_the_same_seed_gives_the_same_log_and_another_one_another():
    first, again, other = (generate_thermal_test(PLAN, seed) for seed in (1, 1, 2))
    assert np.array_equal(first.z_um, again.z_um)
    assert not np.array_equal(first.spindle_rpm, other.spindle_rpm)


def test_the_clean_displacement_is_that_of_the_lags_behind_the_true_differences():
    test = generate_thermal_test(replace(PLAN, sample_time_s=1.0), 3)
    parts = tuple(
        ModalPart(name, 0.0, np.array(lags.gains_um_per_k), np.array(lags.time_constants_s))
        for name, lags in (("spindle", PLAN.spindle), ("table", PLAN.table))
    )
    expected = simulate_modal(ThermalModel(parts), 1.0, test.true_u_k)
    assert test.clean_um == pytest.approx(expected, abs=1e-9)


def test_a_measured_displacement_is_the_clean_one_with_drift_and_noise():
    test = generate_thermal_test(ThermalTestPlan(hours=8.0), 4)
    noise = test.z_um - test.clean_um - test.drift_um
    assert np.std(noise) == pytest.approx(0.4, rel=0.02)
    assert abs(np.mean(noise)) < 0.02


def test_the_random_drift_has_its_size_and_correlation():
    plan = ThermalTestPlan(
        hours=200.0, sample_time_s=60.0, drift_correlation_h=0.2, hall_drift_um_per_k=0.0
    )
    drift = generate_thermal_test(plan, 5).drift_um
    assert np.std(drift) == pytest.approx(0.8, rel=0.1)
    lag = 12
    correlation = np.corrcoef(drift[:-lag], drift[lag:])[0, 1]
    assert correlation == pytest.approx(np.exp(-1.0), abs=0.1)


def test_sensors_round_to_their_resolution():
    test = generate_thermal_test(PLAN, 6)
    steps = test.spindle_c / 0.1
    assert steps == pytest.approx(np.round(steps), abs=1e-6)
    assert np.ptp(test.spindle_c - test.column_c - test.true_u_k[:, 0]) < 0.4


def test_a_cold_start_begins_without_differences_and_a_warm_one_with_some():
    cold = generate_thermal_test(PLAN, 7)
    warm = generate_thermal_test(replace(PLAN, warm_up_h=5.0), 7)
    assert cold.true_u_k[0].tolist() == [0.0, 0.0]
    assert np.max(np.abs(warm.true_u_k[0])) > 0.3
    assert warm.clean_um[0] == 0.0


def test_missing_readings_have_their_share():
    test = generate_thermal_test(replace(PLAN, hours=8.0, missing_share=0.05), 8)
    assert np.mean(np.isnan(test.z_um)) == pytest.approx(0.05, abs=0.02)
    assert np.mean(np.isnan(test.spindle_c)) == pytest.approx(0.05, abs=0.02)


def test_block_means_are_means_of_the_log_at_one_second():
    fine = generate_thermal_test(ThermalTestPlan(hours=1.0), 9)
    means = generate_thermal_test(
        ThermalTestPlan(hours=1.0, sample_time_s=120.0, block_means=True), 9
    )
    assert means.z_um == pytest.approx(fine.z_um.reshape(-1, 120).mean(axis=1))


def test_a_delay_shifts_the_clean_displacement():
    plain = generate_thermal_test(ThermalTestPlan(hours=1.0), 10)
    late = generate_thermal_test(ThermalTestPlan(hours=1.0, delay_s=90.0), 10)
    assert late.clean_um[90:] == pytest.approx(plain.clean_um[:-90], abs=1e-9)


def test_a_rod_answers_faster_at_first_than_its_slowest_mode_alone():
    lags, rods = (
        generate_thermal_test(ThermalTestPlan(hours=1.0, heating=heating), 11)
        for heating in (Heating.LAGS, Heating.RODS)
    )
    early = slice(0, 1200)
    assert np.max(np.abs(rods.clean_um[early])) > np.max(np.abs(lags.clean_um[early]))
