"""Whether the tests notice: small changes of a package, each of which should make a test fail.

What is changed stands in `mutants.py`. First every test of the package runs once, in a process of
its own, and its lines are noted. Then each mutant meets the tests that run its line, the quickest
of each test function first: a session with all tests collected is forked, and in the child the
functions of the changed file get their new code. A line that runs on import is tried in a session
that collects anew.

    python benchmarks/mutation.py --package compensation --count 300 --seed 1 --survivors
    python benchmarks/mutation.py --package compensation._limits --count 0        all of a module
    python benchmarks/mutation.py --package runtime screen --commit ec497c9       REV or a folder

A child writes only below a temporary folder of its own, binds only 127.0.0.1 and ends only its own
children; five seconds and ten times its processor time are a test's limit. Linux only. What is
known of a tree stays in the temporary folder thermaxis-mutation; a later call goes on from there.
"""

import argparse
import ast
import ctypes
import gc
import hashlib
import itertools
import json
import os
import random
import resource
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

os.environ.update(dict.fromkeys(("OMP_NUM_THREADS", "POLARS_MAX_THREADS"), "1"))
import polars as pl  # noqa: F401 - read once, before the processes part; nothing of thermaxis
import pydantic  # noqa: F401 - as polars
import pytest
from hypothesis import HealthCheck, Phase, settings
from mutants import Changed, Mutant, called, mutants, replace_functions
from scipy.stats import binomtest

SHARED = ("properties", "reference", "real_data", "contracts")
"""Folders of tests whose files count for the packages that they name."""
QUIETLY = (
    *("-q", "-s", "--assert=plain", "-p", "no:cacheprovider", "-o", "timeout=300"),
    *("-m", "not system", "-W", "ignore::pytest.PytestAssertRewriteWarning"),
)
CACHE = Path(tempfile.gettempdir()) / "thermaxis-mutation"
MOST_TESTS, MOST_SECONDS = 200, 20.0
"""What a mutant meets at most: tests, and their processor time while lines were noted."""
PR_SET_PDEATHSIG = 1
SURVIVES, NOTICED, SLOW, ANEW = 0, 1, 2, 77


def guard(folder: str) -> None:
    """Refuse writing outside the folder, foreign addresses and signals to others, for good."""
    writing = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
    inside = (folder, str(CACHE / "pycache"), "/dev/", ":memory:", "file:")
    moving = {"os.mkdir", "os.rmdir", "os.remove", "os.rename", "os.link", "os.symlink", "os.chmod"}

    def check(event: str, given: tuple[Any, ...]) -> None:
        paths: tuple[Any, ...] = ()
        if event == "open":
            paths = given[:1] if given[2] & writing else ()
        elif event in {"shutil.rmtree", "sqlite3.connect"}:
            paths = given[:1]
        elif event in moving and given[-1] < 0:  # else relative to a folder that was opened
            paths = given[event == "os.symlink" : 2]
        elif event == "socket.bind" and isinstance(given[1], tuple):
            if given[1][0] not in {"127.0.0.1", "localhost"}:
                raise PermissionError(given[1])
        elif event in {"os.kill", "os.killpg"} and given[1] != 0 and given[0] != os.getpid():
            stat = Path(f"/proc/{given[0]}/stat")
            if not stat.is_file() or int(stat.read_text().split(")")[-1].split()[1]) != os.getpid():
                raise PermissionError(given)
        for path in paths:
            name = os.fsdecode(path) if isinstance(path, str | bytes | Path) else folder
            if not name.startswith(inside) and not str(Path(name).absolute()).startswith(inside):
                raise PermissionError(name)

    sys.addaudithook(check)


def in_child(work: Callable[[Path], int], wall_s: float | None = None) -> tuple[int, str]:
    """Return the code of what runs in a forked child, and what it left in `result`.

    A child with a limit of time is guarded and silent.
    """
    folder = Path(tempfile.mkdtemp(prefix="m"))
    child = os.fork()
    if child == 0:
        code = NOTICED
        try:
            os.setpgid(0, 0)
            ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
            os.environ.update(dict.fromkeys(("TMPDIR", "PYTEST_DEBUG_TEMPROOT"), str(folder)))
            tempfile.tempdir = str(folder)
            if wall_s is not None:
                nowhere = os.open(os.devnull, os.O_RDWR)
                for number in range(3):
                    os.dup2(nowhere, number)
                for limit, most in (("DATA", 6 << 30), ("FSIZE", 1 << 30), ("CORE", 0)):
                    resource.setrlimit(getattr(resource, f"RLIMIT_{limit}"), (most, most))
                guard(str(folder))
            code = work(folder)
        finally:
            sys.stdout.flush()
            os._exit(code)
    watched = os.pidfd_open(child)
    try:
        ended, _, _ = select.select([watched], [], [], wall_s)
    finally:
        os.close(watched)
        with suppress(ProcessLookupError):
            os.killpg(child, signal.SIGKILL)
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    text = (folder / "result").read_text() if (folder / "result").is_file() else ""
    shutil.rmtree(folder, ignore_errors=True)
    return (SLOW if not ended or code in {-signal.SIGXCPU, -signal.SIGKILL} else code), text


def run(items: Sequence[Any], cpu_s: Sequence[float]) -> int:
    """Run tests until one fails, which ends the process; each with ten times its time."""
    for item, usual_s, after in zip(items, cpu_s, [*items[1:], None], strict=True):
        limit = int(time.process_time() + 5.0 + 10.0 * usual_s)
        resource.setrlimit(resource.RLIMIT_CPU, (limit, resource.RLIM_INFINITY))
        item.config.hook.pytest_runtest_protocol(item=item, nextitem=after)
    return SURVIVES


class Collected:
    """A pytest session that hands its collected tests over; a failure ends the process."""

    def __init__(self, work: Callable[[dict[str, Any]], int]) -> None:
        self.work, self.code = work, NOTICED

    def pytest_configure(self) -> None:
        """Let hypothesis look for a failure, not for the smallest; slow is no failure here."""
        known = {"derandomize": True, "deadline": None, "suppress_health_check": list(HealthCheck)}
        settings.register_profile("mutation", phases=(Phase.explicit, Phase.generate), **known)
        settings.load_profile("mutation")

    def pytest_runtestloop(self, session: Any) -> bool:
        """Do the work in place of the tests."""
        self.code = self.work({item.nodeid: item for item in session.items})
        return True

    def pytest_runtest_logreport(self, report: Any) -> None:
        """End with the first failure."""
        if report.failed:
            os._exit(NOTICED)

    pytest_collectreport = pytest_runtest_logreport

    def collect(self, files: Sequence[str]) -> int:
        """Collect these files, work, and return the work's code."""
        pytest.main([*QUIETLY, *files], plugins=[self])
        return self.code


@dataclass(frozen=True)
class Test:
    """What a test takes, and the lines of each file that it runs."""

    name: str
    wall_s: float
    cpu_s: float
    lines: dict[str, list[int]]


class Lines:
    """Notes which lines of some files run."""

    def __init__(self, files: Iterable[str]) -> None:
        self.seen: dict[str, set[int]] = {file: set() for file in files}

    def start(self) -> None:
        """Begin with none."""

        def follower(lines: set[int]) -> Callable[..., Any]:
            def follow(frame: Any, event: str, _: object) -> Any:
                if event == "line":
                    lines.add(frame.f_lineno)
                return follow

            lines.clear()
            return follow

        follow = {file: follower(lines) for file, lines in self.seen.items()}

        def trace(frame: Any, _event: str, _: object) -> Any:
            return follow.get(frame.f_code.co_filename)

        threading.settrace(trace)
        sys.settrace(trace)

    def stop(self) -> dict[str, list[int]]:
        """Return what ran since the start."""
        sys.settrace(None)
        return {file: sorted(lines) for file, lines in self.seen.items() if lines}


def measured(files: Iterable[str], test_files: Sequence[str], result: Path) -> int:
    """Leave the lines that run on import and in each test, in a process of its own."""
    lines = Lines(files)

    def one(item: Any, folder: Path) -> int:
        lines.start()
        begun, used = time.perf_counter(), sum(os.times()[:4])
        run([item], [60.0])
        taken = {"wall_s": time.perf_counter() - begun, "cpu_s": sum(os.times()[:4]) - used}
        text = json.dumps({"name": item.nodeid, **taken, "lines": lines.stop()})
        (folder / "result").write_text(text, "utf-8")
        return SURVIVES

    def each(items: dict[str, Any]) -> int:
        found: dict[str, Any] = {"imported": lines.stop(), "tests": [], "failed": []}
        for name, item in items.items():
            code, text = in_child(partial(one, item), 300.0)
            found["failed" if code else "tests"].append(name if code else json.loads(text))
        (result / "result").write_text(json.dumps(found), "utf-8")
        return SURVIVES

    lines.start()
    return Collected(each).collect(test_files)


class Package:
    """A package of a tree: its files, its tests with their lines, and who runs what."""

    def __init__(self, root: Path, name: str, folder: Path) -> None:
        self.root, self.name, self.folder = root, name, folder
        top, _, _ = name.partition(".")
        source, tests = root / "src" / "thermaxis" / top, root / "tests"
        files = sorted(source.rglob("*.py")) if source.is_dir() else [source.with_suffix(".py")]
        self.files = {str(file): file.read_text("utf-8") for file in files}
        named = [file for one in SHARED for file in sorted((tests / one).rglob("test_*.py"))]
        named = [file for file in named if f"thermaxis.{top}" in file.read_text("utf-8")]
        self.test_files = [*map(str, sorted((tests / "unit" / top).rglob("test_*.py")))]
        self.test_files += map(str, named)
        folder.mkdir(parents=True, exist_ok=True)
        known = folder / "lines.json"
        if not known.is_file():
            _, text = in_child(partial(measured, self.files, self.test_files))
            known.write_text(text or sys.exit(f"{name}: its tests cannot be collected"), "utf-8")
        found = json.loads(known.read_text("utf-8"))
        if found["failed"]:
            print(f"left out, fail without a change: {', '.join(found['failed'])}", flush=True)
        self.imported = {(file, line) for file, some in found["imported"].items() for line in some}
        self.tests = [Test(**one) for one in found["tests"]]
        self.runs: dict[tuple[str, int], list[Test]] = defaultdict(list)
        for test in self.tests:
            for place in ((file, line) for file, some in test.lines.items() for line in some):
                self.runs[place].append(test)
        self.uses: dict[str, set[tuple[str, int]]] = defaultdict(set)
        for file, text in self.files.items():
            for node in ast.walk(ast.parse(text)):
                word = called(node) or getattr(node, "arg", "") or ""
                self.uses[word].add((file, getattr(node, "lineno", 0)))

    def mutants(self, seed: int, count: int) -> list[Mutant]:
        """Return mutants of the package, or of one module or folder in it, in a drawn order."""
        found: list[Mutant] = []
        for file, source in self.files.items():
            parts = Path(file).relative_to(self.root / "src").with_suffix("").parts
            module = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
            if f"{module}.".startswith(f"thermaxis.{self.name}."):
                found.extend(mutants(file, module, source))
        random.Random(seed).shuffle(found)  # noqa: S311 - a sample, no secret
        return list(itertools.islice((one for one in found if one.code()), count or None))

    def candidates(self, mutant: Mutant) -> tuple[bool, list[Test]]:
        """Return whether the line runs on import, and the tests that may notice."""
        own, near = ({(mutant.file, line) for line in lines} for lines in mutant.lines)
        places = own if own & (self.imported | self.runs.keys()) else near
        on_import = not places.isdisjoint(self.imported)
        if on_import:
            places = places.union(*(self.uses[name] for name in mutant.bound))
        tests = {test.name: test for place in places for test in self.runs.get(place, ())}
        if on_import and not tests:
            tests = {test.name: test for test in self.tests if mutant.file in test.lines}
        rank: Counter[str] = Counter()
        order: list[tuple[int, float, Test]] = []
        for test in sorted(tests.values(), key=lambda test: test.wall_s):
            function = test.name.partition("[")[0]
            order.append((rank[function], test.wall_s, test))
            rank[function] += 1
        chosen = [test for *_, test in sorted(order, key=lambda one: one[:2])][:MOST_TESTS]
        spent_s = itertools.accumulate(test.cpu_s for test in chosen)
        return on_import, chosen[: max(1, sum(one <= MOST_SECONDS for one in spent_s))]


class Trial:
    """Mutants of a package meet its tests; the verdicts stay in a file."""

    def __init__(self, package: Package) -> None:
        self.package, self.file = package, package.folder / "verdicts.jsonl"
        self.file.touch()

    def known(self) -> dict[str, str]:
        """Return the verdicts of this call and earlier ones."""
        return dict(map(json.loads, self.file.read_text("utf-8").splitlines()))

    def note(self, mutant: Mutant, verdict: str) -> None:
        """Keep a verdict."""
        with self.file.open("a", encoding="utf-8") as out:
            out.write(json.dumps([mutant.key, verdict]) + "\n")

    def verdicts(self, chosen: Sequence[Mutant]) -> dict[str, str]:
        """Return the verdict on each mutant."""
        known = self.known()
        left = [(one, *self.package.candidates(one)) for one in chosen if one.key not in known]
        for mutant, _, tests in left:
            if not tests:
                self.note(mutant, "not covered")
        living = [(mutant, tests) for mutant, on_import, tests in left if tests and not on_import]
        if living:
            session = Collected(partial(self.in_one_session, living))
            in_child(lambda _: session.collect(self.package.test_files))
        known = self.known()
        for mutant, _, tests in left:
            if mutant.key not in known:
                self.tried(mutant, tests, partial(collected_anew, tests))
        known = self.known()
        return {one.key: known[one.key] for one in chosen}

    def tried(self, mutant: Mutant, tests: list[Test], work: Callable[[CodeType], int]) -> None:
        """Note what becomes of a mutant in a child that does the work."""
        code = mutant.code()
        assert code  # noqa: S101 - else it was not chosen

        def child(_: Path) -> int:
            sys.meta_path.insert(0, Changed(mutant, code))
            return work(code)

        end, _ = in_child(child, 30.0 + 5.0 * sum(test.wall_s for test in tests))
        if end != ANEW:
            words = {SURVIVES: "survives", SLOW: "noticed by time"}
            self.note(mutant, words.get(end, "noticed"))

    def in_one_session(
        self, living: list[tuple[Mutant, list[Test]]], items: Mapping[str, Any]
    ) -> int:
        """Try one mutant after the other in children of a session with all tests collected."""
        gc.unfreeze()
        functions: dict[str, list[FunctionType]] = defaultdict(list)
        for one in gc.get_objects():
            if type(one) is FunctionType:
                functions[one.__code__.co_filename].append(one)
        gc.freeze()

        def work(mutant: Mutant, tests: list[Test], code: CodeType) -> int:
            is_loaded = mutant.module in sys.modules
            if is_loaded and not replace_functions(code, functions[mutant.file]):
                return ANEW
            return run_these(tests, items)

        for mutant, tests in living:
            self.tried(mutant, tests, partial(work, mutant, tests))
        return SURVIVES


def run_these(tests: Sequence[Test], items: Mapping[str, Any]) -> int:
    """Run what the mutant leaves of the tests."""
    found = [test for test in tests if test.name in items]
    return run([items[test.name] for test in found], [test.cpu_s for test in found])


def collected_anew(tests: Sequence[Test], _: CodeType) -> int:
    """Collect the files of tests and run these."""
    resource.setrlimit(resource.RLIMIT_CPU, (120, resource.RLIM_INFINITY))
    files = sorted({test.name.partition("::")[0] for test in tests})
    return Collected(partial(run_these, tests)).collect(files)


def tree_of(commit: str) -> Path:
    """Return a folder, or the tree of a revision cut out below the cache."""
    if Path(commit).is_dir():
        return Path(commit).resolve()
    here = Path(__file__).resolve().parents[1]
    root = CACHE / commit.replace("/", "-") / "tree"
    cut = root.with_suffix(".tar")
    shutil.rmtree(root.parent, ignore_errors=True)
    root.mkdir(parents=True)
    subprocess.run(("git", "-C", str(here), "archive", "-o", str(cut), commit), check=True)
    shutil.unpack_archive(cut, root, filter="data")
    (root.parent / "shared").symlink_to(here.parent / "shared")
    return root


def main() -> None:
    """Run the mutants and print how many are noticed, with the interval of Clopper and Pearson."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--package", nargs="+", required=True, help="compensation, files.table ...")
    parser.add_argument("--count", type=int, default=300, help="mutants of each; 0 is all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--commit", default=str(Path(__file__).parents[1]), help="REV or a folder")
    parser.add_argument("--survivors", action="store_true", help="list what no test notices")
    parser.add_argument("--json", type=Path, help="a folder for the verdicts, a file a package")
    given = parser.parse_args()
    root = tree_of(given.commit)
    sys.path[:0] = [str(root / "src"), str(root)]
    sys.pycache_prefix = str(CACHE / "pycache")
    os.environ.update(PYTHONPATH=f"{root / 'src'}:{root}", PYTHONPYCACHEPREFIX=sys.pycache_prefix)
    os.environ.update(HYPOTHESIS_STORAGE_DIRECTORY=str(CACHE / "hypothesis"))
    os.chdir(root)
    files = [file for one in ("src", "tests") for file in sorted((root / one).rglob("*.py"))]
    state = hashlib.sha256(b"".join(map(Path.read_bytes, files))).hexdigest()[:12]
    print(f"{'package':<24}{'mutants':>8}{'noticed':>8}{'share':>8}{'95 %':>17}  not covered")
    for name in given.package:
        package = Package(root, name, CACHE / state / name.partition(".")[0])
        chosen = package.mutants(given.seed, given.count) or sys.exit(f"{name}: nothing to change")
        verdicts = Trial(package).verdicts(chosen)
        count = Counter(verdict.partition(" by")[0] for verdict in verdicts.values())
        share, most = count["noticed"] / len(verdicts), len(verdicts)
        low, high = binomtest(count["noticed"], most).proportion_ci()
        print(f"{name:<24}{most:>8}{count['noticed']:>8}{share:>8.1%}", end="")
        print(f"{low:>8.1%}..{high:6.1%}{count['not covered']:>13}", flush=True)
        if given.json:
            given.json.mkdir(parents=True, exist_ok=True)
            text = json.dumps({"package": name, **count, "verdicts": verdicts}, indent=1)
            (given.json / f"{name}.json").write_text(text, "utf-8")
        for key, verdict in verdicts.items() if given.survivors else ():
            if not verdict.startswith("noticed"):
                place = Path(key.rpartition(" @")[0]).relative_to(root)
                print(f"  {verdict}: {place}")


if __name__ == "__main__":
    main()
