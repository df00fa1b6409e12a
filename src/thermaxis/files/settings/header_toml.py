"""Fields of the certificate's head, and the file that states them."""

import datetime as dt
import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import final

from thermaxis.codes import Place, printable
from thermaxis.errors import ConfigurationError
from thermaxis.files.settings._moments import day_of, duration_of, moment_of
from thermaxis.files.settings._reading import as_table, read_toml, unknown_key
from thermaxis.quantities import AxisKind

LONGEST_TEXT = 300
"""Longest value of a field. [1]"""
LONGEST_COMMENT = 2000
"""Longest comment. [1]"""
NORMALISED = "normalised_to_20_c"
"""Key under which a reader says whether the instrument has reduced the deviations to 20 °C."""


class Takes(StrEnum):
    """What a field takes, beyond texts of a sensible length."""

    ANYTHING = "anything"
    SIZE = "size"
    """A number that is never below zero, or a text."""
    DAY = "day"
    MOMENT = "moment"
    """A day, or a day and a time."""
    COUNTRY = "country"
    """Two letters of ISO 3166-1."""


@final
@dataclass(frozen=True, slots=True)
class HeaderField:
    """One field of the head."""

    key: str
    """Its name in `PositioningReport.header`."""
    name: str
    """Its key in the group's table of the file."""
    label: str
    """What the certificate calls it."""
    unit: str = ""
    """Unit that is printed behind the value."""
    only: AxisKind | None = None
    """Kind of axis that has it; None for both."""
    in_file: str = ""
    """Key under which a measurement file may state it as a text with its unit."""
    takes: Takes = Takes.ANYTHING
    place: str = ""
    """Table and key of the file, such as ``machine.name``."""
    needed: bool = False
    """Whether a certificate without it is a draft."""


@final
@dataclass(frozen=True, slots=True)
class HeaderGroup:
    """Fields that stand together."""

    name: str
    """Name of its table in the file."""
    title: str
    fields: tuple[HeaderField, ...]


def _groups() -> Iterator[HeaderGroup]:
    """Yield the groups of ``header_fields.toml``."""
    page = (files("thermaxis.files.settings") / "header_fields.toml").read_text("utf-8")
    for name, group in tomllib.loads(page).items():
        fields = [
            HeaderField(
                key=one.get("key", field),
                name=field,
                label=one["label"],
                unit=one.get("unit", ""),
                only=AxisKind(one["only"]) if "only" in one else None,
                in_file=one.get("in_file", ""),
                takes=Takes(one.get("takes", "anything")),
                place=f"{name}.{field}",
                needed=one.get("needed", False),
            )
            for field, one in group["fields"].items()
        ]
        yield HeaderGroup(name, group["title"], tuple(fields))


HEADER_GROUPS: tuple[HeaderGroup, ...] = tuple(_groups())
"""All fields that can be stated, in the order in which the certificate prints them."""

HEADER_FIELDS: Mapping[str, HeaderField] = MappingProxyType(
    {field.key: field for group in HEADER_GROUPS for field in group.fields}
)
"""All fields by their key."""


def _text_of(value: object, field: HeaderField, place: Place) -> str:
    """Return a value as text; the kinds that TOML knows and a field takes."""
    match value:
        case bool() if not field.unit:
            text = "yes" if value else "no"
        case int() | float() if not isinstance(value, bool) and math.isfinite(value):
            text = repr(value)
        case dt.datetime() if not field.unit:
            text = value.isoformat(sep=" ")
        case dt.date() | dt.time() if not field.unit:
            text = value.isoformat()
        case str():
            text = value.strip()
        case _:
            raise ConfigurationError("impossible_value", text=printable(str(value)), place=place)
    longest = LONGEST_COMMENT if field.key == "comments" else LONGEST_TEXT
    if len(text) > longest:
        characters = len(text)
        raise ConfigurationError("text_too_long", characters=characters, most=longest, place=place)
    if text:
        _check_sense(text, field, place)
    return text


def _check_sense(text: str, field: HeaderField, place: Place) -> None:
    """Refuse a value that its field cannot have."""
    if field.takes is Takes.SIZE and (number_of(text) or 0.0) < 0.0:
        raise ConfigurationError("negative", value=float(text), place=place)
    if field.takes is Takes.DAY and not _is_day(text):
        raise ConfigurationError("not_a_date", text=text, place=place)
    if field.takes is Takes.MOMENT and not _is_day(text) and moment_of(text) is None:
        raise ConfigurationError("not_a_moment", text=text, place=place)
    if field.takes is Takes.COUNTRY and not re.fullmatch("[A-Z]{2}", text):
        raise ConfigurationError("not_a_country", text=text, place=place)


def number_of(text: str) -> float | None:
    """Return the number that a text is; None if it is another text."""
    try:
        return float(text)
    except ValueError:
        return None


def _is_day(text: str) -> bool:
    return len(text) == 10 and day_of(text) is not None


def _ends_before_start(header: Mapping[str, str]) -> bool:
    start, end = header.get("start", ""), header.get("end", "")
    moments, days = (moment_of(start), moment_of(end)), (day_of(start), day_of(end))
    if None not in moments:
        return (duration_of(*moments) or 0.0) < 0.0
    return days[0] is not None and days[1] is not None and days[1] < days[0]


def read_header(path: Path, *, kind: AxisKind | None = None) -> Mapping[str, str]:
    """Read a file with fields of the certificate's head.

    Parameters
    ----------
    path : Path
        TOML with a table for each group, such as ``[machine]`` with ``name = "..."``.
    kind : AxisKind, optional
        Kind of the axis; a field that only the other kind has is an error. Default: both kinds.

    Returns
    -------
    Mapping
        Text by the key of the field; numbers are in the unit that the key names. An empty text
        counts as not stated and is left out.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, a table or key is unknown or of the other kind of axis, a value
        is of a wrong kind, negative where it is a size, no date or country where it is one, or too
        long, or the end lies before the start.
    """
    file = str(path)
    groups = {group.name: group for group in HEADER_GROUPS}
    header: dict[str, str] = {}
    for name, value in read_toml(path).items():
        if name not in groups:
            raise unknown_key(file, name, groups)
        fields = {field.name: field for field in groups[name].fields}
        for key, entry in as_table(file, name, value).items():
            place = Place(file, key=f"{name}.{key}")
            if key not in fields:
                raise unknown_key(file, place.key, fields)
            if kind is not None and fields[key].only not in (None, kind):
                raise ConfigurationError("other_kind_of_axis", kind=kind, place=place)
            text = _text_of(entry, fields[key], place)
            if text:
                header[fields[key].key] = text
    if _ends_before_start(header):
        raise ConfigurationError("end_before_start", file=file, key="time.end")
    return MappingProxyType(header)
