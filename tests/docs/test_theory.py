"""The theory pages print what their code prints, and their figures are what the script draws."""

import contextlib
import doctest
import importlib.util
import io
import re
import shlex
from pathlib import Path
from types import ModuleType

import pytest

from thermaxis.cli import main

BLOCK = re.compile(
    r"^```(python|console)\n(.*?)^```\n(?:\s*^```text\n(.*?)^```$)?", re.MULTILINE | re.DOTALL
)
CHECKER = doctest.OutputChecker()
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
FOLDER = Path(__file__).resolve().parents[2] / "docs" / "theory"
BLOCKS = [
    pytest.param(*match.groups(), id=f"{page.stem}-{number}")
    for page in sorted(FOLDER.glob("*.md"))
    for number, match in enumerate(BLOCK.finditer(page.read_text(encoding="utf-8")), start=1)
]


def printed_by_python(code: str) -> str:
    stream = io.StringIO()
    with contextlib.redirect_stdout(stream):
        exec(compile(code, "theory page", "exec"), {"__name__": "theory"})  # noqa: S102  our page
    return stream.getvalue()


def printed_by_command(line: str, capsys: pytest.CaptureFixture[str]) -> str:
    program, *words = shlex.split(line.removeprefix("$ "))
    assert program == "thermaxis"
    assert main(words) == 0
    return capsys.readouterr().out


def check(expected: str, printed: str) -> None:
    assert CHECKER.check_output(expected, printed, FLAGS), CHECKER.output_difference(
        doctest.Example("", expected), printed, FLAGS
    )


@pytest.mark.proof
@pytest.mark.parametrize(("kind", "code", "text"), BLOCKS)
def test_a_theory_page_prints_what_it_says(
    kind, code, text, root, monkeypatch, capsys, fitted_once
):
    monkeypatch.chdir(root)
    if kind == "python":
        assert text is not None, "a block of code without its output"
        with fitted_once():
            check(text, printed_by_python(code))
        return
    command, _, expected = code.partition("\n")
    check(expected, printed_by_command(command, capsys))


def test_there_are_blocks_to_check():
    assert len(BLOCKS) >= 6


def draw_figures() -> ModuleType:
    spec = importlib.util.spec_from_file_location("draw_figures", FOLDER / "draw_figures.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.proof
@pytest.mark.parametrize("name", ["figure_02", "figure_03"])
def test_the_figures_are_what_the_script_draws(name):
    drawn = draw_figures().rendered(name)
    assert drawn.decode() == (FOLDER / f"{name}.svg").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["figure_02", "figure_03"])
def test_the_figures_have_no_date_and_need_no_font(name):
    text = (FOLDER / f"{name}.svg").read_text(encoding="utf-8")
    assert "<text" not in text
    assert "dc:date" not in text
