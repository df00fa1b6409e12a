"""Read a text file whole: what it is, its encoding, its lines, its numbers."""

import codecs
import json
import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import final

from thermaxis.codes import Message, Place, remark
from thermaxis.errors import ConfigurationError, MeasurementFileError
from thermaxis.files._opened import check_size, opened

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
    (b"\x89PNG", "picture"),
    (b"\xff\xd8\xff", "picture"),
    (b"GIF8", "picture"),
    (b"II*\x00", "picture"),
    (b"MM\x00*", "picture"),
    (b"%PDF-", "pdf"),
    (b"PK\x03\x04", "workbook"),
    (b"PK\x05\x06", "archive"),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "old_workbook"),
    (b"\x1f\x8b", "archive"),
    (b"7z\xbc\xaf\x27\x1c", "archive"),
    (b"Rar!\x1a\x07", "archive"),
    (b"SQLite format 3\x00", "database"),
    (b"\x7fELF", "program"),
)
_UTF16_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_UTF16_LOOKED_AT = 4096
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
    remarks: tuple[Message, ...] = ()
    """What the reader should know about the encoding."""

    @property
    def lines(self) -> list[str]:
        """The lines without their ends; line 1 has the index 0."""
        return self.text.split("\n")

    def at(self, line: int | None = None, column: str = "") -> Place:
        """Return a place in this file."""
        return Place(self.path, line, column)


def kind_of_content(start: bytes) -> str | None:
    """Return what a file is that is no text, as a word of the catalogue."""
    if start[:4] == b"RIFF" and start[8:12] == b"WEBP":
        return "picture"
    return next((kind for magic, kind in _SIGNATURES if start.startswith(magic)), None)


def read_start(path: Path | str, count: int, *, limit_bytes: int) -> tuple[bytes, int]:
    """Return the first bytes of a regular file of bounded size, and its size. [byte]"""
    with opened(path, limit_bytes) as (stream, size):
        return stream.read(count), size


def read_content(path: Path | str) -> bytes:
    """Read a regular, non-empty file of bounded size, once."""
    with opened(path, TEXT_LIMIT_BYTES) as (stream, size):
        is_archive = stream.peek(len(_ARCHIVE_START)).startswith(_ARCHIVE_START)
        limit_bytes = WORKBOOK_LIMIT_BYTES if is_archive else TEXT_LIMIT_BYTES
        content = b"" if size > limit_bytes else stream.read(limit_bytes + 1)
    check_size(path, max(size, len(content)), limit_bytes, MeasurementFileError)
    if not content:
        raise MeasurementFileError("file_empty", file=path)
    return content


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
    marked = with_utf16_mark(content)
    source = _decode(path, marked, fallback_encoding)
    if marked is not content:
        source = replace(source, remarks=(remark("utf16_without_mark"),))
    if not source.text.strip():
        raise MeasurementFileError("file_empty", file=path)
    return source


def with_utf16_mark(content: bytes) -> bytes:
    """Return UTF-16 that lacks its byte order mark with it: every other byte of it is zero."""
    start = content[:_UTF16_LOOKED_AT]
    if len(start) < 4 or b"\x00" not in start or start.startswith(_UTF16_MARKS):
        return content
    even, odd = start[::2].count(0), start[1::2].count(0)
    if min(even, odd) > 0 or max(even, odd) < 0.4 * len(start) / 2 or len(content) % 2:
        return content
    return (codecs.BOM_UTF16_LE if odd else codecs.BOM_UTF16_BE) + content


def parse_number(text: str, place: Place, *, decimal: str = ".") -> float:
    """Read a finite decimal number."""
    word = text.strip(" \t")
    if not is_number(word, decimal=decimal):
        if not word:
            raise MeasurementFileError("number_missing", place=place)
        raise MeasurementFileError("not_a_number", text=word, place=place)
    value = float(word.replace(decimal, "."))
    if abs(value) > NUMBER_LIMIT:
        raise MeasurementFileError("magnitude_too_large", most=NUMBER_LIMIT, place=place)
    return value


def parse_whole_number(text: str, place: Place) -> int:
    """Read a whole number from 0 up, such as a run number or a count."""
    word = text.strip(" \t")
    if _WHOLE_NUMBER.fullmatch(word) is None:
        raise MeasurementFileError("not_a_whole_number", text=word, place=place)
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


@cache
def _check_fallback(encoding: str) -> None:
    try:
        known = all(bytes([byte]).decode(encoding) == chr(byte) for byte in range(32, 127))
    except (LookupError, UnicodeError, ValueError):
        known = False
    if not known:
        raise ConfigurationError("unusable_encoding", name=encoding, key="fallback_encoding")


def _decode(name: str, content: bytes, fallback: str) -> SourceText:
    check_is_text(content, Place(name))
    _check_lines(name, content)
    if content.startswith(_UTF16_MARKS):
        return _decode_utf16(name, content)
    content = content.removeprefix(codecs.BOM_UTF8)
    try:
        return SourceText(name, _one_line_end(content.decode("utf-8")), "utf-8")
    except UnicodeDecodeError:
        text = _one_line_end(content.decode(fallback, errors="replace"))
    lost = text.count(_LOST)
    said = remark("not_utf8", encoding=fallback)
    if lost:
        where = _lines_with_lost(text)
        said = remark("characters_lost", encoding=fallback, count=lost, where=where)
    return SourceText(name, text, fallback, (said,))


def check_is_text(content: bytes, place: Place) -> None:
    """Refuse what is no text: files of other kinds, and zero bytes that UTF-16 does not explain."""
    kind = kind_of_content(content[:16])
    if kind is not None:
        raise MeasurementFileError("not_text", kind=kind, place=place)
    if b"\x00" in content and not content.startswith(_UTF16_MARKS):
        raise MeasurementFileError("not_text", kind="binary", place=place)


def _check_lines(name: str, content: bytes) -> None:
    """Refuse too many or too long lines before the text takes as much memory again."""
    ends = (b"\n", b"\r")
    if content.startswith(codecs.BOM_UTF16_LE):
        ends = (b"\n\x00", b"\r\x00")
    elif content.startswith(codecs.BOM_UTF16_BE):
        ends = (b"\x00\n", b"\x00\r")
    if any(content.count(end) > MAX_LINES for end in ends):
        raise MeasurementFileError("too_many_lines", most=MAX_LINES, file=name)
    start = 0
    while len(content) - start > LONGEST_LINE_BYTES:
        window = start, start + LONGEST_LINE_BYTES
        end = max(content.rfind(end, *window) for end in ends)
        if end < 0:
            line = 1 + content.count(ends[0], 0, start)
            most = LONGEST_LINE_BYTES // 4
            raise MeasurementFileError("line_too_long", most=most, file=name, line=line)
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
        raise MeasurementFileError("cut_short", file=name) from error
    if "\x00" in text:
        raise MeasurementFileError("not_text", kind="binary", file=name)
    return SourceText(name, _one_line_end(text), "utf-16")


def _one_line_end(text: str) -> str:
    return text.replace("\r\n", "\n").replace("\r", "\n")


# ---- text that a spreadsheet program takes for nothing else -----------------------------------

_FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r")
_NEW_CELL = re.compile(r"[,;|]\s*([=+\-@]|$)")


def protected(text: str) -> str:
    """Return the text of a cell as a spreadsheet program shows it, not as a formula."""
    return f"'{text}" if text.startswith((*_FORMULA_STARTS, "'")) else text


def unprotected(text: str) -> str:
    """Take away the apostrophe that `protected` puts before a text."""
    guarded = text.startswith("'") and text[1:].startswith((*_FORMULA_STARTS, "'"))
    return text[1:] if guarded else text


def encoded(text: str) -> str:
    """Return a text in a form that fits one line of comment and keeps every character.

    Most texts stay as they are. A text with control characters, with blanks at its ends, or that
    a spreadsheet program would cut into a cell that starts like a formula, becomes a JSON string.
    """
    plain = text.isprintable() and text == text.strip() and not text.startswith('"')
    if plain and _NEW_CELL.search(text) is None:
        return text
    return quoted(text)


def quoted(text: str) -> str:
    """Return a text as a JSON string in which nothing separates cells."""
    return json.dumps(text).replace(",", "\\u002c").replace(";", "\\u003b").replace("|", "\\u007c")


def decoded(text: str) -> str:
    """Return the text that `encoded` wrote; any other text stays as it is."""
    if not text.startswith('"'):
        return text
    try:
        value: object = json.loads(text)
    except ValueError:
        return text
    return value if isinstance(value, str) else text
