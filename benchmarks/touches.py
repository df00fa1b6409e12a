"""What touches of a machine's own probe are worth, on public records.

FL_THERMAL (`fl_thermal.py` says what it is): a model is identified on touches alone, one in each
interval before the rows that are judged, with noise, as `thermaxis identify --candidates "t*_C"`
does it, and then judged on every row: model alone (free run), with the offset that each touch
renews, probe and hold, nothing. A seed draws the noise and when in an interval it is touched; the
first row, where the datum is set, is touched as well. Figures are mean absolute errors in um, means
of the five channels, medians of the seeds; the drift of the offset is the default, 2 um in an hour.

    python benchmarks/touches.py                   rows 0 to 6668 learnt, 6669 to 8891 judged
    python benchmarks/touches.py splits            other rows of the same record
    python benchmarks/touches.py hostile 1000000   so many hostile cycles with hostile touches
"""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from fl_thermal import CANDIDATES, CHANNELS, RECORD, SAMPLE_TIME_S, SPLITS, columns_of

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from tests.unit.compensation.hostile_probe import HostileProbe, TouchLaws, touched_lathe
from thermaxis.compensation import CompensationModel, cycle, cycle_state
from thermaxis.thermal import (
    Identification,
    ThermalLog,
    TouchPlan,
    identify,
    parse_input,
    records_of,
    verify,
)

SEEDS = 8
RUN = 500
RULES = ("nothing", "probe_and_hold", "free_run", "with_offset")
"""Figures, and what was asked of the last three where 60, 30 and 120 min lie between touches."""
ASKED = {60: (3.4, 1.9, 1.6), 30: (None, None, 1.15), 120: (None, None, 2.2)}


def record() -> ThermalLog:
    """Return the whole record."""
    columns = columns_of(RECORD)
    wanted = {name: columns[name] for name in (*CANDIDATES, *CHANNELS)}
    return ThermalLog.from_columns(wanted, sample_time_s=SAMPLE_TIME_S, name="FL_THERMAL")


def plan_of(minutes: float, noise_um: float, seed: int) -> TouchPlan:
    """Return the touches of a seed."""
    first_s = float(np.random.default_rng(seed).uniform(0.0, 60.0 * minutes))
    plan = TouchPlan(every_s=60.0 * minutes, first_s=first_s, seed=seed)
    return replace(plan, rules=replace(plan.rules, noise_um=noise_um))


def touched(log: ThermalLog, plan: TouchPlan) -> ThermalLog:
    """Return a log in which displacements stand where `verify` touches, with its noise."""
    interval = np.floor((log.time_s - log.time_s[0] - plan.first_s) / (plan.every_s or 1.0) + 1e-9)
    rows = np.unique(interval, return_index=True)[1]
    columns = dict(log.columns)
    for number, name in enumerate(CHANNELS):
        shown = np.random.default_rng((plan.seed, number)).normal(
            columns[name], plan.rules.noise_um
        )
        columns[name] = np.full(log.rows, np.nan)
        columns[name][rows] = shown[rows]
    return ThermalLog.from_columns(columns, sample_time_s=SAMPLE_TIME_S, name="touches")


def learnt(log: ThermalLog) -> CompensationModel:
    """Return a model of touches alone."""
    inputs = [parse_input(name, channels=CANDIDATES) for name in CANDIDATES]
    records = records_of([log], inputs, CHANNELS)
    found: Identification = identify(records, choose=True)
    return found.to_compensation_model(records)


def judged(
    log: ThermalLog, learn: Sequence[int], judge: tuple[int, int], plan: TouchPlan
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return errors by rule and channel, shares within two sigma, and the mean likely drift."""
    model = learnt(touched(log, plan).span(learn[0], learn[1]))
    outputs = verify(model, [log], rows=judge, touches=plan).logs[0].outputs
    found = [o.touched for o in outputs if o.touched is not None]
    mae = np.array([[getattr(f, rule).mae_um for f in found] for rule in RULES])
    within = np.array([f.within_two_sigma for f in found], dtype=np.float64)
    drift = np.mean([f.likely_drift_um_per_root_h or np.nan for f in found])
    return mae, within, float(drift)


def compare(learn: Sequence[int], judge: tuple[int, int], minutes: Sequence[float]) -> None:
    log = record()
    print(f"learnt from touches in rows {learn[0]}:{learn[1]}, judged {judge[0]}:{judge[1]}")
    print("every min  noise   nothing     hold free run   offset  in 2 sigma   seeds: offset")
    for every in minutes:
        for noise_um in (1.0,):
            rows = [judged(log, learn, judge, plan_of(every, noise_um, s)) for s in range(SEEDS)]
            means = np.array([mae.mean(axis=1) for mae, _, _ in rows])
            within = float(np.mean([share for _, share, _ in rows]))
            medians = "".join(f"{v:9.2f}" for v in np.median(means, axis=0))
            each = " ".join(f"{v:.2f}" for v in means[:, -1])
            print(f"{every:9g}  {noise_um:5g} {medians}  {within:10.2f}   {each}")
        if every in ASKED:
            asked = "".join(f"{'' if v is None else v:>9}" for v in ASKED[int(every)])
            print(f"    asked at most{'':9}{asked}")


def hostile(cycles: int) -> None:
    outcomes: dict[str, int] = {}
    for seed in range(cycles // RUN):
        compensation = touched_lathe()
        world, laws = HostileProbe(compensation, 9_000_000 + seed), TouchLaws(compensation)
        state, output = cycle_state(compensation), None
        for _ in range(RUN):
            reading = world.reading(output)
            state, output = cycle(compensation, state, reading)
            laws.check(reading, state, output)
            for outcome in output.touch_outcomes:
                outcomes[outcome] = outcomes.get(outcome, 0) + 1
    print(f"{cycles} hostile cycles, no law broken; touches: {outcomes}")


def main(words: Sequence[str]) -> None:
    if words[:1] == ["hostile"]:
        hostile(int(words[1]) if len(words) > 1 else 100_000)
        return
    if words[:1] == ["splits"]:
        for learn, judge in SPLITS[1:4]:
            compare(learn, judge, (60.0,))
        return
    compare(*SPLITS[0], (60.0, 30.0, 120.0))


if __name__ == "__main__":
    main(sys.argv[1:])
