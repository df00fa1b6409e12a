"""Targets, units and bounds of time, as tidy and wide tables state them."""

import re
from datetime import datetime
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, remark
from thermaxis.errors import MeasurementFileError
from thermaxis.files.table._columns import QUANTITIES, Role, Unit, unit_named
from thermaxis.files.table._table import Layout, Table
from thermaxis.positioning import FloatArray
from thermaxis.quantities import AxisKind

TARGET_RESOLUTION = 1e-6
"""Targets that are equal after rounding to this step are one target. [mm or deg]"""

_FAR_SMALLER = 20.0

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


def one_target_each(
    table: Table, row_target: FloatArray, passes: _IntArray, given: NDArray[np.bool_], unit: str
) -> tuple[FloatArray, _IntArray, list[Message]]:
    """Return the targets, (m,), and the index of each row's, with a tolerance where one is stated.

    Without one, targets that differ so little from each other that each pass has one of them are
    refused: they are one target, measured, or several.
    """
    target, index = group_targets(row_target)
    tolerance = table.source.mapping.target_tolerance
    nearby = _least_tolerance(target) if tolerance is None else tolerance
    if nearby is None:
        return target, index, []
    apart = np.diff(target, prepend=-np.inf) > nearby
    first = np.flatnonzero(apart)
    last = np.append(first[1:], target.size) - 1
    spread = target[last] - target[first]
    widest = int(np.argmax(spread))
    shown = {
        "first": f"{target[first[widest]]:.10g}",
        "second": f"{target[last[widest]]:.10g}",
        "unit": unit,
    }
    merged = (np.cumsum(apart, dtype=np.int64) - 1)[index]
    if tolerance is None:
        cells = np.column_stack((passes, merged))[given]
        if np.unique(cells, axis=0).shape[0] < cells.shape[0]:
            return target, index, []  # a pass has several of them: these are targets of their own
        more = {
            "targets": target.size,
            "fewer": first.size,
            "tolerance": _rounded_up(float(spread[widest])),
        }
        near = Message("error-targets_nearly_equal", {**shown, **more}, table.at())
        raise MeasurementFileError.of(near)
    if float(spread[widest]) > tolerance:
        raise MeasurementFileError.of(Message("error-targets_not_apart", shown, table.at()))
    if first.size == target.size:
        return target, index, []
    mean = np.bincount(merged, row_target) / np.bincount(merged)
    said = remark(
        "targets_merged", targets=target.size, fewer=first.size, largest=float(spread[widest])
    )
    decimals = int(np.ceil(-np.log10(spread[widest])))  # as many as the positions agree in
    return np.round(mean, max(decimals, 0)) + 0.0, merged, [said]


def _rounded_up(value: float) -> float:
    """Return a tolerance of two digits that is not smaller."""
    digits = 1 - int(np.floor(np.log10(value)))
    return round(float(np.ceil(value * 10.0**digits - 1e-6)) / 10.0**digits, digits)


def _least_tolerance(target: FloatArray) -> float | None:
    """Return a tolerance between steps that are far smaller than all others and these, if any."""
    steps = np.sort(np.diff(target))
    ratio = steps[1:] / steps[:-1]
    if not ratio.size or float(ratio.max()) < _FAR_SMALLER:
        return None
    return float(steps[int(np.argmax(ratio))]) * (1 + 1e-9)


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
    place = table.at(column=column)
    if heading.unit_text:
        raise MeasurementFileError("unknown_length_or_angle", unit=heading.unit_text, place=place)
    named = unit_elsewhere(table, heading.role)
    unit = unit_named(named)
    if unit is None:
        code = "unknown_length_or_angle" if named else "unit_not_stated"
        raise MeasurementFileError(code, unit=named, example=example, place=place)
    table.metadata.remarks.append(remark("unit_elsewhere", name=heading.text, unit=unit.name))
    return unit


def unit_elsewhere(table: Table, role: Role | None) -> str:
    """Return the unit that an option or a line above the headings states of a column."""
    mapping, stated = table.source.mapping, table.metadata.units
    position = role is not Role.DEVIATION
    named = mapping.position_unit if position else mapping.deviation_unit
    named = named or stated.get(Role.TARGET if position else Role.DEVIATION, "")
    if named or table.metadata.unit is None:
        return named
    both = re.split(r"\s*[/,;]\s*", table.metadata.unit)
    if len(both) == 2:
        return both[not position]
    # one unit may be that of the positions or of the deviations
    wide = table.layout is Layout.WIDE
    needy = {
        h.role is Role.DEVIATION or h.is_pass
        for h in table.headings
        if (h.role in QUANTITIES or (wide and h.is_pass)) and not h.unit
    }
    return table.metadata.unit if len(needy) == 1 else ""
