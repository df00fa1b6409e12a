"""What touches of a machine's own probe are worth, on public records.

FL_THERMAL (`fl_thermal.py` says what it is): a model is identified on touches alone, one in each
interval before the rows that are judged, with noise, as `thermaxis identify --candidates "t*_C"`
does it, and then judged on every row: model alone (free run), with the offset that each touch
renews, probe and hold, nothing. A seed draws the noise and when in an interval it is touched; the
first row, where the datum is set, is touched as well. Figures are mean absolute errors in um, means
of the five channels, medians of the seeds; the drift of the offset is the default, 2 um in an hour.

    python benchmarks/touches.py                   rows 0 to 6668 learnt, 6669 to 8891 judged
    python benchmarks/touches.py splits            other rows of the same record
    python benchmarks/touches.py frames            frames of printers, where each homing is a touch
    python benchmarks/touches.py hostile 1000000   so many hostile cycles with hostile touches

A frame is homed three times each minute. The median is what is judged; touches are the first homing
of a burst, as it came, every 10 or 30 minutes. The drift is the likeliest in what was learnt from.
"""

import csv
import sys
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
from fl_thermal import CANDIDATES, CHANNELS, RECORD, SAMPLE_TIME_S, SPLITS, columns_of

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from tests.unit.compensation.hostile_probe import HostileProbe, TouchLaws, touched_lathe
from thermaxis.compensation import CompensationModel, cycle, cycle_state
from thermaxis.errors import DataError
from thermaxis.thermal import (
    Identification,
    ThermalLog,
    TouchPlan,
    identify,
    parse_input,
    records_of,
    verify,
)

FRAMES = RECORD.parents[1] / "frames"
FRAME_INPUTS = ("frame_t", "chamber_t", "bed_t")
STEP_UM = {"annex": 1.25, "voron": 2.5}
SEEDS = 8
NOISE_UM = 1.0
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


def touched(log: ThermalLog, first_row: int, plan: TouchPlan) -> ThermalLog:
    """Return a log in which displacements stand where `verify` touches, with its noise."""
    since_s = log.time_s - log.time_s[first_row] - plan.first_s
    interval = np.floor(since_s / (plan.every_s or 1.0) + 1e-9)
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
) -> tuple[np.ndarray, np.ndarray]:
    """Return errors by rule and channel, and shares within two sigma."""
    model = learnt(touched(log, judge[0], plan).span(learn[0], learn[1]))
    outputs = verify(model, [log], rows=judge, touches=plan).logs[0].outputs
    found = [o.touched for o in outputs if o.touched is not None]
    mae = np.array([[getattr(f, rule).mae_um for f in found] for rule in RULES])
    return mae, np.array([f.within_two_sigma for f in found], dtype=np.float64)


def compare(learn: Sequence[int], judge: tuple[int, int], minutes: Sequence[float]) -> None:
    log = record()
    print(f"learnt from touches in rows {learn[0]}:{learn[1]}, judged {judge[0]}:{judge[1]}")
    print("every min  noise   nothing     hold free run   offset  in 2 sigma   seeds: offset")
    for every in minutes:
        rows = [judged(log, learn, judge, plan_of(every, NOISE_UM, s)) for s in range(SEEDS)]
        means = np.array([mae.mean(axis=1) for mae, _ in rows])
        within = float(np.mean([share for _, share in rows]))
        medians = "".join(f"{v:9.2f}" for v in np.median(means, axis=0))
        each = " ".join(f"{v:.2f}" for v in means[:, -1])
        print(f"{every:9g}  {NOISE_UM:5g} {medians}  {within:10.2f}   {each}")
        if every in ASKED and learn == SPLITS[0][0]:
            asked = "".join(f"{'' if v is None else v:>9}" for v in ASKED[int(every)])
            print(f"    asked at most{'':9}{asked}")


def frame(path: Path) -> ThermalLog:
    """Return a run: median of each burst of homings, and its first one."""
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    bursts: dict[str, list[dict[str, str]]] = {}
    for row in csv.DictReader(lines):
        bursts.setdefault(row["sample"], []).append(row)
    steps = [np.array([float(row["mcu_pos_z"]) for row in b]) for b in bursts.values()]
    step_um = STEP_UM[path.name[:5]]
    z, first = step_um * np.array([(np.median(s), s[0]) for s in steps]).T
    times = [
        datetime.strptime(f"{b[0]['time']}+0000", "%Y/%m/%d-%H:%M:%S%z") for b in bursts.values()
    ]
    columns = {
        name: np.array([np.mean([float(row[name]) for row in b]) for b in bursts.values()])
        for name in FRAME_INPUTS
    }
    columns |= {"Z_um": z - z[0], "homed_um": first - z[0]}
    time_s = np.array([(at - times[0]).total_seconds() for at in times])
    return ThermalLog.from_columns(columns, time_s=time_s, name=path.stem[:16])


def homed(log: ThermalLog, minutes: float, name: str) -> ThermalLog:
    """Return a log with so rare homings in a column."""
    rows = np.unique(np.floor(log.time_s / (60.0 * minutes) + 1e-9), return_index=True)[1]
    touches = np.full(log.rows, np.nan)
    touches[rows] = log.columns["homed_um"][rows]
    return replace(log, columns={**log.columns, name: touches})


def frames() -> None:
    logs = [frame(path) for path in sorted(FRAMES.glob("*.csv"))]
    inputs = [parse_input(name) for name in FRAME_INPUTS]
    cases = [(log, log, log.rows // 2) for log in logs]
    cases += [(logs[1], logs[2], 0), (logs[2], logs[1], 0)]
    print("learnt -> judged                     every min  drift     hold free run   offset")
    for learn, judge, half in cases:
        for minutes in (10.0, 30.0):
            label = f"{learn.name} -> {'its second half' if half else judge.name}"
            part = homed(learn, minutes, "Z_um")
            try:
                records = records_of([part.span(0, half) if half else part], inputs, ["Z_um"])
            except DataError as error:
                print(f"{label:<36} {minutes:9g}  {error.message.code}")
                continue
            model = identify(records).to_compensation_model(records)
            plan = TouchPlan(channels={"Z_um": "probe_um"})
            plan = replace(plan, rules=replace(plan.rules, noise_um=2.0, start_um=20.0))
            known = verify(model, [homed(learn, minutes, "probe_um")], touches=plan)
            plan = replace(plan, rules=known.logs[0].outputs[0].touched.likely or plan.rules)
            drift = plan.rules.drift_um_per_root_h
            rows = (half, judge.rows) if half else None
            found = verify(model, [homed(judge, minutes, "probe_um")], rows=rows, touches=plan)
            touched = found.logs[0].outputs[0].touched
            mae = "".join(f"{getattr(touched, rule).mae_um:9.2f}" for rule in RULES[1:])
            print(f"{label:<36} {minutes:9g}  {drift:5.1f}{mae}{'  off' if touched.off else ''}")


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
    listed = ", ".join(f"{count} {outcome}" for outcome, count in outcomes.items())
    print(f"{cycles} hostile cycles, no law broken; touches: {listed}")


def main(words: Sequence[str]) -> None:
    if words[:1] == ["hostile"]:
        hostile(int(words[1]) if len(words) > 1 else 100_000)
        return
    if words[:1] == ["frames"]:
        frames()
        return
    if words[:1] == ["splits"]:
        for learn, judge in SPLITS[1:4]:
            compare(learn, judge, (60.0,))
        return
    compare(*SPLITS[0], (60.0, 30.0, 120.0))


if __name__ == "__main__":
    main(sys.argv[1:])
