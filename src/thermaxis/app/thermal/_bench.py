"""What lies on the bench of the room: logs, models and what was made of them, as files and JSON."""

import secrets
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Final, NamedTuple, final

from thermaxis.web.work import WorkFolder

MOST_BYTES: Final = 400_000_000
"""Largest sum of the files. [byte]"""
MOST_ENTRIES: Final = 60
"""Logs, models and verifications together. [1]"""


class Entry(NamedTuple):
    """A log, or what a command has made."""

    kind: str
    """`log`, `model`, `verification` or `comparison`."""
    name: str
    """What people call it, fit to be shown."""
    words: tuple[str, ...]
    """Words of the command that made it, without where it writes."""
    inputs: Mapping[str, Path]
    """Files that it reads, by the names that the command knows."""
    made_of: tuple[str, ...] = ()
    """Other entries that it needs."""
    told: Mapping[str, object] = {}
    """The JSON that the command printed."""
    id: str = ""
    """128 random bits: part of its address."""
    files: Mapping[str, Path] = {}
    """Files of its own, by their names."""


@final
class Bench:
    """Entries by their ids, in a folder that goes with the program."""

    def __init__(self, folder: WorkFolder) -> None:
        self._folder = folder
        self.entries: dict[str, Entry] = {}
        self._made = 0

    @property
    def is_full(self) -> bool:
        """Whether something must be removed before more comes."""
        files = (path for path in self._folder.path.rglob("*") if path.is_file())
        size = sum(path.stat().st_size for path in files)
        return len(self.entries) >= MOST_ENTRIES or size > MOST_BYTES

    def number(self) -> int:
        """Return a number that no entry had before."""
        self._made += 1
        return self._made

    def keep(self, entry: Entry, files: Mapping[str, Path]) -> Entry:
        """Take files over from where a command worked, and keep their entry."""
        key = secrets.token_hex(16)
        folder = self._folder.path / key
        folder.mkdir(mode=0o700)
        own = {name: Path(shutil.move(path, folder / name)) for name, path in files.items()}
        inputs = {name: own.get(name, path) for name, path in entry.inputs.items()}
        self.entries[key] = entry._replace(id=key, files=own, inputs=inputs)
        return self.entries[key]

    def add_file(self, entry: Entry, name: str, path: Path) -> Entry:
        """Take one more file of an entry over."""
        found = Path(shutil.move(path, self._folder.path / entry.id / name))
        self.entries[entry.id] = entry._replace(files={**entry.files, name: found})
        return self.entries[entry.id]

    def remove(self, key: str) -> None:
        """Remove an entry, and what was made of it."""
        gone = self.entries.pop(key, None)
        if gone is None:
            return
        shutil.rmtree(self._folder.path / key, ignore_errors=True)
        for other in [one.id for one in self.entries.values() if key in one.made_of]:
            self.remove(other)
