"""Make the table of ``correct``: levels, points, the control's file, and the file read back."""

import argparse
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

import numpy as np

from thermaxis import __version__
from thermaxis.cli._reading import reading_of
from thermaxis.cli.axis.tables.in_force import InForce, what_was_in_force
from thermaxis.cli.axis.tables.plausible import doubts_about_size
from thermaxis.cli.axis.tables.reference import ReferencePoint, reference_point
from thermaxis.cli.axis.tables.run import (
    AxisRun,
    read_run,
    simulated_without_drift,
    temperature_in_words,
    with_drift,
)
from thermaxis.codes import Message
from thermaxis.controls import (
    Control,
    GridRule,
    ReadTable,
    TableRequest,
    TableText,
    check_options,
    check_points,
    comment_text,
    control_by_name,
)
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.positioning import (
    BACKWARD,
    FORWARD,
    MOST_POINTS,
    AxisLevels,
    CompensationTable,
    CorrectionEffect,
    FloatArray,
    axis_levels,
    compensation_table,
    evaluate_correction,
    interpolation_bound,
    measured_levels,
    merge_tables,
    table_points,
    values_at_points,
)

_SAME = 1e-6
"""Positions nearer than this are the same: files have six decimals at most. [mm or deg]"""
_NEAR = 0.01
"""An older point nearer than this to a target is left out if nothing is lost. [mm or deg]"""
_ROUND_OFF = 1e-6
"""Values nearer than this are the same beside their rounding. [µm or arcsec]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class OlderTable:
    """The table that was in force during the run, beside the one that takes its place."""

    at_points: FloatArray
    """Its deviations at the points of the new table, (k, 2). [µm or arcsec]"""
    lost: float
    """How far it departs at the targets from its values at the new points. [µm or arcsec]"""
    lost_at_points: tuple[float, float]
    """The same at its own points: the largest, and where. [µm or arcsec; mm or deg]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class MadeTable:
    """A control's table with everything that was worked out for it."""

    arguments: argparse.Namespace
    control: Control
    options: Mapping[str, str]
    rule: GridRule
    """What it asks of the points."""
    run: AxisRun
    levels: AxisLevels
    """Levels of the run, as measured or without drift."""
    in_force: InForce
    """What corrected the axis during the run."""
    residual: CompensationTable
    """The levels alone, at the points of the table."""
    wanted: CompensationTable
    """The table before it was rounded: the same with what was in force."""
    grid: str
    """How its points were chosen, in words."""
    reference: ReferencePoint
    doubts: tuple[Message, ...]
    """Why its unit is doubted."""
    text: TableText
    read: ReadTable
    """What the control would read in it."""
    rounding: float
    """Largest difference between the two. [µm or arcsec]"""
    measured: CorrectionEffect
    """What it makes of the readings."""
    without_drift: CorrectionEffect | None
    """What it makes of them without drift; None where no drift is seen."""
    older: OlderTable | None
    """The table that was in force, beside the new one."""

    @property
    def bound(self) -> FloatArray:
        """How far the points can miss the levels, by the slopes, (m,). [µm or arcsec]"""
        bound = interpolation_bound(
            self.levels,
            self.wanted.position,
            per_direction=self.rule.per_direction,
            backlash=self.arguments.backlash,
        )
        return bound if self.older is None else bound + self.older.lost

    @property
    def missed(self) -> FloatArray:
        """How far they do, without rounding and the zero that was chosen, (m, 2). [µm or arcsec]"""
        table = self.residual
        value = values_at_points(self.levels, table.position)
        zero = float(np.mean(value[:, FORWARD] + value[:, BACKWARD]) / 2 - np.mean(table.mean))
        return self.levels.level - zero - table.deviation_at(self.levels.target)


def make_table(arguments: argparse.Namespace) -> MadeTable:
    """Make the table that the arguments of ``correct`` ask for; nothing is written."""
    control = control_by_name(arguments.control)
    options = check_options(control, arguments.set, purpose="table")
    run = read_run(arguments.run, axis=arguments.axis, reading=reading_of(arguments))
    rule = control.grid_rule(run.test.kind, options)
    levels = measured_levels(run.test)
    if arguments.backlash:
        _check_backlash(control, rule, levels)
    in_force = what_was_in_force(arguments, control, options, rule, run)
    residual, reference, grid = _at_points(arguments, rule, in_force, run, levels)
    # the drift model takes a minute for some thousand readings: first what can be refused at once
    check_points(residual, rule, control.title)
    if not arguments.no_drift:
        hours: float | None = arguments.reference_time
        run = with_drift(run, reference_time_s=None if hours is None else 3600.0 * hours)
    if arguments.drift_free:
        levels = _drift_free_levels(run)
        residual, reference, grid = _at_points(arguments, rule, in_force, run, levels)
    doubts = doubts_about_size(residual)
    wanted = _with_what_was_in_force(residual, in_force, rule, control)
    if in_force.table is not None:
        doubts += doubts_about_size(wanted)
    wanted = replace(wanted, source=_source(arguments), run_sha256=run.sha256)
    request = TableRequest(table=wanted, origin=_origin(run, arguments, in_force), options=options)
    text, read, rounding = _written(control, request, rule, arguments.output)
    # what was in force during the run is in its readings
    target = run.test.target
    added = control.correction(read.table, target) - in_force.correction(control, target)
    return MadeTable(
        arguments=arguments,
        control=control,
        options=options,
        rule=rule,
        run=run,
        levels=levels,
        in_force=in_force,
        residual=residual,
        wanted=wanted,
        grid=grid,
        reference=reference,
        doubts=doubts,
        text=text,
        read=read,
        rounding=rounding,
        measured=evaluate_correction(run.test, added),
        without_drift=simulated_without_drift(run, added),
        older=_older(in_force, rule, wanted.position, levels.target),
    )


# ---- what the table is made of ------------------------------------------------------------------


def _drift_free_levels(run: AxisRun) -> AxisLevels:
    if run.drift is None:
        raise DataError("no_drift_free_levels", file=run.name, cause=run.why_no_drift)
    return axis_levels(run.test.target, run.drift.level)


def _at_points(
    arguments: argparse.Namespace,
    rule: GridRule,
    in_force: InForce,
    run: AxisRun,
    levels: AxisLevels,
) -> tuple[CompensationTable, ReferencePoint, str]:
    """Return the levels at the points of the table, where it is zero, and the grid in words."""
    reference = reference_point(levels.target, arguments.reference, in_force.read, rule)
    position, grid = _points(arguments, rule, levels.target, reference.position, in_force.table)
    table = compensation_table(
        levels,
        position,
        kind=run.test.kind,
        axis=run.axis,
        reference_position=reference.position,
        per_direction=rule.per_direction,
        backlash=arguments.backlash,
    )
    return table, reference, grid


def _check_backlash(control: Control, rule: GridRule, levels: AxisLevels) -> None:
    if rule.per_direction:
        raise ConfigurationError("reversal_in_points", key="--backlash", control=control.title)
    if not rule.backlash_apart:
        raise ConfigurationError("no_place_for_reversal", key="--backlash", control=control.title)
    if not levels.bidirectional:
        raise ConfigurationError("reversal_not_measured", key="--backlash")


def _with_what_was_in_force(
    residual: CompensationTable,
    in_force: InForce,
    rule: GridRule,
    control: Control,
) -> CompensationTable:
    """Return the table that takes the place of everything that was in force."""
    older = in_force.table
    if older is not None:
        wanted = merge_tables(older, residual)
    elif in_force.backlash is not None:
        wanted = replace(residual, backlash=in_force.backlash + (residual.backlash or 0.0))
    else:
        wanted = residual
    if rule.per_direction:
        return _reversal_in_points(wanted)
    if wanted.per_direction:
        raise DataError("older_table_has_two_values", control=control.title)
    return wanted


def _reversal_in_points(table: CompensationTable) -> CompensationTable:
    """Return a table whose points hold what it compensated apart, which is zero then."""
    if table.backlash is None:
        return table
    return replace(table, deviation=table.deviation_at(table.position), backlash=0.0)


def _points(
    arguments: argparse.Namespace,
    rule: GridRule,
    target: FloatArray,
    reference: float,
    older: CompensationTable | None,
) -> tuple[FloatArray, str]:
    """Return the points of the table, and in words how they were chosen."""
    through = reference if rule.through_reference else None
    count: int | None = arguments.points
    spacing: float | None = arguments.spacing
    if count is None and spacing is None:
        if older is not None:
            found = _points_of_both(rule, target, through, older)
            if found is not None:
                return found
        if not rule.equidistant:
            return _with(target, through, rule), "the targets themselves"
    covered = target if older is None else _with_range_of(older, target)
    position = table_points(
        covered, points=count, spacing=spacing, through=through, decimals=rule.decimals
    )
    words = f"equidistant, every {float(position[1] - position[0]):.9g}"
    if covered.size > target.size:
        words += ", over the range of the older table too"
    return position, words if through is None else f"{words}, one at the reference point"


def _with_range_of(older: CompensationTable, target: FloatArray) -> FloatArray:
    """Return targets and the ends of the older table that lie beyond them."""
    ends = older.position[[0, -1]]
    beyond = ends[(ends < target[0] - _NEAR) | (ends > target[-1] + _NEAR)]
    return np.union1d(target, beyond)


def _with(target: FloatArray, through: float | None, rule: GridRule) -> FloatArray:
    places = target if through is None else np.append(target, through)
    return np.unique(np.round(places, rule.decimals))


def _points_of_both(
    rule: GridRule,
    target: FloatArray,
    through: float | None,
    old: CompensationTable,
) -> tuple[FloatArray, str] | None:
    """Return points that hold the older table without loss, in words too; None if too many."""
    words = "those of the older table, so that nothing of it is lost"
    most = MOST_POINTS if rule.most_points is None else rule.most_points
    if not rule.equidistant:
        both, beside = _old_and_new(_with(target, through, rule), old, rule)
        if both.size > most:
            return None
        if beside:
            words += (
                f"; {beside} of them lie nearer than {_NEAR:g} {old.kind.units.position} to a"
                " target and are kept, as the older table bends there"
            )
        return both, f"the targets and {words}"
    if old.step is None:
        return None
    start, step = float(old.position[0]), old.step
    if through is not None and abs((through - start) / step % 1.0 - 0.5) < 0.5 - _SAME:
        return None
    before = max(0.0, np.ceil((start - float(target[0])) / step - _SAME))
    last = max(float(target[-1]), float(old.position[-1]))
    count = np.ceil((last - start) / step - _SAME) + 1.0
    if not before + count <= most:  # before any array of that size
        return None
    return start + step * np.arange(-int(before), int(count), dtype=np.float64), words


def _old_and_new(new: FloatArray, old: CompensationTable, rule: GridRule) -> tuple[FloatArray, int]:
    """Return new points with the older ones, and how many of these lie beside a new one.

    Between two points that lie close together a rounding makes a steep slope. An older point
    beside a new one is left out where that changes the older table by half a resolution at most.
    """
    places = np.unique(np.round(old.position, rule.decimals))
    above = np.searchsorted(new, places).clip(1, new.size - 1)
    apart = np.minimum(np.abs(places - new[above - 1]), np.abs(places - new[above]))
    far, near = places[apart >= _NEAR], places[(apart < _NEAR) & (apart > _SAME)]
    points = np.union1d(new, far)
    left = np.abs(_sampled(old, points, near) - old.deviation_at(near)) if near.size else near
    bends = near[np.max(left, axis=1) > 0.5 * rule.resolution] if near.size else near
    return np.union1d(points, bends), bends.size


def _sampled(table: CompensationTable, points: FloatArray, at: FloatArray) -> FloatArray:
    """Return what a table is at positions if only its values at the points are kept, (p, 2)."""
    value = table.deviation_at(points)
    return np.stack(
        [np.interp(at, points, value[:, a]) for a in (FORWARD, BACKWARD)],
        axis=1,
    )


def _source(arguments: argparse.Namespace) -> str:
    words = "drift-free" if arguments.drift_free else "measured"
    return words if arguments.merge is None else f"{words}, added to an older table"


def _origin(run: AxisRun, arguments: argparse.Namespace, in_force: InForce) -> tuple[str, ...]:
    """Return lines for the head of the file, where hash and kind of levels stand anyhow."""
    test = run.test
    lines = [f"written by thermaxis {__version__}", f"run {Path(run.name).name}"]
    if arguments.drift_free and run.drift is not None and run.drift.reference_time_s is not None:
        lines.append(f"thermal state at {run.drift.reference_time_s / 3600.0:.2f} h of the run")
    if test.start is not None:
        lines.append(f"measured {test.start.strftime('%Y-%m-%d')}")
    lines.append(f"temperature {temperature_in_words(test)}")
    if arguments.merge is not None:
        lines.append(f"added to {Path(arguments.merge).name}")
        lines.append("that table was in force during the run")
    if in_force.backlash is not None:
        unit = test.kind.units.deviation_suffix
        lines.append(f"reversal compensated apart during the run {in_force.backlash:.3f} {unit}")
    return tuple(comment_text(line) for line in lines)


# ---- what became of it --------------------------------------------------------------------------


def _written(
    control: Control, request: TableRequest, rule: GridRule, output: str
) -> tuple[TableText, ReadTable, float]:
    """Return the control's file, what the control would read in it, and the largest rounding."""
    check_points(request.table, rule, control.title)
    text = control.format_table(request)
    options = control.own_options(request.options)
    again = control.read_table(text.text, output, request.table.kind, options)
    return text, again, _check_read_back(control, request.table, again, rule)


def _check_read_back(
    control: Control,
    wanted: CompensationTable,
    again: ReadTable,
    rule: GridRule,
) -> float:
    """Return the largest rounding; refuse a file that the control would read otherwise."""
    unit = wanted.kind.units.deviation
    if again.table.position.size != wanted.position.size:
        raise ConfigurationError(
            "read_back_points_differ", points=again.table.position.size, meant=wanted.position.size
        )
    meant = -wanted.deviation_at(wanted.position)
    found = control.correction(again.table, wanted.position)
    difference = float(np.max(np.abs(found - meant)))
    moved = float(np.max(np.abs(again.table.position - wanted.position)))
    step = rule.resolution if again.resolution is None else again.resolution
    allowed = 0.5 * step + wanted.steepest_slope[0] * moved
    if wanted.backlash is not None:
        allowed += 0.25 * step  # half of the rounding of the reversal
    if difference > allowed + _ROUND_OFF * max(1.0, float(np.max(np.abs(meant)))):
        raise ConfigurationError(
            "read_back_values_differ", difference=difference, allowed=allowed, unit=unit
        )
    return difference


def _older(
    in_force: InForce,
    rule: GridRule,
    position: FloatArray,
    target: FloatArray,
) -> OlderTable | None:
    table = in_force.table
    if table is None:
        return None
    table = _reversal_in_points(table) if rule.per_direction else replace(table, backlash=None)
    at_points = table.deviation_at(position)
    lost = float(np.max(np.abs(_sampled(table, position, target) - table.deviation_at(target))))
    own = table.position
    off = np.max(np.abs(_sampled(table, position, own) - table.deviation_at(own)), axis=1)
    k = int(np.argmax(off))
    return OlderTable(at_points, lost, (float(off[k]), float(own[k])))
