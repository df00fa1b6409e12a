"""Are machines with a planted fault named, with its cause, and others not?

A fleet of `fleet_machines.py` without faults is judged on each morning after the tenth day. Then
machines of it take a fault, 5 % of them at a time, until three of five had one; causes take turns.
Nights are done without the figures of the free run and without proposals, which judging does not
read. Seeds up to 42 and from 100 on were looked at while rules were made.

    python benchmarks/fleet_decisions.py                    10 seeds from 51 on, of 100 machines
    python benchmarks/fleet_decisions.py 43 1 1000          one of 1,000 machines
    python benchmarks/fleet_decisions.py 51 1 24 holiday    with an assumption broken
"""

import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from datetime import date, timedelta
from pathlib import Path
from typing import Any, NoReturn
from unittest.mock import patch

import numpy as np
from scipy.stats import beta, norm

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from benchmarks.fleet_machines import (
    FAULTS,
    LEARNT,
    Hall,
    Machine,
    cycles_of,
    days_of,
    machines_of,
    model_of,
    with_fault,
)
from thermaxis.compensation import CompensationModel
from thermaxis.errors import DataError
from thermaxis.fleet import Cause, Judgement, StoredNight, judge, night, night_as_json
from thermaxis.fleet._signs import equations_of

BACK, DAYS, NIGHTS = 6, 22, 3
"""Days before each night, days of minutes, nights within which a fault is to be named. [1]"""
SHARE, MOST_FAULTY = 0.05, 300
BROKEN: dict[str, dict[str, Any]] = {
    "as stated": {},
    "touches each 2 h": {"touch_min": 120},
    "memory of 6 h": {"memory_h": 6.0},
    "sensors of 0.5 K": {"sensor_k": 0.5},
    "holiday": {"holiday": tuple(range(11, DAYS))},
    "some never work": {"resting_share": 0.1},
}
Nights = dict[str, list[StoredNight]]
Faulty = list[tuple[Machine, list[StoredNight]]]


def _not_asked(*_: object) -> NoReturn:
    raise DataError("no_registry")


@patch("thermaxis.fleet._night._output", _not_asked)
def nights_of(hall: Hall, machine: Machine, model: CompensationModel) -> list[StoredNight]:
    """Return what judging reads of a machine's nights."""
    minutes = days_of(cycles_of(hall, machine), range(hall.days))
    found: list[StoredNight] = []
    for k in range(LEARNT, hall.days):
        day = machine.first + timedelta(days=k)
        result = night(machine.name, model, minutes[k - BACK : k + 1], day)
        if result is not None:
            of = (machine.name, machine.kind, day, result.model_sha256, "")
            found.append(StoredNight(*of, night_as_json(result)))
    return found


def nights_with_and_without(
    hall: Hall, machine: Machine, *, faulty: bool
) -> tuple[list[StoredNight], tuple[Machine, list[StoredNight]] | None]:
    """Return the nights of a machine without a fault, and those with one."""
    model = model_of(machine, cycles_of(hall, machine))
    sound = nights_of(hall, machine, model)
    if not faulty:
        return sound, None
    one = with_fault(hall, machine, machine.number // len(FAULTS) + machine.number)
    return sound, (one, nights_of(hall, one, model))


def fleet_of(hall: Hall, count: int, pool: Executor) -> tuple[Nights, Faulty]:
    """Return the nights of machines without a fault by name, and of machines with one."""
    machines = machines_of(replace(hall, fault_share=0.0), count)
    some = min(3 * count // 5, MOST_FAULTY)
    found = [
        pool.submit(nights_with_and_without, hall, one, faulty=one.number < some)
        for one in machines
    ]
    sound = {one.name: each.result()[0] for one, each in zip(machines, found, strict=True)}
    return sound, [each.result()[1] for each in found[:some]]


def mornings(
    hall: Hall, sound: Nights, some: Faulty
) -> Iterator[tuple[date, dict[str, Judgement]]]:
    """Yield each morning with the judgements of those that are named, by machine."""
    own = sound | {machine.name: nights for machine, nights in some}
    every = [one for nights in own.values() for one in nights]
    for k in range(LEARNT, hall.days):
        day = hall.first + timedelta(days=k)
        yield day, {one.machine: one for one in judge(every, day) if one.named}


def change(
    nights: list[StoredNight], output: int, column: tuple[str, str], last: int
) -> tuple[float, float]:
    """Return by how much one column changed in the last nights, and its standard deviation.

    Least squares of all nights beside the machine as it was, which is as its model within a unit of
    each column; the mean may be anywhere, and its change grows from night to night.
    """
    touched = [one.result["touched"][output] for one in nights]
    of = [tuple(each) for each in touched[0]["columns"]]
    base = [k for k, (sign, _) in enumerate(of) if sign != "swap" and k != of.index(column)]
    columns = [*base, of.index(column)]
    unknowns = len(columns) + 1
    matrix, vector = np.eye(unknowns), np.zeros(unknowns)
    mean = columns.index(0)
    matrix[mean, mean] = matrix[-1, -1] = 1e-9
    parts = [(touched[0]["before"], 0.0)]
    for k, one in enumerate(touched, start=last - len(nights)):
        parts.append((one["day"], 0.0 if k < 0 else k + 0.5 if mean == unknowns - 2 else 1.0))
    for told, shape in parts:
        a, b = (each[columns] for each in equations_of(told))
        a = a[:, columns]
        to = np.vstack([np.eye(unknowns - 1), shape * np.eye(unknowns - 1)[-1]])
        matrix, vector = matrix + to @ a @ to.T, vector + to @ b
    of_change = np.linalg.inv(matrix)[-1]
    return float(of_change @ vector), float(of_change[-1]) ** 0.5


def departs_alone(sound: Nights, one: Machine, nights: list[StoredNight], within: int) -> bool:
    """Whether one who asks nothing else, and errs once in a thousand, names a machine in time.

    It knows part and begin, and how what is asked varies among sound machines of the kind.
    """
    sign = {Cause.SENSORS_SWAPPED: "swap", Cause.DRIFT: "mean"}.get(one.fault, one.fault.value)
    if one.fault in (Cause.SENSOR_FROZEN, Cause.SENSOR_OFFSET):
        return True
    column = sign, one.of
    sisters = [each for each in sound.values() if each[0].kind == one.kind]
    for last in range(within if sign == "mean" else 1, within + 1):
        until = one.begins - LEARNT + last
        for k, told in enumerate(nights[0].result["touched"]):
            if column in map(tuple, told["columns"]) and until <= len(nights):
                sound_ones = [change(each[:until], k, column, last) for each in sisters]
                by, std = np.array([change(nights[:until], k, column, last), *sound_ones]).T
                z = np.abs(by - np.median(by[1:])) / std
                if z[0] > norm.isf(0.001) * max(1.0, np.quantile(z[1:], 0.9) / norm.ppf(0.95)):
                    return True
    return False


def wear_nights(fleets: list[tuple[Hall, Nights, Faulty]]) -> int:
    """Return after how many nights one who knows the slope of wear names 9 of 10 machines.

    It knows direction and begin, and how what the models leave varies over all sound machines by
    night, beside their kind; it names one of a thousand by chance.
    """
    apart: list[np.ndarray] = []
    for _, sound, _ in fleets:
        levels: dict[str, list[list[float]]] = defaultdict(list)
        for nights in sound.values():
            days = [one.result["touched"][0] for one in nights if one.result["touched"]]
            if len(days) == DAYS - LEARNT:
                every = [days[0]["before"], *(one["day"] for one in days)]
                past, *means = (one["vector"][0] / one["matrix"][0] for one in every)
                levels[nights[0].kind].append([mean - past for mean in means])
        apart += [np.array(each) - np.median(each, axis=0) for each in levels.values()]
    varies = np.cov(np.concatenate(apart).T)
    wear = 0.3 * (np.arange(DAYS - LEARNT) + 0.5)
    for n in range(1, wear.size):
        z = (wear[:n] @ np.linalg.solve(varies[:n, :n], wear[:n])) ** 0.5
        if norm.sf(norm.isf(0.001) - z) >= 0.9:
            return n
    return wear.size


@dataclass
class Tally:
    """What became of faults and of machines without one."""

    wear_nights: int
    """Nights within which wear is to be named; other faults: `NIGHTS`. [1]"""
    after: dict[Cause, list[float]] = field(default_factory=lambda: defaultdict(list))
    """Nights after which each was named, infinite for never."""
    alone: dict[Cause, list[bool]] = field(default_factory=lambda: defaultdict(list))
    """Whether one who asks nothing else would have named it in time."""
    said: dict[Cause, Counter[str]] = field(default_factory=lambda: defaultdict(Counter))
    """Causes that stood first when it was named at first."""
    false: Counter[str] = field(default_factory=Counter)

    def add(self, hall: Hall, sound: Nights, some: Faulty) -> None:
        """Judge a fleet in which some machines have a fault."""
        truth = {machine.name: machine for machine, _ in some}
        seen: dict[str, float] = {}
        label = "beside faults" if some else "without faults"
        for day, named in mornings(hall, sound, some):
            self.false[f"{label}, machine-nights"] += len(sound) - len(truth)
            for name, judgement in named.items():
                one = truth.get(name)
                if one is None or one.since > day:
                    self.false[label] += 1
                    if "tell" in sys.argv:
                        print(hall.seed, day, name, judgement.causes, judgement.evidence[0].values)
                elif name not in seen:
                    seen[name] = (day - one.since).days + 1
                    self.said[one.fault][judgement.causes[0]] += 1
        for one, nights in some:
            self.after[one.fault].append(seen.get(one.name, np.inf))
            within = self.within(one.fault)
            self.alone[one.fault].append(departs_alone(sound, one, nights, within))

    def within(self, fault: Cause) -> int:
        """Return within how many nights a fault is to be named."""
        return self.wear_nights if fault is Cause.DRIFT else NIGHTS

    def print(self) -> None:
        """Print what was planted and what was found."""
        print("fault            planted  within nights  named  asked alone  ever"
              "  right cause first  other causes")  # fmt: skip
        sums = np.zeros(5)
        for fault in FAULTS:
            after, said = np.array(self.after[fault]), dict(self.said[fault])
            within = self.within(fault)
            row = [after.size, np.sum(after <= within), np.sum(self.alone[fault]),
                   np.sum(after < np.inf), said.pop(fault, 0)]  # fmt: skip
            sums += row
            other = ", ".join(f"{cause} {n}" for cause, n in said.items())
            print(f"{fault:16} {row[0]:7}  {within:13}  {row[1]:5}  {row[2]:11.0f}  {row[3]:4}"
                  f"  {row[4]:17}  {other}")  # fmt: skip
        print(f"{'all':16} {sums[0]:7.0f}  {'':13}  {sums[1]:5.0f}  {sums[2]:11.0f}"
              f"  {sums[3]:4.0f}  {sums[4]:17.0f}")  # fmt: skip
        for label in ("without faults", "beside faults"):
            n, of = self.false[label], self.false[f"{label}, machine-nights"]
            low, high = 1000 * beta.ppf([0.025, 0.975], [max(n, 1e-9), n + 1], [of - n + 1, of - n])
            print(f"{label}: {n} false names in {of} machine-nights: {1000 * n / max(of, 1):.2f} a"
                  f" night of 1,000 machines (95 %: {low:.2f} to {high:.2f})")  # fmt: skip


def main(first: int, seeds: int, count: int, words: list[str]) -> None:
    """Print a table for each way in which assumptions are broken."""
    for name in words or ["as stated"]:
        halls = [Hall(seed=seed, days=DAYS, **BROKEN[name]) for seed in range(first, first + seeds)]
        with ProcessPoolExecutor() as pool:
            fleets = [(hall, *fleet_of(hall, count, pool)) for hall in halls]
        tally = Tally(wear_nights(fleets))
        for hall, sound, faulty in fleets:
            tally.add(hall, sound, [])
            group = max(round(SHARE * count), 1)
            for k in range(0, len(faulty), group):
                tally.add(hall, sound, faulty[k : k + group])
        print(f"{name}: {seeds} seeds of {count} machines")
        tally.print()


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:] if word.isdigit()]
    main(*(numbers + [51, 10, 100][len(numbers) :]), [w for w in sys.argv[1:] if w in BROKEN])
