"""Where the table of ``correct`` is zero: the reference point of the axis, or of the older table.

Not protected: most tables do not state their reference point. One that was found where the older
table is zero may be another place at which it is zero too.
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.cli.axis.tables.run import table_warning
from thermaxis.codes import Message
from thermaxis.controls import GridRule, ReadTable
from thermaxis.errors import ConfigurationError
from thermaxis.positioning import CompensationTable, FloatArray

_SAME = 1e-6
"""Positions nearer than this are the same: files have six decimals at most. [mm or deg]"""


@final
@dataclass(frozen=True, slots=True)
class ReferencePoint:
    """Where a table is zero, and how that is known."""

    position: float
    """Where the mean of both directions becomes zero. [mm or deg]"""
    words: str
    """How it was chosen, for the summary; empty where that goes without saying."""
    older: float | None
    """That of the older table: stated in its file, or where it is zero; None where it is nowhere
    zero, or there is no older table. [mm or deg]"""
    warnings: tuple[Message, ...] = ()
    """What follows for the zero of the control."""


def reference_point(
    target: FloatArray, stated: float | None, read: ReadTable | None, rule: GridRule
) -> ReferencePoint:
    """Return where the new table is zero."""
    usual = min(max(0.0, float(target[0])), float(target[-1]))
    if read is None:
        return ReferencePoint(usual if stated is None else stated, "", None)
    known = read.table.reference_position
    if known is not None:
        return _beside(read, known, stated, rule)
    resolution = rule.resolution if read.resolution is None else read.resolution
    near = 0.5 * resolution + 1e-6
    if stated is not None:
        return _stated(read, stated, near)
    found = _nearest_zero(read.table, usual, near)
    if found is None:
        return ReferencePoint(usual, "", None, (_moved(read, usual),))
    units = read.table.kind.units
    taken = table_warning("reference_taken", position=found, position_unit=units.position)
    return ReferencePoint(found, "where the older table is zero", found, (taken,))


def _beside(read: ReadTable, known: float, stated: float | None, rule: GridRule) -> ReferencePoint:
    """Return the reference point that the older file states, or the other one that is asked for."""
    unit = read.table.kind.units.position
    if stated is None or abs(stated - known) < _SAME:
        return ReferencePoint(known, "as in the older table", known)
    if rule.through_reference:
        raise ConfigurationError(
            "points_count_from_reference", key="--reference", known=known, stated=stated, unit=unit
        )
    return ReferencePoint(stated, "as stated", known, (_moved(read, stated),))


def _stated(read: ReadTable, stated: float, near: float) -> ReferencePoint:
    older = _nearest_zero(read.table, stated, near)
    if older == stated:
        return ReferencePoint(stated, "as stated; the older table is zero there too", stated)
    return ReferencePoint(stated, "as stated", older, (_moved(read, stated),))


def _moved(read: ReadTable, place: float) -> Message:
    units, value = read.table.kind.units, _mean_at(read.table, place)
    unit, position_unit = units.deviation, units.position
    return table_warning(
        "zero_moves", value=value, unit=unit, position=place, position_unit=position_unit
    )


def _mean_at(table: CompensationTable, place: float) -> float:
    return float(np.interp(place, table.position, table.mean))


def _nearest_zero(table: CompensationTable, place: float, near: float) -> float | None:
    """Return where the mean of both directions is zero, nearest to a position; None if nowhere."""
    if abs(_mean_at(table, place)) <= near:
        return place
    position, mean = table.position, table.mean
    found = position[np.abs(mean) <= near]
    k = np.flatnonzero((mean[:-1] < -near) & (mean[1:] > near))
    k = np.union1d(k, np.flatnonzero((mean[:-1] > near) & (mean[1:] < -near)))
    share = mean[k] / (mean[k] - mean[k + 1])
    crossing = np.round(position[k] + share * (position[k + 1] - position[k]), 6)
    found = np.concatenate((found, crossing))
    return float(found[np.argmin(np.abs(found - place))]) if found.size else None
