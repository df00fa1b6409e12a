"""What is exported is what was recorded, and the readers of thermal logs read it."""

import json
import os
import shutil
import tempfile
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.unit.runtime.history_records import (
    BEGIN,
    cycle_record,
    event_record,
    threadless,
    url_of,
    write_history,
)
from thermaxis.cli import main
from thermaxis.codes import Message
from thermaxis.compensation import SupervisorState
from thermaxis.errors import DataError
from thermaxis.files import read_thermal_log
from thermaxis.runtime import EventRecord
from thermaxis.runtime._backlog import Loss
from thermaxis.runtime.history import HistoryReader, check_history, copy_history, export_history

FORMATS = pytest.mark.parametrize("name", ["log.parquet", "log.csv"])


@pytest.fixture
def history(tmp_path: Path) -> Path:
    path = tmp_path / "h.db"
    events = (
        EventRecord.of(BEGIN, "start", "", Message("event-loop_started", {"machine": "lathe"})),
        event_record("enabled", kind="request"),
    )
    write_history(path, [cycle_record(k, good=k % 50 != 49) for k in range(600)], events)
    return path


@FORMATS
def test_an_export_is_a_thermal_log_with_the_numbers_of_the_records(
    history: Path, tmp_path: Path, name: str
) -> None:
    records = [cycle_record(k, good=k % 50 != 49) for k in range(600)]
    with HistoryReader(url_of(history)) as reader:
        written = export_history(reader, tmp_path / name)
    assert written.rows == 600
    log = read_thermal_log(tmp_path / name)
    assert log.start == BEGIN
    assert log.remarks == ()
    assert log.time_s.tolist() == list(range(600))
    good = [k % 50 != 49 for k in range(600)]
    shown = [
        r.samples["T_spindle_C"].value if g else np.nan for r, g in zip(records, good, strict=True)
    ]
    np.testing.assert_array_equal(log.columns["T_spindle_C"], shown)
    for heading, values in {
        "Z_correction_um": [r.output.correction_um[0] for r in records],
        "X_model_um": [r.output.model_um[1] for r in records],
        "Z_part_spindle_um": [r.output.contribution_um[0][0] for r in records],
        "X_weight": [0.75] * 600,
        "X_effective_um": [r.applied["X_um"].effective_um for r in records],
        "active": [1.0] * 600,
    }.items():
        np.testing.assert_allclose(log.columns[heading], values, rtol=0.0, atol=5.1e-4)
    assert np.isnan(log.columns["Z_effective_um"]).all()
    assert (log.units["T_spindle_C"], log.units["Z_correction_um"]) == ("degC", "um")


@FORMATS
def test_everything_has_status_state_and_reasons_as_codes(tmp_path: Path, name: str) -> None:
    path = tmp_path / "h.db"
    states = [SupervisorState.HOLDING, SupervisorState.ACTIVE]
    records = [cycle_record(k, good=k % 2 == 1, state=states[k % 2]) for k in range(10)]
    odd = records[3].samples["T_table_C"]._replace(status="=cmd()")
    records[3] = replace(records[3], samples={**records[3].samples, "T_table_C": odd})
    write_history(path, records)
    with HistoryReader(url_of(path)) as reader:
        export_history(reader, tmp_path / name, everything=True)
    read = pl.read_csv if name.endswith("csv") else pl.read_parquet
    frame = read(tmp_path / name)
    assert frame["T_spindle_C"].null_count() == 5
    assert frame["T_spindle_C_status"].to_list() == ["BadSensorFailure", "Good"] * 5
    assert frame["state"].to_list() == ["Holding", "Active"] * 5
    assert (frame["reasons"][0], frame["reasons"][1]) == ("input_bad recovering", None)
    shown = "'=cmd()" if name.endswith("csv") else "=cmd()"  # no formula in a spreadsheet
    assert frame["T_table_C_status"][3] == shown
    assert len(read_thermal_log(tmp_path / name).time_s) == 10


def test_columns_of_two_models_stand_side_by_side_and_are_empty_where_they_were_not(
    tmp_path: Path,
) -> None:
    path = tmp_path / "h.db"
    first = [cycle_record(k) for k in range(5)]
    parts = (("spindle", "hall"), ("spindle",))
    second = [replace(cycle_record(k), parts=parts) for k in range(5, 10)]
    write_history(path, first + second)
    with HistoryReader(url_of(path)) as reader:
        export_history(reader, tmp_path / "log.parquet", patterns=["Z_part_*"])
    frame = pl.read_parquet(tmp_path / "log.parquet")
    assert set(frame.columns) == {"time", "Z_part_spindle_um", "Z_part_table_um", "Z_part_hall_um"}
    assert [frame[f"Z_part_{c}_um"].null_count() for c in ("spindle", "table", "hall")] == [0, 5, 5]


def test_a_channel_that_is_called_as_a_column_of_ours_is_another_column(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    record = cycle_record(1)
    odd = dict.fromkeys(("time_utc", "STATE", "x" * 90, "x" * 91), record.samples["T_table_C"])
    write_history(path, [replace(record, samples={**odd, **record.samples})])
    with HistoryReader(url_of(path)) as reader:
        schema = reader.columns()
        written = export_history(reader, tmp_path / "log.parquet")
    assert {"time_utc", "time_utc_2", "STATE", "state_2", "x" * 63} <= set(schema)
    assert f"{'x' * 59}_2" in written.columns
    assert len({name.casefold() for name in schema}) == len(schema)


def test_a_redundant_sensor_has_its_unit_at_the_end_of_its_heading(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    record = cycle_record(1)
    redundant = {
        "T_table_C.redundant": record.samples["T_table_C"],
        "interlock.valve": record.samples["referenced"],
    }
    write_history(path, [replace(record, samples={**record.samples, **redundant})])
    with HistoryReader(url_of(path)) as reader:
        export_history(reader, tmp_path / "log.csv")
    log = read_thermal_log(tmp_path / "log.csv")
    assert log.units["T_table_redundant_C"] == "degC"
    assert log.columns["T_table_redundant_C"].tolist() == [record.samples["T_table_C"].value]
    assert "interlock_valve" in log.columns


def test_nothing_to_export_is_said_with_what_there_is(history: Path, tmp_path: Path) -> None:
    with HistoryReader(url_of(history)) as reader:
        with pytest.raises(DataError, match=r"no cycle in this span.*from 2026-11-03T06:00:00"):
            export_history(reader, tmp_path / "log.csv", first=BEGIN + timedelta(days=1))
        with pytest.raises(DataError, match=r"No column.*T_spindle_C"):
            export_history(reader, tmp_path / "log.csv", patterns=["Y_*"])
    assert not list(tmp_path.glob("log*"))


def test_a_damaged_file_ends_an_export_and_leaves_the_older_one(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    write_history(path, [cycle_record(k, cycle_s=10.0) for k in range(600)])
    (file,) = (tmp_path / "h").glob("*/*/cycles-*.parquet")
    content = bytearray(file.read_bytes())
    content[100:4000] = bytes(3900)
    file.write_bytes(content)
    target = tmp_path / "log.parquet"
    target.write_text("older")
    with HistoryReader(url_of(path)) as reader, pytest.raises(DataError, match="cannot be read"):
        export_history(reader, target)
    assert target.read_text() == "older"
    assert [p.name for p in tmp_path.glob("*.part")] == []
    with pytest.raises(DataError, match="cannot be read"):
        check_history(url_of(path))


def test_a_copy_begins_again_where_a_day_was_joined_and_leaves_nothing_where_it_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, target = tmp_path / "h.db", tmp_path / "copies" / "copy.db"
    target.parent.mkdir()
    write_history(path, [cycle_record(k, cycle_s=60.0) for k in range(200)])
    copied: list[str] = []

    def joined(source: Path, copy: Path) -> None:
        copied.append(source.name)
        if len(copied) in {2, 3}:
            raise FileNotFoundError(2, "No such file or directory", str(source))
        if len(copied) == 30:
            raise OSError(28, "No space left on device")
        shutil.copyfile(source, copy)

    monkeypatch.setattr(shutil, "copy2", joined)
    copy_history(url_of(path), target)
    with HistoryReader(url_of(target)) as reader:
        assert reader.cycles().collect().height == 200
    copied[:] = copied + [""] * (29 - len(copied))
    with pytest.raises(OSError, match="No space"):
        copy_history(url_of(path), target.with_name("full.db"))
    (tmp_path / "h").rename(tmp_path / "away")
    with pytest.raises(DataError, match="is not there"):
        copy_history(url_of(path), target.with_name("away.db"))
    assert sorted(found.name for found in target.parent.iterdir()) == ["copy", "copy.db"]


def test_minutes_that_cannot_be_read_are_damage(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    write_history(path, [cycle_record(k, cycle_s=60.0) for k in range(90)])
    assert check_history(url_of(path)).cycles == 90
    (file,) = (tmp_path / "h").glob("*/*/minutes-*.parquet")
    file.write_bytes(b"PAR1 torn PAR1")
    with pytest.raises(DataError, match="cannot be read"):
        check_history(url_of(path))


# ---- the command --------------------------------------------------------------------------------


def command(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str, str]:
    code = main(["history", *map(str, words)])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_the_command_exports_a_span(
    history: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "log.parquet"
    code, out, _ = command(
        capsys,
        *("export", history, "-o", target, "--column", "T_*"),
        *("--from", "2026-11-03T06:01:00Z", "--to", "2026-11-03T06:02:00Z"),
    )
    assert (code, out) == (0, f"written: {target} (60 cycles, 3 columns)\n")
    assert read_thermal_log(target).start == BEGIN + timedelta(minutes=1)
    code, out, _ = command(capsys, "export", history, "-o", target, "--last", "30s")
    assert "(31 cycles," in out  # both ends of the time
    assert command(capsys, "export", url_of(history), "-o", target)[0] == 0


def test_a_time_without_a_zone_is_one_of_this_computer(
    history: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    local = (BEGIN + timedelta(minutes=5)).astimezone().replace(tzinfo=None)
    target = tmp_path / "log.csv"
    command(capsys, "export", history, "-o", target, "--from", local.isoformat())
    assert read_thermal_log(target).start == BEGIN + timedelta(minutes=5)


def test_the_command_lists_events(
    history: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, out, _ = command(capsys, "events", history)
    assert code == 0
    assert [line.split()[2] for line in out.splitlines()] == ["start", "request"]
    assert out.endswith("enabled (Anna)\n")
    _, out, _ = command(capsys, "events", history, "--kind", "loss")
    assert out == "There are no such events.\n"
    _, out, _ = command(capsys, "events", history, "--newest", "1", "--json", "-")
    (event,) = json.loads(out)["events"]
    assert event == {
        "utc": "2026-11-03T06:00:00+00:00",
        "kind": "request",
        "who": "Anna",
        "text": "enabled",
        "details": {"from": "Off", "value": 1.5, "on": True, "x": None},
    }


def test_events_with_control_characters_do_not_reach_the_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "h.db"
    write_history(path, [], (event_record("a\x1b[2Jb\nc"),))
    _, out, _ = command(capsys, "events", path)
    assert "\x1b" not in out
    assert out.count("\n") == 1
    assert "a\\x1b[2Jb\\nc" in out


def test_the_command_checks_a_history_and_tells_of_losses(
    history: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    writer = threadless(history)
    writer._backlog.add_loss(Loss(12, 3, 0, 10**6))
    writer.event(event_record("the state was taken up", kind="start"))
    writer.attempt()
    code, out, _ = command(capsys, "check", history)  # while the writer has it open
    writer.disconnect()
    assert code == 0
    assert "sound" in out
    assert "600 cycles from 2026-11-03T06:00:00+00:00 to 2026-11-03T06:09:59+00:00" in out
    assert "4 events, 1 start of the loop" in out
    assert "what was lost, 12 cycles and 3 events" in out


def test_a_copy_is_whole_while_the_writer_goes_on(
    history: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = tmp_path / "copy.db"
    writer = threadless(history)
    for k in range(600, 900):
        writer.record(cycle_record(k, cycle_s=20.0))
    writer.attempt()
    assert command(capsys, "copy", history, "-o", copy)[0] == 0
    writer.disconnect()
    assert not copy.with_name("copy.db-wal").exists()
    copy.chmod(0o444)
    with HistoryReader(url_of(copy)) as reader:
        found = reader.cycles(columns=["number"]).collect()["number"].to_list()
    assert found == list(range(900))
    code, _, error = command(capsys, "copy", history, "-o", copy)
    assert code == 2
    assert "exists already" in error


def test_what_cannot_be_is_refused_with_a_reason(
    history: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for words, message in (
        (("export", "none.db", "-o", "x.csv"), "no such file"),
        (("export", history, "-o", "x.txt"), "names no format"),
        (("export", history, "-o", "x.csv", "--last", "1h", "--to", "2026-11-04"), "exclude each"),
        (("events", history, "--from", "2026-11-04", "--to", "2026-11-03"), "before it begins"),
        (("check", "none.toml"), "none.toml"),
        (("copy", "postgresql://user@127.0.0.1/db", "-o", "x.db"), "pg_dump"),
    ):
        code, _, error = command(capsys, *words)
        assert code == 2
        assert message in error
    for option, value in (("--from", "yesterday"), ("--newest", "0"), ("--last", "x")):
        with pytest.raises(SystemExit):
            main(["history", "events", str(history), option, value])
        assert value in capsys.readouterr().err


def test_a_history_beside_which_nothing_can_be_written_is_read(history: Path) -> None:
    """As on a medium that is read only; whoever may write everywhere gives that up meanwhile."""
    nobody = 65_534
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copy = folder / "h.db"
        copy.write_bytes(history.read_bytes())
        folder.chmod(0o555)
        if os.geteuid() == 0:
            os.seteuid(nobody)
        try:
            assert not os.access(folder, os.W_OK, effective_ids=True)
            with HistoryReader(url_of(copy)) as reader:
                assert reader.cycles().collect().height == 600
        finally:
            if os.getuid() == 0:
                os.seteuid(0)
            folder.chmod(0o755)
