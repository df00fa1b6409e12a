"""What the loop says of itself, read once a second with one connection for every browser.

The status is a text of another program. It is shown only if it is whole, of the known format, of
good quality, and if the number of its cycle moves; everything else is told as a reason in words.
"""

import asyncio
import json
import math
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from typing import Any, Final, NamedTuple, NoReturn, Protocol, cast, final

from asyncua import ua

from thermaxis.codes import printable
from thermaxis.runtime import Clock, ConnectionSettings, OpcUaSession, Role
from thermaxis.runtime.opcua import MethodAnswer, status_name
from thermaxis.runtime.status import NAMESPACE

LARGEST_STATUS_BYTES: Final = 1_000_000
"""Largest status that is looked at; one with 20 inputs has 5 kB [run]. [byte]"""
REMEMBERED_LOOKS: Final = 300
"""Raw values of so many looks are kept, for their noise. [1]"""
WHO_AM_I_S: Final = 10.0
"""The own role is asked for after each connection, and so often. [s]"""
SHORTEST_STANDSTILL_S: Final = 3.0
"""A cycle's number that does not move for so long stands still, and for three cycles. [s]"""
STANDSTILL_CYCLES: Final = 3.0
"""... and so many cycles. [1]"""
ANSWER_FRACTION: Final = 0.8
"""Part of the time between two looks within which the loop must answer. [1]"""
PATIENCE_S: Final = 4.0
"""An answer may take so long before it costs the connection: a loop that checks a password on a
busy computer would otherwise be asked to check it again and again. What is shown is no older for
that, since a look has its own time. Origin: ``benchmarks/screen_patience.py`` with ten busy
programs on two cores: with 1 s not connected within 65 s, with 4 s after 3.5 to 6.8 s. [s]"""
REQUESTS: Final = f"nsu={NAMESPACE};s=Requests"
"""The object that every method belongs to."""
WHO_AM_I: Final = f"{REQUESTS}/WhoAmI"
"""The method that tells name and role of the caller."""
_EVERYTHING: Final = f"nsu={NAMESPACE};s=Status/Everything"
_MOST_NAMES: Final = 1000
_LONGEST_NUMBER: Final = 20
_LONGEST_CYCLE_S: Final = 1e6
_NOTHING: Final[Mapping[str, Any]] = {}

NO_CONNECTION: Final = "feed-no_connection"
"""There is no connection to the loop."""
NO_ANSWER: Final = "feed-no_answer"
"""There is a connection, and no answer on it."""
STANDS_STILL: Final = "feed-stands_still"
"""The loop answers, and its cycle does not move."""
OLD: Final = "feed-old"
"""The loop's server calls the status uncertain."""
NO_STATUS: Final = "feed-no_status"
"""The loop has not finished a cycle yet, or has no such value."""
NOT_UNDERSTOOD: Final = "feed-not_understood"
"""What came is no status of the known format and version."""
NOT_A_VIEWER: Final = "feed-not_a_viewer"
"""The screen's own account has another role than viewer."""
ENDED: Final = "feed-ended"
"""The screen is being ended."""


class Told(NamedTuple):
    """One look at the loop."""

    number: int
    """Number of the look; it grows with every look. [1]"""
    text: str
    """The last status that was live, JSON as it came; empty before the first."""
    status: Mapping[str, Any]
    """The same, parsed; empty before the first."""
    received_s: float
    """Monotonic time at which the cycle of that status was first seen. [s]"""
    received_utc: datetime | None
    """The same as time of day, aware, in UTC; None before the first."""
    live: bool
    """Whether it is what the loop says now: good quality, and its number moves."""
    why: str
    """Key of the words that say why it is not; empty while it is."""
    detail: str
    """The failure as an English sentence for the engineer; may be empty."""


class StatusSession(Protocol):
    """The connection as far as the feed uses it: see `OpcUaSession`."""

    @property
    def connected(self) -> bool:
        """Whether the server can be asked."""
        ...

    @property
    def generation(self) -> int:
        """Number of the connection. [1]"""
        ...

    @property
    def last_error(self) -> str:
        """Why it is not connected."""
        ...

    async def open(self) -> None:
        """Begin to connect."""
        ...

    async def close(self) -> None:
        """End."""
        ...

    async def read(self, nodes: Sequence[str], deadline_s: float) -> list[ua.DataValue] | None:
        """Read the values of nodes; None without an answer in time."""
        ...

    async def call(
        self, place: str, method: str, arguments: Sequence[ua.Variant], deadline_s: float
    ) -> MethodAnswer | None:
        """Call a method; None without an answer in time."""
        ...


class _Trouble(NamedTuple):
    """Why a look showed nothing."""

    why: str
    """Key of the words."""
    detail: str = ""
    """The failure in English."""


class _Cycle(NamedTuple):
    """What tells one cycle of the loop from every other one."""

    started: str
    """When the loop was started."""
    number: int
    """Number of the cycle. [1]"""


def parse_status(text: str) -> Mapping[str, Any]:
    """Return a status from its JSON."""
    wrong = _wrong_size(text)
    found: object = None
    if not wrong:
        try:
            found = json.loads(
                text, parse_constant=_no_number, parse_float=_number, parse_int=_whole_number
            )
            if "\\ud" in text.lower():  # half a pair of surrogates cannot be sent to a browser
                json.dumps(found, ensure_ascii=False).encode()
        except RecursionError:
            wrong = "the status is nested too deeply"
        except ValueError as error:
            wrong = f"the status is no JSON ({printable(str(error), 100)})"
    wrong = wrong or _wrong_kind(found)
    if wrong:
        raise ValueError(wrong)
    return cast("dict[str, Any]", found)


def _wrong_size(text: str) -> str:
    try:
        size = len(text) if len(text) > LARGEST_STATUS_BYTES else len(text.encode())
    except UnicodeEncodeError:
        return "the status is no text"
    largest = f"{LARGEST_STATUS_BYTES / 1e6:g} MB"
    return "" if size <= LARGEST_STATUS_BYTES else f"the status is larger than {largest}"


def _no_number(word: str) -> NoReturn:
    raise ValueError(f"{word} is no number")


def _number(word: str) -> float:
    number = float(word)
    return number if math.isfinite(number) else _no_number(word[:_LONGEST_NUMBER])


def _whole_number(word: str) -> int:
    return int(word) if len(word) <= _LONGEST_NUMBER else _no_number(word[:_LONGEST_NUMBER])


def _wrong_kind(found: object) -> str:
    """Return what every page relies on and is not so, as a sentence; empty if all is well."""
    if not isinstance(found, dict):
        return "the status is no object"
    status = cast("dict[str, object]", found)
    kind, version = status.get("format"), status.get("version")
    if kind != "thermaxis-status" or type(version) is not int or version != 2:
        shown = printable(f"{kind!r}, version {version!r}", 100)
        return f"the status has another format than this screen knows ({shown})"
    cycle_s = status.get("cycle_s")
    if type(status.get("number")) is not int:
        return "the status has no number of its cycle"
    if type(cycle_s) not in {int, float} or not 0.0 < cast("float", cycle_s) < _LONGEST_CYCLE_S:
        return "the status does not say how long its cycle is"
    for names, fits, what in _KINDS:
        wrong = next((name for name in names if not fits(status.get(name))), None)
        if wrong is not None:
            return f"{wrong} of the status is no {what}"
    return _check_parts(status)


def _check_parts(status: Mapping[str, object]) -> str:
    """Return what a page looks up in a group of the status and is of another kind, or empty."""
    for group, names, fits, what in _PARTS:
        rows = cast("Mapping[str, object] | Sequence[object]", status[group])
        for row in rows.values() if isinstance(rows, Mapping) else rows:
            table = cast("Mapping[str, object]", row)
            wrong = next((name for name in names if not fits(table.get(name))), None)
            if wrong is not None:
                return f"{wrong} in {group} of the status is no {what}"
    historian = cast("Mapping[str, object]", status["historian"])
    if type(historian.get("storing")) is not bool:
        return "the status does not say whether the history is stored"
    return ""


def _is_text(value: object) -> bool:
    return isinstance(value, str)


def _is_flag(value: object) -> bool:
    return type(value) is bool


def _is_number_or_none(value: object) -> bool:
    return value is None or type(value) in {int, float}


def _is_table(value: object) -> bool:
    return isinstance(value, dict)


def _is_table_or_none(value: object) -> bool:
    return value is None or isinstance(value, dict)


def _are_tables(value: object) -> bool:
    return isinstance(value, dict) and _all_tables(cast("dict[str, object]", value).values())


def _is_list_of_tables(value: object) -> bool:
    return isinstance(value, list) and _all_tables(cast("list[object]", value))


def _is_list_of_texts(value: object) -> bool:
    return isinstance(value, list) and all(map(_is_text, cast("list[object]", value)))


def _all_tables(values: Iterable[object]) -> bool:
    return all(isinstance(value, dict) for value in values)


_KINDS: Final[tuple[tuple[tuple[str, ...], Callable[[object], bool], str], ...]] = (
    (("machine", "started", "utc", "state", "state_since", "text"), _is_text, "text"),
    (("quality", "model_file", "model_sha256"), _is_text, "text"),
    (("enabled", "source_connected", "sink_connected"), _is_flag, "flag"),
    (("diameter_mm", "in_state_s"), _is_number_or_none, "number"),
    (("historian",), _is_table, "table"),
    (("outputs", "inputs", "signals"), _are_tables, "group of tables"),
    (("alarms",), _is_list_of_tables, "list of tables"),
    (("reasons", "outcomes"), _is_list_of_texts, "list of texts"),
)
_CORRECTION: Final = ("correction_um", "wanted_um", "requested_um", "accepted_um", "effective_um")
_PARTS: Final[tuple[tuple[str, tuple[str, ...], Callable[[object], bool], str], ...]] = (
    ("outputs", ("parts_um",), _is_table, "table"),
    ("outputs", ("limits",), _is_table_or_none, "table"),
    ("outputs", (*_CORRECTION, "trim_um", "trim_left_s", "weight"), _is_number_or_none, "number"),
    ("inputs", ("quality",), _is_text, "text"),
    ("inputs", ("value_c", "read", "age_s"), _is_number_or_none, "number"),
    ("signals", ("read", "age_s"), _is_number_or_none, "number"),
    ("alarms", ("priority", "text", "cause", "remedy", "since"), _is_text, "text"),
    ("alarms", ("values",), _is_table_or_none, "table"),
)


@final
class StatusFeed:
    """Looks at the loop once a second and tells everybody who waits.

    A look comes at least so often, with or without a connection: whoever waits can always say how
    old what is shown is. A connection that is lost is made again without an end. The account of
    the screen must have the role viewer and no other: through one that may act nothing is shown.

    One answer that does not come is no loss; the last status stays live until it is older than
    three cycles, and than three seconds.

    Not protected: whoever may change the loop's program or stand between on the loop's own
    computer may tell a false status; certificates protect a connection over a network.
    """

    def __init__(
        self,
        connection: ConnectionSettings,
        clock: Clock,
        *,
        every_s: float = 1.0,
        session: StatusSession | None = None,
        patience_s: float = PATIENCE_S,
    ) -> None:
        patient = replace(connection, timeout_s=max(connection.timeout_s, patience_s))
        self._session = OpcUaSession(patient, clock) if session is None else session
        self._clock = clock
        self._every_s = every_s
        self._latest = Told(
            number=0,
            text="",
            status=_NOTHING,
            received_s=clock.monotonic_s(),
            received_utc=None,
            live=False,
            why=NO_CONNECTION,
            detail="",
        )
        self._news = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        self._cycle: _Cycle | None = None
        self._moved_s = 0.0
        self._standstill_s = SHORTEST_STANDSTILL_S
        self._role_of: tuple[int, float] = (-1, 0.0)
        self._role_trouble = _Trouble(NO_CONNECTION)
        self._raw: deque[tuple[float, Mapping[str, float]]] = deque(maxlen=REMEMBERED_LOOKS)

    @property
    def latest(self) -> Told:
        """The last look."""
        return self._latest

    async def open(self) -> None:
        """Begin to look."""
        await self._session.open()
        self._task = asyncio.create_task(self._look_for_ever(), name="status feed")
        self._task.add_done_callback(self._looking_ended)

    def _looking_ended(self, task: asyncio.Task[None]) -> None:
        """Wake whoever waits when a mistake in the program ends the looks: they raise it."""
        if not task.cancelled() and task.exception() is not None:
            self._news.set()

    async def close(self) -> None:
        """End; whoever waits is told that the screen ends, and waits for ever afterwards."""
        task, self._task = self._task, None
        if task is None:
            return
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        await self._session.close()
        self._tell(_Trouble(ENDED))
        if not task.cancelled() and (error := task.exception()) is not None:
            raise error  # a mistake in the program is not hidden

    async def after(self, number: int) -> Told:
        """Wait for a look that is newer than another one."""
        while self._latest.number <= number:
            if self._task is not None and self._task.done():
                self._task.result()
            await self._news.wait()
        return self._latest

    def recent(self, name: str) -> tuple[tuple[float, float], ...]:
        """Return the raw values of an input or a signal in the last cycles that were seen."""
        return tuple((at_s, raw[name]) for at_s, raw in tuple(self._raw) if name in raw)

    # ---- looks ----------------------------------------------------------------------------------

    async def _look_for_ever(self) -> None:
        due_s = self._clock.monotonic_s()
        while True:
            self._tell(await self._look())
            due_s = max(due_s + self._every_s, self._clock.monotonic_s())
            await self._clock.sleep_until(due_s)

    def _tell(self, trouble: _Trouble | None) -> None:
        """Make a look known: the status stays, what is known of it may change."""
        last = self._latest
        if trouble is None:
            told = last._replace(number=last.number + 1, live=True, why="", detail="")
        else:
            detail = printable(trouble.detail, 500)
            told = last._replace(number=last.number + 1, live=False, why=trouble.why, detail=detail)
            if trouble.why == NOT_A_VIEWER:
                told = told._replace(text="", status=_NOTHING, received_utc=None)
                self._cycle = None
                self._raw.clear()
        self._latest = told
        news, self._news = self._news, asyncio.Event()
        news.set()

    async def _look(self) -> _Trouble | None:
        """Look once; return why nothing can be shown, or None when it is shown."""
        end_s = self._clock.monotonic_s() + ANSWER_FRACTION * self._every_s
        trouble = await self._check_role(end_s)
        if trouble is not None:
            return trouble
        left_s = end_s - self._clock.monotonic_s()
        found = await self._session.read([_EVERYTHING], max(0.0, left_s))
        if found is None or self._session.generation != self._role_of[0]:
            return self._no_answer()  # through a new connection nothing is shown unasked
        return self._take(found[0])

    def _no_answer(self) -> _Trouble | None:
        """Say that there is no answer, unless the last one is so young that it may yet come."""
        if not self._session.connected:
            return _Trouble(NO_CONNECTION, self._session.last_error)
        if self._latest.live and self._stands_s() <= self._standstill_s:
            return None
        return _Trouble(NO_ANSWER, "the loop's server is connected and does not answer")

    def _stands_s(self) -> float:
        return self._clock.monotonic_s() - self._moved_s

    async def _check_role(self, end_s: float) -> _Trouble | None:
        """Ask who the screen is on this connection, and refuse to be more than a viewer."""
        session = self._session
        if not session.connected:
            return _Trouble(NO_CONNECTION, session.last_error)
        generation, asked_s = self._role_of
        now_s = self._clock.monotonic_s()
        if generation == session.generation and now_s - asked_s < WHO_AM_I_S:
            return None
        generation = session.generation
        answer = await session.call(REQUESTS, WHO_AM_I, (), end_s - now_s)
        if answer is None:
            return self._no_answer()
        role = role_in(answer)
        if role is not Role.VIEWER:
            self._role_of = (-1, 0.0)
            said = answer.status if role is None else f"the role {role.value}"
            return _Trouble(
                NOT_A_VIEWER, f"the loop's server says {said} of the screen's own account"
            )
        self._role_of = (generation, now_s)
        return None

    def _take(self, value: ua.DataValue) -> _Trouble | None:
        """Keep what was read; return why it cannot be shown as what the loop says now."""
        status = status_name(value)
        code = value.StatusCode
        if code is not None and not (code.is_good() or code.is_uncertain()):
            return _Trouble(NO_STATUS, f"the loop's server answers {status}")
        text: object = None if value.Value is None else cast("object", value.Value.Value)
        if not isinstance(text, str):
            return _Trouble(NOT_UNDERSTOOD, "the status is no text")
        try:
            known = text and text == self._latest.text
            found = self._latest.status if known else parse_status(text)
        except ValueError as error:
            return _Trouble(NOT_UNDERSTOOD, str(error))
        good = code is None or code.is_good()
        self._see(_Cycle(found["started"], found["number"]), found, text, good=good)
        if self._stands_s() > self._standstill_s:
            stands_s = self._stands_s()
            return _Trouble(STANDS_STILL, f"the cycle has not moved for {stands_s:.0f} s")
        return None if good else _Trouble(OLD, f"the loop's server calls it {status}")

    def _see(self, cycle: _Cycle, found: Mapping[str, Any], text: str, *, good: bool) -> None:
        """Learn whether the cycle has moved; keep a good status."""
        now_s = self._clock.monotonic_s()
        self._standstill_s = max(SHORTEST_STANDSTILL_S, STANDSTILL_CYCLES * found["cycle_s"])
        moved = cycle != self._cycle
        if moved:
            self._cycle, self._moved_s = cycle, now_s
        if not good or (not moved and text == self._latest.text):
            return
        seen_utc = self._clock.utc() if moved else self._latest.received_utc or self._clock.utc()
        self._latest = self._latest._replace(
            text=text, status=found, received_s=self._moved_s, received_utc=seen_utc
        )
        if moved:
            self._raw.append((now_s, _raw_values(found)))


def role_in(answer: MethodAnswer) -> Role | None:
    """Return the role that ``WhoAmI`` tells; None if it tells none."""
    said = answer.values[1] if len(answer.values) == 2 else None
    return Role(said) if isinstance(said, str) and said in set(Role) else None


def _raw_values(status: Mapping[str, Any]) -> Mapping[str, float]:
    """Return what was read of every input and signal that has a value."""
    raw: dict[str, float] = {}
    for group in ("inputs", "signals"):
        for name, sample in cast("dict[str, dict[str, object]]", status[group]).items():
            value = sample.get("read")
            if isinstance(value, int | float) and len(raw) < _MOST_NAMES:
                raw[name] = float(value)
    return raw
