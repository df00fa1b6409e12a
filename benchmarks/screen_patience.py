"""How soon the screen's feed is connected to a busy computer's loop, by how long it waits.

A lathe and its loop run with users, whose passwords are slow to check by design. Busy programs
are started beside them, all of one priority, and the feed of a screen connects anew and anew: with
a patience of 1 s for an answer, and with that of the program. Whoever gives up too soon logs in
again, and lets the loop check the same password once more.

    python benchmarks/screen_patience.py [--busy 10] [--times 3]

Told are, for each patience, the times from the feed's start to its first status. It ends within
three minutes; a feed that was not connected by the end of its part is told as later than that.
Exit code 1 if the program's own patience did not connect every time.
"""

import argparse
import asyncio
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from tests.system.screen.stand import Rig  # noqa: E402 - after the path
from thermaxis.runtime import (  # noqa: E402 - found by the line before
    SystemClock,
    read_machine,
)
from thermaxis.screen.feed import PATIENCE_S, StatusFeed  # noqa: E402 - after the path

SHORT_S: Final = 1.0
"""The patience of a connection that is not told otherwise. [s]"""
PART_S: Final = 65.0
"""So long each patience is tried at most. [s]"""
LONGEST_S: Final = 180.0
"""A busy program ends by itself after so long. [s]"""
LOOK_S: Final = 0.05
"""The feed is looked at so often. [s]"""


@contextmanager
def busy(count: int) -> Generator[None]:
    """Let so many programs compute, each as much as it gets."""
    text = f"import time\nend = time.monotonic() + {LONGEST_S}\nwhile time.monotonic() < end: pass"
    programs = [subprocess.Popen([sys.executable, "-c", text]) for _ in range(count)]
    try:
        yield
    finally:
        for program in programs:
            program.kill()
        for program in programs:
            program.wait()


async def connected_after_s(stand: Rig, patience_s: float, limit_s: float) -> float | None:
    """Return how long a new feed took to its first status, None where it took too long. [s]"""
    configuration = read_machine(stand.configuration)
    settings = configuration.screen
    if settings is None:
        raise RuntimeError("the stand has no screen")
    connection = configuration.screen_connection(settings.user, settings.password)
    feed = StatusFeed(connection, SystemClock(), patience_s=patience_s)
    began_s = time.monotonic()
    await feed.open()
    try:
        while not feed.latest.live:
            if time.monotonic() - began_s > limit_s:
                return None
            await asyncio.sleep(LOOK_S)
        return time.monotonic() - began_s
    finally:
        await feed.close()


def tried(stand: Rig, patience_s: float, times: int) -> list[float | None]:
    """Connect so many times with one patience, as far as the time of the part allows. [s]"""
    end_s = time.monotonic() + PART_S
    found: list[float | None] = []
    for _ in range(times):
        left_s = end_s - time.monotonic()
        if left_s <= 0.0:
            break
        found.append(asyncio.run(connected_after_s(stand, patience_s, left_s)))
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--busy", type=int, default=10, help="busy programs")
    parser.add_argument("--times", type=int, default=3, help="connections with each patience")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, Rig(Path(folder)) as stand:
        stand.programs.pop("screen").end()
        for program in stand.programs.values():  # the stand lets them go before others
            with suppress(PermissionError):
                os.setpriority(os.PRIO_PROCESS, program.popen.pid, 0)
        print(f"{asked.busy} busy programs on {os.cpu_count()} cores")
        with busy(asked.busy):
            found = {
                patience_s: tried(stand, patience_s, asked.times)
                for patience_s in (SHORT_S, PATIENCE_S)
            }
    for patience_s, times_s in found.items():
        said = ", ".join("not in time" if t is None else f"{t:.1f} s" for t in times_s)
        print(f"patience {patience_s:g} s: connected after {said}")
    own = found[PATIENCE_S]
    return 0 if len(own) == asked.times and None not in own else 1


if __name__ == "__main__":
    sys.exit(main())
