"""What becomes of files as people have them: one run in many forms, each read and compared."""

import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from tests.unit.files.nasty import CASES, DEVIATION, TARGETS, Nasty
from thermaxis.errors import ThermaxisError
from thermaxis.files import read_positioning
from thermaxis.messages import sentence_of


def outcome(case: Nasty, path: Path) -> tuple[str, str]:
    """Return what became of a file, and what was said."""
    path.write_bytes(case.content)
    try:
        test = read_positioning(path)
    except ThermaxisError as error:
        return "refused", f"{error.code}: {sentence_of(error.message)}"
    expected = DEVIATION.copy()
    for stop in case.missing:
        expected[stop] = np.nan
    same = test.deviation.shape == expected.shape and np.allclose(
        test.deviation, expected, rtol=0, atol=1e-9, equal_nan=True
    )
    right = same and np.allclose(test.target, TARGETS, rtol=0, atol=1e-3)
    said = " | ".join(map(sentence_of, test.remarks))
    return "read" if right else "WRONG", said


def main() -> int:
    """Print what became of each file, and return 1 if any was read wrongly."""
    counts: dict[str, int] = {}
    with tempfile.TemporaryDirectory() as folder:
        for case in CASES:
            found, said = outcome(case, Path(folder) / "run")
            counts[found] = counts.get(found, 0) + 1
            print(f"{case.name:36} {found:8} {said[:240]}")
    print(f"\n{len(CASES)} files: " + ", ".join(f"{n} {word}" for word, n in counts.items()))
    return 1 if "WRONG" in counts else 0


if __name__ == "__main__":
    raise SystemExit(main())
