"""What an error says, in a form that a table of expectations holds."""

from collections.abc import Callable
from pathlib import Path

import pytest

from thermaxis.errors import ThermaxisError
from thermaxis.messages import place_text


def said(error: ThermaxisError) -> str:
    """Return the place inside the file and the code: ``line 2, column target_mm: not_a_number``."""
    place = place_text(error.place._replace(file=""))
    return f"{place}: {error.code}" if place else error.code


def refused(read: Callable[[Path], object], path: Path) -> str:
    """Return what the error says that a reader raises; it names the file."""
    with pytest.raises(ThermaxisError) as caught:
        read(path)
    assert caught.value.place.file == str(path)
    return said(caught.value)
