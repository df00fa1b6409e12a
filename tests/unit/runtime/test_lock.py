"""The one lock on files, the lock on offsets, and what each of their users says."""

import fcntl
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.refusals import refused
from thermaxis.errors import ConfigurationError
from thermaxis.runtime import sole_runner
from thermaxis.runtime.history._integrity import writer_lock
from thermaxis.runtime.host import file_lock
from thermaxis.runtime.record import sole_writer

TAKEN = ConfigurationError("recording_in_use", name="lathe", pid="")


def test_a_lock_is_held_by_one_whose_process_the_others_are_told(tmp_path: Path) -> None:
    path = tmp_path / "a.lock"
    lock = file_lock(path, TAKEN, required=True)
    for required in (True, False):
        with refused("recording_in_use", name="lathe", pid=str(os.getpid())):
            file_lock(path, TAKEN, required=required)
    lock.release()
    file_lock(path, TAKEN, required=False).release()


def test_a_refused_lock_leaves_no_file_open(tmp_path: Path) -> None:
    lock = file_lock(tmp_path / "a.lock", TAKEN, required=True)
    before = len(os.listdir("/proc/self/fd"))  # noqa: PTH208 - numbers of open files
    for _ in range(5):
        with refused("recording_in_use"):
            file_lock(tmp_path / "a.lock", TAKEN, required=True)
    assert len(os.listdir("/proc/self/fd")) == before  # noqa: PTH208 - as above
    lock.release()


def test_a_disk_without_locks_stops_what_acts_on_a_machine_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(37, "No locks available")

    monkeypatch.setattr(fcntl, "flock", refuse)
    with (
        refused("disk_without_locks", cause="No locks available"),
        sole_runner(tmp_path / "lathe.state.json", "lathe"),
    ):
        pytest.fail("nothing may begin")
    with sole_writer(tmp_path, "lathe"):
        writer_lock(tmp_path / "h.db").release()


def test_a_full_disk_keeps_no_program_from_its_lock(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "write", refuse)
    with (
        sole_runner(tmp_path / "lathe.state.json", "lathe"),
        refused("machine_in_use", pid="unknown"),
        sole_runner(tmp_path / "lathe.state.json", "lathe"),
    ):
        pytest.fail("nothing may begin")


def test_an_error_inside_the_body_is_not_taken_for_a_second_program(tmp_path: Path) -> None:
    with pytest.raises(BlockingIOError, match="of the body"), sole_writer(tmp_path, "lathe"):
        raise BlockingIOError(11, "of the body")
    state = tmp_path / "lathe.state.json"
    with pytest.raises(OSError, match="of the body"), sole_runner(state, "lathe", ["a node"]):
        raise OSError(98, "of the body")
    with sole_writer(tmp_path, "lathe"), sole_runner(state, "lathe", ["a node"]):
        pass


def test_one_offset_is_written_by_one_program_wherever_its_configuration_lies(
    tmp_path: Path,
) -> None:
    offset, other = f"127.0.0.1:1 ns=2;s={tmp_path}", f"127.0.0.1:2 ns=2;s={tmp_path}"
    states = [tmp_path / name / "lathe.state.json" for name in "abc"]
    with (
        sole_runner(states[0], "lathe", [offset]),
        sole_runner(states[1], "lathe", [other]),
        refused("offset_in_use", offset=offset, pid=str(os.getpid())),
        sole_runner(states[2], "lathe", [offset]),
    ):
        pytest.fail("nothing may begin")
    with sole_runner(states[2], "lathe", [offset]):
        pass


def test_a_killed_program_holds_no_offset(tmp_path: Path) -> None:
    offset = f"127.0.0.1:1 ns=3;s={tmp_path}"
    holds = (
        "import sys, time, pathlib; from thermaxis.runtime import sole_runner\n"
        "with sole_runner(pathlib.Path(sys.argv[1]), 'lathe', [sys.argv[2]]):\n"
        "    print('held', flush=True); time.sleep(60)"
    )
    words = [sys.executable, "-c", holds, str(tmp_path / "a.json"), offset]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        assert program.stdout.readline() == "held\n"
        with (
            refused("offset_in_use", pid=str(program.pid)),
            sole_runner(tmp_path / "b.json", "lathe", [offset]),
        ):
            pytest.fail("nothing may begin")
        program.kill()
    with sole_runner(tmp_path / "b.json", "lathe", [offset]):
        pass
