"""Documents as JSON with a format, a version and a hash: models and plans."""

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar, cast, final

from thermaxis.codes import printable
from thermaxis.errors import ConfigurationError
from thermaxis.files.settings._settings_file import read_json_object, unknown_key

_MOST_ENTRIES = 10_000
_T = TypeVar("_T")


@final
@dataclass(frozen=True, slots=True)
class Form:
    """What distinguishes one kind of document from another."""

    noun: str
    """Its name in messages."""
    largest_number: float = 1e12
    """Largest magnitude of a number. [1]"""
    longest_text: int = 2000
    """Longest text. [character]"""
    remedy: str = ""
    """What makes such a document."""
    format: str = ""
    """What every JSON document says that it is."""
    version: int = 1
    """Version of the format that is written, and the only one that is read. [1]"""
    largest_bytes: int = 1_000_000
    """Largest file that is read. [byte]"""
    again: str = ""
    """What to do with one of another version."""


def content_sha256(content: Mapping[str, object]) -> str:
    """Return the SHA-256 of a content: keys in alphabetical order, no blanks, ASCII."""
    plain = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(plain.encode("ascii")).hexdigest()


def read_document(
    path: Path | str, form: Form, read: "Callable[[SettingsTable], _T]", sha256: Callable[[_T], str]
) -> _T:
    """Read a document; a hash that it states must be that of what was read."""
    name = str(path)
    table = read_json_object(name, largest_bytes=form.largest_bytes, remedy=form.remedy)
    if table.get("format") != form.format:
        stated = printable(str(table.get("format", "nothing")), 40)
        raise ConfigurationError(
            f"the key format says {stated}, not {form.format}: this is no {form.noun}",
            where=name,
            remedy=form.remedy,
        )
    version = table.get("version")
    if isinstance(version, bool) or version != form.version:
        raise ConfigurationError(
            f"version {printable(str(version), 20)} of the {form.noun}'s format is not known",
            where=f"{name}, key version",
            remedy=f"This program reads version {form.version}; {form.again}",
        )
    content = {key: v for key, v in table.items() if key not in {"format", "version", "sha256"}}
    try:
        document = read_all(SettingsTable(form, name, "", content), read)
    except ConfigurationError as error:
        if error.where.startswith(name):
            raise
        raise ConfigurationError(
            error.what, where=f"{name}, {error.where}", remedy=error.remedy
        ) from None
    stated_hash = table.get("sha256")
    if stated_hash is not None and stated_hash != sha256(document):
        raise ConfigurationError(
            f"the hash does not fit the content: the {form.noun} was changed after it was written",
            where=f"{name}, key sha256",
            remedy=f"Restore the {form.noun}; or leave the key out, and the changed one has its own"
            " hash",
        )
    return document


class SettingsTable:
    """A table whose keys are taken one by one; what is left over is an error."""

    def __init__(self, form: Form, name: str, place: str, value: object) -> None:
        self.form, self.name, self.place = form, name, place
        if not isinstance(value, dict):
            raise self.wrong("", "not a table of keys", "Write keys with their values there")
        self.left = dict(cast("Mapping[str, object]", value))
        self.asked: set[str] = set()

    def _below(self, key: str, value: object) -> "SettingsTable":
        place = f"{self.place}.{key}" if self.place else key
        return SettingsTable(self.form, self.name, place, value)

    def wrong(self, key: str, what: str, remedy: str = "") -> ConfigurationError:
        """Return the error of a value."""
        place = f"{self.place}.{key}" if self.place and key else self.place or key
        return ConfigurationError(
            f"the value is {what}", where=f"{self.name}, key {printable(place, 120)}", remedy=remedy
        )

    def _take(self, key: str, default: object) -> object:
        self.asked.add(key)
        if key in self.left:
            return self.left.pop(key)
        if default is _NEEDED:
            place = f" of {self.place}" if self.place else ""
            raise ConfigurationError(
                f"the {self.form.noun} lacks the key {key}{place}",
                where=self.name,
                remedy=f"Add {key}",
            )
        return default

    def number(self, key: str, default: object = None) -> float:
        """Return a number."""
        value = self._take(key, _NEEDED if default is None else default)
        return self.as_number(key, value)

    def number_or_none(self, key: str) -> float | None:
        """Return a number or None."""
        value = self._take(key, None)
        return None if value is None else self.as_number(key, value)

    def as_number(self, key: str, value: object) -> float:
        """Return a value that must be a number."""
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.wrong(key, "not a number", "Write it without quotes")
        largest = self.form.largest_number
        if not abs(value) <= largest:
            raise self.wrong(key, f"not a number of at most {largest:g}", "Check the digits")
        return float(value)

    def whole(self, key: str, default: int | None = 0) -> int:
        """Return a whole number from 0 up."""
        value = self._take(key, _NEEDED if default is None else default)
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**63:
            raise self.wrong(key, "not a whole number from 0 up", "Write digits only")
        return value

    def word(self, key: str, default: str | None = None) -> str:
        """Return a text."""
        return self._as_word(key, self._take(key, _NEEDED if default is None else default))

    def _as_word(self, key: str, value: object) -> str:
        if not isinstance(value, str):
            raise self.wrong(key, "not a text", "Write it in quotes")
        if len(value) > self.form.longest_text or not value.isprintable():
            raise self.wrong(
                key, f"no line of at most {self.form.longest_text} characters", "Shorten it"
            )
        return value

    def word_or_none(self, key: str) -> str | None:
        """Return a text or None."""
        value = self._take(key, None)
        return None if value is None else self._as_word(key, value)

    def flag(self, key: str) -> bool:
        """Return true or false; false where it is not stated."""
        value = self._take(key, default=False)
        if not isinstance(value, bool):
            raise self.wrong(key, "neither true nor false", "Write true or false")
        return value

    def entries(
        self, key: str, read: "Callable[[SettingsTable], _T]", *, needed: bool
    ) -> tuple[_T, ...]:
        """Return a list of objects, each read by a function."""
        return tuple(
            read_all(self._below(f"{key}[{k}]", v), read)
            for k, v in enumerate(self.items(key, needed=needed))
        )

    def items(self, key: str, *, needed: bool) -> list[object]:
        """Return a list."""
        value = self._take(key, _NEEDED if needed else [])
        if not isinstance(value, list):
            raise self.wrong(key, "not a list", "Write it in brackets")
        listed = cast("list[object]", value)
        if len(listed) > _MOST_ENTRIES:
            raise self.wrong(key, f"a list of more than {_MOST_ENTRIES} entries")
        return listed

    def numbers(self, key: str) -> dict[str, float]:
        """Return numbers by name."""
        inner = self._below(key, self._take(key, {}))
        return {name: inner.number(name) for name in list(inner.left)}

    def inner(self, key: str, read: "Callable[[SettingsTable], _T]") -> _T:
        """Return what a function reads of an object that may be left out."""
        return read_all(self._below(key, self._take(key, {})), read)

    def tables(
        self, key: str, read: "Callable[[SettingsTable], _T]", *, short: str
    ) -> dict[str, _T]:
        """Return what a function reads of each table below a key; a text stands for one key."""
        stated = self._below(key, self._take(key, {})).left
        return {
            name: read_all(
                self._below(f"{key}.{name}", {short: v} if isinstance(v, str) else v), read
            )
            for name, v in stated.items()
        }

    def texts(self, key: str, *, needed: bool = False) -> tuple[str, ...]:
        """Return a list of texts."""
        listed = self.items(key, needed=needed)
        return tuple(self._as_word(f"{key}[{k}]", value) for k, value in enumerate(listed))

    def null(self, key: str, why: str) -> None:
        """Accept nothing but null."""
        if self._take(key, None) is not None:
            raise self.wrong(key, "not null", why)


_NEEDED = object()


def read_all(of: SettingsTable, read: Callable[[SettingsTable], _T]) -> _T:
    """Return what a function reads of an object, and refuse keys that it did not ask for."""
    result = read(of)
    if of.left:
        place = f" in {of.place}" if of.place else ""
        raise unknown_key(of.name, next(iter(of.left)), of.asked, place)
    return result
