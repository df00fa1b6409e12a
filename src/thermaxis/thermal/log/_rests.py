"""Which sensors rest on one step of their resolution while the machine works, and beside what."""

import math
from typing import Final, NamedTuple

import numpy as np

from thermaxis.compensation import WITNESS_S
from thermaxis.thermal._arrays import FloatArray, recursion
from thermaxis.thermal.log._quality import TEMPERATURES, out_of_range, resolution_of, runs
from thermaxis.thermal.log._thermal_log import ThermalLog

MARGIN: Final = 2.0
"""A witness may go so many times as far as its average did in the log. [1]"""
LEAST_S: Final = 86_400.0
"""A shorter log knows too little of the air. [s]"""
RESTS_S: Final = 10_800.0
"""A sensor that never stood for longer needs no witness: three quarters of the default of
`frozen_s`. [s]"""


class RestingSensor(NamedTuple):
    """A sensor with coarse steps, and the one whose movements tell when it should have moved."""

    name: str
    resolution_k: float
    """Its step. [K]"""
    rests_s: float
    """Longest time for which it stood. [s]"""
    moves_with: str
    rests_k: float
    """How far the witness may go meanwhile: twice as far as it did. [K]"""


def find_resting(log: ThermalLog) -> tuple[RestingSensor, ...]:
    """Return sensors that rest, each with the witness that says most.

    A witness is a temperature that never stood for as long as the sensor, and that moved in the
    log by more than it may while the sensor rests: where it goes that far, the sensor moves, too.
    So witnesses of witnesses end at the liveliest sensor, which has none.

    Parameters
    ----------
    log : ThermalLog
        The log: days of the machine at work, of which nothing was stuck.

    Returns
    -------
    tuple of RestingSensor
        In the order of the columns; none for a sensor that is not rounded or has no witness, and
        none of a log of less than a day.
    """
    if log.duration_s < LEAST_S:
        return ()
    columns: dict[str, FloatArray] = {}
    for name, values in log.columns.items():
        unit = log.units[name]
        if unit in TEMPERATURES and np.fmax.reduce(values) > np.fmin.reduce(values):
            columns[name] = np.where(out_of_range(values, unit), np.nan, values)
    stands_s = {name: _stands_s(log, values) for name, values in columns.items()}
    average = {name: _averaged(values, log.usual_step_s) for name, values in columns.items()}
    found: list[RestingSensor] = []
    for name, values in columns.items():
        resolution = resolution_of(values[~np.isnan(values)])
        said = [
            (*_goes(values, seen), other)
            for other, seen in average.items()
            if other != name
            and log.units[other] == log.units[name]
            and stands_s[other] < stands_s[name]
        ]
        share, goes, other = min(said, default=(math.inf, 0.0, ""))
        if resolution > 0.0 and share < 1.0 and stands_s[name] > RESTS_S:
            scale = 5.0 / 9.0 if log.units[name] == "degF" else 1.0
            step_k, goes_k = scale * resolution, scale * goes
            found.append(RestingSensor(name, step_k, stands_s[name], other, goes_k))
    return tuple(found)


def _stands_s(log: ThermalLog, values: FloatArray) -> float:
    """Return for how long a channel stood at most. [s]"""
    time_s = log.time_s[~np.isnan(values)]
    begins, lengths = runs(values[~np.isnan(values)])
    return float(np.max(time_s[begins + lengths - 1] - time_s[begins]))


def _averaged(values: FloatArray, step_s: float) -> FloatArray:
    """Return the average that is taken of a witness, the last value for one that is missing."""
    rows = np.maximum.accumulate(np.where(np.isnan(values), 0, np.arange(values.size)))
    held = np.where(np.isnan(values[rows]), values[~np.isnan(values)][0], values[rows])
    share = step_s / (WITNESS_S + step_s)
    return recursion(1.0 - share, share * held[1:], held[0])


def _goes(values: FloatArray, seen: FloatArray) -> tuple[float, float]:
    """Return how far a witness may go while a sensor rests: as share of all that it went, and in K.

    Nothing can be said of one that never went while the sensor stood.
    """
    seen = seen[~np.isnan(values)]
    begins, _ = runs(values[~np.isnan(values)])
    up = np.maximum.reduceat(seen, begins) - seen[begins]
    down = seen[begins] - np.minimum.reduceat(seen, begins)
    goes, whole = MARGIN * float(max(np.max(up), np.max(down))), float(np.ptp(seen))
    return (goes / whole if goes and whole else math.inf), goes
