"""Thermal logs as CSV: one row per time, one column per channel."""

import codecs
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Final, final

import numpy as np

from thermaxis.errors import MeasurementFileError
from thermaxis.files.logs._columns import (
    MISSING_WORDS,
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
    SourceText,
    decode_text,
    decoded,
    is_comment_line,
    is_number,
    kind_of_content,
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
_DELIMITERS = (";", "\t", ",")
_SIGNIFICANT = ("start", "origin_s", "remark")
_COMMA_NUMBER = re.compile(r"(?<![0-9.])[0-9]+,[0-9]")
_NULLS: Final = [
    *("", "NaN", "nan", "NAN", "NA", "N/A", "null", "NULL", "None", "-", "--", "---", "#N/A"),
]
_REMEDY = "Export one row per time and one column per channel"


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
    plan = plan_columns(source.path, head.headings, mapping)
    body = _read_body(source, path, head, plan)
    start, origin_s, remarks = _comments(head)
    table = LogTable(
        path=source.path,
        headings=tuple(head.headings),
        rows=body.rows,
        read=body.column,
        place=body.place,
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
    encoding: str = "utf-8"
    whole: bytes | None = None
    """The file as UTF-8 where it was UTF-16."""
    used_fallback: bool = False

    def decode(self, content: bytes, first_line: int) -> str:
        if b"\x00" in content:
            raise MeasurementFileError(
                "the file contains zero bytes: it is binary",
                path=self.path,
                remedy="Export the log as text",
            )
        try:
            text = content.decode("utf-8")
        except UnicodeDecodeError:
            self.used_fallback = True
            text = decode_text(self.path, content, fallback_encoding=self.fallback).text
        text = text.replace("\r\n", "\n").replace("\r", "\n")
        if len(text) > LONGEST_LINE and max(map(len, text.split("\n"))) > LONGEST_LINE:
            raise MeasurementFileError(
                f"a line behind line {first_line} is longer than {LONGEST_LINE} characters",
                path=self.path,
                remedy=_REMEDY,
            )
        return text

    def chunks(self, path: Path | str) -> Iterator[bytes]:
        """Yield the bytes of whole lines."""
        with self._stream(path) as stream:
            rest = b""
            while chunk := stream.read(_CHUNK_BYTES):
                cut = chunk.rfind(b"\n") + 1
                if cut == 0:
                    cut = chunk.rfind(b"\r", 0, -1) + 1
                if cut == 0 and len(rest) + len(chunk) > _CHUNK_BYTES:
                    raise MeasurementFileError(
                        f"a line is longer than {LONGEST_LINE} characters",
                        path=self.path,
                        remedy=_REMEDY,
                    )
                if cut:
                    yield rest + chunk[:cut]
                    rest = chunk[cut:]
                else:
                    rest += chunk
            if rest:
                yield rest

    def _stream(self, path: Path | str) -> "io.BufferedIOBase":
        return Path(path).open("rb") if self.whole is None else io.BytesIO(self.whole)


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
    """The columns of all rows."""

    path: str
    width: int
    parts: list[list["FloatArray | list[str | None]"]] = field(default_factory=list)
    lines: list["range | list[int]"] = field(default_factory=list)
    rows: int = 0
    notes: list[str] = field(default_factory=list)
    words: dict[str, int] = field(default_factory=dict)

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

    def place(self, row: int) -> str:
        """Say in which line a row stands."""
        for lines in self.lines:
            if row < len(lines):
                return f"line {lines[row]}"
            row -= len(lines)
        return "the last line"

    def remarks(self) -> list[str]:
        """Return what was noticed."""
        words = [
            f"'{word}' stands in {count} cells that should hold numbers: they count as missing"
            for word, count in self.words.items()
        ]
        return [*self.notes, *words]


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
        elif line.strip() and not re.fullmatch(r"sep=.?\s*", line.strip(), re.IGNORECASE):
            candidates.append((number, line))
    for place, (number, line) in enumerate(candidates):
        following = candidates[place + 1 : place + 3]
        found = _headings(line, [text for _, text in following], mapping)
        if found is not None:
            delimiter, headings, units_row = found
            last = following[0][0] if units_row else number
            return _Head(headings, delimiter, last, comments)
    seen = candidates[0][1][:80] if candidates else ""
    raise MeasurementFileError(
        "no row of headings with a column of times was found"
        + (f"; the first row begins '{seen}'" if seen else ""),
        path=source.path,
        remedy="Head the columns, such as time_s,T_spindle_C,Z_um, or name the column or the sample"
        " time in a mapping",
    )


def _first_bytes(source: _Source, path: Path | str) -> bytes:
    """Return the first lines, after a look at what the file is."""
    name = source.path
    content, size = read_start(path, 1_000_000, limit_bytes=FILE_LIMIT_BYTES)
    if size < _CHUNK_BYTES:  # with all checks of small files, and their errors
        content = read_content(path)
    else:
        content = content[: content.rfind(b"\n") + 1] or content
    seems = kind_of_content(content[:16])
    if seems is not None:
        raise MeasurementFileError(
            f"this is {seems}, not a text file", path=name, remedy="Export the log as CSV"
        )
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        text: SourceText = decode_text(name, read_content(path))
        source.whole = text.text.encode()
        return source.whole
    if not content.strip(b" \t\r\n\x0b\x0c"):
        raise MeasurementFileError("the file is empty", path=name, remedy="Export the log again")
    return content


def _headings(
    line: str, following: Sequence[str], mapping: ThermalMapping | None
) -> tuple[str, list[str], bool] | None:
    """Return delimiter and headings if the line holds any, and if a row of units follows."""
    best: tuple[str, list[str]] | None = None
    for delimiter in _DELIMITERS:
        cells = split_cells(line, delimiter)
        if cells is None or len(cells) > MOST_COLUMNS or not are_headings(cells, mapping):
            continue
        if best is None or len(cells) > len(best[1]):
            best = delimiter, cells
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


def _comments(head: _Head) -> tuple[datetime | None, float, list[str]]:
    """Return what this package writes above the headings."""
    start: datetime | None = None
    origin_s = 0.0
    remarks: list[str] = []
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
            remarks.append(text[:1000])
    return start, origin_s, remarks


def _read_body(source: _Source, path: Path | str, head: _Head, plan: ColumnPlan) -> _Body:
    body = _Body(source.path, len(head.headings))
    texts = {index for index in (plan.time, plan.date) if index is not None}
    kept = texts | {channel.column for channel in plan.channels}
    parser = _Parser(source, head, body, texts, set(range(body.width)) - kept)
    number = 1
    try:
        for content in source.chunks(path):
            text = source.decode(content, number)
            if number == 1:
                text = text.removeprefix("\ufeff")
            number += parser.add(text, number)
            if body.rows * body.width > MOST_VALUES:
                raise MeasurementFileError(
                    f"the file has more than {MOST_VALUES // 1_000_000} million values",
                    path=source.path,
                    remedy="Split the log into several files, or write it as Parquet",
                )
    except OSError as error:
        raise MeasurementFileError(
            f"the file cannot be read ({error.strerror or type(error).__name__})",
            path=source.path,
            remedy="Check whether another program holds it open",
        ) from error
    if source.used_fallback:
        body.notes.insert(
            0,
            f"the file is not UTF-8: its texts were read as {source.fallback}, numbers are not"
            " affected",
        )
    return body


@final
@dataclass(slots=True)
class _Parser:
    """Turns lines into columns, a chunk at a time."""

    source: _Source
    head: _Head
    body: _Body
    texts: set[int]
    """Columns that may hold dates."""
    left_out: set[int]
    """Columns that nobody asks for: whatever stands in them is not looked at."""
    decimal: str = ""
    """Decimal sign, once one was seen."""

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

    def _open_end(
        self, rows: list[str], numbers: "range | list[int]"
    ) -> tuple[list[str], "range | list[int]"]:
        """Leave out a last line that was cut short, as when a recorder loses its power."""
        cells = split_cells(rows[-1], self.head.delimiter)
        if cells is None or len(cells) < self.body.width:
            self.body.notes.append("the last line of the file is cut short and was left out")
            return rows[:-1], numbers[:-1]
        self.body.notes.append(
            "the last line of the file has no line end: check that the file is complete"
        )
        return rows, numbers

    def _check_cells(self, rows: list[str], numbers: "range | list[int]") -> None:
        delimiter, width = self.head.delimiter, self.body.width
        separators = width - 1
        for row, number in zip(rows, numbers, strict=True):
            if row.count(delimiter) == separators and '"' not in row:
                continue
            cells = split_cells(row, delimiter)
            if cells is None or len(cells) != width:
                found = "quotation marks that do not match" if cells is None else f"{len(cells)}"
                raise MeasurementFileError(
                    f"this row has {found}{'' if cells is None else ' cells'},"
                    f" and there are {width} headings",
                    path=self.body.path,
                    line=number,
                    remedy=_REMEDY,
                )

    def _parse(self, rows: list[str], numbers: "range | list[int]") -> None:
        self._find_decimal(rows)
        typed = self._fast(rows)
        if typed is None:
            self._check_cells(rows, numbers)
        part: list[FloatArray | list[str | None]] = []
        for index in range(self.body.width):
            if index in self.left_out:
                part.append([])
            elif typed is not None and index in self.texts:
                part.append(self._times(typed[str(index)]))
            elif typed is not None:
                part.append(_floats(typed[str(index)]))
            else:
                part.append(self._slow(rows, index, numbers))
        self.body.parts.append(part)
        self.body.lines.append(numbers)
        self.body.rows += len(rows)

    def _find_decimal(self, rows: list[str]) -> None:
        """Look for a decimal comma where a comma does not separate cells."""
        if self.decimal or self.head.delimiter == ",":
            return
        for row in rows[:1000]:
            for index, cell in enumerate(row.split(self.head.delimiter)):
                if index in self.texts and ":" in cell:
                    continue
                if _COMMA_NUMBER.search(cell) and is_number(cell.strip(' "'), decimal=","):
                    self.decimal = ","
                    return

    def _fast(self, rows: list[str]) -> "pl.DataFrame | None":
        """Read all columns of numbers at once; None where rows or cells need a closer look."""
        import polars as pl  # noqa: PLC0415  takes a tenth of a second

        text = "\n".join(rows)
        # The parser refuses a row with too many cells: with this sum no row has too few.
        expected = len(rows) * (self.body.width - 1)
        if '"' in text or text.count(self.head.delimiter) != expected:
            return None
        names = [str(index) for index in range(self.body.width)]
        schema = {
            name: pl.String() if index in self.texts | self.left_out else pl.Float64()
            for index, name in enumerate(names)
        }
        try:
            return pl.read_csv(
                text.encode(),
                has_header=False,
                schema=schema,
                separator=self.head.delimiter,
                null_values=_NULLS,
                decimal_comma=self.decimal == ",",
                infer_schema=False,
            )
        except pl.exceptions.PolarsError:
            return None

    def _times(self, column: "pl.Series") -> "FloatArray | list[str | None]":
        """Return a column that may hold dates as numbers where all of its cells are."""
        import polars as pl  # noqa: PLC0415

        words = column.str.strip_chars()
        plain = words.str.replace(",", ".", literal=True) if self.decimal == "," else words
        numbers = plain.cast(pl.Float64(), strict=False)
        return _floats(numbers) if numbers.null_count() == words.null_count() else words.to_list()

    def _slow(
        self, rows: list[str], index: int, numbers: "range | list[int]"
    ) -> "FloatArray | list[str | None]":
        """Read one column cell by cell, with the error that names the cell."""
        delimiter = self.head.delimiter
        cells = [(split_cells(row, delimiter) or [""] * self.body.width)[index] for row in rows]
        decimal = self.decimal or "."
        result = np.full(len(cells), np.nan)
        texts = values = 0
        wrong = -1
        for row, cell in enumerate(cells):
            word = cell.replace("\N{MINUS SIGN}", "-")
            if is_number(word, decimal=decimal):
                result[row] = float(word.replace(",", "."))
                values += 1
            elif cell and cell.casefold() not in MISSING_WORDS:
                texts += 1
                wrong = row if wrong < 0 else wrong
        if index in self.texts and texts:
            return [cell or None for cell in cells]
        if texts and texts < values:  # few words among empty cells are a column of words
            raise MeasurementFileError(
                f"'{cells[wrong]}' is not a number",
                path=self.body.path,
                line=numbers[wrong],
                column=self.head.headings[index],
                remedy="Write digits with one kind of decimal sign, or nothing where a value is"
                " missing; a mapping may leave the column out",
            )
        if texts:
            return [cell or None for cell in cells]
        self._count_words(cells)
        return result

    def _count_words(self, cells: Sequence[str]) -> None:
        for cell in cells:
            if cell and cell not in _NULLS and cell.casefold() in MISSING_WORDS:
                self.body.words[cell] = self.body.words.get(cell, 0) + 1


def _rows_of(lines: list[str], first: int) -> tuple[list[str], "range | list[int]"]:
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


def _floats(column: "pl.Series") -> FloatArray:
    values = column.fill_null(np.nan).to_numpy()
    return np.where(np.isfinite(values), values, np.nan) if _has_infinite(values) else values


def _has_infinite(values: FloatArray) -> bool:
    return bool(np.isinf(values).any())
