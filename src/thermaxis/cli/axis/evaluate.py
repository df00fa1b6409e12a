"""Evaluate a positioning run: ISO 230-2 and adjacent differences."""

import argparse
import sys
from collections.abc import Callable
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import TypeVar

from thermaxis import __version__, files, positioning, report
from thermaxis.cli._arguments import (
    add_figures,
    add_json,
    add_report,
    adder,
    count,
    day,
    hours,
)
from thermaxis.cli._json import show
from thermaxis.cli._outputs import REPORT_SUFFIXES, check_outputs
from thermaxis.cli._progress import Progress
from thermaxis.cli._reading import Reading, add_reading, reading_of
from thermaxis.codes import NOWHERE, Message, printable
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.files import RunColumn, RunMapping
from thermaxis.messages import remedy_of, sentence_of
from thermaxis.positioning import Cycle, Edition, PositioningTest
from thermaxis.report import PositioningReport
from thermaxis.report.tables import describe_evaluation, summary_of

_LONGEST_SOURCE_NAME = 200
_LONGEST_WARNING = 1000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("file FILE", "measured run: .rtl, CSV, Markdown, _ISO230.dat, .xlsx or .xls", Path)
    add("--full-tables", "show every table below the summary", bool)
    add_json(parser)
    add_report(parser, "certificate", ".pdf, .html or .xml (Digital Calibration Certificate)")
    add_figures(parser, "every chart as PNG and SVG, and its CSV")
    add(
        "--header FILE",
        "fields of the certificate's head, TOML (default: what the run's file states)",
        Path,
    )
    add(
        "--limits FILE",
        "limits of the figures and the decision rule, TOML (default: no verdict)",
        Path,
    )
    reference = adder(parser.add_mutually_exclusive_group())
    reference(
        "--reference-cycle N",
        "cycle that anchors the deviation chart (default: the first after two hours, else 1)",
        count("cycle", 1),
    )
    reference(
        "--reference-time H",
        "hours from the first reading, within the run. The drift-free figures are those of the"
        " thermal state then, and the deviation chart is anchored at the first cycle that"
        " starts then or later; needs times; not together with the option above (default:"
        " figures: mean time of the readings; chart: as above)",
        hours,
    )
    add(
        "--cycle",
        "kind of test cycle (default: what the file says, else standard)",
        choices=("standard", "pilgrim", "step"),
    )
    add(
        "--edition",
        "edition of ISO 230-2 whose names the figures carry; 1988 and vdi3441 (VDI/DGQ 3441) come"
        " beside 2014, unverified (default: 2014)",
        choices=("1988", "1997", "2006", "2014", "vdi3441"),
        default="2014",
    )
    add("--full", "s, R and A also on an axis over 2000 mm", bool)
    add(
        "--no-drift",
        "leave the drift model and the diagnosis out",
        bool,
    )
    add(
        "--budget FILE",
        "what is known of instrument and environment, TOML (default: noise and drift alone)",
        Path,
    )
    add(
        "--plan FILE",
        "compare the run with its plan, JSON of thermaxis plan; differences become warnings",
        Path,
    )
    add(
        "--source-name TEXT",
        "name of the measured file in results and certificate (default: its file name)",
    )
    add("--final", "refuse a certificate without a field of its head that it must have", bool)
    add("--date YYYY-MM-DD", "date of issue of the certificate (default: that of --header)", day)
    add_reading(parser, "a text")


_Result = TypeVar("_Result")


def _attempted(
    evaluate: Callable[[], _Result], lacking: str, warnings: list[Message]
) -> _Result | None:
    """Return a result; where it cannot be formed, say so and go on."""
    try:
        return evaluate()
    except DataError as error:
        why = error.at(NOWHERE).message
        remedy = Message(f"{why.code}.remedy", why.values) if remedy_of(why) else ""
        warnings.append(Message(lacking, {"error": why, "remedy": remedy}))
        return None


def _drift(
    arguments: argparse.Namespace, test: PositioningTest, warnings: list[Message]
) -> positioning.DriftResult | None:
    """Separate the drift; where it cannot be told from the levels, say so and go on."""
    time_s = _reference_time_s(arguments)
    separate = partial(positioning.evaluate_drift, test, reference_time_s=time_s)
    drift = _attempted(separate, "warning-no_drift_model", warnings)
    if drift is None:
        return None
    warnings += drift.warnings
    return drift


def _reference_time_s(arguments: argparse.Namespace) -> float | None:
    hours: float | None = arguments.reference_time
    return None if hours is None else 3600.0 * hours


def _adjacent_difference(
    arguments: argparse.Namespace, test: PositioningTest, warnings: list[Message]
) -> positioning.AdjacentDifferenceResult | None:
    """Evaluate the adjacent differences; a stated reference that the run lacks is an error."""
    cycle, time_s = arguments.reference_cycle, _reference_time_s(arguments)
    if cycle is not None or time_s is not None:
        result = positioning.evaluate_adjacent_difference(
            test, reference_cycle=cycle, reference_time_s=time_s
        )
    else:
        without_reference = partial(positioning.evaluate_adjacent_difference, test)
        result = _attempted(without_reference, "warning-no_adjacent_differences", warnings)
    warnings += () if result is None else result.warnings
    return result


def _options(arguments: argparse.Namespace, reading: Reading) -> dict[str, object]:
    """Return how the file was read and the run evaluated, where not as by default."""
    stated = {
        "edition": arguments.edition,
        "encoding": reading["fallback_encoding"],
        "cycle": arguments.cycle,
        "reference_cycle": arguments.reference_cycle,
        "reference_time_h": arguments.reference_time,
        "full": arguments.full or None,
        "no_drift": arguments.no_drift or None,
        **_stated(reading["mapping"]),
    }
    return {key: value for key, value in stated.items() if value not in (None, "2014", "cp1250")}


def _stated(mapping: RunMapping | RunColumn) -> dict[str, object]:
    """Return the fields that a user stated."""
    nothing = type(mapping)()
    values = {field.name: getattr(mapping, field.name) for field in fields(mapping)}
    stated = {key: value for key, value in values.items() if value != getattr(nothing, key)}
    if isinstance(mapping, RunMapping):
        stated["columns"] = {name: _stated(one) for name, one in mapping.columns.items()}
        stated["directions"] = dict(mapping.directions)
    return {key: value for key, value in stated.items() if value != {}}


def evaluate(arguments: argparse.Namespace) -> PositioningReport:
    """Read and evaluate the run that the arguments name."""
    path: Path = arguments.file
    reading = reading_of(arguments)
    test, sha256 = files.read_positioning_with_sha256(path, **reading)
    warnings = [*test.remarks]
    if arguments.cycle is not None:
        stated, test = test.cycle, test.with_cycle(Cycle(arguments.cycle))
        if stated not in {Cycle.STANDARD, test.cycle}:
            values = {"stated": stated, "cycle": test.cycle}
            warnings.append(Message("warning-cycle_of_option", values))
    other = {
        "1988": positioning.evaluate_iso230_2_1988,
        "vdi3441": positioning.evaluate_vdi_dgq_3441,
    }.get(arguments.edition)
    edition = Edition(arguments.edition) if other is None else Edition.E2014
    iso230_2 = positioning.evaluate_iso230_2(test, edition=edition, full=arguments.full)
    conditions = positioning.check_test_conditions(test)
    warnings += conditions
    if iso230_2.single_run_rule:
        warnings.append(Message("warning-single_run_rule", {"cycles": test.cycles}))
    adjacent = _adjacent_difference(arguments, test, warnings)
    other_standard = None
    if other is not None:
        lacking = "warning-no_figures_of_other_standard"
        other_standard = _attempted(lambda: other(test), lacking, warnings)
    drift = None if arguments.no_drift else _drift(arguments, test, warnings)
    budget = plan_differences = None
    if arguments.budget is not None:
        budget = files.read_budget(arguments.budget, test.kind)
    uncertainty = positioning.evaluate_uncertainty(test, drift, budget=budget)
    if arguments.plan is not None:
        plan_differences = positioning.check_against_plan(test, files.read_plan(arguments.plan))
        warnings += plan_differences
    limits = against_cycles = None
    if arguments.limits:
        stated = files.read_figure_limits(arguments.limits, test.kind)
        uncertainty = uncertainty.with_stated(stated.expanded_uncertainty)
        limits = report.check_limits(stated, iso230_2, uncertainty.measured)
    header = dict(test.header)
    if arguments.header:
        header |= files.read_header(arguments.header, kind=test.kind)
    wants_charts = bool(arguments.report or arguments.figures)
    if wants_charts and test.cycles > 1:
        against_cycles = positioning.evaluate_against_cycles(test)
    evaluated = PositioningReport(
        test=test,
        iso230_2=iso230_2,
        adjacent_difference=adjacent,
        against_cycles=against_cycles,
        other_standard=other_standard,
        warnings=tuple(warnings),
        conditions=conditions,
        header=header,
        limits=limits,
        drift=drift,
        uncertainty=uncertainty,
        diagnosis=() if arguments.no_drift else positioning.diagnose(test, drift),
        plan_differences=plan_differences,
        source_name=printable(arguments.source_name or path.name, _LONGEST_SOURCE_NAME),
        source_sha256=sha256,
        version=__version__,
        date=arguments.date,
        options=_options(arguments, reading),
    )
    noticed = [*evaluated.warnings, *evaluated.impossible_dates]
    noticed += report.unshowable(evaluated) if wants_charts else ()
    return replace(evaluated, warnings=tuple(noticed))


def _check_complete(arguments: argparse.Namespace, evaluated: PositioningReport) -> None:
    """Refuse a draft that is to be final; say of a digital certificate that it is a draft."""
    missing = ", ".join(evaluated.missing_fields)
    if missing and arguments.final:
        raise ConfigurationError(
            "certificate_incomplete", file=arguments.header or "", key="--final", missing=missing
        )
    if arguments.final and (dates := evaluated.impossible_dates):
        raise ConfigurationError(
            "certificate_date_impossible",
            file=arguments.header or "",
            key=str(dates[0].values["key"]),
            dates=dates,
        )
    if missing and any(path.suffix.lower() == ".xml" for path in arguments.report):
        draft = sentence_of(Message("warning-draft", {"missing": missing}))
        sys.stderr.write(f"warning: {printable(draft, _LONGEST_WARNING)}\n")


def run(arguments: argparse.Namespace) -> int:
    """Run the command."""
    check_outputs(
        [("--json", arguments.json), *(("--report", path) for path in arguments.report)],
        [
            *(arguments.file, arguments.header, arguments.limits, arguments.budget),
            *(arguments.plan, arguments.map),
        ],
        charts=arguments.figures,
        report_suffixes=(*REPORT_SUFFIXES, ".xml"),
    )
    quiet = arguments.json == "-"
    reports: list[Path] = arguments.report
    with Progress() as progress:
        progress("reading and evaluating", 0, 0)
        evaluated = evaluate(arguments)
        _check_complete(arguments, evaluated)
        if not quiet:
            progress.hide()
            sys.stdout.write(summary_of(evaluated))
            everything = describe_evaluation(evaluated)
            show(everything, arguments.json, quiet=not arguments.full_tables)
        if reports:
            report.write_report(evaluated, *reports, progress=progress)
        if arguments.figures is not None:
            report.write_figures(evaluated, arguments.figures, progress=progress)
    if quiet:  # one value alone: the result, or the error of a report
        show(describe_evaluation(evaluated), arguments.json)
    if not quiet:
        written = [*reports, *([] if arguments.figures is None else [arguments.figures])]
        sys.stdout.write("".join(f"written: {path}\n" for path in written))
    return 0
