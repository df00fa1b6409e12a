"""How long work is told about while it runs."""

from collections.abc import Callable
from typing import TypeAlias

Progress: TypeAlias = Callable[[str, int, int], None]
"""Called with the name of a step, the steps done and the number of steps."""


def silent(_step: str, _done: int, _total: int) -> None:
    """Tell nobody."""
