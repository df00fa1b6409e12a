"""What is wrong in a configuration file, collected while its parts are fitted together."""

from collections.abc import Callable, Iterable, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import TypeVar, final

from thermaxis.codes import Message, Place, Value
from thermaxis.errors import ConfigurationError
from thermaxis.runtime.config._connection import problem, require_file

_T = TypeVar("_T")


@final
class Problems:
    """What is wrong, in the order in which it was found."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.found: list[Message] = []
        """What was found so far."""

    def add(self, code: str, key: str, **values: Value) -> None:
        """Take one mistake, at a key with its tables: ``sink.connection``."""
        self.found.append(problem(code, key, **values))

    def guarded(self, key: str, build: Callable[[], _T]) -> _T | None:
        """Return what a function builds, or take its error and return None.

        The place is the key, with that which the error names; an error in another file keeps its
        place there.
        """
        try:
            return build()
        except ConfigurationError as error:
            self.found.append(error.at(_placed(error.place, key)).message)
            return None

    def existing(self, key: str, name: str) -> Path | None:
        """Return the path of a file that must be there; None if no name is given."""
        if not name:
            return None
        path = self.folder / name
        self.guarded(key, lambda: require_file(path, key))
        return path

    def refuse_foreign(self, table: str, kind: str, keys: Iterable[str]) -> None:
        """Take a mistake for every key that only another kind of the same table has."""
        for key in keys:
            self.add("key_of_other_kind", f"{table}.{key}", name=key, kind=kind)


def _placed(place: Place, key: str) -> Place:
    inner = place.key
    if place.file:
        return place if inner else place._replace(key=key)
    if not inner or key == inner or key.endswith(f".{inner}"):
        return place._replace(key=key)
    return place._replace(key=inner if inner.startswith(f"{key}.") else f"{key}.{inner}")


def nearest(name: str, known: Iterable[str]) -> Sequence[str]:
    """Return the name that is nearest to an unknown one; all, if none is near."""
    listed = sorted(known)
    return get_close_matches(name[:100], listed, n=1, cutoff=0.6) or listed
