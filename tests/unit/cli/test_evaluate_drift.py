"""The drift in ``thermaxis evaluate``: promised keys, options, and runs without times."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.unit.positioning.builders import closed_form, stop_times
from thermaxis.cli import main

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


def test_the_reference_time_chooses_the_thermal_state(drifting, capsys):
    start = evaluated(capsys, drifting, "--reference-time", "0")["drift"]
    late = evaluated(capsys, drifting, "--reference-time", "0.4")["drift"]
    assert (start["reference_time_s"], late["reference_time_s"]) == pytest.approx((0.0, 1440.0))
    difference = np.array(late["levels_forward"]) - np.array(start["levels_forward"])
    assert difference == pytest.approx(np.full(8, RATE_UM_PER_S * 1440.0), abs=0.5)


def test_no_drift_on_request(drifting, capsys):
    results = evaluated(capsys, drifting, "--no-drift")
    assert results["drift"] is None
    assert results["uncertainty"]["drift_free"] is None
    assert main(["evaluate", str(drifting), "--no-drift", "--full-tables"]) == 0
    assert "Drift eliminated" not in capsys.readouterr().out


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
