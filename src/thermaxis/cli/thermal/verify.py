"""``thermaxis verify``: a model in free run against what was measured."""

import argparse
from pathlib import Path

from thermaxis import report
from thermaxis.cli._arguments import add_json, add_report, adder
from thermaxis.cli._json import show
from thermaxis.cli._outputs import check_outputs
from thermaxis.cli._progress import Progress
from thermaxis.cli.thermal._thermal_logs import (
    add_log_options,
    measured_output,
    read_logs,
    remarks_of,
    rows_of_span,
    sensor_warnings,
    span,
)
from thermaxis.cli.thermal._verification_result import described
from thermaxis.codes import Place, printable
from thermaxis.compensation import Limits
from thermaxis.errors import ConfigurationError
from thermaxis.files import model_sha256, read_correction_limits, read_model
from thermaxis.thermal import ThermalLog, verify


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("model MODEL", "compensation model (JSON)", Path)
    add("logs LOG", "independent tests: CSV, Parquet, .xlsx, .mat or .tdms", Path, nargs="+")
    add(
        "--measured CHANNEL[=OUTPUT[@MM]]",
        "measured channel, the model's output it is compared with, and the workpiece"
        " diameter: Z_D3000_um=Z_um@3000; may be given more than once (default: channels"
        " named as the outputs, at the tool centre point)",
        measured_output,
        action="append",
    )
    add(
        "--span A:B",
        "rows (0:6669) or times (0:8h) that count in the figures; the free run begins at the"
        " first row all the same",
        span,
    )
    add(
        "--limits FILE",
        "limits of the correction by output (TOML: [Z_um] with largest_um and"
        " largest_rate_um_per_s); the figures with the correction within them stand beside"
        " the others",
        Path,
    )
    add_json(parser)
    add_report(parser)
    add_log_options(parser)


def run(arguments: argparse.Namespace) -> int:
    """Verify, show and write."""
    check_outputs(
        [("--json", arguments.json), *(("--report", path) for path in arguments.report)],
        [arguments.model, *arguments.logs, arguments.mapping, arguments.limits],
    )
    with Progress() as progress:
        progress("reading", 0, 0)
        model = read_model(arguments.model)
        limits = _limits(arguments.limits, [output.name for output in model.outputs])
        logs: list[ThermalLog] = [
            entry.log for entry in read_logs(arguments.logs, mapping=arguments.mapping)
        ]
        progress("simulating", 0, 0)
        rows = None if arguments.span is None else rows_of_span(logs, arguments.span)
        result = verify(
            model,
            logs,
            arguments.measured,
            reference_s=arguments.reference,
            rows=rows,
            limits=limits,
        )
        if arguments.report:
            progress("report", 0, 0)
            for path in arguments.report:
                report.write_verification_report(model, logs, result, path)
    remarks = (*remarks_of(logs), *sensor_warnings(logs, model.channels))
    counted = "" if arguments.span is None else f", {arguments.span.text}"
    title = f"Verification of {printable(arguments.model.name, 60)}{counted}"
    shown = described(result, title, model_sha256(model), remarks)
    show(shown, arguments.json, arguments.report)
    return 0


def _limits(path: Path | None, outputs: list[str]) -> dict[str, Limits]:
    """Return the limits by output; each must be one of the model."""
    if path is None:
        return {}
    limits = read_correction_limits(path)
    for name in limits:
        if name not in outputs:
            raise ConfigurationError(
                "unknown_name",
                place=Place(file=str(path), key=name),
                name=name,
                known=", ".join(outputs),
            )
    return limits
