"""Spans, events and trends of a history, beside numbers that were worked out another way."""

import sqlite3
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from tests.unit.runtime.history_records import (
    BEGIN,
    OUTPUTS,
    cycle_record,
    event_record,
    url_of,
    write_history,
)
from thermaxis.compensation import Answer, AnswerCode, Request, RequestKind, SupervisorState
from thermaxis.errors import DataError
from thermaxis.runtime import CycleRecord, EventRecord
from thermaxis.runtime.history import (
    Columns,
    HistorianSettings,
    HistoryReader,
    Trend,
)
from thermaxis.runtime.history._columns import to_us
from thermaxis.runtime.history._parts import days_of, join_parts, note_shipped, parts_of

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


def stored(records: Sequence[CycleRecord]) -> list[dict[str, object]]:
    """Return what is to come back of records, without their ids."""
    columns = Columns()
    columns.outputs = OUTPUTS
    return [columns.row_of(record).values() for record in records]


def whole(
    reader: HistoryReader, first: datetime | None = None, last: datetime | None = None
) -> list[dict[str, object]]:
    return reader.cycles(first, last).drop("id").collect().to_dicts()


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
    records = [cycle_record(k, cycle_s=4.0, good=k % 100 != 7) for k in range(900)]
    write_history(path, records)
    trend = check_trend(path, records, HOUR, 100)
    assert trend.step_us == 36_000_000


def test_a_trend_of_days_is_made_from_the_minutes_of_files_and_rows(
    tmp_path: Path,
) -> None:
    path = tmp_path / "h.db"
    records = [cycle_record(k, cycle_s=60.0, good=k % 100 != 7) for k in range(300)]
    write_history(path, records)
    with sqlite3.connect(path) as other:
        (open_rows,) = other.execute("SELECT count(*) FROM cycles").fetchone()
    other.close()
    assert open_rows == 60  # of the last hour; the others are in files
    trend = check_trend(path, records, 5 * HOUR, 5)
    assert trend.step_us == 3_600_000_000
    check_trend(path, records, 5 * HOUR, 1)


def test_the_same_minutes_from_two_runs_are_added_up(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    records = [cycle_record(k, cycle_s=7.0) for k in range(900)]
    for first in range(0, 900, 150):  # restarts within a minute
        write_history(path, records[first : first + 150])
    check_trend(path, records, 2 * HOUR, 120)
    with HistoryReader(url_of(path)) as reader:
        assert whole(reader) == stored(records)


@settings(max_examples=2, deadline=None)
@given(
    first=st.integers(-50, 900),
    length=st.integers(1, 900),
    points=st.integers(1, 400),
    steps=st.lists(st.sampled_from([1, 1, 1, 2, 30, -40, 3600, -4000]), min_size=10, max_size=20),
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
        assert whole(reader, begin, end) == stored(inside)
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
        assert {"Z_correction_um", "Z_weight", "active"} <= set(reader.series())
        assert not {"number", "state", "T_spindle_C_status"} & set(reader.series())


def test_answers_are_codes_of_the_cycle_that_gave_them(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    request = Request(RequestKind.TRIM, who="Anna", output="Z_um", value=2.5, duration_s=60.0)
    answer = Answer(request, True, AnswerCode.TRIM_REPLACED, {"who": "Jana"})
    records = [cycle_record(k) for k in range(300)]
    output = records[9].output._replace(answers=(answer,))
    records[9] = replace(records[9], output=output)
    write_history(path, records)
    with HistoryReader(url_of(path)) as reader:
        answers = reader.cycles(columns=["answers"]).collect()["answers"].to_list()
    assert answers == [None] * 9 + ["trim:trim_replaced"] + [None] * 290


def test_events_come_in_their_order_by_time_and_kind(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    events = [
        event_record(f"{k}", kind=("state", "request")[k % 2], utc=BEGIN + k * HOUR)
        for k in (0, 1, 2, 5, 3, 4)
    ]
    write_history(path, [], events)
    with HistoryReader(url_of(path)) as reader:
        assert reader.events() == events
        assert reader.events(BEGIN + HOUR, BEGIN + 4 * HOUR) == [events[k] for k in (1, 2, 4)]
        assert reader.events(kinds=["request"]) == [events[k] for k in (1, 3, 4)]
        assert reader.events(kinds=["request", "state"], newest=2) == events[-2:]
        assert reader.span() is None
        assert reader.cycles().collect().is_empty()


# ---- parts --------------------------------------------------------------------------------------


def test_another_model_begins_a_part_and_a_day_is_one_file_with_all_columns(
    tmp_path: Path,
) -> None:
    path = tmp_path / "h.db"
    first = [cycle_record(k, cycle_s=60.0) for k in range(30)]
    parts = (("spindle", "hall"), ("spindle",))
    second = [replace(cycle_record(k, cycle_s=60.0), parts=parts) for k in range(30, 90)]
    write_history(path, first + second)
    (day,) = days_of(tmp_path / "h" / "machine=machine").values()
    assert [(part.first, part.last) for part in parts_of(day)] == [(1, 30), (31, 60)]
    with sqlite3.connect(path) as other:
        named = {row[1] for row in other.execute("PRAGMA table_info(cycles)")}
    other.close()
    assert "Z_part_hall_um" in named
    assert "Z_part_table_um" not in named
    write_history(path, [cycle_record(k, cycle_s=60.0) for k in range(1440, 1510)])
    assert [(part.first, part.last) for part in parts_of(day)] == [(1, 90)]
    with HistoryReader(url_of(path)) as reader:
        found = reader.cycles(columns=["number", "Z_part_table_um", "Z_part_hall_um"]).collect()
    assert found["number"].to_list() == [*range(90), *range(1440, 1510)]
    assert found["Z_part_table_um"].is_null().to_list() == [False] * 30 + [True] * 60 + [False] * 70
    assert found["Z_part_hall_um"].is_null().sum() == 100


def test_a_history_whose_folder_is_gone_says_so_and_shows_no_gap(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    write_history(path, [cycle_record(k, cycle_s=60.0) for k in range(90)])
    (tmp_path / "h").rename(tmp_path / "elsewhere")
    with HistoryReader(url_of(path)) as reader:
        for asked in (reader.cycles, reader.span, reader.series):
            with pytest.raises(DataError) as caught:
                asked()
            assert caught.value.code == "history_folder_lost"


def test_a_day_that_is_joined_while_somebody_reads_is_read_again(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    records = [cycle_record(k, cycle_s=60.0) for k in range(200)]
    write_history(path, records)
    (day,) = days_of(tmp_path / "h" / "machine=machine").values()
    with HistoryReader(url_of(path)) as reader:
        asked: list[int] = []

        def question() -> list[int]:
            cycles = reader.cycles(columns=["number"])
            if not asked:
                join_parts(parts_of(day))
            asked.append(1)
            return cycles.collect()["number"].to_list()

        assert reader.retried(question) == list(range(200))
    assert len(asked) == 2


# ---- retention ----------------------------------------------------------------------------------


def write_days(path: Path, days: Sequence[int], *, retention_days: int) -> list[CycleRecord]:
    """Write one run on each day, with four cycles, the last an hour later, and an event."""
    written: list[CycleRecord] = []
    for day in days:
        begin = BEGIN.replace(hour=0) + day * DAY
        records = [cycle_record(k, cycle_s=1200.0, begin=begin) for k in range(4)]
        write_history(path, records, [event_record(f"evening {day}", utc=begin)])
        written += records
    settings = HistorianSettings(retention_days=retention_days)
    write_history(path, [], settings=settings)
    return written


def numbers_and_times(path: Path) -> list[tuple[datetime, int]]:
    with HistoryReader(url_of(path)) as reader:
        found = reader.cycles(columns=["number"]).collect()
    return list(zip(found["time_utc"].to_list(), found["number"].to_list(), strict=True))


def expected(records: Sequence[CycleRecord]) -> list[tuple[datetime, int]]:
    return [(record.utc, record.number) for record in records]


def test_the_newest_days_are_kept_with_their_events_and_nothing_of_older_ones(
    tmp_path: Path,
) -> None:
    path = tmp_path / "h.db"
    written = write_days(path, range(4), retention_days=2)
    kept = [record for record in written if record.utc >= BEGIN.replace(hour=0) + 2 * DAY]
    assert numbers_and_times(path) == expected(kept)
    assert len(days_of(tmp_path / "h" / "machine=machine")) == 2
    with HistoryReader(url_of(path)) as reader:
        assert [event.text for event in reader.events()] == [f"evening {k}" for k in (1, 2, 3)]


@pytest.mark.proof
def test_a_day_that_no_lake_has_confirmed_stays_up_to_twice_the_retention_and_that_is_said(
    tmp_path: Path,
) -> None:
    path = tmp_path / "h.db"
    write_days(path, range(8), retention_days=90)
    folder = tmp_path / "h" / "machine=machine"
    every = sorted(days_of(folder).values())
    note_shipped([part for k in (0, 2) for part in parts_of(every[k])])

    def left(retention_days: int) -> tuple[list[int], list[EventRecord]]:
        for _ in range(2):  # said once; the second time nothing is new
            write_history(path, [], settings=HistorianSettings(retention_days=retention_days))
        with HistoryReader(url_of(path)) as reader:
            return [k for k in range(8) if every[k].exists()], reader.events()

    days, events = left(3)
    assert days == [1, 3, 4, 5, 6, 7]
    evenings = [event.text for event in events if event.text.startswith("evening")]
    assert "evening 2" in evenings  # that of a day says where its first cycle is
    assert "evening 4" in evenings
    assert [event.code for event in events][-1] == "event-unshipped_kept"
    days, events = left(2)
    assert days == [4, 5, 6, 7]
    (said,) = [event for event in events if event.code == "event-unshipped_deleted"]
    assert said.values == {"detail": f"{every[1].name}, {every[3].name}"}
    note_shipped([part for path in every if path.exists() for part in parts_of(path)])
    assert left(2)[0] == [6, 7]


def test_days_without_a_record_count_for_nothing(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    written = write_days(path, [0, 200, 500], retention_days=3)
    assert numbers_and_times(path) == expected(written)


@pytest.mark.proof
def test_a_clock_that_is_wrong_for_a_while_deletes_no_more_than_a_day(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    years = 365 * 60  # a clock in 2086 for a day, then right again
    written = write_days(path, [0, 1, 2, years, 3, 4], retention_days=5)
    assert numbers_and_times(path) == expected(written[4:])


@pytest.mark.proof
def test_a_day_that_came_twice_counts_as_one_and_is_read_in_the_order_of_recording(
    tmp_path: Path,
) -> None:
    path = tmp_path / "h.db"
    written = write_days(path, [0, 1, 0, 2], retention_days=3)
    assert numbers_and_times(path) == expected(written)
