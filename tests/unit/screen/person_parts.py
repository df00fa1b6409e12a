"""A loop's status server with users, and the screen's persons before it."""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from pathlib import Path

from tests.opcua_server import Cable, until
from tests.unit.runtime.status_server_parts import PASSWORD, Box, HandClock, Pairs, served, status
from thermaxis.runtime._config_settings import ServerSettings
from thermaxis.runtime._connection import ConnectionSettings, Secret
from thermaxis.runtime._status_server import StatusServer
from thermaxis.runtime._users import Role, User, hash_password, write_users
from thermaxis.screen._persons import Person, Persons, Refusal

HERE = "127.0.0.1"
IDLE_S = 900.0
LONGEST_S = 28_800.0


@dataclass
class Shop:
    """A loop, its users, and persons at the screen."""

    pairs: Pairs
    server: StatusServer
    persons: Persons
    clock: HandClock
    box: Box
    cable: Cable

    async def log_in(
        self, name: str, password: str = PASSWORD, address: str = HERE
    ) -> tuple[str, Person]:
        found = await self.persons.log_in(name, password, address)
        assert not isinstance(found, Refusal), found
        return found

    async def refused(self, name: str, password: str = PASSWORD, address: str = HERE) -> Refusal:
        found = await self.persons.log_in(name, password, address)
        assert isinstance(found, Refusal)
        return found

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


@contextlib.asynccontextmanager
async def shop(
    pairs: Pairs, settings: ServerSettings | None = None, **changes: float
) -> AsyncIterator[Shop]:
    """Run a loop's server, a cable to it, and persons at the screen; nothing runs on."""
    appoint(pairs.users, ROLES)
    clock, box, cable = HandClock(), Box(), Cable()
    before = asyncio.all_tasks()
    async with served(settings or pairs.settings(), box, clock) as server:
        server.publish(status())
        cable._target = server.port
        await cable.mend()
        asked = {"idle_s": IDLE_S, "longest_s": LONGEST_S, **changes}
        # the server takes the address by which it is asked for, whatever port that names
        persons = Persons(connection_to(pairs, lambda: cable.url), clock, **asked)
        await persons.open()
        try:
            yield Shop(pairs, server, persons, clock, box, cable)
        finally:
            if box.gate is not None:
                box.gate.set()
            await persons.close()
            await cable.cut()
    await until(lambda: not [t for t in asyncio.all_tasks() - before if not t.done()])
