"""Every value of a cycle has a column of its own, with its unit; what is not there is null."""

import math
from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone

import pytest
from hypothesis import given, settings, strategies as st

from tests.unit.runtime.history_records import (
    BEGIN,
    CHANNELS,
    OUTPUTS,
    cycle_record,
    cycle_records,
)
from thermaxis.compensation import SupervisorState
from thermaxis.runtime import CycleRecord, SourceSample
from thermaxis.runtime.history import Columns, input_column, output_column
from thermaxis.runtime.history._columns import UNPACKABLE, from_us, storable, to_us


def columns() -> Columns:
    made = Columns()
    made.outputs = OUTPUTS
    return made


def values_of(record: CycleRecord) -> dict[str, object]:
    return columns().row_of(record).values()


def test_every_value_by_its_column_is_the_one_of_the_record() -> None:
    plain = cycle_record(31, state=SupervisorState.HOLDING)
    record = replace(plain, sink_reason="failure-refused")
    output, applied = record.output, record.applied
    expected = {
        "time_utc": record.utc,
        "number": 31,
        "active": False,
        "lateness_s": 0.0005,
        "monotonic_s": 1031.0,
        "diameter_mm": 1500.0,
        "T_spindle_C": record.samples["T_spindle_C"].value,
        "T_table_C": record.samples["T_table_C"].value,
        "referenced": 1.0,
        "T_spindle_age_s": 0.02,
        "T_table_age_s": 0.02,
        "referenced_age_s": 0.02,
        "T_spindle_used_C": output.values[0],
        "T_table_used_C": output.values[1],
        "Z_weight": 1.0,
        "X_weight": 0.75,
        "Z_at_limit": False,
        "X_at_limit": output.at_limit[1],
        "Z_effective_um": None,
        "X_accepted_um": None,
        "answers": None,
        "state": "Holding",
        "quality": "good",
        "reasons": "input_bad recovering",
        "outcomes": "diameter_held",
        "source_reason": None,
        "sink_reason": "failure-refused",
        "T_spindle_C_status": "Good",
        "T_table_C_status": "Good",
        "referenced_status": "Good",
        "T_spindle_C_quality": "good",
        "T_table_C_quality": "redundant",
    }
    rounded = {
        "Z_correction_um": output.correction_um[0],
        "X_correction_um": output.correction_um[1],
        "Z_wanted_um": output.wanted_um[0],
        "X_wanted_um": output.wanted_um[1],
        "Z_model_um": output.model_um[0],
        "X_model_um": output.model_um[1],
        "Z_trim_um": output.trim_um[0],
        "X_trim_um": output.trim_um[1],
        "Z_commanded_um": applied["Z_um"].requested_um,
        "Z_accepted_um": applied["Z_um"].accepted_um,
        "X_commanded_um": applied["X_um"].requested_um,
        "X_effective_um": applied["X_um"].effective_um,
        "Z_part_spindle_um": output.contribution_um[0][0],
        "Z_part_table_um": output.contribution_um[0][1],
        "X_part_spindle_um": output.contribution_um[1][0],
    }
    found = values_of(record)
    assert set(found) == set(expected) | set(rounded)
    assert {name: found[name] for name in expected} == expected
    for name, value in rounded.items():
        assert found[name] == pytest.approx(value, abs=0.5e-3), name  # to a nanometre


def test_what_is_no_number_or_of_bad_status_or_not_said_is_null() -> None:
    record = cycle_record(1, good=False)
    output = record.output._replace(values=(None, math.nan), model_um=(math.inf, -math.inf))
    found = values_of(replace(record, output=output, diameter_mm=None, applied={}))
    assert found["T_spindle_C"] is None
    assert found["T_spindle_C_status"] == "BadSensorFailure"
    for name in (
        *("T_spindle_used_C", "T_table_used_C", "Z_model_um", "X_model_um", "diameter_mm"),
        *("Z_commanded_um", "Z_accepted_um", "X_effective_um"),
    ):
        assert found[name] is None, name
    assert found["T_table_C"] is not None


def test_columns_are_called_as_inputs_and_outputs_with_the_unit_at_the_end() -> None:
    assert output_column("Z_um", "accepted") == "Z_accepted_um"
    assert output_column("Z", "accepted") == "Z_accepted"
    assert input_column("T_spindle_C") == "T_spindle_C"
    assert input_column("T_spindle_C.redundant") == "T_spindle_redundant_C"
    assert input_column("probe.Z_um") == "probe_Z_um"
    assert input_column("interlock.door") == "interlock_door"


@settings(max_examples=40)
@given(cycle_records)
def test_any_record_becomes_a_row_or_an_error_that_is_known(record: CycleRecord) -> None:
    made = columns()
    made.outputs = tuple(f"{k}_um" for k, _ in enumerate(record.parts))
    try:
        found = made.row_of(record).values()
    except UNPACKABLE:
        return
    assert found["time_utc"] == record.utc
    assert len({name.casefold() for name in found}) == len(found)


def test_a_record_that_breaks_its_promises_is_named_by_an_error_that_the_historian_knows() -> None:
    for wrong in (
        {"utc": datetime(2026, 11, 3)},  # noqa: DTZ001 - no zone is the point
        {"lateness_s": "late"},
        {"monotonic_s": "late"},
        {"samples": {"T": None}},
        {"output": None},
        {"parts": ()},
        {"output": cycle_record(1).output._replace(weight=(1.0,))},
    ):
        with pytest.raises(UNPACKABLE):
            columns().row_of(replace(cycle_record(1), **wrong))


def test_values_stand_under_the_names_of_the_model_that_computed_them() -> None:
    made, record = columns(), cycle_record(1)
    before = made.row_of(record).values()
    turned = record.output._replace(values=record.output.values[::-1])
    after = made.row_of(replace(record, output=turned, channels=CHANNELS[::-1])).values()
    assert {name: after[name] for name in before} == before | {
        "T_spindle_C_quality": "redundant",
        "T_table_C_quality": "good",
    }
    fewer = record.output._replace(values=(21.5,), qualities=record.output.qualities[:1])
    one = made.row_of(replace(record, output=fewer, channels=("T_table_C",))).values()
    assert one["T_table_used_C"] == 21.5
    assert "T_spindle_used_C" not in one


def test_times_of_any_zone_are_the_same_moment_in_utc() -> None:
    stamp = datetime(2026, 11, 3, 9, 30, 0, 123_456, tzinfo=timezone(timedelta(hours=2)))
    found = values_of(replace(cycle_record(1), utc=stamp))["time_utc"]
    assert found == stamp
    assert isinstance(found, datetime)
    assert found.tzinfo is UTC


@given(st.datetimes(timezones=st.just(BEGIN.tzinfo)))
def test_microseconds_are_exact_over_all_years(moment: datetime) -> None:
    assert from_us(to_us(moment)) == moment


def test_a_text_that_no_database_takes_is_written_as_escapes() -> None:
    assert storable("a\0b\ud800", 100) == "a\\x00b\\ud800"
    assert storable("a\0b", 100) == "a\\x00b"
    assert storable("plain", 3) == "pla"
    assert storable("µ↑" * 10, 5) == "µ↑µ↑µ"
    odd = SourceSample(20.0, False, "Bad\0" * 5000, 0.0, None)
    found = values_of(replace(cycle_record(1), samples={"T_spindle_C": odd}))
    assert len(str(found["T_spindle_C_status"])) == 4000
