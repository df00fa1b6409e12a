import json
import re
from pathlib import Path

import numpy as np
import pytest

from tests.unit.cli.refusals import refusal
from thermaxis.cli import execute
from thermaxis.cli.axis import _plan
from thermaxis.files import plan_sha256, read_plan
from thermaxis.positioning import BACKWARD, FORWARD, Cycle, choose_targets
from thermaxis.quantities import AxisKind

SMALL = ("--length", "100", "--targets", "6", "--pitch", "4.1")
PAPER = (
    *("--length", "300", "--targets", "16", "--feed", "300", "--dwell", "2"),
    *("--overrun", "5", "--cycles", "100", "--pitch", "5", "--seed", "1"),
)


def run(*words: object, simulated: bool = False) -> int:
    """Run the command; simulated runs take long and are made where they are the subject."""
    with pytest.MonkeyPatch.context() as patch:
        if not simulated:
            patch.setattr(_plan, "simulate_uncertainty", lambda *_: None)
        return execute(["plan", *map(str, words)])


def result(capsys: pytest.CaptureFixture[str], *words: str | Path) -> dict[str, object]:
    assert run(*words, "--json", "-") == 0
    return json.loads(capsys.readouterr().out)


def test_the_issues_command_writes_a_plan(tmp_path):
    output = tmp_path / "PLAN.json"
    assert run(*PAPER, "--mode", "bidirectional", "-o", output) == 0
    plan = read_plan(output)
    chosen = choose_targets(start=0, length=300, targets=16, pitch=5, seed=1)
    np.testing.assert_array_equal(plan.target, chosen.target)
    assert (plan.kind, plan.axis, plan.cycle) == (AxisKind.LINEAR, "X", Cycle.STANDARD)
    assert (plan.cycles, plan.feed, plan.dwell_s, plan.overrun) == (100, 300.0, 2.0, 5.0)
    assert (plan.pitch, plan.interval, plan.seed) == (5.0, chosen.interval, 1)


def test_tables_name_the_hash_the_targets_the_range_and_the_assumptions(tmp_path, capsys):
    output = tmp_path / "plan.json"
    asked = (*SMALL, "-o", output, "--noise", "0.3", "--title", "spindle side")
    assert run(*asked, simulated=True) == 0
    plan = read_plan(output)
    printed = capsys.readouterr().out
    assert f"{plan_sha256(plan)}, spindle side" in printed
    assert all(f"{position:.3f}" in printed for position in plan.target.tolist())
    assert f"from {plan.lowest:.6g} to {plan.highest:.6g} mm" in " ".join(printed.split())
    assert "noise 0.3 µm, drift 10 µm (assumed)" in printed
    assert "simulated runs through the drift" in " ".join(printed.split())


def test_json_on_standard_output_stands_alone_and_has_every_number(capsys):
    found = result(capsys, *SMALL, "--cycles", "3")
    assert set(found) == {
        *("plan", "stops", "lowest", "highest", "duration_s", "assumptions", "expected"),
        *("search", "remarks", "remark_codes", "warnings", "warning_codes", "version"),
    }
    parts = found["duration_s"]
    assert isinstance(parts, dict)
    assert parts["total"] == pytest.approx(sum(v for k, v in parts.items() if k != "total"))
    expected = found["expected"]
    assert isinstance(expected, dict)
    assert len(expected["levels_std_forward"]) == len(expected["levels_std_backward"]) == 6
    assert expected["largest_level_std"] == pytest.approx(max(expected["levels_std_forward"]))
    assert expected["figures"]["E"]["standard_uncertainty"] > 0
    assert found["assumptions"] == {
        "noise": 0.4,
        "drift": 10.0,
        "time_constant_s": 3600.0,
        "systematic": 3.0,
        "reversal": 1.0,
        "not_stated": ["noise", "drift", "time_constant_s"],
    }
    assert found["search"] is None


def test_the_same_words_give_the_same_plan_byte_for_byte(tmp_path):
    files = [tmp_path / name for name in ("a.json", "b.json", "c.json")]
    for file, seed in zip(files, ("4", "4", "5"), strict=True):
        assert run(*SMALL, "--seed", seed, "-o", file) == 0
    first, again, other = (file.read_bytes() for file in files)
    assert first == again != other


@pytest.mark.parametrize(
    ("words", "cycle", "approaches"),
    [
        (("--mode", "unidirectional"), Cycle.STANDARD, (FORWARD,)),
        (("--mode", "unidirectional", "--approach-side", "backward"), Cycle.STANDARD, (BACKWARD,)),
        (("--mode", "pilgrim"), Cycle.PILGRIM, (FORWARD, BACKWARD)),
        (("--mode", "step", "--approach-side", "forward"), Cycle.STEP, (FORWARD,)),
    ],
)
def test_modes_and_sides_set_the_order_of_visits(tmp_path, words, cycle, approaches):
    assert run(*SMALL, *words, "-o", tmp_path / "plan.json") == 0
    plan = read_plan(tmp_path / "plan.json")
    assert (plan.cycle, plan.approaches) == (cycle, approaches)


def test_a_rotary_axis_has_degrees_and_seconds_of_arc(tmp_path, capsys):
    output = tmp_path / "plan.json"
    words = ("--rotary", "--length", "360", "--targets", "9", "--start", "-180", "--feed", "720")
    assert run(*words, "-o", output) == 0
    plan = read_plan(output)
    assert (plan.kind, plan.axis) == (AxisKind.ROTARY, "C")
    assert "targets_deg" in json.loads(output.read_text(encoding="ascii"))
    assert -180.0 <= plan.target[0] < plan.target[-1] <= 180.0
    printed = capsys.readouterr().out
    assert "Expected uncertainty, arcsec" in printed
    assert " mm" not in printed


def test_a_wanted_uncertainty_sets_the_number_of_cycles(tmp_path, capsys):
    output = tmp_path / "plan.json"
    assert run(*SMALL, "--target-uncertainty", "0.12", "-o", output) == 0
    cycles = read_plan(output).cycles
    assert f"{cycles} cycles are the fewest with a standard uncertainty of the mean deviations" in (
        capsys.readouterr().out
    )
    found = result(capsys, *SMALL, "--target-uncertainty", "0.12")
    search = found["search"]
    assert isinstance(search, dict)
    assert search["cycles"] == cycles
    assert search["tried"][str(cycles)] <= 0.12 < search["tried"][str(cycles - 1)]
    of_r = result(capsys, *SMALL, "--target-uncertainty", "0.12", "--target-figure", "R")
    assert isinstance(of_r["search"], dict)
    assert of_r["search"]["cycles"] > cycles


def test_what_cannot_be_reached_is_said_with_its_limit_and_nothing_is_written(tmp_path):
    output = tmp_path / "plan.json"
    words = ("--target-uncertainty", "0.01", "--longest", "2", "-o", output)
    error = refusal("plan", *SMALL, *words)
    assert (error.code, error.place.key) == ("uncertainty_not_reached", "--target-uncertainty")
    assert (error.values["hours"], error.values["wanted"]) == (2.0, 0.01)
    assert 0.01 < error.values["standard_uncertainty"] < 0.1
    assert not output.exists()


def test_an_order_of_visits_that_hides_drift_is_warned_of(capsys):
    words = (*SMALL, "--mode", "step", "--cycles", "4")
    step = result(capsys, *words)["warnings"]
    assert isinstance(step, list)
    assert any("step cycle" in sentence for sentence in step)
    assert result(capsys, *SMALL)["warnings"] == []


def test_one_cycle_promises_no_uncertainty(capsys):
    assert run(*SMALL, "--cycles", "1") == 0
    printed = capsys.readouterr().out
    assert "Expected uncertainty: none. 12 readings of 12 targets and approaches" in printed
    assert result(capsys, *SMALL, "--cycles", "1")["expected"] is None


def test_what_cannot_be_is_refused_by_the_name_of_the_option():
    for words, option in [
        (("--dwell", "-1"), "--dwell"),
        (("--recording", "nan"), "--recording"),
        (("--feed", "0"), "--feed"),
        (("--overrun", "0"), "--overrun"),
        (("--random-share", "0.5"), "--random-share"),
        (("--pitch", "0"), "--pitch"),
        (("--targets", "1"), "--targets"),
        (("--length", "-3"), "--length"),
        (("--start", "inf"), "--start"),
        (("--seed", "-1"), "--seed"),
        (("--cycles", "0"), "--cycles"),
        (("--axis", "X;M30"), "--axis"),
        (("--title", "two\nlines"), "--title"),
        (("--noise", "0"), "--noise"),
        (("--drift", "-1"), "--drift"),
        (("--time-constant", "0"), "--time-constant"),
        (("--target-uncertainty", "0"), "--target-uncertainty"),
        (("--target-uncertainty", "1", "--target-figure", "Z"), "--target-figure"),
        (("--target-uncertainty", "1", "--longest", "nan"), "--longest"),
        (("--target-uncertainty", "1", "--cycles", "3"), "--cycles"),
        (("--longest", "3"), "--longest"),
        (("--standard",), "--standard"),
        (("--approach-side", "forward"), "--approach-side"),
        (("-o", "same.json", "--json", "same.json"), "--json"),
    ]:
        assert refusal("plan", *SMALL, *words).place.key == option


@pytest.mark.proof
def test_the_page_about_planning_shows_what_the_command_prints(root, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    page = (root / "docs" / "how-to" / "plan-a-run.md").read_text(encoding="utf-8")
    blocks = re.findall(
        r"```console\n\$ thermaxis plan ([^\n]*)\n```\n\n```text\n(.*?)```", page, re.DOTALL
    )
    assert len(blocks) == 3
    for words, shown in blocks:
        assert run(*words.split(), simulated=True) == 0
        printed = capsys.readouterr().out.splitlines()
        assert [line for line in shown.splitlines() if line not in printed] == []


def test_the_file_on_the_page_is_a_plan(root, tmp_path):
    page = (root / "docs" / "settings.md").read_text(encoding="utf-8")
    (shown,) = re.findall(r"```json\n(.*?)```", page, re.DOTALL)
    path = tmp_path / "plan.json"
    path.write_text(shown, encoding="utf-8")
    assert read_plan(path).seed == 1
