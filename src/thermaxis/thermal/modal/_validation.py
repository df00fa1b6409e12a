"""The number of lags, by the free run over blocks of the record that the fit has not seen."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import final

import numpy as np

from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.modal._lags import Linearised, Refined, Refinement
from thermaxis.thermal.modal._slow_noise import Weighing, with_drift

FOLDS = 6
"""Blocks that a record is cut into. [1]"""
EXACT = 1e-9
"""Share of the displacement's variance that is not worth another lag. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class BlockedValidation:
    """Free-run errors over held-out blocks, by number of lags."""

    lags: tuple[int, ...]
    error: FloatArray
    """Mean square of the free-run error under the noise, per number of lags, (l,). [1]"""
    standard_error: FloatArray
    """Standard error of its difference to the best, (l,). [1]"""
    rmse: FloatArray
    """Root mean square of the same error without weights, scaled, (l,). [1]"""
    chosen: int
    """Smallest number of lags within one standard error of the best. [1]"""


def _products_of_blocks(
    problem: Refinement, local: Linearised
) -> tuple[FloatArray, list[FloatArray]]:
    """Return the products of every block, (f, q + 1, q + 1), and its rows."""
    design, noise = local.design, problem.sizes.noise
    length = max(2, -(-design.readings // FOLDS))
    products: list[FloatArray] = []
    blocks: list[FloatArray] = []
    for rows, white, times_s, basis in zip(
        design.rows, design.white_variance, design.times_s, design.basis, strict=True
    ):
        pieces = max(1, round(rows.shape[0] / length))
        edges = [round(rows.shape[0] * place / pieces) for place in range(pieces + 1)]
        for first, last in pairwise(edges):
            piece = slice(first, last)
            both = np.hstack([rows[piece], basis[piece]])
            joint = Weighing(both, white[piece], times_s[piece]).products(noise)
            found = with_drift(joint, rows.shape[1], noise)
            products.append(found.gram)
            blocks.append(rows[piece])
    return np.array(products), blocks


def _errors(problem: Refinement, refined: Refined) -> tuple[FloatArray, FloatArray, float]:
    """Return the squared free-run error over every block, its readings, (f,), and the plain rms.

    Notes
    -----
    With the products G_k of block k and the prior L, the coefficients without the block are
    beta = (sum of the other G + L)^-1 (sum of the other b). Its gains and time constants simulate
    the block; r = y - F beta is what they leave. Offset and start gamma are the block's own:

        error = r' K^-1 r - q' (H' K^-1 H + L)^-1 q,    q = H' K^-1 r,

    H being the columns of offset and start. All products are parts of G_k.
    """
    local = problem.linearised(refined)
    blocks, pieces = _products_of_blocks(problem, local)
    counts = np.array([piece.shape[0] for piece in pieces], dtype=np.float64)
    if counts.size < 2:
        return np.zeros(counts.size), counts, float("nan")
    size = int(blocks.shape[1]) - 1
    gains, lags = local.design.gains, local.design.lags
    diagonal = np.arange(int(size))
    outside = blocks.sum(axis=0) - blocks
    left = outside[:, :-1, :-1].copy()
    # A start or an offset that only the held-out block knows stays at zero in the fit.
    left[:, diagonal, diagonal] += local.prior + 1e-9
    mean = np.asarray(np.linalg.solve(left, outside[:, :-1, -1:]), dtype=np.float64)[:, :, 0]
    response = np.r_[0:gains, size - lags : size].astype(np.intp)
    own = np.arange(gains, size - lags)
    signed = np.concatenate([-mean[:, response], np.ones((counts.size, 1))], axis=1)
    kept = np.append(response, size)
    total = np.einsum("fi,fij,fj->f", signed, blocks[:, kept[:, None], kept], signed)
    right = np.einsum("fij,fj->fi", blocks[:, own[:, None], kept], signed)
    start = blocks[:, own[:, None], own].copy()
    places = np.arange(own.size)
    start[:, places, places] += local.prior[own] + 1e-9
    solved = np.asarray(np.linalg.solve(start, right[:, :, None]), dtype=np.float64)[:, :, 0]
    mean[:, own] = solved
    left = [
        p[:, -1] - p[:, :-1] @ coefficients for p, coefficients in zip(pieces, mean, strict=True)
    ]
    rms = float(np.sqrt(np.mean(np.concatenate(left) ** 2)))
    return total - np.einsum("fi,fi->f", right, solved), counts, rms


def validated(candidates: Sequence[tuple[Refinement, Refined]]) -> BlockedValidation:
    """Choose the number of lags by blocked cross-validation of the free run.

    Notes
    -----
    Gains and time constants are fitted without the block, the latter to first order. The block is
    then simulated by its inputs; of its displacement only the offset and the unknown start are
    taken. Errors are weighed by the inverse covariance of the noise, so that the slow drift of a
    block does not drown what the lags explain.
    """
    numbers = tuple(int(refined.time_constants_s.size) for _, refined in candidates)
    found = [_errors(problem, refined) for problem, refined in candidates]
    counts = found[0][1]
    unit = candidates[-1][1].variance
    errors = np.array([e for e, _, _ in found]) / unit
    rms = np.array([r for _, _, r in found])
    mean = errors.sum(axis=1) / counts.sum()
    best = int(np.argmin(mean))
    folds = counts.size
    if folds < 2:
        return BlockedValidation(numbers, mean, np.zeros(len(numbers)), rms, numbers[0])
    spread = np.std(errors - errors[best], axis=1, ddof=1) * np.sqrt(folds) / counts.sum()
    worse = mean - mean[best]
    within = np.flatnonzero((worse <= spread) | (worse * unit <= EXACT))
    return BlockedValidation(numbers, mean, spread, rms, numbers[int(within[0])])
