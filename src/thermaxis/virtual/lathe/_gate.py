"""The network in front of the virtual lathe's server, which can stand still or be gone.

Every connection goes through it byte by byte. While it is paused nothing goes through and
connections stay, as when a switch hangs; while it is closed connections are reset and new ones
refused, as when a server restarts.
"""

import asyncio
from contextlib import suppress
from typing import Final, final

from thermaxis.errors import ConfigurationError

_BLOCK_BYTES: Final = 65_536
_ENDS = (OSError, asyncio.IncompleteReadError)


@final
class NetworkGate:
    """Passes connections on to a port of this computer."""

    def __init__(self, address: str, port: int) -> None:
        self.address = address
        self.port = port
        self.target_port = 0
        self._server: asyncio.Server | None = None
        self._flows = asyncio.Event()
        self._flows.set()
        self._connections: set[asyncio.Task[None]] = set()

    async def open(self) -> None:
        """Listen."""
        if self._server is not None:
            return
        try:
            self._server = await asyncio.start_server(self._take, self.address, self.port)
        except OSError as error:
            raise ConfigurationError(
                "port_unavailable",
                cause=error.strerror or str(error),
                file=f"{self.address}:{self.port}",
                key="--address, --port",
            ) from None
        self.port = int(self._server.sockets[0].getsockname()[1])

    async def close(self) -> None:
        """Stop listening and reset every connection."""
        if self._server is not None:
            self._server.close()
            self._server = None
        tasks = tuple(self._connections)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def pause(self, *, paused: bool) -> None:
        """Let nothing through, or let everything through that has waited."""
        if paused:
            self._flows.clear()
        else:
            self._flows.set()

    def _take(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.create_task(self._connect(reader, writer))
        self._connections.add(task)
        task.add_done_callback(self._connections.discard)

    async def _connect(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        inner: asyncio.StreamWriter | None = None
        try:
            await self._flows.wait()
            inner_reader, inner = await asyncio.open_connection("127.0.0.1", self.target_port)
            forth = asyncio.create_task(self._pass_on(reader, inner))
            back = asyncio.create_task(self._pass_on(inner_reader, writer))
            try:
                await asyncio.wait({forth, back}, return_when=asyncio.FIRST_COMPLETED)
            finally:
                forth.cancel()
                back.cancel()
                await asyncio.gather(forth, back, return_exceptions=True)
        except OSError:
            pass  # the connection is closed below: its client sees that nobody is there
        finally:
            ends = (writer,) if inner is None else (writer, inner)
            for end in ends:  # both before anything is waited for: the wait may be cancelled
                end.transport.abort()
            for end in ends:
                with suppress(*_ENDS):
                    await end.wait_closed()

    async def _pass_on(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with suppress(*_ENDS):
            while block := await reader.read(_BLOCK_BYTES):
                await self._flows.wait()
                writer.write(block)
                await writer.drain()
