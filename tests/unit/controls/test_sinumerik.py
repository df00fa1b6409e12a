"""SINUMERIK: its programs by a small interpreter of our own, its tables by a reader of our own."""

from dataclasses import replace

import numpy as np
import pytest

from tests.refusals import refused
from tests.unit.controls.builders import advised, found, plan_of, program_of
from tests.unit.controls.interpreters import Driven, drive_sinumerik
from thermaxis.controls import (
    TableRequest,
    TableText,
    check_options,
)
from thermaxis.controls.sinumerik import ALARM, CONTROL
from thermaxis.positioning import (
    AxisLevels,
    CompensationTable,
    TestPlan,
    compensation_table,
)
from thermaxis.quantities import AxisKind

PLAN = plan_of(axis="X1")


def table_options(*stated: str) -> dict[str, str]:
    return dict(check_options(CONTROL, stated, purpose="table"))


def drive(plan: TestPlan, *stated: str, **more: object) -> Driven:
    return drive_sinumerik(program_of(CONTROL, plan, *stated), plan.axis.upper(), **more)


def test_software_limits_that_are_too_near_lead_past_all_motion_to_an_alarm() -> None:
    for limits in ((-4.9, 200.0), (-100.0, 103.9)):
        done = drive(PLAN, software_limits=limits)
        assert (done.places, done.alarms) == ([], [ALARM])
    assert drive(PLAN, software_limits=(-5.0, 104.0)).alarms == []


def test_an_axis_may_have_a_number() -> None:
    for axis in ("X", "y", "Z2", "AX1", "MX12"):
        assert drive(replace(PLAN, axis=axis)).stops


def test_a_word_of_the_language_is_no_axis() -> None:
    for axis in ("G1", "M30", "F", "POS", "D1", "N10", "X_1", "X123", "FOR", "T1"):
        with refused("axis_name_unfit"):
            program_of(CONTROL, replace(PLAN, axis=axis))
        with refused("axis_name_unfit"):
            written(replace(TABLE, axis=axis))


# ---- tables -------------------------------------------------------------------------------------

LEVELS = AxisLevels(
    np.array([0.0, 100.0, 200.0]), np.array([[1.0, 3.0], [12.0, 14.0], [-31.5, -28.5]]), True
)


def table_of(
    levels: AxisLevels, position: np.ndarray, kind: AxisKind, *, backlash: bool
) -> CompensationTable:
    return compensation_table(
        levels,
        position,
        kind=kind,
        axis="X1",
        reference_position=float(position[0]),
        per_direction=False,
        backlash=backlash,
    )


TABLE = table_of(LEVELS, LEVELS.target, AxisKind.LINEAR, backlash=True)


def written(table: CompensationTable, *stated: str) -> TableText:
    return CONTROL.format_table(
        TableRequest(table=table, origin=("state; before (x) =1",), options=table_options(*stated))
    )


def statements(text: str) -> list[str]:
    assert text.isascii()
    assert text.count("\n") == text.count("\r\n")
    return [line for line in text.split("\r\n") if line and not line.startswith(";")]


def test_the_file_is_the_one_worked_out_by_hand() -> None:
    """Means 2, 13, -30 µm, zero at 0; forward minus backward -2, -2, -3 µm."""
    assert statements(written(TABLE).text) == [
        "$MA_ENC_COMP_ENABLE[0,X1]=0",
        "NEWCONF",
        "CHANDATA(1)",
        "$AA_ENC_COMP[0,0,X1]=0.000000",
        "$AA_ENC_COMP[0,1,X1]=0.011000",
        "$AA_ENC_COMP[0,2,X1]=-0.032000",
        "$AA_ENC_COMP_STEP[0,X1]=100",
        "$AA_ENC_COMP_MIN[0,X1]=0",
        "$AA_ENC_COMP_MAX[0,X1]=200",
        "$AA_ENC_COMP_IS_MODULO[0,X1]=0",
        "$MA_BACKLASH[0,X1]=0.002333",
        "M30",
    ]
    assert statements(written(replace(TABLE, backlash=None), "form=ini", "encoder=2").text) == [
        "%_N_X1_EEC_INI",
        "CHANDATA(1)",
        "$AA_ENC_COMP[1,0,X1]=0.000000",
        "$AA_ENC_COMP[1,1,X1]=0.011000",
        "$AA_ENC_COMP[1,2,X1]=-0.032000",
        "$AA_ENC_COMP_STEP[1,X1]=100",
        "$AA_ENC_COMP_MIN[1,X1]=0",
        "$AA_ENC_COMP_MAX[1,X1]=200",
        "$AA_ENC_COMP_IS_MODULO[1,X1]=0",
        "M17",
    ]


def test_no_file_switches_the_compensation_on_and_the_words_say_so() -> None:
    for form in ("program", "ini"):
        result = written(TABLE, f"form={form}")
        assert "ENABLE[0,X1]=1" not in result.text
        assert "does not activate" in result.text
        said = advised(result)
        assert said["sinumerik_activation"] == {"encoder": "0", "axis": "X1"}
        assert said["sinumerik_memory"] == {"points": 3}
        assert said["sinumerik_backlash"]["backlash"] == pytest.approx(7 / 3)
        assert ("sinumerik_ini" in said) == (form == "ini")
    without = advised(written(replace(TABLE, backlash=None)))
    assert "sinumerik_backlash" not in without
    assert "sinumerik_no_backlash" in without


def test_the_head_states_sign_unit_and_run_and_nothing_can_leave_it() -> None:
    table = replace(TABLE, source="drift-free; M30", run_sha256="ab" * 32)
    text = written(table).text
    head = [line for line in text.split("\r\n") if line.startswith(";")]
    assert "; values in mm are plus the mean deviation measured minus nominal" in head
    assert "; a positive value makes the axis move in negative direction" in head
    assert f"; run sha256 {'ab' * 32}" in head
    assert "; deviations drift-free M30" in head
    assert "; state before x 1" in head
    assert statements(text) == statements(written(TABLE).text)


def test_the_head_states_the_hash_of_the_run_once() -> None:
    text = written(replace(TABLE, run_sha256="ab" * 32)).text
    assert text.count("ab" * 32) == 1


def test_the_limits_are_those_of_the_machine_axis_and_moves_are_of_the_channel_axis() -> None:
    program = program_of(CONTROL, PLAN, "machine_axis=ax1")
    assert "$MA_POS_LIMIT_MINUS[AX1]" in program
    assert "[X1]" not in program
    assert drive_sinumerik(program, "X1", machine_axis="AX1").stops
    near = drive_sinumerik(program, "X1", machine_axis="AX1", software_limits=(0.0, 1e6))
    assert (near.places, len(near.alarms)) == ([], 1)
    assert program_of(CONTROL, PLAN) == program_of(CONTROL, PLAN, "machine_axis=axis")
    for name in ("AX1]", "1X", "a" * 40, "AX 1"):
        with refused("axis_name_unfit"):
            program_of(CONTROL, PLAN, f"machine_axis={name}")


def test_a_new_file_is_read_back_without_the_choice_among_the_older_ones_tables() -> None:
    options = table_options("table=2", "encoder=2")
    own = CONTROL.own_options(options)
    assert dict(own) == {**options, "table": "none"}
    text = written(TABLE, "table=2", "encoder=2").text
    read = CONTROL.read_table(text, "x", AxisKind.LINEAR, own)
    assert read.table.position.tolist() == TABLE.position.tolist()
    with refused("outside_range"):
        CONTROL.read_table(text, "x", AxisKind.LINEAR, options)


def test_a_table_that_lags_behind_its_encoder_has_a_positive_backlash() -> None:
    """Lost motion of 4 µm: forward the table is 2 µm short, backward 2 µm beyond."""
    levels = AxisLevels(np.array([0.0, 10.0]), np.array([[-2.0, 2.0], [-2.0, 2.0]]), True)
    table = table_of(levels, levels.target, AxisKind.LINEAR, backlash=True)
    text = written(table).text
    assert "$MA_BACKLASH[0,X1]=0.004000" in text
    read = CONTROL.read_table(text, "x", AxisKind.LINEAR, table_options())
    assert levels.level + CONTROL.correction(read.table, levels.target) == pytest.approx(
        np.zeros((2, 2))
    )


def test_the_machine_datum_of_the_largest_table_is_checked_when_it_is_stated() -> None:
    assert CONTROL.grid_rule(AxisKind.LINEAR, table_options()).most_points is None
    assert CONTROL.grid_rule(AxisKind.LINEAR, table_options("max_points=3")).most_points == 3
    written(TABLE, "max_points=3")
    with refused("too_many_table_points"):
        written(TABLE, "max_points=2")
    for wrong in ("1", "many", "nan", "-3"):
        with refused("outside_range"):
            written(TABLE, f"max_points={wrong}")


def test_points_that_are_not_equidistant_or_differ_by_direction_are_refused() -> None:
    uneven = replace(TABLE, position=np.array([0.0, 100.0, 201.0]))
    with refused("points_not_equidistant"):
        written(uneven)
    two = replace(TABLE, deviation=np.array([[0.0, 1.0]] * 3))
    with refused("one_value_per_point"):
        written(two)
    one = CompensationTable(
        kind=AxisKind.LINEAR, axis="X1", position=np.zeros(1), deviation=np.zeros((1, 2))
    )
    with refused("points_not_equidistant"):
        written(one)


def test_a_modulo_axis_needs_a_table_of_one_whole_turn() -> None:
    position = np.arange(0.0, 361.0, 30.0)
    deviation = np.stack((10 * np.sin(np.radians(position)) + position / 360,) * 2, axis=1)
    turn = CompensationTable(kind=AxisKind.ROTARY, axis="C", position=position, deviation=deviation)
    result = written(turn, "modulo=1")
    assert "$AA_ENC_COMP_IS_MODULO[0,C]=1" in result.text
    assert "$AA_ENC_COMP_MAX[0,C]=360" in result.text
    assert advised(result)["sinumerik_turn"]["jump"] == pytest.approx(1.0)
    read = CONTROL.read_table(result.text, "x", AxisKind.ROTARY, table_options("modulo=1"))
    assert len(read.findings) == 1
    read = CONTROL.read_table(result.text, "x", AxisKind.ROTARY, table_options())
    assert "modulo_differs" in found(read)
    part = replace(turn, position=position[:-1], deviation=deviation[:-1])
    with refused("turn_not_covered"):
        written(part, "modulo=1")
    with refused("modulo_of_linear_axis"):
        written(TABLE, "modulo=1")


# ---- reading ------------------------------------------------------------------------------------

GOOD = written(TABLE).text


def read(text: str, *stated: str) -> CompensationTable:
    return CONTROL.read_table(text, "x", AxisKind.LINEAR, table_options(*stated)).table


def findings(text: str, *stated: str) -> list[str]:
    return found(CONTROL.read_table(text, "x", AxisKind.LINEAR, table_options(*stated)))


def changed(old: str, new: str) -> str:
    assert GOOD.count(old) == 1
    return GOOD.replace(old, new)


FIRST = GOOD.split("\r\n").index("$AA_ENC_COMP[0,0,X1]=0.000000") + 1


def test_spaces_block_numbers_lower_case_and_comments_do_no_harm() -> None:
    text = changed("$AA_ENC_COMP[0,1,X1]=0.011000", "N10 $aa_enc_comp [ 0 , 1 , x1 ] = +.011 ; a")
    for same in (text, changed("=0.011000", "=1.1EX-2"), GOOD.replace("\r\n", "\n")):
        assert read(same).mean == pytest.approx([0.0, 11.0, -32.0])


def test_what_the_control_would_refuse_is_refused_with_its_line() -> None:
    for text, line, code in (
        (changed("=0.011000", "=0,011"), FIRST + 1, "table_decimal_comma"),
        (changed("=0.002333", "=n/a"), FIRST + 7, "not_a_number"),
        (changed("=0.002333", "="), FIRST + 7, "not_a_number"),
        (changed("=0.011000", "=nan"), FIRST + 1, "not_a_number"),
        (changed("=0.011000", "=1e3"), FIRST + 1, "not_a_number"),
        (changed("=0.011000", "=9" + "9" * 50), FIRST + 1, "number_too_large"),
        (changed("=0.011000", "=1EX999"), FIRST + 1, "number_too_large"),
        (changed("[0,1,X1]", "[0,3,X1]"), FIRST + 2, "table_point_missing"),
        (changed("[0,0,X1]", "[0,7,X1]"), FIRST + 1, "table_point_missing"),
        (changed("[0,1,X1]", "[0,-1,X1]"), FIRST + 1, "no_point_index"),
        (changed("[0,1,X1]", "[0,999999,X1]"), FIRST + 1, "no_point_index"),
        (changed("[0,1,X1]", "[2,1,X1]"), FIRST + 1, "no_assignment"),
        (changed("[0,1,X1]", "[0,X1]"), FIRST + 1, "no_assignment"),
        (changed("$AA_ENC_COMP[0,1,X1]=", "AA_ENC_COMP[0,1,X1] "), FIRST + 1, "no_assignment"),
        (changed("MAX[0,X1]=200", "MAX[0,X1]=201"), FIRST + 5, "max_not_reached"),
        (changed("MAX[0,X1]=200", "MAX[0,X1]=300"), FIRST + 5, "max_not_reached"),
        (changed("STEP[0,X1]=100", "STEP[0,X1]=0"), FIRST + 3, "not_positive"),
        (changed("$AA_ENC_COMP_MAX[0,X1]=200\r\n", ""), None, "assignment_missing"),
        (changed("STEP[0,X1]=100", "STEP[0,X1]=1OO"), FIRST + 3, "not_a_number"),
    ):
        with refused(code) as caught:
            read(text)
        assert line is None or caught.value.place[:2] == ("x", line)


def test_a_file_without_a_table_or_with_one_point_is_refused() -> None:
    for text in ("", "M30\r\n", "G1 X100\r\n", "$MA_BACKLASH[0,X1]=0.1\r\n"):
        with refused("no_encoder_table"):
            read(text)
    with refused("table_of_one_point"):
        read("$AA_ENC_COMP[0,0,X1]=0\r\nM30\r\n")


def test_max_may_be_off_by_one_last_digit_of_the_step_for_each_step() -> None:
    for steps, step, maximum, fits in (
        (39, "19.7436", "555", True),
        (39, "19.7436", "555.003", True),
        (39, "19.7436", "555.005", False),
        (4, "50", "-15", True),
        (4, "50", "-14", False),
        (3, "33.33", "-115.01", True),
        (3, "33.33", "-115.05", False),
    ):
        lines = [f"$AA_ENC_COMP[0,{i},AX1]=0" for i in range(steps + 1)]
        lines += [
            f"$AA_ENC_COMP_STEP[0,AX1]={step}",
            "$AA_ENC_COMP_MIN[0,AX1]=-215",
            f"$AA_ENC_COMP_MAX[0,AX1]={maximum}",
        ]
        if fits:
            table = read("\n".join(lines))
            assert table.position[-1] == pytest.approx(-215 + steps * float(step))
        else:
            with refused("max_not_reached"):
                read("\n".join(lines))


def test_repeated_indices_are_told_and_the_last_one_counts() -> None:
    text = changed("$AA_ENC_COMP[0,2", "$AA_ENC_COMP[0,1,X1]=0.5\r\n$AA_ENC_COMP[0,2")
    assert read(text).mean.tolist() == [0.0, 500.0, -32.0]
    assert "index_twice" in findings(text)


def test_activation_encoder_and_unknown_lines_are_told() -> None:
    assert "activation_off" in findings(GOOD)
    active = changed("ENABLE[0,X1]=0", "ENABLE[0,X1]=1")
    assert "activates_itself" in findings(active)
    silent = changed("$MA_ENC_COMP_ENABLE[0,X1]=0\r\n", "")
    assert "not_activated" in findings(silent)
    assert "other_encoder" in findings(GOOD, "encoder=2")
    more = changed("CHANDATA(1)", "CHANDATA(1)\r\nG0 X100\r\n$MA_OTHER[0,X1]=7")
    assert findings(more).count("line_passed_over") == 2
    assert "modulo_not_written" in findings(changed("$AA_ENC_COMP_IS_MODULO[0,X1]=0\r\n", ""))


def test_of_several_tables_one_has_to_be_chosen() -> None:
    other = GOOD.replace("X1", "AX2").replace("0.011", "0.012")
    both = GOOD + other
    with refused("several_tables", file="x", count=2) as caught:
        read(both)
    assert "axis AX2" in str(caught.value.values["tables"])
    assert read(both, "table=1").axis == "X1"
    assert read(both, "table=2").axis == "AX2"
    assert read(both, "table=2").mean[1] == pytest.approx(12.0)
    for wrong in ("3", "0", "1.5", "x"):
        code = "not_whole_number" if wrong == "1.5" else "outside_range"
        with refused(code, key="--set table"):
            read(both, f"table={wrong}")


def test_one_value_of_another_axis_makes_a_second_table_and_is_asked_about() -> None:
    with refused("several_tables") as caught:
        read(changed("[0,1,X1]", "[0,1,Y1]"))
    assert "axis Y1, 1 values" in str(caught.value.values["tables"])
