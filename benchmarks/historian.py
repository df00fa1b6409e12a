"""What the historian costs: per cycle, on the disk, in memory, and for a chart of a month.

The cost of a cycle is measured in real time at 10 Hz, as the loop has it: CPU of the whole program
with the historian less that of the same program without it. The month is written as fast as it
goes and then asked for as a screen asks. ``python benchmarks/historian.py [DAYS]``, 30 by default.
"""

import asyncio
import math
import resource
import sys
import tempfile
import time
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

BEGIN = datetime(2026, 11, 3, tzinfo=UTC)
RATE_HZ = 10.0
SECONDS = 30.0
DAYS = 30.0
OUTPUTS = ("Z_um", "Z0_um", "Z1500_um", "Z3000_um")
CHANNELS = ("T_spindle_C", "T_table_C", "T_column_C", "T_hall_C")
OTHERS = ("referenced", "machine_on", "not_homing", "no_emergency_stop")
PROMISES = {"cycle": 0.5, "month": 2.0, "memory": 40.0}


def resident_mb() -> float:
    """Return the memory that this program has now. [MB]"""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


class Machine:
    """Records of a machine that warms: four channels, four outputs of two parts each."""

    def __init__(self, cycle_s: float) -> None:
        self._cycle_s = cycle_s
        self._lags = [0.0] * 8
        self._before = (0.0,) * 4

    def record(self, number: int):
        """Return the record of a cycle."""
        from thermaxis.compensation import (  # noqa: PLC0415
            CycleOutput,
            Quality,
            SampleQuality,
            SupervisorState,
        )
        from thermaxis.runtime import Applied, CycleRecord, SourceSample  # noqa: PLC0415

        time_s = number * self._cycle_s
        utc = BEGIN + timedelta(seconds=time_s, microseconds=137 * number % 900)
        stamp = utc - timedelta(microseconds=20_000 + 7919 * number % 5000)
        age_s = (utc - stamp).total_seconds()
        day = math.sin(time_s / 86_400.0 * math.tau)
        values = tuple(
            round(22.0 + 4.0 * (k + 1) * (1.0 + day) + 0.07 * math.sin(number * (k + 2.0)), 1)
            for k in range(4)
        )
        for k in range(8):
            self._lags[k] += (values[k % 4] - 22.0 - self._lags[k]) / (600.0 * (k + 1))
        parts = tuple((3.1 * self._lags[k], 1.7 * self._lags[k + 4]) for k in range(4))
        model = tuple(a + b for a, b in parts)
        goal = tuple(-value for value in model)
        correction = tuple(
            a if abs(a - b) > 0.05 else b for a, b in zip(goal, self._before, strict=True)
        )
        output = CycleOutput(
            time_s,
            SupervisorState.ACTIVE,
            0.0,
            (),
            correction,
            goal,
            model,
            parts,
            (1.0,) * 4,
            (0.0,) * 4,
            self._before,
            self._cycle_s,
            (False,) * 4,
            values,
            (SampleQuality.GOOD,) * 4,
            Quality.GOOD,
            (),
            (),
        )
        self._before = correction
        samples = {
            name: SourceSample(value, True, "Good", age_s, stamp)  # noqa: FBT003 - its status
            for name, value in zip((*CHANNELS, *OTHERS), (*values, *(1.0,) * 4), strict=True)
        }
        applied = {n: Applied(c, c, c) for n, c in zip(OUTPUTS, correction, strict=True)}
        return CycleRecord(
            number,
            utc,
            1e4 + time_s,
            samples,
            output,
            applied,
            1e-4 * (1.0 + 0.5 * math.sin(number)),
            (("spindle", "table"),) * 4,
            ((1.0, 0.8),) * 4,
            1500.0,
        )


async def cpu_ms(folder: Path, *, recorded: bool) -> float:
    """Return the CPU of a cycle at 10 Hz, with or without the historian. [ms]"""
    from thermaxis.runtime import SystemClock  # noqa: PLC0415 - see above
    from thermaxis.runtime.historian import (  # noqa: PLC0415
        HistorianSettings,
        SqlHistorian,
    )

    url = f"sqlite:///{folder / 'rate.db'}"
    historian = SqlHistorian(url, HistorianSettings(), SystemClock())
    machine = Machine(1.0 / RATE_HZ)
    if recorded:
        await historian.open(OUTPUTS, CHANNELS)
        await asyncio.sleep(1.0)
    cycles = int(SECONDS * RATE_HZ)
    since_s, cpu_s = time.monotonic(), time.process_time()
    for number in range(cycles):
        await asyncio.sleep(max(0.0, since_s + number / RATE_HZ - time.monotonic()))
        record = machine.record(number)
        if recorded:
            historian.record(record)
    cpu_s = time.process_time() - cpu_s
    await historian.close(5.0)
    return cpu_s / cycles * 1e3


def write_days(path: Path, days: float) -> int:
    """Write days at one cycle a second as fast as it goes; return the number of cycles."""
    from thermaxis.runtime import SystemClock  # noqa: PLC0415 - see above
    from thermaxis.runtime.historian import (  # noqa: PLC0415
        Backlog,
        HistorianSettings,
        RowPacker,
        Writer,
        parse_url,
    )

    packer, backlog = RowPacker(), Backlog(10**9)
    packer.outputs, packer.channels = OUTPUTS, CHANNELS
    url = parse_url(f"sqlite:///{path}")
    writer = Writer(url, HistorianSettings(), SystemClock(), backlog, packer)
    machine, cycles = Machine(1.0), int(days * 86_400)
    for number in range(cycles):
        backlog.add_cycle(packer.pack(replace(machine.record(number), number=number)))
        if backlog.waiting >= 1000:
            writer.attempt()
    writer.attempt()
    writer.close()
    return cycles


def main() -> int:
    """Measure, print, and return 1 if a promise is not kept."""
    days = float(sys.argv[1]) if len(sys.argv) > 1 else DAYS
    import thermaxis.runtime._ports  # noqa: F401, PLC0415 - what the loop has anyway

    before_mb = resident_mb()
    results: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with_it = asyncio.run(cpu_ms(folder, recorded=True))
        results["memory"] = resident_mb() - before_mb
        without = asyncio.run(cpu_ms(folder, recorded=False))
        results["cycle"] = with_it - without
        print(f"CPU of a cycle at {RATE_HZ:g} Hz: {results['cycle']:.2f} ms for the historian")
        print(f"memory: {results['memory']:.0f} MB for the historian, SQLAlchemy included")
        path = folder / "month.db"
        since_s, at_mb = time.monotonic(), resident_mb()
        cycles = write_days(path, days)
        took_s = time.monotonic() - since_s
        grown_mb = resident_mb() - at_mb
        size = path.stat().st_size
        print(
            f"{cycles} cycles of {days:g} days written in {took_s:.0f} s"
            f" ({took_s / cycles * 1e6:.0f} us each), memory grew by {grown_mb:.0f} MB"
        )
        print(f"on the disk: {size / cycles:.0f} bytes a cycle, {size / days / 1e6:.1f} MB a day")
        from thermaxis.runtime.historian import HistoryReader  # noqa: PLC0415

        series = ["Z_um.correction", "Z_um.model", "T_spindle_C", "T_table_C"]
        for label, hours in (("an hour", 1.0), ("a day", 24.0), (f"{days:g} days", 24.0 * days)):
            end = BEGIN + timedelta(days=days)
            with HistoryReader(f"sqlite:///{path}") as reader:
                since_s = time.monotonic()
                found = reader.trend(series, end - timedelta(hours=hours), end, points=1000)
                took_s = time.monotonic() - since_s
            points = len(found[series[0]].time_us)
            print(f"chart of {label}, 4 series of {points} points: {took_s:.2f} s")
        results["month"] = took_s
    kept = True
    for key, limit in PROMISES.items():
        kept &= results[key] <= limit
        print(f"{key}: {results[key]:.2f} of at most {limit:g}")
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
