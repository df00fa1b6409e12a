"""A table of text cells under a row of headings, whatever kind of file it came from."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import zip_longest
from typing import NoReturn, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, Place, remark
from thermaxis.errors import MeasurementFileError
from thermaxis.files.table._columns import (
    QUANTITIES,
    Heading,
    Pass,
    Role,
    direction_named,
    label_named,
    parse_heading,
    pass_named,
    without_unit,
)
from thermaxis.files.table._mapping import NO_MAPPING, RunMapping
from thermaxis.files.table._metadata import Metadata
from thermaxis.files.table._numbers import numeric_cells, without_missing
from thermaxis.files.table._source import (
    NUMBER_LIMIT,
    clean_text,
    first_few,
    is_number,
    parse_number,
    unprotected,
)
from thermaxis.positioning import APPROACHES, BACKWARD, FORWARD, FloatArray

Row: TypeAlias = tuple[int, Sequence[str]]
"""Number of a row in its file, from 1, and its cells without blanks at their ends."""

HEADER_ROWS = 100
"""Rows among which the headings are looked for, comments not counted. [1]"""
MAX_COLUMNS = 4096
"""Largest number of columns of a table. [1]"""
MAX_ROWS = 2_000_000
"""Largest number of rows of a table. [1]"""

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
CELL_ERRORS = ("#N/A", "#NAME?", "#NULL!", "#NUM!", "#REF!", "#VALUE!", "#DIV/0!", "#GETTING_DATA")
_LONGEST_SHOWN = 40
_COLUMNS_SHOWN = 8


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
    sheet: str | None = None
    """Sheet of a workbook, None for a text file."""
    mapping: RunMapping = NO_MAPPING
    """What the user says about the file."""
    lines: tuple[int, ...] | None = None
    """Of a transposed table: the rows of the file that became its columns. [1]"""

    @property
    def row_word(self) -> str:
        """What a row is called in this kind of file."""
        return "line" if self.sheet is None else "row"

    def at(self, row: int | None = None, column: int = 0, heading: str = "") -> Place:
        """Return the place of a row, or of the whole table."""
        if self.lines is not None and row is not None:
            line = self.lines[column] if column < len(self.lines) else None
            return replace(self, lines=None).at(line, row - 1, str(row))
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
    heading_row: int
    """Number of the row of headings. [1]"""
    headings: tuple[Heading, ...]
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
        if values is None and not required:
            values = self.measured_numbers(column)
        if values is None or bool((np.abs(values) > NUMBER_LIMIT).any()):
            self._raise_first_wrong(column)
        if required and bool(np.isnan(values).any()):
            index = int(np.flatnonzero(np.isnan(values))[0])
            before = self.row[index - 1] if index else self.heading_row
            raise MeasurementFileError(
                "row_incomplete", last=int(before), place=self.at(index, column)
            )
        return values

    def measured_numbers(self, column: int) -> FloatArray | None:
        """Return the numbers of a column with words for what is missing; None if it has others."""
        cells, words = without_missing(self.columns[column])
        values = numeric_cells(cells, self.decimal) if words else None
        if values is not None:
            said = (remark("word_in_cells", word=word, count=n) for word, n in words.items())
            self.metadata.remarks += said
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


def recognise(
    cells: Sequence[str], above: Sequence[str] = (), mapping: RunMapping = NO_MAPPING
) -> tuple[Layout, tuple[Heading, ...]] | None:
    """Say whether a row, with the one above it, holds the headings of a table of readings."""
    joined = merged_heads(above, cells)
    found = None if joined is None else _recognised(joined, mapping)
    return found or _recognised(cells, mapping)


def _recognised(
    cells: Sequence[str], mapping: RunMapping
) -> tuple[Layout, tuple[Heading, ...]] | None:
    if not 2 <= len(cells) <= MAX_COLUMNS:
        return None
    headings = tuple(parse_heading(unprotected(cell), mapping) for cell in cells)
    letters = {heading.approach for heading in headings if heading.by_letter}
    if len(letters) == 1:  # F1, F2 alone may be anything
        headings = tuple(Heading(h.text, None) if h.by_letter else h for h in headings)
    roles = {heading.role for heading in headings}
    passes = sum(heading.is_pass for heading in headings)
    target = next((h for h in headings if h.role is Role.TARGET), None)
    enough = 2 if target is None or target.unit is None else 1
    if target is not None and passes >= enough and not roles & _PASS_ROLES:
        return Layout.WIDE, headings
    if len(roles & _READING_ROLES) >= 2:
        return Layout.TIDY, headings
    return None


def merged_heads(above: Sequence[str], below: Sequence[str]) -> list[str] | None:
    """Join two rows of headings, the upper one merged over columns; None if it names no pass."""
    sides = [direction_named(cell) if cell else None for cell in above]
    if {FORWARD, BACKWARD} <= {*sides}:  # "pos" before a number would be a position
        above = [
            c if side is None else APPROACHES[side] for c, side in zip(above, sides, strict=True)
        ]
    labels = [bool(cell) and _names_a_pass(cell) for cell in above]
    if not any(labels) or (labels[0] and not any(above[1:])):
        return None
    joined: list[str] = []
    spans: list[int] = []
    label = ""
    for k, (upper, lower) in enumerate(zip_longest(above, below, fillvalue="")):
        if upper:
            label = upper if labels[k] else ""
            spans += [0] if label else []
        if label and pass_named(lower.casefold()) is not None:
            spans[-1] += 1
        both = (label, lower) if label == without_unit(label) else (lower, label)  # a unit is last
        joined.append((" ".join(both) if lower else "") if label else upper or lower)
    return joined if len(set(spans)) == 1 else None  # else the rows are shifted


def is_comment(cells: Sequence[str]) -> bool:
    """Say whether a row is a comment: its first cell starts with a number sign."""
    return cells[0].startswith("#") and not cells[0].startswith(CELL_ERRORS)


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


def _names_a_pass(cell: str) -> bool:
    return direction_named(cell) is not None or label_named([without_unit(cell)]) is not None


def read_rows_above(metadata: Metadata, rows: Sequence[Row]) -> Pass | None:
    """Take header fields from the rows above the headings; return the pass the last one names."""
    filled = [cell for cell in rows[-1][1] if cell] if rows else []
    label = label_named(filled) if filled else None
    merged = len(filled) > 1 and all(_names_a_pass(cell) for cell in filled)
    numbers: list[Row] = []
    for row in rows[:-1] if merged or label is not None else rows:
        if sum(is_number(cell, decimal=",") or is_number(cell) for cell in row[1]) > 1:
            numbers.append(row)
        else:
            read_above(metadata, row)
    if numbers:
        metadata.remarks.append(left_out_remark(numbers))
    return label


def left_out_remark(rows: Sequence[Row]) -> Message:
    """Name the rows that hold no readings."""
    texts = [next((cell for cell in cells if cell), "") for _, cells in rows]
    return remark(
        "rows_left_out",
        count=len(rows),
        rows=first_few([str(number) for number, _ in rows]),
        names=listed([clean_text(text, limit=_LONGEST_SHOWN) for text in texts]),
    )


def read_comment_row(metadata: Metadata, row: Row, source: TableSource) -> None:
    """Take what a row of comment says."""
    metadata.read_comment(row[1][0].lstrip("# \t"), source.at(row[0]))


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
        start=start_of_mapping(cells),
        place=source.at(number),
    )


def _reading_roles(cells: Sequence[str]) -> set[Role]:
    roles = {parse_heading(unprotected(cell)).role for cell in cells[:MAX_COLUMNS]}
    return {role for role in _READING_ROLES if role in roles}


def turned(
    source: TableSource, rows: Sequence[Row], metadata: Metadata
) -> tuple[TableSource, list[Row]]:
    """Exchange rows and columns of the longest rows; the others are lines above the table."""
    width = max((len(cells) for _, cells in rows), default=0)
    whole = [(number, cells) for number, cells in rows if len(cells) == width]
    for row in rows:
        if len(row[1]) < width:
            read_above(metadata, row)
    lines = tuple(number for number, _ in whole)
    columns = zip(*(cells for _, cells in whole), strict=True)
    return replace(source, lines=lines), [(k + 1, column) for k, column in enumerate(columns)]


def looks_turned(table: Table) -> bool:
    """Say whether a table is one whose headings stand in its first column.

    That is so where the numbers of its runs can be none, and those of its targets can. Where both
    or none of them can, either may be meant.
    """
    passes = (heading for heading in table.headings if heading.is_pass)
    worded = any(not h.text.isdecimal() or h.approach is not None for h in passes)
    if table.layout is Layout.TIDY or worded:
        return False
    heads = [heading.text for heading in table.headings if is_number(heading.text)]
    if table.source.mapping.transposed is not None:
        return table.source.mapping.transposed
    upright = _are_runs(heads, 2 * len(heads) + 2)
    first = table.headings[0].role is Role.TARGET
    if upright == (first and _are_runs(table.columns[0], len(table.row) + 2)):
        if len(set(heads)) < len(heads):
            return False  # numbers of the same run stand twice, which is said of them
        raise MeasurementFileError(
            "runs_or_targets", runs=len(heads), targets=len(table.row), place=table.at()
        )
    return not upright


def _are_runs(cells: Sequence[str], most: int) -> bool:
    """Say whether cells can be the numbers of runs, of which few are missing."""
    numbers = {int(cell) for cell in cells if cell.isdecimal() and len(cell) < 6}
    return len(numbers) == len(cells) and 1 <= min(numbers) and max(numbers) <= most


def start_of_mapping(cells: Sequence[str]) -> str:
    """Write a mapping, TOML, for headings of which some are not understood."""
    entries = [
        f'{json.dumps(cell, ensure_ascii=False)} = "{parse_heading(cell).role or "..."}"'
        for cell in (clean_text(cell, limit=_LONGEST_SHOWN) for cell in cells[:_COLUMNS_SHOWN])
        if cell
    ]
    return f"columns = {{ {', '.join(entries)} }}"


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
