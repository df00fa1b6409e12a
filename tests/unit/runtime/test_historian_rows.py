"""A cycle becomes a row of bytes and comes back as it was."""

import math
import struct
from dataclasses import replace
from datetime import datetime, timedelta, timezone

import pytest
from hypothesis import given, strategies as st

from tests.unit.runtime.history_records import (
    BEGIN,
    CHANNELS,
    OUTPUTS,
    cycle_record,
    cycle_records,
    samples,
)
from thermaxis.compensation import CycleOutput
from thermaxis.errors import DataError
from thermaxis.runtime import CycleRecord, SourceSample
from thermaxis.runtime.historian import RowPacker
from thermaxis.runtime.historian._layout import BY_OUTPUT, FLAGS, SCALARS, Layout
from thermaxis.runtime.historian._rows import (
    FURTHER_WORD,
    MOST_WORDS,
    NONE_BITS,
    UNPACKABLE,
    from_us,
    pack_block,
    record_of,
    rows_of,
    storable,
    to_us,
    unpack_block,
)
from thermaxis.runtime.historian._trend import ACTIVE, tally


def packer() -> RowPacker:
    made = RowPacker()
    made.outputs, made.channels = OUTPUTS, CHANNELS
    return made


def back_and_forth(record: CycleRecord) -> CycleRecord:
    made = packer()
    packed = made.pack(record)
    layout = Layout.from_text(made.layouts[packed.layout].as_text())
    return record_of(layout, dict(enumerate(made.words)), packed.row, packed.text)


def test_a_cycle_comes_back_exactly() -> None:
    record = cycle_record(7)
    assert back_and_forth(record) == record


@given(cycle_records)
def test_any_record_comes_back_exactly(record: CycleRecord) -> None:
    assert back_and_forth(record) == record
    assert repr(back_and_forth(record)) == repr(record)  # the sign of zero as well


def test_every_field_of_a_cycles_output_is_stored() -> None:
    apart = {"state", "reasons", "contribution_um", "values", "qualities", "quality"}
    assert {*SCALARS, *BY_OUTPUT, *FLAGS, *apart, "outcomes", "answers"} == set(CycleOutput._fields)


def test_none_and_nan_are_two_values() -> None:
    record = cycle_record(1)
    output = record.output._replace(values=(None, math.nan), model_um=(math.inf, -math.inf))
    read = back_and_forth(replace(record, output=output, diameter_mm=None))
    first, second = read.output.values
    assert first is None
    assert second is not None
    assert math.isnan(second)
    assert read.output.model_um == (math.inf, -math.inf)
    assert read.diameter_mm is None


def test_the_number_that_stands_for_none_is_a_nan_unlike_that_of_python() -> None:
    bits = struct.unpack("<Q", struct.pack("<d", math.nan))[0]
    assert bits != NONE_BITS
    assert math.isnan(struct.unpack("<d", struct.pack("<Q", NONE_BITS))[0])


def test_times_of_any_zone_come_back_as_the_same_moment_in_utc() -> None:
    eastern = timezone(timedelta(hours=2))
    stamp = datetime(2026, 11, 3, 9, 30, 0, 123_456, tzinfo=eastern)
    record = replace(cycle_record(1), utc=stamp)
    read = back_and_forth(record)
    assert read.utc == stamp
    assert read.utc.utcoffset() == timedelta(0)


@given(st.datetimes(timezones=st.just(BEGIN.tzinfo)))
def test_microseconds_are_exact_over_all_years(moment: datetime) -> None:
    assert from_us(to_us(moment)) == moment


def test_a_record_that_breaks_its_promises_is_named_by_an_error_that_the_historian_knows() -> None:
    for wrong in (
        {"utc": datetime(2026, 11, 3)},  # noqa: DTZ001 - no zone is the point
        {"number": 2**63},
        {"monotonic_s": "late"},
        {"samples": {"T": None}},
        {"output": None},
    ):
        with pytest.raises(UNPACKABLE):
            packer().pack(replace(cycle_record(1), **wrong))


def test_a_source_that_invents_words_without_end_fills_no_memory() -> None:
    made = packer()
    record = cycle_record(1)
    for number in range(MOST_WORDS + 50):
        odd = {"T_spindle_C": SourceSample(20.0, False, f"Bad{number}", 0.0, None)}
        packed = made.pack(replace(record, samples=odd))
    assert len(made.words) == MOST_WORDS
    read = record_of(made.layouts[0], dict(enumerate(made.words)), packed.row, None)
    assert read.samples["T_spindle_C"].status == FURTHER_WORD


def test_a_text_that_no_database_takes_is_written_as_escapes() -> None:
    assert storable("a\0b\ud800", 100) == "a\\x00b\\ud800"
    assert storable("µ↑" * 10, 5) == "µ↑µ↑µ"


# ---- blocks -------------------------------------------------------------------------------------


@given(st.lists(st.binary(min_size=40, max_size=40), min_size=1, max_size=50))
def test_rows_of_a_block_come_back(rows: list[bytes]) -> None:
    layout = Layout((), (), (), (), (), (), (), (), 0, 0, (), scalars=(), by_output=(), flags=())
    size = layout.row.size
    rows = [row[:size].ljust(size, b"\1") for row in rows]
    assert list(rows_of(layout, unpack_block(pack_block(rows), layout, len(rows)))) == rows


def test_a_damaged_block_is_an_error_and_never_other_numbers() -> None:
    made = packer()
    rows = [made.pack(cycle_record(k)).row for k in range(50)]
    block = pack_block(rows)
    layout = made.layouts[0]
    refused = 0
    for place in range(len(block)):
        damaged = bytes([*block[:place], block[place] ^ 0x20, *block[place + 1 :]])
        try:
            assert unpack_block(damaged, layout, 50) == b"".join(rows)  # a bit that means nothing
        except DataError:
            refused += 1
    assert refused > 0.99 * len(block)
    with pytest.raises(DataError, match="damaged"):
        unpack_block(block[:-1], layout, 50)
    with pytest.raises(DataError, match="damaged"):
        unpack_block(block, layout, 49)
    with pytest.raises(DataError, match="damaged"):
        unpack_block(block, layout, 51)


# ---- trend --------------------------------------------------------------------------------------


def test_the_names_of_all_numbers_are_those_that_a_user_knows() -> None:
    made = packer()
    made.pack(cycle_record(1))
    names = [column.name for column in made.layouts[0].series]
    assert len(set(names)) == len(names)
    for name in (
        *("T_spindle_C", "T_table_C", "referenced", "lateness_s", "diameter_mm"),
        *("Z_um.correction", "X_um.model", "Z_um.wanted", "X_um.weight", "X_um.trim"),
        *("Z_um.part.spindle", "Z_um.part.table", "X_um.part.spindle", "Z_um.gain.table"),
        *("Z_um.requested", "X_um.accepted", "X_um.effective"),
    ):
        assert name in names


def test_two_series_of_one_name_stay_two() -> None:
    made = packer()
    record = cycle_record(1)
    odd = {**record.samples, "Z_um.model": record.samples["T_table_C"]}
    made.pack(replace(record, samples=odd))
    names = [column.name for column in made.layouts[0].series]
    assert {"Z_um.model", "Z_um.model'"} <= set(names)


def test_every_number_by_its_name_is_the_one_of_the_record() -> None:
    made = packer()
    record = cycle_record(30)
    numbers = made.layouts
    row = made.pack(record).row
    values = numbers[0].row.unpack(row)
    found = {column.name: values[column.place] for column in numbers[0].series}
    output = record.output
    assert found["T_spindle_C"] == record.samples["T_spindle_C"].value
    assert found["referenced"] == 1.0
    assert (found["Z_um.correction"], found["X_um.correction"]) == output.correction_um
    assert (found["Z_um.model"], found["X_um.weight"]) == (output.model_um[0], output.weight[1])
    assert (found["X_um.trim"], found["Z_um.before"]) == (output.trim_um[1], output.before_um[0])
    assert (found["Z_um.part.spindle"], found["Z_um.part.table"]) == output.contribution_um[0]
    assert found["X_um.part.spindle"] == output.contribution_um[1][0]
    assert (found["Z_um.gain.table"], found["X_um.gain.spindle"]) == (0.8, 1.0)
    assert found["X_um.requested"] == record.applied["X_um"].requested_um
    assert found["Z_um.accepted"] == record.applied["Z_um"].accepted_um
    assert found["X_um.effective"] == record.applied["X_um"].effective_um
    assert math.isnan(found["Z_um.effective"])
    assert (found["lateness_s"], found["diameter_mm"]) == (0.0005, 1500.0)


def test_minutes_keep_least_greatest_sum_and_count_of_good_values() -> None:
    made = packer()
    begin = BEGIN + timedelta(seconds=30)
    records = [cycle_record(k, begin=begin, good=k != 3) for k in range(60)]
    rows = [made.pack(record).row for record in records]
    found = tally(made.layouts[0], rows, made.words.index("Active"))
    minute = to_us(BEGIN) // 60_000_000
    by_name = {(column.name, m - minute): numbers for (column, m), numbers in found.items()}
    values = [r.samples["T_spindle_C"].value for r in records[:30]]
    good = [v for k, v in enumerate(values) if k != 3 and v is not None]
    assert by_name["T_spindle_C", 0] == (29, min(good), max(good), pytest.approx(sum(good)))
    assert by_name["T_spindle_C", 1].entries == 30
    assert by_name["active", 0] == (30, 1.0, 1.0, 30.0)
    assert ("Z_um.effective", 0) not in by_name  # it was never there
    assert {m for _, m in by_name} == {0, 1}
    assert tally(made.layouts[0], rows, None)[ACTIVE, minute].total == 0.0


@given(st.lists(samples, min_size=1, max_size=20))
def test_a_tally_of_all_is_the_tally_of_two_halves(some: list[SourceSample]) -> None:
    made = packer()
    record = cycle_record(0)
    rows = [
        made.pack(replace(record, samples={"T": sample._replace(status="x")})).row
        for sample in some
    ]
    layout = made.layouts[0]
    half = len(rows) // 2
    whole, joined = tally(layout, rows, 1), tally(layout, rows[:half], 1)
    for key, new in tally(layout, rows[half:], 1).items():
        joined[key] = joined[key] | new if key in joined else new
    assert set(whole) == set(joined)
    for key, numbers in whole.items():
        assert numbers[:3] == joined[key][:3]
        assert numbers.total == pytest.approx(joined[key].total, rel=1e-12, abs=1e3)
