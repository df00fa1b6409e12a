"""Templates, and text as they need it: numbers as people read them, remarks, sentences."""

import re
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from thermaxis.codes import Message, Value
from thermaxis.messages import sentence
from thermaxis.plc._names import LONGEST_TEXT, remark_text
from thermaxis.plc._numbers import figure, noted


def rendered(template: str, values: dict[str, Any]) -> str:
    """Return a template of `library` or `guide` with values."""
    return _templates().get_template(template).render(values)


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


def _remark(text: str, longest: int = LONGEST_TEXT) -> str:
    return remark_text(text, longest)


def _warning(text: str) -> str:
    """Return a warning of a model in the signs of a remark: what was parted stays so."""
    return remark_text(re.sub(r",(?=\s)", " -", re.sub(r"\)?[:;](?=\s)", ".", text)), 500)


@cache
def _templates() -> Environment:
    own: dict[str, Any] = {
        "figure": figure,
        "noted": noted,
        "remark": _remark,
        "said": remark_of,
        "sentence": sentence,
        "warning": _warning,
        "zip": zip,
    }
    made = Environment(  # noqa: S701 - a program and Markdown, whose texts from people are cleaned
        loader=FileSystemLoader([Path(__file__).parent / name for name in ("library", "guide")]),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=StrictUndefined,
    )
    made.filters.update(own)
    return made
