import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from tests.refusals import answer_of, check_refusals, refusal_of
from tests.unit.files.builders import remarks_of
from thermaxis.files import read_positioning, write_rtl
from thermaxis.files.runs._environment_factor import environment_factor_um
from thermaxis.files.table import clean_text
from thermaxis.positioning import Cycle, PositioningTest, StartEnd, TimeSource
from thermaxis.quantities import AxisKind

Row = tuple[int, int, float]

SIX = (0.0, 100.0, 200.0, 300.0, 400.0, 500.0)
PUBLISHED_ENVIRONMENT = """\
Air temp   : 20.337280 20.384956 0
Air press  : 99.039005 99.049346 1
Air humid  : 46.954897 46.893887
Mat temp 1 : 20.203292 20.321342 0
Mat temp 2 : -10.000000 -10.000000 0
Mat temp 3 : -10.000000 -10.000000 0
Env factor : 0.31641096 0.31641067
Exp coeff  : 8.000000 8.000000 0
Date Time  : "10:46 Dec 12 2016" "11:01 Dec 12 2016"
Final Data : 1 0
"""
USER_TEXT = """\
Machine:MCV 750
Serial No:12-345
Date:2016-12-12 10:46:00
By:JN
Axis:X
Location:Hall 2
TITLE:Run 3: after warm-up, 12:30
"""


def reading(run: int, index: int) -> float:
    """Deviation that tells where it belongs: run number, target, and sign of the direction."""
    return (run + index / 100) * (1 if run % 2 else -1)


def run_rows(run: int, targets: int) -> list[Row]:
    indices = range(1, targets + 1) if run % 2 else range(targets, 0, -1)
    return [(run, index, reading(run, index)) for index in indices]


def all_rows(runs: int, targets: int) -> list[Row]:
    return [row for run in range(1, runs + 1) for row in run_rows(run, targets)]


def target_lines(targets: Sequence[float], per_line: int = 5) -> str:
    rows = [targets[k : k + per_line] for k in range(0, len(targets), per_line)]
    return "".join("  ".join(f"{value:.6f}" for value in row) + " \n" for row in rows)


def rtl(
    targets: Sequence[float] = SIX,
    rows: Iterable[Row] | None = None,
    *,
    runs: int = 4,
    flags: str = "0 0 2 0",
    head: str = "File type  : rtl\nOwner      : Linear\nVersion no : V20.02.02\n",
    listed: str | None = None,
    user_text: str = USER_TEXT,
    environment: str | None = PUBLISHED_ENVIRONMENT,
    tail: str = "EOF::\n",
) -> str:
    rows = all_rows(runs, len(targets)) if rows is None else rows
    return (
        f"HEADER::\n{head}\n"
        f"TARGET DATA::\nFiletype  : ISO\nTarget-count: {len(targets)}\nTargets :\n"
        f"{target_lines(targets) if listed is None else listed}Flags: {flags}\n\n"
        f"USER-TEXT::\n{user_text}\n"
        f"RUNS::\nRun-count:{runs}\n\n"
        "DEVIATIONS::\nRun Target Data:\n"
        + "".join(f"{run}   {index}      {value:.3f}\n" for run, index, value in rows)
        + ("" if environment is None else f"\nENVIRONMENT::\n{environment}")
        + f"\n{tail}"
    )


def saved(folder: Path, text: str, *, encoding: str = "utf-8", end: str = "\r\n") -> Path:
    path = folder / "run.rtl"
    path.write_bytes(text.replace("\n", end).encode(encoding))
    return path


def read(folder: Path, text: str) -> PositioningTest:
    return read_positioning(saved(folder, text))


def refusal(folder: Path, text: str) -> str:
    return refusal_of(read_positioning, saved(folder, text))


def remark(test: PositioningTest, part: str) -> str:
    found = [text for text in remarks_of(test) if part in text]
    assert len(found) == 1, remarks_of(test)
    return found[0]


def test_every_reading_comes_to_its_run_and_target(tmp_path: Path):
    test = read(tmp_path, rtl(runs=6))
    assert test.kind is AxisKind.LINEAR
    assert test.target.tolist() == list(SIX)
    assert test.deviation.shape == (6, 3, 2)
    for target in range(6):
        for cycle in range(3):
            for approach in range(2):
                expected = reading(2 * cycle + approach + 1, target + 1)
                assert test.deviation[target, cycle, approach] == pytest.approx(expected, abs=1e-12)


def test_texts_of_the_file_become_the_header(tmp_path: Path):
    header = read(tmp_path, rtl()).header
    expected = {
        "machine": "MCV 750",
        "serial_number": "12-345",
        "inspector": "JN",
        "axis": "X",
        "location": "Hall 2",
        "title": "Run 3: after warm-up, 12:30",
        "date": "2016-12-12 10:46:00",
        "file_type": "rtl",
        "version_no": "V20.02.02",
        "flags": "0 0 2 0",
    }
    assert expected.items() <= header.items()


def test_user_text_may_hold_what_looks_like_a_section_or_a_decimal_comma(tmp_path: Path):
    text = "TITLE:all of it::\nNote:\nPRELOAD::\nFeed:1,5 m/min\nand more\nx:<b> =cmd\x1b[2J\x07\n"
    header = read(tmp_path, rtl(user_text=text)).header
    assert header["title"] == "all of it::"
    assert header["preload"] == ":"
    assert header["feed"] == "1,5 m/min and more"
    assert header["x"] == "<b> =cmd [2J"
    assert "note" not in header


def test_czech_text_and_plain_line_ends_are_read_as_well(tmp_path: Path):
    text = rtl(user_text="Machine:Soustruh č. 5\nBy:Dvořák\n")
    test = read_positioning(saved(tmp_path, text, encoding="cp1250", end="\n"))
    assert test.header["machine"] == "Soustruh č. 5"
    assert test.header["inspector"] == "Dvořák"
    assert any("cp1250" in text for text in remarks_of(test))


def test_a_target_list_of_any_form_is_read_up_to_the_flags(tmp_path: Path):
    for targets, per_line in (
        *(([12.5 * k for k in range(count)], 5) for count in (2, 4, 5, 6, 25)),
        *((SIX, per_line) for per_line in (1, 100)),
        ((-500.25, -399.875, -300.0, -0.125, 99.5, 250.0), 5),
    ):
        test = read(tmp_path, rtl(targets, listed=target_lines(targets, per_line)))
        assert test.target.tolist() == list(targets)


def test_a_target_list_from_the_largest_to_the_smallest_is_turned_round(tmp_path: Path):
    test = read(tmp_path, rtl(SIX[::-1]))
    assert test.target.tolist() == list(SIX)
    assert test.deviation[0, 0, 0] == pytest.approx(reading(1, 6))
    assert test.deviation[5, 1, 1] == pytest.approx(reading(4, 1))
    assert test.order[5, 0, 0] == 1.0
    assert "negative direction" in remark(test, "largest to the smallest")


def test_the_index_column_counts_and_not_the_place_of_the_row(tmp_path: Path):
    rows = [all_rows(4, 6)[k] for k in np.random.default_rng(7).permutation(24)]
    shuffled, sorted_rows = read(tmp_path, rtl(rows=rows)), read(tmp_path, rtl())
    assert np.array_equal(shuffled.deviation, sorted_rows.deviation)
    assert np.array_equal(shuffled.order, sorted_rows.order)
    assert "not in the order of travel" in remark(shuffled, "rows of runs")


def test_times_are_spread_from_start_to_end_in_acquisition_order(tmp_path: Path):
    test = read(tmp_path, rtl())
    assert test.time_source is TimeSource.INTERPOLATED
    assert test.order_deduced
    assert test.start == datetime(2016, 12, 12, 10, 46)  # noqa: DTZ001  no zone in the file
    assert test.end == datetime(2016, 12, 12, 11, 1)  # noqa: DTZ001  no zone in the file
    assert test.order[:, 0, 0].tolist() == [1, 2, 3, 4, 5, 6]
    assert test.order[:, 0, 1].tolist() == [12, 11, 10, 9, 8, 7]
    assert test.time_s[0, 0, 0] == 0.0
    assert test.time_s[0, 1, 1] == 900.0
    assert np.allclose(test.time_s, 900.0 * (test.order - 1) / 23)
    assert "to the minute" in remark(test, "interpolated")


def test_unusable_start_and_end_leave_the_order_only(tmp_path: Path):
    for date_time, part in (
        ('"11:01 Dec 12 2016" "10:46 Dec 12 2016"', "ends before it starts"),
        ('"10:46 Dec 12 2016" "10:46 Dec 12 2016"', "same minute"),
        ('"10:46 Pro 12 2016" "11:01 Pro 12 2016"', "not understood"),
        ('"25:46 Dec 12 2016" "26:01 Dec 12 2016"', "not understood"),
        ('"10:46 Dec 32 2016"', "not understood"),
        ("10:46 Dec 12 2016", "not understood"),
        ("", "not understood"),
    ):
        test = read(tmp_path, rtl(environment=f"Date Time  : {date_time}\n"))
        assert test.time_source is TimeSource.ORDER
        assert test.order_deduced
        assert test.time_s is None
        assert remark(test, part)
        assert remark(test, "only their order is known")


def test_an_equipment_section_does_not_touch_the_machine(tmp_path: Path):
    text = rtl().replace("ENVIRONMENT::", "EQUIPMENT::\nLaser:XL-80\nSerial No:9\n\nENVIRONMENT::")
    header = read(tmp_path, text).header
    found = [header[key] for key in ("serial_number", "equipment_laser", "equipment_serial_number")]
    assert found == ["12-345", "XL-80", "9"]


def test_the_environment_is_read_and_absent_sensors_are_no_temperatures(tmp_path: Path):
    test = read(tmp_path, rtl())
    assert dict(test.environment) == {
        "air_temperature_c": StartEnd(20.337280, 20.384956),
        "air_pressure_kpa": StartEnd(99.039005, 99.049346),
        "air_humidity_percent": StartEnd(46.954897, 46.893887),
        "material_temperature_1_c": StartEnd(20.203292, 20.321342),
        "environment_factor_um": StartEnd(0.31641096, 0.31641067),
        "expansion_coefficient_ppm_per_k": StartEnd(8.0, 8.0),
    }
    assert remark(test, "absent") == "material sensors 2, 3 marked absent"
    lost = read(tmp_path, rtl(environment="Mat temp 2 : 20.5 -10.000000 0\n"))
    assert lost.environment["material_temperature_2_c"] == StartEnd(20.5, None)
    for environment in (None, ""):
        without = read(tmp_path, rtl(environment=environment))
        assert dict(without.environment) == {}
        assert without.time_source is TimeSource.ORDER


def test_the_published_environment_factors_follow_from_air_and_material():
    for *air, material_c, predicted_um in (
        (20.337280, 99.039005, 46.954897, 20.203292, 0.31641094),
        (20.384956, 99.049346, 46.893887, 20.321342, 0.31641065),
    ):
        factor = environment_factor_um(
            *air, expansion_coefficient_ppm_per_k=8.0, material_temperature_c=material_c
        )
        assert round(factor, 8) == predicted_um


def test_the_refractive_index_agrees_with_a_shop_floor_formula():
    # an independent second way, good to 1.5e-7: NIST Engineering Metrology Toolbox
    for air_c, pressure_kpa, humidity_percent in itertools.product(
        (10.0, 20.0, 30.0), (95.0, 101.325), (0.0, 50.0, 100.0)
    ):
        index = (
            1.0
            + 7.86e-4 * pressure_kpa / (273.0 + air_c)
            - 1.5e-11 * humidity_percent * (air_c**2 + 160.0)
        )
        factor = environment_factor_um(air_c, pressure_kpa, humidity_percent)
        assert 0.632990577 / 2 / factor == pytest.approx(index, abs=1.5e-7)


def test_the_factor_alone_shows_that_readings_are_reduced_to_20_c(tmp_path: Path):
    test = read(tmp_path, rtl())
    assert test.header["normalised_to_20_c"] == "yes, with 8 ppm/K (environment factor)"
    assert "already reduced to 20 °C, with 8 ppm/K, and must not" in remark(test, "reduced")
    for old, new in (
        ("20.203292", "20.303292"),  # does not fit at the start
        ("20.321342", "20.421342"),  # does not fit at the end
        ("Env factor : 0.31641096 0.31641067\n", ""),
        ("Exp coeff  : 8.000000 8.000000 0\n", ""),
        ("Mat temp 1 : 20.203292 20.321342 0\n", "Mat temp 1 : -10.000000 -10.000000 0\n"),
        ("99.039005 99.049346", "990.39005 990.49346"),
    ):
        assert old in PUBLISHED_ENVIRONMENT
        test = read(tmp_path, rtl(environment=PUBLISHED_ENVIRONMENT.replace(old, new)))
        assert "normalised_to_20_c" not in test.header
        assert not any("reduced to 20" in text for text in remarks_of(test))


def test_a_material_too_near_20_c_shows_nothing(tmp_path: Path):
    for material_c, claimed in ((20.0, False), (20.05, False), (21.0, True)):
        factor = environment_factor_um(
            20.5, 99.0, 50.0, expansion_coefficient_ppm_per_k=8.0, material_temperature_c=material_c
        )
        environment = (
            "Air temp : 20.5 20.5 0\nAir press : 99 99 1\nAir humid : 50 50\n"
            f"Mat temp 1 : {material_c} {material_c} 0\nEnv factor : {factor:.8f} {factor:.8f}\n"
            "Exp coeff : 8 8 0\n"
        )
        test = read(tmp_path, rtl(environment=environment))
        assert ("normalised_to_20_c" in test.header) is claimed


def test_a_missing_reading_stays_missing_and_the_others_keep_their_times(tmp_path: Path):
    whole = read(tmp_path, rtl(runs=6))
    rows = [row for row in all_rows(6, 6) if row[:2] != (3, 2)]
    test = read(tmp_path, rtl(rows=rows, runs=6))
    assert math.isnan(test.deviation[1, 1, 0])
    assert int(np.isnan(test.deviation).sum()) == 1
    assert remark(test, "missing") == "1 of 36 readings are missing: run 3 target 2"
    measured = ~np.isnan(test.deviation)
    assert np.array_equal(test.time_s[measured], whole.time_s[measured])
    assert sorted(test.order[measured].tolist()) == list(range(1, 36))


def test_a_file_cut_short_is_refused_wherever_it_ends(tmp_path: Path):
    text = rtl(runs=6, environment=None)
    whole = read(tmp_path, text).deviation
    end_of_readings = text.index("\n\nEOF")
    lengths = {*range(1, end_of_readings, 9), *range(end_of_readings - 60, end_of_readings)}
    for length in lengths:
        refusal(tmp_path, text[:length])
    begin_of_last = text.rindex("\n", 0, end_of_readings) + 1
    assert refusal(tmp_path, text[: begin_of_last + 3]).endswith(": cut_short")
    for length in range(end_of_readings, text.index("EOF")):
        assert np.array_equal(read(tmp_path, text[:length]).deviation, whole)


def test_a_contradiction_is_refused_with_its_place(tmp_path: Path):
    text = rtl()
    changes = (
        ("HEADER::", "order,time,cycle", "line 1: no_rtl_header"),
        ("TARGET DATA::", "TARGET FACTS::", "section_missing"),
        ("RUNS::", "", "section_missing"),
        ("Target-count: 6", "Target-count: 7", "line 8: target_count"),
        ("Target-count: 6", "Target-count: six", "line 8, column Target-count: not_a_whole_number"),
        ("Target-count: 6\n", "", "column Target-count: missing_key"),
        ("300.000000", "3OO.000000", "line 10: not_a_number"),
        ("300.000000", "nan", "line 10: not_a_number"),
        ("300.000000", "200.000000", "line 10: targets_not_in_order"),
        ("300.000000", "50.000000", "line 10: targets_not_in_order"),
        ("Flags: 0 0 2 0", "Flags: 0 7 2 0", "line 12, column Flags: unreadable_flags"),
        ("Flags: 0 0 2 0", "Flags:", "line 12, column Flags: unreadable_flags"),
        ("Run-count:4", "Run-count:3", "line 46: unknown_run"),
        ("Run-count:4\n", "", "column Run-count: missing_key"),
        ("\n2   3      -2.030", "\n2   7      -2.030", "line 37: unknown_target"),
        ("\n2   3      -2.030", "\n2   0      -2.030", "line 37: unknown_target"),
        ("\n2   3      -2.030", "\n0   3      -2.030", "line 37: unknown_run"),
        ("\n2   3      -2.030", "\n2   4      -2.030", "line 37: reading_twice"),
        ("\n2   3      -2.030", "\n2   3      ", "line 37: words_in_row"),
        ("\n2   3      -2.030", "\n2   3      -2,030", "line 37, column Data: not_a_number"),
        ("\n2   3      -2.030", "\n2   3      inf", "line 37, column Data: not_a_number"),
        ("\n2   3      -2.030", "\n2   3      1e300", "line 37, column Data: magnitude_too_large"),
        ("\n3   2      3.020", "\n3   2      3.O20", "line 41, column Data: not_a_number"),
        ("20.337280", "warm", "line 54, column air_temperature_c: not_a_number"),
        ("EOF::\n", "EOF::\nHEADER::\n", "line 66: section_twice"),
        ("RUNS::\n", "RUNS::\nRUNS::\n", "line 24: section_twice"),
    )
    assert all(old in text for old, _, _ in changes)
    wrong = {text.replace(old, new, 1).replace("\n", "\r\n"): said for old, new, said in changes}
    check_refusals(read_positioning, tmp_path / "run.rtl", wrong)


def test_what_is_odd_is_read_with_a_remark(tmp_path: Path):
    for changes, part in (
        ({"tail": ""}, "no EOF::"),
        ({"tail": "EOF::\nsomething else\n"}, "what follows EOF::"),
        ({"environment": "Exp coeff : 8 8\n\nSTATISTICS::\nA B\n1 2\n"}, "STATISTICS"),
        (
            # a material sensor 0.1 K off changes the factor by 0.8 ppm at 8 ppm/K
            {"environment": PUBLISHED_ENVIRONMENT.replace("20.203292", "20.303292")},
            "start of the run is +0.86 ppm",
        ),
        (
            {"environment": PUBLISHED_ENVIRONMENT.replace("99.039005", "990.39005")},
            "at the start of the run the air cannot have had",
        ),
        (
            {"rows": [r for r in all_rows(10, 6) if r[0] not in {4, 9, 10}], "runs": 10},
            "18 of 60 readings are missing: run 4, run 9, run 10",
        ),
        ({"rows": all_rows(4, 6), "runs": 999_999_999}, "and others"),
    ):
        test = read(tmp_path, rtl(**changes))
        assert remark(test, part)
        assert test.deviation[2, 1, 0] == pytest.approx(reading(3, 3))


ONE_WAY = [(run, index, value if run % 2 else 0.0) for run, index, value in all_rows(6, 6)]


def test_the_zeros_of_a_unidirectional_test_are_not_readings(tmp_path: Path):
    for rows in (ONE_WAY, [row for row in ONE_WAY if row[0] % 2]):
        test = read(tmp_path, rtl(rows=rows, runs=6, flags="0 1 2 0"))
        assert test.unidirectional
        assert test.deviation.shape == (6, 3, 2)
        assert bool(np.isnan(test.deviation[:, :, 1]).all())
        assert test.deviation[2, 1, 0] == pytest.approx(reading(3, 3))
        assert test.time_s[5, 2, 0] == 900.0
        assert not any("missing" in text for text in remarks_of(test))
    both = read(tmp_path, rtl(rows=ONE_WAY, runs=6))
    assert bool(np.all(both.deviation[:, :, 1] == 0.0))


def test_what_is_no_whole_linear_run_is_refused(tmp_path: Path):
    changes = (
        ({"rows": [r for r in all_rows(4, 6) if r[:2] != (3, 4)]}, "too_few_readings_of_target"),
        (
            {"rows": all_rows(6, 6)[:-7], "runs": 6, "environment": None, "tail": ""},
            "readings_cut_short",
        ),
        (
            {"rows": [*ONE_WAY[:8], (2, 4, 0.5)], "runs": 6, "flags": "0 1 2 0"},
            "line 36: readings_in_return_run",
        ),
        ({"head": "File type  : rta\nOwner      : Angular\n"}, "not_linear_rtl"),
        ({"head": "File type  : rtl\nOwner      : Angular\n"}, "not_linear_rtl"),
        ({"head": "Owner      : CARTO-Dynamic\n"}, "not_linear_rtl"),
        ({"head": "Version no : V20.02.02\n"}, "not_linear_rtl"),
    )
    wrong = {rtl(**change): said for change, said in changes}
    check_refusals(read_positioning, tmp_path / "run.rtl", wrong)


def made_test(targets: Sequence[float], deviation: np.ndarray, **fields: object) -> PositioningTest:
    return replace(PositioningTest(AxisKind.LINEAR, np.array(targets), deviation), **fields)


def test_a_file_written_and_read_again_is_the_same_run(tmp_path: Path):
    original = read(tmp_path, rtl(runs=6))
    path = tmp_path / "written.rtl"
    write_rtl(original, path)
    again = read_positioning(path)
    assert np.array_equal(again.target, original.target)
    assert np.array_equal(again.deviation, original.deviation)
    assert np.array_equal(again.time_s, original.time_s)
    assert dict(again.environment) == dict(original.environment)
    assert (again.start, again.end) == (original.start, original.end)
    flags = "air_temperature_c 0, air_pressure_kpa 1, material_temperature_1_c 0,"
    header = {k: v for k, v in original.header.items() if k != "environment_final_data"}
    header["environment_flags"] = f"{flags} expansion_coefficient_ppm_per_k 0"
    assert dict(again.header) == header


@st.composite
def linear_tests(draw: st.DrawFn) -> tuple[PositioningTest, int]:
    """Bidirectional or unidirectional runs with some readings missing, two left everywhere."""
    steps = draw(st.lists(st.integers(1, 900_000_000), min_size=1, max_size=11))
    first = draw(st.integers(-900_000_000, 900_000_000))
    targets = np.cumsum([first, *steps]) / 1e6
    cycles = draw(st.integers(3, 5))
    decimals = draw(st.integers(0, 6))
    shape = (targets.size, cycles, 2)
    random_bits = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    deviation = np.round(random_bits.normal(0.0, 20.0, shape), decimals)
    missing = random_bits.random((targets.size, 2)) < draw(st.floats(0.0, 0.5))
    lost_cycle = random_bits.integers(0, cycles - 1, (targets.size, 2))
    for target, approach in np.argwhere(missing):
        deviation[target, lost_cycle[target, approach], approach] = np.nan
    approaches = draw(st.sampled_from(["both", "forward", "backward"]))
    if approaches != "both":
        deviation[:, :, 1 if approaches == "forward" else 0] = np.nan
    return PositioningTest(AxisKind.LINEAR, targets, deviation), decimals


@settings(
    derandomize=True,
    max_examples=25,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(linear_tests())
def test_every_reading_survives_writing_and_reading(
    tmp_path: Path, case: tuple[PositioningTest, int]
):
    original, decimals = case
    path = tmp_path / "written.rtl"
    write_rtl(original, path, deviation_decimals=decimals)
    again = read_positioning(path)
    assert np.allclose(again.target, original.target, rtol=0.0, atol=5e-7)
    assert np.array_equal(np.isnan(again.deviation), np.isnan(original.deviation))
    assert np.allclose(again.deviation, original.deviation, rtol=0.0, atol=1e-9, equal_nan=True)


@settings(
    derandomize=True,
    max_examples=25,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(st.text(max_size=60), st.sampled_from(["machine", "title", "inspector", "feed", "notes"]))
def test_no_header_text_can_break_the_file(tmp_path: Path, text: str, key: str):
    path = tmp_path / "written.rtl"
    original = made_test([0.0, 1.0], np.ones((2, 2, 2)), header={key: text, "axis": "X"})
    write_rtl(original, path)
    again = read_positioning(path)
    assert again.header["axis"] == "X"
    assert again.header.get(key, "") == clean_text(text)
    assert np.array_equal(again.deviation, original.deviation)


def test_what_the_format_cannot_state_is_not_written(tmp_path: Path):
    path, values = tmp_path / "a.rtl", np.ones((2, 2, 2))
    for fields, said in (
        ({"kind": AxisKind.ROTARY}, "rtl_is_linear"),
        ({"cycle": Cycle.PILGRIM}, "rtl_cycle"),
        ({"target": np.array([0.0, 1e-7])}, "targets_same_when_printed"),
    ):
        assert answer_of(write_rtl, made_test([0.0, 1.0], values, **fields), path) == said
    test = made_test([0.0, 1.0], values)
    for place, encoding in ((tmp_path, "utf-8"), (path, "no-such-encoding")):
        assert answer_of(write_rtl, test, place, encoding=encoding) == "file_unwritable"
