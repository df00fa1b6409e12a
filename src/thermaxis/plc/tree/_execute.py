"""A program executed in Python, in the numbers of the PLC.

Every block becomes a class whose attributes are its variables, compiled from text that is made of
the checked tree alone: names that `check_program` took, and numbers. In REAL every operation,
input and constant is rounded to binary32. Both sides of AND and OR are evaluated; a temporary or
an element that was not written is None, so that computing with it fails.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from struct import Struct
from typing import Protocol, TypeAlias

from thermaxis.plc.tree._check import ARITHMETIC
from thermaxis.plc.tree._tree import (
    Assign,
    Block,
    Call,
    Count,
    Element,
    Expression,
    If,
    Kind,
    Minus,
    Name,
    Not,
    Operation,
    OutputOf,
    Program,
    Remark,
    Statement,
    Truth,
    Two,
    Variable,
)

Rounding: TypeAlias = Callable[[float], float]
"""Rounds the result of one operation, an input or a constant to the target's numbers."""

_SINGLE = Struct("<f")
_SIGNS = {Operation.EQUAL: "==", Operation.AND: "&", Operation.OR: "|"}
_INDENT = "    "


class Executed(Protocol):
    """An instance of a block: every variable is an attribute."""

    def step(self) -> None:
        """Do what one call of the block does."""
        ...


def to_single(value: float) -> float:
    """Return a number as REAL holds it: the nearest of binary32, of two as near the even one.

    One addition, subtraction, multiplication or division of two numbers of binary32 may be done
    in binary64 and rounded once more: 53 digits are more than twice 24 and two, so the result is
    that of binary32.

    References
    ----------
    Figueroa 1995, When is double rounding innocuous?, SIGNUM Newsletter 30(3).
    """
    if type(value) is int:
        return value
    try:
        rounded: float = _SINGLE.unpack(_SINGLE.pack(value))[0]
    except OverflowError:
        return math.copysign(math.inf, value)
    return rounded


def rounding(*, double: bool) -> Rounding:
    """Return what rounds to the numbers of the target."""
    return (lambda value: value) if double else to_single


def executable(program: Program) -> Callable[[], Executed]:
    """Return what makes instances of the main block of a program that `check_program` took."""
    lines = [line for block in program.blocks for line in _class(block, double=program.double)]
    space: dict[str, Callable[..., Executed]] = {}
    names: dict[str, object] = {"r": rounding(double=program.double)}
    exec("\n".join(lines), names, space)  # noqa: S102 - made here, of a checked tree
    names.update(space)
    return space[program.name]


def _class(block: Block, *, double: bool) -> Iterator[str]:
    lasting = (*block.inputs, *block.outputs, *block.states, *block.constants)
    slots = [v.name for v in (*lasting, *block.temporaries, *block.instances)]
    yield f"class {block.name}:"
    yield f"    __slots__ = {slots!r}"
    yield "    def __init__(self):"
    yield from (f"        self.{v.name} = {_start(v)}" for v in lasting)
    yield from (f"        self.{i.name} = {i.block}()" for i in block.instances)
    yield "    def step(self):"
    yield from (f"        self.{v.name} = None" for v in block.temporaries)
    if not double:
        numbers = [v.name for v in block.inputs if v.kind is Kind.NUMBER]
        yield from (f"        self.{n} = r(self.{n})" for n in numbers)
    yield from _body(block.body, _INDENT * 2, double=double)


def _start(variable: Variable) -> str:
    if variable.length:
        return f"[None] * {variable.length}"
    if variable.kind is Kind.NUMBER:
        return f"r({float(variable.start)!r})"
    return repr(variable.start)


def _body(body: Sequence[Statement], begin: str, *, double: bool) -> Iterator[str]:
    yield f"{begin}pass"
    for statement in body:
        match statement:
            case Assign(target, value):
                computes = isinstance(value, Two) and value.operation in ARITHMETIC
                text = f"r{_text(value)}" if computes and not double else _text(value)
                yield f"{begin}{_text(target)} = {text}"
            case If(branches, otherwise):
                for k, (condition, inner) in enumerate(branches):
                    yield f"{begin}{'elif' if k else 'if'} {_text(condition)}:"
                    yield from _body(inner, begin + _INDENT, double=double)
                yield f"{begin}else:"
                yield from _body(otherwise, begin + _INDENT, double=double)
            case Call(instance, inputs):
                for name, value in inputs:
                    yield f"{begin}self.{instance}.{name} = {_text(value)}"
                yield f"{begin}self.{instance}.step()"
            case Remark():
                pass


def _text(of: Expression) -> str:
    match of:
        case Name(name):
            text = f"self.{name}"
        case OutputOf(instance, output):
            text = f"self.{instance}.{output}"
        case Element(array, index):
            text = f"self.{array}[self.{index}]"
        case Truth(value) | Count(value):
            text = repr(value)
        case Minus(inner):
            text = f"(-{_text(inner)})"
        case Not(inner):
            text = f"(not {_text(inner)})"
        case Two(left, operation, right):
            sign = _SIGNS.get(operation, operation.value)
            text = f"({_text(left)} {sign} {_text(right)})"
    return text
