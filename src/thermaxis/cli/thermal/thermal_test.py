"""Evaluate a log as one of the four thermal tests of ISO 230-3.

The set-up says which channels the probes, the room and the speed are. Logs are read as by verify:
what is no measurement is masked, a displacement that was re-zeroed is joined, and it is said.
"""

import argparse
from collections.abc import Mapping
from pathlib import Path

from thermaxis import __version__, files, thermal
from thermaxis.cli._arguments import add_json, adder
from thermaxis.cli._json import show
from thermaxis.cli._outputs import check_outputs
from thermaxis.cli.thermal._thermal_logs import (
    ReadLog,
    add_log_options,
    read_logs,
    reading_codes,
    remarks_of,
)
from thermaxis.codes import Message, printable
from thermaxis.report import CompensationCase, ThermalTestReport
from thermaxis.report.tables import describe_thermal_test
from thermaxis.thermal import ThermalTest, ThermalTestKind

_LONGEST_SOURCE_NAME = 200


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
    add_log_options(evaluate)


def run(arguments: argparse.Namespace) -> int:
    """Evaluate, show and write."""
    inputs = [arguments.log, arguments.setup, arguments.model, arguments.in_force]
    check_outputs([("--json", arguments.json)], [*inputs, arguments.mapping])
    report, logs = _evaluated(arguments)
    remarks = [*remarks_of(logs, assumed=True), *remarks_of(logs)]
    show([*describe_thermal_test(report, remarks), reading_codes(logs)], arguments.json)
    return 0


def _evaluated(
    arguments: argparse.Namespace,
) -> tuple[ThermalTestReport, list[thermal.ThermalLog]]:
    setup = files.read_thermal_test_setup(arguments.setup)
    kind: ThermalTestKind = arguments.kind
    measured = _read(arguments, arguments.log)
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
        tests[CompensationCase.LEFT_BY_MODEL] = thermal.evaluate_thermal_test(left, kind, setup)
    if arguments.in_force is not None:
        logs.append(_read(arguments, arguments.in_force).log)
        tests[CompensationCase.IN_FORCE] = thermal.evaluate_thermal_test(logs[-1], kind, setup)
    report = ThermalTestReport(
        cases=tests,
        setup=setup,
        model_sha256=sha256,
        warnings=(*_alike(tests), *warnings),
        source_name=printable(arguments.log.name, _LONGEST_SOURCE_NAME),
        source_sha256=measured.training.sha256,
        version=__version__,
    )
    return report, logs


def _alike(tests: Mapping[CompensationCase, ThermalTest]) -> list[Message]:
    """Return what is told of any case, once."""
    told = [warning for test in tests.values() for warning in test.warnings]
    return list({(one.code, *one.values.items()): one for one in told}.values())


def _read(arguments: argparse.Namespace, path: Path) -> ReadLog:
    (entry,) = read_logs(
        [path],
        mapping=arguments.mapping,
        masks=arguments.mask,
        as_logged=arguments.as_logged,
        reference_s=arguments.reference,
    )
    return entry
