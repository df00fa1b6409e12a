"""The default model on public records beside ridge on lags, static regression and ARX.

The records lie in ../shared/data/thermal: two runs of one printer's frame, one of another (bursts
of touches, averaged to a minute here; readings that differ from their neighbours by more than 100
µm left out), and DaISy's steam generator. Every method is learned on the same rows with the same
inputs and run by the same `verify`, with the same rule for the start of the log judged. Figures
are mean absolute errors on rows that were not learned from, in µm (of the steam generator: its
units).

    python benchmarks/real_records.py
"""

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from scipy.io import loadmat

from thermaxis.errors import ThermaxisError
from thermaxis.files import read_thermal_log
from thermaxis.thermal import (
    Baseline,
    LogStart,
    MeasuredOutput,
    Method,
    ModalPart,
    Records,
    ThermalLog,
    ThermalModel,
    fit_baseline,
    identify,
    parse_input,
    records_of,
    verify,
)

DATA = Path(__file__).resolve().parents[2] / "shared/data/thermal"
MAPPING = """
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
FRAMES = {
    "annex": ("annex_k3_2021-07-05.csv", 1.25, 13_000.0),
    "voron 06-05": ("voron_2021-06-05_13-24-32.csv", 2.5, 201_300.0),
    "voron 06-13": ("voron_2021-06-13_05-41-53.csv", 2.5, 224_600.0),
}
STARTS = {"evidence": None, "rest": LogStart.REST, "fitted": LogStart.FITTED}


class Case(NamedTuple):
    """What is learned from, and what is judged."""

    name: str
    learn: ThermalLog
    judge: ThermalLog
    rows: tuple[int, int] | None
    inputs: Sequence[str]
    output: str


def frame(name: str) -> ThermalLog:
    """Return a run of a frame in means of a minute."""
    file, step_um, offset_um = FRAMES[name]
    with TemporaryDirectory() as folder:
        mapping = Path(folder) / "map.toml"
        mapping.write_text(MAPPING.format(step_um=step_um, offset_um=offset_um), encoding="utf-8")
        log = read_thermal_log(DATA / "frames" / file, mapping=mapping)
    columns = {key: np.array(log.columns[key]) for key in ("frame_C", "chamber_C", "bed_C", "z_um")}
    z = columns["z_um"]
    around = np.lib.stride_tricks.sliding_window_view(np.pad(z, 15, mode="reflect"), 31)
    z[np.abs(z - np.median(around, axis=1)) > 100.0] = np.nan
    return ThermalLog.from_columns(columns, time_s=log.time_s, name=name).resample(60.0)


def cases() -> Iterator[Case]:
    inputs = ("frame_C", "chamber_C", "bed_C")
    annex, early, late = (frame(name) for name in FRAMES)
    rows = 340 * annex.rows // 570
    yield Case("annex, later", annex.span(0, rows), annex, (rows, annex.rows), inputs, "z_um")
    yield Case("voron, 06-13 by 06-05", early, late, None, inputs, "z_um")
    yield Case("voron, 06-05 by 06-13", late, early, None, inputs, "z_um")
    table = loadmat(DATA / "daisy" / "steamgen.mat")["steamgen"]
    names = tuple(f"u{k}_C" for k in range(1, 5))
    for k in (1, 4):
        columns = dict(zip(names, table[:, 1:5].T, strict=True)) | {"y_um": table[:, 4 + k]}
        log = ThermalLog.from_columns(columns, time_s=table[:, 0], name="steam")
        yield Case(f"steam y{k}, later", log.span(0, 6400), log, (6400, 9600), names, "y_um")


def simple(records: Records, baseline: Baseline, output: str) -> ThermalModel:
    """Return a baseline as a model that runs like any other."""
    fitted = fit_baseline(baseline, records.experiments[output], offset=False)
    pairs = zip(records.inputs, fitted.gains_um_per_k, strict=True)
    taus_s = np.array(fitted.lags_s)
    return ThermalModel(tuple(ModalPart(d.name, float(g[0]), g[1:], taus_s) for d, g in pairs))


def main() -> None:
    print(f"{'record':23s}{'method':8s}" + "".join(f"{name:>19s}" for name in STARTS))
    for case in cases():
        inputs = [parse_input(f"{n[:-2]}={n}", channels=case.learn.columns) for n in case.inputs]
        records = records_of([case.learn], inputs, [case.output])
        found = identify(records)
        methods = {"modal": found, "arx": identify(records, method=Method.ARX)}
        for name, baseline in (("ridge", Baseline.AVERAGES_RIDGE), ("static", Baseline.STATIC)):
            model = simple(records, baseline, case.output)
            methods[name] = replace(found, outputs=(replace(found.outputs[0], model=model),))
        for name, one in methods.items():
            try:
                model = one.to_compensation_model(records)
            except ThermaxisError as error:
                print(f"{case.name:23s}{name:8s} {error}")
                continue
            cells: list[str] = []
            for start in STARTS.values():
                measured = [MeasuredOutput(case.output, case.output)]
                run = verify(model, [case.judge], measured, rows=case.rows, start=start)
                output = run.logs[0].outputs[0]
                cells.append(f"{output.figures.mae_um:10.2f} {output.start.start!s:8s}")
            print(f"{case.name:23s}{name:8s}" + "".join(cells), flush=True)


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main()
