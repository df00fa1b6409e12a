"""Sensors: when what was read of a channel is believed."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from thermaxis.errors import ConfigurationError, require_positive, require_range

LARGEST_RULE = 1e6
"""Largest number in a rule: eleven days, or a million kelvin."""
WITNESS_S = 3600.0
"""Time constant of the average that is taken of a witness: the air of a hall swings while its walls
and columns stand. [s]"""
LONGEST_REST = 6.0
"""Beside a witness a value may stand at most so many times `frozen_s`: a day by default. In a hall
with air conditioning healthy columns stood for 16 hours [run]. [1]"""
_AWAY_C = 1e9  # no temperature is near it


class SampleQuality(StrEnum):
    """What is wrong with what was read of one channel."""

    GOOD = "good"
    REDUNDANT = "redundant"
    """The redundant sensor stands in."""
    MISSING = "missing"
    """There is no value."""
    STATUS_BAD = "status_bad"
    """The status is not good."""
    OLD = "old"
    """The value is too old."""
    NO_TIME_STAMP = "no_time_stamp"
    """The value has no time stamp."""
    OUT_OF_RANGE = "out_of_range"
    """The value is not plausible."""
    TOO_FAST = "too_fast"
    """The value jumped."""
    FROZEN = "frozen"
    """The value does not change at all."""
    DISAGREES = "disagrees"
    """The two sensors disagree."""


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
    changed_s: float = math.nan
    """Time of the last change of the value; `cycle` puts it off by a gap, in which nobody has seen
    it stand. [s]"""
    allowance_k: float = 0.0
    """How far the value may have moved while nothing could be read. [K]"""
    refused: bool = False
    """Whether the last sample was not believed."""
    witness_c: float = math.nan
    """Average of the sensor that it moves with; NaN where that is not known. [degC]"""
    witnessed_c: float = math.nan
    """The same when the value changed last; far away once the average has gone further than it
    may. [degC]"""


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorRules:
    """When a value of one channel is believed. The range has no default: it must be stated.

    Raises
    ------
    ConfigurationError
        If a number is not finite or out of its range.
    """

    lowest_c: float
    """Lowest plausible value; above 0 where an open input reads 0.0 [run]. [degC]"""
    highest_c: float
    """Highest plausible value. [degC]"""
    largest_rate_k_per_s: float = 0.1
    """Fastest plausible change. Default: 6 K a minute, faster than a bearing warms. [K/s]"""
    step_k: float = 1.0
    """Jump that is believed at any rate: noise. Default: ten counts of 0.1 K. [K]"""
    longest_age_s: float = 10.0
    """Oldest value that is believed. Default: ten cycles of a second. [s]"""
    time_stamp_required: bool = True
    """Whether a value without a time stamp is refused. Default: an unknown age is never "fresh"."""
    frozen_s: float = 14_400.0
    """A value that has not changed at all for so long is not believed; 0 where the sensor may
    stand still. Default: four hours. [s]"""
    moves_with: str = ""
    """Input beside this one that moves with it: as long as that is believed, or has changed within
    the last hour, and has gone, averaged over an hour, no further than `rests_k` since this value
    changed, this one may stand for six times `frozen_s`. Without it: it may not."""
    rests_k: float = 0.0
    """How far that input may go while this one rests on one step of its resolution; from logs, as
    `thermaxis channels` tells it. Default: none is named in `moves_with`, else required. [K]"""
    largest_difference_k: float = 3.0
    """Largest difference to the redundant sensor, where there is one. Default: three kelvin. [K]"""

    def __post_init__(self) -> None:
        """Check the numbers."""
        if not -1e6 <= self.lowest_c < self.highest_c <= 1e6:
            raise ConfigurationError(
                "no_range", lowest=self.lowest_c, highest=self.highest_c, key="lowest_c, highest_c"
            )
        for name in ("largest_rate_k_per_s", "longest_age_s", "largest_difference_k"):
            require_positive(name, getattr(self, name), LARGEST_RULE)
        for name in ("step_k", "frozen_s", "rests_k"):
            require_range(name, getattr(self, name), 0.0, LARGEST_RULE)
        if self.moves_with:
            require_positive("rests_k", self.rests_k, LARGEST_RULE)


def validate_sample(
    rules: SensorRules,
    state: SensorState,
    sample: Sample,
    time_s: float,
    elapsed_s: float,
    witness: SensorState = SensorState(),  # noqa: B008 - it never changes
) -> tuple[SampleQuality, SensorState]:
    """Judge what was read of one sensor.

    A value is believed when it is there, its status good, its age known and small, and the value
    plausible: in its range, no further from the last believed one than its rate allows, and not
    frozen. It is frozen when it stands for longer than `frozen_s`, or `LONGEST_REST` times that as
    long as a witness that is believed has hardly moved since the last change. While nothing can be
    read, or nothing in its range, the value may move on at its rate. A value that is refused for a
    jump is believed again when it comes back, within three steps (and what one cycle allows) of
    where it was, or when the jump is acknowledged, never by waiting alone: a swapped sensor stays
    refused.

    Not protected: an error within these bounds is believed, such as a slow drift of the sensor, or
    two sensors of nearly equal temperature that were swapped; and one that is stuck is believed for
    `LONGEST_REST` times `frozen_s` as long as its witness has hardly moved.

    Parameters
    ----------
    rules : SensorRules
        When a value is believed.
    state : SensorState
        What the last judgement left.
    sample : Sample
        What was read.
    time_s : float
        Time of the cycle. [s]
    elapsed_s : float
        Time since the last cycle, not negative. [s]
    witness : SensorState
        Memory of the sensor that it moves with. Default: there is none.

    Returns
    -------
    quality : SampleQuality
        ``GOOD`` or what is wrong.
    state : SensorState
        For the next judgement.
    """
    value, good, age_s = sample
    known = not math.isnan(witness.good_c)
    if known:
        witness_c = witness.good_c if math.isnan(state.witness_c) else state.witness_c
        witness_c += elapsed_s / (WITNESS_S + elapsed_s) * (witness.good_c - witness_c)
        gone = abs(witness_c - state.witnessed_c) > rules.rests_k
        seen_c = witness_c if math.isnan(state.witnessed_c) else state.witnessed_c
        state = state._replace(witness_c=witness_c, witnessed_c=_AWAY_C if gone else seen_c)
    good_c, changed_s, allowance_k, _, witness_c, witnessed_c = state
    rate_k = rules.largest_rate_k_per_s * elapsed_s
    unread = state._replace(allowance_k=min(allowance_k + rate_k, LARGEST_RULE), refused=True)
    wrong = _unread(rules, value, good, age_s)
    if wrong is not None or value is None:
        return wrong or SampleQuality.MISSING, unread
    if not rules.lowest_c <= value <= rules.highest_c:
        return SampleQuality.OUT_OF_RANGE, unread
    if value == good_c:
        hardly = abs(witness_c - witnessed_c) <= rules.rests_k
        rests = known and hardly and not witness.refused
        longest_s = (LONGEST_REST if rests else 1.0) * rules.frozen_s
        if 0.0 < longest_s < time_s - changed_s:
            return SampleQuality.FROZEN, state._replace(refused=True)
        changed_s = min(time_s, changed_s)
        return SampleQuality.GOOD, state._replace(
            changed_s=changed_s, allowance_k=0.0, refused=False
        )
    if abs(value - good_c) > rules.step_k + rate_k + allowance_k:  # false for NaN: the first value
        most_k = max(allowance_k, 2.0 * rules.step_k)
        allowance_k = min(allowance_k + rate_k, most_k)
        return SampleQuality.TOO_FAST, state._replace(allowance_k=allowance_k, refused=True)
    return SampleQuality.GOOD, SensorState(
        value, time_s, witness_c=witness_c, witnessed_c=witness_c
    )


def _unread(rules: SensorRules, value: object, good: object, age_s: object) -> SampleQuality | None:
    """Return why nothing was read, whatever a source sent; None where there is a number."""
    if type(value) is not float or not math.isfinite(value):
        return SampleQuality.MISSING
    if good is not True:
        return SampleQuality.STATUS_BAD
    if age_s is None:
        return SampleQuality.NO_TIME_STAMP if rules.time_stamp_required else None
    if type(age_s) is not float or not abs(age_s) <= rules.longest_age_s:
        return SampleQuality.OLD
    return None
