"""Documents as JSON with a format, a version and a hash: models and plans."""

import hashlib
import json
import os
import secrets
import stat
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar, cast, final

from thermaxis.codes import Place, printable
from thermaxis.errors import ConfigurationError
from thermaxis.files._opened import unwritable
from thermaxis.files.settings._reading import read_json_object

_T = TypeVar("_T")


@final
@dataclass(frozen=True, slots=True)
class Form:
    """What distinguishes one kind of document from another."""

    format: str
    """What every document says that it is."""
    version: int
    """Version of the format that is written, and the only one that is read. [1]"""
    largest_bytes: int
    """Largest file that is read. [byte]"""


def content_sha256(content: Mapping[str, object]) -> str:
    """Return the SHA-256 of a content: keys in alphabetical order, no blanks, ASCII."""
    plain = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(plain.encode("ascii")).hexdigest()


def plain(of: Any) -> dict[str, Any]:
    """Return what a dataclass was made of as JSON has it, lists of others last."""
    found = {
        field.name: _plain_value(getattr(of, field.name), whole=field.type in (int, int | None))
        for field in fields(of)
        if field.init
    }
    return dict(sorted(found.items(), key=lambda one: one[0] == "parts"))


def _plain_value(value: object, *, whole: bool = False) -> object:
    if is_dataclass(value):
        return plain(value)
    if isinstance(value, Mapping):
        table = cast("Mapping[str, object]", value)
        return {name: _plain_value(one) for name, one in table.items()}
    if isinstance(value, tuple):
        return [_plain_value(one) for one in cast("tuple[object, ...]", value)]
    return float(value) if isinstance(value, int | float) and not whole else value


def read_document(
    path: Path | str,
    form: Form,
    read: Callable[[dict[str, object], str], _T],
    sha256: Callable[[_T], str],
) -> _T:
    """Read a document; a hash that it states must be that of what was read."""
    table = read_json_object(path, largest_bytes=form.largest_bytes)
    return document_of(table, str(path), form, read, sha256)


def document_of(
    table: dict[str, object],
    file: str,
    form: Form,
    read: Callable[[dict[str, object], str], _T],
    sha256: Callable[[_T], str],
) -> _T:
    """Return the document that a JSON object is."""
    stated, version = table.pop("format", "nothing"), table.pop("version", None)
    if stated != form.format:
        found, place = printable(str(stated), 40), Place(file, key="format")
        raise ConfigurationError("other_format", found=found, expected=form.format, place=place)
    if isinstance(version, bool) or version != form.version:
        found, place = printable(str(version), 20), Place(file, key="version")
        raise ConfigurationError("other_version", found=found, expected=form.version, place=place)
    stated_hash = table.pop("sha256", None)
    document = read(table, file)
    if stated_hash is not None and stated_hash != sha256(document):
        raise ConfigurationError("hash_mismatch", file=file, key="sha256")
    return document


def write_document(text: str, path: Path | str) -> None:
    """Write a JSON file beside its place first, then into it, so that it is never half there."""
    try:
        _replace_text(Path(path), text)
    except (OSError, ValueError) as error:  # ValueError: a NUL character in the name
        raise unwritable(path, error, ConfigurationError) from None


def _replace_text(path: Path, text: str) -> None:
    path = Path(os.path.realpath(path))
    # What is still a link leads to itself: opening it says so.
    if path.is_symlink() or (path.exists() and not path.is_file()):
        path.write_text(text, encoding="ascii", newline="\n")
        return
    mode: int | None = None
    if path.exists():
        # A file that may not be written is not replaced either.
        with path.open("ab"):
            mode = stat.S_IMODE(path.stat().st_mode)
    beside = path.with_name(f".{secrets.token_hex(8)}.part")
    try:
        with beside.open("x", encoding="ascii", newline="\n") as stream:
            stream.write(text)
            stream.flush()
            os.fsync(stream.fileno())
        if mode is not None:
            beside.chmod(mode)
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)
