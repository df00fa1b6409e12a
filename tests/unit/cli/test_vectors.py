"""The test vectors have the answers in closed form that their README states."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from tests.unit.cli.refusals import refusal
from thermaxis.cli import main
from thermaxis.files import read_model, read_positioning, read_thermal_log
from thermaxis.positioning import evaluate_iso230_2

A, B, D, Q, N, LENGTH = 0.02, 3.0, 0.5, 1.5, 4, 298.0
S = {
    "line": 0.0,
    "scatter": D * math.sqrt(N / (N - 1)),
    "drift": 2 * Q * math.sqrt(N * (N + 1) / 12),
}
REVERSAL = {"line": B, "scatter": B, "drift": B - Q}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("made") / "vectors"
    assert main(["vectors", str(path)]) == 0
    return path


@pytest.mark.parametrize("name", S)
def test_the_figures_of_a_run_are_those_of_the_closed_form(folder: Path, name: str) -> None:
    s, b, line = S[name], REVERSAL[name], A * LENGTH
    told = json.loads((folder / "positioning" / f"{name}.json").read_text("utf-8"))
    expected = {
        "B": b,
        "B_mean": b,
        "M": line,
        "E_forward": line,
        "E_backward": line,
        "E": line + b,
        "R_forward": 4 * s,
        "R_backward": 4 * s,
        "R": 4 * s + b,
        "A_forward": line + 4 * s,
        "A_backward": line + 4 * s,
        "A": line + b + 4 * s,
    }
    assert told["iso230_2"] == pytest.approx(expected, abs=1e-9)
    assert told["standard_deviation_of_neighbours"] == pytest.approx([0.0] * 5, abs=1e-9)
    test = read_positioning(folder / "positioning" / f"{name}.csv")
    assert evaluate_iso230_2(test).A == pytest.approx(expected["A"], abs=1e-9)


@pytest.mark.parametrize("name", ["spindle", "table", "both"])
def test_the_displacement_of_a_model_is_that_of_the_closed_form(folder: Path, name: str) -> None:
    (output,) = read_model(folder / "thermal" / f"{name}.model.json").outputs
    step = read_thermal_log(folder / "thermal" / "step.csv").columns
    answer = read_thermal_log(folder / "thermal" / f"{name}.csv")
    k = np.arange(1, answer.rows)
    expected = np.zeros(k.size)
    for part in output.parts:
        u_k = (step[part.plus] - step[part.minus])[1]
        lags = sum(
            section.gain_um_per_k * -np.expm1(-(k - 1) * 60.0 / section.time_constant_s)
            for section in part.sections
        )
        expected += u_k * (part.direct_gain_um_per_k + lags)
    assert answer.columns["Z_um"][0] == 0.0
    np.testing.assert_allclose(answer.columns["Z_um"][1:], expected, atol=1e-9)
    assert abs(expected[-1]) > 50.0


def test_both_parts_are_superposed(folder: Path) -> None:
    one, two, both = (
        read_thermal_log(folder / "thermal" / f"{name}.csv").columns["Z_um"]
        for name in ("spindle", "table", "both")
    )
    np.testing.assert_allclose(both, one + two, atol=1e-9)


def test_a_folder_with_files_is_refused(folder: Path) -> None:
    assert refusal("vectors", str(folder)).place.key == "FOLDER"


def test_a_folder_that_cannot_be_made_is_refused(folder: Path) -> None:
    assert refusal("vectors", str(folder / "README.md")).code == "folder_unwritable"
