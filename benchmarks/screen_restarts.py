"""The loop and the screen are ended again and again while a browser is open: it comes back itself.

Each of them is ended so many times, by SIGKILL and by SIGTERM in turn, at seeded moments, and
started again. The operator's page stays open in Chromium the whole time, and nobody touches it.
Told are, each as median and largest: how soon the page said NO DATA, and how soon after the start
it had fresh values again, the program's own start included. At the end its number has to move on.

    python benchmarks/screen_restarts.py [--times 20] [--seed 1]

Exit code 1 if the page did not come back once, said NO DATA too late, a program did not end when
it was told to, or something went wrong on the page.
"""

import argparse
import random
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from playwright.sync_api import Error as BrowserError, Page, sync_playwright

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from tests.in_time import in_time  # noqa: E402 - after the path
from tests.system.screen.stand import Rig, wait_until  # noqa: E402 - after the path

SOON_S: Final = 4.0
"""So soon at the latest the page says NO DATA. [s]"""
BACK_S: Final = 20.0
"""So soon at the latest it has fresh values after a start. [s]"""
DOWN_S: Final = (0.0, 8.0)
"""So long a program stays down, drawn evenly. [s]"""
SIGNALS: Final = (signal.SIGKILL, signal.SIGTERM)


@dataclass
class Found:
    """What was seen."""

    told_s: list[float] = field(default_factory=list[float])
    """Times from the end of a program to NO DATA, where it stayed down long enough. [s]"""
    back_s: list[float] = field(default_factory=list[float])
    """Times from the start of a program to fresh values. [s]"""
    failures: list[str] = field(default_factory=list[str])
    """What went wrong."""


def is_live(page: Page) -> bool:
    """Whether the page has fresh values; false while it loads."""
    try:
        return page.evaluate("document.body?.dataset.live") == "yes"
    except BrowserError:  # it loads itself again
        return False


def number_of(page: Page) -> int:
    """Return the loop's number that the page shows; -1 while it shows none."""
    try:
        text = str(page.locator("#beat-text").text_content(timeout=500) or "")
    except BrowserError:
        return -1
    digits = "".join(c if c.isdigit() else " " for c in text).split()
    return int(digits[0]) if digits else -1


def end(stand: Rig, name: str, number: signal.Signals) -> None:
    """End a program by a signal; one that does not end is killed, and told.

    Raises
    ------
    RuntimeError
        If it did not end within 30 s.
    """
    program = stand.programs.pop(name)
    program.signal(number)
    try:
        program.wait(30.0)
    except subprocess.TimeoutExpired:
        program.kill()
        raise RuntimeError(f"{name} did not end within 30 s after {number.name}") from None


def restart(stand: Rig, page: Page, name: str, number: signal.Signals, down_s: float) -> Found:
    """End and start one program, and see what the page does."""
    found = Found()
    since_s = time.monotonic()
    try:
        end(stand, name, number)
    except RuntimeError as error:
        found.failures.append(str(error))
        since_s = time.monotonic()
    try:
        if down_s > SOON_S:
            wait_until("NO DATA", lambda: not is_live(page))
            found.told_s.append(time.monotonic() - since_s)
            if not in_time(found.told_s[-1], SOON_S):
                found.failures.append(f"{name}: NO DATA after {found.told_s[-1]:.1f} s")
        time.sleep(max(0.0, since_s + down_s - time.monotonic()))
        began_s, before = time.monotonic(), number_of(page)
        if name == "run":
            stand.start_loop()
        else:
            stand.start_screen()
        # A page that never lost its values has to show a number that it had not before.
        wait_until("fresh values", lambda: is_live(page) and number_of(page) not in {-1, before})
        found.back_s.append(time.monotonic() - began_s)
        if not in_time(found.back_s[-1], BACK_S):
            found.failures.append(f"{name}: fresh values after {found.back_s[-1]:.1f} s")
    except AssertionError as error:
        found.failures.append(f"{name} after {number.name}, down for {down_s:.1f} s: {error}")
    return found


def tell(name: str, times_s: Sequence[float]) -> None:
    """Print the median and the largest of some times."""
    if times_s:
        median_s, largest_s = statistics.median(times_s), max(times_s)
        print(f"  {name:38} median {median_s:5.2f} s, largest {largest_s:5.2f} s")


def campaign(times: int, seed: int) -> list[str]:
    """Restart both so many times; print what was seen, and return what went wrong."""
    chance = random.Random(seed)  # noqa: S311 - repeatable
    failures: list[str] = []
    wrong: list[str] = []
    with (
        tempfile.TemporaryDirectory() as folder,
        Rig(Path(folder), view_without_login=True) as stand,
        sync_playwright() as playwright,
        playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox"]
        ) as browser,
    ):
        page = browser.new_page()
        page.on("pageerror", lambda error: wrong.append(f"on the page: {error}"))
        loads: list[str] = []
        page.on("load", lambda _: loads.append("load"))
        page.goto(stand.address)
        wait_until("fresh values", lambda: is_live(page))
        for name, words in (("run", "the loop"), ("screen", "the screen")):
            found = Found()
            loads.clear()
            for k in range(times):
                one = restart(stand, page, name, SIGNALS[k % 2], chance.uniform(*DOWN_S))
                found.told_s += one.told_s
                found.back_s += one.back_s
                found.failures += one.failures
                for failure in one.failures:
                    print(f"  FAILED, restart {k + 1}: {failure}")
            print(f"{words}: {times} restarts, {len(found.back_s)} times back by itself")
            tell("NO DATA so long after its end", found.told_s)
            tell("fresh values so long after its start", found.back_s)
            print(f"  the page loaded itself {len(loads)} times; by hand never")
            failures += found.failures
        before = number_of(page)
        try:
            wait_until("the number moves", lambda: number_of(page) >= before + 4)
        except AssertionError as error:
            failures.append(f"at the end: {error}")
    return failures + sorted(set(wrong))


def main() -> int:
    """Restart, print, and return 1 if anything went wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=20, help="of each program (default: 20)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the moments (default: 1)")
    arguments = parser.parse_args()
    began_s = time.monotonic()
    failures = campaign(arguments.times, arguments.seed)
    verdict = "kept" if not failures else f"NOT KEPT: {'; '.join(failures)}"
    print(f"the page recovers by itself every time: {verdict} ({time.monotonic() - began_s:.0f} s)")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
