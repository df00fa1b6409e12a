"""What the page on the history says is so."""

import re
import sqlite3
from pathlib import Path

from tests.unit.runtime.history_records import cycle_record, url_of, write_history
from thermaxis.runtime.historian import HistorianSettings, HistoryReader, export_history
from thermaxis.runtime.historian._store import BLOCK_ROWS
from thermaxis.runtime.historian._tables import SCHEMA


def page_of(root: Path) -> str:
    return (root / "docs" / "how-to" / "history.md").read_text(encoding="utf-8")


def test_the_headings_and_series_of_the_page_are_there(root: Path, tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    write_history(path, [cycle_record(k) for k in range(300)])
    section = page_of(root).partition("| heading |")[2].partition("\n\n")[0]
    rows = [line.split("|")[1:3] for line in section.splitlines() if line.startswith("| `")]
    assert len(rows) > 5
    with HistoryReader(url_of(path)) as reader:
        headings = set(export_history(reader, tmp_path / "log.parquet").columns)
        series = set(reader.series())
    for shown, stored in rows:
        assert set(re.findall(r"`([^`]+)`", shown)) <= headings
        assert set(re.findall(r"`([^`]+)`", stored)) <= series


def test_the_statements_of_the_page_run(root: Path, tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    write_history(path, [cycle_record(k) for k in range(BLOCK_ROWS)])
    block = page_of(root).partition("```sql\n")[2].partition("```")[0]
    statements = [text for text in block.split(";") if text.strip()]
    with sqlite3.connect(path) as connection:
        trend, events = (connection.execute(text).fetchall() for text in statements)
    connection.close()
    assert trend[0][0] == "2026-11-03 06:04:00"
    means = [row[2] for row in trend]
    assert means == sorted(means)  # it warms, so the correction falls; the newest comes first
    assert events == []


def test_the_numbers_of_the_page_are_those_of_the_program(root: Path) -> None:
    page = page_of(root)
    assert f"retention_days = {HistorianSettings().retention_days}" in page
    assert f"{HistorianSettings().largest_waiting_bytes // 10**6} MB" in page
    assert f"now {SCHEMA}." in page
    assert f"counted {BLOCK_ROWS} at a time" in page


def test_the_kinds_of_events_of_the_page_are_those_of_the_contract(root: Path) -> None:
    section = page_of(root).partition("| events |")[2].partition("\n\n")[0]
    named = set(re.findall(r"`([a-z]+)`", section))
    source = (root / "src/thermaxis/runtime/_ports.py").read_text(encoding="utf-8")
    told = source.partition("    kind: str\n")[2].partition("who: str")[0]
    assert named == set(re.findall(r"``([a-z]+)``", told))
