"""Free-run errors on the public machining-centre record FL_THERMAL, beside baselines.

The record (CAIVIAC/FL_THERMAL, MIT licence) has 16 temperatures and 5 displacements every 15 s
and lies beside the project in ../shared/data. Signals are relative to the mean of their first 20
rows. Everything is chosen inside the rows of `learn` by the rule that the result states; figures
are mean absolute errors on the rows of `judge`, simulated from the first row of the record from
temperatures alone. The baselines are made by the same rule: `static` without lags, `averages` with
four fixed lags, `hold` repeats the last displacement of the rows learned from (for rows before
them: is zero, the reference).

    python benchmarks/fl_thermal.py            splits and sample times
    python benchmarks/fl_thermal.py sensors    frozen and exchanged sensors
    python benchmarks/fl_thermal.py rules      other rules, inside rows 0 to 6668 alone
"""

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from thermaxis.messages import text_of
from thermaxis.thermal import (
    Experiment,
    SelectionOptions,
    SelectionResult,
    ThermalLog,
    faulty_candidates,
    parse_input,
    select,
    sensor_noise_k,
    simulate_modal,
)
from thermaxis.thermal.selection import FIXED_TIME_CONSTANTS_S

Array: TypeAlias = NDArray[np.float64]
RECORD = (
    Path(__file__).resolve().parents[2]
    / "shared/data/thermal/fl_thermal/fl_thermal_15s_rows_0_8891.csv"
)
SAMPLE_TIME_S = 15.0
REFERENCE_ROWS = 20
CHANNELS = tuple(f"ch{i}_um" for i in range(1, 6))
CANDIDATES = tuple(f"t{i}_C" for i in range(1, 17))
PUBLISHED = (3.56, 3.76, 3.70, 3.46, 4.28)
"""Attention model of the record's authors on rows 6669 to 8891. [µm]"""
SPLITS = (
    ((0, 6669), (6669, 8892)),
    ((0, 4445), (4445, 6669)),
    ((0, 5557), (5557, 7780)),
    ((0, 7780), (7780, 8892)),
    ((2223, 8892), (0, 2223)),
)
"""Rows learned from and judged by, half-open."""
WANTED_UM, WANTED_RATIO = 3.0, 1.5
METHODS = {
    "selection": SelectionOptions(),
    "static": SelectionOptions(lag_sets_s=((),)),
    "averages": SelectionOptions(lag_sets_s=(FIXED_TIME_CONSTANTS_S,)),
}


@dataclass(frozen=True, slots=True)
class Record:
    """Temperatures and displacements relative to their first rows."""

    sample_time_s: float
    temperature_k: Array
    displacement_um: Array

    def averaged(self, rows: int) -> "Record":
        """Return means over so many rows."""

        def means(values: Array) -> Array:
            count = values.shape[0] // rows
            return values[: count * rows].reshape(count, rows, -1).mean(axis=1)

        return Record(
            self.sample_time_s * rows, means(self.temperature_k), means(self.displacement_um)
        )


def columns_of(path: Path = RECORD) -> dict[str, Array]:
    """Return the record's columns by name."""
    with path.open(encoding="utf-8") as stream:
        heading = stream.readline().strip().split(",")
        values = np.loadtxt(stream, delimiter=",")
    return dict(zip(heading, values.T, strict=True))


def start_c() -> Array:
    """Return the temperatures that the record is relative to, (16,). [°C]"""
    columns = columns_of()
    return np.array([columns[name][:REFERENCE_ROWS].mean() for name in CANDIDATES])


def read_record() -> Record:
    """Return the record relative to the mean of its first rows."""
    columns = columns_of()

    def relative(names: Sequence[str]) -> Array:
        values = np.column_stack([columns[name] for name in names])
        return values - values[:REFERENCE_ROWS].mean(axis=0)

    return Record(SAMPLE_TIME_S, relative(CANDIDATES), relative(CHANNELS))


def learned(
    record: Record, first: int, last: int, options: SelectionOptions | None = None
) -> SelectionResult:
    """Choose and identify on some rows; one call for all five channels."""
    u = record.temperature_k[first:last]
    outputs = {
        name: [Experiment(record.sample_time_s, u, record.displacement_um[first:last, i])]
        for i, name in enumerate(CHANNELS)
    }
    return select(outputs, candidate_names=CANDIDATES, options=options)


def errors_um(
    result: SelectionResult, record: Record, first: int, last: int, u: Array | None = None
) -> Array:
    """Return the mean absolute errors of a free run from the record's first row, (5,)."""
    temperature_k = record.temperature_k if u is None else u
    found: list[float] = []
    for i, name in enumerate(CHANNELS):
        model = result.outputs[name].model
        columns = [CANDIDATES.index(part.input_name) for part in model.parts]
        simulated = simulate_modal(model, record.sample_time_s, temperature_k[:, columns])
        residual = (record.displacement_um[:, i] - simulated)[first:last]
        found.append(float(np.mean(np.abs(residual))))
    return np.array(found)


def hold_um(record: Record, learn: Sequence[int], judge: Sequence[int]) -> Array:
    """Return the errors of repeating the last displacement before the rows judged by."""
    y = record.displacement_um
    held = y[learn[1] - 1] if learn[1] <= judge[0] else np.zeros(y.shape[1])
    return np.mean(np.abs(y[judge[0] : judge[1]] - held), axis=0)


def line(name: str, values: Array, note: str = "") -> str:
    return f"  {name:<12}" + "".join(f"{v:8.2f}" for v in values.tolist()) + f"   {note}"


def compare_splits() -> None:
    full = read_record()
    for learn, judge in SPLITS:
        print(f"learn rows {learn[0]}:{learn[1]}, judge rows {judge[0]}:{judge[1]}; MAE in µm")
        for rows in (1, 4, 20):
            record = full.averaged(rows)
            a, b = (-(-learn[0] // rows), learn[1] // rows)
            c, d = (-(-judge[0] // rows), judge[1] // rows)
            found: dict[str, Array] = {}
            notes: dict[str, str] = {}
            for name, options in METHODS.items():
                begin = time.perf_counter()
                result = learned(record, a, b, options)
                passed_s = time.perf_counter() - begin
                found[name] = errors_um(result, record, c, d)
                lags = "+".join(f"{t:g}" for t in result.time_constants_s) or "none"
                notes[name] = (
                    f"lags {lags} s, {result.sensor_uncertainty_k:.3f} K,"
                    f" offset {'free' if result.offset else 'zero'}, {passed_s:.2f} s"
                )
            found["hold"] = hold_um(record, (a, b), (c, d))
            best = np.min(np.stack(list(found.values())), axis=0)
            print(f" {record.sample_time_s:g} s" + "".join(f"{n:>9}" for n in CHANNELS))
            for name, values in found.items():
                print(line(name, values, notes.get(name, "")))
            print(line("over best", found["selection"] / best, f"wanted: <= {WANTED_RATIO:g}"))
            if learn == SPLITS[0][0]:
                print(line("published", np.array(PUBLISHED), f"wanted: <= {WANTED_UM:g} µm"))
    result = learned(full, *SPLITS[0][0])
    print(text_of(result.rule))
    for text in map(text_of, result.warnings):
        print(f"warning: {text}")


def compare_rules() -> None:
    """Judge rules on stretches of the rows learned from: each is hidden, everything else chosen."""
    record = read_record().averaged(4)
    rows = SPLITS[0][0][1] // 4
    u = record.temperature_k[:rows]
    edges = np.linspace(0, rows, 8).round().astype(int).tolist()
    stretches = [(edges[i], edges[i + w]) for w in (1, 2) for i in range(8 - w)]
    found: dict[str, list[Array]] = {}
    for first, last in stretches:
        hidden = record.displacement_um[:rows].copy()
        hidden[first:last] = np.nan
        part = Record(record.sample_time_s, u, hidden)
        default = learned(part, 0, rows)
        best = min(default.structures, key=lambda s: s.score).time_constants_s
        rules = {
            "average": default,
            "best alone": learned(part, 0, rows, SelectionOptions(lag_sets_s=(best,))),
            "fewest": learned(part, 0, rows, SelectionOptions(fewest_channels=True)),
            "offset": learned(part, 0, rows, SelectionOptions(offset=True)),
            "static": learned(part, 0, rows, METHODS["static"]),
            "averages": learned(part, 0, rows, METHODS["averages"]),
        }
        for name, result in rules.items():
            found.setdefault(name, []).append(errors_um(result, record, first, last))
        y = record.displacement_um
        held = y[max(first - 1, 0)]
        found.setdefault("hold", []).append(np.mean(np.abs(y[first:last] - held), axis=0))
    table = {name: np.array(values) for name, values in found.items()}
    best_um = np.min([table[name] for name in ("static", "averages", "hold")], axis=0)
    print(f"{len(stretches)} hidden stretches of 4 and 8 h inside rows 0 to 6668; mean MAE in µm")
    print(" " * 14 + "".join(f"{n:>8}" for n in CHANNELS))
    for name, values in table.items():
        over = float(np.mean(values > WANTED_RATIO * best_um))
        note = f"mean {np.mean(values):.2f}; over {WANTED_RATIO:g} x the best baseline: {over:.0%}"
        print(line(name, values.mean(axis=0), note))


def frozen(u: Array, column: int, first: int, last: int) -> Array:
    """Return inputs of which one stands still in some rows."""
    broken = u.copy()
    broken[first:last, column] = broken[first, column]
    return broken


def without_faulty(record: Record, first: int, last: int) -> SelectionOptions:
    """Return options that leave out what `check_log` finds wrong in the rows learned from."""
    columns = dict(zip(CANDIDATES, (record.temperature_k[first:last] + start_c()).T, strict=True))
    log = ThermalLog.from_columns(columns, sample_time_s=record.sample_time_s)
    inputs = [parse_input(name, channels=CANDIDATES) for name in CANDIDATES]
    return SelectionOptions(faulty=faulty_candidates([log], inputs))


def compare_sensors() -> None:
    record = read_record()
    learn, judge = SPLITS[0]
    noise = sensor_noise_k([Experiment(SAMPLE_TIME_S, record.temperature_k, np.arange(8892.0))])
    print(
        "noise, mK: "
        + ", ".join(f"{n} {1000 * s:.0f}" for n, s in zip(CANDIDATES, noise, strict=True))
    )
    print(line("healthy", errors_um(learned(record, *learn), record, *judge)))
    print("frozen from row 2200 to 4400: found and left out, or not looked for")
    for i, name in enumerate(CANDIDATES):
        broken = Record(
            SAMPLE_TIME_S, frozen(record.temperature_k, i, 2200, 4400), record.displacement_um
        )
        options = without_faulty(broken, *learn)
        result, found = learned(broken, *learn, options), ", ".join(options.faulty) or "nothing"
        print(line(name, errors_um(result, record, *judge), f"left out: {found}"))
        result = learned(broken, *learn)
        print(line("  unchecked", errors_um(result, record, *judge)))
    print("exchanged from row 3000 on")
    start = start_c()
    for i, j in ((4, 8), (0, 4), (3, 10), (2, 14)):
        u = record.temperature_k.copy()
        u[3000:, i], u[3000:, j] = (
            record.temperature_k[3000:, j] + start[j] - start[i],
            record.temperature_k[3000:, i] + start[i] - start[j],
        )
        broken = Record(SAMPLE_TIME_S, u, record.displacement_um)
        for label, options in (
            (f"t{i + 1}, t{j + 1}", without_faulty(broken, *learn)),
            ("  unchecked", SelectionOptions()),
        ):
            result, found = learned(broken, *learn, options), ", ".join(options.faulty) or "nothing"
            print(line(label, errors_um(result, record, *judge), f"left out: {found}"))


if __name__ == "__main__":
    {"sensors": compare_sensors, "rules": compare_rules}.get(
        sys.argv[1] if len(sys.argv) > 1 else "", compare_splits
    )()
