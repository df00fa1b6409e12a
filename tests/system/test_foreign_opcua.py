"""The OPC UA client against a server written by others: node-opcua, in a program of its own.

The server stands for a machine with string node ids, users, certificates, a small PLC that takes
an offset over only when the heartbeat moved, and faults on request: ``opcua/server.js``. What the
machine was told stands in its own record, so that limits are judged from the machine's side.
"""

import asyncio
import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from asyncua import ua
from asyncua.client.client import Client
from asyncua.common.node import Node

from tests.system.opcua.foreign_server import NAMESPACE_URI, ForeignServer, install, missing

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]


@pytest.fixture(scope="module", autouse=True)
def _node_opcua() -> None:
    """Fail, in CI and elsewhere, where there is no node-opcua: a skipped proof proves nothing."""
    reason = missing()
    if reason:
        pytest.fail(reason, pytrace=False)
    install()


@pytest.fixture(scope="module")
def open_machine(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ForeignServer]:
    """A machine that anybody may write to, as it is found in test halls only."""
    folder = tmp_path_factory.mktemp("open") / "machine"
    with ForeignServer(folder, unsecured=True, secured=False, anonymous=True) as server:
        yield server


@pytest.fixture
def machine(open_machine: ForeignServer) -> Iterator[ForeignServer]:
    """The same without a fault."""
    open_machine.tell(fault="none", channel="Temp1")
    yield open_machine
    open_machine.tell(fault="none", channel="Temp1")


async def until(condition: Callable[[], bool], limit_s: float, what: str) -> float:
    """Wait for a condition and return how long it took; fail after a time. [s]"""
    began_s = time.monotonic()
    while not condition():
        if time.monotonic() - began_s > limit_s:
            pytest.fail(f"not within {limit_s:g} s: {what}")
        await asyncio.sleep(0.005)
    return time.monotonic() - began_s


# ---- the foreign server is what it claims -------------------------------------------------------


def test_a_missing_node_is_named_with_the_command_that_installs_it() -> None:
    reason = missing(("node-that-nobody-has",))
    assert "node-that-nobody-has not found" in reason
    assert "apt-get install" in reason
    assert missing() == ""


async def nodes_of(client: Client, *names: str) -> list[Node]:
    """Return the machine's nodes, by the library alone."""
    index = await client.get_namespace_index(NAMESPACE_URI)
    return [client.get_node(f"ns={index};s=/Plc/{name}") for name in names]


async def values(machine: ForeignServer, *names: str) -> list[ua.DataValue]:
    """Read with the library alone, as a second way beside the project's client."""
    async with Client(machine.url) as client:
        return await client.read_attributes(await nodes_of(client, *names))


def test_the_foreign_server_refuses_every_type_but_the_nodes_own(machine: ForeignServer) -> None:
    kinds = {
        "OffsetZ": ua.VariantType.Double,
        "OffsetX": ua.VariantType.Float,
        "OffsetY": ua.VariantType.Int32,
        "Heartbeat": ua.VariantType.UInt32,
    }

    async def attempt() -> dict[tuple[str, ua.VariantType], str]:
        said: dict[tuple[str, ua.VariantType], str] = {}
        async with Client(machine.url) as client:
            for name, node in zip(kinds, await nodes_of(client, *kinds), strict=True):
                for kind in kinds.values():
                    try:
                        await node.write_value(ua.DataValue(ua.Variant(0, kind)))
                        said[name, kind] = "Good"
                    except ua.UaStatusCodeError as error:
                        said[name, kind] = type(error).__name__
        return said

    said = asyncio.run(attempt())
    for (name, kind), status in said.items():
        assert status == ("Good" if kind is kinds[name] else "BadTypeMismatch"), (name, kind)


FAULTS = {
    "none": ("Good", 21.0),
    "bad": ("BadSensorFailure", 0.0),
    "uncertain": ("UncertainSensorNotAccurate", 21.0),
    "nan": ("Good", math.nan),
    "null": ("BadNoCommunication", None),
    "jump": ("Good", 36.0),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_the_foreign_server_sends_the_fault_that_was_asked_for(
    fault: str, machine: ForeignServer
) -> None:
    status, value = FAULTS[fault]
    machine.tell(fault=fault, channel="Temp2")
    machine.tell(sample=True)
    temp1, temp2 = asyncio.run(values(machine, "Temp1", "Temp2"))
    assert temp1.StatusCode is not None
    assert temp1.StatusCode.is_good()
    assert temp2.StatusCode is not None
    assert temp2.StatusCode.name == status
    found = temp2.Value.Value if temp2.Value is not None else None
    assert found == pytest.approx(value, abs=2.0, nan_ok=True)


def test_the_machine_takes_an_offset_over_only_when_the_heartbeat_moves(
    machine: ForeignServer,
) -> None:
    async def write(name: str, value: float, kind: ua.VariantType) -> None:
        async with Client(machine.url) as client:
            (node,) = await nodes_of(client, name)
            await node.write_value(ua.DataValue(ua.Variant(value, kind)))

    def accepted() -> list[float]:
        return [line.accepted_um["Z"] for line in machine.record() if line.kind == "accepted"]

    before = accepted()
    asyncio.run(write("OffsetZ", 0.0123, ua.VariantType.Double))
    machine.tell(plc_cycle=True)
    assert accepted() == before
    asyncio.run(write("Heartbeat", 77, ua.VariantType.UInt32))
    machine.tell(plc_cycle=True)
    assert accepted() == [*before, pytest.approx(12.3)]


def test_the_record_names_every_start_and_the_offset_that_was_kept(tmp_path: Path) -> None:
    with ForeignServer(tmp_path / "machine", unsecured=True, anonymous=True) as machine:
        began_s, port = machine.ready_s, machine.port
        machine.prepare()
        killed_s = machine.kill()
        machine.listen()
        assert machine.port == port
        assert machine.ready_s - killed_s < 2.0
        machine.tell(fault="exit")
        assert machine.wait_for_end() == 1
        first, second = machine.record()
    assert (first.kind, second.kind) == ("start", "start")
    assert first.monotonic_s == pytest.approx(began_s, abs=0.1)
    assert second.monotonic_s == pytest.approx(machine.ready_s, abs=0.1)
    assert second.accepted_um == {"Z": 0.0, "X": 0.0, "Y": 0.0}
