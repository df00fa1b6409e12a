"""Thermal tests that are designed, beside customary ones, on machines unknown to the design.

machines    two sources; lags, gains and speeds of rise drawn at random for each of 50 machines
            (2 to 4 lags of 5 to 250 min, log-uniform; inputs rise with 5 to 40 min), temperatures
            with 0.02 K noise in steps of 0.1 K, displacements with noise of 0.4 um and a drift of
            0.8 um with 2 h. One design serves all: it knows orders of magnitude. Models are those
            of `modal`, default settings; error: root mean square of the displacement predicted
            over 20 other spectra without noise; foreseen: by the design, before; reached: by
            `reached`, after each test, its root mean square over the machines
lathe       the same with the virtual lathe, whose physics is a network of heat; 8 seeds
places      FL_THERMAL and the virtual lathe with twelve places: three chosen in the rows learned
            from, beside all places and 200 random triples; mean absolute error of free runs on
            later rows, by a ridge on four lags (1e-2) and by `modal`

    python benchmarks/designed_tests.py [--sections machines,lathe,places] [--draws 50] [--jobs 2]
"""

import argparse
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from multiprocessing import Pool
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from thermaxis.thermal import (
    Experiment,
    ModalOptions,
    best_places,
    modal,
    simulate_modal,
)
from thermaxis.thermal.design import (
    CustomaryTest,
    HeatingConditions,
    HeatSource,
    customary,
    customary_um,
    designed,
    foresight,
    prior_of,
    random_sequence,
    reached,
    spectra_of_use,
)
from thermaxis.thermal.transfer_function import ThermalModel

Array: TypeAlias = NDArray[np.float64]
NAMES = ("spindle", "table")
STEP_S, BLOCK_S, REST_S = 30.0, 1800.0, 600.0
FULL_K = 10.0
NOISE_UM, DRIFT_UM, DRIFT_S, NOISE_K, COUNT_K = 0.4, 0.8, 7200.0, 0.02, 0.1
CONDITIONS = HeatingConditions(sources={name: HeatSource() for name in NAMES})
FIRST_SEED, SPECTRA = 1000, 20


def lagged(u: Array, tau_s: float) -> Array:
    keep = np.exp(-STEP_S / tau_s)
    return np.asarray(lfilter([0.0, 1.0 - keep], [1.0, -keep], u))


@dataclass(frozen=True)
class Machine:
    """What each source does: gains um/K, lags s, and how fast its temperature rises, s."""

    sources: tuple[tuple[Array, Array, float], ...]

    def inputs(self, heat: Array) -> Array:
        each = zip(heat.T, self.sources, strict=True)
        return np.column_stack([lagged(FULL_K * h, rise_s) for h, (_, _, rise_s) in each])

    def displacement(self, u: Array) -> Array:
        z = np.zeros(len(u))
        for column, (gains, taus_s, _) in zip(u.T, self.sources, strict=True):
            for gain, tau_s in zip(gains, taus_s, strict=True):
                z += gain * lagged(column, tau_s)
        return z


def machine(rng: np.random.Generator) -> Machine:
    sources: list[tuple[Array, Array, float]] = []
    for _ in NAMES:
        lags = int(rng.integers(2, 5))
        taus_s = np.exp(rng.uniform(np.log(300.0), np.log(15_000.0), lags))
        rise_s = float(np.exp(rng.uniform(np.log(300.0), np.log(2400.0))))
        sources.append((rng.normal(0.0, 3.0 / np.sqrt(lags), lags), taus_s, rise_s))
    return Machine(tuple(sources))


def measured(one: Machine, heat: Array, rng: np.random.Generator) -> Experiment:
    """Return the record of a test whose blocks have this heat, after a rest."""
    rest = np.zeros((round(REST_S / STEP_S), heat.shape[1]))
    u = one.inputs(np.vstack([rest, np.repeat(heat, round(BLOCK_S / STEP_S), axis=0)]))
    keep, n = np.exp(-STEP_S / DRIFT_S), len(u)
    steps = rng.normal(0.0, DRIFT_UM * np.sqrt(1.0 - keep**2), n)
    drift = lfilter([1.0], [1.0, -keep], steps, zi=[keep * rng.normal(0.0, DRIFT_UM)])[0]
    z = one.displacement(u) + drift + rng.normal(0.0, NOISE_UM, n)
    seen = COUNT_K * np.round((u + rng.normal(0.0, NOISE_K, u.shape)) / COUNT_K)
    return Experiment(STEP_S, seen, z - z[: len(rest)].mean(), reference_s=REST_S)


def use_error_um(one: Machine, model: ThermalModel, seed: int) -> float:
    squares: list[float] = []
    for heat in spectra_of_use(CONDITIONS.use, CONDITIONS, seed, SPECTRA):
        u = one.inputs(np.repeat(heat, round(300.0 / STEP_S), axis=0))
        rest = [np.zeros(part.gains.size) for part in model.parts]
        left = simulate_modal(model, STEP_S, u, rest) - one.displacement(u)
        squares.append(float(np.mean(left**2)))
    return float(np.sqrt(np.mean(squares)))


def tests(blocks: int, longer: int) -> dict[str, NDArray[np.intp]]:
    foreseen = foresight(CONDITIONS, prior_of(CONDITIONS), blocks)
    known = customary(CONDITIONS, blocks)
    return {
        "designed": designed(CONDITIONS, foreseen, blocks),
        "heating": known[CustomaryTest.HEATING],
        "heat and cool": known[CustomaryTest.HEAT_AND_COOL],
        "random": random_sequence(CONDITIONS, blocks, np.random.default_rng(5)),
        "heat and cool, longer": customary(CONDITIONS, longer)[CustomaryTest.HEAT_AND_COOL],
    }


def judged(sequences: Mapping[str, NDArray[np.intp]], seed: int) -> dict[str, tuple[float, float]]:
    one, prior = machine(np.random.default_rng(seed)), prior_of(CONDITIONS)
    found: dict[str, tuple[float, float]] = {}
    for name, sequence in sequences.items():
        record = measured(one, CONDITIONS.heat(sequence), np.random.default_rng([seed, 1]))
        options = ModalOptions(intervals=False)
        model = modal([record], input_names=NAMES, options=options).model
        said = reached(CONDITIONS, prior, record).uncertainty_um
        found[name] = use_error_um(one, model, seed), said
    return found


def rms(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def machines(draws: int, jobs: int) -> None:
    sequences = tests(16, 28)
    prior = prior_of(CONDITIONS)
    foreseen = {
        name: foresight(CONDITIONS, prior, len(s)).foreseen_um(CONDITIONS.heat(s))
        for name, s in sequences.items()
    }
    seeds = range(FIRST_SEED, FIRST_SEED + draws)
    with Pool(jobs) as pool:
        each = pool.map(partial(judged, sequences), seeds)
    print(f"machines: {draws} drawn; um")
    print(f"{'test':24s}{'h':>4s}{'foreseen':>10s}{'reached':>9s}{'error':>8s}{'median':>8s}")
    for name, sequence in sequences.items():
        errors, said = ([one[name][k] for one in each] for k in (0, 1))
        row = foreseen[name], rms(said), rms(errors), float(np.median(errors))
        print(f"{name:24s}{len(sequence) / 2:4.0f}" + "".join(f"{v:9.2f}" for v in row))
    error = {name: rms([one[name][0] for one in each]) for name in sequences}
    for other in ("heat and cool", "heat and cool, longer"):
        print(f"designed over {other}: {error['designed'] / error[other]:.2f}")
    print(f"designed, error over foreseen: {error['designed'] / foreseen['designed']:.2f}")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--sections", default="machines,lathe,places")
    parser.add_argument("--draws", type=int, default=50)
    parser.add_argument("--jobs", type=int, default=2)
    arguments = parser.parse_args()
    machines(arguments.draws, arguments.jobs)

if __name__ == "__main__":
    main()
