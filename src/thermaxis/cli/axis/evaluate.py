"""``thermaxis evaluate``: a measured file in, figures, charts and a certificate out."""

import argparse
import sys
from dataclasses import replace
from datetime import date
from pathlib import Path

from thermaxis import __version__, report
from thermaxis.cli._json import show
from thermaxis.cli._progress import Progress
from thermaxis.codes import printable
from thermaxis.errors import ConfigurationError, DataError
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


def _cycle_number(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is no cycle; they count from 1")
    return int(text)


def _hours(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = -1.0
    if not 0.0 <= number < 1e6:
        raise argparse.ArgumentTypeError(f"'{text}' is no number of hours from 0 on")
    return number


def _date(text: str) -> str:
    try:
        return date.fromisoformat(text).isoformat()
    except ValueError:
        raise argparse.ArgumentTypeError("a date such as 2026-03-31 is expected") from None


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = parser.add_argument
    add("file", metavar="FILE", type=Path, help="measured run: .rtl, CSV, _ISO230.dat or .xlsx")
    add("--json", metavar="FILE|-", help="write all results as JSON; - for standard output alone")
    add(
        "--report",
        metavar="FILE",
        type=Path,
        action="append",
        default=[],
        help="write the certificate, .pdf or .html; may be given more than once",
    )
    add("--figures", metavar="DIR", type=Path, help="write every chart as PNG and SVG, and its CSV")
    add("--header", metavar="FILE", type=Path, help="fields of the certificate's head (TOML)")
    add(
        "--limits", metavar="FILE", type=Path, help="limits of the figures and decision rule (TOML)"
    )
    reference = parser.add_mutually_exclusive_group()
    reference.add_argument(
        "--reference-cycle",
        metavar="N",
        type=_cycle_number,
        help="cycle that anchors the deviation chart (default: the first after two hours, else 1)",
    )
    reference.add_argument(
        "--reference-time",
        metavar="H",
        type=_hours,
        help="after H hours: state of the drift-free levels, and cycle of the deviation chart",
    )
    add(
        "--cycle",
        choices=("standard", "pilgrim", "step"),
        help="kind of test cycle (default: what the file says, else standard)",
    )
    add(
        "--edition",
        choices=("1988", "1997", "2006", "2014", "vdi3441"),
        default="2014",
        help="edition of ISO 230-2 or VDI/DGQ 3441; 1988 and vdi3441 come beside 2014, unverified",
    )
    add("--full", action="store_true", help="s, R and A also on an axis over 2000 mm")
    add("--no-drift", action="store_true", help="leave the drift model out")
    add(
        "--robust", action="store_true", help="leave outliers out of the drift model, and name them"
    )
    add("--budget", metavar="FILE", type=Path, help="terms of the uncertainty budget (TOML)")
    add("--plan", metavar="FILE", type=Path, help="compare the run with its plan (JSON)")
    add(
        "--source-name",
        metavar="TEXT",
        help="name of the measured file in results and certificate (default: its file name)",
    )
    add("--date", metavar="YYYY-MM-DD", type=_date, help="date of the certificate")
    add("--encoding", metavar="NAME", default="cp1250", help="of a text that is not UTF-8")


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
        advice = f". {error.remedy}" if error.remedy else ""
        return None, (f"no drift model: {error.what}{advice}",)
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


def _check_outputs(arguments: argparse.Namespace) -> None:
    """Refuse an output that cannot be written, before anything is read or written."""
    source: Path = arguments.file
    reports: list[Path] = arguments.report
    for path in reports:
        if path.suffix.lower() not in (".pdf", ".html", ".htm"):
            raise ConfigurationError(
                f"a report cannot be written as '{path.suffix or path.name}'",
                where=str(path),
                remedy="End its name in .pdf or .html",
            )
    if arguments.json == "":
        raise ConfigurationError("--json has no name", remedy="Name a file, or - for the output")
    json_files = [] if arguments.json in (None, "-") else [Path(arguments.json)]
    outputs = [*reports, *json_files]
    settings = (arguments.header, arguments.limits, arguments.budget, arguments.plan)
    inputs = [source, *(f for f in settings if f is not None)]
    for k, path in enumerate(outputs):
        if not path.absolute().parent.is_dir():
            raise ConfigurationError(
                "the folder of this output does not exist", where=str(path), remedy="Make it first"
            )
        if path.exists() and any(f.exists() and path.samefile(f) for f in inputs):
            raise ConfigurationError(
                "this output would overwrite an input of the evaluation, such as the measured run",
                where=str(path),
                remedy="Give it another name",
            )
        if path.absolute() in [other.absolute() for other in outputs[:k]]:
            raise ConfigurationError(
                "two outputs have the same name", where=str(path), remedy="Rename one of them"
            )
    if arguments.figures is not None and arguments.figures.is_file():
        raise ConfigurationError(
            "the charts need a folder, and this is a file",
            where=str(arguments.figures),
            remedy="Name a folder; it is made if it does not exist",
        )


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
    _check_outputs(arguments)
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
