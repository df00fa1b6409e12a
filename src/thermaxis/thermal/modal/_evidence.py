"""Gains over a grid of time constants, how large they and the slow noise are by the evidence.

Every input acts through a direct gain and one lag per time constant of a grid, far more than a
record can tell apart. What keeps them in bounds is a prior: gains are normal around zero with one
common size. The size, the size of transients from an unknown start, and the slow noise are those
under which the record is most likely after all gains are averaged out (type II likelihood).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import final

import numpy as np
from scipy.linalg import (
    cho_solve,  # pyright: ignore[reportUnknownVariableType]
    solve_triangular,  # pyright: ignore[reportUnknownVariableType]
)

from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.modal._regressors import Segment
from thermaxis.thermal.modal._slow_noise import SlowNoise, weighted_products

ROUND_OFF = (0.0, 1e-12, 1e-9, 1e-6)
"""Shares by which the diagonal of a precision is raised until round-off leaves it positive. [1]"""
FAR_START = 4.0
"""Logarithm of the size of transients, in standard deviations of the white noise, beyond which an
experiment began far from any steady state. Default: cold tests of the virtual machine show up to
3, warm ones mostly 4 to 6.5. [1]"""


def factored(precision: FloatArray) -> FloatArray:
    """Return the lower Cholesky factor of one precision or of many, (..., p, p).

    Where a record without noise makes regressors all but equal, round-off may leave a precision
    slightly negative; its diagonal is raised by as little as is needed.
    """
    places = np.arange(int(precision.shape[-1]))
    for share in ROUND_OFF[:-1]:
        raised = precision.copy()
        raised[..., places, places] *= 1.0 + share
        try:
            return np.asarray(np.linalg.cholesky(raised), dtype=np.float64)
        except np.linalg.LinAlgError:
            continue
    raised = precision.copy()
    raised[..., places, places] *= 1.0 + ROUND_OFF[-1]
    return np.asarray(np.linalg.cholesky(raised), dtype=np.float64)


@final
@dataclass(frozen=True, slots=True)
class Sizes:
    """What the evidence decides: all sizes relative to the white noise of a block's mean."""

    log_gain: float
    """Logarithm of the prior standard deviation of a gain, inputs scaled to unit spread. [1]"""
    log_transients: tuple[float, ...]
    """Logarithm of the prior standard deviation of a transient, per segment with a free start: a
    cold start needs none, a warm one large ones. [1]"""
    log_ratio: float
    """Logarithm of the variance of the slow noise over that of the white noise. [1]"""
    log_correlation: float
    """Logarithm of the correlation time of the slow noise in seconds. [1]"""

    log_fast_ratio: float
    """The same ratio of the faster part of the noise. [1]"""
    fast_correlation_s: float
    """Correlation time of the faster part, which is not searched for. [s]"""

    @property
    def noise(self) -> SlowNoise:
        """The correlated noise of these sizes."""
        return SlowNoise(
            float(np.exp(self.log_ratio)),
            float(np.exp(self.log_correlation)),
            float(np.exp(self.log_fast_ratio)),
            self.fast_correlation_s,
        )

    def enlarged(self, larger: float) -> "Sizes":
        """Return the sizes for fewer lags, each of which has to explain more."""
        transients = tuple(t + larger if t > FAR_START else t for t in self.log_transients)
        return replace(self, log_gain=self.log_gain + larger, log_transients=transients)


@final
@dataclass(frozen=True, slots=True, eq=False)
class Design:
    """Regressors of all segments: per input direct and lags, transients, offsets, displacement."""

    rows: tuple[FloatArray, ...]
    """Columns at the measured blocks, one array (n, p + 1) per segment, scaled to unit spread."""
    white_variance: tuple[FloatArray, ...]
    """Variance of the white noise relative to a full block's, (n,) per segment. [1]"""
    times_s: tuple[FloatArray, ...]
    """Begin of the blocks, (n,) per segment. [s]"""
    inputs: int
    """Number of inputs k. [1]"""
    lags: int
    """Number of time constants j. [1]"""
    transients: int
    """Number of segments whose start is free. [1]"""
    offsets: int
    """Number of experiments, each with an offset. [1]"""

    @property
    def gains(self) -> int:
        """Columns of gains, k (1 + j). [1]"""
        return self.inputs * (1 + self.lags)

    @property
    def penalised(self) -> int:
        """Columns with a prior: gains and transients. [1]"""
        return self.gains + self.transients * self.lags

    @property
    def readings(self) -> int:
        """Number of block means. [1]"""
        return sum(r.shape[0] for r in self.rows)

    def products(self, noise: SlowNoise) -> tuple[FloatArray, float]:
        """Return the products of all columns under the noise, and its log determinant."""
        gram: FloatArray | None = None
        log_determinant = 0.0
        for rows, white, times_s in zip(self.rows, self.white_variance, self.times_s, strict=True):
            part = weighted_products(rows, white, times_s, noise)
            gram = part.gram if gram is None else gram + part.gram
            log_determinant += part.log_determinant
        assert gram is not None  # noqa: S101 - a design has a segment
        return gram, log_determinant


@final
@dataclass(frozen=True, slots=True)
class Scales:
    """Spreads that make inputs and displacement free of units."""

    u: FloatArray
    """Spread of every input, (k,). [K]"""
    y: float
    """Spread of the displacement. [µm]"""


def scales_of(segments: Sequence[Segment]) -> Scales:
    """Return the spreads of the inputs and of the displacement over all segments."""
    u = np.concatenate([s.mean_u[s.count > 0] for s in segments])
    y = np.concatenate([s.y[s.count > 0] for s in segments])
    spread_u = np.sqrt(np.mean(np.square(u), axis=0))
    spread_u = np.where(spread_u > 0, spread_u, 1.0)
    spread_y = float(np.std(y))
    return Scales(spread_u, spread_y if spread_y > 0 else 1.0)


def design_of(
    segments: Sequence[Segment],
    time_constants_s: FloatArray,
    scales: Scales,
    *,
    free_start: bool,
    experiments: int,
) -> Design:
    """Return the regressors of segments for a set of time constants."""
    count = time_constants_s.size
    rows: list[FloatArray] = []
    white: list[FloatArray] = []
    times: list[FloatArray] = []
    free = len(segments) if free_start else 0
    for number, segment in enumerate(segments):
        use = segment.count > 0
        columns: list[FloatArray] = []
        direct = segment.mean_u
        for i, spread in enumerate(scales.u.tolist()):
            columns += [direct[:, i : i + 1] / spread]
            columns += [segment.lag_means(i, time_constants_s) / spread]
        fading = np.zeros((segment.blocks, free * count))
        if free:
            own = slice(number * count, (number + 1) * count)
            fading[:, own] = segment.fading_means(time_constants_s)
        offset = np.zeros((segment.blocks, experiments))
        offset[:, segment.experiment] = 1.0
        y = segment.y[:, None] / scales.y
        rows.append(np.hstack([*columns, fading, offset, y])[use])
        white.append(segment.rows / segment.count[use])
        times.append(segment.times_s[use])
    return Design(
        rows=tuple(rows),
        white_variance=tuple(white),
        times_s=tuple(times),
        inputs=scales.u.size,
        lags=count,
        transients=free,
        offsets=experiments,
    )


@final
@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """Gains, transients and offsets of a design, given the sizes."""

    log_evidence: float
    """Logarithm of the record's density with all coefficients averaged out, and of the hyperprior.
    [1]"""
    coefficients: FloatArray
    """Posterior mean, (p,), in units of the scaled design. [1]"""
    variance: float
    """Variance of the white noise of a block's mean, in units of the scaled design. [1]"""
    precision_factor: FloatArray
    """Lower Cholesky factor of the posterior precision times that variance, (p, p)."""

    def covariance(self) -> FloatArray:
        """Return the posterior covariance of the coefficients, (p, p)."""
        unit = np.eye(self.coefficients.size)
        inverse = np.asarray(cho_solve((self.precision_factor, True), unit), dtype=np.float64)
        return self.variance * inverse


@final
@dataclass(frozen=True, slots=True)
class Hyperprior:
    """What sizes are plausible before the record is seen: wide normals of their logarithms."""

    correlation_s: float
    """Most plausible correlation time of the slow noise. [s]"""
    fast_correlation_s: float
    """Correlation time of the faster part of the noise. [s]"""

    def log_density(self, sizes: Sizes) -> float:
        """Return the logarithm of the density up to a constant. [1]"""
        return -0.5 * (
            ((sizes.log_correlation - np.log(self.correlation_s)) / 0.8) ** 2
            + ((sizes.log_ratio - 5.0) / 4.0) ** 2
            + ((sizes.log_gain - 3.0) / 4.0) ** 2
            + ((sizes.log_fast_ratio - 1.0) / 3.0) ** 2
            + sum((one / 4.0) ** 2 for one in sizes.log_transients)
        )


def posterior_of(
    design: Design,
    products: tuple[FloatArray, float],
    sizes: Sizes,
    hyperprior: Hyperprior,
) -> Posterior:
    """Return coefficients and evidence under given sizes.

    Notes
    -----
    With the displacements y = F beta + noise, noise ~ N(0, v K) and beta ~ N(0, v L^-1), where L
    is exp(-2 log size) on the diagonal and zero for offsets, let

        A = F' K^-1 F + L,    b = F' K^-1 y,    S = y' K^-1 y - b' A^-1 b,    f = n - offsets.

    The posterior mean is A^-1 b and its covariance v A^-1. With beta integrated out and v at its
    most likely value S / f, the density of the record is, but for a constant,

        log p(y) = -1/2 (f log(S / f) + log|K| + log|A| - log|L+|),

    L+ being the part of L that is not zero. `gram` holds F' K^-1 F, b and y' K^-1 y.

    References
    ----------
    Rasmussen and Williams 2006, section 2.7 (explicit basis functions) and 5.4; MacKay 1992.
    """
    gram, log_determinant = products
    free = design.offsets
    prior = np.concatenate(
        [
            np.full(design.gains, 2.0 * sizes.log_gain),
            np.repeat(2.0 * np.array(sizes.log_transients), design.lags),
        ]
    )
    precision = gram[:-1, :-1].copy()
    diagonal = np.arange(design.penalised)
    precision[diagonal, diagonal] += np.exp(-prior)
    factor = factored(precision)
    half = np.asarray(
        solve_triangular(factor, gram[:-1, -1], lower=True, check_finite=False), dtype=np.float64
    )
    left = max(float(gram[-1, -1] - half @ half), 1e-14 * abs(float(gram[-1, -1])) + 1e-300)
    freedom = design.readings - free
    log_evidence = -0.5 * (
        freedom * np.log(left / freedom)
        + log_determinant
        + 2.0 * float(np.sum(np.log(np.diag(factor))))
        + float(np.sum(prior))
    )
    return Posterior(
        log_evidence=float(log_evidence) + hyperprior.log_density(sizes),
        coefficients=np.asarray(
            solve_triangular(factor, half, lower=True, trans=1, check_finite=False),
            dtype=np.float64,
        ),
        variance=left / freedom,
        precision_factor=np.asarray(factor),
    )


_STEPS = {"log_gain": 1.5, "log_ratio": 1.5, "log_correlation": 0.7, "log_fast_ratio": 1.5}
_TRANSIENT_STEP = 2.0
MOST_LOG_CHANGE = 2.4
"""Logarithm by which the correlation time may differ from the most plausible one. [1]"""
_BOUNDS = {
    "log_gain": (-6.0, 14.0),
    "log_ratio": (-8.0, 14.0),
    "log_fast_ratio": (-8.0, 12.0),
}
_TRANSIENT_BOUNDS = (-12.0, 12.0)


def _neighbours(
    sizes: Sizes, share: float, hyperprior: Hyperprior
) -> Iterator[tuple[Sizes, Sizes]]:
    """Yield, size by size, the sizes one step above and one below."""
    middle = float(np.log(hyperprior.correlation_s))
    for name, step in _STEPS.items():
        low, high = _BOUNDS.get(name, (middle - MOST_LOG_CHANGE, middle + MOST_LOG_CHANGE))
        above, below = (
            replace(sizes, **{name: float(np.clip(getattr(sizes, name) + move, low, high))})
            for move in (share * step, -share * step)
        )
        yield above, below
    low, high = _TRANSIENT_BOUNDS
    for place, one in enumerate(sizes.log_transients):
        head, tail = sizes.log_transients[:place], sizes.log_transients[place + 1 :]
        above, below = (
            replace(sizes, log_transients=(*head, float(np.clip(one + move, low, high)), *tail))
            for move in (share * _TRANSIENT_STEP, -share * _TRANSIENT_STEP)
        )
        yield above, below


def most_likely_sizes(
    design: Design, hyperprior: Hyperprior, smallest_step: float = 0.15
) -> tuple[Sizes, Posterior]:
    """Return the sizes under which the record is most likely."""
    best = Sizes(
        log_gain=4.0,
        log_transients=(0.0,) * design.transients,
        log_ratio=5.0,
        log_correlation=float(np.log(hyperprior.correlation_s)),
        log_fast_ratio=1.0,
        fast_correlation_s=hyperprior.fast_correlation_s,
    )
    seen: dict[SlowNoise, tuple[FloatArray, float]] = {}

    def tried(sizes: Sizes) -> Posterior:
        key = sizes.noise
        if key not in seen:
            seen[key] = design.products(key)
        return posterior_of(design, seen[key], sizes, hyperprior)

    found, share = tried(best), 1.0
    while share > smallest_step:
        moved = False
        for place in range(len(_STEPS) + design.transients):
            pair = next(islice(_neighbours(best, share, hyperprior), place, None))
            for other in pair:
                there = tried(other)
                if there.log_evidence > found.log_evidence + 1e-9:
                    best, found, moved = other, there, True
                    break
        if not moved:
            share /= 2.0
    return best, found
