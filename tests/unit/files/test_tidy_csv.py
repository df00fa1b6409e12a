import re
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from thermaxis.errors import MeasurementFileError, ThermaxisError
from thermaxis.files import format_tidy_csv, read_tidy_csv, write_tidy_csv
from thermaxis.positioning import BACKWARD, FORWARD, Cycle, PositioningTest, StartEnd, TimeSource
from thermaxis.quantities import AxisKind

TARGETS = (-50.0, 0.0, 25.5)


def deviation_of(i: int, cycle: int, approach: int) -> float:
    return round((i + 1) * 1.25 + cycle / 8 - approach * 2.5, 3)


def rows_of(form: str, words: tuple[str, str] = ("forward", "backward")) -> list[str]:
    """Rows of three targets, two cycles and two approaches, in the order of acquisition."""
    rows: list[str] = []
    for cycle in (1, 2):
        for approach in (FORWARD, BACKWARD):
            for i in (range(3), reversed(range(3)))[approach]:
                deviation = deviation_of(i, cycle, approach)
                rows.append(
                    form.format(
                        n=len(rows) + 1,
                        c=cycle,
                        r=2 * cycle - 1 + approach,
                        w=words[approach],
                        t=TARGETS[i],
                        d=deviation,
                        m=TARGETS[i] + deviation / 1000,
                        s=7.5 * len(rows),
                    )
                )
    return rows


def read(tmp_path: Path, *lines: str, encoding: str = "utf-8") -> PositioningTest:
    path = tmp_path / "run.csv"
    path.write_bytes("".join(f"{line}\n" for line in lines).encode(encoding))
    return read_tidy_csv(path)


def refused(tmp_path: Path, *lines: str) -> str:
    with pytest.raises(MeasurementFileError) as caught:
        read(tmp_path, *lines)
    assert str(tmp_path / "run.csv") in str(caught.value)
    assert caught.value.remedy
    return str(caught.value)


def assert_the_run(test: PositioningTest) -> None:
    assert test.kind is AxisKind.LINEAR
    np.testing.assert_array_equal(test.target, TARGETS)
    assert test.deviation.shape == (3, 2, 2)
    for i, j, a in np.ndindex(3, 2, 2):
        assert test.deviation[i, j, a] == pytest.approx(deviation_of(i, j + 1, a), abs=1e-11)


def with_last(row: str, cell: str) -> str:
    return f"{row.rpartition(',')[0]},{cell}"


HEADING = "cycle,direction,target_mm,deviation_um"
ROWS = rows_of("{c},{w},{t},{d}")


def test_the_plain_layout_is_read(tmp_path: Path) -> None:
    test = read(tmp_path, HEADING, *ROWS)
    assert_the_run(test)
    assert test.time_source is TimeSource.NONE
    assert test.remarks == ()


@pytest.mark.parametrize(
    ("heading", "form"),
    [
        ("deviation_um,target_mm,direction,cycle", "{d},{t},{w},{c}"),
        ("Cycle,Direction,Target (mm),Error (µm)", "{c},{w},{t},{d}"),
        ("CYCLE,approach,Target [mm],Deviation [um]", "{c},{w},{t},{d}"),
        ("Zyklus,Richtung,Soll [mm],Abweichung [μm]", "{c},{w},{t},{d}"),
        ("Zyklus,Anfahrrichtung,Sollposition [mm],Positionsabweichung [µm]", "{c},{w},{t},{d}"),
        ("cyklus,směr,poloha [mm],odchylka [µm]", "{c},{w},{t},{d}"),
        ("CYKLUS,SMER,Cílová poloha [mm],Úchylka polohy [um]", "{c},{w},{t},{d}"),
        ("Běh,požadovaná poloha (mm),naměřená poloha (mm)", "{r},{t},{m:.7f}"),
        ("cycle_number,direction,nominal position mm,measured_mm", "{c},{w},{t},{m:.7f}"),
        ("run,target_mm,deviation_um", "{r},{t},{d}"),
        ("run,direction,target_mm,deviation_um", "{c},{w},{t},{d}"),
        ("run,direction,target_mm,deviation_um", "{r},{w},{t},{d}"),
        ("cycle,run,target_mm,deviation_um", "{c},{r},{t},{d}"),
        ("cycle,direction,target_mm,deviation_nm", "{c},{w},{t},{d}e3"),
        ("cycle,direction,target_um,deviation_mm", "{c},{w},{t}e3,{d}e-3"),
        ("cycle,direction,target_m,measured_m", "{c},{w},{t}e-3,{m:.7f}e-3"),
    ],
)
def test_columns_may_have_any_order_names_and_units(
    tmp_path: Path, heading: str, form: str
) -> None:
    assert_the_run(read(tmp_path, heading, *rows_of(form)))


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_cells_are_separated_by_comma_semicolon_or_tab(tmp_path: Path, separator: str) -> None:
    lines = [line.replace(",", separator) for line in (HEADING, *ROWS)]
    assert_the_run(read(tmp_path, *lines))


@pytest.mark.parametrize("separator", [";", "\t"])
def test_a_decimal_comma_is_read_beside_semicolon_and_tab(tmp_path: Path, separator: str) -> None:
    lines = [line.replace(",", separator).replace(".", ",") for line in (HEADING, *ROWS)]
    assert_the_run(read(tmp_path, *lines))


def test_a_decimal_comma_between_commas_is_refused(tmp_path: Path) -> None:
    assert "line 2" in refused(tmp_path, HEADING, '1,forward,"0,5",1', *ROWS)


def test_decimal_points_and_commas_in_one_file_are_refused(tmp_path: Path) -> None:
    lines = [line.replace(",", ";") for line in (HEADING, *ROWS)]
    lines[4] = lines[4].replace(".", ",")
    message = refused(tmp_path, *lines)
    assert "line 5" in message
    assert "decimal comma" in message


@pytest.mark.parametrize(
    "words",
    [
        *(("fwd", "bwd"), ("UP", "Down"), ("+", "-"), ("↑", "↓"), ("hin", "zurück")),
        *(("vpřed", "vzad"), ("TAM", "ZPĚT"), ("nahoru", "dolů"), ("Vorwärts", "rueckwaerts")),
        *(("Forward", "reverse"), ("'+", "'-"), ("positive", "negative"), ("up", "\N{MINUS SIGN}")),
        ("hin", "zuru\N{COMBINING DIAERESIS}ck"),
    ],
)
def test_directions_have_many_words(tmp_path: Path, words: tuple[str, str]) -> None:
    assert_the_run(read(tmp_path, HEADING, *rows_of("{c},{w},{t},{d}", words)))


def test_an_unknown_direction_is_an_error_with_the_word(tmp_path: Path) -> None:
    message = refused(tmp_path, HEADING, *ROWS[:3], "1,sideways,0,1")
    assert "'sideways' is not a direction" in message
    assert "line 5, column direction" in message


@pytest.mark.parametrize(
    ("heading", "column"),
    [
        ("cycle,direction,target,deviation_um", "target"),
        ("cycle,direction,target_mm,deviation", "deviation"),
        ("cycle,direction,Target (furlong),deviation_um", "Target (furlong)"),
        ("cycle,direction,target_mm,deviation_arcsec", "deviation_arcsec"),
        ("cycle,direction,target_mm,measured_deg", "measured_deg"),
    ],
)
def test_a_column_without_a_fitting_unit_is_an_error_that_names_it(
    tmp_path: Path, heading: str, column: str
) -> None:
    assert f"line 1, column {column}:" in refused(tmp_path, heading, *ROWS)


@pytest.mark.parametrize(
    ("heading", "missing"),
    [
        ("cycle,direction,deviation_um,x", "target"),
        ("cycle,direction,target_mm,x", "deviations"),
        ("x,direction,target_mm,deviation_um", "cycle"),
        ("cycle,x,target_mm,deviation_um", "direction"),
    ],
)
def test_a_missing_column_is_an_error(tmp_path: Path, heading: str, missing: str) -> None:
    assert missing in refused(tmp_path, heading, *ROWS)


def test_two_columns_of_the_same_kind_are_an_error(tmp_path: Path) -> None:
    lines = [f"{line},0" for line in ROWS]
    assert "both look like the target" in refused(tmp_path, f"{HEADING},Target (mm)", *lines)


@pytest.mark.parametrize("word", ["nan", "inf", "abc", "1_0", "1e400", "0x10", "1,5e3", "--1", "²"])
@pytest.mark.parametrize("column", [0, 2, 3])
def test_what_is_no_number_is_an_error_with_line_and_column(
    tmp_path: Path, word: str, column: int
) -> None:
    cells = ROWS[4].split(",")
    cells[column] = f'"{word}"'
    message = refused(tmp_path, "# a comment", HEADING, *ROWS[:4], ",".join(cells), *ROWS[5:])
    assert f"line 7, column {HEADING.split(',')[column]}" in message


def test_an_empty_cell_is_a_missing_reading(tmp_path: Path) -> None:
    third = rows_of("3,{w},{t},{d}")[:6]
    gap = with_last(ROWS[0], "")
    test = read(tmp_path, HEADING, gap, *ROWS[1:], *third)
    assert np.isnan(test.deviation[0, 0, FORWARD])
    assert np.count_nonzero(np.isnan(test.deviation)) == 1


@pytest.mark.parametrize("column", [0, 1, 2])
def test_a_reading_without_target_cycle_or_direction_is_an_error(
    tmp_path: Path, column: int
) -> None:
    cells = ROWS[4].split(",")
    cells[column] = ""
    assert "line 6" in refused(tmp_path, HEADING, *ROWS[:4], ",".join(cells), *ROWS[5:])


@pytest.mark.parametrize("row", ["1,forward", "1,forward,0,1,5", '1,forward,"0,1', '1,f"o,0,1'])
def test_a_row_of_another_length_or_with_open_quotes_is_an_error(tmp_path: Path, row: str) -> None:
    assert "line 14" in refused(tmp_path, HEADING, *ROWS, row)


def test_empty_cells_at_the_end_of_rows_do_no_harm(tmp_path: Path) -> None:
    assert_the_run(read(tmp_path, f"{HEADING},,", *(f"{row},," for row in ROWS), ",,,,,", ""))


def test_a_text_in_quotes_may_hold_separators_and_line_ends(tmp_path: Path) -> None:
    rows = [f'{row},"a, ""b""\nc"' for row in ROWS]
    test = read(tmp_path, f'{HEADING},"my\nnote"', *rows)
    assert_the_run(test)
    assert "left out: 'my\nnote'" in test.remarks[0]


def test_a_reading_given_twice_is_an_error_that_names_both_lines(tmp_path: Path) -> None:
    message = refused(tmp_path, HEADING, *ROWS, ROWS[2])
    assert "line 4 and line 14" in message


def test_targets_that_differ_by_float_noise_are_one_target(tmp_path: Path) -> None:
    rows = [row.replace("25.5", "25.50000000000004") if "2," in row else row for row in ROWS]
    np.testing.assert_array_equal(read(tmp_path, HEADING, *rows).target, TARGETS)


def test_too_few_readings_are_an_error_that_names_the_target(tmp_path: Path) -> None:
    assert "target 3 (25.5 mm) has 1 reading forward" in refused(
        tmp_path, HEADING, *ROWS[:8], *ROWS[9:]
    )


def test_a_unidirectional_run_is_read(tmp_path: Path) -> None:
    rows = [row for row in ROWS if "forward" in row]
    test = read(tmp_path, HEADING, *rows)
    assert test.unidirectional
    assert test.measured_approaches == (True, False)


def test_run_numbers_alone_give_cycle_and_direction(tmp_path: Path) -> None:
    rows = [row for row in rows_of("{r},{t},{d}") if row[0] in "13"]
    test = read(tmp_path, "run,target_mm,deviation_um", *rows)
    assert test.measured_approaches == (True, False)
    assert test.deviation.shape == (3, 2, 2)
    assert any("odd runs are forward" in remark for remark in test.remarks)


@pytest.mark.parametrize("first", [1, 2])
@pytest.mark.parametrize("words", ["-+", "+-"])
def test_passes_that_alternate_are_paired_into_cycles(
    tmp_path: Path, words: str, first: int
) -> None:
    rows = [
        f"{first + k},{words[k % 2]},{t},{10 * k + t / 10}" for k in range(6) for t in (0, 5, 9)
    ]
    test = read(tmp_path, "run,direction,target_mm,deviation_um", *rows)
    if first == 2 and words == "-+":  # its partner, run 1, was not measured
        assert test.cycles == 4
        assert np.isnan(test.deviation[:, 0, FORWARD]).all()
        return
    assert test.deviation.shape == (3, 3, 2)
    for j in range(3):
        for k, word in enumerate(words):
            pass_ = test.deviation[:, j, "+-".index(word)]
            np.testing.assert_allclose(pass_, 10 * (2 * j + k) + np.array([0.0, 0.5, 0.9]))
    assert any(f"runs {first} and {first + 1} are cycle 1" in remark for remark in test.remarks)


def test_passes_that_do_not_alternate_stay_cycles_of_their_own(tmp_path: Path) -> None:
    rows = [f"{run},{'++--'[run - 1]},{t},{run}" for run in (1, 2, 3, 4) for t in (0, 5)]
    test = read(tmp_path, "run,direction,target_mm,deviation_um", *rows)
    assert test.cycles == 4
    assert any("do not alternate" in remark for remark in test.remarks)


def test_a_cycle_that_contradicts_the_run_is_an_error(tmp_path: Path) -> None:
    rows = rows_of("{c},{r},{t},{d}")
    rows[-1] = "1" + rows[-1][1:]
    assert "line 13" in refused(tmp_path, "cycle,run,target_mm,deviation_um", *rows)


def test_a_rotary_axis_has_degrees_and_seconds_of_arc(tmp_path: Path) -> None:
    rows = rows_of("{c},{w},{t},{d}")
    test = read(tmp_path, "cycle,direction,target_deg,deviation_arcsec", *rows)
    assert test.kind is AxisKind.ROTARY
    assert test.deviation[0, 0, FORWARD] == deviation_of(0, 1, FORWARD)


WRAPPED = (200.063, 341.222, 29.375, 169.72)
RISEN = (200.063, 341.222, 389.375, 529.72)


def turning(targets: tuple[float, ...], *, timed: bool = False, words: str = "+-") -> list[str]:
    """Rows of two cycles along targets and back; the deviation tells which target it was."""
    rows = ["cycle,direction,target_deg,deviation_arcsec" + ",time_s" * timed]
    for cycle in (1, 2):
        for word in words:
            for k in range(len(targets))[:: 1 if word == "+" else -1]:
                end = f",{len(rows)}" if timed else ""
                rows.append(f"{cycle},{word},{targets[k]},{k + cycle / 8}{end}")
    return rows


@pytest.mark.parametrize("timed", [False, True])
@pytest.mark.parametrize("words", ["+-", "+", "-"])
def test_targets_rise_through_a_full_turn(tmp_path: Path, words: str, *, timed: bool) -> None:
    heading, *rows = turning(WRAPPED, timed=timed, words=words)
    test = read(tmp_path, heading, *(reversed(rows) if timed else rows))
    np.testing.assert_array_equal(test.target, RISEN)
    for approach in (FORWARD, BACKWARD):
        if test.measured_approaches[approach]:
            np.testing.assert_array_equal(test.deviation[:, 0, approach], np.arange(4) + 1 / 8)
    assert any("(29.375° is 389.375°)" in remark for remark in test.remarks)


def test_a_run_through_a_full_turn_comes_back_from_its_own_file(tmp_path: Path) -> None:
    test = read(tmp_path, *turning(WRAPPED))
    again = read(tmp_path, *format_tidy_csv(test).splitlines())
    np.testing.assert_array_equal(again.target, RISEN)
    assert again.remarks == test.remarks


@pytest.mark.parametrize(
    "targets",
    [
        (0.0, 90.0, 180.0, 270.0),  # no jump
        (270.0, 180.0, 90.0, 0.0),  # falls throughout
        (200.0, 100.0),
        (0.0, 200.0, 50.0, 300.0),  # a turn does not make it rise
        (0.0, 90.0, 400.0, 700.0),  # more than one turn is stated
        (300.0, 400.0, 20.0, 60.0, -100.0),
    ],
)
def test_other_rotary_targets_stay_as_they_are(tmp_path: Path, targets: tuple[float, ...]) -> None:
    test = read(tmp_path, *turning(targets))
    np.testing.assert_array_equal(test.target, sorted(targets))
    assert not any("turn" in remark for remark in test.remarks)


def test_targets_of_a_linear_axis_pass_no_full_turn(tmp_path: Path) -> None:
    lines = turning(WRAPPED)
    test = read(tmp_path, "cycle,direction,target_mm,deviation_um", *lines[1:])
    np.testing.assert_array_equal(test.target, sorted(WRAPPED))


def test_passes_that_begin_elsewhere_add_no_turn(tmp_path: Path) -> None:
    lines = turning(WRAPPED)
    second = [k for k, line in enumerate(lines) if line.startswith("2,+")]
    lines[second[0]], lines[second[2]] = lines[second[2]], lines[second[0]]
    test = read(tmp_path, *lines)
    np.testing.assert_array_equal(test.target, sorted(WRAPPED))


def test_rows_against_their_direction_are_told_where_no_order_is_stated(tmp_path: Path) -> None:
    def said(*rows: str) -> bool:
        return any("run downwards" in remark for remark in read(tmp_path, HEADING, *rows).remarks)

    swapped = rows_of("{c},{w},{t},{d}", words=("backward", "forward"))
    assert said(*swapped)
    assert said(*[row for row in swapped if "forward" in row])
    assert not said(*ROWS)
    by_target = sorted(ROWS, key=lambda row: float(row.split(",")[2]))
    assert not said(*by_target)
    assert not said(*reversed(by_target))


def test_a_full_turn_is_taken_off_measured_angles(tmp_path: Path) -> None:
    rows = [
        f"{c},{w},{t},{m}" for c in (1, 2) for w in "+-" for t, m in ((0, 359.999), (360, 0.001))
    ]
    test = read(tmp_path, "cycle,direction,target_deg,measured_deg", *rows)
    np.testing.assert_allclose(test.deviation[0], -3.6, atol=1e-9)
    np.testing.assert_allclose(test.deviation[1], 3.6, atol=1e-9)
    assert any("whole turns" in remark for remark in test.remarks)


def test_measured_minus_target_has_no_float_noise(tmp_path: Path) -> None:
    test = read(tmp_path, "cycle,direction,target_mm,measured_mm", *rows_of("{c},{w},{t},{m:.6f}"))
    assert test.deviation[2, 1, BACKWARD] == deviation_of(2, 2, BACKWARD)


def test_measured_wins_and_the_first_disagreement_is_named(tmp_path: Path) -> None:
    heading = f"{HEADING},measured_mm"
    rows = rows_of("{c},{w},{t},{d},{m:.6f}")
    assert read(tmp_path, heading, *rows).remarks == ()
    rows[3] = rows[3].replace(f",{deviation_of(2, 1, BACKWARD)},", ",3.14,")
    test = read(tmp_path, heading, *rows)
    assert test.deviation[2, 0, BACKWARD] == deviation_of(2, 1, BACKWARD)
    assert len(test.remarks) == 1
    assert "1 readings, first in line 5 (3.14 and" in test.remarks[0]


def test_a_deviation_rounded_in_its_last_digit_agrees(tmp_path: Path) -> None:
    rows = rows_of("{c},{w},{t},{d:.1f},{m:.6f}")
    assert read(tmp_path, f"{HEADING},measured_mm", *rows).remarks == ()


def test_unknown_columns_of_numbers_become_channels_and_words_are_left_out(tmp_path: Path) -> None:
    rows = [f"{row},{20 + k / 4},ok,{k}" for k, row in enumerate(ROWS)]
    test = read(tmp_path, f"{HEADING},motor,state,count", *rows)
    assert set(test.channels) == {"motor", "count"}
    assert test.channels["motor"][0, 0, FORWARD] == 20.0
    assert test.remarks == (
        "kept as channels without unit: 'motor', 'count'",
        "columns without numbers were left out: 'state'",
    )


def test_channels_with_the_same_or_no_name_are_told_apart(tmp_path: Path) -> None:
    rows = [f"1,{row},2,3" for row in ROWS]
    test = read(tmp_path, f",{HEADING},t,t", *rows)
    assert set(test.channels) == {"column 1", "t", "t (2)"}
    assert test.channels["t (2)"][0, 0, 0] == 3


def test_order_alone_gives_the_acquisition_order(tmp_path: Path) -> None:
    test = read(tmp_path, f"order,{HEADING}", *rows_of("{n},{c},{w},{t},{d}"))
    assert test.time_source is TimeSource.ORDER
    assert not test.order_deduced
    assert test.order is not None
    assert test.order[2, 0, BACKWARD] == 4


def test_order_numbers_from_zero_are_counted_anew(tmp_path: Path) -> None:
    rows = [f"{k},{row}" for k, row in enumerate(ROWS)]
    test = read(tmp_path, f"order,{HEADING}", *rows)
    assert test.order is not None
    assert test.order.min() == 1
    assert any("counted anew" in remark for remark in test.remarks)


def test_the_same_order_number_twice_is_an_error(tmp_path: Path) -> None:
    rows = [f"{min(k, 5)},{row}" for k, row in enumerate(ROWS, start=1)]
    assert "line 6 and line 7" in refused(tmp_path, f"order,{HEADING}", *rows)


@pytest.mark.parametrize(
    ("name", "factor"), [("time_s", 1), ("time (min)", 60), ("time_ms", 0.001)]
)
def test_times_as_numbers_count_from_the_first_reading(
    tmp_path: Path, name: str, factor: float
) -> None:
    rows = rows_of("{c},{w},{t},{d},{s}")
    shifted = [with_last(row, str(float(row.rpartition(",")[2]) + 100)) for row in reversed(rows)]
    test = read(tmp_path, f"{HEADING},{name}", *shifted)
    assert test.time_source is TimeSource.FILE
    assert test.time_s is not None
    assert test.order is not None
    assert test.time_s[0, 0, FORWARD] == 0.0
    assert test.time_s[1, 0, FORWARD] == pytest.approx(7.5 * factor)
    assert test.order[0, 1, BACKWARD] == 12


def timed(*, zone: str = "", step_s: float = 7.5, form: str = "{c},{w},{t},{d}") -> list[str]:
    begin = datetime(2026, 3, 2, 8, 0)  # noqa: DTZ001  local time
    moments = [begin + timedelta(seconds=step_s * k) for k in range(12)]
    return [f"{row},{at.isoformat()}{zone}" for row, at in zip(rows_of(form), moments, strict=True)]


def test_times_of_day_give_start_and_end(tmp_path: Path) -> None:
    test = read(tmp_path, f"{HEADING},time", *timed())
    assert test.time_source is TimeSource.FILE
    assert test.start == datetime(2026, 3, 2, 8, 0)  # noqa: DTZ001  local time
    assert test.end == datetime(2026, 3, 2, 8, 1, 22, 500_000)  # noqa: DTZ001  no zone in the file
    assert test.time_s is not None
    assert test.time_s[0, 1, BACKWARD] == 82.5


def test_times_may_have_the_day_first_with_points(tmp_path: Path) -> None:
    rows = [f"2.3.2026 8:00:{k:02d},5," + row for k, row in enumerate(ROWS)]
    rows = [row.replace(",", ";").replace(";5;", ",5;", 1) for row in rows]
    test = read(tmp_path, f"Zeit,{HEADING}".replace(",", ";"), *rows)
    assert test.time_source is TimeSource.FILE
    assert test.start == datetime(2026, 3, 2, 8, 0, 0, 500_000)  # noqa: DTZ001  none is stated
    assert test.time_s is not None
    assert test.time_s[0, 0, FORWARD] == 0.0


def test_times_may_state_a_zone(tmp_path: Path) -> None:
    test = read(tmp_path, f"{HEADING},time", *timed(zone="Z"))
    assert test.start == datetime(2026, 3, 2, 8, 0, tzinfo=UTC)


def test_times_with_and_without_zone_are_an_error(tmp_path: Path) -> None:
    rows = timed(zone="Z")
    rows[5] = rows[5].removesuffix("Z")
    assert "line 7, column time" in refused(tmp_path, f"{HEADING},time", *rows)


@pytest.mark.parametrize("word", ["12:30", "yesterday", "2026-13-01T00:00", "0001-01-01", "17.5"])
def test_what_is_no_time_is_an_error(tmp_path: Path, word: str) -> None:
    rows = timed()
    rows[5] = with_last(rows[5], word)
    assert f"'{word}' is not a date with time" in refused(tmp_path, f"{HEADING},time", *rows)


def test_a_reading_without_time_leaves_the_run_without_times(tmp_path: Path) -> None:
    rows = timed()
    rows[5] = with_last(rows[5], "")
    test = read(tmp_path, f"{HEADING},time", *rows)
    assert test.time_source is TimeSource.NONE
    assert test.start is not None
    assert "some readings have no time" in test.remarks[0]


def test_times_that_do_not_rise_with_the_order_are_not_used(tmp_path: Path) -> None:
    rows = timed(form="{n},{c},{w},{t},{d}")
    rows[5], rows[6] = (re.sub(r"^\d+", str(k), rows[j]) for j, k in ((5, 7), (6, 6)))
    test = read(tmp_path, f"order,{HEADING},time", *rows)
    assert test.time_source is TimeSource.ORDER
    assert test.time_s is None
    assert "the run has no time axis" in test.remarks[0]


def test_equal_times_leave_the_order_of_the_rows_if_they_rise(tmp_path: Path) -> None:
    test = read(tmp_path, f"{HEADING},time", *timed(step_s=0.0))
    assert test.time_source is TimeSource.ORDER
    assert test.order is not None
    assert test.order[2, 0, BACKWARD] == 4
    mixed = timed()
    mixed[5] = with_last(mixed[5], mixed[0].rpartition(",")[2])
    assert read(tmp_path, f"{HEADING},time", *mixed).time_source is TimeSource.NONE


def test_a_date_goes_before_a_column_of_seconds(tmp_path: Path) -> None:
    rows = [f"{row},{k}" for k, row in enumerate(timed())]
    test = read(tmp_path, f"{HEADING},time,time_s", *rows)
    assert test.time_s is not None
    assert test.time_s.max() == 82.5
    assert set(test.channels) == {"time_s"}


def test_lines_above_the_headings_become_the_header(tmp_path: Path) -> None:
    above = ["Machine: MCV 750; built 2009", "Serial No,12-345", "", "Axis Name:,X", "CARTO export"]
    test = read(tmp_path, *above, HEADING, *ROWS)
    assert_the_run(test)
    assert dict(test.header) == {
        "machine": "MCV 750; built 2009",
        "serial_number": "12-345",
        "axis": "X",
        "title": "CARTO export",
    }


def test_units_may_stand_in_a_second_row_of_headings(tmp_path: Path) -> None:
    heading = "Cycle,Direction,Target,Error"
    assert_the_run(read(tmp_path, heading, ",,(mm),[µm]", *ROWS))
    message = refused(tmp_path, heading, ",,mm,furlong", *ROWS)
    assert "no unit is stated in the heading 'Target'" in message


def test_headings_may_stand_in_a_comment(tmp_path: Path) -> None:
    assert_the_run(read(tmp_path, "# columns: target, direction", f"# {HEADING}", *ROWS))
    numbered = [f"{k},{row}" for k, row in enumerate(ROWS)]
    assert_the_run(read(tmp_path, f"#,{HEADING}", *numbered))
    assert_the_run(read(tmp_path, f"# {HEADING}", HEADING, *ROWS))


def test_a_line_for_spreadsheet_programs_names_the_separator(tmp_path: Path) -> None:
    test = read(tmp_path, "sep=,", HEADING, *ROWS)
    assert_the_run(test)
    assert not test.header


def test_comments_may_stand_anywhere(tmp_path: Path) -> None:
    comments = ("# end: 2026-03-02T09:00", '"# quoted: a, b",,,')
    values = "#environment air_temperature_c: 20.5 none"
    above = ("# operator: JN", "#")
    test = read(
        tmp_path, *above, HEADING, *ROWS[:5], "# Cycle: pilgrim", *ROWS[5:], values, *comments
    )
    assert dict(test.header) == {"inspector": "JN", "quoted": "a, b"}
    assert test.environment["air_temperature_c"] == StartEnd(20.5, None)
    assert test.end == datetime(2026, 3, 2, 9, 0)  # noqa: DTZ001  local time
    assert test.cycle is Cycle.PILGRIM


@pytest.mark.parametrize(
    "comment",
    [
        "# environment a: 1",
        "# environment a: 1 x",
        "# start: today",
        "# start: 2026-03-02T09:00Z\n# end: 2026-03-02T10:00",
        "# start: 2026-03-02T09:00\n# end: 2026-03-02T08:00",
        "# kind: rotary",
    ],
)
def test_a_comment_that_cannot_be_meant_is_an_error(tmp_path: Path, comment: str) -> None:
    refused(tmp_path, comment, HEADING, *ROWS)


def test_headings_are_found_within_a_hundred_lines(tmp_path: Path) -> None:
    assert_the_run(read(tmp_path, *["text"] * 99, HEADING, *ROWS))
    assert "no column headings" in refused(tmp_path, *["text"] * 100, HEADING, *ROWS)


def test_headings_that_are_not_understood_are_named(tmp_path: Path) -> None:
    message = refused(tmp_path, "Protokoll 7", "cycle;sens;cible;écart", "1;avant;0;1")
    assert "line 2" in message
    assert "'cycle', 'sens', 'cible', 'écart'" in message
    assert "lacks target; deviation or measured; direction or run" in message
    assert "'x'" in refused(tmp_path, "x")
    message = refused(tmp_path, "cycle;direction;target_mm;écart (µm)", "1;+;0;1")
    assert "not understood: 'écart (µm)'" in message


def test_the_column_with_a_unit_goes_before_one_without(tmp_path: Path) -> None:
    rows = [f"{row},7" for row in ROWS]
    test = read(tmp_path, f"{HEADING},Fehler", *rows)
    assert_the_run(test)
    assert list(test.channels) == ["Fehler"]


def test_the_minus_sign_of_typesetting_is_a_minus(tmp_path: Path) -> None:
    assert_the_run(read(tmp_path, HEADING, *[row.replace("-", "\N{MINUS SIGN}") for row in ROWS]))


def test_headings_without_rows_are_an_error(tmp_path: Path) -> None:
    assert "no readings below" in refused(tmp_path, HEADING)
    assert "no readings" in refused(tmp_path, HEADING, "1,forward,0,")


def test_a_file_cut_short_inside_its_last_number_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    rows = rows_of("{c},{w},{t},{d:.3f}")
    path.write_text("\n".join([HEADING, *rows])[:-2], encoding="utf-8")
    with pytest.raises(MeasurementFileError, match=r"line 13, column deviation_um: .* cut short"):
        read_tidy_csv(path)
    path.write_text("\n".join([HEADING, *rows]), encoding="utf-8")
    test = read_tidy_csv(path)
    assert_the_run(test)
    assert "no line end" in test.remarks[0]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1250"])
def test_encodings_of_other_programs_are_read(tmp_path: Path, encoding: str) -> None:
    test = read(tmp_path, "# location: Plzeň", HEADING, *ROWS, encoding=encoding)
    assert_the_run(test)
    assert test.header["location"] == "Plzeň"
    assert bool(test.remarks) == (encoding == "cp1250")


def test_a_wide_table_is_not_read_as_a_tidy_one(tmp_path: Path) -> None:
    assert "wide" in refused(tmp_path, "target_mm,1,2", "0,1,2")


def test_hostile_texts_are_written_so_that_no_spreadsheet_program_obeys(tmp_path: Path) -> None:
    test = PositioningTest(
        AxisKind.LINEAR,
        np.array([0.0, 1.0]),
        np.zeros((2, 2, 2)),
        channels={"=cmd|' /C calc'!A0": np.ones((2, 2, 2)), "a,b": np.ones((2, 2, 2))},
        header={"title": "x,=1+2", "note": "line\n=3", "@": "-"},
    )
    text = format_tidy_csv(test)
    assert "\"'=cmd" in text or ",'=cmd" in text
    assert not re.search(r"(?m)(?:^|[,;\t])\s*\"?[=+@-]", text.replace(",-", ","))
    path = tmp_path / "run.csv"
    write_tidy_csv(test, path)
    again = read_tidy_csv(path)
    assert dict(again.header) == dict(test.header)
    assert set(again.channels) == set(test.channels)


def test_missing_readings_keep_their_row_and_unmeasured_approaches_get_none() -> None:
    deviation = np.zeros((2, 3, 2))
    deviation[0, 1, FORWARD] = np.nan
    deviation[..., BACKWARD] = np.nan
    text = format_tidy_csv(PositioningTest(AxisKind.LINEAR, np.array([0.0, 1.0]), deviation))
    assert "2,forward,0,\n" in text
    assert text.count("forward") == 6
    assert "backward" not in text


def test_rows_are_written_in_the_order_of_acquisition() -> None:
    order = np.arange(8.0).reshape(2, 2, 2)[::-1] + 1
    test = PositioningTest(
        AxisKind.LINEAR, np.array([0.0, 1.0]), np.zeros((2, 2, 2)), TimeSource.ORDER, order=order
    )
    body = [line for line in format_tidy_csv(test).splitlines() if not line.startswith("#")]
    assert [line.split(",")[0] for line in body[1:]] == [str(k) for k in range(1, 9)]


def test_a_file_that_cannot_be_written_is_an_error_of_our_own(tmp_path: Path) -> None:
    test = PositioningTest(AxisKind.LINEAR, np.array([0.0, 1.0]), np.zeros((2, 2, 2)))
    for path in (tmp_path, tmp_path / "no" / "folder.csv", "a\0b"):
        with pytest.raises(ThermaxisError, match="cannot be written"):
            write_tidy_csv(test, path)


@pytest.mark.real_data
def test_a_real_run_with_times_is_read_as_it_is(real_data: Path) -> None:
    test = read_tidy_csv(real_data / "positioning/ess_target_b02_x/x_positioning_with_times.csv")
    assert test.deviation.shape == (9, 5, 2)
    assert test.deviation[0, 0, FORWARD] == -49.226
    assert test.time_source is TimeSource.FILE
    assert test.start == datetime(2022, 4, 6, 12, 48, 40, 1708)  # noqa: DTZ001  local time
    assert test.end == datetime(2022, 4, 6, 13, 29, 14, 553787)  # noqa: DTZ001  no zone in the file
    assert test.time_s is not None
    assert test.time_s.max() == pytest.approx(40.58 * 60, abs=1)
    assert test.remarks == ()


def test_a_complete_file_without_last_line_end_is_told_its_way_out(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    text = "\n".join([HEADING, *rows_of("{c},{w},{t},{d:.3f}")])[:-2]
    path.write_text(text, encoding="utf-8")
    with pytest.raises(MeasurementFileError, match="add an empty line at the end"):
        read_tidy_csv(path)
    path.write_text(text + "\n", encoding="utf-8")
    assert read_tidy_csv(path).target.size == 3


def test_readings_with_a_deviation_only_beside_measured_ones_are_told(tmp_path: Path) -> None:
    heading = "cycle,direction,target_mm,measured_mm,deviation_um"
    rows = rows_of("{c},{w},{t},{m:.6f},{d}")
    alone = rows_of("{c},{w},{t},,{d}")
    test = read(tmp_path, heading, *rows[:4], *alone[4:6], *rows[6:])
    assert_the_run(test)
    (said,) = test.remarks
    assert said.startswith("2 readings have no measured position, first in line 6:")
    assert read(tmp_path, heading, *alone).remarks == ()
