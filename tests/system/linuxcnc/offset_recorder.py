"""Record every servo period of the offset machine, as a HAL component.

Each row of ``trace.bin`` is one period, as float64 in machine order: number of the period [1],
monotonic time at which it was fetched [s], then the pins of the sampler.
"""

import signal
import struct
import sys
import time
from pathlib import Path

import hal

SAMPLED = sys.argv[1]
ROW = struct.Struct(f"={len(SAMPLED) + 2}d")
PAUSE_S = 0.01


def main() -> None:
    """Follow the sampler until LinuxCNC ends."""
    ended: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: ended.append(number))
    component = hal.component("offset-recorder")
    component.ready()
    samples = hal.stream(component, hal.sampler_base, SAMPLED)
    with Path("trace.bin").open("wb") as trace:
        while not ended:
            while samples.readable:
                values = samples.read()
                trace.write(ROW.pack(samples.sampleno, time.monotonic(), *values))
            trace.flush()
            time.sleep(PAUSE_S)


if __name__ == "__main__":
    main()
