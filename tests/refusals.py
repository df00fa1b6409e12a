"""What an error says as data: its code, its place, and the values that matter."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from thermaxis.codes import Place, Value
from thermaxis.errors import ThermaxisError


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
