"""What stands between a reading and its being believed: life counters, time stamps, pins of HAL."""

import asyncio
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime

import pytest
from asyncua import ua

from tests.opcua_server import NAMESPACE, Machine, until
from thermaxis.codes import Message
from thermaxis.runtime import ConnectionSettings, OpcUaSession, SystemClock
from thermaxis.runtime.sources import LifeCounter, NodeSettings, OpcUaSource

COUNTER = f"nsu={NAMESPACE};s=OffsetInt"
STANDS = Message("error-life_stands", {"node": COUNTER, "within_s": 5.0})


@dataclass
class HandClock:
    """A clock that a test winds."""

    now_s: float = 100.0

    def monotonic_s(self) -> float:
        return self.now_s

    def utc(self) -> datetime:
        return datetime(2026, 11, 21, tzinfo=UTC)

    async def sleep_until(self, monotonic_s: float) -> None:
        self.now_s = monotonic_s


class Plc:
    """A source of two temperatures, the second of them stamped on change, and a life counter."""

    def __init__(self, machine: Machine) -> None:
        self.machine, self.clock, self.count = machine, HandClock(), 0
        url = f"opc.tcp://127.0.0.1:{machine.port}/machine"
        session = OpcUaSession(
            ConnectionSettings(name="machine", url=url, security="none"), SystemClock()
        )
        life = LifeCounter(COUNTER, 5.0, self.clock)
        nodes = {
            name: NodeSettings(
                node=f"nsu={NAMESPACE};s={name}", unit="degC", on_change=name == "T2"
            )
            for name in ("T1", "T2")
        }
        self.source = OpcUaSource(session, nodes, life)

    async def open(self) -> None:
        await self.source.open()
        await until(lambda: self.source.session.connected)

    def lives(self, passed_s: float, *, status: int = 0) -> None:
        """Let time pass, and the counter count then."""
        self.clock.now_s += passed_s
        self.count += 1
        self.machine.put("OffsetInt", self.count, status=status)

    async def read(self) -> tuple[list[float | None], list[float | None], Message | None]:
        samples = await self.source.read(5.0)
        assert self.source.connected is (self.source.failure is None)
        found = [samples[name] for name in ("T1", "T2")]
        return [s.value for s in found], [s.age_s for s in found], self.source.failure


@pytest.fixture
def plc(runner: asyncio.Runner, machine: Machine) -> Iterator[Plc]:
    plc = Plc(machine)
    runner.run(plc.open())
    yield plc
    runner.run(plc.source.close())


async def test_nothing_is_believed_before_the_life_counter_has_moved_and_after_it_stands(
    plc: Plc,
) -> None:
    plc.machine.put("T1", 20.0)
    plc.machine.put("T2", 21.0)
    nothing = ([None, None], [None, None], STANDS)
    assert await plc.read() == nothing
    plc.lives(1.0)
    assert (await plc.read())[::2] == ([20.0, 21.0], None)
    plc.clock.now_s += 5.0
    plc.machine.put("T1", 20.5)  # a gateway stamps anew what its PLC does not change any more
    assert (await plc.read())[::2] == ([20.5, 21.0], None)
    plc.clock.now_s += 0.01
    assert await plc.read() == nothing
    plc.lives(60.0)
    assert (await plc.read())[::2] == ([20.5, 21.0], None)


async def test_a_bad_value_of_the_counter_is_no_sign_of_life(plc: Plc) -> None:
    plc.lives(0.0)
    await plc.read()
    for _ in range(3):
        plc.lives(1.0, status=ua.StatusCodes.BadNoCommunication)
        assert (await plc.read())[2] == STANDS


async def test_a_value_that_is_stamped_on_change_is_as_old_as_the_last_sign_of_life(
    plc: Plc,
) -> None:
    plc.lives(0.0)
    await plc.read()
    plc.machine.put("T1", 20.0, age_s=3600.0)
    plc.machine.put("T2", 21.0, age_s=3600.0)
    plc.lives(1.0)
    for passed_s in (0.0, 2.0, 2.0):
        plc.clock.now_s += passed_s
        values, ages, _ = await plc.read()
        assert values == [20.0, 21.0]
        assert ages[0] == pytest.approx(3600.0, abs=2.0)  # which the rules call too old
        assert ages[1] == plc.clock.now_s - 101.0
