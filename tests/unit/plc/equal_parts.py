"""What the tests of equality share: recorded calls, and the three dialects run over them.

A record has every input and output of every call in the order of the block's variables. What must
come out is what `cycle` says in double precision, and what the executed tree says in REAL; every
text is compared with it in every call, to the last bit, but for the sign of a zero.
"""

import ctypes
import random
import shutil
import subprocess
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from tests.unit.plc.plc_scenarios import DURATIONS, CycleBlock, MoodPlant, random_settings
from tests.unit.plc.st_to_c import st_as_c
from thermaxis.plc import (
    Block,
    BlockInstance,
    CText,
    PlcOutputs,
    PlcSettings,
    PlcStep,
    Program,
    build_program,
    print_c,
    print_scl,
    print_st,
)
from thermaxis.plc.vectors import by_variable

Row = tuple[float | bool | int, ...]
Numbers = Any
"""Array of numbers, one row per call."""

_IDENTITY = ("model_id_1", "model_id_2")
FLAGS = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-ffp-contract=off")
"""What the exported source must stand without a warning."""


# ---- settings -----------------------------------------------------------------------------------


def demanded_settings(seed: int, *, cycle_s: float, double: bool) -> PlcSettings:
    """Return a random model; its rules are quick, quick in cycles, or those of a machine."""
    plain = random_settings(seed, cycle_s=cycle_s, double=double, quick=seed % 3 != 0)
    if seed % 3 != 1:
        return plain
    rules = plain.compensation.supervisor
    longer = {name: cycle_s * getattr(rules, name) for name in DURATIONS}
    sensors = {
        channel: replace(sensor, frozen_s=min(cycle_s * sensor.frozen_s, 3600.0))
        for channel, sensor in plain.compensation.sensors.items()
    }
    model = plain.compensation.model
    changed = replace(
        plain.compensation,
        model=replace(model, longest_hold_s=cycle_s * min(model.longest_hold_s, 30.0)),
        supervisor=replace(rules, **longer),
        sensors=sensors,
    )
    return replace(plain, compensation=changed)


# ---- records ------------------------------------------------------------------------------------


@dataclass
class Seen:
    """What occurred in some records; every number is a place in its enumeration."""

    states: set[int] = field(default_factory=set[int])
    transitions: set[tuple[int, int]] = field(default_factory=set[tuple[int, int]])
    reasons: int = 0
    outcomes: int = 0
    qualities: set[int] = field(default_factory=set[int])
    model_qualities: set[int] = field(default_factory=set[int])
    refused: int = 0
    at_limit: int = 0
    weighted: int = 0
    restarts: int = 0
    sections: set[int] = field(default_factory=set[int])
    channels: set[int] = field(default_factory=set[int])
    tables: set[bool] = field(default_factory=set[bool])
    calls: int = 0

    def add_model(self, settings: PlcSettings) -> None:
        parts = settings.compensation.model.layout.parts
        self.sections.add(sum(len(part.sections) for part in parts))
        self.channels.add(len(settings.names.channels))
        self.tables.add(any(part.gain_by_diameter for part in parts))

    def add(self, before: PlcOutputs | None, said: PlcOutputs, *, restart: bool) -> None:
        self.states.add(said.state)
        if before is not None and not restart:
            self.transitions.add((before.state, said.state))
        self.reasons |= said.fault_word
        self.outcomes |= said.outcome_word
        self.qualities.update(said.qualities)
        self.model_qualities.add(said.model_quality)
        self.refused += said.refused
        self.at_limit += any(said.at_limit)
        self.weighted += any(0.0 < weight < 1.0 for weight in said.weight)
        self.restarts += restart
        self.calls += 1

    def merge(self, other: "Seen") -> None:
        for name in ("states", "transitions", "qualities", "model_qualities"):
            getattr(self, name).update(getattr(other, name))
        for name in ("sections", "channels", "tables"):
            getattr(self, name).update(getattr(other, name))
        self.reasons |= other.reasons
        self.outcomes |= other.outcomes
        for name in ("refused", "at_limit", "weighted", "restarts", "calls"):
            setattr(self, name, getattr(self, name) + getattr(other, name))


@dataclass(frozen=True, slots=True)
class Record:
    """Calls of a block: what goes in, and what must come out."""

    outputs: tuple[str, ...]
    rows: list[Row]
    starts: list[bool]
    """Whether the PLC was switched on before a call."""
    wanted: Numbers


def columns(block: Block) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of a block's inputs, and of its outputs without the model's identity."""
    outputs = [v.name for v in block.outputs if v.name not in _IDENTITY]
    return tuple(v.name for v in block.inputs), tuple(outputs)


def recorded(settings: PlcSettings, steps: Iterable[PlcStep], seen: Seen | None = None) -> Record:
    """Return the calls of a block as a record: what it has said is what must come out."""
    names_in, names_out = columns(build_program(settings).blocks[-1])
    told, said = itemgetter(*names_in), itemgetter(*names_out)
    rows: list[Row] = []
    starts: list[bool] = []
    wanted: list[Row] = []
    before: PlcOutputs | None = None
    for inputs, outputs in steps:
        starts.append(inputs.restart or not rows)
        rows.append(told(by_variable(settings.names, inputs)))
        wanted.append(said(by_variable(settings.names, outputs)))
        if seen is not None:
            seen.add(before, outputs, restart=inputs.restart)
        before = outputs
    return Record(names_out, rows, starts, np.array(wanted, dtype=np.float64))


def shift(settings: PlcSettings, *, hours: float, seed: int, seen: Seen | None = None) -> Record:
    """Record hours with every fault, led by `cycle` in LREAL and by the executed tree in REAL."""
    block = CycleBlock(settings) if settings.double else BlockInstance(settings)
    calls = round(hours * 3600.0 / settings.cycle_s)
    return recorded(settings, MoodPlant(settings, seed).steps(block, calls), seen)


@lru_cache
def short_record(seed: int, *, double: bool) -> tuple[Program, Record]:
    """Return a random model and 600 calls of it at 10 s, for the tests of every dialect."""
    settings = demanded_settings(seed, cycle_s=10.0, double=double)
    record = shift(settings, hours=6000.0 / 3600.0, seed=seed)
    assert len(record.rows) == 600
    return build_program(settings), record


def difference(record: Record, got: Numbers) -> str:
    """Return the first call and output that differ, in hexadecimal too; empty where none does."""
    wanted = record.wanted[: len(got)]
    same = (wanted == got) | ((wanted != wanted) & (got != got))  # noqa: PLR0124 - NaN
    if same.all():
        return "" if len(got) == len(record.wanted) else f"nothing after call {len(got)}"
    call, column = (int(k) for k in np.argwhere(~same)[0])
    a, b = float(wanted[call, column]), float(got[call, column])
    name = record.outputs[column]
    return f"call {call}: {name} is {b!r} ({b.hex()}) instead of {a!r} ({a.hex()})"


# ---- C ------------------------------------------------------------------------------------------


def require_gcc() -> None:
    """Fail in words where there is no compiler."""
    if shutil.which("gcc") is None:
        pytest.fail("gcc is missing: install it (Debian: apt-get install gcc libc6-dev)")


class CBlock(NamedTuple):
    """A text in C with what goes in and comes out of its main block."""

    text: CText
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


def c_block(program: Program) -> CBlock:
    """Return the C of a program."""
    return CBlock(print_c(program), *columns(program.blocks[-1]))


def st_block(program: Program, text: str, name: str) -> CBlock:
    """Return a text of a program, which is no C, as C with another name."""
    return CBlock(st_as_c(text, name), *columns(program.blocks[-1]))


def c_library(blocks: Mapping[str, CBlock], folder: Path, *flags: str) -> Path:
    """Make one shared object of many blocks of one kind of number, with one call of gcc.

    By the name of each in its text; the flags are those besides what the exported text must stand.
    """
    require_gcc()
    folder.mkdir(parents=True, exist_ok=True)
    driver: list[str] = []
    for name, block in blocks.items():
        (folder / f"{name}.h").write_text(block.text.header, encoding="ascii")
        (folder / f"{name}.c").write_text(block.text.source, encoding="ascii")
        driver += _c_driver(name, block)
    (folder / "driver.c").write_text("\n".join(driver) + "\n", encoding="ascii")
    path = folder / "blocks.so"
    # What calls the blocks computes nothing, so it need not be optimised.
    _gcc(folder, *FLAGS, "-O0", "-c", "driver.c")
    sources = (f"{name}.c" for name in blocks)
    _gcc(folder, *FLAGS, *flags, "-shared", "-o", str(path), "driver.o", *sources)
    return path


def _gcc(folder: Path, *words: str) -> None:
    built = subprocess.run(
        ["gcc", "-fPIC", *words],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=900,
    )
    assert (built.returncode, built.stderr) == (0, ""), built.stderr[:4000]


class CLibrary:
    """A shared object of blocks, to be run over records."""

    def __init__(self, path: Path) -> None:
        self._library = ctypes.CDLL(str(path))

    def run(self, name: str, record: Record) -> Numbers:
        """Return what a block says in every call of a record."""
        return self.called(name, record.rows, record.starts, len(record.outputs))

    def called(
        self, name: str, inputs: Sequence[Row], starts: Sequence[bool], outputs: int
    ) -> Numbers:
        """Return what a block says in every call, with so many outputs."""
        rows = np.empty((len(inputs), 1 + len(inputs[0])))
        rows[:, 0] = starts
        rows[:, 1:] = inputs
        said = np.empty((len(rows), outputs))
        run: Callable[..., None] = getattr(self._library, f"run_{name}")
        run(rows.ctypes.data_as(_DOUBLES), said.ctypes.data_as(_DOUBLES), ctypes.c_long(len(rows)))
        return said


_DOUBLES = ctypes.POINTER(ctypes.c_double)


def _c_driver(name: str, block: CBlock) -> list[str]:
    """Return a function that runs a block over rows of numbers, the first of each a start."""
    return [
        f'#include "{name}.h"',
        f"void run_{name}(const double *in, double *out, long rows);",
        f"void run_{name}(const double *in, double *out, long rows)",
        "{",
        f"    static {name} b;",
        "    for (long row = 0; row < rows; row++) {",
        f"        if (in[0] != 0.0) {name}_init(&b);",
        *(f"        b.{variable} = in[{k}];" for k, variable in enumerate(block.inputs, start=1)),
        f"        {name}_step(&b);",
        *(f"        out[{k}] = b.{variable};" for k, variable in enumerate(block.outputs)),
        f"        in += {len(block.inputs) + 1};",
        f"        out += {len(block.outputs)};",
        "    }",
        "}",
    ]


# ---- a whole comparison -------------------------------------------------------------------------


class Task(NamedTuple):
    """One random model in one kind of number, over a scenario with faults."""

    seed: int
    cycle_s: float
    double: bool
    hours: float
    optimised: bool = True
    """Whether its C is compiled with -O2 too, not only with -O0."""
    libraries: tuple[tuple[str, Path, str], ...] = ()
    """What its texts are called, in which shared object each is, and what its name begins with."""

    @property
    def label(self) -> str:
        kind = "LREAL" if self.double else "REAL"
        return f"model {self.seed} at {self.cycle_s:g} s in {kind}"

    def settings(self) -> PlcSettings:
        return demanded_settings(self.seed, cycle_s=self.cycle_s, double=self.double)


class Comparison(NamedTuple):
    """What came of a task."""

    task: Task
    differences: dict[str, str]
    """By text; empty where nothing differs."""
    seen: Seen
    seconds: dict[str, float]


def compared(task: Task) -> Comparison:
    """Run every text of a model, and say where each first differs from what must come out.

    That is what `cycle` says in LREAL, and what the executed tree says in REAL.
    """
    settings = task.settings()
    seen, seconds, differences = Seen(), dict[str, float](), dict[str, str]()
    seen.add_model(settings)
    program = build_program(settings)
    clock = time.perf_counter
    begin_s = clock()
    record = shift(settings, hours=task.hours, seed=task.seed, seen=seen)
    seconds["what must come out"] = clock() - begin_s
    for name, path, symbol in task.libraries:
        begin_s = clock()
        found = difference(record, CLibrary(path).run(f"{symbol}{program.name}", record))
        differences[name], seconds[name] = found, clock() - begin_s
    return Comparison(task, differences, seen, seconds)


def texts_of(program: Program) -> dict[str, str]:
    """Return Structured Text, and SCL of the CPUs that know the program's numbers, by name."""
    texts = {"st": print_st(program), "s7-1500": print_scl(program, "s7-1500")}
    if not program.double:
        texts["s7-300"] = print_scl(program, "s7-300")
    return texts


def compared_together(tasks: Sequence[Task], folder: Path) -> list[Comparison]:
    """Compile every text of some models of one kind of number together, and run each of them."""
    begin_s = time.perf_counter()
    programs = [build_program(task.settings()) for task in tasks]
    c = {program.name: c_block(program) for program in programs}
    some = {p.name: c[p.name] for p, t in zip(programs, tasks, strict=True) if t.optimised}
    texts: dict[str, CBlock] = {}
    for program in programs:
        symbol = f"st_{program.name}"
        made = {st_block(program, text, symbol) for text in texts_of(program).values()}
        # Texts that mean the same, word by word, say the same: one is run for all.
        assert len(made) == 1, symbol
        texts[symbol] = made.pop()
    every = c_library(c | texts, folder / "-O0", "-O0")
    ways = [("-O0", every, ""), *((name, every, "st_") for name in texts_of(programs[0]))]
    optimised = [("-O2", c_library(some, folder / "-O2", "-O2"), "")] if some else []
    built_s = time.perf_counter() - begin_s
    found = [
        compared(task._replace(libraries=(*ways, *(optimised if task.optimised else ()))))
        for task in tasks
    ]
    found[0].seconds["gcc"] = built_s
    return found


# ---- numbers one step further -------------------------------------------------------------------


def next_number(value: float, *, double: bool, up: bool) -> float:
    """Return the neighbour of a number among those of the target."""
    if double:
        return float(np.nextafter(value, np.inf if up else -np.inf))
    return float(np.nextafter(np.float32(value), np.float32(np.inf if up else -np.inf)))


def shuffled(items: Iterable[Any], seed: int) -> list[Any]:
    """Return some things in a seeded order."""
    chosen = list(items)
    random.Random(seed).shuffle(chosen)  # noqa: S311 - a sample that can be repeated
    return chosen
