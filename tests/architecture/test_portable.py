"""Axes, identification, app and fleet use nothing that only POSIX systems have.

Read by syntax tree over every module that these commands can import, lazily exported names
followed to where they are. What stands under a test for the system is allowed, and so is what
catches the lack of it.
"""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from thermaxis.cli import GROUPS

SOURCE = Path(__file__).resolve().parents[2] / "src"
MODULES = {
    "crypt",
    "fcntl",
    "grp",
    "nis",
    "posix",
    "pty",
    "pwd",
    "resource",
    "syslog",
    "termios",
    "tty",
}
NAMES = {
    "os": (
        "chown fchmod fchown fork forkpty getegid geteuid getgid getgroups getloadavg getpgid"
        " getuid initgroups killpg lchown major mkfifo mknod nice pread pwrite sched_getaffinity"
        " sched_setaffinity setegid seteuid setgid setpgid setsid setuid statvfs sync uname wait"
        " waitid O_CLOEXEC O_DIRECTORY O_NOFOLLOW O_NONBLOCK O_SYNC WNOHANG WEXITSTATUS"
    ),
    "signal": (
        "SIGALRM SIGCHLD SIGCONT SIGHUP SIGKILL SIGPIPE SIGQUIT SIGSTOP SIGTSTP SIGUSR1 SIGUSR2"
        " alarm pause pthread_kill pthread_sigmask setitimer sigwait"
    ),
    "socket": "AF_UNIX SOCK_CLOEXEC SOCK_NONBLOCK SO_PEERCRED SO_REUSEPORT",
    "time": "clock_gettime tzset",
    "select": "epoll poll",
}
ONLY = {module: set(names.split()) for module, names in NAMES.items()}
KEYWORDS = {"add_signal_handler", "preexec_fn"}
STARTS = [
    f"thermaxis.cli.{group}.{name.replace('-', '_')}"
    for group in ("axis", "thermal", "fleet", "exchange")
    for name in GROUPS[group]
]


def file_of(module: str) -> Path | None:
    place = SOURCE.joinpath(*module.split("."))
    for path in (place / "__init__.py", place.with_suffix(".py")):
        if path.is_file():
            return path
    return None


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def where(package: str, name: str) -> str:
    """Return the module that a name of a package comes from."""
    if file_of(f"{package}.{name}"):
        return f"{package}.{name}"
    path = file_of(package)
    stub = path.with_suffix(".pyi") if path else None
    if stub is None or not stub.is_file():
        return package
    for node in tree_of(stub).body:
        if isinstance(node, ast.ImportFrom):
            inner = f"{package}.{node.module}" if node.level else str(node.module)
            if any(name in (alias.asname, alias.name) for alias in node.names):
                return where(inner, name)
            if node.names[0].name == "*" and where(inner, name) != inner:
                return where(inner, name)
    return package


def only_checked(node: ast.stmt) -> bool:
    return isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)


def imports(module: str) -> Iterator[str]:
    """Yield what a module imports, and where what it takes of imported packages comes from."""
    path = file_of(module)
    assert path is not None
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    waiting: list[ast.AST] = [tree_of(path)]
    bound: dict[str, str] = {}
    taken: list[tuple[str, str]] = []
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.stmt) and only_checked(node):
            continue
        waiting += ast.iter_child_nodes(node)
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = str(node.module)
            if node.level:
                up = package.split(".")[: len(package.split(".")) - node.level + 1]
                base = ".".join([*up, *([node.module] if node.module else [])])
            for alias in node.names:
                bound[alias.asname or alias.name] = found = where(base, alias.name)
                yield found
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            taken.append((node.value.id, node.attr))
    yield from (where(bound[name], attribute) for name, attribute in taken if name in bound)


def reached(starts: list[str]) -> set[str]:
    """Return every module of ours that importing these can load."""
    found: set[str] = set()
    waiting = [*starts, "thermaxis.cli"]
    while waiting:
        module = waiting.pop()
        if module in found or file_of(module) is None or not module.startswith("thermaxis"):
            continue
        found.add(module)
        waiting += imports(module)
        waiting += [module.rpartition(".")[0]] if "." in module else []
    return found


def guarded(parents: list[ast.AST]) -> bool:
    for node in parents:
        if isinstance(node, ast.If | ast.IfExp):
            test = ast.unparse(node.test)
            if any(word in test for word in ("sys.platform", "os.name", "hasattr(", "_POSIX")):
                return True
        if isinstance(node, ast.Try):
            caught = " ".join(ast.unparse(one.type) for one in node.handlers if one.type)
            if "ImportError" in caught or "AttributeError" in caught:
                return True
    return False


def posix_only(tree: ast.AST) -> list[str]:
    """Return what only POSIX has, as `name in line`, but where it is guarded."""
    wrong: list[str] = []

    def visit(node: ast.AST, parents: list[ast.AST]) -> None:
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names if alias.name in MODULES]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names = [str(node.module)] if node.module in MODULES else []
            only = ONLY.get(str(node.module), set())
            names += [f"{node.module}.{alias.name}" for alias in node.names if alias.name in only]
        elif isinstance(node, ast.Attribute):
            base = node.value.id if isinstance(node.value, ast.Name) else ""
            if node.attr in ONLY.get(base, set()) or node.attr in KEYWORDS:
                names = [f"{base}.{node.attr}"]
        elif isinstance(node, ast.keyword) and node.arg in KEYWORDS:
            names = [str(node.arg)]
        line = getattr(node, "lineno", 0)
        if names and not guarded(parents):
            wrong.extend(f"{name} in line {line}" for name in names)
        for child in ast.iter_child_nodes(node):
            visit(child, [*parents, node])

    visit(tree, [])
    return wrong


def test_what_runs_in_an_office_uses_nothing_that_only_posix_has() -> None:
    modules = reached(STARTS)
    assert {"thermaxis.files.table", "thermaxis.app", "thermaxis.fleet"} <= modules
    found = {module: posix_only(tree_of(path)) for module in modules if (path := file_of(module))}
    assert {module: names for module, names in sorted(found.items()) if names} == {}


def test_such_a_use_is_noticed_and_a_guarded_one_is_not() -> None:
    source = (
        "import os, fcntl\nimport signal\nfrom signal import SIGHUP\n"
        "os.geteuid()\nsignal.signal(signal.SIGHUP, print)\n"
        "if os.name == 'posix':\n    os.fork()\n"
        "try:\n    import pwd\nexcept ImportError:\n    pwd = None\n"
    )
    assert sorted(posix_only(ast.parse(source))) == [
        "fcntl in line 1",
        "os.geteuid in line 4",
        "signal.SIGHUP in line 3",
        "signal.SIGHUP in line 5",
    ]
    assert "thermaxis.runtime.loop._loop" in reached(["thermaxis.cli.machine.run"])
