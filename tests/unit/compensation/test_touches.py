"""Touches of the machine's probe: what they teach of an offset, and what they may do with it."""

import math
import random
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.refusals import refused
from tests.unit.compensation.bench import Rig, lathe
from thermaxis.compensation import (
    Limits,
    OffsetState,
    RequestKind,
    SensorRules,
    Touch,
    TouchOutcome,
    TouchRules,
    cycle_state,
    shifted,
    touch_step,
    with_compensation,
)

FREE = Limits(1000.0, 100.0)
SLOW = TouchRules(limits=Limits(8.0, 0.25), acts=True)
BELIEVED, CONFIRMED, EXCLUDED, *_, NO_EFFECT, TOO_FAR, TOO_MANY_EXCLUDED = TouchOutcome


def one(state: OffsetState, value_um: float, time_s: float, **more: Any) -> Any:
    """Believe a touch where no correction is in force."""
    rules = more.pop("rules", SLOW)
    return touch_step(rules, state, Touch("Z_um", value_um, time_s, **more), 0.0)


class Touched(Rig):
    """A rig whose machine has an offset that the model does not know, and a probe that sees it."""

    def __init__(self, rules: TouchRules = SLOW, **options: Any) -> None:
        sensor = SensorRules(lowest_c=1.0, highest_c=60.0, step_k=50.0, frozen_s=0.0)
        options = {"limits": Limits(20.0, 1.0), "sensor": sensor} | options
        super().__init__(lathe(touches={"Z_um": rules}, **options))
        self.offset_um = 4.0
        self.seen: Callable[[float, float], float] = lambda d_um, c_um: d_um + c_um
        self.number = 0
        self.step(RequestKind.ENABLE, found_um=(0.0,))
        self.steps(30)

    @property
    def state_um(self) -> OffsetState:
        return self.state.offsets[0]

    def probed_um(self) -> float:
        """Return what a probe reads now."""
        return self.seen(2.0 * self.warmth_k + self.offset_um, self.um)

    def touch(self, wrong_um: float = 0.0, **changes: Any) -> TouchOutcome:
        """Touch half a second before the next cycle."""
        self.number += 1
        value_um = self.probed_um() + wrong_um
        touched = Touch("Z_um", value_um, self.time_s + 0.5, self.number)
        return self.step(touches=(touched._replace(**changes),)).touch_outcomes[0]


# ---- the estimator -------------------------------------------------------------------------------


def test_one_touch_has_the_gain_of_a_kalman_filter() -> None:
    rules = replace(SLOW, start_um=2.0, noise_um=1.0)
    state, outcome = one(OffsetState(), 3.0, 0.0, rules=rules)
    assert outcome is BELIEVED
    assert state.belief is not None
    assert state.belief.offset_um == pytest.approx(3.0 * 4.0 / 5.0, abs=1e-14)
    assert state.belief.variance_um2 == pytest.approx(4.0 / 5.0, abs=1e-14)


@pytest.mark.parametrize("discrepancy_um", [0.0, 1.5])
def test_touches_leave_what_a_regression_on_all_of_them_leaves(discrepancy_um: float) -> None:
    rules = replace(SLOW, start_um=300.0, drift_um_per_root_h=3.0, gate=20.0)
    rules = replace(rules, discrepancy_um=discrepancy_um)
    rng = random.Random(7)  # noqa: S311 - a test that can be repeated
    times = [0.0, 500.0, 4000.0, 4100.0, 30_000.0, 34_000.0]
    noise = [1.0, 0.5, 2.0, 1.0, 0.3, 1.0]
    values = [5.0 + rng.gauss(0.0, 2.0) for _ in times]
    state = OffsetState()
    for k, (at_s, value_um, noise_um) in enumerate(zip(times, values, noise, strict=True)):
        state, outcome = one(state, value_um, at_s, number=k, noise_um=noise_um, rules=rules)
        assert outcome is BELIEVED
    # b(0) ~ N(0, start), b is a random walk: the joint normal distribution, conditioned
    at = np.array(times)
    prior = 300.0**2 + 9.0 * np.minimum(at[:, None], at[None, :]) / 3600.0
    seen = prior + np.diag(np.square(noise) + discrepancy_um**2)
    weights = np.linalg.solve(seen, prior[:, -1])
    assert state.belief is not None
    assert state.belief.offset_um == pytest.approx(float(weights @ values), rel=1e-3)
    left_um2 = float(prior[-1, -1] - weights @ prior[:, -1])
    assert state.belief.variance_um2 == pytest.approx(left_um2, rel=1e-3)


def test_nine_of_ten_healthy_innovations_lie_where_they_should() -> None:
    rng = np.random.default_rng(11)
    rules = replace(SLOW, limits=FREE, drift_um_per_root_h=2.0, start_um=500.0, gate=6.0)
    state, offset_um, within, count = OffsetState(), 0.0, 0, 3000
    for k in range(count):
        offset_um += 2.0 * math.sqrt(0.5) * rng.standard_normal()
        at_s, touched_um = 1800.0 * k, offset_um + rng.standard_normal()
        if state.belief is not None:
            grown_um2 = state.belief.variance_um2 + 4.0 * 0.5
            r_um = touched_um - state.belief.offset_um
            within += r_um**2 <= 4.0 * (grown_um2 + 1.0)
        state, _ = one(state, touched_um, at_s, number=k, rules=rules)
    assert 0.94 < within / count < 0.97


def test_the_uncertainty_grows_with_the_root_of_time_up_to_that_of_the_model_alone() -> None:
    rig = Touched()
    assert rig.step().offset_std_um == (5.0,)
    rig.touch()
    variance_um2 = rig.state_um.belief.variance_um2
    for _ in range(4):
        rig.step(seconds=900.0)
    (std_um,) = rig.step(seconds=0.5).offset_std_um
    assert std_um == pytest.approx(math.sqrt(variance_um2 + 4.0 * 3601.0 / 3600.0), rel=1e-9)
    rig.steps(30, seconds=900.0)
    assert rig.output is not None
    assert rig.output.offset_std_um == (5.0,)
    rig = Touched(replace(SLOW, discrepancy_um=12.0))  # of which no touch tells
    assert rig.step().offset_std_um == (13.0,)


# ---- the gate ------------------------------------------------------------------------------------


@pytest.mark.parametrize("wrong_um", [50.0, -50.0])
@pytest.mark.parametrize("first", [True, False])
def test_a_single_touch_that_is_off_moves_nothing_and_asks_for_a_second(
    wrong_um: float,
    first: bool,
) -> None:
    rig = Touched()
    if not first:
        assert rig.touch() is BELIEVED
        rig.steps(40)
    before, um = rig.state_um, rig.um
    assert rig.touch(wrong_um) is EXCLUDED
    rig.steps(40)
    assert rig.um == um
    assert (rig.state_um.belief, rig.state_um.in_force_um) == (before.belief, before.in_force_um)
    assert rig.state_um.suspect is not None
    assert rig.touch() is BELIEVED
    assert rig.state_um.suspect is None


@pytest.mark.parametrize("gate", [3.0, 5.0])
def test_the_gate_lies_where_it_is_stated_and_touches_within_are_no_evidence(gate: float) -> None:
    rules = replace(SLOW, start_um=3.0, noise_um=4.0, gate=gate)  # S = 25 um²
    for share, expected in ((0.99, BELIEVED), (1.0, BELIEVED), (1.01, EXCLUDED)):
        state, outcome = one(OffsetState(), 5.0 * gate * share, 0.0, rules=rules)
        assert outcome is expected
        assert state.evidence == 0.0


def test_two_touches_that_agree_are_believed_within_the_limit() -> None:
    rig = Touched(replace(SLOW, limits=Limits(20.0, 0.25)))
    rig.touch()
    rig.steps(40)
    rig.offset_um = 28.0
    assert rig.touch() is EXCLUDED
    assert rig.touch() is CONFIRMED
    assert rig.state_um.belief.offset_um == pytest.approx(28.0)
    rig.steps(100)
    assert rig.output is not None
    assert rig.output.offset_um == (-20.0,)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_touches_that_agree_on_half_as_much_again_as_the_limit_end_the_offset(sign: float) -> None:
    for offset_um, expected in ((29.9, CONFIRMED), (30.1, TOO_FAR)):
        rig = Touched(replace(SLOW, limits=Limits(20.0, 0.25)))
        rig.offset_um = sign * offset_um
        assert rig.touch() is EXCLUDED
        assert rig.touch() is expected
        assert (rig.state_um.off, rig.state_um.belief is None) in {(None, False), (TOO_FAR, True)}
    rig.offset_um = 0.0
    assert rig.touch() is TOO_FAR, "nobody has acknowledged it"
    rig.step(RequestKind.ACKNOWLEDGE)
    rig.steps(3)
    assert rig.touch() is BELIEVED


@pytest.mark.parametrize(("after_s", "expected"), [(590.0, CONFIRMED), (620.0, EXCLUDED)])
def test_a_second_touch_confirms_the_first_for_a_time(
    after_s: float, expected: TouchOutcome
) -> None:
    rig = Touched(replace(SLOW, limits=Limits(20.0, 0.25), confirm_s=600.0))
    rig.offset_um = 28.0
    rig.touch()
    rig.steps(round(after_s / 2.0), seconds=2.0)
    assert rig.touch() is expected


def test_two_wild_touches_that_do_not_agree_move_nothing_and_a_third_voids_what_was_known() -> None:
    rig = Touched()
    rig.touch()
    rig.steps(40)
    before = rig.state_um
    for wrong_um in (50.0, -40.0):
        assert rig.touch(wrong_um) is EXCLUDED
        assert rig.state_um.belief == before.belief
        assert rig.state_um.in_force_um == before.in_force_um
    assert rig.touch(90.0) is EXCLUDED
    assert rig.state_um.belief is None
    rig.steps(40)
    assert rig.state_um.in_force_um == 0.0
    assert rig.touch() is BELIEVED


def test_a_touch_that_is_believed_takes_one_that_was_excluded_back() -> None:
    rig = Touched()
    rig.touch()
    for _ in range(12):
        assert rig.touch(50.0) is EXCLUDED
        assert rig.touch() is BELIEVED
    for wrong_um in (50.0, -40.0):
        assert rig.touch(wrong_um) is EXCLUDED
    assert rig.touch() is BELIEVED
    assert rig.touch(50.0) is EXCLUDED
    assert rig.state_um.belief is not None
    assert rig.touch(-40.0) is EXCLUDED, "the third that was not taken back"
    assert rig.state_um.belief is None


def test_ten_touches_excluded_more_than_believed_end_the_offset() -> None:
    rig = Touched()
    for k in range(9):
        assert rig.touch(50.0 * (-1) ** k) is EXCLUDED
    assert rig.touch() is BELIEVED
    outcomes = [rig.touch(50.0 * (-1) ** k) for k in range(3)]
    assert outcomes == [EXCLUDED, TOO_MANY_EXCLUDED, TOO_MANY_EXCLUDED]
    rig.steps(40)
    assert rig.state_um.in_force_um == 0.0
    rig.step(RequestKind.ACKNOWLEDGE)
    rig.steps(3)
    assert [rig.touch(50.0 * (-1) ** k) for k in range(9)] == [EXCLUDED] * 9, "it counts anew"


# ---- what was in force ---------------------------------------------------------------------------


def test_a_touch_refers_to_the_correction_that_was_in_force_at_its_time() -> None:
    rig = Touched(replace(SLOW, acts=False))
    rig.warmth_k = 5.0  # the correction moves by a micrometre a second
    rig.steps(3)
    value_um, taken_s, um = rig.probed_um(), rig.time_s + 0.5, rig.um
    rig.steps(6)
    assert rig.um <= um - 6.0
    rig.step(touches=(Touch("Z_um", value_um, taken_s, 1),))
    assert rig.state_um.belief.offset_um == pytest.approx(4.0 * 25.0 / 26.0, abs=1e-12)


def test_a_touch_is_untimely_where_what_was_in_force_is_not_known() -> None:
    rig = Touched()
    assert rig.touch(time_s=rig.time_s + 1.5) is TouchOutcome.UNTIMELY
    assert rig.touch(time_s=rig.time_s - 65.0) is TouchOutcome.UNTIMELY
    assert rig.touch(time_s=rig.time_s - 0.5) is BELIEVED
    for changes in (
        {"connected": False},
        {"read_back_um": (rig.um + 2.0,)},
        {"other_compensation": None},
        {"found_um": (rig.um + 1.0,)},
    ):
        touched = Touch("Z_um", 1.0, rig.time_s + 0.5, 99)
        output = rig.step(touches=(touched,), **changes)
        assert output.touch_outcomes == (TouchOutcome.UNTIMELY,)
        rig.step()


@pytest.mark.parametrize(
    ("change", "outcome"),
    [
        ({"value_um": math.nan}, TouchOutcome.UNUSABLE),
        ({"value_um": 10_001.0}, TouchOutcome.UNUSABLE),
        ({"value_um": "1"}, TouchOutcome.UNUSABLE),
        ({"noise_um": 0.0}, TouchOutcome.UNUSABLE),
        ({"noise_um": math.nan}, TouchOutcome.UNUSABLE),
        ({"time_s": math.inf}, TouchOutcome.UNUSABLE),
        ({"output": ["Z_um"]}, TouchOutcome.UNUSABLE),
        ({"number": np.array([1, 2])}, TouchOutcome.UNUSABLE),
        ({"output": "X_um"}, TouchOutcome.UNKNOWN_OUTPUT),
        ({"number": True}, TouchOutcome.UNUSABLE),
        ({"number": 1}, TouchOutcome.REPEATED),
    ],
)
def test_a_touch_of_no_use_changes_nothing(change: dict[str, Any], outcome: TouchOutcome) -> None:
    rig = Touched()
    assert rig.touch() is BELIEVED
    before = rig.state_um.belief
    assert rig.touch(**change) is outcome
    assert rig.state_um.belief == before


def test_touches_without_a_number_are_told_apart_by_time() -> None:
    rig = Touched()
    for _ in range(3):
        assert rig.touch(number=None) is BELIEVED
    assert rig.touch(number=None, time_s=rig.time_s - 0.5) is TouchOutcome.REPEATED
    assert rig.touch(number=None, time_s=rig.time_s - 2.0) is TouchOutcome.REPEATED


def test_a_number_that_is_new_is_a_new_touch_whatever_its_time() -> None:
    rig = Touched()
    rig.steps(5)
    assert rig.touch() is BELIEVED
    assert rig.touch(time_s=rig.time_s - 3.0) is BELIEVED, "a clock that was set back"
    assert rig.touch(number=rig.number) is TouchOutcome.REPEATED


def test_a_touch_from_long_before_the_one_that_was_excluded_confirms_nothing() -> None:
    rules = replace(SLOW, limits=FREE, confirm_s=600.0)
    excluded, _ = one(OffsetState(), 34.0, 5000.0, number=2, rules=rules)
    for before_s, outcome in ((590.0, CONFIRMED), (610.0, EXCLUDED)):
        assert one(excluded, 34.0, 5000.0 - before_s, number=1, rules=rules)[1] is outcome


def test_what_is_no_touch_at_all_is_survived() -> None:
    rig = Touched()
    output = rig.step(touches=(None, "touch", 3.0, ("Z_um", 1.0, 2.0)))
    assert output.touch_outcomes == (TouchOutcome.UNUSABLE,) * 4


# ---- limits --------------------------------------------------------------------------------------


def test_an_offset_goes_as_fast_as_it_may_and_as_far_as_it_must() -> None:
    rig = Touched()
    um = rig.um
    rig.touch()
    wanted = rig.state_um.belief.offset_um
    for k in range(2, 40):
        assert rig.um == pytest.approx(max(um - 0.25 * (k - 1), um - wanted), abs=1e-12)
        rig.step()


def test_an_offset_that_does_not_act_is_only_shown() -> None:
    rig = Touched(TouchRules(limits=SLOW.limits))
    um = rig.um
    rig.touch()
    rig.steps(40)
    assert rig.um == um
    assert rig.state_um.belief.offset_um == pytest.approx(4.0 * 25.0 / 26.0)


def test_model_offset_and_trim_together_stay_within_the_total() -> None:
    rig = Touched(limits=Limits(10.0, 1.0, 12.0))
    rig.warmth_k = 5.0
    rig.steps(20)
    assert rig.um == -10.0
    rig.touch()
    rig.steps(40)
    assert rig.um == -12.0
    assert rig.output is not None
    assert rig.output.offset_um[0] < -3.0


def test_an_offset_may_go_no_further_than_the_total() -> None:
    with refused("outside_range"):
        lathe(limits=Limits(5.0, 1.0), touches={"Z_um": SLOW})
    with refused("unknown_name"):
        lathe(touches={"X_um": SLOW})
    for name in ("noise_um", "drift_um_per_root_h", "start_um", "gate"):
        with refused("outside_range"):
            replace(SLOW, **{name: 0.0})
    beyond = {"ramp_um_per_h": 1000.5, "discrepancy_um": 1000.5, "confirm_s": 86_401.0}
    for name, value in (beyond | {"oldest_s": 3601.0}).items():
        for number in (-1.0, value):
            with refused("outside_range"):
                replace(SLOW, **{name: number})


# ---- anew ----------------------------------------------------------------------------------------


def test_an_offset_starts_anew_with_the_machine_and_the_model() -> None:
    rig = Touched()
    rig.touch()
    rig.steps(40)
    assert cycle_state(rig.compensation).offsets == ()
    (kept,) = with_compensation(rig.compensation, rig.compensation, rig.state).offsets
    assert kept.belief is None
    assert kept.in_force_um == rig.state_um.in_force_um < -3.0
    rig.step(seconds=2000.0)  # longer than the model's longest gap
    assert rig.state_um.belief is None
    assert rig.state_um.in_force_um < -3.0
    rig.steps(40)
    assert rig.state_um.in_force_um == 0.0


def test_a_touch_from_before_the_model_started_anew_is_untimely() -> None:
    rig = Touched()
    touched = Touch("Z_um", rig.probed_um(), rig.time_s + 0.5, 1)
    for seconds in (2000.0, 1.0):  # the first is longer than the model's longest gap
        output = rig.step(seconds=seconds, touches=(touched,))
        assert output.touch_outcomes == (TouchOutcome.UNTIMELY,)


def test_another_clock_changes_nothing_but_the_times() -> None:
    rig, other = Touched(), Touched()
    other.state, other.time_s = shifted(other.state, 4096.0), other.time_s + 4096.0
    for _ in range(3):
        for one_rig in (rig, other):
            one_rig.touch(30.0)
            one_rig.touch()
            one_rig.steps(20)
        assert other.um == rig.um
        assert shifted(rig.state, 4096.0).offsets == other.state.offsets
        assert shifted(rig.state, 4096.0).expected == other.state.expected


# ---- touches that do not see the correction ------------------------------------------------------


@pytest.mark.parametrize(
    "seen", [lambda d, c: -(d + c), lambda _, c: 3.0 + 0.0 * c], ids=["sign", "axis"]
)
def test_touches_that_do_not_see_the_correction_end_at_zero_until_acknowledged(
    seen: Callable[[float, float], float],
) -> None:
    rig = Touched(replace(SLOW, limits=Limits(15.0, 0.25)))
    rig.seen = seen
    largest_um, outcome = 0.0, None
    for _ in range(12):
        outcome = rig.touch()
        rig.steps(90)
        largest_um = max(largest_um, abs(rig.state_um.in_force_um))
    assert outcome in {NO_EFFECT, TOO_FAR}
    assert rig.state_um.off is outcome
    assert largest_um <= 15.0
    assert rig.state_um.in_force_um == 0.0
    rig.step(seconds=2000.0)
    assert rig.state_um.off, "a model that starts anew acknowledges nothing"
    rig.seen = lambda d_um, c_um: d_um + c_um
    rig.step(RequestKind.ACKNOWLEDGE)
    rig.steps(5)
    assert rig.touch() is BELIEVED


@pytest.mark.parametrize(
    ("d_um", "r_um", "ramp_um", "evidence"),
    [
        (4.0, 8.0, 0.0, 4.0 * 6.0 / 18.0),
        (-4.0, -8.0, 0.0, 4.0 * 6.0 / 18.0),
        (4.0, 8.0, 10.0, 4.0 * 6.0 / 118.0),
        (4.0, 20.7, 0.0, 4.0 * 18.7 / 18.0),  # 2 D + gate sqrt(S) is 20.73
        (4.0, 20.8, 0.0, 0.0),  # nor does a wrong sign explain it
        (-4.0, -20.8, 0.0, 0.0),
        (4.0, 1.0, 0.0, 0.0),  # for touches that see it
        (9.0, 27.0, 0.0, 7.5),  # no touch says more
    ],
)
def test_evidence_is_the_logarithm_of_the_likelihood_ratio_within_what_a_wrong_sign_explains(
    d_um: float, r_um: float, ramp_um: float, evidence: float
) -> None:
    rules = replace(SLOW, noise_um=3.0, start_um=1000.0, drift_um_per_root_h=0.01)  # S = 18 um²
    rules = replace(rules, ramp_um_per_h=100.0 * ramp_um)
    state, _ = one(OffsetState(), 0.0, 0.0, rules=rules)
    state, _ = one(state._replace(expected_um=d_um), r_um, 36.0, rules=rules)
    assert state.evidence == pytest.approx(evidence, rel=1e-4)


@pytest.mark.parametrize("um_per_h", [2.0, 10.0, -24.0])
def test_a_machine_that_drifts_at_a_steady_rate_is_followed_as_far_as_the_limit(
    um_per_h: float,
) -> None:
    rig = Touched(replace(SLOW, limits=Limits(18.0, 0.25)))
    rig.offset_um, outcome, furthest_um = 0.0, BELIEVED, 0.0
    while rig.state_um.off is None:
        rig.offset_um += um_per_h
        rig.step(seconds=900.0)
        rig.steps(6, seconds=450.0)
        outcome = rig.touch()
        if outcome is EXCLUDED:
            outcome = rig.touch()
        rig.steps(90)
        furthest_um = rig.state_um.in_force_um or furthest_um
    assert outcome is TOO_FAR, "which says nothing against the touches"
    assert furthest_um == pytest.approx(math.copysign(18.0, -um_per_h))
    assert 27.0 < abs(rig.offset_um) < 27.0 + 3.0 * abs(um_per_h)


def test_a_wrong_sign_shows_in_touches_an_hour_apart() -> None:
    rig = Touched(replace(SLOW, limits=Limits(18.0, 0.25)))
    rig.seen = lambda d_um, c_um: -(d_um + c_um)
    for _ in range(12):
        rig.steps(8, seconds=450.0)
        while rig.touch() in {EXCLUDED, CONFIRMED}:
            rig.steps(90)
        rig.steps(90)
    assert rig.state_um.off
    assert rig.state_um.in_force_um == 0.0


Shown = Callable[["Drifting", float], float]
"""What a touch shows of a machine while an offset is in force. [µm]"""


class Drifting:
    """A machine whose model lacks something random, touched at a pace with an offset that acts."""

    def __init__(self, seed: int, pace_h: float, shown: Shown, *, again: bool) -> None:
        self.rng = random.Random(seed)  # noqa: S311 - a test that can be repeated
        self.pace_h, self.shown, self.again = pace_h, shown, again
        self.rules = TouchRules(limits=Limits(20.0, 0.1), acts=True)
        self.sigma_um, self.tau_h = self.rng.uniform(1.0, 5.0), self.rng.uniform(1.0, 12.0)
        self.lacks_um = self.mean_um = self.rng.uniform(-6.0, 6.0)
        self.state, self.touches, self.time_s = OffsetState(), 0, 0.0

    def touch(self) -> TouchOutcome:
        """Touch, once more where it was excluded, and let the offset arrive."""
        stays = math.exp(-self.pace_h / self.tau_h)
        sigma_um = self.sigma_um * math.sqrt(1.0 - stays * stays)
        moved_um = stays * (self.lacks_um - self.mean_um) + self.rng.gauss(0.0, sigma_um)
        self.lacks_um = self.mean_um + moved_um
        self.time_s += 3600.0 * self.pace_h
        for _ in range(2 if self.again else 1):
            self.touches, self.time_s = self.touches + 1, self.time_s + 10.0
            um = self.state.in_force_um
            shown_um = self.shown(self, um)
            touched = Touch("Z_um", shown_um, self.time_s, self.touches)
            self.state, outcome = touch_step(self.rules, self.state, touched, um)
            if outcome is not EXCLUDED:
                break
        um = -self.state.belief.offset_um if self.state.belief else 0.0
        self.state = self.state._replace(in_force_um=min(max(um, -20.0), 20.0))
        return outcome


def healthy(machine: Drifting, um: float) -> float:
    return machine.lacks_um + um + machine.rng.gauss(0.0, 1.0)


def chipped(machine: Drifting, um: float) -> float:
    chip_um = machine.rng.choice((-1.0, 1.0)) * machine.rng.uniform(40.0, 90.0)
    return healthy(machine, um) + (chip_um if machine.touches % 4 == 0 else 0.0)


def another_axis(seed: int) -> Shown:
    """Return touches of an axis that goes to and fro, whatever this one does."""
    rng = random.Random(1000 + seed)  # noqa: S311 - a test that can be repeated
    turn_s, most_um = 3600.0 * rng.uniform(6.0, 30.0), rng.uniform(15.0, 60.0)
    return lambda machine, _: (
        most_um * math.sin(math.tau * machine.time_s / turn_s) + machine.rng.gauss(0.0, 1.0)
    )


@pytest.mark.parametrize("again", [True, False])
@pytest.mark.parametrize("pace_h", [0.5, 1.0, 4.0])
@pytest.mark.parametrize(
    ("factor", "most"), [(-1.0, 12.0), (-3.0, 12.0), (10.0, 12.0), (1000.0, 20.0), (-1000.0, 20.0)]
)
def test_a_wrong_sign_and_another_unit_are_found_whatever_the_machine_does(
    factor: float, most: float, pace_h: float, *, again: bool
) -> None:
    ends: list[int] = []
    for seed in range(40):
        machine = Drifting(seed, pace_h, lambda m, um: factor * healthy(m, um), again=again)
        while machine.state.off is None:
            machine.touch()
            assert machine.touches < 200
        ends.append(machine.touches)
        for _ in range(3):
            machine.touch()
        assert machine.state.in_force_um == 0.0
    assert sorted(ends)[20] <= most


@pytest.mark.parametrize("at_um", [20.0, -20.0])
@pytest.mark.parametrize("factor", [-1.0, -2.0, 5.0, 8.0])
def test_an_offset_at_its_limit_that_does_harm_is_ended_by_two_touches(
    factor: float, at_um: float
) -> None:
    rules = TouchRules(limits=Limits(20.0, 0.1), acts=True, noise_um=0.1, start_um=100.0)
    known, _ = one(OffsetState(), -at_um, 0.0, rules=rules)
    ended = 0
    for lacks_um in np.linspace(-35.0, 35.0, 141).tolist():
        state = known._replace(expected_um=at_um, in_force_um=at_um)
        harms = abs(lacks_um + at_um) > abs(lacks_um)
        for number in (1, 2):
            shown_um = factor * (lacks_um + at_um)
            touched = Touch("Z_um", shown_um, 10.0 * number, number)
            state, _ = touch_step(rules, state, touched, at_um)
        ended += state.off is TOO_FAR
        assert state.off is TOO_FAR or not harms
        if factor == -1.0:  # and the harmless is left as it is
            assert harms or state.off is None
    assert 70 <= ended <= 140


@pytest.mark.parametrize("again", [True, False])
def test_another_axis_that_moves_is_found(*, again: bool) -> None:
    for seed in range(40):
        machine = Drifting(seed, 1.0, another_axis(seed), again=again)
        while machine.state.off is None:
            machine.touch()
            assert machine.touches < 200


@pytest.mark.parametrize("again", [True, False])
@pytest.mark.parametrize("pace_h", [0.5, 2.0])
def test_a_machine_that_is_well_is_never_ended_though_each_fourth_touch_shows_a_chip(
    pace_h: float, *, again: bool
) -> None:
    for seed in range(4):
        machine = Drifting(seed, pace_h, chipped, again=again)
        outcomes = [machine.touch() for _ in range(1000)]
        assert machine.state.off is None
        assert outcomes.count(BELIEVED) > 700


def test_a_real_step_after_an_offset_is_believed() -> None:
    for step_um in (-30.0, -12.0, 12.0, 24.0):
        rig = Touched(replace(SLOW, limits=Limits(20.0, 0.25)))
        rig.touch()
        rig.steps(90)
        rig.offset_um += step_um
        assert rig.touch() is EXCLUDED
        assert rig.touch() is CONFIRMED


def test_healthy_touches_of_a_year_end_nothing() -> None:
    rng = np.random.default_rng(5)
    rules = replace(SLOW, limits=FREE, start_um=500.0)
    state, offset_um, before_um = OffsetState(), 0.0, 0.0
    for k in range(8760):
        offset_um += 2.0 * rng.standard_normal()
        touched = Touch("Z_um", offset_um - before_um + rng.standard_normal(), 3600.0 * k, k)
        state, _ = touch_step(rules, state, touched, -before_um)
        before_um = state.belief.offset_um if state.belief else 0.0
        assert not state.off


def test_what_is_remembered_reaches_as_far_back_as_is_stated_and_is_nearly_what_was_in_force() -> (
    None
):
    rig = Touched(replace(SLOW, oldest_s=640.0, noise_um=0.2))
    known: list[tuple[float, float]] = []
    for k in range(1000):
        rig.warmth_k = 6.0 * math.sin(k / 150.0)  # faster than the correction may follow
        rig.step()
        known.append((rig.state.expected[0][0], rig.state.expected[0][1][0]))
    assert len(rig.state.expected) == 64
    assert max(um for _, um in known) - min(um for _, um in known) > 3.0
    before, time_s = rig.state, rig.time_s
    for k in range(400, 999, 7):
        rig.state, rig.time_s = before, time_s
        at_s, um = known[k]
        assert rig.touch(time_s=at_s + 0.25, value_um=um + 2.0) is BELIEVED
        assert rig.state_um.belief is not None
        assert rig.state_um.belief.offset_um == pytest.approx(2.0, abs=0.3)
    rig.state, rig.time_s = before, time_s
    assert rig.touch(time_s=known[300][0]) is TouchOutcome.UNTIMELY
