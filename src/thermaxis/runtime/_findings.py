"""What a check finds, and how grave it is."""

from enum import StrEnum
from typing import NamedTuple


class Level(StrEnum):
    """How grave a finding is."""

    OK = "ok"
    """As it should be."""
    WARNING = "warning"
    """Somebody should know; nothing is forbidden."""
    ERROR = "error"
    """No correction before it is gone."""


class Finding(NamedTuple):
    """One thing that a check has found."""

    level: Level
    """How grave it is."""
    what: str
    """What was found, as a sentence without its full stop."""
    where: str
    """The table of the configuration, or a file."""
    remedy: str = ""
    """What to do; empty where nothing is to be done."""

    @property
    def sentence(self) -> str:
        """The finding as text: where, what and what to do."""
        advice = f" {self.remedy}." if self.remedy else ""
        return f"{self.where}: {self.what}.{advice}"


def ok(where: str, what: str) -> Finding:
    """Return a finding that all is well."""
    return Finding(Level.OK, what, where)


def warning(where: str, what: str, remedy: str) -> Finding:
    """Return a finding that somebody should know."""
    return Finding(Level.WARNING, what, where, remedy)


def error(where: str, what: str, remedy: str) -> Finding:
    """Return a finding that forbids a correction."""
    return Finding(Level.ERROR, what, where, remedy)
