import numpy as np
import pytest

from tests.refusals import refused
from tests.unit.controls.builders import (
    advised,
    found,
    plan_of,
    program_of,
    read_text,
    table_text,
)
from thermaxis.controls import (
    Control,
    TableRequest,
    check_options,
    control_by_name,
)
from thermaxis.errors import ConfigurationError
from thermaxis.positioning import (
    AxisLevels,
    CompensationTable,
    Cycle,
    compensation_table,
    table_points,
)
from thermaxis.quantities import AxisKind

NAMES = ("heidenhain-itnc530", "heidenhain-tnc640")
ITNC, TNC640 = (control_by_name(name) for name in NAMES)
LINEAR, ROTARY = AxisKind.LINEAR, AxisKind.ROTARY


def test_a_plan_of_one_cycle_needs_no_label() -> None:
    text = program_of(ITNC, plan_of(cycles=1))
    assert "LBL" not in text


def test_more_blocks_than_labels_and_an_unfit_name_are_refused() -> None:
    plan = plan_of(target=np.arange(1000.0), cycle=Cycle.STEP, cycles=2, overrun=0.1)
    with refused("too_many_labels"):
        program_of(ITNC, plan)
    with refused("dwell_too_long"):
        program_of(ITNC, plan_of(dwell_s=4000.0))
    with refused("program_name_unfit"):
        program_of(ITNC, plan_of(), "program_name=A B")


# ---- tables -------------------------------------------------------------------------------------

LEVELS = AxisLevels(
    np.array([-100.0, 0.0, 100.0, 200.0, 300.0]),
    np.array([[1.0, -2.0], [3.0, 1.0], [5.0, 2.0], [9.0, 6.0], [20.0, 14.04]]),
    bidirectional=True,
)


def table_of(control: Control, kind: AxisKind = LINEAR, **changes: object) -> CompensationTable:
    rule = control.grid_rule(kind, check_options(control, [], purpose="table"))
    fields: dict[str, object] = {
        "kind": kind,
        "axis": "X",
        "reference_position": 0.0,
        "per_direction": rule.per_direction,
        **changes,
    }
    position = table_points(LEVELS.target, spacing=100.0, decimals=rule.decimals)
    return compensation_table(LEVELS, position, **fields)


ITNC_TEXT = (
    "BEGIN AXIS-X.COM  DATUM:-100.0000 DISTANCE:+100.0000\r\n"
    "NR                  X\r\n"
    "0       -100.0000   -0.0025\r\n"
    "1       +0.0000     +0.0000\r\n"
    "2       +100.0000   +0.0015\r\n"
    "3       +200.0000   +0.0055\r\n"
    "4       +300.0000   +0.0150\r\n"
)
TNC640_TEXT = (
    "BEGIN AXIS_X.COM MM\r\n"
    "NR   AXISPOS       BACKLASH      X\r\n"
    "0    -100.0000     -0.0040       -0.0010\r\n"
    "1    +0.0000       -0.0010       +0.0010\r\n"
    "2    +100.0000     +0.0000       +0.0030\r\n"
    "3    +200.0000     +0.0040       +0.0070\r\n"
    "4    +300.0000     +0.0120       +0.0180\r\n"
    "[END]\r\n"
)


def test_the_older_form_has_the_mean_of_each_point_to_the_letter() -> None:
    assert table_text(ITNC, table_of(ITNC)) == ITNC_TEXT  # 17.02 - 2 is written as 15.0 µm


def test_the_newer_form_has_a_column_for_each_direction_to_the_letter() -> None:
    assert table_text(TNC640, table_of(TNC640)) == TNC640_TEXT  # 14.04 - 2 is written as 12.0 µm


def test_values_of_a_rotary_axis_are_in_degrees() -> None:
    table = CompensationTable(
        kind=ROTARY,
        axis="C",
        position=np.array([0.0, 90.0]),
        deviation=np.array([[0.0, 0.0], [36.0, 36.0]]),
    )
    assert "+0.0100" in table_text(TNC640, table)
    assert table_text(ITNC, table).splitlines()[3] == "1       +90.0000    +0.0100"
    assert read_text(ITNC, table_text(ITNC, table), ROTARY).table.deviation[1, 0] == pytest.approx(
        36.0
    )


def test_without_reversal_the_column_of_the_negative_direction_is_empty() -> None:
    text = table_text(TNC640, table_of(TNC640, per_direction=False))
    assert text.splitlines()[2] == "0    -100.0000                   -0.0025"
    got = read_text(TNC640, text).table
    assert not got.per_direction
    assert got.deviation[0].tolist() == pytest.approx([-2.5, -2.5])


def test_a_reversal_held_apart_goes_into_the_columns_of_the_newer_form() -> None:
    table = table_of(TNC640, per_direction=False, backlash=True)
    got = read_text(TNC640, table_text(TNC640, table)).table
    assert got.deviation_at(table.position) == pytest.approx(
        table.deviation_at(table.position), abs=0.05 + 1e-9
    )


def test_the_older_form_names_a_reversal_in_the_summary_alone() -> None:
    table = table_of(ITNC, backlash=True)
    options = check_options(ITNC, [], purpose="table")
    made = ITNC.format_table(TableRequest(table=table, options=options))
    assert made.text == ITNC_TEXT
    assert advised(made)["itnc530_reversal"]["reversal"] == pytest.approx(3.392)


# ---- what a reader refuses, with its line --------------------------------------------------------


def check_defects(control: Control, good: str, defects: list[tuple[str, str, str, int]]) -> None:
    for old, new, code, line in defects:
        assert old in good
        with refused(code) as caught:
            read_text(control, good.replace(old, new, 1))
        assert caught.value.place.line == line, new


def test_the_reader_of_the_older_form_names_defect_and_line() -> None:
    defects = [
        ("+0.0015", "+0,0015", "table_decimal_comma", 5),
        ("+0.0015", "n/a", "not_a_number", 5),
        ("+0.0015", "nan", "not_a_number", 5),
        ("+0.0015", "1e5", "not_a_number", 5),
        ("+0.0015", "\u0661\u0662", "not_a_number", 5),
        ("+0.0015", "", "row_too_short", 5),
        ("+200.0000   ", "+201.0000   ", "rows_not_equidistant", 6),
        ("3       +200", "4       +200", "row_out_of_order", 6),
        ("3       +200", "x       +200", "row_without_number", 6),
        ("2       +100.0000   +0.0015\r\n", "\r\n", "table_line_empty", 5),
        ("2       +100.0000   +0.0015\r\n", "", "row_out_of_order", 5),
        ("DISTANCE:+100.0000", "DISTANCE:+0.0000", "not_positive", 1),
        ("DISTANCE:+100.0000", "", "first_line_unfit", 1),
        ("DATUM:-100.0000", "DATUM:-100,0000", "table_decimal_comma", 1),
        ("AXIS-X", "AXIS-Y", "other_axis_columns", 2),
        ("NR                  X", "NR                  X          X", "heading_stated_twice", 2),
        ("NR                  X", "NR", "axis_heading_missing", 2),
        ("NR   ", "ZZ   ", "headings_missing", 2),
        ("-0.0025", "\t-0.0025", "table_line_has_tab", 3),
        ("-0.0025", "-0.0025 +0.1", "value_without_heading", 3),
        ("+300.0000   +0.0150", "+300.0000   +999999.0", "number_too_large", 7),
    ]
    check_defects(ITNC, ITNC_TEXT, defects)


def test_the_reader_of_the_newer_form_names_defect_and_line() -> None:
    defects = [
        ("+0.0030", "+0,0030", "table_decimal_comma", 5),
        ("+0.0030", "n/a", "not_a_number", 5),
        ("+0.0030", "", "row_value_missing", 5),
        ("+0.0000       +0.0030", "              +0.0030", "row_value_missing", 5),
        ("+200.0000", "+100.0000", "position_not_rising", 6),
        ("[END]\r\n", "", "table_cut_short", 7),
        ("[END]\r\n", "[END]\r\n5 +400.0 +0.1\r\n", "lines_behind_end", 9),
        ("3    +200", "4    +200", "row_out_of_order", 6),
        ("MM\r\n", "INCH\r\n", "table_not_in_mm", 1),
        ("AXIS_X", "AXIS_Y", "other_axis_columns", 2),
        ("AXISPOS ", "AXISPO  ", "headings_missing", 2),
        ("BEGIN", "BEGIM", "first_line_unfit", 1),
    ]
    check_defects(TNC640, TNC640_TEXT, defects)


@pytest.mark.parametrize("control", [ITNC, TNC640], ids=NAMES)
def test_the_257th_row_is_refused_in_writing_and_in_reading(control: Control) -> None:
    position = np.arange(257.0)
    table = CompensationTable(
        kind=LINEAR, axis="X", position=position, deviation=np.zeros((257, 2))
    )
    with refused("too_many_table_points"):
        table_text(control, table)
    whole = CompensationTable(
        kind=LINEAR, axis="X", position=position[:256], deviation=np.zeros((256, 2))
    )
    text = table_text(control, whole)
    assert read_text(control, text).table.position.size == 256
    last = text.replace("[END]\r\n", "").splitlines()[-1].replace("255", "256")
    with refused("too_many_rows"):
        read_text(control, text.replace("[END]\r\n", "") + last + "\r\n[END]\r\n")


def test_an_endless_line_is_refused() -> None:
    for control, good in ((ITNC, ITNC_TEXT), (TNC640, TNC640_TEXT)):
        with refused("table_line_too_long"):
            read_text(control, good.replace("X\r\n", "X " * 100_000 + "\r\n", 1))


def test_columns_of_other_axes_are_named_and_not_simulated() -> None:
    lines = [
        "BEGIN AXIS-X.COM  DATUM:+0.0000 DISTANCE:+10.0000",
        "NR                  X          Y          Z",
        "0       +0.0000     +0.0000    +0.0100",
        "1       +10.0000    +0.0020               +0.0300",
        "[END]",
    ]
    got = read_text(ITNC, "\n".join(lines) + "\n")
    assert got.table.deviation[:, 0].tolist() == pytest.approx([0.0, 2.0])
    assert "other_axes_not_simulated" in found(got)


def test_a_table_whose_name_has_no_axis_takes_the_only_column_and_says_so() -> None:
    got = read_text(ITNC, ITNC_TEXT.replace("AXIS-X", "COMP1"))
    assert got.table.axis == "X"
    assert got.findings
    with refused("axis_not_named"):
        read_text(TNC640, TNC640_TEXT.replace("AXIS_X", "COMP1").replace("      X", "      X   Y"))


def test_a_distance_that_is_no_power_of_two_is_refused_where_it_is_asked_for() -> None:
    with refused("spacing_no_power_of_two", below_mm=52.4288, above_mm=104.8576):
        table_text(ITNC, table_of(ITNC), "spacing=power_of_two")
    table = CompensationTable(
        kind=LINEAR,
        axis="X",
        position=6.5536 * np.arange(4),
        deviation=np.zeros((4, 2)),
        reference_position=0.0,
    )
    text = table_text(ITNC, table, "spacing=power_of_two")
    assert "DISTANCE:+6.5536" in text
    assert not read_text(ITNC, text, LINEAR, "spacing=power_of_two").findings


def test_a_table_that_the_form_cannot_hold_is_refused() -> None:
    for control, position, axis in (
        (ITNC, [0.0, 10.0, 25.0], "X"),
        (ITNC, [0.00005, 10.00005], "X"),
        (TNC640, [0.00005, 10.00005], "X"),
        (ITNC, [0.0, 1.0], ""),
        (TNC640, [0.0, 1.0], "x y"),
        (TNC640, [0.0, 1.0], "NR"),
        (TNC640, [0.0, 200_000.0], "X"),
    ):
        table = CompensationTable(
            kind=LINEAR,
            axis=axis,
            position=np.array(position),
            deviation=np.zeros((len(position), 2)),
        )
        with pytest.raises(ConfigurationError):
            table_text(control, table)


def test_points_at_unequal_distances_are_kept_by_the_newer_form() -> None:
    table = CompensationTable(
        kind=LINEAR,
        axis="Z1",
        position=np.array([0.0, 10.1234, 25.0]),
        deviation=np.array([[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]]),
    )
    got = read_text(TNC640, table_text(TNC640, table)).table
    assert got.axis == "Z1"
    assert got.position.tolist() == table.position.tolist()
    assert got.deviation == pytest.approx(table.deviation)
