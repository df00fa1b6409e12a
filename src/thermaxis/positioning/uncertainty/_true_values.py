"""Where the true levels and standard deviations of a run may lie, given their estimates.

Estimates scatter more than the truth, as their noise is added to it. How much the truth scatters
from target to target is told by the run: what the noise does not explain. Both amounts are
averaged over, so that the draws hold what the run does not tell about them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from thermaxis.positioning.drift import special
from thermaxis.positioning.run import FloatArray
from thermaxis.positioning.uncertainty._rounding import Rounding

_POINTS = 10
"""Values of the scatter of the levels that are averaged over. [1]"""
_MANY_LEVELS = 600
"""From here on only one value: each takes a matrix of the size of all levels. [1]"""
_HIDDEN = 0.05
"""Scatter of true levels, in units of their noise, that the noise hides altogether. [1]"""
_NONE_AT_ALL = 6.0
"""How likely no scatter at all is, against any scatter, before the run is looked at: with less, the
largest of equal values is covered too seldom. [1]"""
_LENGTHS = (0.1, 0.18, 0.32)
"""Lengths over which smooth errors are alike, as shares of the axis: a sixth of a wave. [1]"""
_AMOUNTS = 12
"""Amounts of smooth errors of each length that are averaged over. [1]"""
_OUTSTANDING = 0.01
"""Level, for the whole axis, at which a target is not like the others. [1]"""
_MOST_OUTSTANDING = 8
"""More targets than this are no exception. [1]"""
_FEWEST_SPARE = 3
"""Targets beyond the straight line that are needed to see how levels scatter. [1]"""
_PRIOR_FREEDOM = np.array([3.0, 6.0, 12.0, 25.0, 50.0, 100.0, 1e5])
"""Degrees of freedom with which true variances scatter; the last: all are alike. [1]"""
_PRIOR_WEIGHT = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 24.0]) / 30.0
"""What is thought of them before the run is looked at: four to one that all are alike. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """Levels and standard deviations of one run, as far as measured."""

    position: FloatArray
    """(m,). [mm or deg]"""
    approaches: tuple[int, ...]
    """Measured approaches: 0 forward, 1 backward."""
    level: FloatArray
    """(L,), in one thermal state: targets of the first measured approach, then of the second."""
    noise_covariance: FloatArray
    """Covariance of the levels by the scatter of their readings and their rounding, (L, L)."""
    reading_variance: FloatArray
    """Variance of the readings of each level by noise and environment, (L,)."""
    share: Mapping[str, float]
    """What `environmental_variation`, beyond the scatter that was seen, and `resolution` are of its
    trace. [1]"""
    rounding: Rounding | None
    """That of the readings, where it is seen."""
    drift_covariance: FloatArray
    """Covariance of the levels by what is not known of the drift, (L, L)."""
    drift: FloatArray
    """Mean drift of the readings of each level, which is in their plain means, (L,)."""
    spread: FloatArray
    """Variance (n - 1) of the drift of the readings of each level, (L,)."""
    s: FloatArray
    """Of the readings as they are rounded, (L,); NaN where nothing tells the noise."""
    free: FloatArray
    """Degrees of freedom of each s, (L,). [1]"""
    readings: FloatArray
    """Readings of each level, (L,). [1]"""

    @property
    def noise_variance(self) -> FloatArray:
        """Variance of each level by the scatter of its readings, (L,)."""
        return np.diag(self.noise_covariance)


def root_of(matrix: FloatArray) -> FloatArray:
    """Return the symmetric root of a covariance: unlike others it hangs on no choice of vectors."""
    variance = np.diag(matrix)
    if np.array_equal(matrix, np.diag(variance)):
        return np.diag(np.sqrt(np.maximum(variance, 0.0)))
    value, vector = np.linalg.eigh(matrix)
    return (vector * np.sqrt(np.maximum(value, 0.0))) @ vector.T


def _normal_limit(number: int) -> float:
    """Return the distance that one of so many normal values passes with a chance of 1 %."""
    return -float(special().ndtri(0.5 * _OUTSTANDING / number))


def _mean_and_reversal(targets: int, approaches: int) -> tuple[FloatArray, FloatArray]:
    """Return the matrix that turns levels into mean and reversal of every target, and back."""
    one = np.eye(targets)
    if approaches == 1:
        return one, one
    there = np.block([[0.5 * one, 0.5 * one], [one, -one]])
    return there, np.block([[one, 0.5 * one], [one, -0.5 * one]])


def _straight_lines(position: FloatArray) -> FloatArray:
    centred = position - np.mean(position)
    return np.stack((np.ones_like(position), centred / np.std(position)), axis=1)


def _smooth_errors(position: FloatArray) -> FloatArray:
    """Return covariances of errors that are smooth along the axis, of unit variance, (K, m, m)."""
    distance = (position[:, None] - position) / max(float(np.ptp(position)), 1e-300)
    return np.stack([np.exp(-0.5 * (distance / length) ** 2) for length in _LENGTHS])


def covariances_of_truth(
    value: FloatArray, covariance: FloatArray, line: FloatArray, position: FloatArray, points: int
) -> FloatArray:
    """Return equally likely covariances of true values about fixed columns, (points, m, m).

    They are of errors that are independent from target to target, and of errors that are smooth
    along the axis. Before the run is looked at, none of a kind is `_NONE_AT_ALL` times as likely as
    any, and of those that the noise does not hide every order of magnitude is equally likely.
    """
    whole, _ = np.linalg.qr(line, mode="complete")
    rest = whole[:, line.shape[1] :]
    seen, noise = rest.T @ value, rest.T @ covariance @ rest
    hidden = float(np.sqrt(max(np.trace(noise) / seen.size, 0.0)))
    largest = 10.0 * (float(np.sqrt(np.mean(seen**2))) + hidden)
    one = np.eye(value.size)
    if hidden <= 1e-9 * largest:
        return np.broadcast_to((0.1 * largest) ** 2 * one, (points, *one.shape))
    smooth = np.zeros((1, *one.shape))
    for variance in np.geomspace(_HIDDEN * hidden, largest, _AMOUNTS) ** 2:
        smooth = np.concatenate((smooth, variance * _smooth_errors(position)))
    own = np.concatenate(([0.0], np.geomspace(_HIDDEN * hidden, largest, 10 * _AMOUNTS))) ** 2
    log_weight = np.empty((len(smooth), own.size))
    for k, alike in enumerate(smooth):
        other, vector = np.linalg.eigh(noise + rest.T @ alike @ rest)
        total = np.maximum(other, 0.0) + own[:, None]
        log_weight[k] = -0.5 * np.sum(np.log(total) + (vector.T @ seen) ** 2 / total, axis=1)
    weight = np.exp(log_weight - np.max(log_weight))
    weight[0] *= _NONE_AT_ALL * (len(smooth) - 1.0)
    weight[:, 0] *= _NONE_AT_ALL * (own.size - 1.0)
    cumulative = np.cumsum(weight)
    wanted = (np.arange(points) + 0.5) / points * cumulative[-1]
    chosen = np.asarray(np.searchsorted(cumulative, wanted), dtype=np.intp)
    return smooth[chosen // own.size] + own[chosen % own.size][:, None, None] * one


def standing_out(
    value: FloatArray, covariance: FloatArray, line: FloatArray, position: FloatArray
) -> tuple[int, ...]:
    """Return the targets that lie so far from the others that they are taken as they are, from 0.

    Each is held against the scatter of the rest; were it drawn towards them, a single fault of the
    axis would be smoothed away.
    """
    limit = _normal_limit(value.size)
    out: list[int] = []
    most = min(value.size // 4, _MOST_OUTSTANDING)
    while len(out) < most and value.size - len(out) > 3 + line.shape[1]:
        rest = np.setdiff1d(np.arange(value.size), out)
        residual = (
            value[rest] - line[rest] @ np.linalg.lstsq(line[rest], value[rest], rcond=None)[0]
        )
        worst = int(rest[np.argmax(np.abs(residual))])
        rest = rest[rest != worst]
        alike = covariance[np.ix_(rest, rest)]
        truth = covariances_of_truth(value[rest], alike, line[rest], position[rest], 1)[0]
        coefficient, *_ = np.linalg.lstsq(line[rest], value[rest], rcond=None)
        expected = float(covariance[worst, worst] + truth[0, 0])
        distance = abs(float(value[worst] - line[worst] @ coefficient))
        if distance <= limit * np.sqrt(expected):
            break
        out.append(worst)
    return tuple(out)


def split_by_source(
    noise: FloatArray, drift: FloatArray, truth: FloatArray, line: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the matrices that turn estimates into most likely true values and drift, (L, L) each.

    Estimates are true values plus errors of covariance `noise` and `drift`; true values scatter
    about the columns of `line` by the covariance `truth`.

    Notes
    -----
    With V = N + D + T, T the covariance of the truth, and the generalised least squares P = X (X'
    V^-1 X)^-1 X' V^-1: the values are P + T V^-1 (1 - P), the error by drift D V^-1 (1 - P).
    """
    total = noise + drift + truth
    total[np.diag_indices_from(total)] += 1e-12 * np.trace(total) / total.shape[0]
    inverse = np.linalg.inv(total)
    fitted = line @ np.linalg.solve(line.T @ inverse @ line, line.T @ inverse)
    rest = inverse @ (np.eye(fitted.shape[0]) - fitted)
    return fitted + truth @ rest, drift @ rest


def draw_levels(
    estimate: Estimate, samples: int, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Return where the true levels may lie, and the error of the drift that was taken from them.

    Their sum is where the levels of the run as it was may lie, but for the drift itself. Truth and
    errors are drawn alike; what the estimates say beyond the draw is shared out among them.
    """
    size, targets = estimate.level.size, estimate.position.size
    free = float(np.sum(estimate.free))
    wider = np.sqrt(free / rng.chisquare(free, (samples, 1)))  # the noise is estimated too
    noise = wider * (rng.standard_normal((samples, size)) @ root_of(estimate.noise_covariance).T)
    drift = wider * (rng.standard_normal((samples, size)) @ root_of(estimate.drift_covariance).T)
    if targets < 2 + _FEWEST_SPARE or not (
        np.any(estimate.noise_covariance) or np.any(estimate.drift_covariance)
    ):
        return estimate.level - noise - drift, drift
    turn, back = _mean_and_reversal(targets, len(estimate.approaches))
    value = turn @ estimate.level
    of_noise = turn @ estimate.noise_covariance @ turn.T
    of_drift = turn @ estimate.drift_covariance @ turn.T
    noise, drift = noise @ turn.T, drift @ turn.T
    straight = _straight_lines(estimate.position)
    blocks = np.split(np.arange(size), len(estimate.approaches))
    points = _POINTS if size < _MANY_LEVELS else 1
    columns: list[FloatArray] = []
    truth = np.zeros((points, size, size))
    for k, own in enumerate(blocks):
        line = straight if k == 0 else straight[:, :1]  # lost motion is the same at all targets
        covariance = (of_noise + of_drift)[np.ix_(own, own)]
        out = standing_out(value[own], covariance, line, estimate.position)
        fixed = np.column_stack((line, np.eye(targets)[:, list(out)]))
        likely = covariances_of_truth(value[own], covariance, fixed, estimate.position, points)
        truth[:, own[:, None], own] = rng.permutation(likely)
        column = np.zeros((size, fixed.shape[1]))
        column[own] = fixed
        columns.append(column)
    lines = np.column_stack(columns)
    drawn = np.empty((samples, size))
    for k, part in enumerate(np.array_split(np.arange(samples), points)):
        own = rng.standard_normal((part.size, size)) @ root_of(truth[k]).T
        beyond = value - own - noise[part] - drift[part]
        to_value, to_drift = split_by_source(of_noise, of_drift, truth[k], lines)
        drawn[part] = own + beyond @ to_value.T
        drift[part] += beyond @ to_drift.T
    return drawn @ back.T, drift @ back.T


def _moments_of_logarithm(freedom: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return mean and variance of the logarithm of chi squared over its degrees of freedom."""
    functions, half = special(), 0.5 * freedom
    mean = np.asarray(functions.digamma(half), dtype=np.float64) - np.log(half)
    return mean, np.asarray(functions.polygamma(1, half), dtype=np.float64)


def log_likelihood(
    variance: FloatArray, free: FloatArray, prior: float, centre: FloatArray
) -> FloatArray:
    """Return the logarithm of the likelihood of common variances `centre`, (G,).

    An estimated variance over the common one follows the F distribution.
    """
    gammaln = special().gammaln
    ratio = variance / centre[:, None]
    return np.sum(
        gammaln(0.5 * (free + prior))
        - gammaln(0.5 * prior)
        + 0.5 * free * np.log(free * ratio / prior)
        - 0.5 * (free + prior) * np.log1p(free * ratio / prior),
        axis=1,
    )


def _scatters_alone(variance: FloatArray, free: FloatArray) -> NDArray[np.bool_]:
    """Return which levels scatter more than the others, at the 1 % level of the run, (L,).

    The F test of the largest variance against the mean of the others, again without it. With two
    degrees of freedom or less a variance of its own would have no mean square.
    """
    alone = np.zeros(variance.size, dtype=bool)
    if np.min(free) <= 2.0:
        return alone
    while np.sum(~alone) > _FEWEST_SPARE:
        largest = int(np.argmax(np.where(alone, -np.inf, variance)))
        others = ~alone
        others[largest] = False
        rest = float(np.sum(free[others]))
        ratio = variance[largest] * rest / float(np.sum((free * variance)[others]))
        if float(special().fdtrc(free[largest], rest, ratio)) * variance.size > _OUTSTANDING:
            break
        alone[largest] = True
    return alone


def _draw_variances(
    variance: FloatArray,
    free: FloatArray,
    groups: Sequence[NDArray[np.intp]],
    samples: int,
    rng: np.random.Generator,
) -> FloatArray:
    """Return where the true variances of groups of levels may lie, (S, L)."""
    steps = np.linspace(-4.5, 4.5, 46)
    grids = np.empty((_PRIOR_FREEDOM.size, len(groups), steps.size))
    weights = np.empty_like(grids)
    widths = np.empty(grids.shape[:2])
    for k, prior in enumerate(_PRIOR_FREEDOM.tolist()):
        for g, own in enumerate(groups):
            # the mean of the logarithms, weighted by what each tells, and its standard error
            expected, told = _moments_of_logarithm(free[own])
            expected_prior, told_prior = _moments_of_logarithm(np.array(prior))
            told = 1.0 / (told + told_prior)
            middle = np.sum(told * (np.log(variance[own]) - expected + expected_prior))
            middle /= np.sum(told)
            widths[k, g] = 1.0 / np.sqrt(np.sum(told))
            grids[k, g] = middle + widths[k, g] * steps
            likelihood = log_likelihood(variance[own], free[own], prior, np.exp(grids[k, g]))
            weights[k, g] = likelihood + np.log(widths[k, g])
    largest = np.max(weights, axis=(0, 2), keepdims=True)
    weights = np.exp(weights - largest)
    of_prior = _PRIOR_WEIGHT * np.prod(np.sum(weights, axis=2), axis=1)
    chosen = rng.choice(_PRIOR_FREEDOM.size, samples, p=of_prior / np.sum(of_prior))
    prior_free = _PRIOR_FREEDOM[chosen][:, None]
    drawn = np.empty((samples, variance.size))
    for g, own in enumerate(groups):
        cumulative = np.cumsum(weights[:, g], axis=1)
        level = rng.random(samples) * cumulative[chosen, -1]
        place = np.sum(cumulative[chosen] < level[:, None], axis=1)
        within = (rng.random(samples) - 0.5) * (steps[1] - steps[0]) * widths[chosen, g]
        centre = np.exp(grids[chosen, g, place] + within)[:, None]
        total = prior_free * centre + free[own] * variance[own]
        drawn[:, own] = total / rng.chisquare(prior_free + free[own])
    return drawn


def draw_std(
    estimate: Estimate, samples: int, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Return where the standard deviations may lie, of the noise and of the rounded readings."""
    variance = estimate.s**2
    mean = float(np.mean(variance))
    if mean == 0.0 or np.isnan(mean):  # no scatter at all, or one reading that tells nothing of it
        same = np.full((samples, variance.size), mean)
        return same, same
    floored = np.maximum(variance, 1e-3 * mean)  # equal readings are rounded ones
    alone = _scatters_alone(floored, estimate.free)
    groups = np.split(np.arange(alone.size), len(estimate.approaches))
    alike = [own[~alone[own]] for own in groups if not np.all(alone[own])]
    drawn = _draw_variances(floored, estimate.free, alike, samples, rng)
    if np.any(alone):  # the others tell nothing of these
        free = estimate.free[alone]
        drawn[:, alone] = free * floored[alone] / rng.chisquare(free, (samples, free.size))
    rounded = 0.0 if estimate.rounding is None else estimate.rounding.in_scatter(drawn)
    return np.sqrt(drawn - rounded), np.sqrt(drawn)


def draw_spread(estimate: Estimate, samples: int, rng: np.random.Generator) -> FloatArray:
    """Return where the variances (n - 1) of the true drift of the readings may lie, (S, L).

    Notes
    -----
    The readings tell the size of the drift, common and in proportion to the position, as they tell
    the coefficients of a straight line: the standard deviation S_i of the drift is uncertain by
    sigma / sqrt(n - 1) times the root of 1 / L + x_i^2 / sum x^2. Half of this variance is added
    for the form of the curves, so that generated runs are covered. Where the noise is correlated
    from level to level, each root is that of the sum of correlations with these weights.
    """
    x = np.tile(estimate.position - np.mean(estimate.position), len(estimate.approaches))
    shapes = np.stack((np.full(x.size, x.size**-0.5), x / np.sqrt(max(np.sum(x**2), 1e-300))))
    free = np.maximum(estimate.readings - 1.0, 1.0)
    size = np.sqrt(1.5 * estimate.reading_variance / free)
    own = np.sqrt(np.maximum(estimate.noise_variance, 1e-300))
    alike = np.sum(shapes @ (estimate.noise_covariance / np.outer(own, own)) * shapes, axis=1)
    error = (rng.standard_normal((samples, 2)) * np.sqrt(alike)) @ shapes * size
    return np.where(estimate.spread > 0.0, (np.sqrt(estimate.spread) + error) ** 2, 0.0)


def expected_s(std: FloatArray, spread: FloatArray, readings: FloatArray) -> FloatArray:
    """Return the expectation of s over the noise, of readings with this variance of the drift.

    Notes
    -----
    E[s^2] = sigma^2 + S^2 and E[s]^2 = E[s^2] - Var[s]. Without drift E[s] = c4 sigma, so that
    Var[s] = (1 - c4^2) sigma^2; with a drift much larger than the noise Var[s] = sigma^2 / (n - 1).
    In between the share of sigma^2 in E[s^2] leads from one to the other, as in Var[s^2] / (4
    E[s^2]) = sigma^2 (2 - share) / (2 (n - 1)).
    """
    free = np.maximum(readings - 1.0, 1.0)
    gammaln = special().gammaln
    c4 = np.sqrt(2.0 / free) * np.exp(gammaln(0.5 * (free + 1.0)) - gammaln(0.5 * free))
    total = std**2 + spread
    share = np.divide(std**2, total, out=np.ones_like(total), where=total > 0.0)
    return np.sqrt(total - std**2 * (share * (1.0 - c4**2) + (1.0 - share) / free))
