"""The identified model of one displacement."""

import numpy as np
import pytest

from tests.refusals import refused
from thermaxis.thermal import ModalPart, ThermalModel, simulate_modal, step_response

MODEL = ThermalModel(
    (
        ModalPart("spindle", 2.0, np.array([14.0, -6.0]), np.array([400.0, 9000.0])),
        ModalPart("table", 0.0, np.array([20.0]), np.array([3000.0]), delay_s=90.0),
    ),
    offset_um=1.5,
)


def _by_loop(model: ThermalModel, step_s: float, u: np.ndarray) -> np.ndarray:
    """Simulate row by row, as the machine's cycle does."""
    y = np.full(u.shape[0], model.offset_um)
    for i, part in enumerate(model.parts):
        late = round(part.delay_s / step_s)
        states = np.full(part.gains.size, u[0, i])
        for k in range(u.shape[0]):
            if k > 0:
                previous = u[max(k - 1 - late, 0), i]
                alpha = 1.0 - np.exp(-step_s / part.time_constants_s)
                states = states + alpha * (previous - states)
            y[k] += part.direct_gain * u[max(k - late, 0), i] + part.gains @ states
    return y


def test_the_vectorised_simulation_equals_the_recursion_row_by_row():
    u = np.cumsum(np.random.default_rng(1).normal(size=(300, 2)), axis=0)
    assert simulate_modal(MODEL, 10.0, u) == pytest.approx(_by_loop(MODEL, 10.0, u), abs=1e-10)


def test_a_constant_input_gives_the_dc_gain_at_once():
    y = simulate_modal(MODEL, 10.0, np.tile([2.0, 3.0], (50, 1)))
    assert y == pytest.approx(np.full(50, 1.5 + 2.0 * 10.0 + 3.0 * 20.0))


def test_a_step_response_is_a_step_simulated_waits_for_the_delay_and_ends_at_the_dc_gain():
    u = np.zeros((2000, 2))
    u[1:, 0] = 1.0
    y = simulate_modal(MODEL, 10.0, u)
    times = 10.0 * np.arange(1999)
    assert y[1:] - 1.5 == pytest.approx(step_response(MODEL, times)[:, 0], abs=1e-10)
    response = step_response(MODEL, np.array([0.0, 89.0, 1e7]))
    assert response[:2, 1].tolist() == [0.0, 0.0]
    assert response[2] == pytest.approx([part.dc_gain for part in MODEL.parts])


def test_a_free_start_fades_with_the_time_constants():
    u = np.zeros((1000, 2))
    y = simulate_modal(MODEL, 10.0, u, [np.array([1.0, 0.0]), np.array([0.0])])
    assert y - 1.5 == pytest.approx(14.0 * np.exp(-10.0 * np.arange(1000) / 400.0), abs=1e-9)


def test_the_sample_time_does_not_change_what_a_held_input_does():
    u = np.repeat(np.random.default_rng(2).normal(size=(40, 2)), 6, axis=0)
    fine = simulate_modal(MODEL, 15.0, u)
    assert simulate_modal(MODEL, 90.0, u[::6]) == pytest.approx(fine[::6], abs=1e-9)


def test_a_part_that_cannot_be_is_refused():
    for change, says in (
        ({"gains": np.zeros(2)}, "wrong_shape"),
        ({"time_constants_s": np.array([-1.0])}, "not_positive"),
        ({"direct_gain": float("nan")}, "not_finite"),
        ({"delay_s": -1.0}, "negative"),
    ):
        whole = {
            "input_name": "spindle",
            "direct_gain": 0.0,
            "gains": np.ones(1),
            "time_constants_s": np.ones(1),
        }
        with refused(says):
            ModalPart(**(whole | change))


def test_inputs_and_states_that_do_not_fit_the_model_are_refused():
    for step_s, u, says in (
        (0.0, np.zeros((5, 2)), "not_positive"),
        (1.0, np.zeros((5, 3)), "wrong_shape"),
        (1.0, np.full((5, 2), np.nan), "input_missing"),
    ):
        with refused(says):
            simulate_modal(MODEL, step_s, u)
    with refused("wrong_shape", key="initial_state"):
        simulate_modal(MODEL, 1.0, np.zeros((5, 2)), [np.zeros(1), np.zeros(1)])
