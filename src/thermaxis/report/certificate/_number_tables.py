"""Tables of numbers: one row for each target or pair of targets."""

from collections.abc import Iterable

from thermaxis.positioning import FloatArray
from thermaxis.report._document import Column, Table, columns_of
from thermaxis.report._text import fixed, positions


def number_table(
    heads: str,
    cells: Iterable[tuple[str, ...]],
    numbers: list[tuple[str, FloatArray, int]],
    caption: str,
) -> Table:
    """Return a table of ready cells and, behind them, columns of a label, numbers and decimals."""
    rows = (
        (*first, *(fixed(float(values[i]), decimals) for _, values, decimals in numbers))
        for i, first in enumerate(cells)
    )
    columns = (*columns_of(heads), *(Column(label) for label, *_ in numbers))
    return Table(columns, tuple(rows), caption)


def numbered_positions(target: FloatArray) -> list[tuple[str, ...]]:
    """Return the cells that begin the row of each target: its number and its position."""
    return [(str(i), where) for i, where in enumerate(positions(target), start=1)]
