"""Time of a log: it follows the time of day and never goes back.

The time of day of a computer is set by hand, by a time server, or goes on while the computer
sleeps; the monotonic clock is not, but knows no date. The log's clock takes the pace from the
monotonic clock and the date from the time of day:

* differences up to `LARGEST_SLEW_S` are worked off, by half a millisecond per second at most, as
  time servers do it;
* where the time of day jumps forward, the log's time jumps with it: time may have passed that the
  monotonic clock did not count, as in sleep, and a gap that is none costs less than one that is
  not seen;
* where it jumps back, the log's time goes on as if nothing had happened and stays ahead of the
  time of day, until that jumps forward again or the recording is started anew.

Not protected: a time of day that is wrong from the start.
"""

from datetime import UTC, datetime, timedelta
from typing import Final, NamedTuple, final

from thermaxis.codes import Message
from thermaxis.runtime._ports import Clock

LARGEST_SLEW_S: Final = 2.0
"""Larger differences between the clocks are jumps. Default: more than time servers let a clock
drift before they step it (128 ms), and less than anybody sets by hand. [s]"""
_SLEW = 5e-4
_MICROSECOND = timedelta(microseconds=1)
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


class ClockChange(NamedTuple):
    """A jump of the time of day."""

    by_s: float
    """How far it jumped; negative: back. [s]"""
    log_by_s: float
    """How far the log's time jumped with it, never negative. [s]"""
    ahead_s: float
    """How far the log's time is ahead of the time of day since then. [s]"""

    @property
    def message(self) -> Message:
        """What happened."""
        if self.by_s < 0.0:
            values = {"by_s": -self.by_s, "ahead_s": self.ahead_s}
            return Message("recording-clock_set_back", values)
        if self.log_by_s == self.by_s:
            return Message("recording-clock_jumped", {"by_s": self.by_s})
        return Message("recording-clock_jumped_partly", self._asdict())


@final
class LogClock:
    """The clock of a log."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._monotonic_s = clock.monotonic_s()
        self._log_us = _since_epoch_us(clock.utc())
        self._ahead_us = 0

    @property
    def ahead_s(self) -> float:
        """How far the log's time is ahead of the time of day. [s]"""
        return self._ahead_us / 1e6

    def read(self) -> tuple[float, ClockChange | None]:
        """Return the log's time, and a jump of the time of day since the last call."""
        monotonic_s = self._clock.monotonic_s()
        elapsed_us = max(0, round((monotonic_s - self._monotonic_s) * 1e6))
        self._monotonic_s = monotonic_s
        self._log_us += elapsed_us
        off_us = _since_epoch_us(self._clock.utc()) + self._ahead_us - self._log_us
        change = None
        if abs(off_us) > LARGEST_SLEW_S * 1e6:
            change = self._jump(off_us)
        else:
            most_us = int(elapsed_us * _SLEW)
            self._log_us += max(-most_us, min(most_us, off_us))
        return self._log_us / 1e3, change

    def monotonic_of(self, log_ms: float) -> float:
        """Return the monotonic time at which the log's time will be another one. [s]"""
        return self._monotonic_s + (log_ms * 1e3 - self._log_us) / 1e6

    def _jump(self, off_us: int) -> ClockChange:
        before_us = self._ahead_us
        if off_us < 0:
            self._ahead_us -= off_us
            return ClockChange(off_us / 1e6, 0.0, self.ahead_s)
        self._ahead_us = max(0, before_us - off_us)
        log_by_us = off_us - (before_us - self._ahead_us)
        self._log_us += log_by_us
        return ClockChange(off_us / 1e6, log_by_us / 1e6, self.ahead_s)


def _since_epoch_us(moment: datetime) -> int:
    return (moment - _EPOCH) // _MICROSECOND


def moment_of(log_ms: float) -> datetime:
    """Return the date and time of a log's time. [ms since 1970]"""
    return _EPOCH + timedelta(microseconds=round(log_ms * 1e3))


def as_text(log_ms: float) -> str:
    """Return a log's time [ms since 1970] as ISO 8601 in UTC with three decimals."""
    return moment_of(round(log_ms)).strftime("%Y-%m-%dT%H:%M:%S.") + f"{round(log_ms) % 1000:03d}Z"
