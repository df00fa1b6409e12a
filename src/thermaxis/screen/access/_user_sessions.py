"""Who has logged in at the screen: a cookie each, and a session of their own at the loop.

The screen knows no passwords and no rights. It hands a name and a password to the loop's status
server once, and every request goes out in the session that this opened: what a person may do is
decided there, each time anew. A session that is lost is opened again by the token that the loop
has issued, for as long as that holds.
"""

import asyncio
import hashlib
import math
import secrets
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack
from dataclasses import dataclass, field
from typing import Final, NamedTuple, final

from thermaxis.errors import ConfigurationError, ThermaxisError
from thermaxis.runtime import (
    LONGEST_NAME,
    LONGEST_PASSWORD,
    PIN_MARK,
    PIN_REFUSED_S,
    Clock,
    LogInThrottle,
    Role,
    Secret,
    check_name,
)
from thermaxis.runtime.opcua import FAILURES
from thermaxis.screen.access._answers import (
    LOST,
    NO_ANSWER,
    TOO_MANY_ASKED,
    Outcome,
    Question,
    outcome_of,
    refused,
    unknown,
)
from thermaxis.screen.access._file_session import FileSession
from thermaxis.screen.access._loop_session import LoopSession

COOKIE_BYTES: Final = 32
"""Random bytes of a cookie. Origin: twice what OWASP asks of a session. [byte]"""
TOKEN_BYTES: Final = 24
"""Random bytes of the token that every request carries besides the cookie. [byte]"""
ANSWER_S: Final = 15.0
"""Longest time for which the loop's answer is waited for; its server gives up after 10 s with a
cycle of up to 3.3 s. [s]"""
KEEP_ALIVE_S: Final = 3.0
"""The server is asked so often who a person is and what the role is now: it keeps the session,
and ends the log-in of somebody who was struck off. [s]"""
NO_SIGN_S: Final = 10.0
"""A session whose server has not said for so long who it belongs to is lost. [s]"""
MOST_OF_ONE: Final = 4
"""Log-ins of one name at once; with the next one the oldest ends. [1]"""
MOST_AT_ONCE: Final = 4
"""Log-ins whose passwords are being checked, and requests of one person that wait. [1]"""
_Session = LoopSession | FileSession
_LONGEST_COOKIE: Final = 128
_MOST_ENDED: Final = 16

# why nobody is logged in
REFUSED: Final = "login-refused"
TOO_MANY: Final = "login-too_many"
TOO_MANY_FROM_HERE: Final = "login-too_many_from_here"
FULL: Final = "login-full"
BUSY: Final = "login-busy"
NO_CONNECTION: Final = "login-no_connection"
IMPOSSIBLE: Final = "login-impossible"
NO_PANEL: Final = "login-no_panel"
NO_ROLE: Final = "login-no_role"
# why a log-in has ended
OUT: Final = "login-out"
IDLE: Final = "login-idle"
TOO_LONG: Final = "login-too_long"
ROLE_GONE: Final = "login-role_gone"
ELSEWHERE: Final = "login-elsewhere"
# why nothing can be asked for a while
LOOP_GONE: Final = "login-loop_gone"


class Refusal(NamedTuple):
    """Why somebody was not logged in."""

    key: str
    left_s: int = 0
    """After so long the next attempt is looked at, where too many have failed. [s]"""


@final
@dataclass(slots=True, eq=False)
class UserSession:
    """Somebody who has logged in, once: another log-in of the same user is another person."""

    name: str
    """Name of the user, as the loop's server says it."""
    role: Role
    """What the user may do, as the server said last."""
    token: str = field(repr=False)
    """Secret that every request of the person's pages carries besides the cookie."""
    began_s: float
    """When the log-in was, monotonic. [s]"""
    seen_s: float
    """Last sign of the person, monotonic. [s]"""
    session: _Session = field(repr=False)
    """The session where users are known; requests go through `UserSessions.ask`."""
    ended: str = ""
    """Key of the words that say why the log-in has ended; empty while it stands."""
    waiting: int = 0
    """Requests whose answers are waited for. [1]"""
    renewing: bool = False
    """Whether another session is being opened in place of one that is lost."""


@final
class UserSessions:
    """Logs people in and out, and asks the loop what they ask.

    With a log-in ends the token that the loop has issued for it, there too: at once, or as soon as
    the loop can be asked.

    Not protected: while the loop is away nobody can ask it who somebody is. Whoever had logged in
    looks on in the role of before, at most until the ends of every log-in, and asks for nothing.
    A token whose log-in ends while loop or screen are away for good ends by its own time.

    Also not protected: whoever has a person's cookie and reads a page with it is that person until
    the log-in ends, by log-out, after `idle_s` without a sign or after `longest_s` in any case; the
    address is not compared, since a panel may change it. What can be asked meanwhile is what the
    loop takes from that role, within the loop's limits, and every request is recorded there under
    the name. A cookie alone, without the token of the person's pages, asks for nothing. Passwords
    are in the memory of this program while they are handed on, and Python wipes no text: whoever
    may read the program's memory may find one. With ten failures in a minute everybody
    behind the same address waits (see `LogInThrottle`). Those who have logged in are not touched.
    """

    def __init__(
        self,
        session_of: Callable[[str, Secret], Awaitable[_Session | None]],
        clock: Clock,
        *,
        idle_s: float,
        longest_s: float,
        takes_pin: Callable[[str], bool] = lambda _: False,
        most: int = 12,
        answer_s: float = ANSWER_S,
    ) -> None:
        self._open_session = session_of
        self._clock = clock
        self._idle_s = idle_s
        self._longest_s = longest_s
        self._most = most
        self._answer_s = answer_s
        self._standing: dict[bytes, UserSession] = {}
        self._ended: dict[bytes, UserSession] = {}
        self._takes_pin = takes_pin
        self._throttle, self._pins = LogInThrottle(), LogInThrottle(PIN_REFUSED_S)
        self._coming = 0
        self._leaving: set[asyncio.Task[None]] = set()
        self._task: asyncio.Task[None] | None = None

    # ---- life -----------------------------------------------------------------------------------

    async def open(self) -> None:
        """Begin to keep sessions alive."""
        self._task = asyncio.create_task(self._keep_alive(), name="persons")

    async def close(self) -> None:
        """Log everybody out; nothing runs on."""
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)
        for person in tuple(self._standing.values()):
            self._end(person, OUT)
        await asyncio.gather(*self._leaving)
        if task is not None and not task.cancelled() and (error := task.exception()) is not None:
            raise error  # a mistake in the program is not hidden

    async def _keep_alive(self) -> None:
        async with asyncio.TaskGroup() as group:
            while True:
                await self._clock.sleep_until(self._clock.monotonic_s() + KEEP_ALIVE_S)
                for person in (*self._standing.values(), *self._ended.values()):
                    over, session = self._over(person), person.session
                    if session.lost and (session.token or not over) and not person.renewing:
                        group.create_task(self._renew(person))
                    elif not (over or session.lost or session.busy):
                        group.create_task(self._refresh(person))

    async def _refresh(self, person: UserSession) -> None:
        """Ask the server who a person is now; end the log-in of somebody who is nobody."""
        session = person.session
        waits = session.busy  # the server answers one after the other, and the loop takes its time
        caller = await session.who_am_i(NO_SIGN_S)
        if person.ended or (caller is None and waits and not session.lost):
            return
        if caller is None:
            session.give_up()
        elif caller.name != person.name or caller.role is Role.NONE:
            self._end(person, ROLE_GONE)
        else:
            person.role = caller.role

    async def _renew(self, person: UserSession) -> None:
        """Open a session in place of a lost one: to go on, or to end the token of who has gone."""
        person.renewing, lost = True, person.session
        try:
            found = await self._session_of(person.name, lost.token)
            if isinstance(found, Refusal):
                if found.key == REFUSED:
                    lost.token = Secret("")
                    self._end(person, ROLE_GONE)
                return
            found.token, lost.token = lost.token, Secret("")
            person.session = found
            await (found if person.ended else lost).close()
        finally:
            person.renewing = False
        await self._refresh(person)

    def _over(self, person: UserSession) -> bool:
        """End a log-in that lasted too long, and return whether it has ended."""
        now_s = self._clock.monotonic_s()
        if now_s - person.began_s >= self._longest_s:
            self._end(person, TOO_LONG)
        elif now_s - person.seen_s >= self._idle_s:
            self._end(person, IDLE)
        return bool(person.ended)

    def _end(self, person: UserSession, key: str) -> None:
        """End a log-in; its session is closed at the server meanwhile."""
        known = next((known for known, one in self._standing.items() if one is person), None)
        if known is None:
            return
        person.ended = key
        self._ended[known] = self._standing.pop(known)
        if len(self._ended) > _MOST_ENDED:
            done = (one for one, left in self._ended.items() if not left.session.token)
            del self._ended[next(done, next(iter(self._ended)))]
        leaving = asyncio.create_task(person.session.close(), name="log-out")
        self._leaving.add(leaving)
        leaving.add_done_callback(self._leaving.discard)

    # ---- log-in ---------------------------------------------------------------------------------

    async def log_in(
        self, name: str, password: str, address: str, *, pin: bool = False
    ) -> tuple[str, UserSession] | Refusal:
        """Log somebody in by a password, or by a PIN, which is taken at a panel only."""
        if pin and not self._takes_pin(address):
            return Refusal(NO_PANEL)
        password = PIN_MARK + password if pin else password.lstrip(PIN_MARK[0])
        name, now_s = name[: LONGEST_NAME + 1], self._clock.monotonic_s()
        throttle = self._pins if pin else self._throttle
        refused = throttle.refused(name, address, now_s)
        if refused is not None:
            key = TOO_MANY_FROM_HERE if refused.address else TOO_MANY
            return Refusal(key, math.ceil(refused.left_s))
        if self._coming >= MOST_AT_ONCE or self._task is None:
            return Refusal(BUSY)
        if self.count >= self._most:
            return Refusal(FULL)
        throttle.count(name, address, now_s)
        self._coming += 1
        try:
            found = await self._session_of(name, Secret(password))
        finally:
            self._coming -= 1
        if isinstance(found, Refusal):
            if found.key != REFUSED:
                throttle.take_back(name, address, now_s)
            return found
        throttle.succeeded(name, address)
        return await self._admit(found, name)

    async def _session_of(self, name: str, password: Secret) -> _Session | Refusal:
        """Return a session under a name and a password, or why there is none."""
        try:
            check_name(name)
            fits = 0 < len(password.reveal().encode()) <= LONGEST_PASSWORD
        except (ConfigurationError, UnicodeEncodeError):
            fits = False
        if not fits:
            return Refusal(REFUSED)
        try:
            return await self._open_session(name, password) or Refusal(REFUSED)
        except FAILURES as error:
            return Refusal(IMPOSSIBLE if isinstance(error, ThermaxisError) else NO_CONNECTION)

    async def _admit(self, session: _Session, name: str) -> tuple[str, UserSession] | Refusal:
        """Give a session that is logged in a cookie, if the server says that it may look."""
        async with AsyncExitStack() as undone:
            undone.push_async_callback(session.close)
            caller = await session.who_am_i(NO_SIGN_S)
            if caller is None:
                return Refusal(NO_CONNECTION)
            if caller.name != name or not caller.role.at_least(Role.VIEWER):
                return Refusal(NO_ROLE)
            await session.take_token(NO_SIGN_S)
            if self._task is None or self.count >= self._most:
                return Refusal(FULL)
            undone.pop_all()
        own = [person for person in self._standing.values() if person.name == name]
        if len(own) >= MOST_OF_ONE:
            self._end(own[0], ELSEWHERE)
        now_s = self._clock.monotonic_s()
        cookie, token = (secrets.token_urlsafe(size) for size in (COOKIE_BYTES, TOKEN_BYTES))
        person = UserSession(name, caller.role, token, now_s, now_s, session)
        self._standing[_hash(cookie)] = person
        return cookie, person

    async def log_out(self, cookie: str | None) -> None:
        """End a log-in; session and token are gone at the server, if it is there, afterwards."""
        person = self._standing.get(_hash(cookie))
        if person is not None:
            self._end(person, OUT)
            await asyncio.gather(*self._leaving)

    # ---- requests -------------------------------------------------------------------------------

    @property
    def count(self) -> int:
        """How many log-ins stand. [1]"""
        return sum(not self._over(person) for person in tuple(self._standing.values()))

    def of(self, cookie: str | None, *, touch: bool = False) -> UserSession | None:
        """Return whose cookie it is."""
        if self._task is not None and self._task.done():
            self._task.result()
        person = self._standing.get(_hash(cookie))
        if person is None or self._over(person):
            return None
        if touch:
            person.seen_s = self._clock.monotonic_s()
        return person

    def why_ended(self, cookie: str | None) -> str:
        """Return why the log-in of a cookie has ended."""
        person = self._ended.get(_hash(cookie))
        return "" if person is None else person.ended

    async def ask(self, person: UserSession, question: Question) -> Outcome:
        """Ask the loop for something under the name of a person."""
        if self._over(person) or person.session.lost:
            return refused(person.ended or LOOP_GONE)
        if person.waiting >= MOST_AT_ONCE:
            return refused(TOO_MANY_ASKED)
        person.seen_s = self._clock.monotonic_s()
        person.waiting += 1
        session = person.session
        try:
            answer = await session.call(question.ask.name, question.arguments, self._answer_s)
        finally:
            person.waiting -= 1
        if answer is None:
            return unknown(LOST if self._over(person) or session.lost else NO_ANSWER)
        if answer.status == "BadUserAccessDenied":
            await self._refresh(person)
        return outcome_of(answer)


def _hash(cookie: str | None) -> bytes:
    """Return what a cookie is known by; what is no cookie is known by nothing that is stored."""
    if cookie is None or len(cookie) > _LONGEST_COOKIE or not cookie.isascii():
        return b""
    return hashlib.sha256(cookie.encode()).digest()
