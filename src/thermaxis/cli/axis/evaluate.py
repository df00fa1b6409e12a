"""``thermaxis evaluate``: a measured file in, figures, charts and a certificate out."""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from thermaxis import __version__, report
from thermaxis.cli._arguments import (
    add_encoding,
    add_figures,
    add_json,
    add_report,
    adder,
    count,
    day,
    hours,
)
from thermaxis.cli._json import show
from thermaxis.cli._outputs import check_outputs
from thermaxis.cli._progress import Progress
from thermaxis.codes import NOWHERE, printable
from thermaxis.errors import DataError
from thermaxis.files import (
    read_budget,
    read_figure_limits,
    read_header,
    read_plan,
    read_positioning_with_sha256,
)
from thermaxis.positioning import (
    APPROACHES,
    AdjacentDifferenceResult,
    Cycle,
    DriftResult,
    Edition,
    Finding,
    Iso230_2_1988Result,
    Iso230_2Result,
    PositioningTest,
    UncertaintyResult,
    Vdi3441Result,
    check_against_plan,
    check_test_conditions,
    diagnose,
    evaluate_adjacent_difference,
    evaluate_against_cycles,
    evaluate_drift,
    evaluate_iso230_2,
    evaluate_iso230_2_1988,
    evaluate_uncertainty,
    evaluate_vdi_dgq_3441,
)
from thermaxis.report import PositioningReport
from thermaxis.report.tables import describe_evaluation

_LONGEST_SOURCE_NAME = 200


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("file FILE", "measured run: .rtl, CSV, _ISO230.dat or .xlsx", Path)
    add_json(parser)
    add_report(parser, "certificate")
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
        "hours from the first reading, within the run. The drift-free levels are those of the"
        " thermal state then, and the deviation chart is anchored at the first cycle that"
        " starts then or later; needs times; not together with the option above (default:"
        " levels: mean time of the readings; chart: as above)",
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
        "leave the drift model and the diagnosis out, and the uncertainties unless a budget"
        " is given",
        bool,
    )
    add("--robust", "leave outliers out of the drift model, and name them", bool)
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
    add("--date YYYY-MM-DD", "date of the certificate", day)
    add_encoding(parser, "a text")


def _other_standard(
    edition: str, test: PositioningTest
) -> tuple[Iso230_2_1988Result | Vdi3441Result | None, tuple[str, ...]]:
    try:
        if edition == "1988":
            return evaluate_iso230_2_1988(test), ()
        if edition == "vdi3441":
            return evaluate_vdi_dgq_3441(test), ()
    except DataError as error:
        return None, (f"no figures of the other standard: {error}",)
    return None, ()


def _adjacent_difference(
    arguments: argparse.Namespace, test: PositioningTest
) -> tuple[AdjacentDifferenceResult | None, tuple[str, ...]]:
    """Evaluate the adjacent differences; where they cannot be formed, say so and go on.

    A reference that the user names and the run does not have is an error all the same.
    """
    hours: float | None = arguments.reference_time
    try:
        result = evaluate_adjacent_difference(
            test,
            reference_cycle=arguments.reference_cycle,
            reference_time_s=None if hours is None else hours * 3600.0,
        )
    except DataError as error:
        if hours is not None or arguments.reference_cycle is not None:
            raise
        return None, (f"no adjacent differences: {error}",)
    return result, result.warnings


def _drift(
    arguments: argparse.Namespace, test: PositioningTest
) -> tuple[DriftResult | None, tuple[str, ...]]:
    """Separate the drift; where it cannot be told from the levels, say so and go on."""
    if arguments.no_drift:
        return None, ()

    hours: float | None = arguments.reference_time
    time_s = None if hours is None else hours * 3600.0
    try:
        result = evaluate_drift(test, reference_time_s=time_s, robust=arguments.robust)
    except DataError as error:
        return None, (f"no drift model: {error.at(NOWHERE)}",)
    unit = test.kind.units.deviation
    outliers = tuple(
        f"the reading of target {o.target} {APPROACHES[o.approach]} in cycle {o.cycle} lies"
        f" {o.residual:+.3g} {unit} from the drift model and was left out of it"
        for o in result.outliers
    )
    return result, (*result.warnings, *outliers)


def _uncertainty_and_diagnosis(
    arguments: argparse.Namespace, test: PositioningTest, drift: DriftResult | None
) -> tuple[UncertaintyResult | None, tuple[Finding, ...]]:
    if arguments.no_drift and arguments.budget is None:
        return None, ()

    budget = None if arguments.budget is None else read_budget(arguments.budget, test.kind)
    uncertainty = evaluate_uncertainty(test, drift, budget=budget)
    return uncertainty, () if arguments.no_drift else diagnose(test, drift)


def _against_plan(arguments: argparse.Namespace, test: PositioningTest) -> tuple[str, ...] | None:
    if arguments.plan is None:
        return None

    return check_against_plan(test, read_plan(arguments.plan))


def _single_run_warning(iso230_2: Iso230_2Result, test: PositioningTest) -> tuple[str, ...]:
    if not iso230_2.single_run_rule:
        return ()
    more = f" although {test.cycles} runs exist (means of all of them)" if test.cycles > 1 else ""
    rule = f"the axis is longer than 2000 mm: s, R and A are not evaluated{more}"
    return (f"{rule}; ask for them with --full",)


def evaluate(arguments: argparse.Namespace) -> PositioningReport:
    """Read and evaluate the run that the arguments name."""
    path: Path = arguments.file
    test, sha256 = read_positioning_with_sha256(path, fallback_encoding=arguments.encoding)
    stated_cycle = test.cycle
    if arguments.cycle is not None:
        test = test.with_cycle(Cycle(arguments.cycle))
    other = arguments.edition in ("1988", "vdi3441")
    edition = Edition.E2014 if other else Edition(arguments.edition)
    iso230_2 = evaluate_iso230_2(test, edition=edition, full=arguments.full)
    conditions = check_test_conditions(test)
    warnings = [*test.remarks]
    if stated_cycle is not Cycle.STANDARD and stated_cycle is not test.cycle:
        warnings.append(f"the file names a {stated_cycle} cycle, the option a {test.cycle} cycle")
    warnings += [*conditions, *_single_run_warning(iso230_2, test)]
    adjacent, said = _adjacent_difference(arguments, test)
    other_standard, also_said = _other_standard(arguments.edition, test)
    drift, drift_said = _drift(arguments, test)
    uncertainty, diagnosis = _uncertainty_and_diagnosis(arguments, test, drift)
    plan_differences = _against_plan(arguments, test)
    warnings += (*said, *also_said, *drift_said, *(plan_differences or ()))
    wants_charts = bool(arguments.report or arguments.figures)
    limits = read_figure_limits(arguments.limits, test.kind) if arguments.limits else None
    stated: dict[str, str] = {}
    if arguments.header:
        stated.update(read_header(arguments.header, kind=test.kind))
    evaluated = report.PositioningReport(
        test=test,
        iso230_2=iso230_2,
        adjacent_difference=adjacent,
        against_cycles=evaluate_against_cycles(test) if wants_charts and test.cycles > 1 else None,
        other_standard=other_standard,
        warnings=tuple(warnings),
        conditions=conditions,
        header={**test.header, **stated},
        limits=report.check_limits(limits, iso230_2) if limits else None,
        drift=drift,
        uncertainty=uncertainty,
        diagnosis=diagnosis,
        plan_differences=plan_differences,
        source_name=printable(arguments.source_name, _LONGEST_SOURCE_NAME)
        if arguments.source_name
        else path.name,
        source_sha256=sha256,
        version=__version__,
        date=arguments.date,
    )
    if not wants_charts:
        return evaluated
    return replace(evaluated, warnings=(*evaluated.warnings, *report.unshowable(evaluated)))


def run(arguments: argparse.Namespace) -> int:
    """Run the command."""
    check_outputs(
        [("--json", arguments.json), *(("--report", path) for path in arguments.report)],
        [arguments.file, arguments.header, arguments.limits, arguments.budget, arguments.plan],
        charts=arguments.figures,
    )
    quiet = arguments.json == "-"
    with Progress() as progress:
        progress("reading and evaluating", 0, 0)
        evaluated = evaluate(arguments)
        if not quiet:
            progress.hide()
        show(describe_evaluation(evaluated), arguments.json)
        written = _write_outputs(evaluated, arguments, progress)
    if not quiet:
        sys.stdout.write("".join(f"written: {path}\n" for path in written))
    return 0


def _write_outputs(
    evaluated: PositioningReport, arguments: argparse.Namespace, progress: Progress
) -> list[Path]:
    written: list[Path] = []
    reports: list[Path] = arguments.report
    for path in reports:
        report.write_report(evaluated, path, progress=progress)
        written.append(path)
    if arguments.figures is not None:
        report.write_figures(evaluated, arguments.figures, progress=progress)
        written.append(arguments.figures)
    return written
