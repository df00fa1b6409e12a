"""How long the export of a block takes, beside reading its model, and the whole command.

One block is built and printed from a model that was read; times of one thread, the best of several
turns in which all parts take part, so that a busy machine slows them alike. The whole command runs
as a program of its own and also writes vectors, guide and report.

    python benchmarks/plc_export.py [--repetitions 5]
"""

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from thermaxis.compensation import Compensation, Limits, SensorRules
from thermaxis.files.model_json import model_sha256, read_model
from thermaxis.plc._build import build_program
from thermaxis.plc._guide import GuideFacts, guide_text
from thermaxis.plc._print_c import print_c
from thermaxis.plc._print_scl import print_scl
from thermaxis.plc._print_st import print_st
from thermaxis.plc._report import Target
from thermaxis.plc._settings import PlcSettings, export_settings
from thermaxis.plc._vectors import vectors_csv

MODEL = Path(__file__).resolve().parents[1] / "examples" / "machine" / "models" / "lathe.json"
LONGEST_S = 0.3
"""The promise: a block is built and printed in less. [s]"""


def settings_of(path: Path) -> PlcSettings:
    """Return the model of the example lathe with stated limits."""
    model = read_model(path)
    compensation = Compensation(
        model=model,
        sensors=dict.fromkeys(model.channels, SensorRules(lowest_c=5.0, highest_c=80.0)),
        limits={output.name: Limits(280.0, 0.5) for output in model.outputs},
    )
    digest = model_sha256(model)
    return export_settings(compensation, cycle_s=1.0, name="lathe", model_sha256=digest)


def parts_of(settings: PlcSettings) -> dict[str, Callable[[], object]]:
    """Return what is timed, by its name."""
    program = build_program(settings)
    facts = GuideFacts(Target("c"), ("tx_lathe.c",), "tx_lathe.vectors.csv")
    return {
        "read the model": lambda: settings_of(MODEL),
        "build and print SCL": lambda: print_scl(build_program(settings)),
        "build and print ST": lambda: print_st(build_program(settings)),
        "build and print C": lambda: print_c(build_program(settings)),
        "guide": lambda: guide_text(settings, program, facts),
        "vectors (whole course)": lambda: vectors_csv(settings),
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
    repetitions: int = parser.parse_args().repetitions
    best = best_times(parts_of(settings_of(MODEL)), repetitions)
    unit_s = best["read the model"]
    print(f"{'part':24} {'ms':>8} {'times reading the model':>24}")
    for name, seconds in best.items():
        print(f"{name:24} {1e3 * seconds:8.1f} {seconds / unit_s:24.1f}")
    whole, helped = command_times(repetitions)
    print(f"whole command {whole:.2f} s, of which start and help {helped:.2f} s")
    slowest = max(seconds for name, seconds in best.items() if name.startswith("build"))
    print(f"one block: {slowest:.3f} s, promised: less than {LONGEST_S} s")
    return 0 if slowest < LONGEST_S else 1


if __name__ == "__main__":
    sys.exit(main())
