"""The supervisor: when the machine is compensated, and what follows when something fails."""

from dataclasses import dataclass, fields
from enum import StrEnum
from typing import NamedTuple, final

from thermaxis.errors import ConfigurationError

LONGEST_RULE_S = 86_400.0
"""Longest time in a rule: a day. [s]"""


class SupervisorState(StrEnum):
    """State of the compensation. The names are the same everywhere, the screen included."""

    OFF = "Off"
    """Nobody has enabled the compensation; the offset is left as it is."""
    WARMING = "Warming"
    """Enabled; something that it needs is not there yet."""
    ACTIVE = "Active"
    """The correction follows the model."""
    HOLDING = "Holding"
    """The correction is kept as it is."""
    FADING = "Fading"
    """The correction goes to zero at the allowed rate."""
    FAULT = "Fault"
    """Something is wrong that a person must look at; the correction goes to zero at the allowed
    rate and stays there until the fault is acknowledged."""


class Reason(StrEnum):
    """Why the compensation is not active; the value is its sentence."""

    DISABLED = "nobody has enabled it"
    SETTLING = "the model has not run for long enough"
    HEALING = "everything is there again; it must stay so for a moment"
    INPUT_BAD = "an input has no usable value"
    CONNECTION_LOST = "the connection to the machine is lost"
    INTERLOCK_OPEN = "an interlock is not met"
    OPERATOR_HOLD = "an operator holds it"
    HOLD_EXPIRED = "it was held for as long as it may be"
    READ_BACK_DIFFERS = "the machine does not report the offset that was written"
    LONG_AT_LIMIT = "the correction stood at its limit for too long"
    DOUBLE_COMPENSATION = "another compensation is active on the axis"
    OFFSET_OUTSIDE = "the offset found in the machine lies outside the limits"


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class SupervisorRules:
    """How long what is tolerated. Every default is finite, and none may be set beyond a day.

    Raises
    ------
    ConfigurationError
        If a number is not from 0 to a day, or the read-back's tolerance is not positive.
    """

    settle_s: float = 60.0
    """Time that the model runs with good inputs before the first correction. Default: a minute.
    [s]"""
    heal_s: float = 1.0
    """Time that everything must be there again after a loss. Default: a second. [s]"""
    grace_s: float = 2.0
    """Time for which a lost input is bridged by its last value. Default: two cycles. [s]"""
    hold_input_s: float = 300.0
    """Time for which the correction is held while an input is lost; then it fades. Default: five
    minutes. [s]"""
    hold_connection_s: float = 300.0
    """The same while the connection is lost. Default: five minutes. [s]"""
    hold_interlock_s: float = 0.0
    """The same while an interlock is not met. Default: it fades at once. [s]"""
    hold_operator_s: float = 3600.0
    """Time after which an operator's hold fades. Default: an hour. [s]"""
    at_limit_s: float = 600.0
    """Time at the magnitude's limit that is a fault. Default: ten minutes. [s]"""
    read_back_tolerance_um: float = 0.5
    """Difference of read-back and written correction that is believed. Default: half of what a
    control displays. [µm]"""
    read_back_s: float = 10.0
    """Time for which they may differ, or nothing be read back, before it is a fault. Default: ten
    cycles. [s]"""
    longest_trim_s: float = 28_800.0
    """Longest time after which a trim expires. Default: a shift. [s]"""

    def __post_init__(self) -> None:
        """Check the numbers."""
        for entry in fields(self):
            value = getattr(self, entry.name)
            if not 0.0 <= value <= LONGEST_RULE_S:
                raise ConfigurationError(
                    f"not a number from 0 to {LONGEST_RULE_S:g}", where=entry.name
                )
        if self.read_back_tolerance_um <= 0.0:
            raise ConfigurationError("not a positive number", where="read_back_tolerance_um")
