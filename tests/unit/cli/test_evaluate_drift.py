"""The drift in ``thermaxis evaluate``: promised keys, options, and runs without times."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.unit.positioning.builders import closed_form, stop_times
from thermaxis.cli import main

FIGURES = (
    *("B", "B_mean", "M", "E_forward", "E_backward", "E"),
    *("R_forward", "R_backward", "R", "A_forward", "A_backward", "A"),
)
RATE_UM_PER_S = 0.004


def timed(x: np.ndarray, *, column: str = "time_s") -> str:
    """Return a tidy table of a standard cycle with 10 s from stop to stop."""
    m, n, _ = x.shape
    time_s = stop_times(m, n, 10.0)
    lines = [f"cycle,direction,target_mm,deviation_um,{column}"]
    for i, j, d in sorted(np.ndindex(x.shape), key=lambda stop: time_s[stop]):
        word = ("forward", "backward")[d]
        value = time_s[i, j, d] if column == "time_s" else time_s[i, j, d] / 10.0 + 1.0
        lines.append(f"{j + 1},{word},{20.0 * i:g},{x[i, j, d]:.6f},{value:g}")
    return "\n".join(lines) + "\n"


@pytest.fixture
def drifting(tmp_path: Path) -> Path:
    """Return a run with known levels, noise 0.3 µm and a straight drift."""
    rng = np.random.default_rng(5)
    level = closed_form(8, 1.5, 2.0, 0.0)[:, :1]
    time_s = stop_times(8, 10, 10.0)
    x = level + RATE_UM_PER_S * time_s + 0.3 * rng.normal(size=(8, 10, 2))
    path = tmp_path / "drifting.csv"
    path.write_text(timed(x), encoding="utf-8")
    return path


def evaluated(capsys: pytest.CaptureFixture[str], path: Path, *options: str) -> dict[str, object]:
    assert main(["evaluate", str(path), "--json", "-", *options]) == 0
    return json.loads(capsys.readouterr().out)


def test_the_drift_of_a_known_run_comes_out(drifting, capsys):
    results = evaluated(capsys, drifting)
    drift = results["drift"]
    assert drift["significant"] is True
    assert drift["model"] in ("line", "smooth")
    duration_s = 1590.0
    assert drift["total"] == pytest.approx(RATE_UM_PER_S * duration_s, abs=0.4)
    assert drift["noise_std_forward"] == pytest.approx(0.3, abs=0.06)
    assert drift["reference_time_s"] == pytest.approx(duration_s / 2)
    shift = RATE_UM_PER_S * duration_s / 2
    for way, reversal in (("forward", 2.0), ("backward", -2.0)):
        true = 1.5 * np.arange(8) + reversal + shift
        error = np.abs(np.array(drift[f"levels_{way}"]) - true)
        assert np.all(error < 4 * np.array(drift[f"levels_std_{way}"]))
    measured, free = results["iso230_2"], drift["iso230_2"]
    assert abs(free["B"] - 4.0) < drift["uncertainty"]["B"] < abs(measured["B"] - 4.0) + 0.5
    assert free["R"] < measured["R"]


def test_the_reference_time_chooses_the_thermal_state(drifting, capsys):
    start = evaluated(capsys, drifting, "--reference-time", "0")["drift"]
    late = evaluated(capsys, drifting, "--reference-time", "0.4")["drift"]
    assert (start["reference_time_s"], late["reference_time_s"]) == pytest.approx((0.0, 1440.0))
    difference = np.array(late["levels_forward"]) - np.array(start["levels_forward"])
    assert difference == pytest.approx(np.full(8, RATE_UM_PER_S * 1440.0), abs=0.5)


def test_a_run_without_drift_is_left_as_it_was(tmp_path, capsys):
    rng = np.random.default_rng(6)
    path = tmp_path / "quiet.csv"
    x = closed_form(8, 1.5, 2.0, 0.0)[:, :1] + 0.3 * rng.normal(size=(8, 5, 2))
    path.write_text(timed(x), encoding="utf-8")
    results = evaluated(capsys, path)
    assert results["drift"]["model"] == "none"
    assert results["drift"]["significant"] is False
    for key in FIGURES:
        assert results["drift"]["iso230_2"][key] == pytest.approx(results["iso230_2"][key])
    assert main(["evaluate", str(path)]) == 0
    assert "drift: not significant (p = " in capsys.readouterr().out


def test_no_drift_on_request(drifting, capsys):
    results = evaluated(capsys, drifting, "--no-drift")
    assert results["drift"] is None
    assert results["uncertainty"]["drift_free"] is None
    assert main(["evaluate", str(drifting), "--no-drift", "--full-tables"]) == 0
    assert "Drift eliminated" not in capsys.readouterr().out


def test_the_order_serves_as_time_and_the_result_says_so(tmp_path, capsys):
    rng = np.random.default_rng(7)
    x = closed_form(8, 1.5, 2.0, 0.0)[:, :1] + RATE_UM_PER_S * stop_times(8, 10, 10.0)
    path = tmp_path / "order.csv"
    path.write_text(timed(x + 0.3 * rng.normal(size=x.shape), column="order"), encoding="utf-8")
    results = evaluated(capsys, path)
    assert results["drift"]["significant"] is True
    assert results["drift"]["reference_time_s"] is None
    assert any("order serves as time" in text for text in results["warnings"])


def test_without_an_order_the_drift_is_null_and_the_command_goes_on(tmp_path, capsys):
    path = tmp_path / "none.csv"
    rows = timed(closed_form(8, 1.5, 2.0, 0.7)).splitlines()
    path.write_text("\n".join(row.rpartition(",")[0] for row in rows) + "\n", encoding="utf-8")
    results = evaluated(capsys, path)
    assert results["drift"] is None
    assert results["iso230_2"]["A"] > 0
    assert any("no drift model" in text for text in results["warnings"])


def test_a_budget_widens_the_uncertainty(drifting, root, capsys):
    plain = evaluated(capsys, drifting)
    assert any("no budget" in text for text in plain["uncertainty"]["measured"]["left_out"])
    budget = evaluated(capsys, drifting, "--budget", str(root / "examples" / "budget.toml"))
    assert budget["drift"]["uncertainty"]["E"] > plain["drift"]["uncertainty"]["E"]
    assert budget["uncertainty"]["label"] == "GUM"


def test_an_outlier_is_left_out_and_named(drifting, tmp_path, capsys):
    lines = drifting.read_text(encoding="utf-8").splitlines()
    cells = lines[40].split(",")
    cells[3] = f"{float(cells[3]) + 30.0:.3f}"
    path = tmp_path / "outlier.csv"
    path.write_text("\n".join([*lines[:40], ",".join(cells), *lines[41:]]) + "\n", "utf-8")
    (named,) = evaluated(capsys, path)["drift"]["outliers"]
    assert named["cycle"] == int(cells[0])
    assert named["target"] == int(float(cells[2]) / 20.0) + 1
    assert named["residual"] == pytest.approx(30.0, abs=2.0)
