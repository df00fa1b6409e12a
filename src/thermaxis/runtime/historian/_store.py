"""An open database of the history: what its one writer does with it. Used by one thread."""

import json
import sqlite3
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import datetime
from itertools import takewhile
from pathlib import Path
from typing import Any, Final, final

import sqlalchemy as sa
from filelock import BaseFileLock
from sqlalchemy.dialects.postgresql import insert as postgresql_insert
from sqlalchemy.dialects.sqlite import insert as sqlite_insert
from sqlalchemy.engine import URL
from sqlalchemy.exc import SQLAlchemyError

from thermaxis import __version__
from thermaxis.codes import Message, Place
from thermaxis.compensation import SupervisorState
from thermaxis.errors import ConfigurationError
from thermaxis.runtime.historian import _tables as t
from thermaxis.runtime.historian._backlog import Item
from thermaxis.runtime.historian._database import (
    file_identity,
    shown_url,
    sqlite_path,
    writing_engine,
)
from thermaxis.runtime.historian._integrity import (
    Soundness,
    check_file,
    put_aside,
    writer_lock,
)
from thermaxis.runtime.historian._layout import Layout, SeriesColumn
from thermaxis.runtime.historian._rows import (
    LONGEST_WORD,
    PackedCycle,
    RowPacker,
    pack_block,
    storable,
    to_us,
)
from thermaxis.runtime.historian._trend import MINUTE_US, Tally, tally

BLOCK_ROWS: Final = 256
"""Rows of a full block: four minutes at one second, half a minute at 10 Hz. [1]"""
DAY_US: Final = 86_400_000_000
"""A day. [µs]"""

_LOCK_KEY = 0x7468_6572_6D61_7869  # "thermaxi"
_RETIRED_AT_ONCE = 50
_SERIES_CLEARED_AT_ONCE = 8
_LAYOUTS_KEPT = 50


@final
@dataclass(slots=True)
class FileWatch:
    """What a writer remembers of SQLite's file from one attempt to open it to the next."""

    checked: bool = False
    """Whether it was looked through since the program began, or since it was replaced."""
    damage: str = ""
    """What the database has said about a damage that it met; empty where it met none."""
    remarks: list[Message] = field(default_factory=list[Message])
    """Sentences about damage and checks that were not finished, until somebody takes them."""


def open_store(
    url: URL, run_key: str, *, check_s: float, utc: datetime, watch: FileWatch
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
            _look_through(path, check_s, utc, watch)
        store = Store(url, path, lock)
        store.prepare(run_key, utc)
    except BaseException:
        if store is not None:
            store.close()
        elif lock is not None:
            lock.release()
        raise
    return store


def _look_through(path: Path, check_s: float, utc: datetime, watch: FileWatch) -> None:
    if watch.damage:
        found = Soundness(sound=False, complete=True, text=watch.damage)
    elif watch.checked:
        return
    else:
        found = check_file(path, check_s)
    if not found.sound:
        target = put_aside(path, utc)
        values = {"file": path.name, "detail": found.text, "aside": target.name}
        watch.remarks.append(Message("event-history_damaged", values))
    elif not found.complete:
        values = {"file": path.name, "longest_s": check_s}
        watch.remarks.append(Message("event-history_unchecked", values))
    watch.checked, watch.damage = True, ""


@final
class Store:
    """A connection to the database with everything the writer remembers about it.

    Every method but `close` raises ``sqlalchemy.exc.SQLAlchemyError`` if the database fails; the
    store is then of no more use.
    """

    def __init__(self, url: URL, path: Path | None, lock: BaseFileLock | None) -> None:
        self._where = shown_url(url)
        self._path = path
        self._lock = lock
        self._engine = writing_engine(url)
        self._connection = self._engine.connect()
        self._identity = None if path is None else file_identity(path)
        self._insert = sqlite_insert if path is not None else postgresql_insert
        self._run = 0
        self._next_cycle = 0
        self._next_event = 0
        self._words_stored = 0
        self._layouts_stored = 0
        self._layouts: dict[tuple[int, int], Layout] = {}
        self._series: dict[str, int] = {}
        self._mixed = True
        self._last_layout: int | None = None
        self._retiring: tuple[int, list[int]] | None = None
        self.open_rows = 0
        """Cycles that are in no block yet. [1]"""

    def prepare(self, run_key: str, utc: datetime) -> None:
        """Make tables, lock the database, find this run or begin it."""
        connection = self._connection
        if self._path is None:
            with connection.begin():
                held = connection.execute(sa.select(sa.func.pg_try_advisory_lock(_LOCK_KEY)))
                if not held.scalar_one():
                    raise ConfigurationError("history_in_use", place=Place(self._where))
        t.make_tables(connection, self._where)
        with connection.begin():
            self._run = self._found_run(run_key, utc)
            self._words_stored = self._count_of(t.word)
            self._layouts_stored = self._count_of(t.layout)
            self._next_cycle = 1 + max(self._greatest(t.cycle.c.id), self._greatest(t.block.c.id))
            self._next_event = 1 + self._greatest(t.event.c.id)
            self.open_rows = self._one(sa.select(sa.func.count()).select_from(t.cycle))

    def _one(self, query: sa.Select[int]) -> int:
        return int(self._connection.execute(query).scalar_one() or 0)

    def _greatest(self, column: sa.Column[int]) -> int:
        return self._one(sa.select(sa.func.max(column)))

    def _count_of(self, table: sa.Table) -> int:
        return self._one(
            sa.select(sa.func.count()).select_from(table).where(table.c.run == self._run)
        )

    def _found_run(self, key: str, utc: datetime) -> int:
        found = self._connection.execute(
            sa.select(t.run.c.id).where(t.run.c.key == key)
        ).scalar_one_or_none()
        if found is not None:
            return int(found)
        number = 1 + self._greatest(t.run.c.id)
        self._connection.execute(
            sa.insert(t.run).values(id=number, key=key, utc_us=to_us(utc), program=__version__)
        )
        return number

    @property
    def in_place(self) -> bool:
        """Whether the file that is written is the one that has the name; somebody may remove it."""
        return self._path is None or file_identity(self._path) == self._identity

    def stored_seq(self) -> int:
        """Return the number of the last item of this run that is stored, -1 if none is. [1]"""
        columns = (
            (t.cycle.c.seq, t.cycle.c.run),
            (t.block.c.last_seq, t.block.c.run),
            (t.event.c.seq, t.event.c.run),
        )
        with self._connection.begin():
            found = [
                self._connection.execute(
                    sa.select(sa.func.max(seq)).where(run == self._run)
                ).scalar_one()
                for seq, run in columns
            ]
        return max((int(seq) for seq in found if seq is not None), default=-1)

    def write(self, items: Sequence[Item], packer: RowPacker) -> None:
        """Store items with the words and layouts that they need, all or nothing."""
        words = packer.words[self._words_stored :]
        layouts = packer.layouts[self._layouts_stored :]
        cycles: list[dict[str, object]] = []
        events: list[dict[str, object]] = []
        cycle_id, event_id = self._next_cycle, self._next_event
        last_layout = self._last_layout
        kinds: set[int] = set() if last_layout is None else {last_layout}
        for item in items:
            content = item.content
            row: dict[str, object] = {"run": self._run, "seq": item.seq}
            if isinstance(content, PackedCycle):
                cycles.append({**row, **content._asdict(), "id": cycle_id})
                kinds.add(content.layout)
                last_layout = content.layout
                cycle_id += 1
            else:
                events.append({**row, **content._asdict(), "id": event_id, "cycle_id": cycle_id})
                event_id += 1
        connection = self._connection
        with connection.begin():
            if words:
                connection.execute(sa.insert(t.word), self._numbered(words, self._words_stored))
            if layouts:
                texts = [layout.as_text() for layout in layouts]
                connection.execute(sa.insert(t.layout), self._numbered(texts, self._layouts_stored))
            if cycles:
                connection.execute(sa.insert(t.cycle), cycles)
            if events:
                connection.execute(sa.insert(t.event), events)
        self._words_stored += len(words)
        self._layouts_stored += len(layouts)
        self._next_cycle, self._next_event = cycle_id, event_id
        self.open_rows += len(cycles)
        self._mixed |= len(kinds) > 1
        self._last_layout = last_layout

    def _numbered(self, texts: Sequence[str], first: int) -> list[dict[str, object]]:
        return [{"run": self._run, "code": first + k, "text": text} for k, text in enumerate(texts)]

    # ---- blocks ---------------------------------------------------------------------------------

    def close_block(self) -> bool:
        """Make a block of the oldest rows, with their trend, if they fill one.

        Rows of another layout or an earlier run make a block however few they are.
        """
        if self.open_rows < BLOCK_ROWS and not self._mixed:
            return False
        with self._connection.begin():
            query = sa.select(t.cycle).order_by(t.cycle.c.id).limit(BLOCK_ROWS)
            found = self._connection.execute(query).all()
            if not found:
                self._mixed = False
                return False
            kind = (found[0].run, found[0].layout)
            same = list(takewhile(lambda r: (r.run, r.layout) == kind, found))
            if len(same) == len(found) < BLOCK_ROWS and kind[0] == self._run:
                self._mixed = False
                return False
            self._close(same, kind)
        self.open_rows -= len(same)
        return True

    def _close(self, rows: "Sequence[sa.Row[Any]]", kind: tuple[int, int]) -> None:
        layout = self._layout(kind)
        last = rows[-1]
        times = [int(row.utc_us) for row in rows]
        packed: list[bytes] = [bytes(row.row) for row in rows]
        texts = {k: row.text for k, row in enumerate(rows) if row.text is not None}
        connection = self._connection
        connection.execute(
            sa.insert(t.block).values(
                id=last.id,
                run=last.run,
                last_seq=last.seq,
                layout=last.layout,
                entries=len(rows),
                utc_min_us=min(times),
                utc_max_us=max(times),
                rows=pack_block(packed),
                texts=json.dumps(texts) if texts else None,
            )
        )
        self._add_to_trend(tally(layout, packed, self._active_code(kind[0])))
        connection.execute(sa.delete(t.cycle).where(t.cycle.c.id <= last.id))

    def _layout(self, kind: tuple[int, int]) -> Layout:
        known = self._layouts.get(kind)
        if known is None:
            run, code = kind
            text = self._connection.execute(
                sa.select(t.layout.c.text).where(t.layout.c.run == run, t.layout.c.code == code)
            ).scalar_one()
            if len(self._layouts) >= _LAYOUTS_KEPT:
                self._layouts.clear()
            known = self._layouts[kind] = Layout.from_text(text)
        return known

    def _active_code(self, run: int) -> int | None:
        word = t.word.c
        return self._connection.execute(
            sa.select(word.code).where(word.run == run, word.text == SupervisorState.ACTIVE.value)
        ).scalar_one_or_none()

    def _add_to_trend(self, tallies: Mapping[tuple[SeriesColumn, int], Tally]) -> None:
        rows = [
            {"series": self._series_of(column), "minute": minute, **found._asdict()}
            for (column, minute), found in tallies.items()
        ]
        trend, insert = t.trend.c, self._insert(t.trend)
        new = insert.excluded
        self._connection.execute(
            insert.on_conflict_do_update(
                index_elements=[trend.series, trend.minute],
                set_={
                    "entries": trend.entries + new.entries,
                    "lowest": sa.case((new.lowest < trend.lowest, new.lowest), else_=trend.lowest),
                    "highest": sa.case(
                        (new.highest > trend.highest, new.highest), else_=trend.highest
                    ),
                    "total": trend.total + new.total,
                },
            ),
            rows,
        )

    def _series_of(self, column: SeriesColumn) -> int:
        name = storable(column.name, LONGEST_WORD)
        number = self._series.get(name)
        if number is None:
            series = t.series.c
            number = self._connection.execute(
                sa.select(series.id).where(series.name == name)
            ).scalar_one_or_none()
            if number is None:
                number = 1 + self._greatest(series.id)
                self._connection.execute(
                    sa.insert(t.series).values(id=number, name=name, unit=column.unit)
                )
            self._series[name] = number
        return number

    # ---- retention ------------------------------------------------------------------------------

    def retire(self, days: int) -> bool:
        """Delete a little of what is older than the days that are kept."""
        with self._connection.begin():
            if self._retiring is None:
                self._retiring = self._first_day_to_retire(days)
            if self._retiring is None:
                return False
            day, series = self._retiring
            if series:
                del series[: self._clear_trend(day, series[:_SERIES_CLEARED_AT_ONCE])]
            elif self._delete_blocks(day):
                self._retiring = None
        return True

    def _first_day_to_retire(self, days: int) -> tuple[int, list[int]] | None:
        block = t.block.c
        day = block.utc_min_us // DAY_US
        execute = self._connection.execute
        if len(execute(sa.select(day).distinct()).all()) <= days:
            return None
        first = self._one(sa.select(day).order_by(block.id).limit(1))
        end = execute(sa.select(sa.func.min(block.id)).where(day != first)).scalar_one()
        again = execute(sa.select(block.id).where(day == first, block.id > end).limit(1)).all()
        if again:  # a clock that was set back: the trend of that day is still wanted
            return first, []
        return first, [int(row.id) for row in execute(sa.select(t.series.c.id))]

    def _clear_trend(self, day: int, series: Sequence[int]) -> int:
        first = day * (DAY_US // MINUTE_US)
        trend = t.trend.c
        self._connection.execute(
            sa.delete(t.trend).where(
                trend.series.in_(series), trend.minute.between(first, first + 24 * 60 - 1)
            )
        )
        return len(series)

    def _delete_blocks(self, day: int) -> bool:
        """Delete some blocks and what goes with them; return whether the day is over."""
        block = t.block.c
        query = sa.select(block.id, (block.utc_min_us // DAY_US).label("day"))
        found = self._connection.execute(query.order_by(block.id).limit(_RETIRED_AT_ONCE)).all()
        doomed = list(takewhile(lambda row: row.day == day, found))
        if doomed:
            last = doomed[-1].id
            self._connection.execute(sa.delete(t.block).where(block.id <= last))
            self._connection.execute(sa.delete(t.event).where(t.event.c.cycle_id <= last))
        return len(doomed) < _RETIRED_AT_ONCE

    def close(self) -> None:
        """End the connection and let others write; what fails on the way does not matter."""
        with suppress(SQLAlchemyError, sqlite3.Error, OSError):
            self._connection.close()
        with suppress(SQLAlchemyError, sqlite3.Error, OSError):
            self._engine.dispose()
        if self._lock is not None:
            self._lock.release()
