"""Open files of bounded size, and write them: what the system says becomes one of our errors."""

import io
import stat
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from thermaxis.codes import Place
from thermaxis.errors import MeasurementFileError, ThermaxisError


@contextmanager
def opened(
    path: Path | str, limit_bytes: int, *, error: type[ThermaxisError] = MeasurementFileError
) -> Generator[tuple[io.BufferedReader, int]]:
    """Open a regular file of bounded size; whatever the system says becomes one of our errors."""
    place = Place(str(path))
    try:
        status = Path(path).stat()
        if not stat.S_ISREG(status.st_mode):  # opening a pipe would wait for a writer
            raise error("not_a_file", place=place)
        check_size(path, status.st_size, limit_bytes, error)
        with Path(path).open("rb") as stream:
            yield stream, status.st_size
    except FileNotFoundError:
        raise error("file_not_found", place=place) from None
    except (OSError, ValueError) as failure:  # ValueError: a NUL character in the name
        raise error("file_unreadable", cause=_cause(failure), place=place) from failure


def _cause(failure: Exception) -> str:
    return getattr(failure, "strerror", None) or str(failure)


def check_size(path: Path | str, size: int, most: int, error: type[ThermaxisError]) -> None:
    """Refuse a file that is larger than it may be."""
    if size > most:
        place = Place(str(path))
        raise error("file_too_large", size_mb=size / 1e6, most_mb=most / 1e6, place=place)


def unwritable(path: Path | str, failure: Exception, error: type[ThermaxisError]) -> ThermaxisError:
    """Return the error of a file that the system does not let us write."""
    return error("file_unwritable", cause=_cause(failure), place=Place(str(path)))


def write_content(path: Path | str, content: bytes) -> None:
    """Write a file; whatever the system says becomes one of our errors."""
    try:
        Path(path).write_bytes(content)
    except (OSError, ValueError) as failure:  # ValueError: a NUL character in the name
        raise unwritable(path, failure, MeasurementFileError) from failure
