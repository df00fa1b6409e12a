"""Write an example run of a virtual machine."""

import argparse
import sys
from pathlib import Path

from thermaxis.cli._arguments import adder, refuse_foreign
from thermaxis.errors import ConfigurationError
from thermaxis.files import write_rtl, write_thermal_log, write_tidy_csv
from thermaxis.virtual import LATHE_SEED, generate_lathe_test, paper_x_axis, paper_y_axis

AXES = ("x-axis", "y-axis")
"""Virtual axes that can be measured."""
LATHE_TESTS = ("lathe-spindle", "lathe-table", "lathe-verification")
"""Thermal tests of the virtual lathe."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add(
        "axis",
        "x-axis: 300 mm, drift, and an anomaly at position 3; y-axis: 150 mm; lathe-spindle,"
        " lathe-table, lathe-verification: thermal tests of a virtual lathe",
        choices=(*AXES, *LATHE_TESTS),
    )
    add(
        "-o, --output FILE",
        ".csv (tidy, with the time of every reading) or .rtl; a thermal log .csv",
        Path,
        required=True,
    )
    add("--seed N", "seed of everything random (default: the example's)", int)
    add("--cycles N", "number of cycles (default: 100 on X, 50 on Y)", int)
    add("--noise-um S", "standard deviation of one approach in um (default: 0.19)", float)


def run(arguments: argparse.Namespace) -> int:
    """Measure the virtual axis and write the run."""
    output: Path = arguments.output
    if arguments.axis in LATHE_TESTS:
        return _lathe_test(arguments)
    suffix = output.suffix.lower()
    if suffix not in {".csv", ".rtl"}:
        raise ConfigurationError("unknown_run_suffix", file=output, key="--output", suffix=suffix)
    measure = paper_x_axis if arguments.axis == "x-axis" else paper_y_axis
    generated = measure(arguments.seed, cycles=arguments.cycles, noise_um=arguments.noise_um)
    if suffix == ".csv":
        write_tidy_csv(generated.test, output)
    else:
        write_rtl(generated.test, output, deviation_decimals=generated.axis.scatter.decimals)
    test = generated.test
    sys.stdout.write(
        f"{output}: {test.target.size} targets, {test.cycles} cycles,"
        f" generated with seed {generated.seed}\n"
    )
    return 0


def _lathe_test(arguments: argparse.Namespace) -> int:
    output: Path = arguments.output
    if output.suffix.lower() != ".csv":
        raise ConfigurationError("written_as_csv", file=output, key="--output")
    refuse_foreign(arguments, "x-axis and y-axis", "--cycles", "--noise-um")
    seed = LATHE_SEED if arguments.seed is None else arguments.seed
    log = generate_lathe_test(arguments.axis.removeprefix("lathe-"), seed)
    write_thermal_log(log, output)
    sys.stdout.write(
        f"{output}: {log.rows} rows, {log.duration_s / 3600.0:.1f} h, generated with seed {seed}\n"
    )
    return 0
