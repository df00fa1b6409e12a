"""LinuxCNC: its programs by a small interpreter of our own, its tables by a reader of our own."""

import re

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.refusals import refused
from tests.unit.controls.builders import advised, found, plan_of, program_of
from tests.unit.controls.interpreters import drive_linuxcnc
from thermaxis.controls import ReadTable, TableRequest, check_options
from thermaxis.controls.linuxcnc import CONTROL
from thermaxis.errors import MeasurementFileError
from thermaxis.positioning import (
    AxisLevels,
    CompensationTable,
    compensation_table,
    evaluate_duration,
)
from thermaxis.quantities import AxisKind


def table_options(*stated: str) -> dict[str, str]:
    return dict(check_options(CONTROL, stated, purpose="table"))


def test_the_head_states_the_duration_that_the_motion_takes() -> None:
    plan = plan_of()
    for warm_up in (0, 500):
        program = program_of(CONTROL, plan, warm_up=warm_up)
        done = drive_linuxcnc(program)
        seconds = 60.0 * done.way / plan.feed + sum(done.dwell_s)
        assert f"duration about {seconds / 60:.1f} min" in program
        if not warm_up:
            assert seconds == pytest.approx(evaluate_duration(plan).total_s, abs=2.0)


def test_an_axis_has_one_letter_that_fits_its_kind() -> None:
    for kind, good, bad in (("linear", "xZW", "CIF"), ("rotary", "Ab", "XE")):
        plan = plan_of(kind=AxisKind(kind))
        for letter in good:
            assert drive_linuxcnc(program_of(CONTROL, plan, axis=letter), letter.upper()).stops
        for name in (*bad, "X1", "XY", "X G0"):
            with refused("unknown_axis"):
                program_of(CONTROL, plan, axis=name)


# ---- tables -------------------------------------------------------------------------------------

LEVELS = AxisLevels(
    np.array([0.0, 100.0, 250.0]), np.array([[2.0, -2.0], [12.5, 8.5], [-31.0, -36.25]]), True
)


def table_of(levels: AxisLevels, position: np.ndarray, kind: AxisKind) -> CompensationTable:
    return compensation_table(levels, position, kind=kind, axis="X", reference_position=0.0)


def written(table: CompensationTable, *stated: str) -> str:
    return CONTROL.format_table(TableRequest(table=table, options=table_options(*stated))).text


def plain_rows(text: str) -> np.ndarray:
    assert text.endswith("\n")
    assert not text.endswith("\n\n")
    return np.array([[float(word) for word in line.split(" ")] for line in text[:-1].split("\n")])


def test_the_values_of_both_types_are_those_worked_out_by_hand() -> None:
    table = table_of(LEVELS, LEVELS.target, AxisKind.LINEAR)
    assert written(table) == (
        "0.000000 0.002000 -0.002000\n"
        "100.000000 100.012500 100.008500\n"
        "250.000000 249.969000 249.963750\n"
    )
    assert written(table, "type=1") == (
        "0.000000 -0.002000 0.002000\n"
        "100.000000 -0.012500 -0.008500\n"
        "250.000000 0.031000 0.036250\n"
    )
    inch = plain_rows(written(table, "type=1", "units=inch"))
    assert inch[2] == pytest.approx([250 / 25.4, 0.031 / 25.4, 0.03625 / 25.4], abs=0.51e-8)


def test_a_rotary_table_is_in_degrees_whatever_the_units_of_the_machine() -> None:
    table = table_of(LEVELS, LEVELS.target, AxisKind.ROTARY)
    assert written(table) == written(table, "units=inch")
    assert plain_rows(written(table))[1] == pytest.approx(
        [100.0, 100 + 12.5 / 3600, 100 + 8.5 / 3600], abs=0.51e-7
    )


def test_reversal_that_is_stated_apart_goes_into_the_two_columns() -> None:
    table = CompensationTable(
        kind=AxisKind.LINEAR,
        axis="X",
        position=np.array([0.0, 10.0]),
        deviation=np.zeros((2, 2)),
        backlash=-3.0,
    )
    assert plain_rows(written(table))[:, 1:] - [[0.0], [10.0]] == pytest.approx(
        np.array([[-0.0015, 0.0015], [-0.0015, 0.0015]])
    )


def test_the_summary_says_what_the_columns_hold_and_how_to_load() -> None:
    table = table_of(LEVELS, LEVELS.target, AxisKind.LINEAR)
    for kind, columns in (("0", "linuxcnc_positions"), ("1", "linuxcnc_trims")):
        options = table_options(f"type={kind}")
        said = advised(CONTROL.format_table(TableRequest(table=table, options=options)))
        assert columns in said
        assert said["linuxcnc_activation"] == {"type": kind}
        assert said["linuxcnc_rounding"]["digit"] == "0.000001"


def test_256_points_are_written_and_read_and_257_are_refused() -> None:
    position = np.arange(257) * 1.0
    table = CompensationTable(
        kind=AxisKind.LINEAR, axis="X", position=position, deviation=np.zeros((257, 2))
    )
    with refused("too_many_table_points"):
        written(table)
    text = "".join(f"{p} {p} {p}\n" for p in range(256))
    read = CONTROL.read_table(text, "x", AxisKind.LINEAR, table_options())
    assert read.table.position.size == 256
    with refused("too_many_rows", file="x", line=257, most=256):
        CONTROL.read_table(text + "256 256 256\n", "x", AxisKind.LINEAR, table_options())


def read(text: str, *stated: str) -> ReadTable:
    return CONTROL.read_table(text, "x", AxisKind.LINEAR, table_options(*stated))


def test_where_the_control_stops_without_a_word_the_reader_says_so() -> None:
    for text, line, points, left in (
        ("0 0 0\n1 1 1\n\n2 2 2\n3 3 3\n", 3, 2, 2),
        ("0 0 0\n# head\n2 2 2\n", 2, 1, 1),
        ("0 0 0\n1 1 1\n2 2\n3 3 3\n", 3, 2, 1),
        ("0 0 0\n1 1,5 1\n2 2 2\n", 2, 1, 1),
        ("0 0 0\n1 1 1\n \t\n2 2 2\n", 3, 2, 1),
    ):
        table = read(text)
        assert table.table.position.size == points
        assert table.points_in_file == points + left
        (one,) = table.findings
        assert one.place.line == line
        assert (one.values["points"], one.values["left"]) == (points, left)
        assert found(table) == ["reading_stops_at_comma" if "," in text else "reading_stops"]


def test_the_end_of_the_file_is_no_finding() -> None:
    for end in ("", "\n", "\r\n", "\n\n\n"):
        table = read("0 0 0\n1 1 1" + end)
        assert (table.findings, table.points_in_file) == ((), 2)


def test_what_the_control_would_refuse_or_misread_is_refused_with_its_line() -> None:
    for text, line, code in (
        ("", 1, "first_line_no_triplet"),
        ("nominal forward reverse\n0 0 0\n", 1, "first_line_no_triplet"),
        ("0,0 0,001 0,002\n", 1, "first_line_no_triplet"),
        ("0 0 0,002\n1 1 1\n", 1, "table_decimal_comma"),
        ("0 0 0\n0 0 0\n", 2, "position_not_rising"),
        ("0 0 0\n2 2 2\n1 1 1\n", 3, "position_not_rising"),
        ("0 0 nan\n", 1, "number_not_loadable"),
        ("0 0 0\n1 inf 1\n", 2, "number_not_loadable"),
        ("0 0 1e999\n", 1, "number_not_loadable"),
        ("0 0 0\n1 -1e308 1\n", 2, "number_not_loadable"),
        ("-1e308 0 0\n1 1 1\n", 1, "number_not_loadable"),
        ("0 0 1000000.1\n", 1, "number_not_loadable"),
        ("0 0 0\n1e-320 1 1\n", 2, "positions_too_near"),
        ("0 0 " + "0" * 300 + "\n", 1, "table_line_too_long"),
        ("\ufeff0 0 0\n1 1 1\n", 1, "byte_order_mark"),
        ("\xef\xbb\xbf0 0 0\n1 1 1\n", 1, "byte_order_mark"),
    ):
        with refused(code, file="x", line=line):
            read(text)


def pieces_of_the_control(text: str) -> list[str]:
    """Do what ``fgets`` does with 255 characters of room: 254 of the file, newline included."""
    return re.findall(r"[^\n]{0,253}\n|[^\n]{1,254}", text)


@pytest.mark.parametrize("length", [252, 253, 254, 255])
def test_a_line_may_be_as_long_as_the_control_reads_in_one_piece(length: int) -> None:
    for end in ("\n", "\r\n", ""):
        line = "1 1 1".ljust(length - len(end.rstrip("\n")))
        texts = [f"0 0 0\n{line}{end}"]
        if end:
            texts.append(f"{texts[0]}2 2 2\n")
        for text in texts:
            whole = len(pieces_of_the_control(text)) == text.count("\n") + (not end)
            assert whole == (length <= (253 if end else 254))
            if whole:
                table = read(text)
                assert 3 * table.table.position.size == len(text.split())
                assert table.findings == ()
            else:
                with refused("table_line_too_long"):
                    read(text)


def test_a_carriage_return_ends_no_line_and_what_is_passed_over_is_told() -> None:
    for text, positions, line, code in (
        ("0 0 0\r1 1 1\r2 2 2\r", [0.0], 1, "passed_over_by_return"),
        ("0 0 0\r\n1 1 1\r2 2 2\r\n3 3 3", [0.0, 1.0, 3.0], 2, "passed_over_by_return"),
        ("0 0 0\n1 1 1 7\n", [0.0, 1.0], 2, "passed_over"),
    ):
        table = read(text)
        assert table.table.position.tolist() == positions
        assert (found(table), table.findings[0].place.line) == ([code], line)
    with refused("line_ended_by_return"):
        read("0 0 0\r" * 60)


def test_a_table_that_is_read_as_the_other_type_is_refused() -> None:
    table = table_of(LEVELS, LEVELS.target, AxisKind.LINEAR)
    for type_, other in (("0", "1"), ("1", "0")):
        for units in ("mm", "inch"):
            text = written(table, f"type={type_}", f"units={units}")
            with refused("other_table_type", stated=other, other=type_):
                read(text, f"type={other}", f"units={units}")


def test_one_wrong_value_is_named_with_its_line_and_no_other() -> None:
    for place in range(12):
        rng = np.random.default_rng(place)
        position = (np.arange(12) * 18.0 + rng.uniform(-5, 5, 12)).round(1)
        rows = position[:, None] + np.column_stack(
            (np.zeros(12), 0.01 * np.sin(position / 30), 0.01 * np.cos(position / 30))
        )
        rows[place, 1 + place % 2] += 0.198
        table = read("".join(f"{p:.4f} {f:.4f} {r:.4f}\n" for p, f, r in rows.tolist()))
        (one,) = table.findings
        assert found(table) == ["value_off_neighbours"]
        side = ("forward", "reverse")[place % 2]
        assert (one.place.line, one.values["side"]) == (place + 1, side)


def test_a_smooth_table_and_small_scatter_raise_no_suspicion() -> None:
    rng = np.random.default_rng(1)
    position = np.arange(60) * 10.0
    for size in (0.0, 0.3, 3.0, 30.0):
        deviation = 20 * np.sin(position / 90)[:, None] + rng.normal(0, size, (60, 2))
        table = CompensationTable(
            kind=AxisKind.LINEAR, axis="X", position=position, deviation=deviation
        )
        got = read(written(table))
        assert got.findings == ()


@pytest.mark.parametrize(("ripple_um", "limit_um"), [(0.0, 10.0), (0.4, 10.0), (1.0, 20.0)])
def test_a_value_is_suspect_from_10_um_and_ten_typical_distances_on(
    ripple_um: float, limit_um: float
) -> None:
    """Deviations that alternate by plus and minus the ripple lie twice that off their line."""
    position = np.arange(40) * 10.0
    alternating = ripple_um * np.where(np.arange(40) % 2, -1.0, 1.0)
    for over_um in (-0.1, 0.1):
        deviation = np.stack((alternating, alternating), axis=1)
        deviation[20, 0] = limit_um + over_um - ripple_um  # its neighbours are at minus the ripple
        table = CompensationTable(
            kind=AxisKind.LINEAR, axis="X", position=position, deviation=deviation
        )
        got = read(written(table))
        assert [one.place.line for one in got.findings] == ([21] if over_um > 0 else [])


def test_the_largest_number_that_is_read_is_a_million() -> None:
    text = "-1000000 -1000000 -999999.999\n1000000 1000000 1e6\n"
    table = read(text, "units=inch")
    assert table.table.position.tolist() == [-25.4e6, 25.4e6]


@given(
    st.lists(
        st.tuples(*[st.sampled_from(["0", "1", "-1e308", "1e-320", "1e-9", "1e6", "-5e5"])] * 3),
        min_size=1,
        max_size=6,
    ),
    st.sampled_from(["0", "1"]),
)
@settings(max_examples=120, deadline=None)
def test_no_number_overflows_whatever_its_size(rows: list[tuple[str, ...]], type_: str) -> None:
    """Warnings of numpy are errors in the tests."""
    text = "".join(" ".join(row) + "\n" for row in rows)
    try:
        got = read(text, f"type={type_}")
    except MeasurementFileError:
        return
    assert bool(np.all(np.isfinite(CONTROL.correction(got.table, np.linspace(-2, 2, 9)))))


def test_numbers_are_taken_as_the_control_takes_them() -> None:
    """``sscanf`` needs no space between numbers and gives back nothing that it took."""
    table = read("-1.5-1.5+1e-3\n 2 2.\t.2e1\n")
    assert table.table.position.tolist() == [-1.5, 2.0]
    assert table.table.deviation[0] == pytest.approx([0.0, 1501.0])
    with refused("first_line_no_triplet"):
        read("1.5 2\n")


def test_a_huge_file_is_refused_and_a_long_one_is_read_at_once() -> None:
    long = "".join(f"{i} {i} {i}\n" for i in range(200_000))
    with refused("too_many_rows"):
        read(long)
    for text in ("1" * 4_000_000, "0 0 0\n" + "1" * 4_000_000, " " * 4_000_000):
        with refused("table_line_too_long"):
            read(text)
