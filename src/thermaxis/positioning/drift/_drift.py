"""Separate the thermal drift of a run from the levels of its targets.

The model of a reading of target i in one approach at time t is

    deviation = level(i, approach) + a(t) + b(t) (position - mean position) + noise

with a and b smooth functions of time. How smooth they are is not chosen but averaged over, with
the restricted likelihood as weight, so that the bands hold what the run does not tell about it.
Where the axis bows, a third function times a parabola of the position is added.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from statistics import NormalDist
from typing import final

import numpy as np

from thermaxis.codes import Message, Place
from thermaxis.errors import DataError
from thermaxis.positioning.drift._changes import (
    PAUSE,
    find_step,
    find_steps,
    outlier_at_end,
    steps_that_hold,
)
from thermaxis.positioning.drift._correlated_noise import LEAST_GAIN_SAID, find_correlation
from thermaxis.positioning.drift._drift_tests import (
    FEWEST_CYCLES_BOW,
    FEWEST_TARGETS_ALONE,
    FEWEST_TARGETS_BOW,
    SIGNIFICANCE,
    DriftTest,
    apart,
    drift_test,
    moved_alone,
)
from thermaxis.positioning.drift._smooth_terms import (
    Correlation,
    IntArray,
    Readings,
    Step,
    Sums,
    levels_at,
    leverages_of,
    rows_at,
    slowest_rate,
    sums_of,
    sums_per,
)
from thermaxis.positioning.drift._smoothness import (
    NO_DRIFT,
    PLAIN_TIME,
    TIMES,
    Average,
    Reported,
    average_over_smoothness,
    effective_parameters,
    function_errors,
    largest_departure,
    level_errors,
    reported,
    step_sizes,
)
from thermaxis.positioning.drift._tails import LEAST_GAIN, robust_std, tails_of
from thermaxis.positioning.drift._unequal_noise import weights_of_levels
from thermaxis.positioning.run import APPROACHES, FloatArray, PositioningTest, TimeSource, placed
from thermaxis.positioning.standard import (
    Iso230_2Figures,
    figures_of,
    mean_and_s,
    require_readings,
)
from thermaxis.quantities import AxisKind

LONGEST_INTERVAL_S = 1800.0
"""Knots of the splines are at most this far apart. [s]"""
FEWEST_INTERVALS, MOST_INTERVALS = 6, 500
"""Intervals of the splines, unless the longest interval asks for more. [1]"""
INTERVALS_PER_CYCLE = 2.0
"""Intervals per cycle as far as these allow. [1]"""
FEWEST_CYCLES_STEP = 3.0
"""With fewer cycles a step between two of them cannot be told from a line. [1]"""
LONGEST_WARMING_S = 30.0 * 3600.0
"""A longer run is resolved well enough in plain time alone. [s]"""
FEWEST_LEFT_OVER = 4
"""Readings that a run must have beyond its levels. [1]"""
MOST_OUTLIERS = 0.05
"""Share of the readings that are left out at most. [1]"""
MOST_CHANGES = 10
"""Steps that are looked for. [1]"""
MOST_TURNS = 2 * MOST_CHANGES
"""Steps after which correlated noise is judged anew. [1]"""
FAR = 2.5
"""In robust standard deviations; 1.2 % of normal noise lie beyond. [1]"""
_COARSE = 3.0**0.5
"""Step of the readings over their scatter above which its form is that of rounding. [1]"""
_NORMAL_MEDIAN = 1.4826
"""Standard deviation over the median of the absolute values, of a normal distribution. [1]"""
_LEAST_LEFT = 0.02
"""Share of a reading that a fit leaves to its residual at least. [1]"""
_MOST_LEVERAGES = 20_000_000
"""Readings times coefficients up to which leverages are worked out in full. [1]"""
_HIDDEN = 2.0
"""Where a straight drift makes the levels' mean square error so much larger, the order of visits
hides it; not to see it then says nothing. [1]"""
_ROUND_OFF = 1e-13
"""Differences below this share of the readings are rounding. [1]"""
_BAND_TIMES = 121
_CLEAR = 0.6
"""Share of the farthest residual beyond which others of its level cannot be drawn by it. [1]"""
_MOST_NAMED = 5
"""Outliers that have a sentence each. [1]"""
_FEW_OUT, _SHARE_OUT = 2, 0.005
"""Outliers that make no heavy tails: as many, or this share of the readings. [1]"""
FASTEST_SWING = 1.75
"""Cycles that a swing must last for the levels to be told from it. [1]"""
_STARTED = 0.1
"""Share of the run in which a fast warming is no swing. [1]"""
_OFTEN = 0.25
"""Share of the run that a swing may last for its period to be stated. [1]"""


class DriftModel(StrEnum):
    """What the run supports."""

    NONE = "none"
    """No drift is seen; the run is left as it was."""
    LINE = "line"
    """The drift is a straight line in time."""
    SMOOTH = "smooth"
    """The drift is a smooth curve in time."""


class ChangeKind(StrEnum):
    """What jumps at a change."""

    COMMON = "common"
    """All targets alike."""
    STRETCH = "stretch"
    """In proportion to the distance from mid-axis."""


@final
@dataclass(frozen=True, slots=True)
class Change:
    """A step of the drift between two consecutive readings."""

    time_s: float | None
    """Middle of the interval between both readings, from the first reading of the run; None where
    order served as time. [s]"""
    cycle: int
    """Cycle of the first reading after it, from 1. [1]"""
    size: float
    """Size: of all targets, or of the last target against the first. [µm or arcsec]"""
    std: float
    """Its standard uncertainty. [µm or arcsec]"""
    kind: ChangeKind
    interval_s: float | None
    """Time between both readings; long in a pause, when it may have been gradual. [s]"""


@final
@dataclass(frozen=True, slots=True)
class Outlier:
    """A reading that lies out, and was left out of the fit."""

    target: int
    """Number of the target, from 1. [1]"""
    cycle: int
    """Number of the cycle, from 1. [1]"""
    approach: int
    """0 forward, 1 backward. [1]"""
    residual: float
    """How far it lies from the fit without it. [µm or arcsec]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class DriftResult:
    """A run without its drift, at one thermal state."""

    model: DriftModel
    p_no_drift: float
    """Probability of readings that vary so much in time, without any drift. [1]"""
    time_source: TimeSource
    """FILE or INTERPOLATED; ORDER where the acquisition order served as time."""
    reference_time_s: float | None
    """Time t0 of the thermal state, from the first reading; None where order served as time. [s]"""
    level: FloatArray
    """Levels at t0 without the outliers, (m, 2); NaN where an approach was not measured.
    [µm or arcsec]"""
    level_covariance: FloatArray
    """Their covariance, (L, L): targets of the first measured approach, then of the second.
    [µm² or arcsec²]"""
    level_std: FloatArray
    """Their standard uncertainties, (m, 2). [µm or arcsec]"""
    noise_std: FloatArray
    """Standard deviation of the noise per approach, (2,), without what targets move by themselves;
    where it has heavy tails that of normal noise with the same quartiles. [µm or arcsec]"""
    residual_std: float
    """Residual standard deviation; divisor: readings less effective parameters. [µm or arcsec]"""
    effective_parameters: float
    """Effective number of parameters, levels and drift. [1]"""
    drift_parameters: float
    """Effective number of parameters of the drift alone. [1]"""
    weight: FloatArray
    """Weight of the readings of each target and approach in the fit, (m, 2). [1]"""
    time_s: FloatArray
    """Times of the curves, (T,); number of the reading where order served as time. [s]"""
    common: FloatArray
    """a(t) - a(t0), (T,). [µm or arcsec]"""
    common_std: FloatArray
    """Its standard uncertainty, (T,). [µm or arcsec]"""
    slope: FloatArray
    """b(t) - b(t0), (T,). [µm/mm or arcsec/deg]"""
    slope_std: FloatArray
    """Its standard uncertainty, (T,). [µm/mm or arcsec/deg]"""
    bow: FloatArray | None
    """Third function at mid-axis relative to the ends, (T,), where the axis bows. [µm or arcsec]"""
    drift: FloatArray
    """Drift of every reading relative to t0, (m, n, 2); NaN where missing. [µm or arcsec]"""
    deviation: FloatArray
    """Readings without drift, at the thermal state of t0 and on its side of every step, (m, n, 2);
    NaN where missing or an outlier. [µm or arcsec]"""
    figures: Iso230_2Figures
    """Figures by the formulas of ISO 230-2 of the readings without drift and outliers; s is
    corrected for the parameters that the drift took. They are no result of ISO 230-2.
    [µm or arcsec]"""
    figures_of_all: Iso230_2Figures | None
    """The same of all readings, the outliers too; None without outliers. [µm or arcsec]"""
    outliers: tuple[Outlier, ...]
    """Readings that lie out, and were left out of the fit; the farthest first."""
    changes: tuple[Change, ...]
    """Steps of the drift, in the order of time."""
    noise_time: float | None
    """Time in which the correlation of a part of the noise, which all positions share, falls to
    1/e; None where all of it is independent. [s, or readings where order served as time]"""
    noise_share: float
    """Share of this part in the variance of the noise. [1]"""
    suspects: tuple[int, ...]
    """Targets that drift otherwise than the model says, from 1: the model does not hold there."""
    warnings: tuple[Message, ...]
    """What the reader of the result must know."""

    @property
    def significant(self) -> bool:
        """Whether drift was found at the 1 % level."""
        return self.p_no_drift < SIGNIFICANCE

    @property
    def degrees_of_freedom(self) -> float:
        """Readings less effective parameters. [1]"""
        return float(np.sum(~np.isnan(self.drift))) - self.effective_parameters

    @property
    def total(self) -> float:
        """Common drift from the first to the last reading. [µm or arcsec]"""
        return float(self.common[-1] - self.common[0])

    @property
    def total_per_m(self) -> float:
        """Growth of the axis from the first to the last reading. [µm/m; arcsec per 1000 deg]"""
        return 1000.0 * float(self.slope[-1] - self.slope[0])

    @property
    def coverage_factor(self) -> float:
        """Standard uncertainties in the bounds of the drift: two, or three where none was found.

        Of runs with a drift that just escapes the test three hold for 92 % or more, two for 75 to
        80 %. [1]
        """
        return 2.0 if self.significant else 3.0

    @property
    def total_within(self) -> float:
        """Bound of `total`, standard uncertainties of both ends added. [µm or arcsec]"""
        return self.coverage_factor * float(self.common_std[0] + self.common_std[-1])

    @property
    def total_per_m_within(self) -> float:
        """Bound of `total_per_m`, likewise. [µm/m; arcsec per 1000 deg]"""
        return 1000.0 * self.coverage_factor * float(self.slope_std[0] + self.slope_std[-1])


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Run:
    """A run as the fit sees it."""

    readings: Readings
    index: tuple[IntArray, IntArray, IntArray]
    """Target, cycle and approach of each reading, (N,) each."""
    approaches: tuple[int, ...]
    shape_of_level: FloatArray
    """(C, L)."""
    offset: FloatArray
    """Mean of each level, subtracted from its readings against round-off, (L,). [µm or arcsec]"""
    start: float
    """Time of the first reading. [s, or number of the reading]"""
    duration: float
    """Time from the first to the last reading. [s, or readings]"""
    scale: float
    """Root mean square distance of the levels from the mean position. [mm or deg]"""
    cycles: float
    """Readings per level, in the mean. [1]"""
    resolution: float
    """Of the readings, as far as they show it. [µm or arcsec]"""
    may_bow: bool
    """Whether there are readings enough to look for a bow."""
    bow_of_level: FloatArray
    """A parabola of the position, (L,)."""
    bow: bool
    """Whether it belongs to the drift."""
    kind: AxisKind


def _bow(x: FloatArray) -> FloatArray:
    """Return a parabola, (m,), for positions with the mean zero and the root mean square one.

    It is orthogonal to a constant and a line, so that a(t) stays the mean drift.
    """
    return x**2 - 1.0 - np.mean(x**3) * x


def _with_bow(run: _Run) -> _Run:
    shape = np.vstack((run.shape_of_level, run.bow_of_level))
    readings = replace(run.readings, shape=shape[:, run.readings.level])
    return replace(run, readings=readings, shape_of_level=shape, bow=True)


def _bow_height(target: FloatArray, scale: float) -> float:
    """Return how far a unit of the parabola lies lower at mid-axis than at the ends. [1]"""
    half = 0.5 * float(target[-1] - target[0]) / scale
    return -(half**2)


def _check_readings(test: PositioningTest) -> None:
    """Refuse a run whose readings do not tell its drift from its levels."""
    place, readings, m = Place(key="drift"), int(np.sum(test.readings)), test.target.size
    require_readings(test, 2, place)
    if m < 2 or readings - m * len(test.approaches) < FEWEST_LEFT_OVER:
        raise DataError("too_few_readings", readings=readings, targets=m, place=place)
    if test.repeats_exactly:
        raise DataError("readings_repeat_exactly", place=place)


def _flatten(
    test: PositioningTest,
    *,
    whole: _Run | None = None,
    steps: tuple[Step, ...] = (),
    correlation: Correlation | None = None,
) -> _Run:
    """Return a run, or what is left of a whole one, as the fit sees it."""
    time = test.time_s if test.time_s is not None else test.order
    if time is None:
        raise DataError("no_order", key="drift")
    _check_readings(test)
    approaches = test.approaches
    i, j, a = np.nonzero(~np.isnan(test.deviation))
    m = test.target.size
    levels = m * len(approaches)
    level = np.asarray(i + m * np.searchsorted(np.array(approaches), a), dtype=np.intp)
    at = time[i, j, a]
    start, duration = float(np.min(at)), float(np.ptp(at))
    if whole is not None:
        start, duration = whole.start, whole.duration
    if not duration > 0.0:
        raise DataError("one_time", key="drift")
    scale = float(np.std(test.target))
    x = (test.target - np.mean(test.target)) / scale
    shape = np.stack((np.ones(m), x))
    cycles = i.size / levels
    value = test.deviation[i, j, a]
    offset = _means(level, value, levels)
    centred = value - offset[level]
    centred[np.abs(centred) <= _ROUND_OFF * np.max(np.abs(value))] = 0.0
    readings = Readings(
        value=centred,
        level=level,
        time=(at - start) / duration,
        shape=shape[:, i],
        weight=np.ones(i.size),
        levels=levels,
        steps=steps,
        correlation=correlation,
    )
    return _Run(
        readings=readings,
        index=(i, j, a),
        approaches=approaches,
        shape_of_level=np.tile(shape, len(approaches)),
        offset=offset,
        start=start,
        duration=duration,
        scale=scale,
        cycles=cycles,
        resolution=test.resolution,
        may_bow=m >= FEWEST_TARGETS_BOW and cycles >= FEWEST_CYCLES_BOW,
        bow_of_level=np.tile(_bow(x), len(approaches)),
        bow=False,
        kind=test.kind,
    )


def _means(level: IntArray, value: FloatArray, levels: int) -> FloatArray:
    """Return the mean of the values of each level, (L,)."""
    return sums_per(level, value, levels) / sums_per(level, np.ones(level.size), levels)


# ---- the whole evaluation -----------------------------------------------------------------------


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Estimate:
    """What is reported of the averaged fits."""

    model: DriftModel
    average: Average
    reported: Reported
    no_drift: float
    """Weight of the statement that there is no drift at all, in the bands. [1]"""
    drift: FloatArray
    """Since the first reading, (N,)."""
    residual: FloatArray
    """(N,)."""
    effective_parameters: float


def _times(run: _Run, *, seconds: bool) -> tuple[int, Sequence[tuple[float, float]]]:
    """Return the number of intervals of the splines and the times that are averaged over.

    Logarithmic time stretches the intervals at the end of the run, so it takes more of them.
    """
    wanted = int(np.clip(round(INTERVALS_PER_CYCLE * run.cycles), FEWEST_INTERVALS, MOST_INTERVALS))
    times = PLAIN_TIME if seconds and run.duration > LONGEST_WARMING_S else TIMES
    slowest = min(slowest_rate(warm_up, plain) for warm_up, plain in times)
    needed = int(np.ceil(run.duration / LONGEST_INTERVAL_S / slowest)) if seconds else 0
    return max(wanted, needed), times


def _all_sums(run: _Run, readings: Readings, *, seconds: bool) -> list[Sums]:
    intervals, times = _times(run, seconds=seconds)
    return [sums_of(readings, intervals, *time) for time in times]


def _averaged(run: _Run, readings: Readings, *, seconds: bool) -> Average:
    return average_over_smoothness(_all_sums(run, readings, seconds=seconds))


def _drift_test(run: _Run, all_sums: Sequence[Sums], *, seconds: bool) -> DriftTest:
    """Test the functions of the model, and a bow where there are enough targets.

    A step is part of the drift that is tested for.
    """
    if run.readings.steps:
        run = replace(run, readings=replace(run.readings, steps=()))
        all_sums = _all_sums(run, run.readings, seconds=seconds)
    intervals = all_sums[0].intervals
    if run.may_bow and not run.bow:
        bow = replace(run.readings, shape=run.bow_of_level[None, run.readings.level])
        all_sums = [*all_sums, sums_of(bow, intervals, *PLAIN_TIME[0])]
    return drift_test(all_sums, largest_departure(intervals))


def _hides_drift(run: _Run, average: Average) -> bool:
    """Return whether the order of visits hides a drift in the levels, as a step cycle does."""
    n = run.readings.levels
    row = rows_at(average.line.sums, np.mean(run.readings.time, keepdims=True))[0]
    _, covariance = levels_at(average.line, row, run.shape_of_level)
    still = average.line.variance * np.linalg.inv(average.line.sums.normal[:n, :n])
    return float(np.trace(covariance)) > _HIDDEN * float(np.trace(still))


def _estimate(run: _Run, tested: DriftTest, average: Average) -> _Estimate:
    readings = run.readings
    model, stated, no_drift = DriftModel.NONE, NO_DRIFT, 0.0
    parameters = float(readings.levels)
    if tested.found or readings.steps:
        parameters = effective_parameters(average)
        model = DriftModel.LINE if average.line_is_enough else DriftModel.SMOOTH
        stated = reported(average)
    elif not _hides_drift(run, average):
        no_drift = 1.0 / (1.0 + tested.bayes_factor)
    drift = stated.drift(readings, 0.0)
    without = readings.value - drift
    residual = without - _means(readings.level, without, readings.levels)[readings.level]
    return _Estimate(
        model=model,
        average=average,
        reported=stated,
        no_drift=no_drift,
        drift=drift,
        residual=residual,
        effective_parameters=parameters,
    )


def _curves(
    estimate: _Estimate, time: FloatArray, reference: float
) -> tuple[FloatArray, FloatArray]:
    """Return the reported functions relative to t0 and their root mean square error, (C, T)."""
    shapes = estimate.average.line.sums.shapes
    stated = estimate.reported.functions(shapes, time, reference)
    square = function_errors(estimate.average, stated, time, reference)
    return stated, np.sqrt((1.0 - estimate.no_drift) * square)


def _level_covariance(
    run: _Run, estimate: _Estimate, level: FloatArray, reference: float
) -> FloatArray:
    """Return the mean square error of the stated levels; `level` is relative to the offset."""
    drifting = level_errors(estimate.average, level, reference, run.shape_of_level)
    if estimate.no_drift == 0.0:
        return drifting
    sums = estimate.average.line.sums
    of_levels = np.linalg.inv(sums.normal)
    square = sums.square - float(sums.level_sum @ of_levels @ sums.level_sum)
    still = square / (sums.readings - sums.levels) * of_levels
    return (1.0 - estimate.no_drift) * drifting + estimate.no_drift * still


def _mean_time(time: FloatArray) -> float:
    """Return the mean time of readings; where it lies in a pause, the reading next to it."""
    mean, ordered = float(np.mean(time)), np.sort(time)
    after = int(np.searchsorted(ordered, mean))
    left, right = float(ordered[after - 1]), float(ordered[after])
    if (right - left) * time.size < PAUSE:
        return mean
    return left if mean - left < right - mean else right


def _reference(run: _Run, reference_time_s: float | None, *, seconds: bool) -> float:
    """Return the time of the thermal state as the run counts it, in seconds or readings."""
    end = run.start + run.duration
    if reference_time_s is None:
        return run.start + run.duration * _mean_time(run.readings.time)
    if not seconds:
        raise DataError("readings_without_times", key="reference time")
    if not min(run.start, 0.0) <= reference_time_s <= end:
        raise DataError(
            "reference_outside_run",
            reference_h=reference_time_s / 3600.0,
            end_h=end / 3600.0,
            key="reference time",
        )
    return max(reference_time_s, run.start)


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Fitted:
    run: _Run
    estimate: _Estimate
    tested: DriftTest


def _fit(
    test: PositioningTest, whole: _Run, steps: tuple[Step, ...], correlation: Correlation | None
) -> _Fitted:
    """Fit again where the axis bows, and once more with weights where the noise is unequal."""
    seconds = test.time_s is not None
    run = _flatten(test, whole=whole, steps=steps, correlation=correlation)
    while True:
        all_sums = _all_sums(run, run.readings, seconds=seconds)
        tested = _drift_test(run, all_sums, seconds=seconds)
        average = average_over_smoothness(all_sums)
        if tested.found and _bows(run, average):
            run = _with_bow(run)
            average = _averaged(run, run.readings, seconds=seconds)
        estimate = _estimate(run, tested, average)
        parameters = estimate.effective_parameters - run.readings.levels
        readings = run.readings
        weight = weights_of_levels(
            readings.level, estimate.residual, readings.levels, parameters, run.resolution
        )
        if np.all(weight == 1.0) or not np.all(run.readings.weight == 1.0):
            return _Fitted(run, estimate, tested)
        run = replace(run, readings=replace(run.readings, weight=weight[run.readings.level]))


def _bows(run: _Run, average: Average) -> bool:
    """Return whether a parabola of the position varies with time, beside the fitted functions."""
    if run.bow or not run.may_bow:
        return False
    shape = run.bow_of_level[run.readings.level]
    everything = np.zeros(shape.size, dtype=np.intp)
    return bool(apart(average.best, run.readings, everything, shape)[0] < SIGNIFICANCE)


def _off_centre(fitted: _Fitted) -> bool:
    """Return whether the centre of a rotary table moves: a wave of one turn along the angle."""
    run = fitted.run
    if run.kind is not AxisKind.ROTARY or fitted.estimate.model is DriftModel.NONE:
        return False
    angle = np.deg2rad(run.scale * run.readings.shape[1])
    if np.ptp(angle) <= np.pi:
        return False
    all_of_it, best = np.zeros(angle.size, dtype=np.intp), fitted.estimate.average.best
    p = [apart(best, run.readings, all_of_it, wave)[0] for wave in (np.sin(angle), np.cos(angle))]
    return bool(2.0 * min(p) < SIGNIFICANCE)


def _suspects(fitted: _Fitted) -> tuple[int, ...]:
    """Return the targets, from 1, that drift otherwise than the rest.

    The level of the test is 1 % for the run as a whole (Bonferroni).
    """
    readings = fitted.run.readings
    targets = readings.levels // len(fitted.run.approaches)
    if targets < FEWEST_TARGETS_ALONE:
        return ()
    own = readings.level % targets
    p = apart(fitted.estimate.average.best, readings, own, np.ones(own.size))
    return tuple((np.flatnonzero(p * targets < SIGNIFICANCE) + 1).tolist())


def _leverages(fitted: _Fitted) -> FloatArray:
    """Return how far the fit follows each reading, (N,); at the ends of a run often far."""
    readings, average = fitted.run.readings, fitted.estimate.average
    count = sums_per(readings.level, np.ones(readings.value.size), readings.levels)
    plain = 1.0 / count[readings.level]
    if fitted.estimate.model is DriftModel.NONE:
        return plain
    chosen = average.line if average.line_is_enough else average.best
    if chosen.sums.right.size * readings.value.size > _MOST_LEVERAGES:
        return plain
    return leverages_of(chosen, readings)


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Outlying:
    """How far the readings of a run lie out."""

    scaled: FloatArray
    """Residuals in units of their robust standard deviation, (N,). [1]"""
    spread: float
    """This standard deviation. [µm or arcsec]"""
    excess: FloatArray
    """The same in units of the limit, (N,): above one it is an outlier. [1]"""
    residual: FloatArray
    """Residuals from the fit without the reading, (N,). [µm or arcsec]"""
    left: FloatArray
    """What the fit leaves of each reading to its residual, (N,). [1]"""
    gain: float
    """What leaving out the worst takes from minus twice the logarithm of the likelihood; nothing
    where it is no outlier."""


def _outlying(fitted: _Fitted) -> _Outlying:
    """Return how far each reading lies out.

    The scatter of a level is judged without its farthest reading, which would hide itself.
    """
    readings = fitted.run.readings
    level, levels, residual = readings.level, readings.levels, fitted.estimate.residual
    order = np.lexsort((np.abs(residual), level))
    near = order[:-1][np.diff(level[order]) == 0]
    others = residual[near] - _means(level[near], residual[near], levels)[level[near]]
    drift_parameters = fitted.estimate.effective_parameters - levels
    resolution = fitted.run.resolution
    weight = weights_of_levels(level[near], others, levels, drift_parameters, resolution)
    left = np.maximum(1.0 - _leverages(fitted), _LEAST_LEFT)
    scaled = np.abs(residual) * np.sqrt(weight[level] / left)
    spread = np.hypot(_NORMAL_MEDIAN * np.median(scaled), resolution / 12.0**0.5)
    spread = max(float(spread), 1e-300)
    scaled /= spread
    limit = NormalDist().inv_cdf(1.0 - 0.5 * SIGNIFICANCE / residual.size)
    uncertain = 1.0 + 2.0 * levels / residual.size  # the spread and the weights are estimates
    count = sums_per(level, np.ones(residual.size), levels)
    kept = count[level] > 2.0  # no level may lose its last repetition
    excess = np.where(kept, scaled, 0.0) / (limit * uncertain)
    worst = int(np.argmax(excess))
    square = readings.weight * residual**2
    share = min(float(square[worst] / left[worst] / max(np.sum(square), 1e-300)), 1.0 - 1e-12)
    gain = -residual.size * float(np.log1p(-share)) if excess[worst] > 1.0 else 0.0
    residual = residual / left
    if fitted.estimate.model is DriftModel.SMOOTH:
        end, off, gain_of_end = outlier_at_end(readings, fitted.estimate.average)
        if kept[end] and gain_of_end > gain:
            gain, residual[end], excess = gain_of_end, off, np.zeros_like(excess)
            excess[end] = 2.0
    return _Outlying(scaled, spread, excess, residual, left, gain)


def _left_out(
    test: PositioningTest, fitted: _Fitted, outlying: _Outlying, most: int
) -> tuple[PositioningTest, list[Outlier]]:
    """Leave out what lies farthest, and what lies out about as far."""
    deviation = test.deviation.copy()
    outliers: list[Outlier] = []
    clear = max(1.0, _CLEAR * float(np.max(outlying.excess)))
    level, levels = fitted.run.readings.level, fitted.run.readings.levels
    count = sums_per(level, np.ones(level.size), levels)
    for k in np.argsort(-outlying.excess)[:most].tolist():
        if outlying.excess[k] > clear and count[level[k]] > 2.0:
            count[level[k]] -= 1.0
            i, j, a = (int(index[k]) for index in fitted.run.index)
            outliers.append(Outlier(i + 1, j + 1, a, float(outlying.residual[k])))
            deviation[i, j, a] = np.nan
    return replace(test, deviation=deviation), outliers


def _steps_left(fitted: _Fitted) -> int:
    """Return how many steps more may be looked for; none where no drift is seen."""
    run = fitted.run
    possible = run.cycles >= FEWEST_CYCLES_STEP and fitted.estimate.model is not DriftModel.NONE
    return MOST_CHANGES - len(run.readings.steps) if possible else 0


def evaluate_drift(test: PositioningTest, *, reference_time_s: float | None = None) -> DriftResult:
    """Separate the drift of a run from the levels of its targets.

    Readings that lie further from the fit than one in a hundred runs without outliers has are
    named and left out of the fit, at most 5 % of them. A step of the drift that smooth functions
    do not explain is named and becomes part of the drift.

    Parameters
    ----------
    test : PositioningTest
        The measured run, at least two cycles, with times or at least the acquisition order.
    reference_time_s : float, optional
        Time t0 of the thermal state at which levels are stated, from the first reading; also the
        side of every step on which they are. Default: the mean time of the readings. [s]

    Returns
    -------
    DriftResult
        Levels at t0 with their covariance, the drift with bands, and the readings without it.

    Raises
    ------
    DataError
        If the order of the readings is not known, there are too few of them, they repeat exactly,
        or the reference time lies outside the run.

    References
    ----------
    G. Wahba 1978 and W. Wecker and C. Ansley 1983 (smoothing splines as integrated random walks);
    H. D. Patterson and R. Thompson 1971 (restricted likelihood); G. K. Smyth 2004 (moderated
    variances); all from memory.
    """
    return evaluate_drift_at(test, (reference_time_s,))[0]


def evaluate_drift_at(
    test: PositioningTest, reference_times_s: Sequence[float | None]
) -> tuple[DriftResult, ...]:
    """Separate the drift of a run and state its levels at several thermal states.

    As `evaluate_drift`, for each of the times t0 from the first reading, None for the mean time;
    the run is fitted once. [s]
    """
    run, seconds = _flatten(test), test.time_s is not None
    references = [_reference(run, t, seconds=seconds) for t in reference_times_s]
    most = int(MOST_OUTLIERS * run.readings.value.size)
    kept, outliers, turns = test, list[Outlier](), 0
    steps: tuple[Step, ...] = ()
    correlation: Correlation | None = None
    while True:
        fitted = _fit(kept, run, steps, correlation)
        own, average, more = fitted.run, fitted.estimate.average, _steps_left(fitted)
        outlying, room = _outlying(fitted), most - len(outliers)
        averaged = partial(_averaged, own, seconds=seconds)
        found = find_step(own.readings, average, averaged) if more else None
        alike = None if correlation else find_correlation(own.readings, average)
        if alike is not None and alike.gain > max(outlying.gain, found[1] if found else 0.0):
            together, gain = find_steps(own.readings, average, averaged, more, alike.gain)
            if gain > alike.gain:
                steps = together
            else:
                correlation = alike
                steps = steps_that_hold(replace(own.readings, correlation=alike), averaged)
            kept, outliers = test, []  # what lay out in independent noise may lie well now
        elif found is not None and found[1] > outlying.gain:
            steps, turns = (*steps, found[0]), turns + 1
            if turns < MOST_TURNS:
                correlation = None  # it may be for this step alone that noise seemed correlated
            kept, outliers = test, []  # what lay out beside the step may lie well now
        elif outlying.gain > 0.0 and room > 0:
            fewer, others = _left_out(kept, fitted, outlying, room)
            if fewer.repeats_exactly:  # they are all the scatter that the run has
                break
            kept, outliers = fewer, [*outliers, *others]
        else:
            break
    outliers.sort(key=lambda outlier: -abs(outlier.residual))
    return tuple(_result(test, fitted, outlying, r, tuple(outliers)) for r in references)


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Noise:
    """What the readings scatter by, beside the drift."""

    std: FloatArray
    """Standard deviation per approach, (2,); a robust one where there are heavy tails."""
    heavy: bool
    """Whether it has heavy tails."""
    apart: bool
    """Whether targets move otherwise than the drift, which was taken out."""


def _noise(
    fitted: _Fitted,
    outlying: _Outlying,
    suspects: tuple[int, ...],
    outliers: tuple[Outlier, ...],
) -> _Noise:
    """Return the noise; a few readings that lie out are no tails."""
    run, estimate, readings = fitted.run, fitted.estimate, fitted.run.readings
    targets, parameters = readings.levels // len(run.approaches), estimate.effective_parameters
    known = 0 if estimate.model is DriftModel.NONE else readings.shape.shape[0]
    own = readings.level % targets
    p, rest, taken = moved_alone(readings, estimate.residual, own, parameters, known)
    alone = targets >= FEWEST_TARGETS_ALONE and readings.correlation is None
    apart = (alone and p < SIGNIFICANCE) or _off_centre(fitted)
    if not (apart or suspects):
        rest, taken = estimate.residual, 0.0
    residual = np.append(estimate.residual, [o.residual for o in outliers])
    left = np.append(outlying.left, np.ones(len(outliers)))
    of_outlier = [o.target - 1 + targets * run.approaches.index(o.approach) for o in outliers]
    level = np.append(readings.level, np.array(of_outlier, dtype=np.intp))
    few = max(_FEW_OUT, int(_SHARE_OUT * rest.size))
    beyond = np.abs(residual[rest.size :][few:]) / outlying.spread
    coarse = run.resolution > _COARSE * outlying.spread  # rounding heaps readings up: no tails
    gain = 0.0 if coarse else tails_of(np.append(outlying.scaled, beyond))[0]
    _, freedom = tails_of(residual / np.sqrt(left))
    std = np.full(2, np.nan)
    for at, approach in enumerate(run.approaches):
        mine = level // targets == at
        if gain > LEAST_GAIN:
            std[approach] = robust_std(residual[mine], left[mine], level[mine], freedom)
            continue
        own_rest = rest[mine[: rest.size]]
        share = (parameters + taken - readings.levels) * own_rest.size / rest.size
        std[approach] = np.sqrt(np.sum(own_rest**2) / (own_rest.size - targets - share))
    return _Noise(std=std, heavy=gain > LEAST_GAIN, apart=apart)


def _told_of_tails(noise: _Noise, outlying: _Outlying, outliers: int) -> Iterator[Message]:
    if noise.heavy:
        far, n = int(np.sum(outlying.scaled > FAR)) + outliers, outlying.scaled.size
        expected = 2.0 * n * NormalDist().cdf(-FAR)
        values = {"far": far, "readings": n, "limit": FAR, "expected": expected}
        yield Message("warning-heavy_tailed_noise", values)


def _told_of_outliers(outliers: tuple[Outlier, ...], unit: str) -> Iterator[Message]:
    for o in outliers[:_MOST_NAMED]:
        where = {"target": o.target, "approach": APPROACHES[o.approach], "cycle": o.cycle}
        values = {**where, "residual": o.residual, "unit": unit}
        yield Message("warning-outlier_left_out", values)
    if len(outliers) > _MOST_NAMED:
        yield Message("warning-more_outliers", {"count": len(outliers) - _MOST_NAMED})


def _told_of_changes(
    changes: list[tuple[Change, bool]], typical_s: float, unit: str
) -> Iterator[Message]:
    for change, sure in changes:
        when = Message("change-in_order", {"cycle": change.cycle})
        if change.time_s is not None and change.interval_s is not None:
            minutes = {"time_min": change.time_s / 60.0, "pause_min": change.interval_s / 60.0}
            paused = change.interval_s > PAUSE * typical_s
            code = "change-in_pause" if paused else "change-at"
            when = Message(code, {**minutes, "cycle": change.cycle})
        size = {"size": change.size, "within": 2.0 * change.std, "unit": unit}
        stretch = change.kind is ChangeKind.STRETCH
        code = "warning-change_stretch" if stretch else "warning-change_common"
        yield Message(code if sure else "warning-change_unsure", {"when": when, **size})


def _period(fitted: _Fitted) -> float:
    """Return the mean period of what swings beside a line in the common drift, in cycles.

    Infinite where nothing swings, or too seldom to say.

    References
    ----------
    S. O. Rice 1944: 2 pi times the root mean square over that of the derivative, from memory.
    """
    run, estimate = fitted.run, fitted.estimate
    sums = estimate.average.line.sums
    if estimate.model is not DriftModel.SMOOTH or sums.steps or sums.intervals > MOST_INTERVALS:
        return np.inf
    time: FloatArray = np.linspace(_STARTED, 1.0, 8 * sums.intervals + 1)
    swing: FloatArray = estimate.reported.functions(sums.shapes, time, 0.0)[0]
    line: FloatArray = time - 0.5 * (1.0 + _STARTED)
    tilt = float(np.sum(swing * line) / np.sum(line**2))
    swing = swing - float(np.mean(swing)) - tilt * line
    rising = (swing[1:] - swing[:-1]) / (time[1] - time[0])
    square = float(np.sum(swing**2) / np.sum(rising**2))
    period = 2.0 * np.pi * square**0.5
    return period * run.cycles if period < _OFTEN else np.inf


def _told_of_swing(test: PositioningTest, fitted: _Fitted) -> Iterator[Message]:
    period = _period(fitted)
    if period < FASTEST_SWING:
        time = period / fitted.run.cycles * fitted.run.duration
        values: dict[str, float | str] = {"time": time / 60.0, "unit": "min", "cycles": period}
        if test.time_s is None:
            values |= {"time": time, "unit": "readings"}
        yield Message("warning-swing_too_fast", values)


def _told_of_correlation(test: PositioningTest, fitted: _Fitted) -> Iterator[Message]:
    correlation = fitted.run.readings.correlation
    if correlation is not None and correlation.gain > LEAST_GAIN_SAID:
        values: dict[str, float | str] = {
            "time": correlation.length * fitted.run.duration,
            "time_unit": "readings" if test.time_s is None else "s",
            "std": float(np.sqrt(correlation.ratio * fitted.estimate.average.best.variance)),
            "unit": test.kind.units.deviation,
        }
        yield Message("warning-noise_correlated", values)


def _warnings(
    test: PositioningTest,
    fitted: _Fitted,
    suspects: tuple[int, ...],
    changes: list[tuple[Change, bool]],
    outliers: tuple[Outlier, ...],
    outlying: _Outlying,
    noise: _Noise,
) -> tuple[Message, ...]:
    named = {"targets": ", ".join(str(i) for i in suspects)}
    n, unit = fitted.run.readings.value.size, test.kind.units.deviation
    more = {"count": int(np.sum(outlying.excess > 1.0)), "most": int(MOST_OUTLIERS * n)}
    warnings = (
        (outlying.gain > 0.0, Message("warning-outliers_in_model", more)),
        (
            sum(sure for _, sure in changes) == MOST_CHANGES,
            Message("warning-most_changes", {"most": MOST_CHANGES}),
        ),
        (test.time_s is None, Message("warning-order_as_time")),
        (fitted.run.bow, Message("warning-axis_bows")),
        (_hides_drift(fitted.run, fitted.estimate.average), Message("warning-visits_hide_drift")),
        (bool(suspects), Message("warning-target_drifts_otherwise", named)),
        (noise.apart and not suspects, Message("warning-targets_drift_otherwise")),
    )
    return (
        *_told_of_correlation(test, fitted),
        *_told_of_swing(test, fitted),
        *_told_of_changes(changes, fitted.run.duration / n, unit),
        *_told_of_outliers(outliers, unit),
        *_told_of_tails(noise, outlying, len(outliers)),
        *(warning for applies, warning in warnings if applies),
    )


def _changes(test: PositioningTest, fitted: _Fitted) -> list[tuple[Change, bool]]:
    """Return all steps by their time, and whether each is sure."""
    run, estimate, steps = fitted.run, fitted.estimate, fitted.run.readings.steps
    if not steps:
        return []
    size, std = step_sizes(estimate.average, estimate.reported)
    units = (1.0, float(test.target[-1] - test.target[0]) / run.scale)
    order, timed = np.argsort(run.readings.time), test.time_s is not None
    time = run.readings.time[order]
    changes: list[tuple[Change, bool]] = []
    for e in sorted(range(len(steps)), key=lambda e: steps[e].time):
        after, unit = int(np.searchsorted(time, steps[e].time)), units[steps[e].shape]
        interval = run.duration * float(time[after] - time[after - 1])
        change = Change(
            time_s=run.start + steps[e].time * run.duration if timed else None,
            cycle=int(run.index[1][order[after]]) + 1,
            size=unit * float(size[e]),
            std=unit * float(std[e]),
            kind=tuple(ChangeKind)[steps[e].shape],
            interval_s=interval if timed else None,
        )
        changes.append((change, steps[e].sure))
    return changes


def _figures_of_all(
    test: PositioningTest,
    fitted: _Fitted,
    fraction: float,
    from_reference: FloatArray,
    outliers: tuple[Outlier, ...],
    taken: float,
) -> Iso230_2Figures:
    """Return the figures of all readings without drift, the outliers too."""
    run, estimate = fitted.run, fitted.estimate
    place = tuple(np.array([(o.target - 1, o.cycle - 1, o.approach) for o in outliers]).T)
    at = test.time_s if test.time_s is not None else test.order
    assert at is not None  # noqa: S101 - a run without order was refused
    shape = run.shape_of_level[:, place[0]]
    then = np.clip((at[place] - run.start) / run.duration, 0.0, 1.0)
    function = estimate.reported.functions(shape.shape[0], then, fraction)
    without = test.deviation.copy()
    without[run.index] -= from_reference
    without[place] -= np.sum(function * shape, axis=0)
    mean, s = mean_and_s(without)
    return figures_of(mean, s / taken**0.5)


def _result(
    test: PositioningTest,
    fitted: _Fitted,
    outlying: _Outlying,
    reference: float,
    outliers: tuple[Outlier, ...],
) -> DriftResult:
    run, estimate = fitted.run, fitted.estimate
    fraction = float(np.clip((reference - run.start) / run.duration, 0.0, 1.0))
    readings = run.readings
    at_reference = estimate.reported.functions(readings.shape.shape[0], np.array([fraction]), 0.0)
    from_reference = estimate.drift - at_reference[:, 0] @ readings.shape
    level = _means(readings.level, readings.value - from_reference, readings.levels)
    covariance = _level_covariance(run, estimate, level, fraction)
    drift_parameters = estimate.effective_parameters - readings.levels
    free = readings.value.size - estimate.effective_parameters
    time = np.linspace(0.0, 1.0, _BAND_TIMES)
    curve, curve_std = _curves(estimate, time, fraction)
    drift = np.full(test.deviation.shape, np.nan)
    drift[run.index] = from_reference
    deviation = test.deviation - drift
    mean = placed(level + run.offset, run.approaches)
    residual = estimate.residual
    square = sums_per(readings.level, residual**2, readings.levels)
    count = sums_per(readings.level, np.ones(residual.size), readings.levels)
    taken = 1.0 - drift_parameters / (readings.value.size - readings.levels)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = placed(np.sqrt(square / (count - 1.0) / taken), run.approaches)
    suspects = _suspects(fitted)
    noise = _noise(fitted, outlying, suspects, outliers)
    of_all = None
    if outliers:
        of_all = _figures_of_all(test, fitted, fraction, from_reference, outliers, taken)
    changes = _changes(test, fitted)
    weight = sums_per(readings.level, readings.weight, readings.levels) / count
    correlation = readings.correlation
    return DriftResult(
        model=estimate.model,
        p_no_drift=fitted.tested.probability,
        time_source=test.time_source,
        reference_time_s=None if test.time_s is None else reference,
        level=mean,
        level_covariance=covariance,
        level_std=placed(np.sqrt(np.diag(covariance)), run.approaches),
        noise_std=noise.std,
        residual_std=float(np.sqrt(np.sum(residual**2) / free)),
        effective_parameters=estimate.effective_parameters,
        drift_parameters=drift_parameters,
        weight=placed(weight, run.approaches),
        time_s=run.start + time * run.duration,
        common=curve[0],
        common_std=curve_std[0],
        slope=curve[1] / run.scale,
        slope_std=curve_std[1] / run.scale,
        bow=curve[2] * _bow_height(test.target, run.scale) if fitted.run.bow else None,
        drift=drift,
        deviation=deviation,
        figures=figures_of(mean, s),
        figures_of_all=of_all,
        outliers=outliers,
        changes=tuple(change for change, sure in changes if sure),
        noise_time=correlation and correlation.length * run.duration,
        noise_share=correlation.ratio / (1.0 + correlation.ratio) if correlation else 0.0,
        suspects=suspects,
        warnings=_warnings(test, fitted, suspects, changes, outliers, outlying, noise),
    )
