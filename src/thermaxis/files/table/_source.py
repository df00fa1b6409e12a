"""Read a text file whole: what it is, its encoding, its lines, its numbers."""

import codecs
import io
import re
import stat
import unicodedata
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import final

from thermaxis.errors import ConfigurationError, MeasurementFileError

TEXT_LIMIT_BYTES = 100_000_000
"""Largest text file that is read. [byte]"""
MAX_LINES = 2_000_000
"""Largest number of lines of a text file: more are raw samples, not stops. [1]"""
LONGEST_LINE_BYTES = 4_000_000
"""Longest line of a text file: a million characters of four bytes. [byte]"""
WORKBOOK_LIMIT_BYTES = 50_000_000
"""Largest workbook file that is read. [byte]"""
NUMBER_LIMIT = 1e9
"""Largest magnitude of a number in a file: beyond every axis, and sums of squares stay finite."""
FALLBACK_ENCODING = "cp1250"
"""Encoding of a file that is not UTF-8, unless the caller names one: Windows, Central Europe."""
HEADER_TEXT_LIMIT = 1000
"""Longest text of a header field that is kept. [character]"""

_ARCHIVE_START = b"PK"
_SIGNATURES: tuple[tuple[bytes, str], ...] = (
    (b"\x89PNG", "a picture (PNG)"),
    (b"\xff\xd8\xff", "a picture (JPEG)"),
    (b"GIF8", "a picture (GIF)"),
    (b"II*\x00", "a picture (TIFF)"),
    (b"MM\x00*", "a picture (TIFF)"),
    (b"%PDF-", "a PDF document"),
    (b"PK\x03\x04", "a workbook (.xlsx) or another zip archive"),
    (b"PK\x05\x06", "an empty zip archive"),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "a workbook of the old kind (.xls) or encrypted"),
    (b"\x1f\x8b", "a compressed file (gzip)"),
    (b"7z\xbc\xaf\x27\x1c", "a compressed archive (7z)"),
    (b"Rar!\x1a\x07", "a compressed archive (RAR)"),
    (b"SQLite format 3\x00", "a database (SQLite)"),
    (b"\x7fELF", "a program"),
)
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?")
_WHOLE_NUMBER = re.compile(r"[0-9]{1,10}")
_LONGEST_NUMBER = 100
_LOST = "\N{REPLACEMENT CHARACTER}"
_LINES_NAMED = 5
_UNWANTED_CATEGORIES = frozenset({"Cc", "Cs", "Cn", "Zl", "Zp"})
_DIRECTION_MARKS = frozenset("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")


@final
@dataclass(frozen=True, slots=True)
class SourceText:
    """The text of a measurement file, decoded, with one kind of line end."""

    path: str
    """The file, as the caller named it: for errors."""
    text: str
    """All of it, without byte order mark, every line end written as a line feed."""
    encoding: str
    """Encoding that it was read with, by its Python name."""
    remarks: tuple[str, ...] = ()
    """What the reader should know about the encoding."""

    @property
    def lines(self) -> list[str]:
        """The lines without their ends; line 1 has the index 0."""
        return self.text.split("\n")

    def error(
        self, what: str, *, line: int | None = None, column: str | None = None, remedy: str
    ) -> MeasurementFileError:
        """Make the error that says what is wrong in this file."""
        return MeasurementFileError(what, path=self.path, line=line, column=column, remedy=remedy)


def kind_of_content(start: bytes) -> str | None:
    """Say what a file seems to be that is not text."""
    if start[:4] == b"RIFF" and start[8:12] == b"WEBP":
        return "a picture (WebP)"
    return next((name for magic, name in _SIGNATURES if start.startswith(magic)), None)


def read_start(path: Path | str, count: int, *, limit_bytes: int) -> tuple[bytes, int]:
    """Return the first bytes of a regular file of bounded size, and its size. [byte]"""
    with _opened(path, limit_bytes) as (stream, size):
        return stream.read(count), size


def read_content(path: Path | str) -> bytes:
    """Read a regular, non-empty file of bounded size, once."""
    with _opened(path, TEXT_LIMIT_BYTES) as (stream, size):
        is_archive = stream.peek(len(_ARCHIVE_START)).startswith(_ARCHIVE_START)
        limit_bytes = WORKBOOK_LIMIT_BYTES if is_archive else TEXT_LIMIT_BYTES
        content = b"" if size > limit_bytes else stream.read(limit_bytes + 1)
    size = max(size, len(content))  # it may have grown since its size was asked for
    if size > limit_bytes:
        raise _too_large(str(path), size, limit_bytes)
    if not content:
        raise MeasurementFileError(
            "the file is empty", path=str(path), remedy="Export the measurement again"
        )
    return content


@contextmanager
def _opened(path: Path | str, limit_bytes: int) -> Generator[tuple[io.BufferedReader, int]]:
    """Open a regular file of bounded size; whatever the system says becomes one of our errors."""
    name = str(path)
    try:
        status = Path(path).stat()
        if stat.S_ISDIR(status.st_mode):
            raise MeasurementFileError(
                "this is a folder, not a file", path=name, remedy="Name one file in it"
            )
        if not stat.S_ISREG(status.st_mode):  # opening a pipe would wait for a writer
            raise MeasurementFileError(
                "this is not a regular file", path=name, remedy="Save the measurement as a file"
            )
        if status.st_size > limit_bytes:
            raise _too_large(name, status.st_size, limit_bytes)
        with Path(path).open("rb") as stream:
            yield stream, status.st_size
    except FileNotFoundError:
        raise MeasurementFileError(
            "there is no such file", path=name, remedy="Check the name and the folder"
        ) from None
    except OSError as error:
        raise MeasurementFileError(
            f"the file cannot be read ({error.strerror or type(error).__name__})",
            path=name,
            remedy="Check the name, the permissions and whether another program holds it open",
        ) from error
    except ValueError as error:  # a NUL character in the name
        raise MeasurementFileError(
            "this cannot be the name of a file", path=name, remedy="Check the name"
        ) from error


def write_content(path: Path | str, content: bytes) -> None:
    """Write a file; whatever the system says becomes one of our errors."""
    try:
        Path(path).write_bytes(content)
    except (OSError, ValueError) as error:  # ValueError: a NUL character in the name
        reason = getattr(error, "strerror", None) or "this cannot be the name of a file"
        raise MeasurementFileError(
            f"the file cannot be written ({reason})",
            path=str(path),
            remedy="Check the folder, its permissions and the space that is left",
        ) from error


def read_text(path: Path | str, *, fallback_encoding: str = FALLBACK_ENCODING) -> SourceText:
    """Read a text file whole: UTF-8, UTF-16 with byte order mark, or else the fallback.

    Numbers and keywords of every format are ASCII, so a wrong fallback changes names and titles
    only, never a result; the remarks say when it was used.
    """
    return decode_text(str(path), read_content(path), fallback_encoding=fallback_encoding)


def decode_text(
    path: str, content: bytes, *, fallback_encoding: str = FALLBACK_ENCODING
) -> SourceText:
    """Decode the bytes of a text file, as `read_text` does."""
    _check_fallback(fallback_encoding)
    source = _decode(path, content, fallback_encoding)
    if not source.text.strip():
        raise source.error("the file is empty", remedy="Export the measurement again")
    return source


def parse_number(
    text: str,
    *,
    path: str,
    line: int | None = None,
    column: str | None = None,
    cell: str | None = None,
    decimal: str = ".",
) -> float:
    """Read a finite decimal number."""
    word = text.strip(" \t")
    plain = word if decimal == "." else _with_point(word, decimal)
    if len(plain) <= _LONGEST_NUMBER and _NUMBER.fullmatch(plain) is not None:
        value = float(plain)
        if abs(value) <= NUMBER_LIMIT:
            return value
        what, remedy = (
            f"'{word}' is too large for a measured value",
            "Check the unit and the digits",
        )
    elif not word:
        what, remedy = "a number is missing", "Write the number, or leave the whole reading out"
    else:
        what = f"'{word}' is not a number"
        remedy = f"Write digits with a decimal {'point' if decimal == '.' else 'comma'}"
    raise MeasurementFileError(what, path=path, line=line, column=column, cell=cell, remedy=remedy)


def parse_whole_number(
    text: str,
    *,
    path: str,
    line: int | None = None,
    column: str | None = None,
    cell: str | None = None,
) -> int:
    """Read a whole number from 0 up, such as a run number or a count."""
    word = text.strip(" \t")
    if _WHOLE_NUMBER.fullmatch(word) is None:
        what = f"'{word}' is not a whole number" if word else "a whole number is missing"
        raise MeasurementFileError(
            what, path=path, line=line, column=column, cell=cell, remedy="Write digits only"
        )
    return int(word)


def is_number(text: str, *, decimal: str = ".") -> bool:
    """Say whether a word has the form of a decimal number, whatever its magnitude."""
    word = text.strip(" \t")
    plain = word if decimal == "." else _with_point(word, decimal)
    return len(plain) <= _LONGEST_NUMBER and _NUMBER.fullmatch(plain) is not None


def clean_text(text: str, *, limit: int = HEADER_TEXT_LIMIT) -> str:
    """Return text of a header field without what is not writing.

    Control characters, line separators, marks that turn the direction of writing and code points
    that are no characters become a space. Nothing else changes: text is data, and is escaped
    where it is shown.
    """
    if not text.isprintable():
        text = "".join(" " if _is_unwanted(c) else c for c in text[: 4 * limit])
    text = text.strip()
    return text if len(text) <= limit else text[: limit - 3] + "..."


def first_few(names: Sequence[str], *, shown: int = 5) -> str:
    """List names in words, the first few of many."""
    head = ", ".join(names[:shown])
    return head if len(names) <= shown else f"{head} and {len(names) - shown} more"


def _is_unwanted(character: str) -> bool:
    category = unicodedata.category(character)
    return category in _UNWANTED_CATEGORIES or character in _DIRECTION_MARKS


def _with_point(word: str, decimal: str) -> str:
    # a point beside a decimal comma would be a sign for thousands: not a number
    return "" if "." in word else word.replace(decimal, ".")


def _too_large(name: str, size: int, limit: int) -> MeasurementFileError:
    return MeasurementFileError(
        f"the file has {size / 1e6:.1f} MB, more than the limit of {limit / 1e6:.0f} MB",
        path=name,
        remedy="Export one run per file, without raw samples",
    )


def _check_fallback(encoding: str) -> None:
    try:
        known = all(bytes([byte]).decode(encoding) == chr(byte) for byte in range(32, 127))
    except (LookupError, UnicodeError, ValueError):
        known = False
    if not known:
        raise ConfigurationError(
            f"'{encoding}' is not a usable text encoding",
            where="fallback encoding",
            remedy="Name one that contains ASCII, such as cp1250, cp1252 or gbk",
        )


def _decode(name: str, content: bytes, fallback: str) -> SourceText:
    seems = kind_of_content(content[:16])
    if seems is not None:
        raise MeasurementFileError(
            f"this is {seems}, not a text file",
            path=name,
            remedy="Name the measurement file itself, or export the measurement as text",
        )
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        _check_lines(name, content)
        return _decode_utf16(name, content)
    if b"\x00" in content:
        raise MeasurementFileError(
            "the file contains zero bytes: it is binary, or UTF-16 without byte order mark",
            path=name,
            remedy="Export the measurement as text, or save it as UTF-8",
        )
    _check_lines(name, content)
    content = content.removeprefix(codecs.BOM_UTF8)
    try:
        return SourceText(name, _one_line_end(content.decode("utf-8")), "utf-8")
    except UnicodeDecodeError:
        text = _one_line_end(content.decode(fallback, errors="replace"))
    remark = f"the file is not UTF-8: its texts were read as {fallback}, numbers are not affected"
    lost = text.count(_LOST)
    if lost:
        remark += (
            f"; {lost} character{'s' if lost > 1 else ''} could not be read in this way"
            f" ({_lines_with_lost(text)}): name the right encoding to see them, with --encoding on"
            " the command line or fallback_encoding in Python"
        )
    return SourceText(name, text, fallback, (remark,))


def _check_lines(name: str, content: bytes) -> None:
    """Refuse too many or too long lines before the text takes as much memory again."""
    ends = (b"\n", b"\r")
    if content.startswith(codecs.BOM_UTF16_LE):
        ends = (b"\n\x00", b"\r\x00")
    elif content.startswith(codecs.BOM_UTF16_BE):
        ends = (b"\x00\n", b"\x00\r")
    remedy = "Export one run per file, with one row per reading or per target"
    if any(content.count(end) > MAX_LINES for end in ends):
        raise MeasurementFileError(
            f"the file has more than {MAX_LINES} lines", path=name, remedy=remedy
        )
    start = 0
    while len(content) - start > LONGEST_LINE_BYTES:
        window = start, start + LONGEST_LINE_BYTES
        end = max(content.rfind(end, *window) for end in ends)
        if end < 0:
            raise MeasurementFileError(
                f"a line is longer than {LONGEST_LINE_BYTES / 1e6:.0f} MB, from byte {start} on",
                path=name,
                remedy=remedy,
            )
        start = end + 1


def _lines_with_lost(text: str) -> str:
    """Name the first lines that hold a character that could not be decoded."""
    lines: list[int] = []
    line, start = 1, 0
    place = text.find(_LOST)
    while place >= 0 and len(lines) <= _LINES_NAMED:
        line += text.count("\n", start, place)
        lines.append(line)
        start = text.find("\n", place)
        place = text.find(_LOST, start) if start >= 0 else -1
    named = ", ".join(map(str, lines[:_LINES_NAMED]))
    others = " and others" if len(lines) > _LINES_NAMED else ""
    return f"line{'s' if len(lines) > 1 else ''} {named}{others}"


def _decode_utf16(name: str, content: bytes) -> SourceText:
    try:
        text = content.decode("utf-16")
    except UnicodeDecodeError as error:
        raise MeasurementFileError(
            "the file starts as UTF-16 and is not",
            path=name,
            remedy="Copy or export the file again; it is damaged or cut short",
        ) from error
    if "\x00" in text:
        raise MeasurementFileError(
            "the file contains zero characters: it is binary",
            path=name,
            remedy="Export the measurement as text",
        )
    return SourceText(name, _one_line_end(text), "utf-16")


def _one_line_end(text: str) -> str:
    return text.replace("\r\n", "\n").replace("\r", "\n")
