"""Charts of what happened in a test: speeds, temperatures, displacements."""

from collections.abc import Mapping, Sequence

import numpy as np

from thermaxis.positioning import FloatArray
from thermaxis.report.thermal._lines import largest
from thermaxis.report.thermal._panels import LOOKS, MOST_LINES, Area, Panel, Trace
from thermaxis.thermal import ThermalLog

HOUR_S = 3600.0
"""Time is drawn in hours. [s]"""
_SPEED = "rpm"
_SHOWN_UNITS = {"rpm": "1/min", "um": "µm", "degC": "K", "K": "K", "degF": "K", "": "no unit"}


def speed_panel(log: ThermalLog) -> Panel | None:
    """Return the speeds of a test, None where none was recorded; the paper's figures 3 and 7."""
    speeds = {name: log.columns[name] for name, unit in log.units.items() if unit == _SPEED}
    known = {n: v for n, v in speeds.items() if not bool(np.all(np.isnan(v)))}
    if not known:
        return None
    return lines_panel("Speeds", "speed [1/min]", log.time_s, known, height_in=1.3)


def relative_values(
    log: ThermalLog, channel: str, reference_s: float | None, reference: float | None = None
) -> FloatArray:
    """Return a channel relative to its reference."""
    values = log.plain_column(channel)
    return values - (log.start_of(values, reference_s) if reference is None else reference)


def input_panels(
    log: ThermalLog,
    channels: Sequence[str],
    *,
    reference_s: float | None,
    stated: Mapping[str, float] | None = None,
) -> list[Panel]:
    """Return the inputs of a model in relative coordinates; the paper's figures 3 and 8."""
    by_unit: dict[str, dict[str, FloatArray]] = {}
    for channel in dict.fromkeys(channels):
        unit = log.units[log.name_of(channel)]
        if unit == _SPEED:
            continue
        shown = _SHOWN_UNITS.get(unit, unit)
        values = relative_values(log, channel, reference_s, (stated or {}).get(channel))
        by_unit.setdefault(shown, {})[channel] = values
    panels: list[Panel] = []
    for unit, series in by_unit.items():
        what = "temperature" if unit == "K" else "input"
        to = "stated references" if stated else "the start"
        title = f"Inputs relative to {to}"
        panels.append(lines_panel(title, f"{what} [{unit}]", log.time_s, series))
    return panels


def displacement_panel(time_s: FloatArray, measured: Mapping[str, FloatArray]) -> Panel:
    """Return measured displacements; the paper's figures 3 and 9."""
    return lines_panel(
        "Measured outputs relative to the start", "displacement [µm]", time_s, measured
    )


def lines_panel(
    title: str,
    quantity: str,
    time_s: FloatArray,
    series: Mapping[str, FloatArray],
    *,
    height_in: float = 1.55,
) -> Panel:
    """Return a panel of lines over hours."""
    drawn, others = largest(series, MOST_LINES)
    time_h = time_s / HOUR_S
    areas: tuple[Area, ...] = ()
    if others:
        table = np.stack([series[name] for name in others])
        low = np.min(np.where(np.isnan(table), np.inf, table), axis=0)
        high = np.max(np.where(np.isnan(table), -np.inf, table), axis=0)
        areas = (extent(f"{len(others)} others", time_h, low, high),)
        title += f": the {len(drawn)} of {len(series)} with the largest range"
    traces = tuple(
        Trace(name, time_h, series[name], look) for name, look in zip(drawn, LOOKS, strict=False)
    )
    return Panel(title=title, quantity=quantity, traces=traces, areas=areas, height_in=height_in)


def extent(label: str, x: FloatArray, low: FloatArray, high: FloatArray, most: int = 700) -> Area:
    """Return an area whose edges are reduced to their extremes."""
    known = np.isfinite(low) & np.isfinite(high)
    x, low, high = x[known], low[known], high[known]
    if x.size <= most:
        return Area(label, x, low, high)
    starts = np.arange(0, x.size, -(-x.size // most))
    low, high = np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts)
    return Area(label, x[starts], low, high)
