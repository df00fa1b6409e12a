"""What the loop says of itself, read once a second with one connection for every browser.

The status is a text of another program. It is shown only if it is whole, of the known format, of
good quality, and if the number of its cycle moves; everything else is told as a reason in words.
"""

import asyncio
import json
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import replace
from datetime import datetime
from types import NoneType
from typing import Annotated, Any, Final, Literal, NamedTuple, cast, final, get_args

from asyncua import ua
from pydantic import ConfigDict, Field as Bounds, create_model
from pydantic_core import from_json

from thermaxis.runtime import Clock, ConnectionSettings, OpcUaSession, Role
from thermaxis.runtime.opcua import MethodAnswer
from thermaxis.runtime.status import FIELDS, NAMESPACE, Field, Kind

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


class StatusSnapshot(NamedTuple):
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
    """Key of the sentence that says why it is not; empty while it is."""


def parse_status(text: str) -> Mapping[str, Any]:
    """Return a status from its JSON, if it is whole and every page can rely on it."""
    if len(text) > LARGEST_STATUS_BYTES or len(text.encode()) > LARGEST_STATUS_BYTES:
        raise ValueError("the status is too large")
    found = from_json(text, allow_inf_nan=False)
    json.dumps(found, allow_nan=False)  # 1e999 is infinite: no browser reads it
    _STATUS.model_validate(found)
    return found


_TYPES: Final[Mapping[Kind, Any]] = {
    Kind.NUMBER: float | None,
    Kind.COUNT: Annotated[int, Bounds(lt=2**53)],  # beyond it a browser rounds
    Kind.FLAG: bool,
    Kind.TEXT: str,
    Kind.TIME: str | None,
    Kind.TEXTS: list[str],
    Kind.MESSAGE: dict[str, Any] | None,
    Kind.TABLE: dict[str, float | None],
}


def _may_be_null(of: object) -> bool:
    return NoneType in get_args(of)


def _table(types: Mapping[str, Any]) -> Any:
    """Return what a table with these keys must be; what may be null may be missing, too.

    A table within it, its keys behind a slash, may be null if all in it may.
    """
    keys: dict[str, Any] = {key: of for key, of in types.items() if "/" not in key}
    for above in dict.fromkeys(key.partition("/")[0] for key in types if "/" in key):
        inner = {key.partition("/")[2]: of for key, of in types.items() if key.startswith(above)}
        null = all(map(_may_be_null, inner.values()))
        keys[above] = _table(inner) | None if null else _table(inner)
    stated = {key: (of, None if _may_be_null(of) else ...) for key, of in keys.items()}
    made: Any = create_model  # its keys are known at run time only
    return made("Table", __config__=ConfigDict(strict=True), **stated)


def _types(told: Iterable[Field]) -> dict[str, Any]:
    return {one.key: _TYPES[one.kind] for one in told if one.key}


_ALARM: Final = dict.fromkeys(("priority", "text", "cause", "remedy", "since"), str)
_STATUS: Final = _table(
    {
        **_types(FIELDS.loop),
        "format": Literal["thermaxis-status"],
        "version": Literal[3],
        "cycle_s": Annotated[float, Bounds(gt=0.0, lt=1e6)],
        "outputs": dict[str, _table(_types(FIELDS.outputs))],
        "inputs": dict[str, _table(_types(FIELDS.inputs))],
        "signals": dict[str, _table(_types(FIELDS.signals))],
        "alarms": list[_table({**_ALARM, "values": dict[str, Any] | None})],
    }
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
        session: OpcUaSession | None = None,
        patience_s: float = PATIENCE_S,
    ) -> None:
        patient = replace(connection, timeout_s=max(connection.timeout_s, patience_s))
        self._session = OpcUaSession(patient, clock) if session is None else session
        self._clock = clock
        self._every_s = every_s
        self._latest = StatusSnapshot(
            number=0,
            text="",
            status=_NOTHING,
            received_s=clock.monotonic_s(),
            received_utc=None,
            live=False,
            why=NO_CONNECTION,
        )
        self._news = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        self._cycle: tuple[str, int] | None = None  # start of the loop, and number
        self._moved_s = 0.0
        self._standstill_s = SHORTEST_STANDSTILL_S
        self._role_of: tuple[int, float] = (-1, 0.0)
        self._raw: deque[tuple[float, Mapping[str, float]]] = deque(maxlen=REMEMBERED_LOOKS)

    @property
    def latest(self) -> StatusSnapshot:
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
        self._tell(ENDED)
        if not task.cancelled() and (error := task.exception()) is not None:
            raise error  # a mistake in the program is not hidden

    async def after(self, number: int) -> StatusSnapshot:
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

    def _tell(self, why: str) -> None:
        """Make a look known: the status stays, what is known of it may change."""
        last = self._latest
        told = last._replace(number=last.number + 1, live=not why, why=why)
        if why == NOT_A_VIEWER:
            told = told._replace(text="", status=_NOTHING, received_utc=None)
            self._cycle = None
            self._raw.clear()
        self._latest = told
        news, self._news = self._news, asyncio.Event()
        news.set()

    async def _look(self) -> str:
        """Look once; return why nothing can be shown, empty when it is shown."""
        end_s = self._clock.monotonic_s() + ANSWER_FRACTION * self._every_s
        trouble = await self._check_role(end_s)
        if trouble:
            return trouble
        left_s = end_s - self._clock.monotonic_s()
        found = await self._session.read([_EVERYTHING], max(0.0, left_s))
        if found is None or self._session.generation != self._role_of[0]:
            return self._no_answer()  # through a new connection nothing is shown unasked
        return self._take(found[0])

    def _no_answer(self) -> str:
        """Say that there is no answer, unless the last one is so young that it may yet come."""
        if not self._session.connected:
            return NO_CONNECTION
        young = self._latest.live and self._stands_s() <= self._standstill_s
        return "" if young else NO_ANSWER

    def _stands_s(self) -> float:
        return self._clock.monotonic_s() - self._moved_s

    async def _check_role(self, end_s: float) -> str:
        """Ask who the screen is on this connection, and refuse to be more than a viewer."""
        session = self._session
        if not session.connected:
            return NO_CONNECTION
        generation, asked_s = self._role_of
        now_s = self._clock.monotonic_s()
        if generation == session.generation and now_s - asked_s < WHO_AM_I_S:
            return ""
        generation = session.generation
        answer = await session.call(REQUESTS, WHO_AM_I, (), end_s - now_s)
        if answer is None:
            return self._no_answer()
        if role_in(answer) is not Role.VIEWER:
            self._role_of = (-1, 0.0)
            return NOT_A_VIEWER
        self._role_of = (generation, now_s)
        return ""

    def _take(self, value: ua.DataValue) -> str:
        """Keep what was read; return why it cannot be shown as what the loop says now."""
        code = value.StatusCode
        if code is not None and not (code.is_good() or code.is_uncertain()):
            return NO_STATUS
        text: object = None if value.Value is None else cast("object", value.Value.Value)
        if not isinstance(text, str):
            return NOT_UNDERSTOOD
        try:
            known = text and text == self._latest.text
            found = self._latest.status if known else parse_status(text)
        except ValueError:
            return NOT_UNDERSTOOD
        good = code is None or code.is_good()
        self._see(found, text, good=good)
        if self._stands_s() > self._standstill_s:
            return STANDS_STILL
        return "" if good else OLD

    def _see(self, found: Mapping[str, Any], text: str, *, good: bool) -> None:
        """Learn whether the cycle has moved; keep a good status."""
        now_s = self._clock.monotonic_s()
        self._standstill_s = max(SHORTEST_STANDSTILL_S, STANDSTILL_CYCLES * found["cycle_s"])
        cycle = found["started"], found["number"]
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
