"""Identification of thermal errors against peers and baselines, on tests whose truth is known.

Problem (the virtual machine's default): two inputs, spindle minus column and table minus column,
G1 = 14/(1+400s) + 26/(1+3000s) - 18/(1+12000s), G2 = 12/(1+3000s) + 20/(1+12000s) µm/K; sensors of
0.1 K with 0.02 K noise, 0.4 µm noise of the displacement, 0.8 µm slow drift of 2 h correlation and
0.6 µm per K of the hall through a lag of 2 h; speeds that switch every 10 to 60 min; cold start.

Fit: free run from rest on another cold test of the same length with other speeds, drift and hall,
with logged inputs, 100 (1 - |reference - simulated| / |reference - its mean|) in percent. The
truth's own fit can be read in two ways, and both are printed:

clean       the reference is the displacement without noise and drift; `truth` is the true model
            behind the logged inputs, so that only their rounding keeps it from 100
measured    the reference is the measured displacement; `truth` is the displacement without noise
            and drift, so that noise and drift are what nobody can reach

Names of rows: `modal` is the default estimator with default settings. Rows of 120 s are means over
blocks, as peers get them. Sections: quality warm joint rates others intervals time peers.

    python benchmarks/identification.py [--seeds 20] [--sections quality,time] [--peer-seeds 3]
        [--peer-python PYTHON] [--peer-limit-s 60]

Peers run in programs of their own (benchmarks/identification_peers.py), each fit bounded in time;
`--peer-python` names an interpreter that has them, by default this one (extra `bench`).
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from identification_peers import PEERS
from numpy.typing import NDArray

from thermaxis.thermal._experiment import Experiment
from thermaxis.thermal._modal import ModalOptions, ModalResult, modal
from thermaxis.thermal._thermal_model import ModalPart, ThermalModel, simulate_modal
from thermaxis.virtual._thermal_run import (
    GeneratedThermalTest,
    Heating,
    Lags,
    ThermalTestPlan,
    generate_thermal_test,
)

Array: TypeAlias = NDArray[np.float64]

NAMES = ("spindle", "table")
TRUE_DC = (22.0, 32.0)
TRUE_TAU_S = (400.0, 3000.0, 12000.0)
OTHER = 5000
"""Seeds of the tests that are simulated, from here."""
NORMAL_95 = 1.959964


def fit_percent(reference: Array, simulated: Array) -> float:
    """Return the fit. [%]"""
    spread = np.linalg.norm(reference - np.mean(reference))
    return float(100.0 * (1.0 - np.linalg.norm(reference - simulated) / spread))


def experiment_of(test: GeneratedThermalTest) -> Experiment:
    return Experiment(test.plan.sample_time_s, test.u_k, test.z_um)


def identified(*tests: GeneratedThermalTest, options: ModalOptions | None = None) -> ModalResult:
    return modal([experiment_of(t) for t in tests], input_names=NAMES, options=options)


def true_part(name: str, lags: Lags, plan: ThermalTestPlan) -> ModalPart:
    """Return what one input truly does; a rod as the sum of its modes."""
    gains, taus = np.array(lags.gains_um_per_k), np.array(lags.time_constants_s)
    if plan.heating is Heating.LAGS:
        return ModalPart(name, 0.0, gains, taus, plan.delay_s)
    odd = 2.0 * np.arange(25) + 1.0
    shares = 8.0 / (np.pi * odd) ** 2
    modes, speeds = np.outer(gains, shares).ravel(), np.outer(taus, odd**-2.0).ravel()
    rest = float(np.sum(gains) * (1.0 - np.sum(shares)))
    return ModalPart(name, rest, modes, speeds, plan.delay_s)


def truth(plan: ThermalTestPlan) -> ThermalModel:
    pairs = zip(NAMES, (plan.spindle, plan.table), strict=True)
    return ThermalModel(tuple(true_part(name, lags, plan) for name, lags in pairs))


def plan_of(hours: float, step_s: float, **more: object) -> ThermalTestPlan:
    return replace(
        ThermalTestPlan(hours=hours, sample_time_s=step_s, block_means=step_s >= 60), **more
    )


def pair(plan: ThermalTestPlan, seed: int) -> tuple[GeneratedThermalTest, GeneratedThermalTest]:
    """Return the test that is fitted and the other one that is simulated, cold and whole."""
    other = replace(plan, warm_up_h=0.0, missing_share=0.0)
    return generate_thermal_test(plan, seed), generate_thermal_test(other, OTHER + seed)


def scores(test: GeneratedThermalTest, simulated: Array) -> tuple[float, float]:
    """Return the fit against the clean and against the measured displacement. [%]"""
    return fit_percent(test.clean_um, simulated), fit_percent(test.z_um, simulated)


def from_rest(model: ThermalModel, test: GeneratedThermalTest) -> Array:
    """Return the free run of a cold machine: all lags begin at zero, as those of the peers do."""
    rest = [np.zeros(part.gains.size) for part in model.parts]
    return simulate_modal(model, test.plan.sample_time_s, test.u_k, rest)


def own_scores(test: GeneratedThermalTest) -> tuple[float, float]:
    """Return the truth's own fit in both readings. [%]"""
    behind = from_rest(truth(test.plan), test)
    return fit_percent(test.clean_um, behind), fit_percent(test.z_um, test.clean_um)


def freed(test: GeneratedThermalTest, result: ModalResult) -> Array:
    return from_rest(result.model, test)


def shown(label: str, clean: Sequence[float], measured: Sequence[float], note: str = "") -> None:
    """Print median, lower quartile and worst of both readings."""
    parts = []
    for values in (clean, measured):
        v = np.array(values)
        parts.append(f"{np.median(v):7.1f} {np.quantile(v, 0.25):7.1f} {np.min(v):8.1f}")
    print(f"  {label:26s} {'   '.join(parts)}   n={len(clean)} {note}", flush=True)


def headed(title: str) -> None:
    print(f"\n{title}\n  {'':26s}   clean: median, lower quartile, worst    measured: the same")


def compared(title: str, plan: ThermalTestPlan, seeds: int) -> list[ModalResult]:
    """Print truth, modal and how far apart they are; return the results."""
    headed(title)
    own, found, results = [], [], []
    for seed in range(seeds):
        test, other = pair(plan, seed)
        result = identified(test)
        own.append(own_scores(other))
        found.append(scores(other, freed(other, result)))
        results.append(result)
    shown("truth", *np.array(own).T)
    lags = np.bincount([r.model.parts[0].gains.size for r in results])
    shown("modal", *np.array(found).T, note=f"lags {dict(enumerate(lags.tolist()))}")
    gap = np.median(own, axis=0) - np.median(found, axis=0)
    print(f"  median behind the truth: {gap[0]:.2f} (clean), {gap[1]:.2f} (measured)")
    return results


def quality(seeds: int) -> None:
    for hours in (8.0, 72.0):
        for step_s in (1.0, 10.0, 120.0):
            compared(f"{hours:g} h, {step_s:g} s, cold", plan_of(hours, step_s), seeds)


def warm(seeds: int) -> None:
    for step_s in (1.0, 120.0):
        results = compared(
            f"8 h, {step_s:g} s, begins after 5 h", plan_of(8.0, step_s, warm_up_h=5.0), seeds
        )
        flagged = np.mean([[bool(s.flags) for s in r.std] for r in results])
        no_dc = np.mean([[s.dc_gain is None for s in r.std] for r in results])
        print(
            f"  parts with a flag {100 * flagged:.0f} %, DC gains not supported {100 * no_dc:.0f} %"
        )


def joint(seeds: int) -> None:
    headed("8 h cold and 8 h warm, 10 s, alone and joined in one call")
    plan = plan_of(8.0, 10.0)
    found: dict[str, list[tuple[float, float]]] = {"cold": [], "warm": [], "both": []}
    for seed in range(seeds):
        cold, other = pair(plan, seed)
        late = generate_thermal_test(replace(plan, warm_up_h=5.0), 2000 + seed)
        for label, tests in (("cold", (cold,)), ("warm", (late,)), ("both", (cold, late))):
            found[label].append(scores(other, freed(other, identified(*tests))))
    for label, values in found.items():
        shown(label, *np.array(values).T)


def rates(seeds: int) -> None:
    print("\nDC gain by sample time, 72 h: largest difference of the three [%]")
    worst = []
    for seed in range(seeds):
        results = [
            identified(generate_thermal_test(plan_of(72.0, step_s), seed))
            for step_s in (1.0, 10.0, 120.0)
        ]
        dc = np.array([[p.dc_gain for p in r.model.parts] for r in results])
        worst.append(100.0 * np.ptp(dc, axis=0) / np.mean(dc, axis=0))
    print(f"  median {np.median(worst, axis=0).round(2)}, largest {np.max(worst, axis=0).round(2)}")


def others(seeds: int) -> None:
    cases = {
        "conduction rods": {"heating": Heating.RODS},
        "delay of 90 s": {"delay_s": 90.0},
        "5 % missing": {"missing_share": 0.05},
    }
    for hours in (8.0, 72.0):
        for name, more in cases.items():
            compared(f"{hours:g} h, 10 s, {name}", plan_of(hours, 10.0, **more), seeds)


def intervals(seeds: int) -> None:
    print("\n95 % intervals on 72 h, 10 s: share that holds the truth [%], and how many there are")
    for label, hall in (("drift independent", 0.0), ("drift follows the hall", 0.6)):
        inside: dict[str, list[bool]] = {}
        for seed in range(seeds):
            test = generate_thermal_test(
                plan_of(72.0, 10.0, hall_drift_um_per_k=hall), 10000 + seed
            )
            result = identified(test)
            for part, std, dc in zip(result.model.parts, result.std, TRUE_DC, strict=True):
                if std.dc_gain is not None:
                    hit = abs(part.dc_gain - dc) <= NORMAL_95 * std.dc_gain
                    inside.setdefault(f"DC {part.input_name}", []).append(hit)
            part, std = result.model.parts[0], result.std[0]
            if part.gains.size != len(TRUE_TAU_S):
                continue
            for tau_s, known, true_s in zip(
                part.time_constants_s, std.time_constants_s, TRUE_TAU_S, strict=True
            ):
                if known is not None:
                    hit = abs(tau_s - true_s) <= NORMAL_95 * known
                    inside.setdefault(f"{true_s:g} s", []).append(bool(hit))
        texts = [f"{k}: {100 * np.mean(v):.0f} ({len(v)})" for k, v in inside.items()]
        print(f"  {label:24s} {', '.join(texts)}", flush=True)


def best_time(call: Callable[[], object], repeats: int) -> float:
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        call()
        times.append(time.perf_counter() - began)
    return min(times)


def speed(_seeds: int) -> None:
    print("\nTime of the whole default search, best of five [s]")
    for hours in (8.0, 24.0, 72.0, 144.0):
        experiment = experiment_of(generate_thermal_test(plan_of(hours, 1.0), 1))
        taken = best_time(lambda e=experiment: modal([e], input_names=NAMES), 5)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
        print(
            f"  {hours:5g} h at 1 s: {taken:.3f} s; largest memory so far {peak:.0f} MB", flush=True
        )


def peer_fit(
    name: str, test: GeneratedThermalTest, other: GeneratedThermalTest, python: str, limit_s: float
) -> tuple[Array, float] | str:
    """Return free run and time of one peer, or what went wrong."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "case.npz"
        np.savez(path, u=test.u_k, y=test.z_um, v=other.u_k, sample_time_s=test.plan.sample_time_s)
        script = Path(__file__).with_name("identification_peers.py")
        try:
            done = subprocess.run(
                [python, str(script), name, str(path)],
                capture_output=True, text=True, timeout=limit_s, check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return f"over {limit_s:g} s"
    lines = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    if not lines:
        return (done.stderr.strip().splitlines() or ["no answer"])[-1][:70]
    answer = json.loads(lines[-1].removeprefix("RESULT "))
    return np.array(answer["y"]), float(answer["fit_s"])


def peers(seeds: int, python: str, limit_s: float) -> None:
    cases = [
        ("8 h, 1 s, cold", plan_of(8.0, 1.0)),
        ("8 h, 10 s, cold", plan_of(8.0, 10.0)),
        ("8 h, 120 s, cold", plan_of(8.0, 120.0)),
        ("8 h, 120 s, begins after 5 h", plan_of(8.0, 120.0, warm_up_h=5.0)),
        ("72 h, 120 s, cold", plan_of(72.0, 120.0)),
        ("72 h, 10 s, cold", plan_of(72.0, 10.0)),
        ("72 h, 1 s, cold", plan_of(72.0, 1.0)),
    ]
    for title, plan in cases:
        compared(f"{title} (beside the peers)", plan, seeds)
        tests = [pair(plan, seed) for seed in range(seeds)]
        for name in PEERS:
            found, times, failures = [], [], []
            for test, other in tests:
                answer = peer_fit(name, test, other, python, limit_s)
                if isinstance(answer, str):
                    failures.append(answer)
                    # Whoever fails once at this size is not asked again.
                    break
                found.append(scores(other, answer[0]))
                times.append(answer[1])
            if found:
                shown(name, *np.array(found).T, note=f"{np.median(times):.2f} s")
            if failures:
                print(f"  {name:26s} {failures[0]}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--interval-seeds", type=int, default=100)
    parser.add_argument("--peer-seeds", type=int, default=3)
    parser.add_argument("--peer-python", default=sys.executable)
    parser.add_argument("--peer-limit-s", type=float, default=60.0)
    parser.add_argument(
        "--sections", default="quality,warm,joint,rates,others,intervals,time,peers"
    )
    options = parser.parse_args()
    sections: dict[str, Callable[[], None]] = {
        "quality": lambda: quality(options.seeds),
        "warm": lambda: warm(options.seeds),
        "joint": lambda: joint(options.seeds),
        "rates": lambda: rates(options.seeds),
        "others": lambda: others(options.seeds),
        "intervals": lambda: intervals(options.interval_seeds),
        "time": lambda: speed(options.seeds),
        "peers": lambda: peers(options.peer_seeds, options.peer_python, options.peer_limit_s),
    }
    for name in options.sections.split(","):
        sections[name]()


if __name__ == "__main__":
    main()
