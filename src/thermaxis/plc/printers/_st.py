"""A program as Structured Text of IEC 61131-3."""

from typing import Literal, TypeAlias

from thermaxis.plc.printers._blocks import REMARK, Dialect, block_lines
from thermaxis.plc.printers._text import joined, remark_lines
from thermaxis.plc.tree import Program, check_program

StFlavour: TypeAlias = Literal["iec", "twincat", "codesys"]
"""Who reads the text."""

_PANES = {"twincat": "TwinCAT 3", "codesys": "CODESYS"}


def print_st(program: Program, flavour: StFlavour = "iec") -> str:
    """Return a program as Structured Text.

    One plain file for every flavour. TwinCAT 3 and CODESYS edit a block in two panes: their text
    has marks between declaration and statements, and says at the top what goes where.

    Not protected: whether a compiler of a control takes the text, and computes every operation in
    the type that is declared, is seen on that control only.

    Parameters
    ----------
    program : Program
        The program.
    flavour : {'iec', 'twincat', 'codesys'}
        Who reads it. Default: the text of the standard, without marks.

    Returns
    -------
    str
        The text: ASCII, lines of at most 100 signs.

    Raises
    ------
    ProgramError
        If the program breaks a rule of the tree.
    ConfigurationError
        If the target cannot keep a number.

    References
    ----------
    IEC 61131-3, Structured Text: function blocks, declarations, statements.
    """
    check_program(program)
    lines = [line for text in program.head for line in remark_lines(text, "", REMARK)]
    marks: tuple[str, ...] = ()
    if flavour != "iec":
        for text in (
            f"For {_PANES[flavour]}: make one function block per block of this file, in the order",
            "of the file. From FUNCTION_BLOCK to the mark goes into the upper pane, the rest",
            "without END_FUNCTION_BLOCK into the lower pane. Not checked with that editor.",
        ):
            lines += remark_lines(text, "", REMARK)
        marks = ("(* ---- statements: the lower pane ---- *)",)
    dialect = Dialect(program.double, before_statements=marks)
    for block in program.blocks:
        lines += ["", *block_lines(block, dialect)]
    return joined(lines)
