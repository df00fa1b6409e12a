"""One connection to a server: how it is made, what is asked of it, how it ends."""

import asyncio
import contextlib
import logging
import socket
import struct
from collections.abc import Coroutine, Mapping, Sequence
from datetime import UTC, datetime
from typing import Any, Final, NamedTuple, TypeVar, cast, final

from asyncua import ua
from asyncua.client.client import Client
from asyncua.crypto.security_policies import (
    SecurityPolicy,
    SecurityPolicyAes128Sha256RsaOaep,
    SecurityPolicyAes256Sha256RsaPss,
    SecurityPolicyBasic256Sha256,
)
from asyncua.ua.attribute_ids import AttributeIds
from asyncua.ua.object_ids import ObjectIds

from thermaxis.runtime._connection import ConnectionSettings
from thermaxis.runtime._ports import Clock
from thermaxis.runtime.opcua._failures import FAILURES, LASTING, within
from thermaxis.runtime.opcua._nodes import node_id, parse_node
from thermaxis.runtime.opcua._pair import load_pair
from thermaxis.runtime.opcua._values import texts

T = TypeVar("T")

SESSION_TIMEOUT_MS: Final = 10_000.0
"""How long a server is asked to keep the session of a client that is silent. Short, because a
control has five or ten sessions, and a killed program leaves one. [ms]"""

CLOCK_SLACK_S: Final = 2.0
"""A server's clock that seems to go back by more than this was set back. Above the second in
which some servers step the time that they tell. [s]"""
CLOCK_DRIFT: Final = 1e-3
"""How fast two clocks may part without being noticed. [s/s]"""
SERVER_TIME: Final = ua.NodeId(ua.Int32(ObjectIds.Server_ServerStatus_CurrentTime))
"""The node that tells the server's time."""

_NO_TIME = datetime(1602, 1, 1, tzinfo=UTC)
_POLICIES: Final[Mapping[str, type[SecurityPolicy]]] = {
    "Basic256Sha256": SecurityPolicyBasic256Sha256,
    "Aes128Sha256RsaOaep": SecurityPolicyAes128Sha256RsaOaep,
    "Aes256Sha256RsaPss": SecurityPolicyAes256Sha256RsaPss,
}
_NEVER_S = 1e9
_NAMESPACES = ua.NodeId(ua.Int32(ObjectIds.Server_NamespaceArray))


@final
class _NoPasswords(logging.Filter):
    """Keeps the request that logs in, which may hold a password, out of every log."""

    def filter(self, record: logging.LogRecord) -> bool:
        arguments = record.args if isinstance(record.args, tuple) else ()
        return not any(isinstance(word, ua.ActivateSessionRequest) for word in arguments)


_no_passwords = _NoPasswords()


def quiet_library() -> None:
    """Keep what the library logs to itself: failures are told in words by the session.

    Whoever looks for a fault sets a level for ``asyncua``, which then stays.
    """
    library = logging.getLogger("asyncua")
    if library.level == logging.NOTSET:
        library.setLevel(logging.CRITICAL)


class ReadRequest(NamedTuple):
    """A read request that was made ready once for a connection."""

    parameters: ua.ReadParameters
    """What is sent; it asks for the server's time last."""
    known: tuple[int, ...]
    """Places of the nodes whose namespace the server has, among those that were asked for. [1]"""


@final
class Link:
    """One connection, from its beginning to its loss."""

    def __init__(self, client: Client) -> None:
        self.client = client
        self.lost = asyncio.Event()
        self.error: BaseException | None = None
        self.namespaces: Sequence[str] = ()
        self.server_ahead_s: float | None = None
        self.seen_s = 0.0
        self.used_s = 0.0
        self.readings: dict[tuple[str, ...], ReadRequest] = {}
        self.types: dict[str, ua.VariantType | None] = {}
        self.ids: dict[str, ua.NodeId | None] = {}
        self.under_way: set[asyncio.Task[Any]] = set()
        self.writing: asyncio.Task[Any] | None = None
        self.refusal: ua.UaStatusCodeError | None = None

    def lose(self, error: BaseException) -> None:
        """Give the connection up, with what is on its way."""
        if not self.lost.is_set():
            self.error = error
            self.lost.set()
            for task in self.under_way:
                task.cancel()

    async def ask(
        self,
        request: Coroutine[Any, Any, list[T]],
        deadline_s: float,
        count: int,
        *,
        writes: bool = False,
    ) -> list[T] | None:
        """Wait for an answer within a time; the request itself ends within the connection's.

        An answer that comes after the deadline is thrown away, never taken for a fresh one. One
        that does not come within the connection's own time costs the connection.
        """
        task = asyncio.create_task(request)
        self.under_way.add(task)
        if writes:
            self.writing = task
        task.add_done_callback(self._answered)
        try:
            await asyncio.wait((task,), timeout=max(0.0, deadline_s))
        except asyncio.CancelledError:
            task.cancel()
            raise
        if not task.done() or task.cancelled() or task.exception() is not None:
            return None
        found = task.result()
        if len(found) != count:
            self.lose(ValueError("the answer has another length than the question"))
            return None
        return found

    def _answered(self, task: "asyncio.Task[Any]") -> None:
        self.under_way.discard(task)
        if self.writing is task:
            self.writing = None
        error = None if task.cancelled() else task.exception()
        if isinstance(error, ua.UaStatusCodeError) and error.code in LASTING:
            self.refusal = error
        elif error is not None:
            self.lose(error)

    def id_of(self, node: str) -> ua.NodeId | None:
        """Return the id of a node on this server; None if it has no such namespace."""
        if node not in self.ids:
            self.ids[node] = node_id(parse_node(node), self.namespaces)
        return self.ids[node]

    def reading(self, nodes: Sequence[str]) -> ReadRequest:
        """Return the read request for nodes; the last one it asks for is the server's time."""
        key = tuple(nodes)
        found = self.readings.get(key)
        if found is None:
            ids = [self.id_of(node) for node in nodes]
            known = tuple(i for i, one in enumerate(ids) if one is not None)
            asked = [one for one in ids if one is not None]
            found = ReadRequest(value_request([*asked, SERVER_TIME]), known)
            self.readings[key] = found
        return found

    def see_time(self, value: ua.DataValue, sent_s: float, now_s: float) -> None:
        """Learn from the time that the server tells how far its clock is ahead of the own one.

        Some servers step it once a second, so that the most it was ahead counts; the two clocks
        may part slowly, and a large step means that the clock was set.
        """
        variant = value.Value
        seen = None if variant is None else aware_time(variant.Value)
        if seen is None or now_s - sent_s > CLOCK_SLACK_S:
            return
        ahead_s = seen.timestamp() - now_s  # at least: it was told a moment ago
        before_s = self.server_ahead_s
        if before_s is not None and 0.0 <= before_s - ahead_s <= CLOCK_SLACK_S:
            ahead_s = max(ahead_s, before_s - CLOCK_DRIFT * (now_s - self.seen_s))
        self.server_ahead_s, self.seen_s = ahead_s, now_s


async def connect_once(
    settings: ConnectionSettings,
    clock: Clock,
    within_s: float,
    session_timeout_ms: float = SESSION_TIMEOUT_MS,
) -> Link:
    """Connect with a new client, log in, and learn the namespaces and the clock of the server."""
    quiet_library()
    logging.getLogger("asyncua.client.ua_client.UASocketProtocol").addFilter(_no_passwords)
    client = Client(
        settings.full_url,
        timeout=settings.timeout_s,
        watchdog_intervall=_NEVER_S,  # it reads a node that not every user may read
    )
    client.name = client.description = "thermaxis"
    client.application_uri = settings.application_uri
    client.session_timeout = int(session_timeout_ms)
    link = Link(client)
    try:
        async with within(within_s):
            if settings.encrypted:
                await _secure(client, settings)
            await client.connect()
            await _look_around(link, clock)
    except BaseException:
        await discard(client)
        raise
    return link


async def _secure(client: Client, settings: ConnectionSettings) -> None:
    pair = await asyncio.to_thread(load_pair, settings)
    policy = _POLICIES[settings.security](
        pair.server.parsed, pair.own.parsed, pair.key, ua.MessageSecurityMode.SignAndEncrypt
    )
    client.security_policy = policy
    client.uaclient.set_security(policy)
    if settings.user:
        client.set_user(settings.user)
        client.set_password(settings.password.reveal())


async def _look_around(link: Link, clock: Clock) -> None:
    """Learn the namespaces and the clock of a server that was just reached."""

    async def lost(error: Exception) -> None:
        link.lose(error)

    link.client.connection_lost_callback = lost
    sent_s = clock.monotonic_s()
    found = await link.client.uaclient.session.read(value_request([_NAMESPACES, SERVER_TIME]))
    now_s = clock.monotonic_s()
    if len(found) != 2:
        raise ValueError("the answer has another length than the question")
    link.namespaces = texts(found[0])
    link.see_time(found[1], sent_s, now_s)
    link.used_s = now_s


async def take_leave(client: Client, within_s: float) -> None:
    """Give a session back, so that the server need not wait until it expires."""
    with contextlib.suppress(*FAILURES):
        async with within(within_s):
            await client.disconnect()


async def discard(client: Client) -> None:
    """End a client that is of no use any more: its socket at once, its tasks, no more requests."""
    protocol = client.uaclient.protocol
    transport = None if protocol is None else protocol.transport
    if transport is not None:  # a write that still waits in this computer may not act later
        opened = transport.get_extra_info("socket")
        with contextlib.suppress(OSError, AttributeError):  # it is closed already
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        transport.abort()
    client.disconnect_socket()
    with contextlib.suppress(*FAILURES):
        await client.close_session()
    await asyncio.sleep(0)


def value_request(nodes: Sequence[ua.NodeId]) -> ua.ReadParameters:
    """Return the request for the values of nodes."""
    return attribute_request([(node, AttributeIds.Value) for node in nodes])


def attribute_request(asked: Sequence[tuple[ua.NodeId, AttributeIds]]) -> ua.ReadParameters:
    """Return the request for attributes of nodes, each with the time stamp of its source."""
    return ua.ReadParameters(
        TimestampsToReturn=ua.TimestampsToReturn.Source,
        NodesToRead=[
            ua.ReadValueId(NodeId=node, AttributeId=attribute) for node, attribute in asked
        ],
    )


def aware_time(stamp: object) -> datetime | None:
    """Return a time stamp, aware; None for none, or for the zero that stands for none."""
    if not isinstance(stamp, datetime):
        return None
    aware = stamp if stamp.tzinfo is not None else stamp.replace(tzinfo=UTC)
    return aware if aware > _NO_TIME else None


class MethodAnswer(NamedTuple):
    """What a server answers to a call."""

    status: str
    """Name of the status of the call, such as ``Good`` or ``BadUserAccessDenied``."""
    values: tuple[object, ...]
    """What the method gives back; empty where it was refused."""


async def call_method(
    link: Link, place: str, method: str, arguments: Sequence[ua.Variant], deadline_s: float
) -> MethodAnswer | None:
    """Call a method of an object; None: no answer, and it may take effect all the same."""
    place_id, method_id = link.id_of(place), link.id_of(method)
    if place_id is None or method_id is None:
        return MethodAnswer("BadNodeIdUnknown", ())
    request = ua.CallMethodRequest(place_id, method_id, list(arguments))
    found = await link.ask(link.client.uaclient.session.call([request]), deadline_s, 1)
    if found is None:
        return None
    status = cast("ua.StatusCode", found[0].StatusCode)
    given = cast("list[ua.Variant] | None", found[0].OutputArguments) or ()
    values = tuple(cast("object", one.Value) for one in given)
    return MethodAnswer(status.name, values if status.is_good() else ())
