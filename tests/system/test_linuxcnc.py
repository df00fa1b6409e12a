"""NC programs and compensation tables on a real control: LinuxCNC without display.

Behind joint 0 stands a virtual axis with a bow of 20 µm, 2 µm at the screw's pitch, 3 µm of play
and thermal drift. It is measured, corrected and measured again with the commands of the program
alone. The formulas of the axis are written down here once more, apart from its simulation.
"""

import json
import re
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from tests.system.linuxcnc.machine import AXES, Physics, Table, Trace, missing, run_program
from tests.system.linuxcnc.recording import Stop, find_stops, write_run
from thermaxis.cli import main
from thermaxis.controls import check_options, control_by_name
from thermaxis.quantities import AxisKind

pytestmark = [pytest.mark.system, pytest.mark.real_time]

FORWARD, BACKWARD = 0, 1
EXACT_MM = 1e-9
NOISE_UM = 0.02
DWELL_S = 0.1
ATTEMPTS = 4
"""A program is run so often at most, until no pause of the computer took or made a stop. [1]"""


@pytest.fixture(scope="module", autouse=True)
def linuxcnc() -> None:
    """Fail, in CI and elsewhere, where there is no LinuxCNC: a skipped proof proves nothing."""
    reason = missing()
    if reason:
        pytest.fail(reason, pytrace=False)


def test_a_missing_linuxcnc_is_named_with_the_command_that_installs_it() -> None:
    reason = missing((Path("/nowhere/linuxcnc"),))
    assert "/nowhere/linuxcnc not found" in reason
    assert "apt-get install" in reason
    assert missing(()) == ""


# ---- (1) the NC program of a plan ---------------------------------------------------------------

Visit = tuple[int, int]


def standard(m: int, n: int) -> list[Visit]:
    one = [(i, FORWARD) for i in range(m)] + [(i, BACKWARD) for i in reversed(range(m))]
    return n * one


def from_above(m: int, n: int) -> list[Visit]:
    return n * [(i, BACKWARD) for i in reversed(range(m))]


def step(m: int, n: int) -> list[Visit]:
    return [(i, side) for i in range(m) for _ in range(n) for side in (FORWARD, BACKWARD)]


def pilgrim(m: int, n: int) -> list[Visit]:
    found: list[Visit] = []
    for last in range(m + n - 1):
        window = [i for i in range(last - n + 1, last + 1) if 0 <= i < m]
        found += [(i, FORWARD) for i in window] + [(i, BACKWARD) for i in reversed(window)]
    return found


MODES = {
    "bidirectional": ((), standard),
    "unidirectional": (("--approach-side", "backward"), from_above),
    "pilgrim": ((), pilgrim),
    "step": ((), step),
}


@pytest.mark.parametrize("mode", MODES)
def test_the_axis_visits_every_target_in_order_from_its_side_and_dwells(
    mode: str, tmp_path: Path
) -> None:
    words, order = MODES[mode]
    m, n, feed, overrun = 4, 2, 12000.0, 3.0
    plan = make_plan(
        tmp_path / "plan.json",
        *("--start", "-40", "--length", "80", "--targets", str(m), "--cycles", str(n)),
        *("--feed", str(feed), "--overrun", str(overrun), "--mode", mode, *words),
        *("--title", "x) G0 Z-50 *) (MSG, hello) o<x> call"),
    )
    text = make_program(tmp_path / "plan.json", "--travel=-45:45", "--warm-up", "1")
    assert plan["sha256"] in text
    target, visits = np.array(plan["targets_mm"]), order(m, n)
    trace, stops = visit(text, target, visits, 0.95 * DWELL_S)
    assert trace.user != 0
    assert [s.approach for s in stops] == [side for _, side in visits]
    expected = target[[i for i, _ in visits]]
    np.testing.assert_allclose([s.position for s in stops], expected, rtol=0, atol=EXACT_MM)
    assert min(s.duration_s for s in stops) >= 0.98 * DWELL_S
    for before, stop in zip([None, *stops[:-1]], stops, strict=True):
        assert_approached(trace, before, stop, overrun)

    low, high = float(target[0]) - overrun, float(target[-1]) + overrun
    assert np.min(trace.position) >= low - EXACT_MM
    assert np.max(trace.position) <= high + EXACT_MM
    warm_up = trace.position[: stops[0].begin]
    assert [np.min(warm_up), np.max(warm_up)] == pytest.approx([low, high], abs=0.01)
    assert np.max(np.abs(trace.velocity)) <= feed / 60.0 * (1.0 + 1e-9)
    assert np.all(trace.bystander == 0.0)


def assert_approached(trace: Trace, before: Stop | None, stop: Stop, overrun: float) -> None:
    """Assert that the way to a stop comes from its side, by the overrun where the axis turned."""
    sign = 1.0 if stop.approach == FORWARD else -1.0
    way = sign * (trace.position[0 if before is None else before.end - 1 : stop.begin + 1])
    end = sign * stop.position
    begin = way.size - 1 - np.argmin(way[::-1])  # the last period of a turn
    final = way[begin:]
    assert np.all(np.diff(final) > 0.0)
    assert final[-1] == pytest.approx(end, abs=EXACT_MM)
    if before is not None and sign * (stop.position - before.position) > 1e-6:
        assert begin == 0  # straight on, without a turn
    elif before is not None:  # the turn lies between two servo periods
        assert end - way[begin] == pytest.approx(overrun, abs=0.01)


def test_work_coordinates_follow_the_work_offset_and_machine_coordinates_do_not(
    tmp_path: Path,
) -> None:
    offset = "G10 L2 P1 X10\n"
    plan = make_plan(
        tmp_path / "plan.json",
        *("--start", "-20", "--length", "40", "--targets", "3", "--cycles", "1"),
    )
    target = np.array(plan["targets_mm"])
    for coordinates, shift in (("machine", 0.0), ("work", 10.0)):
        text = make_program(tmp_path / "plan.json", "--set", f"coordinates={coordinates}")
        _, stops = visit(offset + text, target + shift, standard(3, 1), 0.95 * DWELL_S)
        position = [s.position for s in stops]
        expected = np.concatenate((target, target[::-1])) + shift
        np.testing.assert_allclose(position, expected, rtol=0, atol=EXACT_MM)


# ---- (2) measured, corrected, measured again ----------------------------------------------------

PITCH_MM = 20.0
AXIS = Physics(
    pitch_mm=PITCH_MM,
    bow_um=20.0,
    periodic_um=2.0,
    reversal_um=3.0,
    drift_um=10.0,
    drift_time_constant_s=20.0,
    expansion_um=6.0,
    expansion_time_constant_s=35.0,
)
RESOLVING, NOT_RESOLVING = 81, 9
SPAN = ("--start", "-78", "--length", "156", "--pitch", f"{PITCH_MM:g}")


def true_deviation_um(position: np.ndarray, time_s: float) -> np.ndarray:
    """Return the deviations of the virtual axis without any table, (m, 2), in closed form."""
    share = (position + 80.0) / 160.0
    screw = 20.0 * (1.0 - (2.0 * share - 1.0) ** 2) + 2.0 * np.sin(np.pi * (position + 80.0) / 10.0)
    common = 10.0 * -np.expm1(-time_s / 20.0)
    expansion = 6.0 * share * -np.expm1(-time_s / 35.0)
    return (screw + common + expansion)[:, np.newaxis] + np.array([-1.5, 1.5])


@dataclass(frozen=True, slots=True)
class Campaign:
    """A measured axis, and what is needed to measure it again."""

    folder: Path
    run: Path
    measured: dict[str, object]
    reference_s: float
    """Time since the first motion at which the drift-free levels hold. [s]"""
    other: dict[str, object]
    """Plan of other targets."""


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory, linuxcnc: None) -> Campaign:
    """Return the run of a cold axis that warms up."""
    folder = tmp_path_factory.mktemp("campaign")
    words = ("--targets", "41", "--random-share", "0.1", "--cycles", "3", "--seed", "1")
    plan = make_plan(folder / "plan.json", *SPAN, *words)
    other = make_plan(
        folder / "other.json", *SPAN, "--targets", "19", "--cycles", "2", "--seed", "7"
    )
    distance = np.abs(np.subtract.outer(other["targets_mm"], plan["targets_mm"]))
    assert np.min(distance) > 0.01  # other targets indeed
    run = folder / "run.csv"
    record(make_program(folder / "plan.json"), plan, run, 3, physics=AXIS, seed=1)
    measured = evaluate(run, "--plan", str(folder / "plan.json"))
    assert measured["plan_differences"] == []
    since_first_reading = measured["drift"]["reference_time_s"]
    first = float(run.read_text(encoding="ascii").splitlines()[1].split(",")[1])
    return Campaign(
        folder=folder,
        run=run,
        measured=measured,
        reference_s=first + since_first_reading,
        other=other,
    )


def test_the_drift_free_levels_are_those_of_the_virtual_axis(campaign: Campaign) -> None:
    """The truth in closed form; the measured levels miss it by micrometres."""
    drift, plain = campaign.measured["drift"], campaign.measured["iso230_2"]
    position = np.array([t["position"] for t in plain["targets"]])
    truth = true_deviation_um(position, campaign.reference_s)
    level = np.stack((drift["levels_forward"], drift["levels_backward"]), axis=1)
    mean = np.array([[t["mean_forward"], t["mean_backward"]] for t in plain["targets"]])
    assert np.max(np.abs(level - truth)) < 0.15
    assert np.max(np.abs(mean - truth)) > 1.0
    assert 8.0 < drift["total"] < 16.0
    assert plain["E"] > 20.0


@dataclass(frozen=True, slots=True)
class Repetition:
    """A run at other targets with a table in force."""

    run: Path
    result: dict[str, object]
    correction: np.ndarray
    """What the control added at the stops. [mm]"""

    @property
    def figures(self) -> dict[str, float]:
        """Figures of ISO 230-2, as measured. [µm]"""
        return self.result["iso230_2"]

    @property
    def levels(self) -> np.ndarray:
        """Mean deviations, (m, 2). [µm]"""
        targets = self.figures["targets"]
        return np.array([[t["mean_forward"], t["mean_backward"]] for t in targets])


@pytest.fixture(scope="module")
def uncorrected(campaign: Campaign) -> Repetition:
    """Return the run at the other targets without a table."""
    return repeat(campaign, "uncorrected", ())


@pytest.fixture(scope="module")
def drift_free(campaign: Campaign) -> Repetition:
    """Return the run with the drift-free table, type 1, whose points resolve the pitch."""
    table, _ = correct(campaign, "drift_free_1", 1, RESOLVING, "--drift-free")
    return repeat(campaign, "drift_free_1", (table,))


@pytest.fixture(scope="module")
def measured(campaign: Campaign) -> Repetition:
    """Return the run with the table of the levels as measured, drift and all."""
    table, _ = correct(campaign, "measured", 1, RESOLVING)
    return repeat(campaign, "measured", (table,))


@pytest.fixture(scope="module")
def coarse(campaign: Campaign) -> Repetition:
    """Return the run with a drift-free table whose points are as far apart as the pitch."""
    table, _ = correct(campaign, "coarse", 1, NOT_RESOLVING, "--drift-free")
    return repeat(campaign, "coarse", (table,))


@pytest.fixture(scope="module")
def merged(campaign: Campaign, measured: Repetition) -> Repetition:
    """Return the run with a table that mends the measured one, at a third set of targets.

    These lie within those of the run that the new table was made of: it reaches no further.
    """
    old = ("--merge", str(campaign.folder / "measured.comp"))
    table, stated = correct(campaign, "merged", 1, RESOLVING, *old, run=measured.run)
    assert stated["merge"] is not None
    inner = ("--start", "-72", "--length", "144", "--pitch", f"{PITCH_MM:g}")
    words = ("--targets", "19", "--cycles", "2", "--seed", "11")
    third = make_plan(campaign.folder / "third.json", *inner, *words)
    return repeat(campaign, "merged", (table,), plan=third, program="third.json")


def test_a_table_of_type_1_makes_the_error_ten_times_smaller_at_other_targets(
    uncorrected: Repetition, drift_free: Repetition
) -> None:
    assert uncorrected.figures["E"] > 20.0
    assert drift_free.figures["E"] <= uncorrected.figures["E"] / 10.0
    assert abs(drift_free.figures["B_mean"]) < 0.1  # the play of 3 µm is in the two columns


def test_a_table_of_type_0_does_the_same_while_the_machine_goes_on_warming_up(
    campaign: Campaign, uncorrected: Repetition, drift_free: Repetition
) -> None:
    """The table removes no drift: R shows it, and the figures without drift show what is left."""
    table, _ = correct(campaign, "drift_free_0", 0, RESOLVING, "--drift-free")
    again = repeat(campaign, "drift_free_0", (table,), warms_up=True)
    np.testing.assert_allclose(again.correction, drift_free.correction, rtol=0, atol=2e-6)
    drift = again.result["drift"]
    assert drift["significant"]
    assert drift["total"] > 1.0
    assert drift["iso230_2"]["E"] <= uncorrected.figures["E"] / 10.0
    assert drift["iso230_2"]["R"] < 0.3 * again.figures["R"]


def test_points_that_do_not_resolve_the_pitch_leave_no_more_than_the_stated_bound(
    campaign: Campaign, uncorrected: Repetition, coarse: Repetition
) -> None:
    stated = json.loads((campaign.folder / "coarse.correct.json").read_text("utf-8"))
    position = np.array([t["position"] for t in stated["targets"]])
    widest = float(np.max(np.diff(position)))
    between_targets = 2.0 * (2.0 * np.pi / PITCH_MM) ** 2 * widest**2 / 8.0
    left = coarse.figures["E"]
    assert 2.0 < left <= 2.0 * (stated["bound"]["interpolation"] + between_targets)
    assert left < uncorrected.figures["E"] / 3.0  # bow and play are gone, the wave stays
    assert_as_simulated(campaign, "coarse", uncorrected, coarse)


def test_what_the_control_leaves_is_what_check_table_foretells_at_every_target(
    campaign: Campaign, uncorrected: Repetition, drift_free: Repetition
) -> None:
    assert_as_simulated(campaign, "drift_free_1", uncorrected, drift_free)


def assert_as_simulated(
    campaign: Campaign, name: str, uncorrected: Repetition, again: Repetition
) -> None:
    """Assert that the command foretold the run with the table from the run without it.

    The correction moves the axis by up to 0.03 mm, where its error differs by up to 0.03 µm; the
    means of two readings have a noise of 0.014 µm.
    """
    path = campaign.folder / f"{name}.comp"
    shown = check_table(path, uncorrected.run, 1, campaign.folder)
    foretold = np.array([[t["after_forward"], t["after_backward"]] for t in shown["targets"]])
    np.testing.assert_allclose(again.levels, foretold, rtol=0, atol=0.12)


def test_the_drift_free_table_beats_the_measured_one(
    uncorrected: Repetition, drift_free: Repetition, measured: Repetition
) -> None:
    assert measured.figures["E"] < uncorrected.figures["E"]
    assert drift_free.figures["E"] < 0.5 * measured.figures["E"]


def test_merging_what_a_table_left_makes_the_error_smaller_still(
    measured: Repetition, merged: Repetition
) -> None:
    assert merged.figures["E"] < 0.5 * measured.figures["E"]


def test_the_how_to_states_what_is_measured(
    root: Path,
    uncorrected: Repetition,
    measured: Repetition,
    drift_free: Repetition,
    coarse: Repetition,
    merged: Repetition,
) -> None:
    page = (root / "docs" / "how-to" / "prove-a-table-on-linuxcnc.md").read_text("utf-8")
    rows = re.findall(
        r"^\| (?:no table|as measured|drift-free|merged).*\| ([\d.]+) \|$", page, re.MULTILINE
    )
    found = [r.figures["E"] for r in (uncorrected, measured, drift_free, coarse, merged)]
    assert [float(row) for row in rows] == pytest.approx(found, abs=0.2)


# ---- (3) what the control reads of a table ------------------------------------------------------

SHIPPED = Path("/usr/share/doc/linuxcnc/examples/sample-configs/sim/screwcompX.dat")
NUMBERS = [(-10.0 + 2.0 * i, 1e-3 * (i % 5 + 1), -2e-3 * (i % 3 + 1)) for i in range(11)]
LINES = [f"{p:g} {f:.4f} {r:.4f}" for p, f, r in NUMBERS]
WITH_A_TYPING_ERROR = [f"{p} {p - 0.001:.3f} {p + 0.002:.3f}" for p in range(-10, 12, 2)]
WITH_A_TYPING_ERROR[3] = "-4 -4.2 -3.998"
STRANGE = {
    "a blank line": Table("\n".join([*LINES[:5], "", *LINES[5:]]) + "\n", 1),
    "a comment": Table("\n".join([*LINES[:7], "# above zero", *LINES[7:]]) + "\n", 1),
    "words behind": Table("\n".join(f"{line} ; checked" for line in LINES), 1),
    "tabs, exponents, CRLF": Table(
        "".join(f"\t{p:+.3e}\t{p + f:.9e} {p + r:.9e}\r\n" for p, f, r in NUMBERS), 0
    ),
    "the longest line": Table("\n".join([*LINES[:5], LINES[5].ljust(253), *LINES[6:]]), 1),
    "a typing error": Table("\n".join(WITH_A_TYPING_ERROR) + "\n", 0),
}
STANDS_MM = (-9.3, -5.0, -3.1, -0.4, 1.7, 6.2, 9.9)
CUT = {"a blank line": 5, "a comment": 7}


def own_rule(table: Table) -> np.ndarray:
    """Return nominal and both trims by the control's rule, as it stands in its source, in mm."""
    number = r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
    rows = []
    for piece in re.findall(r"[^\n]{0,253}\n|[^\n]{1,254}", table.text):
        triplet = re.match(3 * number, piece)
        if triplet is None:
            break
        nominal, forward, reverse = (float(word) for word in triplet.groups())
        trims = (forward, reverse)
        if table.kind == 0:
            trims = (nominal - forward, nominal - reverse)
        rows.append((nominal, *trims))
    return np.array(rows)


def there_and_back() -> str:
    """Return a program that moves all axes together beyond the ends of the tables."""
    moves = ["G21 G90 G94 G61.1 F1200"]
    for turn in (-15.0, *STANDS_MM, 15.0, *reversed(STANDS_MM), -15.0):
        moves.append("G1 " + " ".join(f"{axis}{turn}" for axis in AXES))
        moves += [f"G4 P{DWELL_S}"] if turn in STANDS_MM else []
    return "\n".join([*moves, "M2"]) + "\n"


@dataclass(frozen=True, slots=True)
class Strange:
    """Strange tables, what the control made of them, and a run at the stops."""

    tables: dict[str, Table]
    trace: Trace
    stops: list[Stop]
    run: Path


@pytest.fixture(scope="module")
def strange(tmp_path_factory: pytest.TempPathFactory, root: Path, linuxcnc: None) -> Strange:
    """Return six tables, one to a joint, all moved together beyond the ends of the tables."""
    tables = dict(STRANGE)
    beside = root.parent / "shared" / "data" / "positioning" / "linuxcnc" / SHIPPED.name
    for place in (SHIPPED, beside):  # some installations leave the examples out
        if place.is_file():
            tables["a typing error"] = Table(place.read_text(encoding="ascii"), 0)
    places, visits = np.array(STANDS_MM), standard(len(STANDS_MM), 1)
    trace, stops = visit(
        there_and_back(), places, visits, 0.5 * DWELL_S, tables=tuple(tables.values())
    )
    assert trace.said == ()  # the control reports nothing, whatever it leaves out
    assert len(stops) == 2 * len(STANDS_MM)
    run = tmp_path_factory.mktemp("strange") / "run.csv"
    rows = [
        f"{cycle},{side},{place},0"
        for cycle in (1, 2)
        for side in ("forward", "backward")
        for place in STANDS_MM
    ]
    head = "cycle,direction,target_mm,deviation_um"
    run.write_text("\n".join([head, *rows]) + "\n", encoding="ascii")
    return Strange(tables, trace, stops, run)


@pytest.mark.parametrize("name", STRANGE)
def test_the_table_is_read_and_interpolated_as_the_control_does(
    name: str, strange: Strange, tmp_path: Path
) -> None:
    table, trace = strange.tables[name], strange.trace
    joint = list(strange.tables).index(name)
    rows = own_rule(table)
    assert_applied(trace, joint, rows)

    control = control_by_name("linuxcnc")
    options = check_options(control, [f"type={table.kind}"], purpose="table")
    read = control.read_table(table.text, name, AxisKind.LINEAR, options)
    moving, side = in_motion(trace)
    ours = 1e-3 * control.correction(read.table, trace.position[moving])
    tolerance = single_precision(rows)
    np.testing.assert_allclose(
        ours[np.arange(side.size), side], trace.corrections[moving, joint], rtol=0, atol=tolerance
    )

    path = tmp_path / "x.comp"
    path.write_bytes(table.text.encode("ascii"))
    shown = check_table(path, strange.run, table.kind, tmp_path)
    if name in CUT:
        assert rows.shape[0] == CUT[name]
        assert len(shown["table"]["positions"]) == CUT[name]
        assert any("stops reading" in text for text in shown["findings"])
    if name == "a typing error":
        assert any("-4.2" in text and "typing error" in text for text in shown["findings"])
    compare_at_rest(shown, strange, trace.corrections[:, joint], rows)


def in_motion(trace: Trace) -> tuple[np.ndarray, np.ndarray]:
    """Return the servo periods in motion, and the column that acts in each, 0 or 1."""
    moving = np.flatnonzero(trace.velocity)
    assert moving.size > 1000
    assert np.ptp(trace.position[moving]) > 29.0
    return moving, (trace.velocity[moving] < 0.0).astype(int)


def single_precision(rows: np.ndarray) -> float:
    """Return how precisely the control holds its trims, and the slopes between them, in mm."""
    return EXACT_MM + 2e-7 * float(np.max(np.abs(rows[:, 1:])))


def assert_applied(trace: Trace, joint: int, rows: np.ndarray) -> None:
    """Assert that the control adds what stands in these rows, linear, with the ends held."""
    moving, side = in_motion(trace)
    position = trace.position[moving]
    both = np.stack([np.interp(position, rows[:, 0], rows[:, a]) for a in (1, 2)], axis=1)
    expected = both[np.arange(side.size), side]
    applied = trace.corrections[moving, joint]
    np.testing.assert_allclose(applied, expected, rtol=0, atol=single_precision(rows))


def compare_at_rest(
    shown: dict[str, object], strange: Strange, applied: np.ndarray, rows: np.ndarray
) -> None:
    """Compare the command's corrections with those at the stops.

    At rest the control holds the correction of its last period in motion: it belongs to a position
    a little before the target.
    """
    said = {round(t["position"], 3): t for t in shown["targets"]}
    steepest = np.max(np.abs(np.diff(rows[:, 1:], axis=0)) / np.diff(rows[:, 0])[:, np.newaxis])
    for stop in strange.stops:
        target = said[round(stop.position, 3)]
        key = "correction_backward" if stop.approach == BACKWARD else "correction_forward"
        before = abs(strange.trace.position[stop.begin - 1] - stop.position)
        held = applied[stop.end - 1]
        assert abs(1e-3 * target[key] - held) <= 1e-6 + steepest * before


REFUSED = {
    "compensation values must increase": [*LINES[:5], "-7 0.001 0.001", *LINES[5:]],
    "too many compensation entries": [
        f"{-50 + 0.25 * i} 0.001 {-1e-5 * i:.5f}" for i in range(257)
    ],
}


def test_a_refused_point_is_left_out_by_the_control_and_its_table_refused_by_the_command(
    strange: Strange, tmp_path: Path
) -> None:
    """Beside them a line of 254 characters, which ends its table without a word."""
    tables = [Table("\n".join(lines) + "\n", 1) for lines in REFUSED.values()]
    ended = Table("\n".join([*LINES[:5], LINES[5].ljust(254), *LINES[6:]]) + "\n", 1)
    every = (*tables, ended)
    trace = run_program(there_and_back(), tables=every, limit_s=60.0, heeds_messages=False)
    for joint, (message, table) in enumerate(zip(REFUSED, tables, strict=True)):
        assert f"joint {joint}: {message}" in trace.said
        path = tmp_path / f"{joint}.comp"
        path.write_text(table.text, encoding="ascii")
        words = ["check-table", str(path), str(strange.run), "--control", "linuxcnc"]
        assert main([*words, "--set", "type=1"]) == 2
    assert_applied(trace, 0, np.delete(own_rule(tables[0]), 5, axis=0))
    assert_applied(trace, 1, own_rule(tables[1])[:256])
    assert not any("joint 2" in text for text in trace.said)
    rows = own_rule(ended)
    assert rows.shape[0] == 6
    assert_applied(trace, 2, rows)


# ---- the commands -------------------------------------------------------------------------------


def make_plan(path: Path, *words: str) -> dict[str, object]:
    """Plan with the command and return what is in the file."""
    common = ("--feed", "30000", "--overrun", "2", "--dwell", f"{DWELL_S}", "--axis", "X")
    assert main(["plan", *common, *words, "-o", str(path)]) == 0
    return json.loads(path.read_text(encoding="utf-8"))


def make_program(plan: Path, *words: str) -> str:
    """Return the NC program of a plan, written by the command."""
    path = plan.with_suffix(".ngc")
    assert main(["program", str(plan), "--control", "linuxcnc", "-o", str(path), *words]) == 0
    return path.read_text(encoding="ascii")


def visit(
    text: str, targets: np.ndarray, visits: list[Visit], shortest_s: float, **how: object
) -> tuple[Trace, list[Stop]]:
    """Run a program; return what the axis did, and its stops.

    A kernel without real time may make a pause of its own, or take one away: then again.
    """
    for _ in range(ATTEMPTS):
        trace = run_program(text, limit_s=120.0, **how)
        stops = find_stops(trace, targets, shortest_s)
        found = [(int(np.argmin(np.abs(targets - s.position))), s.approach) for s in stops]
        if found == visits:
            break
    return trace, stops


def record(
    text: str, plan: dict[str, object], run: Path, cycles: int, *, seed: int, **how: object
) -> tuple[Trace, list[Stop]]:
    """Run a program, read the laser at its stops, and write the run.

    That dwells have their length is for other tests.
    """
    targets = np.array(plan["targets_mm"])
    visits = standard(targets.size, cycles)
    trace, stops = visit(text, targets, visits, 0.1 * DWELL_S, **how)
    assert len(stops) == len(visits)
    write_run(trace, stops, DWELL_S, run, noise_um=NOISE_UM, seed=seed)
    return trace, stops


def evaluate(run: Path, *words: str) -> dict[str, object]:
    """Evaluate a run with the command."""
    path = run.with_suffix(".json")
    assert main(["evaluate", str(run), "--json", str(path), *words]) == 0
    return json.loads(path.read_text(encoding="utf-8"))


def correct(
    campaign: Campaign, name: str, kind: int, points: int, *words: str, run: Path | None = None
) -> tuple[Table, dict[str, object]]:
    """Write a table with the command; return it and what the command states."""
    path, stated = campaign.folder / f"{name}.comp", campaign.folder / f"{name}.correct.json"
    common = ("--control", "linuxcnc", "--axis", "X", "--points", str(points))
    files = ("-o", str(path), "--json", str(stated), "--set", f"type={kind}")
    measured = str(campaign.run if run is None else run)
    assert main(["correct", measured, *common, *files, *words]) == 0
    return Table(path.read_text(encoding="ascii"), kind), json.loads(stated.read_text("utf-8"))


def check_table(path: Path, run: Path, kind: int, folder: Path) -> dict[str, object]:
    """Check a table with the command."""
    shown = folder / "check.json"
    words = ["check-table", str(path), str(run), "--control", "linuxcnc"]
    assert main([*words, "--set", f"type={kind}", "--json", str(shown)]) == 0
    return json.loads(shown.read_text(encoding="utf-8"))


def repeat(
    campaign: Campaign,
    name: str,
    tables: tuple[Table, ...],
    *,
    plan: dict[str, object] | None = None,
    program: str = "other.json",
    warms_up: bool = False,
) -> Repetition:
    """Measure other targets with a table in force.

    The machine begins in the thermal state for which the drift-free levels hold, common drift and
    expansion as far as they had come, and keeps it unless it goes on warming up.
    """
    physics = replace(AXIS, thermal_time_s=campaign.reference_s, warms_up=warms_up)
    text = make_program(campaign.folder / program)
    run = campaign.folder / f"again_{name}.csv"
    plan = campaign.other if plan is None else plan
    trace, stops = record(text, plan, run, 2, physics=physics, tables=tables, seed=2)
    correction = np.array([trace.ramped[stop.end - 1] for stop in stops])
    return Repetition(run, evaluate(run), correction)


def test_the_notebook_proves_its_table_on_linuxcnc(root: Path, tmp_path: Path) -> None:
    """Trims are held in single precision: 2e-9 mm."""
    said = subprocess.run(
        [sys.executable, str(root / "notebooks" / "table_on_linuxcnc.py")],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    found = re.search(r"LinuxCNC itself: (\d+) servo periods differ by (\S+) nm", said)
    assert found is not None
    assert int(found[1]) > 3000
    assert float(found[2]) < 0.01
