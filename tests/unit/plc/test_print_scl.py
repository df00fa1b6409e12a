"""SCL is the Structured Text in another coat: taken off, both are the same."""

import re
from dataclasses import replace
from typing import Literal

import pytest

from tests.refusals import refused
from tests.unit.plc.scl_normal import scl_normal
from tests.unit.plc.small_programs import asked, let, said, small
from tests.unit.plc.st_interpreter import Machine, first_difference
from thermaxis.plc import Program, print_scl, print_st

Cpu = Literal["s7-1500", "s7-300"]
CASES: list[tuple[Cpu, bool]] = [("s7-1500", True), ("s7-1500", False), ("s7-300", False)]


def bare(text: str) -> str:
    """Take off what only SCL has; constants of the classic dialect go where IEC has them."""
    lines: list[str] = []
    constants: list[str] = []
    kept: list[str] | None = None
    for line in text.splitlines():
        if line == "CONST":
            kept = []
        elif line == "END_CONST" and kept is not None:
            constants, kept = ["VAR CONSTANT", *kept, "END_VAR"], None
        elif kept is not None:
            kept.append(re.sub(r"^( *\w+) := ([^;]*);", typed, line))
        elif line == "BEGIN":
            lines += [*constants, ""]
            constants = []
        elif not re.match(r"\{|VERSION|TITLE", line):
            lines.append(line)
    return re.sub(r'"(\w+)"', r"\1", "\n".join(lines).replace("#", "")) + "\n"


def typed(line: re.Match[str]) -> str:
    value = line[2]
    kind = "BOOL" if value in {"TRUE", "FALSE"} else "REAL" if "." in value else "INT"
    return f"{line[1]} : {kind} := {value};"


def without_remarks(text: str) -> str:
    """Leave remarks and the ends of lines out: they may stand elsewhere."""
    return " ".join(re.sub(r"\(\*.*?\*\)", "", text).split())


@pytest.mark.parametrize(("cpu", "double"), CASES)
def test_without_its_coat_it_is_the_structured_text(cpu: Cpu, double: bool) -> None:
    program = small(double=double)
    assert without_remarks(bare(print_scl(program, cpu))) == without_remarks(print_st(program))


@pytest.mark.parametrize(("cpu", "double"), CASES)
def test_it_computes_what_plain_python_computes(cpu: Cpu, double: bool) -> None:
    text = print_scl(small(double=double), cpu)
    rows = asked(300, seed=2)
    for plain in (bare(text), scl_normal(text, cpu)):
        machine = Machine(plain)
        got = machine.start().run(rows)
        assert first_difference(machine.outputs, said(rows, double=double), got) is None


@pytest.mark.parametrize(("cpu", "double"), CASES)
def test_the_head_says_what_was_not_checked(cpu: Cpu, double: bool) -> None:
    words = print_scl(small(double=double), cpu).replace("*)\n(* ", "")
    assert "Syntax and numbers checked through equivalent IEC text" in words
    assert "Acceptance by STEP 7 or TIA Portal not checked" in words
    assert ("non-retain" in words) == (cpu == "s7-300")


@pytest.mark.parametrize(("cpu", "double"), CASES)
def test_the_text_is_ascii_in_lines_of_a_hundred_signs(cpu: Cpu, double: bool) -> None:
    text = print_scl(small(double=double), cpu)
    assert text.isascii()
    assert max(map(len, text.splitlines())) <= 100


def test_the_newer_class_has_quotes_and_number_signs() -> None:
    text = print_scl(small())
    assert "FUNCTION_BLOCK \"tx_lag\"\n{ S7_Optimized_Access := 'TRUE' }\nVERSION : 0.1\n" in text
    assert '    one : "tx_lag";' in text
    assert "    #one(u := #past, start := #reset);" in text
    assert "    #low := #one.y;" in text
    assert "#ring[#place] := #u_um;" in text
    assert text.count("\nBEGIN\n") == text.count("\nEND_FUNCTION_BLOCK\n") == 2
    assert "VAR_TEMP" not in text
    statements = text.partition("BEGIN")[2].partition("END_FUNCTION_BLOCK")[0]
    words = re.sub(r"\(\*.*?\*\)", "", statements)
    assert set(re.findall(r"(?<![#.\w])[a-z]\w*", words)) == set()


def test_the_older_class_has_neither_and_its_constants_are_in_the_code() -> None:
    text = print_scl(small(double=False), "s7-300")
    assert "FUNCTION_BLOCK \"tx_lag\"\nTITLE = 'tx_lag'\nVERSION : '0.1'\nCONST\n" in text
    assert "    alpha := 0.142857149;  (* share of a cycle [1] *)" in text
    assert "    yes := TRUE;" in text
    assert "    last := 4;" in text
    for sign in ("#", "{", "}", "REGION", "VAR_TEMP", "VAR CONSTANT", "LREAL"):
        assert sign not in text


def test_the_older_class_refuses_lreal_and_offers_real() -> None:
    with refused("no_lreal_in_cpu"):
        print_scl(small(), "s7-300")


def test_a_block_without_constants_or_states_has_no_empty_section() -> None:
    bare_lag = replace(
        small(double=False).blocks[0],
        constants=(),
        states=(),
        temporaries=(),
        body=(let("y", "u"),),
    )
    program = Program(name="tx_lag", double=False, blocks=(bare_lag,))
    for cpu in ("s7-1500", "s7-300"):
        text = print_scl(program, cpu)
        assert "CONST" not in text
        assert "\nVAR\n" not in text
        assert "VAR_OUTPUT" in text
