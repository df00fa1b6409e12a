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
from typing import TYPE_CHECKING, Final, NamedTuple, cast, final

import numpy as np

from thermaxis.runtime.record._clock import iso_of
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

    value: str
    """For the log; empty where there is no new measurement."""
    status: str
    """Name of the status that the server gave."""
    source_time: str
    """Time stamp of the source, ISO 8601 in UTC; empty where there is none."""
    remark: str
    """Why the value was left out, and what was sent; else empty."""

    @property
    def of_source(self) -> str:
        """The cells of the file of sources."""
        return f"{self.status},{self.source_time},{self.remark}"


NOT_ASKED: Final = Cells("", "", "", "")
"""A channel that is not due in a row."""


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
        self._stamp: datetime | None = None
        self._stamp_seen_ms = -math.inf
        self._sent = ""

    def no_answer(self) -> Cells:
        """Return the cells of a reading that the server did not answer."""
        self.asked += 1
        return self._not_good(NO_ANSWER, "", "")

    def read(self, answer: "ua.DataValue", log_ms: float) -> Cells:
        """Return the cells of an answer."""
        self.asked += 1
        status = "Good" if answer.StatusCode is None else answer.StatusCode.name
        good = answer.StatusCode is None or answer.StatusCode.is_good()
        stamp = _aware(answer.SourceTimestamp)
        stamp_text = "" if stamp is None else iso_of(stamp)
        sent, number = _number_of(answer)
        same_stamp = stamp is not None and stamp == self._stamp
        unchanged = same_stamp and sent == self._sent
        if not unchanged:
            self._stamp, self._stamp_seen_ms, self._sent = stamp, log_ms, sent
        if not good:
            return self._not_good(status, stamp_text, sent)
        if number is None:
            self.not_good["no number"] = self.not_good.get("no number", 0) + 1
            return Cells("", status, stamp_text, f"no number; sent {sent}" if sent else "no value")
        self.unstamped += stamp is None
        self.unchanged_in_a_row = self.unchanged_in_a_row + 1 if unchanged else 0
        # A value that moves under one time stamp was measured anew all the same.
        remark = "source time unchanged" if same_stamp else ""
        if unchanged:
            self.unchanged += 1
            remark = "unchanged"
            self.unchanged_for_s = (log_ms - self._stamp_seen_ms) / 1000.0
            if self.unchanged_for_s > (self.settings.repeat_unchanged_s or 0.0):
                return Cells("", status, stamp_text, remark)
        self.recorded += 1
        return Cells(self._scaled(number), status, stamp_text, remark)

    def _not_good(self, status: str, stamp: str, sent: str) -> Cells:
        self.not_good[status] = self.not_good.get(status, 0) + 1
        self.unchanged_in_a_row = 0
        return Cells("", status, stamp, f"sent {sent}" if sent else "")

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
    variant = answer.Value
    value = None if variant is None else cast("object", variant.Value)
    if variant is None or value is None:
        return "", None
    if not isinstance(value, int | float):
        text = str(value)[:_LONGEST_TEXT]
        return "".join(c if c.isascii() and c.isalnum() else "_" for c in text), None
    number = float(value)
    if variant.VariantType.name == "Float":  # 22.3 of 32 bits, and not 22.299999237
        number = float(str(np.float32(number)))
    return _shortest(number), number if math.isfinite(number) else None


def _aware(stamp: datetime | None) -> datetime | None:
    if stamp is None or stamp.year < _FIRST_YEAR:
        return None
    return stamp.replace(tzinfo=UTC) if stamp.tzinfo is None else stamp.astimezone(UTC)
