"""The historian, asked by the pages: one thread, one reader, a time limit; nothing is written."""

import asyncio
import math
import re
import threading
import time
from collections.abc import AsyncGenerator, Awaitable, Callable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar, cast, final

from starlette.datastructures import State
from starlette.requests import HTTPConnection

from thermaxis.errors import ThermaxisError
from thermaxis.runtime._ports import Clock, EventRecord
from thermaxis.screen._access import parts_of, visitor_of

if TYPE_CHECKING:
    from thermaxis.runtime.historian._reading import HistoryReader, Trend
    from thermaxis.screen._words import Words

T = TypeVar("T")
Json = dict[str, Any]
"""An object of JSON."""

EVENT_KINDS: Final = (
    "start",
    "stop",
    "state",
    "request",
    "connection",
    "alarm",
    "commission",
    "loss",
)
"""Kinds of events."""
MARKED: Final = ("state", "request", "alarm")
"""Kinds of events that the operator's trend marks."""
TREND_H: Final = 8.0
"""Length of the operator's trend. [h]"""
TREND_POINTS: Final = 480
"""Its steps: minutes, which the history keeps ready. [1]"""
TREND_KEPT_S: Final = 15.0
"""Time for which the operator's trend is not asked for again. [s]"""
LONGEST: Final = timedelta(days=3660)
"""Longest span of one question."""
MOST_EVENTS: Final = 500
"""Events of one answer: the newest. [1]"""
_SQLITE: Final = "sqlite:///"
_LIMIT_S: Final = 8.0
_MOST_WAITING: Final = 24
_MOST_OF_ONE: Final = 8
_SINGLE_CYCLES: Final = 600
_DIGITS: Final = 7
_UNITS: Final = {"um": "µm", "degC": "°C", "1": ""}
_UNIT_OF_NAME: Final = re.compile(r"_(um|mm|C|c|K|k|rpm|s|V|A|kW|W|Nm|bar|pct)(?:\.spare)?$")
_SHOWN_UNITS: Final = {"um": "µm", "C": "°C", "c": "°C", "k": "K", "rpm": "1/min", "pct": "%"}
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)


@final
class NoHistoryError(ThermaxisError):
    """The history does not answer.

    Parameters
    ----------
    key : str
        Key of the words that say why.
    values : str
        What stands in them.
    """

    def __init__(self, key: str, **values: str) -> None:
        self.key = key
        self.values = values
        super().__init__(f"the history does not answer ({key})", where=values.get("why", ""))


def reason_for_people(error: ThermaxisError | OSError, url: str) -> str:
    """Return why the history cannot be read, and nothing of where it lies.

    Folders of this computer, and host and user of a database, are for whoever looks after it: the
    commands of ``thermaxis history`` say them at the terminal.

    Parameters
    ----------
    error : ThermaxisError or OSError
        The failure.
    url : str
        The database.

    Returns
    -------
    str
        For a file its name and the failure, for a server the failure without what it answered.
    """
    what = error.what if isinstance(error, ThermaxisError) else error.strerror or "it fails"
    if not url.startswith(_SQLITE):
        return what.partition(" (")[0]
    file = Path(url.removeprefix(_SQLITE))
    for folder in (file.parent.resolve(), file.parent):
        what = what.replace(f"{folder}/", "").replace(str(folder), file.parent.name)
    return f"{file.name}: {what}"


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
    from thermaxis.runtime.historian._reading import HistoryReader  # noqa: PLC0415 - heavy

    return HistoryReader(url, password)


@final
class History:
    """Asks the historian in a thread of its own, so that a slow database stops no page.

    One reader is kept open. It is opened anew when another file has taken the place of the one
    that is read, and after every error. Waiting is counted in real time, as the thread works in it.

    Parameters
    ----------
    url : str
        The history.
    password : str
        Password of the database's user; empty where none is needed.
    limit_s : float
        Longest time until an answer, its waiting included. Default: what somebody waits for a
        chart. [s]
    opened : callable
        Opens a reader. Default: `HistoryReader`.
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
        """Return what a question finds; one for which nobody waits any more is interrupted.

        Parameters
        ----------
        work : callable
            The question; it is called in the thread, with the reader.
        who : str
            Who asks, as `asker_of` says: one question of theirs is asked at a time, and a few wait.
            Default: the screen itself.

        Returns
        -------
        object
            Its answer.

        Raises
        ------
        NoHistoryError
            If the history cannot be read, does not answer in time, or too many wait already. While
            an earlier question hangs, nothing more is queued.
        """
        try:
            async with asyncio.timeout(self._limit_s), self._turn(who):
                return await self._asked(work)
        except TimeoutError:
            raise NoHistoryError("history.hangs", limit=f"{self._limit_s:g}") from None

    @asynccontextmanager
    async def _turn(self, who: str) -> AsyncGenerator[None]:
        if not who:
            yield
            return
        turn = self._turns.setdefault(who, _Turn())
        if turn.count >= _MOST_OF_ONE:
            raise NoHistoryError("history.busy")
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
            raise NoHistoryError("history.hangs", limit=f"{self._limit_s:g}")
        if self._ended or self._questions.qsize() >= _MOST_WAITING:
            raise NoHistoryError("history.busy")
        question = _Question(work)
        self._questions.put(question)
        if self._thread is None or not self._thread.is_alive():
            self._thread = threading.Thread(target=self._run, name="history", daemon=True)
            self._thread.start()
        try:
            return await asyncio.wrap_future(question.answer)
        except (ThermaxisError, OSError) as error:
            why = reason_for_people(error, self._url)
            raise NoHistoryError("history.unreadable", why=why) from error
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
        """End the thread; one that hangs is left behind and ends with the program.

        Parameters
        ----------
        deadline_s : float
            Longest time to wait for it. Default: a second. [s]
        """
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
    """One answer for everybody who asks within a time, however many they are.

    Parameters
    ----------
    make : callable
        Makes the answer.
    clock : Clock
        Time.
    kept_s : float
        How long it is kept, counted from the question. [s]
    """

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
    """Return the history that all pages of a program share; it is made at the first question.

    Parameters
    ----------
    connection : HTTPConnection
        A request.

    Returns
    -------
    History
        The history of the machine's configuration; whoever ends the program closes it.
    """
    state = connection.app.state
    if not hasattr(state, "history"):
        configuration = parts_of(connection).configuration
        password = configuration.historian.password.reveal()
        state.history = History(configuration.historian_url, password)
    return cast("History", state.history)


def asker_of(connection: HTTPConnection) -> str:
    """Return who asks: the name of a log-in, or the address of who only looks.

    Parameters
    ----------
    connection : HTTPConnection
        A request.

    Returns
    -------
    str
        Never empty.
    """
    name = visitor_of(connection).name
    return name or f"@{'' if connection.client is None else connection.client.host}"


async def close_history(state: State) -> None:
    """Close the history of a program that ends, if anybody has asked for it.

    Parameters
    ----------
    state : State
        State of the application.
    """
    if hasattr(state, "history"):
        await cast("History", state.history).close()


# ---- times --------------------------------------------------------------------------------------


def to_ms(moment: datetime) -> int:
    """Return a time as scripts count it, since 1970 in UTC. [ms]"""
    return (moment - _EPOCH) // timedelta(milliseconds=1)


def moment_of(text: str | None) -> datetime | None:
    """Return the time that a page states.

    Parameters
    ----------
    text : str or None
        ISO 8601 with its zone.

    Returns
    -------
    datetime or None
        The time in UTC; None where it is none, or lies outside of 1970 to 2200.
    """
    try:
        found = datetime.fromisoformat(text or "")
    except ValueError:
        return None
    if found.tzinfo is None or not 1970 < found.year < 2200:
        return None
    return found.astimezone(UTC)


def span_of(connection: HTTPConnection) -> tuple[datetime, datetime] | None:
    """Return the span that a request states as ``first`` and ``last``.

    Parameters
    ----------
    connection : HTTPConnection
        The request.

    Returns
    -------
    tuple or None
        Begin and end in UTC; None where they are no times, the end is not after the begin, or
        more than `LONGEST` after it.
    """
    first = moment_of(connection.query_params.get("first"))
    last = moment_of(connection.query_params.get("last"))
    if first is None or last is None or not timedelta(0) < last - first <= LONGEST:
        return None
    return first, last


# ---- series -------------------------------------------------------------------------------------


def unit_of(name: str, unit: str) -> str:
    """Return the unit of a series as people write it.

    Parameters
    ----------
    name : str
        Name of the series; where it states no unit, its end does, as in ``T_spindle_C``.
    unit : str
        Its unit, as the history states it.

    Returns
    -------
    str
        Such as ``µm``; empty for a number without one.
    """
    if unit:
        return _UNITS.get(unit, unit)
    found = _UNIT_OF_NAME.search(name)
    return _SHOWN_UNITS.get(found[1], found[1]) if found else ""


def points_within(first: datetime, last: datetime, cycle_s: float, points: int) -> int:
    """Return into how many steps a span is cut.

    No step is shorter than two cycles: one that has no value means that none was recorded. A
    span of few cycles is cut so finely that each has a step of its own.

    Parameters
    ----------
    first, last : datetime
        The span.
    cycle_s : float
        Time from cycle to cycle. [s]
    points : int
        Steps that are wanted. [1]

    Returns
    -------
    int
        Number of steps. [1]
    """
    cycles = (last - first) / timedelta(seconds=cycle_s)
    if cycles <= min(points, _SINGLE_CYCLES):
        return max(1, (last - first) // timedelta(milliseconds=1))
    return max(1, min(points, int(cycles / 2.0)))


def line_of(trend: "Trend", last: datetime, cycle_s: float) -> Json:
    """Return a trend as a page draws it: times in the middle of the steps, null in every gap.

    Parameters
    ----------
    trend : Trend
        The trend.
    last : datetime
        End of the span: no time is later.
    cycle_s : float
        Time from cycle to cycle. [s]

    Returns
    -------
    dict
        ``unit``, ``step_s``, and lists of one length: ``t`` [ms since 1970], ``mean``, ``lowest``,
        ``highest``.
    """
    found: Json = {
        "unit": unit_of(trend.name, trend.unit),
        "step_s": trend.step_us / 1e6,
        "t": [],
        "mean": [],
        "lowest": [],
        "highest": [],
    }
    longest_us = _longest_us(trend, cycle_s)
    last_ms, before_us = to_ms(last), math.inf
    rows = zip(trend.time_us, trend.mean, trend.lowest, trend.highest, strict=True)
    for time_us, *numbers in rows:
        if time_us - before_us > longest_us:
            gap_ms = int(before_us + time_us + trend.step_us) // 2000
            _append(found, gap_ms, (None, None, None))
        before_us = time_us
        _append(found, min((time_us + trend.step_us // 2) // 1000, last_ms), numbers)
    return found


def _longest_us(trend: "Trend", cycle_s: float) -> float:
    """Return the time between two values from which on there is a gap. [µs]"""
    times_us = trend.time_us
    apart = sorted(after - before for before, after in pairwise(times_us))
    usual_us = apart[len(apart) // 2] if apart else 0
    recorded_us = max(cycle_s * 1e6, usual_us if usual_us > trend.step_us else 0)
    return trend.step_us + 1.5 * recorded_us


def _append(found: Json, time_ms: int, numbers: Sequence[float | None]) -> None:
    found["t"].append(time_ms)
    for name, number in zip(("mean", "lowest", "highest"), numbers, strict=True):
        found[name].append(shortened(number))


def shortened(number: float | None) -> float | None:
    """Return a number with the digits that a chart or a table can show; None if it is none."""
    if number is None or not math.isfinite(number):
        return None
    return float(f"{number:.{_DIGITS}g}")


def lines_of(
    reader: "HistoryReader",
    names: Sequence[str],
    span: tuple[datetime, datetime],
    cycle_s: float,
    points: int,
) -> Json:
    """Return several trends by name, those of them that the history has.

    Parameters
    ----------
    reader : HistoryReader
        The history.
    names : sequence of str
        Names of series.
    span : tuple of datetime
        Begin and end.
    cycle_s : float
        Time from cycle to cycle. [s]
    points : int
        Largest number of steps. [1]

    Returns
    -------
    dict
        As `line_of` says, by name.
    """
    known = reader.series()
    wanted = [name for name in dict.fromkeys(names) if name in known]
    if not wanted:
        return {}
    found = reader.trend(wanted, *span, points=points_within(*span, cycle_s, points))
    return {name: line_of(found[name], span[1], cycle_s) for name in wanted}


# ---- events -------------------------------------------------------------------------------------


def event_json(event: EventRecord) -> Json:
    """Return an event for a page.

    Parameters
    ----------
    event : EventRecord
        The event.

    Returns
    -------
    dict
        ``t`` [ms since 1970], ``kind``, ``who``, ``text`` as recorded, in English, and what a page
        needs to say it in another language: of a state ``state`` and ``reasons``, of an alarm
        ``priority`` (empty once it is gone) and ``alarm``, of a request ``request``, ``output``,
        ``value``, ``duration_s``, ``accepted`` and ``reason``.
    """
    found: Json = {
        "t": to_ms(event.utc),
        "kind": event.kind,
        "who": event.who,
        "text": event.text,
    }
    head, _, tail = event.text.partition(": ")
    if event.kind == "state":
        found |= {"state": head, "reasons": tail.split("; ") if tail else []}
    elif event.kind == "alarm" and head in {"critical", "high", "medium", "low", "gone"}:
        found |= {"priority": "" if head == "gone" else head, "alarm": tail}
    elif event.kind == "request" and "accepted" in event.details:
        details = event.details
        found |= {
            "request": str(details.get("kind") or ""),
            "output": str(details.get("output") or ""),
            "value": _number(details.get("value")),
            "duration_s": _number(details.get("duration_s")),
            "file": str(details.get("text") or ""),
            "accepted": details["accepted"] is True,
            "reason": tail.partition(", ")[2],
        }
    return found


def said_in(language: str, words: "Words", events: Sequence[Json]) -> list[Json]:
    """Return events with what happened in a language as well.

    Parameters
    ----------
    language : str
        The language.
    words : Words
        Texts in every language.
    events : sequence of dict
        As `event_json` says.

    Returns
    -------
    list of dict
        The same with ``said``, and of a request ``said_reason``; English where there is no
        translation, and then what of it is English as ``english``.
    """
    found: list[Json] = []
    for event in events:
        said = words.phrase(language, f"event_{event['kind']}", event["text"])
        found.append({**event, "said": said})
        english = words.left_in_english(language, f"event_{event['kind']}", event["text"])
        if "reason" in event:
            found[-1]["said_reason"] = words.phrase(language, "answer", event["reason"])
            english = words.left_in_english(language, "answer", event["reason"])
        if english:
            found[-1]["english"] = english
    return found


def _number(value: object) -> float | None:
    return shortened(float(value)) if isinstance(value, int | float) else None


def events_of(
    reader: "HistoryReader",
    span: tuple[datetime, datetime],
    kinds: Sequence[str] = (),
    newest: int = MOST_EVENTS,
) -> tuple[list[Json], bool]:
    """Return the events of a span.

    Parameters
    ----------
    reader : HistoryReader
        The history.
    span : tuple of datetime
        Begin and end.
    kinds : sequence of str
        Kinds that are wanted. Default: all.
    newest : int
        Only so many, the newest. [1]

    Returns
    -------
    events : list of dict
        As `event_json` says, in the order of recording.
    more : bool
        Whether there are older ones in the span that are not given.
    """
    found = reader.events(*span, kinds=kinds, newest=newest + 1)
    return [event_json(event) for event in found[-newest:]], len(found) > newest


# ---- the operator's trend -----------------------------------------------------------------------


def trend8(
    reader: "HistoryReader",
    now: datetime,
    cycle_s: float,
    outputs: Sequence[str],
    channels: Sequence[str],
) -> Json:
    """Return the last hours of corrections and key temperatures, with events.

    Parameters
    ----------
    reader : HistoryReader
        The history.
    now : datetime
        The end, aware.
    cycle_s : float
        Time from cycle to cycle. [s]
    outputs : sequence of str
        Outputs of the model.
    channels : sequence of str
        Its channels.

    Returns
    -------
    dict
        ``first`` and ``last`` [ms since 1970], ``series`` as `line_of` says by name
        (``Z_um.correction``, ``T_spindle_C``), ``events`` as `event_json` says.
    """
    span = now - timedelta(hours=TREND_H), now
    names = [*(f"{output}.correction" for output in outputs), *channels]
    series = lines_of(reader, names, span, cycle_s, TREND_POINTS)
    events, more = events_of(reader, span, MARKED, 200)
    return {
        "first": to_ms(span[0]),
        "last": to_ms(now),
        "series": series,
        "events": events,
        "more_events": more,
    }


def names_now(status: Mapping[str, Any], table: str, configured: Sequence[str]) -> tuple[str, ...]:
    """Return the names of outputs or inputs: those of the loop, or of the file while it is silent.

    Parameters
    ----------
    status : mapping
        What the loop told; may be empty.
    table : str
        ``outputs`` or ``inputs``.
    configured : sequence of str
        Names in the configuration.

    Returns
    -------
    tuple of str
        The names.
    """
    told = status.get(table)
    if isinstance(told, Mapping) and told:
        return tuple(str(name) for name in cast("Mapping[object, object]", told))
    return tuple(configured)
