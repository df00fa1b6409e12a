"""Write test vectors: runs and logs with their results, against which other programs are held.

Each has an answer in closed form, which the README of the folder states: figures of ISO 230-2 of
runs, and the displacement of models after steps of temperature.
"""

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from thermaxis import __version__
from thermaxis.cli._arguments import adder
from thermaxis.compensation import STATED, CompensationModel, Output, Part, Section
from thermaxis.errors import ConfigurationError
from thermaxis.files import write_model, write_thermal_log, write_tidy_csv
from thermaxis.positioning import (
    FloatArray,
    PositioningTest,
    TimeSource,
    evaluate_adjacent_difference,
    evaluate_iso230_2,
    figures_by_key,
)
from thermaxis.quantities import AxisKind
from thermaxis.thermal import ThermalLog, simulate_log

TARGETS_MM = np.array([3.0, 61.0, 118.0, 182.0, 239.0, 301.0])
CYCLES = 4
REVERSAL_UM, SLOPE_UM_PER_MM, SCATTER_UM, DRIFT_UM_PER_PASS = 3.0, 0.02, 0.5, 1.5
SPINDLE = Part("spindle", "T_spindle_C", "T_column_C", 8.0, (Section(22.0, 1500.0),))
TABLE = Part(
    "table", "T_table_C", "T_column_C", 0.0, (Section(-6.0, 600.0), Section(-14.0, 5400.0))
)
STEP_K, ROWS, EVERY_S = {"T_spindle_C": 10.0, "T_table_C": 5.0}, 721, 60.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    adder(parser)("folder FOLDER", "the folder to write, new or empty", Path)


def run(arguments: argparse.Namespace) -> int:
    """Write the folder."""
    folder: Path = arguments.folder
    if lying := sorted(folder.iterdir()) if folder.is_dir() else []:
        raise ConfigurationError("folder_not_empty", file=folder, key="FOLDER", name=lying[0].name)
    try:
        for part in ("positioning", "thermal"):
            (folder / part).mkdir(parents=True)
    except OSError as error:
        cause = error.strerror or type(error).__name__
        raise ConfigurationError(
            "folder_unwritable", file=folder, key="FOLDER", cause=cause
        ) from error
    for name, test in positioning_tests():
        write_tidy_csv(test, folder / "positioning" / f"{name}.csv")
        _write_json(folder / "positioning" / f"{name}.json", _figures(test))
    for name, model in models():
        log = step_log()
        write_model(model, folder / "thermal" / f"{name}.model.json")
        found = simulate_log(model, log).outputs["Z_um"].displacement_um
        answer = ThermalLog.from_columns({"Z_um": found}, time_s=log.time_s)
        write_thermal_log(answer, folder / "thermal" / f"{name}.csv", first_time_s=0.0)
    write_thermal_log(step_log(), folder / "thermal" / "step.csv", first_time_s=0.0)
    (folder / "README.md").write_text(README, encoding="utf-8")
    sys.stdout.write(f"written: {folder}, README.md says what each file is\n")
    return 0


def positioning_tests() -> Iterator[tuple[str, PositioningTest]]:
    """Yield the runs by name: a line with reversal, with scatter, and with drift."""
    forward = np.ones(CYCLES)
    line = SLOPE_UM_PER_MM * (TARGETS_MM - TARGETS_MM[0])
    both = np.stack([line, line - REVERSAL_UM], axis=-1)[:, None, :] * forward[None, :, None]
    signs = np.where(np.arange(CYCLES) % 2 == 0, 1.0, -1.0)
    passes = 2.0 * np.arange(CYCLES)[:, None] + np.arange(2)
    for name, added in (
        ("line", np.zeros((CYCLES, 2))),
        ("scatter", SCATTER_UM * signs[:, None] * np.ones(2)),
        ("drift", DRIFT_UM_PER_PASS * passes),
    ):
        yield name, _timed(both + added[None])


def _timed(deviation: FloatArray) -> PositioningTest:
    order = np.empty_like(deviation)
    m = TARGETS_MM.size
    for cycle in range(CYCLES):
        order[:, cycle, 0] = 2 * m * cycle + np.arange(m) + 1
        order[:, cycle, 1] = 2 * m * cycle + m + np.arange(m)[::-1] + 1
    return PositioningTest(
        AxisKind.LINEAR,
        TARGETS_MM,
        deviation,
        TimeSource.FILE,
        time_s=10.0 * (order - 1),
        order=order,
        header={"axis": "X", "title": "test vector"},
    )


def models() -> Iterator[tuple[str, CompensationModel]]:
    """Yield the models by name: one section, two, and both superposed."""
    for name, parts in (("spindle", (SPINDLE,)), ("table", (TABLE,)), ("both", (SPINDLE, TABLE))):
        model = CompensationModel(outputs=(Output("Z_um", parts),), sample_time_s=EVERY_S)
        counted = dict.fromkeys(model.channels, 20.0)
        yield name, replace(model, reference=STATED, reference_c=counted)


def step_log() -> ThermalLog:
    """Return a log at rest in its first row, and after steps of both temperatures from then on."""
    columns = {"T_column_C": np.full(ROWS, 20.0)}
    for name, step_k in STEP_K.items():
        columns[name] = np.where(np.arange(ROWS) > 0, 20.0 + step_k, 20.0)
    return ThermalLog.from_columns(columns, time_s=EVERY_S * np.arange(ROWS))


def _figures(test: PositioningTest) -> dict[str, object]:
    neighbours = evaluate_adjacent_difference(test).forward
    spread = [] if neighbours is None else [float(s) for s in neighbours.standard_deviation]
    return {
        "program": f"thermaxis {__version__}",
        "unit": "um",
        "iso230_2": figures_by_key(evaluate_iso230_2(test)),
        "standard_deviation_of_neighbours": spread,
    }


def _write_json(path: Path, content: dict[str, object]) -> None:
    path.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")


_LENGTH_MM, _HOURS = TARGETS_MM[-1] - TARGETS_MM[0], (ROWS - 1) * EVERY_S / 3600.0
_SPINDLE_K, _TABLE_K = STEP_K.values()
README = f"""# Test vectors of thermaxis

Run yours on the inputs, and compare: numbers have the digits of binary64, agree to 1e-9 um.

## positioning/

`NAME.csv` is a run, one reading in a row; `NAME.json` has its figures of ISO 230-2 in um, and the
standard deviation of the differences of neighbours, forward, which is 0 in all of them to 1e-9 um.
x: distance from the first target, L = {_LENGTH_MM:g} mm, a = {SLOPE_UM_PER_MM:g} um/mm,
b = {REVERSAL_UM:g} um, n = {CYCLES} cycles.

* line: a x forward, a x - b backward. B = R = b, M = a L, E = A = a L + b.
* scatter: the same, +d and -d in turn, d = {SCATTER_UM:g} um. s = d sqrt(n/(n-1)),
  R forward = 4 s, R = 4 s + b, A = a L + b + 4 s.
* drift: as line, and q = {DRIFT_UM_PER_PASS:g} um more in every pass.
  s = 2 q sqrt(n (n+1)/12), B = b - q, R forward = 4 s, R = 4 s + B.

## thermal/

`step.csv` has temperatures: 20 degC in the first row, then the spindle is {_SPINDLE_K:g} K and the
table {_TABLE_K:g} K warmer for {_HOURS:g} h. `NAME.model.json` is a model, `NAME.csv` its
displacement Z_um in free run.

A model is a sum of parts: a direct gain g, and sections of gain c and time constant tau, on a
difference u of temperatures, which counts from 0 K and stands from row to row.
In row k = 1, 2, ... Z is the sum of u (g + sum of c (1 - exp(-(k-1) T / tau))), T = {EVERY_S:g} s.
"""
