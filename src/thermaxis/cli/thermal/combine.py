"""Superpose compensation models, with a gain by workpiece diameter."""

import argparse
import sys
from pathlib import Path

from thermaxis.cli._arguments import adder
from thermaxis.cli._outputs import check_outputs
from thermaxis.codes import printable
from thermaxis.errors import ConfigurationError
from thermaxis.files import read_model, write_model
from thermaxis.thermal import combine_models, parse_gain


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("models MODEL", "compensation models (JSON)", Path, nargs="+")
    add(
        "--gain NAME=MM:G,...",
        "gain g of a part, or of all parts of a model named by its file, by clamping"
        " diameter: table=0:1,1500:1.6,3000:2.2; tcp:1 states it for the tool centre point;"
        " linear in between, the end value outside, which is said; may be given more than"
        " once (default: 1 everywhere; at the tool centre point 1)",
        many=True,
    )
    add("-o, --output M.json", "the superposed model", Path, required=True)


def run(arguments: argparse.Namespace) -> int:
    """Combine and write."""
    paths: list[Path] = arguments.models
    output: Path = arguments.output
    check_outputs([("--output", output)], paths)
    gains = dict(parse_gain(text) for text in arguments.gain)
    if len(gains) < len(arguments.gain):
        raise ConfigurationError("two_gains_of_one_part", key="--gain")
    model = combine_models([(path.stem, read_model(path)) for path in paths], gains)
    write_model(model, output)
    for entry in model.outputs:
        sys.stdout.write(f"{printable(entry.name, 40)} is the sum of\n")
        for part in entry.parts:
            of = f"{part.plus} - {part.minus}" if part.minus else part.plus
            line = f"  {printable(part.name, 30)}: ({printable(of, 80)}),"
            line += f" {part.dc_gain_um_per_k:+.4g} µm/K in the end"
            if part.gain_by_diameter:
                listed = ", ".join(
                    f"{p.gain:g} at {p.diameter_mm:g}" for p in part.gain_by_diameter
                )
                line += f", times g = {listed} mm, {part.tool_gain:g} at the tool centre point"
            sys.stdout.write(line + "\n")
    sys.stdout.write(
        "Between the diameters g is interpolated; outside them the end value is held, and said.\n"
        f"written: {printable(str(output))}\n"
    )
    return 0
