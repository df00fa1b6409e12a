import subprocess
import sys

import numpy as np
import pytest

from thermaxis.controls import (
    LARGEST_TABLE_BYTES,
    ReadTable,
    TableRequest,
    check_options,
    check_size,
    control_by_name,
    control_names,
)
from thermaxis.errors import ConfigurationError, MeasurementFileError
from thermaxis.positioning import CompensationTable
from thermaxis.quantities import AxisKind

EVERY = [
    (name, purpose, option)
    for name in control_names()
    for purpose in ("program", "table")
    for option in control_by_name(name).options
    if option.only_for in {"", purpose}
]


def refusal(name: str, stated: str, purpose: str) -> ConfigurationError:
    with pytest.raises(ConfigurationError) as caught:
        check_options(control_by_name(name), [stated], purpose=purpose)
    return caught.value


@pytest.mark.parametrize("name", control_names())
@pytest.mark.parametrize("purpose", ["program", "table"])
@pytest.mark.parametrize("stated", ["colour", "colour=red"])
def test_an_unknown_option_leads_to_all_that_there_are(
    name: str, purpose: str, stated: str
) -> None:
    remedy = refusal(name, stated, purpose).remedy
    for _, _, option in (e for e in EVERY if e[:2] == (name, purpose)):
        assert f"{option.name} ({option.default})" in remedy
    assert remedy.endswith("what it means")  # nothing was cut off


@pytest.mark.parametrize(("name", "purpose", "option"), EVERY)
def test_an_option_without_a_value_tells_what_it_means(name: str, purpose: str, option) -> None:
    error = refusal(name, option.name, purpose)
    assert "no NAME=VALUE" in error.what
    assert error.remedy == f"{option.name} ({option.default}): {option.meaning}"
    if option.choices:
        error = refusal(name, f"{option.name}=~", purpose)
        assert error.remedy.startswith(f"Write one of {option.choices[0]}")
        assert error.remedy.endswith(option.meaning)


@pytest.mark.parametrize("name", control_names())
def test_a_file_that_is_too_large_is_refused_in_the_same_words_by_every_control(name: str) -> None:
    control = control_by_name(name)
    options = check_options(control, [], purpose="table")
    with pytest.raises(MeasurementFileError, match=r"a\.com: the file is larger than 5 MB: too"):
        control.read_table("0" * (LARGEST_TABLE_BYTES + 1), "a.com", AxisKind.LINEAR, options)


def test_a_file_may_be_as_large_as_the_limit() -> None:
    check_size(b"0" * LARGEST_TABLE_BYTES, "a.com")
    with pytest.raises(MeasurementFileError, match="larger than 5 MB"):
        check_size(b"0" * (LARGEST_TABLE_BYTES + 1), "a.com")


def table_text(name: str) -> str:
    control = control_by_name(name)
    table = CompensationTable(
        kind=AxisKind.LINEAR,
        axis="X",
        position=np.array([0.0, 10.0, 20.0, 30.0]),
        deviation=np.array([[0.0, 0.0], [1.0, 1.0], [3.0, 3.0], [2.0, 2.0]]),
        reference_position=0.0,
    )
    options = check_options(control, [], purpose="table")
    return control.format_table(TableRequest(table=table, options=options)).text


def read(name: str, text: str) -> ReadTable:
    control = control_by_name(name)
    options = check_options(control, [], purpose="table")
    return control.read_table(text, "a.com", AxisKind.LINEAR, options)


# LinuxCNC has a rule of its own, proven on it
BY_ALL_ENDS = [name for name in control_names() if name != "linuxcnc"]


@pytest.mark.parametrize("name", BY_ALL_ENDS)
def test_ends_of_lines_are_told_where_a_control_may_read_another_table(name: str) -> None:
    text = table_text(name).replace("\r\n", "\n")
    known = read(name, text)
    for end in ("\n", "\r\n", "\n\r\r"):
        if end == "\n\r\r" and name.startswith("heidenhain"):
            continue  # it reads an empty line within the table, and says so
        got = read(name, text.replace("\n", end))
        assert not any("carriage return" in finding for finding in got.findings)
    got = read(name, text.replace("\n", "\r"))
    assert sum("line 1 is ended by a carriage return alone" in f for f in got.findings) == 1
    assert got.table.deviation.tolist() == known.table.deviation.tolist()
    lines = text.split("\n")
    mixed = "\r\n".join([*lines[:2], "\r".join(lines[2:4]), *lines[4:]])
    (finding,) = (f for f in read(name, mixed).findings if "carriage return" in f)
    assert finding.startswith("line 3 is ended")


@pytest.mark.parametrize("name", BY_ALL_ENDS)
@pytest.mark.parametrize("mark", ["\ufeff", "\xef\xbb\xbf"])
def test_a_byte_order_mark_hides_no_table_from_the_reader(name: str, mark: str) -> None:
    text = table_text(name)
    got, known = read(name, mark + text), read(name, text)
    assert got.table.deviation.tolist() == known.table.deviation.tolist()
    assert got.findings == known.findings


@pytest.mark.parametrize("name", control_names())
def test_a_table_names_its_axis_where_the_file_can(name: str) -> None:
    assert read(name, table_text(name)).table.axis == ("" if name == "linuxcnc" else "X")


def test_the_names_of_the_controls_are_known_without_numpy() -> None:
    code = (
        "import sys, thermaxis.controls as c; assert len(c.control_names()) >= 5;"
        "sys.exit('numpy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=60).returncode == 0


def test_a_name_that_is_no_control_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="there is no control 'mach3'"):
        control_by_name("mach3")
