"""What is wrong in settings, as messages with their places."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Final

from thermaxis.codes import Message, Place, Value, printable
from thermaxis.errors import ConfigurationError

MOST_PROBLEMS: Final = 8
"""Most mistakes of one file that an error tells in full. [1]"""
DEEP: Final = "nested too deeply"
"""Why text of hundreds of brackets is not read."""
_SECRETS = ("password", "token")


def problem(code: str, key: str, **values: Value) -> Message:
    """Return something that is wrong at a key; empty: in the file as a whole."""
    return Message(f"error-{code}", values, Place(key=key))


def placed(message: Message, key: str) -> Message:
    """Return what is wrong below a key; what is wrong in another file keeps its place there."""
    place = message.place
    inner = place.key
    if not key or (place.file and inner):
        return message
    if inner and not place.file and key != inner and not key.endswith(f".{inner}"):
        key = inner if inner.startswith(f"{key}.") else f"{key}.{inner}"
    return replace(message, place=place._replace(key=key))


def refuse(problems: Sequence[Message], path: Path | str) -> ConfigurationError:
    """Make one error of everything that is wrong in a file: of several the first are its values."""
    from thermaxis.files.settings._lines import with_lines  # noqa: PLC0415  if there are some

    first, *others = with_lines(problems, Path(path))
    if not others:
        return ConfigurationError.of(first)
    shown, count = (first, *others[: MOST_PROBLEMS - 1]), 1 + len(others)
    return ConfigurationError("several_problems", problems=shown, count=count, file=path)


def nearest(name: str, known: Iterable[str]) -> tuple[str, ...]:
    """Return the name that is nearest to an unknown one; all, if none is near."""
    return tuple(get_close_matches(name[:100], sorted(known), n=1, cutoff=0.6) or sorted(known))


def unknown(name: str, key: str, known: Iterable[str]) -> Message:
    """Say that there is no such key, and which one may be meant."""
    if name in _SECRETS:
        return problem("secret_in_file", key, name=name)
    name, key, known = printable(name, 80), printable(key), sorted(known)
    near = get_close_matches(name, known, n=1, cutoff=0.6)
    if near:
        return problem("unknown_key_near", key, name=name, near=near[0])
    return problem("unknown_key", key, name=name, known=tuple(known))
