"""The default model on public records beside ridge on lags, static regression and ARX.

The records lie in ../shared/data/thermal and are read as they are, by the mappings below: two runs
of one printer's frame, one of another, and DaISy's steam generator. Models are written by
`thermaxis identify` (ridge on lags and static regression from the same reading, as files too), and
every file is judged by `thermaxis verify` on rows that were not learned from, its start by
evidence, from rest and fitted. A run of another day has no rows before those that count: a fitted
start then takes states and zero from the rows judged themselves. Figures are mean absolute errors
in µm (of the steam generator: its units); `!` marks a default model that is more than 10 % worse
than the best.

    python benchmarks/real_records.py
    python benchmarks/real_records.py pairs     single and paired sensors of FL_THERMAL, from rest
    python benchmarks/real_records.py starts    cold and warm training of machines whose truth is
                                                known, by the odds at which a start is freed
"""

import contextlib
import io
import itertools
import json
import sys
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from tests.thermal_machines import log
from thermaxis.cli import main as thermaxis
from thermaxis.files import read_thermal_log, write_model
from thermaxis.thermal import (
    Baseline,
    Experiment,
    ModalPart,
    ThermalModel,
    compensation_model,
    fit_baseline,
    modal,
    parse_input,
    records_of,
    simulate_modal,
    without_faults,
)
from thermaxis.thermal.modal import _evidence

DATA = Path(__file__).resolve().parents[2] / "shared/data/thermal"
FRAME = """
[time]
column = "time"
format = "%Y/%m/%d-%H:%M:%S"
[columns.mcu_pos_z]
name = "z_um"
unit = "um"
factor = {step_um}
offset = {offset_um}
[columns]
frame_t = "frame_C"
chamber_t = "chamber_C"
bed_t = "bed_C"
"""
STEAM = """
[time]
column = "steamgen_1"
unit = "s"
[columns.steamgen_{number}]
name = "y_um"
unit = "um"
[columns]
steamgen_2 = "u1_C"
steamgen_3 = "u2_C"
steamgen_4 = "u3_C"
steamgen_5 = "u4_C"
"""
STARTS: dict[str, list[str]] = {
    "by evidence": [],
    "from rest": ["--start", "rest"],
    "fitted": ["--start", "fitted"],
}
WANTED = 1.1
MEDIAN_LEARNED = 1.3


class Case(NamedTuple):
    """What is learned from, and what is judged."""

    name: str
    learn: Path
    judge: Path
    mappings: tuple[str, str]
    spans: tuple[str, str]
    inputs: Sequence[str]
    output: str


def cases() -> Iterator[Case]:
    frames = ("frame_C", "chamber_C", "bed_C")
    annex, early, late = (
        (DATA / "frames" / file, FRAME.format(step_um=step_um, offset_um=offset_um))
        for file, step_um, offset_um in (
            ("annex_k3_2021-07-05.csv", 1.25, 13_000.0),
            ("voron_2021-06-05_13-24-32.csv", 2.5, 201_300.0),
            ("voron_2021-06-13_05-41-53.csv", 2.5, 224_600.0),
        )
    )
    for name, (learn, own), (judge, other), spans in (
        ("annex, later", annex, annex, ("0:340", "340:")),
        ("voron, 06-13 by 06-05", early, late, ("0:", "0:")),
        ("voron, 06-05 by 06-13", late, early, ("0:", "0:")),
    ):
        yield Case(name, learn, judge, (own, other), spans, frames, "z_um")
    steam, inputs = DATA / "daisy" / "steamgen.mat", tuple(f"u{k}_C" for k in range(1, 5))
    for k in (1, 4):
        mapping = STEAM.format(number=5 + k)
        spans = ("0:6400", "6400:")
        yield Case(f"steam y{k}, later", steam, steam, (mapping, mapping), spans, inputs, "y_um")


def said(words: Sequence[str]) -> str:
    """Return why a command failed; empty if it did not."""
    told = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(told):
        failed = thermaxis([str(word) for word in words])
    return told.getvalue().strip() if failed else ""


def simple(case: Case, mapping: Path, baseline: Baseline, path: Path) -> None:
    """Write a simple model, learned from what `identify` learns from."""
    read = without_faults(read_thermal_log(case.learn, mapping=mapping))
    first, _, last = case.spans[0].partition(":")
    read = read.span(int(first), int(last or read.rows))
    inputs = [parse_input(f"{n[:-2]}={n}", channels=read.columns) for n in case.inputs]
    records = records_of([read], inputs, [case.output])
    fitted = fit_baseline(baseline, records.experiments[case.output], offset=False)
    pairs = zip(inputs, fitted.gains_um_per_k, strict=True)
    parts = (ModalPart(d.name, float(g[0]), g[1:], np.array(fitted.lags_s)) for d, g in pairs)
    write_model(compensation_model({case.output: ThermalModel(tuple(parts))}, records), path)


def judged(case: Case, folder: Path) -> None:
    mappings = (folder / "learn.toml", folder / "judge.toml")
    for path, text in zip(mappings, case.mappings, strict=True):
        path.write_text(text, encoding="utf-8")
    asked = [w for n in case.inputs for w in ("--input", f"{n[:-2]}={n}")]
    asked += ["--output", case.output, "--span", case.spans[0], "--mapping", mappings[0]]
    found: dict[str, list[float]] = {}
    lines: list[str] = []
    for name in ("modal", "arx", "ridge", "static"):
        model = folder / f"{name}.json"
        why = ""
        if name in ("modal", "arx"):
            why = said(["identify", case.learn, *asked, "--method", name, "--model", model])
        else:
            baseline = Baseline.STATIC if name == "static" else Baseline.AVERAGES_RIDGE
            simple(case, mappings[0], baseline, model)
        cells = ""
        for start, stated in STARTS.items():
            shown = folder / "shown.json"
            words = [*stated, "--span", case.spans[1], "--mapping", mappings[1], "--json", shown]
            why = why or said(["verify", model, case.judge, *words])
            if not why:
                one = json.loads(shown.read_text())["logs"][0]["outputs"][case.output]
                found.setdefault(start, []).append(one["mae_um"])
                cells += f"{one['mae_um']:10.2f} {one['start']:7s}"
        lines.append(f"{case.name:23s}{name:8s}{cells or why.splitlines()[0][:90]}")
    missed = [start for start, (own, *others) in found.items() if own > WANTED * min(others)]
    lines[0] += "  ! " + ", ".join(missed) if missed else ""
    print("\n".join(lines), flush=True)


def pairs(every: int = 8) -> None:
    """Compare on every eighth single or pair of bare sensors of FL_THERMAL, all channels."""
    table = np.genfromtxt(
        DATA / "fl_thermal/fl_thermal_15s_rows_0_8891.csv", delimiter=",", names=True
    )
    rows, step_s, cut = 2223, 60.0, 1667
    means = {n: table[n][: 4 * rows].reshape(-1, 4).mean(axis=1) for n in table.dtype.names}
    means = {n: v - v[:5].mean() for n, v in means.items()}
    names = [f"t{k}_C" for k in range(1, 17)]
    sets = [(n,) for n in names] + list(itertools.combinations(names, 2))
    ratios: list[list[float]] = []
    for sensors, channel in list(itertools.product(sets, range(1, 6)))[::every]:
        u = np.column_stack([means[n] for n in sensors])
        y = means[f"ch{channel}_um"]
        learn = Experiment(step_s, u[:cut], y[:cut])
        fitted = fit_baseline(Baseline.AVERAGES_RIDGE, [learn], offset=False)
        lags = np.array(fitted.lags_s)
        both = zip(sensors, fitted.gains_um_per_k, strict=True)
        ridge = ThermalModel(tuple(ModalPart(n, float(g[0]), g[1:], lags) for n, g in both))
        models = (modal([learn], input_names=sensors).model, ridge)
        left = np.array([y - simulate_modal(model, step_s, u) for model in models])
        error = [np.sqrt(np.mean(part**2, axis=1)) for part in (left[:, :cut], left[:, cut:])]
        ratios.append([float(own / other) for own, other in error])
    middle = np.quantile(ratios, (0.1, 0.5, 0.9, 1.0), axis=0).T
    print(f"{len(ratios)} sets of bare sensors, RMSE over that of ridge on lags, both from rest")
    print("                  p10  median     p90   worst")
    for name, values in zip(("rows learned from", "rows held out"), middle, strict=True):
        print(f"{name:18s}" + "".join(f"{v:8.2f}" for v in values), flush=True)
    if middle[0][1] > MEDIAN_LEARNED or middle[1][1] > WANTED:
        sys.exit("gains lose the level of records whose inputs explain part of the displacement")


def starts(tests: int = 6) -> None:
    """Learn from 8 h of synthetic tests, cold or from the fourth hour on; judge on another one."""
    for kind, first in itertools.product(("direct", "coupled", "remote"), (0, 360)):
        for odds in (5.0, 15.0, 30.0):
            _evidence.REST_ODDS = odds
            fits, freed = [], 0
            for seed in range(300, 300 + tests):
                test, other = (log(kind, 11.0, k, step_s=30.0) for k in (seed, 50_000 + seed))
                ambient = test.temperatures_c[first:, 2]
                u, z = test.u_k[first:], test.z_um[first:] - test.z_um[first : first + 2].mean()
                u = u - (u[:2].mean(axis=0) if first else 0.0)
                rows = slice(960)
                learn = Experiment(30.0, u[rows], z[rows], ambient_k=(ambient - ambient[0])[rows])
                result = modal([learn], input_names=("spindle", "table"))
                rest = [np.zeros(part.gains.size) for part in result.model.parts]
                left = other.z_um - simulate_modal(result.model, 30.0, other.u_k, rest)
                spread = np.linalg.norm(other.z_um - other.z_um.mean())
                fits.append(100.0 * (1.0 - np.linalg.norm(left) / spread))
                freed += any(w.code == "warning-no_steady_start" for w in result.warnings)
            print(
                f"{kind:9s}{'warm' if first else 'cold':6s}e^{odds:<4g}freed {freed} of {tests}"
                f"  fit, %: median {np.median(fits):6.1f}  worst {min(fits):7.1f}",
                flush=True,
            )


def main() -> None:
    print(f"{'record':23s}{'method':8s}" + "".join(f"{name:>18s}" for name in STARTS))
    for case in cases():
        with TemporaryDirectory() as folder:
            judged(case, Path(folder))


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    {"pairs": pairs, "starts": starts}.get((*sys.argv[1:], "")[0], main)()
