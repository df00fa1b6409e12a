import pytest
from hypothesis import given, settings, strategies as st

from tests.refusals import refused
from tests.unit.controls.builders import plan_of, program_of
from thermaxis.codes import Place
from thermaxis.controls import control_by_name, control_names
from thermaxis.controls._program import feed_word, inward_positions
from thermaxis.positioning import Cycle, Move, MoveBlock


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
    with refused("feed_too_small"):
        program_of(control, plan_of(feed=1e-7))
    for cycle in Cycle:
        for overrun in (1e-7, 1e-9):
            with refused("overrun_too_short"):
                program_of(control, plan_of(cycle=cycle, overrun=overrun))
    for travel in ((0.0, 200.0), (-10.0, 90.0)):
        with refused("beyond_travel", Place(key="travel")):
            program_of(control, plan_of(), travel=travel)
