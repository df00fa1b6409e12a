"""The paragraphs of guide and head, which stand in ``texts.md``."""

from collections.abc import Mapping
from functools import cache
from importlib.resources import files


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
