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

from typing import Final, final

from thermaxis.codes import Message
from thermaxis.runtime._backlog import from_us, to_us
from thermaxis.runtime._ports import Clock

SMALLEST_JUMP_S: Final = 0.5
"""Smaller differences between the clocks are followed. Default: more than time servers let a clock
drift before they step it (128 ms), and less than anybody sets by hand. [s]"""


@final
class LogClock:
    """The clock of a log."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._monotonic_s, self._log_us = clock.monotonic_s(), to_us(clock.utc())
        self._ahead_us = 0

    def read(self) -> tuple[int, Message | None]:
        """Return the log's time [µs since 1970], and a jump of the time of day since last time."""
        monotonic_s, utc_us = self._clock.monotonic_s(), to_us(self._clock.utc())
        passed_us = round(1e6 * (monotonic_s - self._monotonic_s))
        by_us = utc_us + self._ahead_us - self._log_us - passed_us
        jumped = abs(by_us) > 1e6 * SMALLEST_JUMP_S
        used_us = min(by_us, self._ahead_us) if jumped else 0  # back: all; forward: the lead first
        self._ahead_us -= used_us
        self._monotonic_s, self._log_us = monotonic_s, max(self._log_us, utc_us + self._ahead_us)
        if not jumped:
            return self._log_us, None
        word = "set_back" if by_us < 0 else "jumped_partly" if used_us else "jumped"
        values = {"by_s": abs(by_us), "ahead_s": self._ahead_us, "log_by_s": by_us - used_us}
        message = Message(f"recording-clock_{word}", {k: v / 1e6 for k, v in values.items()})
        return self._log_us, message

    def monotonic_of(self, log_us: int) -> float:
        """Return the monotonic time at which the log's time will be another one. [s]"""
        return self._monotonic_s + (log_us - self._log_us) / 1e6


def as_text(log_us: int) -> str:
    """Return a time [µs since 1970] as ISO 8601 in UTC with three decimals."""
    return from_us(log_us).isoformat(timespec="milliseconds").replace("+00:00", "Z")
