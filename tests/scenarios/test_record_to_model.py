"""A recording becomes a model without a mapping file: record, identify, verify, merge."""

import json
import math
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from asyncua import ua

from tests.unit.runtime.recording import START, Recording, channel, good, rows_of, settings
from thermaxis.cli import main
from thermaxis.files import read_thermal_log
from thermaxis.runtime.record import _files as _recorder_files

pytestmark = pytest.mark.usefixtures("one_clock_and_regime")

GAIN_UM_PER_K, TAU_S = 12.0, 1800.0
HEATING_S, WARMING_S = 4 * 3600.0, 2400.0
NAME = "lathe-2026-11-21.csv"

CHANNELS = (
    channel("T_spindle_C", 30_000),
    channel("T_column_C", 60_000),
    channel("Z_um", 30_000, unit="um"),
)


@pytest.fixture(autouse=True)
def _quick_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_recorder_files.os, "fsync", lambda _descriptor: None)


def machine(start: datetime) -> Callable[[str, datetime], ua.DataValue]:
    """A machine that warms by 10 K for hours and cools, with the closed form of its growth."""

    def answer(node: str, now: datetime) -> ua.DataValue:
        t = (now - start).total_seconds() - 600.0
        if node.endswith("T_column_C"):
            return good(round(21.0 + 0.01 * math.sin(t / 900.0), 2), now)
        spindle = (
            (answered(t, warmth), 2) if node.endswith("T_spindle_C") else (answered(t, growth), 1)
        )
        return good(round(*spindle) + (21.0 if node.endswith("T_spindle_C") else 0.0), now)

    return answer


def answered(t: float, step: Callable[[float], float]) -> float:
    """A step on, and the same step off again."""
    return (step(t) if t > 0 else 0.0) - (step(t - HEATING_S) if t > HEATING_S else 0.0)


def warmth(t: float) -> float:
    """Excess of the spindle after a step of heat. [K]"""
    return 10.0 * (1.0 - math.exp(-t / WARMING_S))


def growth(t: float) -> float:
    """Displacement: the spindle's excess through a lag. [um]"""
    a, b = WARMING_S, TAU_S
    lagged = 1.0 - (a * math.exp(-t / a) - b * math.exp(-t / b)) / (a - b)
    return 10.0 * GAIN_UM_PER_K * lagged


def recorded(
    folder: Path, start: datetime = START, hours: float = 7.0, first_h: float = 0.0
) -> None:
    begin = start + timedelta(hours=first_h)
    Recording(settings(*CHANNELS), folder, begin).run(hours * 3600.0, answer=machine(start))


def identified(log: Path, method: str = "oe") -> tuple[float, float]:
    """Return gain and time constant that the command finds."""
    model = log.with_suffix(".model.json")
    words = ["--output", "Z_um", "--input", "spindle=T_spindle_C-T_column_C", "--model", str(model)]
    assert main(["identify", str(log), *words, "--method", method, "--sample-time", "60"]) == 0
    part = json.loads(model.read_text())["outputs"][0]["parts"][0]
    gains = [section["gain_um_per_k"] for section in part["sections"]]
    taus = [section["time_constant_s"] for section in part["sections"]]
    total = sum(gains) + part.get("direct_gain_um_per_k", 0.0)
    return total, sum(g * t for g, t in zip(gains, taus, strict=True)) / total


def test_a_recording_with_a_break_is_one_log_in_which_identify_sees_the_gap(tmp_path, capsys):
    recorded(tmp_path, hours=2.0)
    recorded(tmp_path, hours=4.0, first_h=3.0)
    assert [path.name for path in tmp_path.glob("*.csv")] == [NAME]
    log = read_thermal_log(tmp_path / NAME)
    assert np.max(np.diff(log.time_s)) == 3600.0  # from the marker to the first new row
    even = log.resample(60.0)
    missing = np.isnan(even.columns["Z_um"])
    assert np.flatnonzero(missing).tolist() == list(range(120, 180))
    capsys.readouterr()
    gain, lag_s = identified(tmp_path / NAME, "modal")
    said = " ".join(capsys.readouterr().out.split())  # whatever its lines are
    assert "T_spindle_C, Z_um: missing in 1 place for 3600 s in all" in said
    assert gain == pytest.approx(GAIN_UM_PER_K, rel=0.05)
    assert lag_s == pytest.approx(TAU_S, rel=0.1)


def test_a_recording_gives_the_model_of_the_machine_which_holds_on_another_day(tmp_path, capsys):
    recorded(tmp_path)
    gain, lag_s = identified(tmp_path / NAME)
    assert gain == pytest.approx(GAIN_UM_PER_K, rel=0.03)
    assert lag_s == pytest.approx(TAU_S, rel=0.05)
    capsys.readouterr()
    recorded(tmp_path, start=START + timedelta(days=1))
    model = tmp_path / "lathe-2026-11-21.model.json"
    result = tmp_path / "verified.json"
    other = tmp_path / "lathe-2026-11-22.csv"
    assert main(["verify", str(model), str(other), "--json", str(result)]) == 0
    assert "Z_um" in capsys.readouterr().out
    figures = json.loads(result.read_text())["outputs"]["Z_um"]
    assert figures["rows"] == 840
    assert figures["peak_to_peak_um"]["reduction"] > 50.0


def test_two_recorders_are_joined_by_their_clocks(tmp_path):
    start, hours = START, 1.0
    answer = machine(start)
    control, probe = tmp_path / "control", tmp_path / "probe"
    Recording(settings(*CHANNELS[:2]), control, start).run(hours * 3600.0, answer=answer)
    Recording(settings(CHANNELS[2]), probe, start).run(hours * 3600.0, answer=answer)
    joined = tmp_path / "joined.csv"
    assert main(["merge", str(control / NAME), str(probe / NAME), "-o", str(joined)]) == 0
    log = read_thermal_log(joined)
    assert log.rows == 120
    assert list(log.columns) == ["T_spindle_C", "T_column_C", "Z_um"]
    assert np.count_nonzero(~np.isnan(log.columns["T_column_C"])) == 60
    alone = [float(cells[1]) for cells in rows_of(probe / NAME)]
    assert log.columns["Z_um"].tolist() == alone
