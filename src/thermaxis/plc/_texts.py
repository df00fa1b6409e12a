"""The paragraphs of guide and head, which stand in ``texts.md``, and sentences as remarks."""

from collections.abc import Mapping
from functools import cache
from importlib.resources import files

from thermaxis.codes import Message, Value
from thermaxis.messages import sentence
from thermaxis.plc.tree import noted, remark_text


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
    return tuple(paragraph.format(**values) for paragraph in _texts()[key])


@cache
def _texts() -> Mapping[str, tuple[str, ...]]:
    page = (files("thermaxis.plc") / "texts.md").read_text("utf-8")
    parts = (part.split("\n", 1) for part in page.split("%% ")[1:])
    return {
        key: tuple(" ".join(one.split()) for one in body.strip().split("\n\n"))
        for key, body in parts
    }
