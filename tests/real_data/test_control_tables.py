"""Tables of real controls, read as these controls read them: their defects are named.

The tables are public and no part of the project; what is expected of them was read off their text
by eye, or by a few lines of the test's own.
"""

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest

from tests.refusals import refused
from thermaxis.cli import main
from thermaxis.controls import ReadTable, TableRequest, check_options, control_by_name
from thermaxis.errors import MeasurementFileError
from thermaxis.quantities import AxisKind

pytestmark = pytest.mark.real_data

SCREW = "positioning/linuxcnc/screwcompX.dat"
ENC_COMP = "positioning/siemens/AA_ENC_COMP_tables_from_data.sqlite.txt"
LEC_ROW = "positioning/siemens/REN_raw_row_from_data.sqlite.csv"


def read(path: Path, control: str, *stated: str, text: str | None = None) -> ReadTable:
    chosen = control_by_name(control)
    options = check_options(chosen, stated, purpose="table")
    content = path.read_text(encoding="ascii") if text is None else text
    return chosen.read_table(content, path.name, AxisKind.LINEAR, options)


def test_the_screw_table_is_read_whole_and_its_typing_error_is_named(real_data: Path) -> None:
    path = real_data / SCREW
    table = read(path, "linuxcnc")
    assert table.points_in_file == table.table.position.size == 11
    assert table.table.position.tolist() == list(range(-10, 11, 2))
    rows = np.loadtxt(path)
    assert table.table.deviation == pytest.approx(1000 * (rows[:, 1:] - rows[:, :1]), abs=1e-9)
    (one,) = table.findings
    assert (one.code, one.place.line) == ("finding-value_off_neighbours", 4)
    assert (one.values["side"], one.values["value"]) == ("forward", "-4.2")
    assert one.values["off"] == pytest.approx(197.5, abs=0.05)
    meant = path.read_text(encoding="ascii").replace("-4.2 ", "-4.002 ")
    assert read(path, "linuxcnc", text=meant).findings == ()


def test_the_screw_table_is_not_taken_for_one_of_trims(real_data: Path) -> None:
    with refused("other_table_type", stated="1", other="0"):
        read(real_data / SCREW, "linuxcnc", "type=1")


def test_of_the_two_sinumerik_tables_one_must_be_chosen(real_data: Path) -> None:
    with pytest.raises(MeasurementFileError) as caught:
        read(real_data / ENC_COMP, "sinumerik")
    assert "2 tables: table 1 from line 3, axis AX1, 40 values" in str(caught.value)
    assert "axis AX1, 16 values" in str(caught.value)
    assert "--set table=1" in str(caught.value)


def test_the_first_sinumerik_table_is_read_whole(real_data: Path) -> None:
    path = real_data / ENC_COMP
    table = read(path, "sinumerik", "table=1")
    first = path.read_text(encoding="ascii").partition("M30")[0]
    value = [float(v) for v in re.findall(r"COMP\[0,\d+,AX1\]=(\S+)", first)]
    assert len(value) == 40
    assert table.table.mean == pytest.approx(1000 * np.array(value), abs=1e-9)
    assert table.table.position == pytest.approx(-215 + 19.7436 * np.arange(40))
    assert table.table.axis == "AX1"
    assert table.table.backlash == pytest.approx(0.9)  # minus $MA_BACKLASH
    assert [one.code for one in table.findings] == ["finding-activation_off"]


def test_the_second_sinumerik_table_is_refused_as_the_control_does(real_data: Path) -> None:
    path = real_data / ENC_COMP
    with refused("table_decimal_comma") as caught:
        read(path, "sinumerik", "table=2")
    lines = path.read_text(encoding="ascii").split("\n")
    number = next(i for i, line in enumerate(lines, start=1) if "," in line.partition("=")[2])
    assert caught.value.place.line == number
    points = re.sub(r"=0,(\d+)", r"=0.\1", "\n".join(lines))
    number = next(i for i, line in enumerate(lines, start=1) if "n/a" in line)
    with refused("not_a_number", text="n/a") as caught:
        read(path, "sinumerik", "table=2", text=points)
    assert caught.value.place.line == number
    mended = read(path, "sinumerik", "table=2", text=points.replace("=n/a", "=0"))
    assert mended.table.position.tolist() == list(range(-215, 536, 50))


def test_what_the_row_beside_the_table_tells_of_the_sign_of_the_backlash(real_data: Path) -> None:
    """It is of another run and tells the sign alone: forward minus backward is positive there."""
    with (real_data / LEC_ROW).open(encoding="ascii", newline="") as file:
        (row,) = csv.DictReader(file)
    reversal = float(row["Forward_direction"]) - float(row["Reverse_direction"])
    table = read(real_data / ENC_COMP, "sinumerik", "table=1").table
    assert row["Sign_convention"] == "As errors"
    assert reversal == pytest.approx(0.0002)
    assert np.sign(reversal) == np.sign(table.backlash or 0.0)
    assert row["Compensation_spacing"].strip() == "25 mm"
    assert float(row["Compensation_start"].removesuffix("mm")) != table.position[0]


@pytest.mark.parametrize(("name", "control"), [(SCREW, "linuxcnc"), (ENC_COMP, "sinumerik")])
def test_a_real_table_written_anew_is_the_same_table(
    real_data: Path, name: str, control: str
) -> None:
    stated = ("table=1",) if control == "sinumerik" else ()
    table = read(real_data / name, control, *stated).table
    chosen = control_by_name(control)
    options = check_options(chosen, (), purpose="table")
    text = chosen.format_table(TableRequest(table=table, options=options)).text
    again = chosen.read_table(text, "again", AxisKind.LINEAR, options).table
    assert again.position == pytest.approx(table.position, abs=1e-9)
    assert again.deviation == pytest.approx(table.deviation, abs=1e-6)
    assert again.backlash == pytest.approx(table.backlash)


@pytest.mark.proof
@pytest.mark.parametrize(
    ("name", "control", "stated", "words"),
    [
        (SCREW, "linuxcnc", (), "line 4"),
        (ENC_COMP, "sinumerik", ("--set", "table=1"), "MD32700"),
    ],
)
def test_the_command_checks_them_with_a_run(
    real_data: Path,
    root: Path,
    capsys: pytest.CaptureFixture[str],
    name: str,
    control: str,
    stated: tuple[str, ...],
    words: str,
) -> None:
    run = root / "examples" / "x_axis_100_cycles.csv"
    command = ["check-table", str(real_data / name), str(run), "--control", control, *stated]
    assert main([*command, "--json", "-"]) == 0
    assert words in json.dumps(json.loads(capsys.readouterr().out))
