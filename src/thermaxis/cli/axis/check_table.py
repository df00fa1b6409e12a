"""Read a compensation table as its control reads it, and name what looks wrong in it.

By simulation of that control it is shown what the table leaves of a measured run, which counts as
measured without it.
"""

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np

from thermaxis import __version__
from thermaxis.cli._arguments import add_json, adder
from thermaxis.cli._json import show
from thermaxis.cli._outputs import check_outputs
from thermaxis.cli._progress import Progress
from thermaxis.cli._reading import add_reading, reading_of
from thermaxis.cli.axis.tables.control import add_control, axis_name
from thermaxis.cli.axis.tables.described import (
    effect_in_words,
    effects,
    slope_in_words,
    table_of,
    targets_of,
)
from thermaxis.cli.axis.tables.in_force import read_older
from thermaxis.cli.axis.tables.run import (
    AxisRun,
    drift_warning,
    read_run,
    run_in_words,
    shown_figures,
    simulated_without_drift,
    systematic_range,
    table_warning,
    temperature_in_words,
    with_drift,
)
from thermaxis.codes import Message, printable
from thermaxis.controls import Control, ReadTable, check_options, control_by_name, finding
from thermaxis.messages import text_of
from thermaxis.positioning import CorrectionEffect, evaluate_correction
from thermaxis.report.tables import Part, Section, Value, messages_of

_SPACING_ROUNDING = 0.0005
"""Half the last digit of a spacing, on the control with the fewest decimals. [mm or deg]"""
_CLEARLY = 0.5
"""A sign is called wrong where the other one leaves at most this share of the deviations. [1]"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
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
    add_reading(parser)


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

    arguments: argparse.Namespace
    run: AxisRun
    control: Control
    options: Mapping[str, str]
    read: ReadTable
    """What the control reads in the table."""
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
    if arguments.axis is not None:
        axis_name(arguments.axis)
    run = read_run(arguments.run, axis=None, reading=reading_of(arguments))
    read = read_older(control, arguments.table, run, options)
    if not arguments.no_drift:
        run = with_drift(run)
    correction = control.correction(read.table, run.test.target)
    return CheckedTable(
        arguments=arguments,
        run=run,
        control=control,
        options=options,
        read=read,
        measured=evaluate_correction(run.test, correction),
        without_drift=simulated_without_drift(run, correction),
        opposite=evaluate_correction(run.test, -correction),
    )


def findings_of(result: CheckedTable) -> Iterator[Message]:
    """Return what looks wrong in the table, or between table and run."""
    yield from result.read.findings
    run, axis, wanted = result.run, result.read.table.axis, result.arguments.axis
    of_run = "" if run.axis_assumed else run.axis
    expected = of_run if wanted is None else wanted
    if axis and expected and axis.casefold() != expected.casefold():
        if wanted is None:
            yield finding("axis_of_run_differs", axis=axis, of_run=of_run)
        else:
            yield finding("axis_differs", axis=axis, wanted=wanted)
    yield from _range_findings(run, result.read)
    yield from _sign_findings(result)


def _range_findings(run: AxisRun, read: ReadTable) -> Iterator[Message]:
    target, position = run.test.target, read.table.position
    # half the last digit of the spacing, once for each, may end the table short of a target
    spacing = np.diff(position)
    near = min(_SPACING_ROUNDING * position.size, 0.01 * float(np.min(spacing, initial=1.0)))
    outside = target[(target < position[0] - near) | (target > position[-1] + near)]
    if read.points_in_file is not None and read.points_in_file > position.size:
        yield finding("points_not_read", in_file=read.points_in_file, points=position.size)
    if outside.size:
        yield finding(
            "targets_not_covered",
            first=float(position[0]),
            last=float(position[-1]),
            outside=outside.size,
            targets=target.size,
            first_outside=float(outside[0]),
            last_outside=float(outside[-1]),
            unit=run.test.kind.units.position,
        )


def _sign_findings(result: CheckedTable) -> Iterator[Message]:
    """Return whether the opposite sign would leave less: the commonest mistake."""
    unit = result.run.test.kind.units.deviation
    before, after = map(systematic_range, (result.measured.before, result.measured.after))
    opposite = systematic_range(result.opposite.after)
    if after < before:
        return
    if opposite <= _CLEARLY * before and before > 0.0:
        times = after / before
        yield finding(
            "sign_wrong", before=before, after=after, times=times, opposite=opposite, unit=unit
        )
    else:
        yield finding("does_not_fit", before=before, after=after, opposite=opposite, unit=unit)


def warnings_of(result: CheckedTable) -> Iterator[Message]:
    """Return what the user of a table must know."""
    run, drift = result.run, result.run.drift
    if not result.read.table.axis:
        yield table_warning("axis_of_table_unnamed")
    if result.arguments.axis is None and run.axis_refused:
        yield table_warning("axis_of_run_unusable", stated=run.axis_refused)
    elif result.arguments.axis is None and run.axis_assumed:
        yield table_warning("axis_of_run_unnamed")
    if drift is None:
        yield table_warning("drift_unknown", cause=run.why_no_drift)
    elif drift.significant:
        yield drift_warning("drift_not_removed", run, drift)
    yield table_warning("not_in_force_during_run")
    yield table_warning("temperature_of_run", temperature=temperature_in_words(run.test))


def described(result: CheckedTable) -> list[Part]:
    """Return what was found for terminal and JSON."""
    run, measured = result.run, result.measured
    findings = list(findings_of(result))
    nothing = [] if findings else ["no finding: nothing looks wrong in the table"]
    ranges = {"before": measured.before, "after": measured.after}
    ranges["opposite_sign"] = result.opposite.after
    return [
        Value("version", __version__),
        Value("input", {"name": run.name, "sha256": run.sha256}),
        Value("table_file", str(result.arguments.table)),
        Value("control", result.arguments.control),
        Value("options", result.options),
        Value("kind", str(run.test.kind)),
        Section("", [*nothing, *messages_of("findings", findings, "finding")]),
        *_head(result),
        table_of(result.read.table),
        Value("points_in_file", result.read.points_in_file),
        targets_of(run.test, measured, "Mean deviations at the targets"),
        effects(run.test, measured, result.without_drift),
        Value("figures.opposite_sign", shown_figures(run.test, result.opposite.figures_after)),
        Value("range", {key: systematic_range(level) for key, level in ranges.items()}),
        *messages_of("warnings", [*run.test.remarks, *warnings_of(result)], "warning"),
    ]


def _head(result: CheckedTable) -> Iterator[str]:
    table = result.read.table
    units = table.kind.units
    axis = f" of axis {printable(table.axis, 40)}" if table.axis else ""
    every = "" if table.step is None else f", every {table.step:.9g} {units.position}"
    name, title = result.arguments.table, result.control.title
    yield f"{name}: compensation table{axis}, read as {title} reads it"
    yield effect_in_words(result.run.test, result.measured)
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
