"""``thermaxis correct``: levels of a measured axis to the compensation table of a control.

Not protected: the file is read back and simulated, but whether machine, laser and control agree
about sign, axis and reference point is shown by a measurement only. The file does not reach a
control by itself, and none of them activates its table.
"""

import argparse
from pathlib import Path

from thermaxis.cli._json import show
from thermaxis.cli._progress import Progress
from thermaxis.cli.axis._control_names import listed_controls
from thermaxis.cli.axis._correction_result import described
from thermaxis.cli.axis._make_table import make_table
from thermaxis.cli.axis._table_files import check_output, keep_older, write_ascii
from thermaxis.errors import ConfigurationError

_DESCRIPTION = """\
Write the compensation table of a measured axis in the form of one control, read it back, and show
by simulation of that control what it leaves. Sign and unit are said in words. Nothing is sent to a
control and no table is activated. A wrong sign doubles the error: verify two points on the machine.
"""
_LARGEST_REVERSAL = 1.0


def _hours(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = -1.0
    if not 0.0 <= number < 1e6:
        raise argparse.ArgumentTypeError(f"'{text}' is no number of hours from 0 on")
    return number


def _reversal(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = float("nan")
    if not abs(number) <= _LARGEST_REVERSAL:
        raise argparse.ArgumentTypeError(
            f"'{text}' is no reversal from -{_LARGEST_REVERSAL:g} to {_LARGEST_REVERSAL:g} mm or"
            " degrees; write 0.009 for 9 µm"
        )
    return number


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.description = _DESCRIPTION
    parser.epilog = f"controls: {listed_controls()}"
    add = parser.add_argument
    add("run", metavar="RUN", type=Path, help="measured run: .rtl, CSV, _ISO230.dat or .xlsx")
    add("--control", metavar="CONTROL", required=True, help="the control, one of those below")
    add("-o", "--output", metavar="FILE", required=True, help="the control's table")
    add("--axis", metavar="NAME", help="name of the axis on the control (default: the run's)")
    add(
        "--drift-free",
        action="store_true",
        help="levels without drift, at one thermal state (default: as measured)",
    )
    add(
        "--reference-time",
        metavar="H",
        type=_hours,
        help="thermal state of the drift-free levels, hours from the first reading (default: the"
        " mean time of the readings)",
    )
    add(
        "--no-drift",
        action="store_true",
        help="leave the drift model and the figures without drift out, which is faster",
    )
    grid = parser.add_mutually_exclusive_group()
    grid.add_argument(
        "--points",
        metavar="N",
        type=int,
        help="number of equidistant points (default: the targets where the control allows, else as"
        " many points as targets)",
    )
    grid.add_argument("--spacing", metavar="MM", type=float, help="distance of the points")
    add(
        "--reference",
        metavar="POSITION",
        type=float,
        help="reference point of the axis, where the table is zero (default: that of the older"
        " table; without one 0 if it lies within the targets, else their end nearest to 0)",
    )
    add(
        "--backlash",
        action="store_true",
        help="write the mean reversal apart, on a control with one value per point",
    )
    add(
        "--backlash-in-force",
        metavar="VALUE",
        type=_reversal,
        help="reversal value of the control during the run, in mm or degrees, with the sign of its"
        " own parameter: MD32450, BACKLASH of the joint, 1851 times its unit (default: that of the"
        " older table, else 0 with a warning)",
    )
    add(
        "--merge",
        metavar="OLD",
        type=Path,
        help="table that was in force during the run: the result takes its place",
    )
    add(
        "--set",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="an option that only this control has; may be given more than once; an unknown NAME"
        " lists them all, a NAME alone says what it means",
    )
    add("--json", metavar="FILE|-", help="write the result as JSON; - for standard output alone")
    add("--encoding", metavar="NAME", default="cp1250", help="of a run that is not UTF-8")


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
    output: str = arguments.output
    check_output(output, inputs=(arguments.run,), what="the measured run")
    inputs: list[Path] = [arguments.run]
    if arguments.merge is not None:
        inputs.append(arguments.merge)
        check_output(
            output,
            inputs=(arguments.merge,),
            what="the older table, which is needed to go back to it",
        )
    if arguments.json not in (None, "-"):
        check_output(arguments.json, inputs=inputs, option="--json")
        if Path(arguments.json).absolute() == Path(output).absolute():
            raise ConfigurationError(
                "table and result would be the same file",
                where=output,
                remedy="Name another file for --json",
            )
    if arguments.drift_free and arguments.no_drift:
        raise ConfigurationError(
            "drift-free levels come from the drift model",
            where="--no-drift",
            remedy="Leave --drift-free or --no-drift out",
        )
    if arguments.reference_time is not None and not arguments.drift_free:
        raise ConfigurationError(
            "it says for which thermal state drift-free levels are wanted",
            where="--reference-time",
            remedy="Give --drift-free as well, or leave it out",
        )
    place: float | None = arguments.reference
    if place is not None and not abs(place) <= 1e6:
        raise ConfigurationError("this is no position of an axis", where="--reference")
