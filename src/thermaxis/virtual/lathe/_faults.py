"""Faults of the virtual lathe, on request: what they are, when they act, and how they are written.

A fault is written as a sentence,

    stuck T_spindle_C at 2h for 10min
    jump T_table_C by 5 at 90min for 1min every 3h
    swap T_spindle_C T_table_C at 1h for 30min
    drift touch_um by 5 at 1d
    set emergency_stop to 1 at 3h for 1min
    restart at 10min for 3s every 5min

and acts alike on the server, on the ports in the same program and on logs.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, final

from thermaxis.codes import Place, printable
from thermaxis.errors import ConfigurationError, require_range


class FaultKind(StrEnum):
    """What goes wrong; the value is the word in a fault's sentence."""

    STUCK = "stuck"
    """The value stays as it was; status good, time stamps fresh."""
    STALE = "stale"
    """Value and time stamp stay as they were; status good."""
    JUMP = "jump"
    """The value is off by an amount."""
    DRIFT = "drift"
    """The value is off by an amount more in every hour."""
    SCALE = "scale"
    """The value is multiplied: -1 is a wrong sign, 1000 a wrong unit."""
    NAN = "nan"
    """The value is no number; status good."""
    BAD = "bad"
    """The status is BadSensorFailure, and the value is 0."""
    UNCERTAIN = "uncertain"
    """The status is UncertainSensorNotAccurate; the value goes on."""
    MISSING = "missing"
    """There is no value; the status is BadNoCommunication."""
    SWAP = "swap"
    """Two channels are exchanged."""
    SET = "set"
    """A flag or value of the machine is set."""
    RESTART = "restart"
    """The server is gone, and comes back."""
    PAUSE = "pause"
    """The network stands still: connections stay, nothing is answered."""


OF_NETWORK: Final = frozenset({FaultKind.RESTART, FaultKind.PAUSE})
"""Faults of the way to the machine, not of a channel."""
_CHANNELS = {FaultKind.SWAP: 2, FaultKind.RESTART: 0, FaultKind.PAUSE: 0}
_BY = (FaultKind.JUMP, FaultKind.DRIFT, FaultKind.SCALE)
_AMOUNT_WORD = {**dict.fromkeys(_BY, "by"), FaultKind.SET: "to"}
LONGEST_S = 1e9
"""Longest time in a fault. [s]"""


@final
@dataclass(frozen=True, slots=True)
class Fault:
    """Something that goes wrong for some time.

    Raises
    ------
    ConfigurationError
        If times, channels or the amount do not fit together.
    """

    kind: FaultKind
    channels: tuple[str, ...] = ()
    """Where: one channel; two of a swap; none of a restart or a pause."""
    at_s: float = 0.0
    """When it begins, in the machine's time. [s]"""
    for_s: float = math.inf
    """For how long; infinite: for good. [s]"""
    every_s: float | None = None
    """How often it comes again; None: once. [s]"""
    amount: float | None = None
    """By how much a value jumps, drifts in an hour or is multiplied, or what is set. [unit of the
    channel, per hour; 1]"""

    def __post_init__(self) -> None:
        """Check the parts against each other."""
        place = Place(key=f"fault {self.kind}")
        wanted = _CHANNELS.get(self.kind, 1)
        if len(self.channels) != wanted or len(set(self.channels)) != wanted:
            raise ConfigurationError(
                "fault_channel_count", count=len(self.channels), wanted=wanted, place=place
            )
        require_range(place.key, self.at_s, 0, LONGEST_S)
        if not self.for_s > 0.0:
            raise ConfigurationError("not_positive", value=self.for_s, place=place)
        if self.kind in OF_NETWORK and math.isinf(self.for_s):
            raise ConfigurationError("fault_without_end", place=place)
        if self.every_s is not None and not self.for_s < self.every_s <= LONGEST_S:
            raise ConfigurationError(
                "fault_repeats_too_soon", every_s=self.every_s, for_s=self.for_s, place=place
            )
        word = _AMOUNT_WORD.get(self.kind)
        if word is None and self.amount is not None:
            raise ConfigurationError("fault_takes_no_amount", place=place)
        if word is not None and not math.isfinite(math.nan if self.amount is None else self.amount):
            raise ConfigurationError("fault_without_amount", word=word, place=place)

    def begin_s(self, time_s: float) -> float | None:
        """Return when the fault that acts at a time began; None if it does not act. [s]"""
        since = time_s - self.at_s
        if since < 0.0:
            return None
        begin = self.at_s
        if self.every_s is not None:
            begin += since // self.every_s * self.every_s
        return begin if time_s - begin < self.for_s else None

    def next_change_s(self, time_s: float) -> float:
        """Return when it next begins or ends after a time; infinite if never. [s]"""
        if time_s < self.at_s:
            return self.at_s
        begin = self.begin_s(time_s)
        if begin is not None:
            return begin + self.for_s
        if self.every_s is None:
            return math.inf
        return self.at_s + ((time_s - self.at_s) // self.every_s + 1.0) * self.every_s


_TIME = re.compile(r"(\d+(?:\.\d*)?|\.\d+)(ms|s|min|h|d)?", re.ASCII)
_UNITS_S = {"ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0, "d": 86_400.0}
_TIME_WORDS = ("at", "for", "every")
_UNIT_WORDS = frozenset({"K", "um", "mm", "rpm"})


def parse_fault(text: str, channels: Sequence[str]) -> Fault:
    """Read a fault's sentence.

    Parameters
    ----------
    text : str
        ``KIND [CHANNEL [CHANNEL]] [by|to NUMBER] [at TIME] [for TIME] [every TIME]``; times as
        90s, 10min, 2h, 1d; the unit may be left out behind a channel's name (T_spindle).
    channels : sequence of str
        Names that a fault may act on.

    Raises
    ------
    ConfigurationError
        If the sentence is none, or names a channel that is not there.
    """
    words = text.split()
    place = Place(key=f"fault '{printable(text, 80)}'")
    try:
        kind = FaultKind(words[0].casefold())
    except (IndexError, ValueError):
        raise ConfigurationError(
            "unknown_choice", name=words[0] if words else "", known=tuple(FaultKind), place=place
        ) from None
    stops = (*_TIME_WORDS, "by", "to")
    first = next((k for k, w in enumerate(words) if k and w.casefold() in stops), len(words))
    named = tuple(_channel(word, channels, place) for word in words[1:first])
    times: dict[str, float] = {}
    amount: float | None = None
    rest = [word for word in words[first:] if word not in _UNIT_WORDS]
    if len(rest) % 2:
        raise ConfigurationError("fault_word_without_value", place=place)
    for word, value in zip(rest[::2], rest[1::2], strict=True):
        key = word.casefold()
        if key in times or key not in stops or (key in {"by", "to"} and amount is not None):
            raise ConfigurationError("fault_word_unexpected", word=word, place=place)
        if key in _TIME_WORDS:
            times[key] = _seconds(value, place)
        elif key != _AMOUNT_WORD.get(kind):
            raise ConfigurationError("fault_word_unexpected", word=word, place=place)
        else:
            amount = _number(value, place)
    return Fault(
        kind,
        named,
        at_s=times.get("at", 0.0),
        for_s=times.get("for", math.inf),
        every_s=times.get("every"),
        amount=amount,
    )


def parse_seconds(text: str) -> float | None:
    """Return a time as it is written."""
    match = _TIME.fullmatch(text)
    if match is None:
        return None
    seconds = float(match[1]) * _UNITS_S[match[2] or "s"]
    return seconds if seconds <= LONGEST_S else None


def _seconds(text: str, place: Place) -> float:
    seconds = parse_seconds(text)
    if seconds is None:
        raise ConfigurationError("not_a_duration", text=text, place=place)
    return seconds


def _number(text: str, place: Place) -> float:
    try:
        value = float(text.removesuffix("K").removesuffix("um"))
    except ValueError:
        value = math.nan
    if not abs(value) <= 1e9:
        raise ConfigurationError("not_a_number", text=text, place=place)
    return value


def _channel(word: str, channels: Sequence[str], place: Place) -> str:
    folded = word.casefold()
    exact = [name for name in channels if name.casefold() == folded]
    found = exact or [n for n in channels if n.casefold().rpartition("_")[0] == folded]
    if len(found) != 1:
        raise ConfigurationError("unknown_name", name=word, known=tuple(channels), place=place)
    return found[0]
