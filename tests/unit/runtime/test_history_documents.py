"""What the page on the history says is so, and programs of others read what it says they do."""

# ruff: noqa: S608 - the paths in statements are our own
import json
import re
import sqlite3
import subprocess
import sys
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from tests.unit.runtime.history_records import (
    BEGIN,
    cycle_record,
    event_record,
    url_of,
    write_history,
)
from thermaxis.runtime.history import HistorianSettings, HistoryReader, export_history
from thermaxis.runtime.history._tables import VERSION


@pytest.fixture(scope="module")
def shift(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a history of eight hours from 22:00, so that there are two days."""
    path = tmp_path_factory.mktemp("shift") / "lathe.history.db"
    begin = BEGIN.replace(hour=22)
    records = [cycle_record(k, cycle_s=20.0, begin=begin, good=k % 90 != 7) for k in range(1440)]
    write_history(path, records, [event_record("Off -> Active")])
    return path


def by_duckdb(statement: str, folder: Path) -> list[list[Any]]:
    """Return what DuckDB finds, in a program of its own: it leaves words on the terminal."""
    body = "import duckdb, json; print(json.dumps(duckdb.sql(input()).fetchall(), default=str))"
    words = [sys.executable, "-c", body]
    told = subprocess.run(
        words, input=statement, capture_output=True, text=True, check=True, cwd=folder
    )
    return json.loads(told.stdout)


def page_of(root: Path) -> str:
    return (root / "docs" / "how-to" / "history.md").read_text(encoding="utf-8")


def columns_of(root: Path) -> str:
    return (root / "docs" / "recorded.md").read_text(encoding="utf-8")


def block_of(root: Path, kind: str) -> str:
    return page_of(root).partition(f"```{kind}\n")[2].partition("```")[0]


def test_the_columns_and_headings_of_the_page_are_there(
    root: Path, shift: Path, tmp_path: Path
) -> None:
    section = columns_of(root).partition("| heading of an export |")[2].partition("\n\n")[0]
    rows = [line.split("|")[1:3] for line in section.splitlines() if line.startswith("| `")]
    assert len(rows) > 8
    with HistoryReader(url_of(shift)) as reader:
        headings = {"time", *export_history(reader, tmp_path / "log.parquet").columns}
        columns = set(reader.columns())
    for stored, shown in rows:
        assert set(re.findall(r"`([^`]+)`", shown)) <= headings
        assert set(re.findall(r"`([^`]+)`", stored)) <= columns


def test_what_others_read_of_a_shift_is_what_is_exported(shift: Path, tmp_path: Path) -> None:
    """Files by polars and by DuckDB, the newest hour by the program sqlite3 and by DuckDB."""
    names = ["T_spindle_C", "Z_correction_um", "X_effective_um", "state", "reasons", "active"]
    files = str(shift.with_suffix("") / "**" / "cycles-*.parquet")
    with HistoryReader(url_of(shift)) as reader:
        export_history(reader, tmp_path / "log.parquet", patterns=names, everything=True)
    exported = pl.read_parquet(tmp_path / "log.parquet").select("time", *names)
    assert exported.height == 1440
    scan = pl.scan_parquet(files, missing_columns="insert", extra_columns="ignore")
    by_polars = scan.sort("id").select(pl.col("time_utc").alias("time"), *names).collect()
    rows = by_polars.height
    assert 1000 < rows < 1440
    exported = exported.with_columns(pl.col("active").cast(pl.Boolean))
    assert by_polars.equals(exported.head(rows))
    some = ", ".join(names)
    asked = f"SELECT {some} FROM read_parquet('{files}', union_by_name=true) ORDER BY id"
    assert by_duckdb(asked, tmp_path) == [
        list(row) for row in exported.head(rows).select(names).iter_rows()
    ]
    newest = exported.tail(1440 - rows)
    text = newest["time"].dt.strftime("%Y-%m-%d %H:%M:%S%.6f").to_list()
    with sqlite3.connect(f"{shift.as_uri()}?mode=ro", uri=True) as connection:
        found = connection.execute(f"SELECT time_utc, {some} FROM cycles ORDER BY id").fetchall()
    connection.close()
    assert found == list(zip(text, *[newest[name].to_list() for name in names], strict=True))
    told = subprocess.run(
        ["sqlite3", "-readonly", str(shift), "SELECT count(*), total(T_spindle_C) FROM cycles"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split("|")
    assert int(told[0]) == newest.height
    assert float(told[1]) == pytest.approx(newest["T_spindle_C"].sum())


def test_the_minutes_of_a_file_are_those_of_its_cycles(shift: Path) -> None:
    """Count, least, greatest and mean, by a program of others."""
    folder = shift.with_suffix("")
    asked = (
        "SELECT time_bucket(INTERVAL 1 minute, time_utc), count(T_spindle_C), min(T_spindle_C),"
        " max(T_spindle_C), avg(T_spindle_C), avg(active::DOUBLE)"
        f" FROM read_parquet('{folder}/**/cycles-*.parquet', union_by_name=true) GROUP BY 1"
    )
    stored = (
        "SELECT minute_utc, T_spindle_C_count, T_spindle_C_least, T_spindle_C_greatest,"
        " T_spindle_C_mean, active_mean"
        f" FROM read_parquet('{folder}/**/minutes-*.parquet', union_by_name=true)"
    )
    expected = {minute: rest for minute, *rest in by_duckdb(asked, folder)}
    found = {minute: rest for minute, *rest in by_duckdb(stored, folder)}
    assert set(found) == set(expected)
    assert len(found) > 300
    for minute, numbers in expected.items():
        assert found[minute] == pytest.approx(numbers, rel=1e-12), minute


def test_the_statements_of_the_page_run(
    root: Path, shift: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    statements = [text for text in block_of(root, "sql").split(";") if text.strip()]
    with sqlite3.connect(shift) as connection:
        cycles, minutes, events = (connection.execute(text).fetchall() for text in statements)
    connection.close()
    assert len(cycles) == len(minutes) == 60
    assert cycles[0][0] == "2026-11-04 05:59:40.000000"
    assert minutes[0][:2] == ("2026-11-04 05:59:00", 3)
    assert events[0][3] == "Off -> Active"
    monkeypatch.chdir(shift.parent)
    exec(block_of(root, "python"), {})  # noqa: S102 - the text of our own page
    assert "Z_correction_um" in capsys.readouterr().out
    asked = page_of(root).partition('duckdb -c "')[2].partition('"')[0]
    days = by_duckdb(asked, shift.parent)
    assert {str(day) for day, *_ in days} == {"2026-11-03", "2026-11-04"}


def test_the_numbers_of_the_page_are_those_of_the_program(root: Path) -> None:
    page = page_of(root)
    assert f"retention_days = {HistorianSettings().retention_days}" in page
    assert f"{HistorianSettings().largest_waiting_bytes // 10**6} MB" in page
    assert f"now {VERSION}." in page


def test_the_kinds_of_events_of_the_page_are_those_of_the_contract(root: Path) -> None:
    section = columns_of(root).partition("| events |")[2].partition("\n\n")[0]
    named = set(re.findall(r"`([a-z]+)`", section))
    source = (root / "src/thermaxis/runtime/_ports.py").read_text(encoding="utf-8")
    told = source.partition("    kind: str\n")[2].partition("who: str")[0]
    assert named == set(re.findall(r"``([a-z]+)``", told))
