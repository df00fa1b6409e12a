"""Columns of words, from CSV or a workbook, become numbers or stay words."""

from collections import Counter
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from thermaxis.codes import Place
from thermaxis.errors import MeasurementFileError
from thermaxis.positioning import FloatArray

if TYPE_CHECKING:
    import polars as pl

_PLAIN_MISSING = "nan na n/a null none - -- --- #n/a"
_TOLD_MISSING = """
    #num! #value! #div/0! err error overflow overrange ol bad open fault inf +inf -inf infinity
"""
MISSING_WORDS = frozenset((_PLAIN_MISSING + _TOLD_MISSING).split())
"""Words that stand for a value that was not measured, in lower case; so does an empty cell."""
_TOLD = frozenset(_TOLD_MISSING.split())


def numbers_or_words(
    cells: "pl.Series",
    at: Callable[[int], Place],
    *,
    decimal: str = ".",
    dates: bool = False,
    missing: Counter[str] | None = None,
) -> FloatArray | list[str | None]:
    """Return the numbers of a column, NaN where missing, or its words, None where empty.

    A column with more numbers than words is one of numbers with a mistake in it, unless it may
    hold dates. Words that stand for a missing value are counted.
    """
    import polars as pl  # noqa: PLC0415  takes a tenth of a second

    words = cells.str.strip_chars()
    plain = words if decimal == "." else words.str.replace(decimal, ".", literal=True)
    values = plain.cast(pl.Float64(), strict=False)
    if values.null_count() == words.null_count() and (decimal == "." or not _has_point(words)):
        return _finite(values)
    words = words.fill_null("")
    plain = words.str.replace_all("\N{MINUS SIGN}", "-", literal=True)
    if decimal != ".":  # a point beside a decimal comma would be a sign for thousands
        pointed = plain.str.contains(".", literal=True)
        plain = plain.str.replace_all(decimal, ".", literal=True).zip_with(
            ~pointed, pl.Series([""])
        )
    values = plain.cast(pl.Float64(), strict=False)
    lower = words.str.to_lowercase()
    absent = (words == "") | lower.is_in(list(MISSING_WORDS))
    wrong = values.is_null() & ~absent
    if wrong.any():
        count = wrong.sum()
        if not dates and count < (values.is_not_null() & ~absent).sum():
            first = int(wrong.arg_max() or 0)
            raise MeasurementFileError("not_a_number", text=words[first], place=at(first))
        return [word or None for word in words.to_list()]
    if missing is not None:
        missing.update(words.filter(lower.is_in(list(_TOLD))).to_list())
    return _finite(values)


def _has_point(words: "pl.Series") -> bool:
    return bool(words.str.contains(".", literal=True).any())


def _finite(column: "pl.Series") -> FloatArray:
    values = column.fill_null(np.nan).to_numpy()
    return np.where(np.isfinite(values), values, np.nan) if np.isinf(values).any() else values
