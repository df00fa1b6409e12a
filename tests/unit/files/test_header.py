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


@pytest.mark.parametrize(
    ("text", "code", "key"),
    [
        ("[procedure]\ndwell_s = true\n", "number_needed", "procedure.dwell_s"),
        ("[procedure]\ndwell_s = nan\n", "number_needed", "procedure.dwell_s"),
        ("[machine]\nname = ['a']\n", "header_value_needed", "machine.name"),
        ("[machine]\nname = '" + "x" * 301 + "'\n", "text_too_long", "machine.name"),
        ("[procedure]\ndwell_s = -2\n", "negative", "procedure.dwell_s"),
        ("[procedure]\noverrun_mm = '-0.5'\n", "negative", "procedure.overrun_mm"),
        (
            "[environment]\nair_pressure_kpa = -inf\n",
            "number_needed",
            "environment.air_pressure_kpa",
        ),
        ("[time]\nstart = 'garbage'\n", "not_a_moment", "time.start"),
        ("[time]\nstart = '2026-02-30'\n", "not_a_moment", "time.start"),
        ("[time]\nend = 07:30:00\n", "not_a_moment", "time.end"),
        ("[time]\nend = 5\n", "not_a_moment", "time.end"),
        ("[time]\ndate = 'garbage'\n", "not_a_date", "time.date"),
        ("[instrument]\ncalibration_date = 'May'\n", "not_a_date", "instrument.calibration_date"),
    ],
)
def test_a_wrong_value_is_an_error_that_names_file_and_key(
    tmp_path: Path, text: str, code: str, key: str
) -> None:
    with pytest.raises(ConfigurationError) as caught:
        header_of(tmp_path, text)
    assert (caught.value.code, caught.value.place.key) == (code, key)
    assert caught.value.place.file.endswith("header.toml")


@pytest.mark.parametrize(
    "text",
    [
        "[machine]\nnmae = 'x'\n",
        "[machin]\nname = 'x'\n",
        "zzzzqqq = 1\n",
        "machine = 'x'\n",
        "[machine\n",
        "a = " + "9" * 5000,
        "a = " + "[" * 20000,
    ],
)
def test_other_keys_and_texts_that_are_no_toml_are_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(ConfigurationError, match=r"header\.toml"):
        header_of(tmp_path, text)


def test_an_end_before_the_start_is_an_error(tmp_path: Path) -> None:
    for start, end in [
        ("2026-03-02T14:00:00", "2026-03-02T13:59:59"),
        ("2026-03-02T14:00:00Z", "2026-03-02T14:30:00+01:00"),
        ("2026-03-02T14:00:00Z", "2026-03-02T13:30:00"),
        ("2026-03-02", "2026-03-01"),
        ("2026-03-02", "2026-03-01 23:00:00"),
    ]:
        with pytest.raises(ConfigurationError) as caught:
            header_of(tmp_path, f'[time]\nstart = "{start}"\nend = "{end}"\n')
        assert (caught.value.code, caught.value.place.key) == ("end_before_start", "time.end")
        assert header_of(tmp_path, f'[time]\nstart = "{end}"\nend = "{start}"\n')["end"] == start


def test_what_may_lie_below_zero_is_taken(tmp_path: Path) -> None:
    text = "[environment]\nair_temperature_c = -4.5\n[procedure]\ndwell_s = '1 to 2'\n"
    assert header_of(tmp_path, text) == {"air_temperature_c": "-4.5", "dwell_s": "1 to 2"}


@pytest.mark.parametrize(
    ("kind", "wrong"),
    [
        (AxisKind.ROTARY, "feed_mm_per_min"),
        (AxisKind.LINEAR, "feed_deg_per_min"),
        (AxisKind.ROTARY, "overrun_mm"),
        (AxisKind.LINEAR, "overrun_deg"),
    ],
)
def test_a_field_of_the_other_kind_of_axis_is_an_error(
    tmp_path: Path, kind: AxisKind, wrong: str
) -> None:
    path = tmp_path / "header.toml"
    path.write_text(f"[procedure]\n{wrong} = 5\n", encoding="utf-8")
    with pytest.raises(ConfigurationError) as caught:
        read_header(path, kind=kind)
    assert (caught.value.code, caught.value.place.key) == (
        *("key_of_other_axis", f"procedure.{wrong}"),
    )
    other = AxisKind.LINEAR if kind is AxisKind.ROTARY else AxisKind.ROTARY
    assert read_header(path, kind=other) == read_header(path) == {wrong: "5"}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_is_refused_before_it_is_opened(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for opened in (
        lambda: read_header(pipe),
        lambda: read_figure_limits(pipe, AxisKind.LINEAR),
        lambda: write_bytes(pipe, b""),
        lambda: write_json({}, str(pipe)),
    ):
        with pytest.raises(ConfigurationError, match="pipe"):
            opened()


def test_results_as_json_into_a_folder_are_an_error(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError) as caught:
        write_json({}, str(tmp_path))
    assert (caught.value.code, caught.value.place.file) == ("file_unwritable", str(tmp_path))


def test_a_comment_may_be_longer_than_other_texts(tmp_path: Path) -> None:
    assert header_of(tmp_path, f'[people]\ncomments = "{"y" * 2000}"\n') == {"comments": "y" * 2000}
    with pytest.raises(ConfigurationError) as caught:
        header_of(tmp_path, f'[people]\ncomments = "{"y" * 2001}"\n')
    assert caught.value.values == {"characters": 2001, "most": 2000}


@pytest.mark.parametrize("content", [b"\xff\xfe\x00", b"#" * 1_000_001, None, "folder"])
def test_a_file_that_is_no_header_is_an_error(tmp_path: Path, content: bytes | str | None) -> None:
    path = tmp_path / "header.toml"
    if content == "folder":
        path.mkdir()
    elif isinstance(content, bytes):
        path.write_bytes(content)
    with pytest.raises(ConfigurationError, match=r"header\.toml"):
        read_header(path)


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
