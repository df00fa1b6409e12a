"""``thermaxis compare``: several models on one log."""

import argparse
import sys
from pathlib import Path

from thermaxis import __version__
from thermaxis.cli._json import write_json
from thermaxis.cli._progress import Progress
from thermaxis.cli._text_table import text_table
from thermaxis.cli.thermal._thermal_logs import (
    add_log_options,
    check_written,
    measured_output,
    read_logs,
    remarks_of,
)
from thermaxis.cli.thermal._verification_result import figures_as_json
from thermaxis.errors import printable
from thermaxis.files import model_sha256, read_model
from thermaxis.thermal import Verification, verify


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = parser.add_argument
    add("files", metavar="MODEL", type=Path, nargs="+", help="compensation models (JSON)")
    add("log", metavar="LOG", type=Path, help="a test that none of them was made from")
    add(
        "--measured",
        metavar="CHANNEL[=OUTPUT[@MM]]",
        type=measured_output,
        action="append",
        help="measured channel, the models' output it is compared with, and the workpiece diameter"
        " (default: channels named as the outputs)",
    )
    add("--json", metavar="FILE|-", help="write the result as JSON; - for standard output alone")
    add_log_options(parser)


def run(arguments: argparse.Namespace) -> int:
    """Compare and show."""
    check_written(
        [("--json", arguments.json)], [*arguments.files, arguments.log, arguments.mapping]
    )
    with Progress() as progress:
        progress("reading", 0, 0)
        log = read_logs([arguments.log], mapping=arguments.mapping)[0].log
        models = [(path, read_model(path)) for path in arguments.files]
        results: list[tuple[Path, str, Verification]] = []
        for k, (path, model) in enumerate(models):
            progress(f"simulating {path.name}", k, len(models))
            result = verify(model, [log], arguments.measured, reference_s=arguments.reference)
            results.append((path, model_sha256(model), result))
    if arguments.json is not None:
        write_json(
            {
                "version": __version__,
                "log": log.name,
                "models": [
                    {
                        "name": path.name,
                        "model_sha256": digest,
                        "outputs": {n: figures_as_json(f) for n, f in result.pooled.items()},
                        "warnings": list(result.warnings),
                    }
                    for path, digest, result in results
                ],
                "warnings": remarks_of([log]),
            },
            arguments.json,
        )
    if arguments.json == "-":
        return 0
    for name in dict.fromkeys(n for _, _, result in results for n in result.pooled):
        known = [(p, r.pooled[name]) for p, _, r in results if name in r.pooled]
        known.sort(key=lambda entry: entry[1].rmse_um)
        rows = [
            [
                printable(path.name, 40),
                "–" if f.fit_percent is None else f"{f.fit_percent:.1f}",
                *(f"{v:.2f}" for v in (f.residual_um, f.rmse_um, f.mae_um, f.max_um)),
            ]
            for path, f in known
        ]
        first = known[0][1]
        statics = [f.static_rmse_um for _, f in known if f.static_rmse_um is not None]
        title = f"{printable(name, 30)} of {printable(log.name, 40)}, best first; p-p without"
        title += f" compensation {first.uncompensated_um:.2f} um"
        heads = ["model", "fit %", "left um", "RMSE um", "MAE um", "max um"]
        sys.stdout.write(text_table(title, heads, rows, words=1))
        if statics:
            sys.stdout.write(
                f"  static regression on the same inputs: RMSE {min(statics):.2f} um\n"
            )
        sys.stdout.write("\n")
    for remark in remarks_of([log]):
        sys.stdout.write(f"reading: {printable(remark, 400)}\n")
    for path, _, result in results:
        for warning in result.warnings:
            sys.stdout.write(f"warning: {printable(path.name, 40)}: {printable(warning, 400)}\n")
    return 0
