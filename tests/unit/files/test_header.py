import os
import re
import tomllib
from functools import partial
from pathlib import Path

import pytest

from tests.refusals import refusal_of
from thermaxis.cli._json import write_json
from thermaxis.errors import ConfigurationError
from thermaxis.files import read_header
from thermaxis.files.settings import HEADER_FIELDS, HEADER_GROUPS
from thermaxis.quantities import AxisKind
from thermaxis.report import write_bytes


def header_of(folder: Path, text: str) -> dict[str, str]:
    path = folder / "header.toml"
    path.write_text(text, encoding="utf-8")
    return dict(read_header(path))


def test_a_byte_order_mark_is_accepted(tmp_path: Path) -> None:
    path = tmp_path / "header.toml"
    path.write_bytes("\ufeff[axis]\nname = 'X'\n".encode())
    assert read_header(path) == {"axis": "X"}


def refusal(folder: Path, text: str, kind: AxisKind | None = None) -> str:
    path = folder / "header.toml"
    path.write_text(text, encoding="utf-8")
    return refusal_of(partial(read_header, kind=kind), path)


def test_a_wrong_header_is_an_error_that_names_file_and_key(tmp_path: Path) -> None:
    for text, said in [
        ("[machine]\nnmae = 'x'\n", "machine.nmae: unknown_key_near"),
        ("[machin]\nname = 'x'\n", "machin: unknown_key_near"),
        ("machine = 'x'\n", "machine: not_a_table"),
        ("[procedure]\ndwell_s = true\n", "procedure.dwell_s: impossible_value"),
        ("[procedure]\ndwell_s = nan\n", "procedure.dwell_s: impossible_value"),
        ("[machine]\nname = ['a']\n", "machine.name: impossible_value"),
        ("[machine]\nname = '" + "x" * 301 + "'\n", "machine.name: text_too_long"),
        ('[people]\ncomments = "' + "y" * 2001 + '"\n', "people.comments: text_too_long"),
        ("[machine\n", "not_toml"),
        ("[procedure]\ndwell_s = -2\n", "procedure.dwell_s: negative"),
        ("[procedure]\noverrun_mm = '-0.5'\n", "procedure.overrun_mm: negative"),
        ("[environment]\nair_pressure_kpa = -inf\n", "air_pressure_kpa: impossible_value"),
        ("[time]\nstart = 'garbage'\n", "time.start: not_a_moment"),
        ("[time]\nstart = '2026-02-30'\n", "time.start: not_a_moment"),
        ("[time]\nend = 07:30:00\n", "time.end: not_a_moment"),
        ("[time]\nend = 5\n", "time.end: not_a_moment"),
        ("[time]\ndate = 'garbage'\n", "time.date: not_a_date"),
        ("[instrument]\ncalibration_date = 'May'\n", "calibration_date: not_a_date"),
        ("[laboratory]\ncountry = 'Slovakia'\n", "laboratory.country: not_a_country"),
        ("[certificate]\ndate_of_issue = 'May'\n", "date_of_issue: not_a_date"),
        ("a = " + "9" * 5000, "not_toml"),
        ("a = " + "[" * 20000, "not_toml"),
    ]:
        assert refusal(tmp_path, text).endswith(said)


def test_an_end_before_the_start_is_an_error(tmp_path: Path) -> None:
    for start, end in [
        ("2026-03-02T14:00:00", "2026-03-02T13:59:59"),
        ("2026-03-02T14:00:00Z", "2026-03-02T14:30:00+01:00"),
        ("2026-03-02T14:00:00Z", "2026-03-02T13:30:00"),
        ("2026-03-02", "2026-03-01"),
        ("2026-03-02", "2026-03-01 23:00:00"),
    ]:
        text = f'[time]\nstart = "{start}"\nend = "{end}"\n'
        assert refusal(tmp_path, text) == "time.end: end_before_start"
        assert header_of(tmp_path, f'[time]\nstart = "{end}"\nend = "{start}"\n')["end"] == start


def test_a_field_of_the_other_kind_of_axis_is_an_error(tmp_path: Path) -> None:
    rotary, linear = AxisKind.ROTARY, AxisKind.LINEAR
    for kind, key in (
        *((rotary, "feed_mm_per_min"), (linear, "feed_deg_per_min")),
        *((rotary, "overrun_mm"), (linear, "overrun_deg")),
    ):
        text = f"[procedure]\n{key} = 5\n"
        assert refusal(tmp_path, text, kind) == f"procedure.{key}: other_kind_of_axis"
        other = linear if kind is rotary else rotary
        path = tmp_path / "header.toml"
        assert read_header(path, kind=other) == read_header(path) == {key: "5"}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_is_refused_as_an_output(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for write in (partial(write_bytes, content=b""), partial(write_json, {})):
        with pytest.raises(ConfigurationError) as caught:
            write(pipe)
        assert caught.value.code == "output_is_pipe"


def test_results_as_json_into_a_folder_are_an_error(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError) as caught:
        write_json({}, str(tmp_path))
    assert caught.value.code == "file_unwritable"


def test_a_comment_may_be_longer_than_other_texts(tmp_path: Path) -> None:
    assert header_of(tmp_path, f'[people]\ncomments = "{"y" * 2000}"\n') == {"comments": "y" * 2000}


def test_keys_of_fields_are_unique() -> None:
    fields = [field for group in HEADER_GROUPS for field in group.fields]
    assert len(HEADER_FIELDS) == len(fields)
    for group in HEADER_GROUPS:
        assert len({field.name for field in group.fields}) == len(group.fields)


def test_the_complete_example_of_the_how_to_states_every_field(root: Path, tmp_path: Path) -> None:
    page = (root / "docs" / "settings.md").read_text(encoding="utf-8")
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
