"""What is in a log, told before a model is made of it."""

import json
from math import sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from thermaxis.cli import main
from thermaxis.thermal import ThermalLog, suggest_inputs


def told(tmp_path: Path, text: str, *more: str) -> tuple[dict[str, Any], dict[str, Any]]:
    log, series, result = (tmp_path / name for name in ("log.csv", "series.json", "result.json"))
    log.write_text(text, encoding="utf-8")
    words = ["channels", str(log), "--series", str(series), "--json", str(result), *more]
    assert main(words) == 0
    found = [json.loads(path.read_text(encoding="ascii")) for path in (result, series)]
    return found[0]["logs"][0], found[1]["series"][0]


def log_of(names: str, rows: list[tuple[float, ...]]) -> str:
    lines = (",".join(f"{value:g}" for value in row) for row in rows)
    return "\n".join([f"time_s,{names}", *lines]) + "\n"


def test_a_temperature_that_moves_is_an_input_relative_to_the_one_named_as_surroundings(tmp_path):
    rows = [
        (10.0 * k, 20 + 0.1 * k, 20 + 0.01 * k, 20.0, 20.1 + 0.01 * k, 0.5 * k) for k in range(60)
    ]
    log, _ = told(tmp_path, log_of("T_spindle_C,T_air_C,T_oil_C,T_bath_C,Z_um", rows))
    assert log["suggested_inputs"] == [
        {"name": "spindle", "plus": "T_spindle_C", "minus": "T_air_C"}
    ]
    quantities = {one["name"]: one["quantity"] for one in log["channels"]}
    assert quantities["Z_um"] == "displacement"
    assert quantities["T_oil_C"] == "temperature"


def test_a_log_in_which_no_temperature_moves_suggests_no_input(tmp_path):
    rows = [(10.0 * k, 20.0, 0.5 * k) for k in range(60)]
    log, _ = told(tmp_path, log_of("T_spindle_C,Z_um", rows))
    assert log["suggested_inputs"] == []


def test_of_two_recorders_that_share_no_row_what_moves_is_an_input(tmp_path):
    k, odd = np.arange(120.0), np.arange(120) % 2 == 1
    columns = {
        "T_spindle_C": np.where(odd, np.nan, 20.0 + 0.1 * k),
        "T_air_C": np.where(odd, 20.0 + 0.01 * k, np.nan),
    }
    (one,) = suggest_inputs(ThermalLog.from_columns(columns, time_s=10.0 * k))
    assert one.expression == "T_spindle_C-T_air_C"


def test_a_sensor_that_rests_is_told_as_keys_of_a_configuration(tmp_path, capsys):
    rows = [
        (
            600.0 * k,
            round(22 + 0.5 * sin(k / 23), 1),
            round(22 + sin(k / 23 + 0.3) + 0.1 * (k % 2), 1),
        )
        for k in range(400)
    ]
    log, _ = told(
        tmp_path, log_of("T_column_C,T_air_C,Z_um", [(*row, 0.1 * row[0]) for row in rows])
    )
    (one,) = log["resting"]
    assert (one["name"], one["moves_with"]) == ("T_column_C", "T_air_C")
    assert (
        f'rests: moves_with = "T_air_C", rests_k = {one["rests_k"]:.2g}' in capsys.readouterr().out
    )


@pytest.mark.parametrize("rows", [3, 400, 20_000])
def test_a_line_of_any_length_keeps_the_lowest_the_highest_and_the_last_value(tmp_path, rows):
    values = [float((k * 7919) % 1009) for k in range(rows)]
    values[rows // 2] = 9000.0
    written = [(float(k), 20.0 + 0.001 * k, value) for k, value in enumerate(values)]
    _, series = told(tmp_path, log_of("T_a_C,Z_um", written), "--as-logged")
    line = next(one for one in series["lines"] if one["name"] == "Z_um")
    assert len(line["values"]) == len(line["time_h"]) <= 803
    assert max(line["values"]) == 9000.0
    assert min(line["values"]) == min(values)
    assert line["values"][-1] == values[-1]
    assert line["time_h"] == sorted(line["time_h"])


def test_rows_that_are_missing_leave_a_gap_in_the_line(tmp_path):
    rows = [(float(k), 20.0 + 0.01 * k, 0.1 * k) for k in range(4000) if not 1000 < k < 2000]
    _, series = told(tmp_path, log_of("T_a_C,Z_um", rows))
    assert [line["values"].count(None) for line in series["lines"]] == [1, 1]
