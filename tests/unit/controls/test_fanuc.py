import re

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.refusals import refused
from tests.unit.controls.builders import (
    advised,
    found,
    plan_of,
    program_of,
)
from thermaxis.controls import (
    ReadTable,
    TableRequest,
    check_options,
    control_by_name,
)
from thermaxis.errors import ConfigurationError
from thermaxis.positioning import (
    BACKWARD,
    FORWARD,
    CompensationTable,
    table_points,
)
from thermaxis.quantities import AxisKind

FANUC = control_by_name("fanuc")
LINEAR, ROTARY = AxisKind.LINEAR, AxisKind.ROTARY


def test_the_head_says_that_offsets_must_be_zero() -> None:
    text = program_of(FANUC, plan_of(), "work_offset=G55")
    for words in ("ZERO IN G55", "\nG55 G90", "LATHE"):
        assert words in text
    assert "ZERO OFFSETS ONLY" in program_of(FANUC, plan_of(), travel=(-10.0, 110.0))


def test_a_dwell_is_rounded_up_to_milliseconds() -> None:
    text = program_of(FANUC, plan_of(dwell_s=1.0002, recording_s=0.0))
    assert "G04 P1001\n" in text
    assert "G04" not in program_of(FANUC, plan_of(dwell_s=0.0, recording_s=0.0))


def test_a_number_that_no_program_has_is_refused() -> None:
    for number, code in (
        ("0", "outside_range"),
        ("1.5", "not_whole_number"),
        ("7999", "program_number_too_high"),
    ):
        with refused(code):
            program_of(FANUC, plan_of(), f"program_number={number}")


# ---- tables -------------------------------------------------------------------------------------


def made(table: CompensationTable, *sets: str):
    options = check_options(FANUC, sets, purpose="table")
    return FANUC.format_table(TableRequest(table=table, origin=("run a.csv",), options=options))


def read(text: str, *sets: str, kind: AxisKind = LINEAR) -> ReadTable:
    options = check_options(FANUC, sets, purpose="table")
    return FANUC.read_table(text, "t.txt", kind, options)


def plain(text: str) -> dict[int, int]:
    """Return the numbers of a file without the product's reader."""
    return {
        int(n): int(p) for n, p in re.findall(r"^N(\d{5})(?:A\d+)?P(-?\d+)$", text, re.MULTILINE)
    }


def simple(deviation: list[float], *, start: float, step: float, **changes: object):
    fields: dict[str, object] = {
        "kind": LINEAR,
        "axis": "X",
        "position": start + step * np.arange(len(deviation)),
        "deviation": np.stack((deviation, deviation), axis=1),
        "reference_position": 0.0,
        **changes,
    }
    return CompensationTable(**fields)


MANUAL = (2, 1, 1, -2, 0, -1, 0, -1, 2, 1, 0, -1, -1, -2, 0, 1, 2)
"""Points 33 to 49 of the example in the parameter manual: reference point 40, interval 50 mm."""
MANUAL_SUM = (0, 2, 3, 4, 2, 2, 1, 1, 0, 2, 3, 3, 2, 1, -1, -1, 0, 2)
"""The correction at -400, -350 ... 450 mm, added up by hand from the reference position."""


def test_the_example_of_the_manual_is_read_as_the_manual_draws_it() -> None:
    points = "".join(f"N{10033 + i}P{v};\n" for i, v in enumerate(MANUAL))
    text = f"%;\nN03620A1P40\nN03621A1P33\nN03622A1P49\nN03623A1P1\nN03624A1P50000\n{points}%\n"
    got = read(text)
    position = -400.0 + 50.0 * np.arange(18)
    assert got.table.position.tolist() == position.tolist()
    correction = FANUC.correction(got.table, position)
    assert correction[:, FORWARD].tolist() == pytest.approx(list(MANUAL_SUM))
    assert correction[:, BACKWARD].tolist() == pytest.approx(list(MANUAL_SUM))
    assert "reference_unknown" in found(got)


def test_the_example_of_the_manual_is_written_with_its_numbers() -> None:
    table = simple([-c for c in MANUAL_SUM], start=-400.0, step=50.0)
    numbers = plain(made(table, "reference_point=40").text)
    assert [numbers[10033 + i] for i in range(17)] == list(MANUAL)
    assert (numbers[3620], numbers[3621], numbers[3622]) == (40, 33, 49)
    assert (numbers[3623], numbers[3624]) == (1, 50_000)
    assert 10032 not in numbers
    assert 10050 not in numbers


def test_a_small_table_is_written_to_the_letter() -> None:
    table = simple([2.0, 0.0, -3.4], start=-100.0, step=100.0, axis="Y", backlash=-4.0)
    assert made(table, "comments=0").text == (
        "%\nN01851A2P4\nN03620A2P128\nN03621A2P128\nN03622A2P129\nN03623A2P1\n"
        "N03624A2P100000\nN10128P2\nN10129P3\n%\n"
    )


def test_the_second_table_gives_each_direction_its_own_course() -> None:
    # forward zero at the reference position, backward 5 µm further: 3627 moves it back by 5
    table = CompensationTable(
        kind=LINEAR,
        axis="X",
        position=np.array([-50.0, 0.0, 50.0]),
        deviation=np.array([[-4.5, -1.5], [-2.5, 2.5], [0.5, 3.5]]),
        reference_position=0.0,
    )
    text = made(table, "bidirectional=1").text
    numbers = plain(text)
    assert (numbers[3621], numbers[3622], numbers[3626]) == (0, 1, 2)
    assert numbers[3627] == -5
    assert [numbers[10000 + i] for i in range(4)] == [-2, -3, -4, -1]
    got = read(text, "bidirectional=1").table
    assert got.deviation == pytest.approx(table.deviation)
    other = made(table, "bidirectional=1", "return_direction=negative").text
    assert plain(other)[3627] == 5
    again = read(other, "bidirectional=1", "return_direction=negative").table
    assert again.deviation == pytest.approx(table.deviation)
    alone = read(text)
    assert "second_table_not_simulated" in found(alone)


def test_the_magnification_is_the_smallest_that_fits_and_the_loss_is_said() -> None:
    table = simple([0.0, 20.0, 41.0], start=0.0, step=100.0)
    got = made(table)
    numbers = plain(got.text)
    assert numbers[3623] == 3
    assert [numbers[10001], numbers[10002]] == [-7, -7]
    magnified = advised(got)["fanuc_magnified"]
    assert (magnified["before"], magnified["half"]) == (0.5, 1.5)
    newer = plain(made(table, "largest_value=127").text)
    assert newer[3623] == 1
    assert [newer[10001], newer[10002]] == [-20, -21]
    stated = plain(made(table, "magnification=5").text)
    assert [stated[10001], stated[10002]] == [-4, -4]
    with refused("increment_too_large"):
        made(table, "magnification=2")
    with refused("increment_too_large"):
        made(simple([0.0, 2000.0], start=0.0, step=100.0))


def test_axes_do_not_share_point_numbers_by_default() -> None:
    taken: set[int] = set()
    for axis in "XYZA":
        text = made(simple([0.0] * 100, start=0.0, step=1.0, axis=axis), "bidirectional=1").text
        used = {n for n in plain(text) if n >= 10000}
        assert not used & taken
        taken |= used
    assert max(taken) < 10000 + 1024


def test_a_table_beside_the_reference_position_is_led_to_it_by_zeros() -> None:
    table = simple([0.0, 2.0, 5.0], start=200.0, step=50.0)
    text = made(table).text
    numbers = plain(text)
    points = [numbers[n] for n in range(10000, 10000 + numbers[3622] + 1)]
    assert points == [0, 0, 0, 0, 0, -2, -3]
    assert numbers[3620] == 0
    got = read(text).table
    assert got.position.tolist() == [200.0, 250.0, 300.0]
    assert got.deviation[:, 0].tolist() == pytest.approx([0.0, 2.0, 5.0])
    below = simple([-3.0, -1.0, 0.0], start=-300.0, step=50.0)
    numbers = plain(made(below).text)
    assert numbers[3620] == numbers[3622] == 5
    assert [numbers[10000 + i] for i in range(6)] == [-2, -1, 0, 0, 0, 0]
    assert read(made(below).text).table.position.tolist() == [-300.0, -250.0, -200.0]


def test_without_comments_the_reader_is_told_where_the_reference_lies() -> None:
    table = simple([0.0, 2.0], start=100.0, step=50.0, reference_position=100.0)
    with refused("reference_needs_comment"):
        made(table, "comments=0")
    sets = ("comments=0", "reference_coordinate=100")
    got = read(made(table, *sets).text, *sets).table
    assert got.position.tolist() == [100.0, 150.0]
    with refused("other_reference_position"):
        made(table, "reference_coordinate=0")
    with refused("no_reference_position"):
        made(simple([0.0, 2.0], start=100.0, step=50.0, reference_position=None))


def test_a_modulo_axis_closes_its_turn() -> None:
    table = simple([0.0, 18.0, 36.0], start=0.0, step=90.0, kind=ROTARY, axis="B")
    text = made(table, "modulo=1", "largest_value=127").text
    numbers = plain(text)
    assert numbers[3625] == 360_000
    values = [numbers[10000 + n] for n in range(numbers[3621], numbers[3622] + 1)]
    assert values == [5, -5, -5, 5, 5]
    got = read(text, "modulo=1", "largest_value=127", kind=ROTARY)
    assert got.table.position.tolist() == [0.0, 90.0, 180.0]
    assert got.table.deviation[:, 0].tolist() == pytest.approx([0.0, 18.0, 36.0])
    bare = "\n".join(line for line in text.split("\n") if not line.startswith("("))
    whole = read(bare, "largest_value=127", kind=ROTARY)
    assert whole.table.position.tolist() == [0.0, 90.0, 180.0, 270.0, 360.0]
    number = numbers[3621]
    bent = read(bare.replace(f"N{10000 + number + 1}P-5", f"N{10000 + number + 1}P-4"), kind=ROTARY)
    assert "turn_adds_up" in found(bent)


def test_a_turn_that_cannot_close_is_refused() -> None:
    for deviation, start, step, code in (
        ([0.0, 1.0, 2.0], 90.0, 90.0, "modulo_table_unfit"),
        ([0.0, 1.0, 2.0], 0.0, 70.0, "modulo_table_unfit"),
        ([0.0, 1.0, 2.0, 3.0, 4.0, 5.0], 0.0, 90.0, "modulo_table_unfit"),
        ([0.0, 1.0, 2.0, 3.0, 9.0], 0.0, 90.0, "turn_not_closed"),
    ):
        with refused(code):
            made(simple(deviation, start=start, step=step, kind=ROTARY), "modulo=1")


def test_what_the_control_cannot_hold_is_refused() -> None:
    fields: dict[str, object] = {"deviation": [0.0, 1.0, 2.0], "start": 0.0, "step": 100.0}
    for changes in (
        *({"deviation": [0.0] * 129}, {"start": 30.0}, {"step": 0.12345}, {"axis": "X1"}),
        *({"axis": ""}, {"reference_position": None}, {"backlash": 20_000.0}),
    ):
        with pytest.raises(ConfigurationError):
            made(simple(**{**fields, **changes}))
    for stated in (
        *("reference_point=1023", "axis_number=9", "modulo=1", "detection_unit=0"),
        *("magnification=0", "magnification=1.5", "largest_value=x"),
    ):
        with pytest.raises(ConfigurationError):
            made(simple(**fields), stated)


GOOD = made(simple([0.0, -2.0, -5.0], start=-50.0, step=50.0)).text


def test_the_reader_names_defect_and_line() -> None:
    for old, new, code, line in (
        ("N10000P3", "N10000P1,5", "not_a_whole_word", True),
        ("N10000P3", "N10000Pn", "not_a_whole_word", True),
        ("N10000P3", "N10000P1.5", "not_a_whole_word", True),
        ("N10000P3", "N10000P", "not_a_whole_word", True),
        ("N10000P3", "N10000Pnan", "not_a_whole_word", True),
        ("N10000P3", "N10000P3nan", "not_a_whole_word", True),
        ("N10000P3", "N10000P1e5", "not_a_whole_word", True),
        ("N10000P3", "N10000P-inf", "not_a_whole_word", True),
        ("N03620A1P0", "N03620A1Pnan", "not_a_whole_word", True),
        ("N10000P3", "N10000P8", "point_value_too_large", True),
        ("N10000P3\n", "", "table_point_missing", False),
        ("N10000P3", "N10001P3", "word_stated_twice", True),
        ("N03623A1P1", "N03623A1P0", "outside_range", True),
        ("N03624A1P50000", "N03624A1P0", "not_positive", True),
        ("N03624A1P50000\n", "", "parameter_missing", False),
        ("N03620A1P", "N03621A1P", "word_stated_twice", False),
        ("N03622A1P1", "N03622A1P99999", "points_miss_reference", True),
        ("N03620A1P0", "N03620A1P9", "points_miss_reference", True),
        ("N03620", "G03620", "no_parameter_line", True),
        ("N03620A1", "N03620Ax", "not_a_number", True),
    ):
        text = GOOD.replace("N10000P2", "N10000P3") if "P3" in old else GOOD
        assert old in text
        with refused(code) as caught:
            read(text.replace(old, new, 1))
        assert (caught.value.place.line is not None) >= line


def test_a_file_that_is_cut_short_or_no_parameter_file_is_refused() -> None:
    with refused("table_cut_short"):
        read(GOOD.rsplit("%", 1)[0])
    with refused("no_parameter_file"):
        read("N1P1\n%\n%\n")
    with refused("no_parameter_file"):
        read("")
    with refused("no_pitch_error_table"):
        read("%\nN00001P1\n%\n")


def test_the_wrong_axis_is_refused_and_several_are_asked_for() -> None:
    with refused("other_axis_number"):
        read(GOOD, "axis_number=2")
    both = re.sub(r"A1P(\d+)", r"A1P\1A2P\1", GOOD)
    with refused("several_axes"):
        read(both)
    assert read(both, "axis_number=2").table.position.size == 3


def test_the_axis_is_that_of_the_comment_or_goes_by_its_usual_number() -> None:
    bare = "\n".join(line for line in GOOD.split("\n") if not line.startswith("("))
    for number, axis in [(1, "X"), (2, "Y"), (3, "Z"), (4, ""), (7, "")]:
        got = read(bare.replace("A1P", f"A{number}P"))
        assert got.table.axis == axis
        said = "axis_by_number" in found(got)
        assert said == bool(axis)
    assert read(bare, "axis_number=1").table.axis == ""
    assert read(bare.replace("A1P", "P")).table.axis == ""
    assert read(GOOD).table.axis == "X"
    assert "axis_by_number" not in found(read(GOOD))
    moved = GOOD.replace("A1P", "A3P")
    assert read(moved).table.axis == "X"
    assert "comment_of_other_axis" in found(read(moved))
    assert "comment_of_other_axis" not in found(read(moved, "axis_number=3"))


@given(
    st.integers(-500_000, 500_000),
    st.integers(128, 2_000_000),
    st.floats(0.0, 1.0),
    st.integers(3, 128),
)
@settings(max_examples=80, deadline=None)
def test_as_many_points_as_are_asked_for_are_enough_wherever_the_reference_lies(
    first: int, span: int, share: float, points: int
) -> None:
    target = np.array([first, first + span]) / 1000.0
    reference = round((first + share * span) / 1000.0, 3)
    position = table_points(target, points=points, through=reference, decimals=3)
    assert position.size <= points
    assert position[0] <= target[0] + 5e-4
    assert position[-1] >= target[-1] - 1e-3
    step = round(float(position[1] - position[0]), 3)
    table = simple(
        [0.0] * position.size, start=float(position[0]), step=step, reference_position=reference
    )
    numbers = plain(made(table).text)
    assert numbers[3622] - numbers[3621] + 1 <= points


def test_a_newer_file_states_its_interval_with_a_point() -> None:
    newer = GOOD.replace("A1P50000", "A1P50.0")
    assert read(newer).table.position.tolist() == [-50.0, 0.0, 50.0]


def test_text_of_the_run_stays_within_comments() -> None:
    table = simple([0.0, 1.0], start=0.0, step=10.0, source=") N10000P7 (", run_sha256="a" * 64)
    options = check_options(FANUC, [], purpose="table")
    text = FANUC.format_table(
        TableRequest(table=table, origin=(")\nN03623P9\n(", "µ" * 500), options=options)
    ).text
    assert text.isascii()
    for line in text.split("\n")[1:-2]:
        assert re.fullmatch(r"\([A-Z0-9 ._-]*\)|N\d{5}(A\d+)?P-?\d+", line), line
    assert f"({'A' * 64})" in text


def test_reversal_of_an_older_file_moves_into_the_two_tables_and_1851_becomes_0() -> None:
    position = np.array([0.0, 20.0, 40.0, 60.0])
    older = CompensationTable(
        kind=LINEAR,
        axis="X",
        position=position,
        deviation=np.array([[0.0, 0.0], [4.0, 2.0], [6.0, 8.0], [2.0, 2.0]]),
        backlash=-6.0,
        reference_position=0.0,
    )
    text = made(older, "bidirectional=1")
    numbers = plain(text.text)
    assert numbers[1851] == 0
    # two sums from the negative side, added up by hand: minus deviation, plus and minus half of 6
    first, second = numbers[3621], numbers[3626]
    forward = [sum(numbers[10000 + first + j] for j in range(1, i + 1)) for i in range(4)]
    backward = [sum(numbers[10000 + second + j] for j in range(1, i + 1)) for i in range(4)]
    assert forward == [0, -4, -6, -2]
    assert backward == [0, -2, -8, -2]
    assert numbers[3627] == -6  # what the other direction is corrected less by
    again = read(text.text, "bidirectional=1")
    assert again.table.backlash == 0.0
    assert FANUC.correction(again.table, position) == pytest.approx(
        np.array([[3.0, -3.0], [-1.0, -5.0], [-3.0, -11.0], [1.0, -5.0]])
    )
    assert "backlash_beside_second_table" not in found(again)
    assert advised(text)["fanuc_backlash_moved"]["moved"] == -6.0


def test_two_tables_without_known_reversal_leave_1851_to_the_user() -> None:
    table = simple([0.0, 1.0], start=0.0, step=10.0)
    text = made(table, "bidirectional=1")
    assert 1851 not in plain(text.text)
    assert "fanuc_backlash_by_hand" in advised(text)


def test_a_reference_position_far_away_is_refused_before_room_is_made_for_the_way_there() -> None:
    table = simple([0.0, 1.0, 0.0], start=99_000.0, step=0.001)
    with refused("too_many_point_numbers"):
        made(table)
    with refused("interval_too_fine"):
        made(simple([0.0, 1.0], start=0.0, step=1e-9))


def test_a_file_of_one_table_is_not_taken_for_two() -> None:
    with refused("no_second_table"):
        read(GOOD, "bidirectional=1")


def test_reversal_that_is_in_the_points_already_is_not_named_as_moved() -> None:
    said = made(simple([0.0, 1.0], start=0.0, step=10.0, backlash=0.0), "bidirectional=1")
    assert plain(said.text)[1851] == 0
    assert "fanuc_backlash_zero" in advised(said)
