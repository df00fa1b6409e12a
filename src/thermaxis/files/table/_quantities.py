"""Targets, units and bounds of time, as tidy and wide tables state them."""

from datetime import datetime
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from thermaxis.errors import MeasurementFileError
from thermaxis.files.table._columns import Role, Unit
from thermaxis.files.table._table import Table
from thermaxis.positioning import FloatArray
from thermaxis.quantities import AxisKind

TARGET_RESOLUTION = 1e-6
"""Targets that are equal after rounding to this step are one target. [mm or deg]"""

_IntArray: TypeAlias = NDArray[np.int64]


def target_column_of(table: Table) -> tuple[int, Unit]:
    """Return the index of the column of targets, from 0, and its unit."""
    column = table.column_of(Role.TARGET)
    if column is None:
        raise MeasurementFileError("no_target_column", place=table.at())
    unit = _known_unit(table, column, "target_mm, or target_deg for a rotary axis")
    stated = table.metadata.kind
    if stated in set(AxisKind) and stated != unit.kind:
        raise MeasurementFileError(
            "kind_and_unit_disagree", kind=stated, unit=unit.name, place=table.at(column=column)
        )
    return column, unit


def unit_of_kind(table: Table, column: int, kind: AxisKind, example: str) -> Unit:
    """Return the unit that the heading of a column states."""
    if kind is AxisKind.ROTARY:
        example = example.replace("_um", "_arcsec").replace("_mm", "_deg")
    unit = _known_unit(table, column, example)
    if unit.kind is not kind:
        place = table.at(column=column)
        raise MeasurementFileError(
            "unit_of_other_kind", unit=unit.name, kind=kind, example=example, place=place
        )
    return unit


def group_targets(row_target: FloatArray) -> tuple[FloatArray, _IntArray]:
    """Return the targets in rising order, (m,), and the index of each row's target, (k,)."""
    steps = np.rint(row_target / TARGET_RESOLUTION)
    _, first, index = np.unique(steps, return_index=True, return_inverse=True)
    return row_target[first], index.astype(np.int64)


def check_start_and_end(table: Table, start: datetime | None, end: datetime | None) -> None:
    """Check that the end of the run is not before its start, and that both can be compared."""
    if start is None or end is None:
        return
    if (start.tzinfo is None) != (end.tzinfo is None) or start > end:
        raise MeasurementFileError("end_before_start", place=table.at())


def _known_unit(table: Table, column: int, example: str) -> Unit:
    heading = table.headings[column]
    if heading.unit is not None:
        return heading.unit
    if heading.unit_text:
        place = table.at(column=column)
        raise MeasurementFileError("unknown_unit", unit=heading.unit_text, place=place)
    raise MeasurementFileError("unit_not_stated", example=example, place=table.at(column=column))
