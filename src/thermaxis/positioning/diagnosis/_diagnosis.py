"""Name what is wrong with an axis, in plain sentences with the number behind each.

Every finding has passed two gates: a statistical test, so that noise does not become a fault, and
a practical threshold, so that a fault that nobody would repair is not named. Faults of the axis
come first, ordered by what they add to the accuracy A of the axis without drift; then what
concerns its thermal state; last what the choice of the targets hides.

The tests share a probability of 5 % of naming anything on a healthy axis: 2 % for the spread and
0.5 % for each of the others.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.positioning._positioning_test import (
    BACKWARD,
    FORWARD,
    FloatArray,
    PositioningTest,
)
from thermaxis.positioning.standard import find_spread_anomalies, local_deviation_contrasts
from thermaxis.quantities import AxisKind

if TYPE_CHECKING:
    from thermaxis.positioning.drift import DriftResult

LEVEL = 0.005
"""Largest probability that one test names a healthy axis, the spread's test excepted. [1]"""
SPREAD_LEVEL = 0.02
"""The same for the spread of all targets together. [1]"""
LEAST_SCALE_UM_PER_M = 5.0
"""Straight-line error that is no finding: half a kelvin of steel, which a run hardly knows
better. [µm/m]"""
LEAST_SCALE_ARCSEC_PER_TURN = 2.0
"""The same for a rotary axis; own choice. [arcsec per 360 deg]"""
LEAST_EFFECT = 1.0
"""Reversal value, step or variation of it, and error at the end of the axis that is no finding;
own choice, what a good axis with a laser's set-up leaves. [µm or arcsec]"""
LEAST_AMPLITUDE = 0.5
"""Amplitude of a periodic error that is no finding: the same from valley to peak.
[µm or arcsec]"""
LEAST_SPREAD_RATIO = 1.5
"""Spread over that of the other targets that is no finding; own choice. [1]"""
LEAST_CORRELATION = 0.9
"""Correlation of a channel with the drift that is no finding; own choice. [1]"""
STEEL_PPM_PER_K = 11.5
"""Expansion coefficient where the file states none: steel, as scales and screws are stated.
[ppm/K]"""
FEWEST_TARGETS = 5
"""With fewer targets nothing is said of how an error runs along the axis. [1]"""
COMMON_PITCHES_MM = (2.0, 2.5, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0, 20.0, 25.0, 32.0, 40.0)
"""Pitches of screws that are tried where the header states none. [mm]"""
COMMON_PERIODS_DEG = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.5, 8.0, 9.0, 10.0, 12.0, 15.0, 20.0, 30.0)
"""Teeth of worm wheels that are tried where the header states none. [deg]"""
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
_VISIBLE = 0.1
"""Share of its mean square that a periodic error must leave beside a smooth curve, whatever its
phase; below it the targets hide it. [1]"""
_AT_MULTIPLES = 0.99
"""Length of the mean phasor from which targets stand at multiples of a period. [1]"""
_AS_LIKELY = 6.0
"""Other periods are named if their criterion is not larger by more than this: a probability of
one in twenty. [1]"""


@final
@dataclass(frozen=True, slots=True)
class Finding:
    """What the diagnosis found, in words and with its number."""

    finding: str
    """Key that stays: scale_error, periodic_error, backlash, backlash_step, backlash_variation,
    spread, drift_reversal, temperature_channel or hidden_period."""
    value: float
    """The number behind it: straight-line error, amplitude of the periodic error, mean reversal
    value, step of the reversal value, its range along the axis, standard deviation at the target,
    way back of the drift, drift per kelvin, or hidden period. [unit in `unit`]"""
    unit: str
    """Unit of the number as printed."""
    text: str
    """One plain sentence."""
    p_value: float | None
    """Probability of so much or more by chance alone, all places that were searched counted;
    for scale_error, backlash and drift_reversal if the true value were at its threshold. None
    where nothing was tested. [1]"""


@final
@dataclass(frozen=True, slots=True)
class _Ranked:
    finding: Finding
    group: int
    """0 fault of the axis, 1 thermal state, 2 choice of the targets. [1]"""
    effect: float
    """Contribution to the accuracy. [µm or arcsec]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Axis:
    """Levels as the tests see them."""

    test: PositioningTest
    drift: "DriftResult | None"
    target: FloatArray
    """Targets whose levels are known, (m,). [mm or deg]"""
    mean: FloatArray
    """Mean of the measured approaches, (m,). [µm or arcsec]"""
    mean_covariance: FloatArray
    """(m, m). [µm² or arcsec²]"""
    reversal: FloatArray | None
    """Reversal values, (m,); None in a unidirectional run. [µm or arcsec]"""
    reversal_covariance: FloatArray
    """(m, m). [µm² or arcsec²]"""
    free: float
    """Degrees of freedom of the noise. [1]"""

    @property
    def length(self) -> float:
        return float(self.target[-1] - self.target[0])

    @property
    def unit(self) -> str:
        return self.test.kind.units.deviation

    def place(self, position: float) -> str:
        return f"{position:g} {self.test.kind.units.position}"

    def amount(self, value: float, *, signed: bool = False) -> str:
        return f"{_number(value, signed=signed)} {self.unit}"


def _number(value: float, *, signed: bool = False) -> str:
    """Return a number with three digits, never in powers of ten where it can be helped."""
    digits = 0 if abs(value) >= 100.0 else 1 if abs(value) >= 10.0 else 2
    return f"{value:+.{digits}f}" if signed else f"{value:.{digits}f}"


def _upper_tail(t: float, free: float) -> float:
    """Return the probability that Student's t is larger."""
    from scipy.special import stdtr  # noqa: PLC0415  it takes longer to import than a whole run

    return float(stdtr(free, -t))


def _f_tail(ratio: float, more: float, free: float) -> float:
    from scipy.special import fdtrc  # noqa: PLC0415  it takes longer to import than a whole run

    return float(fdtrc(more, free, max(ratio, 0.0)))


def _solved(matrix: FloatArray, right: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)


# ---- levels -------------------------------------------------------------------------------------


def _plain_levels(test: PositioningTest) -> tuple[FloatArray, FloatArray, float]:
    """Return plain means, their variances (NaN for one cycle) and the degrees of freedom."""
    count = test.readings
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.nansum(test.deviation, axis=1) / count
        square = float(np.nansum((test.deviation - mean[:, None, :]) ** 2))
        free = float(np.sum(np.maximum(count - 1.0, 0.0)))
        variance = square / free / count if free > 0.0 else np.full(count.shape, np.nan)
    return mean, variance, free


def _variance_along(target: FloatArray, value: FloatArray) -> float:
    """Return the variance of values about the lines through their neighbours."""
    contrast = local_deviation_contrasts(target)
    local = contrast @ value / np.sqrt(np.sum(contrast**2, axis=1))
    return float(np.median(local**2)) / 0.4549  # median of chi-squared with one degree of freedom


def _combined(
    covariance: FloatArray, known: NDArray[np.bool_], approaches: int
) -> tuple[FloatArray, FloatArray]:
    """Return the covariances of the means of both approaches and of the reversal values."""
    m = known.size
    kept = np.ix_(known, known)
    forward = covariance[:m, :m][kept]
    if approaches == 1:
        return forward, forward
    backward = covariance[m:, m:][kept]
    across = covariance[:m, m:][kept]
    own, shared = forward + backward, across + across.T
    return (own + shared) / 4.0, own - shared


def _axis(test: PositioningTest, drift: "DriftResult | None") -> _Axis | None:
    """Return the levels with their covariance; None where nothing tells their noise."""
    approaches = [a for a, measured in enumerate(test.measured_approaches) if measured]
    if drift is not None:
        level, covariance = drift.level, drift.level_covariance
        free = float(np.sum(test.readings)) - drift.effective_parameters
    else:
        level, variance, free = _plain_levels(test)
        covariance = np.diag(variance[:, approaches].T.ravel())
    known = np.all(np.isfinite(level[:, approaches]), axis=1)
    if int(np.sum(known)) < 3:
        return None
    target = test.target[known]
    mean = np.mean(level[np.ix_(known, approaches)], axis=1)
    reversal = level[known, FORWARD] - level[known, BACKWARD] if len(approaches) == 2 else None
    if free > 0.0:
        mean_covariance, reversal_covariance = _combined(covariance, known, len(approaches))
    elif target.size >= FEWEST_TARGETS:  # one cycle: the axis itself must tell what is noise
        free = 0.5 * target.size
        mean_covariance = np.eye(target.size) * _variance_along(target, mean)
        along = mean if reversal is None else reversal
        reversal_covariance = np.eye(target.size) * _variance_along(target, along)
    else:
        return None
    return _Axis(
        test=test,
        drift=drift,
        target=target,
        mean=mean,
        mean_covariance=mean_covariance,
        reversal=reversal,
        reversal_covariance=reversal_covariance,
        free=free,
    )


# ---- periodic error -----------------------------------------------------------------------------


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Periodic:
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


def _stated_periods(test: PositioningTest) -> tuple[float, ...]:
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


def _candidates(test: PositioningTest) -> tuple[float, ...]:
    """Return the periods that are tried."""
    stated = _stated_periods(test)
    if stated:
        return (*stated, stated[0] / 2.0)
    return COMMON_PITCHES_MM if test.kind is AxisKind.LINEAR else COMMON_PERIODS_DEG


def _smooth_basis(target: FloatArray, degree: int) -> FloatArray:
    """Return orthonormal polynomials of the position, (m, degree + 1)."""
    x = 2.0 * (target - target[0]) / (target[-1] - target[0]) - 1.0
    columns = np.asarray(np.polynomial.legendre.legvander(x, degree), dtype=np.float64)
    basis, _ = np.linalg.qr(columns)
    return np.asarray(basis, dtype=np.float64)


def _waves(target: FloatArray, period: float) -> FloatArray:
    turn = 2.0 * np.pi * (target - target[0]) / period
    return np.stack((np.cos(turn), np.sin(turn)), axis=1)


def _visibility(target: FloatArray, period: float) -> tuple[float, float]:
    """Return what a period leaves beside a straight line, at its worst and best phase. [1]"""
    line = _smooth_basis(target, 1)
    waves = _waves(target, period)
    waves -= line @ (line.T @ waves)
    worst, best = (np.linalg.eigvalsh(waves.T @ waves) / (0.5 * target.size)).tolist()
    return worst, best


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


def _try_periods(axis: _Axis, waves: FloatArray, floor: float) -> _Trials:
    """Fit each period, (k, m, 2), beside a straight line and smooth random curves."""
    m, k = axis.target.size, waves.shape[0]
    line = _smooth_basis(axis.target, 1)
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
        inverse = np.linalg.pinv(gram, rcond=_VISIBLE**2, hermitian=True)
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


def _periodic(axis: _Axis) -> _Periodic | None:
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
    target, m = axis.target, axis.target.size
    periods = [
        p
        for p in _candidates(axis.test)
        if p * _PERIODS_PER_LENGTH <= axis.length and _visibility(target, p)[1] > _VISIBLE**2
    ]
    if m < FEWEST_TARGETS_FOR_PERIODS or not periods:
        return None
    line = _smooth_basis(target, 1)
    noise = np.trace(axis.mean_covariance) - np.trace(line.T @ axis.mean_covariance @ line)
    waves = np.stack([_waves(target, period) for period in periods])
    tried = _try_periods(axis, waves, max(float(noise) / (m - 2), 1e-12))
    first = int(np.argmin(tried.criterion))
    gained = max(tried.without - float(tried.criterion[first]), 0.0)
    ratio = float(np.expm1(gained / m)) * (m - 4) / 2.0
    p_value = min(1.0, len(periods) * _f_tail(ratio, 2, m - 4))
    amplitude = float(tried.amplitude[first])
    if p_value >= LEVEL or amplitude < LEAST_AMPLITUDE:
        return None
    likely = tried.criterion < tried.criterion[first] + _AS_LIKELY
    others = tuple(p for i, p in enumerate(periods) if likely[i] and i != first)
    return _Periodic(periods[first], amplitude, p_value, others)


def _named_source(axis: _Axis, period: float) -> str:
    stated = _stated_periods(axis.test)
    linear = axis.test.kind is AxisKind.LINEAR
    if stated and period == stated[0] / 2.0:
        return "half the pitch that the file states"
    if period in stated:
        return "as the file states for the drive or the encoder"
    return "a common pitch of screws" if linear else "a common pitch of worm wheels"


def _periodic_findings(axis: _Axis, found: _Periodic | None) -> list[_Ranked]:
    if found is None:
        return []
    others = ", ".join(axis.place(p) for p in found.others)
    unsure = f"; on these targets {others} would fit about as well" if others else ""
    text = (
        f"Periodic error with an amplitude of {axis.amount(found.amplitude)} and a period of"
        f" {axis.place(found.period)}, {_named_source(axis, found.period)}{unsure}."
    )
    finding = Finding("periodic_error", found.amplitude, axis.unit, text, found.p_value)
    return [_Ranked(finding, 0, 2.0 * found.amplitude)]


def _hidden_findings(test: PositioningTest, found: _Periodic | None) -> list[_Ranked]:
    """Warn of periods at whose multiples the targets stand."""
    target = test.target
    if target.size < 3:
        return []
    stated = _stated_periods(test)
    tried = [p for p in stated or _candidates(test) if p <= test.measured_length]
    if stated:
        hidden = [p for p in tried if _visibility(target, p)[0] < _VISIBLE]
    else:
        hidden = [p for p in tried if np.hypot(*np.mean(_waves(target, p), axis=0)) > _AT_MULTIPLES]
    if not hidden or (found is not None and found.period in hidden):
        return []
    unit = test.kind.units.position
    listed = ", ".join(f"{p:g}" for p in hidden)
    source = "stated in the file" if stated else "common for drives"
    text = (
        f"The intervals between the targets are nearly multiples of {listed} {unit} ({source}): an"
        " error with such a period stays hidden; measure with a random part of the targets."
    )
    return [_Ranked(Finding("hidden_period", hidden[0], unit, text, None), 2, 0.0)]


# ---- straight-line error ------------------------------------------------------------------------


def _expansion(test: PositioningTest) -> tuple[float, str]:
    """Return the expansion coefficient [ppm/K] and where it comes from."""
    stated = test.environment.get("expansion_coefficient_ppm_per_k")
    for value in () if stated is None else (stated.start, stated.end):
        if value is not None and np.isfinite(value) and value > 0.0:
            return value, "stated in the file"
    return STEEL_PPM_PER_K, "steel; the file states no coefficient"


def _line(axis: _Axis, found: _Periodic | None) -> tuple[float, float]:
    """Return slope and standard uncertainty of the least-squares line. [µm/mm or arcsec/deg]"""
    columns = np.stack((axis.target - np.mean(axis.target), np.ones_like(axis.target)), axis=1)
    if found is not None:
        columns = np.column_stack((columns, _waves(axis.target, found.period)))
    weight = np.linalg.pinv(columns)[0]
    slope = float(weight @ axis.mean)
    variance = float(weight @ axis.mean_covariance @ weight)
    if axis.drift is None:
        return slope, float(np.sqrt(variance))
    since = float(axis.drift.slope[0])  # levels are those at t0; go back to the first reading
    return slope + since, float(np.sqrt(variance)) + float(axis.drift.slope_std[0])


def _scale_findings(axis: _Axis, found: _Periodic | None) -> list[_Ranked]:
    slope, uncertainty = _line(axis, found)
    linear = axis.test.kind is AxisKind.LINEAR
    per, unit = (1000.0, f"{axis.unit}/m") if linear else (360.0, f"{axis.unit} per turn")
    least = (LEAST_SCALE_UM_PER_M if linear else LEAST_SCALE_ARCSEC_PER_TURN) / per
    least = max(least, LEAST_EFFECT / axis.length)
    p_value = _upper_tail((abs(slope) - least) / max(uncertainty, 1e-12), axis.free)
    if p_value >= LEVEL:
        return []
    state = "with the drift of the run in it" if axis.drift is None else "at the first reading"
    text = (
        f"Straight-line error of {_number(slope * per, signed=True)} {unit}"
        f" ({axis.amount(slope * axis.length, signed=True)} over {axis.place(axis.length)}),"
        f" {state}"
    )
    if linear:
        ppm_per_k, source = _expansion(axis.test)
        text += (
            f"; an error of {_number(abs(slope) * per / ppm_per_k)} K in the temperature of the"
            f" material would explain it, at {ppm_per_k:g} ppm/K ({source})"
        )
    finding = Finding("scale_error", slope * per, unit, text + ".", p_value)
    return [_Ranked(finding, 0, abs(slope) * axis.length)]


# ---- backlash -----------------------------------------------------------------------------------


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Shape:
    """How the reversal value runs along the axis."""

    fitted: FloatArray
    """(m,). [µm or arcsec]"""
    p_value: float
    step_after: int | None
    """Number of targets before the step; None where it varies smoothly. [1]"""


def _weighted_square(columns: FloatArray, value: FloatArray) -> tuple[float, FloatArray]:
    solved, *_ = np.linalg.lstsq(columns, value, rcond=None)
    return float(np.sum((value - columns @ solved) ** 2)), np.asarray(solved, dtype=np.float64)


def _shape_probability(axis: _Axis, gained: float, more: int, left: float) -> float:
    """Return the probability of a gain by chance; what the noise does not explain is noise too."""
    free = axis.target.size - 1 - more
    scatter = left / free
    if scatter <= 1.0:
        return _f_tail(gained / more, more, axis.free)
    return _f_tail(gained / more / scatter, more, free)


def _shape(axis: _Axis, reversal: FloatArray) -> _Shape:
    """Choose between a constant, a step anywhere, and polynomials up to the third degree."""
    m = reversal.size
    flat = _Shape(np.full(m, float(np.mean(reversal))), 1.0, None)
    if m < FEWEST_TARGETS:
        return flat
    covariance = axis.reversal_covariance + 1e-12 * np.eye(m)
    root = np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)
    columns = _solved(root, _smooth_basis(axis.target, 3))
    value = _solved(root, reversal)
    ones = _solved(root, np.ones((m, 1)))
    constant, _ = _weighted_square(ones, value)
    steps = _solved(root, np.tri(m, k=-1)[:, : m - 1])  # column k: one after target k + 1
    trials: list[tuple[float, _Shape]] = []
    unit = ones / np.linalg.norm(ones)
    own, rest = steps - unit @ (unit.T @ steps), value - unit[:, 0] * float(unit[:, 0] @ value)
    k = int(np.argmax((rest @ own) ** 2 / np.sum(own**2, axis=0)))
    square, solved = _weighted_square(np.column_stack((ones, steps[:, k])), value)
    p_value = min(1.0, (m - 1) * _shape_probability(axis, constant - square, 1, square))
    fitted = solved[0] + solved[1] * (np.arange(m) > k)
    trials.append((_criterion(axis, square, 2), _Shape(fitted, p_value, k + 1)))
    for degree in range(1, min(3, m - 3) + 1):
        square, solved = _weighted_square(columns[:, : degree + 1], value)
        p_value = min(1.0, 3.0 * _shape_probability(axis, constant - square, degree, square))
        fitted = _smooth_basis(axis.target, 3)[:, : degree + 1] @ solved
        trials.append((_criterion(axis, square, degree), _Shape(fitted, p_value, None)))
    _, best = min(trials, key=lambda trial: trial[0])
    if best.p_value >= LEVEL or float(np.ptp(best.fitted)) < LEAST_EFFECT:
        return flat
    return best


def _criterion(axis: _Axis, square: float, more: int) -> float:
    """Return Schwarz's criterion; a fit better than the noise earns nothing."""
    m = axis.target.size
    return m * float(np.log(max(square, m - 1.0 - more))) + float(np.log(m)) * more


def _shape_findings(axis: _Axis, shape: _Shape) -> list[_Ranked]:
    first, last = float(shape.fitted[0]), float(shape.fitted[-1])
    if shape.step_after is not None:
        k = shape.step_after
        step = last - first
        text = (
            f"The reversal value steps by {axis.amount(step, signed=True)} between"
            f" {axis.place(float(axis.target[k - 1]))} and {axis.place(float(axis.target[k]))},"
            f" from {axis.amount(first, signed=True)} to {axis.amount(last, signed=True)}."
        )
        finding = Finding("backlash_step", step, axis.unit, text, shape.p_value)
        return [_Ranked(finding, 0, abs(step))]
    size = float(np.ptp(shape.fitted))
    if size < LEAST_EFFECT:
        return []
    low, high = int(np.argmin(shape.fitted)), int(np.argmax(shape.fitted))
    text = (
        f"The reversal value varies by {axis.amount(size)} along the axis, from"
        f" {axis.amount(float(shape.fitted[low]), signed=True)} at"
        f" {axis.place(float(axis.target[low]))} to"
        f" {axis.amount(float(shape.fitted[high]), signed=True)} at"
        f" {axis.place(float(axis.target[high]))}."
    )
    finding = Finding("backlash_variation", size, axis.unit, text, shape.p_value)
    return [_Ranked(finding, 0, size)]


def _without_step(axis: _Axis, shape: _Shape | None) -> _Axis:
    """Take a step of one approach alone out of the mean of both, where that makes it smoother."""
    if shape is None or shape.step_after is None:
        return axis
    smooth = _smooth_basis(axis.target, min(3, axis.target.size - 2))
    step = shape.fitted - shape.fitted[0]
    tried = [axis.mean - share * step for share in (0.0, 0.5, -0.5)]
    left = [float(np.sum((mean - smooth @ (smooth.T @ mean)) ** 2)) for mean in tried]
    return replace(axis, mean=tried[int(np.argmin(left))])


def _backlash_findings(axis: _Axis, shape: _Shape | None) -> list[_Ranked]:
    """Name the mean reversal value, and what is not the same everywhere."""
    if axis.reversal is None or shape is None:
        return []
    findings = _shape_findings(axis, shape)
    mean = float(np.mean(axis.reversal))
    uncertainty = float(np.sqrt(np.mean(axis.reversal_covariance)))
    p_value = _upper_tail((abs(mean) - LEAST_EFFECT) / max(uncertainty, 1e-12), axis.free)
    everywhere = float(np.min(shape.fitted * np.sign(mean)))  # what is left without the variation
    if p_value >= LEVEL or everywhere < LEAST_EFFECT:
        return findings
    cause = "lost motion makes it negative" if mean < 0.0 else "too much compensation does that"
    text = f"Mean reversal value of {axis.amount(mean, signed=True)} ({cause})."
    finding = Finding("backlash", mean, axis.unit, text, p_value)
    return [*findings, _Ranked(finding, 0, everywhere)]


# ---- spread -------------------------------------------------------------------------------------


def _without_means(deviation: FloatArray) -> FloatArray:
    """Return independent contrasts of the complete cycles of one approach, (m, n - 1)."""
    complete = deviation[:, ~np.any(np.isnan(deviation), axis=0)]
    n = complete.shape[1]
    if n < 2:
        return np.empty((deviation.shape[0], 0))
    basis, _ = np.linalg.qr(np.column_stack((np.ones(n), np.eye(n)[:, 1:])))
    return complete @ basis[:, 1:]


@final
@dataclass(frozen=True, slots=True)
class _Spread:
    target: int
    """Index of the target. [1]"""
    std: float
    """Standard deviation of its readings. [µm or arcsec]"""
    ratio: float
    """Spread here over that of the other targets, drift left out. [1]"""
    p_value: float
    """All targets counted. [1]"""


def _squares(deviation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return sums of squares about the means and degrees of freedom per target, (m,) each."""
    count = np.sum(~np.isnan(deviation), axis=1)
    mean = np.nansum(deviation, axis=1) / np.maximum(count, 1)
    square = np.nansum((deviation - mean[:, None, :]) ** 2, axis=(1, 2))
    free = np.sum(np.maximum(count - 1.0, 0.0), axis=1)
    return np.asarray(square, dtype=np.float64), np.asarray(free, dtype=np.float64)


def _spreads_without_drift(drift: "DriftResult") -> list[_Spread]:
    """Compare the largest spread with that of the other targets, drift taken out.

    Where all scatter alike, the ratio of their variances is distributed as F (the share of one
    in all of them as beta: Cochran 1941). The largest is left out and the rest tested again.
    """
    square, free = _squares(drift.deviation)
    free = free * (1.0 - drift.drift_parameters / max(float(np.sum(free)), 1.0))
    kept = np.flatnonzero(free > 0.0)
    found: list[_Spread] = []
    while kept.size >= FEWEST_TARGETS:
        own, own_free = square[kept], free[kept]
        rest, rest_free = np.sum(own) - own, np.sum(own_free) - own_free
        if float(np.min(rest)) <= 0.0 or float(np.min(own_free)) < 1.0:
            break
        ratio = own / own_free / (rest / rest_free)
        tail = np.array([_f_tail(*f) for f in zip(ratio, own_free, rest_free, strict=True)])
        worst = int(np.argmin(tail))
        p_value = float(tail[worst]) * kept.size
        if p_value >= SPREAD_LEVEL:
            break
        std = float(np.sqrt(own[worst] / own_free[worst]))
        others = float(np.sqrt(rest[worst] / rest_free[worst]))
        found.append(_Spread(int(kept[worst]), std, std / others, p_value))
        kept = np.delete(kept, worst)
    return found


def _spreads_with_drift(test: PositioningTest) -> list[_Spread]:
    """Compare local deviations, in which the drift hardly enters; both approaches in one test."""
    contrasts = np.hstack([_without_means(test.deviation[:, :, a]) for a in (FORWARD, BACKWARD)])
    named = find_spread_anomalies(test.target, contrasts, level=SPREAD_LEVEL)
    square, free = _squares(test.deviation)
    with np.errstate(divide="ignore", invalid="ignore"):
        std = np.sqrt(square / free)
    found: list[_Spread] = []
    for k, anomaly in enumerate(named):
        i, tested = anomaly.position - 1, test.target.size - k
        found.append(_Spread(i, float(std[i]), anomaly.statistic, anomaly.p_value * tested))
    return found


def _spread_findings(axis: _Axis) -> list[_Ranked]:
    """Name targets that scatter more than the others."""
    test, drift = axis.test, axis.drift
    if test.target.size < FEWEST_TARGETS:
        return []
    named = _spreads_with_drift(test) if drift is None else _spreads_without_drift(drift)
    found: list[_Ranked] = []
    for spread in named:
        if spread.ratio < LEAST_SPREAD_RATIO:
            continue
        drifting = ", drift included" if drift is None else ""
        times = "unlike"
        if np.isfinite(spread.ratio):
            times = f"{_number(spread.ratio)} times as much as"
        text = (
            f"Target {spread.target + 1} ({axis.place(float(test.target[spread.target]))}) scatters"
            f" {times} the others, with a standard deviation of"
            f" {axis.amount(spread.std)}{drifting}."
        )
        if drift is not None and spread.target + 1 in drift.suspects:
            text = text[:-1] + "; it also drifts otherwise than the rest of the axis."
        finding = Finding("spread", spread.std, axis.unit, text, spread.p_value)
        more = spread.std * (1.0 - 1.0 / spread.ratio)
        found.append(_Ranked(finding, 0, 4.0 * more))
    return found


# ---- drift --------------------------------------------------------------------------------------


def _after(drift: "DriftResult", test: PositioningTest, index: int) -> str:
    """Return in words how long after the start a point of the drift's curve lies."""
    time = float(drift.time_s[index] - drift.time_s[0])
    if test.time_s is None:
        return f"{time:.0f} readings"
    return f"{time / 60.0:.0f} min" if time < 7200.0 else f"{time / 3600.0:.1f} h"


@final
@dataclass(frozen=True, slots=True)
class _Turn:
    """Where the drift turns back at one position."""

    position: float
    """[mm or deg]"""
    at: int
    """Index of the turn on the drift's curve. [1]"""
    there: float
    """Way up to the turn. [µm or arcsec]"""
    back: float
    """Way after it. [µm or arcsec]"""
    uncertainty: float
    """Bound of the standard uncertainty of both. [µm or arcsec]"""

    @property
    def shorter(self) -> float:
        """Length of the shorter of both ways. [µm or arcsec]"""
        return min(abs(self.there), abs(self.back))


def _turns(drift: "DriftResult", position: float, arm: float) -> list[_Turn]:
    """Return the turn up and the turn down at a position that lies `arm` off the mean one."""
    curve = drift.common + arm * drift.slope
    std = drift.common_std + abs(arm) * drift.slope_std
    found: list[_Turn] = []
    for k in (int(np.argmax(curve)), int(np.argmin(curve))):
        there, back = float(curve[k] - curve[0]), float(curve[-1] - curve[k])
        if there * back < 0.0:
            unsure = float(std[k] + max(std[0], std[-1]))
            found.append(_Turn(position, k, there, back, unsure))
    return found


def _drift_reversal_findings(axis: _Axis) -> list[_Ranked]:
    """Name the place among first, middle and last target where the drift turns back most."""
    drift, test = axis.drift, axis.test
    if drift is None or not drift.significant:
        return []
    middle = float(np.mean(test.target))
    places = (middle, float(test.target[0]), float(test.target[-1]))
    found = [turn for place in places for turn in _turns(drift, place, place - middle)]
    if not found:
        return []
    turn = max(found, key=lambda turn: turn.shorter)
    beyond = (turn.shorter - LEAST_EFFECT) / max(turn.uncertainty, 1e-12)
    p_value = min(1.0, 2 * len(places) * _upper_tail(beyond, axis.free))
    if p_value >= LEVEL:
        return []
    text = (
        f"The drift reverses its direction at {axis.place(round(turn.position, 1))}:"
        f" {axis.amount(turn.there, signed=True)} up to {_after(drift, test, turn.at)}, then"
        f" {axis.amount(turn.back, signed=True)}; two parts of the machine warm up against each"
        " other."
    )
    finding = Finding("drift_reversal", turn.back, axis.unit, text, p_value)
    return [_Ranked(finding, 1, turn.shorter)]


def _is_temperature(name: str) -> bool:
    lower = name.lower()
    return "temp" in lower or lower.endswith("_c")


def _series(test: PositioningTest, values: FloatArray, time: FloatArray) -> FloatArray | None:
    """Return a channel on the times of the drift's curve; None if it hardly exists."""
    at = test.time_s if test.time_s is not None else test.order
    if at is None:
        return None
    known = np.isfinite(values) & np.isfinite(at)
    if int(np.sum(known)) < time.size // 4:
        return None
    when, what = at[known], values[known]
    step = float(time[1] - time[0])
    place = np.clip(np.rint((when - time[0]) / step).astype(np.intp), 0, time.size - 1)
    count = np.bincount(place, minlength=time.size)
    total = np.bincount(place, what, time.size)
    filled = count > 0
    return np.asarray(np.interp(time, time[filled], total[filled] / count[filled]))


@final
@dataclass(frozen=True, slots=True)
class _Explained:
    name: str
    lag: int
    correlation: float
    gain: float
    p_value: float


def _independent(first: FloatArray, second: FloatArray) -> float:
    """Return how many independent pairs two correlated series are worth (Bartlett 1946)."""
    n = first.size

    def memory(x: FloatArray) -> FloatArray:
        padded = np.fft.rfft(x, 2 * n)
        value = np.fft.irfft(np.abs(padded) ** 2)[:n]
        return np.asarray(value / value[0])

    together = memory(first)[1:] * memory(second)[1:]
    weight = 1.0 - np.arange(1, n) / n
    return n / max(1.0, 1.0 + 2.0 * float(np.sum(weight * together)))


def _explained(name: str, channel: FloatArray, drift: FloatArray) -> _Explained | None:
    """Try all lags up to a quarter of the run, the drift following the temperature."""
    n = drift.size
    best: tuple[float, int] = (0.0, 0)
    for lag in range(n // 4 + 1):
        y, x = drift[lag:], channel[: n - lag]
        spread = float(np.std(y) * np.std(x))
        if spread > 0.0:
            correlation = float(np.mean((y - np.mean(y)) * (x - np.mean(x)))) / spread
            if abs(correlation) > abs(best[0]) + 1e-9:
                best = (correlation, lag)
    correlation, lag = best
    if abs(correlation) < LEAST_CORRELATION:
        return None
    y, x = drift[lag:], channel[: n - lag]
    line = _smooth_basis(np.arange(y.size, dtype=np.float64), 1)
    bent, warm = y - line @ (line.T @ y), x - line @ (line.T @ x)
    size = float(np.sqrt((bent @ bent) * (warm @ warm)))
    if float(bent @ bent) < 1e-6 * n * float(np.var(y)) or size == 0.0:
        return None  # two straight lines always agree
    partial = min(abs(float(bent @ warm)) / size, 1.0 - 1e-12)
    free = _independent(bent, warm) - 2.0
    if free < 1.0 or float(bent @ warm) * correlation < 0.0:
        return None
    t = partial * float(np.sqrt(free / (1.0 - partial**2)))
    gain = correlation * float(np.std(y) / np.std(x))
    return _Explained(name, lag, correlation, gain, min(1.0, 2.0 * _upper_tail(t, free)))


def _temperature_findings(axis: _Axis) -> list[_Ranked]:
    """Name the temperature that runs like the common drift, not only like a straight line."""
    drift, test = axis.drift, axis.test
    if drift is None or not drift.significant:
        return []
    if float(np.ptp(drift.common)) < LEAST_EFFECT:
        return []
    names = [name for name in test.channels if _is_temperature(name)]
    tried: list[_Explained] = []
    for name in names:
        channel = _series(test, test.channels[name], drift.time_s)
        explained = None if channel is None else _explained(name, channel, drift.common)
        if explained is not None and explained.p_value * len(names) < LEVEL:
            tried.append(explained)
    if not tried:
        return []
    best = max(tried, key=lambda e: abs(e.correlation))
    after = "without delay"
    if best.lag:
        after = f"{_after(drift, test, best.lag)} later"
    unit = f"{axis.unit}/K"
    text = (
        f"The drift follows the channel '{best.name}' {after}: correlation"
        f" {best.correlation:+.3f}, {_number(best.gain, signed=True)} {unit}."
    )
    finding = Finding("temperature_channel", best.gain, unit, text, best.p_value * len(names))
    return [_Ranked(finding, 1, float(np.ptp(drift.common)))]


# ---- all together -------------------------------------------------------------------------------


def _ordered(found: Sequence[_Ranked]) -> tuple[Finding, ...]:
    return tuple(r.finding for r in sorted(found, key=lambda r: (r.group, -r.effect)))


def diagnose(test: PositioningTest, drift: "DriftResult | None") -> tuple[Finding, ...]:
    """Name what is wrong with an axis, the largest effect on its accuracy first.

    Parameters
    ----------
    test : PositioningTest
        The measured run.
    drift : DriftResult or None
        Its drift-free levels; None where they do not exist: then the plain means are used,
        and nothing is said of the drift.

    Returns
    -------
    tuple of Finding
        Faults of the axis by their effect on the accuracy A: the straight-line error over the
        length, twice the amplitude of a periodic error, a step or range of the reversal value,
        the reversal value that is there everywhere, four times the additional standard
        deviation of a target. Then what the drift shows; last the periods that the targets
        hide. Empty for a healthy axis, and where fewer than three targets or no noise is known.

    Notes
    -----
    With fewer than five targets only the straight-line error and the mean reversal value are
    looked at, with fewer than seven no periodic error. A periodic error that depends on the
    approach, or has no candidate's period, is not found. A step of the reversal value that
    sits in one approach alone is taken out before lines and periods are fitted.

    References
    ----------
    N. R. Lomb 1976, J. D. Scargle 1982 (periodogram of unequal intervals); W. G. Cochran 1941
    (largest variance as a fraction of all); M. S. Bartlett 1946 (correlation of correlated
    series); all from memory. The thresholds are own choices, stated with their names.
    """
    axis = _axis(test, drift)
    if axis is None:
        return _ordered(_hidden_findings(test, None))
    shape = None if axis.reversal is None else _shape(axis, axis.reversal)
    level = _without_step(axis, shape)
    found = _periodic(level)
    return _ordered(
        [
            *_scale_findings(level, found),
            *_periodic_findings(level, found),
            *_backlash_findings(axis, shape),
            *_spread_findings(axis),
            *_drift_reversal_findings(axis),
            *_temperature_findings(axis),
            *_hidden_findings(test, found),
        ]
    )
