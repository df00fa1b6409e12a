"""Plain text: tables with aligned columns under a rule, sentences in lines."""

import textwrap
import unicodedata
from collections.abc import Sequence


def _width(text: str) -> int:
    """Return how many columns of a terminal a text takes; marks over a letter take none."""
    return sum(not unicodedata.combining(character) for character in text)


def _aligned(text: str, width: int, *, left: bool) -> str:
    blank = " " * (width - _width(text))
    return text + blank if left else blank + text


def aligned_lines(
    heads: Sequence[str], rows: Sequence[Sequence[str]], *, words: int = 0
) -> list[str]:
    """Return heads and rows as lines with aligned columns, `words` of them to the left."""
    widths = [max(map(_width, column)) for column in zip(heads, *rows, strict=True)]

    def line(cells: Sequence[str]) -> str:
        placed = (
            _aligned(c, w, left=i < words)
            for i, (c, w) in enumerate(zip(cells, widths, strict=True))
        )
        return ("  " + "  ".join(placed)).rstrip()

    return [*map(line, (heads, *rows))]


def text_table(
    title: str, heads: Sequence[str], rows: Sequence[Sequence[str]], *, words: int = 0
) -> str:
    """Return a table as text."""
    head, *lines = aligned_lines(heads, rows, words=words)
    rule = " " + "─" * max(map(_width, (head, *lines)))
    return "\n".join((title, "", head, rule, *lines, ""))


def filled(text: str, *, hanging: bool = False) -> str:
    """Return a sentence in lines of at most 100 characters."""
    return textwrap.fill(
        text,
        100,
        break_on_hyphens=False,
        break_long_words=False,
        subsequent_indent="  " if hanging else "",
    )
