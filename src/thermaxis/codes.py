"""What is said as data: a code, typed values and a place; sentences are made at the edge."""

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeAlias, cast, final

if TYPE_CHECKING:
    from collections.abc import Mapping


def printable(text: str, limit: int = 120) -> str:
    """Return text from a file or a person so that a terminal shows it and does not obey it.

    Parameters
    ----------
    limit : int
        Longest result; a longer text is cut and ends in three dots. Default: what fits a line. [1]

    Returns
    -------
    str
        The text with every control character written as an escape.
    """
    shown = text
    if not text.isprintable():
        shown = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
    return shown if len(shown) <= limit else shown[: limit - 3] + "..."


class Place(NamedTuple):
    """Where something is. What does not apply is empty or None."""

    file: str = ""
    """Name of the file, or the address."""
    line: int | None = None
    """Line of a text file, from 1. [1]"""
    column: str = ""
    cell: str = ""
    """Cell of a workbook, such as ``Sheet1!B7``."""
    row: int | None = None
    """Row of a log or table in memory, from 1. [1]"""
    key: str = ""
    """What was asked for: key of a configuration with its tables, such as
    ``outputs.Z_um.limits.largest_um``, option of a command or parameter of a function."""
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


def remark(code: str, **values: Value) -> Message:
    """Return a remark about what was read: its sentence is ``remark-`` and the code."""
    return Message(f"remark-{code}", values)


def message_as_json(message: Message) -> dict[str, object]:
    """Return a message as JSON has it.

    Returns
    -------
    dict
        ``code``, ``values`` and ``place``, which has what is known of it.
    """
    place = {name: value for name, value in message.place._asdict().items() if value}
    return {"code": message.code, "values": values_as_json(message.values), "place": place}


def value_as_json(value: Value) -> object:
    """Return a value as JSON has it.

    Returns
    -------
    object
        A message as a table of ``code``, ``values`` and, where it has one, ``place``; several as a
        list; None for a number that is not finite.
    """
    if isinstance(value, Message):
        return {
            name: part for name, part in message_as_json(value).items() if part or name != "place"
        }
    if isinstance(value, tuple):
        return [value_as_json(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def values_as_json(values: "Mapping[str, Value]") -> dict[str, object]:
    """Return values by name as JSON has them: see `value_as_json`."""
    return {name: value_as_json(value) for name, value in values.items()}


def value_of_json(found: object) -> Value:
    """Return the value that `value_as_json` wrote; what is none of these as its text."""
    if found is None or isinstance(found, str | int | float):
        return found
    if isinstance(found, list):
        parts = (value_of_json(one) for one in cast("list[object]", found))
        return tuple(one if isinstance(one, str | Message) else str(one) for one in parts)
    table = cast("dict[str, object]", found) if isinstance(found, dict) else {}
    if "code" in table:
        code, values = str(table["code"]), values_of_json(table.get("values"))
        return Message(code, values, _place_of_json(table.get("place")))
    return str(cast("object", found))


def _place_of_json(found: object) -> Place:
    """Return a place as its JSON says it; what is of another kind is left out."""
    table = cast("dict[str, Any]", found) if isinstance(found, dict) else {}
    return NOWHERE._replace(
        **{name: table[name] for name in Place._fields if isinstance(table.get(name), str | int)}
    )


def values_of_json(found: object) -> "dict[str, Value]":
    """Return the values by name that `values_as_json` wrote; none where there is no table."""
    if not isinstance(found, dict):
        return {}
    table = cast("dict[object, object]", found)
    return {str(name): value_of_json(value) for name, value in table.items()}
