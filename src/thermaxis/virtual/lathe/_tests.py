"""Calibration and verification tests of a virtual vertical turning lathe, as in the paper.

A physics of its own: heat of the bearings by speed, first-order nodes for spindle, table and
column, and structures between the sensors and the tool point that answer through lags. The three
tests have the set-up of the paper's figures 3 and 7: one work shift of heating and its cooling
for each source, then both sources in turn, the table measured for some seconds at a time.
"""

import math
from dataclasses import dataclass
from itertools import accumulate
from typing import TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.errors import ConfigurationError, require_known
from thermaxis.thermal import ThermalLog

FloatArray: TypeAlias = NDArray[np.float64]

STEP_S = 10.0
"""Time between rows. [s]"""
DIAMETERS_MM = (0.0, 1500.0, 3000.0)
"""Diameters of the table at which the paper measures. [mm]"""
GAINS = (1.0, 1.6, 2.2)
"""Gain g of the table's part at these diameters; 2.2 at 3000 mm is the paper's. [1]"""
LATHE_TESTS = ("spindle", "table", "verification")
"""Names of the tests."""
LATHE_SEED = 1
"""Seed of the examples. [1]"""
_SEEN_EVERY_S, _SEEN_FOR_S = 600.0, 20.0  # the paper stops the table for 7 s of its 1 s rows
_COUNT_K = 0.1
_NOISE_K, _NOISE_UM = 0.02, 0.3


@final
@dataclass(frozen=True, slots=True)
class _Lathe:
    """Numbers of the machine."""

    spindle_k_at_full: float = 8.0
    table_k_at_full: float = 5.0
    spindle_lags: tuple[tuple[float, float], ...] = ((8.0, 0.0), (22.0, 1500.0), (10.0, 7200.0))
    """(gain um/K, time constant s) from spindle minus column to Z."""
    table_lags: tuple[tuple[float, float], ...] = ((-6.0, 600.0), (-14.0, 5400.0))
    """The same of the table."""


def _lag(u: FloatArray, tau_s: float) -> FloatArray:
    """Return a first-order lag of a held input that starts at rest."""
    if tau_s == 0.0:
        return u
    alpha = -math.expm1(-STEP_S / tau_s)
    states = accumulate(u[:-1].tolist(), lambda x, held: x + alpha * (held - x), initial=0.0)
    return np.fromiter(states, np.float64, u.size)


def _profile(hours: float, stages: tuple[tuple[float, float], ...]) -> FloatArray:
    """Return a speed profile of (hours, share of the full speed) stages, then standstill."""
    time_h = np.arange(round(hours * 3600.0 / STEP_S)) * STEP_S / 3600.0
    share: FloatArray = np.zeros(time_h.size)
    begin = 0.0
    for length, value in stages:
        share[(time_h >= begin) & (time_h < begin + length)] = value
        begin += length
    return share


_Stages = tuple[tuple[float, float], ...]
_PROFILES: dict[str, tuple[float, _Stages, _Stages]] = {
    "spindle": (14.0, ((0.2, 0.0), (8.0, 1.0)), ()),
    "table": (14.0, (), ((0.2, 0.0), (8.0, 1.0))),
    "verification": (
        16.0,
        ((0.2, 0.0), (1.5, 0.4), (2.0, 0.9), (1.0, 0.0), (0.5, 0.7), (3.5, 0.0), (2.0, 1.0)),
        ((5.2, 0.0), (1.5, 0.5), (1.0, 1.0), (0.6, 0.0), (2.0, 0.8)),
    ),
}


def generate_lathe_test(test: str, seed: int = LATHE_SEED) -> ThermalLog:
    """Run a test of the virtual lathe.

    Parameters
    ----------
    test : str
        ``spindle`` or ``table``: eight hours of heating by one source, then cooling;
        ``verification``: both sources in turn.
    seed : int
        Seed of noise and of the hall's temperature. Default: that of the examples. [1]

    Returns
    -------
    ThermalLog
        Speeds, temperatures in counts of 0.1 K, and displacements: ``Z_um`` at the tool centre
        point; in tests of the table also ``Z_D0_um``, ``Z_D1500_um`` and ``Z_D3000_um``, which
        are seen for two rows at a time while the table turns.

    Raises
    ------
    ConfigurationError
        If there is no such test, or the seed is negative.

    References
    ----------
    Mareš and Horejš 2021, figures 3 and 7, sections 3.2 and 4.2.
    """
    require_known("test", [test], LATHE_TESTS, "unknown_choice")
    if seed < 0:
        raise ConfigurationError("negative", value=seed, key="seed")
    rng = np.random.default_rng([seed, LATHE_TESTS.index(test)])
    lathe = _Lathe()
    hours, spindle_stages, table_stages = _PROFILES[test]
    spindle, table = _profile(hours, spindle_stages), _profile(hours, table_stages)
    rows = spindle.size
    time_s: FloatArray = np.arange(rows, dtype=np.float64) * STEP_S
    hall = _hall(time_s, rng)
    column = 22.0 + _lag(hall, 7200.0)
    spindle_c = column + _heat(spindle, lathe.spindle_k_at_full)
    table_c = column + _heat(table, lathe.table_k_at_full)
    z_spindle = _answer(spindle_c - column, lathe.spindle_lags)
    z_table = _answer(table_c - column, lathe.table_lags)
    slow = _lag(rng.normal(0.0, 1.0, rows), 5400.0)
    slow *= 0.6 / max(float(np.std(slow)), 1e-9)
    columns: dict[str, FloatArray] = {
        "n_spindle_rpm": 3500.0 * spindle,
        "n_table_rpm": 200.0 * table,
        "T_spindle_C": _counts(spindle_c, rng),
        "T_table_C": _counts(table_c, rng),
        "T_column_C": _counts(column, rng),
    }
    seen = (table == 0.0) | (np.mod(time_s, _SEEN_EVERY_S) < _SEEN_FOR_S)
    columns["Z_um"] = _measured(z_spindle + z_table + slow, seen, rng)
    if test != "spindle":
        for diameter, gain in zip(DIAMETERS_MM, GAINS, strict=True):
            z = z_spindle + gain * z_table + slow
            columns[f"Z_D{diameter:.0f}_um"] = _measured(z, seen, rng)
    return ThermalLog.from_columns(columns, time_s=time_s, name=f"lathe_{test}.csv")


def _hall(time_s: FloatArray, rng: np.random.Generator) -> FloatArray:
    phase = rng.uniform(0.0, 2.0 * np.pi)
    day = np.sin(2.0 * np.pi * time_s / 86400.0 + phase) - np.sin(phase)
    return 1.2 * day + 0.3 * _lag(rng.normal(0.0, 6.0, time_s.size), 3600.0)


def _heat(share: FloatArray, rise_k: float) -> FloatArray:
    """Return how far a bearing is above the column: losses grow faster than the speed."""
    loss = share**1.3
    return rise_k * (0.45 * _lag(loss, 500.0) + 0.55 * _lag(loss, 4200.0))


def _answer(u: FloatArray, lags: tuple[tuple[float, float], ...]) -> FloatArray:
    rise = u - u[0]
    answer: FloatArray = np.zeros_like(u)
    for gain, tau in lags:
        answer += gain * _lag(rise, tau)
    return answer


def _counts(values: FloatArray, rng: np.random.Generator) -> FloatArray:
    noisy = values + rng.normal(0.0, _NOISE_K, values.size)
    return np.round(np.round(noisy / _COUNT_K) * _COUNT_K, 1)


def _measured(z: FloatArray, seen: FloatArray, rng: np.random.Generator) -> FloatArray:
    noisy = np.round(z + rng.normal(0.0, _NOISE_UM, z.size), 1) + 0.0
    return np.where(seen, noisy, np.nan)
