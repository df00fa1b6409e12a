"""Why a database or a file fails, in words that people may read."""

import errno
import os
from pathlib import Path

import pytest

from thermaxis.codes import Place
from thermaxis.errors import ThermaxisError
from thermaxis.runtime.history import printable_cause


def test_no_kind_of_an_error_reaches_people_with_what_the_history_says() -> None:
    assert printable_cause(OSError("disk I/O error\nat row 3")) == "disk I/O error"
    assert len(printable_cause(ValueError("x" * 5000))) == 300


def test_an_error_without_a_text_is_told_by_its_kind() -> None:
    assert printable_cause(ValueError(" \n")) == "ValueError"


def test_the_place_of_a_file_is_not_told_to_whoever_looks(tmp_path: Path) -> None:
    place = tmp_path / "secret-folder" / "history.sqlite"
    with pytest.raises(OSError, match="secret-folder") as raised:
        place.open()
    assert printable_cause(raised.value) == os.strerror(errno.ENOENT)
    denied = PermissionError(errno.EACCES, "Permission denied", str(place), None, "/elsewhere")
    assert printable_cause(denied) == "Permission denied"
    assert printable_cause(ThermaxisError("torn", place=Place(str(place)))) == "error-torn"
