"""Join the logs of two recorders by time.

The rows of both are kept as they are: the joined log has the union of their times, and a channel
is NaN where its recorder had no row. Nothing is interpolated, so outputs that are seen for a few
seconds at a time stay what was measured.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import timedelta
from typing import final

import numpy as np

from thermaxis.codes import Message, remark
from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray, significant
from thermaxis.thermal.log._resample import usual_step_s
from thermaxis.thermal.log._thermal_log import ThermalLog, unit_of_name

LEAST_OVERLAP = 0.5
"""Share of the shorter record that must overlap with the other one at any shift. [1]"""
LEAST_CORRELATION = 0.5
"""Squared correlation at the best shift, below which no shift is found. [1]"""
MOST_UNCERTAIN_STEPS, MOST_UNCERTAIN_S = 10.0, 60.0
"""A shift that is not known within so many steps, or so long, counts as not found. [1, s]"""
_PLAUSIBLE = 9.0
"""Shifts whose likelihood ratio to the best, twice its logarithm, is less fit as well:
three standard deviations. [1]"""
_MOST_POINTS = 400_000
_SAME_S = 1e-6


@final
@dataclass(frozen=True, slots=True)
class ShiftResult:
    """How far the clocks of two recorders are apart."""

    shift_s: float
    """What is added to the second log's clock to get the first one's. [s]"""
    within_s: float
    """Half the width of the shifts that fit as well. [s]"""
    correlation: float
    """Correlation of the common channels at that shift. [1]"""
    channels: tuple[tuple[str, str], ...]
    """Channels that were compared: of the first log, of the second log."""


def find_shift(
    a: ThermalLog, b: ThermalLog, *, common: Sequence[tuple[str, str]] = ()
) -> ShiftResult:
    """Find how far the clocks of two recorders are apart, from channels that both recorded.

    At every shift at which at least half of the shorter record overlaps, the channels of one log
    are related to those of the other by a straight line; the shift with the least residual counts.
    The residual's correlation from row to row is taken into account in how well it is known.

    Parameters
    ----------
    common : sequence of (str, str)
        Names of a channel in the first and in the second log that measure the same. Default:
        channels of the same name.

    Returns
    -------
    ShiftResult
        Shift beyond what the starts or clocks of the logs say.

    Raises
    ------
    DataError
        If there is no common channel, none of them varies, or they do not tell the shift.
    """
    pairs = _pairs(a, b, common)
    step = max(_own_step(a, [p[0] for p in pairs]), _own_step(b, [p[1] for p in pairs]))
    step = max(step, max(a.duration_s, b.duration_s) / _MOST_POINTS)
    used: list[tuple[str, str]] = []
    misfit = count = None
    memory = 0.0
    for first, second in pairs:
        x, y = _on_grid(a, first, step), _on_grid(b, second, step)
        if not (_varies(x) and _varies(y)):
            continue
        unexplained, rows = _unexplained(x, y)
        weighted = rows * np.log(np.maximum(unexplained, 1e-12))
        misfit = weighted if misfit is None else misfit + weighted
        count = rows if count is None else np.minimum(count, rows)
        memory = max(memory, _memory(x, y, int(np.nanargmin(unexplained)) - (y.size - 1)))
        used.append((first, second))
    if misfit is None or count is None:
        raise DataError("no_channel_varies", file=f"{a.where}, {b.where}")
    per_row = misfit / (len(used) * np.maximum(count, 1))
    per_row[~np.isfinite(per_row)] = 0.0
    return _judged(a, b, per_row, count, step, memory, tuple(used))


def _judged(
    a: ThermalLog,
    b: ThermalLog,
    per_row: FloatArray,
    count: FloatArray,
    step: float,
    memory: float,
    used: tuple[tuple[str, str], ...],
) -> ShiftResult:
    best = int(np.argmin(per_row))
    lag = best - (_points(b, step) - 1)
    explained = 1.0 - float(np.exp(per_row[best]))
    names = ", ".join(f"{x}={y}" for x, y in used)
    if explained < LEAST_CORRELATION:
        raise DataError(
            "channels_unrelated",
            names=names,
            correlation=float(np.sqrt(max(explained, 0.0))),
            file=f"{a.where}, {b.where}",
        )
    independent = max(float(count[best]) * (1.0 - memory) / (1.0 + memory), 3.0)
    fitting = np.flatnonzero(independent * (per_row - per_row[best]) < _PLAUSIBLE)
    low, high = (int(k) - (_points(b, step) - 1) for k in (fitting[0], fitting[-1]))
    within = max(high - lag, lag - low, 0.5) * step
    if within > max(MOST_UNCERTAIN_STEPS * step, MOST_UNCERTAIN_S):
        raise DataError(
            "shift_ambiguous",
            names=names,
            earliest_s=low * step,
            latest_s=high * step,
            file=f"{a.where}, {b.where}",
        )
    shift = (lag + _vertex(per_row, best)) * step - _clock_offset(a, b)
    return ShiftResult(shift, within, float(np.sqrt(explained)), used)


def merge_logs(
    a: ThermalLog,
    b: ThermalLog,
    *,
    shift_s: float | None = None,
    common: Sequence[tuple[str, str]] = (),
) -> ThermalLog:
    """Join the logs of two recorders by time.

    Parameters
    ----------
    a, b : ThermalLog
        The logs; the first one's clock holds.
    shift_s : float, optional
        What is added to the second log's clock (where only one log states the time of day: to its
        times since its first row). Default: found from common channels; without any the clocks
        are taken as they are if both logs state the time of day. [s]
    common : sequence of (str, str)
        Channels of the first and of the second log that measure the same, for the search.

    Returns
    -------
    ThermalLog
        The union of the rows, NaN where a recorder had none. A channel of the second log with the
        name of one in the first gets `_2` before its unit. A remark states the shift.

    Raises
    ------
    DataError
        If the shift is not finite, or can neither be found nor taken from the clocks.
    """
    base = _clock_offset(a, b)
    both_dated = a.start is not None and b.start is not None
    has_common = bool(common) or any(True for _ in _same_names(a, b))
    if shift_s is not None:
        if not np.isfinite(shift_s) or abs(shift_s) > 1e12:
            raise DataError("no_shift", shift_s=shift_s, key="shift_s")
        joined_so = remark("joined_by_shift", log=b.where, shift_s=f"{shift_s:g}")
    elif has_common:
        found = find_shift(a, b, common=common)
        shift_s = found.shift_s
        joined_so = remark(
            "joined_by_channels",
            log=b.where,
            shift_s=_as_known(found),
            names=", ".join(f"{x}={y}" for x, y in found.channels),
            within_s=significant(found.within_s, 2),
            correlation=found.correlation,
        )
    elif both_dated:
        shift_s = 0.0
        joined_so = remark("joined_by_times_of_day", log=b.where)
    else:
        raise DataError("no_clock_and_no_common_channel", file=f"{a.where}, {b.where}")
    return _joined(a, b, base + shift_s, [joined_so])


def join_rates(logs: Sequence[ThermalLog]) -> ThermalLog:
    """Join groups of channels that one recorder took at different rates, by its one clock."""
    joined = logs[0]
    for log in logs[1:]:
        joined = _joined(joined, log, _clock_offset(joined, log), [])
    return joined


def shift_displacements(log: ThermalLog, names: Sequence[str], shift_s: float) -> ThermalLog:
    """Return a log with some channels so much earlier; its rows are those of the others' times."""
    known = [name for name in log.columns if name.casefold() in {n.casefold() for n in names}]
    late = log.select(known)
    others = replace(log, columns={n: v for n, v in log.columns.items() if n not in known})
    code = "displacements_late" if shift_s > 0.0 else "displacements_early"
    told = remark(code, names=", ".join(known), shift_s=abs(shift_s))
    joined = _joined(others, late, -shift_s, [told])
    begin_s = max(shift_s, 0.0)
    kept = joined.between(begin_s, begin_s + others.duration_s + _SAME_S)
    return replace(kept.select(list(log.columns)), start=log.start, origin_s=log.origin_s)


def _as_known(found: ShiftResult) -> str:
    """Return the shift with the last decimal of how well it is known. [s]"""
    decimals = max(0, 1 - math.floor(math.log10(found.within_s)))
    # Plus zero: a rounded shift of minus nothing is nothing.
    return f"{round(found.shift_s, decimals) + 0.0:.{decimals}f}"


def _joined(a: ThermalLog, b: ThermalLog, offset_s: float, said: Sequence[Message]) -> ThermalLog:
    time_b = b.time_s + offset_s
    everything = np.concatenate((a.time_s, time_b))
    rank = np.argsort(everything, kind="stable")
    ordered = everything[rank]
    # Rows within a microsecond are one, unless both are of the same log: those never are.
    origin = rank >= a.rows
    apart = np.diff(ordered) > _SAME_S
    new = np.concatenate(([True], apart | (origin[1:] == origin[:-1])))
    place = np.empty(rank.size, dtype=np.int64)
    place[rank] = np.cumsum(new) - 1
    time_s = ordered[new]
    columns: dict[str, FloatArray] = {}
    units: dict[str, str] = {}
    for name, values in a.columns.items():
        columns[name], units[name] = _placed(values, place[: a.rows], time_s.size), a.units[name]
    renamed: list[str] = []
    for name, values in b.columns.items():
        free = _free_name(name, [*columns, *(other for other in b.columns if other != name)])
        if free != name:
            renamed.append(f"{name} to {free}")
        columns[free], units[free] = _placed(values, place[a.rows :], time_s.size), b.units[name]
    begin = float(time_s[0])
    remarks = [*a.remarks, *b.remarks, *said]
    if renamed:
        remarks.append(remark("columns_renamed", log=b.where, names=", ".join(renamed)))
    return replace(
        a,
        time_s=time_s - begin,
        columns=columns,
        units=units,
        start=None if a.start is None else a.start + timedelta(seconds=begin),
        origin_s=a.origin_s + (begin if a.start is None else 0.0),
        remarks=tuple(r for k, r in enumerate(remarks) if r not in remarks[:k]),
    )


def _placed(
    values: FloatArray, place: np.ndarray[tuple[int], np.dtype[np.int64]], rows: int
) -> FloatArray:
    column = np.full(rows, np.nan)
    column[place] = values
    return column


def _free_name(name: str, taken: Sequence[str]) -> str:
    if name not in taken:
        return name
    unit = f"_{name.rpartition('_')[2]}" if unit_of_name(name) and "_" in name else ""
    stem = name.removesuffix(unit) if unit else name
    number = 2
    while f"{stem}_{number}{unit}" in taken:
        number += 1
    return f"{stem}_{number}{unit}"


def _clock_offset(a: ThermalLog, b: ThermalLog) -> float:
    """Return where the second log begins on the first one's axis of time, by their clocks. [s]"""
    if a.start is not None and b.start is not None:
        if (a.start.tzinfo is None) != (b.start.tzinfo is None):
            raise DataError("zone_in_one_log", file=f"{a.where}, {b.where}")
        return (b.start - a.start).total_seconds()
    if a.start is None and b.start is None:
        return b.origin_s - a.origin_s
    return 0.0


def _same_names(a: ThermalLog, b: ThermalLog) -> list[tuple[str, str]]:
    known = {name.casefold(): name for name in b.columns}
    return [(name, known[name.casefold()]) for name in a.columns if name.casefold() in known]


def _pairs(
    a: ThermalLog, b: ThermalLog, common: Sequence[tuple[str, str]]
) -> list[tuple[str, str]]:
    pairs = [(a.name_of(x), b.name_of(y)) for x, y in common] or _same_names(a, b)
    if not pairs:
        raise DataError("no_common_channel", file=f"{a.where}, {b.where}")
    return pairs[:8]


def _own_step(log: ThermalLog, names: Sequence[str]) -> float:
    """Return the slowest usual step of some channels. [s]"""
    steps = [usual_step_s(log.time_s[~np.isnan(log.columns[name])]) for name in names]
    known = [step for step in steps if np.isfinite(step)]
    if not known:
        raise DataError("measured_once", file=log.where)
    return max(known)


def _points(log: ThermalLog, step: float) -> int:
    return int(np.floor(log.duration_s / step + 1e-9)) + 1


def _on_grid(log: ThermalLog, name: str, step: float) -> FloatArray:
    """Return a channel at even times: means about them, or what lies between its neighbours."""
    points = _points(log, step)
    values = log.columns[name]
    measured = ~np.isnan(values)
    time_s, values = log.time_s[measured], values[measured]
    grid = np.arange(points) * step
    if values.size == 0:
        return np.full(points, np.nan)
    nearest = np.minimum(np.floor(time_s / step + 0.5).astype(np.int64), points - 1)
    counts = np.bincount(nearest, minlength=points)
    filled = counts > 0
    # Means about the grid's times, at the means of their own times: both ends of a bin count.
    late = np.bincount(nearest, weights=time_s - grid[nearest], minlength=points)
    above = np.bincount(nearest, weights=values - values[0], minlength=points)
    means = values[0] + above[filled] / counts[filled]
    mean_times = grid[filled] + late[filled] / counts[filled]
    result: FloatArray = np.asarray(np.interp(grid, mean_times, means), dtype=np.float64)
    right = np.clip(np.searchsorted(time_s, grid), 0, time_s.size - 1)
    left = np.maximum(right - 1, 0)
    distance = np.minimum(np.abs(time_s[right] - grid), np.abs(time_s[left] - grid))
    result[distance > 3.0 * step] = np.nan
    return result


def _varies(values: FloatArray) -> bool:
    measured = values[~np.isnan(values)]
    return measured.size > 0 and float(np.std(measured)) > 0.0


def _unexplained(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return 1 - r² and the number of common rows at every shift, (len(x) + len(y) - 1,).

    Index k is the shift k - (len(y) - 1) of the second series, in rows.
    """
    has_x, has_y = ~np.isnan(x), ~np.isnan(y)
    x = np.where(has_x, x - np.nanmean(x), 0.0)
    y = np.where(has_y, y - np.nanmean(y), 0.0)
    size = 1 << (x.size + y.size - 2).bit_length()

    def at_shifts(first: FloatArray, second: FloatArray) -> FloatArray:
        product = np.fft.rfft(first, size) * np.fft.rfft(second[::-1], size)
        return np.asarray(np.fft.irfft(product, size)[: x.size + y.size - 1], dtype=np.float64)

    gx, gy = has_x.astype(np.float64), has_y.astype(np.float64)
    rows = np.rint(at_shifts(gx, gy))
    enough = rows >= max(LEAST_OVERLAP * min(gx.sum(), gy.sum()), 8.0)
    n = np.where(enough, rows, 1.0)
    sx, sy = at_shifts(x, gy), at_shifts(gx, y)
    vx = at_shifts(x * x, gy) - sx**2 / n
    vy = at_shifts(gx, y * y) - sy**2 / n
    cov = at_shifts(x, y) - sx * sy / n
    floor = 1e-9 * max(float(np.sum(x * x)) * float(np.sum(y * y)), 1e-300)
    # A gain below zero would match a channel with its mirror image.
    varied = enough & (vx > 0.0) & (vy > 0.0) & (vx * vy > floor) & (cov > 0.0)
    r2 = np.where(varied, cov**2 / np.where(varied, vx * vy, 1.0), 0.0)
    return np.where(enough, 1.0 - np.clip(r2, 0.0, 1.0), 1.0), np.where(enough, rows, 0.0)


def _memory(x: FloatArray, y: FloatArray, lag: int) -> float:
    """Return the correlation of the residual from row to row at a shift. [1]"""
    begin, end = max(0, lag), min(x.size, y.size + lag)
    first, second = x[begin:end], y[begin - lag : end - lag]
    both = ~np.isnan(first) & ~np.isnan(second)
    if np.count_nonzero(both) < 8:
        return 0.0
    first, second = first[both] - np.mean(first[both]), second[both] - np.mean(second[both])
    spread = float(np.sum(second**2))
    residual = first - second * (float(np.sum(first * second)) / spread if spread else 0.0)
    power = float(np.sum(residual**2))
    if power <= 1e-20 * float(np.sum(first**2)):
        return 0.0
    return float(np.clip(np.sum(residual[1:] * residual[:-1]) / power, 0.0, 0.999))


def _vertex(values: FloatArray, best: int) -> float:
    """Return where the parabola through the least value and its neighbours is least. [rows]"""
    if not 0 < best < values.size - 1:
        return 0.0
    left, middle, right = (float(values[best + k]) for k in (-1, 0, 1))
    bend = left - 2.0 * middle + right
    return 0.5 * (left - right) / bend if bend > 0.0 else 0.0
