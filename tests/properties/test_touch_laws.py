"""Whatever touches come: no limit and no rate is passed, and nothing unbelieved moves anything."""

import math
import os
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from tests.unit.compensation.hostile_probe import HostileProbe, TouchLaws, touched_lathe
from thermaxis.compensation import (
    CycleReading,
    Request,
    RequestKind,
    Sample,
    Touch,
    TouchOutcome,
    cycle,
    cycle_state,
)

CYCLES = int(os.environ.get("HOSTILE_TOUCH_CYCLES", "8_000"))
RUN = 400
NUMBER = st.floats() | st.sampled_from((0.0, 1.0, 4.0, -50.0, 1e4, 1e15, -0.0))
TOUCH = st.none() | st.builds(
    Touch,
    st.sampled_from(("Z_um", "X_um", "Y_um")),
    NUMBER | st.none() | st.booleans(),
    st.integers(0, 40).map(lambda n: n / 2.0) | NUMBER,
    st.integers(0, 5),
    st.none() | NUMBER,
)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.lists(st.lists(TOUCH, max_size=3).map(tuple), max_size=20))
def test_any_touches_obey_the_laws(touches: Any) -> None:
    compensation = touched_lathe()
    laws = TouchLaws(compensation)
    samples = (Sample(22.0), Sample(20.5), Sample(21.0))
    state, output = cycle_state(compensation), None
    for k, taken in enumerate(touches):
        reading = CycleReading(
            float(k),
            samples,
            interlocks=(True, True),
            read_back_um=state.correction_um,
            found_um=None if k else (0.0, 0.0),
            requests=() if k else (Request(RequestKind.ENABLE),),
            touches=taken,
        )
        state, output = cycle(compensation, state, reading)
        laws.check(reading, state, output)


@pytest.mark.proof
def test_a_hostile_probe_obeys_the_laws_and_comes_to_every_end() -> None:
    outcomes: set[TouchOutcome] = set()
    for seed in range(CYCLES // RUN):
        compensation = touched_lathe()
        world, laws = HostileProbe(compensation, 7_000_000 + seed), TouchLaws(compensation)
        state, output = cycle_state(compensation), None
        for _ in range(RUN):
            reading = world.reading(output)
            state, output = cycle(compensation, state, reading)
            laws.check(reading, state, output)
        outcomes |= laws.outcomes
    assert outcomes == set(TouchOutcome)
    assert math.isfinite(state.time_s)
