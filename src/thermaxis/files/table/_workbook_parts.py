"""The parts of a workbook archive, checked before anything unpacks or parses them."""

import io
import re
import struct
import zipfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import final

from thermaxis.errors import MeasurementFileError
from thermaxis.files.table._damage import damage_named

UNPACKED_LIMIT_BYTES = 80_000_000
"""Largest sum of the unpacked parts: a million cells of about 55 bytes, and texts. [byte]"""
DAMAGED = "the workbook is damaged"
REMEDY = "Open it in a spreadsheet program and save it again, or export it as CSV"
"""What is said of a workbook that cannot be unpacked or parsed."""
CELL_LIMIT = 1_000_000
"""Largest number of cells of all sheets, and of the rectangle that a sheet spans. [1]"""

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


def check_parts(content: bytes, *, path: str) -> bool:
    """Check the parts of a workbook before it is parsed.

    Everything is checked in the archive's directory first, then in the stream of unpacked bytes:
    nothing is held in memory, and no part can unpack to more than its stated size.
    """
    _check_directory_size(content, path)
    counts = _Counts()
    with (
        damage_named(DAMAGED, path=path, remedy=REMEDY),
        zipfile.ZipFile(io.BytesIO(content)) as archive,
    ):
        parts = archive.infolist()
        _check_directory(parts, path)
        for part in parts:
            if not part.is_dir():
                _check_part(archive, part, counts, path)
        for part in parts:
            if _SHEET.fullmatch(part.filename) is not None:
                _check_places(archive, part, path)
    return counts.formulas > 0


def _refused(path: str, what: str, remedy: str) -> MeasurementFileError:
    return MeasurementFileError(what, path=path, remedy=remedy)


def _too_large(path: str, what: str) -> MeasurementFileError:
    return _refused(path, what, "Save only the sheet with the measured run, or export it as CSV")


def _check_directory_size(content: bytes, path: str) -> None:
    """Refuse a directory that would not fit into memory, wherever a reader may look for it."""
    tail_start = max(0, len(content) - _END_RECORD_BYTES - _LONGEST_COMMENT_BYTES)
    place = content.find(_END_RECORD, tail_start)
    found = False
    while place >= 0:
        record = content[place : place + _END_RECORD_BYTES]
        locator = content[max(0, place - _BIG_LOCATOR_BYTES) : place]
        if len(record) == _END_RECORD_BYTES:
            found = True
            (size,) = struct.unpack_from("<I", record, 12)
            if size > _DIRECTORY_LIMIT_BYTES or locator.startswith(_BIG_LOCATOR):
                raise _too_large(path, "the directory of the workbook's parts is too large")
        place = content.find(_END_RECORD, place + 1)
    if not found:
        raise _refused(
            path,
            "the workbook is damaged or cut short: its directory of parts is missing",
            "Copy or save the file again",
        )


def _check_directory(parts: list[zipfile.ZipInfo], path: str) -> None:
    names = [part.filename for part in parts]
    if "[Content_Types].xml" not in names:
        seems = "an OpenDocument file" if "mimetype" in names else "a zip archive"
        raise _refused(
            path, f"this is {seems}, not a workbook", "Save the sheet as .xlsx or as CSV"
        )
    if len(parts) > _PART_LIMIT:
        raise _too_large(path, f"the workbook has {len(parts)} parts")
    name, count = Counter(names).most_common(1)[0]
    if count > 1:
        raise _refused(
            path,
            f"the workbook has two parts named {name}",
            "Save it again in a spreadsheet program",
        )
    unpacked = sum(part.file_size for part in parts)
    if unpacked > UNPACKED_LIMIT_BYTES:
        raise _too_large(
            path,
            f"the workbook unpacks to {unpacked / 1e6:.0f} MB,"
            f" more than {UNPACKED_LIMIT_BYTES / 1e6:.0f} MB",
        )
    for part in parts:
        if part.flag_bits & 1:
            raise _refused(path, "the workbook has a password", "Save it without a password")
        if part.compress_type not in _METHODS:
            raise _refused(
                path,
                f"the part {part.filename} is packed in a way that workbooks do not use",
                "Save it again in a spreadsheet program",
            )


def _check_part(
    archive: zipfile.ZipFile, part: zipfile.ZipInfo, counts: _Counts, path: str
) -> None:
    is_sheet = _SHEET.fullmatch(part.filename) is not None
    end = b""
    with archive.open(part) as stream:
        chunk = stream.read(_CHUNK_BYTES)
        if _is_xml(chunk):
            _check_start(part, chunk, is_sheet=is_sheet, path=path)
        while chunk:
            window = end + chunk
            if b"<!DOCTYPE" in window or b"<!ENTITY" in window:
                raise _refused(
                    path,
                    f"the part {part.filename} declares a document type, which no workbook does",
                    "Save it again in a spreadsheet program",
                )
            if is_sheet:
                _count(window, len(end), counts)
                _check_counts(counts, path)
            end = window[-_OVERLAP_BYTES:]
            chunk = stream.read(_CHUNK_BYTES)
    if counts.tags > _TAGS_PER_CELL * (counts.cells + counts.rows) + _OTHER_TAGS:
        raise _too_large(path, f"the part {part.filename} holds far more than cells")


def _is_xml(start: bytes) -> bool:
    head = start[:64].removeprefix(b"\xef\xbb\xbf").lstrip()
    return head.startswith((b"\xff\xfe", b"\xfe\xff")) or b"<" in head[:2]


def _check_start(part: zipfile.ZipInfo, start: bytes, *, is_sheet: bool, path: str) -> None:
    stated = _ENCODING.search(start[:256])
    encoding = b"utf-8" if stated is None else stated[1].lower()
    if b"\x00" in start or encoding not in {b"utf-8", b"us-ascii"} or start[:1] in b"\xfe\xff":
        raise _refused(
            path,
            f"the part {part.filename} is not UTF-8",
            "Save it again in a spreadsheet program",
        )
    texts = part.filename.lower().lstrip("/") == _TEXTS
    limit = _TEXT_LIMIT_BYTES if texts else _TREE_LIMIT_BYTES
    if part.file_size > limit and not is_sheet:
        raise _too_large(
            path, f"the part {part.filename} unpacks to more than {limit / 1e6:.0f} MB"
        )
    if part.filename == "[Content_Types].xml":
        main = b" ".join(tag for tag in start.split(b"<") if b"main+xml" in tag)
        if b"/worksheets/" in main or b"sharedStrings" in main:
            raise _refused(
                path,
                "the workbook names one of its sheets as its list of sheets",
                "Save it again in a spreadsheet program",
            )


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


def _check_counts(counts: _Counts, path: str) -> None:
    if max(counts.cells, counts.rows) > CELL_LIMIT:
        raise _too_large(path, f"the workbook has more than {CELL_LIMIT} cells")


def _check_places(archive: zipfile.ZipFile, part: zipfile.ZipInfo, path: str) -> None:
    """Check that rows and cells rise: the parser drops those that do not, without a word."""
    row = column = 0
    columns: dict[bytes, int] = {}
    for is_row, letters, digits in _places(archive, part):
        if is_row:
            before, column = row, 0
            row = int(digits) if digits else row + 1
            if row <= before:
                raise _not_rising(path, part, f"row {row} stands behind row {before}")
            continue
        before = column
        if letters not in columns:
            columns[letters] = _column_number(letters)
        column = columns[letters] if letters else column + 1
        if column <= before:
            cell = letters.decode().upper()
            raise _not_rising(path, part, f"the cell {cell}{row} is not in the order of columns")
        if column > _COLUMN_LIMIT:
            raise _too_large(path, f"row {row} has more than {_COLUMN_LIMIT} columns")


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


def _not_rising(path: str, part: zipfile.ZipInfo, what: str) -> MeasurementFileError:
    return _refused(
        path,
        f"{what} in the part {part.filename}: some cells would be lost",
        "Open it in a spreadsheet program and save it again",
    )
