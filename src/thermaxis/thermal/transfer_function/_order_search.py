"""Orders by the free run in blocks that a fit has not seen: one validation for both estimators."""

from collections.abc import Callable, Collection, Sequence
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.log import Experiment
from thermaxis.thermal.transfer_function._polynomial_model import OrderTrial

HIGHEST_ORDER = 3
"""Largest n and m of the default search: those of the paper's tables. [1]"""
FEWEST_BLOCKS = 5
"""Blocks of rows that the default search leaves out one after the other, at least. [1]"""

Block: TypeAlias = tuple[Experiment, int, int]
"""First row of a block in its experiment, and the one behind its last."""


def blocks_of_rows(experiments: Sequence[Experiment]) -> list[Block]:
    """Return the blocks that are left out one after the other."""
    each = -(-FEWEST_BLOCKS // len(experiments))
    blocks: list[Block] = []
    for experiment in experiments:
        borders = [round(experiment.y.size * i / each) for i in range(each + 1)]
        blocks += [(experiment, a, b) for a, b in pairwise(borders)]
    return blocks


def search_orders(
    blocks: Sequence[Block],
    inputs: int,
    left_out: Callable[[int, int], FloatArray],
    barred: Collection[tuple[int, int]] = (),
) -> tuple[tuple[OrderTrial, ...], int, int]:
    """Try every m with n = m and m - 1; return the trials, and the n and m that are chosen.

    Notes
    -----
    With the sums of squares e_k of the free run in every block k by a fit without it, the orders
    with the fewest coefficients are chosen whose sum E exceeds the least one by no more than one
    standard error of the difference: E - E_best <= std(e - e_best) sqrt(blocks). Barred orders
    are compared with; of the others the best is taken where none comes so near.
    """
    every = range(HIGHEST_ORDER + 1)
    errors = {(n, m): left_out(n, m) for m in every for n in (m - 1, m) if n >= 0}
    totals = {key: float(np.sum(values)) for key, values in errors.items()}
    best = min(totals, key=lambda key: totals[key])
    if not np.isfinite(totals[best]):
        raise DataError("no_stable_orders", key="orders")
    weights = np.array([float(np.count_nonzero(~np.isnan(e.y[a:b]))) for e, a, b in blocks])
    count = max(int(np.count_nonzero(weights)), 2)
    allowed: list[tuple[int, int]] = []
    for key, values in errors.items():
        if np.isfinite(totals[key]):
            std_error = float(np.std(values - errors[best], ddof=1)) * float(np.sqrt(count))
            if key not in barred and totals[key] - totals[best] <= std_error:
                allowed.append(key)
    allowed = allowed or [min(totals.keys() - barred, key=lambda key: totals[key])]
    n, m = min(allowed, key=lambda key: (inputs * (key[0] + 1) + key[1], totals[key]))
    rows = float(np.sum(weights))
    trials = tuple(
        OrderTrial(*key, float(np.sqrt(total / rows)), key == (n, m))
        for key, total in totals.items()
    )
    return trials, n, m
