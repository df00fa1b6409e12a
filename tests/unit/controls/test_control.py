import subprocess
import sys

import numpy as np
import pytest

from tests.refusals import refused
from tests.unit.controls.builders import found
from thermaxis.controls import (
    LARGEST_TABLE_BYTES,
    ReadTable,
    TableRequest,
    check_options,
    check_size,
    control_by_name,
    control_names,
)
from thermaxis.positioning import CompensationTable
from thermaxis.quantities import AxisKind


@pytest.mark.parametrize("name", control_names())
def test_an_option_that_is_unknown_or_has_no_value_or_a_wrong_one_is_refused(name: str) -> None:
    control = control_by_name(name)
    for purpose in ("program", "touch", "table"):
        options = [o for o in control.options if purpose in (o.only_for or purpose).split()]
        known = tuple(sorted(f"{option.name} ({option.default})" for option in options))
        for stated in ("colour", "colour=red"):
            key = f"--set {stated}"
            with refused("unknown_control_option", key=key, name="colour", known=known):
                check_options(control, [stated], purpose=purpose)
        for option in options:
            with refused("option_without_value", meaning=option.in_words):
                check_options(control, [option.name], purpose=purpose)
            if option.choices:
                with refused("unknown_choice", known=option.choices):
                    check_options(control, [f"{option.name}=~"], purpose=purpose)
                with refused("stated_twice", name=option.name):
                    twice = [f"{option.name}={option.default}"] * 2
                    check_options(control, twice, purpose=purpose)


def test_a_file_may_be_as_large_as_the_limit_and_no_control_reads_a_larger_one() -> None:
    check_size(b"0" * LARGEST_TABLE_BYTES, "a.com")
    with refused("file_too_large"):
        check_size(b"0" * (LARGEST_TABLE_BYTES + 1), "a.com")
    for name in control_names():
        control = control_by_name(name)
        options = check_options(control, [], purpose="table")
        with refused("file_too_large"):
            control.read_table("0" * (LARGEST_TABLE_BYTES + 1), "a", AxisKind.LINEAR, options)


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
        assert "line_ended_by_return_alone" not in found(got)
    got = read(name, text.replace("\n", "\r"))
    assert found(got).count("line_ended_by_return_alone") == 1
    assert got.table.deviation.tolist() == known.table.deviation.tolist()
    lines = text.split("\n")
    mixed = "\r\n".join([*lines[:2], "\r".join(lines[2:4]), *lines[4:]])
    (one,) = (f for f in read(name, mixed).findings if f.code.endswith("return_alone"))
    assert one.place.line == 3


def test_a_byte_order_mark_hides_no_table_from_the_reader() -> None:
    for name in BY_ALL_ENDS:
        text = table_text(name)
        known = read(name, text)
        for mark in ("\ufeff", "\xef\xbb\xbf"):
            got = read(name, mark + text)
            assert got.table.deviation.tolist() == known.table.deviation.tolist()
            assert got.findings == known.findings


def test_a_table_names_its_axis_where_the_file_can() -> None:
    named = {name: read(name, table_text(name)).table.axis for name in control_names()}
    assert named == {name: "" if name == "linuxcnc" else "X" for name in control_names()}


def test_the_names_of_the_controls_are_known_without_numpy() -> None:
    code = (
        "import sys, thermaxis.controls as c; assert len(c.control_names()) >= 5;"
        "sys.exit('numpy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=500).returncode == 0


def test_a_name_that_is_no_control_is_refused() -> None:
    with refused("unknown_choice"):
        control_by_name("mach3")
