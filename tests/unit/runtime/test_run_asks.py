"""What the command line asks of a loop that has just been started."""

import argparse
import asyncio
import queue
import re
import signal
import sqlite3
import sys
import threading
import traceback
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import pytest

from tests.unit.runtime.machine_files import machine_file
from tests.unit.runtime.simulated import Rig, enabled_for, state_of
from thermaxis.cli import main
from thermaxis.cli.machine import run
from thermaxis.cli.machine._signals import at_signals
from thermaxis.cli.machine.commission import _until_a_signal
from thermaxis.cli.machine.run import _ask_first
from thermaxis.compensation import Request, RequestKind, SupervisorState
from thermaxis.runtime import OTHER_COMPENSATION, HistorianStatus, read_machine

VIRTUAL_TIME = True


@pytest.fixture
def in_a_terminal() -> Iterator[None]:
    """What outlives its terminal, as after nohup, would heed none that closes."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


async def test_enabling_is_asked_again_after_a_missed_read_until_there_is_a_reason() -> None:
    for read, state in ((0.0, SupervisorState.ACTIVE), (1.0, SupervisorState.OFF)):
        bench = Rig()
        bench.machine.values[OTHER_COMPENSATION] = None
        async with bench.running() as loop:
            arguments = argparse.Namespace(enable=True, diameter=None)
            asking = asyncio.ensure_future(_ask_first(loop, arguments))
            await asyncio.sleep(5.0)
            assert not asking.done()
            bench.machine.values[OTHER_COMPENSATION] = read
            await asyncio.sleep(30.0)
            assert asking.done()
            assert state_of(loop) is state


@pytest.mark.usefixtures("in_a_terminal")
def test_a_terminal_that_is_closed_asks_for_the_end_as_a_service_does() -> None:
    asked: list[None] = []

    async def close_terminal() -> None:
        with at_signals(lambda: asked.append(None)):
            for number in (signal.SIGHUP, signal.SIGTERM):
                signal.raise_signal(number)
                await asyncio.sleep(0.0)
            await asyncio.sleep(0.01)

    asyncio.run(close_terminal())
    assert len(asked) == 2


def test_a_history_that_cannot_be_written_keeps_no_machine_from_running(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = machine_file(tmp_path)
    file = Path(read_machine(path).historian.url.removeprefix("sqlite:///"))
    file.parent.mkdir(exist_ok=True)
    with sqlite3.connect(file) as other:
        other.execute("CREATE TABLE thermaxis_version (name TEXT, value INTEGER)")
    other.close()
    assert main(["run", str(path), "--cycles", "1"]) == 0
    said = capfd.readouterr()
    assert "nothing is recorded: " in said.err
    assert re.search(r"[1-9] records of the history were lost", said.err)
    assert said.out.endswith("ended\n")


async def test_an_alarm_that_comes_or_goes_is_a_line_and_the_end_says_why_it_fades(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    said: list[str] = []
    monkeypatch.setattr(run, "_say", lambda text, **_: said.append(text.split("Z ", 1)[1]))
    bench, stop = Rig(), asyncio.Event()
    async with bench.running() as loop:
        loop.listeners.append(run._Teller(stop).tell)
        await enabled_for(loop, 30.0)
        said.clear()
        for _ in range(10):  # it comes and goes every two seconds
            bench.historian.told = HistorianStatus(storing=False, waiting=7)
            await asyncio.sleep(2.0)
            bench.historian.told = HistorianStatus()
            await asyncio.sleep(2.0)
        assert set(said) == {
            "alarm, medium: The history cannot be stored.",
            "no more: The history cannot be stored.",
        }
        assert 3 <= len(said) <= 5
        stop.set()
        await loop.submit(Request(RequestKind.DISABLE, "Eve"))
        await asyncio.sleep(2.0)
        assert said[-1].startswith("Fading (the program is being ended); "), said


def test_a_reader_that_stands_still_stops_no_cycle_and_takes_nothing_from_another(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    reads, told = threading.Event(), threading.Event()
    printed: dict[int, list[str]] = {1: [], 2: []}

    def write(descriptor: int, text: bytes) -> None:
        if descriptor == 1:
            reads.wait()
        printed[descriptor].append(text.decode())
        if text == b"last\n":
            told.set()

    def fail(depth: int) -> None:
        if depth:
            again(depth - 1)
        raise ValueError("the cause")

    def again(depth: int) -> None:
        fail(depth)  # by turns: no line is left out as one that repeats

    most = run.MOST_WAITING
    waiting = {descriptor: queue.Queue[str](most) for descriptor in printed}
    monkeypatch.setattr(run, "_WAITING", waiting)  # no thread of another run takes from these
    monkeypatch.setattr(run.os, "write", write)
    for descriptor in printed:
        threading.Thread(target=run._print_waiting, args=(descriptor,), daemon=True).start()
    with redirect_stdout(run._Beside(1)), redirect_stderr(run._Beside(2)):
        for k in range(most + 100):
            run._say(f"{k}", quiet=False)
        try:
            fail(250)
        except ValueError:
            traceback.print_exc()
        sys.stderr.write("last\n")
    assert told.wait(60.0), "standard error is read while standard output stands still"
    said = "".join(printed[2])
    assert said.startswith("Traceback")
    assert said.endswith("ValueError: the cause\nlast\n")
    reads.set()
    waiting[1].join()
    assert printed[1][:most] == [f"{k}\n" for k in range(most)]
    assert len(printed[1]) <= most + 1, "lines for which no room is left are left out"


@pytest.mark.usefixtures("in_a_terminal")
def test_a_step_is_brought_back_when_its_terminal_is_closed_however_often_that_tells() -> None:
    stands: list[str] = []

    async def step() -> Any:
        try:
            stands.append("out")
            signal.raise_signal(signal.SIGHUP)
            await asyncio.sleep(5.0)
        finally:
            signal.raise_signal(signal.SIGHUP)
            await asyncio.sleep(0.01)
            stands.append("back")

    with pytest.raises(asyncio.CancelledError):
        asyncio.run(_until_a_signal(step()))
    assert stands == ["out", "back"]
