"""When a value of a sensor is believed: every rule at its edge, and what is remembered."""

import math
from dataclasses import replace
from typing import Any

import pytest

from thermaxis.compensation import (
    WITNESS_S,
    Sample,
    SampleQuality,
    SensorRules,
    SensorState,
    validate_sample,
)
from thermaxis.errors import ConfigurationError

RULES = SensorRules(
    lowest_c=1.0, highest_c=60.0, largest_rate_k_per_s=0.5, longest_age_s=10.0, frozen_s=100.0
)
BEFORE = SensorState(20.0, 90.0)
GOOD = SampleQuality.GOOD


def told(sample: Sample, state: SensorState = BEFORE, rules: SensorRules = RULES) -> SampleQuality:
    return validate_sample(rules, state, sample, 100.0, 2.0)[0]


def test_what_is_wrong_with_a_value() -> None:
    for sample, quality in (
        (Sample(20.5), GOOD),
        (Sample(None), SampleQuality.MISSING),
        (Sample(math.nan), SampleQuality.MISSING),
        (Sample(math.inf), SampleQuality.MISSING),
        (Sample(-math.inf), SampleQuality.MISSING),
        (Sample("20"), SampleQuality.MISSING),
        (Sample(True), SampleQuality.MISSING),
        (Sample(None, good=False), SampleQuality.MISSING),
        (Sample(math.nan, good=False), SampleQuality.MISSING),
        (Sample(20.0, good=False), SampleQuality.STATUS_BAD),
        (Sample(20.0, good=1), SampleQuality.STATUS_BAD),
        (Sample(20.0, good=None), SampleQuality.STATUS_BAD),
        (Sample(20.0, age_s=None), SampleQuality.NO_TIME_STAMP),
        (Sample(20.0, age_s=10.0), GOOD),
        (Sample(20.0, age_s=10.001), SampleQuality.OLD),
        (Sample(20.0, age_s=-10.0), GOOD),
        (Sample(20.0, age_s=-10.001), SampleQuality.OLD),
        (Sample(20.0, age_s=math.nan), SampleQuality.OLD),
        (Sample(20.0, age_s=math.inf), SampleQuality.OLD),
        (Sample(20.0, age_s="0"), SampleQuality.OLD),
        (Sample(0.0), SampleQuality.OUT_OF_RANGE),
        (Sample(60.001), SampleQuality.OUT_OF_RANGE),
        (Sample(0.0, good=False), SampleQuality.STATUS_BAD),
        (Sample(22.0), GOOD),
        (Sample(18.0), GOOD),
        (Sample(22.001), SampleQuality.TOO_FAST),
        (Sample(17.999), SampleQuality.TOO_FAST),
    ):
        assert told(sample) is quality, sample
    assert told(Sample(1.0), SensorState()) is GOOD
    assert told(Sample(60.0), SensorState()) is GOOD


def test_a_value_without_a_time_stamp_is_taken_where_the_rules_say_so() -> None:
    rules = replace(RULES, time_stamp_required=False)
    assert validate_sample(rules, BEFORE, Sample(20.5, age_s=None), 100.0, 2.0) == (
        GOOD,
        SensorState(20.5, 100.0),
    )
    assert told(Sample(None, age_s=None), rules=rules) is SampleQuality.MISSING
    assert told(Sample(0.0, age_s=None), rules=rules) is SampleQuality.OUT_OF_RANGE


def test_the_first_value_is_believed_wherever_it_is_in_the_range() -> None:
    assert validate_sample(RULES, SensorState(), Sample(55.0), 7.0, 0.0) == (
        GOOD,
        SensorState(55.0, 7.0),
    )


def test_a_value_that_moves_is_remembered_with_its_time() -> None:
    assert validate_sample(RULES, BEFORE, Sample(20.25), 100.0, 2.0)[1] == SensorState(20.25, 100.0)
    assert validate_sample(RULES, BEFORE, Sample(20.0), 100.0, 2.0)[1] == BEFORE


def test_a_value_that_does_not_change_at_all_is_frozen_after_its_time() -> None:
    assert validate_sample(RULES, BEFORE, Sample(20.0), 190.0, 2.0) == (GOOD, BEFORE)
    assert validate_sample(RULES, BEFORE, Sample(20.0), 190.5, 2.0) == (
        SampleQuality.FROZEN,
        BEFORE._replace(refused=True),
    )
    assert validate_sample(RULES, BEFORE, Sample(20.1), 190.5, 2.0)[0] is GOOD
    quick = replace(RULES, frozen_s=0.5)
    assert validate_sample(quick, BEFORE, Sample(20.0), 90.5, 2.0)[0] is GOOD
    assert validate_sample(quick, BEFORE, Sample(20.0), 90.75, 2.0)[0] is SampleQuality.FROZEN
    still = replace(RULES, frozen_s=0.0)
    assert validate_sample(still, BEFORE, Sample(20.0), 1e9, 2.0) == (GOOD, BEFORE)


def test_a_witness_that_hardly_moves_lets_a_value_stand_and_one_that_went_away_never_again() -> (
    None
):
    rules = replace(RULES, moves_with="bed", rests_k=0.5)

    def stands(state: SensorState, witness: SensorState, time_s: float = 690.0) -> tuple[bool, Any]:
        told = validate_sample(rules, state, Sample(20.0), time_s, 1e15, witness)
        return told[0] is GOOD, told[1]

    _, state = validate_sample(rules, BEFORE, Sample(20.0), 95.0, 2.0, SensorState(18.0, 95.0))
    assert state[-2:] == (18.0, 18.0), "not known before: from now on"
    assert stands(state, SensorState(18.499, 1e6))[0]
    assert stands(state, SensorState(17.501, 1e6))[0]
    _, slow = validate_sample(rules, state, Sample(20.0), 1e6, WITNESS_S, SensorState(18.9, 1e6))
    assert slow[-2:] == (pytest.approx(18.45), 18.0), "half way in an hour"
    assert not stands(state, SensorState(18.0, 1e6, refused=True))[0]
    assert not stands(state, SensorState())[0]
    assert not stands(state, SensorState(18.0, 1e6), 690.1)[0], "stuck, whatever it says"
    short, away = stands(state, SensorState(18.501, 180.0), 180.0)
    assert short, "not before its time"
    for value_c in (18.501, 18.0):
        believed, away = stands(away, SensorState(value_c, 1e6))
        assert not believed, "it has been away, wherever it is now"
    moved = validate_sample(rules, away, Sample(20.1), 1e6, 1e15, SensorState(18.0, 1e6))
    assert moved == (GOOD, SensorState(20.1, 1e6, witness_c=18.0, witnessed_c=18.0))


def test_while_nothing_is_read_a_value_may_move_on_at_its_rate() -> None:
    for sample in (
        *(Sample(None), Sample(math.nan), Sample(0.0), Sample(20.0, good=False)),
        *(Sample(20.0, age_s=99.0), Sample(20.0, age_s=None)),
    ):
        state = BEFORE
        for k in range(3):
            _, state = validate_sample(RULES, state, sample, 100.0 + 2.0 * k, 2.0)
        assert state == SensorState(20.0, 90.0, 3.0, refused=True), sample
        moved, jumped, same = (
            validate_sample(RULES, state, Sample(value), 108.0, 2.0)
            for value in (25.0, 25.001, 20.0)
        )
        assert moved == (GOOD, SensorState(25.0, 108.0)), sample
        assert jumped[0] is SampleQuality.TOO_FAST, sample
        assert same == (GOOD, BEFORE), sample
        assert validate_sample(RULES, BEFORE, sample, 1e9, 1e8)[1].allowance_k == 1e6


def test_a_swapped_sensor_stays_refused_however_long_one_waits() -> None:
    state = BEFORE
    for k in range(1000):
        quality, state = validate_sample(RULES, state, Sample(24.5), 100.0 + 2.0 * k, 2.0)
        assert quality is SampleQuality.TOO_FAST
    assert state == SensorState(20.0, 90.0, 2.0, refused=True)


def test_a_jump_is_forgiven_by_twice_its_own_step() -> None:
    fine, state = replace(RULES, step_k=0.5), BEFORE
    for k in range(10):
        state = validate_sample(fine, state, Sample(30.0), 100.0 + 2.0 * k, 2.0)[1]
    assert state == SensorState(20.0, 90.0, 1.0, refused=True)
    assert validate_sample(fine, state, Sample(22.5), 130.0, 2.0)[0] is GOOD
    assert validate_sample(fine, state, Sample(22.501), 130.0, 2.0)[0] is SampleQuality.TOO_FAST


def test_a_value_that_jumped_is_believed_when_it_comes_back_within_three_steps() -> None:
    state = BEFORE
    for k in range(1000):
        state = validate_sample(RULES, state, Sample(30.0), 100.0 + 2.0 * k, 2.0)[1]
    assert validate_sample(RULES, state, Sample(24.001), 3000.0, 2.0)[0] is SampleQuality.TOO_FAST
    assert validate_sample(RULES, state, Sample(24.0), 3000.0, 2.0) == (
        GOOD,
        SensorState(24.0, 3000.0),
    )
    assert validate_sample(RULES, state, Sample(16.0), 3000.0, 2.0)[0] is GOOD


def test_what_it_may_have_moved_while_unread_is_not_taken_back_by_a_jump() -> None:
    state = SensorState(20.0, 90.0, 7.0, refused=True)
    quality, after = validate_sample(RULES, state, Sample(50.0), 100.0, 2.0)
    assert (quality, after) == (SampleQuality.TOO_FAST, state)


def test_a_clock_that_was_set_back_does_not_let_a_frozen_sensor_live_longer() -> None:
    quality, state = validate_sample(RULES, SensorState(20.0, 9e4), Sample(20.0), 100.0, 0.0)
    assert (quality, state) == (GOOD, SensorState(20.0, 100.0))
    quality, state = validate_sample(RULES, SensorState(20.0, math.nan), Sample(20.0), 100.0, 0.0)
    assert (quality, state) == (GOOD, SensorState(20.0, 100.0))
    assert validate_sample(RULES, state, Sample(20.0), 201.0, 1.0)[0] is SampleQuality.FROZEN


def test_a_loss_does_not_hide_that_a_sensor_is_frozen() -> None:
    _, state = validate_sample(RULES, BEFORE, Sample(None), 100.0, 2.0)
    _, state = validate_sample(RULES, state, Sample(20.0), 102.0, 2.0)
    assert state == BEFORE


def test_rules_that_rule_nothing_are_refused() -> None:
    for name, wrong in (
        *(
            (name, value)
            for name in ("largest_rate_k_per_s", "longest_age_s")
            for value in (0.0, -1.0, 1.1e6, math.nan)
        ),
        *(("largest_difference_k", value) for value in (0.0, -1.0, math.inf)),
        *(
            (name, value)
            for name in ("step_k", "frozen_s", "rests_k")
            for value in (-1e-9, 1.1e6, math.nan)
        ),
        ("lowest_c", 60.0),
        ("lowest_c", -1_000_000.5),
        ("lowest_c", math.nan),
        ("highest_c", 1_000_000.5),
        ("highest_c", 1.0),
    ):
        numbers: dict[str, Any] = {"lowest_c": 1.0, "highest_c": 60.0} | {name: wrong}
        with pytest.raises(ConfigurationError) as error:
            SensorRules(**numbers)
        assert name in error.value.place.key


def test_the_ends_of_the_rules_are_taken_and_the_defaults_are_those_of_the_docs() -> None:
    wide = SensorRules(
        lowest_c=-1e6,
        highest_c=1e6,
        largest_rate_k_per_s=1e6,
        longest_age_s=1e6,
        largest_difference_k=1e6,
        step_k=0.0,
        frozen_s=1e6,
    )
    assert (wide.step_k, wide.frozen_s, wide.time_stamp_required) == (0.0, 1e6, True)
    plain = SensorRules(lowest_c=1.0, highest_c=60.0)
    assert (plain.largest_rate_k_per_s, plain.step_k, plain.longest_age_s) == (0.1, 1.0, 10.0)
    assert (plain.frozen_s, plain.largest_difference_k) == (14_400.0, 3.0)
