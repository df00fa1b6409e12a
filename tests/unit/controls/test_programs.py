"""NC programs of every control, driven by interpreters of our own."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.refusals import refused
from tests.unit.controls.builders import in_every_direction, plan_of, program_of
from tests.unit.controls.interpreters import DRIVES, Driven
from thermaxis.controls import control_by_name, control_names
from thermaxis.controls._program import feed_word, inward_positions
from thermaxis.files import plan_sha256
from thermaxis.positioning import FORWARD, Cycle, Move, MoveBlock, TestPlan, order_of_visits
from thermaxis.quantities import AxisKind

HOSTILE = (
    *("x) G0 Z-100", "*)", "(MSG, hello", "MSG, hello", 'MSG("hello")', "DEBUG,#1", "PRINT,#2"),
    *("%", "%_N_X_MPF", "$MA_X=1", "µ ü €", "µ ~ ", "; M30", "o100 endrepeat", "O1234 M99"),
    *("THX_LIMIT:", "ENDFOR", "(LOGOPEN,/etc/passwd)", "?x=1&y", "=1", '"A" % \\ {}'),
    *("L X+900 FMAX", "a" * 200, "é" * 200),
)
"""Titles of plans that would do something outside a comment."""


def check_driven(done: Driven, plan: TestPlan, warm_up: int = 0) -> None:
    visits = order_of_visits(plan)
    side = np.where(visits.approach == FORWARD, 1.0, -1.0).tolist()
    stops = zip(plan.target[visits.target].tolist(), side, strict=True)
    assert done.stops == list(stops)
    assert set(done.dwell_s) == {plan.dwell_s + plan.recording_s}
    assert min(done.places) >= plan.lowest - 5.1e-7  # turns of a plan have six decimals
    assert max(done.places) <= plan.highest + 5.1e-7
    ends = done.places[: 2 * warm_up]
    assert ends == pytest.approx([plan.lowest, plan.highest] * warm_up, abs=1e-2)
    assert done.feeds == {plan.feed}
    assert done.alarms == []


@pytest.mark.parametrize("cycle", list(Cycle))
@pytest.mark.parametrize("name", control_names())
def test_the_axis_visits_every_target_in_order_and_from_its_side(name: str, cycle: Cycle) -> None:
    forms = [("call=P",), ("call=L",)] if name == "fanuc" else [()]
    if name != "fanuc":
        forms.append(("coordinates=work",))
    for stated in forms:
        for plan in in_every_direction(plan_of(cycle=cycle)):
            for start, warm_up in ((1000.0, 2), (-1000.0, 0)):
                program = program_of(control_by_name(name), plan, *stated, warm_up=warm_up)
                done = DRIVES[name](program, start=start)
                check_driven(done, plan, warm_up)
                assert done.machine == {name != "fanuc" and not stated}
    if name == "fanuc":
        assert {"G21", "G90", "G94", "G61", "G54", "G40", "G49"} <= done.modes


@pytest.mark.parametrize("name", control_names())
@given(
    thousandths=st.lists(
        st.integers(-200_000, 200_000), min_size=2, max_size=12, unique_by=lambda t: t // 10
    ),
    cycle=st.sampled_from(list(Cycle)),
    cycles=st.integers(1, 4),
    overrun=st.floats(0.003, 50.0),
)
@settings(max_examples=25, deadline=None)
def test_any_plan_is_driven_as_planned_and_never_beyond_its_ends(
    name: str, thousandths: list[int], cycle: Cycle, cycles: int, overrun: float
) -> None:
    target = np.array(sorted(thousandths)) / 1000.0
    plan = plan_of(target=target, cycle=cycle, cycles=cycles, overrun=overrun)
    check_driven(DRIVES[name](program_of(control_by_name(name), plan)), plan)


@pytest.mark.parametrize("name", control_names())
def test_text_of_a_plan_stays_a_comment_without_any_power(name: str) -> None:
    control = control_by_name(name)
    known = DRIVES[name](program_of(control, plan_of()))
    for title in HOSTILE:
        program = program_of(control, plan_of(title=title))
        assert DRIVES[name](program) == known
        assert program.isascii()
        assert not set(program) & set({"linuxcnc": ",%", "sinumerik": '"'}.get(name, ",$&"))
        assert program.count("\n") == program.count(control.newline)
        assert max(map(len, program.splitlines())) < 255


@pytest.mark.parametrize("name", control_names())
def test_the_head_names_the_plan_and_says_what_was_not_checked(name: str) -> None:
    control, plan = control_by_name(name), plan_of(title="Spindle side, run 2")
    head = program_of(control, plan).upper()
    for words in (
        *(plan_sha256(plan), "title Spindle side run 2", "lowest -5.000 highest 104.000 mm"),
        *("feed 300 mm per min", "Prove with reduced feed"),
        "WARNING travel of the axis was not stated",
    ):
        assert words.upper() in head
    stated = program_of(control, plan, travel=(-10.0, 110.0)).upper()
    assert "TRAVEL -10.000 TO 110.000 MM WAS CHECKED" in stated
    assert ("WARNING" in stated) == (name == "fanuc")  # it knows work coordinates only
    if name != "fanuc":
        work = program_of(control, plan, "coordinates=work", travel=(-10.0, 110.0))
        assert "WARNING the check holds" in work


def test_a_rotary_axis_is_warned_of_the_shortest_way() -> None:
    words = {"fanuc": "ROLL OVER", "heidenhain-tnc640": "M126", "sinumerik": "modulo axis"}
    for name, word in words.items():
        plan = plan_of(kind=AxisKind.ROTARY, axis="C")
        text = program_of(control_by_name(name), plan)
        check_driven(DRIVES[name](text, "C"), plan)
        assert word in text


def test_a_motion_beyond_the_words_of_a_control_is_refused() -> None:
    for name in ("fanuc", "heidenhain-itnc530"):
        for changes, code in (
            ({"axis": "X1"}, "unknown_axis"),
            ({"axis": "Q"}, "unknown_axis"),
            ({"feed": 500_000.0}, "feed_too_large"),
            ({"dwell_s": 200_000.0}, "dwell_too_long"),
            ({"cycles": 20_000}, "too_many_repetitions"),
            ({"target": np.array([0.0, 100_000.0])}, "position_too_large"),
        ):
            with refused(code):
                program_of(control_by_name(name), plan_of(**changes))


@given(
    target=st.integers(-10_000_000, 10_000_000),
    overrun=st.floats(0.01, 50.0),
    decimals=st.integers(3, 6),
    side=st.sampled_from([-1.0, 1.0]),
)
@settings(max_examples=120, deadline=None)
def test_a_turn_is_rounded_towards_its_stop_by_less_than_one_digit(
    target: int, overrun: float, decimals: int, side: float
) -> None:
    stop = target / 1000.0
    turn = stop + side * overrun
    block = MoveBlock("b", 1, (Move(turn, None, None), Move(stop, 1, 0)))
    written, at = inward_positions(block, decimals)
    assert at == stop
    digit = 10.0**-decimals
    inwards = side * (turn - written)
    assert -1e-8 <= inwards < digit + 1e-8
    assert side * (written - stop) > 0
    assert abs(written / digit - round(written / digit)) < 1e-5


def test_turns_that_are_written_exactly_stay_where_they_are() -> None:
    """10.123 - 4.5 is 5.6229999999999993 in floating point."""
    for place in (10.123 - 4.5, 99_999.999 - 0.001, -50_000.1 - 3.0):
        block = MoveBlock("b", 1, (Move(place, None, None), Move(100_000.0, 1, 0)))
        assert inward_positions(block, 6)[0] == pytest.approx(place, abs=1e-10)


def test_a_feed_has_no_zeros_at_its_end() -> None:
    for feed, text in ((300.0, "300"), (1234.5678, "1234.5678"), (0.000001, "0.000001")):
        assert feed_word(plan_of(feed=feed)) == text


def test_a_feed_beyond_its_word_is_refused() -> None:
    assert feed_word(plan_of(feed=99.9996), decimals=3, largest=100.0) == "100"
    with refused("feed_too_large"):
        feed_word(plan_of(feed=100.001), decimals=3, largest=100.0)
    with refused("feed_too_small"):
        feed_word(plan_of(feed=0.0004), decimals=3)


@pytest.mark.parametrize("name", control_names())
def test_no_control_writes_a_feed_an_overrun_or_a_way_that_is_lost_or_too_large(name: str) -> None:
    control = control_by_name(name)
    coarse = name.startswith(("fanuc", "heidenhain"))
    if not coarse:
        assert "0.0005" in program_of(control, plan_of(feed=0.0005, overrun=2e-6))
    with refused("feed_too_small"):
        program_of(control, plan_of(feed=1e-4 if coarse else 1e-7))
    for cycle in Cycle:
        for overrun in (1e-5 if coarse else 1e-7, 1e-9):
            with refused("overrun_too_short"):
                program_of(control, plan_of(cycle=cycle, overrun=overrun))
    for travel in ((0.0, 200.0), (-10.0, 90.0)):
        with refused("program_beyond_travel", key="--travel"):
            program_of(control, plan_of(), travel=travel)
