"""The OPC UA server of the loop as far as strangers can reach it: sessions, log-ins, bounds.

asyncua's own server is made for trust. What it lets through, and this module does not
[src, asyncua 2.1.0]:

* a channel without security is opened, and takes sessions and passwords, even where no endpoint
  without security is offered;
* an ActivateSession request on a fresh channel takes over a running session by a token that is a
  small counted number, and keeps it even when the log-in fails;
* passwords are checked inside the event loop, which a slow hash would stop;
* any session may delete or acknowledge the subscriptions of any other, or ask for notifications
  every millisecond;
* a message that announces four gigabytes is waited for, and kept, without a bound.

Not protected: a flood of connections costs time, as every answer does; in `run` it is not the
loop's.
"""

# asyncua leaves many members of its requests and its inner parts without a type:
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false

import asyncio
import struct
from collections import Counter
from collections.abc import Awaitable, Callable
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast, final

from asyncua import ua
from asyncua.common.connection import TransportLimits
from asyncua.common.utils import Buffer, ServiceError
from asyncua.crypto.permission_rules import User, UserRole
from asyncua.server.binary_server_asyncio import BinaryServer, OPCUAProtocol
from asyncua.server.internal_server import InternalServer
from asyncua.server.internal_session import InternalSession, SessionState
from asyncua.server.server import Server
from asyncua.server.subscription_service import SubscriptionService
from asyncua.server.uaprocessor import UaProcessor
from asyncua.ua.object_ids import ObjectIds
from asyncua.ua.status_codes import StatusCodes
from asyncua.ua.ua_binary import struct_from_binary

from thermaxis.runtime.status._address_space import fill_address_space
from thermaxis.runtime.users import ANONYMOUS, Identity

MOST_CONNECTIONS = 20
"""Connections at once, logged in or not. [1]"""
END_S = 5.0
"""Longest time for which connections are waited for when the server ends. [s]"""
LOG_IN_S = 10.0
"""Time in which a connection must have logged in. [s]"""
_CHUNK_BYTES = 65_535
LARGEST_MESSAGE_BYTES = 2 * _CHUNK_BYTES
"""Largest request: `MOST_MONITORED` items at once, and no more nodes than the loop can spare the
time for. [byte]"""
MOST_CALLS = 10
"""Method calls in one request. [1]"""
MOST_SUBSCRIPTIONS = 5
"""Subscriptions of one session. [1]"""
MOST_MONITORED = 1000
"""Monitored items of one session. [1]"""
SHORTEST_PUBLISHING_MS = 100.0
"""Shortest publishing interval that is granted. [ms]"""
_MOST_PENDING = 50
_LONGEST_SESSION_MS = 120_000.0
_LONGEST_LIFETIME = 3000
_LONGEST_KEEP_ALIVE = 600
_LONGEST_QUEUE = 100
_RSA15 = "http://www.w3.org/2001/04/xmlenc#rsa-1_5"


def _requests(*names: str) -> frozenset[ua.NodeId]:
    """Return the type ids of requests, in the form that comes over the wire."""
    return frozenset(
        ua.NodeId(cast("ua.Int32", getattr(ObjectIds, f"{name}Request_Encoding_DefaultBinary")))
        for name in names
    )


_CREATE = _requests("CreateSession")
_ACTIVATE = _requests("ActivateSession")
_ALWAYS = _requests("GetEndpoints", "FindServers", "CloseSecureChannel")
_LOGGED_IN = _requests(
    "CloseSession",
    "Read",
    "Browse",
    "TranslateBrowsePathsToNodeIds",
    "RegisterNodes",
    "UnregisterNodes",
    "Call",
    "CreateSubscription",
    "ModifySubscription",
    "SetPublishingMode",
    "DeleteSubscriptions",
    "CreateMonitoredItems",
    "ModifyMonitoredItems",
    "SetMonitoringMode",
    "DeleteMonitoredItems",
    "Publish",
    "Republish",
)

LogIn = Callable[[str, str, str], Awaitable[Identity | None]]
"""Says who logs in with a name and a password, from an address; empty: this computer."""

_admitted: ContextVar[Identity | None] = ContextVar("_admitted", default=None)
_caller: ContextVar[Identity] = ContextVar("_caller", default=ANONYMOUS)


def caller() -> Identity:
    """Return who calls the method that is running."""
    return _caller.get()


@final
@dataclass
class _LoggedIn(User):
    """What asyncua keeps of who is in a session."""

    identity: Identity = ANONYMOUS


@final
class _Doorman:
    """Tells asyncua, when it asks, whom `_Processor` has let in."""

    def get_user(
        self,
        iserver: InternalServer,
        username: str | None = None,
        password: str | None = None,
        certificate: object = None,
    ) -> User | None:
        """Return the user of the log-in that is running; nobody otherwise."""
        del iserver, username, password, certificate
        identity = _admitted.get()
        if identity is None:
            return None
        return _LoggedIn(UserRole.User, identity.name, identity)


@final
class _Session(InternalSession):
    """A session from outside: bounded, with subscriptions of its own."""

    async def call(self, params: list[ua.CallMethodRequest]) -> list[ua.CallMethodResult]:
        """Call methods; they can ask `caller` who calls."""
        if len(params) > MOST_CALLS:
            raise ServiceError(StatusCodes.BadTooManyOperations)
        user = self.user
        mark = _caller.set(user.identity if isinstance(user, _LoggedIn) else ANONYMOUS)
        try:
            return await super().call(params)
        finally:
            _caller.reset(mark)

    async def create_subscription(
        self,
        params: ua.CreateSubscriptionParameters,
        callback: Callable[..., Any],
        request_callback: Callable[..., Any] | None = None,
    ) -> ua.CreateSubscriptionResult:
        """Make a subscription, no faster than `SHORTEST_PUBLISHING_MS`."""
        if len(self.subscription_service.subscriptions) >= MOST_SUBSCRIPTIONS:
            raise ServiceError(StatusCodes.BadTooManySubscriptions)
        asked = float(params.RequestedPublishingInterval)
        least = SHORTEST_PUBLISHING_MS
        granted = asked if asked > least else least  # noqa: FURB136 - NaN becomes the bound, too
        params.RequestedPublishingInterval = ua.Double(granted)
        return await super().create_subscription(params, callback, request_callback)

    async def create_monitored_items(
        self, params: ua.CreateMonitoredItemsParameters
    ) -> list[ua.MonitoredItemCreateResult]:
        """Monitor nodes."""
        present = sum(
            len(s.monitored_item_srv._monitored_items)  # noqa: SLF001 # pyright: ignore[reportPrivateUsage] - nothing else tells
            for s in self.subscription_service.subscriptions.values()
        )
        if present + len(params.ItemsToCreate) > MOST_MONITORED:
            raise ServiceError(StatusCodes.BadTooManyMonitoredItems)
        return await super().create_monitored_items(params)


@final
class _InternalServer(InternalServer):
    """asyncua's inner server with bounds, a small address space, and a doorman."""

    def __init__(self, log_in: LogIn | None, *, anonymous: bool) -> None:
        super().__init__(user_manager=cast("Any", _Doorman()))
        self.log_in = log_in
        self.anonymous = anonymous
        self.allow_remote_admin = False
        self.max_connections = MOST_CONNECTIONS
        self.max_pending_activation_seconds = LOG_IN_S
        self.max_pending_messages_per_connection = _MOST_PENDING
        self.max_session_timeout_ms = _LONGEST_SESSION_MS
        self.max_unacked_messages_per_subscription = _LONGEST_QUEUE
        self.max_monitored_item_queue_size = _LONGEST_QUEUE
        self.max_lifetime_count = _LONGEST_LIFETIME
        self.max_keep_alive_count = _LONGEST_KEEP_ALIVE
        self.max_subscriptions = MOST_SUBSCRIPTIONS

    async def load_standard_address_space(self, shelf_file: Path | None = None) -> None:
        """Make the part of the standard's nodes that is shown."""
        del shelf_file
        fill_address_space(self.node_mgt_service)

    async def stop(self) -> None:
        """End, without a wait for the clock's last tick."""
        clock, self.time_task = self.time_task, None
        if clock is not None:
            clock.cancel()
        await super().stop()

    def create_session(
        self,
        name: str,
        user: User | None = None,
        external: bool = False,  # noqa: FBT001, FBT002 - the library's signature
    ) -> InternalSession:
        """Make a session that sees its own subscriptions only."""
        own = SubscriptionService(self.aspace, iserver=self)
        person = User(role=UserRole.Anonymous) if user is None else user
        return _Session(self, self.aspace, own, name, user=person, external=external)


@final
class _Processor(UaProcessor):
    """Answers the requests of one connection, as far as its security and its log-in allow."""

    iserver: _InternalServer  # pyright: ignore[reportIncompatibleVariableOverride] - it is made so

    def _should_close_session_on_transport_loss(self) -> bool:
        return self.session is not None  # nobody can come back to it on another connection

    async def _process_message(
        self, typeid: ua.NodeId, requesthdr: ua.RequestHeader, seqhdr: object, body: Buffer
    ) -> bool:
        mark = _admitted.set(await self._admit(typeid, body))
        try:
            return await super()._process_message(typeid, requesthdr, seqhdr, body)
        finally:
            _admitted.reset(mark)

    async def _admit(self, typeid: ua.NodeId, body: Buffer) -> Identity | None:
        """Return who logs in with this request, None if it is no log-in; refuse what must not be.

        Raises
        ------
        ServiceError
            If the channel's security, the session's state or the request itself forbid it.
        """
        if typeid in _ALWAYS:
            return None
        if not (self._encrypted or self.iserver.anonymous):
            raise ServiceError(StatusCodes.BadSecurityModeInsufficient)
        session = self.session
        if typeid in _CREATE:
            if session is not None and session.state is not SessionState.Closed:
                raise ServiceError(StatusCodes.BadTooManySessions)
            return None
        if session is None or session.state is SessionState.Closed:
            raise ServiceError(StatusCodes.BadSessionIdInvalid)
        if typeid in _ACTIVATE:
            params = struct_from_binary(ua.ActivateSessionParameters, body.copy())
            return await self._identity_of(session, params.UserIdentityToken)
        if typeid not in _LOGGED_IN:
            raise ServiceError(StatusCodes.BadServiceUnsupported)
        return None

    @property
    def _encrypted(self) -> bool:
        mode = self._connection.security_policy.Mode
        return mode == ua.MessageSecurityMode.SignAndEncrypt

    async def _identity_of(self, session: InternalSession, token: object) -> Identity | None:
        if not isinstance(token, ua.UserNameIdentityToken):
            return ANONYMOUS if self.iserver.anonymous else None
        if not self._encrypted:
            raise ServiceError(StatusCodes.BadSecurityModeInsufficient)
        if self.iserver.log_in is None or token.EncryptionAlgorithm == _RSA15:
            raise ServiceError(StatusCodes.BadIdentityTokenRejected)
        try:
            name, password = self.iserver.decrypt_user_token(session, token)
        except (ValueError, struct.error) as error:
            raise ServiceError(StatusCodes.BadIdentityTokenInvalid) from error
        if not name or not password:
            return None
        return await self.iserver.log_in(name, password, _address_of(self._transport))


def _address_of(transport: asyncio.Transport) -> str:
    """Return where a connection comes from; empty: from this computer, by whichever address."""
    there, here = (transport.get_extra_info(of) for of in ("peername", "sockname"))
    return "" if there is None or here is None or there[0] == here[0] else str(there[0])


@final
class _Protocol(OPCUAProtocol):
    """One connection, with a bound on what is kept of an unfinished message."""

    def _make_room(self) -> None:
        """End a connection that has not logged in where all places are taken.

        It is the oldest of the address that has most of them, so that no flood from elsewhere
        keeps anybody from logging in.
        """
        if len(self.clients) < self.iserver.max_connections:
            return
        waiting = [
            one
            for one in self.clients
            if one.processor is not None
            and one.transport is not None
            and not (one.processor.session and one.processor.session.is_activated())
        ]
        of = Counter(_address_of(one.transport) for one in waiting if one.transport)
        if waiting:
            address = of.most_common(1)[0][0]
            oldest = next(w for w in waiting if w.transport and _address_of(w.transport) == address)
            self.clients.remove(oldest)
            if oldest.transport is not None:
                oldest.transport.abort()

    def connection_made(self, transport: Any) -> None:
        """Take a connection."""
        self._make_room()
        super().connection_made(transport)
        if self.processor is not None:
            self.processor = _Processor(self.iserver, self.transport, self.limits)
            self.processor.set_policies(self.policies)

    def data_received(self, data: bytes) -> None:
        """Take bytes; a chunk that is larger than any may be ends the connection."""
        super().data_received(data)
        if len(self._buffer) > _CHUNK_BYTES and self.transport is not None:
            self.transport.abort()


@final
class _BinaryServer(BinaryServer):
    """Listens."""

    def _make_protocol(self) -> OPCUAProtocol:
        return _Protocol(
            iserver=self.iserver,
            policies=self._policies,
            clients=self.clients,
            closing_tasks=self.closing_tasks,
            limits=self.limits,
        )

    async def stop(self) -> None:
        """Stop to listen first, then end the connections, within a bound.

        The library ends them while it still listens: a client that comes back in that moment
        would be waited for as long as it likes to stay.
        """
        if self._server is not None:
            self._server.close()
        try:
            async with asyncio.timeout(END_S):
                await super().stop()
        except TimeoutError:
            for transport in tuple(self.iserver.asyncio_transports):
                transport.abort()


@final
class GuardedServer(Server):
    """asyncua's server with the doors shut that stand open in it."""

    def __init__(self, log_in: LogIn | None, *, anonymous: bool) -> None:
        super().__init__(iserver=_InternalServer(log_in, anonymous=anonymous))
        self.limits = TransportLimits(
            max_recv_buffer=_CHUNK_BYTES,
            max_send_buffer=_CHUNK_BYTES,
            max_chunk_count=LARGEST_MESSAGE_BYTES // _CHUNK_BYTES,
            max_message_size=LARGEST_MESSAGE_BYTES,
        )
        tokens: list[type] = [ua.AnonymousIdentityToken] if anonymous else []
        self.set_identity_tokens(tokens if log_in is None else [*tokens, ua.UserNameIdentityToken])

    async def start(self) -> None:
        """Begin to listen."""
        await self._setup_server_nodes()
        await self.iserver.start()
        address, port = self._get_bind_socket_info()
        self.bserver = _BinaryServer(self.iserver, address or "", port or 0, self.limits)
        self.bserver.set_policies(self._policies)
        try:
            await self.bserver.start()
        except OSError:
            self.bserver = None
            await self.iserver.stop()
            raise
