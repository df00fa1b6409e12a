"""The life counter of a machine: what answers for a controller may outlive it."""

import math
from typing import final

from thermaxis.codes import Message
from thermaxis.runtime._ports import Clock


@final
class LifeCounter:
    """A number that a controller changes all the time, and whether it still does.

    A gateway, or memory that is shared, holds the values of a controller that has stopped, with
    good status and new time stamps. Before the first change nothing is known to be alive.

    Not protected: a counter that something else than the controller moves.
    """

    def __init__(self, node: str, within_s: float, clock: Clock) -> None:
        self.node = node
        self.within_s = within_s
        self._clock = clock
        self._value: float | None = None
        self._moved_s = -math.inf

    def see(self, value: float | None) -> None:
        """Take what was read now."""
        if value is None or value != value:  # noqa: PLR0124 - no number
            return
        if self._value is not None and value != self._value:
            self._moved_s = self._clock.monotonic_s()
        self._value = value

    @property
    def age_s(self) -> float:
        """Time since it was seen to change. [s]"""
        return self._clock.monotonic_s() - self._moved_s

    @property
    def failure(self) -> Message | None:
        """Why what was read is not believed; None while it is alive."""
        if self.age_s <= self.within_s:
            return None
        return Message("error-life_stands", {"node": self.node, "within_s": self.within_s})
