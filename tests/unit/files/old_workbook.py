"""Workbooks of the old kind, ``.xls``: BIFF8 records in an OLE container, written by hand.

After the published record layouts: numbers, texts, dates (a number with a format) and errors.
"""

import datetime as dt
import struct
from collections.abc import Iterable, Sequence

ERRORS = {"#DIV/0!": 0x07, "#N/A": 0x2A, "#REF!": 0x17}
_SECTOR = 512
_EPOCH = dt.datetime(1899, 12, 30)  # noqa: DTZ001  workbooks know no zones


def _record(code: int, body: bytes = b"") -> bytes:
    return struct.pack("<HH", code, len(body)) + body


def _cell(row: int, column: int, value: object) -> bytes:
    place = struct.pack("<HHH", row, column, int(isinstance(value, dt.datetime)))
    if isinstance(value, dt.datetime):
        value = (value - _EPOCH) / dt.timedelta(days=1)
    if isinstance(value, str) and value in ERRORS:
        return _record(0x0205, place + bytes([ERRORS[value], 1]))
    if isinstance(value, str):
        text = value.encode("utf-16-le")
        return _record(0x0204, place + struct.pack("<HB", len(value), 1) + text)
    return _record(0x0203, place + struct.pack("<d", float(str(value))))


def _beginning(kind: int) -> bytes:
    return _record(0x0809, struct.pack("<HHHHII", 0x0600, kind, 0x0DBB, 0x07CC, 0, 6))


def old_workbook(*sheets: Iterable[Sequence[object]]) -> bytes:
    """Write sheets of rows of cells."""
    bodies = [
        _beginning(0x0010)
        + b"".join(
            _cell(r, c, value)
            for r, row in enumerate(rows)
            for c, value in enumerate(row)
            if value is not None and value != ""
        )
        + _record(0x000A)
        for rows in sheets
    ]
    date = struct.pack("<HHH", 0, 22, 0) + bytes(14)
    styles = _record(0x00E0, bytes(20)) + _record(0x00E0, date)
    names = [f"Tab{k + 1}".encode() for k in range(len(bodies))]
    size = 20 + len(styles) + sum(4 + 8 + len(name) for name in names) + 4
    listed = b""
    for name, body in zip(names, bodies, strict=True):
        listed += _record(0x0085, struct.pack("<IBBBB", size, 0, 0, len(name), 0) + name)
        size += len(body)
    stream = _beginning(0x0005) + styles + listed + _record(0x000A) + b"".join(bodies)
    return _container(stream)


def _container(stream: bytes) -> bytes:
    """Put a stream into an OLE file: header, one table of sectors, one directory, the stream."""
    stream += bytes(max(0, 4096 - len(stream)))
    stream += bytes(-len(stream) % _SECTOR)
    count = len(stream) // _SECTOR
    chain = [*range(3, count + 2), 0xFFFFFFFE]
    table = [0xFFFFFFFD, 0xFFFFFFFE, *chain]
    assert len(table) <= _SECTOR // 4, "one table of sectors only"
    table += [0xFFFFFFFF] * (_SECTOR // 4 - len(table))
    header = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(16)
    header += struct.pack("<HHHHH", 0x3E, 3, 0xFFFE, 9, 6) + bytes(10)
    header += struct.pack("<IIIIIIII", 1, 1, 0, 4096, 0xFFFFFFFE, 0, 0xFFFFFFFE, 0)
    header += struct.pack("<I", 0) + b"\xff" * 432

    def entry(name: str, kind: int, child: int, start: int, length: int) -> bytes:
        text = (name.encode("utf-16-le") + b"\0\0").ljust(64, b"\0")
        sizes = struct.pack("<HBBIII", 2 * len(name) + 2, kind, 1, 0xFFFFFFFF, 0xFFFFFFFF, child)
        return text + sizes + bytes(36) + struct.pack("<IQ", start, length)

    directory = entry("Root Entry", 5, 1, 0xFFFFFFFE, 0)
    directory += entry("Workbook", 2, 0xFFFFFFFF, 2, len(stream)) + bytes(256)
    return header + struct.pack("<128I", *table) + directory + stream
