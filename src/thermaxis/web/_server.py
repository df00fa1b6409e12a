"""A web server that says when it is ready, and is ended by signals on every system."""

import signal
import socket
import ssl
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import final

import uvicorn
from starlette.types import ASGIApp

from thermaxis.web._connections import MOST_CONNECTIONS, Connection
from thermaxis.web._log_lines import speak_plainly

_KEEP_ALIVE_S = 15
_LEAVE_S = 2
_LARGEST_MESSAGE_BYTES = 4096
_ENDINGS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
"""Signals that end it, where the system has them: Ctrl+C, a service's stop, a closed window."""


@final
class Server(uvicorn.Server):
    """A server that says when it is ready; a second signal ends it without waiting for answers.

    The library of web sockets is no part of a plain installation: without `web_sockets` it is not
    needed. A `context` holds certificate and key; without one nothing is encrypted.
    """

    def __init__(
        self,
        app: ASGIApp,
        ready: Callable[[], None],
        *,
        web_sockets: bool = False,
        context: ssl.SSLContext | None = None,
    ) -> None:
        speak_plainly()
        config = uvicorn.Config(
            app,
            log_config=None,
            access_log=False,
            server_header=False,
            lifespan="on",
            http=Connection,
            ws="websockets-sansio" if web_sockets else "none",
            ws_max_size=_LARGEST_MESSAGE_BYTES,
            timeout_keep_alive=_KEEP_ALIVE_S,
            timeout_graceful_shutdown=_LEAVE_S,
            limit_concurrency=MOST_CONNECTIONS,
            proxy_headers=False,
            ssl_context_factory=None if context is None else lambda _config, _usual: context,
        )
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
