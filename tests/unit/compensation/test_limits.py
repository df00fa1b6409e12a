"""Limits are never passed, and what is allowed is reached as fast as allowed."""

import math

import pytest
from hypothesis import given, settings, strategies as st

from thermaxis.compensation import Limits, limit_step
from thermaxis.errors import ConfigurationError

LIMITS = Limits(50.0, 0.5)
ANY = st.floats(allow_nan=True, allow_infinity=True)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.lists(st.tuples(ANY, ANY), max_size=50))
def test_magnitude_and_rate_are_never_passed(asked: list[tuple[float, float]]) -> None:
    before = 0.0
    for wanted, elapsed in asked:
        after = limit_step(LIMITS, before, wanted, elapsed)
        seconds = elapsed if math.isfinite(elapsed) and elapsed > 0 else 0.0
        assert abs(after) <= 50.0
        assert abs(after - before) <= 0.5 * seconds * (1 + 1e-12) + 1e-9
        before = after


def test_a_goal_is_reached_as_fast_as_the_rate_allows() -> None:
    for goal, seconds in ((20.0, 40.0), (-20.0, 40.0), (70.0, 100.0), (-70.0, 100.0)):
        value, steps = 0.0, 0
        reached = max(min(goal, 50.0), -50.0)
        while value != reached:
            value = limit_step(LIMITS, value, goal, 1.0)
            steps += 1
            assert steps <= seconds, goal
        assert steps == seconds, goal
    assert limit_step(LIMITS, 3.0, 3.25, 0.5) == 3.25


def test_no_number_keeps_the_correction_in_force_and_one_in_force_counts_as_zero() -> None:
    assert limit_step(LIMITS, 7.0, math.nan, 10.0) == 7.0
    assert limit_step(LIMITS, 7.0, 9.0, math.nan) == 7.0
    assert limit_step(LIMITS, 7.0, 9.0, -1.0) == 7.0
    assert limit_step(LIMITS, 3.0, -9.0, math.inf) == 3.0
    assert limit_step(LIMITS, math.nan, 9.0, 2.0) == 1.0
    assert limit_step(LIMITS, math.inf, -9.0, 2.0) == -1.0


def test_a_correction_outside_a_narrowed_limit_comes_back_at_the_rate():
    assert limit_step(LIMITS, 80.0, 80.0, 0.0) == 80.0
    assert limit_step(LIMITS, 80.0, 80.0, 2.0) == 79.0
    assert limit_step(LIMITS, -80.0, 0.0, 100.0) == -30.0
    assert limit_step(LIMITS, 80.0, 90.0, 100.0) == 50.0


def test_what_follows_from_the_magnitude() -> None:
    limits = Limits(50.0, 0.5)
    assert (limits.total_um, limits.soft_um, limits.deadband_um) == (50.0, 40.0, 0.0)
    assert limits.largest_trim_um == 5.0
    assert Limits(50.0, 0.5, 60.0, 1.0, 45.0, 7.0) == Limits(
        50.0, 0.5, total_um=60.0, deadband_um=1.0, soft_um=45.0, largest_trim_um=7.0
    )
    small = Limits(3.0, 0.5)
    assert (small.total_um, small.largest_trim_um) == (3.0, 3.0)
    assert Limits(3.0, 0.5, 8.0).largest_trim_um == 5.0


def test_the_ends_of_the_limits_are_taken() -> None:
    widest = Limits(1e4, 1e3, 1e4, 1e4, 1e4, 1e4)
    assert widest.largest_rate_um_per_s == 1e3
    assert Limits(50.0, 0.5, 50.0, 0.0, 50.0, 0.0).largest_trim_um == 0.0


def test_a_limit_that_limits_nothing_or_does_not_fit_the_others_is_named() -> None:
    for name, wrong in (
        *(("largest_um", wrong) for wrong in (0.0, -1.0, math.nan, 1.0001e4)),
        *(("largest_rate_um_per_s", wrong) for wrong in (0.0, math.inf, 1.0001e3)),
        ("total_um", 49.0),
        ("total_um", 1.0001e4),
        ("total_um", -50.0),
        ("total_um", math.nan),
        ("deadband_um", -0.1),
        ("deadband_um", 50.1),
        ("soft_um", -1.0),
        ("soft_um", 50.1),
        ("largest_trim_um", -1.0),
        ("largest_trim_um", 50.1),
        ("largest_trim_um", math.nan),
    ):
        with pytest.raises(ConfigurationError) as error:
            Limits(**({"largest_um": 50.0, "largest_rate_um_per_s": 0.5} | {name: wrong}))
        assert error.value.place.key == name
