"""The historian: cycles and events to a database, by a thread of its own.

`SqlHistorian.record` gathers the values of a cycle and returns; a thread writes what waits, twice a
second, and lets finished hours become files. Nothing that happens to the database reaches the
loop: what cannot be written waits in memory up to a bound and is written later, and what is lost is
counted, shown and recorded.
"""

import asyncio
import json
import sqlite3
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final, final

from sqlalchemy.exc import DataError, DBAPIError, IntegrityError, SQLAlchemyError

from thermaxis.codes import NOWHERE, Message, values_as_json
from thermaxis.errors import ThermaxisError
from thermaxis.runtime._backlog import Backlog, Loss, from_us, to_us
from thermaxis.runtime._ports import Clock, CycleRecord, EventRecord, Historian, HistorianStatus
from thermaxis.runtime.history._closing import WRITTEN, Closing, Order, done
from thermaxis.runtime.history._columns import (
    LONGEST_TEXT,
    UNPACKABLE,
    Columns,
    Item,
    PackedEvent,
    storable,
)
from thermaxis.runtime.history._database import printable_cause
from thermaxis.runtime.history._integrity import check_file, is_damage, put_aside
from thermaxis.runtime.history._settings import HistorianSettings
from thermaxis.runtime.history._store import Store
from thermaxis.runtime.history._url import check_url

_IDLE_S: Final = 5.0
_LAST_RETRY_S: Final = 0.1
_WAITED_FOR_S: Final = 5.0  # what failed for longer is tried once more at the end, not longer
_MOST_AT_ONCE: Final = 1000
_RETIRE_EVERY_S: Final = 3600.0
_CLOSE_AGAIN_S: Final = 60.0
_SILENT_S: Final = 10.0
_LONGEST_DETAILS: Final = 20_000
_NO_FLIGHT: Final = (0, 0), Loss()  # ids after what is being written, and the loss that it tells
_FAILURES = (SQLAlchemyError, sqlite3.Error, OSError, ThermaxisError)
_REFUSALS = (DataError, IntegrityError, ValueError, TypeError, OverflowError)


def pack_event(event: EventRecord) -> PackedEvent:
    """Return an event as it is stored; what is too long is cut."""
    details = json.dumps({**event.details, "values": values_as_json(event.values)})
    if len(details) > _LONGEST_DETAILS:
        details = json.dumps({"cut": details[:1000]})
    return PackedEvent(
        to_us(event.utc),
        storable(event.kind, 100),
        storable(event.who, 400),
        storable(event.code, 400),
        storable(event.text, LONGEST_TEXT),
        details,
    )


@final
class SqlHistorian(Historian):
    """Remembers in SQLite or PostgreSQL what the loop did.

    One database belongs to one machine, and one program writes to it. Records of half a second
    are written together; on SQLite they are on the disk then, so that a sudden end, of the program
    or of the power, takes no more than the last second.

    Not protected: nothing here acts on the machine. What waits in memory is gone with the
    program: as long as the database is lost, so is what a sudden end takes. A disk that says it
    has written what it has not is believed.

    Parameters
    ----------
    settings : HistorianSettings
        The database, ``sqlite:///file`` or ``postgresql+psycopg://user@host/database``, with its
        password; retention, bounds.
    clock : Clock
        The time of day of its own events. Its waiting is done in real time.
    beside : bool
        Whether a program of its own closes finished hours. Default: yes, but in tests.

    Raises
    ------
    ConfigurationError
        If the URL is none that a history can be kept in.
    """

    def __init__(self, settings: HistorianSettings, clock: Clock, *, beside: bool = True) -> None:
        check_url(settings.url, key="historian.url")
        self._settings = settings
        self._clock = clock
        self._beside = beside
        self._columns = Columns()
        self._backlog = Backlog[Item](settings.largest_waiting_bytes)
        self._thread: threading.Thread | None = None
        self._end_s: float | None = None
        self._closing = threading.Event()
        # ---- of the thread
        self._store: Store | None = None
        self._damage: str | None = None  # None: the file was not looked through yet
        self._flight = _NO_FLIGHT
        self._most = _MOST_AT_ONCE
        self._closer: Closing | None = None
        self._close_s = self._retire_s = self._failed_since_s = 0.0
        self._unjoined: list[str] = []
        self._unshipped = 0
        self._unusable = ""
        # ---- of both; each is replaced whole
        self._failure: Message | None = None
        self._unclosed: Message | None = None
        self._busy: tuple[float, str] | None = None

    # ---- the loop's side ------------------------------------------------------------------------

    async def open(self, outputs: Sequence[str]) -> None:
        """Begin to store; a database that is not there is waited for."""
        self._columns.outputs = tuple(outputs)
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="historian", daemon=True)
            self._thread.start()

    def record(self, record: CycleRecord) -> None:
        """Take a cycle; one that is not what its fields promise counts as lost."""
        try:
            self._backlog.add(self._columns.row_of(record))
        except UNPACKABLE as error:
            self._refuse(error, Loss(rows=1))

    def event(self, event: EventRecord) -> None:
        """Take an event."""
        try:
            self._backlog.add(pack_event(event))
        except (*UNPACKABLE, RecursionError) as error:
            self._refuse(error, Loss(events=1))

    def _refuse(self, error: BaseException, loss: Loss) -> None:
        now_us = to_us(self._clock.utc())
        self._unusable = printable_cause(error)
        self._backlog.add_loss(loss._replace(first_us=now_us, last_us=now_us))

    @property
    def status(self) -> HistorianStatus:
        """How it fares."""
        failure, busy, thread = self._failure, self._busy, self._thread
        if failure is None and busy is not None and time.monotonic() - busy[0] > _SILENT_S:
            failure = Message(busy[1], {"lasts_s": time.monotonic() - busy[0]})
        failure = failure or self._unclosed
        if thread is not None and not thread.is_alive() and not self._closing.is_set():
            failure = Message("failure-historian_ended")
        return HistorianStatus(
            failure is None, self._backlog.waiting, self._backlog.lost.number, failure
        )

    async def close(self, deadline_s: float) -> None:
        """Store what is left, as far as a time allows, and end; the rest counts as lost."""
        self._end_s = time.monotonic() + deadline_s
        self._closing.set()
        self._backlog.arrived.set()
        if self._thread is not None:
            await asyncio.to_thread(self._thread.join, deadline_s)
        self._backlog.give_up()

    # ---- the thread's side ----------------------------------------------------------------------

    def _run(self) -> None:
        try:
            while not (self._closing.is_set() and (not self._backlog.waiting or self._expired())):
                if not self.attempt():
                    ends = self._closing.is_set()
                    if ends and time.monotonic() - self._failed_since_s > _WAITED_FOR_S:
                        break
                    if self._closing.wait(self._settings.retry_s):
                        time.sleep(min(_LAST_RETRY_S, self._settings.retry_s))
                elif not self._closing.is_set() and self._backlog.arrived.wait(_IDLE_S):
                    self._closing.wait(self._settings.batch_s)
        finally:
            self.disconnect()

    def _expired(self) -> bool:
        return self._end_s is not None and time.monotonic() >= self._end_s

    def attempt(self) -> bool:
        """Store everything that waits, and keep house; return whether the database took it."""
        if self._store is None:
            self._open()
        if self._store is not None:
            self._write(self._store)
        if self._store is not None and not self._expired():
            self._keep_house(self._store)
        return self._store is not None

    def disconnect(self) -> None:
        """End the connection, and what is being closed: it is begun again next time."""
        if self._closer is not None:
            self._closer.end()
        if self._store is not None:
            self._store.close()
        self._closer = self._store = None

    def _open(self) -> None:
        self._busy = (time.monotonic(), "failure-history_opening")
        try:
            self._store = Store(self._settings, self._look_through)
        except _FAILURES as error:
            self._drop_store(error)
            return
        self._busy = None
        after, stated = self._flight
        if self._store.following == after:  # it was stored, and only the answer was lost
            self._stored(stated)
        self._backlog.put_back()

    def _look_through(self, path: Path) -> None:
        """Put a damaged file aside; it is looked for at the start, and where damage was met."""
        damage = check_file(path) if self._damage is None else self._damage
        if damage:
            values = {"file": path.name, "detail": damage}
            values["aside"] = put_aside(path, self._clock.utc()).name
            self._state("alarm", Message("event-history_damaged", values))
        self._damage = ""

    def _write(self, store: Store) -> None:
        """Store everything that waits, some at a time."""
        self._backlog.arrived.clear()
        while not self._expired():
            items, loss = self._backlog.take(self._most), self._backlog.unstated
            batch = [*items, *self._told(loss)]
            if not batch:
                self._most = _MOST_AT_ONCE
                return
            events = sum(isinstance(item, PackedEvent) for item in batch)
            cycle, event = store.following
            self._flight = (cycle + len(batch) - events, event + events), loss
            self._busy = (time.monotonic(), "failure-database_silent")
            try:
                store.write(batch)
                if not store.in_place:
                    self._damage = None
                    self._drop_store(ThermaxisError.of(Message("failure-history_replaced")))
                    return
            except _REFUSALS as error:
                if len(items) == 1:
                    self._unusable = printable_cause(error)
                    self._backlog.drop_taken()
                self._most = 1
                self._drop_store(error)
                return
            except _FAILURES as error:
                self._drop_store(error)
                return
            self._recovered()  # before, so that what it says is not overtaken by "all is stored"
            self._stored(loss)
            if loss.number:
                self._unusable = ""

    def _stored(self, loss: Loss) -> None:
        """Forget what was stored, so that no later connection does so again."""
        self._backlog.stored(loss)
        self._flight = _NO_FLIGHT

    def _told(self, loss: Loss) -> list[PackedEvent]:
        """Return the event that tells of a loss, if there is one."""
        if not loss.number:
            return []
        counts = {"cycles": loss.rows, "events": loss.events}
        details = {
            **counts,
            "first": from_us(loss.first_us).isoformat(),
            "last": from_us(loss.last_us).isoformat(),
            "unusable": self._unusable,
        }
        return [self._packed("loss", Message("event-records_lost", counts), details)]

    def _recovered(self) -> None:
        """Say in the history why something came late."""
        self._busy, failure, self._failure = None, self._failure, None
        if failure is not None:
            lasted_s = time.monotonic() - self._failed_since_s
            message = Message("event-not_stored", {"lasted_s": lasted_s, "why": failure})
            self._state("connection", message, {"duration_s": round(lasted_s, 1)})

    def _state(
        self,
        kind: str,
        message: Message,
        details: Mapping[str, str | float | bool | None] | None = None,
    ) -> None:
        self._backlog.add(self._packed(kind, message, details))

    def _packed(
        self,
        kind: str,
        message: Message,
        details: Mapping[str, str | float | bool | None] | None = None,
    ) -> PackedEvent:
        return pack_event(EventRecord.of(self._clock.utc(), kind, "", message, details))

    def _drop_store(self, error: BaseException) -> None:
        """End the connection and take note why; the place of the file is for the terminal only."""
        self.disconnect()
        cause = (error.orig if isinstance(error, DBAPIError) else None) or error
        if is_damage(cause):
            self._damage = printable_cause(cause)
        if self._failure is None:
            self._failed_since_s = time.monotonic()
        failure = Message("failure-history_unwritable", {"detail": printable_cause(cause)})
        if isinstance(error, ThermaxisError):
            failure = replace(error.message, place=NOWHERE)
        self._failure, self._busy = failure, None

    # ---- finished hours -------------------------------------------------------------------------

    def _keep_house(self, store: Store) -> None:
        """Let finished parts be written, and delete what is in them, a little each time."""
        self._busy = (time.monotonic(), "failure-database_silent")
        try:
            while self._close_a_part(store):
                pass
            while store.delete_closed() and not self._backlog.arrived.is_set():
                pass
            if time.monotonic() >= self._retire_s:
                self._retire_s = time.monotonic() + _RETIRE_EVERY_S
                self._retire(store)
        except SQLAlchemyError as error:
            self._drop_store(error)
        except OSError as error:
            self._leave_unclosed(printable_cause(error))
        self._busy = None

    def _retire(self, store: Store) -> None:
        try:
            kept, lost = store.retire(self._settings.retention_days)
        except OSError as error:  # finished hours are closed nevertheless
            detail = printable_cause(error)
            self._state("alarm", Message("event-old_days_kept", {"detail": detail}))
            return
        if lost:
            self._state("alarm", Message("event-unshipped_deleted", {"detail": ", ".join(lost)}))
        if kept and not self._unshipped:
            self._state("alarm", Message("event-unshipped_kept", {"days": kept}))
        self._unshipped = kept

    def _close_a_part(self, store: Store) -> bool:
        """Go on with closing; return whether a part is closed, so that there may be another."""
        if self._closer is None:
            order = store.finished() if time.monotonic() >= self._close_s else None
            if order is None:
                return False
            if not self._beside:
                return self._closed(store, order, self._done_here(order))
            self._closer = Closing(order, self._settings.password.reveal())
        if not self._closer.ended():
            return False
        closer, self._closer = self._closer, None
        return self._closed(store, closer.order, closer.result())

    def _done_here(self, order: Order) -> list[str]:
        try:
            return list(done(order, self._settings.password.reveal()))
        except (ThermaxisError, OSError) as error:
            return [printable_cause(error)]

    def _closed(self, store: Store, order: Order, said: list[str]) -> bool:
        if WRITTEN not in said:  # perhaps after what the interpreter or a library has warned of
            self._leave_unclosed(said[-1])
            return False
        self._unclosed, unjoined = None, said[said.index(WRITTEN) + 1 :]
        if unjoined not in ([], self._unjoined):
            detail = "; ".join(unjoined)[:300]
            self._state("alarm", Message("event-day_unjoined", {"detail": detail}))
        self._unjoined = unjoined
        store.closed(order)
        return True

    def _leave_unclosed(self, why: str) -> None:
        """Try again later; rows stay where they are."""
        self._close_s = time.monotonic() + _CLOSE_AGAIN_S
        if self._unclosed is None:
            self._state("alarm", Message("event-part_unwritten", {"detail": why}))
        self._unclosed = Message("failure-part_unwritten", {"detail": why})
