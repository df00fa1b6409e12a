"""The benchmark of the export: what it says of the vectors is measured, and ends in its time."""

import importlib.util
from itertools import count
from pathlib import Path
from types import ModuleType

import pytest

from tests.unit.plc.plc_scenarios import random_settings
from thermaxis.plc import Vectors


@pytest.fixture
def benchmark(root: Path) -> ModuleType:
    path = root / "benchmarks" / "plc_export.py"
    spec = importlib.util.spec_from_file_location("benchmark_of_the_export", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("longest_s", "step_s", "turns"), [(60.0, 0.001, 5), (60.0, 8.0, 3), (60.0, 45.0, 1)]
)
def test_no_turn_of_the_vectors_begins_that_would_end_after_its_time(
    benchmark: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    longest_s: float,
    step_s: float,
    turns: int,
) -> None:
    """The clock goes on by a step at every look; a turn has two of them."""
    made: list[object] = []

    def vectors_of(settings: object) -> Vectors:
        made.append(settings)
        return Vectors("", 7, 900, (), ())

    ticks = count()
    monkeypatch.setattr(benchmark, "vectors_of", vectors_of)
    every = [random_settings(seed) for seed in (1, 2)]
    timed = benchmark.vector_times(every, longest_s, lambda: step_s * next(ticks))
    assert made == every * turns
    assert [(t.rows, t.calls, t.turns) for t in timed] == [(7, 900, turns)] * 2
    assert all(t.seconds >= 0.0 for t in timed)


def test_the_models_whose_vectors_are_timed_are_examples_with_room_for_every_phase(
    benchmark: ModuleType,
) -> None:
    names = {benchmark.settings_of(path).names.block for path in benchmark.VECTORS}
    assert names == {"tx_lathe", "tx_eps1", "tx_spindle_table"}
    for path in benchmark.VECTORS:
        assert benchmark.settings_of(path).cycle_s == 1.0
