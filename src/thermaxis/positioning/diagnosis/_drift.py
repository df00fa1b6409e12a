"""Where the drift turns back, and which temperature it follows."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import numpy as np

from thermaxis.positioning.diagnosis._levels import smooth_basis, upper_tail
from thermaxis.positioning.run import FloatArray, PositioningTest

if TYPE_CHECKING:
    from thermaxis.positioning.drift import DriftResult

LEAST_CORRELATION = 0.9
"""Correlation of a channel with the drift that is no finding; own choice. [1]"""


@final
@dataclass(frozen=True, slots=True)
class _Turn:
    """Where the drift turns back at one position."""

    position: float
    """[mm or deg]"""
    at: int
    """Index of the turn on the drift's curve. [1]"""
    there: float
    """Way up to the turn. [µm or arcsec]"""
    back: float
    """Way after it. [µm or arcsec]"""
    uncertainty: float
    """Bound of the standard uncertainty of both. [µm or arcsec]"""

    @property
    def shorter(self) -> float:
        """Length of the shorter of both ways. [µm or arcsec]"""
        return min(abs(self.there), abs(self.back))


def turns_of(drift: "DriftResult", position: float, arm: float) -> list[_Turn]:
    """Return the turn up and the turn down at a position that lies `arm` off the mean one."""
    curve = drift.common + arm * drift.slope
    std = drift.common_std + abs(arm) * drift.slope_std
    found: list[_Turn] = []
    for k in (int(np.argmax(curve)), int(np.argmin(curve))):
        there, back = float(curve[k] - curve[0]), float(curve[-1] - curve[k])
        if there * back < 0.0:
            unsure = float(std[k] + max(std[0], std[-1]))
            found.append(_Turn(position, k, there, back, unsure))
    return found


def channel_on(test: PositioningTest, values: FloatArray, time: FloatArray) -> FloatArray | None:
    """Return a channel on the times of the drift's curve; None if it hardly exists."""
    at = test.time_s if test.time_s is not None else test.order
    if at is None:
        return None
    known = np.isfinite(values) & np.isfinite(at)
    if int(np.sum(known)) < time.size // 4:
        return None
    when, what = at[known], values[known]
    step = float(time[1] - time[0])
    place = np.clip(np.rint((when - time[0]) / step).astype(np.intp), 0, time.size - 1)
    count = np.bincount(place, minlength=time.size)
    total = np.bincount(place, what, time.size)
    filled = count > 0
    return np.asarray(np.interp(time, time[filled], total[filled] / count[filled]))


@final
@dataclass(frozen=True, slots=True)
class Explained:
    """A temperature that the drift follows after `lag` points of its curve."""

    name: str
    lag: int
    correlation: float
    gain: float
    p_value: float


def _independent(first: FloatArray, second: FloatArray) -> float:
    """Return how many independent pairs two correlated series are worth (Bartlett 1946)."""
    n = first.size

    def memory(x: FloatArray) -> FloatArray:
        padded = np.fft.rfft(x, 2 * n)
        value = np.fft.irfft(np.abs(padded) ** 2)[:n]
        return np.asarray(value / value[0])

    together = memory(first)[1:] * memory(second)[1:]
    weight = 1.0 - np.arange(1, n) / n
    return n / max(1.0, 1.0 + 2.0 * float(np.sum(weight * together)))


def explanation(name: str, channel: FloatArray, drift: FloatArray) -> Explained | None:
    """Try all lags up to a quarter of the run, the drift following the temperature."""
    n = drift.size
    best: tuple[float, int] = (0.0, 0)
    for lag in range(n // 4 + 1):
        y, x = drift[lag:], channel[: n - lag]
        spread = float(np.std(y) * np.std(x))
        if spread > 0.0:
            correlation = float(np.mean((y - np.mean(y)) * (x - np.mean(x)))) / spread
            if abs(correlation) > abs(best[0]) + 1e-9:
                best = (correlation, lag)
    correlation, lag = best
    if abs(correlation) < LEAST_CORRELATION:
        return None
    y, x = drift[lag:], channel[: n - lag]
    line = smooth_basis(np.arange(y.size, dtype=np.float64), 1)
    bent, warm = y - line @ (line.T @ y), x - line @ (line.T @ x)
    size = float(np.sqrt((bent @ bent) * (warm @ warm)))
    if float(bent @ bent) < 1e-6 * n * float(np.var(y)) or size == 0.0:
        return None  # two straight lines always agree
    partial = min(abs(float(bent @ warm)) / size, 1.0 - 1e-12)
    free = _independent(bent, warm) - 2.0
    if free < 1.0 or float(bent @ warm) * correlation < 0.0:
        return None
    t = partial * float(np.sqrt(free / (1.0 - partial**2)))
    gain = correlation * float(np.std(y) / np.std(x))
    return Explained(name, lag, correlation, gain, min(1.0, 2.0 * upper_tail(t, free)))
