"""Ranges of a record: of a part of it, and the largest one in any span of a length."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from thermaxis.thermal._arrays import FloatArray

_ROUND_OFF = 1e-9
"""A row at the very end of a span belongs to it. [1, of the span]"""


def range_of(values: FloatArray) -> float:
    """Return largest less smallest of the measured values; NaN without any."""
    known = values[~np.isnan(values)]
    return float(np.ptp(known)) if known.size else float("nan")


def rows_between(time_s: FloatArray, begin_s: float, end_s: float) -> NDArray[np.bool_]:
    """Return which rows lie in a span, both ends included."""
    edge_s = _ROUND_OFF * max(abs(end_s), 1.0)
    return (time_s >= begin_s - edge_s) & (time_s <= end_s + edge_s)


def largest_ranges(
    time_s: FloatArray, values: FloatArray, spans_s: Sequence[float]
) -> tuple[float, ...]:
    """Return the largest range in any span of each length: ETVE(D, t) of ISO 230-3 [M].

    Values and rising times are (n,), values NaN where not measured; the ends of a span belong to
    it. Each entry is the largest difference of two values at most so far apart; NaN without any.

    Notes
    -----
    Highest and lowest value of 1, 2, 4, ... rows make those of every span of two of them that
    overlap: n log n.
    """
    known = ~np.isnan(values)
    at_s, high = time_s[known], values[known]
    if not high.size:
        return (float("nan"),) * len(spans_s)
    first = np.arange(high.size)
    ends = [np.searchsorted(at_s, at_s + t * (1.0 + _ROUND_OFF), side="right") for t in spans_s]
    found, low, width = np.zeros(len(spans_s)), high, 1
    while True:
        for k, end in enumerate(ends):
            rows = np.flatnonzero((end - first >= width) & (end - first < 2 * width))
            if rows.size:
                last = end[rows] - width
                most = np.maximum(high[rows], high[last]) - np.minimum(low[rows], low[last])
                found[k] = max(found[k], float(np.max(most)))
        if 2 * width > first.size:
            return tuple(found.tolist())
        high = np.maximum(high[:-width], high[width:])
        low = np.minimum(low[:-width], low[width:])
        width *= 2
