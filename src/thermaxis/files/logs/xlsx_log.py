"""Thermal logs in workbooks, ``.xlsx``: the first sheet with a column of times."""

from collections.abc import Sequence
from pathlib import Path

from thermaxis.errors import MeasurementFileError
from thermaxis.files.logs._cells import numbers_or_words
from thermaxis.files.logs._columns import (
    ColumnPlan,
    ColumnValues,
    LogTable,
    are_headings,
    build_log,
    plan_columns,
)
from thermaxis.files.settings import ThermalMapping
from thermaxis.files.table import (
    TableSource,
    cell_text,
    is_number,
    opened_sheets,
    read_content,
)
from thermaxis.thermal import ThermalLog

_ROWS_ABOVE = 100


def read_thermal_xlsx(
    path: Path | str, *, mapping: ThermalMapping | None = None, sample_time_s: float | None = None
) -> ThermalLog:
    """Read a thermal log from a workbook.

    The first visible sheet with a row of headings that names times is read. Times may be cells
    with a date. A formula counts with its stored value.
    """
    name = str(path)
    with opened_sheets(name, read_content(path)) as sheets:
        for source, cells in sheets:
            rows = [row for row, _ in cells]
            for index, row in enumerate(rows[:_ROWS_ABOVE]):
                headings = ["" if cell is None else str(cell).strip() for cell in row]
                if not are_headings([cell for cell in headings if cell], mapping):
                    continue
                plan = plan_columns(source.at(), headings, mapping)
                table = _table(source, headings, rows, index, plan)
                return build_log(table, plan, name=Path(path).stem, sample_time_s=sample_time_s)
    raise MeasurementFileError("no_time_column", file=name)


def _table(
    source: TableSource,
    headings: list[str],
    rows: Sequence[Sequence[object]],
    head: int,
    plan: ColumnPlan,
) -> LogTable:
    width = len(headings)
    kept = [
        (number, row)
        for number, row in enumerate(rows[head + 1 :], start=head + 2)
        if any(cell is not None and cell != "" for cell in row)
    ]
    for number, row in kept:
        if any(cell is not None for cell in row[width:]):
            cells, place = len(row), source.at(number)
            raise MeasurementFileError(
                "cells_and_headings", cells=cells, headings=width, place=place
            )

    def read(index: int) -> ColumnValues:
        import polars as pl  # noqa: PLC0415  takes a tenth of a second

        cells = [_text(row[index]) if index < len(row) else None for _, row in kept]
        return numbers_or_words(
            pl.Series(cells, dtype=pl.String()),
            lambda row: source.at(kept[row][0], index, headings[index]),
            dates=index in {plan.time, plan.date},
        )

    return LogTable(
        place=source.at(),
        headings=tuple(headings),
        rows=len(kept),
        read=read,
        place_of=lambda row: source.at(kept[row][0]),
    )


def _text(cell: object) -> str | None:
    """Write the value of a cell with a decimal point."""
    if isinstance(cell, bool):
        return str(int(cell))
    text = cell_text(cell)
    return text.replace(",", ".") if is_number(text, decimal=",") else text or None
