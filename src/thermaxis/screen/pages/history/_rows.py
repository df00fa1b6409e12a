"""The historian, asked by the pages: one thread, one reader, a time limit; nothing is written."""

import asyncio
import math
import threading
import time
from collections.abc import AsyncGenerator, Awaitable, Callable
from concurrent.futures import Future
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar, cast, final

from starlette.datastructures import State
from starlette.requests import HTTPConnection

from thermaxis.codes import Message, Value
from thermaxis.errors import ThermaxisError
from thermaxis.runtime import Clock
from thermaxis.screen.access import RefusedError, parts_of, visitor_of

if TYPE_CHECKING:
    from thermaxis.runtime.history import HistoryReader

T = TypeVar("T")
_SQLITE: Final = "sqlite:"
_BUSY: Final = Message("history-busy")
_LIMIT_S: Final = 8.0
_MOST_WAITING: Final = 24
_MOST_OF_ONE: Final = 8
_UNAVAILABLE: Final = 503


@final
class NoHistoryError(Exception):
    """The history does not answer."""

    def __init__(self, message: Message) -> None:
        super().__init__(message.code)
        self.message = message


def cause_for_people(error: ThermaxisError | OSError, url: str) -> Value:
    """Return why the history cannot be read, and nothing of where it lies.

    Folders of this computer, and host and user of a database, are for whoever looks after it: the
    commands of ``thermaxis history`` say them at the terminal.
    """
    if not url.startswith(_SQLITE):
        return Message("history-no_database")
    if isinstance(error, ThermaxisError):
        return Message(error.message.code, error.message.values)
    return error.strerror or Message("history-fails")


@final
@dataclass(frozen=True, slots=True)
class _Question(Generic[T]):
    work: "Callable[[HistoryReader], T]"
    answer: "Future[T]" = field(default_factory=Future)


@dataclass(slots=True)
class _Turn:
    """Questions of one visitor: one is asked at a time."""

    lock: asyncio.Lock = field(default_factory=asyncio.Lock)
    """Held by the one that is asked."""
    count: int = 0
    """How many there are. [1]"""


def _opened(url: str, password: str) -> "HistoryReader":
    from thermaxis.runtime.history import HistoryReader  # noqa: PLC0415 - heavy

    return HistoryReader(url, password)


@final
class History:
    """Asks the historian in a thread of its own, so that a slow database stops no page.

    One reader is kept open. It is opened anew when another file has taken the place of the one
    that is read, and after every error. Waiting is counted in real time, as the thread works in it.
    """

    def __init__(
        self,
        url: str,
        password: str = "",
        *,
        limit_s: float = _LIMIT_S,
        opened: "Callable[[str, str], HistoryReader]" = _opened,
    ) -> None:
        self._url = url
        self._password = password
        self._limit_s = limit_s
        self._opened = opened
        self._questions: SimpleQueue[_Question[Any] | None] = SimpleQueue()
        self._thread: threading.Thread | None = None
        self._since_s: float | None = None
        self._reader: HistoryReader | None = None
        self._ended = False
        self._turns: dict[str, _Turn] = {}
        self._lock = threading.Lock()
        self._current: _Question[Any] | None = None
        self._interrupted = False

    @property
    def hangs(self) -> bool:
        """Whether the thread has been busy with one question for longer than the limit."""
        since_s = self._since_s
        return since_s is not None and time.monotonic() - since_s > self._limit_s

    async def ask(self, work: "Callable[[HistoryReader], T]", *, who: str = "") -> T:
        """Return what a question finds; one for which nobody waits any more is interrupted."""
        try:
            async with asyncio.timeout(self._limit_s), self._turn(who):
                return await self._asked(work)
        except TimeoutError:
            raise NoHistoryError(Message("history-hangs", {"limit": self._limit_s})) from None

    @asynccontextmanager
    async def _turn(self, who: str) -> AsyncGenerator[None]:
        if not who:
            yield
            return
        turn = self._turns.setdefault(who, _Turn())
        if turn.count >= _MOST_OF_ONE:
            raise NoHistoryError(_BUSY)
        turn.count += 1
        try:
            async with turn.lock:
                yield
        finally:
            turn.count -= 1
            if not turn.count:
                del self._turns[who]

    async def _asked(self, work: "Callable[[HistoryReader], T]") -> T:
        if self.hangs:
            raise NoHistoryError(Message("history-hangs", {"limit": self._limit_s}))
        if self._ended or self._questions.qsize() >= _MOST_WAITING:
            raise NoHistoryError(_BUSY)
        question = _Question(work)
        self._questions.put(question)
        if self._thread is None or not self._thread.is_alive():
            self._thread = threading.Thread(target=self._run, name="history", daemon=True)
            self._thread.start()
        try:
            return await asyncio.wrap_future(question.answer)
        except (ThermaxisError, OSError) as error:
            why = cause_for_people(error, self._url)
            raise NoHistoryError(Message("history-unreadable", {"why": why})) from error
        finally:
            if not question.answer.done() and not question.answer.cancel():
                # in a thread: a database's server is told through the network
                asyncio.get_running_loop().run_in_executor(None, self._interrupt, question)

    def _interrupt(self, question: _Question[Any]) -> None:
        """End a question that is being asked; the reader is opened anew after it."""
        with self._lock:
            if self._current is question:
                self._interrupted = True
                if self._reader is not None:
                    self._reader.interrupt()

    async def close(self, deadline_s: float = 1.0) -> None:
        """End the thread; one that hangs is left behind and ends with the program."""
        self._ended = True
        self._questions.put(None)
        if self._thread is not None:
            await asyncio.to_thread(self._thread.join, deadline_s)

    # ---- the thread's side ----------------------------------------------------------------------

    def _run(self) -> None:
        try:
            while (question := self._questions.get()) is not None:
                with self._lock:
                    self._current = question
                if question.answer.set_running_or_notify_cancel():
                    self._answer(question)
        finally:
            self._close_reader()

    def _answer(self, question: _Question[Any]) -> None:
        self._since_s = time.monotonic()
        try:
            if self._reader is not None and not self._reader.in_place:
                self._close_reader()
            reader = self._open_reader() if self._reader is None else self._reader
            question.answer.set_result(question.work(reader))
        except (ThermaxisError, OSError) as error:
            self._close_reader()
            question.answer.set_exception(error)
        finally:
            with self._lock:
                self._current = None
                interrupted, self._interrupted = self._interrupted, False
            if interrupted:
                self._close_reader()
            self._since_s = None
            if not question.answer.done():  # a fault of the program: the thread ends with it
                question.answer.set_exception(OSError("the reader has failed"))

    def _open_reader(self) -> "HistoryReader":
        reader = self._opened(self._url, self._password)
        with self._lock:
            self._reader = reader
            if self._interrupted:  # nobody waits any more
                reader.interrupt()
        return reader

    def _close_reader(self) -> None:
        with self._lock:
            reader, self._reader = self._reader, None
        if reader is not None:
            reader.close()


@final
class Kept(Generic[T]):
    """One answer for everybody who asks within a time, however many they are."""

    def __init__(self, make: Callable[[], Awaitable[T]], clock: Clock, kept_s: float) -> None:
        self._make = make
        self._clock = clock
        self._kept_s = kept_s
        self._asked_s = -math.inf
        self._task: asyncio.Future[T] | None = None

    async def get(self) -> T:
        """Return the answer; it is made anew where it is too old."""
        now_s = self._clock.monotonic_s()
        task = self._task
        if task is None or (task.done() and now_s - self._asked_s >= self._kept_s):
            task = asyncio.ensure_future(self._make())
            self._task, self._asked_s = task, now_s
        return await asyncio.shield(task)


def history_of(connection: HTTPConnection) -> History:
    """Return the history that all pages of a program share; it is made at the first question."""
    state = connection.app.state
    if not hasattr(state, "history"):
        configuration = parts_of(connection).configuration
        password = configuration.historian.password.reveal()
        state.history = History(configuration.historian.url, password)
    return cast("History", state.history)


async def found_in_history(connection: HTTPConnection, work: "Callable[[HistoryReader], T]") -> T:
    """Return what a question of whoever asks finds: a log-in, or the address of who only looks."""
    name = visitor_of(connection).name
    asker = name or f"@{'' if connection.client is None else connection.client.host}"
    try:
        return await history_of(connection).ask(work, who=asker)
    except NoHistoryError as error:
        raise RefusedError(_UNAVAILABLE, error.message.code, **error.message.values) from error


async def close_history(state: State) -> None:
    """Close the history of a program that ends, if anybody has asked for it."""
    if hasattr(state, "history"):
        await cast("History", state.history).close()
