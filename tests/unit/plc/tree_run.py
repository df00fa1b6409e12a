"""Runs a program of the tree in Python: every block becomes a class, every number one float.

Both sides of AND and OR are evaluated; a temporary or an element that was not written is None, so
that computing with it fails. In REAL every operation, input and constant is rounded to binary32.
"""

import math
import struct
from collections.abc import Callable, Sequence
from typing import Any

from thermaxis.plc import Block, Program
from thermaxis.plc.tree import (
    Assign,
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
    Statement,
    Truth,
    Two,
    Variable,
)

_BINARY32 = struct.Struct("<f")
_SIGNS = {Operation.EQUAL: "==", Operation.AND: "&", Operation.OR: "|"}
_COMPUTED = {Operation.ADD, Operation.SUBTRACT, Operation.MULTIPLY, Operation.DIVIDE}


def binary32(value: float) -> float:
    """Return a number as binary32 holds it, infinite where it is too large; whole numbers stay."""
    if type(value) is int:
        return value
    try:
        return _BINARY32.unpack(_BINARY32.pack(value))[0]
    except OverflowError:
        return math.copysign(math.inf, value)


def _same(value: Any) -> Any:
    return value


def compiled(program: Program) -> Callable[[], Any]:
    """Return what makes an instance of the main block: inputs and outputs are its attributes."""
    rounded = _same if program.double else binary32
    lines = [line for block in program.blocks for line in _class(block, program.double)]
    space: dict[str, Any] = {"r": rounded}
    exec("\n".join(lines), space)  # noqa: S102 - text that was made here
    made: Callable[[], Any] = space[program.name]
    return made


def _class(block: Block, double: bool) -> list[str]:
    lasting = (*block.inputs, *block.outputs, *block.states, *block.constants)
    slots = [f"{v.name!r}" for v in (*lasting, *block.temporaries)]
    slots += [f"{i.name!r}" for i in block.instances]
    lines = [f"class {block.name}:", f"    __slots__ = ({', '.join(slots)},)"]
    lines += ["    def __init__(self):"]
    lines += [f"        self.{v.name} = {_start(v)}" for v in lasting]
    lines += [f"        self.{i.name} = {i.block}()" for i in block.instances]
    lines += ["    def step(self):"]
    lines += [f"        self.{v.name} = None" for v in block.temporaries]
    if not double:
        numbers = [v.name for v in block.inputs if v.kind is Kind.NUMBER]
        lines += [f"        self.{n} = r(self.{n})" for n in numbers]
    return [*lines, *_body(block.body, 2, double), "        return self"]


def _start(variable: Variable) -> str:
    if variable.length:
        return f"[None] * {variable.length}"
    if variable.kind is Kind.NUMBER:
        return f"r({float(variable.start)!r})"
    return repr(variable.start)


def _body(body: Sequence[Statement], depth: int, double: bool) -> list[str]:
    lines: list[str] = []
    for statement in body:
        lines += _statement(statement, depth, double)
    return lines or ["    " * depth + "pass"]


def _statement(statement: Statement, depth: int, double: bool) -> list[str]:
    indent = "    " * depth
    if isinstance(statement, Assign):
        value = _text(statement.value)
        computes = isinstance(statement.value, Two) and statement.value.operation in _COMPUTED
        if computes and not double:
            value = f"r{value}"
        return [f"{indent}{_text(statement.target)} = {value}"]
    if isinstance(statement, If):
        lines: list[str] = []
        for k, (condition, body) in enumerate(statement.branches):
            lines += [f"{indent}{'elif' if k else 'if'} {_text(condition)}:"]
            lines += _body(body, depth + 1, double)
        if statement.otherwise:
            lines += [f"{indent}else:", *_body(statement.otherwise, depth + 1, double)]
        return lines
    if isinstance(statement, Call):
        name = f"self.{statement.instance}"
        given = [f"{indent}{name}.{n} = {_text(value)}" for n, value in statement.inputs]
        return [*given, f"{indent}{name}.step()"]
    return []


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
            text = f"({_text(left)} {_SIGNS.get(operation, operation.value)} {_text(right)})"
    return text
