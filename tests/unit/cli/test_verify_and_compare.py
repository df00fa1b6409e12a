"""What `verify` and `compare` are asked for they do, and they change nothing of what judges."""

import json
from argparse import ArgumentParser
from pathlib import Path

import numpy as np
import pytest

from thermaxis.cli import main
from thermaxis.cli._arguments import adder
from thermaxis.cli.thermal import _thermal_logs
from thermaxis.compensation import CompensationModel, Output, Part, Section
from thermaxis.files import write_model, write_thermal_log
from thermaxis.thermal import ThermalLog, with_one_clock

pytestmark = pytest.mark.usefixtures("one_clock_and_regime")
LAGS = (Section(8.0, 900.0), Section(12.0, 5000.0))
MODEL = CompensationModel(outputs=(Output("Z_um", (Part("spindle", "T_C", "", 0.0, LAGS),)),))


def written(folder: Path, *, states_k: float = 4.0, late_rows: int = 0) -> tuple[str, str]:
    """Write the model, and 9 h of warming that began with its lags so warm."""
    random = np.random.default_rng(7)
    time_s = np.arange(0.0, 9 * 3600.0, 60.0)
    rise = np.zeros(time_s.size)
    z = random.normal(0.0, 0.2, time_s.size)
    for edge_s, step_k in ((0.0, 2.0), (3600.0, 6.0), (4 * 3600.0, -5.0), (6 * 3600.0, 3.0)):
        since_s = np.maximum(time_s - edge_s, 0.0)
        rise += step_k * (time_s >= edge_s)
        z += sum(s.gain_um_per_k * step_k * -np.expm1(-since_s / s.time_constant_s) for s in LAGS)
    z += sum(s.gain_um_per_k * states_k * np.exp(-time_s / s.time_constant_s) for s in LAGS)
    if late_rows:
        z = np.concatenate((random.normal(0.0, 0.2, late_rows), z[:-late_rows]))
    t = 20.0 + rise + random.normal(0.0, 0.02, rise.size)
    t[0] = 20.0
    write_model(MODEL, folder / "model.json")
    write_thermal_log(
        ThermalLog.from_columns({"T_C": t, "Z_um": z}, time_s=time_s), folder / "log.csv"
    )
    return str(folder / "model.json"), str(folder / "log.csv")


def result(folder: Path, command: str, *words: str) -> dict:
    assert main([command, *words, "--json", str(folder / "out.json")]) == 0
    return json.loads((folder / "out.json").read_text(encoding="ascii"))


def test_each_start_that_is_asked_for_is_run_and_said(tmp_path, capsys):
    words = written(tmp_path)
    rmse: dict[str, float] = {}
    for start in ("rest", "steady", "fitted"):
        found = result(tmp_path, "verify", *words, "--start", start)
        shown = capsys.readouterr().out
        assert ("did not begin at rest" in shown) == (start == "fitted")
        assert "remark-start" not in shown
        rmse[start] = found["outputs"]["Z_um"]["rmse_um"]
        assert found["logs"][0]["outputs"]["Z_um"]["start"] == start
        (compared,) = result(tmp_path, "compare", *words, "--start", start)["models"]
        assert compared["outputs"]["Z_um"]["rmse_um"] == rmse[start]
    assert len({round(value, 3) for value in rmse.values()}) == 3
    assert rmse["fitted"] == pytest.approx(0.2, rel=0.5)
    (tmp_path / "limits.toml").write_text(
        "[Z_um]\nlargest_um = 900.0\nlargest_rate_um_per_s = 90.0\n", encoding="utf-8"
    )
    capsys.readouterr()
    limits = ("--start", "fitted", "--limits", str(tmp_path / "limits.toml"))
    found = result(tmp_path, "verify", *words, *limits)
    assert "begun at rest" in capsys.readouterr().out
    limited = found["logs"][0]["outputs"]["Z_um"]["limited"]
    assert limited["rmse_um"] == pytest.approx(rmse["rest"], rel=0.01)


def test_touches_are_the_same_for_a_seed_and_stand_in_the_json_by_channel(tmp_path, capsys):
    words = written(tmp_path)
    often = ("--touch-every", "60min", "--touch-noise-um", "0.5")
    first, again, other = (
        result(tmp_path, "verify", *words, *often, "--seed", seed)["touches"] for seed in "112"
    )
    assert first == again != other
    assert "model and offset" in capsys.readouterr().out
    assert first["Z_um"]["with_offset_mae_um"] < first["Z_um"]["free_run_mae_um"]
    by_need = {
        um: result(tmp_path, "verify", *words, "--touch-within-um", um)["touches"]["Z_um"]
        for um in ("2", "9")
    }
    assert by_need["2"]["touches"] > by_need["9"]["touches"] == 0, "known without touches"
    assert by_need["2"]["wanted_um"] == 2.0
    for refused in (
        ("--touches", "Z_um", "--touch-every", "1h"),
        ("--touch-within-um", "2", "--touch-every", "1h"),
        ("--touch-noise-um", "1"),
        ("--touches", "Z_um=X_um"),
    ):
        assert main(["verify", *words, *refused]) == 2


def test_models_of_one_file_name_are_compared_in_one_chart_and_one_table(tmp_path, capsys):
    model, log = written(tmp_path, states_k=0.0)
    (tmp_path / "weak").mkdir()
    lags = (Section(8.0, 900.0), Section(6.0, 5000.0))
    weak = tmp_path / "weak" / "model.json"
    write_model(
        CompensationModel(outputs=(Output("Z_um", (Part("spindle", "T_C", "", 0.0, lags),)),)), weak
    )
    drawn = ["--report", str(tmp_path / "c.html"), "--figures", str(tmp_path / "c")]
    found = result(tmp_path, "compare", str(weak), model, log, "--start", "rest", *drawn)
    names = ["weak/model.json", f"{tmp_path.name}/model.json"]
    assert [one["name"] for one in found["models"]] == names
    fits = [one["outputs"]["Z_um"]["fit_percent"] for one in found["models"]]
    page = (tmp_path / "c.html").read_text(encoding="utf-8")
    assert page.index(f"<td>{fits[1]:.1f}") < page.index(f"<td>{fits[0]:.1f}")  # best first
    lines = (tmp_path / "c" / "compared_output_1.csv").read_text(encoding="utf-8").splitlines()
    errors = [line.rpartition(",")[2] for line in lines if f"fit {fits[0]:.1f}" in line]
    largest = found["models"][0]["outputs"]["Z_um"]["max_um"]
    assert max(abs(float(value)) for value in errors[len(errors) // 2 :]) == pytest.approx(largest)
    assert "c.html" in capsys.readouterr().out


def test_models_are_ranked_by_runs_that_began_alike(tmp_path, capsys):
    model, log = written(tmp_path)
    still = tmp_path / "still.json"  # no lag, so no evidence of another start
    part = Part("spindle", "T_C", "", 10.0, (), static_gain_um_per_k=10.0)
    write_model(CompensationModel(outputs=(Output("Z_um", (part,)),)), still)
    result(tmp_path, "verify", str(still), log)
    assert "did not begin at rest" not in capsys.readouterr().out
    found = result(tmp_path, "compare", model, str(still), log)
    assert capsys.readouterr().out.count("fitted to the log") == 1
    assert found["start"] == "fitted"
    figures = found["models"][1]["outputs"]["Z_um"]
    assert figures["rmse_um"] == pytest.approx(figures["static_rmse_um"], rel=0.01)


def test_displacements_by_another_clock_are_named_and_judged_as_they_are(tmp_path, monkeypatch):
    monkeypatch.setattr(_thermal_logs, "with_one_clock", with_one_clock)
    words = written(tmp_path, states_k=0.0, late_rows=20)
    log = np.loadtxt(words[1], delimiter=",", skiprows=1)
    rows = int(np.sum(np.isfinite(log[:, -1])))
    verified = result(tmp_path, "verify", *words, "--start", "rest")
    compared = result(tmp_path, "compare", *words, "--start", "rest")
    for found in (verified, compared):
        (said,) = found["reading_codes"]
        assert said["code"] == "remark-displacements_seem_late"
        assert said["values"]["shift_s"] == pytest.approx(1200.0, abs=120.0)
    figures = compared["models"][0]["outputs"]["Z_um"]
    assert figures == verified["outputs"]["Z_um"]
    assert figures["rows"] == rows


def test_a_displacement_that_never_changes_has_no_fit(tmp_path, capsys):
    model, log = written(tmp_path)
    text = Path(log).read_text(encoding="utf-8").splitlines()
    still = [text[0], *(f"{line.rsplit(',', 1)[0]},3.0" for line in text[1:])]
    Path(log).write_text("\n".join(still), encoding="utf-8")
    several = ("--measured", "Z_um", "--measured", "Z_um=Z_um@10")
    found = result(tmp_path, "verify", model, log, *several)
    assert found["mean_fit_percent"] is None
    assert "fit" in capsys.readouterr().out


def test_an_argument_states_its_kind_once():

    with pytest.raises(TypeError, match="third argument"):
        adder(ArgumentParser())("--start", "how", type=int)
