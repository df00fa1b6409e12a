"""Identification from faulty logs: what is masked, joined, delayed or named, and what fit is left.

Problem: as in identification.py, cold. Each fault is put into the training log, which goes the
way of the command `identify`; fit: free run from rest on another cold test without a fault,
against the measured displacement. `known` is the same where the fault is known and repaired by
hand: nothing can be better. At the end, logs without a fault: what is
said, and in how many a value was masked, joined or shifted.

    python benchmarks/log_faults.py [--seeds 10] [--step 1] [--hours 8] [--rows stuck,rezero_37]
        [--healthy 50] [--show]
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from identification import OTHER, fit_percent, plan_of
from numpy.typing import NDArray

from thermaxis.codes import Message
from thermaxis.thermal import (
    ThermalLog,
    identify,
    parse_input,
    records_of,
    simulate_modal,
    with_one_clock,
    without_faults,
)
from thermaxis.virtual import Heating, ThermalTestPlan, generate_thermal_test

INPUTS = tuple(map(parse_input, ("spindle=T_spindle_c-T_column_c", "table=T_table_c-T_column_c")))
Columns: TypeAlias = dict[str, NDArray[np.float64]]
Change: TypeAlias = Callable[[Columns, np.random.Generator], None]


def second_half(value: float | None) -> Change:
    """Hold the spindle's sensor at a value from mid-test on, None for its own, NaN for none."""

    def put(columns: Columns, _: np.random.Generator) -> None:
        spindle = columns["T_spindle_c"]
        half = spindle.size // 2
        spindle[half:] = spindle[half] if value is None else value

    return put


def leap(size_um: float) -> Change:
    def put(columns: Columns, rng: np.random.Generator) -> None:
        z = columns["Z_um"]
        z[int(z.size * rng.uniform(0.3, 0.7)) :] += size_um

    return put


def late(shift_s: float) -> Change:
    """Stamp the displacements so much too late, or too early below zero."""

    def put(columns: Columns, _: np.random.Generator) -> None:
        rows = round(abs(shift_s) / (columns["time_s"][1] - columns["time_s"][0]))
        for name, values in columns.items():
            first = (name == "Z_um") == (shift_s > 0)
            columns[name] = values[:-rows] if first else values[rows:]
        columns["time_s"] = columns["time_s"] - columns["time_s"][0]

    return put


def together(shift_s: float) -> Change:
    """Stamp the displacements so, and set the clocks right again by what both have in common."""

    def put(columns: Columns, rng: np.random.Generator) -> None:
        late(shift_s)(columns, rng)
        rows = round(abs(shift_s) / (columns["time_s"][1] - columns["time_s"][0]))
        gap, z = np.full(rows, np.nan), columns["Z_um"]
        late_z, early_z = np.append(z[rows:], gap), np.append(gap, z[:-rows])
        columns["Z_um"] = late_z if shift_s > 0 else early_z

    return put


def drifting(columns: Columns, _: np.random.Generator) -> None:
    columns["T_spindle_c"] += 3.0 * columns["time_s"] / columns["time_s"][-1]


def nothing(_: Columns, __: np.random.Generator) -> None:
    """Leave the log as it is."""


FAULTS: dict[str, tuple[Change, Change]] = {
    "healthy": (nothing, nothing),
    "stuck": (second_half(None), second_half(np.nan)),
    "850": (second_half(850.0), second_half(np.nan)),
    "rezero_37": (leap(37.0), nothing),
    "rezero_5": (leap(5.0), nothing),
    "late_900": (late(900.0), together(900.0)),
    "early_900": (late(-900.0), together(-900.0)),
    "late_90": (late(90.0), together(90.0)),
    "early_90": (late(-90.0), together(-90.0)),
    "drift_3K": (drifting, nothing),
}
"""The fault, and what a person who knows of it would make of the log."""
HEALTHY = {
    "lags 10 s": ThermalTestPlan(sample_time_s=10.0),
    "lags 60 s, 72 h": ThermalTestPlan(sample_time_s=60.0, hours=72.0),
    "rods 10 s": ThermalTestPlan(sample_time_s=10.0, heating=Heating.RODS),
    "warm, 5 % missing": ThermalTestPlan(sample_time_s=10.0, warm_up_h=3.0, missing_share=0.05),
}


@dataclass(frozen=True)
class Trained:
    """What became of a log."""

    fit_percent: float
    said: tuple[Message, ...]


def mended(log: ThermalLog) -> ThermalLog:
    """Act on faults as the command does."""
    return with_one_clock(without_faults(log), INPUTS, ["Z_um"])


def trained(change: Change, seed: int, plan: ThermalTestPlan) -> Trained:
    """Return the fit of a model of a changed log on another cold test, and what was said."""
    test, other = generate_thermal_test(plan, seed), generate_thermal_test(plan, OTHER + seed)
    columns = {name: values.copy() for name, values in test.columns().items()}
    change(columns, np.random.default_rng([seed, 9]))
    log = mended(ThermalLog.from_columns(columns))
    found = identify(records_of([log], INPUTS, ["Z_um"]))
    first = other.time_s <= 60.0
    u = other.u_k - other.u_k[first].mean(axis=0)
    z = other.z_um - other.z_um[first].mean()
    simulated = simulate_modal(found.outputs[0].model, plan.sample_time_s, u)
    return Trained(fit_percent(z, simulated), (*log.remarks, *found.messages))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--step", type=float, default=1.0)
    parser.add_argument("--hours", type=float, default=8.0)
    parser.add_argument("--rows", default=",".join(FAULTS))
    parser.add_argument("--healthy", type=int, default=50)
    parser.add_argument("--show", action="store_true")
    asked = parser.parse_args()
    plan = plan_of(asked.hours, asked.step)
    print(f"{'fault':12s} {'median fit':>10s} {'least':>7s} {'known':>7s}  said (logs)")
    for name in asked.rows.split(","):
        change, known = FAULTS[name]
        found = [trained(change, seed, plan) for seed in range(asked.seeds)]
        best = [trained(known, seed, plan).fit_percent for seed in range(asked.seeds)]
        fits = [one.fit_percent for one in found]
        codes = [message.code for one in found for message in one.said]
        said = ", ".join(f"{code} {codes.count(code)}" for code in sorted(set(codes)))
        print(
            f"{name:12s} {np.median(fits):10.1f} {min(fits):7.1f} {np.median(best):7.1f}  {said}",
            flush=True,
        )
        if asked.show:
            for seed, one in enumerate(found):
                shown = [(message.code, dict(message.values)) for message in one.said]
                print(f"  seed {seed}: {one.fit_percent:.1f} {shown}")
    acted = 0
    for name, healthy in HEALTHY.items():
        for seed in range(asked.healthy):
            log = ThermalLog.from_columns(generate_thermal_test(healthy, 1000 + seed).columns())
            after = mended(log)
            remarks = after.remarks
            kept = [
                np.array_equal(v, after.columns[n], equal_nan=True) for n, v in log.columns.items()
            ]
            acted += not all(kept)
            for message in remarks:
                print(f"  {name}, seed {1000 + seed}: {message.code} {dict(message.values)}")
    print(f"healthy logs with anything done: {acted} of {asked.healthy * len(HEALTHY)}")


if __name__ == "__main__":
    main()
