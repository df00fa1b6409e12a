from pathlib import Path

import numpy as np
import pytest

from thermaxis.errors import MeasurementFileError
from thermaxis.files import read_wide_csv
from thermaxis.positioning import BACKWARD, FORWARD, Cycle, PositioningTest, TimeSource
from thermaxis.quantities import AxisKind

TARGETS = (0.0, 100.0, 250.5)
ASSUMED = (
    "no unit of the deviations is stated: {} was assumed; to state it, write a line '# unit: {}'\
 above the headings, or head the runs as run_1_{}"
)


def row(target: float, runs: int = 4) -> str:
    """Target and the deviations of its runs: run plus a hundredth of the target."""
    return ",".join([str(target), *(str(run + target / 100) for run in range(1, runs + 1))])


ROWS = [row(target) for target in TARGETS]


def read(tmp_path: Path, *lines: str) -> PositioningTest:
    path = tmp_path / "run.csv"
    path.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    return read_wide_csv(path)


def refused(tmp_path: Path, *lines: str) -> str:
    with pytest.raises(MeasurementFileError) as caught:
        read(tmp_path, *lines)
    assert caught.value.remedy
    return str(caught.value)


def assert_the_run(test: PositioningTest, scale: float = 1.0) -> None:
    np.testing.assert_array_equal(test.target, TARGETS)
    assert test.deviation.shape == (3, 2, 2)
    for i, j, a in np.ndindex(3, 2, 2):
        expected = (2 * j + 1 + a + TARGETS[i] / 100) * scale
        assert test.deviation[i, j, a] == pytest.approx(expected)


@pytest.mark.parametrize(
    "heading",
    [
        "target_mm,run_1_um,run_2_um,run_3_um,run_4_um",
        "Target (mm),1 (µm),2 (µm),3 (µm),4 (µm)",
        "Position [mm],Run 1 [um],Run 2 [um],Run 3 [um],Run 4 [um]",
        "target_mm,Run 1 µm,Run 2,Run 3,Run 4",
        "Poloha [mm],Běh 1 [µm],Běh 2 [µm],Běh 3 [µm],Běh 4 [µm]",
        "Soll (mm),1. Lauf (µm),2. Lauf (µm),3. Lauf (µm),4. Lauf (µm)",
        "Target (mm),Run 1 error (µm),Run 2 error (µm),Run 3 error (µm),Run 4 error (µm)",
    ],
)
def test_runs_alternate_from_forward(tmp_path: Path, heading: str) -> None:
    test = read(tmp_path, heading, *ROWS)
    assert_the_run(test)
    assert test.kind is AxisKind.LINEAR
    assert not any("assumed" in remark for remark in test.remarks)


def test_the_order_of_readings_is_deduced_from_the_run_numbers(tmp_path: Path) -> None:
    test = read(tmp_path, "target_mm,1,2,3,4", *ROWS)
    assert test.time_source is TimeSource.ORDER
    assert test.order_deduced
    assert test.order is not None
    np.testing.assert_array_equal(test.order[:, 0, FORWARD], [1, 2, 3])
    np.testing.assert_array_equal(test.order[:, 0, BACKWARD], [6, 5, 4])
    np.testing.assert_array_equal(test.order[:, 1, FORWARD], [7, 8, 9])
    assert any("deduced from the run numbers" in remark for remark in test.remarks)


def test_runs_without_unit_are_taken_as_micrometres_and_a_remark_says_so(tmp_path: Path) -> None:
    test = read(tmp_path, "target_mm,1,2,3,4", *ROWS)
    assert_the_run(test)
    assert ASSUMED.format("µm", "um", "um") in test.remarks


def test_runs_of_a_rotary_axis_without_unit_are_taken_as_seconds_of_arc(tmp_path: Path) -> None:
    test = read(tmp_path, "target_deg,1,2,3,4", *ROWS)
    assert test.kind is AxisKind.ROTARY
    assert ASSUMED.format("arcsec", "arcsec", "arcsec") in test.remarks
    assert_the_run(test)


@pytest.mark.parametrize("above", ["# unit: nm", "Unit: nm", "Units,nm"])
def test_the_unit_may_stand_above_the_headings(tmp_path: Path, above: str) -> None:
    test = read(tmp_path, above, "target_mm,1,2,3,4", *ROWS)
    assert_the_run(test, 1e-3)
    assert not any("assumed" in remark for remark in test.remarks)


def test_targets_of_a_rotary_axis_rise_through_a_full_turn(tmp_path: Path) -> None:
    test = read(tmp_path, "target_deg,1,2,3,4", *map(row, (200.0, 341.0, 29.5, 170.0)))
    np.testing.assert_array_equal(test.target, [200.0, 341.0, 389.5, 530.0])
    np.testing.assert_allclose(test.deviation[:, 0, FORWARD], [3.0, 4.41, 1.295, 2.7])
    assert test.order is not None
    np.testing.assert_array_equal(test.order[:, 0, FORWARD], [1, 2, 3, 4])
    assert any("(29.5° is 389.5°)" in remark for remark in test.remarks)


def test_a_wrong_or_mixed_unit_is_an_error(tmp_path: Path) -> None:
    assert "'K'" in refused(tmp_path, "# unit: K", "target_mm,1,2,3,4", *ROWS)
    assert "'arcsec'" in refused(tmp_path, "# unit: arcsec", "target_mm,1,2,3,4", *ROWS)
    assert "different units" in refused(tmp_path, "target_mm,1_um,2_nm,3_um,4_um", *ROWS)
    assert "column 1 (K)" in refused(tmp_path, "target_mm,1 (K),2,3,4", *ROWS)
    assert "column 1_arcsec" in refused(tmp_path, "target_mm,1_arcsec,2,3,4", *ROWS)
    assert "no unit is stated" in refused(tmp_path, "target,1,2,3,4", *ROWS)


def test_measured_positions_in_place_of_deviations_are_refused(tmp_path: Path) -> None:
    rows = [f"{target},{target + 0.01},{target - 0.02}" for target in (-20, 20, 50)]
    assert "measured positions" in refused(tmp_path, "# unit: mm", "target_mm,1,2", *rows)


def test_deviations_in_millimetres_are_read(tmp_path: Path) -> None:
    rows = ["0,0.001,0.002,0.001,0.002", "100,0.003,0.004,0.003,0.004"]
    test = read(tmp_path, "# unit: mm", "target_mm,1,2,3,4", *rows)
    np.testing.assert_allclose(test.deviation[1, :, BACKWARD], 4.0)


def test_columns_may_come_in_any_order_and_runs_may_be_missing(tmp_path: Path) -> None:
    rows = ["5,9,0,4,1,7", "6,9,10,4,1,8"]
    test = read(tmp_path, "5,3,target_mm,2,1,6", *rows)
    assert test.deviation.shape == (2, 3, 2)
    assert test.deviation[1, 2, FORWARD] == 6.0
    assert test.deviation[1, 2, BACKWARD] == 8.0
    assert np.isnan(test.deviation[:, 1, BACKWARD]).all()


def test_odd_runs_alone_are_a_unidirectional_run(tmp_path: Path) -> None:
    test = read(tmp_path, "target_mm,1,2,3,4", "0,1,,2,", "10,3,,4,", "20,5,,6,")
    assert test.measured_approaches == (True, False)
    assert test.order is not None
    np.testing.assert_array_equal(test.order[:, 1, FORWARD], [4, 5, 6])
    again = read(tmp_path, "target_mm,1,3", "0,1,2", "10,3,4", "20,5,6")
    np.testing.assert_array_equal(again.deviation, test.deviation)
    np.testing.assert_array_equal(again.order, test.order)


def test_a_missing_reading_stays_missing(tmp_path: Path) -> None:
    test = read(tmp_path, "target_mm,1,2,3,4,5", "0,1,2,,4,5", "10,1,2,3,4,5")
    assert np.isnan(test.deviation[0, 1, FORWARD])
    assert np.count_nonzero(np.isnan(test.deviation[:, :, FORWARD])) == 1


def test_targets_listed_from_the_largest_rise_and_forward_stays_forward(tmp_path: Path) -> None:
    test = read(tmp_path, "target_mm,1,2,3,4", *reversed(ROWS))
    assert_the_run(test)
    assert any("negative direction" in remark for remark in test.remarks)
    assert test.order is not None
    np.testing.assert_array_equal(test.order[:, 0, FORWARD], [3, 2, 1])


def test_other_columns_are_left_out_with_a_remark(tmp_path: Path) -> None:
    rows = [f"{line},0.5," for line in ROWS]
    test = read(tmp_path, "target_mm,1,2,3,4,Mean,", *rows)
    assert_the_run(test)
    assert "columns that hold no run were left out: 'Mean'" in test.remarks


def test_semicolons_with_decimal_commas_are_read(tmp_path: Path) -> None:
    lines = ["target_mm;1;2;3;4", *(line.replace(",", ";").replace(".", ",") for line in ROWS)]
    assert_the_run(read(tmp_path, *lines))


def test_the_same_target_or_run_twice_is_an_error(tmp_path: Path) -> None:
    assert "line 2 and line 5" in refused(tmp_path, "target_mm,1,2,3,4", *ROWS, ROWS[0])
    assert "headed as run 1" in refused(tmp_path, "target_mm,1,Run 1,3,4", *ROWS)


def test_a_heading_that_contradicts_the_alternation_is_an_error(tmp_path: Path) -> None:
    heading = "target_mm,Run 1 (forward),Run 2 (reverse),Run 3 (+),Run 4 (-)"
    assert_the_run(read(tmp_path, heading, *ROWS))
    heading = "target_mm,Run 1 (forward),Run 2 (forward),Run 3 (+),Run 4 (+)"
    assert "runs alternate from forward" in refused(tmp_path, heading, *ROWS)


@pytest.mark.parametrize("cell", ["nan", "abc", "1e400", "1;2"])
def test_what_is_no_number_is_an_error_with_line_and_column(tmp_path: Path, cell: str) -> None:
    message = refused(tmp_path, "target_mm,1,2,3,4", ROWS[0], f"100,1,2,{cell},4", ROWS[2])
    assert "line 3, column 3" in message


def test_a_stated_cycle_other_than_the_standard_one_leaves_no_order(tmp_path: Path) -> None:
    test = read(tmp_path, "# cycle: step", "target_mm,1,2,3,4", *ROWS)
    assert test.cycle is Cycle.STEP
    assert test.time_source is TimeSource.NONE


def test_a_tidy_table_is_not_read_as_a_wide_one(tmp_path: Path) -> None:
    assert "tidy" in refused(tmp_path, "cycle,direction,target_mm,deviation_um", "1,+,0,1")
