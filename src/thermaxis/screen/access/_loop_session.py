"""One OPC UA session under the name of a person.

The password goes into the log-in and is forgotten with it; after a loss another session is opened
by the token that the loop has issued in this one.
"""

import asyncio
import contextlib
from collections.abc import Sequence
from dataclasses import replace
from typing import Final, NamedTuple, final

from asyncua import ua

from thermaxis.runtime import Clock, ConnectionSettings, Role, Secret
from thermaxis.runtime.opcua import (
    FAILURES,
    Link,
    MethodAnswer,
    call_method,
    connect_once,
    discard,
    take_leave,
)
from thermaxis.screen.feed import REQUESTS, role_in

LOG_IN_S: Final = 10.0
"""Longest time of a log-in; one takes 0.14 s [run], and passwords are checked in turn. [s]"""
REQUEST_S: Final = 60.0
"""Longest time for which an answer is waited for on the connection. Longer than anybody waits for
one, so that an answer that is late costs nobody a log-in. [s]"""
SESSION_TIMEOUT_MS: Final = 90_000.0
"""How long the server is asked to keep a silent session: it answers the requests of a session one
after the other, and one that waits for the loop is silence. It ends a session whose connection is
lost at once, so that nothing is left of a killed screen. [ms]"""
_LEAVE_S: Final = 1.0
_REFUSALS: Final = frozenset({"BadUserAccessDenied", "BadIdentityTokenRejected"})


class Caller(NamedTuple):
    """Who the loop's server says that a session belongs to."""

    name: str
    """Name of the user; empty for somebody without one."""
    role: Role
    """What the user may do now."""


@final
class LoopSession:
    """A session that is logged in; see `log_in`.

    Not protected: a request whose answer does not come may take effect all the same.
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self.token = Secret("")
        """What the next session is opened by; empty where the loop has issued nothing."""

    @staticmethod
    async def log_in(settings: ConnectionSettings, clock: Clock) -> "LoopSession | None":
        """Log in, and forget the password; None: name or password is wrong."""
        patient = replace(settings, timeout_s=REQUEST_S)
        try:
            link = await connect_once(patient, clock, LOG_IN_S, SESSION_TIMEOUT_MS)
        except ua.UaStatusCodeError as error:
            if ua.StatusCode(ua.UInt32(error.code)).name in _REFUSALS:
                return None
            raise
        link.client.set_password("")
        return LoopSession(link)

    @property
    def lost(self) -> bool:
        """Whether the connection is lost; it does not come back."""
        return self._link.lost.is_set()

    @property
    def busy(self) -> bool:
        """Whether the server has not yet answered everything that it was asked."""
        return bool(self._link.under_way)

    def give_up(self) -> None:
        """Take the connection for lost."""
        self._link.lose(TimeoutError())

    async def call(
        self, method: str, arguments: Sequence[float | str], deadline_s: float
    ) -> MethodAnswer | None:
        """Call a method of the status server."""
        if self.lost:
            return None
        given = [ua.Variant(one) for one in arguments]  # a float is a Double
        return await call_method(self._link, REQUESTS, f"{REQUESTS}/{method}", given, deadline_s)

    async def who_am_i(self, deadline_s: float) -> Caller | None:
        """Ask the server who this is, and what it may do now."""
        answer = await self.call("WhoAmI", (), deadline_s)
        role = None if answer is None else role_in(answer)
        if answer is None or role is None:
            return None
        name = answer.values[0]
        return Caller(name, role) if isinstance(name, str) else None

    async def take_token(self, deadline_s: float) -> None:
        """Have a token issued; a session that was opened by one has none issued."""
        answer = await self.call("IssueToken", (), deadline_s)
        told = answer.values[0] if answer is not None and len(answer.values) == 1 else None
        self.token = Secret(told) if isinstance(told, str) else Secret("")

    async def close(self) -> None:
        """Log out at the server, its token too, and end the connection; nothing of it runs on.

        The token stays where the server has not taken its end.
        """
        link, token = self._link, self.token.reveal()
        if token and await self.call("RevokeToken", (token,), _LEAVE_S) is not None:
            self.token = Secret("")
        gone = self.lost
        self.give_up()
        waiting = tuple(link.under_way)
        for task in waiting:
            task.cancel()
        await asyncio.gather(*waiting, return_exceptions=True)
        if not gone:
            await take_leave(link.client, _LEAVE_S)
        with contextlib.suppress(*FAILURES):
            await discard(link.client)
