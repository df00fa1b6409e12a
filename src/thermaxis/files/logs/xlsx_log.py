"""Thermal logs in workbooks, ``.xlsx``: the first sheet with a column of times."""

import datetime as dt
import io
import warnings
import zipfile
import zlib
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import numpy as np

from thermaxis.errors import MeasurementFileError
from thermaxis.files.logs._columns import (
    MISSING_WORDS,
    ColumnPlan,
    ColumnValues,
    LogTable,
    build_log,
    parse_log_heading,
    plan_columns,
)
from thermaxis.files.settings import ThermalMapping
from thermaxis.files.table import (
    CELL_LIMIT,
    check_parts,
    damaged,
    is_number,
    kind_of_content,
    read_content,
)
from thermaxis.thermal import ThermalLog

_ROWS_ABOVE = 100
# openpyxl has no error of its own for damaged parts; the calls below contain nothing else that
# raises these.
_PARSER_ERRORS = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    EOFError,
    LookupError,
    NotImplementedError,
    OSError,
    RecursionError,
    SyntaxError,
    TypeError,
    ValueError,
    zipfile.BadZipFile,
    zlib.error,
)


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
    content = read_content(path)
    if not content.startswith(b"PK"):
        seems = kind_of_content(content[:16]) or "not a workbook"
        raise MeasurementFileError(
            f"this is {seems}, not a workbook of the kind .xlsx",
            path=name,
            remedy="Open it in a spreadsheet program and save it as .xlsx, without a password",
        )
    try:
        check_parts(content, path=name)
    except IndexError as error:  # a part without a name
        raise damaged(name, error) from error
    for sheet, rows in _sheets(name, content):
        for index, row in enumerate(rows[:_ROWS_ABOVE]):
            headings = ["" if cell is None else str(cell).strip() for cell in row]
            if not _are_headings(headings, mapping):
                continue
            table = _table(f"{name}, sheet {sheet}", headings, rows, index)
            plan = plan_columns(table.path, headings, mapping)
            _check_cells(table, plan)
            return build_log(table, plan, name=Path(path).stem, sample_time_s=sample_time_s)
    raise MeasurementFileError(
        "no sheet has a row of headings with a column of times",
        path=name,
        remedy="Head the columns, such as time_s, T_spindle_C, Z_um, or name the column in a"
        " mapping",
    )


def _sheets(name: str, content: bytes) -> list[tuple[str, list[tuple[object, ...]]]]:
    from openpyxl import load_workbook  # noqa: PLC0415  takes a quarter of a second

    result: list[tuple[str, list[tuple[object, ...]]]] = []
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of parts that are not read: styles, extensions
            book = load_workbook(io.BytesIO(content), read_only=True, data_only=True)
            with closing(book):
                for sheet in book.worksheets:
                    if sheet.sheet_state != "visible":
                        continue
                    sheet.reset_dimensions()  # what a sheet says of its size is not to be trusted
                    rows: list[tuple[object, ...]] = []
                    cells = 0
                    for row in sheet.iter_rows(values_only=True):
                        cells += max(1, len(row))
                        if cells > CELL_LIMIT:
                            raise _too_wide(name, sheet.title)
                        rows.append(tuple(row))
                    result.append((str(sheet.title), rows))
    except _PARSER_ERRORS as error:
        raise damaged(name, error) from error
    return result


def _too_wide(name: str, sheet: str) -> MeasurementFileError:
    return MeasurementFileError(
        f"the sheet {sheet} spans more than {CELL_LIMIT} cells",
        path=name,
        remedy="Clear the cells far from the table, or export the log as CSV",
    )


def _are_headings(cells: Sequence[str], mapping: ThermalMapping | None) -> bool:
    if mapping is not None and mapping.time_column is not None:
        return mapping.time_column in cells
    words = [cell for cell in cells if cell]
    if mapping is not None and mapping.sample_time_s is not None:
        return bool(words) and not any(is_number(word) for word in words)
    return len(words) > 1 and any(parse_log_heading(w).time_rank is not None for w in words)


def _table(
    path: str, headings: list[str], rows: Sequence[tuple[object, ...]], head: int
) -> LogTable:
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
