"""Identification on four machines of tests/thermal_machines.py: the fit, rivals, intervals, time.

Figures are free runs from rest on another cold test of the same length, judged by its measured
displacement: fit = 100 (1 - |z - simulated| / |z - mean z|) in percent. Rows:

truth         the displacement without drift and noise; for machines that are no sum of lags the
              answer to the heat alone, which a model that follows the hall can pass
true lags     gains fitted under the estimator's own noise, the true time constants given
modal         the default estimator, default settings
averages      least squares on six exponential averages of each input
ridge         ridge on direct inputs and four lags (300, 1200, 3600, 10800 s)
ARX           order 2 and 2 on means over 60, 300 or 600 s, the one that runs best over its own log
static        least squares on the inputs

All count from the start of the log: none has an offset. Sections:

bench       the machine `direct`: 8 h with 40 tests, 72 h with 20, 1 Hz
rivals      every machine, as `identify` reads and `verify` runs it: error of `modal` over that of
            the best of ridge, ARX and static; logs of which anything is said of the rows held out,
            and of which nothing is though it is more than 10 % worse
verdicts    every machine, with and without a probe that drifts by 1 um/h: what `identify` says of
            rows held out, and whether its model is more than 10 % better on another log, without
            drift, than the better one of `averages` and `static`, as these methods write them
intervals   every machine, and a probe that drifts by 1 um/h: share of DC gains with an interval,
            share of intervals that hold the truth, width beside that with true lags given; of
            that fit the share that holds, and how much wider it is where the number of lags is
            given and their time constants are not (to first order, at the truth)
tests       every machine, after 8 h in which one source may be weak, or both run together: the test
            that is proposed beside the same with the other source. Error: root mean square in runs
            of one source for 20 h (half of it cooling) and of both at random, um
delays      every machine, and the virtual machine with lags or rods, both inputs late by 0, 300 or
            1800 s: share of 95 % intervals of `--delay auto` that hold it; error of what is used
            and width of the interval, where there is a delay. [s]
time        seconds of one fit and memory of a program of its own

    python benchmarks/thermal_machines.py [--sections bench,rivals] [--tests 40]
"""

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from benchmarks.virtual_thermal_test import Heating, ThermalTestPlan, generate_thermal_test
from tests.thermal_machines import KINDS, TRUE_TAU_S, Log, log, power
from thermaxis.codes import Message
from thermaxis.thermal import (
    Experiment,
    LogStart,
    Method,
    ModalOptions,
    ModalResult,
    ThermalLog,
    identify,
    modal,
    parse_input,
    records_of,
    simulate_modal,
    verify,
)
from thermaxis.thermal.design import next_test
from thermaxis.thermal.modal import Refinement, response_evidence

Array = NDArray[np.float64]
NAMES = ("spindle", "table")
INPUTS = [parse_input(f"{name}=T_{name}_c-T_column_c") for name in NAMES]
TOLD = [
    f"warning-{what}"
    for what in ("not_fit", "explains_nothing", "simple_left_less", "drift_held_out")
]
RIVALS_FROM = 500
"""First seed of the section `rivals`: none that a setting was chosen with."""
OTHER = 50_000
"""Seeds of the tests that are simulated, from here."""
NORMAL_95 = 1.959964
SIX_S = (300.0, 900.0, 2700.0, 7200.0, 14400.0, 28800.0)
FOUR_S = (300.0, 1200.0, 3600.0, 10800.0)


def fit_percent(reference: Array, simulated: Array) -> float:
    spread = np.linalg.norm(reference - np.mean(reference))
    return float(100.0 * (1.0 - np.linalg.norm(reference - simulated) / spread))


def experiment(test: Log) -> Experiment:
    column = test.temperatures_c[:, 2]
    start = column[: max(1, round(60.0 / test.step_s))].mean()
    return Experiment(test.step_s, test.u_k, test.z_um, ambient_k=column - start)


def free_run(result: ModalResult, test: Log) -> Array:
    rest = [np.zeros(part.gains.size) for part in result.model.parts]
    return simulate_modal(result.model, test.step_s, test.u_k, rest)


def lagged(u: Array, taus_s: tuple[float, ...], step_s: float) -> Array:
    keeps = np.exp(-step_s / np.array(taus_s))
    return np.column_stack([lfilter([0.0, 1.0 - k], [1.0, -k], c) for c in u.T for k in keeps])


def regression(test: Log, other: Log, taus_s: tuple[float, ...], ridge: float | None) -> Array:
    """Free run of a regression on lags; with a ridge on the direct inputs too."""

    def columns(one: Log) -> Array:
        lags = lagged(one.u_k, taus_s, one.step_s) if taus_s else one.u_k[:, :0]
        return lags if taus_s and ridge is None else np.column_stack([one.u_k, lags])

    f = columns(test)
    gram = f.T @ f
    gram += (ridge or 0.0) * np.diag(np.diag(gram))
    return columns(other) @ np.linalg.solve(gram, f.T @ test.z_um)


def arx(test: Log, other: Log) -> Array:
    """Free run of ARX(2, 2) with direct inputs, at the best of three sample times."""
    found: list[tuple[float, Array]] = []
    for mean_s in (60.0, 300.0, 600.0):
        rows = max(1, round(mean_s / test.step_s))

        def means(values: Array, rows: int = rows) -> Array:
            return values[: len(values) // rows * rows].reshape(-1, rows, *values.shape[1:]).mean(1)

        u, y = means(test.u_k), means(test.z_um)
        past = [y[1:-1], y[:-2], *u[2:].T, *u[1:-1].T, *u[:-2].T]
        a = np.linalg.lstsq(np.column_stack(past), y[2:], rcond=None)[0]
        poles = np.roots([1.0, -a[0], -a[1]])

        def run(v: Array, a: Array = a) -> Array:
            padded = np.vstack([np.zeros((2, v.shape[1])), v])
            k = v.shape[1]
            driven = padded[2:] @ a[2 : 2 + k] + padded[1:-1] @ a[2 + k : 2 + 2 * k]
            driven += padded[:-2] @ a[2 + 2 * k :]
            return lfilter([1.0], [1.0, -a[0], -a[1]], driven)

        if np.any(np.abs(poles) >= 1.0):
            continue
        at = (np.arange(len(means(other.z_um))) + 0.5) * rows
        simulated = np.interp(np.arange(len(other.z_um)), at, run(means(other.u_k)))
        found.append((fit_percent(y, run(u)), simulated))
    return max(found, key=lambda pair: pair[0])[1] if found else np.zeros(len(other.z_um))


RIVALS: dict[str, Callable[[Log, Log], Array]] = {
    "ridge": lambda test, other: regression(test, other, FOUR_S, 1e-3),
    "ARX": arx,
    "static": lambda test, other: regression(test, other, (), None),
}


def true_lags(test: Log, other: Log) -> tuple[Array, Array, Array, Array]:
    """Free run with the true time constants given, and its DC gains with standard deviations.

    The second of these are with the number of lags given and their time constants estimated.
    """
    evidence = response_evidence([experiment(test)])
    taus_s = np.array(TRUE_TAU_S)
    problem = Refinement(
        segments=evidence.segments, scales=evidence.scales, sizes=evidence.sizes.enlarged(2.0),
        free_start=True, experiments=1, bounds_s=(float(taus_s[0]), float(taus_s[-1])),
    )  # fmt: skip
    refined = problem.refined(taus_s, steps=0)
    unit = evidence.scales.y / evidence.scales.u
    wide = 1 + taus_s.size
    gains = unit[:, None] * refined.gains
    run = other.u_k @ gains[:, 0]
    run += lagged(other.u_k, TRUE_TAU_S, other.step_s) @ gains[:, 1:].ravel()
    # Time constants known: what is left of the covariance when their moves are given.
    cov, n = refined.covariance, 2 * wide
    known = cov[:n, :n] - cov[:n, n:] @ np.linalg.solve(cov[n:, n:], cov[n:, :n])
    parts = [slice(k * wide, (k + 1) * wide) for k in range(2)]
    stds = [unit * np.sqrt([c[p, p].sum() for p in parts]) for c in (known, cov)]
    return run, gains.sum(axis=1), *stds


def pair(kind: str, hours: float, seed: int, **more: float) -> tuple[Log, Log]:
    return log(kind, hours, seed, **more), log(kind, hours, OTHER + seed, **more)


def bench(tests: int) -> None:
    for hours, count in ((8.0, tests), (72.0, max(tests // 2, 1))):
        found: dict[str, list[float]] = {}
        for seed in range(count):
            test, other = pair("direct", hours, seed)
            runs = {
                "truth": other.clean_um,
                "true lags": true_lags(test, other)[0],
                "modal": free_run(modal([experiment(test)], input_names=NAMES), other),
                "averages": regression(test, other, SIX_S, None),
                **{name: rival(test, other) for name, rival in RIVALS.items()},
            }
            for name, run in runs.items():
                found.setdefault(name, []).append(fit_percent(other.z_um, run))
        print(f"\n{hours:g} h, 1 Hz, {count} tests: fit, %   median     p10   worst")
        for name, fits in found.items():
            values = (np.median(fits), np.quantile(fits, 0.1), min(fits))
            print(f"  {name:27s}" + "".join(f"{v:8.1f}" for v in values), flush=True)


WAYS = (Method.MODAL, Method.AVERAGES, Method.STATIC)


def as_used(test: Log, other: Log, method: Method = Method.MODAL) -> tuple[Array, Message | None]:
    """Error in free run of what `identify` writes of a log, and what it says of rows held out."""
    logs = [ThermalLog.from_columns(one.columns()) for one in (test, other)]
    records = records_of(logs[:1], INPUTS, ["Z_um"])
    found = identify(records, method=method)
    run = verify(found.to_compensation_model(records), logs[1:], start=LogStart.REST)
    output = run.logs[0].outputs[0]
    told = [w for w in found.outputs[0].warnings if w.code in TOLD]
    return output.measured_um - output.simulated_um, told[0] if told else None


def rivals(tests: int) -> None:
    print("\nmean absolute error of modal over that of the best of ridge, ARX and static")
    print(
        "  machine   hours  median   p90   told   not told   fits (median): truth modal ridge ARX"
    )
    good, told_of_good = 0, 0
    for kind in KINDS:
        for hours in (8.0, 72.0):
            ratios, fits, told = [], [], []
            for seed in range(RIVALS_FROM, RIVALS_FROM + tests):
                test, other = pair(kind, hours, seed, step_s=10.0)
                own, told_of = as_used(test, other)
                rivals = (rival(test, other) for rival in RIVALS.values())
                runs = [other.z_um - own, *rivals]
                errors = [np.mean(np.abs(other.z_um - run)) for run in runs]
                ratios.append(errors[0] / min(errors[1:]))
                told.append(told_of is not None)
                fits.append([fit_percent(other.z_um, run) for run in (other.clean_um, *runs)])
                good += max(fits[-1][2:]) >= 80.0
                told_of_good += told[-1] and max(fits[-1][2:]) >= 80.0
            middle = " ".join(f"{v:6.1f}" for v in np.median(fits, axis=0)[:4])
            silent = np.sum((np.array(ratios) > 1.1) & ~np.array(told))
            print(
                f"  {kind:9s} {hours:4g}  {np.median(ratios):6.2f} {np.quantile(ratios, 0.9):6.2f}"
                f" {np.sum(told):5d} {silent:8d}                 {middle}",
                flush=True,
            )
    print(f"anything is said of {told_of_good} of {good} logs whose best rule reaches 80 %")


def verdicts(tests: int) -> None:
    print("\nwhat is said of rows held out of one log, by what holds on another log without drift")
    print("  logs              said                 logs   better   alike   worse    fit (median)")
    for hours in (8.0, 72.0):
        for probe in (0.0, 1.0):
            rows: dict[str, list[tuple[float, float]]] = {}
            for kind, seed in product(KINDS, range(RIVALS_FROM, RIVALS_FROM + tests)):
                test = log(kind, hours, seed, step_s=10.0, probe_um_per_h=probe)
                other = log(kind, hours, OTHER + seed, step_s=10.0)
                found = [as_used(test, other, method) for method in WAYS]
                errors = [float(np.sqrt(np.mean(error**2))) for error, _ in found]
                fit = 100.0 * (1.0 - errors[0] / float(np.std(other.z_um)))
                code = found[0][1].code if found[0][1] else "nothing"
                rows.setdefault(code, []).append((min(errors[1:]) / errors[0], fit))
            for code, pairs in sorted(rows.items()):
                ratio, fits = np.array(pairs).T
                counts = [np.sum(ratio > 1.1), np.sum(abs(np.log(ratio)) <= np.log(1.1))]
                counts.append(len(ratio) - sum(counts))
                label = f"{hours:g} h" + (", probe 1 um/h" if probe else "")
                print(
                    f"  {label:17s} {code.removeprefix('warning-'):18s} {len(ratio):6d}"
                    + "".join(f"{n:8d}" for n in counts)
                    + f" {np.median(fits):12.1f}",
                    flush=True,
                )


def intervals(tests: int) -> None:
    print("\n95 % intervals of DC gains; sigma: largest error over its standard deviation")
    print("  machine          hours  have, %  hold the truth, %  sigma  width / with true lags")
    cases = [(kind, 0.0) for kind in KINDS] + [("direct", 1.0)]
    for hours in (72.0, 8.0):
        for kind, probe in cases:
            have, errors, widths, given = [], [], [], []
            for seed in range(tests):
                test = log(kind, hours, seed, step_s=10.0, probe_um_per_h=probe)
                result = modal([experiment(test)], input_names=NAMES)
                _, dc, known, free = true_lags(test, test)
                given += list(zip((dc - test.dc_gain) / known, free / known, strict=True))
                for k, (part, std) in enumerate(zip(result.model.parts, result.std, strict=True)):
                    have.append(std.dc_gain is not None)
                    if std.dc_gain is not None:
                        errors.append((part.dc_gain - test.dc_gain[k]) / std.dc_gain)
                        widths.append(std.dc_gain / known[k])
            inside = np.abs(errors) <= NORMAL_95
            label = kind + (", probe 1 um/h" if probe else "")
            beside = ""
            if kind == "direct":
                held, wider = np.abs(given)[:, 0] <= NORMAL_95, np.median(given, axis=0)[1]
                beside = f"{np.median(widths):8.2f}  these hold {100 * np.mean(held):.0f} %; "
                beside += f"lags not given {wider:.2f}"
            print(
                f"  {label:20s} {hours:3g} {100 * np.mean(have):7.0f} {100 * np.mean(inside):14.1f}"
                f" of {len(errors):3d} {np.max(np.abs(errors)):8.1f} {beside}",
                flush=True,
            )


def delayed(kind: str, seed: int, delay_s: float) -> Experiment:
    """Return 8 h whose displacement comes late; its start is held."""
    if kind in KINDS:
        made = experiment(log(kind, 8.0, seed, step_s=10.0))
        late = round(delay_s / made.sample_time_s)
        y = np.concatenate([np.full(late, made.y[0]), made.y[: made.y.size - late]])
        return replace(made, y=y)
    plan = ThermalTestPlan(sample_time_s=10.0, delay_s=delay_s, heating=Heating(kind))
    made = generate_thermal_test(plan, seed)
    return Experiment(10.0, made.u_k, made.z_um)


def delays(tests: int) -> None:
    print("\ndead times, 8 h: 95 % intervals that hold it; error and width where there is one, s")
    print("  machine     holds, %   error median   p90    width median   p90")
    options = ModalOptions(delays_s=(None, None), intervals=False)
    for kind in (*KINDS, *map(str, Heating)):
        inside, errors, widths = [], [], []
        for seed in range(RIVALS_FROM, RIVALS_FROM + tests):
            for delay_s in (0.0, 300.0, 1800.0):
                found = modal([delayed(kind, seed, delay_s)], input_names=NAMES, options=options)
                for part, std in zip(found.model.parts, found.std, strict=True):
                    low_s, high_s = std.delay_interval_s
                    inside.append(low_s <= delay_s <= high_s)
                    if delay_s:
                        errors.append(abs(part.delay_s - delay_s))
                        widths.append(high_s - low_s)
        columns = [
            f(v) for v in (errors, widths) for f in (np.median, lambda x: np.quantile(x, 0.9))
        ]
        print(
            f"  {kind:10s} {100 * np.mean(inside):5.1f} of {len(inside):3d}"
            + "".join(f"{value:10.0f}" for value in columns),
            flush=True,
        )


def heated(kind: str, heat: Array, seed: int) -> Log:
    return log(kind, len(heat) * 10.0 / 3600.0, seed, step_s=10.0, heat=heat)


def run_alone(source: int, on_s: float) -> Array:
    heat = np.zeros((2 * round(on_s / 10.0), 2))
    heat[: len(heat) // 2, source] = 1.0
    return heat


def error_in_use(result: ModalResult, kind: str, seed: int) -> float:
    rng = np.random.default_rng(seed)
    both = np.column_stack([power(2880, 10.0, rng) for _ in range(2)])
    uses = [run_alone(0, 36000.0), run_alone(1, 36000.0), both]
    runs = [heated(kind, heat, 90_000 + seed) for heat in uses]
    left = [np.mean((free_run(result, run) - run.clean_um) ** 2) for run in runs]
    return float(np.sqrt(np.mean(left)))


def proposed_tests(tests: int) -> None:
    print(
        "\nerror in use, um: before, after the proposed test, after the same with the other source"
    )
    print("  machine    tests   clear  before  proposed  other   proposed is best, or within 1.25")
    for kind in KINDS:
        rows: list[tuple[bool, float, float, float]] = []
        for seed in range(tests):
            for shares in ((1.0, 1.0), (1.0, 0.15), (0.15, 1.0), None):
                rng = np.random.default_rng(seed + 77)
                heat = np.column_stack([power(2880, 10.0, rng) for _ in range(2)])
                heat = heat[:, [0, 0]] if shares is None else heat * shares
                first = experiment(heated(kind, heat, seed))
                asked = next_test(response_evidence([first]), NAMES, (0, 0))
                best, other = asked.tests
                errors = [error_in_use(modal([first], input_names=NAMES), kind, seed)]
                for test in (best, other):
                    heat = run_alone(NAMES.index(test.input), best.on_s)
                    added = experiment(heated(kind, heat, 70_000 + seed))
                    result = modal([first, added], input_names=NAMES)
                    errors.append(error_in_use(result, kind, seed))
                rows.append((other.after_um > 1.5 * best.after_um, *errors))
        for clear in (False, True):
            found = np.array([row[1:] for row in rows if row[0] >= clear])
            ratio = found[:, 1] / found[:, 2]
            middle = " ".join(f"{value:8.1f}" for value in np.median(found, axis=0))
            print(
                f"  {kind:9s} {len(found):5d}   {'clear' if clear else 'all':5s} {middle}   "
                f" {np.sum(ratio <= 1.0)}, {np.sum(ratio <= 1.25)}",
                flush=True,
            )


MEMORY = """
import sys, time
from pathlib import Path
import numpy as np
from thermaxis.thermal.log._experiment import Experiment
from thermaxis.thermal.modal._modal import modal
case = np.load(sys.argv[1])
experiment = Experiment(1.0, case["u"], case["y"])
times = []
for _ in range(5):
    began = time.perf_counter()
    modal([experiment], input_names=("spindle", "table"))
    times.append(time.perf_counter() - began)
status = Path("/proc/self/status").read_text().splitlines()
peak = next(float(line.split()[1]) for line in status if line.startswith("VmHWM")) / 1024.0
print(f"{min(times):.2f} s, {peak:.0f} MB")
"""


def time_taken(_tests: int) -> None:
    for hours in (8.0, 72.0):
        test = log("direct", hours, 0)
        with tempfile.NamedTemporaryFile(suffix=".npz") as case:
            np.savez(case, u=test.u_k, y=test.z_um)
            case.flush()
            command = [sys.executable, "-c", MEMORY, case.name]
            done = subprocess.run(command, capture_output=True, text=True, check=True)
        print(f"{hours:g} h, 1 Hz: {done.stdout.strip()}", flush=True)


def main() -> None:
    sections = {
        "bench": bench,
        "rivals": rivals,
        "verdicts": verdicts,
        "intervals": intervals,
        "delays": delays,
        "tests": proposed_tests,
        "time": time_taken,
    }
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tests", type=int, default=40)
    parser.add_argument("--sections", default=",".join(sections))
    options = parser.parse_args()
    for name in options.sections.split(","):
        sections[name](options.tests)


if __name__ == "__main__":
    main()
