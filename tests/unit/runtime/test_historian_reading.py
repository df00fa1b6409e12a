"""Spans, events and trends of a history, beside numbers that were worked out another way."""

import sqlite3
from collections.abc import Sequence
from datetime import datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from tests.unit.runtime.history_records import (
    BEGIN,
    cycle_record,
    event_record,
    url_of,
    write_history,
)
from thermaxis.compensation import Answer, AnswerCode, Request, RequestKind, SupervisorState
from thermaxis.errors import DataError
from thermaxis.runtime import CycleRecord
from thermaxis.runtime.historian import (
    Backlog,
    FileWatch,
    HistoryReader,
    RowPacker,
    Trend,
    open_store,
    parse_url,
)
from thermaxis.runtime.historian._rows import to_us
from thermaxis.runtime.historian._writer import pack_event

HOUR = timedelta(hours=1)
DAY = timedelta(days=1)


def plain_trend(
    records: Sequence[CycleRecord], first: datetime, step: timedelta
) -> dict[int, tuple[float, float, float]]:
    """Return least, mean and greatest temperature of the spindle by step, the plain way."""
    found: dict[int, list[float]] = {}
    for record in records:
        sample = record.samples["T_spindle_C"]
        if sample.good and sample.value is not None:
            found.setdefault((record.utc - first) // step, []).append(sample.value)
    return {k: (min(v), sum(v) / len(v), max(v)) for k, v in found.items()}


def steps_of(trend: Trend, first: datetime) -> dict[int, tuple[float, float, float]]:
    begin_us = to_us(first)
    keys = [(time_us - begin_us) // trend.step_us for time_us in trend.time_us]
    columns = zip(trend.lowest, trend.mean, trend.highest, strict=True)
    return dict(zip(keys, columns, strict=True))


def check_trend(path: Path, records: Sequence[CycleRecord], span: timedelta, points: int) -> Trend:
    with HistoryReader(url_of(path)) as reader:
        trends = reader.trend(["T_spindle_C", "active"], BEGIN, BEGIN + span, points=points)
    trend = trends["T_spindle_C"]
    expected = plain_trend(records, BEGIN, timedelta(microseconds=trend.step_us))
    found = steps_of(trend, BEGIN)
    assert list(found) == list(expected)
    for key, numbers in expected.items():
        assert found[key] == pytest.approx(numbers, rel=1e-12)
    assert len(trend.time_us) <= points
    assert set(trends["active"].mean) == {1.0}
    return trend


def test_a_trend_of_an_hour_is_made_from_the_cycles(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    records = [cycle_record(k, good=k % 100 != 7) for k in range(3600)]
    write_history(path, records)
    trend = check_trend(path, records, HOUR, 100)
    assert trend.step_us == 36_000_000
    assert trend.unit == ""


def test_a_trend_of_days_is_made_from_the_minutes_and_what_is_in_no_block_yet(
    tmp_path: Path,
) -> None:
    path = tmp_path / "h.db"
    records = [cycle_record(k, cycle_s=60.0, good=k % 100 != 7) for k in range(2 * 1440)]
    write_history(path, records)
    with sqlite3.connect(path) as other:
        (open_rows,) = other.execute("SELECT count(*) FROM thermaxis_cycle").fetchone()
    other.close()
    assert 0 < open_rows < 256
    trend = check_trend(path, records, 2 * DAY, 48)
    assert trend.step_us == 3_600_000_000
    check_trend(path, records, 2 * DAY, 1)


def test_the_same_minutes_from_two_runs_are_added_up(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    records = [cycle_record(k, cycle_s=7.0) for k in range(900)]
    for first in range(0, 900, 150):  # restarts within a minute
        write_history(path, records[first : first + 150])
    check_trend(path, records, 2 * HOUR, 120)
    with HistoryReader(url_of(path)) as reader:
        assert list(reader.cycles()) == records


@settings(max_examples=15, deadline=None)
@given(
    first=st.integers(-50, 900),
    length=st.integers(1, 900),
    points=st.integers(1, 400),
    steps=st.lists(st.sampled_from([1, 1, 1, 2, 30, -40]), min_size=20, max_size=40),
)
def test_spans_and_trends_hold_every_cycle_once_whatever_the_clock_did(
    tmp_path_factory: pytest.TempPathFactory,
    first: int,
    length: int,
    points: int,
    steps: list[int],
) -> None:
    path = tmp_path_factory.mktemp("clock") / "h.db"
    seconds, records = 0, []
    for number in range(20 * len(steps)):
        seconds += steps[number // 20] if number % 20 == 0 else 1
        records.append(cycle_record(number, utc=BEGIN + timedelta(seconds=seconds)))
    write_history(path, records)
    begin, end = BEGIN + timedelta(seconds=first), BEGIN + timedelta(seconds=first + length)
    inside = [record for record in records if begin <= record.utc < end]
    with HistoryReader(url_of(path)) as reader:
        assert list(reader.cycles(begin, end)) == inside
        trend = reader.trend(["T_spindle_C"], begin, end, points=points)["T_spindle_C"]
    expected = plain_trend(inside, begin, timedelta(microseconds=trend.step_us))
    assert steps_of(trend, begin) == {
        key: pytest.approx(numbers, rel=1e-12) for key, numbers in expected.items()
    }


def test_active_is_the_share_of_the_time_that_was_compensated(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    states = [SupervisorState.WARMING] * 15 + [SupervisorState.ACTIVE] * 45
    write_history(path, [cycle_record(k, state=state) for k, state in enumerate(states)])
    with HistoryReader(url_of(path)) as reader:
        trend = reader.trend(["active"], BEGIN, BEGIN + timedelta(minutes=1), points=1)["active"]
    assert (trend.lowest, trend.mean, trend.highest) == ((0.0,), (0.75,), (1.0,))


def test_a_series_that_is_not_there_is_named_with_the_nearest_one(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    write_history(path, [cycle_record(0)])
    with HistoryReader(url_of(path)) as reader:
        with pytest.raises(DataError, match=r"no 'T_spindel_C'.*T_spindle_C"):
            reader.trend(["T_spindel_C"], BEGIN, BEGIN + HOUR)
        with pytest.raises(DataError, match="span"):
            reader.trend(["T_spindle_C"], BEGIN, BEGIN)
        assert reader.series()["Z_um.correction"] == "um"
        assert reader.series()["Z_um.weight"] == "1"
        assert "active" in reader.series()


def test_answers_stay_with_the_cycle_that_gave_them(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    request = Request(RequestKind.TRIM, who="Anna", output="Z_um", value=2.5, duration_s=60.0)
    answer = Answer(request, True, AnswerCode.TRIM_REPLACED, {"who": "Jana"})
    records = [cycle_record(k) for k in range(300)]
    answered = records[9].output._replace(answers=(answer,))
    records[9] = CycleRecord(
        9, records[9].utc, 1009.0, records[9].samples, answered, {}, 0.0, (), (), None
    )
    write_history(path, records)
    with HistoryReader(url_of(path)) as reader:
        assert list(reader.cycles()) == records


def test_events_come_in_their_order_by_time_and_kind(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    url = parse_url(url_of(path))
    store = open_store(url, "run", check_s=1.0, utc=BEGIN, watch=FileWatch())
    backlog, packer = Backlog(10**6), RowPacker()
    events = [
        event_record(f"{k}", kind=("state", "request")[k % 2], utc=BEGIN + k * HOUR)
        for k in (0, 1, 2, 5, 3, 4)
    ]
    for event in events:
        backlog.add_event(pack_event(event))
    store.write(backlog.take(100), packer)
    store.close()
    with HistoryReader(url_of(path)) as reader:
        assert reader.events() == events
        assert reader.events(BEGIN + HOUR, BEGIN + 4 * HOUR) == [events[k] for k in (1, 2, 4)]
        assert reader.events(kinds=["request"]) == [events[k] for k in (1, 3, 4)]
        assert reader.events(kinds=["request", "state"], newest=2) == events[-2:]
        assert reader.span() is None
        assert list(reader.cycles()) == []


# ---- retention ----------------------------------------------------------------------------------


def write_days(path: Path, days: Sequence[int], *, retention_days: int) -> list[CycleRecord]:
    """Write one run on each day, a record every five minutes, and delete what is too old."""
    written: list[CycleRecord] = []
    for day in days:
        begin = BEGIN.replace(hour=0) + day * DAY
        records = [cycle_record(k, cycle_s=300.0, begin=begin) for k in range(288)]
        write_history(path, records)
        written += records
    store = open_store(parse_url(url_of(path)), "tidy", check_s=1.0, utc=BEGIN, watch=FileWatch())
    while store.close_block():
        pass
    pieces = 0
    while store.retire(retention_days):
        pieces += 1
    store.close()
    assert pieces >= len(set(days)) - retention_days
    return written


def minutes_in(path: Path) -> set[int]:
    with sqlite3.connect(path) as other:
        rows = other.execute("SELECT DISTINCT minute FROM thermaxis_trend").fetchall()
    other.close()
    return {int(row[0]) for row in rows}


def test_the_newest_days_are_kept_and_nothing_of_older_ones(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    written = write_days(path, range(8), retention_days=3)
    kept = [record for record in written if record.utc >= BEGIN.replace(hour=0) + 5 * DAY]
    with HistoryReader(url_of(path)) as reader:
        assert list(reader.cycles()) == kept
    first_minute = to_us(kept[0].utc) // 60_000_000
    assert min(minutes_in(path)) == first_minute
    assert len(minutes_in(path)) == len(kept)


def test_days_without_a_record_count_for_nothing(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    written = write_days(path, [0, 200, 500], retention_days=3)
    with HistoryReader(url_of(path)) as reader:
        assert list(reader.cycles()) == written


def test_a_clock_that_is_wrong_for_a_while_deletes_no_more_than_a_day(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    years = 365 * 60  # a clock in 2086 for a day, then right again
    written = write_days(path, [0, 1, 2, years, 3, 4], retention_days=5)
    with HistoryReader(url_of(path)) as reader:
        assert list(reader.cycles()) == written[288:]


def test_a_day_that_came_twice_keeps_its_trend_with_its_later_cycles(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    written = write_days(path, [0, 1, 0, 2], retention_days=2)
    with HistoryReader(url_of(path)) as reader:
        kept = list(reader.cycles())
    assert kept
    assert kept == written[-len(kept) :]
    assert {to_us(record.utc) // 60_000_000 for record in kept} <= minutes_in(path)


def test_events_go_with_the_cycles_that_they_stood_among(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    url = parse_url(url_of(path))
    for day in range(4):
        packer, backlog = RowPacker(), Backlog(10**8)
        begin = BEGIN.replace(hour=0) + day * DAY
        backlog.add_event(pack_event(event_record(f"morning {day}", utc=begin)))
        for k in range(288):
            backlog.add_cycle(packer.pack(cycle_record(k, cycle_s=300.0, begin=begin)))
        backlog.add_event(pack_event(event_record(f"evening {day}", utc=begin)))
        store = open_store(url, f"day {day}", check_s=1.0, utc=begin, watch=FileWatch())
        store.write(backlog.take(1000), packer)
        while store.close_block():
            pass
        store.close()
    store = open_store(url, "tidy", check_s=1.0, utc=BEGIN, watch=FileWatch())
    while store.close_block():
        pass
    while store.retire(2):
        pass
    store.close()
    with HistoryReader(url_of(path)) as reader:
        texts = [event.text for event in reader.events()]
    assert texts == ["evening 1", "morning 2", "evening 2", "morning 3", "evening 3"]
