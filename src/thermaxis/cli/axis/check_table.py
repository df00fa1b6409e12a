"""``thermaxis check-table``: read a control's table back, and show what it leaves of a run."""

import argparse
from pathlib import Path

from thermaxis.cli._json import show
from thermaxis.cli._progress import Progress
from thermaxis.cli.axis._check_result import check, described
from thermaxis.cli.axis._control_names import listed_controls
from thermaxis.cli.axis._table_files import check_output

_DESCRIPTION = """\
Read a compensation table as its control reads it, name what looks wrong in it, and show by
simulation of that control what it leaves of a measured run. The run counts as measured without it.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.description = _DESCRIPTION
    parser.epilog = f"controls: {listed_controls()}"
    add = parser.add_argument
    add("table", metavar="TABLE", type=Path, help="compensation table of the control")
    add("run", metavar="RUN", type=Path, help="measured run: .rtl, CSV, _ISO230.dat or .xlsx")
    add("--control", metavar="CONTROL", required=True, help="the control, one of those below")
    add("--axis", metavar="NAME", help="axis that the table must be of (default: the run's)")
    add(
        "--no-drift",
        action="store_true",
        help="leave the drift model and the figures without drift out, which is faster",
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
    """Check the table, and show what it leaves."""
    if arguments.json not in (None, "-"):
        check_output(
            arguments.json,
            inputs=(arguments.table, arguments.run),
            what="the table or the run",
            option="--json",
        )
    with Progress() as progress:
        step = "checking the table"
        progress(step if arguments.no_drift else f"{step}, with the drift of the run", 0, 0)
        result = check(arguments)
    show(described(result), arguments.json)
    return 0
