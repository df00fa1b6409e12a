import re
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from tests.refusals import check_refusals, refusal_of
from tests.unit.files.builders import remarks_of
from thermaxis.files import format_tidy_csv, read_positioning
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
    return read_positioning(path)


def refusal(tmp_path: Path, *lines: str) -> str:
    path = tmp_path / "run.csv"
    path.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    return refusal_of(read_positioning, path)


def assert_the_run(test: PositioningTest) -> None:
    assert test.kind is AxisKind.LINEAR
    np.testing.assert_array_equal(test.target, TARGETS)
    assert test.deviation.shape == (3, 2, 2)
    for i, j, a in np.ndindex(3, 2, 2):
        assert test.deviation[i, j, a] == pytest.approx(deviation_of(i, j + 1, a), abs=1e-11)


def with_last(row: str, cell: str) -> str:
    return f"{row.rpartition(',')[0]},{cell}"


def timed(*, zone: str = "", step_s: float = 7.5, form: str = "{c},{w},{t},{d}") -> list[str]:
    begin = datetime(2026, 3, 2, 8, 0)  # noqa: DTZ001  local time
    moments = [begin + timedelta(seconds=step_s * k) for k in range(12)]
    return [f"{row},{at.isoformat()}{zone}" for row, at in zip(rows_of(form), moments, strict=True)]


def changed(rows: list[str], index: int, column: int, cell: str) -> list[str]:
    cells = rows[index].split(",")
    cells[column] = cell
    return [*rows[:index], ",".join(cells), *rows[index + 1 :]]


HEADING = "cycle,direction,target_mm,deviation_um"
ROWS = rows_of("{c},{w},{t},{d}")
PLAIN = [HEADING, *ROWS]
RUNS = rows_of("{c},{r},{t},{d}")
SEMICOLONS = [line.replace(",", ";") for line in PLAIN]

FORMS = [
    *((HEADING, "{c},{w},{t},{d}"), ("deviation_um,target_mm,direction,cycle", "{d},{t},{w},{c}")),
    ("Cycle,Direction,Target (mm),Error (µm)", "{c},{w},{t},{d}"),
    ("Zyklus,Anfahrrichtung,Soll [mm],Positionsabweichung [μm]", "{c},{w},{t},{d}"),
    ("CYKLUS,SMER,Cílová poloha [mm],Úchylka polohy [um]", "{c},{w},{t},{d}"),
    ("Běh,požadovaná poloha (mm),naměřená poloha (mm)", "{r},{t},{m:.7f}"),
    ("run,direction,target_mm,deviation_um", "{c},{w},{t},{d}"),
    ("run,direction,target_mm,deviation_um", "{r},{w},{t},{d}"),
    ("cycle,run,target_mm,deviation_um", "{c},{r},{t},{d}"),
    ("cycle,direction,target_um,deviation_mm", "{c},{w},{t}e3,{d}e-3"),
    ("cycle,direction,target_m,measured_m", "{c},{w},{t}e-3,{m:.7f}e-3"),
]
DIRECTIONS = [
    *(("UP", "reverse"), ("↑", "↓"), ("hin", "zurück"), ("vpřed", "ZPĚT"), ("'+", "'-")),
    *(("up", "\N{MINUS SIGN}"), ("hin", "zuru\N{COMBINING DIAERESIS}ck")),
]


@pytest.mark.parametrize(
    "lines",
    [
        *([heading, *rows_of(form)] for heading, form in FORMS),
        *([HEADING, *rows_of("{c},{w},{t},{d}", words)] for words in DIRECTIONS),
        SEMICOLONS,
        [line.replace(".", ",") for line in SEMICOLONS],
        [line.replace(".", ",").replace(";", "\t") for line in SEMICOLONS],
        [f"{HEADING},,", *(f"{row},," for row in ROWS), ",,,,,", ""],
        ["Cycle,Direction,Target,Error", ",,(mm),[µm]", *ROWS],
        ["# columns: target, direction", f"# {HEADING}", *ROWS],
        [f"#,{HEADING}", *(f"{k},{row}" for k, row in enumerate(ROWS))],
        [f"# {HEADING}", *PLAIN],
        ["sep=,", *PLAIN],
        [*["text"] * 99, *PLAIN],
        [row.replace("-", "\N{MINUS SIGN}") for row in PLAIN],
        [row.replace("25.5", "25.50000000000004") if "2," in row else row for row in PLAIN],
    ],
)
def test_the_run_is_read_from_every_form_of_table(tmp_path: Path, lines: list[str]) -> None:
    test = read(tmp_path, *lines)
    assert_the_run(test)
    assert test.time_source is TimeSource.NONE


def test_what_is_done_with_other_columns_is_said(tmp_path: Path) -> None:
    kept, left = "kept as channels without unit: ", "columns without numbers were left out: "
    cases: list[tuple[str, str, tuple[str, ...], set[str]]] = [
        (f"{HEADING},measured_mm", "{c},{w},{t},{d:.1f},{m:.6f}", (), set()),
        (f'{HEADING},"my\nnote"', '{c},{w},{t},{d},"a, ""b""\nc"', (left + r"'my\nnote'",), set()),
        (
            f"{HEADING},motor,state,count",
            "{c},{w},{t},{d},{s},ok,{n}",
            (kept + "'motor', 'count'", left + "'state'"),
            {"motor", "count"},
        ),
        (
            f",{HEADING},t,t",
            "1,{c},{w},{t},{d},2,3",
            (kept + "'column 1', 't', 't (2)'",),
            {"column 1", "t", "t (2)"},
        ),
        # no unit: not the deviation
        (f"{HEADING},Fehler", "{c},{w},{t},{d},7", (kept + "'Fehler'",), {"Fehler"}),
    ]
    for heading, form, remarks, channels in cases:
        test = read(tmp_path, heading, *rows_of(form))
        assert_the_run(test)
        assert remarks_of(test) == remarks
        assert set(test.channels) == channels
        for k, name in enumerate(("column 1", "t", "t (2)"), start=1):
            assert name not in channels or test.channels[name][0, 0, 0] == k


def table(rows: list[str], heading: str = HEADING, above: str = "") -> str:
    return "".join(f"{line}\n" for line in (*above.split("|"), heading, *rows) if line)


def test_what_cannot_be_meant_is_refused_with_its_place(tmp_path: Path) -> None:
    semicolons = [*SEMICOLONS[1:4], SEMICOLONS[4].replace(".", ","), *SEMICOLONS[5:]]
    wrong = {
        table(['1,forward,"0,5",1', *ROWS]): "line 2, column target_mm: decimal_signs_mixed",
        table(semicolons, SEMICOLONS[0]): "line 5, column target_mm: decimal_signs_mixed",
        table([*ROWS[:3], "1,sideways,0,1"]): "line 5, column direction: not_a_direction",
        table(changed(ROWS, 4, 0, "")): "line 6, column cycle: row_incomplete",
        table(changed(ROWS, 4, 1, "")): "line 6, column direction: not_a_direction",
        table(changed(ROWS, 4, 2, "")): "line 6, column target_mm: row_incomplete",
        table([*ROWS, "1,forward"]): "line 14: cells_and_headings",
        table([*ROWS, "1,forward,0,1,5"]): "line 14: cells_and_headings",
        table([*ROWS, '1,forward,"0,1']): "line 14: quotation_marks",
        table([*ROWS, '1,f"o,0,1']): "line 14, column direction: not_a_direction",
        table([*ROWS, ROWS[1]]): "line 14: reading_twice",
        table([*ROWS, "0,+,0,1"]): "line 14: cycle_below_one",
        table([*ROWS, "1000000000,+,0,1"]): "line 14: table_too_sparse",
        table([f"{c},+,0,1" for c in (1, 2)]): "one_target",
        table([f"{c},+,{t},1" for t in range(10_001) for c in (1, 2)]): "too_many_targets",
        table(["1,+,0,1", "2,+,0,1", "1,-,9,1", "2,-,9,1"]): "too_few_readings_of_target",
        table(["1,+,0,1", "1,+,2000,1"]): "one_cycle",
        table(["1,+,0,1", "1,+,2500,1", "1,-,0,1"]): "too_few_readings_of_target",
        table(["1,forward,0,"]): "line 1: no_readings_in_file",
        table([]): "line 1: no_readings_in_file",
        table(ROWS, above="|".join(["text"] * 100)): "line 1: run_headings_incomplete",
        table(ROWS, above="# environment a: 1"): "line 1: not_start_and_end",
        table(ROWS, above="# environment a: 1 x"): "line 1: not_a_number",
        table(ROWS, above="# start: today"): "line 1, column start: not_a_moment",
        table(
            ROWS, above="# start: 2026-03-02T09:00|# end: 2026-03-02T08:00"
        ): "line 3: end_before_start",
        table(ROWS, above="# kind: rotary"): "line 2, column target_mm: kind_and_unit_disagree",
        "Protokoll 7\ncycle;sentido;cota;desvío\n1;ida;0;1\n": "line 2: run_headings_incomplete",
        "x\n": "line 1: run_headings_incomplete",
    }
    many = [f"{c},+,{t},1" + ",7" * 4000 for c in (1, 5000) for t in "01"]
    wrong[table(many, HEADING + ",t" * 4000)] = "too_many_channels"
    rotary = HEADING.replace("mm", "deg").replace("um", "arcsec")
    wrong[table(["1,+,0,1", "1,+,2500,1"], rotary)] = "one_cycle"
    check_refusals(read_positioning, tmp_path / "run.csv", wrong)


def test_headings_that_do_not_make_a_run_are_refused_with_their_column(tmp_path: Path) -> None:
    heading = "cycle,direction,target_mm,deviation_um"
    wrong = {
        heading.replace("_mm", ""): "line 1, column target: unit_not_stated",
        heading.replace("_um", ""): "line 1, column deviation: unit_not_stated",
        heading.replace(
            "_mm", " (furlong)"
        ): "line 1, column target (furlong): unknown_length_or_angle",
        heading.replace("um", "arcsec"): "line 1, column deviation_arcsec: unit_of_other_kind",
        heading.replace("deviation_um", "measured_deg"): (
            "line 1, column measured_deg: unit_of_other_kind"
        ),
        "cycle,direction,deviation_um,x": "line 1: no_target_column",
        "cycle,direction,target_mm,x": "line 1: no_deviation_column",
        "x,direction,target_mm,deviation_um": "line 1: no_cycle_column",
        "cycle,x,target_mm,deviation_um": "line 1: no_direction_column",
    }
    wrong = {table(ROWS, names): said for names, said in wrong.items()}
    twice = table([f"{row},0" for row in ROWS], f"{HEADING},Target (mm)")
    wrong[twice] = "line 1, column Target (mm): two_columns_of_a_role"
    units = table([",,mm,furlong", *ROWS], "Cycle,Direction,Target,Error")
    wrong[units] = "line 2, column Error: unknown_length_or_angle"
    check_refusals(read_positioning, tmp_path / "run.csv", wrong)


def test_runs_order_and_times_that_contradict_are_refused_with_their_line(tmp_path: Path) -> None:
    time = f"{HEADING},time"
    zoned = timed(zone="Z")
    order = [f"{min(k, 5)},{row}" for k, row in enumerate(ROWS, start=1)]
    words = ("12:30", "yesterday", "2026-13-01T00:00", "0001-01-01", "17.5")
    wrong = {
        table(changed(RUNS, 11, 0, "1"), "cycle,run,target_mm,deviation_um"): (
            "line 13, column cycle: cycle_and_run_disagree"
        ),
        table(order, f"order,{HEADING}"): "line 7: order_number_twice",
        table([*zoned[:5], timed()[5], *zoned[6:]], time): "line 7, column time: zones_mixed",
    }
    for word in words:
        wrong[table(changed(timed(), 5, 4, word), time)] = "line 7, column time: not_a_moment"
    check_refusals(read_positioning, tmp_path / "run.csv", wrong)


def test_cycles_may_be_empty_and_long_axes_have_one(tmp_path: Path) -> None:
    rows = [f"{c},+,{t},{c}" for c in (2, 4) for t in (0, 9)]
    test = read(tmp_path, HEADING, *rows, "2,+,0,")  # listed as missing: hides no reading
    assert test.deviation[:, :, FORWARD].tolist()[0][1::2] == [2.0, 4.0]
    assert test.deviation.shape == (2, 4, 2)
    assert remarks_of(test) == ("cycles without any reading: 1, 3",)
    assert read(tmp_path, HEADING, "1,+,0,1", "1,+,2000.5,1").cycles == 1
    most = [f"{c},+,{t},1" for t in range(10_000) for c in (1, 2)]
    assert read(tmp_path, HEADING, *most).target.size == 10_000


def test_a_missing_reading_and_a_missing_direction_stay_missing(tmp_path: Path) -> None:
    third = rows_of("3,{w},{t},{d}")[:6]
    test = read(tmp_path, HEADING, *changed(ROWS, 0, 3, ""), *third)
    assert np.isnan(test.deviation[0, 0, FORWARD])
    assert np.count_nonzero(np.isnan(test.deviation)) == 1
    one_way = read(tmp_path, HEADING, *(row for row in ROWS if "forward" in row))
    assert one_way.measured_approaches == (True, False)


def test_what_is_no_number_is_an_error_with_line_and_column(tmp_path: Path) -> None:
    for column, name in ((0, "cycle"), (2, "target_mm"), (3, "deviation_um")):
        for word in ("nan" if column < 3 else "nane", "abc", "1_0", "1e400", "1.5.3"):
            rows = changed(ROWS, 4, column, f'"{word}"')
            message = refusal(tmp_path, "# a comment", HEADING, *rows)
            assert f"line 7, column {name}: " in message, word


def test_run_numbers_alone_give_cycle_and_direction(tmp_path: Path) -> None:
    rows = [row for row in rows_of("{r},{t},{d}") if row[0] in "13"]
    test = read(tmp_path, "run,target_mm,deviation_um", *rows)
    assert test.measured_approaches == (True, False)
    assert test.deviation.shape == (3, 2, 2)
    assert any("odd runs are forward" in remark for remark in remarks_of(test))


@pytest.mark.parametrize(("words", "first"), [("+-", 1), ("-+", 1), ("+-", 2)])
def test_passes_that_alternate_are_paired_into_cycles(
    tmp_path: Path, words: str, first: int
) -> None:
    rows = [
        f"{first + k},{words[k % 2]},{t},{10 * k + t / 10}" for k in range(6) for t in (0, 5, 9)
    ]
    test = read(tmp_path, "run,direction,target_mm,deviation_um", *rows)
    assert test.deviation.shape == (3, 3, 2)
    for j in range(3):
        for k, word in enumerate(words):
            pass_ = test.deviation[:, j, "+-".index(word)]
            np.testing.assert_allclose(pass_, 10 * (2 * j + k) + np.array([0.0, 0.5, 0.9]))
    assert any(f"runs {first} and {first + 1} are cycle 1" in remark for remark in remarks_of(test))


def test_a_first_pass_backward_is_the_end_of_a_cycle_whose_begin_is_missing(
    tmp_path: Path,
) -> None:
    rows = [f"{run},{'-+'[run % 2]},{t},1" for run in range(2, 8) for t in (0, 5)]
    test = read(tmp_path, "run,direction,target_mm,deviation_um", *rows)
    assert test.cycles == 4
    assert np.isnan(test.deviation[:, 0, FORWARD]).all()


def test_passes_that_do_not_alternate_stay_cycles_of_their_own(tmp_path: Path) -> None:
    rows = [f"{run},{'++--'[run - 1]},{t},{run}" for run in (1, 2, 3, 4) for t in (0, 5)]
    test = read(tmp_path, "run,direction,target_mm,deviation_um", *rows)
    assert test.cycles == 4
    assert any("do not alternate" in remark for remark in remarks_of(test))


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


@pytest.mark.parametrize(
    ("words", "timed"), [("+-", False), ("+-", True), ("+", True), ("-", False)]
)
def test_targets_rise_through_a_full_turn(tmp_path: Path, words: str, timed: bool) -> None:
    heading, *rows = turning(WRAPPED, timed=timed, words=words)
    test = read(tmp_path, heading, *(reversed(rows) if timed else rows))
    np.testing.assert_array_equal(test.target, RISEN)
    for approach in (FORWARD, BACKWARD):
        if test.measured_approaches[approach]:
            np.testing.assert_array_equal(test.deviation[:, 0, approach], np.arange(4) + 1 / 8)
    assert any("(29.375° is 389.375°)" in remark for remark in remarks_of(test))


def test_other_rotary_targets_stay_as_they_are(tmp_path: Path) -> None:
    for targets in (
        (0.0, 90.0, 180.0, 270.0),  # no jump
        (270.0, 180.0, 90.0, 0.0),  # falls throughout
        (200.0, 100.0),
        (0.0, 200.0, 50.0, 300.0),  # a turn does not make it rise
        (0.0, 90.0, 400.0, 700.0),  # more than one turn is stated
        (300.0, 400.0, 20.0, 60.0, -100.0),
    ):
        test = read(tmp_path, *turning(targets))
        np.testing.assert_array_equal(test.target, sorted(targets))
        assert not any("turn" in remark for remark in remarks_of(test))


def test_passes_that_begin_elsewhere_and_linear_axes_add_no_turn(tmp_path: Path) -> None:
    lines = turning(WRAPPED)
    linear = read(tmp_path, HEADING, *lines[1:])
    np.testing.assert_array_equal(linear.target, sorted(WRAPPED))
    second = [k for k, line in enumerate(lines) if line.startswith("2,+")]
    lines[second[0]], lines[second[2]] = lines[second[2]], lines[second[0]]
    test = read(tmp_path, *lines)
    np.testing.assert_array_equal(test.target, sorted(WRAPPED))


def test_rows_against_their_direction_are_told_where_no_order_is_stated(tmp_path: Path) -> None:
    def said(*rows: str) -> bool:
        codes = {one.code for one in read(tmp_path, HEADING, *rows).remarks}
        return bool(codes & {"remark-forward_downwards", "remark-both_downwards"})

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
    assert any("whole turns" in remark for remark in remarks_of(test))


def test_measured_wins_and_the_first_disagreement_is_named(tmp_path: Path) -> None:
    heading = f"{HEADING},measured_mm"
    rows = rows_of("{c},{w},{t},{d},{m:.6f}")
    assert remarks_of(read(tmp_path, heading, *rows)) == ()
    rows[3] = rows[3].replace(f",{deviation_of(2, 1, BACKWARD)},", ",3.14,")
    test = read(tmp_path, heading, *rows)
    assert test.deviation[2, 0, BACKWARD] == deviation_of(2, 1, BACKWARD)
    assert len(remarks_of(test)) == 1
    assert "1 readings, first in line 5 (3.14 and" in remarks_of(test)[0]


def test_order_alone_gives_the_acquisition_order(tmp_path: Path) -> None:
    test = read(tmp_path, f"order,{HEADING}", *rows_of("{n},{c},{w},{t},{d}"))
    assert (test.time_source, test.order_deduced) == (TimeSource.ORDER, False)
    assert test.order[2, 0, BACKWARD] == 4
    from_0 = [f"{k},{row}" for k, row in enumerate(ROWS)]
    anew = read(tmp_path, f"order,{HEADING}", *from_0)
    assert remarks_of(anew) == ("the order numbers were counted anew from 1",)
    np.testing.assert_array_equal(anew.order, test.order)


def test_times_as_numbers_count_from_the_first_reading(tmp_path: Path) -> None:
    rows = rows_of("{c},{w},{t},{d},{s}")
    shifted = [with_last(row, str(float(row.rpartition(",")[2]) + 100)) for row in reversed(rows)]
    for name, factor in (("time_s", 1), ("time (min)", 60), ("time_ms", 0.001)):
        test = read(tmp_path, f"{HEADING},{name}", *shifted)
        assert test.time_source is TimeSource.FILE
        assert test.time_s[0, 0, FORWARD] == 0.0
        assert test.time_s[1, 0, FORWARD] == pytest.approx(7.5 * factor)
        assert test.order[0, 1, BACKWARD] == 12


def test_times_of_day_give_start_and_end(tmp_path: Path) -> None:
    test = read(tmp_path, f"{HEADING},time", *timed())
    assert test.time_source is TimeSource.FILE
    assert test.start == datetime(2026, 3, 2, 8, 0)  # noqa: DTZ001  local time
    assert test.end == datetime(2026, 3, 2, 8, 1, 22, 500_000)  # noqa: DTZ001  no zone in the file
    assert test.time_s[0, 1, BACKWARD] == 82.5
    zoned = read(tmp_path, f"{HEADING},time", *timed(zone="Z"))
    assert zoned.start == datetime(2026, 3, 2, 8, 0, tzinfo=UTC)


def test_times_may_have_the_day_first_with_points(tmp_path: Path) -> None:
    rows = [f"2.3.2026 8:00:{k:02d},5," + row for k, row in enumerate(ROWS)]
    rows = [row.replace(",", ";").replace(";5;", ",5;", 1) for row in rows]
    test = read(tmp_path, f"Zeit,{HEADING}".replace(",", ";"), *rows)
    assert test.time_source is TimeSource.FILE
    assert test.start == datetime(2026, 3, 2, 8, 0, 0, 500_000)  # noqa: DTZ001  none is stated
    assert test.time_s[0, 0, FORWARD] == 0.0


def test_a_reading_without_time_leaves_the_run_without_times(tmp_path: Path) -> None:
    rows = timed()
    rows[5] = with_last(rows[5], "")
    test = read(tmp_path, f"{HEADING},time", *rows)
    assert test.time_source is TimeSource.NONE
    assert test.start is not None
    assert "some readings have no time" in remarks_of(test)[0]


def test_times_that_do_not_rise_with_the_order_are_not_used(tmp_path: Path) -> None:
    rows = timed(form="{n},{c},{w},{t},{d}")
    rows[5], rows[6] = (re.sub(r"^\d+", str(k), rows[j]) for j, k in ((5, 7), (6, 6)))
    test = read(tmp_path, f"order,{HEADING},time", *rows)
    assert test.time_source is TimeSource.ORDER
    assert test.time_s is None
    assert "the run has no time axis" in remarks_of(test)[0]


def test_equal_times_leave_the_order_of_the_rows_if_they_rise(tmp_path: Path) -> None:
    test = read(tmp_path, f"{HEADING},time", *timed(step_s=0.0))
    assert test.time_source is TimeSource.ORDER
    assert test.order[2, 0, BACKWARD] == 4
    mixed = timed()
    mixed[5] = with_last(mixed[5], mixed[0].rpartition(",")[2])
    assert read(tmp_path, f"{HEADING},time", *mixed).time_source is TimeSource.NONE


def test_a_date_goes_before_a_column_of_seconds(tmp_path: Path) -> None:
    rows = [f"{row},{k}" for k, row in enumerate(timed())]
    test = read(tmp_path, f"{HEADING},time,time_s", *rows)
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


def test_a_file_cut_short_inside_its_last_number_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    rows = rows_of("{c},{w},{t},{d:.3f}")
    path.write_text("\n".join([HEADING, *rows])[:-2], encoding="utf-8")
    assert refusal_of(read_positioning, path) == "line 13, column deviation_um: cut_short"
    path.write_text("\n".join([HEADING, *rows]), encoding="utf-8")
    test = read_positioning(path)
    assert_the_run(test)
    assert "no line end" in remarks_of(test)[0]
    # a complete file whose last number is shorter needs a line end
    path.write_text("\n".join([HEADING, *rows])[:-2] + "\n", encoding="utf-8")
    assert read_positioning(path).target.size == 3


def test_missing_readings_keep_their_row_and_unmeasured_approaches_get_none() -> None:
    deviation = np.zeros((2, 3, 2))
    deviation[0, 1, FORWARD] = np.nan
    deviation[..., BACKWARD] = np.nan
    text = format_tidy_csv(PositioningTest(AxisKind.LINEAR, np.array([0.0, 1.0]), deviation))
    assert "2,forward,0,\n" in text
    assert text.count("forward") == 6
    assert "backward" not in text


def test_readings_with_a_deviation_only_beside_measured_ones_are_told(tmp_path: Path) -> None:
    heading = "cycle,direction,target_mm,measured_mm,deviation_um"
    rows = rows_of("{c},{w},{t},{m:.6f},{d}")
    alone = rows_of("{c},{w},{t},,{d}")
    test = read(tmp_path, heading, *rows[:4], *alone[4:6], *rows[6:])
    assert_the_run(test)
    (said,) = remarks_of(test)
    assert said.startswith("2 readings have no measured position, first in line 6:")
    assert remarks_of(read(tmp_path, heading, *alone)) == ()
