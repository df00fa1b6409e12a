"""The historian: cycles and events to a database, by a thread of its own.

`SqlHistorian.record` gathers the values of a cycle and returns; a thread writes what waits, twice a
second, and lets finished hours become files. Nothing that happens to the database reaches the
loop: what cannot be written waits in memory up to a bound and is written later, and what is lost is
counted, shown and recorded.
"""

import asyncio
import threading
import time
from collections.abc import Sequence
from typing import Final, final

from thermaxis.codes import Message
from thermaxis.runtime._ports import Clock, CycleRecord, EventRecord, Historian, HistorianStatus
from thermaxis.runtime.history._backlog import Backlog, Loss
from thermaxis.runtime.history._columns import UNPACKABLE, Columns, to_us
from thermaxis.runtime.history._database import parse_url, printable_cause
from thermaxis.runtime.history._settings import HistorianSettings
from thermaxis.runtime.history._writer import Writer, pack_event

_IDLE_S: Final = 5.0
_LAST_RETRY_S: Final = 0.1


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
        self._settings = settings
        self._clock = clock
        self._columns = Columns()
        self._backlog = Backlog(settings.largest_waiting_bytes)
        self._writer = Writer(
            parse_url(url, settings.password.reveal()), settings, clock, self._backlog
        )
        self._thread: threading.Thread | None = None
        self._begun = False
        self._closing = threading.Event()
        self._hurry = threading.Event()
        self._end_s = 0.0

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
            self._backlog.add_cycle(self._columns.row_of(record))
        except UNPACKABLE as error:
            self._refuse(error, Loss(cycles=1))

    def event(self, event: EventRecord) -> None:
        """Take an event."""
        try:
            self._backlog.add_event(pack_event(event))
        except (*UNPACKABLE, RecursionError) as error:
            self._refuse(error, Loss(events=1))

    def _refuse(self, error: BaseException, loss: Loss) -> None:
        now_us = to_us(self._clock.utc())
        self._writer.unusable = printable_cause(error)
        self._backlog.add_loss(loss._replace(first_us=now_us, last_us=now_us))

    @property
    def status(self) -> HistorianStatus:
        """How it fares."""
        failure = self._writer.trouble
        thread = self._thread
        if thread is not None and not thread.is_alive() and not self._closing.is_set():
            failure = Message("failure-historian_ended")
        waiting, lost = self._backlog.waiting, self._backlog.lost
        return HistorianStatus(failure is None, waiting, lost, failure)

    async def drain(self, deadline_s: float) -> bool:
        """Wait so long until everything that was taken is stored; return whether it is."""
        self._hurry.set()
        try:
            return await asyncio.to_thread(self._backlog.empty.wait, deadline_s)
        finally:
            if not self._closing.is_set():
                self._hurry.clear()

    async def close(self, deadline_s: float) -> None:
        """Store what is left, as far as a time allows, and end; the rest counts as lost."""
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
            self._writer.close()

    def _finished(self) -> bool:
        return self._closing.is_set() and (not self._backlog.waiting or self._expired())

    def _expired(self) -> bool:
        return self._closing.is_set() and time.monotonic() >= self._end_s

    def _turn(self) -> None:
        """Wait for something to store, let it gather, store it; wait a while if it fails."""
        if self._begun and self._backlog.arrived.wait(_IDLE_S):
            self._hurry.wait(self._settings.batch_s)
        self._begun = self._writer.attempt(self._expired)
        if not self._begun:
            pause_s = self._settings.retry_s
            if not self._closing.wait(pause_s):
                return
            time.sleep(min(_LAST_RETRY_S, pause_s))
