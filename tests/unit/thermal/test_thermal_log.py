"""The record of channels over time, its block means, and inputs."""

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from hypothesis import given, strategies as st

from tests.refusals import refused
from thermaxis.thermal import (
    InputDefinition,
    ThermalLog,
    check_inputs,
    common_names,
    evaluate_input,
    parse_input,
    records_of,
)
from thermaxis.thermal.log import block_means, block_numbers, unit_of_name

START = datetime(2026, 11, 20, 8, 0, tzinfo=UTC)


def a_log(**more: object) -> ThermalLog:
    columns = {
        "T_spindle_C": np.arange(10.0),
        "T_column_c": np.ones(10),
        "Z_mm": np.arange(10.0) / 1e3,
        "speed_RPM": np.full(10, 1500.0),
        "other": np.zeros(10),
    }
    return ThermalLog.from_columns(columns, sample_time_s=2.0, **more)


def test_the_end_of_a_name_states_the_unit_whatever_its_case() -> None:
    for name, unit in (
        ("T_C", "degC"),
        ("t1_c", "degC"),
        ("Z_UM", "um"),
        ("z_µm", "um"),
        ("speed_rpm", "rpm"),
        ("rpm", "rpm"),
        ("T_K", "K"),
        ("x_mm", "mm"),
        ("_C", ""),
        ("c", ""),
        ("torque", ""),
        ("T_spindle", ""),
    ):
        assert unit_of_name(name) == unit


def test_times_count_from_the_first_row_and_the_clock_is_kept() -> None:
    log = ThermalLog.from_columns({"time_s": [100.0, 101.0, 103.0], "T_C": [1, 2, np.nan]})
    assert log.time_s.tolist() == [0.0, 1.0, 3.0]
    assert (log.origin_s, log.rows, log.duration_s, log.usual_step_s) == (100.0, 3, 3.0, 1.5)
    assert log.units == {"T_C": "degC"}


def test_a_log_cannot_be_changed_and_does_not_change_with_its_source() -> None:
    source = np.arange(3.0)
    log = ThermalLog.from_columns({"T_C": source}, sample_time_s=1.0)
    source[0] = 99.0
    assert log.columns["T_C"][0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        log.columns["T_C"][0] = 1.0
    with pytest.raises(TypeError):
        log.columns["x"] = source


def test_what_is_no_log_is_refused_with_the_reason() -> None:
    for columns, keywords, words in (
        ({"T_C": [1.0, 2.0]}, {}, "times_missing"),
        ({"T_C": [1.0]}, {"time_s": [0.0], "sample_time_s": 1.0}, "times_twice"),
        ({"T_C": [1.0, 2.0]}, {"time_s": [0.0, 0.0]}, "times_not_rising"),
        ({"T_C": [1.0, 2.0]}, {"time_s": [0.0, np.nan]}, "times_not_rising"),
        ({"T_C": [1.0, 2.0]}, {"sample_time_s": 0.0}, "not_positive"),
        ({"T_C": [1.0, 2.0]}, {"sample_time_s": np.nan}, "not_positive"),
        ({"T_C": [1.0]}, {"time_s": [0.0, 1.0]}, "wrong_shape"),
        ({"T_C": [[1.0, 2.0]]}, {"time_s": [0.0, 1.0]}, "wrong_shape"),
        ({"T_C": [np.inf]}, {"time_s": [0.0]}, "infinite_value"),
        ({"T_C": ["warm"]}, {"time_s": [0.0]}, "not_numbers"),
        ({}, {"time_s": [0.0]}, "no_columns"),
        ({"T_C": []}, {"time_s": []}, "wrong_shape"),
    ):
        with refused(words):
            ThermalLog.from_columns(columns, **keywords)


def test_a_column_is_found_whatever_its_case_and_a_wrong_name_gets_a_suggestion() -> None:
    log = a_log()
    assert log.name_of("t_SPINDLE_c") == "T_spindle_C"
    with refused("unknown_column", file="log"):
        log.column("T_spindel_C")
    two = ThermalLog.from_columns({"T_C": [1.0], "t_c": [2.0]}, time_s=[0.0])
    assert two.column("t_c")[0] == 2.0
    with refused("column_ambiguous", file="log"):
        two.column("T_c")


def test_units_are_converted_where_they_can_be() -> None:
    log = ThermalLog.from_columns(
        {"a_K": [293.15], "b_F": [68.0], "z_mm": [0.5], "z_nm": [500.0]}, time_s=[0.0]
    )
    assert log.column("a_K", unit="degC")[0] == pytest.approx(20.0)
    assert log.column("b_F", unit="degC")[0] == pytest.approx(20.0)
    assert log.column("z_mm", unit="um")[0] == pytest.approx(500.0)
    assert log.column("z_nm", unit="um")[0] == pytest.approx(0.5)
    with refused("wrong_unit", file="log", column="z_mm"):
        log.column("z_mm", unit="degC")


def test_patterns_choose_columns_in_their_order() -> None:
    log = a_log()
    assert log.names_matching("t*_C") == ("T_spindle_C", "T_column_c")
    assert log.names_matching("Z_m?") == ("Z_mm",)
    assert log.names_matching("[*") == ()
    assert common_names([log, log.select(["other", "Z_mm"])]) == ("Z_mm", "other")


def test_a_span_is_half_open_and_a_log_of_its_own() -> None:
    part = a_log(start=START).span(3, 6)
    assert part.time_s.tolist() == [0.0, 2.0, 4.0]
    assert part.columns["T_spindle_C"].tolist() == [3.0, 4.0, 5.0]
    assert part.start == START + timedelta(seconds=6)
    assert a_log().between(6.0, 12.0).columns["T_spindle_C"].tolist() == [3.0, 4.0, 5.0]
    with refused("no_row_in_span", first=5, last=5, rows=10):
        a_log().span(5, 5)
    with refused("no_row_between", first_s=100.0, last_s=200.0, duration_s=18.0):
        a_log().between(100.0, 200.0)


def test_block_means_have_even_times_and_a_block_without_a_value_stays_missing() -> None:
    assert a_log().resample(6.0).time_s.tolist() == [0.0, 6.0, 12.0, 18.0]
    log = ThermalLog.from_columns(
        {"T_C": [1.0, np.nan, 3.0, 5.0]}, time_s=[0.0, 10.0, 20.0, 21.0]
    ).resample(10.0)
    np.testing.assert_array_equal(log.columns["T_C"], [1.0, np.nan, 4.0])


@given(
    rows=st.integers(1, 200),
    per_block=st.integers(1, 20),
    seed=st.integers(0, 2**16),
    jitter=st.floats(0.0, 0.45),
)
def test_means_by_block_equal_means_by_slices_also_when_the_clock_jitters(
    rows: int, per_block: int, seed: int, jitter: float
) -> None:
    rng = np.random.default_rng(seed)
    time_s = np.arange(rows) + np.concatenate(
        ([0.0], rng.uniform(-jitter / 2, jitter / 2, rows - 1))
    )
    values = rng.normal(size=rows) + 1e3
    values[rng.random(rows) < 0.2] = np.nan
    log = ThermalLog.from_columns({"x": values}, time_s=time_s).resample(float(per_block))
    slices = [values[k : k + per_block] for k in range(0, rows, per_block)]
    expected = [np.nan if np.isnan(s).all() else np.nanmean(s) for s in slices]
    np.testing.assert_allclose(log.columns["x"], expected, rtol=1e-13)


def test_resampling_keeps_the_mean_and_removes_what_is_faster_than_half_the_new_rate() -> None:
    time_s = np.arange(6000.0)
    slow, fast = np.sin(2 * np.pi * time_s / 3000), np.sin(2 * np.pi * time_s / 60.0)
    both = ThermalLog.from_columns({"x": slow + fast, "slow": slow}, time_s=time_s).resample(60.0)
    np.testing.assert_allclose(both.columns["x"], both.columns["slow"], atol=1e-12)


def test_a_sample_time_that_cannot_be_is_refused() -> None:
    for sample_time_s in (0.0, -1.0, np.nan, np.inf):
        with refused("not_positive", key="sample_time_s"):
            a_log().resample(sample_time_s)
    with refused("too_many_blocks", sample_time_s=1e-9):
        a_log().resample(1e-9)


def test_blocks_of_no_rows_and_of_no_values_are_empty() -> None:
    assert block_numbers(np.zeros(0), 1.0).size == 0
    means = block_means(np.full(3, np.nan), np.array([0, 1, 1]), 2)
    assert bool(np.isnan(means).all())


def test_an_input_is_a_channel_or_a_difference() -> None:
    for text, expected in (
        ("spindle=T_s_c-T_c_c", InputDefinition("spindle", "T_s_c", "T_c_c")),
        (" hall = T_h_c ", InputDefinition("hall", "T_h_c")),
        ("T_h_c", InputDefinition("T_h_c", "T_h_c")),
        ("a - b", InputDefinition("a - b", "a", "b")),
    ):
        assert parse_input(text) == expected
        assert parse_input(f"x={expected.expression}").channels == expected.channels


def test_known_channels_say_where_a_minus_belongs_to_a_name() -> None:
    channels = ["T-1_c", "T-2_c"]
    found = parse_input("x=T-1_c-T-2_c", channels=channels)
    assert (found.plus, found.minus) == ("T-1_c", "T-2_c")
    assert parse_input("x=T-1_c", channels=channels).minus is None
    with refused("ambiguous_difference", key="input"):
        parse_input("x=T-1_c-T-2_c")


def test_what_defines_no_input_is_refused() -> None:
    for code, texts in (
        ("no_input_definition", ("", "=", "x=", "=T_c")),
        ("ambiguous_difference", ("x=a-", "x=-a", "x=a-b-c")),
        ("input_minus_itself", ("x=a-a",)),
    ):
        for text in texts:
            with refused(code, key="input"):
                parse_input(text)


def test_inputs_need_names_of_their_own() -> None:
    check_inputs([InputDefinition("a", "x"), InputDefinition("b", "x")])
    with refused("stated_twice", key="input"):
        check_inputs([InputDefinition("a", "x"), InputDefinition("a", "y")])
    with refused("no_input", key="input"):
        check_inputs([])


def test_an_input_is_evaluated_in_the_rows_of_the_log() -> None:
    log = a_log()
    definition = parse_input("x=T_spindle_c-T_column_C")
    np.testing.assert_array_equal(evaluate_input(log, definition), np.arange(10.0) - 1.0)
    mixed = ThermalLog.from_columns({"a_K": [293.15], "b_C": [18.0]}, time_s=[0.0])
    assert evaluate_input(mixed, parse_input("a_K-b_C"))[0] == pytest.approx(2.0)
    with refused("units_differ", file="log"):
        evaluate_input(log, parse_input("T_spindle_C-speed_rpm"))
    apart = ThermalLog.from_columns({"a_C": [1.0, np.nan], "b_C": [np.nan, 1.0]}, time_s=[0, 1])
    with refused("input_without_value", file="log"):
        evaluate_input(apart, parse_input("a_C-b_C"))


def test_a_spindle_that_heats_from_the_first_row_began_where_its_line_begins() -> None:
    time_s = np.arange(0.0, 300.0, 10.0)
    random = np.random.default_rng(0)
    log = ThermalLog.from_columns({"A_c": np.zeros(time_s.size)}, time_s=time_s)
    heats = np.round(20.0 + 0.008 * time_s, 1)
    assert log.start_of(heats) == pytest.approx(20.0, abs=0.05)
    assert log.start_of(heats, 60.0) == np.mean(heats[:7]) > 20.2  # as was asked for
    still = 20.0 + random.normal(0.0, 0.02, (500, time_s.size))
    for step_s in (10.0, 15.0):  # seven rows and five
        log = ThermalLog.from_columns({"A_c": time_s}, time_s=time_s / 10.0 * step_s)
        mean = np.mean(still[:, log.time_s <= 60.0], axis=1)
        assert np.mean([log.start_of(row) for row in still] == mean) == pytest.approx(
            0.95, abs=0.03
        )
        rise = np.linspace(0.0, 0.01, 500)[:, None] * log.time_s[None, :]  # up to 0.01 K/s
        rounded = np.round(still + rise, 1)
        errors = np.array([log.start_of(row) for row in rounded]) - 20.0
        assert np.sqrt(np.mean(errors**2)) < 0.05


def test_a_fit_counts_its_inputs_from_where_the_free_run_does() -> None:
    time_s = np.arange(0.0, 600.0, 10.0)
    random = np.random.default_rng(1)
    spindle = {f"S{k}_c": 20.0 + 0.004 * time_s + random.normal(0.0, 0.02, 60) for k in range(20)}
    columns = {**spindle, "A_c": 20.0 + random.normal(0.0, 0.02, 60), "Z_um": time_s}
    log = ThermalLog.from_columns(columns, time_s=time_s)
    definitions = [parse_input(f"{name}-A_c") for name in spindle]
    records = records_of([log], definitions, ["Z_um"])
    (record,) = records.experiments["Z_um"]
    levels = records.reference_c
    for k, name in enumerate(spindle):
        run = columns[name] - levels[name] - (columns["A_c"] - levels["A_c"])
        np.testing.assert_allclose(record.u[:, k], run, atol=1e-9)
