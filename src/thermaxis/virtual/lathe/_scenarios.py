"""What the virtual lathe does: the paper's tests, and a working day."""

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import accumulate
from types import MappingProxyType
from typing import Final, NamedTuple, final

from thermaxis.errors import ConfigurationError, require_known
from thermaxis.virtual.lathe._physics import LOW_GEAR_LIMIT_RPM

SEEN_EVERY_S = 600.0
"""A turning table is stopped in the measuring location so often. [s]"""
SEEN_FOR_S = 7.0
"""It stays there for so long, as in the paper. [s]"""
_H, _MIN = 3600.0, 60.0


class Stage(NamedTuple):
    """What the machine does for some time."""

    duration_s: float
    """For how long. [s]"""
    spindle_rpm: float = 0.0
    """Speed of the spindle. [rpm]"""
    table_rpm: float = 0.0
    """Speed of the table. [rpm]"""
    coolant: bool = True
    """Whether the coolant's pump runs."""
    machine_on: bool = True
    """Whether the drives are on."""
    homing: bool = False
    """Whether the axis looks for its reference."""
    diameter_mm: float = 0.0
    """Diameter at which the workpiece is turned. [mm]"""
    gear: int = 0
    """Gear of the spindle; 0 for the one of its speed. [1]"""

    @property
    def gear_engaged(self) -> int:
        """Gear of the spindle, 1 or 2. [1]"""
        if self.gear:
            return self.gear
        return 1 if abs(self.spindle_rpm) <= LOW_GEAR_LIMIT_RPM else 2


@final
@dataclass(frozen=True, slots=True)
class Scenario:
    """Stages one after the other.

    Raises
    ------
    ConfigurationError
        If there is no stage, or a duration is not positive.
    """

    name: str
    """Name by which it is asked for."""
    summary: str
    """What it is, in a line."""
    stages: tuple[Stage, ...]
    endless: bool = False
    """Whether it begins again at its end; otherwise its last stage lasts."""
    start_s: float = 6.0 * _H
    """Time of day at which it begins. [s]"""
    _ends_s: tuple[float, ...] = field(init=False, repr=False, default=())

    def __post_init__(self) -> None:
        """Check the stages and sum their times."""
        if not self.stages or not all(0.0 < s.duration_s <= 1e9 for s in self.stages):
            raise ConfigurationError("scenario_without_stage", key=f"scenario {self.name}")
        object.__setattr__(self, "_ends_s", tuple(accumulate(s.duration_s for s in self.stages)))

    @property
    def duration_s(self) -> float:
        """Time from its begin to its end. [s]"""
        return self._ends_s[-1]

    def stage_at(self, time_s: float) -> tuple[int, Stage, float]:
        """Return number and stage at a time, and when it ends, from the begin of the scenario. [s]

        The number goes on through the rounds of an endless scenario; the last stage of one that
        ends has no end.
        """
        rounds, within = 0.0, time_s
        if self.endless:
            rounds = time_s // self.duration_s
            within = time_s - rounds * self.duration_s
        number = bisect_right(self._ends_s, within)
        count = len(self.stages)
        if number >= count:
            return count - 1, self.stages[-1], float("inf")
        end_s = rounds * self.duration_s + self._ends_s[number]
        return int(rounds) * count + number, self.stages[number], end_s


def seen_at(time_s: float) -> tuple[bool, float]:
    """Return whether a turning table stands in the measuring location, and until when."""
    begin_s = time_s // SEEN_EVERY_S * SEEN_EVERY_S
    if time_s - begin_s < SEEN_FOR_S:
        return True, begin_s + SEEN_FOR_S
    return False, begin_s + SEEN_EVERY_S


_REST = Stage(15.0 * _MIN)
_CALIBRATION_SPINDLE = Scenario(
    "calibration-spindle",
    "spindle at full speed for one shift, then six hours of cooling (the paper's 3.2)",
    (_REST, Stage(8.0 * _H, spindle_rpm=3500.0), Stage(6.0 * _H)),
)
_CALIBRATION_TABLE = Scenario(
    "calibration-table",
    "table at full speed for one shift, stopped to be measured, then six hours of cooling",
    (_REST, Stage(8.0 * _H, table_rpm=200.0), Stage(6.0 * _H)),
)
_VERIFICATION = Scenario(
    "verification",
    "spindle and table in turn at other speeds, with a gear change, 16 h (the paper's 4.2)",
    (
        _REST,
        Stage(1.5 * _H, spindle_rpm=900.0),
        Stage(2.0 * _MIN, gear=2),
        Stage(2.5 * _H, spindle_rpm=3000.0),
        Stage(28.0 * _MIN),
        Stage(1.5 * _H, table_rpm=130.0),
        Stage(1.0 * _H, table_rpm=190.0),
        Stage(30.0 * _MIN),
        Stage(1.5 * _H, spindle_rpm=2400.0),
        Stage(1.0 * _H, table_rpm=160.0),
        Stage(1.5 * _H, spindle_rpm=3400.0),
        Stage(1.0 * _H, table_rpm=90.0),
        Stage(195.0 * _MIN),
    ),
)
_DAY = Scenario(
    "day",
    "a working day that begins again: homing at six, turning and milling in two shifts, night",
    (
        Stage(2.0 * _MIN, machine_on=False, coolant=False),
        Stage(3.0 * _MIN, homing=True),
        Stage(25.0 * _MIN, spindle_rpm=600.0, diameter_mm=1500.0),
        Stage(90.0 * _MIN, table_rpm=90.0, diameter_mm=1500.0),
        Stage(15.0 * _MIN, diameter_mm=1500.0),
        Stage(105.0 * _MIN, spindle_rpm=2400.0, diameter_mm=1500.0),
        Stage(30.0 * _MIN, coolant=False, diameter_mm=3000.0),
        Stage(150.0 * _MIN, table_rpm=60.0, diameter_mm=3000.0),
        Stage(20.0 * _MIN, diameter_mm=3000.0),
        Stage(100.0 * _MIN, spindle_rpm=3000.0, diameter_mm=3000.0),
        Stage(20.0 * _MIN),
        Stage(120.0 * _MIN, table_rpm=160.0, diameter_mm=800.0),
        Stage(60.0 * _MIN, spindle_rpm=1500.0, diameter_mm=800.0),
        Stage(120.0 * _MIN, table_rpm=120.0, diameter_mm=800.0),
        Stage(100.0 * _MIN, spindle_rpm=850.0, diameter_mm=800.0),
        Stage(8.0 * _H, machine_on=False, coolant=False),
    ),
    endless=True,
)
SCENARIOS: Final[Mapping[str, Scenario]] = MappingProxyType(
    {s.name: s for s in (_CALIBRATION_SPINDLE, _CALIBRATION_TABLE, _VERIFICATION, _DAY)}
)
"""Scenarios by name."""


def scenario_named(name: str) -> Scenario:
    """Return a scenario."""
    require_known("scenario", [name], SCENARIOS, "unknown_choice")
    return SCENARIOS[name]
