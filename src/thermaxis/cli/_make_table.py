"""Make the table of ``correct``: levels, points, the control's file, and the file read back."""

import argparse
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

import numpy as np

from thermaxis.cli._axis_run import (
    AxisRun,
    read_run,
    simulated_without_drift,
    temperature_in_words,
)
from thermaxis.cli._table_files import read_table_text
from thermaxis.controls import (
    Control,
    GridRule,
    ReadTable,
    TableRequest,
    TableText,
    check_options,
    comment_text,
    control_by_name,
)
from thermaxis.controls._control import check_points
from thermaxis.errors import ConfigurationError, DataError, MeasurementFileError
from thermaxis.positioning import (
    BACKWARD,
    FORWARD,
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
_LARGEST = 1e9
"""Largest position or value of a table that is looked at. [mm, µm; deg, arcsec]"""
_ROUND_OFF = 1e-6
"""Values nearer than this are the same beside their rounding. [µm or arcsec]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class OlderTable:
    """The table that was in force during the run, beside the one that takes its place."""

    name: str
    """Its file."""
    read: ReadTable
    """Its values and what looks wrong in it."""
    at_points: FloatArray
    """Its deviations at the points of the new table, (k, 2). [µm or arcsec]"""
    lost: float
    """How far it departs at the targets from its values at the new points. [µm or arcsec]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class MadeTable:
    """A control's table with everything that was worked out for it."""

    run: AxisRun
    """The run."""
    control_name: str
    """Name of the control on the command line."""
    control: Control
    """The control."""
    options: Mapping[str, str]
    """Its options."""
    rule: GridRule
    """What it asks of the points."""
    output: str
    """The table's file."""
    drift_free: bool
    """Whether the levels are those without drift."""
    levels: AxisLevels
    """Levels of the run."""
    wanted: CompensationTable
    """The table before it was rounded."""
    apart: float | None
    """Reversal of this run that is compensated apart from the points. [µm or arcsec]"""
    grid: str
    """How its points were chosen, in words."""
    text: TableText
    """The control's file."""
    read: ReadTable
    """What the control would read in it."""
    rounding: float
    """Largest difference between the two. [µm or arcsec]"""
    bound: FloatArray
    """How far the points can miss the levels, by the slopes, (m,). [µm or arcsec]"""
    residual: FloatArray
    """How far they do, without rounding, (m, 2). [µm or arcsec]"""
    measured: CorrectionEffect
    """What it makes of the readings."""
    without_drift: CorrectionEffect | None
    """What it makes of them without drift; None where no drift is seen."""
    older: OlderTable | None
    """The table that was in force during the run."""


def make_table(arguments: argparse.Namespace) -> MadeTable:
    """Make the table that the arguments of ``correct`` ask for; nothing is written.

    Parameters
    ----------
    arguments : argparse.Namespace
        What ``correct`` declares.

    Returns
    -------
    MadeTable
        The table and its simulation.

    Raises
    ------
    ThermaxisError
        If the run or the older table cannot be read, options do not go together, a limit of the
        control is exceeded, or the table read back is not the one that was to be written.
    """
    control = control_by_name(arguments.control)
    options = check_options(control, arguments.set, purpose="table")
    hours: float | None = arguments.reference_time
    run = read_run(
        arguments.run,
        axis=arguments.axis,
        encoding=arguments.encoding,
        reference_time_s=None if hours is None else 3600.0 * hours,
    )
    rule = control.grid_rule(run.test.kind, options)
    levels = _levels(run, drift_free=arguments.drift_free)
    if arguments.backlash:
        _check_backlash(control, rule, levels)
    reference = _reference(levels, arguments.reference)
    older_name: Path | None = arguments.merge
    read = None
    if older_name is not None:
        read = read_older(control, older_name, run, options)
        _check_same_axis(read, run, str(older_name))
    position, grid = _points(arguments, rule, levels.target, reference, read)
    residual_table = compensation_table(
        levels,
        position,
        kind=run.test.kind,
        axis=run.axis,
        reference_position=reference,
        per_direction=rule.per_direction,
        backlash=arguments.backlash,
    )
    wanted = residual_table if read is None else merge_tables(read.table, residual_table)
    if not rule.per_direction and wanted.per_direction:
        raise DataError(f"{control.title} has one value per point; the older table has two")
    wanted = replace(wanted, source=_source(arguments), run_sha256=run.sha256)
    check_points(wanted, rule, control.title)
    text = control.format_table(
        TableRequest(table=wanted, origin=_origin(run, arguments), options=options)
    )
    again = control.read_table(text.text, arguments.output, run.test.kind, options)
    rounding = _check_read_back(control, wanted, again, rule)
    correction = control.correction(again.table, run.test.target)
    older = None
    if read is not None and older_name is not None:
        # the run was measured with the older table: its corrections are in the readings
        correction = correction - control.correction(read.table, run.test.target)
        older = _older(str(older_name), read, position, levels.target)
    bound = interpolation_bound(
        levels, position, per_direction=rule.per_direction, backlash=arguments.backlash
    )
    return MadeTable(
        run=run,
        control_name=arguments.control,
        control=control,
        options=options,
        rule=rule,
        output=arguments.output,
        drift_free=arguments.drift_free,
        levels=levels,
        wanted=wanted,
        apart=residual_table.backlash,
        grid=grid,
        text=text,
        read=again,
        rounding=rounding,
        bound=bound if older is None else bound + older.lost,
        residual=_residual(levels, residual_table),
        measured=evaluate_correction(run.test, correction),
        without_drift=simulated_without_drift(run, correction),
        older=older,
    )


def read_older(control: Control, path: Path, run: AxisRun, options: Mapping[str, str]) -> ReadTable:
    """Read a table of a control from its file.

    Parameters
    ----------
    control : Control
        The control.
    path : Path
        The file.
    run : AxisRun
        The run, whose kind of axis gives the units.
    options : mapping
        The control's options.

    Returns
    -------
    ReadTable
        Values and findings, those of the file's encoding included.

    Raises
    ------
    MeasurementFileError
        If it cannot be read, or holds what the control would refuse.
    """
    text, unusual = read_table_text(path)
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite then is refused
            read = control.read_table(text, str(path), run.test.kind, options)
    except DataError as error:
        raise MeasurementFileError(
            error.what, path=str(path), remedy=error.remedy or "Look for a wrong number in it"
        ) from None
    if (
        max(float(np.max(np.abs(v))) for v in (read.table.position, read.table.deviation))
        > _LARGEST
    ):
        raise MeasurementFileError(
            "a position or value is larger than any axis has",
            path=str(path),
            remedy="Look for a missing decimal point",
        )
    return replace(read, findings=(*unusual, *read.findings))


# ---- what the table is made of ------------------------------------------------------------------


def _levels(run: AxisRun, *, drift_free: bool) -> AxisLevels:
    if not drift_free:
        return measured_levels(run.test)
    if run.drift is None:
        raise DataError(
            f"there are no drift-free levels: {run.why_no_drift}",
            where=run.name,
            remedy="Leave --drift-free out, or measure at least two cycles with times",
        )
    return axis_levels(run.test.target, run.drift.level)


def _check_backlash(control: Control, rule: GridRule, levels: AxisLevels) -> None:
    if rule.per_direction:
        raise ConfigurationError(
            f"{control.title} has a value for each direction: reversal is in its points already",
            where="--backlash",
            remedy="Leave it out",
        )
    if not rule.backlash_apart:
        raise ConfigurationError(
            f"the table of {control.title} has no place for the reversal",
            where="--backlash",
            remedy="Leave it out: the summary says which reversal remains, to be set on the"
            " control by hand",
        )
    if not levels.bidirectional:
        raise ConfigurationError(
            "only one approach was measured: the reversal is not known",
            where="--backlash",
            remedy="Leave it out, or measure both directions",
        )


def _check_same_axis(read: ReadTable, run: AxisRun, name: str) -> None:
    stated = read.table.axis
    if stated and stated.casefold() != run.axis.casefold():
        raise ConfigurationError(
            f"the older table is of axis {stated}, the new one would be of {run.axis}",
            where=name,
            remedy=f"Say --axis {stated} if the run was measured on that axis",
        )


def _reference(levels: AxisLevels, stated: float | None) -> float:
    if stated is not None:
        return stated
    first, last = float(levels.target[0]), float(levels.target[-1])
    return min(max(0.0, first), last)


def _points(
    arguments: argparse.Namespace,
    rule: GridRule,
    target: FloatArray,
    reference: float,
    older: ReadTable | None,
) -> tuple[FloatArray, str]:
    """Return the points of the table, and in words how they were chosen."""
    through = reference if rule.through_reference else None
    count: int | None = arguments.points
    spacing: float | None = arguments.spacing
    if count is None and spacing is None:
        if older is not None:
            found = _points_of_both(rule, target, through, older.table)
            if found is not None:
                return found, "those of the older table, so that nothing of it is lost"
        if not rule.equidistant:
            return _with(target, through, rule), "the targets themselves"
    position = table_points(
        target, points=count, spacing=spacing, through=through, decimals=rule.decimals
    )
    words = f"equidistant, every {float(position[1] - position[0]):.9g}"
    return position, words if through is None else f"{words}, one at the reference point"


def _with(target: FloatArray, through: float | None, rule: GridRule) -> FloatArray:
    places = target if through is None else np.append(target, through)
    return np.unique(np.round(places, rule.decimals))


def _points_of_both(
    rule: GridRule, target: FloatArray, through: float | None, old: CompensationTable
) -> FloatArray | None:
    """Return points that hold the older table without loss; None if they are too many."""
    if not rule.equidistant:
        both = _with(np.append(old.position, target), through, rule)
        both = both[np.append(True, np.diff(both) > _SAME)]
    elif old.step is None:
        return None
    else:
        start, step = float(old.position[0]), old.step
        if through is not None and abs((through - start) / step % 1.0 - 0.5) < 0.5 - _SAME:
            return None
        before = max(0, int(np.ceil((start - float(target[0])) / step - _SAME)))
        last = max(float(target[-1]), float(old.position[-1]))
        count = int(np.ceil((last - start) / step - _SAME)) + 1
        both = start + step * np.arange(-before, count, dtype=np.float64)
    most = rule.most_points
    return None if most is not None and both.size > most else both


def _source(arguments: argparse.Namespace) -> str:
    words = "drift-free" if arguments.drift_free else "measured"
    return words if arguments.merge is None else f"{words}, added to an older table"


def _origin(run: AxisRun, arguments: argparse.Namespace) -> tuple[str, ...]:
    """Return lines for the head of the file, where hash and kind of levels stand anyhow."""
    from thermaxis import __version__  # noqa: PLC0415  of the package that imports this one

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
    return tuple(comment_text(line) for line in lines)


# ---- what became of it --------------------------------------------------------------------------


def _check_read_back(
    control: Control, wanted: CompensationTable, again: ReadTable, rule: GridRule
) -> float:
    """Return the largest rounding; refuse a file that the control would read otherwise."""
    unit = wanted.kind.units.deviation
    if again.table.position.size != wanted.position.size:
        raise ConfigurationError(
            f"the control would read {again.table.position.size} points of"
            f" {wanted.position.size}: nothing was written",
            remedy="This is a defect of the program: report it with the run",
        )
    meant = -wanted.deviation_at(wanted.position)
    found = control.correction(again.table, wanted.position)
    difference = float(np.max(np.abs(found - meant)))
    moved = float(np.max(np.abs(again.table.position - wanted.position)))
    step = rule.resolution if again.resolution is None else again.resolution
    allowed = 0.5 * step + _steepest(wanted) * moved
    if wanted.backlash is not None:
        allowed += 0.25 * step  # half of the rounding of the reversal
    if difference > allowed + _ROUND_OFF * max(1.0, float(np.max(np.abs(meant)))):
        raise ConfigurationError(
            f"the control would read values that differ by {difference:.4g} {unit} from those"
            f" that were meant, more than the {allowed:.4g} {unit} of rounding: nothing was"
            " written",
            remedy="This is a defect of the program: report it with the run",
        )
    return difference


def _steepest(table: CompensationTable) -> float:
    if table.position.size < 2:
        return 0.0
    rise = np.abs(np.diff(table.deviation, axis=0)) / np.diff(table.position)[:, np.newaxis]
    return float(np.max(rise))


def _residual(levels: AxisLevels, table: CompensationTable) -> FloatArray:
    """Return how far the table misses the levels, apart from the zero that was chosen, (m, 2)."""
    value = values_at_points(levels, table.position)
    zero = float(np.mean(value[:, FORWARD] + value[:, BACKWARD]) / 2 - np.mean(table.mean))
    return levels.level - zero - table.deviation_at(levels.target)


def _older(name: str, read: ReadTable, position: FloatArray, target: FloatArray) -> OlderTable:
    table = replace(read.table, backlash=None)
    at_points = table.deviation_at(position)
    sampled = np.stack([np.interp(target, position, at_points[:, a]) for a in (0, 1)], axis=1)
    lost = float(np.max(np.abs(sampled - table.deviation_at(target))))
    return OlderTable(name, read, at_points, lost)
