"""What a test has reached, by what was really run and measured."""

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.design._conditions import HeatingConditions, ReadingNoise
from thermaxis.thermal.design._foresight import ROW_S, uses_of
from thermaxis.thermal.design._prior import GainsPrior
from thermaxis.thermal.design._responses import noise_covariance
from thermaxis.thermal.log import Experiment
from thermaxis.thermal.modal import segments_of

_TIMES = np.exp(np.linspace(-2.0, 2.0, 9))
"""Sizes that noise, drift and gains may have beside the stated ones. [1]"""
_LOG_STD = 0.4
"""Spread of their logarithms around the stated ones. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class ReachedTest:
    """What is known after a test."""

    uncertainty_um: float
    """Standard deviation of the displacement predicted in use. [µm]"""
    gains: GainsPrior
    """Gains with their covariance: the knowledge from which the next test is planned."""
    noise: ReadingNoise
    """Noise and drift, of the sizes that the record shows."""


def reached(
    conditions: HeatingConditions, prior: GainsPrior, experiment: Experiment
) -> ReachedTest:
    """Return what a record, or the part of it that there is, has reached.

    Parameters
    ----------
    conditions : HeatingConditions
        What was stated when the test was planned.
    prior : GainsPrior
        What was known then.
    experiment : Experiment
        Inputs of the sources in their order, and the displacement.

    Notes
    -----
    y = F g + e with the inputs as measured in F; g has mean m and covariance a^2 L L', e has
    v (K_white + r K_drift). Sizes v, r and a are those of the highest evidence on a grid, each
    log-normal around the stated one. With the eigenvalues l of L' F' K^-1 F L and b the same
    eigenvectors' products with the residual y - F m, the evidence is, but for a constant,

        -2 log p = n log v + log|K| + sum log(1 + a^2 l / v) + (q - sum b^2 / (v / a^2 + l)) / v.

    References
    ----------
    Rasmussen and Williams 2006, section 5.4.
    """
    answers, y, times_s, counts, zeros = _rows(conditions, prior, experiment)
    noise, best = conditions.noise, (np.inf, 1.0, 1.0, 1.0)
    means = np.zeros(prior.factor_um.shape[1])
    left = y - answers @ prior.mean_um
    told: list[tuple[FloatArray, FloatArray]] = []
    for r in _TIMES.tolist():
        covariance = noise_covariance(
            times_s,
            noise.reading_um**2 / counts,
            noise.reading_um**2 / zeros,
            r * noise.drift_um**2,
            3600.0 * noise.drift_h,
        )
        half = np.linalg.cholesky(covariance)
        white = np.linalg.solve(half, np.column_stack([answers @ prior.factor_um, left]))
        columns, residual = white[:, :-1], white[:, -1]
        values, vectors = np.linalg.eigh(columns.T @ columns)
        values, b = np.maximum(values, 0.0), vectors.T @ (columns.T @ residual)
        log_k, q = 2.0 * float(np.sum(np.log(np.diag(half)))), float(residual @ residual)
        told.append((values, vectors))
        for v in _TIMES.tolist():
            for a in _TIMES.tolist():
                ratio = v / a**2
                value = y.size * np.log(v) + log_k + float(np.sum(np.log1p(values / ratio)))
                value += max(q - float(np.sum(b**2 / (ratio + values))), 0.0) / v
                value += float(np.sum((np.log([v, r, a]) / _LOG_STD) ** 2))
                if value < best[0]:
                    best, means = (value, v, r, a), vectors @ (b / (ratio + values))
    _, v, r, a = best
    values, vectors = told[int(np.argmin(np.abs(_TIMES - r)))]
    factor = prior.factor_um @ vectors * np.sqrt(v / (v / a**2 + values))
    after = GainsPrior(prior.time_constants_s, prior.mean_um + prior.factor_um @ means, factor)
    squares = [float(np.trace(use)) for use in uses_of(conditions, after)]
    sized = replace(
        noise, reading_um=noise.reading_um * v**0.5, drift_um=noise.drift_um * (v * r) ** 0.5
    )
    return ReachedTest(float(np.sqrt(np.mean(squares))), after, sized)


def _rows(
    conditions: HeatingConditions, prior: GainsPrior, experiment: Experiment
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, float]:
    """Return answers, displacements, times, readings per row, and readings of the zero."""
    row_s = max(ROW_S, experiment.sample_time_s, experiment.duration_s / 600.0)
    segments = segments_of([experiment], row_s, (0.0,) * experiment.inputs)
    answers, y = list[FloatArray](), list[FloatArray]()
    times_s, counts = list[FloatArray](), list[FloatArray]()
    zeros, zero, zero_um = 1.0, 0.0, 0.0
    for segment in segments:
        each, start = list[FloatArray](), list[FloatArray]()
        for s, source in enumerate(conditions.each):
            lagged = segment.lag_means(s, prior.time_constants_s)
            each.append(np.column_stack([segment.mean_u[:, s], lagged]) / source.temperature_k)
            if segment.zero.size:
                start.append(segment.lag_zero(s, prior.time_constants_s) / source.temperature_k)
        if segment.zero.size:
            zeros, zero, zero_um = float(segment.zero.size), np.concatenate(start), segment.zero_um
        used = segment.count > 0
        answers.append(np.hstack(each)[used])
        y.append(segment.y[used])
        times_s.append((segment.times_s + 0.5 * segment.rows * segment.sample_time_s)[used])
        counts.append(segment.count[used])
    every = np.concatenate(answers) - zero, np.concatenate(y) - zero_um
    return *every, np.concatenate(times_s), np.concatenate(counts), zeros
