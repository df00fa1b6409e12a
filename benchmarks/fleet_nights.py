"""What a night of a fleet costs: processor time and memory of one, engine, registry.

python -m benchmarks.fleet_nights        7 days of minutes, 20 nights
python -m benchmarks.fleet_nights 60 2       60 nights, on two workers of Dask as well
"""

import resource
import sys
import tempfile
import time
from datetime import timedelta
from pathlib import Path

import psutil

from tests.unit.fleet import fleet_machines as machines
from thermaxis.fleet import (
    Lake,
    NightJob,
    NightOutcome,
    NightResult,
    Registry,
    dask_engine,
    results_of,
    serial_engine,
    work,
)

BACK, ROWS = 6, 20_000
LAST = machines.FIRST + timedelta(days=BACK)


def nothing(job: int) -> int:
    return job


def main(nights: int, workers: int) -> None:
    folder = Path(tempfile.mkdtemp(prefix="fleet_nights"))
    (folder / "lake").mkdir()
    truth = machines.Truth(days=BACK + 1)
    machines.shipped(folder / "m", folder / "lake", "M", truth, truth.days)
    jobs = [NightJob(machines.machine_of("M"), LAST, BACK, str(folder / "lake"))] * nights
    first = work(jobs[0])
    if first is None or first.outcome is not NightOutcome.VERIFIED:
        raise SystemExit("the night was not verified: nothing is measured")
    begin_s, read_s = time.process_time(), 0.0
    for _ in jobs[:5]:
        Lake(str(folder / "lake")).minutes("M", LAST, BACK)
    read_s = (time.process_time() - begin_s) / 5
    begin_s = time.process_time()
    with serial_engine() as engine:
        list(results_of(engine, work, jobs))
    cpu_s = (time.process_time() - begin_s) / nights
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{BACK + 1} days of minutes: {cpu_s:.2f} s of a core, {read_s:.3f} s of it reading;")
    print(f"{3600 / cpu_s:.0f} machine-nights per core-hour, {peak:.0f} MB")
    _registry(folder)
    for number in range(1, workers + 1):
        with dask_engine(workers=number) as engine:
            list(results_of(engine, work, jobs[: 2 * number]))
            before_s, begin_s = _spent_s(), time.perf_counter()
            list(results_of(engine, nothing, range(200)))
            middle_s, empty_s = _spent_s(), (time.perf_counter() - begin_s) / 200
            begin_s = time.perf_counter()
            list(results_of(engine, work, jobs))
            after_s, wall_s = _spent_s(), time.perf_counter() - begin_s
            rss = [one.memory_info().rss / 2**20 for one in psutil.Process().children()]
        empty = [(b - a) / 200 for a, b in zip(before_s, middle_s, strict=True)]
        full = [(b - a) / nights for a, b in zip(middle_s, after_s, strict=True)]
        print(f"Dask, {number} workers: {nights / wall_s:.2f} nights/s, {max(rss):.0f} MB each;")
        print(f"  an empty job {empty_s:.4f} s by the clock, of a core {sum(empty):.4f} s")
        print(
            f"  of a core a night costs {full[0]:.4f} s here and {full[1]:.3f} s in the workers:"
            f" the engine has {100 * (1 - cpu_s / sum(full)):.0f} %"
        )


def _spent_s() -> tuple[float, float]:
    """Return the processor time of this program (coordinator, scheduler) and of its workers. [s]"""
    every = psutil.Process().children(recursive=True)
    return time.process_time(), sum(sum(one.cpu_times()[:2]) for one in every)


def _registry(folder: Path) -> None:
    with Registry.make(f"sqlite:///{folder / 'registry.db'}", "lake") as registry:
        many = [machines.machine_of(f"M{k}") for k in range(200)]
        for one in many:
            registry.add(one, "first")
        begin_s = time.perf_counter()
        for k in range(ROWS // len(many)):
            day = LAST + timedelta(days=k)
            registry.record(
                NightResult(
                    machine=one.name,
                    day=day,
                    model_sha256=one.model_sha256,
                    outcome=NightOutcome.UNVERIFIED,
                )
                for one in many
            )
        rate = ROWS / (time.perf_counter() - begin_s)
    print(f"registry, SQLite: {rate:.0f} nights stored in a second")


if __name__ == "__main__":
    given = [int(word) for word in sys.argv[1:]]
    main(*(given + [20, 0][len(given) :]))
