import os
import re
import tomllib
from pathlib import Path

import pytest

from thermaxis.cli._json import write_json
from thermaxis.errors import ConfigurationError
from thermaxis.files import read_figure_limits, read_header
from thermaxis.files.settings import HEADER_FIELDS, HEADER_GROUPS
from thermaxis.quantities import AxisKind
from thermaxis.report import write_bytes


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


def test_a_wrong_header_is_an_error_that_names_file_and_key(tmp_path: Path) -> None:
    for text, words in [
        ("[machine]\nnmae = 'x'\n", ["machine.nmae", "nearest known key is machine.name."]),
        ("[machin]\nname = 'x'\n", ["unknown key machin.", "nearest known key is machine"]),
        ("zzzzqqq = 1\n", ["zzzzqqq", "Known keys are"]),
        ("machine = 'x'\n", ["machine is not a table", "[machine]"]),
        ("[procedure]\ndwell_s = true\n", ["procedure.dwell_s is not a number", "Dwell in s"]),
        ("[procedure]\ndwell_s = nan\n", ["procedure.dwell_s is not a number"]),
        ("[machine]\nname = ['a']\n", ["machine.name is not a text"]),
        ("[machine]\nname = '" + "x" * 301 + "'\n", ["has 301 characters", "Shorten it to 300"]),
        ("[machine\n", ["not TOML", "line 1", "[machine] on a line"]),
        ("[procedure]\ndwell_s = -2\n", ["procedure.dwell_s is negative", "Dwell in s"]),
        ("[procedure]\noverrun_mm = '-0.5'\n", ["procedure.overrun_mm is negative"]),
        ("[environment]\nair_pressure_kpa = -inf\n", ["is not a number"]),
        ("[time]\nstart = 'garbage'\n", ["time.start is not a date", "2026-03-31T07:30:00"]),
        ("[time]\nstart = '2026-02-30'\n", ["time.start is not a date"]),
        ("[time]\nend = 07:30:00\n", ["time.end is not a date"]),
        ("[time]\nend = 5\n", ["time.end is not a date"]),
        ("[time]\ndate = 'garbage'\n", ["time.date is not a date", "date = 2026-03-31"]),
        ("[instrument]\ncalibration_date = 'May'\n", ["calibration_date is not a date"]),
        ("a = " + "9" * 5000, ["not TOML"]),
        ("a = " + "[" * 20000, ["not TOML"]),
    ]:
        with pytest.raises(ConfigurationError) as caught:
            header_of(tmp_path, text)
        assert "header.toml" in str(caught.value)
        for word in words:
            assert word in str(caught.value)


def test_an_end_before_the_start_is_an_error(tmp_path: Path) -> None:
    for start, end in [
        ("2026-03-02T14:00:00", "2026-03-02T13:59:59"),
        ("2026-03-02T14:00:00Z", "2026-03-02T14:30:00+01:00"),
        ("2026-03-02T14:00:00Z", "2026-03-02T13:30:00"),
        ("2026-03-02", "2026-03-01"),
        ("2026-03-02", "2026-03-01 23:00:00"),
    ]:
        with pytest.raises(ConfigurationError, match=r"time\.end lies before time\.start"):
            header_of(tmp_path, f'[time]\nstart = "{start}"\nend = "{end}"\n')
        assert header_of(tmp_path, f'[time]\nstart = "{end}"\nend = "{start}"\n')["end"] == start


def test_what_may_lie_below_zero_is_taken(tmp_path: Path) -> None:
    text = "[environment]\nair_temperature_c = -4.5\n[procedure]\ndwell_s = '1 to 2'\n"
    assert header_of(tmp_path, text) == {"air_temperature_c": "-4.5", "dwell_s": "1 to 2"}


def test_a_field_of_the_other_kind_of_axis_is_an_error_that_names_the_right_one(
    tmp_path: Path,
) -> None:
    for kind, wrong, right in [
        (AxisKind.ROTARY, "feed_mm_per_min", "feed_deg_per_min in °/min"),
        (AxisKind.LINEAR, "feed_deg_per_min", "feed_mm_per_min in mm/min"),
        (AxisKind.ROTARY, "overrun_mm", "overrun_deg in °"),
        (AxisKind.LINEAR, "overrun_deg", "overrun_mm in mm"),
    ]:
        path = tmp_path / "header.toml"
        path.write_text(f"[procedure]\n{wrong} = 5\n", encoding="utf-8")
        with pytest.raises(ConfigurationError, match=f"procedure.{wrong} belongs to a") as caught:
            read_header(path, kind=kind)
        assert f"Write {right}" in str(caught.value)
        other = AxisKind.LINEAR if kind is AxisKind.ROTARY else AxisKind.ROTARY
        assert read_header(path, kind=other) == read_header(path) == {wrong: "5"}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_is_refused_before_it_is_opened(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(ConfigurationError, match="not a regular file"):
        read_header(pipe)
    with pytest.raises(ConfigurationError, match="not a regular file"):
        read_figure_limits(pipe, AxisKind.LINEAR)
    with pytest.raises(ConfigurationError, match="this output is a pipe"):
        write_bytes(pipe, b"")
    with pytest.raises(ConfigurationError, match="this output is a pipe"):
        write_json({}, str(pipe))


def test_results_as_json_into_a_folder_are_an_error_in_words(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="cannot be written"):
        write_json({}, str(tmp_path))


def test_a_comment_may_be_longer_than_other_texts(tmp_path: Path) -> None:
    assert header_of(tmp_path, f'[people]\ncomments = "{"y" * 2000}"\n') == {"comments": "y" * 2000}
    with pytest.raises(ConfigurationError, match="Shorten it to 2000"):
        header_of(tmp_path, f'[people]\ncomments = "{"y" * 2001}"\n')


def test_a_file_that_is_no_header_is_an_error(tmp_path: Path) -> None:
    for content, words in [
        (b"\xff\xfe\x00", "not UTF-8"),
        (b"#" * 1_000_001, "larger than 1 MB"),
        (None, "cannot be read"),
    ]:
        path = tmp_path / "header.toml"
        path.unlink(missing_ok=True)
        if content is not None:
            path.write_bytes(content)
        with pytest.raises(ConfigurationError, match=words):
            read_header(path)


def test_a_folder_in_place_of_a_header_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="not a regular file"):
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
