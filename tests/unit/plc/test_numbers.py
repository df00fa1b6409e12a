"""Numbers as text come back as the same binary number."""

import re
import struct
from fractions import Fraction

from hypothesis import given, strategies as st

from tests.refusals import refused
from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError
from thermaxis.plc._numbers import number_text, outward_text, stored

FORM = re.compile(r"-?[0-9]+\.[0-9]+(E[+-][0-9]{2,3})?")


def bits(value: float, *, double: bool) -> bytes:
    return struct.pack("<d" if double else "<f", value)


@given(st.floats(1e-9, 1e9))
def test_a_bound_is_said_rounded_outward_in_six_digits(bound: float) -> None:
    text = outward_text(bound)
    assert bound <= Fraction(text) <= bound * (1.0 + 1.1e-5)
    digits = text.replace(".", "").strip("0")
    assert len(digits) <= 6
    assert "E" not in text.upper()


def test_a_bound_that_is_short_keeps_its_digits() -> None:
    assert [outward_text(b) for b in (0.25, 280.0, 0.0, 1.50000151e-4)] == [
        "0.25",
        "280",
        "0",
        "0.000150001",
    ]


@given(st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=False))
def test_an_lreal_comes_back_with_every_bit(value: float) -> None:
    text = number_text(value, double=True)
    assert FORM.fullmatch(text)
    assert bits(float(text), double=True) == bits(value, double=True)


@given(st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=False, width=32))
def test_a_real_comes_back_with_every_bit(value: float) -> None:
    text = number_text(value, double=False)
    assert FORM.fullmatch(text)
    assert bits(float(text), double=False) == bits(value, double=False)


@given(st.floats(min_value=-1e30, max_value=1e30).filter(lambda x: abs(x) > 1e-30))
def test_a_double_is_rounded_to_real_once_and_to_the_nearest(value: float) -> None:
    kept = float(number_text(value, double=False))
    nearest = struct.unpack("<f", struct.pack("<f", value))[0]
    assert bits(kept, double=False) == bits(nearest, double=False)
    assert stored(value, double=False) == nearest


@given(st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=False))
def test_no_more_digits_are_printed_than_the_type_has(value: float) -> None:
    for double, most in ((True, 17), (False, 9)):
        try:
            text = number_text(value, double=double)
        except ConfigurationError:
            continue
        digits = text.partition("E")[0].replace("-", "").replace(".", "")
        assert len(digits.strip("0")) <= most


def test_numbers_have_a_point_and_an_exponent_of_two_digits() -> None:
    for value, lreal, real in [
        (0.0, "0.0", "0.0"),
        (-0.0, "-0.0", "-0.0"),
        (1.0, "1.0", "1.0"),
        (-2.5, "-2.5", "-2.5"),
        (60.0, "60.0", "60.0"),
        (1e-6, "9.9999999999999995E-07", "9.99999997E-07"),
        (0.1, "0.10000000000000001", "0.100000001"),
        (0.001, "0.001", "0.00100000005"),
        (2.0**-20, "9.5367431640625E-07", "9.53674316E-07"),
        (1e6, "1000000.0", "1000000.0"),
        (123456.75, "123456.75", "123456.75"),
        (1e7, "10000000.0", "10000000.0"),
        (1e17, "1.0E+17", "9.99999984E+16"),
        (2.0**100, "1.2676506002282294E+30", "1.2676506E+30"),
    ]:
        assert number_text(value, double=True) == lreal
        assert number_text(value, double=False) == real


def test_what_is_no_number_is_refused() -> None:
    for double in [True, False]:
        for value in [float("nan"), float("inf"), -float("inf")]:
            with refused("not_finite", key="here"):
                number_text(value, double=double, place=Place(key="here"))


def test_a_number_that_would_lose_digits_or_vanish_is_refused() -> None:
    for value, double in [
        (5e-324, True),
        (2.2e-308, True),
        (-1e-310, True),
        (1e-45, False),
        (1e-300, False),
    ]:
        with refused("too_small_for_plc"):
            number_text(value, double=double)


def test_a_number_beyond_real_is_refused_and_lreal_is_offered() -> None:
    with refused("too_large_for_plc"):
        number_text(1e39, double=False)
    assert number_text(1e39, double=True) == "9.9999999999999994E+38"


def test_the_largest_and_the_smallest_numbers_of_both_types_are_kept() -> None:
    for value in (1.7976931348623157e308, 2.2250738585072014e-308):
        assert float(number_text(value, double=True)) == value
    for value in (3.4028234663852886e38, 2.0**-126):
        assert stored(float(number_text(value, double=False)), double=False) == value
