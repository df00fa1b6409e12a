"""Limits of corrections as TOML: both stated, nothing unknown, every mistake named."""

from pathlib import Path

import pytest

from thermaxis.compensation import Limits
from thermaxis.errors import ConfigurationError
from thermaxis.files import read_correction_limits

GOOD = "[Z_um]\nlargest_um = 100\nlargest_rate_um_per_s = 0.05\n"


def test_limits_are_read_by_output(tmp_path: Path) -> None:
    path = tmp_path / "limits.toml"
    path.write_text(GOOD + GOOD.replace("Z_um", '"X um"'), encoding="utf-8")
    assert read_correction_limits(path) == {n: Limits(100.0, 0.05) for n in ("Z_um", "X um")}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "states no limits"),
        ("Z_um = 5", "not a table"),
        (GOOD.replace("largest_um = 100\n", ""), "largest_um is missing"),
        (GOOD + "largest = 5\n", "unknown key largest"),
        (GOOD.replace("100", "0"), "no positive number"),
        (GOOD.replace("100", "nan"), "no positive number"),
        (GOOD.replace("100", '"a"'), "not a number"),
        (GOOD.replace("100", "true"), "not a number"),
        ("[Z_um", "not TOML"),
        ("\xff" * 3, "not UTF-8"),
    ],
)
def test_a_mistake_is_named(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "limits.toml"
    path.write_text(text, encoding="latin-1")
    with pytest.raises(ConfigurationError, match=said) as caught:
        read_correction_limits(path)
    assert str(path) in str(caught.value)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="cannot be read"):
        read_correction_limits(tmp_path / "none.toml")
