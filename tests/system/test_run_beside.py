"""The process beside the loop, which has servers and history, is killed, frozen and left alone."""

import asyncio
import os
import signal
import socket
import sqlite3
import subprocess
import sys
import time
from contextlib import closing, suppress
from datetime import datetime
from pathlib import Path

import pytest
from asyncua import Client, ua

from tests.in_time import LONGEST_S
from tests.system.loop_stand import Watcher, excess, lathe, read_runs, write_site
from tests.system.programs import KILLED_WITH_US, compensating, gaps
from thermaxis.compensation import SupervisorState
from thermaxis.runtime.history import HistoryReader

pytestmark = [pytest.mark.system, pytest.mark.real_time]

SERVER = '\n[server]\nanonymous_role = "viewer"\nport = {port}\n'


def free_port() -> int:
    with closing(socket.socket()) as listener:
        listener.bind(("127.0.0.1", 0))
        return int(listener.getsockname()[1])


def child_of(pid: int) -> int:
    (child,) = Path(f"/proc/{pid}/task/{pid}/children").read_text("ascii").split()
    return int(child)


def read(url: str) -> tuple[int, str]:
    """Return the number of the cycle and the state, as any client reads them."""

    async def ask() -> tuple[int, str]:
        async with Client(url, timeout=LONGEST_S) as client:
            space = await client.get_namespace_index("urn:thermaxis:runtime")
            nodes = [
                client.get_node(ua.NodeId(f"Status/{name}", space))
                for name in ("Heartbeat", "State")
            ]
            return tuple(await client.read_values(nodes))

    return asyncio.run(ask())


def active(url: str, after: int = -1) -> int:
    """Return the number of a later cycle as soon as it can be read that it is active."""
    until_s = time.monotonic() + LONGEST_S
    while time.monotonic() < until_s:
        with suppress(OSError):
            number, state = read(url)
            if number > after and state == "Active":
                return number
        time.sleep(0.2)
    raise AssertionError(f"no cycle after {after} that is active")


def test_servers_and_history_that_are_killed_come_back_and_the_loop_does_not_notice(
    tmp_path: Path,
) -> None:
    port = free_port()
    with lathe(tmp_path, watchdog="2s") as url, Watcher(url) as watcher:
        configuration = write_site(tmp_path, url, more=SERVER.format(port=port))
        with compensating(configuration, "--enable") as loop:
            address = loop.wait_for("status server: ", LONGEST_S).text.partition(": ")[2]
            loop.wait_for_state(SupervisorState.ACTIVE, LONGEST_S)
            before = active(address)
            served = child_of(loop.popen.pid)
            stored = read_runs(tmp_path)[-1][-1].number
            os.kill(served, signal.SIGKILL)
            before = active(address, before)
            assert child_of(loop.popen.pid) != served
            for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):  # as a terminal does
                os.kill(child_of(loop.popen.pid), number)
            time.sleep(0.5)
            active(address, active(address, before))
            assert loop.stop(60.0) == 0
    assert max(excess(watcher.looks)) <= 0.0
    with HistoryReader(f"sqlite:///{tmp_path / 'history.db'}") as reader:
        events = reader.events()
    (ended,) = (event for event in events if event.code == "event-publisher_ended")
    missing = gaps([cycle for run in read_runs(tmp_path) for cycle in run])
    assert min(missing, default=stored + 1) > stored  # what was stored at the kill still is
    # What came when its end was noticed and later is stored, and what is missing is told.
    lost = [event for event in events if event.code == "event-records_lost"]
    assert len(missing) <= sum(int(event.values["cycles"]) for event in lost)
    assert all(datetime.fromisoformat(str(one.details["last"])) <= ended.utc for one in lost)


def test_a_loop_that_is_killed_leaves_no_process_and_no_port_behind(tmp_path: Path) -> None:
    port = free_port()
    with lathe(tmp_path, watchdog="2s") as url:
        configuration = write_site(tmp_path, url, more=SERVER.format(port=port))
        with compensating(configuration, "--enable") as loop:
            loop.wait_for_state(SupervisorState.ACTIVE, LONGEST_S)
            served = Path(f"/proc/{child_of(loop.popen.pid)}")
            until_s = loop.kill() + LONGEST_S
            while served.exists():
                assert time.monotonic() < until_s
                time.sleep(0.01)
        with compensating(configuration, "--enable") as loop:
            loop.wait_for_state(SupervisorState.ACTIVE, LONGEST_S)
            os.kill(child_of(loop.popen.pid), signal.SIGSTOP)
            time.sleep(15.0)  # it is told after ten
            os.kill(child_of(loop.popen.pid), signal.SIGCONT)
            time.sleep(1.0)
            assert loop.stop(60.0) == 0
    runs = read_runs(tmp_path)
    assert [gaps(run) for run in runs] == [[], []]
    with sqlite3.connect(tmp_path / "history.db") as history:
        (silent,) = history.execute(
            "SELECT count(*) FROM events WHERE details LIKE '%failure-publisher_silent%'"
        ).fetchone()
    history.close()
    assert silent


def test_a_pipe_that_nobody_reads_holds_up_neither_start_nor_end(tmp_path: Path) -> None:
    url = f"opc.tcp://127.0.0.1:{free_port()}/lathe"
    words = write_site(tmp_path, url), "--diameter", "-1", "--cycles", "3"  # a refusal is printed
    reader, full = os.pipe()
    os.set_blocking(full, False)
    with suppress(BlockingIOError):
        while True:
            os.write(full, b"." * 4096)
    os.set_blocking(full, True)
    command = [*KILLED_WITH_US, sys.executable, "-m", "thermaxis", "run", *words]
    subprocess.run(command, check=True, stdout=full, stderr=full, timeout=LONGEST_S)
    os.close(reader)
    os.close(full)
    assert len(read_runs(tmp_path)[0]) == 3


def test_a_port_that_is_taken_ends_it_before_the_loop_acts(tmp_path: Path) -> None:
    with closing(socket.socket()) as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        more = SERVER.format(port=taken.getsockname()[1])
        url = f"opc.tcp://127.0.0.1:{free_port()}/lathe"
        configuration = write_site(tmp_path, url, more=more)
        with compensating(configuration) as loop:
            assert loop.wait(LONGEST_S) == 2
            assert f"Port {taken.getsockname()[1]} cannot be listened at" in loop.tail()
    assert not (tmp_path / "history.db").exists()
