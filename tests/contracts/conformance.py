"""Conformance checks that every source and every sink must pass, whoever wrote it.

A source or a sink for another machine is put on a stand, which can take the machine away and
bring it back, and `check_source` or `check_sink` tries everything that the contract in
`Source` and `Sink` promises. They run in any time: real or virtual.
"""

import asyncio
import math
from abc import ABC, abstractmethod
from collections.abc import Awaitable, Mapping, Sequence
from typing import Final, TypeVar

from thermaxis.runtime import Applied, Clock, Sink, Source, SourceSample

T = TypeVar("T")

DEADLINE_S: Final = 0.2
"""Time that every call is given, unless the stand says another. [s]"""
LATE_S: Final = 0.2
"""How much later it may return: what a busy computer takes away. [s]"""
WAIT_S: Final = 5.0
"""Longest time in which a machine that came back must be used again. [s]"""
_POLL_S = 0.01


class Rig:
    """A machine, or what stands for one, that can be taken away."""

    clock: Clock
    """Time, of the same kind that the source or the sink has."""
    deadline_s: float = DEADLINE_S
    """Time that every call is given. [s]"""

    removable: bool = True
    """Whether the machine can be taken away."""

    async def take_away(self) -> None:
        """Take the machine away: from now on it cannot be reached."""
        raise NotImplementedError

    async def bring_back(self) -> None:
        """Bring it back."""
        raise NotImplementedError


class SourceRig(Rig):
    """A source and its machine."""

    source: Source
    """The source, not opened."""
    names: Sequence[str]
    """Every name that it was made for; all have values while the machine is there."""


class SinkRig(Rig, ABC):
    """A sink and its machine."""

    sink: Sink
    """The sink, not opened."""
    names: Sequence[str]
    """Every output that it was made for."""
    resolution_um: float = 1e-6
    """Resolution of the machine's offset. [µm]"""
    settable: bool = True
    """Whether `set_offset_um` can change the machine's offset."""

    @abstractmethod
    def offsets_um(self) -> Mapping[str, float]:
        """Return the offsets that were written to the machine, as corrections. [µm]"""

    def standing_um(self) -> Mapping[str, float]:
        """Return the offsets that act now, as corrections. Default: what was written. [µm]"""
        return self.offsets_um()

    def set_offset_um(self, name: str, offset_um: float) -> None:
        """Change an offset on the machine itself, as its restart does. [µm]"""
        raise NotImplementedError

    def heartbeat(self) -> float | None:
        """Return the heartbeat that stands in the machine; None if it has none. [1]"""
        return None


def _expect(sentence: str, *, holds: bool) -> None:
    if not holds:
        raise AssertionError(sentence)


async def _in_time(stand: Rig, call: Awaitable[T], name: str) -> T:
    """Await a call and check that it keeps its time."""
    began_s = stand.clock.monotonic_s()
    result = await call
    took_s = stand.clock.monotonic_s() - began_s
    _expect(
        f"{name} returned after {took_s:.3f} s, its time is {stand.deadline_s:g} s",
        holds=took_s <= stand.deadline_s + LATE_S,
    )
    return result


async def _pause(stand: Rig) -> None:
    await stand.clock.sleep_until(stand.clock.monotonic_s() + _POLL_S)


# ---- sources ------------------------------------------------------------------------------------


async def check_source(stand: SourceRig) -> None:
    """Check that a source keeps the contract of `Source`.

    It is opened while its machine is away, finds the machine, loses it, finds it again, and is
    closed.

    Parameters
    ----------
    stand : SourceRig
        The source and its machine; the source ends closed.

    Raises
    ------
    AssertionError
        If it breaks the contract: a sentence says how.
    """
    before = asyncio.all_tasks()
    source = stand.source
    if stand.removable:
        await stand.take_away()
    await source.open()
    try:
        if stand.removable:
            await _check_absent_source(stand, "before its machine was there")
            await stand.bring_back()
        await _await_source(stand)
        await _check_present_source(stand)
        if stand.removable:
            for _ in range(2):
                await stand.take_away()
                await _check_absent_source(stand, "after its machine was taken away")
                await stand.bring_back()
                await _await_source(stand)
                await _check_present_source(stand)
    finally:
        await source.close()
    await _check_ended(stand, before, "the source")


async def _read(stand: SourceRig) -> Mapping[str, SourceSample]:
    samples = await _in_time(stand, stand.source.read(stand.deadline_s), "read")
    missing = set(stand.names) - set(samples)
    _expect(f"read left out {', '.join(sorted(missing))}", holds=not missing)
    for name, sample in samples.items():
        _check_sample(name, sample)
    return samples


def _check_sample(name: str, sample: SourceSample) -> None:
    value, age_s, stamp = sample.value, sample.age_s, sample.source_time
    _expect(
        f"the value of {name} is {value!r}: a value is a finite number or None",
        holds=value is None or math.isfinite(value),
    )
    _expect(
        f"the age of {name} is {age_s!r}: an age is not negative, or None",
        holds=age_s is None or 0.0 <= age_s < math.inf,
    )
    _expect(
        f"the time stamp of {name} has no time zone",
        holds=stamp is None or stamp.tzinfo is not None,
    )
    _expect(f"{name} has no status", holds=bool(sample.status))
    _expect(
        f"{name} is called good with the status {sample.status}",
        holds=not sample.good or not sample.status.startswith(("Bad", "Uncertain")),
    )


async def _check_absent_source(stand: SourceRig, when: str) -> None:
    samples = await _read(stand)
    good = [name for name in stand.names if samples[name].good or samples[name].value is not None]
    _expect(f"{', '.join(good)} had a value {when}", holds=not good)
    _expect(f"the source calls itself connected {when}", holds=not stand.source.connected)


async def _await_source(stand: SourceRig) -> None:
    end_s = stand.clock.monotonic_s() + WAIT_S
    while True:
        samples = await _read(stand)
        if any(samples[name].good for name in stand.names):
            return
        _expect(
            f"the source did not find its machine within {WAIT_S:g} s",
            holds=stand.clock.monotonic_s() < end_s,
        )
        await _pause(stand)


async def _check_present_source(stand: SourceRig) -> None:
    samples = await _read(stand)
    _expect("the source read its machine and says that it did not", holds=stand.source.connected)
    without = [name for name in stand.names if samples[name].value is None]
    _expect(f"{', '.join(without)} had no value though the machine is there", holds=not without)
    _expect("a source whose machine is there has ended", holds=not stand.source.ended)


# ---- sinks --------------------------------------------------------------------------------------


async def check_sink(stand: SinkRig) -> None:
    """Check that a sink keeps the contract of `Sink`.

    It is opened while its machine is away, finds the machine, writes, is given what is no number,
    loses the machine, finds it again with other offsets, and is closed.

    Parameters
    ----------
    stand : SinkRig
        The sink and its machine; the sink ends closed.

    Raises
    ------
    AssertionError
        If it breaks the contract: a sentence says how.
    """
    before = asyncio.all_tasks()
    sink = stand.sink
    if stand.removable:
        await stand.take_away()
    standing = dict(stand.offsets_um())
    await sink.open()
    try:
        if stand.removable:
            await _check_absent_sink(stand, "before its machine was there")
            await stand.bring_back()
        await _check_return(stand, standing)
        await _check_writing(stand)
        await _check_no_number(stand)
        if stand.removable:
            await _check_loss(stand)
        last = dict(stand.offsets_um())
    finally:
        await sink.close()
    _expect("closing wrote an offset", holds=_same(stand, stand.offsets_um(), last))
    await _check_ended(stand, before, "the sink")


def _same(stand: SinkRig, one: Mapping[str, float | None], other: Mapping[str, float]) -> bool:
    return all(_close(stand, one.get(name), offset) for name, offset in other.items())


def _close(stand: SinkRig, one: float | None, other: float) -> bool:
    return one is not None and abs(one - other) <= stand.resolution_um


def _corrections(stand: SinkRig, first_um: float) -> dict[str, float]:
    """Return another correction for every output."""
    return {name: first_um + 2.0 * number for number, name in enumerate(stand.names)}


async def _write(stand: SinkRig, correction_um: Mapping[str, float]) -> bool:
    return await _in_time(stand, stand.sink.write(correction_um, stand.deadline_s), "write")


async def _read_back(stand: SinkRig) -> Mapping[str, Applied]:
    applied = await _in_time(stand, stand.sink.read_back(stand.deadline_s), "read_back")
    missing = set(stand.names) - set(applied)
    _expect(f"read_back left out {', '.join(sorted(missing))}", holds=not missing)
    return applied


async def _found(stand: SinkRig) -> Mapping[str, float | None] | None:
    return await _in_time(stand, stand.sink.found(stand.deadline_s), "found")


async def _check_absent_sink(stand: SinkRig, when: str) -> None:
    written = await _write(stand, _corrections(stand, 1.0))
    _expect(f"a write succeeded {when}", holds=not written)
    _expect(f"there was news of the machine {when}", holds=await _found(stand) is None)
    applied = await _read_back(stand)
    accepted = [name for name in stand.names if applied[name].accepted_um is not None]
    _expect(f"{', '.join(accepted)} was read back {when}", holds=not accepted)
    _expect(f"the sink calls itself connected {when}", holds=not stand.sink.connected)


async def _check_return(stand: SinkRig, standing: Mapping[str, float]) -> None:
    """Check that nothing is written before what stands in the machine was read, once."""
    end_s = stand.clock.monotonic_s() + WAIT_S
    while not stand.sink.connected:
        _expect(
            f"the sink did not find its machine within {WAIT_S:g} s",
            holds=stand.clock.monotonic_s() < end_s,
        )
        await _pause(stand)
    beat = stand.heartbeat()
    written = await _write(stand, _corrections(stand, 3.0))
    _expect("a write succeeded before found was read", holds=not written)
    _expect(
        "an offset changed before found was read", holds=_same(stand, stand.offsets_um(), standing)
    )
    _expect("the heartbeat moved before found was read", holds=stand.heartbeat() == beat)
    earlier = dict(stand.standing_um())
    news = await _found(stand)
    while news is None:
        _expect(
            f"there was no news of the machine within {WAIT_S:g} s",
            holds=stand.clock.monotonic_s() < end_s,
        )
        await _pause(stand)
        earlier = dict(stand.standing_um())
        news = await _found(stand)
    later = stand.standing_um()
    for name in stand.names:
        offset_um, ends = news.get(name), sorted((earlier[name], later[name]))
        _expect(
            f"found says {offset_um} um of {name}, the machine has {later[name]} um",
            holds=offset_um is not None
            and ends[0] - stand.resolution_um <= offset_um <= ends[1] + stand.resolution_um,
        )
    _expect("found wrote an offset", holds=_same(stand, stand.offsets_um(), standing))
    _expect("found gave the same news twice", holds=await _found(stand) is None)


async def _check_writing(stand: SinkRig) -> None:
    for first_um in (4.0, -6.0):
        correction_um = _corrections(stand, first_um)
        beat = stand.heartbeat()
        _expect("a write failed", holds=await _write(stand, correction_um))
        _expect(
            f"the machine has {dict(stand.offsets_um())} after {correction_um} was written",
            holds=_same(stand, stand.offsets_um(), correction_um),
        )
        _expect(
            "the heartbeat did not move with a write",
            holds=beat is None or stand.heartbeat() != beat,
        )
        applied = await _read_back(stand)
        for name, wanted_um in correction_um.items():
            _expect(
                f"the sink says that {applied[name].requested_um} um of {name} was requested",
                holds=_close(stand, applied[name].requested_um, wanted_um),
            )


async def _check_no_number(stand: SinkRig) -> None:
    """Check that nothing is written, and nothing lives, where one value is no number."""
    for nonsense in (math.nan, math.inf, -math.inf):
        for name in stand.names:
            standing, beat = dict(stand.offsets_um()), stand.heartbeat()
            correction_um = {**_corrections(stand, 8.0), name: nonsense}
            _expect(f"{nonsense} was accepted", holds=not await _write(stand, correction_um))
            _expect(
                f"an offset changed when {name} was {nonsense}",
                holds=_same(stand, stand.offsets_um(), standing),
            )
            _expect(
                f"the heartbeat moved when {name} was {nonsense}", holds=stand.heartbeat() == beat
            )


async def _check_loss(stand: SinkRig) -> None:
    for offset_um in (None, 11.0):
        standing = dict(stand.offsets_um())
        await stand.take_away()
        await _check_absent_sink(stand, "after its machine was taken away")
        if offset_um is not None and stand.settable:
            for name in stand.names:
                stand.set_offset_um(name, offset_um)
                standing[name] = offset_um
        await stand.bring_back()
        await _check_return(stand, standing)
        await _check_writing(stand)


async def _check_ended(stand: Rig, before: set["asyncio.Task[object]"], what: str) -> None:
    """Check that every task ends; the machine of a stand may need a moment for its own."""
    end_s = stand.clock.monotonic_s() + LATE_S
    while left := [task for task in asyncio.all_tasks() - before if not task.done()]:
        names = ", ".join(task.get_name() for task in left)
        _expect(
            f"something of {what} runs on after close: {names}",
            holds=stand.clock.monotonic_s() < end_s,
        )
        await _pause(stand)
