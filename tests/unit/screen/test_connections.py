"""Connections without a request, or that take no answer: bounded, and ended.

Real time is the subject, as sockets and the web server's own timers have no other. What must come
about is waited for as long as it takes; only what must not is looked at for a fixed time.
"""

import asyncio
import contextlib
import socket
from collections.abc import AsyncGenerator
from itertools import product
from typing import Any, NamedTuple

import pytest
import uvicorn

from tests.opcua_server import until
from tests.scenes import scene
from thermaxis.web import _connections
from thermaxis.web._connections import Connection, Listener

LOOPBACK = "127.0.0.1"
ASKS = b"GET / HTTP/1.1\r\nHost: x\r\n"


async def application(scope: Any, receive: Any, send: Any) -> None:
    """Answer with as many bytes as the path says."""
    assert scope["type"] == "http"
    size = int(scope["path"][1:] or "2")
    head = [(b"content-length", str(size).encode())]
    await send({"type": "http.response.start", "status": 200, "headers": head})
    left = size
    while left:
        part = min(left, 65_536)
        left -= part
        await send({"type": "http.response.body", "body": bytes(part), "more_body": left > 0})


class Served(NamedTuple):
    """What is served."""

    port: int
    connections: set[Any]
    """Those that are open."""


@contextlib.asynccontextmanager
async def serving(listener: Listener) -> AsyncGenerator[Served]:
    """Serve as the screen does, at a free port."""
    listener.bind((LOOPBACK, 0))
    config = uvicorn.Config(application, http=Connection, log_config=None, lifespan="off")
    config.timeout_keep_alive = 600
    config.load()
    server = uvicorn.Server(config)
    server.lifespan = config.lifespan_class(config)
    with listener:
        await server.startup(sockets=[listener])
        try:
            yield Served(int(listener.getsockname()[1]), server.server_state.connections)
        finally:
            server.should_exit = server.force_exit = True
            for connection in list(server.server_state.connections):
                connection.transport.abort()
            await server.shutdown(sockets=[listener])


async def open_one(port: int, source: str = LOOPBACK) -> tuple[asyncio.StreamReader, Any]:
    return await asyncio.open_connection(LOOPBACK, port, local_addr=(source, 0))


async def ended(reader: asyncio.StreamReader, within_s: float = 20.0) -> bool:
    """Say whether the other side has ended a connection."""
    try:
        async with asyncio.timeout(within_s):
            while await reader.read(65_536):
                pass
    except ConnectionError:
        return True
    except TimeoutError:
        return False
    return True


async def answer_of(reader: asyncio.StreamReader) -> bytes:
    async with asyncio.timeout(20.0):
        head = await reader.readuntil(b"\r\n\r\n")
        await reader.readexactly(2)
    return head.split()[1]


@scene
async def test_connections_beyond_the_bound_of_an_address_or_of_all_are_closed_at_once() -> None:
    listener = Listener(socket.AF_INET)
    listener.most, listener.most_of_address = 5, 3
    async with serving(listener) as (port, _):
        first = [await open_one(port) for _ in range(3)]
        fourth, fourth_writer = await open_one(port)
        assert await ended(fourth)
        others = [await open_one(port, "127.0.0.2") for _ in range(2)]
        sixth, sixth_writer = await open_one(port, "127.0.0.3")
        assert await ended(sixth)
        for reader, writer in (*first, *others):  # and nobody else is harmed
            writer.write(ASKS + b"\r\n")
            assert await answer_of(reader) == b"200"
        first[0][1].write(ASKS + b"Connection: close\r\n\r\n")
        assert await ended(first[0][0])
        last_reader, last = await open_one(port)  # one that has ended makes room
        last.write(ASKS + b"\r\n")
        assert await answer_of(last_reader) == b"200"
        for _, writer in (*first, *others):
            writer.close()
        for writer in (fourth_writer, sixth_writer, last):
            writer.close()


@scene
async def test_a_request_that_does_not_come_whole_ends_its_connection(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Also the second request of a connection, where the library would wait for ever."""
    monkeypatch.setattr(Connection, "request_s", 0.1)
    async with serving(Listener(socket.AF_INET)) as (port, _):
        for sent, after in product((b"", ASKS, b"\r\n"), (0, 1)):
            idle = bool(after) and not sent  # one that is idle has the library's time
            reader, writer = await open_one(port)
            for _ in range(after):
                writer.write(ASKS + b"\r\n")
                assert await answer_of(reader) == b"200"
            writer.write(sent)
            assert await ended(reader, 1.0 if idle else 20.0) is not idle, (sent, after)
            writer.close()


@scene
async def test_a_request_that_comes_slowly_but_in_time_is_answered(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(Connection, "request_s", 20.0)
    async with serving(Listener(socket.AF_INET)) as (port, _):
        reader, writer = await open_one(port)
        for part in (ASKS[:7], ASKS[7:], b"\r\n"):
            writer.write(part)
            await writer.drain()
        assert await answer_of(reader) == b"200"
        writer.close()


@scene
async def test_an_answer_that_is_not_taken_ends_its_connection(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(Connection, "stall_s", 0.1)
    async with serving(Listener(socket.AF_INET)) as (port, connections):
        reader, writer = await open_one(port)
        writer.transport.pause_reading()
        writer.write(b"GET /50000000 HTTP/1.1\r\nHost: x\r\n\r\n")
        await until(lambda: bool(connections))
        await until(lambda: not connections)
        writer.transport.resume_reading()
        got = 0
        with contextlib.suppress(ConnectionError):
            async with asyncio.timeout(20.0):
                while part := await reader.read(1 << 20):
                    got += len(part)
        writer.close()
        assert got < 50_000_000


def test_a_page_with_its_files_is_far_from_the_bounds() -> None:
    assert _connections.MOST_OF_ADDRESS >= 24 + 6 * 8
    assert _connections.MOST_CONNECTIONS >= 64 + 100
