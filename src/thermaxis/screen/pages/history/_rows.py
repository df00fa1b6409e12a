"""The historian, asked by the pages: one reader, a time limit; nothing is written."""

import asyncio
import contextlib
import math
import threading
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, Generic, TypeVar, cast, final

from starlette.datastructures import State
from starlette.requests import HTTPConnection

from thermaxis.codes import Message, Value
from thermaxis.errors import ThermaxisError
from thermaxis.runtime import Clock
from thermaxis.screen.access import parts_of, visitor_of
from thermaxis.screen.pages.history._worker_thread import WorkerThread
from thermaxis.web import RefusedError

if TYPE_CHECKING:
    from thermaxis.runtime.history import HistoryReader

T = TypeVar("T")
_SQLITE: Final = "sqlite:"
_BUSY: Final = Message("history-busy")
_LIMIT_S: Final = 8.0
_MOST_VISITORS: Final = 24
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
    """Asks the historian beside the pages, one question at a time: a slow database stops no page.

    One reader is kept open. It is opened anew when another file has taken the place of the one
    that is read, and after every error.
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
        self._worker = WorkerThread(limit_s)
        self._reader: HistoryReader | None = None
        self._telling = threading.Lock()  # a reader is not closed while it is told to end
        self._asked: threading.Event | None = None
        self._turns: dict[str, _Turn] = {}
        self._ended = False

    async def ask(self, work: "Callable[[HistoryReader], T]", *, who: str = "") -> T:
        """Return what a question finds; one for which nobody waits any more is interrupted."""
        given_up = threading.Event()

        def answered() -> T:
            return self._answered(work, given_up)

        def give_up() -> None:
            given_up.set()
            threading.Thread(target=self._interrupt, args=[given_up], daemon=True).start()

        try:
            async with asyncio.timeout(self._limit_s), self._turn(who):
                return await self._worker.run(answered, give_up)
        except TimeoutError:
            raise NoHistoryError(Message("history-hangs", {"limit": self._limit_s})) from None
        except (ThermaxisError, OSError) as error:
            why = cause_for_people(error, self._url)
            raise NoHistoryError(Message("history-unreadable", {"why": why})) from error

    @asynccontextmanager
    async def _turn(self, who: str) -> AsyncGenerator[None]:
        """Let one question of each visitor wait for the database, and a few wait for that one."""
        turn = self._turns.setdefault(who, _Turn())
        if self._ended or turn.count >= _MOST_OF_ONE or len(self._turns) > _MOST_VISITORS:
            if not turn.count:
                del self._turns[who]
            raise NoHistoryError(_BUSY)
        turn.count += 1
        try:
            async with turn.lock:
                yield
        finally:
            turn.count -= 1
            if not turn.count:
                del self._turns[who]

    def _answered(self, work: "Callable[[HistoryReader], T]", given_up: threading.Event) -> T:
        """Ask, in a thread; the reader is kept for the next question where all went well."""
        self._asked = given_up
        try:
            if self._reader is not None and not self._reader.in_place:
                self._close_reader()
            reader = self._reader = self._reader or self._opened(self._url, self._password)
            if given_up.is_set():  # while it was opened
                reader.interrupt()
            return work(reader)
        except BaseException:
            given_up.set()
            raise
        finally:
            with self._telling:
                self._asked = None
                if given_up.is_set():
                    self._close_reader()

    def _interrupt(self, given_up: threading.Event) -> None:
        """End a question in the database too, in a thread: a server is told by network."""
        with self._telling:
            if self._asked is given_up and self._reader is not None:
                self._reader.interrupt()

    def _close_reader(self) -> None:
        reader, self._reader = self._reader, None
        if reader is not None:
            reader.close()

    async def close(self, deadline_s: float = 1.0) -> None:
        """End the reader; a question that hangs is left behind and ends with the program."""
        self._ended = True
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(deadline_s):
                await self._worker.run(self._close_reader)


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
