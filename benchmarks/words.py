"""Words of README, tutorials and how-to pages: what somebody reads who wants to do something.

    python benchmarks/words.py              as they stand here
    python benchmarks/words.py 83dbafcd     at that revision, then here

A word is what stands between blanks. "Prose" leaves out what stands between code fences: commands,
files and what programs print.
"""

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
GROUPS = {"README": r"README\.md", "tutorials": r"docs/tutorials/", "how-to": r"docs/how-to/"}
FENCED = re.compile(r"^```.*?^```\s*$", re.MULTILINE | re.DOTALL)


def git(*words: str) -> str:
    return subprocess.run(
        ["git", *words], cwd=ROOT, capture_output=True, text=True, check=True, encoding="utf-8"
    ).stdout


def counted(names: list[str], read: Callable[[str], str]) -> dict[str, tuple[int, int]]:
    """Return the words of each group, all and prose."""
    totals: dict[str, tuple[int, int]] = {}
    for group, pattern in GROUPS.items():
        texts = [read(n) for n in names if n.endswith(".md") and re.match(pattern, n)]
        whole = sum(len(text.split()) for text in texts)
        totals[group] = whole, sum(len(FENCED.sub("", text).split()) for text in texts)
    whole, prose = zip(*totals.values(), strict=True)
    totals["together"] = sum(whole), sum(prose)
    return totals


def shown(title: str, totals: dict[str, tuple[int, int]]) -> None:
    print(f"{title:<12}{'words':>8}{'prose':>8}")
    for group, (whole, prose) in totals.items():
        print(f"{group:<12}{whole:>8}{prose:>8}")


if __name__ == "__main__":
    here = [path.relative_to(ROOT).as_posix() for path in ROOT.glob("docs/**/*.md")]
    now = counted([*here, "README.md"], lambda name: (ROOT / name).read_text("utf-8"))
    if len(sys.argv) > 1:
        at = sys.argv[1]
        names = git("ls-tree", "-r", "--name-only", at).splitlines()
        before = counted(names, lambda name: git("show", f"{at}:{name}"))
        shown(f"at {at[:8]}", before)
    shown("here", now)
    if len(sys.argv) > 1:
        whole, prose = (b / a for a, b in zip(before["together"], now["together"], strict=True))
        print(f"{whole:.1%} of the words, {prose:.1%} of the prose")
