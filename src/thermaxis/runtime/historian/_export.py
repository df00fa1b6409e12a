"""A span of a history as a thermal log: Parquet or CSV, row by row as it was recorded."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from fnmatch import fnmatchcase
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Place, printable
from thermaxis.errors import DataError
from thermaxis.files.table import protected
from thermaxis.runtime.historian._layout import Layout, SeriesColumn
from thermaxis.runtime.historian._reading import HistoryReader, Piece, values_of
from thermaxis.runtime.historian._rows import to_us
from thermaxis.runtime.historian._trend import ACTIVE

if TYPE_CHECKING:
    import polars as pl

TIME: Final = "time"
"""Heading of the times."""
STATE: Final = "state"
"""Heading of the state of the compensation."""
REASONS: Final = "reasons"
"""Heading of why it was not active."""

_PIECES_AT_ONCE = 64
_UNIT_ENDS = ("_um", "_mm", "_C", "_K")
_LEFT_OUT = frozenset({"before", "rate"})
Report = Callable[[str, int, int], None]


@final
@dataclass(frozen=True, slots=True)
class Export:
    """What was written."""

    rows: int
    """Cycles. [1]"""
    columns: tuple[str, ...]
    """Headings, without that of the times."""


class _Column(NamedTuple):
    """A column of the file."""

    heading: str
    series: str  # name of the series; empty for words
    words: str = ""  # what words it holds: state, reasons, or the name of a sample


def heading_of(column: SeriesColumn, outputs: Sequence[str]) -> str:
    """Return the heading of a series, as the readers of thermal logs know headings."""
    output = next((name for name in outputs if column.name.startswith(f"{name}.")), None)
    if output is None or column.good is not None:
        base, dot, which = column.name.partition(".")  # T_spindle_C.redundant
        stem, end = _stem_of(base)
        return f"{stem}_{which}{end}" if dot and end else column.name
    quantity = column.name[len(output) + 1 :].replace(".", "_")
    unit = "" if column.unit == "1" else f"_{column.unit}"
    return f"{_stem_of(output)[0]}_{quantity}{unit}"


def _stem_of(name: str) -> tuple[str, str]:
    """Cut the unit from the end of a name."""
    end = next((end for end in _UNIT_ENDS if name.endswith(end)), "")
    return name.removesuffix(end), end


def export_history(
    reader: HistoryReader,
    path: Path,
    *,
    first: datetime | None = None,
    last: datetime | None = None,
    patterns: Sequence[str] = (),
    everything: bool = False,
    report: Report = lambda _step, _done, _total: None,
) -> Export:
    """Write a span of a history as a thermal log.

    Times are UTC. Values whose status was not good are missing. Memory does not grow with the
    span.

    Parameters
    ----------
    reader : HistoryReader
        The history.
    path : Path
        The file, ``.parquet`` or ``.csv``; it is replaced when everything has been written.
    first : datetime, optional
        Begin of the span. Default: that of the history.
    last : datetime, optional
        End, not included. Default: that of the history.
    patterns : sequence of str
        Headings that are wanted, with ``*`` and ``?``; empty for all.
    everything : bool
        Whether values of bad status, the status, state and reasons are written as well. Default:
        no.
    report : callable
        Is told step, blocks read and their number.

    Returns
    -------
    Export
        Rows and headings.

    Raises
    ------
    DataError
        If the history cannot be read, or has nothing in the span or of the patterns.
    OSError
        If the file cannot be written.
    """
    import polars as pl  # noqa: PLC0415 - takes a tenth of a second
    from polars.io.plugins import register_io_source  # noqa: PLC0415 - see above

    layouts = reader.layouts(first, last)
    if not layouts:
        raise _no_cycle(reader)
    columns = _columns_of(layouts, patterns, everything=everything)
    if not columns:
        raise DataError(
            "no_matching_column",
            known=tuple(c.heading for c in _columns_of(layouts, ())),
            place=Place(reader.where),
        )
    as_text = path.suffix.casefold() == ".csv"
    frames = _Frames(reader, (first, last), columns, report, as_text=as_text, bad_too=everything)
    source = register_io_source(frames.read, schema=frames.schema())
    part = path.with_name(path.name + ".part")
    try:
        if as_text:
            source.sink_csv(part, datetime_format="%Y-%m-%dT%H:%M:%S%.6fZ")
        else:
            source.sink_parquet(part)
        part.replace(path)
    except pl.exceptions.PolarsError as error:
        if frames.failure is not None:
            raise frames.failure from error
        raise OSError(f"{path}: {str(error).partition(chr(10))[0][:200]}") from error
    finally:
        part.unlink(missing_ok=True)
    return Export(frames.rows, tuple(column.heading for column in columns))


def _no_cycle(reader: HistoryReader) -> DataError:
    found = reader.span()
    if found is None:
        return DataError("history_empty", place=Place(reader.where))
    first, last = (moment.isoformat() for moment in found)
    return DataError("no_cycle_in_span", first=first, last=last, place=Place(reader.where))


def _columns_of(
    layouts: Sequence[Layout], patterns: Sequence[str], *, everything: bool = False
) -> list[_Column]:
    """Return the columns of all layouts, each once: inputs, corrections, their parts."""
    found: dict[str, _Column] = {}

    def add(heading: str, series: str, words: str = "") -> None:
        while heading == TIME or found.get(heading, _Column(heading, series, words))[1:] != (
            series,
            words,
        ):
            heading += "'"
        found[heading] = _Column(heading, series, words)

    for layout in layouts:
        for column in sorted(layout.series, key=lambda c: c.good is None):  # channels first
            if everything or column.name.rpartition(".")[2] not in _LEFT_OUT:
                add(heading_of(column, layout.outputs), column.name)
        add(ACTIVE.name, ACTIVE.name)
        if everything:
            for sample in layout.samples:
                add(f"{sample} status", "", f"sample {sample}")
            add(STATE, "", STATE)
            add(REASONS, "", REASONS)
    if not patterns:
        return list(found.values())
    return [c for c in found.values() if any(fnmatchcase(c.heading, p) for p in patterns)]


class _Frames:
    """Gives polars a history frame by frame."""

    def __init__(
        self,
        reader: HistoryReader,
        span: tuple[datetime | None, datetime | None],
        columns: Sequence[_Column],
        report: Report,
        *,
        as_text: bool,
        bad_too: bool,
    ) -> None:
        self._reader = reader
        self._span = span
        self._bad_too = bad_too
        self._columns = columns
        self._as_text = as_text
        self._report = report
        self.rows = 0
        self.failure: DataError | None = None

    def _heading(self, column: _Column) -> str:
        return protected(column.heading) if self._as_text else column.heading

    def schema(self) -> "pl.Schema":
        import polars as pl  # noqa: PLC0415 - see above

        kinds = {self._heading(c): pl.Float64() if c.series else pl.String() for c in self._columns}
        return pl.Schema({TIME: pl.Datetime("us", "UTC"), **kinds})

    def read(
        self,
        with_columns: list[str] | None,
        predicate: "pl.Expr | None",
        n_rows: int | None,
        batch_size: int | None,
    ) -> "Iterator[pl.DataFrame]":
        """Give frames; polars asks for columns and rows only where a query does, ours never."""
        del predicate, n_rows, batch_size
        try:
            for frame in self._frames():
                self.rows += frame.height
                yield frame if with_columns is None else frame.select(with_columns)
        except DataError as error:
            self.failure = error
            raise

    def _frames(self) -> "Iterator[pl.DataFrame]":
        pieces = self._reader.pieces(*self._span)
        done = 0
        while some := list(islice(pieces, _PIECES_AT_ONCE)):
            for joined in _joined(some):
                yield self._frame(joined)
            done += len(some)
            self._report("exporting", done, 0)

    def _frame(self, piece: Piece) -> "pl.DataFrame":
        import polars as pl  # noqa: PLC0415 - see above

        first, last = self._span
        rows = piece.array()
        time_us = rows["times"][:, 1]
        inside = np.ones(time_us.shape, dtype=np.bool_)
        if first is not None:
            inside &= time_us >= to_us(first)
        if last is not None:
            inside &= time_us < to_us(last)
        rows = rows[inside]
        times = pl.Series(TIME, np.ascontiguousarray(rows["times"][:, 1]))
        found = [times.cast(pl.Datetime("us")).dt.replace_time_zone("UTC")]
        for column in self._columns:
            heading = self._heading(column)
            if column.series:
                values = values_of(piece, rows, column.series, bad_too=self._bad_too)
                if values is None:
                    values = np.full(len(rows), np.nan)
                found.append(pl.Series(heading, np.ascontiguousarray(values), nan_to_null=True))
            else:
                texts = self._texts(piece, rows, column.words)
                found.append(pl.Series(heading, texts, dtype=pl.String()))
        return pl.DataFrame(found)

    def _texts(self, piece: Piece, rows: NDArray[np.void], words: str) -> list[str | None]:
        layout = piece.layout
        places = {STATE: 0, REASONS: 2}
        if words in places:
            place = places[words]
        else:
            name = words.removeprefix("sample ")
            if name not in layout.samples:
                return [None] * len(rows)
            place = 4 + layout.qualities + layout.samples.index(name)
        codes: list[int] = rows["words"][:, place].tolist()
        texts = [printable(piece.words[code], 400) for code in codes]
        return [protected(text) for text in texts] if self._as_text else list(texts)


def _joined(pieces: Sequence[Piece]) -> Iterator[Piece]:
    """Join neighbours of one layout and run."""
    together: list[Piece] = []
    for piece in pieces:
        if together and (
            piece.layout is not together[0].layout or piece.words is not together[0].words
        ):
            yield together[0]._replace(data=b"".join([p.data for p in together]))
            together = []
        together.append(piece)
    if together:
        yield together[0]._replace(data=b"".join([p.data for p in together]))
