"""Thirty simulated days of the loop at one second: does its memory grow?

    python benchmarks/thirty_days.py [--days 30] [--history FOLDER]

The real loop runs in virtual time against a machine in memory whose temperatures follow a day,
whose sensors fail and whose connection is lost now and then. With --history every cycle goes into
the real historian as well, with three days of retention. Printed: memory after every day, and its
growth from the second day to the last.
"""

import argparse
import asyncio
import math
import sys
import time
from collections.abc import Mapping
from pathlib import Path

from thermaxis.compensation import (
    Compensation,
    CompensationModel,
    Limits,
    Output,
    Part,
    Request,
    RequestKind,
    Section,
    SensorRules,
)
from thermaxis.runtime import (
    NOT_READ,
    AtStop,
    Clock,
    CompensationLoop,
    Historian,
    LoopSettings,
    Ports,
    RuntimeStatus,
    Source,
    SourceSample,
    VirtualClock,
    run_in_virtual_time,
)
from thermaxis.runtime.history import HistorianSettings, NoHistorian, SqlHistorian
from thermaxis.runtime.sinks import DrySink

DAY_S = 86_400.0
MOST_GROWTH_KB = 1024


def resident_kb() -> int:
    """Return the memory that the program holds, in kB."""
    for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1])
    return 0


class Day(Source):
    """Two temperatures of a day, with faults."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock

    async def open(self) -> None:
        """Begin."""

    @property
    def connected(self) -> bool:
        """Lost for half a minute every two hours."""
        return self.clock.monotonic_s() % 7000.0 > 30.0

    async def read(self, deadline_s: float) -> Mapping[str, SourceSample]:  # noqa: ARG002 - as its port has it
        """Read both; the spindle's sensor fails for 20 s every quarter of an hour."""
        now_s = self.clock.monotonic_s()
        if not self.connected:
            return {"s": NOT_READ, "c": NOT_READ}
        rise = 8.0 - 8.0 * math.cos(2.0 * math.pi * now_s / DAY_S)
        spindle = SourceSample(round(20.0 + rise, 1), good=now_s % 900.0 > 20.0)
        return {"s": spindle, "c": SourceSample(20.0 + 0.1 * (now_s % 3.0), good=True)}

    async def close(self) -> None:
        """End."""


def historian(folder: Path | None, clock: Clock) -> Historian:
    if folder is None:
        return NoHistorian()
    folder.mkdir(parents=True, exist_ok=True)
    url = f"sqlite:///{(folder / 'thirty_days.db').absolute()}"
    return SqlHistorian(HistorianSettings(url=url, retention_days=3), clock)


async def play(days: int, folder: Path | None) -> list[int]:
    clock, memory_kb = VirtualClock(), []
    section = Section(12.0, 1800.0)
    model = CompensationModel(
        outputs=(Output("Z_um", (Part("spindle", "s", "c", 2.0, (section,)),)),)
    )
    compensation = Compensation(
        model=model,
        sensors={name: SensorRules(lowest_c=1.0, highest_c=90.0) for name in model.channels},
        limits={"Z_um": Limits(400.0, 0.5)},
    )
    keeper = historian(folder, clock)
    loop = CompensationLoop(
        compensation,
        LoopSettings(machine="m", model_file="m", model_sha256="", at_stop=AtStop.LEAVE),
        Ports(Day(clock), DrySink(("Z_um",)), keeper, clock),
    )
    begin = time.perf_counter()

    def see(status: RuntimeStatus) -> None:
        if status.number % int(DAY_S) == 0:
            memory_kb.append(resident_kb())
            sys.stdout.write(
                f"day {len(memory_kb):3d}: {memory_kb[-1]} kB, {status.output.state},"
                f" {time.perf_counter() - begin:.0f} s, waiting {status.historian.waiting}\n"
            )
            sys.stdout.flush()

    loop.listeners.append(see)
    running = asyncio.ensure_future(loop.run(asyncio.Event(), int(days * DAY_S)))
    await loop.submit(Request(RequestKind.ENABLE, "benchmark"))
    await running
    return memory_kb


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--days", type=int, default=30)
    parser.add_argument("--history", type=Path)
    arguments = parser.parse_args()
    memory_kb = run_in_virtual_time(play(arguments.days, arguments.history))
    growth_kb = memory_kb[-1] - memory_kb[min(1, len(memory_kb) - 1)]
    print(f"growth from the second day to day {len(memory_kb)}: {growth_kb} kB")
    return 0 if growth_kb <= MOST_GROWTH_KB else 1


if __name__ == "__main__":
    sys.exit(main())
