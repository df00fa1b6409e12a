"""Whatever comes: the cycle keeps its limits, uses what they allow, and does what it says."""

import math
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from tests.unit.compensation.hostile import (
    HostilePlant,
    Laws,
    bare_lathe,
    quick_lathe,
    same,
)
from thermaxis.compensation import (
    Compensation,
    CycleReading,
    Request,
    RequestKind,
    Sample,
    SupervisorState,
    cycle,
    cycle_state,
    shifted,
)
from thermaxis.runtime import SavedState, StateFile

LATHES = (quick_lathe, bare_lathe)
NUMBER = st.floats() | st.sampled_from((0.0, 1.0, 20.0, 25.0, -3.0, 1e6, 1e15))
MAYBE = st.none() | NUMBER | st.booleans()
SAMPLE = st.builds(Sample, MAYBE, st.booleans(), st.just(0.0) | MAYBE)
REQUEST = st.builds(
    Request,
    st.sampled_from(RequestKind),
    st.text(max_size=3),
    st.sampled_from(("Z_um", "X_um", "")),
    MAYBE,
    MAYBE,
)
READING = st.builds(
    CycleReading,
    st.integers(0, 100).map(float) | NUMBER,
    st.lists(SAMPLE, max_size=4).map(tuple),
    st.lists(st.none() | SAMPLE, max_size=4).map(tuple),
    st.lists(st.sampled_from((True, True, False, None)), max_size=3).map(tuple),
    st.booleans(),
    st.none() | st.lists(MAYBE, max_size=3).map(tuple),
    st.none() | st.lists(MAYBE, max_size=3).map(tuple),
    st.sampled_from((False, False, True, None)),
    st.lists(REQUEST, max_size=3).map(tuple),
)


def play(compensation: Compensation, readings: Any, laws: Laws | None = None) -> None:
    state, output = cycle_state(compensation), None
    laws = Laws(compensation) if laws is None else laws
    for k in range(len(readings) if isinstance(readings, list) else 120):
        reading = readings[k] if isinstance(readings, list) else readings.reading(output)
        state, output = cycle(compensation, state, reading)
        laws.check(reading, state, output)


@pytest.mark.proof
@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.lists(READING, max_size=15), st.sampled_from(LATHES))
def test_any_readings_obey_the_laws(readings: Any, lathe: Any) -> None:
    play(lathe(), readings)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.integers(0, 10**9), st.sampled_from(LATHES))
def test_a_hostile_machine_obeys_the_laws(seed: int, lathe: Any) -> None:
    compensation = lathe()
    play(compensation, HostilePlant(compensation, seed))


def test_the_hostile_machine_visits_every_state() -> None:
    seen: set[SupervisorState] = set()
    for seed in range(20):
        compensation = quick_lathe()
        laws = Laws(compensation)
        play(compensation, HostilePlant(compensation, seed), laws)
        seen |= laws.seen
    assert seen == set(SupervisorState)


@pytest.mark.parametrize("lathe", LATHES)
@pytest.mark.parametrize("seed", range(2))
def test_a_state_goes_through_a_file_and_goes_on_as_if_nothing_had_been(
    lathe: Any, seed: int, tmp_path: Path
) -> None:
    compensation = lathe()
    limits = {name: replace(one, deadband_um=0.0) for name, one in compensation.limits.items()}
    compensation = replace(compensation, limits=limits)
    world = HostilePlant(compensation, seed)
    state, output = cycle_state(compensation), None
    file = StateFile(tmp_path / "state.json")
    for k in range(200):
        if k % 20 == 19:
            saved = SavedState(
                datetime(2026, 1, 1, k // 60, k % 60, tzinfo=UTC), 0.0, "", "", True, state
            )
            assert file.save(saved, compensation)
            loaded, why = StateFile(tmp_path / "state.json").load(compensation)
            assert loaded is not None, why
            restored = loaded.state._replace(goal_um=state.goal_um)
            assert same(restored, state)
            state = loaded.state
        reading = world.reading(output)
        kept, _ = cycle(compensation, state, reading)
        state, output = cycle(compensation, state, reading)
        assert same(kept, state)


@pytest.mark.parametrize(("lathe", "by_s"), [(quick_lathe, 4096.0), (bare_lathe, -1024.0)])
def test_another_clock_changes_nothing_but_the_times(lathe: Any, by_s: float) -> None:
    compensation = lathe()
    world = HostilePlant(compensation, 5)
    world.wickedness, world.time_s = 0.02, 0.0
    here, output, there = cycle_state(compensation), None, None
    for k in range(300):
        reading = world.reading(output)
        if type(reading.time_s) is float and math.isfinite(reading.time_s):
            exact_s = round(reading.time_s * 16.0) / 16.0
            world.time_s = exact_s
            reading = reading._replace(time_s=exact_s)
        if k == 50:
            there = shifted(here, by_s)
        here, output = cycle(compensation, here, reading)
        if there is not None:
            usable = type(reading.time_s) in {int, float} and abs(reading.time_s) < 1e14
            moved = reading._replace(time_s=reading.time_s + by_s) if usable else reading
            there, said = cycle(compensation, there, moved)
            assert said.state is output.state
            assert said.correction_um == output.correction_um
            assert said.answers == output.answers
            assert said.qualities == output.qualities
            assert same(shifted(there, -by_s), here)
