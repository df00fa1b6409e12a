"""Compensation value tables ``.COM`` of HEIDENHAIN controls: what both forms have in common."""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.codes import Message, Place
from thermaxis.controls._control import (
    Control,
    ProgramRequest,
    TableText,
    TouchRequest,
    advice,
    finding,
    number_in_table,
    plain_number,
    text_lines,
)
from thermaxis.controls.heidenhain._klartext import (
    KLARTEXT_HEATING,
    PROGRAM_OPTIONS,
    klartext_program,
    klartext_touch,
)
from thermaxis.errors import ConfigurationError, MeasurementFileError
from thermaxis.positioning import CompensationTable
from thermaxis.quantities import AxisKind

MOST_POINTS = 256
"""Largest number of rows of a table. [1]"""
DECIMALS = 4
"""Decimals of positions and values. [1]"""
LARGEST_NUMBER = 99_999.0
"""Largest magnitude of a position or value that fits its column. [mm or deg]"""
LONGEST_LINE = 1000
"""Longest line that is read; 18 columns of axes take 300. [character]"""
HALF_DIGIT = 0.5 * 10.0**-DECIMALS
"""Half of the last decimal. [mm or deg]"""

_WORD = re.compile(r"\S+")
_NUMBER = re.compile(r"[+-]?(?:[0-9]{1,9}(?:\.[0-9]{0,12})?|\.[0-9]{1,12})")
_NAMED = re.compile(r"AXIS[-_](?P<axis>[A-Z][A-Z0-9]{0,7})", re.IGNORECASE)
_COLUMN_SLACK = 1  # a sign may stand before its column


def signed(value: float) -> str:
    """Return a number with its sign, as these tables show it."""
    text = plain_number(value, DECIMALS)
    if abs(value) > LARGEST_NUMBER:
        raise ConfigurationError(
            "value_wider_than_column", value=value, largest=LARGEST_NUMBER, key="points"
        )
    return text if text.startswith("-") else f"+{text}"


def check_positions(table: CompensationTable) -> None:
    """Refuse points that four decimals cannot hold."""
    off = np.abs(table.position - np.round(table.position, DECIMALS))
    if bool(np.any(off > 1e-7)):
        raise ConfigurationError("points_too_fine", decimals=DECIMALS, key="points")


def value_unit(kind: AxisKind) -> float:
    """Return how large one unit of a table's value is."""
    return kind.units.deviations_per_position


def _advice(table: CompensationTable, file_name: str) -> Iterator[Message]:
    """Say what the user of a table must know, whatever the form."""
    if table.reference_position is None:
        yield advice("heidenhain_no_zero")
    else:
        unit = table.kind.units.position
        yield advice("heidenhain_zero", position=table.reference_position, unit=unit)
    yield advice("heidenhain_activation", name=file_name)
    yield advice("heidenhain_no_comment")
    if table.kind is AxisKind.ROTARY:
        yield advice("heidenhain_degrees")


class HeidenhainControl(Control):
    """What both generations share: the Klartext program, and how lines end and numbers read.

    Not protected: a program moves one axis and knows nothing of what stands in its way. A table
    acts when the active line of a ``.CMA`` table names it; its sign is from a secondary source,
    and whether it fits is shown by a measurement only. No machine has proven either yet.
    """

    unit = advice("heidenhain_unit")
    newline = "\r\n"
    options = PROGRAM_OPTIONS
    heating = KLARTEXT_HEATING

    def format_program(self, request: ProgramRequest) -> str:
        """Return the Klartext program of a plan, see `klartext_program`."""
        return klartext_program(request, self.title)

    def format_touch(self, request: TouchRequest) -> str:
        """Return the Klartext program of a touch, see `klartext_touch`."""
        return klartext_touch(request, self.title)

    def written(
        self, lines: Iterable[str], table: CompensationTable, name: str, *own: Message
    ) -> TableText:
        """Return the lines of a table with what its user must know."""
        return TableText(
            text="".join(line + self.newline for line in lines),
            advice=(*own, *_advice(table, name)),
        )


@final
@dataclass(frozen=True, slots=True)
class ComText:
    """A table's text, its lines and their defects."""

    path: str
    lines: tuple[str, ...]
    """Its lines without their ends, blank lines at the end left out."""
    findings: tuple[Message, ...] = ()
    """What is unusual about the ends of its lines."""

    def at(self, line: int, column: str = "") -> Place:
        """Return a place of the table."""
        return Place(self.path, line, column)

    def numbers(
        self, line: int, words: list[tuple[int, str]], headings: Mapping[str, int]
    ) -> dict[str, float]:
        """Return the numbers of a row by the heading that each stands under."""
        row: dict[str, float] = {}
        for begin, word in words:
            column = column_of(begin, headings)
            if column is None or column in row:
                text = word[:99]
                raise MeasurementFileError("value_without_heading", text=text, place=self.at(line))
            row[column] = self.number(word, line, column)
        return row

    def number(self, word: str, line: int, column: str) -> float:
        """Return a number as the control reads it."""
        return number_in_table(word, _NUMBER, LARGEST_NUMBER, self.at(line, column))


def com_text(text: str, path: str) -> ComText:
    """Return the lines of a table."""
    lines, findings = text_lines(text, path)
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        raise MeasurementFileError("file_empty", file=path)
    for number, line in enumerate(lines, start=1):
        if len(line) > LONGEST_LINE:
            raise MeasurementFileError(
                "table_line_too_long", most=LONGEST_LINE, file=path, line=number
            )
        if "\t" in line:
            raise MeasurementFileError("table_line_has_tab", file=path, line=number)
    return ComText(path, tuple(lines), tuple(findings))


def words_of(line: str) -> list[tuple[int, str]]:
    """Return the words of a line and where each begins."""
    return [(found.start(), found.group()) for found in _WORD.finditer(line)]


def check_numbering(source: ComText, word: str, line: int, expected: int) -> None:
    """Refuse a row that is not the next one, or beyond the control's number of rows."""
    if not re.fullmatch(r"[0-9]{1,6}", word):
        raise MeasurementFileError(
            "row_without_number", text=word[:99], place=source.at(line, "NR")
        )
    if int(word) != expected:
        raise MeasurementFileError(
            "row_out_of_order",
            number=int(word),
            expected=expected,
            place=source.at(line, "NR"),
        )
    if expected >= MOST_POINTS:
        raise MeasurementFileError("too_many_rows", most=MOST_POINTS, place=source.at(line))


def column_of(place: int, headings: Mapping[str, int]) -> str | None:
    """Return the heading under which a word stands."""
    under = [name for name, start in headings.items() if start <= place + _COLUMN_SLACK]
    return under[-1] if under else None


def headings_of(source: ComText, first: tuple[str, ...]) -> dict[str, int]:
    """Return where the headings of a table begin, from left to right, NR left out."""
    words = words_of(source.lines[1].upper()) if len(source.lines) > 1 else []
    labels = [word for _, word in words]
    if tuple(labels[: len(first)]) != first:
        raise MeasurementFileError("headings_missing", headings=first, place=source.at(2))
    if len(set(labels)) != len(labels):
        raise MeasurementFileError("heading_stated_twice", place=source.at(2))
    return {word: place for place, word in words[1:]}


def rows_of(source: ComText, *, needs_end: bool) -> Iterator[tuple[int, list[tuple[int, str]]]]:
    """Yield the numbered rows from the third line up to ``[END]``: line, and words behind NR."""
    ends = [i for i, line in enumerate(source.lines) if line.strip().upper() == "[END]"]
    if ends and ends[0] < len(source.lines) - 1:
        raise MeasurementFileError("lines_behind_end", place=source.at(ends[0] + 2))
    if needs_end and not ends:
        raise MeasurementFileError(
            "table_cut_short", end="[END]", place=source.at(len(source.lines))
        )
    rows = source.lines[2 : ends[0] if ends else None]
    if not rows:
        raise MeasurementFileError("table_without_rows", file=source.path)
    for number, content in enumerate(rows):
        words = words_of(content)
        if not words:
            raise MeasurementFileError("table_line_empty", place=source.at(number + 3))
        check_numbering(source, words[0][1], number + 3, number)
        yield number + 3, words[1:]


def findings_on_others(others: Iterable[str]) -> list[Message]:
    """Return what is said of the columns that are not simulated."""
    listed = tuple(sorted(others))
    if not listed:
        return []
    return [finding("other_axes_not_simulated", axes=listed)]


def own_column(source: ComText, name: str, labels: list[str]) -> tuple[str, list[Message]]:
    """Return the column of the axis whose positions the rows have, and what is unusual."""
    if not labels:
        raise MeasurementFileError("axis_heading_missing", place=source.at(2))
    named = _NAMED.fullmatch(name)
    file_axis = None if named is None else named["axis"].upper()
    if file_axis in labels:
        return file_axis, []
    if file_axis is not None:
        raise MeasurementFileError(
            "other_axis_columns", axis=file_axis, columns=tuple(labels), place=source.at(2)
        )
    if len(labels) > 1:
        raise MeasurementFileError("axis_not_named", columns=tuple(labels), place=source.at(1))
    return labels[0], [finding("axis_by_column", axis=labels[0])]
