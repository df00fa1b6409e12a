"""Commands of thermaxis in programs of their own, and what their history must hold."""

import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final, NamedTuple

from tests.in_time import LONGEST_S
from thermaxis.compensation import SupervisorState
from thermaxis.runtime.history import HistoryReader

KILLED_WITH_US: Final = ("setpriv", "--pdeathsig", "KILL")


class Said(NamedTuple):
    """A line that a program printed."""

    at_s: float
    """When it was read, monotonic. [s]"""
    text: str
    """The line."""


class Program:
    """A command of thermaxis in a program of its own.

    Parameters
    ----------
    arguments : sequence
        Command and arguments.
    folder : Path
        Where its errors are kept.
    """

    def __init__(self, arguments: Sequence[str | Path], folder: Path) -> None:
        self.errors = folder / f"{arguments[0]}.errors"
        self.began_s = time.monotonic()
        with self.errors.open("ab") as errors:
            self.popen = subprocess.Popen(
                [*KILLED_WITH_US, sys.executable, "-m", "thermaxis", *arguments],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=errors,
                env={**os.environ, "OMP_NUM_THREADS": "1"},
            )
        self.said: list[Said] = []
        self._lines: queue.SimpleQueue[Said | None] = queue.SimpleQueue()
        self._deaf = False
        self._reader = threading.Thread(target=self._listen, daemon=True)
        self._reader.start()

    def _listen(self) -> None:
        assert self.popen.stdout is not None
        with self.popen.stdout as lines:
            for line in lines:
                self._lines.put(Said(time.monotonic(), line.decode("utf-8", "replace").rstrip()))
                if self._deaf:
                    break
        self._lines.put(None)

    def stop_reading(self) -> None:
        """Read one more line, and then no more: whoever prints meets a broken pipe."""
        self._deaf = True

    def wait_for(self, text: str, limit_s: float) -> Said:
        """Return the next line that holds a text.

        Raises
        ------
        RuntimeError
            If it does not come in time, or the program ends.
        """
        until_s = time.monotonic() + limit_s
        while True:
            try:
                said = self._lines.get(timeout=max(0.0, until_s - time.monotonic()))
            except queue.Empty:
                raise RuntimeError(f"no '{text}' in {limit_s:g} s: {self.tail()}") from None
            if said is None:
                raise RuntimeError(f"it has ended without '{text}': {self.tail()}")
            self.said.append(said)
            if text in said.text:
                return said

    def wait_for_state(self, state: SupervisorState, limit_s: float) -> Said:
        """Return the next line that tells a state."""
        return self.wait_for(f"Z {state}", limit_s)

    def wait_to_stay(self, state: SupervisorState, still_s: float, limit_s: float) -> None:
        """Wait until the state told last is the one that is wanted, and none follows for a while.

        A loop on a busy computer may leave a state once more soon after it came to it.

        Raises
        ------
        RuntimeError
            If that does not come in time, or the program ends.
        """
        until_s = time.monotonic() + limit_s
        while time.monotonic() < until_s:
            try:
                said = self._lines.get(timeout=still_s)
            except queue.Empty:
                told = [line.text for line in self.said if "correction:" in line.text]
                if told and f"Z {state}" in told[-1]:
                    return
                continue
            if said is None:
                raise RuntimeError(f"it has ended: {self.tail()}")
            self.said.append(said)
        raise RuntimeError(f"does not stay {state} within {limit_s:g} s: {self.tail()}")

    def state(self) -> str:
        """Return the state that the loop told last; empty for none.

        Raises
        ------
        RuntimeError
            If it has ended.
        """
        while not self._lines.empty():
            said = self._lines.get()
            if said is None:
                raise RuntimeError(f"it has ended: {self.tail()}")
            self.said.append(said)
        words = [line.text.split()[1:2] for line in self.said if "correction:" in line.text]
        return words[-1][0].rstrip(";") if words else ""

    def tail(self) -> str:
        """Return what it said last."""
        printed = "\n".join(line.text for line in self.said[-10:])
        return f"{printed}\n{self.errors.read_text(encoding='utf-8', errors='replace')[-3000:]}"

    def signal(self, number: signal.Signals) -> float:
        """Send a signal; return when. [s]"""
        self.popen.send_signal(number)
        return time.monotonic()

    def kill(self) -> float:
        """End it at once (SIGKILL); return when. [s]"""
        at_s = self.signal(signal.SIGKILL)
        self.end()
        return at_s

    def stop(self, limit_s: float) -> int:
        """Ask it to end (SIGTERM) and return its exit code."""
        self.signal(signal.SIGTERM)
        return self.wait(limit_s)

    def wait(self, limit_s: float) -> int:
        """Wait for its end and return the exit code."""
        code = self.popen.wait(limit_s)
        self.end()
        return code

    def end(self) -> None:
        """End it, whatever it does."""
        if self.popen.poll() is None:
            self.popen.kill()
            self.popen.wait(LONGEST_S)
        self._reader.join(10.0)
        while not self._lines.empty():
            line = self._lines.get()
            if line is not None:
                self.said.append(line)


@contextmanager
def compensating(configuration: Path, *options: str) -> Generator[Program]:
    """Run the loop; it is ended at the end at the latest."""
    program = Program(["run", configuration, *options], configuration.parent)
    try:
        yield program
    finally:
        program.end()


class Recorded(NamedTuple):
    """What a history says of a cycle."""

    number: int
    """Number of the cycle. [1]"""
    monotonic_s: float
    """Monotonic time. [s]"""
    state: SupervisorState
    """State of the compensation."""
    written: bool
    """Whether anything was written to the machine."""
    correction_um: tuple[float, ...]
    """What was in force. [um]"""


def recorded_cycles(path: Path) -> list[Recorded]:
    """Return the cycles of a history, in the order of recording."""
    with HistoryReader(f"sqlite:///{path}") as reader:
        found = reader.cycles().collect()
    ends = ("_correction_um", "_commanded_um")
    corrections, commanded = ([n for n in found.columns if n.endswith(end)] for end in ends)
    return [
        Recorded(
            row["number"],
            row["monotonic_s"],
            SupervisorState(row["state"]),
            any(row[name] is not None for name in commanded),
            tuple(row[name] for name in corrections),
        )
        for row in found.iter_rows(named=True)
    ]


def gaps(cycles: Sequence[Recorded]) -> list[int]:
    """Return the numbers that are missing between 1 and the last one."""
    numbers = {cycle.number for cycle in cycles}
    return sorted(set(range(1, max(numbers, default=0) + 1)) - numbers)
