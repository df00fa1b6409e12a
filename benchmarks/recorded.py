"""What every command gives, recorded from a commit and compared with the tree as it stands.

The command lines of README and docs/ of that commit, and more of `recorded_commands.txt`, run in
both trees with the same interpreter, each chapter in a folder of its own; what a chapter leaves
there is the recording. Every number must be equal to 1e-12 (relative), every key, column, option,
file and exit code must be there, every public name importable; words may change and are shown as
a short difference. What may differ stands with its cause in `EXCEPTIONS`, names that moved in
`RENAMED`. Exit code 1 on anything else.

    python benchmarks/recorded.py ec497c9
    python benchmarks/recorded.py ec497c9 --keep /tmp/recorded --only rehearse plc
"""

import argparse
import csv
import difflib
import fnmatch
import hashlib
import html
import json
import math
import os
import re
import shlex
import shutil
import socket
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import chain, zip_longest
from pathlib import Path

import polars as pl

ROOT = Path(__file__).resolve().parents[1]

LIMITS = "verify --limits goes through the whole cycle (docs/decisions/0021)"
STUDIES = "studies of sample time and of printed digits left the package"
REDUNDANT = "a redundant sensor is called so on every wire, no longer spare"
FINDINGS = "findings of several channels are one where code and values agree"
HELP = "help texts and remedies say more"
SPLIT = "what is two things to know is two sentences; sign and unit have keys of their own"
DIGITS = "the remark on the interval has six digits; that on the paper's seven hours is in the docs"
EXCEPTIONS: dict[tuple[str, str], str] = {
    ("limits/*.json", "*.limited.*"): LIMITS,
    ("limits/*.json", "*warnings"): LIMITS,
    ("limits/*.txt", "*"): LIMITS,
    ("*", "*spare*"): REDUNDANT,
    ("own-logs/both_result.json", ".warnings*"): FINDINGS,
    ("public-runs/table.json", ".warnings*"): SPLIT,
    ("tables/*.json", ".warnings*"): SPLIT,
    ("tables/sum.json", ".sentences*"): SPLIT,
    ("plan/0?_plan.txt", "*"): DIGITS,
    ("plan/plan_of_300.json", ".remarks*"): DIGITS,
    ("readme/10_plan.txt", "*"): DIGITS,
    ("readme/23_export.err.txt", "*"): HELP,
    ("help/13_machine_--help.txt", "*"): HELP,
    ("names", "thermaxis.thermal.[Ss]ample*[Tt]ime*"): STUDIES,
    ("names", "thermaxis.thermal.p*_with*"): STUDIES,
    **{
        ("names", f"thermaxis.plc.{name}"): "`CallSequence` and `vectors_of` do the same"
        for name in ("scenario", "course_steps", "vectors_csv", "line_vectors_csv")
    },
    ("names", "thermaxis.runtime.Problem"): "what is wrong with a configuration is a `Message`",
    **{
        ("names", f"thermaxis.thermal.{name}"): "a loop over `block_means`, a rounding"
        for name in ("SampleTimeTrial", "sample_time_study", "printed_with", "part_with_digits")
    },
}
"""Causes of differences from ec497c9 by patterns: file of a chapter, place in it."""

RENAMED_KEYS = {"heal_s": "recovery_delay_s", "grace_s": "input_timeout_s"}
"""Keys of JSON that follow a key of machine.toml which was given the field's name."""
RENAMED: dict[str, str] = {
    "thermaxis.runtime.Borders": "thermaxis.runtime.Ports",
    "thermaxis.compensation.judge": "thermaxis.compensation.validate_sample",
    "thermaxis.plc.Course": "thermaxis.plc.CallSequence",
    "thermaxis.plc.Twin": "thermaxis.plc.CycleBlock",
    "thermaxis.report.read_budget": "thermaxis.files.read_budget",
    "thermaxis.report.read_header": "thermaxis.files.read_header",
    "thermaxis.report.read_limits": "thermaxis.files.read_figure_limits",
    "thermaxis.report.read_regions": "thermaxis.files.read_regions",
    "thermaxis.runtime.spare_name": "thermaxis.runtime.redundant_name",
}
"""Public names and packages (`thermaxis.thermal.Old`, `thermaxis.old`) by what they are now."""

NOT_BY_ITSELF = re.compile(
    r"thermaxis (?:machine(?!.*--l)|record|check(?!.*--offline)|commission|run|screen"
    r"|certificate fetch)\b"
)
"""Command lines of pages that need a machine, or serve until they are ended."""
NOT_COMPARED = {".toml", ".db", ".png", ".svg", ".pdf", ".der", ".pem", ".crt", ".key", ".password"}
"""Files that have to be there; what they say stands in others."""
NOT_PROMISED = re.compile(r"(?:^|/)(?:examples|data)/|\.lock$|\.other$|-wal$|-shm$|\.state\.json$")
"""Inputs, and files that only the program itself reads."""

MASKS = (
    (r"thermaxis \d+\.\d+\.\d+[\w.+-]*", "thermaxis VERSION"),
    (r"/\S*/(?:base-\w+|now)/[\w.-]+/", ""),
    (r"(?<=127\.0\.0\.1:)\d+", "PORT"),
    (r"\.\w+\.new\b", ".NEW"),
    (r"_[0-9a-f]{4}_(?=[a-z])", "_PREFIX_"),
    (r"(?:[0-9A-F]{2}:){8,}[0-9A-F]{2}", "FINGERPRINT"),
    (r"(?m)^[\d.]+ MB$", "SIZE of the history's files"),
)
"""What differs from one run to the next, in every text."""

NAMES = """
import asyncio, json, sys, time, urllib.request
from asyncua import Client
async def below(node, path):
    names = {path: (await node.read_node_class()).name}
    for child in await node.get_children():
        name = await child.read_browse_name()
        if name.NamespaceIndex:
            names |= await below(child, f"{path}/{name.Name}")
    return names
async def browse(url):
    async with Client(url) as client:
        return await below(client.nodes.objects, "")
def metrics(url):
    lines = urllib.request.urlopen(url).read().decode().splitlines()
    return {line.rpartition(" ")[0]: "" for line in lines if not line.startswith("#")}
url = sys.argv[1]
for seconds in (10, *[2] * 30):  # until a cycle has filled the tree
    time.sleep(seconds)
    try:
        names = asyncio.run(browse(url)) if url.startswith("opc") else metrics(url)
    except OSError:
        continue
    if any("Z_um" in name for name in names):
        break
print(json.dumps(names))
"""
PUBLIC = """
import importlib, inspect, json, pkgutil, sys, thermaxis
names = json.load(sys.stdin) or [
    f"{found.name}.{name}"
    for found in pkgutil.walk_packages(thermaxis.__path__, "thermaxis.")
    if found.ispkg and "._" not in found.name
    for name in getattr(importlib.import_module(found.name), "__all__", ())
]
parameters = {}
for name in names:
    package, _, last = name.rpartition(".")
    try:
        value = getattr(importlib.import_module(package), last)
        parameters[name] = list(inspect.signature(value).parameters) if callable(value) else []
    except (ImportError, AttributeError):
        pass
    except (TypeError, ValueError):
        parameters[name] = []
print(json.dumps(parameters))
"""


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def read(path: Path) -> str:
    return path.read_text("utf-8")


def masked(text: str) -> str:
    for pattern, replacement in MASKS:
        text = re.sub(pattern, replacement, text)
    return text


def environment(tree: Path) -> dict[str, str]:
    fixed = {"OMP_NUM_THREADS": "1", "POLARS_MAX_THREADS": "1", "COLUMNS": "160", "NO_COLOR": "1"}
    return {
        **os.environ,
        **fixed,
        "TZ": "UTC",
        "LC_ALL": "C.UTF-8",
        "PYTHONPATH": str(tree / "src"),
    }


def fenced(text: str) -> list[tuple[str, str]]:
    """Return kind and text of what stands between the fences of a page."""
    return re.findall(r"^```(\w*)\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def toml_block(page: Path, index: str) -> str:
    return [text for kind, text in fenced(read(page)) if kind == "toml"][int(index)]


class Recorder:
    """Runs one chapter in a folder, with the program of one tree and the pages of the base."""

    def __init__(self, tree: Path, pages: Path, folder: Path) -> None:
        self.tree, self.pages, self.folder = tree, pages, folder
        self.exits: dict[str, int] = {}
        self.served: list[tuple[str, subprocess.Popen[bytes]]] = []
        self.ports = {name: free_port() for name in ("port", "status", "metrics")}
        self.environment = environment(tree)

    def record(self, lines: Sequence[str]) -> None:
        """Fill the folder; the exit codes are written last."""
        self.folder.mkdir(parents=True)
        shutil.copytree(self.tree / "examples", self.folder / "examples")
        data = ROOT.parent / "shared" / "data"
        if data.exists():
            (self.folder / "data").symlink_to(data)
        try:
            for line in lines:
                self.step(line)
        finally:
            for line, process in self.served:
                if "machine" in line.split():
                    process.terminate()
                self.exits[line] = process.wait(60)
        (self.folder / "exits.json").write_text(json.dumps(self.exits))

    def step(self, line: str) -> None:
        """Do what one line of `recorded_commands.txt` says."""
        for name, port in self.ports.items():
            line = line.replace(f"{{{name}}}", str(port))
        kind, _, rest = line.partition(" ")
        if kind == "thermaxis":
            self.run(shlex.split(line, comments=True))
        elif kind == "page":
            self.page(self.pages / rest)
        elif kind == "help":
            page = read(self.pages / "docs" / "commands.md")
            for words in re.findall(r"^#+ `thermaxis ([a-z ]+)`", page, re.MULTILINE):
                self.run(["thermaxis", *words.split(), "--help"])
        elif kind == "names":
            self.run(["-c", NAMES, rest.split()[0]], rest.split()[1])
        elif kind == "wait":
            self.served[-1][1].wait(120)
        elif kind == "serve":
            self.serve(shlex.split(rest))
        else:
            self.prepare(kind, *rest.split(" ", 1 if kind == "write" else 2))

    def prepare(self, kind: str, first: str, second: str, third: str = "") -> None:
        """Copy or change a file of the chapter's folder."""
        source, target = self.folder / first, self.folder / (third or second)
        if kind == "copy":
            shutil.copy(source, target)
        elif kind == "folder":
            shutil.copytree(source, target)
        elif kind == "write":
            source.parent.mkdir(exist_ok=True)
            with source.open("a", encoding="utf-8") as file:
                file.write(second.replace("\\n", "\n"))
        elif kind == "edit":
            source.write_text(read(source).replace(second, third), "utf-8")
        elif kind == "toml":
            target.write_text(toml_block(self.tree / first, second), "utf-8")
        elif kind == "merge":
            block = toml_block(self.tree / first, second)
            heads = tuple(re.findall(r"^\[.*?\]", block, re.MULTILINE))
            tables = re.split(r"^(?=\[)", read(target), flags=re.MULTILINE)
            kept = [table for table in tables if not table.startswith(heads)]
            target.write_text("".join(kept) + block, "utf-8")
        else:
            raise ValueError(kind)

    def serve(self, words: list[str]) -> None:
        """Start a command that runs beside the next ones."""
        process = subprocess.Popen(
            [sys.executable, "-m", *words],
            cwd=self.folder,
            env=self.environment,
            stdout=(self.folder / f"serve_{words[1]}.txt").open("wb"),
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        self.served.append((f"serve {words[1]}", process))

    def page(self, page: Path) -> None:
        """Run the command lines and programs of a page; what is private was promised to nobody."""
        for kind, block in fenced(read(page)):
            if kind == "python" and "._" not in block:
                self.run(["-c", block])
            elif kind in {"", "console", "sh"}:
                for line in re.findall(r"^(?:\$ )?(thermaxis .*)", block, re.MULTILINE):
                    if not NOT_BY_ITSELF.match(line):
                        self.step(line.split(" < ")[0])

    def run(self, words: list[str], file: str = "") -> None:
        """Run one command and keep its exit code, standard output and standard error."""
        program = ["-m", *words] if words[0] == "thermaxis" else words
        done = subprocess.run(
            [sys.executable, *program],
            check=False,
            cwd=self.folder,
            env=self.environment,
            input=b"a long password for 1 test\n",
            capture_output=True,
            timeout=600,
            start_new_session=True,
        )
        words = words if words[0] == "thermaxis" else ["", "python"]
        name = f"{len(self.exits):02d}_{'_'.join(words[1:3] if '--help' in words else words[1:2])}"
        self.exits[masked(f"{len(self.exits)} {shlex.join(words)}")] = done.returncode
        suffix = ".json" if done.stdout.startswith(b"{") else ".txt"
        (self.folder / (file or f"{name}{suffix}")).write_bytes(done.stdout)
        if done.stderr:
            (self.folder / f"{name}.err.txt").write_bytes(done.stderr)


NUMBER = re.compile(
    r"(?:(?<=[XYZABCUVWF=])[-+]|(?<![\w.)])[-+\N{MINUS SIGN}])?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?"
)
OPTION = re.compile(r"(?<!\S)--[a-z][a-z-]+")
HASH = re.compile(r"\b[0-9a-f]{32,}\b|sha256:\w+")

Differences = Iterator[tuple[str, str, bool]]
"""Place, what differs, and whether that is more than words."""


def tokens(text: str) -> Counter[float | str]:
    found: Counter[float | str] = Counter(OPTION.findall(text))
    found.update(float(one.replace("\N{MINUS SIGN}", "-")) for one in NUMBER.findall(text))
    return found


def texts(place: str, old: str, new: str) -> Differences:
    old, new = HASH.sub("HASH", old), HASH.sub("HASH", new)
    if old == new:
        return
    before, now = tokens(old), tokens(new)
    if lost := before - now:
        come = now - before
        yield place, f"lost {short(lost.elements())}, new {short(come.elements())}", True
    if old.split() != new.split():
        lines = difflib.unified_diff(old.splitlines(), new.splitlines(), n=0, lineterm="")
        changed = [line for line in lines if line[:1] in "+-" and line[:3] not in {"+++", "---"}]
        yield place, "\n".join(line[:150] for line in changed[:4]), False


def short(values: Iterable[object]) -> str:
    shown = [str(value) for value in values]
    return ", ".join(shown[:6]) + (f" and {len(shown) - 6} more" if len(shown) > 6 else "")


def equal(old: object, new: object) -> bool:
    if isinstance(old, bool) or isinstance(new, bool) or old is None or new is None:
        return old is new
    both = isinstance(old, int | float) and isinstance(new, int | float)
    return math.isclose(old, new, rel_tol=1e-12, abs_tol=1e-15) if both else old == new


def values(place: str, old: object, new: object, *, keys_only: bool = False) -> Differences:
    if isinstance(old, dict) and isinstance(new, dict):
        for key, value in old.items():
            name = key if key in new else RENAMED_KEYS.get(key)
            if name in new:
                yield from values(f"{place}.{key}", value, new[name], keys_only=keys_only)
            else:
                yield f"{place}.{key}", "is gone", True
    elif isinstance(old, list) and isinstance(new, list):
        if len(old) != len(new) and not keys_only:
            yield place, f"{len(old)} entries, now {len(new)}: {short(new)}", True
        for i, (one, other) in enumerate(zip(old, new, strict=False)):
            yield from values(f"{place}.{i}", one, other, keys_only=keys_only)
    elif isinstance(old, str) and isinstance(new, str) and not keys_only:
        yield from texts(place, old, new)
    elif not keys_only and not equal(old, new):
        yield place, f"{old!r}, now {new!r}", True


def columns(text: str) -> tuple[str, dict[str, Sequence[str]]]:
    """Return the comments of a table and its columns, by number where it has no headings."""
    lines = text.splitlines()
    comments = [line for line in lines if line.startswith("#")]
    lines = [line for line in lines if not line.startswith("#")]
    delimiter = ";" if ";" in "".join(lines[:1]) else ","
    rows = list(csv.reader(lines, delimiter=delimiter))
    rows = [row for row in rows if row]
    headed = bool(rows) and not any(number(cell) is not None for cell in rows[0])
    heads = rows.pop(0) if headed else []
    by_column = [list(column) for column in zip_longest(*rows, fillvalue="")]
    named = dict(zip_longest(heads, by_column, fillvalue=())) if heads else {}
    return "\n".join(comments), named or {str(i): cells for i, cells in enumerate(by_column)}


def number(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None


def tables(old: str, new: str, *, keys_only: bool) -> Differences:
    (comments, before), (comments_now, now) = columns(old), columns(new)
    yield from texts("comments", comments, comments_now) if not keys_only else ()
    for name, cells in before.items():
        if name not in now:
            yield name, "column is gone", True
            continue
        if keys_only or cells == now[name]:
            continue
        if len(cells) != len(now[name]):
            yield name, f"{len(cells)} rows, now {len(now[name])}", True
        changed = [
            (i, one, other)
            for i, (one, other) in enumerate(zip(cells, now[name], strict=False))
            if one != other and not (number(one) is not None and equal(number(one), number(other)))
        ]
        if changed:
            i, one, other = changed[0]
            is_number = any(number(a) is not None or number(b) is not None for _, a, b in changed)
            text = f"{len(changed)} of {len(cells)} rows, first {i}: {one!r}, now {other!r}"
            yield name, text, is_number


def compare_files(old: Path, new: Path, *, keys_only: bool) -> Differences:
    if not new.exists():
        yield "", "the file is gone", True
    elif old.suffix == ".parquet":
        both = [pl.read_parquet(path).write_csv() for path in (old, new)]
        yield from tables(*both, keys_only=keys_only)
    elif old.suffix not in NOT_COMPARED:
        before, now = (masked(path.read_text("utf-8", "replace")) for path in (old, new))
        if old.suffix == ".json":
            yield from values("", json.loads(before), json.loads(now), keys_only=keys_only)
        elif old.suffix == ".csv":
            yield from tables(before, now, keys_only=keys_only)
        elif not keys_only:
            if old.suffix == ".html":
                before, now = visible(before), visible(now)
            yield from texts("", before, now)


def visible(page: str) -> str:
    page = re.sub(r"(?s)<(svg|style|script)\b.*?</\1>", "", page)
    return html.unescape(re.sub(r"<[^>]*>", " ", page))


def compare_folders(chapter: str, old: Path, new: Path) -> Differences:
    for path in sorted(old.rglob("*")):
        name = path.relative_to(old)
        if path.is_file() and not NOT_PROMISED.search(name.as_posix()):
            keys_only = chapter == "live" and name.name != "exits.json"
            found = compare_files(path, new / name, keys_only=keys_only)
            yield from ((f"{chapter}/{name}:{place}", text, fails) for place, text, fails in found)


def public(tree: Path, names: Sequence[str] = ()) -> dict[str, list[str]]:
    listed = subprocess.run(
        [sys.executable, "-c", PUBLIC],
        check=True,
        env=environment(tree),
        input=json.dumps(names),
        capture_output=True,
        text=True,
    )
    return json.loads(listed.stdout)


def compare_names(base: Path, tree: Path) -> Differences:
    before = public(base)
    renamed = {name: renamed_as(name) for name in before}
    now = public(tree, list(renamed.values()))
    for name, parameters in before.items():
        if renamed[name] not in now:
            yield f"names:{name}", "can no longer be imported", True
        elif lost := [one for one in parameters if one not in now[renamed[name]]]:
            yield f"names:{name}", f"no parameter {short(lost)}; {short(now[renamed[name]])}", False


def renamed_as(name: str) -> str:
    package, _, last = name.rpartition(".")
    return RENAMED.get(name, f"{RENAMED.get(package, package)}.{last}")


def chapters() -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for line in read(Path(__file__).with_name("recorded_commands.txt")).splitlines():
        if line.startswith("["):
            found[line.strip("[]")] = current = []
        elif line and not line.startswith("#"):
            current.append(line)
    return found


def record_all(
    tree: Path, pages: Path, folder: Path, wanted: Mapping[str, Sequence[str]]
) -> dict[str, Path]:
    """Record the chapters that are not there yet; a chapter whose lines changed is another one."""
    places = {}
    with ThreadPoolExecutor(2) as pool:
        running = []
        for chapter, lines in wanted.items():
            digest = hashlib.sha256("\n".join(lines).encode()).hexdigest()[:8]
            places[chapter] = place = folder / f"{chapter}-{digest}"
            if not (place / "exits.json").exists():
                shutil.rmtree(place, ignore_errors=True)
                running.append(pool.submit(Recorder(tree, pages, place).record, lines))
        for one in running:
            one.result()
    return places


def report(differences: Differences) -> int:
    """Print what differs, and return how much of it no exception explains."""
    unexplained = 0
    explained: Counter[str] = Counter()
    for where, text, fails in differences:
        file, _, place = where.partition(":")
        causes = [
            cause
            for (files, places), cause in EXCEPTIONS.items()
            if fnmatch.fnmatch(file, files) and fnmatch.fnmatch(place, places)
        ]
        if causes:
            explained[causes[0]] += 1
            continue
        unexplained += fails
        print(f"{'DIFFERENT' if fails else 'words'} {where}: {text}")
    for cause, times in explained.items():
        print(f"explained, {times} times: {cause}")
    return unexplained


def main() -> int:
    parser = argparse.ArgumentParser(description="Everything commands give, against a commit.")
    parser.add_argument("base", help="commit whose recordings count")
    parser.add_argument(
        "--keep", type=Path, help="folder in which recordings stay for the next time"
    )
    parser.add_argument("--tree", type=Path, default=ROOT, help="tree that is compared")
    parser.add_argument("--only", nargs="+", help="chapters of recorded_commands.txt, or `names`")
    options = parser.parse_args()
    every = chapters()
    wanted = {name: every[name] for name in every if not options.only or name in options.only}
    with tempfile.TemporaryDirectory() as temporary:
        base = Path(temporary) / "tree"
        git = ["git", "-C", str(ROOT), "worktree"]
        subprocess.run([*git, "add", "-q", "--detach", str(base), options.base], check=True)
        try:
            folder = (options.keep or Path(temporary)).resolve()
            shutil.rmtree(folder / "now", ignore_errors=True)
            old = record_all(base, base, folder / f"base-{options.base}", wanted)
            new = record_all(options.tree.resolve(), base, folder / "now", wanted)
            found = [compare_folders(name, old[name], new[name]) for name in wanted]
            if not options.only or "names" in options.only:
                found.append(compare_names(base, options.tree.resolve()))
            unexplained = report(chain.from_iterable(found))
        finally:
            subprocess.run([*git, "remove", "--force", str(base)], check=True)
    print(f"{len(wanted)} chapters compared; unexplained differences: {unexplained}")
    return int(unexplained > 0)


if __name__ == "__main__":
    raise SystemExit(main())
