"""Two recorders joined by time."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from tests.refusals import refused
from thermaxis.codes import remark
from thermaxis.thermal import ThermalLog, find_shift, join_rates, merge_logs

START = datetime(2026, 11, 20, 8, 0, tzinfo=UTC)


def wave(time_s: np.ndarray, seed: int = 5) -> np.ndarray:
    rng = np.random.default_rng(seed)
    fine = np.arange(0.0, 40_000.0)
    walk = np.cumsum(rng.normal(size=fine.size)) * 0.01
    return np.interp(time_s, fine, 22.0 + 3.0 * np.sin(fine / 3000.0) + walk)


def recorders(shift_s: float, *, noise_k: float = 0.02) -> tuple[ThermalLog, ThermalLog]:
    """Make a slow recorder and a fast one, whose clock is late by the shift."""
    rng = np.random.default_rng(1)
    ta, tb = np.arange(2000.0, 30_000.0, 10.0), np.arange(4000.0, 26_000.0)
    hall_a = np.round(wave(ta) + rng.normal(0, noise_k, ta.size), 1)
    hall_b = np.round(1.03 * wave(tb) - 1.0 + rng.normal(0, noise_k, tb.size), 1)
    a = ThermalLog.from_columns({"T_hall_C": hall_a, "T_a_C": ta}, time_s=ta, name="A")
    b = ThermalLog.from_columns({"t_hall_c": hall_b, "Z_um": tb}, time_s=tb - shift_s, name="B")
    return a, b


@pytest.mark.parametrize("shift_s", [137.4, -2500.0])
def test_a_shift_is_found_from_a_common_channel(shift_s: float) -> None:
    a, b = recorders(shift_s)
    found = find_shift(a, b)
    assert found.shift_s == pytest.approx(shift_s, abs=1.0)
    assert abs(found.shift_s - shift_s) < found.within_s
    assert found.channels == (("T_hall_C", "t_hall_c"),)
    joined = merge_logs(a, b)
    ramp = joined.column("Z_um")
    seen = ~np.isnan(ramp)
    # Z is the true time: the joined clock agrees with it.
    clock = joined.time_s[seen] + joined.origin_s
    np.testing.assert_allclose(clock, ramp[seen], atol=1.0)
    assert joined.remarks[-1].code == "remark-joined_by_channels"
    assert joined.remarks[-1].values["names"] == "T_hall_C=t_hall_c"


def test_channels_that_measure_the_same_can_be_named() -> None:
    a, b = recorders(20.0)
    a = a.select(["T_hall_C"])
    b = ThermalLog.from_columns({"other_C": b.column("T_hall_C")}, time_s=b.time_s + b.origin_s)
    with refused("no_clock_and_no_common_channel", file="A, log"):
        merge_logs(a, b)
    joined = merge_logs(a, b, common=[("T_hall_C", "other_C")])
    assert joined.remarks[-1].values["names"] == "T_hall_C=other_C"
    with refused("unknown_column", file="A"):
        merge_logs(a, b, common=[("x_C", "other_C")])


def test_a_shift_that_cannot_be_found_is_said_not_guessed() -> None:
    ta, tb = np.arange(0.0, 20_000.0, 10.0), np.arange(1000.0, 15_000.0, 7.0)
    for curve, code in (
        (lambda t: t * 1e-3, "shift_ambiguous"),
        (lambda t: np.random.default_rng(t.size).normal(size=t.size), "channels_unrelated"),
        (np.ones_like, "no_channel_varies"),
        (lambda t: np.full_like(t, np.nan), "measured_once"),
    ):
        a = ThermalLog.from_columns({"x": curve(ta)}, time_s=ta)
        b = ThermalLog.from_columns({"x": curve(tb)}, time_s=tb)
        with refused(code):
            merge_logs(a, b)
        assert merge_logs(a, b, shift_s=0.0).rows > 2000


def test_the_shift_is_told_with_the_decimals_to_which_it_is_known() -> None:
    log, _ = recorders(0.0)
    same = replace(log, name="same")
    one, _ = merge_logs(log, same).remarks
    assert float(one.values["shift_s"]) == 0.0
    assert not one.values["shift_s"].startswith("-")
    a, b = recorders(137.4)
    found = find_shift(a, b)
    (one,) = merge_logs(a, b).remarks
    said = one.values["shift_s"]
    assert abs(float(said) - found.shift_s) <= 0.05 * found.within_s
    assert len(said) <= len("137.4")


def test_a_given_shift_moves_the_second_clock() -> None:
    a = ThermalLog.from_columns({"a": [1.0, 2.0]}, time_s=[0.0, 10.0])
    b = ThermalLog.from_columns({"b": [3.0, 4.0]}, time_s=[100.0, 103.0])
    joined = merge_logs(a, b, shift_s=-103.0)
    np.testing.assert_array_equal(joined.time_s, [0.0, 3.0, 13.0])
    assert joined.origin_s == -3.0
    np.testing.assert_array_equal(joined.columns["a"], [np.nan, 1.0, 2.0])
    np.testing.assert_array_equal(joined.columns["b"], [3.0, 4.0, np.nan])
    with refused("no_shift", key="shift_s"):
        merge_logs(a, b, shift_s=np.nan)


def test_times_of_day_join_logs_without_a_common_channel() -> None:
    a = ThermalLog.from_columns({"a": [1.0, 2.0]}, sample_time_s=10.0, start=START)
    later = START + timedelta(seconds=5)
    b = ThermalLog.from_columns({"b": [3.0, 4.0]}, sample_time_s=10.0, start=later)
    joined = merge_logs(b, a)
    assert joined.time_s.tolist() == [0.0, 5.0, 10.0, 15.0]
    assert joined.start == START
    assert joined.remarks == (remark("joined_by_times_of_day", log="log"),)
    naive = ThermalLog.from_columns(
        {"c": [3.0]}, sample_time_s=1.0, start=later.replace(tzinfo=None)
    )
    with refused("zone_in_one_log", file="log, log"):
        merge_logs(a, naive, shift_s=0.0)


def test_every_measured_value_survives_and_nothing_is_interpolated() -> None:
    a, b = recorders(0.3)
    joined = merge_logs(a, b, shift_s=0.3)
    for name, values in {**a.columns, **b.columns}.items():
        column = joined.columns[name]
        np.testing.assert_array_equal(column[~np.isnan(column)], values)
    assert joined.rows == np.union1d(a.time_s, np.round(b.time_s + 2000.0, 6)).size


def test_outputs_seen_for_seven_seconds_at_a_time_stay_where_they_are() -> None:
    seconds = np.concatenate([np.arange(k, k + 7.0) for k in range(0, 36_000, 3600)])
    rare = ThermalLog.from_columns({"Z_um": seconds / 100.0}, time_s=seconds)
    steady = ThermalLog.from_columns({"T_C": np.arange(3600.0)}, sample_time_s=10.0)
    joined = merge_logs(steady, rare, shift_s=0.0)
    assert np.count_nonzero(~np.isnan(joined.column("Z_um"))) == 70
    minutes = joined.resample(60.0)
    assert np.count_nonzero(~np.isnan(minutes.column("Z_um"))) == 10
    assert minutes.column("Z_um")[60] == pytest.approx(36.03)


def test_a_name_that_both_logs_use_gets_a_number_before_its_unit() -> None:
    a = ThermalLog.from_columns({"T_C": [1.0], "x": [1.0], "T_2_C": [5.0]}, time_s=[0.0])
    b = ThermalLog.from_columns({"T_C": [2.0], "x": [3.0]}, time_s=[0.0])
    joined = merge_logs(a, b, shift_s=0.0)
    assert {n: v[0] for n, v in joined.columns.items()} == {
        "T_C": 1.0,
        "x": 1.0,
        "T_2_C": 5.0,
        "T_3_C": 2.0,
        "x_2": 3.0,
    }
    assert joined.units["T_3_C"] == "degC"


def test_rates_of_one_recorder_share_the_union_of_times() -> None:
    fast = ThermalLog.from_columns({"a": np.arange(5.0)}, sample_time_s=1.0)
    slow = ThermalLog.from_columns({"b": np.arange(3.0)}, sample_time_s=2.0)
    joined = join_rates([fast, slow])
    np.testing.assert_array_equal(joined.columns["b"], [0.0, np.nan, 1.0, np.nan, 2.0])
