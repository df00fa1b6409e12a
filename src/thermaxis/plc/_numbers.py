"""Numbers as every dialect reads them: the same binary number comes back."""

import math
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
_PLAIN_FROM, _PLAIN_TO = -3, 6


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
    kept = stored(value, double=double, place=place)
    sign = "-" if math.copysign(1.0, kept) < 0.0 else ""
    if kept == 0.0:
        return sign + "0.0"
    mantissa, exponent = f"{abs(kept):.{DIGITS[double] - 1}E}".split("E")
    digits, power = mantissa.replace(".", ""), int(exponent)
    if not _PLAIN_FROM <= power <= _PLAIN_TO:
        return f"{sign}{digits[0]}.{_fraction(digits[1:])}E{power:+03d}"
    if power < 0:
        return f"{sign}0.{_fraction('0' * (-power - 1) + digits)}"
    return f"{sign}{digits[: power + 1]}.{_fraction(digits[power + 1 :])}"


def outward_text(bound: float, digits: int = 6) -> str:
    """Return a bound as people read it: rounded up, so that nothing that it allows passes it."""
    exact = Decimal(bound)
    if not exact:
        return "0"
    unit = Decimal(1).scaleb(exact.adjusted() + 1 - digits)
    up = exact.quantize(unit, rounding=ROUND_CEILING, context=Context(prec=60))
    text = f"{up:f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def _fraction(digits: str) -> str:
    return digits.rstrip("0") or "0"
