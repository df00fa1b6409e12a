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

Rows of every table, on the same tests:

truth                  as above: what nobody can pass
known time constants   gains fitted under the same noise, the true time constants given: what is
                       left of the gap is not the search's
modal                  the default estimator, default settings
static regression, 6 averages (least squares, or with a ridge), persistence (the first reading of
                       the simulated test stays)
one step ahead         the reading before stays: no free run, it knows the displacement; it shows
                       why one-step figures say nothing
SIPPY and the others   peers, on the first tests only; `n` is the number of tests of a row

Tests of 120 s hold means over blocks, as peers get them in their best case. Peers that fail or
pass the time allowed at a size are named with what they said; at 72 h they get their best case
only. At the end every criterion stands as "wanted, measured: met or not met"; one against a peer
names the peer's `n` and, where that is less than the estimator's, says on how many tests it is
shown. Sections: 8h 72h warm joint others rates intervals time.

    python benchmarks/identification.py [--seeds 20] [--sections 8h,time]
        [--peer-python PYTHON] [--peer-seeds 3] [--peer-limit-s 60] [--peers NAME,...]

Peers run in programs of their own (benchmarks/identification_peers.py), each fit bounded in time,
by the interpreter that `--peer-python` names (extra `bench`); without it they are left out.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from identification_peers import BASELINES, PEERS
from numpy.typing import NDArray

from benchmarks.virtual_thermal_test import (
    GeneratedThermalTest,
    Heating,
    Lags,
    ThermalTestPlan,
    generate_thermal_test,
)
from thermaxis.thermal import (
    Baseline,
    Experiment,
    ModalOptions,
    ModalPart,
    ModalResult,
    ThermalLog,
    ThermalModel,
    fit_baseline,
    identify,
    modal,
    parse_input,
    records_of,
    simulate_modal,
)
from thermaxis.thermal.modal import Refinement, response_evidence
from thermaxis.thermal.transfer_function import held

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


Rows: TypeAlias = dict[str, Array]
"""Fits by row: clean and measured, (n, 2). [%]"""
READINGS = ("clean", "measured")


@dataclass(slots=True)
class Run:
    """What the command asks for, and what has been found so far."""

    seeds: int
    interval_seeds: int
    peer_seeds: int
    peer_python: str | None
    peer_limit_s: float
    tables: dict[str, Rows] = field(default_factory=dict)
    verdicts: list[str] = field(default_factory=list)
    met: int = 0
    met_on_few: int = 0
    fits: int = 0
    unstable: int = 0
    sippy_oe_s: float | None = None
    sippy_oe_tests: int = 0
    peers: tuple[str, ...] = tuple(PEERS)

    def judge(
        self, what: str, wanted: str, measured: str, met: object, tests: int | None = None
    ) -> None:
        """Keep one line of the summary; `tests` is the number of a peer's tests."""
        said = "met" if met else "not met"
        self.met += bool(met)
        if tests is not None and tests < self.seeds:
            said += f", shown on {tests} {'test' if tests == 1 else 'tests'} only"
            self.met_on_few += bool(met)
        self.verdicts.append(f"{what}: wanted {wanted}, measured {measured}: {said}")

    def checked(self, result: ModalResult) -> ModalResult:
        """Count a result and whether it is stable."""
        self.fits += 1
        self.unstable += not all(np.all(p.time_constants_s > 0) for p in result.model.parts)
        return result


def shown(label: str, fits: Array, note: str = "") -> None:
    """Print median, lower quartile and worst of both readings; -99999 stands for all below it."""
    parts = [
        f"{np.median(v):8.1f} {np.quantile(v, 0.25):8.1f} {np.min(v):9.1f}"
        for v in np.maximum(fits, -99999.0).T
    ]
    print(f"  {label:21s} {'   '.join(parts)}  n={len(fits)} {note}".rstrip(), flush=True)


def headed(title: str) -> None:
    print(f"\n{title}")
    print(f"  {'':21s}    clean:   quarter     worst   measured: quarter     worst")


def known_lags(test: GeneratedThermalTest) -> ThermalModel:
    """Return gains fitted under the default noise, with the true time constants given."""
    evidence = response_evidence([experiment_of(test)])
    taus_s = np.array(TRUE_TAU_S)
    problem = Refinement(
        segments=evidence.segments,
        scales=evidence.scales,
        sizes=evidence.sizes.enlarged(2.0),
        free_start=True,
        experiments=1,
        bounds_s=(float(taus_s[0]), float(taus_s[-1])),
    )
    design, mean, _ = problem.solved(taus_s)
    unit = evidence.scales.y / evidence.scales.u
    gains = unit[:, None] * mean[: design.gains].reshape(2, -1)
    return ThermalModel(
        tuple(ModalPart(n, float(g[0]), g[1:], taus_s) for n, g in zip(NAMES, gains, strict=True))
    )


def baseline(name: str, test: GeneratedThermalTest, other: GeneratedThermalTest) -> Array:
    """Return a baseline's free run; averages need every row, so what is missing is held."""
    if name == "persistence":
        return np.full(other.z_um.size, other.z_um[0])
    if name == "one step ahead":
        return np.concatenate([other.z_um[:1], other.z_um[:-1]])
    u, _ = held(test.u_k)
    y, _ = held(test.z_um[:, None])
    return BASELINES[name](u, y[:, 0], other.u_k, test.plan.sample_time_s)


BESIDE = (*BASELINES, "persistence", "one step ahead")


def compared(run: Run, title: str, plan: ThermalTestPlan, *, ask_peers: bool) -> list[ModalResult]:
    """Print and keep truth, modal, baselines and peers on the same tests."""
    headed(title)
    exact = plan.heating is Heating.LAGS and plan.delay_s == 0 and plan.missing_share == 0
    labels = ["truth", *(["known time constants"] if exact else []), "modal", *BESIDE]
    found: dict[str, list[tuple[float, float]]] = {label: [] for label in labels}
    results: list[ModalResult] = []
    for seed in range(run.seeds):
        test, other = pair(plan, seed)
        results.append(run.checked(identified(test)))
        found["truth"].append(own_scores(other))
        if exact:
            found["known time constants"].append(scores(other, from_rest(known_lags(test), other)))
        found["modal"].append(scores(other, freed(other, results[-1])))
        for name in BESIDE:
            found[name].append(scores(other, baseline(name, test, other)))
    rows = {label: np.array(values) for label, values in found.items()}
    lags = np.bincount([r.model.parts[0].gains.size for r in results])
    told = {n: c for n, c in enumerate(lags.tolist()) if c}
    for label, fits in rows.items():
        shown(label, fits, f"lags {told}" if label == "modal" else "")
    if ask_peers:
        rows |= peer_rows(run, title, plan)
    run.tables[title] = rows
    gap = np.median(rows["truth"], axis=0) - np.median(rows["modal"], axis=0)
    print(f"  median of modal behind the truth: {gap[0]:.2f} (clean), {gap[1]:.2f} (measured)")
    return results


def peer_rows(run: Run, title: str, plan: ThermalTestPlan) -> Rows:
    """Print and return the peers on the first tests."""
    if run.peer_python is None:
        print("  peers left out: name an interpreter that has them with --peer-python")
        return {}
    tests = [pair(plan, seed) for seed in range(run.peer_seeds)]
    rows: Rows = {}
    for name in run.peers:
        found, times, failure = [], [], ""
        for test, other in tests:
            answer = peer_fit(name, test, other, run.peer_python, run.peer_limit_s)
            if isinstance(answer, str):
                # Whoever fails once at this size is not asked again.
                failure = answer
                break
            found.append(scores(other, answer[0]))
            times.append(answer[1])
        if found:
            rows[name] = np.array(found)
            shown(name, rows[name], f"{np.median(times):.2f} s")
        if failure:
            print(f"  {name:21s} {failure}", flush=True)
        if name == "SIPPY OE" and found and title == title_of(8.0, 1.0):
            run.sippy_oe_s, run.sippy_oe_tests = float(np.median(times)), len(times)
    return rows


def rivals(rows: Rows, names: Sequence[str], reading: int) -> tuple[str, float, int]:
    """Return who of some rows has the best median, it, and the fewest tests of any of them."""
    medians = {n: float(np.median(rows[n][:, reading])) for n in names if n in rows}
    best = max(medians, key=lambda n: medians[n])
    who = f"{best}, n={len(rows[best])}"
    return who, medians[best], min(len(rows[n]) for n in medians)


def judged(run: Run, title: str, reading: int, behind: float, over: float) -> None:
    """Keep how a table stands: points behind the truth, and points over the best rival."""
    rows, said = run.tables[title], READINGS[reading]
    modal_fit = rows["modal"][:, reading]
    middle = float(np.median(modal_fit))
    gap = float(np.median(rows["truth"][:, reading])) - middle
    what = f"{title} ({said})"
    if np.isfinite(behind):
        run.judge(what, f"median at most {behind:g} behind the truth", f"{gap:.2f}", gap <= behind)
    for kind, names in (("baseline", (*BASELINES, "persistence")), ("peer", tuple(PEERS))):
        if not any(n in rows for n in names):
            continue
        who, best, tests = rivals(rows, names, reading)
        wanted = f"median above every {kind}" + (f" less {-over:g}" if over < 0 else "")
        measured = f"{middle:.1f} (n={len(modal_fit)}) against {best:.1f} ({who})"
        run.judge(what, wanted, measured, middle >= best + over, tests)


def title_of(hours: float, step_s: float, more: str = "cold") -> str:
    return f"{hours:g} h, {step_s:g} s, {more}"


def short_tests(run: Run) -> None:
    for step_s in (1.0, 10.0, 120.0):
        title = title_of(8.0, step_s)
        compared(run, title, plan_of(8.0, step_s), ask_peers=True)
        rows = run.tables[title]
        for reading, said in enumerate(READINGS):
            judged(run, title, reading, 4.0, 0.0)
            fits = rows["modal"][:, reading]
            low, worst = float(np.quantile(fits, 0.25)), float(np.min(fits))
            if any(n in rows for n in PEERS):
                who, best, tests = rivals(rows, tuple(PEERS), reading)
                run.judge(
                    f"{title} ({said})", "lower quartile above every peer's median",
                    f"{low:.1f} (n={len(fits)}) against {best:.1f} ({who})", low > best, tests,
                )  # fmt: skip
            run.judge(f"{title} ({said})", "worst at least 60", f"{worst:.1f}", worst >= 60)


def long_tests(run: Run) -> None:
    for step_s in (1.0, 10.0, 120.0):
        title = title_of(72.0, step_s)
        # Peers get their best case: at 1 s several of them pass any limit of time or memory.
        compared(run, title, plan_of(72.0, step_s), ask_peers=step_s > 10.0)
        for reading in range(2):
            judged(run, title, reading, 0.5, -0.2)


def warm(run: Run) -> None:
    for step_s in (1.0, 10.0, 120.0):
        title = title_of(8.0, step_s, "begins after 5 h")
        plan = plan_of(8.0, step_s, warm_up_h=5.0)
        results = compared(run, title, plan, ask_peers=step_s > 1.0)
        for reading in range(2):
            judged(run, title, reading, np.inf, 0.0)
        no_dc = np.mean([[s.dc_gain is None for s in r.std] for r in results])
        told = np.mean([any(s.flags for s in r.std) or bool(r.warnings) for r in results])
        print(f"  DC gains without an interval {100 * no_dc:.0f} %")
        run.judge(
            title, "what it cannot show is said", f"in {100 * told:.0f} % of tests", told == 1.0
        )


def joint(run: Run) -> None:
    for step_s in (1.0, 10.0, 120.0):
        title = f"8 h cold and 8 h warm, {step_s:g} s, alone and joined in one call"
        headed(title)
        plan = plan_of(8.0, step_s)
        found: dict[str, list[tuple[float, float]]] = {"cold": [], "warm": [], "joined": []}
        for name in (*BASELINES, "persistence"):
            found[f"{name}, cold"] = []
        for seed in range(run.seeds):
            cold, other = pair(plan, seed)
            late = generate_thermal_test(replace(plan, warm_up_h=5.0), 2000 + seed)
            for label, tests in (("cold", (cold,)), ("warm", (late,)), ("joined", (cold, late))):
                result = run.checked(identified(*tests))
                found[label].append(scores(other, freed(other, result)))
            for name in (*BASELINES, "persistence"):
                found[f"{name}, cold"].append(scores(other, baseline(name, cold, other)))
        rows = {label: np.array(values) for label, values in found.items()}
        for label, fits in rows.items():
            shown(label, fits)
        gain = rows["joined"] - rows["cold"]
        error = np.std(gain, axis=0, ddof=1) / np.sqrt(len(gain))
        for reading, said in enumerate(READINGS):
            print(
                f"  joined less cold, pair by pair ({said}): mean {np.mean(gain[:, reading]):.2f},"
                f" standard error {error[reading]:.2f}, better in"
                f" {100 * np.mean(gain[:, reading] > 0):.0f} %"
            )
            both, one, two = (
                float(np.median(rows[n][:, reading])) for n in ("joined", "cold", "warm")
            )
            run.judge(
                f"8 h joined, {step_s:g} s ({said})", "median above each alone",
                f"{both:.1f} against {one:.1f} (cold) and {two:.1f} (warm)", both > max(one, two),
            )  # fmt: skip


def rates(run: Run) -> None:
    print("\nDC gain by sample time, 72 h: largest difference of the three [%]")
    worst = []
    for seed in range(run.seeds):
        results = [
            run.checked(identified(generate_thermal_test(plan_of(72.0, step_s), seed)))
            for step_s in (1.0, 10.0, 120.0)
        ]
        dc = np.array([[p.dc_gain for p in r.model.parts] for r in results])
        worst.append(100.0 * np.ptp(dc, axis=0) / np.mean(dc, axis=0))
    middle, largest = np.median(worst, axis=0), np.max(worst, axis=0)
    for name, m, x in zip(NAMES, middle.tolist(), largest.tolist(), strict=True):
        print(f"  {name:8s} median {m:.2f}, largest {x:.2f}   n={run.seeds}")
        run.judge(
            f"72 h, DC gain of {name} at 1, 10 and 120 s", "the same within 3 % in every test",
            f"median {m:.2f} %, largest {x:.2f} %", x <= 3.0,
        )  # fmt: skip


def others(run: Run) -> None:
    cases = {
        "conduction rods": {"heating": Heating.RODS},
        "delay of 90 s": {"delay_s": 90.0},
        "5 % missing": {"missing_share": 0.05},
    }
    for hours in (8.0, 72.0):
        for name, more in cases.items():
            title = title_of(hours, 10.0, name)
            compared(run, title, plan_of(hours, 10.0, **more), ask_peers=False)
            for reading in range(2):
                judged(run, title, reading, np.inf, 0.0 if hours < 72 else -0.2)


def hit_lists(result: ModalResult) -> dict[str, bool]:
    """Return which intervals there are and whether they hold the truth."""
    inside: dict[str, bool] = {}
    for part, std, dc in zip(result.model.parts, result.std, TRUE_DC, strict=True):
        if std.dc_gain is not None:
            hit = abs(part.dc_gain - dc) <= NORMAL_95 * std.dc_gain
            inside[f"DC {part.input_name}"] = bool(hit)
    part, std = result.model.parts[0], result.std[0]
    if part.gains.size == len(TRUE_TAU_S):
        for tau_s, known, true_s in zip(
            part.time_constants_s, std.time_constants_s, TRUE_TAU_S, strict=True
        ):
            if known is not None:
                inside[f"{true_s:g} s"] = bool(abs(tau_s - true_s) <= NORMAL_95 * known)
    return inside


def intervals(run: Run) -> None:
    print("\n95 % intervals on 72 h, 10 s: share that holds the truth [%], and how many there are")
    for label, hall in (("drift independent", 0.0), ("drift follows the hall", 0.6)):
        inside: dict[str, list[bool]] = {}
        for seed in range(run.interval_seeds):
            plan = plan_of(72.0, 10.0, hall_drift_um_per_k=hall)
            result = run.checked(identified(generate_thermal_test(plan, 10000 + seed)))
            for name, hit in hit_lists(result).items():
                inside.setdefault(name, []).append(hit)
        texts = [f"{k}: {100 * np.mean(v):.0f} ({len(v)})" for k, v in inside.items()]
        print(f"  {label:24s} {', '.join(texts)}", flush=True)
        pooled: dict[str, list[bool]] = {}
        for name, hits in inside.items():
            pooled.setdefault("DC gains" if name.startswith("DC") else "time constants", []).extend(
                hits
            )
        for name, hits in (*pooled.items(), *inside.items()):
            share = 100.0 * float(np.mean(hits))
            wanted = "90 to 98 %" if hall == 0.0 else "to be printed"
            run.judge(
                f"72 h, 95 % intervals of {name}, {label}", wanted,
                f"{share:.1f} % of {len(hits)}", hall > 0.0 or 90.0 <= share <= 98.0,
            )  # fmt: skip


def best_time(call: Callable[[], object], repeats: int) -> float:
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        call()
        times.append(time.perf_counter() - began)
    return min(times)


MEMORY = """
import sys
from pathlib import Path
import numpy as np
from thermaxis.thermal.log._experiment import Experiment
from thermaxis.thermal.modal._modal import modal
with np.load(sys.argv[1]) as case:
    experiment = Experiment(1.0, case["u"], case["y"])
modal([experiment], input_names=("spindle", "table"))
status = Path("/proc/self/status").read_text().splitlines()
print(next(float(line.split()[1]) for line in status if line.startswith("VmHWM")) / 1024.0)
"""


def peak_mb(experiment: Experiment) -> float:
    """Return the largest memory of a program that loads a record and searches it. [MB]

    The kernel's own count: that of `resource` includes the program that started it.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "case.npz"
        np.savez(path, u=experiment.u, y=experiment.y)
        done = subprocess.run(
            [sys.executable, "-c", MEMORY, str(path)], capture_output=True, text=True, check=True
        )
    return float(done.stdout)


def whole_command(run: Run) -> None:
    """Print what identification takes inside `thermaxis identify`, reading left out."""
    log = ThermalLog.from_columns(generate_thermal_test(plan_of(8.0, 1.0), 1).columns())
    inputs = [
        parse_input("spindle=T_spindle_c-T_column_c"),
        parse_input("table=T_table_c-T_column_c"),
    ]
    records = records_of([log], inputs, ["Z_um"])
    experiments = records.experiments["Z_um"]
    steps: dict[str, Callable[[], object]] = {
        "records of the log": lambda: records_of([log], inputs, ["Z_um"]),
        "identification, all": lambda: identify(records),
        "search alone": lambda: modal(experiments, input_names=NAMES),
        "static baseline": lambda: fit_baseline(Baseline.RIDGE, experiments),
        "averages baseline": lambda: fit_baseline(Baseline.AVERAGES_RIDGE, experiments),
    }
    print("\nInside `thermaxis identify`, 8 h at 1 Hz, two inputs, best of seven [s]")
    taken = {name: best_time(call, 7) for name, call in steps.items()}
    for name, time_s in taken.items():
        print(f"  {name:21s} {time_s:.4f} s")
    beside = taken["static baseline"] + taken["averages baseline"]
    run.judge(
        "8 h at 1 Hz", "baselines faster than the search",
        f"{beside:.3f} s against {taken['search alone']:.3f} s", beside < taken["search alone"],
    )  # fmt: skip


def speed(run: Run) -> None:
    whole_command(run)
    print("\nTime of the whole default search, best of seven [s], memory of a program of its own")
    taken: dict[float, float] = {}
    limits = {8.0: 0.3, 72.0: 0.6}
    for hours in (8.0, 24.0, 72.0, 144.0):
        experiment = experiment_of(generate_thermal_test(plan_of(hours, 1.0), 1))
        taken[hours] = best_time(lambda e=experiment: modal([e], input_names=NAMES), 7)
        peak = peak_mb(experiment)
        print(f"  {hours:5g} h at 1 s: {taken[hours]:.3f} s, {peak:.0f} MB", flush=True)
        what = f"{hours:g} h at 1 Hz, two inputs"
        if hours in limits:
            met = taken[hours] < limits[hours]
            run.judge(what, f"search under {limits[hours]} s", f"{taken[hours]:.3f} s", met)
            run.judge(what, "memory under 300 MB", f"{peak:.0f} MB", peak < 300.0)
    ratio = taken[144.0] / taken[72.0]
    run.judge("144 h over 72 h at 1 Hz", "time at most doubled", f"{ratio:.2f} times", ratio <= 2.0)
    if run.sippy_oe_s is not None:
        faster = run.sippy_oe_s / taken[8.0]
        run.judge(
            "8 h at 1 Hz", "50 times faster than SIPPY's OE of order 3",
            f"{faster:.0f} times", faster >= 50.0, run.sippy_oe_tests,
        )  # fmt: skip


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


def main() -> None:
    sections: dict[str, Callable[[Run], None]] = {
        "8h": short_tests,
        "72h": long_tests,
        "warm": warm,
        "joint": joint,
        "others": others,
        "rates": rates,
        "intervals": intervals,
        "time": speed,
    }
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--interval-seeds", type=int, default=100)
    parser.add_argument("--peer-seeds", type=int, default=3)
    parser.add_argument("--peer-python", help="interpreter that has the peers (extra bench)")
    parser.add_argument("--peers", default=",".join(PEERS), help="those that are asked")
    parser.add_argument("--peer-limit-s", type=float, default=60.0)
    parser.add_argument("--sections", default=",".join(sections))
    options = parser.parse_args()
    run = Run(
        seeds=options.seeds,
        interval_seeds=options.interval_seeds,
        peer_seeds=options.peer_seeds,
        peer_python=options.peer_python,
        peer_limit_s=options.peer_limit_s,
        peers=tuple(options.peers.split(",")),
    )
    if run.peer_python is None:
        print("no peers: name an interpreter that has them with --peer-python")
    for name in options.sections.split(","):
        sections[name](run)
    run.judge("every fit", "stable", f"{run.unstable} of {run.fits} not", run.unstable == 0)
    print(f"\nSummary: {run.met} of {len(run.verdicts)} met", end="")
    print(f", {run.met_on_few} of them shown on fewer tests of the peers" * (run.met_on_few > 0))
    for line in run.verdicts:
        print(f"  {line}")


if __name__ == "__main__":
    main()
