"""Cycles as rows of bytes: what is stored of every cycle, exactly.

A row has the numbers of a cycle as float64, its times as int64, its words as numbers of a list
and its flags as bytes, all little-endian, in the order of its `Layout`. Layouts and words are
numbered within one *run* of the historian, so that a row can be made before any database is there.
A block is many rows of one layout, deflated: the first byte of every row, then the second byte of
every row, and so on, which takes a sixth of the rows' size and a quarter less than row by row.

None and NaN are two values: None is a NaN with bits of its own.
"""

import json
import struct
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import UTC, datetime, timedelta
from itertools import chain, starmap
from operator import attrgetter
from typing import Any, Final, Generic, NamedTuple, TypeVar, cast, final

from thermaxis.codes import values_as_json, values_of_json
from thermaxis.compensation import (
    Answer,
    AnswerCode,
    CycleOutput,
    Outcome,
    Quality,
    Reason,
    Request,
    RequestKind,
    SampleQuality,
    SupervisorState,
)
from thermaxis.errors import DataError, ThermaxisError
from thermaxis.messages import sentence_of
from thermaxis.runtime._ports import Applied, CycleRecord, SourceSample
from thermaxis.runtime.historian._layout import BY_OUTPUT, FLAGS, OF_RECORD, SCALARS, Layout

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
"""Times are stored as microseconds since then."""
MOST_WORDS = 20_000
"""Words that one run keeps; what a source invents beyond them is called `FURTHER_WORD`. [1]"""
FURTHER_WORD = "(one of too many words)"
"""What a status is called that came after all places for words were taken."""
LONGEST_WORD = 400
"""Longest word that is kept; a longer one is cut. [character]"""
MOST_LAYOUTS = 1000
"""Layouts that one run keeps: a change of the model makes one. [1]"""
UNPACKABLE = (struct.error, TypeError, ValueError, OverflowError, AttributeError)
"""What `RowPacker.pack` raises for a record that is not what its fields promise."""

NONE_BITS = 0x7FF8_6E6F_6E65_0000
"""Bits of the float64 that stands for None."""
NO_TIME = -(2**63)
"""What stands for a time that is not there. [µs]"""
_NONE: float = struct.unpack("<d", struct.pack("<Q", NONE_BITS))[0]
_NONE_BYTES = struct.pack("<Q", NONE_BITS)
_MICROSECOND = timedelta(microseconds=1)
_SEPARATOR = "|"
_BY_KIND: Final[tuple[tuple[type[BaseException], str], ...]] = (
    (TimeoutError, "it took too long"),
    (ConnectionResetError, "the connection was cut by the other side"),
    (ConnectionRefusedError, "the connection was refused"),
    (ConnectionAbortedError, "the connection was given up"),
    (BrokenPipeError, "the other side has closed the connection"),
    (ConnectionError, "the connection failed"),
    (FileNotFoundError, "a file or folder is not there"),
    (PermissionError, "it is not permitted"),
    (InterruptedError, "it was interrupted"),
    (MemoryError, "there is not enough memory"),
    (RecursionError, "it is nested too deeply"),
    (EOFError, "it ends too early"),
    (OverflowError, "a number is too large"),
)
"""What is said of an error that says nothing itself; the first kind that fits."""
_LONGEST_CAUSE: Final = 300
_LEVEL = 6
_scalars_of = cast("Callable[[CycleOutput], tuple[float, ...]]", attrgetter(*SCALARS))
_vectors_of = cast("Callable[[CycleOutput], tuple[Sequence[float], ...]]", attrgetter(*BY_OUTPUT))


def to_us(moment: datetime) -> int:
    """Return an aware time as microseconds since 1970."""
    return (moment - EPOCH) // _MICROSECOND


def from_us(time_us: int) -> datetime:
    """Return microseconds since 1970 as an aware time in UTC."""
    return EPOCH + timedelta(microseconds=time_us)


def storable(text: str, limit: int) -> str:
    """Return a text that every database takes."""
    text = text[:limit]
    if "\0" in text:
        text = text.replace("\0", "\\x00")
    return text.encode("utf-8", "backslashreplace").decode("utf-8")[:limit]


class PackedCycle(NamedTuple):
    """A cycle as it is stored."""

    layout: int
    """Number of its layout. [1]"""
    utc_us: int
    """Time of day. [µs]"""
    row: bytes
    """The row."""
    text: str | None
    """Answers to requests as JSON; None where there are none."""


@final
class RowPacker:
    """Makes rows of records, and keeps the words and layouts of one run.

    One thread packs; others may read `words` and `layouts`, which are only ever appended to.

    """

    def __init__(self) -> None:
        self.outputs: tuple[str, ...] = ()
        """Names of the outputs; to be set before the first record."""
        self.channels: tuple[str, ...] = ()
        """Names of the model's channels, likewise."""
        self.words: list[str] = [FURTHER_WORD]
        """Words by their number."""
        self.layouts: list[Layout] = []
        """Layouts by their number."""
        self._word_codes: dict[str, int] = {}
        self._layout_codes: dict[tuple[object, ...], tuple[int, struct.Struct]] = {}

    def pack(self, record: CycleRecord) -> PackedCycle:
        """Return a record as a row."""
        output = record.output
        samples = record.samples.values()
        applied = record.applied.values()
        vectors = _vectors_of(output)
        flags = tuple([getattr(output, name) for name in FLAGS])
        code, row = self._layout_of(record, vectors, flags)
        word = self._word
        utc_us = (record.utc - EPOCH) // _MICROSECOND
        numbers: list[float | None] = [
            record.monotonic_s,
            record.lateness_s,
            record.diameter_mm,
            *_scalars_of(output),
            *chain.from_iterable(vectors),
            *chain.from_iterable(output.contribution_um),
            *chain.from_iterable(record.gain),
            *output.values,
            *[s.value for s in samples],
            *[s.age_s for s in samples],
            *[a.requested_um for a in applied],
            *[a.accepted_um for a in applied],
            *[a.effective_um for a in applied],
        ]
        times = [
            NO_TIME if s.source_time is None else (s.source_time - EPOCH) // _MICROSECOND
            for s in samples
        ]
        packed = row.pack(
            *[_NONE if v is None else v for v in numbers],
            record.number,
            utc_us,
            *times,
            word(output.state.value),
            word(output.quality.value),
            word(_SEPARATOR.join(output.reasons)),
            word(_SEPARATOR.join(output.outcomes)),
            *[word(q.value) for q in output.qualities],
            *[word(s.status) for s in samples],
            *[bool(s.good) for s in samples],
            *map(bool, chain.from_iterable(flags)),
        )
        text = answers_as_text(output.answers) if output.answers else None
        return PackedCycle(code, utc_us, packed, text)

    def _word(self, text: str) -> int:
        code = self._word_codes.get(text)
        if code is not None:
            return code
        if len(self.words) >= MOST_WORDS:
            return 0
        self.words.append(storable(text, LONGEST_WORD))
        code = len(self.words) - 1
        if len(text) <= LONGEST_WORD:
            self._word_codes[text] = code
        return code

    def _layout_of(
        self,
        record: CycleRecord,
        vectors: tuple[Sequence[float], ...],
        flags: tuple[Sequence[bool], ...],
    ) -> tuple[int, struct.Struct]:
        output = record.output
        sizes = (
            tuple(map(len, vectors)),
            tuple(map(len, output.contribution_um)),
            tuple(map(len, record.gain)),
            len(output.values),
            len(output.qualities),
            tuple(map(len, flags)),
        )
        key = (*record.samples, None, *record.applied, record.parts, sizes)
        known = self._layout_codes.get(key)
        if known is None:
            if len(self.layouts) >= MOST_LAYOUTS:
                raise ValueError("too many layouts")
            names = (tuple(record.samples), tuple(record.applied), self.outputs, self.channels)
            layout = Layout(*names, record.parts, *sizes)
            self.layouts.append(layout)
            known = (len(self.layouts) - 1, layout.row)
            self._layout_codes[key] = known
        return known


# ---- back ---------------------------------------------------------------------------------------


def record_of(
    layout: Layout, words: Mapping[int, str], row: bytes, text: str | None
) -> CycleRecord:
    """Return the record that a row was made of."""
    try:
        return _record_of(layout, words, row, text)
    except (struct.error, KeyError, ValueError, OverflowError) as error:
        raise DataError("stored_cycle_unreadable", cause=printable_cause(error)) from error


def printable_cause(error: BaseException) -> str:
    """Return why something failed, for a message that people read.

    Parameters
    ----------
    error : BaseException
        The error.

    Returns
    -------
    str
        The first line of what the error says, without the name of its kind, which says nothing to
        people, and without the file that it names, which is nobody's business who only looks. An
        error without a text is told by its kind: in words where there are some, else by its name.
    """
    if isinstance(error, KeyError) and error.args:  # it says no more than the key
        text = f"{error.args[0]!r} is missing"
    elif isinstance(error, OSError) and error.strerror:
        text = str(error.strerror)
    elif isinstance(error, ThermaxisError):
        text = sentence_of(error.message).rstrip(".")
    else:
        text = str(error)
    first = text.strip().partition("\n")[0][:_LONGEST_CAUSE]
    if first:
        return first
    words = next((words for kind, words in _BY_KIND if isinstance(error, kind)), "")
    return words or f"{type(error).__name__} without a text"


def _record_of(
    layout: Layout, words: Mapping[int, str], row: bytes, text: str | None
) -> CycleRecord:
    found = layout.row.unpack(row)
    numbers_end, times, codes, _ = layout.counts
    words_end = numbers_end + times + codes
    numbers = _Taker(_with_none(found[:numbers_end], row))
    ints = cast("tuple[int, ...]", found[numbers_end : numbers_end + times])
    named = _Taker([words[code] for code in found[numbers_end + times : words_end]])
    flags = _Taker([bool(flag) for flag in found[words_end:]])
    monotonic_s, lateness_s, diameter_mm = numbers(len(OF_RECORD))
    state, quality, reasons, outcomes = named(4)
    fields: dict[str, object] = dict(zip(layout.scalars, numbers(len(layout.scalars)), strict=True))
    for name, length in zip(layout.by_output, layout.lengths, strict=True):
        fields[name] = numbers(length)
    fields |= {
        "state": SupervisorState(state),
        "quality": Quality(quality),
        "reasons": tuple(Reason(name) for name in _split(reasons)),
        "outcomes": tuple(Outcome(name) for name in _split(outcomes)),
        "contribution_um": tuple(numbers(count) for count in layout.contribution),
        "answers": () if text is None else answers_of_text(text),
    }
    gain = tuple(cast("tuple[float, ...]", numbers(count)) for count in layout.gain)
    fields["values"] = numbers(layout.values)
    fields["qualities"] = tuple(SampleQuality(name) for name in named(layout.qualities))
    samples = _samples_of(layout, numbers, named, flags, ints[2:])
    for name, length in zip(layout.flags, layout.flag_lengths, strict=True):
        fields[name] = flags(length)
    said = [numbers(len(layout.applied)) for _ in range(3)]
    return CycleRecord(
        number=ints[0],
        utc=from_us(ints[1]),
        monotonic_s=cast("float", monotonic_s),
        samples=samples,
        output=CycleOutput(**cast("dict[str, Any]", fields)),
        applied={
            name: Applied(*numbers) for name, *numbers in zip(layout.applied, *said, strict=True)
        },
        lateness_s=cast("float", lateness_s),
        parts=layout.parts,
        gain=gain,
        diameter_mm=diameter_mm,
    )


def _samples_of(
    layout: Layout,
    numbers: "_Taker[float | None]",
    named: "_Taker[str]",
    flags: "_Taker[bool]",
    times_us: Sequence[int],
) -> dict[str, SourceSample]:
    count = len(layout.samples)
    value, age_s = numbers(count), numbers(count)
    times = [None if us == NO_TIME else from_us(us) for us in times_us]
    columns = zip(value, flags(count), named(count), age_s, times, strict=True)
    return dict(zip(layout.samples, starmap(SourceSample, columns), strict=True))


_T = TypeVar("_T")


class _Taker(Generic[_T]):
    """Gives things away, one piece after the other."""

    def __init__(self, things: Sequence[_T]) -> None:
        self._things = tuple(things)
        self._next = 0

    def __call__(self, count: int) -> tuple[_T, ...]:
        first = self._next
        self._next += count
        return self._things[first : self._next]


def _with_none(numbers: tuple[float, ...], row: bytes) -> Sequence[float | None]:
    """Put None where its bits stand; they are compared as bytes because NaN equals nothing."""
    if _NONE_BYTES not in row:
        return numbers
    return [
        None if v != v and row[8 * k : 8 * k + 8] == _NONE_BYTES else v  # noqa: PLR0124 - NaN
        for k, v in enumerate(numbers)
    ]


def _split(text: str) -> list[str]:
    return text.split(_SEPARATOR) if text else []


def answers_as_text(answers: Sequence[Answer]) -> str:
    """Return answers as JSON."""
    return json.dumps(
        [
            {
                "kind": a.request.kind.value,
                "who": a.request.who,
                "output": a.request.output,
                "value": a.request.value,
                "duration_s": a.request.duration_s,
                "text": a.request.text,
                "identity": a.request.identity,
                "accepted": a.accepted,
                "code": a.code.value,
                "values": values_as_json(a.values),
            }
            for a in answers
        ]
    )


def answers_of_text(text: str) -> tuple[Answer, ...]:
    """Return the answers that `answers_as_text` wrote."""
    found: list[Answer] = []
    for entry in json.loads(text):
        accepted, code = entry.pop("accepted"), AnswerCode(entry.pop("code"))
        values = cast("dict[str, float | str]", values_of_json(entry.pop("values")))
        kind = RequestKind(entry.pop("kind"))
        found.append(Answer(Request(kind=kind, **entry), accepted, code, values))
    return tuple(found)


def pack_block(rows: Sequence[bytes]) -> bytes:
    """Return rows of one layout as a block."""
    size, data = len(rows[0]), b"".join(rows)
    return zlib.compress(b"".join([data[k::size] for k in range(size)]), _LEVEL)


def unpack_block(block: bytes, layout: Layout, count: int) -> bytes:
    """Return the rows of a block, one behind the other."""
    size = layout.row.size * count
    inflater = zlib.decompressobj()
    try:
        data = inflater.decompress(block, size + 1)  # one more, so that the check sum is reached
    except zlib.error:
        data = b""
    if not inflater.eof or len(data) != size:
        raise DataError("block_damaged")
    import numpy as np  # noqa: PLC0415 - the loop writes only, and has no other use for it

    planes = np.frombuffer(data, dtype=np.uint8).reshape(layout.row.size, count)
    return planes.T.tobytes()


def rows_of(layout: Layout, data: bytes) -> Iterator[bytes]:
    """Cut the bytes of many rows into rows."""
    size = layout.row.size
    for first in range(0, len(data), size):
        yield data[first : first + size]
