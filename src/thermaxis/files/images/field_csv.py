"""Thermal fields as CSV: one line per row of pixels, degrees Celsius."""

import codecs
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO, final

import numpy as np

from thermaxis.codes import Message, Place, remark
from thermaxis.errors import MeasurementFileError
from thermaxis.files.table import (
    check_is_text,
    is_comment_line,
    numeric_cells,
    parse_number,
    read_start,
    split_cells,
)
from thermaxis.thermal import MOST_PIXELS, FloatArray, ThermalField
from thermaxis.thermal.images import ABSOLUTE_ZERO_C

FIELD_LIMIT_BYTES = 1_600_000_000
"""Largest file that is read: 100 million pixels of sixteen characters. [byte]"""
HIGHEST_C = 3500.0
"""Hotter pixels are raw numbers of a camera, not degrees. [°C]"""
LONGEST_LINE = 2_000_000
"""Longest row of pixels. [character]"""
MOST_SIDE = 100_000
"""Most rows, and most columns. [1]"""

_KELVIN_FROM_C = 230.0
"""A table is not that hot: a field with such a mean may be in kelvin. [°C]"""


@final
@dataclass(slots=True)
class _Form:
    """How the file separates cells and writes decimals; found out while it is read."""

    path: str
    delimiter: str = ""
    decimal: str = ""
    """Decimal sign; empty as long as none was met."""

    def at(self, line: int | None = None, column: int | None = None) -> Place:
        return Place(self.path, line, "" if column is None else str(column))


def read_field_csv(path: Path | str) -> ThermalField:
    """Read a thermal field from a CSV file.

    One line per row of pixels, the upper row first. Cells are separated by commas, semicolons or
    tabs; beside the last two the decimal sign may be a comma. An empty cell is a missing pixel.
    Lines that start with # and empty lines are left out.

    Parameters
    ----------
    path : Path or str
        The file: UTF-8 or UTF-16 with byte order mark; other encodings are read as far as their
        digits are ASCII.

    Returns
    -------
    ThermalField
        The temperatures, with the file's name and remarks. [°C]

    Raises
    ------
    MeasurementFileError
        If the file cannot be read or is no text, a cell is not a temperature, rows are not equally
        long, or the image has fewer than 2 x 2 pixels or more than 100 million; such a one is
        refused before it is read whole.
    """
    form = _Form(str(path))
    encoding, size = _encoding(path, form)
    if size > MOST_PIXELS:  # a pixel takes one byte or more
        _refuse_if_too_large(path, encoding, form)
    rows = _read_rows(path, encoding, form)
    temperature_c, remarks = _without_empty_edge(rows, form)
    if min(temperature_c.shape) < 2:
        raise MeasurementFileError(
            "image_too_small",
            columns=temperature_c.shape[1],
            rows=temperature_c.shape[0],
            place=form.at(),
        )
    if bool(np.all(np.isnan(temperature_c))):
        raise MeasurementFileError("no_temperature_in_image", place=form.at())
    if float(np.nanmean(temperature_c)) > _KELVIN_FROM_C:
        remarks.append(remark("kelvin_suspected"))
    temperature_c.setflags(write=False)
    return ThermalField(temperature_c, name=Path(path).name, remarks=tuple(remarks))


def _encoding(path: Path | str, form: _Form) -> tuple[str, int]:
    """Return the encoding and the size of a file that may be read; look at its first bytes only."""
    start, size = read_start(path, 65_536, limit_bytes=FIELD_LIMIT_BYTES)
    if not start.strip():
        raise MeasurementFileError("file_empty", place=form.at())
    check_is_text(start, form.at())
    utf16 = start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    return "utf-16" if utf16 else "utf-8-sig", size


def _lines(stream: TextIO, form: _Form) -> Iterator[tuple[int, str]]:
    """Yield each row of pixels with the number of its line."""
    number = 0
    while line := stream.readline(LONGEST_LINE + 1):
        number += 1
        if len(line) > LONGEST_LINE:
            raise MeasurementFileError("line_too_long", most=LONGEST_LINE, place=form.at(number))
        text = line.rstrip("\r\n")
        if text.strip(" ") and not is_comment_line(text):
            yield number, text


def _refuse_if_too_large(path: Path | str, encoding: str, form: _Form) -> None:
    """Count rows and columns of a large file, without keeping a pixel."""
    rows, columns = 0, 0
    with Path(path).open(encoding=encoding, errors="replace") as stream:
        for number, line in _lines(stream, form):
            rows += 1
            if rows == 1:
                columns = line.count(_delimiter(line)) + 1
            _check_size(rows, columns, number, form)


def _check_size(rows: int, columns: int, line: int, form: _Form) -> None:
    if rows * columns > MOST_PIXELS or max(rows, columns) > MOST_SIDE:
        place = form.at(line)
        raise MeasurementFileError(
            "image_too_large", columns=columns, rows=rows, most_pixels=MOST_PIXELS, place=place
        )


def _read_rows(path: Path | str, encoding: str, form: _Form) -> FloatArray:
    rows: list[FloatArray] = []
    with Path(path).open(encoding=encoding, errors="replace") as stream:
        for number, line in _lines(stream, form):
            if not rows:
                form.delimiter = _delimiter(line)
            row = _row(line, number, form)
            columns = rows[0].size if rows else row.size
            if row.size != columns:
                place = form.at(number, min(row.size, columns) + 1)
                raise MeasurementFileError(
                    "row_of_other_length", pixels=row.size, expected=columns, place=place
                )
            rows.append(row)
            _check_size(len(rows), columns, number, form)
    if not rows:
        raise MeasurementFileError("no_temperature_in_image", place=form.at())
    return np.array(rows)


def _delimiter(line: str) -> str:
    """Return what separates the cells: a comma only where nothing else can."""
    return next((sign for sign in ("\t", ";") if sign in line), ",")


def _row(line: str, number: int, form: _Form) -> FloatArray:
    """Read a row at once where it is plain, else cell by cell, with the error that names it."""
    cells = split_cells(line, form.delimiter)
    if cells is None:
        raise MeasurementFileError("quotation_marks", place=form.at(number))
    if not form.decimal:  # the first decimal sign holds for the file
        form.decimal = next((sign for cell in cells for sign in cell if sign in ".,"), "")
    row = numeric_cells(cells, form.decimal or ".")
    if row is not None and _are_temperatures(row):
        return row
    return np.array([_pixel(cell, number, k, form) for k, cell in enumerate(cells, start=1)])


def _are_temperatures(row: FloatArray) -> bool:
    return not (np.fmin.reduce(row) < ABSOLUTE_ZERO_C or np.fmax.reduce(row) > HIGHEST_C)


def _pixel(text: str, line: int, column: int, form: _Form) -> float:
    if not text:
        return float("nan")
    value = parse_number(text, form.at(line, column), decimal=form.decimal or ".")
    if not ABSOLUTE_ZERO_C <= value <= HIGHEST_C:
        place = form.at(line, column)
        raise MeasurementFileError(
            "outside_range", value=value, least=ABSOLUTE_ZERO_C, most=HIGHEST_C, place=place
        )
    return value


def _without_empty_edge(image: FloatArray, form: _Form) -> tuple[FloatArray, list[Message]]:
    """Leave out a last column that only a separator at the end of each line makes."""
    remarks: list[Message] = []
    if image.shape[1] > 2 and bool(np.all(np.isnan(image[:, -1]))):
        image = np.ascontiguousarray(image[:, :-1])
        remarks.append(remark("empty_last_column"))
    whole = form.delimiter == "," and not form.decimal and image.shape[1] % 2 == 0
    if whole and bool(np.all((image == np.round(image)) | np.isnan(image))):
        remarks.append(remark("decimal_commas_suspected"))
    return image, remarks
