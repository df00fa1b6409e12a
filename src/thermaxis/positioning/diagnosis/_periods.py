"""Whether an error repeats along the axis: periods of screws, worm wheels and encoders."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from thermaxis.positioning.diagnosis._levels import LEVEL, Axis, f_tail, smooth_basis
from thermaxis.positioning.run import FloatArray, PositioningTest
from thermaxis.quantities import AxisKind

COMMON_PITCHES_MM = (2.0, 2.5, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0, 20.0, 25.0, 32.0, 40.0)
"""Pitches of screws that are tried where the header states none. [mm]"""
COMMON_PERIODS_DEG = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.5, 8.0, 9.0, 10.0, 12.0, 15.0, 20.0, 30.0)
"""Teeth of worm wheels that are tried where the header states none. [deg]"""
LEAST_AMPLITUDE = 0.5
"""Amplitude of a periodic error that is no finding: the same from valley to peak.
[µm or arcsec]"""
FEWEST_TARGETS_FOR_PERIODS = 7
"""With fewer targets no periodic error is looked for. [1]"""
_MOST_TARGETS = 100
"""More than enough for a period; of more targets so many are taken, evenly. [1]"""
_SMOOTH_LENGTHS = (1.5, 2.2, 3.3, 5.0, 8.0)
"""Lengths over which a smooth error changes, in mean intervals of the targets. [1]"""
_SMOOTH_SIZES = (1.0, 5.0, 25.0, 125.0, 625.0, 3125.0)
"""Its variances, in those of the noise. [1]"""
_PERIOD_LIMITS = (1e-3, 1e4)
"""Stated periods beyond these are no periods: targets are stated to 0.001. [mm or deg]"""
_PERIODS_PER_LENGTH = 3.0
"""A longer period cannot be told from a smooth error. [1]"""
VISIBLE = 0.1
"""Share of its mean square that a periodic error must leave beside a smooth curve, whatever its
phase; below it the targets hide it. [1]"""
AT_MULTIPLES = 0.99
"""Length of the mean phasor from which targets stand at multiples of a period. [1]"""
_AS_LIKELY = 6.0
"""Other periods are named if their criterion is not larger by more than this: a probability of
one in twenty. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Periodic:
    period: float
    amplitude: float
    p_value: float
    others: tuple[float, ...]
    """Periods that fit about as well. [mm or deg]"""


def _stated(header: Mapping[str, str], *keys: str) -> float | None:
    """Return the first positive number that the header states under one of the keys."""
    for key in keys:
        word = header.get(key, "").strip().split(" ")[0].replace(",", ".")
        try:
            value = float(word)
        except ValueError:
            continue
        if np.isfinite(value) and value > 0.0:
            return value
    return None


def stated_periods(test: PositioningTest) -> tuple[float, ...]:
    """Return the periods that the header states: screw or worm wheel, then encoder."""
    header = test.header
    if test.kind is AxisKind.LINEAR:
        drive = _stated(header, "pitch_mm", "screw_pitch_mm", "pitch", "screw_pitch")
        encoder = _stated(header, "encoder_period_mm")
    else:
        drive = _stated(header, "pitch_deg", "pitch")
        lines = _stated(header, "encoder_lines")
        encoder = None if lines is None else 360.0 / lines
    low, high = _PERIOD_LIMITS
    return tuple(p for p in (drive, encoder) if p is not None and low <= p <= high)


def candidate_periods(test: PositioningTest) -> tuple[float, ...]:
    """Return the periods that are tried."""
    stated = stated_periods(test)
    if stated:
        return (*stated, stated[0] / 2.0)
    return COMMON_PITCHES_MM if test.kind is AxisKind.LINEAR else COMMON_PERIODS_DEG


def waves_of(target: FloatArray, period: float) -> FloatArray:
    turn = 2.0 * np.pi * (target - target[0]) / period
    return np.stack((np.cos(turn), np.sin(turn)), axis=1)


def visibility(target: FloatArray, period: float) -> tuple[float, float]:
    """Return what a period leaves beside a straight line, at its worst and best phase. [1]"""
    line = smooth_basis(target, 1)
    waves = waves_of(target, period)
    waves -= line @ (line.T @ waves)
    worst, best = (np.linalg.eigvalsh(waves.T @ waves) / (0.5 * target.size)).tolist()
    return worst, best


def _alias(target: FloatArray, period: float) -> tuple[float, ...]:
    """Return the longer period that looks like a short one at the targets, if there is one."""
    interval = float(np.mean(np.diff(target)))
    folded = abs(1.0 / period - round(interval / period) / interval)
    if period >= 2.0 * interval or folded * (target[-1] - target[0]) < 1e-3:
        return ()
    waves = waves_of(target, period)
    longer = np.column_stack((np.ones_like(target), waves_of(target, 1.0 / folded)))
    rest = waves - longer @ (np.linalg.pinv(longer) @ waves)
    return (float(f"{1.0 / folded:.3g}"),) if np.sum(rest**2) < VISIBLE * target.size else ()


def _seems_smooth(target: FloatArray, period: float) -> bool:
    """Say whether the alias of a period is as long as the waves of a smooth error."""
    return any(longer > 4.0 * np.mean(np.diff(target)) for longer in _alias(target, period))


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Trials:
    """Likelihood of every period beside the smooth curve that suits it best."""

    without: float
    """Minus twice the log-likelihood without a period."""
    criterion: FloatArray
    """The same with each period, (k,)."""
    amplitude: FloatArray
    """(k,). [µm or arcsec]"""


def _smooth_or_rough(target: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield the axes and variances (noise one) of noise alone and with smooth curves."""
    distance = target[:, None] - target[None, :]
    interval = float(np.mean(np.diff(target)))
    yield np.eye(target.size), np.ones(target.size)
    for length in _SMOOTH_LENGTHS:
        value, vector = np.linalg.eigh(np.exp(-0.5 * (distance / (length * interval)) ** 2))
        for size in _SMOOTH_SIZES:
            yield (
                np.asarray(vector, dtype=np.float64),
                np.asarray(1.0 + size * np.maximum(value, 0.0), dtype=np.float64),
            )


def _try_periods(axis: Axis, waves: FloatArray, floor: float) -> _Trials:
    """Fit each period, (k, m, 2), beside a straight line and smooth random curves."""
    m, k = axis.target.size, waves.shape[0]
    line = smooth_basis(axis.target, 1)
    everything = np.column_stack((line, axis.mean, waves.transpose(1, 0, 2).reshape(m, 2 * k)))
    without, criterion = np.inf, np.full(k, np.inf)
    amplitude = np.zeros(k)
    for vector, variance in _smooth_or_rough(axis.target):
        volume = float(np.sum(np.log(variance)))
        white = (vector.T @ everything) / np.sqrt(variance)[:, None]
        own, _ = np.linalg.qr(white[:, :2])
        rest = white[:, 2:] - own @ (own.T @ white[:, 2:])
        value, columns = rest[:, 0], rest[:, 1:].reshape(m, k, 2)
        gram = np.asarray(np.einsum("mki,mkj->kij", columns, columns), dtype=np.float64)
        right = np.asarray(np.einsum("mki,m->ki", columns, value), dtype=np.float64)
        inverse = np.linalg.pinv(gram, rcond=VISIBLE**2, hermitian=True)
        solved = (inverse @ right[..., None])[..., 0]  # without a phase that the targets hide
        square = float(value @ value)
        left = np.maximum(square - np.sum(solved * right, axis=1), 0.0)
        without = min(without, float(_deviance(np.array(square), m, floor)) + volume)
        now = _deviance(left, m, floor) + volume
        better = now < criterion
        criterion = np.where(better, now, criterion)
        amplitude = np.where(better, np.hypot(solved[:, 0], solved[:, 1]), amplitude)
    return _Trials(without, criterion, amplitude)


def _deviance(square: FloatArray, m: int, floor: float) -> FloatArray:
    """Return minus twice the log-likelihood; the noise is at least what the levels' is."""
    variance = np.maximum(square / m, floor)
    return m * np.log(variance) + square / variance


def strongest_period(axis: Axis) -> Periodic | None:
    """Look for the period that explains most of what no smooth curve explains.

    For each candidate a sine with free phase is fitted together with a straight line and a
    smooth random curve of the position, whose size and length are those of the largest
    likelihood: the periodogram of Lomb and Scargle with a floating smooth part in place of the
    mean. Without the sine the curve is chosen anew.
    """
    if axis.target.size > _MOST_TARGETS:
        kept = np.linspace(0, axis.target.size - 1, _MOST_TARGETS).astype(np.intp)
        axis = replace(
            axis,
            target=axis.target[kept],
            mean=axis.mean[kept],
            mean_covariance=axis.mean_covariance[np.ix_(kept, kept)],
        )
    target, m, stated = axis.target, axis.target.size, stated_periods(axis.test)
    periods = [
        p
        for p in candidate_periods(axis.test)
        if p * _PERIODS_PER_LENGTH <= axis.length
        and visibility(target, p)[1] > VISIBLE**2
        and (p in stated or not _seems_smooth(target, p))
    ]
    if m < FEWEST_TARGETS_FOR_PERIODS or not periods:
        return None
    line = smooth_basis(target, 1)
    noise = np.trace(axis.mean_covariance) - np.trace(line.T @ axis.mean_covariance @ line)
    waves = np.stack([waves_of(target, period) for period in periods])
    tried = _try_periods(axis, waves, max(float(noise) / (m - 2), 1e-12))
    first = int(np.argmin(tried.criterion))
    gained = max(tried.without - float(tried.criterion[first]), 0.0)
    ratio = float(np.expm1(gained / m)) * (m - 4) / 2.0
    p_value = min(1.0, len(periods) * f_tail(ratio, 2, m - 4))
    amplitude = float(tried.amplitude[first])
    if p_value >= LEVEL or amplitude < LEAST_AMPLITUDE:
        return None
    likely = tried.criterion < tried.criterion[first] + _AS_LIKELY
    others = tuple(p for i, p in enumerate(periods) if likely[i] and i != first)
    if periods[first] not in stated:
        others += tuple(p for p in _alias(target, periods[first]) if p not in others)
    return Periodic(periods[first], amplitude, p_value, others)
