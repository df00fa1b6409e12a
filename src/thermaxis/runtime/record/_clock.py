"""Time of a log: the time of day, but never back.

The time of day of a computer is set by hand, by a time server, or goes on while the computer
sleeps; the monotonic clock is not, but knows no date. A jump is what the one did and the other
did not:

* forward, the log's time jumps with it: time may have passed that the monotonic clock did not
  count, as in sleep, and a gap that is none costs less than one that is not seen;
* back, the log's time goes on as if nothing had happened and stays ahead of the time of day,
  until that jumps forward again or the recording is started anew.

Not protected: a time of day that is wrong from the start.
"""

from datetime import UTC, datetime, timedelta
from typing import Final, final

from thermaxis.codes import Message
from thermaxis.runtime._ports import Clock

SMALLEST_JUMP_S: Final = 0.5
"""Smaller differences between the clocks are followed. Default: more than time servers let a clock
drift before they step it (128 ms), and less than anybody sets by hand. [s]"""
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_NONE = timedelta(0)


@final
class LogClock:
    """The clock of a log."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._monotonic_s = clock.monotonic_s()
        self._log = clock.utc()
        self._ahead = _NONE

    def read(self) -> tuple[float, Message | None]:
        """Return the log's time [ms since 1970], and a jump of the time of day since last time."""
        monotonic_s = self._clock.monotonic_s()
        expected = self._log + timedelta(seconds=monotonic_s - self._monotonic_s)
        self._monotonic_s = monotonic_s
        by = self._clock.utc() + self._ahead - expected
        jumped = abs(by.total_seconds()) > SMALLEST_JUMP_S
        used = (by if by < _NONE else min(by, self._ahead)) if jumped else _NONE
        self._ahead -= used
        self._log = max(self._log, expected + by - used)
        return self._log_ms, self._message(by, used) if jumped else None

    def _message(self, by: timedelta, used: timedelta) -> Message:
        values = {"by_s": abs(by.total_seconds()), "ahead_s": self._ahead.total_seconds()}
        if by < _NONE:
            return Message("recording-clock_set_back", values)
        if used == _NONE:
            return Message("recording-clock_jumped", {"by_s": by.total_seconds()})
        log_by_s = (by - used).total_seconds()
        return Message("recording-clock_jumped_partly", {**values, "log_by_s": log_by_s})

    @property
    def _log_ms(self) -> float:
        return (self._log - _EPOCH) / timedelta(milliseconds=1)

    def monotonic_of(self, log_ms: float) -> float:
        """Return the monotonic time at which the log's time will be another one. [s]"""
        return self._monotonic_s + (log_ms - self._log_ms) / 1e3


def moment_of(log_ms: float) -> datetime:
    """Return the date and time of a log's time. [ms since 1970]"""
    return _EPOCH + timedelta(milliseconds=log_ms)


def as_text(log_ms: float) -> str:
    """Return a log's time [ms since 1970] as ISO 8601 in UTC with three decimals."""
    return iso_of(moment_of(round(log_ms)))


def iso_of(moment: datetime) -> str:
    """Return a moment as ISO 8601 in UTC with three decimals."""
    return moment.astimezone(UTC).replace(tzinfo=None).isoformat(timespec="milliseconds") + "Z"
