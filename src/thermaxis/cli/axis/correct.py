"""Write the compensation table of a measured axis in the form of one control, and read it back.

What it leaves is shown by simulation of that control; sign and unit are said in words. Nothing is
sent to a control and no table is activated. A wrong sign doubles the error: verify two points on
the machine.

Not protected: whether machine, laser and control agree about sign, axis and reference point is
shown by a measurement only.
"""

import argparse
from pathlib import Path

from thermaxis.cli._arguments import (
    add_json,
    adder,
    hours,
    number,
    position,
    refuse_alone,
    refuse_both,
)
from thermaxis.cli._json import show
from thermaxis.cli._outputs import check_outputs, check_table_name, keep_older, write_ascii
from thermaxis.cli._progress import Progress
from thermaxis.cli._reading import add_reading
from thermaxis.cli.axis.tables.control import add_control
from thermaxis.cli.axis.tables.described import described
from thermaxis.cli.axis.tables.make import make_table

_reversal = number("reversal from -1 to 1 mm or degrees; write 0.009 for 9 µm", -1.0, 1.0)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("run RUN", "measured run: .rtl, CSV, _ISO230.dat or .xlsx", Path)
    add_control(parser)
    add(
        "-o, --output FILE",
        "the table. It must be neither the run nor the older table. What stands there with"
        " another content is kept beside it as FILE.old-1, FILE.old-2, ... and the summary"
        " says so",
        required=True,
    )
    add(
        "--axis NAME",
        "name of the axis on the control (default: what the run states, else X, on a rotary"
        " axis C, with a warning)",
    )
    add(
        "--drift-free",
        "mean deviations without drift, at one thermal state (default: as measured)",
        bool,
    )
    add(
        "--reference-time H",
        "thermal state of --drift-free, hours from the first reading (default: the"
        " mean time of the readings)",
        hours,
    )
    add(
        "--no-drift",
        "leave the drift model and the figures without drift out; not together with"
        " --drift-free. It is faster by far for thousands of readings (default: the drift"
        " model is fitted)",
        bool,
    )
    grid = adder(parser.add_mutually_exclusive_group())
    grid(
        "--points N",
        "number of equidistant points from the first to the last target, and over the range"
        " of an older table. Where one must lie at the reference point (Fanuc), the largest"
        " number (default: the targets themselves where the control allows, else as many"
        " points as targets; with an older table its points)",
        int,
    )
    grid(
        "--spacing MM",
        "distance of equidistant points, in mm or degrees; not together with the option above",
        float,
    )
    add(
        "--reference POSITION",
        "reference point of the axis, where the table is zero (default: that of the older"
        " table; without one 0 if it lies within the targets, else their end nearest to 0)",
        position,
    )
    add(
        "--backlash",
        "write the mean reversal apart; only on a control with one value per point and a"
        " place for it (default: the summary says which reversal remains)",
        bool,
    )
    add(
        "--backlash-in-force VALUE",
        "reversal value of the control during the run, in mm or degrees, with the sign of its"
        " own parameter: MD32450, BACKLASH of the joint, 1851 times its unit (default: that of the"
        " older table, else 0 with a warning)",
        _reversal,
    )
    add(
        "--merge OLD",
        "table that was in force during the run, of the same control, read with the same"
        " options of the control: the result is their sum and takes its place; old, new and"
        " change are printed for each point (default: the run counts as measured without a"
        " table)",
        Path,
    )
    add_json(parser)
    add_reading(parser)


def run(arguments: argparse.Namespace) -> int:
    """Write the table, and show what it does."""
    _check_arguments(arguments)
    with Progress() as progress:
        step = "making the table"
        progress(step if arguments.no_drift else f"{step}, with the drift of the run", 0, 0)
        result = make_table(arguments)
    kept = keep_older(arguments.output, result.text.text)
    write_ascii(arguments.output, result.text.text)
    show(described(result, kept), arguments.json)
    return 0


def _check_arguments(arguments: argparse.Namespace) -> None:
    """Refuse what cannot be, before anything is read or written."""
    check_table_name(arguments.output)
    check_outputs(
        [("-o", arguments.output), ("--json", arguments.json)],
        [arguments.run, arguments.merge, arguments.map],
    )
    refuse_both(arguments, "--no-drift", "--drift-free")
    refuse_alone(arguments, "--drift-free", "--reference-time")
