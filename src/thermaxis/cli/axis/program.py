"""``thermaxis program``: the NC program of a plan, for one control.

Not protected: the motion is compared with the travel that the user states and with nothing else;
what stands in its way, and whether the axis is referenced, nobody asks. The file does not reach a
control by itself.
"""

import argparse
import re
import sys
from dataclasses import dataclass
from typing import final

from thermaxis.cli._arguments import adder, count
from thermaxis.cli._outputs import check_outputs, check_table_name, write_ascii
from thermaxis.cli.axis.tables.control import add_control, axis_name
from thermaxis.codes import Place, printable
from thermaxis.controls import Control, ProgramRequest, check_options, comment_text, control_by_name
from thermaxis.errors import ConfigurationError
from thermaxis.files import plan_sha256, read_plan
from thermaxis.positioning import FORWARD, MoveBlock, TestPlan, motion_duration_s, moves_of_plan
from thermaxis.report.tables import filled

_DESCRIPTION = """\
Write the NC program of a plan: every target approached from its side, a dwell at each stop, the
cycles as a loop or subprogram of the control. State the travel of the axis with --travel: a program
that leaves it is refused. Nothing is sent to a machine; prove the program before it runs.
"""
_NEGATIVE_WORD = re.compile(r"-\.?\d.*", re.DOTALL)


@final
@dataclass(frozen=True, slots=True, eq=False)
class ProgramResult:
    """An NC program with what was worked out for it."""

    request: ProgramRequest
    """What the program was made of."""
    control_name: str
    """Name of the control on the command line."""
    control: Control
    """The control."""
    plan_name: str
    """The plan's file."""
    output: str
    """The program's file."""

    @property
    def duration_s(self) -> float:
        """How long the program takes, as its head says. [s]"""
        return motion_duration_s(self.request.plan, self.request.blocks)

    @property
    def warm_up_s(self) -> float:
        """How much of it the warm-up is, with the way from there to the first stop. [s]"""
        run = [b for b in self.request.blocks if any(move.is_stop for move in b.moves)]
        return self.duration_s - motion_duration_s(self.request.plan, run)


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


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.description = _DESCRIPTION
    # argparse takes -10:510 for an option unless it counts as a negative number
    parser._negative_number_matcher = _NEGATIVE_WORD  # noqa: SLF001  # pyright: ignore[reportPrivateUsage]
    add = adder(parser)
    add("plan PLAN", "plan that thermaxis plan -o has written (JSON)")
    add_control(parser)
    add("-o, --output FILE", "the NC program", required=True)
    add(
        "--axis NAME",
        "name of the axis on the control, a letter and up to 15 letters, digits or"
        " underscores (default: the plan's)",
    )
    add(
        "--travel LOW:HIGH",
        "lowest and highest position that the axis may reach, such as -10:510, in mm or"
        " degrees. A program that leaves it is an error that says which end and by how much,"
        " and is not written (default: not checked; screen and head of the program warn)",
        _travel,
    )
    add(
        "--warm-up N",
        "travels from end to end and back before the first stop (default: 0)",
        count("number of travels", 0),
        default=0,
    )


def run(arguments: argparse.Namespace) -> int:
    """Write the program, and say what the operator must know."""
    check_table_name(arguments.output)
    check_outputs([("-o", arguments.output)], [arguments.plan])
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
    places = [move.position for block in blocks for move in block.moves]
    lowest, highest = min(plan.lowest, *places), max(plan.highest, *places)
    if lowest < travel[0] or highest > travel[1]:
        raise ConfigurationError(
            "program_beyond_travel",
            place=Place(key="--travel"),
            lowest=lowest,
            highest=highest,
            excess=max(travel[0] - lowest, highest - travel[1]),
            low=travel[0],
            high=travel[1],
            unit=plan.kind.units.position,
            overrun=plan.overrun,
        )


def as_text(result: ProgramResult) -> str:
    """Return the summary for a terminal."""
    parts = [_head(result), _motion(result), _operator(result)]
    parts += [filled(f"warning: {text}", hanging=True) + "\n" for text in _warnings(result)]
    return "\n".join(parts)


def _head(result: ProgramResult) -> str:
    title = result.request.plan.title
    return (
        f"{printable(result.output)}: NC program for {result.control.title}\n"
        f"plan {printable(result.plan_name)}{f', {printable(title)}' if title else ''}\n"
        f"hash {result.request.plan_sha256}\n"
    )


def _motion(result: ProgramResult) -> str:
    request = result.request
    plan = request.plan
    unit = plan.kind.units.position
    if len(plan.approaches) == 2:
        sides = "from both sides"
    else:
        sides = "forward only" if plan.approaches[0] == FORWARD else "backward only"
    stop_s = plan.dwell_s + plan.recording_s
    lines = [
        (
            f"{plan.kind} axis {request.axis}: {plan.target.size} targets, {plan.cycles}"
            f" {plan.cycle} cycles, {sides}, {plan.stops} stops of {stop_s:g} s"
        ),
        (
            f"moves from {plan.lowest:.9g} to {plan.highest:.9g} {unit} at {plan.feed:g}"
            f" {unit}/min; a target is passed by {plan.overrun:.9g} {unit} where the axis must turn"
        ),
        _takes(result),
    ]
    if request.travel is not None:
        low, high = request.travel
        lines.append(
            f"within the stated travel of {low:.9g} to {high:.9g} {unit}:"
            f" {plan.lowest - low:.9g} {unit} are left below, {high - plan.highest:.9g} {unit}"
            " above"
        )
    return "\n".join(lines) + "\n"


def _takes(result: ProgramResult) -> str:
    warm = result.warm_up_s
    text = f"takes {_hours(result.duration_s)} without acceleration and the control's own pauses"
    return f"{text}, {_hours(warm)} of it warm-up" if warm else text


def _hours(seconds: float) -> str:
    return f"{seconds / 3600.0:.2f} h" if seconds >= 3600.0 else f"{seconds / 60.0:.1f} min"


def _operator(result: ProgramResult) -> str:
    options = ", ".join(f"{k}={v}" for k, v in result.request.options.items())
    lines = [
        "Before it runs:",
        "  the axis is referenced, the way is free over the whole range above, and what the laser",
        "  and its reflector can reach is clear; the first move leads there from wherever the axis",
        "  stands;",
        "  read the head of the program: it says which coordinates it uses;",
        "  prove it with reduced feed and single blocks, without the laser in the way;",
        "  tables that are in force belong to the result: note them with the run.",
    ]
    if options:
        lines.append(f"Options of the control: {options}")
    return "\n".join(lines) + "\n"


def _warnings(result: ProgramResult) -> list[str]:
    plan, said = result.request.plan, list[str]()
    whole, kept = comment_text(plan.title, max(len(plan.title), 1)), comment_text(plan.title)
    if len(kept) < len(whole):
        said.append(
            f"the title is cut after {len(kept)} characters in the program's head, where it ends"
            f" with '{kept[-20:].lstrip()}'"
        )
    if result.request.travel is not None:
        return said
    unit = plan.kind.units.position
    return [
        *said,
        (
            "the travel of the axis was not stated and nothing was checked: compare"
            f" {plan.lowest:.9g} to {plan.highest:.9g} {unit} with the limits of the machine, or"
            " give --travel LOW:HIGH"
        ),
    ]
