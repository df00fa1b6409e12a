"""The historian's files after a sudden end: clean, and whole but for the last second."""

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from tests.in_time import LONGEST_S
from tests.system.history_writer import recorded
from tests.unit.runtime.history_records import OUTPUTS, url_of
from thermaxis.errors import ThermaxisError
from thermaxis.runtime.history import Columns, HistoryReader, check_file

pytestmark = pytest.mark.system

KILLS = 10
SNAPSHOTS = 25
RATE_HZ = 100.0
UNFINISHED = shutil.ignore_patterns("*.part")
LOST_S = 1.0
"""What may be lost: what was recorded in the last second before the end."""


@contextmanager
def recording(root: Path, path: Path, *words: object) -> Iterator[subprocess.Popen[str]]:
    """Run the program; what it says goes into a file beside its database."""
    command = [sys.executable, "-m", "tests.system.history_writer", url_of(path), *map(str, words)]
    with said_by(path).open("w") as output:
        child = subprocess.Popen(command, cwd=root, stdout=output, stdin=subprocess.PIPE, text=True)
    try:
        while said_by(path).stat().st_size == 0:  # it needs a moment to start
            assert child.poll() is None
            time.sleep(0.02)
        yield child
    finally:
        child.kill()
        child.communicate()


def said_by(path: Path) -> Path:
    return path.parent.parent / f"{path.parent.name} {path.name}.said"


def taken_by(path: Path) -> dict[int, float]:
    """Return when each cycle was taken, by its number; a line that was cut short says nothing."""
    text = said_by(path).read_text()
    whole = text[: text.rfind("\n") + 1].splitlines()
    return {int(n): float(t) for n, t in (line.split() for line in whole if line[0].isdigit())}


def states_of(path: Path) -> list[str]:
    """Return what the program said of its historian."""
    return [line for line in said_by(path).read_text().splitlines() if line.startswith("status")]


def check_whole(path: Path, taken: dict[int, float], end_s: float) -> int:
    """Check what is in the files, and return how many cycles before the end are missing."""
    assert check_file(path) == ""
    with HistoryReader(url_of(path)) as reader:
        found = reader.cycles().drop("id").collect()
    numbers = found["number"].to_list()
    assert numbers == list(range(len(numbers)))
    columns = Columns()
    columns.outputs = OUTPUTS
    rows = [columns.row_of(recorded(number)).values() for number in numbers[-300:]]
    assert found.tail(300).to_dicts() == rows
    due = [number for number, time_s in taken.items() if time_s < end_s - LOST_S]
    assert len(numbers) > max(due, default=-1)
    return len(taken) - len(numbers)


def test_a_kill_at_any_moment_takes_no_more_than_the_last_second(
    root: Path, tmp_path: Path
) -> None:
    rng = random.Random(20261103)  # noqa: S311 - the same moments each time
    missing: list[int] = []
    for run in range(KILLS):
        path = tmp_path / f"{run}.db"
        with recording(root, path, RATE_HZ, 100_000) as child:
            time.sleep(1.0 + 2.5 * rng.random())
            end_s = time.monotonic()
            child.kill()
            child.wait()
        taken = taken_by(path)
        assert len(taken) > 80
        missing.append(check_whole(path, taken, end_s))
    assert max(missing) > 0  # else the ends came at no moment that matters


def holds_cycles(path: Path) -> bool:
    with suppress(ThermaxisError), HistoryReader(url_of(path)) as reader:
        return "number" in reader.cycles().collect_schema().names()
    return False  # there is no file yet, or no table in it


def test_a_copy_of_the_files_at_any_moment_opens_clean(root: Path, tmp_path: Path) -> None:
    """Both files as they are at one moment, as after a loss of power; then with a torn tail."""
    rng = random.Random(20261104)  # noqa: S311 - see above
    path = tmp_path / "h.db"
    copies: list[tuple[Path, float]] = []
    with recording(root, path, 500.0, 100_000) as child:
        while not holds_cycles(path):
            assert child.poll() is None
            time.sleep(0.5)
        for k in range(10 * SNAPSHOTS):
            if k >= SNAPSHOTS and len({copy.stat().st_size for copy, _ in copies}) > 2:
                break  # what the log had went into the database meanwhile, more than once
            time.sleep(0.6 * rng.random())
            os.kill(child.pid, signal.SIGSTOP)
            end_s = time.monotonic()
            copy = tmp_path / f"copy {k}" / "h.db"
            copy.parent.mkdir()
            for name in ("h.db", "h.db-wal"):
                shutil.copyfile(path.with_name(name), copy.with_name(name))
            if path.with_suffix("").exists():
                shutil.copytree(path.with_suffix(""), copy.with_suffix(""), ignore=UNFINISHED)
            copies.append((copy, end_s))
            os.kill(child.pid, signal.SIGCONT)
    taken = taken_by(path)
    assert max(taken.values()) > copies[-1][1] - 0.5  # it went on to the end
    assert len({copy.stat().st_size for copy, _ in copies}) > 2
    for copy, end_s in copies:
        torn = copy.with_name("torn.db")
        log = copy.with_name("torn.db-wal")
        shutil.copyfile(copy, torn)
        torn.with_suffix("").symlink_to(copy.with_suffix(""))
        whole = copy.with_name("h.db-wal").read_bytes()
        before = {number: time_s for number, time_s in taken.items() if time_s <= end_s}
        check_whole(copy, before, end_s)
        end = rng.randrange(len(whole) // 2, len(whole) + 1)
        log.write_bytes(whole[:end] + rng.randbytes(min(3000, len(whole) - end)))
        check_whole(torn, {}, end_s)


def full_disk_scene(
    child: subprocess.Popen[str], path: Path, make_room: Callable[[], None]
) -> list[str]:
    """Let the program run until the disk is full, make room; return what it said of its state."""
    while not states_of(path):
        assert child.poll() is None
        time.sleep(0.1)
    make_room()
    child.communicate("go on\n", timeout=LONGEST_S)
    return states_of(path)


def test_a_disk_without_room_loses_nothing_and_stops_nothing(root: Path, tmp_path: Path) -> None:
    path = tmp_path / "h.db"
    with recording(root, path, 400.0, 2000, 120_000) as child:
        out = full_disk_scene(child, path, lambda: None)
    assert "storing=False" in out[0]
    assert "storing=True, waiting=0, lost=0, failure=None" in out[1]
    check_whole(path, dict.fromkeys(range(4000), 0.0), LOST_S + 1.0)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can mount a small disk")
def test_a_full_disk_loses_nothing_and_stops_nothing(root: Path, tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()

    def mount(*words: str) -> None:
        subprocess.run(["mount", "-t", "tmpfs", "-o", *words, "tmpfs", str(disk)], check=True)

    mount("size=300k")
    try:
        with recording(root, disk / "h.db", 400.0, 2000, 10**9) as child:
            out = full_disk_scene(child, disk / "h.db", lambda: mount("remount,size=20m"))
        assert "storing=False" in out[0]
        assert "full" in out[0]
        assert "storing=True, waiting=0, lost=0, failure=None" in out[1]
        check_whole(disk / "h.db", dict.fromkeys(range(4000), 0.0), LOST_S + 1.0)
    finally:
        subprocess.run(["umount", str(disk)], check=True)
