"""What lies ready for whoever works in a room: files, and what commands said of them."""

import asyncio
import secrets
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol, final

from thermaxis.web.work import WorkFolder

SWEEP_S: Final = 5.0
"""Time after which entries are gone with the log-in of their owner. [s]"""


class Owner(Protocol):
    """Somebody whom entries belong to."""

    @property
    def name(self) -> str:
        """What they are called."""
        ...

    @property
    def ended(self) -> object:
        """Whether they have left: what was theirs goes with what is not empty here."""
        ...


class Entry(NamedTuple):
    """What was dropped, or what a command has made."""

    owner: Owner
    """Who asked, and alone may see it."""
    kind: str
    """What it is: a run, a log, a model, a verification or a comparison."""
    name: str
    """What people call it, fit to be shown."""
    words: tuple[str, ...]
    """Words of the command that made it, without where it writes."""
    folder: WorkFolder
    inputs: Mapping[str, Path]
    """Files that the command reads, by the names that it knows."""
    told: Mapping[str, Any] = {}
    """The JSON that the command printed."""
    made_of: tuple[str, ...] = ()
    """Other entries that it needs."""
    reading: tuple[str, ...] = ()
    """Words for how its file is read."""
    id: str = ""
    """128 random bits: part of its address."""
    at_s: float = 0.0
    """When it was made, monotonic. [s]"""
    at_utc: datetime = datetime.min.replace(tzinfo=UTC)
    """The same by the calendar."""

    @property
    def size_bytes(self) -> int:
        """What lies in its folder. [byte]"""
        files = self.folder.path.rglob("*")
        return sum(file.stat().st_size for file in files if file.is_file())


class Clock(Protocol):
    """What tells the time."""

    def monotonic_s(self) -> float:
        """Return a time that only rises. [s]"""
        ...

    def utc(self) -> datetime:
        """Return the time by the calendar."""
        ...


@final
class Shelf:
    """Entries by their owner: as many, as large and as old as they may be; the oldest go.

    Where entries are made of each other, none goes by itself: whoever adds asks `is_full` before.
    """

    def __init__(
        self, clock: Clock, *, longest_s: float, most: int, most_bytes: int, sheds: bool = True
    ) -> None:
        self._clock, self._sheds = clock, sheds
        self.longest_s, self.most, self.most_bytes = longest_s, most, most_bytes
        self._entries: dict[str, Entry] = {}
        self._sweeps: asyncio.TimerHandle | None = None

    def keep(self, entry: Entry) -> Entry:
        """Keep an entry with its folder."""
        key = secrets.token_hex(16)
        now_s, now_utc = self._clock.monotonic_s(), self._clock.utc()
        made = self._entries[key] = entry._replace(id=key, at_s=now_s, at_utc=now_utc)
        self.sweep()
        if self._sweeps is None:
            self._sweep_on()
        return made

    def keeps(self, folder: WorkFolder) -> bool:
        """Return whether a folder is that of an entry."""
        return any(one.folder is folder for one in self._entries.values())

    def of(self, owner: Owner | None, key: str) -> Entry | None:
        """Return an entry to its owner."""
        self.sweep()
        found = self._entries.get(key)
        return found if found is not None and found.owner is owner else None

    def all_of(self, owner: Owner | None) -> list[Entry]:
        """Return the entries of somebody, the oldest first."""
        self.sweep()
        return [one for one in self._entries.values() if one.owner is owner]

    def is_full(self, owner: Owner) -> bool:
        """Return whether something must go before more comes."""
        return len(self.all_of(owner)) >= self.most or self._size_bytes() >= self.most_bytes

    def sweep(self) -> None:
        """Drop what is old, whose owner has left, or what is too much."""
        now_s = self._clock.monotonic_s()
        for one in list(self._entries.values()):
            if now_s - one.at_s > self.longest_s or one.owner.ended:
                self.drop(one.id)
        if not self._sheds:
            return
        for owner in {id(one.owner): one.owner for one in self._entries.values()}.values():
            own = [one.id for one in self._entries.values() if one.owner is owner]
            for key in own[: -self.most]:
                self.drop(key)
        while len(self._entries) > 1 and self._size_bytes() > self.most_bytes:
            self.drop(next(iter(self._entries)))

    def drop(self, key: str) -> None:
        """Remove an entry, and what was made of it."""
        gone = self._entries.pop(key, None)
        if gone is None:
            return
        gone.folder.remove()
        for other in [one.id for one in self._entries.values() if key in one.made_of]:
            self.drop(other)

    def _size_bytes(self) -> int:
        return sum(one.size_bytes for one in self._entries.values())

    def _sweep_on(self) -> None:
        """Look again and again while there is something: a log-in ends without a question here."""
        self.sweep()
        loop = asyncio.get_running_loop()
        self._sweeps = loop.call_later(SWEEP_S, self._sweep_on) if self._entries else None
