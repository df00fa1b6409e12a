"""The columns of a cycle: one for each value, with names that say what it is and its unit.

The names are those of the tables, of the Parquet files and of exports. Numbers and texts of a cycle
are gathered by the loop's thread; what a database is given of them is made by the writer's.
"""

from array import array
from collections.abc import Iterator
from itertools import chain
from typing import Final, Literal, NamedTuple, final

from thermaxis.compensation import SupervisorState
from thermaxis.runtime._backlog import from_us, to_us
from thermaxis.runtime._ports import Applied, CycleRecord

ID: Final = "id"
"""Number of a cycle in the order of recording, whatever a clock did."""
TIME: Final = "time_utc"
"""Time of day of a cycle, to the microsecond."""
ACTIVE: Final = "active"
"""Whether the compensation is active: its mean is the share of the time."""
LONGEST_TEXT: Final = 4000
"""Longest text that is kept. [character]"""
LONGEST_NAME: Final = 63
"""Longest name of a column that PostgreSQL takes. [byte]"""
UNPACKABLE = (TypeError, ValueError, OverflowError, AttributeError, KeyError)
"""What `Columns.row_of` raises for a record that is not what its fields promise."""

Kind = Literal["number", "whole", "flag", "text"]
_LARGEST = 1e15
_NOTHING = float("nan")
_UNKNOWN = Applied(None, None)
_UNIT_ENDS = ("_um", "_mm", "_C", "_K")
_CODES = (
    *("answers", "state", "quality", "reasons", "outcomes"),
    *("source_reason", "sink_reason"),
)
_NM_UM, _US_S, _MS_S = 3, 6, 3  # digits: a nanometre, a microsecond, a millisecond


def storable(text: str, limit: int) -> str:
    """Return a text that every database takes."""
    text = text[:limit]
    if text.isascii() and "\0" not in text:
        return text
    if "\0" in text:
        text = text.replace("\0", "\\x00")
    return text.encode("utf-8", "backslashreplace").decode("utf-8")[:limit]


class Column(NamedTuple):
    """A column."""

    name: str
    """Its name, with the unit at its end."""
    kind: Kind
    digits: int | None = None
    """Digits behind the point that are kept; None for all. [1]"""


class Layout(NamedTuple):
    """The columns of the cycles of one model: numbers first, then texts."""

    numbers: tuple[Column, ...]
    """Columns whose values wait as float64."""
    texts: tuple[Column, ...]
    """Columns of text: codes, and what a server calls a status."""

    @property
    def columns(self) -> tuple[Column, ...]:
        """All of them."""
        return self.numbers + self.texts


class Row(NamedTuple):
    """A cycle that waits to be stored."""

    layout: Layout
    utc_us: int
    """Time of day. [µs]"""
    numbers: bytes
    """Numbers as float64; NaN where there is none."""
    texts: tuple[str | None, ...]
    is_row = True

    @property
    def size(self) -> int:
        """Memory that it takes; texts are shared by most rows. [byte]"""
        return len(self.numbers) + 8 * len(self.texts) + len(self.texts[0] or "")

    def values(self) -> dict[str, object]:
        """Return what is stored, by column: rounded, and None for what is not there."""
        stored: dict[str, object] = {TIME: from_us(self.utc_us)}
        for (name, kind, digits), value in zip(
            self.layout.numbers, array("d", self.numbers), strict=True
        ):
            if not -_LARGEST <= value <= _LARGEST:  # NaN is not between them
                stored[name] = None
            elif kind == "number":
                stored[name] = value if digits is None else round(value, digits)
            else:
                stored[name] = int(value) if kind == "whole" else value != 0.0
        for (name, *_), text in zip(self.layout.texts, self.texts, strict=True):
            stored[name] = None if text is None else storable(text, LONGEST_TEXT)
        return stored


class PackedEvent(NamedTuple):
    """An event as it is stored."""

    utc_us: int
    """Time of day. [µs]"""
    kind: str
    who: str
    code: str
    """Key of its sentence; empty where it has none."""
    text: str
    details: str
    """JSON."""
    is_row = False

    @property
    def size(self) -> int:
        """Memory that its texts take. [byte]"""
        return sum(map(len, self[1:]))


Item = Row | PackedEvent
"""What waits to be stored."""


def output_column(output: str, quantity: str) -> str:
    """Return the column of an output's quantity: ``Z_correction_um`` of ``Z_um``, correction."""
    stem, end = _stem_of(output)
    return f"{stem}_{quantity}{end}"


def input_column(name: str) -> str:
    """Return the column of a sample: ``T_spindle_redundant_C`` of ``T_spindle_C.redundant``."""
    base, _, which = name.partition(".")
    return output_column(base, which).replace(".", "_") if which else base


def _stem_of(name: str) -> tuple[str, str]:
    """Cut the unit from the end of a name."""
    end = next((end for end in _UNIT_ENDS if name.endswith(end)), "")
    return name.removesuffix(end), end


@final
class Columns:
    """Makes rows of records. One thread uses it."""

    def __init__(self) -> None:
        self.outputs: tuple[str, ...] = ()
        """Names of the outputs; to be set before the first record."""
        self._layouts: dict[tuple[object, ...], Layout] = {}

    def row_of(self, record: CycleRecord) -> Row:
        """Return a record as a row; values whose status was not good are missing."""
        output, samples = record.output, record.samples.values()
        vectors = (
            output.correction_um,
            output.wanted_um,
            output.model_um,
            output.trim_um,
            output.weight,
            output.at_limit,
            output.offset_um,
            output.offset_std_um,
        )
        applied = [record.applied.get(name, _UNKNOWN) for name in self.outputs]
        numbers: list[float | None] = [
            record.number,
            output.state is SupervisorState.ACTIVE,
            record.lateness_s,
            record.monotonic_s,
            record.diameter_mm,
            *[s.value if s.good else None for s in samples],
            *[s.age_s for s in samples],
            *output.values,
            *chain.from_iterable(vectors),
            *chain.from_iterable(applied),
            *chain.from_iterable(output.contribution_um),
        ]
        texts = (
            _answers(record),
            output.state.value,
            output.quality.value,
            " ".join(output.reasons) or None,
            " ".join(output.outcomes) or None,
            record.source_reason or None,
            record.sink_reason or None,
            *[s.status for s in samples],
            *[quality.value for quality in output.qualities[: len(output.values)]],
            *[record.touched.get(name) for name in self.outputs if output.offset_um],
        )
        lengths = (*map(len, vectors), *map(len, output.contribution_um), len(output.values))
        key = (*record.samples, *lengths, record.parts, self.outputs, record.channels)
        layout = self._layouts.get(key)
        if layout is None:
            layout = self._layouts[key] = self._layout(record)
        if (len(numbers), len(texts)) != (len(layout.numbers), len(layout.texts)):
            raise ValueError("a record that does not fit the names of outputs and channels")
        packed = array("d", [_NOTHING if value is None else value for value in numbers])
        return Row(layout, to_us(record.utc), packed.tobytes(), texts)

    def _layout(self, record: CycleRecord) -> Layout:
        taken: dict[str, str] = {ID: "", TIME: ""}
        numbers = tuple(_named(self._numbers(record), taken))
        texts = tuple(_named(self._texts(record), taken))
        return Layout(numbers, texts)

    def _numbers(self, record: CycleRecord) -> Iterator[Column]:
        yield Column("number", "whole")
        yield Column(ACTIVE, "flag")
        yield Column("lateness_s", "number", _US_S)
        yield Column("monotonic_s", "number", _US_S)
        yield Column("diameter_mm", "number")
        inputs = [input_column(name) for name in record.samples]
        yield from (Column(name, "number") for name in inputs)
        yield from (Column(f"{_stem_of(name)[0]}_age_s", "number", _MS_S) for name in inputs)
        yield from (Column(output_column(name, "used"), "number") for name in record.channels)
        for quantity in ("correction", "wanted", "model", "trim"):
            yield from self._by_output(quantity)
        weights = [_stem_of(name)[0] for name in self.outputs]
        yield from (Column(f"{name}_weight", "number", 6) for name in weights)
        yield from (Column(f"{name}_at_limit", "flag") for name in weights)
        if record.output.offset_um:
            yield from self._by_output("offset")
            yield from self._by_output("offset_std")
        for name in self.outputs:
            for quantity in ("commanded", "accepted", "effective"):
                yield Column(output_column(name, quantity), "number", _NM_UM)
        for name, parts in zip(self.outputs, record.parts, strict=True):
            for part in parts:
                yield Column(output_column(name, f"part_{part}"), "number", _NM_UM)

    def _by_output(self, quantity: str) -> Iterator[Column]:
        for name in self.outputs:
            yield Column(output_column(name, quantity), "number", _NM_UM)

    def _texts(self, record: CycleRecord) -> Iterator[Column]:
        yield from (Column(name, "text") for name in _CODES)
        yield from (Column(f"{input_column(name)}_status", "text") for name in record.samples)
        yield from (Column(f"{name}_quality", "text") for name in record.channels)
        if record.output.offset_um:
            yield from (Column(f"{_stem_of(name)[0]}_touch", "text") for name in self.outputs)


def _named(columns: Iterator[Column], taken: dict[str, str]) -> Iterator[Column]:
    """Give every column a name of its own that both databases take; SQLite ignores case."""
    for column in columns:
        plain = storable(column.name, LONGEST_NAME)
        name, number = _cut(plain, LONGEST_NAME), 1
        while name.casefold() in taken:
            number += 1
            name = f"{_cut(plain, LONGEST_NAME - 4)}_{number}"
        taken[name.casefold()] = name
        yield column._replace(name=name)


def _cut(name: str, limit: int) -> str:
    return name.encode()[:limit].decode("utf-8", "ignore")


def _answers(record: CycleRecord) -> str | None:
    """Return the answers to requests as text: kind of request and code of the answer."""
    answers = record.output.answers
    return " ".join(f"{a.request.kind.value}:{a.code.value}" for a in answers) or None
