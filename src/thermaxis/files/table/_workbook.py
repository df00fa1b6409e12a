"""The sheets of a workbook, ``.xlsx``, as rows of cells, and the first table of a run in them."""

import datetime as dt
import io
import warnings
from collections.abc import Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from thermaxis.codes import Place
from thermaxis.errors import MeasurementFileError
from thermaxis.files.table._damage import damage_named
from thermaxis.files.table._metadata import Metadata
from thermaxis.files.table._source import kind_of_content
from thermaxis.files.table._table import (
    HEADER_ROWS,
    Row,
    Table,
    TableSource,
    build_table,
    is_comment,
    no_table,
    read_above,
    read_comment_row,
    recognise,
)
from thermaxis.files.table._workbook_parts import CELL_LIMIT, check_parts

if TYPE_CHECKING:
    from openpyxl import Workbook

Cells = tuple[Sequence[object], Sequence[object]]
"""Values of a row and, where the workbook has formulas, its formulas."""


@contextmanager
def opened_sheets(
    name: str, content: bytes
) -> Generator[Iterator[tuple[TableSource, Iterator[Cells]]]]:
    """Give the visible sheets of a workbook and their rows; empty rows count."""
    if not content.startswith(b"PK"):
        kind = kind_of_content(content[:16]) or "text"
        raise MeasurementFileError("not_a_workbook", kind=kind, place=Place(name))
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


def workbook_table(name: str, content: bytes) -> Table:
    """Return the first table of readings on a visible sheet."""
    seen: list[tuple[TableSource, Row]] = []
    with opened_sheets(name, content) as sheets:
        for source, cells in sheets:
            above: list[Row] = []
            table = _table_of(source, _text_rows(cells), above)
            if table is not None:
                return table
            seen += [(source, row) for row in above]
    raise no_table(TableSource(name), seen)


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


def _text_rows(cells: Iterator[Cells]) -> Iterator[Row]:
    """Yield the rows that hold anything, as texts; a formula without a value is '='."""
    for number, (row, formulas) in enumerate(cells, start=1):
        texts = [cell_text(value) for value in row]
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
