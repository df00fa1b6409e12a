"""One OPC UA connection that comes back by itself, with a new client each time.

A client that lost its server is never used again: some of them hang for ever (measured for this
project; FreeOpcUa/opcua-asyncio issue 1660). Every request ends within its time. What is known of
a server, its namespaces and the types of its nodes, is known anew after each connection.
"""

import asyncio
import contextlib
from collections.abc import Coroutine, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeVar, cast, final

from asyncua import ua
from asyncua.ua.attribute_ids import AttributeIds
from asyncua.ua.status_codes import StatusCodes

from thermaxis.codes import Message
from thermaxis.errors import ThermaxisError
from thermaxis.messages import text_of
from thermaxis.runtime._connection import ConnectionSettings
from thermaxis.runtime._ports import Clock
from thermaxis.runtime.opcua._failures import (
    FAILURES,
    explain,
    explain_offer,
    is_ambiguous,
    within,
)
from thermaxis.runtime.opcua._fetch import fetch_offers
from thermaxis.runtime.opcua._link import (
    CLOCK_SLACK_S,
    Link,
    MethodAnswer,
    attribute_request,
    aware_time,
    call_method,
    connect_once,
    discard,
    quiet_library,
    take_leave,
)
from thermaxis.runtime.opcua._pair import load_pair
from thermaxis.runtime.opcua._values import (
    NOT_WRITTEN,
    content_of,
    is_good,
    node_type,
    number_as,
    plain_number,
    status_name,
    without_status,
)

T = TypeVar("T")

IDLE_S: Final = 3.0
"""A connection that nobody uses is tried so often: it keeps the session, and finds a server that
is frozen. [s]"""
ASKED_EVERY_S: Final = 10.0
"""A server that refuses an encrypted connection without saying why is asked for its certificates
so often. [s]"""
_CONNECT_REQUESTS = 4.0
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


@final
class OpcUaSession:
    """A connection that source and sink share; it is made again by itself, without an end.

    What is asked has an answer within the stated time, or None: there is no connection, or no
    answer in time. A node that is no node id is a `ConfigurationError`.

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
        quiet_library()
        self.settings = settings
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
        """Return the time since a value was stamped, by the clock of the server. [s]

        It is not negative; None where there is no time stamp, one from the future, or the server
        does not tell its time.
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
            load_pair(self.settings)
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
        within_s = _CONNECT_REQUESTS * self.settings.timeout_s
        while True:
            began_s = self._clock.monotonic_s()
            try:
                link = await connect_once(self.settings, self._clock, within_s)
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
                pinned = (await asyncio.to_thread(load_pair, self.settings)).server.der
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
                if self._clock.monotonic_s() - link.used_s >= IDLE_S:  # is it frozen?
                    await self._read(link, (), self.settings.timeout_s + 1.0)
            self._failure = explain(link.error or ConnectionError(), self.settings)
        finally:
            self._link = None
            leaves = not link.lost.is_set()
            link.lose(ConnectionError())
            if leaves:
                await take_leave(link.client, self.settings.timeout_s)
            await discard(link.client)

    # ---- requests -------------------------------------------------------------------------------

    async def read(self, nodes: Sequence[str], deadline_s: float) -> list[ua.DataValue] | None:
        """Read the values of nodes with one request, each with status and source's time stamp."""
        link = self._current()
        return None if link is None else await self._read(link, nodes, deadline_s)

    async def _read(
        self, link: Link, nodes: Sequence[str], deadline_s: float
    ) -> list[ua.DataValue] | None:
        reading = link.reading(nodes)
        sent_s = self._clock.monotonic_s()
        request = link.client.uaclient.session.read(reading.parameters)
        found = await self._ask(link, request, deadline_s, len(reading.known) + 1)
        if found is None:
            return None
        link.see_time(found.pop(), sent_s, self._clock.monotonic_s())
        if len(found) == len(nodes):
            return found
        values = [_UNKNOWN_NODE] * len(nodes)
        for index, value in zip(reading.known, found, strict=True):
            values[index] = value
        return values

    async def write(
        self, values: Sequence[tuple[str, float]], deadline_s: float
    ) -> list[str] | None:
        """Write numbers to nodes with one request, each in exactly the node's type.

        Returns the names of the status codes, ``Good`` where a number was accepted; None also
        while an earlier write has not been answered. Nothing at all is sent when one of them
        cannot be: it is no finite number, or its node does not take it.
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
        """Return the exact types of nodes, such as ``Double``, read once per connection.

        One that the server does not say is empty.
        """
        link = self._current()
        if link is None or not await self._learn_types(link, nodes, deadline_s):
            return None
        found = {node: link.types[node] for node in nodes}
        return {node: "" if kind is None else kind.name for node, kind in found.items()}

    async def _learn_types(self, link: Link, nodes: Sequence[str], deadline_s: float) -> bool:
        missing = {node: link.id_of(node) for node in nodes if node not in link.types}
        asked = [
            (one, attribute)
            for one in missing.values()
            if one is not None
            for attribute in (AttributeIds.DataType, AttributeIds.Value)
        ]
        found: list[ua.DataValue] | None = []
        if asked:
            request = link.client.uaclient.session.read(attribute_request(asked))
            found = await self._ask(link, request, deadline_s, len(asked))
        if found is None:
            return False
        told = iter(found)
        for node, one in missing.items():
            kind = None if one is None else node_type(content_of(next(told)), next(told))
            link.types[node] = kind
        return True

    async def describe(self, node: str, deadline_s: float) -> NodeDescription | None:
        """Return what the server says of a node, for a self-test."""
        link = self._current()
        if link is None:
            return None
        one = link.id_of(node)
        if one is None:
            return NodeDescription(node, exists=False, status="BadNodeIdUnknown")
        asked = attribute_request([(one, attribute) for attribute in _DESCRIBED])
        request = link.client.uaclient.session.read(asked)
        found = await self._ask(link, request, deadline_s, len(_DESCRIBED))
        if found is None:
            return None
        node_class, data_type, access, user_access, value = found
        if not is_good(node_class):
            return NodeDescription(node, exists=False, status=status_name(node_class))
        kind = node_type(content_of(data_type), value)
        level = content_of(user_access if is_good(user_access) else access)
        return NodeDescription(
            node=node,
            exists=True,
            status=status_name(value),
            data_type="" if kind is None else kind.name,
            readable=is_good(value),
            writable=isinstance(level, int) and bool(level & _CURRENT_WRITE),
            value=plain_number(value) if is_good(value) else None,
            age_s=self.age_s(value),
        )

    async def call(
        self, place: str, method: str, arguments: Sequence[ua.Variant], deadline_s: float
    ) -> MethodAnswer | None:
        """Call a method of an object; without an answer it may take effect all the same."""
        link = self._current()
        if link is None:
            return None
        link.used_s = self._clock.monotonic_s()
        return await call_method(link, place, method, arguments, deadline_s)

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
        link.used_s = self._clock.monotonic_s()
        found = await link.ask(request, deadline_s, count, writes=writes)
        if link.refusal is not None:
            self._failure = explain(link.refusal, self.settings)
        return found
