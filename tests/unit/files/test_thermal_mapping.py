"""Mapping files: what the columns of a log are."""

from pathlib import Path

import numpy as np
import pytest

from thermaxis.errors import ConfigurationError, MeasurementFileError, ThermaxisError
from thermaxis.files import read_thermal_log, read_thermal_mapping

LOG = "when,Temp 1,Temp 2,junk,Pos\n01/02/2026 10:00:00,68,1,9,0.5\n01/02/2026 10:00:05,86,2,9,1\n"
MAPPING = """
[time]
column = "when"
format = "%m/%d/%Y %H:%M:%S"

[columns]
"Temp 2" = "T_hall_C"

[columns."Temp 1"]
name = "T_spindle_c"
unit = "degC"
factor = 0.5555555555555556
offset = -17.77777777777778

[columns.Pos]
unit = "um"
factor = 1000

[columns.junk]
leave_out = true
"""


def files(folder: Path, mapping: str, log: str = LOG) -> tuple[Path, Path]:
    (folder / "m.toml").write_text(mapping)
    (folder / "log.csv").write_text(log)
    return folder / "log.csv", folder / "m.toml"


def test_a_mapping_names_converts_and_leaves_out_columns(tmp_path: Path) -> None:
    path, mapping = files(tmp_path, MAPPING)
    log = read_thermal_log(path, mapping=mapping)
    assert dict(log.units) == {"T_spindle_c": "degC", "T_hall_C": "degC", "Pos": "um"}
    np.testing.assert_allclose(log.columns["T_spindle_c"], [20.0, 30.0])
    np.testing.assert_allclose(log.columns["Pos"], [500.0, 1000.0])
    assert log.duration_s == 5.0
    assert log.start is not None
    assert (log.start.month, log.start.day) == (1, 2)


def test_a_file_without_times_gets_its_sample_time(tmp_path: Path) -> None:
    path, mapping = files(tmp_path, "[time]\nsample_time_s = 0.5\n", "u,y\n1,2\n3,4\n5,6\n")
    log = read_thermal_log(path, mapping=mapping)
    np.testing.assert_array_equal(log.time_s, [0.0, 0.5, 1.0])
    np.testing.assert_array_equal(log.columns["u"], [1.0, 3.0, 5.0])


def test_times_get_the_stated_unit(tmp_path: Path) -> None:
    path, mapping = files(
        tmp_path, '[time]\ncolumn = "tick"\nunit = "ms"\n', "tick,y\n0,2\n250,4\n"
    )
    assert read_thermal_log(path, mapping=mapping).duration_s == 0.25


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[colums]\n", "unknown key colums"),
        ("[columns.a]\nnme = 'x'\n", "unknown key nme"),
        ("[time]\nzone = 'x'\n", "unknown key zone"),
        ("[columns.a]\nfactor = 'x'\n", "factor is not a number"),
        ("[columns.a]\nfactor = true\n", "factor is not a number"),
        ("[columns.a]\nfactor = 0\n", "factor is zero"),
        ("[columns.a]\noffset = nan\n", "not finite"),
        ("[columns.a]\noffset = 1e400\n", "not finite"),
        ("[columns.a]\nunit = 'parsec'\n", "unit 'parsec' is not known"),
        ("[columns.a]\nname = 3\n", "name is not a text"),
        ("[columns.a]\nleave_out = 1\n", "neither true nor false"),
        ("[columns]\na = 3\n", "not a table"),
        ("columns = 3\n", "not a table"),
        ("[columns]\na = 'x'\nb = 'x'\n", "two columns get the name x"),
        ("[time]\nunit = 'years'\n", "unit of the times"),
        ("[time]\nsample_time_s = -1\n", "sample time"),
        ("[time]\nsample_time_s = 1\ncolumn = 't'\n", "both a column of times"),
        ("not toml", "not TOML"),
        ("a = " + "[" * 20_000, "not TOML"),
    ],
)
def test_what_a_mapping_cannot_say_is_an_error(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "m.toml"
    path.write_text(text)
    with pytest.raises(ConfigurationError, match=words) as raised:
        read_thermal_mapping(path)
    assert "m.toml" in raised.value.where
    assert raised.value.remedy


def test_a_column_that_is_not_there_is_an_error(tmp_path: Path) -> None:
    path, mapping = files(tmp_path, "[columns]\nghost = 'x'\n[time]\ncolumn = 'when'\n")
    with pytest.raises(MeasurementFileError, match="'ghost' that is not there"):
        read_thermal_log(path, mapping=mapping)


def test_a_mapping_file_that_is_none_is_an_error(tmp_path: Path) -> None:
    path, _ = files(tmp_path, "")
    (tmp_path / "bad.toml").write_bytes(b"\x00\xff" * 50)
    for mapping in (tmp_path / "bad.toml", tmp_path / "none.toml"):
        with pytest.raises(ThermaxisError):
            read_thermal_log(path, mapping=mapping)
