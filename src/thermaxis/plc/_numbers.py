"""Numbers as every dialect reads them: the same binary number comes back."""

import math
import re
import struct
import sys
from decimal import ROUND_CEILING, Context, Decimal

from thermaxis.codes import NOWHERE, Place
from thermaxis.errors import ConfigurationError

DIGITS = {True: 17, False: 9}
"""Significant digits by whether numbers are LREAL: as many as find the same binary number again.
[1]"""
SMALLEST = {True: sys.float_info.min, False: 2.0**-126}
"""Smallest number above zero that is kept with all its digits, by whether numbers are LREAL."""


def figure(value: float, digits: int = 6) -> str:
    """Return a number as a person reads it in a guide."""
    return f"{value:.{digits}g}"


def noted(value: float, digits: int = 6) -> str:
    """Return a number as a remark may have it: without a plus sign."""
    return figure(value, digits).replace("+", "")


def stored(value: float, *, double: bool, place: Place = NOWHERE) -> float:
    """Return a number as the target keeps it."""
    kind = "LREAL" if double else "REAL"
    if not math.isfinite(value):
        raise ConfigurationError("not_finite", place=place)
    try:
        kept = float(value) if double else struct.unpack("<f", struct.pack("<f", value))[0]
    except OverflowError:
        raise ConfigurationError("too_large_for_plc", value=value, kind=kind, place=place) from None
    if value != 0.0 and abs(kept) < SMALLEST[double]:
        raise ConfigurationError("too_small_for_plc", value=value, kind=kind, place=place)
    return kept


def rounded(value: float, *, double: bool) -> float:
    """Return any number, also none that is finite, as the target's arithmetic has it."""
    if double or not math.isfinite(value):
        return value
    try:
        return float(struct.unpack("<f", struct.pack("<f", value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)


def number_text(value: float, *, double: bool, place: Place = NOWHERE) -> str:
    """Return a number as text: a point in the mantissa, an exponent as in ``1.0E-06``."""
    return digits_text(stored(value, double=double, place=place), double=double)


def digits_text(kept: float, *, double: bool) -> str:
    """Return a number that the target has, with as many digits as find it again."""
    text = f"{kept:.{DIGITS[double]}G}"
    return text if "." in text else re.sub("E|$", r".0\g<0>", text, count=1)


def outward_text(bound: float, digits: int = 6) -> str:
    """Return a bound as people read it: rounded up, so that nothing that it allows passes it."""
    exact = Decimal(bound)
    if not exact:
        return "0"
    unit = Decimal(1).scaleb(exact.adjusted() + 1 - digits)
    up = exact.quantize(unit, rounding=ROUND_CEILING, context=Context(prec=60))
    text = f"{up:f}"
    return text.rstrip("0").rstrip(".") if "." in text else text
