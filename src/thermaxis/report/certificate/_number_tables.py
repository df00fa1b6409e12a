"""Tables of numbers: one row for each target or pair of targets."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from thermaxis.messages import sentence_of
from thermaxis.positioning import FloatArray
from thermaxis.report._document import Column, Section, Table, columns_of
from thermaxis.report._figure_table import budget_table, figure_table
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._text import fixed, positions


def number_table(
    heads: str,
    cells: Iterable[tuple[str, ...]],
    numbers: list[tuple[str, FloatArray, int]],
    caption: str,
) -> Table:
    """Return a table of ready cells and, behind them, columns of a label, numbers and decimals.

    A column without any number is left out.
    """
    numbers = [column for column in numbers if np.any(np.isfinite(column[1]))]
    rows = (
        (*first, *(fixed(float(values[i]), decimals) for _, values, decimals in numbers))
        for i, first in enumerate(cells)
    )
    columns = (*columns_of(heads), *(Column(label) for label, *_ in numbers))
    return Table(columns, tuple(rows), caption)


def numbered_positions(target: FloatArray) -> list[tuple[str, ...]]:
    """Return the cells that begin the row of each target: its number and its position."""
    return [(str(i), where) for i, where in enumerate(positions(target), start=1)]


def figures_block(report: PositioningReport) -> Table:
    """Return the table of the figures with uncertainty, effect of drift, limit and verdict."""
    table = figure_table(report)
    columns = tuple(
        Column(label, "left" if label in {"", "figure", "verdict"} else "right", label == "figure")
        for label in table.labels
    )
    named = replace(columns[1], label=f"figure, values in {table.unit}")
    columns = (columns[0], named, *columns[2:])
    legend = " ".join(map(sentence_of, table.legend))
    return Table(columns, table.cells, legend, strong_rows=table.strong)


def budget_section(report: PositioningReport) -> list[Section]:
    """Return the uncertainty budget of the main figures; none where nothing was evaluated."""
    table = budget_table(report)
    if table is None:
        return []
    words = {"", "quantity", "distribution"}
    columns = tuple(
        Column(label, "left" if label in words else "right", label == "quantity")
        for label in table.labels
    )
    caption = (
        "Of the figures as measured. u: standard uncertainty of the quantity; value: expanded"
        " uncertainty of the instrument's certificate (k = 2), half width of a rectangular"
        " interval, standard deviation of a reading, or bias; last row of each figure: combined"
        " standard uncertainty u, the root of the sum of squares of the contributions. U is by"
        " Monte Carlo, the half width about the figure that holds 95.45 % of the draws. They are"
        " not normal, so k = U / u is not 2. Non-linearity (GUM 5.1.2, note): a maximum of many"
        " values is no straight line. Terms that cancel in a figure, and a non-linearity"
        " below a tenth of u, are left out."
    )
    block = Table(columns, table.cells, caption, strong_rows=table.strong, dense=True)
    return [Section("Uncertainty budget (GUM)", (block,))]
