"""The same history, and a fleet's registry, in PostgreSQL: a server of its own on this computer."""

import asyncio
import shutil
from collections.abc import Callable, Coroutine, Iterator, Sequence
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import polars as pl
import psycopg
import pytest

from tests.system.postgres import PASSWORD, Server, new_server
from tests.unit.fleet.registry_laws import Made, RegistryLaws
from tests.unit.runtime.history_records import (
    BEGIN,
    OUTPUTS,
    CountingClock,
    cycle_record,
    drained,
    event_record,
    threadless,
    url_of,
    write_history,
)
from thermaxis.cli import main
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.fleet import Registry
from thermaxis.runtime import Secret
from thermaxis.runtime.history import (
    HistorianSettings,
    HistoryReader,
    SqlHistorian,
    check_database,
    check_history,
    export_history,
)
from thermaxis.runtime.history._columns import Item

pytestmark = pytest.mark.system

KEPT = {"cycles", "events", "history"}
QUICK = HistorianSettings(batch_s=0.01, retry_s=0.1, password=Secret(PASSWORD))


@pytest.fixture(scope="module")
def running() -> Iterator[Server]:
    with new_server() as server:
        yield server


@pytest.fixture
def server(running: Server) -> Server:
    if running.child is None:
        running.start()
    running.execute("DROP SCHEMA public CASCADE")
    running.execute("CREATE SCHEMA public")
    shutil.rmtree(running.folder / "parts", ignore_errors=True)
    return running


def run(scene: Callable[[], Coroutine[object, object, None]]) -> None:
    asyncio.run(scene())


def settings(server: Server) -> HistorianSettings:
    return replace(QUICK, url=server.url, folder=server.folder / "parts")


async def opened(server: Server) -> SqlHistorian:
    made = SqlHistorian(settings(server), CountingClock())
    await made.open(OUTPUTS)
    return made


def records_in(server: Server) -> list[int]:
    """Return the numbers of the cycles."""
    with HistoryReader(server.url, PASSWORD) as reader:
        return reader.cycles(columns=["number"]).collect()["number"].to_list()


def test_cycles_events_and_trends_are_those_of_sqlite(server: Server, tmp_path: Path) -> None:
    records = [cycle_record(k, cycle_s=10.0, good=k % 50 != 49) for k in range(1000)]
    odd = records[0].samples["T_table_C"]._replace(status="µ \0 \ud800 '")
    records[0] = replace(records[0], samples={**records[0].samples, "T_table_C": odd})
    event = event_record("Off -> Warming ☺")

    async def scene() -> None:
        one = await opened(server)
        one.event(event)
        one.event(event_record("zero \0 and half \ud800"))
        for record in records:
            one.record(record)
        assert await drained(one, 30.0)
        assert one.status == (True, 0, 0, None)
        for _ in range(1200):  # the hours that are over become files beside it
            if server.execute("SELECT min(id) FROM cycles") == [(721,)]:
                break
            await asyncio.sleep(0.1)
        await one.close(10.0)

    run(scene)
    assert server.execute("SELECT min(id), max(id) FROM cycles") == [(721, 1000)]
    path = tmp_path / "h.db"
    write_history(path, records)
    spans = [(1005.0, 7000.0, 50), (0.0, 86_400.0, 10), (-5.0, 20.0, 3)]
    with HistoryReader(server.url, PASSWORD) as big, HistoryReader(url_of(path)) as small:
        assert [e.text for e in big.events()] == [event.text, "zero \\x00 and half \\ud800"]
        assert big.events()[0] == event
        with big._asked() as connection:  # one moment for what is closed and for the rows
            shown = connection.exec_driver_sql("SHOW transaction_isolation").scalar_one()
        assert shown == "repeatable read"
        assert big.span() == small.span()
        assert big.series() == small.series()
        for first_s, last_s, points in spans:
            begin, end = BEGIN + timedelta(seconds=first_s), BEGIN + timedelta(seconds=last_s)
            found = [reader.cycles(begin, end).collect() for reader in (big, small)]
            assert found[0].equals(found[1])
            assert found[0].height
            trends = [r.trend(big.series(), begin, end, points=points) for r in (big, small)]
            for name, one in trends[0].items():
                two = trends[1][name]
                assert one.mean == pytest.approx(two.mean, rel=1e-12)
                assert replace(one, mean=()) == replace(two, mean=())
        export_history(big, tmp_path / "big.parquet")
        export_history(small, tmp_path / "small.parquet")
    frames = [pl.read_parquet(tmp_path / f"{name}.parquet") for name in ("big", "small")]
    assert frames[0].equals(frames[1])
    assert check_history(server.url, PASSWORD).cycles == 1000


def test_a_server_that_goes_and_comes_back_has_every_cycle_once(server: Server) -> None:
    async def scene() -> None:
        one = await opened(server)
        number = 0
        for outage in range(4):
            for _ in range(60):
                one.record(cycle_record(number))
                number += 1
                await asyncio.sleep(0.005)
                if number % 60 == 20 and outage < 3:
                    await asyncio.to_thread(server.kill)
            if outage < 3:
                await asyncio.sleep(0.3)
                assert not one.status.storing
                assert one.status.waiting > 0
                assert PASSWORD not in str(one.status.failure)
                await asyncio.to_thread(server.start)
                assert await drained(one, 30.0)
        assert await drained(one, 30.0)
        assert one.status == (True, 0, 0, None)
        await one.close(10.0)

    run(scene)
    assert records_in(server) == list(range(240))
    with HistoryReader(server.url, PASSWORD) as reader:
        assert len(reader.events(kinds=["connection"])) >= 3
        assert reader.events(kinds=["loss"]) == []


def test_a_commit_whose_answer_was_lost_is_not_written_twice(
    server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The writer is told that its connection broke, after the rows were stored."""
    one = threadless(server.folder, settings(server))
    one.record(cycle_record(0))
    assert one.attempt()
    store = one._store
    assert store is not None
    write = store.write

    def answer_lost(items: Sequence[Item]) -> None:
        write(items)
        raise OSError("server closed the connection unexpectedly")

    monkeypatch.setattr(store, "write", answer_lost)
    for k in range(1, 500):
        one.record(cycle_record(k))
    assert not one.attempt()
    assert one.status.waiting == 499
    assert one.attempt()
    one.disconnect()
    assert records_in(server) == list(range(500))


def test_a_second_writer_is_refused_until_the_first_has_ended(server: Server) -> None:
    async def scene() -> None:
        one = await opened(server)
        one.record(cycle_record(0))
        assert await drained(one, 10.0)
        two = await opened(server)
        two.record(cycle_record(1))
        assert not await drained(two, 1.0)
        assert two.status.failure is not None
        assert two.status.failure.code == "error-history_in_use"
        await one.close(5.0)
        assert await drained(two, 10.0)
        await two.close(5.0)

    run(scene)
    assert len(records_in(server)) in {1, 2}


def test_a_wrong_password_is_said_without_a_password(server: Server) -> None:
    async def scene() -> None:
        wrong = "wrong but not to be shown either"
        some = replace(settings(server), password=Secret(wrong), retry_s=0.1)
        one = SqlHistorian(some, CountingClock())
        await one.open(OUTPUTS)
        one.record(cycle_record(0))
        assert not await drained(one, 1.0)
        assert "password authentication failed" in str(one.status.failure)
        assert wrong not in str(one.status.failure)
        await one.close(0.2)
        assert one.status.lost == 1

    run(scene)
    with pytest.raises(DataError, match="password authentication failed") as error:
        HistoryReader(server.url, "wrong as well")
    assert "wrong as well" not in str(error.value)


def test_another_model_and_old_days_are_dealt_with_as_in_sqlite(server: Server) -> None:
    kept: list[int] = []
    for day in range(4):
        one = threadless(server.folder, replace(settings(server), retention_days=2))
        begin = BEGIN.replace(hour=0) + timedelta(days=day)
        parts = (("spindle", f"part{day}"), ("spindle",))
        for k in range(10 * day, 10 * day + 10):
            record = replace(cycle_record(k, begin=begin), parts=parts)
            one.record(record)
            kept += [k] if day >= 1 else []
        assert one.attempt()
        assert one.status.failure is None
        one.disconnect()
    assert records_in(server) == kept  # two days in files, and the newest as rows
    names = server.execute("SELECT tablename FROM pg_tables WHERE schemaname = 'public'")
    assert sorted(str(name) for (name,) in names) == ["cycles", "events", "history"]


def test_a_table_that_somebody_reads_is_dropped_later_and_nothing_is_disconnected(
    server: Server,
) -> None:
    def before() -> list[str]:
        names = server.execute("SELECT tablename FROM pg_tables WHERE schemaname = 'public'")
        return sorted(str(name) for (name,) in names if str(name) not in KEPT)

    one = threadless(server.folder, settings(server))
    one._close_s = float("inf")
    for k in range(2):
        one.record(replace(cycle_record(k), parts=(("spindle", f"part{k}"), ("spindle",))))
        assert one.attempt()
    (name,) = before()
    one._close_s = 0.0
    with psycopg.connect(
        host="127.0.0.1",
        port=server.port,
        user="thermaxis",
        password=PASSWORD,
        dbname="thermaxis",
    ) as reader:
        reader.execute(f"TABLE {name}")
        assert one.attempt()
        assert one.status.failure is None
        assert before() == [name]
    one.record(replace(cycle_record(4000), parts=(("spindle", "part1"), ("spindle",))))
    assert one.attempt()
    assert before() == []
    one.disconnect()


def test_a_database_that_stores_no_text_is_refused_with_a_sentence(
    server: Server, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    server.execute("DROP DATABASE IF EXISTS ascii", database="postgres")
    server.execute(
        "CREATE DATABASE ascii ENCODING 'SQL_ASCII' LOCALE 'C' TEMPLATE template0",
        database="postgres",
    )
    url = f"{server.url.rpartition(chr(47))[0]}/ascii"

    async def scene() -> None:
        one = SqlHistorian(replace(settings(server), url=url), CountingClock())
        await one.open(OUTPUTS)
        one.record(cycle_record(0))
        assert not await drained(one, 1.0)
        assert one.status.failure is not None
        assert one.status.failure.code == "error-database_encoding", one.status.failure
        await one.close(0.2)

    run(scene)
    with pytest.raises(ConfigurationError) as caught:
        check_database(url, PASSWORD)
    assert caught.value.values == {"found": "SQL_ASCII"}
    monkeypatch.setenv("PGPASSWORD", PASSWORD)
    assert main(["history", "check", url]) == 2
    assert "stores text as SQL_ASCII, not as UTF8" in capsys.readouterr().err


def test_the_command_reads_a_server(
    server: Server,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    async def scene() -> None:
        one = await opened(server)
        for k in range(30):
            one.record(cycle_record(k))
        assert await drained(one, 10.0)
        await one.close(5.0)

    run(scene)
    monkeypatch.setenv("PGPASSWORD", PASSWORD)
    target = tmp_path / "log.parquet"
    assert main(["history", "export", server.url, "-o", str(target)]) == 0
    assert pl.read_parquet(target).height == 30
    assert main(["history", "check", server.url]) == 0
    assert "30 cycles" in capsys.readouterr().out


class TestRegistry(RegistryLaws):
    """A fleet's registry holds here what it holds in SQLite."""

    @pytest.fixture
    def url(self, server: Server) -> str:
        return server.url

    @pytest.fixture
    def password(self) -> str:
        return PASSWORD

    @pytest.fixture
    def made(self, url: str) -> Made:
        Registry.make(url, "lake", PASSWORD).close()
        return lambda: Registry(url, PASSWORD)
