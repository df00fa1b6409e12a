"""A day and a half of a real machine as a spindle test, beside numpy on the columns."""

from pathlib import Path

import numpy as np
import pytest

from thermaxis.files import read_thermal_log
from thermaxis.thermal import (
    Probes,
    ThermalTestKind,
    ThermalTestMotion,
    ThermalTestSetup,
    evaluate_thermal_test,
)

pytestmark = pytest.mark.real_data


def test_ranges_and_tilts_of_fl_thermal_are_those_of_its_columns(real_data: Path) -> None:
    path = real_data / "thermal" / "fl_thermal" / "fl_thermal_15s_rows_0_8891.csv"
    table = np.genfromtxt(path, delimiter=",", names=True)
    probes = [table[f"ch{k}_um"] for k in range(1, 6)]
    moving = np.flatnonzero(table["rpm"] > 1.0)
    begin, end = moving[0], moving[-1] + 1
    setup = ThermalTestSetup(
        Probes(*(f"ch{k}_um" for k in range(1, 6)), distance_mm=100.0),
        motion=ThermalTestMotion("rpm"),
    )
    test = evaluate_thermal_test(read_thermal_log(path), ThermalTestKind.SPINDLE, setup)
    series = dict(zip(("X1", "X2", "Y1", "Y2", "Z"), probes, strict=True))
    series |= {"A": 10.0 * (probes[2] - probes[3]), "B": 10.0 * (probes[0] - probes[1])}
    for one in test.quantities:
        own = series[one.name]
        assert one.whole.value == pytest.approx(np.ptp(own[begin:end]), rel=1e-9)
        assert one.first_hour.value == pytest.approx(np.ptp(own[begin : begin + 241]), rel=1e-9)
        assert one.cooling is not None
        assert one.cooling.value == pytest.approx(np.ptp(own[end - 1 :]), rel=1e-9)
    assert len(test.temperatures) == 16
    shares = {round(c.mean): c.time_s / 3600.0 for c in test.spectrum}
    assert shares == pytest.approx({0: 16, 1250: 4, 2500: 4, 3500: 4, 3750: 4, 5000: 4}, abs=0.01)
