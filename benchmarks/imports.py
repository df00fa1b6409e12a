"""How long Python takes to start and to import what the package uses or could use.

Every line is a process of its own; the lines take turns, so that a busy machine slows all of
them alike. Run it with the interpreter whose packages are to be compared:

    python benchmarks/imports.py [--repetitions 10]
"""

import argparse
import statistics
import subprocess
import sys
import time
from importlib.util import find_spec

STATEMENTS = {
    "pass": "sys",
    "import argparse": "argparse",
    "import csv": "csv",
    "import tomllib": "tomllib",
    "from pydantic import BaseModel": "pydantic",
    "import numpy": "numpy",
    "import numpy; import polars": "polars",
    "import polars": "polars",
    "import numpy; import scipy.special": "scipy",
    "import numpy; import openpyxl": "openpyxl",
    "import thermaxis.cli": "thermaxis",
    "import thermaxis.positioning": "thermaxis",
}
"""What is run, and the package without which it cannot be."""


def duration_ms(statement: str) -> float:
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", statement], check=True)
    return 1000.0 * (time.perf_counter() - start)


def measure(statements: list[str], repetitions: int) -> dict[str, list[float]]:
    taken: dict[str, list[float]] = {statement: [] for statement in statements}
    for statement in statements:
        duration_ms(statement)  # the first run fills the caches of byte code and of files
    for _ in range(repetitions):
        for statement in statements:
            taken[statement].append(duration_ms(statement))
    return taken


def table(taken: dict[str, list[float]]) -> str:
    base = statistics.median(taken["pass"])
    lines = [
        "| statement | median, ms | smallest, ms | largest, ms | ratio to `pass` |",
        "|---|---:|---:|---:|---:|",
    ]
    for statement, values in taken.items():
        median = statistics.median(values)
        lines.append(
            f"| `{statement}` | {median:.0f} | {min(values):.0f} | {max(values):.0f}"
            f" | {median / base:.1f} |"
        )
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description="Time of imports, each in its own process.")
    parser.add_argument("--repetitions", type=int, default=10, help="runs of each (default: 10)")
    repetitions = max(1, parser.parse_args().repetitions)
    there = [statement for statement, package in STATEMENTS.items() if find_spec(package)]
    taken = measure(there, repetitions)
    print(f"Python {sys.version.split()[0]}, {repetitions} runs of each, in turn\n")
    print(table(taken))
    for statement, package in STATEMENTS.items():
        if statement not in there:
            print(f"\n{package} is not installed here: `{statement}` was left out")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
