"""How well levels are known after drift is eliminated, on generated runs whose truth is known.

Every run has 16 targets and two approaches, noise of 0.4 µm and a reading every 7.9 s (100 cycles
take seven hours). The error is that of the levels at the mean time of the run, absolute, nothing
subtracted, as a root mean square over levels and runs. Coverage is the share of levels inside
their 95 % bands at the mean time, the first and the last reading. Two tables:

warm-ups    Two structures and the screw warm up with time constants between a quarter of an hour
            and three hours, and the hall's temperature swings. The drift is taken as it is (x1)
            or scaled; `bow` bends the axis by 2 µm at mid-axis in seven hours, `target` lets one
            target drift the other way by 3 µm, `line` drifts by a straight 0.6 µm over the run
            and by nothing else.
conditions  What happens to runs (`CONDITIONS`), mostly on top of a warm-up by heat conduction. No
            part of the model was developed with these runs. The model stands beside what is done
            by hand.

Ways:

mean       plain mean of the readings of each level
chart      deviation chart of Stejskal et al. 2017, anchored at the reading of position 1 in the
           cycle nearest the mean time
third      plain mean, the first third of the cycles discarded as warm-up
line       levels and one straight line in time, by least squares
reference  the forward readings of target 1, joined by straight lines in time, subtracted
model      levels of the drift model
floor      plain mean of the readings less their true drift: what knowing the drift gives to
           least squares

    python benchmarks/drift_evidence.py [--seeds 60] [--cycles 5 10 30 100] [--rows x1 bow ...]
    python benchmarks/drift_evidence.py conditions [--seeds 40] [--processes 2] [--rows ...]
"""

import argparse
import math
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np
from scipy.special import ndtr

from thermaxis.positioning import (
    Cycle,
    DriftResult,
    FloatArray,
    PositioningTest,
    TimeSource,
    evaluate_drift_at,
)
from thermaxis.quantities import AxisKind

TARGETS = 16
NOISE_UM = 0.4
STOP_S = 252.0 / 32.0
COVERAGE_FACTOR = 1.959964
DRIFTS = ("x1", "x0.1", "x0.05", "x0.02", "x0", "line", "bow", "target")
CYCLES = (5, 10, 30, 100)
FEWER = {30: 4, 100: 8}
"""By how much the runs of so many cycles are fewer, as each takes longer. [1]"""

Drift = Callable[[FloatArray, FloatArray], FloatArray]
Result = TypeVar("Result")


@dataclass(frozen=True)
class Run:
    """A generated run with its truth."""

    test: PositioningTest
    time_s: FloatArray
    level: FloatArray
    drift: Drift

    def levels_at(self, time_s: float) -> FloatArray:
        """Return the true levels at a time, (m, 2). [µm]"""
        return self.level + self.drift(np.array(time_s), self.test.target)[:, None]


def warming(rng: np.random.Generator, middle_mm: float) -> Drift:
    """Return a drift of several µm that is no polynomial and depends on position."""
    common = rng.uniform(3.0, 8.0, 2) * np.array([1.0, -1.0]) * rng.choice([-1.0, 1.0])
    tau_s = 3600.0 * np.array([rng.uniform(0.25, 0.8), rng.uniform(0.8, 3.0)])
    growth = rng.uniform(0.010, 0.030) * rng.choice([-1.0, 1.0])
    growth_tau_s = 3600.0 * rng.uniform(0.3, 2.0)
    swing_um, phase = rng.uniform(0.2, 0.8), rng.uniform(0.0, 2.0 * np.pi)

    def drift(t: FloatArray, position: FloatArray) -> FloatArray:
        one = common[0] * (1.0 - np.exp(-t / tau_s[0])) + common[1] * (1.0 - np.exp(-t / tau_s[1]))
        swing = swing_um * np.sin(2.0 * np.pi * t / (5.0 * 3600.0) + phase)
        slope = growth * (1.0 - np.exp(-t / growth_tau_s))
        return np.asarray(one + swing + slope * (position - middle_mm), dtype=np.float64)

    return drift


def drift_of_kind(
    kind: str, rng: np.random.Generator, target: FloatArray, duration_s: float
) -> Drift:
    """Return the drift of a run, by its name in the table."""
    middle, half = float(np.mean(target)), 0.5 * float(np.ptp(target))
    warm = warming(rng, middle)
    odd = target[int(rng.integers(2, target.size - 2))]

    def scaled(t: FloatArray, p: FloatArray) -> FloatArray:
        return float(kind[1:]) * warm(t, p)

    def line(t: FloatArray, p: FloatArray) -> FloatArray:
        return 0.6 * t / duration_s + 0.0 * p

    def bow(t: FloatArray, p: FloatArray) -> FloatArray:
        return warm(t, p) + 2.0 * t / (7.0 * 3600.0) * (1.0 - ((p - middle) / half) ** 2)

    def alone(t: FloatArray, p: FloatArray) -> FloatArray:
        return warm(t, p) - 3.0 * np.tanh(t / 3600.0) * (p == odd)

    return {"line": line, "bow": bow, "target": alone}.get(kind, scaled)


def generated(seed: int, cycles: int, kind: str = "x1") -> Run:
    """Return a run of the standard cycle with its truth."""
    rng = np.random.default_rng(seed)
    target = 20.0 * np.arange(TARGETS) + rng.uniform(-4.0, 4.0, TARGETS)
    drift = drift_of_kind(kind, rng, target, STOP_S * (2 * TARGETS * cycles - 1))
    level = rng.normal(0.0, 3.0, (TARGETS, 2))
    up = np.arange(TARGETS)
    visit = np.stack((up, 2 * TARGETS - 1 - up), axis=1)
    number = visit[:, None, :] + 2.0 * TARGETS * np.arange(cycles)[None, :, None]
    time_s = STOP_S * number
    deviation = level[:, None, :] + drift(time_s, target[:, None, None])
    test = PositioningTest(
        kind=AxisKind.LINEAR,
        target=target,
        deviation=deviation + NOISE_UM * rng.normal(size=deviation.shape),
        time_source=TimeSource.FILE,
        time_s=time_s,
        order=number + 1.0,
    )
    return Run(test, time_s, level, drift)


def chart_levels(run: Run, time_s: float) -> FloatArray:
    """Return the paper's chart, anchored in the cycle nearest a time, (m, 2). [µm]"""
    x = run.test.deviation
    cycle = int(np.argmin(np.abs(np.mean(run.time_s, axis=(0, 2)) - time_s)))
    mean = np.mean(x, axis=1)
    return np.asarray(x[0, cycle] + mean - mean[0], dtype=np.float64)


def floor_levels(run: Run, time_s: float) -> FloatArray:
    """Return the plain means of the readings less their true drift, (m, 2). [µm]"""
    position = run.test.target
    mean = np.mean(run.test.deviation - run.drift(run.time_s, position[:, None, None]), axis=1)
    return np.asarray(mean + run.drift(np.array(time_s), position)[:, None], dtype=np.float64)


@dataclass(frozen=True)
class Row:
    """What one run gave."""

    square: tuple[float, float, float, float]
    """Mean square error of mean, chart, model and floor. [µm²]"""
    inside: tuple[float, float, float]
    """Share of levels inside their bands: mean time, first and last reading. [1]"""
    noise: float
    found: bool
    bow: bool
    alone: bool
    seconds: float


def inside(result: DriftResult, truth: FloatArray) -> float:
    """Return the share of levels inside their 95 % bands. [1]"""
    return float(np.mean(np.abs(result.level - truth) <= COVERAGE_FACTOR * result.level_std))


def evaluated(run: Run) -> Row:
    """Evaluate one run in all ways."""
    end_s = float(np.max(run.time_s))
    since = time.perf_counter()
    results = evaluate_drift_at(run.test, (None, 0.0, end_s))
    seconds = time.perf_counter() - since
    t0 = float(np.mean(run.time_s))
    truth = run.levels_at(t0)
    ways = (
        np.mean(run.test.deviation, axis=1),
        chart_levels(run, t0),
        results[0].level,
        floor_levels(run, t0),
    )
    square = [float(np.mean((way - truth) ** 2)) for way in ways]
    covered = [
        inside(result, run.levels_at(t))
        for result, t in zip(results, (t0, 0.0, end_s), strict=True)
    ]
    return Row(
        square=(square[0], square[1], square[2], square[3]),
        inside=(covered[0], covered[1], covered[2]),
        noise=float(np.sqrt(np.mean(results[0].noise_std ** 2))) / NOISE_UM,
        found=results[0].significant,
        bow=results[0].bow is not None,
        alone=bool(results[0].suspects),
        seconds=seconds,
    )


def line_of(kind: str, cycles: int, rows: list[Row]) -> str:
    """Return a line of the table."""
    mean, chart, model, floor = np.sqrt(np.mean([row.square for row in rows], axis=0))
    covered = 100.0 * np.mean([row.inside for row in rows], axis=0)
    unsaid = [row.inside for row in rows if not row.alone]
    held = 100.0 * float(np.min(np.mean(unsaid, axis=0))) if unsaid else np.nan
    found, bow, alone = (
        100.0 * float(np.mean([getattr(row, name) for row in rows]))
        for name in ("found", "bow", "alone")
    )
    noise = float(np.mean([row.noise for row in rows]))
    cells = (
        f"{cycles}",
        kind,
        *(f"{value:.3f}" for value in (mean, chart, model, floor)),
        f"{model / floor:.3f}",
        f"{model / chart:.3f}",
        *(f"{value:.1f}" for value in covered),
        "-" if np.isnan(held) else f"{held:.1f}",
        f"{noise:.3f}",
        *(f"{value:.1f}" for value in (found, bow, alone)),
    )
    return "| " + " | ".join(cells) + " |"


HEAD = (
    "| cycles | drift | mean | chart | model | floor | model/floor | model/chart | t0 | first |"
    " last | held | noise | found | bow | alone |\n"
    "|---:|---|" + "---:|" * 14
)


# ---- conditions ---------------------------------------------------------------------------------

PERIODS_MIN = (10, 15, 20, 30, 40)
CONDITIONS: dict[str, tuple[int, ...]] = {
    "warm-up": CYCLES,
    **{f"hall {period} min": CYCLES for period in PERIODS_MIN},
    **{f"warm-up, hall {period} min": (10, 100) for period in (10, 20, 40)},
    "pump": (10, 30),
    "step": CYCLES,
    "re-datum": (10, 30),
    "hot zone": (10, 30),
    "two local targets": (10, 30),
    "heavy tails": (10, 30),
    "one outlier": (10, 30),
    "turbulence": (10, 30),
    "pause": (10, 30),
    "minutes": (10, 30),
    "missing readings": (10, 30),
    "pilgrim": (10, 30),
    "unidirectional": (10, 30),
    "rotary": (10, 30),
    "rotary, centre moves": (10, 30),
}
"""Conditions with the cycles of their runs."""
HEAVY_FREEDOM = 3
HEAVY_SCALE_UM = NOISE_UM / math.sqrt(HEAVY_FREEDOM / (HEAVY_FREEDOM - 2.0))
"""Of Student's t, whose standard deviation is then that of the noise."""
HEAVY_ROBUST_UM = 1.4826 * 0.76489 * HEAVY_SCALE_UM
"""Median of its absolute values, as a standard deviation. [µm]"""


def conducted(t: FloatArray, tau_s: float, depth: float) -> FloatArray:
    """Return how warm a plate is at a depth after its surface has become warmer by one. [1]

    Heat conduction; depth 0 is the surface, 1 the insulated back, tau the slowest time constant:
    1 - sum over odd k of 4 / (k pi) sin(k pi depth / 2) exp(-k^2 t / tau).
    """
    k = 2.0 * np.arange(30) + 1.0
    share = 4.0 / (np.pi * k) * np.sin(0.5 * np.pi * k * depth)
    later = np.maximum(np.asarray(t), 0.0)[..., None]
    return np.asarray(1.0 - np.exp(-(k**2) * later / tau_s) @ share, dtype=np.float64)


def warm_up(rng: np.random.Generator, target: FloatArray) -> Drift:
    """Return the drift of two castings against each other and of a screw with a fixed bearing."""
    sign, growth_sign = rng.choice([-1.0, 1.0], 2)
    size_um = sign * np.array([rng.uniform(3.0, 6.0), -rng.uniform(1.0, 4.0)])
    tau_s = 60.0 * np.array([rng.uniform(10.0, 30.0), rng.uniform(40.0, 150.0)])
    depth = rng.uniform(0.3, 1.0, 3)
    growth, growth_tau_s = growth_sign * rng.uniform(0.008, 0.020), 60.0 * rng.uniform(15.0, 60.0)
    bearing_mm = float(target[0]) - 40.0

    def drift(t: FloatArray, p: FloatArray) -> FloatArray:
        castings = size_um[0] * conducted(t, tau_s[0], depth[0])
        castings = castings + size_um[1] * conducted(t, tau_s[1], depth[1])
        return castings + growth * conducted(t, growth_tau_s, depth[2]) * (p - bearing_mm)

    return drift


def disturbance(
    name: str, rng: np.random.Generator, target: FloatArray, time_s: FloatArray
) -> Drift:
    """Return what a condition adds to the drift."""
    at_s = rng.uniform(0.2, 0.8) * float(np.nanmax(time_s))
    starts_s = np.nanmin(time_s, axis=(0, 2))
    restart_s = starts_s[int(np.clip(np.searchsorted(starts_s, at_s), 1, starts_s.size - 1))]
    sign, other_sign = rng.choice([-1.0, 1.0], 2)
    centre_mm = float(rng.uniform(target[5], target[-6]))
    first, second = (target[k] for k in rng.choice(np.arange(1, TARGETS - 1), 2, replace=False))
    phase, tau_s, depth = rng.uniform(0.0, 2.0 * np.pi), 60.0 * rng.uniform(15.0, 40.0), 0.5
    period_s = 60.0 * float(name.split()[-2]) if name.endswith(" min") else math.inf

    def hall(t: FloatArray, p: FloatArray) -> FloatArray:
        return np.sin(2.0 * np.pi * t / period_s + phase) + 0.0 * p

    def pump(t: FloatArray, p: FloatArray) -> FloatArray:
        return -sign * 4.0 * np.expm1(-np.maximum(t - at_s, 0.0) / 180.0) + 0.0 * p

    def step(t: FloatArray, p: FloatArray) -> FloatArray:
        return sign * 3.0 * (t >= at_s) + 0.0 * p

    def re_datum(t: FloatArray, p: FloatArray) -> FloatArray:
        return sign * 2.0 * (t >= restart_s) + 0.0 * p

    def hot_zone(t: FloatArray, p: FloatArray) -> FloatArray:
        return sign * 8.0 * conducted(t, tau_s, depth) * ndtr((p - centre_mm) / 30.0)

    def local(t: FloatArray, p: FloatArray) -> FloatArray:
        return 3.0 * conducted(t, tau_s, depth) * (sign * (p == first) + other_sign * (p == second))

    def centre(t: FloatArray, p: FloatArray) -> FloatArray:
        return 2.0 * conducted(t, tau_s, depth) * np.sin(np.deg2rad(p) + phase)

    def nothing(t: FloatArray, p: FloatArray) -> FloatArray:
        return 0.0 * t + 0.0 * p

    if name.endswith(" min"):
        return hall
    return {
        "pump": pump,
        "step": step,
        "re-datum": re_datum,
        "hot zone": hot_zone,
        "two local targets": local,
        "rotary, centre moves": centre,
    }.get(name, nothing)


def standard_numbers(cycles: int) -> FloatArray:
    """Return the number of every reading in acquisition order, from 0, (m, n, 2)."""
    up = np.arange(TARGETS)
    visit = np.stack((up, 2 * TARGETS - 1 - up), axis=1)
    return visit[:, None, :] + 2.0 * TARGETS * np.arange(cycles)[None, :, None]


def pilgrim_numbers(cycles: int) -> FloatArray:
    """Return the same for windows of n targets, forward and back, each one target further on."""
    number = np.full((TARGETS, cycles, 2), np.nan)
    visited = 0
    for start in range(1 - cycles, TARGETS):
        window = range(max(start, 0), min(start + cycles, TARGETS))
        for approach, stops in enumerate((window, reversed(window))):
            for i in stops:
                number[i, i - start, approach] = visited
                visited += 1
    return number


def noise_of(name: str, rng: np.random.Generator, number: FloatArray) -> FloatArray:
    """Return the noise of the readings, by their number, (m, n, 2). [µm]"""
    white = rng.normal(size=number.shape)
    if name == "heavy tails":
        return HEAVY_SCALE_UM * rng.standard_t(HEAVY_FREEDOM, number.shape)
    if name == "turbulence":  # half of the variance with a correlation of exp(-t / 60 s)
        kept = math.exp(-STOP_S / 60.0)
        air = rng.normal(size=number.size)
        for k in range(1, air.size):
            air[k] = kept * air[k - 1] + math.sqrt(1.0 - kept**2) * air[k]
        white = math.sqrt(0.5) * (white + air[number.astype(int)])
    noise = NOISE_UM * white
    if name == "one outlier":
        hit = tuple(rng.integers(noise.shape))
        noise[hit] += 5.0 * rng.choice([-1.0, 1.0])
    return noise


def conditioned(name: str, seed: int, cycles: int) -> Run:
    """Return a run under a condition, with its truth."""
    rng = np.random.default_rng([seed, cycles])
    target = 20.0 * np.arange(TARGETS) + rng.uniform(-4.0, 4.0, TARGETS)
    kind = AxisKind.LINEAR
    if name.startswith("rotary"):
        kind, target = AxisKind.ROTARY, 22.0 * np.arange(TARGETS) + rng.uniform(-4.0, 4.0, TARGETS)
    level = rng.normal(0.0, 3.0, (TARGETS, 2))
    number = pilgrim_numbers(cycles) if name == "pilgrim" else standard_numbers(cycles)
    time_s = STOP_S * number
    if name == "unidirectional":  # stops of twice the time; the way back is quick
        time_s[..., 0] = 2.0 * STOP_S * (np.arange(TARGETS)[:, None] + TARGETS * np.arange(cycles))
        time_s[..., 1] = level[:, 1] = np.nan
    if name == "pause":
        time_s[:, int(rng.integers(0.3 * cycles, 0.7 * cycles)) :] += 1200.0
    warm, added = warm_up(rng, target), disturbance(name, rng, target, time_s)

    def drift(t: FloatArray, p: FloatArray) -> FloatArray:
        return added(t, p) if name.startswith("hall") else warm(t, p) + added(t, p)

    deviation = level[:, None, :] + drift(time_s, target[:, None, None])
    deviation = deviation + noise_of(name, rng, number)
    if name == "missing readings":
        lost = rng.uniform(size=deviation.shape) < 0.1
        lost[:, :2] = False  # every level keeps two readings
        deviation[lost] = np.nan
    test = PositioningTest(
        kind=kind,
        target=target,
        deviation=deviation,
        time_source=TimeSource.FILE,
        time_s=60.0 * np.floor(time_s / 60.0) if name == "minutes" else time_s,
        order=number + 1.0,
        cycle=Cycle.PILGRIM if name == "pilgrim" else Cycle.STANDARD,
    )
    return Run(test, np.where(np.isnan(deviation), np.nan, time_s), level, drift)


def repeatability(level: FloatArray, s: FloatArray) -> float:
    """Return R of ISO 230-2. [µm]"""
    reversal = np.abs(level[:, 0] - level[:, 1])
    each = np.stack((4.0 * s[:, 0], 4.0 * s[:, 1], 2.0 * (s[:, 0] + s[:, 1]) + reversal))
    return float(np.nanmax(each))


def by_hand(run: Run, t0: float) -> dict[str, FloatArray]:
    """Return the readings at the thermal state of t0, by what is done by hand, (m, n, 2) each."""
    x, t, p = run.test.deviation, run.time_s, run.test.target
    earlier, later = t - np.nanmean(t, axis=1, keepdims=True), t - t0
    rate = np.nansum(earlier * (x - np.nanmean(x, axis=1, keepdims=True))) / np.nansum(earlier**2)
    seen = ~np.isnan(x[0, :, 0])
    returns_s, returned = t[0, seen, 0], x[0, seen, 0]
    known = run.drift(t, p[:, None, None]) - run.drift(np.array(t0), p)[:, None, None]
    return {
        "floor": x - known,
        "line": x - rate * later,
        "reference": x - np.interp(t, returns_s, returned) + np.interp(t0, returns_s, returned),
        "third": x[:, math.ceil(x.shape[1] / 3) :],
        "mean": x,
    }


WAYS = ("floor", "model", "line", "reference", "third", "mean")
DOES_NOT_HOLD = {
    "warning-target_drifts_otherwise",
    "warning-targets_drift_otherwise",
    "warning-heavy_tailed_noise",
    "warning-noise_correlated",
}
"""Warnings which say that the drift is not that of the model, or the noise not normal and
independent."""


@dataclass(frozen=True)
class Outcome:
    """What one run under a condition gave."""

    square: tuple[float, ...]
    """Mean square error of the levels, by way. [µm²]"""
    repeatability: tuple[float, ...]
    """Error of R, by way. [µm]"""
    inside: tuple[float, float, float]
    """Share of levels inside their bands: mean time, first and last reading. [1]"""
    said: bool
    found: bool
    noise_um: float
    outlier: bool
    change: bool
    alone: bool
    seconds: float


def covered(result: DriftResult, truth: FloatArray) -> float:
    """Return the share of measured levels inside their 95 % bands. [1]"""
    measured = ~np.isnan(truth)
    error = np.abs(result.level - truth)[measured]
    return float(np.mean(error <= COVERAGE_FACTOR * result.level_std[measured]))


def judged(name: str, cycles: int, seed: int) -> Outcome:
    """Evaluate one run under a condition in all ways."""
    warnings.simplefilter("ignore", RuntimeWarning)  # an approach that was not measured
    run = conditioned(name, seed, cycles)
    stated_s = np.where(np.isnan(run.test.deviation), np.nan, run.test.time_s)
    since = time.perf_counter()
    results = evaluate_drift_at(run.test, (None, float(np.nanmin(stated_s)), np.nanmax(stated_s)))
    seconds = time.perf_counter() - since
    t0 = results[0].reference_time_s + float(np.nanmean(run.time_s - stated_s))
    times = (t0, float(np.nanmin(run.time_s)), float(np.nanmax(run.time_s)))
    truth = run.levels_at(t0)
    readings = by_hand(run, t0)
    levels = {way: np.nanmean(x, axis=1) for way, x in readings.items()}
    levels["model"] = results[0].level
    figures = {
        way: repeatability(levels[way], np.nanstd(x, axis=1, ddof=1)) for way, x in readings.items()
    }
    own = results[0].figures
    figures["model"] = float(own.R_forward if run.test.unidirectional else own.R)
    true_figure = repeatability(truth, np.full(truth.shape, NOISE_UM))
    inside = [covered(r, run.levels_at(t)) for r, t in zip(results, times, strict=True)]
    return Outcome(
        square=tuple(float(np.nanmean((levels[way] - truth) ** 2)) for way in WAYS),
        repeatability=tuple(figures[way] - true_figure for way in WAYS),
        inside=(inside[0], inside[1], inside[2]),
        said=any(warning.code in DOES_NOT_HOLD for warning in results[0].warnings),
        found=results[0].significant,
        noise_um=float(np.sqrt(np.nanmean(results[0].noise_std ** 2))),
        outlier=bool(results[0].outliers),
        change=bool(results[0].changes),
        alone=bool(results[0].suspects),
        seconds=seconds,
    )


ERROR_HEAD = (
    "| condition | cycles | runs | floor | model | line | reference | third | mean |"
    " R: floor | model | line | reference | third | mean |\n|---|" + "---:|" * 14
)
SAID_HEAD = (
    "| condition | cycles | runs | t0 | first | last | held | said | found | noise | outlier |"
    " change | alone |\n|---|" + "---:|" * 12
)


def lines_of_condition(name: str, cycles: int, rows: list[Outcome]) -> tuple[str, str]:
    """Return the lines of both tables: errors, and what is said."""
    errors = np.sqrt(np.mean([row.square for row in rows], axis=0))
    figures = np.sqrt(np.mean(np.square([row.repeatability for row in rows]), axis=0))
    cells = [f"{value:.3f}" for value in errors] + [f"{value:.2f}" for value in figures]
    if name == "pilgrim":  # its first target is not returned to
        cells[WAYS.index("reference")] = cells[len(WAYS) + WAYS.index("reference")] = "-"
    silent = [row.inside for row in rows if not row.said]
    held = f"{100.0 * float(np.min(np.mean(silent, axis=0))):.0f}" if silent else "-"
    scale_um = HEAVY_ROBUST_UM if name == "heavy tails" else NOISE_UM
    shares = np.mean([(r.said, r.found, r.outlier, r.change, r.alone) for r in rows], axis=0)
    says, found, *named = (f"{100.0 * share:.0f}" for share in shares)
    noise = float(np.mean([row.noise_um for row in rows])) / scale_um
    inside = (f"{100.0 * share:.1f}" for share in np.mean([row.inside for row in rows], axis=0))
    said = (*inside, held, says, found, f"{noise:.3f}", *named)
    first = (name, str(cycles), str(len(rows)))
    return "| " + " | ".join((*first, *cells)) + " |", "| " + " | ".join((*first, *said)) + " |"


# ---- tables -------------------------------------------------------------------------------------


def over_seeds(judge: Callable[[int], Result], seeds: int, processes: int) -> list[Result]:
    """Return what every seed gives, in their order."""
    if processes == 1:
        return [judge(seed) for seed in range(seeds)]
    with ProcessPoolExecutor(processes) as pool:
        return list(pool.map(judge, range(seeds), chunksize=max(1, seeds // (8 * processes))))


def warm_up_table(arguments: argparse.Namespace) -> Iterator[str]:
    """Yield the lines of the table of warm-ups."""
    yield HEAD
    seconds: list[float] = []
    seeds = arguments.seeds or 60
    for kind in arguments.rows or DRIFTS:
        for cycles in arguments.cycles or CYCLES:
            judge = partial(evaluated_seed, kind, cycles)
            rows = over_seeds(judge, seeds // FEWER.get(cycles, 1), arguments.processes)
            seconds += [row.seconds for row in rows]
            yield line_of(kind, cycles, rows)
    yield (
        f"\nErrors in µm, coverage and shares in percent; seeds 0 to {seeds - 1}, of 30 cycles a"
        " quarter and of 100 an eighth of them;"
        f" {1000.0 * float(np.median(seconds)):.0f} ms for three thermal states in the median."
    )


def evaluated_seed(kind: str, cycles: int, seed: int) -> Row:
    return evaluated(generated(seed, cycles, kind))


def condition_tables(arguments: argparse.Namespace) -> Iterator[str]:
    """Yield the lines of both tables of conditions."""
    yield ERROR_HEAD
    seconds: list[float] = []
    said: list[str] = []
    for name in arguments.rows or CONDITIONS:
        for cycles in arguments.cycles or CONDITIONS[name]:
            seeds = (arguments.seeds or 40) // FEWER.get(cycles, 1)
            rows = over_seeds(partial(judged, name, cycles), seeds, arguments.processes)
            seconds += [row.seconds for row in rows]
            errors, last = lines_of_condition(name, cycles, rows)
            said.append(last)
            yield errors
    yield from ("", SAID_HEAD, *said)
    yield (
        f"\nErrors in µm (rotary: arcsec), coverage and shares in percent; seeds from 0;"
        f" {1000.0 * float(np.median(seconds)):.0f} ms for three thermal states in the median."
    )


TABLES: dict[str, tuple[Callable[[argparse.Namespace], Iterator[str]], Iterable[str]]] = {
    "warm-ups": (warm_up_table, DRIFTS),
    "conditions": (condition_tables, CONDITIONS),
}


def main() -> int:
    """Print a table."""
    parser = argparse.ArgumentParser(description="Errors and coverage of drift elimination.")
    parser.add_argument("table", nargs="?", default="warm-ups", choices=TABLES)
    parser.add_argument("--seeds", type=int, help="runs of each row (default: as in the docs)")
    parser.add_argument("--cycles", type=int, nargs="+")
    parser.add_argument("--rows", nargs="+", help="names of rows (default: all)")
    parser.add_argument("--processes", type=int, default=1)
    arguments = parser.parse_args()
    table, known = TABLES[arguments.table]
    unknown = set(arguments.rows or ()) - set(known)
    if unknown:
        parser.error(f"no such row: {', '.join(sorted(unknown))}; there are: {', '.join(known)}")
    for line in table(arguments):
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
