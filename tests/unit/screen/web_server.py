"""The web server that is used, on a free port of this computer."""

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator, Callable
from typing import NamedTuple

from starlette.types import ASGIApp
from uvicorn.server import ServerState

from tests.opcua_server import until
from thermaxis.web import Server


class Served(NamedTuple):
    """What is served."""

    port: int
    state: ServerState
    """Connections that are open, and requests that are being answered."""


@contextlib.asynccontextmanager
async def served(application_at: Callable[[int], ASGIApp]) -> AsyncIterator[Served]:
    """Serve what is made for a port while the block runs."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        port = int(listener.getsockname()[1])
        server = Server(application_at(port), lambda: None, web_sockets=True)
        server.config.lifespan = "off"
        server.capture_signals = contextlib.nullcontext
        task = asyncio.create_task(server.serve(sockets=[listener]))
        try:
            await until(lambda: server.started or task.done())
            yield Served(port, server.server_state)
        finally:
            server.should_exit = True
            await task
