import unicodedata

import numpy as np
from hypothesis import given, settings, strategies as st

from thermaxis.report import fixed
from thermaxis.report._text import (
    as_given,
    decimals_of,
    decimals_of_figures,
    plain_text,
    positions,
    two_digits,
    with_u,
)


@settings(derandomize=True)
@given(st.text(max_size=500), st.integers(8, 100))
def test_plain_text_is_one_line_of_visible_characters(text: str, limit: int) -> None:
    shown = plain_text(text, limit)
    assert len(shown) <= limit
    assert not {unicodedata.category(c) for c in shown} & {"Cc", "Cf", "Cs", "Co", "Cn"}
    assert shown == shown.strip()
    assert "  " not in shown


def test_plain_text_keeps_what_people_write() -> None:
    text = "Přejímka № 7: E↑ ≤ 12 µm, größer, Ω, 主轴"
    assert plain_text(text) == text


def test_an_override_of_the_writing_direction_is_removed() -> None:
    assert plain_text("a\u202efdp.exe\u2066\u200bb") == "afdp.exeb"


def test_a_text_that_is_too_long_ends_in_an_ellipsis() -> None:
    assert plain_text("word " * 100, 20) == "word word word word…"
    assert plain_text("x" * 5000, 20) == "x" * 19 + "…"


def test_decimals_are_those_with_which_numbers_were_written() -> None:
    for values, decimals in [
        ([1.0, -3.0], 0),
        ([0.5, 2.25], 2),
        ([0.1, 0.2, 0.1 + 0.2], 1),
        ([(5.00123 - 5.0) * 1000.0], 2),
        ([1.0 / 3.0], 6),
        ([float("nan"), 0.125], 3),
    ]:
        assert decimals_of(np.array(values)) == decimals


def test_figures_have_the_decimals_of_the_readings_and_at_most_five_digits() -> None:
    for readings, largest, decimals in [
        ([0.01], 13.43, 2),
        ([0.001], 135.2711, 2),
        ([0.000001], 0.088807, 6),
        ([1.0], 8.4, 1),
        ([0.01], 0.0, 2),
    ]:
        assert decimals_of_figures(np.array(readings), largest) == decimals


def test_a_number_has_fixed_decimals_and_zero_has_no_sign() -> None:
    for value, text in [
        (1.005, "1.00"),
        (-0.001, "0.00"),
        (-1.5, "-1.50"),
        (None, "absent"),
        (np.nan, "absent"),
    ]:
        assert fixed(value, 2) == text


def test_an_uncertainty_has_two_significant_digits() -> None:
    for value, text in [
        *((0.8, "0.80"), (0.0123, "0.012"), (1.0, "1.0"), (12.34, "12"), (0.0, "0")),
        *((0.0996, "0.10"), (109.0, "110")),
    ]:
        assert two_digits(value) == text
    for value, u, text in [
        (12.077, 1.8, "12.1 ± 1.8"),
        (20.769, 17.0, "21 ± 17"),
        (204.76, 109.0, "200 ± 110"),
        (4e-15, 4e-13, "0 ± 0"),
    ]:
        assert with_u(value, u) == text


def test_a_stated_number_keeps_its_digits() -> None:
    for value, text in [(12.0, "12"), (0.25, "0.25"), (1e-13, "1e-13")]:
        assert as_given(value) == text


def test_positions_share_the_decimals_that_they_need() -> None:
    assert positions(np.array([-20.0, 0.5, 12.125])) == ["-20.000", "0.500", "12.125"]
