"""The history as the screen asks it: one thread, a limit, and numbers worked out another way."""

import asyncio
import math
import threading
from collections.abc import Awaitable, Sequence
from contextlib import nullcontext
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from hypothesis import given, strategies as st

from tests.scenes import scene
from tests.unit.runtime.history_records import (
    BEGIN,
    CHANNELS,
    cycle_record,
    temperature_c,
    url_of,
    write_history,
)
from thermaxis.codes import Message, Place
from thermaxis.compensation import SupervisorState
from thermaxis.errors import DataError, ThermaxisError
from thermaxis.messages import sentence, sentence_of
from thermaxis.runtime import EventRecord, VirtualClock, run_in_virtual_time
from thermaxis.runtime.history import HistoryReader, Trend
from thermaxis.screen.pages.history import (
    Kept,
    NoHistoryError,
    line_of,
    points_within,
    shortened,
    span_of,
    to_ms,
)
from thermaxis.screen.pages.history._events import events_of, names_now, trend8
from thermaxis.screen.pages.history._rows import History, cause_for_people
from thermaxis.screen.pages.history._series import lines_of, moment_of
from thermaxis.web import RefusedError

HOUR = timedelta(hours=1)


async def begun(*questions: Awaitable[Any]) -> list[asyncio.Future[Any]]:
    """Ask, and let the questions come as far as they can."""
    tasks = [asyncio.ensure_future(question) for question in questions]
    for _ in range(5):
        await asyncio.sleep(0)
    return tasks


# ---- asking -------------------------------------------------------------------------------------


@scene
async def test_a_history_that_is_not_there_is_said_in_words_and_found_once_it_is(
    tmp_path: Path,
) -> None:
    path = tmp_path / "h.db"

    history = History(url_of(path))
    for _ in range(2):
        with pytest.raises(NoHistoryError) as refused:
            await history.ask(lambda reader: reader.span())
        assert refused.value.message.code == "history-unreadable"
        assert "no such file" in sentence_of(refused.value.message)
    await asyncio.to_thread(write_history, path, [cycle_record(k) for k in range(3)])
    found = await history.ask(lambda reader: reader.span())
    assert found == (BEGIN, BEGIN + timedelta(seconds=2))
    await history.close()


@scene
async def test_another_file_in_its_place_is_read_from_then_on(tmp_path: Path) -> None:
    path, aside = tmp_path / "h.db", tmp_path / "aside.db"
    write_history(path, [cycle_record(k) for k in range(3)])

    history = History(url_of(path))
    before = await history.ask(lambda reader: reader.span())
    path.rename(aside)
    later = BEGIN + timedelta(days=1)
    await asyncio.to_thread(write_history, path, [cycle_record(k, begin=later) for k in range(3)])
    after = await history.ask(lambda reader: reader.span())
    await history.close()
    assert before is not None
    assert after is not None
    assert after[0] - before[0] == timedelta(days=1)


class OneReader:
    """Stands for a reader; counts how often it was opened and closed."""

    def __init__(self) -> None:
        self.opened = 0
        self.closed = 0
        self.interrupted = 0
        self.in_place = True

    def __call__(self, url: str, password: str) -> HistoryReader:
        self.opened += 1
        return cast("HistoryReader", self)

    def close(self) -> None:
        self.closed += 1

    def interrupt(self) -> None:
        self.interrupted += 1


@scene
async def test_a_hanging_database_is_bounded_and_the_next_questions_say_so_at_once() -> None:
    release = threading.Event()
    asked: list[str] = []

    def hang(_: HistoryReader) -> str:
        asked.append("hang")
        release.wait(50.0)
        return "late"

    def quick(_: HistoryReader) -> str:
        asked.append("quick")
        return "quick"

    history = History("sqlite:///x", limit_s=0.1, opened=OneReader())
    with pytest.raises(NoHistoryError) as refused:
        await history.ask(hang)
    assert refused.value.message.code == "history-hangs"
    assert refused.value.message.values == {"limit": 0.1}
    worker = history._worker
    history._limit_s = worker._limit_s = (
        600.0  # whoever waited now would not come back in this test
    )
    worker._since_s = -1e9
    for _ in range(100):
        with pytest.raises(NoHistoryError):
            await history.ask(quick)
    release.set()
    while worker.hangs:
        await asyncio.sleep(0)
    assert await history.ask(quick) == "quick"
    assert asked == ["hang", "quick"]  # what was refused was never asked
    await history.close()


@scene
async def test_a_question_that_is_given_up_ends_in_the_database_too(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    write_history(path, [cycle_record(k) for k in range(10)])
    endless = (
        "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT count(*) FROM n"
    )

    def ask_for_ever(reader: HistoryReader) -> None:
        with reader._asked() as connection:
            connection.exec_driver_sql(endless).all()

    history = History(url_of(path), limit_s=50.0)
    assert await history.ask(lambda reader: len(reader.series())) > 0
    history._limit_s = 0.3  # for the one question that has no end, in a real thread
    with pytest.raises(NoHistoryError) as refused:
        await history.ask(ask_for_ever)
    assert refused.value.message.code == "history-hangs"
    history._limit_s = 50.0
    assert await history.ask(lambda reader: len(reader.series())) > 0
    await history.close()


@scene
async def test_a_question_that_was_answered_is_not_interrupted_nor_is_the_next_one() -> None:
    reader = OneReader()
    release = threading.Event()

    history = History("sqlite:///x", limit_s=5.0, opened=reader)
    first, waits = await begun(
        history.ask(lambda _: release.wait(10.0)), history.ask(lambda _: None)
    )
    waits.cancel()  # it is not the one that is being asked
    await begun()
    release.set()
    assert await first
    await history.ask(lambda _: None)
    await history.close()

    assert (reader.interrupted, reader.opened) == (0, 1)


def test_one_visitor_has_one_question_asked_and_a_few_waiting_and_keeps_nobody_out() -> None:
    release = threading.Event()
    running: list[str] = []

    async def play() -> list[object]:
        history = History("sqlite:///x", limit_s=5.0, opened=OneReader())

        def asks(name: str) -> bool:
            running.append(name)
            return release.wait(10.0)

        many = await begun(*(history.ask(lambda _: asks("one"), who="one") for _ in range(20)))
        (other,) = await begun(history.ask(lambda _: asks("other"), who="other"))
        assert set(history._turns) == {"one", "other"}
        release.set()
        found = await asyncio.gather(*many, return_exceptions=True)
        assert await other
        assert history._turns == {}
        await history.close()
        return found

    found = asyncio.run(play())
    refused = [one for one in found if isinstance(one, NoHistoryError)]
    assert (len(refused), {one.message.code for one in refused}) == (12, {"history-busy"})
    assert running[1] == "other"  # before the others of the first


@scene
async def test_a_question_that_nobody_waits_for_any_more_is_not_asked() -> None:
    release = threading.Event()
    asked: list[int] = []

    history = History("sqlite:///x", limit_s=5.0, opened=OneReader())
    first, given_up = await begun(
        history.ask(lambda _: release.wait(10.0)), history.ask(lambda _: asked.append(1))
    )
    given_up.cancel()
    last = asyncio.ensure_future(history.ask(lambda _: asked.append(2)))
    await asyncio.sleep(0)
    release.set()
    await asyncio.gather(first, last)
    assert given_up.cancelled()
    await history.close()

    assert asked == [2]


def test_no_more_than_a_few_questions_wait() -> None:
    release = threading.Event()

    async def play() -> tuple[int, int]:
        history = History("sqlite:///x", limit_s=5.0, opened=OneReader())
        tasks = await begun(
            history.ask(lambda _: release.wait(10.0)),
            *(history.ask(lambda _: True, who=f"{k}") for k in range(60)),
        )
        release.set()
        found = await asyncio.gather(*tasks, return_exceptions=True)
        await history.close()
        refused = [one for one in found if isinstance(one, NoHistoryError)]
        assert {one.message.code for one in refused} == {"history-busy"}
        return len(refused), sum(one is True for one in found)

    refused, answered = asyncio.run(play())
    assert refused + answered == 61
    assert 24 <= answered <= 26


@scene
async def test_an_error_closes_the_reader_and_the_next_question_opens_another() -> None:
    reader = OneReader()

    def damaged(_: HistoryReader) -> None:
        raise DataError("block_damaged")

    history = History("sqlite:///x", opened=reader)
    await history.ask(lambda _: None)
    with pytest.raises(NoHistoryError) as refused:
        await history.ask(damaged)
    assert "damaged" in sentence_of(refused.value.message)
    assert (reader.opened, reader.closed) == (1, 1)
    await history.ask(lambda _: None)
    await history.close()
    assert (reader.opened, reader.closed) == (2, 2)
    with pytest.raises(NoHistoryError):
        await history.ask(lambda _: None)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@scene
async def test_a_fault_of_the_program_ends_one_question_and_not_the_next() -> None:
    history = History("sqlite:///x", opened=OneReader())
    with pytest.raises(NoHistoryError):
        await history.ask(lambda _: 1 // 0)
    for thread in threading.enumerate():
        if thread.name == "worker":
            thread.join()  # what it says of its end belongs to this test
    assert await history.ask(lambda _: "well") == "well"
    await history.close()


# ---- one answer for all -------------------------------------------------------------------------


def test_one_question_answers_everybody_for_a_while() -> None:
    asked: list[float] = []

    async def play() -> None:
        clock = VirtualClock()

        async def make() -> int:
            asked.append(clock.monotonic_s())
            await asyncio.sleep(2.0)
            return len(asked)

        kept = Kept(make, clock, 15.0)
        leaver = asyncio.ensure_future(kept.get())
        found = asyncio.gather(*(kept.get() for _ in range(50)))
        await asyncio.sleep(0.5)
        leaver.cancel()  # who leaves takes the answer from nobody
        found = await found
        assert set(found) == {1}
        await asyncio.sleep(12.9)
        assert await kept.get() == 1
        await asyncio.sleep(0.2)
        assert await kept.get() == 2

    run_in_virtual_time(play())
    assert asked[1] - asked[0] == pytest.approx(15.1)


# ---- lines --------------------------------------------------------------------------------------


def trend_of(times_s: Sequence[float], step_s: float) -> Trend:
    times = tuple(round(t * 1e6) for t in times_s)
    values = tuple(float(k) for k in range(len(times)))
    return Trend("Z_correction_um", round(step_s * 1e6), times, values, values, values)


def last_of(seconds: float) -> datetime:
    return datetime(1970, 1, 1, tzinfo=UTC) + timedelta(seconds=seconds)


def test_a_step_without_values_is_a_gap_in_the_line() -> None:
    line = line_of(trend_of([0, 60, 120, 240, 300], 60.0), last_of(360), 1.0)
    assert line["mean"] == [0.0, 1.0, 2.0, None, 3.0, 4.0]
    assert line["t"] == [30_000, 90_000, 150_000, 210_000, 270_000, 330_000]


def test_a_line_is_joined_as_far_as_no_value_is_missing_and_ends_with_the_span() -> None:
    line = line_of(trend_of([0, 10, 20, 30, 60, 70], 3.0), last_of(80), 1.0)  # seldom values
    assert line["mean"] == [0.0, 1.0, 2.0, 3.0, None, 4.0, 5.0]
    line = line_of(trend_of([0, 1.02, 1.99, 4.0, 5.0], 0.001), last_of(6), 1.0)  # single cycles
    assert line["mean"] == [0.0, 1.0, 2.0, None, 3.0, 4.0]
    line = line_of(trend_of([0, 60], 60.0), last_of(70), 1.0)
    assert line["t"] == [30_000, 70_000]


@given(
    seconds=st.integers(1, 10_000_000), cycle_s=st.floats(0.1, 60.0), points=st.integers(50, 4000)
)
def test_a_step_is_no_shorter_than_two_cycles_unless_each_cycle_has_its_own(
    seconds: int, cycle_s: float, points: int
) -> None:
    last = BEGIN + timedelta(seconds=seconds)
    steps = points_within(BEGIN, last, cycle_s, points)
    assert steps >= 1
    if seconds / cycle_s <= min(points, 600):
        assert seconds / steps <= 0.0011
    else:
        assert steps <= points
        assert seconds / steps >= 2.0 * cycle_s * (1.0 - 1e-9) or steps == 1


def test_lines_hold_the_mean_and_the_band_of_what_was_recorded(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    records = [cycle_record(k) for k in range(1800) if not 600 <= k < 750]
    write_history(path, records)
    with HistoryReader(url_of(path)) as reader:
        span = BEGIN, BEGIN + HOUR / 2
        found = lines_of(reader, ["Z_correction_um", "T_spindle_C", "gone"], span, 1.0, 180)
    assert list(found) == ["Z_correction_um", "T_spindle_C"]
    line = found["Z_correction_um"]
    assert (line["unit"], found["T_spindle_C"]["unit"], line["step_s"]) == ("µm", "°C", 10.0)
    assert line["mean"].count(None) == 1
    gap = line["mean"].index(None)
    assert line["t"][gap - 1] < to_ms(BEGIN) + 600_000 < line["t"][gap + 1]
    for k, t in enumerate(line["t"]):
        begin = t - 5000
        values = [
            r.output.correction_um[0] for r in records if begin <= to_ms(r.utc) < begin + 10_000
        ]
        if k != gap:
            assert line["mean"][k] == pytest.approx(sum(values) / len(values), rel=1e-6)
            assert line["lowest"][k] == pytest.approx(min(values), rel=1e-6)
            assert line["highest"][k] == pytest.approx(max(values), rel=1e-6)


def test_numbers_keep_what_a_chart_can_show() -> None:
    assert shortened(1.23456789) == 1.234568
    assert shortened(0.000123456789) == 0.0001234568
    assert shortened(math.nan) is None
    assert shortened(None) is None


# ---- times --------------------------------------------------------------------------------------


def test_a_time_needs_a_zone_and_is_the_same_in_every_one() -> None:
    for text in ("", None, "2026-11-03T06:00", "1899-01-01T00:00Z", "9999-12-31T23:59Z"):
        assert moment_of(text) is None
    assert moment_of("2026-10-25T02:30:00+02:00") == moment_of("2026-10-25T00:30:00.000Z")
    assert to_ms(datetime(2026, 10, 25, 0, 30, tzinfo=UTC)) == 1_792_888_200_000
    for days, allowed in ((3660, True), (3661, False), (0, False)):
        asked = {"first": BEGIN.isoformat(), "last": (BEGIN + timedelta(days=days)).isoformat()}
        connection = cast("Any", SimpleNamespace(query_params=asked))
        with nullcontext() if allowed else pytest.raises(RefusedError, match="history-no_span"):
            span_of(connection)


# ---- events -------------------------------------------------------------------------------------


def state_event(utc: datetime, *reasons: str) -> EventRecord:
    values = {"state": "Holding", "reasons": reasons}
    return EventRecord.of(utc, "state", "", Message("event-state_reasons", values))


def test_only_the_newest_events_are_given_and_it_is_said_that_there_are_more(
    tmp_path: Path,
) -> None:
    path = tmp_path / "h.db"
    events = [state_event(BEGIN + timedelta(seconds=k), str(k)) for k in range(12)]
    write_history(path, [cycle_record(0)], events)
    span = BEGIN, BEGIN + HOUR
    with HistoryReader(url_of(path)) as reader:
        some, more = events_of(reader, span, newest=5)
        whole, none = events_of(reader, span, ["state"], newest=12)
    assert ([one.values["reasons"] for one in some], more) == (
        [(str(k),) for k in range(7, 12)],
        True,
    )
    assert (len(whole), none) == (12, False)


# ---- the operator's trend -----------------------------------------------------------------------


def test_the_trend_of_eight_hours_has_corrections_temperatures_and_marks(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    records = [cycle_record(k, cycle_s=10.0, state=SupervisorState.ACTIVE) for k in range(9 * 360)]
    now = BEGIN + timedelta(hours=9)
    events = [
        EventRecord(BEGIN, "state", "", "Warming"),  # nine hours ago
        EventRecord(now - HOUR, "connection", "", "the connection is lost"),
        EventRecord(now - HOUR, "alarm", "", "high: broken."),
    ]
    write_history(path, records, events)
    with HistoryReader(url_of(path)) as reader:
        found = trend8(reader, now, 10.0, ["Z_accepted_um", *CHANNELS, "T_new_C"])
    assert found["last"] - found["first"] == 8 * 3_600_000
    assert list(found["series"]) == ["Z_accepted_um", *CHANNELS]
    line = found["series"]["Z_accepted_um"]
    assert len(line["t"]) == 480
    assert None not in line["mean"]
    at = line["t"].index(to_ms(BEGIN + timedelta(hours=2, seconds=30)))
    minute = [records[k].applied["Z_um"].accepted_um or 0.0 for k in range(720, 726)]
    assert line["mean"][at] == pytest.approx(sum(minute) / 6.0, rel=1e-6)
    assert [one.kind for one in found["events"]] == ["alarm"]
    assert names_now({"outputs": {"Z_um": {}}}, "outputs", ("X_um",)) == ("Z_um",)
    assert names_now({"outputs": None}, "outputs", ("X_um",)) == ("X_um",)  # it is silent


def test_the_trend_of_a_machine_that_was_just_started_begins_with_it_in_fine_steps(
    tmp_path: Path,
) -> None:
    path = tmp_path / "h.db"
    write_history(path, [cycle_record(k, state=SupervisorState.ACTIVE) for k in range(600)])
    now = BEGIN + timedelta(seconds=600)
    with HistoryReader(url_of(path)) as reader:
        found = trend8(reader, now, 1.0, ["Z_accepted_um"])
        empty = trend8(reader, now + timedelta(days=2), 1.0, ["Z_accepted_um"])
    assert 0 <= to_ms(BEGIN) - found["first"] <= 60_000
    times = found["series"]["Z_accepted_um"]["t"]
    assert len(times) > 250
    assert times[0] - to_ms(BEGIN) < 3000
    assert empty["last"] - empty["first"] == 300_000


def test_of_times_that_a_clock_set_back_wrote_twice_the_trend_shows_both_together(
    tmp_path: Path,
) -> None:
    path = tmp_path / "h.db"
    shown_s = [float(k if k < 600 else k - 300) for k in range(1200)]
    records = [
        cycle_record(k, utc=BEGIN + timedelta(seconds=at_s)) for k, at_s in enumerate(shown_s)
    ]
    write_history(path, records, [])
    with HistoryReader(url_of(path)) as reader:
        found = trend8(reader, BEGIN + timedelta(seconds=900), 1.0, ["T_spindle_C"])
    line = found["series"]["T_spindle_C"]
    times = [(t - to_ms(BEGIN)) / 1000.0 for t in line["t"]]
    assert times == sorted(set(times))
    step_s = line["step_s"]
    for at_s, mean, lowest, highest in zip(
        times, line["mean"], line["lowest"], line["highest"], strict=True
    ):
        of = [
            temperature_c(k)
            for k, shown in enumerate(shown_s)
            if at_s - 0.5 * step_s <= shown < at_s + 0.5 * step_s
        ]
        assert (mean, lowest, highest) == pytest.approx((sum(of) / len(of), min(of), max(of)))


# ---- what people are told -----------------------------------------------------------------------


SQLITE, SERVER = "sqlite:////srv/secret/h.db", "postgresql+psycopg://secret@10.0.0.5/history"


@pytest.mark.parametrize(
    ("error", "url", "code"),
    [
        (DataError("file_not_found", place=Place("/srv/secret/h.db")), SQLITE, "file_not_found"),
        (PermissionError(13, "Permission denied", "/srv/secret/h.db"), SQLITE, None),
        (OSError("/srv/secret/h.db: it is torn"), SQLITE, "history-fails"),
        (
            DataError("file_unreadable", cause='connection to "10.0.0.5" failed: user "secret"'),
            SERVER,
            "history-no_database",
        ),
        (OSError("10.0.0.5 refused secret"), SERVER, "history-no_database"),
    ],
)
def test_why_a_history_cannot_be_read_says_neither_folder_nor_host_nor_user(
    error: ThermaxisError | OSError, url: str, code: str | None
) -> None:
    cause = cause_for_people(error, url)
    assert code is None or (isinstance(cause, Message) and cause.code.endswith(code))
    said = sentence("history-unreadable", {"why": cause})
    assert not any(word in said for word in ("secret", "/srv", "10.0.0.5"))


def test_a_question_between_statements_ends_at_the_next_and_a_server_is_told(
    tmp_path: Path,
) -> None:
    path = tmp_path / "h.db"
    write_history(path, [cycle_record(k) for k in range(10)])
    told: list[str] = []
    with HistoryReader(url_of(path)) as reader:
        reader._bare = SimpleNamespace(cancel=lambda: told.append("cancel"))
        reader.interrupt()
        with pytest.raises(DataError, match="interrupted"):
            reader.cycles()
    assert told == ["cancel"]
