"""How well levels are known after drift is eliminated: four methods on generated runs.

Every run has 16 targets and two approaches, noise of 0.4 µm, a reading every 7.9 s (100 cycles
take seven hours) and a drift that is no polynomial and depends on position: two structures and
the screw warm up with time constants between a quarter of an hour and three hours, and the hall's
temperature swings. The error is that of the levels at the mean time of the run, absolute, nothing
subtracted, as a root mean square over levels and runs:

mean    plain mean of the readings of each level
chart   deviation chart of Stejskal et al. 2017, anchored at the reading of position 1 in the
        cycle nearest the mean time
model   levels of the drift model
floor   plain mean of the readings less their true drift: nothing can be better

The drift is taken as it is (x1) or scaled. Of the other runs, `bow` bends the axis by 2 µm at
mid-axis in seven hours, `target` lets one target drift the other way by 3 µm, `line` drifts by a
straight 0.6 µm over the run and by nothing else. Coverage is the share of levels inside their
95 % bands at the mean time, the first and the last reading; `noise` is the mean estimate over the
truth; `found` is the share of runs in which a drift is found, `bow` and `alone` those in which a
bow or a target that drifts by itself is named; `held` is the smallest of the three coverages in
the runs whose result does not say that the model fails.

    python benchmarks/drift_evidence.py [--seeds 200] [--cycles 5 10 30 100] [--drift x1 bow ...]
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from thermaxis.positioning import (
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

Drift = Callable[[FloatArray, FloatArray], FloatArray]


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


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Errors and coverage of drift elimination.")
    parser.add_argument("--seeds", type=int, default=200, help="seeds 0 ... (default: 200)")
    parser.add_argument("--cycles", type=int, nargs="+", default=CYCLES)
    parser.add_argument("--drift", nargs="+", default=DRIFTS, choices=DRIFTS)
    parser.add_argument("--no-head", action="store_true", help="print the lines alone")
    arguments = parser.parse_args()
    if not arguments.no_head:
        print(HEAD, flush=True)
    seconds: list[float] = []
    for kind in arguments.drift:
        for cycles in arguments.cycles:
            runs = (generated(seed, cycles, kind) for seed in range(arguments.seeds))
            rows = [evaluated(run) for run in runs]
            seconds += [row.seconds for row in rows]
            print(line_of(kind, cycles, rows), flush=True)
    print(
        f"\nErrors in µm, coverage and shares in percent; seeds 0 to {arguments.seeds - 1};"
        f" {1000.0 * float(np.median(seconds)):.0f} ms for three thermal states in the median."
    )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
