"""What stands at the head of every NC program, in words that any control's comment can hold."""

from thermaxis.controls._control import ProgramRequest, comment_text, plain_number
from thermaxis.controls._program_words import feed_word, stop_time_s
from thermaxis.positioning import motion_duration_s

_HASH_DIGITS = 64


def head_lines(request: ProgramRequest, control: str) -> tuple[str, ...]:
    """Return the lines at the head of a program."""
    plan = request.plan
    unit = plan.kind.units.position_suffix
    positions = [move.position for block in request.blocks for move in block.moves]
    lowest, highest = (plain_number(end(positions), 3) for end in (min, max))
    stops = sum(b.repetitions * sum(m.is_stop for m in b.moves) for b in request.blocks)
    minutes = motion_duration_s(plan, request.blocks) / 60.0
    title = comment_text(plan.title)
    lines = [
        f"thermaxis positioning run for {control}",
        *([f"title {title}"] if title else []),
        f"plan sha256 {comment_text(request.plan_sha256, _HASH_DIGITS)}",
        (
            f"axis {request.axis} {plan.kind} positions in {unit} feed {feed_word(plan)}"
            f" {unit} per min"
        ),
        f"lowest {lowest} highest {highest} {unit}",
        f"{plan.target.size} targets {plan.cycles} cycles {stops} stops order {plan.cycle}",
        (
            f"each stop {plain_number(stop_time_s(plan), 3)} s dwell"
            f" {plain_number(plan.dwell_s, 3)} s recording {plain_number(plan.recording_s, 3)} s"
        ),
        f"duration about {plain_number(minutes, 1)} min without acceleration",
        *_coordinate_lines(request, unit),
        "Prove with reduced feed before the run. All other axes stand still.",
    ]
    return tuple(comment_text(line, 100) for line in lines)


def _coordinate_lines(request: ProgramRequest, unit: str) -> list[str]:
    lines: list[str] = []
    work = request.options.get("coordinates") == "work"
    if work:
        lines.append("positions are work coordinates of the offset that is active at the start")
    elif "coordinates" in request.options:
        lines.append("positions are machine coordinates")
    if request.travel is None:
        lines.append("WARNING travel of the axis was not stated and not checked")
    else:
        low, high = (plain_number(end, 3) for end in request.travel)
        lines.append(f"travel {low} to {high} {unit} was checked by the author of the program")
        if work:
            lines.append("WARNING the check holds for a work offset of zero only")
    return lines
