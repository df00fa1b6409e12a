"""Whole processes, side by side: how much work it is to start the command line.

Processor time is counted, so that other programs on the computer do not matter.
Every command runs once before it is measured, so that the compiled files exist; then all of
them take turns, and the median of each is printed with its ratio to the process it is held
against and the ratio that the project promises.
"""

import os
import resource
import statistics
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
EXAMPLE = ROOT / "examples" / "x_axis_100_cycles.csv"
REPETITIONS = 5

COMMANDS = {
    "python -c pass": ["-c", "pass"],
    'python -c "import numpy"': ["-c", "import numpy"],
    "thermaxis --help": ["-m", "thermaxis", "--help"],
    "thermaxis evaluate, 100 cycles": ["-m", "thermaxis", "evaluate", str(EXAMPLE)],
    "the same with --no-drift": ["-m", "thermaxis", "evaluate", str(EXAMPLE), "--no-drift"],
}
PROMISES = (
    ("thermaxis --help", "python -c pass", 4.0),
    ("thermaxis evaluate, 100 cycles", 'python -c "import numpy"', 15.0),
    ("the same with --no-drift", 'python -c "import numpy"', 8.0),
)


def seconds(arguments: list[str]) -> float:
    """Return how much processor time one process takes. [s]"""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    one = {**os.environ, "OMP_NUM_THREADS": "1"}  # as the commands have it
    subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL, env=one)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> int:
    """Measure, print, and return 1 if a promise is not kept."""
    for arguments in COMMANDS.values():
        seconds(arguments)
    taken: dict[str, list[float]] = {name: [] for name in COMMANDS}
    for _ in range(REPETITIONS):
        for name, arguments in COMMANDS.items():
            taken[name].append(seconds(arguments))
    median = {name: statistics.median(values) for name, values in taken.items()}
    for name, value in median.items():
        print(f"{name:34} {value * 1000:7.1f} ms")
    print()
    kept = True
    for name, reference, limit in PROMISES:
        ratio = median[name] / median[reference]
        kept &= ratio <= limit
        verdict = "kept" if ratio <= limit else "NOT KEPT"
        print(f"{name:34} {ratio:5.2f} x {reference} (at most {limit:g}: {verdict})")
    return 0 if kept else 1


if __name__ == "__main__":
    raise SystemExit(main())
