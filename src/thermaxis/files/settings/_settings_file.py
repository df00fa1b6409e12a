"""Files of settings, TOML or JSON, that people write by hand: one reader for all of them."""

import json
import os
import secrets
import stat
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import cast

from thermaxis.codes import printable
from thermaxis.errors import ConfigurationError

LARGEST_TOML_BYTES = 1_000_000
"""Largest TOML file that is read. [byte]"""


def read_toml(path: Path | str, *, remedy: str) -> Mapping[str, object]:
    """Read a TOML file."""
    name = str(path)
    text = _read_text(name, LARGEST_TOML_BYTES, remedy)
    return parse_toml(text, where=name, remedy=remedy)


def parse_toml(text: str, *, where: str, remedy: str) -> Mapping[str, object]:
    """Return the tables of a text that is TOML."""
    import tomllib  # noqa: PLC0415  evaluating a run without such a file does not need it

    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        # a number of thousands of digits is a ValueError that is no TOMLDecodeError
        reason = str(error).rstrip(".") if isinstance(error, ValueError) else "nested too deeply"
    raise ConfigurationError(f"the file is not TOML: {reason}", where=where, remedy=remedy)


def as_table(where: Path | str, name: str, value: object) -> Mapping[str, object]:
    """Return a value that must be a table."""
    if not isinstance(value, dict):
        raise ConfigurationError(
            f"{name} is not a table",
            where=str(where),
            remedy=f"Write [{name}] on a line of its own and its keys below",
        )
    return cast("Mapping[str, object]", value)


def unknown_key(
    where: Path | str, key: str, known: Iterable[str], among: str = ""
) -> ConfigurationError:
    """Return the error for a key that no format knows; it names the nearest one."""
    import difflib  # noqa: PLC0415  needed only where something is wrong

    choices = sorted(known)
    nearest = difflib.get_close_matches(key[:100], choices, n=1, cutoff=0.5)
    listed = ", ".join(choices[:12]) + (", ..." if len(choices) > 12 else "")
    return ConfigurationError(
        f"unknown key {printable(key, 80)}{among}",
        where=str(where),
        remedy=f"The nearest known key is {nearest[0]}" if nearest else f"Known keys are {listed}",
    )


def read_json_object(name: str, *, largest_bytes: int, remedy: str) -> Mapping[str, object]:
    """Read a file that holds one JSON object: no key twice, no NaN."""
    return _as_object(name, _read_text(name, largest_bytes, remedy), remedy)


def _read_text(name: str, largest_bytes: int, remedy: str) -> str:
    path = Path(name)
    try:
        if path.exists() and not path.is_file():  # opening a pipe would wait for a writer
            raise ConfigurationError("this is not a regular file", where=name, remedy=remedy)
        with path.open("rb") as stream:
            content = stream.read(largest_bytes + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL character in the name
        raise ConfigurationError(
            f"the file cannot be read ({_reason(error)})",
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


def _reason(error: OSError | ValueError) -> str:
    return getattr(error, "strerror", None) or type(error).__name__


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
        raise ConfigurationError(
            f"cannot be written ({_reason(error)})",
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
