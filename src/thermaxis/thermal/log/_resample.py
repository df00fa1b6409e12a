"""Means over equal blocks of time: the filter before a record gets a lower rate.

The mean over a block is an anti-alias filter with zeros at every multiple of the new rate, and it
is causal: the runtime can take the same mean of the readings since the last cycle. A model
identified on block means therefore has this filter inside, and must be fed with block means of
the same length.
"""

import numpy as np
from numpy.typing import NDArray

from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray, require_sample_time

MOST_BLOCKS = 50_000_000
"""Largest number of blocks of one record: a year and a half at 1 Hz. [1]"""

_APART = 1.5
_FEWEST_BURSTS = 8
_LEAST_BURSTS = 0.05


def usual_step_s(time_s: FloatArray) -> float:
    """Return the median time from one row to the next."""
    return float(np.median(np.diff(time_s))) if time_s.size > 1 else float("nan")


def even_step_s(time_s: FloatArray) -> float:
    """Return the step at which every block has rows: the usual one, or that of regular bursts."""
    steps, usual = np.diff(time_s), usual_step_s(time_s)
    begins = np.concatenate(([True], steps > _APART * usual))
    between = np.diff(time_s[begins])
    if between.size < _FEWEST_BURSTS or between.size < _LEAST_BURSTS * time_s.size:
        return usual
    period = float(np.median(between))
    regular = float(np.mean(np.abs(between - period) < 0.2 * period))
    return period if regular > 0.8 else usual


def block_numbers(time_s: FloatArray, sample_time_s: float) -> NDArray[np.int64]:
    """Return the block into which each row falls.

    A row stands for the time until the next one (zero-order hold), so the middle of that time
    decides: a clock that jitters by less than half a step moves no row to another block.
    """
    require_sample_time(sample_time_s)
    if time_s.size == 0:
        return np.zeros(0, dtype=np.int64)
    blocks = float(time_s[-1]) / sample_time_s
    if blocks > MOST_BLOCKS:
        raise DataError(
            "too_many_blocks",
            duration_s=float(time_s[-1]),
            blocks=blocks,
            sample_time_s=sample_time_s,
            most=MOST_BLOCKS,
        )
    step = usual_step_s(time_s)
    middle = 0.5 * min(step, sample_time_s) if time_s.size > 1 else 0.0
    return np.floor((time_s + middle) / sample_time_s + 1e-9).astype(np.int64)


def block_means(values: FloatArray, block: NDArray[np.int64], blocks: int) -> FloatArray:
    """Return the mean of what each block has of a channel, (b,); NaN where it has nothing."""
    measured = ~np.isnan(values)
    if not bool(measured.all()):
        values, block = values[measured], block[measured]
    if values.size == 0:
        return np.full(blocks, np.nan)
    # Sums of differences to a value of the channel keep the digits of a small change.
    base = float(values[0])
    counts = np.bincount(block, minlength=blocks)
    sums = np.bincount(block, weights=values - base, minlength=blocks)
    with np.errstate(invalid="ignore", divide="ignore"):
        means = base + sums / counts
    means[counts == 0] = np.nan
    return means
