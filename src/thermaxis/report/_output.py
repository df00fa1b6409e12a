"""Write what was made, and say in words why it cannot be written."""

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import final

from thermaxis.errors import ConfigurationError

_DIGITS = 12
"""Significant digits of a number in a file of numbers. [1]"""


@final
@dataclass(frozen=True, slots=True)
class NumberTable:
    """The numbers behind a chart."""

    columns: tuple[str, ...]
    """Names of the columns with their units."""
    rows: Sequence[Sequence[float | int | str]]
    """Rows; a NaN is written as an empty cell. Texts are the project's own words."""
    decimals: int | None = 9
    """Decimals of numbers that are no counts, None for all; default: finer is round-off. [1]"""

    def as_csv(self) -> bytes:
        """Return the table as CSV, without the round-off behind the last sensible digit."""
        buffer = io.StringIO(newline="")
        writer = csv.writer(buffer, lineterminator="\n")
        writer.writerow(self.columns)
        for row in self.rows:
            writer.writerow([self._cell(cell) for cell in row])
        return buffer.getvalue().encode("utf-8")

    def _cell(self, cell: float | str) -> float | int | str:
        if not isinstance(cell, float):
            return cell
        if math.isnan(cell):
            return ""
        rounded = cell if self.decimals is None else round(cell, self.decimals)
        return float(f"{rounded:.{_DIGITS}g}") + 0.0  # no negative zero


def _cannot_write(path: Path, error: OSError) -> ConfigurationError:
    return ConfigurationError(
        "file_unwritable", file=path, cause=error.strerror or type(error).__name__
    )


def make_folder(folder: Path) -> None:
    """Make a folder and those above it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _cannot_write(folder, error) from None


def write_bytes(path: Path, content: bytes) -> Path:
    """Write a file.

    Parameters
    ----------
    path : Path
        The file; it is replaced if it exists.

    Raises
    ------
    ConfigurationError
        If it cannot be written.
    """
    if path.is_fifo() or path.is_socket():
        raise ConfigurationError("output_is_pipe", file=path)
    try:
        path.write_bytes(content)
    except OSError as error:
        raise _cannot_write(path, error) from None
    return path
