"""What charts of a log show, as JSON: lines of few points that keep every high and low."""

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from thermaxis import thermal
from thermaxis.cli._arguments import AddsArguments, adder
from thermaxis.cli._json import write_json
from thermaxis.report.thermal import drawn_line

_POINTS = 800
_Floats = NDArray[np.float64]


def add_series(to: AddsArguments) -> None:
    """Declare ``--series``."""
    text = "write what charts show over time as JSON: lowest and highest value of 400 stretches"
    adder(to)("--series FILE", text, Path)


def write_log_series(logs: Iterable[thermal.ThermalLog], path: Path) -> None:
    """Write every channel of logs."""
    found = [
        _series(log.where, "", log.time_s, {n: (v, log.units[n]) for n, v in log.columns.items()})
        for log in logs
    ]
    write_json({"series": found}, str(path))


def write_run_series(runs: Iterable[thermal.VerifiedOutput], path: Path) -> None:
    """Write what was measured along logs, what was simulated, and what is left."""
    found = [
        _series(
            run.log,
            run.measured.name,
            run.time_s,
            {
                "measured": (run.measured_um, "um"),
                "simulated": (run.simulated_um, "um"),
                "residual": (run.residual_um, "um"),
            },
        )
        for run in runs
    ]
    write_json({"series": found}, str(path))


def _series(
    log: str, output: str, time_s: _Floats, lines: Mapping[str, tuple[_Floats, str]]
) -> dict[str, object]:
    return {
        "log": log,
        "output": output,
        "lines": [
            {"name": name, "unit": unit, **_points(time_s, values)}
            for name, (values, unit) in lines.items()
        ],
    }


def _points(time_s: _Floats, values: _Floats) -> dict[str, object]:
    """Return the lowest and highest value of each stretch of time; null where rows are missing."""
    line = drawn_line(time_s / 3600.0, values, _POINTS)
    gaps = np.flatnonzero(np.isnan(line.y))
    line.x[gaps] = line.x[gaps - 1]
    return {"time_h": [_short(t) for t in line.x], "values": [_short(v) for v in line.y]}


def _short(value: float) -> float | None:
    """Return a number with as many digits as a chart shows."""
    return None if np.isnan(value) else float(f"{value:.6g}")
