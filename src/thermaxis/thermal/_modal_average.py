"""The response that a record supports, averaged over all numbers and places of time constants.

One set of time constants is never known to be the right one: sets that explain a record almost
equally well differ in what they say of slow modes. Their mean, each weighted by its evidence, errs
less than the best of them, and their spread belongs to the uncertainty of a DC gain.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import final

import numpy as np

from thermaxis.thermal._field import FloatArray
from thermaxis.thermal._modal_evidence import Design, Sizes
from thermaxis.thermal._modal_lags import (
    BoolArray,
    IndexArray,
    Refined,
    Refinement,
    Subsets,
    all_subsets,
    compared,
)

LARGER_GAINS = (0.0, 1.0, 2.0)
"""Logarithms by which gains of few lags may be larger than those of a whole grid. [1]"""
SLAB_GAINS = (1.0, 2.0, 3.0)
"""The same where some gains may be zero. [1]"""
MOST_ZEROS = 3
"""Gains of one set that are held at zero together, at most. [1]"""
MOST_PATTERNS = 180
"""Ways to hold gains at zero that are tried per set. [1]"""
SPARSE_SETS = 24
"""Best sets, by size of gains, that are compared with gains held at zero. [1]"""
CLOSEST = 1.5
"""Neighbouring time constants of one set differ at least by this factor. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Compared:
    """Sets of one number of lags under one size of gains."""

    sizes: Sizes
    """The sizes."""
    subsets: Subsets
    """The sets with their evidence."""
    log_weight: FloatArray
    """Logarithm of the weight: evidence over the number of sets, (m,). [1]"""

    @property
    def lags(self) -> int:
        """Number of lags j. [1]"""
        return int(self.subsets.members.shape[1])


def sets_of(design: Design, time_constants_s: FloatArray, lags: int) -> IndexArray:
    """Return all sets of so many time constants that differ enough, (m, j)."""
    members = all_subsets(design, lags)
    if lags < 2 or members.shape[0] == 0:
        return members
    apart = np.diff(np.log(time_constants_s)[members], axis=1)
    return members[np.min(apart, axis=1) > np.log(CLOSEST) - 1e-9]


def compare_sets(
    design: Design,
    products: tuple[FloatArray, float],
    sizes: Sizes,
    time_constants_s: FloatArray,
    most_lags: int,
) -> list[Compared]:
    """Return all sets of one up to so many lags with their evidence."""
    found = []
    for lags in range(1, most_lags + 1):
        members = sets_of(design, time_constants_s, lags)
        if members.shape[0] == 0:
            break
        for larger in LARGER_GAINS:
            those = replace(sizes, log_gain=sizes.log_gain + larger)
            subsets = compared(design, products, those, members)
            found.append(Compared(those, subsets, subsets.log_evidence - np.log(len(members))))
    return found


def _patterns(gains: int) -> BoolArray:
    """Return which gains are held at zero: none, one, two, ... of them, (m, gains)."""
    rows: list[BoolArray] = []
    for zeros in range(min(MOST_ZEROS, gains - 1) + 1):
        chosen = list(combinations(range(gains), zeros))
        if zeros > 0 and len(rows) + len(chosen) > MOST_PATTERNS:
            break
        for places in chosen:
            row = np.zeros(gains, dtype=np.bool_)
            row[list(places)] = True
            rows.append(row)
    return np.array(rows)


def compare_sparse(
    design: Design,
    products: tuple[FloatArray, float],
    sizes: Sizes,
    found: Sequence[Compared],
) -> list[Compared]:
    """Return the best sets again, each with some gains held at zero.

    Parameters
    ----------
    design : Design
        Regressors over the grid.
    products : tuple of FloatArray and float
        Products of its columns under the noise, and the noise's log determinant.
    sizes : Sizes
        Sizes of the highest evidence.
    found : sequence of Compared
        All sets with all gains.

    Returns
    -------
    list of Compared
        Their weights are on the scale of those of `found`.

    Notes
    -----
    An input need not act through every lag of the others. Where some gains may be zero, those
    that are not may be large without a penalty, so that opposite lags are not drawn together.

    References
    ----------
    George and McCulloch 1993 (spike and slab).
    """
    log_weight = np.concatenate([c.log_weight for c in found])
    cut = np.sort(log_weight)[-min(SPARSE_SETS, log_weight.size)]
    sparse = []
    for lags in sorted({c.lags for c in found}):
        those = [c.subsets.members[c.log_weight >= cut] for c in found if c.lags == lags]
        members = np.unique(np.vstack(those), axis=0)
        if members.shape[0] == 0:
            continue
        everything = len(sets_of_count(found, lags))
        patterns = _patterns(design.inputs * (1 + lags))
        repeated = np.repeat(members, patterns.shape[0], axis=0)
        without = np.tile(patterns, (members.shape[0], 1))
        for larger in SLAB_GAINS:
            those_sizes = replace(sizes, log_gain=sizes.log_gain + larger)
            subsets = compared(design, products, those_sizes, repeated, without)
            weight = subsets.log_evidence - np.log(everything * patterns.shape[0])
            sparse.append(Compared(those_sizes, subsets, weight))
    return sparse


def sets_of_count(found: Sequence[Compared], lags: int) -> IndexArray:
    """Return all sets of so many lags that were compared, (m, j)."""
    return next(c.subsets.members for c in found if c.lags == lags)


def best_of(found: Sequence[Compared], lags: int) -> tuple[IndexArray, Sizes, float]:
    """Return the most likely set of so many lags, its sizes and the logarithm of its weight."""
    those = [c for c in found if c.lags == lags]
    tops = [float(np.max(c.log_weight)) for c in those]
    best = those[int(np.argmax(tops))]
    place = int(np.argmax(best.log_weight))
    return best.subsets.members[place], best.sizes, float(best.log_weight[place])


@final
@dataclass(frozen=True, slots=True, eq=False)
class Average:
    """Mean over sets of what every input contributes, and of its DC gain."""

    contribution: FloatArray
    """Mean contribution of every input at the blocks of the record, scaled, (n, k). [1]"""
    dc_gain: FloatArray
    """Mean DC gain, scaled, (k,). [1]"""
    dc_variance: FloatArray
    """Variance of the DC gain within and between sets, scaled, (k,). [1]"""
    share: FloatArray
    """Weight of one, two, ... lags, (most lags,). [1]"""


def _laplace(refinement: Refinement, refined: Refined, wide: float) -> float:
    """Return the logarithm of the evidence of one number of lags around its refined place."""
    lags = refined.time_constants_s.size
    sizes = refinement.sizes
    subset = refinement.design_at(refined.time_constants_s)
    only = compared(
        subset, subset.products(sizes.noise), sizes, np.arange(lags, dtype=np.intp)[None, :]
    )
    moves = refined.covariance[-lags:, -lags:]
    # Sets are unordered: as many orders as there are describe the same lags.
    orders = float(np.sum(np.log(np.arange(1, lags + 1))))
    _, log_volume = np.linalg.slogdet(2.0 * np.pi * moves)
    return float(only.log_evidence[0]) + 0.5 * float(log_volume) + orders - lags * np.log(wide)


def averaged(
    design: Design,
    found: Sequence[Compared],
    refined: Sequence[tuple[Refinement, Refined]],
    span: float,
) -> Average:
    """Return the average over all sets of the grid and the refined ones.

    Parameters
    ----------
    design : Design
        Regressors over the grid.
    found : sequence of Compared
        All sets of the grid.
    refined : sequence of tuple of Refinement and Refined
        One refined set per number of lags.
    span : float
        Logarithm of the longest over the shortest time constant. [1]

    Returns
    -------
    Average
        Mean contributions and DC gains with their variance.
    """
    extra = [(item, _laplace(problem, item, span)) for problem, item in refined]
    highest = max([float(np.max(c.log_weight)) for c in found] + [weight for _, weight in extra])
    inputs, wide = design.inputs, 1 + design.lags
    gains = np.zeros((inputs, wide))
    most = max(c.lags for c in found)
    share = np.zeros(most)
    total, first, second, within = 0.0, np.zeros(inputs), np.zeros(inputs), np.zeros(inputs)
    for item in found:
        weight = np.exp(item.log_weight - highest)
        members, values = item.subsets.members, item.subsets.gains
        gains[:, 0] += weight @ values[:, :, 0]
        for i in range(inputs):
            np.add.at(gains[i], 1 + members, weight[:, None] * values[:, i, 1:])
        dc = values.sum(axis=2)
        first += weight @ dc
        second += weight @ dc**2
        within += weight @ item.subsets.dc_variance
        share[item.lags - 1] += weight.sum()
        total += float(weight.sum())
    columns = np.vstack([r[:, : inputs * wide] for r in design.rows])
    contribution = np.column_stack(
        [columns[:, i * wide : (i + 1) * wide] @ gains[i] for i in range(inputs)]
    )
    for (problem, _), (item, log_weight) in zip(refined, extra, strict=True):
        weight = float(np.exp(log_weight - highest))
        own = problem.design_at(item.time_constants_s)
        lags = item.time_constants_s.size
        rows = np.vstack([r[:, : own.gains] for r in own.rows])
        for i in range(inputs):
            part = slice(i * (1 + lags), (i + 1) * (1 + lags))
            contribution[:, i] += weight * (rows[:, part] @ item.gains[i])
            within[i] += weight * float(np.sum(item.covariance[part, part]))
        dc = item.gains.sum(axis=1)
        first, second = first + weight * dc, second + weight * dc**2
        share[lags - 1] += weight
        total += weight
    mean = first / total
    return Average(
        contribution=contribution / total,
        dc_gain=mean,
        dc_variance=within / total + np.maximum(second / total - mean**2, 0.0),
        share=share / total,
    )
