"""The parts of a workbook archive, checked before anything unpacks or parses them."""

import io
import re
import struct
import zipfile
import zlib
from collections import Counter
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final, final

from thermaxis.codes import Place
from thermaxis.errors import MeasurementFileError

UNPACKED_LIMIT_BYTES = 80_000_000
"""Largest sum of the unpacked parts: a million cells of about 55 bytes, and texts. [byte]"""
CELL_LIMIT = 1_000_000
"""Largest number of cells of all sheets, and of those that a sheet spans, empty ones too. [1]"""

_COLUMN_LIMIT = 16_384  # XFD, the last column of spreadsheet programs
_DIRECTORY_LIMIT_BYTES = 1_000_000
_PART_LIMIT = 2000
_TREE_LIMIT_BYTES = 4_000_000  # parts that are parsed as a whole tree: styles, relations
_TEXT_LIMIT_BYTES = 8_000_000  # shared texts are kept in memory
_TAGS_PER_CELL = 6  # <c><is><t></t></is></c>
_OTHER_TAGS = 20_000
_CHUNK_BYTES = 1 << 18
_OVERLAP_BYTES = 16

_END_RECORD = b"PK\x05\x06"
_END_RECORD_BYTES = 22
_LONGEST_COMMENT_BYTES = 65_535
_BIG_LOCATOR = b"PK\x06\x07"
_BIG_LOCATOR_BYTES = 20

_SHEET = re.compile(r"/?xl/worksheets/[^/]+\.xml", re.IGNORECASE)
_TEXTS = "xl/sharedstrings.xml"
_ENCODING = re.compile(rb"<\?xml[^>]*encoding\s*=\s*[\"']([^\"']*)[\"']")
_PLACE = re.compile(
    rb"<(?:[\w.-]+:)?(?:(row)|c)(?=[\s/>])"
    rb"(?:[^<>]*?\sr\s*=\s*[\"']([A-Za-z]{0,3})([0-9]{1,12})[\"'])?"
)
_LONGEST_TAG = 4096
_TAG_ENDS = bytes.maketrans(b"\t\r\n/>", b"     ")
_METHODS = frozenset({zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED})


@final
@dataclass(slots=True)
class _Counts:
    """What was found in the unpacked bytes of all parts."""

    cells: int = 0
    rows: int = 0
    tags: int = 0
    formulas: int = 0


def check_parts(content: bytes, place: Place) -> bool:
    """Check the parts of a workbook before it is parsed.

    Everything is checked in the archive's directory first, then in the stream of unpacked bytes:
    nothing is held in memory, and no part can unpack to more than its stated size.
    """
    _check_directory_size(content, place)
    counts = _Counts()
    with damage_named(place), zipfile.ZipFile(io.BytesIO(content)) as archive:
        parts = archive.infolist()
        _check_directory(parts, place)
        for part in parts:
            if not part.is_dir():
                _check_part(archive, part, counts, place)
        for part in parts:
            if _SHEET.fullmatch(part.filename) is not None:
                _check_places(archive, part, place)
    return counts.formulas > 0


def _check_directory_size(content: bytes, place: Place) -> None:
    """Refuse a directory that would not fit into memory, wherever a reader may look for it."""
    tail_start = max(0, len(content) - _END_RECORD_BYTES - _LONGEST_COMMENT_BYTES)
    at = content.find(_END_RECORD, tail_start)
    found = False
    while at >= 0:
        record = content[at : at + _END_RECORD_BYTES]
        locator = content[max(0, at - _BIG_LOCATOR_BYTES) : at]
        if len(record) == _END_RECORD_BYTES:
            found = True
            (size,) = struct.unpack_from("<I", record, 12)
            if size > _DIRECTORY_LIMIT_BYTES or locator.startswith(_BIG_LOCATOR):
                raise MeasurementFileError("workbook_too_large", place=place)
        at = content.find(_END_RECORD, at + 1)
    if not found:
        cause = "its directory of parts is missing"
        raise MeasurementFileError("file_damaged", cause=cause, place=place)


def _check_directory(parts: list[zipfile.ZipInfo], place: Place) -> None:
    names = [part.filename for part in parts]
    if "[Content_Types].xml" not in names:
        kind = "open_document" if "mimetype" in names else "archive"
        raise MeasurementFileError("not_a_workbook", kind=kind, place=place)
    if len(parts) > _PART_LIMIT:
        raise MeasurementFileError("workbook_too_large", place=place)
    name, count = Counter(names).most_common(1)[0]
    if count > 1:
        raise MeasurementFileError("part_twice", part=name, place=place)
    unpacked = sum(part.file_size for part in parts)
    if unpacked > UNPACKED_LIMIT_BYTES:
        raise MeasurementFileError(
            "unpacked_too_large",
            size_mb=unpacked / 1e6,
            most_mb=UNPACKED_LIMIT_BYTES / 1e6,
            place=place,
        )
    for part in parts:
        if part.flag_bits & 1:
            raise MeasurementFileError("workbook_has_password", place=place)
        if part.compress_type not in _METHODS:
            raise MeasurementFileError("unusual_workbook", part=part.filename, place=place)


def _check_part(
    archive: zipfile.ZipFile, part: zipfile.ZipInfo, counts: _Counts, place: Place
) -> None:
    is_sheet = _SHEET.fullmatch(part.filename) is not None
    end = b""
    with archive.open(part) as stream:
        chunk = stream.read(_CHUNK_BYTES)
        if _is_xml(chunk):
            _check_start(part, chunk, place, is_sheet=is_sheet)
        while chunk:
            window = end + chunk
            if b"<!DOCTYPE" in window or b"<!ENTITY" in window:
                raise MeasurementFileError("unusual_workbook", part=part.filename, place=place)
            if is_sheet:
                _count(window, len(end), counts)
                _check_counts(counts, place)
            end = window[-_OVERLAP_BYTES:]
            chunk = stream.read(_CHUNK_BYTES)
    if counts.tags > _TAGS_PER_CELL * (counts.cells + counts.rows) + _OTHER_TAGS:
        raise MeasurementFileError("part_too_large", part=part.filename, place=place)


def _is_xml(start: bytes) -> bool:
    head = start[:64].removeprefix(b"\xef\xbb\xbf").lstrip()
    return head.startswith((b"\xff\xfe", b"\xfe\xff")) or b"<" in head[:2]


def _check_start(part: zipfile.ZipInfo, start: bytes, place: Place, *, is_sheet: bool) -> None:
    stated = _ENCODING.search(start[:256])
    encoding = b"utf-8" if stated is None else stated[1].lower()
    if b"\x00" in start or encoding not in {b"utf-8", b"us-ascii"} or start[:1] in b"\xfe\xff":
        raise MeasurementFileError("unusual_workbook", part=part.filename, place=place)
    texts = part.filename.lower().lstrip("/") == _TEXTS
    if part.file_size > (_TEXT_LIMIT_BYTES if texts else _TREE_LIMIT_BYTES) and not is_sheet:
        raise MeasurementFileError("part_too_large", part=part.filename, place=place)
    if part.filename == "[Content_Types].xml":
        main = b" ".join(tag for tag in start.split(b"<") if b"main+xml" in tag)
        if b"/worksheets/" in main or b"sharedStrings" in main:
            raise MeasurementFileError("unusual_workbook", part=part.filename, place=place)


def _count(window: bytes, overlap: int, counts: _Counts) -> None:
    """Count what starts in a window; what lies whole in the overlap was counted before."""
    counts.tags += window.count(b"<", overlap)
    window = window.translate(_TAG_ENDS)  # whatever ends the name of a tag is now a blank
    for tag in (b"<c ", b":c "):
        counts.cells += window.count(tag, max(0, overlap - len(tag) + 1))
    for tag in (b"<row ", b":row "):
        counts.rows += window.count(tag, max(0, overlap - len(tag) + 1))
    for tag in (b"<f ", b":f "):
        counts.formulas += window.count(tag, max(0, overlap - len(tag) + 1))


def _check_counts(counts: _Counts, place: Place) -> None:
    if max(counts.cells, counts.rows) > CELL_LIMIT:
        raise MeasurementFileError("too_many_cells", most=CELL_LIMIT, place=place)


def _check_places(archive: zipfile.ZipFile, part: zipfile.ZipInfo, place: Place) -> None:
    """Check that rows and cells rise: the parser drops those that do not, without a word."""
    row = column = 0
    columns: dict[bytes, int] = {}
    for is_row, letters, digits in _places(archive, part):
        if is_row:
            before, column = row, 0
            row = int(digits) if digits else row + 1
            if row <= before:
                raise MeasurementFileError(
                    "cells_out_of_order", place=place._replace(cell=f"{part.filename} row {row}")
                )
            continue
        before = column
        if letters not in columns:
            columns[letters] = _column_number(letters)
        column = columns[letters] if letters else column + 1
        if column <= before:
            cell = letters.decode().upper()
            raise MeasurementFileError(
                "cells_out_of_order", place=place._replace(cell=f"{part.filename} {cell}{row}")
            )
        if column > _COLUMN_LIMIT:
            raise MeasurementFileError(
                "too_many_columns", most=_COLUMN_LIMIT, place=place._replace(cell=f"row {row}")
            )


def _places(
    archive: zipfile.ZipFile, part: zipfile.ZipInfo
) -> Iterator[tuple[bytes, bytes, bytes]]:
    """Yield of each row and cell whether it is a row, its letters and its digits, if stated."""
    rest = b""
    with archive.open(part) as stream:
        while chunk := stream.read(_CHUNK_BYTES):
            window = rest + chunk
            cut = window.rfind(
                b"<", max(0, len(window) - _LONGEST_TAG)
            )  # this tag may not be complete
            cut = len(window) if cut < 0 else cut
            yield from _PLACE.findall(window[:cut])
            rest = window[cut:]
    yield from _PLACE.findall(rest)


def _column_number(letters: bytes) -> int:
    number = 0
    for letter in letters.upper():
        number = 26 * number + letter - ord("A") + 1
    return number


# ---- what libraries raise that read binary files -----------------------------------------------

# Readers of binary files have no error of their own for damaged ones: whatever a missing part, a
# wrong length, index or type raises inside comes out.
DAMAGE: Final = (
    *(ArithmeticError, AssertionError, AttributeError, EOFError, LookupError, MemoryError),
    *(OSError, RuntimeError, SyntaxError, TypeError, ValueError),
    *(struct.error, zipfile.BadZipFile, zlib.error),
)
"""What they raise; RuntimeError stands also for a password, and for a newer form of the file."""


@contextmanager
def damage_named(
    place: Place, *, damage: tuple[type[BaseException], ...] = DAMAGE
) -> Generator[None]:
    """Turn what the reader of a damaged file raises into an error that names the file."""
    try:
        yield
    except damage as error:
        cause = (str(error).partition("\n")[0] or type(error).__name__)[:150]
        raise MeasurementFileError("file_damaged", cause=cause, place=place) from error
