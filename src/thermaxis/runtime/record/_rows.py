"""What a server answered, as cells of a log and of the file of sources beside it.

The log has the value alone, or nothing: where the status is not good, where it is no finite
number, and where its source time stamp is that of the last reading, so that it is no new
measurement. Status, source time stamp and what was left out stand in the file of sources.

References
----------
OPC 10000-4, 7.11.3: a time stamp belongs to one received value and never changes with it; it
should be the time of the last change of value or status. A server that follows this to the letter
stamps a steady value once: for such channels a value may count again for a stated time.
"""

import math
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Final, NamedTuple, final

import numpy as np

from thermaxis.runtime._backlog import to_us
from thermaxis.runtime.opcua import content_of, is_good, status_name
from thermaxis.runtime.record._clock import as_text
from thermaxis.runtime.record._config import ChannelSettings

if TYPE_CHECKING:
    from asyncua import ua

NO_ANSWER: Final = "BadNoCommunication"
"""Status of a channel whose server did not answer."""
_FIRST_YEAR = 1990
"""Source time stamps before are no times: servers send 1601 or 1970 for "unknown"."""
_LONGEST_TEXT = 40


class Cells(NamedTuple):
    """One reading of one channel."""

    value: str = ""
    """For the log; empty where there is no new measurement."""
    status: str = ""
    """Name of the status that the server gave; empty where the channel was not due."""
    source_time: str = ""
    """Time stamp of the source, ISO 8601 in UTC; empty where there is none."""
    remark: str = ""
    """Why the value was left out, and what was sent; else empty."""


@final
class ChannelReader:
    """Turns answers of one channel into cells, and counts them."""

    def __init__(self, settings: ChannelSettings) -> None:
        self.settings = settings
        self.asked = 0
        """Readings that were asked for. [1]"""
        self.recorded = 0
        """Readings whose value stands in the log. [1]"""
        self.unchanged = 0
        """Good readings whose source time stamp was that of the last one. [1]"""
        self.unstamped = 0
        """Good readings without a source time stamp. [1]"""
        self.unchanged_in_a_row = 0
        """How many of the last readings these are. [1]"""
        self.unchanged_for_s = 0.0
        """Time over which they were read. [s]"""
        self.not_good: dict[str, int] = {}
        """Readings by the name of their status, where it was not good. [1]"""
        self._last: tuple[datetime | None, str] = None, ""
        self._last_us = 0
        self._count: float | None = None
        self._touched = False

    def read(
        self,
        answer: "ua.DataValue | None",
        log_us: int,
        counter: "ua.DataValue | None" = None,
    ) -> Cells:
        """Return the cells of an answer and of its counter's; None where the server gave none."""
        self.asked += 1
        touched, self._touched = self._touched, self._moved(counter)
        if answer is None:
            return self._left_out(NO_ANSWER, Cells("", NO_ANSWER))
        stamp = _stamp_of(answer)
        sent, number = _number_of(answer)
        said = status_name(answer), "" if stamp is None else as_text(to_us(stamp))
        same_stamp = stamp is not None and stamp == self._last[0]
        unchanged = same_stamp and sent == self._last[1]
        if not unchanged:
            self._last, self._last_us = (stamp, sent), log_us
        if not is_good(answer):
            return self._left_out(said[0], Cells("", *said, f"sent {sent}" if sent else ""))
        if number is None:
            why = f"no number; sent {sent}" if sent else "no value"
            return self._left_out("no number", Cells("", *said, why))
        if self.settings.counter_node:  # it alone says what is new
            return self._touch(Cells(self._scaled(number), *said), new=touched)
        self.unstamped += stamp is None
        self.unchanged += unchanged
        self.unchanged_in_a_row = self.unchanged_in_a_row + 1 if unchanged else 0
        self.unchanged_for_s = (log_us - self._last_us) / 1e6
        # A value that moves under one time stamp was measured anew all the same.
        remark = "unchanged" if unchanged else "source time unchanged" if same_stamp else ""
        if unchanged and self.unchanged_for_s > (self.settings.repeat_unchanged_s or 0.0):
            return Cells("", *said, remark)
        self.recorded += 1
        return Cells(self._scaled(number), *said, remark)

    def _touch(self, cells: Cells, *, new: bool) -> Cells:
        if self._count is None:
            return self._left_out("no counter", cells._replace(value="", remark="no counter"))
        self.recorded += new
        return cells if new else cells._replace(value="", remark="unchanged")

    def _moved(self, counter: "ua.DataValue | None") -> bool:
        """Whether a counter has risen: the value is taken a look later, as it may come behind."""
        before, self._count = self._count, None
        if counter is not None and is_good(counter):
            self._count = _number_of(counter)[1]
        return before is not None and self._count is not None and self._count > before

    def _left_out(self, why: str, cells: Cells) -> Cells:
        self.not_good[why] = self.not_good.get(why, 0) + 1
        self.unchanged_in_a_row = 0
        return cells

    def _scaled(self, number: float) -> str:
        factor, offset = self.settings.factor, self.settings.offset
        if (factor, offset) == (1.0, 0.0):
            return _shortest(number)
        # Twelve digits: 223 tenths are 22.3 and not 22.300000000000004.
        return f"{number * factor + offset:.12g}"


def _shortest(number: float) -> str:
    return repr(number).removesuffix(".0")


def _number_of(answer: "ua.DataValue") -> tuple[str, float | None]:
    """Return what was sent, as a text without separators, and its number if it is a finite one."""
    value = content_of(answer)
    if value is None or answer.Value is None:
        return "", None
    if not isinstance(value, int | float):
        text = str(value)[:_LONGEST_TEXT]
        return "".join(c if c.isascii() and c.isalnum() else "_" for c in text), None
    number = float(value)
    if answer.Value.VariantType.name == "Float":  # 22.3 of 32 bits, and not 22.299999237
        number = float(str(np.float32(number)))
    return _shortest(number), number if math.isfinite(number) else None


def _stamp_of(answer: "ua.DataValue") -> datetime | None:
    stamp = answer.SourceTimestamp
    if stamp is None or stamp.year < _FIRST_YEAR:
        return None
    return stamp.replace(tzinfo=UTC) if stamp.tzinfo is None else stamp
