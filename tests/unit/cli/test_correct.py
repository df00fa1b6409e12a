import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import final

import numpy as np
import pytest

from tests.unit.cli.refusals import code_of
from thermaxis import controls
from thermaxis.cli import main
from thermaxis.cli.axis.tables import make as _make_table
from thermaxis.cli.axis.tables.plausible import doubts_about_size
from thermaxis.cli.axis.tables.reference import reference_point
from thermaxis.codes import Message
from thermaxis.controls import (
    Control,
    GridRule,
    ProgramRequest,
    ReadTable,
    TableRequest,
    TableText,
    TouchRequest,
)
from thermaxis.errors import DataError
from thermaxis.files import read_positioning
from thermaxis.messages import text_of
from thermaxis.positioning import CompensationTable, evaluate_drift, evaluate_iso230_2
from thermaxis.quantities import AxisKind

TARGETS = (0.0, 40.0, 100.0, 160.0, 200.0)
FORWARD = (0.0, 4.0, 10.0, 13.0, 20.0)
BACKWARD = (2.0, 6.0, 12.0, 15.0, 22.0)


def write_run(
    path: Path,
    forward: tuple[float, ...] = FORWARD,
    backward: tuple[float, ...] | None = BACKWARD,
    *,
    drift_um: float = 0.0,
    axis: str = "X",
) -> Path:
    """Write a run of five cycles; drift falls in a straight line over the readings."""
    lines = [f"# header axis: {axis}"] if axis else []
    lines.append("cycle,direction,target_mm,deviation_um,time_s")
    time = 0
    for cycle in range(1, 6):
        for word, level, order in (("forward", forward, 1), ("backward", backward, -1)):
            if level is None:
                continue
            for target, deviation in list(zip(TARGETS, level, strict=True))[::order]:
                noise = 0.01 * ((-1) ** (cycle + time))
                value = deviation + noise + drift_um * time / 50.0
                lines.append(f"{cycle},{word},{target},{value:.4f},{10 * time}")
                time += 1
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return write_run(tmp_path / "run.csv")


def correct(run: Path, output: Path, *more: str, control: str = "linuxcnc") -> int:
    return main(["correct", str(run), "--control", control, "-o", str(output), *more])


def refused(run: Path, output: Path, *more: str, control: str = "linuxcnc") -> str:
    return code_of("correct", run, "--control", control, "-o", output, *more)


def triplets(path: Path) -> np.ndarray:
    """Read a LinuxCNC table without the product's reader."""
    return np.array([[float(w) for w in line.split()] for line in path.read_text().splitlines()])


def sinumerik_values(path: Path) -> dict[int, float]:
    found = re.findall(r"^\$AA_ENC_COMP\[0,(\d+),X\]=(\S+)\r?$", path.read_text(), re.MULTILINE)
    return {int(i): float(value) for i, value in found}


def result(capsys: pytest.CaptureFixture[str], run: Path, output: Path, *more: str) -> dict:
    assert correct(run, output, *more, "--json", "-") == 0
    return json.loads(capsys.readouterr().out)


def warned(found: dict) -> dict[str, dict]:
    """Return the values of warnings by their codes."""
    return {one["code"].removeprefix("warning-"): one["values"] for one in found["warning_codes"]}


def test_the_table_holds_nominal_plus_deviation_of_each_direction_zero_at_the_reference(
    run, tmp_path
):
    output = tmp_path / "x.comp"
    assert correct(run, output) == 0
    table = triplets(output)
    np.testing.assert_allclose(table[:, 0], TARGETS)
    zero = 1.0  # mean of both directions at 0 mm
    np.testing.assert_allclose(
        1000 * (table[:, 1] - table[:, 0]), np.array(FORWARD) - zero, atol=0.01
    )
    np.testing.assert_allclose(
        1000 * (table[:, 2] - table[:, 0]), np.array(BACKWARD) - zero, atol=0.01
    )


def test_the_summary_says_sign_unit_points_reference_reversal_and_what_is_left(
    run, tmp_path, capsys
):
    assert correct(run, tmp_path / "x.comp") == 0
    printed = " ".join(capsys.readouterr().out.split())
    control = controls.control_by_name("linuxcnc")
    for words in (
        text_of(control.sign),
        text_of(control.unit),
        "points: 5 of at most 256, from 0 to 200 mm; the targets themselves",
        "zero at the reference point 0 mm",
        "forward minus backward is -2.00 µm in the mean",
        "largest +21.00 µm at 200 mm",
        "steepest slope 0.175 µm/mm from 160 to 200 mm",
        "the largest residual is 0.00 µm",
        "ISO 230-2:2014, simulated with the table, µm",
    ):
        assert words in printed
    said = warned(result(capsys, run, tmp_path / "x.comp"))
    assert set(said) == {
        *("no_table_in_force", "reversal_may_be_ignored", "sign_to_be_proven", "drift_stays"),
        *("temperature_of_run", "table_not_in_force"),
    }
    assert said["temperature_of_run"]["temperature"] == "its file states none"


def test_the_simulated_figures_are_those_of_the_very_file(run, tmp_path, capsys):
    output = tmp_path / "x.comp"
    found = result(capsys, run, output, "--points", "3")
    test, table = read_positioning(run), triplets(output)
    corrected = test.deviation.copy()
    for a in (0, 1):
        trim = 1000 * (table[:, 0] - table[:, 1 + a])
        corrected[:, :, a] += np.interp(test.target, table[:, 0], trim)[:, None]
    mean = corrected.mean(axis=1)
    assert found["figures"]["after"]["E"] == pytest.approx(np.ptp(mean), abs=1e-9)
    assert found["figures"]["after"]["M"] == pytest.approx(np.ptp(mean.mean(axis=1)), abs=1e-9)
    assert found["figures"]["before"]["E"] == pytest.approx(evaluate_iso230_2(test).E)
    assert found["bound"]["residual"] <= found["bound"]["interpolation"] + 1e-9
    after = [target["after_forward"] for target in found["targets"]]
    np.testing.assert_allclose(after, mean[:, 0], atol=1e-9)


@pytest.mark.parametrize(
    ("more", "positions"),
    [
        (("--points", "3"), [0, 100, 200]),
        (("--spacing", "80"), [0, 80, 160, 240]),
        ((), list(TARGETS)),
    ],
)
def test_points_are_the_targets_unless_others_are_asked_for(run, tmp_path, more, positions):
    assert correct(run, tmp_path / "x.comp", *more) == 0
    np.testing.assert_allclose(triplets(tmp_path / "x.comp")[:, 0], positions)


@pytest.mark.parametrize(("reference", "zero_um"), [("130", 12.5), ("-50", 1.0), ("900", 21.0)])
def test_the_table_is_zero_at_the_stated_reference(run, tmp_path, reference, zero_um):
    assert correct(run, tmp_path / "x.comp", "--reference", reference) == 0
    table = triplets(tmp_path / "x.comp")
    mean = 1000 * (table[:, 1:].mean(axis=1) - table[:, 0])
    np.testing.assert_allclose(
        mean, 0.5 * (np.array(FORWARD) + np.array(BACKWARD)) - zero_um, atol=0.01
    )


def test_without_zero_among_the_targets_the_nearest_end_is_the_reference(run, tmp_path, capsys):
    moved = tmp_path / "moved.csv"
    text = run.read_text().replace("forward,0.0,", "forward,20.0,")
    moved.write_text(text.replace("backward,0.0,", "backward,20.0,"))
    assert result(capsys, moved, tmp_path / "x.comp")["reference_position"] == 20.0


# ---- drift --------------------------------------------------------------------------------------


def test_drift_free_levels_are_those_of_the_thermal_state_that_is_asked_for(tmp_path, capsys):
    run = write_run(tmp_path / "run.csv", drift_um=30.0)
    test = read_positioning(run)
    hours = 300.0 / 3600.0
    more = ("--drift-free", "--reference-time", f"{hours}")
    found = result(capsys, run, tmp_path / "x.comp", *more)
    level = evaluate_drift(test, reference_time_s=3600.0 * hours).level
    assert found["levels"] == "drift-free"
    assert found["reference_time_s"] == pytest.approx(300.0)
    forward = np.array(found["table"]["deviation_forward"])
    np.testing.assert_allclose(np.diff(forward), np.diff(level[:, 0]), atol=1e-3)
    after = found["figures_without_drift"]["after"]
    assert after["E"] < 0.05
    assert found["figures"]["after"]["E"] > after["E"]


def test_a_run_that_drifts_is_told_when_its_measured_levels_are_used(tmp_path, capsys):
    run = write_run(tmp_path / "run.csv", drift_um=30.0)
    found = result(capsys, run, tmp_path / "x.comp")
    assert found["levels"] == "measured"
    drift = warned(found)["drift_in_levels"]
    assert drift["total"] == pytest.approx(29.4, abs=0.5)
    assert 0.0 < drift["apart"] <= drift["total"]


def test_drift_free_levels_that_do_not_exist_are_refused(tmp_path, capsys):
    run = tmp_path / "run.csv"
    rows = [f"1,{side},{t},1.0" for side in ("forward", "backward") for t in (0, 900, 2100)]
    run.write_text("cycle,direction,target_mm,deviation_um\n" + "\n".join(rows) + "\n")
    assert refused(run, tmp_path / "x.comp", "--drift-free") == "no_drift_free_levels"
    assert refused(run, tmp_path / "x.comp", "--reference-time", "1") == "option_needs"
    assert not (tmp_path / "x.comp").exists()
    assert correct(run, tmp_path / "x.comp") == 0
    assert "absent, the axis is longer than 2000 mm" in capsys.readouterr().out


# ---- reversal -----------------------------------------------------------------------------------


def test_backlash_is_refused_where_the_points_have_both_directions(run, tmp_path, capsys):
    assert refused(run, tmp_path / "x.comp", "--backlash") == "reversal_in_points"


def test_on_a_control_with_one_value_the_reversal_remains_or_is_written_apart(
    run, tmp_path, capsys
):
    output = tmp_path / "x.ini"
    assert correct(run, output, control="sinumerik") == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "all of it remains, at most 2.00 µm; --backlash writes the mean apart" in printed
    assert "MA_BACKLASH[" not in output.read_text()
    assert correct(run, output, "--backlash", control="sinumerik") == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "are compensated apart, up to 0.0" in printed
    (value,) = re.findall(r"\$MA_BACKLASH\[0,X\]=(\S+)", output.read_text())
    assert abs(float(value)) == pytest.approx(0.002, abs=1e-5)


def test_the_reversal_of_a_run_in_one_direction_is_not_known(tmp_path, capsys):
    run = write_run(tmp_path / "run.csv", backward=None)
    asked = refused(run, tmp_path / "x.ini", "--backlash", control="sinumerik")
    assert asked == "reversal_not_measured"
    assert correct(run, tmp_path / "x.comp") == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "reversal: not known" in printed
    assert "they stand for both directions" in printed
    assert "absent, measured forward only" in printed
    table = triplets(tmp_path / "x.comp")
    np.testing.assert_array_equal(table[:, 1], table[:, 2])


def backlash_value(path: Path) -> float:
    (value,) = re.findall(r"\$MA_BACKLASH\[0,X\]=(\S+)", path.read_text())
    return float(value)


def test_the_reversal_value_in_force_is_added_to_what_the_run_still_shows(run, tmp_path, capsys):
    alone, with_it = tmp_path / "a.ini", tmp_path / "b.ini"
    control = ("--control", "sinumerik", "--backlash")
    assert main(["correct", str(run), *control, "-o", str(alone)]) == 0
    assert "(MD32450, 1851) counts as 0 during the run" in " ".join(capsys.readouterr().out.split())
    words = ["correct", str(run), *control, "-o", str(with_it), "--backlash-in-force", "0.009"]
    assert main(words) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "counts as 0 during the run" not in printed
    assert "(-9.00 µm during the run)" in printed
    assert backlash_value(with_it) == pytest.approx(backlash_value(alone) + 0.009, abs=2e-6)
    assert sinumerik_values(with_it) == sinumerik_values(alone)
    # the readings hold what the control corrected: only the difference changes the figures
    assert main([*words, "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["backlash_in_force"] == pytest.approx(-9.0)
    assert found["figures"]["after"]["B_mean"] == pytest.approx(0.0, abs=0.002)


def test_a_control_that_then_ignores_its_reversal_value_gets_it_in_the_points(
    run, tmp_path, capsys
):
    alone, with_it = tmp_path / "a.comp", tmp_path / "b.comp"
    assert "reversal_may_be_ignored" in warned(result(capsys, run, alone))
    found = result(capsys, run, with_it, "--backlash-in-force", "0.006")
    assert "reversal_in_points" in warned(found)
    # lost motion: LinuxCNC moved 3 um further forward and 3 um further backward
    shift = triplets(with_it)[:, 1:] - triplets(alone)[:, 1:]
    np.testing.assert_allclose(shift, np.tile([-0.003, 0.003], (5, 1)), atol=2e-6)
    assert found["figures"]["after"]["E"] < 0.05


def test_a_fanuc_with_two_tables_gets_it_in_the_second_one_and_zero_in_1851(run, tmp_path, capsys):
    output = tmp_path / "p.txt"
    more = ("--set", "bidirectional=1", "--set", "largest_value=127", "--points", "5")
    assert correct(run, output, *more, "--backlash-in-force", "0.008", control="fanuc") == 0
    assert "N01851A1P0" in output.read_text()
    printed = " ".join(capsys.readouterr().out.split())
    assert "with the -8.00 µm that were apart" in printed


@pytest.mark.parametrize(
    ("control", "more", "code"),
    [
        ("sinumerik", (), "reversal_stays_in_force"),
        ("heidenhain-itnc530", (), "no_place_for_reversal"),
        ("linuxcnc", ("--merge", "OLD"), "reversal_in_points"),
    ],
)
def test_a_reversal_value_that_the_file_does_not_replace_is_refused(
    run, tmp_path, control, more, code
):
    old = tmp_path / "old.comp"
    old.write_text("0 0 0\n250 250.01 250.01\n")
    more = tuple(word.replace("OLD", str(old)) for word in more)
    output = tmp_path / "x"
    in_force = (*more, "--backlash-in-force", "0.009")
    assert refused(run, output, *in_force, control=control) == code
    assert not output.exists()
    assert correct(run, output, *more, "--backlash-in-force", "0", control=control) == 0


def test_a_reversal_value_in_micrometres_is_refused(run, tmp_path, capsys):
    for value in ("9", "nan", "-1.5", "nine"):
        with pytest.raises(SystemExit):
            correct(run, tmp_path / "x", "--backlash-in-force", value)
        assert "write 0.009 for 9" in capsys.readouterr().err


def test_the_stated_reversal_value_counts_and_not_that_of_the_older_file(run, tmp_path, capsys):
    old, new = tmp_path / "old.ini", tmp_path / "new.ini"
    assert correct(run, old, "--backlash", control="sinumerik") == 0  # 0.002
    more = ("--merge", str(old), "--backlash", "--backlash-in-force", "0.005")
    capsys.readouterr()
    assert correct(run, new, *more, "--json", "-", control="sinumerik") == 0
    assert backlash_value(new) == pytest.approx(0.007, abs=2e-5)
    said = warned(json.loads(capsys.readouterr().out))["reversal_differs"]
    assert (said["of_table"], said["stated"]) == pytest.approx((-2.0, -5.0), abs=0.02)


# ---- merge --------------------------------------------------------------------------------------


def test_merging_adds_what_the_run_still_shows_to_the_table_in_force(run, tmp_path, capsys):
    old, new = tmp_path / "old.comp", tmp_path / "new.comp"
    old.write_text("0 0 0\n100 100.004 100.002\n250 250.01 250.01\n")
    assert correct(run, new, "--merge", str(old)) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "Deviations in" in printed
    assert "as measured with the old table in force" in printed
    table = triplets(new)
    np.testing.assert_allclose(table[:, 0], [0, 40, 100, 160, 200, 250])
    for a, level in ((0, FORWARD), (1, BACKWARD)):
        before = np.interp(table[:, 0], [0, 100, 250], [0, (4, 2)[a], 10])
        rest = np.interp(table[:, 0], TARGETS, np.array(level) - 1.0)
        np.testing.assert_allclose(1000 * (table[:, 1 + a] - table[:, 0]), before + rest, atol=0.01)


def test_the_figures_of_a_merged_table_are_those_of_taking_the_old_one_out(run, tmp_path, capsys):
    old = tmp_path / "old.comp"
    old.write_text("0 0 0\n100 100.004 100.002\n250 250.01 250.01\n")
    found = result(capsys, run, tmp_path / "new.comp", "--merge", str(old))
    assert found["figures"]["before"]["E"] == pytest.approx(22.0, abs=0.05)
    assert found["figures"]["after"]["E"] < 0.05
    assert found["merge"]["lost"] == 0.0
    assert len(found["merge"]["old_forward"]) == len(found["table"]["positions"])
    told = result(capsys, run, tmp_path / "few.comp", "--merge", str(old), "--points", "2")
    assert "older_table_lost" in warned(told)


def test_points_of_an_older_table_are_kept_unless_its_step_would_fill_the_control(run, tmp_path):
    old, new = tmp_path / "old.ini", tmp_path / "new.ini"
    merge = ("--merge", str(old))
    assert correct(run, old, "--spacing", "25", control="sinumerik") == 0
    assert correct(run, new, *merge, control="sinumerik") == 0
    before, after = sinumerik_values(old), sinumerik_values(new)
    assert list(after) == list(before)
    assert list(after.values()) == pytest.approx([2 * v for v in before.values()], abs=2e-6)

    assert correct(run, old, "--points", "2", control="sinumerik") == 0
    old.write_text(re.sub(r"(_(STEP|MAX)\[0,X\]=)\S+", r"\g<1>0.0000001", old.read_text()))
    assert correct(run, new, *merge, control="sinumerik") == 0
    assert len(sinumerik_values(new)) == 5
    asked = refused(run, new, *merge, "--spacing", "1e-4", control="sinumerik")
    assert asked == "too_many_points"


def test_merging_reads_the_older_table_of_several_and_tells_what_points_lose(run, tmp_path, capsys):
    first, second, new = (tmp_path / name for name in ("a.ini", "b.ini", "new.ini"))
    assert correct(run, first, "--spacing", "50", control="sinumerik") == 0
    assert correct(run, second, "--spacing", "50", "--reference", "200", control="sinumerik") == 0
    first.write_bytes(first.read_bytes() + second.read_bytes())
    more = ("--merge", str(first), "--set", "table=2", "--reference", "200")
    assert correct(run, new, *more, control="sinumerik") == 0
    old, values = sinumerik_values(second), sinumerik_values(new)
    assert values == pytest.approx({i: 2 * value for i, value in old.items()}, abs=2e-6)
    first.write_text("0 0 0\n120 120.007 120.007\n130 130 130\n600 600 600\n")
    capsys.readouterr()
    said = result(capsys, run, tmp_path / "x", "--merge", str(first), "--points", "4")
    lost = warned(said)["older_table_lost"]
    assert (lost["lost_at_point"], lost["position"]) == (pytest.approx(7.0), 120.0)


def test_points_outside_the_targets_are_named_with_their_values(run, tmp_path, capsys):
    output = tmp_path / "x.comp"
    said = warned(result(capsys, run, output, "--spacing", "45"))["points_outside_targets"]
    ((place, forward, backward),) = (row for row in triplets(output) if row[0] > 200.0)
    value = f"{1000 * (forward - place):+.2f} and {1000 * (backward - place):+.2f} µm"
    assert said["points"] == [f"{place:.9g} mm: {value}"]


@pytest.mark.parametrize(
    ("control", "grid"),
    [
        ("linuxcnc", ("--points", "31")),
        ("sinumerik", ("--spacing", "20")),
        ("fanuc", ("--spacing", "20", "--set", "largest_value=127")),
    ],
)
def test_merging_a_run_that_covers_less_keeps_the_rest_of_the_older_table(
    run: Path, tmp_path: Path, control: str, grid: tuple[str, ...],
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    lines = [line for line in run.read_text().splitlines() if not line.count("#")]
    longer = [lines[0]]
    for line in lines[1:]:
        cycle, word, target, deviation, time = line.split(",")
        longer.append(f"{cycle},{word},{3 * float(target)},{deviation},{time}")
    whole = tmp_path / "whole.csv"
    whole.write_text("\n".join(["# header axis: X", *longer]) + "\n", encoding="utf-8")
    old, new = tmp_path / "old", tmp_path / "new"
    assert correct(whole, old, *grid, control=control) == 0
    capsys.readouterr()
    more = (*grid, "--merge", str(old), "--json", "-")
    assert correct(run, new, *more, control=control) == 0
    found = json.loads(capsys.readouterr().out)
    assert min(found["table"]["positions"]) == pytest.approx(0.0)
    assert max(found["table"]["positions"]) >= 600.0 - 1e-6
    assert "older_table_lost" not in warned(found)
    # beyond the run the new table is the old one plus a constant
    table = controls.control_by_name(control)
    options = controls.check_options(table, [w for w in grid if "=" in w], purpose="table")
    at = np.arange(240.0, 601.0, 40.0)
    values = [
        table.correction(
            table.read_table(f.read_text(), "t", AxisKind.LINEAR, options).table, at
        ).mean(axis=1)
        for f in (old, new)
    ]
    step = 1.01 if control == "fanuc" else 0.02
    assert np.ptp(values[1] - values[0]) <= step


@pytest.mark.parametrize("deviation", [0.0, 0.001])
def test_an_older_point_beside_a_target_is_left_out_unless_the_older_table_bends_there(
    run, tmp_path, deviation, capsys
):
    old, new = tmp_path / "old.comp", tmp_path / "new.comp"
    value = f"{99.995 + deviation:.6f}"
    old.write_text(f"0 0 0\n99.98 99.98 99.98\n99.995 {value} {value}\n200 200 200\n")
    assert correct(run, new, "--merge", str(old)) == 0
    printed = " ".join(capsys.readouterr().out.split())
    positions = triplets(new)[:, 0].tolist()
    assert (99.995 in positions) is (deviation > 0.0)
    assert ("1 of them lie nearer than 0.01 mm to a target" in printed) is (deviation > 0.0)
    assert {0.0, 40.0, 99.98, 100.0, 160.0, 200.0} <= set(positions)


def fanuc_words(path: Path) -> dict[int, int]:
    return {int(n): int(v) for n, v in re.findall(r"N(\d{5})(?:A\d)?P(-?\d+)", path.read_text())}


def test_merging_keeps_the_reference_point_that_the_older_file_states(run, tmp_path, capsys):
    old, new = tmp_path / "old", tmp_path / "new"
    words = ("--set", "largest_value=127")
    assert correct(run, old, "--reference", "100", "--spacing", "50", *words, control="fanuc") == 0
    capsys.readouterr()
    assert correct(run, new, "--merge", str(old), *words, control="fanuc") == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "Reference point: old 100 mm, new 100 mm" in printed
    before, after = fanuc_words(old), fanuc_words(new)
    assert [after[n] for n in (3620, 3621, 3622)] == [before[n] for n in (3620, 3621, 3622)]
    points = [n for n in before if n >= 10000]
    assert max(abs(after[n] * after[3623] - 2 * before[n] * before[3623]) for n in points) <= 1
    more = ("--merge", str(old), *words, "--reference", "0")
    asked = refused(run, tmp_path / "other", *more, control="fanuc")
    assert asked == "points_count_from_reference"
    assert not (tmp_path / "other").exists()


@pytest.mark.parametrize("control", ["linuxcnc", "heidenhain-tnc640"])
def test_merging_takes_the_zero_of_an_older_table_whose_file_is_read_without_one(
    run, tmp_path, control, capsys
):
    old, new = tmp_path / "old", tmp_path / "new"
    assert correct(run, old, "--reference", "100", "--spacing", "50", control=control) == 0
    capsys.readouterr()
    assert correct(run, new, "--merge", str(old), "--json", "-", control=control) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["reference_position"] == pytest.approx(100.0, abs=1e-6)
    assert found["merge"]["reference_position"] == pytest.approx(100.0, abs=1e-6)


def test_a_reference_point_that_moves_the_zero_of_the_older_table_is_warned_of(
    run, tmp_path, capsys
):
    old = tmp_path / "old.comp"
    old.write_text("0 0 0\n40 40.001 40.001\n200 200.001 200.001\n")
    asked = ("--merge", str(old))
    found = result(capsys, run, tmp_path / "a", *asked)
    assert found["reference_position"] == 0.0
    assert "zero_moves" not in warned(found)
    found = result(capsys, run, tmp_path / "b", *asked, "--reference", "100")
    moved = warned(found)["zero_moves"]
    assert (moved["value"], moved["position"]) == (pytest.approx(1.0), 100.0)
    assert found["merge"]["reference_position"] == 0.0
    old.write_text("0 0.001 0.001\n200 200.002 200.002\n")
    found = result(capsys, run, tmp_path / "c", *asked)
    moved = warned(found)["zero_moves"]
    assert (moved["value"], moved["position"]) == (pytest.approx(1.0), 0.0)
    assert found["merge"]["reference_position"] is None


@pytest.mark.parametrize(("place", "zero"), [(60.0, 50.0), (-20.0, 50.0), (190.0, 180.0)])
def test_the_zero_of_an_older_table_is_the_nearest_of_several(place, zero):
    mean = np.array([2.0, 1.0, -1.0, -2.0, 0.0, 3.0])
    position = np.array([0.0, 40.0, 60.0, 100.0, 180.0, 200.0])
    table = CompensationTable(
        kind=AxisKind.LINEAR, axis="", position=position, deviation=np.stack((mean, mean), axis=1)
    )
    rule = controls.control_by_name("linuxcnc").grid_rule(AxisKind.LINEAR, {"type": "0"})
    target = np.array([place, place + 500.0]) if place > 0 else np.array([-900.0, place])
    found = reference_point(target, None, ReadTable(table=table), rule)
    assert found.position == pytest.approx(zero)
    assert found.older == found.position


def test_merging_into_two_fanuc_tables_moves_1851_into_them_and_corrects_no_less(
    run, tmp_path, capsys
):
    old, new = tmp_path / "old.txt", tmp_path / "new.txt"
    more = ("--set", "bidirectional=1", "--set", "largest_value=127", "--points", "5")
    assert correct(run, old, *more, control="fanuc") == 0
    old.write_text(old.read_text().replace("N03620A1", "N01851A1P5\nN03620A1"))
    capsys.readouterr()
    words = ["correct", str(run), "--control", "fanuc", *more, "--merge", str(old), "-o", str(new)]
    assert main([*words, "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert "N01851A1P0" in new.read_text()
    assert found["backlash_in_force"] == pytest.approx(-5.0)
    difference = np.array(found["table"]["deviation_forward"])
    difference = difference - np.array(found["table"]["deviation_backward"])
    # twice the reversal of the run (-2) and 5 um of lost motion that 1851 corrected
    np.testing.assert_allclose(difference, -9.0, atol=2.0)
    assert abs(np.mean(difference) + 9.0) <= 1.0
    left = found["bound"]["interpolation"] + found["bound"]["rounding"]
    assert found["figures"]["after"]["E"] <= 2.0 * left + 0.05


def test_the_older_table_of_another_axis_is_refused(run, tmp_path, capsys):
    old = tmp_path / "old.ini"
    assert correct(run, old, "--axis", "AX7", control="sinumerik") == 0
    asked = refused(run, tmp_path / "n.ini", "--merge", str(old), control="sinumerik")
    assert asked == "table_of_another_axis"


# ---- files --------------------------------------------------------------------------------------


def test_nothing_that_was_measured_and_no_table_in_force_is_overwritten(run, tmp_path, capsys):
    old = tmp_path / "old.comp"
    old.write_text("0 0 0\n250 250.01 250.01\n")
    contents = [p.read_bytes() for p in (run, old)]
    x = tmp_path / "x"
    assert refused(run, run) == "output_is_input"
    assert refused(run, old, "--merge", str(old)) == "output_is_input"
    assert refused(run, x, "--json", str(run)) == "output_is_input"
    assert refused(run, x, "--json", str(x)) == "outputs_have_one_name"
    assert refused(run, tmp_path / "no" / "x") == "folder_missing"
    assert refused(run, Path("-")) == "no_name"
    assert [p.read_bytes() for p in (run, old)] == contents
    assert not (tmp_path / "x").exists()


def test_a_table_that_stood_there_is_kept_under_another_name(run, tmp_path, capsys):
    output = tmp_path / "x.comp"
    for k, content in enumerate(("0 0 0\n1 1 1\n", "0 0 0\n2 2 2\n"), start=1):
        output.write_text(content)
        found = result(capsys, run, output)
        assert found["older_file"] == f"{output}.old-{k}"
        assert Path(f"{output}.old-{k}").read_text() == content
    assert correct(run, output) == 0
    assert "was kept as" not in capsys.readouterr().out
    assert sorted(p.name for p in tmp_path.glob("x.comp*")) == [
        "x.comp",
        "x.comp.old-1",
        "x.comp.old-2",
    ]


def test_the_same_words_give_the_same_table_byte_for_byte(run, tmp_path):
    files = [tmp_path / name for name in ("a", "b")]
    for file in files:
        assert correct(run, file, "--drift-free", control="sinumerik") == 0
    assert files[0].read_bytes() == files[1].read_bytes()


def test_the_axis_is_the_runs_or_the_stated_one_or_assumed_with_a_warning(run, tmp_path, capsys):
    unnamed = write_run(tmp_path / "unnamed.csv", axis="")
    odd = write_run(tmp_path / "odd.csv", axis="X) G0 Z-100")
    assert result(capsys, run, tmp_path / "x", "--axis", "Y1")["axis"] == "Y1"
    found = result(capsys, unnamed, tmp_path / "x")
    assert found["axis"] == warned(found)["axis_assumed"]["axis"] == "X"
    found = result(capsys, odd, tmp_path / "x")
    assert warned(found)["axis_name_unusable"] == {"stated": "X) G0 Z-100", "axis": found["axis"]}
    assert refused(run, tmp_path / "x", "--axis", "X]=1") == "not_an_axis_name"


@pytest.mark.parametrize("more", [("--no-drift",), ()])
def test_without_the_drift_model_the_table_is_the_same_and_drift_is_said_to_be_unknown(
    tmp_path, more, capsys
):
    run = write_run(tmp_path / "run.csv", drift_um=8.0)
    found = result(capsys, run, tmp_path / "x.comp", *more)
    assert (found["figures_without_drift"] is None) is bool(more)
    assert ("drift_unknown" in warned(found)) is bool(more)
    assert correct(run, tmp_path / "y.comp", "--drift-free") == 0
    assert correct(run, tmp_path / "y.comp", "--no-drift") == 0
    assert (tmp_path / "y.comp").read_bytes() == (tmp_path / "x.comp").read_bytes()
    assert refused(run, tmp_path / "z", "--no-drift", "--drift-free") == "options_exclude"


@pytest.mark.parametrize("more", [(), ("--drift-free",)])
def test_limits_of_the_control_are_checked_before_the_drift_model(
    run, tmp_path, more, monkeypatch, capsys
):
    def never(*_: object, **__: object) -> None:
        raise AssertionError

    with monkeypatch.context() as within:
        within.setattr(_make_table, "with_drift", never)
        asked = refused(run, tmp_path / "x.comp", "--points", "257", *more)
        assert asked == "too_many_table_points"
    assert correct(run, tmp_path / "x.comp", "--points", "256", *more) == 0


# ---- values that no axis has --------------------------------------------------------------------


def straight(slope: float) -> tuple[float, ...]:
    return tuple(slope * target for target in TARGETS)


def test_errors_that_no_axis_has_are_refused_and_large_ones_doubted(tmp_path, capsys):
    output = tmp_path / "x.comp"
    run = write_run(tmp_path / "run.csv", straight(100.2), straight(100.2))
    assert refused(run, output, "--no-drift") == "table_too_steep"
    assert not output.exists()
    for slope, doubts in ((99.8, {"steep", "large"}), (5.05, {"large"}), (4.95, set())):
        run = write_run(tmp_path / "run.csv", straight(slope), straight(slope))
        said = warned(result(capsys, run, output, "--no-drift"))
        assert said.keys() & {"steep", "large"} == doubts
        if "large" in said:
            assert said["large"]["largest"] == pytest.approx(200.0 * slope, rel=0.01)


def table_with(position: list[float], value: list[float], kind: AxisKind) -> CompensationTable:
    return CompensationTable(
        kind=kind,
        axis="X",
        position=np.array(position),
        deviation=np.stack((np.array(value),) * 2, axis=1),
    )


@pytest.mark.parametrize(("kind", "share"), [(AxisKind.LINEAR, 100.0), (AxisKind.ROTARY, 360.0)])
def test_the_limit_of_the_slope_is_a_tenth_of_the_way_on_both_kinds_of_axis(kind, share):
    near = table_with([0.0, 10.0, 20.0], [0.0, 9.99 * share, 0.0], kind)
    (said,) = doubts_about_size(near)
    assert said.code == "warning-steep"
    with pytest.raises(DataError) as caught:
        doubts_about_size(table_with([0.0, 10.0, 20.0], [0.0, 10.0 * share, 0.0], kind))
    assert caught.value.code == "table_too_steep"
    small = table_with([0.0, 10.0, 20.0], [0.0, 0.099 * share * 10.0, 0.0], kind)
    assert doubts_about_size(small) == ()


def test_two_points_close_together_are_no_reason_to_doubt_the_unit():
    close = table_with([0.0, 100.0, 100.005, 200.0], [0.0, 1.0, 2.0, 3.0], AxisKind.LINEAR)
    assert close.steepest_slope[0] == pytest.approx(200.0)
    assert doubts_about_size(close) == ()
    short = table_with([0.0, 0.1, 0.2], [0.0, 10.0, 20.0], AxisKind.LINEAR)
    with pytest.raises(DataError):
        doubts_about_size(short)


def test_the_sum_with_an_older_table_is_held_to_the_same_limits(run, tmp_path, capsys):
    old = tmp_path / "old.comp"
    old.write_text("0 0 0\n200 202.1 202.1\n")
    found = result(capsys, run, tmp_path / "a", "--merge", str(old))
    assert warned(found)["steep"]["slope"] > 10.0
    old.write_text("0 0 0\n200 221 221\n")
    assert refused(run, tmp_path / "b", "--merge", str(old)) == "table_too_steep"
    assert not (tmp_path / "b").exists()


# ---- a control that lies ------------------------------------------------------------------------


@final
class Forgetful(Control):
    """A control whose file is read back otherwise than it was written."""

    title = "Forgetful"
    sign = unit = Message("advice-fanuc_unit")
    suffix = ".txt"

    def __init__(self, off: float = 0.0, lost: int = 0) -> None:
        self.off, self.lost = off, lost
        self.last: CompensationTable | None = None

    def format_program(self, request: ProgramRequest) -> str:
        raise NotImplementedError

    def format_touch(self, request: TouchRequest) -> str:
        raise NotImplementedError

    def grid_rule(self, kind: AxisKind, options: Mapping[str, str]) -> GridRule:
        return GridRule(
            equidistant=False,
            most_points=None,
            per_direction=True,
            backlash_apart=False,
            resolution=0.1,
            decimals=3,
        )

    def format_table(self, request: TableRequest) -> TableText:
        self.last = request.table
        return TableText(text="table\n", advice=())

    def read_table(
        self, text: str, path: str, kind: AxisKind, options: Mapping[str, str]
    ) -> ReadTable:
        assert self.last is not None
        k = self.last.position.size - self.lost
        table = CompensationTable(
            kind=kind,
            axis="",
            position=self.last.position[:k],
            deviation=self.last.deviation[:k] + self.off,
        )
        return ReadTable(table=table)


@pytest.mark.parametrize(
    ("control", "code"),
    [
        (Forgetful(off=0.06), "read_back_values_differ"),
        (Forgetful(lost=1), "read_back_points_differ"),
    ],
)
def test_a_file_that_is_not_read_back_as_it_was_meant_is_not_written(
    run, tmp_path, control, code, monkeypatch
):
    monkeypatch.setattr(_make_table, "control_by_name", lambda _: control)
    assert refused(run, tmp_path / "x", control="forgetful") == code
    assert not (tmp_path / "x").exists()


def test_half_a_step_of_rounding_is_allowed(run, tmp_path, monkeypatch):
    monkeypatch.setattr(_make_table, "control_by_name", lambda _: Forgetful(off=0.0499))
    assert correct(run, tmp_path / "x", control="forgetful") == 0
