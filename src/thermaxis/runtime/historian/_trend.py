"""What is kept of every minute for charts over days: least, greatest, sum and count."""

from collections.abc import Iterable
from typing import Final, NamedTuple

from thermaxis.runtime.historian._layout import Layout, SeriesColumn

MINUTE_US: Final = 60_000_000
"""A minute. [µs]"""
ACTIVE: Final = SeriesColumn("active", "1", -1)
"""Series that is 1 while the compensation is active and 0 otherwise."""
LARGEST: Final = 1e15
"""Values of larger magnitude are left out, so that sums stay finite."""


class Tally(NamedTuple):
    """A number in a minute."""

    entries: int
    """How often it was there. [1]"""
    lowest: float
    """Least value."""
    highest: float
    """Greatest value."""
    total: float
    """Sum of the values."""

    def __or__(self, other: "Tally") -> "Tally":
        """Return the tally of both together."""
        return Tally(
            self.entries + other.entries,
            min(self.lowest, other.lowest),
            max(self.highest, other.highest),
            self.total + other.total,
        )


def tally(
    layout: Layout, rows: Iterable[bytes], active_code: int | None
) -> dict[tuple[SeriesColumn, int], Tally]:
    """Return what is kept of rows, by series and minute."""
    numbers, times, words, _ = layout.counts
    by_minute: dict[int, list[tuple[float, ...]]] = {}
    for row in rows:
        values = layout.row.unpack(row)
        by_minute.setdefault(values[numbers + 1] // MINUTE_US, []).append(values)
    flags = numbers + times + words
    found: dict[tuple[SeriesColumn, int], Tally] = {}
    for minute, cycles in by_minute.items():
        columns = list(zip(*cycles, strict=True))
        for series in layout.series:
            values = columns[series.place]
            if series.good is not None:
                good = columns[flags + series.good]
                values = [v for v, g in zip(values, good, strict=True) if g]
            kept = [v for v in values if -LARGEST <= v <= LARGEST]  # NaN is not
            if kept:
                found[series, minute] = Tally(len(kept), min(kept), max(kept), sum(kept))
        active = sum(code == active_code for code in columns[numbers + times])
        length = len(cycles)
        found[ACTIVE, minute] = Tally(
            length, float(active == length), float(active > 0), float(active)
        )
    return found
