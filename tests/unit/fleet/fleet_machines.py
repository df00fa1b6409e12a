"""Machines of a fleet whose truth is known: what they ship, as a history closes it."""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta
from functools import cache
from pathlib import Path

import numpy as np
import polars as pl

from thermaxis.compensation import CompensationModel, Output, Part as ModelPart, Section
from thermaxis.files import format_model, model_sha256
from thermaxis.fleet import FleetMachine, Lake, ship
from thermaxis.runtime import DATUM
from thermaxis.runtime.history import Part, machine_folder
from thermaxis.runtime.history._parts import write_part

FIRST = date(2026, 11, 1)
DAYS = 3
LAST = FIRST + timedelta(days=DAYS - 1)
MINUTES = 1440
TAU_MIN, GAIN = 90.0, 8.0


def model_of(gain: float = GAIN) -> CompensationModel:
    """Return the model of a machine, true by default."""
    part = ModelPart(
        "spindle", "T_spindle_C", "T_column_C", sections=(Section(gain, 60.0 * TAU_MIN),)
    )
    return CompensationModel(outputs=(Output("Z_um", (part,)),), sample_time_s=60.0)


def machine_of(name: str, gain: float = GAIN, **options: str) -> FleetMachine:
    """Return a machine as the registry has it."""
    model = model_of(gain)
    return FleetMachine(name, "mill", format_model(model), model_sha256(model), options)


@dataclass(frozen=True)
class Truth:
    """What a machine does in some days."""

    seed: int = 0
    corrected: float = 1.0
    """Share of the true displacement that the correction in force takes off."""
    touch_every: int = 30
    """Minutes between touches; 0 for none."""
    days: int = DAYS
    datum_um: float = 0.0
    """By what a datum shifts what the probe shows, from the shift of the fifth day on."""
    frozen: bool = False
    """Whether the spindle's sensor stands still on the last day."""


@cache
def cycles_of(truth: Truth) -> pl.DataFrame:
    """Return a cycle for every minute: the spindle works two shifts and its heat moves the tool."""
    rng = np.random.default_rng(truth.seed)
    minute = np.arange(truth.days * MINUTES)
    works = ((minute % MINUTES) // 60 >= 6) & ((minute % MINUTES) // 60 < 20)
    duty = works * np.repeat(rng.uniform(0.0, 1.0, minute.size // 120), 120)
    rise, z_um = np.zeros(minute.size), np.zeros(minute.size)
    for k in range(1, minute.size):
        rise[k] = rise[k - 1] + (12.0 * duty[k] - rise[k - 1]) / 40.0
        z_um[k] = z_um[k - 1] + (GAIN * rise[k] - z_um[k - 1]) / TAU_MIN
    column = 20.0 + 0.5 * np.sin(minute / 230.0)
    spindle = np.round(column + rise + rng.normal(0.0, 0.05, minute.size), 1)
    if truth.frozen:
        spindle[-MINUTES:] = spindle[-MINUTES]
    correction = -truth.corrected * z_um
    probe = np.full(minute.size, np.nan)
    every = slice(0, None, truth.touch_every or minute.size)
    probe[every] = (z_um + correction + rng.normal(0.0, 1.0, minute.size))[every]
    if not truth.touch_every:
        probe[:] = np.nan
    anew = 4 * MINUTES + 475
    probe[anew:] += truth.datum_um
    told = [DATUM if truth.datum_um and k == anew else None for k in range(minute.size)]
    begin = datetime(FIRST.year, FIRST.month, FIRST.day, tzinfo=UTC)
    return pl.DataFrame(
        {
            "id": minute + 1,
            "time_utc": [begin + timedelta(minutes=int(k)) for k in minute],
            "T_spindle_C": spindle,
            "T_column_C": np.round(column, 1),
            "Z_correction_um": correction,
            "probe_Z_um": probe,
            "Z_touch": told,
        },
        schema_overrides={
            "Z_touch": pl.String(),
            "id": pl.Int64(),
            "time_utc": pl.Datetime("us", "UTC"),
        },
    ).with_columns(pl.col("probe_Z_um").fill_nan(None))


def shipped(
    folder: Path, lake: Path, name: str, truth: Truth, days: int = DAYS, last: int = MINUTES
) -> None:
    """Write the first days of a machine as a history closes them, and ship them."""
    table = cycles_of(truth)
    parts: list[Part] = []
    for k in range(days):
        rows = table.slice(k * MINUTES, last if k == days - 1 else MINUTES)
        day = machine_folder(folder, name) / f"day={FIRST + timedelta(days=k)}"
        part = Part(k * MINUTES + 1, k * MINUTES + rows.height, day)

        def frames(some: pl.DataFrame = rows) -> Iterator[pl.DataFrame]:
            yield some.clear()
            yield some

        parts.append(write_part(part, frames()))
    found = ship(parts, Lake(str(lake)))
    assert found.remarks == ()
