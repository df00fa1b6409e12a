"""Rows of cells from the text of a CSV file."""

import csv
import re
from collections.abc import Callable, Iterator
from itertools import islice
from typing import TypeAlias, TypeVar

from thermaxis.codes import remark
from thermaxis.errors import MeasurementFileError
from thermaxis.files.table._blocks import build_table, either_way
from thermaxis.files.table._columns import Heading
from thermaxis.files.table._mapping import NO_MAPPING, RunMapping
from thermaxis.files.table._metadata import Metadata
from thermaxis.files.table._numbers import numeric_cells
from thermaxis.files.table._source import SourceText
from thermaxis.files.table._table import (
    CELL_ERRORS,
    HEADER_ROWS,
    MAX_COLUMNS,
    Layout,
    Row,
    Table,
    TableSource,
    no_table,
    read_comment_row,
    read_rows_above,
    recognise,
)

DELIMITERS = (";", "\t", ",", "|")
"""Signs that may stand between cells."""
LONGEST_LINE = 1_000_000
"""Longest line of a table. [character]"""

_LINES_ABOVE = 20_000
_LINES_OF_A_CELL = 20
_SEPARATOR_LINE = re.compile(r"[ \t]*sep=.?[ \t]*", re.IGNORECASE)  # for spreadsheet programs
_OPENING_QUOTE = re.compile(r'(?:^|[,;\t])[ ]*"')

_T = TypeVar("_T")
_Line: TypeAlias = tuple[int, str]


def csv_table(text: SourceText, mapping: RunMapping = NO_MAPPING) -> Table:
    """Make a table from the text of a CSV file."""
    source = TableSource(text.path, mapping=mapping)

    def rows() -> list[Row]:
        return list(islice(_plain_rows(text, source), MAX_COLUMNS + 1))

    def read() -> Table | None:
        return _search(text, source, commented=False) or _search(text, source, commented=True)

    table = either_way(read, source, rows, Metadata(remarks=[*text.remarks]), certain="")
    if table is None:
        raise no_table(source, [(source, row) for row in rows()[:HEADER_ROWS]])
    if not text.text.endswith("\n"):
        _check_open_end(table, text.text.count("\n") + 1)
    return table


def _plain_rows(text: SourceText, source: TableSource) -> Iterator[Row]:
    """Yield the rows in which headings were looked for, split where most cells come out."""
    for number, line in _lines(text.text, source):
        if number > _LINES_ABOVE:
            return
        if line.strip() and not is_separator_line(line) and not is_comment_line(line):
            split = (split_cells(line, delimiter) for delimiter in DELIMITERS)
            cells = max((found for found in split if found), key=len, default=[line.strip()])
            yield number, cells


def _search(text: SourceText, source: TableSource, *, commented: bool) -> Table | None:
    """Look for the headings, which some programs write as a comment, and read what is below."""
    metadata = Metadata(remarks=list(text.remarks))
    lines = _lines(text.text, source)
    above: list[_Line] = []
    for number, line in lines:
        if number > _LINES_ABOVE or len(above) == HEADER_ROWS:
            return None
        if not line.strip() or is_separator_line(line):
            continue
        comment = is_comment_line(line)
        upper = above[-1][1] if above else ""

        def accepted(
            cells: list[str], delimiter: str, upper: str = upper
        ) -> tuple[Layout, tuple[Heading, ...]] | None:
            over = split_cells(upper, delimiter) if upper else None
            return recognise(cells, over or (), source.mapping)

        found = None if comment and not commented else best_split(line.lstrip("# "), accepted)
        if found is None:
            if comment:
                read_comment_row(metadata, (number, _comment_cells(line)), source)
            else:
                above.append((number, line))
            continue
        delimiter, (layout, headings) = found
        rows_above = [(k, split_cells(one, delimiter) or [one]) for k, one in above]
        label = read_rows_above(metadata, rows_above)
        rows = _rows(lines, delimiter, source)
        certain = "." if delimiter == "," else ""
        return build_table(
            source, layout, headings, number, metadata, rows, certain=certain, label=label
        )
    return None


def best_split(line: str, accepted: Callable[[list[str], str], _T | None]) -> tuple[str, _T] | None:
    """Return delimiter and headings where most cells come out that are headings at all."""
    best: tuple[int, str, _T] | None = None
    for delimiter in DELIMITERS:
        cells = split_cells(line, delimiter)
        found = None if cells is None else accepted(cells, delimiter)
        if cells is not None and found is not None and (best is None or len(cells) > best[0]):
            best = len(cells), delimiter, found
    return None if best is None else best[1:]


def _rows(lines: Iterator[_Line], delimiter: str, source: TableSource) -> Iterator[Row]:
    for number, line in lines:
        if not line:
            continue
        if is_comment_line(line):
            yield number, _comment_cells(line)
            continue
        cells = split_cells(line, delimiter)
        if cells is None:
            raise MeasurementFileError("quotation_marks", place=source.at(number))
        yield number, cells


def _check_open_end(table: Table, last_line: int) -> None:
    """Look whether a file without a last line end was cut short inside its last cell."""
    lines = table.source.lines  # of a table whose rows were exchanged with its columns
    if (int(table.row[-1]) if lines is None else lines[-1]) != last_line:
        return
    cells = table.columns[-1]
    numeric = numeric_cells(cells, table.decimal) is not None
    lengths = [
        -1 if not cell else len(cell.partition(table.decimal)[2] if numeric else cell)
        for cell in cells
    ]
    if len(lengths) > 1 and lengths[-1] < min(lengths[:-1]):
        raise MeasurementFileError(
            "cut_short", place=table.at(len(cells) - 1, len(table.columns) - 1)
        )
    table.metadata.remarks.append(remark("no_line_end"))


def split_cells(line: str, delimiter: str) -> list[str] | None:
    """Return the cells of a line without blanks around them; None if quotation marks differ."""
    if delimiter == "|":  # Markdown has one at each end too
        line = line.strip().removeprefix("|").removesuffix("|")
    if '"' not in line:
        return [cell.strip() for cell in line.split(delimiter)]
    try:
        rows = list(csv.reader([line], delimiter=delimiter, strict=True, skipinitialspace=True))
    except csv.Error:
        return None
    return [cell.strip() for cell in rows[0]] if rows else None


def is_separator_line(line: str) -> bool:
    """Say whether a line tells a spreadsheet program what separates cells."""
    return _SEPARATOR_LINE.fullmatch(line) is not None


def is_comment_line(line: str) -> bool:
    """Say whether a line is a comment, also where a spreadsheet program has put it in quotes."""
    start = line.lstrip()
    return start.startswith(("#", '"#')) and not start.lstrip('"').startswith(CELL_ERRORS)


def _comment_cells(line: str) -> list[str]:
    """Return the comment as one cell, also where a spreadsheet program has put it in quotes."""
    text = line.strip().rstrip(",;\t ")
    if text.startswith('"'):
        for delimiter in DELIMITERS:
            cells = split_cells(text, delimiter)
            if cells is not None:
                return [cells[0]]
        text = text.removeprefix('"')
    return [text]


def _lines(text: str, source: TableSource) -> Iterator[_Line]:
    """Yield each line with its number; a text in quotation marks may hold line ends."""
    start, number = 0, 1
    while start <= len(text):
        end = _end_of_line(text, start)
        if end - start > LONGEST_LINE:
            raise MeasurementFileError("line_too_long", most=LONGEST_LINE, place=source.at(number))
        line = text[start:end]
        joined = 0
        if line.count('"') % 2 and not is_comment_line(line) and _OPENING_QUOTE.search(line):
            end, joined = _end_of_quoted(text, start, end)
            line = text[start:end]
        yield number, line
        start, number = end + 1, number + 1 + joined


def _end_of_line(text: str, start: int) -> int:
    end = text.find("\n", start)
    return len(text) if end < 0 else end


def _end_of_quoted(text: str, start: int, first_end: int) -> tuple[int, int]:
    end = first_end
    for joined in range(1, _LINES_OF_A_CELL):
        if end == len(text):
            break
        end = _end_of_line(text, end + 1)
        if end - start > LONGEST_LINE:
            break
        if text.count('"', start, end) % 2 == 0:
            return end, joined
    return first_end, 0
