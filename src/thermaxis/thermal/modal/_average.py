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

from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.modal._evidence import Design, Sizes
from thermaxis.thermal.modal._lags import (
    BoolArray,
    IndexArray,
    Refined,
    Refinement,
    Subsets,
    compared,
)

LARGER_GAINS = (0.0, 1.0, 2.0)
"""Logarithms by which gains of few lags may be larger than those of a whole grid. [1]"""
PER_LAG = 1.0
"""Logarithm of how much less plausible every further lag is before the record is seen. [1]"""
SLAB_GAINS = (1.0, 2.0, 3.0)
"""The same where some gains may be zero. [1]"""
TILTS = (8.0, 10.0)
"""Logarithms by which gains of the whole grid are smaller at its slow end. [1]"""
GRID_GAINS = (0.0, 2.0, 4.0, 6.0, 8.0)
"""Logarithms by which they are larger at its fast end. [1]"""
NEGLIGIBLE = 1e-6
"""Weight against the best set below which sets are left out. [1]"""
MOST_ZEROS = 3
"""Gains of one set that are held at zero together, at most. [1]"""
MOST_PATTERNS = 180
"""Ways to hold gains at zero that are tried per set. [1]"""
TRUSTED_BLOCKS = 1200.0
"""Block means at which the evidence counts half in the variance of a DC gain: the most at which
intervals of 72 h hold on machines that are no sum of few lags. [1]"""
MANY_LAGS = 4
"""Lags beyond which further ones are not counted as such. [1]"""
SPARSE_SETS = 24
"""Best sets, by size of gains, that are compared with gains held at zero. [1]"""
CLOSEST = 1.5
"""Neighbouring time constants of one set differ at least by this factor. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Compared:
    """Sets of one number of lags under one size of gains."""

    sizes: Sizes
    subsets: Subsets
    """The sets with their evidence."""
    log_weight: FloatArray
    """Logarithm of the weight: evidence over the number of sets, (m,). [1]"""
    unit: FloatArray | None = None
    """One scaled gain of every column, (gains,), where they are not alike. [1]"""

    @property
    def lags(self) -> int:
        """Number of lags j. [1]"""
        return int(self.subsets.members.shape[1])


def sets_of(design: Design, time_constants_s: FloatArray, lags: int) -> IndexArray:
    """Return all sets of so many time constants that differ enough, (m, j)."""
    every = list(combinations(range(design.lags), lags))
    members = np.array(every, dtype=np.intp).reshape(-1, lags)
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
    found: list[Compared] = []
    for lags in range(1, most_lags + 1):
        members = sets_of(design, time_constants_s, lags)
        if members.shape[0] == 0:
            break
        for larger in LARGER_GAINS:
            those = sizes.enlarged(larger)
            subsets = compared(design, products, those, members)
            weight = subsets.log_evidence - np.log(len(members)) - PER_LAG * lags
            found.append(Compared(those, subsets, weight))
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
    sparse: list[Compared] = []
    for lags in sorted({c.lags for c in found}):
        those = [c.subsets.members[c.log_weight >= cut] for c in found if c.lags == lags]
        members = np.unique(np.vstack(those), axis=0)
        if members.shape[0] == 0:
            continue
        everything = len(next(c for c in found if c.lags == lags).log_weight)
        sparse += _with_zeros(design, products, sizes, members, -float(np.log(everything)))
    return sparse


def _with_zeros(
    design: Design,
    products: tuple[FloatArray, float],
    sizes: Sizes,
    members: IndexArray,
    log_prior: float,
) -> list[Compared]:
    """Return sets with some gains held at zero, for every size of the others."""
    patterns = _patterns(design.inputs * (1 + members.shape[1]))
    repeated = np.repeat(members, patterns.shape[0], axis=0)
    without = np.tile(patterns, (members.shape[0], 1))
    found: list[Compared] = []
    for larger in SLAB_GAINS:
        those = sizes.enlarged(larger)
        subsets = compared(design, products, those, repeated, without)
        weight = subsets.log_evidence - np.log(patterns.shape[0]) + log_prior
        weight -= PER_LAG * members.shape[1]
        found.append(Compared(those, subsets, weight))
    return found


def compare_grids(
    design: Design, products: tuple[FloatArray, float], sizes: Sizes, time_constants_s: FloatArray
) -> list[Compared]:
    """Return the whole grid with gains that are the smaller the slower the lag.

    Notes
    -----
    A response that is no sum of few lags (complex poles) asks for opposite gains of neighbouring
    fast lags, far larger than those of slow ones. The standard deviation of a gain is
    exp(larger - tilt x) times the common size, x from zero at the direct gain and the fastest lag
    to one at the slowest. In units of it the prior is that of any set (`compared`).
    """
    gram, log_determinant = products
    log_tau = np.log(time_constants_s)
    slow = np.append(0.0, (log_tau - log_tau[0]) / (log_tau[-1] - log_tau[0]))
    every = np.arange(design.lags, dtype=np.intp)[None, :]
    found: list[Compared] = []
    for tilt in TILTS:
        unit = np.ones(gram.shape[0])
        unit[: design.gains] = np.tile(np.exp(-tilt * slow), design.inputs)
        scaled = (gram * unit * unit[:, None], log_determinant)
        for larger in GRID_GAINS:
            those = sizes.enlarged(larger)
            one = compared(design, scaled, those, every, dc=unit[: design.gains])
            gains = one.gains * unit[: design.gains].reshape(design.inputs, -1)
            weight = one.log_evidence - np.log(len(TILTS) * len(GRID_GAINS))
            found.append(Compared(those, replace(one, gains=gains), weight, unit[: design.gains]))
    return found


def best_of(found: Sequence[Compared], lags: int) -> tuple[IndexArray, Sizes]:
    """Return the most likely set of so many lags, and its sizes."""
    those = [c for c in found if c.lags == lags]
    best = max(those, key=lambda c: float(np.max(c.log_weight)))
    return best.subsets.members[int(np.argmax(best.log_weight))], best.sizes


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


@final
@dataclass(frozen=True, slots=True, eq=False)
class Component:
    """Sets of lags that are averaged over, with the regressors that they belong to."""

    design: Design
    compared: Compared
    dc_variance: FloatArray
    """Variance of the DC gain from the time constants' uncertainty, scaled, (k,). [1]"""
    time_constants_s: FloatArray
    """Time constants of the regressors, (j,). [s]"""
    moves: FloatArray | None = None
    """Covariance of their logarithms off the grid, (j, j); None on it. [1]"""
    moving: FloatArray | None = None
    """What moving them does to the gains, scaled, (k, 1 + j, j). [1]"""


def log_prior_of(refined: Refined, span: float) -> float:
    """Return the logarithm of the prior mass of lags that the record cannot tell from these. [1]

    References
    ----------
    MacKay 1992 (Laplace's approximation of the evidence).
    """
    lags = refined.time_constants_s.size
    # Sets are unordered: as many orders as there are describe the same lags.
    orders = float(np.sum(np.log(np.arange(1, lags + 1))))
    _, log_volume = np.linalg.slogdet(2.0 * np.pi * refined.covariance[-lags:, -lags:])
    return 0.5 * float(log_volume) + orders - lags * float(np.log(span))


def refined_components(
    problem: Refinement, refined: Refined, sizes: Sizes, span: float
) -> list[Component]:
    """Return the components of lags off the grid, some gains held at zero."""
    lags = refined.time_constants_s.size
    design = problem.design_at(refined.time_constants_s)
    products = design.products(sizes.noise)
    moves = refined.covariance[-lags:, -lags:]
    log_prior = log_prior_of(refined, span)
    gains = design.gains
    total = refined.covariance[:gains, :gains]
    # What the gains would vary if the time constants were known.
    cross = refined.covariance[:gains, gains:]
    moving = np.linalg.solve(moves, cross.T).T
    added = moving @ cross.T
    parts = [slice(i * (1 + lags), (i + 1) * (1 + lags)) for i in range(design.inputs)]
    dc_variance = np.array([max(float(np.sum(added[p, p])), 0.0) for p in parts])
    bound = np.array([float(np.sum(total[p, p])) for p in parts])
    members = np.arange(lags, dtype=np.intp)[None, :]
    return [
        Component(
            design,
            item,
            np.minimum(dc_variance, bound),
            refined.time_constants_s,
            moves,
            np.asarray(moving.reshape(design.inputs, 1 + lags, lags), dtype=np.float64),
        )
        for item in _with_zeros(design, products, sizes, members, log_prior)
    ]


def averaged(components: Sequence[Component]) -> Average:
    """Return the average over all components."""
    highest = max(float(np.max(c.compared.log_weight)) for c in components)
    inputs = components[0].design.inputs
    readings = components[0].design.readings
    contribution = np.zeros((readings, inputs))
    total, first, second, within = 0.0, np.zeros(inputs), np.zeros(inputs), np.zeros(inputs)
    for component in components:
        item, design = component.compared, component.design
        weight = np.exp(item.log_weight - highest)
        whole = float(weight.sum())
        if whole < NEGLIGIBLE:
            continue
        members, values = item.subsets.members, item.subsets.gains
        gains = np.zeros((inputs, 1 + design.lags))
        gains[:, 0] = weight @ values[:, :, 0]
        for i in range(inputs):
            np.add.at(gains[i], 1 + members, weight[:, None] * values[:, i, 1:])
            columns = slice(i * (1 + design.lags), (i + 1) * (1 + design.lags))
            contribution[:, i] += np.concatenate([r[:, columns] @ gains[i] for r in design.rows])
        dc = values.sum(axis=2)
        first += weight @ dc
        second += weight @ dc**2
        within += weight @ item.subsets.dc_variance + whole * component.dc_variance
        total += whole
    mean = first / total
    return Average(
        contribution=contribution / total,
        dc_gain=mean,
        dc_variance=within / total + np.maximum(second / total - mean**2, 0.0),
    )


def tempered_weights(components: Sequence[Component]) -> list[FloatArray]:
    """Return the weights of all sets in the uncertainty, (m,) per component. [1]

    Notes
    -----
    No machine is a sum of few lags with exactly this noise, and under a model that is a little
    wrong evidence is too sure: it leaves out weak slow lags, and the longer the record the surer.
    Of n block means it counts by the power 1 / (1 + n / TRUSTED_BLOCKS), and further lags are
    rather more plausible than few.

    References
    ----------
    Miller and Dunson 2019 (coarsening: the power of a likelihood that is not exact).
    """
    items = [c.compared for c in components]
    log_weight = [c.log_weight + 2.0 * PER_LAG * min(c.lags, MANY_LAGS) for c in items]
    highest = max(float(np.max(each)) for each in log_weight)
    power = 1.0 / (1.0 + components[0].design.readings / TRUSTED_BLOCKS)
    return [np.exp(power * (each - highest)) for each in log_weight]


def tempered_variance(components: Sequence[Component], dc_gain: FloatArray) -> FloatArray:
    """Return the mean square by which DC gains may differ from those stated, scaled, (k,)."""
    weight = np.concatenate(tempered_weights(components))
    dc = np.concatenate([c.compared.subsets.gains.sum(axis=2) for c in components])
    within = np.concatenate([c.compared.subsets.dc_variance + c.dc_variance for c in components])
    return np.asarray(weight @ (within + (dc - dc_gain) ** 2) / weight.sum())
