"""The motion of a plan, driven step by step by a small machine of the test's own."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.refusals import refused
from thermaxis.positioning import (
    BACKWARD,
    FORWARD,
    Cycle,
    MoveBlock,
    TestPlan,
    motion_duration_s,
    moves_of_plan,
    order_of_visits,
)
from thermaxis.quantities import AxisKind

BOTH = (FORWARD, BACKWARD)


def plan(
    target: list[float],
    cycles: int = 2,
    cycle: Cycle = Cycle.STANDARD,
    approaches: tuple[int, ...] = BOTH,
    overrun: float = 5.0,
) -> TestPlan:
    return TestPlan(
        kind=AxisKind.LINEAR,
        axis="X",
        target=np.array(target),
        cycles=cycles,
        feed=300.0,
        dwell_s=2.0,
        overrun=overrun,
        cycle=cycle,
        approaches=approaches,
    )


def driven(
    blocks: tuple[MoveBlock, ...], start: float
) -> tuple[list[tuple[int, int]], list[float], list[int]]:
    """Return stops (target, approach), all positions, and the side each stop came from."""
    stops: list[tuple[int, int]] = []
    places, sides = [start], []
    for block in blocks:
        for _ in range(block.repetitions):
            for move in block.moves:
                if move.target is not None and move.approach is not None:
                    stops.append((move.target - 1, move.approach))
                    sides.append(FORWARD if places[-1] < move.position else BACKWARD)
                places.append(move.position)
    return stops, places[1:], sides


@st.composite
def plans(draw: st.DrawFn) -> TestPlan:
    cycle = draw(st.sampled_from(list(Cycle)))
    approaches = draw(st.sampled_from([BOTH, (FORWARD,), (BACKWARD,)]))
    steps = draw(st.lists(st.integers(1, 90_000), min_size=2, max_size=9))
    target = (np.cumsum(steps) / 1000.0 + draw(st.integers(-200, 200))).tolist()
    return plan(
        target,
        cycles=draw(st.integers(1, 6)),
        cycle=cycle,
        approaches=approaches,
        overrun=draw(st.integers(1, 20_000)) / 1000.0,
    )


@settings(max_examples=50)
@given(p=plans(), start=st.floats(-1e4, 1e4), warm_up=st.integers(0, 3))
def test_every_stop_comes_in_the_plans_order_and_from_its_side_wherever_the_axis_stood(
    p: TestPlan, start: float, warm_up: int
) -> None:
    blocks = moves_of_plan(p, warm_up=warm_up)
    stops, places, sides = driven(blocks, start)
    visits = order_of_visits(p)
    assert stops == list(zip(visits.target.tolist(), visits.approach.tolist(), strict=True))
    assert sides == visits.approach.tolist()
    # the axis never leaves the range that the plan states
    assert min(places) >= p.lowest - 1e-6
    assert max(places) <= p.highest + 1e-6
    # the duration is that of driving it move by move
    expected = 60.0 * float(np.sum(np.abs(np.diff(places)))) / p.feed
    expected += len(stops) * (p.dwell_s + p.recording_s)
    assert motion_duration_s(p, blocks) == pytest.approx(expected, rel=1e-9)
    # a turn passes the target by the overrun, and no move is without purpose
    for block in blocks[min(warm_up, 1) :]:
        for turn, stop in zip(block.moves, block.moves[1:], strict=False):
            assert turn.position != stop.position
            if not turn.is_stop:
                assert stop.is_stop
                assert abs(turn.position - stop.position) == pytest.approx(p.overrun, abs=1e-6)


def test_the_standard_cycle_is_one_block_that_is_repeated() -> None:
    (block,) = moves_of_plan(plan([0.0, 10.0], cycles=100))
    assert (block.name, block.repetitions) == ("cycle", 100)
    assert [(m.position, m.target, m.approach) for m in block.moves] == [
        (-5.0, None, None),
        (0.0, 1, FORWARD),
        (10.0, 2, FORWARD),
        (15.0, None, None),
        (10.0, 2, BACKWARD),
        (0.0, 1, BACKWARD),
    ]


def test_the_step_cycle_is_one_block_for_each_target() -> None:
    blocks = moves_of_plan(plan([0.0, 10.0, 30.0], cycles=4, cycle=Cycle.STEP))
    assert [(b.name, b.repetitions) for b in blocks] == [
        ("target 1", 4),
        ("target 2", 4),
        ("target 3", 4),
    ]
    assert [m.position for m in blocks[1].moves] == [5.0, 10.0, 15.0, 10.0]


def test_the_warm_up_goes_from_end_to_end_before_the_first_stop_and_stops_nowhere() -> None:
    blocks = moves_of_plan(plan([0.0, 10.0]), warm_up=7)
    assert (blocks[0].name, blocks[0].repetitions) == ("warm up", 7)
    assert [m.position for m in blocks[0].moves] == [-5.0, 15.0]
    assert not any(m.is_stop for m in blocks[0].moves)
    assert blocks[1:] == moves_of_plan(plan([0.0, 10.0]))
    for warm_up in (-1, 1_000_001):
        with refused("outside_range", key="warm_up"):
            moves_of_plan(plan([0.0, 10.0]), warm_up=warm_up)


def test_a_program_that_would_fill_the_memory_of_a_control_is_refused() -> None:
    long = plan(list(np.arange(10.0)), cycles=10_000, cycle=Cycle.PILGRIM)
    with refused("too_many_moves", key="cycles"):
        moves_of_plan(long)
    assert len(moves_of_plan(plan(list(np.arange(10.0)), cycles=20_000))) == 1
