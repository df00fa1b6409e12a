"""How fast the history page opens a month at one cycle a second, and what it costs the screen.

The historian's own writer records one day of a machine with eight channels and four outputs; the
days after it are copies of its files, at later times, and an hour follows as rows.
``thermaxis screen`` serves the history without a loop, and a headless Chromium opens it: the time
counts from the click to the frame in which the chart stands.

    python benchmarks/screen_trend.py [--days 30] [--browser PATH] [--keep FILE]
"""

import argparse
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any
from urllib.parse import urlencode
from urllib.request import urlopen

from historian import BEGIN, write_month
from playwright.sync_api import Page, sync_playwright

ROOT = Path(__file__).resolve().parents[1]
EXAMPLE = ROOT / "examples" / "machine"
PROMISE_S = 2.0
TIMES = 5
ASKED = 200
SERIES = ("Z_correction_um", "Z0_correction_um", "T_00_C", "T_01_C")
CLICK = """(button) => new Promise((drawn) => {
  const chart = document.getElementById("chart");
  const begun = performance.now();
  new MutationObserver((_, watch) => {
    watch.disconnect();
    requestAnimationFrame(() => requestAnimationFrame(() => drawn(performance.now() - begun)));
  }).observe(chart, { attributeFilter: ["data-drawn"] });
  button.click();
})"""


def write_machine(folder: Path, history: Path) -> Path:
    """Write the example's configuration with this history and a page that everybody may see."""
    shutil.copytree(EXAMPLE / "models", folder / "models")
    text = (EXAMPLE / "lathe.toml").read_text(encoding="utf-8")
    text = text.partition("[screen]")[0].replace("lathe.history.db", str(history))
    path = folder / "machine.toml"
    path.write_text(f"{text}[screen]\nport = 0\nview_without_login = true\n", encoding="utf-8")
    return path


@contextmanager
def screen(machine: Path) -> Iterator[tuple[str, int]]:
    """Serve the pages; give their address and the program's number."""
    words = [sys.executable, "-m", "thermaxis", "screen", str(machine)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as program:
        try:
            line = next(line for line in program.stdout or () if "http" in line)
            yield next(word for word in line.split() if word.startswith("http")), program.pid
        finally:
            program.terminate()


def rss_mb(pid: int) -> float:
    """Return the memory that a program holds. [MB]"""
    text = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    return int(text.partition("VmRSS:")[2].split()[0]) * 1024 / 1e6


def asked(address: str, days: float, end: datetime) -> tuple[float, int]:
    """Return how long a question takes [s] and how large its answer is. [byte]"""
    span = {"first": (end - timedelta(days=days)).isoformat(), "last": end.isoformat()}
    words = urlencode([*span.items(), ("points", "1000"), *(("names", name) for name in SERIES)])
    begun_s = time.monotonic()
    with urlopen(f"{address}history/trend?{words}") as answer:  # noqa: S310 - our own server
        size = len(answer.read())
    return time.monotonic() - begun_s, size


def clicked(page: Page, hours: int) -> float:
    """Return the time from a click on a length to the drawn chart. [s]"""
    button: Any = page.locator(f"#lengths button[data-hours='{hours}']")
    return float(button.evaluate(CLICK)) / 1e3


def look(address: str, browser: str) -> dict[str, list[float]]:
    """Open the page in a browser and return the times by what was done. [s]"""
    found: dict[str, list[float]] = {"the page with 8 hours": [], "30 days": [], "1 day": []}
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=browser, args=["--no-sandbox"])
        page = chromium.new_page(viewport={"width": 1280, "height": 800})
        for _ in range(TIMES):
            page.goto(f"{address}probe")
            begun_s = time.monotonic()
            page.click("nav a[href='/history']")
            page.wait_for_selector("#chart[data-drawn]")
            found["the page with 8 hours"].append(time.monotonic() - begun_s)
            found["30 days"].append(clicked(page, 720))
            found["1 day"].append(clicked(page, 24))
        chromium.close()
    return found


def main() -> int:
    """Measure, print, and return 1 if the month takes too long."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--days", type=int, default=30)
    parser.add_argument("--browser", default=shutil.which("chromium") or "chromium")
    parser.add_argument("--keep", type=Path, help="history of an earlier run, or where to keep it")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = (arguments.keep or folder / "month.db").resolve()
        if not path.exists():
            begun_s = time.monotonic()
            _, size = write_month(path, arguments.days)
            took_s = time.monotonic() - begun_s
            print(f"{arguments.days} days: {took_s:.0f} s, {size:.0f} bytes a cycle")
        with screen(write_machine(folder, path)) as (address, pid):
            end = BEGIN.astimezone(UTC) + timedelta(days=arguments.days, hours=1)
            for days in (1.0 / 24.0, 1.0, 7.0, float(arguments.days)):
                times, sizes = zip(*(asked(address, days, end) for _ in range(TIMES)), strict=True)
                print(f"server, {days:5.2f} days: {statistics.median(times):.3f} s,", end=" ")
                print(f"at most {max(times):.3f} s, {sizes[0] / 1e3:.0f} kB")
            before_mb = rss_mb(pid)
            for _ in range(ASKED):
                asked(address, 30.0, end)
            print(f"memory: {before_mb:.1f} MB, {rss_mb(pid):.1f} MB after {ASKED} questions")
            found = look(address, arguments.browser)
    for what, times in found.items():
        print(f"browser, {what}: {statistics.median(times):.2f} s, at most {max(times):.2f} s")
    slowest_s = max(found["30 days"])
    print(f"click to drawn month: {slowest_s:.2f} s of at most {PROMISE_S:g} s")
    return 0 if slowest_s <= PROMISE_S else 1


if __name__ == "__main__":
    sys.exit(main())
