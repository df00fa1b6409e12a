"""What the virtual lathe shows of itself: names, units, sensors with noise and coarse digits."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final, NamedTuple, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.virtual.lathe._physics import POSITIONS, Node

FloatArray: TypeAlias = NDArray[np.float64]

GOOD: Final = "Good"
"""Status of a value that is one."""
NOT_SEEN: Final = "BadOutOfService"
"""Status of a probe while the table turns."""
HALL: Final = -1
"""Stands for the hall's air where a node is asked for."""


class Signal(NamedTuple):
    """One value that the machine shows."""

    unit: str
    """`degC`, `um`, `mm`, `rpm`, `bool` or `1`."""
    text: str
    """What it is, as a sentence without its full stop."""
    writable: bool = False
    """Whether it may be written."""


class LatheReading(NamedTuple):
    """One value as the machine shows it."""

    value: float | bool | None
    """Value in the signal's unit; None where there is none."""
    status: str
    """Name of the OPC UA status."""
    stamp_s: float
    """Machine's time at which it was taken. [s]"""

    @property
    def good(self) -> bool:
        """Whether the status is good."""
        return self.status == GOOD


SENSORS: Final[Mapping[str, int]] = MappingProxyType(
    {
        "T_spindle_C": Node.SPINDLE_BEARING,
        "T_table_C": Node.TABLE_BEARING,
        "T_column_C": Node.COLUMNS,
        "T_headstock_C": Node.HEADSTOCK,
        "T_bed_C": Node.BED_FOOT,
        "T_coolant_C": Node.COOLANT,
        "T_hall_C": HALL,
        "T_spindle_2_C": Node.SPINDLE_BEARING,
        "T_table_2_C": Node.TABLE_BEARING,
        "T_column_2_C": Node.COLUMNS,
    }
)
"""Temperature sensors and what they stand on; those with 2 are redundant sensors of their own."""
PROBES: Final = ("Z_um", "Z_D0_um", "Z_D1500_um", "Z_D3000_um")
"""Displacement probes, in the order of the positions."""
TRUE: Final = tuple(name.replace("_um", "_true_um") for name in PROBES)
"""True displacements with the offset that acts."""
UNCORRECTED: Final = tuple(name.replace("_um", "_uncorrected_um") for name in PROBES)
"""True displacements as they were without any offset."""
FLAGS: Final = ("machine_on", "referenced", "homing", "emergency_stop", "own_compensation")
"""Flags that can be set."""


def _signals() -> Mapping[str, Signal]:
    found: dict[str, Signal] = {}
    places = {
        "spindle": "front bearing of the spindle",
        "table": "bearing of the table",
        "column": "columns",
        "headstock": "headstock",
        "bed": "bed",
        "coolant": "coolant",
        "hall": "air of the hall",
    }
    for name in SENSORS:
        place = places[name.split("_")[1]]
        second = ", redundant sensor" if "_2_" in name else ""
        found[name] = Signal("degC", f"Temperature of the {place}{second}, in steps of 0.1 K")
    for names, words in (
        (PROBES, "measured with noise, seen while the table stands"),
        (TRUE, "true, with the offset that acts"),
        (UNCORRECTED, "true, as it were without any offset"),
    ):
        for name, position in zip(names, POSITIONS, strict=True):
            place = "tool centre point" if position == "TCP" else f"diameter {position[1:]} mm"
            found[name] = Signal(
                "um", f"Tool point relative to workpiece at {place}, positive away, {words}"
            )
    found["touch_um"] = Signal(
        "um", "What the machine's own probe showed at the tool centre point when it touched last"
    )
    found["touch_count"] = Signal("1", "Counter that moves by 1 behind every touch")
    found["touch_asked"] = Signal("bool", "Whether a touch is to be taken soon", writable=True)
    found["n_spindle_rpm"] = Signal("rpm", "Speed of the spindle")
    found["n_table_rpm"] = Signal("rpm", "Speed of the table")
    found["gear"] = Signal("1", "Gear of the spindle")
    found["coolant_on"] = Signal("bool", "Whether the coolant's pump runs")
    found["table_seen"] = Signal("bool", "Whether the table stands, so that the probes see it")
    found["diameter_mm"] = Signal("mm", "Diameter at which the workpiece is turned", writable=True)
    found["machine_on"] = Signal("bool", "Whether the drives are on")
    found["referenced"] = Signal("bool", "Whether the Z axis has its reference")
    found["homing"] = Signal("bool", "Whether the Z axis looks for its reference")
    found["emergency_stop"] = Signal("bool", "Whether the emergency stop is pressed")
    found["own_compensation"] = Signal("bool", "Whether the builder's own compensation is active")
    found["offset_mm"] = Signal(
        "mm", "Offset of the Z axis as written, positive away from the workpiece", writable=True
    )
    found["offset_accepted_mm"] = Signal("mm", "Offset as accepted, after the clamp")
    found["offset_effective_mm"] = Signal("mm", "Offset that acts now")
    found["heartbeat"] = Signal("1", "Counter that a writer of the offset moves", writable=True)
    found["watchdog_alive"] = Signal("bool", "Whether the heartbeat has moved lately")
    found["time_s"] = Signal("s", "Time of the machine since the begin of the scenario")
    return MappingProxyType(found)


SIGNALS: Final = _signals()
"""Everything that the machine shows, by name."""
NUMBERS_WITHOUT_FAULTS: Final = frozenset(
    {*TRUE, *UNCORRECTED, "time_s", "offset_mm", "heartbeat", "watchdog_alive", "touch_asked"}
)
"""What no fault changes: the truth, and what was written."""
FAULTY: Final = tuple(name for name in SIGNALS if name not in NUMBERS_WITHOUT_FAULTS)
"""Signals that a fault may act on."""
SETTABLE: Final = (*FLAGS, "diameter_mm", "coolant_on")
"""Signals that a fault may set, so that the machine itself changes."""

_BLOCK = 1024


@final
class SensorNoise:
    """Noise of every sensor at every second, the same however the time was stepped.

    Parameters
    ----------
    seed : sequence of int
        Seed. [1]
    width : int
        Number of sensors. [1]
    """

    def __init__(self, seed: Sequence[int], width: int) -> None:
        self._seed, self._width = tuple(seed), width
        self._number = -1
        self._block: FloatArray = np.zeros((0, width))

    def at(self, time_s: float) -> FloatArray:
        """Return standard normal noise of the second that a time lies in, (width,). [1]"""
        second = max(0, int(time_s + 1e-6))
        number, row = divmod(second, _BLOCK)
        if number != self._number:
            rng = np.random.default_rng([*self._seed, 2, number])
            self._number, self._block = number, rng.standard_normal((_BLOCK, self._width))
        return self._block[row]


def counted(value: float, count: float) -> float:
    """Return a value in whole counts, as a sensor sends it, without the dirt of binary digits."""
    return round(round(value / count) * count, 6) + 0.0
