"""Check that everything is written before it is read, on every path through a block."""

from thermaxis.codes import Place
from thermaxis.plc.tree._tree import Assign, If, Name, Statement
from thermaxis.plc.tree._walk import (
    ProgramError,
    Scope,
    branches_of,
    placed,
    variables_read,
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
        for name in variables_read(statement):
            if name in scope.fresh and name not in written:
                raise ProgramError("read_before_written", name=name, place=Place(key=place))
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
