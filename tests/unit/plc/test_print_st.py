"""Structured Text says what the tree says, and other programs read it so."""

import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from blark.parse import parse_source_code
from hypothesis import given, strategies as st

from tests.unit.plc.equal_parts import CLibrary, c_block, c_library, st_block
from tests.unit.plc.small_programs import asked, let, number, said, small, two, when
from thermaxis.plc import Program, print_scl, print_st
from thermaxis.plc.printers._text import broken, remark_lines
from thermaxis.plc.tree import Name, Not, Operation, Remark, Two

FLAVOURS = ("iec", "twincat", "codesys")


def long_program() -> Program:
    """A program with lines that must be broken: a long condition, text and call."""
    text = "a remark that is so long that no line of a hundred signs has room for it " * 3
    names = [f"number_{k}_of_many" for k in range(12)]
    condition: Two | Not = Not(two(names[0], "<", "u_um"))
    for name in names:
        condition = Two(condition, Operation.AND, Not(two(name, ">", "u_um")))
    program = small()
    main = program.blocks[-1]
    main = replace(
        main,
        remarks=(text,),
        temporaries=(*main.temporaries, *(number(n, 0.0, text) for n in names)),
        body=(
            Remark(text),
            *(let(n, Name("u_um")) for n in names),
            when(condition, let("low", "u_um")),
            *main.body,
        ),
    )
    return replace(program, head=(text,), blocks=(program.blocks[0], main))


def test_the_text_is_ascii_in_lines_of_a_hundred_signs() -> None:
    for flavour in FLAVOURS:
        for program in [small(), small(double=False), long_program()]:
            text = print_st(program, flavour)
            assert text.isascii()
            assert text.endswith("\n")
            assert max(map(len, text.splitlines())) <= 100
            assert not any(line != line.rstrip() for line in text.splitlines())
            assert set(text) >= set("():=;")
            assert "\t" not in text


@pytest.mark.parametrize("double", [True, False])
def test_every_text_computes_what_plain_python_computes(double: bool, tmp_path: Path) -> None:
    program = small(double=double)
    blocks = {
        "tx_small": c_block(program),
        "st_small": st_block(program, print_st(program), "st_small"),
        "scl_small": st_block(program, print_scl(program), "scl_small"),
    }
    if double:
        assert any(len(line) > 90 for line in print_st(long_program()).splitlines())
        blocks["long_small"] = st_block(program, print_st(long_program()), "long_small")
    library = CLibrary(c_library(blocks, tmp_path, "-O2"))
    rows = asked(400)
    wanted = np.array([*said(rows, double=double)], dtype=float)
    assert set(wanted[:, 1]) == {0.0, 1.0}
    assert {*wanted[:, 3]} >= {0.0, 1.0, 2.0, 4.0}
    for name in blocks:
        got = library.called(name, rows, [row is rows[0] for row in rows], 4)
        assert np.array_equal(got, wanted), name


@given(
    st.lists(st.text("abc(=)_", min_size=1, max_size=30), min_size=1, max_size=60),
    st.integers(0, 10),
)
def test_broken_lines_keep_their_words_and_no_line_is_too_long(
    words: list[str], depth: int
) -> None:
    begin = "    " * depth
    code = broken(begin + " ".join(words))
    assert " ".join(code).split() == words
    remarks = remark_lines(" ".join(words), begin, ("(*", "*)"))
    assert all(line[len(begin) :].startswith("(* ") and line.endswith(" *)") for line in remarks)
    assert " ".join(line[len(begin) + 3 : -3] for line in remarks).split() == words
    for lines in (code, remarks):
        assert all(len(line) <= 100 and line.startswith(begin) for line in lines)
    # As few lines as there can be: the first word of a line had no room in the line before.
    for line, after in pairwise(remarks):
        assert len(line) + 1 + len(after.split()[1]) > 100


def test_a_word_that_no_line_has_room_for_is_cut_and_nothing_of_it_is_lost() -> None:
    word = "".join(chr(ord("a") + k % 26) for k in range(300))
    lines = remark_lines(word, "", ("(*", "*)"))
    assert "".join(line[3:-3] for line in lines) == word
    assert max(map(len, lines)) == 100


def test_another_grammar_reads_it() -> None:
    assert parse_source_code(print_st(small(), "twincat")).exception is None
    assert parse_source_code(print_st(small()).replace("low := one.y;", "low := ;")).exception


def test_remarks_are_never_nested_and_stand_in_one_line() -> None:
    for flavour in FLAVOURS:
        text = print_st(long_program(), flavour)
        assert "//" not in text
        assert "/*" not in text
        for line in text.splitlines():
            assert line.count("(*") == line.count("*)") <= 1
            if "(*" in line:
                assert line.index("(*") < line.index("*)")
                assert line.endswith("*)")


def test_no_number_stands_in_a_statement() -> None:
    for double in (True, False):
        for block in print_st(small(double=double)).split("FUNCTION_BLOCK tx_")[1:]:
            statements = block.rpartition("END_VAR")[2]
            assert not re.search(r"[0-9]\.[0-9]", re.sub(r"\(\*.*?\*\)", "", statements))


def test_editors_with_two_panes_get_marks_and_nothing_else_differs() -> None:
    plain = print_st(small())
    for flavour, name in (("twincat", "TwinCAT 3"), ("codesys", "CODESYS")):
        text = print_st(small(), flavour)
        assert name in text
        assert text.count("the lower pane ----") == 2
        code = [line for line in text.splitlines() if line and not line.startswith("(*")]
        assert code == [line for line in plain.splitlines() if line and not line.startswith("(*")]
