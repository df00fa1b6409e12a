"""What is said as data: a code, typed values and a place; sentences are made at the edge."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, NamedTuple, TypeAlias, final

if TYPE_CHECKING:
    from collections.abc import Mapping


class Place(NamedTuple):
    """Where something is. What does not apply is empty or None."""

    file: str = ""
    """Name of the file."""
    line: int | None = None
    """Line of a text file, from 1. [1]"""
    column: str = ""
    """Column by its heading."""
    cell: str = ""
    """Cell of a workbook, such as ``Sheet1!B7``."""
    key: str = ""
    """Key of a configuration with its tables, such as ``outputs.Z_um.limits.largest_um``."""
    channel: str = ""
    """Name of an input or output."""


NOWHERE: Final = Place()
"""No place."""


@final
@dataclass(frozen=True, slots=True)
class Message:
    """A code with its values and its place.

    Parameters
    ----------
    code : str
        Key of its sentence in every catalogue, such as ``answer-held``: kind, hyphen, code.
    values : mapping of str to number, str, Message, tuple or None
        What the sentence says, by name; the unit stands in the name.
    place : Place
        Where it is.
    """

    code: str
    values: "Mapping[str, Value]" = field(default_factory=dict[str, "Value"])
    place: Place = NOWHERE


Value: TypeAlias = str | float | Message | tuple[str | Message, ...] | None
"""What may stand in a sentence; a code or several, where the catalogue says so."""
