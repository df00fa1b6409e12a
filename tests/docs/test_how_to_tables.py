"""The page on compensation tables is run: all commands work, one is refused in its very words."""

import re
import shlex
import shutil
from pathlib import Path

import pytest

from thermaxis.cli import main

BLOCK = re.compile(r"```(\w*)\n(.*?)```", re.DOTALL)


def test_every_command_of_the_page_runs_and_the_refused_one_says_what_the_page_says(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page = (root / "docs" / "how-to" / "write-a-compensation-table.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    for name in ("run.csv", "after.csv"):
        shutil.copy(root / "examples" / "y_axis_50_cycles.rtl", name)
    assert main(["correct", "run.csv", "--control", "linuxcnc", "-o", "x_in_force.comp"]) == 0
    blocks = BLOCK.findall(page)
    assert {kind for kind, _ in blocks} == {"console", "text"}
    refused = commands = 0
    for k, (kind, body) in enumerate(blocks):
        if kind == "text":
            continue
        following = blocks[k + 1][1] if blocks[k + 1 : k + 2] and blocks[k + 1][0] == "text" else ""
        for line in body.splitlines():
            prompt, program, *words = shlex.split(line)
            assert (prompt, program) == ("$", "thermaxis")
            capsys.readouterr()
            assert main(words) == (2 if following else 0), line
            commands += 1
            refused += bool(following)
            if following:
                assert capsys.readouterr().err == following
    assert refused == 1
    assert commands >= 9
