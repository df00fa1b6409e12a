"""The project's errors: a code, its values and the place; the sentence is in the catalogue."""

from collections.abc import Iterable, Sequence
from copy import copy
from dataclasses import replace
from typing import Protocol, Self, final

from thermaxis.codes import NOWHERE, Message, Place, Value


class _Path(Protocol):
    def __fspath__(self) -> str: ...


class ThermaxisError(Exception):
    """Base of every error that the project raises for bad input.

    ``str(error)`` is the English sentence with its place and remedy, for whoever reads it raw.

    Parameters
    ----------
    code : str
        What is wrong, such as ``too_few_cycles``: ``error-`` and the code is the sentence's key.
    place : Place
        Where it is, as a whole.
    file, line, column, key, channel : optional
        The same by its parts; a path is as good as the name of a file.
    **values : number, str, Message, tuple or None
        What the sentence says, by name; the unit stands in the name.
    """

    def __init__(
        self,
        code: str,
        /,
        *,
        place: Place = NOWHERE,
        file: _Path | str = "",
        line: int | None = None,
        column: str = "",
        key: str = "",
        channel: str = "",
        **values: Value,
    ) -> None:
        super().__init__(code)
        parts = Place(str(file), line, column, key=key, channel=channel)
        self.message = Message(f"error-{code}", values, place if parts == NOWHERE else parts)

    @classmethod
    def of(cls, message: Message) -> Self:
        """Return the error that a message tells of."""
        error = cls(message.code.removeprefix("error-"))
        error.message = message
        return error

    @property
    def code(self) -> str:
        """What is wrong."""
        return self.message.code.removeprefix("error-")

    @property
    def values(self) -> dict[str, Value]:
        """What the sentence says, by name."""
        return dict(self.message.values)

    @property
    def place(self) -> Place:
        """Where it is."""
        return self.message.place

    def at(self, place: Place) -> Self:
        """Return the same error at another place."""
        moved = copy(self)
        moved.message = replace(self.message, place=place)
        return moved

    def __str__(self) -> str:
        # what acts on a machine loads no catalogue before it prints an error
        from thermaxis.messages import text_of  # noqa: PLC0415 - see above

        return text_of(self.message)


@final
class MeasurementFileError(ThermaxisError):
    """A measurement file cannot be read as what it claims to be."""


@final
class DataError(ThermaxisError):
    """Measured values cannot be evaluated: wrong shape, too few readings, no such cycle."""


@final
class ConfigurationError(ThermaxisError):
    """A configuration file or an option asks for something that does not exist or cannot be."""


# ---- checks that raise them ----------------------------------------------------------------------


def require_range(key: str, value: float, least: float, most: float, channel: str = "") -> None:
    """Refuse a number that is not from the least to the most."""
    if not least <= value <= most:
        raise ConfigurationError(
            "outside_range", value=value, least=least, most=most, key=key, channel=channel
        )


def require_positive(key: str, value: float, most: float, channel: str = "") -> None:
    """Refuse a number that is not above zero and at most so large."""
    if not 0.0 < value <= most:
        raise ConfigurationError(
            "not_positive_up_to", value=value, most=most, key=key, channel=channel
        )


def require_count(key: str, count: int, least: int, most: int, channel: str = "") -> None:
    """Refuse too few of something, or too many."""
    if not least <= count <= most:
        raise ConfigurationError(
            "outside_count", count=count, least=least, most=most, key=key, channel=channel
        )


def require_known(
    key: str, names: Iterable[str], known: Iterable[str], code: str = "unknown_name"
) -> None:
    """Refuse names that are none of the known ones; with another code one of a few choices."""
    known = tuple(known)
    for name in names:
        if name not in known:
            raise ConfigurationError(code, name=name, known=known, key=key)


def require_unique(key: str, names: Sequence[str], channel: str = "") -> None:
    """Refuse a name that stands twice."""
    for k, name in enumerate(names):
        if name in names[:k]:
            raise ConfigurationError("stated_twice", name=name, key=key, channel=channel)
