"""The errors of libraries that read binary files, as one of ours."""

import struct
import zipfile
import zlib
from collections.abc import Generator
from contextlib import contextmanager
from typing import Final

from thermaxis.codes import Place
from thermaxis.errors import MeasurementFileError

# Readers of binary files have no error of their own for damaged ones: whatever a missing part, a
# wrong length, index or type raises inside comes out.
DAMAGE: Final = (
    *(ArithmeticError, AssertionError, AttributeError, EOFError, LookupError, MemoryError),
    *(OSError, RuntimeError, SyntaxError, TypeError, ValueError),
    *(struct.error, zipfile.BadZipFile, zlib.error),
)
"""What they raise; RuntimeError stands also for a password, and for a newer form of the file."""


@contextmanager
def damage_named(
    place: Place, *, damage: tuple[type[BaseException], ...] = DAMAGE
) -> Generator[None]:
    """Turn what the reader of a damaged file raises into an error that names the file."""
    try:
        yield
    except damage as error:
        cause = (str(error).partition("\n")[0] or type(error).__name__)[:150]
        raise MeasurementFileError("file_damaged", cause=cause, place=place) from error
