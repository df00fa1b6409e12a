"""Write what the commands of the README and the tutorials print today into their excerpts.

``python tests/docs/refresh_tutorials.py`` after a change that moves printed digits; read the
difference before it is committed. An excerpt keeps its number of lines and begins with the line
of the output that is most like its first one.
"""

import contextlib
import difflib
import io
import os
import re
import shlex
import shutil
import sys
import tempfile
from pathlib import Path

from thermaxis.cli import main

ROOT = Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"```(console|python|text)\n(.*?)```", re.DOTALL)


def skeleton(line: str) -> str:
    """Return a line without its digits and the width of its columns."""
    return re.sub(r"\s+", " ", re.sub(r"[-+\d.e]+", "0", line))


def excerpt(printed: str, old: str) -> str:
    """Return as many lines of an output as an excerpt has, from where it seems to begin."""
    lines, before = printed.splitlines(), old.splitlines()
    if old.rstrip("\n") in printed:
        return old
    first = skeleton(before[0])
    likeness = [difflib.SequenceMatcher(None, skeleton(line), first).ratio() for line in lines]
    begin = likeness.index(max(likeness))
    return "\n".join(line.rstrip() for line in lines[begin : begin + len(before)]) + "\n"


def refreshed(text: str) -> str:
    """Return a page with the excerpts of today; run in a folder that holds the examples."""
    printed = ""

    def replaced(match: re.Match[str]) -> str:
        nonlocal printed
        kind, body = match[1], match[2]
        if kind == "text":
            return f"```text\n{excerpt(printed, body)}```"
        stream = io.StringIO()
        with contextlib.redirect_stdout(stream):
            if kind == "python":
                exec(compile(body, "page", "exec"), {})  # noqa: S102  the page's own lines
            else:
                for line in body.splitlines():
                    stream.truncate(0)
                    main(shlex.split(line)[2:])
        printed = stream.getvalue().lstrip("\0")
        return match[0]

    return BLOCK.sub(replaced, text)


if __name__ == "__main__":
    for page in [ROOT / "README.md", *sorted((ROOT / "docs" / "tutorials").glob("*.md"))]:
        with tempfile.TemporaryDirectory() as folder:
            shutil.copytree(ROOT / "examples", Path(folder) / "examples")
            os.chdir(folder)
            text = refreshed(page.read_text(encoding="utf-8"))
            os.chdir(ROOT)
        if text != page.read_text(encoding="utf-8"):
            page.write_text(text, encoding="utf-8")
            sys.stdout.write(f"{page.name} was refreshed\n")
