"""Files with secrets, and files that are whole or not there."""

import os
import stat
from pathlib import Path

import pytest

from tests.refusals import refused
from thermaxis.runtime.host import read_private, read_secret, refuse_readable, whole_file

LARGEST_BYTES = 4096


def private(path: Path, content: bytes, mode: int = 0o600) -> Path:
    path.write_bytes(content)
    path.chmod(mode)
    return path


def test_every_right_of_others_makes_a_file_no_secret(tmp_path: Path) -> None:
    path = private(tmp_path / "secret", b"hunter2\n")
    for bit in (0o040, 0o020, 0o010, 0o004, 0o002, 0o001):
        path.chmod(0o600 | bit)
        for look in (
            lambda: refuse_readable(path, key="here"),
            lambda: read_private(path, limit_bytes=100, key="here"),
            lambda: read_secret(path, key="here"),
        ):
            with refused("file_open_to_others", file=path, key="here") as caught:
                look()
            assert "hunter2" not in str(caught.value)


def test_the_first_line_is_the_secret_and_is_never_shown(tmp_path: Path) -> None:
    path = private(tmp_path / "secret", "häslo 1 \r\nmore".encode())
    found = read_secret(path, key="here")
    assert found.reveal() == "häslo 1 "
    assert "1" not in f"{found} {found!r}"


def test_what_is_no_secret_is_refused(tmp_path: Path) -> None:
    for content in (b"", b"\nx", b"a\x00b", b"\xff\xfe"):
        with refused("no_secret_in_file"):
            read_secret(private(tmp_path / "secret", content), key="here")


def test_the_largest_file_is_taken_and_a_larger_one_is_not(tmp_path: Path) -> None:
    longest = private(tmp_path / "longest", b"x" * LARGEST_BYTES)
    assert len(read_secret(longest, key="here").reveal()) == LARGEST_BYTES
    assert len(read_private(longest, limit_bytes=LARGEST_BYTES, key="x")) == 4096
    with refused("file_too_long"):
        read_private(longest, limit_bytes=LARGEST_BYTES - 1, key="here")
    with refused("file_too_long"):
        read_secret(private(tmp_path / "longer", b"x" * (LARGEST_BYTES + 1)))


def test_a_pipe_and_a_folder_are_refused_without_waiting(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe, 0o600)
    for path in (pipe, tmp_path):
        with refused("not_a_file"):
            read_secret(path, key="here")
    with refused("file_unreadable"):
        read_secret(tmp_path / "none", key="here")


@pytest.mark.parametrize("umask", [0o000, 0o077])
def test_a_file_has_its_permissions_whatever_the_umask(tmp_path: Path, umask: int) -> None:
    before = os.umask(umask)
    try:
        for mode in (0o600, 0o644):
            path = tmp_path / f"{mode:o}"
            with whole_file(path, mode=mode) as stream:
                (beside,) = tmp_path.glob(f".{path.name}.*.new")
                assert stat.S_IMODE(beside.stat().st_mode) == mode & 0o600 & ~umask
                stream.write(b"x")
            assert stat.S_IMODE(path.stat().st_mode) == mode
        plain = tmp_path / "plain"
        with whole_file(plain) as stream:
            stream.write(b"x")
        assert stat.S_IMODE(plain.stat().st_mode) == 0o666 & ~umask
    finally:
        os.umask(before)


@pytest.mark.parametrize("failure", [OSError(28, "full"), KeyboardInterrupt()])
def test_an_error_leaves_the_old_file_and_nothing_beside_it(
    tmp_path: Path, failure: BaseException
) -> None:
    path = private(tmp_path / "file", b"old")

    def fail() -> None:
        with whole_file(path, mode=0o600) as stream:
            stream.write(b"half")
            raise failure

    with pytest.raises(type(failure)):
        fail()
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_is_on_the_disk_before_it_has_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = private(tmp_path / "file", b"old")
    seen: list[bytes] = []
    synced = os.fsync

    def look(descriptor: int) -> None:
        seen.append(path.read_bytes())
        synced(descriptor)

    monkeypatch.setattr(os, "fsync", look)
    with whole_file(path, mode=0o600) as stream:
        stream.write(b"new")
    assert seen == [b"old"]
    assert path.read_bytes() == b"new"
