"""The blocks of the library: readable text in ``plc/library``, read into the tree.

A part begins with ``%%`` and its name, then come the remarks of the block, an empty line, and
declarations and statements in any order; each declaration is one line::

    input bool is_ok: whether its status is good
    state ring[{cycles}]: past inputs [K]
    constant total{k}_um = {total_um} from total_um: largest magnitude [um]
    instance lag{i}: tx_lag

Without ``bool`` or ``int`` it is a number. Behind ``from`` stands the key that an error names.
Statements are in the words of Python: ``x = a + b``, ``x += a``, ``if`` with ``elif`` and ``else``,
``low <= x <= high``, calls of instances, ``instance.output``, ``array[index]``; ``State.OFF`` is
the number of a member, and a line ``# ...`` is a remark.

Braces hold values. What is indented below ``each name:`` stands once for every item of that name,
with its values; below ``when name:`` and ``unless name:`` it stands where the value says so.
"""

import ast
import re
from collections import defaultdict
from collections.abc import Iterable, Mapping
from enum import StrEnum
from functools import cache, reduce
from importlib.resources import files
from itertools import takewhile
from typing import Final

from thermaxis.codes import Place
from thermaxis.compensation import Outcome, Quality, Reason, SampleQuality, SupervisorState
from thermaxis.plc._texts import expanded
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

_DECLARED = re.compile(
    r" *(input|output|state|temporary|constant|instance) (bool |int |)(\w+)"
    r"(?:\[(\d+)\])?(?: = (\S+))?(?: from (\S+))?: (.*)"
)
_KINDS = {"bool ": Kind.BOOL, "int ": Kind.INT, "": Kind.NUMBER}
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


def library_block(part: str, /, *, double: bool, name: str = "", **values: object) -> Block:
    """Return a block of the library; a constant that the target cannot hold is refused.

    The error names the key behind ``from``, else the constant, and the value ``owner``.
    """
    made = expanded(_library()[part], {"double": double, **values})
    remarks = tuple(line for line, _ in takewhile(lambda pair: pair[0], made))
    declared: defaultdict[str, list[Variable]] = defaultdict(list)
    instances: list[Instance] = []
    code: list[str] = []
    for line, scope in made:
        found = _DECLARED.fullmatch(line)
        if found is None:
            code.append(line)
            continue
        section, kind, own, length, start, key, text = found.groups()
        if section == "instance":
            instances.append(Instance(own, text))
            continue
        variable = _variable(own, _KINDS[kind], text, start, int(length or 0))
        if section == "constant":
            place = Place(key=key or own, channel=scope.get("owner", ""))
            stored(float(variable.start), double=double, place=place)
        declared[section].append(variable)
    return Block(
        name=name or f"tx_{part}",
        remarks=remarks,
        inputs=tuple(declared["input"]),
        outputs=tuple(declared["output"]),
        states=tuple(declared["state"]),
        temporaries=tuple(declared["temporary"]),
        constants=tuple(declared["constant"]),
        instances=tuple(instances),
        body=statements("\n".join(code)),
    )


@cache
def _library() -> Mapping[str, list[str]]:
    folder = files("thermaxis.plc") / "library"
    pages = [page.read_text("utf-8") for page in folder.iterdir()]
    parts = (part.split("\n", 1) for page in pages for part in page.split("%% ")[1:])
    return {key: text.rstrip().split("\n") for key, text in parts}


def _variable(name: str, kind: Kind, text: str, start: str | None, length: int) -> Variable:
    match kind:
        case Kind.NUMBER:
            return Variable(name, kind, text, float(start or 0.0), length)
        case Kind.BOOL:
            return Variable(name, kind, text, start == "True")
        case Kind.INT:
            return Variable(name, kind, text, int(start or 0))


def numbered(members: Iterable[StrEnum], between: str = " ") -> str:
    """Return every member with its number, its place among them, for a remark."""
    return between.join(f"{k} {member}" for k, member in enumerate(members))


def number_of(member: StrEnum) -> int:
    """Return the number of a member: its place, or its bit in a word that adds several."""
    place = list(type(member)).index(member)
    return 2**place if isinstance(member, Reason | Outcome) else place


# ---- statements ---------------------------------------------------------------------------------


@cache
def statements(text: str) -> tuple[Statement, ...]:
    """Return the statements that a text writes in the words of Python."""
    remarks = re.sub(r"^( *)# (.*)$", r'\1"\2"', text, flags=re.MULTILINE)
    return _body(ast.parse(remarks).body)


def _body(nodes: Iterable[ast.stmt]) -> tuple[Statement, ...]:
    return tuple(map(_statement, nodes))


def _statement(node: ast.stmt) -> Statement:
    match node:
        case ast.Expr(ast.Constant(str(remark))):
            return Remark(remark)
        case ast.Expr(ast.Call(ast.Name(instance), [], inputs)):
            return Call(instance, tuple((str(i.arg), _expression(i.value)) for i in inputs))
        case ast.Assign([target], value):
            return Assign(_target(target), _expression(value))
        case ast.AugAssign(target, operator, value):
            old = _target(target)
            return Assign(old, Two(old, _OPERATIONS[type(operator)], _expression(value)))
        case ast.If():
            return _choice(node)
        case _:
            raise SyntaxError(ast.unparse(node))


def _choice(node: ast.If) -> If:
    branches = [(_expression(node.test), _body(node.body))]
    rest = node.orelse
    while len(rest) == 1 and isinstance(rest[0], ast.If):
        branches.append((_expression(rest[0].test), _body(rest[0].body)))
        rest = rest[0].orelse
    return If(tuple(branches), _body(rest))


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
