"""The project's errors: each says what is wrong, where, and what to do."""

from typing import final


def printable(text: str, limit: int = 120) -> str:
    """Return text from a file or a person so that a terminal shows it and does not obey it.

    Parameters
    ----------
    text : str
        Any text.
    limit : int
        Longest result; a longer text is cut and ends in three dots. Default: what fits a line. [1]

    Returns
    -------
    str
        The text with every control character written as an escape.
    """
    shown = text
    if not text.isprintable():
        shown = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
    return shown if len(shown) <= limit else shown[: limit - 3] + "..."


class ThermaxisError(Exception):
    """Base of every error that the project raises for bad input.

    Parameters
    ----------
    what : str
        What is wrong, as a sentence without its full stop.
    where : str
        The place: a file with line or cell, a target, an option. May be empty.
    remedy : str
        What the reader can do. May be empty.
    """

    def __init__(self, what: str, *, where: str = "", remedy: str = "") -> None:
        self.what = printable(what, 400)
        self.where = printable(where, 300)
        self.remedy = printable(remedy, 400)
        place = f"{self.where}: " if self.where else ""
        advice = f" {self.remedy}." if self.remedy else ""
        super().__init__(f"{place}{self.what}.{advice}")


@final
class MeasurementFileError(ThermaxisError):
    """A measurement file cannot be read as what it claims to be.

    Parameters
    ----------
    what : str
        What is wrong.
    path : str
        The file.
    line : int, optional
        Line in a text file, from 1. [1]
    column : str, optional
        Column by its heading, or the word in the line.
    cell : str, optional
        Cell of a workbook, such as ``Sheet1!B7``.
    remedy : str
        What the reader can do.
    """

    def __init__(
        self,
        what: str,
        *,
        path: str,
        line: int | None = None,
        column: str | None = None,
        cell: str | None = None,
        remedy: str,
    ) -> None:
        where = path
        if line is not None:
            where += f", line {line}"
        if column is not None:
            where += f", column {column}"
        if cell is not None:
            where += f", cell {cell}"
        super().__init__(what, where=where, remedy=remedy)


@final
class DataError(ThermaxisError):
    """Measured values cannot be evaluated: wrong shape, too few readings, no such cycle."""


@final
class ConfigurationError(ThermaxisError):
    """A configuration file or an option asks for something that does not exist or cannot be."""
