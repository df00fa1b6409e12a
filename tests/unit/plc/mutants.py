"""Mutants of the library's Structured Text: one word changed, and what must notice it.

A word is a comparison, a sign, a truth, a logical word, a number, or a statement left out. What a
mutant says is compared in every call with what `cycle` says, for a few models with faults and for
rows that are stated call by call.
"""

import random
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Any, NamedTuple

from tests.unit.plc.equal_parts import (
    CBlock,
    CLibrary,
    Record,
    built,
    c_written,
    columns,
    difference,
    recorded,
)
from tests.unit.plc.plc_scenarios import (
    MoodPlant,
    corrections_of,
    quiet_inputs,
    with_touches,
)
from tests.unit.plc.st_to_c import st_as_c
from tests.unit.plc.test_block import every_stated, some_settings
from tests.unit.plc.test_touch import every_touched
from thermaxis.plc import LIBRARY, TOUCH, Block, CycleBlock, PlcSettings, PlcStep, st_library

SEEDS = (*range(10), 21)
CALLS = 1200
_NAME = "m"
_QUICK = ("-std=c99", "-O0", "-w", "-Wl,-Bsymbolic")
_CHANGES = {
    "<=": ">", ">=": "<", "<": ">=", ">": "<=", "=": ">", "AND": "OR", "OR": "AND", "+": "-",
    "-": "+", "TRUE": "FALSE", "FALSE": "TRUE", "NOT ": "", "*": "/", "/": "*",
}  # fmt: skip
_BORDERS = {"<=": "<", ">=": ">", "<": "<=", ">": ">="}
_WORD = re.compile(r"(?<![:<>])(?:<=|>=|<|>|=)(?!=)|\bAND\b|\bOR\b|\bTRUE\b|\bFALSE\b|\bNOT |"
                   r"(?<= )[-+*/](?= )|(?<![\w.+])\d+(?![\w.])")  # fmt: skip
_TIME = re.compile(r"_s\b")
_STATEMENT = re.compile(r"^ +\w+ := [^;,]*;$", re.MULTILINE)
_BODY = re.compile(r"^FUNCTION_BLOCK (\w+)\n.*?^END_VAR\n(?!VAR)(.*?)^END_FUNCTION_BLOCK",
                   re.MULTILINE | re.DOTALL)  # fmt: skip


class Mutant(NamedTuple):
    """A library with one mistake."""

    name: str
    """Block, line and change."""
    text: str


def every_mutant(library: str = LIBRARY) -> list[Mutant]:
    """Return the mutants of every statement of a library, in an order that is the same."""
    chosen = list(_mutants(st_library(library, double=True)))
    if library != LIBRARY:
        chosen = [m._replace(text=st_library(double=True) + m.text) for m in chosen]
    random.Random(1).shuffle(chosen)  # noqa: S311 - a sample that can be repeated
    return chosen


def _mutants(text: str) -> Iterator[Mutant]:
    for body in _BODY.finditer(text):
        first, last = body.span(2)
        remarks = [m.span() for m in re.finditer(r"\(\*.*?\*\)", text)]
        for found in _WORD.finditer(text, first, last):
            if any(a <= found.start() < b for a, b in remarks):
                continue
            word = found[0]
            other = str(int(word) + 1) if word.isdigit() else _CHANGES[word]
            yield _changed(text, body[1], found.span(), other)
            line = text[text.rfind("\n", 0, found.start()) : found.end()]
            if word in _BORDERS and _TIME.search(line):
                yield _changed(text, body[1], found.span(), _BORDERS[word])
        for found in _STATEMENT.finditer(text, first, last):
            yield _changed(text, body[1], found.span(), "")


def _changed(text: str, block: str, span: tuple[int, int], other: str) -> Mutant:
    begin = text.rfind("\n", 0, span[0]) + 1
    line = " ".join(text[begin : text.index("\n", span[1])].split())
    number = text.count("\n", 0, span[0]) + 1
    name = (
        f"{block} line {number}: {line} | {text[span[0] : span[1]].strip()} -> {other or 'nothing'}"
    )
    return Mutant(name, text[: span[0]] + other + text[span[1] :])


@lru_cache
def courses(library: str = LIBRARY) -> list[tuple[Block, Callable[[], Record]]]:
    """Return the models with what makes their records: most mutants are noticed by the first."""
    made: list[tuple[Block, Callable[[], Record]]] = []
    for place, (settings, rows, values) in enumerate(
        every_touched() if library == TOUCH else every_stated()
    ):
        named = replace(settings, name=f"stated {place}")
        made.append((Block(settings=named), cache(partial(_stated, named, rows, values))))
    for seed in SEEDS:
        settings = with_all_limits(some_settings(seed), seed)
        if library == TOUCH:
            settings = with_touches(settings, seed)
        made.append((Block(settings=settings), cache(partial(_faulty, settings, seed))))
    return made


def _faulty(settings: PlcSettings, seed: int) -> Record:
    steps = MoodPlant(settings, 77 + seed).steps(CycleBlock(settings), CALLS)
    return recorded(settings, steps)


def _stated(settings: PlcSettings, rows: list[dict[str, Any]], values: list[float]) -> Record:
    block, sent = CycleBlock(settings), (0.0,) * len(settings.names.outputs)
    steps: list[PlcStep] = []
    for call, row in enumerate(rows):
        told = quiet_inputs(settings, values, sent) | {"enable": call > 0} | row
        steps.append(PlcStep(told, block.step(told)))
        sent = corrections_of(settings, steps[-1].outputs)
    return recorded(settings, steps)


def with_all_limits(settings: PlcSettings, seed: int) -> PlcSettings:
    """Return settings in which time limits of every length occur over the seeds."""
    rng = random.Random(seed)  # noqa: S311 - a test that can be repeated
    limits = {
        name: replace(one, total_um=max(one.total_um, one.largest_um + rng.choice((0.0, 1.5))))
        for name, one in settings.compensation.limits.items()
    }
    return replace(settings, compensation=replace(settings.compensation, limits=limits))


def unnoticed(mutants: Sequence[Mutant], folder: Path, library: str = LIBRARY) -> list[str]:
    """Return the names of mutants of a library that say in every call what they must.

    A mistake changes no declaration: the blocks are compiled once, with each library linked anew.
    """
    tried = courses(library)
    every = [block for block, _ in tried]
    right = "".join(st_library(name, double=True) for name in dict.fromkeys((LIBRARY, library)))
    texts = [right, *(block.st()[f"{block.name}.st"] for block in every)]
    c, begin = st_as_c(texts, _NAME, apart=True), st_as_c([right], _NAME, apart=True).source
    include = f'#include "{_NAME}.h"\n'
    shared = ((f"{_NAME}.h", c.header), ("blocks.c", include + c.source.removeprefix(begin)))
    blocks = {
        own: CBlock((*shared, (f"{own}.h", include)), *columns(block))
        for block in every
        for own in [f"{_NAME}_{block.name}"]
    }
    c_written(blocks, folder)
    built(folder, "gcc", *_QUICK, "-c", "driver.c", "blocks.c")
    return [m.name for k, m in enumerate(mutants) if not _noticed(m, k, folder, tried)]


def _noticed(
    mutant: Mutant,
    number: int,
    folder: Path,
    tried: Sequence[tuple[Block, Callable[[], Record]]],
) -> bool:
    source, path = f"{number}.c", folder / f"{number}.so"
    (folder / source).write_text(st_as_c([mutant.text], _NAME, apart=True).source, "ascii")
    built(folder, "gcc", *_QUICK, "-shared", "-o", str(path), "driver.o", "blocks.o", source)
    library = CLibrary(path)
    return any(
        difference(record(), library.run(f"{_NAME}_{block.name}", record()))
        for block, record in tried
    )
