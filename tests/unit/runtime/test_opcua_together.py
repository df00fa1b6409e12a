"""One request for all who ask in the same turn of the event loop; each has its own answer."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from datetime import UTC, datetime
from typing import Any
from unittest.mock import AsyncMock, MagicMock

import pytest
from asyncua import ua

from tests.unit.runtime.simulated import SimulatedHistorian, compensation, enabled_for, state_of
from thermaxis.compensation import SupervisorState
from thermaxis.runtime import (
    AWAY,
    CompensationLoop,
    ConnectionSettings,
    LoopSettings,
    OpcUaSession,
    Ports,
    VirtualClock,
)
from thermaxis.runtime.opcua._link import SERVER_TIME, Link
from thermaxis.runtime.sinks import OpcUaOutput, OpcUaSink
from thermaxis.runtime.sources import NodeSettings, OpcUaSource

VIRTUAL_TIME = True
S, C, REFERENCED, OFFSET = "ns=2;s=S", "ns=2;s=C", "ns=2;s=Referenced", "ns=2;s=Offset"
SETTINGS = ConnectionSettings(name="machine", url="opc.tcp://127.0.0.1:1/x", security="none")
CYCLE_S = 0.1


class Server:
    """A server in memory, behind the library's client."""

    def __init__(self, clock: VirtualClock) -> None:
        self.clock = clock
        self.values: dict[str, Any] = {S: 23.0, C: 20.0, REFERENCED: True, OFFSET: 0.0}
        self.late_s = 0.0
        self.error: Exception | None = None
        self.requests: list[tuple[str, ...]] = []
        self.written_s: list[float] = []

    async def read(self, parameters: ua.ReadParameters) -> list[ua.DataValue]:
        asked = [(one.NodeId, one.AttributeId) for one in parameters.NodesToRead]
        self.requests.append(tuple(node.to_string() for node, _ in asked[:-1]))
        await asyncio.sleep(self.late_s)
        if self.error is not None:
            raise self.error
        return [self.value(node, attribute) for node, attribute in asked]

    def value(self, node: ua.NodeId, attribute: ua.AttributeIds) -> ua.DataValue:
        if node == SERVER_TIME:
            return ua.DataValue(ua.Variant(self.clock.utc()))
        if attribute is not ua.AttributeIds.Value:
            return ua.DataValue(ua.Variant(ua.NodeId(ua.ObjectIds.Double)))
        value = ua.Variant(self.values[node.to_string()])
        return ua.DataValue(value, SourceTimestamp=self.clock.utc())

    async def write(self, parameters: ua.WriteParameters) -> list[ua.StatusCode]:
        for one in parameters.NodesToWrite:
            self.values[one.NodeId.to_string()] = one.Value.Value.Value
        self.written_s.append(self.clock.monotonic_s())
        return [ua.StatusCode()] * len(parameters.NodesToWrite)

    def link(self) -> Link:
        """Return a connection that is there."""
        client = MagicMock(disconnect=AsyncMock(), close_session=AsyncMock())
        client.uaclient.protocol = None
        client.uaclient.session.read, client.uaclient.session.write = self.read, self.write
        return Link(client)


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Server:
    server = Server(VirtualClock(datetime(2026, 1, 1, tzinfo=UTC)))

    async def connected(*_: object) -> Link:
        return server.link()

    monkeypatch.setattr("thermaxis.runtime.opcua._session.connect_once", connected)
    return server


@asynccontextmanager
async def ports(server: Server) -> AsyncIterator[tuple[OpcUaSession, OpcUaSource, OpcUaSink]]:
    """A session that is connected, with its source and sink."""
    session = OpcUaSession(SETTINGS, server.clock)
    flag = NodeSettings(node=REFERENCED, unit="bool")
    nodes = {name: NodeSettings(node=f"ns=2;s={name.upper()}", unit="degC") for name in "sc"}
    source = OpcUaSource(session, {**nodes, "interlock.referenced": flag})
    output = OpcUaOutput(node=OFFSET, unit="um", sign=AWAY)
    sink = OpcUaSink(session, {"Z_um": output})
    await session.open()
    await asyncio.sleep(0.01)
    yield session, source, sink
    await session.close()


async def test_who_asks_in_one_turn_is_answered_by_one_request_each_with_its_own_values(
    server: Server,
) -> None:
    async with ports(server) as (session, source, sink):
        server.values[OFFSET] = 7.0
        samples, applied, none, unknown = await asyncio.gather(
            source.read(0.25),
            sink.read_back(0.25),
            session.read([], 0.25),
            session.read(["nsu=urn:nobody;s=S", C], 0.25),
        )
        assert [one.value for one in samples.values()] == [23.0, 20.0, 1.0]
        assert [one.age_s for one in samples.values()] == [0.0] * 3
        assert applied["Z_um"].accepted_um == pytest.approx(7.0)
        assert none == []
        assert unknown is not None
        assert unknown[0].StatusCode.name == "BadNodeIdUnknown"
        assert unknown[1].Value.Value == 20.0
        assert server.requests == [(S, C, REFERENCED, OFFSET, C)]


async def test_who_asks_alone_or_later_has_a_request_of_its_own(server: Server) -> None:
    async with ports(server) as (_, source, sink):
        server.late_s = 0.01
        await source.read(0.25)
        reading = asyncio.ensure_future(source.read(0.25))
        await asyncio.sleep(0.005)  # it is under way
        await sink.read_back(0.25)
        await reading
        assert server.requests == [(S, C, REFERENCED), (S, C, REFERENCED), (OFFSET,)]


async def test_a_request_that_fails_fails_for_all_who_asked(server: Server) -> None:
    async with ports(server) as (session, source, sink):
        server.error = ConnectionError()
        samples, applied = await asyncio.gather(source.read(0.25), sink.read_back(0.25))
        assert not any(one.good for one in samples.values())
        assert applied["Z_um"].accepted_um is None
        assert not session.connected
        assert not source.connected


async def test_each_waits_until_its_own_deadline(server: Server) -> None:
    async with ports(server) as (session, source, sink):
        server.late_s = 0.2
        samples, applied = await asyncio.gather(source.read(0.1), sink.read_back(0.3))
        assert not any(one.good for one in samples.values())
        assert applied["Z_um"].accepted_um == 0.0
        assert session.connected


async def test_who_does_not_wait_any_more_takes_nothing_from_the_others(server: Server) -> None:
    async with ports(server) as (_, source, sink):
        reading = asyncio.ensure_future(source.read(0.25))
        looking = asyncio.ensure_future(sink.read_back(0.25))
        await asyncio.sleep(0)
        reading.cancel()
        assert (await looking)["Z_um"].accepted_um == 0.0
        assert len(server.requests) == 1
        assert (await sink.read_back(0.25))["Z_um"].accepted_um == 0.0


@pytest.mark.parametrize("late_s", [0.0, 0.1, 0.3])
async def test_a_loop_reads_and_looks_with_one_request_and_writes_nothing_on_a_late_look(
    server: Server, late_s: float
) -> None:
    async with ports(server) as (_, source, sink):
        clock, historian = server.clock, SimulatedHistorian()
        loop = CompensationLoop(
            compensation(cycle_s=CYCLE_S),
            LoopSettings(machine="m", model_file="m.json", model_sha256="00", at_stop="leave"),
            Ports(source, sink, historian, clock, one_server=True),
        )
        stop = asyncio.Event()
        running = asyncio.create_task(loop.run(stop))
        await asyncio.sleep(1.0)
        await enabled_for(loop, 10.0)
        assert state_of(loop) is SupervisorState.ACTIVE
        server.late_s, began, written = late_s, len(server.requests), len(server.written_s)
        await asyncio.sleep(10.0)
        both = (S, C, REFERENCED, OFFSET)
        asked, wrote = server.requests[began:], len(server.written_s) - written
        if late_s < 0.25:  # as long as a request may take
            assert set(asked) == {both, (OFFSET,)}  # and what was written is read back
            assert abs(asked.count(both) - wrote) <= 1
            assert wrote > 30
        else:
            assert wrote <= 1
        stop.set()
        await running
