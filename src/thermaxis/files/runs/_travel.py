"""The way along the targets that the rows of a table show."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, remark
from thermaxis.positioning import BACKWARD, FORWARD, FloatArray
from thermaxis.quantities import AxisKind

FULL_TURN_DEG = 360.0
"""One turn of a rotary axis. [deg]"""

_IntArray: TypeAlias = NDArray[np.int64]

_DECIMALS = 9
"""Decimals that a target keeps when a turn is added to it. [1]"""


def targets_through_a_turn(
    kind: AxisKind, row_target: FloatArray, cycle: _IntArray, approach: _IntArray, place: FloatArray
) -> tuple[FloatArray, list[Message]]:
    """Let the targets of a rotary axis rise through 360 degrees where the travel does.

    A turn is added to the targets below the one at which the forward passes begin, if these passes
    neither rise nor fall as they are listed, every fall is more than half a turn, all rise then,
    and the targets lie within one turn.
    Without forward passes the backward ones are looked at, the other way round.
    """
    if kind is not AxisKind.ROTARY or np.ptp(row_target) >= FULL_TURN_DEG:
        return row_target, []
    direction = FORWARD if bool(np.any(approach == FORWARD)) else BACKWARD
    rows = np.flatnonzero((approach == direction) & ~np.isnan(place))
    along = place[rows] if direction == FORWARD else -place[rows]
    rows = rows[np.lexsort((along, cycle[rows]))]
    within = np.diff(cycle[rows]) == 0
    steps = np.diff(row_target[rows])[within]
    falls = steps[steps < 0]
    if not falls.size or not bool(np.any(steps > 0)) or bool(np.any(falls > -0.5 * FULL_TURN_DEG)):
        return row_target, []
    _, first, count = np.unique(cycle[rows], return_index=True, return_counts=True)
    begin = row_target[rows[first[np.argmax(count)]]]
    behind = row_target < begin
    turned = np.where(behind, np.round(row_target + FULL_TURN_DEG, _DECIMALS), row_target)
    if not bool(np.all(np.diff(turned[rows])[within] > 0)):
        return row_target, []
    moved = np.unique(row_target[behind])
    said = remark(
        "through_a_turn",
        begin=f"{begin:.10g}",
        moved=moved.size,
        before=f"{moved[0]:.10g}",
        after=f"{moved[0] + FULL_TURN_DEG:.10g}",
    )
    return turned, [said]


def passes_of_travel(
    row_target: FloatArray, order: FloatArray, cycle: _IntArray | None
) -> tuple[_IntArray, _IntArray] | None:
    """Tell cycle and approach from the order in which the targets were visited.

    Each pass visits targets that only rise or only fall. Passes either alternate and begin with
    the target where the one before ended, or all begin with the same target. None otherwise.
    """
    rows = np.argsort(order, kind="stable")[: int(np.count_nonzero(~np.isnan(order)))]
    steps = np.diff(row_target[rows])
    turns = np.flatnonzero(steps == 0)
    one_way = not turns.size
    if one_way and steps.size:
        turns = np.flatnonzero(np.sign(steps) != np.sign(steps[0]))
    passes = np.zeros(rows.size, dtype=np.int64)
    passes[turns + 1] = 1
    passes = np.cumsum(passes)
    inside = np.delete(np.arange(steps.size), turns)
    sign = np.zeros(passes[-1] + 1)
    sign[passes[inside]] = np.sign(steps[inside])
    begins = row_target[rows[np.concatenate(([0], turns + 1))]]
    alternates = bool(np.all(sign[1:] == -sign[:-1])) and sign.size > 1
    repeats = bool(np.all(sign == sign[0]) and np.all(begins == begins[0])) and sign.size > 1
    if np.any(sign == 0) or np.any(np.sign(steps[inside]) != sign[passes[inside]]):
        return None
    if not (repeats if one_way else alternates):
        return None
    approach = np.zeros(row_target.size, dtype=np.int64)
    counted = np.ones_like(approach)
    approach[rows] = np.where(sign[passes] > 0, FORWARD, BACKWARD)
    counted[rows] = 1 + (passes if one_way else passes // 2)
    if cycle is None:
        return counted, approach
    # a stated cycle must have each pass whole
    whole = {(int(p), int(c)) for p, c in zip(passes, cycle[rows], strict=True)}
    return (cycle, approach) if len(whole) == sign.size else None


def rows_against_direction(
    row_target: FloatArray, cycle: _IntArray, approach: _IntArray
) -> list[Message]:
    """Say that the rows of a table without order and times run against their directions.

    Nothing is said where both approaches are listed the same way: such a table was sorted.
    """
    rows = np.lexsort((approach, cycle))  # stable: the order of the file within a pass
    within = (np.diff(cycle[rows]) == 0) & (np.diff(approach[rows]) == 0)
    steps = np.diff(row_target[rows])[within]
    forward = approach[rows][1:][within] == FORWARD
    if not bool(forward.any()) or bool(np.any(np.where(forward, steps >= 0, steps <= 0))):
        return []
    return [remark("forward_downwards" if bool(forward.all()) else "both_downwards")]
