"""Ten thousand files that something happened to: is any of them read wrongly?"""

import argparse
import random
import sys
import tempfile
from collections import Counter, defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from tests.unit.files.mutated import MUTATIONS, bases, judged, read  # noqa: E402 - found by the line before


def main() -> int:
    """Mutate, read, count by kind of change; return 1 if any file was read wrongly."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--files", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    counts: defaultdict[str, Counter[str]] = defaultdict(Counter)
    wrong: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run"
        known = [(base, read(path, base.text.encode(), base.mapping)) for base in bases(ROOT)]
        for k in range(arguments.files):
            rng = random.Random(f"{arguments.seed}-{k}")  # noqa: S311  repeatable, no secret
            base, test = rng.choice(known)
            mutate = rng.choice(MUTATIONS)
            mutant = mutate(base.text, rng)
            verdict = judged(test, mutant, path, base.mapping)
            counts[mutate.__name__][verdict.word] += 1
            if verdict.word == "WRONG":
                wrong.append(f"{k} {base.name}: {mutant.shown}: {verdict.why}")
    words = ("same", "refused", "told", "literal", "WRONG")
    print(f"{len(known)} files, {arguments.files} mutants\n")
    print(f"{'change':24}" + "".join(f"{word:>9}" for word in words))
    for name, found in counts.items():
        print(f"{name.replace('_', ' '):24}" + "".join(f"{found[word]:>9}" for word in words))
    total = sum(counts.values(), Counter[str]())
    print(f"{'all':24}" + "".join(f"{total[word]:>9}" for word in words))
    print("\n".join(wrong[:60]))
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())
