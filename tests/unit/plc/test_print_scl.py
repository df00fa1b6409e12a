"""SCL is the Structured Text in another coat: taken off, both are the same."""

import re
from dataclasses import replace
from typing import Literal

from tests.refusals import refused
from tests.unit.plc.small_programs import let, small
from tests.unit.plc.st_to_c import st_as_c
from thermaxis.plc import Program, print_scl, print_st

Cpu = Literal["s7-1500", "s7-300"]
CASES: list[tuple[Cpu, bool]] = [("s7-1500", True), ("s7-1500", False), ("s7-300", False)]


def test_it_computes_what_the_structured_text_computes() -> None:
    for double in (True, False):
        program = small(double=double)
        meaning = {st_as_c(text, "m") for text in (print_st(program), print_scl(program))}
        meaning |= set() if double else {st_as_c(print_scl(program, "s7-300"), "m")}
        assert len(meaning) == 1


def test_the_text_is_ascii_in_lines_of_a_hundred_signs() -> None:
    for cpu, double in CASES:
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
    # A number sign stands before every variable, and before nothing else.
    code = re.sub(r"\(\*.*?\*\)", "", text)
    for statements in re.findall(r"\nBEGIN\n(.*?)\nEND_FUNCTION_BLOCK", code, re.DOTALL):
        arguments = re.findall(r"(?<=[(,] )([a-z]\w*) :=|(?<=\()([a-z]\w*) :=", statements)
        plain = re.findall(r"(?<![#.\w])[a-z]\w*", statements)
        assert sorted(plain) == sorted("".join(pair) for pair in arguments)
        assert not re.findall(r"[(,]\s*#\w+ :=|\.#|##", statements)


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
