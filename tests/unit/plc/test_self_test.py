"""The self-test: it passes where the block is right, else it says which row is wrong."""

import ctypes
import re
import subprocess
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from tests.proofs import quick_first
from tests.unit.plc.equal_parts import FLAGS, CBlock, CLibrary, c_library, demanded_settings
from tests.unit.plc.mutants import every_mutant
from tests.unit.plc.plc_scenarios import random_settings, with_touches
from tests.unit.plc.st_to_c import st_as_c
from tests.unit.plc.test_tempcomp import settings_at
from thermaxis.compensation import SupervisorRules, SupervisorState
from thermaxis.plc import (
    LIBRARY,
    Block,
    GuideFacts,
    LineSettings,
    SelfTest,
    Target,
    export_settings,
    guide_text,
    self_test_of,
)

LINE = LineSettings(positions_mm=(100.0, 500.0), away=True, reference_mm=50.0)
BLOCKS = (
    Block(settings=random_settings(3)),
    Block(settings=demanded_settings(5, cycle_s=10.0, double=False)),
    Block(settings=settings_at(LINE.positions_mm, double=False), line=LINE),
    Block(settings=with_touches(random_settings(12), 3)),
)
TESTED = Block(settings=random_settings(8))
LIBRARY_MISTAKES = (
    "change_k := alpha * change_k; | * -> /",
    "quality := 6; | 6 -> 7",
    "correction_um := highest_um; | correction_um",
    "take_over := waiting AND connected AND all_read; | take_over",
)
NUMBERS = (
    "gain1_um_per_k",
    "alpha",
    "largest_um",
    "rate_step_um",
    "lowest_c",
    "highest_c",
    "step_k",
    "shortest_s",
    "longest_s",
)


@cache
def made(k: int) -> SelfTest:
    """Return the self-test of a block."""
    return self_test_of(BLOCKS[k])


def verdicts(
    texts: Mapping[str, Mapping[str, str]], calls: int, folder: Path
) -> dict[str, list[tuple[bool, bool, int]]]:
    """Return `done`, `passed` and `row` of the last block of some texts after every call."""
    made: dict[str, CBlock] = {}
    for name, files in texts.items():
        c = st_as_c(files.values(), name)
        files_of = ((f"{name}.h", c.header), (f"{name}.c", c.source))
        made[name] = CBlock(files_of, ("run",), ("done", "passed", "row"))
    library = CLibrary(c_library(made, folder, "-O0", "-w"))
    rows, starts = [(k != 0,) for k in range(calls)], [k == 0 for k in range(calls)]
    return {
        name: [(bool(d), bool(p), int(r)) for d, p, r in library.called(name, rows, starts, 3)]
        for name in texts
    }


@pytest.mark.proof
def test_it_passes_in_structured_text_whatever_the_model_and_not_before_its_last_call(
    tmp_path: Path,
) -> None:
    texts = {f"t{k}": {**block.st(), **made(k).st()} for k, block in enumerate(BLOCKS)}
    said = verdicts(texts, 2000, tmp_path)
    for k, name in enumerate(texts):
        test = made(k)
        assert 50 <= test.rows <= 66
        # Nothing happens in the call in which it is not run.
        assert said[name][test.calls] == (True, True, test.rows)
        assert said[name][test.calls - 1][:2] == (False, False)
        assert said[name][-1] == said[name][test.calls]


@pytest.mark.proof
@pytest.mark.parametrize(("cycle_s", "settle_s"), [(0.1, 60.0), (0.1, 300.0), (1.0, 1800.0)])
def test_a_wait_that_does_not_fit_ends_nothing_and_head_and_guide_say_what_is_left_out(
    cycle_s: float, settle_s: float
) -> None:
    compensation = random_settings(8, cycle_s=cycle_s, quick=False).compensation
    rules = replace(SupervisorRules(), settle_s=settle_s)
    settings = export_settings(
        replace(compensation, supervisor=rules), cycle_s=cycle_s, name="slow"
    )
    block = Block(settings=settings)
    test = self_test_of(block)
    states = {int(row.outputs.get("state", 0)) for row in test.values["rows"]}
    assert states == set(range(len(SupervisorState)))
    assert test.calls <= 5500 + settle_s / cycle_s
    assert "the hold of an operator for longer than 3600 s" in test.missing
    assert not any(one.startswith("state") for one in test.missing)
    facts = GuideFacts(Target("c"), tuple(test.c()), "v", self_test=test)
    guide = guide_text(settings, block, facts)
    assert f"does {test.rows} rows" in guide
    for one in test.missing:
        assert f"(* not in the rows: {one} *)" in test.st()[f"{test.name}.st"]
        assert f"/* not in the rows: {one} */" in test.c()[f"{test.name}.h"]
        assert one in guide


def test_a_state_for_which_there_are_not_calls_enough_is_named() -> None:
    said = self_test_of(BLOCKS[0], most_calls=10).missing
    assert "state 5 Fault" in said
    assert "state 1 Warming" not in said


@pytest.mark.parametrize("k", quick_first(1, range(len(BLOCKS))))
def test_scl_means_the_same_and_every_text_fits_the_target(k: int) -> None:
    block, test = BLOCKS[k], made(k)
    st = st_as_c({**block.st(), **test.st()}.values(), "t")
    cpu = "s7-1500" if block.settings.double else "s7-300"
    assert st_as_c({**block.scl(cpu), **test.scl(cpu)}.values(), "t") == st
    assert len(test.name) <= 24
    for text in (*test.st("twincat").values(), *test.scl(cpu).values(), *test.c().values()):
        assert text.isascii()
        assert max(map(len, text.splitlines())) <= 100
    assert k or self_test_of(block) == test


@pytest.mark.parametrize("k", quick_first(1, [0, 2]))
def test_in_c_it_is_a_function_that_returns_zero_or_the_row_that_is_wrong(
    k: int, tmp_path: Path
) -> None:
    block, test = BLOCKS[k], made(k)
    files = {**block.c(), **test.c()}
    files["main.c"] = f'#include "{test.name}.h"\nint run(void) {{ return {test.name}(); }}\n'
    assert c_verdict(files, tmp_path / "right") == 0
    wrong = files[f"{block.name}.c"].replace("alpha1 = ", "alpha1 = 1.1 * ")
    assert wrong != files[f"{block.name}.c"]
    assert 0 < c_verdict({**files, f"{block.name}.c": wrong}, tmp_path / "wrong") <= test.rows


def c_verdict(files: Mapping[str, str], folder: Path) -> int:
    folder.mkdir()
    for name, text in files.items():
        (folder / name).write_text(text, encoding="ascii")
    sources = [name for name in files if name.endswith(".c")]
    words = ["gcc", *FLAGS, "-O1", "-fPIC", "-shared", "-o", "run.so", *sources]
    built = subprocess.run(
        words, cwd=folder, capture_output=True, text=True, check=False, timeout=300
    )
    assert (built.returncode, built.stderr) == (0, "")
    verdict: int = ctypes.CDLL(str(folder / "run.so")).run()
    return verdict


@pytest.mark.proof
def test_a_mistake_in_a_number_of_the_block_or_in_the_library_fails_it(tmp_path: Path) -> None:
    """A tenth on a gain, a lag, a limit, a rate, a border; and single words of the library."""
    test = self_test_of(TESTED)
    block = TESTED.st()
    mistakes = [{f"{TESTED.name}.st": text} for text in changed(block)]
    mistakes += [{f"{LIBRARY}.st": text} for text in mutants()]
    texts = {f"m{k}": {**block, **wrong, **test.st()} for k, wrong in enumerate(mistakes)}
    for name, said in verdicts(texts, test.calls + 1, tmp_path).items():
        done, passed, row = said[-1]
        assert (done, passed) == (True, False), name
        assert 1 <= row <= test.rows


def changed(block: Mapping[str, str]) -> Iterator[str]:
    own = block[f"{TESTED.name}.st"]
    for key in NUMBERS:
        match = re.search(rf"\b{key}(?: : LREAL)? := (-?[\d.E+-]+)", own)
        assert match is not None, key
        first, last = match.span(1)
        yield f"{own[:first]}{float(match[1]) * 1.1!r}{own[last:]}"


def mutants() -> Iterator[str]:
    for part in LIBRARY_MISTAKES:
        yield next(mutant.text for mutant in every_mutant() if part in mutant.name)
