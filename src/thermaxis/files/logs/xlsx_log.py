"""Thermal logs in workbooks, ``.xlsx``: the first sheet with a column of times."""

import datetime as dt
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from thermaxis.errors import MeasurementFileError
from thermaxis.files.logs._columns import (
    MISSING_WORDS,
    ColumnPlan,
    ColumnValues,
    LogTable,
    are_headings,
    build_log,
    plan_columns,
)
from thermaxis.files.settings import ThermalMapping
from thermaxis.files.table import (
    CELL_LIMIT,
    Cells,
    TableSource,
    is_number,
    opened_sheets,
    read_content,
)
from thermaxis.thermal import ThermalLog

_ROWS_ABOVE = 100


def read_thermal_xlsx(
    path: Path | str,
    *,
    mapping: ThermalMapping | None = None,
    sample_time_s: float | None = None,
) -> ThermalLog:
    """Read a thermal log from a workbook.

    The first visible sheet with a row of headings that names times is read. Times may be cells
    with a date. A formula counts with its stored value.
    """
    name = str(path)
    with opened_sheets(name, read_content(path)) as sheets:
        for source, cells in sheets:
            rows = _all_rows(source, cells)
            for index, row in enumerate(rows[:_ROWS_ABOVE]):
                headings = ["" if cell is None else str(cell).strip() for cell in row]
                if not are_headings([cell for cell in headings if cell], mapping):
                    continue
                table = _table(source.place, headings, rows, index)
                plan = plan_columns(table.path, headings, mapping)
                _check_cells(table, plan)
                return build_log(table, plan, name=Path(path).stem, sample_time_s=sample_time_s)
    raise MeasurementFileError(
        "no sheet has a row of headings with a column of times",
        path=name,
        remedy="Head the columns, such as time_s, T_spindle_C, Z_um, or name the column in a"
        " mapping",
    )


def _all_rows(source: TableSource, cells: Iterator[Cells]) -> list[Sequence[object]]:
    rows: list[Sequence[object]] = []
    count = 0
    for row, _ in cells:
        count += max(1, len(row))
        if count > CELL_LIMIT:
            raise source.error(
                f"the sheet {source.sheet} spans more than {CELL_LIMIT} cells",
                remedy="Clear the cells far from the table, or export the log as CSV",
            )
        rows.append(row)
    return rows


def _table(path: str, headings: list[str], rows: Sequence[Sequence[object]], head: int) -> LogTable:
    width = len(headings)
    kept = [
        (number, row)
        for number, row in enumerate(rows[head + 1 :], start=head + 2)
        if any(cell is not None and cell != "" for cell in row)
    ]
    for number, row in kept:
        if any(cell is not None for cell in row[width:]):
            raise MeasurementFileError(
                f"this row has more cells than the {width} headings",
                path=f"{path}, row {number}",
                remedy="Give every column a heading",
            )

    def read(index: int) -> ColumnValues:
        return _column([row[index] if index < len(row) else None for _, row in kept])

    return LogTable(
        path=path,
        headings=tuple(headings),
        rows=len(kept),
        read=read,
        place=lambda row: f"row {kept[row][0]}",
    )


def _check_cells(table: LogTable, plan: ColumnPlan) -> None:
    """Refuse a column of numbers with a word in it."""
    for channel in plan.channels:
        values = table.read(channel.column)
        if isinstance(values, np.ndarray) or not isinstance(values, list):
            continue
        wrong = [row for row, text in enumerate(values) if text and not is_number(text)]
        if wrong and len(wrong) < len([text for text in values if text]) / 2:
            raise table.error(
                f"'{values[wrong[0]]}' is not a number",
                column=channel.column,
                row=wrong[0],
                remedy="Write a number, or nothing where a value is missing",
            )


def _column(cells: Sequence[object]) -> ColumnValues:
    numbers = np.full(len(cells), np.nan)
    texts: list[str | None] = []
    has_texts = False
    for row, cell in enumerate(cells):
        number = _number_of(cell)
        if number is not None:
            numbers[row] = number
            texts.append(repr(number))
            continue
        text = _text_of(cell)
        texts.append(text)
        has_texts = has_texts or text is not None
    return texts if has_texts else numbers


def _number_of(cell: object) -> float | None:
    if isinstance(cell, bool | float | int):
        return float(cell) if abs(cell) < 1e300 else float("nan")
    if isinstance(cell, dt.timedelta):
        return cell.total_seconds()
    if isinstance(cell, str) and is_number(cell):
        return float(cell)
    if isinstance(cell, str) and is_number(cell, decimal=","):
        return float(cell.replace(",", "."))
    return None


def _text_of(cell: object) -> str | None:
    if cell is None:
        return None
    text = cell.isoformat() if isinstance(cell, dt.date | dt.time) else str(cell).strip()
    return None if not text or text.casefold() in MISSING_WORDS else text
