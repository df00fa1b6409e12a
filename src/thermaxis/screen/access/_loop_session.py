"""One OPC UA session under the name of a person, made once and never made again.

The password goes into the log-in and is forgotten with it, so nothing here could log in a second
time: a connection that is lost ends the log-in, and the person says the password again.
"""

import asyncio
import contextlib
from collections.abc import Sequence
from dataclasses import replace
from typing import Final, NamedTuple, final

from asyncua import ua

from thermaxis.runtime import Clock, ConnectionSettings, Role
from thermaxis.runtime.opcua import (
    FAILURES,
    LASTING,
    Link,
    MethodAnswer,
    PairFiles,
    answer_of,
    call_request,
    connect_once,
    discard,
    take_leave,
)
from thermaxis.screen.feed import REQUESTS, WHO_AM_I, role_in

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


def is_refusal(error: BaseException) -> bool:
    """Return whether a log-in failed for its name and password, and for nothing else."""
    if not isinstance(error, ua.UaStatusCodeError):
        return False
    return ua.StatusCode(ua.UInt32(error.code)).name in _REFUSALS


@final
class LoopSession:
    """A session that is logged in; see `log_in`.

    Not protected: a request whose answer does not come may take effect all the same.
    """

    def __init__(self, link: Link) -> None:
        self._link = link

    @staticmethod
    async def log_in(settings: ConnectionSettings, clock: Clock) -> "LoopSession":
        """Log in, and forget the password."""
        patient = replace(settings, timeout_s=REQUEST_S)
        link = await connect_once(patient, PairFiles(patient), clock, LOG_IN_S, SESSION_TIMEOUT_MS)
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
        self, method: str, arguments: Sequence[ua.Variant], deadline_s: float
    ) -> MethodAnswer | None:
        """Call a method of the status server."""
        return await self._call(f"{REQUESTS}/{method}", arguments, deadline_s)

    async def who_am_i(self, deadline_s: float) -> Caller | None:
        """Ask the server who this is, and what it may do now."""
        answer = await self._call(WHO_AM_I, (), deadline_s)
        role = None if answer is None else role_in(answer)
        if answer is None or role is None:
            return None
        name = answer.values[0]
        return Caller(name, role) if isinstance(name, str) else None

    async def _call(
        self, method: str, arguments: Sequence[ua.Variant], deadline_s: float
    ) -> MethodAnswer | None:
        link = self._link
        if self.lost:
            return None
        request = call_request(link, REQUESTS, method, arguments)
        if request is None:
            return MethodAnswer("BadNodeIdUnknown", ())
        task = asyncio.create_task(link.client.uaclient.session.call([request]))
        link.under_way.add(task)
        task.add_done_callback(self._answered)
        lost = asyncio.create_task(link.lost.wait())
        try:
            await asyncio.wait(
                (task, lost), timeout=deadline_s, return_when=asyncio.FIRST_COMPLETED
            )
        finally:
            lost.cancel()
        if not task.done() or task.cancelled():
            return None
        error = task.exception()
        if error is not None:
            return _status_of(error)
        found = task.result()
        if len(found) != 1:
            link.lose(ValueError("the answer has another length than the question"))
            return None
        return answer_of(found[0])

    def _answered(self, task: "asyncio.Task[list[ua.CallMethodResult]]") -> None:
        self._link.under_way.discard(task)
        error = None if task.cancelled() else task.exception()
        if error is not None and _status_of(error) is None:
            self._link.lose(error)

    async def close(self) -> None:
        """Log out at the server and end the connection; nothing of it runs on."""
        link, gone = self._link, self.lost
        self.give_up()
        waiting = tuple(link.under_way)
        for task in waiting:
            task.cancel()
        await asyncio.gather(*waiting, return_exceptions=True)
        if not gone:
            await take_leave(link.client, _LEAVE_S)
        with contextlib.suppress(*FAILURES):
            await discard(link.client)


def _status_of(error: BaseException) -> MethodAnswer | None:
    """Return the refusal of a whole request that a new connection would not change."""
    if isinstance(error, ua.UaStatusCodeError) and error.code in LASTING:
        return MethodAnswer(ua.StatusCode(ua.UInt32(error.code)).name, ())
    return None
