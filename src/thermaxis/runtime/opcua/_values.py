"""Values on their way to a server, in exactly the type of the node, and the names of types."""

import math
from collections.abc import Sequence
from typing import Final, cast

from asyncua import ua

from thermaxis.runtime._machine_values import WHOLE_RANGES

NOT_WRITTEN: Final = "BadRequestCancelledByClient"
"""What is said of a value that was not sent because another one of its request could not be."""
NOT_A_NUMBER: Final = "BadOutOfRange"
"""What is said of a value that is not finite or does not fit the node's type."""
WRONG_TYPE: Final = "BadTypeMismatch"
"""What is said of a node that takes no number."""
LARGEST_FLOAT: Final = 3.4028234663852886e38
"""Largest number of 32 bits. [1]"""

_RANGES: Final[dict[ua.VariantType | None, tuple[int, int]]] = {
    ua.VariantType[name]: bounds for name, bounds in WHOLE_RANGES.items()
}
_NUMBERS: Final = frozenset(
    {*_RANGES, ua.VariantType.Boolean, ua.VariantType.Float, ua.VariantType.Double}
)
_BEAT_LIMIT = 2**20
_LAST_PLAIN_TYPE = 25


def node_type(data_type: object, value: ua.DataValue) -> ua.VariantType | None:
    """Return the exact type that a node takes.

    A server refuses a Double where it keeps a Float, and an Int64 where it keeps an Int32.
    """
    if isinstance(data_type, ua.NodeId) and data_type.NamespaceIndex == 0:
        number = data_type.Identifier
        if isinstance(number, int) and 1 <= number < _LAST_PLAIN_TYPE - 1:
            return ua.VariantType(number)
    variant = value.Value
    if variant is None or variant.VariantType not in _NUMBERS:
        return None
    return variant.VariantType


def number_as(value: float, kind: ua.VariantType | None) -> ua.Variant | str:
    """Return a number in the type of a node, or the name of the status that says why not."""
    if not math.isfinite(value):
        return NOT_A_NUMBER
    if kind is ua.VariantType.Double:
        return ua.Variant(float(value), kind)
    if kind is ua.VariantType.Float:
        return ua.Variant(float(value), kind) if abs(value) <= LARGEST_FLOAT else NOT_A_NUMBER
    if kind is ua.VariantType.Boolean:
        return ua.Variant(bool(value), kind) if value in {0, 1} else NOT_A_NUMBER
    if kind is None or kind not in _RANGES:
        return WRONG_TYPE
    lowest, highest = _RANGES[kind]
    whole = round(value)
    return ua.Variant(whole, kind) if lowest <= whole <= highest else NOT_A_NUMBER


def next_beat(last: float | None, kind: str) -> int:
    """Return the heartbeat after another one."""
    if kind == "Boolean":
        return 0 if last else 1
    highest = WHOLE_RANGES[kind][1] if kind in WHOLE_RANGES else _BEAT_LIMIT
    if last is None or not 0 <= last < math.inf:
        return 1
    return int(last) + 1 if last < highest else 0


def without_status(variant: ua.Variant) -> ua.DataValue:
    """Return a value for a write request: PLCs refuse one that brings a status or a time stamp."""
    return ua.DataValue(Value=variant, StatusCode=None)


def status_name(value: ua.DataValue) -> str:
    """Return the name of the status of a value; no status means good."""
    return "Good" if value.StatusCode is None else value.StatusCode.name


def is_good(value: ua.DataValue) -> bool:
    """Return whether a value has a good status, or none."""
    return value.StatusCode is None or value.StatusCode.is_good()


def content_of(value: ua.DataValue) -> object:
    """Return what a value holds; None for nothing."""
    return None if value.Value is None else cast("object", value.Value.Value)


def plain_number(value: ua.DataValue) -> float | bool | None:
    """Return the number of a value whatever its status; None for a text, an array or nothing."""
    content = content_of(value)
    return content if isinstance(content, bool | int | float) else None


def texts(value: ua.DataValue) -> Sequence[str]:
    """Return the texts of a value that is an array of them; empty for everything else."""
    content = content_of(value)
    if not isinstance(content, list | tuple):
        return ()
    return tuple(str(word) for word in cast("Sequence[object]", content))
