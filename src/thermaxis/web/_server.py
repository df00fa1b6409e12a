"""A web server that says when it is ready, and is ended by signals on every system."""

import signal
import socket
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import final

import uvicorn

_ENDINGS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
"""Signals that end it, where the system has them: Ctrl+C, a service's stop, a closed window."""


@final
class Server(uvicorn.Server):
    """A server that says when it is ready; a second signal ends it without waiting for answers."""

    def __init__(self, config: uvicorn.Config, ready: Callable[[], None]) -> None:
        super().__init__(config)
        self._ready = ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to listen."""
        await super().startup(sockets)
        if self.started:
            self._ready()

    @contextmanager
    def capture_signals(self) -> Generator[None]:
        """End by signals; the library would raise them again afterwards."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        known = [getattr(signal, name) for name in _ENDINGS if hasattr(signal, name)]
        before = {one: signal.signal(one, self._end) for one in known}
        try:
            yield
        finally:
            for one, former in before.items():
                signal.signal(one, former)

    def _end(self, *_: object) -> None:
        self.force_exit = self.should_exit
        self.should_exit = True
