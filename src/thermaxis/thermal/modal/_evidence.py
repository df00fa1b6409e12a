"""Gains over a grid of time constants, how large they and the slow noise are by the evidence.

Every input acts through a direct gain and one lag per time constant of a grid, far more than a
record can tell apart. What keeps them in bounds is a prior: gains are normal around zero with one
common size. The size, the size of transients from an unknown start, and the slow noise are those
under which the record is most likely after all gains are averaged out (type II likelihood).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from scipy.linalg import solve_triangular  # pyright: ignore[reportUnknownVariableType]

from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.modal._regressors import Segment
from thermaxis.thermal.modal._slow_noise import SlowNoise, weighted_products

ROUND_OFF = (0.0, 1e-12, 1e-9, 1e-6)
"""Shares by which the diagonal of a precision is raised until round-off leaves it positive. [1]"""
AT_REST = -12.0
"""Logarithm of the size of transients of an experiment that began at rest: none. [1]"""
REST_ODDS = 15.0
"""Logarithm of how much less likely a record must be from rest than from a free start before it is
taken to have begun otherwise: tests begin at rest, and noise of another kind than assumed is worth
some of it. Default: cold tests of the virtual machine show up to 4, warm ones mostly 24 and more.
[1]"""
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
    zeros: FloatArray
    """What the rows of each experiment are relative to, (e, p + 1): their values at its zero."""
    zero_variance: FloatArray
    """Variance of the white noise of its zero relative to a full block's, (e,). [1]"""

    @property
    def offsets(self) -> int:
        """Number of experiments, each with an offset. [1]"""
        return int(self.zero_variance.size)

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
    gains = scales.u.size * (1 + count)
    zeros = np.zeros((experiments, gains + free * count + experiments + 1))
    zero_variance = np.zeros(experiments)
    for number, segment in enumerate(segments):
        use = segment.count > 0
        columns: list[FloatArray] = []
        direct = segment.mean_u
        for i, spread in enumerate(scales.u.tolist()):
            columns += [direct[:, i : i + 1] / spread]
            columns += [segment.lag_means(i, time_constants_s) / spread]
        fading = np.zeros((segment.blocks, free * count))
        own = slice(number * count, (number + 1) * count)
        if free:
            fading[:, own] = segment.fading_means(time_constants_s)
        if segment.zero.size:
            zero = zeros[segment.experiment]
            for i, spread in enumerate(scales.u.tolist()):
                place = i * (1 + count)
                zero[place : place + 1 + count] = segment.lag_zero(i, time_constants_s) / spread
            if free:
                zero[gains:][own] = segment.fading_zero(time_constants_s)
            zero[-1] = segment.zero_um / scales.y
            zero_variance[segment.experiment] = segment.rows / segment.zero.size
        offset = np.zeros((segment.blocks, experiments))
        offset[:, segment.experiment] = 1.0
        y = segment.y[:, None] / scales.y
        rows.append(np.hstack([*columns, fading, offset, y])[use])
        white.append(segment.rows / segment.count[use])
        times.append(segment.times_s[use])
    relative = [r - zeros[s.experiment] for r, s in zip(rows, segments, strict=True)]
    return Design(
        rows=tuple(relative),
        white_variance=tuple(white),
        times_s=tuple(times),
        inputs=scales.u.size,
        lags=count,
        transients=free,
        zeros=zeros,
        zero_variance=zero_variance,
    )


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
            + sum((one / 4.0) ** 2 for one in sizes.log_transients if one > AT_REST)
        )


def log_prior_variance(design: Design, sizes: Sizes, lags: int) -> FloatArray:
    """Return the logarithms of the prior variances of gains, transients, offsets, (q,). [1]

    Rows are relative to the record's zero, where the model says zero too. What is left of an offset
    are the slow noise and the white noise at the zero, so these are its size.
    """
    noise = np.exp(sizes.log_ratio) + np.exp(sizes.log_fast_ratio) + design.zero_variance
    return np.concatenate(
        [
            np.full(design.inputs * (1 + lags), 2.0 * sizes.log_gain),
            np.repeat(2.0 * np.array(sizes.log_transients), lags),
            np.log(noise),
        ]
    )


def log_evidence_of(design: Design, products: tuple[FloatArray, float], sizes: Sizes) -> float:
    """Return the logarithm of the record's density under given sizes. [1]

    Notes
    -----
    With the displacements y = F beta + noise, noise ~ N(0, v K) and beta ~ N(0, v L^-1), L being
    diagonal (`log_prior_variance`), let

        A = F' K^-1 F + L,    b = F' K^-1 y,    S = y' K^-1 y - b' A^-1 b.

    With beta integrated out and v at its most likely value S / n, the density of the record is, but
    for a constant,

        log p(y) = -1/2 (n log(S / n) + log|K| + log|A| - log|L|).

    `gram` holds F' K^-1 F, b and y' K^-1 y.

    References
    ----------
    Rasmussen and Williams 2006, section 5.4; MacKay 1992.
    """
    gram, log_determinant = products
    prior = log_prior_variance(design, sizes, design.lags)
    precision = gram[:-1, :-1].copy()
    diagonal = np.arange(prior.size)
    precision[diagonal, diagonal] += np.exp(-prior)
    factor = factored(precision)
    half = np.asarray(
        solve_triangular(factor, gram[:-1, -1], lower=True, check_finite=False), dtype=np.float64
    )
    left = max(float(gram[-1, -1] - half @ half), 1e-14 * abs(float(gram[-1, -1])) + 1e-300)
    return -0.5 * float(
        design.readings * np.log(left / design.readings)
        + log_determinant
        + 2.0 * float(np.sum(np.log(np.diag(factor))))
        + float(np.sum(prior))
    )


MOST_LOG_CHANGE = 2.4
"""Logarithm by which the correlation time may differ from the most plausible one. [1]"""
_SMALLEST_STEP = 0.15


def most_likely_sizes(
    design: Design, hyperprior: Hyperprior, may_rest: Sequence[bool] = ()
) -> Sizes:
    """Return the sizes under which the record is most likely: a search along every size in turn.

    A segment that may begin at rest does so unless a free start is `REST_ODDS` more likely.
    """
    middle, free = float(np.log(hyperprior.correlation_s)), design.transients
    # gain, ratio, correlation time and fast ratio, then the transients: all of them logarithms
    start = np.array([4.0, 5.0, middle, 1.0, *[0.0] * free])
    steps = np.array([1.5, 1.5, 0.7, 1.5, *[2.0] * free])
    low = np.array([-6.0, -8.0, middle - MOST_LOG_CHANGE, -8.0, *[AT_REST] * free])
    high = np.array([14.0, 14.0, middle + MOST_LOG_CHANGE, 12.0, *[12.0] * free])
    seen: dict[SlowNoise, tuple[FloatArray, float]] = {}

    def sizes_at(logarithms: FloatArray) -> Sizes:
        gain, ratio, correlation, fast_ratio, *transients = logarithms.tolist()
        fast_s = hyperprior.fast_correlation_s
        return Sizes(gain, tuple(transients), ratio, correlation, fast_ratio, fast_s)

    def evidence_at(logarithms: FloatArray) -> float:
        sizes = sizes_at(logarithms)
        noise = sizes.noise
        if noise not in seen:
            seen[noise] = design.products(noise)
        return log_evidence_of(design, seen[noise], sizes) + hyperprior.log_density(sizes)

    def climbed(best: FloatArray) -> tuple[FloatArray, float]:
        found, share = evidence_at(best), 1.0
        while share > _SMALLEST_STEP:
            moved = False
            for place in range(best.size):
                for move in (share * steps[place], -share * steps[place]):
                    other = best.copy()
                    other[place] = np.clip(best[place] + move, low[place], high[place])
                    there = evidence_at(other)
                    if there > found + 1e-9:
                        best, found, moved = other, there, True
                        break
            if not moved:
                share /= 2.0
        return best, found

    best, found = climbed(start)
    for place in 4 + np.flatnonzero(may_rest):
        high[place] = AT_REST
        resting, there = climbed(np.minimum(best, high))
        if there > found - REST_ODDS:
            best, found = resting, there
        else:
            high[place] = 12.0
    return sizes_at(best)
