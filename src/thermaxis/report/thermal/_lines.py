"""Long records as lines that a chart can show: their extremes, with gaps where nothing is known."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import final

import numpy as np
from numpy.typing import NDArray

from thermaxis.positioning import FloatArray

DRAWN_POINTS = 1000
"""Points of a line: a chart is not much wider in dots. [1]"""
_GAP_STEPS = 5.0
"""A line is broken where so many usual steps are missing. [1]"""
_SMALLEST_GAP = 0.005
"""Narrower gaps and stretches of line than this share of the width are not seen. [1]"""
_MARKS = 7
"""Markers along a line. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class DrawnLine:
    """A line, reduced."""

    x: FloatArray
    """Places, (p,). [unit of the input]"""
    y: FloatArray
    """Values, (p,); NaN where the line is broken. [unit of the input]"""
    alone_x: FloatArray
    """Places of values that are too short for a line, (q,). [unit of the input]"""
    alone_y: FloatArray
    """Values there, (q,): the middle one of each stretch. [unit of the input]"""


def envelope_rows(values: FloatArray, most: int) -> list[int]:
    """Return the rows that keep the extremes of every stretch of a series."""
    if values.size <= most:
        return list(range(values.size))
    length = -(-values.size // max(most // 2, 1))
    count = -(-values.size // length)
    filled = np.pad(values, (0, count * length - values.size), mode="edge").reshape(count, length)
    starts = np.arange(count) * length
    rows = np.concatenate(
        [[0], starts + np.argmin(filled, axis=1), starts + np.argmax(filled, axis=1)]
    )
    return np.unique(np.append(np.minimum(rows, values.size - 1), values.size - 1)).tolist()


def drawn_line(x: FloatArray, y: FloatArray, most: int = DRAWN_POINTS) -> DrawnLine:
    """Return a series as it is drawn."""
    present = np.isfinite(y)
    at, values = x[present], y[present]
    if at.size == 0:
        return DrawnLine(at, values, at, values)
    width = float(np.ptp(x))
    steps = np.diff(at)
    gap = max(_SMALLEST_GAP * width, _GAP_STEPS * float(np.median(steps)) if steps.size else 0.0)
    edges = [0, *(np.flatnonzero(steps > gap) + 1).tolist(), at.size]
    rows: list[int] = []
    alone: list[int] = []
    for first, last in pairwise(edges):
        if at[last - 1] - at[first] <= _SMALLEST_GAP * width:
            alone.append((first + last - 1) // 2)
            continue
        share = max(4, round(most * (last - first) / at.size))
        rows += [-1] if rows else []
        rows += [first + row for row in envelope_rows(values[first:last], share)]
    kept = np.array(rows, dtype=np.int64)
    broken = kept < 0
    kept[broken] = 0
    thinned = [alone[k] for k in envelope_rows(values[alone], most)]
    return DrawnLine(
        np.where(broken, np.nan, at[kept]),
        np.where(broken, np.nan, values[kept]),
        at[thinned],
        values[thinned],
    )


def marked(line: DrawnLine, turn: float) -> list[int]:
    """Return which points of a line get a marker."""
    known = np.flatnonzero(~np.isnan(line.x))
    x = line.x[known]
    shares = (np.arange(_MARKS) + turn) / np.float64(_MARKS)
    wanted = float(x[0]) + shares * float(np.ptp(x))
    return np.unique(known[np.minimum(np.searchsorted(x, wanted), x.size - 1)]).tolist()


def span_of(values: FloatArray) -> float:
    """Return the peak-to-peak value of a series; 0 where nothing is known."""
    known = values[np.isfinite(values)]
    return float(np.ptp(known)) if known.size else 0.0


def largest(series: Mapping[str, FloatArray], most: int) -> tuple[list[str], list[str]]:
    """Return which series are drawn one by one and which are taken together."""
    names = list(series)
    if len(names) <= most:
        return names, []
    order = sorted(names, key=lambda name: -span_of(series[name]))
    chosen = set(order[: most - 1])
    return [n for n in names if n in chosen], [n for n in names if n not in chosen]


def shaded_spans(x: FloatArray, counted: NDArray[np.bool_]) -> tuple[tuple[float, float], ...]:
    """Return the stretches before and behind the rows that count."""
    rows = np.flatnonzero(counted)
    if rows.size == 0:
        return ((float(x[0]), float(x[-1])),)
    ends = ((float(x[0]), float(x[rows[0]])), (float(x[rows[-1]]), float(x[-1])))
    least = 2.0 * _SMALLEST_GAP * float(np.ptp(x))
    return tuple((a, b) for a, b in ends if b - a > least)
