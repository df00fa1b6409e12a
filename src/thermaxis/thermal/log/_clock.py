"""Put the rows of a record in order of time, and say what its clock did."""

from dataclasses import dataclass
from typing import TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, remark
from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray

IntArray: TypeAlias = NDArray[np.int64]

MOST_SET_BACKS = 20
"""More backward steps of the clock than this are rows out of order. [1]"""
SHORT_SET_BACK = 5.5
"""A clock set back by at most so many rows was corrected: the rows it repeats are left out. [1]"""
_FITS = 0.4
"""A row out of order lies at least this share of the usual step from every other one. [1]"""
_HOUR_S, _DAY_S = 3600.0, 86400.0
_HOUR_WITHIN_S = 90.0


@final
@dataclass(frozen=True, slots=True, eq=False)
class StraightTimes:
    """Which rows of a file make the rows of a log, and when."""

    time_s: FloatArray
    """Strictly increasing times, (k,), from the clock's own origin. [s]"""
    order: IntArray | None
    """Rows of the file in order of time, (n,); None if all rows stay as they are."""
    place: IntArray | None
    """Row of the log that each of them belongs to, (n,); None if every row has its own."""
    remarks: tuple[Message, ...]

    def take(self, values: FloatArray) -> FloatArray:
        """Return a column in the rows of the log."""
        if self.order is None:
            return values
        taken = values[self.order]
        if self.place is None:
            return taken
        result = np.full(self.time_s.size, np.nan)
        measured = np.flatnonzero(~np.isnan(taken))[::-1]
        result[self.place[measured]] = taken[measured]  # of equal places the last assigned stays
        return result


def straighten_times(
    time_s: FloatArray, *, local: bool = False, undated: bool = False
) -> StraightTimes:
    """Put rows in order of time, whatever the clock of the recorder did.

    Rows without a time are left out. A file from the latest to the earliest row is turned round.
    Single rows out of order are sorted in. A clock that was set back by more than a few rows, as
    at the end of daylight saving time, makes later times go on from the last one by the usual
    step. A clock set forward cannot be told from a gap and stays. Rows of one time become one.
    Where times of day are `undated`, a step back by more than half a day is a midnight.
    """
    remarks: list[Message] = []
    order: IntArray | None = None
    given = np.isfinite(time_s)
    if not bool(given.all()):
        order = np.flatnonzero(given).astype(np.int64)
        lost = time_s.size - order.size
        remarks.append(remark("rows_without_time", count=lost))
        time_s = time_s[order]
    if time_s.size == 0:
        raise DataError("no_times")
    steps = np.diff(time_s)
    if bool((steps > 0.0).all()):
        return StraightTimes(time_s, order, None, tuple(remarks))
    if order is None:
        order = np.arange(time_s.size, dtype=np.int64)
    if np.count_nonzero(steps < 0.0) > 0.9 * steps.size:
        order, time_s = order[::-1], time_s[::-1]
        remarks.append(remark("rows_turned_round"))
    midnights = np.diff(time_s) < -0.5 * _DAY_S
    if undated and bool(midnights.any()) and np.ptp(time_s) < _DAY_S:
        time_s = time_s + _DAY_S * np.concatenate(([0.0], np.cumsum(midnights)))
        remarks.append(remark("midnights_passed", count=int(np.count_nonzero(midnights))))
    time_s, order = _in_order(time_s, order, remarks, local=local)
    first = np.concatenate(([True], np.diff(time_s) > 0.0))
    place = None
    if not bool(first.all()):
        place = (np.cumsum(first) - 1).astype(np.int64)
        remarks.append(_about_repeated(time_s, first))
    return StraightTimes(time_s[first], order, place, tuple(remarks))


def _about_repeated(time_s: FloatArray, first: NDArray[np.bool_]) -> Message:
    repeated = int(np.count_nonzero(~first))
    at_s = float(time_s[~first][0] - time_s[0])
    if repeated > 0.3 * first.size:
        return remark("clock_too_coarse", count=repeated, at_s=at_s)
    return remark("times_repeated", count=repeated, at_s=at_s)


def _in_order(
    time_s: FloatArray, order: IntArray, remarks: list[Message], *, local: bool
) -> tuple[FloatArray, IntArray]:
    """Sort rows that are out of order, and carry times on where the clock was set back."""
    back = np.flatnonzero(np.diff(time_s) < 0.0) + 1
    if back.size > MOST_SET_BACKS:
        remarks.append(remark("rows_sorted", count=back.size))
        return _sorted(time_s, order)
    steps = np.diff(time_s)
    rising = steps[steps > 0.0]
    usual = float(np.median(rising)) if rising.size else 1.0
    time_s = time_s.copy()
    unsorted = 0
    kept = np.ones(time_s.size, dtype=np.bool_)
    for row in map(int, back):
        before = np.sort(time_s[:row])
        covered = row + int(np.argmax(time_s[row:] > before[-1]))
        covered = time_s.size if covered == row else covered
        again = time_s[row:covered]
        amount = float(before[-1] - time_s[row])
        if again.size == 0:  # an earlier shift already carried these rows on
            continue
        if _apart(again, before) >= _FITS * usual:
            unsorted += again.size
        elif amount <= SHORT_SET_BACK * usual:
            kept[row:covered] = False
            first, back_s = int(order[row]), amount + usual
            remarks.append(remark("rows_repeat_times", count=again.size, row=first, back_s=back_s))
        else:
            time_s[row:] += amount + usual
            remarks.append(_about_set_back(int(order[row]), amount + usual, usual, local=local))
    if unsorted:
        remarks.append(remark("rows_sorted_in", count=unsorted))
    return _sorted(time_s[kept], order[kept])


def _apart(times: FloatArray, others: FloatArray) -> float:
    """Return the least distance of any of some times from the nearest of others. [s]"""
    right = np.clip(np.searchsorted(others, times), 1, others.size - 1) if others.size > 1 else 0
    left = np.maximum(np.asarray(right) - 1, 0)
    return float(np.min(np.minimum(np.abs(times - others[right]), np.abs(times - others[left]))))


def _about_set_back(row: int, amount: float, usual: float, *, local: bool) -> Message:
    one_hour = abs(amount - _HOUR_S) <= max(usual, _HOUR_WITHIN_S)
    of_an_hour = "daylight_saving_ended" if local else "clock_set_back_one_hour"
    code = of_an_hour if one_hour else "clock_set_back"
    return remark(code, back_s=amount, row=row, usual_s=usual)


def _sorted(time_s: FloatArray, order: IntArray) -> tuple[FloatArray, IntArray]:
    rank = np.argsort(time_s, kind="stable")
    return time_s[rank], order[rank]
