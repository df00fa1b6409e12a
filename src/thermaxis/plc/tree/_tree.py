"""The program that is exported, before it is text: blocks, variables, statements, expressions.

Few kinds, so that every dialect can say each, and a reader can check each:

- numbers are of one type in the whole program, LREAL or REAL; besides there are BOOL and INT;
- a statement computes with numbers at most once, so that no compiler has anything to round or to
  contract between two operations;
- an expression of BOOL may nest; every operation stands in parentheses in every dialect;
- a number in a statement is a variable or a named constant, never a literal;
- a block has instances of blocks that stand before it; nothing is recursive, nothing is called by
  a pointer, and no loop runs.
"""

from dataclasses import dataclass, field
from enum import Enum
from typing import TypeAlias, final

LONGEST_NAME = 24
"""Longest name of a block or a variable. Origin: the limit of old Siemens tools, from the trade.
[1]"""


class Kind(Enum):
    """Kind of a variable."""

    NUMBER = "number"
    """LREAL or REAL, one for the whole program."""
    BOOL = "BOOL"
    INT = "INT"


# ---- expressions --------------------------------------------------------------------------------


@final
@dataclass(frozen=True, slots=True)
class Name:
    """A variable or a constant of the block."""

    name: str
    """Its name."""


@final
@dataclass(frozen=True, slots=True)
class OutputOf:
    """What an instance said when it was last called."""

    instance: str
    """Name of the instance."""
    output: str
    """Name of its output."""


@final
@dataclass(frozen=True, slots=True)
class Element:
    """An element of an array, counted from 0."""

    array: str
    """Name of the array."""
    index: str
    """Name of a variable of kind INT."""


@final
@dataclass(frozen=True, slots=True)
class Truth:
    """TRUE or FALSE."""

    value: bool
    """Which."""


@final
@dataclass(frozen=True, slots=True)
class Count:
    """A whole number."""

    value: int
    """Its value, -32768 to 32767. [1]"""


@final
@dataclass(frozen=True, slots=True)
class Minus:
    """A number with the other sign."""

    of: "Name | OutputOf | Element"
    """The number."""


@final
@dataclass(frozen=True, slots=True)
class Not:
    """The opposite of a BOOL."""

    of: "Expression"
    """The BOOL."""


class Operation(Enum):
    """What two operands give."""

    ADD = "+"
    SUBTRACT = "-"
    MULTIPLY = "*"
    DIVIDE = "/"
    """Of numbers only, never of whole numbers."""
    LESS = "<"
    LESS_EQUAL = "<="
    MORE = ">"
    MORE_EQUAL = ">="
    EQUAL = "="
    """Of whole numbers, or of numbers that were copied, never computed."""
    AND = "AND"
    """Both sides are evaluated, in every dialect that promises it and in those that do not: so
    neither side may fail."""
    OR = "OR"


@final
@dataclass(frozen=True, slots=True)
class Two:
    """An operation on two operands of one kind."""

    left: "Expression"
    """First operand."""
    operation: Operation
    """What is done."""
    right: "Expression"
    """Second operand."""


Expression: TypeAlias = Name | OutputOf | Element | Truth | Count | Minus | Not | Two
"""Anything that has a value."""


# ---- statements ---------------------------------------------------------------------------------


@final
@dataclass(frozen=True, slots=True)
class Assign:
    """Give a variable, or an element of an array, a value."""

    target: "Name | Element"
    """A variable of the block that is no input and no constant."""
    value: Expression
    """The value, of the same kind; at most one operation on numbers is in it."""


@final
@dataclass(frozen=True, slots=True)
class If:
    """The first branch whose condition holds, or the last one."""

    branches: "tuple[tuple[Expression, tuple[Statement, ...]], ...]"
    """Conditions, each with what is done then; at least one."""
    otherwise: "tuple[Statement, ...]" = ()
    """What is done where none holds."""


@final
@dataclass(frozen=True, slots=True)
class Call:
    """Call an instance with a value for every one of its inputs."""

    instance: str
    """Its name."""
    inputs: tuple[tuple[str, Expression], ...]
    """Values by input, in the order of the block's inputs; names, truths and counts only."""


@final
@dataclass(frozen=True, slots=True)
class Remark:
    """A line for the reader: letters, digits, space, ``-``, ``_``, ``.`` and ``, : ( ) = /``."""

    text: str
    """The line."""


Statement: TypeAlias = Assign | If | Call | Remark
"""Anything that is done."""


# ---- blocks -------------------------------------------------------------------------------------


@final
@dataclass(frozen=True, slots=True)
class Variable:
    """A variable of a block."""

    name: str
    """Lower case, at most `LONGEST_NAME` signs."""
    kind: Kind
    """Its kind."""
    text: str
    """What it means, with its unit in brackets; for the remark beside it."""
    start: float | bool | int = 0
    """Value before the first call. A number is stated in double precision and rounded once, when
    it is printed."""
    length: int = 0
    """Length of an array; 0 for a single variable. An array has no start: nothing of it is read
    before it was written. [1]"""


@final
@dataclass(frozen=True, slots=True)
class Instance:
    """An instance of another block, with a state of its own."""

    name: str
    """Its name in this block."""
    block: str
    """Name of the block."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A function block."""

    name: str
    """Its name, with the prefix ``tx_``."""
    remarks: tuple[str, ...] = ()
    """What it does, in lines."""
    inputs: tuple[Variable, ...] = ()
    """What a caller states at every call."""
    outputs: tuple[Variable, ...] = ()
    """What a caller may read."""
    states: tuple[Variable, ...] = ()
    """What lasts from call to call."""
    temporaries: tuple[Variable, ...] = ()
    """What is computed anew in every call; each is written before it is read."""
    constants: tuple[Variable, ...] = ()
    """Numbers, truths and counts that never change."""
    instances: tuple[Instance, ...] = ()
    """Instances of other blocks."""
    body: tuple[Statement, ...] = ()
    """What a call does."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Program:
    """Everything that stands in one file."""

    name: str
    """Name of the block that a user calls; the last one."""
    double: bool
    """Whether numbers are LREAL (binary64) or REAL (binary32)."""
    head: tuple[str, ...] = field(default=())
    """Lines at the top: what it is, from which model, units, sign, what is not protected."""
    blocks: tuple[Block, ...] = ()
    """Every block, those that are called before those that call."""
