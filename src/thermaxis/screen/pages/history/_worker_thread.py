"""Work that may hang, beside the pages: a folder or database in a network."""

import asyncio
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, TypeVar, final

from thermaxis.errors import ThermaxisError

T = TypeVar("T")


def _in_thread(work: Callable[[], T]) -> asyncio.Future[T]:
    """Run a call in a thread of its own, which ends with the program if it hangs.

    A fault of the program ends the thread, and is an OSError for who waits.
    """
    found: Future[T] = Future()
    found.set_running_or_notify_cancel()

    def run() -> None:
        try:
            found.set_result(work())
        except (ThermaxisError, OSError) as error:
            found.set_exception(error)
        finally:
            if not found.done():
                found.set_exception(OSError("the call has failed"))

    threading.Thread(target=run, name="worker", daemon=True).start()
    waited = asyncio.wrap_future(found)
    waited.add_done_callback(lambda ended: ended.cancelled() or ended.exception())  # or nobody asks
    return waited


@final
class WorkerThread:
    """Runs calls beside the pages in a thread, one at a time, and waits for each only so long.

    A call that hangs keeps its thread; who comes meanwhile is told so at once. Waiting is counted
    in real time, as a thread works in it.
    """

    def __init__(self, limit_s: float) -> None:
        self._limit_s = limit_s
        self._turn = asyncio.Lock()
        self._running: asyncio.Future[Any] | None = None
        self._since_s = 0.0

    @property
    def hangs(self) -> bool:
        """Whether the call that runs has taken longer than the limit."""
        running = self._running is not None and not self._running.done()
        return running and time.monotonic() - self._since_s > self._limit_s

    async def run(self, work: Callable[[], T], give_up: Callable[[], None] = lambda: None) -> T:
        """Return what a call returns.

        Parameters
        ----------
        give_up : callable
            Called once nobody waits any more for the call that runs.

        Raises
        ------
        TimeoutError
            If the call, or the one before, takes too long.
        """
        if self.hangs:
            raise TimeoutError
        async with asyncio.timeout(self._limit_s), self._turn:
            if self._running is not None and not self._running.done():  # it was given up
                await asyncio.wait([self._running])
            self._since_s = time.monotonic()
            self._running = running = _in_thread(work)
            try:
                await asyncio.wait([running])
            finally:
                if not running.done():
                    give_up()
            return running.result()
