"""A block while it is written, and short words for the statements of the tree."""

from collections.abc import Iterable
from enum import StrEnum
from functools import reduce
from typing import TypeAlias, final

from thermaxis.plc.tree import (
    Assign,
    Block,
    Call,
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
NumberTerm: TypeAlias = Name | OutputOf | Element
"""What has a number without an operation."""

YES = Truth(value=True)
NO = Truth(value=False)


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

    def input(self, name: str, text: str, kind: Kind = Kind.NUMBER) -> Name:
        """Declare an input."""
        return _declared(self._inputs, Variable(name, kind, text, _none_of(kind)))

    def output(self, name: str, text: str, kind: Kind = Kind.NUMBER, start: float = 0) -> Name:
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
    ) -> Name:
        """Declare a state, or an array."""
        return _declared(self._states, Variable(name, kind, text, start or _none_of(kind), length))

    def temporary(self, name: str, text: str, kind: Kind = Kind.NUMBER) -> Name:
        """Declare a variable that is computed anew in every call."""
        return _declared(self._temporaries, Variable(name, kind, text, _none_of(kind)))

    def constant(self, name: str, text: str, value: float) -> Name:
        """Declare a number that never changes; one that the target cannot hold is refused."""
        stored(value, double=self.double, where=f"{self.name}, {name}: {text}")
        return _declared(self._constants, Variable(name, Kind.NUMBER, text, value))

    def instance(self, name: str, block: str) -> str:
        """Declare an instance of another block."""
        self._instances.append(Instance(name, block))
        return name

    def block(self, *body: Statement) -> Block:
        """Return the block."""
        return Block(
            name=self.name,
            remarks=self._remarks,
            inputs=tuple(self._inputs),
            outputs=tuple(self._outputs),
            states=tuple(self._states),
            temporaries=tuple(self._temporaries),
            constants=tuple(self._constants),
            instances=tuple(self._instances),
            body=body,
        )


def _none_of(kind: Kind) -> float | bool | int:
    return {Kind.NUMBER: 0.0, Kind.BOOL: False, Kind.INT: 0}[kind]


def _declared(variables: list[Variable], variable: Variable) -> Name:
    variables.append(variable)
    return Name(variable.name)


# ---- statements ---------------------------------------------------------------------------------


def let(target: Name | Element, value: Expression) -> Assign:
    """Give a variable a value."""
    return Assign(target, value)


def when(condition: Expression, *body: Statement) -> If:
    """Carry out statements where a condition holds."""
    return If(((condition, body),))


def choose(*branches: tuple[Expression, Body], otherwise: Body = ()) -> If:
    """Carry out the first branch whose condition holds."""
    return If(branches, otherwise)


def call(instance: str, **inputs: Name | Truth) -> Call:
    """Call an instance, the inputs in the order of its block."""
    return Call(instance, tuple(inputs.items()))


def note(text: str) -> Remark:
    """Write a line for the reader."""
    return Remark(text)


def numbered(members: Iterable[StrEnum], between: str = " ") -> str:
    """Return every member with its number, its place among them, for a remark."""
    return between.join(f"{k} {member}" for k, member in enumerate(members))


# ---- expressions --------------------------------------------------------------------------------


def plus(left: Expression, right: Expression) -> Two:
    """Return a sum."""
    return Two(left, Operation.ADD, right)


def less(left: Expression, right: Expression) -> Two:
    """Return a difference."""
    return Two(left, Operation.SUBTRACT, right)


def times(left: Expression, right: Expression) -> Two:
    """Return a product."""
    return Two(left, Operation.MULTIPLY, right)


def over(left: Expression, right: Expression) -> Two:
    """Return a quotient."""
    return Two(left, Operation.DIVIDE, right)


def minus(of: NumberTerm) -> Minus:
    """Return a number with the other sign."""
    return Minus(of)


def below(left: Expression, right: Expression) -> Two:
    """Whether the left is less than the right."""
    return Two(left, Operation.LESS, right)


def above(left: Expression, right: Expression) -> Two:
    """Whether the left is more than the right."""
    return Two(left, Operation.MORE, right)


def at_least(left: Expression, right: Expression) -> Two:
    """Whether the left is the right or more."""
    return Two(left, Operation.MORE_EQUAL, right)


def at_most(left: Expression, right: Expression) -> Two:
    """Whether the left is the right or less."""
    return Two(left, Operation.LESS_EQUAL, right)


def equals(left: Expression, right: Expression) -> Two:
    """Whether two whole numbers, or two copied numbers, are equal."""
    return Two(left, Operation.EQUAL, right)


def within(value: Expression, lowest: Expression, highest: Expression) -> Expression:
    """Whether a number lies between two others or on one of them: false for NaN."""
    return both(at_least(value, lowest), at_most(value, highest))


def both(*conditions: Expression) -> Expression:
    """Whether all of them hold."""
    return reduce(lambda a, b: Two(a, Operation.AND, b), conditions)


def either(*conditions: Expression) -> Expression:
    """Whether one of them holds."""
    return reduce(lambda a, b: Two(a, Operation.OR, b), conditions)


def no(condition: Expression) -> Not:
    """Whether it does not hold."""
    return Not(condition)
