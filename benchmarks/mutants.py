"""The mutants of `mutation.py`: what may be changed in a file, one place at a time, in memory.

A comparison turned or moved to its edge, arithmetic and `and or` exchanged, a condition negated, a
number one higher, an index one further, `min max` and `any all` exchanged, arguments exchanged, a
result or a statement left out. Docstrings, annotations, texts and the words of errors stay.
"""

import ast
import importlib.util
import itertools
import warnings
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.machinery import ModuleSpec, SourceFileLoader
from types import CodeType, FunctionType
from typing import Any

PAIRS = (
    *((ast.Eq, ast.NotEq), (ast.Is, ast.IsNot), (ast.In, ast.NotIn)),
    *((ast.Add, ast.Sub), (ast.Mult, ast.Div), (ast.And, ast.Or)),
)
SWAPS: dict[type[ast.AST], tuple[type[ast.AST], ...]] = {
    **{one: (other,) for pair in PAIRS for one, other in (pair, pair[::-1])},
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    **dict.fromkeys((ast.FloorDiv, ast.Mod, ast.Pow), (ast.Mult,)),
    ast.USub: (ast.UAdd,),
}
NAMES = {"min": "max", "max": "min", "any": "all", "all": "any"}
SYMMETRIC = {*NAMES, "cast", "isinstance", "TypeVar", "hypot", "gcd", "allclose", "isclose"}
LEFT_OUT = ast.Assign | ast.AugAssign | ast.Expr | ast.Continue | ast.Raise
NOT_WALKED = {"annotation", "returns", "ops", "op", "decorator_list"}
Edit = tuple[str, Any, Any, Any]
"""Words, and the node with the attribute, or the list with the index, that gets a new value."""


def called(node: ast.AST) -> str:
    """Return the last name of a name, an attribute or a definition."""
    return getattr(node, "attr", getattr(node, "id", getattr(node, "name", ""))) or ""


def edits(node: ast.AST) -> Iterator[Edit]:  # noqa: C901, PLR0912 - a list
    """Yield what may be changed in a node."""
    for other in SWAPS.get(type(getattr(node, "op", None)), ()):
        yield f"{type(node.op).__name__} -> {other.__name__}", node, "op", other()
    for i, one in enumerate(getattr(node, "ops", ())):
        for other in SWAPS[type(one)]:
            yield f"{type(one).__name__} -> {other.__name__}", node.ops, i, other()
    match node:
        case ast.UnaryOp(op=ast.Not()):
            yield "not dropped", node, "operand", ast.UnaryOp(ast.Not(), node.operand)
        case ast.If(test=test) | ast.While(test=test) | ast.IfExp(test=test):
            if not isinstance(test, ast.Compare | ast.UnaryOp):
                yield "condition negated", node, "test", ast.UnaryOp(ast.Not(), test)
        case ast.Return(value=ast.expr() as value) if not isinstance(value, ast.Constant):
            yield "returns None", node, "value", ast.Constant(None)
        case ast.Constant(value=bool() as value):
            yield f"{value} -> {not value}", node, "value", not value
        case ast.Constant(value=int() | float() as value):
            yield f"{value} -> {value + 1}", node, "value", value + 1
        case ast.Name(id=name) if name in NAMES:
            yield f"{name} -> {NAMES[name]}", node, "id", NAMES[name]
        case ast.Slice():
            for name in ("lower", "upper"):
                end = getattr(node, name)
                if end is not None and not isinstance(end, ast.Constant):
                    yield f"{name} end + 1", node, name, ast.BinOp(end, ast.Add(), ast.Constant(1))
        case ast.Call(args=[_, _, *_] as args) if called(node.func) not in SYMMETRIC:
            if not any(isinstance(one, ast.Starred) for one in args):
                for i in range(len(args) - 1):
                    other = [*args[:i], args[i + 1], args[i], *args[i + 2 :]]
                    yield f"arguments {i + 1} and {i + 2} exchanged", node, "args", other
        case _:
            pass
    for block in (getattr(node, name, None) for name in ("body", "orelse", "finalbody")):
        if isinstance(block, list) and not isinstance(node, ast.Module | ast.ClassDef):
            for i, one in enumerate(block):
                if isinstance(one, LEFT_OUT) and not is_no_program(one):
                    yield "left out", block, i, ast.Pass()


def is_no_program(node: ast.AST) -> bool:
    """Whether nothing below changes what the program does."""
    match node:
        case ast.Assign(targets=[ast.Name(id="__all__" | "__slots__")]):
            return True
        case ast.If(test=name) | ast.Subscript(value=name):
            return called(name) in {"TYPE_CHECKING", "Literal"}
        case ast.Expr(value=ast.Constant()) | ast.keyword(arg="strict"):
            return True
        case _:
            return isinstance(node, ast.Import | ast.ImportFrom | ast.Assert)


def span(node: ast.AST) -> set[int]:
    """Return a node's lines; of a statement with a body those before the body."""
    first, last = getattr(node, "lineno", 0), getattr(node, "end_lineno", 0)
    body = getattr(node, "body", getattr(node, "cases", None))
    if isinstance(body, list):
        last = max(first, getattr(body[0], "lineno", last) - 1)
    return set(range(first, last + 1))


@dataclass(frozen=True, eq=False)
class Mutant:
    """One change of a file."""

    key: str
    file: str
    module: str
    tree: ast.Module
    edit: Edit
    lines: tuple[set[int], set[int]]
    """Of the node, and of its statement: a node in the middle has often no line of its own."""
    bound: tuple[str, ...]
    """Names that the statement gives a value: who uses them is who runs an import's line."""

    def code(self) -> CodeType | None:
        """Return the changed module's code, None where there is no such program."""
        _, place, at, new = self.edit
        values: Any = place if isinstance(place, list) else vars(place)
        old, values[at] = values[at], new
        try:
            with warnings.catch_warnings(action="ignore"), suppress(SyntaxError, ValueError):
                return compile(ast.fix_missing_locations(self.tree), self.file, "exec")
        finally:
            values[at] = old
        return None


def mutants(file: str, module: str, source: str) -> Iterator[Mutant]:
    """Yield every mutant of a file."""
    tree, number = ast.parse(source), itertools.count()

    def walk(node: Any, near: ast.AST) -> Iterator[Mutant]:
        targets = getattr(near, "targets", [getattr(near, "target", near)])
        bound = tuple(filter(None, map(called, targets)))
        for edit in edits(node):
            words, place, at, _ = edit
            one = place[at] if words == "left out" else node
            lines = span(one if hasattr(one, "lineno") else near)
            key = f"{file}:{min(lines)}: {words} @{next(number)}"
            near_lines = lines if words == "left out" else span(near)
            yield Mutant(key, file, module, tree, edit, (lines, near_lines), bound)
        for name, value in ast.iter_fields(node):
            if name not in NOT_WALKED and not isinstance(node, ast.Raise):
                for one in value if isinstance(value, list) else [value]:
                    if isinstance(one, ast.AST) and not is_no_program(one):
                        yield from walk(one, one if isinstance(one, ast.stmt) else near)

    yield from walk(tree, ast.Pass(lineno=0, end_lineno=0))


class Changed(SourceFileLoader):
    """Finds and loads one module from changed code."""

    def __init__(self, mutant: Mutant, code: CodeType) -> None:
        super().__init__(mutant.module, mutant.file)
        self.code = code

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """Find the one module."""
        del path, target
        return importlib.util.spec_from_loader(name, self) if name == self.name else None

    def get_code(self, fullname: str) -> CodeType:
        """Give the changed code in place of the file's."""
        del fullname
        return self.code


def replace_functions(code: CodeType, functions: Sequence[FunctionType]) -> bool:
    """Give the living functions of a file their changed code; False where that is ambiguous."""
    found: dict[tuple[str, int], list[CodeType]] = defaultdict(list)
    left = [code]
    while left:
        one = left.pop()
        found[one.co_qualname, one.co_firstlineno].append(one)
        left.extend(inner for inner in one.co_consts if isinstance(inner, CodeType))
    for function in functions:
        new = found[function.__code__.co_qualname, function.__code__.co_firstlineno]
        if len(new) != 1 or new[0].co_freevars != function.__code__.co_freevars:
            return False
        function.__code__ = new[0]
    return True
