"""A fleet whose truth is known, looked after for four nights: what is named of what was planted.

python -m benchmarks.demo_fleet                     40 machines, into demo-fleet/
python -m benchmarks.demo_fleet FOLDER 12 --workers 4

Machines are simulated, shipped to a lake, identified from their first ten days and verified on the
nights after, all on a Dask cluster of this computer. FOLDER keeps registry.db and lake/.
"""

import argparse
import shutil
import sys
import tempfile
import time
from collections.abc import Iterable, Sequence
from dataclasses import replace
from datetime import UTC, date, datetime, timedelta
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks import fleet_machines as machines
from thermaxis.files import format_model, model_sha256
from thermaxis.fleet import (
    Cause,
    Engine,
    FleetMachine,
    Lake,
    NightJob,
    Registry,
    axis_run,
    dask_engine,
    do_nights,
    results_of,
)
from thermaxis.virtual import paper_x_axis

BACK, YEARS = 6, 6
HALL = machines.Hall(seed=11, fault_share=0.15)
"""Its nights are those of four working days."""


def delivered(folder: Path, machine: machines.Machine) -> FleetMachine:
    """Let a machine work, ship its days, and return it with the model of its first days."""
    cycles = machines.cycles_of(HALL, machine)
    with tempfile.TemporaryDirectory() as own:
        machines.shipped(Path(own), Lake(str(folder / "lake")), machine, cycles)
    model = machines.model_of(machine, cycles)
    return FleetMachine(machine.name, machine.kind, format_model(model), model_sha256(model))


def measure_axes(registry: Registry, machine: str) -> None:
    """Store the runs of an axis whose backlash grows by half a micrometre a year."""
    for k in range(YEARS):
        test = paper_x_axis(k, cycles=5).test
        worn = test.deviation + 0.5 * k * np.array([0.0, 1.0])
        start = datetime(machines.MONDAY.year - YEARS + k, 11, 2, 8, tzinfo=UTC)
        run = replace(test, deviation=worn, start=start, end=None)
        registry.add_axis_run(axis_run(machine, "X", run, start, f"{start.year}.csv", f"{k:064x}"))


def look_after(
    registry: Registry, engine: Engine, fleet: list[machines.Machine], days: Sequence[date]
) -> None:
    """Simulate, ship and identify every machine, then do the nights, the earliest first."""
    folder = Path(registry.lake).parent
    for number, (_, found) in enumerate(
        results_of(engine, partial(delivered, folder), fleet), start=1
    ):
        if isinstance(found, BaseException):
            raise found
        registry.add(found, f"from its first {machines.LEARNT} days")
        said(f"{number} of {len(fleet)} machines", done=number == len(fleet))
    measure_axes(registry, fleet[0].name)
    for day in days:
        jobs = [NightJob(one, day, BACK, registry.lake) for one in registry.missing(day)]
        done = do_nights(registry, jobs, engine, report=lambda *_: None)
        said(f"night of {day}: {done.stored} of {done.asked} stored", done=True)


def judged(registry: Registry, fleet: Iterable[machines.Machine], days: Sequence[date]) -> str:
    """Return what the mornings after days have named of what was planted, and what falsely."""
    planted = {one.name: one for one in fleet if one.fault is not None}
    first, false = dict[str, Cause](), set[str]()
    for day in days:
        for one in registry.judge(day):  # stored for the board, as by thermaxis fleet night
            fault = planted.get(one.machine)
            if one.named and (fault is None or day < fault.since):
                false.add(one.machine)
            elif one.named:
                first.setdefault(one.machine, one.causes[0])
    for name, one in planted.items():
        print(f"{name}: {one.fault} since {one.since}, named: {first.get(name, 'not yet')}")
    right = sum(planted[name].fault is cause for name, cause in first.items())
    return f"named {len(first)} of {len(planted)} planted (right cause {right}), {len(false)} false"


def said(text: str, *, done: bool, begun_s: float = time.monotonic()) -> None:
    """Show how far it is: one line that grows on a terminal, the last one alone elsewhere."""
    if done or sys.stdout.isatty():
        print(
            f"{time.monotonic() - begun_s:5.0f} s  {text}", end="\n" if done else "\r", flush=True
        )


def main(words: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=Path("demo-fleet"))
    parser.add_argument("machines", nargs="?", type=int, default=40)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--nights", type=int, default=HALL.days - machines.LEARNT)
    asked = parser.parse_args(words)
    registry = asked.folder / "registry.db"
    own = asked.folder.name == "demo-fleet" and registry.exists()  # a fleet's is never removed
    if asked.folder.exists() and any(asked.folder.iterdir()) and not own:
        raise SystemExit(f"{asked.folder} has other files: name a new folder")
    shutil.rmtree(asked.folder, ignore_errors=True)
    lake = asked.folder.absolute() / "lake"
    lake.mkdir(parents=True)
    fleet = machines.machines_of(HALL, asked.machines)
    last_days = range(HALL.days - asked.nights, HALL.days)
    days = [HALL.first + timedelta(days=k) for k in last_days]
    with (
        Registry.make(f"sqlite:///{registry}", str(lake)) as opened,
        dask_engine(workers=asked.workers) as engine,
    ):
        look_after(opened, engine, fleet, days)
        last = judged(opened, fleet, days)
    print(last)


if __name__ == "__main__":
    main()
