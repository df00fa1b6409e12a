"""Columns of cells as numbers: decimal signs, thousands, words for what is missing."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.files.table._mapping import RunMapping
from thermaxis.positioning import FloatArray

_PLAIN_MISSING = "nan na n/a null none - -- --- #n/a"
_TOLD_MISSING = """
    #num! #value! #div/0! err error overflow overrange ol bad open fault inf +inf -inf infinity
"""
TOLD_MISSING = frozenset(_TOLD_MISSING.split())
"""Words of recorders that are told when they stand for a missing value."""
MISSING_WORDS = TOLD_MISSING.union(_PLAIN_MISSING.split())
"""Words that stand for a value that was not measured, in lower case; so does an empty cell."""
_MISSING_READING_LIST = """
    — – ? #null! missing invalid beam_break beam_broken beam_interrupted beam_lost no_beam no_signal
    signal_lost not_measured fehlt ungültig strahlunterbrechung strahl_unterbrochen kein_signal
    nicht_gemessen chybí neměřeno přerušení_paprsku paprsek_přerušen
"""
_MISSING_READING = MISSING_WORDS.union(_MISSING_READING_LIST.split())

_NUMBER_CHARACTERS = frozenset("0123456789+-.eE\n")
_BLANKS = " \N{NO-BREAK SPACE}\N{NARROW NO-BREAK SPACE}\N{THIN SPACE}"
_GROUPING = frozenset(f"{_BLANKS}'\N{RIGHT SINGLE QUOTATION MARK}")


def _form(decimal: str, other: str) -> re.Pattern[str]:
    signs = "".join(_GROUPING) + other
    grouped = rf"[1-9][0-9]{{0,2}}(?P<sign>[{signs}])[0-9]{{3}}(?:(?P=sign)[0-9]{{3}})*"
    d = re.escape(decimal)
    return re.compile(rf"[+-]?(?:(?:{grouped}|[0-9]+)(?:{d}[0-9]*)?|{d}[0-9]+)(?:[eE].*)?")


_FORMS = {".": _form(".", ","), ",": _form(",", ".")}


@final
@dataclass(frozen=True, slots=True)
class NumberForm:
    """How the numbers of a table are written."""

    decimal: str
    """Decimal sign; both signs where the cells do not agree, empty where both are possible."""
    first: tuple[tuple[int, int], ...] = ()
    """Row and column, from 0, of the first cell of each sign, or of one that could be either."""
    grouped: bool = False
    """Whether signs between thousands may be there."""


def number_form(
    columns: Sequence[tuple[int, Sequence[str]]], mapping: RunMapping, *, certain: str, stored: bool
) -> NumberForm:
    """Find the decimal sign of columns of numbers.

    A certain one decides where both fit, but not what a comma in a cell means; nor do other cells
    where it is only that of numbers which are stored as such.
    """
    votes: dict[str, tuple[int, int]] = {}
    either: dict[str, tuple[int, int]] = {}
    seen: set[str] = set()
    for column, cells in columns:
        text = "".join(cells)
        signs = [sign for sign in ".," if sign in text]
        simple = len(signs) < 2 and not any(sign in text for sign in _GROUPING)
        seen.update(signs, () if simple else "g")
        for row, cell in enumerate(cells if signs else ()):
            if simple and signs[0] in votes:
                break
            point, comma = (_FORMS[sign].fullmatch(cell) for sign in ".,")
            if point and comma:
                sign = next((sign for sign in ",." if sign in cell), None)
                if sign is not None:
                    either.setdefault(sign, (row, column))
            elif point or comma:
                votes.setdefault("." if point else ",", (row, column))
    stated = {"point": ".", "comma": ","}.get(mapping.decimal or "")
    if stated is None and len(votes) == 2:
        return NumberForm(".,", (votes["."], votes[","]))
    if "," in either and stated is None and certain and (stored or not votes):
        return NumberForm("", (either[","],))
    decimal = stated or next(iter(votes), certain)
    if not decimal and either:
        return NumberForm("", (min(either.values()),))
    decimal = decimal or "."
    return NumberForm(decimal, (), grouped=bool(seen - {decimal}))


def without_groups(cells: list[str], decimal: str) -> list[str]:
    """Return cells without the signs between thousands."""
    other = "." if decimal == "," else ","
    drop = str.maketrans("", "", "".join(_GROUPING) + other)
    form = _FORMS[decimal]
    return [
        cell.translate(drop) if (found := form.fullmatch(cell)) and found["sign"] else cell
        for cell in cells
    ]


def numeric_cells(cells: Sequence[str], decimal: str) -> FloatArray | None:
    """Read a column of cells as numbers, NaN where a cell is empty."""
    text = "\n".join(cells)
    if decimal != ".":
        if "." in text:  # beside a decimal comma it would be a sign for thousands
            return None
        text = text.replace(decimal, ".")
    if not _NUMBER_CHARACTERS.issuperset(text) or text.count("\n") != len(cells) - 1:
        return None
    try:
        return np.array([float(cell) if cell else np.nan for cell in text.split("\n")])
    except ValueError:
        return None


def without_missing(cells: Sequence[str]) -> tuple[list[str], Counter[str]]:
    """Return cells with nothing where a word says that nothing was measured, and these words."""
    said = Counter(c for c in cells if c.casefold().replace(" ", "_") in _MISSING_READING)
    return (["" if cell in said else cell for cell in cells] if said else list(cells)), said
