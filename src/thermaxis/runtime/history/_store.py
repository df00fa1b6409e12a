"""An open database of the history: what its one writer does with it. Used by one thread."""

import json
import sqlite3
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from itertools import groupby
from pathlib import Path
from typing import Any, Final, cast, final

import sqlalchemy as sa
from filelock import BaseFileLock
from sqlalchemy.engine import URL
from sqlalchemy.exc import SQLAlchemyError

from thermaxis import __version__
from thermaxis.codes import Message, Place
from thermaxis.errors import ConfigurationError
from thermaxis.runtime.history import _tables as t
from thermaxis.runtime.history._backlog import Item, PackedEvent
from thermaxis.runtime.history._closing import Order
from thermaxis.runtime.history._columns import ID, TIME, Layout, Row, from_us, names_of
from thermaxis.runtime.history._database import (
    file_identity,
    history_folder,
    shown_url,
    sqlite_path,
    writing_engine,
)
from thermaxis.runtime.history._integrity import (
    check_file,
    put_aside,
    writer_lock,
)
from thermaxis.runtime.history._parts import days_of, last_id, machine_folder, parts_of
from thermaxis.runtime.history._settings import HistorianSettings

_LOCK_KEY = 0x7468_6572_6D61_7869  # "thermaxi"
_DELETED_AT_ONCE: Final = 2000
_HOUR_US = 3_600_000_000
_RUN = "run "


@final
@dataclass(slots=True)
class FileWatch:
    """What a writer remembers of SQLite's file from one attempt to open it to the next."""

    checked: bool = False
    """Whether it was looked through since the program began, or since it was replaced."""
    damage: str = ""
    """What the database has said about a damage that it met; empty where it met none."""
    remarks: list[Message] = field(default_factory=list[Message])
    """Sentences about damage, until somebody takes them."""


def open_store(
    url: URL, run_key: str, settings: HistorianSettings, *, utc: datetime, watch: FileWatch
) -> "Store":
    """Open a database for writing, check it, and make what is missing.

    A damaged file of SQLite is put aside and a new one begun. The folder of the file is made where
    only that one is missing.
    """
    path = sqlite_path(url)
    if path is not None:  # its folder is made, but no folder above: a disk may not be mounted yet
        path.parent.mkdir(exist_ok=True)
    lock = writer_lock(path) if path is not None else None
    store = None
    try:
        if path is not None:
            _look_through(path, utc, watch)
        store = Store(url, path, lock, settings)
        store.prepare(run_key, utc)
    except BaseException:
        if store is not None:
            store.close()
        elif lock is not None:
            lock.release()
        raise
    return store


def _look_through(path: Path, utc: datetime, watch: FileWatch) -> None:
    damage = watch.damage or ("" if watch.checked else check_file(path))
    if damage:
        values = {"file": path.name, "detail": damage, "aside": put_aside(path, utc).name}
        watch.remarks.append(Message("event-history_damaged", values))
    watch.checked, watch.damage = True, ""


@final
class Store:
    """A connection to the database with everything the writer remembers about it.

    Every method but `close` raises ``sqlalchemy.exc.SQLAlchemyError`` if the database fails; the
    store is then of no more use.
    """

    def __init__(
        self, url: URL, path: Path | None, lock: BaseFileLock | None, settings: HistorianSettings
    ) -> None:
        self._url = url
        self._where = shown_url(url)
        self._path = path
        self._lock = lock
        self._root = history_folder(url, settings.folder)
        self._machine = settings.machine
        self.folder = machine_folder(self._root, self._machine)
        """Folder of the finished parts of this machine."""
        self._engine = writing_engine(url)
        self._connection = self._engine.connect()
        self._identity = None if path is None else file_identity(path)
        self._run = ""
        self._next_cycle = 0
        self._next_event = 0
        self._closed = 0
        self._layout: Layout | None = None
        self._table: sa.Table | None = None
        self._hour = 0
        self._unfinished = True
        self._leftover = True

    def prepare(self, run_key: str, utc: datetime) -> None:
        """Make tables, lock the database, find this run or begin it."""
        connection = self._connection
        if self._path is None:
            with connection.begin():
                held = connection.execute(sa.select(sa.func.pg_try_advisory_lock(_LOCK_KEY)))
                if not held.scalar_one():
                    raise ConfigurationError("history_in_use", place=Place(self._where))
        with connection.begin():
            t.make_tables(connection, self._where)
            known = t.known_of(connection)
            self._run = f"{_RUN}{run_key}"
            if self._run not in known:
                began = {"utc": utc.isoformat(), "program": __version__, "seq": -1}
                self._know(self._run, json.dumps(began))
            default = self._path is not None and self._root == history_folder(self._url, None)
            self._know("folder", "" if default else str(self._root.absolute()))
            self._know("machine", self._machine)
            closed, filed = int(known.get(t.CLOSED, "0")), last_id(self.folder)
            tables = t.cycle_tables(connection)
            greatest = [self._greatest(t.named(name).c[ID]) for name in tables]
            ordered = int(known.get(t.ORDERED, "0"))
            if filed > closed and filed != ordered and max(greatest, default=0) > closed:
                raise ConfigurationError("history_files_foreign", place=Place(str(self.folder)))
            self._closed = max(closed, filed)
            self._know(t.CLOSED, str(self._closed))
            self._next_cycle = 1 + max(self._closed, *greatest, 0)
            self._next_event = 1 + self._greatest(t.events.c[ID])
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

    def stored_seq(self) -> int:
        """Return the number of the last item of this run that is stored, -1 if none is. [1]"""
        with self._connection.begin():
            return int(self._own()["seq"])

    def _own(self) -> dict[str, Any]:
        """Return what is known of this run; a database that was exchanged has no such row."""
        own = sa.select(t.history.c.value).where(t.history.c.name == self._run)
        return cast("dict[str, Any]", json.loads(self._connection.execute(own).scalar_one()))

    def write(self, items: Sequence[Item]) -> None:
        """Store items, all or nothing."""
        cycle_id, event_id = self._next_cycle, self._next_event
        before = self._layout, self._table
        events: list[dict[str, object]] = []
        hour = self._hour
        connection = self._connection
        try:
            with connection.begin():
                for layout, some in groupby((item.content for item in items), key=_layout_of):
                    rows: list[dict[str, object]] = []
                    for content in some:
                        if isinstance(content, PackedEvent):
                            events.append(_event_row(content, event_id, cycle_id))
                            event_id += 1
                        else:
                            rows.append({ID: cycle_id, **content.values()})
                            hour = content.utc_us // _HOUR_US
                            cycle_id += 1
                    if layout is not None:
                        table = self._table_for(layout, cycle_id - len(rows))
                        connection.execute(sa.insert(table), rows)
                if events:
                    connection.execute(sa.insert(t.events), events)
                self._know(self._run, json.dumps({**self._own(), "seq": items[-1].seq}))
        except BaseException:
            self._layout, self._table = before
            raise
        self._unfinished |= hour != self._hour or self._layout is not before[0]
        self._hour = hour
        self._next_cycle, self._next_event = cycle_id, event_id

    def _table_for(self, layout: Layout, first: int) -> sa.Table:
        """Return the table for a layout; rows of another one are put aside, to become a part."""
        if self._table is not None and layout is self._layout:
            return self._table
        connection = self._connection
        wanted = names_of(layout.columns) | {ID, TIME}
        if self._table is None or wanted != {column.name for column in self._table.c}:
            if self._table is not None:
                name = connection.dialect.identifier_preparer.quote(t.table_before(first))
                connection.exec_driver_sql(f"ALTER TABLE {t.CYCLES} RENAME TO {name}")
            self._table = t.cycles_table(layout.columns, first)
            self._table.create(connection)
        self._layout = layout
        return self._table

    # ---- finished parts -------------------------------------------------------------------------

    def finished(self) -> Order | None:
        """Return the oldest rows that are a part by now: of an hour that is over, or put aside."""
        if not self._unfinished:
            return None
        with self._connection.begin():
            tables = t.cycle_tables(self._connection)
            for name in tables:
                order = self._finished_in(name)
                if order is not None:
                    self._know(t.ORDERED, str(order.last))
                    return order
                if name != t.CYCLES and not self._greatest(t.named(name).c[ID]):
                    self._connection.execute(sa.schema.DropTable(sa.Table(name, sa.MetaData())))
        self._unfinished = False
        return None

    def _finished_in(self, name: str) -> Order | None:
        c = t.named(name).c
        fresh = c[ID] > self._closed
        first = self._connection.execute(
            sa.select(c[ID], c[TIME]).where(fresh).order_by(c[ID]).limit(1)
        ).one_or_none()
        if first is None:
            return None
        hour = first[1].replace(minute=0, second=0, microsecond=0)
        outside = (c[TIME] < hour) | (c[TIME] >= hour + timedelta(hours=1))
        end = self._connection.execute(sa.select(sa.func.min(c[ID])).where(fresh, outside))
        following = end.scalar_one()
        if following is None:
            if name == t.CYCLES:
                return None
            following = 1 + self._greatest(c[ID])
        newest = t.named(t.CYCLES).c
        open_day = self._connection.execute(
            sa.select(newest[TIME]).where(newest[ID] >= following).order_by(newest[ID]).limit(1)
        ).scalar_one_or_none()
        return Order(
            self._url._replace(password=None).render_as_string(),
            name,
            int(first[0]),
            int(following) - 1,
            hour.date().isoformat(),
            (open_day or hour).date().isoformat(),
            str(self.folder),
        )

    def closed(self, order: Order) -> None:
        """Take note that rows are in a file; they no longer count, and go little by little."""
        with self._connection.begin():
            self._know(t.CLOSED, str(order.last))
            self._know(t.CLOSED_IN, order.folder)
        self._closed, self._leftover = order.last, True

    def delete_closed(self) -> bool:
        """Delete some rows that are in files; return whether there may be more."""
        if not self._leftover:
            return False
        with self._connection.begin():
            for name in t.cycle_tables(self._connection):
                table = t.named(name)
                first = self._connection.execute(sa.select(sa.func.min(table.c[ID]))).scalar_one()
                if first is not None and first <= self._closed:
                    last = min(self._closed, int(first) + _DELETED_AT_ONCE - 1)
                    self._connection.execute(sa.delete(table).where(table.c[ID] <= last))
                    self._unfinished = True
                    return True
        self._leftover = False
        return False

    def retire(self, days: int) -> None:
        """Remove the days that were recorded first, beyond those kept, with their events."""
        every = {path: parts_of(path) for path in days_of(self.folder).values()}
        order = sorted((parts[-1].last, path) for path, parts in every.items() if parts)
        for last, path in order[: max(0, len(order) - days)]:
            for part in every[path]:
                part.remove()
            with suppress(OSError):  # what others have put there stays
                path.rmdir()
            with self._connection.begin():
                self._connection.execute(sa.delete(t.events).where(t.events.c.cycle_id <= last))

    def close(self) -> None:
        """End the connection and let others write; what fails on the way does not matter."""
        with suppress(SQLAlchemyError, sqlite3.Error, OSError):
            self._connection.close()
        with suppress(SQLAlchemyError, sqlite3.Error, OSError):
            self._engine.dispose()
        if self._lock is not None:
            self._lock.release()


def _layout_of(content: Row | PackedEvent) -> Layout | None:
    return content.layout if isinstance(content, Row) else None


def _event_row(event: PackedEvent, event_id: int, cycle_id: int) -> dict[str, object]:
    row = event._asdict()
    return {ID: event_id, "cycle_id": cycle_id, TIME: from_us(row.pop("utc_us")), **row}
