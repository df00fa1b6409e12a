"""Settings as TOML or JSON, written by people or by this package: one reader for all of them."""

import difflib
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar, cast, get_args, get_type_hints

from thermaxis.codes import Place, printable
from thermaxis.errors import ConfigurationError
from thermaxis.files._opened import opened

if TYPE_CHECKING:
    from pydantic import ValidationError

LARGEST_TOML_BYTES = 1_000_000
"""Largest TOML file that is read. [byte]"""
LONGEST_TOML_LINE = 10_000
"""Longest line of a TOML file. [character]"""
MOST_TOML_POINTS = 100
"""Most points of a line of a TOML file: keys of thousands of parts are read for minutes. [1]"""
LONGEST_TEXT = 2000
"""Longest text. [character]"""
LARGEST_NUMBER = 1e12
"""Largest magnitude of a number. [1]"""
MOST_ENTRIES = 10_000
"""Largest number of entries of a list. [1]"""

_T = TypeVar("_T")
_UNKNOWN = ("extra_forbidden", "unexpected_keyword_argument")
_MISSING = ("missing", "missing_argument")
_CODES: Final = {
    "bool_type": "not_a_boolean",
    "dataclass_type": "not_a_table",
    "dict_type": "not_a_table",
    "enum": "unknown_choice",
    "float_type": "not_a_number",
    "int_type": "not_a_whole_number",
    "literal_error": "unknown_choice",
    "mapping_type": "not_a_table",
    "string_type": "not_a_text",
    "tuple_type": "not_a_list",
}
"""Codes of what pydantic finds wrong."""


def read_toml(path: Path | str) -> dict[str, object]:
    """Read a TOML file."""
    return parse_toml(_content(path, LARGEST_TOML_BYTES), file=str(path))


def parse_toml(content: bytes | str, *, file: str) -> dict[str, object]:
    """Return the tables of what is TOML in UTF-8; no number or key of it is absurdly long."""
    import tomllib  # noqa: PLC0415  evaluating a run without such a file does not need it

    text = content if isinstance(content, str) else _decoded(content, file)
    for number, line in enumerate(text.split("\n"), start=1):
        if len(line) > LONGEST_TOML_LINE or (
            line.count(".") > MOST_TOML_POINTS and not line.lstrip().startswith("#")
        ):
            cause = f"the line has {len(line)} characters, and {LONGEST_TOML_LINE} are the most"
            if len(line) <= LONGEST_TOML_LINE:
                cause = f"the line has more than {MOST_TOML_POINTS} points"
            raise ConfigurationError("not_toml", cause=cause, place=Place(file, line=number))
    try:
        return tomllib.loads(text)
    except RecursionError:
        cause = "nested too deeply"
    except ValueError as error:  # also of a number of thousands of digits
        cause = str(error).rstrip(".")
    raise ConfigurationError("not_toml", cause=cause, place=Place(file))


def read_json_object(path: Path | str, *, largest_bytes: int) -> dict[str, object]:
    """Read a file that holds one JSON object: no key twice, no NaN."""
    file = str(path)
    text = _decoded(_content(path, largest_bytes), file)

    def unique(pairs: list[tuple[str, object]]) -> dict[str, object]:
        table = dict(pairs)
        if len(table) < len(pairs):
            names = [name for name, _ in pairs]
            name = next(name for name in names if names.count(name) > 1)
            raise ConfigurationError("stated_twice", name=printable(name), place=Place(file))
        return table

    def no_constant(word: str) -> object:
        raise ConfigurationError("not_a_number", text=word, place=Place(file))

    try:
        table: object = json.loads(text, object_pairs_hook=unique, parse_constant=no_constant)
    except json.JSONDecodeError as error:
        place = Place(file, line=error.lineno, column=str(error.colno))
        raise ConfigurationError("not_json", cause=error.msg, place=place) from None
    except (RecursionError, ValueError):
        cause = "nested too deeply, or a number is too long"
        raise ConfigurationError("not_json", cause=cause, place=Place(file)) from None
    if not isinstance(table, dict):
        raise ConfigurationError("not_a_table", place=Place(file))
    return cast("dict[str, object]", table)


def _content(path: Path | str, largest_bytes: int) -> bytes:
    with opened(path, largest_bytes, error=ConfigurationError) as (stream, _):
        return stream.read(largest_bytes + 1)


def _decoded(content: bytes, file: str) -> str:
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ConfigurationError("not_utf8", place=Place(file)) from None


def as_table(file: Path | str, key: str, value: object) -> Mapping[str, object]:
    """Return a value that must be a table."""
    if not isinstance(value, dict):
        raise ConfigurationError("not_a_table", place=Place(str(file), key=key))
    return cast("Mapping[str, object]", value)


def unknown_key(file: Path | str, key: str, known: Iterable[str]) -> ConfigurationError:
    """Return the error for a key that no format knows; it names those that are like it."""
    name = key.rpartition(".")[2]
    return ConfigurationError(
        "unknown_key",
        name=printable(name, 80),
        known=nearest(name, known),
        place=Place(str(file), key=printable(key)),
    )


def nearest(name: str, known: Iterable[str]) -> tuple[str, ...]:
    """Return the names that are most like one, at most twelve."""
    return tuple(difflib.get_close_matches(name[:100], list(known), n=12, cutoff=0.0))


def settings_of(kind: type[_T], content: object, *, file: str, key: str = "") -> _T:
    """Return settings as a type says: a dataclass, or a mapping or tuple of them.

    No number may be a text, no key unknown; what a dataclass refuses gets file and key.
    """
    from pydantic import ConfigDict, TypeAdapter, ValidationError  # noqa: PLC0415  a tenth of a second
    from pydantic_core import to_json  # noqa: PLC0415

    _check_sizes(content, file, key)
    strict = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)
    adapter = TypeAdapter(cast("Any", tuple)[kind], config=strict)
    try:
        # An array becomes a tuple and a text a choice where they come from JSON only.
        return adapter.validate_json(to_json([content]))[0]
    except ValidationError as failure:
        raise _explained(failure, kind, file, key) from None
    except ConfigurationError as error:
        there = ".".join(part for part in (key, error.place.key) if part)
        raise error.at(error.place._replace(file=file, key=there)) from None


def _check_sizes(value: object, file: str, key: str) -> None:
    """Refuse texts, numbers and lists of a size that no settings have."""
    place = Place(file, key=printable(key))
    if isinstance(value, str):
        if len(value) > LONGEST_TEXT or not value.isprintable():
            raise ConfigurationError("not_a_line", most=LONGEST_TEXT, place=place)
    elif isinstance(value, float) and not math.isfinite(value):
        raise ConfigurationError("not_finite", place=place)
    elif isinstance(value, int | float):
        if abs(value) > LARGEST_NUMBER:
            raise ConfigurationError("magnitude_too_large", most=LARGEST_NUMBER, place=place)
    elif isinstance(value, list):
        entries = cast("list[object]", value)
        if len(entries) > MOST_ENTRIES:
            raise ConfigurationError("list_too_long", most=MOST_ENTRIES, place=place)
        for k, entry in enumerate(entries):
            _check_sizes(entry, file, f"{key}[{k}]")
    elif isinstance(value, dict):
        for name, entry in cast("dict[str, object]", value).items():
            _check_sizes(entry, file, f"{key}.{name}" if key else name)


def _explained(failure: "ValidationError", kind: object, file: str, key: str) -> ConfigurationError:
    """Return what pydantic found, an unknown key first: it may be a missing one misspelt."""
    details = failure.errors(include_url=False)
    first = next((one for one in details if one["type"] in _UNKNOWN), details[0])
    loc = first["loc"][1:]
    for part in loc:
        key += f"[{part}]" if isinstance(part, int) else f".{part}" if key else part
    place = Place(file, key=printable(key))
    if first["type"] in _UNKNOWN:
        return unknown_key(file, key, _keys(kind, loc[:-1]))
    if first["type"] in _MISSING:
        return ConfigurationError("missing_key", place=place)
    code = _CODES.get(first["type"], "impossible_value")
    text = printable(str(first["input"]), 60)
    if code == "unknown_choice":
        known = tuple(
            first.get("ctx", {})["expected"].replace("'", "").replace(" or", ",").split(", ")
        )
        return ConfigurationError("unknown_choice", name=text, known=known, place=place)
    if code in {"not_a_table", "not_a_list", "not_a_text"}:
        return ConfigurationError(code, place=place)
    return ConfigurationError(code, text=text, place=place)


def _keys(kind: Any, loc: Iterable[int | str]) -> list[str]:
    """Return the keys of the dataclass at a place of a type."""
    for part in loc:
        inside = get_args(kind)
        kind = (
            get_type_hints(kind)[str(part)] if is_dataclass(kind) else inside[isinstance(part, str)]
        )
    return [field.name for field in fields(kind) if field.init]
