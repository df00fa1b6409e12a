"""The cycle equals a vectorised simulation, and nothing that is read can stop it."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.linalg import expm

from thermaxis.compensation import (
    STATED,
    CompensationModel,
    GainPoint,
    Outcome,
    Output,
    Part,
    Quality,
    Reading,
    Section,
    ThermalState,
    initial_state,
    model_step,
)

TIME_CONSTANTS = (400.0, 3000.0, 12000.0)
GAINS = (14.0, 26.0, -18.0)


def one_part(**options: object) -> Part:
    sections = tuple(Section(g, t) for g, t in zip(GAINS, TIME_CONSTANTS, strict=True))
    return Part(**{"name": "spindle", "plus": "a", "sections": sections} | options)


def one_output(*parts: Part, **options: object) -> CompensationModel:
    return CompensationModel(outputs=(Output("Z_um", parts),), **options)


def run(
    model: CompensationModel, time_s: np.ndarray, **columns: np.ndarray
) -> tuple[np.ndarray, list[set[Outcome]]]:
    state, said, outcomes = initial_state(model), [], []
    for k, t in enumerate(time_s.tolist()):
        reading = Reading(t, {name: float(values[k]) for name, values in columns.items()})
        state, output = model_step(model, state, reading)
        said.append(output.model_um)
        outcomes.append(set(output.outcomes))
    return np.array(said), outcomes


def matrix_exponential(time_s: np.ndarray, u: np.ndarray, gains, taus) -> np.ndarray:
    """Return the lags' sum by the matrix exponential of the held system: a second way."""
    n = len(taus)
    system = np.zeros((n + 1, n + 1))
    system[:n, :n] = -np.diag(1.0 / np.array(taus))
    system[:n, n] = 1.0 / np.array(taus)
    x = np.full(n, u[0])
    y = [float(np.dot(gains, x))]
    for k in range(1, time_s.size):
        step = expm(system * (time_s[k] - time_s[k - 1]))
        x = step[:n, :n] @ x + step[:n, n] * u[k - 1]
        y.append(float(np.dot(gains, x)))
    return np.array(y)


def test_the_cycle_equals_the_matrix_exponential_at_irregular_times() -> None:
    random = np.random.default_rng(1)
    time_s = np.cumsum(random.uniform(0.1, 40.0, 400))
    u = np.cumsum(random.normal(0.0, 0.3, 400))
    model = one_output(one_part(direct_gain_um_per_k=2.5))
    said, _ = run(model, time_s, a=20.0 + u)
    rise = u - u[0]
    expected = matrix_exponential(time_s, rise, GAINS, TIME_CONSTANTS) + 2.5 * rise
    assert np.max(np.abs(said[:, 0] - expected)) < 1e-9


def test_a_step_reaches_its_closed_form() -> None:
    time_s = np.arange(0.0, 20000.0, 50.0)
    said, _ = run(one_output(one_part()), time_s, a=np.where(time_s > 0, 1.0, 0.0) + 20.0)
    since = np.maximum(time_s - 50.0, 0.0)  # the step is read at 50 s and acts from then on
    expected = sum(
        g * (1.0 - np.exp(-since / t)) for g, t in zip(GAINS, TIME_CONSTANTS, strict=True)
    )
    assert np.max(np.abs(said[:, 0] - expected)) < 1e-9


def test_half_the_cycle_time_gives_the_same_where_the_input_is_held() -> None:
    random = np.random.default_rng(2)
    slow = np.arange(0.0, 4000.0, 20.0)
    values = np.cumsum(random.normal(0.0, 0.2, slow.size)) + 25.0
    fast = np.arange(0.0, 3990.0, 10.0)
    model = one_output(one_part())
    said_slow, _ = run(model, slow, a=values)
    said_fast, _ = run(model, fast, a=np.repeat(values, 2)[: fast.size])
    assert np.max(np.abs(said_fast[::2] - said_slow[: said_fast[::2].size])) < 1e-9


def test_the_output_is_linear_in_the_input() -> None:
    random = np.random.default_rng(3)
    time_s = np.arange(0.0, 3000.0, 10.0)
    a, b = random.normal(0.0, 1.0, (2, time_s.size))
    model = one_output(one_part(direct_gain_um_per_k=-3.0, delay_s=30.0))
    said_a, said_b, both = (run(model, time_s, a=v)[0] for v in (a, b, 2.0 * a - 3.0 * b))
    assert np.max(np.abs(both - (2.0 * said_a - 3.0 * said_b))) < 1e-9


def test_a_delay_shifts_the_answer() -> None:
    time_s = np.arange(0.0, 6000.0, 10.0)
    a = 20.0 + np.sin(time_s / 300.0)
    at_once, _ = run(one_output(one_part(direct_gain_um_per_k=5.0)), time_s, a=a)
    late, _ = run(one_output(one_part(direct_gain_um_per_k=5.0, delay_s=90.0)), time_s, a=a)
    assert np.max(np.abs(late[9:] - at_once[:-9])) < 1e-9
    assert np.all(late[:9] == 0.0)


def test_a_filter_ahead_of_one_lag_is_the_known_second_order_answer() -> None:
    time_s = np.arange(0.0, 4000.0, 0.5)
    part = Part("s", "a", sections=(Section(10.0, 600.0),))
    said, _ = run(one_output(part, input_filter_s=60.0), time_s, a=np.where(time_s > 0, 1.0, 0.0))
    t = np.maximum(time_s - 0.5, 0.0)
    expected = 10.0 * (1.0 - (600.0 * np.exp(-t / 600.0) - 60.0 * np.exp(-t / 60.0)) / 540.0)
    assert np.max(np.abs(said[:, 0] - expected)) < 0.02  # the filtered input is held for 0.5 s


def test_equation_8_superposes_the_parts_with_the_gain_by_diameter() -> None:
    points = (GainPoint(0.0, 1.0), GainPoint(1500.0, 1.6), GainPoint(3000.0, 2.2))
    table = Part("table", "t", "c", 10.0, gain_by_diameter=points, tool_gain=0.9)
    model = one_output(Part("spindle", "s", "c", 4.0), table)
    state, _ = model_step(
        model, initial_state(model), Reading(0.0, {"s": 20.0, "t": 21.0, "c": 22.0})
    )
    warm = {"s": 25.0, "t": 24.0, "c": 23.0}
    for diameter, gain in ((0.0, 1.0), (750.0, 1.3), (3000.0, 2.2), (None, 0.9)):
        _, output = model_step(model, state, Reading(1.0, warm, diameter))
        assert output.model_um[0] == pytest.approx(4.0 * 4.0 + 10.0 * 2.0 * gain, abs=1e-12)
        assert output.contribution_um[0] == pytest.approx((16.0, 20.0 * gain), abs=1e-12)
        assert output.correction_um[0] == -output.model_um[0]
        assert Outcome.DIAMETER_HELD not in output.outcomes
    _, output = model_step(model, state, Reading(1.0, warm, 9000.0))
    assert output.model_um[0] == pytest.approx(16.0 + 20.0 * 2.2)
    assert Outcome.DIAMETER_HELD in output.outcomes


def test_a_failed_input_is_held_and_then_the_output_is_bad() -> None:
    model = one_output(one_part(direct_gain_um_per_k=1.0), longest_hold_s=30.0)
    state, first = model_step(model, initial_state(model), Reading(0.0, {"a": 20.0}))
    assert first.quality is Quality.GOOD
    state, output = model_step(model, state, Reading(10.0, {"a": 21.0}))
    good = output.model_um[0]
    for t, quality in ((20.0, Quality.HELD), (40.0, Quality.HELD), (41.0, Quality.BAD)):
        _, output = model_step(model, state, Reading(t, {"a": math.nan}))
        assert output.quality is quality
        assert output.model_um[0] >= good


def test_before_every_channel_was_read_the_model_waits() -> None:
    model = one_output(Part("s", "a", "b", 1.0))
    state, output = model_step(model, initial_state(model), Reading(0.0, {"a": 20.0}))
    assert output.quality is Quality.BAD
    assert Outcome.WAITING in output.outcomes
    assert output.model_um == (0.0,)
    state, output = model_step(model, state, Reading(1.0, {"b": 21.0}))
    assert Outcome.STARTED in output.outcomes
    assert output.model_um == (0.0,)


def test_a_gap_or_a_clock_that_goes_backward_starts_anew_at_the_steady_state() -> None:
    model = one_output(one_part(), longest_gap_s=600.0)
    steady = 5.0 * sum(GAINS)
    for t, why in ((-5.0, Outcome.CLOCK_BACKWARD), (700.0, Outcome.GAP)):
        state, _ = model_step(model, initial_state(model), Reading(0.0, {"a": 20.0}))
        state, output = model_step(model, state, Reading(t, {"a": 25.0}))
        assert why in output.outcomes
        assert output.model_um[0] == pytest.approx(steady)


def test_the_same_reading_twice_changes_nothing() -> None:
    model = one_output(one_part(direct_gain_um_per_k=1.0))
    state, _ = model_step(model, initial_state(model), Reading(0.0, {"a": 20.0}))
    state, once = model_step(model, state, Reading(60.0, {"a": 23.0}))
    again, twice = model_step(model, state, Reading(60.0, {"a": 23.0}))
    assert (again.sections, twice.model_um) == (state.sections, once.model_um)


def test_a_stated_reference_starts_at_its_steady_state() -> None:
    model = one_output(one_part(), reference=STATED, reference_c={"a": 20.0})
    _, output = model_step(model, initial_state(model), Reading(0.0, {"a": 22.0}))
    assert output.model_um[0] == pytest.approx(2.0 * sum(GAINS))


def test_the_noise_of_the_first_reading_is_no_warm_machine() -> None:
    model = one_output(one_part(), longest_gap_s=1e7)
    state, output = model_step(model, initial_state(model, {"a": 20.0}), Reading(0.0, {"a": 20.5}))
    assert output.model_um[0] == 0.0
    _, output = model_step(model, state, Reading(1e6, {"a": 20.5}))
    assert output.model_um[0] == pytest.approx(0.5 * sum(GAINS))


def test_leaving_the_range_of_the_training_is_said() -> None:
    model = one_output(one_part(lowest_k=-1.0, highest_k=5.0))
    state, output = model_step(model, initial_state(model), Reading(0.0, {"a": 20.0}))
    assert Outcome.OUTSIDE_VALIDITY not in output.outcomes
    _, output = model_step(model, state, Reading(1.0, {"a": 25.5}))
    assert Outcome.OUTSIDE_VALIDITY in output.outcomes


ANYTHING = st.one_of(
    st.floats(), st.integers(), st.none(), st.booleans(), st.text(max_size=3), st.just(10**400)
)


@settings(max_examples=120, deadline=None, derandomize=True)
@given(
    st.lists(
        st.tuples(ANYTHING, st.dictionaries(st.sampled_from("abc"), ANYTHING), ANYTHING),
        max_size=6,
    )
)
def test_whatever_is_read_the_cycle_returns_finite_numbers(
    readings: list[tuple[object, dict[str, object], object]],
) -> None:
    points = (GainPoint(0.0, 1.0), GainPoint(10.0, 2.0))
    model = one_output(
        one_part(minus="b", delay_s=5.0, gain_by_diameter=points),
        Part("other", "c", "", -1e5, (Section(1e5, 1e-3),)),
        input_filter_s=3.0,
    )
    state = initial_state(model)
    for time_s, values, diameter in readings:
        state, output = model_step(model, state, Reading(time_s, values, diameter))
        assert all(math.isfinite(y) for y in output.model_um)
        assert all(math.isfinite(y) for row in output.contribution_um for y in row)
        assert isinstance(state, ThermalState)


def test_the_model_does_not_start_from_a_value_that_is_too_old() -> None:
    model = one_output(Part("s", "a", "b", 1.0), longest_hold_s=60.0)
    state, _ = model_step(model, initial_state(model), Reading(0.0, {"a": 30.0}))
    state, output = model_step(model, state, Reading(1000.0, {"b": 21.0}))
    assert Outcome.WAITING in output.outcomes
    state, output = model_step(model, state, Reading(1010.0, {"a": 20.0, "b": 21.0}))
    assert Outcome.STARTED in output.outcomes
    _, output = model_step(model, state, Reading(1020.0, {"a": 20.0, "b": 21.0}))
    assert output.model_um == (0.0,)


def test_a_new_start_after_a_gap_waits_for_every_input() -> None:
    model = one_output(one_part(), longest_gap_s=600.0)
    state, _ = model_step(model, initial_state(model), Reading(0.0, {"a": 20.0}))
    state, output = model_step(model, state, Reading(5000.0, {}))
    assert (output.quality, output.model_um) == (Quality.BAD, (0.0,))
    _, output = model_step(model, state, Reading(5001.0, {"a": 20.0}))
    assert Outcome.STARTED in output.outcomes


def test_with_a_delay_long_intervals_equal_short_ones() -> None:
    model = one_output(one_part(direct_gain_um_per_k=2.0, delay_s=90.0))
    random = np.random.default_rng(5)
    coarse = np.concatenate([[0.0], np.cumsum(random.uniform(5.0, 900.0, 60))])
    fine = np.unique(np.concatenate([coarse, np.arange(0.0, coarse[-1], 7.0), coarse + 90.0]))
    values = 20.0 + np.cumsum(random.normal(0.0, 1.0, coarse.size))
    held = values[np.searchsorted(coarse, fine, side="right") - 1]
    said_coarse, _ = run(model, coarse, a=values)
    said_fine, _ = run(model, fine, a=held)
    at = np.searchsorted(fine, coarse)
    assert np.max(np.abs(said_fine[at] - said_coarse)) < 1e-9


def test_a_clock_that_stands_still_is_said_and_takes_no_memory() -> None:
    model = one_output(one_part(delay_s=600.0))
    state, _ = model_step(model, initial_state(model), Reading(0.0, {"a": 20.0}))
    for _ in range(50):
        state, output = model_step(model, state, Reading(0.0, {"a": 21.0}))
        assert Outcome.CLOCK_STILL in output.outcomes
    assert len(state.history) == 1


MODELS = (
    one_output(one_part()),
    one_output(one_part(minus="b", delay_s=30.0)),
    one_output(Part("s", "a"), Part("t", "b", sections=(Section(1.0, 5.0),))),
    CompensationModel(outputs=(Output("Z_um", (one_part(),)), Output("X_um", (one_part(),)))),
)
WRONG = st.sampled_from([math.nan, math.inf, -math.inf, 1e300, 0.0, -5.0])


@settings(max_examples=120, deadline=None, derandomize=True)
@given(st.sampled_from(MODELS), st.sampled_from(MODELS), WRONG, st.sampled_from(range(6)))
def test_a_state_of_another_model_or_of_damaged_numbers_is_survived(
    maker: CompensationModel, user: CompensationModel, wrong: float, place: int
) -> None:
    state = initial_state(maker)
    for k in range(3):
        state, _ = model_step(maker, state, Reading(10.0 * k, {"a": 20.0 + k, "b": 20.0}))
    damaged = (
        state,
        state._replace(time_s=wrong),
        state._replace(sections=(wrong,) * len(state.sections)),
        state._replace(filtered=(wrong,) * len(state.filtered)),
        state._replace(history=()),
        ThermalState(),
    )[place]
    good = True
    for k in range(3, 8):
        reading = Reading(10.0 * k, {"a": 20.0 + k, "b": 20.0})
        damaged, output = model_step(user, damaged, reading)
        assert all(math.isfinite(y) for y in output.model_um)
        good = output.quality is Quality.GOOD
    assert good


def test_a_reading_without_values_is_one_in_which_all_failed() -> None:
    model = one_output(one_part())
    state, _ = model_step(model, initial_state(model), Reading(0.0, {"a": 20.0}))
    _, output = model_step(model, state, Reading(1.0, None))
    assert output.quality is Quality.HELD


def test_parts_are_added_one_after_the_other_each_sum_rounded_as_a_plc_adds_them() -> None:
    gains = (1e5, 0.1, -1e5, 0.3, 1e-9)
    parts = [Part(f"p{k}", "a", "", gain) for k, gain in enumerate(gains)]
    model = one_output(*parts, reference="stated", reference_c={"a": 0.0})
    _, output = model_step(model, initial_state(model), Reading(0.0, {"a": 0.7}))
    one_after_the_other = 0.0
    for part in output.contribution_um[0]:
        one_after_the_other += part
    assert one_after_the_other != math.fsum(output.contribution_um[0])
    assert output.model_um == (one_after_the_other,)
