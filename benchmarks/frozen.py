"""When a stuck sensor is noticed, and how often a healthy one is called frozen.

A hall with air conditioning and a setback at night, a column that follows it with a lag of three
hours, a bed with one of four, a spindle and its bearing that heat up in one to three shifts; counts
of 0.1 K. From four days `find_resting` learns which sensor tells what about which other; fourteen
days more are judged as `cycle` judges them, by `frozen_s` alone and with what was learnt. Then each
sensor that has a witness sticks in turn, at all hours of the days; the others are judged as ever.
No machine, no clock; about a minute.

    python benchmarks/frozen.py [minutes between two moments of sticking, default 360]
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from thermaxis.compensation import (
    Compensation,
    CompensationModel,
    CycleReading,
    Limits,
    Output,
    Part,
    Sample,
    SampleQuality,
    SensorRules,
    cycle,
    cycle_state,
)
from thermaxis.thermal import RestingSensor, ThermalLog, find_resting

STEP_S = 60.0
COUNT_K = 0.1
DAY = int(86_400 / STEP_S)
LEARNT_DAYS, JUDGED_DAYS = 4, 14
NAMES = ("T_spindle_C", "T_bearing_C", "T_column_C", "T_bed_C", "T_ambient_C")


def lagged(driver: np.ndarray, tau_s: float) -> np.ndarray:
    """Return a first-order lag of what drives it, from its first value on."""
    out, alpha = np.empty_like(driver), -np.expm1(-STEP_S / tau_s)
    out[0] = driver[0]
    for i in range(1, driver.size):
        out[i] = out[i - 1] + alpha * (driver[i - 1] - out[i - 1])
    return out


def hall(days: int, seed: int) -> dict[str, np.ndarray]:
    """Return true temperatures by channel, every minute from midnight on. [degC]"""
    random = np.random.default_rng(seed)
    time_s = STEP_S * np.arange(days * DAY)
    hour, day = time_s / 3600.0 % 24.0, (time_s // 86_400.0).astype(int)
    night = (hour < 5.0) | (hour > 21.0)
    slow = lagged(random.normal(0.0, 4.0, time_s.size), 4.0 * 3600.0)
    wanted = 22.0 - 0.5 * night * (day % 7 < 5) + np.clip(slow, -0.2, 0.2)
    ambient = lagged(wanted, 1800.0) + 0.4 * np.sin(2.0 * np.pi * time_s / 1200.0)
    shifts = random.integers(1, 4, days)[day]
    works = (hour > 6.0) & (hour < 6.0 + 8.0 * shifts) & (day % 7 < 5)
    load = np.where(works, np.repeat(random.uniform(0.3, 1.0, days * 48), DAY // 48), 0.0)
    return {
        "T_spindle_C": lagged(ambient + 20.0 * load, 1500.0),
        "T_bearing_C": lagged(ambient + 14.0 * load, 2400.0),
        "T_column_C": lagged(ambient, 3.0 * 3600.0),
        "T_bed_C": lagged(ambient, 4.0 * 3600.0),
        "T_ambient_C": ambient,
    }


def counted(true: dict[str, np.ndarray], seed: int) -> dict[str, np.ndarray]:
    """Return what a card shows: a little noise, in whole counts. [degC]"""
    random = np.random.default_rng(seed)
    return {
        name: np.round((values + random.normal(0.0, 0.01, values.size)) / COUNT_K) * COUNT_K
        for name, values in true.items()
    }


def machine(learnt: tuple[RestingSensor, ...]) -> Compensation:
    """Return a compensation that judges all sensors by the defaults and what was learnt."""
    stated = {one.name: (one.moves_with, one.rests_k) for one in learnt}
    rules = {
        name: SensorRules(
            lowest_c=1.0,
            highest_c=80.0,
            moves_with=stated.get(name, ("", 0.0))[0],
            rests_k=stated.get(name, ("", 0.0))[1],
        )
        for name in NAMES
    }
    parts = tuple(Part(name, name, "", 1.0) for name in NAMES)
    reference_c = dict.fromkeys(NAMES, 22.0)
    model = CompensationModel(
        outputs=(Output("Z_um", parts),), reference="stated", reference_c=reference_c
    )
    limits = {"Z_um": Limits(1000.0, 1.0)}
    return Compensation(model=model, sensors=rules, limits=limits, cycle_s=STEP_S)


def judged(compensation: Compensation, seen: dict[str, np.ndarray]) -> np.ndarray:
    """Return whether each sensor is called frozen in each row, (channel, row)."""
    state, frozen = cycle_state(compensation), []
    for i, row in enumerate(zip(*(seen[name].tolist() for name in NAMES), strict=True)):
        reading = CycleReading(i * STEP_S, tuple(map(Sample, row)))
        state, output = cycle(compensation, state, reading)
        frozen.append([one is SampleQuality.FROZEN for one in output.qualities])
    return np.array(frozen).T


def stuck(
    compensation: Compensation, true: dict[str, np.ndarray], seen: dict[str, np.ndarray], k: int
) -> tuple[float, float]:
    """Return when a sensor that sticks after half a day is noticed [h], and its worst error [K].

    Never noticed is infinite; the error is that until it is noticed.
    """
    name, at = NAMES[k], DAY // 2
    values = np.where(np.arange(seen[name].size) < at, seen[name], seen[name][at])
    noticed = np.flatnonzero(judged(compensation, {**seen, name: values})[k][at:])
    until = at + noticed[0] if noticed.size else values.size
    error_k = np.max(np.abs(values[at:until] - true[name][at:until]))
    return (STEP_S * noticed[0] / 3600.0 if noticed.size else np.inf), float(error_k)


def main() -> None:
    """Print both tables."""
    every = int(float(sys.argv[1]) if len(sys.argv) > 1 else 360.0)
    true = hall(LEARNT_DAYS + JUDGED_DAYS, 1)
    seen = counted(true, 2)
    first = LEARNT_DAYS * DAY
    time_s = STEP_S * np.arange(first)
    log = ThermalLog.from_columns({n: v[:first] for n, v in seen.items()}, time_s=time_s)
    learnt = find_resting(log)
    for one in learnt:
        print(
            f"{one.name}: step {one.resolution_k:.2g} K, stood {one.rests_s / 3600.0:.1f} h,"
            f" moves with {one.moves_with} within {one.rests_k:.1f} K"
        )
    ways = {"frozen_s alone": machine(()), "with what was learnt": machine(learnt)}
    later = {name: values[first:] for name, values in seen.items()}
    for way, compensation in ways.items():
        frozen = judged(compensation, later)
        hours = {n: STEP_S * np.sum(f) / 3600.0 for n, f in zip(NAMES, frozen, strict=True)}
        print(f"healthy for {JUDGED_DAYS} days, {way}: called frozen [h]")
        print("   ", ", ".join(f"{name} {h:.1f}" for name, h in hours.items()))
    print("stuck: noticed after [h] median (longest), error until then [K] median (worst)")
    for k, name in enumerate(NAMES):
        if name not in {one.name for one in learnt}:
            continue
        for way, compensation in ways.items():
            rows = []
            for begin in range(first, true[name].size - 3 * DAY, every):
                part = slice(begin, begin + 3 * DAY)
                now = {n: v[part] for n, v in true.items()}
                rows.append(stuck(compensation, now, {n: v[part] for n, v in seen.items()}, k))
            hours, errors = np.array(rows).T
            print(
                f"    {name:12} {way:21} {np.median(hours):5.1f} ({np.max(hours):5.1f})"
                f"   {np.median(errors):5.2f} ({np.max(errors):5.2f})"
            )


if __name__ == "__main__":
    main()
