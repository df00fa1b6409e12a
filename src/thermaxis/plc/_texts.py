"""The paragraphs of guide and head, which stand in ``texts.md``, and sentences as remarks."""

import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from importlib.resources import files
from typing import Any, TypeAlias

from thermaxis.codes import Message, Value
from thermaxis.messages import sentence
from thermaxis.plc._names import remark_text
from thermaxis.plc._numbers import noted

Values: TypeAlias = Mapping[str, Any]
"""Values by their names in a text: numbers, texts, truths, and items with values of their own."""

_INDENT = "    "
_REPEATED = re.compile(r"( *)(each|when|unless) (\w+):")


def remark_of(message: Message) -> str:
    """Return the sentence of a message so that it may stand in a remark of any target."""
    return sentence(message.code, {name: _plain(value) for name, value in message.values.items()})


def _plain(value: Value) -> str:
    match value:
        case Message():
            return remark_of(value)
        case tuple():
            return ", ".join(map(_plain, value))
        case float():
            return noted(value)
        case _:
            return remark_text(str(value))


def text(key: str, **values: object) -> str:
    """Return a paragraph in one line."""
    (paragraph,) = paragraphs(key, **values)
    return paragraph


def paragraphs(key: str, **values: object) -> tuple[str, ...]:
    """Return paragraphs, each in one line, with the values in place of their braces."""
    joined = (" ".join(one.split()) for one in _texts()[key].split("\n\n"))
    return tuple(one.format(**values) for one in joined)


def page(key: str, **values: object) -> Iterator[str]:
    """Yield the lines of a text as they stand, `expanded`."""
    for line, _ in expanded(_texts()[key].split("\n"), values):
        yield line


def expanded(lines: Sequence[str], values: Values) -> Iterator[tuple[str, Values]]:
    """Yield every line of a text with its values, each with the values that are known there.

    Braces hold values. What is indented below ``each name:`` stands once for every item of that
    name; below ``when name:`` and ``unless name:`` it stands where the value says so.
    """
    place = 0
    while place < len(lines):
        found = _REPEATED.fullmatch(lines[place])
        place += 1
        if found is None:
            yield lines[place - 1].format(**values), values
            continue
        begin, word, name = found.groups()
        first = place
        while place < len(lines) and lines[place].startswith(begin + _INDENT):
            place += 1
        inner = [line[len(_INDENT) :] for line in lines[first:place]]
        items: Sequence[Values] = [values]
        if word == "each":
            items = values[name]
        elif bool(values[name]) != (word == "when"):
            items = []
        for item in items:
            yield from expanded(inner, {**values, **item})


@cache
def _texts() -> Mapping[str, str]:
    text = (files("thermaxis.plc") / "texts.md").read_text("utf-8")
    parts = (part.split("\n", 1) for part in text.split("%% ")[1:])
    return {key: body.strip() for key, body in parts}
