"""Points of Fanuc's stored pitch error compensation: numbers, increments, their rounding.

A point number belongs to a section between two neighbouring grid positions. Its value is what the
correction grows by over the section, seen from the negative side, and the number of the reference
position belongs to the section that ends there: with 40 at position 0 and an interval of 50 the
section from -50 to 0 is 40, and that from 0 to 50 is 41 [V, parameter manual B-63980EN, example].
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil
from typing import final

import numpy as np
from numpy.typing import NDArray

from thermaxis.controls._control import number_option, whole_option
from thermaxis.errors import ConfigurationError
from thermaxis.positioning import BACKWARD, FORWARD, CompensationTable, FloatArray
from thermaxis.quantities import AxisKind

FIRST_POINT = 10_000
"""Word N of point number 0 in a parameter file; from memory. [1]"""
LARGEST_POSITION = 99_999.999
"""Largest position of a word in IS-B; from memory. [mm or deg]"""
LARGEST_MAGNIFICATION = 100
"""Largest magnification; from memory. [1]"""
STATION = 0.001
"""Unit of an interval, increment system IS-B; from memory. [mm or deg]"""
TURN_DEG = 360.0
"""What a modulo rotary axis repeats after. [deg]"""
_SAME = 1e-6
_NEAR = 1.5 * STATION  # a reference position of more decimals than the grid

AXIS_LETTERS = "XYZABCUVW"
"""Names of axes of a program, in the usual order of their numbers."""


@final
@dataclass(frozen=True, slots=True)
class PointOptions:
    """The options of a table as numbers."""

    axis_number: int | None
    """Number of the axis on the control; None for ``auto``. [1]"""
    unit: float
    """Detection unit. [µm or arcsec]"""
    magnification: int | None
    """Magnification; None for ``auto``. [1]"""
    largest: int
    """Largest magnitude of a value. [1]"""
    most: int
    """Largest number of points of an axis and direction. [1]"""
    highest: int
    """Highest point number of the control. [1]"""
    reference_point: int | None
    """Number of the reference position; None for ``auto``. [1]"""
    reference: float | None
    """Machine coordinate of the reference position; None for that of the table. [mm or deg]"""
    bidirectional: bool
    """Whether there is a second table for the negative direction."""
    returns_positive: bool
    """Whether the axis returns to its reference position in positive direction."""
    modulo: bool
    """Whether the axis is rotary and repeats after a turn."""
    comments: bool
    """Whether the file has comments."""

    @property
    def tables(self) -> int:
        """Number of tables, one or two. [1]"""
        return 2 if self.bidirectional else 1


def point_options(kind: AxisKind, options: Mapping[str, str]) -> PointOptions:
    """Return the options of a table as numbers."""
    modulo = options["modulo"] == "1"
    if modulo and kind is not AxisKind.ROTARY:
        raise ConfigurationError("modulo_of_linear_axis", key="--set modulo")
    reference = None
    if options["reference_coordinate"] != "table":
        reference = number_option(options, "reference_coordinate", lowest=-1e5, highest=1e5)
    count = number_option(options, "detection_unit", lowest=0.001, highest=100.0)
    highest = whole_option(options, "highest_point", lowest=1, highest=9999)
    return PointOptions(
        axis_number=whole_or_none(options, "axis_number", 1, 32),
        unit=count * kind.units.deviations_per_position * STATION,
        magnification=whole_or_none(options, "magnification", 1, LARGEST_MAGNIFICATION),
        largest=whole_option(options, "largest_value", lowest=1, highest=127),
        most=whole_option(options, "max_points", lowest=2, highest=10_000),
        highest=highest,
        reference_point=whole_or_none(options, "reference_point", 0, highest),
        reference=reference,
        bidirectional=options["bidirectional"] == "1",
        returns_positive=options["return_direction"] == "positive",
        modulo=modulo,
        comments=options["comments"] == "1",
    )


def whole_or_none(options: Mapping[str, str], name: str, lowest: int, highest: int) -> int | None:
    if options[name] == "auto":
        return None
    return whole_option(options, name, lowest=lowest, highest=highest)


# ---- from a table to point values ---------------------------------------------------------------


@final
@dataclass(frozen=True, slots=True, eq=False)
class PointValues:
    """What stands in the parameters and points of one axis."""

    reference: float
    """Machine coordinate of the reference position. [mm or deg]"""
    reference_point: int
    """Parameter 3620. [1]"""
    first: int
    """Parameter 3621. [1]"""
    last: int
    """Parameter 3622. [1]"""
    second: int | None
    """Parameter 3626, None without a second table. [1]"""
    magnification: int
    """Parameter 3623. [1]"""
    interval: int
    """Parameter 3624. [0.001 mm or deg]"""
    offset: int
    """Parameter 3627, the other direction's correction at the reference position; 0 without a
    second table. [detection unit]"""
    values: NDArray[np.int64]
    """Increments from `first` to `last`, a column for each table. [1]"""


def point_values(table: CompensationTable, chosen: PointOptions, axis_number: int) -> PointValues:
    """Return the increments of a table, rounded so that their running sum never drifts.

    The sum of the values from the reference position to any point is the correction there,
    rounded once: it departs by at most half of magnification times detection unit.
    """
    step = _interval(table)
    reference = _reference(table, chosen)
    place = (reference - float(table.position[0])) / step
    below = round(place)
    if abs(place - below) * step > _NEAR:
        raise ConfigurationError(
            "no_point_at_reference",
            reference=reference,
            unit=table.kind.units.position,
            key="points",
        )
    sections = round(TURN_DEG / step) if chosen.modulo else table.position.size - 1
    # zeros lead from the reference position to a table that does not reach it
    front = 1 - below if below <= 0 else 0
    back = max(0, below - sections)
    count = front + sections + back
    _check_count(count, table, reference, chosen)
    correction, offset = _corrections(table, chosen)
    if chosen.modulo:
        correction = _one_turn(table, correction, step, below)
    magnification, counted = _magnified(correction, chosen)
    values = np.pad(np.diff(counted, axis=0), ((front, back), (0, 0)))
    if chosen.modulo:
        values[0] = values[-1]
    ahead = front - 1 + below  # numbers from the first one to that of the reference position
    first = _first_number(count, ahead, chosen, axis_number)
    return PointValues(
        reference=reference,
        reference_point=first + ahead,
        first=first,
        last=first + count - 1,
        second=first + count if chosen.bidirectional else None,
        magnification=magnification,
        interval=round(step / STATION),
        offset=offset if chosen.bidirectional else 0,
        values=values,
    )


def _check_count(
    count: int, table: CompensationTable, reference: float, chosen: PointOptions
) -> None:
    """Refuse too many numbers before room is made for them."""
    if count <= chosen.most:
        return
    spacing: float = 0  # whole: none is proposed
    if chosen.most > 2 and not chosen.modulo:
        ends = (float(table.position[0]), float(table.position[-1]), reference)
        # on each side of the reference position a section may be begun
        spacing = ceil((max(ends) - min(ends)) / (chosen.most - 2) / STATION) * STATION
    raise ConfigurationError(
        "too_many_point_numbers", points=count, most=chosen.most, spacing=spacing, key="points"
    )


def _first_number(count: int, ahead: int, chosen: PointOptions, axis_number: int) -> int:
    """Return the most negative number of the first table."""
    first = (axis_number - 1) * chosen.most * chosen.tables
    if chosen.reference_point is not None:
        first = chosen.reference_point - ahead
    end = first + count * chosen.tables - 1
    if first < 0 or end > chosen.highest:
        raise ConfigurationError(
            "point_numbers_outside",
            first=first,
            last=end,
            highest=chosen.highest,
            key="--set reference_point",
        )
    return first


def _interval(table: CompensationTable) -> float:
    step = table.step
    if step is None:
        raise ConfigurationError("points_not_equidistant", key="points")
    stations = round(step / STATION)
    if stations < 1 or abs(step / STATION - stations) > _SAME:
        raise ConfigurationError("interval_too_fine", interval=step, decimals=3, key="points")
    return step


def _reference(table: CompensationTable, chosen: PointOptions) -> float:
    stated = table.reference_position
    if chosen.reference is None:
        if stated is None:
            raise ConfigurationError("no_reference_position", key="--set reference_coordinate")
        return stated
    if stated is not None and abs(stated - chosen.reference) > _SAME:
        raise ConfigurationError(
            "other_reference_position",
            stated=stated,
            reference=chosen.reference,
            key="--set reference_coordinate",
        )
    return chosen.reference


def _corrections(table: CompensationTable, chosen: PointOptions) -> tuple[FloatArray, int]:
    """Return the correction of each table of the control, zero at the reference, and its 3627."""
    zero = np.interp(_reference(table, chosen), table.position, table.mean)
    if not chosen.bidirectional:
        mean: FloatArray = zero - table.mean
        return mean[:, np.newaxis], 0
    place = _reference(table, chosen)
    # reversal that was apart, as of an older table with 1851, moves into the two tables
    both = zero - table.deviation_at(table.position)
    at = [float(np.interp(place, table.position, both[:, a])) for a in (FORWARD, BACKWARD)]
    # 3627 is rounded first, and the other half of it goes into the points: so that the mean of
    # both directions is met to half a step at every point
    offset = round((at[BACKWARD] - at[FORWARD]) / chosen.unit)
    half = 0.5 * offset * chosen.unit
    apart = both + np.array([half, -half])
    return apart, offset if chosen.returns_positive else -offset


def _one_turn(
    table: CompensationTable, correction: FloatArray, step: float, below: int
) -> FloatArray:
    """Return the corrections from the reference position over one whole turn."""
    sections = round(TURN_DEG / step)
    span = float(table.position[-1] - table.position[0])
    if abs(sections * step - TURN_DEG) > _SAME or span > TURN_DEG + _SAME or below != 0:
        raise ConfigurationError("modulo_table_unfit", key="--set modulo")
    if abs(span - TURN_DEG) < _SAME:
        return correction
    # the rest of the turn leads straight back to the reference position
    missing = sections + 1 - correction.shape[0]
    way = np.linspace(0.0, 1.0, missing + 1)[1:, np.newaxis]
    rest = correction[-1] + way * (correction[0] - correction[-1])
    return np.concatenate((correction, rest))


def _magnified(correction: FloatArray, chosen: PointOptions) -> tuple[int, NDArray[np.int64]]:
    """Return the magnification and the corrections in its steps."""
    stated = chosen.magnification
    tried = [stated] if stated is not None else range(1, LARGEST_MAGNIFICATION + 1)
    counted = np.zeros(correction.shape, dtype=np.int64)
    for magnification in tried:
        counted = np.rint(correction / (magnification * chosen.unit)).astype(np.int64)
        if chosen.modulo and bool(np.any(counted[0] != counted[-1])):
            raise ConfigurationError("turn_not_closed", key="--set modulo")
        if int(np.max(np.abs(np.diff(counted, axis=0)))) <= chosen.largest:
            return magnification, counted
    needed = int(np.max(np.abs(np.diff(counted, axis=0))))
    raise ConfigurationError(
        "increment_too_large",
        increment=needed,
        largest=chosen.largest,
        magnification=tried[-1],
        key="points",
    )
