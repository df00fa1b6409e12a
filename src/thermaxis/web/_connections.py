"""Connections before there is a request: how many there are, from where, and for how long."""

import asyncio
import os
import socket
from typing import Any, Final, Self, final

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from thermaxis.errors import ConfigurationError

MOST_CONNECTIONS: Final = 200
"""Connections at once; a page has two, for a moment up to seven. [1]"""
MOST_OF_ADDRESS: Final = 100
"""Connections from one address, this computer's own too, so that one cannot have all. [1]"""
REQUEST_S: Final = 10.0
"""Time in which the head of a request must have come. [s]"""
STALL_S: Final = 60.0
"""Time in which something of an answer that waits must have been taken. [s]"""


@final
class Listener(socket.socket):
    """A listening socket that closes at once what is too many, before TLS and HTTP.

    A connection counts until it is closed on this side. Where asyncio does not accept by this
    socket's own method (Windows), nothing is bounded here but by uvicorn's own limit of requests.

    Not protected: whoever has many addresses can take all connections between them; then no new
    page is served until some end. Pages that are open stay.
    """

    most = MOST_CONNECTIONS
    """Connections at once. [1]"""
    most_of_address = MOST_OF_ADDRESS
    """Connections from one address. [1]"""

    def __init__(self, family: int) -> None:
        super().__init__(family, socket.SOCK_STREAM)
        self._open: dict[str, list[socket.socket]] = {}

    @classmethod
    def at(cls, address: str, port: int, refusal: str) -> Self:
        """Return one that is bound.

        Raises
        ------
        ConfigurationError
            With the code `refusal`, if the address is taken or not this computer's, or the port is
            none.
        """
        listener = cls(socket.AF_INET6 if ":" in address else socket.AF_INET)
        try:
            if os.name == "posix":  # elsewhere it would take a port from another program
                listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind((address, port))
        except (OSError, OverflowError) as error:
            listener.close()
            cause = getattr(error, "strerror", None) or str(error)
            raise ConfigurationError(refusal, cause=cause, file=f"{address}, port {port}") from None
        return listener

    def accept(self) -> tuple[socket.socket, Any]:
        """Take the next connection."""
        found, address = super().accept()
        host = str(address[0])
        still = {
            key: [one for one in some if one.fileno() >= 0] for key, some in self._open.items()
        }
        self._open = {key: some for key, some in still.items() if some}
        in_all = sum(len(some) for some in self._open.values())
        own = self._open.setdefault(host, [])
        if in_all >= self.most or len(own) >= self.most_of_address:
            found.close()
            raise ConnectionAbortedError
        own.append(found)
        if hasattr(socket, "TCP_USER_TIMEOUT"):  # what is closed, but not taken, ends as well
            found.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, int(1000 * STALL_S))
        return found, address


@final
class Connection(H11Protocol):
    """A connection of HTTP that is ended where a request does not come, or an answer not go.

    The library's own limit ends only connections on which nothing at all comes after an answer.
    The times are those of the event loop.
    """

    request_s = REQUEST_S
    """Time for the head of a request. [s]"""
    stall_s = STALL_S
    """Time in which something of an answer must have gone. [s]"""

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self._late: asyncio.TimerHandle | None = None
        self._stalled: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:
        """Begin to wait for a request."""
        super().connection_made(transport)
        self._judge()

    def data_received(self, data: bytes) -> None:
        """Take what came; a half-sent head goes on to be waited for, but no longer."""
        super().data_received(data)
        self._judge()

    def connection_lost(self, exc: Exception | None) -> None:
        """End all waiting."""
        _cancel(self._late)
        _cancel(self._stalled)
        super().connection_lost(exc)

    def pause_writing(self) -> None:
        """Wait for the other side to take something."""
        super().pause_writing()
        _cancel(self._stalled)
        self._stalled = self.loop.call_later(self.stall_s, self._abort)

    def resume_writing(self) -> None:
        """Go on."""
        _cancel(self._stalled)
        super().resume_writing()

    def _judge(self) -> None:
        """Wait for a head where one has not come; another protocol looks after itself."""
        ours = self.transport.get_protocol() is self
        if ours and self.conn.their_state is h11.IDLE and not self.transport.is_closing():
            if self._late is None:
                self._late = self.loop.call_later(self.request_s, self._abort)
        else:
            _cancel(self._late)
            _cancel(None if ours else self._stalled)
            self._late = None

    def _abort(self) -> None:
        self.transport.abort()


def _cancel(timer: asyncio.TimerHandle | None) -> None:
    if timer is not None:
        timer.cancel()
