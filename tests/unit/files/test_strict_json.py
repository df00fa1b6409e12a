"""JSON files are written whole or not at all."""

from pathlib import Path

import pytest

from thermaxis.errors import ConfigurationError
from thermaxis.files.settings._settings_file import write_json_text


def test_a_file_that_is_replaced_keeps_its_permissions_and_leaves_nothing_beside(
    tmp_path: Path,
) -> None:
    path = tmp_path / "model.json"
    path.write_text("{}")
    path.chmod(0o640)
    write_json_text('{"a": 1}\n', path)
    assert path.read_bytes() == b'{"a": 1}\n'
    assert path.stat().st_mode & 0o777 == 0o640
    assert list(tmp_path.iterdir()) == [path]


def test_a_new_file_may_be_read_by_whom_any_new_file_may(tmp_path: Path) -> None:
    write_json_text("{}\n", tmp_path / "model.json")
    (tmp_path / "other").touch()
    modes = {(tmp_path / name).stat().st_mode for name in ("model.json", "other")}
    assert len(modes) == 1


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    path, link = tmp_path / "model.json", tmp_path / "link.json"
    path.write_text("{}")
    link.symlink_to(path)
    write_json_text("[]\n", link)
    assert link.is_symlink()
    assert path.read_text() == "[]\n"


def test_where_writing_fails_the_file_is_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "model.json"
    path.write_text("{}")

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(ConfigurationError, match="No space left"):
        write_json_text('{"a": 1}\n', path)
    assert path.read_text() == "{}"
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_is_not_written_to(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="cannot be written"):
        write_json_text("{}", tmp_path)
    assert not list(tmp_path.iterdir())


def test_what_is_no_file_is_written_to_in_place() -> None:
    write_json_text("{}\n", "/dev/null")
    assert not Path("/dev/null").is_file()


def test_a_link_to_itself_cannot_be_written(tmp_path: Path) -> None:
    loop = tmp_path / "loop.json"
    loop.symlink_to(loop)
    with pytest.raises(ConfigurationError, match="cannot be written"):
        write_json_text("{}", loop)
