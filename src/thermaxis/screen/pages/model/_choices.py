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
    sha256: str = ""
    """Hash of the model; empty where it cannot be chosen, or was not read."""
    refused: Message | None = None
    """Why it cannot be chosen; None where it can be, or was not read: the loop may take it."""


@final
class ModelChoices:
    """Judges the files of the folder as the loop would, each content once.

    Not protected: a file that is changed within a tick of the disk's clock, to the same size, is
    taken for the one before. The loop judges again when it is asked.
    """

    def __init__(self, configuration: "MachineConfiguration") -> None:
        self._configuration = configuration
        self._known: dict[tuple[str | int, ...], Choice] = {}

    def look(self) -> tuple[Choice, ...]:
        """Return the files of the folder as they are now; it reads those that are new."""
        folder = self._configuration.machine.model_folder or Path()
        before, self._known = self._known, {}
        left_bytes = MOST_BYTES_AT_ONCE
        found: list[Choice] = []
        for i, name in enumerate(self._configuration.models_to_choose(MOST_LISTED)):
            try:
                at = (folder / name).stat()
            except OSError:  # gone meanwhile
                continue
            content = name, at.st_mtime_ns, at.st_size, at.st_ino
            choice = before.get(content)
            small = at.st_size <= min(left_bytes, LARGEST_JUDGED_BYTES)
            if choice is None and small and i < MOST_JUDGED:
                left_bytes -= at.st_size
                choice = self._judged(name)
            if choice is not None:
                self._known[content] = choice
            found.append(choice or Choice(name))
        return tuple(found)

    def _judged(self, name: str) -> Choice:
        try:
            return Choice(name, self._configuration.other_model(name)[1])
        except ThermaxisError as error:
            return Choice(name, refused=error.message)
