"""What stands at the head of every NC program, in words that any control's comment can hold."""

from itertools import pairwise

from thermaxis.controls._control import ProgramRequest, comment_text, plain_number
from thermaxis.errors import ConfigurationError
from thermaxis.positioning import APPROACHES, Move, TestPlan

_HASH_DIGITS = 64


def stop_time_s(plan: TestPlan) -> float:
    """Return how long the axis stands still at each stop.

    Parameters
    ----------
    plan : TestPlan
        The plan.

    Returns
    -------
    float
        Dwell plus recording. [s]
    """
    return plan.dwell_s + plan.recording_s


def check_motion(request: ProgramRequest) -> None:
    """Refuse motion beyond the stated travel, and an overrun that is lost in the digits.

    Parameters
    ----------
    request : ProgramRequest
        Motion and travel.

    Raises
    ------
    ConfigurationError
        If a move ends beyond an end of the travel, or a turn and its stop are written alike.
    """
    for block in request.blocks:
        for move, following in pairwise(block.moves):
            if position_text(move.position) == position_text(following.position):
                raise ConfigurationError(
                    "the overrun is shorter than the six decimals that are written",
                    where="overrun",
                    remedy="Plan a wider overrun: stops would lose their side of approach",
                )
    if request.travel is None:
        return
    low, high = request.travel
    positions = [move.position for block in request.blocks for move in block.moves]
    if positions and not low <= min(positions) <= max(positions) <= high:
        unit = request.plan.kind.units.position
        raise ConfigurationError(
            f"the program would move the axis from {min(positions):.10g} to"
            f" {max(positions):.10g} {unit}; its travel is {low:.10g} to {high:.10g} {unit}",
            where="travel",
            remedy="Plan fewer or nearer targets, or a smaller overrun",
        )


def position_text(position: float) -> str:
    """Return a position as a program states it.

    Parameters
    ----------
    position : float
        The position, a multiple of a millionth of its unit. [mm or deg]

    Returns
    -------
    str
        Three decimals where they are enough, else six.
    """
    return plain_number(position, 3 if round(position, 3) == round(position, 6) else 6)


def feed_text(plan: TestPlan) -> str:
    """Return the feed as a program states it.

    Parameters
    ----------
    plan : TestPlan
        The plan.

    Returns
    -------
    str
        Three decimals where they are enough, else six. [mm/min or deg/min]

    Raises
    ------
    ConfigurationError
        If six decimals leave nothing of it.
    """
    text = position_text(plan.feed)
    if float(text) == 0.0:
        raise ConfigurationError(
            f"a feed of {plan.feed:g} {plan.kind.units.position}/min is too small to be written",
            where="feed",
            remedy="Plan a feed of at least 0.001",
        )
    return text


def move_comment(move: Move) -> str:
    """Return what a move leads to.

    Parameters
    ----------
    move : Move
        The move.

    Returns
    -------
    str
        ``target 3 forward``, or ``turn``.
    """
    if move.target is None or move.approach is None:
        return "turn"
    return f"target {move.target} {APPROACHES[move.approach]}"


def motion_duration_s(request: ProgramRequest) -> float:
    """Return how long the program takes from its first position, acceleration left out.

    Parameters
    ----------
    request : ProgramRequest
        Plan and motion.

    Returns
    -------
    float
        Moves at the feed and all stops, warm-up included. [s]
    """
    plan = request.plan
    way, stops = 0.0, 0
    before: float | None = None
    for block in request.blocks:
        places = [move.position for move in block.moves]
        inside = sum(abs(b - a) for a, b in pairwise(places))
        again = abs(places[0] - places[-1])
        first = 0.0 if before is None else abs(places[0] - before)
        way += first + block.repetitions * inside + (block.repetitions - 1) * again
        stops += block.repetitions * sum(move.is_stop for move in block.moves)
        before = places[-1]
    return 60.0 * way / plan.feed + stops * stop_time_s(plan)


def head_lines(request: ProgramRequest, control: str) -> tuple[str, ...]:
    """Return the lines at the head of a program.

    Parameters
    ----------
    request : ProgramRequest
        Plan, axis, travel and options; the option ``coordinates`` is honoured if there is one.
    control : str
        Name of the control.

    Returns
    -------
    tuple of str
        Lines of letters, digits, space, ``-``, ``_`` and ``.`` alone.
    """
    plan = request.plan
    unit = plan.kind.units.position_suffix
    positions = [move.position for block in request.blocks for move in block.moves]
    lowest, highest = (plain_number(end(positions), 3) for end in (min, max))
    stops = sum(b.repetitions * sum(m.is_stop for m in b.moves) for b in request.blocks)
    minutes = motion_duration_s(request) / 60.0
    title = comment_text(plan.title)
    lines = [
        f"thermaxis positioning run for {control}",
        *([f"title {title}"] if title else []),
        f"plan sha256 {comment_text(request.plan_sha256, _HASH_DIGITS)}",
        (
            f"axis {request.axis} {plan.kind} positions in {unit} feed {feed_text(plan)}"
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
