"""`thermal-test evaluate` on a log of a spindle test: figures, cases, and set-ups it refuses."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from tests.unit.cli.refusals import refusal
from thermaxis.cli import main
from thermaxis.compensation import CompensationModel, Output, Part, Provenance, TrainingLog
from thermaxis.files import write_model, write_thermal_log
from thermaxis.thermal import ThermalLog

SETUP = """
ambient = ["T_room_C"]
[probes]
x1 = "X1_um"
x2 = "X2_um"
z = "Z_mm"
distance_mm = 200
[motion]
speed = "n_rpm"
[uncertainty]
probe_um = 0.2
"""


def log_of(share: float) -> ThermalLog:
    time_s = np.arange(0.0, 6 * 3600.0 + 1.0, 60.0)
    rise = share * -np.expm1(-np.clip(time_s - 600.0, 0.0, 4 * 3600.0) / 3000.0)
    columns = {
        "n_rpm": np.where((time_s >= 600.0) & (time_s <= 15000.0), 8000.0, 0.0),
        "X1_um": 10.0 * rise,
        "X2_um": 6.0 * rise,
        "Z_mm": 0.03 * rise,
        "T_spindle_C": 22.0 + 12.0 * rise,
        "T_room_C": 21.0 + time_s / 36000.0,
    }
    return ThermalLog.from_columns(columns, time_s=time_s)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("thermal_test")
    write_thermal_log(log_of(1.0), folder / "log.csv")
    write_thermal_log(log_of(0.25), folder / "in_force.csv")
    (folder / "setup.toml").write_text(SETUP, encoding="ascii")
    part = Part("spindle", "T_spindle_C", direct_gain_um_per_k=10.0 / 12.0)
    model = CompensationModel(outputs=(Output("X1_um", (part,)),))
    write_model(model, folder / "model.json")
    return folder


def words_of(folder: Path, kind: str = "spindle", setup: str = "setup.toml") -> list[str]:
    words = ["thermal-test", "evaluate", str(folder / "log.csv"), "--kind", kind]
    return [*words, "--setup", str(folder / setup)]


def test_the_three_cases_stand_beside_each_other(folder: Path, capsys) -> None:
    words = [*words_of(folder), "--model", str(folder / "model.json")]
    words += ["--in-force", str(folder / "in_force.csv"), "--json", str(folder / "out.json")]
    assert main(words) == 0
    shown = capsys.readouterr().out
    assert "Y1" in next(line for line in shown.splitlines() if "not measured" in line)
    found = json.loads((folder / "out.json").read_text(encoding="ascii"))
    ranges = {
        case["case"]: {one["name"]: one["whole"]["value"] for one in case["quantities"]}
        for case in found["cases"]
    }
    hot = -np.expm1(-4 * 3600.0 / 3000.0)
    expected = {"X1": 10.0 * hot, "X2": 6.0 * hot, "Z": 30.0 * hot, "B": 20.0 * hot}
    assert ranges["measured"] == pytest.approx(expected, rel=1e-4)
    assert ranges["in_force"] == pytest.approx({n: v / 4 for n, v in expected.items()}, rel=1e-3)
    left = {**expected, "X1": 0.0, "X2": 4.0 * hot}
    assert ranges["left_by_model"] == pytest.approx(left, rel=1e-3, abs=1e-2)


def test_what_is_left_is_as_coarse_as_what_was_read_and_the_other_log_is_told_of_too(
    folder: Path,
) -> None:
    log = log_of(1.0)
    coarse = {name: np.round(v) if name == "X1_um" else v for name, v in log.columns.items()}
    for name in ("coarse", "other"):
        write_thermal_log(
            ThermalLog.from_columns(coarse, time_s=log.time_s), folder / f"{name}.csv"
        )
    words = [*words_of(folder), "--model", str(folder / "model.json"), "--mask", "Z_mm=20..45"]
    words[2] = str(folder / "coarse.csv")
    words += ["--in-force", str(folder / "other.csv"), "--json", str(folder / "coarse.json")]
    assert main(words) == 0
    found = json.loads((folder / "coarse.json").read_text(encoding="ascii"))
    for case in found["cases"]:
        x1 = next(one["whole"] for one in case["quantities"] if one["name"] == "X1")
        assert x1["standard_uncertainties"]["resolution"] == pytest.approx(1.0 / 6**0.5)
    told = [(one["code"], one["place"].get("file")) for one in found["warning_codes"]]
    assert told.count(("warning-thermal_test_gap", None)) == 1
    assert told.count(("warning-thermal_test_gap", "other")) == 1
    assert [code for code, _ in told].count("warning-thermal_test_probes_missing") == 1


@pytest.mark.parametrize(
    ("code", "key", "old", "new"),
    [
        ("probe_distance_missing", "probes.distance_mm", "distance_mm = 200", ""),
        ("probe_without_first", "probes.x2", 'x1 = "X1_um"', ""),
        ("unknown_key", "probes.w", "[probes]", '[probes]\nw = "Z_mm"'),
        ("no_number", "uncertainty.probe_um", "probe_um = 0.2", 'probe_um = "0.2"'),
    ],
)
def test_a_set_up_that_cannot_be_is_refused_with_its_place(
    folder: Path, code: str, key: str, old: str, new: str
) -> None:
    (folder / "bad.toml").write_text(SETUP.replace(old, new), encoding="ascii")
    error = refusal(*words_of(folder, setup="bad.toml"))
    assert (error.code, error.place.key) == (code, key)
    assert error.place.file.endswith("bad.toml")


def test_a_log_that_lacks_what_the_set_up_names_is_refused(folder: Path) -> None:
    for old, new, code in (
        ('z = "Z_mm"', 'z = "W_um"', "unknown_column"),
        ('z = "Z_mm"', 'z = "T_room_C"', "wrong_unit"),
        ('speed = "n_rpm"', "", "motion_missing"),
    ):
        (folder / "bad.toml").write_text(SETUP.replace(old, new), encoding="ascii")
        assert refusal(*words_of(folder, setup="bad.toml")).code == code
    assert refusal(*words_of(folder, "linear")).code == "targets_missing"


def test_a_model_of_other_channels_is_refused(folder: Path) -> None:
    model = CompensationModel(outputs=(Output("W_um", (Part("spindle", "T_spindle_C"),)),))
    write_model(model, folder / "other.json")
    error = refusal(*words_of(folder), "--model", folder / "other.json")
    assert error.code == "model_not_of_test"


def test_a_log_from_which_the_model_was_identified_proves_nothing_and_it_is_said(
    folder: Path, capsys
) -> None:
    part = Part("spindle", "T_spindle_C", direct_gain_um_per_k=0.5)
    digest = hashlib.sha256((folder / "log.csv").read_bytes()).hexdigest()
    provenance = Provenance(logs=(TrainingLog("log.csv", digest, 361),))
    model = CompensationModel(outputs=(Output("X1_um", (part,)),), provenance=provenance)
    write_model(model, folder / "own.json")
    for name, told in (("own", True), ("model", False)):
        assert main([*words_of(folder), "--model", str(folder / f"{name}.json")]) == 0
        assert ("identified on this log" in capsys.readouterr().out) == told


@pytest.mark.parametrize(
    ("channel", "rows", "value", "finding"),
    [
        ("Z_mm", slice(100, 273), 0.028, "remark-rows_stuck"),
        ("T_room_C", slice(None), 850.0, "remark-values_no_measurement"),
    ],
)
def test_values_that_were_set_aside_are_not_said_to_be_missing_from_the_file(
    folder: Path, channel: str, rows: slice, value: float, finding: str
) -> None:
    log, rng = log_of(1.0), np.random.default_rng(4)
    columns = {name: v + rng.normal(0.0, 1e-5, v.size) for name, v in log.columns.items()}
    columns[channel][rows] = value
    write_thermal_log(ThermalLog.from_columns(columns, time_s=log.time_s), folder / "held.csv")
    words = words_of(folder)
    words[2] = str(folder / "held.csv")
    error = refusal(*words)
    assert (error.code, error.place.column) == ("thermal_test_values_set_aside", channel)
    assert error.values["finding"].code == finding
    assert (main([*words, "--as-logged"]) == 0) == (finding == "remark-rows_stuck")
