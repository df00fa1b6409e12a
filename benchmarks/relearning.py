"""Is a changed machine relearnt from its touches, and is one that did not change left alone?

A machine with two sources of heat works two shifts, and is touched each half hour while it works.
The model in force was identified from its first 14 days. From then on `relearn` looks each night at
the last 14 days, and the first proposal ends the trial:

changed      the time constant of the spindle is 40 % longer from day 14 on; proposals within 3 days
as it was    20 days without a change; a proposal is a false one

and without a change, what breaks the assumptions:

noise drifts   the probe's noise grows from 1 to 3 um in 10 days
wear           the tool wears by 4 um a day of work, and is changed every other day
hot days       the hall rises by 8 K on three days
chips          one of 50 touches is off by 20 to 50 um

    python benchmarks/relearning.py              20 seeds each
    python benchmarks/relearning.py 5 400 wear   5 seeds from 400 on, one trial
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from tests.touched_machine import DAY, HISTORY, INPUTS, Machine, history
from thermaxis.compensation import CompensationModel
from thermaxis.thermal import ModalOptions, ThermalLog, identify, records_of, relearn

SEEDS, FIRST = 20, 700
"""Thresholds were tuned on other seeds."""


TRIALS = {
    "changed": Machine(days=HISTORY + 3, slower=1.4),
    "as it was": Machine(),
    "noise drifts": Machine(noise_growth_um=2.0),
    "wear": Machine(wear_um=4.0),
    "hot days": Machine(heat_k=8.0),
    "chips": Machine(chips=0.02),
}


def in_force(log: ThermalLog) -> CompensationModel:
    """Return the model of the first days."""
    records = records_of([log.span(0, HISTORY * DAY)], INPUTS, ["Z_um"])
    found = identify(records, modal_options=ModalOptions(intervals=False))
    return found.to_compensation_model(records)


def nights(machine: Machine, seed: int, *, tell: bool) -> tuple[int | None, int]:
    """Return the day of the proposal, None for never, and how many nights were looked at."""
    log = history(machine, seed)
    model = in_force(log)
    for night in range(1, machine.days - HISTORY + 1):
        last = (HISTORY + night) * DAY
        found = relearn(log.span(last - HISTORY * DAY, last), model)
        (one,) = found.outputs
        if tell:
            said = [
                f"{'id' if c.learnt_s is None else f'{c.learnt_s / 86400:.0f}'}:"
                f" b {c.comparison.share:.2f}>{c.comparison.least_share:.2f}"
                f" {c.comparison.old_um:.2f}->{c.comparison.new_um:.2f}"
                f" free {c.free_run_um[0]:.1f}->{c.free_run_um[1]:.1f}"
                for c in one.candidates
            ]
            print(seed, night, one.why.code, one.touches, " | ".join(said), flush=True)
        if found.model is not None:
            return night, night
    return None, machine.days - HISTORY


def main() -> int:
    """Print a row for each trial."""
    numbers = [int(word) for word in sys.argv[1:] if word.isdigit()]
    seeds, first = (*numbers, SEEDS, FIRST)[:2] if len(numbers) < 2 else numbers[:2]
    names = [word for word in sys.argv[1:] if word in TRIALS] or list(TRIALS)
    tell = "tell" in sys.argv
    print("trial          seeds  proposals  on day                nights")
    for name in names:
        found = [nights(TRIALS[name], seed, tell=tell) for seed in range(first, first + seeds)]
        days = sorted(day for day, _ in found if day is not None)
        looked = sum(count for _, count in found)
        print(
            f"{name:14} {seeds:5}  {len(days):9}  {' '.join(map(str, days)):20}  {looked:6}",
            flush=True,
        )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
