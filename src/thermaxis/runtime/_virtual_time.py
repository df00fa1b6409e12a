"""An event loop whose time jumps when everybody waits: hours of the runtime in seconds.

What waits for a time is woken in the right order at exactly that time, and nothing takes any
time. Sockets inside the program and work in threads are waited for in real time, without the
virtual time going on meanwhile, so that no time-out fires because a thread was slow.
"""

import asyncio
import selectors
from collections.abc import Callable, Coroutine
from concurrent.futures import Executor
from datetime import UTC, datetime, timedelta
from typing import Any, Final, TypeVar, final

T = TypeVar("T")

START_S: Final = 1000.0
"""Virtual time at which every loop begins. Not 0, which code mistakes for nothing. [s]"""
START_UTC: Final = datetime(2030, 1, 1, tzinfo=UTC)
"""Time of day at which a virtual clock begins, unless another is stated."""
LONGEST_STANDSTILL_S: Final = 10.0
"""Real time after which waiting for something that no time and no thread will bring is called a
deadlock. [s]"""


@final
class _JumpingSelector(selectors.DefaultSelector):
    """Looks at the sockets without waiting; where the loop would wait, time jumps."""

    def __init__(self) -> None:
        super().__init__()
        self.now_s = START_S
        self.threads = 0

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """Return what is ready; let the virtual time go on where nothing is. [s]"""
        ready = super().select(0)
        if ready or (timeout is not None and timeout <= 0.0):
            return ready
        if self.threads:
            return super().select(LONGEST_STANDSTILL_S)
        if timeout is not None:
            self.now_s += timeout
            return []
        ready = super().select(LONGEST_STANDSTILL_S)
        if not ready:
            raise RuntimeError("everybody waits, and nothing will ever happen")
        return ready


@final
class VirtualTimeLoop(asyncio.SelectorEventLoop):
    """An event loop in virtual time; see `run_in_virtual_time`."""

    def __init__(self) -> None:
        self._jumping = _JumpingSelector()
        super().__init__(self._jumping)

    def time(self) -> float:
        """Return the virtual time. [s]"""
        return self._jumping.now_s

    def run_in_executor(
        self, executor: Executor | None, func: Callable[..., T], *args: Any
    ) -> "asyncio.Future[T]":
        """Run a function in a thread; the virtual time stands still until it is done."""
        self._jumping.threads += 1
        future = super().run_in_executor(executor, func, *args)
        future.add_done_callback(self._thread_ended)
        return future

    def _thread_ended(self, _future: "asyncio.Future[Any]") -> None:
        self._jumping.threads -= 1


def run_in_virtual_time(coroutine: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine to its end in virtual time.

    Raises
    ------
    RuntimeError
        If everybody waits for something that will never happen.
    """
    with asyncio.Runner(loop_factory=VirtualTimeLoop) as runner:
        return runner.run(coroutine)


@final
class VirtualClock:
    """A clock of the virtual time; its time of day can be set, as clocks of computers are.

    Parameters
    ----------
    start : datetime
        Time of day at the start of the loop, aware.
    """

    def __init__(self, start: datetime = START_UTC) -> None:
        self._start = start
        self._loop: asyncio.AbstractEventLoop | None = None

    def monotonic_s(self) -> float:
        """Return the virtual time; a thread is told that of the loop that asked last. [s]"""
        try:
            self._loop = asyncio.get_running_loop()
        except RuntimeError:
            if self._loop is None:
                raise
        return self._loop.time()

    def utc(self) -> datetime:
        """Return the time of day in UTC."""
        return self._start + timedelta(seconds=self.monotonic_s() - START_S)

    def change_time_of_day(self, by_s: float) -> None:
        """Set the time of day forward, or backward, as a time server would. [s]"""
        self._start += timedelta(seconds=by_s)

    async def sleep_until(self, monotonic_s: float) -> None:
        """Wait until a virtual time; return at once if it has passed."""
        await asyncio.sleep(max(0.0, monotonic_s - self.monotonic_s()))
