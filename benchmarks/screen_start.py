"""When the operator's page tells the state and draws its trend, and what it weighs.

A virtual lathe, its loop and its screen are begun from this project's folder and, if one is
stated, from that of a former version beside it; a headless Chromium opens the pages by turns. Times
count from the address to the first status, and to the trend, by the page's own clock; `again` is a
second visit with what the browser has kept. The exit code is 1 where an aim is missed.

    python benchmarks/screen_start.py [--former FOLDER] [--times 5] [--browser PATH]
"""

import argparse
import os
import shutil
import statistics
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple

from playwright.sync_api import Browser, sync_playwright

ROOT = Path(__file__).resolve().parents[1]
AIMS_S = {1: 1.0, 6: 3.0}
"""Time to the state, by how many times slower the browser's processor is made. [s]"""
AIM_KB = 300.0
"""What the page may weigh. [kB]"""
LONGEST_MS = 120_000
WATCH = """
window.seen = {};
new MutationObserver(() => {
  if (document.body?.dataset.live === "yes") seen.live ??= performance.now();
  if (document.querySelector("#trend svg")) seen.trend ??= performance.now();
}).observe(document, { subtree: true, childList: true, attributes: true });
"""


class Visit(NamedTuple):
    """What one visit has cost."""

    live_s: float
    """Until the state is told. [s]"""
    trend_s: float
    """Until the trend is drawn. [s]"""
    kb: float
    """What came over the wire. [kB]"""
    requests: int
    """Requests. [1]"""


@contextmanager
def screen(folder: Path) -> Iterator[str]:
    """Begin a lathe, its loop and its screen from a project's folder; give the page's address."""
    words = [sys.executable, "-m", "tests.system.screen.stand", "--view-without-login"]
    paths = os.pathsep.join(str(path) for path in (folder / "src", folder))
    environment = os.environ | {"PYTHONPATH": paths}
    with subprocess.Popen(
        words, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True
    ) as program:
        try:
            line = program.stdout.readline().split() if program.stdout else []
            if not line:
                raise RuntimeError(f"no screen began from {folder}")
            yield line[1]
        finally:
            program.terminate()


def visits(browser: Browser, address: str, slower: int) -> list[Visit]:
    """Open the page in a browser that knows nothing of it, and once more."""
    context = browser.new_context(viewport={"width": 1024, "height": 600})
    context.add_init_script(WATCH)
    page = context.new_page()
    session = context.new_cdp_session(page)
    session.send("Network.enable")
    session.send("Emulation.setCPUThrottlingRate", {"rate": slower})
    sizes: list[float] = []
    session.on("Network.loadingFinished", lambda told: sizes.append(told["encodedDataLength"]))
    found = []
    for _ in range(2):
        sizes.clear()
        page.goto(address)
        page.wait_for_selector('body[data-live="yes"]', timeout=LONGEST_MS)
        page.wait_for_selector("#trend svg", state="attached", timeout=LONGEST_MS)
        page.wait_for_load_state("networkidle")
        seen = page.evaluate("seen")
        times = (1e-3 * seen["live"], 1e-3 * seen["trend"])
        found.append(Visit(*times, 1e-3 * sum(sizes), len(sizes)))
    context.close()
    return found


def main() -> int:
    """Measure, print a table, and judge this version by the aims."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--former", type=Path, help="folder of a former version of the project")
    parser.add_argument("--times", type=int, default=5, help="visits of each (default: 5)")
    parser.add_argument("--browser", default=shutil.which("chromium"), help="default: chromium")
    arguments = parser.parse_args()
    folders = {"now": ROOT} | ({"former": arguments.former} if arguments.former else {})
    missed = False
    with ExitStack() as stack:
        addresses = {name: stack.enter_context(screen(path)) for name, path in folders.items()}
        playwright = stack.enter_context(sync_playwright())
        browser = playwright.chromium.launch(
            executable_path=arguments.browser, args=["--no-sandbox"]
        )
        stack.callback(browser.close)
        print(f"{'':24}{'state [s]':>12}{'trend [s]':>12}{'weight [kB]':>14}{'requests':>10}")
        for slower, aim_s in AIMS_S.items():
            seen: dict[str, list[list[Visit]]] = {name: [] for name in folders}
            for _ in range(arguments.times):
                for name, address in addresses.items():
                    seen[name].append(visits(browser, address, slower))
            for name, both in seen.items():
                for k, which in enumerate(("", ", again")):
                    middle = Visit(
                        *map(statistics.median, zip(*(one[k] for one in both), strict=True))
                    )
                    label = f"{slower} x, {name}{which}"
                    print(
                        f"{label:24}{middle.live_s:12.2f}{middle.trend_s:12.2f}"
                        f"{middle.kb:14.0f}{middle.requests:10.0f}",
                        flush=True,
                    )
                    missed |= name == "now" and (middle.live_s > aim_s or middle.kb > AIM_KB)
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())
