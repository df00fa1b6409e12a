"""Numerator and denominator, gains and time constants, and what printed digits lose."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.polynomials import polynomial_model_of, transfer_function_of
from tests.printed_digits import (
    PAPER_SPINDLE,
    PAPER_TABLE,
    PrintedTransferFunction,
    rounding_loss,
)
from tests.refusals import refused
from thermaxis.thermal import (
    ModalPart,
    ThermalModel,
    TransferFunction,
    equivalent_part,
    modal_form,
    modal_part,
    simulate_modal,
    simulate_polynomial,
    simulate_transfer_function,
    thermal_model_of,
)

EPS1, EPS2 = PAPER_SPINDLE.transfer_function, PAPER_TABLE.transfer_function


def printed(tf: TransferFunction, decimals: int) -> PrintedTransferFunction:
    """Return a transfer function as it reads with so many decimals; zeros and b_0 are exact."""
    a, b = tf.numerator, tf.denominator
    return PrintedTransferFunction(
        TransferFunction(np.round(a, decimals), np.round(b, decimals)),
        tuple(None if value == 0.0 else decimals for value in a),
        tuple(None if value == 0.0 or i == 0 else decimals for i, value in enumerate(b)),
    )


STEPS = (
    (
        EPS1,
        (10.0122, 8.809832, 7.553251, 7.894975, 8.049582, 8.000135, 8.002109),
        (8.766268, 15.342284, 32.504411, 37.976811, 38.010533),
    ),
    (
        EPS2,
        (-82.41672, -53.187912, -25.774950, -48.892737, -53.258408, -41.112506, -43.417489),
        (-45.416902, -45.048679, -43.137096, -37.829563, -33.454479),
    ),
)


def by_hand(a: list[float], b: list[float], u: np.ndarray) -> np.ndarray:
    """Equation (3), written out."""
    y = np.zeros(u.size)
    for k in range(u.size):
        inputs = sum(a[i] * u[k - i] for i in range(len(a)) if k >= i)
        outputs = sum(b[i] * y[k - i] for i in range(1, len(b)) if k >= i)
        y[k] = (inputs - outputs) / b[0]
    return y


def test_the_step_responses_of_the_paper_follow_its_printed_coefficients() -> None:
    for tf, first, late in STEPS:
        y = simulate_transfer_function(tf, np.ones(28801))
        np.testing.assert_allclose(y[:7], first, atol=6e-7)
        np.testing.assert_allclose(y[[60, 600, 3600, 14400, 28800]], late, atol=6e-7)


def test_the_difference_equation_holds_for_any_b_0_and_goes_on_from_any_row() -> None:
    a, b = [1.0, 2.0, 3.0, -1.0], [2.0, -1.0, 0.3]
    u = np.random.default_rng(1).normal(size=40)
    tf = TransferFunction(np.array(a), np.array(b))
    y = simulate_transfer_function(tf, u)
    np.testing.assert_allclose(y, by_hand(a, b, u), atol=1e-13)
    on = simulate_transfer_function(tf, u[10:], past_u=u[9::-1], past_y=y[9::-1])
    np.testing.assert_allclose(on, y[10:], atol=1e-13)


def test_poles_zeros_and_gains_of_the_paper_are_those_of_the_reference() -> None:
    assert EPS1.dc_gain == pytest.approx(38.0106, abs=5e-5)
    assert EPS2.dc_gain == pytest.approx(-27.5714, abs=5e-5)
    assert EPS1.poles[0].real == pytest.approx(0.99952841, abs=5e-9)
    assert EPS2.poles[0].real == pytest.approx(0.99996139, abs=5e-9)
    assert EPS1.time_constants_s(1.0)[0] == pytest.approx(2119.99, abs=5e-3)
    assert EPS2.time_constants_s(1.0)[0] == pytest.approx(25_899.49, abs=5e-3)
    np.testing.assert_allclose(np.abs(EPS1.poles[1:]), 0.3767, atol=5e-5)
    np.testing.assert_allclose(np.abs(EPS2.poles[1:]), 0.6770, atol=5e-5)
    assert EPS1.zeros[0].real == pytest.approx(0.99773733, abs=5e-9)
    assert EPS2.zeros[0].real == pytest.approx(0.99997658, abs=5e-9)
    assert list(EPS1.zeros[1:]) == [0.0, 0.0]
    assert EPS1.stable
    assert EPS2.stable


def test_the_equivalents_of_the_paper_settle_onto_it() -> None:
    for tf, direct, gain, tau, after_10, after_20 in (
        (EPS1, 7.9126, 30.0980, 2119.99, 0.00015, 8e-9),
        (EPS2, -45.4590, 17.8876, 25_899.5, 0.45, 0.011),
    ):
        form = modal_form(tf, 1.0)
        part = modal_part(form, "u")
        # the reference lets a lag see the present input; ours sees the one before
        pole = np.exp(-1.0 / part.time_constants_s[0])
        assert part.gains[0] / pole == pytest.approx(gain, abs=6e-5)
        assert part.dc_gain - part.gains[0] / pole == pytest.approx(direct, abs=6e-5)
        assert part.time_constants_s[0] == pytest.approx(tau, abs=0.05)
        assert len(form.other_modes) == 1
        assert form.other_modes[0].pair
        step = simulate_transfer_function(tf, np.ones(60))
        lag = 1.0 - pole ** np.arange(60)
        rest = step - part.direct_gain - part.gains[0] * lag
        assert abs(rest[10]) == pytest.approx(after_10, rel=0.05)
        assert np.max(np.abs(rest[20:25])) == pytest.approx(after_20, rel=0.15)


def test_the_loss_by_printed_digits_is_that_of_the_reference() -> None:
    one, two = rounding_loss(PAPER_SPINDLE), rounding_loss(PAPER_TABLE)
    np.testing.assert_allclose(one.dc_gain_between, (37.907, 38.115), atol=6e-4)
    np.testing.assert_allclose(two.dc_gain_between, (-35.273, -22.588), atol=6e-4)
    np.testing.assert_allclose(one.time_constant_rows_between, (2114.7, 2125.3), atol=0.06)
    np.testing.assert_allclose(two.time_constant_rows_between, (21_329, 32_963), atol=0.6)
    assert one.dc_gain_relative_std == pytest.approx(0.00085, abs=1e-5)
    assert one.time_constant_relative_std == pytest.approx(0.00084, abs=1e-5)
    assert two.dc_gain_relative_std == pytest.approx(0.073, abs=1e-3)
    assert two.time_constant_relative_std == pytest.approx(0.073, abs=1e-3)
    assert one.unstable_share == two.unstable_share == 0.0
    assert one.decimals_for_percent == pytest.approx(5.4, abs=0.05)
    assert two.decimals_for_percent == pytest.approx(6.3, abs=0.05)


def test_the_disease_of_printed_digits_grows_with_the_sample_rate() -> None:
    part = ModalPart("u", 0.0, [14.0, 26.0, -18.0], [400.0, 3000.0, 12_000.0])
    for sample_time_s, sum_b, decimals, unstable in (
        *((1.0, 6.9e-11, 12.3, 1.0), (10.0, 6.8e-8, 9.3, 0.79), (60.0, 1.4e-5, 7.0, 0.02)),
    ):
        tf = transfer_function_of(part, sample_time_s)
        assert np.sum(tf.denominator) == pytest.approx(sum_b, rel=0.02)
        fine, coarse = rounding_loss(printed(tf, 12)), rounding_loss(printed(tf, 5))
        assert fine.decimals_for_percent == pytest.approx(decimals, abs=0.06)
        assert coarse.unstable_share == pytest.approx(unstable, abs=0.01)
        assert coarse.time_constant_rows_between[1] == np.inf
        assert tf.dc_gain == pytest.approx(22.0, rel=3e-6)


taus = st.lists(st.floats(20.0, 20_000.0), min_size=0, max_size=3)
gains = st.floats(-50.0, 50.0)


@settings(max_examples=30, deadline=None)
@given(taus, st.data())
def test_sections_come_back_from_their_polynomials(tau: list[float], data: st.DataObject) -> None:
    tau = sorted(tau, reverse=True)
    for first, second in pairwise(tau):
        if second > 0.8 * first:
            return
    size = len(tau)
    c = [
        g if abs(g) > 0.1 else 1.0 for g in data.draw(st.lists(gains, min_size=size, max_size=size))
    ]
    part = ModalPart("u", data.draw(gains), np.array(c), np.array(tau), 30.0)
    back = equivalent_part(transfer_function_of(part, 10.0), 10.0, "u")
    np.testing.assert_allclose(back.time_constants_s, tau, rtol=1e-4)
    np.testing.assert_allclose(back.gains, c, rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(back.direct_gain, part.direct_gain, atol=1e-9)
    if part.direct_gain != 0.0:
        assert back.delay_s == 30.0


def test_a_model_does_the_same_as_sections_and_as_polynomials() -> None:
    model = ThermalModel(
        (
            ModalPart("a", 3.0, [14.0, 26.0], [400.0, 3000.0]),
            ModalPart("b", 0.0, [12.0], [900.0], 20.0),
        ),
        1.5,
    )
    u = np.cumsum(np.random.default_rng(2).normal(size=(500, 2)), axis=0) * 0.1 + 2.0
    polynomials = polynomial_model_of(model, 10.0)
    wanted = simulate_modal(model, 10.0, u)
    np.testing.assert_allclose(simulate_polynomial(polynomials, u), wanted, atol=1e-9)
    back = thermal_model_of(polynomials)
    np.testing.assert_allclose(simulate_modal(back, 10.0, u), wanted, atol=1e-9)


def test_three_slow_poles_at_one_second_keep_their_digits() -> None:
    model = ThermalModel((ModalPart("a", 0.0, [14.0, 26.0, -18.0], [400.0, 3000.0, 12_000.0]),))
    u = np.repeat(np.random.default_rng(3).uniform(0, 15, 8), 1800)[:, None]
    wanted = simulate_modal(model, 1.0, u)
    polynomials = polynomial_model_of(model, 1.0)
    # what remains is the rounding of the coefficients themselves, sum of b = 7e-11
    np.testing.assert_allclose(simulate_polynomial(polynomials, u), wanted, rtol=1e-4, atol=1e-3)


def test_late_gains_negative_poles_and_delays_are_reported_as_such() -> None:
    tf = TransferFunction(np.array([0.0, 0.0, 1.0, 2.0, 3.0]), np.array([1.0, 0.5]))
    form = modal_form(tf, 5.0)
    assert form.delay_rows == 2
    assert form.late_gains.size == 1
    assert form.other_modes[0].pole == -0.5
    assert form.dc_gain == pytest.approx(4.0)
    u = np.random.default_rng(4).normal(size=50)
    impulse = simulate_transfer_function(tf, np.eye(1, 50)[0])
    np.testing.assert_allclose(
        np.convolve(impulse, u)[:50], simulate_transfer_function(tf, u), atol=1e-12
    )


def test_what_has_no_equivalent_or_defines_no_output_is_refused() -> None:
    one = np.ones(1)
    for b, code in (
        ([1.0, -1.0], "pole_at_one"),
        ([1.0, -1.8, 0.81], "poles_coincide"),
        ([1.0, -1.01], "pole_unstable"),
        ([1.0, -1.6, 0.8], "mode_no_lag"),  # a pair that falls to 1/e in 9 rows
        ([1.0, 0.9], "mode_no_lag"),
        ([1.0, 0.71], None),  # 1/e in 2.9 rows
    ):
        tf = TransferFunction(one, np.array(b))
        if code is None:
            assert equivalent_part(tf, 1.0, "u").dc_gain == pytest.approx(tf.dc_gain)
            continue
        with refused(code):
            equivalent_part(tf, 1.0, "u")
    with refused("mode_no_lag", channel="u"):
        equivalent_part(TransferFunction(np.ones(7), np.array([1.0, -0.9])), 1.0, "u")
    for b, code in (
        *(([0.0, 1.0], "leading_coefficient_zero"), ([np.nan], "not_finite")),
        ([[1.0]], "wrong_shape"),
    ):
        with refused(code, key="denominator"):
            TransferFunction(one, np.array(b))
