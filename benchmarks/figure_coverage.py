"""How often the stated U of the figures holds, on generated runs whose truth is known.

Every run has 16 targets and two approaches, noise of 0.4 µm and a reading every 8 s. The true
figure is

measured    of the same run without noise: its drift at the times of the readings is in it, and s is
            replaced by its expectation over the noise (the mean of the noncentral chi distribution)
drift-free  of the true levels at the mean time of the readings, with the true noise
effect      the difference of the first and of the same without drift

Counted is, in percent of the runs, how often it lies within figure ± U. Axes:

screw       pitch error of some µm, two waves, independent errors of 0.3 µm, and a reversal value
            that changes along the axis
rough       independent errors of 1.5 µm at each target and approach
straight    a straight line and a constant reversal value: the largest of equal values
loud        screw, and one target in one approach with five times the noise

With a warm-up the axis moves and grows by several µm, with two time constants each. Readings may be
rounded, to a step that is stated in standard deviations of the noise; the truth is not.

    nice python benchmarks/figure_coverage.py --axes screw --cycles 5 --runs 100 --all
    nice python benchmarks/figure_coverage.py --write docs/theory/uncertainty.md   # the whole table
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln, hyp1f1

from thermaxis.positioning import (
    FIGURE_KEYS,
    PositioningTest,
    TimeSource,
    UncertaintyBudget,
    evaluate_drift,
    evaluate_uncertainty,
)
from thermaxis.positioning.standard import arrays_by_key, figures_of, mean_and_s
from thermaxis.quantities import AxisKind

Array = NDArray[np.float64]

TARGETS, STOP_S, NOISE_UM, LENGTH_MM = 16, 8.0, 0.4, 600.0
AXES = ("screw", "rough", "straight", "loud")
DEVICE_UM = 1.2
SYMBOLS = ["B", "B̄", "M", "E↑", "E↓", "E", "R↑", "R↓", "R", "A↑", "A↓", "A"]
BEGIN, END = "<!-- table -->", "<!-- end -->"


def levels_of(axis: str, x: Array, rng: np.random.Generator) -> Array:
    """Return true levels, (m, 2); x is the position from -0.5 to 0.5. [µm]"""
    approach = np.array([0.5, -0.5])
    if axis == "rough":
        return rng.normal(0.0, 1.5, (x.size, 2)) + approach * rng.uniform(0.0, 3.0)
    pitch = rng.uniform(-6.0, 6.0) * x
    if axis == "straight":
        return pitch[:, None] + approach * rng.uniform(0.5, 3.0)
    waves = rng.uniform(0.3, 1.5, 2) * np.sin(
        np.array([6.0, 31.0]) * x[:, None] + rng.uniform(0.0, 6.28, 2)
    )
    reversal = rng.uniform(0.5, 3.0) * (1.0 + rng.uniform(-0.5, 0.5) * x)
    own = rng.normal(0.0, 0.3, (x.size, 2))
    return (pitch + waves.sum(axis=1))[:, None] + reversal[:, None] * approach + own


def warming(time_s: Array, x: Array, rng: np.random.Generator) -> Array:
    """Return a warm-up of the axis: common shift and growth, two time constants each. [µm]"""
    drift = np.zeros(np.broadcast_shapes(time_s.shape, x.shape))
    for shape, largest in ((np.ones_like(x), 7.0), (x, 9.0)):
        for tau_h in (rng.uniform(0.1, 0.4), rng.uniform(0.5, 3.0)):
            size = rng.uniform(-largest, largest)
            drift = drift + shape * size * (1.0 - np.exp(-time_s / 3600.0 / tau_h))
    return drift


def expectation_of_s(std: Array, drift: Array) -> Array:
    """Return the mean of s of readings with this drift, cycles along the second axis, (m, 2)."""
    free = drift.shape[1] - 1
    offset = np.sum((drift - drift.mean(axis=1, keepdims=True)) ** 2, axis=1) / std**2
    factor = np.sqrt(2.0 / free) * np.exp(gammaln(0.5 * (free + 1)) - gammaln(0.5 * free))
    return std * factor * hyp1f1(-0.5, 0.5 * free, -0.5 * offset)


@dataclass(frozen=True)
class Case:
    """One kind of run."""

    axis: str
    warm: bool
    cycles: int
    step: float = 0.0
    """Step of the readings in standard deviations of the noise; 0: not rounded."""
    unequal: bool = False
    device: bool = False


def one_run(seed: int, case: Case) -> tuple[PositioningTest, dict[str, dict[str, float]]]:
    """Return a run and its true figures by kind."""
    axis, cycles, warm = case.axis, case.cycles, case.warm
    rng = np.random.default_rng((seed, cycles, warm, AXES.index(axis)))
    target = np.linspace(0.0, LENGTH_MM, TARGETS)
    target[1:-1] += rng.uniform(-8.0, 8.0, TARGETS - 2)
    x = (target / LENGTH_MM - 0.5)[:, None, None]
    up = np.arange(TARGETS)
    visit = np.stack((up, 2 * TARGETS - 1 - up), axis=1)[:, None, :]
    number = visit + 2 * TARGETS * np.arange(cycles)[None, :, None]
    time_s = STOP_S * number
    level = levels_of(axis, x[:, 0, 0], rng)
    std = np.full((TARGETS, 2), NOISE_UM)
    if case.unequal:
        std = std * np.exp(rng.normal(0.0, 0.3, std.shape))
    if axis == "loud":
        std[rng.integers(TARGETS), rng.integers(2)] *= 5.0
    drift = np.zeros(time_s.shape)
    at_mean = np.zeros(TARGETS)
    if warm:
        state = rng.bit_generator.state
        drift = warming(time_s, x, rng)
        rng.bit_generator.state = state
        at_mean = warming(np.mean(time_s), x[:, 0, 0], rng)
    still = level + at_mean[:, None]
    noise = std[:, None, :] * rng.normal(size=time_s.shape)
    instrument = 0.5 * DEVICE_UM * rng.normal() * x if case.device else 0.0
    deviation = level[:, None, :] + drift + noise + instrument
    if case.step:
        deviation = case.step * NOISE_UM * np.rint(deviation / (case.step * NOISE_UM))
    test = PositioningTest(
        kind=AxisKind.LINEAR,
        target=target,
        deviation=deviation,
        time_source=TimeSource.FILE,
        time_s=time_s,
        order=number + 1.0,
    )
    no_drift = np.zeros_like(drift)
    measured = figures_of(level + drift.mean(axis=1), expectation_of_s(std, drift))
    without = figures_of(still, expectation_of_s(std, no_drift))
    truth = {
        "measured": _numbers(arrays_by_key(measured)),
        "drift-free": _numbers(arrays_by_key(figures_of(still, std))),
    }
    before_after = truth["measured"], _numbers(arrays_by_key(without))
    truth["effect"] = {key: before_after[0][key] - before_after[1][key] for key in FIGURE_KEYS}
    return test, truth


def _numbers(arrays: dict[str, Array]) -> dict[str, float]:
    return {key: float(value) for key, value in arrays.items()}


def stated_of(
    test: PositioningTest, budget: UncertaintyBudget | None
) -> dict[str, dict[str, tuple[float, float, float]]]:
    """Return figure, U and bias by kind and key."""
    drift = evaluate_drift(test)
    result = evaluate_uncertainty(test, drift, budget=budget)
    measured = _numbers(arrays_by_key(figures_of(*mean_and_s(test.deviation))))
    free = _numbers(arrays_by_key(drift.figures))
    effect = {key: measured[key] - free[key] for key in FIGURE_KEYS}
    found: dict[str, dict[str, tuple[float, float, float]]] = {}
    for kind, values, part in (
        ("measured", measured, result.measured),
        ("drift-free", free, result.drift_free),
    ):
        if part is None:
            raise RuntimeError("the drift of a generated run is known")
        u = part.expanded_uncertainty
        found[kind] = {key: (values[key], u[key], part.bias[key]) for key in FIGURE_KEYS}
    u = result.drift_effect
    found["effect"] = {key: (effect[key], u[key], 0.0) for key in FIGURE_KEYS}
    return found


def errors_of(case: Case, runs: int) -> dict[str, Array]:
    """Return error, U and bias of every figure of every run by kind, (runs, 12, 3)."""
    budget = UncertaintyBudget(device=DEVICE_UM) if case.device else None
    rows: dict[str, list[list[tuple[float, float, float]]]] = {}
    for seed in range(runs):
        test, truth = one_run(seed, case)
        for kind, values in stated_of(test, budget).items():
            if case.warm or kind != "effect":  # without drift it is 0 ± U, and truly 0
                own = [(v - truth[kind][key], u, bias) for key, (v, u, bias) in values.items()]
                rows.setdefault(kind, []).append(own)
    return {kind: np.array(own) for kind, own in rows.items()}


def rows_of(case: Case, runs: int, *, everything: bool) -> Iterator[str]:
    """Yield rows of the table: coverage, and also the means of U, bias and error if wanted."""
    for kind, found in errors_of(case, runs).items():
        error, u, bias = np.moveaxis(found, 2, 0)
        covered = 100.0 * np.mean(np.abs(error) <= u + 1e-9, axis=0)
        step, warm = f"{case.step:g}" if case.step else "", "yes" if case.warm else "no"
        head = f"| {case.axis} | {step} | {warm} | {case.cycles} | {runs} | {kind} | "
        yield head + " | ".join(f"{c:.1f}" for c in covered) + " |"
        for name, numbers in (("U", u), ("bias", bias), ("error", error)) if everything else ():
            line = " | ".join(f"{c:.2f}" for c in np.mean(numbers, axis=0))
            yield f"|  |  |  |  |  | {name} | {line} |"


def cases_of_page(runs: int) -> list[tuple[Case, int]]:
    """Return what the table of the theory page has, and how many runs of each."""
    few = 3 * runs // 20
    both = (False, True)
    return [
        *((Case("screw", warm, n), runs) for warm in both for n in (5, 10, 30)),
        *((Case(a, w, n), few) for a in AXES[1:] for w in both for n in (5, 10, 30)),
        *((Case("screw", w, 5, step), few) for step in (0.3, 1.0, 3.0) for w in both),
    ]


def main() -> int:
    """Print the table, or write it into the page."""
    parser = argparse.ArgumentParser(description="Coverage of the stated U of figures.")
    parser.add_argument("--runs", type=int, default=400)
    parser.add_argument("--cycles", type=int, nargs="+", default=[5, 10, 30])
    parser.add_argument(
        "--axes", nargs="+", choices=AXES, help="these alone; else those of --write"
    )
    parser.add_argument("--steps", type=float, nargs="+", default=[0.0], help="of the readings")
    parser.add_argument("--unequal", action="store_true", help="noise differs between targets")
    parser.add_argument("--device", action="store_true", help="an instrument with U = 1.2 µm")
    parser.add_argument("--all", action="store_true", help="also mean U, bias and error in µm")
    parser.add_argument("--write", type=Path, help="page whose table is replaced")
    arguments = parser.parse_args()
    cases = cases_of_page(arguments.runs)
    if arguments.axes:
        also = {"unequal": arguments.unequal, "device": arguments.device}
        cases = [
            (Case(axis, warm, cycles, step, **also), arguments.runs)
            for axis in arguments.axes
            for step in arguments.steps
            for warm in (False, True)
            for cycles in arguments.cycles
        ]
    lines = [
        "| axis | step | warm-up | cycles | runs | figures | " + " | ".join(SYMBOLS) + " |",
        "|---|---:|---|---:|---:|---|" + "---:|" * len(SYMBOLS),
    ]
    print("\n".join(lines))
    for case, runs in cases:
        for line in rows_of(case, runs, everything=arguments.all):
            print(line, flush=True)
            lines.append(line)
    if arguments.write:
        before, rest = arguments.write.read_text(encoding="utf-8").split(BEGIN)
        text = before + "\n".join([BEGIN, *lines, END]) + rest.split(END)[1]
        arguments.write.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
