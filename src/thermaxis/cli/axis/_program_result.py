"""What ``program`` says of the NC program that it wrote."""

from dataclasses import dataclass
from typing import final

from thermaxis.codes import printable
from thermaxis.controls import Control, ProgramRequest, comment_text
from thermaxis.positioning import FORWARD, motion_duration_s
from thermaxis.report.tables import filled


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
