"""Gains over a grid of time constants, how large they and the slow noise are by the evidence.

Every input acts through a direct gain and one lag per time constant of a grid, far more than a
record can tell apart. What keeps them in bounds is a prior: gains are normal around zero with one
common size. The size, the size of transients from an unknown start, and the slow noise are those
under which the record is most likely after all gains are averaged out (type II likelihood).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import final

import numpy as np
from scipy.linalg.lapack import (
    dtrtrs,  # pyright: ignore[reportAttributeAccessIssue, reportUnknownVariableType] - no types
)

from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.modal._regressors import Segment
from thermaxis.thermal.modal._slow_noise import (
    WALK_PARTS,
    Products,
    SlowNoise,
    Weighing,
    drift_basis,
    with_drift,
)

OFF = -np.inf
"""Logarithm of the size of what there is not. [1]"""
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
    places, raised = np.arange(int(precision.shape[-1])), precision
    for share in ROUND_OFF[1:]:
        try:
            return np.asarray(np.linalg.cholesky(raised), dtype=np.float64)
        except np.linalg.LinAlgError:
            raised = precision.copy()
            raised[..., places, places] *= 1.0 + share
    return np.asarray(np.linalg.cholesky(raised), dtype=np.float64)


MOST_LOG_GAIN = 14.0
"""The largest logarithm of a gain's size that is tried: gains that have it explain all. [1]"""


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
    log_trend: float = OFF
    """Logarithm of the ratio of the straight line. [1]"""
    log_walk: float = OFF
    """Logarithm of the ratio of the random walk. [1]"""
    log_ambient: float = OFF
    """Logarithm of the ratio of what follows the ambient. [1]"""
    log_reference: float = OFF
    """Logarithm of the ratio of what the noise of the ambient's sensor does. [1]"""

    @property
    def lasting(self) -> tuple[float, ...]:
        """Logarithms of the ratios of line, walk, ambient and its sensor. [1]"""
        return self.log_trend, self.log_walk, self.log_ambient, self.log_reference

    @property
    def noise(self) -> SlowNoise:
        """The correlated noise of these sizes."""
        return SlowNoise(
            float(np.exp(self.log_ratio)),
            float(np.exp(self.log_correlation)),
            float(np.exp(self.log_fast_ratio)),
            self.fast_correlation_s,
            *np.exp(self.lasting).tolist(),
        )

    @property
    def offset_ratio(self) -> float:
        """Ratio of what is left of an offset where rows are relative to the record's zero. [1]"""
        return float(np.exp(self.log_ratio) + np.exp(self.log_fast_ratio))

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

    basis: tuple[FloatArray, ...] = ()
    """What a drift may follow (`drift_basis`), one array (n, d) per segment; none by default."""

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

    def weighing(self) -> list[Weighing]:
        """Return what weighs all columns and those of the basis, under the correlated noise."""
        rows = list(self.rows)
        if self.basis:
            rows = [np.hstack(pair) for pair in zip(self.rows, self.basis, strict=True)]
        each = zip(rows, self.white_variance, self.times_s, strict=True)
        return [Weighing(columns, white, times_s) for columns, white, times_s in each]

    def joint(self, noise: SlowNoise, weighing: Sequence[Weighing] | None = None) -> list[Products]:
        """Return the products of all columns and of the basis, under the correlated noise alone."""
        return [one.products(noise) for one in weighing or self.weighing()]

    def products(
        self, noise: SlowNoise, joint: Sequence[Products] | None = None
    ) -> tuple[FloatArray, float]:
        """Return the products of all columns under the noise, and its log determinant."""
        found = joint or self.joint(noise)
        if self.basis:
            columns = self.rows[0].shape[1]
            found = [with_drift(one, columns, noise) for one in found]
        gram = np.sum([one.gram for one in found], axis=0)
        return gram, sum(one.log_determinant for one in found)


@final
@dataclass(frozen=True, slots=True)
class Scales:
    """Spreads that make inputs and displacement free of units."""

    u: FloatArray
    """Spread of every input, (k,). [K]"""
    y: float
    """Spread of the displacement. [µm]"""
    ambient: float = 1.0
    """Spread of the ambient; one if it is not known. [K]"""


def scales_of(segments: Sequence[Segment]) -> Scales:
    """Return the spreads of the inputs and of the displacement over all segments."""
    u = np.concatenate([s.mean_u[s.count > 0] for s in segments])
    y = np.concatenate([s.y[s.count > 0] for s in segments])
    spread_u = np.sqrt(np.mean(np.square(u), axis=0))
    spread_u = np.where(spread_u > 0, spread_u, 1.0)
    spread_y = float(np.std(y))
    around = np.concatenate([s.ambient.ravel() for s in segments])
    ambient = float(np.std(around)) if around.size else 0.0
    return Scales(spread_u, spread_y if spread_y > 0 else 1.0, ambient if ambient > 0 else 1.0)


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
    basis: list[FloatArray] = []
    span_s = max(float(s.times_s[-1]) + s.rows * s.sample_time_s for s in segments)
    known = all(s.ambient.size for s in segments)
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
        ambient = segment.ambient[:, : segment.ambient.shape[1] * known] / scales.ambient
        basis.append(drift_basis(segment.times_s, span_s, ambient)[use])
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
        basis=tuple(basis),
    )


@final
@dataclass(frozen=True, slots=True)
class Hyperprior:
    """What sizes are plausible before the record is seen: wide normals of their logarithms."""

    correlation_s: float
    """Most plausible correlation time of the slow noise. [s]"""
    fast_correlation_s: float
    """Correlation time of the faster part of the noise. [s]"""
    largest_line: float = np.inf
    """What a drifting probe can reach by the end of the longest segment, scaled. [1]"""

    def log_density(self, sizes: Sizes) -> float:
        """Return the logarithm of the density up to a constant. [1]"""
        return -0.5 * (
            ((sizes.log_correlation - np.log(self.correlation_s)) / 0.8) ** 2
            + ((sizes.log_ratio - 5.0) / 4.0) ** 2
            + ((sizes.log_gain - 3.0) / 4.0) ** 2
            + ((sizes.log_fast_ratio - 1.0) / 3.0) ** 2
            + sum(((one + 3.0 - sizes.log_ratio) / 6.0) ** 2 for one in sizes.lasting if one > OFF)
            + sum((one / 4.0) ** 2 for one in sizes.log_transients if one > AT_REST)
        )


def log_prior_variance(design: Design, sizes: Sizes, lags: int) -> FloatArray:
    """Return the logarithms of the prior variances of gains, transients, offsets, (q,). [1]

    Rows are relative to the record's zero, where the model says zero too. What is left of an offset
    are the slow noise and the white noise at the zero, so these are its size.
    """
    noise = sizes.offset_ratio + design.zero_variance
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
    half = np.asarray(dtrtrs(factor, gram[:-1, -1], lower=1)[0], dtype=np.float64)
    left = max(float(gram[-1, -1] - half @ half), 1e-14 * abs(float(gram[-1, -1])) + 1e-300)
    return -0.5 * float(
        design.readings * np.log(left / design.readings)
        + log_determinant
        + 2.0 * float(np.sum(np.log(np.diag(factor))))
        + float(np.sum(prior))
    )


MOST_LOG_CHANGE = 2.4
"""Logarithm by which the correlation time may differ from the most plausible one. [1]"""
MOST_LOG_CHANGE_GAINS = 0.6
"""By how much it may be longer where gains are fitted: what lasts longer than three hours is left
for the inputs to explain, or a model that lacks fast lags is taken for a drift. [1]"""
_SMALLEST_STEP = 0.15
_LINE_STEP = 0.5


LINE, WALK = 12.0, 3.0
"""Logarithms of the sizes from which line and walk are searched: a line is found from above. [1]"""
AMBIENT = 3.0
"""The same of what follows the ambient, and of what its sensor does. [1]"""
POSSIBLE_ODDS = 2.0
"""Logarithm of how much less likely a larger line may make a record for intervals to allow for it:
a slow lag explains most of what a drifting probe does. Default: profile likelihood, 95 %. [1]"""
DRIFT_ODDS = 3.0
"""Logarithm of how much more likely a line makes a record that has one, and of how much more a walk
beside it may. [1]"""


def _climbed(
    evidence_at: Callable[[FloatArray], float],
    best: FloatArray,
    steps: FloatArray,
    bounds: tuple[FloatArray, FloatArray],
) -> tuple[FloatArray, float]:
    """Return the highest place that steps along one logarithm at a time reach, and its height."""
    found, share = evidence_at(best), 1.0
    while share > _SMALLEST_STEP:
        moved = False
        for place in np.flatnonzero(best > OFF):
            for move in (share * steps[place], -share * steps[place]):
                other = best.copy()
                other[place] = np.clip(best[place] + move, bounds[0][place], bounds[1][place])
                there = evidence_at(other)
                if there > found + 1e-9:
                    best, found, moved = other, there, True
                    break
        if not moved:
            share /= 2.0
    return best, found


def _largest_line(
    evidence_at: Callable[[FloatArray], float], best: FloatArray, least: float, highest: float
) -> FloatArray:
    """Return the place with the largest line under which the evidence is not below the least."""
    raised = best.copy()
    while raised[4] <= highest and evidence_at(raised) >= least:
        best = raised.copy()
        raised[4] += _LINE_STEP
    return best


def _line_left(design: Design, products: tuple[FloatArray, float], sizes: Sizes) -> float:
    """Return the largest line in what the gains leave of a segment, at its end, scaled. [1]"""
    gram, _ = products
    prior = np.exp(-log_prior_variance(design, sizes, design.lags))
    means = np.linalg.solve(gram[:-1, :-1] + np.diag(prior), gram[:-1, -1])
    found = 0.0
    for rows, basis in zip(design.rows, design.basis, strict=True):
        line, left = basis[:, 0], rows[:, -1] - rows[:, :-1] @ means
        if size := float(line @ line):  # a segment of its start alone has no line
            found = max(found, abs(float(line @ left)) / size)
    return found


def most_likely_sizes(
    design: Design,
    hyperprior: Hyperprior,
    may_rest: Sequence[bool] = (),
    *,
    wide: bool = True,
) -> tuple[Sizes, Sizes | None]:
    """Return the sizes under which the record is most likely: a search along every size in turn.

    A segment that may begin at rest does so unless a free start is `REST_ODDS` more likely. The
    first sizes are those of the gains, with a line where the record shows a probe that drifts and
    without the rest that lasts. Where a walk is likelier than the line, what is slow is not a
    probe's but what the inputs do not explain, and a line would take from them what they do; so it
    is where the line is steeper than a probe drifts, or the record too short to tell. What
    follows the ambient in one log does so in the next, and a model of it errs less. The second,
    where `wide`, are those of intervals: with all that a drift may be, and the largest line that
    the evidence allows.
    """
    middle, free = float(np.log(hyperprior.correlation_s)), design.transients
    # gain, ratio, correlation time, fast ratio, then what lasts, then the transients: logarithms
    start = np.array([4.0, 5.0, middle, 1.0, *[OFF] * 4, *[0.0] * free])
    steps = np.array([1.5, 1.5, 0.7, 1.5, *[2.0] * 4, *[2.0] * free])
    low = np.array([-6.0, -8.0, middle - MOST_LOG_CHANGE, -8.0, *[-8.0] * 4, *[AT_REST] * free])
    high = np.array(
        [MOST_LOG_GAIN, 14.0, middle + MOST_LOG_CHANGE, 12.0, *[20.0] * 4, *[12.0] * free]
    )
    joint = cache(partial(design.joint, weighing=design.weighing()))

    @cache
    def products(noise: SlowNoise) -> tuple[FloatArray, float]:
        return design.products(noise, joint(noise.stationary))

    def sizes_at(logarithms: FloatArray) -> Sizes:
        gain, ratio, correlation, fast_ratio, *others = logarithms.tolist()
        fast_s, transients = hyperprior.fast_correlation_s, tuple(others[4:])
        return Sizes(gain, transients, ratio, correlation, fast_ratio, fast_s, *others[:4])

    @cache
    def evidence_of(sizes: Sizes) -> float:
        found = products(sizes.noise)
        return log_evidence_of(design, found, sizes) + hyperprior.log_density(sizes)

    def evidence_at(logarithms: FloatArray) -> float:
        return evidence_of(sizes_at(logarithms))

    climbed = partial(_climbed, evidence_at, steps=steps, bounds=(low, high))
    best, found = climbed(start)
    for place in 8 + np.flatnonzero(may_rest):
        high[place] = AT_REST
        resting, there = climbed(np.minimum(best, high))
        if there > found - REST_ODDS:
            best, found = resting, there
        else:
            high[place] = 12.0
    if not design.basis:
        return sizes_at(best), sizes_at(best) if wide else None
    high[2] = middle + MOST_LOG_CHANGE_GAINS
    best, found = climbed(np.minimum(best, high))

    def lasting(*logarithms: float) -> tuple[FloatArray, float]:
        return climbed(np.concatenate([best[:4], logarithms, best[8:]]))

    lined, there = lasting(LINE, OFF, OFF, OFF)
    high[2] = middle + MOST_LOG_CHANGE
    if there > found + DRIFT_ODDS and lasting(LINE, WALK, OFF, OFF)[1] < there + DRIFT_ODDS:
        sizes = sizes_at(lined)
        if _line_left(design, products(sizes.noise), sizes) <= hyperprior.largest_line:
            best = lined
    if not wide:
        return sizes_at(best), None
    around = AMBIENT if design.basis[0].shape[1] > 1 + WALK_PARTS else OFF
    whole, there = lasting(LINE, WALK, around, around)
    whole = _largest_line(evidence_at, whole, there - POSSIBLE_ODDS, high[4])
    return sizes_at(best), sizes_at(whole)
