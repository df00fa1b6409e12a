"""Pages whose commands are all run; a refused one says what the page says. C runs."""

import ctypes
import math
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


@pytest.mark.proof
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
    for name in ("vectors_of", "self_test_of"):
        monkeypatch.setattr(plc, name, partial(getattr(plc, name), most_calls=50))
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
            _the_example_writes_nothing_that_was_not_read(body, Path(written))
        if kind == "pascal":  # what it calls of the block is there
            program = "".join(path.read_text("ascii") for path in Path(written).glob("tx_*.st"))
            named = set(re.findall(r"\bz\.(\w+)", body))
            assert named
            assert {name for name in named if f"    {name} : " not in program} == set()
            declared = set(re.findall(r"^    (\w+) : ", body, re.MULTILINE))
            text = re.sub(r"\(\*.*?\*\)|\w+#\w+|FUNCTION_BLOCK \w+|tx_\w+", "", body)
            used = set(re.findall(r"(?<![.\w])([a-z]\w*)\b(?! :=)", text))
            assert used - declared == set()
            assert {"heartbeat", "state", "linked"} <= named
    assert ran >= commands


def _the_example_writes_nothing_that_was_not_read(example: str, folder: Path) -> None:
    wired = """
void wire(double spindle_c)
{
    axis.t_t_spindle_c = spindle_c;
    axis.t_t_column_c = axis.t_t_table_c = 20.0;
    axis.ok_t_spindle_c = axis.ok_t_column_c = axis.ok_t_table_c = axis.interlocks_met = true;
}
void begin(void) { tx_lathe_init(&axis); }
"""
    (folder / "example.c").write_text(example + wired, encoding="ascii")
    strict = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-ffp-contract=off")
    shared = ("-fPIC", "-shared", "-Wl,-z,defs", "-o", "example.so")  # and no -lm
    sources = ("example.c", "tx_lathe.c", "thermaxis_lib.c")
    subprocess.run(["gcc", *strict, *shared, *sources], cwd=folder, check=True)
    axis = ctypes.CDLL(str(folder / "example.so"))
    axis.axis_cycle.restype = ctypes.c_bool
    axis.begin()
    stands_mm, written = 0.0, ctypes.c_double(7.0)

    def cycle(read_mm: float, read_ok: bool = True, button: bool = True) -> bool:
        told = [ctypes.c_double(x) for x in (1.0, read_mm)]
        given = [*map(ctypes.c_bool, (read_ok, button)), ctypes.byref(written)]
        return axis.axis_cycle(*told, *given)

    axis.wire(ctypes.c_double(20.0))
    assert not cycle(stands_mm, button=False)
    for k in range(900):
        axis.wire(ctypes.c_double(20.0 + min(k / 20.0, 15.0)))
        if cycle(stands_mm):
            assert abs(written.value - stands_mm) <= 0.0005 + 1e-12
            stands_mm = written.value
    assert stands_mm > 0.05
    for read_mm, read_ok in ((0.0, False), (math.nan, True), (math.inf, True), (1e38, True)):
        assert not cycle(read_mm, read_ok)
    for _ in range(900):
        if cycle(stands_mm):
            assert abs(written.value - stands_mm) <= 0.0005 + 1e-12
            stands_mm = written.value
    assert cycle(0.0)  # somebody has put it to zero
    assert abs(written.value) <= 0.0005 + 1e-12
