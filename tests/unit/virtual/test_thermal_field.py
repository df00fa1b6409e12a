"""The virtual table obeys the heat equation, and its examples are written the same every time."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.virtual_table import (
    EXAMPLE_NAMES,
    VirtualTable,
    generate_thermal_field,
    true_temperature_c,
    write_example_fields,
)
from thermaxis.files import read_field_csv

SMALL = VirtualTable(rows=6, columns=9, pixel_mm=20.0)


def in_small_steps(table, time_s, steps):
    """Integrate the heat equation of the cut plate by explicit steps: another way than the sum."""
    edge_m, thickness_m = 1e-3 * table.pixel_mm, 1e-3 * table.thickness_mm
    capacity = table.heat_capacity_j_per_m3k * edge_m**2 * thickness_m
    excess = np.zeros((table.rows, table.columns))
    source = table.heating_k_per_s()
    for _ in range(steps):
        around = np.pad(excess, 1, mode="edge")
        flow = around[:-2, 1:-1] + around[2:, 1:-1] + around[1:-1, :-2] + around[1:-1, 2:]
        flow = table.conductivity_w_per_mk * thickness_m * (flow - 4 * excess)
        flow -= table.heat_transfer_w_per_m2k * edge_m**2 * excess
        excess = excess + time_s / steps * (flow / capacity + source)
    return table.air_c + excess


def test_the_sum_of_cosines_agrees_with_small_steps_of_time():
    for time_s in (60.0, 1800.0):
        found = true_temperature_c(SMALL, time_s)
        coarse, fine = (in_small_steps(SMALL, time_s, steps) for steps in (1000, 2000))
        assert np.abs(found - (2 * fine - coarse)).max() < 1e-5
        assert np.abs(found - SMALL.air_c).max() > 0.05


def test_the_heat_of_the_motor_is_in_the_plate_or_in_the_air():
    table = VirtualTable()
    area_m2 = (1e-3 * table.pixel_mm) ** 2
    capacity = table.heat_capacity_j_per_m3k * area_m2 * 1e-3 * table.thickness_mm
    still = true_temperature_c(table, 1e8) - table.air_c  # warm for years: all heat goes to the air
    lost = table.heat_transfer_w_per_m2k * area_m2 * still.sum()
    assert lost == pytest.approx(table.power_w, rel=1e-9)
    at_once = (true_temperature_c(table, 1.0) - table.air_c).sum() * capacity
    assert at_once == pytest.approx(table.power_w * 1.0, rel=1e-3)


def test_the_mean_warms_up_with_one_time_constant():
    table = VirtualTable()
    time_constant_s = (
        table.heat_capacity_j_per_m3k * 1e-3 * table.thickness_mm / table.heat_transfer_w_per_m2k
    )
    final = (true_temperature_c(table, 1e8) - table.air_c).mean()
    for share in (0.1, 1.0, 2.5):
        mean = (true_temperature_c(table, share * time_constant_s) - table.air_c).mean()
        assert mean == pytest.approx(final * (1 - np.exp(-share)), rel=1e-9)


def test_it_is_warmest_at_the_source_and_cools_along_the_table():
    found = true_temperature_c(VirtualTable(), 7 * 3600.0)
    assert np.unravel_index(found.argmax(), found.shape)[1] == 0
    assert (np.diff(found.mean(axis=0)) < 0).all()
    assert np.allclose(found, found[::-1])  # the source sits in the middle of the edge


def test_before_the_motor_starts_the_table_is_as_warm_as_the_air():
    assert np.array_equal(true_temperature_c(SMALL, 0.0), np.full((6, 9), 24.0))


def test_the_noise_is_seeded_and_has_its_standard_deviation():
    table = VirtualTable()
    first, again, other = (generate_thermal_field(table, 0.0, seed=s) for s in (1, 1, 2))
    assert np.array_equal(first.temperature_c, again.temperature_c)
    assert not np.array_equal(first.temperature_c, other.temperature_c)
    assert np.std(first.temperature_c) == pytest.approx(0.05, rel=0.05)
    assert np.allclose(first.temperature_c * 100, np.rint(first.temperature_c * 100))


def test_the_examples_are_written_again_byte_for_byte(root: Path, tmp_path):
    for path in write_example_fields(tmp_path):
        example = root / "examples" / path.name
        assert path.read_bytes() == example.read_bytes()
        assert example.stat().st_size < 200_000


def test_the_examples_show_the_truth_within_the_noise(root: Path):
    before, after = (read_field_csv(root / "examples" / name) for name in EXAMPLE_NAMES)
    change = after.temperature_c - before.temperature_c
    truth = true_temperature_c(VirtualTable(), 25_200.0) - 24.0
    assert np.std(change - truth) == pytest.approx(0.05 * np.sqrt(2), rel=0.05)
    assert abs(np.mean(change - truth)) < 4 * 0.05 * np.sqrt(2 / change.size)
    assert before.remarks == after.remarks == ()
