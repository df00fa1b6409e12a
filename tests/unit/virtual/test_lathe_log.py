"""Logs of the virtual lathe: what identify reads, and what a model of them is worth."""

from pathlib import Path

import numpy as np
import pytest

from tests.refusals import refused
from thermaxis.compensation import Provenance
from thermaxis.files import read_thermal_log
from thermaxis.thermal import (
    Baseline,
    ModalOptions,
    ThermalLog,
    fit_baseline,
    identify_joint,
    parse_input,
    records_of,
    simulate_baseline,
    simulate_log,
)
from thermaxis.virtual import Fault, FaultKind, VirtualLathe, log_lathe, write_lathe_log
from thermaxis.virtual.lathe import LOG_COLUMNS, PROBES, UNCORRECTED

DIAMETERS = (None, 0.0, 1500.0, 3000.0)


@pytest.mark.parametrize("name", ["log.csv", "log.parquet", "LOG.CSV"])
def test_a_log_reads_back_the_same(tmp_path: Path, name: str) -> None:
    log = log_lathe(VirtualLathe("calibration-table", 2), 1.0, every_s=5.0, truth=True)
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


@pytest.mark.parametrize(("hours", "every_s"), [(0.0, 10.0), (1.0, 0.0), (1e-4, 10.0), (1e7, 1.0)])
def test_a_log_without_rows_or_of_too_many_is_refused(hours: float, every_s: float) -> None:
    with refused("outside_range"):
        log_lathe(VirtualLathe(), hours, every_s=every_s)


def test_a_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    log = log_lathe(VirtualLathe(), 0.1)
    with refused("unknown_choice"):
        write_lathe_log(log, tmp_path / "log.xlsx")


# ---- what a model of the logs is worth ----------------------------------------------------------


@pytest.fixture(scope="module")
def logs() -> dict[str, ThermalLog]:
    hours = {"calibration-spindle": 14.25, "calibration-table": 14.25, "verification": 16.0}
    return {
        name: log_lathe(VirtualLathe(name, 1), hours[name], every_s=300.0, truth=True)
        for name in hours
    }


def folds(truth: ThermalLog, simulated: list[np.ndarray]) -> list[float]:
    """By how much the range of the true displacement falls, by position."""
    found = []
    for name, z in zip(UNCORRECTED, simulated, strict=True):
        true = truth.column(name)
        found.append(float(np.ptp(true) / np.ptp(true - z)))
    return found


@pytest.mark.system
@pytest.mark.timeout(600)
def test_a_transfer_function_model_of_the_calibration_tests_takes_most_of_the_true_error_away(
    logs: dict[str, ThermalLog],
) -> None:
    """The paper's Table 3: at least a sixth, up to a ninth; no static regression comes near."""
    tests = [logs["calibration-spindle"], logs["calibration-table"]]
    truth = logs["verification"]
    inputs = [
        parse_input(text, channels=truth.columns)
        for text in ("spindle=T_spindle_C-T_column_C", "table=T_table_C-T_column_C")
    ]
    records = records_of(tests, inputs, PROBES)
    # with four lags, as by default, the compensated lathe of the scenarios is identified
    joint = identify_joint(
        records,
        "Z_um",
        "table",
        dict(zip(PROBES, DIAMETERS, strict=True)),
        modal_options=ModalOptions(most_lags=2),
    )
    model = joint.to_compensation_model(records, Provenance())
    simulated = [
        simulate_log(model, truth, diameter_mm=d).outputs["Z_um"].displacement_um for d in DIAMETERS
    ]
    assert min(folds(truth, simulated)) > 7.0
    (gains,) = [p for o in model.outputs for p in o.parts if p.gain_by_diameter]
    assert [g.gain for g in gains.gain_by_diameter] == pytest.approx([1.0, 1.6, 2.2], abs=0.1)

    u = np.stack([truth.column(d.plus) - truth.column("T_column_C") for d in inputs], axis=1)
    u -= u[:2].mean(axis=0)
    static = []
    for probe in PROBES:
        fitted = fit_baseline(Baseline.STATIC, records.experiments[probe])
        static.append(simulate_baseline(fitted, u, 300.0))
    assert max(folds(truth, static)) < 4.0


def test_the_displacements_of_the_verification_are_as_large_as_the_papers(
    logs: dict[str, ThermalLog],
) -> None:
    ranges = [float(np.ptp(logs["verification"].column(name))) for name in UNCORRECTED]
    assert all(100.0 < r < 300.0 for r in ranges)
    assert ranges[1] < ranges[2] < ranges[3]
    measured = logs["verification"].column("Z_D3000_um")
    turning = logs["verification"].column("n_table_rpm") > 0.0
    assert np.all(np.isnan(measured[turning]))
    assert np.all(~np.isnan(measured[~turning]))
