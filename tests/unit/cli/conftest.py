"""What the tests of commands share."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager

import pytest


@pytest.fixture(autouse=True)
def _fits(fitted_once: Callable[[], AbstractContextManager[None]]) -> Iterator[None]:
    """Let commands fit the drift of a run once: the fits themselves are tested elsewhere."""
    with fitted_once():
        yield
