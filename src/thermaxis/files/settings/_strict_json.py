"""JSON files that people write by hand: one object, no key twice, no NaN, a limit of size."""

import json
import os
import secrets
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import cast

from thermaxis.errors import ConfigurationError, printable


def read_json_object(name: str, *, largest_bytes: int, remedy: str) -> Mapping[str, object]:
    """Read a file that holds one JSON object."""
    return _as_object(name, _read_text(name, largest_bytes, remedy), remedy)


def _read_text(name: str, largest_bytes: int, remedy: str) -> str:
    path = Path(name)
    try:
        if path.exists() and not path.is_file():
            raise ConfigurationError("this is not a regular file", where=name, remedy=remedy)
        with path.open("rb") as stream:
            content = stream.read(largest_bytes + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL character in the name
        reason = error.strerror if isinstance(error, OSError) else None
        raise ConfigurationError(
            f"the file cannot be read ({reason or type(error).__name__})",
            where=name,
            remedy="Check its name and that it may be read",
        ) from None
    if len(content) > largest_bytes:
        raise ConfigurationError(
            f"the file is larger than {largest_bytes / 1e6:g} MB", where=name, remedy=remedy
        )
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ConfigurationError(
            f"the file is not UTF-8 (byte {error.start + 1})", where=name, remedy=remedy
        ) from None


def _as_object(name: str, text: str, remedy: str) -> Mapping[str, object]:
    def unique(pairs: list[tuple[str, object]]) -> dict[str, object]:
        found: dict[str, object] = {}
        for key, value in pairs:
            if key in found:
                raise ConfigurationError(
                    "the key stands there twice",
                    where=f"{name}, key {printable(key, 80)}",
                    remedy="Leave one of them out",
                )
            found[key] = value
        return found

    def no_constant(word: str) -> object:
        raise ConfigurationError(
            f"{word} is not a number", where=name, remedy="Write finite numbers"
        )

    try:
        table: object = json.loads(text, object_pairs_hook=unique, parse_constant=no_constant)
    except json.JSONDecodeError as error:
        raise ConfigurationError(
            f"the file is not JSON: {error.msg}",
            where=f"{name}, line {error.lineno}, column {error.colno}",
            remedy=remedy,
        ) from None
    except (RecursionError, ValueError):  # a number of thousands of digits
        raise ConfigurationError(
            "nested too deeply, or a number is too long", where=name, remedy=remedy
        ) from None
    if not isinstance(table, dict):
        raise ConfigurationError("the file holds no JSON object", where=name, remedy=remedy)
    return cast("Mapping[str, object]", table)


def write_json_text(text: str, path: Path | str) -> None:
    """Write a JSON file beside its place first, then into it, so that it is never half there."""
    try:
        _replace_text(Path(path), text)
    except (OSError, ValueError) as error:  # ValueError: a NUL character in the name
        reason = error.strerror if isinstance(error, OSError) else None
        raise ConfigurationError(
            f"cannot be written ({reason or type(error).__name__})",
            where=str(path),
            remedy="Choose another place, or make room and permission there",
        ) from None


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
