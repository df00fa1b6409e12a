"""What the pages share: the registry, and people."""

import asyncio
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar, cast, final

from starlette.requests import HTTPConnection

from thermaxis.errors import ThermaxisError
from thermaxis.fleet import Registry
from thermaxis.messages import sentence_of
from thermaxis.screen.access import AccessParts
from thermaxis.web import RefusedError

_UNAVAILABLE = 503
_T = TypeVar("_T")


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class BoardParts(AccessParts):
    """What every page is made from."""

    registry: Registry
    """What is known of the machines; used in `thread` alone."""
    thread: ThreadPoolExecutor
    """One thread."""
    people: bool
    """Whether there is a file of users."""

    def frame(self, names: Mapping[str, str]) -> Mapping[str, object]:
        """Return what the frame of every page takes."""
        del names
        return {"base": "fleet.html", "machine": "thermaxis fleet", "people": self.people}

    async def asked(self, work: Callable[[Registry], _T]) -> _T:
        """Return what is asked of the registry; what it cannot answer is refused in words."""
        running = asyncio.get_running_loop().run_in_executor(self.thread, work, self.registry)
        try:
            return await running
        except ThermaxisError as error:
            said = sentence_of(error.message)
            raise RefusedError(_UNAVAILABLE, "fleet-no_registry", said=said) from error


def parts_of(connection: HTTPConnection) -> BoardParts:
    """Return what the pages share."""
    return cast("BoardParts", connection.app.state.parts)
