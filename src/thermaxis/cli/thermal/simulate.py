"""Run a compensation model along a log."""

import argparse
import sys
from pathlib import Path

from thermaxis.cli._arguments import adder, diameter
from thermaxis.cli._outputs import check_csv_name, check_outputs
from thermaxis.cli._progress import Progress
from thermaxis.cli.thermal._thermal_logs import (
    add_log_options,
    logs_of,
    remarks_of,
    with_clocks_told,
)
from thermaxis.codes import printable
from thermaxis.compensation import Outcome
from thermaxis.files import read_model, write_thermal_log
from thermaxis.messages import sentence
from thermaxis.thermal import ThermalLog, simulate_log

_LEAST_BEYOND = 0.01  # of the width of the training range: less is noise of the start


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("model MODEL", "compensation model (JSON)", Path)
    add("log LOG", "thermal log: CSV, Parquet, .xlsx, .mat or .tdms", Path)
    add("-o, --output OUT.csv", "the simulated log", Path, required=True)
    add("--diameter MM", "clamping diameter (default: the tool centre)", diameter)
    add("--contributions", "a column for every part as well", bool)
    add_log_options(parser)


def run(arguments: argparse.Namespace) -> int:
    """Simulate and write."""
    output: Path = arguments.output
    check_csv_name(output)
    check_outputs([("--output", output)], [arguments.model, arguments.log, arguments.mapping])
    with Progress() as progress:
        progress("reading", 0, 0)
        model = read_model(arguments.model)
        logs = logs_of(arguments, [arguments.log])
        (log,) = with_clocks_told(logs, [model], None, arguments.reference)
        progress("simulating", 0, 0)
        run_along = simulate_log(
            model, log, diameter_mm=arguments.diameter, reference_s=arguments.reference
        )
    columns = {name: simulated.displacement_um for name, simulated in run_along.outputs.items()}
    if arguments.contributions:
        for name, simulated in run_along.outputs.items():
            stem = name.removesuffix("_um")
            for p, part in enumerate(simulated.parts):
                columns[f"{stem}_{part}_um"] = simulated.contribution_um[:, p]
    plain = ThermalLog.from_columns(columns, time_s=log.time_s)
    write_thermal_log(plain, output, first_time_s=log.origin_s)
    for first in remarks_of([log], assumed=True):
        sys.stdout.write(f"{printable(first, 400)}\n")
    named = ", ".join(printable(name, 40) for name in columns)
    sys.stdout.write(f"written: {printable(str(output))} ({log.rows} rows: {named})\n")
    for remark in remarks_of([log]):
        sys.stdout.write(f"reading: {printable(remark, 400)}\n")
    for name, (share, beyond) in run_along.outside.items():
        if beyond < _LEAST_BEYOND:
            continue
        sys.stdout.write(
            f"warning: input {printable(name, 40)} lies outside the range of the training in"
            f" {share:.1%} of the rows, by up to {beyond:.0%} of its width\n"
        )
    if run_along.bad_share > 0:
        sys.stdout.write(
            f"warning: in {run_along.bad_share:.1%} of the rows an input had failed for too long\n"
        )
    for outcome in (Outcome.DIAMETER_HELD, Outcome.GAP, Outcome.CLOCK_BACKWARD):
        if outcome in run_along.outcomes:
            sys.stdout.write(f"warning: {sentence(f'outcome-{outcome}')}\n")
    return 0
