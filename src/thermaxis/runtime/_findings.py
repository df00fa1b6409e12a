"""What a check finds, and how grave it is."""

from enum import StrEnum
from typing import NamedTuple

from thermaxis.codes import Message, Place, Value


class Level(StrEnum):
    """How grave a finding is."""

    OK = "ok"
    """As it should be."""
    WARNING = "warning"
    """It should be known; nothing is forbidden."""
    ERROR = "error"
    """No correction before it is gone."""


class Finding(NamedTuple):
    """One thing that a check has found."""

    level: Level
    message: Message
    """What was found, and at which key of the configuration or in which file."""


def ok(code: str, key: str, **values: Value) -> Finding:
    """Return a finding that all is well."""
    return _finding(Level.OK, code, key, values)


def warning(code: str, key: str, **values: Value) -> Finding:
    """Return a finding that should be known."""
    return _finding(Level.WARNING, code, key, values)


def error(code: str, key: str, **values: Value) -> Finding:
    """Return a finding that forbids a correction."""
    return _finding(Level.ERROR, code, key, values)


def _finding(level: Level, code: str, key: str, values: dict[str, Value]) -> Finding:
    return Finding(level, Message(f"self_test-{code}", values, Place(key=key)))


def advice(code: str, key: str, **values: Value) -> Finding:
    """Return a warning about a configuration by itself."""
    return Finding(Level.WARNING, Message(f"advice-{code}", values, Place(key=key)))
