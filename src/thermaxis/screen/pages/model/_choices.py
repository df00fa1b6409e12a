"""Which files of the folder may be chosen as models, and why the others may not."""

from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple, final

from thermaxis.codes import Message
from thermaxis.errors import ThermaxisError

if TYPE_CHECKING:
    from thermaxis.runtime import MachineConfiguration

LARGEST_JUDGED_BYTES: Final = 1_000_000
"""A larger file is not read for the list; the loop reads it when it is chosen. A model has some
ten thousand bytes. [byte]"""
MOST_BYTES_AT_ONCE: Final = 4_000_000
"""So much is read for one look at the list; what is left comes with the next one. [byte]"""
MOST_JUDGED: Final = 64
"""So many files of a folder are judged, the first by name. [1]"""
MOST_LISTED: Final = 256
"""So many files of a folder are listed, the first by name. [1]"""


class Choice(NamedTuple):
    """A file of the folder."""

    name: str
    """Its name."""
    refused: Message | None = None
    """Why it cannot be chosen; None where it can be, or was not judged."""
    judged: bool = True
    """Whether it was read; one that was not may be chosen all the same."""


class _Stamp(NamedTuple):
    """What tells one content of a file from another one without reading it."""

    changed_ns: int
    size_bytes: int
    number: int


@final
class ModelChoices:
    """Judges the files of the folder as the loop would, each content once.

    Not protected: a file that is changed within a tick of the disk's clock, to the same size, is
    taken for the one before. The loop judges again when it is asked.
    """

    def __init__(self, configuration: "MachineConfiguration") -> None:
        self._configuration = configuration
        self._known: dict[str, tuple[_Stamp, Message | None]] = {}

    def look(self) -> tuple[Choice, ...]:
        """Return the files of the folder as they are now; it reads those that are new."""
        names = self._configuration.models_to_choose(MOST_LISTED)
        self._known = {name: known for name, known in self._known.items() if name in names}
        left_bytes = MOST_BYTES_AT_ONCE
        found: list[Choice] = []
        for i, name in enumerate(names):
            stamp = self._stamp(name)
            if stamp is None:  # gone meanwhile
                continue
            known = self._known.get(name)
            if known is not None and known[0] == stamp:
                found.append(Choice(name, known[1]))
            elif i >= MOST_JUDGED or stamp.size_bytes > min(left_bytes, LARGEST_JUDGED_BYTES):
                found.append(Choice(name, judged=False))
            else:
                left_bytes -= stamp.size_bytes
                refused = self._refusal(name)
                self._known[name] = stamp, refused
                found.append(Choice(name, refused))
        return tuple(found)

    def _stamp(self, name: str) -> _Stamp | None:
        folder = self._configuration.machine.model_folder
        try:
            found = ((folder or Path()) / name).stat()
        except OSError:
            return None
        return _Stamp(found.st_mtime_ns, found.st_size, found.st_ino)

    def _refusal(self, name: str) -> Message | None:
        try:
            self._configuration.other_model(name)
        except ThermaxisError as error:
            return error.message
        return None
