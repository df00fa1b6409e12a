"""A fleet whose truth is known: machines of three kinds, days of minutes, faults that begin.

Each works 8 to 16 h on weekdays, is touched each half hour, and has what its model does not know: a
residual with a memory, hot days of the whole hall, sensors that read by tenths of a kelvin. It
shares no code with what judges it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime, timedelta
from pathlib import Path

import numpy as np
import polars as pl
from scipy.signal import lfilter

from thermaxis.compensation import CompensationModel
from thermaxis.fleet import Cause, Lake, ship
from thermaxis.runtime.history import Part, machine_folder
from thermaxis.runtime.history._parts import minutes_of, write_part
from thermaxis.thermal import (
    InputDefinition,
    ModalOptions,
    ThermalLog,
    compensation_model,
    modal,
    records_of,
)

DAY = 1440
LEARNT = 10
"""Days from which a model is identified, and before a fault begins. [1]"""
MONDAY = date(2026, 11, 2)
FAULTS = tuple(cause for cause in Cause if cause is not Cause.UNKNOWN)


@dataclass(frozen=True)
class Kind:
    """What machines of one kind have in common: sources of heat, the hottest one first."""

    output: str
    rises_k: dict[str, float]
    """Rise of each source's sensor at full work, by name; its lag is in `lags_min`."""
    lags_min: tuple[float, ...]
    gains_um_per_k: tuple[float, ...]
    time_constants_min: tuple[float, ...]
    bare: str
    """The sensor that no source heats."""


KINDS = {
    "mill": Kind(
        "Z_um", {"spindle": 14.0, "motor": 9.0}, (25.0, 45.0), (2.6, -1.4), (70.0, 150.0), "bed"
    ),
    "lathe": Kind(
        "X_um", {"headstock": 11.0, "turret": 6.0}, (40.0, 60.0), (3.2, 1.5), (95.0, 60.0), "bed"
    ),
    "grinder": Kind(
        "Z_um",
        {"wheel": 9.0, "coolant": 5.0, "table": 4.0},
        (30.0, 90.0, 60.0),
        (3.0, 1.2, -1.5),
        (55.0, 120.0, 90.0),
        "frame",
    ),
}


@dataclass(frozen=True)
class Hall:
    """What all machines of a fleet share, and what breaks the assumptions of who judges them."""

    seed: int = 0
    days: int = 14
    fault_share: float = 0.05
    touch_min: int = 30
    """Time between touches. [min]"""
    memory_h: float = 2.0
    """Time constant of the residual of 1 um. [h]"""
    sensor_k: float = 0.1
    """Noise and step of the sensors. [K]"""
    holiday: tuple[int, ...] = ()
    """Days on which nobody works."""
    resting_share: float = 0.0
    """Share of the machines that never work."""
    hot_days: int = 3

    @property
    def first(self) -> date:
        """Return the first day: the weekend lies elsewhere in every fleet."""
        return MONDAY + timedelta(days=self.seed % 7)


@dataclass(frozen=True)
class Machine:
    """A machine and its truth."""

    name: str
    kind: str
    number: int
    fault: Cause | None = None
    begins: int = 0
    """The day on which the fault begins, from zero. [1]"""
    of: str = ""
    """Its source or channel, two with a comma."""
    first: date = MONDAY

    @property
    def since(self) -> date:
        """Return the day on which its fault begins."""
        return self.first + timedelta(days=self.begins)


def machines_of(hall: Hall, count: int) -> list[Machine]:
    """Return the machines of a fleet: each fault is as frequent as any other."""
    rng = np.random.default_rng([hall.seed, 1])
    faulty = rng.permutation(count)[: round(hall.fault_share * count)].tolist()
    kinds = list(KINDS)
    found: list[Machine] = []
    for k in range(count):
        kind = kinds[k % len(kinds)]
        one = Machine(f"{kind} {k + 1}", kind, k, first=hall.first)
        found.append(with_fault(hall, one, faulty.index(k)) if k in faulty else one)
    return found


def with_fault(hall: Hall, machine: Machine, number: int) -> Machine:
    """Return a machine with a fault of its own: causes take turns by number."""
    rng = np.random.default_rng([hall.seed, 4, machine.number, number])
    channels = _channels(KINDS[machine.kind])
    fault, begins = FAULTS[number % len(FAULTS)], LEARNT + int(rng.integers(2))
    of = channels[int(rng.integers(len(channels)))]
    if fault is Cause.SENSORS_SWAPPED:
        of = f"{channels[0]},{channels[int(rng.integers(1, len(channels)))]}"
    elif fault in (Cause.GAIN, Cause.TIME_CONSTANT):
        of = next(iter(KINDS[machine.kind].rises_k))
    return replace(machine, fault=fault, begins=begins, of="" if fault is Cause.DRIFT else of)


def _channels(kind: Kind) -> list[str]:
    return [f"T_{name}_C" for name in (*kind.rises_k, kind.bare)]


def _lagged(u: np.ndarray, minutes: float) -> np.ndarray:
    alpha = -np.expm1(-1.0 / minutes)
    return np.asarray(lfilter([alpha], [1.0, alpha - 1.0], u))


def _hall_c(hall: Hall) -> np.ndarray:
    """Return the temperature of the hall, that of all machines, with hot days."""
    rng, rows = np.random.default_rng([hall.seed, 2]), hall.days * DAY
    minute = np.arange(rows)
    hot = np.isin(minute // DAY, rng.choice(np.arange(5, hall.days), hall.hot_days, replace=False))
    slow = _lagged(rng.normal(0.0, 20.0, rows), 2000.0)
    sun = 1.5 * np.sin(2.0 * np.pi * (minute / DAY - 0.35))
    return 21.0 + sun + slow - slow[0] + 6.0 * _lagged(hot.astype(np.float64), 240.0)


def cycles_of(hall: Hall, machine: Machine) -> pl.DataFrame:
    """Return a cycle for each minute of a machine, as its history has them."""
    rng, rows = np.random.default_rng([hall.seed, 3, machine.number]), hall.days * DAY
    kind, minute = KINDS[machine.kind], np.arange(rows)
    day, of_day = np.divmod(minute, DAY)
    hours = rng.uniform(8.0, 16.0, hall.days)
    works = (of_day >= 360) & (of_day < 360 + 60 * hours[day])
    weekday = (hall.first.weekday() + day) % 7
    works &= (weekday < 5) & ~np.isin(day, hall.holiday)
    works &= bool(rng.random() >= hall.resting_share)
    ambient = _hall_c(hall)
    frame = _lagged(ambient - ambient[0], 300.0 * rng.uniform(0.8, 1.2)) + ambient[0]
    true_c = {kind.bare: frame}
    late = minute >= machine.begins * DAY
    z_um = np.zeros(rows)
    for (name, most_k), lag, gain, tau in zip(
        kind.rises_k.items(),
        *(kind.lags_min, kind.gains_um_per_k, kind.time_constants_min),
        strict=True,
    ):
        of_own = rng.uniform(0.85, 1.15, 4)
        duty = np.repeat(rng.choice([0.0, 0.3, 0.6, 0.8, 1.0], rows // 40 + 1), 40)[:rows] * works
        rise = _lagged(most_k * of_own[0] * duty, lag * of_own[1])
        own_gain, own_tau = gain * of_own[2], tau * of_own[3]
        own_um = own_gain * _lagged(rise, own_tau)
        if machine.of == name and machine.fault is Cause.GAIN:
            own_um = np.where(late, 1.3 * own_um, own_um)
        if machine.of == name and machine.fault is Cause.TIME_CONSTANT:
            own_um = np.where(late, own_gain * _lagged(rise, 1.4 * own_tau), own_um)
        true_c[name], z_um = frame + rise, z_um + own_um
    memory = np.exp(-1.0 / (60.0 * hall.memory_h))
    noise = rng.normal(0.0, (1.0 - memory**2) ** 0.5, rows)
    z_um += lfilter([1.0], [1.0, -memory], noise)
    z_um += rng.uniform(0.18, 0.22) * (frame - frame[0])  # what no sensor of the model tells
    if machine.fault is Cause.DRIFT:
        z_um += 0.3 * np.maximum(minute / DAY - machine.begins, 0.0)
    read = {
        f"T_{name}_C": value + rng.uniform(-0.3, 0.3) + rng.normal(0.0, hall.sensor_k, rows)
        for name, value in true_c.items()
    }
    read = {name: _rounded(value, hall.sensor_k) for name, value in read.items()}
    moment = int(rng.integers(8 * 60))
    match machine.fault:
        case Cause.SENSOR_OFFSET:
            read[machine.of] = read[machine.of] + np.where(late, rng.choice([-2.0, 2.0]), 0.0)
        case Cause.SENSOR_FROZEN:
            still = read[machine.of]
            still[machine.begins * DAY + moment :] = still[machine.begins * DAY + moment]
        case Cause.SENSORS_SWAPPED:
            a, b = machine.of.split(",")
            read[a], read[b] = np.where(late, read[b], read[a]), np.where(late, read[a], read[b])
        case _:
            pass
    touched = minute % hall.touch_min == machine.number % hall.touch_min
    shown = np.where(touched, rng.normal(z_um, 1.0), np.nan)
    begin = datetime(hall.first.year, hall.first.month, hall.first.day, tzinfo=UTC)
    axis = kind.output.removesuffix("_um")
    times = {
        "id": minute + 1,
        "time_utc": pl.datetime_range(
            begin, begin + timedelta(minutes=rows - 1), "1m", time_unit="us", eager=True
        ),
    }
    return pl.DataFrame(times | read | {f"probe_{axis}_um": shown}).with_columns(
        pl.col("id").cast(pl.Int64), pl.col(f"probe_{axis}_um").fill_nan(None)
    )


def _rounded(values: np.ndarray, step: float) -> np.ndarray:
    return np.round(np.round(values / step) * step, 3)


def model_of(machine: Machine, cycles: pl.DataFrame) -> CompensationModel:
    """Return the model that is identified from a machine's first days."""
    kind = KINDS[machine.kind]
    rows = cycles.head(LEARNT * DAY)
    columns = {name: rows[name].to_numpy() for name in _channels(kind)}
    axis = kind.output.removesuffix("_um")
    columns[kind.output] = rows[f"probe_{axis}_um"].fill_null(np.nan).to_numpy()
    log = ThermalLog.from_columns(columns, sample_time_s=60.0, name=machine.name)
    inputs = [InputDefinition(name, f"T_{name}_C", f"T_{kind.bare}_C") for name in kind.rises_k]
    records = records_of([log], inputs, [kind.output])
    (experiments,) = records.experiments.values()
    options = ModalOptions(intervals=False)
    found = modal(experiments, input_names=list(kind.rises_k), options=options)
    return compensation_model({kind.output: found.model}, records)


def days_of(cycles: pl.DataFrame, days: Sequence[int]) -> list[pl.DataFrame]:
    """Return the minutes of days, from zero, as a history closes them."""
    return [minutes_of(cycles.slice(k * DAY, DAY).lazy()).collect() for k in days]


def shipped(folder: Path, lake: Lake, machine: Machine, cycles: pl.DataFrame) -> None:
    """Write the days of a machine as its history closes them, and ship them."""
    parts: list[Part] = []
    for k in range(cycles.height // DAY):
        rows = cycles.slice(k * DAY, DAY)
        day = machine_folder(folder, machine.name) / f"day={machine.first + timedelta(days=k)}"

        def frames(some: pl.DataFrame = rows) -> Iterator[pl.DataFrame]:
            yield some.clear()
            yield some

        parts.append(write_part(Part(k * DAY + 1, (k + 1) * DAY, day), frames()))
    ship(parts, lake)
