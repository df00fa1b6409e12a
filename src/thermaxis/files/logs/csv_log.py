"""Thermal logs as CSV: one row per time, one column per channel."""

import codecs
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias, final

import numpy as np

from thermaxis.codes import Message, Place, remark
from thermaxis.errors import MeasurementFileError
from thermaxis.files._opened import opened
from thermaxis.files.logs._cells import numbers_or_words
from thermaxis.files.logs._columns import (
    MOST_COLUMNS,
    ColumnPlan,
    ColumnValues,
    LogTable,
    are_headings,
    build_log,
    parse_log_heading,
    plan_columns,
)
from thermaxis.files.settings import ThermalMapping
from thermaxis.files.table import (
    FALLBACK_ENCODING,
    best_split,
    check_is_text,
    decode_text,
    decoded,
    is_comment_line,
    is_number,
    is_separator_line,
    parse_moment,
    read_content,
    read_start,
    split_cells,
)
from thermaxis.positioning import FloatArray
from thermaxis.thermal import ThermalLog
from thermaxis.thermal.log import unit_named

if TYPE_CHECKING:
    import polars as pl

FILE_LIMIT_BYTES = 1_000_000_000
"""Largest CSV file of a log; a longer record belongs into Parquet. [byte]"""
MOST_VALUES = 150_000_000
"""Largest number of values of a CSV file: 1.2 GB in memory. [1]"""
LONGEST_LINE = 1_000_000
"""Longest line. [byte]"""

_CHUNK_BYTES = 32_000_000
_HEAD_LINES = 200
_Numbers: TypeAlias = "range | list[int]"
_SIGNIFICANT = ("start", "origin_s", "remark")
_COMMA_NUMBER = re.compile(r"(?<![0-9.])[0-9]+,[0-9]")


def read_thermal_csv(
    path: Path | str,
    *,
    mapping: ThermalMapping | None = None,
    sample_time_s: float | None = None,
    fallback_encoding: str = FALLBACK_ENCODING,
) -> ThermalLog:
    """Read a thermal log from CSV: comma, semicolon or tab, with point or decimal comma."""
    source = _Source(str(path), fallback_encoding)
    head = _read_head(source, path, mapping)
    plan = plan_columns(Place(source.path), head.headings, mapping)
    body = _read_body(source, path, head, plan)
    start, origin_s, remarks = _comments(head)
    table = LogTable(
        place=Place(source.path),
        headings=tuple(head.headings),
        rows=body.rows,
        read=body.column,
        place_of=body.place_of,
        remarks=(*remarks, *body.remarks()),
        start=start,
        origin_s=origin_s,
    )
    return build_log(table, plan, name=Path(path).stem, sample_time_s=sample_time_s)


@final
@dataclass(slots=True)
class _Source:
    """How the bytes of the file become text."""

    path: str
    fallback: str
    whole: bytes | None = None
    """The file as UTF-8 where it was UTF-16."""
    used_fallback: bool = False

    def decode(self, content: bytes, first_line: int) -> str:
        """Return whole lines as text."""
        check_is_text(content, Place(self.path))
        try:
            text = content.decode("utf-8")
        except UnicodeDecodeError:
            self.used_fallback = True
            text = decode_text(self.path, content, fallback_encoding=self.fallback).text
        text = text.replace("\r\n", "\n").replace("\r", "\n")
        if len(text) > LONGEST_LINE and max(map(len, text.split("\n"))) > LONGEST_LINE:
            raise self._line_too_long(first_line)
        return text

    def _line_too_long(self, line: int | None = None) -> MeasurementFileError:
        return MeasurementFileError("line_too_long", most=LONGEST_LINE, file=self.path, line=line)

    def chunks(self, path: Path | str) -> Iterator[bytes]:
        """Yield the bytes of whole lines."""
        if self.whole is not None:
            yield self.whole
            return
        with opened(path, FILE_LIMIT_BYTES) as (stream, _):
            rest = b""
            while chunk := stream.read(_CHUNK_BYTES):
                cut = chunk.rfind(b"\n") + 1
                if cut == 0:
                    cut = chunk.rfind(b"\r", 0, -1) + 1
                if cut == 0 and len(rest) + len(chunk) > _CHUNK_BYTES:
                    raise self._line_too_long()
                if cut:
                    yield rest + chunk[:cut]
                    rest = chunk[cut:]
                else:
                    rest += chunk
            if rest:
                yield rest


@final
@dataclass(frozen=True, slots=True)
class _Head:
    """What stands above the rows."""

    headings: list[str]
    delimiter: str
    lines: int
    """Lines up to the first row, headings and units included. [1]"""
    comments: list[str]


@final
@dataclass(slots=True)
class _Body:
    """The columns of all rows, made of lines a chunk at a time."""

    path: str
    head: _Head
    texts: set[int]
    """Columns that may hold dates."""
    left_out: set[int]
    """Columns that nobody asks for: whatever stands in them is not looked at."""
    decimal: str = "."
    parts: list[list["FloatArray | list[str | None]"]] = field(default_factory=list)
    lines: list[_Numbers] = field(default_factory=list)
    rows: int = 0
    notes: list[Message] = field(default_factory=list[Message])
    words: Counter[str] = field(default_factory=Counter[str])

    @property
    def width(self) -> int:
        """Number of columns. [1]"""
        return len(self.head.headings)

    def column(self, index: int) -> ColumnValues:
        """Join a column of its parts; it is a text where any part is."""
        parts = [part[index] for part in self.parts]
        numbers = [part for part in parts if isinstance(part, np.ndarray)]
        if len(numbers) == len(parts):
            joined = numbers[0] if len(numbers) == 1 else np.concatenate(numbers)
            for part in self.parts:
                part[index] = []  # each column is asked for once
            return joined
        texts: list[str | None] = []
        for part in parts:
            texts += _as_texts(part) if isinstance(part, np.ndarray) else part
        return texts

    def place_of(self, row: int) -> Place:
        """Return the line in which a row stands."""
        for lines in self.lines:
            if row < len(lines):
                return Place(self.path, lines[row])
            row -= len(lines)
        return Place(self.path)

    def remarks(self) -> list[Message]:
        """Return what was noticed."""
        words = [
            remark("word_in_cells", word=word, count=count) for word, count in self.words.items()
        ]
        return [*self.notes, *words]

    def add(self, text: str, first_line: int) -> int:
        """Add the rows of some lines, and return how many lines they are. [1]"""
        complete = text.endswith("\n")
        count = text.count("\n") + (not complete)
        lines = text.split("\n")
        if complete:
            lines.pop()
        begin = max(0, self.head.lines - first_line + 1)
        rows, numbers = _rows_of(lines[begin:], first_line + begin)
        if rows and not complete:
            rows, numbers = self._open_end(rows, numbers)
        if rows:
            self._parse(rows, numbers)
        return count

    def _open_end(self, rows: list[str], numbers: _Numbers) -> tuple[list[str], _Numbers]:
        """Leave out a last line that was cut short, as when a recorder loses its power."""
        cells = split_cells(rows[-1], self.head.delimiter)
        if cells is None or len(cells) < self.width:
            self.notes.append(remark("line_cut_short"))
            return rows[:-1], numbers[:-1]
        self.notes.append(remark("no_line_end"))
        return rows, numbers

    def _parse(self, rows: list[str], numbers: _Numbers) -> None:
        self._find_decimal(rows)
        cells = self._cells(rows, numbers)
        self.parts.append(
            [
                [] if index in self.left_out else self._column(cells[str(index)], index, numbers)
                for index in range(self.width)
            ]
        )
        self.lines.append(numbers)
        self.rows += len(rows)

    def _find_decimal(self, rows: list[str]) -> None:
        """Look for a decimal comma where a comma does not separate cells."""
        if self.decimal == "," or self.head.delimiter == ",":
            return
        for row in rows[:1000]:
            for index, cell in enumerate(row.split(self.head.delimiter)):
                if index in self.texts and ":" in cell:
                    continue
                if _COMMA_NUMBER.search(cell) and is_number(cell.strip(' "'), decimal=","):
                    self.decimal = ","
                    return

    def _cells(self, rows: list[str], numbers: _Numbers) -> "pl.DataFrame":
        """Split rows into cells: at once where no quotation mark stands and no row is uneven."""
        import polars as pl  # noqa: PLC0415  takes a tenth of a second

        delimiter, width = self.head.delimiter, self.width
        names = [str(index) for index in range(width)]
        schema = dict.fromkeys(names, pl.String())
        text = "\n".join(rows)
        # The parser refuses a row with too many cells: with this sum no row has too few.
        if '"' not in text and text.count(delimiter) == len(rows) * (width - 1):
            try:
                return pl.read_csv(
                    text.encode(),
                    has_header=False,
                    schema=schema,
                    separator=delimiter,
                    quote_char=None,
                )
            except pl.exceptions.PolarsError:
                pass
        split: list[list[str]] = []
        for row, number in zip(rows, numbers, strict=True):
            cells = split_cells(row, delimiter)
            if cells is None:
                raise MeasurementFileError("quotation_marks", file=self.path, line=number)
            if len(cells) != width:
                raise MeasurementFileError(
                    "cells_and_headings",
                    cells=len(cells),
                    headings=width,
                    file=self.path,
                    line=number,
                )
            split.append(cells)
        return pl.DataFrame(split, schema=schema, orient="row")

    def _column(
        self, cells: "pl.Series", index: int, numbers: _Numbers
    ) -> "FloatArray | list[str | None]":
        heading = self.head.headings[index]
        return numbers_or_words(
            cells,
            lambda row: Place(self.path, numbers[row], heading),
            decimal=self.decimal,
            dates=index in self.texts,
            missing=self.words,
        )


def _as_texts(values: FloatArray) -> list[str | None]:
    return [None if np.isnan(value) else repr(float(value)) for value in values]


def _read_head(source: _Source, path: Path | str, mapping: ThermalMapping | None) -> _Head:
    first = _first_bytes(source, path)
    text = source.decode(first, 1).removeprefix("\ufeff")
    comments: list[str] = []
    candidates: list[tuple[int, str]] = []
    lines = text.split("\n")
    for number, line in enumerate(lines, start=1):
        if number > _HEAD_LINES + len(comments):
            break
        if is_comment_line(line):
            comments.append(line)
        elif line.strip() and not is_separator_line(line):
            candidates.append((number, line))
    for place, (number, line) in enumerate(candidates):
        following = candidates[place + 1 : place + 3]
        found = _headings(line, [text for _, text in following], mapping)
        if found is not None:
            delimiter, headings, units_row = found
            last = following[0][0] if units_row else number
            return _Head(headings, delimiter, last, comments)
    raise MeasurementFileError(
        "no_time_column", file=source.path, line=candidates[0][0] if candidates else None
    )


def _first_bytes(source: _Source, path: Path | str) -> bytes:
    """Return the first lines, after a look at what the file is."""
    name = source.path
    content, size = read_start(path, 1_000_000, limit_bytes=FILE_LIMIT_BYTES)
    if size < _CHUNK_BYTES:  # with all checks of small files, and their errors
        content = read_content(path)
    else:
        content = content[: content.rfind(b"\n") + 1] or content
    check_is_text(content, Place(name))
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        source.whole = decode_text(name, read_content(path)).text.encode()
        return source.whole
    if not content.strip(b" \t\r\n\x0b\x0c"):
        raise MeasurementFileError("file_empty", file=name)
    return content


def _headings(
    line: str, following: Sequence[str], mapping: ThermalMapping | None
) -> tuple[str, list[str], bool] | None:
    """Return delimiter and headings if the line holds any, and if a row of units follows."""

    def accepted(cells: list[str], _: str) -> list[str] | None:
        return cells if len(cells) <= MOST_COLUMNS and are_headings(cells, mapping) else None

    best = best_split(line, accepted)
    if best is None:
        return None
    delimiter, cells = best
    units = split_cells(following[0], delimiter) if following else None
    if units and _are_units(units, len(cells)):
        cells = [
            cell if not unit or parse_log_heading(cell).unit else f"{cell} [{unit.strip('[]()')}]"
            for cell, unit in zip(cells, units, strict=True)
        ]
        return delimiter, cells, True
    first_row = split_cells(following[0], delimiter) if following else None
    if first_row and len(first_row) == len(cells) + 1 and not first_row[-1]:
        cells = [*cells, ""]  # every row ends in a separator
    return delimiter, cells, False


def _are_units(cells: Sequence[str], columns: int) -> bool:
    known = [
        unit_named(cell.strip("[]()")) is not None or cell.casefold() in {"d", "iso"}
        for cell in cells
        if cell
    ]
    return len(cells) == columns and bool(known) and all(known)


def _comments(head: _Head) -> tuple[datetime | None, float, list[Message]]:
    """Return what this package writes above the headings."""
    start: datetime | None = None
    origin_s = 0.0
    remarks: list[Message] = []
    for line in head.comments:
        key, colon, value = line.lstrip("# ").partition(":")
        if not colon or key not in _SIGNIFICANT:
            continue
        text = decoded(value.strip())
        if key == "start":
            start = parse_moment(text)
        elif key == "origin_s" and is_number(text) and np.isfinite(float(text)):
            origin_s = float(text)
        elif key == "remark" and len(remarks) < 500:
            remarks.append(remark("of_file", said=text[:1000]))
    return start, origin_s, remarks


def _read_body(source: _Source, path: Path | str, head: _Head, plan: ColumnPlan) -> _Body:
    texts = {index for index in (plan.time, plan.date) if index is not None}
    kept = texts | {channel.column for channel in plan.channels}
    body = _Body(source.path, head, texts, set(range(len(head.headings))) - kept)
    number = 1
    for content in source.chunks(path):
        text = source.decode(content, number)
        if number == 1:
            text = text.removeprefix("\ufeff")
        number += body.add(text, number)
        if body.rows * body.width > MOST_VALUES:
            raise MeasurementFileError("log_too_large", most=MOST_VALUES, file=source.path)
    if source.used_fallback:
        body.notes.insert(0, remark("not_utf8", encoding=source.fallback))
    return body


def _rows_of(lines: list[str], first: int) -> tuple[list[str], _Numbers]:
    """Return the lines that hold rows, with their numbers."""
    if all(line and line[0] not in '#" \t' for line in lines):
        return lines, range(first, first + len(lines))
    rows: list[str] = []
    numbers: list[int] = []
    for number, line in enumerate(lines, start=first):
        if line.strip(" \t,;") and not is_comment_line(line):
            rows.append(line)
            numbers.append(number)
    return rows, numbers
