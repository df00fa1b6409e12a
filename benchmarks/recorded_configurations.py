"""What every configuration comes to, recorded from one tree and compared with another.

The configurations are those of the examples, of the blocks in docs/, those that the tests write
while they run, and mutants of whole ones: each key removed, misspelt, stated twice, of another
type, out of its range, with another unit. Of each is kept whether it was refused, with codes,
values and places; else every value of the frozen configuration, what is handed to source, sink
and loop (factors, signs, times, limits by value), its hash and what `check` says of it.

    python benchmarks/recorded_configurations.py collect /tmp/configurations
    python benchmarks/recorded_configurations.py record /tmp/configurations /tmp/before.json
    python benchmarks/recorded_configurations.py record /tmp/configurations /tmp/after.json
    python benchmarks/recorded_configurations.py compare /tmp/before.json /tmp/after.json

`--tree` records another checkout. Exit code 1 on a difference that `EXPECTED` does not name.
"""

import argparse
import fnmatch
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from datetime import UTC, datetime
from enum import Enum
from pathlib import Path, PurePath

ROOT = Path(__file__).resolve().parents[1]
TESTS = (
    *("tests/unit/runtime/test_config.py", "tests/unit/runtime/test_config_screen.py"),
    *("tests/unit/runtime/test_config_hash.py", "tests/unit/runtime/test_config_warnings.py"),
    *("tests/unit/runtime/test_record_config.py", "tests/unit/runtime/test_record_connection.py"),
    *("tests/unit/runtime/test_probes.py", "tests/unit/runtime/test_self_test.py"),
    *("tests/unit/runtime/test_linuxcnc_sink.py", "tests/unit/runtime/test_commissioning.py"),
    *("tests/unit/cli", "tests/unit/screen", "tests/scenarios/machine", "tests/docs"),
)
"""Tests that write configurations."""
MEANINGS = "a key's meaning is that of the page docs/machine-toml.md"
WHOLE = "a table is what the file says of it: keys that stood elsewhere alone"
BOUNDS = "bounds of [historian] are those of its keys' types, told as every key's"
NO_URL = "what has no scheme is no address of a database"
LATER = "keys that are younger: their defaults change nothing"
EXPECTED: dict[tuple[str, str], str] = {
    ("*", ".refused*.values.meaning"): MEANINGS,
    ("*", "*.read_back_node"): "an output without a node to read back states none",
    ("*", "*.read_back_stated"): "an output without a node to read back states none",
    ("record*", "*_bytes"): "sizes of a recording are stated in MB",
    ("tests*", "*_bytes"): "sizes of a recording are stated in MB",
    ("*", ".refused*.values.known*"): "younger keys and kinds are among those that are known",
    ("*", ".values.historian.folder"): "a history in PostgreSQL has a folder of its own",
    ("*", ".values.historian.check_s"): "the time between two looks at a database is no setting",
    **{("*-historian.[rl]*", f".refused*.{what}*"): BOUNDS for what in ("code", "values")},
    **{("*-historian.url*", f".refused*.{what}*"): NO_URL for what in ("code", "values")},
    **{("*", f"*.{key}"): LATER for key in ("bit", "on_change", "latch_offset_mismatch")},
}
"""Causes of differences that are meant, by patterns: configuration, place in its record."""
MOVED: dict[str, str] = {
    ".values.model_folder": ".values.machine.model_folder",
    ".values.state_file": ".values.machine.state_file",
    ".values.name": ".values.machine.name",
    ".values.historian_url": ".values.historian.url",
    **{
        f".values.{key}": f".values.supervisor.{key}"
        for key in ("ask_enables", "resume_enabled", "resume_within_s", "at_stop", "stop_within_s")
    },
}
"""Values by what was their place in the frozen configuration."""
OF_A_MACHINE = re.compile(r"^\s*\[(?:machine|record|source|channel\b.*|output\b.*)\]", re.MULTILINE)
KEY = re.compile(r"^(?P<key>[\w-]+)\s*=\s*(?P<value>.*?)\s*(?:#.*)?$")
UNITS = ("_um", "_s", "_k", "_c", "_mm", "_days", "_bytes")
NOW = datetime(2026, 1, 1, tzinfo=UTC)
FULL = """
[server]
address = "127.0.0.1"
port = 4850
users = "users.toml"
anonymous_role = "none"
certificate = "server.der"
private_key = "server.pem"

[metrics]
address = "127.0.0.1"
port = 9180
token_file = "secret"
certificate = "server.der"
private_key = "server.pem"

[screen]
address = "127.0.0.1"
port = 8450
hosts = ["lathe-3.shop"]
certificate = "page.der"
private_key = "page.pem"
view_without_login = false
language = "cs"
user = "viewer"
password_file = "secret"
client_certificate = "own.der"
client_private_key = "own.pem"
idle_s = 600.0
longest_login_s = 7200.0
evaluation_s = 30.0

[probe.Z_um]
node = "ns=2;s=Probe"
unit = "mm"
scale = -0.5
"""
"""Tables that the tests' configuration lacks."""
STATED = {
    "[connection.control]": "timeout_s = 0.5\nretry_s = 1.0\n"
    'application_uri = "urn:thermaxis:client"',
    "[input.T_spindle_C]": "scale = 0.1\nlargest_rate_k_per_s = 0.2\nstep_k = 2.0\n"
    "longest_age_s = 5.0\ntime_stamp_required = false\nfrozen_s = 600.0\n"
    "largest_difference_k = 2.0",
    "[diameter]": "scale = 0.001",
    "[output.Z_um]": "total_um = 120.0\ndeadband_um = 0.5\nsoft_um = 70.0\nlargest_trim_um = 5.0\n"
    'effective_node = "ns=2;s=Z_effective"',
    "[supervisor]": "settle_s = 30.0\nrecovery_delay_s = 2.0\ninput_timeout_s = 3.0\n"
    "hold_connection_s = 200.0\nhold_interlock_s = 1.0\nhold_operator_s = 100.0\n"
    "at_limit_s = 500.0\nread_back_tolerance_um = 0.4\nread_back_s = 8.0\n"
    'longest_trim_s = 100.0\nresume_enabled = false\nresume_within_s = 60.0\nat_stop = "leave"\n'
    "stop_within_s = 60.0",
    "[validity]": "lowest_weight = 0.2",
    "[historian]": "largest_waiting_bytes = 1000000",
    "[machine]": 'state_file = "state.json"',
}
"""Keys that it leaves to their defaults, by the line of their table."""
RECORD = """[record]
name = "lathe"
every_s = 1.0
days_per_file = 2
largest_mb = 100.0
memory_mb = 32.0
keep_days = 30
parquet = true
repeat_unchanged_s = 5.0

[connection.control]
url = "opc.tcp://127.0.0.1:4840/lathe"
security = "none"

[channel.T_spindle_C]
node = "ns=2;s=T_spindle"
unit = "degC"
connection = "control"
every_s = 2.0
factor = 0.1
offset = 1.0
repeat_unchanged_s = 1.0
"""


# ---- the configurations -------------------------------------------------------------------------


def collect(folder: Path) -> None:
    """Gather all configurations, each in a folder with the files that lie beside it."""
    folder.mkdir(parents=True)
    plugin = f"import sys\nsys.addaudithook(__import__({__name__!r}).keeper({str(folder)!r}))\n"
    name = f"{Path(__file__).stem}"
    (folder / "keeper_plugin.py").write_text(plugin.replace(repr(__name__), repr(name)))
    path = os.pathsep.join((str(folder), str(Path(__file__).parent), str(ROOT / "src"), str(ROOT)))
    command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "keeper_plugin"]
    command += ["-p", "no:cacheprovider", *(test for test in TESTS if (ROOT / test).exists())]
    subprocess.run(command, cwd=ROOT, env=os.environ | {"PYTHONPATH": path}, check=False)
    for page in sorted((ROOT / "docs").rglob("*.md")):
        for text in re.findall(r"```toml\n(.*?)```", page.read_text("utf-8"), re.DOTALL):
            keep(folder, text, ROOT / "examples" / "machine" / "doc.toml")
    sys.path[:0] = [str(ROOT), str(ROOT / "src")]
    mutate(folder)


def keeper(folder: str):
    """Return a hook that keeps every configuration that is opened for reading."""
    busy: list[int] = []

    def hook(event: str, arguments: tuple[object, ...]) -> None:
        if event != "open" or busy or not str(arguments[0]).endswith(".toml"):
            return
        mode, flags = arguments[1], int(str(arguments[2] or 0))
        if "w" in str(mode or "") or flags & (os.O_WRONLY | os.O_RDWR):
            return
        busy.append(1)
        try:
            path = Path(str(arguments[0])).absolute()
            if path.is_file() and path.name not in {"pyproject.toml", "users.toml"}:
                keep(Path(folder), path.read_bytes().decode("utf-8", "surrogateescape"), path)
        finally:
            busy.clear()

    return hook


def keep(folder: Path, text: str, beside: Path, name: str = "") -> None:
    """Write a text, and what lies beside it, to a folder that its content names."""
    if not OF_A_MACHINE.search(text) or len(text) > 1_000_000:
        return
    near: list[Path] = []
    if not beside.is_relative_to(ROOT / "docs") and beside.parent.is_dir():
        near = [p for p in sorted(beside.parent.rglob("*")) if p.is_file() and p != beside][:60]
    near = [p for p in near if p.stat().st_size < 200_000 and p.suffix not in {".db", ".lock"}]
    told = hashlib.sha256(text.encode("utf-8", "surrogateescape"))
    for path in near:
        told.update(f"{path.relative_to(beside.parent)} {path.stat().st_mode & 0o77}".encode())
        told.update(path.read_bytes() if path.suffix in {".json", ".der"} else b"")
    kind = "record" if "[channel" in text or "[record]" in text else "machine"
    target = folder / (name or f"tests-{told.hexdigest()[:16]}")
    if target.exists():
        return
    target.mkdir()
    for path in near:
        copy = target / path.relative_to(beside.parent)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, copy)
    (target / f"{kind}.toml").write_bytes(text.encode("utf-8", "surrogateescape"))


def mutate(folder: Path) -> None:
    """Keep mutants of whole configurations."""
    from tests.unit.runtime.machine_files import TEXT, machine_file

    full = folder.parent / f"{folder.name}-full"
    full.mkdir(exist_ok=True)
    for name in ("server", "own", "page"):
        (full / f"{name}.der").write_bytes(b"x")
        (full / f"{name}.pem").write_bytes(b"x")
        (full / f"{name}.pem").chmod(0o600)
    (full / "secret").write_text("0123456789abcdef\n")
    (full / "secret").chmod(0o600)
    (full / "users.toml").write_text("")
    (full / "users.toml").chmod(0o600)
    (full / "log.csv").write_text("time_s\n")
    whole = TEXT
    for table, keys in STATED.items():
        whole = whole.replace(table, f"{table}\n{keys}")
    joint = "joint = 2\nlargest_acceleration_um_per_s2 = 20.0\n"
    linuxcnc = re.sub(r'\nnode = "ns=2;s=Z_offset"\n.*\n', f"\n{joint}", TEXT).replace(
        '[sink]\nkind = "opcua"\nconnection = "control"\nheartbeat_node = "ns=2;s=Heartbeat"',
        '[sink]\nkind = "linuxcnc"\nwatchdog_s = 3.0\nthread = "servo-thread"\nhalcmd = "halcmd"',
    )
    replay = TEXT.replace(
        'kind = "opcua"\nconnection = "control"\n\n[sink]',
        'kind = "replay"\nlog = "log.csv"\nmapping = "secret"\nas_fast_as_possible = true\n'
        "may_move_a_machine = true\n\n[sink]",
    )
    secure = TEXT.replace(
        'security = "none"',
        'security = "Basic256Sha256"\ncertificate = "own.der"\nprivate_key = "own.pem"\n'
        'server_certificate = "server.der"\nuser = "thermaxis"\npassword_file = "secret"',
    )
    beside = machine_file(full)
    beside.unlink()
    lathe = ROOT / "examples" / "machine" / "lathe.toml"
    for name, text, near in (
        ("lathe", lathe.read_text("utf-8"), lathe),
        ("whole", whole + FULL, beside),
        ("linuxcnc", linuxcnc, beside),
        ("replay", replay, beside),
        ("secure", secure, beside),
        ("record", RECORD, beside),
    ):
        for k, (what, mutant) in enumerate(mutants(text)):
            plain = re.sub(r"[^\w.-]+", "_", what)[:80]
            keep(folder, mutant, near, f"{name}-{k:04}-{plain}")
    shutil.rmtree(full)


def mutants(text: str) -> Iterator[tuple[str, str]]:
    yield "as it is", text
    lines, table = text.splitlines(), ""
    for k, line in enumerate(lines):

        def by(*other: str, k: int = k) -> str:
            return "\n".join((*lines[:k], *other, *lines[k + 1 :], ""))

        if line.startswith("["):
            table = line.strip("[] ")
            yield f"{table} misspelt", by(f"[{table[:-2]}{table[-1]}]")
            yield f"{table} doubled", by(line, line)
            yield f"{table} more", by(line, "colour = 1")
            ends = [n for n in range(k + 1, len(lines)) if lines[n].startswith("[")]
            rest = lines[ends[0] :] if ends else []
            yield f"{table} removed", "\n".join((*lines[:k], *rest, ""))
            continue
        found = KEY.match(line)
        if found is None:
            continue
        key, value = found["key"], found["value"]
        place = f"{table}.{key}"
        yield f"{place} removed", by()
        yield f"{place} misspelt", by(f"{key[:-2]}{key[-1]} = {value}")
        yield f"{place} doubled", by(line, line)
        for unit in UNITS:
            if key.endswith(unit):
                yield f"{place} unit", by(f"{key.removesuffix(unit)}_h = {value}")
        for other in (
            *('""', '"x"', '"60 s"', '"\\u001b"', "true", "false", "[]", "{}", "1", "0", "-1"),
            *("2.5", "-0.0", "1e-9", "1e4", "1e7", "1e12", "nan", "inf", f'"{"x" * 1100}"'),
        ):
            if other != value:
                yield f"{place} {other}", by(f"{key} = {other}")


# ---- what they come to --------------------------------------------------------------------------


def record(folder: Path, output: Path, tree: Path) -> None:
    sys.path[:0] = [str(tree / "src")]
    from thermaxis import runtime
    from thermaxis.errors import ThermaxisError

    recorded: dict[str, object] = {}
    for path in sorted(folder.glob("*/*.toml")):
        if path.name not in {"machine.toml", "record.toml"}:
            continue
        look = of_machine if path.name == "machine.toml" else of_record
        try:
            told = look(runtime, path)
        except ThermaxisError as error:
            told = {"refused": [refusal(error.message)]}
        recorded[path.parent.name] = told
    text = json.dumps(recorded, sort_keys=True, indent=0).replace(str(folder), "FOLDER")
    output.write_text(text, "utf-8")
    refused = sum("refused" in told for told in recorded.values())
    print(f"{len(recorded)} configurations, {refused} refused")


def refusal(message) -> object:
    from thermaxis.codes import message_as_json

    return message_as_json(message)


def of_machine(runtime, path: Path) -> dict[str, object]:
    from thermaxis.cli.machine import _machine_parts as parts
    from thermaxis.cli.machine._machine_words import describe_machine
    from thermaxis.report.tables import as_json
    from thermaxis.runtime.config import configuration_sha256

    found = runtime.examine_machine(path)
    if isinstance(found, tuple):
        return {"refused": [refusal(one) for one in found]}
    clock = runtime.SystemClock()
    source, told = found.source.kind, {}
    if source == "opcua":
        told["read"] = plain(parts.nodes_read(found))
    told["probes"] = plain(parts.probes_read(found))
    sink = parts.build_sink(found, parts.build_sessions(found, clock), clock)
    told["sink"] = plain(getattr(sink, "_outputs", None)) or plain(getattr(sink, "outputs", None))
    told["loop"] = plain(parts.loop_settings(found))
    told["check"] = json.loads(json.dumps(as_json(describe_machine(found)), default=str))
    told["warnings"] = [refusal(one.message) for one in runtime.warnings_of(found, NOW)]
    return {
        "values": plain(found),
        "told": told,
        "hash": configuration_sha256(found),
        "models": found.models_to_choose(),
    }


def of_record(_runtime, path: Path) -> dict[str, object]:
    from thermaxis.runtime.record import read_record

    return {"values": plain(read_record(path))}


def plain(value: object) -> object:  # noqa: PLR0911 - one for each kind
    """Return any frozen value as JSON has it."""
    if hasattr(value, "reveal"):
        return {"secret": hashlib.sha256(value.reveal().encode()).hexdigest()}
    if isinstance(value, Enum):
        return plain(value.value)
    if isinstance(value, PurePath):
        return str(value)
    if is_dataclass(value) and not isinstance(value, type):
        return {one.name: plain(getattr(value, one.name)) for one in fields(value)}
    if hasattr(type(value), "model_fields"):
        names = [*type(value).model_fields, *type(value).model_computed_fields]
        return {name: plain(getattr(value, name)) for name in names}
    if isinstance(value, Mapping):
        return {str(name): plain(one) for name, one in value.items()}
    if isinstance(value, frozenset | set):
        return sorted(map(str, value))
    if isinstance(value, tuple | list):
        return [plain(one) for one in value]
    if isinstance(value, float):
        return repr(value)
    return value if isinstance(value, str | int | bool | None) else type(value).__name__


# ---- two recordings -----------------------------------------------------------------------------


def leaves(value: object, place: str = "") -> Iterator[tuple[str, object]]:
    if isinstance(value, dict) and value:
        for name, one in value.items():
            yield from leaves(one, f"{place}.{name}")
    elif isinstance(value, list) and value:
        for k, one in enumerate(value):
            yield from leaves(one, f"{place}[{k}]")
    else:
        yield place, value


def compare(before: Path, after: Path) -> int:
    """Say where two recordings differ, alike differences together."""
    old, new = (json.loads(path.read_text("utf-8")) for path in (before, after))
    met: dict[str, list[str]] = defaultdict(list)
    causes: Counter[str] = Counter()
    for name in sorted(old.keys() | new.keys()):
        said = [dict(leaves(one.get(name, "no such"))) for one in (old, new)]
        moved = MOVED if "told" in old.get(name, {}) else {}
        said[0] = {moved.get(place, place): value for place, value in said[0].items()}
        for place in sorted(said[0].keys() | said[1].keys()):
            was, now = (one.get(place, "-") for one in said)
            if was == now:
                continue
            cause = cause_of(name, place)
            if place.startswith(".values.") and was == "-":
                cause = WHOLE
            if cause is not None:
                causes[cause] += 1
                continue
            met[f"{re.sub(r'[0-9]+', '#', place)}: {was!r:.90} > {now!r:.90}"].append(name)
    for said_of, names in sorted(met.items(), key=lambda item: -len(item[1])):
        print(f"{len(names):5}  {said_of}   e.g. {names[0]}")
    for cause, count in causes.items():
        print(f"{count:5}  as meant: {cause}")
    equal = sum(old.get(name) == new.get(name) for name in old)
    print(f"{equal} of {len(old)} equal, {sum(map(len, met.values()))} places unexplained")
    return 1 if met else 0


def cause_of(name: str, place: str) -> str | None:
    fits: Iterable[str] = (
        cause
        for (config, where), cause in EXPECTED.items()
        if fnmatch.fnmatch(name, config) and fnmatch.fnmatch(place, where)
    )
    return next(iter(fits), None)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    what = parser.add_subparsers(required=True)
    one = what.add_parser("collect")
    one.add_argument("folder", type=Path)
    one.set_defaults(run=lambda a: collect(a.folder))
    one = what.add_parser("record")
    one.add_argument("folder", type=Path)
    one.add_argument("output", type=Path)
    one.add_argument("--tree", type=Path, default=ROOT)
    one.set_defaults(run=lambda a: record(a.folder, a.output, a.tree))
    one = what.add_parser("compare")
    one.add_argument("before", type=Path)
    one.add_argument("after", type=Path)
    one.set_defaults(run=lambda a: compare(a.before, a.after))
    arguments = parser.parse_args()
    return arguments.run(arguments) or 0


if __name__ == "__main__":
    sys.exit(main())
