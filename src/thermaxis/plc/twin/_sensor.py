"""The judgement of one sensor once more, plainly, in the numbers of the target."""

import math
from typing import final

from thermaxis.compensation import SampleQuality, SensorRules
from thermaxis.plc.twin._numbers import Rounding

_MOST_ALLOWANCE_K = 1e6


@final
class SensorTwin:
    """Judges what one channel reads, from call to call.

    Not protected: an error within range and rate is believed.
    """

    def __init__(self, rules: SensorRules, cycle_s: float, rounded: Rounding) -> None:
        self._r = rounded
        self._cycle_s = rounded(cycle_s)
        self._lowest_c, self._highest_c = rounded(rules.lowest_c), rounded(rules.highest_c)
        self._rate_k = rounded(rules.largest_rate_k_per_s * cycle_s)
        self._step_k = rounded(rules.step_k)
        self._two_steps_k = rounded(2.0 * rules.step_k)
        self._frozen_s = rounded(rules.frozen_s)
        self.forget()

    def forget(self) -> None:
        """Believe the next value whatever it is, as long as it is in its range."""
        self._good_c = math.nan
        self._unchanged_s = math.nan
        self._allowance_k = 0.0

    def judged(self, value: float, *, ok: bool, moved: bool, timed: bool) -> SampleQuality:
        """Return what is wrong with a value."""
        if moved:
            self._unchanged_s = self._r(self._unchanged_s + self._cycle_s)
        rate_k = self._rate_k if moved else 0.0
        unread = self._unread(value, ok=ok)
        if unread is not None:
            grown_k = self._r(self._allowance_k + rate_k)
            self._allowance_k = min(grown_k, _MOST_ALLOWANCE_K)
            return unread
        if value == self._good_c:
            if 0.0 < self._frozen_s < self._unchanged_s:
                return SampleQuality.FROZEN
            if math.isnan(self._unchanged_s) and timed:
                self._unchanged_s = 0.0
            self._allowance_k = 0.0
            return SampleQuality.GOOD
        if self._too_fast(value, rate_k):
            most_k = max(self._allowance_k, self._two_steps_k)
            self._allowance_k = min(self._r(self._allowance_k + rate_k), most_k)
            return SampleQuality.TOO_FAST
        self._good_c = value
        self._unchanged_s = 0.0 if timed else math.nan
        self._allowance_k = 0.0
        return SampleQuality.GOOD

    def _unread(self, value: float, *, ok: bool) -> SampleQuality | None:
        if not math.isfinite(value):
            return SampleQuality.MISSING
        if not ok:
            return SampleQuality.STATUS_BAD
        if not self._lowest_c <= value <= self._highest_c:
            return SampleQuality.OUT_OF_RANGE
        return None

    def _too_fast(self, value: float, rate_k: float) -> bool:
        if math.isnan(self._good_c):
            return False
        moved_k = abs(self._r(value - self._good_c))
        if moved_k <= self._step_k:
            return False
        return moved_k > self._r(self._r(self._step_k + rate_k) + self._allowance_k)
