"""Whether the tests notice: every small change of the core must make one of them fail.

For each module of the core that may act on a machine a syntax tree is changed in one place at a
time: a comparison turned or moved to its edge, + and - exchanged, a number changed, `and` and `or`
exchanged, a `not` dropped, True and False exchanged, min and max exchanged, the branches of a
choice exchanged, a statement left out. The tests of the core run against each mutant in a process
of its own with a limit of time; one process at a time. What no test notices is printed, and
explained in docs/decisions/0013-mutation-test.md.

    python benchmarks/mutation.py                     all mutants
    python benchmarks/mutation.py _limits _quality    of these modules
    python benchmarks/mutation.py --at _cycle:120     of one line, with the tests' words
"""

import ast
import copy
import importlib.abc
import importlib.machinery
import importlib.util
import os
import random
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType

import hypothesis  # noqa: F401 - read once, before the processes part
import pytest

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "src" / "thermaxis" / "compensation"
MODULES = ("_limits", "_quality", "_supervisor", "_cycle")
STAGES = (
    (
        "tests/unit/compensation/test_supervisor.py",
        "tests/unit/compensation/test_cycle.py",
        "tests/unit/compensation/test_quality.py",
        "tests/unit/compensation/test_limits.py",
        "tests/unit/compensation/test_compensation.py",
    ),
    ("tests/properties/test_cycle_laws.py",),
)
"""What is quick comes first; the rest runs only for what it leaves."""
QUICKLY = (
    *("-x", "-q", "--assert=plain", "-p", "no:cacheprovider"),
    *("-W", "ignore::pytest.PytestAssertRewriteWarning"),
)
LONGEST_S = 60
MOST_SECONDS = 900.0
SEED = 1
"""When the time does not suffice, what was tried is a sample: the order is drawn with this."""
SWAPS: dict[type[ast.AST], tuple[type[ast.AST], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
    ast.Add: (ast.Sub,),
    ast.Sub: (ast.Add,),
    ast.Mult: (ast.Div,),
    ast.Div: (ast.Mult,),
    ast.And: (ast.Or,),
    ast.Or: (ast.And,),
}
NAMES = {"min": "max", "max": "min", "any": "all", "all": "any"}


def is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def changes(node: ast.AST) -> Iterator[tuple[str, ast.AST | None]]:  # noqa: C901 - a list
    """Yield what a node may be changed to, with words; None leaves a statement out."""
    if isinstance(node, ast.Compare):
        for i, one in enumerate(node.ops):
            for other in SWAPS.get(type(one), ()):
                new = copy.deepcopy(node)
                new.ops[i] = other()
                yield f"{type(one).__name__} to {other.__name__}", new
    elif isinstance(node, ast.BinOp | ast.BoolOp):
        for other in SWAPS.get(type(node.op), ()):
            new = copy.deepcopy(node)
            new.op = other()
            yield f"{type(node.op).__name__} to {other.__name__}", new
    elif isinstance(node, ast.UnaryOp):
        yield f"{type(node.op).__name__} dropped", node.operand
    elif isinstance(node, ast.Constant) and not isinstance(node.value, str | None):
        if isinstance(node.value, bool):
            yield f"{node.value} to {not node.value}", ast.Constant(not node.value)
        elif isinstance(node.value, int | float):
            yield f"{node.value} to {node.value + 1}", ast.Constant(node.value + 1)
    elif isinstance(node, ast.Name) and node.id in NAMES:
        yield f"{node.id} to {NAMES[node.id]}", ast.Name(NAMES[node.id], ast.Load())
    elif isinstance(node, ast.IfExp):
        new = copy.deepcopy(node)
        new.body, new.orelse = new.orelse, new.body
        yield "branches exchanged", new
    elif isinstance(
        node, ast.Assign | ast.AugAssign | ast.Expr | ast.Continue | ast.Raise
    ) and not (isinstance(node, ast.Expr) and is_text(node.value)):
        yield "statement left out", None


def skipped(node: ast.AST) -> bool:
    """Whether nothing below is program: annotations, imports, texts of the interpreter."""
    return isinstance(node, ast.Import | ast.ImportFrom | ast.Assert)


def mutants(tree: ast.Module) -> Iterator[tuple[int, str, Callable[[], ast.Module]]]:
    """Yield line, words and what makes the tree of every mutant."""
    places: list[tuple[tuple[str | int, ...], ast.AST]] = []

    def walk(node: ast.AST, path: tuple[str | int, ...]) -> None:
        for name, value in ast.iter_fields(node):
            if name in {"annotation", "returns", "decorator_list", "type_comment"}:
                continue
            if isinstance(value, list):
                for i, one in enumerate(value):
                    if isinstance(one, ast.AST) and not skipped(one):
                        places.append(((*path, name, i), one))
                        walk(one, (*path, name, i))
            elif isinstance(value, ast.AST) and not skipped(value):
                places.append(((*path, name), value))
                walk(value, (*path, name))

    walk(tree, ())
    for path, node in places:
        top_level = len(path) == 2
        for words, new in changes(node):
            if top_level and new is None:
                continue
            yield getattr(node, "lineno", 0), words, partial(replaced, tree, path, new)


def replaced(tree: ast.Module, path: Sequence[str | int], new: ast.AST | None) -> ast.Module:
    changed = copy.deepcopy(tree)
    parent: ast.AST = changed
    where: list[ast.AST] | None = None
    for step in path[:-1]:
        if isinstance(step, str):
            found = getattr(parent, step)
            where = found if isinstance(found, list) else None
            parent = parent if where is not None else found
        elif where is not None:
            parent = where[step]
    last, put = path[-1], ast.Pass() if new is None else new
    if isinstance(last, int) and where is not None:
        where[last] = put
    else:
        setattr(parent, str(last), put)
    return ast.fix_missing_locations(changed)


class Changed(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Gives one module from a syntax tree."""

    def __init__(self, module: str, tree: ast.Module) -> None:
        self.name, self.tree = f"thermaxis.compensation.{module}", tree
        self.file = str(FOLDER / f"{module}.py")

    def find_spec(
        self, fullname: str, path: object = None, target: object = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Find the one module."""
        del path, target
        if fullname != self.name:
            return None
        return importlib.util.spec_from_loader(fullname, self, origin=self.file)

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> ModuleType | None:
        """Let the interpreter make it."""
        del spec

    def exec_module(self, module: ModuleType) -> None:
        """Run the tree."""
        exec(compile(self.tree, self.file, "exec"), module.__dict__)  # noqa: S102 - its purpose


def survives(module: str, tree: ast.Module, *, loud: bool = False) -> bool:
    """Whether every test passes with the mutant."""
    return all(passes(module, tree, tests, loud=loud) for tests in STAGES)


def passes(module: str, tree: ast.Module, tests: Sequence[str], *, loud: bool) -> bool:
    """Whether tests pass with the mutant, in a process of its own."""
    child = os.fork()
    if child == 0:
        signal.alarm(LONGEST_S)
        if not loud:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, 1)
            os.dup2(nowhere, 2)
        code = 1
        try:
            sys.meta_path.insert(0, Changed(module, tree))
            code = int(pytest.main([*QUICKLY, *tests]))
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)
    _, status = os.waitpid(child, 0)
    return os.waitstatus_to_exitcode(status) == 0


def main(arguments: Sequence[str]) -> int:
    """Run the mutants and print those that no test notices."""
    os.chdir(ROOT)
    sys.path.insert(0, str(ROOT))
    place = arguments[1].split(":") if arguments[:1] == ["--at"] else None
    chosen = [place[0]] if place else list(arguments) or list(MODULES)
    work: list[tuple[str, int, str, Callable[[], ast.Module]]] = []
    for module in chosen:
        tree = ast.parse((FOLDER / f"{module}.py").read_text(encoding="utf-8"))
        if not survives(module, tree):
            print("the tests fail without any change")
            return 1
        work.extend((module, *one) for one in mutants(tree))
    if place:
        for module, line, words, made in work:
            if line == int(place[1]):
                print(f"{words}: {'survives' if survives(module, made(), loud=True) else 'killed'}")
        return 0
    random.Random(SEED).shuffle(work)  # noqa: S311 - a sample, no secret
    begun, tried, left = time.monotonic(), 0, []
    for module, line, words, made in work:
        if time.monotonic() - begun > MOST_SECONDS:
            break
        tried += 1
        if survives(module, made()):
            left.append((module, line, words))
            print(f"survives: {module}.py:{line}: {words}", flush=True)
    print(f"{len(work)} mutants, {tried} tried, {tried - len(left)} killed, {len(left)} survive")
    print(f"{time.monotonic() - begun:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
