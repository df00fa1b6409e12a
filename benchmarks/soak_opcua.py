"""``thermaxis run`` at 10 Hz in real time on a server that others wrote, certificates and users.

Run from the project's folder: ``python -m benchmarks.soak_opcua --minutes 60``. It needs Node.js,
as the system tests do. Every minute a line is printed; at the end every cycle must be in the
history, no write lost, no limit passed by the machine's own record, the connection never lost,
and processor and memory within what the project promises; else the exit code is 1.
"""

import argparse
import statistics
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from tests.system.opcua.client import OUTPUTS, USERS
from tests.system.opcua.compensated import (
    Cost,
    Rules,
    cost_of,
    excess,
    make_site,
    read_history,
    stays,
)
from tests.system.opcua.foreign_server import ForeignServer, Line, install, missing
from tests.system.programs import Program, compensating, gaps
from thermaxis.compensation import SupervisorState
from thermaxis.runtime import CycleRecord, EventRecord

RULES = Rules(cycle_s=0.1, largest_um=200.0, rate_um_per_s=2.0, temperature_rate_k_per_s=0.5)
"""The largest correction fades within the two minutes that an ended loop takes."""
STARTED_S = 90.0
"""Time until it must be active: a minute until the model has settled, and a busy computer."""
WARM_UP_S = 20.0
"""What is not counted: importing, connecting, the first cycles. [s]"""
MOST_CPU = 0.03
"""Of one core, with the status server."""
MOST_MEMORY_MB = 180.0
MOST_GROWTH_MB_PER_H = 5.0
"""What the memory may grow, above what one page more or less makes. [MB/h]"""
ROUNDED_UM = 0.1
"""The coarsest node counts in tenths. [µm]"""


class Measured(NamedTuple):
    """What was measured while it ran."""

    seconds: float
    """Time that was measured, without the warm-up. [s]"""
    cpu: float
    """Share of one core. [1]"""
    memory_mb: float
    """Memory at the end. [MB]"""
    growth_mb_per_h: float
    """How fast it grew over the second half. [MB/h]"""


def main() -> int:
    """Run, print, and return 1 if a promise is not kept."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0, help="how long (default: 60)")
    parser.add_argument("--folder", type=Path, help="keep everything there (default: nowhere)")
    arguments = parser.parse_args()
    reason = missing()
    if reason:
        raise SystemExit(reason)
    install()
    if arguments.folder is not None:
        arguments.folder.mkdir(parents=True)
        return soak(arguments.folder, arguments.minutes)
    with tempfile.TemporaryDirectory() as folder:
        return soak(Path(folder), arguments.minutes)


def soak(folder: Path, minutes: float) -> int:
    """Run for a time in a folder; print, and return 1 if a promise is not kept."""
    life_s = 60.0 * minutes + STARTED_S + 900.0
    with ForeignServer(
        folder / "machine", users=USERS, swing_k=2.0, swing_s=900.0, life_s=life_s
    ) as machine:
        with compensating(make_site(folder, machine, RULES), "--enable") as loop:
            measured = watch(loop, 60.0 * minutes)
            code = loop.stop(900.0)
        told = machine.record()
    history = read_history(folder)
    report = [f"exit code {code}", *cost_lines(measured), *cycle_lines(history.cycles)]
    print("\n".join(report))
    broken = [
        *broken_promises(measured),
        *broken_records(history.cycles, history.events, told),
        *([f"exit code {code}"] if code else []),
    ]
    for one in broken:
        print("NOT KEPT:", one)
    return 1 if broken else 0


def watch(loop: Program, seconds: float) -> Measured:
    """Print a line a minute and return what was measured."""
    loop.wait_for_state(SupervisorState.ACTIVE, STARTED_S)
    time.sleep(min(WARM_UP_S, 0.2 * seconds))
    began_s, began = time.monotonic(), cost_of(loop.popen.pid)
    seen: list[tuple[float, Cost]] = [(began_s, began)]
    while (left_s := began_s + seconds - time.monotonic()) > 0.0:
        time.sleep(min(60.0, left_s))
        now_s, now = time.monotonic(), cost_of(loop.popen.pid)
        since_s, since = seen[-1]
        share = (now.cpu_s - since.cpu_s) / (now_s - since_s)
        print(f"{(now_s - began_s) / 60.0:6.1f} min  {share:6.2%}  {now.memory_mb:6.1f} MB")
        seen.append((now_s, now))
    last_s, last = seen[-1]
    half_s, half = seen[len(seen) // 2]
    hours = (last_s - half_s) / 3600.0
    return Measured(
        last_s - began_s,
        (last.cpu_s - began.cpu_s) / (last_s - began_s),
        last.memory_mb,
        (last.memory_mb - half.memory_mb) / hours if hours > 0.0 else 0.0,
    )


def cost_lines(measured: Measured) -> list[str]:
    """Return the cost in words."""
    growth = f"{measured.growth_mb_per_h:+.2f} MB/h over the second half"
    return [
        f"measured for {measured.seconds / 60.0:.1f} min",
        f"processor {measured.cpu:.2%} of one core (promise: under {MOST_CPU:.0%})",
        f"memory {measured.memory_mb:.1f} MB (promise: under {MOST_MEMORY_MB:g} MB), {growth}",
    ]


def cycle_lines(cycles: Sequence[CycleRecord]) -> list[str]:
    """Return what the history says of the cycles in words."""
    late_ms = sorted(1000.0 * cycle.lateness_s for cycle in cycles)
    span_s = cycles[-1].monotonic_s - cycles[0].monotonic_s
    states = [f"{stay.state} {stay.end_s - stay.begin_s:.0f} s" for stay in stays(cycles)]
    lacking, frequency = len(gaps(cycles)), len(cycles) / span_s
    usual, rare = statistics.median(late_ms), late_ms[int(0.99 * (len(late_ms) - 1))]
    return [
        f"{len(cycles)} cycles in the history, {lacking} missing, {frequency:.3f} per second",
        f"late by {usual:.1f} ms (median), {rare:.1f} ms (99 %), {late_ms[-1]:.1f} ms (worst)",
        f"states: {', '.join(states)}",
    ]


def broken_promises(measured: Measured) -> list[str]:
    """Return which promises of cost were not kept."""
    broken: list[str] = []
    if measured.cpu >= MOST_CPU:
        broken.append(f"processor {measured.cpu:.2%}")
    if measured.memory_mb >= MOST_MEMORY_MB:
        broken.append(f"memory {measured.memory_mb:.1f} MB")
    page_mb_per_h = 1.0 / (measured.seconds / 3600.0)
    if measured.growth_mb_per_h > MOST_GROWTH_MB_PER_H + page_mb_per_h:
        broken.append(f"memory grows by {measured.growth_mb_per_h:.1f} MB/h")
    return broken


def broken_records(
    cycles: Sequence[CycleRecord], events: Sequence[EventRecord], told: Sequence[Line]
) -> list[str]:
    """Return what history and machine say against the loop."""
    broken: list[str] = []
    if gaps(cycles):
        broken.append(f"cycles {gaps(cycles)[:5]}... are not in the history")
    broken += [
        f"{one.utc:%H:%M:%S} {one.text}"
        for one in events
        if one.kind == "loss" or (one.kind == "connection" and "is lost" in one.text)
    ]
    states = {stay.state for stay in stays(cycles)}
    if states & {SupervisorState.HOLDING, SupervisorState.FAULT}:
        broken.append(f"it was {', '.join(sorted(states))}")
    accepted = [line for line in told if line.kind == "accepted"]
    written = [cycle for cycle in cycles if cycle.applied]
    if abs(len(accepted) - len(written)) > 0.001 * len(written) + 1:
        broken.append(f"{len(written)} writes, of which the machine saw {len(accepted)}")
    if [line for line in told if line.kind == "watchdog" and line.met is False]:
        broken.append("the machine's watchdog has tripped")
    for axis, _, _ in OUTPUTS.values():
        found = excess(told, axis, RULES)
        print(f"{axis}: {found}")
        if max(found) > ROUNDED_UM:
            broken.append(f"a limit of {axis} was passed: {found}")
    last = next(line for line in reversed(told) if line.accepted_um)
    if any(abs(offset) > 1e-9 for offset in last.accepted_um.values()):
        broken.append(f"offsets were left: {last.accepted_um}")
    return broken


if __name__ == "__main__":
    raise SystemExit(main())
