"""Check that everything is written before it is read, on every path through a block."""

from thermaxis.codes import Place
from thermaxis.plc.tree._tree import Assign, Element, If, Name, Statement
from thermaxis.plc.tree._walk import (
    ProgramError,
    Scope,
    branches_of,
    expressions_of,
    parts_of,
    placed,
)


def check_flow(scope: Scope) -> None:
    """Check outputs and temporaries of a block.

    Both have no value of their own at the begin of a call: what lasts are the states. A path is
    counted whatever its condition says; an ``If`` without a last branch may do nothing at all.
    Elements of arrays are not followed: an array is zero before the first call in every target.
    """
    where = f"block {scope.block.name}"
    written = _written(scope, scope.block.body, frozenset(), where)
    for output in scope.block.outputs:
        if output.name not in written:
            raise ProgramError("output_not_written", name=output.name, place=Place(key=where))


def _written(
    scope: Scope, body: tuple[Statement, ...], before: frozenset[str], where: str
) -> frozenset[str]:
    """Return what is written for certain behind some statements."""
    written = set(before)
    for statement, place in placed(body, where):
        _check_reads(scope, statement, written, place)
        if isinstance(statement, Assign):
            if isinstance(statement.target, Name):
                written.add(statement.target.name)
        elif isinstance(statement, If):
            so_far = frozenset(written)
            ends = [
                _written(scope, inner, so_far, inner_place)
                for inner, inner_place in branches_of(statement, place)
            ]
            if statement.otherwise:
                written |= {name for name in ends[0] if all(name in end for end in ends)}
    return frozenset(written)


def _check_reads(scope: Scope, statement: Statement, written: set[str], where: str) -> None:
    names = [
        name
        for root in expressions_of(statement)
        for part in parts_of(root)
        for name in (
            (part.name,)
            if isinstance(part, Name)
            else (part.index,)
            if isinstance(part, Element)
            else ()
        )
    ]
    if isinstance(statement, Assign) and isinstance(statement.target, Element):
        names.append(statement.target.index)
    for name in names:
        if name in scope.fresh and name not in written:
            raise ProgramError("read_before_written", name=name, place=Place(key=where))
