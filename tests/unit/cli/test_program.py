import re
from pathlib import Path

import pytest

from tests.unit.cli.refusals import code_of, refusal
from thermaxis.cli import main
from thermaxis.controls import control_names
from thermaxis.files import plan_sha256, read_plan
from thermaxis.positioning import evaluate_duration

PLAN = ("plan", "--length", "300", "--targets", "6", "--pitch", "5", "--cycles", "3")


@pytest.fixture(scope="module")
def content(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("plan") / "plan.json"
    assert main([*PLAN, "-o", str(path)]) == 0
    return path.read_bytes()


@pytest.fixture
def plan(tmp_path: Path, content: bytes) -> Path:
    path = tmp_path / "plan.json"
    path.write_bytes(content)
    return path


def words(plan: Path, output: Path, *more: str) -> list[str]:
    return ["program", str(plan), "--control", "linuxcnc", "-o", str(output), *more]


@pytest.mark.parametrize("name", control_names())
def test_every_control_gets_a_program_that_names_the_plan_by_its_hash(plan, tmp_path, name, capsys):
    output = tmp_path / "run.nc"
    asked = ["program", str(plan), "--control", name, "-o", str(output), "--travel", "-10:510"]
    assert main(asked) == 0
    sha256 = plan_sha256(read_plan(plan))
    text = output.read_bytes().decode("ascii")
    letters = re.sub(r"[^0-9a-f]", "", text.lower())
    assert sha256 in letters or all(sha256[k : k + 16] in text.lower() for k in range(0, 64, 16))
    printed = capsys.readouterr().out
    assert f"hash {sha256}" in printed
    assert "moves from -2.441 to 302.117 mm at 300 mm/min" in printed
    assert "warning" not in printed


def test_a_travel_may_begin_with_a_minus_and_options_behind_it_are_still_options(
    plan, tmp_path, capsys
):
    output = tmp_path / "a.ngc"
    assert main(words(plan, output, "--travel", "-2.5:+3.1e2", "--warm-up", "2")) == 0
    printed = capsys.readouterr().out
    assert "within the stated travel" in printed
    assert "warning" not in printed
    for wrong in (("--travel", "--warm-up"), ("-x",)):
        with pytest.raises(SystemExit):
            main(words(plan, output, *wrong))


@pytest.mark.parametrize(("travel", "excess"), [("0:300", 2.441), ("-10:300", 2.117)])
def test_a_program_that_leaves_the_travel_is_refused_and_nothing_is_written(
    plan, tmp_path, travel, excess
):
    output = tmp_path / "a.ngc"
    error = refusal(*words(plan, output, "--travel", travel))
    assert (error.code, error.place.key) == ("program_beyond_travel", "--travel")
    assert error.values["excess"] == pytest.approx(excess, abs=1e-3)
    assert error.values["lowest"] == pytest.approx(-2.441, abs=1e-3)
    assert error.values["highest"] == pytest.approx(302.117, abs=1e-3)
    assert not output.exists()


def test_the_exact_travel_is_enough(plan, tmp_path):
    p = read_plan(plan)
    travel = f"{p.lowest!r}:{p.highest!r}"
    assert main(words(plan, tmp_path / "a.ngc", "--travel", travel)) == 0


def test_a_travel_that_cannot_be_is_refused(plan, tmp_path):
    for travel in ["5", "1:1", "a:b", "nan:3", "0:inf", "1:2:3"]:
        with pytest.raises(SystemExit):
            main(words(plan, tmp_path / "a.ngc", f"--travel={travel}"))


def test_without_a_travel_screen_and_head_of_the_program_warn(plan, tmp_path, capsys):
    output = tmp_path / "a.ngc"
    assert main(words(plan, output)) == 0
    assert "warning: the travel of the axis was not stated" in capsys.readouterr().out
    assert "travel" in output.read_text(encoding="ascii").lower()


def test_the_warm_up_is_in_the_program_and_in_its_duration(plan, tmp_path, capsys):
    output = tmp_path / "a.ngc"
    assert main(words(plan, output, "--warm-up", "10")) == 0
    p = read_plan(plan)
    warm_min = 20 * (p.highest - p.lowest) / p.feed  # the last way leads to the start of the run
    printed = capsys.readouterr().out
    assert f"{warm_min:.1f} min of it warm-up" in printed
    total = warm_min + evaluate_duration(p).total_s / 60.0
    total -= p.overrun / p.feed  # the way from the last cycle's end, which nobody drives
    (minutes,) = re.findall(r"takes (\S+) min", printed)
    assert float(minutes) == pytest.approx(total, abs=0.3)
    (of_head,) = re.findall(r"duration about (\S+) min", output.read_text(encoding="ascii"))
    assert minutes == of_head
    assert "warm up" in output.read_text(encoding="ascii")


@pytest.mark.parametrize("more", [("--axis", "X)\nG0 Z-9"), ("--set", "colour=red")])
def test_what_the_control_cannot_do_is_refused(plan, tmp_path, more):
    output = tmp_path / "a.ngc"
    refusal(*words(plan, output, *more))
    assert not output.exists()


def test_the_plan_is_never_overwritten(plan, content):
    for output, code in (
        (plan, "output_is_input"),
        (plan.parent / "no" / "a.ngc", "folder_missing"),
        (plan.parent, "is_a_folder"),
    ):
        assert code_of(*words(plan, output)) == code
    assert plan.read_bytes() == content


def test_a_file_that_is_no_plan_is_refused(tmp_path, capsys):
    other = tmp_path / "a.json"
    other.write_text("{}", encoding="ascii")
    assert main(words(other, tmp_path / "a.ngc")) == 2
    assert "thermaxis-plan" in capsys.readouterr().err


TOUCH = {"--touch": "10", "--from": "15", "--search": "8", "--feed": "60", "--axis": "Z"}


def touch_words(output: Path, **changes: str | None) -> list[str]:
    options = {"--control": "linuxcnc"} | TOUCH
    options |= {f"--{name.replace('_', '-')}": value for name, value in changes.items()}
    stated = [f"{name}={value}" for name, value in options.items() if value is not None]
    return ["program", "-o", str(output), *stated]


@pytest.mark.parametrize("name", control_names())
def test_a_touch_needs_no_plan_and_may_be_made_every_n_minutes(name, tmp_path, capsys):
    output = tmp_path / "touch.nc"
    asked = touch_words(output, control=name, touch="9.5")
    assert main([*asked, "--times", "4", "--every", "30min", "--travel", "7:15"]) == 0
    printed = capsys.readouterr().out
    assert "axis Z from 15 to 7 mm at most" in printed
    assert "warning" not in printed
    text = output.read_text(encoding="ascii")
    assert "1800" in text
    assert "9.500" in text
    assert main(asked) == 0
    assert "checked: compare 7 to 15 mm with" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        *(({name: None}, "option_needs") for name in ("axis", "from", "search", "feed")),
        *(({"times": "3"}, "option_needs"), ({"every": "30min"}, "option_needs")),
        ({"touch": None}, "either_option"),
        ({"warm_up": "2"}, "options_exclude"),
        ({"travel": "7.001:20"}, "program_beyond_travel"),
        ({"set": "type=1"}, "unknown_control_option"),
    ],
)
def test_a_touch_that_is_not_whole_is_refused_and_nothing_is_written(changes, code, tmp_path):
    output = tmp_path / "touch.nc"
    assert code_of(*touch_words(output, **changes)) == code
    assert not output.exists()


def test_every_touch_of_the_pages_runs_as_typed(tmp_path, monkeypatch):
    docs = Path(__file__).parents[3] / "docs"
    pages = (docs / "commands.md", *(docs / "controls").glob("*.md"))
    typed = [
        line.split()[2:]
        for page in pages
        for line in page.read_text(encoding="utf-8").splitlines()
        if line.startswith("$ thermaxis program --touch")
    ]
    assert len(typed) == 5  # one for each maker, and the page of the commands
    monkeypatch.chdir(tmp_path)
    for asked in typed:
        assert main(asked) == 0


def test_a_plan_has_no_options_of_a_touch(plan, tmp_path):
    for words_of_touch, code in (
        (("--touch", "10"), "either_option"),
        (("--feed", "60"), "option_needs"),
        (("--every", "1min"), "option_needs"),
    ):
        assert code_of(*words(plan, tmp_path / "a.ngc", *words_of_touch)) == code
