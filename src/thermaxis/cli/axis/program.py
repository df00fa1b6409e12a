"""``thermaxis program``: the NC program of a plan, for one control.

Not protected: the motion is compared with the travel that the user states and with nothing else;
what stands in its way, and whether the axis is referenced, nobody asks. The file does not reach a
control by itself.
"""

import argparse
import re
import sys

from thermaxis.cli.axis._control_names import axis_name, listed_controls
from thermaxis.cli.axis._program_result import ProgramResult, as_text
from thermaxis.cli.axis._table_files import check_output, write_ascii
from thermaxis.controls import ProgramRequest, check_options, control_by_name
from thermaxis.errors import ConfigurationError
from thermaxis.files import plan_sha256, read_plan
from thermaxis.positioning import MoveBlock, TestPlan, moves_of_plan

_DESCRIPTION = """\
Write the NC program of a plan: every target approached from its side, a dwell at each stop, the
cycles as a loop or subprogram of the control. State the travel of the axis with --travel: a program
that leaves it is refused. Nothing is sent to a machine; prove the program before it runs.
"""
_NEGATIVE_WORD = re.compile(r"-\.?\d.*", re.DOTALL)


def _travel(text: str) -> tuple[float, float]:
    low, colon, high = text.partition(":")
    try:
        ends = (float(low), float(high))
    except ValueError:
        ends = (float("nan"), float("nan"))
    if not colon or not -1e6 <= ends[0] < ends[1] <= 1e6:
        raise argparse.ArgumentTypeError(
            f"'{text}' is no travel; write its lower and upper end, such as -10:510"
        )
    return ends


def _count(text: str) -> int:
    if not (text.isdecimal() and text.isascii() and len(text) <= 7):
        raise argparse.ArgumentTypeError(f"'{text}' is no number of travels from 0 on")
    return int(text)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.description = _DESCRIPTION
    parser.epilog = f"controls: {listed_controls()}"
    # argparse takes -10:510 for an option unless it counts as a negative number
    parser._negative_number_matcher = _NEGATIVE_WORD  # noqa: SLF001  # pyright: ignore[reportPrivateUsage]
    add = parser.add_argument
    add("plan", metavar="PLAN", help="plan that thermaxis plan -o has written (JSON)")
    add("--control", metavar="CONTROL", required=True, help="the control, one of those below")
    add("-o", "--output", metavar="FILE", required=True, help="the NC program")
    add("--axis", metavar="NAME", help="name of the axis on the control (default: the plan's)")
    add(
        "--travel",
        metavar="LOW:HIGH",
        type=_travel,
        help="lowest and highest position that the axis may reach, such as -10:510 (default: not"
        " checked, with a warning)",
    )
    add(
        "--warm-up",
        metavar="N",
        type=_count,
        default=0,
        help="travels from end to end and back before the first stop (default: 0)",
    )
    add(
        "--set",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="an option that only this control has; may be given more than once; an unknown NAME"
        " lists them all, a NAME alone says what it means",
    )


def run(arguments: argparse.Namespace) -> int:
    """Write the program, and say what the operator must know."""
    check_output(arguments.output, inputs=(arguments.plan,))
    result, text = _make(arguments)
    write_ascii(arguments.output, text)
    sys.stdout.write(as_text(result))
    return 0


def _make(arguments: argparse.Namespace) -> tuple[ProgramResult, str]:
    control = control_by_name(arguments.control)
    options = check_options(control, arguments.set, purpose="program")
    plan = read_plan(arguments.plan)
    blocks = moves_of_plan(plan, warm_up=arguments.warm_up)
    axis = plan.axis if arguments.axis is None else axis_name(arguments.axis)
    travel: tuple[float, float] | None = arguments.travel
    if travel is not None:
        _check_travel(plan, blocks, travel)
    request = ProgramRequest(
        plan=plan,
        plan_sha256=plan_sha256(plan),
        blocks=blocks,
        axis=axis,
        travel=travel,
        options=options,
    )
    text = control.format_program(request)
    result = ProgramResult(
        request=request,
        control_name=arguments.control,
        control=control,
        plan_name=arguments.plan,
        output=arguments.output,
    )
    return result, text


def _check_travel(
    plan: TestPlan, blocks: tuple[MoveBlock, ...], travel: tuple[float, float]
) -> None:
    """Refuse a program whose axis would leave its travel: by the plan, and by every move."""
    unit = plan.kind.units.position
    places = [move.position for block in blocks for move in block.moves]
    lowest, highest = min(plan.lowest, *places), max(plan.highest, *places)
    below, above = travel[0] - lowest, highest - travel[1]
    said: list[str] = []
    if below > 0:
        said.append(
            f"the axis would go down to {lowest:.9g} {unit}, {below:.4g} {unit} below the lower end"
            f" of its travel, {travel[0]:.9g} {unit}"
        )
    if above > 0:
        said.append(
            f"the axis would go up to {highest:.9g} {unit}, {above:.4g} {unit} beyond the upper end"
            f" of its travel, {travel[1]:.9g} {unit}"
        )
    if said:
        raise ConfigurationError(
            "; ".join(said),
            where="--travel",
            remedy="Plan the run again with another --start or --length or a smaller --overrun:"
            f" targets must keep {plan.overrun:.9g} {unit} of overrun from the ends",
        )
