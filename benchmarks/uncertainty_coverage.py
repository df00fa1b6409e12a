"""How often the stated uncertainties hold, on generated runs whose truth is known.

Every run has 16 targets and two approaches, noise of 0.4 µm, a reading every 7.9 s and a drift of
several µm that is no polynomial and depends on position. The true figures are those of the true
levels at the mean time of the run with the true standard deviation of the noise. Printed are, in
percent of the runs, how often the true figure lies within

plain       figure ± U, U the expanded uncertainty
corrected   (figure - bias) ± 2 u, u the standard uncertainty

and, in µm, the mean error of the figure, of figure - bias, and the mean U. Axes:

random      levels independent, standard deviation as stated
smooth      two waves along the axis of this amplitude, and a reversal value of the same size that
            varies by a quarter of it
constant    a straight line and a constant reversal value: the largest of equal values
one         as constant, with one target that lies off by four times the amount

    python benchmarks/uncertainty_coverage.py [--seeds 200] [--axes random] [--measured]
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermaxis.positioning import (
    FIGURE_KEYS,
    PositioningTest,
    TimeSource,
    evaluate_drift,
    evaluate_iso230_2,
    evaluate_uncertainty,
)
from thermaxis.positioning.standard import figures_of
from thermaxis.positioning.uncertainty._uncertainty import _by_key
from thermaxis.quantities import AxisKind

Array = NDArray[np.float64]

TARGETS = 16
NOISE_UM = 0.4
STOP_S = 252.0 / 32.0
AXES = ("random", "smooth", "constant", "one")
SHOWN = ("B", "B_mean", "M", "E_forward", "E", "R_forward", "R", "A_forward", "A")


@dataclass(frozen=True)
class Run:
    """A generated run with its truth."""

    test: PositioningTest
    level: Array
    """True levels at the mean time of the readings, (m, 2). [µm]"""
    noise_std: Array
    """True standard deviations, (m, 2). [µm]"""


def levels_of(axis: str, amount: float, target: Array, rng: np.random.Generator) -> Array:
    """Return levels of one kind of axis with a systematic error of this amount, (m, 2)."""
    x = (target - np.mean(target)) / np.ptp(target)
    sign = np.array([0.5, -0.5])
    if axis == "random":
        return rng.normal(0.0, amount, (TARGETS, 2))
    if axis == "smooth":
        phase = rng.uniform(0.0, 2.0 * np.pi, 3)
        mean = amount * (np.sin(4.0 * x + phase[0]) + 0.3 * np.sin(25.0 * x + phase[1]))
        reversal = amount * (1.0 + 0.25 * np.sin(6.0 * x + phase[2]))
        return mean[:, None] + reversal[:, None] * sign
    level = amount * x[:, None] + amount * sign
    if axis == "one":
        level[int(rng.integers(TARGETS))] += 4.0 * amount * sign
    return level


def generated(
    seed: int, cycles: int, axis: str, amount: float, *, scale: float = 1.0, unequal: bool = False
) -> Run:
    """Return a drifting run."""
    rng = np.random.default_rng(seed)
    target = 20.0 * np.arange(TARGETS) + rng.uniform(-4.0, 4.0, TARGETS)
    common = rng.uniform(3.0, 8.0, 2) * np.array([1.0, -1.0]) * rng.choice([-1.0, 1.0])
    tau_s = 3600.0 * np.array([rng.uniform(0.25, 0.8), rng.uniform(0.8, 3.0)])
    growth = rng.uniform(0.010, 0.030) * rng.choice([-1.0, 1.0])
    growth_tau_s = 3600.0 * rng.uniform(0.3, 2.0)

    def drift_at(time_s: Array, position: Array) -> Array:
        one = sum(a * (1.0 - np.exp(-time_s / u)) for a, u in zip(common, tau_s, strict=True))
        slope = growth * (1.0 - np.exp(-time_s / growth_tau_s))
        return np.asarray(scale * (one + slope * (position - np.mean(target))))

    up = np.arange(TARGETS)
    order = np.stack((up, 2 * TARGETS - 1 - up), axis=1)
    number = order[:, None, :] + 2.0 * TARGETS * np.arange(cycles)[None, :, None]
    time_s = STOP_S * number
    level = levels_of(axis, amount, target, rng)
    std = np.full((TARGETS, 2), NOISE_UM)
    if unequal:
        std *= np.exp(rng.normal(0.0, 0.4, std.shape))
    deviation = level[:, None, :] + drift_at(time_s, target[:, None, None])
    deviation = deviation + std[:, None, :] * rng.normal(size=deviation.shape)
    test = PositioningTest(
        kind=AxisKind.LINEAR,
        target=target,
        deviation=deviation,
        time_source=TimeSource.FILE,
        time_s=time_s,
        order=number + 1.0,
    )
    at_mean = drift_at(np.array(np.mean(time_s)), target)
    return Run(test, level + at_mean[:, None], std)


@dataclass
class Tally:
    """Errors of figures in units of what was stated, (runs,) by key."""

    plain: dict[str, float]
    corrected: dict[str, float]
    error: dict[str, float]
    error_left: dict[str, float]
    expanded: dict[str, float]


def tally(
    seeds: range, run_of: Callable[[int], Run], *, measured: bool = False, samples: int = 2000
) -> Tally:
    """Evaluate many runs; `run_of(seed)` gives one."""
    rows: dict[str, list[tuple[float, float, float]]] = {key: [] for key in FIGURE_KEYS}
    for seed in seeds:
        run = run_of(seed)
        drift = evaluate_drift(run.test)
        result = evaluate_uncertainty(run.test, drift, samples=samples, seed=seed)
        truth = _by_key(figures_of(run.level, run.noise_std))
        if measured:
            stated, standard = result.measured, evaluate_iso230_2(run.test)
            figure = {key: float(getattr(standard, key)) for key in FIGURE_KEYS}
        elif result.drift_free is not None:
            stated = result.drift_free
            figure = {key: float(value) for key, value in _by_key(drift.figures).items()}
        else:
            raise RuntimeError("the drift of a generated run is known")
        for key in FIGURE_KEYS:
            error = figure[key] - float(truth[key])
            left = error - stated.bias[key]
            rows[key].append(
                (error, left, stated.expanded_uncertainty[key], stated.standard_uncertainty[key])
            )
    table = {key: np.array(values) for key, values in rows.items()}
    return Tally(
        plain={k: 100.0 * float(np.mean(np.abs(v[:, 0]) <= v[:, 2])) for k, v in table.items()},
        corrected={
            k: 100.0 * float(np.mean(np.abs(v[:, 1]) <= 2.0 * v[:, 3])) for k, v in table.items()
        },
        error={k: float(np.mean(v[:, 0])) for k, v in table.items()},
        error_left={k: float(np.mean(v[:, 1])) for k, v in table.items()},
        expanded={k: float(np.mean(v[:, 2])) for k, v in table.items()},
    )


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Coverage of the stated uncertainties.")
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--cycles", type=int, nargs="+", default=[5, 30])
    parser.add_argument("--amounts", type=float, nargs="+", default=[0.5, 3.0], help="in µm")
    parser.add_argument("--axes", nargs="+", default=list(AXES))
    parser.add_argument("--measured", action="store_true", help="figures as measured")
    parser.add_argument(
        "--unequal", action="store_true", help="noise differs from target to target"
    )
    arguments = parser.parse_args()
    print(f"{'':26}" + "".join(f"{key:>11}" for key in SHOWN))
    for axis in arguments.axes:
        for cycles in arguments.cycles:
            for amount in arguments.amounts:
                t = tally(
                    range(arguments.seeds),
                    lambda seed, c=cycles, x=axis, a=amount: generated(
                        seed, c, x, a, unequal=arguments.unequal
                    ),
                    measured=arguments.measured,
                )
                for name, values, form in (
                    ("plain", t.plain, "11.1f"),
                    ("corrected", t.corrected, "11.1f"),
                    ("error", t.error, "11.2f"),
                    ("left", t.error_left, "11.2f"),
                    ("U", t.expanded, "11.2f"),
                ):
                    head = f"{axis:9}{cycles:3d} {amount:3g} {name:9}"
                    print(f"{head:26}" + "".join(f"{values[k]:{form}}" for k in SHOWN), flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
