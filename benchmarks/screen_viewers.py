"""Twenty people look at one machine for an hour: does the screen grow, does the loop come late?

Run from the project's folder: ``python -m benchmarks.screen_viewers --minutes 60``. Two viewers
are pages in a real browser, eighteen plain web-socket clients; the loop has a core of its own, and
the priority of its service file where the system lets us give it. Every minute a line is printed.
At the end every viewer must have got a message nearly every second, the memory of the screen must
have grown by less than 5 % after the first ten minutes, and 99 of 100 cycles must have begun less
than 20 ms late by the history's record; else the exit code is 1.
"""

import argparse
import asyncio
import contextlib
import json
import os
import shutil
import statistics
import sys
import tempfile
import threading
import time
from collections.abc import Generator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from playwright.sync_api import Page, sync_playwright
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from tests.system.screen.stand import Rig, wait_until
from thermaxis.runtime.history import HistoryReader

PLAIN, IN_BROWSER = 18, 2
MOST_GROWTH = 0.05
"""What the memory of the screen may grow after the warm-up. [1]"""
WARM_UP = 10.0 / 60.0
"""Share of the time in which it may grow as it likes: ten minutes of an hour. [1]"""
LATEST_S = 0.020
"""99 of 100 cycles begin less late than this. [s]"""
FEWEST = 0.98
"""Messages that every plain viewer gets, per second. [1/s]"""
NICE = -5
"""As in examples/machine/thermaxis.service."""
_PAGE_KB = os.sysconf("SC_PAGE_SIZE") / 1000.0 if hasattr(os, "sysconf") else 4.096
_TICKS_PER_S = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 100


@dataclass
class Viewers:
    """Plain web-socket clients in a thread of their own."""

    address: str
    """Where the screen is, as ``ws://host:port``."""
    origin: str
    """What a page of it would send as its origin."""
    counts: list[int] = field(default_factory=lambda: [0] * PLAIN)
    """Messages with a fresh status, by client. [1]"""
    broken: int = 0
    """Connections that were lost and made again. [1]"""
    stop: threading.Event = field(default_factory=threading.Event)

    def run(self) -> None:
        """Look until told to stop."""
        asyncio.run(self._run())

    async def _run(self) -> None:
        async with asyncio.TaskGroup() as group:
            for k in range(PLAIN):
                group.create_task(self._look(k))

    async def _look(self, k: int) -> None:
        while not self.stop.is_set():
            with contextlib.suppress(ConnectionClosed, OSError):
                async with connect(f"{self.address}/live", origin=self.origin) as socket:
                    await self._hear(socket, k)
            if not self.stop.is_set():
                self.broken += 1
                await asyncio.sleep(0.5)

    async def _hear(self, socket: object, k: int) -> None:
        while not self.stop.is_set():
            async with asyncio.timeout(30.0):
                message = await socket.recv()
            if json.loads(message)["kind"] == "status":
                self.counts[k] += 1


def memory_mb(pid: int) -> float:
    """Return the memory of a program that is in use. [MB]"""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * _PAGE_KB / 1000.0


def processor_s(pid: int) -> float:
    """Return the time that it has computed. [s]"""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS_PER_S


@contextlib.contextmanager
def looking(stand: Rig) -> Generator[tuple[Viewers, list[Page]]]:
    """Open every page and every connection."""
    viewers = Viewers(stand.address.replace("http", "ws", 1), stand.address)
    thread = threading.Thread(target=viewers.run)
    path = shutil.which("chromium") or shutil.which("chromium-browser")
    arguments = ["--no-sandbox"] if os.geteuid() == 0 else []
    with (
        sync_playwright() as playwright,
        playwright.chromium.launch(executable_path=path, args=arguments) as browser,
    ):
        pages = [browser.new_page() for _ in range(IN_BROWSER)]
        for page, where in zip(pages, ("/", "/sensors"), strict=True):
            page.goto(stand.address + where)
        thread.start()
        try:
            yield viewers, pages
        finally:
            viewers.stop.set()
            thread.join(40.0)


def lateness_s(stand: Rig, first: datetime, last: datetime) -> list[float]:
    """Return how late every cycle of a span began, by the history's own record. [s]"""
    with HistoryReader(f"sqlite:///{stand.folder / 'history.db'}") as reader:
        return reader.cycles(first, last, ["lateness_s"]).collect()["lateness_s"].to_list()


def watch(stand: Rig, minutes: float) -> bool:
    """Look for so long; return whether every promise was kept."""
    loop, screen = (stand.programs[name].popen.pid for name in ("run", "screen"))
    rows: list[tuple[float, float]] = []
    with looking(stand) as (viewers, pages):
        for page in pages:
            page.wait_for_selector("body[data-live=yes]", timeout=30_000)
        wait_until("every viewer is told something", lambda: all(viewers.counts), 60.0)
        began_s, first = time.monotonic(), datetime.now(UTC)
        before = list(viewers.counts)
        computed_s = processor_s(screen), processor_s(loop)
        step_s = min(60.0, 6.0 * minutes)
        while (elapsed_s := time.monotonic() - began_s) < 60.0 * minutes:
            time.sleep(min(step_s, 60.0 * minutes - elapsed_s))
            rows.append((time.monotonic() - began_s, memory_mb(screen)))
            fresh = [page.locator("body").get_attribute("data-live") == "yes" for page in pages]
            print(
                f"{rows[-1][0] / 60.0:6.1f} min  screen {rows[-1][1]:6.1f} MB,"
                f" loop {memory_mb(loop):6.1f} MB; messages {min(viewers.counts)} to"
                f" {max(viewers.counts)}, pages fresh {sum(fresh)} of {len(pages)},"
                f" connections lost {viewers.broken}",
                flush=True,
            )
        seconds = time.monotonic() - began_s
        rates = [(n - b) / seconds for n, b in zip(viewers.counts, before, strict=True)]
        shares = [
            (processor_s(pid) - was) / seconds
            for pid, was in zip((screen, loop), computed_s, strict=True)
        ]
        last = datetime.now(UTC)
    late = lateness_s(stand, first, last)
    return told(rows, rates, shares, late, viewers.broken + fresh.count(False))


def told(
    rows: list[tuple[float, float]],
    rates: list[float],
    shares: list[float],
    late: list[float],
    lost: int,
) -> bool:
    """Print what came of it; return whether every promise was kept."""
    warm = [mb for s, mb in rows if s >= WARM_UP * rows[-1][0]]
    growth = warm[-1] / warm[0] - 1.0
    worst_s = statistics.quantiles(late, n=100)[98]
    verdicts = {
        f"memory of the screen {warm[0]:.1f} to {warm[-1]:.1f} MB, {100 * growth:+.2f} %"
        f" (at most {100 * MOST_GROWTH:.0f} %)": growth < MOST_GROWTH,
        f"cycles {len(late)}, late by {1e3 * statistics.median(late):.1f} ms (median),"
        f" {1e3 * worst_s:.1f} ms (99 of 100; at most {1e3 * LATEST_S:.0f} ms),"
        f" {1e3 * max(late):.0f} ms (worst)": worst_s < LATEST_S,
        f"messages per second, fewest of {len(rates)} plain viewers: {min(rates):.3f}"
        f" (at least {FEWEST})": min(rates) >= FEWEST,
        f"connections lost or pages not fresh: {lost}": lost == 0,
    }
    for text, kept in verdicts.items():
        print(f"{'kept  ' if kept else 'BROKEN'} {text}")
    print(f"of a core: screen {100 * shares[0]:.1f} %, loop {100 * shares[1]:.1f} %")
    return all(verdicts.values())


def main() -> int:
    """Run, print, and return 1 if a promise is not kept."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0, help="how long (default: 60)")
    parser.add_argument("--core", type=int, default=os.cpu_count() - 1, help="the loop's core")
    arguments = parser.parse_args()
    others = set(range(os.cpu_count() or 1)) - {arguments.core} or {0}
    with tempfile.TemporaryDirectory() as folder:
        stand = Rig(Path(folder), view_without_login=True)
        try:
            stand.start_lathe()
            os.sched_setaffinity(stand.programs["machine"].popen.pid, others)
            stand.start_loop("--enable", cores=(arguments.core,))
            with contextlib.suppress(PermissionError):
                os.setpriority(os.PRIO_PROCESS, stand.programs["run"].popen.pid, NICE)
            stand.start_screen(cores=tuple(others))
            os.sched_setaffinity(0, others)
            load = ", ".join(f"{one:.1f}" for one in os.getloadavg())
            print(f"loop on core {arguments.core}; load average {load}", flush=True)
            return 0 if watch(stand, arguments.minutes) else 1
        finally:
            stand.end()


if __name__ == "__main__":
    sys.exit(main())
