"""What ``check-table`` finds, as text for a terminal and as JSON."""

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np

from thermaxis import __version__
from thermaxis.cli._text_table import filled, text_table
from thermaxis.cli.axis._axis_run import (
    AxisRun,
    drift_in_words,
    read_run,
    run_in_words,
    simulated_without_drift,
    systematic_range,
    temperature_in_words,
    with_drift,
)
from thermaxis.cli.axis._control_names import axis_name
from thermaxis.cli.axis._correction_result import (
    effect_table,
    figures_as_json,
    table_as_json,
    targets_as_json,
)
from thermaxis.cli.axis._in_force import read_older
from thermaxis.cli.axis._results import finite_or_none
from thermaxis.controls import Control, ReadTable, check_options, control_by_name
from thermaxis.errors import printable
from thermaxis.positioning import CorrectionEffect, evaluate_correction
from thermaxis.report import fixed

_DECIMALS = 2
_SPACING_ROUNDING = 0.0005
"""Half the last digit of a spacing, on the control with the fewest decimals. [mm or deg]"""
_CLEARLY = 0.5
"""A sign is called wrong where the other one leaves at most this share of the deviations. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class CheckedTable:
    """A control's table beside a run."""

    run: AxisRun
    """The run."""
    table_name: str
    """The table's file."""
    control_name: str
    """Name of the control on the command line."""
    control: Control
    """The control."""
    options: Mapping[str, str]
    """Its options."""
    wanted_axis: str | None
    """Axis that the table must be of; None where that was not said."""
    read: ReadTable
    """What the control reads in it."""
    findings: tuple[str, ...]
    """What looks wrong in the table, or between table and run."""
    measured: CorrectionEffect
    """What the table makes of the readings."""
    without_drift: CorrectionEffect | None
    """The same without drift; None where no drift is seen."""
    opposite: CorrectionEffect
    """What the table with the opposite sign would make of the readings."""


def check(arguments: argparse.Namespace) -> CheckedTable:
    """Read table and run, and simulate."""
    control = control_by_name(arguments.control)
    options = check_options(control, arguments.set, purpose="table")
    wanted_axis: str | None = None if arguments.axis is None else axis_name(arguments.axis)
    run = read_run(arguments.run, axis=None, encoding=arguments.encoding)
    path = Path(arguments.table)
    read = read_older(control, path, run, options)
    if not arguments.no_drift:
        run = with_drift(run)
    correction = control.correction(read.table, run.test.target)
    measured = evaluate_correction(run.test, correction)
    opposite = evaluate_correction(run.test, -correction)
    findings = [
        *read.findings,
        *_axis_findings(run, read, wanted_axis),
        *_range_findings(run, read),
    ]
    findings += _sign_findings(run, measured, opposite)
    return CheckedTable(
        run=run,
        table_name=str(path),
        control_name=arguments.control,
        control=control,
        options=options,
        wanted_axis=wanted_axis,
        read=read,
        findings=tuple(findings),
        measured=measured,
        without_drift=simulated_without_drift(run, correction),
        opposite=opposite,
    )


def _axis_findings(run: AxisRun, read: ReadTable, wanted: str | None) -> list[str]:
    stated, of_run = read.table.axis, "" if run.axis_assumed else run.axis
    expected = of_run if wanted is None else wanted
    if not stated or not expected or stated.casefold() == expected.casefold():
        return []
    shown = printable(stated, 40)
    if wanted is None:
        return [
            (
                f"the table is of axis {shown}, the run of {of_run}: if these are two names of one"
                f" axis, say --axis {shown}"
            )
        ]
    return [f"the table is of axis {shown}, not of {wanted}"]


def _axis_warnings(result: CheckedTable) -> list[str]:
    """Return whether table and run may be of two axes, where that cannot be told."""
    run, stated = result.run, result.read.table.axis
    said: list[str] = []
    if not stated:
        said.append("the table does not name its axis")
    if result.wanted_axis is None and run.axis_refused:
        name = printable(run.axis_refused, 60)
        said.append(f"the run names its axis '{name}', which is no name of an axis on a control")
    elif result.wanted_axis is None and run.axis_assumed:
        said.append("the run does not name its axis")
    if not said:
        return []
    return [f"{' and '.join(said)}: whether both are of the same axis was not checked"]


def _range_findings(run: AxisRun, read: ReadTable) -> list[str]:
    target, position = run.test.target, read.table.position
    unit = run.test.kind.units.position
    # half the last digit of the spacing, once for each, may end the table short of a target
    spacing = np.diff(position)
    near = min(_SPACING_ROUNDING * position.size, 0.01 * float(np.min(spacing, initial=1.0)))
    outside = np.flatnonzero((target < position[0] - near) | (target > position[-1] + near))
    said: list[str] = []
    if read.points_in_file is not None and read.points_in_file > position.size:
        said.append(
            f"the file seems to hold {read.points_in_file} points, the control reads"
            f" {position.size} of them"
        )
    if outside.size:
        said.append(
            f"the table reaches from {position[0]:.9g} to {position[-1]:.9g} {unit} and does not"
            f" cover {outside.size} of {target.size} targets, from {target[outside[0]]:.9g} to"
            f" {target[outside[-1]]:.9g} {unit}: there its end values are held"
        )
    return said


def _sign_findings(
    run: AxisRun, measured: CorrectionEffect, opposite: CorrectionEffect
) -> list[str]:
    """Return whether the opposite sign would leave less: the commonest mistake."""
    unit = run.test.kind.units.deviation
    before, after, flipped = (
        systematic_range(level) for level in (measured.before, measured.after, opposite.after)
    )
    if after < before:
        return []
    grows = (
        f"with the table the range of the mean deviations goes from {before:.{_DECIMALS}f} to"
        f" {after:.{_DECIMALS}f} {unit}"
    )
    other = f"the opposite sign would leave {flipped:.{_DECIMALS}f} {unit}"
    if flipped <= _CLEARLY * before and before > 0.0:
        return [
            f"the sign is wrong for this run: {grows} ({after / before:.1f} times), and {other}"
        ]
    better = f", although {other}" if flipped < before else ""
    return [f"the table does not fit this run: {grows}{better}"]


# ---- text ---------------------------------------------------------------------------------------


def as_text(result: CheckedTable) -> str:
    """Return the result in words and tables, for a terminal."""
    parts = [_head(result), _targets(result)]
    parts.append(effect_table(result.run.test, result.measured, result.without_drift))
    said = [f"finding: {printable(text, 600)}" for text in result.findings]
    if not result.findings:
        said.append("no finding: nothing looks wrong in the table")
    said += [f"warning: {printable(text, 600)}" for text in _warnings(result)]
    parts.append("\n".join(filled(text, hanging=True) for text in said) + "\n")
    return "\n".join(parts)


def _head(result: CheckedTable) -> str:
    table = result.read.table
    units = table.kind.units
    axis = f" of axis {printable(table.axis, 40)}" if table.axis else ""
    every = "" if table.step is None else f", every {table.step:.9g} {units.position}"
    slope, low, high = table.steepest_slope
    lines = [
        (
            f"{printable(result.table_name)}: compensation table{axis}, read as"
            f" {result.control.title} reads it"
        ),
        (
            f"{table.position.size} points from {table.position[0]:.9g} to {table.position[-1]:.9g}"
            f" {units.position}{every}; deviations"
            f" {float(np.min(table.deviation)):+.{_DECIMALS}f} to"
            f" {float(np.max(table.deviation)):+.{_DECIMALS}f} {units.deviation}"
        ),
    ]
    if table.position.size > 1:
        lines.append(
            f"steepest slope {slope:.3g} {units.deviation}/{units.position} from {low:.9g} to"
            f" {high:.9g} {units.position}"
        )
    if table.backlash is not None:
        lines.append(f"reversal apart from the points {table.backlash:+.3f} {units.deviation}")
    lines += [
        f"sign: {result.control.sign}",
        f"unit: {result.control.unit}",
        run_in_words(result.run),
    ]
    return "\n".join(filled(line, hanging=True) for line in lines) + "\n"


def _targets(result: CheckedTable) -> str:
    effect, units = result.measured, result.run.test.kind.units
    sides = [a for a, seen in enumerate(result.run.test.measured_approaches) if seen]
    heads = [units.position]
    for name in ("before", "correction", "after"):
        heads += [f"{name} {'↑↓'[a]}" for a in sides]
    rows: list[list[str]] = []
    for i, place in enumerate(effect.target.tolist()):
        cells = [
            _signed(float(values[i, a]))
            for values in (effect.before, effect.correction, effect.after)
            for a in sides
        ]
        rows.append([f"{place:.3f}", *cells])
    return text_table(f"Mean deviations at the targets, {units.deviation}", heads, rows)


def _signed(value: float) -> str:
    text = fixed(value, _DECIMALS, absent="–")
    return f"+{text}" if value > 0.0 and float(text) != 0.0 else text


def _warnings(result: CheckedTable) -> list[str]:
    run = result.run
    said = [*run.test.remarks, *_axis_warnings(result)]
    if run.drift is None:
        said.append(f"whether the run drifts is not known: {run.why_no_drift}")
    elif run.drift.significant:
        said.append(f"{drift_in_words(run)}: no table removes that; see the figures without drift")
    said.append(
        "the run counts as measured without this table in force; if it was in force, what the run"
        " shows is what the table leaves, and the column before says it"
    )
    said.append(f"temperature of the run: {temperature_in_words(run.test)}")
    return said


# ---- JSON ---------------------------------------------------------------------------------------


def as_json(result: CheckedTable) -> dict[str, object]:
    """Return the result with the keys of the command's JSON."""
    test = result.run.test
    return {
        "version": __version__,
        "input": {"name": result.run.name, "sha256": result.run.sha256},
        "table_file": result.table_name,
        "control": result.control_name,
        "options": dict(result.options),
        "kind": str(test.kind),
        "table": table_as_json(result.read.table),
        "points_in_file": result.read.points_in_file,
        "targets": targets_as_json(result.measured),
        "figures": {
            **figures_as_json(test, result.measured),
            "opposite_sign": figures_as_json(test, result.opposite)["after"],
        },
        "figures_without_drift": None
        if result.without_drift is None
        else figures_as_json(test, result.without_drift),
        "range": {
            "before": finite_or_none(systematic_range(result.measured.before)),
            "after": finite_or_none(systematic_range(result.measured.after)),
            "opposite_sign": finite_or_none(systematic_range(result.opposite.after)),
        },
        "findings": list(result.findings),
        "warnings": _warnings(result),
    }
