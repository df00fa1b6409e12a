"""The machine's side of the offset: a clamp, a rate, and a watchdog on the writer's heartbeat.

As a PLC in front of the axis' temperature compensation: what is written is clamped and reported
as accepted; what acts moves towards it at a limited rate, and back to zero when the heartbeat
stands still or the axis has no reference. With the drives off or in emergency stop nothing moves.
"""

import math
from dataclasses import dataclass
from typing import final

from thermaxis.virtual._numbers import require_numbers

HEARTBEAT_RANGE = 2**32
"""The heartbeat is an UInt32. [1]"""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class OffsetRules:
    """Rules of the machine for its offset.

    Raises
    ------
    ConfigurationError
        If a number is not positive or not finite.
    """

    largest_um: float = 400.0
    """What is written is clamped to plus and minus this. Default: more than the lathe ever moves.
    [µm]"""
    rate_um_per_s: float = 2.0
    """The offset that acts moves at most so fast. [µm/s]"""
    watchdog_s: float | None = 2.0
    """Without a moved heartbeat for so long the offset goes to zero; None: never. A machine that
    is served faster than real time counts this time in real seconds. [s]"""
    own_um_per_k: float = -9.0
    """What the builder's own compensation adds per kelvin that the front bearing is warmer than
    the columns, with the sign of the displacement that it takes away. [µm/K]"""

    def __post_init__(self) -> None:
        require_numbers(self, positive=("largest_um", "rate_um_per_s", "watchdog_s"))


@final
class OffsetAxis:
    """The offset of the Z axis."""

    def __init__(self, rules: OffsetRules) -> None:
        self.rules = rules
        self.speed = 1.0
        """How many of the machine's seconds are a real one. [1]"""
        self.written_mm = 0.0
        self.heartbeat = 0
        self.accepted_um = 0.0
        self.effective_um = 0.0
        self.own_um = 0.0
        self._silent_s = math.inf  # real seconds

    @property
    def alive(self) -> bool:
        """Whether the heartbeat has moved lately, or nobody asks."""
        return self.rules.watchdog_s is None or self._silent_s < self.rules.watchdog_s

    def write_offset(self, offset_mm: float) -> bool:
        """Take a written offset."""
        if not math.isfinite(offset_mm):
            return False
        self.written_mm = offset_mm
        largest = self.rules.largest_um
        self.accepted_um = max(-largest, min(largest, 1e3 * offset_mm))
        return True

    def write_heartbeat(self, heartbeat: int) -> None:
        """Take a written heartbeat; only a changed one counts."""
        if heartbeat % HEARTBEAT_RANGE != self.heartbeat:
            self.heartbeat = heartbeat % HEARTBEAT_RANGE
            self._silent_s = 0.0

    def step(self, seconds: float, *, moves: bool, permitted: bool, own_goal_um: float) -> None:
        """Let time go by."""
        heard_s = seconds
        if self.rules.watchdog_s is not None:
            left_s = self.rules.watchdog_s - self._silent_s
            heard_s = min(seconds, max(0.0, left_s * self.speed))
        self._silent_s += seconds / self.speed
        if not moves:
            return
        rate = self.rules.rate_um_per_s
        goal = self.accepted_um if permitted else 0.0
        self.effective_um = _towards(self.effective_um, goal, rate * heard_s)
        self.effective_um = _towards(self.effective_um, 0.0, rate * (seconds - heard_s))
        self.own_um = _towards(self.own_um, own_goal_um, rate * seconds)


def _towards(value: float, goal: float, most: float) -> float:
    """Move a value towards a goal by at most so much."""
    return goal if abs(goal - value) <= most else value + math.copysign(most, goal - value)
