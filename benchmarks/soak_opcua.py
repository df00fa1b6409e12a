"""One loop at 10 Hz on a server that others wrote, with faults all the time.

``python -m benchmarks.soak_opcua [--minutes 60] [--seed 1]`` draws faults as ``loop_faults.py``
does, without killing the loop. A line is printed every minute; the exit code is 1 if a limit was
passed, a fault not told, a cycle not recorded, if the loop ended otherwise than asked, or if its
memory grew.
"""

import argparse
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from benchmarks.loop_load import family
from tests.system.opcua.faults import Trial, drawn, suffered
from tests.system.opcua.foreign_server import install

REST_S = 6.0
"""Time between two faults, in which it compensates. [s]"""
MOST_GROWTH_MB = 5.0
"""What the memory may grow over the second half. [MB]"""


def main() -> int:
    """Run, print, and return 1 if a promise is not kept."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0, help="how long (default: 60)")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    install()
    seen: list[tuple[float, float]] = []  # time of the processor [s] and memory [MB]
    began_s = time.monotonic()

    def names(tried: Trial) -> Iterator[str]:
        for count, name in enumerate(drawn(20_000, given.seed)):
            minutes = (time.monotonic() - began_s) / 60.0
            if minutes >= given.minutes:
                return
            if minutes >= len(seen):
                costs = family(tried.loop.popen.pid)
                seen.append((sum(c.cpu_s for c in costs), sum(c.memory_mb for c in costs)))
                print(f"{minutes:5.1f} min {count:5d} drawn", end=" ")
                print(f"{seen[-1][0]:7.1f} s of the processor {seen[-1][1]:6.1f} MB", flush=True)
            if name != "killed_loop":
                yield name
                time.sleep(REST_S)

    with tempfile.TemporaryDirectory() as folder:
        found = suffered(Path(folder), given.seed, names)
    growth_mb = seen[-1][1] - seen[len(seen) // 2][1]
    print(f"{len(found.happened)} faults, {found.writes} writes of an offset")
    print(f"largest step {found.largest_um:.2f} um, memory {growth_mb:+.1f} MB in the second half")
    print(f"breaches: {len(found.breaches)}", *found.breaches, sep="\n  ")
    return 1 if found.breaches or growth_mb > MOST_GROWTH_MB else 0


if __name__ == "__main__":
    raise SystemExit(main())
