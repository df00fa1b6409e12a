"""The loop is killed (SIGKILL) at random moments: what the machine saw, what the history lost.

It compensates a virtual lathe, which a second client watches twenty times a second. Half of the
kills with a machine that keeps its offset, half with one whose watchdog takes it back after two
seconds. The moments are seeded, from the program's start to the midst of its work.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from tests.system.loop_stand import broken_promises, campaign, judge  # noqa: E402 - after the path


def main() -> int:
    """Kill, judge, print, and return 1 if a promise is not kept."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=100, help="kills altogether (default: 100)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the moments (default: 1)")
    arguments = parser.parse_args()
    kept = True
    for watchdog in ("off", "2s"):
        began_s = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            kills = arguments.kills // 2
            seen = campaign(Path(folder), kills, watchdog=watchdog, seed=arguments.seed)
        found = judge(seen)
        print(f"the machine's watchdog: {watchdog}; {time.monotonic() - began_s:.0f} s")
        for name, value in found._asdict().items():
            shown = f"{value:.3f}" if isinstance(value, float) else value
            print(f"  {name:22} {shown}")
        broken = broken_promises(found)
        print(f"  last run ended with    {seen.exit_code}")
        for sentence, value in broken.items():
            print(f"  NOT KEPT: {sentence}: {value}")
        kept &= not broken and seen.exit_code == 0
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
