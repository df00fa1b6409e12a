"""Plan a thermal test so that a model is sure soon; evaluate a log after ISO 230-3.

plan: when to switch which source of heat, and how sure a model will be after each hour. places:
which few of many places of sensors a model needs. evaluate: the four tests of ISO 230-3; its set-up
says which channels the probes, the room and the speed are. Logs are read as by verify: what is no
measurement is masked, a displacement that was re-zeroed is joined, and it is said.
"""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from thermaxis import __version__, files, report, thermal
from thermaxis.cli._arguments import add_figures, add_json, add_report, adder, day
from thermaxis.cli._json import show
from thermaxis.cli._outputs import REPORT_SUFFIXES, check_outputs
from thermaxis.cli._progress import Progress
from thermaxis.cli.thermal._test_plan import add_places, add_plan, run_places, run_plan
from thermaxis.cli.thermal._thermal_logs import (
    add_log_options,
    entries_of,
    logs_of,
    reading_codes,
)
from thermaxis.codes import Message, printable
from thermaxis.report import CompensationCase, ThermalTestReport
from thermaxis.report.tables import describe_thermal_test
from thermaxis.thermal import ThermalTest, ThermalTestKind

_LONGEST_SOURCE_NAME = 200
_OF_SETUP = {
    f"warning-thermal_test_{told}" for told in ("probes_missing", "without_ambient", "not_stated")
}
"""What is told of the set-up is the same of every log."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    evaluate = actions.add_parser(
        "evaluate", help="ranges, tilts and temperatures of a log, with U", allow_abbrev=False
    )
    add = adder(evaluate)
    add("log LOG", "log of the test: CSV, Parquet, .xlsx, .mat or .tdms", Path)
    add(
        "--kind",
        "which test: nothing moves, or a spindle, a linear or a rotary axis does",
        ThermalTestKind,
        choices=tuple(ThermalTestKind),
        required=True,
    )
    add("--setup FILE", "channels of probes, room and speed, TOML", Path, required=True)
    add("--model MODEL", "what this model would have left in free run stands beside (JSON)", Path)
    add("--in-force LOG", "the same test with compensation in force stands beside", Path)
    add_json(evaluate)
    add_report(evaluate, "certificate", ".pdf, .html or .xml (Digital Calibration Certificate)")
    add_figures(evaluate)
    add("--header FILE", "fields of the certificate's head, TOML (default: none, a draft)", Path)
    add("--date YYYY-MM-DD", "date of issue of the certificate (default: that of --header)", day)
    add_log_options(evaluate)
    plan = "when to switch which source, and how sure a model will be"
    add_plan(actions.add_parser("plan", help=plan, allow_abbrev=False))
    places = "which few of many places of sensors a model needs"
    add_places(actions.add_parser("places", help=places, allow_abbrev=False))


def run(arguments: argparse.Namespace) -> int:
    """Do what is asked for."""
    actions = {"plan": run_plan, "places": run_places, "evaluate": _evaluate}
    return actions[arguments.action](arguments)


def _evaluate(arguments: argparse.Namespace) -> int:
    """Evaluate, show and write."""
    inputs = [arguments.log, arguments.setup, arguments.model, arguments.in_force]
    check_outputs(
        [("--json", arguments.json), *(("--report", path) for path in arguments.report)],
        [*inputs, arguments.header, arguments.mapping],
        charts=arguments.figures,
        report_suffixes=(*REPORT_SUFFIXES, ".xml"),
    )
    written = [*arguments.report]
    with Progress() as progress:
        progress("reading and evaluating", 0, 0)
        evaluated, logs = _evaluated(arguments)
        progress("pages and charts", 0, 0)
        if written:
            report.write_thermal_test_report(evaluated, *written)
        if arguments.figures is not None:
            report.write_thermal_test_figures(evaluated, arguments.figures)
            written.append(arguments.figures)
    show([*describe_thermal_test(evaluated), reading_codes(logs)], arguments.json, written)
    return 0


def _evaluated(
    arguments: argparse.Namespace,
) -> tuple[ThermalTestReport, list[thermal.ThermalLog]]:
    setup = files.read_thermal_test_setup(arguments.setup)
    kind: ThermalTestKind = arguments.kind
    (measured,) = entries_of(arguments, [arguments.log])
    logs, tests = [measured.log], dict[CompensationCase, ThermalTest]()
    tests[CompensationCase.MEASURED] = thermal.evaluate_thermal_test(measured.log, kind, setup)
    warnings: list[Message] = []
    sha256 = None
    if arguments.model is not None:
        model = files.read_model(arguments.model)
        sha256 = files.model_sha256(model)
        left, told = thermal.left_by_model(
            measured.log, kind, setup, model, reference_s=arguments.reference
        )
        warnings += told
        if measured.training.sha256 in {one.sha256 for one in model.provenance.logs}:
            warnings.append(Message("warning-thermal_test_of_training"))
        case = CompensationCase.LEFT_BY_MODEL
        tests[case] = thermal.evaluate_thermal_test(left, kind, setup, read=measured.log)
    if arguments.in_force is not None:
        logs += logs_of(arguments, [arguments.in_force])
        tests[CompensationCase.IN_FORCE] = thermal.evaluate_thermal_test(logs[-1], kind, setup)
    header: Mapping[str, str] = (
        {} if arguments.header is None else files.read_header(arguments.header)
    )
    evaluated = ThermalTestReport(
        cases=tests,
        log=measured.log,
        setup=setup,
        model_sha256=sha256,
        header=header,
        date=arguments.date,
        warnings=_alike(logs, tests, warnings),
        source_name=printable(arguments.log.name, _LONGEST_SOURCE_NAME),
        source_sha256=measured.training.sha256,
        version=__version__,
    )
    return evaluated, logs


def _alike(
    logs: Sequence[thermal.ThermalLog],
    tests: Mapping[CompensationCase, ThermalTest],
    more: list[Message],
) -> tuple[Message, ...]:
    """Return what is told of reading and of any case, once; of which other log, where it is one."""
    told = [*logs[0].remarks, *more]
    for case, test in tests.items():
        own = test.warnings
        if case is CompensationCase.IN_FORCE:
            each = (*logs[-1].remarks, *(one for one in own if one.code not in _OF_SETUP))
            own = (replace(one, place=one.place._replace(file=test.name)) for one in each)
        told += own
    return tuple(one for k, one in enumerate(told) if one not in told[:k])
