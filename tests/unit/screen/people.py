"""Log-ins without a loop's server: the one stand-in for `UserSessions`, for all tests of pages."""

from typing import TYPE_CHECKING, cast

from thermaxis.codes import Message
from thermaxis.runtime import Clock, Role, SystemClock
from thermaxis.screen.access import LOOP_GONE, OUT, Answer, Outcome, Question, UserSession
from thermaxis.screen.access._user_sessions import (
    BUSY,
    NO_PANEL,
    NO_ROLE,
    REFUSED,
    Refusal,
)

if TYPE_CHECKING:
    from thermaxis.screen.access._loop_session import LoopSession

HERE = "127.0.0.1"
PASSWORD = "right horse staple"  # noqa: S105 - of users who do not exist
TOKEN = "token-of-her-pages"  # noqa: S105 - as above


class Session:
    """A session at the loop of which a test says whether it is lost."""

    lost = False


class People:
    """Stands for `UserSessions`: one password for everybody, who come and go as a test says.

    The persons are the program's own; only their sessions are made up. The name of a user is that
    of the role; the cookie is ``cookie-`` and the name, and one name has one log-in.
    """

    def __init__(self, clock: Clock | None = None) -> None:
        self.standing: dict[str, UserSession] = {}
        """Who has logged in, by cookie."""
        self.in_front: UserSession | None = None
        """Whom a browser belongs to that sends no cookie; None for nobody."""
        self.touched: list[UserSession] = []
        """Signs of persons."""
        self.refusal: Refusal | None = None
        """Why nobody is logged in."""
        self.answer = Outcome(Answer.ACCEPTED, Message("answer-resumed"))
        """What the loop answers."""
        self.asked: list[tuple[UserSession, str, tuple[float | str, ...]]] = []
        """What reached the loop, from whom."""
        self._clock = clock or SystemClock()
        self._ended: dict[str, str] = {}
        self._open = True

    # ---- what a test says -----------------------------------------------------------------------

    def person(self, role: Role, name: str = "novak") -> UserSession:
        """Return somebody with a session."""
        now_s = self._clock.monotonic_s()
        return UserSession(name, role, TOKEN, now_s, now_s, cast("LoopSession", Session()))

    def come(self, role: Role | None, name: str = "novak") -> "People":
        """Put somebody in front of the browser, who logs in without a cookie; None for nobody."""
        self.in_front = None if role is None else self.person(role, name)
        return self

    def lose(self, person: UserSession) -> None:
        """Take the session at the loop away from somebody."""
        cast("Session", person.session).lost = True

    def end(self, person: UserSession, key: str) -> None:
        """End a log-in."""
        person.ended = key
        for cookie in [known for known, one in self.standing.items() if one is person]:
            del self.standing[cookie]
            self._ended[cookie] = key
        if self.in_front is person:
            self.in_front = None

    def end_cookie(self, cookie: str, key: str) -> None:
        """Remember why a log-in of before has ended."""
        self._ended[cookie] = key

    # ---- what the pages ask ---------------------------------------------------------------------

    async def open(self) -> None:
        """Let people in."""
        self._open = True

    async def close(self) -> None:
        """Log everybody out."""
        self._open = False
        for person in (*self.standing.values(), self.in_front):
            if person is not None:
                self.end(person, OUT)

    async def log_in(
        self, name: str, password: str, address: str, *, pin: bool = False
    ) -> tuple[str, UserSession] | Refusal:
        """Log somebody in."""
        if not self._open:
            return Refusal(BUSY)
        if self.refusal is not None:
            return self.refusal
        if pin:
            return Refusal(NO_PANEL)
        if password != PASSWORD or name not in set(Role):
            return Refusal(REFUSED)
        role = Role(name)
        if not role.at_least(Role.VIEWER):
            return Refusal(NO_ROLE)
        person = self.person(role, name)
        cookie = f"cookie-{name}"
        self.standing[cookie] = person
        self._ended.pop(cookie, None)
        return cookie, person

    async def log_out(self, cookie: str | None) -> None:
        """Let somebody out."""
        person = self.standing.get(cookie or "")
        if person is not None:
            self.end(person, OUT)

    @property
    def count(self) -> int:
        """How many log-ins stand."""
        return len(self.standing)

    def of(self, cookie: str | None, *, touch: bool = False) -> UserSession | None:
        """Return whose cookie it is, or who sits in front."""
        person = self.standing.get(cookie or "", self.in_front)
        if person is not None and touch:
            person.seen_s = self._clock.monotonic_s()
            self.touched.append(person)
        return person

    def why_ended(self, cookie: str | None) -> str:
        """Return why the log-in of a cookie has ended."""
        return self._ended.get(cookie or "", "")

    async def ask(self, person: UserSession, question: Question) -> Outcome:
        """Note what is asked, and answer it."""
        key = person.ended or (LOOP_GONE if person.session.lost else "")
        if key:
            return Outcome(Answer.REFUSED, Message(key))
        person.seen_s = self._clock.monotonic_s()
        self.asked.append((person, question.ask.name, question.arguments))
        return self.answer
