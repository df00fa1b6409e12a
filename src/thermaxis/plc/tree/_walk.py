"""How the checks and the printers go through a program: scopes, places, what is read."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import final

from thermaxis.errors import ThermaxisError
from thermaxis.plc.tree._tree import (
    Assign,
    Block,
    Call,
    Element,
    Expression,
    If,
    Minus,
    Name,
    Not,
    Program,
    Remark,
    Statement,
    Two,
    Variable,
)


@final
class ProgramError(ThermaxisError):
    """A program breaks a rule of the tree: the exporter has a mistake, nothing was printed."""


@final
@dataclass(frozen=True, slots=True)
class Scope:
    """What the statements of a block may name."""

    block: Block
    """The block."""
    variables: Mapping[str, Variable]
    """Every variable, also the constants, by its name."""
    blocks: Mapping[str, Block]
    """Block of every instance, by the instance's name."""
    readonly: frozenset[str] = field(default=frozenset())
    """Inputs and constants."""
    fresh: frozenset[str] = field(default=frozenset())
    """Outputs and temporaries: of no value before they are written in a call."""


def walk(body: tuple[Statement, ...], where: str) -> Iterator[tuple[Statement, str]]:
    """Yield every statement with its place, those in branches behind their ``If``."""
    for statement, place in placed(body, where):
        yield statement, place
        if isinstance(statement, If):
            for inner, inner_place in branches_of(statement, place):
                yield from walk(inner, inner_place)


def placed(body: tuple[Statement, ...], where: str) -> Iterator[tuple[Statement, str]]:
    """Yield the statements of one level, each with its place."""
    for number, statement in enumerate(body, 1):
        yield statement, f"{where}, statement {number}"


def branches_of(choice: If, where: str) -> Iterator[tuple[tuple[Statement, ...], str]]:
    """Yield the branches, the last one if it is there, each with its place."""
    for number, (_, body) in enumerate(choice.branches, 1):
        yield body, f"{where}, branch {number}"
    if choice.otherwise:
        yield choice.otherwise, f"{where}, last branch"


def expressions_of(statement: Statement) -> tuple[Expression, ...]:
    """Return the expressions that a statement evaluates itself, without its branches."""
    match statement:
        case Assign(_, value):
            return (value,)
        case If(branches):
            return tuple(condition for condition, _ in branches)
        case Call(_, inputs):
            return tuple(value for _, value in inputs)
        case Remark():
            return ()


def parts_of(expression: Expression) -> Iterator[Expression]:
    """Yield an expression and everything in it."""
    yield expression
    match expression:
        case Not(of) | Minus(of):
            yield from parts_of(of)
        case Two(left, _, right):
            yield from parts_of(left)
            yield from parts_of(right)
        case _:
            pass


def reachable(program: Program) -> frozenset[str]:
    """Return the names of the main block and of every block that it calls, however deep."""
    by_name = {block.name: block for block in program.blocks}
    found: set[str] = set()
    open_names = [program.name]
    while open_names:
        name = open_names.pop()
        if name not in found:
            found.add(name)
            open_names += [instance.block for instance in by_name[name].instances]
    return frozenset(found)


def touched(statement: Statement) -> Iterator[Expression]:
    """Yield what a statement evaluates, and the element that it writes to."""
    if isinstance(statement, Assign) and isinstance(statement.target, Element):
        yield statement.target
    for root in expressions_of(statement):
        yield from parts_of(root)


def variables_read(statement: Statement) -> Iterator[str]:
    """Yield the variables that a statement reads itself."""
    written = statement.target if isinstance(statement, Assign) else None
    for part in touched(statement):
        if isinstance(part, Name):
            yield part.name
        elif isinstance(part, Element):
            yield part.index
            if part is not written:
                yield part.array


def names_read(block: Block) -> frozenset[str]:
    """Return the variables that a block reads."""
    return frozenset(
        name for statement, _ in walk(block.body, "") for name in variables_read(statement)
    )
