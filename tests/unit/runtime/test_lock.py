"""The one lock on files, and what each of its users says."""

import fcntl
import os
import sys
from pathlib import Path

import pytest

from tests.refusals import refused
from thermaxis.errors import ConfigurationError
from thermaxis.runtime import sole_runner
from thermaxis.runtime.historian._integrity import writer_lock
from thermaxis.runtime.host import FileLock
from thermaxis.runtime.record import sole_writer

TAKEN = ConfigurationError("lock_taken")


def test_a_lock_is_held_by_one_and_free_for_the_next_one_after_it(tmp_path: Path) -> None:
    path = tmp_path / "a.lock"
    with FileLock(path, TAKEN, required=True):
        for required in (True, False):
            with pytest.raises(ConfigurationError) as caught:
                FileLock(path, TAKEN, required=required)
            assert caught.value is TAKEN
    with FileLock(path, TAKEN, required=False):
        assert path.read_bytes() == b""


def test_a_refused_lock_leaves_no_file_open(tmp_path: Path) -> None:
    with FileLock(tmp_path / "a.lock", TAKEN, required=True):
        before = len(os.listdir("/proc/self/fd"))  # noqa: PTH208 - numbers of open files
        for _ in range(5):
            with pytest.raises(ConfigurationError):
                FileLock(tmp_path / "a.lock", TAKEN, required=True)
        assert len(os.listdir("/proc/self/fd")) == before  # noqa: PTH208


def test_what_acts_on_a_machine_does_not_begin_on_a_system_without_locks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "fcntl", None)
    with (
        refused("no_file_locks"),
        sole_runner(tmp_path / "lathe.state.json", "lathe"),
    ):
        pytest.fail("nothing may begin")


def test_what_only_records_goes_on_on_a_system_without_locks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "fcntl", None)
    with sole_writer(tmp_path, "lathe"):
        writer_lock(tmp_path / "h.db").release()


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


def test_an_error_inside_the_body_is_not_taken_for_a_second_program(tmp_path: Path) -> None:
    with pytest.raises(BlockingIOError, match="of the body"), sole_writer(tmp_path, "lathe"):
        raise BlockingIOError(11, "of the body")
    with (
        pytest.raises(BlockingIOError, match="of the body"),
        sole_runner(tmp_path / "lathe.state.json", "lathe"),
    ):
        raise BlockingIOError(11, "of the body")
    with sole_writer(tmp_path, "lathe"), sole_runner(tmp_path / "lathe.state.json", "lathe"):
        pass
