"""Read a history: cycles, events and trends by time, while the loop goes on writing.

Every question is a transaction of its own, so that a reader never keeps the writer from tidying
its log. Cycles come in the order in which they were recorded, whatever a clock did.
"""

import json
import sqlite3
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from difflib import get_close_matches
from itertools import islice
from pathlib import Path
from typing import Any, Final, Self, TypeVar, final

import polars as pl
import sqlalchemy as sa
from sqlalchemy.exc import DBAPIError, SQLAlchemyError

from thermaxis.codes import Place, values_of_json
from thermaxis.errors import DataError
from thermaxis.runtime._backlog import from_us, to_us
from thermaxis.runtime._ports import EventRecord
from thermaxis.runtime.history import _tables as t
from thermaxis.runtime.history._columns import ID, TIME
from thermaxis.runtime.history._database import file_identity, printable_cause, reading_engine
from thermaxis.runtime.history._parts import (
    MINUTE,
    Part,
    days_of,
    machine_folder,
    minutes_of,
    parts_of,
)
from thermaxis.runtime.history._url import check_url, history_folder

_MINUTE_US: Final = 60_000_000
_TRIES: Final = 3
_T = TypeVar("_T")
Span = tuple[datetime | None, datetime | None]
"""Begin, and end that is not included; None for that of the history."""


@final
@dataclass(frozen=True, slots=True)
class Trend:
    """One number over time, in equal steps; steps without a value are left out."""

    name: str
    step_us: int
    """Length of a step. [µs]"""
    time_us: tuple[int, ...]
    """Begin of each step, since 1970. [µs]"""
    lowest: tuple[float, ...]
    mean: tuple[float, ...]
    highest: tuple[float, ...]


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
        If the URL is wrong, the file is not there, or the history is of another program.
    DataError
        If it cannot be read, or is no history.
    """

    def __init__(self, url: str, password: str = "") -> None:
        self._path = check_url(url, key="historian.url")
        self.where = str(self._path or url)
        """The database, without a password."""
        self._engine = reading_engine(url, password)
        self._identity = None if self._path is None else file_identity(self._path)
        self._schemas: dict[Path, dict[str, pl.DataType]] = {}
        self._interrupted = False
        try:
            with self._errors_named():
                self._connection = self._engine.connect()
                self._bare: Any = self._connection.connection.dbapi_connection
            known = self._known()
            stated = known.get("folder", "")
            root = history_folder(url, Path(stated) if stated else None)
            self.folder = machine_folder(root, known.get("machine", ""))
            """Folder of the finished parts."""
        except BaseException:
            self.close()
            raise

    def _known(self) -> dict[str, str]:
        with self._asked() as connection:
            if t.is_history(connection, self.where):
                return t.known_of(connection)
        raise DataError("no_history", file=self.where)

    @property
    def in_place(self) -> bool:
        """Whether the file that is read is the one that has the name.

        It is not where the loop has put a damaged file aside: then the history is to be opened
        anew. A server is always in its place.
        """
        return self._path is None or file_identity(self._path) == self._identity

    def __enter__(self) -> Self:
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
            raise self._unreadable(cause or error) from error

    @contextmanager
    def _asked(self) -> Generator[sa.Connection]:
        if self._interrupted:
            raise DataError("question_interrupted", file=self.where)
        with self._errors_named(), self._connection.begin():
            yield self._connection

    # ---- cycles ---------------------------------------------------------------------------------

    def span(self) -> tuple[datetime, datetime] | None:
        """Return the earliest and the latest time of a cycle, None where there is none."""
        return self.retried(self._ends)

    def _ends(self) -> tuple[datetime, datetime] | None:
        rows, parts, _ = self._stored((None, None), ())
        days = parts[:1] + parts[-1:]  # as hours of one day are
        files = [part for part in parts if part.folder in {day.folder for day in days}]
        time = pl.concat([rows.lazy().select(TIME), self._scan(files, {TIME: _UTC})])
        first, last = time.select(first=pl.min(TIME), last=pl.max(TIME)).collect().row(0)
        return None if first is None else (first, last)

    def columns(self, first: datetime | None = None, last: datetime | None = None) -> pl.Schema:
        """Return the columns of the cycles in a span of days with their types."""
        return self._schema(
            *self._stored((_utc_or_none(first), _utc_or_none(last)), None, none=True)
        )

    def cycles(
        self,
        first: datetime | None = None,
        last: datetime | None = None,
        columns: Iterable[str] | None = None,
    ) -> pl.LazyFrame:
        """Return cycles in the order of recording, from files and rows alike.

        Parameters
        ----------
        first : datetime, optional
            Begin of the span. Default: that of the history.
        last : datetime, optional
            End, not included. Default: that of the history.
        columns : iterable of str, optional
            Columns that are wanted; ``id`` and ``time_utc`` always come too. Default: all.

        Returns
        -------
        polars.LazyFrame
            The cycles; a column that some of them lack is null there.

        Raises
        ------
        DataError
            If the history cannot be read.
        """
        span = _utc_or_none(first), _utc_or_none(last)
        wanted = None if columns is None else {ID, TIME, *columns}
        rows, parts, closed = self._stored(span, columns if columns is None else list(columns))
        schema = {ID: pl.Int64(), TIME: _UTC, **self._schema(rows, parts, closed)}
        schema = {name: kind for name, kind in schema.items() if wanted is None or name in wanted}
        scan = self._scan(parts, schema).filter(pl.col(ID) <= closed)
        ends = [part.last for part in parts]
        if any(part.first <= end for part, end in zip(parts[1:], ends, strict=False)):
            scan = scan.sort(ID)  # a clock went back, and a day was gone on with
        found = pl.concat([scan, rows.lazy()], how="diagonal").select(list(schema))
        return found.filter(*_inside(TIME, span))

    def _scan(
        self, parts: Sequence[Part], schema: Mapping[str, pl.DataType], kind: str = "cycles"
    ) -> pl.LazyFrame:
        """Return columns of files, null where one lacks them."""
        if not parts:
            return pl.LazyFrame(schema=schema)
        return pl.scan_parquet(
            [getattr(part, kind) for part in parts],
            schema=schema,
            missing_columns="insert",
            extra_columns="ignore",
            hive_partitioning=False,
        )

    def _stored(
        self, span: Span, columns: Sequence[str] | None, *, none: bool = False
    ) -> tuple[pl.DataFrame, list[Part], int]:
        """Return rows of a span, files of its days, and up to which id these count.

        Of a file that is newer the rows are still in the database. With `none` no row is among
        them, but all columns are.
        """
        frames = [pl.DataFrame(schema={ID: pl.Int64(), TIME: _UTC})]
        with self._asked() as connection:
            closed = int(t.known_of(connection)[t.CLOSED])
            ids = closed + 1, 2**62
            for name in t.cycle_tables(connection):
                rows = t.rows(connection, name, ids, span, columns)
                frames += islice(rows, 1 if none else None)
        parts = [part for part in self._filed(closed, span) if part.first <= closed]
        return pl.concat(frames, how="diagonal"), sorted(parts), closed

    def _filed(self, closed: int, span: Span = (None, None)) -> Iterator[Part]:
        if closed and not self.folder.is_dir():
            raise DataError("history_folder_lost", file=self.folder)
        first, last = span
        for day, path in days_of(self.folder).items():
            if (first is None or day >= first.date()) and (last is None or day <= last.date()):
                yield from parts_of(path)

    def parts(self) -> list[Part]:
        """Return the files of finished hours and days, in the order of recording.

        Raises
        ------
        DataError
            If the history cannot be read, or its folder is away.
        """
        with self._asked() as connection:
            closed = int(t.known_of(connection)[t.CLOSED])
        return sorted(part for part in self._filed(closed) if part.last <= closed)

    def _schema(self, rows: pl.DataFrame, parts: Sequence[Part], _: int) -> pl.Schema:
        """Return the columns of files and rows together, those of the newest first."""
        found: dict[str, pl.DataType] = dict(rows.schema)
        for part in reversed(parts):
            known = self._schemas.get(part.cycles)
            if known is None:
                known = self._schemas[part.cycles] = dict(pl.read_parquet_schema(part.cycles))
            for name, kind in known.items():
                found.setdefault(name, kind)
        return pl.Schema(found)

    def retried(self, work: Callable[[], _T]) -> _T:
        """Do something with files; again where one has just been joined to that of its day."""
        left = _TRIES
        while True:
            left -= 1
            try:
                return work()
            except pl.exceptions.PolarsError as error:
                raise self._unreadable(error) from error
            except FileNotFoundError as error:
                if not left:
                    raise self._unreadable(error) from error

    def _unreadable(self, error: BaseException) -> DataError:
        where = Place(self.where)
        return DataError("history_unreadable", cause=printable_cause(error), place=where)

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

        Raises
        ------
        DataError
            If the history cannot be read.
        """
        event = t.events.c
        query = sa.select(t.events).order_by(event[ID].desc()).limit(newest)
        if first is not None:
            query = query.where(event[TIME] >= _utc(first))
        if last is not None:
            query = query.where(event[TIME] < _utc(last))
        if kinds:
            query = query.where(event.kind.in_(list(kinds)))
        with self._asked() as connection:
            found = connection.execute(query).all()
        return [_event_of(row) for row in reversed(found)]

    # ---- trends ---------------------------------------------------------------------------------

    def series(self) -> tuple[str, ...]:
        """Return the columns that trends can be asked of: all that hold numbers."""
        schema = self.retried(self.columns)
        kinds = (pl.Float64(), pl.Boolean())
        return tuple(n for n, k in schema.items() if k in kinds and not n.endswith("_age_s"))

    def trend(
        self, names: Sequence[str], first: datetime, last: datetime, *, points: int = 1000
    ) -> Mapping[str, Trend]:
        """Return numbers over time, reduced to so many steps.

        Short spans are made from the cycles themselves, long ones from what is kept of every
        minute; every value of a cycle in the span is in exactly one step.

        Parameters
        ----------
        names : sequence of str
            Names of columns.
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
            If the history cannot be read, there is no such column, or the span is none.
        """
        known = self.series()
        for name in names:
            if name not in known:
                nearest = get_close_matches(name, known, n=1, cutoff=0.3)
                raise DataError("unknown_name", name=name, known=tuple(nearest), file=self.where)
        first_us, last_us = to_us(first), to_us(last)
        if last_us <= first_us or points < 1:
            raise DataError("trend_without_span", file=self.where)
        step_us = -(-(last_us - first_us) // points)
        long = step_us >= _MINUTE_US
        if long:
            first_us -= first_us % _MINUTE_US
            last_us += -last_us % _MINUTE_US
            step_us = -(-step_us // _MINUTE_US) * _MINUTE_US
        span = from_us(first_us), from_us(last_us)
        table = self._by_minute if long else self._by_cycle
        found = self.retried(lambda: _steps(table(names, span), names, first_us, step_us))
        return {name: _trend_of(name, found, first_us, step_us) for name in names}

    def _by_cycle(self, names: Sequence[str], span: Span) -> pl.LazyFrame:
        """Return every cycle as if it were a minute of its own."""
        value = {name: pl.col(name).cast(pl.Float64) for name in names}
        return self.cycles(*span, names).select(
            pl.col(TIME).alias(MINUTE),
            *[value[name].is_not_null().cast(pl.UInt32).alias(f"{name}_count") for name in names],
            *[
                value[name].alias(f"{name}_{end}")
                for name in names
                for end in ("least", "greatest", "mean")
            ],
        )

    def _by_minute(self, names: Sequence[str], span: Span) -> pl.LazyFrame:
        """Return minutes of files and those of rows; the same minute may be in several."""
        rows, parts, _ = self._stored(span, names)
        ends = {"count": pl.UInt32(), "least": _F, "greatest": _F, "mean": _F}
        numbers = {f"{name}_{end}": kind for name in names for end, kind in ends.items()}
        frames = [self._scan(parts, {MINUTE: _UTC, **numbers}, "minutes")]
        if rows.height:
            frames.append(minutes_of(rows.lazy()))
        found = pl.concat(frames, how="diagonal_relaxed").select(MINUTE, *numbers)
        return found.filter(*_inside(MINUTE, span))


_F: Final = pl.Float64()
_UTC: Final = pl.Datetime("us", "UTC")


def _inside(name: str, span: Span) -> list[pl.Expr]:
    first, last = span
    bounds = [] if first is None else [pl.col(name) >= first]
    return bounds if last is None else [*bounds, pl.col(name) < last]


def _steps(table: pl.LazyFrame, names: Sequence[str], first_us: int, step_us: int) -> pl.DataFrame:
    """Join minutes to steps: counts add up, and means are weighted by them."""
    step = ((pl.col(MINUTE).dt.epoch("us") - first_us) // step_us).alias("step")
    joined: list[pl.Expr] = []
    for name in names:
        count = pl.col(f"{name}_count").cast(pl.Int64)
        joined += [
            count.sum(),
            pl.col(f"{name}_least").min(),
            pl.col(f"{name}_greatest").max(),
            ((pl.col(f"{name}_mean") * count).sum() / count.sum()).alias(f"{name}_mean"),
        ]
    return table.group_by(step).agg(joined).sort("step").collect()


def _trend_of(name: str, found: pl.DataFrame, first_us: int, step_us: int) -> Trend:
    some = found.filter(pl.col(f"{name}_count") > 0)
    low, mean, high = (
        tuple(some[f"{name}_{end}"].to_list()) for end in ("least", "mean", "greatest")
    )
    begins = (first_us + some["step"] * step_us).to_list()
    return Trend(name, step_us, tuple(begins), low, mean, high)


def _event_of(row: Any) -> EventRecord:
    details = json.loads(row.details)
    values = values_of_json(details.pop("values", None))
    return EventRecord(_utc(row.time_utc), row.kind, row.who, row.text, details, row.code, values)


def _utc(moment: datetime) -> datetime:
    """Return a time in UTC; one of SQLite does not say that it is."""
    return moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment.astimezone(UTC)


def _utc_or_none(moment: datetime | None) -> datetime | None:
    return None if moment is None else _utc(moment)
