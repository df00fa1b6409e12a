"""The same history in PostgreSQL: a server of its own, on this computer, for this test."""

import asyncio
import os
import pwd
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Callable, Coroutine, Iterator
from dataclasses import dataclass, replace
from datetime import timedelta
from pathlib import Path

import polars as pl
import psycopg
import pytest

from tests.unit.runtime.history_records import (
    BEGIN,
    CHANNELS,
    OUTPUTS,
    CountingClock,
    cycle_record,
    event_record,
)
from thermaxis.cli import main
from thermaxis.compensation import Answer, AnswerCode, Request, RequestKind
from thermaxis.errors import DataError
from thermaxis.runtime import CycleRecord, Secret
from thermaxis.runtime.historian import (
    Backlog,
    FileWatch,
    HistorianSettings,
    HistoryReader,
    RowPacker,
    SqlHistorian,
    Writer,
    check_history,
    export_history,
    open_store,
    parse_url,
)

pytestmark = [pytest.mark.system, pytest.mark.timeout(120)]

PASSWORD = "not a secret: of a server that lives for a test"  # noqa: S105 - see its text
QUICK = HistorianSettings(batch_s=0.01, retry_s=0.1, password=Secret(PASSWORD))


def program(name: str) -> str:
    """Return a program of PostgreSQL; it is not always on the path."""
    found = shutil.which(name)
    folders = sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)
    beside = [str(folder / name) for folder in folders if (folder / name).is_file()]
    choices = beside if found is None else [found, *beside]
    if not choices:
        pytest.fail(f"{name} is missing: install the package postgresql")
    return choices[0]


def user() -> str | None:
    """Return who runs the server: it refuses to run for root."""
    if os.geteuid() != 0:
        return None
    names = {entry.pw_name for entry in pwd.getpwall()}
    return "postgres" if "postgres" in names else "nobody"


@dataclass
class Server:
    """A server of PostgreSQL."""

    folder: Path
    port: int
    child: subprocess.Popen[bytes] | None = None

    @property
    def url(self) -> str:
        return f"postgresql+psycopg://thermaxis@127.0.0.1:{self.port}/thermaxis"

    def start(self) -> None:
        settings = {
            "listen_addresses": "127.0.0.1",
            "port": str(self.port),
            "unix_socket_directories": str(self.folder),
            "shared_buffers": "4MB",
            "max_connections": "10",
        }
        words = [word for name, value in settings.items() for word in ("-c", f"{name}={value}")]
        with (self.folder / "server.log").open("ab") as log:
            self.child = subprocess.Popen(
                [program("postgres"), "-D", str(self.folder / "data"), *words],
                stdout=log,
                stderr=log,
                user=user(),
                cwd=self.folder,
            )
        for _ in range(100):
            try:
                self.execute("SELECT 1", database="postgres")
            except psycopg.OperationalError:
                time.sleep(0.1)
            else:
                return
        pytest.fail((self.folder / "server.log").read_text(errors="replace")[-2000:])

    def kill(self) -> None:
        """End it as a loss of power would: at once, without a word to its clients."""
        if self.child is not None:
            self.child.send_signal(3)  # SIGQUIT: no checkpoint, recovery at the next start
            self.child.wait(20)
            self.child = None

    def execute(self, statement: str, database: str = "thermaxis") -> list[tuple[object, ...]]:
        with psycopg.connect(
            host="127.0.0.1",
            port=self.port,
            user="thermaxis",
            password=PASSWORD,
            dbname=database,
            autocommit=True,
        ) as connection:
            found = connection.execute(statement.encode())
            return found.fetchall() if found.description else []


@pytest.fixture(scope="module")
def running() -> Iterator[Server]:
    folder = Path(tempfile.mkdtemp(prefix="history"))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = int(free.getsockname()[1])
    server = Server(folder, port)
    secret = folder / "secret"
    secret.write_text(PASSWORD)
    who = user()
    if who is not None:
        for path in (folder, secret):
            shutil.chown(path, who)
    try:
        subprocess.run(
            [
                *(program("initdb"), "-D", str(folder / "data"), "-U", "thermaxis", "-E", "UTF8"),
                *("--auth=scram-sha-256", f"--pwfile={secret}", "--no-sync"),
            ],
            check=True,
            stdout=subprocess.DEVNULL,
            user=who,
            cwd=folder,
        )
        server.start()
        server.execute("CREATE DATABASE thermaxis", database="postgres")
        yield server
    finally:
        server.kill()
        shutil.rmtree(folder)


@pytest.fixture
def server(running: Server) -> Server:
    if running.child is None:
        running.start()
    running.execute("DROP SCHEMA public CASCADE")
    running.execute("CREATE SCHEMA public")
    return running


def run(scene: Callable[[], Coroutine[object, object, None]]) -> None:
    asyncio.run(scene())


async def opened(server: Server) -> SqlHistorian:
    made = SqlHistorian(server.url, QUICK, CountingClock())
    await made.open(OUTPUTS, CHANNELS)
    return made


def records_in(server: Server) -> list[CycleRecord]:
    with HistoryReader(server.url, PASSWORD) as reader:
        return list(reader.cycles())


def test_cycles_events_and_trends_are_those_of_sqlite(server: Server, tmp_path: Path) -> None:
    records = [cycle_record(k, good=k % 50 != 49) for k in range(1000)]
    request = Request(RequestKind.TRIM, who="Anna", output="Z_um", value=2.5, duration_s=60.0)
    answers = (Answer(request, True, AnswerCode.TRIM_REPLACED, {"who": "µ \0 \ud800 '"}),)
    first = records[0]
    records[0] = CycleRecord(
        0, first.utc, 1000.0, first.samples, first.output._replace(answers=answers), {}, 0.0
    )
    event = event_record("Off -> Warming ☺")

    async def scene() -> None:
        one = await opened(server)
        one.event(event)
        one.event(event_record("zero \0 and half \ud800"))
        for record in records:
            one.record(record)
        assert await one.drain(30.0)
        assert one.status == (True, 0, 0, None)
        await one.close(10.0)

    run(scene)
    assert records_in(server) == records
    lite = f"sqlite:///{tmp_path / 'h.db'}"
    packer, backlog = RowPacker(), Backlog(10**9)
    packer.outputs, packer.channels = OUTPUTS, CHANNELS
    for record in records:
        backlog.add_cycle(packer.pack(record))
    writer = Writer(parse_url(lite), QUICK, CountingClock(), backlog, packer)
    writer.attempt()
    writer.close()
    spans = [(100.5, 700.0, 50), (0.0, 86_400.0, 10), (-5.0, 2.0, 3)]
    with HistoryReader(server.url, PASSWORD) as big, HistoryReader(lite) as small:
        assert [e.text for e in big.events()] == [event.text, "zero \\x00 and half \\ud800"]
        assert big.events()[0] == event
        assert big.span() == small.span()
        assert set(big.series().items()) == set(small.series().items())
        names = list(small.series())
        for first_s, last_s, points in spans:
            begin, end = BEGIN + timedelta(seconds=first_s), BEGIN + timedelta(seconds=last_s)
            assert list(big.cycles(begin, end)) == list(small.cycles(begin, end))
            trends = [reader.trend(names, begin, end, points=points) for reader in (big, small)]
            for name in names:
                one, two = (found[name] for found in trends)
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
                assert await one.drain(30.0)
        assert await one.drain(30.0)
        assert one.status == (True, 0, 0, None)
        await one.close(10.0)

    run(scene)
    assert [record.number for record in records_in(server)] == list(range(240))
    with HistoryReader(server.url, PASSWORD) as reader:
        assert len(reader.events(kinds=["connection"])) >= 3
        assert reader.events(kinds=["loss"]) == []


def test_a_commit_whose_answer_was_lost_is_not_written_twice(server: Server) -> None:
    """The writer is told that its connection broke, after the rows were stored."""
    packer, backlog = RowPacker(), Backlog(10**8)
    packer.outputs, packer.channels = OUTPUTS, CHANNELS
    for k in range(500):
        backlog.add_cycle(packer.pack(cycle_record(k)))
    url = parse_url(server.url, PASSWORD)
    store = open_store(url, "the run", check_s=1.0, utc=BEGIN, watch=FileWatch())
    items = backlog.take(300)
    store.write(items, packer)
    while store.close_block():  # the rows are no longer single rows when it comes back
        pass
    store.close()
    store = open_store(url, "the run", check_s=1.0, utc=BEGIN, watch=FileWatch())
    backlog.put_back(store.stored_seq())
    store.write(backlog.take(1000), packer)
    store.close()
    assert [record.number for record in records_in(server)] == list(range(500))


def test_a_second_writer_is_refused_until_the_first_has_ended(server: Server) -> None:
    async def scene() -> None:
        one = await opened(server)
        one.record(cycle_record(0))
        assert await one.drain(10.0)
        two = await opened(server)
        two.record(cycle_record(1))
        assert not await two.drain(1.0)
        assert two.status.failure is not None
        assert two.status.failure.code == "error-history_in_use"
        await one.close(5.0)
        assert await two.drain(10.0)
        await two.close(5.0)

    run(scene)
    assert len(records_in(server)) in {1, 2}


def test_a_wrong_password_is_said_without_a_password(server: Server) -> None:
    async def scene() -> None:
        wrong = "wrong but not to be shown either"
        settings = HistorianSettings(password=Secret(wrong), retry_s=0.1)
        one = SqlHistorian(server.url, settings, CountingClock())
        await one.open(OUTPUTS, CHANNELS)
        one.record(cycle_record(0))
        assert not await one.drain(1.0)
        assert "password authentication failed" in str(one.status.failure)
        assert wrong not in str(one.status.failure)
        await one.close(0.2)
        assert one.status.lost == 1

    run(scene)
    with pytest.raises(DataError, match="password authentication failed") as error:
        HistoryReader(server.url, "wrong as well")
    assert "wrong as well" not in str(error.value)


def test_old_days_go_and_the_rest_stays(server: Server) -> None:
    url = parse_url(server.url, PASSWORD)
    kept: list[int] = []
    for day in range(6):
        packer, backlog = RowPacker(), Backlog(10**8)
        packer.outputs, packer.channels = OUTPUTS, CHANNELS
        begin = BEGIN.replace(hour=0) + timedelta(days=day)
        for k in range(256):
            backlog.add_cycle(packer.pack(cycle_record(256 * day + k, begin=begin, utc=begin)))
            kept += [256 * day + k] if day >= 4 else []
        store = open_store(url, f"day {day}", check_s=1.0, utc=begin, watch=FileWatch())
        store.write(backlog.take(1000), packer)
        while store.close_block():
            pass
        while store.retire(2):
            pass
        store.close()
    assert [record.number for record in records_in(server)] == kept
    assert server.execute("SELECT count(DISTINCT minute) FROM thermaxis_trend") == [(2,)]


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
        assert await one.drain(10.0)
        await one.close(5.0)

    run(scene)
    monkeypatch.setenv("PGPASSWORD", PASSWORD)
    target = tmp_path / "log.parquet"
    assert main(["history", "export", server.url, "-o", str(target)]) == 0
    assert pl.read_parquet(target).height == 30
    assert main(["history", "check", server.url]) == 0
    assert "30 cycles" in capsys.readouterr().out
