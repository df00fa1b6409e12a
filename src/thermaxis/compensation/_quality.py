"""How good inputs and outputs are, and what happened in a cycle: values with a sentence each."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple, final

from thermaxis.errors import ConfigurationError

LARGEST_RULE = 1e6
"""Largest number in a rule: eleven days, or a million kelvin."""


class Quality(StrEnum):
    """Whether an output may be used."""

    GOOD = "good"
    """Every input was read."""
    HELD = "held"
    """An input failed a moment ago; its last value stands for it."""
    BAD = "bad"
    """An input failed for too long, or was never read: the output must not drive anything."""


class Outcome(StrEnum):
    """What was out of the ordinary in a cycle; the value is its sentence."""

    STARTED = "the model started"
    WAITING = "the model waits until every input has a good value"
    CLOCK_BACKWARD = "the clock went backward: the model started anew at the steady state"
    CLOCK_UNUSABLE = "the time of the reading is no number: nothing was advanced"
    CLOCK_STILL = "the clock stands still: nothing was advanced"
    STATE_UNUSABLE = "the stored state does not belong to this model: the model starts anew"
    GAP = "no reading for longer than the longest gap: the model started anew at the steady state"
    INPUT_HELD = "an input failed: its last good value is held"
    INPUT_FAILED = "an input failed for longer than it may be held"
    DIAMETER_HELD = "the workpiece's diameter lies outside the gains' range: the end value is held"
    DIAMETER_UNKNOWN = "no workpiece diameter is stated: the gain at the tool centre point is used"
    OUTSIDE_VALIDITY = "an input lies outside the range that the model was made from"


class SampleQuality(StrEnum):
    """What is wrong with what was read of one channel; the value is its sentence."""

    GOOD = "good"
    SPARE = "the spare sensor stands in"
    MISSING = "there is no value"
    STATUS_BAD = "the status is not good"
    OLD = "the value is too old"
    NO_TIME_STAMP = "the value has no time stamp"
    OUT_OF_RANGE = "the value is not plausible"
    TOO_FAST = "the value jumped"
    FROZEN = "the value does not change at all"
    DISAGREES = "the two sensors disagree"


class Sample(NamedTuple):
    """What was read of one channel."""

    value: float | None
    """The value; None where there is none. [degC]"""
    good: bool = True
    """Whether its status is good."""
    age_s: float | None = 0.0
    """Time since the source stamped it; None where it has no time stamp. [s]"""


class SensorState(NamedTuple):
    """What the judgement of one sensor remembers."""

    good_c: float = math.nan
    """Last value that was accepted; NaN before the first. [degC]"""
    good_s: float = math.nan
    """Time of it. [s]"""
    changed_s: float = math.nan
    """Time of the last change of the value. [s]"""
    allowance_k: float = 0.0
    """How far the value may have moved while nothing could be read. [K]"""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class SensorRules:
    """When a value of one channel is believed. The range has no default: it must be stated.

    Raises
    ------
    ConfigurationError
        If a number is not finite or out of its range.
    """

    lowest_c: float
    """Lowest plausible value. A pin that is not connected often reads 0.0. [degC]"""
    highest_c: float
    """Highest plausible value. [degC]"""
    largest_rate_k_per_s: float = 0.1
    """Fastest plausible change. Default: six kelvin a minute, faster than a bearing warms.
    [K/s]"""
    step_k: float = 1.0
    """Jump that is believed at any rate: noise and resolution. Default: ten counts of 0.1 K.
    [K]"""
    longest_age_s: float = 10.0
    """Oldest value that is believed. Default: ten cycles of a second. [s]"""
    time_stamp_required: bool = True
    """Whether a value without a time stamp is refused."""
    frozen_s: float = 14_400.0
    """A value that has not changed at all for so long is not believed; 0 where the sensor may
    stand still. Default: four hours. [s]"""
    largest_difference_k: float = 3.0
    """Largest difference to the spare sensor, where there is one. Default: three kelvin. [K]"""

    def __post_init__(self) -> None:
        """Check the numbers."""
        if not -1e6 <= self.lowest_c < self.highest_c <= 1e6:
            raise ConfigurationError(
                "the lowest and highest plausible value are no range", where="lowest_c, highest_c"
            )
        for name in ("largest_rate_k_per_s", "longest_age_s", "largest_difference_k"):
            if not 0.0 < getattr(self, name) <= LARGEST_RULE:
                raise ConfigurationError(
                    f"not a positive number of at most {LARGEST_RULE:g}", where=name
                )
        for name in ("step_k", "frozen_s"):
            if not 0.0 <= getattr(self, name) <= LARGEST_RULE:
                raise ConfigurationError(f"not a number from 0 to {LARGEST_RULE:g}", where=name)
