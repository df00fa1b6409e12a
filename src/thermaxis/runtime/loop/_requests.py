"""Requests on their way to a cycle, and their answers back."""

import asyncio
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import final

from thermaxis.codes import Message, Value, printable
from thermaxis.compensation import Answer, Compensation, Request, RequestKind
from thermaxis.errors import ThermaxisError
from thermaxis.runtime._ports import LoopAnswer, RequestOutcome
from thermaxis.runtime.loop._settings import Models
from thermaxis.runtime.status import Alarm, is_mismatch

LONGEST_TEXT = 200
"""Longest text in a request. [1]"""
_ENDING = RequestOutcome(accepted=False, code=LoopAnswer.ENDING)
_DECIDED = ("fault_", "state_version", "touch_void")
_UNSEEN = RequestOutcome(accepted=False, code=LoopAnswer.SENSOR_ALARM_MEANWHILE)


def _refusal_of(request: Request) -> RequestOutcome | None:
    """Return why a request cannot be recorded, let alone meant; its limits the cycle checks."""
    for text in (request.output, request.text):
        if printable(text, LONGEST_TEXT) != text:
            return RequestOutcome(accepted=False, code=LoopAnswer.NAME_UNUSABLE)
    for value in (request.value, request.duration_s):
        if value is not None and not math.isfinite(value):
            return RequestOutcome(accepted=False, code=LoopAnswer.NUMBER_NOT_FINITE)
    return None


@final
class Waiting:
    """A request whose answer somebody waits for."""

    def __init__(self, request: Request, shown: Mapping[str, Alarm]) -> None:
        self.request = request
        self.shown = shown  # the alarms that whoever asks can have seen
        self.doubted: frozenset[str] = frozenset()  # keys of those whose sensors are accepted
        self.change: tuple[Compensation, str] | None = None
        self.answer: asyncio.Future[RequestOutcome] = asyncio.get_running_loop().create_future()

    def tell(self, outcome: RequestOutcome) -> None:
        """Answer, unless nobody waits any more."""
        if not self.answer.done():
            self.answer.set_result(outcome)


def _seen(waiting: Waiting) -> tuple[Message, ...] | None:
    """Return the alarms that an Acknowledge takes as seen; None where there are none."""
    seen = (
        alarm.message
        for key, alarm in waiting.shown.items()
        if key in waiting.doubted or is_mismatch(alarm) or alarm.code.startswith(_DECIDED)
    )
    return tuple(seen) or None


@final
class Requests:
    """Takes requests at any time; a cycle takes them all at once, and answers each."""

    def __init__(
        self, models: Models | None, tell: Callable[[Request, RequestOutcome], None]
    ) -> None:
        self.own: list[Request] = []
        self.closed = False
        self._models, self._tell = models, tell
        self._waiting: list[Waiting] = []
        self._identity = 0

    async def submit(
        self, request: Request, alarms: Iterable[Alarm], names: tuple[str, ...]
    ) -> RequestOutcome:
        """Hand in a request and wait for its answer."""
        if self.closed:
            return _ENDING
        self._identity += 1
        refused = _refusal_of(request)
        if refused is not None:
            output, text = (printable(t, LONGEST_TEXT) for t in (request.output, request.text))
            shorn = replace(request, output=output, text=text, value=None, duration_s=None)
            self._tell(shorn, refused)
            return refused
        shown = {alarm.key: alarm for alarm in alarms}
        waiting = Waiting(replace(request, identity=self._identity), shown)
        if request.kind is RequestKind.MODEL:
            refused = await self._load(waiting, names)
            if refused is not None:
                self._tell(waiting.request, refused)
                return refused
            if self.closed:  # while the model was read
                return _ENDING
        self._waiting.append(waiting)
        return await waiting.answer

    async def _load(self, waiting: Waiting, names: tuple[str, ...]) -> RequestOutcome | None:
        """Read another model beside the cycles; return how it is refused, or None."""
        if self._models is None:
            return RequestOutcome(accepted=False, code=LoopAnswer.NO_MODEL_FOLDER)
        try:
            change = await asyncio.to_thread(self._models, waiting.request.text)
        except ThermaxisError as error:
            values = {"why": error.message}
            return RequestOutcome(accepted=False, code=LoopAnswer.MODEL_UNUSABLE, values=values)
        found = tuple(output.name for output in change[0].model.outputs)
        if found != names:
            values = {"names": found, "needed": names}
            return RequestOutcome(accepted=False, code=LoopAnswer.MODEL_OUTPUTS, values=values)
        waiting.change = change
        return None

    def take(self) -> tuple[list[Waiting], list[Request]]:
        """Return what waits, and what the loop asks itself."""
        taken = self._waiting, self.own
        self._waiting, self.own = [], []
        return taken

    def without_unseen(self, waiting: list[Waiting], doubted: set[str]) -> list[Waiting]:
        """Refuse what would accept the value of a sensor whose alarm nobody can have seen.

        Who asks has seen the alarms of before. A request that waited while the loop stood still
        would else take away what came meanwhile, before it is told.
        """
        left: list[Waiting] = []
        for one in waiting:
            if one.request.kind is RequestKind.ACKNOWLEDGE and not doubted <= one.shown.keys():
                self._tell(one.request, _UNSEEN)
                one.tell(_UNSEEN)
            else:
                one.doubted = frozenset(doubted)
                left.append(one)
        return left

    def answer(self, waiting: Sequence[Waiting], answers: Sequence[Answer]) -> None:
        """Give the cycle's answers to those who wait; the history has each of them."""
        by_identity: dict[int, RequestOutcome] = {}
        seen = {one.request.identity: _seen(one) for one in waiting}
        for answer in answers:
            values: dict[str, Value] = {**answer.values}
            if answer.accepted and answer.request.kind is RequestKind.ACKNOWLEDGE:
                values["alarms"] = seen.get(answer.request.identity)
            outcome = RequestOutcome(answer.accepted, answer.code, values)
            by_identity[answer.request.identity] = outcome
            self._tell(answer.request, outcome)
        for one in waiting:
            if one.change is not None:
                outcome = RequestOutcome(accepted=True, code=LoopAnswer.MODEL_SETTLES)
                self._tell(one.request, outcome)
            else:
                outcome = by_identity[one.request.identity]
            one.tell(outcome)

    def close(self) -> None:
        """Refuse what still waits."""
        self.closed = True
        for one in self._waiting:
            one.tell(RequestOutcome(accepted=False, code=LoopAnswer.ENDED))
        self._waiting = []
