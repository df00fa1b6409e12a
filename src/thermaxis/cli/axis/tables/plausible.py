"""Whether the values of a table can be those of an axis: a wrong unit is the commonest mistake.

Not protected: a unit that is wrong by less than the limits here passes, as does every wrong sign.
"""

import numpy as np

from thermaxis.cli.axis.tables.run import table_warning
from thermaxis.codes import Message, Value
from thermaxis.errors import DataError
from thermaxis.positioning import CompensationTable

# A ball screw of the coarsest class, T10 of ISO 3408-3, departs by 210 µm in 300 mm [M]: 0.07 % of
# the way. Readings in mm that count as µm, or the reverse, are wrong by 1000, inches by 25.
_REFUSED_SLOPE = 0.1
"""Slope from which a table is refused: share of the way, 140 times that of such a screw. [1]"""
_SUSPECT_SLOPE = 0.01
"""Slope from which its unit is doubted, 14 times that of such a screw. [1]"""
_SUSPECT_DEVIATION = 1.0
"""Deviation above which the unit is doubted. [mm or deg]"""
_SHORTEST = 1.0
"""Pieces count as at least that long, or as long as the mean one: between two points that lie
close together noise and rounding make a steep slope of no height. [mm or deg]"""


def doubts_about_size(table: CompensationTable) -> tuple[Message, ...]:
    """Return why the values of a table are doubted; refuse what no axis can have."""
    units = table.kind.units
    per, unit = units.deviations_per_position, f"{units.deviation}/{units.position}"
    slope, low, high = _steepest(table)
    steep = table_warning(
        "steep", slope=slope, unit=unit, low=low, high=high, position_unit=units.position
    )
    if slope >= _REFUSED_SLOPE * per:
        more: dict[str, Value] = {
            "percent": 100.0 * slope / per,
            "deviation_unit": units.deviation,
        }
        raise DataError.of(Message("error-table_too_steep", {**steep.values, **more}))
    largest = float(np.max(np.abs(table.deviation)))
    large = table_warning("large", largest=largest, unit=units.deviation)
    found = ((steep, slope >= _SUSPECT_SLOPE * per), (large, largest > _SUSPECT_DEVIATION * per))
    return tuple(message for message, doubted in found if doubted)


def _steepest(table: CompensationTable) -> tuple[float, float, float]:
    """Return the steepest slope over pieces that are not short, and where it lies."""
    position = table.position
    if position.size < 2:
        return 0.0, float(position[0]), float(position[0])
    step = np.diff(position)
    rise = np.max(np.abs(np.diff(table.deviation, axis=0)), axis=1)
    slope = rise / np.maximum(step, min(_SHORTEST, float(np.mean(step))))
    k = int(np.argmax(slope))
    return float(slope[k]), float(position[k]), float(position[k + 1])
