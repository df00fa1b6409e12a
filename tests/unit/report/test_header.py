import re
import tomllib
from pathlib import Path

import pytest

from thermaxis.errors import ConfigurationError
from thermaxis.report import read_header
from thermaxis.report._header import HEADER_FIELDS, HEADER_GROUPS


def header_of(folder: Path, text: str) -> dict[str, str]:
    path = folder / "header.toml"
    path.write_text(text, encoding="utf-8")
    return dict(read_header(path))


def test_every_kind_of_value_becomes_text(tmp_path: Path) -> None:
    text = """
    [machine]
    name = "Frézka"
    asset_number = 17
    [state]
    thermal_compensation = false
    [instrument]
    calibration_date = 2025-11-04
    [procedure]
    feed_mm_per_min = 300
    dwell_s = 2.5
    [time]
    start = 2026-03-02T07:30:00+01:00
    """
    assert header_of(tmp_path, text) == {
        "machine": "Frézka",
        "asset_number": "17",
        "thermal_compensation": "no",
        "instrument_calibration_date": "2025-11-04",
        "feed_mm_per_min": "300",
        "dwell_s": "2.5",
        "start": "2026-03-02 07:30:00+01:00",
    }


def test_an_empty_text_counts_as_not_stated(tmp_path: Path) -> None:
    assert header_of(tmp_path, '[machine]\nname = "  "\n') == {}


def test_a_byte_order_mark_is_accepted(tmp_path: Path) -> None:
    path = tmp_path / "header.toml"
    path.write_bytes("\ufeff[axis]\nname = 'X'\n".encode())
    assert read_header(path) == {"axis": "X"}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[machine]\nnmae = 'x'\n", ["machine.nmae", "Did you mean machine.name?"]),
        ("[machin]\nname = 'x'\n", ["unknown key machin.", "Did you mean machine"]),
        ("zzzzqqq = 1\n", ["zzzzqqq", "Known keys are"]),
        ("machine = 'x'\n", ["machine is not a table", "[machine]"]),
        ("[procedure]\ndwell_s = true\n", ["procedure.dwell_s is not a number", "Dwell in s"]),
        ("[procedure]\ndwell_s = nan\n", ["procedure.dwell_s is not a number"]),
        ("[machine]\nname = ['a']\n", ["machine.name is not a text"]),
        ("[machine]\nname = '" + "x" * 301 + "'\n", ["has 301 characters", "Shorten it to 300"]),
        ("[machine\n", ["not TOML", "line 1"]),
        ("a = " + "9" * 5000, ["not TOML"]),
        ("a = " + "[" * 20000, ["not TOML"]),
    ],
)
def test_a_wrong_header_is_an_error_that_names_file_and_key(
    tmp_path: Path, text: str, words: list[str]
) -> None:
    with pytest.raises(ConfigurationError) as caught:
        header_of(tmp_path, text)
    assert "header.toml" in str(caught.value)
    for word in words:
        assert word in str(caught.value)


def test_a_comment_may_be_longer_than_other_texts(tmp_path: Path) -> None:
    assert header_of(tmp_path, f'[people]\ncomments = "{"y" * 2000}"\n') == {"comments": "y" * 2000}
    with pytest.raises(ConfigurationError, match="Shorten it to 2000"):
        header_of(tmp_path, f'[people]\ncomments = "{"y" * 2001}"\n')


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"\xff\xfe\x00", "not UTF-8"),
        (b"#" * 1_000_001, "larger than 1 MB"),
        (None, "cannot be read"),
    ],
)
def test_a_file_that_is_no_header_is_an_error(
    tmp_path: Path, content: bytes | None, words: str
) -> None:
    path = tmp_path / "header.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ConfigurationError, match=words):
        read_header(path)


def test_a_folder_in_place_of_a_header_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="cannot be read"):
        read_header(tmp_path)


def test_keys_of_fields_are_unique() -> None:
    fields = [field for group in HEADER_GROUPS for field in group.fields]
    assert len(HEADER_FIELDS) == len(fields)
    for group in HEADER_GROUPS:
        assert len({field.name for field in group.fields}) == len(group.fields)


def test_the_complete_example_of_the_how_to_states_every_field(root: Path, tmp_path: Path) -> None:
    page = (root / "docs" / "how-to" / "certificate-header.md").read_text(encoding="utf-8")
    example = max(re.findall(r"```toml\n(.*?)```", page, re.DOTALL), key=len)
    stated = set(header_of(tmp_path, example))
    rotary = {"feed_deg_per_min", "overrun_deg"}
    assert stated == set(HEADER_FIELDS) - rotary
    assert all(key in page for key in rotary)


def test_the_shipped_header_reads(root: Path) -> None:
    path = root / "examples" / "header.toml"
    stated = read_header(path)
    tables = tomllib.loads(path.read_text(encoding="utf-8"))
    assert len(stated) == sum(len(table) for table in tables.values())
    assert stated["feed_mm_per_min"] == "300"
