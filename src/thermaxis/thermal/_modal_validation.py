"""The number of lags, by the free run over blocks of the record that the fit has not seen."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.thermal._field import FloatArray
from thermaxis.thermal._modal_average import Compared
from thermaxis.thermal._modal_evidence import Design
from thermaxis.thermal._modal_lags import columns_of, prior_precision
from thermaxis.thermal._slow_noise import SlowNoise, weighted_products

FOLDS = 6
"""Blocks that a record is cut into. [1]"""
_CANDIDATES = 8


@final
@dataclass(frozen=True, slots=True, eq=False)
class BlockedValidation:
    """Free-run errors over held-out blocks, by number of lags."""

    lags: tuple[int, ...]
    """Numbers of lags compared."""
    error: FloatArray
    """Mean square of the free-run error under the noise, per number of lags, (l,). [1]"""
    standard_error: FloatArray
    """Standard error of its difference to the best, (l,). [1]"""
    chosen: int
    """Smallest number of lags within one standard error of the best. [1]"""


def _blocks(design: Design, noise: SlowNoise) -> tuple[FloatArray, FloatArray]:
    """Return the products of every held-out block, (f, p + 1, p + 1), and its readings, (f,)."""
    length = max(2, -(-design.readings // FOLDS))
    products, counts = [], []
    for rows, white, times_s in zip(
        design.rows, design.white_variance, design.times_s, strict=True
    ):
        pieces = max(1, round(rows.shape[0] / length))
        for part in np.array_split(np.arange(rows.shape[0]), pieces):
            piece = slice(int(part[0]), int(part[-1]) + 1)
            products.append(
                weighted_products(rows[piece], white[piece], times_s[piece], noise).gram
            )
            counts.append(part.size)
    return np.array(products), np.array(counts, dtype=np.float64)


def validated(design: Design, found: Sequence[Compared], noise: SlowNoise) -> BlockedValidation:
    """Choose the number of lags by blocked cross-validation of the free run.

    Parameters
    ----------
    design : Design
        Regressors over the grid.
    found : sequence of Compared
        All sets with their evidence.
    noise : SlowNoise
        The slow noise that weighs the errors.

    Returns
    -------
    BlockedValidation
        The smallest number of lags whose error is within a standard error of the least.

    Notes
    -----
    The held-out block is simulated by its inputs from the begin of the record; its displacement
    is not used. Errors are weighed by the inverse covariance of the noise, so that the slow drift
    of a block does not drown what the lags explain. For every number of lags the sets that are
    most likely on all of the record stand for it, each fitted anew without the block.
    """
    blocks, counts = _blocks(design, noise)
    total = blocks.sum(axis=0)
    numbers = tuple(sorted({c.lags for c in found}))
    if blocks.shape[0] < 2:
        return BlockedValidation(
            numbers, np.zeros(len(numbers)), np.zeros(len(numbers)), numbers[0]
        )
    errors = np.empty((len(numbers), blocks.shape[0]))
    for place, lags in enumerate(numbers):
        errors[place] = _errors(design, [c for c in found if c.lags == lags], blocks, total)
    mean = errors.sum(axis=1) / counts.sum()
    best = int(np.argmin(mean))
    difference = errors - errors[best]
    folds = blocks.shape[0]
    spread = np.std(difference, axis=1, ddof=1) * np.sqrt(folds) / counts.sum()
    within = np.flatnonzero(mean - mean[best] <= spread)
    return BlockedValidation(numbers, mean, spread, numbers[int(within[0])])


def _errors(
    design: Design, those: Sequence[Compared], blocks: FloatArray, total: FloatArray
) -> FloatArray:
    """Return the squared free-run error over every block, of the best sets' average, (f,)."""
    log_weight = np.concatenate([c.log_weight for c in those])
    owner = np.concatenate([np.full(c.log_weight.size, i) for i, c in enumerate(those)])
    place = np.concatenate([np.arange(c.log_weight.size) for c in those])
    best = np.argsort(log_weight)[::-1][:_CANDIDATES]
    weight = np.exp(log_weight[best] - log_weight[best[0]])
    weight /= weight.sum()
    errors = np.zeros(blocks.shape[0])
    for number, share in zip(best.tolist(), weight.tolist(), strict=True):
        item = those[int(owner[number])]
        members = item.subsets.members[int(place[number])][None, :]
        columns = columns_of(design, members)[0]
        prior = np.diag(prior_precision(design, item.sizes, item.lags))
        with_y = np.append(columns, total.shape[0] - 1)
        inside = blocks[:, with_y[:, None], with_y]
        outside = total[np.ix_(with_y, with_y)] - inside
        left = outside[:, :-1, :-1] + prior
        # An offset that only the held-out block knows stays at zero.
        diagonal = np.arange(left.shape[1])
        left[:, diagonal, diagonal] += 1e-9
        mean = np.linalg.solve(left, outside[:, :-1, -1:])[:, :, 0]
        signed = np.concatenate([-mean, np.ones((blocks.shape[0], 1))], axis=1)
        errors += share * np.einsum("fi,fij,fj->f", signed, inside, signed)
    return errors
