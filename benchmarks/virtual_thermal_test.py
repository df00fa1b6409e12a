"""A virtual machine whose spindle and table warm up while its tool point is watched.

Spindle and table run at speeds that switch at random times. Each heats its bearing through lags
of its own, the column follows the hall, and the tool point answers the differences

    spindle minus column   through the lags `spindle`
    table minus column     through the lags `table`

of the TRUE temperatures, so that rounding and noise of the sensors are errors of the inputs. On
top comes what no sensor explains: a slow random drift, a part that follows the hall through a
lag, and the noise of the displacement sensor. The physics runs at one second, whatever the log.
"""

import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TypeAlias, final

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

FloatArray: TypeAlias = NDArray[np.float64]

PHYSICS_STEP_S = 1.0
"""Time step of the physics. [s]"""
_ROD_MODES = 25
"""Modes of a conduction rod that are summed; the rest acts at once. [1]"""


class Heating(StrEnum):
    """How the tool point answers a temperature difference."""

    LAGS = "lags"
    """First-order lags side by side."""
    RODS = "rods"
    """Mean temperature of rods that conduct heat from one end: no finite sum of lags."""


@final
@dataclass(frozen=True, slots=True)
class Lags:
    """First-order lags side by side: sum of gain / (1 + time constant s)."""

    gains_um_per_k: tuple[float, ...]
    """Gains. [µm/K]"""
    time_constants_s: tuple[float, ...]
    """Time constants; of a rod: its slowest mode. [s]"""

    @property
    def dc_gain(self) -> float:
        """What a lasting difference of one kelvin does in the end. [µm/K]"""
        return math.fsum(self.gains_um_per_k)


@final
@dataclass(frozen=True, slots=True)
class ThermalTestPlan:
    """What the virtual machine does and how it is measured."""

    hours: float = 8.0
    """Length of the log. [h]"""
    sample_time_s: float = 1.0
    """Time between rows of the log. [s]"""
    block_means: bool = False
    """Whether a row is the mean over its sample time rather than the value at its beginning."""
    warm_up_h: float = 0.0
    """Time that the machine has run before the log begins; zero is a cold start. [h]"""
    spindle: Lags = field(default_factory=lambda: Lags((14.0, 26.0, -18.0), (400.0, 3e3, 12e3)))
    """Answer to spindle minus column."""
    table: Lags = field(default_factory=lambda: Lags((12.0, 20.0), (3e3, 12e3)))
    """Answer to table minus column."""
    heating: Heating = Heating.LAGS
    """Whether the lags are lags, or the slowest modes of rods."""
    delay_s: float = 0.0
    """Time that a temperature difference needs to act at all. [s]"""
    resolution_k: float = 0.1
    """Step of the temperature sensors; zero for none. [K]"""
    temperature_noise_k: float = 0.02
    """Noise of the temperature sensors before rounding, standard deviation. [K]"""
    displacement_noise_um: float = 0.4
    """Noise of the displacement sensor, standard deviation. [µm]"""
    drift_um: float = 0.8
    """Slow random drift, standard deviation. [µm]"""
    drift_correlation_h: float = 2.0
    """Correlation time of the slow random drift. [h]"""
    hall_drift_um_per_k: float = 0.6
    """Part of the drift that follows the hall. [µm/K]"""
    hall_drift_lag_h: float = 2.0
    """Lag of that part. [h]"""
    hall_swing_k: float = 1.5
    """Amplitude of the hall's daily swing; half of it comes as random change on top. [K]"""
    missing_share: float = 0.0
    """Share of readings that are missing, each channel on its own. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class GeneratedThermalTest:
    """Log of the virtual machine, with its truth."""

    plan: ThermalTestPlan
    time_s: FloatArray
    """Time since the first row, (n,). [s]"""
    spindle_c: FloatArray
    """Measured temperature of the spindle's bearing, (n,). [°C]"""
    table_c: FloatArray
    """Measured temperature of the table's bearing, (n,). [°C]"""
    column_c: FloatArray
    """Measured temperature of the column, (n,). [°C]"""
    hall_c: FloatArray
    """Measured temperature of the hall, (n,). [°C]"""
    spindle_rpm: FloatArray
    """Speed of the spindle, (n,). [rpm]"""
    table_rpm: FloatArray
    """Speed of the table, (n,). [rpm]"""
    z_um: FloatArray
    """Measured displacement, its sensor set to zero when the log begins, (n,). [µm]"""
    true_u_k: FloatArray
    """True differences spindle minus column and table minus column, (n, 2). [K]"""
    clean_um: FloatArray
    """Displacement without noise and drift, (n,). [µm]"""
    drift_um: FloatArray
    """What no input explains, without the sensor's noise, (n,). [µm]"""

    @property
    def u_k(self) -> FloatArray:
        """Measured differences spindle minus column and table minus column, (n, 2). [K]"""
        return np.column_stack([self.spindle_c - self.column_c, self.table_c - self.column_c])

    def columns(self) -> dict[str, FloatArray]:
        """Return the log by column name, its unit last, as the readers of logs take it."""
        return {
            "time_s": self.time_s,
            "T_spindle_c": self.spindle_c,
            "T_table_c": self.table_c,
            "T_column_c": self.column_c,
            "T_hall_c": self.hall_c,
            "spindle_rpm": self.spindle_rpm,
            "table_rpm": self.table_rpm,
            "Z_um": self.z_um,
        }


def _lagged(u: FloatArray, tau_s: float, start: float) -> FloatArray:
    keep = math.exp(-PHYSICS_STEP_S / tau_s)
    return np.asarray(lfilter([0.0, 1.0 - keep], [1.0, -keep], u, zi=[start])[0])


def _wandering(count: int, std: float, tau_s: float, rng: np.random.Generator) -> FloatArray:
    """Return a stationary first-order Gauss-Markov series."""
    keep = math.exp(-PHYSICS_STEP_S / tau_s)
    steps = rng.normal(0.0, std * math.sqrt(1.0 - keep**2), count)
    first = rng.normal(0.0, std)
    return np.asarray(lfilter([1.0], [1.0, -keep], steps, zi=[keep * first])[0])


def _speeds(count: int, levels: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return speeds that switch every 10 to 60 minutes."""
    speeds = np.zeros(count)
    begin = 0
    while begin < count:
        length = int(rng.uniform(600.0, 3600.0) / PHYSICS_STEP_S)
        speeds[begin : begin + length] = rng.choice(levels)
        begin += length
    return speeds


def _bearing_rise(share: FloatArray, rise_k: float, taus_s: tuple[float, float]) -> FloatArray:
    """Return how much warmer than the machine a bearing is, at speeds as shares of the highest."""
    heat = rise_k * share**1.5
    return 0.6 * _lagged(heat, taus_s[0], 0.0) + 0.4 * _lagged(heat, taus_s[1], 0.0)


def _answer(u: FloatArray, lags: Lags, heating: Heating) -> FloatArray:
    y = np.zeros_like(u)
    for gain, tau_s in zip(lags.gains_um_per_k, lags.time_constants_s, strict=True):
        if heating is Heating.LAGS:
            y += gain * _lagged(u, tau_s, u[0])
            continue
        odd = 2.0 * np.arange(_ROD_MODES) + 1.0
        shares = 8.0 / (math.pi * odd) ** 2
        y += gain * (1.0 - float(np.sum(shares))) * u
        for share, number in zip(shares, odd, strict=True):
            y += gain * share * _lagged(u, tau_s / number**2, u[0])
    return y


def _hall(count: int, swing_k: float, rng: np.random.Generator) -> FloatArray:
    time_s = PHYSICS_STEP_S * np.arange(count)
    phase = rng.uniform(0.0, 2.0 * math.pi)
    daily = swing_k * np.sin(2.0 * math.pi * time_s / 86400.0 + phase)
    wander = _wandering(count, 0.5 * swing_k, 6.0 * 3600.0, rng)
    return 20.0 + daily + _lagged(wander, 900.0, wander[0])


def _measured(true_c: FloatArray, plan: ThermalTestPlan, rng: np.random.Generator) -> FloatArray:
    noisy = true_c + rng.normal(0.0, plan.temperature_noise_k, true_c.size)
    if plan.resolution_k > 0:
        noisy = plan.resolution_k * np.round(noisy / plan.resolution_k)
    return noisy


def _logged(values: FloatArray, plan: ThermalTestPlan) -> FloatArray:
    rows = round(plan.sample_time_s / PHYSICS_STEP_S)
    if not plan.block_means:
        return values[::rows].copy()
    return values[: values.size // rows * rows].reshape(-1, rows).mean(axis=1)


def generate_thermal_test(plan: ThermalTestPlan, seed: int) -> GeneratedThermalTest:
    """Return the log of a test on the virtual machine.

    Parameters
    ----------
    seed : int
        The same plan and seed give the same log; another seed gives other speeds, another hall,
        other drift and noise. [1]

    Returns
    -------
    GeneratedThermalTest
        The log and its truth. Missing readings are NaN.

    Notes
    -----
    At a cold start every part of the machine has the hall's temperature. Speeds, hall, drift and
    noise of a seed do not depend on the sample time.
    """
    world, sensors, gaps = (np.random.default_rng([seed, part]) for part in range(3))
    before = round(plan.warm_up_h * 3600.0 / PHYSICS_STEP_S)
    count = before + round(plan.hours * 3600.0 / PHYSICS_STEP_S)
    hall = _hall(count, plan.hall_swing_k, world)
    spindle_share = _speeds(count, np.array([0.0, 0.3, 0.5, 0.7, 1.0]), world)
    table_share = _speeds(count, np.array([0.0, 0.0, 0.4, 0.7, 1.0]), world)
    drift = _wandering(count, plan.drift_um, plan.drift_correlation_h * 3600.0, world)
    hall_lagged = _lagged(hall, plan.hall_drift_lag_h * 3600.0, hall[0])
    drift += plan.hall_drift_um_per_k * (hall_lagged - hall[0])
    column = _lagged(hall, 2.0 * 3600.0, hall[0])
    body = _lagged(hall, 1.5 * 3600.0, hall[0])
    spindle = body + _bearing_rise(spindle_share, 9.0, (700.0, 4500.0))
    table = body + _bearing_rise(table_share, 6.0, (1200.0, 7000.0))
    u = np.column_stack([spindle - column, table - column])
    late = round(plan.delay_s / PHYSICS_STEP_S)
    arrived = np.concatenate([np.repeat(u[:1], late, axis=0), u])[:count]
    clean = _answer(arrived[:, 0], plan.spindle, plan.heating)
    clean += _answer(arrived[:, 1], plan.table, plan.heating)
    z = clean + drift + sensors.normal(0.0, plan.displacement_noise_um, count)
    kept = slice(before, count)
    measured = {
        "spindle_c": _measured(spindle, plan, sensors),
        "table_c": _measured(table, plan, sensors),
        "column_c": _measured(column, plan, sensors),
        "hall_c": _measured(hall, plan, sensors),
        "z_um": z - clean[before],
    }
    logged = {name: _logged(values[kept], plan) for name, values in measured.items()}
    for values in logged.values():
        values[gaps.random(values.size) < plan.missing_share] = np.nan
    return GeneratedThermalTest(
        plan=plan,
        time_s=plan.sample_time_s * np.arange(logged["z_um"].size, dtype=np.float64),
        spindle_rpm=_logged(6000.0 * spindle_share[kept], plan),
        table_rpm=_logged(300.0 * table_share[kept], plan),
        true_u_k=np.column_stack([_logged(u[kept, i], plan) for i in range(2)]),
        clean_um=_logged(clean[kept] - clean[before], plan),
        drift_um=_logged(drift[kept], plan),
        **logged,
    )
