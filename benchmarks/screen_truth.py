"""Faults drawn at random; what the operator's page shows against what the machine itself knows.

``python -m benchmarks.screen_truth [COUNT] [SEED]`` makes the control unreachable, presses the
emergency stop, breaks sensors, kills and freezes loop and screen: some six seconds each. Each is
told as it has passed; the table at the end says how soon a page named them. Every contradiction is
printed, and the exit code is 1 if there is any.
"""

import argparse
import shutil
import tempfile
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

from tests.system.screen.truth import Trial, drawn, trial


def main() -> int:
    """Print what the pages showed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int, nargs="?", default=200)
    parser.add_argument("seed", type=int, nargs="?", default=1)
    given = parser.parse_args()
    began_s, told = time.monotonic(), 0
    with (
        tempfile.TemporaryDirectory() as folder,
        sync_playwright() as playwright,
        playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox"]
        ) as browser,
        trial(Path(folder), browser, given.seed) as seen,
    ):
        try:
            for number, name in enumerate(drawn(given.count, given.seed), 1):
                seen.suffer(name)
                seen.settle()
                took_s = time.monotonic() - began_s
                new = seen.contradictions[told:]
                told += len(new)
                print(f"{number} {name}, {took_s:.0f} s", *new, sep="\n  ", flush=True)
        finally:
            _tell(seen)
    return 1 if seen.contradictions else 0


def _tell(seen: Trial) -> None:
    print(f"{seen.looks} looks at a page, {seen.missed} without anything read")
    for name, times_s in seen.named_s.items():
        mean_s = sum(times_s) / len(times_s)
        print(f"{name}: {len(times_s)}, named in {mean_s:.1f} s, {max(times_s):.1f} s at most")
    print(f"contradictions: {len(seen.contradictions)}", *seen.contradictions, sep="\n  ")


if __name__ == "__main__":
    raise SystemExit(main())
