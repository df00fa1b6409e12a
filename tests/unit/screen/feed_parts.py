"""A loop's server that says what a test wants it to say, and statuses for it."""

import asyncio
import json
from collections.abc import Sequence
from typing import Any

from asyncua import ua

from tests.unit.runtime.status_server_parts import NOW, status
from thermaxis.runtime import SourceSample
from thermaxis.runtime.opcua import MethodAnswer
from thermaxis.runtime.status import as_json

STATUS = ua.StatusCodes


def text_of(number: int = 1, **changes: object) -> str:
    """Return what the loop says in a cycle, by the loop's own words."""
    told = status(number=number, **changes)
    return as_json(told)


def read_as(value_c: float | None, number: int) -> str:
    """Return a status in which the spindle's sensor read a value."""
    whole = status()
    samples = {**whole.samples, "T_spindle_C": SourceSample(value_c, good=True, source_time=NOW)}
    return text_of(number, samples=samples)


def altered(**changes: object) -> str:
    """Return a status with some of its top-level members replaced; None takes one away."""
    told: dict[str, Any] = json.loads(text_of())
    for name, value in changes.items():
        if value is None:
            del told[name]
        else:
            told[name] = value
    return json.dumps(told)


class Loop:
    """Stands for the connection to the loop's status server."""

    def __init__(self, text: object = None) -> None:
        self.text: object = text_of() if text is None else text
        self.code = STATUS.Good
        self.connected = True
        self.answers = True
        self.generation = 1
        self.last_error = ""
        self.role = "viewer"
        self.status_of_call = "Good"
        self.asked_who = 0
        self.read_times = 0
        self.users = 0

    async def open(self) -> None:
        self.users += 1

    async def close(self) -> None:
        self.users -= 1

    def lose(self, why: str = "loop: nothing listens there. Start it.") -> None:
        self.connected, self.last_error = False, why

    def find(self) -> None:
        self.connected, self.last_error = True, ""
        self.generation += 1

    async def _wait(self, deadline_s: float) -> bool:
        if self.connected and not self.answers:
            await asyncio.sleep(deadline_s)
        return self.connected and self.answers

    async def read(self, nodes: Sequence[str], deadline_s: float) -> list[ua.DataValue] | None:
        self.read_times += 1
        if not await self._wait(deadline_s):
            return None
        assert nodes == ["nsu=urn:thermaxis:runtime;s=Status/Everything"]
        variant = None if self.text is Ellipsis else ua.Variant(self.text)
        return [ua.DataValue(variant, ua.StatusCode(ua.UInt32(self.code)))]

    async def call(
        self, place: str, method: str, arguments: Sequence[ua.Variant], deadline_s: float
    ) -> MethodAnswer | None:
        if not await self._wait(deadline_s):
            return None
        assert method.endswith("s=Requests/WhoAmI")
        self.asked_who += 1
        values = ("", self.role) if self.status_of_call == "Good" else ()
        return MethodAnswer(self.status_of_call, values)


__all__ = ["STATUS", "Loop", "altered", "read_as", "text_of"]
