from pathlib import Path

import numpy as np
import pytest

from tests.refusals import check_refusals
from tests.unit.files.builders import remarks_of
from thermaxis.files import read_positioning
from thermaxis.positioning import BACKWARD, FORWARD, Cycle, PositioningTest, TimeSource
from thermaxis.quantities import AxisKind

TARGETS = (0.0, 100.0, 250.5)
ASSUMED = (
    "no unit of the deviations is stated: {} was assumed; to state it, write a line '# unit: {}'\
 above the headings, or head the runs as run_1_{}"
)


def row(target: float, runs: int = 4, divisor: float = 1.0) -> str:
    """Target and the deviations of its runs: run plus a hundredth of the target."""
    return ",".join(
        [str(target), *(str((run + target / 100) / divisor) for run in range(1, runs + 1))]
    )


ROWS = [row(target) for target in TARGETS]


def read(tmp_path: Path, *lines: str) -> PositioningTest:
    path = tmp_path / "run.csv"
    path.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    return read_positioning(path)


def assert_the_run(test: PositioningTest, scale: float = 1.0) -> None:
    np.testing.assert_array_equal(test.target, TARGETS)
    assert test.deviation.shape == (3, 2, 2)
    for i, j, a in np.ndindex(3, 2, 2):
        expected = (2 * j + 1 + a + TARGETS[i] / 100) * scale
        assert test.deviation[i, j, a] == pytest.approx(expected)


RUNS = "target_mm,1,2,3,4"
STATED = [
    "target_mm,run_1_um,run_2_um,run_3_um,run_4_um",
    "target_mm,Run 1 µm,Run 2,Run 3,Run 4",
    "Poloha [mm],Běh 1 [µm],Běh 2 [µm],Běh 3 [µm],Běh 4 [µm]",
    "Soll (mm),1. Lauf (µm),2. Lauf (µm),3. Lauf (µm),4. Lauf (µm)",
    "Target (mm),Run 1 error (µm),Run 2 error (µm),Run 3 error (µm),Run 4 error (µm)",
]


@pytest.mark.parametrize(
    ("lines", "scale", "remark"),
    [
        *(([heading, *ROWS], 1.0, "") for heading in STATED),
        *(([above, RUNS, *ROWS], 1e-3, "") for above in ("# unit: nm", "Unit: nm", "Units,nm")),
        (["# unit: mm", RUNS, *(row(t, 4, 1e3) for t in TARGETS)], 1.0, ""),
        ([RUNS, *ROWS], 1.0, ASSUMED.format("µm", "um", "um")),
        (["target_deg,1,2,3,4", *ROWS], 1.0, ASSUMED.format(*["arcsec"] * 3)),
        (
            ["target_mm,Run 1 (forward),Run 2 (reverse),Run 3 (+),Run 4 (-)", *ROWS],
            *(1.0, ASSUMED.format("µm", "um", "um")),
        ),
        (
            [
                line.replace(",", cell, 1)
                for line, cell in zip((RUNS, *ROWS), (",,", ",x,", ",,", ",,"), strict=True)
            ],
            *(1.0, "columns that hold no run were left out: 'column 2'"),
        ),
        (
            [f"{RUNS},Mean,", *(f"{line},0.5," for line in ROWS)],
            *(1.0, "columns that hold no run were left out: 'Mean'"),
        ),
        (
            [line.replace(",", ";").replace(".", ",") for line in (RUNS, *ROWS)],
            *(1.0, ASSUMED.format("µm", "um", "um")),
        ),
    ],
)
def test_runs_alternate_from_forward(
    tmp_path: Path, lines: list[str], scale: float, remark: str
) -> None:
    test = read(tmp_path, *lines)
    assert_the_run(test, scale)
    assert test.kind is (AxisKind.ROTARY if "deg" in lines[0] else AxisKind.LINEAR)
    assert any("assumed" in said for said in remarks_of(test)) or "assumed" not in remark
    assert remark in (remarks_of(test) if remark else [""])
    if not remark:
        assert not any("assumed" in said for said in remarks_of(test))


def test_what_cannot_be_meant_is_refused_with_its_place(tmp_path: Path) -> None:
    positions = [f"{t},{t + 0.01},{t - 0.02}" for t in (-20, 20, 50)]
    direction = "target_mm,Run 1 (forward),Run 2 (forward),Run 3 (+),Run 4"
    cases = [
        (["# unit: K", RUNS, *ROWS], "line 2: unit_of_deviations"),
        (["# unit: arcsec", RUNS, *ROWS], "line 2: unit_of_deviations"),
        (["target_mm,1_um,2_nm,3_um,4_um", *ROWS], "line 1, column 2_nm: units_of_runs_differ"),
        (["target_mm,1 (K),2,3,4", *ROWS], "line 1, column 1 (K): unknown_length_or_angle"),
        (["target_mm,1_arcsec,2,3,4", *ROWS], "line 1, column 1_arcsec: unit_of_other_kind"),
        (["target,1,2,3,4", *ROWS], "line 1, column target: unit_not_stated"),
        ([RUNS, "0,0.004,0,0,0", "9,0.049,0,0,0"], "line 1: unit_implausible"),
        (["# unit: mm", "target_mm,1,2", *positions], "line 2: positions_not_deviations"),
        ([RUNS, *ROWS, ROWS[0]], "line 5: reading_twice"),
        (["target_mm,1,Run 1,3,4", *ROWS], "line 1, column Run 1: run_twice"),
        ([direction, *ROWS], "line 1, column Run 2 (forward): run_of_other_direction"),
        ([RUNS, ROWS[0], "100,1,2,abc,4", ROWS[2]], "line 3, column 3: not_a_number"),
        ([RUNS, ROWS[0], "100,1,2,1;2,4", ROWS[2]], "line 3, column 3: not_a_number"),
        ([RUNS, ROWS[0], "100,1,2,1e400,4", ROWS[2]], "line 3, column 3: magnitude_too_large"),
    ]
    wrong = {"".join(f"{line}\n" for line in lines): said for lines, said in cases}
    check_refusals(read_positioning, tmp_path / "run.csv", wrong)


def test_the_order_of_readings_is_deduced_from_the_run_numbers(tmp_path: Path) -> None:
    test = read(tmp_path, "target_mm,1,2,3,4", *ROWS)
    assert test.time_source is TimeSource.ORDER
    assert test.order_deduced
    np.testing.assert_array_equal(test.order[:, 0, FORWARD], [1, 2, 3])
    np.testing.assert_array_equal(test.order[:, 0, BACKWARD], [6, 5, 4])
    np.testing.assert_array_equal(test.order[:, 1, FORWARD], [7, 8, 9])
    assert any("deduced from the run numbers" in remark for remark in remarks_of(test))


def test_targets_of_a_rotary_axis_rise_through_a_full_turn(tmp_path: Path) -> None:
    test = read(tmp_path, "target_deg,1,2,3,4", *map(row, (200.0, 341.0, 29.5, 170.0)))
    np.testing.assert_array_equal(test.target, [200.0, 341.0, 389.5, 530.0])
    np.testing.assert_allclose(test.deviation[:, 0, FORWARD], [3.0, 4.41, 1.295, 2.7])
    np.testing.assert_array_equal(test.order[:, 0, FORWARD], [1, 2, 3, 4])
    assert any("(29.5° is 389.5°)" in remark for remark in remarks_of(test))


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
    np.testing.assert_array_equal(test.order[:, 1, FORWARD], [4, 5, 6])
    again = read(tmp_path, "target_mm,1,3", "0,1,2", "10,3,4", "20,5,6")
    np.testing.assert_array_equal(again.deviation, test.deviation)
    np.testing.assert_array_equal(again.order, test.order)


def test_targets_listed_from_the_largest_rise_and_forward_stays_forward(tmp_path: Path) -> None:
    test = read(tmp_path, "target_mm,1,2,3,4", *reversed(ROWS))
    assert_the_run(test)
    assert any("negative direction" in remark for remark in remarks_of(test))
    np.testing.assert_array_equal(test.order[:, 0, FORWARD], [3, 2, 1])


def test_a_stated_cycle_other_than_the_standard_one_leaves_no_order(tmp_path: Path) -> None:
    test = read(tmp_path, "# cycle: step", "target_mm,1,2,3,4", *ROWS)
    assert test.cycle is Cycle.STEP
    assert test.time_source is TimeSource.NONE
