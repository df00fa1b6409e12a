"""What `identify` prints of a model is what the model file does, on every public record."""

import json
import re
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from scipy.io import loadmat

from thermaxis.cli import main

pytestmark = [
    pytest.mark.real_data,
    pytest.mark.proof,
    pytest.mark.usefixtures("one_clock_and_regime"),
]

ROWS = 150
"""Rows of each record: enough for all methods, and quick."""


def columns_of(thermal: Path, record: str) -> dict[str, np.ndarray]:
    """Return the inputs (C) and displacements (um) of a record, at even times."""
    if record == "fl_thermal":
        table = pl.read_csv(thermal / "fl_thermal" / "fl_thermal_15s_rows_0_8891.csv")[::30]
        names = {"time_s": "time_s", "t5_C": "u1_C", "t1_C": "u2_C", "ch3_um": "y_um"}
        return {new: table[old].to_numpy() for old, new in names.items()}
    if record.startswith(("voron", "annex")):
        (path,) = (thermal / "frames").glob(f"{record}_*.csv")
        lines = [line for line in path.read_text().splitlines() if line and line[0] != "#"]
        table = pl.read_csv("\n".join(lines).encode())
        table = table.group_by("sample", maintain_order=True).agg(pl.exclude("time").mean())
        inputs = {"u1_C": table["frame_t"].to_numpy(), "u2_C": table["bed_t"].to_numpy()}
        y = 2.5 * table["mcu_pos_z"].to_numpy()
        return {"time_s": 60.0 * np.arange(y.size), **inputs, "y_um": y}
    if record == "steamgen":
        (rows,) = (v for k, v in loadmat(thermal / "daisy" / "steamgen.mat").items() if k[0] != "_")
        rows = np.asarray(rows)[::8]
        inputs = {f"u{i}_C": rows[:, -9 + i] for i in (1, 3)}
        return {"time_s": 24.0 * np.arange(len(rows)), **inputs, "y_um": rows[:, -4]}
    path, step_s, u, y, header = {
        "dryer": ("daisy/dryer.dat", 0.08, 0, 1, 0),
        "heating": ("daisy/heating_system.dat", 2.0, 1, 2, 0),
        "seriesJ": ("seriesJ/seriesJ.csv", 9.0, 0, 1, 1),
        "arxsim": ("sysid_R/arxsim.csv", 1.0, 1, 0, 1),
        "oesim": ("sysid_R/oesim.csv", 1.0, 1, 0, 1),
    }[record]
    comma = "," if path.endswith(".csv") else None
    rows = np.loadtxt(thermal / path, delimiter=comma, skiprows=header)
    rows = rows[:: 5 if record == "heating" else 1]
    return {"time_s": step_s * np.arange(len(rows)), "u1_C": rows[:, u], "y_um": rows[:, y]}


def run(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    code = main(words)
    said = capsys.readouterr()
    assert code == 0, said.err
    return said.out


CASES = """
    fl_thermal modal, annex arx, voron_2021-06-05 oe --orders 1,2,0, voron_2021-06-13 modal,
    steamgen arx, dryer oe --orders 1,2,0, heating modal, seriesJ arx, arxsim oe --orders 1,2,0,
    oesim modal, oesim oe, oesim arx
"""


@pytest.mark.parametrize(
    ("record", "method"), [case.split(maxsplit=1) for case in re.split(r",\s+", CASES)]
)
def test_the_written_model_does_what_is_printed_of_it(
    record: str,
    method: str,
    real_data: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    columns = {k: v[:ROWS] for k, v in columns_of(real_data / "thermal", record).items()}
    log, model = tmp_path / "log.csv", tmp_path / "model.json"
    pl.DataFrame(columns).write_csv(log)
    inputs = [w for name in columns if name[0] == "u" for w in ("--input", f"{name[:2]}={name}")]
    asked = [*inputs, "--output", "y_um", "--method", *method.split(), "--model", str(model)]
    said = run(["identify", str(log), *asked, "--json", str(tmp_path / "said.json")], capsys)
    shown = run(
        ["verify", str(model), str(log), "--json", str(tmp_path / "done.json")],
        capsys,
    )
    assert said.count("\n") <= 40
    own = json.loads((tmp_path / "said.json").read_text())["outputs"]["y_um"]
    verified = json.loads((tmp_path / "done.json").read_text())
    done = verified["outputs"]["y_um"]
    assert own["start"] == [verified["logs"][0]["outputs"]["y_um"]["start"]]
    assert own["fit_percent"] == done["fit_percent"]
    assert own["training_rmse_um"]["model"] == done["rmse_um"]
    assert own["training_rmse_um"]["static"] == done["static_rmse_um"]
    assert f"fit {done['fit_percent']:.1f} %" in said
    assert f"{done['rmse_um']:.2f}" in said.partition("RMSE in free run")[2]
    assert f"{done['rmse_um']:.2f}" in shown
