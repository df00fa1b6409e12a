"""What a stored row consists of: the names and lengths of everything in a record of a cycle."""

import json
import struct
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any, NamedTuple, cast, final

from thermaxis.errors import DataError

SCALARS = ("time_s", "since_s", "elapsed_s")
"""Fields of a cycle's output that are one number."""
BY_OUTPUT = ("correction_um", "wanted_um", "model_um", "weight", "trim_um", "before_um")
"""Fields that have a number for every output."""
FLAGS = ("at_limit",)
"""Fields that have a flag for every output."""
OF_RECORD = ("monotonic_s", "lateness_s", "diameter_mm")
"""Numbers of the record besides its output; every row begins with them, then with `SCALARS`."""


class SeriesColumn(NamedTuple):
    """One number of every row, by the name that users know it by."""

    name: str
    """Name, such as ``T_spindle_C``, ``Z_um.correction``, ``Z_um.part.spindle``."""
    unit: str
    """Unit; empty where the name of a channel says it."""
    place: int
    """Which of the row's numbers. [1]"""
    good: int | None = None
    """Which of the row's flags says whether the value is good; None where it always is. [1]"""


@final
@dataclass(frozen=True)
class Layout:
    """Names and lengths of everything in a record, in the order of its row."""

    samples: tuple[str, ...]
    """Names of what was read."""
    applied: tuple[str, ...]
    """Names of the outputs about which the machine said something."""
    outputs: tuple[str, ...]
    """Names of the outputs."""
    channels: tuple[str, ...]
    """Names of the model's channels."""
    parts: tuple[tuple[str, ...], ...]
    """Names of the parts, by output."""
    lengths: tuple[int, ...]
    """How many numbers each quantity by output has."""
    contribution: tuple[int, ...]
    """How many contributions each output has."""
    gain: tuple[int, ...]
    """How many gains each output has."""
    values: int
    """How many values the model was given."""
    qualities: int
    """How many of them were judged."""
    flag_lengths: tuple[int, ...]
    """How many flags each field of flags has."""
    scalars: tuple[str, ...] = SCALARS
    """Names of the single numbers."""
    by_output: tuple[str, ...] = BY_OUTPUT
    """Names of the quantities by output."""
    flags: tuple[str, ...] = FLAGS
    """Names of the fields of flags."""

    @cached_property
    def counts(self) -> tuple[int, int, int, int]:
        """Numbers, times, words and flags of a row. [1]"""
        numbers = len(OF_RECORD) + len(self.scalars) + sum(self.lengths)
        numbers += sum(self.contribution) + sum(self.gain) + self.values
        numbers += 2 * len(self.samples) + 3 * len(self.applied)
        words = 4 + self.qualities + len(self.samples)
        flags = len(self.samples) + sum(self.flag_lengths)
        return numbers, 2 + len(self.samples), words, flags

    @cached_property
    def row(self) -> struct.Struct:
        """The row as bytes."""
        numbers, times, words, flags = self.counts
        return struct.Struct(f"<{numbers}d{times}q{words}I{flags}B")

    @cached_property
    def series(self) -> tuple[SeriesColumn, ...]:
        """The numbers that have a name, each name once."""
        taken: dict[str, SeriesColumn] = {}
        for place, named in enumerate(_named(self)):
            if named is not None:
                name, unit, good = named
                while name in taken:
                    name += "'"
                taken[name] = SeriesColumn(name, unit, place, good)
        return tuple(taken.values())

    def as_text(self) -> str:
        """Return the layout as JSON."""
        return json.dumps(asdict(self), separators=(",", ":"))

    @staticmethod
    def from_text(text: str) -> "Layout":
        """Return the layout that JSON describes."""
        try:
            table = cast("dict[str, object]", json.loads(text))
            fields = cast("dict[str, Any]", {name: _tuples(v) for name, v in table.items()})
            return Layout(**fields)
        except (ValueError, TypeError) as error:
            raise DataError("layout_damaged") from error


def _tuples(value: object) -> object:
    return tuple(map(_tuples, cast("list[object]", value))) if isinstance(value, list) else value


def _name(names: Sequence[str], index: int) -> str:
    return names[index] if index < len(names) else str(index + 1)


def _named(layout: Layout) -> Iterator[tuple[str, str, int | None] | None]:
    """Yield name, unit and flag of each number of a row, in their order; None for the nameless."""
    yield from (None, ("lateness_s", "s", None), ("diameter_mm", "mm", None))  # OF_RECORD
    yield from (None for _ in layout.scalars)
    for field, length in zip(layout.by_output, layout.lengths, strict=True):
        quantity = field.removesuffix("_um")
        unit = "1" if quantity == field else "um"
        for o in range(length):
            yield f"{_name(layout.outputs, o)}.{quantity}", unit, None
    for quantity, unit, counts in (("part", "um", layout.contribution), ("gain", "1", layout.gain)):
        for o, count in enumerate(counts):
            parts = layout.parts[o] if o < len(layout.parts) else ()
            for k in range(count):
                yield f"{_name(layout.outputs, o)}.{quantity}.{_name(parts, k)}", unit, None
    yield from (None for _ in range(layout.values))
    yield from ((name, "", k) for k, name in enumerate(layout.samples))
    yield from (None for _ in layout.samples)  # their ages
    for quantity in ("requested", "accepted", "effective"):
        yield from ((f"{name}.{quantity}", "um", None) for name in layout.applied)
