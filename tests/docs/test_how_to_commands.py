"""Pages whose commands are all run; a refused one says what the page says. C compiles."""

import re
import shlex
import shutil
import subprocess
from functools import partial
from itertools import pairwise
from pathlib import Path

import pytest

from thermaxis import plc
from thermaxis.cli import main

BLOCK = re.compile(r"```(\w*)\n(.*?)```", re.DOTALL)


@pytest.mark.parametrize(
    ("page", "commands"),
    [
        *(("how-to/write-a-compensation-table", 9), ("how-to/export-to-a-plc", 5)),
        *(("controls/plc-sinumerik", 2), ("controls/plc-s7-1500", 1), ("controls/plc-c", 1)),
        *(("controls/plc-twincat", 1), ("controls/plc-codesys", 1)),
    ],
)
def test_every_command_of_the_page_runs_and_the_refused_one_says_what_the_page_says(
    page, commands, root, tmp_path, monkeypatch, capsys, fitted_once
):
    text = (root / "docs" / f"{page}.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(plc, "vectors_of", partial(plc.vectors_of, most_calls=500))
    shutil.copytree(root / "examples", "examples")
    for name in ("run.csv", "after.csv"):
        shutil.copy(root / "examples" / "y_axis_50_cycles.rtl", name)
    assert main(["correct", "run.csv", "--control", "linuxcnc", "-o", "x_in_force.comp"]) == 0
    blocks = [*BLOCK.findall(text), ("", "")]
    ran = 0
    for (kind, body), (next_kind, following) in pairwise(blocks):
        refused = following if next_kind == "text" else ""
        for line in body.splitlines() if kind == "console" else ():
            prompt, program, *words = shlex.split(line)
            assert (prompt, program) == ("$", "thermaxis")
            capsys.readouterr()
            with fitted_once():
                assert main(words) == (2 if refused else 0), line
            ran += 1
            written = words[-1]
            if refused:
                assert capsys.readouterr().err == refused
        if kind == "c":
            checked = ("gcc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only")
            subprocess.run([*checked, "-I", written, "-xc", "-"], input=body, text=True, check=True)
        if kind == "pascal":  # what it calls of the block is there
            program = "".join(path.read_text("ascii") for path in Path(written).glob("tx_*.st"))
            named = set(re.findall(r"\bz\.(\w+)", body))
            assert named
            assert {name for name in named if f"    {name} : " not in program} == set()
    assert ran >= commands
