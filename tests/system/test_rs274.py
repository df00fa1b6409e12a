"""LinuxCNC's own interpreter, without a machine, drives the programs as they were planned."""

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.in_time import LONGEST_S
from thermaxis.cli import main
from thermaxis.controls import ProgramRequest, TouchRequest, check_options, control_by_name
from thermaxis.files import plan_sha256, read_thermal_test_plan
from thermaxis.positioning import (
    BACKWARD,
    FORWARD,
    Cycle,
    TestPlan,
    moves_of_plan,
    order_of_visits,
)
from thermaxis.quantities import AxisKind

pytestmark = pytest.mark.system

LETTERS = "XYZABC"
PLAN = TestPlan(
    kind=AxisKind.LINEAR,
    axis="Y",
    target=np.array([-2.0, 10.123, 20.0, 33.3]),
    cycles=3,
    feed=600.0,
    dwell_s=2.0,
    recording_s=0.25,
    overrun=4.5,
    title="x) G0 Z-100 (MSG, *) % M30",
)
OFFSETS = "G10 L2 P1 X50 Y-70 Z3\nG54\nG92 Y12.5\n"
"""Work offsets that are in force before the program starts; G53 must pass over all of them."""


def canonical(program: str, folder: Path, *, aborted: str = "", spindles: int = 1) -> list[str]:
    interpreter = shutil.which("rs274")
    assert interpreter is not None, (
        "rs274 is missing: it comes with LinuxCNC, apt-get install linuxcnc-uspace"
    )
    file = folder / "program.ngc"
    file.write_text(program, encoding="ascii")
    settings = folder / "machine.ini"
    settings.write_text(f"[TRAJ]\nSPINDLES = {spindles}\n", encoding="ascii")
    done = subprocess.run(
        [interpreter, "-i", str(settings), "-g", str(file)],
        cwd=folder,
        capture_output=True,
        encoding="utf-8",
        timeout=LONGEST_S,
        check=False,
    )
    lines = done.stdout.splitlines()
    assert any("PROGRAM_END" in line for line in lines) or aborted, done.stderr
    assert aborted in done.stderr
    return lines


def driven(program: str, letter: str, folder: Path) -> list[tuple[float, float, float]]:
    """Return machine position, direction of approach and dwell of each stop."""
    stops: list[tuple[float, float, float]] = []
    offset = {"G5X": np.zeros(6), "G92": np.zeros(6)}
    place = np.zeros(6)
    direction = 0.0
    number = LETTERS.index(letter)
    for line in canonical(program, folder):
        found = re.search(r" ([A-Z0-9_]+)\((.*)\)$", line)
        if found is None:
            continue
        name, words = found[1], found[2].split(",")
        if kind := re.fullmatch(r"SET_(G5X|G92)_OFFSET", name):
            offset[kind[1]] = np.array([float(word) for word in words[-6:]])
        assert name != "STRAIGHT_TRAVERSE"
        if name == "STRAIGHT_FEED":
            to = np.array([float(word) for word in words]) + offset["G5X"] + offset["G92"]
            direction = float(np.sign(to[number] - place[number]))
            others = np.delete(np.arange(6), number)
            assert to[others] == pytest.approx(place[others], abs=1e-3)
            place = to
        if name == "DWELL":
            stops.append((float(place[number]), direction, float(words[0])))
    return stops


def program_of(plan: TestPlan, *stated: str, warm_up: int = 0) -> str:
    control = control_by_name("linuxcnc")
    return control.format_program(
        ProgramRequest(
            plan=plan,
            plan_sha256=plan_sha256(plan),
            blocks=moves_of_plan(plan, warm_up=warm_up),
            axis=plan.axis,
            options=check_options(control, stated, purpose="program"),
        )
    )


def agrees(stops: list[tuple[float, float, float]], plan: TestPlan) -> None:
    visits = order_of_visits(plan)
    place, direction, dwell_s = np.array(stops).T
    assert place == pytest.approx(plan.target[visits.target], abs=1e-4)
    assert direction.tolist() == np.where(visits.approach == FORWARD, 1.0, -1.0).tolist()
    assert set(dwell_s.tolist()) == {2.25}


@pytest.mark.parametrize("cycle", list(Cycle))
@pytest.mark.parametrize("approaches", [(FORWARD, BACKWARD), (FORWARD,), (BACKWARD,)])
@pytest.mark.parametrize("warm_up", [0, 3])
def test_the_interpreter_drives_every_stop_in_order_whatever_offsets_are_in_force(
    tmp_path: Path, cycle: Cycle, approaches: tuple[int, ...], warm_up: int
) -> None:
    plan = replace(PLAN, cycle=cycle, approaches=approaches)
    program = program_of(plan, warm_up=warm_up)
    agrees(driven(OFFSETS + program, "Y", tmp_path), plan)


def test_a_rotary_axis_and_work_coordinates(tmp_path: Path) -> None:
    plan = replace(PLAN, kind=AxisKind.ROTARY, axis="B")
    agrees(driven(program_of(plan), "B", tmp_path), plan)
    stops = driven("G10 L2 P1 B7\n" + program_of(plan, "coordinates=work"), "B", tmp_path)
    agrees([(place - 7.0, side, dwell_s) for place, side, dwell_s in stops], plan)


def test_a_plan_of_a_thousand_targets_in_the_step_cycle(tmp_path: Path) -> None:
    """A thousand loops, each with a number of its own."""
    target = np.round(np.arange(1000) * 1.37, 3)
    plan = replace(PLAN, target=target, cycle=Cycle.STEP, cycles=2, approaches=(FORWARD, BACKWARD))
    agrees(driven(program_of(plan), "Y", tmp_path), plan)


def test_spindle_and_coolant_run_on_until_the_end_which_stops_them_and_selects_g54(
    tmp_path: Path,
) -> None:
    """The page of the control says so: before the last stop nothing changes, at M2 all of it."""
    running = "G10 L2 P2 X5\nG55\nS100 M3\nM8\n"
    text = running + program_of(PLAN)
    names = [
        found[1] + found[2]
        for line in canonical(text, tmp_path)
        if (found := re.search(r" ([A-Z0-9_]+)(\(.*\))$", line))
    ]
    flood = names.index("FLOOD_ON()")
    last = max(i for i, name in enumerate(names) if name.startswith("DWELL"))
    changing = {
        "START_SPINDLE",
        "STOP_SPINDLE",
        "SET_SPINDLE",
        "FLOOD",
        "MIST",
        "SET_G5X",
        "CHANGE",
    }
    during = [name for name in names[flood + 1 : last] if name.startswith(tuple(changing))]
    assert during == []
    after = " ".join(names[last:])
    for name in ("STOP_SPINDLE_TURNING(0)", "FLOOD_OFF()", "SET_G5X_OFFSET(1, 0.0000"):
        assert name in after


def test_a_touch_ends_before_it_moves_where_the_work_coordinates_are_rotated(
    tmp_path: Path,
) -> None:
    """No probe answers here: with straight coordinates it ends after the search."""
    control = control_by_name("linuxcnc")
    words = {"axis": "Y", "surface_mm": 10.0, "start_mm": 15.0, "search_mm": 8.0}
    options = check_options(control, (), purpose="touch")
    touch = TouchRequest(**words, feed_mm_per_min=60.0, options=options)
    for turned, reason, moves in (
        (5, "the work coordinates are rotated", 0),
        (0, "no touch within the search", 3),
    ):
        offset = f"G10 L2 P2 X3 Y-70 R{turned}\nG55\n"
        lines = canonical(offset + control.format_touch(touch), tmp_path, aborted=reason)
        assert sum("STRAIGHT_" in line for line in lines) == moves
        assert any("STOP_SPINDLE" in line for line in lines)


def test_a_part_program_that_calls_a_touch_has_its_modes_back(tmp_path: Path) -> None:
    """Its refusals are taken out, for no probe answers here."""
    control = control_by_name("linuxcnc")
    words = {"axis": "Z", "surface_mm": 10.0, "start_mm": 15.0, "search_mm": 8.0}
    options = check_options(control, (), purpose="touch")
    touch = control.format_touch(TouchRequest(**words, feed_mm_per_min=60.0, options=options))
    (tmp_path / "touch_z.ngc").write_text(touch.replace("(ABORT,", "("), encoding="ascii")
    lines = canonical("G20 G91 F3\no<touch_z> call\nG1 X1\nM2\n", tmp_path)
    *_, last = (line for line in lines if "STRAIGHT_FEED" in line)
    assert "(1.0000, 0.0000, 0.5906" in last  # an inch on, at the start in inches
    assert sum("STRAIGHT_PROBE" in line for line in lines) == 1
    rates = [line for line in lines[: lines.index(last)] if "SET_FEED_RATE" in line]
    assert "(3.0000)" in rates[-1]


HEAT = """
[sources.spindle]
levels = [0, 1000, 3000]
switch = { kind = "spindle" }
[sources.second]
levels = [0, 500]
switch = { kind = "spindle", spindle = 2 }
[sources.slide]
levels = [0, 6000]
switch = { kind = "axis", axis = "Y", from_mm = -10, to_mm = 310 }
[sources.pump]
switch = { kind = "function", on = 8, off = 9 }
"""


def heated(lines: list[str]) -> list[tuple[tuple[float, float, float, float], float]]:
    """Return the levels of spindles, axis and pump between switches, and for how long. [s]"""
    found: list[tuple[tuple[float, float, float, float], float]] = []
    speeds, turning, pump = [0.0, 0.0], [False, False], 0.0
    offset_mm, place_mm, feed, moved_s = {"G5X": 0.0, "G92": 0.0}, -10.0, 0.0, 0.0
    others = set[tuple[float, ...]]()
    for line in lines:
        call = re.search(r" ([A-Z0-9_]+)\(([-\d., ]*)\)$", line)
        if call is None:
            continue
        name, words = call[1], [float(word) for word in call[2].replace(",", " ").split()]
        if kind := re.fullmatch(r"SET_(G5X|G92)_OFFSET", name):
            offset_mm[kind[1]] = words[-5]
        elif name == "SET_SPINDLE_SPEED":
            speeds[int(words[0])] = words[1]
        elif name in {"START_SPINDLE_CLOCKWISE", "STOP_SPINDLE_TURNING"}:
            turning[int(words[0])] = name.startswith("START")
        elif name in {"FLOOD_ON", "FLOOD_OFF"}:
            pump = float(name == "FLOOD_ON")
        elif name == "SET_FEED_RATE":
            feed = words[0]
        elif name == "STRAIGHT_FEED":
            to_mm = words.pop(1) + sum(offset_mm.values())
            others.add(tuple(words))
            assert min(abs(to_mm - end_mm) for end_mm in (-10.0, 310.0)) < 1e-3
            moved_s += 60.0 * abs(to_mm - place_mm) / feed
            place_mm = to_mm
        elif name == "DWELL":  # every step ends with one
            spindles = [speed * on for speed, on in zip(speeds, turning, strict=True)]
            level = (*spindles, feed * bool(moved_s), pump)
            found.append((level, moved_s + words[0]))
            assert words[0] < 7.0 or moved_s == 0.0  # it moves as long as a whole way fits
            moved_s = 0.0
        assert name != "STRAIGHT_TRAVERSE"
    assert len(others) == 1  # no other axis moves
    return found


def test_the_interpreter_heats_as_the_command_has_planned(tmp_path: Path) -> None:
    """Whatever offsets, units and modes were in force."""
    heat, file, program = (tmp_path / name for name in ("heat.toml", "plan.json", "test.ngc"))
    heat.write_text(HEAT, encoding="utf-8")
    words = ["thermal-test", "plan", "--machine", heat, "--duration", "3h", "-o", file]
    assert main([*map(str, words)]) == 0
    words = ["program", file, "--control", "linuxcnc", "-o", program, "--travel=-20:320"]
    assert main([*map(str, words)]) == 0
    before = "G10 L2 P2 X50 Y-70 Z3\nG55\nG92 Y12.5\nG20 G91 G95 F3\nS900 M3\nM8\n"
    lines = canonical(before + program.read_text("ascii"), tmp_path, spindles=2)
    steps = read_thermal_test_plan(file).steps
    done = heated(lines)
    assert [levels for levels, _ in done] == [step.levels for step in steps]
    assert len({level for step in steps for level in step.levels}) > 4  # every source ran
    for (_, seconds), step in zip(done, steps, strict=True):
        assert seconds == pytest.approx(step.duration_s, abs=1e-2)
    stops = [line for line in lines if "STOP_SPINDLE" in line]
    assert len(stops) >= 4  # all stand at begin and end, and M2 stops them once more
