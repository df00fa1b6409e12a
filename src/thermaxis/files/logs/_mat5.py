"""Numeric arrays of MATLAB files of level 5 (save -v6, -v7), by the published format.

Written here because the compiled reader of scipy ends the whole program on some damaged files.
Every length is checked against what is there before anything is taken.
"""

import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final, TypeAlias, final

import numpy as np

from thermaxis.positioning import FloatArray

HEADER_BYTES = 128
"""Length of the header. [byte]"""
UNPACKED_LIMIT_BYTES = 1_600_000_000
"""Largest unpacked variable. [byte]"""
_MATRIX, _COMPRESSED = 14, 15
_NUMBER_TYPES: Final = {
    1: "i1",
    2: "u1",
    3: "i2",
    4: "u2",
    5: "i4",
    6: "u4",
    7: "f4",
    9: "f8",
    12: "i8",
    13: "u8",
}
_STRUCT_CLASS = 2
_NUMERIC_CLASSES = frozenset(range(6, 16))
_MOST_ELEMENTS = 100_000
_MOST_DEPTH = 4
_LONGEST_NAME = 200

Found: TypeAlias = Callable[[str, FloatArray], None]


@final
@dataclass(frozen=True, slots=True)
class _Element:
    """A tagged piece of the file."""

    kind: int
    content: memoryview


def mat5_arrays(content: bytes) -> list[tuple[str, FloatArray]]:
    """Return the real numeric arrays of a file, those in structures under the field's name."""
    mark = content[126:128]
    if mark not in (b"IM", b"MI"):
        raise ValueError("the header has no mark of the byte order")
    order = "<" if mark == b"IM" else ">"
    arrays: list[tuple[str, FloatArray]] = []

    def found(name: str, values: FloatArray) -> None:
        arrays.append((name, values))

    for element in _elements(memoryview(content)[HEADER_BYTES:], order):
        if element.kind == _COMPRESSED:
            for inner in _elements(memoryview(_unpacked(element.content)), order):
                _read_matrix(inner, order, found, name="", depth=0)
        else:
            _read_matrix(element, order, found, name="", depth=0)
    return arrays


def _unpacked(content: memoryview) -> bytes:
    try:
        unpacker = zlib.decompressobj()
        unpacked = unpacker.decompress(content, UNPACKED_LIMIT_BYTES)
    except zlib.error as error:
        raise ValueError(f"a variable cannot be unpacked: {error}") from error
    if unpacker.unconsumed_tail or not unpacker.eof:
        raise ValueError("a variable is cut short or unpacks to too much")
    return unpacked


def _elements(content: memoryview, order: str) -> Iterator[_Element]:
    place, count = 0, 0
    while place + 8 <= len(content):
        count += 1
        if count > _MOST_ELEMENTS:
            raise ValueError("there are too many elements")
        (first,) = struct.unpack_from(f"{order}I", content, place)
        small = first >> 16
        if small:  # up to four bytes stand in the tag itself
            if small > 4:
                raise ValueError("a short element is longer than four bytes")
            yield _Element(first & 0xFFFF, content[place + 4 : place + 4 + small])
            place += 8
            continue
        (size,) = struct.unpack_from(f"{order}I", content, place + 4)
        end = place + 8 + size
        if end > len(content):
            raise ValueError("an element reaches beyond the end of the file")
        yield _Element(first, content[place + 8 : end])
        place = end if first == _COMPRESSED else end + (-size) % 8
    if place < len(content) and any(content[place:]):
        raise ValueError("the file is cut short")


def _read_matrix(element: _Element, order: str, found: Found, *, name: str, depth: int) -> None:
    """Give the array of an element, or those of the fields of a structure."""
    if element.kind != _MATRIX or len(element.content) == 0:
        return
    parts = _elements(element.content, order)
    flags = _next(parts)
    if len(flags.content) != 8:
        raise ValueError("the flags of a variable have the wrong length")
    (word,) = struct.unpack_from(f"{order}I", flags.content, 0)
    kind = word & 0xFF
    if kind not in _NUMERIC_CLASSES and kind != _STRUCT_CLASS:
        return
    shape = tuple(int(size) for size in _numbers(_next(parts), order))
    own = bytes(_next(parts).content).decode("ascii", errors="replace")[:_LONGEST_NAME]
    if len(shape) < 2 or any(size < 0 for size in shape):
        raise ValueError("a variable has an impossible shape")
    if kind == _STRUCT_CLASS:
        if shape == (1, 1) and depth < _MOST_DEPTH:
            _read_fields(parts, order, found, depth=depth)
        return
    values = _numbers(_next(parts), order)
    expected = 1
    for size in shape:
        expected *= size
    if values.size != expected:
        raise ValueError(f"the variable {own or name} has {values.size} values, not {expected}")
    found(own or name, values.reshape(shape, order="F"))


def _read_fields(parts: Iterator[_Element], order: str, found: Found, *, depth: int) -> None:
    length = _numbers(_next(parts), order)
    names = bytes(_next(parts).content)
    width = int(length[0]) if length.size else 0
    if not 0 < width <= _LONGEST_NAME or len(names) % width:
        raise ValueError("the names of a structure's fields have the wrong length")
    for begin in range(0, len(names), width):
        field = names[begin : begin + width].split(b"\x00")[0].decode("ascii", errors="replace")
        _read_matrix(_next(parts), order, found, name=field, depth=depth + 1)


def _next(parts: Iterator[_Element]) -> _Element:
    element = next(parts, None)
    if element is None:
        raise ValueError("a part of a variable is missing")
    return element


def _numbers(element: _Element, order: str) -> FloatArray:
    kind = _NUMBER_TYPES.get(element.kind)
    if kind is None:
        raise ValueError(f"numbers are stored as an unknown type {element.kind}")
    stored = np.dtype(f"{order}{kind}")
    if len(element.content) % stored.itemsize:
        raise ValueError("numbers have the wrong length")
    with np.errstate(invalid="ignore"):
        return np.frombuffer(element.content, dtype=stored).astype(np.float64)
