"""Numbers, truth values and units as machines have them."""

from collections.abc import Mapping
from typing import Final

WHOLE_RANGES: Final[Mapping[str, tuple[int, int]]] = {
    "SByte": (-(2**7), 2**7 - 1),
    "Byte": (0, 2**8 - 1),
    "Int16": (-(2**15), 2**15 - 1),
    "UInt16": (0, 2**16 - 1),
    "Int32": (-(2**31), 2**31 - 1),
    "UInt32": (0, 2**32 - 1),
    "Int64": (-(2**63), 2**63 - 1),
    "UInt64": (0, 2**64 - 1),
}
"""Lowest and highest number of the types that have whole numbers only. [1]"""
VALUE_UNITS: Final[Mapping[str, tuple[float, float]]] = {
    "degC": (1.0, 0.0),
    "K": (1.0, -273.15),
    "degF": (1.0 / 1.8, -32.0 / 1.8),
    "bool": (1.0, 0.0),
    "um": (1.0, 0.0),
    "mm": (1.0, 0.0),
    "inch": (25.4, 0.0),
    "1": (1.0, 0.0),
}
"""Units of values on a machine, and what a value is multiplied by and then increased by to give
degrees Celsius, micrometres, millimetres, or the plain number. ``K`` is a temperature, not a
difference."""


def bits_of(kind: str) -> int:
    """Return how many bits a whole number of a type has; 0 for every other type. [1]"""
    lowest, highest = WHOLE_RANGES.get(kind, (0, 0))
    return (highest - lowest).bit_length()


def converted(value: float, unit: str) -> float:
    """Return a value of a machine in degrees Celsius, micrometres, millimetres, or as it is."""
    factor, shift = VALUE_UNITS[unit]
    return value * factor + shift


def flag_of(value: float | bool | None) -> bool | None:  # noqa: FBT001 - what a node holds
    """Return a node's number as a truth value."""
    return bool(value) if value in {0, 1} else None
