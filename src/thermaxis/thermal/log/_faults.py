"""Act on faults of a log: mask what is no measurement, join a displacement that was re-zeroed.

Only what a channel shows without any model is acted upon; whatever is done is a remark of the log.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from thermaxis.codes import Message, Place, Value, remark
from thermaxis.thermal._arrays import FloatArray, significant
from thermaxis.thermal.log._quality import (
    LENGTHS,
    TEMPERATURES,
    check_log,
    out_of_range,
    resolution_of,
)
from thermaxis.thermal.log._resample import even_step_s
from thermaxis.thermal.log._thermal_log import ThermalLog

LEAST_MEASURED_SHARE = 0.05
"""A channel with a smaller share of good values, whose others differ, is not masked: its unit is
wrong. [1]"""
LEAST_LEAP_UM = 2.0
"""Smaller leaps of a displacement are left as they are. [µm]"""
MOST_LEAPS = 24
"""A displacement that leaps more often was not re-zeroed: it is made so. [1]"""
LARGEST_RANGE_UM = 2000.0
"""A length that changes by more is a position, no thermal displacement. [µm]"""
FAR_RANGES = 10.0
"""A lone displacement lies further from the median around it than so many times the range of all
medians: no machine moves there and back between two readings. [1]"""
FEWEST_REPEATED = 12
"""Values that stand and move on fewer times are not said to be touches. [1]"""
MOST_MOVES = 0.2
"""So are those that move in more of the rows than this share. [1]"""
LEAST_STEPS = 4.0
"""So are those that usually move by fewer steps: a touch of 1 um noise moves by ten of 0.1. [1]"""
_AROUND = 31
_MOST_ALIKE = 3
_LEAP_STDS = 7.0
_CLEAR = 2.5
_SIDES: Final = (2, 4, 8, 16, 32, 64)
_SWITCHED: Final = (0.05, 0.3)
"""Share of its range by which a channel changes at a switch: a temperature by more. [1]"""
_NEAR = 4
_SEARCHES = 8
_OFTEN = 0.2
"""A channel that changes so in more of all rows may do so at a leap by chance. [1]"""
_NORMAL_MEDIAN = 1.4826


def mask_rows(log: ThermalLog, first: int, last: int, channel: str = "") -> ThermalLog:
    """Return the log without the values of some rows: they count as missing.

    Parameters
    ----------
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
    if channel:
        told = _said("rows_masked", names[0], rows=rows, row=first, last=last)
    else:
        told = remark("all_rows_masked", rows=rows, row=first, last=last)
    return replace(log, columns=columns, remarks=(*log.remarks, told))


def without_faults(log: ThermalLog, *, as_logged: bool = False) -> ThermalLog:
    """Return the log without values that are no measurement, its displacements on one zero each.

    Parameters
    ----------
    as_logged : bool
        Whether only values that are no measurement are masked.

    Returns
    -------
    ThermalLog
        The same rows. Values that no sensor measures or that stand for a fault (-999, 850, ...)
        are NaN, unless they differ and hardly any other is left: there the unit is wrong. So are
        those of a sensor that stood still while it should have moved, but for the first, and lone
        displacements far from all others. A
        displacement that leaps from one row to the next, as when a probe is set to zero, is carried
        on from its former zero, unless its leaps cancel one another or are of few sizes, as those
        of a spindle or a coarse display are. A remark says each of them with its rows.
    """
    columns, remarks = dict(log.columns), list[Message]()
    for name, values in log.columns.items():
        columns[name] = measured_values(name, values, log.units[name], remarks)
    masked = replace(log, columns=columns)
    for finding in () if as_logged else check_log(masked):
        if finding.certain and finding.rows is not None:
            first, last = finding.rows
            kept = np.array(columns[finding.channel])
            kept[first + 1 : last] = np.nan
            columns[finding.channel] = kept
            values = {k: finding.message.values[k] for k in ("value", "unit", "lasts_s")}
            values |= {"rows": last - first - 1, "row": first + 1, "last": last - 1}
            remarks.append(_said("rows_stuck", finding.channel, **values))
    for name, unit in log.units.items():
        if unit in LENGTHS and not as_logged:
            columns[name] = _masked(name, columns[name], _lone(columns[name]), remarks)
            columns[name] = _on_one_zero(masked, name, columns[name], remarks)
    remarks += [
        _said("touches_repeated", name, **found)
        for name, unit in log.units.items()
        if unit in LENGTHS and (found := _repeated(columns[name] / LENGTHS[unit]))
    ]
    step_s = even_step_s(log.time_s)
    if step_s > log.usual_step_s:
        rows = round(step_s * log.rows / max(log.duration_s, step_s))
        remarks.append(remark("rows_in_bursts", rows=rows, step_s=significant(step_s, 3)))
    if not remarks:
        return log
    return replace(log, columns=columns, remarks=(*log.remarks, *remarks))


def measured_values(name: str, values: FloatArray, unit: str, remarks: list[Message]) -> FloatArray:
    """Return a channel without values that are no measurement; a remark says which.

    They are kept where hardly any other is left and they differ: there the unit is wrong.
    """
    present = np.flatnonzero(~np.isnan(values))
    if not present.size:
        return values
    wrong = present[out_of_range(values[present], unit)]
    many = wrong.size > (1.0 - LEAST_MEASURED_SHARE) * present.size
    if not wrong.size or (many and np.unique(values[wrong]).size > _MOST_ALIKE):
        return values
    return _masked(name, values, wrong, remarks)


def _lone(values: FloatArray) -> NDArray[np.int64]:
    """Return the rows of displacements that leave all others and come back at once."""
    rows = np.flatnonzero(~np.isnan(values))
    y = values[rows]
    usual = float(np.ptp(np.quantile(y, (0.05, 0.95)))) if y.size else 0.0
    if y.size <= _AROUND or not float(np.ptp(y)) > FAR_RANGES * usual > 0.0:
        return rows[:0]
    medians = np.median(sliding_window_view(np.pad(y, _AROUND // 2, "reflect"), _AROUND), axis=1)
    return rows[np.abs(y - medians) > FAR_RANGES * max(float(np.ptp(medians)), usual)]


def _repeated(um: FloatArray) -> dict[str, Value]:
    """Return how many values stand, and in how many rows, where they do as touches that are held.

    A steady displacement of a coarse display stands, too, but moves on by a step or two.
    """
    um = um[~np.isnan(um)]
    steps = np.abs(np.diff(um))
    moves = steps[steps > 0.0]
    if not FEWEST_REPEATED <= moves.size <= MOST_MOVES * steps.size:
        return {}
    least = LEAST_STEPS * resolution_of(um)
    if float(np.ptp(um)) > LARGEST_RANGE_UM or float(np.median(moves)) < least:
        return {}
    return {"touches": moves.size + 1, "rows": um.size}


def _masked(
    name: str, values: FloatArray, wrong: NDArray[np.int64], remarks: list[Message]
) -> FloatArray:
    if not wrong.size:
        return values
    masked = np.array(values)
    masked[wrong] = np.nan
    at = {"example": float(values[wrong[0]]), "row": int(wrong[0]), "last": int(wrong[-1])}
    remarks.append(_said("values_no_measurement", name, count=wrong.size, **at))
    return masked


def _said(code: str, name: str, **values: Value) -> Message:
    return replace(remark(code, name=name, **values), place=Place(channel=name))


def _on_one_zero(
    log: ThermalLog, name: str, values: FloatArray, remarks: list[Message]
) -> FloatArray:
    rows = np.flatnonzero(~np.isnan(values))
    per_um = LENGTHS[log.units[name]]
    if rows.size < 4 * _SIDES[0] or not 0 < float(np.ptp(values[rows])) < LARGEST_RANGE_UM * per_um:
        return values
    sizes, mixed, spread = _steps(log, rows, values, LEAST_LEAP_UM * per_um)
    heights = np.array(list(sizes.values()))
    if heights.size and np.max(np.abs(heights)) < 1.5 * resolution_of(values[rows]):
        return values  # the display
    back = _come_back(heights.tolist(), spread)
    alike = _few_sizes(heights, spread)
    if back or alike or heights.size > MOST_LEAPS:
        most = significant(float(np.max(np.abs(heights))), 3)
        why = "back" if back else "alike" if alike else "often"
        at = {"unit": log.units[name], "row": min(sizes), "last": max(sizes)}
        remarks.append(
            _said("displacement_leaps", name, why=why, count=len(sizes), size=most, **at)
        )
        return values
    joined = np.array(values)
    joined[mixed] = np.nan
    for row, size in sizes.items():
        joined[row:] -= size
        of = {"size": significant(size, 3), "within": significant(2.0 * spread, 2)}
        at = {"unit": log.units[name], "row": row, "at_s": float(log.time_s[row])}
        remarks.append(_said("displacement_joined", name, **of, **at))
    return joined


def _steps(
    log: ThermalLog, rows: NDArray[np.int64], values: FloatArray, least_um: float
) -> tuple[dict[int, float], list[int], float]:
    """Return leaps by row that nothing switched, means over one of them, and the leaps' noise.

    Large leaps hide smaller ones, and are found anew more sharply when these are joined.
    """
    time_s, y = log.time_s[rows], values[rows]
    steps: dict[int, float] = {}
    mixed: dict[int, int] = {}
    spread = 0.0
    for _ in range(_SEARCHES):
        side, leaps = _sharpest(time_s, y)
        spread = _NORMAL_MEDIAN * float(np.nanmedian(np.abs(leaps)))
        by_row = np.zeros(log.rows)
        by_row[rows[1:]] = np.nan_to_num(leaps)
        least = max(_LEAP_STDS * spread, least_um)
        peaks = _peaks(leaps, side)
        if not peaks:
            break
        tried = [_step_at(y, place, side, spread) for place in peaks]
        heights = np.abs(leaps[peaks])
        others = (heights < least) | np.array([not size for size, _, _ in tried])
        others[min(len(peaks) // 2, MOST_LEAPS) :] = True
        least = max(least, _CLEAR * float(np.max(heights[others])))
        found: list[tuple[float, int]] = []
        for seen, (size, last, first) in zip(heights.tolist(), tried, strict=True):
            row = int(rows[first])
            if seen < least or not 0.0 < abs(size) < 2.0 * seen or _switched(log, row, by_row):
                continue
            found.append((size, first))
            steps[row] = steps.get(row, 0.0) + size
            if first - last == 2:
                mixed[row] = int(rows[first - 1])
                y[first - 1] = y[last]
        if not found:
            break
        for size, first in found:
            y[first:] -= size
    kept = {row: size for row, size in sorted(steps.items()) if abs(size) >= least_um}
    return kept, [middle for row, middle in mixed.items() if row in kept], spread


def _step_at(y: FloatArray, place: int, side: int, spread: float) -> tuple[float, int, int]:
    """Return the size of a leap and the readings around it, 0 where it takes longer or goes back.

    A reading between the two is a mean over a time in which the zero changed.
    """
    weights = _weights(side)

    def at(last: int, first: int) -> tuple[float, float, int, int]:
        before, behind = y[max(last + 1 - side, 0) : last + 1], y[first : first + side]
        if before.size < side or behind.size < side:
            return np.inf, 0.0, last, first
        size = float(weights @ np.concatenate((before, behind)))
        slope = float(np.median(np.concatenate((np.diff(before), np.diff(behind)))))
        stays = float(np.median(behind[1:]) - np.median(before[:-1])) - slope * (
            first - last + side
        )
        unlike = abs(float(behind[0] - before[-1]) - size)
        return max(unlike, abs(stays - size) - 0.2 * abs(size)), size, last, first

    once, *others = (
        at(*ends) for ends in ((place, place + 1), (place - 1, place + 1), (place, place + 2))
    )
    best = min(others)
    unlike, size, last, first = once if once[0] < best[0] + 2.0 * spread else best
    return (size if unlike <= 0.35 * abs(size) + 3.0 * spread else 0.0), last, first


def _come_back(sizes: Sequence[float], spread: float) -> bool:
    """Say whether more than half of the leaps, or both of two, cancel the one before or behind."""
    pair = [abs(a + b) < 0.2 * abs(a) + 3.0 * spread for a, b in pairwise(sizes)]
    cancel = sum(a or b for a, b in zip([False, *pair], [*pair, False], strict=True))
    return bool(sizes) and (2 * cancel > len(sizes))


def _few_sizes(sizes: FloatArray, spread: float) -> bool:
    """Say whether leaps are of few sizes, as those of a display or of something that switches."""
    near = 2.0 * spread + 0.05 * float(np.max(np.abs(sizes), initial=0.0))
    different = 1 + int(np.count_nonzero(np.diff(np.sort(sizes)) > near))
    return sizes.size > _MOST_ALIKE and 3 * different <= sizes.size


def _sharpest(time_s: FloatArray, y: FloatArray) -> tuple[int, FloatArray]:
    """Return leaps over the number of rows at each side that leaves the smallest of them."""
    tried = [(side, _leaps(time_s, y, side)) for side in _SIDES if 4 * side <= y.size]
    return min(tried, key=lambda one: float(np.nanquantile(np.abs(one[1]), 0.98)))


def _leaps(time_s: FloatArray, y: FloatArray, side: int) -> FloatArray:
    """Return the leap behind each row, (n - 1,): NaN at both ends and across gaps.

    Straight lines through the rows at either side meet in the middle between two rows, but for
    the leap.
    """
    leaps = np.full(y.size - 1, np.nan)
    leaps[side - 1 : y.size - side] = np.correlate(y - y[0], _weights(side), "valid")
    width = time_s[2 * side - 1 :] - time_s[: time_s.size - 2 * side + 1]
    leaps[side - 1 : y.size - side][width > 1.5 * np.median(width)] = np.nan
    return leaps


def _weights(side: int) -> FloatArray:
    """Return what times the readings at both sides is the leap in the middle between them."""
    apart = np.arange(side) + 0.5
    off = apart - np.mean(apart)
    weights = 1.0 / side - np.mean(apart) * off / np.sum(off**2)
    return np.concatenate((-weights[::-1], weights))


def _peaks(leaps: FloatArray, side: int) -> list[int]:
    """Return places of the largest leaps, apart from one another."""
    left = np.nan_to_num(np.abs(leaps))
    peaks: list[int] = []
    while len(peaks) < 2 * MOST_LEAPS and left[peak := int(np.argmax(left))] > 0.0:
        peaks.append(peak)
        left[max(peak - 2 * side, 0) : peak + 2 * side + 1] = 0.0
    return peaks


def _switched(log: ThermalLog, row: int, leaps: FloatArray) -> bool:
    """Say whether what moves or heats the machine changed with the displacement.

    What changes most of the time, and mostly without a leap, says nothing.
    """
    near = slice(max(row - 2, 0), row + 2)
    for name, values in log.columns.items():
        unit, known = log.units[name], values[~np.isnan(values)]
        most = float(np.ptp(known)) if known.size else 0.0
        if unit in LENGTHS and most < LARGEST_RANGE_UM * LENGTHS[unit]:
            continue  # a displacement
        least = _SWITCHED[unit in TEMPERATURES] * most
        if not _spans(values[near])[0] > least > 0.0:
            continue
        here = slice(max(row - _NEAR + 1, 0), row + 1)
        elsewhere = np.delete(_spans(values) > least, here)
        moved = np.delete(_spans(leaps), here)[elsewhere]
        often = moved.size > _OFTEN * elsewhere.size
        if not often or float(np.median(moved)) > 0.25 * abs(float(leaps[row])):
            return True
    return False


def _spans(values: FloatArray) -> FloatArray:
    """Return largest less smallest measured value around each row, or of fewer rows, at once."""
    rows = min(_NEAR, values.size)
    windows = sliding_window_view(values, rows)
    return np.fmax.reduce(windows, axis=1) - np.fmin.reduce(windows, axis=1)
