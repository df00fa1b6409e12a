"""The whole proof of the exported block: 200 random models over a shift with faults, every text.

The figures are printed; see them with ``pytest -s``. Two comparisons run side by side.
"""

import multiprocessing
import os
import platform
import time
from collections import defaultdict
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.unit.plc.equal_parts import (
    CLibrary,
    Comparison,
    Seen,
    Task,
    c_block,
    c_library,
    compared,
    difference,
    shift,
)
from tests.unit.plc.plc_scenarios import OUTCOMES, REASONS, SAMPLE_QUALITIES, STATES
from tests.unit.plc.test_build import NEVER, NEVER_SAMPLE
from tests.unit.plc.test_c import float_away_from_double
from tests.unit.plc.test_mutants import (
    NOT_NOTICED,
    coefficients_in_real,
    every_mutant,
    excused,
    excuses_used,
    unnoticed_in_c,
    unnoticed_in_st,
)
from thermaxis.compensation import Reason
from thermaxis.plc._build import build_program

pytestmark = [pytest.mark.system, pytest.mark.timeout(1800)]

MODELS, FAST_MODELS = 200, 10
HOURS = 8.0
TOGETHER = 2


class Demand(NamedTuple):
    """Everything that was compared."""

    comparisons: list[Comparison]
    seen: Seen
    folder: Path


def tasks(*, double: bool) -> list[Task]:
    """Return 200 models at 10 s, and ten more at 1 s; the longest first."""
    fast = [Task(MODELS + k, 1.0, double, HOURS) for k in range(FAST_MODELS)]
    return fast + [Task(seed, 10.0, double, HOURS) for seed in range(MODELS)]


def library(every: Iterable[Task], folder: Path, *flags: str, contracted: bool = False) -> Path:
    programs = [build_program(task.settings()) for task in every]
    blocks = {program.name: c_block(program) for program in programs}
    return c_library(blocks, folder, *flags, contracted=contracted)


@pytest.fixture(scope="module")
def demand(tmp_path_factory: pytest.TempPathFactory) -> Demand:
    folder = tmp_path_factory.mktemp("equality")
    begin_s = time.perf_counter()
    wanted = [(double, flag) for flag in ("-O2", "-O0") for double in (True, False)]
    with ThreadPoolExecutor(TOGETHER) as builders:
        made = {
            (double, flag): builders.submit(
                library, tasks(double=double), folder / f"{flag}{double}", flag
            )
            for double, flag in wanted
        }
        paths = {key: future.result() for key, future in made.items()}
    built_s = time.perf_counter() - begin_s
    every = [
        task._replace(libraries=tuple((f, paths[task.double, f]) for f in ("-O0", "-O2")))
        for double in (True, False)
        for task in tasks(double=double)
    ]
    every.sort(key=lambda task: task.cycle_s)
    spawned = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(TOGETHER, mp_context=spawned) as runners:
        comparisons = list(runners.map(compared, every, chunksize=4))
    seen, seconds = Seen(), defaultdict[str, float](float)
    for comparison in comparisons:
        seen.merge(comparison.seen)
        for name, spent_s in comparison.seconds.items():
            seconds[name] += spent_s
    texts = sum(len(comparison.differences) for comparison in comparisons)
    print(f"\n{texts} texts of {len(comparisons)} programs, {seen.calls} calls each of its program")
    print(f"gcc: {len(every) * 2} sources in {built_s:.0f} s; {os.cpu_count()} cores")
    print("\n".join(f"{name}: {spent_s:.1f} s" for name, spent_s in seconds.items()))
    print(f"together {time.perf_counter() - begin_s:.0f} s\n{seen}")
    return Demand(comparisons, seen, folder)


@pytest.mark.parametrize("double", [True, False])
@pytest.mark.parametrize("text", ["st", "s7-1500", "s7-300", "-O0", "-O2"])
def test_every_text_of_every_model_says_what_must_come_out_to_the_last_bit(
    demand: Demand, text: str, double: bool
) -> None:
    mine = [c for c in demand.comparisons if c.task.double == double]
    wrong = [f"{c.task.label}: {c.differences[text]}" for c in mine if c.differences.get(text)]
    assert wrong == []
    there = sum(text in c.differences for c in mine)
    assert there == (0 if double and text == "s7-300" else MODELS + FAST_MODELS)


def test_the_models_and_the_shifts_are_those_that_are_demanded(demand: Demand) -> None:
    assert demand.seen.sections == set(range(1, 9))
    assert demand.seen.channels == set(range(1, 5))
    assert demand.seen.tables == {True, False}
    assert demand.seen.calls == 2 * (MODELS * 2880 + FAST_MODELS * 28_800)


def test_whatever_can_occur_did_occur(demand: Demand) -> None:
    seen = demand.seen
    assert seen.states == set(range(len(STATES)))
    # An offset outside its total is a fault only where it stands there after a lost connection.
    outside = 2 ** REASONS.index(Reason.OFFSET_OUTSIDE)
    assert seen.reasons | outside == 2 ** len(REASONS) - 1
    assert seen.outcomes == 2 ** len(OUTCOMES) - 1 - sum(2 ** OUTCOMES.index(o) for o in NEVER)
    assert seen.qualities == {k for k, q in enumerate(SAMPLE_QUALITIES) if q not in NEVER_SAMPLE}
    assert seen.model_qualities == {0, 1, 2}
    assert min(seen.refused, seen.at_limit, seen.weighted, seen.restarts) > 100
    off, warming, active, holding, fading, fault = range(6)
    assert seen.transitions >= {
        (off, warming), (warming, active), (warming, off), (warming, fading), (warming, fault),
        (active, holding), (active, fading), (active, fault), (active, off), (holding, active),
        (holding, fading), (holding, fault), (fading, off), (fading, warming), (fading, active),
        (fading, fault), (fault, fading), (fault, off),
    }  # fmt: skip


def test_what_contraction_would_change_is_measured(demand: Demand) -> None:
    """For information: gcc contracts where the processor can, unless it is told not to."""
    some = [task for task in tasks(double=True) if task.cycle_s == 10.0][:20]
    paths = {
        name: library(some, demand.folder / name, *flags, contracted=True)
        for name, flags in {"plain": ("-O2",), "native": ("-O2", "-march=native")}.items()
    }
    for name, path in paths.items():
        differing = 0
        for task in some:
            record = shift(task.settings(), hours=1.0, seed=task.seed)
            said = CLibrary(path).run(build_program(task.settings()).name, record)
            differing += difference(record, said) != ""
        print(f"\ncontraction allowed, {name} processor: {differing} of {len(some)} models differ")
        if name == "plain" and platform.machine() in {"x86_64", "AMD64"}:
            # Without the newer instructions there is nothing to contract to.
            assert differing == 0


@pytest.mark.parametrize("name", ["eps1", "eps2"])
def test_compiled_float_stays_within_two_nanometres_of_double_in_a_shift_of_the_papers_models(
    name: str, tmp_path: Path
) -> None:
    largest_um, span_um = float_away_from_double(name, HOURS, tmp_path)
    print(f"\n{name}: float differs by {largest_um:.2e} um of a span of {span_um:.1f} um")
    assert span_um > 10.0
    assert 0.0 < largest_um < 0.002


def test_every_mutant_of_structured_text_is_noticed() -> None:
    chosen = every_mutant("st")
    missed = unnoticed_in_st(chosen)
    print(f"\nST: {len(chosen) - len(missed)} of {len(chosen)} mutants noticed")
    assert [name for name in missed if not excused(name)] == []
    assert excuses_used(missed) == set(NOT_NOTICED)


def test_every_coefficient_in_real_is_noticed_when_it_is_the_next_number() -> None:
    chosen = coefficients_in_real()
    missed = unnoticed_in_st(chosen, double=False)
    print(f"\nST in REAL: {len(chosen) - len(missed)} of {len(chosen)} mutants noticed")
    assert missed == []


def test_every_mutant_of_c_is_noticed(tmp_path: Path) -> None:
    chosen = every_mutant("c")
    missed = unnoticed_in_c(chosen, tmp_path)
    print(f"\nC: {len(chosen) - len(missed)} of {len(chosen)} mutants noticed")
    assert [name for name in missed if not excused(name)] == []
    assert excuses_used(missed) == set(NOT_NOTICED)
