"""What becomes of files as people have them: read as they are meant, or refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.refusals import refused
from tests.unit.files.builders import remarks_of
from tests.unit.files.nasty import (
    CASES,
    DEVIATION,
    HEAD,
    STEP_S,
    STOPS,
    TARGETS,
    Nasty,
    changed,
    text,
    tidy,
    timed,
    wide,
)
from thermaxis.files import RunMapping, format_tidy_csv, read_positioning, read_run_mapping
from thermaxis.positioning import PositioningTest, TimeSource


def read(tmp_path: Path, content: bytes, mapping: RunMapping | None = None) -> PositioningTest:
    path = tmp_path / "run"
    path.write_bytes(content)
    return read_positioning(path, mapping=mapping or RunMapping())


def assert_the_run(test: PositioningTest, case: Nasty) -> None:
    expected = DEVIATION.copy()
    for stop in case.missing:
        expected[stop] = np.nan
    np.testing.assert_allclose(test.target, TARGETS, rtol=0, atol=2e-4)
    np.testing.assert_allclose(test.deviation, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_a_file_is_read_as_it_is_meant_or_refused(tmp_path: Path, case: Nasty) -> None:
    if case.refused:
        with refused(case.refused):
            read(tmp_path, case.content)
    if case.refused and case.mapping == RunMapping():
        return
    test = read(tmp_path, case.content, case.mapping)
    if not case.other:
        assert_the_run(test, case)
    if case.timed:
        assert test.time_s is not None
    if case.missing and not case.mapping.columns:
        assert any("of 36 readings are missing" in said for said in remarks_of(test))
    (tmp_path / "tidy.csv").write_text(format_tidy_csv(test), encoding="utf-8")
    again = read_positioning(tmp_path / "tidy.csv")
    np.testing.assert_array_equal(again.deviation, test.deviation)
    assert remarks_of(again) == remarks_of(test)


def case_named(name: str) -> Nasty:
    return next(case for case in CASES if case.name == name)


@pytest.mark.parametrize(
    ("name", "source", "within_s"),
    [
        *((name, TimeSource.FILE, 1.0) for name in ("AM/PM", "clock times", "date and time apart")),
        ("AM/PM with date, month first", TimeSource.FILE, 1e-6),
        ("clock times past midnight", TimeSource.FILE, 1.0),
        ("03/04/2026", TimeSource.FILE, 1.0),
        ("no direction, but times", TimeSource.FILE, 1e-6),
        ("to the minute", TimeSource.INTERPOLATED, 30.0),
        ("clock times to the minute", TimeSource.INTERPOLATED, 30.0),
    ],
)
def test_times_are_those_of_the_readings(
    tmp_path: Path, name: str, source: TimeSource, within_s: float
) -> None:
    case = case_named(name)
    test = read(tmp_path, case.content, case.mapping)
    assert test.time_source is source
    read_s = np.array([test.time_s[stop] for stop in STOPS])
    true_s = STEP_S * np.arange(len(STOPS))
    assert np.all(np.diff(read_s) > 0)
    assert np.ptp(read_s - true_s) <= 2 * within_s


def test_a_reading_within_a_minute_stays_in_it(tmp_path: Path) -> None:
    test = read(tmp_path, case_named("to the minute").content)
    assert any("stated to 60 s" in said for said in remarks_of(test))
    # 11:58:20 is the first: the file says 11:58, and with it whole minutes are at multiples of 60 s
    first_s = 60.0 / 5 * 0.5  # five readings in the first minute, evenly
    read_s = np.array([test.time_s[stop] for stop in STOPS]) + first_s
    true_s = 20.0 + STEP_S * np.arange(len(STOPS))
    np.testing.assert_array_equal(read_s // 60, true_s // 60)


def test_a_time_that_lies_apart_is_named(tmp_path: Path) -> None:
    def said_of(rows: list[list[str]]) -> list[str]:
        return [said for said in remarks_of(read(tmp_path, text(rows))) if "times rise" in said]

    rows = timed(lambda moment: moment.isoformat())
    for row in (1, 20, len(rows) - 1):  # the first is late, the others are early
        (said,) = said_of(changed(rows, row, 4, f"2026-11-20T{13 if row == 1 else 10}:00:00"))
        assert f":00:00 in line {row + 1} lies" in said
    assert not said_of(rows)
    assert not said_of([rows[0], *sorted(rows[1:], key=lambda row: float(row[2]))])


def test_what_was_left_out_is_named(tmp_path: Path) -> None:
    said = remarks_of(read(tmp_path, case_named("summary below (csv)").content))
    assert said == ("rows 38, 39 of the file hold no readings and were left out: 'Mean', 'Std'",)
    said = remarks_of(read(tmp_path, case_named("missing: BEAM BREAK").content))
    assert said[0].startswith("'BEAM BREAK' stands in one cell that should hold a number")
    (said,) = remarks_of(read(tmp_path, case_named("motor_c is a temperature").content))
    assert said == "kept as channels: 'motor_c'"


def test_rows_that_may_be_readings_are_refused_not_left_out(tmp_path: Path) -> None:
    rows = tidy()
    for k, cell in ((2, ""), (0, ""), (2, "x1"), (1, "mean")):
        with refused(
            "not_a_direction" if k == 1 else "row_incomplete" if not cell else "not_a_number"
        ):
            read(tmp_path, text([HEAD, *changed(rows, 35, k, cell)]))
    with refused("cells_and_headings"):
        read(tmp_path, text([HEAD, *rows[:-1], rows[-1][:3]]))


def test_directions_by_travel_need_whole_passes(tmp_path: Path) -> None:
    rows = [[row[0], row[2], row[3], 7 * k] for k, row in enumerate(tidy())]
    head = ["cycle", "target_mm", "deviation_um", "time_s"]
    assert_the_run(read(tmp_path, text([head, *rows])), case_named("AM/PM"))
    with refused("no_direction_column"):  # the turning point was visited once: in which pass?
        read(tmp_path, text([head, *rows[:5], *rows[6:]]))
    with refused("no_direction_column"):
        read(tmp_path, text([head, *changed(changed(rows, 2, 1, "150.5"), 1, 1, "300"), *[]]))
    one_way = [row for k, row in enumerate(rows) if STOPS[k][2] == 0]
    test = read(tmp_path, text([head, *one_way]))
    np.testing.assert_allclose(test.deviation[:, :, 0], DEVIATION[:, :, 0])
    assert test.measured_approaches == (True, False)


def test_a_tolerance_merges_no_targets_that_lie_further_apart(tmp_path: Path) -> None:
    content = case_named("targets of an encoder").content
    with refused("targets_not_apart"):
        read(tmp_path, content, RunMapping(target_tolerance=200.0))
    with refused("targets_nearly_equal") as caught:
        read(tmp_path, content)
    tolerance = float(str(caught.value.values["tolerance"]))
    merged = read(tmp_path, content, RunMapping(target_tolerance=tolerance)).target
    np.testing.assert_allclose(merged, TARGETS, atol=tolerance)
    np.testing.assert_array_equal(merged, np.round(merged, 4))
    # near targets that each pass has are targets of their own
    rows = [[c, w, t, d] for c, w, t0, d in tidy() for t in (t0, f"{float(t0) + 0.01:g}")]
    assert read(tmp_path, text([HEAD, *rows])).target.size == 12


@pytest.mark.parametrize("codes", [[999999.9] * 3, [999999.9, -999999, -999999], [-1e6] * 17])
def test_an_error_code_among_readings_is_no_reading(tmp_path: Path, codes: list[float]) -> None:
    rows = changed(tidy(), 5, 3, "250")  # one outlier is none
    read(tmp_path, text([HEAD, *rows]))
    for k, code in enumerate(codes):
        rows = changed(rows, 2 * k, 3, f"{code}")
    with refused("error_code_as_reading"):
        read(tmp_path, text([HEAD, *rows]))


def test_blocks_transposed_and_localised_forms_give_the_same_readings(tmp_path: Path) -> None:
    plain = read(
        tmp_path,
        text(
            [
                ["Target (mm)", *(f"Run {k + 1} (µm)" for k in range(6))],
                *wide([(j, a) for j in range(3) for a in range(2)]),
            ]
        ),
    )
    for name in ("blocks of forward and backward", "transposed, wide", "F1 B1", "Markdown, wide"):
        other = read(tmp_path, case_named(name).content)
        np.testing.assert_array_equal(other.deviation, plain.deviation)
        np.testing.assert_array_equal(other.order, plain.order)


def test_a_second_run_in_the_file_is_not_taken_for_a_part_of_the_first(tmp_path: Path) -> None:
    passes = [(j, a) for j in range(3) for a in range(2)]
    for head, rows in (
        ([HEAD], tidy()),
        ([["Target (mm)", *range(1, 7)]], wide(passes)),
        ([["Forward"], ["Target (mm)", 1, 2, 3]], wide(passes[::2])),
    ):
        column = 2 if len(head[-1]) == 4 and head[-1] is HEAD else 0
        other = [[*r[:column], str(float(r[column]) + 5), *r[column + 1 :]] for r in rows]
        with refused("blocks_of_other_targets"):
            read(tmp_path, text([*head, *rows, [], *head, *other]))
    pages = tidy()
    repeated = text([HEAD, *pages[:12], HEAD, *pages[12:24], HEAD, *pages[24:]])
    assert_the_run(read(tmp_path, repeated), case_named("AM/PM"))
    units = ["cycle", "direction", "target_mm", "deviation_nm"]
    with refused("blocks_unlike"):
        read(tmp_path, text([HEAD, *pages[:12], units, *pages[12:]]))


def test_rows_above_the_headings_that_hold_numbers_are_named(tmp_path: Path) -> None:
    said = remarks_of(read(tmp_path, text([["7", "8.5", "1"], ["Machine", "MCV"], HEAD, *tidy()])))
    assert said == ("row 1 of the file holds no reading and was left out: '7'",)


def test_a_mapping_file_says_what_the_headings_do_not(tmp_path: Path) -> None:
    case = case_named("headings of another language")
    with refused("run_headings_incomplete") as caught:
        read(tmp_path, case.content)
    start = str(caught.value.values["start"])
    assert start == 'columns = { "kör" = "...", "irány" = "...", "hely" = "...", "hiba" = "..." }'
    path = tmp_path / "map.toml"
    words = ("cycle", "direction", "target", "deviation")
    for word in words:
        start = start.replace("...", word, 1)
    path.write_text(f'position_unit = "mm"\ndeviation_unit = "um"\n{start}\n', encoding="utf-8")
    mapping = read_run_mapping(path)
    assert_the_run(read(tmp_path, case.content, mapping), case)
    assert replace(mapping, columns={}).position_unit == "mm"


@pytest.mark.parametrize(
    ("lines", "code"),
    [
        ('decimal = "dot"', "value_unknown"),
        ('decimals = "point"', "unknown_key_near"),
        ('position_unit = "furlong"', "unknown_unit"),
        ('[columns]\nx = "targets"', "value_unknown"),
        ("[columns]\nx = { cycle = 2 }", "pass_incomplete"),
        ('[columns]\nx = { role = "target", unit = "K" }', "unknown_unit"),
        ("target_tolerance = -1.0", "outside_range"),
        ("columns = 3", "not_a_table"),
    ],
)
def test_a_wrong_mapping_is_refused_with_its_key(tmp_path: Path, lines: str, code: str) -> None:
    path = tmp_path / "map.toml"
    path.write_text(lines, encoding="utf-8")
    with refused(code) as caught:
        read_run_mapping(path)
    assert caught.value.place.file == str(path)
    assert caught.value.place.key
