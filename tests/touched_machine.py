"""A machine with two sources of heat that works two shifts, and is touched while it works."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from thermaxis.thermal import ThermalLog, parse_input

DAY, STEP_S, HISTORY = 1440, 60.0, 14
"""Minutes of a day; the first so many days are as they were."""
INPUTS = [parse_input(f"{n}=T_{n}_C-T_column_C") for n in ("spindle", "table")]


@dataclass(frozen=True)
class Machine:
    """What a machine does from day 14 on."""

    days: int = HISTORY + 20
    slower: float = 1.0
    """By how much the spindle's time constant grows on day 14. [1]"""
    noise_growth_um: float = 0.0
    """By how much the probe's noise grows in 10 days. [um]"""
    wear_um: float = 0.0
    """By how much the tool wears in a day; it is changed every other day. [um]"""
    heat_k: float = 0.0
    """By how much the hall rises for three days. [K]"""
    chips: float = 0.0
    """Share of the touches that are off by 20 to 50 um. [1]"""
    every: int = 30
    """Minutes from touch to touch. [1]"""


def lagged(u: np.ndarray, tau_s: float) -> np.ndarray:
    """Return an input behind a first-order lag."""
    alpha = -np.expm1(-STEP_S / tau_s)
    return np.asarray(lfilter([alpha], [1.0, alpha - 1.0], u))


def history(machine: Machine, seed: int) -> ThermalLog:
    """Return minutes of temperatures, and the displacement without correction at touches."""
    rng, rows = np.random.default_rng(seed), machine.days * DAY
    minute = np.arange(rows)
    day, of_day = np.divmod(minute, DAY)
    works = (of_day >= 6 * 60) & (of_day < 22 * 60) & (day % 7 < 6)
    jobs = np.repeat(rng.choice([0.0, 0.4, 0.7, 1.0], rows // 45 + 1), 45)[:rows] * works
    moves = np.repeat(rng.choice([0.0, 0.5, 1.0], rows // 120 + 1), 120)[:rows] * works
    hall = 22.0 + 1.5 * np.sin(2.0 * np.pi * (of_day / DAY - 0.35))
    hall += lagged(rng.normal(0.0, 12.0, rows), 4e4)
    hot = (day >= HISTORY + 4) & (day < HISTORY + 7)
    hall += machine.heat_k * lagged(hot.astype(np.float64), 2e4)
    column = lagged(hall - hall[0], 1.2e4) + hall[0]
    spindle, table = 12.0 * lagged(jobs, 900.0), 5.0 * lagged(moves, 3600.0)
    late = minute >= HISTORY * DAY
    own, slow = (
        0.4 * spindle + 2.2 * lagged(spindle, tau_s) for tau_s in (2400.0, 2400.0 * machine.slower)
    )
    z = np.where(late, slow, own) - 2.0 * lagged(table, 7200.0)
    z += 0.8 * lagged(hall - hall[0], 2e4)  # what no input explains
    z += np.cumsum(rng.normal(0.0, 0.5 * (STEP_S / 3600.0) ** 0.5, rows))
    z += machine.wear_um * np.where(late, np.cumsum(works) / (16 * 60) % 2.0, 0.0)
    noise_um = 1.0 + machine.noise_growth_um * np.clip((day - HISTORY) / 10.0, 0.0, 1.0)
    shown = rng.normal(z, noise_um)
    chip = rng.random(rows) < machine.chips * late
    shown[chip] += rng.choice([-1.0, 1.0], rows)[chip] * rng.uniform(20.0, 50.0, rows)[chip]
    touched = works & (minute % machine.every == seed % machine.every)
    columns = {
        "T_spindle_C": column + spindle,
        "T_table_C": column + table,
        "T_column_C": column,
    }
    columns = {n: np.round(rng.normal(v, 0.03), 1) for n, v in columns.items()}
    columns["Z_um"] = np.where(touched, shown, np.nan)
    return ThermalLog.from_columns(columns, sample_time_s=STEP_S, name=f"seed {seed}")
