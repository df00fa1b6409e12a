"""What is wrong in a configuration, as messages with their places."""

from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import Any, Final, cast

from pydantic import ConfigDict, TypeAdapter

from thermaxis.codes import Message, Place, Value
from thermaxis.errors import ConfigurationError

MOST_PROBLEMS: Final = 8
"""Most mistakes of one file that an error tells in full. [1]"""
DEEP = "nested too deeply"


@cache
def adapter_of(kind: type) -> TypeAdapter[Any]:
    """Return what reads a list with one file of a kind."""
    strict = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, hide_input_in_errors=True)
    return TypeAdapter(cast("Any", tuple)[kind], config=strict)


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
    if len(problems) > 1:
        shown, count = tuple(problems[:MOST_PROBLEMS]), len(problems)
        place = Place(str(path))
        return ConfigurationError("several_problems", problems=shown, count=count, place=place)
    only = problems[0]
    place = only.place if only.place.file else only.place._replace(file=str(path))
    return ConfigurationError.of(replace(only, place=place))


def nearest(name: str, known: Sequence[str]) -> tuple[str, ...]:
    """Return the name that is nearest to an unknown one; all, if none is near."""
    return tuple(get_close_matches(name[:100], sorted(known), n=1, cutoff=0.6) or sorted(known))
