"""Temperature of the hall: a day's swing, slower and quicker unrest, known at every time."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.virtual.lathe._physics import Boundary, LatheDuty, LathePhysics

FloatArray: TypeAlias = NDArray[np.float64]

DAY_S = 86_400.0
"""Length of a day. [s]"""
WARMEST_S = 15.0 * 3600.0
"""Time of day at which the hall is warmest: three in the afternoon. [s]"""
HELD_S = 60.0
"""The hall's temperature is held for so long: the network is solved exactly meanwhile. [s]"""
_PERIODS_S = (50_000.0, 21_000.0, 9_300.0, 3_700.0, 1_300.0)
_SHARES = (0.45, 0.30, 0.18, 0.10, 0.06)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class HallSettings:
    """How the hall's temperature moves."""

    mean_c: float = 21.0
    """Mean temperature. [°C]"""
    day_k: float = 0.5
    """Amplitude of the day's swing; large halls of builders are stable. [K]"""
    unrest_k: float = 0.5
    """Size of the irregular part: the sum of the amplitudes of its waves is 1.09 times it. [K]"""


@final
class Hall:
    """Temperature of the hall as a sum of waves, so that it needs no memory."""

    def __init__(self, settings: HallSettings, seed: Sequence[int], start_s: float) -> None:
        rng = np.random.default_rng([*seed, 1])
        periods = np.array([DAY_S, *_PERIODS_S])
        self._mean_c = settings.mean_c
        self._omega = 2.0 * math.pi / periods
        self._amplitude = np.array([settings.day_k, *(settings.unrest_k * s for s in _SHARES)])
        phases = rng.uniform(0.0, 2.0 * math.pi, periods.size)
        phases[0] = math.pi / 2.0 - (WARMEST_S - start_s) * self._omega[0]
        self._phase = phases

    def at(self, time_s: float) -> float:
        """Return the temperature at a time. [°C]"""
        waves = self._amplitude * np.sin(self._omega * time_s + self._phase)
        return self._mean_c + float(np.sum(waves))

    def rest(self, physics: LathePhysics) -> FloatArray:
        """Return the temperatures of a machine that has stood in this hall for ever, at time zero.

        The masses follow the waves each in its own phase: a machine at rest is never quite at
        the temperature of its hall.
        """
        network = physics.network(LatheDuty(coolant=False))
        boundary = np.array([self._mean_c, physics.foundation_c, physics.cooler_c])
        mean = network.steady(np.zeros(network.capacity_j_per_k.size), boundary)
        waves = self._amplitude * np.exp(1j * self._phase) / 1j
        swing = network.swing(Boundary.HALL, self._omega) @ waves
        return mean + np.real(swing)
