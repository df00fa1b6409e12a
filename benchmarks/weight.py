"""What the house weighs: lines by package, circles of imports, imports of private modules.

Code lines are neither blank, comment nor docstring; a docstring is every string that stands alone,
also the one below a field of a dataclass. A room is a folder; what `__init__` takes from the rooms
below it in order to export it makes no circle. Nothing is imported: only texts are read.

    python benchmarks/weight.py               the tree as it stands here
    python benchmarks/weight.py ec497c9       that commit, then the tree here
"""

import argparse
import ast
import io
import re
import subprocess
import tarfile
import tokenize
from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import chain
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ("src", "tests", "benchmarks")
PACKAGE = "thermaxis"
COLUMNS = ("files", "code", "docstrings", "comments", "public names", "tests")
OTHER_SUFFIXES = (
    ".js",
    ".css",
    ".html",
    ".typ",
    ".toml",
    ".ftl",
    ".po",
    ".txt",
    ".scl",
    ".st",
    ".c",
    ".h",
)
LAYOUT = {tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
STARRED = re.compile(r"^from \.(\w+) import \*$", re.MULTILINE)
COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)

Tree = Mapping[str, str]
Graph = Mapping[str, set[str]]


def texts_here() -> Tree:
    paths = (path for folder in FOLDERS for path in (ROOT / folder).rglob("*") if path.is_file())
    wanted = (path for path in paths if path.suffix in {".py", ".pyi", *OTHER_SUFFIXES})
    return {path.relative_to(ROOT).as_posix(): path.read_text("utf-8") for path in wanted}


def texts_of(commit: str) -> Tree:
    packed = subprocess.run(
        ["git", "archive", commit, *FOLDERS], cwd=ROOT, check=True, capture_output=True
    ).stdout
    with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
        return {
            member.name: archive.extractfile(member).read().decode("utf-8")
            for member in archive
            if member.isfile() and member.name.endswith((".py", ".pyi", *OTHER_SUFFIXES))
        }


def python_lines(text: str) -> Counter[str]:
    tree = ast.parse(text)
    docstrings: set[int] = set()
    tests = 0
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            if isinstance(node.value.value, str):
                docstrings |= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            tests += node.name.startswith("test_")
    code: set[int] = set()
    comments = 0
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            comments += 1
        elif token.type not in LAYOUT:
            code |= set(range(token.start[0], token.end[0] + 1))
    return Counter(
        {
            "code": len(code - docstrings),
            "docstrings": len(docstrings),
            "comments": comments,
            "public names": exported(tree),
            "tests": tests,
        }
    )


def spelled(tree: Tree, path: str) -> str:
    """Return a text; a stub that takes all names of its folders, with these names."""

    def named(match: re.Match[str]) -> str:
        room = tree[f"{path.rpartition('/')[0]}/{match[1]}/__init__.pyi"]
        names = ", ".join(re.findall(r"\w+ as \w+", room))
        return f"from .{match[1]} import {names}"

    stub = path.endswith("__init__.pyi")
    return STARRED.sub(named, tree[path]) if stub else tree[path]


def exported(tree: ast.Module) -> int:
    """Return how many names `__init__` exports, by a list or by a stub for lazy imports."""
    for node in tree.body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            return len(node.value.elts) if isinstance(node.value, ast.List | ast.Tuple) else 0
    taken = (
        alias for node in tree.body if isinstance(node, ast.ImportFrom) for alias in node.names
    )
    return sum(alias.asname == alias.name for alias in taken)


def other_lines(path: str, text: str) -> Counter[str]:
    if not path.endswith((".js", ".css")):
        return Counter(code=sum(bool(line.strip()) for line in text.splitlines()))
    found = [match.group() for match in COMMENT.finditer(text)]
    docstrings = sum(one.count("\n") + 1 for one in found if one.startswith("/**"))
    comments = sum(one.count("\n") + 1 for one in found if not one.startswith("/**"))
    rest = COMMENT.sub("", text)
    code = sum(bool(line.strip()) for line in rest.splitlines())
    return Counter(code=code, docstrings=docstrings, comments=comments)


def weigh(tree: Tree) -> dict[str, Counter[str]]:
    rows: dict[str, Counter[str]] = {}
    for path, text in sorted(tree.items()):
        parts = PurePosixPath(path).parts
        if path.endswith((".py", ".pyi")):
            lines = python_lines(spelled(tree, path))
            lines["code"] = python_lines(text)["code"]
            if len(parts) != 4 or not parts[3].startswith("__init__."):
                lines["public names"] = 0
            inside = parts[2] if len(parts) > 3 else "(at the top)"
            names = [f"{parts[0]}/{inside}" if parts[0] == "src" else parts[0]]
            names += ["src"] if parts[0] == "src" else []
        elif parts[0] == "src":
            lines, names = other_lines(path, text), [f"src {PurePosixPath(path).suffix}"]
        else:
            continue
        for name in names:
            rows.setdefault(name, Counter()).update(lines, files=1)
    return rows


def imports(tree: ast.Module, module: str, *, is_package: bool) -> Iterator[list[str]]:
    """Yield the dotted names that every import takes, wherever it stands."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = module.split(".")[: -(node.level - is_package) or None] if node.level else []
            source = ".".join([*above, *([node.module] if node.module else [])])
            yield [f"{source}.{alias.name}" for alias in node.names]


def is_private(dotted: str) -> bool:
    return any(part.startswith("_") and not part.startswith("__") for part in dotted.split("."))


def circles(graph: Graph) -> list[list[str]]:
    """Return the groups of which every member reaches every other."""
    reached = {name: below(graph, name) for name in graph}
    groups = {
        tuple(sorted(other for other in reached[name] if name in reached.get(other, ())))
        for name in graph
        if name in reached[name]
    }
    return [list(group) for group in sorted(groups)]


def below(graph: Graph, name: str) -> set[str]:
    found: set[str] = set()
    left = [*graph[name]]
    while left:
        one = left.pop()
        if one not in found:
            found.add(one)
            left.extend(graph.get(one, ()))
    return found


def room_of(module: str, path: str) -> str:
    """Return the folder of a module; one at the top is a room of its own."""
    in_folder = "__init__." not in path and module.count(".") > 1
    return module.rpartition(".")[0] if in_folder else module


def bonds(tree: Tree) -> tuple[dict[str, int], dict[str, list[list[str]]]]:
    """Return numbers of imports of private names across packages, and the circles."""
    dotted_names = {
        path: path.rpartition(".")[0].removesuffix("/__init__").removeprefix("src/")
        for path in tree
        if path.endswith((".py", ".pyi"))
    }
    modules = {path: name.replace("/", ".") for path, name in dotted_names.items()}
    graph = {name: set[str]() for name in modules.values() if name.startswith(PACKAGE)}
    folders = {name: room_of(name, path) for path, name in modules.items()}
    rooms = {folders[name]: set[str]() for name in graph}
    taken = {
        path: list(imports(ast.parse(spelled(tree, path)), name, is_package="__init__." in path))
        for path, name in modules.items()
    }
    exports = {
        f"{name}.{one.rpartition('.')[2]}": one
        for path, name in modules.items()
        if "__init__." in path
        for one in chain.from_iterable(taken[path])
    }
    private = dict.fromkeys(FOLDERS, 0)
    for path, name in modules.items():
        for dotted in taken[path]:
            ours = [one for one in dotted if one.split(".")[0] == PACKAGE]
            private[path.split("/")[0]] += any(
                is_private(one) and one.split(".")[:2] != name.split(".")[:2] for one in ours
            )
            for one in ours if name in graph else ():
                target = defined_in(one, graph, exports)
                if target not in graph or target == name:
                    continue
                graph[name].add(target)
                room, other = folders[name], folders[target]
                if other != room and not ("__init__." in path and other.startswith(f"{room}.")):
                    rooms[room].add(other)
    return private, {"modules": circles(graph), "rooms": circles(rooms)}


def defined_in(dotted: str, graph: Graph, exports: Mapping[str, str]) -> str:
    """Return the module of a name, through the packages that only export it."""
    while dotted not in graph and exports.get(dotted, dotted) != dotted:
        dotted = exports[dotted]
    return dotted if dotted in graph else dotted.rpartition(".")[0]


def main() -> None:
    parser = argparse.ArgumentParser(description="Lines by package, circles, private imports.")
    parser.add_argument("base", nargs="?", help="commit that stands before the tree here")
    base = parser.parse_args().base
    trees = [*([texts_of(base)] if base else []), texts_here()]
    weighed = [weigh(tree) for tree in trees]
    width = 15 if base else 12
    print(f"{'':17}", *(f"{column:>{width}}" for column in COLUMNS))
    for name in sorted({name for rows in weighed for name in rows}):
        counts = [rows.get(name, Counter()) for rows in weighed]
        cells = (" > ".join(f"{count[column]:,}" for count in counts) for column in COLUMNS)
        print(f"{name:17}", *(f"{cell:>{width}}" for cell in cells))
    for rows, tree in zip(weighed, trees, strict=True):
        code = rows["src"]["code"]
        of_code = [rows["src"]["docstrings"] / code, rows["tests"]["code"] / code]
        private, rings = bonds(tree)
        print("\ndocstrings {:.2f} of code, tests {:.2f}".format(*of_code))
        print("imports of private names of another package:", private)
        for kind, groups in rings.items():
            print(f"circles between {kind}: {len(groups)}", *map(", ".join, groups), sep="\n    ")


if __name__ == "__main__":
    main()
