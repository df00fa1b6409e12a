"""The sheets of a workbook, ``.xlsx`` or ``.xls``, as rows of cells, and the table of a run."""

import datetime as dt
import io
import warnings
from collections import Counter
from collections.abc import Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, cast

from thermaxis.codes import Place
from thermaxis.errors import MeasurementFileError
from thermaxis.files.table._blocks import grid_table
from thermaxis.files.table._mapping import NO_MAPPING, RunMapping
from thermaxis.files.table._source import kind_of_content
from thermaxis.files.table._table import (
    HEADER_ROWS,
    Row,
    Table,
    TableSource,
    is_comment,
    no_table,
)
from thermaxis.files.table._workbook_parts import (
    CELL_LIMIT,
    DAMAGE,
    check_parts,
    damage_named,
)

if TYPE_CHECKING:
    from openpyxl import Workbook

OLD_WORKBOOK = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
"""What an ``.xls`` workbook begins with, and an encrypted one of either kind."""
OLD_LIMIT_BYTES = 20_000_000
"""Largest ``.xls`` workbook: about a million cells. [byte]"""

Cells = tuple[Sequence[object], Sequence[object]]
"""Values of a row and, where the workbook has formulas, its formulas."""


@contextmanager
def opened_sheets(
    name: str, content: bytes
) -> Generator[Iterator[tuple[TableSource, Iterator[Cells]]]]:
    """Give the visible sheets of a workbook and their rows; empty rows count."""
    if content.startswith(OLD_WORKBOOK):
        yield _old_sheets(name, content)
        return
    if not content.startswith(b"PK"):
        kind = kind_of_content(content[:16]) or "text"
        raise MeasurementFileError("not_a_workbook", kind=kind, file=name)
    has_formulas = check_parts(content, Place(name))
    with ExitStack() as stack, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of parts that are not read: styles, extensions
        books = [_opened(name, content, data_only=True)]
        if has_formulas:
            books.append(_opened(name, content, data_only=False))
        for book in books:
            stack.callback(book.close)
        sources = (
            (index, TableSource(name, str(sheet.title)))
            for index, sheet in enumerate(books[0].worksheets)
            if sheet.sheet_state == "visible"
        )
        yield ((source, _cells(source, books, index)) for index, source in sources)


def _old_sheets(name: str, content: bytes) -> Iterator[tuple[TableSource, Iterator[Cells]]]:
    """Yield the visible sheets of an ``.xls`` workbook."""
    from xlrd.biffh import XLRDError  # noqa: PLC0415  rarely needed
    from xlrd.compdoc import CompDocError  # noqa: PLC0415 - as above

    xlrd = cast("Any", import_module("xlrd"))

    if len(content) > OLD_LIMIT_BYTES:
        size_mb, most_mb = len(content) / 1e6, OLD_LIMIT_BYTES / 1e6
        raise MeasurementFileError("file_too_large", size_mb=size_mb, most_mb=most_mb, file=name)
    try:
        with damage_named(Place(name), damage=tuple(set(DAMAGE) - {OSError})):
            book = xlrd.open_workbook(
                file_contents=content, on_demand=True, ragged_rows=True, logfile=io.StringIO()
            )
            for sheet in book.sheets():
                if sheet.visibility == 0:
                    rows = [
                        ([_old_value(xlrd, book, cell) for cell in sheet.row(k)], ())
                        for k in range(sheet.nrows)
                    ]
                    yield TableSource(name, sheet.name), iter(rows)
    except (XLRDError, CompDocError) as error:
        raise MeasurementFileError("not_a_workbook", kind="old_workbook", file=name) from error


def _old_value(xlrd: Any, book: Any, cell: Any) -> object:
    if cell.ctype == xlrd.XL_CELL_DATE:
        return xlrd.xldate_as_datetime(cell.value, book.datemode)
    if cell.ctype == xlrd.XL_CELL_ERROR:
        return xlrd.error_text_from_code[cell.value]
    return bool(cell.value) if cell.ctype == xlrd.XL_CELL_BOOLEAN else cell.value


def _opened(name: str, content: bytes, *, data_only: bool) -> "Workbook":
    from openpyxl import load_workbook  # noqa: PLC0415  takes a quarter of a second

    with damage_named(Place(name)):
        return load_workbook(
            io.BytesIO(content), read_only=True, data_only=data_only, keep_links=False
        )


def _cells(source: TableSource, books: Sequence["Workbook"], index: int) -> Iterator[Cells]:
    with damage_named(source.at()):
        rows: list[Iterator[Sequence[object]]] = []
        for book in books:
            sheet = book.worksheets[index]
            sheet.reset_dimensions()  # what the sheet says of its size is not to be trusted
            rows.append(sheet.iter_rows(values_only=True))
        cells = 0
        for number, values in enumerate(rows[0], start=1):
            cells += max(1, len(values))  # an empty row counts as well
            if cells > CELL_LIMIT:
                place = source.at(number)
                raise MeasurementFileError("too_many_cells", most=CELL_LIMIT, place=place)
            yield values, next(rows[1], ()) if len(rows) > 1 else ()


def workbook_table(name: str, content: bytes, mapping: RunMapping = NO_MAPPING) -> Table:
    """Return the first table of readings on a visible sheet."""
    seen: list[tuple[TableSource, Row]] = []
    with opened_sheets(name, content) as sheets:
        for found, cells in sheets:
            source, fractions = replace(found, mapping=mapping), Counter[type]()
            rows = list(_text_rows(cells, fractions))
            # the point is certain where numbers are stored as such
            table = grid_table(source, rows, certain="." if fractions else "")
            if table is not None:
                return table
            seen += [(source, row) for row in rows[:HEADER_ROWS] if not is_comment(row[1])]
    raise no_table(TableSource(name), seen)


def _text_rows(cells: Iterator[Cells], fractions: Counter[type]) -> Iterator[Row]:
    """Yield the rows that hold anything, as texts; a formula without a value is '='."""
    for number, (row, formulas) in enumerate(cells, start=1):
        texts = [cell_text(value) for value in row]
        fractions.update(type(one) for one in row if type(one) is float and not one.is_integer())
        for column, formula in enumerate(formulas[: len(row)]):
            if row[column] is None and formula is not None:
                texts[column] = "="
        if any(texts):
            yield number, texts


def cell_text(value: object) -> str:
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
