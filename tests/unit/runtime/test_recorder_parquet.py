"""Complete logs as Parquet: the same numbers, when they are complete."""

import asyncio
from datetime import UTC, datetime
from pathlib import Path

import polars as pl
import pytest

from tests.unit.runtime.recording import START, Recording, channel, rows_of, settings
from thermaxis.codes import Message
from thermaxis.files import read_thermal_log
from thermaxis.runtime.record import _files, write_parquet

NAME = "lathe-2026-11-21.csv"


@pytest.fixture
def log(tmp_path: Path) -> Path:
    some = settings(channel("T_a_C"), channel("speed", 5000, heading="speed [rpm]", unit="rpm"))
    Recording(some, tmp_path).run(20.0)
    return tmp_path / NAME


def test_the_parquet_file_holds_what_the_csv_file_holds(log: Path) -> None:
    write_parquet(log, log.parent / "sources" / NAME)
    csv, parquet = read_thermal_log(log), read_thermal_log(log.with_suffix(".parquet"))
    assert (parquet.start, parquet.units) == (csv.start, csv.units)
    assert parquet.time_s.tolist() == csv.time_s.tolist()
    for name in csv.columns:
        assert parquet.columns[name].tolist() == pytest.approx(
            csv.columns[name].tolist(), nan_ok=True
        )


def test_status_and_source_time_are_columns_of_the_file_of_sources(log: Path) -> None:
    beside = log.parent / "sources" / NAME
    write_parquet(log, beside)
    frame = pl.read_parquet(beside.with_suffix(".parquet"))
    assert frame["time"].to_list()[0] == START
    assert frame["T_a_C status"].to_list() == ["Good"] * 20
    assert frame["T_a_C source_time"].to_list()[3] == datetime(2026, 11, 21, 12, 0, 3, tzinfo=UTC)
    assert frame["speed status"].null_count() == 16


def test_a_recorder_writes_each_day_as_parquet_when_it_is_complete(tmp_path: Path) -> None:
    start = datetime(2026, 11, 21, 23, 59, 50, tzinfo=UTC)
    Recording(settings(channel("T_a_C"), parquet=True), tmp_path, start).run(20.0)
    first, second = sorted(tmp_path.glob("*.parquet"))
    assert read_thermal_log(first).rows == len(rows_of(tmp_path / NAME)) == 10
    assert read_thermal_log(second).rows == 10


def test_a_parquet_file_that_cannot_be_written_is_told_and_ends_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_paths: Path) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(_files, "write_parquet", full)
    recording = Recording(settings(channel("T_a_C"), parquet=True), tmp_path)
    assert recording.run(5.0).rows == 5
    values = {"file": NAME, "cause": "No space left on device"}
    assert recording.told[-1] == Message("recording-parquet_unwritten", values)


def test_a_cell_that_cannot_be_read_ends_nothing(tmp_path: Path) -> None:
    async def spoil(recording: Recording) -> None:
        await asyncio.sleep(3.5)
        path = tmp_path / NAME
        before, middle, after = path.read_bytes().partition(b"Z,")
        path.write_bytes(before + middle + b"x" + after[1:])

    start = datetime(2026, 11, 21, 23, 59, 50, tzinfo=UTC)
    recording = Recording(settings(channel("T_a_C"), parquet=True), tmp_path, start)
    assert recording.run(20.0, spoil).rows == 20
    (told,) = (one for one in recording.told if one.code == "recording-parquet_unwritten")
    assert told.values["file"] == NAME
    assert "conversion" in str(told.values["cause"])
