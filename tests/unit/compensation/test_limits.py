"""Limits are never passed, and what is allowed is reached as fast as allowed."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from thermaxis.compensation import Limits, limit_step
from thermaxis.errors import ConfigurationError

LIMITS = Limits(50.0, 0.5)
ANY = st.floats(allow_nan=True, allow_infinity=True)


@settings(max_examples=500, deadline=None, derandomize=True)
@given(st.lists(st.tuples(ANY, ANY), max_size=50))
def test_magnitude_and_rate_are_never_passed(asked: list[tuple[float, float]]) -> None:
    before = 0.0
    for wanted, elapsed in asked:
        after = limit_step(LIMITS, before, wanted, elapsed)
        seconds = elapsed if math.isfinite(elapsed) and elapsed > 0 else 0.0
        assert abs(after) <= 50.0
        assert abs(after - before) <= 0.5 * seconds * (1 + 1e-12) + 1e-9
        before = after


@pytest.mark.parametrize(("goal", "seconds"), [(20.0, 40.0), (-20.0, 40.0), (70.0, 100.0)])
def test_a_goal_is_reached_as_fast_as_the_rate_allows(goal: float, seconds: float) -> None:
    value, steps = 0.0, 0
    reached = max(min(goal, 50.0), -50.0)
    while value != reached:
        value = limit_step(LIMITS, value, goal, 1.0)
        steps += 1
        assert steps <= seconds
    assert steps == seconds


def test_what_is_within_both_limits_passes_unchanged() -> None:
    assert limit_step(LIMITS, 3.0, 3.25, 0.5) == 3.25


def test_no_number_keeps_the_correction_in_force() -> None:
    assert limit_step(LIMITS, 7.0, math.nan, 10.0) == 7.0
    assert limit_step(LIMITS, 7.0, 9.0, math.nan) == 7.0
    assert limit_step(LIMITS, 7.0, 9.0, -1.0) == 7.0


def test_a_correction_outside_a_narrowed_limit_comes_back_at_the_rate():
    assert limit_step(LIMITS, 80.0, 80.0, 0.0) == 80.0
    assert limit_step(LIMITS, 80.0, 80.0, 2.0) == 79.0
    assert limit_step(LIMITS, -80.0, 0.0, 100.0) == -30.0
    assert limit_step(LIMITS, 80.0, 90.0, 100.0) == 50.0


@pytest.mark.parametrize(
    "wrong", [(0.0, 1.0), (1.0, 0.0), (-1.0, 1.0), (math.nan, 1.0), (1e9, 1.0), (1.0, math.inf)]
)
def test_limits_that_limit_nothing_are_refused(wrong: tuple[float, float]) -> None:
    with pytest.raises(ConfigurationError):
        Limits(*wrong)
