"""Text and numbers as a certificate prints them."""

import unicodedata

import numpy as np

from thermaxis.positioning import FloatArray

NOT_STATED = "not stated"
"""Printed for a field that nobody filled in."""
ABSENT = "absent"
"""Printed for a figure that does not exist in this run."""
MISSING = "missing"
"""Printed for a reading that was not taken."""

_DROPPED = {"Cf", "Cs", "Co", "Cn"}
"""Categories that show nothing or change how their neighbours show (bidirectional overrides)."""
FINEST_DECIMALS = 6
"""Readings finer than a picometre (or a millionth of an arcsecond) are round-off. [1]"""
_ROUND_OFF = 1e-9
"""What is left of a difference of two positions of some metres. [µm or arcsec]"""
_SIGNIFICANT = 5
"""Digits of the largest figure that are worth printing. [1]"""


def plain_text(text: str, limit: int = 300) -> str:
    """Return text from a file or a person as one line that only shows itself."""
    cut = text[: 4 * limit + 64]
    kept: list[str] = []
    for character in unicodedata.normalize("NFC", cut):
        category = unicodedata.category(character)
        if category[0] == "Z" or category == "Cc":
            kept.append(" ")
        elif category not in _DROPPED:
            kept.append(character)
    line = " ".join("".join(kept).split())
    if len(line) <= limit and len(cut) == len(text):
        return line
    return line[: limit - 1].rstrip() + "…"


def decimals_of(values: FloatArray, *, finest: int = FINEST_DECIMALS) -> int:
    """Return how many decimals numbers were written with."""
    known = values[~np.isnan(values)]
    for decimals in range(finest):
        if bool(np.all(np.abs(known - np.round(known, decimals)) < _ROUND_OFF)):
            return decimals
    return finest


def decimals_of_figures(readings: FloatArray, largest_figure: float) -> int:
    """Return with how many decimals figures are printed."""
    useful = FINEST_DECIMALS
    if largest_figure > 0.0:
        useful = _SIGNIFICANT - 1 - int(np.floor(np.log10(largest_figure)))
    return max(1, min(decimals_of(readings), useful))


def fixed(value: float | None, decimals: int, *, absent: str = ABSENT) -> str:
    """Return a number with a fixed number of decimals.

    Parameters
    ----------
    value : float or None
        The number; None, NaN and infinity print as `absent`. [any]
    decimals : int
        Number of decimals; -1: tens. [1]
    absent : str
        Word for a number that does not exist.

    Returns
    -------
    str
        The number; zero has no sign.
    """
    if value is None or not np.isfinite(value):
        return absent
    text = f"{round(value, decimals):.{max(0, decimals)}f}"
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text


def two_digits(value: float) -> str:
    """Return an uncertainty with two significant digits, without an exponent."""
    return fixed(value, decimals_of_u(value)) if value > _ROUND_OFF else "0"


def decimals_of_u(value: float) -> int:
    """Return the last decimal of an uncertainty, and of its value (GUM 7.2.6); -1: tens."""
    return 1 - int(f"{value:.1e}".partition("e")[2])


def with_u(value: float, u: float) -> str:
    """Return a value and its uncertainty with the same last digit."""
    return f"{fixed(value, decimals_of_u(u) if u > _ROUND_OFF else 0)} ± {two_digits(u)}"


def as_given(value: float) -> str:
    """Return a number with the digits that a person gave it, without an exponent."""
    text = f"{value:.12f}".rstrip("0").rstrip(".")
    return text if text.strip("-0.") else f"{value:g}"


def positions(target: FloatArray) -> list[str]:
    """Return target positions with the decimals that all of them need, at most four."""
    decimals = decimals_of(target, finest=4)
    return [fixed(float(value), decimals) for value in target]
