"""Log-ins against a file of users, where there is no loop that would know them."""

from collections.abc import Sequence
from typing import final

from thermaxis.runtime import Secret
from thermaxis.runtime.opcua import MethodAnswer
from thermaxis.runtime.users import Identity, Users
from thermaxis.screen.access._loop_session import Caller


@final
class FileSession:
    """Somebody whom a file of users knows; it ends when the file says so."""

    lost = busy = False

    def __init__(self, users: Users, identity: Identity) -> None:
        self._users, self._identity = users, identity
        self.token = Secret("")

    @classmethod
    async def log_in(cls, users: Users, name: str, password: Secret) -> "FileSession | None":
        """Log in; None: name or password is wrong."""
        identity = await users.identify(name, password.reveal())
        return None if identity is None else cls(users, identity)

    async def who_am_i(self, deadline_s: float) -> Caller:
        """Return who this is, and what the file lets it do now."""
        del deadline_s
        return Caller(self._identity.name, await self._users.role_now(self._identity))

    async def call(
        self, method: str, arguments: Sequence[float | str], deadline_s: float
    ) -> MethodAnswer | None:
        """Answer nothing: there is no loop."""
        del method, arguments, deadline_s

    async def take_token(self, deadline_s: float) -> None:
        """Take none: the file is always there."""

    def give_up(self) -> None:
        """Stay as it is."""

    async def close(self) -> None:
        """Log out."""
