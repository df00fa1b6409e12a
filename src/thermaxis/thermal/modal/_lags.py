"""Few lags instead of many: which time constants of the grid a record asks for.

All subsets of up to a few time constants are compared from one matrix of products; the best are
refined between the points of the grid.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.modal._evidence import (
    Design,
    Scales,
    Sizes,
    design_of,
    factored,
    log_prior_variance,
)
from thermaxis.thermal.modal._regressors import Segment
from thermaxis.thermal.transfer_function import LEAST_LOG_RATIO

IndexArray: TypeAlias = NDArray[np.intp]
BoolArray: TypeAlias = NDArray[np.bool_]


@final
@dataclass(frozen=True, slots=True, eq=False)
class Subsets:
    """Subsets of one number of time constants, with what their evidence says."""

    members: IndexArray
    """Numbers of the grid's time constants, (m, j). [1]"""
    log_evidence: FloatArray
    """Logarithm of the record's density, (m,). [1]"""
    gains: FloatArray
    """Direct gains and gains of the lags, scaled, (m, k, 1 + j). [1]"""
    dc_variance: FloatArray
    """Posterior variance of the scaled DC gains, (m, k). [1]"""


def columns_of(design: Design, members: IndexArray) -> IndexArray:
    """Return the columns of a design that subsets use: gains, transients, offsets, (m, q)."""
    count, wide = members.shape[0], 1 + design.lags
    columns: list[IndexArray] = []
    for i in range(design.inputs):
        columns += [np.full((count, 1), i * wide), i * wide + 1 + members]
    for s in range(design.transients):
        columns.append(design.gains + s * design.lags + members)
    offsets = np.arange(design.penalised, design.penalised + design.offsets)
    columns.append(np.broadcast_to(offsets, (count, offsets.size)))
    return np.hstack(columns).astype(np.intp)


def prior_precision(design: Design, sizes: Sizes, lags: int) -> FloatArray:
    """Return the prior precision of the columns of a subset of so many lags, (q,)."""
    return np.exp(-log_prior_variance(design, sizes, lags))


def compared(
    design: Design,
    products: tuple[FloatArray, float],
    sizes: Sizes,
    members: IndexArray,
    without: BoolArray | None = None,
    dc: FloatArray | None = None,
) -> Subsets:
    """Return the evidence and the gains of subsets under given sizes.

    Notes
    -----
    The equations of `log_evidence_of`, for many sets of columns at once; the gains are A^-1 b, and
    S / n A^-1 is their covariance. A = C C' (Cholesky), so that with h = C^-1 b the sum of squares
    is S = y' K^-1 y - h' h, the gains are C'^-1 h, and the variance of the DC gain w' beta of an
    input, w being one (or `dc`) at its gains, is S / n |C^-1 w|^2. A gain that is held at zero has
    a unit row in A, a zero in b and w, and no factor in |L|.
    """
    gram, log_determinant = products
    lags = members.shape[1]
    columns = columns_of(design, members)
    width = columns.shape[1]
    precision = gram[columns[:, :, None], columns[:, None, :]]
    prior = prior_precision(design, sizes, lags)
    diagonal = np.arange(int(width))
    precision[:, diagonal, diagonal] += prior
    free = np.full(columns.shape, fill_value=True)
    if without is not None:
        free[:, : without.shape[1]] = ~without
        both = free[:, :, None] & free[:, None, :]
        precision = np.where(both, precision, np.eye(width))
    factor = factored(precision)
    wanted = np.zeros((width, 1 + design.inputs))
    for i in range(design.inputs):
        part = slice(i * (1 + lags), (i + 1) * (1 + lags))
        wanted[part, 1 + i] = 1.0 if dc is None else dc[part]
    right = np.broadcast_to(wanted, (members.shape[0], *wanted.shape)).copy()
    right[:, :, 0] = gram[columns, -1]
    right *= free[:, :, None]
    half = np.linalg.solve(factor, right)
    least = 1e-14 * abs(gram[-1, -1]) + 1e-300
    left = np.maximum(gram[-1, -1] - np.sum(half[:, :, 0] ** 2, axis=1), least)
    freedom = design.readings
    log_prior = -(free @ np.log(prior))
    log_evidence = -0.5 * (
        freedom * np.log(left / freedom)
        + log_determinant
        + 2.0 * np.sum(np.log(np.diagonal(factor, axis1=1, axis2=2)), axis=1)
        + log_prior
    )
    mean = np.linalg.solve(np.swapaxes(factor, 1, 2), half[:, :, :1])[:, :, 0]
    gains = mean[:, : design.inputs * (1 + lags)].reshape(-1, design.inputs, 1 + lags)
    return Subsets(
        members=members,
        log_evidence=log_evidence,
        gains=np.asarray(gains, dtype=np.float64),
        dc_variance=np.sum(half[:, :, 1:] ** 2, axis=1) * (left / freedom)[:, None],
    )


@final
@dataclass(frozen=True, slots=True, eq=False)
class Refined:
    """A few time constants between the grid's points, with all coefficients."""

    time_constants_s: FloatArray
    """Time constants, ascending, (j,). [s]"""
    gains: FloatArray
    """Direct gains and gains of the lags, scaled, (k, 1 + j). [1]"""
    offsets: FloatArray
    """Offsets of the experiments, scaled, (e,). [1]"""
    transients: FloatArray
    """Transients of the segments, scaled, (s, j). [1]"""
    covariance: FloatArray
    """Of gains (k (1 + j)), then of the logarithms of the time constants (j), scaled."""
    variance: float
    """Variance of the white noise of a block's mean, scaled. [1]"""
    penalised: float
    """Sum of squares plus penalties under the noise, scaled. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Linearised:
    """The model around time constants: gains, other coefficients, moves of their logarithms."""

    design: Design
    """Its rows hold all coefficients, the moves, and the displacement."""
    prior: FloatArray
    """Prior precision of coefficients and moves, (q,)."""


ENOUGH = 3e-3
"""Gain of one step, in variances of the white noise, below which the refinement ends. [1]"""
WIDE_LOG_STD = 2.0
"""Prior standard deviation of the logarithm of a time constant: hardly any. [1]"""
HELD = 1e12
"""Prior precision of what is given: a gain that is zero, a time constant that does not move. [1]"""
_DELTA = 1e-4


def _closest(taus_s: FloatArray) -> float:
    return float(np.min(np.diff(np.sort(np.log(taus_s))), initial=np.inf))


@final
@dataclass(frozen=True, slots=True, eq=False)
class Refinement:
    """The problem of moving time constants off the grid."""

    segments: Sequence[Segment]
    scales: Scales
    sizes: Sizes
    """Sizes of gains, transients and slow noise."""
    free_start: bool
    experiments: int
    """Number of experiments. [1]"""
    bounds_s: tuple[float, float]
    """Shortest and longest time constant. [s]"""
    acting: BoolArray | None = None
    """Where time constants are given, and do not move: through which an input acts, (k, 1 + j)."""

    def prior(self, design: Design) -> FloatArray:
        """Return the prior precision of the coefficients, (q,)."""
        found = prior_precision(design, self.sizes, design.lags)
        if self.acting is not None:
            found[: design.gains][~self.acting.ravel()] = HELD
        return found

    def design_at(self, taus_s: FloatArray) -> Design:
        """Return the regressors for a few time constants."""
        return design_of(
            self.segments,
            taus_s,
            self.scales,
            free_start=self.free_start,
            experiments=self.experiments,
        )

    def solved(self, taus_s: FloatArray) -> tuple[Design, FloatArray, float]:
        """Return design, coefficients and penalised sum of squares at these time constants."""
        design = self.design_at(taus_s)
        gram, _ = design.products(self.sizes.noise)
        precision = gram[:-1, :-1] + np.diag(self.prior(design))
        mean = np.asarray(np.linalg.solve(precision, gram[:-1, -1]), dtype=np.float64)
        left = float(gram[-1, -1] - gram[:-1, -1] @ mean)
        return design, mean, max(left, 1e-14 * abs(float(gram[-1, -1])) + 1e-300)

    def _slopes(self, design: Design, taus_s: FloatArray, mean: FloatArray) -> list[FloatArray]:
        """Return what moving the logarithm of each time constant does, (n, j) per segment."""
        above = self.design_at(taus_s * np.exp(_DELTA))
        lags = taus_s.size
        pick = np.zeros((mean.size, lags))
        for i in range(above.inputs):
            for j in range(lags):
                pick[i * (1 + lags) + 1 + j, j] = mean[i * (1 + lags) + 1 + j]
        for s in range(above.transients):
            for j in range(lags):
                column = above.gains + s * lags + j
                pick[column, j] = mean[column]
        return [
            (a[:, :-1] - b[:, :-1]) @ pick / _DELTA
            for a, b in zip(above.rows, design.rows, strict=True)
        ]

    def linearised(self, refined: Refined) -> Linearised:
        """Return the model around refined time constants."""
        coefficients = np.concatenate(
            [refined.gains.ravel(), refined.transients.ravel(), refined.offsets]
        )
        taus_s = refined.time_constants_s
        return self._linearised(self.design_at(taus_s), taus_s, coefficients, refined.variance)

    def _linearised(
        self, design: Design, taus_s: FloatArray, mean: FloatArray, variance: float
    ) -> Linearised:
        """Return the model around time constants, whose logarithms have a wide normal prior."""
        slopes = self._slopes(design, taus_s, mean)
        rows = tuple(
            np.hstack([r[:, :-1], d, r[:, -1:]]) for r, d in zip(design.rows, slopes, strict=True)
        )
        move = variance / WIDE_LOG_STD**2 if self.acting is None else HELD
        return Linearised(
            design=replace(design, rows=rows),
            prior=np.concatenate([self.prior(design), np.full(taus_s.size, move)]),
        )

    def refined(self, start_s: FloatArray, steps: int = 15) -> Refined:
        """Return the time constants near a start that fit best, with their covariance."""
        low, high = self.bounds_s
        taus_s = np.sort(start_s)
        design, mean, penalised = self.solved(taus_s)
        damping = 1e-3
        freedom = design.readings
        for _ in range(steps):
            local = self._linearised(design, taus_s, mean, penalised / freedom)
            gram, _ = local.design.products(self.sizes.noise)
            precision = gram[:-1, :-1] + np.diag(local.prior)
            right = gram[:-1, -1]
            moved, gain = False, 0.0
            while damping < 1e6:
                damped = precision.copy()
                tail = np.arange(mean.size, int(damped.shape[0]))
                damped[tail, tail] *= 1.0 + damping
                move = np.clip(np.linalg.solve(damped, right)[mean.size :], -0.7, 0.7)
                tried_s = np.clip(taus_s * np.exp(move), low, high)
                if _closest(tried_s) < min(LEAST_LOG_RATIO, _closest(taus_s)):
                    damping *= 10.0
                    continue
                found = self.solved(tried_s)
                if found[2] < penalised:
                    gain = penalised - found[2]
                    taus_s, (design, mean, penalised) = tried_s, found
                    damping, moved = max(damping / 10.0, 1e-6), True
                    break
                damping *= 10.0
            if not moved or gain < ENOUGH * penalised / freedom:
                break
        return self._result(design, taus_s, mean, penalised)

    def _result(
        self, design: Design, taus_s: FloatArray, mean: FloatArray, penalised: float
    ) -> Refined:
        variance = penalised / design.readings
        local = self._linearised(design, taus_s, mean, variance)
        gram, _ = local.design.products(self.sizes.noise)
        precision = gram[:-1, :-1] + np.diag(local.prior)
        tail = np.arange(mean.size, int(precision.shape[0]))
        full = variance * np.linalg.inv(precision)
        kept = np.concatenate([np.arange(design.gains), tail])
        order = np.argsort(taus_s)
        gains = mean[: design.gains].reshape(design.inputs, 1 + taus_s.size)
        transients = mean[design.gains : design.penalised].reshape(-1, taus_s.size)
        lag_order = np.concatenate([[0], 1 + order])
        blocks = [i * (1 + taus_s.size) + lag_order for i in range(design.inputs)]
        rearranged = np.concatenate([*blocks, design.gains + order])
        covariance = full[np.ix_(kept, kept)][np.ix_(rearranged, rearranged)]
        return Refined(
            time_constants_s=taus_s[order],
            gains=gains[:, lag_order],
            offsets=mean[design.penalised :],
            transients=transients[:, order],
            covariance=np.asarray(covariance, dtype=np.float64),
            variance=variance,
            penalised=penalised,
        )
