"""What the loop costs: `thermaxis run` at 10 Hz with its status server, against the virtual lathe.

    python benchmarks/loop_cost.py [--seconds 30] [--cycle 0.1] [--flood]

Starts `thermaxis machine` and `thermaxis run` as a user would, on free ports of this computer and
with every cycle recorded, waits until the compensation is active, and then reads /proc of the loop
and of the program beside it for so many seconds. Printed: their shares of one core and their
memory, and how late cycles began. With --flood four clients log in and out of the status server
without a pause meanwhile. All are ended. Linux only.
"""

import argparse
import os
import re
import signal
import socket
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from shutil import copytree

EXAMPLE = Path(__file__).resolve().parent.parent / "examples" / "machine"
FLOOD = """
import asyncio, sys
from asyncua import Client
async def visit():
    while True:
        try:
            async with Client(sys.argv[1], timeout=10.0):
                print("logged in", flush=True)
        except Exception:
            await asyncio.sleep(0.01)
async def flood():
    await asyncio.gather(*(visit() for _ in range(4)))
asyncio.run(flood())
"""
TICKS_PER_S = os.sysconf("SC_CLK_TCK")
LONGEST_START_S = 60.0
MOST_SHARE_PERCENT = 4.0
MOST_MEMORY_MB = 120.0


def free_port() -> int:
    with closing(socket.socket()) as listener:
        listener.bind(("127.0.0.1", 0))
        return int(listener.getsockname()[1])


@contextmanager
def started(output: Path, *words: str) -> Iterator[subprocess.Popen[bytes]]:
    """Start the program with its output in a file, and end it."""
    with output.open("wb") as file:
        running = subprocess.Popen(
            [sys.executable, "-m", "thermaxis", *words], stdout=file, stderr=subprocess.STDOUT
        )
        try:
            yield running
        finally:
            running.send_signal(signal.SIGTERM)
            try:
                running.wait(20.0)
            except subprocess.TimeoutExpired:
                running.kill()
                running.wait()


def wait_for(output: Path, words: str, running: subprocess.Popen[bytes]) -> None:
    until_s = time.monotonic() + LONGEST_START_S
    while time.monotonic() < until_s and running.poll() is None:
        if words in output.read_text(encoding="utf-8"):
            return
        time.sleep(0.1)
    sys.exit(f"'{words}' never came:\n{output.read_text(encoding='utf-8')}")


def configuration(folder: Path, machine_port: int, cycle_s: float) -> Path:
    """Write the example with these ports, this cycle and a short settling time."""
    path = Path(copytree(EXAMPLE, folder / "machine")) / "lathe.toml"
    text = path.read_text(encoding="utf-8")
    for old, new in (
        (r"127\.0\.0\.1:4840", f"127.0.0.1:{machine_port}"),
        (r"port = 4850", f"port = {free_port()}"),
        (r"cycle_s = [\d.]+", f"cycle_s = {cycle_s!r}"),
        (r"settle_s = [\d.]+", "settle_s = 5.0"),
    ):
        text, count = re.subn(old, new, text)
        if count != 1:
            sys.exit(f"the example has no line {old}")
    path.write_text(text, encoding="utf-8")
    return path


def cpu_s(pid: int) -> float:
    """Return the time of all threads of a program on a core, in s (proc(5), fields 14 and 15)."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_S


def memory_mb(pid: int) -> float:
    """Return the memory of a program, each page that it shares with others in parts."""
    words = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii").split()
    return int(words[words.index("Pss:") + 1]) * 1.024e-3


def programs_of(pid: int) -> dict[str, int]:
    """Return the loop and the program beside it."""
    beside = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()
    return dict(zip(("the loop", "beside it"), (pid, *map(int, beside)), strict=True))


def lateness(database: Path, since: int) -> str:
    with closing(sqlite3.connect(database)) as history:
        rows = history.execute("SELECT lateness_s FROM cycles").fetchall()
    late_ms = sorted(1000.0 * row[0] for row in rows[since:])
    half, most = late_ms[len(late_ms) // 2], late_ms[len(late_ms) * 99 // 100]
    return f"{half:.1f} ms (median), {most:.1f} ms (99 %), {late_ms[-1]:.1f} ms (latest)"


@contextmanager
def flooded(log: Path, loop_log: Path, *, wanted: bool) -> Iterator[None]:
    """Log in and out without a pause, if it is wanted."""
    if not wanted:
        yield
        return
    url = loop_log.read_text("utf-8").partition("status server: ")[2].split()[0]
    with log.open("wb") as file:
        running = subprocess.Popen([sys.executable, "-c", FLOOD, url], stdout=file, stderr=file)
    try:
        yield
    finally:
        running.kill()
        running.wait()
        print(f"  {log.read_text('utf-8').count('logged in')} log-ins")


def measured(seconds: float, cycle_s: float, *, flood: bool) -> bool:
    """Measure once, print it, and return whether it is within the bounds."""
    with tempfile.TemporaryDirectory() as name:
        folder, port = Path(name), free_port()
        path = configuration(folder, port, cycle_s)
        machine_log, loop_log = folder / "machine.log", folder / "loop.log"
        words = ("machine", "--scenario", "verification", "--port", str(port))
        with started(machine_log, *words, "--stop-after", "10min") as machine:
            wait_for(machine_log, "endpoint", machine)
            with started(loop_log, "run", str(path), "--enable") as loop:
                wait_for(loop_log, "Z Active", loop)
                pids = programs_of(loop.pid)
                began_s, used_s = time.monotonic(), {k: cpu_s(pid) for k, pid in pids.items()}
                with flooded(folder / "flood.log", loop_log, wanted=flood):
                    time.sleep(seconds)
                lasted_s = time.monotonic() - began_s
                share = {k: 100.0 * (cpu_s(p) - used_s[k]) / lasted_s for k, p in pids.items()}
                memory = {k: memory_mb(pid) for k, pid in pids.items()}
            late = lateness(path.with_name("lathe.history.db"), -round(seconds / cycle_s))
    print(f"thermaxis run, cycle {cycle_s:g} s, status server, SQLite, {seconds:g} s while Active")
    for who in pids:
        print(f"  {who:9} {share[who]:6.2f} % of a core {memory[who]:6.1f} MB")
    print(f"  cycles begin late by {late}")
    total, total_mb = sum(share.values()), sum(memory.values())
    print(f"  both      {total:6.2f} % of a core {total_mb:6.1f} MB")
    print(f"  at most   {MOST_SHARE_PERCENT:6.2f} %           {MOST_MEMORY_MB:6.1f} MB")
    return total <= MOST_SHARE_PERCENT and total_mb <= MOST_MEMORY_MB


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--cycle", type=float, default=0.1, metavar="S")
    parser.add_argument("--flood", action="store_true")
    given = parser.parse_args()
    sys.exit(0 if measured(given.seconds, given.cycle, flood=given.flood) else 1)
