"""How often steps are found where there are some and where there are none, and outliers too.

Runs of a standard cycle, a reading every 7.9 s, noise of 0.4 µm. Without a step: silent runs of
several sizes, also quantised to the noise, and drifts that are no step: `warm-up` (two structures,
time constants of 10 to 60 minutes), `hall` (1 µm, periods of 20 to 40 minutes), `pump` (4 µm with
a time constant of 3 minutes, from the middle of the run on), `pause` (20 minutes in a warm-up),
`tails` (t with 3 degrees of freedom), `outlier` (5 µm, one reading), `coarse` (quantised to the
noise), `turbulence` (half of the variance is air with a correlation of 60 s; in a warm-up). With a
step at a random place: `step` (3 µm, all targets, in a warm-up), `datum` (2 µm between two cycles),
`stretch` (4 µm at the ends against each other), `first` and `last` (3 µm in the first or the last
cycle), `in pause` (3 µm in a pause of 20 minutes), `in turbulence` (3 µm in turbulence), `stairs`
(four of 2 µm in one direction, at least ten readings apart).

    python benchmarks/drift_changes.py [--runs 100] [--drift step pump ...] [--size 16x10 ...]

`any` is the share of runs with a change, `right` of those with the steps alone, each in its
interval or a neighbouring one, `size` of those (right) whose size is within two standard
uncertainties,
`covered` the share of levels at t0 within their 95 % bands, `error` the root mean square error
of the levels, `floor` that of the plain means less their true drift, `out` the share of runs in
which an outlier is named that is none.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from thermaxis.positioning import FloatArray, PositioningTest, TimeSource, evaluate_drift
from thermaxis.quantities import AxisKind

STOP_S = 252.0 / 32.0
NOISE_UM = 0.4
SILENT = ("silent", "coarse", "tails", "outlier")
SMOOTH = ("warm-up", "hall", "pump", "pause", "turbulence")
STEPS = ("step", "datum", "stretch", "first", "last", "in pause", "in turbulence", "stairs")


@dataclass(frozen=True)
class Run:
    """A generated run with its truth."""

    test: PositioningTest
    t0_s: float
    levels_at_t0: FloatArray
    """(m, 2). [µm]"""
    drift: FloatArray
    """Relative to t0, (m, n, 2). [µm]"""
    steps_s: list[float]
    size_um: float
    spoilt: tuple[int, ...]
    """Target, cycle and approach of the outlier, from 0; empty without."""


def smooth_drift(kind: str, rng: np.random.Generator, t: FloatArray, x: FloatArray) -> FloatArray:
    """Return a drift without steps at times and places from -1 to 1 along the axis."""
    if kind == "hall":
        period_s = 60.0 * rng.uniform(20.0, 40.0)
        return np.sin(2.0 * np.pi * t / period_s + rng.uniform(0.0, 6.3)) + 0.0 * x
    if kind == "pump":
        since = np.maximum(t - rng.uniform(0.2, 0.7) * np.max(t), 0.0)
        return -4.0 * np.expm1(-since / 180.0) + 0.0 * x
    sizes, tau_s = rng.uniform(1.0, 6.0, 2), 60.0 * rng.uniform(10.0, 60.0, 2)
    growth = rng.uniform(-3.0, 3.0) * x * -np.expm1(-t / (60.0 * rng.uniform(15.0, 120.0)))
    return growth - sizes[0] * np.expm1(-t / tau_s[0]) + sizes[1] * np.expm1(-t / tau_s[1])


def turbulent(independent: FloatArray, number: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return noise of which half of the variance has a correlation of 60 s."""
    air, keep = rng.normal(size=number.size), np.exp(-STOP_S / 60.0)
    for k in range(1, air.size):
        air[k] = keep * air[k - 1] + np.sqrt(1.0 - keep**2) * air[k]
    return np.sqrt(0.5) * (independent + air[number.astype(int)])


def mean_time(time_s: FloatArray) -> float:
    """Return the mean time, or the nearest reading where that lies in a pause. [s]"""
    mean, ordered = np.mean(time_s), np.sort(time_s.ravel())
    nearest = ordered[np.argmin(np.abs(ordered - mean))]
    return float(mean if abs(nearest - mean) < 60.0 else nearest)


def generated(kind: str, targets: int, cycles: int, seed: int) -> Run:
    """Return a run with its truth."""
    rng = np.random.default_rng(seed)
    up = np.arange(targets)
    visit = np.stack((up, 2 * targets - 1 - up), axis=1)
    number = visit[:, None, :] + 2.0 * targets * np.arange(cycles)[None, :, None]
    time_s = STOP_S * number
    total = time_s.size
    if "pause" in kind:
        paused_s = STOP_S * (rng.integers(total // 4, 3 * total // 4) - 0.5)
        time_s = time_s + 1200.0 * (time_s > paused_s)
    place = {"first": rng.integers(5, 2 * targets), "last": -rng.integers(5, 2 * targets)}
    place |= {"datum": 2 * targets * rng.integers(1, cycles)}
    after = int(place.get(kind, rng.integers(total // 10, 9 * total // 10))) % total
    ordered = np.sort(time_s.ravel())
    step_s = 0.5 * float(ordered[after - 1] + ordered[after])
    if kind == "in pause":
        step_s = float(ordered[np.argmax(np.diff(ordered))]) + 600.0
    steps_s = [step_s] if kind in STEPS else []
    if kind == "stairs":
        places = 10 * (1 + rng.choice(total // 10 - 1, 4, replace=False))
        steps_s = [STOP_S * (float(at) - 0.5) for at in np.sort(places)]
    x = np.linspace(-1.0, 1.0, targets)
    size = {"datum": 2.0, "stretch": 4.0, "stairs": 2.0}.get(kind, 3.0) * rng.choice([-1.0, 1.0])
    shape = 0.5 * x if kind == "stretch" else np.ones(targets)

    t0 = mean_time(time_s)
    both = np.append(time_s.reshape(targets, -1), np.full((targets, 1), t0), axis=1)
    drift = np.zeros_like(both)
    if kind not in SILENT:
        drift += smooth_drift(kind, rng, both, x[:, None])
    for at_s in steps_s:
        drift += size * shape[:, None] * (both > at_s + 1e-3)
    level = rng.normal(0.0, 3.0, (targets, 2)) + drift[:, -1:]
    drift = (drift[:, :-1] - drift[:, -1:]).reshape(time_s.shape)
    noise = rng.normal(size=time_s.shape)
    if kind == "tails":
        noise = rng.standard_t(3.0, time_s.shape)
    if "turbulence" in kind:
        noise = turbulent(noise, number, rng)
    deviation = level[:, None, :] + drift + NOISE_UM * noise
    spoilt: tuple[int, ...] = ()
    if kind == "outlier":
        spoilt = tuple(int(k) for k in (rng.integers(targets), rng.integers(cycles), 0))
        deviation[spoilt] += 5.0
    if kind == "coarse":
        deviation = NOISE_UM * np.round(deviation / NOISE_UM)
    test = PositioningTest(
        kind=AxisKind.LINEAR,
        target=20.0 * up + rng.uniform(-4.0, 4.0, targets),
        deviation=deviation,
        time_source=TimeSource.FILE,
        time_s=time_s,
        order=number + 1.0,
    )
    return Run(test, t0, level, drift, steps_s, size, spoilt)


def judged(run: Run) -> tuple[float, ...]:
    """Return any, right, size, covered, squared error, squared floor, wrong outlier, missed."""
    result = evaluate_drift(run.test, reference_time_s=run.t0_s)
    right = within = np.nan
    if run.steps_s:
        ordered = np.sort(run.test.time_s.ravel())
        found = [c for c in result.changes if c.time_s is not None]
        true, named = (
            np.searchsorted(ordered, times) for times in (run.steps_s, [c.time_s for c in found])
        )
        right = float(len(found) == len(true) and bool(np.all(np.abs(named - true) <= 1)))
        if right:
            within = float(np.mean([abs(c.size - run.size_um) < 2.0 * c.std for c in found]))
    error = result.level - run.levels_at_t0
    floor = np.mean(run.test.deviation - run.drift, axis=1) - run.levels_at_t0
    named = {(o.target - 1, o.cycle - 1, o.approach) for o in result.outliers}
    return (
        float(bool(result.changes)),
        right,
        within,
        float(np.mean(np.abs(error) < 1.96 * result.level_std)),
        float(np.mean(error**2)),
        float(np.mean(floor**2)),
        float(bool(named - {run.spoilt})),
    )


def rows(kinds: list[str], sizes: list[str], runs: int) -> Iterator[str]:
    """Yield the rows of the table."""
    for kind in kinds:
        for size in sizes:
            targets, cycles = map(int, size.split("x"))
            found = [judged(generated(kind, targets, cycles, seed)) for seed in range(runs)]
            table = np.array(found)
            known = [column[~np.isnan(column)] for column in table.T]
            means = [100.0 * np.mean(c) if c.size else np.nan for c in known]
            error, floor = (np.sqrt(means[k] / 100.0) for k in (4, 5))
            yield (
                f"| {kind} | {size} | {means[0]:.1f} | {means[1]:.1f} | {means[2]:.1f} |"
                f" {means[3]:.1f} | {error:.3f} | {floor:.3f} | {means[6]:.1f} |"
            )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--drift", nargs="+", default=[*SILENT, *SMOOTH, *STEPS])
    parser.add_argument("--size", nargs="+", default=["16x10"])
    given = parser.parse_args()
    print("| drift | size | any | right | size | covered | error | floor | out |")
    print("|---|---|---:|---:|---:|---:|---:|---:|---:|")
    for row in rows(given.drift, given.size, given.runs):
        print(row, flush=True)


if __name__ == "__main__":
    main()
