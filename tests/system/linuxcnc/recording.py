"""The laser: stops are found in the motion itself, and read where the dwell ends."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from tests.system.linuxcnc.machine import PERIOD_S, Trace

APPROACHES = ("forward", "backward")
LASER_STEP_MM = 1e-5
AT_TARGET_MM = 1e-6
"""An axis that slows down is nearer for one servo period at most. [mm]"""


@dataclass(frozen=True, slots=True)
class Stop:
    """One standstill between two motions."""

    begin: int
    """Servo period of the first standstill."""
    end: int
    """Servo period after the last one."""
    approach: int
    """0 if the axis came from below, 1 from above."""
    position: float
    """Commanded position. [mm]"""
    duration_s: float
    """How long it stood, by the true time. [s]"""


def find_stops(trace: Trace, targets: Sequence[float], shortest_s: float) -> list[Stop]:
    """Return the standstills at targets that last at least so long.

    Parameters
    ----------
    trace : Trace
        What the joint did.
    targets : sequence of float
        Where the laser reads. Elsewhere the axis only turns, however long it takes: a turn may
        fall into one of the pauses of a kernel without real time. [mm]
    shortest_s : float
        Shortest standstill that counts, by the true time or by servo periods, of which some are
        made up for faster. [s]

    Returns
    -------
    list of Stop
        In the order of time.
    """
    change = np.flatnonzero(np.diff(trace.position)) + 1
    edges = [*change.tolist(), trace.position.size]
    places = np.asarray(targets)
    found: list[Stop] = []
    for begin, end in pairwise(edges):
        left = min(end, trace.clock_s.size - 1)  # the first period of the next motion
        duration_s = float(trace.clock_s[left] - trace.clock_s[begin])
        position = float(trace.position[begin])
        lasts_s = max(duration_s, (end - begin) * PERIOD_S)
        if lasts_s >= shortest_s and np.min(np.abs(position - places)) < AT_TARGET_MM:
            backward = position < trace.position[begin - 1]
            found.append(Stop(begin, end, int(backward), position, duration_s))
    return found


def write_run(
    trace: Trace, stops: list[Stop], dwell_s: float, path: Path, *, noise_um: float, seed: int
) -> None:
    """Write what a laser reads at the end of the dwell as tidy CSV.

    Cycle and direction are counted from the motion, not taken from the plan.

    Parameters
    ----------
    trace : Trace
        What the joint did.
    stops : list of Stop
        The stops.
    dwell_s : float
        The laser is read so long after the standstill began. [s]
    path : Path
        The file.
    noise_um : float
        Standard deviation of a reading. [µm]
    seed : int
        Seed of the noise. [1]
    """
    random = np.random.default_rng(seed)
    visits: dict[tuple[float, int], int] = {}
    lines = ["order,time_s,cycle,direction,target_mm,measured_mm"]
    for order, stop in enumerate(stops, start=1):
        at = min(stop.begin + round(dwell_s / PERIOD_S), stop.end) - 1
        target = round(stop.position, 3)
        key = (target, stop.approach)
        visits[key] = visits.get(key, 0) + 1
        read = trace.axis[at] + 1e-3 * noise_um * random.standard_normal()
        read = round(read / LASER_STEP_MM) * LASER_STEP_MM
        cells = (
            str(order),
            f"{trace.time_s[at]:.3f}",
            str(visits[key]),
            APPROACHES[stop.approach],
            f"{target:.3f}",
            f"{read:.5f}",
        )
        lines.append(",".join(cells))
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
