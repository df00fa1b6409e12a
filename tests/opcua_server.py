"""A small machine as an OPC UA server in the test's own program, and a cable to it.

The server is asyncua's; the system tests have one that others wrote. The cable is a relay on
127.0.0.1: cut, it refuses and drops connections as a killed server does; stopped, it takes what
is sent and answers nothing, as a frozen one does; and it can be plugged into another server.
"""

import asyncio
import contextlib
from collections.abc import Callable, Mapping
from datetime import UTC, datetime, timedelta
from typing import final

from asyncua import Server, ua
from asyncua.crypto.permission_rules import User, UserRole
from asyncua.server.user_managers import UserManager

from tests.in_time import LONGEST_S

NAMESPACE = "urn:test:machine"
GOOD = ua.StatusCodes.Good


@final
class OneUser(UserManager):
    """Lets one user in, and nobody without a name."""

    def __init__(self, name: str, password: str) -> None:
        self.name, self.password = name, password

    def get_user(self, iserver, username=None, password=None, certificate=None) -> User | None:
        if username == self.name and password == self.password:
            return User(role=UserRole.Admin)
        return None


@final
class Machine:
    """Three temperatures, flags, offsets of several types and a heartbeat."""

    def __init__(
        self,
        server: Server,
        index: int,
        port: int,
        kinds: Mapping[str, tuple[object, ua.VariantType]],
    ) -> None:
        self.server, self.index, self.port, self.kinds = server, index, port, kinds
        self.clock_ahead_s = 0.0
        self.tells_time = True
        server.iserver.aspace.set_attribute_value_callback(
            ua.NodeId(ua.ObjectIds.Server_ServerStatus_CurrentTime),
            ua.AttributeIds.Value,
            self._say_time,
        )

    def now(self) -> datetime:
        """What the machine's clock shows."""
        return datetime.now(UTC) + timedelta(seconds=self.clock_ahead_s)

    def _say_time(self, _node: ua.NodeId, _attribute: ua.AttributeIds) -> ua.DataValue:
        if not self.tells_time:
            status = ua.StatusCode(ua.UInt32(ua.StatusCodes.BadUserAccessDenied))
            return ua.DataValue(StatusCode=status)
        return ua.DataValue(ua.Variant(self.now(), ua.VariantType.DateTime))

    def node_id(self, name: str) -> ua.NodeId:
        return ua.NodeId(name, self.index)

    def put(
        self,
        name: str,
        value: object,
        *,
        status: int = GOOD,
        kind: ua.VariantType | None = None,
        age_s: float = 0.0,
        stamped: bool = True,
    ) -> None:
        """Set what a node tells, with any status and age."""
        now = self.now()
        variant = ua.Variant(value, kind if kind is not None else self.kinds[name][1])
        aspace = self.server.iserver.aspace
        found = aspace[self.node_id(name)].attributes[ua.AttributeIds.Value]
        found.value = ua.DataValue(
            Value=variant,
            StatusCode=ua.StatusCode(ua.UInt32(status)),
            SourceTimestamp=now - timedelta(seconds=age_s) if stamped else None,
            ServerTimestamp=now,
        )

    def value(self, name: str) -> object:
        aspace = self.server.iserver.aspace
        return aspace[self.node_id(name)].attributes[ua.AttributeIds.Value].value.Value.Value

    def reset(self) -> None:
        """Put everything as it was at the start."""
        self.clock_ahead_s, self.tells_time = 0.0, True
        for name, (value, _) in self.kinds.items():
            self.put(name, value)

    @property
    def sessions(self) -> int:
        """How many sessions clients have."""
        return len(self.server.bserver.clients)

    async def stop(self) -> None:
        await self.server.stop()


KINDS: Mapping[str, tuple[object, ua.VariantType]] = {
    "T1": (20.5, ua.VariantType.Double),
    "T2": (21.5, ua.VariantType.Float),
    "T3": (225, ua.VariantType.Int16),
    "Referenced": (True, ua.VariantType.Boolean),
    "On": (1, ua.VariantType.Byte),
    "Text": ("on", ua.VariantType.String),
    "Row": ([1.0, 2.0], ua.VariantType.Double),
    "Offset": (0.0, ua.VariantType.Double),
    "Accepted": (0.0, ua.VariantType.Double),
    "Effective": (0.0, ua.VariantType.Double),
    "OffsetFloat": (0.0, ua.VariantType.Float),
    "OffsetInt": (0, ua.VariantType.Int16),
    "Beat": (7, ua.VariantType.UInt32),
    "ReadOnly": (0.0, ua.VariantType.Double),
    "BeatBool": (False, ua.VariantType.Boolean),
    "BeatByte": (254, ua.VariantType.Byte),
    "Probe": (0.0125, ua.VariantType.Double),
}


async def start_machine(
    *,
    other_namespaces: int = 0,
    kinds: Mapping[str, tuple[object, ua.VariantType]] = KINDS,
    read_only: tuple[str, ...] = ("ReadOnly",),
    user: OneUser | None = None,
    pki: tuple[str, str] | None = None,
) -> Machine:
    """Start a machine on a free port of 127.0.0.1.

    With `pki` (certificate, key) it takes encrypted connections only.
    """
    server = Server(user_manager=user)
    await server.init()
    server.disable_clock()
    server.set_endpoint("opc.tcp://127.0.0.1:0/machine")
    server.set_server_name("machine")
    if pki is not None:
        await server.set_application_uri("urn:test:server")
        server.set_security_policy([ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt])
        server.set_identity_tokens([ua.UserNameIdentityToken])
        await server.load_certificate(pki[0])
        await server.load_private_key(pki[1])
    for number in range(other_namespaces):
        await server.register_namespace(f"urn:test:other:{number}")
    index = await server.register_namespace(NAMESPACE)
    folder = await server.nodes.objects.add_object(ua.NodeId("Machine", index), "Machine")
    for name, (value, kind) in kinds.items():
        node = await folder.add_variable(
            ua.NodeId(name, index), name, ua.Variant(value, kind), datatype=ua.NodeId(kind.value)
        )
        if name not in read_only:
            await node.set_writable()
    await server.start()
    port = server.bserver._server.sockets[0].getsockname()[1]
    return Machine(server, index, port, kinds)


@final
class Cable:
    """A relay to a server; `plug` it into another one, `cut`, `stop` and `mend` it."""

    def __init__(self) -> None:
        self.port = 0
        self._target = 0
        self.spoil: Callable[[bytes], bytes] = bytes
        """What becomes of the server's answers on their way."""
        self._listener: asyncio.Server | None = None
        self._flowing = asyncio.Event()
        self._flowing.set()
        self._ends: set[asyncio.StreamWriter] = set()
        self._tasks: set[asyncio.Task[None]] = set()

    @property
    def url(self) -> str:
        return f"opc.tcp://127.0.0.1:{self.port}/machine"

    def plug(self, machine: Machine) -> None:
        self._target = machine.port

    async def mend(self) -> None:
        """Let connections through."""
        self._flowing.set()
        if self._listener is None:
            self._listener = await asyncio.start_server(self._relay, "127.0.0.1", self.port)
            self.port = self._listener.sockets[0].getsockname()[1]

    async def cut(self) -> None:
        """Refuse connections and drop those that are there."""
        listener, self._listener = self._listener, None
        if listener is not None:
            listener.close()
            await listener.wait_closed()
        self._flowing.set()
        while True:
            for end in tuple(self._ends):
                end.transport.abort()
            if not self._tasks:
                return
            await asyncio.wait(self._tasks, timeout=0.05)

    def stop(self) -> None:
        """Answer nothing more, and keep the connections."""
        self._flowing.clear()

    async def _relay(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        ends = [writer]
        try:
            there, back = await asyncio.open_connection("127.0.0.1", self._target)
            ends.append(back)
            if self._listener is None:  # cut meanwhile
                return
            self._ends.update(ends)
            async with asyncio.TaskGroup() as group:
                group.create_task(self._pump(reader, back))
                group.create_task(self._pump(there, writer, spoiled=True))
        except* OSError:
            pass
        finally:
            for end in ends:
                end.close()
                with contextlib.suppress(OSError):
                    await end.wait_closed()
            self._ends.difference_update(ends)
            self._tasks.discard(task)

    async def _pump(
        self, source: asyncio.StreamReader, sink: asyncio.StreamWriter, *, spoiled: bool = False
    ) -> None:
        while chunk := await source.read(65536):
            await self._flowing.wait()
            sink.write(self.spoil(chunk) if spoiled else chunk)
        sink.close()
        raise ConnectionResetError


async def until(condition, limit_s: float = LONGEST_S) -> float:
    """Wait for a condition; return how long it took. [s]"""
    loop = asyncio.get_running_loop()
    began_s = loop.time()
    while not condition():
        assert loop.time() - began_s < limit_s, "the condition did not come true"
        await asyncio.sleep(0.005)
    return loop.time() - began_s
