"""Kinds of axis and the units that follow from them."""

from dataclasses import dataclass
from enum import StrEnum
from typing import final


@final
@dataclass(frozen=True, slots=True)
class AxisUnits:
    """The pair of units that the kind of an axis fixes."""

    position: str
    """Unit of target positions as printed: mm or °."""
    deviation: str
    """Unit of deviations and figures as printed: µm or arcsec."""
    position_suffix: str
    """Unit of target positions in names of columns and keys: mm or deg."""
    deviation_suffix: str
    """Unit of deviations in names of columns and keys: um or arcsec."""
    deviations_per_position: float
    """Deviation units in one position unit: 1000 µm/mm or 3600 arcsec/°. [1]"""


class AxisKind(StrEnum):
    """Linear axis (mm, µm) or rotary axis (deg, arcsec)."""

    LINEAR = "linear"
    ROTARY = "rotary"

    @property
    def units(self) -> AxisUnits:
        """Units of positions and deviations of this kind of axis."""
        return _UNITS[self]


_UNITS = {
    AxisKind.LINEAR: AxisUnits("mm", "µm", "mm", "um", 1000.0),
    AxisKind.ROTARY: AxisUnits("°", "arcsec", "deg", "arcsec", 3600.0),
}
