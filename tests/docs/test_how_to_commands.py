"""Pages whose commands are all run; a refused one says what the page says."""

import re
import shlex
import shutil
from functools import partial
from itertools import pairwise

import pytest

from thermaxis import plc
from thermaxis.cli import main

BLOCK = re.compile(r"```(\w*)\n(.*?)```", re.DOTALL)


@pytest.mark.parametrize(
    ("page", "commands"), [("write-a-compensation-table", 9), ("export-to-a-plc", 7)]
)
def test_every_command_of_the_page_runs_and_the_refused_one_says_what_the_page_says(
    page, commands, root, tmp_path, monkeypatch, capsys, fitted_once
):
    text = (root / "docs" / "how-to" / f"{page}.md").read_text(encoding="utf-8")
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
            if refused:
                assert capsys.readouterr().err == refused
    assert ran >= commands
