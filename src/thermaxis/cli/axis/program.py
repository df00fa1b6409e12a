"""Write the NC program of a plan: every target approached from its side, a dwell at each stop.

Of the plan of a thermal test it switches the sources of heat and waits. Cycles are a loop or
subprogram of the control. With --touch the program touches a fixed artefact along one axis, and
leaves displacement and counter on the control. State the travel of the axis with --travel: a
program that leaves it is refused. Nothing is sent to a machine; prove the program before it runs.

Not protected: the motion is compared with the travel that is stated and with nothing else; what
stands in its way, and whether the axis is referenced, is not known.
"""

import argparse
from collections.abc import Iterator

from thermaxis.cli._arguments import (
    adder,
    count,
    position,
    positive_seconds,
    refuse_alone,
    refuse_both,
    refuse_foreign,
)
from thermaxis.cli._json import show
from thermaxis.cli._outputs import check_outputs, check_table_name, write_ascii
from thermaxis.cli.axis.tables.control import add_control, axis_name
from thermaxis.controls import (
    TRAVEL_UNSTATED,
    Control,
    HeatingRequest,
    ProgramRequest,
    TouchRequest,
    check_options,
    comment_text,
    control_by_name,
)
from thermaxis.errors import ConfigurationError
from thermaxis.files import plan_sha256, read_any_plan, thermal_test_plan_sha256
from thermaxis.positioning import FORWARD, motion_duration_s, moves_of_plan
from thermaxis.report.tables import Part, Section, Value
from thermaxis.thermal import ThermalTestPlan

_BEFORE_A_TOUCH = """\
Before it runs: the other axes stand in front of the artefact, the way to the start is free, the \
probe answers by hand, and bears the way behind the surface; prove it with reduced feed."""
_BEFORE_HEATING = """\
Before it runs: tool, chuck and workpiece bear the highest speeds for hours, the way of moving \
axes is free, doors are closed; prove it with reduced speed."""


def _travel(text: str) -> tuple[float, float]:
    low, _, high = text.partition(":")
    ends = (position(low), position(high))
    if not ends[0] < ends[1]:
        raise argparse.ArgumentTypeError(
            f"'{text}' is no travel; write its lower and upper end, such as -10:510"
        )
    return ends


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add(
        "plan PLAN",
        "plan that thermaxis plan or thermal-test plan has written (JSON); none with --touch",
        nargs="?",
    )
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
    )
    add("--touch P", "machine position of a touch while the displacement is zero", position)
    add("--from P", "machine position where a touch begins to search and ends", position)
    add("--search MM", "longest way of the search from there, 1 to 100 mm", position)
    add("--feed F", "feed of all moves of a touch, 1 to 2000 mm/min", position)
    add("--times N", "number of touches (default: 1)", count("number of touches", 2))
    add("--every TIME", "pause between two touches, such as 30min", positive_seconds)


def run(arguments: argparse.Namespace) -> int:
    """Write the program, and say what the operator must know."""
    check_table_name(arguments.output)
    if (arguments.plan is None) == (arguments.touch is None):
        raise ConfigurationError("either_option", one="PLAN", other="--touch", key="--touch")
    check_outputs([("-o", arguments.output)], [arguments.plan] if arguments.plan else [])
    control = control_by_name(arguments.control)
    refuse_alone(arguments, "--touch", "--from", "--search", "--feed", "--every", "--times")
    if arguments.touch is not None:
        return _touch(arguments, control)
    plan = read_any_plan(arguments.plan)
    if isinstance(plan, ThermalTestPlan):
        return _heating(arguments, control, plan)
    options = check_options(control, arguments.set, purpose="program")
    blocks = moves_of_plan(plan, warm_up=arguments.warm_up or 0)
    request = ProgramRequest(
        plan=plan,
        plan_sha256=plan_sha256(plan),
        blocks=blocks,
        axis=plan.axis if arguments.axis is None else axis_name(arguments.axis),
        travel=arguments.travel,
        options=options,
    )
    write_ascii(arguments.output, control.format_program(request))
    show(_described(arguments, control, request), None)
    return 0


def _heating(arguments: argparse.Namespace, control: Control, plan: ThermalTestPlan) -> int:
    """Write the program of a thermal test."""
    for option in ("--axis", "--warm-up"):
        refuse_foreign(arguments, "the plan of a thermal test", option)
    request = HeatingRequest(
        plan=plan,
        plan_sha256=thermal_test_plan_sha256(plan),
        options=check_options(control, arguments.set, purpose="heating"),
        travel=arguments.travel,
    )
    write_ascii(arguments.output, control.format_heating(request))
    hours = f"{plan.duration_s / 3600.0:.2f} h, accelerations beside it"
    said = [f"{arguments.output}: thermal test for {control.title}, {hours}", _BEFORE_HEATING]
    switches = [one.switch for one in plan.conditions.each if one.switch]
    ends = [end for one in switches for end in one.ends_mm]
    unchecked = ends if arguments.travel is None else []
    warnings = [_unchecked(min(ends), max(ends), "mm") for _ in unchecked[:1]]
    show([Section("", said), Value("", warnings, "warning")], None)
    return 0


def _touch(arguments: argparse.Namespace, control: Control) -> int:
    """Write the program of a touch."""
    for needed in ("--axis", "--from", "--search", "--feed"):
        refuse_alone(arguments, needed, "--touch")
    refuse_both(arguments, "--warm-up", "--touch")
    refuse_alone(arguments, "--times", "--every")
    refuse_alone(arguments, "--every", "--times")
    request = TouchRequest(
        axis=axis_name(arguments.axis),
        surface_mm=arguments.touch,
        start_mm=getattr(arguments, "from"),
        search_mm=arguments.search,
        feed_mm_per_min=arguments.feed,
        touches=arguments.times or 1,
        pause_s=arguments.every or 0.0,
        travel=arguments.travel,
        options=check_options(control, arguments.set, purpose="touch"),
    )
    write_ascii(arguments.output, control.format_touch(request))
    way = f"axis {request.axis} from {request.start_mm:g} to {request.end_mm:g} mm at most"
    said = [f"{arguments.output}: touch program for {control.title}, {way}", _BEFORE_A_TOUCH]
    low_mm, high_mm = sorted((request.start_mm, request.end_mm))
    warnings = [] if arguments.travel else [_unchecked(low_mm, high_mm, "mm")]
    show([Section("", said), Value("", warnings, "warning")], None)
    return 0


def _described(
    arguments: argparse.Namespace, control: Control, request: ProgramRequest
) -> list[Part]:
    """Return the summary for a terminal."""
    options = ", ".join(f"{k}={v}" for k, v in request.options.items())
    title = f", {request.plan.title}" if request.plan.title else ""
    head = [
        f"{arguments.output}: NC program for {control.title}",
        f"plan {arguments.plan}{title}",
        f"hash {request.plan_sha256}",
    ]
    before = [
        "Before it runs:",
        "  the axis is referenced, and the way is free over the whole range above;",
        "  what the laser and its reflector can reach is clear, from wherever the axis stands;",
        "  read the head of the program: it says which coordinates it uses;",
        "  prove it with reduced feed and single blocks, without the laser in the way;",
        "  tables that are in force belong to the result: note them with the run.",
        *([f"Options of the control: {options}"] if options else []),
    ]
    warnings = Value("", _warnings(request), "warning")
    return [*(Section("", part) for part in (head, list(_motion(request)), before)), warnings]


def _motion(request: ProgramRequest) -> Iterator[str]:
    plan = request.plan
    unit = plan.kind.units.position
    if len(plan.approaches) == 2:
        sides = "from both sides"
    else:
        sides = "forward only" if plan.approaches[0] == FORWARD else "backward only"
    stop_s = plan.dwell_s + plan.recording_s
    yield (
        f"{plan.kind} axis {request.axis}: {plan.target.size} targets, {plan.cycles} {plan.cycle}"
        f" cycles, {sides}, {plan.stops} stops of {stop_s:g} s"
    )
    yield (
        f"moves from {plan.lowest:.9g} to {plan.highest:.9g} {unit} at {plan.feed:g} {unit}/min; a"
        f" target is passed by {plan.overrun:.9g} {unit} where the axis must turn"
    )
    whole_s = motion_duration_s(plan, request.blocks)
    run = [block for block in request.blocks if any(move.is_stop for move in block.moves)]
    warm_s = whole_s - motion_duration_s(plan, run)  # with the way to the first stop
    warm = f", {_hours(warm_s)} of it warm-up" if warm_s else ""
    yield f"takes {_hours(whole_s)} without acceleration and the control's own pauses{warm}"
    if request.travel is not None:
        low, high = request.travel
        yield (
            f"within the stated travel of {low:.9g} to {high:.9g} {unit}: {plan.lowest - low:.9g}"
            f" {unit} are left below, {high - plan.highest:.9g} {unit} above"
        )


def _hours(seconds: float) -> str:
    return f"{seconds / 3600.0:.2f} h" if seconds >= 3600.0 else f"{seconds / 60.0:.1f} min"


def _warnings(request: ProgramRequest) -> list[str]:
    plan, said = request.plan, list[str]()
    whole, kept = comment_text(plan.title, max(len(plan.title), 1)), comment_text(plan.title)
    if len(kept) < len(whole):
        said.append(
            f"the title is cut after {len(kept)} characters in the program's head, where it ends"
            f" with '{kept[-20:].lstrip()}'"
        )
    if request.travel is None:
        said.append(_unchecked(plan.lowest, plan.highest, plan.kind.units.position))
    return said


def _unchecked(lowest: float, highest: float, unit: str) -> str:
    return (
        f"the {TRAVEL_UNSTATED}: compare {lowest:.9g} to {highest:.9g} {unit} with the limits of"
        " the machine, or give --travel LOW:HIGH"
    )
