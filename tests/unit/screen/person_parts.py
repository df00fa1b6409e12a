"""A loop's status server with users, and the screen's persons before it."""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.opcua_server import Cable, until
from tests.unit.runtime.status_server_parts import PASSWORD, Box, HandClock, Pairs, served, status
from thermaxis.runtime import (
    PIN_REFUSED_S,
    ConnectionSettings,
    Role,
    Secret,
    StatusServer,
    User,
    hash_password,
    write_users,
)
from thermaxis.screen.access import (
    LoopSession,
    Outcome,
    Question,
    UserSession,
    UserSessions,
    question_of,
)
from thermaxis.screen.access._user_sessions import Refusal

HERE = "127.0.0.1"
IDLE_S = 900.0
LONGEST_S = 28_800.0


@dataclass
class Shop:
    """A loop, its users, and persons at the screen."""

    pairs: Pairs
    server: StatusServer
    persons: UserSessions
    clock: HandClock
    box: Box
    cable: Cable

    async def log_in(
        self, name: str, password: str = PASSWORD, address: str = HERE
    ) -> tuple[str, UserSession]:
        found = await self.persons.log_in(name, password, address)
        assert not isinstance(found, Refusal), found
        return found

    async def refused(self, name: str, password: str = PASSWORD, address: str = HERE) -> Refusal:
        found = await self.persons.log_in(name, password, address)
        assert isinstance(found, Refusal)
        return found

    async def ask(self, person: UserSession, method: str, *arguments: float | str) -> Outcome:
        return await self.persons.ask(person, asks(method, *arguments))

    @property
    def sessions(self) -> int:
        """How many connections the loop's server has."""
        inner = self.server._server
        return 0 if inner is None or inner.bserver is None else len(inner.bserver.clients)

    async def empty(self) -> None:
        """Wait until the server has no connection left."""
        await until(lambda: self.sessions == 0)


def appoint(path: Path, roles: dict[str, Role], password: str = PASSWORD) -> None:
    """Write a file of users."""
    known = HASHES.setdefault(password, hash_password(password))
    write_users([User(name, role, known) for name, role in roles.items()], path)


HASHES: dict[str, str] = {}


def asks(method: str, *arguments: float | str) -> Question:
    """Return what a page asks, checked."""
    found = question_of({"method": method, "arguments": list(arguments)})
    assert isinstance(found, Question), found
    return found


ROLES = {
    "novak": Role.OPERATOR,
    "dvorak": Role.ENGINEER,
    "host": Role.VIEWER,
    "svoboda": Role.OPERATOR,
}


def connection_to(
    pairs: Pairs, url: Callable[[], str]
) -> Callable[[str, Secret], ConnectionSettings]:
    """Return how a connection is made for a name and a password."""

    def connection_for(user: str, password: Secret) -> ConnectionSettings:
        return ConnectionSettings(
            name="loop",
            url=url(),
            security="Basic256Sha256",
            user=user,
            password=password,
            certificate=pairs.client.certificate,
            private_key=pairs.client.key,
            server_certificate=pairs.server.certificate,
            application_uri=pairs.client.uri,
        )

    return connection_for


class Stage:
    """A loop's status server that several scenes use one after the other: it is slow to start."""

    def __init__(self, pairs: Pairs) -> None:
        self.pairs, self.clock, self.box = pairs, HandClock(), Box()
        self._closing = contextlib.AsyncExitStack()

    async def open(self) -> None:
        appoint(self.pairs.users, ROLES)
        tokens = self.pairs.users.with_name("tokens")
        running = served(self.pairs.settings(), self.box, self.clock, tokens=tokens)
        self.server = await self._closing.enter_async_context(running)
        self.server.publish(status())

    async def close(self) -> None:
        await self._closing.aclose()


@contextlib.asynccontextmanager
async def shop(stage: Stage, **changes: Any) -> AsyncIterator[Shop]:
    """Put persons at a screen, and a cable from it to the loop's server; nothing runs on."""
    appoint(stage.pairs.users, ROLES)
    stage.clock.now_s += 2.0 * PIN_REFUSED_S  # the failures of the scene before are forgotten
    box, cable, before = stage.box, Cable(), asyncio.all_tasks()
    box.requests.clear()
    box.gate, box.outcome = None, Box().outcome
    cable._target = stage.server.port
    await cable.mend()
    asked = {"idle_s": IDLE_S, "longest_s": LONGEST_S, **changes}
    connection = connection_to(stage.pairs, lambda: cable.url)
    persons = UserSessions(
        lambda name, password: LoopSession.log_in(connection(name, password), stage.clock),
        stage.clock,
        **asked,
    )
    await persons.open()
    place = Shop(stage.pairs, stage.server, persons, stage.clock, box, cable)
    try:
        yield place
    finally:
        if box.gate is not None:
            box.gate.set()
        await persons.close()
        await cable.cut()
    await place.empty()
    await until(lambda: not [t for t in asyncio.all_tasks() - before if not t.done()])
