"""Whatever fails, every record is stored once or counted as lost, and the loop never waits."""

import asyncio
import os
import signal
import sqlite3
import threading
import time
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from itertools import count
from pathlib import Path

import pytest
import sqlalchemy as sa
from hypothesis import HealthCheck, example, given, settings, strategies as st
from sqlalchemy.exc import OperationalError

from tests.scenes import scene
from tests.unit.runtime.history_records import (
    BEGIN,
    OUTPUTS,
    CountingClock,
    cycle_record,
    drained,
    event_record,
    threadless,
    url_of,
)
from thermaxis.codes import Message
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.runtime.history import (
    Columns,
    HistorianSettings,
    HistoryReader,
    SqlHistorian,
    _closing,
    _database,
    _historian,
    _store,
    check_url,
)
from thermaxis.runtime.history._closing import Order
from thermaxis.runtime.history._columns import Item
from thermaxis.runtime.history._integrity import put_aside, writer_lock
from thermaxis.runtime.history._store import Store

QUICK = HistorianSettings(batch_s=0.005, retry_s=0.01)


class Recorder:
    """A historian without its thread: what waits is stored when the test says so."""

    def __init__(self, path: Path, largest_bytes: int = 10**7) -> None:
        self.one = threadless(path, replace(QUICK, largest_waiting_bytes=largest_bytes))
        self.attempt, self.disconnect = self.one.attempt, self.one.disconnect

    @property
    def trouble(self) -> Message | None:
        return self.one.status.failure

    def record(self, numbers: Sequence[int], cycle_s: float = 1.0) -> None:
        for number in numbers:
            self.one.record(cycle_record(number, cycle_s=cycle_s))

    def event(self, text: str) -> None:
        self.one.event(event_record(text))


def numbers_in(path: Path) -> list[int]:
    with HistoryReader(url_of(path)) as reader:
        found = reader.cycles(columns=["number"]).collect()
    return found["number"].to_list() if found.height else []


def columns() -> Columns:
    made = Columns()
    made.outputs = OUTPUTS
    return made


def whole(
    reader: HistoryReader, first: datetime | None = None, last: datetime | None = None
) -> list[dict[str, object]]:
    return reader.cycles(first, last).drop("id").collect().to_dicts()


def texts_in(path: Path, *kinds: str) -> list[str]:
    with HistoryReader(url_of(path)) as reader:
        return [event.text for event in reader.events(kinds=kinds)]


def refused(message: str = "disk I/O error") -> OperationalError:
    return OperationalError("INSERT", {}, sqlite3.OperationalError(message))


class Trouble:
    """Makes the next attempts to open or to write fail."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.mode = "well"
        monkeypatch.setattr(_historian, "Store", self.opened)

    def opened(self, *arguments: object) -> Store:
        if self.mode == "no database":
            raise OSError("no such host")
        store = Store(*arguments)
        write, closed = store.write, store.closed

        def troubled(items: Sequence[Item]) -> None:
            if self.mode == "refused":
                raise refused()
            write(items)
            if self.mode == "answer lost":  # the commit happened, and nobody said so
                raise refused("server closed the connection unexpectedly")

        def troubled_part(order: Order) -> None:
            if self.mode == "part's rows stay":  # the file is there, and nobody knows of it
                raise refused("server closed the connection unexpectedly")
            closed(order)
            if self.mode == "part's answer lost":
                raise refused("server closed the connection unexpectedly")

        store.write = troubled
        store.closed = troubled_part
        return store


# ---- the law ------------------------------------------------------------------------------------

moves = st.lists(
    st.one_of(
        st.tuples(st.just("cycles"), st.integers(1, 200)),
        st.tuples(st.just("events"), st.integers(1, 5)),
        st.tuples(st.just("attempt"), st.just("well")),
        st.tuples(
            st.just("attempt"),
            st.sampled_from(
                [
                    *("refused", "answer lost", "no database"),
                    *("part's rows stay", "part's answer lost"),
                ]
            ),
        ),
        st.tuples(st.just("restart"), st.booleans()),
    ),
    min_size=3,
    max_size=14,
)


@pytest.mark.proof
@settings(
    max_examples=8, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None
)
@given(moves=moves)
@example(moves=[("cycles", 3), ("attempt", "answer lost"), ("restart", False)])
def test_every_record_is_stored_once_or_counted_as_lost(
    tmp_path_factory: pytest.TempPathFactory,
    monkeypatch: pytest.MonkeyPatch,
    moves: list[tuple[str, object]],
) -> None:
    path = tmp_path_factory.mktemp("law") / "h.db"
    with monkeypatch.context() as patch:
        trouble = Trouble(patch)
        numbers, texts = count(), count()
        added_cycles: list[int] = []
        added_texts: list[str] = []
        lost, unsure, unanswered = 0, 0, False
        recorder = Recorder(path, 400_000)
        for move, what in [*moves, ("attempt", "well"), ("attempt", "well")]:
            if move == "cycles":
                added_cycles += (new := [next(numbers) for _ in range(int(str(what)))])
                recorder.record(new, 30.0)
            elif move == "events":
                for _ in range(int(str(what))):
                    added_texts.append(f"event {next(texts)}")
                    recorder.event(added_texts[-1])
            elif move == "attempt":
                trouble.mode = str(what)
                recorder.attempt()
                unanswered = what == "answer lost" or (
                    unanswered and what in {"refused", "no database"}
                )
            else:
                trouble.mode = "well" if what else "no database"
                recorder.attempt()
                recorder.disconnect()
                recorder.one._backlog.give_up()
                lost += recorder.one.status.lost
                unsure += unanswered * recorder.one.status.lost
                recorder, unanswered = Recorder(path, 400_000), False
        recorder.attempt()
        recorder.disconnect()
        assert recorder.one.status.waiting == 0
        lost += recorder.one.status.lost
    stored = numbers_in(path)
    texts_stored = texts_in(path, "state")
    assert stored == sorted(set(stored))  # in order, none twice
    assert set(stored) <= set(added_cycles)
    assert texts_stored == [text for text in added_texts if text in set(texts_stored)]
    twice = len(stored) + len(texts_stored) + lost - len(added_cycles) - len(added_texts)
    assert 0 <= twice <= unsure  # nobody knows that what got no answer was stored


def test_a_database_that_is_not_there_is_waited_for_and_gets_everything(tmp_path: Path) -> None:
    path = tmp_path / "disk" / "later" / "h.db"
    recorder = Recorder(path)
    recorder.record(range(5))
    assert not recorder.attempt()
    assert recorder.trouble.code == "failure-history_unwritable"
    path.parent.parent.mkdir()  # the disk is mounted; the folder is made
    assert recorder.attempt()
    assert recorder.trouble is None
    recorder.disconnect()
    assert numbers_in(path) == [0, 1, 2, 3, 4]
    assert "could not be written for" in texts_in(path, "connection")[0]
    assert recorder.one.status.lost == 0


def test_a_loss_is_told_with_its_number_and_its_span(tmp_path: Path) -> None:
    path = tmp_path / "disk" / "later" / "h.db"
    recorder = Recorder(path, 100_000)
    recorder.event("before")
    recorder.record(range(500))
    assert not recorder.attempt()
    path.parent.mkdir(parents=True)
    recorder.attempt()
    recorder.disconnect()
    stored = numbers_in(path)
    assert stored == list(range(stored[0], 500))
    with HistoryReader(url_of(path)) as reader:
        (told,) = reader.events(kinds=["loss"])
    assert told.details["cycles"] == stored[0] == recorder.one.status.lost
    assert told.details["first"] == BEGIN.isoformat()
    assert told.details["last"] == (BEGIN + timedelta(seconds=stored[0] - 1)).isoformat()
    assert texts_in(path, "state") == ["before"]  # events stay longer than cycles


def test_a_record_that_the_database_refuses_for_what_it_is_blocks_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "h.db"
    write = Store.write

    def picky(self: Store, items: Sequence[Item]) -> None:
        if any(item.utc_us == bad_us for item in items):
            raise sa.exc.DataError("INSERT", {}, sqlite3.DataError("value out of range"))
        write(self, items)

    monkeypatch.setattr(Store, "write", picky)
    recorder = Recorder(path)
    recorder.record(range(30))
    bad_us = [item.utc_us for item in recorder.one._backlog.take(30)][17]
    for _ in range(4):
        recorder.attempt()
    recorder.record(range(30, 40))
    recorder.attempt()
    recorder.disconnect()
    assert numbers_in(path) == [k for k in range(40) if k != 17]
    assert recorder.one.status.lost == 1
    with HistoryReader(url_of(path)) as reader:
        (told,) = reader.events(kinds=["loss"])
    assert "out of range" in str(told.details["unusable"])


# ---- the disk -----------------------------------------------------------------------------------


def test_a_full_disk_keeps_everything_in_memory_and_writes_it_when_there_is_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "h.db"
    engine_of = _store.writing_engine
    pages = 100

    def small(url: str, password: str) -> sa.Engine:
        engine = engine_of(url, password)

        @sa.event.listens_for(engine, "connect")
        def _(connection: sqlite3.Connection, _: object) -> None:
            connection.execute(f"PRAGMA max_page_count={pages}").close()

        return engine

    monkeypatch.setattr(_store, "writing_engine", small)
    recorder = Recorder(path)
    done = 0
    while not recorder.trouble:
        recorder.record(range(done, done + 20))
        done += 20
        recorder.attempt()
    assert recorder.trouble.code == "failure-history_unwritable"
    for _ in range(5):
        recorder.record(range(done, done + 20))
        done += 20
        assert not recorder.attempt()
    assert recorder.one.status.waiting >= 100
    assert numbers_in(path) == list(range(done - recorder.one.status.waiting))
    pages = 10_000
    recorder.attempt()
    recorder.disconnect()
    assert numbers_in(path) == list(range(done))
    assert recorder.one.status.lost == 0


def test_a_file_that_somebody_removes_is_begun_anew_with_what_was_just_written(
    tmp_path: Path,
) -> None:
    path = tmp_path / "h.db"
    recorder = Recorder(path)
    recorder.record(range(10))
    recorder.attempt()
    for part in tmp_path.iterdir():
        part.unlink()
    recorder.record(range(10, 20))
    assert not recorder.attempt()
    assert recorder.trouble.code == "failure-history_replaced"
    recorder.record(range(20, 30))
    recorder.attempt()
    recorder.disconnect()
    assert numbers_in(path) == list(range(10, 30))


def damage(path: Path, first: int = 4096) -> None:
    with path.open("r+b") as stream:
        size = stream.seek(0, os.SEEK_END)
        stream.seek(first)
        stream.write(os.urandom(size - first))


def test_a_damaged_file_is_put_aside_at_the_start_and_said(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    first = Recorder(path)
    first.record(range(1000))
    first.attempt()
    first.disconnect()
    before = path.stat().st_size
    damage(path)
    second = Recorder(path)
    second.record(range(1000, 1010))
    assert second.attempt()
    second.attempt()
    second.disconnect()
    assert numbers_in(path) == list(range(1000, 1010))
    (said,) = texts_in(path, "alarm")
    aside = tmp_path / "h.db.damaged-20261103T060000.000000Z"
    assert aside.name in said
    assert aside.stat().st_size == before


def test_a_file_that_is_damaged_while_it_is_used_is_put_aside_and_nothing_new_is_lost(
    tmp_path: Path,
) -> None:
    path = tmp_path / "h.db"
    recorder = Recorder(path)
    recorder.record(range(512))
    recorder.attempt()
    with sqlite3.connect(path, isolation_level=None) as other:
        other.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    other.close()
    damage(path)
    recorder.disconnect()
    recorder = Recorder(path)
    recorder.one._damage = ""  # as after a connection that was lost
    done = 512
    for _ in range(6):
        recorder.record(range(done, done + 100))
        done += 100
        recorder.attempt()
    recorder.disconnect()
    assert numbers_in(path) == list(range(512, done))
    assert recorder.one.status.lost == 0
    assert len(list(tmp_path.glob("h.db.damaged-*Z"))) == 1


def test_a_text_file_is_refused_and_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "machine.toml"
    path.write_text("[machine]\nname = 'lathe'\n")
    recorder = Recorder(path)
    recorder.record(range(3))
    assert not recorder.attempt()
    assert recorder.trouble.code == "error-text_no_database"
    recorder.disconnect()
    assert path.read_text().startswith("[machine]")
    assert recorder.one.status.waiting == 3


def test_a_day_that_cannot_be_joined_keeps_no_other_hour_from_its_file(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    recorder = Recorder(path)
    recorder.record(range(960, 1050), 60.0)
    recorder.attempt()
    (file,) = (tmp_path / "h").glob("*/*/cycles-*.parquet")
    file.write_bytes(b"PAR1 torn PAR1")
    recorder.record(range(1050, 1200), 60.0)  # the rest of the day, and the begin of the next
    for _ in range(3):
        recorder.attempt()
    assert recorder.trouble is None
    recorder.disconnect()
    with sqlite3.connect(path) as other:
        ((first,),) = other.execute("SELECT min(number) FROM cycles")
    other.close()
    assert first == 1140
    (said,) = texts_in(path, "alarm")
    assert "2026-11-03: " in said


def test_a_folder_that_is_away_is_not_begun_anew(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    recorder = Recorder(path)
    recorder.record(range(90), 60.0)
    recorder.attempt()
    (tmp_path / "h").rename(tmp_path / "away")
    recorder.record(range(90, 200), 60.0)
    recorder.attempt()
    recorder.attempt()
    assert not (tmp_path / "h").exists()
    assert recorder.trouble.code == "failure-part_unwritten"
    (tmp_path / "away").rename(tmp_path / "h")
    recorder.one._close_s = 0.0  # the minute is over
    recorder.attempt()
    assert recorder.trouble is None
    recorder.disconnect()
    assert numbers_in(path) == list(range(200))
    assert "is not there" in texts_in(path, "alarm")[0]


def test_a_loss_that_was_told_is_not_told_again_when_the_connection_is_lost_later(
    tmp_path: Path,
) -> None:
    path = tmp_path / "h.db"
    recorder = Recorder(path)
    recorder.one.record(None)
    recorder.attempt()
    recorder.disconnect()  # as where it is lost while house is kept
    recorder.record(range(3))
    recorder.attempt()
    recorder.disconnect()
    with HistoryReader(url_of(path)) as reader:
        assert [event.details["cycles"] for event in reader.events(kinds=["loss"])] == [1]


def test_old_days_that_cannot_be_deleted_are_told_and_keep_no_hour_from_its_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def kept(_store: Store, _days: int) -> None:
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(Store, "retire", kept)
    recorder = Recorder(tmp_path / "h.db")
    recorder.record(range(90), 60.0)
    assert recorder.attempt()
    assert recorder.attempt()
    assert recorder.trouble is None
    recorder.disconnect()
    (said,) = texts_in(tmp_path / "h.db", "alarm")
    assert "cannot be deleted" in said


def test_what_is_being_closed_ends_with_its_database_also_where_that_was_exchanged(
    tmp_path: Path,
) -> None:
    path = tmp_path / "h.db"
    recorder = Recorder(path)
    recorder.record(range(90), 60.0)
    recorder.one._beside = True
    recorder.attempt()
    closing = recorder.one._closer
    assert closing is not None
    with sqlite3.connect(path) as other:  # as in a database that was restored
        (made,) = other.execute("SELECT sql FROM sqlite_master WHERE name = 'events'").fetchone()
        other.execute("DROP TABLE events")
    other.close()
    recorder.record(range(90, 100), 60.0)
    recorder.event("into a table that is gone")
    assert not recorder.attempt()
    assert closing.ended()
    assert recorder.one._closer is None
    recorder.one._beside = False
    with sqlite3.connect(path) as other:
        other.execute(made)
    other.close()
    assert recorder.attempt()
    recorder.disconnect()
    assert numbers_in(path)[-10:] == list(range(90, 100))


def test_files_of_another_database_delete_no_row(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    for name, minutes in (("h.db", 90), ("other.db", 300)):
        recorder = Recorder(tmp_path / name)
        recorder.one._settings = replace(recorder.one._settings, folder=tmp_path / "h")
        recorder.record(range(minutes), 60.0)
        assert recorder.attempt()
        recorder.disconnect()
    recorder = Recorder(path)
    assert not recorder.attempt()
    assert recorder.trouble.code == "error-history_files_foreign"
    recorder.disconnect()
    with sqlite3.connect(path) as other:
        assert other.execute("SELECT count(*) FROM cycles").fetchone() == (30,)
    other.close()


def wait_for(closing: _closing.Closing) -> None:
    while not closing.ended():
        time.sleep(0.01)


@pytest.mark.proof
def test_the_program_beside_says_what_it_has_done_and_is_ended_if_it_hangs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "h.db"
    recorder = Recorder(path)
    recorder.record(range(90), 60.0)
    recorder.one._close_s = float("inf")
    recorder.attempt()
    order = recorder.one._store.finished()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONWARNINGS", "none")  # which the interpreter remarks on first
    (tmp_path / "json.py").write_text("raise SystemExit('a file of the working folder')")
    (tmp_path / "h" / "machine=machine" / "day=2026-11-02").mkdir(parents=True)
    for name in ("000000000001-000000000002", "000000000003-000000000004"):
        torn = tmp_path / "h" / "machine=machine" / "day=2026-11-02" / f"cycles-{name}.parquet"
        torn.write_bytes(b"PAR1 torn PAR1")
    closing = _closing.Closing(order)
    wait_for(closing)
    remark, written, why = closing.result()
    assert (written, why[:12]) == ("written", "2026-11-02: ")
    assert recorder.one._closed(recorder.one._store, order, [remark, written])
    monkeypatch.setattr(_closing, "_LONGEST_S", 1)
    closing = _closing.Closing(order)
    closing._child.send_signal(signal.SIGALRM)
    wait_for(closing)
    assert closing.result()[-1] == "not done after 1 s"
    recorder.disconnect()


# ---- other programs -----------------------------------------------------------------------------


def test_a_second_historian_waits_until_the_first_has_ended(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    first, second = Recorder(path), Recorder(path)
    first.record(range(5))
    second.record(range(5, 10))
    assert first.attempt()
    assert not second.attempt()
    assert second.trouble.code == "error-history_in_use"
    first.disconnect()
    assert second.attempt()
    second.disconnect()
    assert numbers_in(path) == list(range(10))


def test_a_program_that_locks_the_file_is_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_database, "_BUSY_S", 0.05)
    path = tmp_path / "h.db"
    recorder = Recorder(path)
    recorder.record(range(3))
    assert recorder.attempt()
    other = sqlite3.connect(path, isolation_level=None)
    other.execute("BEGIN EXCLUSIVE")
    recorder.record(range(3, 6))
    assert not recorder.attempt()
    assert recorder.trouble.code == "failure-history_unwritable"
    other.close()
    assert recorder.attempt()
    recorder.disconnect()
    assert numbers_in(path) == list(range(6))
    assert recorder.one.status.lost == 0


def test_a_large_file_is_looked_through_once_not_with_every_attempt(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "h.db"
    looked: list[Path] = []
    check = _historian.check_file

    def counted(file: Path) -> str:
        looked.append(file)
        return check(file)

    monkeypatch.setattr(_historian, "check_file", counted)
    recorder = Recorder(path)
    with sqlite3.connect(path) as other:  # as an earlier kind of the program left it
        other.execute("CREATE TABLE thermaxis_version (name TEXT, value INTEGER)")
    other.close()
    for _ in range(5):
        assert not recorder.attempt()
    assert len(looked) == 1
    assert recorder.trouble.code == "error-history_earlier"
    with pytest.raises(ConfigurationError) as caught:
        HistoryReader(url_of(path))
    assert caught.value.code == "history_earlier"


def test_a_reader_sees_that_the_file_was_put_aside(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    recorder = Recorder(path)
    recorder.record(range(3))
    recorder.attempt()
    recorder.disconnect()
    with HistoryReader(url_of(path)) as reader:
        assert reader.in_place
        put_aside(path, BEGIN)
        assert not reader.in_place
        recorder.record(range(3, 6))
        recorder.attempt()
        assert not reader.in_place
    recorder.disconnect()


def test_the_lock_of_a_historian_is_gone_with_it(tmp_path: Path) -> None:
    lock = writer_lock(tmp_path / "h.db")
    with pytest.raises(ConfigurationError) as caught:
        writer_lock(tmp_path / "h.db")
    assert caught.value.code == "history_in_use"
    lock.release()
    lock.release()
    writer_lock(tmp_path / "h.db").release()


def test_a_history_of_a_newer_program_is_refused_by_historian_and_reader(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    recorder = Recorder(path)
    recorder.record(range(3))
    recorder.attempt()
    recorder.disconnect()
    with sqlite3.connect(path) as other:
        other.execute("UPDATE history SET value = '99' WHERE name = 'version'")
    other.close()
    later = Recorder(path)
    later.record(range(3, 6))
    assert not later.attempt()
    assert later.trouble.values["found"] == "99"
    assert later.one.status.waiting == 3
    later.disconnect()
    with pytest.raises(ConfigurationError) as caught:
        HistoryReader(url_of(path))
    assert caught.value.code == "history_version"


def test_another_database_is_no_history(tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    with sqlite3.connect(path) as other:
        other.execute("CREATE TABLE mine (x)")
    other.close()
    with pytest.raises(DataError, match="no history"):
        HistoryReader(url_of(path))
    with pytest.raises(ConfigurationError, match="no loop has written"):
        HistoryReader(url_of(tmp_path / "none.db"))


# ---- the loop's side ----------------------------------------------------------------------------


@scene
async def test_cycles_and_events_come_back_exactly(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    records = [cycle_record(k, cycle_s=30.0) for k in range(700)]  # hours that are over, and a rest
    events = [event_record("started", kind="start"), event_record("Warming -> Active")]

    stored = [columns().row_of(record).values() for record in records]
    one = SqlHistorian(replace(QUICK, url=url_of(path)), CountingClock())
    await one.open(OUTPUTS)
    one.event(events[0])
    for record in records:
        one.record(record)
    one.event(events[1])
    assert await drained(one, 20.0)
    with HistoryReader(url_of(path)) as reader:  # beside the writer
        assert whole(reader) == stored
        assert reader.events() == events
    assert one.status == (True, 0, 0, None)
    await one.close(5.0)
    assert one.status == (True, 0, 0, None)

    with HistoryReader(url_of(path)) as reader:
        assert whole(reader) == stored
        assert reader.events(kinds=["start"]) == events[:1]
        assert reader.events(newest=1) == events[1:]
        assert reader.span() == (records[0].utc, records[-1].utc)
        first, last = BEGIN + timedelta(seconds=6015), BEGIN + timedelta(seconds=9000)
        assert whole(reader, first, last) == stored[201:300]


@scene
async def test_the_loop_never_waits_and_nothing_raises_while_the_database_hangs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "h.db"
    asked, answers = threading.Event(), threading.Event()
    ended: list[bool] = []

    def slow(*arguments: object) -> Store:
        asked.set()
        ended.append(answers.wait(30.0))
        return Store(*arguments)

    monkeypatch.setattr(_historian, "Store", slow)
    monkeypatch.setattr(_historian, "_SILENT_S", -1.0)  # every silence is a long one

    one = SqlHistorian(replace(QUICK, url=url_of(path)), CountingClock())
    await one.open(OUTPUTS)
    assert await asyncio.to_thread(asked.wait, 30.0)
    for k in range(200):
        one.record(cycle_record(k))
    one.event(event_record("x"))
    assert one.status.waiting == 201
    assert not one.status.storing
    assert one.status.failure is not None
    assert one.status.failure.code == "failure-history_opening"
    assert not ended  # all this while the database has not answered
    monkeypatch.setattr(_historian, "_SILENT_S", 60.0)
    answers.set()
    assert await drained(one, 10.0)
    assert ended == [True]
    assert one.status == (True, 0, 0, None)
    await one.close(5.0)

    assert numbers_in(path) == list(range(200))


@scene
async def test_a_record_that_is_none_counts_as_lost_and_raises_nothing(tmp_path: Path) -> None:
    path = tmp_path / "h.db"

    one = SqlHistorian(replace(QUICK, url=url_of(path)), CountingClock())
    await one.open(OUTPUTS)
    one.record(None)
    one.event(None)
    one.record(cycle_record(1))
    assert await drained(one, 10.0)
    assert one.status == (True, 0, 2, None)
    await one.close(5.0)

    with HistoryReader(url_of(path)) as reader:
        (told,) = reader.events(kinds=["loss"])
    assert (told.details["cycles"], told.details["events"]) == (1, 1)
    assert "no attribute 'details'" in str(told.details["unusable"])


@scene
async def test_the_end_comes_within_its_time_and_counts_what_is_left(tmp_path: Path) -> None:
    one = SqlHistorian(
        replace(QUICK, url=url_of(tmp_path / "none" / "none" / "h.db")), CountingClock()
    )
    await one.open(OUTPUTS)
    for k in range(20):
        one.record(cycle_record(k))
    began_s = time.monotonic()
    await one.close(0.3)
    assert time.monotonic() - began_s < 2.0
    assert one.status.lost == 20
    one.record(cycle_record(21))
    assert one.status.lost == 21
    assert one.status.waiting == 0


@scene
async def test_a_historian_that_was_never_opened_can_be_closed(tmp_path: Path) -> None:
    one = SqlHistorian(replace(QUICK, url=url_of(tmp_path / "h.db")), CountingClock())
    one.record(cycle_record(1))
    await one.close(0.1)
    assert one.status.lost == 1


def test_a_url_that_cannot_be_used_is_refused_before_anything_runs() -> None:
    for url, code in (
        ("", "no_database_url"),
        ("lathe.db", "no_database_url"),
        ("sqlite://", "no_file_in_url"),
        ("sqlite:///:memory:", "no_file_in_url"),
        ("sqlite:///h.db?mode=ro", "no_file_in_url"),
        ("mysql://user@host/db", "unknown_database"),
        ("postgresql+asyncpg://user@host/db", "unknown_database"),
        ("postgresql://user@plant/db?sslmode=prefer", "database_unencrypted"),
        ("postgresql://user@plant/db", "database_unencrypted"),
        ("postgresql://user@127.0.0.1/db?host=plant", "database_unencrypted"),
        ("postgresql://user@127.0.0.1/db?hostaddr=10.0.0.1", "database_unencrypted"),
        ("postgresql://user@127.0.0.1/db?host=plant&sslmode=allow", "database_unencrypted"),
    ):
        with pytest.raises(ConfigurationError) as caught:
            SqlHistorian(replace(QUICK, url=url), CountingClock())
        assert caught.value.code == code, url


def test_another_computer_is_reached_with_encryption_only() -> None:
    for url, file in (
        ("postgresql://user@plant/db?sslmode=require", None),
        ("postgresql://user@plant/db?sslmode=verify-full", None),
        ("postgresql+psycopg://user@127.0.0.1:5433/db", None),
        ("postgresql://user@localhost/db", None),
        ("postgresql:///db?host=/run/postgresql", None),
        ("sqlite:///h.db", Path("h.db")),
        ("sqlite:////var/lib/h.db", Path("/var/lib/h.db")),
    ):
        assert check_url(url, key="url") == file
