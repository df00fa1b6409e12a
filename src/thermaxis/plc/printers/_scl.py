"""A program as SCL of Siemens: for TIA Portal, and for STEP 7 V5 with S7-SCL."""

from typing import Literal, TypeAlias

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError
from thermaxis.plc.printers._blocks import REMARK, Dialect, block_lines
from thermaxis.plc.printers._text import joined, remark_lines
from thermaxis.plc.tree import Program, check_program

SclCpu: TypeAlias = Literal["s7-1500", "s7-300"]
"""Class of the CPU: that of SINUMERIK ONE, or that of SINUMERIK 840D sl."""

NOT_CHECKED = (
    "Syntax and numbers checked through equivalent IEC text. Acceptance by STEP 7 or TIA Portal",
    "not checked.",
)
"""What the head says of every SCL file."""
_CLASSIC = (
    "STEP 7 V5: enter every quoted name in the symbol table, each as a function block of its own,",
    "before the source is compiled. From the trade, not checked.",
    "CPUs of this class keep instance data over power-off as a rule. Declare the instance data",
    "block non-retain, or load its start values when the CPU starts: states must not outlast a",
    "pause in which the machine cooled. From the trade, not checked.",
)


def print_scl(program: Program, cpu: SclCpu = "s7-1500") -> str:
    """Return a program as SCL.

    Not protected: the text was never compiled by a tool of Siemens; whether it is taken, and
    whether every operation is computed in the type that is declared, is seen there only.

    Parameters
    ----------
    program : Program
        The program.
    cpu : {'s7-1500', 's7-300'}
        Class of the CPU. The first has quoted names, ``#`` before variables, and optimised access;
        the second has REAL only, constants in ``CONST`` and no attribute in braces. Default: the
        first, as in SINUMERIK ONE.

    Returns
    -------
    str
        The text: ASCII, lines of at most 100 signs, for an external source.

    Raises
    ------
    ProgramError
        If the program breaks a rule of the tree.
    ConfigurationError
        If the target cannot keep a number, or LREAL is asked of the S7-300 class.

    References
    ----------
    S7-SCL V5.3 for S7-300/400, A5E00290611-01, chapters 7 and 9: elementary types, constants.
    """
    if cpu == "s7-300" and program.double:
        raise ConfigurationError("no_lreal_in_cpu", place=Place(key="--real"))
    check_program(program)
    classic = cpu == "s7-300"
    head = (*program.head, *NOT_CHECKED, *(_CLASSIC if classic else ()))
    lines = [line for text in head for line in remark_lines(text, "", REMARK)]
    for block in program.blocks:
        dialect = _classic(block.name) if classic else _portal(double=program.double)
        lines += ["", *block_lines(block, dialect)]
    return joined(lines)


def _portal(*, double: bool) -> Dialect:
    return Dialect(
        double,
        prefix="#",
        quote='"',
        before_declarations=("{ S7_Optimized_Access := 'TRUE' }", "VERSION : 0.1"),
        before_statements=("BEGIN",),
    )


def _classic(name: str) -> Dialect:
    return Dialect(
        double=False,
        quote='"',
        before_declarations=(f"TITLE = '{name}'", "VERSION : '0.1'"),
        before_statements=("BEGIN",),
        typed_constants=False,
    )
