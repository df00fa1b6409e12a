"""The tutorials are run: every command works and every printed output is the program's."""

import re
import shlex
import shutil
from pathlib import Path

import pytest

from thermaxis.cli import main

TUTORIALS = sorted((Path(__file__).resolve().parents[2] / "docs" / "tutorials").glob("*.md"))
BLOCK = re.compile(r"```(console|python|text)\n(.*?)```", re.DOTALL)


def lines_of(text: str) -> list[str]:
    return [line.rstrip() for line in text.splitlines()]


def contains(output: str, excerpt: str) -> bool:
    """Return whether the excerpt's lines stand in the output, one after the other."""
    whole, part = lines_of(output), lines_of(excerpt)
    return any(whole[i : i + len(part)] == part for i in range(len(whole)))


@pytest.mark.system
@pytest.mark.parametrize("tutorial", TUTORIALS, ids=lambda path: path.stem)
def test_every_command_runs_and_prints_what_the_page_prints(
    tutorial, root, tmp_path, monkeypatch, capsys
):
    shutil.copytree(root / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    printed = ""
    commands = excerpts = 0
    for kind, body in BLOCK.findall(tutorial.read_text(encoding="utf-8")):
        if kind == "text":
            excerpts += 1
            assert contains(printed, body), f"{tutorial.name} prints\n{body}\nand not\n{printed}"
            continue
        if kind == "python":
            exec(compile(body, tutorial.name, "exec"), {})  # noqa: S102  the page's own lines
            printed = capsys.readouterr().out
            continue
        for line in body.splitlines():
            prompt, *words = shlex.split(line)
            assert (prompt, words[0]) == ("$", "thermaxis")
            assert main(words[1:]) == 0, line
            printed = capsys.readouterr().out
            commands += 1
    assert commands >= 3
    assert excerpts >= 1
