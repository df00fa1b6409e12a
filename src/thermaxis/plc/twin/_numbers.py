"""The numbers of a PLC in Python: every operation of the twin is rounded with one of these."""

import math
from collections.abc import Callable
from struct import Struct
from typing import TypeAlias

Rounding: TypeAlias = Callable[[float], float]
"""Rounds the result of one operation, an input or a constant to the target's numbers."""

_SINGLE = Struct("<f")


def to_double(value: float) -> float:
    """Return a number as LREAL holds it, which is as Python holds it."""
    return value


def to_single(value: float) -> float:
    """Return a number as REAL holds it: the nearest of binary32, of two as near the even one.

    One addition, subtraction, multiplication or division of two numbers of binary32 may be done
    in binary64 and rounded once more: 53 digits are more than twice 24 and two, so the result is
    that of binary32.

    References
    ----------
    Figueroa 1995, When is double rounding innocuous?, SIGNUM Newsletter 30(3).
    """
    try:
        rounded: float = _SINGLE.unpack(_SINGLE.pack(value))[0]
    except OverflowError:
        return math.copysign(math.inf, value)
    return rounded


def rounding(*, double: bool) -> Rounding:
    """Return what rounds to the numbers of the target."""
    return to_double if double else to_single
