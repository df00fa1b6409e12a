"""Names in the code are the field's words; no file names a registry or somebody's machine."""

import ast
import importlib
import inspect
import re
from collections.abc import Iterator
from types import ModuleType

import pytest

FORBIDDEN = {
    *("process", "processes", "processor", "handle", "handler", "handles", "manage", "manager"),
    *("util", "utils", "utility", "helper", "helpers", "info", "infos"),
}
# brackets keep these lines from being found by their own search
HOSTS = re.compile(
    r"py[p]i\.org|pythonh[o]sted|npm[j]s|deb\.deb[i]an|crates\.i[o]\b|conda\.an[a]conda",
    re.IGNORECASE,
)
MACHINE_PATHS = re.compile(
    r"(?<![\w.])/(?:[w]ork|[r]oot|[h]ome/\w+|[U]sers/\w+)/|\b[A-Za-z]:\\[U]sers\\|/tmp/b[a]sh"
)
PUBLIC_PACKAGES = (
    "thermaxis.positioning",
    "thermaxis.files",
    "thermaxis.thermal",
    "thermaxis.report",
    "thermaxis.controls",
    "thermaxis.compensation",
    "thermaxis.virtual",
    "thermaxis.runtime",
    "thermaxis.runtime.sources",
    "thermaxis.runtime.sinks",
    "thermaxis.runtime.history",
    "thermaxis.fleet",
)


def words_of(name: str) -> set[str]:
    parts = re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", name).lower().split("_")
    return {part for part in parts if part}


def public_names(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node.name
            if not node.name.startswith("_"):
                arguments = node.args
                every = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
                yield from (argument.arg for argument in every)
        elif isinstance(node, ast.ClassDef):
            yield node.name
            yield from (
                statement.target.id
                for statement in node.body
                if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name)
            )


def forbidden_names(tree: ast.AST) -> list[str]:
    return [
        name
        for name in public_names(tree)
        if not name.startswith("_") and words_of(name) & FORBIDDEN
    ]


def test_no_public_name_says_nothing(root):
    wrong: list[str] = []
    for path in sorted((root / "src").rglob("*.py")):
        if words_of(path.stem) & FORBIDDEN:
            wrong.append(path.name)
        text = path.read_text(encoding="utf-8")
        if any(word in text.lower() for word in FORBIDDEN):
            wrong += [f"{path.name}: {name}" for name in forbidden_names(ast.parse(text))]
    assert wrong == []


def test_a_name_that_says_nothing_is_noticed():
    source = "class RunManager:\n    file_info: str\n\ndef process_run(helper): pass\n"
    found = forbidden_names(ast.parse(source + "def handed_over(processing_time_s): pass"))
    assert sorted(found) == ["RunManager", "file_info", "helper", "process_run"]


@pytest.mark.proof
def test_no_tracked_file_names_a_registry_or_a_machine(tracked_files):
    found: list[str] = []
    for path in tracked_files:
        content = path.read_bytes()
        if b"\0" in content[:4096]:
            continue
        text = content.decode("utf-8", errors="replace")
        for pattern in (HOSTS, MACHINE_PATHS):
            found += [f"{path.name}: {match[0]}" for match in pattern.finditer(text)]
    assert found == []
    for text in ("https://py" + "pi.org/", "/wo" + "rk/main/src", "C:\\Us" + "ers\\anna"):
        assert HOSTS.search(text) or MACHINE_PATHS.search(text), text


def exported(package: ModuleType) -> list[str]:
    return getattr(package, "__all__", [n for n in vars(package) if not n.startswith("_")])


def test_every_public_name_is_in_the_nomenclature(root):
    page = (root / "docs" / "nomenclature.md").read_text(encoding="utf-8")
    written = set(re.findall(r"[A-Za-z_][A-Za-z_0-9]*", page))
    packages = map(importlib.import_module, PUBLIC_PACKAGES)
    lacking = {package.__name__: sorted(set(exported(package)) - written) for package in packages}
    assert lacking == {package: [] for package in PUBLIC_PACKAGES}


def test_every_public_name_is_there_and_is_no_folder():
    for package in map(importlib.import_module, PUBLIC_PACKAGES):
        assert not [n for n in exported(package) if inspect.ismodule(getattr(package, n))]
