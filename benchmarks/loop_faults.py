"""Faults drawn at random against running loops and OPC UA servers that others wrote.

``python -m benchmarks.loop_faults [COUNT] [SEED] [MACHINES]`` breaks sensors, network, server, PLC
and the loop itself, and lets others write the offset. The table says how far the largest step
went, beside what the rate allows, and what the history does not tell; the exit code is 1 if
anything was broken.
"""

import argparse
import tempfile
import time
from collections import Counter
from pathlib import Path

from tests.system.opcua.faults import LONGEST_STEP_S, RULES, campaign
from tests.system.opcua.foreign_server import install


def main() -> int:
    """Print what the machines saw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int, nargs="?", default=200)
    parser.add_argument("seed", type=int, nargs="?", default=1)
    parser.add_argument("machines", type=int, nargs="?", default=4, help="side by side")
    given = parser.parse_args()
    install()
    began_s = time.monotonic()
    with tempfile.TemporaryDirectory() as name:
        every = campaign(Path(name), given.count, given.seed, given.machines)
    drawn = Counter(one.name for judged in every for one in judged.happened)
    breaches = [breach for judged in every for breach in judged.breaches]
    late_um = RULES.rate_um_per_s * LONGEST_STEP_S
    unknown_um = [um for one in every for um in one.unknown_um]
    print(f"{drawn.total()} faults in {(time.monotonic() - began_s) / 60.0:.1f} min")
    print(", ".join(f"{n} {name}" for name, n in sorted(drawn.items())))
    print(f"{sum(one.writes for one in every)} writes of an offset; a late cycle: {late_um:g} um")
    print(f"largest step {max(one.largest_um for one in every):.2f} um")
    print(f"ahead of the rate by {max(one.ahead_um for one in every):.2f} um")
    print(f"beyond the largest magnitude by {max(one.beyond_um for one in every):.2f} um")
    print(f"larger while something else moved the offset: {len(unknown_um)} writes,", end=" ")
    print(f"{max(unknown_um, default=0.0):.2f} um")
    print(f"history lost by a kill {max(one.lost_s for one in every):.2f} s")
    print(f"breaches: {len(breaches)}", *breaches, sep="\n  ")
    return 1 if breaches else 0


if __name__ == "__main__":
    raise SystemExit(main())
