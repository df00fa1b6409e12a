"""Find the dead time of inputs: gains over the grid answer any lag, but not a shift of time."""

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

FALL_OF_LIKELIHOOD = 1.92
"""Fall of a logarithm of likelihood at the ends of a 95 % interval: half the quantile of chi
squared. [1]"""
TRUSTED_SHARE = 1.0 / 3.0
"""Power to which the evidence counts here. Default: measured. Residuals of block means are white
beside the noise that is modelled, and where sensors are not rounded the whole counts; rounding
and noise of sensors are no part of it, and a delay that is too short smooths them. [1]"""
LONGEST_DELAY_S = 7200.0
"""Longest dead time that is looked for, or a quarter of the longest experiment. [s]"""
FINEST_SHARE = 1.0 / 12.0
"""Finest step of the delays that are tried, over the length of a block. [1]"""
_ROUNDS = 2


def likely_delays(
    log_evidence: Callable[[tuple[int, ...]], float],
    start: Sequence[int],
    wanted: Sequence[bool],
    farthest: int,
    block: int,
) -> tuple[list[int], list[tuple[int, int, int] | None]]:
    """Return the mean dead times of inputs where wanted; ends of 95 %, likeliest between. [row]

    `log_evidence` is that of a record by the delays of all inputs, `farthest` the longest that is
    tried; a dead time whose interval holds none is none. Ends are the next ones tried outside.
    """
    known = cache(log_evidence)
    late = list(start)
    ends: list[tuple[int, int, int] | None] = [None] * len(late)
    inputs = np.flatnonzero(wanted).tolist()
    for _ in range(_ROUNDS if len(inputs) > 1 else 1):
        before = late.copy()
        for k in inputs:
            late[k], ends[k] = _likely(
                lambda d, k=k: TRUSTED_SHARE * known((*late[:k], d, *late[k + 1 :])),
                farthest,
                block,
            )
        if late == before:
            break
    return late, ends


def _likely(
    log_evidence: Callable[[int], float], farthest: int, block: int
) -> tuple[int, tuple[int, int, int]]:
    """Return the mean of delays by their likelihood; ends of 95 %, likeliest between. [row]"""
    spacing, finest = max(block, 1), max(round(FINEST_SHARE * block), 1)
    tried = np.unique(np.append(np.arange(0, farthest, spacing), farthest))
    while True:
        found = np.array([log_evidence(delay) for delay in tried.tolist()])
        if spacing <= finest:
            break
        near = tried[found >= np.max(found) - 2.0 * FALL_OF_LIKELIHOOD]
        spacing = -(-spacing // 2)
        beside = np.clip(np.concatenate([near - spacing, near + spacing]), 0, farthest)
        tried = np.unique(np.concatenate([tried, beside]))
    inside = np.flatnonzero(found >= np.max(found) - FALL_OF_LIKELIHOOD)
    first, last = max(inside[0] - 1, 0), min(inside[-1] + 1, tried.size - 1)
    weight = np.exp(found - np.max(found)) * np.gradient(tried)
    mean = round(float(weight @ tried / np.sum(weight)))
    low, likeliest, high = tried[[first, int(np.argmax(found)), last]].tolist()
    return (mean if low else 0), (low, likeliest, high)
