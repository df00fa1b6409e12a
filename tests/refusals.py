"""What an error says as data: its code, its place, and the values that matter."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from thermaxis.codes import Place, Value
from thermaxis.errors import ThermaxisError
from thermaxis.messages import place_text


@contextmanager
def refused(
    code: str, place: Place | None = None, **values: Value
) -> Iterator[pytest.ExceptionInfo[ThermaxisError]]:
    """Expect an error of a code; of a place and of values where they are stated."""
    with pytest.raises(ThermaxisError) as caught:
        yield caught
    error = caught.value
    assert error.code == code, str(error)
    assert place is None or error.place == place
    assert {name: error.values.get(name) for name in values} == values
    assert f"error-{code}" not in str(error)  # the sentence has what it needs


def said(error: ThermaxisError) -> str:
    """Return the place inside the file and the code: ``line 2, column target_mm: not_a_number``."""
    place = place_text(error.place._replace(file=""))
    return f"{place}: {error.code}" if place else error.code


def refusal_of(read: Callable[[Path], object], path: Path) -> str:
    """Return what is said of the error that a reader raises; it names the file."""
    with pytest.raises(ThermaxisError) as caught:
        read(path)
    assert caught.value.place.file == str(path)
    return said(caught.value)
