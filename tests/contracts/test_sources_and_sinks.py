"""Every source and every sink of the project on its stand: the contract holds for all of them."""

import asyncio
from collections.abc import Iterator, Mapping, Sequence
from typing import final

import pytest

from tests.opcua_server import NAMESPACE, Cable, Machine, start_machine
from thermaxis.runtime._connection import ConnectionSettings
from thermaxis.runtime._opcua_session import OpcUaSession
from thermaxis.runtime._ports import (
    NOT_READ,
    Applied,
    Clock,
    Sink,
    Source,
    SourceSample,
    SystemClock,
)
from thermaxis.runtime._sign import AWAY, TOWARDS
from thermaxis.runtime._virtual_time import VirtualClock, run_in_virtual_time
from thermaxis.runtime.sinks.opcua import OpcUaOutput, OpcUaSink
from thermaxis.runtime.sources.opcua import NodeSettings, OpcUaSource
from thermaxis.runtime.testing import SinkStand, SourceStand, check_sink, check_source

NODE = f"nsu={NAMESPACE};s="


@pytest.fixture(scope="module")
def runner() -> Iterator[asyncio.Runner]:
    with asyncio.Runner() as runner:
        yield runner


@pytest.fixture(scope="module")
def machine(runner: asyncio.Runner) -> Iterator[Machine]:
    machine = runner.run(start_machine())
    yield machine
    runner.run(machine.server.stop())


def session_of(cable: Cable) -> OpcUaSession:
    settings = ConnectionSettings(
        name="machine", url=cable.url, security="none", timeout_s=0.3, retry_s=0.02
    )
    return OpcUaSession(settings, SystemClock())


class OpcUaStand:
    clock: Clock = SystemClock()

    async def take_away(self) -> None:
        await self.cable.cut()

    async def bring_back(self) -> None:
        await self.cable.mend()

    cable: Cable


@final
class OpcUaSourceStand(OpcUaStand, SourceStand):
    def __init__(self, cable: Cable) -> None:
        self.cable = cable
        nodes = {
            "T1": NodeSettings(node=NODE + "T1", unit="degC"),
            "T3": NodeSettings(node=NODE + "T3", unit="degC", scale=0.1),
            "referenced": NodeSettings(node=NODE + "Referenced", unit="bool"),
        }
        self.names = tuple(nodes)
        self.source = OpcUaSource(session_of(cable), nodes)


@final
class OpcUaSinkStand(OpcUaStand, SinkStand):
    """One offset in mm towards the workpiece, one counted in tenths of a micrometre."""

    resolution_um = 0.05

    def __init__(self, cable: Cable, machine: Machine) -> None:
        self.cable, self.machine = cable, machine
        outputs = {
            "Z_um": OpcUaOutput(node=NODE + "Offset", unit="mm", sign=TOWARDS),
            "X_um": OpcUaOutput(node=NODE + "OffsetInt", unit="0.1 um", sign=AWAY),
        }
        self.names = tuple(outputs)
        self.sink = OpcUaSink(session_of(cable), outputs, NODE + "Beat")

    def offsets_um(self) -> Mapping[str, float]:
        value = self.machine.value
        return {"Z_um": -1e3 * float(value("Offset")), "X_um": 0.1 * float(value("OffsetInt"))}

    def set_offset_um(self, name: str, offset_um: float) -> None:
        if name == "Z_um":
            self.machine.put("Offset", -1e-3 * offset_um)
        else:
            self.machine.put("OffsetInt", round(10 * offset_um))

    def heartbeat(self) -> float | None:
        return float(self.machine.value("Beat"))


async def on_a_cable(machine: Machine, check) -> None:
    cable = Cable()
    cable.plug(machine)
    await cable.mend()
    try:
        await check(cable)
    finally:
        await cable.cut()


def test_the_opcua_source_keeps_its_contract(runner: asyncio.Runner, machine: Machine) -> None:
    runner.run(on_a_cable(machine, lambda cable: check_source(OpcUaSourceStand(cable))))


def test_the_opcua_sink_keeps_its_contract(runner: asyncio.Runner, machine: Machine) -> None:
    runner.run(on_a_cable(machine, lambda cable: check_sink(OpcUaSinkStand(cable, machine))))
