"""What is wrong in a configuration file, collected while its parts are fitted together."""

from collections.abc import Callable, Iterable
from difflib import get_close_matches
from pathlib import Path
from typing import TypeVar, final

from thermaxis.codes import printable
from thermaxis.errors import ConfigurationError
from thermaxis.runtime.config._connection import Problem

_T = TypeVar("_T")
REMEDY = "Correct the value; docs/machine-toml.md says what every key means"
"""What to do where an error says nothing better."""


@final
class Problems:
    """What is wrong, in the order in which it was found.

    Parameters
    ----------
    folder : Path
        Folder of the configuration file; relative names of files count from there.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.found: list[Problem] = []
        """What was found so far."""

    def add(self, place: str, what: str, remedy: str) -> None:
        """Take one mistake.

        Parameters
        ----------
        place : str
            Table in brackets, then the key: ``[sink], connection``.
        what : str
            What is wrong.
        remedy : str
            What to do.
        """
        self.found.append(Problem(place, what, remedy or REMEDY))

    def guarded(self, place: str, build: Callable[[], _T]) -> _T | None:
        """Return what a function builds, or take its error.

        Parameters
        ----------
        place : str
            Table, or table and key; a key that the error names is added.
        build : callable
            What to build.

        Returns
        -------
        object or None
            None if there was an error.
        """
        try:
            return build()
        except ConfigurationError as error:
            where = error.where.removeprefix(place).removeprefix(", ")
            told = place if where in {"", place.strip("[]")} else f"{place}, {where}"
            self.add(told, error.what, error.remedy)
            return None

    def existing(self, place: str, name: str) -> Path | None:
        """Return the path of a file that must be there.

        Parameters
        ----------
        place : str
            Table and key.
        name : str
            Name of the file; may be empty.

        Returns
        -------
        Path or None
            None if no name is given; a file that is missing is a mistake, and its path is
            returned.
        """
        if not name:
            return None
        path = self.folder / name
        try:
            there = path.is_file()
        except (OSError, ValueError):
            there = False
        if not there:
            self.add(
                place,
                f"there is no file {path}",
                "Check the name; relative names count from the folder of the configuration file",
            )
        return path

    def refuse_foreign(self, table: str, kind: str, keys: Iterable[str]) -> None:
        """Take a mistake for every key that only another kind of the same table has.

        Parameters
        ----------
        table : str
            The table, without brackets.
        kind : str
            The kind that is stated.
        keys : iterable of str
            Keys that are stated and mean nothing.
        """
        for key in keys:
            self.add(
                f"[{table}], {key}",
                f"{key} has no meaning where the kind is {kind}",
                "Leave it out, or choose another kind",
            )


def nearest(name: str, known: Iterable[str]) -> str:
    """Return advice on a name that nobody knows.

    Parameters
    ----------
    name : str
        The name.
    known : iterable of str
        Names that are known.

    Returns
    -------
    str
        The nearest one if there is one, else all.
    """
    listed = sorted(known)
    found = get_close_matches(name[:100], listed, n=1, cutoff=0.6)
    if found:
        return f"Did you mean {printable(found[0], 80)}"
    if not listed:
        return "There are none"
    return f"There are {printable(', '.join(listed), 200)}"
