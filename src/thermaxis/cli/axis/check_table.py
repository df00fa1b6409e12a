"""``thermaxis check-table``: read a control's table back, and show what it leaves of a run."""

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np

from thermaxis import __version__
from thermaxis.cli._arguments import add_encoding, add_json, adder
from thermaxis.cli._json import show
from thermaxis.cli._outputs import check_outputs
from thermaxis.cli._progress import Progress
from thermaxis.cli.axis.tables.control import add_control, axis_name
from thermaxis.cli.axis.tables.described import (
    effects,
    finding_codes,
    found_in,
    slope_in_words,
    table_of,
    targets_of,
)
from thermaxis.cli.axis.tables.in_force import read_older
from thermaxis.cli.axis.tables.run import (
    AxisRun,
    drift_in_words,
    read_run,
    run_in_words,
    shown_figures,
    simulated_without_drift,
    systematic_range,
    temperature_in_words,
    with_drift,
)
from thermaxis.codes import printable
from thermaxis.controls import Control, ReadTable, check_options, control_by_name
from thermaxis.messages import text_of
from thermaxis.positioning import CorrectionEffect, evaluate_correction
from thermaxis.report.tables import Part, Section, Value

_DESCRIPTION = """\
Read a compensation table as its control reads it, name what looks wrong in it, and show by
simulation of that control what it leaves of a measured run. The run counts as measured without it.
"""
_DECIMALS = 2
_SPACING_ROUNDING = 0.0005
"""Half the last digit of a spacing, on the control with the fewest decimals. [mm or deg]"""
_CLEARLY = 0.5
"""A sign is called wrong where the other one leaves at most this share of the deviations. [1]"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.description = _DESCRIPTION
    add = adder(parser)
    add("table TABLE", "compensation table of the control", Path)
    add("run RUN", "measured run: .rtl, CSV, _ISO230.dat or .xlsx", Path)
    add_control(parser)
    add(
        "--axis NAME",
        "axis that the table must be of; another one is a finding (default: that of the run;"
        " where file or run name none, that is said)",
    )
    add(
        "--no-drift",
        "leave the drift model and the figures without drift out: faster by far for thousands"
        " of readings (default: the drift model is fitted)",
        bool,
    )
    add_json(parser)
    add_encoding(parser)


def run(arguments: argparse.Namespace) -> int:
    """Check the table, and show what it leaves."""
    check_outputs([("--json", arguments.json)], [arguments.table, arguments.run])
    with Progress() as progress:
        step = "checking the table"
        progress(step if arguments.no_drift else f"{step}, with the drift of the run", 0, 0)
        result = check(arguments)
    show(described(result), arguments.json)
    return 0


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
        *found_in(read),
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


def described(result: CheckedTable) -> list[Part]:
    """Return what was found for terminal and JSON."""
    run, measured = result.run, result.measured
    findings = result.findings or ("nothing looks wrong in the table",)
    ranges = {"before": measured.before, "after": measured.after}
    ranges["opposite_sign"] = result.opposite.after
    return [
        Value("version", __version__),
        Value("input", {"name": run.name, "sha256": run.sha256}),
        Value("table_file", result.table_name),
        Value("control", result.control_name),
        Value("options", result.options),
        Value("kind", str(run.test.kind)),
        *_head(result),
        table_of(result.read.table),
        Value("points_in_file", result.read.points_in_file),
        targets_of(run.test, measured, "Mean deviations at the targets"),
        effects(run.test, measured, result.without_drift),
        Value("figures.opposite_sign", shown_figures(run.test, result.opposite.figures_after)),
        Value("range", {key: systematic_range(level) for key, level in ranges.items()}),
        Section("", [Value("", findings, "finding" if result.findings else "no finding")]),
        Value("findings", result.findings),
        Value("finding_codes", finding_codes(result.read)),
        Value("warnings", _warnings(result), "warning"),
    ]


def _head(result: CheckedTable) -> Iterator[str]:
    table = result.read.table
    units = table.kind.units
    axis = f" of axis {printable(table.axis, 40)}" if table.axis else ""
    every = "" if table.step is None else f", every {table.step:.9g} {units.position}"
    yield f"{result.table_name}: compensation table{axis}, read as {result.control.title} reads it"
    yield (
        f"{table.position.size} points from {table.position[0]:.9g} to {table.position[-1]:.9g}"
        f" {units.position}{every}; deviations {float(np.min(table.deviation)):+.2f} to"
        f" {float(np.max(table.deviation)):+.2f} {units.deviation}"
    )
    if table.position.size > 1:
        yield slope_in_words(table)
    if table.backlash is not None:
        yield f"reversal apart from the points {table.backlash:+.3f} {units.deviation}"
    yield f"sign: {text_of(result.control.sign)}"
    yield f"unit: {text_of(result.control.unit)}"
    yield run_in_words(result.run)


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
