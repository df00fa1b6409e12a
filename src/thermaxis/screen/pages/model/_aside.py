"""Work with files that may hang, beside the pages: a network folder waits as long as it likes."""

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar, final

from thermaxis.errors import ThermaxisError

T = TypeVar("T")


@final
class Aside:
    """Runs calls in threads of their own, and waits for them only so long.

    A thread that hangs cannot be ended: it is left behind, and ends with the program. There are at
    most so many; while all of them hang, nobody waits.
    """

    def __init__(self, limit_s: float, most: int) -> None:
        self._limit_s = limit_s
        self._places = threading.BoundedSemaphore(most)

    async def run(self, work: Callable[[], T]) -> T:
        """Return what a call returns."""
        if not self._places.acquire(blocking=False):
            raise TimeoutError
        found: Future[T] = Future()
        found.set_running_or_notify_cancel()

        def run() -> None:
            try:
                found.set_result(work())
            except (ThermaxisError, OSError) as error:
                found.set_exception(error)
            finally:
                self._places.release()
                if not found.done():  # a fault of the program: the thread ends with it
                    found.set_exception(OSError("the call has failed"))

        threading.Thread(target=run, name="aside", daemon=True).start()
        async with asyncio.timeout(self._limit_s):
            return await asyncio.wrap_future(found)
