"""The project's client for the foreign server: certificates, one session, source and sink."""

import asyncio
import time
from collections.abc import AsyncGenerator, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import pytest

from tests.system.opcua.foreign_server import ForeignServer
from thermaxis.runtime import AWAY, TOWARDS, ConnectionSettings, OpcUaSession, Secret, SystemClock
from thermaxis.runtime.opcua import NewCertificate, make_pair, write_pair
from thermaxis.runtime.sinks import OpcUaOutput, OpcUaSink
from thermaxis.runtime.sources import NodeSettings, OpcUaSource

DEADLINE_S = 0.5
URI = "urn:thermaxis:client"
USERS = {
    "operator": {"password": "compensates", "role": "operator"},
    "viewer": {"password": "looks", "role": "viewer"},
}
CHANNELS = ("Temp1", "Temp2", "Temp3")
FLAGS = ("Referenced", "EmergencyStop", "M5.0")
OUTPUTS = {
    "Z_um": ("Z", "mm", AWAY),
    "X_um": ("X", "um", TOWARDS),
    "Y_um": ("Y", "0.1 um", AWAY),
}
"""Axis, unit and sign of the machine's offsets, of three types."""


@dataclass(frozen=True)
class Identity:
    """Own certificate and key, and the certificate of the server."""

    certificate: Path
    private_key: Path
    server_certificate: Path


def make_identity(folder: Path, name: str, server_certificate: Path, uri: str = URI) -> Identity:
    """Make a certificate as ``thermaxis certificate new`` does."""
    certificate, key = folder / f"{name}.der", folder / f"{name}.pem"
    pair = make_pair(NewCertificate(application_uri=uri, hosts=("127.0.0.1",)), datetime.now(UTC))
    write_pair(certificate, key, pair)
    return Identity(certificate, key, server_certificate)


def open_settings(machine: ForeignServer) -> ConnectionSettings:
    """Return a connection without security."""
    return ConnectionSettings(name="control", url=machine.url, security="none")


def secured_settings(
    machine: ForeignServer, identity: Identity, user: str = "operator", password: str = ""
) -> ConnectionSettings:
    """Return a connection with certificates, a user and a password."""
    return ConnectionSettings(
        name="control",
        url=machine.url,
        security="Basic256Sha256",
        user=user,
        password=Secret(password or USERS.get(user, {}).get("password", "")),
        certificate=identity.certificate,
        private_key=identity.private_key,
        server_certificate=identity.server_certificate,
    )


def nodes(machine: ForeignServer) -> Mapping[str, NodeSettings]:
    """Return what is read: three temperatures, three flags, the diameter, a text."""
    units = dict.fromkeys(CHANNELS, "degC") | dict.fromkeys(FLAGS, "bool")
    units |= {"Diameter": "mm", "State": "1"}
    return {name: NodeSettings(node=machine.node(name), unit=unit) for name, unit in units.items()}


def outputs(machine: ForeignServer, *names: str) -> Mapping[str, OpcUaOutput]:
    """Return where offsets go; without names, all three."""
    return {
        name: OpcUaOutput(
            node=machine.node(f"Offset{axis}"),
            read_back_node=machine.node(f"Accepted{axis}"),
            effective_node=machine.node(f"Effective{axis}"),
            unit=unit,
            sign=sign,
        )
        for name, (axis, unit, sign) in OUTPUTS.items()
        if name in (names or OUTPUTS)
    }


@dataclass(frozen=True)
class Link:
    """A session with its source and sink."""

    session: OpcUaSession
    source: OpcUaSource
    sink: OpcUaSink

    async def connected(self, limit_s: float = 5.0) -> None:
        """Wait for the connection."""
        began_s = time.monotonic()
        while not self.session.connected:
            if time.monotonic() - began_s > limit_s:
                pytest.fail(f"no connection within {limit_s:g} s: {self.session.last_error}")
            await asyncio.sleep(0.005)

    async def written(self, limit_s: float = 2.0, **correction_um: float) -> bool:
        """Read what stands in the machine, then write, and wait until the PLC has taken it."""
        await self.sink.found(DEADLINE_S)
        if not await self.sink.write(correction_um, DEADLINE_S):
            return False
        began_s = time.monotonic()
        while time.monotonic() - began_s < limit_s:
            applied = await self.sink.read_back(DEADLINE_S)
            found = {name: applied[name].accepted_um for name in correction_um}
            if found == pytest.approx(correction_um, abs=0.051):
                return True
        return False


@asynccontextmanager
async def linked(
    settings: ConnectionSettings, machine: ForeignServer, *names: str
) -> AsyncGenerator[Link]:
    """Open source and sink on one session; nothing of them is left at the end."""
    clock = SystemClock()
    session = OpcUaSession(settings, clock)
    source = OpcUaSource(session, nodes(machine))
    sink = OpcUaSink(session, outputs(machine, *names), machine.node("Heartbeat"))
    await source.open()
    await sink.open()
    try:
        yield Link(session, source, sink)
    finally:
        await sink.close()
        await source.close()


async def until(condition: Callable[[], bool], limit_s: float, what: str) -> float:
    """Wait for a condition and return how long it took; fail after a time. [s]"""
    began_s = time.monotonic()
    while not condition():
        if time.monotonic() - began_s > limit_s:
            pytest.fail(f"not within {limit_s:g} s: {what}")
        await asyncio.sleep(0.005)
    return time.monotonic() - began_s
