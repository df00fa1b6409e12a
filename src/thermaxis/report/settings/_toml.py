"""Read configuration files: a table of known keys, and errors that name the nearest one."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import cast

from thermaxis.errors import ConfigurationError, printable

_LARGEST_FILE = 1_000_000
"""A file of header fields or limits is never larger. [bytes]"""


def read_toml(path: Path, *, example: str) -> Mapping[str, object]:
    """Read a TOML file."""
    import tomllib  # noqa: PLC0415  evaluating a run without such a file does not need it

    if path.exists() and not path.is_file():
        # opening a pipe would wait for somebody who writes
        raise ConfigurationError(
            "the file cannot be read (it is a folder, a pipe or a device)",
            where=str(path),
            remedy="Give a TOML file",
        )
    try:
        if path.is_file() and path.stat().st_size > _LARGEST_FILE:
            raise ConfigurationError(
                f"the file is larger than {_LARGEST_FILE // 1_000_000} MB",
                where=str(path),
                remedy="Give the TOML file with the fields, not the measured run",
            )
        text = path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise ConfigurationError(
            f"the file cannot be read ({error.strerror or type(error).__name__})",
            where=str(path),
            remedy="Check its name and that it may be read",
        ) from None
    except UnicodeDecodeError as error:
        raise ConfigurationError(
            f"the file is not UTF-8 (byte {error.start + 1})",
            where=str(path),
            remedy="Save it as UTF-8",
        ) from None
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        # a number of thousands of digits is a ValueError that is no TOMLDecodeError
        what = str(error) if isinstance(error, ValueError) else "nested too deeply"
        raise ConfigurationError(
            f"the file is not TOML: {what}",
            where=str(path),
            remedy=f"Write {example}",
        ) from None


def unknown_key(path: Path, key: str, known: Iterable[str]) -> ConfigurationError:
    """Return the error for a key that nobody knows."""
    import difflib  # noqa: PLC0415  needed only where something is wrong

    choices = sorted(known)
    nearest = difflib.get_close_matches(key[:100], choices, n=1, cutoff=0.5)
    listed = ", ".join(choices[:12]) + (", ..." if len(choices) > 12 else "")
    return ConfigurationError(
        f"unknown key {printable(key, 80)}",
        where=str(path),
        remedy=f"The nearest known key is {nearest[0]}" if nearest else f"Known keys are {listed}",
    )


def as_table(path: Path, name: str, value: object) -> Mapping[str, object]:
    """Return a value that must be a table."""
    if not isinstance(value, dict):
        raise ConfigurationError(
            f"{name} is not a table",
            where=str(path),
            remedy=f"Write [{name}] on a line of its own and its keys below",
        )
    return cast("Mapping[str, object]", value)
