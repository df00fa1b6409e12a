"""Known answers of the whole cycle: what is written, in which cycle, and why."""

import math
from dataclasses import replace
from typing import Any

import pytest

from tests.unit.compensation.bench import LARGEST, RATE, Rig, lathe
from tests.unit.compensation.hostile import quick_lathe
from thermaxis.compensation import (
    AnswerCode,
    CompensationModel,
    CycleReading,
    GainPoint,
    Limits,
    Outcome,
    Output,
    Part,
    Quality,
    Request,
    RequestKind,
    Sample,
    SampleQuality,
    Section,
    SensorRules,
    SupervisorState,
    Trim,
    cycle,
    cycle_state,
    shifted,
    with_compensation,
)

OFF, WARMING, ACTIVE = SupervisorState.OFF, SupervisorState.WARMING, SupervisorState.ACTIVE
HOLDING, FADING, FAULT = SupervisorState.HOLDING, SupervisorState.FADING, SupervisorState.FAULT
ENABLE, DISABLE, HOLD = RequestKind.ENABLE, RequestKind.DISABLE, RequestKind.HOLD
ACKNOWLEDGE, DIAMETER = RequestKind.ACKNOWLEDGE, RequestKind.DIAMETER


def trim(value: Any, duration_s: Any = 10.0, output: str = "Z_um") -> Request:
    return Request(RequestKind.TRIM, "Jana", output, value, duration_s)


# ---- the way of the correction -------------------------------------------------------------------


def test_from_off_to_minus_the_model_and_back_to_exactly_zero() -> None:
    bench = Rig()
    assert bench.step(ENABLE).state is WARMING
    assert [bench.step().state for _ in range(3)] == [WARMING, WARMING, ACTIVE]
    assert bench.um == 1.0
    bench.steps(30)
    assert bench.um == 10.0
    assert bench.output.model_um == (-10.0,)
    assert bench.output.rate_um_per_s == (0.0,)
    assert bench.step(DISABLE).state is FADING
    bench.steps(20)
    assert (bench.now, bench.um) == (OFF, 0.0)
    assert bench.output.wanted_um == (10.0,)


def test_a_found_offset_is_where_the_correction_goes_on_from() -> None:
    bench = Rig().to(ACTIVE)
    output = bench.step(found_um=(-7.0,))
    assert (output.before_um, output.correction_um) == ((-7.0,), (-6.0,))
    assert output.rate_um_per_s == (1.0,)


def test_an_offset_that_was_not_found_lets_nothing_move_and_the_largest_is_a_metre() -> None:
    for found in (None, math.nan, math.inf, 1e7, "5", True):
        bench = Rig().to(ACTIVE)
        bench.warmth_k = -6.0
        output = bench.step(found_um=(found,), read_back_um=None)
        assert (output.state, output.correction_um) == (ACTIVE, (5.0,)), found
        assert [bench.step(read_back_um=None).state for _ in range(3)] == [ACTIVE, ACTIVE, FAULT]
    bench = Rig()
    assert bench.step(found_um=(1e6,)).before_um == (1e6,)
    assert bench.step(found_um=(-1e6,)).before_um == (-1e6,)


def test_a_late_cycle_moves_by_no_more_than_two_and_says_its_rate() -> None:
    bench = Rig().to(ACTIVE)
    bench.warmth_k = -10.0
    assert bench.step(seconds=0.0).rate_um_per_s == (0.0,)
    assert bench.step(seconds=0.25).correction_um == (5.25,)
    assert bench.output.rate_um_per_s == (1.0,)
    assert bench.step(seconds=1.75).correction_um == (7.0,)
    assert bench.step(seconds=100.0).correction_um == (9.0,)
    assert (bench.output.elapsed_s, bench.output.rate_um_per_s) == (100.0, (0.02,))


def test_a_clock_that_goes_back_moves_nothing_and_the_model_settles_anew() -> None:
    bench = Rig().to(ACTIVE)
    bench.warmth_k = -10.0
    output = bench.step(seconds=-86_400.0)
    assert (output.state, output.correction_um, output.elapsed_s) == (HOLDING, (5.0,), 0.0)
    assert Outcome.CLOCK_BACKWARD in output.outcomes
    assert output.in_state_s == 0.0
    assert [bench.step().state for _ in range(3)] == [HOLDING, HOLDING, ACTIVE]
    assert bench.um == 6.0


def test_a_time_that_is_none_moves_nothing() -> None:
    for time_s in (math.nan, math.inf, 1.0000001e15, None, "x", True):
        bench = Rig().to(ACTIVE)
        bench.warmth_k = -10.0
        before = bench.state.time_s
        output = bench.step(time_s=time_s)
        assert (output.correction_um, output.elapsed_s, output.time_s) == ((5.0,), 0.0, before)
        assert output.quality is Quality.BAD
        fresh = Rig()
        output = fresh.step(time_s=time_s)
        assert (output.time_s, output.since_s) == (0.0, 0.0)
        assert fresh.step().since_s == fresh.time_s


def test_whole_numbers_and_the_first_and_latest_second_are_times() -> None:
    bench = Rig().to(ACTIVE)
    bench.warmth_k = -10.0
    output = bench.step(time_s=int(bench.time_s) + 1)
    assert (output.correction_um, output.time_s) == ((6.0,), bench.time_s)
    bench = Rig()
    assert bench.step(time_s=-1e15).time_s == -1e15
    assert bench.step(time_s=1e15).elapsed_s == 2e15


def test_a_correction_that_was_found_outside_stays_while_off_and_else_comes_back() -> None:
    bench = Rig().steps(3)
    assert bench.step(found_um=(-30.0,)).correction_um == (-30.0,)
    assert bench.step().correction_um == (-30.0,)
    assert bench.answer(ENABLE) == (False, AnswerCode.OFFSET_OUTSIDE)
    bench = Rig().to(ACTIVE)
    assert bench.step(found_um=(-30.0,)).state is FAULT
    assert bench.um == -29.0
    assert bench.answer(ACKNOWLEDGE) == (False, AnswerCode.OFFSET_OUTSIDE_STILL)
    assert bench.um == -28.0
    assert bench.steps(8).um == -20.0
    assert bench.answer(ACKNOWLEDGE)[0]
    assert bench.steps(30).now is OFF
    assert bench.um == 0.0


def test_the_total_itself_is_inside_and_one_output_outside_is_enough() -> None:
    for found_um, state in ((20.0, ACTIVE), (-20.0, ACTIVE), (20.000001, FAULT)):
        assert Rig().to(ACTIVE).step(found_um=(found_um,)).state is state
    compensation = quick_lathe()
    reading = CycleReading(0.0, (), found_um=(0.0, 10.0), requests=(Request(ENABLE),))
    _, output = cycle(compensation, cycle_state(compensation), reading)
    assert not output.answers[0].accepted


def test_a_stored_correction_that_is_no_number_counts_as_zero() -> None:
    bench = Rig()
    bench.state = bench.state._replace(correction_um=(math.nan,))
    assert bench.step().correction_um == (0.0,)


def test_the_magnitude_bounds_the_model_and_the_total_both() -> None:
    bench = Rig(lathe(Limits(6.0, RATE, 7.0, largest_trim_um=5.0))).to(ACTIVE)
    bench.warmth_k = -9.0
    output = bench.steps(2).output
    assert (bench.um, output.wanted_um, output.at_limit) == (6.0, (6.0,), (True,))
    output = bench.steps(1, requests=(trim(5.0),)).output
    assert (output.wanted_um, output.trim_um) == ((7.0,), (5.0,))
    bench.warmth_k = 9.0
    output = bench.steps(1, requests=(trim(-5.0),)).output
    assert (output.wanted_um, output.at_limit) == ((-7.0,), (True,))


def test_one_output_at_its_magnitude_for_too_long_is_a_fault() -> None:
    compensation = quick_lathe(settle_s=0.0, recovery_delay_s=0.0)
    state, states = cycle_state(compensation), []
    for k in range(9):
        samples = (Sample(24.0), Sample(20.0), Sample(20.0))
        reading = CycleReading(
            float(k),
            samples,
            interlocks=(True, True),
            found_um=(0.0, 0.0) if k == 0 else None,
            read_back_um=state.correction_um,
            requests=(Request(ENABLE),) if k == 0 else (),
        )
        state, output = cycle(compensation, state, reading)
        states.append(output.state)
    assert output.at_limit == (True, False)
    assert states == [WARMING, *[ACTIVE] * 7, FAULT]


def test_one_output_that_is_not_at_zero_is_enough_to_fade() -> None:
    compensation = quick_lathe()
    asked = (Request(ENABLE), Request(DISABLE))
    state, _ = cycle(
        compensation,
        cycle_state(compensation),
        CycleReading(0.0, (), found_um=(0.0, 5.0), requests=asked[:1]),
    )
    reading = CycleReading(1.0, (), read_back_um=(0.0, 5.0), requests=asked[1:])
    _, output = cycle(compensation, state, reading)
    assert (output.state, output.correction_um) == (FADING, (0.0, 3.7))


def test_at_the_magnitude_itself_nothing_is_at_the_limit() -> None:
    bench = Rig().to(ACTIVE)
    assert bench.step(samples=(Sample(10.0),)).at_limit == (False,)
    assert bench.step(samples=(Sample(30.0),)).at_limit == (False,)
    assert bench.step(samples=(Sample(30.001),)).at_limit == (True,)


def test_the_deadband_keeps_a_goal_until_another_differs_by_more() -> None:
    bench = Rig(lathe(Limits(LARGEST, RATE, deadband_um=1.0))).to(ACTIVE)
    assert bench.um == 5.0
    bench.warmth_k = -3.0
    assert bench.steps(3).um == 5.0
    bench.warmth_k = -3.0625
    assert bench.steps(3).um == 6.125
    bench.warmth_k = -2.5625
    assert bench.steps(3).um == 6.125
    bench.step(DISABLE)
    assert bench.steps(9).um == 0.0


def test_a_deadband_does_not_keep_the_last_micrometre_from_zero() -> None:
    bench = Rig(lathe(Limits(LARGEST, 0.5, deadband_um=1.0))).to(WARMING)
    bench.warmth_k = -1.0
    bench.steps(9)
    assert bench.um == 2.0
    bench.warmth_k = 0.0
    assert bench.steps(9).um == 0.0


# ---- the machine does not follow -----------------------------------------------------------------


def test_a_faulty_correction_waits_for_a_machine_that_keeps_another_offset() -> None:
    bench = Rig().to(ACTIVE)
    bench.steps(4, read_back_um=(8.0,))
    assert (bench.now, bench.um) == (FAULT, 5.0)
    assert bench.steps(5, read_back_um=(8.0,)).um == 5.0
    assert bench.steps(2, read_back_um=(5.0,)).um == 4.0
    assert bench.steps(1).um == 3.0
    assert bench.steps(1, read_back_um=(3.5,)).um == 2.0
    assert bench.steps(4, read_back_um=(-3.0,)).um == 0.0
    assert bench.steps(4, read_back_um=(-3.0,)).um == 0.0


def test_a_faulty_correction_goes_as_far_as_the_machine_is_seen_to_follow() -> None:
    for sign in (1.0, -1.0):
        bench = Rig().to(ACTIVE)
        bench.step(found_um=(sign * 5.0,), read_back_um=None, other_compensation=True)
        assert bench.um == sign * 4.0
        assert bench.step(read_back_um=(sign * 3.4,)).correction_um == (sign * 3.4,)
        assert bench.step(read_back_um=(sign * 9.0,)).correction_um == (sign * 3.4,)
        assert bench.step(read_back_um=(sign * 1.0,)).correction_um == (sign * 2.4,)
        assert bench.step(read_back_um=(sign * -1.0,)).correction_um == (sign * 2.4 - sign,)
        assert bench.step(read_back_um=None).correction_um[0] == pytest.approx(sign * 0.4)


def test_outside_the_total_a_faulty_correction_waits_at_the_total() -> None:
    for sign in (1.0, -1.0):
        bench = Rig().to(ACTIVE)
        bench.step(found_um=(sign * 21.5,), read_back_um=None)
        assert (bench.now, bench.um) == (FAULT, sign * 20.5)
        assert bench.steps(1, read_back_um=(sign * 25.0,)).um == sign * 20.0
        assert bench.steps(9, read_back_um=(sign * 25.0,)).um == sign * 20.0


def test_outputs_that_follow_fade_while_another_is_waited_for() -> None:
    compensation = quick_lathe(settle_s=0.0, recovery_delay_s=0.0)
    state = cycle_state(compensation)
    samples = (Sample(20.0), Sample(20.0), Sample(20.0))
    base = CycleReading(0.0, samples, interlocks=(True, True))
    state, _ = cycle(
        compensation, state, base._replace(found_um=(6.0, 6.0), requests=(Request(ENABLE),))
    )
    reading = base._replace(time_s=1.0, read_back_um=(9.0, 6.5), other_compensation=True)
    state, output = cycle(compensation, state, reading)
    assert output.state is FAULT
    assert output.correction_um == (6.0, 4.7)


def test_a_read_back_is_believed_within_the_tolerance_and_else_nothing_moves() -> None:
    believed = ((5.5,), (4.5,), (5,))
    others = ((5.51,), (4.49,), (math.nan,), None, (), (5.0, 5.0), (None,), ("5",), (True,))
    for said in (*believed, *others):
        bench = Rig().to(ACTIVE)
        bench.warmth_k = -6.0
        expected = (6.0,) if said in believed else (5.0,)
        assert bench.step(read_back_um=said).correction_um == expected, said


def test_a_report_that_lies_never_makes_a_step() -> None:
    for lie in (0.0, -1.0, 2.0, -20.0):
        bench = Rig().to(ACTIVE)
        last = bench.um
        for _ in range(30):
            bench.step(read_back_um=(lie * bench.um,))
            assert abs(bench.um) <= abs(last)
            assert abs(bench.um - last) <= RATE
            last = bench.um


def test_disabled_while_the_machine_is_lost_it_fades_what_is_found_on_return() -> None:
    bench = Rig().to(ACTIVE)
    bench.step(DISABLE, connected=False, read_back_um=None)
    bench.steps(30, connected=False, read_back_um=None)
    assert (bench.now, bench.um) == (FADING, 0.0)
    assert bench.step(found_um=(5.0,)).correction_um == (4.0,)
    assert bench.steps(10).now is OFF
    assert bench.um == 0.0


def test_a_model_that_has_nothing_to_say_moves_nothing() -> None:
    bench = Rig(lathe(longest_hold_s=0.5, input_timeout_s=9.0, settle_s=0.0)).to(ACTIVE)
    bench.warmth_k = -6.0
    output = bench.step(samples=())
    assert (output.state, output.quality, bench.um) == (ACTIVE, Quality.BAD, 5.0)


# ---- requests ------------------------------------------------------------------------------------


def test_every_answer_of_an_ordinary_state() -> None:
    bench = Rig()
    assert bench.answer(HOLD) == (False, AnswerCode.NOTHING_TO_HOLD)
    assert bench.answer(ENABLE) == (True, AnswerCode.ENABLED)
    assert bench.answer(ENABLE) == (True, AnswerCode.ALREADY_ENABLED)
    assert bench.answer(HOLD) == (True, AnswerCode.HELD)
    assert bench.answer(RequestKind.RESUME) == (True, AnswerCode.RESUMED)
    assert bench.answer(DISABLE) == (True, AnswerCode.DISABLED)
    assert bench.answer(RequestKind.MODEL) == (False, AnswerCode.NOT_SUPPORTED)
    assert bench.answer(ACKNOWLEDGE) == (True, AnswerCode.NO_FAULT)
    assert bench.answer(ENABLE, other_compensation=None) == (
        False,
        AnswerCode.OTHER_COMPENSATION_UNREAD,
    )
    assert bench.answer(ENABLE, other_compensation=True) == (False, AnswerCode.DOUBLE_COMPENSATION)
    assert bench.answer(trim(1.0, output="W_um")) == (False, AnswerCode.UNKNOWN_OUTPUT)
    assert bench.answer(trim(5.01)) == (False, AnswerCode.TRIM_RANGE)
    assert bench.answer(trim(1.0, None)) == (False, AnswerCode.TRIM_DURATION)
    assert bench.answer(trim(0.0, None)) == (True, AnswerCode.TRIM_CLEARED)
    assert bench.answer(trim(-5.0, 28_800.0)) == (True, AnswerCode.TRIM_SET)
    assert bench.answer(trim(2.0, 28_800.0)) == (True, AnswerCode.TRIM_REPLACED)
    assert bench.answer(Request(DIAMETER, value=-1.0)) == (False, AnswerCode.DIAMETER_RANGE)
    assert bench.answer(Request(DIAMETER, value=None)) == (True, AnswerCode.DIAMETER_SET)


def test_an_answer_has_the_values_that_its_sentence_needs() -> None:
    asked = (trim(1.0, output="W_um"), trim(9.0), trim(1.0, None), Request(DIAMETER, value=-1.0))
    assert [(a.code, dict(a.values)) for a in Rig().step(*asked).answers] == [
        (AnswerCode.UNKNOWN_OUTPUT, {"names": ("Z_um",)}),
        (AnswerCode.TRIM_RANGE, {"lowest_um": -5.0, "largest_um": 5.0}),
        (AnswerCode.TRIM_DURATION, {"longest_s": 28_800.0}),
        (AnswerCode.DIAMETER_RANGE, {"largest_mm": 1e5}),
    ]


def test_every_answer_in_the_state_fault() -> None:
    bench = Rig().to(FAULT)
    other = {"other_compensation": True}
    refused = AnswerCode.ACKNOWLEDGE_FIRST
    assert bench.answer(ENABLE, **other) == (False, refused)
    assert not bench.answer(HOLD, **other)[0]
    assert bench.answer(trim(1.0), **other) == (False, AnswerCode.IN_FAULT)
    assert bench.answer(ACKNOWLEDGE, **other) == (False, AnswerCode.DOUBLE_COMPENSATION_STILL)
    assert not bench.answer(ACKNOWLEDGE, other_compensation=None)[0]
    assert bench.answer(DISABLE, **other)[0]
    assert bench.now is FAULT
    assert bench.answer(ACKNOWLEDGE) == (True, AnswerCode.ACKNOWLEDGED)
    assert bench.now in {FADING, OFF}
    bench = Rig().to(ACTIVE).steps(4, read_back_um=None)
    for loss in ({"read_back_um": None}, {"connected": False}):
        accepted, reason = bench.answer(ACKNOWLEDGE, **loss)
        assert (accepted, reason) == (False, AnswerCode.READ_BACK_DIFFERS_STILL)
    assert bench.answer(ACKNOWLEDGE)[0]


def test_an_acknowledged_read_back_is_forgotten() -> None:
    bench = Rig().to(ACTIVE).steps(4, read_back_um=None)
    bench.step(ACKNOWLEDGE)
    assert [bench.step(read_back_um=None).state for _ in range(3)] == [FADING] * 3


def test_an_acknowledged_fault_leaves_no_hold_and_no_time_of_a_read_back_that_differs() -> None:
    bench = Rig().to(HOLDING)
    bench.steps(2, read_back_um=(9.0,))
    bench.step(other_compensation=True, read_back_um=(9.0,))
    assert (bench.now, bench.state.memory.differs_s) == (FAULT, 3.0)
    bench.step(ACKNOWLEDGE, read_back_um=(9.0,))
    assert (bench.now, bench.state.memory.differs_s) == (FADING, 1.0)
    assert not bench.state.memory.held


def test_requests_are_answered_in_their_order_and_take_effect_in_it() -> None:
    bench = Rig()
    output = bench.step(HOLD, ENABLE, HOLD, DISABLE, ENABLE)
    assert [answer.accepted for answer in output.answers] == [False, True, True, True, True]
    kinds = [answer.request.kind for answer in output.answers]
    assert kinds == [HOLD, ENABLE, HOLD, DISABLE, ENABLE]
    assert not bench.state.memory.held


def test_enabling_ends_a_hold_and_heals_first() -> None:
    bench = Rig().steps(9)
    assert bench.step(ENABLE).state is WARMING
    assert bench.step().state is ACTIVE
    bench.step(HOLD)
    bench.step(DISABLE)
    assert bench.state.memory.held is False
    bench.step(ENABLE)
    assert bench.state.memory.ready_s == 1.0


def test_what_is_no_request_is_refused_and_a_word_is_as_good_as_a_kind() -> None:
    nonsense: tuple[Any, ...] = (None, 3, "enable", Request([]), Request(None), Request("x"))
    output = Rig().step(requests=(*nonsense, Request("enable")))
    answered = [(answer.request, answer.accepted) for answer in output.answers]
    assert answered == [*((one, False) for one in nonsense), (Request("enable"), True)]
    assert output.state is WARMING


def test_a_trim_of_no_number_too_large_or_without_an_end_is_refused() -> None:
    for value in (None, math.nan, math.inf, "1", True, 5.1, -5.1):
        assert not Rig().answer(trim(value))[0], value
    for duration_s in (None, math.nan, 0.0, -1.0, 28_800.1, "9"):
        assert not Rig().answer(trim(1.0, duration_s))[0], duration_s
    assert Rig().answer(trim(1.0, 1e-3))[0]


def test_a_trim_is_added_at_the_rate_expires_and_is_taken_back() -> None:
    bench = Rig().to(ACTIVE)
    output = bench.step(trim(3.0, 4.0))
    assert output.trim_um == (3.0,)
    assert bench.state.trims == (Trim(3.0, "Jana", 4.0),)
    assert [bench.step().correction_um[0] for _ in range(7)] == [7.0, 8.0, 8.0, 7.0, 6.0, 5.0, 5.0]
    assert bench.state.trims == (Trim(),)
    bench.step(trim(3.0, 99.0))
    bench.step(trim(0))
    assert bench.steps(5).um == 5.0


def test_a_trim_is_taken_back_in_every_state_and_given_in_every_one_but_fault() -> None:
    for state in SupervisorState:
        bench = Rig().to(state)
        bench.state = bench.state._replace(trims=(Trim(3.0, "Jana", 99.0),))
        calm = {"other_compensation": state is FAULT}
        assert bench.answer(trim(2.0), **calm)[0] is (state is not FAULT), state
        assert bench.output is not None
        assert bench.output.trim_um == ((3.0,) if state is FAULT else (2.0,)), state
        assert bench.answer(trim(0.0, None), **calm) == (True, AnswerCode.TRIM_CLEARED)
        assert bench.output.trim_um == (0.0,), state
        assert bench.state.trims == (Trim(),)


def test_a_trim_that_expires_while_held_is_gone_after_it() -> None:
    bench = Rig().to(ACTIVE)
    bench.step(trim(3.0, 2.5))
    bench.step(HOLD)
    assert bench.um == 6.0
    assert [bench.step().correction_um for _ in range(3)] == [(6.0,)] * 3
    assert bench.output.trim_um == (0.0,)
    assert bench.step(RequestKind.RESUME).correction_um == (5.0,)


def test_a_trim_of_one_output_leaves_the_other_alone() -> None:
    compensation = quick_lathe()
    state = cycle_state(compensation)
    asked = (trim(2.0, output="X_um"), trim(1.0, 5.0), trim(0.5, output="X_um"))
    reading = CycleReading(0.0, (), requests=asked)
    state, output = cycle(compensation, state, reading)
    assert output.trim_um == (1.0, 0.5)
    state, output = cycle(compensation, state, reading._replace(time_s=5.0, requests=()))
    assert output.trim_um == (0.0, 0.5)


def test_the_diameter_changes_the_gain_at_the_rate() -> None:
    points = (GainPoint(0.0, 1.0), GainPoint(1000.0, 2.0))
    bench = Rig(lathe(part=Part("s", "s", "", 2.0, gain_by_diameter=points))).to(ACTIVE)
    bench.step(Request(DIAMETER, value=500.0))
    assert bench.state.diameter_mm == 500.0
    assert bench.steps(4).um == 7.5
    assert bench.answer(Request(DIAMETER, value=1e5))[0]
    assert bench.answer(Request(DIAMETER, value=0.0))[0]
    assert not bench.answer(Request(DIAMETER, value=100_000.1))[0]
    assert not bench.answer(Request(DIAMETER, value=math.nan))[0]
    assert bench.state.diameter_mm == 0.0
    bench.step(Request(DIAMETER))
    assert bench.state.diameter_mm is None


# ---- inputs --------------------------------------------------------------------------------------


def test_an_acknowledgement_believes_sensors_that_have_jumped() -> None:
    sensor = SensorRules(lowest_c=1.0, highest_c=60.0)
    bench = Rig(lathe(sensor=sensor))
    bench.steps(3)
    bench.warmth_k = 10.0
    assert bench.step().qualities == (SampleQuality.TOO_FAST,)
    assert bench.steps(50).output.qualities == (SampleQuality.TOO_FAST,)
    assert bench.step(ACKNOWLEDGE).qualities == (SampleQuality.GOOD,)
    bench = Rig(lathe(sensor=replace(sensor, step_k=3.0))).to(FAULT)
    jumped = {"samples": (Sample(45.0),)}
    assert bench.step(**jumped).qualities == (SampleQuality.TOO_FAST,)
    bench.step(ACKNOWLEDGE, other_compensation=True, **jumped)
    assert bench.output.qualities == (SampleQuality.TOO_FAST,)
    assert bench.step(ACKNOWLEDGE, **jumped).qualities == (SampleQuality.GOOD,)


def two_sensors(first: Any, second: Any, **options: Any) -> Any:
    bench = Rig(lathe(redundant=frozenset({"s"}), **options)).to(ACTIVE)
    return bench.step(samples=(first,), redundant=(second,))


def test_a_second_sensor_stands_in_or_contradicts() -> None:
    lost = Sample(None)
    cases = (
        (Sample(17.5), Sample(19.0), 17.5, SampleQuality.GOOD),
        (Sample(17.5), lost, 17.5, SampleQuality.GOOD),
        (Sample(17.5), None, 17.5, SampleQuality.GOOD),
        (lost, Sample(19.0), 19.0, SampleQuality.REDUNDANT),
        (lost, lost, None, SampleQuality.MISSING),
        (Sample(17.5), Sample(20.5), 17.5, SampleQuality.GOOD),
        (Sample(17.5), Sample(20.75), None, SampleQuality.DISAGREES),
        (Sample(17.5), Sample(14.25), None, SampleQuality.DISAGREES),
    )
    for first, second, value, quality in cases:
        output = two_sensors(first, second)
        assert (output.values, output.qualities) == ((value,), (quality,))
    assert Rig().to(ACTIVE).step(redundant=(Sample(40.0),)).values == (17.5,)


def test_samples_are_taken_in_order_and_missing_ones_are_missing() -> None:
    compensation = quick_lathe()
    _, output = cycle(
        compensation, cycle_state(compensation), CycleReading(0.0, (Sample(21.0), Sample(22.0)))
    )
    assert output.values == (21.0, 22.0, None)
    _, output = cycle(
        compensation,
        cycle_state(compensation),
        CycleReading(0.0, (None, 5.0, Sample(22.0), Sample(9.0))),
    )
    assert output.values == (None, None, 22.0)
    assert output.qualities[:2] == (SampleQuality.MISSING,) * 2


def test_outside_the_range_of_its_training_a_model_loses_its_weight() -> None:
    part = Part("s", "s", "", 2.0, lowest_k=-2.0, highest_k=4.0)
    bench = Rig(lathe(part=part, validity_margin_k=4.0, lowest_weight=0.1))
    for warmth_k, weight in (
        *((4.0, 1.0), (5.0, 0.75), (7.0, 0.25), (9.0, 0.1)),
        *((-3.0, 0.75), (-9.0, 0.1)),
    ):
        bench.warmth_k = warmth_k
        output = bench.step()
        assert output.weight == (weight,)
        assert output.wanted_um == (-weight * 2.0 * warmth_k,)


def test_the_part_that_is_furthest_outside_takes_the_weight() -> None:
    parts = (
        Part("near", "s", "", 1.0, lowest_k=0.0, highest_k=4.0),
        Part("far", "s", "", 1.0, lowest_k=0.0, highest_k=2.0),
    )
    compensation = lathe(validity_margin_k=4.0)
    model = replace(compensation.model, outputs=(Output("Z_um", parts),))
    compensation = replace(compensation, model=model)
    _, output = cycle(compensation, cycle_state(compensation), CycleReading(0.0, (Sample(25.0),)))
    assert output.weight == (0.25,)


def test_each_output_has_the_weight_of_its_own_parts() -> None:
    z = Output("Z_um", (Part("s", "s", "", 1.0, lowest_k=0.0, highest_k=1.0),))
    x = Output("X_um", (Part("t", "t", "", 1.0, lowest_k=0.0, highest_k=9.0),))
    model = CompensationModel(
        outputs=(z, x), reference="stated", reference_c={"s": 20.0, "t": 20.0}
    )
    wide = SensorRules(lowest_c=1.0, highest_c=60.0)
    compensation = replace(
        lathe(),
        model=model,
        sensors={"s": wide, "t": wide},
        limits={"Z_um": Limits(50.0, 1.0), "X_um": Limits(50.0, 1.0)},
    )
    reading = CycleReading(0.0, (Sample(22.0), Sample(30.0)))
    _, output = cycle(compensation, cycle_state(compensation), reading)
    assert output.weight == (0.8, 0.8)
    _, output = cycle(
        compensation,
        cycle_state(compensation),
        reading._replace(samples=(Sample(22.0), Sample(25.0))),
    )
    assert output.weight == (0.8, 1.0)


# ---- other models, other clocks ------------------------------------------------------------------


def test_another_model_takes_over_without_a_bump() -> None:
    bench = Rig().to(ACTIVE)
    bench.step(trim(1.0, 500.0), Request(DIAMETER, value=7.0))
    old, before = bench.compensation, bench.um
    new = lathe(part=Part("s", "s", "", -2.0))
    bench.state, bench.compensation = with_compensation(new, old, bench.state), new
    assert bench.step().correction_um == (before,)
    assert bench.output.model_um == (5.0,)
    assert bench.state.diameter_mm == 7.0
    last = bench.um
    for _ in range(20):
        bench.step()
        assert abs(bench.um - last) <= RATE
        last = bench.um
    assert bench.um == -4.0


def test_another_model_keeps_references_sensors_and_corrections_by_name() -> None:
    def two(outputs: tuple[str, ...], channels: tuple[str, ...]) -> Any:
        model = CompensationModel(
            outputs=tuple(
                Output(name, tuple(Part(c, c, "", 2.0, ()) for c in channels)) for name in outputs
            )
        )
        rules = SensorRules(lowest_c=1.0, highest_c=60.0)
        return replace(
            lathe(),
            model=model,
            sensors=dict.fromkeys(channels, rules),
            limits=dict.fromkeys(outputs, Limits(20.0, 1.0)),
            interlocks=(),
        )

    old, new = two(("A_um", "B_um"), ("p", "q")), two(("B_um", "C_um"), ("q", "r"))
    state = cycle_state(old, {"p": 10.0})
    samples = (Sample(12.0), Sample(15.0))
    reading = CycleReading(
        5.0,
        samples,
        found_um=(3.0, 4.0),
        requests=(trim(2.0, 50.0, "B_um"), trim(1.0, 50.0, "A_um")),
    )
    state, _ = cycle(old, state, reading)
    changed = with_compensation(new, old, state)
    assert changed.correction_um == (4.0, 0.0)
    assert changed.goal_um == (4.0, 0.0)
    assert changed.trims == (Trim(2.0, "Jana", 50.0), Trim())
    assert changed.thermal.reference[0] == 15.0
    assert math.isnan(changed.thermal.reference[1])
    assert changed.thermal.warm
    assert changed.sensors[0].good_c == 15.0
    assert math.isnan(changed.sensors[1].good_c)
    assert changed.time_s == 5.0
    foreign = state._replace(thermal=state.thermal._replace(reference=()))
    assert math.isnan(with_compensation(new, old, foreign).thermal.reference[0])
    half = with_compensation(new, old, state, [(1.0, {"q": 15.0})])
    assert half.thermal.time_s is None
    assert half.thermal.value == ()
    fresh = with_compensation(new, old, cycle_state(old))
    assert not fresh.thermal.warm


def test_another_model_that_runs_along_the_past_is_where_it_would_be() -> None:
    bench = Rig(lathe(settle_s=3.0, recovery_delay_s=4.0)).to(WARMING)
    bench.steps(12)
    assert bench.now is ACTIVE
    slow = lathe(
        part=Part("s", "s", "", 0.0, (Section(4.0, 50.0),)), settle_s=3.0, recovery_delay_s=4.0
    )
    past = [(bench.time_s - 20.0, {"s": 20.0}), (bench.time_s - 19.0, {"s": 15.0})]
    past += [(bench.time_s - 10.0, {"w": 99.0}), (bench.time_s, {"s": 15.0, "w": 99.0})]
    bench.state = with_compensation(slow, bench.compensation, bench.state, past)
    bench.compensation = slow
    sections = bench.state.thermal.sections
    assert sections == pytest.approx((5.0 * math.expm1(-19.0 / 50.0),))
    states = [bench.step().state for _ in range(5)]
    assert states == [HOLDING, HOLDING, HOLDING, ACTIVE, ACTIVE]
    assert bench.output.model_um == pytest.approx((20.0 * math.expm1(-24.0 / 50.0),))
    assert bench.state.memory.running_s == 3.0
    empty = with_compensation(slow, slow, bench.state, [(1.0, {})])
    assert empty.thermal.time_s is None
    assert empty.memory.running_s == empty.memory.ready_s == 0.0


def test_a_stated_reference_of_the_new_model_counts() -> None:
    old = replace(
        lathe(), model=CompensationModel(outputs=(Output("Z_um", (Part("s", "s", "", 2.0),)),))
    )
    state = cycle_state(old, {"s": 33.0})
    assert with_compensation(lathe(), old, state).thermal.reference == (20.0,)
    assert with_compensation(old, lathe(), cycle_state(lathe())).thermal.reference == (20.0,)


def test_a_model_change_while_it_fades_lets_it_fade_on() -> None:
    bench = Rig().to(ACTIVE)
    bench.step(DISABLE)
    bench.state = with_compensation(bench.compensation, bench.compensation, bench.state)
    assert [bench.step().correction_um for _ in range(4)] == [(3.0,), (2.0,), (1.0,), (0.0,)]
    assert bench.step().state is OFF


def test_every_time_moves_with_the_clock() -> None:
    compensation = replace(
        lathe(part=Part("s", "s", "", 2.0, delay_s=5.0)), redundant=frozenset({"s"})
    )
    bench = Rig(compensation)
    bench.steps(3, redundant=(Sample(15.0),))
    moved = shifted(bench.state, 1000.0)
    assert moved.time_s == bench.state.time_s + 1000.0
    assert moved.thermal.time_s == moved.time_s
    assert moved.thermal.good_s == (moved.time_s,)
    assert [t for t, _ in moved.thermal.history] == [1101.0, 1102.0, 1103.0]
    assert moved.sensors[0].changed_s == moved.redundant[0].changed_s == 1101.0
    assert moved.memory.since_s == 1101.0
    assert shifted(cycle_state(compensation), 5.0).thermal.time_s is None


def test_a_new_state_is_off_and_empty() -> None:
    compensation = quick_lathe()
    state = cycle_state(compensation)
    assert (state.correction_um, state.goal_um) == ((0.0, 0.0), (0.0, 0.0))
    assert state.memory.state is OFF
    assert math.isnan(state.memory.since_s)
    assert (state.memory.enabled, state.memory.held, state.memory.fault) == (False, False, None)
    assert state.memory[5:] == (0.0,) * 9
    assert math.isnan(state.time_s)
    assert state.diameter_mm is None
    assert len(state.sensors) == len(state.redundant) == 3
    assert cycle_state(compensation, {"s": 3.0}).thermal.reference[0] == 3.0


def test_limits_of_less_than_a_micrometre_are_limits() -> None:
    small = lathe(Limits(0.5, 0.25, largest_trim_um=0.25))
    bench = Rig(small).to(WARMING)
    bench.warmth_k = -0.375
    assert bench.steps(6).um == 0.5
    assert bench.output.at_limit == (True,)
    bench = Rig(small).to(WARMING)
    assert bench.step(found_um=(0.9,)).state is FAULT
    assert bench.um == 0.65
    assert bench.step(read_back_um=(5.0,)).correction_um == (0.5,)
