"""Whether a control that takes offsets over late is ever taken for another writer.

``python -m benchmarks.loop_takeover`` compensates a shift of eight hours at ten cycles a second in
virtual time, for each way in which a control may take an offset over, with the steps of the loop
itself. Every mismatch that is told there is a false one.
"""

import sys

from tests.unit.runtime.simulated import compensation
from tests.unit.runtime.taking_over import LateControl, compensate
from thermaxis.compensation import Limits

HOURS = 8.0
LATE_S = (0.05, 0.2, 0.5, 1.0, 1.5)


def main() -> None:
    """Print a row for every control."""
    hours = float(sys.argv[1]) if len(sys.argv) > 1 else HOURS
    print(f"{hours:g} h at 10 Hz, 2 um/s, 60 um; told = mismatches, all of them false")
    print("late [s]  copies     ramp [um/s]  follows [s]  tenths  told  states             waited")
    plant = compensation(cycle_s=0.1, limits=Limits(60.0, 2.0))
    for late_s in LATE_S:
        for sampled in (True, False):
            for ramp, follow_s, tenths in ((float("inf"), 0.0, True), (0.5, 2.0, True)):
                control = LateControl(late_s, sampled, ramp, follow_s, tenths)
                shift = compensate(plant, control, hours)
                print(
                    f"{late_s:8.2f}  {'present' if sampled else 'all, late':9s}  {ramp:11g}"
                    f"  {follow_s:11g}  {tenths!s:6s}  {len(shift.told):4d}"
                    f"  {'/'.join(sorted(shift.states)):18s}"
                    f" {shift.stale / (36000.0 * hours):6.1%}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
