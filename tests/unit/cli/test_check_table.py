import json
from pathlib import Path

import numpy as np
import pytest

from tests.unit.cli.refusals import code_of
from thermaxis.cli import main
from thermaxis.files import read_positioning
from thermaxis.positioning import FIGURE_KEYS, evaluate_iso230_2

TARGETS = (0.0, 40.0, 100.0, 160.0, 200.0)
LEVEL = (0.0, 4.0, 10.0, 13.0, 20.0)


def write_run(path: Path, *, both: bool = True, factor: float = 1.0, drift_um: float = 0.0) -> Path:
    lines = ["cycle,direction,target_mm,deviation_um,time_s"]
    time = 0
    for cycle in range(1, 6):
        for word, shift, order in (("forward", 0.0, 1), ("backward", 2.0, -1)):
            if not both and order < 0:
                continue
            for target, level in list(zip(TARGETS, LEVEL, strict=True))[::order]:
                deviation = level + shift + 0.1 * (cycle - 3) + drift_um * time / 50.0
                lines.append(f"{cycle},{word},{factor * target},{deviation:.4f},{10 * time}")
                time += 1
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def comp(path: Path, sign: float = 1.0, shift: float = 2.0) -> Path:
    """Write a LinuxCNC table of type 0 by hand: nominal plus deviation."""
    rows = [
        f"{t} {t + sign * d / 1000:.6f} {t + sign * (d + shift) / 1000:.6f}"
        for t, d in zip(TARGETS, LEVEL, strict=True)
    ]
    path.write_text("\n".join(rows) + "\n", encoding="ascii")
    return path


def check(table: Path, run: Path, *more: str) -> int:
    return main(["check-table", str(table), str(run), "--control", "linuxcnc", *more])


def result(capsys: pytest.CaptureFixture[str], table: Path, run: Path, *more: str) -> dict:
    assert check(table, run, *more, "--json", "-") == 0
    return json.loads(capsys.readouterr().out)


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return write_run(tmp_path / "run.csv")


def test_a_table_that_fits_leaves_nothing_systematic_and_has_no_finding(run, tmp_path, capsys):
    table = comp(tmp_path / "x.comp")
    found = result(capsys, table, run)
    assert found["findings"] == []
    assert found["figures"]["before"]["E"] == pytest.approx(22.0)
    assert found["figures"]["after"]["E"] == pytest.approx(0.0, abs=1e-9)
    assert found["figures"]["after"]["R"] == pytest.approx(found["figures"]["after"]["R_forward"])
    assert found["figures"]["opposite_sign"]["E"] == pytest.approx(44.0)
    assert check(table, run) == 0
    assert "no finding: nothing looks wrong" in capsys.readouterr().out


def test_figures_before_are_those_of_evaluate_and_deviations_before_and_after_stand_by_target(
    run, tmp_path, capsys
):
    found = result(capsys, comp(tmp_path / "x.comp", shift=0.0), run)
    evaluated = evaluate_iso230_2(read_positioning(run))
    for key in FIGURE_KEYS:
        assert found["figures"]["before"][key] == pytest.approx(getattr(evaluated, key))
    assert [t["after_backward"] for t in found["targets"]] == pytest.approx([2.0] * 5)
    assert [t["correction_forward"] for t in found["targets"]] == pytest.approx(
        [-level for level in LEVEL]
    )
    assert found["figures"]["after"]["B"] == pytest.approx(2.0)


def codes(found: dict, key: str = "finding_codes") -> dict[str, dict]:
    return {one["code"].partition("-")[2]: one["values"] for one in found[key]}


def test_a_flipped_sign_doubles_the_deviations_and_is_named(run, tmp_path, capsys):
    found = result(capsys, comp(tmp_path / "x.comp", sign=-1.0), run)
    assert codes(found) == {
        "sign_wrong": {
            "before": pytest.approx(22.0),
            "after": pytest.approx(44.0),
            "times": pytest.approx(2.0),
            "opposite": pytest.approx(0.0, abs=1e-9),
            "unit": "µm",
        }
    }
    assert found["findings"][0].startswith("The sign is wrong for this run")


def test_a_table_of_something_else_is_said_not_to_fit(run, tmp_path, capsys):
    table = tmp_path / "x.comp"
    table.write_text("0 0 0\n50 49.970 49.970\n100 100.02 100.02\n200 200 200\n")
    assert list(codes(result(capsys, table, run)))[-1] == "does_not_fit"


def test_targets_beyond_the_table_are_counted_but_not_by_the_rounding_of_its_spacing(
    run, tmp_path, capsys
):
    table = tmp_path / "x.comp"
    for end, outside in (("199.999", None), ("199.99", 1), ("100.1", 2)):
        table.write_text(f"0 -0.001 0.001\n100 100.01 100.012\n{end} {end} {end}\n")
        values = codes(result(capsys, table, run)).get("targets_not_covered", {})
        assert values.get("outside") == outside


def test_points_behind_a_blank_line_are_lost_on_the_control_and_it_is_said(run, tmp_path, capsys):
    table = comp(tmp_path / "x.comp")
    rows = table.read_text().splitlines()
    table.write_text("\n".join([*rows[:3], "", *rows[3:]]) + "\n")
    found = result(capsys, table, run)
    assert len(found["table"]["positions"]) == 3
    assert found["points_in_file"] == 5
    assert codes(found)["points_not_read"] == {"in_file": 5, "points": 3}


def test_one_direction_has_its_own_figures(tmp_path, capsys):
    run = write_run(tmp_path / "run.csv", both=False)
    table = comp(tmp_path / "x.comp")
    found = result(capsys, table, run)
    assert found["figures"]["before"]["E"] is None
    assert found["figures"]["after"]["E_forward"] == pytest.approx(0.0, abs=1e-9)
    assert check(table, run) == 0
    printed = capsys.readouterr().out
    assert "absent, measured forward only" in printed
    assert "before ↓" not in printed


def test_a_long_axis_has_no_repeatability_as_evaluate_shows_it(tmp_path, capsys):
    run = write_run(tmp_path / "run.csv", factor=20.0)
    table = tmp_path / "x.comp"
    table.write_text("0 0 0\n4000 4000.02 4000.022\n")
    found = result(capsys, table, run)
    assert found["figures"]["before"]["R"] is None
    assert found["figures"]["after"]["A"] is None
    assert found["figures"]["after"]["E"] is not None
    assert check(table, run) == 0
    assert "absent, the axis is longer than 2000 mm" in capsys.readouterr().out


def test_drift_of_the_run_is_told_with_what_is_left_without_it(tmp_path, capsys):
    run = write_run(tmp_path / "run.csv", drift_um=30.0)
    found = result(capsys, comp(tmp_path / "x.comp"), run)
    drift = codes(found, "warning_codes")["drift_not_removed"]
    assert drift["total"] == pytest.approx(29.4, abs=0.5)
    assert found["figures_without_drift"]["after"]["E"] < 0.3
    assert found["figures"]["after"]["E"] > 1.0
    found = result(capsys, tmp_path / "x.comp", run, "--no-drift")
    assert found["figures_without_drift"] is None
    assert codes(found, "warning_codes")["drift_unknown"]["cause"]["code"] == (
        "warning-drift_left_out"
    )


def test_the_axis_of_a_table_is_compared_with_that_of_the_run(tmp_path, capsys):
    table, plain = tmp_path / "x.ini", write_run(tmp_path / "run.csv")
    named = tmp_path / "named.csv"
    named.write_text(f"# header axis: Y\n{plain.read_text()}")
    odd = tmp_path / "odd.csv"
    odd.write_text(f"# header axis: X) G0 Z-100\n{plain.read_text()}")
    words = ("--control", "sinumerik")
    assert main(["correct", str(plain), *words, "--axis", "AX3", "-o", str(table)]) == 0
    capsys.readouterr()

    def said(run: Path, *more: str) -> dict[str, dict]:
        assert main(["check-table", str(table), str(run), *words, *more, "--json", "-"]) == 0
        found = json.loads(capsys.readouterr().out)
        both = codes(found) | codes(found, "warning_codes")
        return {code: values for code, values in both.items() if "axis" in code}

    assert said(named) == {"axis_of_run_differs": {"axis": "AX3", "of_run": "Y"}}
    assert said(named, "--axis", "ax3") == {}
    assert said(named, "--axis", "AX1") == {"axis_differs": {"axis": "AX3", "wanted": "AX1"}}
    assert list(said(plain)) == ["axis_of_run_unnamed"]
    assert said(odd) == {"axis_of_run_unusable": {"stated": "X) G0 Z-100"}}
    unnamed = result(capsys, comp(tmp_path / "x.comp"), plain, "--axis", "X")
    assert "axis_of_table_unnamed" in codes(unnamed, "warning_codes")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        pytest.param(b"", "", id="empty"),
        pytest.param(b"\xff\xfe0\x00 \x000\x00", "no plain text", id="utf-16"),
        pytest.param(b"0 0 0\n0 0 0\n", "line 2", id="descending"),
        pytest.param(b"x" * 5_000_001, "at most 5 MB", id="large"),
        pytest.param(b"0 1e200 1e200\n100 2e200 1e200\n", "", id="huge"),
        pytest.param(b"0 0 0\n20 -1e308 20\n40 40 40\n", "line 2", id="infinite"),
    ],
)
def test_a_file_that_is_no_table_is_refused_or_named_without_a_traceback(
    run, tmp_path, content, said, capsys
):
    table = tmp_path / "x.comp"
    table.write_bytes(content)
    code = check(table, run)
    printed = capsys.readouterr()
    assert (code == 2 and str(table) in printed.err) or "finding" in printed.out
    assert said in printed.err + printed.out


def test_marks_and_letters_that_a_control_may_not_read_are_findings(run, tmp_path, capsys):
    table = tmp_path / "x.ini"
    words = [str(run), "--control", "sinumerik"]
    assert main(["correct", *words, "-o", str(table)]) == 0
    table.write_bytes(b"\xef\xbb\xbf; stra\xc3\x9fe\r\n" + table.read_bytes())
    capsys.readouterr()
    assert main(["check-table", str(table), *words, "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert {"byte_order_mark_first", "letters_outside_ascii"} <= codes(found).keys()


def test_folders_and_missing_files_are_refused(run, tmp_path):
    assert check(tmp_path, run) == 2
    assert check(tmp_path / "none", run) == 2
    table = comp(tmp_path / "x.comp")
    words = ("check-table", table, run, "--control", "linuxcnc")
    assert code_of(*words, "--json", table) == "output_is_input"
    np.testing.assert_equal(table.read_text().count("\n"), 5)
