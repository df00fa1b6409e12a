"""A wrong sensor is found before a model is blamed, and a useless model says so."""

import json
from pathlib import Path

import numpy as np
import pytest

from thermaxis.cli import main
from thermaxis.files import read_model, write_thermal_log
from thermaxis.thermal import ThermalLog
from thermaxis.virtual import generate_lathe_test

pytestmark = pytest.mark.usefixtures("one_clock_and_regime")

INPUT = ("--input", "spindle=T_spindle_C-T_column_C")


def written(path: Path, **changed: np.ndarray) -> Path:
    log = generate_lathe_test("spindle")
    columns = {**log.columns, **changed}
    write_thermal_log(ThermalLog.from_columns(columns, time_s=log.time_s), path)
    return path


def identified(path: Path, tmp_path: Path, *words: str) -> dict[str, object]:
    out = tmp_path / "result.json"
    code = main(["identify", str(path), "--output", "Z_um", *words, "--json", str(out)])
    assert code == 0
    return json.loads(out.read_text(encoding="ascii"))


@pytest.mark.parametrize("sentinel", [850.0, -999.0])
def test_readings_of_a_lost_sensor_count_as_missing(tmp_path, sentinel):
    spindle = np.array(generate_lathe_test("spindle").column("T_spindle_C"))
    spindle[1000:1010] = sentinel
    path = written(tmp_path / "log.csv", T_spindle_C=spindle)
    result = identified(path, tmp_path, *INPUT)
    assert result["outputs"]["Z_um"]["fit_percent"] > 98.5
    assert any("count as missing" in w for w in result["warnings"])
    chosen = identified(path, tmp_path, "--candidates", "T_*")
    assert chosen["outputs"]["Z_um"]["fit_percent"] > 90.0


def test_a_stuck_sensor_is_named_when_a_model_is_identified_and_verified(tmp_path, capsys):
    good = written(tmp_path / "good.csv")
    model = tmp_path / "model.json"
    identified(good, tmp_path, *INPUT, "--model", str(model))
    assert read_model(model).channels == ("T_spindle_C", "T_column_C")
    spindle = np.array(generate_lathe_test("spindle").column("T_spindle_C"))
    spindle[600:] = spindle[600]
    stuck = written(tmp_path / "stuck.csv", T_spindle_C=spindle)
    capsys.readouterr()
    assert main(["verify", str(model), str(stuck)]) == 0
    assert "T_spindle_C: stays at" in capsys.readouterr().out
    told = identified(stuck, tmp_path, *INPUT)["warnings"]
    assert any("T_spindle_C: stays at" in one for one in told)


def test_a_model_of_noise_says_that_it_is_not_to_be_used(tmp_path, capsys):
    random = np.random.default_rng(3)
    path = written(tmp_path / "noise.csv", T_spindle_C=22.0 + random.normal(0.0, 2.0, 5040))
    written_to = tmp_path / "model.json"
    result = identified(path, tmp_path, *INPUT, "--model", str(written_to))
    told = {w["code"] for w in result["outputs"]["Z_um"]["warning_codes"]}
    held_out = result["outputs"]["Z_um"]["held_out"]
    assert held_out["what_code"]["code"] == "held_out-later_part"
    assert told & {"warning-not_fit", "warning-explains_nothing"}
    shown = capsys.readouterr().out
    assert "warning-" not in shown
    notes = [line for line in shown.splitlines() if line.startswith(("Z_um: ", "spindle: "))]
    assert "do not use it" in notes[1], "the first note after the headline"
    model = read_model(written_to)
    assert model.provenance.condemned == ("Z_um",)
    assert "do not use it" in model.warnings[0]


def test_candidates_of_a_slower_recorder_are_used_at_their_own_rate(tmp_path):
    log = generate_lathe_test("spindle")
    slow = {}
    for name in ("T_spindle_C", "T_column_C"):
        slow[name] = np.where(np.arange(log.rows) % 6 == 0, log.column(name), np.nan)
    path = written(tmp_path / "slow.csv", **slow)
    result = identified(path, tmp_path, "--candidates", "T_s*", "--candidates", "T_c*")
    assert result["sample_time_s"] == 60.0
    assert result["outputs"]["Z_um"]["fit_percent"] > 90.0


def test_another_probe_is_no_candidate(tmp_path):
    path = written(tmp_path / "log.csv", X_um=np.linspace(0.0, 5.0, 5040))
    result = identified(path, tmp_path, "--candidates", "*")
    names = [part["input"] for part in result["outputs"]["Z_um"]["parts"]]
    assert "X_um" not in names


def test_the_same_log_twice_is_refused(tmp_path, capsys):
    path = written(tmp_path / "log.csv")
    assert main(["identify", str(path), str(path), "--output", "Z_um", *INPUT]) == 2
    assert "given twice" in capsys.readouterr().err
