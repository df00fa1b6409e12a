"""What the history costs: on the disk, of a core, and for a chart of a month.

Two machines are recorded: 8 channels with 4 outputs of 2 parts, and 53 channels with 4 outputs of
52 parts; sensors have a noise of 0.02 K and two decimals, clocks jitter. A day is written as fast
as it goes. The share of a core is measured in real time at 10 Hz, as the loop has it: CPU of the
program and of the programs that close its hours, less that of the same program without a history;
an hour's closing is measured apart and spread over its hour. ``python benchmarks/historian.py
[DAYS]``, 30 by default, is the month of the charts.
"""

import argparse
import asyncio
import math
import random
import resource
import sqlite3
import sys
import tempfile
import time
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import NamedTuple

import polars as pl

from thermaxis.compensation import CycleOutput, Quality, SampleQuality, SupervisorState
from thermaxis.runtime import Applied, CycleRecord, SourceSample, SystemClock
from thermaxis.runtime.history import HistorianSettings, HistoryReader, SqlHistorian

BEGIN = datetime(2026, 11, 3, tzinfo=UTC)
OUTPUTS = ("Z_um", "Z0_um", "Z1500_um", "Z3000_um")
FLAGS = ("referenced", "machine_on", "not_homing", "no_emergency_stop")
RATE_HZ = 10.0
SECONDS = 30.0
HOUR = 36_000
"""Cycles of an hour at that rate. [1]"""


class Size(NamedTuple):
    """A machine, and what its history may cost."""

    channels: int
    parts: int
    bytes_a_cycle: float
    share: float


SMALL, LARGE = Size(8, 2, 150.0, 0.03), Size(53, 52, 900.0, 0.03)


class Machine:
    """Records of a machine that warms and cools with the day."""

    def __init__(self, cycle_s: float, size: Size = SMALL) -> None:
        self.channels = tuple(f"T_{k:02}_C" for k in range(size.channels))
        self._cycle_s = cycle_s
        self._parts = size.parts
        self._lags = [0.0] * (size.parts * len(OUTPUTS))
        self._before = (0.0,) * len(OUTPUTS)
        self._noise = random.Random(20261103)  # noqa: S311 - the same month each time
        self._names = (tuple(f"part{k}" for k in range(size.parts)),) * len(OUTPUTS)

    def record(self, number: int) -> CycleRecord:
        """Return the record of a cycle."""
        noise, time_s = self._noise.gauss, number * self._cycle_s
        utc = BEGIN + timedelta(seconds=time_s, microseconds=int(abs(noise(0.0, 300.0))))
        day = 1.0 + math.sin(time_s / 86_400.0 * math.tau)
        values = tuple(
            round(22.0 + 4.0 * (k % 4 + 1) * day + noise(0.0, 0.02), 2)
            for k, _ in enumerate(self.channels)
        )
        for k, lag in enumerate(self._lags):
            goal = values[k % len(values)] - 22.0
            self._lags[k] += (goal - lag) * self._cycle_s / (600.0 * (k % 10 + 1))
        each = [(3.1 - 0.3 * (k % 7)) * lag for k, lag in enumerate(self._lags)]
        parts = tuple(
            tuple(each[o * self._parts : (o + 1) * self._parts]) for o, _ in enumerate(OUTPUTS)
        )
        model = tuple(map(sum, parts))
        correction = tuple(
            -new if abs(new + old) > 0.05 else old
            for new, old in zip(model, self._before, strict=True)
        )
        four = len(OUTPUTS)
        output = CycleOutput(
            time_s=time_s,
            state=SupervisorState.ACTIVE,
            since_s=0.0,
            reasons=(),
            correction_um=correction,
            wanted_um=tuple(-value for value in model),
            model_um=model,
            contribution_um=parts,
            weight=(1.0,) * four,
            trim_um=(0.0,) * four,
            before_um=self._before,
            elapsed_s=self._cycle_s,
            at_limit=(False,) * four,
            values=values,
            qualities=(SampleQuality.GOOD,) * len(values),
            quality=Quality.GOOD,
            outcomes=(),
            answers=(),
        )
        self._before = correction
        good = True
        samples = {
            name: SourceSample(value, good, "Good", abs(noise(0.02, 0.005)), utc)
            for name, value in zip(
                (*self.channels, *FLAGS), (*values, *(1.0,) * len(FLAGS)), strict=True
            )
        }
        return CycleRecord(
            number=number,
            utc=utc,
            monotonic_s=1e4 + time_s + abs(noise(0.0, 3e-4)),
            samples=samples,
            output=output,
            applied={
                name: Applied(c, round(c, 1), round(c, 1))
                for name, c in zip(OUTPUTS, correction, strict=True)
            },
            lateness_s=abs(noise(0.0, 2e-4)),
            channels=self.channels,
            parts=self._names,
            diameter_mm=1500.0,
        )


def cpu_s() -> float:
    """Return the CPU time of this program and of those that it has started. [s]"""
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(one.ru_utime + one.ru_stime for one in used)


async def share(folder: Path, size: Size, *, recorded: bool) -> float:
    """Return the share of a core at 10 Hz, with or without a history."""
    settings = HistorianSettings(url=f"sqlite:///{folder / 'rate.db'}")
    historian = SqlHistorian(settings, SystemClock())
    machine = Machine(1.0 / RATE_HZ, size)
    records = [machine.record(number) for number in range(int(SECONDS * RATE_HZ))]
    if recorded:
        await historian.open(OUTPUTS)
        await asyncio.sleep(1.0)
    since_s, used_s = time.monotonic(), cpu_s()
    for number, record in enumerate(records):
        await asyncio.sleep(max(0.0, since_s + number / RATE_HZ - time.monotonic()))
        if recorded:
            historian.record(record)
    used_s = cpu_s() - used_s
    await historian.close(5.0)
    return used_s / SECONDS


def write(path: Path, machine: Machine, numbers: Sequence[int], *, beside: bool = False) -> None:
    """Write cycles as fast as it goes, with every finished hour and day."""
    settings = HistorianSettings(url=f"sqlite:///{path}", largest_waiting_bytes=10**9)
    historian = SqlHistorian(settings, SystemClock(), beside=beside)
    historian._columns.outputs = OUTPUTS  # noqa: SLF001 - the thread that would be started with it
    for number in numbers:
        historian.record(machine.record(number))
        if historian.status.waiting >= 1000:
            historian.attempt()
    historian.attempt()
    while historian._closer is not None:  # noqa: SLF001 - its thread would look again later
        time.sleep(0.05)
        historian.attempt()
    historian.disconnect()
    failure = historian.status.failure
    if failure is not None:
        raise SystemExit(f"not stored: {failure}")


def closing_s(folder: Path, size: Size) -> tuple[float, float]:
    """Return the CPU [s] and the bytes a cycle of closing an hour at 10 Hz."""
    path, machine = folder / "hour.db", Machine(1.0 / RATE_HZ, size)
    write(path, machine, range(HOUR))
    used_s = cpu_s()
    write(path, machine, range(HOUR, HOUR + 20), beside=True)
    used_s = cpu_s() - used_s
    files = list((folder / "hour").glob("*/*/*.parquet"))
    memory_mb = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(f"largest memory of the program that closed it so far: {memory_mb:.0f} MB")
    return used_s, sum(file.stat().st_size for file in files) / HOUR


def charts(path: Path, days: float) -> float:
    """Ask for charts as a screen asks; return the time for that of all days. [s]"""
    names = ["Z_correction_um", "Z_model_um", "T_00_C", "T_01_C"]
    end, took_s = BEGIN + timedelta(days=days), 0.0
    for label, hours in (("an hour", 1.0), ("a day", 24.0), (f"{days:g} days", 24.0 * days)):
        since_s = time.monotonic()
        with HistoryReader(f"sqlite:///{path}") as reader:
            found = reader.trend(names, end - timedelta(hours=hours), end, points=1000)
        took_s = time.monotonic() - since_s
        points = len(found[names[0]].time_us)
        print(f"chart of {label}, 4 series of {points} points, opening included: {took_s:.2f} s")
    return took_s


def write_month(path: Path, days: int) -> tuple[float, float]:
    """Write days at one cycle a second: the first, its copies at later times, and an hour.

    Returns
    -------
    tuple of float
        Time to write the first day [s], and its bytes a cycle with its minutes.
    """
    machine, day, since_s = Machine(1.0), 86_400, time.monotonic()
    write(path, machine, range(day + 1))
    took_s = time.monotonic() - since_s
    (first,) = path.with_suffix("").glob(f"*/day={BEGIN.date()}")
    size = sum(file.stat().st_size for file in first.iterdir()) / day
    for k in range(1, days):
        later = first.with_name(f"day={(BEGIN + timedelta(days=k)).date()}")
        later.mkdir(exist_ok=True)
        for file in first.iterdir():
            frame, shift = pl.read_parquet(file, hive_partitioning=False), pl.duration(days=k)
            time_name = next(name for name in frame.columns if name.endswith("_utc"))
            frame = frame.with_columns(pl.col(time_name) + shift)
            if "id" in frame.columns:
                frame = frame.with_columns(pl.col("id") + k * day)
            kind = file.name.partition("-")[0]
            name = f"{kind}-{1 + k * day:012}-{(k + 1) * day:012}.parquet"
            frame.write_parquet(later / name, compression="zstd")
    with sqlite3.connect(path) as database:  # as if it had written the copies itself
        closed = "UPDATE history SET value = ? WHERE name = 'closed_id'"
        database.execute(closed, (str(days * day),))
    database.close()
    write(path, machine, range(days * day, days * day + 3601))
    return took_s, size


def main() -> int:
    """Measure, print, and return 1 if a promise is not kept."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("days", type=int, nargs="?", default=30)
    days = parser.parse_args().days
    results: dict[str, tuple[float, float]] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for label, size in (("8 channels, 8 parts", SMALL), ("53 channels, 208 parts", LARGE)):
            place = folder / label.partition(" ")[0]
            place.mkdir()
            running = asyncio.run(share(place, size, recorded=True))
            running -= asyncio.run(share(place, size, recorded=False))
            closed_s, stored = closing_s(place, size)
            print(f"{label}: {closed_s:.1f} s of CPU to close an hour at {RATE_HZ:g} Hz")
            results[f"{label}: bytes a cycle"] = stored, size.bytes_a_cycle
            results[f"{label}: share of a core"] = running + closed_s / 3600.0, size.share
        path = folder / "month.db"
        took_s, stored = write_month(path, days)
        print(f"a day at 1 s: written in {took_s:.0f} s")
        results["bytes a cycle at 1 s"] = stored, SMALL.bytes_a_cycle
        results["chart"] = charts(path, days), 1.0
    for key, (found, most) in results.items():
        print(f"{key}: {found:.3g} of at most {most:g}")
    return 0 if all(found <= most for found, most in results.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
