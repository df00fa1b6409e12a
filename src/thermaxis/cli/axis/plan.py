"""Choose targets by equation (1) of the method, and say how long the run takes.

The targets are equal steps plus a seeded random part, on an interval that is no multiple of the
pitch. They are checked against the rules of ISO 230-2; the uncertainty that the run will reach once
its drift is separated is foretold, and the plan is written as JSON. With --rotary lengths are in
deg, feeds in deg/min, deviations in arcsec.
"""

import argparse

from thermaxis.cli._arguments import add_json, adder, refuse_alone, refuse_both, refuse_foreign
from thermaxis.cli._json import show
from thermaxis.cli._outputs import check_outputs
from thermaxis.cli.axis._plan import DEFAULT_CYCLES, described, make_plan
from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError
from thermaxis.files import write_plan

_FIELDS = {
    "dwell_s": "dwell",
    "recording_s": "recording",
    "target": "targets",
    "time_constant_s": "time_constant",
}
"""Options that are not named as the field that they set."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    _add_targets(parser)
    _add_motion(parser)
    _add_uncertainty(parser)
    add = adder(parser)
    add("-o, --output PLAN.json", "write the plan (default: show it only)")
    add_json(parser)


def _add_targets(parser: argparse.ArgumentParser) -> None:
    add = adder(parser.add_argument_group("targets"))
    add("--length MM", "all targets lie within it", float, required=True)
    add("--targets N", "number of targets", int, required=True)
    add("--start MM", "where it begins (default: 0)", float, default=0.0)
    add("--axis NAME", "name of the axis (default: X, with --rotary C)")
    add("--rotary", "a rotary axis: deg, deg/min, arcsec", bool)
    add(
        "--pitch MM",
        "pitch of the screw or period of the scale; the interval then is no multiple of it",
        float,
    )
    add(
        "--random-share S",
        "random part as a share of the interval, 0 to less than 0.5 (default: half the pitch,"
        " at most 0.3 of the interval; without a pitch 0.3)",
        float,
    )
    add("--seed N", "seed of the random part (default: 1)", int, default=1)
    add("--title TEXT", "title of the plan", default="")


def _add_motion(parser: argparse.ArgumentParser) -> None:
    add = adder(parser.add_argument_group("motion"))
    add("--feed MM_MIN", "feed (default: 300)", float, default=300.0)
    add("--dwell S", "dwell at each stop (default: 2)", float, default=2.0)
    add(
        "--recording S",
        "time in which the laser averages at each stop (default: 0)",
        float,
        default=0.0,
    )
    add(
        "--overrun MM",
        "how far a target is passed before the axis comes back to it (default: 5)",
        float,
        default=5.0,
    )
    add(
        "--mode",
        "order of the visits: bidirectional (the standard's test cycle), unidirectional,"
        " pilgrim or step (default: bidirectional)",
        choices=("bidirectional", "unidirectional", "pilgrim", "step"),
        default="bidirectional",
    )
    add(
        "--approach-side",
        "the only approach (default: forward if unidirectional, else both)",
        choices=("forward", "backward"),
    )
    add(
        "--cycles N",
        f"number of cycles (default: {DEFAULT_CYCLES}, or what --target-uncertainty finds)",
        int,
    )


def _add_uncertainty(parser: argparse.ArgumentParser) -> None:
    add = adder(parser.add_argument_group("expected uncertainty"))
    add("--noise UM", "standard deviation of one approach (default: 0.4, an assumption)", float)
    add(
        "--drift UM",
        "drift at mid-axis in the end; half and one and a half times as much at the axis' ends"
        " (default: 10, an assumption)",
        float,
    )
    add("--time-constant H", "hours until 63 %% of it (default: 1, an assumption)", float)
    add(
        "--target-uncertainty UM",
        "find the smallest number of cycles with this standard uncertainty (k = 1); not"
        " together with a stated number of cycles",
        float,
    )
    add(
        "--target-figure KEY",
        "of what: level (default), the mean deviation of a target, or a figure such as B, E, R, A",
    )
    add("--standard", "let the search take at least the five cycles that ISO 230-2 asks for", bool)
    add("--longest H", "longest run of the search (default: 24)", float)


def run(arguments: argparse.Namespace) -> int:
    """Make a plan, and show and write it."""
    _check_options(arguments)
    try:
        result = make_plan(arguments)
    except ConfigurationError as error:
        option = _FIELDS.get(error.place.key, error.place.key)
        if not hasattr(arguments, option):
            raise
        raise error.at(Place(key="--" + option.replace("_", "-"))) from None
    if arguments.output is not None:
        write_plan(result.plan, arguments.output)
    show(described(result, arguments.output), arguments.json)
    return 0


def _check_options(arguments: argparse.Namespace) -> None:
    searching = "--target-uncertainty"
    refuse_both(arguments, "--cycles", searching)
    refuse_alone(arguments, searching, "--standard", "--longest", "--target-figure")
    if arguments.mode == "bidirectional":
        what = "--mode unidirectional, pilgrim and step"
        refuse_foreign(arguments, what, "--approach-side")
    check_outputs([("-o", arguments.output), ("--json", arguments.json)], [])
