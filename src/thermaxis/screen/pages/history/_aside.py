"""Work that may hang, beside the pages: a folder or database in a network."""

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar, final

from thermaxis.errors import ThermaxisError

T = TypeVar("T")


def aside(work: Callable[[], T]) -> asyncio.Future[T]:
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

    threading.Thread(target=run, name="aside", daemon=True).start()
    return asyncio.wrap_future(found)


@final
class Aside:
    """Runs calls beside, and waits for them only so long.

    A thread that hangs is left behind. There are at most so many; while all of them hang, nobody
    waits.
    """

    def __init__(self, limit_s: float, most: int) -> None:
        self._limit_s = limit_s
        self._places = threading.BoundedSemaphore(most)

    async def run(self, work: Callable[[], T]) -> T:
        """Return what a call returns."""
        if not self._places.acquire(blocking=False):
            raise TimeoutError

        def placed() -> T:
            try:
                return work()
            finally:
                self._places.release()

        async with asyncio.timeout(self._limit_s):
            return await aside(placed)
