"""What the historian's thread does: bring what waits into the database, and keep house there."""

import json
import sqlite3
import time
import uuid
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Final, final

from sqlalchemy.engine import URL
from sqlalchemy.exc import DataError, DBAPIError, IntegrityError, SQLAlchemyError

from thermaxis.codes import NOWHERE, Message, values_as_json
from thermaxis.errors import ThermaxisError
from thermaxis.runtime._ports import Clock, EventRecord
from thermaxis.runtime.history._backlog import NO_LOSS, Backlog, Loss, PackedEvent
from thermaxis.runtime.history._closing import Closing, Order, close, join_days
from thermaxis.runtime.history._columns import LONGEST_TEXT, from_us, storable, to_us
from thermaxis.runtime.history._database import printable_cause
from thermaxis.runtime.history._integrity import is_damage
from thermaxis.runtime.history._settings import HistorianSettings
from thermaxis.runtime.history._store import FileWatch, Store, open_store

_MOST_AT_ONCE: Final = 1000
_RETIRE_EVERY_S: Final = 3600.0
_CLOSE_AGAIN_S: Final = 60.0
_SILENT_S: Final = 10.0
_LONGEST_DETAILS: Final = 20_000
_FAILURES = (SQLAlchemyError, sqlite3.Error, OSError)
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


class _ReplacedError(OSError):
    """The file of the history was removed or replaced."""


def _failure_of(error: BaseException, cause: BaseException) -> Message:
    """Return what is told of an error; the place of the file is for the terminal only."""
    if isinstance(error, ThermaxisError):
        return replace(error.message, place=NOWHERE)
    if isinstance(error, _ReplacedError):
        return Message("failure-history_replaced")
    return Message("failure-history_unwritable", {"detail": printable_cause(cause)})


@final
class Writer:
    """Stores what waits, as often as it is asked to. Used by one thread, but for `trouble`.

    Finished parts are written by a program beside this one, or, where `beside` is false, at once.
    """

    def __init__(
        self,
        url: URL,
        settings: HistorianSettings,
        clock: Clock,
        backlog: Backlog,
        *,
        beside: bool = True,
    ) -> None:
        self._url = url
        self._settings = settings
        self._clock = clock
        self._backlog = backlog
        self._beside = beside
        self._key = uuid.uuid4().hex
        self._store: Store | None = None
        self._watch = FileWatch()
        self._most = _MOST_AT_ONCE
        self._retire_s = 0.0
        self._closing: Closing | None = None
        self._close_s = 0.0
        self._unjoined = ""
        self._failed_since_s = 0.0
        # Read by the loop as well; each is replaced whole.
        self._failure: Message | None = None
        self._unclosed: Message | None = None
        self._busy: tuple[float, str] | None = None
        self.unusable = ""
        """Why a record could not be stored whatever the database did."""

    @property
    def trouble(self) -> Message | None:
        """What keeps records, or files of finished hours, from being stored; None if nothing."""
        busy = self._busy
        if self._failure is None and busy is not None:
            lasts_s = time.monotonic() - busy[0]
            if lasts_s > _SILENT_S:
                return Message(busy[1], {"lasts_s": lasts_s})
        return self._failure or self._unclosed

    def attempt(self, expired: Callable[[], bool] = lambda: False) -> bool:
        """Store everything that waits, and keep house."""
        if self._store is None and not self._open():
            return False
        self._write(expired)
        if self._store is not None and not expired():
            self._keep_house(self._store)
        return self._store is not None

    def close(self) -> None:
        """End the connection, and what is being closed: it is begun again next time."""
        if self._closing is not None:
            self._closing.end()
            self._closing = None
        if self._store is not None:
            self._store.close()
            self._store = None

    def _open(self) -> bool:
        self._busy = (time.monotonic(), "failure-history_opening")
        try:
            store = open_store(
                self._url,
                self._key,
                self._settings,
                utc=self._clock.utc(),
                watch=self._watch,
            )
        except (*_FAILURES, ThermaxisError) as error:
            self._fail(error)
            return False
        try:
            self._backlog.put_back(store.stored_seq())
        except _FAILURES as error:
            store.close()
            self._fail(error)
            return False
        self._store, self._busy = store, None
        while self._watch.remarks:
            self._state("alarm", self._watch.remarks.pop(0))
        return True

    def _write(self, expired: Callable[[], bool]) -> None:
        """Store everything that waits, some at a time."""
        while self._store is not None:
            items = self._backlog.take(self._most)
            if not items:
                self._most = _MOST_AT_ONCE
                return
            self._busy = (time.monotonic(), "failure-database_silent")
            try:
                self._store.write(items)
            except _REFUSALS as error:
                if len(items) == 1:
                    self.unusable = printable_cause(error)
                    self._backlog.drop_taken()
                self._most = 1
                self._drop_store(error)
                return
            except _FAILURES as error:
                self._drop_store(error)
                return
            if not self._store.in_place:
                self._watch.checked = False
                self._drop_store(_ReplacedError())
                return
            self._recovered()  # before, so that what it says is not overtaken by "all is stored"
            self._backlog.stored()
            if expired():
                return

    def _keep_house(self, store: Store) -> None:
        """Let finished parts be written, and delete what is in them, a little each time."""
        self._busy = (time.monotonic(), "failure-database_silent")
        try:
            self._close_parts(store)
            while store.delete_closed() and not self._backlog.arrived.is_set():
                pass
            now_s = time.monotonic()
            if now_s >= self._retire_s:
                store.retire(self._settings.retention_days)
                self._retire_s = now_s + _RETIRE_EVERY_S
        except SQLAlchemyError as error:
            self._drop_store(error)
        except OSError as error:
            self._leave_unclosed(printable_cause(error))
            self._retire_s = time.monotonic() + _RETIRE_EVERY_S
        self._busy = None

    def _close_parts(self, store: Store) -> None:
        password = self._settings.password.reveal()
        while time.monotonic() >= self._close_s:
            if self._closing is None:
                order = store.finished()
                if order is None:
                    return
                if not self._beside:
                    self._close_here(store, order, password)
                    continue
                self._closing = Closing(order, password)
            if not self._closing.ended():
                return
            order, (written, why) = self._closing.order, self._closing.result()
            self._closing = None
            if written:
                self._closed(store, order, why)
            else:
                self._leave_unclosed(why)

    def _close_here(self, store: Store, order: Order, password: str) -> None:
        try:
            close(order, password)
        except (ThermaxisError, OSError) as error:
            self._leave_unclosed(printable_cause(error))
        else:
            self._closed(store, order, "; ".join(join_days(order)))

    def _closed(self, store: Store, order: Order, unjoined: str) -> None:
        self._unclosed = None
        if unjoined not in {"", self._unjoined}:
            self._state("alarm", Message("event-day_unjoined", {"detail": unjoined}))
        self._unjoined = unjoined
        store.closed(order)
        while store.delete_closed() and not self._backlog.arrived.is_set():
            pass

    def _leave_unclosed(self, why: str) -> None:
        """Try again later; rows stay where they are."""
        self._close_s = time.monotonic() + _CLOSE_AGAIN_S
        first = self._unclosed is None
        self._unclosed = Message("failure-part_unwritten", {"detail": why})
        if first:
            self._state("alarm", Message("event-part_unwritten", {"detail": why}))

    def _drop_store(self, error: BaseException) -> None:
        self.close()
        self._fail(error)

    def _fail(self, error: BaseException) -> None:
        cause = error.orig if isinstance(error, DBAPIError) else error
        if is_damage(cause):
            self._watch.damage = printable_cause(cause or error)
        if self._failure is None:
            self._failed_since_s = time.monotonic()
        self._failure, self._busy = _failure_of(error, cause or error), None

    def _recovered(self) -> None:
        """Say in the history what was missing from it."""
        self._busy = None
        loss = self._backlog.take_loss()
        if self._failure is not None:
            lasted_s = time.monotonic() - self._failed_since_s
            self._state(
                "connection",
                Message("event-not_stored", {"lasted_s": lasted_s, "why": self._failure}),
                {"duration_s": round(lasted_s, 1)},
            )
            self._failure = None
        if loss:
            self._state(
                "loss",
                Message("event-records_lost", {"cycles": loss.cycles, "events": loss.events}),
                {
                    "cycles": loss.cycles,
                    "events": loss.events,
                    "first": from_us(loss.first_us).isoformat(),
                    "last": from_us(loss.last_us).isoformat(),
                    "unusable": self.unusable,
                },
                loss,
            )
            self.unusable = ""

    def _state(
        self,
        kind: str,
        message: Message,
        details: Mapping[str, str | float | bool | None] | None = None,
        states: Loss = NO_LOSS,
    ) -> None:
        record = EventRecord.of(self._clock.utc(), kind, "", message, details)
        self._backlog.add_event(pack_event(record), states)
