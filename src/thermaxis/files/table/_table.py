"""A table of text cells under a row of headings, whatever kind of file it came from."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import chain
from typing import NoReturn, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Place, remark
from thermaxis.errors import MeasurementFileError
from thermaxis.files.table._columns import QUANTITIES, Heading, Role, parse_heading, unit_named
from thermaxis.files.table._metadata import Metadata
from thermaxis.files.table._quoting import unprotected
from thermaxis.files.table._source import (
    NUMBER_LIMIT,
    clean_text,
    first_few,
    is_number,
    parse_number,
)
from thermaxis.positioning import FloatArray

Row: TypeAlias = tuple[int, Sequence[str]]
"""Number of a row in its file, from 1, and its cells without blanks at their ends."""

HEADER_ROWS = 100
"""Rows among which the headings are looked for, comments not counted. [1]"""
MAX_COLUMNS = 4096
"""Largest number of columns of a table. [1]"""
MAX_ROWS = 2_000_000
"""Largest number of rows of a table. [1]"""

_CHUNK_ROWS = 4096
_BESIDE_REMARK = remark("cells_beside")
_NUMBER_CHARACTERS = frozenset("0123456789+-.eE\n")
_CELL_ERRORS = ("#N/A", "#NAME?", "#NULL!", "#NUM!", "#REF!", "#VALUE!", "#DIV/0!", "#GETTING_DATA")
_READING_ROLES = frozenset(
    {Role.TARGET, Role.MEASURED, Role.DEVIATION, Role.CYCLE, Role.RUN, Role.DIRECTION}
)
_PASS_ROLES = frozenset({Role.CYCLE, Role.RUN, Role.DIRECTION})
_REQUIRED = (
    (Role.TARGET,),
    (Role.DEVIATION, Role.MEASURED),
    (Role.CYCLE, Role.RUN),
    (Role.DIRECTION, Role.RUN),
)
_LONGEST_SHOWN = 40
_SIGNS = str.maketrans({"\N{MINUS SIGN}": "-"})


class Layout(StrEnum):
    """How readings are laid out in a table."""

    TIDY = "tidy"
    """One reading per row."""
    WIDE = "wide"
    """One target per row, one run per column."""


@final
@dataclass(frozen=True, slots=True)
class TableSource:
    """Where a table comes from, for errors."""

    path: str
    """The file."""
    sheet: str | None = None
    """Sheet of a workbook, None for a text file."""

    @property
    def row_word(self) -> str:
        """What a row is called in this kind of file."""
        return "line" if self.sheet is None else "row"

    def at(self, row: int | None = None, column: int = 0, heading: str = "") -> Place:
        """Return the place of a row, or of the whole table."""
        if self.sheet is None:
            return Place(self.path, row, heading)
        cell = "" if row is None else f"!{column_letters(column)}{row}"
        return Place(self.path, column=heading, cell=self.sheet + cell)


@final
@dataclass(frozen=True, slots=True)
class Table:
    """Text cells by column, with what their headings mean."""

    source: TableSource
    """Where the table comes from."""
    layout: Layout
    """Tidy or wide."""
    heading_row: int
    """Number of the row of headings. [1]"""
    headings: tuple[Heading, ...]
    """One per column."""
    row: NDArray[np.int64]
    """Number of each row in its file, (k,). [1]"""
    columns: tuple[Sequence[str], ...]
    """Cells by column, each of length k."""
    decimal: str
    """Decimal sign of the numbers."""
    metadata: Metadata
    """What stands in comments and above the headings."""

    def at(self, index: int | None = None, column: int | None = None) -> Place:
        """Return the place of a cell by the index of its row; without one, of the headings."""
        row = self.heading_row if index is None else int(self.row[index])
        heading = "" if column is None else self.headings[column].text
        return self.source.at(row, column or 0, heading)

    def column_of(self, role: Role) -> int | None:
        """Return the index of the column with a role, None if there is none.

        Of several columns of a quantity the only one that states its unit is taken.
        """
        found = [i for i, heading in enumerate(self.headings) if heading.role is role]
        if len(found) > 1 and role in QUANTITIES:
            with_unit = [i for i in found if self.headings[i].unit is not None]
            found = with_unit if len(with_unit) == 1 else found
        if len(found) > 1:
            raise MeasurementFileError(
                "two_columns_of_a_role",
                first=self.headings[found[0]].text,
                second=self.headings[found[1]].text,
                role=role,
                place=self.at(column=found[1]),
            )
        return found[0] if found else None

    def numbers(self, column: int, *, required: bool = False) -> FloatArray:
        """Return the numbers of a column, (k,), NaN where a cell is empty."""
        values = numeric_cells(self.columns[column], self.decimal)
        if values is None or bool(np.any(np.abs(values) > NUMBER_LIMIT)):
            self._raise_first_wrong(column)
        if required and bool(np.isnan(values).any()):
            raise MeasurementFileError(
                "number_missing", place=self.at(int(np.flatnonzero(np.isnan(values))[0]), column)
            )
        return values

    def whole_numbers(self, column: int) -> NDArray[np.int64]:
        """Return the whole numbers of a column without empty cells, (k,)."""
        values = self.numbers(column, required=True)
        wrong = np.flatnonzero(values != np.rint(values))
        if wrong.size:
            place = self.at(int(wrong[0]), column)
            raise MeasurementFileError(
                "not_a_whole_number", text=self.columns[column][int(wrong[0])], place=place
            )
        return values.astype(np.int64)

    def _raise_first_wrong(self, column: int) -> NoReturn:
        for index, cell in enumerate(self.columns[column]):
            if not cell:
                continue
            if cell.startswith("=") and self.source.sheet is not None:
                raise MeasurementFileError("formula_without_value", place=self.at(index, column))
            parse_number(cell, self.at(index, column), decimal=self.decimal)
        raise MeasurementFileError("column_of_no_numbers", place=self.at(column=column))


def column_letters(column: int) -> str:
    """Name a column of a workbook: 0 is A, 26 is AA."""
    letters = ""
    column += 1
    while column:
        column, rest = divmod(column - 1, 26)
        letters = chr(ord("A") + rest) + letters
    return letters


def numeric_cells(cells: Sequence[str], decimal: str) -> FloatArray | None:
    """Read a column of cells as numbers, NaN where a cell is empty."""
    text = "\n".join(cells)
    if decimal != ".":
        if "." in text:
            return None
        text = text.replace(decimal, ".")
    if not _NUMBER_CHARACTERS.issuperset(text) or text.count("\n") != len(cells) - 1:
        return None
    try:
        return np.array([float(cell) if cell else np.nan for cell in text.split("\n")])
    except ValueError:
        return None


def recognise(cells: Sequence[str]) -> tuple[Layout, tuple[Heading, ...]] | None:
    """Say whether a row holds the headings of a table of readings."""
    if not 2 <= len(cells) <= MAX_COLUMNS:
        return None
    headings = tuple(parse_heading(unprotected(cell)) for cell in cells)
    roles = {heading.role for heading in headings}
    runs = sum(heading.run is not None for heading in headings)
    target = next((h for h in headings if h.role is Role.TARGET), None)
    enough = 2 if target is None or target.unit is None else 1
    if target is not None and runs >= enough and not roles & _PASS_ROLES:
        return Layout.WIDE, headings
    if len(roles & _READING_ROLES) >= 2:
        return Layout.TIDY, headings
    return None


def is_comment(cells: Sequence[str]) -> bool:
    """Say whether a row is a comment: its first cell starts with a number sign."""
    return cells[0].startswith("#") and not cells[0].startswith(_CELL_ERRORS)


def read_above(metadata: Metadata, row: Row) -> None:
    """Take a header field from a row above the headings: `key: value` or key and value cells."""
    filled = [cell for cell in row[1] if cell]
    if not filled:
        return
    key, colon, value = filled[0].partition(":")
    rest = [value.strip(), *filled[1:]] if colon else filled[1:]
    text = ", ".join(cell for cell in rest if cell)
    if text:
        metadata.read_pair(key, unprotected(text))
    elif not colon and "title" not in metadata.header:
        metadata.read_pair("title", unprotected(key))


def read_comment_row(metadata: Metadata, row: Row, source: TableSource) -> None:
    """Take what a row of comment says."""
    metadata.read_comment(row[1][0].lstrip("# \t"), source.at(row[0]))


def build_table(
    source: TableSource,
    layout: Layout,
    headings: tuple[Heading, ...],
    heading_row: int,
    metadata: Metadata,
    rows: Iterable[Row],
    *,
    decimal_comma: bool,
) -> Table:
    """Collect the rows below the headings."""
    width = len(headings)
    while width and not headings[width - 1].text:
        width -= 1
    numbers: list[int] = []
    columns: list[list[str]] = [[] for _ in range(width)]
    chunk: list[Sequence[str]] = []
    headings, rows = _with_units_below(headings, iter(rows))
    for number, found in rows:
        cells = found
        if is_comment(cells):
            read_comment_row(metadata, (number, cells), source)
            continue
        if len(cells) != width and any(cells):
            cells = _fitted(cells, width, number, source, metadata)
        if not any(cells):
            continue
        numbers.append(number)
        chunk.append(cells)
        if len(chunk) == _CHUNK_ROWS:
            _move_to_columns(chunk, columns)
        if len(numbers) > MAX_ROWS:
            raise MeasurementFileError(
                "too_many_rows_to_read", most=MAX_ROWS, place=source.at(number)
            )
    _move_to_columns(chunk, columns)
    if not numbers:
        raise MeasurementFileError("no_readings_in_file", place=source.at(heading_row))
    row = np.array(numbers, dtype=np.int64)
    decimal = _decimal_sign(source, headings[:width], row, columns) if decimal_comma else "."
    return Table(
        source, layout, heading_row, headings[:width], row, tuple(columns), decimal, metadata
    )


def no_table(source: TableSource, rows: Sequence[tuple[TableSource, Row]]) -> MeasurementFileError:
    """Make the error of a file in which no row of headings was found; it names the nearest row."""
    if not rows:
        return MeasurementFileError("no_run_headings", rows=HEADER_ROWS, place=source.at())
    known = [_reading_roles(cells) for _, (_, cells) in rows]
    nearest = max(range(len(rows)), key=lambda k: len(known[k]))  # the first of equals
    source, (number, cells) = rows[nearest]
    words = listed([clean_text(cell, limit=_LONGEST_SHOWN) for cell in cells if cell])
    missing = [" or ".join(one_of) for one_of in _REQUIRED if not known[nearest] & set(one_of)]
    return MeasurementFileError(
        "run_headings_incomplete",
        rows=HEADER_ROWS,
        nearest=words,
        missing=tuple(missing),
        place=source.at(number),
    )


def _reading_roles(cells: Sequence[str]) -> set[Role]:
    roles = {parse_heading(unprotected(cell)).role for cell in cells[:MAX_COLUMNS]}
    return {role for role in _READING_ROLES if role in roles}


def _with_units_below(
    headings: tuple[Heading, ...], rows: Iterator[Row]
) -> tuple[tuple[Heading, ...], Iterator[Row]]:
    """Take units from a second row of headings, if the first one states none."""
    needy = [k for k, heading in enumerate(headings) if _lacks_unit(heading)]
    first = next(rows, None)
    if first is None or not needy:
        return headings, rows if first is None else chain((first,), rows)
    cells = [*first[1], *([""] * len(headings))]
    units = {k: unit_named(cells[k].strip("()[] ")) for k in needy}
    if None in units.values():
        return headings, chain((first,), rows)
    return tuple(
        replace(heading, unit=units.get(k, heading.unit)) for k, heading in enumerate(headings)
    ), rows


def _lacks_unit(heading: Heading) -> bool:
    return heading.role in QUANTITIES and heading.unit is None and not heading.unit_text


def _move_to_columns(chunk: list[Sequence[str]], columns: list[list[str]]) -> None:
    for column, cells in zip(columns, zip(*chunk, strict=True), strict=bool(chunk)):
        # the minus sign of typesetting: nothing else can be meant by it
        plain = "\N{MINUS SIGN}" not in "".join(cells)
        column.extend(cells if plain else [cell.translate(_SIGNS) for cell in cells])
    chunk.clear()


def _fitted(
    cells: Sequence[str], width: int, row: int, source: TableSource, metadata: Metadata
) -> Sequence[str]:
    if len(cells) > width and not any(cells[width:]):
        return cells[:width]
    if source.sheet is None:
        raise MeasurementFileError(
            "cells_and_headings", cells=len(cells), headings=width, place=source.at(row)
        )
    if len(cells) > width and _BESIDE_REMARK not in metadata.remarks:
        metadata.remarks.append(_BESIDE_REMARK)
    return [*cells[:width], *([""] * (width - len(cells)))]


def _decimal_sign(
    source: TableSource,
    headings: tuple[Heading, ...],
    row: NDArray[np.int64],
    columns: Sequence[Sequence[str]],
) -> str:
    first: dict[str, tuple[int, int]] = {}
    for column, cells in enumerate(columns):
        heading = headings[column]
        text = "".join(cells)
        numeric = _NUMBER_CHARACTERS.issuperset(text.replace(",", ""))
        if not numeric and heading.role is None and heading.run is None:
            continue
        for sign, other in ((".", ","), (",", ".")):
            if sign not in text or sign in first:
                continue
            for index, cell in enumerate(cells):
                if sign in cell and other not in cell and is_number(cell, decimal=sign):
                    first[sign] = (index, column)
                    break
    if len(first) == 2:
        (i, _), (j, column) = first["."], first[","]
        place = source.at(int(row[j]), column, headings[column].text)
        raise MeasurementFileError("decimal_signs_mixed", row=int(row[i]), place=place)
    return "," if "," in first else "."


def unique_names(headings: Sequence[Heading], columns: Sequence[int]) -> list[str]:
    """Name the channels of a table so that no two have the same name."""
    names: dict[str, int] = {}
    for column in columns:
        name = base = headings[column].channel_name or f"column {column + 1}"
        while name in names:
            names[base] += 1
            name = f"{base} ({names[base]})"
        names[name] = 1
    return list(names)


def listed(names: Sequence[str]) -> str:
    """List headings in quotation marks, the first few of many."""
    return first_few([f"'{name}'" for name in names])
