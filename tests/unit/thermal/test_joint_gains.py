"""Parts and their gains by diameter come back from one test at all diameters."""

import pytest

from tests.refusals import refused
from thermaxis.thermal import ModalOptions, Records, joint_gains, parse_input, records_of
from thermaxis.virtual import generate_lathe_test

INPUTS = (
    parse_input("spindle=T_spindle_C-T_column_C"),
    parse_input("table=T_table_C-T_column_C"),
)
DIAMETERS = {"Z_D0_um": 0.0, "Z_D1500_um": 1500.0, "Z_D3000_um": 3000.0}


# two lags and blocks of ten minutes: half of the time; the gains do not depend on them
QUICK = ModalOptions(most_lags=2, block_s=600.0)


@pytest.fixture(scope="module")
def records() -> Records:
    return records_of([generate_lathe_test("verification")], INPUTS, [*DIAMETERS, "Z_um"])


def test_the_lathes_gains_come_back(records: Records) -> None:
    found = joint_gains(records, "table", DIAMETERS, options=QUICK)
    assert found.reference == "Z_D0_um"
    assert [p.diameter_mm for p in found.gain.points] == [0.0, 1500.0, 3000.0]
    assert [p.gain for p in found.gain.points] == pytest.approx([1.0, 1.6, 2.2], rel=0.02)
    table = found.result.model.parts[1]
    assert table.dc_gain == pytest.approx(-20.0, rel=0.1)


def test_the_tool_centre_point_is_the_reference_where_it_is_named(records: Records) -> None:
    found = joint_gains(records, "table", {"Z_D3000_um": 3000.0, "Z_um": None}, options=QUICK)
    assert found.reference == "Z_um"
    assert found.gain.tool_gain == 1.0
    assert [p.gain for p in found.gain.points] == pytest.approx([2.2], rel=0.02)


def test_what_cannot_be_joint_is_refused(records: Records) -> None:
    for part, diameters, code in (
        ("turret", DIAMETERS, "unknown_name"),
        ("table", {"Z_D0_um": 0.0}, "too_few_joint_channels"),
        ("table", {"Z_D0_um": 0.0, "Q_um": 1.0}, "unknown_name"),
    ):
        with refused(code, key="joint"):
            joint_gains(records, part, diameters)
