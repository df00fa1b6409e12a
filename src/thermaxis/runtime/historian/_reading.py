"""Read a history: cycles, events and trends by time, while the loop goes on writing.

Every question is a transaction of its own, so that a reader never keeps the writer from tidying
its log. Cycles come in the order in which they were recorded, whatever a clock did.
"""

import json
import sqlite3
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from difflib import get_close_matches
from itertools import groupby
from typing import Any, NamedTuple, Self, cast, final

import numpy as np
import sqlalchemy as sa
from numpy.typing import NDArray
from sqlalchemy.exc import DBAPIError, SQLAlchemyError

from thermaxis.codes import Place, values_of_json
from thermaxis.compensation import SupervisorState
from thermaxis.errors import DataError
from thermaxis.runtime._ports import CycleRecord, EventRecord
from thermaxis.runtime.historian import _tables as t
from thermaxis.runtime.historian._database import (
    file_identity,
    parse_url,
    reading_engine,
    shown_url,
    sqlite_path,
)
from thermaxis.runtime.historian._layout import Layout
from thermaxis.runtime.historian._rows import (
    from_us,
    printable_cause,
    record_of,
    rows_of,
    to_us,
    unpack_block,
)
from thermaxis.runtime.historian._trend import ACTIVE, LARGEST, MINUTE_US, Tally, tally

_BLOCKS_AT_ONCE = 50
_MOST_ROWS_FOR_TREND = 200_000
_EARLIEST_US, _LATEST_US = -(2**62), 2**62


class Piece(NamedTuple):
    """Some cycles of one layout, in their order, as they are stored."""

    layout: Layout
    """Their layout."""
    words: Mapping[int, str]
    """Words of their run by number."""
    data: bytes
    """Their rows, one behind the other."""
    texts: Mapping[int, str]
    """Answers, by number of the row from 0."""

    def array(self) -> NDArray[np.void]:
        """Return the rows as an array with the fields numbers, times, words and flags."""
        kinds = zip(
            ("numbers", "times", "words", "flags"), ("<f8", "<i8", "<u4", "u1"), strict=True
        )
        fields = [
            (name, kind, (count,))
            for (name, kind), count in zip(kinds, self.layout.counts, strict=True)
        ]
        return np.frombuffer(self.data, dtype=np.dtype(fields))

    @property
    def active_code(self) -> int | None:
        """Number of the word for the active state."""
        wanted = SupervisorState.ACTIVE.value
        return next((code for code, text in self.words.items() if text == wanted), None)


@final
@dataclass(frozen=True, slots=True)
class Trend:
    """One number over time, in equal steps; steps without a value are left out."""

    name: str
    """Name of the series."""
    unit: str
    """Its unit; empty where its name says it."""
    step_us: int
    """Length of a step. [µs]"""
    time_us: tuple[int, ...]
    """Begin of each step, since 1970. [µs]"""
    lowest: tuple[float, ...]
    """Least value of each."""
    mean: tuple[float, ...]
    """Mean of each."""
    highest: tuple[float, ...]
    """Greatest value of each."""


@final
class HistoryReader:
    """A history, opened for reading. Used by one thread, closed with `close` or ``with``.

    Parameters
    ----------
    url : str
        ``sqlite:///file`` or ``postgresql+psycopg://user@host/database``.
    password : str
        Password of the database's user.

    Raises
    ------
    ConfigurationError
        If the URL is wrong, the file is not there, or the history is of a newer program.
    DataError
        If it cannot be read, or is no history.
    """

    def __init__(self, url: str, password: str = "") -> None:
        parsed = parse_url(url, password)
        self.where = shown_url(parsed)
        """The database, without a password."""
        self._engine = reading_engine(parsed)
        self._path = sqlite_path(parsed)
        self._identity = None if self._path is None else file_identity(self._path)
        self._layouts: dict[tuple[int, int], Layout] = {}
        self._words: dict[int, dict[int, str]] = {}
        self._interrupted = False
        try:
            with self._errors_named():
                self._connection = self._engine.connect()
                self._bare: Any = self._connection.connection.dbapi_connection
            self._check_schema()
        except BaseException:
            self.close()
            raise

    @property
    def in_place(self) -> bool:
        """Whether the file that is read is the one that has the name.

        It is not where the loop has put a damaged file aside: then the history is to be opened
        anew. A server is always in its place.
        """
        return self._path is None or file_identity(self._path) == self._identity

    def _check_schema(self) -> None:
        with self._asked() as connection:
            found = t.stored_schema(connection)
        if found is None:
            raise DataError("no_history", place=Place(self.where))
        t.require_known_schema(found, self.where)

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close it."""
        self.close()

    def interrupt(self) -> None:
        """End the question that is being asked: the only call from another thread.

        The question ends with an error, at once where the database is working at it, else when it
        asks the next time; and so does every later one of this reader. It is not to be closed
        meanwhile.
        """
        self._interrupted = True
        if isinstance(self._bare, sqlite3.Connection):
            self._bare.interrupt()
        else:
            self._bare.cancel()

    def close(self) -> None:
        """End the connection."""
        connection = getattr(self, "_connection", None)
        if connection is not None:
            connection.close()
        self._engine.dispose()

    @contextmanager
    def _errors_named(self) -> Generator[None]:
        try:
            yield
        except (SQLAlchemyError, sqlite3.Error) as error:
            cause = error.orig if isinstance(error, DBAPIError) else error
            raise DataError(
                "history_unreadable", cause=printable_cause(cause or error), place=Place(self.where)
            ) from error

    @contextmanager
    def _asked(self) -> Generator[sa.Connection]:
        if self._interrupted:
            raise DataError("question_interrupted", place=Place(self.where))
        with self._errors_named(), self._connection.begin():
            yield self._connection

    # ---- cycles ---------------------------------------------------------------------------------

    def span(self) -> tuple[datetime, datetime] | None:
        """Return the earliest and the latest time of a cycle, None where there is none."""
        block, cycle = t.block.c, t.cycle.c
        queries = (
            sa.select(sa.func.min(block.utc_min_us), sa.func.max(block.utc_max_us)),
            sa.select(sa.func.min(cycle.utc_us), sa.func.max(cycle.utc_us)),
        )
        with self._asked() as connection:
            found = [connection.execute(query).one() for query in queries]
        times = [time_us for row in found for time_us in row if time_us is not None]
        return (from_us(min(times)), from_us(max(times))) if times else None

    def starts(self) -> int:
        """Return how often a program began to write. [1]"""
        with self._asked() as connection:
            query = sa.select(sa.func.count()).select_from(t.run)
            return int(connection.execute(query).scalar_one())

    def layouts(
        self, first: datetime | None = None, last: datetime | None = None
    ) -> tuple[Layout, ...]:
        """Return the layouts of the cycles in a span, in the order of their first use."""
        first_us, last_us = _span_us(first, last)
        block, cycle = t.block.c, t.cycle.c
        wanted = (
            (t.block, (block.utc_max_us >= first_us) & (block.utc_min_us < last_us)),
            (t.cycle, (cycle.utc_us >= first_us) & (cycle.utc_us < last_us)),
        )
        found: dict[Layout, None] = {}
        for table, inside in wanted:
            kinds = sa.select(table.c.run, table.c.layout).where(inside).distinct()
            with self._asked() as connection:
                rows = connection.execute(kinds).all()
            for kind in sorted((int(row.run), int(row.layout)) for row in rows):
                found.setdefault(self._names_of(*kind)[0])
        return tuple(found)

    def pieces(
        self, first: datetime | None = None, last: datetime | None = None
    ) -> Iterator[Piece]:
        """Return cycles as they are stored; the first and last pieces reach beyond the span."""
        first_us, last_us = _span_us(first, last)
        block, cycle = t.block.c, t.cycle.c
        wanted = (block.utc_max_us >= first_us) & (block.utc_min_us < last_us)
        tail = sa.select(t.cycle).order_by(cycle.id)
        with self._asked() as connection:
            ids = list(connection.execute(sa.select(block.id).where(wanted)).scalars())
            rows = connection.execute(
                tail.where(cycle.utc_us >= first_us, cycle.utc_us < last_us)
            ).all()
        ids.sort()
        for begin in range(0, len(ids), _BLOCKS_AT_ONCE):
            some = ids[begin : begin + _BLOCKS_AT_ONCE]
            query = sa.select(t.block).where(block.id.in_(some)).order_by(block.id)
            with self._asked() as connection:
                blocks = connection.execute(query).all()
            for found in blocks:
                layout, words = self._names_of(found.run, found.layout)
                data = unpack_block(bytes(found.rows), layout, int(found.entries))
                yield Piece(layout, words, data, _texts_of(found.texts))
        for kind, some in groupby(rows, key=lambda row: (int(row.run), int(row.layout))):
            layout, words = self._names_of(*kind)
            same = list(some)
            texts = {k: str(row.text) for k, row in enumerate(same) if row.text is not None}
            yield Piece(layout, words, b"".join([bytes(row.row) for row in same]), texts)

    def cycles(
        self, first: datetime | None = None, last: datetime | None = None
    ) -> Iterator[CycleRecord]:
        """Return cycles exactly as they were recorded.

        Parameters
        ----------
        first : datetime, optional
            Begin of the span. Default: that of the history.
        last : datetime, optional
            End, not included. Default: that of the history.

        Yields
        ------
        CycleRecord
            A cycle, in the order of recording.

        Raises
        ------
        DataError
            If the history cannot be read, or a newer program wrote a word that this one does not
            know.
        """
        first_us, last_us = _span_us(first, last)
        for piece in self.pieces(first, last):
            times = piece.array()["times"][:, 1].tolist()
            for k, row in enumerate(rows_of(piece.layout, piece.data)):
                if first_us <= times[k] < last_us:
                    yield record_of(piece.layout, piece.words, row, piece.texts.get(k))

    def _names_of(self, run: int, code: int) -> tuple[Layout, Mapping[int, str]]:
        """Return layout and words; the running loop may have added some since they were read."""
        layout = self._layouts.get((run, code))
        words = self._words.setdefault(run, {})
        word, stored = t.word.c, t.layout.c
        with self._asked() as connection:
            if layout is None:
                query = sa.select(stored.text).where(stored.run == run, stored.code == code)
                layout = Layout.from_text(connection.execute(query).scalar_one())
                self._layouts[run, code] = layout
            new = sa.select(word.code, word.text).where(word.run == run, word.code >= len(words))
            words.update({int(row.code): str(row.text) for row in connection.execute(new)})
        return layout, words

    # ---- events ---------------------------------------------------------------------------------

    def events(
        self,
        first: datetime | None = None,
        last: datetime | None = None,
        *,
        kinds: Sequence[str] = (),
        newest: int | None = None,
    ) -> list[EventRecord]:
        """Return events in the order of recording.

        Parameters
        ----------
        first : datetime, optional
            Begin of the span. Default: that of the history.
        last : datetime, optional
            End, not included. Default: that of the history.
        kinds : sequence of str
            Kinds that are wanted; empty for all.
        newest : int, optional
            Only so many, the newest. [1]

        Returns
        -------
        list of EventRecord
            The events.

        Raises
        ------
        DataError
            If the history cannot be read.
        """
        first_us, last_us = _span_us(first, last)
        event = t.event.c
        query = sa.select(t.event).where(event.utc_us >= first_us, event.utc_us < last_us)
        if kinds:
            query = query.where(event.kind.in_(list(kinds)))
        with self._asked() as connection:
            found = connection.execute(query.order_by(event.id.desc()).limit(newest)).all()
        return [_event_of(row) for row in reversed(found)]

    # ---- trends ---------------------------------------------------------------------------------

    def series(self) -> Mapping[str, str]:
        """Return the unit of every series by its name; the unit is empty where the name says it."""
        with self._asked() as connection:
            rows = connection.execute(sa.select(t.series).order_by(t.series.c.id)).all()
            codes = connection.execute(sa.select(t.cycle.c.run, t.cycle.c.layout).distinct()).all()
        found: dict[str, str] = {row.name: row.unit for row in rows}
        for run, code in codes:  # what is in no block yet
            layout, _ = self._names_of(run, code)
            for column in layout.series:
                found.setdefault(column.name, column.unit)
            found.setdefault(ACTIVE.name, ACTIVE.unit)
        return found

    def trend(
        self, names: Sequence[str], first: datetime, last: datetime, *, points: int = 1000
    ) -> Mapping[str, Trend]:
        """Return numbers over time, reduced to so many steps.

        Short spans are made from the cycles themselves, long ones from what is kept of every
        minute; every value of a cycle in the span is in exactly one step.

        Parameters
        ----------
        names : sequence of str
            Names of series.
        first : datetime
            Begin of the span, aware. Long spans begin with its minute.
        last : datetime
            End, not included.
        points : int
            Largest number of steps. Default: what a screen is wide. [1]

        Returns
        -------
        mapping
            Trends by name.

        Raises
        ------
        DataError
            If the history cannot be read, there is no such series, or the span is none.
        """
        units = self.series()
        for name in names:
            if name not in units:
                nearest = get_close_matches(name, units, n=1, cutoff=0.3)
                raise DataError(
                    "unknown_name", name=name, known=tuple(nearest), place=Place(self.where)
                )
        first_us, last_us = _span_us(first, last)
        if last_us <= first_us or points < 1:
            raise DataError("trend_without_span", place=Place(self.where))
        step_us = -(-(last_us - first_us) // points)
        if step_us < MINUTE_US and self._rows_between(first_us, last_us) <= _MOST_ROWS_FOR_TREND:
            found = self._from_rows(names, first_us, last_us, step_us)
        else:
            first_us -= first_us % MINUTE_US
            step_us = -(-step_us // MINUTE_US) * MINUTE_US
            found = self._from_minutes(names, first_us, last_us, step_us)
        return {
            name: _trend_of(name, units[name], first_us, step_us, found[name]) for name in names
        }

    def _rows_between(self, first_us: int, last_us: int) -> int:
        block = t.block.c
        query = sa.select(sa.func.sum(block.entries)).where(
            block.utc_max_us >= first_us, block.utc_min_us < last_us
        )
        with self._asked() as connection:
            return int(connection.execute(query).scalar_one() or 0)

    def _from_rows(
        self, names: Sequence[str], first_us: int, last_us: int, step_us: int
    ) -> Mapping[str, Mapping[int, Tally]]:
        found: dict[str, dict[int, Tally]] = {name: {} for name in names}
        for piece in self.pieces(from_us(first_us), from_us(last_us)):
            rows = piece.array()
            time_us = rows["times"][:, 1]
            inside = (time_us >= first_us) & (time_us < last_us)
            step = (time_us - first_us) // step_us
            for name in names:
                values = values_of(piece, rows, name)
                if values is None:
                    continue
                kept = inside & (np.abs(values) <= LARGEST)
                for number in np.unique(step[kept]).tolist():
                    some = values[kept & (step == number)]
                    new = Tally(some.size, float(some.min()), float(some.max()), float(some.sum()))
                    _add(found[name], number, new)
        return found

    def _from_minutes(
        self, names: Sequence[str], first_us: int, last_us: int, step_us: int
    ) -> Mapping[str, Mapping[int, Tally]]:
        trend, series, cycle = t.trend.c, t.series.c, t.cycle.c
        first, end = first_us // MINUTE_US, -(-last_us // MINUTE_US)
        step = ((trend.minute - first) // (step_us // MINUTE_US)).label("step")
        query = (
            sa.select(
                series.name,
                step,
                sa.func.sum(trend.entries),
                sa.func.min(trend.lowest),
                sa.func.max(trend.highest),
                sa.func.sum(trend.total),
            )
            .join_from(t.series, t.trend, series.id == trend.series)
            .where(series.name.in_(list(names)), trend.minute >= first, trend.minute < end)
            .group_by(series.name, step)
            .order_by(series.name, step)
        )
        tail = sa.select(t.cycle).where(
            cycle.utc_us >= first * MINUTE_US, cycle.utc_us < end * MINUTE_US
        )
        with self._asked() as connection:
            stored = connection.execute(query).all()
            rows = connection.execute(tail.order_by(cycle.id)).all()
        found: dict[str, dict[int, Tally]] = {name: {} for name in names}
        for name, number, entries, *rest in stored:
            found[name][int(number)] = Tally(int(entries), *map(float, rest))
        for kind, some in groupby(rows, key=lambda row: (int(row.run), int(row.layout))):
            layout, words = self._names_of(*kind)
            active = Piece(layout, words, b"", {}).active_code
            for (column, minute), new in tally(layout, [r.row for r in some], active).items():
                if column.name in found:
                    _add(found[column.name], (minute * MINUTE_US - first_us) // step_us, new)
        return found


def values_of(
    piece: Piece, rows: NDArray[np.void], name: str, *, bad_too: bool = False
) -> NDArray[np.float64] | None:
    """Return the values of a series in a piece, whose rows are given; None where it has none.

    A value whose status was not good is NaN unless bad ones are wanted too.
    """
    if name == ACTIVE.name:
        code = piece.active_code
        return (rows["words"][:, 0] == (-1 if code is None else code)).astype(np.float64)
    column = next((c for c in piece.layout.series if c.name == name), None)
    if column is None:
        return None
    values: NDArray[np.float64] = rows["numbers"][:, column.place]
    if column.good is None or bad_too:
        return values
    return np.where(rows["flags"][:, column.good] > 0, values, np.nan)


def _add(steps: dict[int, Tally], number: int, new: Tally) -> None:
    steps[number] = steps[number] | new if number in steps else new


def _trend_of(
    name: str, unit: str, first_us: int, step_us: int, steps: Mapping[int, Tally]
) -> Trend:
    numbers = sorted(steps)
    tallies = [steps[number] for number in numbers]
    return Trend(
        name,
        unit,
        step_us,
        tuple(first_us + number * step_us for number in numbers),
        tuple(found.lowest for found in tallies),
        tuple(found.total / found.entries for found in tallies),
        tuple(found.highest for found in tallies),
    )


def _event_of(row: Any) -> EventRecord:
    details = json.loads(row.details)
    code, values = details.pop("code", ""), values_of_json(details.pop("values", None))
    return EventRecord(from_us(row.utc_us), row.kind, row.who, row.text, details, code, values)


def _texts_of(text: str | None) -> dict[int, str]:
    if text is None:
        return {}
    return {int(k): answers for k, answers in cast("dict[str, str]", json.loads(text)).items()}


def _span_us(first: datetime | None, last: datetime | None) -> tuple[int, int]:
    return (
        _EARLIEST_US if first is None else to_us(first),
        _LATEST_US if last is None else to_us(last),
    )
