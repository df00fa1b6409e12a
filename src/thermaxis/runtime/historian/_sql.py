"""The historian: cycles and events to a database, by a thread of its own.

`SqlHistorian.record` makes a row of bytes and returns; a thread writes what has gathered, twice a
second. Nothing that happens to the database reaches the loop: what cannot be written waits in
memory up to a bound and is written later, and what is lost is counted, shown and recorded.
"""

import asyncio
import json
import sqlite3
import threading
import time
import uuid
from collections.abc import Mapping, Sequence
from typing import Final, final

from sqlalchemy.exc import DataError, DBAPIError, IntegrityError, SQLAlchemyError

from thermaxis.errors import ThermaxisError
from thermaxis.runtime._ports import Clock, CycleRecord, EventRecord, Historian, HistorianStatus
from thermaxis.runtime.historian._backlog import NO_LOSS, Backlog, Loss, PackedEvent
from thermaxis.runtime.historian._database import parse_url
from thermaxis.runtime.historian._integrity import is_damage
from thermaxis.runtime.historian._rows import (
    UNPACKABLE,
    RowPacker,
    from_us,
    printable_cause,
    storable,
    to_us,
)
from thermaxis.runtime.historian._settings import HistorianSettings
from thermaxis.runtime.historian._store import Store, open_store

_MOST_AT_ONCE: Final = 1000
_IDLE_S: Final = 5.0
_RETIRE_EVERY_S: Final = 3600.0
_SILENT_S: Final = 10.0
_LONGEST_TEXT: Final = 4000
_LONGEST_DETAILS: Final = 20_000
_FAILURES = (SQLAlchemyError, sqlite3.Error, OSError)
_REFUSALS = (DataError, IntegrityError, ValueError, TypeError, OverflowError)


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
    url : str
        ``sqlite:///file`` or ``postgresql+psycopg://user@host/database``.
    settings : HistorianSettings
        Retention, password, bounds.
    clock : Clock
        The time of day of its own events. Its waiting is done in real time.

    Raises
    ------
    ConfigurationError
        If the URL is none that a history can be kept in.
    """

    def __init__(self, url: str, settings: HistorianSettings, clock: Clock) -> None:
        self._url = parse_url(url, settings.password)
        self._settings = settings
        self._clock = clock
        self._packer = RowPacker()
        self._backlog = Backlog(settings.largest_waiting_bytes)
        self._key = uuid.uuid4().hex
        self._thread: threading.Thread | None = None
        self._closing = threading.Event()
        self._hurry = threading.Event()
        self._end_s = 0.0
        # Written by the thread, read by the loop; each is replaced whole.
        self._trouble = ""
        self._trouble_since_s = 0.0
        self._busy: tuple[float, str] | None = None
        self._unusable = ""
        # The thread's own.
        self._store: Store | None = None
        self._checked = False
        self._damage = ""
        self._most = _MOST_AT_ONCE
        self._retire_s = 0.0

    # ---- the loop's side ------------------------------------------------------------------------

    async def open(self, outputs: Sequence[str], channels: Sequence[str]) -> None:
        """Begin to store; a database that is not there is waited for.

        Parameters
        ----------
        outputs : sequence of str
            Names of the outputs.
        channels : sequence of str
            Names of the model's channels.
        """
        self._packer.outputs = tuple(outputs)
        self._packer.channels = tuple(channels)
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="historian", daemon=True)
            self._thread.start()

    def record(self, record: CycleRecord) -> None:
        """Take a cycle; one that is not what its fields promise counts as lost.

        Parameters
        ----------
        record : CycleRecord
            The cycle.
        """
        try:
            self._backlog.add_cycle(self._packer.pack(record))
        except UNPACKABLE as error:
            self._refuse(error, Loss(cycles=1))

    def event(self, event: EventRecord) -> None:
        """Take an event.

        Parameters
        ----------
        event : EventRecord
            The event.
        """
        try:
            self._backlog.add_event(_packed_event(event))
        except (*UNPACKABLE, RecursionError) as error:
            self._refuse(error, Loss(events=1))

    def _refuse(self, error: BaseException, loss: Loss) -> None:
        now_us = to_us(self._clock.utc())
        self._unusable = printable_cause(error)
        self._backlog.add_loss(loss._replace(first_us=now_us, last_us=now_us))

    @property
    def status(self) -> HistorianStatus:
        """How it fares."""
        waiting, lost, text = self._backlog.waiting, self._backlog.lost, self._trouble
        busy = self._busy
        if not text and busy is not None and time.monotonic() - busy[0] > _SILENT_S:
            text = busy[1]
        thread = self._thread
        if thread is not None and not thread.is_alive() and not self._closing.is_set():
            text = "the historian's thread has ended"
        storing = not text
        sentences = [text] if text else []
        if text and waiting:
            sentences.append(f"{waiting} records wait in memory")
        if lost:
            sentences.append(f"{lost} records were lost")
        return HistorianStatus(storing, waiting, lost, "; ".join(sentences))

    async def drain(self, deadline_s: float) -> bool:
        """Wait until everything that was taken is stored.

        Parameters
        ----------
        deadline_s : float
            Longest time to wait. [s]

        Returns
        -------
        bool
            Whether everything is stored.
        """
        self._hurry.set()
        try:
            return await asyncio.to_thread(self._backlog.empty.wait, deadline_s)
        finally:
            if not self._closing.is_set():
                self._hurry.clear()

    async def close(self, deadline_s: float) -> None:
        """Store what is left, as far as a time allows, and end; the rest counts as lost.

        Parameters
        ----------
        deadline_s : float
            The time. [s]
        """
        self._end_s = time.monotonic() + deadline_s
        self._closing.set()
        self._hurry.set()
        self._backlog.arrived.set()
        if self._thread is not None:
            await asyncio.to_thread(self._thread.join, deadline_s)
        self._backlog.give_up()

    # ---- the thread's side ----------------------------------------------------------------------

    def _run(self) -> None:
        try:
            while not self._finished():
                self._turn()
        finally:
            if self._store is not None:
                self._store.close()
                self._store = None

    def _finished(self) -> bool:
        if not self._closing.is_set():
            return False
        return not self._backlog.waiting or time.monotonic() >= self._end_s

    def _turn(self) -> None:
        """Open if need be; wait for something to store, let it gather, store it."""
        if self._store is None and not self._open():
            self._closing.wait(self._settings.retry_s)
            if self._closing.is_set():  # a few last attempts, but no hurry
                time.sleep(min(0.1, self._settings.retry_s))
            return
        if self._backlog.arrived.wait(_IDLE_S):
            self._hurry.wait(self._settings.batch_s)
            self._write()
        if self._store is not None:
            self._keep_house(self._store)

    def _open(self) -> bool:
        self._busy = (time.monotonic(), "the history is being opened and checked")
        try:
            opened = open_store(
                self._url,
                self._key,
                check_s=self._settings.check_s,
                utc=self._clock.utc(),
                checked=self._checked,
                damage=self._damage,
            )
        except (*_FAILURES, ThermaxisError) as error:
            self._fail(error)
            return False
        try:
            self._backlog.put_back(opened.store.stored_seq())
        except _FAILURES as error:
            opened.store.close()
            self._fail(error)
            return False
        self._store, self._checked, self._damage, self._busy = opened.store, True, "", None
        for remark in opened.remarks:
            self._state("alarm", remark)
        return True

    def _write(self) -> None:
        """Store everything that waits, some at a time."""
        while self._store is not None:
            items = self._backlog.take(self._most)
            if not items:
                self._most = _MOST_AT_ONCE
                return
            self._busy = (time.monotonic(), "the database does not answer")
            try:
                self._store.write(items, self._packer)
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
            if not self._store.in_place:
                self._checked = False
                self._drop_store(OSError("the file of the history was removed or replaced"))
                return
            self._backlog.stored()
            self._recovered()
            if self._closing.is_set() and time.monotonic() >= self._end_s:
                return

    def _keep_house(self, store: Store) -> None:
        """Make blocks and delete what is old, a little each time."""
        now_s = time.monotonic()
        try:
            while store.close_block() and not self._backlog.arrived.is_set():
                pass
            if now_s >= self._retire_s and not store.retire(self._settings.retention_days):
                self._retire_s = now_s + _RETIRE_EVERY_S
        except _FAILURES as error:
            self._drop_store(error)

    def _drop_store(self, error: BaseException) -> None:
        if self._store is not None:
            self._store.close()
            self._store = None
        self._fail(error)

    def _fail(self, error: BaseException) -> None:
        cause = error.orig if isinstance(error, DBAPIError) else error
        if is_damage(cause):
            self._damage = printable_cause(cause or error)
        if isinstance(error, ThermaxisError):
            text = str(error)
        else:
            text = f"the history cannot be written ({printable_cause(cause or error)})"
        if not self._trouble:
            self._trouble_since_s = time.monotonic()
        self._trouble, self._busy = text, None

    def _recovered(self) -> None:
        """Say in the history what was missing from it."""
        self._busy = None
        loss = self._backlog.take_loss()
        if self._trouble:
            lasted_s = time.monotonic() - self._trouble_since_s
            self._state(
                "connection",
                f"The history could not be written for {lasted_s:.1f} s: {self._trouble}",
                {"duration_s": round(lasted_s, 1)},
            )
            self._trouble = ""
        if loss:
            self._state(
                "loss",
                f"{loss.cycles} cycles and {loss.events} events are not in the history",
                {
                    "cycles": loss.cycles,
                    "events": loss.events,
                    "first": from_us(loss.first_us).isoformat(),
                    "last": from_us(loss.last_us).isoformat(),
                    "unusable": self._unusable,
                },
                loss,
            )
            self._unusable = ""

    def _state(
        self,
        kind: str,
        text: str,
        details: Mapping[str, str | float | bool | None] | None = None,
        states: Loss = NO_LOSS,
    ) -> None:
        record = EventRecord(self._clock.utc(), kind, "", text, details or {})
        self._backlog.add_event(_packed_event(record), states)


def _packed_event(event: EventRecord) -> PackedEvent:
    details = json.dumps(dict(event.details))
    if len(details) > _LONGEST_DETAILS:
        details = json.dumps({"cut": details[:1000]})
    return PackedEvent(
        to_us(event.utc),
        storable(event.kind, 100),
        storable(event.who, 400),
        storable(event.text, _LONGEST_TEXT),
        details,
    )
