"""Columns of words, from CSV or a workbook, become numbers or stay words."""

from collections import Counter
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from thermaxis.codes import Place
from thermaxis.errors import MeasurementFileError
from thermaxis.files.table import MISSING_WORDS, TOLD_MISSING
from thermaxis.positioning import FloatArray

if TYPE_CHECKING:
    import polars as pl


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
    words = cells.str.strip_chars()
    values = _cast(words, decimal)
    if values.null_count() == words.null_count() and bool(values.is_finite().all()):
        return values.fill_null(np.nan).to_numpy()
    words = words.fill_null("")
    values = _cast(words.str.replace_all("\N{MINUS SIGN}", "-", literal=True), decimal)
    lower = words.str.to_lowercase()
    absent = (words == "") | lower.is_in(list(MISSING_WORDS))
    wrong = values.is_null() & ~absent
    if wrong.any():
        if not dates and wrong.sum() < (values.is_not_null() & ~absent).sum():
            first = int(wrong.arg_max() or 0)
            raise MeasurementFileError("not_a_number", text=words[first], place=at(first))
        return [word or None for word in words.to_list()]
    if missing is not None:
        missing.update(words.filter(lower.is_in(list(TOLD_MISSING))).to_list())
    numbers = values.fill_null(np.nan).to_numpy()
    return np.where(np.isfinite(numbers), numbers, np.nan)


def _cast(words: "pl.Series", decimal: str) -> "pl.Series":
    """Return numbers, null where a word is none; two signs in one word make no number."""
    import polars as pl  # noqa: PLC0415  takes a tenth of a second

    plain = words if decimal == "." else words.str.replace_all(decimal, ".", literal=True)
    return plain.cast(pl.Float64(), strict=False)
