"""How long the drift of a run takes, and how much memory: linear in the readings.

Every line is a process of its own, so that its largest memory is its own (Linux: VmHWM of
/proc/self/status, on top of an interpreter with numpy and scipy). The run is evaluated three times
and the shortest time counts, except for the longest run. The time that is held against the promise
is that of the processor: on an idle machine it is also the time that passes. A reading every
7.9 s: 100 cycles of 32 readings take seven hours, a million readings take 91 days.

    python benchmarks/drift_speed.py
"""

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from thermaxis.positioning import PositioningTest, TimeSource, evaluate_drift
from thermaxis.quantities import AxisKind

CYCLES = (5, 100, 1_000, 3_125, 10_000, 31_250)
TARGETS, STOP_S, NOISE_UM = 16, 252.0 / 32.0, 0.4
PROMISES = {100: (0.6, 1024.0), 31_250: (60.0, 1024.0)}
"""Largest time and memory that are promised. [s, MiB]"""


def generated(cycles: int) -> PositioningTest:
    """Return a run that warms up and follows the hall's temperature day by day."""
    rng = np.random.default_rng(1)
    target = 20.0 * np.arange(TARGETS)
    up = np.arange(TARGETS)
    visit = np.stack((up, 2 * TARGETS - 1 - up), axis=1)
    number = visit[:, None, :] + 2.0 * TARGETS * np.arange(cycles)[None, :, None]
    hours = STOP_S * number / 3600.0
    drift = -6.0 * np.expm1(-hours / 0.7) + 0.8 * np.sin(2.0 * np.pi * hours / 24.0)
    growth = 0.02 * np.expm1(-hours) * (target - np.mean(target))[:, None, None]
    noise = NOISE_UM * rng.normal(size=number.shape)
    return PositioningTest(
        kind=AxisKind.LINEAR,
        target=target,
        deviation=drift + growth + noise,
        time_source=TimeSource.FILE,
        time_s=STOP_S * number,
        order=number + 1.0,
    )


def largest_memory_mib() -> float:
    """Return the largest memory of this process so far, or NaN where nothing tells it. [MiB]"""
    status = Path("/proc/self/status")
    if not status.exists():
        return float("nan")
    lines = status.read_text(encoding="ascii").splitlines()
    return float(next(line.split()[1] for line in lines if line.startswith("VmHWM"))) / 1024.0


def measure(cycles: int) -> None:
    """Print the seconds that pass, those of the processor and the MiB of one run."""
    evaluate_drift(generated(2))  # imports what is imported when it is needed
    test = generated(cycles)
    passed: list[float] = []
    used: list[float] = []
    for _ in range(1 if cycles > 10_000 else 3):
        since, used_before = time.perf_counter(), time.process_time()
        evaluate_drift(test)
        passed.append(time.perf_counter() - since)
        used.append(time.process_time() - used_before)
    print(min(passed), min(used), largest_memory_mib())


def main() -> int:
    """Measure all runs, print a table, and return 1 if a promise is not kept."""
    if len(sys.argv) > 1:
        measure(int(sys.argv[1]))
        return 0
    print("| cycles | readings | time, s | processor, s | per reading, µs | largest memory, MiB |")
    print("|---:|---:|---:|---:|---:|---:|")
    kept = True
    for cycles in CYCLES:
        command = [sys.executable, __file__, str(cycles)]
        one = {**os.environ, "OMP_NUM_THREADS": "1"}  # as the commands have it
        done = subprocess.run(command, check=True, capture_output=True, text=True, env=one)
        passed, seconds, mib = (float(value) for value in done.stdout.split())
        readings = 2 * TARGETS * cycles
        print(
            f"| {cycles} | {readings} | {passed:.3f} | {seconds:.3f}"
            f" | {1e6 * seconds / readings:.1f} | {mib:.0f} |",
            flush=True,
        )
        if cycles in PROMISES:
            most_s, most_mib = PROMISES[cycles]
            kept = kept and seconds < most_s and not mib > most_mib
    print(f"\npromises kept: {'yes' if kept else 'no'}")
    return 0 if kept else 1


if __name__ == "__main__":
    raise SystemExit(main())
