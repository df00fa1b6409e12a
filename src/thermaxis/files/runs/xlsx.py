"""Workbooks, ``.xlsx``: a tidy or a wide table on one of their sheets."""

import datetime as dt
import io
import warnings
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from thermaxis.errors import MeasurementFileError
from thermaxis.files.runs.tidy_csv import tidy_test
from thermaxis.files.runs.wide_csv import wide_test
from thermaxis.files.table import (
    CELL_LIMIT,
    HEADER_ROWS,
    Layout,
    Metadata,
    Row,
    Table,
    TableSource,
    build_table,
    check_parts,
    damaged,
    is_comment,
    kind_of_content,
    no_table,
    read_above,
    read_comment_row,
    read_content,
    recognise,
)
from thermaxis.positioning import PositioningTest

if TYPE_CHECKING:
    from openpyxl import Workbook

# openpyxl has no error of its own for damaged parts: whatever a missing part, a wrong index or a
# wrong type raises inside it comes out. The calls below contain nothing else that raises these.
_PARSER_ERRORS = (
    ArithmeticError,  # dates and numbers out of range
    AssertionError,
    AttributeError,
    EOFError,
    LookupError,  # KeyError: a part or style that is not there; IndexError: a shared text
    NotImplementedError,
    OSError,
    RecursionError,
    SyntaxError,  # XML that is not well formed
    TypeError,
    ValueError,
    zipfile.BadZipFile,
    zlib.error,
)


def read_xlsx(path: Path | str) -> PositioningTest:
    """Read a workbook with a tidy or a wide table.

    The first visible sheet on which the headings of a run are found is read. Headings, units,
    comments and fields above the headings are those of the CSV layouts; times may be cells with
    a date. A formula counts with its stored value.

    Parameters
    ----------
    path : Path or str
        The file.

    Returns
    -------
    PositioningTest
        As from the CSV layout of the same kind.

    Raises
    ------
    MeasurementFileError
        If the file is no workbook or a damaged one, it is too large, no sheet holds a run, or a
        cell does not hold what its column promises; the error names the sheet and the cell.
    """
    return workbook_test(str(path), read_content(path))


def workbook_test(name: str, content: bytes) -> PositioningTest:
    """Make a positioning test from the bytes of a workbook."""
    if not content.startswith(b"PK"):
        raise _not_a_workbook(name, content)
    has_formulas = check_parts(content, path=name)
    table = _first_table(name, content, has_formulas=has_formulas)
    return tidy_test(table) if table.layout is Layout.TIDY else wide_test(table)


def _not_a_workbook(name: str, content: bytes) -> MeasurementFileError:
    seems = kind_of_content(content[:16]) or "not a workbook"
    return MeasurementFileError(
        f"this is {seems}, not a workbook of the kind .xlsx",
        path=name,
        remedy="Open it in a spreadsheet program and save it as .xlsx, without a password",
    )


def _first_table(name: str, content: bytes, *, has_formulas: bool) -> Table:
    with ExitStack() as stack, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of parts that are not read: styles, extensions
        values = _opened(name, content, data_only=True)
        stack.callback(values.close)
        formulas = None
        if has_formulas:
            formulas = _opened(name, content, data_only=False)
            stack.callback(formulas.close)
        seen: list[tuple[TableSource, Row]] = []
        for index, sheet in enumerate(values.worksheets):
            if sheet.sheet_state != "visible":
                continue
            source = TableSource(name, sheet.title)
            above: list[Row] = []
            table = _table_of(source, _rows(source, values, formulas, index), above)
            if table is not None:
                return table
            seen += [(source, row) for row in above]
    raise no_table(TableSource(name), seen)


def _opened(name: str, content: bytes, *, data_only: bool) -> "Workbook":
    from openpyxl import load_workbook  # noqa: PLC0415  takes a quarter of a second

    try:
        return load_workbook(
            io.BytesIO(content), read_only=True, data_only=data_only, keep_links=False
        )
    except _PARSER_ERRORS as error:
        raise damaged(name, error) from error


def _table_of(source: TableSource, rows: Iterator[Row], above: list[Row]) -> Table | None:
    """Read the first table of a sheet; what stands above it is added to a list."""
    metadata = Metadata()
    for row in rows:
        if is_comment(row[1]):
            read_comment_row(metadata, row, source)
            continue
        found = recognise(row[1])
        if found is None:
            above.append(row)
            if len(above) == HEADER_ROWS:
                return None
            continue
        for row_above in above:
            read_above(metadata, row_above)
        return build_table(source, *found, row[0], metadata, rows, decimal_comma=True)
    return None


def _rows(
    source: TableSource, values: "Workbook", formulas: "Workbook | None", sheet: int
) -> Iterator[Row]:
    """Yield the rows that hold anything, as texts."""
    cells = _values_of(source, values, sheet)
    beside = None if formulas is None else _values_of(source, formulas, sheet)
    width = 1
    for number, row in enumerate(cells, start=1):
        formula_row = () if beside is None else next(beside, ())
        width = max(width, len(row))
        if number * width > CELL_LIMIT:
            raise source.error(
                f"the sheet spans more than {CELL_LIMIT} cells",
                row=number,
                remedy="Clear the cells far from the table, or copy the table to a new workbook",
            )
        if not row:
            continue
        texts = [_text_of(value) for value in row]
        for column, formula in enumerate(formula_row[: len(row)]):
            if row[column] is None and formula is not None:
                texts[column] = "="
        if any(texts):
            yield number, texts


def _values_of(source: TableSource, workbook: "Workbook", index: int) -> Iterator[Sequence[object]]:
    try:
        sheet = workbook.worksheets[index]
        sheet.reset_dimensions()  # what the sheet says of its size is not to be trusted
        yield from sheet.iter_rows(values_only=True)
    except _PARSER_ERRORS as error:
        raise damaged(source.place, error) from error


def _text_of(value: object) -> str:
    """Write the value of a cell as a text file would hold it."""
    if value is None:
        return ""
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
    if isinstance(value, dt.timedelta):
        return repr(value.total_seconds())
    if isinstance(value, dt.date | dt.time):
        return value.isoformat()
    return str(value).strip()
