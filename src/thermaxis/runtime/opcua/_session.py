"""One OPC UA connection that comes back by itself, with a new client each time.

A client that lost its server is never used again: some of them hang for ever (measured for this
project; FreeOpcUa/opcua-asyncio issue 1660). Every request ends within its time. What is known of
a server, its namespaces and the types of its nodes, is known anew after each connection.
"""

import asyncio
import contextlib
import logging
import socket
import struct
from collections.abc import Coroutine, Mapping, Sequence
from dataclasses import dataclass
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
from asyncua.ua.status_codes import StatusCodes

from thermaxis.codes import Message
from thermaxis.errors import ThermaxisError
from thermaxis.messages import text_of
from thermaxis.runtime._connection import ConnectionSettings
from thermaxis.runtime._ports import Clock
from thermaxis.runtime.opcua._failures import (
    FAILURES,
    LASTING,
    explain,
    explain_offer,
    is_ambiguous,
    within,
)
from thermaxis.runtime.opcua._fetch import fetch_offers
from thermaxis.runtime.opcua._link import (
    CLOCK_SLACK_S,
    SERVER_TIME,
    Link,
    ReadRequest,
    attribute_request,
    aware_time,
    value_request,
)
from thermaxis.runtime.opcua._pair import PairFiles
from thermaxis.runtime.opcua._values import (
    NOT_WRITTEN,
    node_type,
    number_as,
    plain_number,
    status_name,
    texts,
    without_status,
)

T = TypeVar("T")

SESSION_TIMEOUT_MS: Final = 10_000.0
"""How long a server is asked to keep the session of a client that is silent. Short, because a
control has five or ten sessions, and a killed program leaves one. [ms]"""
IDLE_S: Final = 3.0
"""A connection that nobody uses is tried so often: it keeps the session, and finds a server that
is frozen. [s]"""
ASKED_EVERY_S: Final = 10.0
"""A server that refuses an encrypted connection without saying why is asked for its certificates
so often. [s]"""

_POLICIES: Final[Mapping[str, type[SecurityPolicy]]] = {
    "Basic256Sha256": SecurityPolicyBasic256Sha256,
    "Aes128Sha256RsaOaep": SecurityPolicyAes128Sha256RsaOaep,
    "Aes256Sha256RsaPss": SecurityPolicyAes256Sha256RsaPss,
}
_NEVER_S = 1e9
_CONNECT_REQUESTS = 4.0
_NAMESPACES = ua.NodeId(ua.Int32(ObjectIds.Server_NamespaceArray))
_UNKNOWN_NODE = ua.DataValue(StatusCode=ua.StatusCode(ua.UInt32(StatusCodes.BadNodeIdUnknown)))
_CURRENT_WRITE = 2
_DESCRIBED = (
    AttributeIds.NodeClass,
    AttributeIds.DataType,
    AttributeIds.AccessLevel,
    AttributeIds.UserAccessLevel,
    AttributeIds.Value,
)


@final
class _NoPasswords(logging.Filter):
    """Keeps the request that logs in, which may hold a password, out of every log."""

    def filter(self, record: logging.LogRecord) -> bool:
        arguments = record.args if isinstance(record.args, tuple) else ()
        return not any(isinstance(word, ua.ActivateSessionRequest) for word in arguments)


_no_passwords = _NoPasswords()


def _quiet_library() -> None:
    """Keep what the library logs to itself: failures are told in words by the session.

    Whoever looks for a fault sets a level for ``asyncua``, which then stays.
    """
    library = logging.getLogger("asyncua")
    if library.level == logging.NOTSET:
        library.setLevel(logging.CRITICAL)


@final
@dataclass(frozen=True, slots=True)
class NodeDescription:
    """What a server says of one node."""

    node: str
    """The node, as it was asked for."""
    exists: bool
    """Whether the server knows it."""
    status: str
    """Status of its value, such as ``Good`` or ``BadNodeIdUnknown``."""
    data_type: str = ""
    """Exact type, such as ``Double`` or ``Int32``; empty if it is no plain one."""
    readable: bool = False
    """Whether its value could be read."""
    writable: bool = False
    """Whether the server lets this user write it, as far as it says."""
    value: float | bool | None = None
    """Its number; None where it has none."""
    age_s: float | None = None
    """Time since the value was stamped; None where there is no time stamp. [s]"""


class MethodAnswer(NamedTuple):
    """What a server answers to a call."""

    status: str
    """Name of the status of the call, such as ``Good`` or ``BadUserAccessDenied``."""
    values: tuple[object, ...]
    """What the method gives back; empty where it was refused."""


@final
class OpcUaSession:
    """A connection that source and sink share; it is made again by itself, without an end.

    Parameters
    ----------
    settings : ConnectionSettings
        The connection.
    clock : Clock
        Time.

    Notes
    -----
    Not protected: a server that is frozen after it took a request may still obey it later, even
    when the connection was given up meanwhile, and so may what a network holds. One write at most
    is on its way at any time, and what still waits in this computer is not sent any more.
    """

    def __init__(self, settings: ConnectionSettings, clock: Clock) -> None:
        _quiet_library()
        self.settings = settings
        self._files = PairFiles(settings)
        self._clock = clock
        self._link: Link | None = None
        self._generation = 0
        self._failure: Message | None = None
        self._offer_failure: Message | None = None
        self._asked_s = float("-inf")
        self._users = 0
        self._ending = False
        self._task: asyncio.Task[None] | None = None

    @property
    def connected(self) -> bool:
        """Whether the server can be asked."""
        return self._link is not None

    @property
    def generation(self) -> int:
        """Number of the connection; it grows by one with each that succeeds. [1]"""
        return self._generation

    @property
    def failure(self) -> Message | None:
        """Why it is not connected; None while all is well."""
        return self._failure

    @property
    def last_error(self) -> str:
        """The same as an English sentence; empty while all is well."""
        return "" if self._failure is None else text_of(self._failure)

    @property
    def clock_difference_s(self) -> float | None:
        """The server's clock minus the own time of day; None while it is not known. [s]"""
        ahead_s = None if self._link is None else self._link.server_ahead_s
        if ahead_s is None:
            return None
        return ahead_s + self._clock.monotonic_s() - self._clock.utc().timestamp()

    def age_s(self, value: ua.DataValue) -> float | None:
        """Return the time since a value was stamped, by the clock of the server.

        Parameters
        ----------
        value : ua.DataValue
            What `read` returned.

        Returns
        -------
        float or None
            Not negative; None where there is no time stamp, one from the future, or the server
            does not tell its time. [s]
        """
        stamp = aware_time(value.SourceTimestamp)
        ahead_s = None if self._link is None else self._link.server_ahead_s
        if stamp is None or ahead_s is None:
            return None
        age_s = self._clock.monotonic_s() + ahead_s - stamp.timestamp()
        return max(0.0, age_s) if age_s > -CLOCK_SLACK_S else None

    # ---- life -----------------------------------------------------------------------------------

    async def open(self) -> None:
        """Begin to connect; a server that is not there is waited for. Each open wants a close.

        Raises
        ------
        ConfigurationError
            If the own certificate or key, or the stored certificate of the server, cannot be
            used, or others can read the key.
        """
        if self.settings.encrypted:
            self._files.load()
        self._users += 1
        if self._task is None:
            self._ending = False
            self._task = asyncio.create_task(self._keep_connected(), name=self.settings.name)

    async def close(self) -> None:
        """End for one user; with the last one the connection ends, and nothing runs on."""
        self._users = max(0, self._users - 1)
        if self._users or self._task is None:
            return
        task, self._task = self._task, None
        self._ending = True
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task

    async def _keep_connected(self) -> None:
        while True:
            began_s = self._clock.monotonic_s()
            try:
                link = await self._connect()
            except FAILURES as error:
                self._failure = await self._reason(error) or explain(error, self.settings)
            else:
                await self._use(link)
            if self._ending:  # the library swallows a cancellation while a client is ended
                return
            await self._clock.sleep_until(began_s + self.settings.retry_s)

    async def _reason(self, error: BaseException) -> Message | None:
        """Ask the server what it offers where a failure alone does not tell what is wrong."""
        now_s = self._clock.monotonic_s()
        if not self.settings.encrypted or not is_ambiguous(error):
            self._offer_failure = None
        elif now_s - self._asked_s >= ASKED_EVERY_S:
            self._asked_s, self._offer_failure = now_s, None
            with contextlib.suppress(ThermaxisError, TimeoutError):
                pinned = (await self._files.load_aside()).server_der
                async with within(self.settings.timeout_s):
                    offers = await fetch_offers(self.settings.url, self.settings.timeout_s)
                offered = {offer.certificate.der: offer.policies for offer in offers}
                self._offer_failure = explain_offer(offered, pinned, self.settings)
        return self._offer_failure

    async def _use(self, link: Link) -> None:
        """Offer a connection until it is lost."""
        self._generation += 1
        self._failure = None
        self._link = link
        try:
            while not link.lost.is_set():
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(IDLE_S):
                        await link.lost.wait()
                if self._clock.monotonic_s() - link.used_s >= IDLE_S:
                    await self._look(link)
            self._failure = explain(link.error or ConnectionError(), self.settings)
        finally:
            if self._link is link:
                self._link = None
            for task in link.under_way:
                task.cancel()
            if not link.lost.is_set():
                await take_leave(link.client, self.settings.timeout_s)
            await discard(link.client)

    async def _connect(self) -> Link:
        within_s = _CONNECT_REQUESTS * self.settings.timeout_s
        return await connect_once(self.settings, self._files, self._clock, within_s)

    async def _look(self, link: Link) -> None:
        """Ask for the time: the session stays alive, and a server that is frozen is found."""
        await self._read(link, link.reading(()), self.settings.timeout_s + 1.0)

    # ---- requests -------------------------------------------------------------------------------

    async def read(self, nodes: Sequence[str], deadline_s: float) -> list[ua.DataValue] | None:
        """Read the values of nodes with one request.

        Parameters
        ----------
        nodes : sequence of str
            The nodes, such as ``ns=2;s=Name``.
        deadline_s : float
            Longest time. [s]

        Returns
        -------
        list of ua.DataValue or None
            One per node, with status and both time stamps; None if there is no connection or no
            answer in time.

        Raises
        ------
        ConfigurationError
            If one of them is no node id.
        """
        link = self._current()
        return None if link is None else await self._read(link, link.reading(nodes), deadline_s)

    async def _read(
        self, link: Link, reading: ReadRequest, deadline_s: float
    ) -> list[ua.DataValue] | None:
        sent_s = self._clock.monotonic_s()
        request = link.client.uaclient.session.read(reading.parameters)
        found = await self._ask(link, request, deadline_s, len(reading.known) + 1)
        if found is None:
            return None
        link.see_time(found.pop(), sent_s, self._clock.monotonic_s())
        if len(found) == reading.total:
            return found
        values = [_UNKNOWN_NODE] * reading.total
        for index, value in zip(reading.known, found, strict=True):
            values[index] = value
        return values

    async def write(
        self, values: Sequence[tuple[str, float]], deadline_s: float
    ) -> list[str] | None:
        """Write numbers to nodes with one request, each in exactly the node's type.

        Nothing at all is sent when one of them cannot be: it is no finite number, or its node
        does not take it.

        Parameters
        ----------
        values : sequence of (str, float)
            Nodes and numbers; bool counts as a number.
        deadline_s : float
            Longest time. [s]

        Returns
        -------
        list of str or None
            Names of the status codes, one per node, ``Good`` where it was accepted; None if there
            is no connection, no answer in time, or an earlier write has not been answered yet.

        Raises
        ------
        ConfigurationError
            If one of them is no node id.
        """
        link = self._current()
        if link is None or link.writing is not None:
            return None
        end_s = self._clock.monotonic_s() + deadline_s
        if not await self._learn_types(link, [node for node, _ in values], deadline_s):
            return None
        ready = [number_as(value, link.types[node]) for node, value in values]
        if any(isinstance(one, str) for one in ready):
            return [one if isinstance(one, str) else NOT_WRITTEN for one in ready]
        if link.writing is not None:
            return None
        parameters = ua.WriteParameters(
            NodesToWrite=[
                ua.WriteValue(
                    NodeId=cast("ua.NodeId", link.ids[node]),
                    AttributeId=AttributeIds.Value,
                    Value=without_status(cast("ua.Variant", one)),
                )
                for (node, _), one in zip(values, ready, strict=True)
            ]
        )
        request = link.client.uaclient.session.write(parameters)
        left_s = end_s - self._clock.monotonic_s()
        found = await self._ask(link, request, left_s, len(ready), writes=True)
        return None if found is None else [code.name for code in found]

    async def types(self, nodes: Sequence[str], deadline_s: float) -> dict[str, str] | None:
        """Return the exact types of nodes, read once per connection.

        Parameters
        ----------
        nodes : sequence of str
            The nodes.
        deadline_s : float
            Longest time. [s]

        Returns
        -------
        dict or None
            Names such as ``Double`` by node, empty where the server does not say; None if there
            is no connection or no answer in time.
        """
        link = self._current()
        if link is None or not await self._learn_types(link, nodes, deadline_s):
            return None
        found = {node: link.types[node] for node in nodes}
        return {node: "" if kind is None else kind.name for node, kind in found.items()}

    async def _learn_types(self, link: Link, nodes: Sequence[str], deadline_s: float) -> bool:
        missing = [node for node in nodes if node not in link.types]
        if not missing:
            return True
        known = [(node, one) for node in missing if (one := link.id_of(node)) is not None]
        for node in missing:
            if link.ids[node] is None:
                link.types[node] = None
        asked = [
            (one, attribute)
            for _, one in known
            for attribute in (AttributeIds.DataType, AttributeIds.Value)
        ]
        if not asked:
            return True
        request = link.client.uaclient.session.read(attribute_request(asked))
        found = await self._ask(link, request, deadline_s, len(asked))
        if found is None:
            return False
        for (node, _), kind, value in zip(known, found[::2], found[1::2], strict=True):
            link.types[node] = node_type(_content(kind), value)
        return True

    async def describe(self, node: str, deadline_s: float) -> NodeDescription | None:
        """Return what the server says of a node, for a self-test.

        Parameters
        ----------
        node : str
            The node.
        deadline_s : float
            Longest time. [s]

        Returns
        -------
        NodeDescription or None
            None if there is no connection or no answer in time.

        Raises
        ------
        ConfigurationError
            If it is no node id.
        """
        link = self._current()
        if link is None:
            return None
        one = link.id_of(node)
        if one is None:
            return NodeDescription(node, exists=False, status="BadNodeIdUnknown")
        request = link.client.uaclient.session.read(
            attribute_request([(one, attribute) for attribute in _DESCRIBED])
        )
        found = await self._ask(link, request, deadline_s, len(_DESCRIBED))
        if found is None:
            return None
        node_class, data_type, access, user_access, value = found
        if not _is_good(node_class):
            return NodeDescription(node, exists=False, status=status_name(node_class))
        kind = node_type(_content(data_type), value)
        level = _content(user_access if _is_good(user_access) else access)
        return NodeDescription(
            node=node,
            exists=True,
            status=status_name(value),
            data_type="" if kind is None else kind.name,
            readable=_is_good(value),
            writable=isinstance(level, int) and bool(level & _CURRENT_WRITE),
            value=plain_number(value) if _is_good(value) else None,
            age_s=self.age_s(value),
        )

    async def call(
        self, place: str, method: str, arguments: Sequence[ua.Variant], deadline_s: float
    ) -> MethodAnswer | None:
        """Call a method.

        Parameters
        ----------
        place : str
            The object that the method belongs to, such as ``ns=2;s=Requests``.
        method : str
            The method.
        arguments : sequence of ua.Variant
            Its arguments, each in exactly its type.
        deadline_s : float
            Longest time. [s]

        Returns
        -------
        MethodAnswer or None
            None if there is no connection or no answer in time: the call may take effect all the
            same.

        Raises
        ------
        ConfigurationError
            If one of the two is no node id.
        """
        link = self._current()
        if link is None:
            return None
        request = call_request(link, place, method, arguments)
        if request is None:
            return MethodAnswer("BadNodeIdUnknown", ())
        found = await self._ask(link, link.client.uaclient.session.call([request]), deadline_s, 1)
        return None if found is None else answer_of(found[0])

    def _current(self) -> Link | None:
        """Return the connection; a task that ended by a mistake in the program says so."""
        if self._task is not None and self._task.done():
            self._task.result()
        link = self._link
        return None if link is None or link.lost.is_set() else link

    async def _ask(
        self,
        link: Link,
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
        link.used_s = self._clock.monotonic_s()
        task = asyncio.create_task(request)
        link.under_way.add(task)
        if writes:
            link.writing = task
        task.add_done_callback(lambda done: self._answered(link, done))
        try:
            await asyncio.wait((task,), timeout=max(0.0, deadline_s))
        except asyncio.CancelledError:
            task.cancel()
            raise
        if not task.done() or task.cancelled() or task.exception() is not None:
            return None
        found = task.result()
        if len(found) != count:
            link.lose(ValueError("the answer has another length than the question"))
            return None
        return found

    def _answered(self, link: Link, task: "asyncio.Task[Any]") -> None:
        link.under_way.discard(task)
        if link.writing is task:
            link.writing = None
        error = None if task.cancelled() else task.exception()
        if error is None:
            return
        if isinstance(error, ua.UaStatusCodeError) and error.code in LASTING:
            self._failure = explain(error, self.settings)
            return
        link.lose(error)


async def connect_once(
    settings: ConnectionSettings,
    files: PairFiles,
    clock: Clock,
    within_s: float,
    session_timeout_ms: float = SESSION_TIMEOUT_MS,
) -> Link:
    """Connect with a new client, log in, and learn the namespaces and the clock of the server."""
    client = _new_client(settings)
    client.session_timeout = int(session_timeout_ms)
    link = Link(client)
    connected = False
    try:
        async with within(within_s):
            if settings.encrypted:
                await _secure(client, settings, files)
            await client.connect()
            await _look_around(link, clock)
        connected = True
    finally:
        if not connected:
            await discard(client)
    return link


def _new_client(settings: ConnectionSettings) -> Client:
    _quiet_library()
    logging.getLogger("asyncua.client.ua_client.UASocketProtocol").addFilter(_no_passwords)
    client = Client(
        settings.full_url,
        timeout=settings.timeout_s,
        watchdog_intervall=_NEVER_S,  # it reads a node that not every user may read
    )
    client.name = client.description = "thermaxis"
    client.application_uri = settings.application_uri
    return client


async def _secure(client: Client, settings: ConnectionSettings, files: PairFiles) -> None:
    pair = await files.load_aside()
    policy = _POLICIES[settings.security](
        pair.server, pair.own, pair.key, ua.MessageSecurityMode.SignAndEncrypt
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
    _expect(found, 2)
    link.namespaces = texts(found[0])
    link.see_time(found[1], sent_s, now_s)
    link.used_s = now_s


def call_request(
    link: Link, place: str, method: str, arguments: Sequence[ua.Variant]
) -> ua.CallMethodRequest | None:
    """Return the request that calls a method; None if the server has no such namespace."""
    place_id, method_id = link.id_of(place), link.id_of(method)
    if place_id is None or method_id is None:
        return None
    return ua.CallMethodRequest(
        ObjectId=place_id, MethodId=method_id, InputArguments=list(arguments)
    )


def answer_of(result: ua.CallMethodResult) -> MethodAnswer:
    """Return what a server answers to a call, without the library's types."""
    status = cast("ua.StatusCode", result.StatusCode)
    if not status.is_good():
        return MethodAnswer(status.name, ())
    given = cast("list[ua.Variant] | None", result.OutputArguments)
    return MethodAnswer(status.name, tuple(cast("object", one.Value) for one in given or ()))


async def take_leave(client: Client, within_s: float) -> None:
    """Give a session back, so that the server need not wait until it expires."""
    with contextlib.suppress(*FAILURES):
        async with within(within_s):
            await client.disconnect()


def _expect(found: Sequence[object], count: int) -> None:
    if len(found) != count:
        raise ValueError("the answer has another length than the question")


def _is_good(value: ua.DataValue) -> bool:
    return value.StatusCode is None or value.StatusCode.is_good()


def _content(value: ua.DataValue) -> object:
    return None if value.Value is None else cast("object", value.Value.Value)


async def discard(client: Client) -> None:
    """End a client that is of no use any more: its socket at once, its tasks, no more requests."""
    _reset(client)
    client.disconnect_socket()
    with contextlib.suppress(*FAILURES):
        await client.close_session()
    await asyncio.sleep(0)


def _reset(client: Client) -> None:
    """Leave nothing on its way: a write that still waits in this computer may not act later."""
    protocol = client.uaclient.protocol
    transport = None if protocol is None else protocol.transport
    if transport is None:
        return
    opened = transport.get_extra_info("socket")
    with contextlib.suppress(OSError, AttributeError):  # it is closed already
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    transport.abort()
