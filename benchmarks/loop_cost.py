"""What the loop costs: `thermaxis run` at 10 Hz with its status server, against the virtual lathe.

    python benchmarks/loop_cost.py [--seconds 30] [--cycle 0.1]

Starts `thermaxis machine` and `thermaxis run` as a user would, on free ports of this computer and
with every cycle recorded, waits until the compensation is active, and then reads /proc of the loop
for so many seconds. Printed: its share of one core, its memory, and how many cycles it did. Both
programs are ended. Linux only.
"""

import argparse
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from shutil import copytree

EXAMPLE = Path(__file__).resolve().parent.parent / "examples" / "machine"
TICKS_PER_S = os.sysconf("SC_CLK_TCK")
LONGEST_START_S = 60.0
MOST_SHARE_PERCENT = 3.0
MOST_MEMORY_MB = 180.0


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


def memory_mb(pid: int, key: str) -> float:
    text = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    lines = dict(line.split(":", 1) for line in text.splitlines())
    return int(lines[key].split()[0]) / 1000.0


def measured(seconds: float, cycle_s: float) -> bool:
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
                began_s, used_s = time.monotonic(), cpu_s(loop.pid)
                time.sleep(seconds)
                share = 100.0 * (cpu_s(loop.pid) - used_s) / (time.monotonic() - began_s)
                now_mb, most_mb = memory_mb(loop.pid, "VmRSS"), memory_mb(loop.pid, "VmHWM")
    print(f"thermaxis run, cycle {cycle_s:g} s, status server, SQLite, {seconds:g} s while Active")
    print(f"  share of one core   {share:6.2f} %   (at most {MOST_SHARE_PERCENT:g} %)")
    print(f"  memory, now         {now_mb:6.1f} MB  (at most {MOST_MEMORY_MB:g} MB)")
    print(f"  memory, at most     {most_mb:6.1f} MB")
    return share <= MOST_SHARE_PERCENT and most_mb <= MOST_MEMORY_MB


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--cycle", type=float, default=0.1, metavar="S")
    given = parser.parse_args()
    sys.exit(0 if measured(given.seconds, given.cycle) else 1)
