"""Act on faults of a log: mask what is no measurement, join a displacement that was re-zeroed.

Only what a channel shows without any model is acted upon; whatever is done is a remark of the log.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from thermaxis.codes import Message, Place, remark
from thermaxis.thermal._arrays import FloatArray, significant
from thermaxis.thermal.log._quality import LENGTHS, TEMPERATURES, check_log, out_of_range
from thermaxis.thermal.log._resample import even_step_s
from thermaxis.thermal.log._thermal_log import ThermalLog

LEAST_MEASURED_SHARE = 0.05
"""A channel with a smaller share of good values is not masked: its unit is wrong. [1]"""
LEAST_LEAP_UM = 2.0
"""Smaller leaps of a displacement are left as they are. [µm]"""
MOST_LEAPS = 3
"""A displacement that leaps more often was not re-zeroed: it is made so. [1]"""
LARGEST_RANGE_UM = 2000.0
"""A length that changes by more is a position, no thermal displacement. [µm]"""
_LEAP_STDS = 7.0
_CLEAR = 2.5
_SIDES: Final = (2, 4, 8, 16, 32, 64)
_SWITCHED: Final = (0.05, 0.3)
"""Share of its range by which a channel changes at a switch: a temperature by more. [1]"""
_NORMAL_MEDIAN = 1.4826


def mask_rows(log: ThermalLog, first: int, last: int, channel: str = "") -> ThermalLog:
    """Return the log without the values of some rows: they count as missing.

    Parameters
    ----------
    log : ThermalLog
        The log.
    first, last : int
        First row and the one behind the last, counted from zero. [1]
    channel : str
        The column. Default: every column.

    Returns
    -------
    ThermalLog
        The same rows, with a remark.

    Raises
    ------
    DataError
        If there is no such column, or no row lies in the span.
    """
    names = [log.name_of(channel)] if channel else list(log.columns)
    rows = log.span(first, last).rows
    columns = dict(log.columns)
    for name in names:
        columns[name] = np.array(columns[name])
        columns[name][first:last] = np.nan
    last = first + rows - 1
    told = remark("all_rows_masked", rows=rows, row=first, last=last)
    if channel:
        told = remark("rows_masked", name=names[0], rows=rows, row=first, last=last)
        told = replace(told, place=Place(channel=names[0]))
    return replace(log, columns=columns, remarks=(*log.remarks, told))


def without_faults(log: ThermalLog, *, as_logged: bool = False) -> ThermalLog:
    """Return the log without values that are no measurement, its displacements on one zero each.

    Parameters
    ----------
    log : ThermalLog
        The log.
    as_logged : bool
        Whether only values that are no measurement are masked.

    Returns
    -------
    ThermalLog
        The same rows. Values that no sensor measures or that stand for a fault (-999, 850, ...)
        are NaN, unless hardly any other is left: there the unit is wrong. So are those of a sensor
        that stood still while it should have moved, but for the first. A displacement that leaps
        from one row to the next, as when a probe is set to zero, is carried on from its former
        zero. A remark says each of them with its rows.
    """
    columns, remarks = dict(log.columns), list[Message]()
    for name, values in log.columns.items():
        columns[name] = _measured(log, name, values, remarks)
    masked = replace(log, columns=columns)
    for finding in () if as_logged else check_log(masked):
        if finding.certain and finding.rows is not None:
            first, last = finding.rows
            kept = np.array(columns[finding.channel])
            kept[first + 1 : last] = np.nan
            columns[finding.channel] = kept
            said = remark(
                "rows_stuck",
                name=finding.channel,
                value=finding.message.values["value"],
                unit=finding.message.values["unit"],
                lasts_s=finding.message.values["lasts_s"],
                rows=last - first - 1,
                row=first + 1,
                last=last - 1,
            )
            remarks.append(replace(said, place=finding.message.place))
    for name, unit in log.units.items():
        if unit in LENGTHS and not as_logged:
            columns[name] = _on_one_zero(masked, name, columns[name], remarks)
    step_s = even_step_s(log.time_s)
    if step_s > log.usual_step_s:
        rows = round(step_s * log.rows / max(log.duration_s, step_s))
        remarks.append(remark("rows_in_bursts", rows=rows, step_s=significant(step_s, 3)))
    if not remarks:
        return log
    return replace(log, columns=columns, remarks=(*log.remarks, *remarks))


def _measured(log: ThermalLog, name: str, values: FloatArray, remarks: list[Message]) -> FloatArray:
    present = np.flatnonzero(~np.isnan(values))
    if not present.size:
        return values
    wrong = present[out_of_range(values[present], log.units[name])]
    if not 0 < wrong.size <= (1.0 - LEAST_MEASURED_SHARE) * present.size:
        return values
    masked = np.array(values)
    masked[wrong] = np.nan
    said = remark(
        "values_no_measurement",
        count=wrong.size,
        name=name,
        example=float(values[wrong[0]]),
        row=int(wrong[0]),
        last=int(wrong[-1]),
    )
    remarks.append(replace(said, place=Place(channel=name)))
    return masked


def _on_one_zero(
    log: ThermalLog, name: str, values: FloatArray, remarks: list[Message]
) -> FloatArray:
    rows = np.flatnonzero(~np.isnan(values))
    per_um = LENGTHS[log.units[name]]
    if rows.size < 4 * _SIDES[0] or not 0 < float(np.ptp(values[rows])) < LARGEST_RANGE_UM * per_um:
        return values
    time_s, y = log.time_s[rows], values[rows]
    side, leaps = _sharpest(time_s, y)
    spread = _NORMAL_MEDIAN * float(np.nanmedian(np.abs(leaps)))
    found = _clear_leaps(leaps, side, max(_LEAP_STDS * spread, LEAST_LEAP_UM * per_um))
    joined = np.array(values)
    for place in sorted(found):
        size = float(leaps[place])
        # A leap takes one step, and stays.
        at_once, beyond = float(y[place + 1] - y[place]), slice(place + 2, place + 2 + side)
        stays = float(np.median(y[beyond]) - np.median(y[max(place - side, 0) : place]))
        unlike = max(abs(at_once - size), abs(stays - size) - abs(size) * 0.2)
        row = int(rows[place + 1])
        if unlike > 0.35 * abs(size) + 3.0 * spread or _switched(log, row):
            continue
        joined[row:] -= size
        said = remark(
            "displacement_joined",
            name=name,
            size=significant(size, 3),
            within=significant(2.0 * spread, 2),
            unit=log.units[name],
            row=row,
            at_s=float(log.time_s[row]),
        )
        remarks.append(replace(said, place=Place(channel=name)))
    return joined


def _sharpest(time_s: FloatArray, y: FloatArray) -> tuple[int, FloatArray]:
    """Return leaps over the number of rows at each side that leaves the smallest of them."""
    tried = [(side, _leaps(time_s, y, side)) for side in _SIDES if 4 * side <= y.size]
    return min(tried, key=lambda one: float(np.nanquantile(np.abs(one[1]), 0.98)))


def _leaps(time_s: FloatArray, y: FloatArray, side: int) -> FloatArray:
    """Return the leap behind each row, (n - 1,): NaN at both ends and across gaps.

    Straight lines through the rows at either side meet in the middle between two rows, but for
    the leap.
    """
    apart = np.arange(side) + 0.5
    off = apart - np.mean(apart)
    weights = 1.0 / side - np.mean(apart) * off / np.sum(off**2)
    both = np.concatenate((-weights[::-1], weights))
    leaps = np.full(y.size - 1, np.nan)
    leaps[side - 1 : y.size - side] = np.correlate(y - y[0], both, "valid")
    width = time_s[2 * side - 1 :] - time_s[: time_s.size - 2 * side + 1]
    leaps[side - 1 : y.size - side][width > 1.5 * np.median(width)] = np.nan
    return leaps


def _clear_leaps(leaps: FloatArray, side: int, least: float) -> list[int]:
    """Return places of the few leaps that stand out from all others."""
    left = np.nan_to_num(np.abs(leaps))
    peaks: list[int] = []
    sizes: list[float] = []
    for _ in range(MOST_LEAPS + 1):
        peak = int(np.argmax(left))
        peaks.append(peak)
        sizes.append(float(left[peak]))
        left[max(peak - 2 * side, 0) : peak + 2 * side + 1] = 0.0
    clear = [n for n in range(1, MOST_LEAPS + 1) if sizes[n - 1] > max(least, _CLEAR * sizes[n])]
    return peaks[: max(clear, default=0)]


def _switched(log: ThermalLog, row: int) -> bool:
    """Say whether what moves or heats the machine changed with the displacement."""
    for name, values in log.columns.items():
        unit, known = log.units[name], values[~np.isnan(values)]
        near = values[max(row - 3, 0) : row + 3]
        near = near[~np.isnan(near)]
        change, most = (float(np.ptp(v)) if v.size else 0.0 for v in (near, known))
        if unit in LENGTHS and most < LARGEST_RANGE_UM * LENGTHS[unit]:
            continue  # a displacement
        if change > _SWITCHED[unit in TEMPERATURES] * most > 0.0:
            return True
    return False
