"""What LinuxCNC's HAL is arranged from: outputs on joints, times, and names of programs."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Annotated, Literal, final, get_args

from thermaxis.compensation import LONGEST_CYCLE_S, SHORTEST_CYCLE_S, Limits
from thermaxis.errors import ConfigurationError, require_positive, require_range
from thermaxis.runtime._keys import Only, Word
from thermaxis.runtime._sign import OFFSET_UNITS, offset_factor

HalUnit = Literal["mm", "inch"]
"""Machine unit: LINEAR_UNITS of the machine's INI file."""
SHORTEST_WATCHDOG_S = 2.0
"""Shortest default of the watchdog: a short hang of the computer is no loss. [s]"""
ACCELERATION_PER_RATE = 25.0
"""Default of the acceleration per rate: the full rate stands after 0.04 s. [1/s]"""
LARGEST_ACCELERATION_UM_PER_S2 = 1e5
"""Largest acceleration that may be stated. [µm/s²]"""
_LAST_JOINT = 15


@final
@dataclass(frozen=True, slots=True)
class LinuxCncOutput:
    """One output on one joint."""

    joint: int
    """Number of the joint, from 0. [1]"""
    unit: HalUnit
    """Machine unit: LINEAR_UNITS of the machine's INI file; no default."""
    sign: str
    """What a positive offset does, as one of the two sentences; no default."""
    limits: Limits
    """Limits of the output; the machine gets the total and the rate."""
    largest_acceleration_um_per_s2: float = 0.0
    """Largest acceleration of the offset. Default: the full rate stands after 0.04 s. [µm/s²]"""
    factor: float = field(init=False, repr=False)
    """Machine units per micrometre of correction, with the sign. [machine unit/µm]"""

    def __post_init__(self) -> None:
        """Check the values and work out the factor."""
        require_range("joint", self.joint, 0, _LAST_JOINT)
        if self.unit not in get_args(HalUnit):
            raise ConfigurationError("no_linear_unit", unit=self.unit, key="unit")
        stated = self.largest_acceleration_um_per_s2
        if stated == 0.0:
            stated = ACCELERATION_PER_RATE * self.limits.largest_rate_um_per_s
            object.__setattr__(self, "largest_acceleration_um_per_s2", stated)
        key = "largest_acceleration_um_per_s2"
        require_positive(key, stated, LARGEST_ACCELERATION_UM_PER_S2)
        object.__setattr__(self, "factor", offset_factor(self.unit, self.sign))

    @property
    def request(self) -> str:
        """Signal that the writer sets: where the offset is to go."""
        return f"thermaxis-request-{self.joint}"

    @property
    def limit(self) -> str:
        """Component that bounds the offset and its rate."""
        return f"thermaxis-limit-{self.joint}"

    @property
    def shift(self) -> str:
        """Component that adds the offset below the motion controller."""
        return f"thermaxis-shift-{self.joint}"

    @property
    def homed(self) -> str:
        """Pin that tells whether the joint is homed."""
        return f"joint.{self.joint}.homed"

    @property
    def bounds(self) -> dict[str, float]:
        """Values of the limiter's pins. [machine unit, per s, per s²]"""
        units_per_um = OFFSET_UNITS[self.unit]
        return {
            f"{self.limit}.min": -self.limits.total_um * units_per_um,
            f"{self.limit}.max": self.limits.total_um * units_per_um,
            f"{self.limit}.maxv": self.limits.largest_rate_um_per_s * units_per_um,
            f"{self.limit}.maxa": self.largest_acceleration_um_per_s2 * units_per_um,
        }


@dataclass(frozen=True, kw_only=True)
class HalSettings:
    """What the table of the sink says of LinuxCNC."""

    watchdog_s: Annotated[float, Only("linuxcnc")] = 0.0
    """Time without a heartbeat after which LinuxCNC takes the offset back; linuxcnc only. Default:
    one late write is no loss. Without it: two cycles, at least 2. [s]"""
    thread: Annotated[Word, Only("linuxcnc")] = "servo-thread"
    """HAL thread of the motion controller; linuxcnc only. Default: LinuxCNC's own name."""
    halcmd: Annotated[Word, Only("linuxcnc")] = "halcmd"
    """Name or path of the program `halcmd`; linuxcnc only. Default: found as every program is."""


@final
@dataclass(frozen=True, kw_only=True)
class LinuxCncSettings(HalSettings):
    """What the sink and the HAL file are made from."""

    outputs: Mapping[str, LinuxCncOutput]
    """Outputs by the name that the model gives them."""
    cycle_s: float = 1.0
    """Nominal time from write to write. [s]"""
    retry_s: float = 0.5
    """Pause between two looks for LinuxCNC. [s]"""

    def __post_init__(self) -> None:
        if not self.outputs:
            raise ConfigurationError("no_output_named", key="output")
        joints = [output.joint for output in self.outputs.values()]
        for name, output in self.outputs.items():
            if joints.count(output.joint) > 1:
                raise ConfigurationError(
                    "joint_twice", joint=output.joint, key=f"output.{name}", channel=name
                )
        require_range("cycle_s", self.cycle_s, SHORTEST_CYCLE_S, LONGEST_CYCLE_S)
        if self.watchdog_s == 0.0:
            longer = max(SHORTEST_WATCHDOG_S, 2.0 * self.cycle_s)
            object.__setattr__(self, "watchdog_s", longer)
        if not 1.5 * self.cycle_s <= self.watchdog_s <= 2.0 * LONGEST_CYCLE_S:
            raise ConfigurationError(
                "watchdog_outside",
                value_s=self.watchdog_s,
                cycle_s=self.cycle_s,
                most_s=2.0 * LONGEST_CYCLE_S,
                key="watchdog_s",
            )
        require_positive("retry_s", self.retry_s, LONGEST_CYCLE_S)
        if re.fullmatch(r"[A-Za-z0-9_.-]{1,40}", self.thread) is None:
            raise ConfigurationError("no_hal_thread", key="thread")
        object.__setattr__(self, "outputs", MappingProxyType(dict(self.outputs)))


# ---- one table of nets --------------------------------------------------------------------------
