"""Logs of the virtual lathe: what identify reads, and what a model of them is worth."""

from pathlib import Path

import numpy as np

from tests.refusals import refused
from thermaxis.files import read_thermal_log
from thermaxis.virtual import Fault, FaultKind, VirtualLathe, log_lathe, write_lathe_log
from thermaxis.virtual.lathe import LOG_COLUMNS, UNCORRECTED


def test_a_log_reads_back_the_same(tmp_path: Path) -> None:
    log = log_lathe(VirtualLathe("calibration-table", 2), 1.0, every_s=5.0, truth=True)
    for name in ("log.parquet", "LOG.CSV"):
        write_lathe_log(log, tmp_path / name)
        back = read_thermal_log(tmp_path / name)
        assert list(back.columns) == [*LOG_COLUMNS, *UNCORRECTED]
        assert dict(back.units) == dict(log.units)
        assert np.array_equal(back.time_s, log.time_s)
        for column, values in log.columns.items():
            assert np.array_equal(back.columns[column], values, equal_nan=True)
        assert back.units["T_spindle_C"] == "degC"
        assert back.units["n_table_rpm"] == "rpm"
        assert back.units["Z_D3000_um"] == "um"


def test_the_same_seed_writes_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a.csv", "b.csv"):
        write_lathe_log(log_lathe(VirtualLathe("day", 7), 2.0), tmp_path / name)
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


def test_rows_begin_where_the_machine_is() -> None:
    lathe = VirtualLathe("calibration-spindle", 1)
    lathe.step(7200.0)
    log = log_lathe(lathe, 0.5, every_s=60.0)
    assert log.rows == 30
    assert log.time_s[0] == 0.0
    assert lathe.time_s == 7200.0 + 29 * 60.0
    assert log.column("n_spindle_rpm")[0] == 3500.0


def test_faults_and_a_lost_network_are_gaps_in_the_log_but_a_stuck_sensor_is_none() -> None:
    faults = (
        Fault(FaultKind.BAD, ("T_table_C",), at_s=600.0, for_s=300.0),
        Fault(FaultKind.PAUSE, (), at_s=1200.0, for_s=120.0),
        Fault(FaultKind.STUCK, ("T_spindle_C",), at_s=1800.0, for_s=1800.0),
        Fault(FaultKind.NAN, ("T_column_C",), at_s=0.0, for_s=60.0),
    )
    log = log_lathe(VirtualLathe("calibration-spindle", 1, faults=faults), 2.0, every_s=60.0)
    gone = {name: np.flatnonzero(np.isnan(log.columns[name])).tolist() for name in log.columns}
    assert gone["T_table_C"] == [10, 11, 12, 13, 14, 20, 21]
    assert gone["T_spindle_C"] == gone["Z_um"] == gone["gear"] == [20, 21]
    assert gone["T_column_C"] == [0, 20, 21]
    spindle = log.column("T_spindle_C")
    assert np.ptp(spindle[30:60]) == 0.0
    assert spindle[60] > spindle[59] + 0.5


def test_a_log_without_rows_or_of_too_many_is_refused() -> None:
    for hours, every_s in ((0.0, 10.0), (1.0, 0.0), (1e-4, 10.0), (1e7, 1.0)):
        with refused("outside_range"):
            log_lathe(VirtualLathe(), hours, every_s=every_s)


def test_a_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    log = log_lathe(VirtualLathe(), 0.1)
    with refused("unknown_choice"):
        write_lathe_log(log, tmp_path / "log.xlsx")


def test_the_displacements_of_the_verification_are_as_large_as_the_papers() -> None:
    log = log_lathe(VirtualLathe("verification", 1), 16.0, every_s=300.0, truth=True)
    ranges = [float(np.ptp(log.column(name))) for name in UNCORRECTED]
    assert all(100.0 < r < 300.0 for r in ranges)
    assert ranges[1] < ranges[2] < ranges[3]
    measured = log.column("Z_D3000_um")
    turning = log.column("n_table_rpm") > 0.0
    assert np.all(np.isnan(measured[turning]))
    assert np.all(~np.isnan(measured[~turning]))
