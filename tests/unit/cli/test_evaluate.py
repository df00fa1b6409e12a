"""The command ``thermaxis evaluate``, without the drift."""

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.unit.cli.refusals import code_of, refusal
from tests.unit.positioning.builders import closed_form
from thermaxis.cli import main


def tidy(
    x: np.ndarray, target: np.ndarray | None = None, *, unit: str = "mm", error: str = "um"
) -> str:
    targets = np.arange(x.shape[0]) * 20.0 if target is None else target
    lines = [f"cycle,direction,target_{unit},deviation_{error}"]
    for j in range(x.shape[1]):
        for d, word in enumerate(("forward", "backward")):
            rows = range(x.shape[0]) if d == 0 else range(x.shape[0] - 1, -1, -1)
            lines += [
                f"{j + 1},{word},{targets[i]:.3f},{x[i, j, d]:.6f}"
                for i in rows
                if not math.isnan(x[i, j, d])
            ]
    return "\n".join(lines) + "\n"


@pytest.fixture
def run_file(tmp_path: Path) -> Path:
    path = tmp_path / "run.csv"
    path.write_text(tidy(closed_form(6, 1.5, 2.0, 0.7)), encoding="utf-8")
    return path


def evaluated(capsys: pytest.CaptureFixture[str], path: Path, *options: str) -> dict[str, object]:
    assert main(["evaluate", str(path), "--no-drift", "--json", "-", *options]) == 0
    return json.loads(capsys.readouterr().out)


def test_options_in_effect_are_stated_with_the_results(run_file, capsys, tmp_path):
    assert evaluated(capsys, run_file)["options"] == {"no_drift": True}
    mapping = tmp_path / "map.toml"
    columns = '[columns]\n"deviation_um" = { role = "deviation", unit = "um" }\n'
    mapping.write_text(f'{columns}[directions]\n"li" = "forward"\n', encoding="utf-8")
    options = ("--full", "--reference-cycle", "2", "--decimal", "point", "--units", "mm,um")
    results = evaluated(capsys, run_file, *options, "--map", str(mapping))
    assert results["options"] == {
        "reference_cycle": 2,
        "full": True,
        "no_drift": True,
        "columns": {"deviation_um": {"role": "deviation", "unit": "um"}},
        "directions": {"li": "forward"},
        "decimal": "point",
        "position_unit": "mm",
        "deviation_unit": "um",
    }


def test_closed_form_figures_through_the_command(run_file, capsys):
    results = evaluated(capsys, run_file)
    figures = results["iso230_2"]
    assert (figures["E"], figures["R"], figures["A"]) == pytest.approx(
        (11.5, 8.427188724, 15.927188724), abs=1e-6
    )
    forward = results["adjacent_difference"]["forward"]
    assert forward["mean_difference"] == pytest.approx([-1.5] * 5, abs=1e-6)
    assert forward["standard_deviation"] == pytest.approx([0.0] * 5, abs=1e-6)
    chart = forward["chart"]
    steps = [chart[i + 1] - chart[i] for i in range(5)]
    assert steps == pytest.approx([-d for d in forward["mean_difference"]])


def test_absent_figures_are_null(tmp_path, capsys):
    x = closed_form(6, 1.5, 2.0, 0.7)
    x[:, :, 1] = np.nan
    path = tmp_path / "one_way.csv"
    path.write_text(tidy(x), encoding="utf-8")
    results = evaluated(capsys, path)
    assert results["test"]["unidirectional"] is True
    assert results["iso230_2"]["E"] is None
    assert results["iso230_2"]["E_forward"] == pytest.approx(7.5)
    assert results["adjacent_difference"]["backward"] is None


def test_a_long_axis_has_no_repeatability_unless_asked(tmp_path, capsys):
    path = tmp_path / "long.csv"
    path.write_text(tidy(closed_form(12, 1.5, 2.0, 0.7), np.arange(12) * 240.0), encoding="utf-8")
    short = evaluated(capsys, path)
    assert short["iso230_2"]["R"] is None
    assert any("longer than 2000 mm" in text for text in short["warnings"])
    full = evaluated(capsys, path, "--full")
    assert full["iso230_2"]["R"] == pytest.approx(8.427, abs=1e-3)
    assert full["iso230_2"]["E"] == short["iso230_2"]["E"]


def test_editions_are_named_on_the_result_and_old_standards_stand_beside_the_present_one(
    run_file, capsys
):
    for option, edition, beside in (
        ("1997", "1997", None),
        ("1988", "2014", "iso230_2_1988"),
        ("vdi3441", "2014", "vdi3441"),
    ):
        results = evaluated(capsys, run_file, "--edition", option)
        assert results["iso230_2"]["edition"] == edition
        for key in ("iso230_2_1988", "vdi3441"):
            mark = "unverified: from memory" if key == beside else None
            assert (results[key] or {}).get("mark") == mark
    main(["evaluate", str(run_file), "--edition", "1988"])
    assert "unverified: from memory" in capsys.readouterr().out


def test_the_reference_cycle_is_counted_from_one(run_file, capsys):
    results = evaluated(capsys, run_file, "--reference-cycle", "3")
    assert results["adjacent_difference"]["reference_cycle"] == 3
    assert results["adjacent_difference"]["forward"]["chart"][0] == pytest.approx(2.0)


def test_bad_input_is_one_line_and_exit_code_2(tmp_path, capsys):
    assert main(["evaluate", str(tmp_path / "none.csv")]) == 2
    captured = capsys.readouterr()
    assert (captured.out, captured.err.count("\n")) == ("", 1)
    assert captured.err.startswith("thermaxis: error: ")


def test_what_cannot_be_evaluated_or_written_is_refused_before_anything_is_written(
    run_file, tmp_path
):
    before = run_file.read_bytes()
    json_file, report = tmp_path / "r.json", tmp_path / "c.pdf"
    broken = tmp_path / "broken.csv"
    broken.write_text("cycle,direction,target_mm,deviation_um\n1,forward,0,abc\n", encoding="utf-8")
    assert refusal("evaluate", broken).place.line == 2
    for option, value in (
        ("--reference-cycle", "99"),
        ("--reference-time", "1"),
        ("--limits", run_file),
    ):
        refusal("evaluate", run_file, option, value)
    asked = ("evaluate", run_file, "--json", json_file, "--report")
    assert code_of(*asked, tmp_path / "c.docx") == "report_suffix"
    assert code_of(*asked, report, "--report", report) == "outputs_have_one_name"
    assert code_of("evaluate", run_file, "--json", run_file) == "output_is_input"
    assert code_of("evaluate", run_file, "--json", tmp_path / "no" / "r.json") == "folder_missing"
    assert run_file.read_bytes() == before
    assert not json_file.exists()


def test_without_adjacent_differences_the_standard_is_evaluated_all_the_same(tmp_path, capsys):
    x = closed_form(6, 1.5, 2.0, 0.7)[:, :4]
    x[0, 2:] = np.nan
    x[1, :2] = np.nan
    path = tmp_path / "gaps.csv"
    path.write_text(tidy(x), encoding="utf-8")
    results = evaluated(capsys, path)
    assert results["iso230_2"]["A"] > 0
    assert results["adjacent_difference"] is None
    assert any("positions 1 and 2" in text for text in results["warnings"])
    refusal("evaluate", path, "--reference-cycle", "1")


def test_an_option_that_contradicts_the_file_is_named(tmp_path, capsys):
    path = tmp_path / "step.csv"
    path.write_text("# cycle: step\n" + tidy(closed_form(6, 1.5, 2.0, 0.7)), encoding="utf-8")
    assert any("Annex B" in w for w in evaluated(capsys, path)["warnings"])
    warnings = evaluated(capsys, path, "--cycle", "standard")["warnings"]
    assert "the file names a step cycle, the option a standard cycle" in warnings


def test_an_old_standard_that_needs_more_readings_is_left_out_with_its_reason(tmp_path, capsys):
    path = tmp_path / "long.csv"
    x = closed_form(12, 1.5, 2.0, 0.7)[:, :1]
    path.write_text(tidy(x, np.arange(12) * 240.0), encoding="utf-8")
    results = evaluated(capsys, path, "--edition", "1988")
    assert results["iso230_2"]["E"] > 0
    assert results["iso230_2_1988"] is None
    assert any("other standard" in w for w in results["warnings"])


@pytest.mark.proof
def test_a_closed_pipe_is_no_error(run_file):
    command = f'"{sys.executable}" -m thermaxis evaluate "{run_file}" | head -n 1'
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert done.stderr == ""


def test_hostile_text_in_a_file_cannot_drive_the_terminal(tmp_path, capsys):
    path = tmp_path / "hostile.csv"
    head = "# header axis: X\x1b[31m[bold red]\n# header title: \x1b]0;owned\x07\n"
    path.write_text(head + tidy(closed_form(6, 1.5, 2.0, 0.7)), encoding="utf-8")
    main(["evaluate", str(path)])
    out = capsys.readouterr().out
    assert "\x1b" not in out
    assert "\x07" not in out
    assert "[bold red]" in out
