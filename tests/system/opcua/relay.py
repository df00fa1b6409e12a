"""A network between a loop and its server that delays, holds and resets."""

import asyncio
import contextlib
import threading
import time
from types import TracebackType
from typing import Self

from tests.in_time import LONGEST_S


class Relay:
    """Relays to a port of this computer; delays count for every piece, in each direction."""

    def __init__(self, target: int) -> None:
        self.target, self.port = target, 0
        self.delay_s = 0.0
        self._held_until_s = 0.0
        self._ends: set[asyncio.StreamWriter] = set()
        self._loop = asyncio.new_event_loop()
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._live, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        assert self._ready.wait(LONGEST_S)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._loop.call_soon_threadsafe(self._stop.set)
        self._thread.join(10.0)

    def hold(self, seconds: float) -> None:
        """Hold everything for a while, and then deliver it."""
        self._held_until_s = time.monotonic() + seconds

    def reset(self) -> None:
        """Drop every connection."""
        self._loop.call_soon_threadsafe(self._abort)

    def _abort(self) -> None:
        for end in tuple(self._ends):
            end.transport.abort()

    def _live(self) -> None:
        self._loop.run_until_complete(self._serve())
        self._loop.close()

    async def _serve(self) -> None:
        self._stop = asyncio.Event()
        server = await asyncio.start_server(self._relay, "127.0.0.1", 0)
        self.port = server.sockets[0].getsockname()[1]
        self._ready.set()
        await self._stop.wait()
        server.close()
        self._abort()
        for task in asyncio.all_tasks() - {asyncio.current_task()}:
            task.cancel()
        await asyncio.sleep(0.05)

    async def _relay(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            there, back = await asyncio.open_connection("127.0.0.1", self.target)
        except OSError:
            writer.transport.abort()
            return
        self._ends |= {writer, back}
        pumps = self._pump(reader, back), self._pump(there, writer)
        with contextlib.suppress(asyncio.CancelledError):
            await asyncio.gather(*pumps)
        self._ends -= {writer, back}

    async def _pump(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Deliver in order, also what was taken from a sender that has gone."""
        due: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()

        async def deliver() -> None:
            while True:
                at_s, piece = await due.get()
                if not piece:
                    break
                while (left_s := max(at_s, self._held_until_s) - time.monotonic()) > 0.0:
                    await asyncio.sleep(left_s)
                try:
                    writer.write(piece)
                    await writer.drain()
                except OSError:
                    break
            writer.close()

        delivering = asyncio.ensure_future(deliver())
        try:
            while piece := await reader.read(65536):
                due.put_nowait((time.monotonic() + self.delay_s, piece))
        except OSError:
            pass
        due.put_nowait((0.0, b""))
        await delivering
