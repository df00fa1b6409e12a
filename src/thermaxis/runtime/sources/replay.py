"""A recorded log as a source, and its clock: what the compensation would have done on that day."""

import math
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta
from typing import final

import numpy as np

from thermaxis.runtime._ports import NOT_READ, Source, SourceSample, counter_name, probe_name
from thermaxis.thermal import ThermalLog


@final
class ReplayClock:
    """The clock of a replayed log: it is as late as whoever waits wants it to be."""

    def __init__(self, start: datetime = datetime(2000, 1, 1, tzinfo=UTC)) -> None:
        self._start = start
        self._now_s = 0.0

    def monotonic_s(self) -> float:
        """Return the time since the log's first row. [s]"""
        return self._now_s

    def utc(self) -> datetime:
        """Return the time of day on the day of the log."""
        return self._start + timedelta(seconds=self._now_s)

    async def sleep_until(self, monotonic_s: float) -> None:
        """Let that time be now."""
        self._now_s = max(self._now_s, monotonic_s)


@final
class ReplaySource(Source):
    """Values of a log, held until the next row, as if they were read at that time.

    Columns in micrometres that are mostly empty, by their output, are touches: each value in them
    is one, and the counter is its row.
    """

    def __init__(
        self,
        log: ThermalLog,
        names: Mapping[str, str],
        clock: ReplayClock,
        touched: Sequence[str] = (),
    ) -> None:
        self._clock = clock
        first_s = float(log.time_s[0])
        self._time_s: list[float] = [t - first_s for t in log.time_s.tolist()]
        self._columns: dict[str, list[float]] = {
            name: log.column(name, unit=unit).tolist() for name, unit in names.items()
        }
        for output in touched:
            column = log.column(output, unit="um")
            row = np.maximum.accumulate(np.where(np.isnan(column), 0, np.arange(log.rows)))
            self._columns[counter_name(output)] = row.astype(float).tolist()
            self._columns[probe_name(output)] = column[row].tolist()

    async def open(self) -> None:
        """Begin at the first row."""

    @property
    def connected(self) -> bool:
        """A log is always there."""
        return True

    @property
    def ended(self) -> bool:
        """Whether the clock has passed the last row."""
        return self._clock.monotonic_s() >= self._time_s[-1]

    async def read(self, deadline_s: float) -> Mapping[str, SourceSample]:  # noqa: ARG002 - the port's
        """Return the row of now; a cell without a value is a value that could not be read."""
        now_s = self._clock.monotonic_s()
        row = max(bisect_right(self._time_s, now_s + 1e-6) - 1, 0)
        age_s = now_s - self._time_s[row]
        samples: dict[str, SourceSample] = {}
        for name, column in self._columns.items():
            value = column[row]
            samples[name] = (
                NOT_READ if math.isnan(value) else SourceSample(value, good=True, age_s=age_s)
            )
        return samples

    async def close(self) -> None:
        """End."""
