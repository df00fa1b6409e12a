"""Cycles against a hostile machine: no law is broken and nothing is raised.

``HOSTILE_CYCLES=1000000`` plays a million.
"""

import os

import pytest

from tests.unit.compensation.hostile import HostilePlant, Laws, bare_lathe, quick_lathe
from thermaxis.compensation import SupervisorState, cycle, cycle_state

CYCLES = int(os.environ.get("HOSTILE_CYCLES", "100_000"))
RUN = 500
SHARES = 2
"""Parts of them, so that several workers share them."""


@pytest.mark.system
@pytest.mark.parametrize("share", range(SHARES))
def test_hostile_cycles_obey_every_law(share: int) -> None:
    cycles = 0
    visits: dict[tuple[SupervisorState, SupervisorState], int] = {}
    for seed in range(share, CYCLES // RUN, SHARES):
        compensation = (quick_lathe, bare_lathe)[seed // SHARES % 4 == 3]()
        world, laws = HostilePlant(compensation, 1_000_000 + seed), Laws(compensation)
        state, output = cycle_state(compensation), None
        for _ in range(RUN):
            reading = world.reading(output)
            before = state.memory.state
            state, output = cycle(compensation, state, reading)
            laws.check(reading, state, output)
            step = before, output.state
            visits[step] = visits.get(step, 0) + 1
        cycles += laws.cycles
    assert cycles == CYCLES // SHARES
    changes = {step for step in visits if step[0] is not step[1]}
    assert len(changes) >= 18
    assert all(visits[state, state] > CYCLES // 1_000 // SHARES for state in SupervisorState)
