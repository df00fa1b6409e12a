"""How long the export of a block takes, beside reading its model, and the whole command.

One block is written from a model that was read; times of one thread, the best of several
turns in which all parts take part, so that a busy machine slows them alike. The vectors, which take
longest, are made of three models, whole, in as many turns as a minute has room for. The whole
command runs as a program of its own and also writes vectors, guide and report.

    python benchmarks/plc_export.py [--repetitions 5] [--vectors-s 60]
"""

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import NamedTuple

from thermaxis.compensation import Compensation, Limits, SensorRules
from thermaxis.files import model_sha256, read_model
from thermaxis.plc import (
    Block,
    GuideFacts,
    PlcSettings,
    Target,
    export_settings,
    guide_text,
    vectors_of,
)

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
MODEL = EXAMPLES / "machine" / "models" / "lathe.json"
VECTORS = (MODEL, EXAMPLES / "models" / "eps1.json", EXAMPLES / "models" / "spindle_table.json")
"""Models of which the whole course of the vectors is timed."""
MOST_TURNS = 5
"""Turns of which the best is taken. [1]"""
LONGEST_S = 0.3
"""The promise: a block is written in less. [s]"""


class VectorTime(NamedTuple):
    """How long the vectors of a model took."""

    rows: int
    """Rows. [1]"""
    calls: int
    """Calls that they stand for. [1]"""
    seconds: float
    """Shortest time of the thread. [s]"""
    turns: int
    """Turns of which it is the shortest. [1]"""


def settings_of(path: Path) -> PlcSettings:
    """Return an example model with stated limits, at a cycle of a second."""
    model = read_model(path)
    compensation = Compensation(
        model=model,
        sensors=dict.fromkeys(model.channels, SensorRules(lowest_c=5.0, highest_c=80.0)),
        limits={output.name: Limits(280.0, 0.5) for output in model.outputs},
    )
    digest = model_sha256(model)
    return export_settings(compensation, cycle_s=1.0, name=path.stem, model_sha256=digest)


def parts_of(settings: PlcSettings) -> dict[str, Callable[[], object]]:
    """Return what is timed, by its name."""
    block = Block(settings=settings)
    facts = GuideFacts(Target("c"), ("tx_lathe.c",), "tx_lathe.vectors.csv")
    return {
        "read the model": lambda: settings_of(MODEL),
        "write SCL": lambda: Block(settings=settings).scl(),
        "write ST": lambda: Block(settings=settings).st(),
        "write C": lambda: Block(settings=settings).c(),
        "guide": lambda: guide_text(settings, block, facts),
    }


def best_times(parts: dict[str, Callable[[], object]], repetitions: int) -> dict[str, float]:
    """Return the shortest time of every part. [s]"""
    best = dict.fromkeys(parts, float("inf"))
    for _ in range(repetitions):
        for name, part in parts.items():
            begin = time.thread_time()
            part()
            best[name] = min(best[name], time.thread_time() - begin)
    return best


def vector_times(
    settings: Iterable[PlcSettings], longest_s: float, clock: Callable[[], float]
) -> list[VectorTime]:
    """Return how long the whole course of every model takes.

    Parameters
    ----------
    settings : iterable of PlcSettings
        What is exported.
    longest_s : float
        No turn begins that would end later, as long as the longest one takes; one turn is always
        made, and a course has an end by itself: `MOST_CALLS`. [s]
    clock : callable
        Time that goes by while others work too. [s]

    Returns
    -------
    list of VectorTime
        By model, the best of at most `MOST_TURNS` turns.
    """
    timed: list[VectorTime] = []
    every = list(settings)
    end_s = clock() + longest_s
    longest_turn_s = 0.0
    for turn in range(1, MOST_TURNS + 1):
        turn_s = clock()
        if turn > 1 and turn_s + longest_turn_s > end_s:
            break
        for k, one in enumerate(every):
            begin_s = time.thread_time()
            vectors = vectors_of(one)
            spent_s = time.thread_time() - begin_s
            best_s = min([spent_s, *(t.seconds for t in timed[k : k + 1])])
            timed[k : k + 1] = [VectorTime(vectors.rows, vectors.calls, best_s, turn)]
        longest_turn_s = max(longest_turn_s, clock() - turn_s)
    return timed


def command_times(repetitions: int) -> tuple[float, float]:
    """Return the shortest wall time of the whole command, and of its help. [s]"""
    program = [sys.executable, "-m", "thermaxis", "export"]
    words = [str(MODEL), "--dialect", "scl", "--cycle-s", "1", "--limit", "280", "--rate", "0.5"]
    whole = helped = float("inf")
    for _ in range(repetitions):
        with tempfile.TemporaryDirectory() as folder:
            order = [*program, *words, "--plausible", "5:80", "-o", f"{folder}/plc"]
            begin = time.perf_counter()
            subprocess.run(order, check=True, capture_output=True)
            whole = min(whole, time.perf_counter() - begin)
            begin = time.perf_counter()
            subprocess.run([*program, "--help"], check=True, capture_output=True)
            helped = min(helped, time.perf_counter() - begin)
    return whole, helped


def main() -> int:
    """Print the table; 1 where the promise is not kept."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repetitions", type=int, default=5)
    parser.add_argument("--vectors-s", type=float, default=60.0)
    arguments = parser.parse_args()
    repetitions: int = arguments.repetitions
    best = best_times(parts_of(settings_of(MODEL)), repetitions)
    unit_s = best["read the model"]
    print(f"{'part':24} {'ms':>8} {'times reading the model':>24}")
    for name, seconds in best.items():
        print(f"{name:24} {1e3 * seconds:8.1f} {seconds / unit_s:24.1f}")
    every = [settings_of(path) for path in VECTORS]
    timed = vector_times(every, arguments.vectors_s, time.perf_counter)
    for one, t in zip(every, timed, strict=True):
        print(
            f"vectors of {one.names.block}: {t.rows} rows of {t.calls} calls in {t.seconds:.1f} s,"
            f" {1e3 * t.seconds / t.calls:.3f} ms a call, best of {t.turns}"
        )
    whole, helped = command_times(repetitions)
    print(f"whole command {whole:.2f} s, of which start and help {helped:.2f} s")
    slowest = max(seconds for name, seconds in best.items() if name.startswith("write"))
    print(f"one block: {slowest:.3f} s, promised: less than {LONGEST_S} s")
    return 0 if slowest < LONGEST_S else 1


if __name__ == "__main__":
    sys.exit(main())
