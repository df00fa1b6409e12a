"""What the tests of equality share: recorded calls, and the three dialects run over them.

A record has every input and output of every call in the order of the block's variables. What must
come out in LREAL is what `cycle` says, to the last bit, but for the sign of a zero. In REAL every
text must say the same to the last bit, and what `cycle` says within a tolerance.
"""

import ctypes
import shutil
import subprocess
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from tests.unit.plc.plc_scenarios import (
    DURATIONS,
    MoodPlant,
    random_settings,
    with_touches,
    with_witness,
)
from tests.unit.plc.st_to_c import st_as_c
from thermaxis.plc import (
    TOLERANCE_UM,
    Block,
    CycleBlock,
    PlcSettings,
    PlcStep,
)

Row = tuple[float | bool | int, ...]
Numbers = Any
"""Array of numbers, one row per call."""

FLAGS = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-ffp-contract=off")
"""What the exported source must stand without a warning."""


# ---- settings -----------------------------------------------------------------------------------


def demanded_settings(seed: int, *, cycle_s: float, double: bool) -> PlcSettings:
    """Return a random model; its rules are quick, quick in cycles, or those of a machine."""
    plain = random_settings(seed, cycle_s=cycle_s, double=double, quick=seed % 3 != 0)
    if seed % 3 != 1:
        return with_witness(plain, seed)
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
    return with_witness(replace(plain, compensation=changed), seed)


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

    def add(self, before: Mapping[str, Any], said: Mapping[str, Any], *, restart: bool) -> None:
        self.states.add(said["state"])
        if before and not restart:
            self.transitions.add((before["state"], said["state"]))
        self.reasons |= said["fault_word"]
        self.outcomes |= said["outcome_word"]
        self.qualities.update(starting(said, "quality_"))
        self.model_qualities.add(said["model_quality"])
        self.refused += said["refused"]
        self.at_limit += any(starting(said, "limit_"))
        self.weighted += any(0.0 < weight < 1.0 for weight in starting(said, "weight_"))
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


def starting(said: Mapping[str, Any], prefix: str) -> list[Any]:
    """Return the outputs whose names start so."""
    return [value for name, value in said.items() if name.startswith(prefix)]


@dataclass(frozen=True, slots=True)
class Record:
    """Calls of a block: what goes in, and what must come out."""

    outputs: tuple[str, ...]
    rows: list[Row]
    starts: list[bool]
    """Whether the PLC was switched on before a call."""
    wanted: Numbers


def columns(block: Block) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of a block's inputs, and of its outputs without the identity."""
    face = block.interface
    return tuple(v.name for v in face.inputs), tuple(v.name for v in face.outputs)


def recorded(settings: PlcSettings, steps: Iterable[PlcStep], seen: Seen | None = None) -> Record:
    """Return the calls of a block as a record: what it has said is what must come out."""
    names_in, names_out = columns(Block(settings=settings))
    told, said = itemgetter(*names_in), itemgetter(*names_out)
    rows: list[Row] = []
    starts: list[bool] = []
    wanted: list[Row] = []
    before: Mapping[str, Any] = {}
    for inputs, outputs in steps:
        starts.append(not rows)  # from then on `init` alone begins anew
        rows.append(told(inputs))
        wanted.append(said(outputs))
        if seen is not None:
            seen.add(before, outputs, restart=inputs["init"])
        before = outputs
    return Record(names_out, rows, starts, np.array(wanted, dtype=np.float64))


def shift(settings: PlcSettings, *, hours: float, seed: int, seen: Seen | None = None) -> Record:
    """Record hours with every fault, led by `cycle`."""
    calls = round(hours * 3600.0 / settings.cycle_s)
    return recorded(settings, MoodPlant(settings, seed).steps(CycleBlock(settings), calls), seen)


@lru_cache
def short_record(seed: int, *, double: bool) -> tuple[Block, Record]:
    """Return a random model and 600 calls of it at 10 s, for the tests of every dialect."""
    settings = demanded_settings(seed, cycle_s=10.0, double=double)
    record = shift(settings, hours=6000.0 / 3600.0, seed=seed)
    assert len(record.rows) == 600
    return Block(settings=settings), record


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
    """Files of C with what goes in and comes out of their main block."""

    files: tuple[tuple[str, str], ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


def c_block(block: Block) -> CBlock:
    """Return the C of a block."""
    return CBlock(tuple(block.c().items()), *columns(block))


def st_block(block: Block, texts: Mapping[str, str], name: str) -> CBlock:
    """Return the texts of a block, which are no C, as C with another name."""
    c = st_as_c(texts.values(), name)
    return CBlock(((f"{name}.h", c.header), (f"{name}.c", c.source)), *columns(block))


def c_library(
    blocks: Mapping[str, CBlock], folder: Path, *flags: str, compiler: str = "gcc"
) -> Path:
    """Make one shared object of many blocks of one kind of number, with one call of gcc.

    By the name of each in its text; the flags are those besides what the exported text must stand.
    """
    sources = c_written(blocks, folder)
    path = folder / "blocks.so"
    # What calls the blocks computes nothing, so it need not be optimised.
    built(folder, "gcc", *FLAGS, "-O0", "-c", "driver.c")
    used = FLAGS if compiler != "tcc" else ()
    built(folder, compiler, *used, *flags, "-shared", "-o", str(path), "driver.o", *sources)
    return path


def c_written(blocks: Mapping[str, CBlock], folder: Path) -> list[str]:
    """Write the files of blocks and `driver.c`, which runs them; return their sources."""
    folder.mkdir(parents=True, exist_ok=True)
    driver: list[str] = []
    files: dict[str, str] = {}
    for name, block in blocks.items():
        files |= block.files
        driver += _c_driver(name, block)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="ascii")
    (folder / "driver.c").write_text("\n".join(driver) + "\n", encoding="ascii")
    return [name for name in files if name.endswith(".c")]


def built(folder: Path, compiler: str, *words: str) -> None:
    """Let a compiler work in a folder without a warning."""
    require_gcc()
    done = subprocess.run(
        [compiler, "-fPIC", *words],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=900,
    )
    assert (done.returncode, done.stderr) == (0, ""), done.stderr[:4000]


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
        long, place = ctypes.c_long(len(rows)), ctypes.c_int(0)
        self.function(name)(
            rows.ctypes.data_as(_DOUBLES), said.ctypes.data_as(_DOUBLES), long, place
        )
        return said

    def function(self, name: str) -> Callable[..., None]:
        """Return what runs a block: rows in, rows out, their number, and which instance."""
        run: Callable[..., None] = getattr(self._library, f"run_{name}")
        return run


_DOUBLES = ctypes.POINTER(ctypes.c_double)


def _c_driver(name: str, block: CBlock) -> list[str]:
    """Return a function that runs a block over rows of numbers, the first of each a start."""
    return [
        f'#include "{name}.h"',
        f"void run_{name}(const double *in, double *out, long rows, int place);",
        f"void run_{name}(const double *in, double *out, long rows, int place)",
        "{",
        f"    static {name} every[8];",
        f"    {name} *b = &every[place];",
        "    for (long row = 0; row < rows; row++) {",
        f"        if (in[0] != 0.0) {name}_init(b);",
        *(f"        b->{variable} = in[{k}];" for k, variable in enumerate(block.inputs, start=1)),
        f"        {name}_step(b);",
        *(f"        out[{k}] = b->{variable};" for k, variable in enumerate(block.outputs)),
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
    touched: bool = False

    @property
    def label(self) -> str:
        kind = "LREAL" if self.double else "REAL"
        return f"model {self.seed} at {self.cycle_s:g} s in {kind}"

    def settings(self) -> PlcSettings:
        plain = demanded_settings(self.seed, cycle_s=self.cycle_s, double=self.double)
        return with_touches(plain, self.seed) if self.touched else plain


class Comparison(NamedTuple):
    """What came of a task."""

    task: Task
    differences: dict[str, str]
    """By text; empty where nothing differs."""
    away_um: float
    """Largest distance of a model's displacement from that of `cycle`. [µm]"""
    seen: Seen


def texts_of(block: Block) -> dict[str, dict[str, str]]:
    """Return Structured Text, and SCL of the CPUs that know the block's numbers, by name."""
    texts = {"st": block.st(), "s7-1500": block.scl("s7-1500")}
    if not block.settings.double:
        texts["s7-300"] = block.scl("s7-300")
    return texts


def compared_together(tasks: Sequence[Task], folder: Path) -> list[Comparison]:
    """Compile every text of some models of one kind of number together, and run each of them."""
    blocks = [Block(settings=task.settings()) for task in tasks]
    c = {block.name: c_block(block) for block in blocks}
    texts: dict[str, CBlock] = {}
    for block in blocks:
        symbol = f"st_{block.name}"
        made = {st_block(block, text, symbol) for text in texts_of(block).values()}
        # Texts that mean the same, word by word, say the same: one is run for all.
        assert len(made) == 1, symbol
        texts[symbol] = made.pop()
    library = CLibrary(c_library(c | texts, folder, "-O1"))
    found: list[Comparison] = []
    for task, block in zip(tasks, blocks, strict=True):
        seen = Seen()
        seen.add_model(block.settings)
        record = shift(block.settings, hours=task.hours, seed=task.seed, seen=seen)
        in_c = library.run(block.name, record)
        in_st = library.run(f"st_{block.name}", record)
        differences = {"st": difference(replace(record, wanted=in_c), in_st)}
        if task.double:
            differences["c"] = difference(record, in_c)
        model = [k for k, name in enumerate(record.outputs) if name.startswith("model_")]
        away_um = float(np.max(np.abs(in_c[:, model] - record.wanted[:, model])))
        if away_um > TOLERANCE_UM:
            differences["from the cycle"] = f"{away_um} um"
        found.append(Comparison(task, differences, away_um, seen))
    return found
