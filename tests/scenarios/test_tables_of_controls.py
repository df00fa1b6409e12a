"""From a run to the table of every control, and back: on whole files, through the command line."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from thermaxis.cli import main
from thermaxis.controls import control_by_name, control_names
from thermaxis.files import read_positioning, write_tidy_csv
from thermaxis.messages import text_of
from thermaxis.quantities import AxisKind

EXAMPLES = ("x_axis_100_cycles.csv", "y_axis_50_cycles.rtl")


@pytest.fixture(autouse=True)
def fits(fitted_once):
    with fitted_once():
        yield


def json_of(capsys: pytest.CaptureFixture[str], *words: str) -> dict:
    capsys.readouterr()
    assert main([*words, "--json", "-"]) == 0
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize(
    ("name", "example"),
    [*((name, EXAMPLES[0]) for name in control_names()), ("fanuc", EXAMPLES[1])],
)
def test_the_drift_free_table_of_an_example_takes_the_systematic_deviations_away(
    name, example, root, tmp_path, capsys
):
    run, table = str(root / "examples" / example), str(tmp_path / "table")
    control = ("--control", name)
    made = json_of(capsys, "correct", run, *control, "--drift-free", "--spacing", "5", "-o", table)
    own, content = control_by_name(name), Path(table).read_bytes()
    assert (made["sign"], made["unit"]) == (text_of(own.sign), text_of(own.unit))
    assert "warning-sign_to_be_proven" in [one["code"] for one in made["warning_codes"]]
    assert content.isascii()
    assert content.count(b"\r\n") == (content.count(b"\n") if own.newline == "\r\n" else 0)
    found = json_of(capsys, "check-table", table, run, *control)
    assert found["table"] == made["table"]
    assert found["figures"] == {
        **made["figures"],
        "opposite_sign": found["figures"]["opposite_sign"],
    }
    before, after = (found["figures_without_drift"][k] for k in ("before", "after"))
    left = 2.0 * (made["bound"]["interpolation"] + made["bound"]["rounding"])
    assert after["E"] <= left + 0.1
    assert after["M"] <= 0.15 * before["M"] + 2.0 * made["bound"]["rounding"]
    measured = found["figures"]
    assert measured["after"]["M"] < 0.35 * measured["before"]["M"]
    assert measured["opposite_sign"]["M"] > 1.8 * measured["before"]["M"]
    rule = control_by_name(name).grid_rule(AxisKind.LINEAR, made["options"])
    if rule.per_direction:
        assert after["B"] < 0.2
        assert after["E"] < 0.1 * before["E"]
    else:
        assert after["B"] == pytest.approx(before["B"], abs=1e-6)


def sides(values: dict, name: str) -> np.ndarray:
    return np.array([values[f"{name}_forward"], values[f"{name}_backward"]]).T


@pytest.mark.parametrize("name", control_names())
def test_a_second_run_with_the_table_in_force_merges_to_the_same_table(
    name, root, tmp_path, capsys
):
    run = root / "examples" / EXAMPLES[0]
    old, new, second = str(tmp_path / "old"), str(tmp_path / "new"), tmp_path / "second.csv"
    control = ("--control", name)
    first = json_of(capsys, "correct", str(run), *control, "--spacing", "20", "-o", old)
    table, test = first["table"], read_positioning(run)
    # what the axis shows with the table in force, worked out from the table's own numbers
    added = -np.stack(
        [np.interp(test.target, table["positions"], d) for d in sides(table, "deviation").T], axis=1
    )
    write_tidy_csv(replace(test, deviation=test.deviation + added[:, None, :]), second)
    made = json_of(capsys, "correct", str(second), *control, "--merge", old, "-o", new)
    assert made["merge"]["lost"] == pytest.approx(0.0, abs=1e-6)
    before = np.array(made["table"]["positions"])
    inside = (before >= test.target[0]) & (before <= test.target[-1])
    kept = np.stack(
        [np.interp(before, table["positions"], d) for d in sides(table, "deviation").T], axis=1
    )
    change = (sides(made["table"], "deviation") - kept)[inside]
    shown = np.array([(t["after_forward"], t["after_backward"]) for t in first["targets"]])
    rule = control_by_name(name).grid_rule(AxisKind.LINEAR, made["options"])
    if not rule.per_direction:
        shown = np.mean(shown, axis=1)
    left = float(np.ptp(shown))  # what the first table misses between its points
    assert left < 0.35 * first["figures"]["before"]["M"]
    assert float(np.max(np.abs(change))) <= left + made["bound"]["rounding"] + 1e-3
    assert made["figures"]["before"]["M"] == pytest.approx(first["figures"]["after"]["M"], abs=1e-3)


@pytest.mark.parametrize("name", control_names())
def test_a_rotary_axis_has_its_table_in_degrees_and_arcsec(name, tmp_path, capsys):
    lines = ["# header axis: C", "cycle,direction,target_deg,deviation_arcsec,time_s"]
    for cycle in range(1, 6):
        for word, shift in (("forward", 0.0), ("backward", 0.6)):
            for k in range(13):
                number = 26 * (cycle - 1) + (k if shift == 0.0 else 25 - k)
                error = 8.0 * math.sin(math.radians(30.0 * k)) + shift + 0.05 * (cycle - 3)
                lines.append(f"{cycle},{word},{30 * k},{error:.4f},{10 * number}")
    run, table = tmp_path / "run.csv", str(tmp_path / "table")
    run.write_text("\n".join(lines) + "\n", encoding="utf-8")
    control = ("--control", name)
    made = json_of(capsys, "correct", str(run), *control, "-o", table)
    found = json_of(capsys, "check-table", table, str(run), *control)
    assert made["kind"] == "rotary"
    assert found["figures"]["before"]["M"] == pytest.approx(16.0, abs=0.01)
    assert found["figures"]["after"]["M"] <= 2.0 * made["bound"]["rounding"] + 0.01
    assert capsys.readouterr().err == ""


@pytest.mark.real_data
def test_the_real_tables_are_read_and_their_defects_named(root, real_data, capsys):
    run = str(root / "examples" / EXAMPLES[0])
    table = str(real_data / "positioning" / "linuxcnc" / "screwcompX.dat")
    found = json_of(capsys, "check-table", table, run, "--control", "linuxcnc")
    assert len(found["table"]["positions"]) == 11
    assert any("line 4" in text and "-4.2" in text for text in found["findings"])
    assert any("does not cover 15 of 16 targets" in text for text in found["findings"])
    (siemens,) = (real_data / "positioning" / "siemens").glob("AA_ENC_COMP*")
    words = ["check-table", str(siemens), run, "--control", "sinumerik"]
    found = json_of(capsys, *words, "--set", "table=1")
    assert len(found["table"]["positions"]) == 40
    assert found["table"]["step"] == pytest.approx(19.7436, abs=1e-4)
    assert found["table"]["deviation_forward"][39] == pytest.approx(-4.1)
    assert main([*words, "--set", "table=2"]) == 2
    assert "decimal comma" in capsys.readouterr().err
    assert main(words) == 2
    assert "--set table=1" in capsys.readouterr().err


@pytest.mark.real_data
@pytest.mark.parametrize("name", control_names())
def test_tables_of_real_runs_leave_no_more_than_bound_and_rounding(
    name, real_data, tmp_path, capsys
):
    folder = real_data / "positioning"
    runs = [*sorted(folder.rglob("*_ISO230.dat")), *sorted(folder.rglob("x_positioning*.csv"))]
    assert len(runs) == 4
    for run in runs:
        words = ["correct", str(run), "--control", name, "-o", str(tmp_path / "t")]
        made = json_of(capsys, *words)
        bound, figures = made["bound"], made["figures"]
        assert bound["residual"] <= bound["interpolation"] + 1e-6
        key = next(k for k in ("E", "E_forward", "E_backward") if figures["before"][k] is not None)
        left = 2.0 * (bound["interpolation"] + bound["rounding"])
        assert figures["after"][key] <= left + 1e-6
