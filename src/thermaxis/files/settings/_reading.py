"""Settings as TOML or JSON, written by people or by this package: one reader for all of them."""

import json
import math
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TypeVar, cast

from thermaxis.codes import Message, Place, printable
from thermaxis.errors import ConfigurationError
from thermaxis.files._opened import opened
from thermaxis.files.settings._adapter import adapter_of
from thermaxis.files.settings._problems import DEEP, placed, problem, refuse, unknown

LARGEST_TOML_BYTES = 1_000_000
"""Largest TOML file that is read. [byte]"""
LONGEST_TOML_LINE = 10_000
"""Longest line of a TOML file. [character]"""
MOST_TOML_POINTS = 100
"""Most points of a line beside those of numbers: keys of thousands of parts take minutes. [1]"""
_NUMBER = re.compile(r"(?<!\d)\d++\.\d")
LONGEST_TEXT = 2000
"""Longest text. [character]"""
LARGEST_NUMBER = 1e12
"""Largest magnitude of a number. [1]"""
MOST_ENTRIES = 10_000
"""Largest number of entries of a list. [1]"""

_T = TypeVar("_T")


def read_toml(path: Path | str) -> dict[str, object]:
    """Read a TOML file."""
    return parse_toml(_content(path, LARGEST_TOML_BYTES), file=str(path))


def parse_toml(content: bytes | str, *, file: str) -> dict[str, object]:
    """Return the tables of what is TOML in UTF-8; no number or key of it is absurdly long."""
    import tomllib  # noqa: PLC0415  evaluating a run without such a file does not need it

    text = content if isinstance(content, str) else _decoded(content, file)
    for number, line in enumerate(text.split("\n"), start=1):
        if len(line) > LONGEST_TOML_LINE or (
            line.count(".") > MOST_TOML_POINTS
            and line.count(".") - len(_NUMBER.findall(line)) > MOST_TOML_POINTS
            and not line.lstrip().startswith("#")
        ):
            cause = f"the line has {len(line)} characters, and {LONGEST_TOML_LINE} are the most"
            if len(line) <= LONGEST_TOML_LINE:
                cause = f"the line has more than {MOST_TOML_POINTS} points beside those of numbers"
            raise ConfigurationError("not_toml", cause=cause, file=file, line=number)
    try:
        return tomllib.loads(text)
    except RecursionError:
        cause = DEEP
    except ValueError as error:  # also of a number of thousands of digits
        cause = str(error).rstrip(".")
    raise ConfigurationError("not_toml", cause=cause, file=file)


def read_json_object(path: Path | str, *, largest_bytes: int) -> dict[str, object]:
    """Read a file that holds one JSON object."""
    file = str(path)
    return parse_json_object(_decoded(_content(path, largest_bytes), file), file=file)


def parse_json_object(text: str, *, file: str) -> dict[str, object]:
    """Return the one JSON object of a text: no key twice, no NaN."""

    def unique(pairs: list[tuple[str, object]]) -> dict[str, object]:
        table = dict(pairs)
        if len(table) < len(pairs):
            names = [name for name, _ in pairs]
            name = next(name for name in names if names.count(name) > 1)
            raise ConfigurationError("stated_twice", name=printable(name), file=file)
        return table

    def no_constant(word: str) -> object:
        raise ConfigurationError("not_a_number", text=word, file=file)

    try:
        table: object = json.loads(text, object_pairs_hook=unique, parse_constant=no_constant)
    except json.JSONDecodeError as error:
        raise ConfigurationError(
            "not_json", cause=error.msg, file=file, line=error.lineno, column=str(error.colno)
        ) from None
    except (RecursionError, ValueError):
        cause = "nested too deeply, or a number is too long"
        raise ConfigurationError("not_json", cause=cause, file=file) from None
    if not isinstance(table, dict):
        raise ConfigurationError("not_a_table", file=file)
    return cast("dict[str, object]", table)


def _content(path: Path | str, largest_bytes: int) -> bytes:
    with opened(path, largest_bytes, error=ConfigurationError) as (stream, _):
        return stream.read(largest_bytes + 1)


def _decoded(content: bytes, file: str) -> str:
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ConfigurationError("not_utf8", file=file) from None


def as_table(file: Path | str, key: str, value: object) -> Mapping[str, object]:
    """Return a value that must be a table."""
    if not isinstance(value, dict):
        raise ConfigurationError("not_a_table", file=file, key=key)
    return cast("Mapping[str, object]", value)


def unknown_key(file: Path | str, key: str, known: Iterable[str]) -> ConfigurationError:
    """Return the error for a key that no format knows."""
    return refuse([unknown(key.rpartition(".")[2], key, known)], file)


def read_tree(kind: type[_T], path: Path) -> _T | list[Message]:
    """Read a TOML file as frozen tables, or say everything that is wrong in it.

    Names of files count from its folder.
    """
    return tree_of(kind, read_toml(path), path.absolute().parent)


def tree_of(kind: type[_T], content: object, folder: Path | None = None) -> _T | list[Message]:
    """Return settings as a type says, or say everything that is wrong in them.

    No number may be a text, no key unknown. No value of a documented key is told, as it may be a
    secret. Names of files count from the folder.
    """
    from pydantic import ValidationError  # noqa: PLC0415  a tenth of a second

    # A list becomes a tuple, a table a dataclass and a text a choice where they come from JSON
    # only; a date of TOML is none of what may stand there.
    try:
        text = json.dumps([content], default=lambda date: {"date": str(date)})
        return adapter_of(kind).validate_json(text, context=folder)[0]
    except ValidationError as error:
        from thermaxis.files.settings._mistakes import explained  # noqa: PLC0415  if there are some

        return explained(error, kind)
    except RecursionError:
        return [problem("not_toml", "", cause=DEEP)]
    except ValueError:
        return [problem("not_toml", "", cause="a whole number of thousands of digits")]


def settings_of(kind: type[_T], content: object, *, file: str, key: str = "") -> _T:
    """Return settings as a type says: a dataclass, or a mapping or tuple of them.

    No number may be a text, no key unknown; what a dataclass refuses gets file and key.
    """
    _check_sizes(content, file, key)
    try:
        found = tree_of(kind, content)
    except ConfigurationError as error:
        there = ".".join(part for part in (key, error.place.key) if part)
        raise error.at(error.place._replace(file=file, key=there)) from None
    if isinstance(found, list):
        raise refuse([placed(cast("Message", found[0]), key)], file)
    return found


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
