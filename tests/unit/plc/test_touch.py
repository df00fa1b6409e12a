"""The block with touches of the machine's probe: what `cycle` says of them, in every text."""

import math
from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from tests.proofs import quick_first
from tests.unit.plc.compiled import compiled
from tests.unit.plc.equal_parts import Task, compared_together
from tests.unit.plc.plc_scenarios import corrections_of, quiet_inputs
from tests.unit.plc.test_block import Stated, one_section, side_by_side
from tests.unit.plc.test_vectors import replayed, rows_of
from thermaxis.compensation import CycleOutput, Limits, TouchOutcome, TouchRules
from thermaxis.plc import (
    TOUCH,
    Block,
    CycleBlock,
    GuideFacts,
    PlcSettings,
    Target,
    guide_text,
    vectors_of,
)

NOTED = 64
"""Calls of which a block knows what a touch should show."""
RULES = TouchRules(limits=Limits(8.0, 0.25), acts=True, drift_um_per_root_h=30.0, confirm_s=60.0)
QUIET: list[dict[str, Any]] = [{}]


def touched_settings(rules: TouchRules = RULES, cycle_s: float = 1.0) -> PlcSettings:
    """Return a model with one lag, whose output is touched."""
    plain = one_section(double=True, cycle_s=cycle_s)
    changed = replace(plain.compensation, touches={"Z_um": rules})
    return replace(plain, compensation=changed)


def touch(more_um: float, calls: float = 1.0, **more: Any) -> dict[str, Any]:
    """Return a touch so many calls old that shows so much more than model and correction."""
    return {"more_um": more_um, "calls": calls, "sign": 1.0, **more}


def stated(settings: PlcSettings, plan: Iterable[dict[str, Any]]) -> Stated:
    """Return rows of inputs: a touch shows what stood at its time, whatever that was."""
    block, sent, shown_um = CycleBlock(settings), (0.0,), [0.0]
    stands: dict[str, Any] = {"count_z_um": 0}
    rows: list[dict[str, Any]] = []
    for call, step in enumerate(plan):
        row = dict(step)
        if "more_um" in row:
            calls = row["calls"]
            then_um = shown_um[-max(math.ceil(calls), 1)] if calls < len(shown_um) else 0.0
            stands = {
                "touch_z_um": row.pop("sign") * then_um + row.pop("more_um"),
                "age_z_um": row.pop("calls") * settings.cycle_s,
                "count_z_um": stands["count_z_um"] + 1,
            }
        rows.append(stands | row)
        told = quiet_inputs(settings, [20.0], sent) | {"enable": call > 0} | rows[-1]
        said = block.step(told)
        sent = corrections_of(settings, said)
        shown_um.append(said["correction_z_um"] + said["weight_z_um"] * said["model_z_um"])
    return settings, rows, [20.0]


def ordinary() -> Stated:
    """Touches that are right, wild, confirmed, late, odd, and none by a counter that stands."""
    warm = ({"t_spindle": 20.0 + 0.2 * math.sin(0.1 * k)} for k in range(60))
    plan = [*QUIET * 70, touch(3.0), *QUIET * 3, touch(3.2, 2.0), *QUIET * 3, *warm]
    plan += [touch(0.5, k) for k in (0.0, 0.5, 1.0, 1.5, 2.5, NOTED - 1.0, NOTED, NOTED + 0.5)]
    plan += [*QUIET * 70, touch(-1.0, NOTED), touch(-1.5, NOTED + 0.25), *QUIET * 600]
    plan += [touch(-11.0), *QUIET * 59, touch(-11.5), *QUIET * 40]
    plan += [touch(11.0), *QUIET * 60, touch(11.5), *QUIET * 5, touch(11.9), *QUIET * 4]
    plan += [touch(30.0), touch(-30.0), touch(90.0), touch(-90.0), *QUIET * 5, touch(0.0)]
    for far in (11.5, -11.5, 12.5, -12.5):  # half as much again as the limit is 12
        plan += [touch(far), touch(far), *QUIET * 40, touch(0.0), touch(0.0), *QUIET * 40]
        plan += [{"reset": True}, *QUIET * 40]
    wild = [touch(40.0 * (-1) ** k) for k in range(9)]
    plan += [*wild, touch(1.0), *wild[:3], *QUIET * 9, touch(1.0), {"reset": True}, *QUIET * 40]
    plan += [touch(0.0, age) for age in (-0.5, math.nan, math.inf, 1e29, 1e31)]
    plan += [touch(9e3), touch(1.1e4), touch(-1.1e4), touch(math.nan), touch(math.inf)]
    return stated(touched_settings(), [*plan, *QUIET * 40])


def begun_anew() -> Stated:
    """A start, a gap, a late call, a lost connection: what was in force is not known, or nothing.

    A counter that stands in the first call, or is another one after a start, is no touch.
    """
    settled = [*QUIET * 5, touch(4.0), *QUIET * 20, touch(70.0), touch(-70.0), *QUIET * 3]
    plan: list[dict[str, Any]] = [{"count_z_um": 7}, *settled]
    plan += [{"init": True, "count_z_um": 40, "enable": False}, *QUIET, *settled]
    plan += [touch(1.0, cycle_time_s=2000.0), touch(1.0), *QUIET * 40, touch(1.0, 30.0)]
    for lost in (
        {"cycle_time_s": 3.0}, {"cycle_time_s": 100.0}, {"datum": True}, {"touches_act": False},
        {"connected": False}, {"other_compensation": True}, {"read_z_um": 900.0},
        {"read_z_um": -900.0}, {"read_ok": False}, {"ok_spindle": False},
    ):  # fmt: skip
        plan += [*settled, touch(2.0, **lost), lost, touch(2.0), *QUIET * 3, touch(2.0, 5.0)]
        plan += [{"reset": True, "enable": False}, *QUIET * 8, touch(2.0), *QUIET * 2]
    plan += [{"enable": False}, *QUIET * 30, {"enable": False, "read_z_um": 2.0}]
    return stated(touched_settings(), [*plan, touch(2.0, 2.0, enable=False), *QUIET * 5])


def without_effect(beyond_um: float = 0.0, **changes: Any) -> Stated:
    """A probe that shows the correction with the other sign, until that is acknowledged.

    And a little more than twice what the correction has changed by.
    """
    settings = touched_settings(replace(RULES, start_um=4.0, **changes))
    plan = [*QUIET * 70, touch(2.0)]
    for turn in range(20):
        trim = {"trim_z_um": 4.0 * (-1) ** turn}
        plan += [touch(2.0 + beyond_um * (-1) ** turn, sign=-1.0, **trim), *[trim] * 24]
        if turn == 7:  # what is right between says the contrary, no more than one touch may say
            back = {"trim_z_um": 4.0}
            plan += [touch(-6.0, **trim), back, touch(-6.0, **back), *[trim] * 20]
    plan += [touch(1.0), {"reset": True}, *QUIET * 3, touch(1.0), *QUIET * 40]
    for turn in range(6):  # and one that sees no correction
        trim = {"trim_z_um": 5.0 * (-1) ** turn}
        plan += [touch(1.0, sign=0.0, **trim), *[trim] * 24, touch(1.0, **trim)]
    return stated(settings, [*plan, {"reset": True}, *QUIET * 40])


def without_effect_far_apart() -> Stated:
    """The same, twenty minutes apart, in which a machine may drift: it takes more touches."""
    settings = touched_settings(replace(RULES, ramp_um_per_h=20.0, start_um=4.0), 30.0)
    plan = [*QUIET * 70, touch(2.0)]
    for turn in range(24):
        trim = {"trim_z_um": 4.0 * (-1) ** turn}
        plan += [touch(2.0, sign=-1.0, **trim), *[trim] * 40]
    return stated(settings, plan)


def drifting() -> Stated:
    """Touches far apart, of a machine that moves on: up to the limit of the offset, and back."""
    settings = touched_settings(replace(RULES, discrepancy_um=0.5, ramp_um_per_h=100.0), 30.0)
    plan = [*QUIET * 5]
    for more_um in (0.0, 2.0, 3.0, 4.0, 6.0, 5.0, 4.0, -2.0, -8.0, -6.0, -5.0, 1.0, 2.0):
        plan += [touch(more_um, 0.5), *QUIET * 25, touch(more_um, 7.0), *QUIET * 70]
    return stated(settings, plan)


def every_touched() -> list[Stated]:
    """Return the rows that are stated call by call, for the mutants of this library."""
    never = without_effect(2.0, ramp_um_per_h=0.0, gate=2.0, acts=False)
    far = without_effect_far_apart()
    return [ordinary(), begun_anew(), without_effect(), never, far, drifting()]


@pytest.mark.parametrize(
    ("of", "words"),
    quick_first(
        2,
        [
            (ordinary, "believed confirmed excluded untimely unusable too_far too_many_excluded"),
            (begun_anew, "believed excluded untimely"),
            (without_effect, "believed excluded no_effect"),
            (without_effect_far_apart, "believed excluded no_effect"),
            (drifting, "believed"),
        ],
    ),
)
def test_every_touch_becomes_what_it_becomes_in_the_cycle(of: Any, words: str) -> None:
    said = side_by_side(*of())
    outcomes = {outcome for output in said for outcome in output.touch_outcomes}
    assert outcomes == {*map(TouchOutcome, words.split())}


@pytest.mark.proof
@pytest.mark.parametrize("double", [True, False], ids=["LREAL", "REAL"])
def test_random_models_with_touches_say_what_the_cycle_says(double: bool, tmp_path: Path) -> None:
    seeds = range(500, 506 if double else 502)
    tasks = [Task(seed, 10.0, double, 2.0, touched=True) for seed in seeds]
    for found in compared_together(tasks, tmp_path):
        assert set(found.differences.values()) <= {""}, (found.task, found.differences)


def test_a_touch_is_not_believed_while_the_model_makes_up_for_a_late_call() -> None:
    hot = {"t_spindle": 21.5}
    plan = [*QUIET * 70, hot | {"cycle_time_s": 200.0}, *[hot] * 5, touch(0.0) | hot, *[hot] * 40]
    settings, rows, values = stated(touched_settings(), [*plan, touch(0.0) | hot, hot])
    said = side_by_side(settings, rows, values)
    outcomes = [outcome for output in said for outcome in output.touch_outcomes]
    assert outcomes == [TouchOutcome.UNTIMELY, TouchOutcome.BELIEVED]


def offsets_um(said: Iterable[CycleOutput]) -> list[float]:
    return [output.offset_um[0] for output in said]


def test_a_wild_touch_moves_nothing_and_a_right_one_moves_at_the_rate_up_to_the_limit() -> None:
    plan = [
        *QUIET * 10,
        touch(50.0),
        *QUIET * 30,
        touch(4.0),
        *QUIET * 40,
        touch(11.5),
        touch(11.5),
    ]
    settings, rows, values = stated(touched_settings(), [*plan, *QUIET * 60])
    moved_um = offsets_um(side_by_side(settings, rows, values))
    assert moved_um[:41] == [0.0] * 41
    steps_um = [b - a for a, b in pairwise(moved_um)]
    assert max(map(abs, steps_um)) == pytest.approx(0.25)
    assert moved_um[80] == pytest.approx(-4.0 * 25.0 / 26.0)
    assert moved_um[-1] == -8.0


@pytest.mark.parametrize("allowed", [True, False])
def test_what_only_shows_is_added_to_nothing(allowed: bool) -> None:
    rules = RULES if allowed else replace(RULES, acts=False)
    plan = [{**row, "touches_act": not allowed} for row in (*QUIET * 10, touch(4.0), *QUIET * 5)]
    settings, rows, values = stated(touched_settings(rules), plan)
    block, sent = compiled(settings), (0.0,)
    for call, row in enumerate(rows):
        block.tell(quiet_inputs(settings, values, sent) | {"enable": call > 0} | row)
    assert (block.offset_z_um, block.correction_z_um) == (0.0, 0.0)
    assert block.believed_z_um == pytest.approx(4.0 * 25.0 / 26.0)
    assert 1.0 < block.std_z_um < 2.0


@pytest.mark.proof
def test_the_vectors_reach_every_outcome_and_the_block_says_them() -> None:
    settings = touched_settings(cycle_s=10.0)
    vectors = vectors_of(settings, most_calls=20_000)
    assert not [one for one in vectors.missing if one.startswith("touched_")]
    block = compiled(settings)
    for row in rows_of(vectors.text):
        said = replayed(settings, row, block)
        assert {name: float(row[name]) for name in said} == said, row


def test_nothing_is_written_of_touches_for_a_model_without_and_for_the_model_alone() -> None:
    touched, plain = touched_settings(), one_section(double=True)
    assert f"{TOUCH}.st" in Block(settings=touched).st()
    assert {f"{TOUCH}.h", f"{TOUCH}.c"} <= Block(settings=touched).c().keys()
    for block in (Block(settings=plain), Block(settings=touched, model_only=True)):
        for name, text in (block.st() | block.c()).items():
            assert "touch" not in name + text


def test_the_guide_says_how_touches_are_wired_and_proven() -> None:
    settings = touched_settings()
    facts = GuideFacts(Target("c", ""), ("thermaxis_touch.c", "tx_z_axis.c"), "vectors.csv")
    text = guide_text(settings, Block(settings=settings), facts)
    assert "3 excluded" in text
    assert "link with `-lm`" in text
    assert "`touches_act`: FALSE until the sign is proven" in text
