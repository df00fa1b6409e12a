"""A block while it is written, and statements of the tree from text."""

import ast
import re
import textwrap
from collections.abc import Iterable, Mapping
from enum import StrEnum
from functools import reduce
from typing import Final, TypeAlias, final

from thermaxis.codes import Place
from thermaxis.compensation import Outcome, Quality, Reason, SampleQuality, SupervisorState
from thermaxis.plc.tree import (
    Assign,
    Block,
    Call,
    Count,
    Element,
    Expression,
    If,
    Instance,
    Kind,
    Minus,
    Name,
    Not,
    Operation,
    OutputOf,
    Remark,
    Statement,
    Truth,
    Two,
    Variable,
    stored,
)

Body: TypeAlias = tuple[Statement, ...]
"""Statements, one after the other."""

_MEMBERS: Final[Mapping[str, type[StrEnum]]] = {
    "State": SupervisorState,
    "Reason": Reason,
    "Outcome": Outcome,
    "Sample": SampleQuality,
    "Quality": Quality,
}
_OPERATIONS: Final[Mapping[type[ast.AST], Operation]] = {
    ast.Add: Operation.ADD,
    ast.Sub: Operation.SUBTRACT,
    ast.Mult: Operation.MULTIPLY,
    ast.Div: Operation.DIVIDE,
    ast.Lt: Operation.LESS,
    ast.LtE: Operation.LESS_EQUAL,
    ast.Gt: Operation.MORE,
    ast.GtE: Operation.MORE_EQUAL,
    ast.Eq: Operation.EQUAL,
    ast.And: Operation.AND,
    ast.Or: Operation.OR,
}


@final
class Draft:
    """Collects the variables of a block; every method returns the name of what it declares."""

    def __init__(self, name: str, *remarks: str, double: bool) -> None:
        self.name = name
        self.double = double
        self._remarks = remarks
        self._inputs: list[Variable] = []
        self._outputs: list[Variable] = []
        self._states: list[Variable] = []
        self._temporaries: list[Variable] = []
        self._constants: list[Variable] = []
        self._instances: list[Instance] = []

    def input(self, name: str, text: str, kind: Kind = Kind.NUMBER) -> str:
        """Declare an input."""
        return _declared(self._inputs, Variable(name, kind, text, _none_of(kind)))

    def output(self, name: str, text: str, kind: Kind = Kind.NUMBER, start: float = 0) -> str:
        """Declare an output."""
        return _declared(self._outputs, Variable(name, kind, text, start or _none_of(kind)))

    def state(
        self,
        name: str,
        text: str,
        kind: Kind = Kind.NUMBER,
        *,
        start: float | bool = 0,
        length: int = 0,
    ) -> str:
        """Declare a state, or an array."""
        return _declared(self._states, Variable(name, kind, text, start or _none_of(kind), length))

    def temporary(self, name: str, text: str, kind: Kind = Kind.NUMBER) -> str:
        """Declare a variable that is computed anew in every call."""
        return _declared(self._temporaries, Variable(name, kind, text, _none_of(kind)))

    def constant(self, name: str, text: str, value: float, key: str = "", channel: str = "") -> str:
        """Declare a number that never changes; one that the target cannot hold is refused.

        The error names key and channel that the number follows from, else the constant.
        """
        stored(value, double=self.double, place=Place(key=key or name, channel=channel))
        return _declared(self._constants, Variable(name, Kind.NUMBER, text, value))

    def instance(self, name: str, block: str) -> str:
        """Declare an instance of another block."""
        self._instances.append(Instance(name, block))
        return name

    def block(self, text: str, **bodies: Body) -> Block:
        """Return the block, its body as `statements` reads it."""
        return Block(
            name=self.name,
            remarks=self._remarks,
            inputs=tuple(self._inputs),
            outputs=tuple(self._outputs),
            states=tuple(self._states),
            temporaries=tuple(self._temporaries),
            constants=tuple(self._constants),
            instances=tuple(self._instances),
            body=statements(text, **bodies),
        )


def _none_of(kind: Kind) -> float | bool | int:
    return {Kind.NUMBER: 0.0, Kind.BOOL: False, Kind.INT: 0}[kind]


def _declared(variables: list[Variable], variable: Variable) -> str:
    variables.append(variable)
    return variable.name


def numbered(members: Iterable[StrEnum], between: str = " ") -> str:
    """Return every member with its number, its place among them, for a remark."""
    return between.join(f"{k} {member}" for k, member in enumerate(members))


def number_of(member: StrEnum) -> int:
    """Return the number of a member: its place, or its bit in a word that adds several."""
    place = list(type(member)).index(member)
    return 2**place if isinstance(member, Reason | Outcome) else place


# ---- statements ---------------------------------------------------------------------------------


def statements(text: str, **bodies: Body) -> Body:
    """Return the statements that a text writes in the words of Python.

    ``x = a + b``, ``x += a``, ``if`` with ``elif`` and ``else``, ``low <= x <= high``, calls of
    instances, ``instance.output``, ``array[index]``; ``State.OFF`` is the number of a member. A
    line ``# ...`` is a remark, a name alone the body that is given for it.
    """
    remarks = re.sub(r"^( *)# (.*)$", r'\1"\2"', textwrap.dedent(text), flags=re.MULTILINE)
    return _body(ast.parse(remarks).body, bodies)


def _body(nodes: Iterable[ast.stmt], bodies: Mapping[str, Body]) -> Body:
    found: list[Statement] = []
    for node in nodes:
        match node:
            case ast.Expr(ast.Name(name)):
                found.extend(bodies[name])
            case ast.Expr(ast.Constant(str(remark))):
                found.append(Remark(remark))
            case ast.Expr(ast.Call(ast.Name(instance), [], inputs)):
                given = ((str(word.arg), _expression(word.value)) for word in inputs)
                found.append(Call(instance, tuple(given)))
            case ast.Assign([target], value):
                found.append(Assign(_target(target), _expression(value)))
            case ast.AugAssign(target, operator, value):
                old = _target(target)
                found.append(Assign(old, Two(old, _OPERATIONS[type(operator)], _expression(value))))
            case ast.If():
                found.append(_choice(node, bodies))
            case _:
                raise SyntaxError(ast.unparse(node))
    return tuple(found)


def _choice(node: ast.If, bodies: Mapping[str, Body]) -> If:
    branches = [(_expression(node.test), _body(node.body, bodies))]
    rest = node.orelse
    while len(rest) == 1 and isinstance(rest[0], ast.If):
        branches.append((_expression(rest[0].test), _body(rest[0].body, bodies)))
        rest = rest[0].orelse
    return If(tuple(branches), _body(rest, bodies))


def _expression(node: ast.expr) -> Expression:
    found: Expression
    match node:
        case ast.Attribute(ast.Name(owner), name) if owner in _MEMBERS:
            found = Count(number_of(_MEMBERS[owner][name]))
        case ast.Constant(bool(truth)):
            found = Truth(truth)
        case ast.Constant(int(value)):
            found = Count(value)
        case ast.UnaryOp(ast.USub(), of):
            found = Minus(_term(of))
        case ast.UnaryOp(ast.Not(), of):
            found = Not(_expression(of))
        case ast.BinOp(left, sign, right) | ast.Compare(left, [sign], [right]):
            found = Two(_expression(left), _OPERATIONS[type(sign)], _expression(right))
        case ast.Compare(low, [ast.LtE(), ast.LtE()], [middle, high]):
            value = _expression(middle)
            above = Two(value, Operation.MORE_EQUAL, _expression(low))
            below = Two(value, Operation.LESS_EQUAL, _expression(high))
            found = Two(above, Operation.AND, below)
        case ast.BoolOp(sign, values):
            joined = _OPERATIONS[type(sign)]
            found = reduce(lambda a, b: Two(a, joined, b), map(_expression, values))
        case _:
            found = _term(node)
    return found


def _term(node: ast.expr) -> Name | OutputOf | Element:
    match node:
        case ast.Attribute(ast.Name(instance), output):
            return OutputOf(instance, output)
        case _:
            return _target(node)


def _target(node: ast.expr) -> Name | Element:
    match node:
        case ast.Name(name):
            return Name(name)
        case ast.Subscript(ast.Name(array), ast.Name(index)):
            return Element(array, index)
        case _:
            raise SyntaxError(ast.unparse(node))
