"""Methods that are called through the connection that comes back by itself."""

import asyncio

from asyncua import ua

from tests.opcua_server import until
from tests.unit.runtime.status_server_parts import Box, run, served, status, viewers
from thermaxis.runtime import ConnectionSettings, OpcUaSession, StatusServer, SystemClock

PLACE = "nsu=urn:thermaxis:runtime;s=Requests"


async def connected(server: StatusServer) -> OpcUaSession:
    settings = ConnectionSettings(name="loop", url=server.url, security="none", timeout_s=5.0)
    session = OpcUaSession(settings, SystemClock())
    await session.open()
    await until(lambda: session.connected)
    return session


def test_a_call_brings_back_what_the_method_says() -> None:
    async def scene() -> None:
        async with served(viewers()) as server:
            session = await connected(server)
            answer = await session.call(PLACE, f"{PLACE}/WhoAmI", (), 5.0)
            assert answer == ("Good", ("", "viewer"))
            await session.close()

    run(scene)


def test_a_refused_call_brings_back_the_status_and_keeps_the_connection() -> None:
    async def scene() -> None:
        box = Box()
        async with served(viewers(), box) as server:
            server.publish(status())
            session = await connected(server)
            assert await session.call(PLACE, f"{PLACE}/Enable", (), 5.0) == (
                "BadUserAccessDenied",
                (),
            )
            one = ua.Variant(1.0)
            answer = await session.call(PLACE, f"{PLACE}/WhoAmI", (one,), 5.0)
            assert answer is not None
            assert answer.status == "BadTooManyArguments"
            missing = await session.call(PLACE, f"{PLACE}/Explode", (), 5.0)
            assert missing is not None
            assert missing.status.startswith("Bad")
            other = await session.call("nsu=urn:nobody;s=Requests", f"{PLACE}/WhoAmI", (), 5.0)
            assert other == ("BadNodeIdUnknown", ())
            assert session.generation == 1
            assert session.connected
            assert box.requests == []
            await session.close()

    run(scene)


def test_a_call_without_a_connection_has_no_answer() -> None:
    async def scene() -> None:
        settings = ConnectionSettings(name="loop", url="opc.tcp://127.0.0.1:1", security="none")
        session = OpcUaSession(settings, SystemClock())
        await session.open()
        assert await session.call(PLACE, f"{PLACE}/WhoAmI", (), 0.1) is None
        await session.close()
        assert len(asyncio.all_tasks()) == 1

    run(scene)
