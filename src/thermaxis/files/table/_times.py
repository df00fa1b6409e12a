"""When each reading of a table was taken, and in which order."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, Place, remark
from thermaxis.errors import MeasurementFileError
from thermaxis.positioning import FloatArray, TimeSource

_YEARS = range(1900, 2201)
_DAY_FIRST = re.compile(
    r"([0-9]{1,2})\. ?([0-9]{1,2})\. ?([0-9]{4})[ T]+([0-9]{1,2})(:[0-9]{2}.*)", re.ASCII
)


@final
@dataclass(frozen=True, slots=True)
class ReadingTimes:
    """Times and acquisition order of the rows of a table."""

    source: TimeSource
    """Where they come from."""
    time_s: FloatArray | None = None
    """Time of each row since the first reading, (k,). [s]"""
    order: FloatArray | None = None
    """Acquisition order of each row, from 1, (k,). [1]"""
    remarks: tuple[Message, ...] = ()
    """Why times or order of the file were not used."""


def parse_moment(text: str) -> datetime | None:
    """Read a date with time as ISO 8601 writes it, or with the day first and points."""
    day_first = _DAY_FIRST.fullmatch(text)
    if day_first is not None:
        day, month, year, hour, rest = day_first.groups()
        text = f"{year}-{month:0>2}-{day:0>2}T{hour:0>2}{rest}"
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        return None
    return moment if moment.year in _YEARS else None


def read_moments(
    cells: Sequence[str | None],
    at: Callable[[int], Place],
    parsed: Callable[[str], datetime | None] = parse_moment,
) -> list[datetime | None]:
    """Read dates with time, None where a cell is empty; all with a zone or all without."""
    moments: list[datetime | None] = []
    zoned: bool | None = None
    for index, cell in enumerate(cells):
        moment = parsed(cell) if cell else None
        if cell and moment is None:
            raise MeasurementFileError("not_a_moment", text=cell, place=at(index))
        if moment is not None:
            if zoned is not None and zoned != (moment.tzinfo is not None):
                raise MeasurementFileError("zones_mixed", place=at(index))
            zoned = moment.tzinfo is not None
        moments.append(moment)
    return moments


def seconds_since(start: datetime, moments: Sequence[datetime | None]) -> FloatArray:
    """Return the times from a start on, NaN where there is none. [s]"""
    return np.array(
        [np.nan if moment is None else (moment - start).total_seconds() for moment in moments]
    )


def reading_times(
    *,
    given: NDArray[np.bool_],
    order: FloatArray | None,
    time_s: FloatArray | None,
    line: NDArray[np.int64],
    at: Callable[[int], Place],
) -> ReadingTimes:
    """Decide what the columns of order and time are worth."""
    remarks: list[Message] = []
    if order is not None and bool(np.isnan(order[given]).any()):
        remarks.append(remark("order_incomplete"))
        order = None
    if time_s is not None and bool(np.isnan(time_s[given]).any()):
        remarks.append(remark("times_incomplete"))
        time_s = None
    if time_s is not None:
        time_s = time_s - time_s[given].min()
    if order is not None:
        _check_distinct(order[given], line[given], at)
        found = _ordered_by_number(order, time_s, given)
    elif time_s is not None:
        found = _ordered_by_time(time_s, given)
    else:
        found = ReadingTimes(TimeSource.NONE)
    return replace(found, remarks=(*remarks, *found.remarks))


def _check_distinct(order: FloatArray, line: NDArray[np.int64], at: Callable[[int], Place]) -> None:
    ranked = np.argsort(order, kind="stable")
    twice = np.flatnonzero(np.diff(order[ranked]) == 0)
    if twice.size:
        first, second = line[ranked[twice[0]]], line[ranked[twice[0] + 1]]
        raise MeasurementFileError("order_number_twice", first=int(first), place=at(int(second)))


def _ordered_by_number(
    order: FloatArray, time_s: FloatArray | None, given: NDArray[np.bool_]
) -> ReadingTimes:
    remarks: tuple[Message, ...] = ()
    counts = order[~np.isnan(order)]
    if bool(np.any(counts < 1)) or bool(np.any(counts != np.rint(counts))):
        order = _ranks(order, given)
        remarks = (remark("order_counted_anew"),)
    if time_s is None:
        return ReadingTimes(TimeSource.ORDER, None, order, remarks)
    rows = np.flatnonzero(given)
    in_order = rows[np.argsort(order[rows])]
    if bool(np.all(np.diff(time_s[in_order]) > 0)):
        return ReadingTimes(TimeSource.FILE, time_s, order, remarks)
    contradiction = remark("times_against_order")
    return ReadingTimes(TimeSource.ORDER, None, order, (*remarks, contradiction))


def _ordered_by_time(time_s: FloatArray, given: NDArray[np.bool_]) -> ReadingTimes:
    times = time_s[given]
    if np.unique(times).size == times.size:
        return ReadingTimes(TimeSource.FILE, time_s, _ranks(time_s, given))
    if bool(np.all(np.diff(times) >= 0)):
        order = np.full(time_s.shape, np.nan)
        order[given] = np.arange(1, times.size + 1)
        return ReadingTimes(TimeSource.ORDER, None, order, (remark("same_times"),))
    return ReadingTimes(TimeSource.NONE, remarks=(remark("same_times_unordered"),))


def _ranks(values: FloatArray, given: NDArray[np.bool_]) -> FloatArray:
    rows = np.flatnonzero(given)
    ranks = np.full(values.shape, np.nan)
    ranks[rows[np.argsort(values[rows])]] = np.arange(1, rows.size + 1)
    return ranks
