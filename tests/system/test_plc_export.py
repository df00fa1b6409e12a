"""The proof of the exported block: random models over a shift with faults, every text.

``PLC_MODELS=200`` compares more of them. The figures are printed; see them with ``pytest -s``.
Two programs share the work: each compiles a few models with one call of gcc for each way to
optimise, and runs every text of them over what must come out, which is computed once a model.
"""

import gc
import multiprocessing
import os
import sys
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import pytest
from blark.parse import parse_source_code

from tests.unit.plc.equal_parts import (
    Comparison,
    Seen,
    Task,
    compared_together,
)
from tests.unit.plc.plc_scenarios import OUTCOMES, REASONS, SAMPLE_QUALITIES, STATES
from tests.unit.plc.test_mutants import (
    NOT_NOTICED,
    Mutant,
    coefficients_in_real,
    every_mutant,
    excused,
    excuses_used,
    settings_with_everything,
    unnoticed,
)
from thermaxis.plc import build_program, print_st
from thermaxis.plc.blocks import NEVER_OUTCOMES, NEVER_QUALITIES

pytestmark = [pytest.mark.system, pytest.mark.timeout(1800)]

MODELS = int(os.environ.get("PLC_MODELS", "20"))
FAST_MODELS = MODELS // 20
FIRST_SEED = 46
"""From here on few models have one to four channels and one to eight sections."""
HOURS = 8.0
TOGETHER = 2
OPTIMISED = 4
"""One of so many models at 10 s, and every one at 1 s, is compiled with -O2 besides. [1]"""
BATCH = 10
"""Models in one call of gcc. [1]"""


class Demand(NamedTuple):
    """Everything that was compared."""

    comparisons: list[Comparison]
    seen: Seen


def tasks(*, double: bool) -> list[Task]:
    """Return models at 1 s, and twenty times as many others at 10 s."""
    fast = [Task(FIRST_SEED + MODELS + k, 1.0, double, HOURS) for k in range(FAST_MODELS)]
    return fast + [
        Task(FIRST_SEED + k, 10.0, double, HOURS, optimised=k % OPTIMISED == 0)
        for k in range(MODELS)
    ]


def batches() -> list[list[Task]]:
    """Return what is compared together, the longest first: one model at 1 s, or ten at 10 s."""
    made: list[list[Task]] = []
    for double in (True, False):
        every = tasks(double=double)
        slow = every[FAST_MODELS:]
        made += [[task] for task in every[:FAST_MODELS]]
        made += [slow[k : k + BATCH] for k in range(0, MODELS, BATCH)]
    return sorted(made, key=lambda batch: (batch[0].cycle_s, not batch[0].double))


@pytest.fixture(scope="module")
def pool(root: Path) -> Iterator[ProcessPoolExecutor]:
    """Start two programs that share the work; what one has recorded it keeps."""
    spawned = multiprocessing.get_context("spawn")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(sys, "path", [str(root), *sys.path])  # they find the tests as this one does
        # What was imported lives as long as they do: no need to look through it again and again.
        with ProcessPoolExecutor(TOGETHER, mp_context=spawned, initializer=gc.freeze) as started:
            yield started


@pytest.fixture(scope="module")
def demand(pool: ProcessPoolExecutor, tmp_path_factory: pytest.TempPathFactory) -> Demand:
    folder = tmp_path_factory.mktemp("equality")
    begin_s = time.perf_counter()
    every = batches()
    places = [folder / str(k) for k in range(len(every))]
    comparisons = [*chain.from_iterable(pool.map(compared_together, every, places))]
    seen, seconds = Seen(), defaultdict[str, float](float)
    for comparison in comparisons:
        seen.merge(comparison.seen)
        for name, spent_s in comparison.seconds.items():
            seconds[name] += spent_s
    texts = sum(len(comparison.differences) for comparison in comparisons)
    print(f"\n{texts} texts of {len(comparisons)} programs, {seen.calls} calls each of its program")
    print(f"{os.cpu_count()} cores; in {TOGETHER} programs:")
    print("\n".join(f"{name}: {spent_s:.1f} s" for name, spent_s in seconds.items()))
    print(f"together {time.perf_counter() - begin_s:.0f} s\n{seen}")
    return Demand(comparisons, seen)


def missed_of(
    pool: ProcessPoolExecutor, chosen: Sequence[Mutant], folder: Path, dialect: str, *, double: bool
) -> list[str]:
    """Return the mutants that nothing shows; each program looks at every other one."""
    parts = [chosen[k::TOGETHER] for k in range(TOGETHER)]
    places = [folder / str(k) for k in range(TOGETHER)]
    missing = partial(unnoticed, dialect=dialect, double=double)
    missed = [*chain.from_iterable(pool.map(missing, parts, places))]
    kind = "LREAL" if double else "REAL"
    print(f"\n{dialect} in {kind}: {len(chosen) - len(missed)} of {len(chosen)} mutants noticed")
    return missed


@pytest.mark.parametrize("double", [True, False])
@pytest.mark.parametrize("text", ["st", "s7-1500", "s7-300", "-O0", "-O2"])
def test_every_text_of_every_model_says_what_must_come_out_to_the_last_bit(
    demand: Demand, text: str, double: bool
) -> None:
    mine = [c for c in demand.comparisons if c.task.double == double]
    wrong = [f"{c.task.label}: {c.differences[text]}" for c in mine if c.differences.get(text)]
    assert wrong == []
    there = sum(text in c.differences for c in mine)
    models = {"-O2": MODELS // OPTIMISED, "s7-300": 0 if double else MODELS}.get(text, MODELS)
    assert there == models + (FAST_MODELS if models else 0)


def test_the_models_and_the_shifts_are_those_that_are_demanded(demand: Demand) -> None:
    assert demand.seen.sections == set(range(1, 9))
    assert demand.seen.channels == set(range(1, 5))
    assert demand.seen.tables == {True, False}
    assert demand.seen.calls == 2 * (MODELS * 2880 + FAST_MODELS * 28_800)


def test_whatever_can_occur_did_occur(demand: Demand) -> None:
    seen = demand.seen
    assert seen.states == set(range(len(STATES)))
    assert seen.reasons == 2 ** len(REASONS) - 1
    assert seen.outcomes == sum(2**k for k, o in enumerate(OUTCOMES) if o not in NEVER_OUTCOMES)
    assert seen.qualities == {k for k, q in enumerate(SAMPLE_QUALITIES) if q not in NEVER_QUALITIES}
    assert seen.model_qualities == {0, 1, 2}
    assert min(seen.refused, seen.at_limit, seen.weighted, seen.restarts) > 100
    off, warming, active, holding, fading, fault = range(6)
    assert seen.transitions >= {
        (off, warming), (warming, active), (warming, off), (warming, fading), (warming, fault),
        (active, holding), (active, fading), (active, fault), (active, off), (holding, active),
        (holding, fading), (holding, fault), (fading, off), (fading, warming), (fading, active),
        (fading, fault), (fault, fading), (fault, off),
    }  # fmt: skip


def test_another_grammar_reads_a_whole_program() -> None:
    text = print_st(build_program(settings_with_everything()), "twincat")
    assert parse_source_code(text).exception is None


def test_every_coefficient_in_real_is_noticed_when_it_is_the_next_number(
    pool: ProcessPoolExecutor, tmp_path: Path
) -> None:
    assert missed_of(pool, coefficients_in_real(), tmp_path, "st", double=False) == []


def test_every_mutant_is_noticed(pool: ProcessPoolExecutor, tmp_path: Path) -> None:
    """In C; a sample in Structured Text is looked at in every run of the tests."""
    missed = missed_of(pool, every_mutant("c"), tmp_path, "c", double=True)
    assert [name for name in missed if not excused(name)] == []
    assert excuses_used(missed) == set(NOT_NOTICED)
