"""What NC programs of all controls share: head, positions, feed, stops, blocks, and their limits.

Turns are rounded so that the motion never becomes wider than planned.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import final

from thermaxis.controls._control import (
    TRAVEL_UNSTATED,
    ProgramRequest,
    comment_text,
    plain_number,
)
from thermaxis.errors import ConfigurationError
from thermaxis.positioning import APPROACHES, Move, MoveBlock, TestPlan, motion_duration_s

LARGEST_REPETITIONS = 9999
"""Largest number of repetitions of one call, HEIDENHAIN and Fanuc; from memory. [1]"""
FINEST_DECIMALS = 6
"""Decimals where the control sets no fewer. [1]"""
_ROUND_OFF = 1e-6
_HASH_DIGITS = 64


def stop_time_s(plan: TestPlan) -> float:
    """Return how long the axis stands still at each stop."""
    return plan.dwell_s + plan.recording_s


def position_text(position: float) -> str:
    """Return a position as a program states it."""
    return plain_number(position, 3 if round(position, 3) == round(position, 6) else 6)


def inward_positions(block: MoveBlock, decimals: int) -> tuple[float, ...]:
    """Return where the moves of a block end, at the decimals that a control reads.

    A stop is a target and has three decimals already; a turn is rounded towards its neighbour, so
    that no move ends beyond the plan's lowest or highest position.
    """
    scale = 10.0**decimals
    moves = block.moves
    rounded: list[float] = []
    for i, move in enumerate(moves):
        if move.is_stop or len(moves) == 1:
            rounded.append(round(move.position, decimals))
            continue
        neighbour = moves[i + 1] if i + 1 < len(moves) else moves[i - 1]
        count = move.position * scale
        slack = _ROUND_OFF * max(1.0, 1e-8 * abs(count))
        if neighbour.position > move.position:
            inner = math.ceil(count - slack) / scale
            kept = inner < round(neighbour.position, decimals)
        else:
            inner = math.floor(count + slack) / scale
            kept = inner > round(neighbour.position, decimals)
        if not kept:
            raise ConfigurationError("overrun_too_short", decimals=decimals, key="overrun")
        rounded.append(inner)
    return tuple(rounded)


def feed_word(plan: TestPlan, *, decimals: int = FINEST_DECIMALS, largest: float = math.inf) -> str:
    """Return the feed as a control reads it."""
    text = plain_number(plan.feed, decimals).rstrip("0").rstrip(".")
    unit = f"{plan.kind.units.position}/min"
    if not float(text) > 0:
        raise ConfigurationError("feed_too_small", feed=plan.feed, unit=unit, key="feed")
    if float(text) > largest:
        raise ConfigurationError(
            "feed_too_large", feed=plan.feed, largest=largest, unit=unit, key="feed"
        )
    return text


def move_comment(move: Move) -> str:
    """Return what a move leads to."""
    if move.target is None or move.approach is None:
        return "turn"
    return f"target {move.target} {APPROACHES[move.approach]}"


def check_motion(request: ProgramRequest, *, largest: float = math.inf) -> None:
    """Refuse motion beyond the stated travel, or beyond the words of the control."""
    positions = [move.position for block in request.blocks for move in block.moves]
    if math.isfinite(largest):
        if any(abs(position) > largest for position in positions):
            raise ConfigurationError("position_too_large", largest=largest, key="targets")
        for block in request.blocks:
            if block.repetitions > LARGEST_REPETITIONS:
                raise ConfigurationError(
                    "too_many_repetitions",
                    repetitions=block.repetitions,
                    block=block.name,
                    most=LARGEST_REPETITIONS,
                    key="cycles, --warm-up",
                )
    plan = request.plan
    places = (plan.lowest, plan.highest, *positions)
    check_travel(places, request.travel, plan.kind.units.position)


def check_travel(
    places: Sequence[float],
    travel: tuple[float, float] | None,
    unit: str,
    code: str = "program_beyond_travel",
) -> None:
    """Refuse motion beyond the stated travel, by a code whose remedy fits."""
    if travel is None:
        return
    (low, high), lowest, highest = travel, min(places), max(places)
    if lowest < low or highest > high:
        raise ConfigurationError(
            code,
            key="--travel",
            lowest=lowest,
            highest=highest,
            excess=max(low - lowest, highest - high),
            low=low,
            high=high,
            unit=unit,
        )


def check_dwell(plan: TestPlan, longest_s: float, word: str) -> None:
    """Refuse a stop that is longer than the control's word for it can say."""
    if stop_time_s(plan) > longest_s:
        raise ConfigurationError(
            "dwell_too_long",
            stop_s=stop_time_s(plan),
            longest_s=longest_s,
            word=word,
            key="dwell_s",
        )


@final
@dataclass(frozen=True, slots=True)
class MoveWords:
    """How a control writes a move and a stop."""

    start: str
    """What stands before the position."""
    comment: str
    """A comment, with ``{}`` for its text."""
    dwell: tuple[str, ...]
    """Lines of a stop, behind the move that leads to it."""
    decimals: int = FINEST_DECIMALS
    """Decimals to which turns are rounded. [1]"""
    position: Callable[[float], str] = position_text
    """Text of a position in mm or deg."""
    end: str = ""
    """What stands behind the position."""


def move_lines(block: MoveBlock, words: MoveWords) -> Iterator[str]:
    """Yield the lines of a block's moves, driven once."""
    places = inward_positions(block, words.decimals)
    for move, place in zip(block.moves, places, strict=True):
        comment = words.comment.format(move_comment(move))
        yield f"{words.start}{words.position(place)}{words.end} {comment}"
        if move.is_stop:
            yield from words.dwell


def block_lines(
    block: MoveBlock, words: MoveWords, loop: tuple[str, str], indent: str = "  "
) -> Iterator[str]:
    """Yield the lines of a block, in a loop where it is driven more than once."""
    yield words.comment.format(block.name)
    if block.repetitions == 1:
        yield from move_lines(block, words)
        return
    yield loop[0]
    for line in move_lines(block, words):
        yield indent + line
    yield loop[1]


# ---- the head -----------------------------------------------------------------------------------


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
    lines.append(travel_line(request.travel, unit))
    if work and request.travel is not None:
        lines.append("WARNING the check holds for a work offset of zero only")
    return lines


def travel_line(travel: tuple[float, float] | None, unit: str) -> str:
    """Return what the head says of the check of the travel."""
    if travel is None:
        return f"WARNING {TRAVEL_UNSTATED}"
    low, high = (plain_number(end, 3) for end in travel)
    return f"travel {low} to {high} {unit} was checked by the author of the program"
