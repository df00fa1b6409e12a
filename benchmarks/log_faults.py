"""Identification from faulty logs: what is masked, joined, delayed or named, and what fit is left.

Problem: as in identification.py, cold. Each fault is put into the training log, which goes the
way of the command `identify`; fit: free run from rest on another cold test without a fault,
against the measured displacement. `known` is the same where the fault is known and repaired by
hand: nothing can be better. Row `warm`: trained without a fault and verified on a log that begins
after three hours of work; `known` with --start fitted, and the fit from rest beside it.

At the end, logs without a fault: four machines of tests/thermal_machines.py (--healthy each), and
the first half of FL_THERMAL where it is at hand; what is said of them, and in how many a value was
masked, joined or shifted.

    python benchmarks/log_faults.py [--seeds 10] [--step 1] [--hours 8] [--rows stuck,rezero_37]
        [--healthy 50] [--show]
"""

import argparse
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from identification import OTHER, fit_percent, plan_of
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from benchmarks.virtual_thermal_test import ThermalTestPlan, generate_thermal_test
from tests.thermal_machines import KINDS, log as machine_log
from thermaxis.codes import Message
from thermaxis.files import read_thermal_log
from thermaxis.thermal import (
    Identification,
    InputDefinition,
    LogStart,
    ModalPart,
    ThermalLog,
    ThermalModel,
    identify,
    parse_input,
    records_of,
    simulate_from_rest,
    simulate_modal,
    simulate_switched,
    verify,
    with_one_clock,
    without_faults,
)

FL_THERMAL = Path(__file__).resolve().parents[2] / (
    "shared/data/thermal/fl_thermal/fl_thermal_15s_rows_0_8891.csv"
)
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


def leaps(count: int) -> Change:
    def put(columns: Columns, rng: np.random.Generator) -> None:
        z = columns["Z_um"]
        for k in range(count):
            row = int(z.size * (k + rng.uniform(0.6, 1.4)) / (count + 1))
            z[row:] += rng.choice([-1.0, 1.0]) * rng.uniform(4.0, 40.0)

    return put


def both(*changes: Change) -> Change:
    def put(columns: Columns, rng: np.random.Generator) -> None:
        for change in changes:
            change(columns, rng)

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


def coolant(columns: Columns, rng: np.random.Generator) -> None:
    """Switch a coolant every 20 to 90 minutes: 3000 s and 26 um/K dry are 900 s and 12 wet."""
    time_s, step_s = columns["time_s"], float(columns["time_s"][1])
    edges_s = np.cumsum(rng.uniform(1200.0, 5400.0, 1 + int(time_s[-1] / 1200.0)))
    on = (np.searchsorted(edges_s, time_s) + rng.integers(2)) % 2 == 1
    u = (columns["T_spindle_c"] - columns["T_column_c"])[:, None]
    u = u - u[: max(1, round(60.0 / step_s))].mean()
    dry, wet = (
        ThermalModel((ModalPart("spindle", 0.0, np.array([gain]), np.array([tau_s])),))
        for gain, tau_s in ((26.0, 3000.0), (12.0, 900.0))
    )
    columns["Z_um"] += simulate_switched((dry, wet), step_s, u, on)
    columns["Z_um"] -= simulate_from_rest(dry, step_s, u)
    columns["coolant_on"] = on.astype(np.float64)


def unlogged(columns: Columns, rng: np.random.Generator) -> None:
    """Switch the coolant, and log nothing of it."""
    coolant(columns, rng)
    del columns["coolant_on"]


def nothing(_: Columns, __: np.random.Generator) -> None:
    """Leave the log as it is."""


FAULTS: dict[str, tuple[Change, Change]] = {
    "healthy": (nothing, nothing),
    "stuck": (second_half(None), second_half(np.nan)),
    "850": (second_half(850.0), second_half(np.nan)),
    "rezero_37": (leap(37.0), nothing),
    "rezero_5": (leap(5.0), nothing),
    "rezero_8x": (leaps(8), nothing),
    "stuck+37": (both(second_half(None), leap(37.0)), second_half(np.nan)),
    "late_900": (late(900.0), together(900.0)),
    "early_900": (late(-900.0), together(-900.0)),
    "late_600": (late(600.0), together(600.0)),
    "late_90": (late(90.0), together(90.0)),
    "early_90": (late(-90.0), together(-90.0)),
    "drift_3K": (drifting, nothing),
    "coolant": (coolant, coolant),
    "coolant_unlogged": (unlogged, unlogged),
}
"""The fault, and what a person who knows of it would make of the log."""
REGIMES = (coolant, unlogged)
"""Changes that the test simulated has too: the free run switches where a column tells when."""


@dataclass(frozen=True)
class Trained:
    """What became of a log."""

    fit_percent: float
    said: tuple[Message, ...]


def mended(log: ThermalLog, inputs: tuple[InputDefinition, ...] = INPUTS) -> ThermalLog:
    """Act on faults as the command does."""
    output = next(name for name, unit in log.units.items() if unit == "um")
    return with_one_clock(without_faults(log), inputs, [output])


def identified(
    change: Change, seed: int, plan: ThermalTestPlan
) -> tuple[ThermalLog, Identification]:
    columns = {n: v.copy() for n, v in generate_thermal_test(plan, seed).columns().items()}
    change(columns, np.random.default_rng([seed, 9]))
    log = mended(ThermalLog.from_columns(columns))
    return log, identify(records_of([log], INPUTS, ["Z_um"]))


def trained(change: Change, seed: int, plan: ThermalTestPlan) -> Trained:
    """Return the fit of a model of a changed log on another cold test, and what was said."""
    other = generate_thermal_test(plan, OTHER + seed)
    log, found = identified(change, seed, plan)
    first = other.time_s <= 60.0
    u = other.u_k - other.u_k[first].mean(axis=0)
    judged, output = other.columns(), found.outputs[0]
    if change in REGIMES:
        coolant(judged, np.random.default_rng([seed, 10]))
    z = judged["Z_um"] - judged["Z_um"][first].mean()
    simulated = simulate_modal(output.model, plan.sample_time_s, u)
    if output.regimes:
        on = judged["coolant_on"] > 0.0
        simulated = simulate_switched(output.regimes[0].models, plan.sample_time_s, u, on)
    return Trained(fit_percent(z, simulated), (*log.remarks, *found.messages))


def warm(seed: int, plan: ThermalTestPlan, start: LogStart | None) -> Trained:
    """Return the fit of a model of a cold log, verified on a warm one."""
    log, found = identified(nothing, seed, plan)
    model = found.to_compensation_model(records_of([log], INPUTS, ["Z_um"]))
    columns = generate_thermal_test(replace(plan, warm_up_h=3.0), OTHER + seed).columns()
    verified = verify(model, [ThermalLog.from_columns(columns)], start=start)
    fit = verified.pooled["Z_um"].fit_percent
    return Trained(float("nan") if fit is None else fit, verified.warnings)


def healthy(count: int) -> Iterator[tuple[str, ThermalLog, tuple[InputDefinition, ...]]]:
    """Return logs without a fault, and the inputs they have."""
    for kind in KINDS:
        for seed in range(count):
            columns = machine_log(kind, 8.0, 9000 + seed, step_s=10.0).columns()
            yield f"{kind}, seed {9000 + seed}", ThermalLog.from_columns(columns), INPUTS
    if FL_THERMAL.exists():
        log = read_thermal_log(FL_THERMAL)
        log = log.span(0, log.rows // 2)
        names = [name for name, unit in log.units.items() if unit == "degC"]
        yield "FL_THERMAL", log, tuple(parse_input(name, channels=names) for name in names)


def show_row(name: str, fits: list[Trained], known: list[Trained], *, each: bool) -> None:
    said = Counter(message.code for one in fits for message in one.said)
    words = ", ".join(f"{code} {count}" for code, count in sorted(said.items()))
    values = [one.fit_percent for one in fits]
    best = np.median([one.fit_percent for one in known])
    print(
        f"{name:12s} {np.median(values):10.1f} {min(values):7.1f} {best:7.1f}  {words}", flush=True
    )
    for seed, one in enumerate(fits if each else []):
        print(f"  {seed}: {one.fit_percent:.1f} {[(m.code, dict(m.values)) for m in one.said]}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--step", type=float, default=1.0)
    parser.add_argument("--hours", type=float, default=8.0)
    parser.add_argument("--rows", default=",".join([*FAULTS, "warm"]))
    parser.add_argument("--healthy", type=int, default=50)
    parser.add_argument("--show", action="store_true")
    asked = parser.parse_args()
    plan, seeds = plan_of(asked.hours, asked.step), range(asked.seeds)
    print(f"{'fault':12s} {'median fit':>10s} {'least':>7s} {'known':>7s}  said (logs)")
    for name in filter(None, asked.rows.split(",")):
        if name == "warm":
            found, best, rest = (
                [warm(seed, plan, start) for seed in seeds]
                for start in (None, LogStart.FITTED, LogStart.REST)
            )
            show_row(name, found, best, each=asked.show)
            show_row("  from rest", rest, best, each=False)
            continue
        change, known = FAULTS[name]
        found = [trained(change, seed, plan) for seed in seeds]
        best = [trained(known, seed, plan) for seed in seeds]
        show_row(name, found, best, each=asked.show)
    acted, logs = 0, 0
    for name, log, inputs in healthy(asked.healthy):
        after, logs = mended(log, inputs), logs + 1
        same = (np.array_equal(v, after.columns[n], equal_nan=True) for n, v in log.columns.items())
        acted += not all(same)
        for message in after.remarks:
            print(f"  {name}: {message.code} {dict(message.values)}")
    print(
        f"logs without a fault in which anything was masked, joined or shifted: {acted} of {logs}"
    )


if __name__ == "__main__":
    main()
