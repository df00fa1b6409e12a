"""Targets, units and bounds of time, as tidy and wide tables state them."""

from datetime import datetime
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

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
        raise table.error(
            "there is no column of target positions",
            remedy="Name it target_mm, or target_deg for a rotary axis",
        )
    unit = _known_unit(table, column, "target_mm, or target_deg for a rotary axis")
    stated = table.metadata.kind
    if stated in set(AxisKind) and stated != unit.kind:
        raise table.error(
            f"the file says that the axis is {stated}, and this column has the unit {unit.name}",
            column=column,
            remedy="Correct the one that is wrong",
        )
    return column, unit


def unit_of_kind(table: Table, column: int, kind: AxisKind, example: str) -> Unit:
    """Return the unit that the heading of a column states."""
    if kind is AxisKind.ROTARY:
        example = example.replace("_um", "_arcsec").replace("_mm", "_deg")
    unit = _known_unit(table, column, example)
    if unit.kind is not kind:
        raise table.error(
            f"the unit {unit.name} does not fit the targets of a {kind} axis",
            column=column,
            remedy=f"Name the column {example}, if that is its unit, or convert it",
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
        raise table.error(
            f"the start {start.isoformat()} and the end {end.isoformat()} of the run do not fit",
            remedy="Correct the lines start and end above the headings",
        )


def _known_unit(table: Table, column: int, example: str) -> Unit:
    heading = table.headings[column]
    if heading.unit is not None:
        return heading.unit
    stated = (
        f"the unit '{heading.unit_text}' is not known" if heading.unit_text else "no unit is stated"
    )
    raise table.error(
        f"{stated} in the heading '{heading.text}'",
        column=column,
        remedy=f"Name the column {example}",
    )
