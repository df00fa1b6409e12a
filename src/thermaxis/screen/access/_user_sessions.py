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
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, NamedTuple, final

from thermaxis.errors import ConfigurationError, ThermaxisError
from thermaxis.runtime import (
    LONGEST_NAME,
    LONGEST_PASSWORD,
    PIN_MARK,
    PIN_REFUSED_S,
    Clock,
    ConnectionSettings,
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
from thermaxis.screen.access._loop_session import LoopSession, is_refusal

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
MOST_WAITING: Final = 8
"""Log-ins that wait for that. [1]"""
_LONGEST_COOKIE: Final = 128
_MOST_ENDED: Final = 64

REFUSED: Final = "login-refused"
"""Name or password is wrong."""
TOO_MANY: Final = "login-too_many"
"""Too many failures of this name from this address."""
TOO_MANY_FROM_HERE: Final = "login-too_many_from_here"
"""Too many failures from this address, whatever the names."""
FULL: Final = "login-full"
"""As many persons have logged in as may at once."""
BUSY: Final = "login-busy"
"""Too many log-ins wait for their passwords to be checked."""
NO_CONNECTION: Final = "login-no_connection"
"""The loop's server cannot be reached."""
IMPOSSIBLE: Final = "login-impossible"
"""The configuration lets nobody log in: without encryption, or with certificates that cannot be
used."""
NO_PANEL: Final = "login-no_panel"
"""A PIN is not taken from this address."""
NO_ROLE: Final = "login-no_role"
"""The password is right and the user may not even look, or the server says another name."""
OUT: Final = "login-out"
"""The person has logged out."""
IDLE: Final = "login-idle"
"""Nothing was heard of the person for the longest time."""
TOO_LONG: Final = "login-too_long"
"""The log-in has lasted as long as any may."""
LOOP_GONE: Final = "login-loop_gone"
"""The session at the loop is gone: the loop, its server or the connection ended. It is opened
again as soon as the loop is back."""
ROLE_GONE: Final = "login-role_gone"
"""The user was struck off, password or role were changed, or the token has ended."""
ELSEWHERE: Final = "login-elsewhere"
"""The same user has logged in too often elsewhere."""
SCREEN_ENDS: Final = "login-screen_ends"
"""The screen is being ended."""


class Refusal(NamedTuple):
    """Why somebody was not logged in."""

    key: str
    """Key of the words."""
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
    address: str
    """Address from which the log-in came."""
    began_s: float
    """When it was, monotonic. [s]"""
    seen_s: float
    """Last sign of the person, monotonic. [s]"""
    session: LoopSession = field(repr=False)
    """The session at the loop; requests go through `UserSessions.ask`."""
    ended: str = ""
    """Key of the words that say why the log-in has ended; empty while it stands."""
    waiting: int = 0
    """Requests whose answers are waited for. [1]"""
    renewing: bool = False
    """Whether another session is being opened in place of one that is lost."""


@final
class UserSessions:
    """Logs people in and out, and asks the loop what they ask.

    Not protected: while the loop is away nobody can ask it who somebody is. Whoever had logged in
    looks on in the role of before, at most until the ends of every log-in, and asks for nothing.

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
        connection_for: Callable[[str, Secret], ConnectionSettings],
        clock: Clock,
        *,
        idle_s: float,
        longest_s: float,
        takes_pin: Callable[[str], bool] = lambda _: False,
        most: int = 12,
        answer_s: float = ANSWER_S,
    ) -> None:
        self._connection_for = connection_for
        self._clock = clock
        self._idle_s = idle_s
        self._longest_s = longest_s
        self._most = most
        self._answer_s = answer_s
        self._user_sessions: dict[bytes, UserSession] = {}
        self._ended: dict[bytes, str] = {}
        self._takes_pin = takes_pin
        self._throttle, self._pins = LogInThrottle(), LogInThrottle(PIN_REFUSED_S)
        self._checking = asyncio.Semaphore(MOST_AT_ONCE)
        self._coming = 0
        self._leaving: set[asyncio.Task[None]] = set()
        self._open = False
        self._task: asyncio.Task[None] | None = None

    # ---- life -----------------------------------------------------------------------------------

    async def open(self) -> None:
        """Begin to keep sessions alive."""
        self._open = True
        self._task = asyncio.create_task(self._keep_alive(), name="persons")

    async def close(self) -> None:
        """Log everybody out; nothing runs on."""
        self._open = False
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)
        for known in tuple(self._user_sessions):
            self._end(known, SCREEN_ENDS)
        await asyncio.gather(*self._leaving)
        if task is not None and not task.cancelled() and (error := task.exception()) is not None:
            raise error  # a mistake in the program is not hidden

    async def _keep_alive(self) -> None:
        async with asyncio.TaskGroup() as group:
            while True:
                await self._clock.sleep_until(self._clock.monotonic_s() + KEEP_ALIVE_S)
                for known, person in tuple(self._user_sessions.items()):
                    if self._end_if_over(known, person):
                        continue
                    if person.session.lost:
                        group.create_task(self._renew(known, person))
                    elif not person.session.busy:
                        group.create_task(self._refresh(known, person))

    async def _refresh(self, known: bytes, person: UserSession) -> None:
        """Ask the server who a person is now; end the log-in of somebody who is nobody."""
        session = person.session
        waits = session.busy  # the server answers one after the other, and the loop takes its time
        caller = await session.who_am_i(NO_SIGN_S)
        if person.ended or (caller is None and waits and not session.lost):
            return
        if caller is None:
            session.give_up()
        elif caller.name != person.name or caller.role is Role.NONE:
            self._end(known, ROLE_GONE)
        else:
            person.role = caller.role

    async def _renew(self, known: bytes, person: UserSession) -> None:
        """Open a session anew in place of a lost one; end the log-in of somebody who is refused."""
        if person.renewing:
            return
        person.renewing, lost = True, person.session
        try:
            found = await self._session_of(person.name, lost.token)
            if isinstance(found, Refusal):
                if found.key == REFUSED:
                    self._end(known, ROLE_GONE)
                return
            found.token, lost.token = lost.token, Secret("")
            person.session = found
            await (found if person.ended else lost).close()
        finally:
            person.renewing = False
        await self._refresh(known, person)

    def _end_if_over(self, known: bytes, person: UserSession) -> bool:
        """End a log-in that lasted too long, and return whether it did."""
        now_s = self._clock.monotonic_s()
        if now_s - person.began_s >= self._longest_s:
            self._end(known, TOO_LONG)
        elif now_s - person.seen_s >= self._idle_s:
            self._end(known, IDLE)
        return bool(person.ended)

    def _end(self, known: bytes, key: str) -> None:
        """End a log-in; its session is closed at the server meanwhile."""
        person = self._user_sessions.pop(known, None)
        if person is None:
            return
        person.ended = key
        self._ended[known] = key
        if len(self._ended) > _MOST_ENDED:
            del self._ended[next(iter(self._ended))]
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
        refused = self._too_many(name[: LONGEST_NAME + 1], address, pin=pin)
        if refused is not None:  # whoever is refused takes no place among those who wait
            return refused
        if self._coming >= MOST_AT_ONCE + MOST_WAITING or not self._open:
            return Refusal(BUSY)
        self._coming += 1
        try:
            async with self._checking:
                return await self._log_in(name, password, address, pin=pin)
        finally:
            self._coming -= 1

    async def _log_in(
        self, name: str, password: str, address: str, *, pin: bool
    ) -> tuple[str, UserSession] | Refusal:
        name = name[: LONGEST_NAME + 1]
        refused = self._too_many(name, address, pin=pin)
        if refused is not None:
            return refused
        self._sweep()
        if self.count >= self._most:
            return Refusal(FULL)
        now_s = self._clock.monotonic_s()
        throttle = self._pins if pin else self._throttle
        throttle.count(name, address, now_s)
        found = await self._session_of(name, Secret(password))
        if isinstance(found, Refusal):
            if found.key != REFUSED:
                throttle.take_back(name, address, now_s)
            return found
        throttle.succeeded(name, address)
        return await self._admit(found, name, address)

    def _too_many(self, name: str, address: str, *, pin: bool) -> Refusal | None:
        """Return why no password is looked at after too many failures; None where one is."""
        now_s = self._clock.monotonic_s()
        refused = (self._pins if pin else self._throttle).refused(name, address, now_s)
        if refused is None:
            return None
        key = TOO_MANY_FROM_HERE if refused.address else TOO_MANY
        return Refusal(key, math.ceil(refused.left_s))

    def _sweep(self) -> None:
        for known, person in tuple(self._user_sessions.items()):
            self._end_if_over(known, person)

    async def _session_of(self, name: str, password: Secret) -> LoopSession | Refusal:
        """Return a session under a name and a password, or why there is none."""
        try:
            check_name(name)
            fits = 0 < len(password.reveal().encode()) <= LONGEST_PASSWORD
        except (ConfigurationError, UnicodeEncodeError):
            fits = False
        if not fits:
            return Refusal(REFUSED)
        try:
            settings = self._connection_for(name, password)
        except ConfigurationError:
            return Refusal(IMPOSSIBLE)
        try:
            return await LoopSession.log_in(settings, self._clock)
        except FAILURES as error:
            if is_refusal(error):
                return Refusal(REFUSED)
            return Refusal(IMPOSSIBLE if isinstance(error, ThermaxisError) else NO_CONNECTION)

    async def _admit(
        self, session: LoopSession, name: str, address: str
    ) -> tuple[str, UserSession] | Refusal:
        """Give a session that is logged in a cookie, if the server says that it may look."""
        admitted = False
        try:
            caller = await session.who_am_i(NO_SIGN_S)
            if caller is None:
                return Refusal(NO_CONNECTION)
            if caller.name != name or not caller.role.at_least(Role.VIEWER):
                return Refusal(NO_ROLE)
            await session.take_token(NO_SIGN_S)
            if not self._open or self.count >= self._most:
                return Refusal(FULL)
            admitted = True
        finally:
            if not admitted:
                await session.close()
        self._make_room(name)
        now_s = self._clock.monotonic_s()
        cookie = secrets.token_urlsafe(COOKIE_BYTES)
        token = secrets.token_urlsafe(TOKEN_BYTES)
        person = UserSession(name, caller.role, token, address, now_s, now_s, session)
        self._user_sessions[_hash(cookie)] = person
        return cookie, person

    def _make_room(self, name: str) -> None:
        own = [known for known, person in self._user_sessions.items() if person.name == name]
        for known in own[: max(0, len(own) + 1 - MOST_OF_ONE)]:
            self._end(known, ELSEWHERE)

    async def log_out(self, cookie: str | None) -> None:
        """End a log-in; the session is closed at the server when this returns."""
        known = _hash(cookie)
        person = self._user_sessions.get(known)
        if person is not None:
            self._end(known, OUT)
            await asyncio.gather(*self._leaving)

    # ---- requests -------------------------------------------------------------------------------

    @property
    def count(self) -> int:
        """How many log-ins stand. [1]"""
        return len(self._user_sessions)

    def of(self, cookie: str | None, *, touch: bool = False) -> UserSession | None:
        """Return whose cookie it is."""
        if self._task is not None and self._task.done():
            self._task.result()
        known = _hash(cookie)
        person = self._user_sessions.get(known)
        if person is None or self._end_if_over(known, person):
            return None
        if touch:
            person.seen_s = self._clock.monotonic_s()
        return person

    def why_ended(self, cookie: str | None) -> str:
        """Return why the log-in of a cookie has ended."""
        return self._ended.get(_hash(cookie), "")

    async def ask(self, person: UserSession, question: Question) -> Outcome:
        """Ask the loop for something under the name of a person."""
        ended = self._over(person)
        if ended or person.session.lost:
            return refused(ended or LOOP_GONE)
        if person.waiting >= MOST_AT_ONCE:
            return refused(TOO_MANY_ASKED)
        person.seen_s = self._clock.monotonic_s()
        person.waiting += 1
        session = person.session
        try:
            answer = await session.call(question.ask.name, question.variants, self._answer_s)
        finally:
            person.waiting -= 1
        if answer is None:
            return unknown(LOST if self._over(person) or session.lost else NO_ANSWER)
        if answer.status == "BadUserAccessDenied":
            await self._ask_role(person)
        return outcome_of(answer)

    def _over(self, person: UserSession) -> str:
        """Return why a log-in is over, after ending one that should be; empty if it stands."""
        known = self._known(person)
        if known is not None:
            self._end_if_over(known, person)
        return person.ended

    def _known(self, person: UserSession) -> bytes | None:
        return next((known for known, one in self._user_sessions.items() if one is person), None)

    async def _ask_role(self, person: UserSession) -> None:
        known = self._known(person)
        if known is not None:
            await self._refresh(known, person)


def _hash(cookie: str | None) -> bytes:
    """Return what a cookie is known by; what is no cookie is known by nothing that is stored."""
    if cookie is None or len(cookie) > _LONGEST_COOKIE or not cookie.isascii():
        return b""
    return hashlib.sha256(cookie.encode()).digest()
