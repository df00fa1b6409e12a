"""The status server against people who mean no good, and against many at once."""

import asyncio
import random
import struct
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from argon2 import PasswordHasher
from asyncua import Client, Server, ua
from asyncua.crypto.permission_rules import User, UserRole
from asyncua.server.internal_server import InternalServer
from asyncua.server.user_managers import UserManager

from tests.in_time import LONGEST_S
from tests.scenes import scene
from tests.unit.runtime.status_server_parts import (
    ANSWER_S,
    PASSWORD,
    Box,
    HandClock,
    Pairs,
    call,
    client,
    node_id,
    read,
    served,
    status,
    viewers,
)
from thermaxis.runtime import REFUSED_S, StatusServer
from thermaxis.runtime.status._address_space import fill_address_space
from thermaxis.runtime.status._sessions import (
    LARGEST_MESSAGE_BYTES,
    LOG_IN_S,
    MOST_CALLS,
    MOST_CONNECTIONS,
    MOST_MONITORED,
    MOST_SUBSCRIPTIONS,
    SHORTEST_PUBLISHING_MS,
)
from thermaxis.runtime.users import FAILURES_BY_NAME
from thermaxis.runtime.users._throttle import LOCAL_SHARE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from thermaxis.runtime import EventRecord


@pytest.fixture(scope="module")
def pairs(tmp_path_factory: pytest.TempPathFactory) -> Pairs:
    return Pairs(tmp_path_factory.mktemp("pairs"))


async def channel(url: str, pairs: Pairs | None = None) -> Client:
    """Return a client with an open channel and no session."""
    one = Client(url, timeout=ANSWER_S)
    if pairs is not None:
        one.application_uri = pairs.client.uri
        await one.set_security(
            ua_policy(),
            str(pairs.client.certificate),
            str(pairs.client.key),
            server_certificate=str(pairs.server.certificate),
            mode=ua.MessageSecurityMode.SignAndEncrypt,
        )
    await one.connect_socket()
    await one.send_hello()
    await one.open_secure_channel()
    return one


def ua_policy() -> Any:
    from asyncua.crypto.security_policies import (  # noqa: PLC0415 - beside its only use
        SecurityPolicyBasic256Sha256,
    )

    return SecurityPolicyBasic256Sha256


def hijack(one: Client, token: ua.NodeId) -> None:
    """Let a client's requests carry the token of somebody else's session."""
    protocol = one.uaclient.protocol
    assert protocol is not None
    protocol.authentication_token = token


async def code_of(work: Any) -> str:
    """Return the name of the status code with which a request is refused, or nothing."""
    try:
        await work
    except ua.UaStatusCodeError as error:
        return ua.StatusCode(error.code).name
    return ""


def token_of(server: Any) -> ua.NodeId:
    """Return the token of the only session from outside: a counted number, easy to guess."""
    (token,) = server.iserver._external_sessions
    return token


# ---- what the library lets through ------------------------------------------------------------


class Strict(UserManager):
    """Lets one user in, and nobody else."""

    def get_user(
        self,
        iserver: Any,
        username: str | None = None,
        password: str | None = None,
        certificate: Any = None,
    ) -> User | None:
        known = username == "operator" and password == PASSWORD
        return User(UserRole.User, username) if known else None


class Quick(InternalServer):
    """The library's own inner server, with fewer nodes."""

    async def load_standard_address_space(self, shelf_file: Path | None = None) -> None:
        fill_address_space(self.node_mgt_service)


@scene
async def test_the_library_alone_lets_a_stranger_take_over_a_session(pairs: Pairs) -> None:
    """Why the guard exists. When this fails the library has closed the door itself."""

    plain = Server(Quick(user_manager=Strict()))
    await plain.init()
    plain.set_endpoint("opc.tcp://127.0.0.1:0/")
    await plain.load_certificate(pairs.server.certificate)
    await plain.load_private_key(pairs.server.key)
    plain.set_security_policy([ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt])
    await plain.start()
    assert plain.bserver is not None
    url = f"opc.tcp://127.0.0.1:{plain.bserver.port}/"
    victim = await channel(url, pairs)
    await victim.create_session()
    await victim.activate_session(username="operator", password=PASSWORD)
    thief = await channel(url)  # no security, though none is offered
    token = token_of(plain)
    hijack(thief, token)
    assert await code_of(activate(thief, "operator", "wrong password"))
    stolen = thief.get_node(ua.NodeId(2258))  # read with the victim's session
    assert (await stolen.read_value()) is not None
    for one in (thief, victim):
        one.disconnect_socket()
    await plain.stop()


async def activate(one: Client, name: str, password: str) -> None:
    params = ua.ActivateSessionParameters()
    params.UserIdentityToken = ua.UserNameIdentityToken(
        PolicyId="username", UserName=name, Password=password.encode()
    )
    await one.uaclient.activate_session(params)


# ---- channels and sessions --------------------------------------------------------------------


@pytest.mark.parametrize("anonymous", ["none", "viewer"])
@scene
async def test_nobody_takes_over_a_session_by_its_token(pairs: Pairs, anonymous: Any) -> None:
    box = Box()
    async with (
        served(pairs.settings(anonymous=anonymous), box) as server,
        pairs.user(server, "engineer") as victim,
    ):
        for own in (pairs, None):
            thief = await channel(server.url, own)
            hijack(thief, token_of(server._server))
            wrong = await code_of(activate(thief, "engineer", "wrong password"))
            assert wrong in {"BadSessionIdInvalid", "BadSecurityModeInsufficient"}
            assert await code_of(read(thief, "Status/State"))
            assert await code_of(call(thief, "Enable"))
            thief.disconnect_socket()
        assert await call(victim, "WhoAmI") == ["engineer", "engineer"]
    assert box.requests == []


@scene
async def test_an_unencrypted_channel_shows_the_ways_in_and_nothing_else(pairs: Pairs) -> None:
    async with served(pairs.settings()) as server:
        one = await channel(server.url)
        endpoints = await one.get_endpoints()
        assert {e.SecurityMode for e in endpoints} == {ua.MessageSecurityMode.SignAndEncrypt}
        assert await code_of(one.create_session()) == "BadSecurityModeInsufficient"
        assert await code_of(activate(one, "operator", PASSWORD))
        one.disconnect_socket()


@scene
async def test_a_password_is_never_taken_over_an_unencrypted_channel(pairs: Pairs) -> None:
    events: list[EventRecord] = []

    async with served(pairs.settings(anonymous="viewer"), audit=events) as server:
        one = await channel(server.url)
        await one.create_session()
        code = await code_of(activate(one, "operator", PASSWORD))
        assert code == "BadSecurityModeInsufficient"
        one.disconnect_socket()

    assert events == []


@scene
async def test_a_log_in_without_name_or_password_is_refused_without_a_look(pairs: Pairs) -> None:
    events: list[EventRecord] = []

    async with served(pairs.settings(), audit=events) as server:
        one = await channel(server.url, pairs)
        await one.create_session()
        for name, password in ((None, None), ("operator", None), (None, PASSWORD), ("", "")):
            code = await code_of(one.activate_session(username=name, password=password))
            assert code in {"BadUserAccessDenied", "BadIdentityTokenRejected"}
        one.disconnect_socket()

    assert events == []


@scene
async def test_a_connection_that_does_not_log_in_is_ended(
    pairs: Pairs, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("thermaxis.runtime.status._sessions.LOG_IN_S", 0.05)

    async with served(pairs.settings()) as server:
        host, _, port = server.url.removeprefix("opc.tcp://").partition("/")[0].partition(":")
        reader, writer = await asyncio.open_connection(host, int(port))
        assert await reader.read(1) == b""
        writer.close()


@scene
async def test_signing_alone_is_not_offered(pairs: Pairs) -> None:
    async with served(pairs.settings()) as server:
        with pytest.raises((ua.UaError, TimeoutError, ConnectionError)):
            async with asyncio.timeout(0.5):
                await pairs.log_in(server, "operator", mode=ua.MessageSecurityMode.Sign)


@scene
async def test_nothing_is_answered_before_the_log_in_and_one_session_is_enough(
    pairs: Pairs,
) -> None:
    async with served(pairs.settings()) as server:
        one = await channel(server.url, pairs)
        assert await code_of(read(one, "Status/State")) == "BadSessionIdInvalid"
        assert await code_of(activate(one, "operator", PASSWORD)) == "BadSessionIdInvalid"
        await one.create_session()
        assert await code_of(one.nodes.objects.get_children())
        assert await code_of(one.create_session()) == "BadTooManySessions"
        await one.activate_session(username="operator", password=PASSWORD)
        assert await call(one, "WhoAmI") == ["operator", "operator"]
        # a log-in that fails leaves what was there, one that succeeds takes its place
        assert await code_of(one.activate_session(username="engineer", password="wrong"))  # noqa: S106 - a wrong one
        assert await call(one, "WhoAmI") == ["operator", "operator"]
        await one.uaclient.close_session(True)
        assert await code_of(read(one, "Status/State")) == "BadSessionIdInvalid"
        await one.create_session()
        await one.activate_session(username="viewer", password=PASSWORD)
        assert await call(one, "WhoAmI") == ["viewer", "viewer"]
        one.disconnect_socket()


@scene
async def test_nobody_registers_another_server_or_reads_a_history(pairs: Pairs) -> None:
    async with served(pairs.settings()) as server, pairs.user(server, "engineer") as one:
        params = ua.RegisteredServer()
        params.ServerUri = "urn:somewhere:else"
        params.ServerNames = [ua.LocalizedText("else")]
        code = await code_of(one.uaclient.register_server(params))
        assert code == "BadServiceUnsupported"
        assert len(await one.find_servers()) == 1
        node = one.get_node(await node_id(one, "Status/State"))
        assert await code_of(node.read_raw_history()) == "BadServiceUnsupported"


@scene
async def test_a_lost_connection_ends_its_session_at_once(pairs: Pairs) -> None:
    async with served(pairs.settings()) as server:
        one = await pairs.log_in(server, "operator")
        subscription = await one.create_subscription(100, Deaf())
        await subscription.subscribe_data_change(one.get_node(ua.NodeId(2258)))
        inner: Any = server._server
        assert len(inner.iserver._external_sessions) == 1
        one.disconnect_socket()
        watched = inner.iserver.aspace[ua.NodeId(2258)].attributes[ua.AttributeIds.Value]
        async with asyncio.timeout(LONGEST_S):
            while inner.iserver._external_sessions or watched.datachange_callbacks:
                await asyncio.sleep(0.005)
        await one.disconnect()


class Deaf:
    def datachange_notification(self, node: Any, val: object, data: Any) -> None: ...


# ---- bounds -----------------------------------------------------------------------------------


@scene
async def test_requests_are_bounded_in_what_they_ask_at_once(pairs: Pairs) -> None:
    async with served(pairs.settings()) as server, pairs.user(server, "operator") as one:
        server.publish(status())
        asked = ua.CallMethodRequest()
        asked.ObjectId = await node_id(one, "Requests")
        asked.MethodId = await node_id(one, "Requests/WhoAmI")
        calls = [asked] * (MOST_CALLS + 1)
        assert await code_of(one.uaclient.call(calls)) == "BadTooManyOperations"
        assert len(await one.uaclient.call(calls[1:])) == MOST_CALLS
        many = [one.get_node(await node_id(one, "Status/State"))] * (LARGEST_MESSAGE_BYTES // 30)
        with pytest.raises((ConnectionError, ua.UaError)):
            await one.read_attributes(many)


@scene
async def test_subscriptions_are_bounded_in_number_size_and_speed(pairs: Pairs) -> None:
    async with served(pairs.settings()) as server, pairs.user(server, "viewer") as one:
        made = []
        for period_ms in (1.0, 0.0, -5.0, float("nan"), 1000.0)[:MOST_SUBSCRIPTIONS]:
            params = ua.CreateSubscriptionParameters()
            params.RequestedPublishingInterval = period_ms
            params.RequestedLifetimeCount = 2**31
            params.RequestedMaxKeepAliveCount = 2**31
            params.PublishingEnabled = True
            made.append(await one.uaclient.create_subscription(params, lambda _: None))
        granted = [result.RevisedPublishingInterval for result in made]
        assert granted == [SHORTEST_PUBLISHING_MS] * 4 + [1000.0]
        assert all(result.RevisedLifetimeCount <= 3000 for result in made)
        code = await code_of(one.uaclient.create_subscription(params, lambda _: None))
        assert code == "BadTooManySubscriptions"
        items = monitored(await node_id(one, "Status/State"), MOST_MONITORED)
        items.SubscriptionId = made[0].SubscriptionId
        results = await one.uaclient.create_monitored_items(items)
        assert all(r.StatusCode.is_good() and r.RevisedQueueSize <= 100 for r in results)
        one_more = monitored(await node_id(one, "Status/State"), 1)
        one_more.SubscriptionId = made[1].SubscriptionId
        code = await code_of(one.uaclient.create_monitored_items(one_more))
        assert code == "BadTooManyMonitoredItems"


def monitored(node: ua.NodeId, count: int) -> ua.CreateMonitoredItemsParameters:
    params = ua.CreateMonitoredItemsParameters()
    params.TimestampsToReturn = ua.TimestampsToReturn.Both
    for i in range(count):
        item = ua.MonitoredItemCreateRequest()
        item.ItemToMonitor.NodeId = node
        item.ItemToMonitor.AttributeId = ua.AttributeIds.Value
        item.MonitoringMode = ua.MonitoringMode.Reporting
        item.RequestedParameters.ClientHandle = i
        item.RequestedParameters.QueueSize = 1_000_000
        params.ItemsToCreate.append(item)
    return params


@scene
async def test_nobody_touches_the_subscriptions_of_others(pairs: Pairs) -> None:
    async with (
        served(pairs.settings()) as server,
        pairs.user(server, "operator") as one,
        pairs.user(server, "viewer") as other,
    ):
        mine = await one.create_subscription(100, Deaf())
        number = mine.subscription_id
        assert number is not None
        (code,) = await other.uaclient.delete_subscriptions([number])
        assert code.name == "BadSubscriptionIdInvalid"
        items = monitored(await node_id(other, "Status/State"), 1)
        items.SubscriptionId = number
        assert await code_of(other.uaclient.create_monitored_items(items))
        params = ua.TransferSubscriptionsParameters()
        params.SubscriptionIds = [number]
        request = ua.TransferSubscriptionsRequest()
        request.Parameters = params
        assert await code_of(other.uaclient._send_request(request)) == "BadServiceUnsupported"
        await mine.subscribe_data_change(one.get_node(await node_id(one, "Status/State")))
        await mine.delete()


async def raw(url: str, sent: bytes, silent_s: float = 0.2) -> bytes:
    """Send bytes and return what comes back until the other side ends or keeps silent."""
    host, _, port = url.removeprefix("opc.tcp://").partition("/")[0].partition(":")
    reader, writer = await asyncio.open_connection(host, int(port))
    came = b""
    try:
        writer.write(sent)
        await writer.drain()
        async with asyncio.timeout(silent_s):
            while part := await reader.read(65_536):
                came += part
    except TimeoutError:
        came += b"<open>"
    except ConnectionError:
        pass
    finally:
        writer.close()
    return came


@scene
async def test_a_message_that_announces_gigabytes_is_not_waited_for() -> None:
    async with served(viewers()) as server:
        announced = b"MSGF" + struct.pack("<II", 2**32 - 1, 0)
        assert b"<open>" in await raw(server.url, announced + bytes(60_000))
        assert b"<open>" not in await raw(server.url, announced + bytes(200_000), LOG_IN_S / 2.0)


@scene
async def test_any_bytes_leave_the_server_alive() -> None:
    seed = random.Random(6)  # noqa: S311 - bytes for a test

    async with served(viewers()) as server:
        server.publish(status())
        hello = b"HELF" + struct.pack("<I", 32) + struct.pack("<5I", 0, 65535, 65535, 0, 0)
        hello += struct.pack("<i", -1)
        messages: Sequence[bytes] = [
            b"",
            b"GET / HTTP/1.1\r\n\r\n",
            b"HELF" + struct.pack("<I", 8),
            b"HELF" + struct.pack("<I", 0),
            b"XXXF" + struct.pack("<I", 12) + b"\x00" * 4,
            hello,
            *(hello + b"OPNF" + struct.pack("<I", 60) + seed.randbytes(52) for _ in range(6)),
            *(hello + b"MSGF" + struct.pack("<I", 60) + seed.randbytes(52) for _ in range(6)),
            *(seed.randbytes(seed.randrange(1, 500)) for _ in range(6)),
        ]
        await asyncio.gather(*(raw(server.url, message) for message in messages[:12]))
        await asyncio.gather(*(raw(server.url, message) for message in messages[12:]))
        async with client(server) as one:
            assert (await read(one, "Status/State")).Value.Value == "Active"


@scene
async def test_connections_are_bounded_and_who_has_not_logged_in_gives_way_to_who_comes() -> None:
    async with served(viewers()) as server, client(server) as inside:
        host, _, port = server.url.removeprefix("opc.tcp://").partition("/")[0].partition(":")
        held = [await asyncio.open_connection(host, int(port)) for _ in range(MOST_CONNECTIONS)]
        async with asyncio.timeout(LOG_IN_S / 2.0):
            assert await held[0][0].read(1) == b""  # the oldest, not for want of a log-in
        inner: Any = server._server
        assert len(inner.bserver.clients) == MOST_CONNECTIONS
        assert [reader.at_eof() for reader, _ in held[1:]] == [False] * (MOST_CONNECTIONS - 1)
        async with client(server) as one:
            await one.nodes.objects.get_children()
        await inside.nodes.objects.get_children()
        for _, writer in held:
            writer.close()


@scene
async def test_a_flood_of_connections_keeps_nobody_from_logging_in(pairs: Pairs) -> None:
    """A flood of more than 25 in 2 s, which would fill every place until they time out."""
    held: list[asyncio.StreamWriter] = []

    async def flood(port: int) -> None:
        while True:
            _, writer = await asyncio.open_connection("127.0.0.1", port)
            held.append(writer)
            if len(held) > MOST_CONNECTIONS:
                await asyncio.sleep(0.05)

    async with served(pairs.settings()) as server:
        flooding = asyncio.create_task(flood(server.port))
        while len(held) <= MOST_CONNECTIONS:
            await asyncio.sleep(0.01)
        for name in ("operator", "engineer"):
            async with pairs.user(server, name) as one:
                assert await call(one, "WhoAmI") == [name, name]
        flooding.cancel()
        for writer in held:
            writer.close()


# ---- guesses ----------------------------------------------------------------------------------


@pytest.mark.proof
@scene
async def test_a_guesser_is_refused_and_the_right_password_counts_again_after_a_minute(
    pairs: Pairs,
) -> None:
    clock = HandClock()
    async with (
        served(pairs.settings(), clock=clock) as server,
        pairs.user(server, "operator") as inside,
    ):
        for i in range(LOCAL_SHARE * FAILURES_BY_NAME):
            assert await refused(pairs, server, "operator", f"guess {i}")
        assert await refused(pairs, server, "operator", PASSWORD)
        assert await call(inside, "WhoAmI") == ["operator", "operator"]
        async with pairs.user(server, "engineer") as other:
            assert await call(other, "WhoAmI") == ["engineer", "engineer"]
        clock.now_s += REFUSED_S
        async with pairs.user(server, "operator") as again:
            assert await call(again, "WhoAmI") == ["operator", "operator"]


async def refused(pairs: Pairs, server: StatusServer, name: str, password: str) -> bool:
    try:
        one = await pairs.log_in(server, name, password)
    except ua.UaStatusCodeError as error:
        return error.code == ua.StatusCodes.BadUserAccessDenied
    await one.disconnect()
    return False


@scene
async def test_the_loop_goes_on_after_each_look_at_the_passwords_of_failed_log_ins(
    pairs: Pairs, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each password takes 25 ms of a core; checked in the loop twenty would stop it for 0.5 s.

    No look at a password ends before the loop has had another turn. In the loop's own thread that
    turn never comes, however fast the machine is; beside it, it comes however busy it is.
    """
    turned = threading.Event()
    went_on: list[bool] = []
    look = PasswordHasher.verify

    def verify(hasher: PasswordHasher, known: str, password: str) -> bool:
        turned.clear()
        try:
            return look(hasher, known, password)
        finally:
            went_on.append(all(went_on) and turned.wait(10.0))

    monkeypatch.setattr(PasswordHasher, "verify", verify)

    async def turn() -> None:
        while True:
            turned.set()
            await asyncio.sleep(0.001)

    events: list[EventRecord] = []
    async with served(pairs.settings(), audit=events) as server:
        ones = [await channel(server.url, pairs) for _ in range(6)]
        for one in ones:
            await one.create_session()
        turning = asyncio.create_task(turn())
        codes = await asyncio.gather(
            *(
                code_of(one.activate_session(username=f"name {i % 2}", password="wrong one"))  # noqa: S106 - a wrong one
                for i, one in enumerate(ones)
            )
        )
        turning.cancel()
        for one in ones:
            one.disconnect_socket()
        assert set(codes) == {"BadUserAccessDenied"}
        assert len(events) == len(ones)  # every password was looked at
        assert went_on == [True] * len(ones)


@scene
async def test_clients_that_come_back_at_once_do_not_keep_the_server_from_its_end(
    pairs: Pairs,
) -> None:
    async def come_back(port: int, held: list[asyncio.StreamWriter]) -> None:
        while True:
            try:
                _, writer = await asyncio.open_connection("127.0.0.1", port)
            except OSError:
                return
            held.append(writer)

    server = StatusServer(viewers(), Box(), HandClock())
    await server.open()
    held: list[asyncio.StreamWriter] = []
    async with asyncio.TaskGroup() as group:
        group.create_task(come_back(server.port, held))
        while len(held) < 3:
            await asyncio.sleep(0)
        async with asyncio.timeout(4.0):  # less than the bound: nobody is waited for
            await server.close()
    for writer in held:
        writer.close()
        await asyncio.gather(writer.wait_closed(), return_exceptions=True)
