"""Faults drawn at random against the running loop and an OPC UA server that others wrote.

``python benchmarks/loop_faults.py [COUNT] [SEED]`` breaks sensors, network, server, PLC and the
loop itself, and lets others write the offset. The server writes down every write together with
where the offset stood just before: the table says how far the largest step went, beside what the
rate allows, and of which fault the history does not tell.
"""

import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from tests.system.opcua.faults import Happened, allowed_um, drawn, steps_of, trial, untold
from tests.system.opcua.foreign_server import install


def main() -> None:
    """Print what the machine saw."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    install()
    began_s = time.monotonic()
    happened: list[Happened] = []
    with tempfile.TemporaryDirectory() as name, trial(Path(name), seed) as tried:
        for fault in drawn(count, seed):
            happened.append(tried.suffer(fault))
            if len(happened) % 20 == 0:
                print(len(happened), steps_of(tried.machine.record_path), flush=True)
        code = tried.loop.stop(90.0)
        steps = steps_of(tried.machine.record_path)
        missing = untold(Path(name), happened)
    print(f"{len(happened)} faults in {(time.monotonic() - began_s) / 60.0:.0f} min, exit {code}")
    print(", ".join(f"{n} {k}" for k, n in sorted(Counter(h.name for h in happened).items())))
    print(f"{steps.writes} writes, largest step {steps.largest_um:.2f} um of {allowed_um():.2f}")
    print(f"beyond the largest magnitude by {steps.beyond_um:.2f} um")
    print(f"largest step of a write after the watchdog had tripped {steps.late_um:.2f} um")
    print(f"not told: {len(missing)}")
    for one in missing:
        print(f"  {one}")


if __name__ == "__main__":
    main()
