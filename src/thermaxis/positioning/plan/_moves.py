"""The motion of a plan as blocks of moves that a control's language repeats."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import final

import numpy as np

from thermaxis.errors import ConfigurationError, require_range
from thermaxis.positioning.plan._plan import TestPlan, order_of_visits
from thermaxis.positioning.run import FORWARD, Cycle

MOST_MOVES = 200_000
"""Largest number of moves that a program spells out; repeated blocks count once. [1]"""


@final
@dataclass(frozen=True, slots=True)
class Move:
    """One move at the plan's feed, to a stop or to where the axis turns."""

    position: float
    """Where it ends. [mm or deg]"""
    target: int | None
    """Number of the target at which the laser records, from 1; None where the axis only turns."""
    approach: int | None
    """Approach of the stop, 0 forward, 1 backward; None where the axis only turns."""

    @property
    def is_stop(self) -> bool:
        """Whether the axis dwells there for a reading."""
        return self.target is not None


@final
@dataclass(frozen=True, slots=True)
class MoveBlock:
    """Moves in their order, driven as often as `repetitions` says.

    The first move of a block leads to where its first stop is approached from, so that a block
    can be repeated and started from anywhere.
    """

    name: str
    """``warm up``, ``cycle``, ``target 3`` or ``pilgrim``."""
    repetitions: int
    """How often the block is driven. [1]"""
    moves: tuple[Move, ...]


def moves_of_plan(plan: TestPlan, *, warm_up: int = 0) -> tuple[MoveBlock, ...]:
    """Return the motion of a plan, each stop approached from its side.

    Before a stop that is not ahead in the wanted direction the axis passes the target by the
    overrun and comes back. The order of the stops is that of `order_of_visits`.

    Not protected: neither the limits of the axis nor what stands in its way are known here, and
    the way to the first position is that from wherever the axis stands. A control may end a move
    elsewhere than asked, by its rounding.

    Parameters
    ----------
    warm_up : int
        Number of travels from end to end and back, without a stop, before the first reading.
        Default: none. [1]

    Returns
    -------
    tuple of MoveBlock
        The blocks in their order: one cycle, repeated, for the standard cycle; for the step cycle
        one block per target; for the pilgrim step one block that is driven once.

    Raises
    ------
    ConfigurationError
        If the warm-up is negative or beyond a million, or more than 200,000 moves had to be
        spelt out.

    References
    ----------
    ISO 230-2:2014, clause 5.3 and Annex B.
    """
    require_range("warm_up", warm_up, 0, 1_000_000)
    blocks: list[MoveBlock] = []
    if warm_up:
        ends = (Move(plan.lowest, None, None), Move(plan.highest, None, None))
        blocks.append(MoveBlock("warm up", warm_up, ends))
    blocks += _blocks(plan)
    spelt = sum(len(block.moves) for block in blocks)
    if spelt > MOST_MOVES:
        raise ConfigurationError("too_many_moves", moves=spelt, most=MOST_MOVES, key="cycles")
    return tuple(blocks)


def motion_duration_s(plan: TestPlan, blocks: Sequence[MoveBlock]) -> float:
    """Return how long blocks of moves take from their first position, acceleration left out.

    Moves at the feed and all stops, the ways between repetitions and blocks included. [s]
    """
    way, stops = 0.0, 0
    before: float | None = None
    for block in blocks:
        places = [move.position for move in block.moves]
        inside = sum(abs(b - a) for a, b in pairwise(places))
        again = abs(places[0] - places[-1])
        first = 0.0 if before is None else abs(places[0] - before)
        way += first + block.repetitions * inside + (block.repetitions - 1) * again
        stops += block.repetitions * sum(move.is_stop for move in block.moves)
        before = places[-1]
    return 60.0 * way / plan.feed + stops * (plan.dwell_s + plan.recording_s)


def _blocks(plan: TestPlan) -> list[MoveBlock]:
    visits = order_of_visits(plan)
    if plan.cycle is Cycle.STANDARD:
        once = visits.cycle == 0
        stops = list(zip(visits.target[once], visits.approach[once], strict=True))
        return [MoveBlock("cycle", plan.cycles, _moves(plan, stops))]
    if plan.cycle is Cycle.STEP:
        return [
            MoveBlock(f"target {i + 1}", plan.cycles, _moves(plan, [(i, a) for a in _sides(plan)]))
            for i in range(plan.target.size)
        ]
    stops = list(zip(visits.target, visits.approach, strict=True))
    return [MoveBlock("pilgrim", 1, _moves(plan, stops))]


def _sides(plan: TestPlan) -> tuple[int, ...]:
    return tuple(plan.approaches)


def _moves(plan: TestPlan, stops: "list[tuple[int, int]]") -> tuple[Move, ...]:
    """Return the moves to stops given as (target, approach), turns included."""
    moves: list[Move] = []
    before: float | None = None
    for i, approach in stops:
        position = float(plan.target[i])
        direction = 1.0 if approach == FORWARD else -1.0
        if before is None or direction * (position - before) <= 0.0:
            turn = float(np.round(position - direction * plan.overrun, 6))
            moves.append(Move(turn, None, None))
        moves.append(Move(position, int(i) + 1, int(approach)))
        before = position
    return tuple(moves)
