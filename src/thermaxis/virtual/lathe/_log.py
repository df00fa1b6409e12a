"""Logs of the virtual lathe, as a recorder beside the machine writes them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from thermaxis.errors import ConfigurationError, require_range
from thermaxis.files import write_thermal_log
from thermaxis.thermal import ThermalLog
from thermaxis.virtual.lathe._machine import VirtualLathe
from thermaxis.virtual.lathe._signals import (
    NOT_SEEN,
    PROBES,
    SENSORS,
    SIGNALS,
    UNCORRECTED,
    LatheReading,
)

LOG_COLUMNS = (
    "n_spindle_rpm",
    "n_table_rpm",
    *(name for name in SENSORS if "_2_" not in name),
    *PROBES,
    "gear",
    "coolant_on",
    "diameter_mm",
)
"""Signals that a log holds, in their order."""
MOST_ROWS = 10_000_000
"""Rows of the longest log. [1]"""
_PROGRESS_ROWS = 1000


def log_lathe(
    lathe: VirtualLathe,
    hours: float,
    *,
    every_s: float = 10.0,
    truth: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> ThermalLog:
    """Let a lathe run and write down what it shows.

    Parameters
    ----------
    lathe : VirtualLathe
        The machine; it goes on from where it is.
    hours : float
        For how long; the first row is taken at once, the last one before that time. [h]
    every_s : float
        Time between rows. Default: ten seconds, as in the examples. [s]
    progress : callable, optional
        Called now and then with rows done and their number.

    Returns
    -------
    ThermalLog
        Values whose status is not good, and all while the server does not answer, are NaN. Of a
        machine that touches the only displacement is ``Z_um``: what each touch has shown, in the
        row that is the first to know it.

    Raises
    ------
    ConfigurationError
        If there is no row, or more than ten million.
    """
    rows = int(hours * 3600.0 / every_s + 1e-6) if every_s > 0.0 else 0
    require_range("rows", rows, 1, MOST_ROWS)
    touched = lathe.settings.touch_every_s is not None
    kept = [n for n in LOG_COLUMNS if n not in PROBES[1:]] if touched else LOG_COLUMNS
    names = (*kept, *(UNCORRECTED if truth else ()))
    values = np.full((rows, len(names)), np.nan)
    begin_s, count = lathe.time_s, 0.0
    for row in range(rows):
        lathe.step_to(begin_s + row * every_s)
        if lathe.reachable:
            readings = dict(lathe.readings())
            if touched:
                before, count = count, readings["touch_count"].value or 0.0
                nothing = LatheReading(None, NOT_SEEN, lathe.time_s)
                readings["Z_um"] = nothing if count == before else readings["touch_um"]
            values[row] = [_logged(readings[name].value, readings[name].good) for name in names]
        if progress is not None and row % _PROGRESS_ROWS == 0:
            progress(row, rows)
    return ThermalLog.from_columns(
        {name: values[:, k] for k, name in enumerate(names)},
        time_s=every_s * np.arange(rows, dtype=np.float64),
        units={name: _unit(name) for name in names},
        name=lathe.scenario.name,
    )


def _unit(name: str) -> str:
    unit = SIGNALS[name].unit
    return "" if unit in {"bool", "1"} else unit


def _logged(value: float | bool | None, good: bool) -> float:  # noqa: FBT001 - a pair
    return float("nan") if value is None or not good else float(value)


def write_lathe_log(log: ThermalLog, path: Path | str) -> None:
    """Write a log as CSV or Parquet, by the end of the file's name.

    Parameters
    ----------
    path : Path or str
        The file, .csv or .parquet; one that is there is replaced.

    Raises
    ------
    ConfigurationError
        If the name ends in something else.
    OSError
        If the file cannot be written.
    """
    check_log_name(path)
    if Path(path).suffix.casefold() == ".csv":
        write_thermal_log(log, path)
        return
    log.to_polars().write_parquet(Path(path))


def check_log_name(path: Path | str) -> None:
    """Check that the end of a file's name says how a log is written."""
    suffix = Path(path).suffix
    if suffix.casefold() not in {".csv", ".parquet"}:
        raise ConfigurationError(
            "unknown_choice", name=suffix, known=(".csv", ".parquet"), file=path
        )
