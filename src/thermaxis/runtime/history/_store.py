"""An open database of the history: what its one writer does with it. Used by one thread."""

import sqlite3
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from datetime import timedelta
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import Any, Final, final

import sqlalchemy as sa
from sqlalchemy.exc import DBAPIError, SQLAlchemyError

from thermaxis.errors import ConfigurationError
from thermaxis.runtime._backlog import from_us
from thermaxis.runtime.history import _tables as t
from thermaxis.runtime.history._closing import Order
from thermaxis.runtime.history._columns import ID, TIME, Item, Layout, PackedEvent, Row
from thermaxis.runtime.history._database import file_identity, writing_engine
from thermaxis.runtime.history._integrity import writer_lock
from thermaxis.runtime.history._parts import (
    days_of,
    last_id,
    machine_folder,
    parts_of,
    shipped_name,
    shipped_names,
)
from thermaxis.runtime.history._settings import HistorianSettings
from thermaxis.runtime.history._url import history_folder, sqlite_path

_LOCK_KEY = 0x7468_6572_6D61_7869  # "thermaxi"
_DELETED_AT_ONCE: Final = 2000
_HOUR_US = 3_600_000_000
_LOCK_NOT_AVAILABLE: Final = "55P03"
"""What PostgreSQL says after its lock_timeout."""


@final
class Store:
    """A database opened for writing, with what is missing in it made.

    `look_through` is called with a file of SQLite, which it may put aside, before it is opened.
    Every method but `close` raises ``sqlalchemy.exc.SQLAlchemyError`` if the database fails; the
    store is then of no more use.
    """

    def __init__(self, settings: HistorianSettings, look_through: Callable[[Path], None]) -> None:
        self._url = url = settings.url
        self._path = path = sqlite_path(url)
        root = history_folder(url, settings.folder)
        self.folder = machine_folder(root, settings.machine)
        """Folder of the finished parts of this machine."""
        self._layout: Layout | None = None
        self._table: sa.Table | None = None
        self._hour = 0
        self._unfinished = self._leftover = True
        self._undo = ExitStack()
        try:
            if path is not None:
                # Its folder is made, but no folder above: a disk may not be mounted yet.
                path.parent.mkdir(exist_ok=True)
                self._undo.callback(writer_lock(path).release)
                look_through(path)
            engine = writing_engine(url, settings.password.reveal())
            self._undo.callback(engine.dispose)
            self._connection = self._undo.enter_context(engine.connect())
            self._identity = None if path is None else file_identity(path)
            with self._connection.begin():
                self._prepare()
                default = path is not None and root == history_folder(url, None)
                self._know("folder", "" if default else str(root.absolute()))
                self._know("machine", settings.machine)
        except BaseException:
            self.close()
            raise

    def _prepare(self) -> None:
        """Make tables, lock the database, find where to go on."""
        connection, where = self._connection, str(self._path or self._url)
        if self._path is None:
            held = connection.execute(sa.select(sa.func.pg_try_advisory_lock(_LOCK_KEY)))
            if not held.scalar_one():
                raise ConfigurationError("history_in_use", file=where)
        if not t.is_history(connection, where):
            t.metadata.create_all(connection)
            self._know("version", t.VERSION)
        closed, filed = t.known_of(connection).get(t.CLOSED), last_id(self.folder)
        tables = t.cycle_tables(connection)
        self._closed = filed if closed is None else int(closed)  # a new one goes on with the files
        last = max(self._closed, *[self._greatest(t.named(name).c[ID]) for name in tables], 0)
        if filed > last:  # rows go after their file is known, so it has no id that was never here
            raise ConfigurationError("history_files_foreign", file=self.folder)
        self._know(t.CLOSED, str(self._closed))
        self.following = last + 1, self._greatest(t.events.c[ID]) + 1
        """Ids of the next cycle and the next event. [1]"""
        if t.CYCLES in tables:
            self._table = t.stored_table(connection, t.CYCLES)

    def _know(self, name: str, value: str) -> None:
        self._connection.execute(sa.delete(t.history).where(t.history.c.name == name))
        self._connection.execute(sa.insert(t.history).values(name=name, value=value))

    def _greatest(self, column: "sa.ColumnElement[int]") -> int:
        return int(self._connection.execute(sa.select(sa.func.max(column))).scalar_one() or 0)

    @property
    def in_place(self) -> bool:
        """Whether the file that is written is the one that has the name; somebody may remove it."""
        return self._path is None or file_identity(self._path) == self._identity

    def close(self) -> None:
        """End the connection and let others write; what fails on the way does not matter."""
        with suppress(SQLAlchemyError, sqlite3.Error, OSError):
            self._undo.close()

    def write(self, items: Sequence[Item]) -> None:
        """Store items, all or nothing."""
        cycle_id, event_id = self.following
        events: list[dict[str, object]] = []
        hour = self._hour
        with self._connection.begin():
            for layout, some in groupby(items, key=_layout_of):
                rows: list[dict[str, object]] = []
                for item in some:
                    if isinstance(item, PackedEvent):
                        place = {ID: event_id + len(events), "cycle_id": cycle_id}
                        rest = item._asdict()
                        events.append({**place, TIME: from_us(rest.pop("utc_us")), **rest})
                    else:
                        rows.append({ID: cycle_id, **item.values()})
                        hour = item.utc_us // _HOUR_US
                        cycle_id += 1
                if layout is not None:
                    table = self._table_for(layout, cycle_id - len(rows))
                    self._insert(table, rows)
            if events:
                self._connection.execute(sa.insert(t.events), events)
        self._unfinished |= hour != self._hour
        self._hour = hour
        self.following = cycle_id, event_id + len(events)

    def _insert(self, table: sa.Table, rows: Sequence[dict[str, object]]) -> None:
        """Insert rows by the driver; SQLAlchemy takes twice as long for 500 columns [run]."""
        dialect, names = self._connection.dialect, [column.name for column in table.c]
        marks = ", ".join("?" if dialect.paramstyle == "qmark" else "%s" for _ in names)
        stored = table.c[TIME].type.dialect_impl(dialect).bind_processor(dialect)
        for row in rows:
            row[TIME] = row[TIME] if stored is None else stored(row[TIME])
        sql = f"INSERT INTO {table.name} VALUES ({marks})"  # noqa: S608 - a name of our own
        self._connection.exec_driver_sql(sql, list(map(itemgetter(*names), rows)))

    def _table_for(self, layout: Layout, first: int) -> sa.Table:
        """Return the table for a layout; rows of another one are put aside, to become a part."""
        if self._table is not None and layout is self._layout:
            return self._table
        wanted = {ID, TIME, *(column.name for column in layout.columns)}
        if self._table is None or wanted != {column.name for column in self._table.c}:
            if self._table is not None:
                rename = sa.DDL(f"ALTER TABLE {t.CYCLES} RENAME TO {t.BEFORE}{first}")
                self._connection.execute(rename)
                self._unfinished = True
            self._table = t.cycles_table(layout.columns, first)
            self._table.create(self._connection)
        self._layout = layout
        return self._table

    # ---- finished parts -------------------------------------------------------------------------

    def finished(self) -> Order | None:
        """Return the oldest rows that are a part by now: of an hour that is over, or put aside."""
        if not self._unfinished:
            return None
        with self._connection.begin():
            for name in t.cycle_tables(self._connection):
                order = self._finished_in(name)
                if order is not None:
                    return order
        self._unfinished = False
        return None

    def _finished_in(self, name: str) -> Order | None:
        c = t.named(name).c
        fresh = c[ID] > self._closed
        first = self._asked(sa.select(c[ID], c[TIME]).where(fresh).order_by(c[ID]).limit(1))
        if first is None:
            return None
        hour = first[1].replace(minute=0, second=0, microsecond=0)
        outside = (c[TIME] < hour) | (c[TIME] >= hour + timedelta(hours=1))
        (following,) = self._asked(sa.select(sa.func.min(c[ID])).where(fresh, outside))
        if following is None:
            if name == t.CYCLES:
                return None
            following = 1 + self._greatest(c[ID])
        newest = t.named(t.CYCLES).c
        open_row = sa.select(newest[TIME]).where(newest[ID] >= following).order_by(newest[ID])
        open_day = self._asked(open_row.limit(1)) or (hour,)
        days = hour.date().isoformat(), open_day[0].date().isoformat()
        return Order(self._url, name, int(first[0]), int(following) - 1, *days, str(self.folder))

    def _asked(self, query: Any) -> Any:
        return self._connection.execute(query).one_or_none()

    def closed(self, order: Order) -> None:
        """Take note that rows are in a file; they no longer count, and go little by little."""
        with self._connection.begin():
            self._know(t.CLOSED, str(order.last))
        self._closed, self._leftover = order.last, True

    def delete_closed(self) -> bool:
        """Delete some rows that are in files; return whether there may be more."""
        if not self._leftover:
            return False
        with self._connection.begin():
            for name in t.cycle_tables(self._connection):
                table = t.named(name)
                (first,) = self._asked(sa.select(sa.func.min(table.c[ID])))
                if first is not None and first <= self._closed:
                    last = min(self._closed, int(first) + _DELETED_AT_ONCE - 1)
                    self._connection.execute(sa.delete(table).where(table.c[ID] <= last))
                    return True
                if first is None and name != t.CYCLES:
                    self._drop(name)
        self._leftover = False
        return False

    def _drop(self, name: str) -> None:
        """Drop an empty table; one that somebody reads goes when the next part is closed."""
        try:
            with self._connection.begin_nested():
                self._connection.execute(sa.DDL(f"DROP TABLE {name}"))
        except DBAPIError as error:
            if getattr(error.orig, "sqlstate", None) != _LOCK_NOT_AVAILABLE:
                raise

    def retire(self, days: int) -> tuple[int, tuple[str, ...]]:
        """Remove the days that were recorded first, beyond those kept, with their events.

        Where days are shipped, one that no lake has confirmed stays, as long as there are no more
        than `days` of them beyond those kept. Returned are how many stay so, and which are gone
        unshipped.
        """
        shipped = shipped_names(self.folder)
        every = {path: parts_of(path) for path in days_of(self.folder).values()}
        order = sorted((parts[-1].last, path) for path, parts in every.items() if parts)
        old = [path for _, path in order[: max(0, len(order) - days)]]
        unshipped = [
            path
            for path in old
            if shipped is not None and not shipped.issuperset(map(shipped_name, every[path]))
        ]
        lost = unshipped[: max(0, len(unshipped) - days)]
        kept = unshipped[len(lost) :]
        for path in (path for path in old if path not in kept):
            for part in every[path]:
                part.remove()
            with suppress(OSError):  # what others have put there stays
                path.rmdir()
            event, ids = t.events.c.cycle_id, (every[path][0].first, every[path][-1].last)
            with self._connection.begin():
                gone = event.between(*ids) if kept else event <= ids[1]
                self._connection.execute(sa.delete(t.events).where(gone))
        return len(kept), tuple(path.name for path in lost)


def _layout_of(item: Item) -> Layout | None:
    return item.layout if isinstance(item, Row) else None
