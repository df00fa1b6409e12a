"""A program as C, compiled by gcc and run on rows of inputs."""

import subprocess
from collections.abc import Iterable, Sequence
from pathlib import Path

from thermaxis.plc import Block, CText, Program, print_c
from thermaxis.plc.tree import Kind, Variable

FLAGS = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-ffp-contract=off")
"""What the exported source must stand without a warning."""

Value = float | bool | int


def compiler(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Call gcc; the answer says whether it was content."""
    command = ["gcc", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


def written(text: CText, folder: Path, name: str) -> Path:
    """Write header and source; return the source."""
    (folder / f"{name}.h").write_text(text.header, encoding="ascii")
    (folder / f"{name}.c").write_text(text.source, encoding="ascii")
    return folder / f"{name}.c"


class CProgram:
    """The compiled program; every run starts anew, in a process of its own.

    Parameters
    ----------
    program : Program
        The program of the tree.
    folder : Path
        Where its files go.
    text : CText, optional
        Another text of it, such as one with a mistake. Default: what is printed.
    *flags : str
        More flags for gcc.
    """

    def __init__(
        self, program: Program, folder: Path, *flags: str, text: CText | None = None
    ) -> None:
        block = program.blocks[-1]
        self.inputs = tuple(variable.name for variable in block.inputs)
        self.outputs = tuple(variable.name for variable in block.outputs)
        self._kinds = [variable.kind for variable in block.outputs]
        source = written(text or print_c(program), folder, program.name)
        driver = folder / f"{program.name}_driver.c"
        driver.write_text(_driver(block), encoding="ascii")
        self._path = folder / f"{program.name}_program"
        for file in (source, driver):
            built = compiler(*FLAGS, *flags, "-c", file, "-o", file.with_suffix(".o"))
            assert (built.returncode, built.stderr) == (0, ""), built.stderr
        objects = (source.with_suffix(".o"), driver.with_suffix(".o"))
        linked = compiler(*objects, "-o", self._path)
        assert (linked.returncode, linked.stderr) == (0, ""), linked.stderr

    def run(self, rows: Iterable[Sequence[Value]]) -> list[tuple[Value, ...]]:
        """Return the outputs before the first call, then those of every call."""
        sent = "".join(" ".join(map(_sent, row)) + "\n" for row in rows)
        answer = subprocess.run(
            [str(self._path)], input=sent, capture_output=True, text=True, check=True, timeout=60
        )
        return [tuple(map(_read, self._kinds, line.split())) for line in answer.stdout.splitlines()]


def _sent(value: Value) -> str:
    return value.hex() if isinstance(value, float) else str(int(value))


def _read(kind: Kind, cell: str) -> Value:
    if kind is Kind.NUMBER:
        return float.fromhex(cell)
    return cell == "1" if kind is Kind.BOOL else int(cell)


def _driver(block: Block) -> str:
    said = [f"    {_print(variable)}" for variable in block.outputs]
    asked = [line for variable in block.inputs for line in _scan(variable)]
    lines = [
        f'#include "{block.name}.h"',
        "#include <stdio.h>",
        f"static void say(const {block.name} *b) {{",
        *said,
        '    printf("\\n");',
        "}",
        "int main(void) {",
        f"    static {block.name} b;",
        "    double number;",
        "    int whole;",
        f"    {block.name}_init(&b);",
        "    say(&b);",
        "    for (;;) {",
        *asked,
        f"        {block.name}_step(&b);",
        "        say(&b);",
        "    }",
        "}",
    ]
    return "\n".join(lines) + "\n"


def _print(variable: Variable) -> str:
    if variable.kind is Kind.NUMBER:
        return f'printf("%a ", (double)b->{variable.name});'
    return f'printf("%d ", (int)b->{variable.name});'


def _scan(variable: Variable) -> tuple[str, str]:
    if variable.kind is Kind.NUMBER:
        read, value = 'scanf("%la", &number)', "(tx_number)number"
    else:
        read = 'scanf("%d", &whole)'
        value = "whole != 0" if variable.kind is Kind.BOOL else "(int16_t)whole"
    # Not reached after the last row: a variable that was not read ends the program.
    return f"        if ({read} != 1) return 0;", f"        b.{variable.name} = {value};"
