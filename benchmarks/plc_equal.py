"""How large an exported block is, and whether it says what `cycle` says, on many random models.

The table has lines, statements in a call and about how many bytes an instance takes, for the
example models. Then C and ST (put into C word by word) of random models run over shifts with every
fault: in LREAL against `cycle`, to the last bit, and in REAL against each other.

    PYTHONPATH=src:. python benchmarks/plc_equal.py [--models 200] [--first 40] [--hours 8]
"""

import argparse
import re
import sys
import tempfile
from pathlib import Path

from benchmarks.plc_export import settings_of
from tests.unit.plc.equal_parts import Task, compared_together
from tests.unit.plc.mutants import every_mutant, unnoticed
from tests.unit.plc.st_to_c import bare
from thermaxis.plc import LIBRARY, Block
from thermaxis.plc.guide import instance_bytes

ROOT = Path(__file__).resolve().parents[1]
MODELS = ("machine/models/lathe", "models/eps1", "models/eps2", "models/spindle_table")
FIRST_SEED = 40
TOGETHER = 10
_STATEMENT = re.compile(r":=[^;:]*;|\);")


def sizes() -> None:
    """Print the table."""
    print(f"{'text':24} {'lines':>6} {'statements':>11} {'bytes':>7}")
    for name in MODELS:
        block = Block(settings=settings_of(ROOT / "examples" / f"{name}.json"))
        texts = block.st()
        if name == MODELS[0]:
            print(_row(LIBRARY, texts[f"{LIBRARY}.st"], ""))
        print(_row(block.name, texts[f"{block.name}.st"], str(instance_bytes(texts.values()))))
        alone = Block(settings=block.settings, model_only=True).st()
        print(
            _row(
                "  the model alone", alone[f"{block.name}.st"], str(instance_bytes(alone.values()))
            )
        )


def _row(name: str, text: str, size: str) -> str:
    bodies = re.findall(r"END_VAR\n((?!VAR).*?)END_FUNCTION_BLOCK", bare(text), re.DOTALL)
    statements = sum(len(_STATEMENT.findall(body)) for body in bodies)
    return f"{name:24} {text.count(chr(10)):6} {statements:11} {size:>7}"


def main() -> int:
    """Print table and differences; 1 where there is one."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--models", type=int, default=200)
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="seed of the first model")
    parser.add_argument("--hours", type=float, default=8.0)
    parser.add_argument("--mutants", type=int, default=0)
    parser.add_argument("--library", default=LIBRARY, help="whose mutants they are")
    arguments = parser.parse_args()
    sizes()
    wrong: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        for double in (True, False):
            tasks = [Task(arguments.first + k, 10.0, double, arguments.hours, touched=k % 4 == 3)
                     for k in range(arguments.models)]  # fmt: skip
            calls, away_um = 0, 0.0
            for k in range(0, len(tasks), TOGETHER):
                for found in compared_together(
                    tasks[k : k + TOGETHER], Path(folder, f"{double}{k}")
                ):
                    calls += found.seen.calls
                    away_um = max(away_um, found.away_um)
                    wrong += [f"{found.task.label}: {d}" for d in found.differences.values() if d]
            kind = "LREAL" if double else "REAL"
            print(
                f"{kind}: {len(tasks)} models, {calls} calls, at most {away_um:.1e} um from cycle"
            )
        library = arguments.library
        chosen = every_mutant(library)[: arguments.mutants]
        missed = unnoticed(chosen, Path(folder, "mutants"), library)
        print(f"mutants of {library}: {len(chosen) - len(missed)} of {len(chosen)} noticed")
    print("\n".join([*wrong, *missed]))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
