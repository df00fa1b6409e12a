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
from thermaxis.files.table._mapping import NO_MAPPING, RunMapping
from thermaxis.positioning import FloatArray, TimeSource

_YEARS = range(1900, 2201)
_DAY_FIRST = re.compile(
    r"([0-9]{1,2})\. ?([0-9]{1,2})\. ?([0-9]{4})[ T]+([0-9]{1,2})(:[0-9]{2}.*)", re.ASCII
)


_STAMP = re.compile(
    r"(?:([0-9]{1,4})([./-]) ?([0-9]{1,2})\2 ?([0-9]{2,4})(?:,?[ T]+|-))?"
    r"([0-9]{1,2}):([0-9]{2})(?::([0-9]{2})(?:[.,]([0-9]{1,9}))?)? ?(?:([ap])\.?m\.?)?",
    re.ASCII | re.IGNORECASE,
)
_DAY_S = 86400.0
_LONG_FALL_S = 10 * 3600.0
_PARTS = {"day": (4, 3, 1), "month": (4, 1, 3), "year": (1, 3, 4)}
_NO_YEAR = 1900  # what strptime says of a form without one
_FEWEST_INTERVALS = 3


@final
@dataclass(frozen=True, slots=True)
class Stamps:
    """The times of a column of texts."""

    time_s: FloatArray
    """Seconds since the first one, or since midnight; NaN where there is none, (k,). [s]"""
    start: datetime | None = None
    """The first one, if its date is known."""
    end: datetime | None = None
    """The last one, if its date is known."""
    interval_s: float = 0.0
    """Each lies between what is written and so much later. [s]"""
    remarks: tuple[Message, ...] = ()


@final
@dataclass(frozen=True, slots=True)
class ReadingTimes:
    """Times and acquisition order of the rows of a table."""

    source: TimeSource
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
    refusal: str = "not_a_moment",
) -> list[datetime | None]:
    """Read dates with time, None where a cell is empty; all with a zone or all without."""
    moments: list[datetime | None] = []
    zoned: bool | None = None
    for index, cell in enumerate(cells):
        moment = parsed(cell) if cell else None
        if cell and moment is None:
            raise MeasurementFileError(refusal, text=cell, place=at(index))
        if moment is not None:
            if zoned is not None and zoned != (moment.tzinfo is not None):
                raise MeasurementFileError("zones_mixed", place=at(index))
            zoned = moment.tzinfo is not None
        moments.append(moment)
    return moments


def read_stamps(
    cells: Sequence[str], at: Callable[[int], Place], mapping: RunMapping = NO_MAPPING
) -> Stamps:
    """Read dates with time, or times of day, in the forms that people write."""
    return _stamps(stamp_moments(cells, at, mapping), cells)


def stamp_moments(
    cells: Sequence[str | None],
    at: Callable[[int], Place],
    mapping: RunMapping = NO_MAPPING,
    refusal: str = "not_a_moment",
) -> list[datetime | None]:
    """Read dates with time, or times of day, in the forms that people write; None where empty.

    What may mean two things is refused: 03/04/2026, or 12:30 that no other cell explains.
    """
    first = next((cell for cell in cells if cell), "")
    form = mapping.time_format
    if form is not None:
        return read_moments(cells, at, lambda text: formatted_moment(text, form), refusal)
    if not first or parse_moment(first) is not None:
        return read_moments(cells, at, parse_moment, refusal)
    matches = [_STAMP.fullmatch(cell) if cell else None for cell in cells]
    dated = _STAMP.fullmatch(first)
    with_date = dated is not None and dated[1] is not None
    order = _date_order(matches, at, mapping) if with_date else ""
    minutes = not with_date and _are_minutes(matches, at)
    moments: list[datetime | None] = []
    for index, (cell, match) in enumerate(zip(cells, matches, strict=True)):
        moment = None if match is None else _moment_of(match, order, minutes=minutes)
        if cell and (moment is None or (match is not None and with_date != bool(match[1]))):
            raise MeasurementFileError(refusal, text=cell, place=at(index))
        moments.append(moment)
    return moments


def formatted_moment(text: str, form: str) -> datetime | None:
    """Read a date with time of a stated form."""
    try:
        return datetime.strptime(text, form)  # noqa: DTZ007  the form may state a zone
    except ValueError:
        return None


def _date_order(
    matches: Sequence[re.Match[str] | None], at: Callable[[int], Place], mapping: RunMapping
) -> str:
    """Say what stands first in dates: year, day or month; refuse what may be both."""
    found = [(k, match) for k, match in enumerate(matches) if match is not None and match[1]]
    if all(len(match[1]) == 4 for _, match in found):
        return "year"
    if mapping.date_order is not None or all(match[2] == "." for _, match in found):
        return mapping.date_order or "day"
    possible = [
        order for order in _PARTS if all(_date_of(match, order) is not None for _, match in found)
    ]
    if len(possible) == 1:
        return possible[0]
    if not possible:
        return "day"  # the date that is none is told where it stands
    k, match = found[0]
    dates = [_date_of(match, order) for order in possible]
    raise MeasurementFileError(
        "date_order_unclear", text=match[0], first=dates[0], second=dates[1], place=at(k)
    )


def _date_of(match: re.Match[str], order: str) -> str | None:
    year, month, day = (match[k] for k in _PARTS[order])
    if len(year) not in {2, 4} or not (1 <= int(month) <= 12 and 1 <= int(day) <= 31):
        return None
    return f"{int(year) + 2000 * (len(year) == 2)}-{month:0>2}-{day:0>2}"


def _are_minutes(matches: Sequence[re.Match[str] | None], at: Callable[[int], Place]) -> bool:
    """Say whether two numbers are minutes and seconds; refuse where they may be hours too."""
    found = [(k, m) for k, m in enumerate(matches) if m is not None and not (m[7] or m[9])]
    if not found:
        return False
    alike = len(found) == sum(match is not None for match in matches)
    if alike and any(int(match[5]) > 23 for _, match in found):
        return True
    if alike and len({match[0] for _, match in found}) < len(found):
        return False  # several readings in a minute: none would be in a second
    k, match = found[0]
    raise MeasurementFileError("hours_or_minutes", text=match[0], place=at(k))


def _moment_of(match: re.Match[str], order: str, *, minutes: bool) -> datetime | None:
    hours, mins, seconds, fraction, half = match.groups(default="")[4:]
    hour, minute, second = int(hours), int(mins), int(seconds or 0)
    if minutes:
        hour, minute, second = hour // 60, hour % 60, minute
    if half:
        if not 1 <= hour <= 12:
            return None
        hour = hour % 12 + 12 * (half in "pP")
    year, month, day = str(_NO_YEAR), "1", "1"
    if match[1]:
        date = _date_of(match, order)
        if date is None:
            return None
        year, month, day = date.split("-")
    micro = int(fraction.ljust(6, "0")[:6]) if fraction else 0
    try:
        return datetime(int(year), int(month), int(day), hour, minute, second, micro)  # noqa: DTZ001 - a table states no zone
    except ValueError:
        return None


def _stamps(moments: Sequence[datetime | None], cells: Sequence[str]) -> Stamps:
    known = [moment for moment in moments if moment is not None]
    if not known:
        return Stamps(np.full(len(cells), np.nan))
    start, end = min(known), max(known)
    whole = all(moment.microsecond == 0 for moment in known)
    minute = whole and all(moment.second == 0 for moment in known)
    interval_s = 60.0 if minute else float(whole)
    if start.year != _NO_YEAR:
        return Stamps(seconds_since(start, moments), start, end, interval_s)
    time_s = seconds_since(start.replace(hour=0, minute=0, second=0, microsecond=0), moments)
    given = time_s[~np.isnan(time_s)]
    half_day = all(1 <= moment.hour <= 12 for moment in known)  # 1:00 may follow 12:59
    if half_day and bool(np.any(np.diff(given) < -_LONG_FALL_S)):
        return Stamps(np.full(len(cells), np.nan), remarks=(remark("clock_unclear"),))
    nights = np.cumsum(np.diff(given, prepend=given[:1]) < -_DAY_S / 2)
    if nights[-1] and bool(np.all(np.diff(given + _DAY_S * nights) >= 0)):
        time_s[~np.isnan(time_s)] += _DAY_S * nights
        return Stamps(time_s, None, None, interval_s, (remark("past_midnight"),))
    if np.ptp(given) > _DAY_S / 2 and bool(np.any(np.diff(given) < 0)):
        return Stamps(np.full(len(cells), np.nan), remarks=(remark("clock_unclear"),))
    return Stamps(time_s, None, None, interval_s)


def spread_in_intervals(
    time_s: FloatArray, given: NDArray[np.bool_], order: FloatArray | None, interval_s: float
) -> FloatArray | None:
    """Spread readings with the same time evenly over its interval, in their order.

    None where no times are equal, where they do not rise, or where they tell too little.
    """
    rows = np.flatnonzero(given & ~np.isnan(time_s))
    if order is not None:
        rows = rows[np.argsort(order[rows])]
    times, first, count = np.unique(time_s[rows], return_index=True, return_counts=True)
    rising = bool(np.all(np.diff(time_s[rows]) >= 0))
    if times.size == rows.size or times.size < _FEWEST_INTERVALS or not rising:
        return None
    spread = time_s.copy()
    within = np.arange(rows.size) - np.repeat(first, count) + 0.5
    spread[rows] += interval_s * within / np.repeat(count, count)
    return spread


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
