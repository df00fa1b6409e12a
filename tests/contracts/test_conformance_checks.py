"""The conformance checks find every way in which a source or a sink can break its contract."""

import asyncio
import contextlib
import math
from collections.abc import Mapping
from datetime import datetime
from typing import final

import pytest

from thermaxis.runtime import (
    NOT_READ,
    Applied,
    Sink,
    SinkRig,
    Source,
    SourceRig,
    SourceSample,
    VirtualClock,
    check_sink,
    check_source,
    run_in_virtual_time,
)

GOOD = SourceSample(20.0, good=True, age_s=0.1)


@final
class MemorySource(Source, SourceRig):
    """A source, its machine and its stand in one, with at most one fault."""

    def __init__(self, fault: str = "") -> None:
        self.fault = fault
        self.clock = VirtualClock()
        self.source, self.names = self, ("a", "b")
        self.there = True
        self.losses = 0
        self._task: asyncio.Task[None] | None = None
        self._reached = False

    async def take_away(self) -> None:
        self.there = False
        self.losses += 1

    async def bring_back(self) -> None:
        self.there = True

    async def open(self) -> None:
        if self.fault == "open raises" and not self.there:
            raise ConnectionRefusedError
        self._task = asyncio.create_task(asyncio.sleep(1e9), name="reader")

    async def read(self, deadline_s: float) -> Mapping[str, SourceSample]:
        fault = self.fault
        await asyncio.sleep(10.0 if fault == "late" else 0.5 * deadline_s)
        self._reached = self.there and not (fault == "never back" and self.losses > 1)
        if not self._reached:
            if fault == "raises when lost":
                raise ConnectionResetError
            if fault == "keeps old values":
                return dict.fromkeys(self.names, GOOD)
            if fault == "keeps bad values":
                return dict.fromkeys(self.names, GOOD._replace(good=False))
            return dict.fromkeys(self.names, NOT_READ)
        odd = {
            "nan": GOOD._replace(value=math.nan),
            "negative age": GOOD._replace(age_s=-1.0),
            "naive stamp": GOOD._replace(source_time=datetime(2030, 1, 1)),  # noqa: DTZ001 - the fault
            "no status": GOOD._replace(status=""),
            "good and bad": GOOD._replace(status="BadSensorFailure"),
            "no value": GOOD._replace(value=None),
        }
        samples = {"a": GOOD, "b": odd.get(fault, GOOD)}
        if fault == "left out":
            del samples["b"]
        return samples

    @property
    def connected(self) -> bool:
        if self.fault == "always connected":
            return True
        return self._reached and self.fault != "never connected"

    @property
    def ended(self) -> bool:
        return self.fault == "ended"

    async def close(self) -> None:
        if self.fault != "runs on":
            await _end(self._task)


async def _end(task: asyncio.Task[None] | None) -> None:
    assert task is not None
    task.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await task


def of_a_source(fault: str) -> None:
    async def check() -> None:
        stand = MemorySource(fault)
        try:
            await check_source(stand)
        finally:
            if stand._task is not None:
                await _end(stand._task)

    run_in_virtual_time(check())


def test_a_source_with_a_fault_is_found() -> None:
    of_a_source("")
    for fault, sentence in (
        ("late", "read returned after 10"),
        ("keeps old values", "had a value before its machine was there"),
        ("keeps bad values", "had a value before its machine was there"),
        ("never back", "did not find its machine"),
        ("nan", "the value of b is nan"),
        ("negative age", "the age of b is -1.0"),
        ("naive stamp", "time stamp of b has no time zone"),
        ("no status", "b has no status"),
        ("good and bad", "b is called good with the status BadSensorFailure"),
        ("no value", "b had no value though"),
        ("left out", "read left out b"),
        ("always connected", "calls itself connected"),
        ("never connected", "says that it did not"),
        ("ended", "has ended"),
        ("runs on", "runs on after close: reader"),
    ):
        with pytest.raises(AssertionError, match=sentence):
            of_a_source(fault)
    for fault in ("open raises", "raises when lost"):
        with pytest.raises(ConnectionError):
            of_a_source(fault)


@final
class MemorySink(Sink, SinkRig):
    """A sink, its machine and its stand in one, with at most one fault."""

    def __init__(self, fault: str = "") -> None:
        self.fault = fault
        self.clock = VirtualClock()
        self.sink, self.names = self, ("X_um", "Z_um")
        self.there = True
        self.offsets = dict.fromkeys(self.names, 1.5)
        self.beats = 0
        self.requested: dict[str, float] = {}
        self._told = False
        self._task: asyncio.Task[None] | None = None

    async def take_away(self) -> None:
        self.there = self._told = False

    async def bring_back(self) -> None:
        self.there = True
        self._told = self.fault == "tells once in its life" and bool(self.requested)

    def offsets_um(self) -> Mapping[str, float]:
        return self.offsets

    def set_offset_um(self, name: str, offset_um: float) -> None:
        self.offsets[name] = offset_um

    def heartbeat(self) -> float:
        return self.beats

    async def open(self) -> None:
        self._told = False
        self._task = asyncio.create_task(asyncio.sleep(1e9), name="writer")
        if self.fault == "writes at open":
            self.offsets = dict.fromkeys(self.names, 0.0)

    @property
    def connected(self) -> bool:
        return self.there or self.fault == "always connected"

    async def found(self, deadline_s: float) -> Mapping[str, float | None] | None:
        await asyncio.sleep(9.0 if self.fault == "found is late" else 0.0)
        if not self.there or (self._told and self.fault != "tells for ever"):
            return None
        self._told = True
        if self.fault == "found moves":
            self.offsets["X_um"] += 1.0
        if self.fault == "finds zero":
            return dict.fromkeys(self.names, 0.0)
        return dict(self.offsets)

    async def write(self, correction_um: Mapping[str, float], deadline_s: float) -> bool:
        fault = self.fault
        await asyncio.sleep(9.0 if fault == "write is late" else 0.0)
        if not self.there:
            return fault == "accepts everything"
        if not self._told and fault not in {"writes unasked", "moves unasked"}:
            self.beats += fault == "beats unasked"
            return False
        if not all(map(math.isfinite, correction_um.values())):
            self.beats += fault == "beats without a number"
            if fault == "skips what is no number":
                good = {n: v for n, v in correction_um.items() if math.isfinite(v)}
                self.offsets.update(good)
            return fault == "accepts what is no number"
        self.offsets.update(correction_um)
        self.requested.update(correction_um)
        if fault == "wrong sign":
            self.offsets = {name: -value for name, value in self.offsets.items()}
        self.beats += fault != "does not beat"
        return self._told and fault != "refuses"

    async def read_back(self, deadline_s: float) -> Mapping[str, Applied]:
        await asyncio.sleep(9.0 if self.fault == "read_back is late" else 0.0)
        there = self.there or self.fault == "remembers"
        requested = {} if self.fault == "forgets" else self.requested
        names = self.names[1:] if self.fault == "leaves out" else self.names
        return {n: Applied(requested.get(n), self.offsets[n] if there else None) for n in names}

    async def close(self) -> None:
        if self.fault == "writes at close":
            self.offsets = dict.fromkeys(self.names, 0.0)
        if self.fault != "runs on":
            await _end(self._task)


def of_a_sink(fault: str) -> None:
    async def check() -> None:
        stand = MemorySink(fault)
        try:
            await check_sink(stand)
        finally:
            await _end(stand._task)

    run_in_virtual_time(check())


def test_a_sink_with_a_fault_is_found() -> None:
    of_a_sink("")
    for fault, sentence in (
        ("writes at open", "an offset changed before found was read"),
        ("always connected", "calls itself connected"),
        ("found is late", "found returned after 9"),
        ("write is late", "write returned after 9"),
        ("read_back is late", "read_back returned after 9"),
        ("tells for ever", "the same news twice"),
        ("tells once in its life", "write succeeded before found|no news of the machine"),
        ("found moves", "found wrote an offset|the machine has"),
        ("finds zero", "found says 0.0 um of X_um, the machine has 1.5 um"),
        ("accepts everything", "a write succeeded before its machine was there"),
        ("writes unasked", "an offset changed before found was read"),
        ("beats unasked", "the heartbeat moved before found was read"),
        ("beats without a number", "the heartbeat moved when X_um was nan"),
        ("skips what is no number", "an offset changed when X_um was nan"),
        ("accepts what is no number", "nan was accepted"),
        ("wrong sign", "the machine has .* was written"),
        ("does not beat", "the heartbeat did not move"),
        ("refuses", "a write failed"),
        ("remembers", "was read back before its machine was there"),
        ("forgets", "None um of X_um was requested"),
        ("leaves out", "read_back left out X_um"),
        ("writes at close", "closing wrote an offset"),
        ("runs on", "runs on after close: writer"),
    ):
        with pytest.raises(AssertionError, match=sentence):
            of_a_sink(fault)
