"""How good an output is, and what happened in a cycle: values with a sentence each."""

from enum import StrEnum


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
