"""A million cycles against a hostile machine: no law is broken and nothing is raised."""

import pytest

from tests.unit.compensation.hostile import HostileWorld, Laws, bare_lathe, quick_lathe, trimless
from tests.unit.compensation.plain_cycle import plain_cycle, same
from thermaxis.compensation import SupervisorState, cycle, cycle_state

CYCLES = 1_000_000
RUN = 500
PLAIN_EVERY = 20
"""So seldom a run is compared with the plain rules as well; they are slow."""


@pytest.mark.system
@pytest.mark.timeout(600)
def test_a_million_hostile_cycles_obey_every_law() -> None:
    cycles, compared = 0, 0
    visits: dict[tuple[SupervisorState, SupervisorState], int] = {}
    for seed in range(CYCLES // RUN):
        compensation = (quick_lathe, bare_lathe)[seed % 4 == 3]()
        world, laws = HostileWorld(compensation, 1_000_000 + seed), Laws(compensation)
        state = plain = cycle_state(compensation)
        output = None
        for _ in range(RUN):
            reading = world.reading(output)
            before = state.memory.state
            state, output = cycle(compensation, state, reading)
            laws.check(reading, state, output)
            step = before, output.state
            visits[step] = visits.get(step, 0) + 1
            if seed % PLAIN_EVERY == 0:
                plain, said = plain_cycle(compensation, plain, reading)
                assert same(output, said)
                compared += 1
        if seed % PLAIN_EVERY == 0:
            assert same(trimless(state), trimless(plain))
        cycles += laws.cycles
    assert cycles == CYCLES
    assert compared >= CYCLES // 20
    changes = {step for step in visits if step[0] is not step[1]}
    assert len(changes) >= 18
    assert all(visits[state, state] > 1_000 for state in SupervisorState)
    print({f"{a} to {b}": n for (a, b), n in sorted(visits.items())})
